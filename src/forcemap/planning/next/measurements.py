"""Which states to measure next: from nothing to confirmed speeds, slow to fast, never beyond a stated force."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.dataset import Binding, ImpactDataset, PhaseTwo
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.campaigns.state import States, StateTolerance
from forcemap.errors import BoundNotAvailable, FitError, InputError
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import FEW_STATES, MIN_DEGREES_OF_FREEDOM, Bound, FixedMargin, ToleranceBound
from forcemap.maps.fit import fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import Form, form_of
from forcemap.maps.slower_impacts import SLOW, slow_impacts_missing
from forcemap.planning.design import LARGEST, check_limit, require_whole
from forcemap.planning.expectation import Expectation, StandardExpectation
from forcemap.planning.measurements import REPEATS
from forcemap.planning.next.ladder import BoundLadder, OpeningLadder
from forcemap.planning.next.outlook import Outlook
from forcemap.planning.next.search import Search
from forcemap.planning.places import PlaceRange, at_speeds, no_repeats
from forcemap.planning.plan_warnings import map_warnings
from forcemap.planning.runs import runs_of, slow_to_fast
from forcemap.planning.spread_states import STATES
from forcemap.speeds.basis import Basis, against_bound, doubts_of_fit, limit_basis, of_quantity
from forcemap.speeds.enclosures import Patches, enclose
from forcemap.speeds.quantities import named_by
from forcemap.speeds.safe_speed import safe_speed

SPEEDS = (0.05, 0.40)
"""Slowest and fastest speed that may be planned, unless stated [m/s]; a choice."""

BATCH = 4
"""States to plan at most, unless stated; a choice, tried in simulated campaigns (docs/short_campaigns.md)."""

LEAST_GAIN = 0.0003
"""Mean confirmed speed [m/s] that a further state must be expected to gain, unless stated; a choice, tried likewise."""

# Choices, tried in simulated campaigns (docs/short_campaigns.md).
_PLACES = 9  # along each axis, at which confirmed speeds are counted
_CANDIDATE_PLACES = 9  # along each axis, to choose from
_SPEED_STEP = 0.02  # [m/s] between the speeds to choose from; the slowest is among them
_AIM = 0.93  # share of the limit: where the bound reaches the limit, the prediction lies about this low
_AHEAD = 3  # batches for which the gain is predicted at most
_FURTHER = 12  # states by which a campaign may exceed its usual number, or with which a spent budget is compared
_NEARLY = 0.9  # share of the places that counts as nearly everywhere

_MEASURED = (
    FindingKind.EXCEEDED_WHERE_PERMITTED,
    FindingKind.POINTS_ABOVE_BOUND,
    FindingKind.FAR_ABOVE_BOUND,
    FindingKind.CONFIRMING_ABOVE_BOUND,
)
"""What measurements say against a map, with the states at which they do."""

_MORE_ANSWERS = (
    FindingKind.OF_QUANTITY,
    *(FindingKind.FORM_DOUBTED, FindingKind.FORM_NOT_TESTED, FindingKind.FORM_PARTLY_TESTED),
    *(FindingKind.FORM_UNSEEN_BETWEEN, FindingKind.FALLS_WITH_SPEED, FindingKind.SLOW_AT_FEW_PLACES),
    *(FindingKind.SLOW_IMPACTS_MISSING, FindingKind.DRIFT_FOUND),
)
"""Doubts about a map that further states may answer: where there is one, nobody is told that measuring may stop."""

_SLOWER = 0.7  # times the slowest measured speed: two steps from 0.2 m/s to SLOW; a choice (docs/validity.md)
_PLANNED_FROM = 1.9 * SLOW  # plans begin at twice SLOW; what is slower may be slow impacts that were not told apart
_DECIMALS, _ROUNDING = 6, 1e-9  # of the speeds to choose from [m/s]


class Stop(StrEnum):
    """Why nothing more is to be measured."""

    BUDGET = "budget"
    NOTHING_TO_GAIN = "nothing-to-gain"
    OUT_OF_REACH = "out-of-reach"
    LIMIT_NOT_USABLE = "limit-not-usable"


@dataclass(frozen=True, eq=False)
class NextMeasurements:
    """What to measure next, or why to stop; counted on a grid over the range of places.

    Parameters
    ----------
    places : int
        Number of places of the grid.
    confirmed, expected_confirmed : int
        Places with an admissible or capped speed: now, and expected after these runs.
    speed, expected_speed : float
        Mean over all places of the confirmed speed, 0 where there is none [m/s]: now, and expected after these runs;
        NaN where there is no bound yet.
    simulated : bool
        True if the impacts so far are simulated.
    plan : MeasurementPlan or None
        Runs to add to the campaign's plan, slow to fast; None if it is time to stop.
    stop : Stop or None
        Why to stop.
    of_all : int or None
        Places that have a speed now by the map of all states, slower ones than the conditions want fitted, too; None
        if there are none, or it has no more.
    reasons : tuple of Finding
        Why these states, or why to stop.
    upper_force : array
        Force that every run is expected not to exceed [N], shape (runs,): by the bound once there is one, and never
        below what was measured within 5 cm at a lower speed.
    upper_is : Finding or None
        How these figures are computed.
    warnings : tuple of Finding
        What must be said first: doubts about the map, then about the plan.
    within : tuple of Finding
        What campaign.toml states of the plan, and these states keep to.
    """

    places: int
    confirmed: int
    speed: float
    expected_confirmed: int
    expected_speed: float
    simulated: bool
    plan: MeasurementPlan | None = None
    stop: Stop | None = None
    of_all: int | None = None
    reasons: tuple[Finding, ...] = ()
    upper_force: FloatArray = field(default_factory=lambda: np.empty(0))
    upper_is: Finding | None = None
    warnings: tuple[Finding, ...] = ()
    within: tuple[Finding, ...] = ()

    @property
    def needs_more(self) -> bool:
        """True if something speaks against the map that further states may answer."""
        return any(warning.kind in _MORE_ANSWERS for warning in self.warnings)

    @property
    def progress(self) -> Finding:
        """At how many places of the grid there is a speed now, and is expected to be after these runs."""
        counted = {"confirmed": self.confirmed, "places": self.places, "of_all": self.of_all}
        if self.plan is None or math.isnan(self.expected_speed):
            return Finding.of(FindingKind.PLACES_COUNTED, **counted)
        return Finding.of(FindingKind.PLACES_EXPECTED, **counted, expected=self.expected_confirmed)


def next_measurements(
    measured: ImpactDataset | Conditions,
    limit: ForceLimit | NewtonLimit | float,
    *,
    contact: Contact | None = None,
    distances: Sequence[float] = (),
    heights: Sequence[float] = (),
    speeds: Sequence[float] = (),
    form: Form | None = None,
    bound: ToleranceBound = ToleranceBound(),  # noqa: B008 - frozen
    expected_force: Expectation | None = None,
    largest_force: float = math.inf,
    batch: int = BATCH,
    states: int | None = None,
    repeats: int = REPEATS,
    least_gain: float = LEAST_GAIN,
    seed: int = 0,
) -> NextMeasurements:
    """Choose the states to measure next, so that a limit is confirmed at more places and up to higher speeds.

    An opening, as long as the states are too few for a bound: the corners of the place range at the slowest speed, and
    states that determine the form best, slow to fast and far to near; only the slowest may be expected above the limit.
    Afterwards the states that make the prediction most precise where it reaches the limit: I-optimal for all states
    left in the budget, of these the most useful batch; and the corners at a slow speed where the limit is only met
    below every measured speed.

    No state is planned whose force may exceed the device range less its error, or `largest_force`: before there is a
    bound, judged by the expected force with its margin and by the nearest measured forces; afterwards by the bound, and
    never at more than 1.5 times the speed measured there. Forces measured within 5 cm at a lower speed count, too:
    where one lies above the bound, the force of the fastest such impact is extrapolated in proportion to speed.

    Parameters
    ----------
    measured : ImpactDataset or Conditions
        The impacts so far, of which those with role train count; the conditions alone if there are none.
    limit : float or ForceLimit
        Force limit to confirm [N]; or the limits of a body area together with `contact`.
    contact : Contact, optional
        Kind of contact, for a ForceLimit.
    distances, heights : sequence of float
        Nearest and farthest, lowest and highest place [m]; those measured if not given.
    speeds : sequence of float
        Slowest and fastest speed that may be planned [m/s]; if not given 0.05, and the fastest of the plan that the
        conditions state, else 0.40. A reach that they state holds anyway.
    form : Form, optional
        Form of the map; as in `fit_force_map` if not given.
    bound : ToleranceBound
        The bound that confirms.
    expected_force : ForceMap, StandardExpectation or callable, optional
        Force to expect [N] before there is a bound; the standard's if the conditions state a moving mass.
    largest_force : float
        No impact is to exceed this force [N]; the device range less its error holds anyway.
    batch : int
        The most states to plan.
    states : int, optional
        Budget: states of the whole campaign, at which to stop. If not given, a campaign goes on as long as there is
        something to gain; the states that may follow are then up to the 27th, or 12 if that is more.
    repeats : int
        Impacts of every state.
    least_gain : float
        Stop where a further state is expected to raise the mean confirmed speed by less [m/s], and 18 are measured.
    seed : int
        Seed of the search for states.

    Returns
    -------
    NextMeasurements

    Raises
    ------
    InputError
        A figure outside its range, neither device range nor largest force stated, or no source of the force to expect.
    ContactNotPermitted
        The standard permits no contact with the body area.

    Examples
    --------
    >>> from forcemap import Conditions, Device
    >>> cell = Conditions(device=Device(range=500.0, error=3.0), moving_mass=30.0)
    >>> opening = next_measurements(cell, 140.0, distances=(0.52, 0.89), heights=(0.14, 0.46))
    >>> opening.plan.states
    ('d890-h140-v50', 'd890-h460-v50', 'd705-h420-v50', 'd520-h140-v50')
    """
    share = 1.0  # a plan states speeds as the campaign does, and is computed in these
    if isinstance(measured, ImpactDataset):
        share, measured = float(measured.conditions.at_contact(np.array(1.0))), measured.as_stated
    dataset = measured if isinstance(measured, ImpactDataset) and len(measured.train) else None
    seen = measured.states if isinstance(measured, ImpactDataset) else None
    conditions = measured.conditions if isinstance(measured, ImpactDataset) else measured
    form = form_of(conditions, form)
    usable = _limit_to_confirm(limit, contact, conditions, dataset)
    speeds, reach, within = _as_planned(conditions, speeds)
    slowest, fastest = _check_budget(bound, speeds, batch, states, repeats, least_gain)
    highest = _highest_force(conditions, dataset, largest_force, float(usable.newtons))
    known = dataset.train.states if dataset is not None else None
    place_range = PlaceRange.of(distances, heights, known, reach)
    stated_tolerance = StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)
    aim = _Aim(
        basis=usable,
        conditions=conditions,
        known=known,
        seen=seen,
        share=share,
        bound=bound,
        slowest=slowest,
        fastest=fastest,
        highest=highest,
        place_range=place_range,
        tolerance=dataset.tolerance if dataset is not None else stated_tolerance,
        form=form,
        batch=batch,
        states=states,
        least_gain=least_gain,
        seed=seed,
    )
    force_map, no_bound = _map_with_bound(dataset, form, bound)
    others = named_by(force_map, limit, usable.contact) if force_map else ()
    choice = _choice(aim, force_map, no_bound, expected_force, others)
    answer = choice if isinstance(choice, NextMeasurements) else choice.planned(repeats)
    by_force = [Finding.of(FindingKind.PLANNED_BY_FORCE, quantities=tuple(each.quantity.words for each in others))]
    warnings = (*(by_force if others else ()), *_said_of(others, bound), *answer.warnings)
    return replace(answer, warnings=warnings, within=within, of_all=_of_all(aim, dataset, force_map, answer.confirmed))


def _of_all(aim: _Aim, dataset: ImpactDataset | None, force_map: ForceMap | None, confirmed: int) -> int | None:
    """Places with a speed by the map of all states, where slower ones are not fitted; None if no more than now."""
    if dataset is None or force_map is None or not len(force_map.slower):
        return None
    every = replace(dataset, conditions=replace(dataset.conditions, slowest=math.nan))
    whole, _ = _map_with_bound(every, aim.form, aim.bound)
    now, *_ = _confirmed(whole, aim.targets, aim.level, aim.bound, aim.share)
    return now.confirmed if now.confirmed > confirmed else None


def _choice(
    aim: _Aim,
    force_map: ForceMap | None,
    no_bound: tuple[Finding, ...],
    expected_force: Expectation | None,
    others: Sequence[ForceMap],
) -> _Choice | NextMeasurements:
    """The next states, or why to stop; `no_bound` says why there is no map."""
    now, has_speed, refused = _confirmed(force_map, aim.targets, aim.level, aim.bound, aim.share)
    refused += tuple(each for other in others for each in against_bound(other, aim.bound) if each.kind in _MEASURED)
    if why := aim.basis.refusals:
        return _stopped(now, Stop.LIMIT_NOT_USABLE, Finding.of(FindingKind.LIMIT_NOT_CONFIRMABLE, *why))
    if force_map is None or aim.known is None or aim.seen is None:
        return _opening(aim, now, expected_force or StandardExpectation.of(aim.conditions), no_bound)
    if refused:
        again = _where_exceeded(aim, now, force_map, aim.known, aim.seen, refused)
        far = all(each.kind is FindingKind.FAR_ABOVE_BOUND for each in refused)
        if not (far and isinstance(again, NextMeasurements)):  # else around it, where it can be read
            return again
        now = replace(now, warnings=(*refused, *now.warnings))
    missing = slow_impacts_missing(force_map) if aim.left > 0 else None
    slow = _slow_impacts(aim, now, force_map, aim.seen, missing) if missing else None
    return slow or _refinement(aim, now, force_map, aim.known, aim.seen, has_speed)


def _as_planned(conditions: Conditions, speeds: Sequence[float]) -> tuple[Sequence[float], float, tuple[Finding, ...]]:
    """Speeds that may be planned [m/s] and the reach [m], as the conditions state of the plan; what they state."""
    reach, kept = math.inf, list[Finding]()
    if not len(speeds) and conditions.fastest > 0:
        speeds = min(SPEEDS[0], conditions.fastest / 2), conditions.fastest
        kept.append(Finding.of(FindingKind.SPEEDS_AS_PLANNED, fastest_mps=conditions.fastest))
    speeds = speeds if len(speeds) else SPEEDS
    if max(speeds) <= conditions.slowest:  # never faster than was asked for
        raise InputError(
            f"speeds: found up to {max(speeds):g} m/s, expected above map.slowest_mps of {conditions.slowest:g} m/s "
            "(campaign.toml), below which nothing is fitted"
        )
    if min(speeds) < conditions.slowest:
        speeds = conditions.slowest, max(speeds)
        kept.append(Finding.of(FindingKind.SPEEDS_OF_MAP, slowest_mps=conditions.slowest))
    if conditions.reach > 0:
        reach = conditions.reach
        kept.append(Finding.of(FindingKind.PLACES_AS_PLANNED, reach_m=reach))
    return speeds, reach, tuple(kept)


def _said_of(others: Sequence[ForceMap], bound: Bound) -> list[Finding]:
    """What measurements say against the maps of other quantities, and doubts about these."""
    found = ((each.quantity, (*against_bound(each, bound), *doubts_of_fit(each))) for each in others)
    return [of_quantity(quantity, why) for quantity, findings in found for why in findings]


@dataclass(frozen=True, eq=False)
class _Aim:
    """What is to be confirmed within which ranges and budget, and what was measured so far.

    Parameters
    ----------
    basis : Basis
        The limit, and what of the impacts forbids it.
    conditions : Conditions
        The conditions of the measurement.
    known, seen : States or None
        The states to train; everything measured, test states too. None if there are none.
    share : float
        Speed at contact that counts over the speed that the campaign states.
    bound : ToleranceBound
        The bound that confirms.
    slowest, fastest : float
        Speeds that may be planned [m/s].
    highest : float
        Force that no impact is to exceed [N].
    place_range, tolerance, form, batch, states, least_gain, seed
        As in `next_measurements`.
    """

    basis: Basis
    conditions: Conditions
    known: States | None
    seen: States | None
    share: float
    bound: ToleranceBound
    slowest: float
    fastest: float
    highest: float
    place_range: PlaceRange
    tolerance: StateTolerance
    form: Form
    batch: int
    states: int | None
    least_gain: float
    seed: int

    @property
    def newtons(self) -> float:
        """The limit [N]."""
        return float(self.basis.newtons)

    @property
    def level(self) -> float:
        """Force that the bound, not raised, must not exceed [N]."""
        return float(self.basis.level)

    @property
    def measured(self) -> int:
        """Number of states measured so far."""
        return 0 if self.known is None else len(self.known)

    @property
    def further(self) -> int:
        """States up to which the campaign may go on, from those measured now."""
        return self.measured + _FURTHER

    @property
    def left(self) -> int:
        """States left in the budget."""
        return (max(STATES, self.further) if self.states is None else self.states) - self.measured

    @property
    def search(self) -> Search:
        """The search for states."""
        return Search(self.place_range, self.form, self.tolerance, self.seed)

    @property
    def candidates(self) -> FloatArray:
        """States to choose from, shape (n, 3)."""
        steps = np.round(np.arange(self.slowest, self.fastest + _ROUNDING, _SPEED_STEP), _DECIMALS)
        return at_speeds(self.place_range.grid_with(self.known, _CANDIDATE_PLACES), steps)

    @cached_property
    def targets(self) -> FloatArray:
        """Places at which confirmed speeds are counted, shape (n, 2)."""
        return self.place_range.grid(_PLACES)

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """What is to be said first of the device."""
        return self.basis.notes if math.isnan(self.conditions.device.stiffness) else ()


@dataclass(frozen=True, eq=False)
class _Choice:
    """States to measure next, the ladder that allows them, what is confirmed now, and warnings."""

    states: FloatArray
    ladder: OpeningLadder | BoundLadder
    now: NextMeasurements
    warnings: tuple[Finding, ...]

    def planned(self, repeats: int) -> NextMeasurements:
        """The answer with the runs of these states."""
        states, ladder = slow_to_fast(self.states), self.ladder
        expected, source = ladder.expected(states), ladder.source(states)
        plan = runs_of(states, repeats, expected, expected_from=source, warnings=self.warnings)
        upper = np.repeat(ladder.upper(states), repeats)
        warnings = tuple(dict.fromkeys((*self.now.warnings, *plan.warnings)))
        return replace(self.now, plan=plan, upper_force=upper, upper_is=ladder.upper_is(states), warnings=warnings)


def _stopped(now: NextMeasurements, why: Stop, *reasons: Finding | None) -> NextMeasurements:
    """The answer that nothing more is to be measured."""
    return replace(now, stop=why, reasons=tuple(reason for reason in reasons if reason))


def _opening(
    aim: _Aim, now: NextMeasurements, expectation: Expectation | None, no_bound: tuple[Finding, ...]
) -> _Choice | NextMeasurements:
    """The next states before there is a bound, or why to stop."""
    kind = FindingKind
    if aim.left <= 0:
        spent = Finding.of(kind.BUDGET_SPENT, *no_bound, states=aim.states, further=aim.further)
        return _stopped(now, Stop.BUDGET, spent)
    if expectation is None:
        raise InputError(
            "expected force: nothing tells it before there is a bound; state the robot's moving mass, or give a "
            "map of a similar robot"
        )
    place_range, tolerance = aim.place_range, aim.tolerance
    ladder = OpeningLadder(expectation, aim.highest, aim.newtons, aim.slowest, aim.seen, place_range, tolerance)
    candidates = aim.candidates
    allowed = candidates[ladder.allows(candidates)]
    chosen = aim.search.opening(allowed, aim.known, min(aim.batch, aim.left), aim.left)
    if not len(chosen):
        nowhere = Finding.of(kind.NONE_EXPECTED_WITHIN, force_N=aim.highest)
        return _stopped(now, Stop.OUT_OF_REACH, nowhere, _saturated(aim.seen))
    now = replace(now, reasons=(Finding.of(kind.OPENING, *no_bound),))
    return _Choice(chosen, ladder, now, aim.warnings)


def _where_exceeded(
    aim: _Aim, now: NextMeasurements, force_map: ForceMap, known: States, seen: States, refused: tuple[Finding, ...]
) -> _Choice | NextMeasurements:
    """The states at which measurements speak against the map, to be fitted: states elsewhere would change nothing."""
    why = Finding.of(FindingKind.LIMIT_NOT_CONFIRMABLE, *refused)
    names = [name for each in refused for name in each.figure("names")]
    for group in force_map.require_fit().measured:
        seen = seen.and_(group.select(np.isin(group.name, names) & ~np.isin(group.name, seen.name)))
    states = seen.coordinates[np.isin(seen.name, names)].round(_DECIMALS)
    states[:, 2] = np.maximum(states[:, 2], aim.slowest)
    states = np.unique(states, axis=0)
    ladder = BoundLadder(force_map, aim.bound, aim.highest, seen, aim.place_range, aim.tolerance)
    states = states[no_repeats(states, known.coordinates, aim.tolerance) & (states[:, 2] <= aim.fastest)]
    states = states[ladder.allows(states)][: aim.batch] if len(states) else states
    if not len(states):
        return _stopped(now, Stop.LIMIT_NOT_USABLE, why)
    now = replace(now, reasons=(why,), expected_speed=math.nan)
    return _Choice(states, ladder, now, (*aim.warnings, *map_warnings(force_map, states)))


def _slow_impacts(
    aim: _Aim, now: NextMeasurements, force_map: ForceMap, seen: States, missing: Finding
) -> _Choice | None:
    """The corners at a slower speed than was measured, or in a gap of slow speeds, since every motion passes through
    it; None if all are measured or may be above the device's range."""
    lowest, gap = missing.figure("lowest_mps"), missing.figure("below_mps") is not None
    keep = float(aim.conditions.as_stated(np.array(lowest)).round(_DECIMALS))  # plans state speeds to command
    states = at_speeds(aim.place_range.grid(2), np.array([round(_SLOWER * keep, 2)]))[: aim.batch]
    ladder = BoundLadder(force_map, aim.bound, aim.highest, seen, aim.place_range, aim.tolerance)
    wanted = states[no_repeats(states, seen.coordinates, aim.tolerance)]
    states = wanted[ladder.allows(wanted)] if len(wanted) else wanted
    if not len(states):
        return None
    left_out = len(wanted) - len(states) or None
    stated, lower = aim.conditions.slowest > 0 or gap, lowest < _PLANNED_FROM
    figures = {"slowest_mps": None if stated or lower else keep, "lower": None if stated or not lower else True}
    why = Finding.of(FindingKind.SLOW_PLANNED, **figures, left_out=left_out, highest_N=aim.highest)
    now = replace(now, reasons=(why,), expected_speed=math.nan)
    return _Choice(states, ladder, now, (*aim.warnings, *map_warnings(force_map, states)))


