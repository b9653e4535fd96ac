"""The plan of a campaign as data, and as a file: `plan.csv`, one row a run (one impact to make)."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask, Texts
from forcemap.campaigns import columns
from forcemap.campaigns.state import StateTolerance, identify_states, places
from forcemap.csv_table import csv_cell, csv_text, read_table
from forcemap.errors import InputError
from forcemap.files import read_bytes, write_atomically
from forcemap.findings import Finding
from forcemap.recordings.device import Device

__all__ = ["PLAN_FILE", "Device", "MeasurementPlan", "read_plan", "write_plan"]

PLAN_FILE = "plan.csv"

_NUMBERS = ("distance_m", "height_m", "speed_mps", "base_angle_deg", "expected_force_N")
_COLUMNS = ("recording", "state_id", "repeat", "role", *_NUMBERS)
_ARRAYS = ("state_id", "repeat", "role", "distance", "height", "speed", "base_angle", "expected_force")
_REQUIRED = ("state_id", "repeat", "distance_m", "height_m", "speed_mps")
# The state is part of the name of a file, on any system, and of a line of a printed sheet.
_RUN = re.compile(r"(.+)-r0*([1-9][0-9]{0,8})", re.DOTALL)
_STATE_ID = re.compile(r"[\w.-]{1,36}")
_REPEATS_BEYOND = 1000  # a name with a number from here on is no repeat beyond the plan, but another number
_MINUTES_PER_PLACE, _MINUTES_PER_IMPACT = 10.0, 1.0  # to put up the device, and to make an impact; estimates


@dataclass(frozen=True, eq=False)
class MeasurementPlan:
    """Runs (impacts to make) in the order in which to make them; every array has shape (n,), one entry a run.

    Made by `plan_measurements` or `read_plan`, which check what they are given.

    Parameters
    ----------
    state_id : array of str
        Name of the state; repeats of a state share it.
    repeat : array of int
        Number of the repeat within its state.
    role : array of str
        "train" or "test".
    distance, height : array
        Place [m].
    speed : array
        Speed at contact [m/s].
    base_angle : array
        Angle of the base joint [deg]; NaN is "not stated".
    expected_force : array
        Expected peak force [N]; NaN where nothing tells.
    left_out : tuple of Finding
        Each planned state that was left out, and why. Not in the file.
    warnings : tuple of Finding
        What the plan will not give. Not in the file.
    expected_from : Finding or None
        What the expected forces come from; None if nothing. Not in the file.
    """

    state_id: Texts
    repeat: Indices
    role: Texts
    distance: FloatArray
    height: FloatArray
    speed: FloatArray
    base_angle: FloatArray
    expected_force: FloatArray
    left_out: tuple[Finding, ...] = ()
    warnings: tuple[Finding, ...] = ()
    expected_from: Finding | None = None

    def __len__(self) -> int:
        return int(self.state_id.size)

    @property
    def recording(self) -> Texts:
        """Name, without ending, under which to save the device's file of every run: "<state_id>-r<repeat>"."""
        return np.array([f"{name}-r{repeat}" for name, repeat in zip(self.state_id, self.repeat, strict=True)])

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the planned states, in the order in which they are first measured."""
        return tuple(dict.fromkeys(self.state_id.tolist()))

    @property
    def places(self) -> int:
        """Number of places; those that lie within 20 mm of each other are one."""
        return int(np.unique(places(self.distance, self.height)).size)

    @property
    def set_ups(self) -> int:
        """How often the device is put up: once for consecutive runs at one place."""
        return 1 + int(np.count_nonzero(np.diff(places(self.distance, self.height))))

    @property
    def by_place(self) -> bool:
        """True if states go from place to place, each place once, and not from the slowest speed to the fastest."""
        first = sorted(self.first_row.values())
        place = places(self.distance, self.height)[first]
        once = 1 + np.count_nonzero(np.diff(place)) == np.unique(place).size
        return bool(once and np.any(np.diff(self.speed[first]) < 0))

    @property
    def again(self) -> tuple[str, ...]:
        """States that are measured to train a map, and again at the end with role test: they show drift."""
        roles = (self.state_id[self.role == role].tolist() for role in ("train", "test"))
        return tuple(sorted(set.intersection(*map(set, roles))))

    def minutes(self, place: float = _MINUTES_PER_PLACE, impact: float = _MINUTES_PER_IMPACT) -> float:
        """Duration of the runs [min], from the minutes for putting up the device and for an impact.

        Raises
        ------
        InputError
            Minutes below 0 or not finite.
        """
        for name, duration in (("place", place), ("impact", impact)):
            if not 0 <= duration < np.inf:
                raise InputError(f"minutes per {name}: found {duration:g}, expected minutes from 0 up")
        return place * self.set_ups + impact * len(self)

    def select(self, index: Mask | Indices) -> Self:
        """The runs picked by a mask, or by their numbers."""
        return replace(self, **{name: array[index] for name, array in self.arrays.items()})

    @property
    def arrays(self) -> dict[str, Any]:
        """What is stated of every run, by the name of the attribute."""
        return {name: getattr(self, name) for name in _ARRAYS}

    @cached_property
    def row_of(self) -> dict[tuple[str, int], int]:
        """Row of every run, by state and repeat."""
        return {run: i for i, run in enumerate(zip(self.state_id.tolist(), self.repeat.tolist(), strict=True))}

    @cached_property
    def first_row(self) -> dict[str, int]:
        """First row of every state."""
        return {state: i for i, state in reversed(list(enumerate(self.state_id.tolist())))}

    def run_named(self, name: str) -> tuple[str, int] | None:
        """State and repeat named by a file name without its ending; None if it names no run.

        Capitals do not count, "-r01" is repeat 1, and repeats of a planned state beyond the plan are accepted.
        """
        parts = _RUN.fullmatch(name.lower())
        if parts is None or (state := self._by_lower_case.get(parts[1])) is None:
            return None
        run = state, int(parts[2])
        return run if run[1] < _REPEATS_BEYOND or run in self.row_of else None

    @cached_property
    def _by_lower_case(self) -> dict[str, str]:
        return {state.lower(): state for state in self.states}


def write_plan(plan: MeasurementPlan, path: str | Path, *, remark: str = "") -> None:
    """Write a plan as CSV, into `plan.csv` if `path` is a folder; `read_plan` gives back the same figures.

    Parameters
    ----------
    plan : MeasurementPlan
        The plan.
    path : str or Path
        The file or folder.
    remark : str, optional
        A first line to say what the plan is; reading passes over it.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    cells = {
        column: [csv_cell(value) for value in getattr(plan, name).tolist()]
        for column, name in zip(_COLUMNS, ("recording", *_ARRAYS), strict=True)
    }
    head = f"# {' '.join(remark.split())}\n" if remark else ""
    write_atomically(_file(path), head + csv_text(cells))


