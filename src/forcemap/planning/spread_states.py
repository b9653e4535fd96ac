"""States spread over places: the corners at the slowest and fastest speed, places and speeds between them.

Three levels of each coordinate hide a shape between the levels, and an error of a level: 1, d and d^2 take it up and no
residual moves. As many states at more places, each at a distance and a height of its own, show both.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.state import PLACE_SIZE, StateTolerance, clusters
from forcemap.errors import InputError
from forcemap.planning.design import DECIMALS, STEP, farthest_within, heights_within

STATES = 27
"""States of a campaign to train a map, unless stated: the paper's number."""

PLACES = 14
"""Places of a campaign, unless stated: with more little is gained but where effects are shared, with fewer the bound is
wider (docs/validity.md, "How many places?")."""

CORNERS = np.array(list(itertools.product((1.0, 0.0), repeat=2)))
"""Shares of the ranges of distance and height, shape (4, 2): far before near, high before low."""

_SPEEDS = 5  # between the slowest and the fastest (docs/decisions.md: seven speeds in all)
_TRIES = 400  # random permutations of the heights; a choice
_SPEED_STEP = 0.005  # [m/s]; to which speeds are rounded if they lie far enough apart, else to STEP
_ROUNDING = 1e-9  # share by which places and speeds must lie further apart than the tolerance


def spread_places(
    distances: tuple[float, float],
    heights: tuple[float, float],
    count: int,
    *,
    least: int,
    reach: float,
    tolerance: StateTolerance,
    seed: int,
) -> FloatArray:
    """The four corners, then places between them by distance, all within reach, shape (count, 2) [m].

    Those between are a Latin hypercube: evenly spaced distances with a permutation of evenly spaced heights, out of
    some hundred the one that keeps places furthest apart. Where the reach cuts the range, the highest and lowest
    heights are those at which two corners fit, and at every height the distances end at the farthest one within reach.

    Parameters
    ----------
    distances, heights : tuple of float
        Lowest and highest [m].
    count : int
        Number of places, the corners among them.
    least : int
        The fewest that would do.
    reach : float
        Largest distance of a place from the origin of the base [m].
    tolerance : StateTolerance
        Places lie further apart than this, and than what counts as one place.
    seed : int
        Of the permutations.

    Raises
    ------
    InputError
        The range within reach is too narrow for so many places, or there is none.
    """
    nearest = min(max(heights[0], 0.0), heights[1])
    if (away := math.hypot(distances[0], nearest)) > reach:
        which = {heights[0]: "the lowest height", heights[1]: "the highest height"}.get(nearest, "a height")
        raise InputError(
            f"reach: found {reach:g} m, but the lowest distance, {distances[0]:g} m, at {which}, {nearest:g} m, is "
            f"beyond the reach, {away:.3f} m from the base; choose nearer places, or a larger reach"
        )
    size = max(PLACE_SIZE, tolerance.place)
    ranges = distances, heights, reach, size, seed
    if (places := _places_apart(count, *ranges)) is not None:
        return places
    fewer = next((n for n in range(count - 1, least - 1, -1) if _places_apart(n, *ranges) is not None), None)
    reached = math.hypot(distances[1], max(map(abs, heights))) <= reach
    wider = "wider ranges" if reached else "wider ranges or a larger reach"
    raise InputError(
        f"places: found {count}, expected {wider}{f', or at most {fewer} places' if fewer else ''}: the distances and "
        f"heights{'' if reached else f' within the reach of {reach:g} m'} have no room for {count} more than "
        f"{1000 * size:g} mm apart, closer ones count as one{'' if fewer else f', and at least {least} are needed'}"
    )


def _places_apart(
    count: int, distances: tuple[float, float], heights: tuple[float, float], reach: float, size: float, seed: int
) -> FloatArray | None:
    """The places within reach, shape (count, 2); None where some would lie within `size` [m] of each other."""
    heights = heights_within(distances, heights, reach, 2 * size)
    if heights[0] >= heights[1]:
        return None
    share = np.vstack([CORNERS, _hypercube(count - len(CORNERS), np.random.default_rng(seed))])
    height = _along(*heights, share[:, 1])
    farthest = farthest_within(distances, height, reach)
    places = np.column_stack([_along(distances[0], farthest, share[:, 0]), height])
    return places if clusters(places / (size * (1 + _ROUNDING))).max() + 1 == count else None


def spread_speeds(
    corner: Mask, fastest: FloatArray, slowest: float, n: int, *, tolerance: StateTolerance
) -> list[list[float]]:
    """The speeds of n states at places of shape (k,), ascending at each place [m/s].

    Corners get the slowest and the fastest. The others share the remaining states as evenly as possible and cycle
    through five evenly spaced speeds between these two; a place with more states, or too little room for five, has
    speeds of its own.

    Parameters
    ----------
    corner : array of bool
        True for the corners.
    fastest : array
        The fastest speed of each place [m/s].
    slowest : float
        The slowest [m/s].
    n : int
        Number of states.
    tolerance : StateTolerance
        The speeds of a place lie further apart than this.

    Raises
    ------
    InputError
        So many do not fit.
    """
    apart, span = tolerance.speed * (1 + _ROUNDING), fastest - slowest
    room = np.where(corner, 0, np.maximum(np.floor(span / (apart + STEP)) - 1, 1)).astype(np.int64)
    count = np.where(corner, 1 + (span > apart), 0)
    while (left := n - int(count.sum())) > 0:
        free = np.flatnonzero(count < room)
        if not free.size:
            raise InputError(
                f"states: found {n}, expected at most {count.sum()} at these {len(count)} places: no more speeds fit "
                "between the slowest and the fastest that can be measured; name fewer states, or a wider range"
            )
        count[free[:left]] += 1
    speeds, turn = [], 0
    for is_corner, k, most, top in zip(corner.tolist(), count.tolist(), room.tolist(), fastest.tolist(), strict=True):
        if is_corner:
            speeds.append([slowest, top][:k])
            continue
        levels = _SPEEDS if k < _SPEEDS <= most else k
        gap = (top - slowest) / (levels + 1)
        step = next((step for step in (_SPEED_STEP, STEP) if gap - step > apart), None)
        between = [slowest + gap * (1 + j) for j in range(levels)]
        if step:
            between = [round(round(v / step) * step, DECIMALS) for v in between]
        speeds.append(sorted(between[2 * (turn + j) % levels if k < levels else j] for j in range(k)))
        turn += k
    return speeds


def _along(low: float, high: float | FloatArray, share: FloatArray) -> FloatArray:
    """Values at shares of a range [m]; those between its ends are rounded to `STEP`."""
    inside = np.clip((low + share * (np.asarray(high) - low)).round(DECIMALS), low, high)
    return np.asarray(np.where(share == 0, low, np.where(share == 1, high, inside)))


def _hypercube(count: int, rng: np.random.Generator) -> FloatArray:
    """Shares of the ranges of distance and height strictly between the ends, shape (count, 2).

    Multiples of a number without a common divisor, which make a lattice, are among the permutations tried.
    """
    from scipy.spatial.distance import pdist

    number = np.arange(1, count + 1)
    tries = [number * step % (count + 1) for step in range(2, count) if math.gcd(step, count + 1) == 1]
    tries += [rng.permutation(number) for _ in range(_TRIES)]
    shares = (np.column_stack([number, permutation]) / (count + 1) for permutation in tries)
    return max(shares, key=lambda share: float(pdist(np.vstack([CORNERS, share])).min()))
