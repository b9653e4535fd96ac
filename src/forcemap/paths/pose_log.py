"""Logs of poses as a controller writes them, by a column map: any columns, units, delimiter and decimal sign."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError, RecordingError, TableError, nearest_names
from forcemap.findings import Finding
from forcemap.paths.full_speed import doubts_of_full_speed, tells_of_speed
from forcemap.recordings.cells import cells_of, is_number
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.layout import Layout, find_layout
from forcemap.recordings.numbers import read_numbers, refuse_doubtful_decimal
from forcemap.recordings.sampling import in_seconds
from forcemap.recordings.text import lines_of, text_of

LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""Units of positions [m]."""

_FARTHEST = 0.9  # [s] between samples; a choice: controllers write 2 to 500 a second, and 1000 in the wrong unit is 1 s

_SAME = ("time", "time_unit", "sampling_rate_Hz", "delimiter", "decimal", "header_lines")
_CALLED = {"position": "force", "segment": "curve"}
"""Entries that a column map of recordings has as well, and under another name: three components beside a time."""

_SPEEDS = (
    "speed",
    "speed_unit",
    "speed_mps",
    "speed_to_point_mps",
    "speed_from_point_mps",
)  # what a waypoint list has, and a log has not

LOG_ENTRIES = ("position", "length_unit", *_SAME, "segment")
_IN_BRACKETS = re.compile(r".*[\[(]\s*([a-zµ]+)\s*[\])]\s*", re.IGNORECASE)
_AT_END = re.compile(r"(?:.*[\s_.,/-])?(m|cm|mm|µm|um|in|inch|ft|km)\s*", re.IGNORECASE)


def read_pose_log(
    content: bytes, file: str, columns: Mapping[str, Any]
) -> tuple[FloatArray, FloatArray | None, list[str] | None, tuple[Finding, ...]]:
    """Positions [m], shape (n, 3), times [s] or None, the name of the segment that begins at each, or None, and doubts.

    Raises
    ------
    InputError
        A column map that cannot be used; `column` names the entry.
    TableError
        Anything in the log that could be read wrongly.
    """
    known = _column_map(columns)
    try:
        lines = lines_of(content)
        layout = find_layout(lines, known, untimed=not {"time", "sampling_rate_Hz"} & columns.keys())
        _refuse_other_lengths(layout, columns["length_unit"])
        block = read_numbers(lines, layout, unnamed=True)
        _require_named(block.labels, layout)
        refuse_doubtful_decimal(lines, layout)
        if block.notes:  # a path that ends too early hides what comes after
            raise RecordingError(f"{block.notes[0]}: expected a whole log; take it out, or export the log again")
        time = None
        if layout.selection.time is not None:
            rows = range(layout.row, layout.row + len(block.values))
            time, _ = in_seconds(block.values[:, 0], known, rows, layout.name(layout.selection.time))
            _refuse_slow(time, layout.name(layout.selection.time), "time_unit")
            _refuse_backwards(time, rows, layout.name(layout.selection.time))
        elif "sampling_rate_Hz" in columns:
            time = np.arange(len(block.values)) / known.sampling_rate
            _refuse_slow(time, "sampling_rate_Hz", "sampling_rate_Hz")
    except RecordingError as error:
        raise TableError(error.message, file=file, row=error.row, column=error.column) from None
    points = block.values[:, -3:] * known.newtons_per_count
    doubts = () if time is None else tuple(doubts_of_full_speed(_beside(lines, layout), points, log=True))
    return points, time, block.labels or None, doubts


def _beside(lines: bytes, layout: Layout) -> list[tuple[str, list[str]]]:
    """Name and cells of the columns beside those that are read which may tell how fast the robot ran."""
    rows = [cells_of(text_of(line), layout.delimiter) for line in lines[layout.start :].splitlines() if line.strip()]
    first = rows[0]
    told = [
        i
        for i, name in enumerate(layout.names[: len(first)])
        if tells_of_speed(name) or not (i == layout.selection.curve or is_number(first[i].strip()))
    ]
    return [(layout.names[i], [row[i] if i < len(row) else "" for row in rows]) for i in told]


