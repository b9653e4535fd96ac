"""Regression with censored observations, state effects and repeat noise, on arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.campaigns.dataset import States
from forcemap.errors import FitError
from forcemap.maps.regression import ScatterRegression, least_squares

_LEAST_EFFECT = 0.05
"""Least share of the variance of a state's mean that is attributed to the state effect. A choice: were repeats to
explain all of it, nothing would be left to integrate over."""

_LEAST_VARIANCE = 1e-12
"""Variance of ln F at which the search starts where states follow the terms exactly, as computed ones do."""

_CONVERGED = 1e-10
"""Slope of the likelihood, in ln F, below which the fit has converged (docs/decisions.md)."""

_SEARCH_BELOW, _SEARCH_ABOVE = 6.0, 10.0
"""How far below and above its start ln s^2 is searched: s from a 20th to the 150-fold. A choice: wider above, because
the start rests on the uncensored states and may be far too low."""

_FROM_END = 0.1  # of ln s^2; a maximum this close to an end of the search is none
_DIFFERENCE, _WIDE_DIFFERENCE = 0.02, 0.25  # of ln s^2, for its derivatives; the wide one bridges a kink
_FINE_STEP = 1e-4  # of ln s^2; a longer last step of Newton's method means a kink instead of a smooth maximum
_WIDE_STEP = 1e-2  # of ln s^2, by the wide difference; after a longer one a stated maximum is one by rounding only
_WIDE_BEND = 0.1  # share by which the second derivatives by both differences may differ at a stated maximum

# Numerical settings of the quadrature over the level of a censored state.
_NODES = 128
_EMPTY = 8.5  # standard deviations beyond which a normal distribution holds less than a double resolves
_NARROW = 0.25  # of the noise of repeats; a level that scatters less hardly varies where Phi rises
_MODE_WITHIN = 1e-3  # standard deviations; how precisely the mode of the integrand is needed
_NEWTON_STEPS = 100  # at most, to the mode; a handful are needed
_FAR_BELOW = -1e4  # standard deviations; from here down the rate z + phi / Phi is lost in rounding, its limit is 1
_HALVES = 50  # of a step of Newton's method to the coefficients, at most; rarely one is needed
_ROUNDING = 1e-12  # of a sum of logarithms of likelihoods, as a share of it


@dataclass(frozen=True, eq=False)
class StateData:
    """What the repeats of m states tell: ln F of a repeat is normal about the level of its state, levels about the map.

    Levels of states at one place are correlated: they share a part of their variance.

    Parameters
    ----------
    design : array
        Design matrix X, shape (m, p).
    mean : array
        Mean of the uncensored repeats' ln F, shape (m,); NaN where all are censored.
    impacts, censored : array of int
        Number of uncensored and of censored repeats, shape (m,).
    threshold : array
        ln of the force that the censored repeats reached at least, shape (m,); NaN where none is censored.
    repeat_variance : float
        Variance of ln F between repeats of a state; 0 if states are not repeated.
    place : array of int
        Place of each state, shape (m,).
    correlation : array
        rho of the states of the place of each state, from 0 to below 1, shape (m,); own effects have one variance.
    """

    design: FloatArray
    mean: FloatArray
    impacts: Indices
    censored: Indices
    threshold: FloatArray
    repeat_variance: float
    place: Indices
    correlation: FloatArray

    def select(self, mask: Mask) -> StateData:
        """The states where a mask of shape (m,) is true."""
        arrays: dict[str, Any] = {
            name: values[mask] for name, values in vars(self).items() if isinstance(values, np.ndarray)
        }
        return replace(self, **arrays)

    @classmethod
    def joined(cls, parts: Sequence[StateData]) -> StateData:
        """The states of several campaigns, the last one's last; a place of one campaign is none of another."""
        count = np.cumsum([0, *(part.place.max() + 1 for part in parts[:-1])])
        arrays: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in parts])
            for name, values in vars(parts[0]).items()
            if isinstance(values, np.ndarray)
        }
        arrays["place"] = np.concatenate([part.place + first for part, first in zip(parts, count, strict=True)])
        return cls(**arrays, repeat_variance=parts[-1].repeat_variance)

    @property
    def noise_of_means(self) -> float:
        """Variance that the noise of repeats leaves in the mean of a state, on average over the states."""
        return self.repeat_variance * float(np.mean(1.0 / (self.impacts + self.censored)))

    @property
    def own_share(self) -> float:
        """Share of its own effect, 1 - rho, in the variance of the last state."""
        return float(1 - self.correlation[-1]) if self.correlation.size else 1.0

    @property
    def with_places(self) -> StateData:
        """The same data with the effects of k places as coefficients before the others, each observed as 0.

        An effect u of variance rho s^2 beside own effects of variance (1 - rho) s^2 enters as the observation
        u sqrt((1 - rho) / rho) = 0 with the variance of own effects (Henderson's mixed model equations). The other
        coefficients then equal those of generalised least squares.
        """
        names, first = np.unique(self.place, return_index=True)
        shared = self.correlation[first] > 0
        names, rho = names[shared], self.correlation[first][shared]
        k, m = names.size, self.mean.size
        if not k:
            return self
        place_columns = np.zeros((m + k, k))
        place_columns[:m] = self.place[:, None] == names
        place_columns[m:] = np.diag(np.sqrt((1 - rho) / rho))
        return replace(
            self,
            design=np.hstack([place_columns, np.vstack([self.design, np.zeros((k, self.design.shape[1]))])]),
            mean=np.append(self.mean, np.zeros(k)),
            impacts=np.append(self.impacts, np.ones(k, dtype=np.int64)),
            censored=np.append(self.censored, np.zeros(k, dtype=np.int64)),
            threshold=np.append(self.threshold, np.full(k, math.nan)),
        )


