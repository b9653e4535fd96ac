"""Which states to measure next: from nothing to confirmed speeds, slow to fast, never beyond a stated force."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.campaigns.state import States, StateTolerance
from forcemap.errors import BoundNotAvailable, FitError, InputError
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import MIN_DEGREES_OF_FREEDOM, ToleranceBound
from forcemap.maps.fit import fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_3D, Form
from forcemap.planning.expectation import Expectation
from forcemap.planning.ladder import BoundLadder, Ladder, OpeningLadder
from forcemap.planning.next.inputs import (
    check_budget,
    expectation_of,
    highest_force,
    limit_to_confirm,
    speeds_between,
)
from forcemap.planning.next.outlook import Outlook
from forcemap.planning.next.search import Search
from forcemap.planning.places import PlaceRange
from forcemap.planning.plan_warnings import map_warnings
from forcemap.planning.runs import runs_of
from forcemap.speeds.exceedance import first_exceedance
from forcemap.speeds.safe_speed import safe_speed

_PLACES = 9  # along each axis, at which confirmed speeds are counted
_CANDIDATE_PLACES = 5  # along each axis
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
    plan : MeasurementPlan or None
        Runs to add to the campaign's plan, slow to fast; None if it is time to stop.
    stop : Stop or None
        Why to stop.
    reason : str
        Why these states, or why to stop, in words.
    upper_force : array
        What the force of every run is not expected to exceed [N], shape (runs,): by the bound once there is one, and
        never below what was measured within 5 cm at a lower speed.
    upper_words : str
        What these figures are.
    places : int
        Number of places at which speeds are counted.
    confirmed, expected_confirmed : int
        Places with an admissible or capped speed: now, and expected after these runs.
    speed, expected_speed : float
        Mean over all places of the confirmed speed, 0 where there is none [m/s]: now, and expected after these runs;
        NaN where no bound can be had.
    simulated : bool
        True if the impacts so far are simulated.
    """

    plan: MeasurementPlan | None
    stop: Stop | None
    reason: str
    upper_force: FloatArray
    upper_words: str
    places: int
    confirmed: int
    speed: float
    expected_confirmed: int
    expected_speed: float
    simulated: bool = False


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

    While the states are too few for a bound, an opening: the corners of the place range at the slowest speed, then
    states that determine the form best, none but the slowest expected above the limit. Afterwards the states that
    make the prediction most precise where it reaches the limit: I-optimal for all states left in the budget, of
    these the most useful batch; and the corners at a slow speed where places lie below every measured speed.

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
        Stop where a further state is expected to raise the mean confirmed speed by less [m/s].
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
    ('d890-h140-v50', 'd890-h460-v50', 'd705-h300-v50', 'd520-h140-v50')
    """
    dataset = measured if isinstance(measured, ImpactDataset) and len(measured.train) else None
    known = dataset.train.states if dataset is not None else None
    seen = measured.states if isinstance(measured, ImpactDataset) else None
    conditions = measured.conditions if isinstance(measured, ImpactDataset) else measured
    if not isinstance(bound, ToleranceBound):
        raise InputError(f"bound: found {bound!r}, expected a ToleranceBound: a margin does not tell what is gained")
    usable = limit_to_confirm(limit, contact, conditions, dataset)
    newtons, level = float(usable.newtons), float(usable.level)
    slowest, fastest = check_budget(speeds, batch, states, repeats, least_gain)
    highest = highest_force(conditions, dataset, largest_force, newtons)
    place_range = PlaceRange.of(distances, heights, known)
    tolerance = StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)
    tolerance = dataset.tolerance if dataset is not None else tolerance
    search = Search(place_range, form, tolerance, seed)
    candidates = place_range.states(_CANDIDATE_PLACES, speeds_between(slowest, fastest))
    so_far = len(known) if known is not None else 0
    left = (max(_BUDGET, so_far + _FURTHER) if states is None else states) - so_far
    force_map, no_bound = _map_with_bound(dataset, form, bound)
    targets = place_range.grid(_PLACES)
    now = _Now.of(force_map, targets, level, bound)

    if usable.refusal:
        return now.stop(Stop.LIMIT_NOT_USABLE, f"this limit cannot be confirmed: {usable.refusal}")
    ladder: Ladder
    warnings: tuple[str, ...] = ()
    if force_map is None or known is None or seen is None:
        if left <= 0:
            return now.stop(Stop.BUDGET, _spent(so_far, states, no_bound))
        ladder = OpeningLadder(
            expectation_of(expected_force, conditions), highest, newtons, slowest, seen, place_range, tolerance
        )
        candidates = candidates[ladder.allows(candidates)]
        chosen = search.opening(candidates, known, min(batch, left), left)
        if not len(chosen):
            within = f"no state is left that is expected to stay within {highest:g} N"
            return now.stop(Stop.OUT_OF_REACH, f"{within}{_saturated(seen)}")
        expected = (0, math.nan)
        reason = f"opening: {no_bound}"
    else:
        ladder = BoundLadder(force_map, bound, highest, seen, place_range, tolerance)
        reach = _reach(force_map, targets, _AIM * level, slowest, fastest)
        can = ~np.isnan(reach)
        hopeless = _hopeless(bound.upper(force_map, targets[:, 0], targets[:, 1], slowest) > level, newtons, slowest)
        if not can.any():
            nowhere = f"{newtons:g} N is expected nowhere to be confirmed at {slowest:g} m/s or more"
            return now.stop(Stop.NOTHING_TO_GAIN, f"{nowhere}: {hopeless}" if hopeless else nowhere)
        wanted = np.column_stack([targets, reach])[can]
        unconfirmed = wanted[~now.has_speed[can]]
        candidates = candidates[ladder.allows(candidates)]
        ahead = min(left, _AHEAD * batch) if left > 0 else _FURTHER
        planned = search.refining(candidates, known, wanted, unconfirmed, ahead)
        if not len(planned):
            within = f"no state is left whose bound stays within {highest:g} N"
            return now.stop(Stop.OUT_OF_REACH, f"{within}{_saturated(seen)}")
        outlook = Outlook(force_map, bound, targets, level, fastest)
        before, all_after = outlook.speeds(planned[:0]), outlook.speeds(planned)
        raised = max(float(np.mean(all_after - before)), 0.0)
        gain = (
            f"{len(planned)} further states are expected to raise the mean confirmed speed by {raised:.4f} m/s, "
            f"{raised / len(planned):.5f} m/s a state"
        )
        if left <= 0:
            return now.stop(Stop.BUDGET, _spent(so_far, states, gain))
        if raised / len(planned) < least_gain:
            least = f"{gain}, less than {least_gain:g} m/s a state"
            return now.stop(Stop.NOTHING_TO_GAIN, f"{hopeless}; {least}" if hopeless else least)
        chosen = search.first(planned, known, wanted, min(batch, left))
        after = outlook.speeds(chosen)
        expected = (int(np.sum(after > 0)), float(np.mean(after)))
        reason = f"expected to raise the mean confirmed speed by {float(np.mean(after - before)):.4f} m/s"
        warnings = tuple(map_warnings(force_map, chosen))
    order = np.lexsort((chosen[:, 1], -chosen[:, 0], chosen[:, 2]))
    chosen = chosen[order]
    return NextMeasurements(
        plan=runs_of(
            chosen,
            repeats,
            ladder.expected(chosen),
            expected_from=ladder.source(chosen),
            warnings=(*(usable.statements if math.isnan(conditions.device.stiffness) else ()), *warnings),
        ),
        stop=None,
        reason=reason,
        upper_force=np.repeat(ladder.upper(chosen), repeats),
        upper_words=ladder.upper_words(),
        places=len(targets),
        confirmed=int(now.has_speed.sum()),
        speed=now.mean,
        expected_confirmed=expected[0],
        expected_speed=expected[1],
        simulated=now.simulated,
    )


@dataclass(frozen=True, eq=False)
class _Now:
    """What is confirmed so far, at the places at which speeds are counted."""

    has_speed: Mask
    mean: float
    simulated: bool = False

    @classmethod
    def of(cls, force_map: ForceMap | None, places: FloatArray, limit: float, bound: ToleranceBound) -> _Now:
        """From a map that carries the bound; without one nothing is confirmed."""
        if force_map is None:
            return cls(np.zeros(len(places), dtype=np.bool_), math.nan)
        if limit > force_map.highest_force - force_map.conditions.device.error_or_default:
            return cls(np.zeros(len(places), dtype=np.bool_), 0.0, force_map.simulated)
        found = safe_speed(force_map, *places.T, limit=limit, bound=bound, contact=Contact.QUASI_STATIC)
        speed = np.nan_to_num(found.speed)
        return cls(~np.isnan(found.speed), float(speed.mean()), force_map.simulated)

    def stop(self, why: Stop, reason: str) -> NextMeasurements:
        """The answer that nothing more is to be measured."""
        confirmed = int(self.has_speed.sum())
        return NextMeasurements(
            plan=None,
            stop=why,
            reason=reason,
            upper_force=np.empty(0),
            upper_words="",
            places=self.has_speed.size,
            confirmed=confirmed,
            speed=self.mean,
            expected_confirmed=confirmed,
            expected_speed=self.mean,
            simulated=self.simulated,
        )


def _saturated(seen: States | None) -> str:
    """That states saturated the device, if any did: no impact as fast is planned there."""
    if seen is None or not (full := seen.select(seen.censored > 0)):
        return ""
    return (
        f"; the device was saturated at {len(full)} of {len(seen)} states, from {full.speed.min():.3g} m/s up: measure "
        "with a device of larger range, or begin slower"
    )


def _spent(so_far: int, budget: int | None, gain: str) -> str:
    """That the budget is spent, and what more states would give."""
    further = so_far + _FURTHER
    return f"the campaign has the {budget} states of its budget; --states {further} lets it go on: {gain}"


def _hopeless(exceeds: Mask, limit: float, slowest: float) -> str:
    """That the bound exceeds the limit at the slowest speed, if it does so nearly everywhere."""
    if np.mean(exceeds) < _NEARLY:
        return ""
    where = "everywhere" if exceeds.all() else "nearly everywhere"
    return (
        f"{limit:g} N is exceeded at {slowest:g} m/s {where} (by the bound, at {int(exceeds.sum())} of {exceeds.size} "
        "places)"
    )


def _reach(force_map: ForceMap, places: FloatArray, force: float, slowest: float, fastest: float) -> FloatArray:
    """Speed up to which the prediction stays within a force, shape (n,); NaN where it exceeds it at the slowest."""

    def log_force(place: Indices, speed: FloatArray) -> FloatArray:
        at = places[place]
        return np.asarray(np.log(np.clip(force_map.predict(at[:, :1], at[:, 1:], speed), 1e-300, 1e300)))

    ends = np.full(len(places), slowest), np.full(len(places), fastest)
    return first_exceedance(log_force, *ends, np.full(len(places), math.log(force)))[0]


def _map_with_bound(dataset: ImpactDataset | None, form: Form, bound: ToleranceBound) -> tuple[ForceMap | None, str]:
    """The map of what was measured; None where it or its bound cannot be had yet, and why."""
    fewest = len(form.terms) + MIN_DEGREES_OF_FREEDOM
    uncensored = 0 if dataset is None else len(dataset.train.states.uncensored)
    too_few = f"no bound can be had from fewer than {fewest} states of {form.name}, found {uncensored}"
    if dataset is None:
        return None, too_few
    try:
        force_map = fit_force_map(dataset, form=form)
        bound.require(force_map)
    except (FitError, BoundNotAvailable) as refusal:
        return None, too_few if uncensored < fewest else f"no bound can be had yet: {refusal.message}"
    return force_map, ""
