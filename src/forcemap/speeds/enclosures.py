"""How large a bound on the force can be anywhere on a patch of places and an interval of speeds: never too low.

ln F and the leverage are polynomials in place and in v (or ln v). On a patch their Bernstein coefficients enclose them:
no value lies outside the smallest and the largest coefficient (Lane and Riesenfeld 1981, Bounds on a polynomial,
https://doi.org/10.1007/BF01941490), and the gap closes with the square of the patch's size.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.errors import InputError
from forcemap.maps.bounds import Bound, FixedMargin, ToleranceBound
from forcemap.maps.force_map import ForceMap
from forcemap.speeds.tolerance_steps import ToleranceSteps

# Numerical settings: they decide how close an enclosure is and what it costs, never whether it holds.
_STEPS = 8  # parts of the speed interval whose slopes are enclosed one by one
_FIRST = 1 / 8  # first step of a frontier, a share of the interval
_LAST = 2.0**-15  # last step of a certified share, a share of the interval; shorter than 0.0001 m/s of any robot

# Rounding: enclosures are widened by more than these may be.
_ROUNDING = 1e-15  # of a value at a node, as a share; sums of coefficients have ten times that
_SLOPE_ROUNDING = 1e-9  # of a slope of ln of the bound
_LOG_ROUNDING = 2e-9  # of ln F, where it bounds from below: the table of the bound is raised by 1e-9

_ALL = slice(None)


@dataclass(frozen=True, eq=False)
class Patches:
    """Parallelograms of places: corner + s first + t second for s and t from 0 to 1.

    Parameters
    ----------
    corner, first, second : array, shape (n, 2)
        Distance and height of a corner, and the two edges from it [m].
    """

    corner: FloatArray
    first: FloatArray
    second: FloatArray

    @classmethod
    def of_places(cls, distance: FloatArray, height: FloatArray) -> Patches:
        """Patches without extent at places [m], shape (n,)."""
        corner = np.stack([distance, height], axis=1)
        return cls(corner, np.zeros_like(corner), np.zeros_like(corner))

    @classmethod
    def box(cls, near: FloatArray, far: FloatArray, low: FloatArray, high: FloatArray) -> Patches:
        """Rectangles: intervals of distance and of height [m], shape (n,)."""
        nothing = np.zeros_like(near)
        edges = np.stack([far - near, nothing], axis=1), np.stack([nothing, high - low], axis=1)
        return cls(np.stack([near, low], axis=1), *edges)

    def __len__(self) -> int:
        return len(self.corner)

    def places(self, s: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances and heights [m] at the parameters s, shape (a,), and t, shape (b,), each of shape (n, a, b)."""
        corner, first, second = (part.T[:, :, None, None] for part in (self.corner, self.first, self.second))
        distance, height = corner + first * s[:, None] + second * t
        return distance, height

    @property
    def corners(self) -> tuple[FloatArray, FloatArray]:
        """Distances and heights [m] of the four corners, each of shape (n, 4)."""
        ends = np.array([0.0, 1.0])
        distance, height = self.places(ends, ends)
        return distance.reshape(len(self), 4), height.reshape(len(self), 4)


