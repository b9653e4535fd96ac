"""A few impacts at the released speeds, to confirm a map before its speeds are used, and the rule that judges them."""

from __future__ import annotations

import contextlib
import math
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.dataset import Conditions, ImpactDataset, PhaseTwo, Quantity
from forcemap.campaigns.phase_two import MOST_SINKING
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.campaigns.state import CONFIRMING, StateTolerance
from forcemap.errors import BoundNotAvailable, FitError, NotReleasable
from forcemap.findings import Finding, FindingKind
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.above_bound import unit_of
from forcemap.maps.bounds import PAPER_MARGIN, Bound, weakness
from forcemap.maps.force_map import NO_STATES, Fit, ForceMap
from forcemap.maps.forms import Form
from forcemap.maps.places import LEAST_BETWEEN, place_regression
from forcemap.maps.regression import Regression
from forcemap.planning.design import require_whole
from forcemap.planning.measured_before import measured_before
from forcemap.planning.places import PlaceRange, no_repeats, spread
from forcemap.planning.plan_warnings import map_warnings
from forcemap.planning.runs import extend_plan, runs_of, slow_to_fast
from forcemap.speeds.basis import of_quantity, unconfirmed
from forcemap.speeds.quantities import named_by
from forcemap.speeds.safe_speed import SafeSpeed, SpeedOutcome, floor_speed, safe_speed

IMPACTS = 6
"""Impacts that confirm a map, unless stated. A choice: what they detect is printed with every plan
(docs/short_campaigns.md)."""

_FEWEST = 2  # of them: one at the fastest and one at the slowest released speed
_PLACES = 15  # along each axis, to choose from; a choice
_AS_RELEASED = 0.010  # [m/s]; how far from the speed released now, however far repeats of a state may lie apart
_SAME_SPEED = 5e-4  # [m/s]; half of the last digit to which released speeds are cut

# Robots that the impacts should detect: the shapes are those of docs/validity.md.
_HIGHER = 1 + PAPER_MARGIN  # factor on the force everywhere
RIDGE, BUMP = 0.15, 0.25  # share of the force at the middle of a shape that no form has
ACROSS = 0.08  # [m]; from where such a shape has risen to 1/e to where it has fallen to it again

_MEASURE = (  # why no place has a speed, if further impacts can change that
    FindingKind.UNCONFIRMED,
    FindingKind.BELOW_MEASURED,
    FindingKind.OUTSIDE,
    FindingKind.REACHED_AT_PLACE,
    FindingKind.TEST_STATES_ABOVE,
    FindingKind.EXCEEDED_WHERE_PERMITTED,
    FindingKind.POINTS_ABOVE_BOUND,
    FindingKind.CONFIRMING_ABOVE_BOUND,
    FindingKind.NONE_CAN_BE_CONFIRMED,
)


_FASTER = FindingKind.FASTER_THAN_RELEASED


class Confirmed(StrEnum):
    """Whether an impact, or all of them, confirm a map; `cannot_tell` is no permission."""

    PASSES = "passes"
    DOES_NOT_PASS = "does_not_pass"
    CANNOT_TELL = "cannot_tell"


@dataclass(frozen=True)
class ConfirmingImpact:
    """One impact at a released speed.

    Parameters
    ----------
    recording, state : str
        Name of the raw file, or of the run where no impact of it can be used; name of the state.
    distance, height, speed : float
        Place [m], [m] and speed at contact [m/s].
    force, bound_force : float
        Peak force and the bound there [N]; a force of NaN is not known.
    outcome : Confirmed
    reason : Finding
        Why.
    above_bound : bool
        True if its force, or another quantity that the limit names, lies above the bound there.
    """

    recording: str
    state: str
    distance: float
    height: float
    speed: float
    force: float
    bound_force: float
    outcome: Confirmed
    reason: Finding
    above_bound: bool = False

    def near_limit(self, within: float) -> bool:
        """Whether it does not pass, or cannot tell, by its force, which the bound allows: it agrees with the map."""
        return self.outcome is not Confirmed.PASSES and within < self.force and not self.above_bound

    def too_fast_for(self, released: float, within: float) -> ConfirmingImpact | None:
        """The same as telling nothing, if its force alone is too high, above the speed released now [m/s]; else None.

        `within` is the force up to which an impact is within the limit [N].
        """
        if not self.near_limit(within) or self.speed <= released + _SAME_SPEED:
            return None
        figures = {"speed_mps": self.speed, "released_mps": released}
        return replace(self, outcome=Confirmed.CANNOT_TELL, reason=Finding.of(_FASTER, self.reason, **figures))


