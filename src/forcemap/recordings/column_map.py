"""How a device writes its files: which columns hold what, in which units."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, TypeVar

from forcemap.errors import InputError, nearest_names
from forcemap.recordings.units import ForceUnit, TimeUnit

ALL_COLUMNS = "all"
DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "blank": " "}

_LOWEST_RATE, _HIGHEST_RATE = 1.0, 1e7  # [Hz]; choices: from a slow log to the fastest oscilloscope
_LONGEST_SHOWN, _MOST_SHOWN = 40, 20  # characters of a text, names in a message: no more than a person reads
_Unit = TypeVar("_Unit", TimeUnit, ForceUnit)


@dataclass(frozen=True, kw_only=True)
class ColumnMap:
    """How a device writes its files; a column is a name or a number counted from 1, other columns are left alone.

    Parameters
    ----------
    time : str or int, optional
        Column of the time.
    sampling_rate : float
        Samples per second [Hz], in place of a time column.
    force : str or int, or a tuple of three, optional
        Column of the force, or of its three components.
    runs : tuple of str or int, or "all"
        Wide files: one column of force for each run; "all" is every column but the time.
    curve : str or int, optional
        Long files: the column that names the curve a row belongs to.
    time_unit : TimeUnit
        Unit of the time column.
    force_unit : ForceUnit
        Unit of the force columns.
    newtons_per_count, zero_count : float
        Force = (count - zero_count) * newtons_per_count [N], for the unit counts.
    direction : tuple of 3 floats, optional
        Direction onto which three components are projected; None is their norm.
    sign : int
        -1 if the device writes pressing forces negative, else 1.
    delimiter, decimal : str
        What separates columns (",", ";", a tab, or " " for any blanks) and the decimal sign ("." or ","); "" to find it
        from the file.
    header_lines : int, optional
        Number of lines before the numbers; None to find it from the file.

    Raises
    ------
    InputError
        A value that is not of its kind, or two that contradict each other; `column` names the entry.
    """

    time: str | int | None = None
    sampling_rate: float = math.nan
    force: str | int | tuple[str | int, str | int, str | int] | None = None
    runs: tuple[str | int, ...] | str = ()
    curve: str | int | None = None
    time_unit: TimeUnit = TimeUnit.SECONDS
    force_unit: ForceUnit = ForceUnit.NEWTONS
    newtons_per_count: float = math.nan
    zero_count: float = 0.0
    direction: tuple[float, float, float] | None = None
    sign: int = 1
    delimiter: str = ""
    decimal: str = ""
    header_lines: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_unit", _unit("time_unit", self.time_unit, TimeUnit))
        object.__setattr__(self, "force_unit", _unit("force_unit", self.force_unit, ForceUnit))
        self._refuse_wrong_values()
        self._refuse_contradictions()

    @property
    def groups(self) -> tuple[tuple[str | int, ...], ...]:
        """The force columns of every curve, one or three, as far as they are named one by one."""
        if self.force is not None:
            return (self.force if isinstance(self.force, tuple) else (self.force,),)
        return () if isinstance(self.runs, str) else tuple((run,) for run in self.runs)

    @property
    def number_columns(self) -> tuple[str | int, ...]:
        """The columns that must hold numbers, the time first, as far as they are named one by one."""
        return (*([] if self.time is None else [self.time]), *itertools.chain(*self.groups))

    @property
    def columns(self) -> tuple[str | int, ...]:
        """All columns that are read, as far as they are named one by one."""
        return (*self.number_columns, *([] if self.curve is None else [self.curve]))

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> ColumnMap:
        """The column map stated in a table of campaign.toml.

        Raises
        ------
        InputError
            An unknown entry, or a value that cannot be used; `column` names the entry.
        """
        entries: dict[str, Any] = {}
        for key, value in table.items():
            if key not in KEYS:
                near = ", ".join(nearest_names(str(key), KEYS, 3))
                raise InputError(f"unknown entry; the nearest known ones are {near}", column=str(key))
            entries[KEYS[key]] = tuple(value) if isinstance(value, list) else value
        if entries.get("delimiter") in DELIMITERS:
            entries["delimiter"] = DELIMITERS[entries["delimiter"]]
        return cls(**entries)

    def to_table(self) -> dict[str, Any]:
        """The entries that are not at their default, as `from_table` reads them."""
        words = {character: word for word, character in DELIMITERS.items()}
        table: dict[str, Any] = {}
        for key, name in KEYS.items():
            value = getattr(self, name)
            if value != getattr(ColumnMap, name) and value == value:  # NaN is not stated
                value = words[value] if name == "delimiter" else getattr(value, "value", value)
                table[key] = list(value) if isinstance(value, tuple) else value
        return table

    def _refuse_wrong_values(self) -> None:
        for name, accepted, expected in _ACCEPTED:
            value = getattr(self, KEYS[name])
            try:
                good = accepted(value)
            except TypeError:  # a list or a table where a text belongs
                good = False
            if not good:
                raise InputError(f"found {value!r}, expected {expected}", column=name)

    def _refuse_contradictions(self) -> None:
        counts = self.force_unit is ForceUnit.COUNTS
        runs = self.runs != ()
        timed, vector = self.time is not None, isinstance(self.force, tuple)
        for entry, wrong, message in (
            ("force", self.force is None and not runs, "found neither force nor runs, expected one of them"),
            ("runs", self.force is not None and runs, "found force and runs, expected one of them"),
            ("sampling_rate_Hz", timed and not math.isnan(self.sampling_rate), "found also time, expected one of them"),
            ("time_unit", not timed and self.time_unit is not TimeUnit.SECONDS, "found no time column; leave it out"),
            ("curve", self.curve is not None and runs, "found also runs, expected one of them: a file is long or wide"),
            ("newtons_per_count", counts and math.isnan(self.newtons_per_count), "expected with force_unit counts"),
            ("newtons_per_count", not (counts or math.isnan(self.newtons_per_count)), "needs force_unit counts"),
            ("zero_count", not counts and self.zero_count != 0, "needs force_unit counts"),
            ("direction", self.direction is not None and not vector, "needs three columns of force"),
            ("decimal", self.delimiter == self.decimal == ",", "found the delimiter as decimal sign; state another"),
        ):
            if wrong:
                raise InputError(message, column=entry)
        if len(set(self.columns)) < len(self.columns):
            raise InputError("found a column in two places, expected each once", column="time, force, runs, curve")


_UNITS = {"sampling_rate": "sampling_rate_Hz"}
KEYS = {_UNITS.get(attribute.name, attribute.name): attribute.name for attribute in fields(ColumnMap)}
"""Entries of [recordings] in campaign.toml: field."""


def _unit(entry: str, value: Any, kind: type[_Unit]) -> _Unit:
    try:
        return kind(value)
    except ValueError:
        raise InputError(f"found {value!r}, expected one of {', '.join(kind)}", column=entry) from None


def _is_column(value: Any) -> bool:
    if isinstance(value, str):
        return bool(value.strip()) and not re.search("[\n\r\0]", value)
    return type(value) is int and value >= 1


def _may_be_column(value: Any) -> bool:
    return value is None or _is_column(value)


def _are_columns(value: Any) -> bool:
    return isinstance(value, tuple) and all(map(_is_column, value))


def _is_float(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_finite(value: Any) -> bool:
    return _is_float(value) and math.isfinite(value)


_COLUMN = "the name of a column, or its number counted from 1"
_RATE, _VECTOR = f"a number from {_LOWEST_RATE:g} to {_HIGHEST_RATE:g}", "three finite numbers that are not all 0"
_ACCEPTED: tuple[tuple[str, Callable[[Any], bool], str], ...] = (  # entry, what it may be; NaN is not stated
    ("time", _may_be_column, _COLUMN),
    ("curve", _may_be_column, _COLUMN),
    ("force", lambda v: _may_be_column(v) or (_are_columns(v) and len(v) == 3), f"{_COLUMN}, or three of them"),
    ("runs", lambda v: v == ALL_COLUMNS or _are_columns(v), 'a list of names or numbers of columns, or "all"'),
    ("sampling_rate_Hz", lambda v: _is_float(v) and not (v < _LOWEST_RATE or v > _HIGHEST_RATE), _RATE),
    ("newtons_per_count", lambda v: _is_float(v) and not (v <= 0 or v == math.inf), "a finite number above 0"),
    ("zero_count", _is_finite, "a finite number"),
    ("sign", lambda v: type(v) is int and v in (1, -1), "1 or -1"),
    ("header_lines", lambda v: v is None or (type(v) is int and v >= 0), "a count"),
    ("direction", lambda v: v is None or (len(v) == 3 and all(map(_is_finite, v)) and any(v)), _VECTOR),
    ("delimiter", ("", *DELIMITERS.values()).__contains__, '"comma", "semicolon", "tab" or "blank"'),
    ("decimal", ("", ".", ",").__contains__, '"." or ","'),
)


class Names:
    """Names of columns, looked up in time that does not grow with their number.

    Parameters
    ----------
    names : sequence of str
        In the order of the columns; a sign of a comment before them does not count.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._exact: dict[str, list[int]] = {}
        self._folded: dict[str, list[int]] = {}
        for index, name in enumerate(names):
            self._exact.setdefault(name, []).append(index)
            self._folded.setdefault(name.casefold(), []).append(index)

    def position(self, column: str | int) -> int | None:
        """Position of a column: its number less 1, or where its name stands (in any case, if that is unique)."""
        if isinstance(column, int):
            return column - 1
        positions: list[int] = []
        for wanted in (column.strip(), column.strip(" #%")):
            positions = positions or self._exact.get(wanted) or self._folded.get(wanted.casefold(), [])
        return positions[0] if len(positions) == 1 else None


def missing_column(column: str, names: Sequence[str]) -> str:
    """The error message for a column that is not among these names."""
    wanted = column.strip(" #%").casefold()
    times = sum(name.casefold() == wanted for name in names)
    if times > 1:
        return f"found {times} columns of that name, expected one; give its number"
    nameless = "the file has no names of columns; give numbers"
    where = "columns by number fit files that name them otherwise"
    return f"no column is named {shortened(column.strip())}; found {listed(names)}; {where}" if names else nameless


def listed(names: Sequence[str]) -> str:
    """The names for a message, no more than a person reads."""
    return ", ".join(map(shortened, names[:_MOST_SHOWN])) + (", ..." if len(names) > _MOST_SHOWN else "")


def shortened(text: str) -> str:
    """A text of a file for a message, in quotes, its end left out if it is long."""
    return repr(text if len(text) <= _LONGEST_SHOWN else f"{text[: _LONGEST_SHOWN - 3]}...")
