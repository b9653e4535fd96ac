"""The allowance of a tolerance bound between two leverages: sqrt(l) t'(l) in straight steps of sqrt(l)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.maps.bounds import ToleranceBound, tolerance_nodes
from forcemap.maps.force_map import ForceMap


@dataclass(frozen=True, eq=False)
class ToleranceSteps:
    """What a tolerance bound adds to ln F, a function of the leverage that is straight between nodes of sqrt(l).

    Parameters
    ----------
    root : array, shape (k,)
        Nodes of sqrt(l).
    highest : array, shape (k,)
        Largest allowance up to each node, beyond the last node with the slope of `last_slope`.
    last_slope : float
        Slope beyond the last node.
    steepest : array, shape (k,)
        Largest slope of the allowance over sqrt(l) up to each node.
    lowest : float
        Smallest allowance at any leverage.
    error : float
        Device error [N].
    """

    root: FloatArray
    highest: FloatArray
    last_slope: float
    steepest: FloatArray
    lowest: float
    error: float

    @classmethod
    def of(cls, bound: ToleranceBound, force_map: ForceMap) -> Self:
        """The allowance of a bound on a map that carries it."""
        root, factor, last_slope = tolerance_nodes(bound, force_map)
        deviation = force_map.require_fit().state_sd
        allowance = deviation * factor
        slopes = np.append(np.diff(allowance) / np.diff(root), deviation * last_slope)
        error = float(np.fmax(bound.device_error, force_map.conditions.device.error))
        steepest = np.maximum.accumulate(np.maximum(slopes, 0.0))
        highest = np.maximum.accumulate(allowance)
        return cls(root, highest, max(float(slopes[-1]), 0.0), steepest, float(allowance.min()), error)

    def largest(self, log_force: FloatArray, leverage: FloatArray) -> FloatArray:
        """At least ln of the bound where ln F and the leverage are at most these."""
        root = np.sqrt(np.maximum(leverage, 0.0))
        beyond = np.maximum(root - self.root[-1], 0.0) * self.last_slope
        allowance = np.interp(root, self.root, self.highest) + beyond
        with np.errstate(over="ignore"):
            return np.asarray(np.maximum(log_force + allowance, np.log(np.exp(log_force) + self.error)) + 1e-12)

    def smallest(self, log_force: FloatArray) -> FloatArray:
        """At most ln of the bound where ln F is at least this."""
        return np.asarray(np.maximum(log_force + self.lowest, np.log(np.exp(log_force) + self.error)) - 1e-9)

    def share(self, log_force: FloatArray) -> FloatArray:
        """At most F / (F + device error) where ln F is at least this: what the error leaves of a slope of ln F."""
        return np.asarray(1 / (1 + self.error * np.exp(-log_force)))

    def slopes(
        self, falls: FloatArray, rises: FloatArray, least: FloatArray, most: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """At most and at least the slope of the allowance, for leverages from `least` to `most` and their slopes."""
        step = np.clip(np.searchsorted(self.root, np.sqrt(np.maximum(most, 0.0))), 0, self.root.size - 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            steep = self.steepest[step] / (2 * np.sqrt(np.maximum(least, 0.0)))
            down = np.where(falls < 0, np.nan_to_num(steep * falls, nan=-np.inf, neginf=-np.inf), 0.0)
            up = np.where(rises > 0, np.nan_to_num(steep * rises, nan=np.inf, posinf=np.inf), 0.0)
        return down, up