@dataclass(frozen=True)
class ConfirmationResult:
    """Whether the impacts at released speeds confirm the map.

    Parameters
    ----------
    impacts : tuple of ConfirmingImpact
        Every impact measured; of those planned for other speeds the ones that contradict the map.
    missing : tuple of str
        Planned runs without an impact.
    outcome : Confirmed
    reason : Finding
        Why.
    bump_missed : float
        1 less `bump_detected` of the plan: how often impacts like these do not see it; NaN if it is unknown.
    settled : tuple of ConfirmingImpact
        Impacts that cannot tell, not censored and with a force within the limit, of whose state another one passes:
        they count for nothing.
    """

    impacts: tuple[ConfirmingImpact, ...]
    missing: tuple[str, ...]
    outcome: Confirmed
    reason: Finding
    bump_missed: float = math.nan
    settled: tuple[ConfirmingImpact, ...] = ()

    @property
    def missed(self) -> dict[str, float]:
        """What the impacts would have missed, as sentences name it: how often, how much more force, how wide [m]."""
        return {"missed": self.bump_missed, "more": BUMP, "across_m": ACROSS}


_Checked = tuple[bool | None, Finding]  # whether a recording is within its limit, and why


@dataclass(frozen=True, eq=False)
class ConfirmationPlan:
    """Impacts at released speeds, and the rule by which they confirm the map.

    Parameters
    ----------
    plan : MeasurementPlan
        One run a state, slow to fast, all with role test; without runs where no speed is released.
    added : MeasurementPlan
        Those of them that were not planned before.
    earlier : MeasurementPlan
        Confirming runs planned before at other speeds, for another limit or map.
    replaced : MeasurementPlan
        Confirming runs planned before at nearly the speeds released now, without a recording: to be taken out.
    released : array
        Speed at contact released now at each run of `plan` [m/s].
    bound_force : array
        Bound at each run of `plan` [N].
    earlier_released : array
        Speed released now at each run of `earlier` [m/s]; NaN where there is none.
    limit : float
        Force limit [N].
    refusal : Finding or None
        Why no speed is released; None if there is one.
    warnings : tuple of Finding
        Doubts about the map, or about an impact as a test.
    rule : Finding
        When the impacts confirm the map.
    not_passed : float
        Probability that a sound map does not pass if new states scatter as its own did; NaN if their scatter is
        unknown.
    above_bound : float
        Probability that an impact of a sound map lies above the bound; NaN likewise.
    higher_detected : float
        Probability that a force 10 % above the map's does not pass; NaN likewise.
    ridge_detected, bump_detected : float
        The same for a force that is 15 % above the map's at some distance, or 25 % at some place, and 1/e of that 4 cm
        beside it (`RIDGE`, `BUMP`, `ACROSS`); mean over the distances, or places, of the measured range.
    force_map : ForceMap
        The map to be confirmed.
    bound : Bound
        The bound that released the speeds.
    others : tuple of ForceMap
        Maps of other quantities that the limit names. With one of the pressure an impact without it confirms nothing.
    result : ConfirmationResult or None
        Whether the impacts confirm the map; None before `judged`, and before one is measured.
    """

    plan: MeasurementPlan
    added: MeasurementPlan
    earlier: MeasurementPlan
    replaced: MeasurementPlan
    released: FloatArray
    bound_force: FloatArray
    earlier_released: FloatArray
    limit: float
    refusal: Finding | None
    warnings: tuple[Finding, ...]
    rule: Finding
    not_passed: float
    above_bound: float
    higher_detected: float
    ridge_detected: float
    bump_detected: float
    force_map: ForceMap
    bound: Bound
    others: tuple[ForceMap, ...] = ()
    result: ConfirmationResult | None = None

    @property
    def most_force(self) -> FloatArray:
        """The force up to which an impact at each run of `plan` passes [N]: the bound, or the limit less the error."""
        return np.minimum(self.bound_force, self.limit - self.force_map.conditions.device.error_or_default)

    @property
    def pressed(self) -> bool:
        """True if the speeds rest on pressures, too."""
        return any(other.quantity is Quantity.PRESSURE for other in self.others)

    @property
    def superseded(self) -> tuple[str, ...]:
        """States that do not pass for impacts above the speed released now alone: others take their place."""
        impacts = self.result.impacts if self.result else ()
        faster = dict.fromkeys(each.state for each in impacts if each.reason.kind is _FASTER)
        stay = {
            each.state for each in impacts if each.outcome is not Confirmed.PASSES and each.reason.kind is not _FASTER
        }
        return tuple(state for state in faster if state not in stay)

    @staticmethod
    def among(plan: MeasurementPlan) -> Mask:
        """Which runs of a plan confirm a map, shape (n,)."""
        return np.asarray(np.char.startswith(plan.state_id, CONFIRMING) & (plan.role == "test"))

    @property
    def more_helps(self) -> bool:
        """Whether further impacts may lead to a speed; False if something else that forbids every speed comes first."""
        reason = self.refusal and (self.refusal.also or (self.refusal,))[0]
        return reason is None or reason.kind in _MEASURE

    def judged(self, impacts: ImpactDataset, checked: Mapping[str, _Checked]) -> ConfirmationPlan:
        """The same plan with its result: whether the measured impacts confirm the map by the rule.

        If they do not, no further ones are added, and none are replaced.

        Parameters
        ----------
        impacts : ImpactDataset
            The campaign's impacts.
        checked : mapping of str to (bool or None, Finding)
            By recording, or by run where a recording gave no impact that can be used: True if it is within the limit,
            False if it exceeds it, None if that cannot be told; and why.
        """
        judged = _judged(self, self.plan, self.released, impacts, checked)
        # One that fails faster than is released now, but below the bound there, agrees with the map.
        speeds = dict(zip(self.plan.state_id.tolist(), self.released.tolist(), strict=True))
        within = math.inf if self.pressed else self.limit - self.force_map.conditions.device.error_or_default
        known = {*impacts.recording[~impacts.censored].tolist()}  # how far a censored one lies above is not
        judged = [
            (impact.recording in known and impact.too_fast_for(speeds[impact.state], within)) or impact
            for impact in judged
        ]
        missing = ~np.isin(self.plan.state_id, [impact.state for impact in judged])
        released = dict(zip(self.earlier.state_id.tolist(), self.earlier_released.tolist(), strict=True))
        # Planned for another speed than is released now, one that fails contradicts the map no faster than that, and
        # above the bound there at any speed.
        judged += [
            impact
            for impact in _judged(self, self.earlier, self.earlier_released, impacts, checked)
            if impact.outcome is Confirmed.DOES_NOT_PASS
            and (impact.speed <= released[impact.state] + _SAME_SPEED or impact.above_bound)
        ]
        if not judged:
            return replace(self, result=None)
        passed = {impact.state for impact in judged if impact.outcome is Confirmed.PASSES}
        settled = [
            impact
            for impact in judged
            if impact.outcome is Confirmed.CANNOT_TELL
            and impact.state in passed
            and impact.recording in known
            and impact.force <= within
        ]
        judged = [impact for impact in judged if impact not in settled]
        near = sum(impact.near_limit(within) and impact.reason.kind is not _FASTER for impact in judged)
        outcome, reason = _overall(self, judged, int(missing.sum()), near, len(settled))
        planned = self
        if outcome is Confirmed.DOES_NOT_PASS:
            before = ~np.isin(self.plan.recording, self.added.recording)
            missing &= before
            none = self.added.select(np.arange(0))
            planned = replace(self, plan=self.plan.select(before), added=none, replaced=none)
            planned = replace(planned, released=self.released[before], bound_force=self.bound_force[before])
        names = tuple(self.plan.recording[missing].tolist())
        result = ConfirmationResult(
            tuple(judged), names, outcome, reason, 1 - self.bump_detected, settled=tuple(settled)
        )
        return replace(planned, result=result)


