"""Figures as files: SVG, PNG and PDF, the same to the byte for the same figure; in grey; at the width of a slide."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import Any

from matplotlib.backends import backend_mixed, backend_pdf
from matplotlib.figure import Figure

from forcemap.errors import InputError
from forcemap.figures.canvas import settings
from forcemap.figures.layout import POINTS_PER_INCH

PRINTED = 300.0
"""Dots per inch of a picture for print: what journals ask for."""

_PDF: Any = backend_pdf  # without types
_MIXED: Any = backend_mixed
_NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))
_NO_PDF_METADATA = {"Creator": None, "Producer": None, "CreationDate": None}


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
    with settings():
        figure.savefig(stream, format="svg", metadata=_NO_METADATA)
    text = re.sub(r"<style.*?</style>\s*", "", stream.getvalue().partition("<svg")[2], flags=re.DOTALL)
    name = escape(str(figure.get_label()), quote=True)
    root = f'<svg role="img" aria-label="{name}" stroke-linejoin="round" stroke-linecap="butt"'
    text = re.sub(r'\bid="', f'id="{prefix}-', root + text)
    text = re.sub(r'(href="#|url\(#)', rf"\1{prefix}-", text)
    return re.sub(r' style="([^"]*)"', lambda match: _attributes(match[1]), text)


def png(figure: Figure, dpi: float = 150, *, larger: float = 1.0) -> bytes:
    """A figure as a PNG picture, the same to the byte for the same figure.

    Parameters
    ----------
    figure : Figure
        The figure.
    dpi : float
        Dots per inch, as the file states them.
    larger : float
        How many times as large as the figure the picture is, its letters and lines too.
    """
    stream = io.BytesIO()
    with settings():
        stated = {"dpi": (dpi, dpi)}
        figure.savefig(stream, format="png", dpi=dpi * larger, metadata={"Software": None}, pil_kwargs=stated)
    return stream.getvalue()


def pdf(figure: Figure, *, larger: float = 1.0) -> bytes:
    """A figure as a PDF of one page, its letters embedded; the same to the byte for the same figure.

    Parameters
    ----------
    figure : Figure
        The figure.
    larger : float
        How many times as large as the figure the page is, its letters and lines too.
    """
    stream = io.BytesIO()
    with settings():
        backend_pdf.FigureCanvasPdf(figure)
        figure.dpi = POINTS_PER_INCH
        wide, tall = figure.get_size_inches().tolist()
        file = _PDF.PdfFile(stream, metadata=_NO_PDF_METADATA)
        file.newPage(wide * larger, tall * larger)
        file.output(larger, 0, 0, larger, 0, 0, backend_pdf.Op.concat_matrix)
        points = _PDF.RendererPdf(file, POINTS_PER_INCH, tall, wide)
        renderer = _MIXED.MixedModeRenderer(figure, wide, tall, POINTS_PER_INCH, points)
        figure.draw(renderer)
        renderer.finalize()
        file.finalize()
        file.close()
    return stream.getvalue()


def svg_file(figure: Figure, *, larger: float = 1.0) -> bytes:
    """A figure as a file of its own; arguments as `pdf`."""
    drawing = svg(figure)
    for name in ("width", "height"):
        size = rf'(<svg[^>]* {name}=")([\d.]+)pt"'
        drawing = re.sub(size, lambda found: f'{found[1]}{float(found[2]) * larger:g}pt"', drawing, count=1)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{drawing}'.encode()


def figure_file(figure: Figure, name: str | Path, *, larger: float = 1.0) -> bytes:
    """A figure as the kind of file that a name ends with: .png (300 dpi), .svg or .pdf.

    Raises
    ------
    InputError
        The name ends otherwise.
    """
    kinds: dict[str, Callable[[], bytes]] = {
        ".png": lambda: png(figure, PRINTED, larger=larger),
        ".svg": lambda: svg_file(figure, larger=larger),
        ".pdf": lambda: pdf(figure, larger=larger),
    }
    if (kind := Path(name).suffix.lower()) not in kinds:
        raise InputError(f"found a name that ends in {kind or 'nothing'}, expected {', '.join(kinds)}", file=str(name))
    return kinds[kind]()


def _attributes(style: str) -> str:
    """The declarations of a style attribute as single attributes; the shorthand `font` stays a style."""
    declarations = [declaration.partition(":") for declaration in style.split(";") if declaration.strip()]
    apart = {name.strip(): value.strip() for name, _, value in declarations}
    font = apart.pop("font", "")
    shorthand = f' style="font: {font}"' if font else ""
    return shorthand + "".join(f' {name}="{value}"' for name, value in apart.items())
