"""Where panels, legend and the words above them stand: margins stated from the letters that they have to hold.

A figure is laid out once, before it is drawn, with sums alone: nothing is drawn to see how large it is. All lengths are
in points, a 72nd of an inch.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from matplotlib.transforms import ScaledTranslation

from forcemap.arrays import FloatArray

POINTS_PER_INCH = 72

WORDS_ABOVE = 7.5
"""Size of the letters of the words above a figure."""

PAGE_HEIGHT = 680.0
"""Height that a page holds: 24 cm, of an A4 page without its margins."""

_LOWEST, _LOWEST_ON_PAGE = 85.0, 55.0
"""Least height of a panel, 3 cm; where the figure would then be higher than a page, 2 cm. Choices."""

_SPACE = re.compile(r"\s+(?!(?<=\d\s)(?:Nm|N/mm|N|mm|m/s|m|kg|W|J|s|%)(?![\w/]))")
"""Where a line may be broken: not between a number and its unit."""

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
    for word in _SPACE.split(text.strip()):
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


def lay_out(figure: Figure, entries: dict[str, Artist], lines: Sequence[str], box: dict[str, Any], room: Room) -> None:
    """Put a legend below all panels, lines of words above them in a box, and the panels between.

    Panels of a column are equally wide, those of a row equally high. Axes that are no panel are colour bars; they stand
    at the right of all panels. A figure whose panels would be too low becomes higher: as high as
    a page, and beyond that only for panels of 2 cm.
    """
    panels = [axes for axes in figure.axes if axes.get_subplotspec() is not None]
    bars = [axes for axes in figure.axes if axes.get_subplotspec() is None]
    spec = panels[0].get_subplotspec()
    assert spec is not None
    rows, columns = spec.get_gridspec().get_geometry()
    wide, below = _wide(figure), legend_below(figure, entries)
    said = [part for line in lines for part in broken(line, WORDS_ABOVE, (wide - 2 * _EDGE) / _PIXELS, "bold")]
    above = _LINE * WORDS_ABOVE * len(said) + 2 * _EDGE if said else 0.0
    for axes in [*panels, *bars]:  # as if: what ticks are chosen by
        about = (_tall(figure) - above - below) / rows - 40.0
        _put(axes, figure, 0.0, 0.0, max(20.0, wide / columns - 45.0), max(_LOWEST, about))
    margins = _margins(panels, rows, columns, room)
    bar_wide = max([_BAR + _BAR_APART + _beside(axes.yaxis) for axes in bars], default=0.0)
    width = max(10.0, (wide - margins.left.sum() - margins.right.sum() - bar_wide) / columns)
    for number, axes in enumerate(panels):
        _break_title(axes, width + max(0.0, margins.right[number % columns] - _EDGE))
    top = _tops(panels, rows, columns, room)
    between = above + below + top.sum() + margins.bottom.sum()
    height = (_tall(figure) - between) / rows
    # the label of a colour bar stands beside it
    lowest = max(
        [_LOWEST, *(across(bar.get_ylabel(), float(bar.yaxis.label.get_fontsize())) * _PIXELS for bar in bars)]
    )
    if height < lowest:
        height = min(lowest, max((PAGE_HEIGHT - between) / rows, _LOWEST_ON_PAGE))
        figure.set_figheight((between + rows * height) / POINTS_PER_INCH)
    _place(figure, panels, replace(margins, top=top), above, (width, height))
    if bars:
        panels[-1].apply_aspect()  # an equal aspect makes a panel smaller: the bar is as high as the panel
        seen = panels[-1].get_position()
        for axes in bars:
            start, tall = seen.x1 * wide + room.right + _BAR_APART, _tall(figure)
            _put(axes, figure, start, seen.y0 * tall, _BAR, seen.height * tall)
    for axes in (axes for axes in figure.axes if axes.name != "3d"):
        _place_labels(axes, figure)
    if said:
        at = {"x": _EDGE / wide, "y": 1 - _EDGE / _tall(figure), "ha": "left", "va": "top"}
        font = FontProperties(size=WORDS_ABOVE, weight="bold")
        figure.suptitle("\n".join(said), fontproperties=font, bbox=box, **at)


@dataclass(frozen=True, eq=False)
class _Margins:
    """Room beside the panels of each column, shape (columns,), and above and below those of each row, (rows,) [pt]."""

    left: FloatArray
    right: FloatArray
    top: FloatArray
    bottom: FloatArray


def _margins(panels: Sequence[Axes], rows: int, columns: int, room: Room) -> _Margins:
    left, right, bottom = (np.zeros(count) for count in (columns, columns, rows))
    for number, axes in enumerate(panels):
        row, column = divmod(number, columns)
        left[column] = max(left[column], _beside(axes.yaxis) + room.left)
        right[column] = max(right[column], _EDGE + _half_last(axes.xaxis), room.right)
        bottom[row] = max(bottom[row], _beneath(axes.xaxis))
    left[0] += _EDGE
    return _Margins(left, right, _tops(panels, rows, columns, room), bottom)


def _tops(panels: Sequence[Axes], rows: int, columns: int, room: Room) -> FloatArray:
    """Room above the panels of each row, shape (rows,)."""
    top = np.zeros(rows)
    for number, axes in enumerate(panels):
        top[number // columns] = max(top[number // columns], _title(axes) + room.above)
    top[0] += _EDGE
    return top


def _place(figure: Figure, panels: Sequence[Axes], margins: _Margins, above: float, size: tuple[float, float]) -> None:
    width, height = size
    for number, axes in enumerate(panels):
        row, column = divmod(number, margins.left.size)
        x = margins.left[: column + 1].sum() + margins.right[:column].sum() + column * width
        down = above + margins.top[: row + 1].sum() + margins.bottom[:row].sum() + (row + 1) * height
        _put(axes, figure, float(x), _tall(figure) - float(down), width, height)


def _break_title(axes: Axes, wide: float) -> None:
    """Break the lines of a panel's title that are wider than its panel."""
    text, size, wide = axes.get_title("left"), float(_title_of(axes).get_fontsize()), wide / _PIXELS
    if any(across(line, size) > wide for line in text.split("\n")):
        axes.set_title("\n".join(part for line in text.split("\n") for part in broken(line, size, wide)), fontsize=size)