def _overall(
    plan: ConfirmationPlan, judged: list[ConfirmingImpact], missing: int, near: int, settled: int
) -> tuple[Confirmed, Finding]:
    """Whether all impacts together confirm the map, and why; `near` of them are too near the limit to be told, and of
    `settled` further ones a repeat passes."""
    count, kind = Counter(impact.outcome for impact in judged), FindingKind
    if failed := count[Confirmed.DOES_NOT_PASS]:
        return Confirmed.DOES_NOT_PASS, Finding.of(kind.IMPACTS_FAILED, impacts=failed, of=len(judged))
    if plan.refusal:
        return Confirmed.DOES_NOT_PASS, Finding.of(kind.RELEASE_NOTHING, plan.refusal)
    if missing:
        return Confirmed.CANNOT_TELL, Finding.of(kind.RUNS_MISSING, runs=missing, of=len(plan.plan))
    if unknown := count[Confirmed.CANNOT_TELL]:
        of = {"impacts": unknown, "of": len(judged), "near": near or None}
        return Confirmed.CANNOT_TELL, Finding.of(kind.IMPACTS_CANNOT_TELL, **of)
    names = tuple(other.quantity.words for other in plan.others)
    shown: dict[str, Any] = {"limit_N": plan.limit, "others": names, "settled": settled or None}
    return Confirmed.PASSES, Finding.of(kind.IMPACTS_PASSED, impacts=len(judged), **shown)


