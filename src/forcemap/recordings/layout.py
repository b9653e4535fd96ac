"""How a delimited file is laid out: what separates its columns, the decimal sign, and which columns are read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from forcemap.errors import RecordingError
from forcemap.recordings.cells import cells_of, first_lines, text_of
from forcemap.recordings.column_map import ALL_COLUMNS, DELIMITERS, ColumnMap
from forcemap.recordings.header import Header, find_header, plain_columns
from forcemap.recordings.selection import Selection, refuse_other_units, select

_SAMPLE = 1 << 16  # bytes from whose last lines the delimiter is found
_SAMPLE_LINES = 20


@dataclass(frozen=True)
class Layout:
    """The layout of a delimited file; its numbers begin at the byte `start`, in row `row` (counted from 1)."""

    columns: ColumnMap
    selection: Selection
    delimiter: str
    decimal: str
    width: int
    start: int
    row: int
    names: tuple[str, ...]
    metadata: dict[str, str]

    def name(self, column: int) -> str:
        """The name of a column, else its number counted from 1."""
        return (self.names[column] if column < len(self.names) else "") or f"{column + 1}"

    @property
    def decimal_is_stated(self) -> bool:
        """True if the decimal sign cannot be a thousands separator."""
        return bool(self.columns.decimal) or self.delimiter == ","


def find_layout(content: bytes, columns: ColumnMap | None, *, begin: int = 0) -> Layout:
    """The layout of a delimited file; without a column map its header must leave no doubt.

    Parameters
    ----------
    content : bytes
        The file.
    columns : ColumnMap or None
        How the device writes its files.
    begin : int
        Where the text begins, after a byte-order mark.

    Raises
    ------
    RecordingError
        No line of numbers, a column that is missing, or a file that could be read in two ways.
    """
    next(first_lines(content, begin))
    sample = _sample(content, begin)
    delimiter = _delimiter(sample, columns)
    if columns is None:
        columns = plain_columns(first_lines(content, begin), delimiter)
    elif columns.time is None and math.isnan(columns.sampling_rate):
        raise RecordingError("the column map states neither time nor sampling_rate_Hz; state one of them")
    header = find_header(first_lines(content, begin), delimiter, columns)
    selection = select(columns, header.names, len(header.first))
    refuse_other_units(columns, selection, header.names)
    refuse_other_units(columns, selection, header.units)
    decimal = columns.decimal or _decimal(header, sample, delimiter, selection)
    if delimiter == "," != columns.delimiter and not header.names and content.find(b".", header.start) < 0:
        _refuse_two_readings(columns, selection, header)
    lines = {
        f"header {row}": line for row, line in enumerate(header.lines, 1) if line.strip() and row != header.names_row
    }
    row = len(header.lines) + 1
    return Layout(columns, selection, delimiter, decimal, len(header.first), header.start, row, header.names, lines)


def _sample(content: bytes, begin: int) -> list[str]:
    """Some whole lines that are likely to hold numbers."""
    head = content[begin : begin + _SAMPLE]
    if len(content) > begin + _SAMPLE:
        head = head[: head.rfind(b"\n") + 1]
    raw = head.rstrip().rsplit(b"\n", _SAMPLE_LINES)
    return [text_of(line) for line in (raw[1:] if len(raw) > _SAMPLE_LINES else raw)]


def _delimiter(sample: Sequence[str], columns: ColumnMap | None) -> str:
    """The delimiter stated, else the first of tab, semicolon and comma that most lines hold; "" if there is none."""
    if columns is not None and columns.delimiter:
        return columns.delimiter
    possible = ["\t", ";"] if columns is not None and columns.decimal == "," else ["\t", ";", ","]
    found = next((sign for sign in possible if sum(sign in line for line in sample) * 2 > len(sample)), "")
    if not found and (columns is None or len(columns.columns) > 1 or columns.runs == ALL_COLUMNS):
        raise RecordingError(f"found one column, expected columns separated by {', '.join(DELIMITERS)}")
    return found


def _decimal(header: Header, sample: Sequence[str], delimiter: str, selection: Selection) -> str:
    """The sign in the first numbers that are read; if they are whole, a comma if there is one further down."""
    first = "".join(header.first[at] for at in selection.numbers)
    if delimiter == "," or "." in first:
        return "."
    lines = [header.first, *(cells_of(line, delimiter) for line in sample)]
    commas = any("," in cells[at] for cells in lines for at in selection.numbers if at < len(cells))
    return "," if commas else "."


def _refuse_two_readings(columns: ColumnMap, selection: Selection, header: Header) -> None:
    """Refuse whole numbers between commas where there are more than are read: "0,5,12,3" may be four or two."""
    read = len(selection.numbers) + (selection.curve is not None)
    if len(header.first) > read or columns.runs == ALL_COLUMNS:
        raise RecordingError(
            "the commas may separate columns or be decimal signs; state delimiter in the column map",
            row=len(header.lines) + 1,
        )
