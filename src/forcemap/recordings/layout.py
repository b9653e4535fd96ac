"""How a delimited file is laid out: its header, delimiter and decimal sign, and which columns are read."""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from forcemap.errors import RecordingError
from forcemap.recordings.cells import BLANK, COMMENT, cells_of, clock_remedy, find_delimiter, is_number, may_be_measured
from forcemap.recordings.column_map import ALL_COLUMNS, ColumnMap, Names, listed, missing_column
from forcemap.recordings.sampling import refuse_other_unit
from forcemap.recordings.text import text_of
from forcemap.recordings.units import ForceUnit, TimeUnit, Unit, in_brackets, plain_unit, remarked_units, stated_unit

LONGEST_LINE = 1 << 19
_LONGEST_HEADER = 1 << 22  # bytes
_MOST_HEADER_LINES = 10_000
_SAMPLE = 1 << 16  # bytes from whose last lines the delimiter is found
_SAMPLE_LINES = 20
_COMMENTS = ("comment", "comments", "kommentar", "commentaire", "remark", "remarks", "bemerkung", "note", "notes")
_MOST_LINES_OF_NAMES = 4
_OPTIONAL = (*_COMMENTS, "start", "increment")
_REMEDY = "correct the line, or state header_lines in the column map if it belongs to the header"


@dataclass(frozen=True)
class Layout:
    """The layout of a delimited file; its numbers begin at the byte `start`, in row `row` (counted from 1).

    A row has `width` cells, or up to `optional` more: a comment, which may be missing.
    """

    columns: ColumnMap
    selection: Selection
    delimiter: str
    decimal: str
    width: int
    optional: int
    start: int
    row: int
    names: tuple[str, ...]
    metadata: dict[str, str]

    def name(self, column: int) -> str:
        """The name of a column, else its number counted from 1."""
        return (self.names[column] if column < len(self.names) else "") or f"{column + 1}"

    @cached_property
    def place_of(self) -> dict[int, int]:
        """Where each column stands among those that are read."""
        return {column: at for at, column in enumerate(self.selection.numbers)}


def find_layout(content: bytes, columns: ColumnMap | None) -> Layout:
    """The layout of a delimited file; without a column map its header must leave no doubt.

    Parameters
    ----------
    content : bytes
        The lines of the file.
    columns : ColumnMap or None
        How the device writes its files.

    Raises
    ------
    RecordingError
        No line of numbers, a column that is missing, or a file that could be read in two ways.
    """
    next(first_lines(content))
    sample = _sample(content)
    delimiter = find_delimiter(sample, columns)
    if columns is None:
        columns = plain_columns(first_lines(content), delimiter)
    elif columns.time is None and math.isnan(columns.sampling_rate):
        raise RecordingError("the column map states neither time nor sampling_rate_Hz; state one of them")
    header = find_header(first_lines(content), delimiter, columns)
    selection = select(columns, header.names, len(header.first))
    _refuse_other_units(header, columns, selection)
    decimal = columns.decimal or _decimal(header, sample, delimiter, selection)
    row, more = len(header.lines) + 1, len(header.first) > len(selection.used) or columns.runs == ALL_COLUMNS
    unstated = delimiter == "," != columns.delimiter and not header.names and decimal == "."
    if unstated and more and content.find(b".", header.start) < 0:  # "0,5,12,3" may be four numbers or two
        message = "the commas may separate columns or be decimal signs; state delimiter in the column map"
        raise RecordingError(message, row=row)
    lines = {f"header {at}": line for at, line in enumerate(header.lines, 1) if line.strip() and at != header.names_row}
    width, optional = len(header.first), _optional(header.names)
    if optional and max(selection.used) < len(header.names) - optional:
        width = len(header.names) - optional
    else:
        optional = 0
    further = [cells_of(line, delimiter)[width:] for line in sample] if optional else []
    if 2 * sum(any(map(is_number, cells)) for cells in further) > len(further):
        found = f"found numbers in the column {header.names[width]!r}, expected remarks"
        remedy = (
            "is a name missing before, or a comma a decimal sign? correct the names, or state decimal and delimiter"
        )
        raise RecordingError(f"{found}; {remedy}", row=row, column=header.names[width])
    return Layout(columns, selection, delimiter, decimal, width, optional, header.start, row, header.names, lines)


