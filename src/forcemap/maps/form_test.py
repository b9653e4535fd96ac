"""Does a form fit? Tests of the states of a map against the shape that the form gives the force.

A departure is a column beside the terms: a bump around a distance, a height or a speed, further powers of one of them,
or an effect of one place. An F test of each (docs/equations.md, "Does the form fit?") asks whether the states need it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.campaigns.dataset import States, StateTolerance
from forcemap.errors import FitError
from forcemap.findings import Finding, FindingKind
from forcemap.maps.forms import Form
from forcemap.maps.places import LEAST_BETWEEN, place_effect, whitened
from forcemap.maps.regression import EXACT, holm, least_squares

ERROR_PROBABILITY = 0.05
"""False alarms: the largest share of campaigns whose states follow the form in which a departure is significant."""

GAP = 0.35
"""A part of the range of distance, height or speed, as a share of it, with no more than one state or place inside: a
shape there passes unnoticed. A choice: three levels leave parts of 0.5, the default plan none above 0.2."""

NEAR = 0.03
"""Places closer than this [m] in distance and in height probably share an effect, but only those within `PLACE_SIZE`
count as one. A choice."""

SLOW_PLACES = 3
"""With fewer places at the slowest speed the bound there rests on faster impacts: speeds were covered in 0.01 to 0.50
of campaigns with one or two places, in 1.00 with three or four (docs/decisions.md)."""

MOST_SCATTER = 0.06
"""Standard deviation of states about the form: twice what the paper's robots show. Above it impacts, speeds or the form
are not what they should be, even if no departure is significant."""

_AXES = ("distance", "height", "speed")
_UNITS = {"distance": "m", "height": "m", "speed": "m/s"}

_BUMP = 0.1
"""Share of the range at which a bump has fallen to 1/e, and distance between bumps (docs/decisions.md: tenths)."""

_POWERS = (1, 2, 3)
"""Further powers of a coordinate that a departure along it has: as many as a cubic bend."""

_LEAST_LEFT = 0.1
"""Share of a departure's length that the terms of the form must leave, else it is one of them. A choice."""

_WITHIN = 0.25
"""Share of what the terms leave that must differ between states of one place for a test on these differences alone,
which is exact (docs/decisions.md). A choice: less leaves too little to test."""

FEW_SHARED = 0.5
"""Share of places that several states share, below which the tests between places are no tests at 5 %
(docs/validity.md). A choice between the plans there that were tried."""

SMALL_FALL = 0.05
"""Share by which a force may fall from one speed to the next at a place without being said; a choice."""

_LATE = 0.01
"""Share of slow states that lie as far above the faster ones, continued, by scatter alone: one of them is named. A
choice."""

_FURTHEST = 3
"""States furthest from the form that are named where states scatter. A choice."""

_LEAST_FREEDOM = 3
"""Residual degrees of freedom below which no departure is tested. A choice, as for a tolerance bound."""

_DECIMALS = 9  # of a width [m], [m/s]
_RANK = 1e-8  # of the largest singular value; a smaller one is a linear combination up to rounding
_SAME = 1e-6  # share by which departures up and down may differ by rounding


@dataclass(frozen=True)
class Departure:
    """A departure of the states from the form: the most significant one along an axis, or at a single place.

    Parameters
    ----------
    along : str
        "distance", "height" or "speed": around one value of it, or by further powers of it; "place": at one place.
    distance, height, speed : float
        Where it is, of a bend where it is largest [m], [m], [m/s]; NaN for a coordinate that it does not depend on.
    effect : float
        Share by which the force lies above the form at the state where the departure is largest; negative if below. It
        lies above where it is as large in both directions, as within places of two states each.
    tested : int
        Number of departures of this kind that were tested.
    p_value : float
        Adjusted for all departures tested (Bonferroni within a kind, Holm 1979 over the kinds).
    bends : bool
        True for further powers of the coordinate, all over its range.
    """

    along: str
    distance: float
    height: float
    speed: float
    effect: float
    tested: int
    p_value: float
    bends: bool = False

    @property
    def finding(self) -> Finding:
        """The departure in one sentence."""
        where = {"distance_m": self.distance, "height_m": self.height, "speed_mps": self.speed}
        figures = {"effect": abs(self.effect), "above": self.effect > 0, "p": self.p_value}
        return Finding.of(FindingKind.FORM_DEPARTURE, along=self.along, **where, bends=self.bends, **figures)


