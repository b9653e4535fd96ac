"""Where to put the table: the cycle time of a task for every position of its table in the measured range."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.limits.body_areas import LimitTable
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.paths.atlas import Atlas
from forcemap.paths.path_speeds import LONGEST_PIECE, PathSpeeds, PieceOutcome, path_speeds_at
from forcemap.paths.task import Task
from forcemap.paths.tool_path import ToolPath
from forcemap.speeds.allowance import Allowance
from forcemap.speeds.basis import Basis

POSITION_STEP = 0.05
"""Distance between positions of the table, unless stated [m]; a choice."""

FINEST_STEP = 0.005
"""Closest positions that are looked at without being asked for [m]; a choice: the position tolerance."""

_MOST_POSITIONS = 20_000  # a choice: minutes to hours
_STEPS_AROUND = 5  # of `around`; as many as make a step of the grid before, which is five times as wide
_PIECES_AT_ONCE = 1000  # of the path at several positions; a choice: progress is seen about every half second
_AS_FAST = 5e-4  # [s]; half of the last digit of a cycle time
_ROUNDING = 1e-9  # of a step; a multiple this close beyond the range belongs to it
_DIGITS = 9  # of a share, and of a length [m]: what rounding leaves of equal ones
_POSITIONS_TELL = 5  # with a piece in the measured range and without a speed, until another hardly helps; a choice
_FAR = 0.4  # [m] of the path from its origin, as of a base that the robot does not reach into; a choice
_DECIMALS = 12  # of a position [m], so that multiples of a step read as they are stated


@dataclass(frozen=True, eq=False)
class TaskPlaces:
    """Cycle times of a task over positions of its table.

    Parameters
    ----------
    distance, height : array, shapes (n,), (m,)
        Distance of the table's frame from the base z-axis and its height above the base [m].
    duration : array, shape (n, m)
        Cycle time at the allowed speeds [s]; NaN where any piece of the path has no permission.
    standard_duration : array, shape (n, m)
        Cycle time at the standard's one speed at the same positions [s]; NaN for the same reason.
    permitted : array, shape (n, m)
        Share of the path's length that has permission.
    lowest : array, shape (n, m)
        Lowest allowed speed on the path [m/s], where contact is possible; NaN where there is none.
    best_speeds : PathSpeeds or None
        Speeds of the path at the best position; None if no position is permitted as a whole.
    most_permitted : tuple of float
        (distance, height, share of the path) of the position with the largest permitted share [m, m, 1]; of several
        the one where the path leaves the measured range least.
    closest_speeds : PathSpeeds
        Speeds of the path at that position; they say why the rest is refused.
    bases : tuple of Basis
        What the cycle times rest on.
    notes : tuple of Finding
        What else they depend on.
    without : tuple of str
        Segments with a piece that has a speed at no position, though it lies in the measured range at several: another
        position hardly helps.
    """

    distance: FloatArray
    height: FloatArray
    duration: FloatArray
    standard_duration: FloatArray
    permitted: FloatArray
    lowest: FloatArray
    best_speeds: PathSpeeds | None
    most_permitted: tuple[float, float, float]
    closest_speeds: PathSpeeds
    bases: tuple[Basis, ...]
    notes: tuple[Finding, ...]
    without: tuple[str, ...] = ()

    @property
    def best(self) -> tuple[float, float, float] | None:
        """(distance, height, cycle time) of the best position [m, m, s]; None if none is permitted as a whole."""
        if np.isnan(self.duration).all():
            return None
        i, j = _best(self.duration, self.lowest)
        return float(self.distance[i]), float(self.height[j]), float(self.duration[i, j])

    @property
    def as_fast(self) -> int:
        """Number of positions that are as fast as the best one, to the digits of a cycle time."""
        return 0 if np.isnan(self.duration).all() else int(_as_fast(self.duration).sum())

    def finer_step(self, step: float) -> float | None:
        """A fifth of a step [m], where no position is permitted as a whole and closer ones may be; else None."""
        closest, finer = self.closest_speeds, max(step / _STEPS_AROUND, FINEST_STEP)
        near = np.isin(closest.outcome[closest.refused], (PieceOutcome.OUTSIDE, PieceOutcome.UNCONFIRMED)).all()
        return finer if self.best is None and near and self.most_permitted[2] > 0 and finer < step else None

    @property
    def sensitivity(self) -> list[tuple[float, float, float]]:
        """(shift in distance, shift in height, change of cycle time) of the best position's neighbours [m, m, s].

        NaN where the neighbour is not permitted as a whole.
        """
        if self.best is None:
            return []
        i, j = _best(self.duration, self.lowest)
        d, h, time = self.distance - self.distance[i], self.height - self.height[j], self.duration - self.duration[i, j]
        around = ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1))
        inside = [(a, b) for a, b in around if 0 <= a < d.size and 0 <= b < h.size]
        return [(float(d[a]), float(h[b]), float(time[a, b])) for a, b in inside]


def _as_fast(duration: FloatArray) -> Mask:
    return np.asarray(duration <= np.nanmin(duration) + _AS_FAST)


def _best(duration: FloatArray, lowest: FloatArray) -> tuple[int, int]:
    """Where the fastest position stands in the grid; of several, the one that allows the highest speed throughout."""
    speed = np.where(_as_fast(duration), np.nan_to_num(lowest), -1.0)
    i, j = np.unravel_index(int(speed.argmax()), speed.shape)
    return int(i), int(j)


def place_task(
    maps: ForceMap | Atlas,
    path: ToolPath,
    task: Task,
    *,
    bound: Bound,
    step: float = POSITION_STEP,
    allowance: Allowance | None = None,
    table: LimitTable | None = None,
    around: tuple[float, float] | None = None,
    progress: Callable[[int], None] | None = None,
) -> TaskPlaces:
    """Cycle times of a task over positions of the table it is done on.

    The path is given in the frame of the table: x away from the base, y across, z up. The frame is put in front of the
    base at every multiple of `step` at which the path comes into the box around the measured range.

    Parameters
    ----------
    maps : ForceMap or Atlas
        The map, or several of one robot.
    path : ToolPath
        The path in the frame of the table.
    task : Task
        Body areas and contact of each segment.
    bound : Bound
        `FixedMargin` or `ToleranceBound`.
    step : float
        Distance between positions [m].
    allowance : Allowance, optional
        What the robot may deviate; `Allowance()` if not given.
    table : LimitTable, optional
        Table of limits; that of ISO/TS 15066:2016 if not given.
    around : tuple of float, optional
        Only positions at most five steps from this distance and height [m].
    progress : callable, optional
        Called with the number of positions done.

    Returns
    -------
    TaskPlaces

    Raises
    ------
    InputError
        As `path_speeds`, and for a step that is not positive, or one that makes more than 20 000 positions.
    UnknownName
        The table of limits does not have a body area.
    BoundNotAvailable
        The map cannot carry the bound.
    """
    atlas = Atlas.of(maps)
    distance, height = table_positions(atlas, path, step, around)
    duration, standard, permitted, lowest = np.full((4, distance.size, height.size), np.nan)
    closest: tuple[tuple[float, float], tuple[float, float], PathSpeeds] | None = None
    fullest: PathSpeeds | None = None
    ever, inside = np.zeros((2, len(path.resampled(LONGEST_PIECE))), dtype=np.int64)
    case: dict[str, Any] = {"bound": bound, "allowance": allowance, "table": table}
    for number, (i, j), speeds in _at_positions(atlas, path, task, distance, height, **case):
        duration[i, j] = speeds.allowed.duration
        standard[i, j] = speeds.standard.duration
        lowest[i, j] = speeds.constant.speed
        lengths = speeds.path.lengths
        permitted[i, j] = lengths[~speeds.refused].sum() / lengths.sum()
        out = float(lengths[speeds.outcome == PieceOutcome.OUTSIDE].sum())
        rank = (round(float(permitted[i, j]), _DIGITS), -round(out, _DIGITS))
        if closest is None or rank > closest[0]:
            closest = (rank, (float(distance[i]), float(height[j])), speeds)
        if fullest is None or len(speeds.bases) > len(fullest.bases):
            fullest = speeds
        if progress is not None:
            progress(number)
        ever, inside = ever | ~speeds.refused, inside + (speeds.outcome == PieceOutcome.UNCONFIRMED)
    assert closest is not None
    assert fullest is not None
    most = (*closest[1], closest[0][0])
    never = np.flatnonzero((ever == 0) & (inside >= _POSITIONS_TELL))
    without = tuple(dict.fromkeys(closest[2].path.names[piece] for piece in never.tolist()))
    best: PathSpeeds | None = None
    if not np.isnan(duration).all():
        i, j = _best(duration, lowest)
        (best,) = path_speeds_at(atlas, path, [np.array([distance[i], 0.0, height[j]])], task, **case)
        fullest = best if len(best.bases) >= len(fullest.bases) else fullest
    grids = (duration, standard, permitted, lowest)
    notes = (*fullest.notes, *_far_from_its_origin(path))
    return TaskPlaces(distance, height, *grids, best, most, closest[2], fullest.bases, notes, without)


def _far_from_its_origin(path: ToolPath) -> Iterator[Finding]:
    """That a path may be in the frame of the base, so that a position is a shift of it and none of a table."""
    apart = float(np.linalg.norm(path.points, axis=1).min())
    if apart > _FAR:
        yield Finding.of(FindingKind.FAR_FROM_ITS_ORIGIN, apart_m=apart)


def _at_positions(
    atlas: Atlas, path: ToolPath, task: Task, distance: FloatArray, height: FloatArray, **case: Any
) -> Iterator[tuple[int, tuple[int, int], PathSpeeds]]:
    """The number of each position, where it stands in the grid, and the speeds of the path there."""
    together = max(1, _PIECES_AT_ONCE // len(path.resampled(LONGEST_PIECE)))
    places = list(np.ndindex(distance.size, height.size))
    for first in range(0, len(places), together):
        some = places[first : first + together]
        offsets = [np.array([distance[i], 0.0, height[j]]) for i, j in some]
        yield from zip(
            itertools.count(first + 1), some, path_speeds_at(atlas, path, offsets, task, **case), strict=False
        )


def table_positions(
    maps: ForceMap | Atlas, path: ToolPath, step: float, around: tuple[float, float] | None = None
) -> tuple[FloatArray, FloatArray]:
    """Distances and heights [m] of a table's frame, multiples of `step`, at which the path comes into the ranges' box.

    Those at most five steps from the place `around`, if one is given.

    Raises
    ------
    InputError
        A step that is not positive and finite, or that makes no or more than 20 000 positions.
    """
    ranges = [force_map.measured_range for force_map in Atlas.of(maps).force_maps]
    low, high = np.min([each.lowest for each in ranges], axis=0), np.max([each.highest for each in ranges], axis=0)
    distance = _positions(low[0] - path.points[:, 0].max(), high[0] - path.points[:, 0].min(), step)
    height = _positions(low[1] - path.points[:, 2].max(), high[1] - path.points[:, 2].min(), step)
    distance = distance[distance >= 0]
    if around is not None:
        reach = (_STEPS_AROUND + _ROUNDING) * step
        distance, height = (
            axis[np.abs(axis - middle) <= reach] for axis, middle in zip((distance, height), around, strict=True)
        )
    total = distance.size * height.size
    if not 0 < total <= _MOST_POSITIONS:
        raise InputError(f"step: found {step:g} m, which makes {total} positions, expected from 1 to {_MOST_POSITIONS}")
    return distance, height


def _positions(low: float, high: float, step: float) -> FloatArray:
    """Multiples of the step from low to high [m]."""
    if not 0 < step < np.inf:
        raise InputError(f"step: found {step:g} m, expected a positive finite number")
    first, last = math.ceil(low / step - _ROUNDING), math.floor(high / step + _ROUNDING)
    if last - first > _MOST_POSITIONS:
        raise InputError(f"step: found {step:g} m, expected one that makes at most {_MOST_POSITIONS} positions")
    return np.round(step * np.arange(first, last + 1), _DECIMALS)
