"""Files judged by several processes at once."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

from forcemap.campaigns.readout import FileReadout

FEWEST_FILES = 60
"""Of fewer files one process makes shorter work: two took as long at some 20 of 2,000 samples. A choice."""

_Judge = Callable[[str], FileReadout]


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else 1


@contextmanager
def in_processes(judge: _Judge, files: Sequence[str], workers: int) -> Iterator[_Judge]:
    """A judge of these files whose work is done ahead by several processes; each is asked for once.

    Every process has its share and ends when this one does, however it ends. What a process that was killed leaves
    undone is done here. Processes are forked, which is safe in a program without threads: where it runs others, or
    the system is not Linux, all is done here.

    Parameters
    ----------
    judge : callable
        Judges a file.
    files : sequence of str
    workers : int
        Number of processes; with 1, or few files, none is started.
    """
    if workers < 2 or len(files) < FEWEST_FILES or sys.platform != "linux":
        yield judge
        return
    share = {file: number % workers for number, file in enumerate(files)}
    done: dict[str, FileReadout] = {}
    with ExitStack() as started:
        ends = [started.enter_context(_started(judge, files[first::workers])) for first in range(workers)]

        def judged(file: str) -> FileReadout:
            with suppress(EOFError, OSError):  # the process was killed
                while file in share and file not in done:
                    name, shown = ends[share[file]].recv()
                    done[name] = shown
            return done.pop(file, None) or judge(file)

        yield judged


@contextmanager
def _started(judge: _Judge, files: Sequence[str]) -> Iterator[Connection]:
    """A process that judges these files, in order, and the end of the pipe at which they come out."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    process: BaseProcess = context.Process(target=_judge_all, args=(judge, files, theirs, ours), daemon=True)
    process.start()
    theirs.close()
    try:
        yield ours
    finally:
        ours.close()
        process.terminate()
        process.join()


def _judge_all(judge: _Judge, files: Sequence[str], out: Connection, other_end: Connection) -> None:
    """Send every file's readout; whatever fails here is done again, and said, by the process that asked."""
    other_end.close()  # so that the pipe is broken once the process that asked has ended
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt is the other process's to say
    with suppress(Exception):
        for file in files:
            out.send((file, judge(file)))