def _judged(
    plan: ConfirmationPlan,
    runs: MeasurementPlan,
    released: FloatArray,
    impacts: ImpactDataset,
    checked: Mapping[str, _Checked],
) -> list[ConfirmingImpact]:
    """Every impact of the runs' states, slow to fast, and the runs whose recording gave no usable impact."""
    judged, done, unlike = [], set[str](), _sinking_unlike_map(impacts)
    columns = (runs.recording, runs.state_id, *_states_of(runs, plan.force_map.conditions).T, released)
    measured = (impacts.speed, impacts.peak_force, impacts.recording)
    for name, state, d, h, v, now in zip(*(column.tolist() for column in columns), strict=True):
        rows = np.flatnonzero(impacts.state == state).tolist()
        for row in [] if state in done else rows:  # repeats of a state are several runs, and each impact counts once
            speed, force, recording = (column[row].item() for column in measured)
            upper = float(plan.bound.upper(plan.force_map, d, h, speed))
            within = checked.get(recording, (None, Finding.of(FindingKind.RECORDING_NOT_CHECKED)))
            above = _above_bound(plan, impacts, row, (d, h, speed))
            outcome, reason = _outcome(force, upper, within, above, bool(impacts.censored[row]))
            place = impacts.distance[row], impacts.height[row]
            if outcome is Confirmed.PASSES and row in unlike:
                outcome, reason = Confirmed.CANNOT_TELL, Finding.of(FindingKind.SINKS_UNLIKE_MAP)
            if outcome is Confirmed.PASSES and plan.pressed and math.isnan(impacts.peak_pressure[row]):
                outcome, reason = Confirmed.CANNOT_TELL, Finding.of(FindingKind.CONFIRM_WITH_FILM)
            if outcome is Confirmed.PASSES and now - speed > min(impacts.tolerance.speed, _AS_RELEASED):
                outcome = Confirmed.CANNOT_TELL
                reason = Finding.of(FindingKind.SLOWER_THAN_RELEASED, speed_mps=speed, released_mps=now)
            if outcome is Confirmed.PASSES and max(abs(place[0] - d), abs(place[1] - h)) > impacts.tolerance.scale[0]:
                outcome = Confirmed.CANNOT_TELL
                reason = Finding.of(FindingKind.NOT_WHERE_PLANNED, distance_m=place[0].item(), height_m=place[1].item())
            judged.append(
                ConfirmingImpact(recording, state, d, h, speed, force, upper, outcome, reason, above is not None)
            )
        done.add(state)
        if not rows and name in checked:
            upper = float(plan.bound.upper(plan.force_map, d, h, v))
            outcome = Confirmed.DOES_NOT_PASS if checked[name][0] is False else Confirmed.CANNOT_TELL
            judged.append(ConfirmingImpact(name, state, d, h, v, math.nan, upper, outcome, checked[name][1]))
    return judged


def _sinking_unlike_map(impacts: ImpactDataset) -> set[int]:
    """The impacts whose force sinks slowly to zero, where that of those that are to be fitted does not: none where it
    does of some of these, too, for a robot may let go slowly."""
    sinks, train = impacts.sinks, impacts.role == "train"
    return set() if sinks[train].sum() > MOST_SINKING * train.sum() else set(np.flatnonzero(sinks & ~train).tolist())


