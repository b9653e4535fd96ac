"""What the columns of an impacts table may hold; everything else is refused with row and column."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcemap.arrays import FloatArray, Indices, Mask, Objects, Texts
from forcemap.errors import InputError, TableError, few
from forcemap.impacts.scenario import ContactScenario

# column of the table -> argument of ImpactDataset.from_arrays, and attribute of ImpactDataset.as_stated
_EVERY = {"distance_m": "distance", "height_m": "height", "speed_mps": "speed", "peak_force_N": "peak_force"}
_OF_STATE = {"state_id": "state", "repeat": "repeat", "role": "role", "censored": "censored"}
_BESIDE = {"base_angle_deg": "base_angle", "phase2_force_N": "phase2_force"}
_PRESSURE = {"peak_pressure_N_per_cm2": "peak_pressure", "pressure_censored": "pressure_censored"}
COLUMNS = _EVERY | _OF_STATE | _BESIDE | _PRESSURE | {name: name for name in ("scenario", "recording", "flags")}
RAW_PEAK = "raw_peak_N"
"""A further column that `build_dataset` writes: the largest sample of Phase I."""
UNUSED = (
    *(f"unused_{scenario.value}" for scenario in ContactScenario),
    *("unused_above_peak", "unused_excluded", "unused_unreadable", "unused_phase2_force_N"),
)
"""Columns with the same figure in every row, so that they go wherever the table goes: what is known of recordings that
are not in it. How many are of each contact scenario, hold a Phase II force above their peak, were excluded by a person
although they bar the transient limit, or cannot be read; and their largest Phase II force [N]."""
# The most that a robot beside a person can do; choices, far beyond any: a larger figure is in another unit.
LARGEST = 10.0
"""Largest distance, height [m] and speed [m/s] that a robot can have."""
LARGEST_FORCE = 1e5
"""Largest force that an impact can have [N]."""
LARGEST_PRESSURE = 1e4
"""Largest pressure that an impact can have [N/cm^2]."""
_PLAUSIBLE = {
    "distance_m": (0.0, LARGEST, "metres above 0 and up to 10"),
    "height_m": (-LARGEST, LARGEST, "metres from -10 to 10"),
    "speed_mps": (0.0, LARGEST, "metres per second above 0 and up to 10"),
    "peak_force_N": (1.0, LARGEST_FORCE, "newtons from 1 to 100000"),
    "phase2_force_N": (0.0, LARGEST_FORCE, "newtons from 0 to 100000"),
    "peak_pressure_N_per_cm2": (0.0, LARGEST_PRESSURE, "N/cm^2 from 0 to 10000"),
    "base_angle_deg": (-3600.0, 3600.0, "degrees from -3600 to 3600"),
}

NUMBERS = tuple(_PLAUSIBLE)
"""The columns that hold numbers with a unit."""

TRUTHS = ("censored", "pressure_censored")
"""The columns that hold true or false."""

TEXTS = tuple(column for column in COLUMNS if column not in (*NUMBERS, *TRUTHS, "repeat"))
"""The columns that hold names."""

REQUIRED = tuple(_EVERY)
"""The columns that every table has."""
# How alike a column's name and a known one are, as difflib counts (1: equal); choices.
_SLIP = 0.85  # a slip of the known one
_SIMILAR = 0.6  # worth naming where the known one is missing
_UNIT_FACTOR = 3.0  # repeats agree within percents; the smallest slip of a unit of force is 4.4 (lbf)
_LARGEST_SCALED = 2.0  # [m], [m/s]: a figure that is no more in mm or cm is probably in these
_DECISIVE = {  # words in a column's name that show what it decides
    "censored": ("censored", "zensiert", "saturat", "clipped", "overload", "overrange"),
    "scenario": ("scenario", "clamp"),
    "phase2_force_N": ("phase2", "phaseii"),
    "peak_pressure_N_per_cm2": (
        "peakpressure",
        "maxpressure",
        "contactpressure",
        "pressuren",
        "pressuremp",
        "pressurekp",
        "druckn",
    ),
}
_TRUTH = {"true": True, "1": True, "false": False, "0": False, "": False}


@dataclass(frozen=True)
class Where:
    """Turns an offending position into an error that names file, row and column."""

    source: str
    rows: list[int]

    def error(self, position: int | None, column: str, message: str) -> TableError:
        """The error to raise for the row at `position`, or for a whole column."""
        row = None if position is None else self.rows[position]
        return TableError(message, file=self.source or None, row=row, column=column)

    def refuse(self, offending: Any, column: str, values: Any, expected: str) -> None:
        """Raise for the first row, if any, where `offending` is true."""
        for position in np.flatnonzero(offending)[:1]:
            value = values[position]
            shown = f"{value:g}" if isinstance(value, int | float | np.number) else repr(str(value))
            raise self.error(int(position), column, f"found {shown}, expected {expected}")


def _sized(column: str, values: ArrayLike, where: Where) -> NDArray[Any]:
    if np.ma.is_masked(values):
        raise where.error(None, column, "found masked entries, expected none")
    array = np.atleast_1d(np.asarray(values))
    n = len(where.rows)
    if array.shape != (n,):
        raise where.error(None, column, f"found an array of shape {array.shape}, expected ({n},) like distance")
    return array


def numbers(column: str, values: ArrayLike | None, where: Where) -> FloatArray:
    """Plausible numbers, shape (n,); NaN in an empty cell of an optional column."""
    optional = column not in REQUIRED
    if values is None:
        if not optional:
            raise where.error(None, column, "found nothing, expected numbers")
        return np.full(len(where.rows), np.nan)
    try:
        array = _sized(column, values, where).astype(np.float64)
    except InputError:
        raise
    except (TypeError, ValueError) as error:
        raise where.error(None, column, f"expected numbers: {error}") from None
    low, high, expected = _PLAUSIBLE[column]
    above_zero = column in ("distance_m", "speed_mps")
    accepted = (array >= low) & (array <= high) & ~((array == 0) & above_zero)
    refused = ~(accepted | (np.isnan(array) & optional))
    unit = {"distance_m": "m", "height_m": "m", "speed_mps": "m/s"}.get(column)
    where.refuse(
        refused, column, array, expected + (likely_unit(array[refused][0], unit) if unit and refused.any() else "")
    )
    return array


def likely_unit(value: float, unit: str) -> str:
    """The question whether a figure too large for m or m/s is in mm or cm; empty if it cannot be."""
    scaled = {"m": 1e-3, "c": 1e-2}
    likely = [f"{name}{unit}" for name, scale in scaled.items() if LARGEST < abs(value) <= _LARGEST_SCALED / scale]
    return f"; is it in {' or '.join(likely)}?" if likely else ""


def texts(column: str, values: ArrayLike | None, where: Where, default: str = "") -> Texts:
    """Texts without surrounding blanks, shape (n,); the default where a cell is empty."""
    if values is None:
        return np.full(len(where.rows), default)
    array = _sized(column, values if isinstance(values, np.ndarray) else np.array(values, dtype=object), where)
    if np.issubdtype(array.dtype, np.integer):
        return array.astype(np.str_)
    cells = [None if value is None or value != value else str(value).strip() for value in array]
    return np.array([cell or default for cell in cells], dtype=np.str_)


def roles(values: ArrayLike | None, where: Where) -> Texts:
    """Roles, shape (n,); train where a cell is empty."""
    roles = texts("role", values, where, default="train")
    where.refuse(~np.isin(roles, ("train", "test")), "role", roles, "train or test")
    return roles


def truths(column: str, values: ArrayLike | None, where: Where) -> Mask:
    """True and false, shape (n,); false without the column."""
    if values is None:
        return np.zeros(len(where.rows), dtype=np.bool_)
    array = _sized(column, values, where)
    stated = [value == 1 if value in (0, 1) else _TRUTH.get(str(value).lower()) for value in array.tolist()]
    where.refuse([truth is None for truth in stated], column, array, "true or false")
    return np.array(stated, dtype=np.bool_)


def scenarios(values: Any, where: Where) -> Objects:
    """Contact scenarios, shape (n,); None where a cell is empty."""
    names = texts("scenario", values, where)
    result = np.full(names.size, None, dtype=object)
    for position in np.flatnonzero(names != "").tolist():
        try:
            result[position] = ContactScenario.parse(str(names[position]))
        except InputError as error:
            raise where.error(position, "scenario", error.message) from None
    return result


def refuse_other_units(
    column: str, force: FloatArray, censored: Mask, names: Texts, recordings: Texts, where: Where
) -> None:
    """Refuse repeats of a state that differ by a factor of 3: another unit (kgf, lbf) or the impact of another run."""
    measured = np.flatnonzero(~censored & (force > 0))
    order = measured[np.lexsort((force[measured], names[measured]))]
    _, first, count = np.unique(names[order], return_index=True, return_counts=True)
    lowest, highest = force[order[first]], force[order[first + count - 1]]
    for group in np.flatnonzero(highest > _UNIT_FACTOR * lowest)[:1]:
        member = order[first[group] : first[group] + count[group]]
        usual = float(np.median(force[member]))
        position = int(member[np.abs(np.log(force[member] / usual)).argmax()])
        name = str(recordings[position])
        found = f"found {force[position]:g}{f' of recording {name}' if name else ''}, expected about {usual:g}"
        asked = "is it in another unit, or of another run (recordings one place off in the order of the runs)?"
        raise where.error(position, column, f"{found} as the repeats of its state; {asked}")


def repeats(values: ArrayLike | None, names: Texts, where: Where) -> Indices:
    """Repeat numbers, counted in order of rows where they are not given; (state, repeat) must be unique."""
    if values is None:
        counts: dict[str, int] = {}
        repeats = np.empty(names.size, dtype=np.int64)
        for position, name in enumerate(names.tolist()):
            counts[name] = repeats[position] = counts.get(name, 0) + 1
        return repeats
    array = _sized("repeat", values, where)
    whole = [isinstance(v, int | float | np.integer | np.floating) and float(v).is_integer() for v in array]
    where.refuse(~np.array(whole), "repeat", array, "a whole number")
    repeats = array.astype(np.int64)
    first: dict[tuple[str, int], int] = {}
    for position, key in enumerate(zip(names.tolist(), repeats.tolist(), strict=True)):
        if key in first:
            problem = f"found repeat {key[1]} of state {key[0]!r} again (first in row {where.rows[first[key]]})"
            remedy = "expected every repeat of a state once; number the repeats or take the copy out"
            raise where.error(position, "repeat", f"{problem}, {remedy}")
        first[key] = position
    return repeats


def _letters(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def require_columns(header: Sequence[str], file: str, row: int | None = None) -> None:
    """Refuse a header without a required column, with one twice, or with one whose name is a slip of another."""

    def refuse(column: str, message: str) -> NoReturn:
        raise TableError(message, file=file, row=row, column=column)

    known = {column: difflib.SequenceMatcher(None, b=_letters(column)) for column in COLUMNS}
    for name, times in Counter(header).items():
        if times > 1:
            refuse(name, f"found column {name!r} twice, expected it once")
        if meant := _meant(name, known):
            remedy = f"name it {meant!r} if that is what it holds, else give it a name that differs more"
            refuse(name, f"found a column {name!r} that would not be read; {remedy}")
    for name in REQUIRED:
        if name not in header:
            unknown = [column for column in header if column not in COLUMNS]
            near = difflib.get_close_matches(name, unknown, n=1, cutoff=_SIMILAR)
            similar = f"; {near[0]!r} may be it: convert to the unit in the name and rename it" if near else ""
            if unknown and not near:
                similar = f"; found {few(unknown)}: rename those that hold them, converted to the units in the names"
            if len(header) == 1:
                similar = "; expected commas, semicolons or tabs between columns"
            refuse(name, f"the column is missing, expected at least {', '.join(REQUIRED)}{similar}")


def _meant(name: str, known: Mapping[str, difflib.SequenceMatcher[str]]) -> str:
    """The optional column that an unknown column's name is a slip of; empty if none is.

    A saturated or clamping impact in a column that nobody reads would be taken for a good one.
    """
    if name in COLUMNS or name in UNUSED:
        return ""
    plain = _letters(name)
    for column, beside in known.items():
        beside.set_seq1(plain)
        alike = (beside.real_quick_ratio, beside.quick_ratio, beside.ratio)  # the quick ones are never lower
        slip = column not in REQUIRED and all(likeness() > _SLIP for likeness in alike)
        if plain == _letters(column) or slip or any(word in plain for word in _DECISIVE.get(column, ())):
            return column
    return ""
