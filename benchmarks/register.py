"""How quickly the team's register takes in campaigns and answers, from 10^4 to 10^6 recordings, on both databases.

Folders are made as `collect` leaves them and entered one after the other, as `forcemap register enter` does; releases
and changes of firmware come on top. Prints the table of docs/register.md; --write puts it there. It needs the
programs of PostgreSQL's server, half an hour and a gigabyte of disk; `--most 100000` takes a tenth of it.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from forcemap.campaigns.recordings_table import _entries
from forcemap.register.audit import Action, verify
from forcemap.register.connection import Register
from forcemap.register.due import what_is_due
from forcemap.register.enter import change, enter
from forcemap.register.exceeded import where_exceeded
from forcemap.register.folder import read_content
from forcemap.register.relying import relying_on_condition, relying_on_device, relying_on_map, relying_on_recording
from forcemap.register.schema import make_register
from forcemap.register.states import cell_state
from forcemap.register.tables import RELEASES
from postgres import Server
from register_folders import collected

DOCUMENT = Path(__file__).parents[1] / "docs" / "register.md"
HEAD, END = "<!-- register -->", "<!-- table -->"
EACH, OF_A_CELL = 200, 5  # recordings of a campaign, campaigns of a cell
DURABLE = "-c listen_addresses='' -c shared_buffers=256MB -c max_wal_size=4GB"
Times = dict[str, float]


def milliseconds(function: Callable[[], object], again: int = 9) -> float:
    """The shortest of several times [ms]."""
    times = []
    for _ in range(again):
        start = time.perf_counter()
        function()
        times.append(1000 * (time.perf_counter() - start))
    return min(times)


def add_release(register: Register, content: Any, campaign: int, before: int | None) -> int:
    """A release as `release` enters it, without the map and the report that it would fit and read first."""
    calibrated, until = content.calibration
    speeds = {"lowest_to_program_mps": 0.1, "highest_to_program_mps": 0.2, "zones": 1, "zones_with_a_speed": 1}
    with register.writing() as connection:
        action = Action(register, connection, "benchmark")
        number = action.add(
            RELEASES,
            cell_id=1 + campaign // OF_A_CELL,
            campaign_id=campaign + 1,
            subject="workspace",
            areas="chest",
            contact="transient",
            bound="tolerance",
            speeds=json.dumps(speeds),
            report_sha256=content.sha256,
            conditions=json.dumps(content.conditions),
            person=action.person,
            at=action.at,
            map_sha256=content.sha256,
            valid_until="2099-12-31",
            measured_on="2026-02-01",
            calibrated=calibrated,
            calibrated_until=until,
            limit_N=280.0,
            device_spring_N_per_m=75000.0,
            area_spring_N_per_m=25000.0,
            simulated=1,
            replaces=before,
        )
        action.done("release", f"release {number}")
    return number


def questions_of(register: Register, content: Any) -> dict[str, Callable[[], object]]:
    """What is asked, by what it is called in the table."""
    digest, cell = content.campaign.entries[7].sha256, f"{content.protocol.site}/{content.protocol.cell}"
    return {
        "state of a cell": lambda: cell_state(register, cell),
        "who has a recording": lambda: relying_on_recording(register, digest),
        "who has a map": lambda: relying_on_map(register, content.sha256),
        "who was measured with a device": lambda: relying_on_device(register, "D7"),
        "who has a firmware": lambda: relying_on_condition(register, "firmware", "5.12"),
        "what is due, all cells: changed conditions": lambda: what_is_due(register),
        "exceeded 280 N": lambda: where_exceeded(register, 280.0),
    }


def grown(registers: dict[str, Register], most: int) -> dict[str, dict[int, Times]]:
    """Times of every database at every size up to the most recordings."""
    found: dict[str, dict[int, Times]] = {name: {} for name in registers}
    spent, releases = dict.fromkeys(registers, 0.0), {name: dict[int, int]() for name in registers}
    sizes, entered = [size for size in (10**4, 10**5, 10**6) if size <= most], 0
    home = Path(tempfile.mkdtemp(prefix="forcemap-register-"))
    for number in range(most // EACH):
        cell = number // OF_A_CELL
        stated = {"cell": f"cell-{cell:04d}", "site": f"site-{cell % 20}", "serial": f"D{cell % 50}"}
        folder = collected(home / f"campaign-{number:05d}", EACH, number, scale=0.55, simulated="true", **stated)
        for name, register in registers.items():
            _entries.cache_clear()  # each reads the folder for itself
            start = time.perf_counter()
            enter(register, folder)
            spent[name] += time.perf_counter() - start
        content = read_content(folder)
        for name, register in registers.items():
            releases[name][cell] = add_release(register, content, number, releases[name].get(cell))
            if cell % 10 == 3 and number % OF_A_CELL == OF_A_CELL - 1:
                change(register, f"{stated['site']}/{stated['cell']}", {"firmware": "5.12"}, person="benchmark")
        shutil.rmtree(folder)
        entered += EACH
        if entered in sizes:
            before = sizes[sizes.index(entered) - 1] if sizes.index(entered) else 0
            for name, register in registers.items():
                times = {"recordings a second": (entered - before) / spent[name]}
                times |= {what: milliseconds(ask) for what, ask in questions_of(register, content).items()}
                found[name][entered], spent[name] = times, 0.0
                print(entered, name, json.dumps(times), file=sys.stderr, flush=True)
    shutil.rmtree(home)
    return found


def verified(register: Register) -> float:
    """Seconds that `verify` takes."""
    start = time.perf_counter()
    with register.reading() as connection:
        assert verify(connection) == ()
    return time.perf_counter() - start


def table(found: dict[str, dict[int, Times]], whole: Times) -> str:
    """The table of the page."""
    columns = [(name, size) for name in found for size in found[name]]
    lines = ["| | " + " | ".join(f"{name}, {size:,}" for name, size in columns) + " |", "|---|" + "---|" * len(columns)]
    for what in next(iter(found["SQLite"].values())):
        unit = "" if what.endswith("second") else " [ms]"
        cells = (f"{found[name][size][what]:,.{0 if not unit else 1}f}" for name, size in columns)
        lines.append(f"| {what}{unit} | " + " | ".join(cells) + " |")
    most = max(found["SQLite"])
    seconds = " and ".join(f"{time:.0f} s on {name}" for name, time in whole.items())
    return "\n".join([*lines, "", f"`verify` of all of it, {most:,} recordings: {seconds}."])


def main() -> None:
    """Measure, print, and write the page if asked to."""
    stated = argparse.ArgumentParser(description=__doc__)
    stated.add_argument("--most", type=int, default=10**6)
    stated.add_argument("--write", action="store_true")
    options = stated.parse_args()
    server, file = Server(DURABLE), Path(tempfile.mkdtemp(prefix="forcemap-register-")) / "register.sqlite"
    try:
        registers = {"SQLite": make_register(str(file))[0], "PostgreSQL": make_register(server.new("register"))[0]}
        found = grown(registers, options.most)
        text = table(found, {name: verified(register) for name, register in registers.items()})
        print(f"{text}\n\nSQLite's file: {file.stat().st_size / 1e6:.0f} MB")
        for register in registers.values():
            register.engine.dispose()
    finally:
        server.close()
        shutil.rmtree(file.parent)
    if options.write:
        page = DOCUMENT.read_text()
        before, _, rest = page.partition(HEAD)
        DOCUMENT.write_text(f"{before}{HEAD}\n\n{text}\n\n{END}{rest.partition(END)[2]}")


if __name__ == "__main__":
    main()
