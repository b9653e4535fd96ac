"""What speaks against a map that measurements are planned by, in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from forcemap.maps.force_map import ForceMap
from forcemap.planning.places import FloatArray

LARGEST_STATE_SD = 0.06
"""Twice what the paper's robots show; above it impacts, speeds or the form are not what they should be."""

_FALL = 0.01  # of the force; less is no turn
_SPEEDS = 65  # between the slowest and the fastest speed of a place


def map_warnings(force_map: ForceMap, states: FloatArray) -> Iterator[str]:
    """Where the predicted force falls with speed at the places of states, shape (n, 3), and states that scatter."""
    if force_map.fit is not None and force_map.fit.state_sd > LARGEST_STATE_SD:
        yield (
            f"states scatter by {100 * force_map.fit.state_sd:.1f} % about the map, expected at most "
            f"{100 * LARGEST_STATE_SD:g} %: check the recordings and the speeds, or compare forms (evaluate --forms)"
        )
    low, high = force_map.measured_range.speeds(states[:, 0], states[:, 1])
    low = np.fmin(np.where(np.isnan(low), force_map.measured_range.lowest[2], low), states[:, 2])
    high = np.fmax(high, states[:, 2])
    speeds = np.linspace(low, high, _SPEEDS, axis=1)
    force = np.asarray(force_map.predict(states[:, :1], states[:, 1:2], speeds))
    fall = force < (1 - _FALL) * np.maximum.accumulate(force, axis=1)
    places = np.unique(states[fall.any(axis=1), :2], axis=0)
    if len(places):
        first = int(fall.any(axis=1).argmax())
        top = speeds[first, force[first, : fall[first].argmax() + 1].argmax()]
        yield (
            f"the predicted force falls with speed at {len(places)} of {len(np.unique(states[:, :2], axis=0))} planned "
            f"places, first at d = {states[first, 0]:g} m, h = {states[first, 1]:g} m above {top:.3f} m/s: no robot's "
            "force does, so the map is wrong there; begin with the slowest run and stop where a force exceeds the "
            "expected one"
        )
