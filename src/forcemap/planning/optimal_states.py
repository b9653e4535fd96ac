"""I-optimal designs: the states that minimise the mean prediction variance over a region; the bound to expect."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.campaigns.state import StateTolerance, places as place_numbers
from forcemap.errors import InputError, RankDeficient, TooFewStates
from forcemap.maps.bounds import CONFIDENCE, CONTENT, MIN_DEGREES_OF_FREEDOM
from forcemap.maps.forms import CFM_3D, Form
from forcemap.maps.places import LEAST_BETWEEN, place_effect, place_regression, places_between
from forcemap.maps.regression import MAX_CONDITION
from forcemap.planning.design import require_whole
from forcemap.planning.places import no_repeats

STATE_SD = 0.025
"""State effect for which widths are stated where none was measured: the paper's robots show 2.1 to 3.3 %."""

CORRELATION = 0.5
"""Correlation of the states of a place for which widths are stated: half of the variance is the place's. A choice."""

MISFIT = 0.95
"""Correlation of what the form misses at two states close to each other: plans for it reveal other shapes, too. From
0.9 to 0.98 it hardly matters (docs/decisions.md)."""

LARGEST_LOG = 50.0
"""Largest ln of bound over prediction that planning distinguishes: larger ones are useless, and exp could overflow."""

_REACH = 0.8  # share of the range of a coordinate over which that falls to 1/e; 0.6 to 1.0 hardly matter
_CAMPAIGNS = 120  # simulated for the width of the bound; a choice
_STARTS = 4  # random designs from which the exchange starts; a choice
_SWEEPS = 30  # over all states of a design; ten settle nearly every one
_BETTER = 1e-9  # share by which an exchange must gain, so that rounding cannot make it go round in circles
_RIDGE = 1e-6  # share of the information of the mean state that keeps a start with too few states invertible
_MAX_INFORMATION_CONDITION = 1e12  # of X'V^-1 X; a choice: above it the criterion is lost in rounding
_TABLE_NODES = 60  # of the coarse table of tolerance factors
_LEAST_NODES = 1e-3, 2e-3  # least values of its first and last node of sqrt(l), so that they differ


