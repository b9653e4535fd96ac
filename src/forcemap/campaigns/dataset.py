"""The impacts table in memory: every impact a row, repeats grouped into states."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.phase_two import PhaseTwo
from forcemap.campaigns.state import States, StateTolerance, identify_states
from forcemap.errors import InputError, TableError
from forcemap.impacts.scenario import ContactScenario

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Conditions", "ContactScenario", "ImpactDataset", "PhaseTwo", "StateTolerance", "States"]

FloatArray = NDArray[np.float64]

# What a robot beside a person can do at all; beyond it the figure is in another unit.
_PLAUSIBLE = {
    "distance_m": (0.0, 10.0, "metres above 0 and up to 10"),
    "height_m": (-10.0, 10.0, "metres from -10 to 10"),
    "speed_mps": (0.0, 10.0, "metres per second above 0 and up to 10"),
    "peak_force_N": (1.0, 1e5, "newtons from 1 to 100000"),
    "phase2_force_N": (0.0, 1e5, "newtons from 0 to 100000"),
    "base_angle_deg": (-3600.0, 3600.0, "degrees from -3600 to 3600"),
}


@dataclass(frozen=True, eq=False)
class ImpactDataset:
    """Impacts of one campaign; every array has shape (n,), one entry an impact.

    Made by `read_dataset`, `from_arrays` or `from_frame`, which check what they are given.

    Parameters
    ----------
    distance, height : array
        Place of the impact: distance from the base z-axis [m], height above the base [m].
    speed : array
        Speed of the end effector at contact [m/s].
    peak_force : array
        Phase I peak force [N]; a lower bound where `censored`.
    state : array of str
        Name of the state; repeats of a state share it.
    repeat : array of int
        Number of the repeat within its state.
    role : array of str
        "train" or "test".
    censored : array of bool
        True where the device range was exceeded.
    base_angle : array
        Angle of the base joint [deg]; NaN is "not stated".
    phase2_force : array
        Phase II force [N]; NaN is "not recorded".
    scenario : array of (ContactScenario or None)
        Contact scenario; None is "not recorded".
    recording, flags : array of str
        Name of the raw file; quality flags.
    extra : mapping of str to tuple of str
        Unknown columns of the table, as text.
    conditions : Conditions
        What the campaign was measured under.
    states_found : str
        How states were found: "by state_id" or "by coordinates".
    tolerance : StateTolerance
        How far repeats of a state may lie apart.
    source, sha256 : str
        Name and SHA-256 of the table.
    phase_two : PhaseTwo
        What all impacts of the table, censored and test ones too, say of Phase II; `train` and `test` keep it.
    device_range : float
        Device range [N]: as stated, and never above a force at which it saturated; NaN if nothing tells.
    """

    distance: FloatArray
    height: FloatArray
    speed: FloatArray
    peak_force: FloatArray
    state: NDArray[np.str_]
    repeat: NDArray[np.int64]
    role: NDArray[np.str_]
    censored: NDArray[np.bool_]
    base_angle: FloatArray
    phase2_force: FloatArray
    scenario: NDArray[np.object_]
    recording: NDArray[np.str_]
    flags: NDArray[np.str_]
    extra: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    conditions: Conditions = field(default_factory=Conditions)
    states_found: str = "by state_id"
    tolerance: StateTolerance = field(default_factory=StateTolerance)
    source: str = ""
    sha256: str = ""
    phase_two: PhaseTwo = field(default_factory=PhaseTwo)
    device_range: float = math.nan

    @classmethod
    def from_arrays(
        cls,
        *,
        distance: ArrayLike,
        height: ArrayLike,
        speed: ArrayLike,
        peak_force: ArrayLike,
        state: ArrayLike | None = None,
        repeat: ArrayLike | None = None,
        role: ArrayLike | None = None,
        censored: ArrayLike | None = None,
        base_angle: ArrayLike | None = None,
        phase2_force: ArrayLike | None = None,
        scenario: Sequence[str | ContactScenario | None] | NDArray[Any] | None = None,
        recording: ArrayLike | None = None,
        flags: ArrayLike | None = None,
        extra: Mapping[str, Sequence[str]] | None = None,
        conditions: Conditions | None = None,
        tolerance: StateTolerance | None = None,
        source: str = "",
        sha256: str = "",
        rows: Sequence[int] | None = None,
    ) -> ImpactDataset:
        """Check arrays of shape (n,) and group their impacts into states; units as in the class.

        Without `state`, impacts within the tolerance of each other form a state. `rows` are the line numbers
        that errors name; without it the first impact is row 1.

        Raises
        ------
        TableError
            No impact; arrays of unequal length; a figure that is not finite, not positive (height may be
            negative) or in another unit; a force at or above the stated device range that is not censored; the same
            (state, repeat) twice; repeats of a state further apart than the tolerance, or a factor of 3 apart in
            force; one state under two names or with two roles.
        """
        tolerance = tolerance or StateTolerance()
        conditions = conditions or Conditions()
        n = np.atleast_1d(np.asarray(distance)).size
        where = _Where(source, list(rows) if rows is not None else list(range(1, n + 1)))
        if n == 0:
            raise TableError("found no impact, expected at least one", file=source or None)

        numbers = {
            "distance_m": distance,
            "height_m": height,
            "speed_mps": speed,
            "peak_force_N": peak_force,
            "base_angle_deg": base_angle,
            "phase2_force_N": phase2_force,
        }
        checked = {column: _numbers(column, values, n, where) for column, values in numbers.items()}
        is_censored = _flags(censored, n, where)
        device_range = conditions.device.range
        saturated = checked["peak_force_N"][is_censored]
        where.refuse(
            (checked["peak_force_N"] >= device_range) & ~is_censored,
            "peak_force_N",
            checked["peak_force_N"],
            f"less than the device range of {device_range:g} N, or censored true",
        )
        roles = _texts("role", role, n, where, default="train")
        where.refuse(~np.isin(roles, ("train", "test")), "role", roles, "train or test")
        scenarios = _scenarios(scenario, n, where)
        given = None if state is None else _texts("state_id", state, n, where)
        if given is not None:
            where.refuse(given == "", "state_id", given, "a name in every row, or no such column")

        coordinates = np.column_stack([checked["distance_m"], checked["height_m"], checked["speed_mps"]])
        names = identify_states(coordinates, roles, given, tolerance, where)
        _refuse_other_units(checked["peak_force_N"], is_censored, names, where)
        return cls(
            distance=checked["distance_m"],
            height=checked["height_m"],
            speed=checked["speed_mps"],
            peak_force=checked["peak_force_N"],
            state=names,
            repeat=_repeats(repeat, names, where),
            role=roles,
            censored=is_censored,
            base_angle=checked["base_angle_deg"],
            phase2_force=checked["phase2_force_N"],
            scenario=scenarios,
            recording=_texts("recording", recording, n, where),
            flags=_texts("flags", flags, n, where),
            extra={name: tuple(str(value) for value in values) for name, values in (extra or {}).items()},
            conditions=conditions,
            states_found="by coordinates" if given is None else "by state_id",
            tolerance=tolerance,
            source=source,
            sha256=sha256,
            phase_two=_phase_two(scenarios, checked["phase2_force_N"]),
            device_range=float(np.fmin(device_range, saturated.min() if saturated.size else math.nan)),
        )

    def __len__(self) -> int:
        return int(self.distance.size)

    def select(self, mask: NDArray[np.bool_]) -> ImpactDataset:
        """The impacts where `mask`, shape (n,), is true; states keep their names."""
        kept = np.flatnonzero(mask)
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        arrays = {name: value[kept] for name, value in values.items() if isinstance(value, np.ndarray)}
        extra = {name: tuple(column[i] for i in kept) for name, column in self.extra.items()}
        phase_two = _phase_two(arrays["scenario"], arrays["phase2_force"])
        return ImpactDataset(**(values | arrays | {"extra": extra, "phase_two": phase_two}))

    @property
    def train(self) -> ImpactDataset:
        """The impacts with role train; what all impacts say of Phase II goes with them."""
        return replace(self.select(self.role == "train"), phase_two=self.phase_two)

    @property
    def test(self) -> ImpactDataset:
        """The impacts with role test; what all impacts say of Phase II goes with them."""
        return replace(self.select(self.role == "test"), phase_two=self.phase_two)

    @cached_property
    def states(self) -> States:
        """The states, in order of distance, height and speed."""
        return States.of(self.distance, self.height, self.speed, self.peak_force, self.state, self.censored)

    @property
    def simulated(self) -> bool:
        """True if the campaign or any impact says that it is simulated."""
        flagged = any("simulated" in flags.lower() for flags in np.unique(self.flags))
        return self.conditions.simulated or flagged

    def to_frame(self) -> pd.DataFrame:
        """The impacts as a pandas DataFrame with the columns of the impacts table."""
        from forcemap.campaigns.impacts_table import to_frame

        return to_frame(self)

    @classmethod
    def from_frame(cls, frame: pd.DataFrame, **options: Any) -> ImpactDataset:
        """Impacts from a pandas DataFrame with the columns of the impacts table; options as in `from_arrays`.

        Raises
        ------
        TableError
            As `from_arrays`, and for missing columns.
        """
        from forcemap.campaigns.impacts_table import from_frame

        return from_frame(frame, **options)


@dataclass(frozen=True)
class _Where:
    """Turns an offending position into an error that names file, row and column."""

    source: str
    rows: list[int]

    def error(self, position: int, column: str, message: str) -> TableError:
        return TableError(message, file=self.source or None, row=self.rows[position], column=column)

    def refuse(self, offending: Any, column: str, values: Any, expected: str) -> None:
        for position in np.flatnonzero(offending)[:1]:
            value = values[position]
            found = f"{value:g}" if isinstance(value, int | float | np.number) else repr(str(value))
            raise self.error(int(position), column, f"found {found}, expected {expected}")


def _sized(column: str, values: ArrayLike, n: int, where: _Where) -> NDArray[Any]:
    if np.ma.is_masked(values):
        raise TableError("found masked entries, expected none", file=where.source or None, column=column)
    array = np.atleast_1d(np.asarray(values))
    if array.shape != (n,):
        found = f"found an array of shape {array.shape}, expected ({n},) like distance"
        raise TableError(found, file=where.source or None, column=column)
    return array


def _numbers(column: str, values: ArrayLike | None, n: int, where: _Where) -> FloatArray:
    if values is None:
        return np.full(n, np.nan)
    try:
        array = _sized(column, values, n, where).astype(np.float64)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise TableError(f"expected numbers: {error}", file=where.source or None, column=column) from None
    low, high, expected = _PLAUSIBLE[column]
    optional = column in ("base_angle_deg", "phase2_force_N")
    above_zero = column in ("distance_m", "speed_mps")
    accepted = (array >= low) & (array <= high) & ~((array == 0) & above_zero)
    where.refuse(~(accepted | (np.isnan(array) & optional)), column, array, expected)
    return array


def _texts(column: str, values: ArrayLike | None, n: int, where: _Where, default: str = "") -> NDArray[np.str_]:
    if values is None:
        return np.full(n, default)
    array = _sized(column, values, n, where)
    if np.issubdtype(array.dtype, np.integer):
        return array.astype(np.str_)
    texts = np.array([default if value is None else str(value).strip() for value in array], dtype=np.str_)
    return np.where(texts == "", default, texts)


def _flags(values: ArrayLike | None, n: int, where: _Where) -> NDArray[np.bool_]:
    if values is None:
        return np.zeros(n, dtype=np.bool_)
    array = _sized("censored", values, n, where)
    where.refuse([value not in (True, False) for value in array], "censored", array, "true or false")
    return array.astype(np.bool_)


def _scenarios(values: Any, n: int, where: _Where) -> NDArray[np.object_]:
    result = np.full(n, None, dtype=object)
    if values is None:
        return result
    if len(values) != n:
        found = f"found {len(values)} entries, expected {n} like distance"
        raise TableError(found, file=where.source or None, column="scenario")
    for position, value in enumerate(values):
        if value is None or (isinstance(value, float) and math.isnan(value)) or str(value).strip() == "":
            continue
        try:
            result[position] = ContactScenario.parse(str(value))
        except InputError as error:
            raise where.error(position, "scenario", error.message) from None
    return result


def _phase_two(scenario: NDArray[np.object_], phase2_force: FloatArray) -> PhaseTwo:
    recorded = [each for each in scenario if each is not None]
    forces = phase2_force[~np.isnan(phase2_force)]
    return PhaseTwo(
        scenarios={each: recorded.count(each) for each in ContactScenario if each in recorded},
        unrecorded=sum(each is None for each in scenario[np.isnan(phase2_force)]),
        largest_force=float(forces.max()) if forces.size else math.nan,
    )


def _refuse_other_units(force: FloatArray, censored: NDArray[np.bool_], names: NDArray[np.str_], where: _Where) -> None:
    """Repeats of a state agree within percents; a factor of 3 is another unit (kgf, lbf) or another impact."""
    _, index = np.unique(names, return_inverse=True)
    highest = np.zeros(index.max() + 1)
    np.maximum.at(highest, index[~censored], force[~censored])
    offending = (3 * force < highest[index]) & ~censored
    for position in np.flatnonzero(offending)[:1]:
        where.refuse(offending, "peak_force_N", force, f"about {highest[index[position]]:g}, as its repeats")


def _repeats(values: ArrayLike | None, names: NDArray[np.str_], where: _Where) -> NDArray[np.int64]:
    """Repeat numbers, counted in order of rows where they are not given; (state, repeat) must be unique."""
    if values is None:
        counts: dict[str, int] = {}
        repeats = np.empty(names.size, dtype=np.int64)
        for position, name in enumerate(names.tolist()):
            counts[name] = repeats[position] = counts.get(name, 0) + 1
        return repeats
    array = _sized("repeat", values, names.size, where)
    whole = [isinstance(v, int | float | np.integer | np.floating) and float(v).is_integer() for v in array]
    where.refuse(~np.array(whole), "repeat", array, "a whole number")
    repeats = array.astype(np.int64)
    first: dict[tuple[str, int], int] = {}
    for position, key in enumerate(zip(names.tolist(), repeats.tolist(), strict=True)):
        if key in first:
            raise where.error(
                position,
                "repeat",
                f"found repeat {key[1]} of state {key[0]!r} again (first in row {where.rows[first[key]]}), "
                "expected every repeat of a state once; number the repeats or take the copy out",
            )
        first[key] = position
    return repeats