def _column_map(columns: Mapping[str, Any]) -> ColumnMap:
    """The column map of recordings that reads the same columns; units of length and time have to be stated."""
    for key in columns:
        if key in _SPEEDS:
            raise InputError(
                "unknown entry; programmed speeds of points go into a path file with the columns x_m, y_m, z_m, "
                "speed_to_point_mps (and segment), without --column; of a segment into the task (speed_mps)",
                column=key,
            )
        if key not in LOG_ENTRIES:
            near = ", ".join(nearest_names(key, LOG_ENTRIES, 3))
            raise InputError(f"unknown entry; the nearest known ones are {near}", column=key)
    position, unit = columns.get("position"), columns.get("length_unit")
    if not isinstance(position, list | tuple) or len(position) != 3:
        raise InputError(f"found {position!r}, expected three columns such as position=X,Y,Z", column="position")
    units = {"length_unit": f"of the positions: {', '.join(LENGTHS)}"}
    if "time" in columns:  # milliseconds taken for seconds look slow
        units["time_unit"] = "of the time column: s, ms, us or ns"
    if missing := [entry for entry in units if entry not in columns]:
        needed = "; ".join(f"{entry}, the unit {units[entry]}" for entry in missing)
        raise InputError(f"not stated; expected {needed}", column=missing[0])
    if unit not in LENGTHS:
        raise InputError(f"found {unit!r}, expected one of {', '.join(LENGTHS)}", column="length_unit")
    entries = {_CALLED.get(key, key): value for key, value in columns.items() if key != "length_unit"}
    untimed = {} if {"time", "sampling_rate_Hz"} & columns.keys() else {"sampling_rate_Hz": 1.0}
    try:
        return ColumnMap.from_table(
            {**entries, **untimed, "force": list(position), "force_unit": "counts", "newtons_per_count": LENGTHS[unit]}
        )
    except InputError as error:
        own = {theirs: name for name, theirs in _CALLED.items()}
        raise InputError(error.message, column=own.get(error.column or "", error.column)) from None


def _require_named(names: Sequence[str], layout: Layout) -> None:
    """Refuse a row without the name of a segment; at the last none begins."""
    if (curve := layout.selection.curve) is not None and "" in names[:-1]:
        expected = "expected that of the segment whose motion begins at this row (at the last none does)"
        raise RecordingError(f"found no name, {expected}", row=layout.row + names.index(""), column=layout.name(curve))


def _refuse_slow(time: FloatArray, column: str, entry: str) -> None:
    """Refuse times that no log has: in a larger unit than the file's a path looks slow, and what is too fast passes."""
    apart = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    if apart > _FARTHEST:
        problem = f"found samples {apart:.4g} s apart (median), slower than any controller writes a log"
        raise RecordingError(f"{problem}; correct {entry}", column=column)


def _refuse_backwards(time: FloatArray, rows: range, column: str) -> None:
    """Refuse a time [s] that is not after the one of the row above."""
    if (back := np.flatnonzero(~(np.diff(time) > 0))).size:
        i = int(back[0])
        problem = f"found {time[i + 1]:g} s, expected a time after the {time[i]:g} s of the row above"
        raise RecordingError(f"{problem}; a log of one run", row=rows[i + 1], column=column)


def _refuse_other_lengths(layout: Layout, stated: str) -> None:
    """Refuse a unit above a position that is not the one stated."""
    for line in (layout.names, *(cells_of(text, layout.delimiter) for text in layout.metadata.values())):
        for column in layout.selection.forces[0]:
            unit = next(_units(line[column]), stated) if len(line) == layout.width else stated
            if unit != stated:
                problem = f"the file says {unit!r}, the column map length_unit = {stated!r}"
                raise RecordingError(f"{problem}; correct the one that is wrong", column=layout.name(column))


def _units(text: str) -> Iterator[str]:
    for pattern in (_IN_BRACKETS, _AT_END):
        if found := pattern.fullmatch(text):
            yield found[1].lower().replace("inch", "in")
