"""A path bent to the directions that are measured: up or down, out or in, and around the base."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray, Indices
from forcemap.errors import InputError
from forcemap.maps.force_map import ForceMap
from forcemap.paths.atlas import Atlas
from forcemap.paths.path_speeds import LONGEST_PIECE, PathSpeeds, path_speeds
from forcemap.paths.task import Task
from forcemap.paths.tool_path import ToolPath

_ORDERS = tuple(itertools.permutations(range(3)))  # of the steps along distance, around the base and along height
_STANDING = 1e-6  # [m]; a step shorter than this is none


@dataclass(frozen=True, eq=False)
class BentPath:
    """A path whose moves without permission are replaced by vertical, radial and circular ones.

    Parameters
    ----------
    path : ToolPath
        The path, circles in short chords; without times or stated speeds.
    speeds : PathSpeeds
        Speeds along it.
    bent : int
        Number of moves that were replaced.
    """

    path: ToolPath
    speeds: PathSpeeds
    bent: int


def bent_path(
    maps: ForceMap | Atlas, path: ToolPath, task: Task, *, step: float = LONGEST_PIECE, **case: Any
) -> BentPath:
    """Replace the moves that lack permission somewhere by vertical, radial and circular ones between the same points.

    Each move has six orders of these three. Of those the one that permits the largest share of its length is taken, of
    several the fastest; a move is left as it is where none permits more. Whether the robot and its load collide with
    anything on the new way is not looked at.

    Parameters
    ----------
    maps : ForceMap or Atlas
        The map, or several of one robot.
    path : ToolPath
        The path; its times, or the speeds that it states, are not kept.
    task : Task
        Body areas and contact of each segment, as in `path_speeds`.
    step : float
        Longest piece [m].
    **case
        The other arguments of `path_speeds`.

    Returns
    -------
    BentPath

    Raises
    ------
    InputError
        As `path_speeds`, and for a path that cannot be bent because it comes to the base's z-axis.
    """
    straight = ToolPath(path.points, path.names, source=path.source)
    as_is = path_speeds(maps, straight, task, step=step, **case)
    of_move = _moves(straight, as_is.path)
    moves = np.unique(of_move[as_is.refused])
    if not moves.size:
        return BentPath(straight, as_is, 0)
    ways = [{move: _way(straight, int(move), order, step) for move in moves.tolist()} for order in _ORDERS]
    kept = {move: straight.points[[move, move + 1]] for move in moves.tolist()}
    found = []
    for way in (kept, *ways):
        tried, which = _assembled(straight, way)
        speeds = path_speeds(maps, tried, task, step=step, **case)
        found.append(_worth(speeds, which[_moves(tried, speeds.path)], moves))
    best = [max(range(len(found)), key=lambda way: (*found[way][move], -way)) for move in range(moves.size)]
    chosen = {move: (kept, *ways)[best[i]][move] for i, move in enumerate(moves.tolist())}
    bent, _ = _assembled(straight, chosen)
    return BentPath(bent, path_speeds(maps, bent, task, step=step, **case), sum(way > 0 for way in best))


def _moves(path: ToolPath, pieces: ToolPath) -> Indices:
    """The piece of a path that each piece of its resampled form lies in."""
    ends, middle = np.cumsum(path.lengths), np.cumsum(pieces.lengths) - pieces.lengths / 2
    return np.asarray(np.minimum(np.searchsorted(ends, middle), len(path) - 1))


def _worth(speeds: PathSpeeds, of_move: Indices, moves: Indices) -> list[tuple[float, float]]:
    """For each move the share of its length that is permitted, and less the time of that at the allowed speeds [s]."""
    worth = []
    for move in moves.tolist():
        pieces = of_move == move
        lengths, free = speeds.path.lengths[pieces], ~speeds.refused[pieces]
        share = round(float(lengths[free].sum() / lengths.sum()), 9)
        worth.append((share, -float(np.sum(lengths[free] / speeds.speed[pieces][free]))))
    return worth


def _way(path: ToolPath, move: int, order: tuple[int, ...], step: float) -> FloatArray:
    """Points from the start of a move to its end, one coordinate of the cylinder after the other, shape (k, 3)."""
    start, end = path.points[move], path.points[move + 1]
    here, there = _cylinder(start), _cylinder(end)
    if min(here[0], there[0]) < step:
        raise InputError("suggest: the path comes to the base's z-axis, where out and around have no direction")
    there[1] = here[1] + (there[1] - here[1] + np.pi) % (2 * np.pi) - np.pi
    points = [start]
    for axis in order:
        begun, here = here, here.copy()
        here[axis] = there[axis]
        arc = abs(here[1] - begun[1]) * here[0]
        count = max(1, int(np.ceil(arc / step)))
        shares = np.arange(1, count + 1)[:, None] / count
        points += list(_cartesian(begun * (1 - shares) + here * shares))
    points[-1] = end
    kept = [points[0]]
    for point in points[1:]:
        if np.linalg.norm(point - kept[-1]) >= _STANDING:
            kept.append(point)
    kept[-1] = end
    return np.array(kept)


def _cylinder(point: FloatArray) -> FloatArray:
    """Distance from the z-axis [m], angle around it [rad], height [m]."""
    return np.array([np.hypot(point[0], point[1]), np.arctan2(point[1], point[0]), point[2]])


def _cartesian(points: FloatArray) -> FloatArray:
    distance, angle, height = points.T
    return np.stack([distance * np.cos(angle), distance * np.sin(angle), height], axis=1)


def _assembled(path: ToolPath, ways: dict[int, FloatArray]) -> tuple[ToolPath, Indices]:
    """The path with some moves replaced, and the move of each of its pieces."""
    points, which = [path.points[:1]], []
    for move in range(len(path)):
        way = ways.get(move, path.points[move : move + 2])
        points.append(way[1:])
        which += [move] * (len(way) - 1)
    moves = np.array(which)
    return ToolPath(np.vstack(points), tuple(path.names[move] for move in which), source=path.source), moves
