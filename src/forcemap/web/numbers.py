"""Numbers as JSON has them: NaN and infinities are null."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray


def number(value: Any) -> float | None:
    """A figure, or None where there is none."""
    return float(value) if math.isfinite(value) else None


def numbers(values: NDArray[Any], digits: int) -> list[Any]:
    """Figures of an array as nested lists, rounded to some digits, None where there is none."""
    plain = np.round(np.asarray(values, dtype=np.float64), digits)
    if np.isfinite(plain).all():
        return list(plain.tolist())
    cells = plain.astype(object)
    cells[~np.isfinite(plain)] = None
    return list(cells.tolist())
