"""Numbers as JSON has them: NaN and infinities are null; speeds are never rounded up, bounds never down."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcemap.arrays import FloatArray


def number(value: Any) -> float | None:
    """A figure, or None where there is none."""
    return float(value) if math.isfinite(value) else None


def numbers(values: NDArray[Any], digits: int) -> list[Any]:
    """Figures of an array as nested lists, rounded to some digits, None where there is none."""
    return _listed(np.asarray(np.round(np.asarray(values, dtype=np.float64), digits)))


def floored(values: NDArray[Any], digits: int) -> list[Any]:
    """The same, never above the figures: for speeds."""
    return _listed(_cut(np.asarray(values, dtype=np.float64), digits))


def raised(values: NDArray[Any], digits: int) -> list[Any]:
    """The same, never below the figures: for bounds."""
    return _listed(-_cut(-np.asarray(values, dtype=np.float64), digits))


def _cut(values: FloatArray, digits: int) -> FloatArray:
    scale = 10.0**digits
    steps = np.floor(values * scale)
    steps = np.where(steps / scale > values, steps - 1, steps)  # the product may have been rounded up
    return np.asarray(steps / scale)


def _listed(values: NDArray[Any]) -> list[Any]:
    if np.isfinite(values).all():
        return list(values.tolist())
    cells = values.astype(object)
    cells[~np.isfinite(values)] = None
    return list(cells.tolist())