def _refinement(
    aim: _Aim, now: NextMeasurements, force_map: ForceMap, known: States, seen: States, has_speed: Mask
) -> _Choice | NextMeasurements:
    """The next states where the bound matters most, or why to stop; `has_speed` marks confirmed targets."""
    kind, bound, targets, left = FindingKind, aim.bound, aim.targets, aim.left
    ladder = BoundLadder(force_map, bound, aim.highest, seen, aim.place_range, aim.tolerance)
    reach = _reach(force_map, targets, _AIM * aim.level, aim.slowest, aim.fastest)
    can = ~np.isnan(reach)
    exceeds = bound.upper(force_map, targets[:, 0], targets[:, 1], aim.slowest) > aim.level
    hopeless = _hopeless(exceeds, aim.newtons, aim.slowest)
    if not can.any():
        nowhere = Finding.of(kind.EXPECTED_NOWHERE, limit_N=aim.newtons, slowest_mps=aim.slowest)
        return _stopped(now, Stop.NOTHING_TO_GAIN, nowhere, hopeless)
    wanted = np.column_stack([targets, reach])[can]
    ahead = min(left, _AHEAD * aim.batch) if left > 0 else _FURTHER
    search, candidates = aim.search, aim.candidates
    allowed = candidates[ladder.allows(candidates)]
    planned = search.refining(allowed, known, wanted, wanted[~has_speed[can]], ahead)
    if not len(planned):
        nowhere = Finding.of(kind.NO_BOUND_WITHIN, force_N=aim.highest)
        return _stopped(now, Stop.OUT_OF_REACH, nowhere, _saturated(seen))
    outlook = Outlook(force_map, bound, targets, aim.level, aim.fastest)
    before = aim.share * outlook.speeds(planned[:0])
    raised = max(float(np.mean(aim.share * outlook.speeds(planned) - before)), 0.0)
    per_state = raised / len(planned)
    gain = Finding.of(kind.GAIN_OF_MORE, states=len(planned), gain_mps=raised, each_mps=per_state)
    if left <= 0:
        spent = Finding.of(kind.BUDGET_SPENT, gain, states=aim.states, further=aim.further)
        return _stopped(now, Stop.BUDGET, spent)
    little, few = per_state < aim.least_gain, aim.measured < FEW_STATES
    if little and not few:  # few states that happen to scatter little would end a campaign
        too_little = Finding.of(kind.TOO_LITTLE_GAIN, gain, least_mps=aim.least_gain)
        return _stopped(now, Stop.NOTHING_TO_GAIN, hopeless, too_little)
    chosen = search.first(planned, known, wanted, min(aim.batch, left))
    after = aim.share * outlook.speeds(chosen)
    gained, slower = float(np.mean(after - before)), int(np.sum(chosen[:, 2] < known.speed.min()))
    below = {"slower": slower, "places": int(np.sum(can & ~has_speed))}
    later = Finding.of(kind.GAIN_LATER, gain, **below, fewest=FEW_STATES if little and few else None)
    reason = Finding.of(kind.GAIN_OF_THESE, gain_mps=gained) if gained > 0 else later
    count, mean = int(np.sum(after > 0)), float(np.mean(after))
    now = replace(now, reasons=(reason,), expected_confirmed=count, expected_speed=mean)
    return _Choice(chosen, ladder, now, (*aim.warnings, *map_warnings(force_map, chosen)))


