"""Does a map still hold for new impacts?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from forcemap.campaigns.dataset import ImpactDataset, States
from forcemap.changes.differences import differences
from forcemap.changes.residual_tests import (
    MEAN_SHARE,
    POWER,
    STATES_SHARE,
    WHOLE_SHARE,
    ResidualTests,
    interval,
    residual_tests,
)
from forcemap.errors import BoundNotAvailable, InputError
from forcemap.maps.bounds import MIN_DEGREES_OF_FREEDOM
from forcemap.maps.fit import repeat_variance
from forcemap.maps.force_map import Fit, ForceMap

FloatArray = NDArray[np.float64]

MIN_STATES = 3
"""New states below which a map is not said to hold."""

RELEVANT_CHANGE = 0.10
"""Mean change of the force (the paper's margin) that impacts must be able to show before a map is said to hold."""

_NAMED = 6  # states named in the reason
_LEAST_SD = 1e-6  # of ln F; below it figures are computed, not measured


class MapOutcome(StrEnum):
    """What new impacts say of a map."""

    HOLDS = "holds"
    DOES_NOT_HOLD = "does_not_hold"
    CANNOT_TELL = "cannot_tell"


@dataclass(frozen=True)
class StateCheck:
    """A new state beside what the map expects there.

    Parameters
    ----------
    state : str
        Its name.
    distance, height, speed : float
        Where it was measured [m], [m], [m/s].
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

    state: str
    distance: float
    height: float
    speed: float
    measured: float
    censored: int
    predicted: float
    lowest_expected: float
    highest_expected: float
    ratio: float
    p_value: float
    moved: bool


@dataclass(frozen=True)
class LeftOutState:
    """A new state that does not count, and why.

    Parameters
    ----------
    state : str
        Its name.
    reason : str
        Why, in words.
    """

    state: str
    reason: str


@dataclass(frozen=True)
class MapCheck:
    """Whether a map still holds for new impacts.

    Parameters
    ----------
    outcome : MapOutcome
        What they say.
    reason : str
        Why, in words.
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
        The states that count.
    left_out : tuple of LeftOutState
        The others.
    statements : tuple of str
        What the outcome depends on, a line each.
    """

    outcome: MapOutcome
    reason: str
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
    statements: tuple[str, ...]

    @property
    def moved(self) -> tuple[StateCheck, ...]:
        """The states that moved by themselves."""
        return tuple(state for state in self.states if state.moved)


def check_map(force_map: ForceMap, dataset: ImpactDataset, *, error_probability: float = 0.05) -> MapCheck:
    """Check whether a map still holds for new impacts, after a change of firmware, tool or safety settings or in time.

    With r the mean ln F of the new states less the prediction, r ~ N(0, s^2 (I + X_n (X'X)^-1 X_n')) if nothing has
    changed, s being the state SD of the map: new states have a state effect of their own. Three tests share the error
    probability: the mean of r (t test, half), r as a whole (F test, a quarter), each state (t tests, Holm, a quarter).

    `holds` needs more than no finding: at least 3 uncensored states inside the measured range, which would have shown
    a mean change of 10 % with 95 % probability. Otherwise nothing found is `cannot tell`.

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
    states = dataset.states
    _refuse_own(fit, dataset)
    left_out = _left_out(force_map, dataset)
    counts = np.array([name not in left_out for name in states.name])
    states = states.select(counts)
    predicted = np.log(force_map.predict(states.distance, states.height, states.speed))
    measured = _at_least_levels(dataset, states)
    residual = measured - predicted
    covariance = _covariance(force_map, fit, dataset, states)
    freedom = fit.between_states.degrees_of_freedom
    tests = residual_tests(residual, covariance, freedom, error_probability)
    whole = np.flatnonzero(states.censored == 0)
    of_whole = residual_tests(residual[whole], covariance[np.ix_(whole, whole)], freedom, error_probability)
    outcome, reason = _outcome(tests, of_whole, whole.size, error_probability)
    low, high = interval(tests.mean, tests.mean_sd, freedom, MEAN_SHARE * error_probability)
    spread = np.sqrt(np.diag(covariance))
    lowest, highest = interval(predicted, spread, freedom, STATES_SHARE * error_probability / max(len(states), 1))
    moved = tests.p_states <= STATES_SHARE * error_probability
    checked = tuple(
        StateCheck(
            state=name,
            distance=float(states.distance[i]),
            height=float(states.height[i]),
            speed=float(states.speed[i]),
            measured=math.exp(measured[i]),
            censored=int(states.censored[i]),
            predicted=math.exp(predicted[i]),
            lowest_expected=math.exp(lowest[i]),
            highest_expected=math.exp(highest[i]),
            ratio=math.exp(residual[i]),
            p_value=float(tests.p_states[i]),
            moved=bool(moved[i]),
        )
        for i, name in enumerate(states.name)
    )
    if moved.any():
        names = [each.state for each in checked if each.moved]
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        reason += f"; moved by themselves: {', '.join(names[:_NAMED])}{more}"
    return MapCheck(
        outcome=outcome,
        reason=reason,
        mean_ratio=math.exp(tests.mean),
        mean_ratio_low=math.exp(low),
        mean_ratio_high=math.exp(high),
        confidence=1 - MEAN_SHARE * error_probability,
        p_mean=tests.p_mean,
        p_whole=tests.p_whole,
        detectable_change=math.expm1(of_whole.detectable),
        error_probability=error_probability,
        states=checked,
        left_out=tuple(LeftOutState(*each) for each in left_out.items()),
        statements=_check_statements(force_map, fit, dataset, states, error_probability),
    )


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
            f"found {freedom:.4g} residual degrees of freedom ({len(fit.states)} measured states, "
            f"{force_map.coefficients.size} coefficients), expected at least {MIN_DEGREES_OF_FREEDOM}; "
            "fit a map to more states"
        )
    return fit


def _refuse_own(fit: Fit, dataset: ImpactDataset) -> None:
    """Impacts that the map was fitted to agree with it by construction."""
    own = {
        (*place, force)
        for place, force in zip(fit.states.coordinates.tolist(), fit.states.log_force.tolist(), strict=True)
    }
    states = dataset.states
    new = zip(states.coordinates.tolist(), states.log_force.tolist(), strict=True)
    copies = [name for name, (place, force) in zip(states.name, new, strict=True) if (*place, force) in own]
    same_table = bool(dataset.sha256) and dataset.sha256 == fit.table_sha256
    # one state may agree to the last digit by chance
    if same_table or (len(copies) > 1 and 2 * len(copies) >= len(states)):
        raise InputError(
            f"found impacts that the map was fitted to ({len(copies)} states are the same), expected new ones",
            file=dataset.source or None,
        )


def _left_out(force_map: ForceMap, dataset: ImpactDataset) -> dict[str, str]:
    """States that do not count, and why."""
    states, left_out = dataset.states, {}
    facets = force_map.measured_range.facets
    allowed = np.abs(facets[:, :3]) @ dataset.tolerance.scale  # how far repeats of a state may lie across each facet
    beyond = np.any(states.coordinates @ facets[:, :3].T + facets[:, 3] > allowed, axis=1)
    predicted = force_map.predict(states.distance, states.height, states.speed)
    figures = (states.name, states.coordinates.tolist(), beyond.tolist(), predicted.tolist())
    for name, (d, h, v), outside, force in zip(*figures, strict=True):
        if outside:
            left_out[name] = f"outside the measured range of the map (d {d:g} m, h {h:g} m, v {v:g} m/s)"
        elif force >= dataset.device_range:
            left_out[name] = (
                f"predicted {force:.0f} N, at or above the device range of {dataset.device_range:g} N: only a "
                "lower force could be read"
            )
    return left_out


def _at_least_levels(dataset: ImpactDataset, states: States) -> FloatArray:
    """Mean ln F of states, censored repeats with the force they reached at least."""
    log_force = np.log(dataset.peak_force)
    return np.array([log_force[dataset.state == name].mean() for name in states.name])


def _covariance(force_map: ForceMap, fit: Fit, dataset: ImpactDataset, states: States) -> FloatArray:
    """Covariance of new state means less predictions: state effects, and the map's own error, which they share."""
    design = force_map.form.design(states.distance, states.height, states.speed)
    rotated = design @ fit.between_states.inverse_triangle
    deviation = max(fit.state_sd, _LEAST_SD)
    # A mean of fewer repeats than the map's carries more repeat noise than its state SD holds.
    of_map = float(np.mean(1 / (fit.states.impacts + fit.states.censored)))
    fewer = np.maximum(1 / (states.impacts + states.censored) - of_map, 0.0)
    noise = repeat_variance(dataset) if not dataset.censored.all() else 0.0
    return np.asarray(deviation**2 * (np.eye(len(states)) + rotated @ rotated.T) + noise * np.diag(fewer))


def _outcome(
    tests: ResidualTests, of_whole: ResidualTests, whole: int, error_probability: float
) -> tuple[MapOutcome, str]:
    """What the tests of all states that count, and of the uncensored ones among them, say."""
    if tests.changed(error_probability):
        percent = 100 * math.expm1(tests.mean)
        if tests.p_mean > MEAN_SHARE * error_probability:
            return MapOutcome.DOES_NOT_HOLD, f"forces are {_signed(percent)} on average, but not everywhere alike"
        side = "higher than predicted, the dangerous side" if percent > 0 else "lower than predicted"
        bound = "at least " if tests.p_states.size > whole else ""
        return MapOutcome.DOES_NOT_HOLD, f"forces are on average {bound}{abs(percent):.1f} % {side}"
    if whole < MIN_STATES:
        return MapOutcome.CANNOT_TELL, (
            f"no change found, but only {whole} uncensored states count, expected at least {MIN_STATES}; measure more"
        )
    change = math.expm1(of_whole.detectable)
    if not change <= RELEVANT_CHANGE:
        return MapOutcome.CANNOT_TELL, (
            f"no change found, but only one of {100 * change:.0f} % or more would have been found with "
            f"{100 * POWER:.0f} % probability, expected at most {100 * RELEVANT_CHANGE:.0f} %; measure more states"
        )
    if of_whole.changed(error_probability):
        return MapOutcome.CANNOT_TELL, (
            "the uncensored states differ from the map, but with the censored ones, known only as lower bounds, no "
            "change is found; measure them with a larger device range or at a lower speed"
        )
    return MapOutcome.HOLDS, (
        f"no change found; one of {100 * change:.1f} % on average would have been found with {100 * POWER:.0f} % "
        "probability"
    )


def _signed(percent: float) -> str:
    return f"{abs(percent):.1f} % {'higher' if percent > 0 else 'lower'}"


def _check_statements(
    force_map: ForceMap, fit: Fit, dataset: ImpactDataset, states: States, error_probability: float
) -> tuple[str, ...]:
    simulated = dataset.simulated or force_map.simulated
    percent = 100 * error_probability
    fewest = int(np.min(states.impacts + states.censored, initial=fit.repeats[0]))
    error = float(np.fmax(dataset.conditions.device.error_or_default, force_map.conditions.device.error_or_default))
    saturated = [name for name, n in zip(states.name, states.censored, strict=True) if n]
    return (
        *(["SIMULATED impacts: not a measurement of any robot"] if simulated else []),
        f"map: {force_map.source}, {force_map.form.name}, {len(fit.states)} states, state-to-state SD "
        f"{100 * fit.state_sd:.2f} % with {fit.between_states.degrees_of_freedom:.4g} degrees of freedom",
        f"error probability {percent:g} % in all: {percent * MEAN_SHARE:g} % for the mean, {percent * WHOLE_SHARE:g} % "
        f"for all states together, {percent * STATES_SHARE:g} % for single states",
        "a new state is taken to scatter about the map as its own states do; repeats of a state share that",
        f"the error of the device, up to {error:g} N, is not part of the test: measure with the same device",
        *(
            [f"states with {fewest} impacts, the map's have {fit.repeats[0]}: repeat noise taken from the new impacts"]
            if fewest < fit.repeats[0]
            else []
        ),
        *(
            [f"impacts above the device range count as at least that force: {', '.join(saturated)}"]
            if saturated
            else []
        ),
        *differences(force_map.conditions, dataset.conditions, ("map", "new")),
    )