class Late(NamedTuple):
    """A state at the slowest speed, its force and the one that the form fitted to the faster states has there [N]."""

    state: str
    force_N: float
    continued_N: float


@dataclass(frozen=True)
class FormTest:
    """Result of testing the form of a map against its states.

    Parameters
    ----------
    departures : tuple of Departure
        The most significant one of each kind that can be tested, the smallest p value first.
    states, left_out : int
        Number of states tested, and of states left out because one of their impacts is censored.
    gaps : tuple of str
        Along which of distance, height and speed a part of more than GAP of the range has at most one value inside.
    not_tested : tuple of str
        Other kinds of departure that these states cannot show.
    places, shared : int
        Number of places, and of those that several states share.
    near : int
        Number of pairs of places closer than NEAR.
    closest : tuple of four floats
        Distance and height of the two places of the closest of these pairs [m]; empty if there are none.
    slow_places : int
        Number of places measured at the slowest speed.
    slowest : float
        That speed [m/s].
    state_sd : float
        Standard deviation s of ln F of the states about the form.
    off : tuple of Finding
        The states furthest from the form, and where the measured force falls most with speed.
    between : tuple of (float, float)
        From where to where each of `gaps` reaches [m], [m], [m/s].
    late : Late or None
        The state at the slowest speed that lies most above the faster ones; None if scatter explains all of them.
    """

    departures: tuple[Departure, ...]
    states: int
    left_out: int
    gaps: tuple[str, ...]
    not_tested: tuple[str, ...]
    places: int
    shared: int
    near: int
    closest: tuple[float, ...]
    slow_places: int
    slowest: float
    state_sd: float
    off: tuple[Finding, ...] = ()
    between: tuple[tuple[float, float], ...] = ()
    late: Late | None = None

    @property
    def significant(self) -> tuple[Departure, ...]:
        """The departures that are significant."""
        return tuple(departure for departure in self.departures if departure.p_value <= ERROR_PROBABILITY)

    @property
    def p_value(self) -> float:
        """The smallest p value; NaN if nothing could be tested."""
        return min((departure.p_value for departure in self.departures), default=math.nan)

    @property
    def finding(self) -> Finding:
        """Whether the form fits, in one sentence."""
        kind, figures = FindingKind, {"states": self.states, "left_out": self.left_out}
        if not self.departures:
            return Finding.of(kind.FORM_NOT_TESTED, **figures)
        if self.significant:
            doubts = (departure.finding for departure in self.significant)
            figures |= {"places": self.places, "few_shared": self.few_shared}
            return Finding.of(kind.FORM_DOUBTED, *doubts, **figures, covered=self.covered)
        tested = sum(departure.tested for departure in self.departures)
        return Finding.of(kind.FORM_NOT_DOUBTED, **figures, tested=tested, p=self.p_value)

    @property
    def few_shared(self) -> bool:
        """Whether few places hold several states, so that a right form is found wrong too often."""
        return 0 < self.shared < FEW_SHARED * self.places

    @property
    def misses(self) -> bool:
        """Whether a departure is significant."""
        return bool(self.significant)

    @property
    def covered(self) -> bool:
        """Whether a tolerance bound widens enough by a departure: states are spread, and scatter little.

        In simulation it then covers as often where a departure was found as elsewhere (docs/validity.md).
        """
        return not (self.gaps or self.not_tested or self.scatter)

    @property
    def unseen(self) -> tuple[Finding, ...]:
        """What these states cannot show."""
        blind_spots = []
        if self.gaps:
            ends = zip(self.gaps, self.between, strict=True)
            gaps = [
                Finding.of(FindingKind.FORM_GAP, along=name, low=low, high=high, unit=_UNITS[name])
                for name, (low, high) in ends
            ]
            blind_spots.append(Finding.of(FindingKind.FORM_UNSEEN_BETWEEN, *gaps))
        elif self.departures and self.not_tested:
            blind_spots.append(Finding.of(FindingKind.FORM_PARTLY_TESTED, axes=self.not_tested))
        if self.near:
            names = ("distance_m", "height_m", "other_distance_m", "other_height_m")
            where = dict(zip(names, self.closest, strict=True))
            d, h, other_d, other_h = self.closest
            apart = {"along_m": abs(d - other_d), "up_m": abs(h - other_h), "near_m": NEAR}
            several = {"several": self.near > 1, "pairs": self.near}
            blind_spots.append(Finding.of(FindingKind.PLACES_NEAR, **apart, **where, **several))
        if self.slow_places < SLOW_PLACES:
            figures: dict[str, Any] = {"places": self.slow_places, "speed_mps": self.slowest, "least": SLOW_PLACES}
            figures |= self.late._asdict() if self.late else {"state": None}
            blind_spots.append(Finding.of(FindingKind.SLOW_AT_FEW_PLACES, **figures))
        return tuple(blind_spots)

    @property
    def scatter(self) -> tuple[Finding, ...]:
        """A warning if the states scatter about the form by more than they should."""
        figures = {"state_sd": self.state_sd, "most": MOST_SCATTER}
        return (Finding.of(FindingKind.STATES_SCATTER, *self.off, **figures),) if self.state_sd > MOST_SCATTER else ()

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """What must be said before every speed; what the bound covers stands among what a speed depends on."""
        doubt = () if self.departures and (self.covered or not self.misses) else (self.finding,)
        return (*doubt, *self.scatter, *self.unseen)