def state_data(design: FloatArray, states: States, variance: float, correlation: float | FloatArray) -> StateData:
    """The repeats of states as the fit takes them.

    Parameters
    ----------
    design : array, shape (m, p)
        Terms of the states.
    states : States
    variance : float
        Of ln F between repeats of a state.
    correlation : float or array of shape (m,)
        rho of the states of a place.
    """
    return StateData(
        design=design,
        mean=states.log_force,
        impacts=states.impacts,
        censored=states.censored,
        threshold=np.log(states.at_least),
        repeat_variance=variance,
        place=states.place,
        correlation=np.broadcast_to(np.asarray(correlation, dtype=np.float64), (len(states),)),
    )


@dataclass(frozen=True, eq=False)
class CensoredRegression(ScatterRegression):
    """A maximum-likelihood fit with censored states, in the form of weighted least squares.

    At the maximum the likelihood has the curvature of a regression with weights w: 1 for an uncensored state, less for
    a censored one. (X'WX)^-1 s^2 is the inverse of the observed information, and R is that of sqrt(W) X = QR; with
    effects of places, both are those of the coefficients of the map. The response is NaN for a wholly censored state,
    which has no residual. s is that of the restricted likelihood; its degrees of freedom, from the curvature of this
    likelihood, are n - p if every state is uncensored.

    Parameters
    ----------
    weights : array
        w of every state, shape (m,).
    repeat_variance : float
        Variance of ln F between repeats of a state.
    """

    weights: FloatArray
    repeat_variance: float


