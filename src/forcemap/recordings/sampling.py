"""Curves in seconds and newtons, with notes on their sampling."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import RecordingError
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.overrange import OVERRANGE
from forcemap.recordings.recording import REGULAR
from forcemap.recordings.units import (
    LONGEST_NAME,
    ForceUnit,
    TimeUnit,
    Unit,
    listed,
    spelled_otherwise,
    stated_unit,
)

_IF_NOT_STATED = (ColumnMap.time_unit, ColumnMap.force_unit)

# Choices: beyond them the unit is another one than stated.
_LONGEST_TIME = 1e9  # [s]
_EPOCH = (1e9, 4.2e9)  # seconds since 1970, of the years 2001 to 2103
_LARGEST_FORCE = 1e6  # [N]
_SHORTEST_INTERVAL = 1e-7 * (1 - 1e-6)  # [s]: up to 10 MHz
LONGEST_INTERVAL = 0.999
"""Between the samples of a device [s]."""
# Seconds taken for milliseconds, the dangerous slip, make a second a millisecond: sampled as fast as that, a recording
# is a whole one or its time is in another unit.
_FAST, _WHOLE = 5e-6, 0.02  # [s]: intervals, and what shows a baseline and Phase I
_GAP, _GAPS_SHOWN = 5.0, 3  # median intervals: longer ones are noted, the first of them shown


@dataclass(frozen=True)
class Curve:
    """A curve of a file: times [s], forces [N] of one column or three, notes, the lines before the columns;
    whether the file says the unit of the force."""

    name: str
    time: FloatArray
    forces: Sequence[FloatArray]
    notes: tuple[str, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)
    unit_stated: bool = True


def in_seconds(
    raw: FloatArray, columns: ColumnMap, rows: Sequence[int], column: str
) -> tuple[FloatArray, tuple[str, ...]]:
    """The time column [s], and a note if it counts from 1970: then its first time is taken off.

    Raises
    ------
    RecordingError
        A time that no recording has: its unit is another one.
    """
    begin = raw[0] / columns.time_unit.per_second
    if not _EPOCH[0] <= begin < _EPOCH[1]:
        time = raw / columns.time_unit.per_second
        _refuse_beyond(_LONGEST_TIME, time, "time of {:g} s", "is time_unit", rows, column)
        return time, ()
    time = (raw - raw[0]) / columns.time_unit.per_second
    _refuse_beyond(_LONGEST_TIME, time, "time of {:g} s", "is time_unit", rows, column)
    return time, (f"times count from 1970; the first, {begin:.6f} s, is taken for 0",)


def in_newtons(raw: FloatArray, columns: ColumnMap, rows: Sequence[int], column: str) -> FloatArray:
    """A force column [N], positive into the device; infinite where the device says that its range was exceeded.

    A sign that is not said to be negative counts as pressing, whatever the sign of the column.

    Raises
    ------
    RecordingError
        A force that no device measures: its unit is another one.
    """
    with np.errstate(over="ignore"):  # what is infinite is refused
        force = raw * columns.force_unit.newtons
        if columns.force_unit is ForceUnit.COUNTS:
            force = (raw - columns.zero_count) * columns.newtons_per_count
    if columns.sign < 0:
        force = -force
    above, below = raw == OVERRANGE, raw == -OVERRANGE
    _refuse_beyond(
        _LARGEST_FORCE,
        np.where(above | below, 0.0, force),
        "force of {:g} N",
        "are force_unit and newtons_per_count",
        rows,
        column,
    )
    if above.any() or below.any():
        force = np.where(above, np.inf, np.where(below, -columns.sign * np.inf, force))
    return force


def _refuse_beyond(most: float, values: FloatArray, what: str, entries: str, rows: Sequence[int], column: str) -> None:
    for sample in np.flatnonzero(~(np.abs(values) <= most))[:1]:
        problem = f"found a {what.format(values[sample])}, expected at most {most:g} {what[-1]}"
        raise RecordingError(f"{problem}; {entries} in the column map right?", row=int(rows[sample]), column=column)


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
        sample = int(np.flatnonzero(steps <= 0)[0])
        message = (
            f"found time {time[sample + 1]:.9g} s after {time[sample]:.9g} s in row {rows[sample]}, "
            "expected times that increase; "
            "if several curves follow each other, state the column that names them as curve; "
            "if they repeat because they are rounded, state sampling_rate_Hz in place of time; "
            "if this is the force, correct the columns in the column map"
        )
        raise RecordingError(message, row=int(rows[sample + 1]), column=column)
    # the median lies between the two: most files need no more
    if highest <= (1 + REGULAR) * lowest and lowest >= _FAST and highest <= LONGEST_INTERVAL:
        return ()
    usual = float(np.median(steps))
    if not _SHORTEST_INTERVAL <= usual <= LONGEST_INTERVAL:
        than = "faster" if usual < _SHORTEST_INTERVAL else "slower"
        problem = f"found samples {usual:g} s apart (median), {than} than any force measuring device"
        raise RecordingError(f"{problem}; is time_unit in the column map right?", column=column)
    if usual < _FAST and (lasts := float(time[-1] - time[0])) < _WHOLE:
        problem = f"found a recording of {lasts:g} s at {1 / usual:g} Hz, expected at least {_WHOLE:g} s of it"
        raise RecordingError(f"{problem}; is time_unit in the column map right?", column=column)
    notes = []
    if np.abs(steps - usual).max() > REGULAR * usual:
        notes.append(f"sampled irregularly: {lowest:g} s to {highest:g} s apart, median {usual:g} s")
    if (gaps := np.flatnonzero(steps > _GAP * usual)).size:
        shown = ", ".join(
            f"{steps[gap]:g} s after {time[gap]:g} s (row {rows[gap]})" for gap in gaps[:_GAPS_SHOWN].tolist()
        )
        more = f" and {gaps.size - _GAPS_SHOWN} more" if gaps.size > _GAPS_SHOWN else ""
        notes.append(f"gaps of over {_GAP:g} median intervals: {shown}{more}")
    return tuple(notes)


def refuse_other_unit(column: str, stated: Unit, *texts: str, alone: bool = False) -> bool:
    """Refuse a unit that a text states and the column map states otherwise, or that forcemap does not read; False if no
    text states one.

    Parameters
    ----------
    column : str
        What the error names.
    stated : TimeUnit or ForceUnit
        As the column map says.
    *texts : str
        Names of columns, units of channels; the first that states a unit counts.
    alone : bool
        The texts are cells of a line of units.
    """
    of_time = isinstance(stated, TimeUnit)
    if (longest := max(map(len, texts), default=0)) > LONGEST_NAME:
        raise RecordingError(
            f"found a name of {longest} characters, expected one of at most {LONGEST_NAME}", column=column
        )
    unit = next(filter(None, (stated_unit(text, alone=alone, of_time=of_time) for text in texts)), None)
    entry = "time_unit" if of_time else "force_unit"
    if unit is None or unit is stated:
        return unit is stated
    if isinstance(unit, type(stated)) and unit is not ForceUnit.COUNTS:
        default = f" ({stated.value} is the default, too)" if stated in _IF_NOT_STATED else ""
        problem = f"the file says {unit.value!r}, the column map {entry} = {stated.value!r}{default}"
        raise RecordingError(f"{problem}; state {entry} = {unit.value!r}, or correct the file", column=column)
    if stated is ForceUnit.COUNTS:  # a unit of its own, with a factor
        return True
    expected = f"{listed(TimeUnit)}; convert, or state sampling_rate_Hz in place of time"
    if not of_time:
        units = [each for each in ForceUnit if each is not ForceUnit.COUNTS]
        expected = f"{listed(units)}; convert, or state force_unit = 'counts' with newtons_per_count"
    if spelled_otherwise(str(unit), stated):
        name = "Time" if of_time else "Force"
        expected += f"; if it is in {stated.value}, write so there: '{name} [{stated.value}]', capitals as here"
    raise RecordingError(f"the file says {str(unit)!r}, expected {expected}", column=column)
