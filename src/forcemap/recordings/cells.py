"""A line of text -> its cells: delimiters, quotes, decimal signs; what a number is and what may be a damaged one."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

from forcemap.errors import RecordingError
from forcemap.recordings.column_map import ALL_COLUMNS, DELIMITERS, ColumnMap

BLANK = DELIMITERS["blank"]
COMMENT = re.compile(r"^\s*(?:#+|%+|//+)")

# ASCII digits only: other scripts' digits, thousands separators and a text such as "nan" are no numbers
NUMBERS = {
    signs: re.compile(rf"[+-]?([0-9]+([{signs}][0-9]*)?|[{signs}][0-9]+)([eE][+-]?[0-9]+)?")
    for signs in (".", ",", ".,")
}
# between blanks a comma behind the last digit separates: "0, 5"
_BETWEEN_BLANKS = re.compile(r"[+-]?([0-9]+[.]?|[0-9]*[.,][0-9]+)([eE][+-]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[+-]?(nan|inf)", re.IGNORECASE)
_QUOTED = re.compile(r'"[^"]*"')


def cells_of(line: str, delimiter: str) -> list[str]:
    """The cells of a line of a header, without blanks around them; a sign of a comment before them does not count.

    Between blanks a unit in brackets, or behind " / ", belongs to the word before it.
    """
    line = COMMENT.sub("", line, count=1)
    if delimiter == BLANK:
        line = " ".join(line.split()).replace(" / ", "\0/\0")
        line = re.sub(r"(?<=[^\])]) (?=[\[(])", "\0", line)
    return [cell.replace("\0", " ").strip().strip('"').strip() for cell in split_cells(line, delimiter)]


def split_cells(line: str, delimiter: str, *, strict: bool = False) -> list[str]:
    """The cells of a line; several blanks are one delimiter, and within quotes there is none.

    Raises
    ------
    csv.Error
        Quotes that do not end, or stand within a cell, if strict.
    """
    if '"' in line:
        if delimiter == BLANK:
            line = line.replace("\t", " ").strip()
        try:
            return next(csv.reader([line], delimiter=delimiter or "\n", skipinitialspace=True, strict=strict), [""])
        except csv.Error:
            if strict:
                raise
    if delimiter == BLANK:
        return line.split()
    return line.split(delimiter) if delimiter else [line]


def is_number(cell: str) -> bool:
    """True for a number with either decimal sign."""
    return NUMBERS[".,"].fullmatch(cell) is not None


def clock_remedy(cell: str) -> str:
    """What to do about a time of day or a date; empty for another cell."""
    clock = re.match(r"[0-9]{1,2}:[0-9]{2}|[0-9]{4}-[0-9]{2}-[0-9]{2}|[0-9]{1,2}[./][0-9]{1,2}[./][0-9]{4}", cell)
    return "this is a time of day or a date: export times in s, or state sampling_rate_Hz in place of time" * bool(
        clock
    )


def may_be_measured(time: str | None, forces: Sequence[str]) -> bool:
    """True for a line that may be a measurement, damaged or not, by its cells of time and force: it is never left out.

    A time that looks like a number does, whatever the force; else all cells must look so, or be empty.
    """
    if time is not None and _like_a_number(time):
        return True
    cells = [*forces] if time is None else [time, *forces]
    return any(map(_like_a_number, cells)) and all(not cell or _like_a_number(cell) for cell in cells)


def _like_a_number(cell: str) -> bool:
    """True if at least half of the cell's characters are those of numbers, a digit among them, or for nan."""
    digits = sum(character in "0123456789" for character in cell)
    signs = sum(character in "+-.,eE" for character in cell)
    return bool(digits and 2 * (digits + signs) >= len(cell)) or _NOT_FINITE.match(cell) is not None


def find_delimiter(sample: Sequence[str], columns: ColumnMap | None) -> str:
    """The delimiter stated, else the first of tab, semicolon, comma and blanks that most lines hold outside of quotes.

    Blanks go before commas where all between them are numbers: "0,001 12,5". "" if there is none and none is needed.

    Raises
    ------
    RecordingError
        One column where several are read.
    """
    if columns is not None and columns.delimiter:
        return columns.delimiter
    lines = [line for line in sample if line.strip()]
    bare = [_QUOTED.sub("", line) for line in lines]
    quoted = 2 * sum(map(len, bare)) < sum(map(len, lines))
    possible = ["\t", ";"] if columns is not None and columns.decimal == "," and not quoted else ["\t", ";", ","]
    delimiter = next((sign for sign in possible if sum(sign in line for line in bare) * 2 > len(lines)), "")
    if delimiter in ("", ","):
        wanted = len(columns.number_columns) if columns is not None else 2
        rows = [[_BETWEEN_BLANKS.fullmatch(cell.strip('"')) for cell in line.split()] for line in lines]
        good = [len(row) > 1 and (all(row) if delimiter else sum(map(bool, row)) >= wanted) for row in rows]
        delimiter = BLANK if sum(good) * 2 > len(lines) else delimiter
    if not delimiter and (columns is None or len(columns.columns) > 1 or columns.runs == ALL_COLUMNS):
        raise RecordingError(f"found one column, expected columns separated by {', '.join(DELIMITERS)}")
    return delimiter
