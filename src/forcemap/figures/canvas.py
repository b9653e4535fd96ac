"""What all figures share: settings, size, panels, cells, legend, SIMULATED, SVG and PNG."""

from __future__ import annotations

import io
import re
import threading
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from html import escape
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Patch, Rectangle
from matplotlib.textpath import text_to_path

from forcemap.arrays import FloatArray, Mask
from forcemap.errors import InputError
from forcemap.figures.style import COLUMN_WIDTH, PAGE_WIDTH, YELLOW, Look

SIMULATED = "SIMULATED: not a measurement of any robot"
_ALONE = 0.05  # width at which a single place is drawn [m]
_LONGEST_NAME = 60  # characters of a name from a file
_LONGEST_LINE = 400  # characters of a line above a figure
_NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))
_INCH = 0.0254  # [m]
_POINTS_PER_INCH = 72
_MARGIN = 0.02  # left and right of the lines above a figure, as a share of its width
_NARROWER = 0.92  # these lines are broken as for a narrower figure: letters are wider where pixels are few

# matplotlib's settings belong to the whole process: one figure at a time, and they are put back.
_SETTINGS = threading.RLock()
_STYLE = matplotlib.rc_params_from_file(Path(__file__).with_name("forcemap.mplstyle"), use_default_template=False)


@contextmanager
def settings() -> Iterator[None]:
    """matplotlib's settings for our figures, whatever those of the user; one thread at a time. Also a decorator."""
    with _SETTINGS, matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE)
        with warnings.catch_warnings():  # SVG keeps a name in another script as text; PNG shows boxes
            warnings.filterwarnings("ignore", message="Glyph .* missing from font", category=UserWarning)
            yield


def is_wide(width: float) -> bool:
    """True if panels of a figure of that width [m] fit beside each other."""
    return width > (COLUMN_WIDTH + PAGE_WIDTH) / 2


def new_figure(name: str, width: float, height: float) -> Figure:
    """An empty figure of a width and height [m]; screen readers read its name."""
    figure = Figure(figsize=(width / _INCH, height / _INCH))
    figure.set_label(name)
    return figure