def _limit_to_confirm(
    limit: ForceLimit | NewtonLimit | float,
    contact: Contact | None,
    conditions: Conditions,
    dataset: ImpactDataset | None,
) -> Basis:
    """The limit, and what forbids it in the impacts so far; one in newtons counts as quasi-static unless named."""
    stated = limit if isinstance(limit, ForceLimit) else NewtonLimit.of(limit, None, None)
    if isinstance(stated, ForceLimit):
        stated.require_permitted()
    elif np.ndim(stated.force):
        raise InputError("limit: expected one limit in newtons")
    phase_two, binding = (PhaseTwo(), Binding()) if dataset is None else (dataset.phase_two, dataset.binding)
    basis = limit_basis(stated, contact, conditions, phase_two=phase_two, binding=binding)
    can_be_stated = dataset is None and math.isnan(conditions.device.stiffness)  # until there is a map
    return replace(basis, refusals=()) if can_be_stated else basis


def _check_budget(
    bound: Bound, speeds: Sequence[float], batch: int, states: int | None, repeats: int, least_gain: float
) -> tuple[float, float]:
    """Slowest and fastest speed [m/s]; all figures are checked."""
    if not isinstance(bound, ToleranceBound):
        raise InputError(f"bound: found {bound!r}, expected a ToleranceBound: a margin does not tell what is gained")
    for name, number in (("batch", batch), ("states", states), ("repeats", repeats)):
        require_whole(name, number)
    if not 0 <= least_gain < math.inf:
        raise InputError(f"least gain: found {least_gain:g} m/s, expected a finite number of at least 0")
    given = [float(value) for value in speeds]
    if len(given) < 2 or not np.isfinite(given).all() or not 0 < min(given) < max(given) <= LARGEST:
        expected = f"(slowest, fastest) in metres per second, up to {LARGEST:g}"
        raise InputError(f"speeds: found {list(speeds)}, expected {expected}")
    return min(given), max(given)