def _above_bound(
    plan: ConfirmationPlan, impacts: ImpactDataset, row: int, state: tuple[float, float, float]
) -> Finding | None:
    """That an impact lies above the bound of the force, or of another quantity that the limit names; else None."""
    for each in (plan.force_map, *plan.others):
        measured, upper = impacts.shown(each.quantity)[row].item(), float(plan.bound.upper(each, *state))
        if measured > upper:
            at_least = impacts.shown_at_least(each.quantity)[row].item()
            figures = {"force_N": measured, "bound_N": upper, "at_least": at_least, **unit_of(each.quantity)}
            return of_quantity(each.quantity, Finding.of(FindingKind.ABOVE_BOUND, **figures))
    return None


def _outcome(
    force: float, upper: float, checked: _Checked, above: Finding | None, censored: bool
) -> tuple[Confirmed, Finding]:
    """An impact by the rule: within the limit, and not above the bound."""
    within, why = checked
    if within is False:
        return Confirmed.DOES_NOT_PASS, why
    if above:
        return Confirmed.DOES_NOT_PASS, above
    if within is None:
        return Confirmed.CANNOT_TELL, why
    if censored:
        return Confirmed.CANNOT_TELL, Finding.of(FindingKind.DEVICE_RANGE_EXCEEDED, force_N=force)
    return Confirmed.PASSES, why.and_(Finding.of(FindingKind.BOUND_THERE, bound_N=upper))


def confirm_plan(
    force_map: ForceMap,
    limit: ForceLimit | NewtonLimit | float,
    *,
    bound: Bound,
    contact: Contact | None = None,
    impacts: int | None = None,
    planned: MeasurementPlan | None = None,
    recorded: Collection[str] | None = None,
    superseded: Collection[str] = (),
) -> ConfirmationPlan:
    """Plan a few impacts at released speeds: the fastest, the slowest, and where a wrong form would show.

    The latter lie far from every measured state, and from each other, in distance, height and speed: between the places
    and speeds that the map was fitted to. The impacts confirm the map if each of them is within the limit by
    `check_impact` (its force and the device's error stay below it) and none lies above the bound. They are no repeats
    of the map's states, which share its error. Released speeds are speeds at contact; where one leaves no speed to
    program, it is not confirmed.

    A confirming state planned before whose speed is as close to the one released now as repeats may be stands for it if
    there is a recording of it, or if the speeds are the same; else it is replaced.

    Parameters
    ----------
    force_map : ForceMap
        The map whose speeds are to be released.
    limit : float, NewtonLimit or ForceLimit
        Force limit [N]; or the limits of a body area together with `contact`.
    bound : Bound
        The bound that released the speeds.
    contact : Contact, optional
        Kind of contact, as in `safe_speed`.
    impacts : int, optional
        Number of impacts, at least 2, 6 if not given; more if more are planned already for these speeds.
    planned : MeasurementPlan, optional
        The campaign's plan. Nothing is added as close to its test states as repeats may be.
    recorded : collection of str, optional
        Names of its states that have a recording; all if not given: nothing is then replaced.
    superseded : collection of str
        Confirming states planned before that stand for none, as close as their speeds are.

    Returns
    -------
    ConfirmationPlan

    Raises
    ------
    InputError
        Fewer than 2 impacts are asked for.
    BoundNotAvailable
        The map cannot carry the bound.
    NotReleasable
        A weak bound.

    Examples
    --------
    >>> from forcemap import FixedMargin, published_map
    >>> confirmation = confirm_plan(published_map("ur10e"), 280.0, bound=FixedMargin(0.10))
    >>> len(confirmation.plan), confirmation.plan.recording[-1].item()
    (6, 'c-d890-h460-v362-r1')
    """
    require_whole("impacts", impacts, _FEWEST)
    if isinstance(limit, ForceLimit):
        limit.require_permitted()
    if weakness(bound, force_map):
        raise NotReleasable(f"nothing is released with a WEAK BOUND: {bound}")
    conditions, count = force_map.conditions, IMPACTS if impacts is None else int(impacts)
    tolerance = StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)
    places = _grid(force_map, tolerance)
    released = safe_speed(force_map, places[:, 0], places[:, 1], limit=limit, bound=bound, contact=contact)
    newtons, usable = float(released.limit), ~np.isnan(released.speed_to_program)
    whole = planned or runs_of(np.empty((0, 3)), 1, np.empty(0))
    before = _PlannedBefore.sorted_from(whole, force_map, limit, bound, contact, recorded, superseded, tolerance)
    states = np.column_stack([places, conditions.at_contact(_released(released.speed, conditions))])[usable]
    gone = np.isin(whole.recording, before.replaced.recording) | np.isin(whole.state_id, list(superseded))
    tests = _states_of(whole.select((whole.role == "test") & ~gone), conditions)
    candidates, warnings = _worth_confirming(force_map, bound, states[no_repeats(states, tests, tolerance)], tolerance)
    new = _farthest(force_map, candidates, np.unique(_states_of(before.valid, conditions), axis=0), count)
    added = _added_runs(force_map, new)
    both = extend_plan(before.valid, added)
    order = np.lexsort((both.height, -both.distance, both.speed))
    plan, at_contact = both.select(order), np.append(before.valid_speed, new[:, 2])[order]
    states, refusal = _states_of(plan, conditions), _refusal(released, plan, newtons)
    upper = np.asarray(bound.upper(force_map, *states.T))
    if refusal is None and len(plan) < count:
        warnings.append(Finding.of(FindingKind.FEWER_THAN_ASKED, impacts=len(plan), asked=count))
    others = _with_bound(named_by(force_map, limit, contact), bound)
    film = [Finding.of(FindingKind.CONFIRM_WITH_FILM) for other in others if other.quantity is Quantity.PRESSURE]
    doubts = _doubts(force_map, plan, states, upper, tolerance)
    asked = unconfirmed(released.basis.warnings)  # which is what the impacts are planned for
    of_speeds = [each for each in released.basis.warnings if each not in asked]
    warnings = list(dict.fromkeys([*film, *of_speeds, *warnings, *doubts]))
    most = np.minimum(newtons - conditions.device.error_or_default, upper)
    return ConfirmationPlan(
        plan=replace(plan, warnings=tuple(warnings)),
        added=added,
        earlier=before.earlier,
        replaced=before.replaced,
        released=at_contact,
        bound_force=upper,
        earlier_released=before.earlier_speed,
        limit=newtons,
        refusal=refusal,
        warnings=tuple(warnings),
        rule=_rule(len({*plan.state_id.tolist()}), newtons, conditions, others),
        **_probabilities(force_map, places, states, most, upper),
        force_map=force_map,
        bound=bound,
        others=others,
    )


