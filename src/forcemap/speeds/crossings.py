"""The engine of speeds at places: up to which speed a bound stays within a limit, proven to 1e-6 m/s.

Where the slope of the bound over speed is certainly positive on a cell around the place, the bound crosses the limit
once, and every evaluation brackets the crossing (interval Newton). Elsewhere the bound is enclosed at the place itself,
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

# Numerical settings: they decide how close a speed comes to the crossing and what it costs; it is never above it.
_CELL = 0.02  # [m]; of places that share an enclosure of the slopes (docs/decisions.md)
_CLOSE = 2e-10  # [m/s]; width to which a crossing is bracketed
_ROUNDS = 60  # of interval Newton, at most; every second one at least halves the bracket
_ROUNDING = 2e-10  # [m/s]; by how much rounding may move a crossing: subtracted from every speed
_LAST = 2.0**-21  # last step of a frontier, a share of the interval of speed: 1e-6 m/s where it is up to 2 m/s
_LAST_OF_HINT = 2.0**-10  # the same for a hint, which permits nothing (docs/decisions.md)
_SECANTS = 8  # evaluations that refine a hint within its last step
_BELOW_CROSSING = 5e-7  # [m/s]; how far below the crossing a hint is given: within the 1e-6 m/s promised
_SAMPLES = np.linspace(
    0.0, 1.0, 17
)  # of a step, for a bound that cannot be enclosed; a choice, and such a bound is weak
_REST = 1e-6  # share of a speed that stands for rest: forms may hold ln v
_NARROW_RANGE = 1e-6  # [m/s]; least width of the speeds of a cell, where only one was measured


def highest_within(
    force_map: ForceMap,
    bound: Bound,
    d: FloatArray,
    h: FloatArray,
    ends: tuple[FloatArray, FloatArray],
    log: FloatArray,
) -> FloatArray:
    """Speed up to which, from the low end on, a bound stays within a limit, shape (n,); NaN if not even there.

    Parameters
    ----------
    force_map : ForceMap
    bound : Bound
        One that is neither a fixed margin nor a tolerance bound is sampled: nothing can be proven about it.
    d, h : array, shape (n,)
        Places [m].
    ends : tuple of array, shape (n,)
        Lowest and highest speed to consider [m/s]; the result is the highest where the bound never exceeds the limit.
    log : array, shape (n,)
        Logarithm of the limit [N].
    """
    low, high = ends

    def excess(rows: Indices, v: FloatArray) -> FloatArray:
        return _log_upper(force_map, bound, d[rows], h[rows], v) - log[rows]

    every = np.arange(d.size)
    bottom, top = excess(every, low), excess(every, high)
    speed = np.where(bottom <= 0, low, np.nan)
    open_ = np.flatnonzero(bottom <= 0)
    flattest, steepest = _slopes(force_map, bound, d[open_], h[open_])
    rising = (flattest > 0) & np.isfinite(steepest)
    within = open_[rising & (top[open_] <= 0)]
    speed[within] = high[within]
    crossed = rising & (top[open_] > 0)
    once = open_[crossed]
    brackets = (low[once], high[once], bottom[once], top[once])
    speed[once] = _bracketed(lambda part, v: excess(once[part], v), *brackets, flattest[crossed], steepest[crossed])
    rest = open_[~rising]
    if rest.size:
        if _enclosable(bound):
            enclosed = enclose(force_map, bound, Patches.of_places(d[rest], h[rest]), low[rest], high[rest])
            reached = enclosed.speed(np.nan_to_num(enclosed.certified(log[rest], least=_LAST)))
        else:
            holds = _sampled(lambda part, v: excess(rest[part], v) <= 0, low[rest], high[rest])
            reached = low[rest] + (high - low)[rest] * frontier(holds, rest.size, _LAST)
        speed[rest] = np.maximum(reached - _ROUNDING, low[rest])
        capped = rest[(speed[rest] >= high[rest] - 2 * _LAST * (high - low)[rest]) & (top[rest] <= 0)]
        speed[capped] = high[capped]
    return speed


def lowest_exceeded(
    force_map: ForceMap, bound: Bound, d: FloatArray, h: FloatArray, low: FloatArray, log: FloatArray
) -> FloatArray:
    """Going down from a speed `low` [m/s] where a bound exceeds a limit: the first speed where it does not, shape (n,).

    0.0 where it exceeds the limit down to rest. The other arguments as in `highest_within`.
    """
    rest = low * _REST

    def excess(rows: Indices, v: FloatArray) -> FloatArray:
        return _log_upper(force_map, bound, d[rows], h[rows], v) - log[rows]

    if _enclosable(bound):
        enclosed = enclose(force_map, bound, Patches.of_places(d, h), rest, low)
        share = enclosed.exceeding(log, least=_LAST_OF_HINT)
        above, below = enclosed.speed(share), enclosed.speed(np.maximum(share - 2 * _LAST_OF_HINT, 0.0))
    else:
        share = 1 - frontier(_sampled(lambda rows, v: excess(rows, v) > 0, low, rest), d.size, _LAST_OF_HINT)
        above = rest + (low - rest) * share
        below = rest + (low - rest) * np.maximum(share - 2 * _LAST_OF_HINT, 0.0)
    rows = np.flatnonzero(share > 0)
    below, above, under, over = below[rows], above[rows], excess(rows, below[rows]), excess(rows, above[rows])
    for _ in range(_SECANTS):  # the Illinois method: an end that stays counts half
        with np.errstate(divide="ignore", invalid="ignore"):
            v = below - under * (above - below) / (over - under)
        v = np.where(np.isfinite(v), np.clip(v, below, above), below)
        value = excess(rows, v)
        exceeds = value > 0
        under, over = np.where(exceeds, 0.5 * under, value), np.where(exceeds, value, 0.5 * over)
        below, above = np.where(exceeds, below, v), np.where(exceeds, v, above)
    hint = np.zeros(d.size)
    hint[rows] = np.maximum(np.where(np.isfinite(v), v, below) - _BELOW_CROSSING, rest[rows]) if rows.size else 0.0
    return hint


def _enclosable(bound: Bound) -> bool:
    """True if a bound can be enclosed."""
    return type(bound) in (FixedMargin, ToleranceBound)


def _log_upper(force_map: ForceMap, bound: Bound, d: FloatArray, h: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray(np.log(np.clip(bound.upper(force_map, d, h, v), 1e-300, 1e300)))


def _sampled(
    holds: Callable[[Indices, FloatArray], Mask], start: FloatArray, stop: FloatArray
) -> Callable[[Indices, FloatArray, FloatArray], Mask]:
    """A condition for `frontier`: that `holds` is true at sampled speeds between shares of intervals of speed."""

    def everywhere(rows: Indices, first: FloatArray, last: FloatArray) -> Mask:
        share = first[:, None] + (last - first)[:, None] * _SAMPLES
        speed = start[rows, None] + (stop - start)[rows, None] * share
        return np.asarray(holds(rows[:, None], speed).all(axis=1))

    return everywhere


def _slopes(force_map: ForceMap, bound: Bound, d: FloatArray, h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bound of the slope of ln of the bound over all measured speeds at places, each of shape (n,)."""
    if not _enclosable(bound) or not d.size:
        return np.full(d.size, -np.inf), np.full(d.size, np.inf)
    cell = np.floor(d / _CELL) + 1j * np.floor(h / _CELL)
    cells, cell_of = np.unique(cell, return_inverse=True)
    near, low = cells.real * _CELL, cells.imag * _CELL
    patches = Patches.box(near, near + _CELL, low, low + _CELL)
    least, _ = lowest_measured_speeds(force_map.measured_range, *patches.corners)
    most = np.maximum(highest_measured_speed(force_map.measured_range, *patches.corners), least + _NARROW_RANGE)
    flattest, steepest = enclose(force_map, bound, patches, least, most).slopes
    if force_map.form.logarithmic:  # slopes over ln v
        flattest, steepest = flattest / most, steepest / least
    return flattest[cell_of], steepest[cell_of]


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
    speed, rows = below.copy(), np.arange(below.size, dtype=np.int64)
    for number in range(_ROUNDS):
        near, far = value / steepest[rows], value / flattest[rows]
        width = above - below
        below = np.maximum(below, v - np.where(value <= 0, near, far))
        above = np.minimum(above, v - np.where(value <= 0, far, near))
        speed[rows] = np.minimum(below, above)
        open_ = above - below > _CLOSE
        rows = rows[open_]
        below, above, v, value, slope, width = (x[open_] for x in (below, above, v, value, slope, width))
        if not rows.size:
            break
        slow = (above - below > 0.5 * width) & (number > 0)
        ahead = np.where(slow, 0.5 * (below + above), np.clip(v - value / slope, below, above))
        value_ahead = excess(rows, ahead)
        with np.errstate(divide="ignore", invalid="ignore"):
            secant = (value_ahead - value) / (ahead - v)
        v, value, slope = ahead, value_ahead, np.where(secant > 0, secant, slope)
    return np.maximum(speed - _ROUNDING, low)
