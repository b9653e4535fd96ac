"""How a delimited file is laid out: its delimiter and decimal sign, its header, and which columns are read."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from forcemap.errors import RecordingError
from forcemap.recordings.cells import cells_of, find_delimiter, is_number
from forcemap.recordings.column_map import ALL_COLUMNS, ColumnMap
from forcemap.recordings.header import Header, find_header, optional_columns, plain_columns
from forcemap.recordings.recording import LEAST_SAMPLES
from forcemap.recordings.sampling import LONGEST_INTERVAL, refuse_other_unit
from forcemap.recordings.selection import Selection, select
from forcemap.recordings.text import LONGEST_LINE, first_lines, text_of
from forcemap.recordings.units import ForceUnit, TimeUnit, Unit, remarked_units, stated_unit

_SAMPLE, _SAMPLE_LINES = 1 << 16, 20  # bytes, from whose last lines the delimiter is found; a choice
_NUMBER = (
    r"[^\w.,+-]{0,20}(?P<named>[^\W\d]{0,20})[^\w.,+-]{0,20}(?P<number>[\d.,]{1,20}(?:e[+-]?\d{1,3})?)"
    r"\s{0,5}[(\[]?(?P<unit>[^\W\d]{0,20})"
)
_RATE_THERE = re.compile(
    r"(?:sampl\w{0,5}[\s_-]{0,5}(?:rate|freq\w{0,8})|scan[\s_-]{0,5}rate|abtast(?:rate|frequenz))" + _NUMBER, re.I
)
_INTERVAL_THERE = re.compile(
    r"(?:delta[\s_-]?x|sampl\w{0,5}[\s_-]{0,5}(?:interval|period)|abtast(?:intervall|zeit))" + _NUMBER, re.I
)
_HERTZ = {"khz": 1e3, "ks": 1e3, "mhz": 1e6}
_SECONDS = {"ms": 1e-3, "us": 1e-6, "µs": 1e-6}
_RATE = 0.1  # share by which a sampling rate may differ from the times beside it, rounding apart; a choice


@dataclass(frozen=True)
class Layout:
    """The layout of a delimited file; its numbers begin at the byte `start`, in row `row` (counted from 1).

    A row has `width` cells, or up to `optional` more: a comment, which may be missing. `unit_stated` if it says that of
    the force.
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
    unit_stated: bool

    def name(self, column: int) -> str:
        """The name of a column, else its number counted from 1."""
        return (self.names[column] if column < len(self.names) else "") or f"{column + 1}"

    @cached_property
    def place_of(self) -> dict[int, int]:
        """Position of every column among those that are read."""
        return {column: index for index, column in enumerate(self.selection.numbers)}