@dataclass(frozen=True, eq=False)
class _PlannedBefore:
    """Confirming runs planned before.

    Parameters
    ----------
    valid, earlier, replaced : MeasurementPlan
        Those that still stand; those at other speeds, for another limit or map; those to be taken out.
    valid_speed, earlier_speed : array
        Speed at contact released now at each run of `valid` and `earlier` [m/s].
    """

    valid: MeasurementPlan
    earlier: MeasurementPlan
    replaced: MeasurementPlan
    valid_speed: FloatArray
    earlier_speed: FloatArray

    @classmethod
    def sorted_from(
        cls,
        plan: MeasurementPlan,
        force_map: ForceMap,
        limit: ForceLimit | NewtonLimit | float,
        bound: Bound,
        contact: Contact | None,
        recorded: Collection[str] | None,
        superseded: Collection[str],
        tolerance: StateTolerance,
    ) -> _PlannedBefore:
        """The confirming runs of a campaign's plan; arguments as in `confirm_plan`.

        The impacts to be judged must not decide which of them are judged, so the map is taken without its test states
        and Phase II. A limit in newtons then needs a named contact; whether it may be used is decided elsewhere.
        """
        runs = plan.select(ConfirmationPlan.among(plan))
        conditions, blind = force_map.conditions, force_map
        if force_map.fit is not None:
            without = tuple(_without_tests(other) for other in force_map.others)
            blind = replace(_without_tests(force_map), phase_two=PhaseTwo(), others=without)
        kind = contact or Contact.QUASI_STATIC
        speeds = safe_speed(blind, runs.distance, runs.height, limit=limit, bound=bound, contact=kind)
        now = _released(speeds.speed, conditions)
        apart = np.abs(now - runs.speed)
        current = (apart <= min(tolerance.scale[2], _AS_RELEASED * (1 + 1e-9))) & ~np.isin(
            runs.state_id, list(superseded)
        )
        same = (apart < _SAME_SPEED) & ~np.isnan(speeds.speed_to_program)
        stays = same | (recorded is None) | np.isin(runs.state_id, list(recorded or ()))
        valid, earlier, replaced = (runs.select(rows) for rows in (current & stays, ~current, current & ~stays))
        at_contact = conditions.at_contact(now[current & stays]), conditions.at_contact(now[~current])
        return cls(valid, earlier, replaced, *at_contact)


