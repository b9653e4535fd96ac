"""I-optimal designs: the states that make the mean prediction variance over a region smallest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Indices
from forcemap.campaigns.state import StateTolerance
from forcemap.errors import InputError, RankDeficient, TooFewStates
from forcemap.maps.forms import CFM_3D, Form
from forcemap.planning.bound_width import STATE_SD, mean_width
from forcemap.planning.optimal_exchange import Apart, Exchange, whitening

_STARTS = 8  # random designs the exchange starts from


@dataclass(frozen=True, eq=False)
class DesignedStates:
    """States chosen from candidates, with what a campaign of them is expected to give.

    Parameters
    ----------
    index : array of int
        Which candidates, ascending, shape (n,).
    states : array
        (distance, height, speed) of each [m, m, m/s], shape (n, 3).
    mean_variance : float
        Mean over the region of the prediction's variance, as a share of the variance of a state.
    bound_width : float
        Mean over the region of the tolerance bound above the prediction, as a share of it, at `state_sd`; NaN with
        fewer than one residual degree of freedom.
    state_sd : float
        Standard deviation of the state effect that the width is stated for, about a share of the force.
    """

    index: Indices
    states: FloatArray
    mean_variance: float
    bound_width: float
    state_sd: float


def optimal_states(
    candidates: ArrayLike,
    n: int,
    *,
    form: Form = CFM_3D,
    region: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    fixed: ArrayLike = (),
    required: ArrayLike = (),
    state_sd: float = STATE_SD,
    tolerance: StateTolerance = StateTolerance(),  # noqa: B008 - frozen
    seed: int = 0,
) -> DesignedStates:
    """Choose n of the candidate states so that the mean prediction variance over a region is smallest (I-optimal).

    By exchange (Fedorov 1972, Theory of Optimal Experiments): from several random designs, each state in turn is
    taken out and the candidate put in that makes tr(M (X'X)^-1) smallest, M the mean of x x' over the region, until
    no exchange helps. With D = (X'X)^-1 without that state, a candidate x lowers it by x'D M D x / (1 + x'D x).

    Parameters
    ----------
    candidates : array
        (distance, height, speed) [m, m, m/s], shape (m, 3).
    n : int
        How many to choose, the required ones included.
    form : Form
        The map that will be fitted.
    region : array, optional
        States over which the map is to be precise, shape (k, 3); the candidates if not given.
    weights : array, optional
        How much each state of the region counts, shape (k,); all the same if not given.
    fixed : array
        States that are measured already, shape (f, 3); they are not among the n.
    required : array of int
        Numbers of candidates that must be chosen.
    state_sd : float
        Standard deviation of the state effect for which `bound_width` is stated.
    tolerance : StateTolerance
        States are chosen further apart than this, from each other and from the fixed ones.
    seed : int
        Of the random designs.

    Returns
    -------
    DesignedStates

    Raises
    ------
    InputError
        Arrays of another shape, figures that are not finite, or n outside its range.
    TooFewStates
        Fewer states, fixed ones included, than the form has coefficients.
    RankDeficient
        The candidates and fixed states do not tell the terms of the form apart.

    Examples
    --------
    >>> import numpy as np
    >>> axes = [0.5, 0.6, 0.7, 0.8], [0.1, 0.2, 0.3, 0.4], [0.1, 0.2, 0.3]
    >>> grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)
    >>> optimal_states(grid, 18).states.shape
    (18, 3)
    """
    points = _states("candidates", candidates)
    known = _states("fixed", fixed)
    wanted = points if region is None else _states("region", region)
    if not len(points) or not len(wanted):
        raise InputError("candidates: found none, expected states to choose from and a region")
    weight = np.full(len(wanted), 1.0) if weights is None else np.asarray(weights, dtype=np.float64)
    if weight.shape != (len(wanted),) or not np.all((weight >= 0) & (weight < math.inf)) or not weight.sum() > 0:
        raise InputError("weights: expected one finite number of at least 0 for each state of the region, not all 0")
    if not 0 < state_sd < 1:
        raise InputError(f"state SD: found {state_sd:g}, expected a share of the force between 0 and 1")
    must = np.unique(np.asarray(required, dtype=np.int64))
    if must.size and not (must[0] >= 0 and must[-1] < len(points)):
        raise InputError(f"required: found {must[-1]}, expected numbers of candidates from 0 to {len(points) - 1}")
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or not max(1, must.size) <= n <= len(points):
        raise InputError(
            f"states: found {n!r}, expected a whole number from {max(1, must.size)} to {len(points)}, "
            "the number of candidates"
        )
    p = len(form.terms)
    if n + len(known) < p:
        raise TooFewStates(f"found {n + len(known)} states, expected at least {p}, one for each coefficient")

    every = np.vstack([points, known])
    scale = whitening(form.design(*every.T))
    x, x_known = form.design(*points.T) @ scale, form.design(*known.T) @ scale
    x_region = form.design(*wanted.T) @ scale
    moment = (x_region * (weight / weight.sum())[:, None]).T @ x_region
    apart = Apart(points, known, tolerance)
    search = Exchange(x, x_known.T @ x_known, moment, apart, must, int(n))
    rng = np.random.default_rng(seed)
    best = min((search.from_start(rng) for _ in range(_STARTS)), key=lambda found: (found[0], found[1].tolist()))
    value, index = best
    if not math.isfinite(value):
        raise RankDeficient("found candidates further apart than the tolerance too few, expected more to choose from")
    chosen = np.vstack([x[index], x_known])
    inverse = np.linalg.inv(chosen.T @ chosen)
    leverage = np.einsum("ij,jk,ik->i", x_region, inverse, x_region)
    freedom = n + len(known) - p
    width = mean_width(leverage, weight, freedom, state_sd) if freedom > 0 else math.nan
    return DesignedStates(index, points[index], value, width, state_sd)


def _states(name: str, values: ArrayLike) -> FloatArray:
    states = np.asarray(values, dtype=np.float64)
    if states.size == 0:
        return np.empty((0, 3))
    if states.ndim != 2 or states.shape[1] != 3 or not np.isfinite(states).all():
        raise InputError(f"{name}: expected finite (distance, height, speed), an array of shape (n, 3)")
    return states


def most_useful(states: FloatArray, count: int, *, form: Form, region: FloatArray, fixed: FloatArray) -> list[int]:
    """Numbers of the states, shape (n, 3), that lower the mean variance over the region most, one after the other.

    The fixed states must determine the form by themselves.
    """
    scale = whitening(form.design(*np.vstack([states, fixed]).T))
    x, known, wanted = (form.design(*each.T) @ scale for each in (states, fixed, region))
    information, moment = known.T @ known, wanted.T @ wanted
    chosen: list[int] = []
    while len(chosen) < min(count, len(states)):
        inverse = np.linalg.inv(information)
        lower = (x @ inverse @ moment @ inverse * x).sum(axis=1) / (1 + (x @ inverse * x).sum(axis=1))
        lower[chosen] = -math.inf
        chosen.append(int(lower.argmax()))
        information = information + np.outer(x[chosen[-1]], x[chosen[-1]])
    return chosen
