"""The impacts table in memory: every impact a row, repeats grouped into states."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcemap.arrays import FloatArray, Indices, Mask, Objects
from forcemap.campaigns import columns
from forcemap.campaigns.binding import NOT_BESIDE, Binding, BindingState
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.phase_two import PhaseTwo
from forcemap.campaigns.remark import REMARK, including
from forcemap.campaigns.state import States, StateTolerance, identify_states
from forcemap.errors import InputError, TableError
from forcemap.impacts.scenario import ContactScenario

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "Binding",
    "BindingState",
    "Conditions",
    "ContactScenario",
    "ImpactDataset",
    "PhaseTwo",
    "StateTolerance",
    "States",
]


@dataclass(frozen=True, eq=False, repr=False)
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
        How states were found: by state_id or by coordinates, and the tolerance of repeats.
    tolerance : StateTolerance
        How far repeats of a state may lie apart.
    source, sha256 : str
        Name and SHA-256 of the table.
    phase_two : PhaseTwo
        What all impacts of the table, censored and test ones too, say of Phase II; a selection keeps it.
    device_range : float
        Device range [N]: as stated, and no more than the lowest force at which it saturated, or the highest force that
        it read if that is more; NaN if nothing tells.
    binding : Binding
        Whether the table is what its recordings gave.
    """

    distance: FloatArray
    height: FloatArray
    speed: FloatArray
    peak_force: FloatArray
    state: NDArray[np.str_]
    repeat: Indices
    role: NDArray[np.str_]
    censored: Mask
    base_angle: FloatArray
    phase2_force: FloatArray
    scenario: Objects
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
    binding: Binding = field(default_factory=Binding)

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
        device_stiffness: float | None = None,
        tolerance: StateTolerance | None = None,
        source: str = "",
        sha256: str = "",
        rows: Sequence[int] | None = None,
    ) -> ImpactDataset:
        """Check arrays of shape (n,) and group their impacts into states; units as in the class.

        Without `state`, impacts within the tolerance of each other form a state. `device_stiffness` [N/m] states the
        spring of the measuring device where `conditions` do not. `rows` are the line numbers that errors name; without
        it the first impact is row 1.

        Raises
        ------
        TableError
            No impact; arrays of unequal length; a figure that is not finite, not positive (height may be
            negative) or in another unit; a force at or above the stated device range that is not censored; the same
            (state, repeat) twice; repeats of a state further apart than the tolerance, or a factor of 3 apart in
            force; one state under two names.
        """
        conditions = (conditions or Conditions()).with_device_stiffness(device_stiffness)
        tolerance = tolerance or StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)
        n = np.atleast_1d(np.asarray(distance, dtype=object)).size
        where = columns.Where(source, list(rows) if rows is not None else list(range(1, n + 1)))
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
        checked = {column: columns.numbers(column, values, n, where) for column, values in numbers.items()}
        is_censored = columns.truths(censored, n, where)
        device_range = conditions.device.range
        where.refuse(
            (checked["peak_force_N"] >= device_range) & ~is_censored,
            "peak_force_N",
            checked["peak_force_N"],
            f"less than the device range of {device_range:g} N, or censored true",
        )
        words, recordings = columns.texts("flags", flags, n, where), columns.texts("recording", recording, n, where)
        unmarked = np.array(["saturat" in word.lower() for word in words]) & ~is_censored
        where.refuse(unmarked, "flags", words, "censored true where a flag says saturated")
        for name in set(extra or {}) & columns.COLUMNS.keys():
            raise TableError("found a known column among the extra ones, expected its own argument", column=name)
        roles = columns.texts("role", role, n, where, default="train")
        where.refuse(~np.isin(roles, ("train", "test")), "role", roles, "train or test")
        scenarios = columns.scenarios(scenario, n, where)
        given = None if state is None else columns.texts("state_id", state, n, where)
        if given is not None:
            where.refuse(given == "", "state_id", given, "a name in every row, or no such column")

        coordinates = np.column_stack([checked["distance_m"], checked["height_m"], checked["speed_mps"]])
        names = identify_states(coordinates, roles, given, tolerance, where)
        groups = np.char.add(roles, names)
        columns.refuse_other_units(checked["peak_force_N"], is_censored, groups, where)
        return cls(
            distance=checked["distance_m"],
            height=checked["height_m"],
            speed=checked["speed_mps"],
            peak_force=checked["peak_force_N"],
            state=names,
            repeat=columns.repeats(repeat, names, where),
            role=roles,
            censored=is_censored,
            base_angle=checked["base_angle_deg"],
            phase2_force=checked["phase2_force_N"],
            scenario=scenarios,
            recording=recordings,
            flags=words,
            extra={name: tuple(str(value) for value in values) for name, values in (extra or {}).items()},
            conditions=conditions,
            states_found=f"{'by coordinates' if given is None else 'by state_id'}, repeats within {tolerance}",
            tolerance=tolerance,
            source=source,
            sha256=sha256,
            phase_two=PhaseTwo.of(scenarios, checked["phase2_force_N"], checked["peak_force_N"]),
            device_range=_usable_range(device_range, checked["peak_force_N"], is_censored),
            binding=NOT_BESIDE if any(recordings) else Binding(),
        )

    def __repr__(self) -> str:
        name = self.source or "arrays"
        return f"<ImpactDataset {name}: {len(self)} impacts, {len(self.states)} states {self.states_found}>"

    def __len__(self) -> int:
        return int(self.distance.size)

    def select(self, mask: Mask) -> ImpactDataset:
        """The impacts where `mask`, shape (n,), is true; states keep their names.

        What all impacts of the table say of Phase II stays known. A part of a table is no longer bound.

        Raises
        ------
        InputError
            Not a mask of that shape.
        """
        if mask.dtype != np.bool_ or mask.shape != self.distance.shape:
            raise InputError(
                f"select: found {mask.dtype} of shape {mask.shape}, expected a mask of shape ({len(self)},)"
            )
        kept = np.flatnonzero(mask)
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        arrays = {name: value[kept] for name, value in values.items() if isinstance(value, np.ndarray)}
        extra = {name: tuple(column[i] for i in kept) for name, column in self.extra.items()}
        part = {
            "extra": extra,
            "binding": self.binding if kept.size == len(self) else _selected(self.binding, kept.size),
        }
        return ImpactDataset(**(values | arrays | part))

    @property
    def train(self) -> ImpactDataset:
        """The impacts with role train."""
        return self.select(self.role == "train")

    @property
    def test(self) -> ImpactDataset:
        """The impacts with role test."""
        return self.select(self.role == "test")

    @property
    def independent_test(self) -> ImpactDataset:
        """The impacts with role test of states that no training impact shares, by name or by coordinates.

        Repeats of a training state share its error: they would flatter the map.
        """
        train, test = self.train.states, self.test.states
        if not len(train) or not len(test):
            return self.test
        from scipy.spatial import cKDTree

        scale = self.tolerance.scale
        apart, _ = cKDTree(train.coordinates / scale).query(test.coordinates / scale, p=np.inf)
        copies = (apart <= 0.1) | np.isin(test.name, train.name)
        names = np.array(test.name)[~copies]
        return self.select((self.role == "test") & np.isin(self.state, names))

    @cached_property
    def states(self) -> States:
        """The states, in order of distance, height and speed."""
        return States.of(self.distance, self.height, self.speed, self.peak_force, self.state, self.censored)

    @property
    def simulated(self) -> bool:
        """True if the campaign or any impact says that it is simulated."""
        flagged = any("simulated" in flags.lower() for flags in np.unique(self.flags))
        return self.conditions.simulated or flagged

    @property
    def disagreeing_repeats(self) -> list[str]:
        """Names of the states whose repeats, censored ones too, lie more than 10 % apart: look at their recordings."""
        order = np.lexsort((self.peak_force, self.state))
        names, first, count = np.unique(self.state[order], return_index=True, return_counts=True)
        lowest, highest = self.peak_force[order[first]], self.peak_force[order[first + count - 1]]
        return [str(name) for name in names[highest > 1.1 * lowest]]

    def to_frame(self) -> pd.DataFrame:
        """The impacts as a pandas DataFrame with the columns of the impacts table."""
        import pandas as pd

        frame = {column: getattr(self, name) for column, name in columns.COLUMNS.items()}
        frame["scenario"] = [None if scenario is None else scenario.value for scenario in self.scenario]
        return pd.DataFrame(frame | {name: list(values) for name, values in self.extra.items()})

    @classmethod
    def from_frame(cls, frame: pd.DataFrame, **options: Any) -> ImpactDataset:
        """Impacts from a pandas DataFrame with the columns of the impacts table; options as in `from_arrays`.

        Raises
        ------
        TableError
            As `from_arrays`, and for missing columns.
        """
        columns.require_columns([str(column) for column in frame.columns], "data frame")
        cells: dict[str, Any] = {str(name): frame[name].to_numpy() for name in frame.columns}
        for name in cells.keys() & {"state_id", "role", "scenario", "recording", "flags"}:
            missing = frame[name].isna().tolist()
            cells[name] = [None if absent else cell for cell, absent in zip(cells[name], missing, strict=True)]
        if "censored" in cells and cells["censored"].dtype != bool:
            cells["censored"] = [
                columns.truth(str(cell), "data frame", i + 1) for i, cell in enumerate(cells["censored"])
            ]
        known: dict[str, Any] = {arg: cells[column] for column, arg in columns.COLUMNS.items() if column in cells}
        extra = {name: [str(cell) for cell in values] for name, values in cells.items() if name not in columns.COLUMNS}
        return cls.from_arrays(**known, extra=extra, **options).with_remark("data frame")

    def with_remark(self, file: str) -> ImpactDataset:
        """The self with what its table says of impacts that are not in it."""
        remarks = set(self.extra.get(REMARK, ()))
        if not remarks:
            return self
        if len(remarks) > 1:
            raise TableError("found several remarks, expected the same in every row", file=file, column=REMARK)
        try:
            return replace(self, phase_two=including(self.phase_two, remarks.pop()))
        except InputError as error:
            raise TableError(error.message, file=file, column=REMARK) from None


def _selected(binding: Binding, count: int) -> Binding:
    """The binding of some impacts of a table: what the others say against a map of these is lost."""
    if binding.state is BindingState.BROKEN:
        return binding
    return Binding(BindingState.UNBOUND, f"SELECTED impacts, {count} of their table: the others do not count")


def _usable_range(stated: float, peak_force: FloatArray, censored: Mask) -> float:
    """The device range [N] by what was stated and by what was read."""
    if not censored.any():
        return stated
    highest_read = peak_force[~censored].max(initial=-math.inf)
    return float(np.fmin(stated, max(peak_force[censored].min(), highest_read)))
