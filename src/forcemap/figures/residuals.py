"""Residuals of a map."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from forcemap.campaigns.dataset import ImpactDataset
from forcemap.figures.canvas import finish, in_our_settings, is_wide, new_figure, panels
from forcemap.figures.measured import Measured, draw_forces
from forcemap.figures.style import DISTANCE, HEIGHT, PAGE_WIDTH, PALE, SPEED
from forcemap.maps.force_map import ForceMap

_AGAINST = ("Predicted force [N]", DISTANCE, HEIGHT, SPEED)


@in_our_settings
def residuals_figure(force_map: ForceMap, dataset: ImpactDataset, *, width: float = PAGE_WIDTH) -> Figure:
    """Measured less predicted force, in percent of measured, against force, distance, height and speed.

    Above zero the map underestimates: the dangerous side.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    dataset : ImpactDataset
        Measured states.
    width : float
        Width of the figure [m].
    """
    wide = is_wide(width)
    figure = new_figure("Residuals against force, distance, height and speed", width, 0.11 if wide else 0.125)
    all_axes = panels(figure, 4, 2, share_y=True)
    for look, states in Measured.of_dataset(dataset).by_look:
        predicted = np.asarray(force_map.predict(states.distance, states.height, states.speed))
        residual = 100 * (states.force - predicted) / states.force
        at_least = 100 * (states.at_least - predicted) / states.at_least
        for axes, x in zip(all_axes, (predicted, *states.coordinates.T), strict=True):
            draw_forces(axes, look, states, x, residual, at_least)
    low, high = all_axes[0].get_ylim()
    low, high = min(low, -1.0), max(high, 1.0)
    room = 0.12 * (high - low)  # for the words
    for i, (axes, words) in enumerate(zip(all_axes, _AGAINST, strict=True)):
        axes.axhspan(0, high + room, color=PALE, alpha=0.6, linewidth=0, zorder=0)
        axes.axhline(0, color="#404040", linewidth=0.8)
        axes.set_ylim(low - room, high + room)
        axes.set_xlabel(words)
        axes.locator_params(axis="x", nbins=6 if wide else 3)
        if i % 2 == 0:
            axes.set_ylabel("Measured − predicted\n[% of measured]")
        axes.text(0.02, 0.98, "underestimated", transform=axes.transAxes, fontsize=6.5, va="top")
        axes.text(0.02, 0.02, "overestimated", transform=axes.transAxes, fontsize=6.5, va="bottom")
    return finish(figure, simulated=dataset.simulated or force_map.simulated, columns=3 if wide else 1)
