"""Force models on the same states: the measured map, the 2D map and the standard's contact model."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.dataset import CONFIRMING, ImpactDataset, States
from forcemap.errors import BoundNotAvailable, FitError, InputError
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.limits.pfl import pfl_contact_force, pfl_speed_limit
from forcemap.maps.accuracy import FEWEST_TESTS, ON_TEST, Accuracy, left_out_predictions
from forcemap.maps.bounds import Bound, ToleranceBound
from forcemap.maps.fit import fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_2D, Form, form_of
from forcemap.speeds.basis import doubts_of_fit, unconfirmed
from forcemap.speeds.safe_speed import SpeedOutcome, safe_speed

_SAME_SPRING = 0.01  # share within which two springs are one

ALL_STATES = "all states"
"""What all states are called in a comparison, as the paper's tables have them."""


@dataclass(frozen=True)
class StateError:
    """Error of a prediction at one state.

    Parameters
    ----------
    state : str
        Name of the state.
    distance, height, speed : float
        Its coordinates [m], [m], [m/s].
    measured, predicted : float
        Forces [N].
    percent : float
        Predicted minus measured in percent of measured; negative is underestimation.
    """

    state: str
    distance: float
    height: float
    speed: float
    measured: float
    predicted: float
    percent: float


@dataclass(frozen=True)
class ModelComparison:
    """One force model against the measured states.

    Parameters
    ----------
    model : str
        Name of the model.
    accuracy : Accuracy
        Its errors.
    on_all : Accuracy
        Its errors on all states, fitted ones too (paper, Tables II and III, rows All).
    most_underestimated, most_overestimated : StateError or None
        The extremes; None if no state is on that side.
    note : Finding or None
        A remark on the model.
    """

    model: str
    accuracy: Accuracy
    on_all: Accuracy
    most_underestimated: StateError | None
    most_overestimated: StateError | None
    note: Finding | None

    @property
    def underestimated_share(self) -> float:
        """Share of states whose force the model underestimates."""
        return self.accuracy.underestimated / self.accuracy.states

    @property
    def overestimated_share(self) -> float:
        """Share of states whose force the model overestimates."""
        return self.accuracy.overestimated / self.accuracy.states


@dataclass(frozen=True)
class AllowedSpeed:
    """What a model allows at the measured places.

    Parameters
    ----------
    model : str
        Name of the model.
    limit : float
        Force limit [N].
    contact : Contact
        Its kind of contact.
    limit_source : str
        Where the limit comes from.
    places, confirmed : int
        Number of measured places, and of those with a speed to program.
    lowest, median, highest : float
        Of the speeds at contact there [m/s]; NaN if there is none.
    more, less : int or None
        Number of places where it permits more than the standard's contact model, and a speed but no more; None for the
        standard itself.
    capped : int or None
        Of `less` the places where nothing faster was measured; None for the standard itself.
    note : Finding or None
        Of a map, at how many places it has no speed, and why; else what the model is.
    warnings : tuple of Finding
        What must be said before its speeds.
    """

    model: str
    limit: float
    contact: Contact
    limit_source: str
    places: int
    confirmed: int
    lowest: float
    median: float
    highest: float
    more: int | None
    less: int | None
    capped: int | None
    note: Finding | None
    warnings: tuple[Finding, ...] = ()


@dataclass(frozen=True)
class WorkspaceVariation:
    """How measured forces vary over the workspace at one speed.

    Parameters
    ----------
    speed : float
        The speed [m/s].
    states : int
        States measured at it.
    lowest, highest : float
        Extreme forces [N].
    rank_correlation_distance, rank_correlation_height : float
        Spearman's rank correlation of force with distance and with height; NaN where one of them is constant.
    """

    speed: float
    states: int
    lowest: float
    highest: float
    rank_correlation_distance: float
    rank_correlation_height: float

    @property
    def ratio(self) -> float:
        """Highest over lowest force."""
        return self.highest / self.lowest


