"""Figures as text and bytes."""

from __future__ import annotations

import io
import re
from html import escape

from matplotlib.figure import Figure

from forcemap.errors import InputError
from forcemap.figures.canvas import settings

_NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))


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
        A prefix that makes no id.
    """
    if not re.fullmatch(r"[A-Za-z][\w-]*", prefix, re.ASCII):
        raise InputError(f"prefix: found {prefix!r}, expected a letter, then letters, digits, hyphens, underscores")
    stream = io.StringIO()
    with settings():
        figure.savefig(stream, format="svg", metadata=_NO_METADATA)
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<style.*?</style>\s*", "", text, flags=re.DOTALL)
    name = escape(str(figure.get_label()), quote=True)
    root = f'<svg role="img" aria-label="{name}" stroke-linejoin="round" stroke-linecap="butt"'
    text = root + text.removeprefix("<svg")
    text = re.sub(r'\bid="', f'id="{prefix}-', text)
    text = re.sub(r'(href="#|url\(#)', rf"\1{prefix}-", text)
    return re.sub(r' style="([^"]*)"', lambda found: _attributes(found[1]), text)


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
    """The declarations of a style attribute as attributes of their own; the shorthand `font` is none."""
    declarations = [each.partition(":") for each in style.split(";") if each.strip()]
    apart = {name.strip(): value.strip() for name, _, value in declarations}
    font = apart.pop("font", "")
    shorthand = f' style="font: {font}"' if font else ""
    return shorthand + "".join(f' {name}="{value}"' for name, value in apart.items())