@dataclass(frozen=True, eq=False)
class DesignedStates:
    """States chosen from candidates, with what a campaign of them is expected to give.

    Parameters
    ----------
    index : array of int
        Which candidates, ascending, shape (n,).
    states : array
        (distance, height, speed) of these [m, m, m/s], shape (n, 3).
    mean_variance : float
        Mean over the region of the prediction's variance, as a share of the variance of a state.
    fixed, region, weights : array
        States measured already, shape (f, 3); states where the map is to be precise, shape (k, 3), and their weights.
    form : Form
        The map that will be fitted.
    state_sd : float
        Standard deviation of the state effect for which the width is stated, nearly a share of the force.
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

    By exchange (Fedorov 1972, Theory of Optimal Experiments): starting from several random designs, each state in turn
    is replaced by the candidate that makes tr(M (X'V^-1 X)^-1) smallest, M the mean of x x' over the region, until no
    exchange helps. With D = (X'V^-1 X)^-1 without that state, a candidate lowers the criterion by
    z'D M D z / (w + z'D z), where z = x - X'V^-1 k and w = 1 - k'V^-1 k are what it adds to the other states, k its
    correlation with them.

    V has 1 on its diagonal and `misfit` exp(-(r / 0.8)^2) off it, r the distance of two states as shares of the ranges
    of distance, height and speed: what the form misses is similar at states close to each other, most of all at one
    place. So states are spread in every coordinate and reveal other shapes than the form's: a classical design
    (`misfit` 0) gathers them at a few levels, between which other shapes pass unnoticed.

    Parameters
    ----------
    candidates : array
        (distance, height, speed) [m, m, m/s], shape (m, 3).
    n : int
        Number of states to choose, the required ones included.
    form : Form
        The map that will be fitted.
    region : array, optional
        States over which the map is to be precise, shape (k, 3); the candidates if not given.
    weights : array, optional
        Weight of each state of the region, shape (k,); all the same if not given.
    fixed : array
        States that are measured already, shape (f, 3); they do not count among the n.
    required : array of int
        Numbers of candidates that must be chosen.
    places : int, optional
        The most places to choose: the device is set up once for each. Candidates within 20 mm of each other are one
        place.
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
    weight = _weights(weights, len(wanted))
    if not 0 < state_sd < 1:
        raise InputError(f"state SD: found {state_sd:g}, expected a share of the force between 0 and 1")
    must = _required(required, n, len(points))
    if not 0 <= misfit < 1:
        raise InputError(f"misfit: found {misfit:g}, expected a correlation from 0 to below 1")
    place = place_numbers(points[:, 0], points[:, 1])
    require_whole("places", places, max(1, np.unique(place[must]).size))
    if n + len(known) < len(form.terms):
        raise TooFewStates(
            f"found {n + len(known)} states, expected at least {len(form.terms)}, one for each coefficient"
        )

    scale = _whitening(form.design(*np.vstack([points, known]).T))
    x, x_known, x_region = (form.design(*states.T) @ scale for states in (points, known, wanted))
    moment = (x_region * (weight / weight.sum())[:, None]).T @ x_region
    free = no_repeats(points, known, tolerance)
    measured = _Members(x_known, known, _Misfit.over(np.vstack([points, known, wanted]), misfit))
    most = len(points) if places is None else int(places)
    search = _Exchange(x, points, measured, moment, tolerance, free, place, must, int(n), most)
    rng = np.random.default_rng(seed)
    value, index = min((search.from_start(rng) for _ in range(_STARTS)), key=lambda best: (best[0], best[1].tolist()))
    if index.size < n:
        at_places = "" if places is None else f" at {most} places"
        raise RankDeficient(
            f"states: found {n}, expected fewer, or wider ranges: only {index.size}{at_places} of the {len(points)} "
            "candidates were found that are no repeats of each other"
        )
    if not math.isfinite(value):
        raise RankDeficient(
            f"states: found {n}, expected more, or wider ranges: nothing was found that determines {form.name} with "
            f"so few, {must.size} of them required"
        )
    return DesignedStates(index, points[index], value, known, wanted, weight, form, state_sd)


def _weights(weights: ArrayLike | None, size: int) -> FloatArray:
    """Weights of the states of a region, shape (size,)."""
    weight = np.full(size, 1.0) if weights is None else np.asarray(weights, dtype=np.float64)
    if weight.shape != (size,) or not np.all((weight >= 0) & (weight < math.inf)) or not weight.sum() > 0:
        raise InputError("weights: expected one finite number of at least 0 for each state of the region, not all 0")
    return weight


def _required(required: ArrayLike, n: int, candidates: int) -> Indices:
    """Numbers of the candidates that must be chosen, ascending; they and n must be possible."""
    must = np.unique(np.asarray(required, dtype=np.int64))
    if must.size and not (must[0] >= 0 and must[-1] < candidates):
        raise InputError(f"required: found {must[-1]}, expected numbers of candidates from 0 to {candidates - 1}")
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or not max(1, must.size) <= n <= candidates:
        raise InputError(
            f"states: found {n!r}, expected a whole number from {max(1, must.size)} to {candidates}, "
            "the number of candidates"
        )
    return must


def _states(name: str, values: ArrayLike) -> FloatArray:
    """States as an array of shape (n, 3)."""
    states = np.asarray(values, dtype=np.float64)
    if states.size == 0:
        return np.empty((0, 3))
    if states.ndim != 2 or states.shape[1] != 3 or not np.isfinite(states).all():
        raise InputError(f"{name}: expected finite (distance, height, speed), an array of shape (n, 3)")
    return states


def most_useful(states: FloatArray, count: int, *, form: Form, region: FloatArray, fixed: FloatArray) -> list[int]:
    """Numbers of the states, shape (n, 3), each of which lowers the mean variance over the region most in its turn.

    The fixed states must determine the form by themselves.
    """
    scale = _whitening(form.design(*np.vstack([states, fixed]).T))
    x, known, wanted = (form.design(*points.T) @ scale for points in (states, fixed, region))
    correlation, moment = _Misfit.over(np.vstack([states, fixed, region]), MISFIT), wanted.T @ wanted
    chosen: list[int] = []
    while len(chosen) < min(count, len(states)):
        members = _Members(np.vstack([known, x[chosen]]), np.vstack([fixed, states[chosen]]), correlation)
        gain = members.gain(x, correlation(states, members.points), moment)
        gain[chosen] = -math.inf
        chosen.append(int(gain.argmax()))
    return chosen


def bound_from(states: FloatArray, form: Form) -> bool:
    """Whether states, shape (n, 3), are enough, and at enough places, for a tolerance bound."""
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

    Averaged over simulated campaigns of the states, shape (n, 3), those of a place correlated by CORRELATION: each
    campaign estimates a correlation of its own. NaN where the states are too few for a bound.
    """
    if not bound_from(states, form):
        return math.nan
    scale, place = _whitening(form.design(*states.T)), place_numbers(states[:, 0], states[:, 1])
    x, x_region = form.design(*states.T) @ scale, form.design(*region.T) @ scale
    rng = np.random.default_rng(0)
    shared, own = rng.standard_normal((_CAMPAIGNS, place.max() + 1)), rng.standard_normal((_CAMPAIGNS, len(states)))
    effects = state_sd * (math.sqrt(CORRELATION) * shared[:, place] + math.sqrt(1 - CORRELATION) * own)
    fits = [place_regression(x, y, place, place_effect(x, y, place).correlation) for y in effects]
    leverage = np.concatenate([np.square(x_region @ fit.inverse_triangle).sum(axis=1) for fit in fits])
    factor = tolerance_factor(leverage, len(states) - len(form.terms)).reshape(_CAMPAIGNS, -1)
    deviation = np.array([[fit.residual_sd] for fit in fits])
    return float(np.average(np.expm1(np.minimum(deviation * factor, LARGEST_LOG)).mean(axis=0), weights=weights))


