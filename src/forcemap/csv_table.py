"""A CSV table as text: columns, line numbers, decimal signs; what every table of a campaign has in common."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from forcemap.errors import TableError

_ONE = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_NUMBER = re.compile(_ONE, re.ASCII)
_NUMBERS = {  # a whole column at once
    True: re.compile(rf"{_ONE}(?:\n{_ONE})*", re.ASCII),
    False: re.compile(rf"(?:{_ONE})?(?:\n(?:{_ONE})?)*", re.ASCII),
}


@dataclass(frozen=True)
class Table:
    """Cells of a table as text.

    Parameters
    ----------
    file : str
        Name that errors give.
    columns : mapping of str to list of str
        Every column's cells, without surrounding blanks.
    rows : list of int
        Line number of every row.
    header_row : int
        Line number of the header.
    delimiter : str
        What separates the columns.
    """

    file: str
    columns: Mapping[str, list[str]]
    rows: list[int]
    header_row: int
    delimiter: str

    @property
    def texts(self) -> list[dict[str, str]]:
        """Every row as a text for each column."""
        return [dict(zip(self.columns, row, strict=True)) for row in zip(*self.columns.values(), strict=True)]

    def numbers(self, column: str, *, required: bool) -> list[float]:
        """A column of numbers; NaN for an empty cell unless required."""
        cells = self.columns[column]
        if cells and _NUMBERS[required].fullmatch("\n".join(cells)) and not any("\n" in cell for cell in cells):
            return [float(cell) if cell else math.nan for cell in cells]
        return [
            _number(cell, required, self.file, row, column)
            for cell, row in zip(self.columns[column], self.rows, strict=True)
        ]

    def whole_numbers(self, column: str) -> list[int]:
        """A column of whole numbers."""
        return [_whole(cell, self.file, row, column) for cell, row in zip(self.columns[column], self.rows, strict=True)]

    def with_decimal_points(self, numeric: Iterable[str]) -> Table:
        """The table with decimal points in its numeric columns; one that mixes both signs is refused as ambiguous."""
        names = [name for name in numeric if name in self.columns]
        if self.delimiter == "," or not any("," in cell for name in names for cell in self.columns[name]):
            return self
        columns = dict(self.columns)
        for name in names:
            for cell, row in zip(columns[name], self.rows, strict=True):
                if "." in cell:
                    raise TableError(
                        f"found {cell!r} in a table with decimal commas, expected one decimal sign throughout",
                        file=self.file,
                        row=row,
                        column=name,
                    )
            columns[name] = [cell.replace(",", ".") for cell in columns[name]]
        return Table(self.file, columns, self.rows, self.header_row, self.delimiter)


def read_table(content: bytes, file: str, *, what: str) -> Table:
    """The text of a table: UTF-8, a header, commas, semicolons or tabs; `what` is what a row holds.

    Raises
    ------
    TableError
        Not text, not a table, no row, a row of another length than the header, a column twice.
    """
    text = _text(content, file)
    first = next((line for line in text.splitlines() if line.strip()), "")
    if not first:
        raise TableError(f"the file is empty, expected a header and at least one {what}", file=file)
    delimiter = max(",;\t", key=first.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    records: list[tuple[int, list[str]]] = []
    try:
        for record in reader:
            if any(cell.strip() for cell in record):
                records.append((reader.line_num, [cell.strip() for cell in record]))
    except csv.Error as error:
        raise TableError(f"not a CSV table ({error})", file=file, row=reader.line_num) from None
    if not records:
        raise TableError("found no header, expected one", file=file)
    (header_row, header), *body = records
    while header and not header[-1] and all(len(record) == len(header) and not record[-1] for _, record in body):
        header.pop()  # empty columns at the end, as spreadsheets write them
        for _, record in body:
            record.pop()
    for name in header:
        if header.count(name) > 1:
            message = f"found column {name!r} twice, expected it once"
            raise TableError(message, file=file, row=header_row, column=name)
    for row, record in body:
        if len(record) != len(header):
            raise TableError(f"found {len(record)} cells, expected {len(header)} as in the header", file=file, row=row)
    columns = {name: [record[i] for _, record in body] for i, name in enumerate(header)}
    return Table(file, columns, [row for row, _ in body], header_row, delimiter)


def csv_text(columns: Mapping[str, Sequence[str]]) -> str:
    """The text of a CSV file with these columns."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return stream.getvalue()


def _text(content: bytes, file: str) -> str:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = content[: error.start].count(b"\n") + 1
        raise TableError("not text in UTF-8; save the table as CSV in UTF-8", file=file, row=row) from None
    if "\0" in text:
        raise TableError("a binary file, expected a CSV table", file=file, row=text[: text.index("\0")].count("\n") + 1)
    return text


def _number(cell: str, required: bool, file: str, row: int, column: str) -> float:
    if cell == "" and not required:
        return math.nan
    if not _NUMBER.fullmatch(cell):
        raise TableError(f"found {cell!r}, expected a number", file=file, row=row, column=column)
    return float(cell)


def _whole(cell: str, file: str, row: int, column: str) -> int:
    if not re.fullmatch(r"\d{1,9}", cell, re.ASCII):
        raise TableError(f"found {cell!r}, expected a whole number", file=file, row=row, column=column)
    return int(cell)
