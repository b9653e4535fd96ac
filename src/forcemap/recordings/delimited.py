"""Delimited text files: comma, semicolon or tab; decimal point or comma; one curve, long or wide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import RecordingError
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.layout import Layout, find_layout
from forcemap.recordings.numbers import NumberBlock, read_numbers, refuse_doubtful_decimal
from forcemap.recordings.sampling import Curve, check_sampling, in_newtons, in_seconds

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


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
    begin = len(_BYTE_ORDER_MARK) if content.startswith(_BYTE_ORDER_MARK) else 0
    _refuse_no_text(content, begin)
    layout = find_layout(content, columns, begin=begin)
    block = _without_cut_row(read_numbers(content, layout), layout)
    refuse_doubtful_decimal(content, layout)
    curves = _long(block, layout) if block.labels else _wide(block, layout)
    cut = () if block.cut_row is None else (f"the last line, row {block.cut_row}, is cut off and left out",)
    return [replace(curve, notes=(*curve.notes, *cut), metadata=layout.metadata) for curve in curves]


def _refuse_no_text(content: bytes, begin: int) -> None:
    if not content[begin:].strip():
        raise RecordingError("the file is empty, expected lines of numbers")
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise RecordingError("the file is in UTF-16, expected UTF-8; export it again as UTF-8 or ASCII", row=1)
    if (nul := content.find(b"\0")) >= 0:
        row = content.count(b"\n", 0, nul) + 1
        raise RecordingError("found a NUL byte: this is no text, or damaged; export the recording as CSV", row=row)


def _without_cut_row(block: NumberBlock, layout: Layout) -> NumberBlock:
    """A last line without an end is cut off if its time runs backward, or if it would be a curve of its own."""
    if not block.open_end or len(block.values) < 2:
        return block
    last, before = len(block.values) - 1, len(block.values) - 2
    if block.labels:
        before = next((at for at in range(last - 1, -1, -1) if block.labels[at] == block.labels[last]), -1)
    backward = layout.selection.time is not None and block.values[last, 0] <= block.values[before, 0]
    if before >= 0 and not backward:
        return block
    return NumberBlock(block.values[:last], block.labels[:last], open_end=False, cut_row=layout.row + last)


def _wide(block: NumberBlock, layout: Layout) -> list[Curve]:
    """One curve, or one for each column of force."""
    rows = range(layout.row, layout.row + len(block.values))
    curves: list[Curve] = []
    for group in layout.selection.forces:
        name = layout.name(group[0])
        if not name.strip() or name == f"{group[0] + 1}" or name in [curve.name for curve in curves]:
            name = f"column {group[0] + 1}"
        curves.append(_curve(block.values, group, rows, layout, name))
    return curves


def _long(block: NumberBlock, layout: Layout) -> list[Curve]:
    """Rows by the name of their curve, in order of first appearance; curves may be interleaved."""
    members: dict[str, list[int]] = {}
    for at, label in enumerate(block.labels):
        members.setdefault(label, []).append(at)
    (group,) = layout.selection.forces
    return [
        _curve(block.values[at], group, [layout.row + one for one in at], layout, name) for name, at in members.items()
    ]


def _curve(values: FloatArray, group: tuple[int, ...], rows: Sequence[int], layout: Layout, name: str) -> Curve:
    columns, selection = layout.columns, layout.selection
    if len(values) < 2:
        found = f"found a curve {name!r} of {len(values)} sample{'s' if len(values) != 1 else ''}"
        raise RecordingError(f"{found}, expected at least 2", row=rows[0] if rows else layout.row)
    time: FloatArray = np.arange(len(values)) / columns.sampling_rate
    notes: tuple[str, ...] = ()
    if selection.time is not None:
        column = layout.name(selection.time)
        time = in_seconds(values[:, 0], columns, rows, column)
        notes = check_sampling(time, rows, column)
    forces = [in_newtons(values[:, selection.numbers.index(at)], columns, rows, layout.name(at)) for at in group]
    return Curve(name, time, forces, notes)
