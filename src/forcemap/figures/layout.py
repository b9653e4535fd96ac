"""Where panels, legend and the words above them stand: margins stated from the letters that they have to hold.

A figure is laid out once, before it is drawn, with sums alone: nothing is drawn to see how large it is. All lengths are
in points, a 72nd of an inch.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

POINTS_PER_INCH = 72

_LINE = 1.3
"""Height of a line of letters, as a multiple of their size."""

_PIXELS = 1.06
"""How much wider letters are at most where pixels are few."""

_EDGE = 5.0
"""Room beside everything at the edges of a figure."""

_TICK = 8.0
"""Length of a tick and its distance from its label."""

_BESIDE_TICKS = 5.0
"""Distance of the label of an axis from those of its ticks, or of a title from its axes."""

_HANDLE = 25.0
"""A legend's line or marker, and its distance from the words."""

_BETWEEN = 14.0
"""Distance between the columns of a legend."""

_LEGEND_LINE, _LEGEND_EDGE = 11.2, 6.0
"""Height of a line of a legend, and its distance from what is beside it."""

_BAR, _BAR_APART = 8.0, 10.0
"""Width of a colour bar, and its distance from the panel."""


@dataclass(frozen=True)
class Room:
    """Room that panels need beside their ticks, labels and titles [pt], for words that are written there."""

    left: float = 0.0
    right: float = 0.0
    above: float = 0.0


@lru_cache(maxsize=4096)
def across(text: str, size: float, weight: str = "normal") -> float:
    """Width of a line of text [pt]."""
    font = FontProperties(family=["DejaVu Sans"], size=size, weight=weight)
    return float(text_to_path.get_text_width_height_descent(text, font, False)[0])


def broken(text: str, size: float, wide: float, weight: str = "normal") -> Iterator[str]:
    """A text broken into lines no wider than `wide` [pt]; a longer word has a line of its own."""
    line = ""
    for word in text.split():
        longer = f"{line} {word}".lstrip()
        if line and across(longer, size, weight) > wide:
            yield line
            longer = word
        line = longer
    yield line


def legend_below(figure: Figure, entries: dict[str, Artist]) -> float:
    """Put one legend below all panels, in as many columns as fit; returns its height."""
    if not entries:
        return 0.0
    size, wide = float(rcParams["legend.fontsize"]), _wide(figure) - 2 * _EDGE - 2 * _LEGEND_EDGE
    words = ["\n".join(broken(name, size, (wide - _HANDLE) / _PIXELS)) for name in entries]
    widths = [max(across(line, size) for line in text.split("\n")) * _PIXELS + _HANDLE for text in words]
    fits = (count for count in range(len(words), 1, -1) if _legend_wide(widths, count) <= wide)
    columns = next(fits, 1)
    handles = list(entries.values())
    figure.legend(handles, words, loc="lower left", bbox_to_anchor=(_EDGE / _wide(figure), 0.0), ncols=columns)
    lines = [text.count("\n") + 1 for text in words]
    return _LEGEND_LINE * float(max(sum(column) for column in _columns(lines, columns))) + _LEGEND_EDGE


def _columns(values: Sequence[Any], count: int) -> Iterator[Sequence[Any]]:
    """The values in as many columns as matplotlib's legend puts them."""
    rows, more = divmod(len(values), count)
    start = 0
    for column in range(min(count, len(values))):
        stop = start + rows + (column < more)
        yield values[start:stop]
        start = stop


def _legend_wide(widths: Sequence[float], count: int) -> float:
    """Width of a legend with that many columns."""
    return float(sum(max(column) for column in _columns(widths, count)) + _BETWEEN * (count - 1))


def words_above(figure: Figure, lines: Sequence[str], size: float, box: dict[str, Any]) -> float:
    """Write lines above all panels, bold, broken at the figure's width; returns their height."""
    if not lines:
        return 0.0
    wide = (_wide(figure) - 2 * _EDGE) / _PIXELS
    said = [part for line in lines for part in broken(line, size, wide, "bold")]
    tall, font = _tall(figure), FontProperties(size=size, weight="bold")
    at = {"x": _EDGE / _wide(figure), "y": 1 - _EDGE / tall, "ha": "left", "va": "top"}
    figure.suptitle("\n".join(said), fontproperties=font, bbox=box, **at)
    return _LINE * size * len(said) + 2 * _EDGE