def censored_regression(data: StateData, stated_deviation: float | None = None) -> CensoredRegression:
    """Fit ln F by maximum likelihood; a censored repeat says "at least this much".

    For a state of level eta ~ N(x'b, tau^2) with n uncensored repeats of mean y and k censored ones at c, each with
    noise sigma, the likelihood is

        N(y; x'b, s^2) E[ Phi((eta - c) / sigma)^k | y ],   s^2 = tau^2 + sigma^2 / repeats.

    b maximises it for a given s^2; s^2 maximises the profile less half the logarithm of
    the information of b (Cox and Reid 1987), which without censoring is restricted maximum likelihood: s^2 =
    residual squares / (n - p), and b is least squares. Effects of places, `StateData.with_places`, are fitted with b,
    each held by its variance: without censoring that is restricted maximum likelihood and generalised least squares.
    A deviation that a file states saves the search if the likelihood has a smooth maximum there.

    Raises
    ------
    TooFewStates, RankDeficient
        The states with an uncensored repeat do not determine the coefficients by themselves.
    FitError
        The likelihood has no maximum.
    """
    m, p = data.design.shape
    known = data.impacts > 0
    if known.sum() <= p:
        raise FitError(
            f"found {int(known.sum())} states with an uncensored impact for {p} coefficients, "
            "expected more, so that their scatter can be told; measure more states or discard censored impacts"
        )
    least_squares(data.design[known], data.mean[known])  # refuses with figures of the map's coefficients alone
    profile = _Profile(data)
    missing = np.nan_to_num(np.maximum(data.threshold - data.design @ profile.start.coefficients[-p:], 0.0))
    start = math.log(max(profile.start.residual_sd**2 + np.mean(missing**2), _LEAST_VARIANCE))
    found = None
    if stated_deviation:
        found = _stated_maximum(profile, start, math.log(data.own_share * stated_deviation**2))
    if found is None:
        profile = _Profile(data)  # so that the search goes the same way whatever a file states
        found = _maximum(profile, start)
    log_variance, curvature = found
    coefficients, bend = profile.solve(log_variance)
    variance = math.exp(log_variance)
    return weighted_regression(
        data,
        coefficients=coefficients[-p:],
        weights=np.maximum(-bend[:m] * variance, 0.0),
        deviation=math.sqrt(variance / data.own_share),
        freedom=min(-2.0 * curvature, float(m - p)),
    )


def weighted_regression(
    data: StateData, *, coefficients: FloatArray, weights: FloatArray, deviation: float, freedom: float
) -> CensoredRegression:
    """A censored fit from its results, just computed or as a map file states them."""
    whole, p = data.with_places, coefficients.size
    root = np.sqrt(np.append(weights, np.ones(whole.mean.size - weights.size)))
    triangle = least_squares(whole.design * root[:, None], np.zeros(root.size)).inverse_triangle
    return CensoredRegression(
        design=data.design,
        response=data.mean,
        coefficients=coefficients,
        inverse_triangle=math.sqrt(data.own_share) * triangle[-p:, -p:],
        weights=weights,
        deviation=deviation,
        freedom=freedom,
        repeat_variance=data.repeat_variance,
    )


def coefficients_at(data: StateData, deviation: float) -> FloatArray:
    """The coefficients for a given standard deviation s of a state's mean, shape (p,).

    Raises
    ------
    FitError
        The states do not determine them, or the likelihood has no maximum.
    """
    return _Profile(data).solve(math.log(data.own_share * deviation**2))[0][-data.design.shape[1] :]


