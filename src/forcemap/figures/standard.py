"""Maps beside the 2D map and the standard's contact model, several robots in one picture (paper, section V-C)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from forcemap.errors import InputError
from forcemap.figures import style
from forcemap.figures.canvas import finish, is_wide, narrow_columns, new_figure, panels, settings
from forcemap.figures.heights import Mapped, default_cuts, mapped, names_of
from forcemap.figures.maps import WORDS, draw_2d
from forcemap.figures.measured import draw_map, draw_profile
from forcemap.figures.style import DISTANCE, FORCE, HEIGHT, PAGE_WIDTH
from forcemap.limits.pfl import pfl_contact_force
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap


@settings()
def standard_figure(
    shown: ForceMap | Mapped | Sequence[ForceMap | Mapped],
    *,
    models: Sequence[dict[str, Any]],
    maps_2d: Sequence[Sequence[ForceMap]] = (),
    bound: Bound | None = None,
    speed: float | None = None,
    height: float | None = None,
    distance: float | None = None,
    width: float = PAGE_WIDTH,
) -> Figure:
    """Force at one speed against distance and against height: the map, the 2D maps and the standard, robot by robot.

    Parameters
    ----------
    shown : ForceMap or Mapped, or a sequence of them
        Maps, a column of panels for each, as in `force_heights_figure`.
    models : sequence of dict
        Of each the contact model's `robot_mass` [kg], `body_mass` [kg] and `stiffness` [N/m], as
        `contact_model(force_map.conditions, area).figures` gives them (forcemap.comparisons.contact_model).
    maps_2d : sequence of sequences of ForceMap
        Of each the maps of form CFM_2D: of all heights, or of one; none if not given.
    bound : Bound, optional
        Bound of the maps to draw dashed.
    speed, height, distance : float, optional
        Where to cut [m/s], [m], [m]; values that many states have if not given, the same for all maps where their
        measured ranges have one in common.
    width : float
        Width of the figure [m].

    Raises
    ------
    InputError
        No map, or not one model for each, or 2D maps for some alone.
    BoundNotAvailable
        A map cannot carry the bound.

    Examples
    --------
    >>> from forcemap import published_map
    >>> hand = {"robot_mass": 15.0, "body_mass": float("inf"), "stiffness": 75e3}
    >>> len(standard_figure(published_map("ur10e"), models=[hand], speed=0.3).axes)
    2
    """
    maps = mapped(shown)
    flat = maps_2d or [()] * len(maps)
    if not len(maps) == len(models) == len(flat):
        found = f"found {len(models)} models and {len(maps_2d)} groups of 2D maps for {len(maps)} maps"
        raise InputError(f"{found}, expected one model each, and 2D maps of each or of none")
    wide = is_wide(width)
    columns = len(maps) if wide else narrow_columns(2 * len(maps))
    down = 2 * len(maps) // columns
    figure = new_figure("Maps, 2D maps and the standard", width, 0.016 + down * (0.055 if wide else 0.05))
    grid = np.array(panels(figure, 2 * len(maps), columns, share_y=True), dtype=object)
    grid = grid.reshape(2, -1) if wide else grid.reshape(-1, 2).T
    cuts = _cuts(maps, distance, height, speed)
    for i, (each, name) in enumerate(zip(maps, names_of(maps), strict=True)):
        cut = [of_each[i] for of_each in cuts]
        standard = float(pfl_contact_force(cut[2], **models[i]))
        for along, axes in enumerate(grid[:, i]):
            _draw(axes, each, bound, along, cut, flat[i], standard)
            at = WORDS[1 - along].format(cut[1 - along])
            axes.set_title(f"{name}\n{at}, {cut[2]:.2f} m/s")
            axes.set_xlabel((DISTANCE, HEIGHT)[along])
            axes.set_ylabel(FORCE if axes.get_subplotspec().is_first_col() else "")
    grid[0, 0].set_ylim(bottom=0)
    return finish(figure, simulated=any(each.measured.simulated for each in maps))


def _cuts(maps: Sequence[Mapped], *stated: float | None) -> list[list[float]]:
    """Distance, height and speed at which each map is cut: stated, else as usual, else where all maps lie around it."""
    usual = [[0.0 if value is None else value] * len(maps) for value in stated]
    usual = [default_cuts(maps, i, stated[2]) if value is None else usual[i] for i, value in enumerate(stated)]
    ranges = [each.force_map.measured_range for each in maps]
    inside = [
        measured.contains(*map(np.array, at)) for measured, at in zip(ranges, zip(*usual, strict=True), strict=True)
    ]
    if all(inside) or any(value is not None for value in stated):
        return usual
    middle = np.mean([measured.points.mean(axis=0) for measured in ranges], axis=0)  # of scattered states
    return [[value] * len(maps) for value in middle.tolist()]


def _draw(
    axes: Axes,
    shown: Mapped,
    bound: Bound | None,
    along: int,
    cut: Sequence[float],
    maps_2d: Sequence[ForceMap],
    standard: float,
) -> None:
    """The models against distance (along 0) or height (1) at a cut of distance, height and speed."""
    fixed = {1 - along: cut[1 - along], 2: cut[2]}
    x, _ = draw_map(axes, shown.force_map, bound, along, fixed)
    place = shown.measured.tolerance.place
    draw_2d(axes, maps_2d, along, {0: cut[0], 1: cut[1]}, cut[2], place, x, of_map=shown.dataset is None)
    style.STANDARD.plot(axes, [x[0], x[-1]], [standard, standard])
    draw_profile(axes, shown.measured, along, fixed)
    axes.margins(y=0.1)
