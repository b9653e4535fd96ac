"""Pieces of the workspace that share one speed: zones of distance and height, and straight segments in space."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.errors import InputError
from forcemap.maps.measured_range import MeasuredRange
from forcemap.speeds.enclosures import Patches
from forcemap.speeds.range_enclosure import footprint

_PIECES = 32  # boxes around a segment, for whether it touches a place; a choice: more boxes refuse fewer segments
_LEAST_LENGTH = 1e-9  # [m]; a shorter segment has no direction
_SAG_ROUNDING = 1e-15  # [m]; of the sag of the hyperbola below its chord
_MOST_ZONES = 100_000  # of a grid; a choice: seconds to minutes


class Regions(Protocol):
    """Several pieces of the workspace, whose parts can be covered with patches of places."""

    def __len__(self) -> int: ...

    @property
    def probes(self) -> tuple[FloatArray, FloatArray]:
        """A few places [m] of each piece, its ends among them, shapes (n, k)."""

    def extremes(self, measured_range: MeasuredRange) -> tuple[FloatArray, FloatArray]:
        """Places [m] of each piece, shapes (n, k): if these lie in the range, the whole piece does.

        The smallest highest measured speed of a piece is found at one of them, too.
        """

    def patches(self, which: Indices, part: FloatArray) -> Patches:
        """Patches that cover parts of pieces; `part`, shape (m, 4), is s from, s to, t from, t to, from 0 to 1."""

    def halves(self, part: FloatArray) -> FloatArray:
        """Smaller parts, shape (c, m, 4), that together cover each part, shape (m, 4)."""

    def touching(self, distance: float, height: float, reach: float) -> Mask:
        """True for the pieces that may lie within `reach` [m] of a place [m], shape (n,)."""


@dataclass(frozen=True, eq=False)
class Zones:
    """Zones of the workspace, closed intervals of distance and height.

    Parameters
    ----------
    distance_from, distance_to, height_from, height_to : array, shape (n,)
        The intervals [m].

    Raises
    ------
    InputError
        No zone, a figure that is not finite, or an interval that ends before it begins.
    """

    distance_from: FloatArray
    distance_to: FloatArray
    height_from: FloatArray
    height_to: FloatArray

    def __post_init__(self) -> None:
        names = ("distance_from", "distance_to", "height_from", "height_to")
        arrays = np.broadcast_arrays(*(np.atleast_1d(_finite("zone", getattr(self, name))) for name in names))
        for name, array in zip(names, arrays, strict=True):
            object.__setattr__(self, name, array)
        if arrays[0].ndim != 1 or not arrays[0].size:
            raise InputError("zones: expected at least one zone, as numbers or arrays of shape (n,)")
        if np.any(arrays[0] > arrays[1]) or np.any(arrays[2] > arrays[3]) or np.any(arrays[0] < 0):
            raise InputError("zone: found one that ends before it begins, or a negative distance; expected from <= to")

    @classmethod
    def between(cls, distance_edges: FloatArray, height_edges: FloatArray) -> Zones:
        """A grid of zones between edges [m], shapes (n + 1,) and (m + 1,), along distance first."""
        near, low = np.meshgrid(distance_edges[:-1], height_edges[:-1], indexing="ij")
        far, high = np.meshgrid(distance_edges[1:], height_edges[1:], indexing="ij")
        return cls(near.ravel(), far.ravel(), low.ravel(), high.ravel())

    def __len__(self) -> int:
        return int(self.distance_from.size)

    @property
    def probes(self) -> tuple[FloatArray, FloatArray]:
        """The four corners [m], shapes (n, 4)."""
        near, far, low, high = self.distance_from, self.distance_to, self.height_from, self.height_to
        return np.stack([near, near, far, far], axis=1), np.stack([low, high, low, high], axis=1)

    def extremes(self, measured_range: MeasuredRange) -> tuple[FloatArray, FloatArray]:
        """The corners: the range is convex, and its highest speed falls towards them."""
        return self.probes

    def patches(self, which: Indices, part: FloatArray) -> Patches:
        """The parts themselves."""
        width = (self.distance_to - self.distance_from)[which]
        tall = (self.height_to - self.height_from)[which]
        nothing = np.zeros(len(part))
        corner = np.stack(
            [self.distance_from[which] + width * part[:, 0], self.height_from[which] + tall * part[:, 2]], axis=1
        )
        first = np.stack([width * (part[:, 1] - part[:, 0]), nothing], axis=1)
        return Patches(corner, first, np.stack([nothing, tall * (part[:, 3] - part[:, 2])], axis=1))

    def grown(self, reach: float) -> Zones:
        """Zones larger by `reach` [m] on every side: where a robot may be that is programmed to be in these."""
        near = np.maximum(self.distance_from - reach, 0.0)
        return Zones(near, self.distance_to + reach, self.height_from - reach, self.height_to + reach)

    def halves(self, part: FloatArray) -> FloatArray:
        """Quarters of each part."""
        s = (part[:, 0] + part[:, 1]) / 2
        t = (part[:, 2] + part[:, 3]) / 2
        a, b, c, d = part.T
        quarters = [(a, s, c, t), (s, b, c, t), (a, s, t, d), (s, b, t, d)]
        return np.stack([np.stack(quarter, axis=1) for quarter in quarters])

    def touching(self, distance: float, height: float, reach: float) -> Mask:
        """True for the zones within `reach` [m] of a place [m] along both axes."""
        return (
            (self.distance_from <= distance + reach)
            & (self.distance_to >= distance - reach)
            & (self.height_from <= height + reach)
            & (self.height_to >= height - reach)
        )


@dataclass(frozen=True, eq=False)
class Segments:
    """Straight segments in space; the middle of one may be nearer to the base than its ends.

    Parameters
    ----------
    start, end : array, shape (n, 3)
        Ends in the frame of the base [m].

    Raises
    ------
    InputError
        No segment, a figure that is not finite, another shape, or a segment without length.
    """

    start: FloatArray
    end: FloatArray

    def __post_init__(self) -> None:
        for name in ("start", "end"):
            array = np.atleast_2d(_finite("segment", getattr(self, name)))
            if array.ndim != 2 or array.shape[1] != 3 or not len(array):
                raise InputError(f"segments: found the shape {array.shape}, expected at least one of (n, 3)")
            object.__setattr__(self, name, array)
        if self.start.shape != self.end.shape:
            raise InputError("segments: expected as many starts as ends")
        short = np.flatnonzero(np.linalg.norm(self.end - self.start, axis=1) < _LEAST_LENGTH)
        if short.size:
            raise InputError(f"segment {short[0] + 1}: found no length, expected two different ends")

    def __len__(self) -> int:
        return len(self.start)

    def places(self, share: FloatArray, which: Indices | None = None) -> tuple[FloatArray, FloatArray]:
        """Distances and heights [m] at shares from 0 to 1 of the segments, shape (n, ...)."""
        pick = slice(None) if which is None else which
        shape = (len(share), 3, *[1] * (share.ndim - 1))
        point = self.start[pick].reshape(shape) + (self.end - self.start)[pick].reshape(shape) * share[:, None]
        return np.asarray(np.hypot(point[:, 0], point[:, 1])), point[:, 2]

    @property
    def nearest(self) -> FloatArray:
        """Share at which a segment is nearest to the axis of the base, shape (n,)."""
        along = (self.end - self.start)[:, :2]
        squares = np.square(along).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = -(self.start[:, :2] * along).sum(axis=1) / squares
        return np.clip(np.where(squares > 0, share, 0.0), 0.0, 1.0)

    @property
    def probes(self) -> tuple[FloatArray, FloatArray]:
        """Start, nearest point and end [m], shapes (n, 3)."""
        nearest = self.nearest
        return self.places(np.stack([np.zeros_like(nearest), nearest, np.ones_like(nearest)], axis=1))

    @property
    def zones(self) -> Zones:
        """The intervals of distance and height that the segments run through."""
        distance, height = self.probes
        return Zones(distance.min(axis=1), distance.max(axis=1), height.min(axis=1), height.max(axis=1))

    def extremes(self, measured_range: MeasuredRange) -> tuple[FloatArray, FloatArray]:
        """Ends, nearest point, and the points where a segment is parallel to a facet of the range.

        d is a hyperbola over the length: with u the share from the nearest point, d = sqrt(d0^2 + u^2 b^2), and a facet
        a d + c h is extreme where a u b^2 / d = -c (height gained).
        """
        along = self.end - self.start
        squares = np.square(along[:, :2]).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            foot = np.where(squares > 0, -(self.start[:, :2] * along[:, :2]).sum(axis=1) / squares, 0.0)
            least = self.places(foot[:, None])[0][:, 0]
            facets = np.vstack([measured_range.facets, footprint(measured_range).facets])
            slope = -facets[:, 1] / facets[:, 0] * along[:, 2:]
            u = slope * least[:, None] / np.sqrt(squares[:, None] * (squares[:, None] - slope**2))
        shares = np.where(np.isfinite(u), np.clip(foot[:, None] + u, 0.0, 1.0), 0.0)
        ends = np.tile([0.0, 1.0], (len(self), 1))
        return self.places(np.hstack([ends, self.nearest[:, None], np.unique(shares, axis=1)]))

    def patches(self, which: Indices, part: FloatArray) -> Patches:
        """Strips between the chord of each part and the line below it that the hyperbola does not cross."""
        ends, heights = self.places(part[:, :2], which)
        along = (self.end - self.start)[which]
        share = part[:, 1] - part[:, 0]
        least = self.places(np.clip(self.nearest[which], part[:, 0], part[:, 1])[:, None], which)[0][:, 0]
        crossed = (self.start[which, 0] * along[:, 1] - self.start[which, 1] * along[:, 0]) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            bent = share**2 / 8 * crossed / least**3  # the second derivative of d is crossed / d^3
        sag = np.minimum(np.where(np.isnan(bent), np.inf, bent), ends.max(axis=1) - least) + _SAG_ROUNDING
        first = np.stack([ends[:, 1] - ends[:, 0], heights[:, 1] - heights[:, 0]], axis=1)
        second = np.stack([-sag, np.zeros(len(part))], axis=1)
        return Patches(np.stack([ends[:, 0], heights[:, 0]], axis=1), first, second)

    def halves(self, part: FloatArray) -> FloatArray:
        """Halves of each part."""
        s = (part[:, 0] + part[:, 1]) / 2
        a, b, c, d = part.T
        return np.stack([np.stack([a, s, c, d], axis=1), np.stack([s, b, c, d], axis=1)])

    def touching(self, distance: float, height: float, reach: float) -> Mask:
        """True for the segments with a box around a part of them within `reach` [m] of a place [m]."""
        edges = np.linspace(0.0, 1.0, _PIECES + 1)
        close = np.zeros(len(self), dtype=np.bool_)
        which = np.arange(len(self))
        for start, stop in itertools.pairwise(edges):
            d, h = self.patches(which, np.tile([start, stop], (len(self), 1))).corners
            close |= (
                (d.min(axis=1) <= distance + reach)
                & (d.max(axis=1) >= distance - reach)
                & (h.min(axis=1) <= height + reach)
                & (h.max(axis=1) >= height - reach)
            )
        return close


def zone_grid(measured_range: MeasuredRange, size: float) -> Zones:
    """Zones of equal size that tile the box around a measured range, none wider or taller than `size` [m].

    Raises
    ------
    InputError
        A size that is not positive and finite, or one that makes more than 100 000 zones.
    """
    if not 0 < size < np.inf:
        raise InputError(f"zone size: found {size:g} m, expected a positive finite number")
    lowest, highest = measured_range.lowest[:2], measured_range.highest[:2]
    counts = np.maximum(1, np.ceil((highest - lowest) / size - 1e-9))
    if np.prod(counts) > _MOST_ZONES:
        raise InputError(f"zone size: found {size:g} m, expected one that makes at most 100 000 zones")
    d, h = (np.linspace(a, b, int(n) + 1) for a, b, n in zip(lowest, highest, counts, strict=True))
    return Zones.between(d, h)


def _finite(what: str, values: ArrayLike) -> FloatArray:
    array = np.asarray(values, dtype=np.float64)
    if np.ma.is_masked(values) or not np.isfinite(array).all():
        raise InputError(f"{what}: found a figure that is not a finite number, expected metres")
    return array
