"""Processes of this machine that work blocks off; none of them outlives the one that started it."""

from __future__ import annotations

import gc
import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager, suppress
from functools import partial
from itertools import islice
from multiprocessing.connection import Connection, wait as wait_for
from multiprocessing.context import BaseContext
from queue import SimpleQueue
from typing import TypeVar, cast

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
    processes = [_Process(context) for _ in range(workers)]
    executor = _Pool(processes)
    try:
        yield executor
    finally:
        executor.shutdown(cancel_futures=True)
        for process in processes:
            process.end()


class _Pool(ThreadPoolExecutor):
    """A thread asks a process and waits for its answer.

    Every process has a pipe of its own, which nobody else holds open: it ends when the process does, wherever that was.
    The processes of Python's own pool share one, and it waits for ever for the rest of what one of them was killed in.
    """

    def __init__(self, processes: list[_Process]) -> None:
        super().__init__(len(processes))
        self._idle = SimpleQueue[_Process]()
        for process in processes:
            self._idle.put(process)

    def submit(self, function: Callable[..., Result], /, *args: object, **named: object) -> Future[Result]:
        return super().submit(self._ask, partial(function, *args, **named))

    def _ask(self, work: Callable[[], Result]) -> Result:
        process = self._idle.get()
        try:
            return process.ask(work)
        finally:
            self._idle.put(process)


class _Process:
    """A process that works, and the pipe to it."""

    def __init__(self, context: BaseContext) -> None:
        self._pipe, there = context.Pipe()
        self._process = context.Process(target=_work, args=(there,))  # type: ignore[attr-defined]
        self._process.start()
        there.close()

    def ask(self, work: Callable[[], Result]) -> Result:
        """What the process gives; _Failed if the work did, BrokenExecutor if the process was ended."""
        sent = pickle.dumps(work)
        try:
            self._pipe.send_bytes(sent)
            found, failure = pickle.loads(self._pipe.recv_bytes())
        except (EOFError, OSError) as error:
            raise BrokenExecutor from error
        if failure:
            raise _Failed(failure)
        return cast(Result, found)

    def end(self) -> None:
        self._pipe.close()
        self._process.join()


class _Failed(Exception):
    """What a process of the pool says of work that failed."""


def _work(pipe: Connection) -> None:
    """Answer until the other end of the pipe is closed."""
    _begin()
    with suppress(EOFError):
        while True:
            sent = pipe.recv_bytes()
            try:
                answer = pickle.dumps((pickle.loads(sent)(), ""))
            except Exception as error:
                answer = pickle.dumps((None, _reason(error)))
            pipe.send_bytes(answer)


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
    What is handed out is left to whoever opened the executor.

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
                except (BrokenExecutor, CancelledError):
                    raise
                except Exception as error:
                    yield item, None, _reason(error)
                else:
                    yield item, done, ""
    except (BrokenExecutor, CancelledError) as error:
        gone = "a process of the pool was ended" if isinstance(error, BrokenExecutor) else "the cluster is gone"
        raise ForcemapError(f"{gone}; what is done stays done, run the same again to continue") from None


def _reason(error: Exception) -> str:
    return str(error) if isinstance(error, _Failed) else f"{type(error).__name__}: {error}"