def form_test(form: Form, states: States, state_sd: float = math.nan, residuals: FloatArray | None = None) -> FormTest:
    """Test whether states have the form that is fitted to them.

    Parameters
    ----------
    form : Form
        The fitted form.
    states : States
        The states it was fitted to; those with a censored impact are left out, since their means are too low.
    state_sd : float, optional
        Standard deviation of ln F of the states about the fit.
    residuals : array (m,), optional
        ln F of the states less that of the fit; NaN where it is not known.

    Returns
    -------
    FormTest
    """
    tested = states.select(states.censored == 0)
    departures = _most_significant(form, tested) if len(tested) else []
    slow = states.speed <= states.speed.min() + StateTolerance().speed
    place, places, gaps = states.place, states.places, gaps_of(states)
    near = _near(places)
    kinds = [departure.along for departure in departures]
    return FormTest(
        departures=tuple(sorted(departures, key=lambda departure: departure.p_value)),
        states=len(tested),
        left_out=len(states) - len(tested),
        gaps=tuple(gaps),
        between=tuple(gaps.values()),
        not_tested=tuple(kind for kind in (*_AXES, "place") if kind not in kinds and kind not in gaps),
        places=len(places),
        shared=int((np.bincount(place) > 1).sum()),
        near=len(near),
        closest=near[0] if near else (),
        slow_places=np.unique(place[slow]).size,
        slowest=float(states.speed.min()),
        state_sd=state_sd,
        late=_felt_late(form, tested, slow[states.censored == 0]),
        off=(*(() if residuals is None else _furthest(states, residuals)), *_falling(tested)),
    )


def _felt_late(form: Form, states: States, slow: Mask) -> Late | None:
    """Of the states at the slowest speed the one furthest above the form fitted to the others and continued downwards;
    None if none lies above what 99 of 100 do, or too few are left to tell."""
    late, others = states.select(slow), states.select(~slow)
    try:
        fit = least_squares(form.design(*others.coordinates.T), others.log_force)
    except FitError:
        return None
    if not len(late) or fit.degrees_of_freedom < _LEAST_FREEDOM:
        return None
    from scipy.special import stdtrit

    design = form.design(*late.coordinates.T)
    above = late.log_force - design @ fit.coefficients
    spread = fit.residual_sd * np.sqrt(1 + np.square(design @ fit.inverse_triangle).sum(axis=1))
    i = int(np.argmax(above / np.maximum(spread, EXACT)))
    if above[i] <= stdtrit(fit.degrees_of_freedom, 1 - _LATE) * spread[i] + EXACT:
        return None
    force = float(late.force[i])
    return Late(str(late.name[i]), force, force * math.exp(-above[i]))