def place_panels(figure: Figure, above: float, below: float, room: Room) -> None:
    """Put the panels of a figure between what is above and below them, each with the room its words need.

    Panels of a column are equally wide, those of a row equally high. Axes that are no panel are colour bars; they stand
    at the right of all panels.
    """
    panels = [axes for axes in figure.axes if axes.get_subplotspec() is not None]
    bars = [axes for axes in figure.axes if axes.get_subplotspec() is None]
    wide, tall = _wide(figure), _tall(figure)
    spec = panels[0].get_subplotspec()
    assert spec is not None
    rows, columns = spec.get_gridspec().get_geometry()
    inner = [wide / columns - 45.0, (tall - above - below) / rows - 40.0]  # as if: what ticks are chosen by
    for axes in [*panels, *bars]:
        _put(axes, figure, 0.0, 0.0, max(20.0, inner[0]), max(20.0, inner[1]))
    bar_wide = max([_BAR + _BAR_APART + _beside(axes.yaxis) for axes in bars], default=0.0)
    left, right, top, bottom = (np.zeros(count) for count in (columns, columns, rows, rows))
    for number, axes in enumerate(panels):
        row, column = divmod(number, columns)
        left[column] = max(left[column], _beside(axes.yaxis) + room.left)
        right[column] = max(right[column], _EDGE + _half_last(axes.xaxis), room.right)
        top[row] = max(top[row], _title(axes) + room.above)
        bottom[row] = max(bottom[row], _beneath(axes.xaxis))
    left[0] += _EDGE
    top[0] += _EDGE
    width = max(10.0, (wide - left.sum() - right.sum() - bar_wide) / columns)
    height = max(10.0, (tall - above - below - top.sum() - bottom.sum()) / rows)
    for number, axes in enumerate(panels):
        row, column = divmod(number, columns)
        x = left[: column + 1].sum() + right[:column].sum() + column * width
        y = tall - above - top[: row + 1].sum() - bottom[:row].sum() - (row + 1) * height
        _put(axes, figure, x, y, width, height)
    if bars:
        box = panels[-1].get_position()
        panels[-1].apply_aspect()  # an equal aspect makes a panel smaller: the bar is as high as the panel
        seen = panels[-1].get_position() if panels[-1].name != "3d" else box
        for axes in bars:
            x = seen.x1 * wide + room.right + _BAR_APART
            _put(axes, figure, x, seen.y0 * tall, _BAR, seen.height * tall)


def _put(axes: Axes, figure: Figure, x: float, y: float, width: float, height: float) -> None:
    wide, tall = _wide(figure), _tall(figure)
    axes.set_position((x / wide, y / tall, width / wide, height / tall))


def _wide(figure: Figure) -> float:
    return float(figure.get_figwidth()) * POINTS_PER_INCH


def _tall(figure: Figure) -> float:
    return float(figure.get_figheight()) * POINTS_PER_INCH


def _ticks(axis: Axis) -> list[str]:
    """Words at the ticks of an axis that are seen."""
    low, high = sorted(axis.get_view_interval())
    places = np.asarray(axis.get_majorticklocs())
    words = axis.get_major_formatter().format_ticks(places.tolist())
    return [text for text, place in zip(words, places, strict=True) if low <= place <= high and text]


def _labelled(axis: Axis) -> bool:
    seen = axis.get_tick_params()
    side = "labelleft" if "labelleft" in seen else "labelbottom"
    return bool(seen.get(side, True) or seen.get("labelright", False))


def _label(axis: Axis) -> float:
    """Height of the label of an axis with its distance from the ticks."""
    text = axis.label.get_text()
    return (text.count("\n") + 1) * _LINE * float(axis.label.get_fontsize()) + _BESIDE_TICKS if text else 0.0


def _beside(axis: Axis) -> float:
    """Room beside a vertical axis, for its ticks and its label."""
    size = float(rcParams["ytick.labelsize"])
    lines = [line for text in _ticks(axis) for line in text.split("\n")] if _labelled(axis) else []
    return max((across(line, size) for line in lines), default=0.0) + _TICK + _label(axis)


def _beneath(axis: Axis) -> float:
    """Room below a horizontal axis, for its ticks and its label."""
    size, words = float(rcParams["xtick.labelsize"]), _ticks(axis) if _labelled(axis) else []
    turned = math.radians(axis.get_tick_params().get("labelrotation", 0.0) or _turned(axis))
    letters = max((across(text, size) for text in words), default=0.0)
    return abs(math.sin(turned)) * letters + math.cos(turned) * _LINE * size * bool(words) + _TICK + _label(axis)


def _turned(axis: Axis) -> float:
    """Angle of the words at the ticks [deg]."""
    ticks = axis.majorTicks
    return float(ticks[0].label1.get_rotation()) if ticks else 0.0


def _half_last(axis: Axis) -> float:
    """What the last word at the ticks of a horizontal axis may stand out at the right."""
    words = _ticks(axis) if _labelled(axis) else []
    return across(words[-1], float(rcParams["xtick.labelsize"])) / 2 if words and not _turned(axis) else 0.0


def _title(axes: Axes) -> float:
    """Room above a panel, for its title."""
    text = axes.get_title("left")
    lines = (text.count("\n") + 1) * _LINE * float(axes._left_title.get_fontsize()) if text else 0.0  # type: ignore[attr-defined]
    return lines + _BESIDE_TICKS + (1.0 if text else 0.0)
