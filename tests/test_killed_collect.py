"""`forcemap collect` killed at any moment: what was recorded is there whole, and the next run completes it."""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import forcemap as fm
from forcemap.lab.example_campaigns import simulate_example
from pulses import collect, write_campaign

SEED = 202615
FILES = ("recordings.csv", "impacts.csv")
COLLECT = (sys.executable, "-c", "from forcemap.cli import main; main()", "collect")
COUNTED = Path("/proc/self/io").exists()


@pytest.fixture(scope="module")
def campaign(tmp_path_factory, full_size):
    """A folder of recordings; its two files before and after a whole run, and how many bytes that reads.

    Once from nothing, once from the files of six sevenths of the recordings: these rows stay first. The recordings are
    345 at full size, and 81.
    """
    folder = tmp_path_factory.mktemp("killed") / "campaign"
    if full_size:
        simulate_example("ur10e", folder)
    else:
        write_campaign(folder, repeats=3)
    late = sorted((folder / "recordings").iterdir())[::7]
    aside = folder.parent / "aside"
    aside.mkdir()
    for path in late:
        shutil.move(path, aside / path.name)
    collect(folder)
    old = contents(folder)
    for path in late:
        shutil.move(aside / path.name, path)
    process, most = started(folder), 0
    while process.poll() is None:
        most = max(most, bytes_read(process))
        time.sleep(0.001)
    assert process.returncode == 0
    assert not COUNTED or most > size(folder)
    added = (old, contents(folder))
    nothing = dict.fromkeys(FILES)
    reset(folder, nothing)
    collect(folder)
    return folder, added, (nothing, contents(folder)), most


def contents(folder):
    return {name: (folder / name).read_bytes() if (folder / name).exists() else None for name in FILES}


def size(folder):
    """The bytes of all recordings."""
    return sum(path.stat().st_size for path in (folder / "recordings").iterdir())


def reset(folder, files):
    for name, content in files.items():
        if content is None:
            (folder / name).unlink(missing_ok=True)
        else:
            (folder / name).write_bytes(content)


def started(folder):
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen([*COLLECT, folder, "--json"], **quiet)


def bytes_read(process):
    """How many bytes a process has read so far: how far it is, on a machine of any speed."""
    try:
        return int(Path(f"/proc/{process.pid}/io").read_text().split()[1])
    except (OSError, IndexError):  # it has just ended, or there is no such count
        return 0


def check_files(folder, before, new):
    """Each file is absent, the old one or the new one; no earlier row is lost; the folder can be read and collected."""
    found = contents(folder)
    for name in FILES:
        assert found[name] in (before[name], new[name]), f"{name} is neither the old nor the new one"
        if before[name]:
            assert set(before[name].splitlines()) <= set(found[name].splitlines())
    campaign = fm.read_campaign(folder)
    recordings = len(list((folder / "recordings").iterdir()))
    assert len(campaign.files()) == recordings in (81, 345)
    if found["impacts.csv"]:
        assert len(fm.read_dataset(folder)) in (recordings - -(-recordings // 7), recordings)
    collect(folder)
    assert contents(folder) == new
    return found


@pytest.mark.skipif(not COUNTED, reason="there is no /proc to see how far a process is")
def test_killed_at_random_moments(campaign, full_size):
    folder, added, from_nothing, most = campaign
    first = max(0, most - 2 * size(folder))  # before, a small campaign's run only loads the program
    moments = np.random.default_rng(SEED).uniform(first, most, 50 if full_size else 8)
    for number, moment in enumerate(moments):
        before, new = from_nothing if number % 3 == 0 else added
        reset(folder, before)
        process = started(folder)
        while process.poll() is None and bytes_read(process) < moment:
            time.sleep(0.001)
        process.kill()
        process.wait()
        check_files(folder, before, new)


def test_killed_while_the_files_are_written(campaign, full_size):
    """Killed as soon as something new stands in the folder: a temporary file, or the first of the two."""
    folder, (old, new), _, most = campaign
    between = 0
    for number in range(30 if full_size else 3):
        reset(folder, old)
        for path in folder.glob(".*"):
            path.unlink()
        wait_for_second = number % 2
        process = started(folder)
        while process.poll() is None and bytes_read(process) < most / 2:  # nothing is written yet
            if not COUNTED:
                break
            time.sleep(0.001)
        while process.poll() is None:
            temporary = [path.name for path in folder.glob(".*")]
            if any(name.startswith(f".{FILES[wait_for_second]}") for name in temporary):
                break
        process.kill()
        process.wait()
        found = check_files(folder, old, new)
        between += found["recordings.csv"] == new["recordings.csv"] and found["impacts.csv"] == old["impacts.csv"]
    print(f"\nkilled between the two files: {between}")


def test_what_a_killed_run_leaves_is_read_as_nothing(tmp_path):
    folder = write_campaign(tmp_path / "campaign")
    collect(folder)
    whole = contents(folder)
    for name in (".impacts.csv.x1", ".recordings.csv.x2", ".plan.csv.x3", "recordings/.d500-h200-v100-r2.csv.x4"):
        (folder / name).write_bytes(whole["impacts.csv"][:100])
    collect(folder)
    assert contents(folder) == whole
