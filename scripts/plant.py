"""A plant of fifty cells over a year, simulated, in a register: what happened, and what it then answers.

Run from the root of the project: python scripts/plant.py build/plant [--cells 50] [--register URL]

The virtual lab measures one robot; every cell has its own serial numbers, day of measurement and device. In the course
of the year firmware is updated, tools are changed, cells are measured again, a release is withdrawn. The questions of
docs/register.md are asked in the end, and can be asked of build/plant/register.sqlite afterwards.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import re
import shutil
import sys
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

import forcemap as fm
from forcemap.cli.app import run
from forcemap.lab.example_campaigns import example_plan
from forcemap.lab.simulated_campaign import simulate_campaign
from forcemap.lab.simulated_device import SimulatedDevice
from forcemap.lab.virtual_robot import virtual_robot
from forcemap.register.connection import Register
from forcemap.register.enter import change, enter
from forcemap.register.release import release, withdraw
from forcemap.register.schema import make_register

DAYS = 330  # from the first entry to today
AREA = "chest"
QUESTIONS = (
    "register due",
    "register state cell-07",
    "register who --firmware 5.11",
    "register who --device PF-2",
    "register exceeded --limit-N 280",
    "register verify",
)


class Plant:
    """The cells with their register, whose clock runs through the year."""

    def __init__(self, home: Path, register: Register, cells: int) -> None:
        self.home, self.cells = home, [f"cell-{number:02d}" for number in range(1, cells + 1)]
        self._begin = self._now = datetime.now(UTC) - timedelta(days=DAYS)
        self.register = replace(register, time=lambda: self._now)
        self.firmware = dict.fromkeys(self.cells, "5.11")
        self.lab = home / "lab"
        robot, rng = virtual_robot("ur10e-like"), np.random.default_rng(7)
        simulate_campaign(example_plan("ur10e"), robot, SimulatedDevice(), rng, self.lab)

    def day(self, number: int) -> None:
        """Go on to a day of the year."""
        self._now = self._begin + timedelta(days=number)

    def date(self, days: int = 0) -> str:
        """The date, or that of some days later."""
        return (self._now + timedelta(days=days)).date().isoformat()

    def measured(self, cell: str) -> Path:
        """A campaign of a cell, collected, reported and entered."""
        folder, number = self.home / f"{cell}-{self.date()}", int(cell.rpartition("-")[2])
        shutil.copytree(self.lab, folder)
        stated = {"date": self.date(), "robot.controller": "CB5", "robot.firmware": self.firmware[cell]}
        stated |= {"tool.name": "gripper", "tool.covers": "none", "device.calibrated": self.date(-90)}
        stated |= {
            "protocol.site": f"hall-{1 + number % 4}",
            "protocol.cell": cell,
            "protocol.program": "line, version 3",
        }
        stated |= {
            "protocol.robot_serial_number": f"R{number:03d}",
            "protocol.controller_serial_number": f"C{number:03d}",
        }
        stated |= {"protocol.safety_checksum": "A1B2", "protocol.device_serial_number": f"PF-{number % 3}"}
        toml = folder / "campaign.toml"
        toml.write_text(with_entries(toml.read_text(), stated))
        fm.build_dataset(fm.read_campaign(folder))
        report = ["report", str(folder), "--area", AREA, "--date", self.date()]
        with contextlib.redirect_stdout(io.StringIO()):
            assert run(report) == 0
        enter(self.register, folder, person="operator")
        return folder

    def release(self, cell: str, folder: Path, days: int) -> int:
        """Release a campaign for so many days."""
        limits = [(fm.force_limit(AREA), fm.Contact.TRANSIENT)]
        until = self.date(days)
        return release(self.register, cell, folder, limits=limits, valid_until=until, person="safety officer").release

    def change(self, cell: str, **conditions: str) -> None:
        """Enter what has changed at a cell."""
        self.firmware[cell] = conditions.get("firmware", self.firmware[cell])
        change(self.register, cell, conditions, person="operator")


def with_entries(text: str, stated: dict[str, str]) -> str:
    """A campaign.toml with these entries in place of what it states of them."""
    for entry, value in stated.items():
        section, _, key = entry.rpartition(".")
        head = f"[{section}]\n" if section else ""
        if head and head not in text:
            text += f"\n{head}"
        before, _, after = text.partition(head) if head else ("", "", text)
        own, *further = re.split(r"(?m)^(?=\[)", after, maxsplit=1)
        own = re.sub(rf"(?m)^{key} = .*\n", "", own)
        text = f'{before}{head}{key} = "{value}"\n{own}{"".join(further)}'
    return text


def year(plant: Plant) -> None:
    """What happens in the plant."""
    releases: dict[str, int] = {}
    for number, cell in enumerate(plant.cells):
        plant.day(2 * number // 3)
        releases[cell] = plant.release(cell, plant.measured(cell), 340 if number % 5 else 320)
        print(f"{cell} measured and released", file=sys.stderr)
    plant.day(150)
    updated = plant.cells[1::4]
    for cell in updated:
        plant.change(cell, firmware="5.12")
    for number, cell in enumerate(updated[: len(updated) // 2]):
        plant.day(160 + number)
        releases[cell] = plant.release(cell, plant.measured(cell), 365)
    plant.day(200)
    for cell in plant.cells[6::20]:
        plant.change(cell, tool="gripper with longer fingers")
    plant.day(230)
    withdraw(plant.register, releases[plant.cells[3]], "a person was pinched at the fixture", person="safety officer")
    plant.day(250)
    plant.change(plant.cells[0], robot="another UR10e, R900")
    plant.day(260)
    plant.change(plant.cells[2], safety_checksum="?")


def main() -> None:
    """Make the plant, and ask."""
    stated = argparse.ArgumentParser(description=__doc__)
    stated.add_argument("folder", type=Path)
    stated.add_argument("--cells", type=int, default=50)
    stated.add_argument("--register", default="")
    options = stated.parse_args()
    options.folder.mkdir(parents=True)
    where = options.register or str(options.folder / "register.sqlite")
    with make_register(where)[0] as register:
        year(Plant(options.folder, register, options.cells))
    for question in QUESTIONS:
        print(f"\n$ forcemap {question}")
        run([*question.split(), "--register", where])


if __name__ == "__main__":
    main()
