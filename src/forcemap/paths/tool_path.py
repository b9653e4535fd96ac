"""A path of the contact point, straight between its points, in the frame of the base."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.errors import InputError
from forcemap.findings import Finding
from forcemap.speeds.zones import Segments

FASTEST = 10.0
"""Highest speed that a path may state [m/s]: a larger figure is in another unit."""

ONE_SEGMENT = "path"
"""Name of the one segment of a path that names none."""

MOST_PIECES = 1_000_000
"""Most pieces of a path; a choice: minutes, and some hundred megabytes."""

_FARTHEST = 10.0  # [m]; no arm reaches further, so a larger figure is in another unit
_STANDING = 1e-6  # [m]; points this close are one place


CORNER_ANGLE = 10.0
"""A path that turns by more than this comes to rest there [deg]; a choice (docs/decisions.md)."""


@dataclass(frozen=True, eq=False)
class ToolPath:
    """Points of the contact point; pieces run straight from each point to the next.

    Parameters
    ----------
    points : array, shape (n + 1, 3)
        Positions x, y, z in the frame of the base [m].
    names : tuple of str
        Name of the segment of the task that each piece belongs to, one for each of n pieces.
    time : array, shape (n + 1,) or None
        When the program arrives at each point [s]; None for an untimed path.
    source : str
        Where the path comes from.
    wait : array, shape (n + 1,) or None
        How long the program stands at each point of a timed path [s]; None if it stands nowhere.
    rows : array of int, shape (n,) or None
        Between which two rows of the program's times each piece lies; None if every piece has its own.
    deviation : float
        How far the driven path may lie beside these pieces [m]: a joint motion is cut into straight ones.
    turning : array, shape (n,) or None
        How far the motion may point away from each piece [deg] for the same reason; None if it never does.
    stated_speeds : array, shape (n,) or None
        Programmed speed that the path states for each piece [m/s], NaN where it states none; None if it states none
        anywhere. Not together with times.
    by_one : array of bool, shape (n,) or None
        True where just one end of the piece's motion states a speed: the task's counts there, too, for the robot may
        have that of the other end. None if it nowhere is so.
    end_name : str
        Segment that the file names at its last point, where no motion begins; empty if it names none there.
    speeds_of : str
        Which motion the speed stated at a point is of: "to_point", "from_point", or empty if the file does not say.
    unseen : array, shape (n + 1,) or None
        Longest time between two rows while the program stands at each point [s]: it may have moved and come back; None
        for an untimed path, or one that stands nowhere.
    doubts : tuple of Finding
        What its file leaves open, to be said first.
    logged : bool
        True for what a controller recorded of a run.
    of_flange : bool
        True for a path of joints whose contact point nobody has stated: then it is that of the flange.

    Raises
    ------
    InputError
        Fewer than two points, a point twice in a row, a figure that is not finite or not in metres, times that do not
        rise, or a speed that is not positive or faster than 10 m/s.
    """

    points: FloatArray
    names: tuple[str, ...]
    time: FloatArray | None = None
    source: str = ""
    wait: FloatArray | None = None
    rows: Indices | None = None
    deviation: float = 0.0
    turning: FloatArray | None = None
    stated_speeds: FloatArray | None = None
    by_one: Mask | None = None
    end_name: str = ""
    speeds_of: str = ""
    unseen: FloatArray | None = None
    doubts: tuple[Finding, ...] = ()
    logged: bool = False
    of_flange: bool = False

    def __post_init__(self) -> None:
        if self.points.ndim != 2 or self.points.shape[1] != 3 or len(self.points) < 2:
            raise InputError("path: expected at least two points of three coordinates")
        if not np.isfinite(self.points).all():
            raise InputError("path: found a position that is not a finite number, expected metres")
        if np.abs(self.points).max() > _FARTHEST:
            raise InputError(
                f"path: found a coordinate of {np.abs(self.points).max():g} m, expected at most {_FARTHEST:g} m; "
                "positions are in metres, not millimetres"
            )
        if np.any(self.lengths < _STANDING):
            i = int(np.argmax(self.lengths < _STANDING))
            raise InputError(
                f"path: points {i + 1} and {i + 2} are the same place; a piece without length has no speed: take one "
                "out, or state the times, with which it is a wait"
            )
        if len(self.names) != len(self.points) - 1:
            raise InputError("path: expected one segment name for each piece")
        turning = np.zeros(1) if self.turning is None else np.asarray(self.turning)
        if not (0 <= self.deviation < np.inf and np.isfinite(turning).all() and np.all(turning >= 0)):
            raise InputError("path: expected a deviation and turnings that are finite and not below 0")
        moving = self._moving_times
        if moving is not None and not (np.isfinite(moving).all() and np.all(moving > 0)):
            raise InputError("path: expected times that are finite and rise from point to point")
        if self.stated_speeds is not None:
            self._require_speeds(self.stated_speeds)

    def _require_speeds(self, speeds: FloatArray) -> None:
        if self.time is not None:
            raise InputError("path: found times and speeds, expected one of them")
        if speeds.shape != (len(self),) or not np.all(np.isnan(speeds) | ((speeds > 0) & (speeds <= FASTEST))):
            raise InputError(
                f"path: expected one speed for each piece, positive and at most {FASTEST:g} m/s, or NaN where none is "
                "stated"
            )

    @classmethod
    def timed(
        cls,
        points: FloatArray,
        names: tuple[str, ...],
        time: FloatArray,
        source: str = "",
        rows: Indices | None = None,
        *,
        standing: float = _STANDING,
    ) -> Self:
        """A path from time-stamped points, one name and row each; points at which the program stands, within `standing`
        [m] of the first, become waits."""
        if len(points) < 2 or not (np.isfinite(points).all() and np.isfinite(time).all() and np.all(np.diff(time) > 0)):
            raise InputError("path: expected at least two finite points, and times that are finite and rise")
        arrival, departure = [0], [0]  # the rows at which the program reaches and leaves each point
        unseen = [0.0]
        for row in range(1, len(points)):
            if np.linalg.norm(points[row] - points[arrival[-1]]) < standing:
                departure[-1] = row
                unseen[-1] = max(unseen[-1], float(time[row] - time[row - 1]))
            else:
                arrival.append(row)
                departure.append(row)
                unseen.append(0.0)
        if len(arrival) < 2:
            raise InputError("path: the contact point does not move, expected at least two points")
        wait, start = time[departure] - time[arrival], departure[:-1]
        return cls(
            points[arrival],
            tuple(names[row] for row in start),
            time[arrival],
            source,
            wait if wait.any() else None,
            None if rows is None else rows[start],
            unseen=np.array(unseen) if any(unseen) else None,
        )

    @classmethod
    def through(cls, points: ArrayLike, *, name: str = ONE_SEGMENT, time: ArrayLike | None = None) -> Self:
        """A path through points, shape (n + 1, 3) [m], all of one segment."""
        array = np.asarray(points, dtype=np.float64)
        times = None if time is None else np.asarray(time, dtype=np.float64)
        return cls(array, (name,) * (len(array) - 1), times)

    def __len__(self) -> int:
        return len(self.points) - 1

    @property
    def lengths(self) -> FloatArray:
        """Length of each piece [m], shape (n,)."""
        return np.asarray(np.linalg.norm(np.diff(self.points, axis=0), axis=1))

    @property
    def directions(self) -> FloatArray:
        """Unit vector of motion on each piece, shape (n, 3)."""
        return np.asarray(np.diff(self.points, axis=0) / self.lengths[:, None])

    @property
    def turns(self) -> FloatArray:
        """Angle by which the motion turns at each point but the first and the last [deg], shape (n - 1,)."""
        before, after = self.directions[:-1], self.directions[1:]
        apart, along = np.linalg.norm(before - after, axis=1), np.linalg.norm(before + after, axis=1)
        return np.asarray(np.degrees(2 * np.arctan2(apart, along)))

    def angles_from(self, direction: FloatArray, *, beside: float = 0.0) -> FloatArray:
        """How far the motion may point away from a direction on each piece [deg], shape (n,).

        The direction is that of `direction_vector`, a unit vector in the cylinder around the base. Outwards and
        sideways turn with the place: along a piece steadily, so the angle is largest at one of its ends, unless the
        piece comes to move against them in between. `beside` is how far beside the path the robot may be [m].
        """
        along = self.directions
        level = float(np.hypot(direction[0], direction[1]))
        towards = np.broadcast_to(direction, along.shape)
        if level > 0:  # a direction with a part that turns with the place
            azimuth = np.arctan2(self.points[:, 1], self.points[:, 0]) + np.arctan2(direction[1], direction[0])
            heading = np.arctan2(along[:, 1], along[:, 0])
            turned = _half_turn(azimuth[:-1] - heading)
            ends = np.stack([turned, turned + _half_turn(np.diff(azimuth))])
            near = self.pieces.probes[0].min(axis=1)
            shifted = np.arcsin(np.divide(beside, near, out=np.zeros_like(near), where=near > beside))
            farthest = np.abs(ends).max(axis=0) + shifted
            farthest[(farthest > np.pi) | (near <= beside) | (near == 0)] = np.pi
            x, y = level * np.cos(heading + farthest), level * np.sin(heading + farthest)
            towards = np.stack([x, y, np.full_like(x, direction[2])], axis=1)
        with_it = np.einsum("ij,ij->i", along, towards)
        across = np.linalg.norm(along - with_it[:, None] * towards, axis=1)
        return np.asarray(np.degrees(np.arctan2(across, with_it)) + (0.0 if self.turning is None else self.turning))

    @property
    def pieces(self) -> Segments:
        """The pieces as segments."""
        return Segments(self.points[:-1], self.points[1:])

    @property
    def speeds(self) -> FloatArray | None:
        """Mean speed that the times give on each piece [m/s], shape (n,); None for an untimed path."""
        moving = self._moving_times
        return None if moving is None else np.asarray(self.lengths / moving)

    def fastest_speeds(self, acceleration: float) -> FloatArray | None:
        """Highest speed [m/s] that the times allow for on each piece, shape (n,); None for an untimed path.

        Between two rows only the mean v = s / T is known. Within an acceleration a along the path the speed rises to at
        most v + a T / 2, from rest to sqrt(2 a s); a is at least what the means of neighbouring rows imply.
        """
        moving = self._moving_times
        if moving is None:
            return None
        row, mean, _, gained = self._between_rows(moving, acceleration)
        fastest = np.where(mean > gained / 2, mean + gained / 2, np.sqrt(2 * gained * mean))
        return np.asarray(np.maximum(fastest[row], self.lengths / moving))

    def beside_turns(self, acceleration: float, counts: Mask) -> tuple[float, float]:
        """How far beside the straight lines between rows a motion may have turned [m], and the time between these [s].

        Within an acceleration a a motion stays within a T^2 / 8 of the line between two rows T apart, as the error of
        linear interpolation does. It matters where the motion turns by more than `CORNER_ANGLE`, or another segment
        begins, and wherever it stands, beside a piece that `counts`, shape (n,); 0 where there is none, and for an
        untimed path.
        """
        moving = self._moving_times
        if moving is None:
            return 0.0, 0.0
        row, _, time, gained = self._between_rows(moving, acceleration)
        along = np.einsum("ij,ij->i", self.directions[:-1], self.directions[1:])
        named = np.array([one != other for one, other in pairwise(self.names)])
        turns = (row[:-1] != row[1:]) & (counts[:-1] | counts[1:])
        turns &= named | (along < math.cos(math.radians(CORNER_ANGLE)))
        rows = np.unique(np.concatenate([row[:-1][turns], row[1:][turns]]))
        at = np.append(counts, False) | np.append(False, counts)
        stood = np.zeros(1) if self.unseen is None else np.append(0.0, self.unseen[at])
        apart = np.concatenate([time[rows], stood])
        beside = np.concatenate([(gained * time)[rows], acceleration * stood**2]) / 8
        return float(beside.max()), float(apart[beside.argmax()])

    def _between_rows(
        self, moving: FloatArray, acceleration: float
    ) -> tuple[Indices, FloatArray, FloatArray, FloatArray]:
        """The row of each piece; of each row mean speed [m/s], time to the next one [s], and gain of speed in it [m/s].

        The gain is that of an acceleration at least as large as the means of neighbouring rows imply, and as all of the
        path shows (`shown_acceleration`).
        """
        row, mean, time = self._rows(moving)
        implied = np.concatenate([[0.0], np.abs(_accelerations(mean, time)), [0.0]])
        least = max(acceleration, _sustained(mean, time))
        return row, mean, time, np.maximum(least, np.maximum(implied[1:], implied[:-1])) * time

    @property
    def shown_acceleration(self) -> float:
        """Largest acceleration along the path that three rows in succession show [m/s^2]; 0 where none do.

        Two rows may show a larger one by chance: of a corner, of a row that is a little late.
        """
        moving = self._moving_times
        if moving is None:
            return 0.0
        _, mean, time = self._rows(moving)
        return _sustained(mean, time)

    def _rows(self, moving: FloatArray) -> tuple[Indices, FloatArray, FloatArray]:
        """The row of each piece; of each row mean speed [m/s], and time to the next one [s]."""
        row = np.arange(len(self)) if self.rows is None else np.unique(self.rows, return_inverse=True)[1]
        length, time = (np.asarray(np.bincount(row, each), dtype=np.float64) for each in (self.lengths, moving))
        return row, length / time, time

    @property
    def _moving_times(self) -> FloatArray | None:
        """How long the program moves along each piece [s], shape (n,); None for an untimed path."""
        return None if self.time is None or self.begins is None else np.asarray(self.time[1:] - self.begins)

    @property
    def begins(self) -> FloatArray | None:
        """When the motion of each piece begins [s], shape (n,); None for an untimed path."""
        return None if self.time is None else self.time[:-1] + (0.0 if self.wait is None else self.wait[:-1])

    def resampled(self, step: float) -> ToolPath:
        """The same path in pieces not longer than `step` [m] along the arc; every point of the path is kept.

        Raises
        ------
        InputError
            A step that is not positive and finite, or that makes more than a million pieces.
        """
        if not 0 < step < np.inf:
            raise InputError(f"step: found {step:g} m, expected a positive finite number")
        counts = np.maximum(1, np.ceil(self.lengths / step - 1e-9))
        if counts.sum() > MOST_PIECES:
            raise InputError(f"step: found {step:g} m, expected one that makes at most a million pieces")
        piece = np.repeat(np.arange(len(self)), counts.astype(np.int64))
        first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        share = ((np.arange(piece.size) - first[piece]) / counts[piece])[:, None]
        points = np.vstack([self.points[piece] * (1 - share) + self.points[piece + 1] * share, self.points[-1:]])
        time, wait, rows, unseen = None, None, None, None
        if self.time is not None and self.begins is not None:
            inner = self.begins[piece] * (1 - share[:, 0]) + self.time[piece + 1] * share[:, 0]
            whole = share[:, 0] == 0
            inner[whole] = self.time[piece[whole]]
            time = np.append(inner, self.time[-1])
            rows = piece if self.rows is None else self.rows[piece]
            if self.wait is not None:
                wait = np.append(np.where(whole, self.wait[piece], 0.0), self.wait[-1])
            if self.unseen is not None:
                unseen = np.append(np.where(whole, self.unseen[piece], 0.0), self.unseen[-1])
        names = tuple(self.names[i] for i in piece)
        turning = None if self.turning is None else self.turning[piece]
        stated = None if self.stated_speeds is None else self.stated_speeds[piece]
        by_one = None if self.by_one is None else self.by_one[piece]
        cut: dict[str, Any] = {"turning": turning, "stated_speeds": stated, "by_one": by_one, "unseen": unseen}
        return replace(self, points=points, names=names, time=time, wait=wait, rows=rows, **cut)

    def moved(self, offset: ArrayLike) -> ToolPath:
        """The path shifted by an offset, shape (3,) [m]."""
        return replace(self, points=self.points + np.asarray(offset, dtype=np.float64))


def _half_turn(angle: FloatArray) -> FloatArray:
    """Angles [rad] from minus to plus half a turn."""
    return np.asarray(np.arctan2(np.sin(angle), np.cos(angle)))


def _accelerations(mean: FloatArray, time: FloatArray) -> FloatArray:
    """Acceleration from each row to the next [m/s^2], of n mean speeds [m/s] over times [s], shape (n - 1,)."""
    return np.asarray(2 * np.diff(mean) / (time[1:] + time[:-1]))


def _sustained(mean: FloatArray, time: FloatArray) -> float:
    """The largest acceleration that lasts from one pair of rows to the next [m/s^2]; 0 where none does."""
    found = _accelerations(mean, time)
    lasting = np.where(found[1:] * found[:-1] > 0, np.minimum(np.abs(found[1:]), np.abs(found[:-1])), 0.0)
    return float(lasting.max(initial=0.0))
