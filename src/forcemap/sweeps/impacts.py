"""Simulated impacts over robots, reactions and places."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from forcemap.lab.bench import simulate_peaks
from forcemap.lab.virtual_robot import VirtualRobot, virtual_robot
from forcemap.sweeps.block import Computed
from forcemap.sweeps.entries import Entries

_IMPACTS_AT_ONCE = 1000  # in a block, unless stated; a choice: a tenth of a second, 80 kB


@dataclass(frozen=True)
class ImpactCase:
    """Phase I peaks of a virtual robot at places and speeds drawn from ranges; not a measurement of any robot.

    Parameters
    ----------
    robot : VirtualRobot
        The robot with its reaction.
    low, high : tuple of float
        Lowest and highest distance [m], height [m] and speed at contact [m/s].
    impacts, at_once : int
        Number of impacts, and of those in a block.
    """

    robot: VirtualRobot
    low: tuple[float, ...]
    high: tuple[float, ...]
    impacts: int
    at_once: int

    means: ClassVar[tuple[str, ...]] = ("peak_force_N",)
    best: ClassVar[tuple[str, bool]] = ("peak_force_N", True)

    @property
    def name(self) -> str:
        """Preset and changes."""
        return self.robot.described

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return math.ceil(self.impacts / self.at_once)

    def compute(self, number: int, rng: np.random.Generator) -> Computed:
        """Places, speeds and peaks."""
        count = min(self.at_once, self.impacts - number * self.at_once)
        d, h, v = rng.uniform(self.low, self.high, (count, 3)).T
        peak = simulate_peaks(self.robot, d, h, v)
        columns = {"distance_m": d, "height_m": h, "speed_mps": v, "peak_force_N": peak}
        return Computed(columns, (f"SIMULATED impacts of {self.name}: not a measurement of any robot",))


def impact_cases(entries: Entries) -> Iterator[ImpactCase]:
    """The cases of a study: every robot with each of its thresholds and payloads."""
    slowest, fastest = entries.span("speeds_mps")
    impacts, at_once = entries.whole("impacts"), entries.whole("block", _IMPACTS_AT_ONCE)
    for table in entries.tables("robots"):
        preset = virtual_robot(table.text("preset"))
        (near, far), (low, high) = table.span("distances_m"), table.span("heights_m")
        thresholds, payloads = table.numbers("thresholds_Nm", []), table.numbers("payloads_kg", [])
        robots = [preset.with_threshold(threshold) for threshold in thresholds] or [preset]
        for robot in (each.with_payload(kg) for each in robots for kg in payloads) if payloads else robots:
            yield ImpactCase(robot, (near, low, slowest), (far, high, fastest), impacts, at_once)
