"""forcemap planar-arm: the paper's planar arm."""

from __future__ import annotations

import math
from typing import Annotated

from typer import Option

import forcemap as fm
from forcemap.answers.planar_arm import PlanarArmAnswer, PlanarPlace
from forcemap.cli.options import Json, number
from forcemap.cli.output import emit, grid
from forcemap.cli.task_options import figures
from forcemap.dynamics.mass_map import planar_mass_map
from forcemap.dynamics.planar_arm import (
    INSPECTION_DISTANCES,
    INSPECTION_HEIGHTS,
    LINK_ALIGNED,
    LINK_DOWN,
    LINK_HORIZONTAL,
    LastLink,
    LinkMass,
    PlanarArm,
    Wrist,
)

_LINKS = {"aligned": LINK_ALIGNED, "horizontal": LINK_HORIZONTAL, "down": LINK_DOWN}


def planar_arm(
    link_mass: Annotated[
        LinkMass | None, Option("--link-mass", help="Where the mass of a link is; the paper does not say.")
    ] = None,
    last_link: Annotated[
        str | None, Option("--last-link", help="aligned with the link before, horizontal, down, or its angle [deg].")
    ] = None,
    wrist: Annotated[Wrist | None, Option("--wrist", help="Whether the last joint gives way in an impact.")] = None,
    base_height: Annotated[
        float | None, Option("--base-height-m", help="Height of the shoulder; that of the UR10e is 0.18.")
    ] = None,
    distances: Annotated[str | None, Option("--distances-m", help="Ascending; default: the paper's three.")] = None,
    heights: Annotated[str | None, Option("--heights-m", help="Ascending; default: the paper's three.")] = None,
    as_json: Json = False,
) -> None:
    """Show the effective mass of the paper's planar arm (section II-C) downwards, over places.

    What the paper does not state has no default; forcemap figure planar-postures draws six readings beside each other.

    Example: forcemap planar-arm --link-mass uniform_rod --last-link down --wrist locked --base-height-m 0.18
    """
    if link_mass is None or last_link is None or wrist is None or base_height is None:
        raise fm.InputError(
            "planar arm: expected --link-mass, --last-link, --wrist and --base-height-m; the paper states none of "
            "them, and each changes the result (docs/effective_mass.md)"
        )
    angle = number(last_link)
    if angle is None and last_link not in _LINKS:
        raise fm.InputError(f"last link: found {last_link!r}, expected {', '.join(_LINKS)}, or an angle in degrees")
    link = _LINKS[last_link] if angle is None else LastLink(math.radians(angle))
    arm = PlanarArm(link_mass=link_mass, last_link=link, wrist=wrist, base_height=base_height)
    over = planar_mass_map(
        arm,
        INSPECTION_DISTANCES if distances is None else figures("distances", distances),
        INSPECTION_HEIGHTS if heights is None else figures("heights", heights),
    )
    answer = PlanarArmAnswer.of_map(arm, over)
    lines = [
        f"effective mass in kg downwards, last link {link}, wrist {wrist}; . unreachable, ! singular or no motion",
        *grid({(place.distance_m, place.height_m): _cell(place) for place in answer.places}),
        f"with distance: {answer.trend_with_distance}; with height: {answer.trend_with_height}; "
        f"forces would vary by a factor of {over.force_ratio:.2f} if they followed sqrt(m_u)",
        f"the standard's, for every place: {answer.standard_effective_mass_kg:.1f} kg",
        "effective mass is no force: no safe speed follows from it",
    ]
    emit(answer, lines, as_json=as_json)


def _cell(place: PlanarPlace) -> str:
    if place.effective_mass_kg is not None:
        return f"{place.effective_mass_kg:.2f}"
    return "." if place.outcome == "unreachable" else "!"
