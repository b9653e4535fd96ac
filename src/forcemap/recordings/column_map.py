"""How a device writes its files: which columns hold what, in which units."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from forcemap.errors import InputError, nearest_names
from forcemap.recordings.units import ForceUnit, TimeUnit

ALL_COLUMNS = "all"
DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t"}

_LOWEST_RATE, _HIGHEST_RATE = 1.0, 2e5
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
        What separates columns (",", ";" or a tab) and the decimal sign ("." or ","); "" is found from the file.
    header_lines : int, optional
        Number of lines before the numbers; None is found from the file.

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
        self._refuse_wrong_columns()
        self._refuse_wrong_numbers()
        self._refuse_wrong_texts()
        self._refuse_contradictions()

    @property
    def components(self) -> tuple[str | int, ...]:
        """The force columns of one curve: one, or three."""
        return self.force if isinstance(self.force, tuple) else () if self.force is None else (self.force,)

    @property
    def named_runs(self) -> tuple[str | int, ...]:
        """The columns of the runs, as far as they are named one by one."""
        return () if isinstance(self.runs, str) else self.runs

    @property
    def number_columns(self) -> tuple[str | int, ...]:
        """The columns that must hold numbers, the time first, as far as they are named one by one."""
        return (*([] if self.time is None else [self.time]), *self.components, *self.named_runs)

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
        found: dict[str, Any] = {}
        for key, value in table.items():
            if key not in _KEYS:
                near = ", ".join(nearest_names(str(key), _KEYS, 3))
                raise InputError(f"unknown entry; the nearest known ones are {near}", column=str(key))
            found[_KEYS[key]] = tuple(value) if isinstance(value, list) else value
        if found.get("delimiter") in DELIMITERS:
            found["delimiter"] = DELIMITERS[found["delimiter"]]
        return cls(**found)

    def to_table(self) -> dict[str, Any]:
        """The entries that are not at their default, as `from_table` reads them."""
        words = {character: word for word, character in DELIMITERS.items()}
        table: dict[str, Any] = {}
        for key, name in _KEYS.items():
            value = getattr(self, name)
            if value == getattr(ColumnMap, name) or (isinstance(value, float) and math.isnan(value)):
                continue
            if isinstance(value, TimeUnit | ForceUnit):
                value = value.value
            elif isinstance(value, tuple):
                value = list(value)
            table[key] = words[value] if name == "delimiter" else value
        return table

    def _refuse_wrong_columns(self) -> None:
        for name in ("time", "curve"):
            _refuse(name, getattr(self, name), lambda value: value is None or _is_column(value), _COLUMN)
        _refuse("force", self.force, _is_force, f"{_COLUMN}, or three of them")
        _refuse("runs", self.runs, _is_runs, 'a list of names or numbers of columns, or "all"')

    def _refuse_wrong_numbers(self) -> None:
        rate = f"a number from {_LOWEST_RATE:g} to {_HIGHEST_RATE:g}"
        _refuse("sampling_rate_Hz", self.sampling_rate, lambda v: _is_float(v) and not _outside(v), rate)
        per_count = "a finite number above 0"
        _refuse("newtons_per_count", self.newtons_per_count, lambda v: _is_float(v) and not v <= 0, per_count)
        _refuse("newtons_per_count", self.newtons_per_count, lambda v: not math.isinf(v), per_count)
        _refuse("zero_count", self.zero_count, lambda v: _is_float(v) and math.isfinite(v), "a finite number")
        _refuse("sign", self.sign, lambda v: type(v) is int and v in (1, -1), "1 or -1")
        _refuse("header_lines", self.header_lines, lambda v: v is None or (type(v) is int and v >= 0), "a count")
        _refuse("direction", self.direction, _is_direction, "three finite numbers that are not all 0")

    def _refuse_wrong_texts(self) -> None:
        known = ("", *DELIMITERS.values())
        _refuse("delimiter", self.delimiter, known.__contains__, '"comma", "semicolon" or "tab"')
        _refuse("decimal", self.decimal, ("", ".", ",").__contains__, '"." or ","')

    def _refuse_contradictions(self) -> None:
        counts = self.force_unit is ForceUnit.COUNTS
        runs = self.runs != ()
        timed = self.time is not None
        for entry, wrong, message in (
            ("force", self.force is None and not runs, "found neither force nor runs, expected one of them"),
            ("runs", self.force is not None and runs, "found force and runs, expected one of them"),
            ("sampling_rate_Hz", timed and not math.isnan(self.sampling_rate), "found also time, expected one of them"),
            ("time_unit", not timed and self.time_unit is not TimeUnit.SECONDS, "found no time column; leave it out"),
            ("curve", self.curve is not None and runs, "found also runs, expected one of them: a file is long or wide"),
            ("newtons_per_count", counts and math.isnan(self.newtons_per_count), "expected with force_unit counts"),
            ("newtons_per_count", not (counts or math.isnan(self.newtons_per_count)), "needs force_unit counts"),
            ("zero_count", not counts and self.zero_count != 0, "needs force_unit counts"),
            ("direction", self.direction is not None and len(self.components) != 3, "needs three columns of force"),
            ("decimal", self.delimiter == self.decimal == ",", "found the delimiter as decimal sign; state another"),
        ):
            if wrong:
                raise InputError(message, column=entry)
        if len(set(self.columns)) < len(self.columns):
            raise InputError("found a column in two places, expected each once", column="time, force, runs, curve")


_KEYS = {
    "time": "time",
    "sampling_rate_Hz": "sampling_rate",
    "force": "force",
    "runs": "runs",
    "curve": "curve",
    "time_unit": "time_unit",
    "force_unit": "force_unit",
    "newtons_per_count": "newtons_per_count",
    "zero_count": "zero_count",
    "direction": "direction",
    "sign": "sign",
    "delimiter": "delimiter",
    "decimal": "decimal",
    "header_lines": "header_lines",
}
_COLUMN = "the name of a column, or its number counted from 1"


def _refuse(entry: str, value: Any, accepted: Callable[[Any], bool], expected: str) -> None:
    try:
        good = accepted(value)
    except TypeError:  # a list or a table where a text belongs
        good = False
    if not good:
        raise InputError(f"found {value!r}, expected {expected}", column=entry)


def _unit(entry: str, value: Any, kind: type[_Unit]) -> _Unit:
    try:
        return kind(value)
    except ValueError:
        expected = ", ".join(unit.value for unit in kind)
        raise InputError(f"found {value!r}, expected one of {expected}", column=entry) from None


def _is_column(value: Any) -> bool:
    if isinstance(value, str):
        return bool(value.strip()) and not re.search("[\n\r\0]", value)
    return type(value) is int and value >= 1


def _is_force(value: Any) -> bool:
    if isinstance(value, tuple):
        return len(value) == 3 and all(map(_is_column, value))
    return value is None or _is_column(value)


def _is_runs(value: Any) -> bool:
    return value == ALL_COLUMNS if isinstance(value, str) else isinstance(value, tuple) and all(map(_is_column, value))


def _is_float(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _outside(rate: float) -> bool:
    """True for a stated rate that no device has; NaN is not stated."""
    return rate < _LOWEST_RATE or rate > _HIGHEST_RATE


def _is_direction(value: Any) -> bool:
    if value is None:
        return True
    return len(value) == 3 and all(_is_float(v) and math.isfinite(v) for v in value) and any(value)
