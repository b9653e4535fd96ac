"""The plan of a campaign as data, and as a file: `plan.csv`, one row a run (one impact to make)."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcemap.arrays import FloatArray, Indices
from forcemap.campaigns import columns
from forcemap.campaigns.impacts_table import PLAN_FILE
from forcemap.campaigns.state import StateTolerance, identify_states
from forcemap.csv_table import csv_text, read_table
from forcemap.errors import TableError, nearest_names
from forcemap.files import read_bytes, write_atomically
from forcemap.recordings.device import Device

__all__ = ["PLAN_FILE", "Device", "MeasurementPlan", "read_plan", "write_plan"]


_REMARK = "#"

_NUMBERS = ("distance_m", "height_m", "speed_mps", "base_angle_deg", "expected_force_N")
_COLUMNS = ("recording", "state_id", "repeat", "role", *_NUMBERS)
_REQUIRED = ("state_id", "repeat", "distance_m", "height_m", "speed_mps")
# The state is part of the name of a file, on any system, and of a line of a printed sheet.
_STATE_ID = re.compile(r"[\w.-]{1,36}")


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
    left_out : tuple of str
        Each planned state that was left out, and why. Not in the file.
    warnings : tuple of str
        What the plan will not give. Not in the file.
    expected_from : str
        What the expected forces come from; empty if nothing. Not in the file.
    """

    state_id: NDArray[np.str_]
    repeat: Indices
    role: NDArray[np.str_]
    distance: FloatArray
    height: FloatArray
    speed: FloatArray
    base_angle: FloatArray
    expected_force: FloatArray
    left_out: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    expected_from: str = ""

    def __len__(self) -> int:
        return int(self.state_id.size)

    @property
    def recording(self) -> NDArray[np.str_]:
        """Name, without ending, under which to save the device's file of every run: "<state_id>-r<repeat>"."""
        return np.array([f"{name}-r{repeat}" for name, repeat in zip(self.state_id, self.repeat, strict=True)])

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the planned states, in the order in which they are first measured."""
        return tuple(dict.fromkeys(self.state_id.tolist()))


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
    fields = ("recording", "state_id", "repeat", "role", "distance", "height", "speed", "base_angle", "expected_force")
    cells = {
        column: [
            "" if isinstance(cell, float) and math.isnan(cell) else str(cell) for cell in getattr(plan, name).tolist()
        ]
        for column, name in zip(_COLUMNS, fields, strict=True)
    }
    head = f"{_REMARK} {' '.join(remark.split())}\n" if remark else ""
    write_atomically(_file(path), head + csv_text(cells))


def read_plan(path: str | Path, *, tolerance: StateTolerance | None = None) -> MeasurementPlan:
    """Read a plan: a CSV file, or a campaign folder that holds `plan.csv`.

    Commas with decimal points, or semicolons (tabs) with decimal points or commas. Rows may have been added: role,
    base angle, expected force and the name of the recording may be empty. A first line that begins with # is a remark.

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
        repeat of a state twice; repeats of a state further apart than the tolerance; one state under two names.
    """
    file = str(_file(path))
    table = read_table(_without_remark(read_bytes(file)), file, what="run")
    _require_columns(list(table.columns), file, table.header_row)
    if not table.rows:
        raise TableError("found a header and no run, expected at least one", file=file, row=table.header_row)
    table = table.with_decimal_points(_NUMBERS)
    cells, where, n = table.columns, columns.Where(file, table.rows), len(table.rows)
    numbers = {
        column: np.array(table.numbers(column, required=column in _REQUIRED)) for column in _NUMBERS if column in cells
    }
    expected = numbers.pop("expected_force_N", np.full(n, np.nan))
    where.refuse(~(np.isnan(expected) | ((expected > 0) & (expected <= 1e5))), "expected_force_N", expected, "newtons")
    checked = {name: columns.numbers(name, numbers.get(name), n, where) for name in _NUMBERS[:4]}
    names = columns.texts("state_id", cells["state_id"], n, where)
    unfit = [not _STATE_ID.fullmatch(name) for name in names.tolist()]
    where.refuse(unfit, "state_id", names, "1 to 36 letters, digits, hyphens, points or underscores: it names a file")
    roles = columns.texts("role", [role.lower() for role in cells.get("role", [""] * n)], n, where, default="train")
    where.refuse(~np.isin(roles, ("train", "test")), "role", roles, "train or test")
    repeat = columns.repeats(table.whole_numbers("repeat"), names, where)
    coordinates = np.column_stack([checked[name] for name in _NUMBERS[:3]])
    plan = MeasurementPlan(
        state_id=identify_states(coordinates, roles, names, tolerance or StateTolerance(), where),
        repeat=repeat,
        role=roles,
        distance=checked["distance_m"],
        height=checked["height_m"],
        speed=checked["speed_mps"],
        base_angle=checked["base_angle_deg"],
        expected_force=expected,
    )
    _refuse_other_names(plan, cells.get("recording", [""] * n), where)
    return plan


def _without_remark(content: bytes) -> bytes:
    """The same lines, so that row numbers hold, a remark on the first of them left empty."""
    first, end, rest = content.partition(b"\n")
    return end + rest if first.removeprefix(b"\xef\xbb\xbf").startswith(_REMARK.encode()) else content


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


def _require_columns(header: list[str], file: str, row: int) -> None:
    for name in header:
        if name not in _COLUMNS:
            near = ", ".join(nearest_names(name, _COLUMNS, 2))
            message = f"found an unknown column {name!r}, the nearest known ones are {near}; rename it or take it out"
            raise TableError(message, file=file, row=row, column=name)
    for name in _REQUIRED:
        if name not in header:
            message = f"the column is missing, expected at least {', '.join(_REQUIRED)}"
            raise TableError(message, file=file, row=row, column=name)
