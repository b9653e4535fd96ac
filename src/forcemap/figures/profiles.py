"""Force against distance, height and speed."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from forcemap.campaigns.dataset import ImpactDataset
from forcemap.figures.canvas import finish, in_our_settings, is_wide, new_figure, panels
from forcemap.figures.measured import Measured, a_few, draw_forces, levels, middle, near
from forcemap.figures.style import BOUND, DISTANCE, FORCE, HEIGHT, PAGE_WIDTH, PREDICTION, SPEED
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap

_AXES = (DISTANCE, HEIGHT, SPEED)
_WORDS = ("distance {:.2f} m", "height {:.2f} m", "speed {:.2f} m/s")
_SHORT = ("{:.2f} m", "{:.2f} m", "{:.2f} m/s")


@in_our_settings
def force_profiles_figure(
    force_map: ForceMap, dataset: ImpactDataset | None = None, *, bound: Bound | None = None, width: float = PAGE_WIDTH
) -> Figure:
    """Force against distance, height and speed, the other variables held at measured values.

    Lines are drawn for the lowest, middle and highest measured speed (against speed: distance), each with its value
    at its end, and end where the measured range ends.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    dataset : ImpactDataset, optional
        Measured states to show; those of a fitted map if not given.
    bound : Bound, optional
        Bound to draw dashed.
    width : float
        Width of the figure [m].

    Raises
    ------
    BoundNotAvailable
        The map cannot carry the bound.
    """
    if bound is not None:
        bound.require(force_map)
    measured = Measured.of(force_map, dataset)
    tolerances = (measured.tolerance.place, measured.tolerance.place, measured.tolerance.speed)
    points = force_map.measured_range.points.T
    axis_levels = [levels(values, tolerance) for values, tolerance in zip(points, tolerances, strict=True)]

    wide = is_wide(width)
    figure = new_figure("Force against distance, height and speed", width, 0.068 if wide else 0.16)
    for along, axes in enumerate(panels(figure, 3, 3 if wide else 1, share_y=wide)):
        by = 0 if along == 2 else 2  # the variable that differs from line to line
        held = 3 - along - by
        at = middle(axis_levels[held])
        for value in a_few(axis_levels[by]):
            fixed = {by: value, held: at}
            _draw_line(axes, force_map, bound, along, fixed, _SHORT[by].format(value))
            for look, states in measured.by_look:
                coordinates = states.coordinates.T
                chosen = near(coordinates[by], value, tolerances[by]) & near(coordinates[held], at, tolerances[held])
                some = states.select(chosen)
                draw_forces(axes, look, some, some.coordinates[:, along], some.force, some.at_least)
        axes.set(xlabel=_AXES[along], title=f"{_WORDS[held].format(at)}\nlines: {_WORDS[by].split()[0]}")
        axes.margins(y=0.12)
        axes.set_ylim(bottom=0)
        if axes.get_subplotspec().is_first_col():  # type: ignore[union-attr]
            axes.set_ylabel(FORCE)
    return finish(figure, simulated=_simulated(force_map, dataset), columns=3 if wide else 1)


def _draw_line(
    axes: Axes, force_map: ForceMap, bound: Bound | None, along: int, fixed: dict[int, float], words: str
) -> None:
    """Prediction and bound along one axis, as far as the measured range reaches."""
    low, high = force_map.measured_range.lowest[along], force_map.measured_range.highest[along]
    x = np.linspace(low, high, 81)
    state = [x if i == along else np.full(x.size, fixed[i]) for i in range(3)]
    inside = force_map.measured_range.contains(*state)
    if not inside.any():
        return
    force = np.where(inside, force_map.predict(*state), np.nan)
    axes.plot(x, force, **PREDICTION.drawn)
    if bound is not None:
        axes.plot(x, np.where(inside, bound.upper(force_map, *state), np.nan), **BOUND.drawn)
    last = int(np.flatnonzero(inside)[-1])
    end = (float(x[last]), float(force[last]))
    axes.annotate(words, end, (3, 0), textcoords="offset points", va="center", fontsize=6.5, annotation_clip=False)


def _simulated(force_map: ForceMap, dataset: ImpactDataset | None) -> bool:
    return force_map.simulated or (dataset is not None and dataset.simulated)