@dataclass(frozen=True, eq=False)
class BoundEnclosure:
    """Bernstein coefficients of ln F and of the leverage on patches and intervals of speed.

    Parameters
    ----------
    log_force : array, shape (n, m, k)
        Coefficients of ln F; the last axis is that of speed.
    leverage : array, shape (n, m', k')
        Coefficients of the leverage; no coefficients for a bound that does not use it.
    low, high : array, shape (n,)
        The interval, of v [m/s] or of ln v.
    logarithmic : bool
        True if the interval is of ln v.
    margin : float
        Logarithm of the fixed factor on the force.
    tolerance : ToleranceSteps or None
        The allowance of a tolerance bound.
    """

    log_force: FloatArray
    leverage: FloatArray
    low: FloatArray
    high: FloatArray
    logarithmic: bool
    margin: float
    tolerance: ToleranceSteps | None

    def largest(self, start: FloatArray, stop: FloatArray, which: Indices | slice = _ALL) -> FloatArray:
        """Upper bound of ln of the bound on some patches, between shares of the interval from 0 to 1, shape (m,)."""
        log_force = _part(self.log_force[which], start, stop).max(axis=(1, 2))
        if self.tolerance is None:
            return np.asarray(log_force + self.margin)
        leverage = _part(self.leverage[which], start, stop).max(axis=(1, 2))
        return self.tolerance.largest(log_force, leverage)

    def smallest(self, start: FloatArray, stop: FloatArray, which: Indices | slice = _ALL) -> FloatArray:
        """Lower bound of ln of the bound; arguments as in `largest`."""
        log_force = _part(self.log_force[which], start, stop).min(axis=(1, 2)) - _LOG_ROUNDING
        if self.tolerance is None:
            return np.asarray(log_force + self.margin)
        leverage = _part(self.leverage[which], start, stop).min(axis=(1, 2))
        return self.tolerance.smallest(log_force, leverage)

    @property
    def slopes(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bound of the slope of ln of the bound over v or ln v, each of shape (n,).

        Where the first is positive the bound rises with speed on the whole patch and interval.
        """
        parts = [self._slopes_between(i / _STEPS, (i + 1) / _STEPS) for i in range(_STEPS)]
        return np.min([least for least, _ in parts], axis=0), np.max([most for _, most in parts], axis=0)

    def _slopes_between(self, start: float, stop: float) -> tuple[FloatArray, FloatArray]:
        ends = np.array([start]), np.array([stop])
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1 / ((self.high - self.low) * (stop - start))
        log_force = _part(self.log_force, *ends)
        least, most = (slope * scale for slope in _slopes(log_force))
        if self.tolerance is None:
            return least - _SLOPE_ROUNDING, most + _SLOPE_ROUNDING
        leverage = _part(self.leverage, *ends)
        falls, rises = (slope * scale for slope in _slopes(leverage))
        down, up = self.tolerance.slopes(falls, rises, leverage.min(axis=(1, 2)), leverage.max(axis=(1, 2)))
        shrunk = least * self.tolerance.share(log_force.min(axis=(1, 2)))  # of ln(F + error)
        least, most = np.minimum(np.minimum(least, shrunk), least + down), np.maximum(most, most + up)
        return least - _SLOPE_ROUNDING, most + _SLOPE_ROUNDING

    def speed(self, share: FloatArray) -> FloatArray:
        """The speed [m/s] at a share of the interval, shape (n,)."""
        value = self.low + (self.high - self.low) * share
        return np.exp(value) if self.logarithmic else value

    def certified(self, log_limit: FloatArray, *, least: float = _LAST) -> FloatArray:
        """Share of the interval up to which, from its low end, the bound stays within a limit on the whole patch.

        It is a lower bound, shape (n,): the bound may stay within the limit for longer. NaN where the bound may exceed
        the limit at the low end.
        """
        start = np.zeros(self.low.size)
        share = frontier(lambda rows, a, b: self.largest(a, b, rows) <= log_limit[rows], self.low.size, least)
        return np.where(self.largest(start, start) <= log_limit, share, np.nan)

    def exceeding(self, log_limit: FloatArray, *, least: float) -> FloatArray:
        """Share of the interval down to which, from its high end, the bound exceeds a limit everywhere, shape (n,)."""
        return 1 - frontier(
            lambda rows, a, b: self.smallest(1 - b, 1 - a, rows) > log_limit[rows], self.low.size, least
        )


def frontier(holds: Callable[[Indices, FloatArray, FloatArray], Mask], size: int, least: float) -> FloatArray:
    """Share of an interval up to which a condition certainly holds, from 0 on, shape (size,).

    Parameters
    ----------
    holds : callable
        Takes numbers of intervals and shares from, to, shape (m,); true where the condition certainly holds in between.
    size : int
        Number of intervals.
    least : float
        Shortest step. Steps are an eighth at first; one that fails is halved, two in a row that succeed double it.
    """
    share, step, again = np.zeros(size), np.full(size, _FIRST), np.zeros(size, dtype=np.bool_)
    rows = np.arange(size)
    while rows.size:
        ahead = np.minimum(share[rows] + step[rows], 1.0)
        certain = holds(rows, share[rows], ahead)
        share[rows[certain]] = ahead[certain]
        step[rows] *= np.where(certain, np.where(again[rows], 2.0, 1.0), 0.5)
        again[rows] = certain
        rows = rows[(share[rows] < 1) & (step[rows] >= least)]
    return share


def enclose(force_map: ForceMap, bound: Bound, patches: Patches, low: FloatArray, high: FloatArray) -> BoundEnclosure:
    """Enclose a bound on patches, shape (n,), and intervals of speed [m/s], shape (n,).

    Raises
    ------
    InputError
        A bound of another kind than FixedMargin and ToleranceBound, which cannot be enclosed.
    BoundNotAvailable
        The bound cannot be computed for the map.
    """
    bound.require(force_map)
    logarithmic = force_map.form.logarithmic
    first, last = (np.log(low), np.log(high)) if logarithmic else (low, high)
    flat = not (patches.first.any() or patches.second.any())
    degrees = _degrees(force_map, flat)

    def log_force(*state: FloatArray) -> FloatArray:
        (profile,) = force_map.form.speed_profiles(force_map.coefficients[None], *state[:2])
        return profile(state[2])

    def coefficients(function: Callable[..., FloatArray], times: int) -> FloatArray:
        numbers = [times * degree for degree in degrees]
        s, t, u = (_nodes(number) for number in numbers)
        distance, height = patches.places(s, t)
        nodes = first[:, None] + (last - first)[:, None] * u
        speed = (np.exp(nodes) if logarithmic else nodes)[:, None, None, :]
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            values = function(distance[..., None], height[..., None], speed)
            return _bernstein(np.broadcast_to(values, np.broadcast_shapes(values.shape, speed.shape)), numbers)

    interval = (first, last, logarithmic)
    if type(bound) is FixedMargin:
        nothing = np.empty((len(patches), 0, 0))
        return BoundEnclosure(coefficients(log_force, 1), nothing, *interval, math.log1p(bound.margin), None)
    if type(bound) is ToleranceBound:
        tolerance, leverage = ToleranceSteps.of(bound, force_map), coefficients(force_map.leverage, 2)
        return BoundEnclosure(coefficients(log_force, 1), leverage, *interval, 0.0, tolerance)
    raise InputError(f"bound: found {bound!r}, expected FixedMargin or ToleranceBound, which alone can be enclosed")


def _degrees(force_map: ForceMap, flat: bool) -> tuple[int, int, int]:
    """Degrees of ln F along the first and second edge of a patch, and along v or ln v."""
    terms = force_map.form.terms
    along_any = max(term.distance + term.height for term in terms)
    along_axis = max(max(term.distance, term.height) for term in terms)
    along_speed = 1 if force_map.form.logarithmic else force_map.form.speed_degree
    return (0, 0, along_speed) if flat else (along_any, along_axis, along_speed)


def _bernstein(values: FloatArray, degrees: list[int]) -> FloatArray:
    """Coefficients (n, a * b, c) from values (n, a, b, c) at the nodes, raised by what rounding may hide."""
    shift = _ROUNDING * (1 + np.abs(values).max(axis=(1, 2, 3), initial=0.0))
    for axis, degree in enumerate(degrees, start=1):
        inverse = _to_bernstein(degree)
        values = np.moveaxis(np.moveaxis(values, axis, -1) @ inverse.T, -1, axis)
        shift = shift * np.abs(inverse).sum(axis=1).max()
    n, a, b, c = values.shape
    return np.asarray(values.reshape(n, a * b, c) + 10 * shift[:, None, None])


@lru_cache(maxsize=64)
def _nodes(degree: int) -> FloatArray:
    """Chebyshev points of [0, 1], from which a polynomial of that degree is interpolated without losing digits."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)))


def _basis(degree: int, x: FloatArray) -> FloatArray:
    """Bernstein polynomials at x, shape (..., degree + 1)."""
    up, down = [np.ones_like(x)], [np.ones_like(x)]
    for _ in range(degree):
        up.append(up[-1] * x)
        down.append(down[-1] * (1 - x))
    return np.stack([math.comb(degree, i) * up[i] * down[degree - i] for i in range(degree + 1)], axis=-1)


@lru_cache(maxsize=64)
def _to_bernstein(degree: int) -> FloatArray:
    return np.asarray(np.linalg.inv(_basis(degree, _nodes(degree))))


def _part(coefficients: FloatArray, start: FloatArray, stop: FloatArray) -> FloatArray:
    """Coefficients between shares of the interval of speed, shape (n, m, k)."""
    degree = coefficients.shape[2] - 1
    nodes = start[:, None] + (stop - start)[:, None] * _nodes(degree)
    change = _to_bernstein(degree) @ _basis(degree, nodes)
    return np.asarray(coefficients @ change.transpose(0, 2, 1))


def _slopes(coefficients: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bound of the derivative over the share of the interval, each of shape (n,)."""
    degree = coefficients.shape[2] - 1
    if degree == 0:
        return np.zeros(len(coefficients)), np.zeros(len(coefficients))
    change = degree * np.diff(coefficients, axis=2)
    return np.asarray(change.min(axis=(1, 2))), np.asarray(change.max(axis=(1, 2)))
