"""forcemap figure: every figure as a file, for a paper, a page or a slide."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

import forcemap as fm
from forcemap.cli.options import ContactKind, FormName, Json, MovingMass
from forcemap.cli.output import emit, verdict_first
from forcemap.cli.task_options import figures as numbers
from forcemap.errors import UnknownName
from forcemap.files import read_bytes, write_atomically

_BEGINS = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
"""Endings of names, and what a file of the kind begins with."""


_WIDTHS = {"column": 80.0, "page": 160.0, "slide": 240.0}
"""Widths with a name [mm]."""

_NARROWEST, _WIDEST_DRAWN, _WIDEST = 75.0, 160.0, 1000.0
"""Widths [mm]: letters have room from the first on, all grows with the figure beyond the second, and none is wider than
the third: choices, the first two as far as every kind was tried."""

_PAGE = 240
"""Height that a page holds [mm]."""

WidthOption = Annotated[
    str, Option("--width", help="column (80mm), page (160mm), slide (240mm, larger letters), or a width such as 85mm.")
]


def drawn_width(text: str) -> tuple[float, float]:
    """Width that a figure is drawn at [m], and how many times as large its file is.

    Raises
    ------
    InputError
        Neither a name nor a width in millimetres, or one at which letters have no room.
    """
    stated = re.fullmatch(r"([0-9]+(?:\.[0-9]+)?) ?mm", text)
    width = float(stated[1]) if stated else _WIDTHS.get(text, 0.0)
    if not _NARROWEST <= width <= _WIDEST:
        expected = f"expected {', '.join(_WIDTHS)}, or {_NARROWEST:g}mm to {_WIDEST:g}mm, such as 85mm"
        raise fm.InputError(f"width: found {text!r}, {expected}")
    return min(width, _WIDEST_DRAWN) / 1000, max(width / _WIDEST_DRAWN, 1.0)


def figure(
    kind: Annotated[
        str,
        Argument(
            metavar="KIND",
            help="grid, repeatability, profiles, heights, workspace, residuals, comparison, evolution, speeds, "
            "to-measure, path, planar-postures or planar-mass (docs/drawing.md).",
        ),
    ],
    source: Annotated[
        list[str] | None,
        Argument(
            metavar="SOURCE...",
            help="Campaign folder, impacts table, map file or published map; for evolution also FILE or "
            "FILE#CURVE of recordings; for heights, comparison and evolution several; for planar- none.",
        ),
    ] = None,
    output: Annotated[str | None, Option("-o", "--output", help="File to write: .png (300 dpi), .svg or .pdf.")] = None,
    width: WidthOption = "column",
    grey: Annotated[bool, Option("--grey", help="In grey, for print without colours.")] = False,
    area: Annotated[str | None, Option("--area", help="Body area or region that is hit.")] = None,
    contact: ContactKind = None,
    speeds: Annotated[str | None, Option("--speeds-mps", help="Speeds at contact to show, between commas.")] = None,
    distance: Annotated[float | None, Option("--distance", help="Distance to cut at [m].")] = None,
    height: Annotated[float | None, Option("--height", help="Height to cut at [m].")] = None,
    moving_mass: MovingMass = None,
    step: Annotated[float | None, Option("--step-m", help="Distance between places [m]; default 0.05.")] = None,
    path: Annotated[str | None, Option("--path", help="For path: the file of the path (CSV).")] = None,
    task: Annotated[str | None, Option("--task", help="For path: the task file.")] = None,
    form: FormName = None,
    as_json: Json = False,
) -> None:
    """Draw one figure of a campaign, a table or a map into a file.

    docs/drawing.md shows every kind, what it is drawn of and what it takes.

    Example: forcemap figure heights kuka-iiwa7-30nm -o heights.pdf
    """
    from forcemap import figures
    from forcemap.cli.drawings import Choices, Kind, Source, draw, left_out, unlike

    if kind not in [*Kind]:
        raise UnknownName("figure", kind, [each.value for each in Kind])
    target, (wide, larger) = figure_target(output), drawn_width(width)
    shown = None if speeds is None else tuple(numbers("speeds", speeds))
    cut: dict[str, Any] = {"speeds": shown, "distance": distance, "height": height}
    files: dict[str, Any] = {"path": path, "task": task, "form": form}
    choices = Choices(area=area, contact=contact, moving_mass=moving_mass, step=step, **cut, **files)
    said: list[str] = []
    drawn = draw(Kind(kind), sources := [Source(name, form) for name in source or []], choices, width=wide, said=said)
    write_atomically(target, figures.figure_file(figures.in_grey(drawn) if grey else drawn, target, larger=larger))
    size = [round(1000 * larger * side * 0.0254, 1) for side in drawn.get_size_inches().tolist()]
    differs, notes = unlike(Kind(kind), sources, choices), left_out(Kind(kind), sources, choices)
    if size[1] > larger * _PAGE:
        notes.append(f"higher than a page holds ({_PAGE} mm): take a wider --width, or show less at once")
    answer = {"file": str(target), "kind": kind, "width_mm": size[0], "height_mm": size[1], "grey": grey}
    answer |= {name: lines for name, lines in (("differs", differs), ("warnings", said), ("notes", notes)) if lines}
    verdict = f"{target}: {kind}, {size[0]:g} x {size[1]:g} mm{', in grey' * grey}"
    emit(answer, [*verdict_first(verdict, said), *differs, *notes], as_json=as_json)


def figure_target(output: str | None) -> Path:
    """The file to write; an existing one is replaced only if it is a picture of the same kind.

    Raises
    ------
    InputError
        No name, another ending, or another file of that name.
    """
    if output is None:
        raise fm.InputError("output: expected -o FILE, a name that ends in .png, .svg or .pdf")
    target = Path(output)
    begins = _BEGINS.get(target.suffix.lower())
    if begins is None:
        raise fm.InputError(f"found a name that ends otherwise, expected {', '.join(_BEGINS)}", file=output)
    if target.exists() and not read_bytes(target).startswith(begins):
        raise fm.InputError("this is another file, no picture; it is not overwritten, choose another name", file=output)
    return target