def read_plan(path: str | Path, *, tolerance: StateTolerance | None = None) -> MeasurementPlan:
    """Read a plan: a CSV file, or a campaign folder that holds `plan.csv`.

    Commas with decimal points, or semicolons (tabs) with decimal points or commas. Rows may have been added: role,
    base angle, expected force and the name of the recording may be empty. Lines that begin with # are remarks.

    Parameters
    ----------
    path : str or Path
        The file or folder.
    tolerance : StateTolerance, optional
        How far repeats of a state may lie apart; 5 mm and 10 mm/s if not given.

    Returns
    -------
    MeasurementPlan

    Raises
    ------
    TableError
        The file is empty, not text or not a table; a column is missing or unknown; a cell cannot be used; the same
        repeat of a state twice; repeats of a state further apart than the tolerance; states within it of each other.
    """
    file = str(_file(path))
    table = read_table(read_bytes(file), file, what="run", remarked=True)
    table.require_columns(_REQUIRED, _COLUMNS)
    if not table.rows:
        raise table.error("found a header and no run, expected at least one", table.header_row)
    table = table.with_decimal_points(_NUMBERS)
    cells, where, n = table.columns, columns.Where(file, table.rows), len(table.rows)
    numbers = {name: np.array(table.numbers(name, required=name in _REQUIRED)) for name in _NUMBERS if name in cells}
    expected = numbers.pop("expected_force_N", np.full(n, np.nan))
    where.refuse(
        ~(np.isnan(expected) | ((expected > 0) & (expected <= columns.LARGEST_FORCE))),
        "expected_force_N",
        expected,
        "newtons",
    )
    distance, height, speed, angle = (columns.numbers(name, numbers.get(name), where) for name in _NUMBERS[:4])
    names = columns.texts("state_id", cells["state_id"], where)
    unfit = [not _STATE_ID.fullmatch(name) for name in names.tolist()]
    where.refuse(unfit, "state_id", names, "1 to 36 letters, digits, hyphens, points or underscores: it names a file")
    roles = columns.roles([role.lower() for role in cells.get("role", [""] * n)], where)
    repeat = columns.repeats(table.whole_numbers("repeat"), names, where)
    tolerance = tolerance or StateTolerance()
    states = identify_states(np.column_stack([distance, height, speed]), roles, names, tolerance, where)
    for position in np.flatnonzero(states != names)[:1].tolist():
        close = f"found state {str(names[position])!r} as close to {str(states[position])!r} as repeats may be"
        remedy = f"expected one state_id within {tolerance}, or a lower tolerance ([states] in campaign.toml)"
        raise where.error(position, "state_id", f"{close}, {remedy}")
    plan = MeasurementPlan(names, repeat, roles, distance, height, speed, angle, expected)
    _refuse_other_names(plan, cells.get("recording", [""] * n), where)
    return plan


def _file(path: str | Path) -> Path:
    return Path(path) / PLAN_FILE if Path(path).is_dir() else Path(path)


def _refuse_other_names(plan: MeasurementPlan, given: list[str], where: columns.Where) -> None:
    """Names of recordings follow from state and repeat; two must not differ by capitals only, which some disks drop."""
    first: dict[str, int] = {}
    for position, (name, stated) in enumerate(zip(plan.recording.tolist(), given, strict=True)):
        if stated not in ("", name):
            raise where.error(position, "recording", f"found {stated!r}, expected {name!r} or an empty cell")
        if name.lower() in first:
            row = where.rows[first[name.lower()]]
            message = f"found {name!r}, expected a name that differs from that of row {row} by more than capitals"
            raise where.error(position, "state_id", message)
        first[name.lower()] = position