def panels(figure: Figure, count: int, columns: int, *, share_y: bool = False) -> list[Axes]:
    """That many panels in columns, row by row."""
    rows = -(-count // columns)
    axes: list[Axes] = []
    for i in range(count):
        axes.append(figure.add_subplot(rows, columns, i + 1, sharey=axes[0] if share_y and axes else None))
        axes[-1].tick_params(labelleft=not share_y or i % columns == 0)
    return axes


def plain(text: str, longest: int = _LONGEST_NAME) -> str:
    """A text from a file, fit for a figure: one line without control characters, cut if it is too long."""
    shown = "".join(character if character.isprintable() else "?" for character in text)
    return shown if len(shown) <= longest else f"{shown[: longest - 1]}…"


def finish(
    figure: Figure, *, simulated: bool, columns: int, also: Sequence[Artist] = (), first: Sequence[str] = ()
) -> Figure:
    """Put one legend, with the entries `also`, below all panels, and SIMULATED and the lines `first` above them."""
    entries: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, word in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(word, handle)
    entries |= {str(artist.get_label()): artist for artist in also}
    if entries:
        figure.legend(list(entries.values()), list(entries), loc="outside lower left", ncols=columns)
    lines = [*([SIMULATED] if simulated else []), *(plain(line, _LONGEST_LINE) for line in first)]
    if lines:
        font = FontProperties(size=7.5, weight="bold")
        across = (_NARROWER - 2 * _MARGIN) * _POINTS_PER_INCH * figure.get_figwidth()
        said = "\n".join(line for words in lines for line in _broken(words, font, across))
        box = {"facecolor": YELLOW, "edgecolor": "none", "boxstyle": "square,pad=0.15"}
        figure.suptitle(said, x=_MARGIN, ha="left", fontproperties=font, bbox=box)
    return figure


def _broken(text: str, font: FontProperties, across: float) -> Iterator[str]:
    """A text broken into lines no wider than `across` [pt]; a longer word has a line of its own."""
    line = ""
    for word in text.split():
        longer = f"{line} {word}".lstrip()
        if line and text_to_path.get_text_width_height_descent(longer, font, False)[0] > across:
            yield line
            longer = word
        line = longer
    yield line


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
    mesh = axes.pcolormesh(x, y, values, edgecolor="face", linewidth=0.1)
    return axes.figure.colorbar(mesh, ax=axes, label=label)


def hatch_cells(axes: Axes, x: FloatArray, y: FloatArray, chosen: Mask, look: Look) -> Patch:
    """Hatch the chosen cells, shape (n, m), between edges x, (n + 1,), and y, (m + 1,); returns the legend's entry."""
    for i, column in enumerate(chosen):
        runs = np.flatnonzero(np.diff(np.concatenate([[False], column, [False]]).astype(np.int8)))
        for start, stop in runs.reshape(-1, 2).tolist():  # cells on top of each other are one area
            corner = (float(x[i]), float(y[start]))
            axes.add_patch(Rectangle(corner, float(x[i + 1] - x[i]), float(y[stop] - y[start]), **look.area))
    return look.patch()


def svg(figure: Figure, prefix: str = "figure") -> str:
    """A figure as one self-contained <svg> element, the same to the byte for the same figure.

    Text stays text in a generic font, nothing is referenced, and there is neither a style sheet nor a style
    attribute, which a content security policy may forbid.

    Parameters
    ----------
    figure : Figure
        The figure.
    prefix : str
        Put before every id, so that several figures can stand in one page: letters, digits, hyphens, underscores.

    Raises
    ------
    InputError
        A prefix that cannot begin an id.
    """
    if not re.fullmatch(r"[A-Za-z][\w-]*", prefix, re.ASCII):
        raise InputError(f"prefix: found {prefix!r}, expected a letter, then letters, digits, hyphens, underscores")
    stream = io.StringIO()
    with settings(), _laid_out(figure):
        figure.savefig(stream, format="svg", metadata=_NO_METADATA)
    text = re.sub(r"<style.*?</style>\s*", "", stream.getvalue().partition("<svg")[2], flags=re.DOTALL)
    name = escape(str(figure.get_label()), quote=True)
    root = f'<svg role="img" aria-label="{name}" stroke-linejoin="round" stroke-linecap="butt"'
    text = re.sub(r'\bid="', f'id="{prefix}-', root + text)
    text = re.sub(r'(href="#|url\(#)', rf"\1{prefix}-", text)
    return re.sub(r' style="([^"]*)"', lambda match: _attributes(match[1]), text)


@contextmanager
def _laid_out(figure: Figure) -> Iterator[None]:
    """The panels in their places: `savefig` by itself draws the whole figure to nowhere for that, and then again."""
    if (engine := figure.get_layout_engine()) is None:
        yield
        return
    FigureCanvasSVG(figure)  # text is as wide as in the file
    engine.execute(figure)
    figure.set_layout_engine("none")
    try:
        yield
    finally:
        figure.set_layout_engine(engine)


def png(figure: Figure, dpi: float = 150) -> bytes:
    """A figure as a PNG picture, the same to the byte for the same figure.

    Parameters
    ----------
    figure : Figure
        The figure.
    dpi : float
        Dots per inch.
    """
    stream = io.BytesIO()
    with settings():
        figure.savefig(stream, format="png", dpi=dpi, metadata={"Software": None})
    return stream.getvalue()


def _attributes(style: str) -> str:
    """The declarations of a style attribute as single attributes; the shorthand `font` stays a style."""
    declarations = [declaration.partition(":") for declaration in style.split(";") if declaration.strip()]
    apart = {name.strip(): value.strip() for name, _, value in declarations}
    font = apart.pop("font", "")
    shorthand = f' style="font: {font}"' if font else ""
    return shorthand + "".join(f' {name}="{value}"' for name, value in apart.items())
