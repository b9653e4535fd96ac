"""The lines before the numbers of a delimited file: names of columns, units, remarks; and where the numbers begin."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from forcemap.errors import RecordingError
from forcemap.recordings.cells import BLANK, COMMENT, cells_of, clock_remedy, is_number, may_be_measured
from forcemap.recordings.column_map import ColumnMap, Names, listed, missing_column
from forcemap.recordings.selection import Selection, select, too_narrow
from forcemap.recordings.units import ForceUnit, TimeUnit, in_brackets, plain_unit, stated_unit

_COMMENTS = ("comment", "comments", "kommentar", "commentaire", "remark", "remarks", "bemerkung", "note", "notes")
_OPTIONAL = (*_COMMENTS, "start", "increment")
_CLOCK = re.compile(r"(\d{4}-\d{2}-\d{2}[ T])?\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?Z?")
_WHERE = " ([recordings] in campaign.toml, or --column)"
_REMEDY = "correct the line, or state header_lines in the column map if it belongs to the header"


@dataclass(frozen=True)
class Header:
    """The lines before the numbers.

    `names` (in row `names_row`, counted from 1) are empty where the file has none; `units` are the lines that hold
    units; `start` is the byte at which the numbers begin, `first` the cells of their first line.
    """

    lines: tuple[str, ...]
    names_row: int | None
    names: tuple[str, ...]
    units: tuple[tuple[str, ...], ...]
    first: tuple[str, ...]
    start: int


def find_header(lines: Iterable[tuple[int, str]], delimiter: str, columns: ColumnMap) -> Header:
    """The header: up to the line that holds the names, else up to the first line with numbers in all columns read.

    Below the names, units and other texts may follow.

    Raises
    ------
    RecordingError
        Names that are missing, no numbers, or a line between header and numbers that may be a damaged measurement.
    """
    wanted = [column for column in columns.columns if isinstance(column, str)]
    stated = columns.header_lines
    read: list[tuple[int, str]] = []
    table: list[list[str]] = []
    names_at: int | None = None
    names: Sequence[str] = ()
    for line in lines:
        read.append(line)
        table.append(cells_of(line[1], delimiter))
        in_header = stated is None or len(table) <= stated
        cells = _with_names(line[1], delimiter, wanted) if wanted and in_header else None
        if cells is not None:
            names_at, names = len(table) - 1, cells
            table[-1] = cells
        elif stated is not None:
            if not in_header:
                break
        elif (names_at is not None or not wanted) and not COMMENT.match(line[1]):
            selection = _selection(table[-1], columns, names)
            if selection and all(is_number(table[-1][column]) for column in selection.numbers):
                break
    else:
        raise _no_numbers(table, columns, wanted, names_at)
    if wanted and names_at is None:
        raise _no_numbers(table, columns, wanted, names_at)
    before, first = table[:-1], table[-1]
    selection = select(columns, names, len(first))
    unit_lines = [
        row for row in range(len(before)) if row != names_at and _holds_units(before, row, names_at, selection)
    ]
    if stated is None:
        _refuse_damaged(before, selection, names_at, unit_lines)
    if names_at is None:
        names_at = _line_of_names(before, read, unit_lines, delimiter, first, columns)
    elif not _fits(names, first):
        raise _other_width(names, first, len(table))
    return Header(
        lines=tuple(text for _, text in read[:-1]),
        names_row=None if names_at is None else names_at + 1,
        names=() if names_at is None else tuple(_without_empty_end(before[names_at])),
        units=tuple(tuple(before[row]) for row in unit_lines if row != names_at),
        first=tuple(first),
        start=read[-1][0],
    )


def plain_columns(lines: Iterable[tuple[int, str]], delimiter: str) -> ColumnMap:
    """The column map of a file whose header names one time and one force with their units, and nothing else.

    Raises
    ------
    RecordingError
        Any other header.
    """
    table: list[list[str]] = []
    numbers: list[str] = []
    for _, text in lines:
        cells = cells_of(text, delimiter)
        if sum(map(is_number, cells)) >= min(len(cells), 2):  # a line of numbers: time and force at least
            numbers = cells
            break
        table.append(cells)
        filled = [cell for cell in cells if cell]
        times = [(name, unit) for name in filled if isinstance(unit := plain_unit(name, TimeUnit), TimeUnit)]
        forces = [(name, unit) for name in filled if isinstance(unit := plain_unit(name, ForceUnit), ForceUnit)]
        if len(filled) == len(times) + len(forces) and len(times) == len(forces) == 1:
            ((time, time_unit),), ((force, force_unit),) = times, forces
            return ColumnMap(time=time, time_unit=time_unit, force=force, force_unit=force_unit)
    for row, cells in [(len(table) + 1, numbers)] if numbers else enumerate(table, start=1):  # above them it is no time
        if clock := next(filter(_CLOCK.fullmatch, cells), None):
            expected = "expected seconds; state sampling_rate_Hz in place of time, and the column of the force"
            raise RecordingError(f"found the time of day {clock!r}, {expected}, in a column map{_WHERE}", row=row)
    names = [[cell for cell in cells if cell and stated_unit(cell, alone=True) is None] for cells in table]
    longest = max(range(len(names)), key=lambda row: (len(names[row]), row), default=0)
    present = (
        f"found the columns {listed([cell for cell in table[longest] if cell])}"
        if table
        else "found no names of columns"
    )
    expected = "expected one time and one force with their units, such as time_s and force_N"
    remedy = f"else state the columns and their units in a column map{_WHERE}"
    raise RecordingError(f"{present}, {expected}; {remedy}", row=longest + 1 if table else None)


def _with_names(line: str, delimiter: str, wanted: Sequence[str]) -> list[str] | None:
    """The cells of a line that has all columns wanted."""
    for cells in (cells_of(line, delimiter), *([_cells_far_apart(line)] if delimiter == BLANK else [])):
        names = Names(cells)
        if all(names.position(column) is not None for column in wanted):
            return cells
    return None


def _cells_far_apart(line: str) -> list[str]:
    """The cells of a header in which two blanks or a tab separate, and one blank belongs to a name."""
    return re.split(r"\s{2,}|\t", COMMENT.sub("", line, count=1).strip())


def _selection(cells: Sequence[str], columns: ColumnMap, names: Sequence[str]) -> Selection | None:
    """The columns that are read, if the line is long enough to have them."""
    try:
        return select(columns, names, len(cells))
    except RecordingError:
        return None


def _holds_units(before: Sequence[Sequence[str]], row: int, names_at: int | None, selection: Selection) -> bool:
    """True for a line of the header with units: a known one above every force, or one of time and any above the forces.

    The latter in brackets or below names: there it can be nothing but a unit.
    """
    cells = before[row]
    forces = [cells[column] if column < len(cells) else "" for group in selection.forces for column in group]
    if all(stated_unit(force, alone=True) is not None for force in forces):
        return True
    time = cells[selection.time] if selection.time is not None and selection.time < len(cells) else ""
    of_time = isinstance(stated_unit(time, alone=True), TimeUnit)
    above = before[row - 1] if row else ()
    below_names = _filled(above) == _filled(cells) if names_at is None else row > names_at
    return of_time and all(force and (below_names or in_brackets(force)) for force in forces)


def _line_of_names(
    before: list[list[str]],
    read: Sequence[tuple[int, str]],
    unit_lines: Sequence[int],
    delimiter: str,
    first: Sequence[str],
    columns: ColumnMap,
) -> int | None:
    """The last line of the header except units, if it has a cell for every column: names that are not asked for."""
    last = next((row for row in reversed(range(len(before))) if any(before[row]) and row not in unit_lines), None)
    if last is None or _fits(before[last], first):
        return last
    if delimiter == BLANK and _fits(apart := _cells_far_apart(read[last][1]), first):
        before[last] = apart
        return last
    # other delimiters than a comma are no decimal signs: what does not fit is text
    if delimiter == "," and len(before[last]) > 1 and columns.header_lines is None:
        raise _other_width(before[last], first, len(before) + 1)
    return None


def _fits(names: Sequence[str], first: Sequence[str]) -> bool:
    """True if there are as many names as cells, except empty ones at the end and a comment that may be missing."""
    names = _without_empty_end(names)
    return _filled(first) <= len(names) <= len(first) + optional_columns(names)


def _filled(cells: Sequence[str]) -> int:
    return next((index + 1 for index in reversed(range(len(cells))) if cells[index]), 0)


def _without_empty_end(cells: Sequence[str]) -> Sequence[str]:
    return cells[: _filled(cells)]


def _other_width(names: Sequence[str], first: Sequence[str], row: int) -> RecordingError:
    problem = f"found {_filled(first)} cells below {_filled(names)} names of columns, expected as many"
    remedy = "state header_lines in the column map if the names end above"
    otherwise = "or delimiter and decimal if one is taken for the other"
    return RecordingError(f"{problem}; {remedy}, {otherwise}", row=row)


def _refuse_damaged(
    before: Sequence[Sequence[str]], selection: Selection, names_at: int | None, unit_lines: Sequence[int]
) -> None:
    """Refuse a line that may be a damaged measurement: any below the names; without names, the last without units."""
    texts = [row for row, cells in enumerate(before) if any(cells) and row not in unit_lines]
    for row in texts[-1:] if names_at is None else [row for row in texts if row > names_at]:
        cells = {column: before[row][column] if column < len(before[row]) else "" for column in selection.numbers}
        time = None if selection.time is None else cells[selection.time]
        if may_be_measured(time, [cells[column] for group in selection.forces for column in group]):
            wrong = next((column for column, cell in cells.items() if not is_number(cell)), 0)
            problem = f"found {cells.get(wrong, '')!r} before the first line of numbers, expected a number"
            raise RecordingError(f"{problem}; {_REMEDY}", row=row + 1, column=f"{wrong + 1}")


def _no_numbers(
    table: Sequence[list[str]], columns: ColumnMap, wanted: list[str], names_at: int | None
) -> RecordingError:
    """The error where no header and no numbers were found."""
    if names_at is not None:
        clock = next((cells for cells in table[names_at + 1 :] if any(map(clock_remedy, cells))), [])
        remedy = next(filter(None, map(clock_remedy, clock)), "")
        message = "no line of numbers follows the names of the columns"
        return RecordingError(f"{message}; {remedy}" if remedy else message, row=names_at + 1)
    if not wanted:
        numbers = [column for column in columns.number_columns if isinstance(column, int)]
        if numbers and (widest := max(map(len, table), default=0)) < max(numbers):
            return too_narrow(widest, max(numbers))
        return RecordingError(f"found no line with numbers in all columns read among the first {len(table)} lines")

    def likeness(names: Names) -> int:
        return sum(names.position(column) is not None for column in wanted)

    best = max(table, key=lambda cells: likeness(Names(cells)), default=[])
    if not likeness(Names(best)):
        # the line above the first numbers is what a person would call the names
        numbers_row = next((row for row, cells in enumerate(table) if all(is_number(cell) for cell in cells)), 0)
        best = table[numbers_row - 1] if numbers_row else []
    names = Names(best)
    if not (missing := [column for column in wanted if names.position(column) is None]):
        return RecordingError("the names of the columns stand below header_lines; correct header_lines")
    return RecordingError(missing_column(missing[0], best), column=missing[0])


def optional_columns(names: Sequence[str]) -> int:
    """Number of last columns that rows may leave out: comments, and what oscilloscopes write once beside the names."""
    return sum(1 for _ in itertools.takewhile(lambda name: name.casefold() in _OPTIONAL, reversed(names)))