def _without_tests(force_map: ForceMap) -> ForceMap:
    """A fitted map as if no state had role test; what is slower than it holds for stays."""
    return replace(force_map, fit=replace(force_map.require_fit(), test=NO_STATES, slower=force_map.slower))


def _grid(force_map: ForceMap, tolerance: StateTolerance) -> FloatArray:
    """Places in the box around the measured range to choose from, shape (n, 2) [m]."""
    lowest, highest = force_map.measured_range.lowest, force_map.measured_range.highest
    box = PlaceRange((lowest[0], highest[0]), (lowest[1], highest[1]))
    return np.unique(box.grid(_PLACES, tolerance.place), axis=0)


def _farthest(force_map: ForceMap, candidates: FloatArray, planned: FloatArray, count: int) -> FloatArray:
    """The candidates that complete `count` planned states, slow to fast, shape (n, 3).

    They lie far from all measured and planned states and from each other, in distance, height and speed. Without
    planned ones the fastest and the slowest come first.
    """
    if not len(candidates) or count <= len(planned):
        return np.empty((0, 3))
    measured = force_map.measured_range.points
    every = np.vstack([measured, planned, candidates])
    known, size = len(measured) + len(planned), np.ptp(measured, axis=0)
    scaled = every / np.where(size > 0, size, 1.0)
    ends = [] if len(planned) else [known + int(candidates[:, 2].argmax()), known + int(candidates[:, 2].argmin())]
    away = np.linalg.norm(scaled[:, None] - scaled, axis=2)
    picked = spread(away, [*range(known), *ends], len(measured) + count)
    return slow_to_fast(every[[i for i in picked if i >= known]])


def _added_runs(force_map: ForceMap, states: FloatArray) -> MeasurementPlan:
    """Confirming runs of states, shape (n, 3), with their speeds at contact; the plan states speeds as the campaign."""
    expected = np.asarray(force_map.predict(*states.T))
    stated = np.column_stack([states[:, :2], force_map.conditions.as_stated(states[:, 2])])
    source = Finding.of(FindingKind.MAP_NAMED, name=force_map.name)
    return runs_of(stated, 1, expected, role="test", prefix=CONFIRMING, expected_from=source)


def _refusal(released: SafeSpeed, plan: MeasurementPlan, limit: float) -> Finding | None:
    """Why no speed is released; None if there is one to confirm."""
    if np.isnan(released.speed_to_program).all():
        inside = released.outcome != SpeedOutcome.OUTSIDE
        ((reason, _),) = Counter(released.to_program_reason[inside].tolist()).most_common(1)
        return Finding.of(FindingKind.NOTHING_TO_CONFIRM, reason, limit_N=limit)
    return None if len(plan) else Finding.of(FindingKind.NONE_CAN_BE_CONFIRMED, limit_N=limit)


def _doubts(
    force_map: ForceMap, plan: MeasurementPlan, states: FloatArray, upper: FloatArray, tolerance: StateTolerance
) -> Iterator[Finding]:
    """Doubts about the map at the planned states, shape (n, 3), with the bound `upper` [N] there."""
    if not len(plan):
        return
    yield from map_warnings(force_map, states)
    if force_map.fit is not None:
        measured = measured_before(states, force_map.fit.states, tolerance)
        for i in np.flatnonzero(measured > upper):
            forces = {"force_N": measured[i].item(), "bound_N": upper[i].item()}
            yield Finding.of(FindingKind.MEASURED_ABOVE_BOUND, state=plan.state_id[i].item(), **forces)


def _with_bound(others: Sequence[ForceMap], bound: Bound) -> tuple[ForceMap, ...]:
    """Those maps that can carry a bound: what has none, the speeds say."""
    found = []
    for other in others:
        with contextlib.suppress(BoundNotAvailable):
            bound.require(other)
            found.append(other)
    return tuple(found)


