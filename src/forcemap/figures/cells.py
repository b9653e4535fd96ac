"""Grids of places as cells."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch, Rectangle

from forcemap.arrays import FloatArray, Mask
from forcemap.figures.style import Look

_ALONE = 0.05  # a single place is drawn as wide as this [m]


def edges(axis: FloatArray) -> FloatArray:
    """Edges of the cells around ascending places, shape (n + 1,): midway, and as far beyond the outer ones [m]."""
    places = np.asarray(axis, dtype=np.float64)
    if places.size == 1:
        return np.array([places[0] - _ALONE / 2, places[0] + _ALONE / 2])
    inner = (places[1:] + places[:-1]) / 2
    return np.concatenate([[2 * places[0] - inner[0]], inner, [2 * places[-1] - inner[-1]]])


def hatch_cells(axes: Axes, x: FloatArray, y: FloatArray, chosen: Mask, look: Look) -> Patch:
    """Draw a look over the chosen cells, shape (n, m), between edges x, (n + 1,), and y, (m + 1,); and for a legend."""
    for i, column in enumerate(chosen):
        runs = np.flatnonzero(np.diff(np.concatenate([[False], column, [False]]).astype(np.int8)))
        for start, stop in runs.reshape(-1, 2).tolist():  # cells on top of each other are one area
            corner = (float(x[i]), float(y[start]))
            area = look.filled | {"label": "_"}
            axes.add_patch(Rectangle(corner, float(x[i + 1] - x[i]), float(y[stop] - y[start]), **area))
    return Patch(**(look.filled | {"linewidth": 0.6}))
