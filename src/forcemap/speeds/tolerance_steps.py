"""The allowance of a tolerance bound between two leverages: sqrt(l) t'(l), piecewise linear in sqrt(l)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.maps.bounds import ToleranceBound, tolerance_nodes
from forcemap.maps.force_map import ForceMap

_ROUNDING_UP = 1e-12  # of ln of the bound, added to an upper bound of it
_ROUNDING_DOWN = 1e-9  # the same, subtracted from a lower bound


@dataclass(frozen=True, eq=False)
class ToleranceSteps:
    """What a tolerance bound adds to ln F: a function of the leverage that is linear between nodes of sqrt(l).

    Parameters
    ----------
    root : array, shape (k,)
        Nodes of sqrt(l).
    highest : array, shape (k,)
        Largest allowance up to each node; beyond the last node it grows with the slope `last_slope`.
    last_slope : float
        Slope beyond the last node.
    steepest, falling : array, shape (k,)
        Largest slope of the allowance over sqrt(l) up to each node, at least 0, and smallest one, at most 0: at low
        confidence the allowance falls in part.
    lowest : array, shape (k,)
        Smallest allowance from each node on.
    error : float
        Device error [N].
    """

    root: FloatArray
    highest: FloatArray
    last_slope: float
    steepest: FloatArray
    falling: FloatArray
    lowest: FloatArray
    error: float

    @classmethod
    def of(cls, bound: ToleranceBound, force_map: ForceMap) -> Self:
        """The allowance of a bound that can be computed for a map."""
        root, factor, last_slope = tolerance_nodes(bound, force_map)
        deviation = force_map.require_fit().state_sd
        allowance = deviation * factor
        slopes = np.append(np.diff(allowance) / np.diff(root), deviation * last_slope)
        steepest = np.maximum.accumulate(np.maximum(slopes, 0.0))
        falling = np.minimum.accumulate(np.minimum(slopes, 0.0))
        highest = np.maximum.accumulate(allowance)
        lowest = np.minimum.accumulate(allowance[::-1])[::-1]
        return cls(root, highest, max(float(slopes[-1]), 0.0), steepest, falling, lowest, bound.error_of(force_map))

    def largest(self, log_force: FloatArray, leverage: FloatArray) -> FloatArray:
        """Upper bound of ln of the bound where ln F and the leverage are at most these."""
        root = np.sqrt(np.maximum(leverage, 0.0))
        beyond = np.maximum(root - self.root[-1], 0.0) * self.last_slope
        allowance = np.interp(root, self.root, self.highest) + beyond
        return np.asarray(np.maximum(log_force + allowance, self._log_with_error(log_force)) + _ROUNDING_UP)

    def smallest(self, log_force: FloatArray, leverage: FloatArray) -> FloatArray:
        """Lower bound of ln of the bound where ln F and the leverage are at least these."""
        allowance = np.interp(np.sqrt(np.maximum(leverage, 0.0)), self.root, self.lowest)
        return np.asarray(np.maximum(log_force + allowance, self._log_with_error(log_force)) - _ROUNDING_DOWN)

    def _log_with_error(self, log_force: FloatArray) -> FloatArray:
        """ln (F + device error); infinite where F overflows."""
        with np.errstate(over="ignore"):
            return np.asarray(np.log(np.exp(log_force) + self.error))

    def share(self, log_force: FloatArray) -> FloatArray:
        """Lower bound of F / (F + device error), the slope of ln(F + error) over ln F, where ln F is at least this."""
        with np.errstate(over="ignore"):
            return np.asarray(1 / (1 + self.error * np.exp(-log_force)))

    def slopes(
        self, falls: FloatArray, rises: FloatArray, least: FloatArray, most: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bound of the slope of the allowance where leverages lie between `least` and `most`."""
        step = np.clip(np.searchsorted(self.root, np.sqrt(np.maximum(most, 0.0))), 0, self.root.size - 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            per_root = 1 / (2 * np.sqrt(np.maximum(least, 0.0)))
            products = [
                np.where((slope == 0) | (change == 0), 0.0, slope * per_root * change)
                for slope in (self.steepest[step], self.falling[step])
                for change in (falls, rises)
            ]
        products.append(np.zeros_like(per_root))
        return np.min(products, axis=0), np.max(products, axis=0)
