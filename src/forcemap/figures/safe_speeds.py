"""Safe speeds over the workspace."""

from __future__ import annotations

import textwrap

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from forcemap.figures.canvas import finish, in_our_settings, is_wide, new_figure, plain
from forcemap.figures.cells import edges, hatch_cells
from forcemap.figures.style import DISTANCE, HEIGHT, OUTCOMES, PAGE_WIDTH, QUANTITY
from forcemap.speeds.safe_speed import SpeedOutcome, floor_speed
from forcemap.speeds.speed_map import SpeedMap

_MOST_IN_WORDS = 150  # places of a grid whose speeds are written into it


@in_our_settings
def safe_speed_figure(speed_map: SpeedMap, *, width: float = PAGE_WIDTH) -> Figure:
    """Safe speeds over distance and height: speed as colour, outcomes as hatch patterns and words.

    The limit and the bound behind the speeds stand above it, as `SafeSpeed.statements` have them.

    Parameters
    ----------
    speed_map : SpeedMap
        Safe speeds on a grid.
    width : float
        Width of the figure [m].
    """
    speeds, wide = speed_map.speeds, is_wide(width)
    x, y = edges(np.asarray(speed_map.distance)), edges(np.asarray(speed_map.height))
    figure = new_figure("Safe speeds over distance and height", width, 0.115 if wide else 0.12)
    axes = figure.add_subplot()
    axes.grid(visible=False)
    known = np.ma.masked_invalid(np.asarray(speeds.speed, dtype=np.float64).T)
    if known.count():
        mesh = axes.pcolormesh(x, y, known, edgecolor="face", linewidth=0.1)
        bar = figure.colorbar(mesh, ax=axes, label="Safe speed [m/s]")
        bar.ax.yaxis.set_major_formatter(lambda value, _: floor_speed(round(value, 6)))
    legend = []
    for outcome, count in speed_map.counts.items():
        look = OUTCOMES[SpeedOutcome(outcome)]
        if count:
            entry = hatch_cells(axes, x, y, (speeds.outcome == outcome) & (look.hatch != ""), look)
            entry.set_label(f"{look.words} ({count} places)")
            if look.face == "none":  # the colour beneath
                entry.set_facecolor(matplotlib.colormaps[QUANTITY](0.6))
            legend.append(entry)
    if wide and known.count() and speeds.outcome.size <= _MOST_IN_WORDS:
        _write_speeds(axes, speed_map)
    axes.set(xlabel=DISTANCE, ylabel=HEIGHT, xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    axes.set_title(_words(speed_map, 100 if wide else 46), fontsize=7 if wide else 6.5)
    simulated = any(line.startswith("SIMULATED") for line in speeds.statements)
    return finish(figure, simulated=simulated, columns=2 if wide else 1, also=legend, first=speeds.warnings)


def _write_speeds(axes: Axes, speed_map: SpeedMap) -> None:
    """The speed at each place, cut to 0.001 m/s."""
    speed = np.asarray(speed_map.speeds.speed, dtype=np.float64)
    low, high = np.nanmin(speed), np.nanmax(speed)
    for i, j in np.argwhere(np.isfinite(speed)).tolist():
        dark = speed[i, j] < (low + high) / 2
        box = {"facecolor": "none", "edgecolor": "none"}
        axes.text(
            float(speed_map.distance[i]),
            float(speed_map.height[j]),
            floor_speed(speed[i, j]),
            color="#ffffff" if dark else "#000000",
            fontsize=6.5,
            ha="center",
            va="center",
            bbox=box,
        )


def _words(speed_map: SpeedMap, columns: int) -> str:
    """The limit and the bound, broken into lines."""
    newtons = np.unique(np.asarray(speed_map.speeds.limit))
    figure = f"limit: {newtons[0]:g}" + (f" to {newtons[-1]:g}" if newtons.size > 1 else "") + " N"
    lines = [line for line in speed_map.speeds.statements if line.startswith(("limit: ", "bound: "))]
    lines = [line if line.startswith((figure, "bound")) else line.replace("limit:", f"{figure},", 1) for line in lines]
    return "\n".join(part for line in lines for part in textwrap.wrap(plain(line, 400), columns))
