"""What every figure starts from and ends with: its size, its settings, its legend, the word SIMULATED."""

from __future__ import annotations

import functools
import textwrap
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

import matplotlib
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from forcemap.figures.style import COLUMN_WIDTH, PAGE_WIDTH, RC, YELLOW

P = ParamSpec("P")
R = TypeVar("R")

_SIGNS_PER_INCH = 15  # of bold letters of 7.5 points
SIMULATED = "SIMULATED: not a measurement of any robot"

_INCH = 0.0254
# matplotlib's settings belong to the whole process: one figure at a time, and they are put back.
_SETTINGS = threading.RLock()


@contextmanager
def settings() -> Iterator[None]:
    """matplotlib's settings for our figures, whatever those of the user; one thread at a time."""
    with _SETTINGS, matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(RC)
        with warnings.catch_warnings():  # SVG keeps a name in another script as text; PNG shows boxes
            warnings.filterwarnings("ignore", message="Glyph .* missing from font", category=UserWarning)
            yield


def in_our_settings(function: Callable[P, R]) -> Callable[P, R]:
    """The function, run in our settings."""

    @functools.wraps(function)
    def within(*args: P.args, **kwargs: P.kwargs) -> R:
        with settings():
            return function(*args, **kwargs)

    return within


def is_wide(width: float) -> bool:
    """True if panels of a figure of that width [m] fit beside each other."""
    return width > (COLUMN_WIDTH + PAGE_WIDTH) / 2


def new_figure(name: str, width: float, height: float) -> Figure:
    """An empty figure of a width and height [m]; its name is what is read out in place of it."""
    figure = Figure(figsize=(width / _INCH, height / _INCH))
    figure.set_label(name)
    return figure


def panels(figure: Figure, count: int, columns: int, *, share_y: bool = False) -> list[Axes]:
    """That many panels in columns, row by row."""
    rows = -(-count // columns)
    axes: list[Axes] = []
    for i in range(count):
        axes.append(figure.add_subplot(rows, columns, i + 1, sharey=axes[0] if share_y and axes else None))
    if share_y:
        for i, each in enumerate(axes):
            each.tick_params(labelleft=i % columns == 0)
    return axes


def plain(text: str, longest: int = 60) -> str:
    """A name from a file as it can stand in a figure: one line without control characters, not too long."""
    shown = "".join(each if each.isprintable() else "?" for each in text)
    return shown if len(shown) <= longest else f"{shown[: longest - 1]}…"


def finish(
    figure: Figure, *, simulated: bool, columns: int, also: Sequence[Artist] = (), first: Sequence[str] = ()
) -> Figure:
    """Put one legend for all panels beneath them, `also` entries included; above SIMULATED and what is said `first`."""
    entries: dict[str, Any] = {}
    for axes in figure.axes:
        handles, words = axes.get_legend_handles_labels()
        for handle, word in zip(handles, words, strict=True):
            entries.setdefault(word, handle)
    entries |= {str(each.get_label()): each for each in also}
    if entries:
        figure.legend(list(entries.values()), list(entries), loc="outside lower left", ncols=columns)
    lines = [*([SIMULATED] if simulated else []), *(plain(each, 400) for each in first)]
    if lines:
        across = int(_SIGNS_PER_INCH * figure.get_figwidth())
        said = "\n".join(line for each in lines for line in textwrap.wrap(each, across))
        box = {"facecolor": YELLOW, "edgecolor": "none", "boxstyle": "square,pad=0.15"}
        figure.suptitle(said, x=0.02, ha="left", fontsize=7.5, fontweight="bold", bbox=box)
    return figure
