"""A path as it is drawn: from the side and from above, its pieces by their outcome."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from forcemap.answers.path import PathAnswer, PieceAnswer

_WIDTH, _HEIGHT, _EDGE = 420.0, 290.0, 58.0
"""Size of a view and room for its axes, in units of its drawing; choices: two views stand side by side."""

_LEAST = 0.1
"""The least extent of a view [m]; a choice: a short path is not drawn as if it were long."""

_Place = tuple[float, float]


@dataclass(frozen=True)
class Stretch:
    """Neighbouring pieces of one outcome, as the places of one line of the drawing."""

    outcome: str
    places: tuple[_Place, ...]


@dataclass(frozen=True)
class View:
    """A view of a path.

    Parameters
    ----------
    title, across, up : str
        What it is, and what its axes are.
    width, height, edge : float
        Of the drawing.
    stretches : tuple of Stretch
    corners : tuple of (float, float)
        The points of the path.
    ticks_across, ticks_up : tuple of (float, str)
        Where figures stand along the axes, and which.
    """

    title: str
    across: str
    up: str
    width: float
    height: float
    edge: float
    stretches: tuple[Stretch, ...]
    corners: tuple[_Place, ...]
    ticks_across: tuple[tuple[float, str], ...]
    ticks_up: tuple[tuple[float, str], ...]


def views(answer: PathAnswer, points: list[list[float]]) -> tuple[View, View]:
    """A path from the side and from above.

    Parameters
    ----------
    answer : PathAnswer
    points : list of [float, float, float]
        The corners of the path in the frame of the base [m].
    """
    side = _view(answer.pieces, points, _from_side, "From the side", ("Distance from the base axis [m]", "Height [m]"))
    above = _view(answer.pieces, points, _from_above, "From above", ("x [m]", "y [m]"))
    return side, above


def _from_side(point: list[float]) -> _Place:
    return math.hypot(point[0], point[1]), point[2]


def _from_above(point: list[float]) -> _Place:
    return point[0], point[1]


def _view(
    pieces: list[PieceAnswer],
    points: list[list[float]],
    seen: Callable[[list[float]], _Place],
    title: str,
    axes: tuple[str, str],
) -> View:
    places = [seen(point) for piece in pieces for point in (piece.from_m, piece.to_m)]
    across, up = ([place[axis] for place in places] for axis in (0, 1))
    middle = [(min(values) + max(values)) / 2 for values in (across, up)]
    room = (_WIDTH - 2 * _EDGE, _HEIGHT - 2 * _EDGE)
    extents = [max(max(values) - min(values), _LEAST) for values in (across, up)]
    scale = min(space / extent for space, extent in zip(room, extents, strict=True))  # a metre is as long both ways

    def drawn(place: _Place) -> _Place:
        x, y = _WIDTH / 2 + scale * (place[0] - middle[0]), _HEIGHT / 2 - scale * (place[1] - middle[1])
        return round(x, 1), round(y, 1)

    ticks = [_ticks(middle[axis], space / scale) for axis, space in enumerate(room)]
    return View(
        title,
        *axes,
        _WIDTH,
        _HEIGHT,
        _EDGE,
        tuple(
            Stretch(outcome, tuple(drawn(seen(point)) for point in places)) for outcome, places in _stretches(pieces)
        ),
        tuple(drawn(seen(point)) for point in points),
        tuple((drawn((value, 0))[0], f"{value:g}") for value in ticks[0]),
        tuple((drawn((0, value))[1], f"{value:g}") for value in ticks[1]),
    )


def _stretches(pieces: list[PieceAnswer]) -> list[tuple[str, list[list[float]]]]:
    """Outcome and points of every run of pieces that have one outcome and follow each other."""
    found: list[tuple[str, list[list[float]]]] = []
    for piece in pieces:
        if found and found[-1][0] == piece.outcome and found[-1][1][-1] == piece.from_m:
            found[-1][1].append(piece.to_m)
        else:
            found.append((piece.outcome, [piece.from_m, piece.to_m]))
    return found


def _ticks(middle: float, extent: float) -> list[float]:
    """Round values within an extent around a middle."""
    step = next(step for step in (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0) if extent / step <= 5)
    first, last = math.ceil((middle - extent / 2) / step), math.floor((middle + extent / 2) / step)
    return [round(number * step, 2) for number in range(first, last + 1)]
