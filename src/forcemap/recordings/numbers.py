"""The numbers of a delimited file, each checked: fast where all is plain, else line by line to name the row."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import RecordingError
from forcemap.recordings.cells import BLANK, COMMENT, NUMBERS, clock_remedy, may_be_measured, split_cells
from forcemap.recordings.column_map import shortened
from forcemap.recordings.layout import Layout
from forcemap.recordings.overrange import overrange
from forcemap.recordings.text import LONGEST_LINE, text_of

_CHUNK = 1 << 22  # bytes read at once; a choice: numbers of some megabytes fit into memory several times over
_LONGEST_TRAILER = 1 << 16  # bytes of what may follow the numbers; a choice: more is no remark


@dataclass(frozen=True)
class NumberBlock:
    """The columns read, shape (rows, columns), and the name of the curve in each row, if a column says it.

    `open_end` is true if the last row of the block has no line end; `notes` say what was left out below the block.
    """

    values: FloatArray
    labels: list[str]
    open_end: bool
    notes: tuple[str, ...]


def read_numbers(content: bytes, layout: Layout, *, unnamed: bool = False) -> NumberBlock:
    """All rows of numbers in the columns read, in the units of the file; with `unnamed` a curve's name may be empty.

    Raises
    ------
    RecordingError
        A row with another number of cells, a cell that is no number, a blank line between others; `row` names it.
    """
    whole, end = _ends(content, layout.start)
    blocks: list[FloatArray] = []
    labels: list[str] = []
    row, trailer = layout.row, False
    for start, chunk in _chunks(content, layout.start, whole, row):
        values = plain_numbers(chunk, layout)
        if values is None:
            try:
                values, names = checked_numbers(chunk, layout, row, unnamed)
            except RecordingError as error:
                length = _length_of_lines(chunk, (error.row or row) - row)
                if not _is_trailer(content[start + length : end], layout):
                    raise
                values, names = checked_numbers(chunk[:length], layout, row, unnamed)
                trailer = True
            labels += names
        blocks.append(values)
        row += len(values)
        if trailer:
            break
    last = _open_line(content[whole:end], layout, row) if whole < end and not trailer else None
    if last:
        blocks.append(last[0])
        labels += last[1]
    values = blocks[0] if len(blocks) == 1 else np.concatenate([np.empty((0, len(layout.selection.numbers))), *blocks])
    notes = (f"what follows the numbers, from row {row} on, is no measurement and left out",) if trailer else ()
    notes = (cut_off(row),) if whole < end and last is None and not trailer else notes
    return NumberBlock(values, labels, last is not None, notes)


def cut_off(row: int) -> str:
    """The note on a last line that is left out."""
    return f"the last line, row {row}, is cut off and left out"


def _length_of_lines(chunk: bytes, lines: int) -> int:
    """Bytes of the first lines of a chunk."""
    length = 0
    for _ in range(lines):
        length = chunk.index(b"\n", length) + 1
    return length


def _is_trailer(rest: bytes, layout: Layout) -> bool:
    """True for a few last lines that hold no measurement, not even a damaged one.

    Without a time column only comments count: a lone text may be the device's sign for a force beyond its range.
    """
    if len(rest) > _LONGEST_TRAILER:
        return False
    selection = layout.selection
    for line in text_of(rest).split("\n"):
        if not line.strip() or COMMENT.match(line):
            continue
        cells = [cell.strip() for cell in split_cells(line, layout.delimiter)]
        read = {column: cells[column] if column < len(cells) else "" for column in selection.numbers}
        if selection.time is None or may_be_measured(
            read[selection.time], [read[column] for group in selection.forces for column in group]
        ):
            return False
    return True


def plain_numbers(chunk: bytes, layout: Layout) -> FloatArray | None:
    """The columns read of whole lines, or None if a line is not plain: `checked_numbers` reads the same.

    Parameters
    ----------
    chunk : bytes
        Whole lines, the last with its line end.
    layout : Layout
        The layout of the file.
    """
    if layout.selection.curve is not None:
        return None
    chunk = chunk.replace(b"\r\n", b"\n") if b"\r" in chunk else chunk
    delimiter, point = layout.delimiter.encode(), layout.decimal.encode()
    if layout.delimiter == BLANK:
        chunk = re.sub(rb"(?m)^ | $", b"", re.sub(rb"[ \t]+", BLANK.encode(), chunk))
    # what remains of such lines is known; a blank is not plain
    ends = chunk.translate(None, b"0123456789+-eE" + point)
    end_of_row = delimiter * (layout.width - 1) + b"\n"
    rows = len(ends) // len(end_of_row)
    if ends != end_of_row * rows or not chunk.strip():
        return None
    text = chunk.replace(b",", b".") if point == b"," else chunk
    columns = list(layout.selection.numbers)
    try:
        stream = io.StringIO(text.decode("ascii"))
        values = np.loadtxt(stream, delimiter=layout.delimiter or None, usecols=columns, ndmin=2, comments=None)
    except ValueError:  # a cell such as "1.2.3", "1-2" or ""
        return None
    return values if len(values) == rows else None


def checked_numbers(chunk: bytes, layout: Layout, row: int, unnamed: bool = False) -> tuple[FloatArray, list[str]]:
    """The columns read of whole lines, and their curves, every cell checked; `row` is the first of them.

    Raises
    ------
    RecordingError
        The first line or cell that cannot be used.
    """
    number = NUMBERS[layout.decimal]
    numbers, time, curve = layout.selection.numbers, layout.selection.time, layout.selection.curve
    values: list[float] = []
    labels: list[str] = []
    for line_row, line in enumerate(text_of(chunk).split("\n")[:-1], row):
        if len(line) > LONGEST_LINE:
            raise _too_long(len(line), line_row)
        try:
            cells = split_cells(line.removesuffix("\r"), layout.delimiter, strict=True)
        except csv.Error as error:
            raise RecordingError(
                f"found quotes that do not fit ({error}); is the line damaged?", row=line_row
            ) from None
        if not layout.width <= len(cells) <= layout.width + layout.optional:
            raise _other_width(line, cells, layout, line_row)
        for column in numbers:
            if number.fullmatch(cell := cells[column].strip(" \t")):
                values.append(float(cell.replace(",", ".")))
            elif column != time and (beyond := overrange(cell)):
                values.append(beyond)
            else:
                raise _no_number(cell, layout, line_row, column)
        if curve is not None:
            labels.append(cells[curve].strip())
            if not (labels[-1] or unnamed):
                raise RecordingError("found no name of a curve, expected one", row=line_row, column=layout.name(curve))
    return np.array(values, dtype=np.float64).reshape(-1, len(numbers)), labels


def _open_line(line: bytes, layout: Layout, row: int) -> tuple[FloatArray, list[str]] | None:
    """The last line of a file that does not end it; None if it is cut off by whatever stopped the writing."""
    if len(line) > LONGEST_LINE:
        raise _too_long(len(line), row)
    cells, width = len(split_cells(text_of(line), layout.delimiter)), layout.width + layout.optional
    if cells <= width and layout.selection.curve == layout.width - 1:
        return None  # half the name of a curve may be the name of another
    try:
        return checked_numbers(line + b"\n", layout, row)
    except RecordingError:
        if cells > width:
            raise
        return None


def _ends(content: bytes, start: int) -> tuple[int, int]:
    """Where the last line that has an end ends, and where the last line ends; blank lines at the end do not count."""
    filled = start + len(content[start:].rstrip(b" \t\r\n"))
    if (newline := content.find(b"\n", filled)) >= 0:
        return newline + 1, newline + 1
    return max(start, content.rfind(b"\n", start, filled) + 1), len(content)


def _chunks(content: bytes, start: int, end: int, row: int) -> Iterator[tuple[int, bytes]]:
    """Whole lines, some megabytes at a time, each with the byte at which they begin."""
    while start < end:
        stop = end if end - start <= _CHUNK else content.rfind(b"\n", start, start + _CHUNK) + 1
        if stop <= start:
            raise RecordingError(f"found a line of over {_CHUNK} characters, expected lines of numbers", row=row)
        chunk = content[start:stop]
        row += chunk.count(b"\n") if stop < end else 0
        yield start, chunk
        start = stop


def _too_long(length: int, row: int) -> RecordingError:
    problem = f"found {length} characters in one line"
    return RecordingError(f"{problem}, expected a line of numbers; export it again", row=row)


def _other_width(line: str, cells: list[str], layout: Layout, row: int) -> RecordingError:
    if not line.strip():
        problem = "found a blank line between lines of numbers"
        return RecordingError(f"{problem}; take it out, or export the file again", row=row)
    problem = f"found {len(cells)} cell{'s' if len(cells) > 1 else ''}, expected {layout.width} as in row {layout.row}"
    return RecordingError(f"{problem}; is the line damaged, or delimiter or decimal sign another one?", row=row)


def _no_number(cell: str, layout: Layout, row: int, column: int) -> RecordingError:
    other = "," if layout.decimal == "." else "."
    expected = f"expected a number; {clock_remedy(cell) or 'correct the cell, or export the file again'}"
    if column == layout.selection.time and not any(map(str.isdigit, cell)) and cell:
        expected = "expected a number; if other measurements or results follow, export each by itself"
    if other in cell or cell.count(layout.decimal) > 1:
        remedy = "if the decimal sign is another one, state decimal in the column map"
        expected = f"expected a number with {layout.decimal!r} as decimal sign and no thousands separator; {remedy}"
    shown = shortened(cell) if cell else "an empty cell"
    return RecordingError(f"found {shown}, {expected}", row=row, column=layout.name(column))


def refuse_doubtful_decimal(content: bytes, layout: Layout) -> None:
    """Refuse numbers that all look like "1.002": in one country that is one newton, in another a thousand.

    One number with other than three digits behind the sign, more than three before it or a leading zero settles it for
    the file. Between commas a decimal point is taken for granted, and so is a sign that the column map states.

    Raises
    ------
    RecordingError
        No number settles it.
    """
    sign = layout.decimal
    plain = layout.delimiter == "," and sign == "."
    if layout.columns.decimal or plain or content.find(sign.encode(), layout.start) < 0:
        return
    settled = re.compile(rf"[{sign}]([0-9]{{0,2}}(?![0-9])|[0-9]{{4}})|[0-9]{{4}}[{sign}]|(?<![0-9])(0[0-9]*)?[{sign}]")
    start, row, doubtful = layout.start, layout.row, 0
    while start < len(content):
        end = content.find(b"\n", start) + 1 or len(content)
        cells = split_cells(text_of(content[start:end]), layout.delimiter)
        for column in layout.selection.numbers:
            if column < len(cells) and sign in cells[column] and not overrange(cells[column]):
                if settled.search(cells[column]):
                    return
                doubtful = doubtful or row
        start, row = end, row + 1
    if doubtful:
        doubt = f"every {sign!r} in the columns to be read has three digits behind it: it may group thousands"
        remedy = f"if it is the decimal sign, state decimal = {sign!r} in the column map"
        raise RecordingError(f"{doubt}; {remedy}", row=doubtful)
