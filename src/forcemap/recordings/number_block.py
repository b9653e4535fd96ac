"""The numbers of a delimited file, each checked: fast where all is plain, else line by line to name the row."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import RecordingError
from forcemap.recordings.cells import LONGEST_LINE, text_of
from forcemap.recordings.layout import Layout
from forcemap.recordings.plain_numbers import plain_numbers

_CHUNK = 1 << 22
# ASCII digits only: other scripts' digits, grouped thousands and a text such as "nan" are no numbers
_NUMBERS = {
    sign: re.compile(rf"[+-]?([0-9]+[{sign}]?[0-9]*|[{sign}][0-9]+)([eE][+-]?[0-9]+)?", re.ASCII) for sign in ".,"
}


@dataclass(frozen=True)
class NumberBlock:
    """The columns read, shape (rows, columns), and the name of the curve in each row, if a column says it.

    `open_end` is true if the last row of the block has no line end; `cut_row` is the row of a last line that was left
    out because it is cut off.
    """

    values: FloatArray
    labels: list[str]
    open_end: bool
    cut_row: int | None


def read_numbers(content: bytes, layout: Layout) -> NumberBlock:
    """All rows of numbers in the columns read, in the units of the file.

    Raises
    ------
    RecordingError
        A row with another number of cells, a cell that is no number, a blank line between others; `row` names it.
    """
    whole, end = _ends(content, layout.start)
    blocks: list[FloatArray] = []
    labels: list[str] = []
    row = layout.row
    for chunk in _chunks(content, layout.start, whole, row):
        values = plain_numbers(chunk, layout)
        if values is None:
            values, names = checked_numbers(chunk, layout, row)
            labels += names
        blocks.append(values)
        row += len(values)
    cut_row: int | None = None
    if whole < end:
        try:
            values, names = _open_line(content[whole:end], layout, row)
        except _CutOff:
            cut_row = row
        else:
            blocks.append(values)
            labels += names
    none = np.empty((0, len(layout.selection.numbers)))
    values = blocks[0] if len(blocks) == 1 else np.concatenate([none, *blocks])
    return NumberBlock(values, labels, whole < end and cut_row is None, cut_row)


def checked_numbers(chunk: bytes, layout: Layout, row: int) -> tuple[FloatArray, list[str]]:
    """The columns read of whole lines, and their curves, every cell checked; `row` is the first of them.

    Raises
    ------
    RecordingError
        The first line or cell that cannot be used.
    """
    number = _NUMBERS[layout.decimal]
    numbers, curve, width = layout.selection.numbers, layout.selection.curve, layout.width
    values: list[float] = []
    labels: list[str] = []
    for at, line in enumerate(text_of(chunk).split("\n")[:-1], row):
        if len(line) > LONGEST_LINE:
            raise _too_long(len(line), at)
        cells = line.removesuffix("\r").split(layout.delimiter) if layout.delimiter else [line.removesuffix("\r")]
        if len(cells) != width:
            raise _other_width(line, cells, layout, at)
        for column in numbers:
            cell = cells[column].strip(" \t")
            if number.fullmatch(cell) is None:
                raise _no_number(cell, layout, at, column)
            values.append(float(cell.replace(",", ".")))
        if curve is not None:
            labels.append(cells[curve].strip())
            if not labels[-1]:
                raise RecordingError("found no name of a curve, expected one", row=at, column=layout.name(curve))
    return np.array(values, dtype=np.float64).reshape(-1, len(numbers)), labels


class _CutOff(Exception):
    """The last line is cut off."""


def _open_line(line: bytes, layout: Layout, row: int) -> tuple[FloatArray, list[str]]:
    """The last line of a file that does not end it: whole, or cut off by whatever stopped the writing."""
    if len(line) > LONGEST_LINE:
        raise _too_long(len(line), row)
    cells = line.count(layout.delimiter.encode()) + 1 if layout.delimiter else 1
    if cells > layout.width:
        return checked_numbers(line + b"\n", layout, row)
    if layout.selection.curve == layout.width - 1:  # half the name of a curve may be the name of another
        raise _CutOff
    try:
        return checked_numbers(line + b"\n", layout, row)
    except RecordingError:
        raise _CutOff from None


def _ends(content: bytes, start: int) -> tuple[int, int]:
    """Where the last line that has an end ends, and where the last line ends; blank lines at the end do not count."""
    filled = start + len(content[start:].rstrip(b" \t\r\n"))
    newline = content.find(b"\n", filled)
    if newline >= 0:
        return newline + 1, newline + 1
    return max(start, content.rfind(b"\n", start, filled) + 1), len(content)


def _chunks(content: bytes, start: int, end: int, row: int) -> Iterator[bytes]:
    """Whole lines, some megabytes at a time."""
    while start < end:
        stop = end if end - start <= _CHUNK else content.rfind(b"\n", start, start + _CHUNK) + 1
        if stop <= start:
            raise RecordingError(f"found a line of over {_CHUNK} characters, expected lines of numbers", row=row)
        chunk = content[start:stop]
        row += chunk.count(b"\n") if stop < end else 0
        start = stop
        yield chunk


def _too_long(length: int, row: int) -> RecordingError:
    return RecordingError(
        f"found {length} characters in one line, expected a line of numbers; export it again", row=row
    )


def _other_width(line: str, cells: list[str], layout: Layout, row: int) -> RecordingError:
    if not line.strip():
        return RecordingError(
            "found a blank line between lines of numbers; take it out, or export the file again", row=row
        )
    return RecordingError(
        f"found {len(cells)} cell{'s' if len(cells) > 1 else ''}, expected {layout.width} as in row {layout.row}; "
        "is the line damaged, or delimiter or decimal sign another one?",
        row=row,
    )


def _no_number(cell: str, layout: Layout, row: int, column: int) -> RecordingError:
    other = "," if layout.decimal == "." else "."
    expected = "expected a number; correct the cell, or export the file again"
    if other in cell or cell.count(layout.decimal) > 1:
        expected = (
            f"expected a number with {layout.decimal!r} as decimal sign and no thousands separator; "
            "if the decimal sign is another one, state decimal in the column map"
        )
    shown = repr(cell if len(cell) <= 40 else cell[:37] + "...") if cell else "an empty cell"
    return RecordingError(f"found {shown}, {expected}", row=row, column=layout.name(column))
