"""Times and forces of one curve in seconds and newtons, and what a reader should know of its sampling."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import RecordingError
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.units import ForceUnit

_LONGEST_TIME = 1e9  # s
_LARGEST_FORCE = 1e6  # N
# Between 1 Hz and 200 kHz: seconds taken for milliseconds, the dangerous slip, lie above it from 200 Hz on.
_SHORTEST_INTERVAL, _LONGEST_INTERVAL = 5e-6, 0.999  # [s]
_GAP = 5.0  # median intervals


def in_seconds(raw: FloatArray, columns: ColumnMap, rows: Sequence[int], column: str) -> FloatArray:
    """The time column [s].

    Raises
    ------
    RecordingError
        A time that no recording has: its unit is another one.
    """
    time = raw / columns.time_unit.per_second
    wrong = np.abs(time) > _LONGEST_TIME
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        found = f"found a time of {time[first]:g} s, expected at most {_LONGEST_TIME:g} s"
        raise RecordingError(f"{found}; is time_unit in the column map right?", row=int(rows[first]), column=column)
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
    wrong = ~(np.abs(force) <= _LARGEST_FORCE)
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        found = f"found a force of {force[first]:g} N, expected at most {_LARGEST_FORCE:g} N"
        remedy = "are force_unit and newtons_per_count in the column map right?"
        raise RecordingError(f"{found}; {remedy}", row=int(rows[first]), column=column)
    return force


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
        raise RecordingError(
            f"found time {time[at + 1]:.9g} s after {time[at]:.9g} s in row {rows[at]}, expected times that "
            "increase; if several curves "
            "follow each other, state the column that names them as curve; "
            "if they repeat because they are rounded, state sampling_rate_Hz in place of time; "
            "if this is the force, correct the columns in the column map",
            row=int(rows[at + 1]),
            column=column,
        )
    # the median lies between the two: most files need no more
    if highest <= 1.01 * lowest and lowest >= _SHORTEST_INTERVAL and highest <= _LONGEST_INTERVAL:
        return ()
    usual = float(np.median(steps))
    if not _SHORTEST_INTERVAL <= usual <= _LONGEST_INTERVAL:
        raise RecordingError(
            f"found samples {usual:g} s apart (median), expected between 1e-07 s and 1 s; "
            "is time_unit in the column map right?",
            column=column,
        )
    notes = []
    if np.abs(steps - usual).max() > 0.01 * usual:
        notes.append(f"sampled irregularly: {lowest:g} s to {highest:g} s apart, median {usual:g} s")
    gaps = np.flatnonzero(steps > _GAP * usual)
    if gaps.size:
        shown = ", ".join(f"{steps[at]:g} s after {time[at]:g} s (row {rows[at]})" for at in gaps[:3].tolist())
        more = f" and {gaps.size - 3} more" if gaps.size > 3 else ""
        notes.append(f"gaps of over {_GAP:g} median intervals: {shown}{more}")
    return tuple(notes)
