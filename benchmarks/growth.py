"""What work costs as it grows: campaigns of a fleet, blocks of a sweep, with one worker, two and, on paper, a thousand.

Prints the tables of docs/benchmarks.md, "As work grows"; --write puts them there. Needs a quiet machine of two cores.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TESTS = Path(__file__).parents[1] / "tests"
sys.path.insert(0, str(TESTS))  # their campaigns and clusters serve here, too

from sweeping import dask_cluster  # noqa: E402
from test_fleet import DAY, campaign  # noqa: E402

DOCUMENT = Path(__file__).parents[1] / "docs" / "benchmarks.md"
HEAD, END = "<!-- growth -->", "<!-- end of growth -->"
FORCEMAP = [sys.executable, "-m", "forcemap"]
UNCHANGED, MADE, BLOCKS, WORKERS = (10, 100, 1000, 10000), (10, 30, 100), (25, 100, 400), (1, 2)
STUDY = """schema = "forcemap-study/1"
kind = "impacts"
speeds_mps = [0.1, 0.4]
impacts = {impacts}
block = 500
[[robots]]
preset = "ur10e-like"
distances_m = [0.55, 0.85]
heights_m = [0.15, 0.45]
"""


def seconds(*arguments: object) -> float:
    """Wall time of a command [s]."""
    start = time.perf_counter()
    done = subprocess.run([*FORCEMAP, *map(str, arguments)], capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stdout + done.stderr)
    return time.perf_counter() - start


def fleets(home: Path) -> list[str]:
    """Campaigns of 27 states, unchanged and made again."""
    folders = [campaign(home / "cells" / f"c{i}", i) for i in range(max(MADE))]
    made = {}
    for count in MADE:
        for workers in WORKERS:
            for folder in folders[:count]:
                (folder / "report.html").unlink(missing_ok=True)
            line = [
                *folders[:count],
                "-o",
                home / "fleet.html",
                "--date",
                DAY,
                "--area",
                "hand_fingers",
                "--workers",
                workers,
            ]
            made[count, workers] = seconds("fleet", *line)
    unchanged = []
    for count in UNCHANGED:
        names = [home / f"of{count}-{i}" for i in range(count)]
        for i, name in enumerate(names):
            name.symlink_to(folders[i % len(folders)])
        unchanged.append(seconds("fleet", *names, "-o", home / "fleet.html", "--date", DAY, "--area", "hand_fingers"))
    lines = ["| campaigns, unchanged | " + " | ".join(map(str, UNCHANGED)) + " |", "|---" * (len(UNCHANGED) + 1) + "|"]
    per_campaign = [f"{1000 * wall / count:.0f}" for wall, count in zip(unchanged, UNCHANGED, strict=True)]
    lines += ["| ms a campaign, start-up included | " + " | ".join(per_campaign) + " |", ""]
    return lines + growth("campaigns made again", "campaign", made)


def growth(what: str, one: str, walls: dict[tuple[int, int], float]) -> list[str]:
    """Rows of a table: time of each, start-up included, and how well two workers use two processors."""
    counts = sorted({count for count, _ in walls})
    lines = [f"| {what} | " + " | ".join(map(str, counts)) + " |", "|---" * (len(counts) + 1) + "|"]
    for workers, name in zip(WORKERS, ("one worker", "two workers"), strict=True):
        each = [f"{1000 * walls[count, workers] / count:.0f}" for count in counts]
        lines.append(f"| {name}, ms a {one} | " + " | ".join(each) + " |")
    shares = [f"{walls[count, 1] / walls[count, 2] / 2:.2f}" for count in counts]
    return [*lines, "| efficiency of the two | " + " | ".join(shares) + " |", ""]


def sweeps(home: Path) -> list[str]:
    """Blocks of 500 simulated impacts."""
    walls = {}
    study = home / "study.toml"
    for count in BLOCKS:
        study.write_text(STUDY.format(impacts=500 * count))
        for workers in WORKERS:
            walls[count, workers] = seconds("sweep", study, "-o", home / f"s{count}-{workers}", "--workers", workers)
    return growth("blocks of a sweep", "block", walls)


def on_a_cluster(home: Path) -> list[str]:
    """What scheduler and command do for a block, and how long blocks have to be for a thousand workers."""
    ticks, study, spent = os.sysconf("SC_CLK_TCK"), home / "study.toml", {}
    for count in (50, 450):
        study.write_text(STUDY.format(impacts=500 * count))
        (own := home / f"cluster{count}").mkdir()
        with dask_cluster(own) as (address, scheduler, _):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            seconds("sweep", study, "-o", home / f"d{count}", "--dask", address)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            used = Path(f"/proc/{scheduler.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
        spent[count] = sum(map(int, used)) / ticks, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    dispatch, gather = ((spent[450][k] - spent[50][k]) / 400 for k in (0, 1))
    return [
        f"On a Dask cluster the scheduler computes {1000 * dispatch:.1f} ms for a block, and the command that writes "
        f"the parts {1000 * gather:.1f} ms: the difference of 450 and 50 blocks. A thousand workers are all busy while "
        f"a block lasts at least {1000 * max(dispatch, gather):.0f} s; `block` in the study makes blocks longer. "
        "That is worked out on paper: no thousand workers were there.",
    ]


def main() -> None:
    """Run everything and print or write the tables."""
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        lines = [*fleets(home), *sweeps(home), *on_a_cluster(home)]
    print("\n".join(lines))
    if "--write" in sys.argv:
        before, rest = DOCUMENT.read_text().split(HEAD)
        DOCUMENT.write_text("\n".join([before + HEAD, "", *lines, "", END + rest.split(END)[1]]))


if __name__ == "__main__":
    main()
