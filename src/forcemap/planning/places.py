"""The range of places that a campaign is to cover, and the states among which measurements are chosen."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.state import PLACE_SIZE, States, StateTolerance
from forcemap.errors import InputError
from forcemap.maps.form_test import NEAR
from forcemap.planning.design import DECIMALS, LARGEST, STEP, farthest_within, heights_within


@dataclass(frozen=True)
class PlaceRange:
    """Nearest and farthest distance, lowest and highest height, largest distance from the base's origin [m]."""

    distances: tuple[float, float]
    heights: tuple[float, float]
    reach: float = math.inf

    @classmethod
    def of(
        cls, distances: Sequence[float], heights: Sequence[float], measured: States | None, reach: float = math.inf
    ) -> PlaceRange:
        """The range given, else that of the measured states, within reach as the spread design has it."""
        ranges = []
        for axis, (name, values, low) in enumerate((("distances", distances, 0.0), ("heights", heights, -LARGEST))):
            given = [float(value) for value in values]
            if not given and measured is None:
                raise InputError(
                    f"{name}: found none and no measured state, expected (lowest, highest) in metres "
                    f"(--{name}-m LOWEST,HIGHEST)"
                )
            if not given and measured is not None:
                coordinate = measured.coordinates[:, axis]
                given = [float(coordinate.min()), float(coordinate.max())]
            if len(given) < 2 or not np.isfinite(given).all() or not low <= min(given) < max(given) <= LARGEST:
                raise InputError(f"{name}: found {given}, expected (lowest, highest) in metres, up to {LARGEST:g}")
            ranges.append((min(given), max(given)))
        within = heights_within(ranges[0], ranges[1], reach, 2 * PLACE_SIZE)
        if within[0] >= within[1]:
            raise InputError(
                f"reach: found {reach:g} m, expected a larger one (plan.reach_m), or nearer places: those from "
                f"{ranges[0][0]:g} m at heights {ranges[1][0]:g} to {ranges[1][1]:g} m leave no room within it"
            )
        return cls(ranges[0], within, reach)

    def grid(self, count: int, apart: float = 0.0) -> FloatArray:
        """Places, `count` along each axis or as many as lie further than `apart` [m] from each other, shape (n, 2).

        Those between the ends of the range are rounded to `STEP`; the distances of a height end within reach.
        """
        rows = []
        for height in _axis(*self.heights, count, apart).tolist():
            farthest = float(farthest_within(self.distances, height, self.reach))
            distance = _axis(self.distances[0], farthest, count, apart)
            rows.append(np.column_stack([distance, np.full(distance.size, height)]))
        places = np.vstack(rows)
        return places[np.lexsort((places[:, 1], places[:, 0]))]

    def grid_with(self, measured: States | None, count: int) -> FloatArray:
        """Places of a grid, shape (n, 2), none closer than `NEAR` to another or to a measured one.

        A place of the grid that would be is the measured place itself, if that is within reach.
        """
        grid = self.grid(count, NEAR)
        if measured is None:
            return grid
        known = measured.places
        away = np.abs(grid[:, None] - known).max(axis=2)
        near = away.min(axis=1, keepdims=True) < NEAR
        places = np.unique(np.where(near, known[away.argmin(axis=1)], grid), axis=0)
        return np.asarray(places[np.hypot(places[:, 0], places[:, 1]) <= self.reach])

    def corners(self, states: FloatArray) -> Mask:
        """Which states lie at a corner of the range, or at a place that stands for it, shape (n,)."""
        away = np.abs(states[:, None, :2] - self.grid(2)).max(axis=2).min(axis=1)
        return np.asarray(away < NEAR)

    def apart(self, states: FloatArray, others: FloatArray) -> FloatArray:
        """Distances between the places of states, as shares of the range, shape (n, m); of a flat range, in metres."""
        size = np.array([self.distances[1] - self.distances[0], self.heights[1] - self.heights[0]])
        size[size == 0] = 1.0
        offsets = (states[:, None, :2] - others[None, :, :2]) / size
        return np.asarray(np.sqrt(np.square(offsets).sum(axis=-1)))


def _axis(low: float, high: float, count: int, apart: float) -> FloatArray:
    """Values from `low` to `high`, `count` or as many as lie further than `apart` from each other [m]."""
    fit = int((high - low) / (apart + STEP)) + 1 if apart else count
    axis = np.linspace(low, high, max(min(count, fit), 2)).round(DECIMALS)
    axis[[0, -1]] = low, high
    return axis


def at_speeds(places: FloatArray, speeds: FloatArray) -> FloatArray:
    """Every place, shape (k, 2), at every speed, shape (n, 3)."""
    return np.column_stack([np.repeat(places, speeds.size, axis=0), np.tile(speeds, len(places))])


def no_repeats(states: FloatArray, others: FloatArray, tolerance: StateTolerance) -> Mask:
    """Which states, shape (n, 3), are no repeats of others, shape (m, 3)."""
    apart = np.abs((states[:, None] - others[None]) / tolerance.scale).max(axis=2)
    return np.asarray(apart.min(axis=1, initial=np.inf) > 1)


def spread(apart: FloatArray, first: Iterable[int], count: int) -> list[int]:
    """The first numbers, then always the one farthest from all before it, by distances of shape (n, n)."""
    chosen = list(dict.fromkeys(first))
    while len(chosen) < min(count, len(apart)):
        away = apart[:, chosen].min(axis=1)
        if not away.max() > 0:
            break
        chosen.append(int(away.argmax()))
    return chosen
