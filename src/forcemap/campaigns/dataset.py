"""The impacts table in memory: every impact a row, repeats grouped into states."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcemap.arrays import FloatArray, Indices, Mask, Objects, Texts
from forcemap.campaigns import columns
from forcemap.campaigns.binding import NOT_BESIDE, Binding, BindingState, in_stated_units
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.contradictions import contradictions, opposite_base_angle, range_exceeded
from forcemap.campaigns.drift import Drift, measured_again
from forcemap.campaigns.one_campaign import require_one_campaign
from forcemap.campaigns.phase_two import PhaseTwo, including_unused, sinking
from forcemap.campaigns.point_list import SPEED_NOT_STATED, AtPoint, phase_two_of
from forcemap.campaigns.quantity import LEAST, Quantity
from forcemap.campaigns.state import CONFIRMING, PLACE_SIZE, States, StateTolerance, identify_states
from forcemap.campaigns.units import unit_finding
from forcemap.errors import InputError, TableError, few
from forcemap.findings import Finding, FindingKind
from forcemap.impacts.scenario import ContactScenario

if TYPE_CHECKING:
    import pandas as pd

# what other rooms take from here beside ImpactDataset
__all__ = [
    "CONFIRMING",
    "LEAST",
    "PLACE_SIZE",
    "SPEED_NOT_STATED",
    "AtPoint",
    "Binding",
    "BindingState",
    "Conditions",
    "ContactScenario",
    "Drift",
    "PhaseTwo",
    "Quantity",
    "StateTolerance",
    "States",
    "contradictions",
    "in_stated_units",
    "measured_again",
    "phase_two_of",
    "unit_finding",
]  # fmt: skip


_NUMBERS = {column: columns.COLUMNS[column] for column in columns.NUMBERS}  # column -> argument of from_arrays

_NEAR_RANGE = 0.9
"""A force after Phase I above this share of a reading that reached the range may have been cut off there, too."""

DISAGREEMENT = 1.1
"""Repeats disagree if the largest is above the smallest by more than this factor; a choice: they agree to 1 to 3 %."""


@dataclass(frozen=True, eq=False, repr=False)
class ImpactDataset:
    """Impacts of one campaign; every array has shape (n,), one entry an impact.

    Made by `read_dataset`, `from_arrays` or `from_frame`, which check what they are given.

    Parameters
    ----------
    distance, height : array
        Place of the impact: distance from the base z-axis [m], height above the base [m].
    stated_speed : array
        Speed of the end effector at contact as the campaign states it [m/s]; `speed` is what counts.
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
    peak_pressure : array
        Peak pressure [N/cm^2], a lower bound where `pressure_censored`; NaN is "not measured".
    pressure_censored : array of bool
        True where the range of the film or array was exceeded.
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
    quantity : Quantity
        What `peak_force`, `censored` and `device_range` are of: the force, unless it was asked for another (`of`).
    without : int
        Impacts that were left out because they do not have that quantity.
    other_sites : tuple of (str, int, float)
        Other contact sites with impacts at contact points: how many, and their highest force [N].
    at_points : tuple of AtPoint
        What was measured at contact points alone, of the campaign's contact site: not fitted, but it may contradict a
        speed.
    """

    distance: FloatArray
    height: FloatArray
    stated_speed: FloatArray
    peak_force: FloatArray
    state: Texts
    repeat: Indices
    role: Texts
    censored: Mask
    base_angle: FloatArray
    phase2_force: FloatArray
    scenario: Objects
    recording: Texts
    flags: Texts
    peak_pressure: FloatArray
    pressure_censored: Mask
    extra: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    conditions: Conditions = field(default_factory=Conditions)
    states_found: str = "by state_id"
    tolerance: StateTolerance = field(default_factory=StateTolerance)
    source: str = ""
    sha256: str = ""
    phase_two: PhaseTwo = field(default_factory=PhaseTwo)
    device_range: float = math.nan
    binding: Binding = field(default_factory=Binding)
    quantity: Quantity = Quantity.FORCE
    without: int = 0
    at_points: tuple[AtPoint, ...] = ()
    other_sites: tuple[tuple[str, int, float], ...] = ()

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
        peak_pressure: ArrayLike | None = None,
        pressure_censored: ArrayLike | None = None,
        extra: Mapping[str, Sequence[str]] | None = None,
        conditions: Conditions | None = None,
        device_stiffness: float | None = None,
        tolerance: StateTolerance | None = None,
        source: str = "",
        sha256: str = "",
        rows: Sequence[int] | None = None,
    ) -> ImpactDataset:
        """Check arrays of shape (n,) and group their impacts into states; units as in the class.

        `speed` is as the campaign states it; `conditions.speed_error` is subtracted wherever it counts.
        Without `state`, impacts within the tolerance of each other form a state; with it, states of one role within the
        tolerance of each other are one, whatever they are named, and its repeats are counted anew. `device_stiffness`
        [N/m] states the spring of the measuring device where `conditions` do not. `rows` are the line numbers that
        errors name; without it the first impact is row 1.

        Raises
        ------
        TableError
            No impact; arrays of unequal length; a figure that is not finite, not positive (height may be
            negative) or in another unit; a force at or above the stated device range that is not censored; the same
            (state, repeat) twice; repeats of a state further apart than the tolerance, or a factor of 3 apart in
            force; names of states that follow each other within the tolerance and spread further than it; a column
            that names several robots, tools, sites, directions or safety settings, or another than the conditions
            state.
        """
        conditions = (conditions or Conditions()).with_device_stiffness(device_stiffness)
        tolerance, where = tolerance or _stated_tolerance(conditions), _rows(distance, rows, source)
        given: dict[str, Any] = {"distance": distance, "height": height, "speed": speed, "peak_force": peak_force}
        given |= {"phase2_force": phase2_force, "base_angle": base_angle, "peak_pressure": peak_pressure}
        checked: dict[str, Any] = {arg: columns.numbers(column, given[arg], where) for column, arg in _NUMBERS.items()}
        force, is_censored = checked["peak_force"], columns.truths("censored", censored, where)
        texts: Any = {name: columns.texts(name, x, where) for name, x in (("flags", flags), ("recording", recording))}
        roles, scenarios = columns.roles(role, where), columns.scenarios(scenario, where)
        stated = _stated_names(state, where)
        coordinates = np.column_stack([checked[name] for name in ("distance", "height", "speed")])
        names = identify_states(coordinates, roles, stated, tolerance, where)
        conditions = _within_range(conditions, names, texts["recording"], force, is_censored, where)
        dataset = cls(
            stated_speed=checked.pop("speed"),
            **checked,
            state=names,
            repeat=_repeats(repeat, stated, names, where),
            role=roles,
            censored=is_censored,
            pressure_censored=columns.truths("pressure_censored", pressure_censored, where),
            scenario=scenarios,
            **texts,
            extra=_unknown_columns(extra or {}, conditions, where),
            conditions=conditions,
            states_found=f"{_identified_by(stated, names)}, repeats within {tolerance}",
            tolerance=tolerance,
            source=source,
            sha256=sha256,
            phase_two=PhaseTwo.of(scenarios, checked["phase2_force"], force, texts["flags"], names),
            device_range=_usable_range(conditions.device.range, force, is_censored),
        )
        _require_one_unit(dataset, where)
        return dataset.bound_by(NOT_BESIDE if any(texts["recording"]) else Binding())

    def __repr__(self) -> str:
        size = f"{len(self)} impacts, {len(self.states)} states"
        return f"<ImpactDataset {self.source or 'arrays'}: {size} {self.states_found}>"

    def __len__(self) -> int:
        return int(self.distance.size)

    @property
    def speed(self) -> FloatArray:
        """Speed at contact that counts [m/s]: as stated, less the speed error that the campaign states."""
        return self.conditions.at_contact(self.stated_speed)

    @cached_property
    def as_stated(self) -> ImpactDataset:
        """The same with the speeds as the campaign states them, its speed error neither subtracted nor stated."""
        if math.isnan(self.conditions.speed_error):
            return self
        return replace(self, conditions=replace(self.conditions, speed_error=math.nan))

    def select(self, mask: Mask) -> ImpactDataset:
        """The impacts where `mask`, shape (n,), is true; states keep their names.

        What all impacts of the table say of Phase II stays known. A part of a table is no longer bound.

        Raises
        ------
        InputError
            Not a mask of that shape.
        """
        if mask.dtype != np.bool_ or mask.shape != self.distance.shape:
            problem = f"found {mask.dtype} of shape {mask.shape}"
            raise InputError(f"select: {problem}, expected a mask of shape ({len(self)},)")
        rows = np.flatnonzero(mask)
        arrays: dict[str, Any] = {
            name: array[rows] for name, array in vars(self).items() if isinstance(array, np.ndarray)
        }
        extra = {name: tuple(column[i] for i in rows) for name, column in self.extra.items()}
        binding = self.binding  # the impacts left out may speak against a map of the others
        if rows.size < len(self) and binding.state is not BindingState.BROKEN:
            binding = Binding(BindingState.UNBOUND, Finding.of(FindingKind.IMPACTS_SELECTED, impacts=rows.size))
        return replace(self, **arrays, extra=extra, binding=binding)

    def of(self, quantity: Quantity) -> ImpactDataset:
        """The same states with another quantity in place of the force: `fit_force_map` fits it as it fits forces.

        `peak_force`, `censored` and `device_range` are then the quantity's, in its unit. Impacts without it (not
        measured, or below 1: noise around nothing) are left out and counted in `without`. A clamping force counts as
        censored where it lies at the range, or within a tenth of a reading that reached it.

        Raises
        ------
        InputError
            The dataset is of another quantity than the force already.
        """
        if quantity is self.quantity:
            return self
        if self.quantity is not Quantity.FORCE:
            raise InputError(f"quantity: found a dataset of the {self.quantity.words}, expected one of the force")
        if quantity is Quantity.PRESSURE:
            values, censored = self.peak_pressure, self.pressure_censored
            usable = _usable_range(self.conditions.film.range, values[~np.isnan(values)], censored[~np.isnan(values)])
        else:
            at_range = np.where(self.censored, _NEAR_RANGE * self.peak_force, math.inf)
            values, usable = self.phase2_force, self.device_range
            censored = values >= np.fmin(at_range, np.nan_to_num(usable, nan=math.inf))
        rows = np.flatnonzero(values >= LEAST)
        arrays: dict[str, Any] = {n: array[rows] for n, array in vars(self).items() if isinstance(array, np.ndarray)}
        arrays |= {"peak_force": values[rows], "censored": censored[rows]}
        extra = {name: tuple(column[i] for i in rows) for name, column in self.extra.items()}
        left_out = len(self) - rows.size
        return replace(self, **arrays, extra=extra, device_range=usable, quantity=quantity, without=left_out)

    def shown(self, quantity: Quantity) -> FloatArray:
        """What every impact shows of a quantity, in its unit, shape (n,); NaN where nothing is known of it."""
        others = {Quantity.PRESSURE: self.peak_pressure, Quantity.CLAMPING_FORCE: self.phase2_force}
        return others.get(quantity, self.peak_force)

    def shown_at_least(self, quantity: Quantity) -> Mask:
        """Of which impacts that is a lower bound, shape (n,)."""
        return self.pressure_censored if quantity is Quantity.PRESSURE else self.censored

    @property
    def pressures(self) -> int:
        """Number of impacts of which a pressure was measured."""
        return int(np.sum(~np.isnan(self.peak_pressure)))

    @property
    def slower(self) -> Mask:
        """Which impacts are of states slower than a map of them is to hold for (map.slowest_mps in campaign.toml)."""
        of_role = np.char.add(self.role, self.state)
        _, index, count = np.unique(of_role, return_inverse=True, return_counts=True)
        speed = np.bincount(index, weights=self.stated_speed) / count
        return self.conditions.slower_than_map(speed)[index]

    @property
    def train(self) -> ImpactDataset:
        """The impacts that a map is fitted to: with role train, none slower than it is to hold for."""
        return self.select((self.role == "train") & ~self.slower)

    @property
    def slower_train(self) -> ImpactDataset:
        """The impacts with role train that are slower than a map is to hold for."""
        return self.select((self.role == "train") & self.slower)

    @property
    def test(self) -> ImpactDataset:
        """The impacts with role test."""
        return self.select(self.role == "test")

    @property
    def tested(self) -> ImpactDataset:
        """The impacts with role test that a map is to hold for."""
        return self.select((self.role == "test") & ~self.slower)

    @property
    def independent_test(self) -> ImpactDataset:
        """Of `tested` the impacts of states that no training impact shares, by name or by coordinates.

        Repeats of a training state share its error: they would flatter the map.
        """
        tested = self.tested
        train, test = self.train.states, tested.states
        if not len(train) or not len(test):
            return tested
        copies = test.repeats_of(train, self.tolerance)
        return tested.select(np.isin(tested.state, np.array(test.name)[~copies]))

    @cached_property
    def states(self) -> States:
        """The states, in order of distance, height and speed."""
        coordinates = np.column_stack([self.distance, self.height, self.speed])
        return States.of(coordinates, self.peak_force, self.state, self.censored)

    def bound_by(self, binding: Binding) -> ImpactDataset:
        """The same with the state of its binding, which is broken where its own states show a slip of a unit."""
        return replace(self, binding=in_stated_units(binding, self.conditions, self.states))

    @property
    def simulated(self) -> bool:
        """True if the campaign or any impact says that it is simulated."""
        return self.conditions.simulated or any("simulated" in flags.lower() for flags in np.unique(self.flags))

    @property
    def no_speed(self) -> Finding | None:
        """Why these impacts give no speed, or none for a body area; None if nothing speaks against one."""
        if self.binding.refusal or not math.isnan(self.conditions.device.stiffness):
            return self.binding.refusal
        return Finding.of(FindingKind.SPRING_NOT_STATED)

    @property
    def sinks(self) -> Mask:
        """True where the force returned to zero slowly, shape (n,): flag `slow_return`."""
        return sinking(self.flags)

    @property
    def contradictions(self) -> tuple[Finding, ...]:
        """Names, places, speeds and base angles of the table that contradict each other: doubts to look at."""
        turned = opposite_base_angle(self.base_angle, self.conditions.base_angle)
        beyond = range_exceeded(self.peak_force, self._stated_ranges) if self.quantity is Quantity.FORCE else None
        return (*filter(None, (beyond,)), *contradictions(self.as_stated.states), *filter(None, (turned,)))

    @property
    def _stated_ranges(self) -> FloatArray:
        """The stated range of the device of each impact [N], NaN for none."""
        if not self.conditions.devices:
            return np.full(len(self), self.conditions.device.range)
        named = zip(self.state.tolist(), self.recording.tolist(), strict=True)
        return np.array([self.conditions.device_of(*names).range for names in named])

    @property
    def drift(self) -> Drift | None:
        """How far the force of states that were measured again, with role test, has changed; None if none was."""
        return measured_again(self.select(self.role == "train").states, self.again.test.states)

    @cached_property
    def again(self) -> ImpactDataset:
        """The same, states measured again with role test by the name of the training state that they repeat.

        A table may name them as it likes, and drift and repeats that disagree are told by name.
        """
        first = self.test.states.measured_first(self.select(self.role == "train").states, self.tolerance)
        names = [first.get(name, name) for name in self.state.tolist()]
        return replace(self, state=np.where(self.role == "test", names, self.state)) if first else self

    @property
    def disagreeing_repeats(self) -> list[str]:
        """Names of the states whose repeats differ by over 10 %: look at their recordings.

        Of a censored one only that it is at least so high is known.
        """
        names, index = np.unique(self.again.state, return_inverse=True)
        lowest, highest = np.full(len(names), math.inf), np.zeros(len(names))
        np.minimum.at(lowest, index, np.where(self.censored, math.inf, self.peak_force))
        np.maximum.at(highest, index, self.peak_force)
        return [str(name) for name in names[highest > DISAGREEMENT * lowest]]

    def to_frame(self) -> pd.DataFrame:
        """The impacts as a pandas DataFrame with the columns of the impacts table."""
        import pandas as pd

        stated = self.as_stated
        frame = {column: getattr(stated, name) for column, name in columns.COLUMNS.items()}
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
        for name in cells.keys() & {*columns.TEXTS}:
            cells[name] = frame[name].astype(object).where(frame[name].notna(), None).to_numpy()
        known: dict[str, Any] = {arg: cells[column] for column, arg in columns.COLUMNS.items() if column in cells}
        extra = {name: [str(cell) for cell in values] for name, values in cells.items() if name not in columns.COLUMNS}
        return cls.from_arrays(**known, extra=extra, **options).with_unused("data frame")

    def with_unused(self, file: str) -> ImpactDataset:
        """The same with what its table says of recordings that are not in it; errors call the table `file`.

        Raises
        ------
        TableError
            It says so only in part, or otherwise than `build_dataset` writes it.
        """
        phase_two, binding = including_unused(self.phase_two, self.extra, file), self.binding
        lost = columns.RAW_PEAK in self.extra and not {*columns.UNUSED} & self.extra.keys()  # collect writes both
        if lost and binding.state is not BindingState.BROKEN:
            why = Finding.of(FindingKind.UNUSED_NOT_TOLD, table=file, column=columns.UNUSED[0])
            binding = Binding(BindingState.BROKEN, why)
        return replace(self, phase_two=phase_two, binding=binding)


def _stated_tolerance(conditions: Conditions) -> StateTolerance:
    return StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)


def _rows(distance: ArrayLike, rows: Sequence[int] | None, source: str) -> columns.Where:
    """The rows that errors name; no impact at all is refused."""
    impacts = np.atleast_1d(np.asarray(distance, dtype=object)).size
    if impacts == 0:
        raise TableError("found no impact, expected at least one", file=source or None)
    return columns.Where(source, list(rows) if rows is not None else list(range(1, impacts + 1)))


def _require_marked(flags: Texts, censored: Mask, where: columns.Where) -> None:
    """Refuse an impact that a flag calls saturated and that is not marked as censored."""
    unmarked = np.array(["saturat" in text.lower() for text in flags]) & ~censored
    where.refuse(unmarked, "flags", flags, "censored true where a flag says saturated")


def _unknown_columns(
    extra: Mapping[str, Sequence[str]], conditions: Conditions, where: columns.Where
) -> dict[str, tuple[str, ...]]:
    """The unknown columns as text; refused are known ones among them, and ones that name another campaign."""
    for name in set(extra) & columns.COLUMNS.keys():
        raise TableError("found a known column among the extra ones, expected its own argument", column=name)
    require_one_campaign(extra, conditions, where)
    return {name: tuple(str(value) for value in values) for name, values in extra.items()}


def _require_one_unit(dataset: ImpactDataset, where: columns.Where) -> None:
    """Refuse figures in another unit, saturated ones that are not marked, and marks of a pressure that is not given."""
    _require_marked(dataset.flags, dataset.censored, where)
    of_role, pressure, above = (
        np.char.add(dataset.role, dataset.state),
        dataset.peak_pressure,
        dataset.pressure_censored,
    )
    columns.refuse_other_units("peak_force_N", dataset.peak_force, dataset.censored, of_role, dataset.recording, where)
    column, range_ = "peak_pressure_N_per_cm2", dataset.conditions.film.range
    expected = f"less than the pressure range of {range_:g} N/cm^2, or pressure_censored true"
    where.refuse((pressure >= range_) & ~above, column, pressure, expected)
    at_least = "the pressure that was reached at least where pressure_censored is true"
    where.refuse(np.isnan(pressure) & above, column, pressure, at_least)
    columns.refuse_other_units(column, np.nan_to_num(pressure), above, of_role, dataset.recording, where)


def _stated_names(state: ArrayLike | None, where: columns.Where) -> Texts | None:
    """The names of states as given, one in every row; None if the table has none."""
    if state is None:
        return None
    names = columns.texts("state_id", state, where)
    where.refuse(names == "", "state_id", names, "a name in every row, or no such column")
    return names


def _within_range(
    conditions: Conditions, state: Texts, recording: Texts, force: FloatArray, censored: Mask, where: columns.Where
) -> Conditions:
    """The conditions with the devices of these impacts; an uncensored force at its device's range is refused."""
    devices = [conditions.device_of(*names) for names in zip(state.tolist(), recording.tolist(), strict=True)]
    ranges = np.array([device.range for device in devices])
    above = (force >= ranges) & ~censored
    expected = f"less than the device range of {ranges[above.argmax()]:g} N, or censored true"
    where.refuse(above, "peak_force_N", force, expected)
    return conditions.of_devices(devices)


