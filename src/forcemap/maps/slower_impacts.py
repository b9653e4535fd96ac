"""Impacts slower than a map is to hold for (map.slowest_mps): not fitted, but every motion passes through their speeds.

A speed permits slower motion with it. So a place has a speed only where c U(d, h, v_0) lies below the limit, v_0 being
the map's lowest speed and c = max(1, max F_i / F(d_i, h_i, v_0)) over the slower impacts i: the width of the bound is
left for the places where none was measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import PLACE_SIZE, Quantity, States, StateTolerance
from forcemap.findings import Finding, FindingKind
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.maps.form_test import SLOW_PLACES

SLOW = 0.1
"""A map that was measured down to this speed [m/s], or as close to it as repeats differ, tells of slower motion: two
steps down from 0.2 m/s. A choice, tried in the virtual lab (docs/validity.md)."""

_STEP = 0.65  # least ratio of one slow speed to the next faster one: as `next` plans them, rounded; a choice
_SPREAD = 0.5  # share of the measured range that slow impacts span in distance and in height; a choice
_BESIDE = np.array([PLACE_SIZE, PLACE_SIZE, np.inf])  # how far beside the range a slow impact still is one of it
_ROUNDING = 1e-9  # of a speed [m/s]


@dataclass(frozen=True)
class SlowerCover:
    """What it takes for a bound to hold for slower impacts, too.

    Parameters
    ----------
    raised : float
        The factor c on the bound at the map's lowest speed, at least 1; 0 without slower impacts.
    refusal : Finding or None
        Why nothing is permitted: slower impacts were above the device's range, and how far is not known.
    """

    raised: float = 0.0
    refusal: Finding | None = None


def cover_slower(force_map: ForceMap) -> SlowerCover:
    """What a bound of a map needs for slower impacts."""
    slower = force_map.slower
    if not len(slower):
        return SlowerCover()
    if slower.censored.any():
        names = tuple(np.array(slower.name)[slower.censored > 0].tolist())
        figures = {"names": names, "slowest_mps": force_map.conditions.slowest}
        return SlowerCover(refusal=Finding.of(FindingKind.SLOWER_ABOVE_RANGE, **figures))
    with np.errstate(divide="ignore", over="ignore"):  # a prediction of 0 closes every place
        return SlowerCover(float(np.max(slower.highest / _at_lowest_speed(force_map), initial=1.0)))


def upper_of_slower(force_map: ForceMap, bound: Bound, distance: FloatArray, height: FloatArray) -> FloatArray:
    """c U(d, h, v_0) [N], below which a limit must not lie, of any shape; 0 without slower impacts."""
    if not (raised := cover_slower(force_map).raised):
        return np.zeros(np.shape(distance))
    lowest = np.full(np.shape(distance), force_map.measured_range.lowest[2])
    return np.asarray(raised * bound.upper(force_map, distance, height, lowest))


def slower_impacts(force_map: ForceMap) -> Finding | None:
    """What slower impacts measured, beside the map's prediction at its lowest speed; None without any."""
    slower = force_map.slower
    if not len(slower):
        return None
    with np.errstate(divide="ignore", over="ignore"):
        ratio = np.fmax(slower.highest, slower.at_least) / _at_lowest_speed(force_map)
    i = int(np.argmax(ratio))
    return Finding.of(
        FindingKind.SLOWER_IMPACTS,
        slowest_mps=force_map.conditions.slowest,
        states=len({*slower.name}),
        confirming=len({*slower.select(slower.confirms).name}),
        earlier=len({*slower.name}) - len({*force_map.own_slower.name}) or None,
        more=float(ratio[i]) - 1 if ratio[i] > 1 else None,
        most=float(ratio[i]),
        force_N=float(np.fmax(slower.highest, slower.at_least)[i]),
        speed_mps=float(slower.speed[i]),
        distance_m=float(slower.distance[i]),
        height_m=float(slower.height[i]),
        lowest_mps=float(force_map.measured_range.lowest[2]),
        error=force_map.conditions.speed_error > 0 or None,
    )


