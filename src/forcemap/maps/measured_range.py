"""The measured range: the convex hull of the measured states in (d, h, v), outside of which nothing is claimed."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Mask
from forcemap.maps.convex_hull import half_spaces

TOLERANCE = 1e-9
"""A place or speed this close to the hull belongs to it [m, m/s]: what rounding leaves of coordinates."""

_FLAT = 1e-5
"""Extent [m, m/s] below which states count as lying in a plane, on a line or at a point: no campaign resolves it
(docs/decisions.md)."""


_FEW_PLACES = 60  # of which every pair is looked at; qhull, whose import takes longer, finds the corners of more


class MeasuredRange:
    """Convex hull of states, closed; it may be flat (one height, one speed).

    Parameters
    ----------
    points : array
        (distance, height, speed) of the states, shape (n, 3) [m, m, m/s].
    """

    def __init__(self, points: FloatArray) -> None:
        self.points = points

    @property
    def lowest(self) -> FloatArray:
        """Lowest distance [m], height [m] and speed [m/s] measured anywhere."""
        return np.asarray(self.points.min(axis=0))

    @property
    def highest(self) -> FloatArray:
        """Highest distance [m], height [m] and speed [m/s] measured anywhere."""
        return np.asarray(self.points.max(axis=0))

    @cached_property
    def facets(self) -> FloatArray:
        """Half-spaces a_d d + a_h h + a_v v + b <= 0 whose intersection is the hull, rows (a_d, a_h, a_v, b).

        Every (a_d, a_h, a_v) has length 1, so the left side is a distance from the hull's plane.
        """
        centre = self.points.mean(axis=0)
        offsets = self.points - centre
        _, _, axes = np.linalg.svd(offsets, full_matrices=len(offsets) < 3)
        thick = np.ptp(offsets @ axes.T, axis=0) > _FLAT
        half_spaces = _hull(offsets @ axes[thick].T, axes[thick])
        # Every hull is cut by its box, a flat one also across itself: rounding of a facet cannot reach beyond it.
        for normal in [*axes[~thick], *np.eye(3)]:
            extent = offsets @ normal
            half_spaces = np.vstack([half_spaces, [*normal, -extent.max()], [*-normal, extent.min()]])
        half_spaces[:, 3] -= half_spaces[:, :3] @ centre
        return half_spaces

    def speeds(self, distance: FloatArray, height: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest measured speed [m/s] at places [m] of one shape; NaN outside the range."""
        low, high = np.full(distance.shape, -np.inf), np.full(distance.shape, np.inf)
        low_closed, high_closed = low.copy(), high.copy()
        inside = np.ones(distance.shape, dtype=np.bool_)
        for a_d, a_h, a_v, b in self.facets.tolist():
            place = a_d * distance + a_h * height + b
            if abs(a_v) <= TOLERANCE:
                inside &= place <= TOLERANCE
            elif a_v > 0:
                high = np.minimum(high, -place / a_v)
                high_closed = np.minimum(high_closed, (TOLERANCE - place) / a_v)
            else:
                low = np.maximum(low, -place / a_v)
                low_closed = np.maximum(low_closed, (TOLERANCE - place) / a_v)
        inside &= low_closed <= high_closed
        middle = np.clip(0.5 * (low + high), low_closed, high_closed)  # where only the tolerance lets a place in
        low, high = np.where(low > high, middle, low), np.where(low > high, middle, high)
        return np.where(inside, self._snap(low), np.nan), np.where(inside, self._snap(high), np.nan)

    def speeds_near(self, distance: FloatArray, height: FloatArray, reach: float) -> tuple[FloatArray, FloatArray]:
        """The same, and at a place outside those of the nearest place of the range if it is at most `reach` away [m].

        For what was measured: an impact a few millimetres beyond the range speaks for and against its edge.
        """
        low, high = self.speeds(distance, height)
        if (outside := np.isnan(low)).any():
            places = np.column_stack([distance[outside], height[outside]])
            nearest = self._nearest(places)
            near = np.linalg.norm(nearest - places, axis=1) <= reach
            low[outside], high[outside] = (np.where(near, speed, np.nan) for speed in self.speeds(*nearest.T))
        return low, high

    def _nearest(self, places: FloatArray) -> FloatArray:
        """The nearest places of the range to places outside it, both of shape (m, 2) [m].

        They lie on a side of the polygon of the places of the range: of all lines between two of them none is nearer.
        """
        corners = _corners(np.unique(self.points[:, :2], axis=0))
        one, other = np.triu_indices(len(corners))
        start, way = corners[one], corners[other] - corners[one]
        length = np.maximum(np.square(way).sum(axis=1), np.finfo(np.float64).tiny)
        share = np.clip(((places[:, None] - start) * way).sum(axis=2) / length, 0.0, 1.0)
        on_lines = start + share[..., None] * way
        away = np.square(on_lines - places[:, None]).sum(axis=2).argmin(axis=1)
        return np.asarray(on_lines[np.arange(len(places)), away])

    def contains(self, distance: ArrayLike, height: ArrayLike, speed: ArrayLike) -> Mask:
        """True where a state lies in the hull, at a place [m] and speed [m/s]; arguments broadcast."""
        d, h, v = np.broadcast_arrays(*(np.asarray(axis, dtype=np.float64) for axis in (distance, height, speed)))
        low, high = self.speeds(d, h)
        return np.asarray((low - TOLERANCE <= v) & (v <= high + TOLERANCE))

    def near(self, coordinates: FloatArray, reach: FloatArray) -> Mask:
        """True for states (d, h, v), shape (m, 3), in the hull or beyond it by at most `reach` along every axis."""
        facets = self.facets
        beyond = coordinates @ facets[:, :3].T + facets[:, 3] > np.abs(facets[:, :3]) @ reach
        return np.asarray(~beyond.any(axis=1))

    def _snap(self, speed: FloatArray) -> FloatArray:
        """The speed of a state where one is this close, so that a measured 0.2 m/s reads 0.2 m/s."""
        measured = np.unique(self.points[:, 2])
        index = np.clip(np.searchsorted(measured, speed), 1, max(1, measured.size - 1))
        before, after = measured[index - 1], measured[np.minimum(index, measured.size - 1)]
        nearest = np.where(np.abs(speed - before) <= np.abs(after - speed), before, after)
        return np.where(np.abs(nearest - speed) <= TOLERANCE, nearest, speed)


def _corners(places: FloatArray) -> FloatArray:
    """Places [m] among which all corners of their convex hull are: of many those corners alone."""
    if len(places) <= _FEW_PLACES:
        return places
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(places[ConvexHull(places).vertices])
    except QhullError:  # on a line: its ends
        along = places @ np.linalg.svd(places - places.mean(axis=0))[2][0]
        return np.asarray(places[[along.argmin(), along.argmax()]])


def _hull(points: FloatArray, axes: FloatArray) -> FloatArray:
    """Half-spaces of the convex hull of points given in coordinates along `axes`, shape (m, 4)."""
    rank = len(axes)
    if rank == 0:
        return np.empty((0, 4))
    if rank == 1:
        equations = np.array([[1.0, -points.max()], [-1.0, points.min()]])
    elif rank == 3:
        equations = half_spaces(points)
    else:
        from scipy.spatial import ConvexHull

        equations = ConvexHull(points).equations
    return np.column_stack([equations[:, :-1] @ axes, equations[:, -1]])
