"""States: combinations of distance, height and speed; repeats of a state share it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask, Texts
from forcemap.campaigns.columns import Where
from forcemap.errors import InputError, few

PLACE_SIZE = 0.02
"""States that lie no further apart in distance and in height share a place and its effect [m] (docs/decisions.md)."""
PLACE_TOLERANCE = 0.005
"""Repeats of a state may lie this far apart in distance and in height, unless stated otherwise [m]."""
SPEED_TOLERANCE = 0.010
"""Repeats of a state may lie this far apart in speed, unless stated otherwise [m/s]."""

CONFIRMING = "c-"
"""How the names of states begin that are to confirm a map; they have role test."""

_FEW = 500  # points of which every pair is looked at; of more, a tree finds those that are near

_AXES = (("distance_m", "m"), ("height_m", "m"), ("speed_mps", "m/s"))


@dataclass(frozen=True)
class StateTolerance:
    """How far apart repeats of one state may lie: place [m] (distance and height) and speed [m/s]."""

    place: float = PLACE_TOLERANCE
    speed: float = SPEED_TOLERANCE

    def __post_init__(self) -> None:
        if not (0 < self.place < np.inf and 0 < self.speed < np.inf):
            raise InputError(f"state tolerance: found {self.place:g} m and {self.speed:g} m/s, expected positive")
        if self.place > PLACE_SIZE:  # repeats of a state would count as several places
            raise InputError(
                f"state tolerance: found {self.place:g} m, expected at most {PLACE_SIZE:g} m, a place's size"
            )

    @classmethod
    def stated(cls, place: float, speed: float) -> StateTolerance:
        """The tolerance [m], [m/s]; the default where a figure is NaN."""
        usual = cls()
        return cls(usual.place if np.isnan(place) else place, usual.speed if np.isnan(speed) else speed)

    def __str__(self) -> str:
        return f"{1000 * self.place:g} mm and {1000 * self.speed:g} mm/s"

    @property
    def scale(self) -> FloatArray:
        """The tolerance of (distance, height, speed), widened by rounding so that an equal difference is within it."""
        return np.array([self.place, self.place, self.speed]) * (1 + 1e-9)


@dataclass(frozen=True, eq=False)
class States:
    """The states of a dataset, ordered by distance, height and speed; arrays of shape (m,).

    Parameters
    ----------
    name : tuple of str
        Names of the states.
    distance, height, speed : array
        Means over the repeats [m], [m], [m/s].
    force : array
        Mean peak force of the uncensored repeats [N]; NaN where all are censored.
    log_force : array
        Mean of ln F of the uncensored repeats; NaN where all are censored.
    impacts, censored : array of int
        Number of uncensored and of censored repeats.
    at_least : array
        Largest lower bound of the censored repeats [N]; NaN where none is censored.
    highest : array
        Largest force of the uncensored repeats [N]; NaN where all are censored.
    slowest : array
        Lowest speed of the repeats [m/s]: any of them may have that force, or more than `at_least`, at it.
    """

    name: tuple[str, ...]
    distance: FloatArray
    height: FloatArray
    speed: FloatArray
    force: FloatArray
    log_force: FloatArray
    impacts: Indices
    censored: Indices
    at_least: FloatArray
    highest: FloatArray
    slowest: FloatArray

    @classmethod
    def of(cls, coordinates: FloatArray, peak_force: FloatArray, name: Texts, censored: Mask) -> States:
        """Average impacts over their states: (distance, height, speed), shape (n, 3), and arrays of shape (n,).

        The order of the impacts does not matter.
        """
        order = np.lexsort((*coordinates.T[::-1], peak_force, name))
        names, index = np.unique(name[order], return_inverse=True)
        n, measured, force = names.size, ~censored[order], peak_force[order]
        distance, height, speed = (_means(axis[order], index, n) for axis in coordinates.T)
        slowest = -_largest(-coordinates[order, 2], index, n)
        force, above, index, group = force[measured], force[~measured], index[measured], index[~measured]
        states = cls(
            tuple(names.tolist()),
            distance,
            height,
            speed,
            force=_means(force, index, n),
            log_force=_means(np.log(force), index, n),
            impacts=np.bincount(index, minlength=n),
            censored=np.bincount(group, minlength=n),
            at_least=_largest(above, group, n),
            highest=_largest(force, index, n),
            slowest=slowest,
        )
        return states.select(np.lexsort((states.speed, states.height, states.distance)))

    @classmethod
    def single(cls, name: Iterable[str], coordinates: FloatArray, force: FloatArray) -> States:
        """Impacts, none of them censored, each a state of its own; coordinates as in `of`."""
        n, unknown = len(force), np.full(len(force), np.nan)
        once, none = np.ones(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
        distance, height, speed = coordinates.reshape(n, 3).T
        return cls(tuple(name), distance, height, speed, force, np.log(force), once, none, unknown, force, speed)

    def and_(self, other: States) -> States:
        """These states, then the others."""
        _, *arrays = self.__dataclass_fields__
        both: dict[str, Any] = {
            name: np.concatenate([getattr(each, name) for each in (self, other)]) for name in arrays
        }
        return States(self.name + other.name, **both)

    def __len__(self) -> int:
        return len(self.name)

    def select(self, index: Mask | Indices) -> States:
        """The states picked by an index or a mask of shape (m,)."""
        rows = np.flatnonzero(index) if index.dtype == np.bool_ else index
        _, *arrays = self.__dataclass_fields__
        picked: dict[str, Any] = {name: getattr(self, name)[rows] for name in arrays}
        return States(tuple(self.name[i] for i in rows), **picked)

    @property
    def coordinates(self) -> FloatArray:
        """(distance, height, speed) of every state, shape (m, 3)."""
        return np.column_stack([self.distance, self.height, self.speed])

    @cached_property
    def place(self) -> Indices:
        """Number of the place of every state, shape (m,); places within PLACE_SIZE of each other are one."""
        return places(self.distance, self.height)

    @property
    def places(self) -> FloatArray:
        """(distance, height) of the places, the means of their states, shape (k, 2)."""
        coordinates = self.coordinates[:, :2]
        return np.array([coordinates[self.place == number].mean(axis=0) for number in range(self.place.max() + 1)])

    def repeats_of(self, others: States, tolerance: StateTolerance) -> Mask:
        """Which states, shape (m,), are repeats of others: by their name, or as close as repeats."""
        if not len(others):
            return np.zeros(len(self), dtype=np.bool_)
        mine, theirs = (states.coordinates / tolerance.scale for states in (self, others))
        return np.asarray((_nearest(mine, theirs)[0] <= 1.0) | np.isin(self.name, others.name))

    def measured_first(self, others: States, tolerance: StateTolerance) -> dict[str, str]:
        """Which of others each state repeats: the nearest one that is as close as repeats; others by name left out.

        States that were to confirm a map are left out, too: they are known by their names.
        """
        if not len(others):
            return {}
        away, number = _nearest(*(states.coordinates / tolerance.scale for states in (self, others)))
        known = np.isin(self.name, others.name) | self.confirms
        return {self.name[i]: others.name[number[i]] for i in np.flatnonzero(~known & (away <= 1.0))}

    def at_places_of(self, others: States) -> Mask:
        """Which states, shape (m,), lie within PLACE_SIZE of a place of others."""
        away = np.abs(self.coordinates[:, None, :2] - others.coordinates[:, :2]).max(axis=2)
        return np.asarray((away <= PLACE_SIZE).any(axis=1))

    @property
    def confirms(self) -> Mask:
        """Which states were measured to confirm a map, shape (m,)."""
        return np.array([name.startswith(CONFIRMING) for name in self.name], dtype=np.bool_)

    @property
    def uncensored(self) -> States:
        """The states with at least one uncensored repeat."""
        return self.select(self.impacts > 0)


def identify_states(
    coordinates: FloatArray, role: Texts, given: Texts | None, tolerance: StateTolerance, where: Where
) -> Texts:
    """The state of every impact: as named, with states as close as repeats joined; without names, by coordinates.

    Parameters
    ----------
    coordinates : array
        (distance, height, speed) of the impacts, shape (n, 3) [m, m, m/s].
    role, given : array of str
        Role and, if the table has them, names of states, shape (n,).
    tolerance : StateTolerance
        How far repeats of a state may lie apart.
    where : Where
        Makes the errors.

    Raises
    ------
    TableError
        Repeats of a state, or states that follow each other within the tolerance, spread further than it.
    """
    if given is None:
        index = clusters(coordinates / tolerance.scale)
        names = np.array([f"S{number + 1}" for number in range(index.max() + 1)])
    else:
        names, index = np.unique(given, return_inverse=True)
    found = None if given is not None else np.array([""] * len(index))
    _refuse_wide_states(coordinates, index, names, tolerance, where, chained=found)
    if given is not None:
        names, index = np.unique(_joined(coordinates, role, index, names, tolerance), return_inverse=True)
        _refuse_wide_states(coordinates, index, names, tolerance, where, chained=given)
    return names[index]


def places(distance: FloatArray, height: FloatArray, size: float = PLACE_SIZE) -> Indices:
    """Number of the place of points [m], shape (n,); those within `size` [m] of each other are one."""
    return clusters(np.column_stack([distance, height]) / (size * (1 + 1e-9)))


def clusters(scaled: FloatArray) -> Indices:
    """Number of the cluster of every point; points within 1 of each other in every coordinate are linked.

    Numbered by the sorted points, so that the order of rows does not matter.
    """
    points, index = np.unique(scaled, axis=0, return_inverse=True)
    first, second = _near(points).T
    cluster = np.arange(len(points))
    while (cluster[first] != cluster[second]).any():
        lowest = np.minimum(cluster[first], cluster[second])  # number of the points linked so far
        np.minimum.at(cluster, first, lowest)
        np.minimum.at(cluster, second, lowest)
        cluster = cluster[cluster]
    return np.asarray(np.unique(cluster, return_inverse=True)[1][index.ravel()], dtype=np.int64)


def _near(points: FloatArray) -> Indices:
    """Pairs of points within 1 of each other in every coordinate, shape (k, 2)."""
    if len(points) <= _FEW:
        apart = np.abs(points[:, None] - points).max(axis=2, initial=0.0)
        return np.argwhere(np.triu(apart <= 1.0, 1))
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(points).query_pairs(1.0, p=np.inf, output_type="ndarray"))


def _nearest(points: FloatArray, others: FloatArray) -> tuple[FloatArray, Indices]:
    """How far the nearest of others is from each point, by the coordinate that differs most, and its number, (n,)."""
    if len(points) * len(others) <= _FEW**2:
        apart = np.abs(points[:, None] - others).max(axis=2)
        return apart.min(axis=1), apart.argmin(axis=1)
    from scipy.spatial import cKDTree

    away, number = cKDTree(others).query(points, p=np.inf)
    return np.asarray(away), np.asarray(number)


def _refuse_wide_states(
    coordinates: FloatArray,
    index: Indices,
    names: Texts,
    tolerance: StateTolerance,
    where: Where,
    *,
    chained: Texts | None,
) -> None:
    """Refuse repeats of a state that lie too far apart; `chained` are the names of rows that are states by where they
    lie, empty where they have none."""
    n = names.size
    spread = np.column_stack(
        [_largest(axis_values, index, n) + _largest(-axis_values, index, n) for axis_values in coordinates.T]
    )
    for state, axis in np.argwhere(spread > tolerance.scale)[:1]:
        (column, unit), allowed = _AXES[axis], (tolerance.place, tolerance.place, tolerance.speed)[axis]
        member = np.flatnonzero(index == state)
        away = np.abs(coordinates[member, axis] - np.median(coordinates[member, axis]))
        position = int(member[::-1][away[::-1].argmax()])
        apart = f"{spread[state, axis]:.4g} {unit} apart, expected at most {allowed:g} {unit}"
        found, remedy = "repeats of one state", f"is this row of state {str(names[state])!r}?"
        if chained is not None:
            way_out = "lower the tolerance ([states] in campaign.toml, StateTolerance(place, speed) in Python)"
            if named := sorted({*filter(None, chained[member].tolist())}):
                found = f"the states {few(named)}, each as close to the next as repeats are,"
            else:
                way_out += "; names (state_id, state= in Python) tell apart only what lies farther apart than that"
            remedy = f"impacts or states that lie closer than this form a chain: {way_out}"
        raise where.error(position, column, f"found {found} {apart}; {remedy}")


def _joined(coordinates: FloatArray, role: Texts, index: Indices, names: Texts, tolerance: StateTolerance) -> Texts:
    """Names of states; those of one role within the tolerance of each other share the name that comes first.

    Repeats named one by one would count as independent states and make the bound too low. States that were to confirm
    a map are known by their names, and no others are: they share names among themselves alone.
    """
    joined = names[index]
    confirming = (role == "test") & np.char.startswith(joined, CONFIRMING)
    for kind in (role == "train", confirming, (role == "test") & ~confirming):
        rows = np.flatnonzero(kind)
        if not rows.size:
            continue
        member, number = np.unique(index[rows], return_inverse=True)
        means = [_means(axis[rows], number, member.size) for axis in coordinates.T]
        state = clusters(np.column_stack(means) / tolerance.scale)[number]
        joined[rows] = joined[rows[np.unique(state, return_index=True)[1]]][state]
    return joined


def _largest(values: FloatArray, index: Indices, size: int) -> FloatArray:
    """Largest value by group, NaN for an empty one."""
    largest = np.full(size, -np.inf)
    np.maximum.at(largest, index, values)
    return np.where(np.isinf(largest), np.nan, largest)


def _means(values: FloatArray, index: Indices, size: int) -> FloatArray:
    """Means by group, NaN for an empty one; equal values give exactly that value."""
    lowest = np.full(size, np.inf)
    np.minimum.at(lowest, index, values)
    count = np.bincount(index, minlength=size)
    excess = np.bincount(index, weights=values - lowest[index], minlength=size)
    lowest[count == 0] = np.nan
    return lowest + excess / np.maximum(count, 1)
