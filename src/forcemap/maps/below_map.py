"""Impacts far below what a map predicts: of a robot that did not reach the speed that is stated of them, say."""

from __future__ import annotations

import numpy as np

from forcemap.campaigns.dataset import States, StateTolerance
from forcemap.errors import BoundNotAvailable
from forcemap.findings import Finding, FindingKind
from forcemap.maps.above_bound import NO_CHANCE
from forcemap.maps.bounds import ToleranceBound
from forcemap.maps.force_map import ForceMap

_FAR = 0.15
"""Share of the prediction below it from which a force counts as far; a choice: half of a speed takes 30 to 50 %."""


def far_below(force_map: ForceMap, states: States) -> Finding | None:
    """States within the measured range, all of whose impacts lie below what 999 of 1000 states stay above, F^2 / U, and
    far below the prediction F; None without any.

    That a force is low is no danger by itself; but whoever did not reach a speed knows nothing of the force at it. One
    faster than the map is held against its highest speed there. One at several places, as of a zone, counts if it lies
    below at all of them.
    """
    most = ToleranceBound(content=NO_CHANCE, device_error=force_map.conditions.device.error_or_default)
    try:
        most.require(force_map)
    except BoundNotAvailable:
        return None
    place, tolerance = (states.distance, states.height), StateTolerance().speed
    low, high = force_map.measured_range.speeds(*place)
    speed = np.clip(states.slowest, low, high)
    with np.errstate(all="ignore"):  # beyond the measured range
        predicted, upper = force_map.predict(*place, speed), most.upper(force_map, *place, speed)
        least = predicted * np.minimum(1 - _FAR, predicted / upper)
    inside = states.slowest >= speed - tolerance  # faster than the map, too: False where nothing was measured
    below = inside & (states.censored == 0) & (states.highest < least)
    of = np.array(states.name)
    names = [name for name in dict.fromkeys(states.name) if below[of == name].all()]
    if not names:
        return None
    i = int(np.argmin(np.where(np.isin(of, names), states.highest / predicted, np.inf)))
    return Finding.of(
        FindingKind.FAR_BELOW_MAP,
        names=tuple(names),
        force_N=float(states.highest[i]),
        predicted_N=float(predicted[i]),
        distance_m=float(states.distance[i]),
        height_m=float(states.height[i]),
        speed_mps=float(force_map.conditions.as_stated(states.slowest)[i]),
    )
