"""Processes of this machine that work blocks off; none of them outlives the one that started it."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import islice
from multiprocessing.connection import wait as wait_for
from typing import TypeVar

from forcemap.errors import ForcemapError, InputError

Item = TypeVar("Item")
Result = TypeVar("Result")

_OBJECTS = 20_000  # new objects after which unused ones are looked for; a choice: Python's 700 costs 6 % of a report
_AHEAD = 64  # items handed out and not done yet; a choice: enough for every worker of a cluster's tens, no memory


@contextmanager
def pool(workers: int, preload: Iterable[str] = ()) -> Iterator[Executor]:
    """A pool of processes, begun from one that has loaded `preload`; what was not begun at the end is dropped.

    Raises
    ------
    InputError
        Not at least one worker.
    """
    if workers < 1:
        raise InputError(f"workers: found {workers}, expected at least 1")
    context = multiprocessing.get_context("forkserver" if hasattr(os, "fork") else "spawn")
    if hasattr(os, "fork"):
        context.set_forkserver_preload([*preload])
    executor = ProcessPoolExecutor(workers, mp_context=context, initializer=_begin)
    try:
        yield executor
    finally:
        executor.shutdown(cancel_futures=True)


def _begin() -> None:
    """End this process with the one that started it, even if that was killed; Ctrl-C is for that one."""
    gc.freeze()  # what was loaded lives as long as this process: not looked through again and again
    gc.set_threshold(_OBJECTS)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        wait_for([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def results(
    executor: Executor | None, function: Callable[[Item], Result], items: Iterable[Item], ahead: int = _AHEAD
) -> Iterator[tuple[Item, Result | None, str]]:
    """Every item with what the function gives, as it is done, in this process if there is no executor.

    An item whose process or worker was lost has no result but the reason; the others go on as long as there is anyone.
    What is handed out is left to whoever opened the executor: a future cancelled while a broken pool ends its own stops
    the thread that ends the pool's processes (Python 3.11), and the command waits for them for ever.

    Raises
    ------
    ForcemapError
        The pool or the connection to the cluster is gone.
    """
    if executor is None:
        yield from ((item, function(item), "") for item in items)
        return
    left, doing = iter(items), dict[Future[Result], Item]()
    try:
        while True:
            for item in islice(left, ahead - len(doing)):
                doing[executor.submit(function, item)] = item
            if not doing:
                return
            for future in wait(doing, return_when=FIRST_COMPLETED).done:
                item = doing.pop(future)
                try:
                    done = future.result()
                except (BrokenProcessPool, CancelledError):
                    raise
                except Exception as error:
                    yield item, None, f"{type(error).__name__}: {error}"
                else:
                    yield item, done, ""
    except (BrokenProcessPool, CancelledError) as error:
        gone = "a process of the pool was ended" if isinstance(error, BrokenProcessPool) else "the cluster is gone"
        raise ForcemapError(f"{gone}; what is done stays done, run the same again to continue") from None
