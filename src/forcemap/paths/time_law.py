"""How long a path takes under speed limits and a limit of acceleration along it (forward and backward pass)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.errors import InputError


@dataclass(frozen=True, eq=False)
class TimeLaw:
    """The fastest motion along pieces within their speed limits and an acceleration, from rest to rest.

    Parameters
    ----------
    length : array, shape (n,)
        Length of each piece [m].
    start_speed, top_speed, end_speed : array, shape (n,)
        Speed at the start, at its highest and at the end of each piece [m/s].
    acceleration : float
        Largest acceleration and deceleration along the path [m/s^2].
    """

    length: FloatArray
    start_speed: FloatArray
    top_speed: FloatArray
    end_speed: FloatArray
    acceleration: float

    @property
    def durations(self) -> FloatArray:
        """Time of each piece: accelerate, keep the top speed, decelerate [s], shape (n,)."""
        a, top = self.acceleration, self.top_speed
        ramps = (2 * top**2 - self.start_speed**2 - self.end_speed**2) / (2 * a)
        return np.asarray(
            (top - self.start_speed + top - self.end_speed) / a + np.maximum(self.length - ramps, 0) / top
        )

    @property
    def duration(self) -> float:
        """Time of the whole motion [s]."""
        return float(self.durations.sum())


def braking_speeds(length: ArrayLike, limit: ArrayLike, *, acceleration: float) -> FloatArray:
    """Speed [m/s] to command on each piece so that no piece is entered or driven faster than its limit, shape (n,).

    For a robot that starts to change its speed at the start of each piece: the command does not exceed the limit of the
    next piece, and a piece is entered no faster than the robot can brake on it.

    Parameters
    ----------
    length : array, shape (n,)
        Length of each piece [m].
    limit : array, shape (n,)
        Highest speed on each piece [m/s]; 0 where there is none.
    acceleration : float
        Deceleration that the robot reaches at least [m/s^2].

    Examples
    --------
    >>> braking_speeds([0.1, 0.1], [0.5, 0.3], acceleration=1.0)
    array([0.3, 0.3])
    """
    s, cap = np.asarray(length, dtype=np.float64), np.asarray(limit, dtype=np.float64)
    speed = np.empty_like(cap)
    entry = np.inf  # highest speed at which the next piece may be entered
    for i in range(s.size - 1, -1, -1):
        speed[i] = min(cap[i], entry)
        entry = min(cap[i], float(np.sqrt(entry**2 + 2 * acceleration * s[i])))
    return speed


def time_law(length: ArrayLike, limit: ArrayLike, *, acceleration: float, stops: ArrayLike | None = None) -> TimeLaw:
    """The fastest motion from rest to rest along pieces with a speed limit each.

    Parameters
    ----------
    length : array, shape (n,)
        Length of each piece [m].
    limit : array, shape (n,)
        Highest speed on each piece [m/s].
    acceleration : float
        Largest acceleration and deceleration along the path [m/s^2].
    stops : array of bool, shape (n - 1,), optional
        Where between two pieces the robot comes to rest, because the path has a corner.

    Returns
    -------
    TimeLaw

    Raises
    ------
    InputError
        A length, limit or acceleration that is not positive and finite.

    Examples
    --------
    >>> round(time_law([1.0], [0.5], acceleration=1.0).duration, 6)
    2.5
    """
    s, cap = np.asarray(length, dtype=np.float64), np.asarray(limit, dtype=np.float64)
    if s.ndim != 1 or s.shape != cap.shape or not s.size:
        raise InputError("time law: expected lengths and speed limits of one shape (n,)")
    for name, values in (("length", s), ("speed limit", cap), ("acceleration", np.asarray(acceleration))):
        if not np.all((values > 0) & (values < np.inf)):
            raise InputError(f"{name}: found a value that is not positive and finite")
    node = np.concatenate([[0.0], np.minimum(cap[:-1], cap[1:]), [0.0]])
    if stops is not None:
        node[1:-1] = np.where(np.asarray(stops, dtype=np.bool_), 0.0, node[1:-1])
    reach = (2 * acceleration * s).tolist()
    squares = np.square(node).tolist()
    for i, gained in enumerate(reach):
        squares[i + 1] = min(squares[i + 1], squares[i] + gained)
    for i in range(s.size - 1, -1, -1):
        squares[i] = min(squares[i], squares[i + 1] + reach[i])
    square = np.array(squares)
    peak = np.sqrt((square[:-1] + square[1:]) / 2 + acceleration * s)
    return TimeLaw(s, np.sqrt(square[:-1]), np.minimum(cap, peak), np.sqrt(square[1:]), float(acceleration))
