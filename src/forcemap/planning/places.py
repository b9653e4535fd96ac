"""The range of places that a campaign is to cover, and the states among which measurements are chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.state import States
from forcemap.errors import InputError


@dataclass(frozen=True)
class PlaceRange:
    """Nearest and farthest distance, lowest and highest height [m]."""

    distances: tuple[float, float]
    heights: tuple[float, float]

    @classmethod
    def of(cls, distances: Sequence[float], heights: Sequence[float], measured: States | None) -> PlaceRange:
        """The range given, else that of the measured states."""
        found = []
        for name, values in (("distances", distances), ("heights", heights)):
            given = [float(value) for value in values]
            if not given and measured is None:
                raise InputError(
                    f"{name}: found none and no measured state, expected (lowest, highest) in metres "
                    f"(--{name}-m LOWEST,HIGHEST)"
                )
            if not given and measured is not None:
                axis = measured.distance if name == "distances" else measured.height
                given = [float(axis.min()), float(axis.max())]
            low = 0.0 if name == "distances" else -10.0
            finite = np.isfinite(given).all()
            if len(given) < 2 or not finite or not low <= min(given) < max(given) <= 10:
                raise InputError(f"{name}: found {given}, expected (lowest, highest) in metres, up to 10")
            found.append((min(given), max(given)))
        return cls(found[0], found[1])

    def grid(self, count: int) -> FloatArray:
        """Places, `count` along each axis, shape (count^2, 2); those between the ends to 0.001 m."""
        axes = []
        for low, high in (self.distances, self.heights):
            axis = np.round(np.linspace(low, high, count), 3)
            axis[0], axis[-1] = low, high
            axes.append(axis)
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)

    def states(self, count: int, speeds: FloatArray) -> FloatArray:
        """Every place of the grid at every speed, shape (n, 3)."""
        places = self.grid(count)
        return np.column_stack([np.repeat(places, speeds.size, axis=0), np.tile(speeds, len(places))])

    def corners(self, states: FloatArray) -> Mask:
        """Which states lie at a corner of the range, shape (n,)."""
        ends = [np.isin(states[:, i], ends) for i, ends in enumerate((self.distances, self.heights))]
        return np.asarray(ends[0] & ends[1])

    def apart(self, states: FloatArray, others: FloatArray) -> FloatArray:
        """How far the places of states lie apart, as shares of the range, shape (n, m); of a flat range, in metres."""
        size = np.array([self.distances[1] - self.distances[0], self.heights[1] - self.heights[0]])
        size[size == 0] = 1.0
        offsets = (states[:, None, :2] - others[None, :, :2]) / size
        return np.asarray(np.sqrt(np.square(offsets).sum(axis=-1)))
