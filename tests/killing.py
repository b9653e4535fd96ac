"""A command in a process of its own, killed as it makes one of its calls; the same number is the same moment."""

from __future__ import annotations

import io
import multiprocessing
import os
import signal
import sys
import time

_WRITING = {"open", "write", "flush", "close", "fsync", "replace", "unlink", "mkdir"}
_FILES = (io.FileIO, io.BufferedWriter, io.TextIOWrapper)
_PROCESSES = multiprocessing.get_context("forkserver")
_PROCESSES.set_forkserver_preload(["forcemap.cli.app", "forcemap.report", "scipy.stats"])
PATIENCE = 300.0  # s; ends what hangs


def run_until(arguments, said, *, call=None, writing=False, enough=None):
    """Run a command until it makes so many calls in C, of all or of those that write files; 0 counts them to the end.

    What it prints goes into the file `said`; one that goes on for ever is interrupted once it has said `enough`. Gives
    the numbers of calls it made in the end, all and writing; None if it was killed.
    """
    ours, theirs = _PROCESSES.Pipe(duplex=False)
    process = _PROCESSES.Process(target=_run, args=([str(each) for each in arguments], said, call, writing, theirs))
    said.unlink(missing_ok=True)
    process.start()
    theirs.close()
    until = time.monotonic() + PATIENCE
    while enough and process.is_alive() and not (said.exists() and enough in said.read_text()):
        assert time.monotonic() < until, said.read_text()
        time.sleep(0.01)
    if enough and process.is_alive():
        os.kill(process.pid, signal.SIGINT)
    process.join(PATIENCE)
    assert process.exitcode in (0, -signal.SIGKILL), said.read_text()
    try:
        return ours.recv() if process.exitcode == 0 else None
    finally:
        ours.close()


def _run(arguments, said, call, writing, done):
    signal.signal(signal.SIGINT, signal.default_int_handler)
    into = os.open(said, os.O_CREAT | os.O_WRONLY | os.O_TRUNC, 0o600)
    for descriptor in (1, 2):
        os.dup2(into, descriptor)
    sys.stdout.reconfigure(line_buffering=True)
    from forcemap.cli.app import run

    calls = [0, 0]

    def count(_, event, called):
        if event != "c_call":
            return
        calls[0] += 1
        writes = called.__name__ in _WRITING and (called.__module__ == "posix" or isinstance(called.__self__, _FILES))
        calls[1] += writes
        if calls[writing] == call and (writes or not writing):
            os.kill(os.getpid(), signal.SIGKILL)

    sys.setprofile(None if call is None else count)
    run(arguments)
    sys.setprofile(None)
    done.send(tuple(calls))
