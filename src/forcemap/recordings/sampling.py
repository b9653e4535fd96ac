"""Curves in seconds and newtons, and what a reader should know of their sampling."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import RecordingError
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.units import ForceUnit, TimeUnit, force_unit_in, other_unit_in, time_unit_in

_LONGEST_TIME = 1e9  # s
_LARGEST_FORCE = 1e6  # N
# Between 1 Hz and 200 kHz: seconds taken for milliseconds, the dangerous slip, lie above it from 200 Hz on.
_SHORTEST_INTERVAL, _LONGEST_INTERVAL = 5e-6, 0.999  # [s]
_GAP = 5.0  # median intervals


@dataclass(frozen=True)
class Curve:
    """A curve of a file: times [s], forces [N] of one column or three, notes, and the lines before the columns."""

    name: str
    time: FloatArray
    forces: Sequence[FloatArray]
    notes: tuple[str, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)


def in_seconds(raw: FloatArray, columns: ColumnMap, rows: Sequence[int], column: str) -> FloatArray:
    """The time column [s].

    Raises
    ------
    RecordingError
        A time that no recording has: its unit is another one.
    """
    time = raw / columns.time_unit.per_second
    _refuse_beyond(_LONGEST_TIME, time, "time of {:g} s", "is time_unit", rows, column)
    return time


def in_newtons(raw: FloatArray, columns: ColumnMap, rows: Sequence[int], column: str) -> FloatArray:
    """A force column [N], positive into the device.

    Raises
    ------
    RecordingError
        A force that no device measures: its unit is another one.
    """
    force = raw
    if columns.force_unit is ForceUnit.KILONEWTONS:
        force = raw * 1000.0
    elif columns.force_unit is ForceUnit.COUNTS:
        force = (raw - columns.zero_count) * columns.newtons_per_count
    if columns.sign < 0:
        force = -force
    _refuse_beyond(_LARGEST_FORCE, force, "force of {:g} N", "are force_unit and newtons_per_count", rows, column)
    return force


def _refuse_beyond(most: float, values: FloatArray, what: str, entries: str, rows: Sequence[int], column: str) -> None:
    for at in np.flatnonzero(~(np.abs(values) <= most))[:1]:
        found = f"found a {what.format(values[at])}, expected at most {most:g} {what[-1]}"
        raise RecordingError(f"{found}; {entries} in the column map right?", row=int(rows[at]), column=column)


def check_sampling(time: FloatArray, rows: Sequence[int], column: str) -> tuple[str, ...]:
    """Notes on gaps and irregular sampling.

    Raises
    ------
    RecordingError
        Times that do not increase, or intervals that no device has.
    """
    steps = np.diff(time)
    lowest, highest = float(steps.min()), float(steps.max())
    if lowest <= 0:
        at = int(np.flatnonzero(steps <= 0)[0])
        message = (
            f"found time {time[at + 1]:.9g} s after {time[at]:.9g} s in row {rows[at]}, expected times that increase; "
            "if several curves follow each other, state the column that names them as curve; "
            "if they repeat because they are rounded, state sampling_rate_Hz in place of time; "
            "if this is the force, correct the columns in the column map"
        )
        raise RecordingError(message, row=int(rows[at + 1]), column=column)
    # the median lies between the two: most files need no more
    if highest <= 1.01 * lowest and lowest >= _SHORTEST_INTERVAL and highest <= _LONGEST_INTERVAL:
        return ()
    usual = float(np.median(steps))
    if not _SHORTEST_INTERVAL <= usual <= _LONGEST_INTERVAL:
        found = f"found samples {usual:g} s apart (median), expected between 1e-07 s and 1 s"
        raise RecordingError(f"{found}; is time_unit in the column map right?", column=column)
    notes = []
    if np.abs(steps - usual).max() > 0.01 * usual:
        notes.append(f"sampled irregularly: {lowest:g} s to {highest:g} s apart, median {usual:g} s")
    if (gaps := np.flatnonzero(steps > _GAP * usual)).size:
        shown = ", ".join(f"{steps[at]:g} s after {time[at]:g} s (row {rows[at]})" for at in gaps[:3].tolist())
        more = f" and {gaps.size - 3} more" if gaps.size > 3 else ""
        notes.append(f"gaps of over {_GAP:g} median intervals: {shown}{more}")
    return tuple(notes)


def refuse_other_unit(column: str, stated: TimeUnit | ForceUnit, *texts: str) -> None:
    """Refuse a unit that a text states and the column map states otherwise, or that forcemap does not know."""
    entry, unit_in = ("time_unit", time_unit_in) if isinstance(stated, TimeUnit) else ("force_unit", force_unit_in)
    unit = next(filter(None, map(unit_in, texts)), None)
    if unit is not None and unit is not stated:
        found = f"the file says {unit.value!r}, the column map {entry} = {stated.value!r}"
        raise RecordingError(f"{found}; correct the one that is wrong", column=column)
    other = other_unit_in(next(filter(None, texts), ""))
    if isinstance(stated, ForceUnit) and other and stated is not ForceUnit.COUNTS:
        remedy = "convert, or state force_unit = 'counts' with newtons_per_count"
        raise RecordingError(f"the file says {other!r}, expected N or kN; {remedy}", column=column)