def find_layout(content: bytes, columns: ColumnMap | None, *, untimed: bool = False) -> Layout:
    """The layout of a delimited file; without a column map its header must leave no doubt.

    Parameters
    ----------
    content : bytes
        The lines of the file.
    columns : ColumnMap or None
        How the device writes its files.
    untimed : bool
        True of positions without times, whose sampling rate nobody stated.

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
    unit_stated = _refuse_other_units(header, columns, selection)
    decimal = columns.decimal or _decimal(header, sample, delimiter, selection)
    if columns.time is None:
        if not untimed:
            _refuse_rate_of_header(header, columns.sampling_rate)
        rate = math.nan if untimed else columns.sampling_rate
        _refuse_other_rate(header, rate, [cells_of(line, delimiter) for line in sample], decimal)
    row, more = len(header.lines) + 1, len(header.first) > len(selection.used) or columns.runs == ALL_COLUMNS
    unstated = delimiter == "," != columns.delimiter and not header.names and decimal == "."
    if unstated and more and content.find(b".", header.start) < 0:  # "0,5,12,3" may be four numbers or two
        message = "the commas may separate columns or be decimal signs; state delimiter in the column map"
        raise RecordingError(message, row=row)
    numbered = ((number, line) for number, line in enumerate(header.lines, 1) if line.strip())
    lines = {f"header {number}": line for number, line in numbered if number != header.names_row}
    width, optional = len(header.first), optional_columns(header.names)
    if optional and max(selection.used) < len(header.names) - optional:
        width = len(header.names) - optional
    else:
        optional = 0
    further = [cells_of(line, delimiter)[width:] for line in sample] if optional else []
    if 2 * sum(any(map(is_number, cells)) for cells in further) > len(further):
        problem = f"found numbers in the column {header.names[width]!r}, expected remarks"
        remedy = (
            "is a name missing before, or a comma a decimal sign? correct the names, or state decimal and delimiter"
        )
        raise RecordingError(f"{problem}; {remedy}", row=row, column=header.names[width])
    at = header.start, row, header.names, lines
    return Layout(columns, selection, delimiter, decimal, width, optional, *at, unit_stated)


def _refuse_rate_of_header(header: Header, rate: float) -> None:
    """Refuse a sampling rate [Hz] that is not the one in a line above the columns, or one over its interval."""
    for row, line in enumerate(header.lines, 1):
        for pattern, of in ((_RATE_THERE, _HERTZ), (_INTERVAL_THERE, _SECONDS)):
            if row == header.names_row or not (found := pattern.search(line)):
                continue
            number, unit = found["number"], of.get((found["unit"] or found["named"]).lower(), 1.0)
            read = [float(text) * unit for sign in (".", "") if is_number(text := number.replace(",", sign))]
            rates = [each if of is _HERTZ else 1 / each for each in read if each > 0]
            rates = [each for each in rates if each > 1 / LONGEST_INTERVAL]  # LabVIEW's 1 s stands for none
            if rates and not any(abs(each - rate) <= _RATE * rate for each in rates):
                problem = f"the file says {found[0].strip()!r}, the column map sampling_rate_Hz = {rate:g}"
                raise RecordingError(f"{problem}; correct the one that is wrong", row=row)


def _refuse_other_rate(header: Header, rate: float, sample: Sequence[Sequence[str]], decimal: str) -> None:
    """Refuse a sampling rate [Hz] that a column of times, which is not read, contradicts by more than its rounding; NaN
    is of positions without times, beside which there is to be no such column."""
    for column, name in enumerate(header.names):
        unit = stated_unit(name, of_time=True)
        cells = [row[column] for row in sample if column < len(row) and is_number(row[column])]
        if not isinstance(unit, TimeUnit) or len(cells) < LEAST_SAMPLES:
            continue
        times = [float(cell.replace(decimal, ".")) / unit.per_second for cell in cells]
        rounded = 10.0 ** -len(cells[-1].partition(decimal)[2]) / unit.per_second
        lasts, expected = times[-1] - times[0], (len(times) - 1) / rate
        if times != sorted(times) or lasts <= 0:
            continue
        if math.isnan(rate):
            expected_there = "expected it to be stated (time and time_unit), or taken out"
            raise RecordingError(f"found a column of times, {expected_there}", column=name)
        if abs(lasts - expected) > _RATE * expected + 2 * rounded:
            apart = lasts / (len(times) - 1)
            problem = f"found rows {apart:.4g} s apart by this column, sampling_rate_Hz = {rate:g} has {1 / rate:.4g} s"
            raise RecordingError(f"{problem}; state the column as time, or the rate that it has", column=name)


def _refuse_other_units(header: Header, columns: ColumnMap, selection: Selection) -> bool:
    """Refuse units of the header, or beside the numbers, that are not those of the column map; False if none states
    that of the force."""
    stated_there = columns.force_unit is ForceUnit.COUNTS
    used = set(selection.used)
    beside = tuple("" if column in used or is_number(cell) else cell for column, cell in enumerate(header.first))[
        1:
    ]  # "5;kN"
    for texts in (header.names, *header.units, beside):
        for column in (column for column in selection.numbers if column < len(texts)):
            is_time, cell = column == selection.time, texts[column]
            stated = columns.time_unit if is_time else columns.force_unit
            # above a force a line of units has nothing else; above the time it may say what the line is
            nothing_else = texts in header.units and not is_time
            text = f"[{cell.strip('[](){}<>')}]" if nothing_else else cell
            alone = not (nothing_else or texts is header.names)
            stated_there |= refuse_other_unit(cell or f"{column + 1}", stated, text, alone=alone) and not is_time
    for row, line in enumerate(header.lines, 1):
        read: list[Unit] = [columns.force_unit]
        read += [] if selection.time is None else [columns.time_unit]
        for unit in read if row != header.names_row else []:
            remarked = remarked_units(line, of_time=isinstance(unit, TimeUnit))
            if remarked and unit not in remarked and unit is not ForceUnit.COUNTS:
                refuse_other_unit(f"header {row}", unit, f"[{remarked[0]}]")
            stated_there |= bool(remarked) and isinstance(unit, ForceUnit)
    return stated_there


def _sample(content: bytes) -> list[str]:
    """Some whole lines that probably hold numbers."""
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
        read = [cells[column] for column in selection.numbers if column < len(cells) and is_number(cells[column])]
        for sign in ".,":
            if any(sign in cell for cell in read):
                return sign
    return "."
