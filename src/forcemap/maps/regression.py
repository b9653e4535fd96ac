"""Least squares with inference, on arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import RankDeficient, TooFewStates

MAX_CONDITION = 1e8
"""Condition number of the design, columns scaled to length 1, above which it counts as rank deficient."""

EXACT = 1e-18
"""Variance of ln F below which states follow the terms exactly, as computed ones do."""


@dataclass(frozen=True, eq=False)
class Regression:
    """A least-squares fit of n observations with p coefficients.

    Parameters
    ----------
    design : array
        Design matrix X, shape (n, p).
    response : array
        Observations y, shape (n,).
    coefficients : array
        Estimates, shape (p,).
    inverse_triangle : array
        R^-1 of X = QR, shape (p, p), so that (X'X)^-1 = R^-1 R^-T.
    """

    design: FloatArray
    response: FloatArray
    coefficients: FloatArray
    inverse_triangle: FloatArray

    @property
    def degrees_of_freedom(self) -> float:
        """n - p."""
        return self.response.size - self.coefficients.size

    @cached_property
    def residuals(self) -> FloatArray:
        """Observed minus fitted, shape (n,)."""
        return self.response - self.design @ self.coefficients

    @cached_property
    def leverage(self) -> FloatArray:
        """Diagonal of the hat matrix, shape (n,)."""
        return np.asarray(np.square(self.design @ self.inverse_triangle).sum(axis=1))

    @cached_property
    def residual_squares(self) -> float:
        """Sum of squared residuals."""
        return float(self.residuals @ self.residuals)

    @cached_property
    def residual_sd(self) -> float:
        """s = sqrt(sum of squared residuals / (n - p)); NaN if n = p."""
        freedom = self.degrees_of_freedom
        return math.sqrt(self.residual_squares / freedom) if freedom else math.nan

    @property
    def rmse(self) -> float:
        """Root mean square of the residuals, of those that are known."""
        return float(np.sqrt(np.nanmean(self.residuals**2)))

    @property
    def r_squared(self) -> float:
        """Coefficient of determination over the observations that are known; NaN where they are constant."""
        known = ~np.isnan(self.response)
        total = float(np.sum((self.response[known] - self.response[known].mean()) ** 2))
        return 1 - float(np.sum(self.residuals[known] ** 2)) / total if total > 0 else math.nan

    @cached_property
    def standard_errors(self) -> FloatArray:
        """Standard errors of the coefficients, shape (p,); NaN if n = p."""
        return np.asarray(self.residual_sd * np.sqrt(np.square(self.inverse_triangle).sum(axis=1)))

    @cached_property
    def t_values(self) -> FloatArray:
        """Coefficients over their standard errors, shape (p,)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.coefficients / self.standard_errors)

    @cached_property
    def p_values(self) -> FloatArray:
        """Two-sided p values of the t values, shape (p,)."""
        from scipy.special import stdtr

        return np.asarray(2 * stdtr(self.degrees_of_freedom, -np.abs(self.t_values)))

    @cached_property
    def condition_number(self) -> float:
        """Of the design with columns scaled to length 1, in the 2-norm."""
        singular = np.linalg.svd(self.design / np.linalg.norm(self.design, axis=0), compute_uv=False)
        return float(singular[0] / singular[-1])


@dataclass(frozen=True, eq=False)
class ScatterRegression(Regression):
    """A fit whose scatter is estimated otherwise than from its own residuals.

    Parameters
    ----------
    deviation : float
        s, the standard deviation of a state's mean of ln F about the map.
    freedom : float
        Degrees of freedom of s.
    """

    deviation: float
    freedom: float

    @property
    def degrees_of_freedom(self) -> float:
        """Degrees of freedom of s."""
        return self.freedom

    @cached_property
    def residual_sd(self) -> float:
        """s."""
        return self.deviation

    @cached_property
    def residual_squares(self) -> float:
        """Sum of squared residuals of the states with an uncensored repeat."""
        return float(np.nansum(self.residuals**2))


def least_squares(design: FloatArray, response: FloatArray) -> Regression:
    """Fit a response, shape (n,), on a design matrix, shape (n, p), by Householder QR decomposition.

    Raises
    ------
    TooFewStates
        Fewer observations than coefficients.
    RankDeficient
        The columns of the design do not tell the coefficients apart.
    """
    from scipy.linalg import lapack

    n, p = design.shape
    if n < p:
        raise TooFewStates(
            f"found {n} measured states, expected at least {p}, one for each coefficient", remedy="measure more states"
        )
    factored = lapack.dgeqrf(np.column_stack([design, response]))[0]
    triangle = np.triu(factored[:p, :p])
    length = np.sqrt(np.square(triangle).sum(axis=0))  # of the columns of the design: Q keeps lengths
    inverse, singular = lapack.dtrtri(triangle)
    if singular or not lapack.dtrcon(triangle / length)[0] * MAX_CONDITION > 1:
        raise _rank_deficient(design)
    coefficients = lapack.dtrtrs(triangle, factored[:p, p])[0]
    return Regression(design, response, coefficients, inverse)


def _rank_deficient(design: FloatArray) -> RankDeficient:
    length = np.linalg.norm(design, axis=0)
    singular = np.linalg.svd(design / np.where(length > 0, length, 1.0), compute_uv=False)
    rank = int(np.sum(singular * MAX_CONDITION / design.shape[1] > singular[0]))
    p = design.shape[1]
    return RankDeficient(
        f"found that the measured states determine {min(rank, p - 1)} combinations of the {p} coefficients "
        f"(rank {min(rank, p - 1)}), expected {p}",
        remedy="measure at more distances, heights or speeds",
    )


def holm(p_values: FloatArray) -> FloatArray:
    """P values adjusted for their number, shape (m,) (Holm 1979, https://www.jstor.org/stable/4615733)."""
    order = np.argsort(p_values, kind="stable")
    adjusted = np.empty(p_values.size)
    adjusted[order] = np.minimum(np.maximum.accumulate(p_values[order] * np.arange(p_values.size, 0, -1)), 1.0)
    return adjusted
