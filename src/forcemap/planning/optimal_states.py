"""I-optimal designs: the states that make the mean prediction variance over a region smallest; the bound to expect."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.campaigns.state import StateTolerance, places as place_numbers
from forcemap.errors import InputError, RankDeficient, TooFewStates
from forcemap.maps.bounds import MIN_DEGREES_OF_FREEDOM
from forcemap.maps.forms import CFM_3D, Form
from forcemap.maps.places import LEAST_BETWEEN, place_effect, place_regression, places_between
from forcemap.planning.design import require_whole
from forcemap.planning.places import no_repeats

STATE_SD = 0.025
"""State effect that widths are stated for where none was measured: the paper's robots show 2.1 to 3.3 %."""

CORRELATION = 0.5
"""Of states of a place, for which widths are stated: half of the variance is the place's."""

MISFIT = 0.95
"""Correlation of what the form misses at two states close to each other; a plan of it finds other shapes, too."""

_REACH = 0.8  # share of the range of a coordinate in which that falls to 1/e
_CAMPAIGNS = 120  # simulated to tell the width of the bound
_STARTS = 4  # random designs the exchange starts from
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
    fixed, region, weights : array
        States measured already, shape (f, 3); states where the map is to be precise, shape (k, 3), and their weights.
    form : Form
        The map that will be fitted.
    state_sd : float
        Standard deviation of the state effect that the width is stated for, about a share of the force.
    """

    index: Indices
    states: FloatArray
    mean_variance: float
    fixed: FloatArray
    region: FloatArray
    weights: FloatArray
    form: Form
    state_sd: float

    @cached_property
    def bound_width(self) -> float:
        """Mean over the region of the tolerance bound above the prediction, as a share of it; NaN if there is none."""
        states = np.vstack([self.states, self.fixed])
        return expected_width(states, form=self.form, region=self.region, weights=self.weights, state_sd=self.state_sd)


def optimal_states(
    candidates: ArrayLike,
    n: int,
    *,
    form: Form = CFM_3D,
    region: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    fixed: ArrayLike = (),
    required: ArrayLike = (),
    places: int | None = None,
    misfit: float = MISFIT,
    state_sd: float = STATE_SD,
    tolerance: StateTolerance = StateTolerance(),  # noqa: B008 - frozen
    seed: int = 0,
) -> DesignedStates:
    """Choose n of the candidate states so that the mean prediction variance over a region is smallest (I-optimal).

    By exchange (Fedorov 1972, Theory of Optimal Experiments): from several random designs, each state in turn is
    taken out and the candidate put in that makes tr(M (X'V^-1 X)^-1) smallest, M the mean of x x' over the region,
    until no exchange helps. With D = (X'V^-1 X)^-1 without that state, a candidate lowers the criterion by
    z'D M D z / (w + z'D z), where z = x - X'V^-1 k and w = 1 - k'V^-1 k are what it tells beyond the other states,
    k its correlation with them.

    V has 1 on its diagonal and `misfit` exp(-(r / 0.8)^2) off it, r the distance of two states as shares of the ranges
    of distance, height and speed: what the form misses is alike at states close to each other, at one place most of
    all. So states lie apart in every coordinate, and see what an exact form would not ask for: a classical design
    (`misfit` 0) gathers them at a few levels, between which other shapes pass unseen.

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
    places : int, optional
        The most places to choose: so often is the device put up. Candidates within 20 mm of each other are one place.
    misfit : float
        From 0 to below 1.
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
    if not 0 <= misfit < 1:
        raise InputError(f"misfit: found {misfit:g}, expected a correlation from 0 to below 1")
    place = place_numbers(points[:, 0], points[:, 1])
    require_whole("places", places, max(1, np.unique(place[must]).size))
    if n + len(known) < len(form.terms):
        raise TooFewStates(
            f"found {n + len(known)} states, expected at least {len(form.terms)}, one for each coefficient"
        )

    scale = _whitening(form.design(*np.vstack([points, known]).T))
    x, x_known, x_region = (form.design(*each.T) @ scale for each in (points, known, wanted))
    moment = (x_region * (weight / weight.sum())[:, None]).T @ x_region
    free = no_repeats(points, known, tolerance)
    alike = _Alike.over(np.vstack([points, known, wanted]), misfit)
    before = _Members(x_known, known, alike)
    most = len(points) if places is None else int(places)
    search = _Exchange(x, points, before, moment, tolerance, free, place, must, int(n), most)
    rng = np.random.default_rng(seed)
    value, index = min((search.from_start(rng) for _ in range(_STARTS)), key=lambda best: (best[0], best[1].tolist()))
    if index.size < n:
        at = "" if places is None else f" at {most} places"
        raise RankDeficient(
            f"states: found {n}, expected fewer, or wider ranges: only {index.size}{at} of the {len(points)} "
            "candidates were found that are no repeats of each other"
        )
    if not math.isfinite(value):
        raise RankDeficient(
            f"states: found {n}, expected more, or wider ranges: nothing was found that determines {form.name} with "
            f"so few, {must.size} of them required"
        )
    return DesignedStates(index, points[index], value, known, wanted, weight, form, state_sd)


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
    alike, moment = _Alike.over(np.vstack([states, fixed, region]), MISFIT), wanted.T @ wanted
    chosen: list[int] = []
    while len(chosen) < min(count, len(states)):
        members = _Members(np.vstack([known, x[chosen]]), np.vstack([fixed, states[chosen]]), alike)
        gain = members.gain(x, alike(states, members.points), moment)
        gain[chosen] = -math.inf
        chosen.append(int(gain.argmax()))
    return chosen


def bound_from(states: FloatArray, form: Form) -> bool:
    """Whether a tolerance bound can be had from states, shape (n, 3): enough of them, at enough places."""
    if len(states) < len(form.terms) + MIN_DEGREES_OF_FREEDOM:
        return False
    place = place_numbers(states[:, 0], states[:, 1])
    try:
        x = form.design(*states.T) @ _whitening(form.design(*states.T))
    except RankDeficient:
        return False
    return places_between(x, place) >= LEAST_BETWEEN


def expected_width(
    states: FloatArray, *, form: Form, region: FloatArray, weights: FloatArray | None = None, state_sd: float = STATE_SD
) -> float:
    """Mean over a region, shape (k, 3), of the tolerance bound above the prediction, as a share of it.

    For campaigns of the states, shape (n, 3), those of a place correlated by CORRELATION, on average: by simulation,
    since the correlation that a campaign reckons with is its own. NaN where no bound can be had from them.
    """
    if not bound_from(states, form):
        return math.nan
    scale, place = _whitening(form.design(*states.T)), place_numbers(states[:, 0], states[:, 1])
    x, x_region = form.design(*states.T) @ scale, form.design(*region.T) @ scale
    rng = np.random.default_rng(0)
    shared, own = rng.standard_normal((_CAMPAIGNS, place.max() + 1)), rng.standard_normal((_CAMPAIGNS, len(states)))
    effects = state_sd * (math.sqrt(CORRELATION) * shared[:, place] + math.sqrt(1 - CORRELATION) * own)
    fits = [place_regression(x, each, place, place_effect(x, each, place).correlation) for each in effects]
    leverage = np.concatenate([np.square(x_region @ fit.inverse_triangle).sum(axis=1) for fit in fits])
    factor = tolerance_factor(leverage, len(states) - len(form.terms)).reshape(_CAMPAIGNS, -1)
    deviation = np.array([[fit.residual_sd] for fit in fits])
    return float(np.average(np.expm1(np.minimum(deviation * factor, 50.0)).mean(axis=0), weights=weights))


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


@dataclass(frozen=True, eq=False)
class _Alike:
    """How what a form misses is correlated between states, by how far they lie apart.

    Parameters
    ----------
    misfit : float
        For states close to each other.
    size : array (3,)
        How far apart it has fallen to 1/e [m, m, m/s].
    """

    misfit: float
    size: FloatArray

    @classmethod
    def over(cls, states: FloatArray, misfit: float) -> _Alike:
        """Over the ranges of states, shape (n, 3)."""
        span = np.ptp(states, axis=0)
        return cls(misfit, _REACH * np.where(span > 0, span, 1.0))

    def __call__(self, one: FloatArray, other: FloatArray) -> FloatArray:
        """The correlation of states, shapes (n, 3) and (m, 3), shape (n, m)."""
        squares = np.square((one[:, None] - other[None]) / self.size).sum(axis=2)
        return np.asarray(self.misfit * np.exp(-squares))


@dataclass(frozen=True, eq=False)
class _Members:
    """The states of a design: rows of their design matrix, shape (k, p), and where they lie, shape (k, 3)."""

    x: FloatArray
    points: FloatArray
    alike: _Alike

    @cached_property
    def inverse(self) -> FloatArray:
        """V^-1, shape (k, k)."""
        v = self.alike(self.points, self.points)
        np.fill_diagonal(v, 1.0)
        return np.asarray(np.linalg.inv(v))

    @property
    def information(self) -> FloatArray:
        """X'V^-1 X, shape (p, p)."""
        return np.asarray(self.x.T @ self.inverse @ self.x)

    def gain(self, x: FloatArray, alike: FloatArray, moment: FloatArray) -> FloatArray:
        """By how much each candidate, correlated with the members by rows of `alike`, lowers the mean variance."""
        p = x.shape[1]
        inverse = np.linalg.inv(self.information + _RIDGE * np.eye(p))
        weights = alike @ self.inverse
        tells = x - weights @ self.x
        own = 1 - (weights * alike).sum(axis=1)
        along = tells @ np.hstack([inverse @ moment @ inverse, inverse])
        return np.asarray((along[:, :p] * tells).sum(axis=1) / (own + (along[:, p:] * tells).sum(axis=1)))


@dataclass(eq=False)
class _Exchange:
    """Fedorov's exchange: states of a design are replaced by better ones until none is.

    Rows of x are whitened, so that sums of squares are of one size.

    Parameters
    ----------
    x, points : array (m, p), array (m, 3)
        Design rows of the candidates; where they lie.
    known : _Members
        The fixed states.
    moment : array (p, p)
        Mean of x x' over the region.
    tolerance : StateTolerance
        Candidates no further apart are repeats of one.
    free : array (m,)
        Which of them are no repeats of fixed states.
    place : array of int (m,)
    must : array of int
        Candidates that must be chosen.
    n, most : int
        How many to choose; at how many places at most.
    """

    x: FloatArray
    points: FloatArray
    known: _Members
    moment: FloatArray
    tolerance: StateTolerance
    free: Mask
    place: Indices
    must: Indices
    n: int
    most: int
    _near: dict[int, Mask] = field(default_factory=dict)

    def open(self, chosen: list[int]) -> Mask:
        """Which candidates may be added, shape (m,): no repeats, at chosen places alone once there are enough."""
        free, there = self.free.copy(), self.place[chosen]
        for one in chosen:
            if one not in self._near:
                self._near[one] = no_repeats(self.points, self.points[[one]], self.tolerance)
            free &= self._near[one]
        return free & np.isin(self.place, there) if np.unique(there).size >= self.most else free

    def with_states(self, chosen: list[int]) -> _Members:
        """The fixed states and the chosen ones."""
        known = self.known
        return _Members(
            np.vstack([known.x, self.x[chosen]]), np.vstack([known.points, self.points[chosen]]), known.alike
        )

    def from_start(self, rng: np.random.Generator) -> tuple[float, Indices]:
        """The criterion and the design that the exchange reaches from a random one; infinite if there is none."""
        chosen = self.must.tolist()
        while len(chosen) < self.n:
            left = np.flatnonzero(self.open(chosen))
            if not left.size:
                return math.inf, np.array(chosen)
            chosen.append(int(rng.choice(left)))
        alike = self.known.alike(self.points, self.with_states(chosen).points)
        for _ in range(_SWEEPS):
            changed = False
            for i in range(self.must.size, self.n):
                others, column = chosen[:i] + chosen[i + 1 :], len(self.known.x) + i
                gain = self.with_states(others).gain(self.x, np.delete(alike, column, axis=1), self.moment)
                best = int(np.where(self.open(others), gain, -math.inf).argmax())
                if gain[best] > gain[chosen[i]] * (1 + 1e-9):
                    chosen[i], changed = best, True
                    alike[:, column] = self.known.alike(self.points, self.points[[best]])[:, 0]
            if not changed:
                break
        index = np.sort(np.array(chosen, dtype=np.int64))
        information = self.with_states(index.tolist()).information
        if np.linalg.cond(information) > 1e12:
            return math.inf, index
        return float(np.trace(np.linalg.solve(information, self.moment))), index


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
