"""A CSV table as text: columns, line numbers, decimal signs; what every table of a campaign has in common."""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from forcemap.errors import TableError, nearest_names

_PLAIN_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_NUMBER, _NUMBER_OR_NONE = re.compile(_PLAIN_NUMBER, re.ASCII), re.compile(f"(?:{_PLAIN_NUMBER})?", re.ASCII)
_FORMULA = re.compile(r"'*[=+@\t\r-]")
_FORMULA_BEGINS = frozenset("'=+@\t\r-")
_LARGEST = 20_000_000  # bytes of a table; a choice: 100,000 impacts fit in
_WHOLE_NUMBER = re.compile(r"\d{1,9}", re.ASCII)
_NUMBERS = {  # a whole column at once
    True: re.compile(rf"{_PLAIN_NUMBER}(?:\n{_PLAIN_NUMBER})*", re.ASCII),
    False: re.compile(rf"(?:{_PLAIN_NUMBER})?(?:\n(?:{_PLAIN_NUMBER})?)*", re.ASCII),
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
    remarks : mapping of str to str
        What lines such as "# edition: ..." say, by the word before the colon.
    """

    file: str
    columns: Mapping[str, list[str]]
    rows: list[int]
    header_row: int
    delimiter: str
    remarks: Mapping[str, str] = field(default_factory=dict)

    @property
    def texts(self) -> list[dict[str, str]]:
        """Every row as a text for each column."""
        return [dict(zip(self.columns, row, strict=True)) for row in zip(*self.columns.values(), strict=True)]

    def numbers(self, column: str, *, required: bool) -> list[float]:
        """A column of numbers; NaN for an empty cell unless required."""
        cells = self.columns[column]
        plain = _NUMBERS[required].fullmatch("\n".join(cells)) and not any("\n" in cell for cell in cells)
        if not plain:
            self._refuse_others(column, _NUMBER if required else _NUMBER_OR_NONE, "a number")
        return [float(cell) if cell else math.nan for cell in cells]

    def whole_numbers(self, column: str) -> list[int]:
        """A column of whole numbers."""
        self._refuse_others(column, _WHOLE_NUMBER, "a whole number")
        return [int(cell) for cell in self.columns[column]]

    def _refuse_others(self, column: str, wanted: re.Pattern[str], expected: str) -> None:
        for cell, row in zip(self.columns[column], self.rows, strict=True):
            if not wanted.fullmatch(cell):
                raise self.error(f"found {cell!r}, expected {expected}", row, column)

    def error(self, message: str, row: int | None = None, column: str | None = None) -> TableError:
        """The error to raise for a cell, row or column of the table."""
        return TableError(message, file=self.file, row=row, column=column)

    def require_columns(self, required: Sequence[str], known: Collection[str]) -> None:
        """Refuse a header with an unknown column, or without a required one."""
        for name in self.columns:
            if name not in known:
                near = f"the nearest known ones are {', '.join(nearest_names(name, known, 2))}"
                message = f"found an unknown column {name!r}, {near}; rename it or take it out"
                raise self.error(message, self.header_row, name)
        for name in required:
            if name not in self.columns:
                message = f"the column is missing, expected at least {', '.join(required)}"
                raise self.error(message, self.header_row, name)

    def with_decimal_points(self, numeric: Iterable[str]) -> Table:
        """The table with decimal points in its numeric columns; a mixture of both signs is refused as ambiguous."""
        names = [name for name in numeric if name in self.columns]
        if self.delimiter == "," or not any("," in cell for name in names for cell in self.columns[name]):
            return self
        columns = dict(self.columns)
        for name in names:
            for cell, row in zip(columns[name], self.rows, strict=True):
                if "." in cell:
                    message = f"found {cell!r} in a table with decimal commas, expected one decimal sign throughout"
                    raise self.error(message, row, name)
            columns[name] = [cell.replace(",", ".") for cell in columns[name]]
        return replace(self, columns=columns)


def read_table(content: bytes, file: str, *, what: str, remarked: bool = False) -> Table:
    """The text of a table: UTF-8, a header, commas, semicolons or tabs; `what` is what a row holds.

    If `remarked`, lines above the header that begin with # are remarks; below it they are rows: none is hidden.

    Raises
    ------
    TableError
        Not text, not a table, no row, a row of another length than the header, a column twice.
    """
    if len(content) > _LARGEST:
        most = f"at most {_LARGEST / 1e6:.0f} MB"
        raise TableError(f"found {len(content) / 1e6:.0f} MB, expected {most}: is this a table of {what}s?", file=file)
    text, remarks = _text(content, file), {}
    if remarked:
        lines = text.splitlines()
        above = [*itertools.takewhile(lambda line: line.startswith("#") or not line.strip(), lines)]
        remarked_lines = [line.lstrip("# ").partition(":") for line in above]
        remarks = {word.strip().lower(): value.strip() for word, _, value in remarked_lines}
        text = "\n".join(["" for _ in above] + lines[len(above) :])
    first = next((line for line in text.splitlines() if line.strip()), "")
    if not first:
        raise TableError(f"the file is empty, expected a header and at least one {what}", file=file)
    delimiter = max(",;\t", key=first.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    records: list[tuple[int, list[str]]] = []
    try:
        for record in reader:
            if any(cell.strip() for cell in record):
                records.append((reader.line_num, [*map(str.strip, record)]))
    except csv.Error as error:
        raise TableError(f"not a CSV table ({error})", file=file, row=reader.line_num) from None
    if not records:
        raise TableError("found no header, expected one", file=file)
    (header_row, header), *body = records
    header = [*map(_plain, header)]
    while header and not header[-1] and all(len(record) == len(header) and not record[-1] for _, record in body):
        header.pop()  # empty columns at the end, as spreadsheets write them
        for _, record in body:
            record.pop()
    for name, times in Counter(header).items():
        if times > 1:
            message = f"found column {name!r} twice, expected it once"
            raise TableError(message, file=file, row=header_row, column=name)
    for row, record in body:
        if len(record) != len(header):
            raise TableError(f"found {len(record)} cells, expected {len(header)} as in the header", file=file, row=row)
    columns = {name: [record[i] for _, record in body] for i, name in enumerate(header)}
    for name in [name for name, cells in columns.items() if "'" in _begins(cells)]:
        columns[name] = [*map(_plain, columns[name])]
    return Table(file, columns, [row for row, _ in body], header_row, delimiter, remarks)


def csv_cell(value: object, form: str = "") -> str:
    """The text of a cell: empty for None and NaN, true or false, a number in full or as `form` says."""
    if type(value) is str and not form:  # most cells
        return value
    if value is None or value != value:
        return ""
    return str(value).lower() if isinstance(value, bool) else format(value, form)


def csv_text(columns: Mapping[str, Sequence[str]]) -> str:
    """The text of a CSV file with these columns; `read_table` gives back the same cells."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(map(_no_formula, columns))
    safe = [[*map(_no_formula, cells)] if _begins(cells) & _FORMULA_BEGINS else cells for cells in columns.values()]
    writer.writerows(zip(*safe, strict=True))
    return stream.getvalue()


def _begins(cells: Sequence[str]) -> set[str]:
    """The characters that cells begin with."""
    return {cell[:1] for cell in cells}


def _no_formula(cell: str) -> str:
    """A cell behind an apostrophe where a spreadsheet would take its text for a formula; `_plain` takes it off."""
    return f"'{cell}" if _FORMULA.match(cell) and not _NUMBER.fullmatch(cell) else cell


def _plain(cell: str) -> str:
    """The cell as it was before `_no_formula`."""
    return cell[1:] if cell[:1] == "'" and _FORMULA.match(cell) else cell


def _text(content: bytes, file: str) -> str:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = content[: error.start].count(b"\n") + 1
        raise TableError("not text in UTF-8; save the table as CSV in UTF-8", file=file, row=row) from None
    if "\0" in text:
        raise TableError("a binary file, expected a CSV table", file=file, row=text[: text.index("\0")].count("\n") + 1)
    return text