def _highest_force(conditions: Conditions, dataset: ImpactDataset | None, largest_force: float, limit: float) -> float:
    """The force that no impact is to exceed [N]."""
    device = conditions.device
    reach = dataset.device_range - device.error_or_default if dataset is not None else device.highest_limit
    if not largest_force > 0:
        raise InputError(f"largest force: found {largest_force:g} N, expected newtons above 0")
    if math.isnan(reach) and math.isinf(largest_force):
        raise InputError(
            "device range: not stated; state it (--device-range-N), or the largest force that an impact may reach "
            "(--largest-force-N)"
        )
    check_limit(limit, reach)
    return float(np.fmin(reach, largest_force))


def _confirmed(
    force_map: ForceMap | None, places: FloatArray, limit: float, bound: ToleranceBound, share: float
) -> tuple[NextMeasurements, Mask, tuple[Finding, ...]]:
    """What is confirmed so far, at which places, and what of the impacts forbids every speed.

    Nothing is confirmed without a map and its bound.

    The speed at contact that counts is a `share` of that of the map.
    """
    speed = np.full(len(places), math.nan)
    refused: tuple[Finding, ...] = ()
    if force_map is not None and limit <= force_map.highest_force - force_map.conditions.device.error_or_default:
        now = safe_speed(force_map, *places.T, limit=limit, bound=bound, contact=Contact.QUASI_STATIC)
        speed, refused = now.speed, tuple(why for why in now.basis.refusals if why.kind in _MEASURED)
    has_speed = ~np.isnan(speed)
    if force_map is None:
        return NextMeasurements(len(places), 0, math.nan, 0, math.nan, simulated=False), has_speed, ()
    count, mean = int(has_speed.sum()), share * float(np.nan_to_num(speed).mean())
    doubts = doubts_of_fit(force_map)
    found = NextMeasurements(len(places), count, mean, count, mean, force_map.simulated, warnings=doubts)
    return found, has_speed, refused


