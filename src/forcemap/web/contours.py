"""Lines of equal value on a grid of places, for the page to draw and to number."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from forcemap.answers.answer import Answer
from forcemap.arrays import FloatArray

_LINES = 7
"""About how many lines a plane gets; a choice: each can be followed and numbered."""

_DECIMALS = 4
"""Decimals of a line's places in m; a choice, finer than can be seen."""


class Contour(Answer):
    """The lines of one value, each as its places: distance and height [m]."""

    at: float
    lines: list[list[tuple[float, float]]]


def contours(distance: FloatArray, height: FloatArray, values: FloatArray, *, also: float = math.nan) -> list[Contour]:
    """Lines of round values, rows of `values` along distance; none where a value is NaN.

    They are drawn to be looked at: a speed is permitted by the answer for its place alone.

    Parameters
    ----------
    distance, height : array (n,), (m,)
        Axes of the grid [m].
    values : array (n, m)
    also : float
        A further value to draw, in the unit of the others.
    """
    known = values[~np.isnan(values)]
    if min(values.shape) < 2 or not known.size:  # a line needs two rows and two columns
        return []
    from contourpy import LineType, contour_generator

    generator = contour_generator(
        distance, height, np.ma.masked_invalid(values.T), name="serial", line_type=LineType.Separate
    )
    wanted = [*round_values(float(known.min()), float(known.max())), *([also] if math.isfinite(also) else [])]
    found: Iterable[tuple[float, Any]] = ((at, generator.lines(at)) for at in dict.fromkeys(wanted))
    return [
        Contour(at=at, lines=[np.round(line, _DECIMALS).tolist() for line in lines]) for at, lines in found if lines
    ]


def round_values(low: float, high: float) -> list[float]:
    """Round values between two: multiples of 1, 2 or 5 times a power of ten, about seven of them."""
    if not high > low:
        return []
    rough = (high - low) / _LINES
    ten = 10.0 ** math.floor(math.log10(rough))
    step = next(ten * factor for factor in (1, 2, 5, 10) if ten * factor >= rough * (1 - 1e-9))
    first, last = math.ceil(low / step), math.floor(high / step)
    return [round(number * step, 9) for number in range(first, last + 1)]
