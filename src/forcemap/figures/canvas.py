"""What all figures share: settings, size, panels, cells, legend, SIMULATED, files."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import AutoLocator, MaxNLocator

from forcemap.arrays import FloatArray, Mask
from forcemap.figures.layout import PAGE_HEIGHT, POINTS_PER_INCH, Room, lay_out
from forcemap.figures.style import YELLOW, Look

SIMULATED = "SIMULATED: not a measurement of any robot"
_BESIDE = 0.14  # width from which panels fit beside each other [m]: tried from 75 to 160 mm
_ALONE = 0.05  # width at which a single place is drawn [m]
_LONGEST_NAME = 60  # characters of a name from a file
_LONGEST_LINE = 400  # characters of a line above a figure
_INCH = 0.0254  # [m]
_TICKS = 5  # intervals between the ticks of an axis, at most
_BELOW = 4  # panels of a narrow figure below each other; more stand in two columns
NO_ROOM = Room()

# matplotlib's settings belong to the whole process: one figure at a time, and they are put back.
_SETTINGS = threading.RLock()
_SET = threading.local()  # `here` in the thread that has ours: they are not set once more
_STYLE = matplotlib.rc_params_from_file(Path(__file__).with_name("forcemap.mplstyle"), use_default_template=False)


@contextmanager
def settings() -> Iterator[None]:
    """matplotlib's settings for our figures, whatever those of the user; one thread at a time. Also a decorator."""
    if getattr(_SET, "here", False):
        yield
        return
    with _SETTINGS, matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE)
        with warnings.catch_warnings():  # SVG keeps a name in another script as text; PNG shows boxes
            warnings.filterwarnings("ignore", message="Glyph .* missing from font", category=UserWarning)
            _SET.here = True
            try:
                yield
            finally:
                _SET.here = False


def is_wide(width: float) -> bool:
    """True if panels of a figure of that width [m] fit beside each other."""
    return width >= _BESIDE


def narrow_columns(count: int) -> int:
    """Columns of so many panels in a figure too narrow for panels beside each other, no higher than a page."""
    return 1 if count <= _BELOW else 2


def points(width: float) -> float:
    """A width [m] in points."""
    return width / _INCH * POINTS_PER_INCH


def new_figure(name: str, width: float, height: float) -> Figure:
    """An empty figure of a width and height [m], no higher than a page; screen readers read its name."""
    figure = Figure(figsize=(width / _INCH, min(height / _INCH, PAGE_HEIGHT / POINTS_PER_INCH)))
    figure.set_label(name)
    return figure


def panels(figure: Figure, count: int, columns: int, *, share_y: bool = False) -> list[Axes]:
    """That many panels in columns, row by row."""
    rows = -(-count // columns)
    axes: list[Axes] = []
    for i in range(count):
        axes.append(figure.add_subplot(rows, columns, i + 1, sharey=axes[0] if share_y and axes else None))
        if share_y and i % columns:
            axes[-1].tick_params(axis="y", labelleft=False)
    return axes


class FewTicks(MaxNLocator):
    """Ticks at round figures, at most so many intervals apart and none outside the axis.

    A good part of the time that a report takes is spent on its ticks.
    """

    def __init__(self, most: int = _TICKS, *, integer: bool = False) -> None:
        super().__init__(nbins=most, steps=[1, 2, 2.5, 5, 10], integer=integer)

    def __call__(self) -> list[float]:
        """Places of the ticks."""
        assert self.axis is not None
        low, high = sorted(float(end) for end in self.axis.get_view_interval())
        rounding = 1e-9 * (high - low)
        return [float(place) for place in super().__call__() if low - rounding <= place <= high + rounding]


def plain(text: str, longest: int = _LONGEST_NAME) -> str:
    """A text from a file, fit for a figure: one line without control characters, cut if it is too long."""
    shown = "".join(character if character.isprintable() else "?" for character in text)
    return shown if len(shown) <= longest else f"{shown[: longest - 1]}…"


def finish(
    figure: Figure,
    *,
    simulated: bool,
    also: Sequence[Artist] = (),
    first: Sequence[str] = (),
    room: Room = NO_ROOM,
) -> Figure:
    """Put one legend, with the entries `also`, below all panels, SIMULATED and the lines `first` above, and lay out."""
    entries: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, word in zip(*axes.get_legend_handles_labels(), strict=True):
            entries[word] = max(entries.get(word, handle), handle, key=_marked)
    entries |= {str(artist.get_label()): artist for artist in also}
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        if isinstance(axis.get_major_locator(), AutoLocator):
            axis.set_major_locator(FewTicks())
    lines = [*([SIMULATED] if simulated else []), *(plain(line, _LONGEST_LINE) for line in first)]
    box = {"facecolor": YELLOW, "edgecolor": "none", "boxstyle": "square,pad=0.15"}
    lay_out(figure, entries, lines, box, room)
    return figure


def _marked(handle: Any) -> bool:
    """True for a line with markers: a legend shows them, though some panels have the line alone."""
    return isinstance(handle, Line2D) and handle.get_marker() not in ("", "None", None)


def edges(axis: FloatArray) -> FloatArray:
    """Edges of the cells around ascending places, shape (n + 1,): midway, and as far beyond the outer ones [m]."""
    places = np.asarray(axis, dtype=np.float64)
    if places.size == 1:
        return np.array([places[0] - _ALONE / 2, places[0] + _ALONE / 2])
    inner = (places[1:] + places[:-1]) / 2
    return np.concatenate([[2 * places[0] - inner[0]], inner, [2 * places[-1] - inner[-1]]])


def colour_cells(axes: Axes, x: FloatArray, y: FloatArray, values: Any, label: str) -> Colorbar | None:
    """Draw masked values, shape (m, n), as colours of the cells between edges x, (n + 1,), and y, (m + 1,)."""
    axes.grid(visible=False)
    if not values.count():
        return None
    return colour_bar(axes, axes.pcolormesh(x, y, values, edgecolor="face", linewidth=0.1), label)


def colour_bar(axes: Axes, colours: ScalarMappable, label: str) -> Colorbar:
    """A bar of the colours beside a panel, which `finish` puts in its place."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    return figure.colorbar(colours, cax=figure.add_axes((0.0, 0.0, 1.0, 1.0)), label=label)


def hatch_cells(axes: Axes, x: FloatArray, y: FloatArray, chosen: Mask, look: Look) -> Patch:
    """Hatch the chosen cells, shape (n, m), between edges x, (n + 1,), and y, (m + 1,); returns the legend's entry."""
    for i, column in enumerate(chosen):
        runs = np.flatnonzero(np.diff(np.concatenate([[False], column, [False]]).astype(np.int8)))
        for start, stop in runs.reshape(-1, 2).tolist():  # cells on top of each other are one area
            corner = (float(x[i]), float(y[start]))
            axes.add_patch(Rectangle(corner, float(x[i + 1] - x[i]), float(y[stop] - y[start]), **look.area))
    return look.patch()
