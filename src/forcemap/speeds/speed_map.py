"""Safe speeds on a grid of places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.errors import InputError
from forcemap.limits.force_limits import ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.speeds.safe_speed import SafeSpeed, SpeedOutcome, safe_speed

_MOST_PLACES = 1_000_000  # of a grid; a choice: seconds, and some hundred megabytes


@dataclass(frozen=True, eq=False)
class SpeedMap:
    """Safe speeds on a grid.

    Parameters
    ----------
    distance, height : array
        Axes of the grid [m], shapes (n,) and (m,).
    speeds : SafeSpeed
        Safe speeds, arrays of shape (n, m).
    """

    distance: FloatArray
    height: FloatArray
    speeds: SafeSpeed

    @property
    def fastest(self) -> tuple[float, float, float] | None:
        """(distance, height, speed at contact) of the fastest place [m, m, m/s]; None if no place is confirmed."""
        return self._fastest(self.speeds.speed)

    @property
    def fastest_to_program(self) -> tuple[float, float, float] | None:
        """(distance, height, speed to program) of the fastest place [m, m, m/s]; None if none has one."""
        return self._fastest(self.speeds.speed_to_program)

    def _fastest(self, speed: FloatArray) -> tuple[float, float, float] | None:
        if np.isnan(speed).all():
            return None
        i, j = np.unravel_index(np.nanargmax(speed), speed.shape)
        return float(self.distance[i]), float(self.height[j]), float(speed[i, j])

    @property
    def counts(self) -> dict[str, int]:
        """Number of places of each outcome."""
        outcomes = self.speeds.outcome.ravel().tolist()
        return {outcome.value: outcomes.count(outcome) for outcome in SpeedOutcome}


def speed_map(
    force_map: ForceMap,
    distance: ArrayLike,
    height: ArrayLike,
    *,
    limit: ForceLimit | NewtonLimit | float,
    bound: Bound,
    **stated: Any,
) -> SpeedMap:
    """Safe speeds at every combination of distances [m], shape (n,), and heights [m], shape (m,).

    The other arguments, and the errors, are those of `safe_speed`.
    """
    d, h = (np.ma.atleast_1d(axis) for axis in (distance, height))  # masked entries reach the check
    return SpeedMap(d, h, safe_speed(force_map, d[:, None], h[None, :], limit=limit, bound=bound, **stated))


def measured_grid(force_map: ForceMap, step: float) -> tuple[FloatArray, FloatArray]:
    """Distances and heights [m] at multiples of `step` [m] within the box around the measured range.

    An axis too short for a multiple gets its middle.

    Raises
    ------
    InputError
        A step that is not positive and finite, or one that makes more than a million places.
    """
    if not 0 < step < np.inf:
        raise InputError(f"step: found {step:g} m, expected a positive finite number")
    box = list(zip(force_map.measured_range.lowest[:2], force_map.measured_range.highest[:2], strict=True))
    if np.prod([1 + (high - low) / step for low, high in box]) > _MOST_PLACES:
        raise InputError(f"step: found {step:g} m, expected one that makes at most a million places")
    axes = []
    for low, high in box:
        multiples = np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1)
        axes.append(
            np.clip(np.round(step * multiples, 12), low, high) if multiples.size else np.array([(low + high) / 2])
        )
    return axes[0], axes[1]