def slow_impacts_missing(force_map: ForceMap) -> Finding | None:
    """That a map of the force, with the slower impacts beside it, tells of no speeds as low as SLOW; None otherwise.

    Test states tell nothing: none widens the bound; nor do slower impacts of an earlier robot that the map is carried
    over from. Fitted states and slower impacts (map.slowest_mps) tell of slower motion at SLOW_PLACES places and more,
    spread over the range, down to a gap, as between 0.1 and 0.2 m/s: the most may lie in it.
    """
    if force_map.quantity is not Quantity.FORCE:
        return None
    low, high = force_map.measured_range.lowest, force_map.measured_range.highest
    speed, lowest = low[2:], float(low[2])
    if fit := force_map.fit:
        measured = fit.states.and_(force_map.own_slower)
        beside = np.any((measured.coordinates < low - _BESIDE) | (measured.coordinates > high + _BESIDE), axis=1)
        measured = measured.select(~beside)
        speed, lowest = measured.speed, _lowest_without_gap(fit.states, measured, _SPREAD * (high - low)[:2])
    if lowest < SLOW + StateTolerance().speed - _ROUNDING:
        return None
    stated = float(force_map.conditions.as_stated(np.array(lowest)))
    below = speed[speed < _STEP * lowest]
    figures = {"stated_mps": stated if stated > lowest else None, "below_mps": below.max() if below.size else None}
    return Finding.of(FindingKind.SLOW_IMPACTS_MISSING, lowest_mps=lowest, **figures)


def _lowest_without_gap(fitted: States, measured: States, spread: FloatArray) -> float:
    """How far down speeds [m/s] tell: from the fitted ones from twice SLOW on, within a step of the next faster one."""
    lowest = _told_down_to(fitted.select(fitted.speed >= 2 * SLOW), spread) or float(fitted.speed.max())
    speed = measured.speed
    while slower := _told_down_to(measured.select((speed >= _STEP * lowest - _ROUNDING) & (speed < lowest)), spread):
        lowest = slower
    return lowest


def _told_down_to(states: States, spread: FloatArray) -> float | None:
    """The lowest speed [m/s] down to which states tell; None if they do not.

    So slow, or slower, were states at SLOW_PLACES places that lie `spread` apart in distance and in height [m].
    """
    for speed in np.unique(states.speed).tolist():
        slow = states.select(states.speed <= speed)
        at = slow.coordinates[:, :2]
        if len({*slow.place.tolist()}) >= SLOW_PLACES and np.all(np.ptp(at, axis=0) >= spread):
            return float(speed)
    return None


def slower_above(force_map: ForceMap, bound: Bound, states: States) -> Finding | None:
    """New states slower than a map holds for that lie above what it allows for slower motion; None without any.

    Parameters
    ----------
    force_map : ForceMap
    bound : Bound
        One that the map can carry.
    states : States
        With speeds at contact, as those of the map.
    """
    conditions = force_map.conditions
    below = states.speed < force_map.measured_range.lowest[2] - StateTolerance().speed
    slower = states.select(below | conditions.slower_than_map(conditions.as_stated(states.speed)))
    if not len(slower):
        return None
    allowed = max(cover_slower(force_map).raised, 1.0) * bound.upper(force_map, *_nearest(force_map, slower))
    force = np.fmax(slower.highest, slower.at_least)
    above = force > allowed
    if not above.any():
        return None
    i = int(np.argmax(force / allowed))
    lowest = float(conditions.as_stated(force_map.measured_range.lowest[2:])[0])
    return Finding.of(
        FindingKind.SLOWER_ABOVE_MAP,
        names=tuple(np.array(slower.name)[above].tolist()),
        state=slower.name[i],
        force_N=float(force[i]),
        allowed_N=float(allowed[i]),
        slowest_mps=conditions.slowest if conditions.slowest > 0 else lowest,
    )


def _at_lowest_speed(force_map: ForceMap) -> FloatArray:
    """Predicted force [N] for the slower states, n of them, at the map's lowest speed, shape (n,); where the map begins
    at a faster speed, the lower of both predictions."""
    distance, height, lowest = _nearest(force_map, force_map.slower)
    there, _ = force_map.measured_range.speeds(distance, height)
    there = np.where(np.isnan(there), lowest, there)
    both = (force_map.predict(distance, height, speed) for speed in (lowest, there))
    return np.asarray(np.minimum(*both))


def _nearest(force_map: ForceMap, states: States) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The places of states, or the nearest in the box around the measured ones, at the map's lowest speed."""
    low, high = force_map.measured_range.lowest, force_map.measured_range.highest
    distance, height = np.clip(states.distance, low[0], high[0]), np.clip(states.height, low[1], high[1])
    return distance, height, np.full(len(states), low[2])
