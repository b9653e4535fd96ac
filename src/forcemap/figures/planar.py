"""The paper's planar arm: effective mass at the inspection points and over the plane."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from forcemap.dynamics.mass_map import MassMap
from forcemap.dynamics.planar_arm import PlanarArm, planar_inverse_kinematics
from forcemap.errors import InputError
from forcemap.figures import canvas, style
from forcemap.figures.layout import Room
from forcemap.figures.style import DISTANCE, HEIGHT, MASS, PAGE_WIDTH

_GAP = 0.6  # between the groups of heights, as a share of the distance between their places
_CONTOURS = 6


@canvas.settings()
def planar_inspection_figure(
    variants: Mapping[str, MassMap], *, arm: PlanarArm | None = None, width: float = PAGE_WIDTH
) -> Figure:
    """Effective mass at a few places for variants of an arm (paper, section II-C).

    Parameters
    ----------
    variants : mapping of str to MassMap
        Name of each variant and its masses, all at the same places: `planar_mass_map(arm, INSPECTION_DISTANCES,
        INSPECTION_HEIGHTS)`.
    arm : PlanarArm, optional
        The arm of the first variant, to draw its postures.
    width : float
        Width of the figure [m].

    Raises
    ------
    InputError
        No variant, more than seven, or variants at different places.
    """
    if not 1 <= len(variants) <= len(style.VARIANTS):
        raise InputError(f"found {len(variants)} variants of the arm, expected 1 to {len(style.VARIANTS)}")
    first = next(iter(variants.values()))
    for name, mass_map in variants.items():
        if not (
            np.array_equal(mass_map.distances, first.distances) and np.array_equal(mass_map.heights, first.heights)
        ):
            raise InputError(f"variant {name!r} is of other places than the first, expected the same for all")
    wide = canvas.is_wide(width)
    figure = canvas.new_figure("Effective mass at inspection points", width, 0.075 if wide else 0.15)
    postures, masses = canvas.panels(figure, 2, 2 if wide else 1)
    _draw_postures(postures, first, arm)
    postures.set_title(canvas.plain(next(iter(variants))))
    count = first.distances.size
    x = np.arange(first.heights.size)[:, None] * (count + _GAP) + np.arange(count)  # a group for each height
    for look, (name, mass_map) in zip(style.VARIANTS, variants.items(), strict=False):
        for row, mass in zip(x, mass_map.mass.value.T, strict=True):
            look.plot(masses, row, mass, canvas.plain(name), markeredgewidth=1.0)
    masses.set_xticks(x.ravel(), [f"{distance:.2f}" for distance in first.distances] * len(x), rotation=90)
    beneath = masses.get_xaxis_transform()
    for row, height in zip(x, first.heights, strict=True):
        masses.text(row.mean(), 1.0, f"h = {height:.2f} m", transform=beneath, ha="center", va="bottom")
    masses.set(xlabel=DISTANCE, ylabel=MASS)
    masses.margins(y=0.1)
    masses.set_ylim(bottom=0)
    return canvas.finish(figure, simulated=False, room=Room(above=10.0))


@canvas.settings()
def planar_mass_figure(mass_map: MassMap, *, title: str = "", width: float = PAGE_WIDTH) -> Figure:
    """Effective mass over distance and height, dense (paper, section II-C); also of a robot.

    Parameters
    ----------
    mass_map : MassMap
        The masses.
    title : str
        Whose they are, written above.
    width : float
        Width of the figure [m].
    """
    figure = canvas.new_figure("Effective mass over distance and height", width, 0.7 * width)
    axes = figure.add_subplot()
    mass = np.ma.masked_invalid(mass_map.mass.value.T)
    x, y = canvas.edges(mass_map.distances), canvas.edges(mass_map.heights)
    canvas.colour_cells(axes, x, y, mass, MASS)
    if mass.count() and min(mass.shape) > 1 and np.ptp(mass.compressed()) > 0:
        lines = axes.contour(
            mass_map.distances, mass_map.heights, mass, levels=_CONTOURS, colors="white", linewidths=0.8
        )
        axes.clabel(lines, fmt="%g", fontsize=6.5)
    chosen = {outcome: mass_map.mass.outcome == outcome for outcome in style.MASSES}
    legend = [
        canvas.hatch_cells(axes, x, y, here, style.MASSES[outcome]) for outcome, here in chosen.items() if here.any()
    ]
    axes.set(xlabel=DISTANCE, ylabel=HEIGHT, title=canvas.plain(title))
    axes.set_aspect("equal")
    return canvas.finish(figure, simulated=False, also=legend)


def _draw_postures(axes: Axes, places: MassMap, arm: PlanarArm | None) -> None:
    """The arm at each place, and the mass there in words."""
    for i, distance in enumerate(places.distances):
        for j, height in enumerate(places.heights):
            value = float(places.mass.value[i, j])
            if arm is not None and np.isfinite(value):
                angles = np.cumsum(planar_inverse_kinematics(arm, distance, height).positions)
                x = np.concatenate([[0.0], np.cumsum(arm.lengths * np.cos(angles))])
                z = arm.base_height + np.concatenate([[0.0], np.cumsum(arm.lengths * np.sin(angles))])
                axes.plot(x, z, color=style.GREY, linewidth=0.7, marker=".", markersize=3)
            axes.plot(distance, height, color=style.BLACK, marker="D", markersize=3.5)
            words = f"{value:.1f} kg" if np.isfinite(value) else str(places.mass.outcome[i, j]).replace("_", " ")
            axes.annotate(words, (distance, height), (0, -10), textcoords="offset points", fontsize=6.5, ha="center")
    axes.set(xlabel=DISTANCE, ylabel=HEIGHT)
    axes.margins(0.12)
    axes.set_aspect("equal", adjustable="datalim")
