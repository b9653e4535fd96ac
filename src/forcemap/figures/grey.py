"""Figures in grey, as a printer without colours draws them: every colour becomes the grey of its brightness."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.cm import ScalarMappable
from matplotlib.collections import Collection
from matplotlib.colors import ListedColormap, to_rgba_array
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

_BRIGHTNESS = (0.299, 0.587, 0.114)
"""Share of red, green and blue in brightness (ITU-R BT.601), as printers and pictures without colour take it."""

_SHADES = 256

_COLOURS: dict[type[Artist], tuple[str, ...]] = {
    Line2D: ("color", "markerfacecolor", "markeredgecolor"),
    Patch: ("facecolor", "edgecolor"),
    Collection: ("facecolor", "edgecolor"),
    Text: ("color",),
}


def in_grey(figure: Figure) -> Figure:
    """The same figure, changed to greys."""
    for artist in figure.findobj():
        if isinstance(artist, ScalarMappable) and artist.get_array() is not None:
            artist.set_cmap(_grey_map(artist.get_cmap()))
            continue
        box = artist.get_bbox_patch() if isinstance(artist, Text) else None
        for part in (artist, *([box] if box is not None else [])):
            for name in next((names for kind, names in _COLOURS.items() if isinstance(part, kind)), ()):
                _make_grey(part, name)
    return figure


def _make_grey(artist: Any, name: str) -> None:
    # faces in space are sorted by their depth: their colours are those before that
    colour = getattr(artist, f"_{name}3d") if hasattr(artist, f"_{name}3d") else getattr(artist, f"get_{name}")()
    if isinstance(colour, str) and colour.lower() in ("none", "auto", "face"):
        return
    greys = _greys(to_rgba_array(colour))
    if not len(greys):
        return
    getattr(artist, f"set_{name}")(greys if isinstance(artist, Collection) else tuple(greys[0].tolist()))


def _greys(colours: Any) -> Any:
    """Greys of colours with their transparency, shape (n, 4)."""
    brightness = np.clip(colours[:, :3] @ np.array(_BRIGHTNESS), 0.0, 1.0)
    return np.column_stack([brightness, brightness, brightness, colours[:, 3]])


def _grey_map(colours: Any) -> ListedColormap:
    chosen = matplotlib.colormaps[colours] if isinstance(colours, str) else colours
    return ListedColormap(_greys(chosen(np.linspace(0.0, 1.0, _SHADES))))
