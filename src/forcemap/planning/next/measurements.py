"""Which states to measure next: from nothing to confirmed speeds, slow to fast, never beyond a stated force."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.dataset import Binding, ImpactDataset, PhaseTwo
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.campaigns.state import PLACE_SIZE, States, StateTolerance
from forcemap.errors import BoundNotAvailable, FitError, InputError
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import MIN_DEGREES_OF_FREEDOM, FixedMargin, ToleranceBound
from forcemap.maps.fit import fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_3D, Form
from forcemap.planning.design import check_limit, require_whole
from forcemap.planning.expectation import Expectation, StandardExpectation
from forcemap.planning.next.ladder import BoundLadder, OpeningLadder
from forcemap.planning.next.outlook import Outlook
from forcemap.planning.next.search import Search
from forcemap.planning.places import PlaceRange
from forcemap.planning.plan_warnings import FEW_STATES, map_warnings
from forcemap.planning.runs import runs_of, slow_to_fast
from forcemap.speeds.basis import Basis, doubts_of_fit, limit_basis
from forcemap.speeds.enclosures import Patches, enclose
from forcemap.speeds.safe_speed import safe_speed

_PLACES = 9  # along each axis, at which confirmed speeds are counted
_CANDIDATE_PLACES = 9  # along each axis
_SPEED_STEP = 0.02  # [m/s] between the speeds to choose from; the slowest is among them
_AIM = 0.93  # of the limit: where the bound reaches it, the prediction lies about this far below
_AHEAD = 3  # batches for which the gain is foreseen at most
_BUDGET = 27  # states of a campaign, the paper's number
_FURTHER = 12  # states that a campaign may go on for, or that a spent budget is weighed against
_NEARLY = 0.9  # share of the places that counts as nearly everywhere


class Stop(StrEnum):
    """Why nothing more is to be measured."""

    BUDGET = "budget"
    NOTHING_TO_GAIN = "nothing-to-gain"
    OUT_OF_REACH = "out-of-reach"
    LIMIT_NOT_USABLE = "limit-not-usable"


@dataclass(frozen=True, eq=False)
class NextMeasurements:
    """What to measure next, or why to stop; places are a grid over the range of places.

    Parameters
    ----------
    places : int
        Number of places at which speeds are counted.
    confirmed, expected_confirmed : int
        Places with an admissible or capped speed: now, and expected after these runs.
    speed, expected_speed : float
        Mean over all places of the confirmed speed, 0 where there is none [m/s]: now, and expected after these runs;
        NaN where no bound can be had.
    simulated : bool
        True if the impacts so far are simulated.
    plan : MeasurementPlan or None
        Runs to add to the campaign's plan, slow to fast; None if it is time to stop.
    stop : Stop or None
        Why to stop.
    reasons : tuple of Finding
        Why these states, or why to stop.
    upper_force : array
        What the force of every run is not expected to exceed [N], shape (runs,): by the bound once there is one, and
        never below what was measured within 5 cm at a lower speed.
    upper_is : Finding or None
        What these figures are.
    warnings : tuple of Finding
        What is to be said first: what the states say against the map, then against the plan.
    """

    places: int
    confirmed: int
    speed: float
    expected_confirmed: int
    expected_speed: float
    simulated: bool
    plan: MeasurementPlan | None = None
    stop: Stop | None = None
    reasons: tuple[Finding, ...] = ()
    upper_force: FloatArray = field(default_factory=lambda: np.empty(0))
    upper_is: Finding | None = None
    warnings: tuple[Finding, ...] = ()


def next_measurements(
    measured: ImpactDataset | Conditions,
    limit: ForceLimit | NewtonLimit | float,
    *,
    contact: Contact | None = None,
    distances: Sequence[float] = (),
    heights: Sequence[float] = (),
    speeds: Sequence[float] = (0.05, 0.40),
    form: Form = CFM_3D,
    bound: ToleranceBound = ToleranceBound(),  # noqa: B008 - frozen
    expected_force: Expectation | None = None,
    largest_force: float = math.inf,
    batch: int = 4,
    states: int | None = None,
    repeats: int = 3,
    least_gain: float = 0.0003,
    seed: int = 0,
) -> NextMeasurements:
    """Tell which states to measure next, so that a limit is confirmed at more places and up to higher speeds.

    While the states are too few for a bound, an opening: the corners of the place range at the slowest speed, and
    states that determine the form best, slow to fast and far to near, none but the slowest expected above the limit.
    Afterwards the states that make the prediction most precise where it reaches the limit: I-optimal for all states
    left in the budget, of these the most useful batch; and the corners at a slow speed where places lie below every
    measured speed.

    No state is planned whose force may exceed the device range less its error, or `largest_force`: before there is a
    bound, by the expected force with its margin and by what was measured nearest; afterwards by the bound, and never
    at more than 1.5 times the speed measured there. Nor may it by what was measured within 5 cm at a lower speed: where
    that lies above the bound, the force of the fastest such impact is continued in proportion to speed.

    Parameters
    ----------
    measured : ImpactDataset or Conditions
        The impacts so far, of which those to train count; the conditions alone if there are none.
    limit : float or ForceLimit
        Force limit to confirm [N]; or the limits of a body area together with `contact`.
    contact : Contact, optional
        Kind of contact, for a ForceLimit.
    distances, heights : sequence of float
        Nearest and farthest, lowest and highest place [m]; those measured if not given.
    speeds : sequence of float
        Slowest and fastest speed that may be planned [m/s].
    form : Form
        The map that is fitted.
    bound : ToleranceBound
        The bound that confirms.
    expected_force : ForceMap, StandardExpectation or callable, optional
        Force to expect [N] before there is a bound; the standard's if the conditions state a moving mass.
    largest_force : float
        No impact is to exceed this force [N]; the device range less its error holds anyway.
    batch : int
        How many states to plan at most.
    states : int, optional
        Budget: states of the whole campaign. If not given, 27, or 12 more than are measured if that is more: a whole
        campaign goes on while there is something to gain.
    repeats : int
        Impacts of every state.
    least_gain : float
        Stop where a further state is expected to raise the mean confirmed speed by less [m/s], and 18 are measured.
    seed : int
        Of the search for states.

    Returns
    -------
    NextMeasurements

    Raises
    ------
    InputError
        A figure outside its range, neither device range nor largest force, or nothing that tells the force to expect.
    ContactNotPermitted
        The standard permits no contact with the body area.

    Examples
    --------
    >>> from forcemap import Conditions, Device
    >>> cell = Conditions(device=Device(range=500.0, error=3.0), moving_mass=30.0)
    >>> found = next_measurements(cell, 140.0, distances=(0.52, 0.89), heights=(0.14, 0.46))
    >>> found.plan.states
    ('d890-h140-v50', 'd890-h460-v50', 'd705-h420-v50', 'd520-h140-v50')
    """
    share = 1.0  # a plan has the speeds that the campaign states, and so has what it is planned by
    if isinstance(measured, ImpactDataset):
        share, measured = float(measured.conditions.at_contact(np.array(1.0))), measured.as_stated
    dataset = measured if isinstance(measured, ImpactDataset) and len(measured.train) else None
    known = dataset.train.states if dataset is not None else None
    seen = measured.states if isinstance(measured, ImpactDataset) else None
    conditions = measured.conditions if isinstance(measured, ImpactDataset) else measured
    if not isinstance(bound, ToleranceBound):
        raise InputError(f"bound: found {bound!r}, expected a ToleranceBound: a margin does not tell what is gained")
    usable = _limit_to_confirm(limit, contact, conditions, dataset)
    newtons, level = float(usable.newtons), float(usable.level)
    slowest, fastest = _check_budget(speeds, batch, states, repeats, least_gain)
    highest = _highest_force(conditions, dataset, largest_force, newtons)
    place_range = PlaceRange.of(distances, heights, known)
    tolerance = StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)
    tolerance = dataset.tolerance if dataset is not None else tolerance
    search = Search(place_range, form, tolerance, seed)
    steps = np.round(np.arange(slowest, fastest + 1e-9, _SPEED_STEP), 6)
    candidates = place_range.states(_CANDIDATE_PLACES, steps, PLACE_SIZE)
    so_far = len(known) if known is not None else 0
    left = (max(_BUDGET, so_far + _FURTHER) if states is None else states) - so_far
    force_map, no_bound = _map_with_bound(dataset, form, bound)
    targets = place_range.grid(_PLACES)
    now, has_speed = _confirmed(force_map, targets, level, bound, share)

    def stop(why: Stop, *reasons: Finding | None) -> NextMeasurements:
        return replace(now, stop=why, reasons=tuple(reason for reason in reasons if reason))

    kind = FindingKind
    if usable.refusals:
        return stop(Stop.LIMIT_NOT_USABLE, Finding.of(kind.LIMIT_NOT_CONFIRMABLE, *usable.refusals))
    warnings = usable.notes if math.isnan(conditions.device.stiffness) else ()
    ladder: OpeningLadder | BoundLadder
    if force_map is None or known is None or seen is None:
        if left <= 0:
            return stop(Stop.BUDGET, Finding.of(kind.BUDGET_SPENT, *no_bound, states=states, further=so_far + _FURTHER))
        expectation = expected_force or StandardExpectation.of(conditions)
        if expectation is None:
            raise InputError(
                "expected force: nothing tells it before there is a bound; state the robot's moving mass, or give a "
                "map of a similar robot"
            )
        ladder = OpeningLadder(expectation, highest, newtons, slowest, seen, place_range, tolerance)
        chosen = search.opening(candidates[ladder.allows(candidates)], known, min(batch, left), left)
        if not len(chosen):
            return stop(Stop.OUT_OF_REACH, Finding.of(kind.NONE_EXPECTED_WITHIN, force_N=highest), _saturated(seen))
        now = replace(now, reasons=(Finding.of(kind.OPENING, *no_bound),))
    else:
        ladder = BoundLadder(force_map, bound, highest, seen, place_range, tolerance)
        reach = _reach(force_map, targets, _AIM * level, slowest, fastest)
        can = ~np.isnan(reach)
        hopeless = _hopeless(bound.upper(force_map, targets[:, 0], targets[:, 1], slowest) > level, newtons, slowest)
        if not can.any():
            nowhere = Finding.of(kind.EXPECTED_NOWHERE, limit_N=newtons, slowest_mps=slowest)
            return stop(Stop.NOTHING_TO_GAIN, nowhere, hopeless)
        wanted = np.column_stack([targets, reach])[can]
        ahead = min(left, _AHEAD * batch) if left > 0 else _FURTHER
        candidates = candidates[ladder.allows(candidates)]
        planned = search.refining(candidates, known, wanted, wanted[~has_speed[can]], ahead)
        if not len(planned):
            return stop(Stop.OUT_OF_REACH, Finding.of(kind.NO_BOUND_WITHIN, force_N=highest), _saturated(seen))
        outlook = Outlook(force_map, bound, targets, level, fastest)
        before = share * outlook.speeds(planned[:0])
        raised = max(float(np.mean(share * outlook.speeds(planned) - before)), 0.0)
        each = raised / len(planned)
        gain = Finding.of(kind.GAIN_OF_MORE, states=len(planned), gain_mps=raised, each_mps=each)
        if left <= 0:
            return stop(Stop.BUDGET, Finding.of(kind.BUDGET_SPENT, gain, states=states, further=so_far + _FURTHER))
        if each < least_gain and so_far >= FEW_STATES:  # fewer that happen to scatter little would end a campaign
            return stop(Stop.NOTHING_TO_GAIN, hopeless, Finding.of(kind.TOO_LITTLE_GAIN, gain, least_mps=least_gain))
        chosen = search.first(planned, known, wanted, min(batch, left))
        after = share * outlook.speeds(chosen)
        these, slower = float(np.mean(after - before)), int(np.sum(chosen[:, 2] < known.speed.min()))
        below = {"slower": slower, "places": int(np.sum(can & ~has_speed))}
        fewest = FEW_STATES if each < least_gain and so_far < FEW_STATES else None
        later = Finding.of(kind.GAIN_LATER, gain, **below, fewest=fewest)
        reason = Finding.of(kind.GAIN_OF_THESE, gain_mps=these) if these > 0 else later
        warnings = (*warnings, *map_warnings(force_map, chosen))
        count, mean = int(np.sum(after > 0)), float(np.mean(after))
        now = replace(now, reasons=(reason,), expected_confirmed=count, expected_speed=mean)
    chosen = slow_to_fast(chosen)
    expected, source = ladder.expected(chosen), ladder.source(chosen)
    plan = runs_of(chosen, repeats, expected, expected_from=source, warnings=warnings)
    upper = np.repeat(ladder.upper(chosen), repeats)
    said = tuple(dict.fromkeys((*now.warnings, *plan.warnings)))
    return replace(now, plan=plan, upper_force=upper, upper_is=ladder.upper_is(), warnings=said)


def _limit_to_confirm(
    limit: ForceLimit | NewtonLimit | float,
    contact: Contact | None,
    conditions: Conditions,
    dataset: ImpactDataset | None,
) -> Basis:
    """The limit, and what of the impacts so far forbids it; one in newtons counts as quasi-static unless named."""
    stated = limit if isinstance(limit, ForceLimit) else NewtonLimit.of(limit, None, None)
    if isinstance(stated, ForceLimit):
        stated.require_permitted()
    elif np.ndim(stated.force):
        raise InputError("limit: expected one limit in newtons")
    phase_two, binding = (PhaseTwo(), Binding()) if dataset is None else (dataset.phase_two, dataset.binding)
    held = limit_basis(stated, contact, conditions, phase_two=phase_two, binding=binding)
    can_be_stated = dataset is None and math.isnan(conditions.device.stiffness)  # until there is a map
    return replace(held, refusals=()) if can_be_stated else held


def _check_budget(
    speeds: Sequence[float], batch: int, states: int | None, repeats: int, least_gain: float
) -> tuple[float, float]:
    """Slowest and fastest speed [m/s], after a look at the figures."""
    for name, number in (("batch", batch), ("states", states), ("repeats", repeats)):
        require_whole(name, number)
    if not 0 <= least_gain < math.inf:
        raise InputError(f"least gain: found {least_gain:g} m/s, expected a finite number of at least 0")
    given = [float(value) for value in speeds]
    if len(given) < 2 or not np.isfinite(given).all() or not 0 < min(given) < max(given) <= 10:
        raise InputError(f"speeds: found {list(speeds)}, expected (slowest, fastest) in metres per second, up to 10")
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
) -> tuple[NextMeasurements, Mask]:
    """What is confirmed so far, and at which places; without a map that carries the bound nothing is.

    The speed at contact that counts is a `share` of that of the map.
    """
    speed = np.full(len(places), math.nan)
    if force_map is not None and limit <= force_map.highest_force - force_map.conditions.device.error_or_default:
        speed = safe_speed(force_map, *places.T, limit=limit, bound=bound, contact=Contact.QUASI_STATIC).speed
    there = ~np.isnan(speed)
    if force_map is None:
        return NextMeasurements(len(places), 0, math.nan, 0, math.nan, simulated=False), there
    count, mean = int(there.sum()), share * float(np.nan_to_num(speed).mean())
    doubts = doubts_of_fit(force_map)
    return NextMeasurements(len(places), count, mean, count, mean, force_map.simulated, warnings=doubts), there


def _saturated(seen: States | None) -> Finding | None:
    """That states saturated the device, if any did: no impact as fast is planned there."""
    if seen is None or not (full := seen.select(seen.censored > 0)):
        return None
    slowest = float(full.speed.min())
    return Finding.of(FindingKind.DEVICE_WAS_SATURATED, states=len(full), of=len(seen), slowest_mps=slowest)


def _hopeless(exceeds: Mask, limit: float, slowest: float) -> Finding | None:
    """That the bound exceeds the limit at the slowest speed, if it does so nearly everywhere."""
    if np.mean(exceeds) < _NEARLY:
        return None
    figures = {"limit_N": limit, "slowest_mps": slowest, "all": bool(exceeds.all())}
    return Finding.of(FindingKind.EXCEEDED_EVERYWHERE, **figures, places=int(exceeds.sum()), of=exceeds.size)


def _reach(force_map: ForceMap, places: FloatArray, force: float, slowest: float, fastest: float) -> FloatArray:
    """Speed up to which the prediction stays within a force, shape (n,); NaN where it exceeds it at the slowest."""
    low, high, level = (np.full(len(places), value) for value in (slowest, fastest, math.log(force)))
    predicted = enclose(force_map, FixedMargin(0.0), Patches.of_places(*places.T), low, high)
    return predicted.speed(predicted.certified(level))


def _map_with_bound(
    dataset: ImpactDataset | None, form: Form, bound: ToleranceBound
) -> tuple[ForceMap | None, tuple[Finding, ...]]:
    """The map of what was measured; None where it or its bound cannot be had yet, and why."""
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