class _Profile:
    """Profile of the likelihood over ln s^2, adjusted for the estimated coefficients.

    Each solution starts from the one before. Effects of places are coefficients here, before those of the map, and s^2
    is the variance of own effects.
    """

    def __init__(self, data: StateData) -> None:
        self._noise_of_means, self._data = data.noise_of_means, data.with_places
        known = self._data.impacts > 0
        self.start = least_squares(self._data.design[known], self._data.mean[known])
        self._white = self.start.inverse_triangle
        self._last = np.linalg.solve(self._white, self.start.coefficients)

    def __call__(self, log_variance: float) -> float:
        coefficients, bend = self.solve(log_variance)
        value = float(self._likelihood(coefficients, log_variance)[0].sum())
        information = (self._data.design * -bend[:, None]).T @ self._data.design
        return value - 0.5 * float(np.linalg.slogdet(information)[1])

    def solve(self, log_variance: float) -> tuple[FloatArray, FloatArray]:
        """Coefficients that maximise the likelihood, and the second derivative in x'b of that of every state.

        Newton's method, a step halved until the likelihood, which is concave, does not fall; in coordinates in which
        X'X of the uncensored states is the unit matrix.
        """
        x, variance, z = self._data.design @ self._white, math.exp(log_variance), self._last
        value, slope, bend = self._likelihood(self._white @ z, log_variance)
        for _ in range(_NEWTON_STEPS):
            score = variance * x.T @ slope
            if np.linalg.norm(score) < _CONVERGED:
                self._last = z
                return self._white @ z, bend
            step, start, level = np.linalg.solve(variance * (x.T * -bend) @ x, score), z, value.sum()
            for _ in range(_HALVES):
                z, step = start + step, step / 2
                value, slope, bend = self._likelihood(self._white @ z, log_variance)
                if value.sum() >= level - _ROUNDING * abs(level):
                    break
        raise FitError("the censored fit does not converge; discard the censored impacts, or check their forces")

    def _likelihood(self, coefficients: FloatArray, log_variance: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Log-likelihood of every state, with its derivatives.

        States have the same weight however many repeats they have, as in least squares on their means: one state of
        many repeats must not outweigh the others.
        """
        variance = math.exp(log_variance)
        effect = max(variance - self._noise_of_means, _LEAST_EFFECT * variance)
        return _log_likelihood(self._data, coefficients, variance, effect)


def _log_likelihood(
    data: StateData, coefficients: FloatArray, variance: float, effect: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Log-likelihood of every state, shape (m,), with its first and second derivative in mu = x'b."""
    mu = data.design @ coefficients
    known, cut = data.impacts > 0, data.censored > 0
    with np.errstate(invalid="ignore"):
        residual = np.where(known, data.mean - mu, 0.0)
    value = np.where(known, -0.5 * (math.log(2 * np.pi * variance) + residual**2 / variance), 0.0)
    slope = residual / variance
    bend = np.where(known, -1.0 / variance, 0.0)
    if not cut.any():
        return value, slope, bend
    # the level of the state given its uncensored repeats: normal, mean m and variance r
    noise = max(data.repeat_variance, 1e-12 * effect)
    precision = 1.0 / effect + data.impacts[cut] / noise
    r = 1.0 / precision
    pull = np.where(known[cut], data.mean[cut], 0.0) * data.impacts[cut] / noise
    share = r / effect  # dm / dmu
    m = r * (mu[cut] / effect + pull)
    log_g, g1, g2 = _reached(m, np.sqrt(r), data.threshold[cut], math.sqrt(noise), data.censored[cut])
    value[cut] += log_g
    slope[cut] += share * g1
    bend[cut] += share**2 * g2
    return value, slope, bend


def _reached(
    m: FloatArray, sd: FloatArray, threshold: FloatArray, noise: float, count: Indices
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """ln G and its two derivatives in m, G(m) = E[ Phi((eta - c) / noise)^count ], eta ~ N(m, sd^2), shape (k,).

    Quadrature where Phi rises, the normal distribution function beyond, where it is 1. If eta hardly varies there,
    quadrature around the mode of the integrand, which is log-concave.
    """
    from scipy.special import log_ndtr

    narrow = sd < _NARROW * noise
    mode = np.zeros_like(m)
    mode[narrow] = _mode(m[narrow], sd[narrow], threshold[narrow], noise, count[narrow])
    low = np.where(narrow, mode - _EMPTY * sd, np.maximum(threshold - _EMPTY * noise, m - _EMPTY * sd))
    high = np.where(narrow, mode + _EMPTY * sd, np.maximum(threshold + _EMPTY * noise, low))
    nodes, weights = _legendre()
    half = (high - low)[:, None] / 2
    eta = low[:, None] + half * (1 + nodes)
    t = (eta - m[:, None]) / sd[:, None]
    log_g = -0.5 * t**2 - 0.5 * math.log(2 * np.pi) + count[:, None] * log_ndtr((eta - threshold[:, None]) / noise)
    log_g += np.log(np.maximum(half, 1e-300)) + np.log(weights) - np.log(sd)[:, None]
    u = (high - m) / sd  # beyond it Phi is 1
    log_tail = np.where(narrow, -np.inf, log_ndtr(-u))
    largest = np.maximum(log_g.max(axis=1), log_tail)
    mass = np.exp(log_g - largest[:, None])
    tail = np.exp(log_tail - largest)
    density = np.exp(np.where(narrow, -np.inf, -0.5 * u**2 - 0.5 * math.log(2 * np.pi) - largest))
    total = mass.sum(axis=1) + tail
    first = ((mass * t).sum(axis=1) + density) / total  # E[t]
    second = ((mass * t**2).sum(axis=1) + u * density + tail) / total  # E[t^2]
    return np.log(total) + largest, first / sd, (second - 1.0 - first**2) / sd**2


@lru_cache
def _legendre() -> tuple[FloatArray, FloatArray]:
    from scipy.special import roots_legendre

    nodes, weights = roots_legendre(_NODES)
    return nodes, weights


def _mode(m: FloatArray, sd: FloatArray, threshold: FloatArray, noise: float, count: Indices) -> FloatArray:
    """Where exp(-(eta - m)^2 / 2 sd^2) Phi((eta - c) / noise)^count is largest, to `_MODE_WITHIN` sd, shape (k,).

    With u = (eta - m) / sd the slope of its logarithm, count sd / noise phi(z) / Phi(z) - u, is convex, falls, and is
    not negative at u = 0: Newton's steps from there rise towards the root and never pass it.
    """
    from scipy.special import erfcx

    u, ratio = np.zeros_like(m), sd / noise
    for _ in range(_NEWTON_STEPS):
        z = (m + sd * u - threshold) / noise
        rate = math.sqrt(2 / math.pi) / erfcx(-z / math.sqrt(2.0))  # phi(z) / Phi(z)
        bend = np.where(z < _FAR_BELOW, 1.0, np.clip(rate * (z + rate), 0.0, 1.0))
        step = (count * ratio * rate - u) / (count * ratio**2 * bend + 1.0)
        u += step
        if not np.any(step > _MODE_WITHIN):
            break
    return np.asarray(m + sd * u)


def _maximum(profile: _Profile, start: float) -> tuple[float, float]:
    """Where the profile likelihood is largest, and its second derivative there."""
    ends = _ends(start)
    x = _searched(profile, ends)
    slope, bend = _derivatives(profile, x, _DIFFERENCE)
    if bend < 0 and abs(slope / bend) < _FINE_STEP:  # the slope locates the maximum to more digits than the value does
        x -= slope / bend
    else:  # repeats that contradict each other leave a kink where the state effect has its least share
        bend = _derivatives(profile, x, _WIDE_DIFFERENCE)[1]
    if not (ends[0] + _FROM_END < x < ends[1] - _FROM_END and bend < 0):
        raise FitError("the likelihood of the censored fit has no maximum; discard the censored impacts")
    return x, bend


def _stated_maximum(profile: _Profile, start: float, stated: float) -> tuple[float, float] | None:
    """The maximum and the second derivative at a stated ln s^2; None where it is no smooth maximum.

    Derivatives by a wide and by a fine difference must agree there: rounding gives a rough profile many small maxima.
    """
    low, high = _ends(start)
    if not low + _FROM_END < stated < high - _FROM_END:
        return None
    slope, bend = _derivatives(profile, stated, _DIFFERENCE)
    wide_slope, wide_bend = _derivatives(profile, stated, _WIDE_DIFFERENCE)
    smooth = bend < 0 and abs(wide_bend - bend) <= -_WIDE_BEND * bend and abs(wide_slope) <= -_WIDE_STEP * bend
    return (stated - slope / bend, bend) if smooth and abs(slope) <= -_FINE_STEP * bend else None


def _ends(start: float) -> tuple[float, float]:
    """Between which values of ln s^2 the maximum is searched."""
    return start - _SEARCH_BELOW, start + _SEARCH_ABOVE


def _derivatives(profile: _Profile, x: float, h: float) -> tuple[float, float]:
    """First and second derivative of the profile from five points, errors of order h^4."""
    a, b, c, d, e = (profile(x + k * h) for k in (-2, -1, 0, 1, 2))
    return (a - 8 * b + 8 * d - e) / (12 * h), (-a + 16 * b - 30 * c + 16 * d - e) / (12 * h * h)


def _searched(profile: _Profile, ends: tuple[float, float]) -> float:
    """Where the profile is largest between two ends."""
    from scipy.optimize import minimize_scalar

    best = minimize_scalar(lambda x: -profile(x), bounds=ends, method="bounded", options={"xatol": 1e-7})
    if not best.success:
        raise FitError("the likelihood of the censored fit has no maximum; discard the censored impacts")
    return float(best.x)
