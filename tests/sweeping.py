"""Processes of a sweep: the command in a process of its own, a Dask scheduler with workers, what is left of them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

PATIENCE = 120.0  # s; ends what hangs
COMMAND = [sys.executable, "-m", "forcemap"]


def started(*arguments, log, command=COMMAND):
    """A process in a group of its own, whose members `members` finds even when it was killed."""
    with Path(log).open("wb") as out:
        return subprocess.Popen([*command, *map(str, arguments)], stdout=out, stderr=out, start_new_session=True)


def members(group):
    """Processes of a group that still run, from the system's own list."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, of = status.read_text().rpartition(")")[2].split()[:3]
        except OSError:
            continue
        if int(of) == group and state != "Z":
            found.append(int(status.parent.name))
    return found


def until(happened, log=None):
    """Wait until something has happened."""
    end = time.monotonic() + PATIENCE
    while not happened():
        assert time.monotonic() < end, Path(log).read_text() if log else "in vain"
        time.sleep(0.02)


def ended(process):
    """Wait for a process and for all of its group; its exit code."""
    code = process.wait(PATIENCE)
    until(lambda: not members(process.pid))
    return code


def parts(folder):
    return {path.relative_to(folder): path.read_bytes() for path in Path(folder).rglob("*.csv")}


def begun(folder, count):
    """Whether so many parts are there."""
    return lambda: len(list(Path(folder).glob("parts/*/*.csv"))) >= count


@contextmanager
def dask_cluster(folder, workers=2, tls=()):
    """A scheduler on this machine and its workers, each in a process of its own: its address, it, and them."""
    scheme, safe = ("tls", [*tls]) if tls else ("tcp", [])
    dask = [sys.executable, "-m", "dask"]
    common = ["--host", f"{scheme}://127.0.0.1" if tls else "127.0.0.1", *safe]
    log, file = folder / "scheduler.log", folder / "scheduler.json"
    quiet = ["--no-dashboard", "--port", "0", "--scheduler-file", file]
    processes = [started("scheduler", *common, *quiet, log=log, command=dask)]
    try:
        until(file.exists, log)
        until(lambda: f"{scheme}://127.0.0.1" in file.read_text(), log)
        address = file.read_text().split('"address": "')[1].split('"')[0]
        for number in range(workers):
            worker = ["worker", address, *common, "--nthreads", "1", "--no-dashboard", "--no-nanny"]
            log = folder / f"worker{number}.log"
            processes.append(started(*worker, "--local-directory", folder / "spill", log=log, command=dask))
            until(lambda log=log: "Registered to" in log.read_text(), log)
        yield address, processes[0], processes[1:]
    finally:
        for process in processes:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait(PATIENCE)
    for process in processes:
        until(lambda process=process: not members(process.pid))