@dataclass(frozen=True)
class Comparison:
    """Force models compared on the same states.

    Parameters
    ----------
    on : str
        Which states: test states, or every state left out in turn.
    models : tuple of ModelComparison
        The measured map first, the standard's contact model last.
    allowed : tuple of AllowedSpeed
        What the map, the 2D map and the standard allow.
    variation : WorkspaceVariation
        How forces vary over the workspace.
    bound : Bound
        The bound behind the maps' speeds.
    warnings : tuple of Finding
        What must be said before the measured map is used.
    statements : tuple of Finding
        What the comparison depends on.
    """

    on: str
    models: tuple[ModelComparison, ...]
    allowed: tuple[AllowedSpeed, ...]
    variation: WorkspaceVariation
    bound: Bound
    warnings: tuple[Finding, ...]
    statements: tuple[Finding, ...]


def compare_force_models(
    dataset: ImpactDataset,
    *,
    robot_mass: float,
    body_mass: float,
    stiffness: float,
    form: Form | None = None,
    bound: Bound | None = None,
    limit: ForceLimit | float | None = None,
    force_map: ForceMap | None = None,
) -> Comparison:
    """Compare the measured map with the 2D map and the standard's contact model on the same states.

    The maps are fitted to the states with role train and compared on those with role test; without enough, each
    state is predicted from the others. Impacts that are to confirm the map are among all states alone: they are made at
    its permitted speeds, where any model is better than over the range. The 2D map per height is fitted at each height
    to all states with a training speed, test ones too (paper, section V-C): it is for comparison only.

    Parameters
    ----------
    dataset : ImpactDataset
        The impacts.
    robot_mass : float
        Effective robot mass m_R [kg], see `pfl_robot_mass`.
    body_mass : float
        Effective mass of the body region [kg]; math.inf if the body part is constrained.
    stiffness : float
        Spring constant of the body region [N/m].
    form : Form, optional
        Form of the measured map; as in `fit_force_map` if not given.
    bound : Bound, optional
        Bound behind the maps' speeds; ToleranceBound() if not given.
    limit : ForceLimit or float, optional
        Limits of a body area (transient and quasi-static are both shown) or a force limit [N]; without it no
        speeds are compared.
    force_map : ForceMap, optional
        The measured map of these impacts, where it is at hand: its speeds say whether the campaign confirms them.

    Returns
    -------
    Comparison

    Raises
    ------
    FitError
        A map cannot be fitted.
    InputError
        A figure outside its range.
    ContactNotPermitted
        The standard permits no contact with the body area.
    """
    bound = bound or ToleranceBound()
    body = {"robot_mass": robot_mass, "body_mass": body_mass, "stiffness": stiffness}
    maps, models = compared_maps(dataset, form)
    if force_map is not None and force_map.form == maps[0].form:
        maps[0] = replace(maps[0], confirmed=force_map.confirmed)
    models.add_standard(body, dataset.conditions.device.stiffness)
    return models.comparison(maps, dataset, limit, bound, body)


def compared_maps(dataset: ImpactDataset, form: Form | None = None) -> tuple[list[ForceMap], Models]:
    """The measured map and the 2D map, and both with the 2D maps of single heights compared on the same states.

    Raises
    ------
    FitError
        A map cannot be fitted.
    """
    forms = dict.fromkeys((form_of(dataset.conditions, form), CFM_2D))
    maps = [fit_force_map(dataset, form=each) for each in forms]
    test = dataset.independent_test
    test = test.select(~np.char.startswith(test.state, CONFIRMING))
    has_test = int(np.sum(test.states.impacts > 0)) >= FEWEST_TESTS
    on = ON_TEST if has_test else "leave-one-state-out"
    states = test.states if has_test else maps[0].require_fit().states.uncensored
    every = dataset.select(~dataset.slower).states
    inside = [maps[0].measured_range.near(group.coordinates, dataset.tolerance.scale) for group in (states, every)]
    models = Models(states, on, every, outside=(~inside[0] if has_test else None, ~inside[1]))
    models.add_maps(maps, dataset, has_test)
    return maps, models


