"""Does a map still hold for new impacts?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import ImpactDataset, States
from forcemap.comparisons.residual_tests import MEAN_SHARE, POWER, STATES_SHARE, WHOLE_SHARE, ResidualTests, interval
from forcemap.comparisons.two_maps import differences
from forcemap.errors import BoundNotAvailable, InputError
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.limits.device_spring import device_suitability
from forcemap.maps.bounds import MIN_DEGREES_OF_FREEDOM
from forcemap.maps.fit import repeat_variance
from forcemap.maps.force_map import Fit, ForceMap

MIN_STATES = 3
"""New states below which a map is not said to hold."""

LEAST_SPAN = 0.3
"""Share of the measured range, along each coordinate, that new states must span before a map is said to hold."""

RELEVANT_CHANGE = 0.10
"""Mean change of the force (the paper's margin) that impacts must be able to show before a map is said to hold."""

_OWN = "the map was fitted to it"
_BEYOND = "outside the measured range of the map"
_NAMED = 6  # states named in the reason
_KEEP = "keep the map; check again after the next change of firmware, tool or safety settings"
_MEASURE_MORE = (
    "measure more states, inside the measured range of the map and below the device range, and check again; until then "
    "this is no permission"
)
_MEASURE_CENSORED = (
    "measure the censored states with a larger device range or at a lower speed, and check again; until then this is "
    "no permission"
)
_MEASURE_AGAIN = (
    "take no speed from this map; look at the recordings of the states that differ most and measure them again, then "
    "fit a new map to new impacts if they stay"
)
_NEW_MAP = "take no speed from this map; measure a new campaign (plan, collect) and fit a new map to it"
_HIDDEN = (
    "the uncensored states differ from the map, but with the censored ones, known only as lower bounds, no change is "
    "found"
)
_FLAT = 0.011  # a coordinate that varies no more than repeats of a state may is not varied [m, m/s]
_LEAST_SD = 1e-6  # of ln F; below it figures are computed, not measured


class MapOutcome(StrEnum):
    """What new impacts say of a map."""

    HOLDS = "holds"
    DOES_NOT_HOLD = "does_not_hold"
    CANNOT_TELL = "cannot_tell"


@dataclass(frozen=True)
class NewState:
    """A new state.

    Parameters
    ----------
    state : str
        Its name.
    distance, height, speed : float
        Where it was measured [m], [m], [m/s].
    """

    state: str
    distance: float
    height: float
    speed: float


@dataclass(frozen=True)
class StateCheck(NewState):
    """A new state beside what the map expects there.

    Parameters
    ----------
    measured : float
        Geometric mean of the peak forces of its repeats [N]; a lower bound if any is censored.
    censored : int
        How many of its repeats are censored.
    predicted, lowest_expected, highest_expected : float
        Force predicted [N], and the range in which all new states together lie with the probability that the check
        leaves them, if nothing has changed [N].
    ratio : float
        Measured over predicted; above 1 is the dangerous side.
    p_value : float
        Two-sided, adjusted for the number of states (Holm 1979).
    moved : bool
        True if that is at most the share of the error probability left for single states.
    """

    measured: float
    censored: int
    predicted: float
    lowest_expected: float
    highest_expected: float
    ratio: float
    p_value: float
    moved: bool


@dataclass(frozen=True)
class LeftOutState(NewState):
    """A new state that does not count, and why.

    Parameters
    ----------
    reason : str
        Why, in words; the same words for the same cause.
    """

    reason: str


@dataclass(frozen=True)
class MapCheck:
    """Whether a map still holds for new impacts.

    Parameters
    ----------
    outcome : MapOutcome
        What they say.
    reason : Finding or str
        Why, in words.
    next_step : str
        What to do now, in words.
    mean_ratio, mean_ratio_low, mean_ratio_high : float
        Geometric mean of measured over predicted force, and its confidence interval; above 1 is the dangerous side.
        A lower bound if any state is censored. NaN without a state that counts.
    confidence : float
        Of that interval.
    p_mean, p_whole : float
        Two-sided p values: of the mean change, and of all states together.
    detectable_change : float
        Smallest mean change that these states, censored ones not counted, would have found with 95 % probability, as a
        share of the force; infinite without such a state.
    error_probability : float
        Probability of "does not hold" if nothing has changed, at most.
    states : tuple of StateCheck
        The states that count, in the order of the table.
    left_out : tuple of LeftOutState
        The others, too.
    statements : tuple of (Finding or str)
        What the outcome depends on, a line each.
    """

    outcome: MapOutcome
    reason: Finding | str
    next_step: str
    mean_ratio: float
    mean_ratio_low: float
    mean_ratio_high: float
    confidence: float
    p_mean: float
    p_whole: float
    detectable_change: float
    error_probability: float
    states: tuple[StateCheck, ...]
    left_out: tuple[LeftOutState, ...]
    statements: tuple[Finding | str, ...]

    @property
    def moved(self) -> tuple[StateCheck, ...]:
        """The states that moved significantly as single states."""
        return tuple(state for state in self.states if state.moved)


def check_map(force_map: ForceMap, dataset: ImpactDataset, *, error_probability: float = 0.05) -> MapCheck:
    """Check whether a map still holds for new impacts, after a change of firmware, tool or safety settings or in time.

    With r the mean ln F of the new states less the prediction, r ~ N(0, s^2 (I + X_n (X'X)^-1 X_n')) if nothing has
    changed, s being the state SD of the map: new states have a state effect of their own. Three tests share the error
    probability: the mean of r (t test, half), r as a whole (F test, a quarter), each state (t tests, Holm, a quarter).

    `holds` needs more than no finding: at least 3 uncensored states inside the measured range, which would have shown
    a mean change of 10 % with 95 % probability, and no more than half of the new states left out. Otherwise nothing
    found is `cannot tell`.

    States outside the measured range, by more than repeats of a state may differ, are left out; so are those predicted
    at or above the device range, of which only the low ones could be read. Other censored impacts count as the force
    they reached at least.

    Parameters
    ----------
    force_map : ForceMap
        A fitted map.
    dataset : ImpactDataset
        The new impacts, of every role.
    error_probability : float
        Probability of `does not hold` if nothing has changed, above 0 and below 0.5.

    Returns
    -------
    MapCheck

    Raises
    ------
    InputError
        No impact, an error probability outside its range, or the impacts that the map was fitted to.
    BoundNotAvailable
        The map has no measured states, or too few to tell how far states scatter.
    """
    if not 0 < error_probability < 0.5:
        raise InputError(f"error probability: found {error_probability:g}, expected above 0 and below 0.5")
    fit = _fit_of(force_map)
    if not len(dataset):
        raise InputError("found no impact to check the map with, expected some", file=dataset.source or None)
    # in the order of the first impact of each in the table: a person compares them with it
    states = dataset.states.select(np.argsort([dataset.state.tolist().index(name) for name in dataset.states.name]))
    left_out = _left_out(force_map, dataset, states, _own(fit, dataset))
    states = states.select(~np.isin(states.name, [each.state for each in left_out]))
    predicted = np.log(force_map.predict(*states.coordinates.T))
    measured = np.array([np.log(dataset.peak_force[dataset.state == name]).mean() for name in states.name])
    residual = measured - predicted
    covariance = _covariance(force_map, fit, dataset, states)
    freedom = fit.between_states.degrees_of_freedom
    tests = ResidualTests.of(residual, covariance, freedom, error_probability)
    whole = np.flatnonzero(states.censored == 0)
    of_whole = ResidualTests.of(residual[whole], covariance[np.ix_(whole, whole)], freedom, error_probability)
    narrow = _narrow(force_map, states.coordinates[whole])
    outcome, reason, next_step = _outcome(tests, of_whole, len(left_out), error_probability, narrow)
    if outcome is MapOutcome.HOLDS and (against := _not_comparable(force_map, dataset)):
        outcome, reason, next_step = MapOutcome.CANNOT_TELL, against, "mend that, then check again"
    low, high = interval(tests.mean, tests.mean_sd, freedom, MEAN_SHARE * error_probability)
    spread = np.sqrt(np.diag(covariance))
    expected = interval(predicted, spread, freedom, STATES_SHARE * error_probability / max(len(states), 1))
    moved = tests.p_states <= STATES_SHARE * error_probability
    forces = np.exp([measured, predicted, *expected, residual])
    figures = (*states.coordinates.T, forces[0], states.censored, *forces[1:], tests.p_states, moved)
    checked = [StateCheck(*each) for each in zip(states.name, *(figure.tolist() for figure in figures), strict=True)]
    if names := [each.state for each in checked if each.moved]:
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        words = f"moved significantly as single states: {', '.join(names[:_NAMED])}{more}"
        reason = reason.and_(in_words(words)) if isinstance(reason, Finding) else f"{reason}; {words}"
    return MapCheck(
        outcome=outcome,
        reason=reason,
        next_step=next_step,
        mean_ratio=math.exp(tests.mean),
        mean_ratio_low=math.exp(low),
        mean_ratio_high=math.exp(high),
        confidence=1 - MEAN_SHARE * error_probability,
        p_mean=tests.p_mean,
        p_whole=tests.p_whole,
        detectable_change=math.expm1(of_whole.detectable),
        error_probability=error_probability,
        states=tuple(checked),
        left_out=left_out,
        statements=_check_statements(force_map, fit, dataset, states, error_probability),
    )


def _not_comparable(force_map: ForceMap, dataset: ImpactDataset) -> Finding | str:
    """Why no agreement of the new impacts with the map may count; empty if nothing speaks against it."""
    for of, binding in (("the map", force_map.binding), ("the new impacts", dataset.binding)):
        if binding.refusal:
            return Finding.of(FindingKind.BINDING_OF, binding.refusal, of=of)
    then, now = force_map.conditions.device.stiffness, dataset.conditions.device.stiffness
    if not (math.isnan(then) or math.isnan(now)) and device_suitability("the map", then, now).refusal:
        return (
            f"the new impacts were measured with a device of {now / 1000:g} N/mm, the map with one of {then / 1000:g} "
            "N/mm: a softer spring hides a force that rose"
        )
    return ""


def _fit_of(force_map: ForceMap) -> Fit:
    fit = force_map.fit
    if fit is None:
        raise BoundNotAvailable(
            f"map {force_map.name!r} has no measured states, so nothing tells how far new ones may lie from it; "
            "fit a map to your own impacts"
        )
    freedom = fit.between_states.degrees_of_freedom
    if freedom < MIN_DEGREES_OF_FREEDOM:
        raise BoundNotAvailable(
            f"found {freedom:.1f} residual degrees of freedom ({len(fit.states)} measured states, "
            f"{force_map.coefficients.size} coefficients), expected at least {MIN_DEGREES_OF_FREEDOM}; "
            "fit a map to more states"
        )
    return fit


def _own(fit: Fit, dataset: ImpactDataset) -> list[str]:
    """States of the map itself among the new ones: they agree with it by construction.

    Raises
    ------
    InputError
        The table is the map's own, or half of it.
    """
    own, new = (
        [(*place, force) for place, force in zip(each.coordinates.tolist(), each.log_force.tolist(), strict=True)]
        for each in (fit.states, dataset.states)
    )
    copies = [name for name, state in zip(dataset.states.name, new, strict=True) if state in own]
    same_table = bool(dataset.sha256) and dataset.sha256 == fit.table_sha256
    # one state may agree to the last digit by chance
    if same_table or (len(copies) > 1 and 2 * len(copies) >= len(new)):
        raise InputError(
            f"found impacts that the map was fitted to ({len(copies)} states are the same), expected new ones",
            file=dataset.source or None,
        )
    return copies


def _left_out(force_map: ForceMap, dataset: ImpactDataset, states: States, own: list[str]) -> tuple[LeftOutState, ...]:
    """States that do not count, and why."""
    facets = force_map.measured_range.facets
    allowed = np.abs(facets[:, :3]) @ dataset.tolerance.scale  # how far repeats of a state may lie across each facet
    beyond = np.any(states.coordinates @ facets[:, :3].T + facets[:, 3] > allowed, axis=1)
    unread = force_map.predict(*states.coordinates.T) >= dataset.device_range
    why_unread = f"predicted at or above the device range of {dataset.device_range:g} N: only a lower force can be read"
    why = np.select([np.isin(states.name, own), beyond, unread], [_OWN, _BEYOND, why_unread], default="")
    found = zip(states.name, *states.coordinates.T.tolist(), why.tolist(), strict=True)
    return tuple(LeftOutState(*each) for each in found if each[-1])


def _covariance(force_map: ForceMap, fit: Fit, dataset: ImpactDataset, states: States) -> FloatArray:
    """Covariance of new state means less predictions: state effects, and the map's own error, which they share."""
    rotated = force_map.form.design(*states.coordinates.T) @ fit.between_states.inverse_triangle
    deviation = max(fit.state_sd, _LEAST_SD)
    # A mean of fewer repeats than the map's carries more repeat noise than its state SD holds.
    of_map = float(np.mean(1 / (fit.states.impacts + fit.states.censored)))
    fewer = np.maximum(1 / (states.impacts + states.censored) - of_map, 0.0)
    noise = repeat_variance(dataset) if not dataset.censored.all() else 0.0
    return np.asarray(deviation**2 * (np.eye(len(states)) + rotated @ rotated.T) + noise * np.diag(fewer))


def _outcome(
    tests: ResidualTests, of_whole: ResidualTests, left_out: int, error_probability: float, narrow: str
) -> tuple[MapOutcome, Finding | str, str]:
    """What the tests of all states that count, and of the uncensored ones among them, say; and what to do."""
    counted, whole = tests.p_states.size, of_whole.p_states.size
    if tests.changed(error_probability):
        amount, side = f"{abs(100 * math.expm1(tests.mean)):.1f} %", "higher" if tests.mean > 0 else "lower"
        if tests.p_mean > MEAN_SHARE * error_probability:
            reason = f"forces are {amount} {side} on average, but not everywhere alike"
            return MapOutcome.DOES_NOT_HOLD, reason, _MEASURE_AGAIN
        bound, danger = "at least " if counted > whole else "", ", the dangerous side" if tests.mean > 0 else ""
        reason = f"forces are on average {bound}{amount} {side} than predicted{danger}"
        return MapOutcome.DOES_NOT_HOLD, reason, _NEW_MAP
    change, step = math.expm1(of_whole.detectable), _MEASURE_MORE
    power = f"would have been found with {100 * POWER:.0f} % probability"
    if whole < MIN_STATES:
        but = f"only {whole} uncensored states count, expected at least {MIN_STATES}"
    elif not change <= RELEVANT_CHANGE:
        but = f"only one of {100 * change:.0f} % or more {power}, expected at most {100 * RELEVANT_CHANGE:.0f} %"
    elif of_whole.changed(error_probability):
        return MapOutcome.CANNOT_TELL, _HIDDEN, _MEASURE_CENSORED
    elif counted > whole:
        but = f"{counted - whole} states are known only to be at least what the device measures"
        step = _MEASURE_CENSORED
    elif narrow:
        but = f"the new states lie close together: they span little of the map's {narrow}"
    elif left_out > counted:
        but = f"{left_out} of {left_out + counted} states, more than half, are left out"
    else:
        return MapOutcome.HOLDS, f"no change found; one of {100 * change:.1f} % on average {power}", _KEEP
    return MapOutcome.CANNOT_TELL, f"no change found, but {but}", step


def _narrow(force_map: ForceMap, coordinates: FloatArray) -> str:
    """The coordinates of which the new states span less than LEAST_SPAN of the measured range, in words."""
    extent = force_map.measured_range.highest - force_map.measured_range.lowest
    span = np.ptp(coordinates, axis=0) if len(coordinates) else np.zeros(3)
    short = (extent > _FLAT) & (span < LEAST_SPAN * extent)
    return " and ".join(np.array(["distances", "heights", "speeds"])[short])


def _check_statements(
    force_map: ForceMap, fit: Fit, dataset: ImpactDataset, states: States, error_probability: float
) -> tuple[Finding | str, ...]:
    simulated = dataset.simulated or force_map.simulated
    bindings = (("the map", force_map.binding), ("the new impacts", dataset.binding))
    not_stated = math.isnan(dataset.conditions.device.stiffness)
    percent = 100 * error_probability
    fewest = int(np.min(states.impacts + states.censored, initial=fit.repeats[0]))
    error = float(np.fmax(dataset.conditions.device.error_or_default, force_map.conditions.device.error_or_default))
    saturated = [name for name, n in zip(states.name, states.censored, strict=True) if n]
    at_least = f"impacts above the device range count as at least that force: {', '.join(saturated)}"
    fewer = f"states with {fewest} impacts, the map's have {fit.repeats[0]}: repeat noise taken from the new impacts"
    return (
        *([Finding.of(FindingKind.SIMULATED)] if simulated else []),
        *(Finding.of(FindingKind.BINDING_OF, each.reason, of=of) for of, each in bindings if each.reason),
        *(["the spring of the device that the new impacts were measured with is not stated"] if not_stated else []),
        f"map: {force_map.source}, {force_map.form.name}, {len(fit.states)} states, state-to-state SD "
        f"{100 * fit.state_sd:.2f} % with {fit.between_states.degrees_of_freedom:.1f} degrees of freedom",
        f"error probability {percent:g} % in all: {percent * MEAN_SHARE:g} % for the mean, {percent * WHOLE_SHARE:g} % "
        f"for all states together, {percent * STATES_SHARE:g} % for single states",
        "a new state is taken to scatter about the map as its own states do; repeats of a state share that",
        f"the error of the device, up to {error:g} N, is not part of the test: measure with the same device",
        *([fewer] if fewest < fit.repeats[0] else []),
        *([at_least] if saturated else []),
        *differences(force_map.conditions, dataset.conditions, ("map", "new")),
    )
