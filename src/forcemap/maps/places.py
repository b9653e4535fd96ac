"""Effects that the states of a place share: their correlation, and least squares that takes it into account.

ln F of a state mean = map + effect of its place + own effect. With rho the share of the place in the variance s^2 of
both, states at one place are correlated by rho, others not at all (docs/equations.md, "Places").
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Indices
from forcemap.maps.regression import Regression, least_squares

FALL = 0.5
"""How far the restricted log-likelihood falls from its maximum to the correlation that the bound is computed with. At
the maximum itself the bound covers in 0.76 to 0.94 of campaigns only (docs/decisions.md)."""

LEAST_BETWEEN = 3
"""Places needed beyond those that the terms of place take up: fewer do not show how far places scatter."""

_LEAST_EIGENVALUE = 0.08
"""Information, in states, that places must have in a direction to count. Plans have 0.11 or more; positions read up to
6 mm off, state by state, up to 0.04 in directions that the terms take up (docs/decisions.md)."""

_HIGHEST = 1 - 1e-4  # correlation; at 1 the states of a place would have no variance of their own
_STEPS = 512  # of the correlation; between two of them the likelihood is taken as straight


@dataclass(frozen=True)
class PlaceEffect:
    """How strongly the states of a place are correlated, as estimated from the fitted states.

    Parameters
    ----------
    correlation : float
        rho that fit and bound use: the largest at which the restricted log-likelihood is within FALL of its maximum.
    likely : float
        rho at the maximum.
    least : float
        The smallest rho at which it is within FALL of its maximum, which standard errors reckon with, too.
    places : int
        Number of places.
    between : int
        Degrees of freedom between places: how many places the terms of place do not take up.
    """

    correlation: float
    likely: float
    least: float
    places: int
    between: int


@dataclass(frozen=True, eq=False)
class PlaceRegression(Regression):
    """Generalised least squares with states of a place correlated by rho; R is that of V^-1/2 X = QR.

    Parameters
    ----------
    squares : float
        e'V^-1 e, V having 1 on its diagonal, rho between states of a place and 0 elsewhere.
    """

    squares: float

    @property
    def residual_squares(self) -> float:
        """e'V^-1 e: over n - p the variance s^2 of a state, effect of its place included."""
        return self.squares


def place_effect(design: FloatArray, response: FloatArray, place: Indices) -> PlaceEffect:
    """The correlation of states of a place by restricted maximum likelihood.

    With K an orthonormal base of what the columns of X leave, mu the eigenvalues of K'ZZ'K (Z: which state lies at
    which place; those that are not 0 are Z'KK'Z's), w the residuals K'y along its eigenvectors, and
    v = 1 - rho + rho mu (Patterson and Thompson 1971, https://doi.org/10.1093/biomet/58.3.545),

        l(rho) = -1/2 [ (n - p) ln sum(w^2 / v) + sum ln v ].

    Parameters
    ----------
    design : array, shape (n, p)
        Design matrix X of the states.
    response : array, shape (n,)
        ln F of the states.
    place : array of int, shape (n,)
        Place of each state, numbered from 0.
    """
    n, p = design.shape
    count = np.bincount(place)
    if n <= p:
        return PlaceEffect(0.0, 0.0, 0.0, count.size, 0)
    if count.max() == 1:  # rho is unknown
        return PlaceEffect(0.0, 0.0, 0.0, count.size, places_between(design, place))
    upper, likely, least, between = shared_part(design, response, members(place))
    return PlaceEffect(upper, likely, least, count.size, between)


def shared_part(
    design: FloatArray, response: FloatArray, member: FloatArray, penalty: float = 0.0
) -> tuple[float, float, float, int]:
    """The share rho of effects of groups in a variance: upper end, likeliest, lower end; degrees of freedom.

    As in `place_effect`, for observations with Z, shape (n, k), in place of places: covariance in proportion to
    (1 - rho) I + rho ZZ'. Observations in no group have the variance 1 - rho alone. The log-likelihood is lowered by
    `penalty` rho / (1 - rho).
    """
    n, p = design.shape
    base, mu, along = _between(design, member)
    residual, between = response - base @ (base.T @ response), mu.size
    if between == 0:  # rho makes no difference
        return 0.0, 0.0, 0.0, 0
    squares = np.square(along.T @ (member.T @ residual)) / mu
    within = max(0.0, float(residual @ residual - squares.sum()))  # along the n - p - between others, whose mu is 0
    rho = _HIGHEST * (1 - np.linspace(1.0, 0.0, _STEPS) ** 3)  # denser where it is high
    v = 1 - rho[:, None] * (1 - mu)
    with np.errstate(divide="ignore"):
        logs = np.log(v).sum(axis=1) + (n - p - between) * np.log1p(-rho)
        value = -0.5 * ((n - p) * np.log((squares / v).sum(axis=1) + within / (1 - rho)) + logs)
        value -= penalty * rho / (1 - rho)
    first, last = np.flatnonzero(value >= value.max() - FALL)[[0, -1]].tolist()
    correlation = float(rho[last])
    if last + 1 < _STEPS:
        share = (value[last] - value.max() + FALL) / (value[last] - value[last + 1])
        correlation += float(share * (rho[last + 1] - rho[last]))
    return correlation, float(rho[value.argmax()]), float(rho[max(first - 1, 0)]), between


