"""Ranges of distances and heights in which a virtual robot reaches every place."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from forcemap.arrays import FloatArray, Mask

_APART = 0.05
"""How far places that are tested lie apart [m]; a choice: what is reached has smooth edges, and a place takes time."""

_MOST = 21  # values that are tested along an axis; a choice, some seconds where most are out of reach
_THIN = 1e-3  # [m] added to both sides, so that of flat ranges the longest is taken


def reached_ranges(
    reaches: Callable[[FloatArray, FloatArray], Mask], distances: tuple[float, float], heights: tuple[float, float]
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """The largest ranges [m] within those given, of distance and height, in which every tested place is reached.

    Parameters
    ----------
    reaches : callable
        Which places are reached, by arrays of their distance and height.
    distances, heights : tuple of float
        Lowest and highest [m].

    Returns
    -------
    distances, heights : tuple of float
        Lowest and highest [m]; None instead if no place is reached.
    """
    d, h = _axis(*distances), _axis(*heights)
    grid = np.meshgrid(d, h, indexing="ij")
    reached = reaches(grid[0].ravel(), grid[1].ravel()).reshape(d.size, h.size)
    largest, found = 0.0, None
    for first, last in itertools.combinations_with_replacement(range(d.size), 2):
        start = 0
        for at, whole in enumerate(np.all(reached[first : last + 1], axis=0).tolist()):
            if not whole:
                start = at + 1
            elif (size := (d[last] - d[first] + _THIN) * (h[at] - h[start] + _THIN)) > largest:
                largest, found = size, ((float(d[first]), float(d[last])), (float(h[start]), float(h[at])))
    return found


def _axis(low: float, high: float) -> FloatArray:
    """The ends and the multiples of `_APART` between them; of a long range as many values as are tested at most."""
    between = np.arange(np.ceil(low / _APART), np.floor(high / _APART) + 1) * _APART
    axis = np.unique(np.concatenate([[low, high], between]).round(6))
    return axis if axis.size <= _MOST else np.linspace(low, high, _MOST)