def _title_of(axes: Axes) -> Text:
    title: Text = axes._left_title  # type: ignore[attr-defined]
    return title


def _put(axes: Axes, figure: Figure, x: float, y: float, width: float, height: float) -> None:
    wide, tall = _wide(figure), _tall(figure)
    axes.set_position((x / wide, y / tall, width / wide, height / tall))


def _wide(figure: Figure) -> float:
    return float(figure.get_figwidth()) * POINTS_PER_INCH


def _tall(figure: Figure) -> float:
    return float(figure.get_figheight()) * POINTS_PER_INCH


def _place_labels(axes: Axes, figure: Figure) -> None:
    """Put the labels of the axes beside those of the ticks: matplotlib would draw the ticks to see how far."""
    below = _beneath(axes.xaxis) - _label(axes.xaxis) + _BESIDE_TICKS / 2
    beside = _beside(axes.yaxis) - _label(axes.yaxis) + _BESIDE_TICKS / 2
    right = str(axes.yaxis.get_label_position()) == "right"
    for axis, (x, y), (across, up) in (
        (axes.xaxis, (0.5, 0.0), (0.0, -below)),
        (axes.yaxis, (float(right), 0.5), (beside if right else -beside, 0.0)),
    ):
        shift = ScaledTranslation(across / POINTS_PER_INCH, up / POINTS_PER_INCH, figure.dpi_scale_trans)
        axis.set_label_coords(x, y, transform=axes.transAxes + shift)


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
    lines = (text.count("\n") + 1) * _LINE * float(_title_of(axes).get_fontsize()) if text else 0.0
    return lines + _BESIDE_TICKS + (1.0 if text else 0.0)
