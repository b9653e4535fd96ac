"""I-optimal designs: the states that make the mean prediction variance over a region smallest; the bound to expect."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.campaigns.state import StateTolerance
from forcemap.errors import InputError, RankDeficient, TooFewStates
from forcemap.maps.forms import CFM_3D, Form
from forcemap.planning.places import no_repeats

STATE_SD = 0.025
"""State effect that widths are stated for where none was measured: the paper's robots show 2.1 to 3.3 %."""

_STARTS = 8  # random designs the exchange starts from
_SWEEPS = 30  # over all states of a design; ten settle nearly every one
_RIDGE = 1e-6  # share of the information of the mean state that keeps a start with too few states invertible


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
    if n + len(known) < len(form.terms):
        raise TooFewStates(
            f"found {n + len(known)} states, expected at least {len(form.terms)}, one for each coefficient"
        )

    scale = _whitening(form.design(*np.vstack([points, known]).T))
    x, x_known, x_region = (form.design(*each.T) @ scale for each in (points, known, wanted))
    moment = (x_region * (weight / weight.sum())[:, None]).T @ x_region
    free = no_repeats(points, known, tolerance)
    search = _Exchange(x, x_known.T @ x_known, moment, points / tolerance.scale, free, must, int(n))
    rng = np.random.default_rng(seed)
    value, index = min((search.from_start(rng) for _ in range(_STARTS)), key=lambda best: (best[0], best[1].tolist()))
    if not math.isfinite(value):
        raise RankDeficient("found candidates further apart than the tolerance too few, expected more to choose from")
    chosen = np.vstack([points[index], known])
    width = expected_width(chosen, form=form, region=wanted, weights=weight, state_sd=state_sd)
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
    scale = _whitening(form.design(*np.vstack([states, fixed]).T))
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


def expected_width(
    states: FloatArray, *, form: Form, region: FloatArray, weights: FloatArray | None = None, state_sd: float = STATE_SD
) -> float:
    """Mean over a region, shape (k, 3), of the tolerance bound above the prediction, as a share of it.

    For a campaign of the states, shape (n, 3); NaN where they do not determine the form and its scatter.
    """
    freedom = len(states) - len(form.terms)
    if freedom < 1:
        return math.nan
    try:
        x = form.design(*region.T) @ _whitening(form.design(*states.T))
    except RankDeficient:
        return math.nan
    factor = tolerance_factor(np.square(x).sum(axis=1) / len(states), freedom)
    return float(np.average(np.expm1(np.minimum(state_sd * factor, 50.0)), weights=weights))


def tolerance_factor(
    leverage: FloatArray, freedom: float, *, confidence: float = 0.95, content: float = 0.95
) -> FloatArray:
    """sqrt(l) t' of the tolerance bound, shape (n,), read off a coarse table; for planning only."""
    from scipy.special import nctdtrit, ndtri

    root = np.sqrt(leverage)
    nodes = np.geomspace(max(float(root.min()), 1e-3), max(float(root.max()), 2e-3), 60)
    factors = nodes * nctdtrit(freedom, ndtri(content) / nodes, confidence)
    known = ~np.isnan(factors)
    return np.asarray(np.interp(root, nodes[known], factors[known]))


@dataclass(eq=False)
class _Exchange:
    """Fedorov's exchange: states of a design are replaced by better ones until none is.

    Rows of x are whitened, so that sums of squares are of one size.

    Parameters
    ----------
    x : array (m, p)
        Design rows of the candidates.
    known, moment : array (p, p)
        Information of the fixed states; mean of x x' over the region.
    points : array (m, 3)
        The candidates, in tolerances of repeats.
    free : array (m,)
        Which of them are no repeats of fixed states.
    must : array of int
        Candidates that must be chosen.
    n : int
        How many to choose.
    """

    x: FloatArray
    known: FloatArray
    moment: FloatArray
    points: FloatArray
    free: Mask
    must: Indices
    n: int
    _near: dict[int, Mask] = field(default_factory=dict)

    def near(self, index: int) -> Mask:
        """Candidates that are repeats of one, itself included."""
        if index not in self._near:
            self._near[index] = (np.abs(self.points - self.points[index]) <= 1).all(axis=1)
        return self._near[index]

    def from_start(self, rng: np.random.Generator) -> tuple[float, Indices]:
        """The criterion and the design that the exchange reaches from a random one; infinite if there is none."""
        x, chosen = self.x, self.must.tolist()
        taken = np.zeros(len(x), dtype=np.int64)  # by how many of the chosen, as their repeats
        for one in chosen:
            taken += self.near(one)
        while len(chosen) < self.n:
            left = np.flatnonzero(self.free & (taken == 0))
            if not left.size:
                return math.inf, np.array(chosen)
            chosen.append(int(rng.choice(left)))
            taken += self.near(chosen[-1])
        information = self.known + _RIDGE * np.eye(x.shape[1]) + x[chosen].T @ x[chosen]
        for _ in range(_SWEEPS):
            changed = False
            for i in range(self.must.size, self.n):
                rest = information - np.outer(x[chosen[i]], x[chosen[i]])
                others = taken - self.near(chosen[i])
                best = self._best(rest, self.free & (others == 0), chosen[i])
                if best != chosen[i]:
                    chosen[i], changed = best, True
                    information = rest + np.outer(x[best], x[best])
                    taken = others + self.near(best)
            if not changed:
                break
        index = np.sort(np.array(chosen, dtype=np.int64))
        information = self.known + x[index].T @ x[index]
        if np.linalg.cond(information) > 1e12:
            return math.inf, index
        return float(np.trace(np.linalg.solve(information, self.moment))), index

    def _best(self, rest: FloatArray, free: Mask, current: int) -> int:
        """The free candidate that lowers the criterion most, given the information of the other states."""
        inverse = np.linalg.inv(rest)
        both = self.x @ np.hstack([inverse @ self.moment @ inverse, inverse])
        p = self.x.shape[1]
        lower = np.einsum("ij,ij->i", both[:, :p], self.x) / (1 + np.einsum("ij,ij->i", both[:, p:], self.x))
        best = int(np.where(free, lower, -math.inf).argmax())
        return best if lower[best] > lower[current] * (1 + 1e-9) else current


def _whitening(design: FloatArray) -> FloatArray:
    """R^-1 sqrt(m) of the design = QR: afterwards the mean of x x' is the unit matrix."""
    length = np.linalg.norm(design, axis=0)
    length[length == 0] = 1.0
    q_r = np.linalg.qr(design / length, mode="r")
    if len(q_r) < design.shape[1] or np.linalg.cond(q_r) > 1e8:
        raise RankDeficient(
            f"found candidates that do not tell the {design.shape[1]} terms of the form apart; "
            "offer more distances, heights or speeds, or choose a form with fewer terms"
        )
    return np.asarray(np.linalg.inv(q_r) / length[:, None] * math.sqrt(len(design)))
