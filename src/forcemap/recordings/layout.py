"""How a delimited file is laid out: its header, delimiter and decimal sign, and which columns are read."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from forcemap.errors import RecordingError
from forcemap.recordings import units
from forcemap.recordings.column_map import ALL_COLUMNS, DELIMITERS, ColumnMap, listed, missing_column, position
from forcemap.recordings.sampling import refuse_other_unit

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
    for texts in (header.names, header.units):
        for column in selection.numbers:
            if column < len(texts):
                stated = columns.time_unit if column == selection.time else columns.force_unit
                refuse_other_unit(texts[column], stated, texts[column])
    decimal = columns.decimal or _decimal(header, sample, delimiter, selection)
    row, more = len(header.lines) + 1, len(header.first) > len(selection.used) or columns.runs == ALL_COLUMNS
    unstated = delimiter == "," != columns.delimiter and not header.names
    if unstated and more and content.find(b".", header.start) < 0:  # "0,5,12,3" may be four numbers or two
        message = "the commas may separate columns or be decimal signs; state delimiter in the column map"
        raise RecordingError(message, row=row)
    lines = {f"header {at}": line for at, line in enumerate(header.lines, 1) if line.strip() and at != header.names_row}
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
    stated = columns.header_lines
    read: list[tuple[int, str]] = []
    table: list[list[str]] = []
    names_at: int | None = None
    names: Sequence[str] = ()
    for line in lines:
        read.append(line)
        cells = cells_of(line[1], delimiter)
        table.append(cells)
        in_header = stated is None or len(table) <= stated
        if wanted and in_header and all(position(column, cells) is not None for column in wanted):
            names_at, names = len(table) - 1, cells
        elif stated is not None:
            if not in_header:
                break
        elif names_at is not None or not wanted:
            selection = _selection(cells, columns, names)
            if selection and all(is_number(cells[at]) for at in selection.numbers):
                break
    else:
        raise _no_numbers(table, columns, wanted, names_at)
    if wanted and names_at is None:
        raise _no_numbers(table, columns, wanted, names_at)
    before, first = table[:-1], table[-1]
    units_at = _line_of_units(before, columns, names_at)
    above = before[:units_at]
    if stated is None:
        _refuse_damaged(above, columns, names_at)
    if names_at is None:
        names_at = _line_of_names(above, first, columns)
    elif not _fits(names, first):
        raise _other_width(names, first, len(table))
    texts = tuple(text for _, text in read[:-1])
    names_there, units_there = (() if at is None else tuple(before[at]) for at in (names_at, units_at))
    names_row = None if names_at is None else names_at + 1
    return Header(texts, names_row, names_there, units_there, tuple(first), read[-1][0])


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
        times, forces = list(filter(units.names_plain_time, names)), list(filter(units.names_plain_force, names))
        if len(names) == 2 and len(times) == len(forces) == 1:
            return ColumnMap(
                time=times[0],
                time_unit=units.time_unit_in(times[0]) or units.TimeUnit.SECONDS,
                force=forces[0],
                force_unit=units.force_unit_in(forces[0]) or units.ForceUnit.NEWTONS,
            )
    last = [cell for cell in table[-1] if cell] if table else []
    there = f"found the columns {listed(last)}" if last else "found no names of columns"
    expected = "expected one time and one force with their units, such as time_s and force_N"
    remedy = "else state the columns and their units in a column map ([recordings] in campaign.toml, or --column)"
    raise RecordingError(f"{there}, {expected}; {remedy}", row=len(table) or None)


def _selection(cells: Sequence[str], columns: ColumnMap, names: Sequence[str]) -> Selection | None:
    """The columns that are read, if the line is long enough to have them."""
    try:
        return select(columns, names, len(cells))
    except RecordingError:
        return None


def _line_of_units(before: Sequence[Sequence[str]], columns: ColumnMap, names_at: int | None) -> int | None:
    """The last line of the header, if it holds units in all columns that are read."""
    last = _last_filled(before)
    if last is None or last == names_at:
        return None
    cells = before[last]
    selection = _selection(cells, columns, () if names_at is None else before[names_at])
    if selection is None or (selection.time is not None and units.time_unit_in(cells[selection.time]) is None):
        return None
    forces = [cells[at] for at in selection.numbers if at != selection.time]
    good = all(units.force_unit_in(unit) or unit.casefold().strip("[]()") in _COUNT_UNITS for unit in forces)
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
    found = f"found {_filled(first)} cells below {_filled(names)} names of columns, expected as many"
    remedy = "state header_lines in the column map if the names end above"
    otherwise = "or delimiter and decimal if one is taken for the other"
    return RecordingError(f"{found}; {remedy}, {otherwise}", row=row)


def _last_filled(lines: Sequence[Sequence[str]]) -> int | None:
    return next((at for at in reversed(range(len(lines))) if any(lines[at])), None)


def _refuse_damaged(above: Sequence[Sequence[str]], columns: ColumnMap, names_at: int | None) -> None:
    """Refuse a line between names and numbers, or without names a last line that is partly numbers: nothing measured is
    taken for a header.
    """
    if (last := _last_filled(above)) is None:
        return
    for row in [last] if names_at is None else [at for at in range(names_at + 1, last + 1) if any(above[at])]:
        cells = above[row]
        if names_at is None:
            numbered = [column - 1 for column in columns.number_columns if isinstance(column, int)]
            read = numbered if columns.runs != ALL_COLUMNS else range(len(cells))
            wrong = [at for at in read if at < len(cells) and _LIKE_A_NUMBER.match(cells[at])]
        else:
            selection = _selection(cells, columns, above[names_at])
            wrong = [at for at in selection.numbers if not is_number(cells[at])] if selection else []
            wrong = wrong or [0]
        if wrong:
            found = f"found {cells[wrong[0]]!r} before the first line of numbers, expected a number"
            raise RecordingError(f"{found}; {_REMEDY}", row=row + 1, column=f"{wrong[0] + 1}")


def _no_numbers(
    table: Sequence[Sequence[str]], columns: ColumnMap, wanted: list[str], names_at: int | None
) -> RecordingError:
    """Why no header and no numbers were found."""
    if names_at is not None:
        return RecordingError("no line of numbers follows the names of the columns", row=names_at + 1)
    if not wanted:
        numbers = [column for column in columns.number_columns if isinstance(column, int)]
        if numbers and (widest := max(map(len, table), default=0)) < max(numbers):
            return _too_narrow(widest, max(numbers))
        return RecordingError(f"found no line with numbers in all columns read among the first {len(table)} lines")

    def likeness(cells: Sequence[str]) -> int:
        return sum(position(column, cells) is not None for column in wanted)

    best = max(table, key=likeness, default=())
    if not likeness(best):
        # the line above the first numbers is what a person would call the names
        at = next((at for at, cells in enumerate(table) if all(is_number(cell) for cell in cells)), 0)
        best = table[at - 1] if at else ()
    if not (missing := [column for column in wanted if position(column, best) is None]):
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

    @property
    def numbers(self) -> tuple[int, ...]:
        """The columns that must hold numbers, the time first."""
        return (*([] if self.time is None else [self.time]), *(one for group in self.forces for one in group))

    @property
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

    def at(column: str | int) -> int:
        if (found := position(column, names)) is None:
            raise RecordingError(missing_column(str(column), names), column=str(column))
        if found >= width:
            raise _too_narrow(width, column)
        return found

    time = None if columns.time is None else at(columns.time)
    forces = [tuple(map(at, group)) for group in columns.groups]
    if not (forces := forces or [(column,) for column in range(width) if column != time]):
        raise RecordingError("found no column beside the time, expected a force; is the delimiter right?")
    selection = Selection(time, tuple(forces), None if columns.curve is None else at(columns.curve))
    for column in selection.used:
        if selection.used.count(column) > 1:
            message = "found a column that is named and numbered, expected each once"
            raise RecordingError(message, column=str(column + 1))
    return selection


LONGEST_LINE = 1 << 16

# ASCII digits only: other scripts' digits, thousands separators and a text such as "nan" are no numbers
NUMBERS = {
    signs: re.compile(rf"[+-]?([0-9]+[{signs}]?[0-9]*|[{signs}][0-9]+)([eE][+-]?[0-9]+)?") for signs in (".", ",", ".,")
}
# what stands in place of a number: one that is damaged, none, or "nan"
_LIKE_A_NUMBER = re.compile(r"$|[+-]?[.,]?[0-9]|[+-]?(nan|inf)", re.IGNORECASE)
_MOST_HEADER_LINES = 200


def text_of(raw: bytes) -> str:
    """The text in UTF-8, else in Latin-1: units such as µs and °, which are never part of a number."""
    try:
        return raw.decode()
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def cells_of(line: str, delimiter: str) -> list[str]:
    """The cells of a line, without blanks and quotation marks around them."""
    return [cell.strip().strip('"').strip() for cell in split_cells(line, delimiter)]


def split_cells(line: str, delimiter: str) -> list[str]:
    """The cells of a line as they stand there; one without a delimiter."""
    return line.split(delimiter) if delimiter else [line]


def is_number(cell: str) -> bool:
    """True for a number with either decimal sign."""
    return NUMBERS[".,"].fullmatch(cell) is not None


def first_lines(content: bytes, start: int) -> Iterator[tuple[int, str]]:
    """(byte at which it begins, text) of the lines that may hold the header.

    Raises
    ------
    RecordingError
        A line longer than any table's.
    """
    for row in itertools.islice(itertools.count(1), _MOST_HEADER_LINES):
        end = content.find(b"\n", start, start + LONGEST_LINE)
        if end < 0 and start + LONGEST_LINE < len(content):
            raise RecordingError(f"found over {LONGEST_LINE} characters without a line end, expected lines", row=row)
        stop = len(content) if end < 0 else end
        yield start, text_of(content[start:stop]).removesuffix("\r")
        if end < 0:
            return
        start = end + 1
