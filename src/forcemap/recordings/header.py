"""Where the header of a delimited file ends and its numbers begin."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from forcemap.errors import RecordingError
from forcemap.recordings.cells import cells_of, is_number, like_a_number
from forcemap.recordings.column_map import ALL_COLUMNS, ColumnMap
from forcemap.recordings.selection import Selection, listed, missing_column, position, select
from forcemap.recordings.units import (
    ForceUnit,
    TimeUnit,
    force_unit_in,
    names_plain_force,
    names_plain_time,
    time_unit_in,
)

_COUNT_UNITS = ("count", "counts", "digit", "digits", "lsb", "raw")
_REMEDY = "correct the line, or state header_lines in the column map if it belongs to the header"


@dataclass(frozen=True)
class Header:
    """The lines before the numbers: `names` (in row `names_row`, counted from 1) and `units` are empty where the file
    has none; `start` is the byte at which the numbers begin, `first` the cells of their first line.
    """

    lines: tuple[str, ...]
    names_row: int | None
    names: tuple[str, ...]
    units: tuple[str, ...]
    first: tuple[str, ...]
    start: int


def find_header(lines: Iterable[tuple[int, str]], delimiter: str, columns: ColumnMap) -> Header:
    """The header: up to the line that holds the names, else up to the first line with numbers in all columns read.

    Raises
    ------
    RecordingError
        Names that are missing, no numbers, or a line between header and numbers that may be a damaged measurement.
    """
    wanted = [column for column in columns.columns if isinstance(column, str)]
    texts: list[str] = []
    table: list[list[str]] = []
    names_at: int | None = None
    start: int | None = None
    for offset, text in lines:
        texts.append(text)
        table.append(cells_of(text, delimiter))
        in_header = columns.header_lines is None or len(table) <= columns.header_lines
        if wanted and in_header and all(position(column, table[-1]) is not None for column in wanted):
            names_at = len(table) - 1
        elif columns.header_lines is None:
            known = not wanted or names_at is not None
            if known and _holds_numbers(table[-1], columns, () if names_at is None else table[names_at]):
                start = offset
                break
        elif len(table) > columns.header_lines:
            start = offset
            break
    if start is None or (wanted and names_at is None):
        raise _no_numbers(table, columns, names_at)
    before, first = table[:-1], table[-1]
    units_at = _line_of_units(before, columns, names_at)
    end = len(before) if units_at is None else units_at
    if columns.header_lines is None:
        _refuse_damaged(before, columns, names_at, end)
    if names_at is None:
        names_at = _line_of_names(before[:end], first, columns)
    elif not _fits(before[names_at], first):
        raise _other_width(before[names_at], first, len(table))
    names = () if names_at is None else tuple(before[names_at])
    units = () if units_at is None else tuple(before[units_at])
    names_row = None if names_at is None else names_at + 1
    return Header(tuple(texts[:-1]), names_row, names, units, tuple(first), start)


def plain_columns(lines: Iterable[tuple[int, str]], delimiter: str) -> ColumnMap:
    """The column map of a file whose header names one time and one force with their units, and nothing else.

    Raises
    ------
    RecordingError
        Any other header.
    """
    table: list[list[str]] = []
    for _, text in lines:
        cells = cells_of(text, delimiter)
        if all(is_number(cell) for cell in cells):
            break
        table.append(cells)
        names = [cell for cell in cells if cell]
        times, forces = list(filter(names_plain_time, names)), list(filter(names_plain_force, names))
        if len(names) == 2 and len(times) == len(forces) == 1:
            return ColumnMap(
                time=times[0],
                time_unit=time_unit_in(times[0]) or TimeUnit.SECONDS,
                force=forces[0],
                force_unit=force_unit_in(forces[0]) or ForceUnit.NEWTONS,
            )
    last = [cell for cell in table[-1] if cell] if table else []
    there = f"found the columns {listed(last)}" if last else "found no names of columns"
    raise RecordingError(
        f"{there}, expected one time and one force with their units, such as time_s and force_N; "
        "else state the columns and their units in a column map ([recordings] in campaign.toml, or --column)",
        row=len(table) or None,
    )


def _selection(cells: Sequence[str], columns: ColumnMap, names: Sequence[str]) -> Selection | None:
    """The columns that are read, if the line is long enough to have them."""
    try:
        return select(columns, names, len(cells))
    except RecordingError:
        return None


def _holds_numbers(cells: Sequence[str], columns: ColumnMap, names: Sequence[str]) -> bool:
    selection = _selection(cells, columns, names)
    return selection is not None and all(is_number(cells[at]) for at in selection.numbers)


def _line_of_units(before: Sequence[Sequence[str]], columns: ColumnMap, names_at: int | None) -> int | None:
    """The last line of the header, if it holds units in all columns that are read."""
    last = _last_filled(before)
    if last is None or last == names_at:
        return None
    cells = before[last]
    selection = _selection(cells, columns, () if names_at is None else before[names_at])
    if selection is None or (selection.time is not None and time_unit_in(cells[selection.time]) is None):
        return None
    forces = [cells[at] for group in selection.forces for at in group]
    good = all(force_unit_in(unit) or unit.casefold().strip("[]()") in _COUNT_UNITS for unit in forces)
    return last if good else None


def _line_of_names(before: Sequence[Sequence[str]], first: Sequence[str], columns: ColumnMap) -> int | None:
    """The last line of the header, if it has a cell for each column: names that nobody asked for."""
    last = _last_filled(before)
    if last is None or _fits(before[last], first):
        return last
    if len(before[last]) > 1 and columns.header_lines is None:
        raise _other_width(before[last], first, len(before) + 1)
    return None


def _fits(names: Sequence[str], first: Sequence[str]) -> bool:
    """True if there are as many names as cells, but for empty ones at the end, after a last delimiter."""
    return _filled(first) <= len(names) and _filled(names) <= len(first)


def _filled(cells: Sequence[str]) -> int:
    return next((at + 1 for at in reversed(range(len(cells))) if cells[at]), 0)


def _other_width(names: Sequence[str], first: Sequence[str], row: int) -> RecordingError:
    return RecordingError(
        f"found {_filled(first)} cells below {_filled(names)} names of columns, expected as many; "
        "state header_lines in the column map if the names end above, or delimiter and decimal if one is taken for the "
        "other",
        row=row,
    )


def _last_filled(lines: Sequence[Sequence[str]]) -> int | None:
    return next((at for at in reversed(range(len(lines))) if any(lines[at])), None)


def _refuse_damaged(before: Sequence[Sequence[str]], columns: ColumnMap, names_at: int | None, end: int) -> None:
    """Refuse a line between names and numbers, or without names a last line that is partly numbers: nothing measured is
    taken for a header.
    """
    for row in range(0 if names_at is None else names_at + 1, end):
        cells = before[row]
        if not any(cells):
            continue
        if names_at is None:
            if row != _last_filled(before[:end]):
                continue
            read = [at for at in _numbered(columns, len(cells)) if like_a_number(cells[at])]
        else:
            selection = _selection(cells, columns, before[names_at])
            wrong = [] if selection is None else [at for at in selection.numbers if not is_number(cells[at])]
            read = wrong or [0]
        if read:
            found = f"found {cells[read[0]]!r} before the first line of numbers, expected a number"
            raise RecordingError(f"{found}; {_REMEDY}", row=row + 1, column=f"{read[0] + 1}")


def _numbered(columns: ColumnMap, width: int) -> list[int]:
    if columns.runs == ALL_COLUMNS:
        return list(range(width))
    return [column - 1 for column in columns.number_columns if isinstance(column, int) and column <= width]


def _no_numbers(table: Sequence[Sequence[str]], columns: ColumnMap, names_at: int | None) -> RecordingError:
    """Why no header and no numbers were found."""
    if names_at is not None:
        return RecordingError("no line of numbers follows the names of the columns", row=names_at + 1)
    wanted = [column for column in columns.columns if isinstance(column, str)]
    if not wanted:
        numbers = [column for column in columns.number_columns if isinstance(column, int)]
        widest = max(map(len, table), default=0)
        if numbers and widest < max(numbers):
            found = f"found {widest} column{'s' if widest != 1 else ''}, expected a column {max(numbers)}"
            return RecordingError(f"{found}; is the delimiter right?", column=str(max(numbers)))
        return RecordingError(f"found no line with numbers in all columns read among the first {len(table)} lines")

    def likeness(cells: Sequence[str]) -> int:
        return sum(position(column, cells) is not None for column in wanted)

    best = max(table, key=likeness, default=())
    if not likeness(best):
        # the line above the first numbers is what a person would call the names
        at = next((at for at, cells in enumerate(table) if all(is_number(cell) for cell in cells)), 0)
        best = table[at - 1] if at else ()
    missing = [column for column in wanted if position(column, best) is None]
    if not missing:
        return RecordingError("the names of the columns stand below header_lines; correct header_lines")
    return RecordingError(missing_column(missing[0], best), column=missing[0])