def _refuse_other_units(header: Header, columns: ColumnMap, selection: Selection) -> None:
    """Refuse units of the header, or beside the numbers, that are not those of the column map."""
    used = set(selection.used)
    beside = tuple("" if at in used or is_number(cell) else cell for at, cell in enumerate(header.first))[1:]  # "5;kN"
    for texts in (header.names, *header.units, beside):
        for column in (column for column in selection.numbers if column < len(texts)):
            is_time, cell = column == selection.time, texts[column]
            stated = columns.time_unit if is_time else columns.force_unit
            # above a force a line of units has nothing else; above the time it may say what the line is
            nothing_else = texts in header.units and not is_time
            text = f"[{cell.strip('[](){}<>')}]" if nothing_else else cell
            alone = not (nothing_else or texts is header.names)
            refuse_other_unit(cell or f"{column + 1}", stated, text, alone=alone)
    for row, line in enumerate(header.lines, 1):
        read: list[Unit] = [columns.force_unit]
        read += [] if selection.time is None else [columns.time_unit]
        for unit in read if row != header.names_row else []:
            remarked = remarked_units(line, of_time=isinstance(unit, TimeUnit))
            if remarked and unit not in remarked and unit is not ForceUnit.COUNTS:
                refuse_other_unit(f"header {row}", unit, f"[{remarked[0]}]")


def _sample(content: bytes) -> list[str]:
    """Some whole lines that are likely to hold numbers."""
    head = content[:_SAMPLE]
    if len(content) > _SAMPLE:
        longest = content[: _SAMPLE + LONGEST_LINE] if b"\n" not in head else head
        head = longest[: longest.rfind(b"\n") + 1]
    raw = head.rstrip().rsplit(b"\n", _SAMPLE_LINES)
    return [text_of(line) for line in (raw[1:] if len(raw) > _SAMPLE_LINES else raw)]


def _decimal(header: Header, sample: Sequence[str], delimiter: str, selection: Selection) -> str:
    """The sign in the first numbers that are read; if they are whole, a comma if there is one further down.

    Between commas a number with one is in quotes.
    """
    for cells in (header.first, *(cells_of(line, delimiter) for line in sample)):
        read = [cells[at] for at in selection.numbers if at < len(cells) and is_number(cells[at])]
        for sign in ".,":
            if any(sign in cell for cell in read):
                return sign
    return "."


def _optional(names: Sequence[str]) -> int:
    """How many of the last columns rows may leave out: comments, and what oscilloscopes say once beside the names."""
    return sum(1 for _ in itertools.takewhile(lambda name: name.casefold() in _OPTIONAL, reversed(names)))