def _furthest(states: States, residuals: FloatArray) -> Iterator[Finding]:
    """The states with the largest residuals, measured and predicted."""
    known = np.flatnonzero(~np.isnan(residuals))
    predicted = np.exp(states.log_force - residuals)
    for i in known[np.argsort(-np.abs(residuals[known]), kind="stable")][:_FURTHEST]:
        forces = {"force_N": float(states.force[i]), "predicted_N": float(predicted[i])}
        yield Finding.of(FindingKind.STATE_FURTHEST_OFF, state=str(states.name[i]), **forces)


def _falling(states: States) -> Iterator[Finding]:
    """Where the force of states without censored impacts falls most from a speed to the next one at the place."""
    if len(states) < 2:
        return
    order = np.lexsort((states.speed, states.place))
    place, force, speed = states.place[order], states.force[order], states.speed[order]
    fall = np.where(place[1:] == place[:-1], 1 - force[1:] / force[:-1], 0.0)
    i = int(fall.argmax())
    if fall[i] > SMALL_FALL:
        where = {"distance_m": float(states.distance[order[i]]), "height_m": float(states.height[order[i]])}
        slow, fast = ((float(speed[k]), float(force[k])) for k in (i, i + 1))
        pair = {"slow_mps": slow[0], "slow_N": slow[1], "fast_mps": fast[0], "fast_N": fast[1]}
        yield Finding.of(FindingKind.MEASURED_FALLS, **where, **pair)


def _near(places: FloatArray) -> list[tuple[float, ...]]:
    """Distance and height of both places of every pair closer than NEAR, the closest first; places of shape (n, 2)."""
    offsets = np.abs(places[:, None] - places)
    pairs = np.argwhere(np.triu(offsets.max(axis=2) < NEAR, 1))
    order = np.argsort(np.linalg.norm(offsets[tuple(pairs.T)], axis=1), kind="stable")
    return [tuple(places[pair].ravel().tolist()) for pair in pairs[order]]


def _most_significant(form: Form, states: States) -> list[Departure]:
    """The most significant departure of each kind that can be tested, with p values adjusted for all tests."""
    tester, candidates = _Tester.of(form, states), list(_candidates(states))
    departures = []
    for along in dict.fromkeys(departure.along for departure, _ in candidates):
        tests = [tester.test(departure, columns) for departure, columns in candidates if departure.along == along]
        if possible := [departure for departure in tests if departure]:
            best, number = min(possible, key=lambda departure: departure.p_value), len(possible)
            departures.append(replace(best, tested=number, p_value=min(1.0, best.p_value * number)))
    adjusted = holm(np.array([departure.p_value for departure in departures])).tolist()
    return [replace(departure, p_value=p) for departure, p in zip(departures, adjusted, strict=True)]


def gaps_of(states: States) -> dict[str, tuple[float, float]]:
    """Along which of distance, height and speed little was measured between widely spaced values, and which these
    are."""
    axes = zip(_AXES, (*states.places.T, states.speed), strict=True)
    return {name: ends for name, values in axes if (ends := _gap(values)) is not None}


def _gap(values: FloatArray) -> tuple[float, float] | None:
    """Ends of the widest part of the range of values with at most one value inside; None if it is no gap."""
    spread, ordered = float(np.ptp(values)), np.sort(values)
    if spread <= StateTolerance().place:
        return None
    if values.size <= 2:
        return float(ordered[0]), float(ordered[-1])
    i = int(np.argmax(np.round(ordered[2:] - ordered[:-2], _DECIMALS)))  # of several that are as wide the first
    low, high = float(ordered[i]), float(ordered[i + 2])
    return (low, high) if high - low > GAP * spread else None


