"""What was measured above a map's bound, whatever the limit: to confirm or test it, at contact points, by a repeat."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.dataset import (
    DISAGREEMENT,
    PLACE_SIZE,
    SPEED_NOT_STATED,
    Quantity,
    States,
    StateTolerance,
)
from forcemap.errors import BoundNotAvailable
from forcemap.findings import Finding, FindingKind
from forcemap.maps.bounds import Bound, ToleranceBound
from forcemap.maps.force_map import ForceMap
from forcemap.maps.slower_impacts import upper_of_slower

NO_CHANCE = 0.999
"""Share of states below what no impact lies above by chance; a choice: of twenty contact points one in fifty cells
would."""


def highest_above(force_map: ForceMap, bound: Bound, states: States) -> Mask:
    """States at places of the measured range, or beside it, of which an impact lies above a bound, at whatever speed,
    shape (m,)."""
    low, _ = _speeds_near(force_map, states)
    upper = bound.upper(force_map, states.distance, states.height, states.slowest)
    return np.asarray((np.fmax(states.highest, states.at_least) > upper) & ~np.isnan(low))


def _speeds_near(force_map: ForceMap, states: States) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest speed of the map where states were measured, shape (m,); NaN farther outside than a place is
    wide."""
    return force_map.measured_range.speeds_near(states.distance, states.height, PLACE_SIZE)


def held(force_map: ForceMap, states: States) -> tuple[Mask, FloatArray]:
    """States that speak for or against a map, shape (m,), and the speed of the map for which each does [m/s].

    That of its slowest repeat; the lowest of the map for one slower. Of one faster than any that was fitted none does.
    """
    low, high = _speeds_near(force_map, states)
    speed_tolerance = StateTolerance.stated(math.nan, force_map.conditions.speed_tolerance).speed
    return np.asarray(states.slowest <= high + speed_tolerance), np.clip(states.slowest, low, high)


def confirming_above(force_map: ForceMap, bound: Bound) -> Finding | None:
    """Impacts that were to confirm a map and lie above its bound, whatever the limit; None without any."""
    if (fit := force_map.fit) is None:
        return None
    test = fit.test.select(fit.test.confirms)  # also slower than it is to hold for now: a failure stays one
    above = highest_above(force_map, bound, test)
    names = tuple(np.array(test.name)[above].tolist())
    conditions = force_map.conditions
    slower = int(np.sum(above & conditions.slower_than_map(conditions.as_stated(test.speed)))) or None
    figures = {"slower": slower, "slowest_mps": conditions.slowest if slower else None}
    return Finding.of(FindingKind.CONFIRMING_ABOVE_BOUND, names=names, **figures) if names else None


def points_above(force_map: ForceMap, bound: Bound) -> tuple[Finding | None, bool]:
    """Impacts at contact points above a map's bound at speeds that it holds for; None without any, and whether they
    refuse it: where one lies above what 999 of 1000 states stay below, the map does not hold there.

    Of a zone an impact must lie above the bound at all places that the map holds for: it was made at one of them. One
    slower than the map holds for there, or of a speed that is not stated, is held against its bound for slower motion.
    """
    if force_map.fit is None or not len(made := force_map.fit.at_points):
        return None, False
    place, force = (made.distance, made.height), np.fmax(made.highest, made.at_least)
    names, impact = np.unique(made.name, return_inverse=True)
    counts, speed = held(force_map, made)
    slower = made.slowest < speed

    def shares(of: Bound) -> tuple[FloatArray, FloatArray]:
        """Upper bound [N] at every place, and the force of each impact as a share of it where that is lowest; 0 where
        the map says nothing."""
        with np.errstate(all="ignore"):  # beyond the measured range
            upper = of.upper(force_map, *place, speed)
            upper = np.where(slower, np.maximum(upper, upper_of_slower(force_map, of, *place)), upper)
            least = np.full(len(names), np.inf)
            np.minimum.at(least, impact, np.where(counts, force / upper, np.inf))
        return upper, np.where(np.isfinite(least), least, 0.0)

    (upper, share), conditions = shares(bound), force_map.conditions
    if not (above := share > 1).any():
        return None, False
    try:
        most = ToleranceBound(content=NO_CHANCE, device_error=conditions.device.error_or_default)
        most.require(force_map)
        refuses = bool((shares(most)[1] > 1).any())
    except BoundNotAvailable:
        refuses = True
    of_highest = np.flatnonzero((impact == share.argmax()) & counts)
    i = int(of_highest[np.argmax(upper[of_highest])])
    stated = made.slowest[i] > SPEED_NOT_STATED
    found = Finding.of(
        FindingKind.POINTS_ABOVE_BOUND,
        names=tuple(names[above].tolist()),
        force_N=float(force[i]),
        upper_N=float(upper[i]),
        distance_m=float(made.distance[i]),
        height_m=float(made.height[i]),
        speed_mps=float(conditions.as_stated(made.slowest)[i]) if stated else None,
        lowest_mps=float(conditions.as_stated(speed)[i]) if slower[i] else None,
        refuses=refuses or None,
        **unit_of(force_map.quantity),
    )
    return found, refuses