@dataclass(frozen=True)
class Header:
    """The lines before the numbers: `names` (in row `names_row`, counted from 1) are empty where the file has none;
    `units` are the lines that hold units; `start` is the byte at which the numbers begin, `first` the cells of their
    first line.
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
        found = _with_names(line[1], delimiter, wanted) if wanted and in_header else None
        if found is not None:
            names_at, names = len(table) - 1, found
            table[-1] = found
        elif stated is not None:
            if not in_header:
                break
        elif (names_at is not None or not wanted) and not COMMENT.match(line[1]):
            selection = _selection(table[-1], columns, names)
            if selection and all(is_number(table[-1][at]) for at in selection.numbers):
                break
    else:
        raise _no_numbers(table, columns, wanted, names_at)
    if wanted and names_at is None:
        raise _no_numbers(table, columns, wanted, names_at)
    before, first = table[:-1], table[-1]
    selection = select(columns, names, len(first))
    unit_lines = [at for at in range(len(before)) if at != names_at and _holds_units(before, at, names_at, selection)]
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
        units=tuple(tuple(before[at]) for at in unit_lines if at != names_at),
        first=tuple(first),
        start=read[-1][0],
    )


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
        if sum(map(is_number, cells)) >= min(len(cells), 2):
            break
        table.append(cells)
        filled = [cell for cell in cells if cell]
        times = [(name, unit) for name in filled if isinstance(unit := plain_unit(name, TimeUnit), TimeUnit)]
        forces = [(name, unit) for name in filled if isinstance(unit := plain_unit(name, ForceUnit), ForceUnit)]
        if len(filled) == 2 and len(times) == len(forces) == 1:
            ((time, time_unit),), ((force, force_unit),) = times, forces
            return ColumnMap(time=time, time_unit=time_unit, force=force, force_unit=force_unit)
    names = [[cell for cell in cells if cell and stated_unit(cell, alone=True) is None] for cells in table]
    at = max(range(len(names)), key=lambda row: (len(names[row]), row), default=0)
    there = (
        f"found the columns {listed([cell for cell in table[at] if cell])}" if table else "found no names of columns"
    )
    expected = "expected one time and one force with their units, such as time_s and force_N"
    remedy = "else state the columns and their units in a column map ([recordings] in campaign.toml, or --column)"
    raise RecordingError(f"{there}, {expected}; {remedy}", row=at + 1 if table else None)


def _selection(cells: Sequence[str], columns: ColumnMap, names: Sequence[str]) -> Selection | None:
    """The columns that are read, if the line is long enough to have them."""
    try:
        return select(columns, names, len(cells))
    except RecordingError:
        return None


def _holds_units(before: Sequence[Sequence[str]], at: int, names_at: int | None, selection: Selection) -> bool:
    """True for a line of the header with a known unit above every force; or one of time and anything above the forces,
    in brackets or below names: there it can be nothing but a unit.
    """
    cells = before[at]
    forces = [cells[column] if column < len(cells) else "" for group in selection.forces for column in group]
    if all(stated_unit(force, alone=True) is not None for force in forces):
        return True
    time = cells[selection.time] if selection.time is not None and selection.time < len(cells) else ""
    of_time = isinstance(stated_unit(time, alone=True), TimeUnit)
    above = before[at - 1] if at else ()
    below_names = _filled(above) == _filled(cells) if names_at is None else at > names_at
    return of_time and all(force and (below_names or in_brackets(force)) for force in forces)


def _line_of_names(
    before: list[list[str]],
    read: Sequence[tuple[int, str]],
    unit_lines: Sequence[int],
    delimiter: str,
    first: Sequence[str],
    columns: ColumnMap,
) -> int | None:
    """The last line of the header but for units, if it has a cell for each column: names that nobody asked for."""
    last = next((at for at in reversed(range(len(before))) if any(before[at]) and at not in unit_lines), None)
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
    """True if there are as many names as cells, but for empty ones at the end, and a comment that may be missing."""
    names = _without_empty_end(names)
    return _filled(first) <= len(names) <= len(first) + _optional(names)


def _filled(cells: Sequence[str]) -> int:
    return next((at + 1 for at in reversed(range(len(cells))) if cells[at]), 0)


def _without_empty_end(cells: Sequence[str]) -> Sequence[str]:
    return cells[: _filled(cells)]


def _other_width(names: Sequence[str], first: Sequence[str], row: int) -> RecordingError:
    found = f"found {_filled(first)} cells below {_filled(names)} names of columns, expected as many"
    remedy = "state header_lines in the column map if the names end above"
    otherwise = "or delimiter and decimal if one is taken for the other"
    return RecordingError(f"{found}; {remedy}, {otherwise}", row=row)


def _refuse_damaged(
    before: Sequence[Sequence[str]], selection: Selection, names_at: int | None, unit_lines: Sequence[int]
) -> None:
    """Refuse a line below the names, or without names the last one but for units, that may be a damaged measurement."""
    texts = [at for at, cells in enumerate(before) if any(cells) and at not in unit_lines]
    for row in texts[-1:] if names_at is None else [at for at in texts if at > names_at]:
        cells = {at: before[row][at] if at < len(before[row]) else "" for at in selection.numbers}
        time = None if selection.time is None else cells[selection.time]
        if may_be_measured(time, [cells[at] for group in selection.forces for at in group]):
            wrong = next((at for at, cell in cells.items() if not is_number(cell)), 0)
            found = f"found {cells.get(wrong, '')!r} before the first line of numbers, expected a number"
            raise RecordingError(f"{found}; {_REMEDY}", row=row + 1, column=f"{wrong + 1}")


def _no_numbers(
    table: Sequence[list[str]], columns: ColumnMap, wanted: list[str], names_at: int | None
) -> RecordingError:
    """Why no header and no numbers were found."""
    if names_at is not None:
        found = next((cells for cells in table[names_at + 1 :] if any(map(clock_remedy, cells))), [])
        remedy = next(filter(None, map(clock_remedy, found)), "")
        message = "no line of numbers follows the names of the columns"
        return RecordingError(f"{message}; {remedy}" if remedy else message, row=names_at + 1)
    if not wanted:
        numbers = [column for column in columns.number_columns if isinstance(column, int)]
        if numbers and (widest := max(map(len, table), default=0)) < max(numbers):
            return _too_narrow(widest, max(numbers))
        return RecordingError(f"found no line with numbers in all columns read among the first {len(table)} lines")

    def likeness(names: Names) -> int:
        return sum(names.position(column) is not None for column in wanted)

    best = max(table, key=lambda cells: likeness(Names(cells)), default=[])
    if not likeness(Names(best)):
        # the line above the first numbers is what a person would call the names
        at = next((at for at, cells in enumerate(table) if all(is_number(cell) for cell in cells)), 0)
        best = table[at - 1] if at else []
    there = Names(best)
    if not (missing := [column for column in wanted if there.position(column) is None]):
        return RecordingError("the names of the columns stand below header_lines; correct header_lines")
    return RecordingError(missing_column(missing[0], best), column=missing[0])


def _too_narrow(width: int, column: str | int) -> RecordingError:
    found = f"found {width} column{'s' if width != 1 else ''}, expected a column {column}"
    return RecordingError(f"{found}; is the delimiter right?", column=str(column))


@dataclass(frozen=True)
class Selection:
    """Positions of the columns that are read, counted from 0; a curve has one force column or three."""

    time: int | None
    forces: tuple[tuple[int, ...], ...]
    curve: int | None

    @cached_property
    def numbers(self) -> tuple[int, ...]:
        """The columns that must hold numbers, the time first."""
        return (*([] if self.time is None else [self.time]), *(one for group in self.forces for one in group))

    @cached_property
    def used(self) -> tuple[int, ...]:
        """All columns that are read."""
        return (*self.numbers, *([] if self.curve is None else [self.curve]))


def select(columns: ColumnMap, names: Sequence[str], width: int) -> Selection:
    """The columns of a file with these names and this many columns.

    Raises
    ------
    RecordingError
        A column that is not there, or not once.
    """
    there = Names(names)

    def at(column: str | int) -> int:
        if (found := there.position(column)) is None:
            raise RecordingError(missing_column(str(column), names), column=str(column))
        if found >= width:
            raise _too_narrow(width, column)
        return found

    time = None if columns.time is None else at(columns.time)
    forces = [tuple(map(at, group)) for group in columns.groups]
    if not (forces := forces or [(column,) for column in range(width) if column != time]):
        raise RecordingError("found no column beside the time, expected a force; is the delimiter right?")
    selection = Selection(time, tuple(forces), None if columns.curve is None else at(columns.curve))
    if len(set(selection.used)) < len(selection.used):
        twice = Counter(selection.used).most_common(1)[0][0]
        message = "found a column that is named and numbered, expected each once"
        raise RecordingError(message, column=str(twice + 1))
    return selection


def first_lines(content: bytes) -> Iterator[tuple[int, str]]:
    """(byte at which it begins, text) of the lines that may hold the header; names in quotes that go over several lines
    stand in the first of them, and the others are empty.

    Raises
    ------
    RecordingError
        A line longer than any table's.
    """
    begun: list[tuple[int, str]] = []
    for line in _lines(content):
        begun.append(line)
        if open_quotes := sum(text.count('"') for _, text in begun) % 2:
            if len(begun) < _MOST_LINES_OF_NAMES:
                continue
        elif len(begun) > 1:
            begun = [(begun[0][0], " ".join(text for _, text in begun)), *((start, "") for start, _ in begun[1:])]
        yield from begun[:1] if open_quotes else begun
        begun = begun[1:] if open_quotes else []
    yield from begun


def _lines(content: bytes) -> Iterator[tuple[int, str]]:
    """(byte at which it begins, text) of the first lines.

    Raises
    ------
    RecordingError
        A line longer than any table's.
    """
    start = 0
    for row in itertools.islice(itertools.count(1), _MOST_HEADER_LINES):
        end = content.find(b"\n", start, start + LONGEST_LINE)
        if end < 0 and start + LONGEST_LINE < len(content):
            raise RecordingError(f"found over {LONGEST_LINE} characters without a line end, expected lines", row=row)
        stop = len(content) if end < 0 else end
        yield start, text_of(content[start:stop]).removesuffix("\r")
        if end < 0 or (start := end + 1) > _LONGEST_HEADER:
            return
