"""How far repeats agree."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.repeatability import Repeatability
from forcemap.figures.canvas import finish, in_our_settings, is_wide, new_figure, plain
from forcemap.figures.style import CENSORED, DEVICE_ERROR, OUTLIER, PAGE_WIDTH, POOLED, REPEATED

_MOST_NAMES = 6


@in_our_settings
def repeatability_figure(
    repeatability: Repeatability, dataset: ImpactDataset | None = None, *, width: float = PAGE_WIDTH
) -> Figure:
    """Standard deviation of the repeats of every state against its force, with the pooled one; outliers are named.

    Parameters
    ----------
    repeatability : Repeatability
        The result.
    dataset : ImpactDataset, optional
        Its impacts; tell the device error and whether they are simulated.
    width : float
        Width of the figure [m].
    """
    wide = is_wide(width)
    figure = new_figure("Standard deviation of repeats", width, 0.075)
    axes = figure.add_subplot()
    force, sd = repeatability.mean, repeatability.sd
    repeated = np.isfinite(sd)
    axes.plot(force[repeated], sd[repeated], **REPEATED.drawn)
    partly = repeated & (repeatability.censored > 0)
    if partly.any():
        words = "some repeats above the device range, not counted"
        axes.plot(force[partly], sd[partly], **(CENSORED.drawn | {"label": words}))
    if np.isfinite(repeatability.within_state_sd):
        pooled = repeatability.within_state_sd
        axes.axhline(pooled, **(POOLED.drawn | {"label": f"{POOLED.words}: {pooled:.2f} N"}))
    error = np.nan if dataset is None else dataset.conditions.device.error
    if np.isfinite(error):
        axes.axhline(error, **(DEVICE_ERROR.drawn | {"label": f"{DEVICE_ERROR.words}: {error:g} N"}))
    outliers = dict.fromkeys(outlier.state for outlier in repeatability.outliers)
    for number, name in enumerate(outliers):
        i = repeatability.state.index(name)
        if not repeated[i]:
            continue
        axes.plot(force[i], sd[i], **OUTLIER.drawn)
        if number < _MOST_NAMES:
            axes.annotate(
                plain(name, 24), (force[i], sd[i]), (6, 0), textcoords="offset points", fontsize=6.5, va="center"
            )
    if not repeated.any():
        axes.text(0.5, 0.5, "no state was repeated", transform=axes.transAxes, ha="center")
    axes.set(xlabel="Mean peak force of the state [N]", ylabel="SD of repeats [N]")
    axes.set_ylim(bottom=0)
    simulated = dataset is not None and dataset.simulated
    return finish(figure, simulated=simulated, columns=2 if wide else 1)