def _candidates(states: States) -> Iterator[tuple[Departure, FloatArray]]:
    """Departures in order of their kinds, with their columns, shape (m, k)."""
    nowhere = Departure("", math.nan, math.nan, math.nan, math.nan, 0, math.nan)
    for along, values in zip(_AXES, states.coordinates.T, strict=True):
        low, spread = float(values.min()), float(np.ptp(values))
        if spread <= StateTolerance().place:
            continue
        share, departure = (values - low) / spread, replace(nowhere, along=along)
        for centre in np.unique(np.round(share / _BUMP)) * _BUMP:
            around = replace(departure, **{along: low + float(centre) * spread})  # type: ignore[arg-type]
            yield around, np.exp(-np.square((share - centre) / _BUMP))[:, None]
        yield replace(departure, bends=True), np.column_stack([(2 * share - 1) ** power for power in _POWERS])
    place = states.place
    for number in range(place.max() + 1):
        here = place == number
        distance, height = float(states.distance[here].mean()), float(states.height[here].mean())
        yield replace(nowhere, along="place", distance=distance, height=height), here.astype(np.float64)[:, None]


@dataclass(frozen=True, eq=False)
class _Tester:
    """Data of every test: ln F, coordinates and place of m states, bases of the terms, without and with an effect of
    every place."""

    response: FloatArray
    coordinates: FloatArray
    place: Indices
    terms: FloatArray
    terms_and_places: FloatArray

    @classmethod
    def of(cls, form: Form, states: States) -> _Tester:
        design, place = form.design(*states.coordinates.T), states.place
        place_columns = np.eye(place.max() + 1)[place]
        return cls(
            states.log_force, states.coordinates, place, _base(design), _base(np.hstack([design, place_columns]))
        )

    def test(self, departure: Departure, columns: FloatArray) -> Departure | None:
        """The F test of a departure; None where the states cannot show it.

        A departure that differs between the states of a place is tested on these differences alone, whatever effect
        their place has. Any other is tested by generalised least squares; the correlation of places is estimated with
        the departure among the terms, and the higher it is, the more the degrees of freedom are those of the places.
        """
        part, base, correlation = _left(self.terms, columns), self.terms, 0.0
        within = part - self.terms_and_places @ (self.terms_and_places.T @ part)
        if by_places := np.square(within).sum() < _WITHIN * part.shape[1]:
            effect = place_effect(np.hstack([base, part]), self.response, self.place)
            correlation = effect.correlation
        else:
            base = self.terms_and_places
            part = _left(base, part)
        rest = self.place.size - base.shape[1] - part.shape[1]
        if not part.shape[1] or rest < _LEAST_FREEDOM or (by_places and effect.between < LEAST_BETWEEN):
            return None
        from scipy.special import fdtrc

        freedom = effect.between + (1 - correlation) * (rest - effect.between) if by_places else rest
        white = whitened(np.column_stack([base, part, self.response]), self.place, correlation)
        triangle = np.asarray(np.linalg.qr(white, mode="r"))[base.shape[1] :, base.shape[1] :]
        explained, left = triangle[:-1, -1], float(triangle[-1, -1] ** 2) / rest
        ratio = float(explained @ explained) / explained.size / max(left, EXACT)
        effects = part @ np.linalg.solve(triangle[:-1, :-1], explained)
        sizes = np.abs(effects)
        largest = float(effects[sizes >= (1 - _SAME) * sizes.max()].max())
        if departure.bends:
            where = self.coordinates[int(np.argmax(effects == largest)), _AXES.index(departure.along)]
            departure = replace(departure, **{departure.along: float(where)})  # type: ignore[arg-type]
        p_value = float(fdtrc(explained.size, freedom, ratio))
        return replace(departure, effect=math.expm1(largest), p_value=p_value)


def _base(columns: FloatArray) -> FloatArray:
    """An orthonormal base of the space that columns, each scaled to length 1, span."""
    u, s, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    return np.asarray(u[:, s > _RANK * s[0]])


def _left(base: FloatArray, columns: FloatArray) -> FloatArray:
    """An orthonormal base of the part of columns outside a base; directions with next to nothing are left out."""
    u, s, _ = np.linalg.svd(columns - base @ (base.T @ columns), full_matrices=False)
    return np.asarray(u[:, s * math.sqrt(max(s.size, 1)) > _LEAST_LEFT * np.linalg.norm(columns)])
