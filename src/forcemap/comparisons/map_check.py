"""Does a map still hold for new impacts?"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import ImpactDataset, States
from forcemap.campaigns.state import places
from forcemap.comparisons.residual_tests import MEAN_SHARE, POWER, STATES_SHARE, WHOLE_SHARE, ResidualTests, interval
from forcemap.comparisons.two_maps import differences
from forcemap.errors import BoundNotAvailable, InputError
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.limits.device_spring import device_suitability
from forcemap.maps.bounds import FixedMargin, ToleranceBound
from forcemap.maps.fit import repeat_variance
from forcemap.maps.force_map import Fit, ForceMap
from forcemap.maps.places import correlations
from forcemap.maps.slower_impacts import slower_above, slower_impacts
from forcemap.speeds.basis import of_quantity

MIN_STATES = 3
"""New states below which a map is not said to hold."""

LEAST_SPAN = 0.3
"""Share of the measured range that new states must span in each coordinate before a map is said to hold: a choice."""

RELEVANT_CHANGE = FixedMargin().margin
"""Mean change of the force (the paper's margin) that impacts must be able to show before a map is said to hold."""

# A coordinate that varies no more counts as constant [m, m/s]: a tenth above the 10 mm/s by which repeats may differ.
_CONSTANT_WITHIN = 0.011
_LEAST_SD = 1e-6  # of ln F; below it figures are computed, not measured
_ERROR_PROBABILITY_BELOW = 0.5  # above it a confidence of 0.95 was typed, or a coin would do as well


class MapOutcome(StrEnum):
    """Whether a map still holds for new impacts."""

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
        Force predicted, and the range within which all new states lie together, if nothing has changed, but for the
        share of the error probability left for single states [N].
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
    reason : Finding
        Why; the same for the same cause.
    """

    reason: Finding


@dataclass(frozen=True)
class MapCheck:
    """Whether a map still holds for new impacts.

    Parameters
    ----------
    outcome : MapOutcome
        Whether it holds.
    reason : Finding
        Why.
    next_step : Finding
        What to do now.
    mean_ratio, mean_ratio_low, mean_ratio_high : float
        Geometric mean of measured over predicted force, and its confidence interval; above 1 is the dangerous side.
        A lower bound if any state is censored. NaN without a state that counts.
    confidence : float
        Confidence of that interval.
    p_mean, p_whole : float
        Two-sided p values: of the mean change, and of all states together.
    detectable_change : float
        Smallest mean change that these states, censored ones not counted, would have found with 95 % probability, as a
        share of the force; infinite without such a state.
    error_probability : float
        Largest probability of "does not hold" if nothing has changed.
    states : tuple of StateCheck
        The states that count, in the order of the table.
    left_out : tuple of LeftOutState
        The states that do not count.
    statements : tuple of Finding
        What the outcome depends on.
    """

    outcome: MapOutcome
    reason: Finding
    next_step: Finding
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
    statements: tuple[Finding, ...]

    @property
    def moved(self) -> tuple[StateCheck, ...]:
        """The states that moved significantly as single states."""
        return tuple(state for state in self.states if state.moved)


def check_map(force_map: ForceMap, dataset: ImpactDataset, *, error_probability: float = 0.05) -> MapCheck:
    """Check whether a map still holds for new impacts, after a change of firmware, tool or safety settings or in time.

    The maps of other quantities that go with it are checked, too, and share the error probability with it: it holds if
    all of them do. Figures and states of the result are those of the force.

    With r the mean ln F of the new states less the prediction, r ~ N(0, s^2 (V_n + X_n (X'V^-1 X)^-1 X_n')) if nothing
    has changed, s being the state SD of the map: new states have an effect of their own, and share one with those of
    their place (V_n: 1 on the diagonal, rho of the map within a place). Three tests share the error
    probability: the mean of r (t test, half), r as a whole (F test, a quarter), each state (t tests, Holm, a quarter).

    New impacts that clamp, or are of undetermined scenario, where none of the map's is, contradict it whatever their
    peaks: it was to hold for transient limits, too.

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
    if not 0 < error_probability < _ERROR_PROBABILITY_BELOW:
        raise InputError(
            f"error probability: found {error_probability:g}, expected above 0 and below {_ERROR_PROBABILITY_BELOW:g}"
        )
    share = error_probability / (1 + len(force_map.others))
    found = _check_quantity(force_map, dataset, share)
    for other in force_map.others:
        outcome, reason, next_step = _of_other(other, dataset, share)
        said = of_quantity(other.quantity, reason)
        found = replace(found, statements=(*found.statements, said))
        if _GRAVITY.index(outcome) > _GRAVITY.index(found.outcome):
            found = replace(found, outcome=outcome, reason=said, next_step=next_step)
    return replace(_with_phase_two(found, force_map, dataset), error_probability=error_probability)


def _with_phase_two(found: MapCheck, force_map: ForceMap, dataset: ImpactDataset) -> MapCheck:
    """The same check with what the new impacts show of Phase II: that they clamp now, or that their forces sink."""
    if clamps := _clamps(force_map, dataset):
        outcome, next_step = MapOutcome.DOES_NOT_HOLD, Finding.of(FindingKind.MEASURE_NEW_MAP)
        reason = found.reason.and_(clamps) if found.outcome is outcome else clamps
        found = replace(found, outcome=outcome, reason=reason, next_step=next_step)
    elif doubt := dataset.phase_two.doubt:  # of a map whose forces sank, too, agreement says little
        if found.outcome is MapOutcome.HOLDS and not force_map.phase_two.doubt:
            mend = Finding.of(FindingKind.MEND_AND_CHECK)
            return replace(found, outcome=MapOutcome.CANNOT_TELL, reason=doubt, next_step=mend)
        found = replace(found, reason=found.reason.and_(doubt))
    return found


def _clamps(force_map: ForceMap, dataset: ImpactDataset) -> Finding | None:
    """That new impacts clamp, or may, where none of the map's does, so that its transient limits hold no longer."""
    then, now = force_map.phase_two, dataset.phase_two
    if then.barred or not now.barred:
        return None
    recorded, force = sum(now.scenarios.values()), None if math.isnan(now.largest_force) else now.largest_force
    return Finding.of(FindingKind.CLAMPS_NOW, impacts=now.barred, of=recorded, force_N=force)


_GRAVITY = (MapOutcome.HOLDS, MapOutcome.CANNOT_TELL, MapOutcome.DOES_NOT_HOLD)


def _of_other(other: ForceMap, dataset: ImpactDataset, error_probability: float) -> tuple[MapOutcome, Finding, Finding]:
    """Outcome, reason and next step of the map of another quantity."""
    measured = dataset.of(other.quantity)
    if not len(measured):
        reason = Finding.of(FindingKind.QUANTITY_NOT_MEASURED, quantity=other.quantity.words)
        return MapOutcome.CANNOT_TELL, reason, Finding.of(FindingKind.MEND_AND_CHECK)
    try:
        found = _check_quantity(other, measured, error_probability)
    except BoundNotAvailable as error:
        return MapOutcome.CANNOT_TELL, in_words(error.message), Finding.of(FindingKind.MEND_AND_CHECK)
    return found.outcome, found.reason, found.next_step


def _check_quantity(force_map: ForceMap, dataset: ImpactDataset, error_probability: float) -> MapCheck:
    """Check the map of one quantity with the impacts of it."""
    fit = _fit_of(force_map)
    if not len(dataset):
        raise InputError("found no impact to check the map with, expected some", file=dataset.source or None)
    # in the order of the table, with which a reader compares them
    states = dataset.states.select(np.argsort([dataset.state.tolist().index(name) for name in dataset.states.name]))
    left_out = _left_out(force_map, dataset, states, _own(force_map, dataset))
    states = states.select(~np.isin(states.name, [state.state for state in left_out]))
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
        outcome, reason, next_step = MapOutcome.CANNOT_TELL, against, Finding.of(FindingKind.MEND_AND_CHECK)
    if above := slower_above(force_map, ToleranceBound(), dataset.states):
        reason = above if outcome is MapOutcome.HOLDS else reason.and_(above)
        if outcome is not MapOutcome.DOES_NOT_HOLD:
            outcome, next_step = MapOutcome.CANNOT_TELL, Finding.of(FindingKind.MEASURE_STATES_AGAIN)
    low, high = interval(tests.mean, tests.mean_sd, freedom, MEAN_SHARE * error_probability)
    spread = np.sqrt(np.diag(covariance))
    expected = interval(predicted, spread, freedom, STATES_SHARE * error_probability / max(len(states), 1))
    moved = tests.p_states <= STATES_SHARE * error_probability
    forces = np.exp([measured, predicted, *expected, residual])
    figures = (*states.coordinates.T, forces[0], states.censored, *forces[1:], tests.p_states, moved)
    checked = [StateCheck(*row) for row in zip(states.name, *(figure.tolist() for figure in figures), strict=True)]
    if names := tuple(state.state for state in checked if state.moved):
        reason = reason.and_(Finding.of(FindingKind.STATES_MOVED, states=names))
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


def _not_comparable(force_map: ForceMap, dataset: ImpactDataset) -> Finding | None:
    """Why no agreement of the new impacts with the map may count; None if nothing speaks against it."""
    for of, binding in (("the map", force_map.binding), ("the new impacts", dataset.binding)):
        if binding.refusal:
            return Finding.of(FindingKind.BINDING_OF, binding.refusal, of=of)
    then, now = force_map.conditions.device.stiffness, dataset.conditions.device.stiffness
    if not (math.isnan(then) or math.isnan(now)) and device_suitability("the map", then, now).refusal:
        return Finding.of(FindingKind.SPRING_SOFTER_THAN_MAPS, new_N_per_m=now, map_N_per_m=then)
    return None


def _fit_of(force_map: ForceMap) -> Fit:
    fit = force_map.fit
    if fit is None:
        raise BoundNotAvailable(
            f"map {force_map.name!r} has no measured states, so nothing tells how far new ones may lie from it; "
            "fit a map to your own impacts, or see how far its predictions lie from the new ones: forcemap evaluate "
            f"NEW --map {force_map.name}; map against map: forcemap compare NEW {force_map.name}"
        )
    ToleranceBound().require(force_map)
    return fit


def known_states(force_map: ForceMap, dataset: ImpactDataset) -> list[str]:
    """States of a dataset that a map was fitted to, those it was carried over from too: no test of it."""
    fit = force_map.fit
    earlier = fit.transfer.earlier if fit and fit.transfer else ()
    *known, new = (
        [(*place, force) for place, force in zip(states.coordinates.tolist(), states.log_force.tolist(), strict=True)]
        for states in (*([fit.states] if fit else []), *(each.states for each in earlier), dataset.states)
    )
    own = {state for states in known for state in states}
    return [name for name, state in zip(dataset.states.name, new, strict=True) if state in own]


def fitted_states(force_map: ForceMap, dataset: ImpactDataset) -> list[str]:
    """Names of the training states of a dataset that a map was fitted to: neither they nor their repeats are new.

    All of them if it is the map's own table; else those with the same place, speed and force, or wholly above the
    device range with the same name, place and speed.
    """
    train, fit = dataset.train, force_map.fit
    if not len(train) or fit is None:
        return []
    if dataset.sha256 and dataset.sha256 == fit.table_sha256:
        return list(train.states.name)
    censored = [states.select(states.impacts == 0) for states in (train.states, fit.states)]
    both = [{*zip(each.name, map(tuple, each.coordinates.tolist()), strict=True)} for each in censored]
    return [*known_states(force_map, train), *(name for name, _ in set.intersection(*both))]


def _own(force_map: ForceMap, dataset: ImpactDataset) -> list[str]:
    """States that the map was fitted to among the new ones.

    Raises
    ------
    InputError
        The table is the map's own, or half of it.
    """
    copies, fit = known_states(force_map, dataset), _fit_of(force_map)
    same_table = bool(dataset.sha256) and dataset.sha256 == fit.table_sha256
    # one state may agree to the last digit by chance
    if same_table or (len(copies) > 1 and 2 * len(copies) >= len(dataset.states)):
        raise InputError(
            f"found impacts that the map was fitted to ({len(copies)} states are the same), expected new ones",
            file=dataset.source or None,
        )
    return copies


def _left_out(force_map: ForceMap, dataset: ImpactDataset, states: States, own: list[str]) -> tuple[LeftOutState, ...]:
    """The states that do not count, and why."""
    beyond = ~force_map.measured_range.near(states.coordinates, dataset.tolerance.scale)
    unread = force_map.predict(*states.coordinates.T) >= dataset.device_range
    why = np.full(len(states), None, dtype=object)
    why[unread] = Finding.of(FindingKind.PREDICTED_ABOVE_RANGE, range_N=dataset.device_range)
    why[beyond] = Finding.of(FindingKind.STATE_OUTSIDE_MAP)
    why[np.isin(states.name, own)] = Finding.of(FindingKind.STATE_OF_MAP)
    rows = zip(states.name, *states.coordinates.T.tolist(), why.tolist(), strict=True)
    return tuple(LeftOutState(*row) for row in rows if row[-1])


def _covariance(force_map: ForceMap, fit: Fit, dataset: ImpactDataset, states: States) -> FloatArray:
    """Covariance of new state means less predictions: effects of places and states, and the map's error.

    Effects of places are new, also where the map has states: effects that stay make the residuals smaller than that.
    New states share one only where no more apart than repeats: those a little farther apart may differ, which must not
    pass for a change.
    """
    rotated = force_map.form.design(*states.coordinates.T) @ fit.between_states.inverse_triangle
    deviation = max(fit.state_sd, _LEAST_SD)
    # A mean of fewer repeats than the map's carries more repeat noise than its state SD holds.
    of_map = float(np.mean(1 / (fit.states.impacts + fit.states.censored)))
    fewer = np.maximum(1 / (states.impacts + states.censored) - of_map, 0.0)
    noise = repeat_variance(dataset) if not dataset.censored.all() else 0.0
    place = places(states.distance, states.height, dataset.tolerance.place)
    alike = correlations(place, fit.place_effect.correlation)
    return np.asarray(deviation**2 * (alike + rotated @ rotated.T) + noise * np.diag(fewer))


def _outcome(
    tests: ResidualTests, of_whole: ResidualTests, left_out: int, error_probability: float, narrow: tuple[str, ...]
) -> tuple[MapOutcome, Finding, Finding]:
    """What the tests of all states that count, and of the uncensored ones among them, say; and what to do."""
    counted, whole = tests.p_states.size, of_whole.p_states.size
    if tests.changed(error_probability):
        figures = {"change": abs(math.expm1(tests.mean)), "higher": tests.mean > 0, "at_least": counted > whole}
        if tests.p_mean > MEAN_SHARE * error_probability:
            reason, step = FindingKind.FORCES_MOVED_UNEVENLY, FindingKind.MEASURE_STATES_AGAIN
        else:
            reason, step = FindingKind.FORCES_MOVED, FindingKind.MEASURE_NEW_MAP
        return MapOutcome.DOES_NOT_HOLD, Finding.of(reason, **figures), Finding.of(step)
    shown = {"change": math.expm1(of_whole.detectable), "power": POWER}
    step = FindingKind.MEASURE_MORE_STATES
    if whole < MIN_STATES:
        but = Finding.of(FindingKind.TOO_FEW_UNCENSORED, states=whole, fewest=MIN_STATES)
    elif not shown["change"] <= RELEVANT_CHANGE:
        but = Finding.of(FindingKind.CHANGE_NOT_SHOWN, **shown, relevant=RELEVANT_CHANGE)
    elif of_whole.changed(error_probability):
        hidden = Finding.of(FindingKind.CHANGE_HIDDEN_BY_CENSORED)
        return MapOutcome.CANNOT_TELL, hidden, Finding.of(FindingKind.MEASURE_CENSORED_STATES)
    elif counted > whole:
        but, step = Finding.of(FindingKind.KNOWN_AT_LEAST, states=counted - whole), FindingKind.MEASURE_CENSORED_STATES
    elif narrow:
        but = Finding.of(FindingKind.STATES_CLOSE_TOGETHER, coordinates=narrow)
    elif left_out > counted:
        but = Finding.of(FindingKind.MOST_LEFT_OUT, left_out=left_out, states=left_out + counted)
    else:
        return MapOutcome.HOLDS, Finding.of(FindingKind.NO_CHANGE, **shown), Finding.of(FindingKind.KEEP_MAP)
    return MapOutcome.CANNOT_TELL, Finding.of(FindingKind.NO_CHANGE_BUT, but), Finding.of(step)


def _narrow(force_map: ForceMap, coordinates: FloatArray) -> tuple[str, ...]:
    """The coordinates of which the new states span less than LEAST_SPAN of the measured range."""
    extent = force_map.measured_range.highest - force_map.measured_range.lowest
    span = np.ptp(coordinates, axis=0) if len(coordinates) else np.zeros(3)
    short = (extent > _CONSTANT_WITHIN) & (span < LEAST_SPAN * extent)
    return tuple(np.array(["distances", "heights", "speeds"])[short].tolist())


def _check_statements(
    force_map: ForceMap, fit: Fit, dataset: ImpactDataset, states: States, error_probability: float
) -> tuple[Finding, ...]:
    kind = FindingKind
    statements = [Finding.of(kind.SIMULATED)] if dataset.simulated or force_map.simulated else []
    bindings = (("the map", force_map.binding), ("the new impacts", dataset.binding))
    statements += [Finding.of(kind.BINDING_OF, binding.reason, of=of) for of, binding in bindings if binding.reason]
    statements += [slower] if (slower := slower_impacts(force_map)) else []
    if math.isnan(dataset.conditions.device.stiffness):
        statements.append(Finding.of(kind.NEW_SPRING_NOT_STATED))
    shares = {"mean": MEAN_SHARE, "whole": WHOLE_SHARE, "single": STATES_SHARE}
    error = float(np.fmax(dataset.conditions.device.error_or_default, force_map.conditions.device.error_or_default))
    statements += [
        Finding.of(
            kind.CHECKED_MAP,
            source=force_map.source,
            form=force_map.form.name,
            states=len(fit.states),
            state_sd=fit.state_sd,
            freedom=fit.between_states.degrees_of_freedom,
        ),
        Finding.of(
            kind.ERROR_PROBABILITY,
            all=error_probability,
            **{name: error_probability * share for name, share in shares.items()},
        ),
        Finding.of(kind.SCATTER_AS_MAPS),
        Finding.of(kind.DEVICE_ERROR_NOT_TESTED, error_N=error),
    ]
    fewest = int(np.min(states.impacts + states.censored, initial=fit.repeats[0]))
    if fewest < fit.repeats[0]:
        statements.append(Finding.of(kind.FEWER_IMPACTS, impacts=fewest, of_map=fit.repeats[0]))
    if saturated := tuple(name for name, n in zip(states.name, states.censored, strict=True) if n):
        statements.append(Finding.of(kind.CENSORED_AT_LEAST, states=saturated))
    return (*statements, *differences(force_map.conditions, dataset.conditions, ("map", "new")))
