"""Words at the ends of lines, in place of a legend: beside each line, none over another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.text import Annotation

from forcemap.arrays import FloatArray
from forcemap.figures.layout import POINTS_PER_INCH, Room

AT_END = Room(right=40.0)
"""Room for the words [pt]."""

_LETTERS = 6.5
"""Size of the letters [pt]."""

_APART = 8.0
"""Least distance of the lines of letters [pt]."""


def write_at_end(axes: Axes, x: FloatArray, y: FloatArray, words: str) -> list[Annotation]:
    """Write words beside the last known point of a line; nothing where it has none."""
    look: dict[str, Any] = {"va": "center", "fontsize": _LETTERS, "annotation_clip": False}
    return [
        axes.annotate(words, (float(x[last]), float(y[last])), (5, 0), textcoords="offset points", **look)
        for last in np.flatnonzero(np.isfinite(y))[-1:]
    ]


def keep_apart(ends: Sequence[Annotation]) -> None:
    """Move words that would touch up and down, each as little as it goes; panels have to be in their places."""
    for axes in dict.fromkeys(end.axes for end in ends):
        assert axes is not None
        here = sorted((end for end in ends if end.axes is axes), key=lambda end: end.xy[1])
        pixel = POINTS_PER_INCH / axes.get_figure(root=True).dpi  # type: ignore[union-attr]
        wanted = [float(axes.transData.transform(end.xy)[1]) * pixel for end in here]
        top = float(axes.bbox.y1) * pixel
        for end, place, height in zip(here, _below(_apart(wanted), top), wanted, strict=True):
            end.set_position((end.get_position()[0], place - height))


def _apart(wanted: Sequence[float]) -> list[float]:
    """Ascending heights at least `_APART` apart, in groups around the middle of what was wanted."""
    groups: list[list[float]] = []
    for height in wanted:
        groups.append([height])
        while len(groups) > 1 and _bottom(groups[-1]) < _bottom(groups[-2]) + _APART * len(groups[-2]):
            last = groups.pop()
            groups[-1] += last
    return [_bottom(group) + _APART * i for group in groups for i in range(len(group))]


def _below(places: Sequence[float], top: float) -> list[float]:
    """Ascending heights, those above the top moved down, and those beneath these."""
    count = len(places)
    return [min(place, top - _APART * (count - 1 - i)) for i, place in enumerate(places)]


def _bottom(group: Sequence[float]) -> float:
    return sum(group) / len(group) - _APART * (len(group) - 1) / 2
