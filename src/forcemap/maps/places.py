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
    places : int
        Number of places.
    between : int
        Degrees of freedom between places: how many places the terms of place do not take up.
    """

    correlation: float
    likely: float
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
        return PlaceEffect(0.0, 0.0, count.size, 0)
    base, at_place, mu, along = _between(design, place)
    residual, between = response - base @ (base.T @ response), mu.size
    if count.max() == 1 or between == 0:  # rho is unknown, or makes no difference
        return PlaceEffect(0.0, 0.0, count.size, between)
    squares = np.square(along.T @ (at_place.T @ residual)) / mu
    within = max(0.0, float(residual @ residual - squares.sum()))  # along the n - p - between others, whose mu is 0
    rho = _HIGHEST * (1 - np.linspace(1.0, 0.0, _STEPS) ** 3)  # denser where it is high
    v = 1 - rho[:, None] * (1 - mu)
    with np.errstate(divide="ignore"):
        logs = np.log(v).sum(axis=1) + (n - p - between) * np.log1p(-rho)
        value = -0.5 * ((n - p) * np.log((squares / v).sum(axis=1) + within / (1 - rho)) + logs)
    best, last = int(value.argmax()), int(np.flatnonzero(value >= value.max() - FALL)[-1])
    correlation = float(rho[last])
    if last + 1 < _STEPS:
        share = (value[last] - value.max() + FALL) / (value[last] - value[last + 1])
        correlation += float(share * (rho[last + 1] - rho[last]))
    return PlaceEffect(correlation, float(rho[best]), count.size, between)


def places_between(design: FloatArray, place: Indices) -> int:
    """Degrees of freedom between places, as `PlaceEffect.between`."""
    n, p = design.shape
    return _between(design, place)[2].size if n > p else 0


def _between(design: FloatArray, place: Indices) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """An orthonormal base of the columns of X; Z; the eigenvalues mu that count; their eigenvectors in places."""
    count = np.bincount(place)
    base = np.linalg.qr(design)[0]
    at_place = (place[:, None] == np.arange(count.size)).astype(np.float64)
    shared = base.T @ at_place
    mu, along = np.linalg.eigh(np.diag(count) - shared.T @ shared)
    return base, at_place, mu[mu > _LEAST_EIGENVALUE], along[:, mu > _LEAST_EIGENVALUE]


def place_regression(design: FloatArray, response: FloatArray, place: Indices, correlation: float) -> PlaceRegression:
    """Generalised least squares with the states of a place correlated.

    Parameters
    ----------
    design, response, place
        As in `place_effect`.
    correlation : float
        rho, from 0 to below 1.

    Raises
    ------
    TooFewStates, RankDeficient
        The states do not determine the coefficients.
    """
    white = whitened(np.column_stack([design, response]), place, correlation)
    fit = least_squares(white[:, :-1], white[:, -1])
    return PlaceRegression(design, response, fit.coefficients, fit.inverse_triangle, fit.residual_squares)


def whitened(rows: FloatArray, place: Indices, correlation: float) -> FloatArray:
    """V^-1/2 times rows of states, shape (n, k): differences within a place get more weight, what it shares less."""
    place = np.unique(place, return_inverse=True)[1]
    count = np.bincount(place)
    mean = np.stack([np.bincount(place, column) for column in rows.T], axis=1) / count[:, None]
    own = 1 / math.sqrt(1 - correlation)
    shared = 1 / np.sqrt(1 - correlation + correlation * count)
    return np.asarray(own * rows + ((shared - own)[:, None] * mean)[place])


def correlations(place: Indices, correlation: float) -> FloatArray:
    """V of states at numbered places, shape (n, n): 1 on its diagonal, rho within a place, 0 elsewhere."""
    same = place[:, None] == place
    return np.asarray(correlation * same + (1 - correlation) * np.eye(place.size))
