"""Where and how fast was measured."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from forcemap.campaigns.dataset import ImpactDataset
from forcemap.figures.canvas import finish, in_our_settings, is_wide, new_figure, panels
from forcemap.figures.measured import Measured, levels
from forcemap.figures.style import CENSORED, DISTANCE, HEIGHT, PAGE_WIDTH

_MOST_PANELS = 6


@in_our_settings
def measurement_grid_figure(dataset: ImpactDataset, *, width: float = PAGE_WIDTH) -> Figure:
    """Places of the measured states, a panel a speed: training, test and censored states by marker.

    Parameters
    ----------
    dataset : ImpactDataset
        The impacts.
    width : float
        Width of the figure [m].
    """
    measured = Measured.of_dataset(dataset)
    speeds = levels(dataset.states.speed, dataset.tolerance.speed)
    groups = np.array_split(speeds, min(_MOST_PANELS, speeds.size))
    columns = min(len(groups), 3 if is_wide(width) else 2)
    rows = -(-len(groups) // columns)
    figure = new_figure("Places and speeds measured", width, 0.02 + rows * 0.95 * width / columns)
    all_axes = panels(figure, len(groups), columns, share_y=True)
    for i, (axes, group) in enumerate(zip(all_axes, groups, strict=True)):
        low, high = group[0] - dataset.tolerance.speed, group[-1] + dataset.tolerance.speed
        for look, states in measured.by_look:
            here = states.select((states.speed >= low) & (states.speed <= high))
            axes.plot(here.distance, here.height, **look.drawn)
            censored = here.select(here.censored > 0)
            if len(censored):
                axes.plot(censored.distance, censored.height, **CENSORED.drawn)
        words = f"{group[0]:.2f}" + (f" to {group[-1]:.2f}" if group.size > 1 else "")
        axes.set(title=f"{words} m/s", xlabel=DISTANCE if i + columns >= len(groups) else "")
        axes.set_ylabel(HEIGHT if i % columns == 0 else "")
        axes.margins(0.15)
        axes.set_aspect("equal", adjustable="datalim")
    return finish(figure, simulated=dataset.simulated, columns=3 if is_wide(width) else 1)