def places_between(design: FloatArray, place: Indices) -> int:
    """Degrees of freedom between places, as `PlaceEffect.between`."""
    n, p = design.shape
    return _between(design, members(place))[1].size if n > p else 0


def members(place: Indices) -> FloatArray:
    """Z: 1 where a state lies at a numbered place, else 0, shape (n, k)."""
    return np.asarray(place[:, None] == np.arange(place.max() + 1), dtype=np.float64)


def _between(design: FloatArray, member: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """An orthonormal base of the columns of X; the eigenvalues mu that count; their eigenvectors in groups."""
    base = np.linalg.qr(design)[0]
    shared = base.T @ member
    mu, along = np.linalg.eigh(member.T @ member - shared.T @ shared)
    return base, mu[mu > _LEAST_EIGENVALUE], along[:, mu > _LEAST_EIGENVALUE]


def place_regression(
    design: FloatArray, response: FloatArray, place: Indices, correlation: float | FloatArray
) -> PlaceRegression:
    """Generalised least squares with the states of a place correlated.

    Parameters
    ----------
    design, response, place
        As in `place_effect`.
    correlation : float or array
        rho, from 0 to below 1; of the place of each state where they differ, shape (n,), as in `whitened`.

    Raises
    ------
    TooFewStates, RankDeficient
        The states do not determine the coefficients.
    """
    white = whitened(np.column_stack([design, response]), place, correlation)
    fit = least_squares(white[:, :-1], white[:, -1])
    return PlaceRegression(design, response, fit.coefficients, fit.inverse_triangle, fit.residual_squares)


def error_growth(design: FloatArray, place: Indices, effect: PlaceEffect) -> FloatArray:
    """By which factors standard errors grow if states of a place share as little as is likely, shape (p,), 1 or more.

    Coefficients b = Ay with A = (X'V^-1 X)^-1 X'V^-1 for the largest likely rho have the covariance s^2 AV'A' if V' is
    the correlation in truth. Along rho' that is a straight line, so it is largest at an end of what is likely: at the
    upper end for terms that only places tell apart, at the lower one for those that follow the differences between the
    states of a place, as terms of speed do.
    """
    white = whitened(design, place, effect.correlation)
    inverse = np.linalg.inv(white.T @ white)  # AVA'
    estimator = (whitened(white, place, effect.correlation) @ inverse).T  # A, as V^-1/2 is symmetric
    own, shared = np.square(estimator).sum(axis=1), np.square(estimator @ members(place)).sum(axis=1)
    least = (1 - effect.least) * own + effect.least * shared
    return np.asarray(np.sqrt(np.maximum(least / np.diag(inverse), 1.0)))


def whitened(rows: FloatArray, place: Indices, correlation: float | FloatArray) -> FloatArray:
    """V^-1/2 times rows of states, shape (n, k): differences within a place get more weight, what it shares less.

    Where correlations differ, shape (n,), those of a place being the same, own effects have one variance everywhere and
    V has 1 on its diagonal for the last state.
    """
    _, first, place = np.unique(place, return_index=True, return_inverse=True)
    count, rho = np.bincount(place), np.broadcast_to(correlation, place.shape)
    last = float(rho[-1]) if rho.size else 0.0
    mean = np.stack([np.bincount(place, column) for column in rows.T], axis=1) / count[:, None]
    own = 1 / math.sqrt(1 - last)
    shared = 1 / np.sqrt(1 - last + (1 - last) / (1 - rho[first]) * rho[first] * count)
    return np.asarray(own * rows + ((shared - own)[:, None] * mean)[place])


def correlations(place: Indices, correlation: float) -> FloatArray:
    """V of states at numbered places, shape (n, n): 1 on its diagonal, rho within a place, 0 elsewhere."""
    same = place[:, None] == place
    return np.asarray(correlation * same + (1 - correlation) * np.eye(place.size))