def _predictions(force_map: ForceMap, states: States, has_test: bool) -> FloatArray:
    """Force [N] that a map predicts at states; without test states, at its own states, each left out in turn."""
    if has_test:
        return np.asarray(force_map.predict(*states.coordinates.T))
    own = dict(zip(force_map.require_fit().states.name, left_out_predictions(force_map).tolist(), strict=True))
    return np.array([own.get(name, math.nan) for name in states.name])


def maps_per_height(dataset: ImpactDataset) -> dict[tuple[float, float], ForceMap]:
    """A 2D map for each measured height (lowest, highest [m]) whose states at training speeds determine one
    with one to spare."""
    height_of = dict(zip(dataset.states.name, dataset.states.height.tolist(), strict=True))
    height = np.array([height_of[name] for name in dataset.state])
    apart = np.abs(dataset.speed[:, None] - dataset.train.states.speed).min(axis=1)
    usable = (apart <= dataset.tolerance.speed) & ~dataset.censored
    heights, fitted = np.unique(height), {}
    for level in np.split(heights, np.flatnonzero(np.diff(heights) > dataset.tolerance.place) + 1):
        rows = dataset.select((height >= level[0]) & (height <= level[-1]) & usable)
        with contextlib.suppress(FitError):
            own = fit_force_map(replace(rows, role=np.full(len(rows), "train")), form=CFM_2D)
            if len(own.require_fit().states) > own.coefficients.size:  # else it passes through all of them
                fitted[float(level[0]), float(level[-1])] = own
    return fitted