def tolerance_factor(
    leverage: FloatArray, freedom: float, *, confidence: float = CONFIDENCE, content: float = CONTENT
) -> FloatArray:
    """sqrt(l) t' of the tolerance bound, shape (n,), interpolated in a coarse table; for planning only."""
    from scipy.special import nctdtrit, ndtri

    root, (first, last) = np.sqrt(leverage), _LEAST_NODES
    nodes = np.geomspace(max(float(root.min()), first), max(float(root.max()), last), _TABLE_NODES)
    factors = nodes * nctdtrit(freedom, ndtri(content) / nodes, confidence)
    known = ~np.isnan(factors)
    return np.asarray(np.interp(root, nodes[known], factors[known]))


@dataclass(frozen=True, eq=False)
class _Misfit:
    """Correlation between states of what a form misses, by their distance.

    Parameters
    ----------
    misfit : float
        Correlation of states close to each other.
    size : array (3,)
        Distance over which it falls to 1/e [m, m, m/s].
    """

    misfit: float
    size: FloatArray

    @classmethod
    def over(cls, states: FloatArray, misfit: float) -> _Misfit:
        """The correlation over the ranges of states, shape (n, 3)."""
        span = np.ptp(states, axis=0)
        return cls(misfit, _REACH * np.where(span > 0, span, 1.0))

    def __call__(self, one: FloatArray, other: FloatArray) -> FloatArray:
        """The correlation of states, shapes (n, 3) and (m, 3), shape (n, m)."""
        squares = np.square((one[:, None] - other[None]) / self.size).sum(axis=2)
        return np.asarray(self.misfit * np.exp(-squares))


@dataclass(frozen=True, eq=False)
class _Members:
    """The states of a design: rows of their design matrix, shape (k, p), and their coordinates, shape (k, 3)."""

    x: FloatArray
    points: FloatArray
    correlation: _Misfit

    @cached_property
    def inverse(self) -> FloatArray:
        """V^-1, shape (k, k)."""
        v = self.correlation(self.points, self.points)
        np.fill_diagonal(v, 1.0)
        return np.asarray(np.linalg.inv(v))

    @cached_property
    def information(self) -> FloatArray:
        """X'V^-1 X, shape (p, p)."""
        return np.asarray(self.x.T @ self.inverse @ self.x)

    def added(self, x: FloatArray, correlation: FloatArray) -> tuple[FloatArray, FloatArray]:
        """z and w of each candidate, shapes (m, p) and (m,), correlated with the members by a row of `correlation`."""
        weights = correlation @ self.inverse
        return x - weights @ self.x, 1 - (weights * correlation).sum(axis=1)

    def gain(self, x: FloatArray, correlation: FloatArray, moment: FloatArray) -> FloatArray:
        """How much each candidate lowers the mean variance, shape (m,)."""
        return _gain(*self.added(x, correlation), self.information, moment)

    def gain_without(
        self, member: int, z: FloatArray, w: FloatArray, correlation: FloatArray, moment: FloatArray
    ) -> FloatArray:
        """The same without one member: V^-1 without its row and column is V^-1 - v v' / v_i, v the i-th column."""
        v = self.inverse[:, member] / math.sqrt(self.inverse[member, member])
        along, row = correlation @ v, v @ self.x
        information = self.information - np.outer(row, row)
        return _gain(z + np.outer(along, row), w + np.square(along), information, moment)


