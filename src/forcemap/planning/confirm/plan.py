"""A few impacts at the released speeds, to confirm a map before its speeds are used."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from forcemap.arrays import FloatArray, Objects
from forcemap.campaigns.dataset import PhaseTwo
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.campaigns.state import StateTolerance
from forcemap.errors import InputError, NotReleasable
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound, weakness
from forcemap.maps.force_map import Fit, ForceMap
from forcemap.planning.confirm.confirmation import PREFIX, ConfirmationPlan
from forcemap.planning.confirm.states import any_above, contradictions, no_repeats, spread, worth_confirming
from forcemap.planning.measured_before import measured_before
from forcemap.planning.places import PlaceRange
from forcemap.planning.plan_warnings import map_warnings
from forcemap.planning.runs import extend_plan, runs_of, select_runs
from forcemap.speeds.safe_speed import floor_speed, safe_speed

_PLACES = 15  # along each axis, to choose from
_HIGHER = 1.10  # a robot that pushes this much harder should be found
_IMPACTS = 6


def confirm_plan(
    force_map: ForceMap,
    limit: ForceLimit | NewtonLimit | float,
    *,
    bound: Bound,
    contact: Contact | None = None,
    impacts: int | None = None,
    planned: MeasurementPlan | None = None,
) -> ConfirmationPlan:
    """Plan a few impacts at released speeds: the fastest, where the bound is tightest, and spread over the rest.

    The impacts confirm the map if every one is within the limit by `check_impact` (its force and the device's error
    stay below it) and none lies above the bound. They are no repeats of the map's states, which share its error.

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
        How many, at least 2, 6 if not given; more if more are planned already for these speeds.
    planned : MeasurementPlan, optional
        The campaign's plan. Its confirming runs at the speeds released by the training impacts stay.

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
    >>> found = confirm_plan(published_map("ur10e"), 280.0, bound=FixedMargin(0.10))
    >>> len(found.plan), found.plan.recording[-1].item()
    (6, 'c-d890-h460-v362-r1')
    """
    if impacts is not None and (
        isinstance(impacts, bool) or not isinstance(impacts, int | np.integer) or int(impacts) < 2
    ):
        raise InputError(f"impacts: found {impacts!r}, expected a whole number of at least 2")
    if weak := weakness(bound, force_map):
        raise NotReleasable(f"nothing is released: {weak}")
    conditions = force_map.conditions
    tolerance = StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)
    lowest, highest = force_map.measured_range.lowest, force_map.measured_range.highest
    places = PlaceRange((lowest[0], highest[0]), (lowest[1], highest[1]))
    grid = np.unique(places.grid(_PLACES), axis=0)
    released = safe_speed(force_map, grid[:, 0], grid[:, 1], limit=limit, bound=bound, contact=contact)
    newtons = float(released.limit)
    speed = _cut(released.speed)
    usable = speed >= released.lowest_measured_speed

    before = runs_of(np.empty((0, 3)), 1, np.empty(0))
    if planned is not None:
        before = select_runs(planned, ConfirmationPlan.among(planned))
    # What the impacts to be judged say must not change which of them are judged.
    blind = (
        force_map if force_map.fit is None else replace(force_map, phase_two=PhaseTwo(), fit=_without_test(force_map))
    )
    now = np.full(len(before), math.nan)
    if len(before):
        at = safe_speed(blind, before.distance, before.height, limit=limit, bound=bound, contact=contact)
        now = _cut(at.speed)
    current = np.abs(now - before.speed) < 5e-4
    kept, earlier = select_runs(before, current), select_runs(before, ~current)

    states = np.column_stack([grid, speed])[usable]
    old = np.column_stack([kept.distance, kept.height, kept.speed])
    chosen, warnings = worth_confirming(force_map, bound, states[no_repeats(states, old, tolerance)], tolerance)
    count = _IMPACTS if impacts is None else int(impacts)
    new = np.empty((0, 3))
    if len(chosen) and count > len(kept):
        tightness = bound.upper(force_map, *chosen.T) / np.asarray(force_map.predict(*chosen.T))
        first = [int(chosen[:, 2].argmax()), int(tightness.argmin())]
        every = np.vstack([old, chosen])
        picked = spread(places, every, list(range(len(old))) or first, count)
        new = every[picked[picked >= len(old)]]
        new = new[np.lexsort((new[:, 1], -new[:, 0], new[:, 2]))]
    added = runs_of(
        new,
        1,
        np.asarray(force_map.predict(*new.T)),
        role="test",
        prefix=PREFIX,
        expected_from=f"map {force_map.name!r}",
    )
    plan = _slow_to_fast(kept, added)
    warnings = [*released.warnings, *warnings]
    refusal = ""
    if not usable.any():
        refusal = _refusal(released.reason, newtons)
    elif not len(plan):
        refusal = (
            f"speeds are released for {newtons:g} N, but none can be confirmed: near each of them a force above the "
            "device range less its error was measured at a lower speed"
        )
    elif len(plan) < count:
        warnings.append(
            f"impacts: {len(plan)}, fewer than the {count} asked for, because no other place has a released speed that "
            "would be no repeat; fewer impacts find less"
        )
    states = np.column_stack([plan.distance, plan.height, plan.speed])
    upper = np.asarray(bound.upper(force_map, *states.T))
    if len(plan):
        warnings += map_warnings(force_map, states)
    if len(plan) and force_map.fit is not None:
        warnings += contradictions(plan, measured_before(states, force_map.fit.states, tolerance), upper)
    error = conditions.device.error_or_default
    most = np.minimum(newtons - error, upper)
    rule = (
        f"the map is confirmed if each of the {len(plan)} impacts is within {newtons:g} N (its force and the device's "
        f"error of {error:g} N together) and none exceeds the bound; one that does not: release nothing, measure more"
    )
    return ConfirmationPlan(
        plan=replace(plan, warnings=tuple(warnings)),
        added=added,
        earlier=earlier,
        bound_force=upper,
        earlier_bound_force=np.asarray(bound.upper(force_map, earlier.distance, earlier.height, earlier.speed)),
        earlier_released=now[~current],
        limit=newtons,
        refusal=refusal,
        warnings=tuple(warnings),
        rule=rule,
        not_passed=any_above(force_map, states, most, 1.0),
        above_bound=any_above(force_map, states, upper, 1.0),
        found=any_above(force_map, states, most, _HIGHER),
        force_map=force_map,
        bound=bound,
    )


def _cut(speed: FloatArray) -> FloatArray:
    """Speeds as they are shown, cut to 0.001 m/s."""
    return np.array([float(floor_speed(v)) if math.isfinite(v) else math.nan for v in np.atleast_1d(speed)])


def _refusal(reasons: Objects, newtons: float) -> str:
    """Why no place has a speed: the reason given most often."""
    reason, count = np.unique(reasons.astype(str), return_counts=True)
    return f"no place has a speed for {newtons:g} N, so there is nothing to confirm: {reason[count.argmax()]}"


def _without_test(force_map: ForceMap) -> Fit:
    fit = force_map.require_fit()
    return replace(fit, test=fit.test.select(np.zeros(len(fit.test), dtype=np.bool_)))


def _slow_to_fast(kept: MeasurementPlan, added: MeasurementPlan) -> MeasurementPlan:
    """The runs of both, in the order in which to make them."""
    both = extend_plan(kept, added)
    return select_runs(both, np.lexsort((both.height, -both.distance, both.speed)))
