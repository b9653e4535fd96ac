"""The first lines of a device's file as a table, so that a person can say what each column is."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

from forcemap.answers.answer import Answer
from forcemap.errors import RecordingError
from forcemap.recordings.cells import cells_of, find_delimiter, is_number
from forcemap.recordings.column_map import DELIMITERS, Names
from forcemap.recordings.text import first_lines, lines_of
from forcemap.recordings.units import ForceUnit, TimeUnit, stated_unit

_SHOWN = 14
"""Lines that are shown; a choice: a header, and enough numbers to see what they are."""

_SAMPLE = 60
"""Lines by which the delimiter is found; a choice, beyond most headers."""

_MOST_COLUMNS = 60
"""The most columns that are shown; a choice: more are stated in campaign.toml."""


class ColumnLine(Answer):
    """A line of the file: its number, its cells, and whether most of them are numbers."""

    row: int
    cells: list[str]
    numbers: bool


class ColumnsAnswer(Answer):
    """The first lines of a file, cut into columns; `name` is what a map may call a column, its name or its number."""

    file: str
    delimiter: str
    names: list[str]
    units: list[str]
    lines: list[ColumnLine]
    left_off: int


def columns_answer(path: Path, name: str) -> ColumnsAnswer:
    """The columns of a delimited file.

    Raises
    ------
    RecordingError
        No text, or no columns.
    """
    if path.suffix == ".tdms":
        raise RecordingError("the channels of a TDMS file have names; state them in campaign.toml", file=name)
    lines = [text for _, text in islice(first_lines(lines_of(path.read_bytes())), _SAMPLE)]
    delimiter = find_delimiter(lines[len(lines) // 2 :], None)
    table = [cells_of(line, delimiter) for line in lines]
    numbers = [2 * sum(map(is_number, cells)) > len(cells) for cells in table]
    first = numbers.index(True) if True in numbers else len(table)
    width = max((len(cells) for cells in table[first:]), default=max(map(len, table)))
    above = next((cells for cells in reversed(table[:first]) if _are_names(cells, width)), [])
    known, names = Names(above), [f"{column + 1}" for column in range(width)]
    for column, cell in enumerate(above[:width]):
        names[column] = cell if cell and known.position(cell) == column else names[column]
    found = [stated_unit(cell) for cell in names]
    return ColumnsAnswer(
        file=name,
        delimiter=next((words for words, sign in DELIMITERS.items() if sign == delimiter), ""),
        names=names[:_MOST_COLUMNS],
        units=[unit.value if isinstance(unit, TimeUnit | ForceUnit) else "" for unit in found][:_MOST_COLUMNS],
        lines=[
            ColumnLine(row=row, cells=(cells + [""] * width)[: min(width, _MOST_COLUMNS)], numbers=all_numbers)
            for row, (cells, all_numbers) in enumerate(zip(table, numbers, strict=True), 1)
            if row > first - _SHOWN // 2
        ][:_SHOWN],
        left_off=max(0, width - _MOST_COLUMNS),
    )


def _are_names(cells: list[str], width: int) -> bool:
    """Whether a line of the header may hold the names: as many cells, and not units alone."""
    filled = [cell for cell in cells if cell]
    return len(cells) >= width and bool(filled) and not all(stated_unit(cell, alone=True) for cell in filled)