def _repeats(given: ArrayLike | None, stated: Texts | None, names: Texts, where: columns.Where) -> Indices:
    """Repeat numbers; those of states joined from several names are counted anew."""
    numbered = columns.repeats(given, names if stated is None else stated, where)
    if stated is None or np.array_equal(stated, names):
        return numbered
    return np.where(np.isin(names, names[stated != names]), columns.repeats(None, names, where), numbered)


_MOST_JOINED = 6
"""Joined states that are named; a choice: more are counted."""


def _identified_by(stated: Texts | None, names: Texts) -> str:
    """How states were identified, as a phrase."""
    if stated is None:
        return "by coordinates"
    groups: dict[str, list[str]] = {}
    for name, other in np.unique(np.column_stack([names, stated]), axis=0).tolist():
        groups.setdefault(name, []).append(other)
    joined = [" with ".join(group) for group in groups.values() if len(group) > 1]
    if not joined:
        return "by state_id"
    given, states = np.unique(stated).size, np.unique(names).size
    named = few(joined, _MOST_JOINED)
    return f"by state_id, {given} names of {states} states (as close as repeats and so one: {named})"


def _usable_range(stated: float, peak_force: FloatArray, censored: Mask) -> float:
    """The device range [N] by what was stated and by the forces read."""
    if not censored.any():
        return stated
    highest_read = peak_force[~censored].max(initial=-math.inf)
    return float(np.fmin(stated, max(peak_force[censored].min(), highest_read)))
