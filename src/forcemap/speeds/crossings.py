"""The engine of speeds at places: how far a bound stays within a limit, proven on patches, to 1e-6 m/s.

Where the slope of the bound over speed is enclosed above zero on a cell around the place, the bound crosses the limit
once, and each evaluation brackets the crossing (interval Newton). Elsewhere the bound is enclosed on the place itself,
a patch without extent, in steps of speed that halve (`frontier`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.maps.bounds import Bound, FixedMargin, ToleranceBound
from forcemap.maps.force_map import ForceMap
from forcemap.speeds.enclosures import Patches, enclose, frontier
from forcemap.speeds.range_enclosure import highest_measured_speed, lowest_measured_speeds

_CELL = 0.02  # [m]
_CLOSE = 2e-10  # how near a crossing is bracketed [m/s]
_SHORT = 5e-7  # how far below it a hint is given [m/s]
_HIDDEN = 2e-10  # what rounding may hide of it [m/s]
_LEAST = 2.0**-21  # last step of a frontier, a share of the interval of speed
_HINT = 2.0**-10  # the same for what is a hint alone
_SECANTS = 8  # through what a hint lies in
_SAMPLES = np.linspace(0.0, 1.0, 17)
_ROUNDS = 60


def highest_within(
    force_map: ForceMap,
    bound: Bound,
    d: FloatArray,
    h: FloatArray,
    ends: tuple[FloatArray, FloatArray],
    log: FloatArray,
) -> FloatArray:
    """Speed up to which, from the low end on, a bound stays within a limit, shape (n,); NaN where it does nowhere.

    Parameters
    ----------
    force_map : ForceMap
    bound : Bound
        One that is neither a fixed margin nor a tolerance bound is sampled: nothing can be proven of it.
    d, h : array, shape (n,)
        Places [m].
    ends : tuple of array, shape (n,)
        Lowest and highest speed to look at [m/s]; where all is within, it is the highest.
    log : array, shape (n,)
        Logarithm of the limit [N].
    """
    low, high = ends

    def excess(at: Indices, v: FloatArray) -> FloatArray:
        return _log_upper(force_map, bound, d[at], h[at], v) - log[at]

    every = np.arange(d.size)
    bottom, top = excess(every, low), excess(every, high)
    speed = np.where(bottom <= 0, low, np.nan)
    at = np.flatnonzero(bottom <= 0)
    flattest, steepest = _slopes(force_map, bound, d[at], h[at])
    rising = (flattest > 0) & np.isfinite(steepest)
    speed[at[rising & (top[at] <= 0)]] = high[at[rising & (top[at] <= 0)]]
    crossed = rising & (top[at] > 0)
    once = at[crossed]
    brackets = (low[once], high[once], bottom[once], top[once])
    speed[once] = _bracketed(lambda part, v: excess(once[part], v), *brackets, flattest[crossed], steepest[crossed])
    rest = at[~rising]
    if rest.size:
        if _known(bound):
            enclosed = enclose(force_map, bound, Patches.at(d[rest], h[rest]), low[rest], high[rest])
            found = enclosed.speed(np.nan_to_num(enclosed.certified(log[rest], least=_LEAST)))
        else:
            holds = _sampled(lambda part, v: excess(rest[part], v) <= 0, low[rest], high[rest])
            found = low[rest] + (high - low)[rest] * frontier(holds, rest.size, _LEAST)
        speed[rest] = np.maximum(found - _HIDDEN, low[rest])
        capped = rest[(speed[rest] >= high[rest] - 2 * _LEAST * (high - low)[rest]) & (top[rest] <= 0)]
        speed[capped] = high[capped]
    return speed


def lowest_exceeded(
    force_map: ForceMap, bound: Bound, d: FloatArray, h: FloatArray, low: FloatArray, log: FloatArray
) -> FloatArray:
    """Going down from a speed `low` [m/s] where a bound exceeds a limit: the first speed where it does not, shape (n,).

    0.0 where it exceeds the limit down to rest. The other arguments as in `highest_within`.
    """
    rest = low * 1e-6

    def excess(at: Indices, v: FloatArray) -> FloatArray:
        return _log_upper(force_map, bound, d[at], h[at], v) - log[at]

    if _known(bound):
        enclosed = enclose(force_map, bound, Patches.at(d, h), rest, low)
        share = enclosed.exceeding(log, least=_HINT)
        above, below = enclosed.speed(share), enclosed.speed(np.maximum(share - 2 * _HINT, 0.0))
    else:
        share = 1 - frontier(_sampled(lambda at, v: excess(at, v) > 0, low, rest), d.size, _HINT)
        above, below = (rest + (low - rest) * each for each in (share, np.maximum(share - 2 * _HINT, 0.0)))
    at = np.flatnonzero(share > 0)
    under, over = excess(at, below[at]), excess(at, above[at])
    for _ in range(_SECANTS):  # the Illinois method: an end that stays counts half
        below_at, above_at = below[at], above[at]
        with np.errstate(divide="ignore", invalid="ignore"):
            v = below_at - under * (above_at - below_at) / (over - under)
        v = np.where(np.isfinite(v), np.clip(v, below_at, above_at), below_at)
        found = excess(at, v)
        exceeds = found > 0
        under = np.where(exceeds, 0.5 * under, found)
        over = np.where(exceeds, found, 0.5 * over)
        below[at], above[at] = np.where(exceeds, below_at, v), np.where(exceeds, v, above_at)
    hint = np.zeros(d.size)
    hint[at] = np.maximum(np.where(np.isfinite(v), v, below[at]) - _SHORT, rest[at]) if at.size else 0.0
    return hint


def _known(bound: Bound) -> bool:
    """True if a bound can be enclosed."""
    return type(bound) in (FixedMargin, ToleranceBound)


def _log_upper(force_map: ForceMap, bound: Bound, d: FloatArray, h: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray(np.log(np.clip(bound.upper(force_map, d, h, v), 1e-300, 1e300)))


def _sampled(
    holds: Callable[[Indices, FloatArray], Mask], start: FloatArray, stop: FloatArray
) -> Callable[[Indices, FloatArray, FloatArray], Mask]:
    """What holds at 17 speeds between shares of intervals of speed, for `frontier`."""

    def everywhere(at: Indices, first: FloatArray, last: FloatArray) -> Mask:
        share = first[:, None] + (last - first)[:, None] * _SAMPLES
        speed = start[at, None] + (stop - start)[at, None] * share
        return np.asarray(holds(at[:, None], speed).all(axis=1))

    return everywhere


def _slopes(force_map: ForceMap, bound: Bound, d: FloatArray, h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """At most and at least the slope of ln of the bound over speed, for all measured speeds at places, shape (n,)."""
    if not _known(bound) or not d.size:
        return np.full(d.size, -np.inf), np.full(d.size, np.inf)
    cell = np.floor(d / _CELL) + 1j * np.floor(h / _CELL)
    cells, at = np.unique(cell, return_inverse=True)
    near, low = cells.real * _CELL, cells.imag * _CELL
    patches = Patches.box(near, near + _CELL, low, low + _CELL)
    least, _ = lowest_measured_speeds(force_map.measured_range, *patches.corners)
    most = np.maximum(highest_measured_speed(force_map.measured_range, *patches.corners), least + 1e-6)
    flattest, steepest = enclose(force_map, bound, patches, least, most).slopes
    if force_map.form.logarithmic:  # slopes over ln v
        flattest, steepest = flattest / most, steepest / least
    return flattest[at], steepest[at]


def _bracketed(
    excess: Callable[[Indices, FloatArray], FloatArray],
    below: FloatArray,
    above: FloatArray,
    value: FloatArray,
    top: FloatArray,
    flattest: FloatArray,
    steepest: FloatArray,
) -> FloatArray:
    """The crossing of an excess that rises with these slopes, from `value` below to `top` above; shape (n,)."""
    low, v, slope = below, below, (top - value) / (above - below)
    speed, at = below.copy(), np.arange(below.size, dtype=np.int64)
    for round in range(_ROUNDS):
        near, far = value / steepest[at], value / flattest[at]
        width = above - below
        below = np.maximum(below, v - np.where(value <= 0, near, far))
        above = np.minimum(above, v - np.where(value <= 0, far, near))
        speed[at] = np.minimum(below, above)
        open_ = above - below > _CLOSE
        at = at[open_]
        below, above, v, value, slope, width = (x[open_] for x in (below, above, v, value, slope, width))
        if not at.size:
            break
        slow = (above - below > 0.5 * width) & (round > 0)
        ahead = np.where(slow, 0.5 * (below + above), np.clip(v - value / slope, below, above))
        found = excess(at, ahead)
        with np.errstate(divide="ignore", invalid="ignore"):
            secant = (found - value) / (ahead - v)
        v, value, slope = ahead, found, np.where(secant > 0, secant, slope)
    return np.maximum(speed - _HIDDEN, low)
