"""The coefficients of a fitted map with their confidence intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.maps.force_map import ForceMap

CONFIDENCE = 0.95
"""Of the intervals of coefficients."""


@dataclass(frozen=True)
class Coefficient:
    """A coefficient of ln F.

    Parameters
    ----------
    term : str
        Its term.
    value : float
        The estimate, for F in N, d and h in m, v in m/s.
    standard_error : float
        Of the fit to the states; NaN with as many states as coefficients.
    low, high : float
        Ends of its 95 % confidence interval, value -+ t x standard error; NaN with as many states as coefficients.
    t_value : float
        Value over standard error.
    p_value : float
        Two-sided.
    """

    term: str
    value: float
    standard_error: float
    low: float
    high: float
    t_value: float
    p_value: float


def coefficient_intervals(force_map: ForceMap) -> tuple[Coefficient, ...]:
    """The coefficients of a fitted map, each with the confidence interval of Student's t.

    Raises
    ------
    InputError
        The map was not fitted here.
    """
    from scipy.special import stdtr, stdtrit

    fit, value = force_map.require_fit(), force_map.coefficients
    error, freedom = fit.standard_errors, fit.between_states.degrees_of_freedom
    half = error * (stdtrit(freedom, (1 + CONFIDENCE) / 2) if freedom > 0 else math.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = value / error
    p = 2 * stdtr(freedom, -np.abs(t))
    rows = np.column_stack([value, error, value - half, value + half, t, p]).tolist()
    return tuple(Coefficient(term, *row) for term, row in zip(force_map.form.term_names, rows, strict=True))