def _rule(impacts: int, limit: float, conditions: Conditions, others: Sequence[ForceMap]) -> Finding:
    """When the map is confirmed, and at which speeds where those that the campaign states are not those at contact."""
    error, share = conditions.device.error_or_default, 1 - conditions.speed_error
    speeds = {"kind": conditions.speed_kind or "set", "speed_error": conditions.speed_error or math.nan, "share": share}
    names = tuple(other.quantity.words for other in others)
    return Finding.of(
        FindingKind.CONFIRMING_RULE, impacts=impacts, limit_N=limit, error_N=error, others=names, **speeds
    )


def _released(speed: FloatArray, conditions: Conditions) -> FloatArray:
    """Released speeds at contact as they are planned and shown: in speeds of the campaign, cut to 0.001 m/s."""
    stated = np.atleast_1d(conditions.as_stated(speed))
    return np.array([float(floor_speed(v)) if math.isfinite(v) else math.nan for v in stated])


def _states_of(plan: MeasurementPlan, conditions: Conditions) -> FloatArray:
    """Places and speeds at contact that count, shape (n, 3) [m, m, m/s]."""
    return np.column_stack([plan.distance, plan.height, conditions.at_contact(plan.speed)])


def _worth_confirming(
    force_map: ForceMap, bound: Bound, states: FloatArray, tolerance: StateTolerance
) -> tuple[FloatArray, list[Finding]]:
    """The states that the device can measure and that do not repeat the map's own; a warning if all of them do."""
    if force_map.fit is not None:
        before = measured_before(states, force_map.fit.states, tolerance)
        highest = force_map.device_range - force_map.conditions.device.error_or_default
        states = states[~(np.fmax(bound.upper(force_map, *states.T), before) > highest)]
    new = no_repeats(states, force_map.measured_range.points, tolerance)
    if not len(states) or np.sum(new) >= _FEWEST:
        return states[new], []
    return states, [Finding.of(FindingKind.REPEATS_ALONE)]


def _probabilities(
    force_map: ForceMap, places: FloatArray, states: FloatArray, most: FloatArray, upper: FloatArray
) -> dict[str, Any]:
    """Probabilities that impacts at states, shape (n, 3), do not pass, by the name of their field.

    An impact passes if its force is at most `most`, and lies above the bound if it exceeds `upper` [N], shape (n,).
    Ridges and bumps are centred at each of the places, shape (k, 2).
    """
    away = np.square((places[:, None] - states[None, :, :2]) / (ACROSS / 2))
    return {
        "not_passed": _any_above(force_map, states, most, np.array(1.0)),
        "above_bound": _any_above(force_map, states, upper, np.array(1.0)),
        "higher_detected": _any_above(force_map, states, most, np.array(_HIGHER)),
        "ridge_detected": _any_above(force_map, states, most, 1 + RIDGE * np.exp(-away[..., 0])),
        "bump_detected": _any_above(force_map, states, most, 1 + BUMP * np.exp(-away.sum(axis=2))),
    }


def _any_above(force_map: ForceMap, states: FloatArray, newtons: FloatArray, factor: FloatArray) -> float:
    """Probability that one of the new states measures more if forces are `factor` times the map's; NaN if unknown.

    `factor` has shape (n,), or (k, n) for the mean over k cases. ln F of a new state less the prediction, over
    s sqrt(1 + l), has Student's t distribution. The correlation of states of a place is the likely one: with the upper
    end that the bound uses, impacts would seem to scatter more than they do.
    """
    if force_map.fit is None or not len(states) or force_map.fit.place_effect.between < LEAST_BETWEEN:
        return math.nan
    from scipy.special import stdtr

    try:
        likely = _likely_fit(force_map.form, force_map.fit)
    except FitError:  # without the censored states
        return math.nan
    if not likely.degrees_of_freedom:
        return math.nan
    leverage = np.square(force_map.form.design(*states.T) @ likely.inverse_triangle).sum(axis=1)
    allowance = np.log(newtons / (factor * np.asarray(force_map.predict(*states.T))))
    t = allowance / (likely.residual_sd * np.sqrt(1 + leverage))
    return float(np.mean(1 - np.prod(stdtr(likely.degrees_of_freedom, t), axis=-1)))


def _likely_fit(form: Form, fit: Fit) -> Regression:
    """The fit to the uncensored states with the likely correlation of places; that of a map carried over as it is."""
    if fit.transfer:
        return fit.between_states
    known = fit.states.uncensored
    return place_regression(form.design(*known.coordinates.T), known.log_force, known.place, fit.place_effect.likely)
