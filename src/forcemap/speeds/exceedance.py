"""Where a function first exceeds a level, for many places at once, with errors on the safe side."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask

CELLS = 128
"""Cells an interval is cut into; a suspicious cell is cut again."""

_FINE = np.linspace(0.0, 1.0, CELLS + 1)
_COARSE = np.linspace(0.0, 1.0, 17)
_ROUNDS = 5  # 16 to the power 5: a millionth of a second-level cell


def first_exceedance(
    function: Callable[[Indices, FloatArray], FloatArray],
    start: FloatArray,
    stop: FloatArray,
    level: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """The end of the stretch from `start` on which a function stays at or below a level.

    The interval is sampled in cells. A cell is sampled again if an end exceeds the level, or if the function may
    turn inside it, as twice the second differences tell, and its bulge exceeds the level; the exceedance found is
    narrowed down. What the second sampling cannot settle counts as an exceedance. For a parabola the second differences
    are exact, so pass the logarithm of a force: ln F is a polynomial of low degree in v or ln v.

    Parameters
    ----------
    function : callable
        Takes numbers of places, shape (m,), and arguments, shape (m, k), and gives values, shape (m, k).
    start, stop : array
        Interval of each place, shape (n,).
    level : array
        Level of each place, shape (n,).

    Returns
    -------
    tuple of array
        Last argument found at or below the level, and the next one found above it, both of shape (n,).
        The first is NaN where the function exceeds the level at `start`; the second NaN where it never does.
    """
    places = np.arange(start.size)
    arguments, values = _sample(function, places, start, stop, _FINE)
    refused = ~(values[:, 0] <= level)
    certain, suspicious = _cells(values, level)
    first_certain = np.where(certain.any(axis=1), certain.argmax(axis=1), CELLS)
    suspicious &= (np.arange(CELLS) <= first_certain[:, None]) & ~refused[:, None]

    place, cell = np.nonzero(suspicious)
    finer, finer_values = _sample(function, place, arguments[place, cell], arguments[place, cell + 1], _FINE)
    certain, suspicious = _cells(finer_values, level[place])
    exceeds = suspicious.any(axis=1)
    place, at = np.unique(place[exceeds], return_index=True)  # the first exceeding cell of each place
    pair = np.flatnonzero(exceeds)[at]
    cell = suspicious[pair].argmax(axis=1)
    below, above = finer[pair, cell], finer[pair, cell + 1]
    crossed = np.flatnonzero(certain[pair, cell])
    row = np.arange(crossed.size)
    for _ in range(_ROUNDS):  # a cell at whose far end the level is exceeded: cut again and again
        arguments, values = _sample(function, place[crossed], below[crossed], above[crossed], _COARSE)
        cell = (~(values[:, 1:] <= level[place[crossed], None])).argmax(axis=1)
        below[crossed], above[crossed] = arguments[row, cell], arguments[row, cell + 1]

    last = np.where(refused, np.nan, stop)
    following = np.full(start.size, np.nan)
    last[place], following[place] = below, above
    return last, following


def _sample(
    function: Callable[[Indices, FloatArray], FloatArray],
    place: Indices,
    start: FloatArray,
    stop: FloatArray,
    fractions: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    arguments = start[:, None] + (stop - start)[:, None] * fractions
    arguments[:, -1] = stop
    return arguments, function(place, arguments)


def _cells(values: FloatArray, level: FloatArray) -> tuple[Mask, Mask]:
    """Cells whose far end exceeds the level, and cells that may exceed it anywhere; shape (n, CELLS)."""
    bend = np.abs(np.diff(values, 2, axis=1))
    bend = np.concatenate([bend[:, :1], bend, bend[:, -1:]], axis=1)
    bend = np.maximum(bend[:, :-1], bend[:, 1:])
    turns = ~(np.abs(np.diff(values, axis=1)) > bend)  # a parabola turns inside a cell if it rises by less than bend/2
    bulge = np.where(turns, bend / 4, 0.0)  # and then rises at most bend/8 above the higher end
    certain = ~(values[:, 1:] <= level[:, None])
    peak = np.maximum(values[:, :-1], values[:, 1:]) + bulge
    return certain, certain | ~(peak <= level[:, None])