def _saturated(seen: States | None) -> Finding | None:
    """A statement if states saturated the device: no impact as fast is planned there."""
    if seen is None or not (full := seen.select(seen.censored > 0)):
        return None
    slowest = float(full.speed.min())
    return Finding.of(FindingKind.DEVICE_WAS_SATURATED, states=len(full), of=len(seen), slowest_mps=slowest)


def _hopeless(exceeds: Mask, limit: float, slowest: float) -> Finding | None:
    """A statement if the bound exceeds the limit nearly everywhere at the slowest speed."""
    if np.mean(exceeds) < _NEARLY:
        return None
    figures = {"limit_N": limit, "slowest_mps": slowest, "all": bool(exceeds.all())}
    return Finding.of(FindingKind.EXCEEDED_EVERYWHERE, **figures, places=int(exceeds.sum()), of=exceeds.size)


def _reach(force_map: ForceMap, places: FloatArray, force: float, slowest: float, fastest: float) -> FloatArray:
    """Speed up to which the prediction stays within a force, shape (n,); NaN where the slowest exceeds it."""
    low, high, level = (np.full(len(places), value) for value in (slowest, fastest, math.log(force)))
    predicted = enclose(force_map, FixedMargin(0.0), Patches.of_places(*places.T), low, high)
    return predicted.speed(predicted.certified(level))


def _map_with_bound(
    dataset: ImpactDataset | None, form: Form, bound: ToleranceBound
) -> tuple[ForceMap | None, tuple[Finding, ...]]:
    """The map of what was measured, or None and the reason if it or its bound is not determined yet."""
    fewest = len(form.terms) + MIN_DEGREES_OF_FREEDOM
    uncensored = 0 if dataset is None else len(dataset.train.states.uncensored)
    too_few = Finding.of(FindingKind.NO_BOUND_FROM_STATES, fewest=fewest, form=form.name, states=uncensored)
    if dataset is None:
        return None, (too_few,)
    try:
        force_map = fit_force_map(dataset, form=form)
        bound.require(force_map)
    except (FitError, BoundNotAvailable) as refusal:
        not_yet = Finding.of(FindingKind.NO_BOUND_YET, in_words(refusal.message))
        return None, (too_few if uncensored < fewest else not_yet,)
    return force_map, ()