def unit_of(quantity: Quantity) -> dict[str, str]:
    """The unit that a finding states of a quantity; that of the force goes without saying."""
    return {} if quantity is Quantity.FORCE else {"unit": quantity.unit}


def _fitted_there(force_map: ForceMap, states: States) -> FloatArray:
    """The highest force of the fitted states of which states are repeats, shape (m,) [N]; 0 where they are of none.

    A state that is as high as the fitted one shares its error, and tells nothing of the map that was fitted to it.
    """
    fitted, conditions = force_map.require_fit().states, force_map.conditions
    scale = StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance).scale
    apart = np.abs(states.coordinates[:, None] - fitted.coordinates)
    forces = np.fmax(fitted.highest, fitted.at_least)
    return np.asarray(np.where((apart <= scale).all(axis=2), forces, 0.0).max(axis=1, initial=0.0))


def far_above(force_map: ForceMap, bound: Bound) -> Finding | None:
    """States of which an impact lies above what 999 of 1000 states stay below; None without any.

    Those whose repeats disagree come first: the mean hides such a repeat, and one of them is wrong. Of test states that
    lie above the bound, too, and above a fitted one that they repeat, the map does not hold; one slower than was fitted
    is held against the lowest speed there. Impacts that were to confirm it are told by themselves (`confirming_above`),
    and so are those slower than it holds for by `map.slowest_mps` (`slower_impacts`).
    """
    fit = force_map.fit
    if fit is None:
        return None
    most = ToleranceBound(content=NO_CHANCE, device_error=force_map.conditions.device.error_or_default)
    try:
        most.require(force_map)
    except BoundNotAvailable:
        return None
    apart = [group.select(np.isin(group.name, fit.disagreeing)) for group in (fit.states, fit.left_out)]
    apart = [group.select(highest_above(force_map, most, group)) for group in apart if len(group)]
    of_repeats, test = any(map(len, apart)), fit.test.select(~fit.test.confirms)
    test = test.select(np.fmax(test.highest, test.at_least) > DISAGREEMENT * _fitted_there(force_map, test))
    counts, held_at = held(force_map, test)
    conditions = force_map.conditions
    counts &= (held_at <= test.slowest) | ~conditions.slower_than_map(conditions.as_stated(test.slowest))
    test, there = test.select(counts), replace(test, slowest=np.maximum(test.slowest, held_at)).select(counts)
    above = highest_above(force_map, most, there) & highest_above(force_map, bound, there)
    found = [group for group in (apart if of_repeats else [test.select(above)]) if len(group)]
    if not found:
        return None
    at = [group.slowest for group in found] if of_repeats else [there.slowest[above]]
    force = np.concatenate([np.fmax(group.highest, group.at_least) for group in found])
    distance, height, speed = np.concatenate([np.array([g.distance, g.height, g.slowest]) for g in found], axis=1)
    i = int(force.argmax())
    return Finding.of(
        FindingKind.FAR_ABOVE_BOUND,
        repeat=of_repeats or None,
        names=tuple(dict.fromkeys(name for group in found for name in group.name)),
        force_N=float(force[i]),
        upper_N=float(most.upper(force_map, distance[i], height[i], np.concatenate(at)[i])),
        distance_m=float(distance[i]),
        height_m=float(height[i]),
        speed_mps=float(force_map.conditions.as_stated(speed)[i]),
        **unit_of(force_map.quantity),
    )
