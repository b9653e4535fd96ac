"""The measured map beside the 2D map and the standard's contact model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.comparisons.force_models import Comparison
from forcemap.figures.canvas import finish, in_our_settings, is_wide, new_figure, panels
from forcemap.figures.measured import Measured, draw_forces, levels, middle, near
from forcemap.figures.style import (
    BOUND,
    DISTANCE,
    FORCE,
    HEIGHT,
    MAP_2D,
    MAP_2D_PER_HEIGHT,
    PAGE_WIDTH,
    PREDICTION,
    STANDARD,
    Look,
)
from forcemap.limits.pfl import pfl_contact_force
from forcemap.maps.force_map import ForceMap

_AXES = (DISTANCE, HEIGHT)
_LOOKS = {"CFM_2D": MAP_2D, "CFM_2D per height": MAP_2D_PER_HEIGHT, "contact model": STANDARD}


@in_our_settings
def model_comparison_figure(
    comparison: Comparison,
    dataset: ImpactDataset,
    force_map: ForceMap,
    *,
    maps_2d: Sequence[ForceMap] = (),
    robot_mass: float,
    body_mass: float,
    stiffness: float,
    speed: float | None = None,
    height: float | None = None,
    distance: float | None = None,
    width: float = PAGE_WIDTH,
) -> Figure:
    """Force at one speed by the map, the 2D map and the standard, with measured states and the errors of each.

    Force against distance at one height and against height at one distance (paper, section V-C), and how far each
    model is from the measured states.

    Parameters
    ----------
    comparison : Comparison
        The models compared; its bound is drawn.
    dataset : ImpactDataset
        The impacts that were compared.
    force_map : ForceMap
        The measured map.
    maps_2d : sequence of ForceMap
        Maps of form CFM_2D: one for all heights, or one for each height.
    robot_mass, body_mass, stiffness : float
        Of the contact model, as for `compare_force_models` [kg], [kg], [N/m].
    speed, height, distance : float, optional
        Where to cut [m/s], [m], [m]; the middle measured ones if not given.
    width : float
        Width of the figure [m].

    Raises
    ------
    BoundNotAvailable
        The map cannot carry the bound of the comparison.
    """
    measured, place = Measured.of_dataset(dataset), dataset.tolerance.place
    if speed is None:
        speed = middle(levels(force_map.measured_range.points[:, 2], dataset.tolerance.speed))
    states = dataset.states.select(near(dataset.states.speed, speed, dataset.tolerance.speed))
    states = states if len(states) else dataset.states
    held = {
        0: middle(levels(states.distance, place)) if distance is None else distance,
        1: middle(levels(states.height, place)) if height is None else height,
    }
    standard = float(pfl_contact_force(speed, robot_mass=robot_mass, body_mass=body_mass, stiffness=stiffness))

    wide = is_wide(width)
    figure = new_figure("Force by the map, the 2D map and the standard", width, 0.075 if wide else 0.175)
    against_distance, against_height, errors = panels(figure, 3, 3 if wide else 1)
    for along, axes in enumerate((against_distance, against_height)):
        other = 1 - along
        low, high = force_map.measured_range.lowest[along], force_map.measured_range.highest[along]
        x = np.linspace(low, high, 81)
        state = [x if i == along else np.full(x.size, held[i]) for i in (0, 1)] + [np.full(x.size, speed)]
        inside = force_map.measured_range.contains(*state)
        axes.plot(x, np.where(inside, force_map.predict(*state), np.nan), **PREDICTION.drawn)
        axes.plot(x, np.where(inside, comparison.bound.upper(force_map, *state), np.nan), **BOUND.drawn)
        _draw_2d(axes, maps_2d, along, held, speed, place, x)
        axes.plot([low, high], [standard, standard], **STANDARD.drawn)
        for look, each in measured.by_look:
            here = near(each.speed, speed, dataset.tolerance.speed)
            here &= near(each.coordinates[:, other], held[other], place)
            some = each.select(here)
            draw_forces(axes, look, some, some.coordinates[:, along], some.force, some.at_least)
        words = f"height {held[1]:.2f} m" if along == 0 else f"distance {held[0]:.2f} m"
        axes.set(xlabel=_AXES[along], ylabel=FORCE, title=f"{words}\nspeed {speed:.2f} m/s")
        axes.margins(y=0.12)
        axes.set_ylim(bottom=0)
    _draw_errors(errors, comparison)
    return finish(figure, simulated=dataset.simulated or force_map.simulated, columns=3 if wide else 1)


def _draw_2d(
    axes: Axes,
    maps_2d: Sequence[ForceMap],
    along: int,
    held: dict[int, float],
    speed: float,
    tolerance: float,
    x: FloatArray,
) -> None:
    """Maps for all heights as lines; those of one height at their own height alone."""
    own: list[tuple[float, float]] = []
    for each in maps_2d:
        low, high = each.measured_range.lowest[1], each.measured_range.highest[1]
        one_height = high - low <= tolerance
        if not one_height:
            distances = x if along == 0 else np.full(x.size, held[0])
            axes.plot(x, each.predict(distances, 0.0, speed), **MAP_2D.drawn)
        elif along == 1:
            own.append(((low + high) / 2, float(each.predict(held[0], 0.0, speed))))
        elif low - tolerance <= held[1] <= high + tolerance:
            axes.plot(x, each.predict(x, 0.0, speed), **(MAP_2D_PER_HEIGHT.drawn | {"marker": ""}))
    if own:
        axes.plot(*zip(*sorted(own), strict=True), **MAP_2D_PER_HEIGHT.drawn)


def _draw_errors(axes: Axes, comparison: Comparison) -> None:
    """Largest and mean errors of each model in percent of measured; underestimation to the right, hatched."""
    for row, model in enumerate(comparison.models):
        look, accuracy = _LOOKS.get(model.model, PREDICTION), model.accuracy
        over: dict[str, Any] = {"color": look.colour, "edgecolor": "#303030", "linewidth": 0.5, "height": 0.55}
        axes.barh(row, -accuracy.max_overestimation_percent, alpha=0.45, **over)
        axes.barh(row, accuracy.max_underestimation_percent, hatch="//////", **over)
        for mean in (-accuracy.mean_overestimation_percent, accuracy.mean_underestimation_percent):
            axes.plot([mean, mean], [row - 0.27, row + 0.27], color="#000000", linewidth=1.2)
    axes.axvline(0, color="#404040", linewidth=0.7)
    axes.set_yticks(range(len(comparison.models)), [_words(model.model) for model in comparison.models])
    axes.invert_yaxis()
    axes.margins(x=0.1)
    axes.set(xlabel="Measured − predicted\n[% of measured]", title=f"{comparison.on}\nhatched: underestimated")


def _words(model: str) -> str:
    look: Look = _LOOKS.get(model, PREDICTION)
    return {MAP_2D_PER_HEIGHT.words: "2D map of\neach height", STANDARD.words: "standard"}.get(look.words, look.words)
