"""Safe speeds at very many places, a hundred times as fast as one by one, and never above them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Indices
from forcemap.errors import InputError
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound, contradiction
from forcemap.maps.force_map import ForceMap
from forcemap.speeds.enclosures import enclose
from forcemap.speeds.range_enclosure import highest_measured_speed, lowest_measured_speeds
from forcemap.speeds.safe_speed import SAME_PLACE, safe_speed
from forcemap.speeds.usable_limits import usable_limit
from forcemap.speeds.zones import zone_grid

_CELL = 0.02  # [m]
_CLOSE = 1e-4  # [m/s]; how far a speed may lie below the crossing
_ROUNDS = 12
_PLACES_AT_ONCE = 65_536
_ROOT = 1e-9  # [m/s]; safe_speed narrows a crossing down to less


def many_safe_speeds(
    force_map: ForceMap,
    distance: ArrayLike,
    height: ArrayLike,
    *,
    limit: ForceLimit | NewtonLimit | float,
    bound: Bound,
    contact: Contact | None = None,
    quasi_static_limit: float | None = None,
    spring_N_per_m: float | None = None,
) -> FloatArray:
    """Speeds that exceed the safe speed nowhere and lie less than 0.2 mm/s below it; NaN where there is none.

    On cells of 2 cm the slope of the bound over speed is enclosed. Where it is positive the bound has one crossing,
    and each evaluation brackets it (interval Newton); elsewhere, and where an impact above the device range lies,
    `safe_speed` is asked.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    distance, height : array
        Places [m], of shapes that broadcast.
    limit : float, NewtonLimit or ForceLimit
        As in `safe_speed`.
    bound : Bound
        `FixedMargin` or `ToleranceBound`.
    contact, quasi_static_limit, spring_N_per_m : optional
        As in `safe_speed`.

    Returns
    -------
    array
        Speeds [m/s].

    Raises
    ------
    InputError
        As `safe_speed`.
    ContactNotPermitted
        The standard permits no contact with the body area.
    BoundNotAvailable
        The map cannot carry the bound.
    """
    stated = {"contact": contact, "quasi_static_limit": quasi_static_limit, "spring_N_per_m": spring_N_per_m}
    case: dict[str, Any] = {"limit": limit, "bound": bound, **stated}
    usable = usable_limit(force_map, **case)
    refusal, level = usable.refusal or contradiction(force_map, bound), usable.level
    if np.ndim(level):
        raise InputError("limit: expected one limit for all places")
    cells = zone_grid(force_map.measured_range, _CELL)
    whole = cells.patches(np.arange(len(cells)), np.tile([0.0, 1.0, 0.0, 1.0], (len(cells), 1)))
    least, _ = lowest_measured_speeds(force_map.measured_range, *whole.corners)
    most = np.maximum(highest_measured_speed(force_map.measured_range, *whole.corners), least + 1e-6)
    flattest, steepest = enclose(force_map, bound, whole, least, most).slopes
    if force_map.form.logarithmic:  # slopes over ln v
        flattest, steepest = flattest / most, steepest / least
    try:
        d, h = np.broadcast_arrays(np.asarray(distance, dtype=np.float64), np.asarray(height, dtype=np.float64))
    except (TypeError, ValueError) as error:
        raise InputError(f"place: expected numbers, and arrays that broadcast: {error}") from None
    if np.ma.is_masked(distance) or np.ma.is_masked(height) or not (np.isfinite(d).all() and np.isfinite(h).all()):
        raise InputError("place: found a distance or height that is not a finite number, expected metres")
    speed = np.full(d.size, np.nan)
    if refusal:
        return speed.reshape(d.shape)
    axes = (np.unique(cells.distance_from), np.unique(cells.height_from))
    for part in (slice(i, i + _PLACES_AT_ONCE) for i in range(0, d.size, _PLACES_AT_ONCE)):
        x, y = d.ravel()[part], h.ravel()[part]
        at = [np.clip(np.searchsorted(a, p, "right") - 1, 0, a.size - 1) for a, p in zip(axes, (x, y), strict=True)]
        cell = at[0] * axes[1].size + at[1]
        slow = ~(flattest[cell] > 0) | ~np.isfinite(steepest[cell])
        for d_state, h_state in _contradicting(force_map, level):
            slow |= (np.abs(x - d_state) <= 2 * SAME_PLACE) & (np.abs(y - h_state) <= 2 * SAME_PLACE)
        quick = np.flatnonzero(~slow)
        slopes = (flattest[cell[quick]], steepest[cell[quick]])
        found = np.empty(x.size)
        found[quick] = _crossings(force_map, bound, x[quick], y[quick], np.log(level), *slopes)
        if slow.any():
            found[slow] = safe_speed(force_map, x[slow], y[slow], **case).speed
        speed[part] = found
    return speed.reshape(d.shape)


def _contradicting(force_map: ForceMap, limit: float) -> Iterator[tuple[float, float]]:
    """Places [m] of states of which an impact exceeded the device range and the limit."""
    if force_map.fit is None:
        return
    for states in (force_map.fit.states, force_map.fit.left_out, force_map.fit.test):
        above = states.at_least > limit
        yield from zip(states.distance[above].tolist(), states.height[above].tolist(), strict=True)


def _crossings(
    force_map: ForceMap,
    bound: Bound,
    d: FloatArray,
    h: FloatArray,
    log_limit: float,
    flattest: FloatArray,
    steepest: FloatArray,
) -> FloatArray:
    """Where a bound that rises with these slopes crosses the limit, from below, shape (n,); NaN where it does not."""

    def excess(which: Indices, v: FloatArray) -> FloatArray:
        force = np.clip(bound.upper(force_map, d[which], h[which], v), 1e-300, 1e300)
        return np.asarray(np.log(force) - log_limit)

    low, high = force_map.measured_range.speeds(d, h)
    speed = np.full(d.size, np.nan)
    which = np.flatnonzero(low <= high)
    bottom, top = excess(which, low[which]), excess(which, high[which])
    speed[which[top <= 0]] = high[which[top <= 0]]
    crossed = (bottom <= 0) & ~(top <= 0)
    which, bottom = which[crossed], bottom[crossed]
    below, above = low[which], high[which]
    v, value = below.copy(), bottom
    for _ in range(_ROUNDS):
        near, far = value / steepest[which], value / flattest[which]
        below = np.maximum(below, v - np.where(value <= 0, near, far))
        above = np.minimum(above, v - np.where(value <= 0, far, near))
        done = ~(above - below > _CLOSE)
        speed[which[done]] = np.maximum(below[done] - _ROOT, low[which[done]])
        which, below, above = which[~done], below[~done], above[~done]
        if not which.size:
            break
        v = 0.5 * (below + above)
        value = excess(which, v)
    speed[which] = np.maximum(below - _ROOT, low[which])
    return speed
