"""Delimited text files: comma, semicolon, tab or blanks; decimal point or comma; one curve, long or wide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import RecordingError
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.components import other_components, refuse_one_of_several, still
from forcemap.recordings.layout import Layout, find_layout
from forcemap.recordings.numbers import NumberBlock, cut_off, read_numbers, refuse_doubtful_decimal
from forcemap.recordings.recording import LEAST_SAMPLES
from forcemap.recordings.sampling import Curve, check_sampling, in_newtons, in_seconds
from forcemap.recordings.selection import Selection
from forcemap.recordings.text import lines_of


def read_delimited(content: bytes, columns: ColumnMap | None) -> list[Curve]:
    """The curves of a delimited file, in order of appearance.

    Parameters
    ----------
    content : bytes
        The file.
    columns : ColumnMap or None
        How the device writes its files; None needs a header that names one time and one force with their units.

    Raises
    ------
    RecordingError
        Anything in it that could be read wrongly; `row` is the line, `column` the name or number of the column.
    """
    lines = lines_of(content)
    layout = find_layout(lines, columns)
    block = _without_cut_row(read_numbers(lines, layout), layout)
    refuse_doubtful_decimal(lines, layout)
    notes = (*block.notes, *_components(lines, layout, block))
    curves = _long(block, layout) if block.labels else _wide(block, layout)
    of_file: dict[str, Any] = {"metadata": layout.metadata, "unit_stated": layout.unit_stated}
    return [replace(curve, notes=(*curve.notes, *notes), **of_file) for curve in curves]


def _components(lines: bytes, layout: Layout, block: NumberBlock) -> tuple[str, ...]:
    """Notes on components of a force that never change; one that is read without the others is refused."""
    if len(layout.selection.forces) > 1 or not len(block.values):
        return ()
    (group,) = layout.selection.forces
    names, forces = [layout.name(column) for column in group], [block.values[:, layout.place_of[i]] for i in group]
    if len(group) > 1:
        return still(names, forces)
    if others := other_components(names[0], layout.names):
        selection = Selection(None, tuple((column,) for column in others), None)
        try:
            values = read_numbers(lines, replace(layout, selection=selection)).values.T
        except RecordingError:  # columns of something else
            return ()
        refuse_one_of_several(names[0], forces[0], zip(map(layout.name, others), values, strict=True))
    return ()


def _without_cut_row(block: NumberBlock, layout: Layout) -> NumberBlock:
    """The block without a cut off last line: one without an end whose time runs backward, or that starts a curve."""
    if not block.open_end or len(block.values) < LEAST_SAMPLES:
        return block
    last, before = len(block.values) - 1, len(block.values) - 2
    if block.labels:
        before = next((row for row in range(last - 1, -1, -1) if block.labels[row] == block.labels[last]), -1)
    backward = layout.selection.time is not None and block.values[last, 0] <= block.values[before, 0]
    if before >= 0 and not backward:
        return block
    return NumberBlock(block.values[:last], block.labels[:last], open_end=False, notes=(cut_off(layout.row + last),))


def _wide(block: NumberBlock, layout: Layout) -> list[Curve]:
    """One curve, or one for each column of force."""
    rows = range(layout.row, layout.row + len(block.values))
    time, notes = _times(block.values, rows, layout)
    curves: dict[str, Curve] = {}
    for group in layout.selection.forces:
        name = layout.name(group[0])
        if not name.strip() or name == f"{group[0] + 1}" or name in curves:
            name = f"column {group[0] + 1}"
        curves[name] = Curve(name, time, _forces(block.values, group, rows, layout), notes)
    return list(curves.values())


def _long(block: NumberBlock, layout: Layout) -> list[Curve]:
    """Rows by the name of their curve, in order of first appearance; curves may be interleaved."""
    members: dict[str, list[int]] = {}
    for row, label in enumerate(block.labels):
        members.setdefault(label, []).append(row)
    (group,) = layout.selection.forces
    curves = []
    for name, places in members.items():
        values, rows = block.values[places], [layout.row + place for place in places]
        time, notes = _times(values, rows, layout, name)
        curves.append(Curve(name, time, _forces(values, group, rows, layout), notes))
    return curves


def _times(
    values: FloatArray, rows: Sequence[int], layout: Layout, name: str = ""
) -> tuple[FloatArray, tuple[str, ...]]:
    """Times of the rows [s], and notes on them; `name` is that of the curve, where a column says it."""
    if len(values) < LEAST_SAMPLES:
        problem = f"found a curve {name!r} of" if name else "found"
        problem = f"{problem} {len(values)} sample{'s' if len(values) != 1 else ''}"
        raise RecordingError(f"{problem}, expected at least {LEAST_SAMPLES}", row=rows[0] if rows else layout.row)
    if layout.selection.time is None:
        return np.arange(len(values)) / layout.columns.sampling_rate, ()
    column = layout.name(layout.selection.time)
    time, epoch = in_seconds(values[:, 0], layout.columns, rows, column)
    return time, (*epoch, *check_sampling(time, rows, column))


def _forces(values: FloatArray, group: tuple[int, ...], rows: Sequence[int], layout: Layout) -> list[FloatArray]:
    """Force of one column, or of three [N]."""
    place = layout.place_of
    return [in_newtons(values[:, place[column]], layout.columns, rows, layout.name(column)) for column in group]
