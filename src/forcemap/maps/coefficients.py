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
    p_value : float
        Two-sided.
    """

    term: str
    value: float
    standard_error: float
    low: float
    high: float
    p_value: float


def coefficient_intervals(force_map: ForceMap) -> tuple[Coefficient, ...]:
    """The coefficients of a fitted map, each with the confidence interval of Student's t.

    Raises
    ------
    InputError
        The map was not fitted here.
    """
    from scipy.special import stdtrit

    between = force_map.require_fit().between_states
    freedom = between.degrees_of_freedom
    t = float(stdtrit(freedom, (1 + CONFIDENCE) / 2)) if freedom > 0 else math.nan
    rows = np.column_stack([force_map.coefficients, between.standard_errors, between.p_values]).tolist()
    return tuple(
        Coefficient(term, value, error, value - t * error, value + t * error, p)
        for term, (value, error, p) in zip(force_map.form.term_names, rows, strict=True)
    )
