"""Tests of measured against predicted ln F of several states, on arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.maps.regression import holm

POWER = 0.95
"""Probability with which the smallest mean change stated would have been found: a choice."""

MEAN_SHARE, WHOLE_SHARE, STATES_SHARE = 0.5, 0.25, 0.25
"""How the error probability is split: the mean, all states together, single states (docs/decisions.md)."""


@dataclass(frozen=True, eq=False)
class ResidualTests:
    """What tests find in measured less predicted ln F of m states.

    Parameters
    ----------
    mean, mean_sd : float
        Mean residual and its standard deviation; NaN without a state.
    p_mean, p_whole : float
        Two-sided p values of the mean (t test) and of all residuals together (F test).
    p_states : array
        Two-sided p values of single states, shape (m,), adjusted for their number (Holm 1979).
    detectable : float
        Smallest mean shift found with probability `POWER`; infinite without a state.
    """

    mean: float
    mean_sd: float
    p_mean: float
    p_whole: float
    p_states: FloatArray
    detectable: float

    @classmethod
    def of(
        cls, residual: FloatArray, covariance: FloatArray, freedom: float, error_probability: float
    ) -> ResidualTests:
        """Test residuals, shape (m,), whose covariance is known but for a factor estimated with `freedom`."""
        from scipy.special import fdtrc, nctdtrinc, stdtr, stdtrit

        m = residual.size
        if m == 0:
            return cls(math.nan, math.nan, math.nan, math.nan, np.empty(0), math.inf)
        mean, mean_sd = float(residual.mean()), math.sqrt(float(covariance.sum())) / m
        p_mean = float(2 * stdtr(freedom, -abs(mean) / mean_sd))
        p_whole = float(fdtrc(m, freedom, residual @ np.linalg.solve(covariance, residual) / m))
        alone = 2 * stdtr(freedom, -np.abs(residual) / np.sqrt(np.diag(covariance)))
        p_states = holm(np.asarray(alone, dtype=np.float64))
        quantile = stdtrit(freedom, 1 - MEAN_SHARE * error_probability / 2)
        shift = float(nctdtrinc(freedom, 1 - POWER, quantile))
        return cls(mean, mean_sd, p_mean, p_whole, p_states, shift * mean_sd)

    def changed(self, error_probability: float) -> bool:
        """True if any of the three tests finds a change."""
        shares = (MEAN_SHARE, WHOLE_SHARE, STATES_SHARE)
        p_values = (self.p_mean, self.p_whole, float(np.min(self.p_states, initial=1.0)))
        # not "p <= share": a figure that could not be computed must not pass for no change
        significant = any(not p > share * error_probability for p, share in zip(p_values, shares, strict=True))
        return significant and self.p_states.size > 0


def interval(centre: Any, sd: Any, freedom: float, error: float) -> tuple[Any, Any]:
    """Two-sided interval about a centre that misses with probability `error`; arguments broadcast."""
    from scipy.special import stdtrit

    half = stdtrit(freedom, 1 - error / 2) * sd
    return centre - half, centre + half