@dataclass
class Models:
    """Force models, each compared on `states`, which are called `on`, and on every state.

    `outside` tells which of both lie outside the measured range of the map for all heights; None if that is not asked.
    """

    states: States
    on: str
    every: States
    outside: tuple[Mask | None, Mask | None] = (None, None)
    compared: list[ModelComparison] = field(default_factory=list)

    def add(self, name: str, predicted: FloatArray, at_all: FloatArray, note: Finding | None) -> None:
        """Compare a model's forces at `states` and at every state [N]; NaN where it has none."""
        known = ~np.isnan(predicted)
        if not known.any():
            raise InputError(f"found no state that {name} can be compared on ({self.on}), expected at least one")
        under, over = (_extreme(predicted[known], self.states.select(known), side) for side in (-1, 1))
        compared = _accuracy(predicted, self.states, self.on, self.outside[0])
        on_all = _accuracy(at_all, self.every, ALL_STATES, self.outside[1])
        self.compared.append(ModelComparison(name, compared, on_all, under, over, note))

    def add_maps(self, maps: Sequence[ForceMap], dataset: ImpactDataset, has_test: bool) -> None:
        """Compare maps for all heights, and the 2D maps of single heights; without test states each state is left out
        in turn."""
        own = maps_per_height(dataset)
        predicted, at_all = self._per_height(own, has_test)
        alone = bool(np.isnan(predicted).all())
        for force_map in maps:
            self._add_map(force_map, has_test, alone=alone)
        if not alone:
            without = int(np.sum(np.isnan(at_all) & (self.every.impacts > 0)))
            note = Finding.of(FindingKind.MAP_PER_HEIGHT, heights=len(own), without=without)
            self.add("CFM_2D per height", predicted, at_all, note)

    def _add_map(self, force_map: ForceMap, has_test: bool, *, alone: bool) -> None:
        figures = {"alone": alone, "coefficients": len(CFM_2D.terms)}
        note = Finding.of(FindingKind.ONE_MAP_FOR_HEIGHTS, **figures) if force_map.form == CFM_2D else None
        at_all = np.asarray(force_map.predict(*self.every.coordinates.T))
        self.add(force_map.form.name, _predictions(force_map, self.states, has_test), at_all, note)

    def _per_height(self, own: dict[tuple[float, float], ForceMap], has_test: bool) -> tuple[FloatArray, FloatArray]:
        """Forces [N] of the 2D maps of single heights, each at its own, at `states` and at every state; else NaN."""
        predicted, at_all = np.full(len(self.states), np.nan), np.full(len(self.every), np.nan)
        for (low, high), own_map in own.items():
            here, there = ((low <= group.height) & (group.height <= high) for group in (self.states, self.every))
            predicted[here] = _predictions(own_map, self.states.select(here), has_test)
            at_all[there] = own_map.predict(*self.every.select(there).coordinates.T)
        return predicted, at_all

    def add_standard(self, body: dict[str, float], spring: float) -> None:
        """Compare the standard's contact model, whose spring is the body part's, not that of the device [N/m]."""
        predicted, at_all = (pfl_contact_force(group.speed, **body) for group in (self.states, self.every))
        ratio = spring / body["stiffness"]
        springs = {"area_N_per_mm": body["stiffness"] / 1000, "times": math.sqrt(ratio)}
        springs["device_N_per_mm"] = spring / 1000 if abs(ratio - 1) > _SAME_SPRING else math.nan
        self.add("contact model", predicted, at_all, Finding.of(FindingKind.ONE_SPEED_FOR_WORKSPACE, **springs))

    def comparison(
        self,
        maps: Sequence[ForceMap],
        dataset: ImpactDataset,
        limit: ForceLimit | float | None,
        bound: Bound,
        body: dict[str, float],
    ) -> Comparison:
        """The comparison, with what `maps` and the standard allow at the places of a dataset."""
        masses = {"robot_mass_kg": body["robot_mass"], "body_mass_kg": body["body_mass"]}
        allowed = () if limit is None else tuple(_allowed(maps, dataset, limit, bound, body))
        of_map = (each.warnings for each in allowed if each.model == maps[0].form.name)
        return Comparison(
            on=self.on,
            models=tuple(self.compared),
            allowed=allowed,
            variation=_variation(dataset),
            bound=bound,
            warnings=tuple(dict.fromkeys(itertools.chain(*of_map, doubts_of_fit(maps[0])))),
            statements=(
                *maps[0].conditions.findings,
                maps[0].phase_two.finding,
                Finding.of(FindingKind.CONTACT_MODEL, **masses, stiffness_N_per_m=body["stiffness"]),
                Finding.of(FindingKind.PERSON_AT_REST),
                Finding.of(FindingKind.PRESSURE_NOT_ASSESSED),
            ),
        )


def _accuracy(predicted: FloatArray, states: States, on: str, outside: Mask | None) -> Accuracy:
    known = ~np.isnan(predicted)
    compared = Accuracy.of(predicted[known], states.select(known), on=on, skipped=int(np.sum(~known)))
    return replace(
        compared, outside_states=None if outside is None else int(np.sum(outside & known & (states.impacts > 0)))
    )


def _extreme(predicted: FloatArray, states: States, side: int) -> StateError | None:
    percent = 100 * (predicted / states.force - 1)
    i = int(np.nanargmax(side * percent))
    figures = (*states.coordinates[i], states.force[i], predicted[i], percent[i])
    return StateError(states.name[i], *map(float, figures)) if side * percent[i] > 0 else None


