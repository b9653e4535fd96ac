"""Places to measure: where there is no permission yet, and which states are planned next."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from forcemap.campaigns.plan import MeasurementPlan
from forcemap.figures import canvas, style
from forcemap.figures.style import DISTANCE, HEIGHT, PAGE_WIDTH
from forcemap.speeds.safe_speed import SpeedOutcome, floor_speed
from forcemap.speeds.speed_map import SpeedMap


@canvas.settings()
def places_to_measure_figure(
    speed_map: SpeedMap, plan: MeasurementPlan | None = None, *, width: float = PAGE_WIDTH
) -> Figure:
    """Places with and without a speed to program, and the states to measure next with their speeds at contact [m/s].

    Parameters
    ----------
    speed_map : SpeedMap
        Safe speeds on a grid.
    plan : MeasurementPlan, optional
        What to measure next.
    width : float
        Width of the figure [m].
    """
    speeds, wide = speed_map.speeds, canvas.is_wide(width)
    d, h = (axis.ravel() for axis in np.meshgrid(speed_map.distance, speed_map.height, indexing="ij"))
    outcome = speeds.to_program_outcome.ravel()
    figure = canvas.new_figure("Places to measure", width, 0.09 if wide else 0.12)
    axes = figure.add_subplot()
    open_ = outcome == SpeedOutcome.UNCONFIRMED
    for look, chosen in ((style.HAS_SPEED, ~np.isnan(speeds.speed_to_program.ravel())), (style.NO_SPEED, open_)):
        if chosen.any():
            look.plot(axes, d[chosen], h[chosen], f"{look.words} ({int(chosen.sum())} places)")
    if plan is not None:
        first = [plan.state_id.tolist().index(name) for name in plan.states]
        style.MEASURE_NEXT.plot(axes, plan.distance[first], plan.height[first])
        for i in first:
            place = float(plan.distance[i]), float(plan.height[i])
            words = floor_speed(float(plan.speed[i]))
            axes.annotate(words, place, (0, -11), textcoords="offset points", fontsize=6.5, ha="center")
    axes.set(xlabel=DISTANCE, ylabel=HEIGHT)
    axes.margins(0.08)
    return canvas.finish(figure, simulated=speeds.basis.simulated)
