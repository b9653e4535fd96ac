"""The workspace in four variables: distance, height, speed, and force as colour."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from forcemap.campaigns.dataset import ImpactDataset
from forcemap.figures.canvas import finish, in_our_settings, is_wide, new_figure
from forcemap.figures.measured import Measured, a_few, levels, near
from forcemap.figures.style import CENSORED, DISTANCE, FORCE, HEIGHT, PAGE_WIDTH, QUANTITY, SPEED
from forcemap.maps.force_map import ForceMap

_CELLS = 16  # of a slice along each axis


@in_our_settings
def workspace_figure(force_map: ForceMap, dataset: ImpactDataset | None = None, *, width: float = PAGE_WIDTH) -> Figure:
    """Predicted force over distance, height and speed as colour, with the measured states (paper, section V-A).

    Slices of the workspace at the lowest, middle and highest measured speed, as far as the measured range reaches;
    the states measured at these speeds lie on them.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    dataset : ImpactDataset, optional
        Measured states to show; those of a fitted map if not given.
    width : float
        Width of the figure [m].
    """
    measured = Measured.of(force_map, dataset)
    lowest, highest = force_map.measured_range.lowest, force_map.measured_range.highest
    tolerances = (measured.tolerance.place, measured.tolerance.place, measured.tolerance.speed)
    points = force_map.measured_range.points.T
    ticks = [a_few(levels(values, tolerance)) for values, tolerance in zip(points, tolerances, strict=True)]
    speeds = ticks[2]
    d, h = (np.linspace(low, high, _CELLS + 1) for low, high in zip(lowest[:2], highest[:2], strict=True))
    corner_d, corner_h = np.meshgrid(d, h, indexing="ij")
    middle_d, middle_h = np.meshgrid((d[1:] + d[:-1]) / 2, (h[1:] + h[:-1]) / 2, indexing="ij")

    slices = []
    for speed in speeds:
        at = np.full(middle_d.shape, speed)
        inside = force_map.measured_range.contains(middle_d, middle_h, at)
        slices.append(np.where(inside, force_map.predict(middle_d, middle_h, at), np.nan))
    known = np.concatenate([each[np.isfinite(each)] for each in slices])
    scale = Normalize(known.min(), known.max()) if known.size else Normalize(0, 1)

    wide = is_wide(width)
    figure = new_figure("Predicted force over distance, height and speed", width, (0.68 if wide else 1.1) * width)
    axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    colours = matplotlib.colormaps[QUANTITY]
    for number, (speed, force) in enumerate(zip(speeds, slices, strict=True)):
        faces = colours(scale(np.nan_to_num(force)))
        faces[~np.isfinite(force)] = 0.0
        surface = np.full(corner_d.shape, speed)
        axes.plot_surface(
            corner_d,
            corner_h,
            surface,
            facecolors=faces,
            rcount=_CELLS + 1,
            ccount=_CELLS + 1,
            shade=False,
            linewidth=0,
            antialiased=False,
            zorder=2 * number,
        )
        for look, states in measured.by_look:
            here = states.select(near(states.speed, speed, measured.tolerance.speed))
            axes.plot(here.distance, here.height, here.speed, zorder=2 * number + 1, **look.drawn)
            above = here.select(here.censored > 0)
            if len(above):
                axes.plot(above.distance, above.height, above.speed, zorder=2 * number + 1, **CENSORED.drawn)
    axes.set(xlabel=DISTANCE, ylabel=HEIGHT, zlabel=SPEED)
    for set_ticks, places in zip((axes.set_xticks, axes.set_yticks, axes.set_zticks), ticks, strict=True):
        set_ticks(places, [f"{place:.2f}" for place in places])
    axes.view_init(elev=18, azim=-58)
    axes.set_box_aspect((1, 1, 1.25), zoom=0.95 if wide else 0.85)  # its labels need room
    figure.colorbar(
        ScalarMappable(scale, QUANTITY),
        ax=axes,
        label=f"Predicted {FORCE[0].lower()}{FORCE[1:]}",
        shrink=0.7,
        pad=0.05 if wide else 0.2,
    )
    simulated = force_map.simulated or (dataset is not None and dataset.simulated)
    return finish(figure, simulated=simulated, columns=3 if wide else 1)