def _allowed(
    maps: Sequence[ForceMap], dataset: ImpactDataset, limit: ForceLimit | float, bound: Bound, body: dict[str, float]
) -> Iterator[AllowedSpeed]:
    places = np.unique(dataset.states.coordinates[:, :2], axis=0)
    nothing = (math.nan, math.nan, math.nan)
    if isinstance(limit, ForceLimit):
        cases = [(limit.force(contact), contact, f"{limit}, {contact}", len(places)) for contact in Contact]
    else:
        cases = [(limit, Contact.QUASI_STATIC, "given in newtons, counted as quasi-static", len(places))]
    for case in cases:
        newtons, contact = case[:2]
        standard = pfl_speed_limit(newtons, **body)
        for force_map in maps:
            try:
                speeds = safe_speed(force_map, *places.T, limit=limit, bound=bound, contact=contact)
            except (InputError, BoundNotAvailable) as error:
                yield AllowedSpeed(force_map.form.name, *case, 0, *nothing, 0, 0, 0, in_words(error.message))
                continue
            without = np.isnan(speeds.speed_to_program)
            confirmed = speeds.speed[~without]
            lowest, median, highest = np.quantile(confirmed, (0.0, 0.5, 1.0)).tolist() if confirmed.size else nothing
            refused = speeds.to_program_reason[without].tolist()
            more = int((confirmed > standard).sum())
            less, said, why = confirmed.size - more, speeds.basis.warnings, _without_speed(refused, len(places))
            capped = int(((confirmed <= standard) & (speeds.outcome[~without] == SpeedOutcome.CAPPED)).sum())
            if not confirmed.size:  # there is nothing to confirm
                said = tuple(each for each in said if each not in unconfirmed(said))
            yield AllowedSpeed(
                force_map.form.name, *case, confirmed.size, lowest, median, highest, more, less, capped, why, said
            )
        note = Finding.of(FindingKind.FORMULA)
        if isinstance(limit, ForceLimit) and contact is Contact.TRANSIENT:
            device_error = maps[0].conditions.device.error_or_default
            if refusal := maps[0].phase_two.transient_refusal(limit.quasi_static, device_error):
                note = note.and_(refusal)
        yield AllowedSpeed("contact model", *case, 0, standard, standard, standard, None, None, None, note)


def _without_speed(refused: Sequence[Finding], places: int) -> Finding | None:
    """At how many of the places there is no speed, and the reason of most; None if every place has one."""
    if not refused:
        return None
    most = max(refused, key=refused.count)
    figures = {"without": len(refused), "places": places, "others": len(refused) - refused.count(most)}
    return Finding.of(FindingKind.PLACES_WITHOUT_SPEED, most, **figures)


def _variation(dataset: ImpactDataset) -> WorkspaceVariation:
    """At the speed measured at most places; if there are several, over the widest area; of these the middle one."""
    states, tolerance = dataset.states.uncensored, dataset.tolerance.speed
    speeds = np.unique(np.round(states.speed / tolerance)) * tolerance
    near = np.abs(states.speed - speeds[:, None]) <= tolerance
    area = [np.ptp(states.distance[level]) * np.ptp(states.height[level]) for level in near]
    wide = near.sum(axis=1) + np.round(area / (1 + np.max(area)), 9)
    most = np.flatnonzero(wide == wide.max())
    chosen = states.select(near[most[most.size // 2]])
    return WorkspaceVariation(
        speed=float(np.median(chosen.speed)),
        states=len(chosen),
        lowest=float(chosen.force.min()),
        highest=float(chosen.force.max()),
        rank_correlation_distance=rank_correlation(chosen.distance, chosen.force),
        rank_correlation_height=rank_correlation(chosen.height, chosen.force),
    )


def rank_correlation(one: FloatArray, other: FloatArray) -> float:
    """Spearman's, of two arrays of shape (n,); NaN where one of them is constant to nine digits."""
    if any(np.ptp(values) <= 1e-9 * np.abs(values).max() for values in (one, other)):
        return math.nan
    return float(np.corrcoef(_ranks(one), _ranks(other))[0, 1])


def _ranks(values: FloatArray) -> FloatArray:
    """Ranks from 1 on, shape (n,); values that are equal share the mean of theirs."""
    order = np.sort(values)
    return np.asarray((np.searchsorted(order, values) + np.searchsorted(order, values, side="right") + 1) / 2)