def _gain(z: FloatArray, w: FloatArray, information: FloatArray, moment: FloatArray) -> FloatArray:
    """z'D M D z / (w + z'D z), shape (m,)."""
    p = len(information)
    inverse = np.linalg.inv(information + _RIDGE * np.eye(p))
    along = z @ np.hstack([inverse @ moment @ inverse, inverse])
    return np.asarray((along[:, :p] * z).sum(axis=1) / (w + (along[:, p:] * z).sum(axis=1)))


@dataclass(eq=False)
class _Exchange:
    """Fedorov's exchange: states of a design are replaced by better ones until there is no better one.

    Rows of x are whitened, so that sums of squares have the same size.

    Parameters
    ----------
    x, points : array (m, p), array (m, 3)
        Design rows of the candidates; their coordinates.
    known : _Members
        The fixed states.
    moment : array (p, p)
        Mean of x x' over the region.
    tolerance : StateTolerance
        Candidates no further apart than this are repeats of one state.
    free : array (m,)
        Which candidates are no repeats of fixed states.
    place : array of int (m,)
        Numbers of their places.
    must : array of int
        Candidates that must be chosen.
    n, most : int
        Number of states to choose; the most places.
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
        """Which candidates may be added, shape (m,): no repeats, and once there are enough places, only at these."""
        free, places = self.free.copy(), self.place[chosen]
        for number in chosen:
            if number not in self._near:
                self._near[number] = no_repeats(self.points, self.points[[number]], self.tolerance)
            free &= self._near[number]
        return free & np.isin(self.place, places) if np.unique(places).size >= self.most else free

    def with_states(self, chosen: list[int]) -> _Members:
        """The fixed states and the chosen ones."""
        known = self.known
        return _Members(
            np.vstack([known.x, self.x[chosen]]), np.vstack([known.points, self.points[chosen]]), known.correlation
        )

    def from_start(self, rng: np.random.Generator) -> tuple[float, Indices]:
        """The criterion, infinite if nothing fits, and the design that the exchange reaches from a random one."""
        chosen = self.must.tolist()
        while len(chosen) < self.n:
            left = np.flatnonzero(self.open(chosen))
            if not left.size:
                return math.inf, np.array(chosen)
            chosen.append(int(rng.choice(left)))
        correlation = self.known.correlation(self.points, self.with_states(chosen).points)
        members = self.with_states(chosen)
        added = members.added(self.x, correlation)
        for _ in range(_SWEEPS):
            changed = False
            for i in range(self.must.size, self.n):
                others, column = chosen[:i] + chosen[i + 1 :], len(self.known.x) + i
                gain = members.gain_without(column, *added, correlation, self.moment)
                best = int(np.where(self.open(others), gain, -math.inf).argmax())
                if gain[best] > gain[chosen[i]] * (1 + _BETTER):
                    chosen[i], changed = best, True
                    correlation[:, column] = self.known.correlation(self.points, self.points[[best]])[:, 0]
                    members = self.with_states(chosen)
                    added = members.added(self.x, correlation)
            if not changed:
                break
        index = np.sort(np.array(chosen, dtype=np.int64))
        information = self.with_states(index.tolist()).information
        if np.linalg.cond(information) > _MAX_INFORMATION_CONDITION:
            return math.inf, index
        return float(np.trace(np.linalg.solve(information, self.moment))), index


def _whitening(design: FloatArray) -> FloatArray:
    """R^-1 sqrt(m) of the design = QR: multiplied by it the mean of x x' is the unit matrix."""
    length = np.linalg.norm(design, axis=0)
    length[length == 0] = 1.0
    q_r = np.linalg.qr(design / length, mode="r")
    if len(q_r) < design.shape[1] or np.linalg.cond(q_r) > MAX_CONDITION:
        raise RankDeficient(
            f"found candidates that do not tell the {design.shape[1]} terms of the form apart; "
            "offer more distances, heights or speeds, or choose a form with fewer terms"
        )
    return np.asarray(np.linalg.inv(q_r) / length[:, None] * math.sqrt(len(design)))
