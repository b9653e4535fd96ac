"""Does a form fit? What the states of a map, their places and speeds say against the shape that it gives the force.

A departure is a column beside the terms: a bump around a distance, a height or a speed, further powers of one of them,
a place of its own. An F test of each (docs/equations.md, "Does the form fit?") asks whether the states need it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from forcemap.arrays import FloatArray, Indices
from forcemap.campaigns.dataset import States, StateTolerance
from forcemap.findings import Finding, FindingKind
from forcemap.maps.forms import Form
from forcemap.maps.places import LEAST_BETWEEN, place_effect, whitened
from forcemap.maps.regression import holm

ERROR_PROBABILITY = 0.05
"""Share of campaigns in the form in which any departure is found, at most."""

GAP = 0.35
"""A part of the range of distance, height or speed, as a share of it, with no more than one state or place inside: a
shape passes unseen there."""

NEAR = 0.03
"""Places that lie closer than this [m] are likely to share what is peculiar to them, and are not taken to."""

SLOW_PLACES = 3
"""With fewer places at the slowest speed the bound there rests on faster impacts."""

MOST_SCATTER = 0.06
"""Standard deviation of states about the form: twice what the paper's robots show. Above it impacts, speeds or the form
are not what they should be, whatever single departures say."""

_AXES = ("distance", "height", "speed")
_BUMP = 0.1  # where a bump has fallen to 1/e, and how far bumps lie apart, as a share of the range
_LEAST_LEFT = 0.1  # of a departure's length, that the terms of the form must leave
_WITHIN = 0.25  # of what they leave, that must differ between states of one place to be told by these alone
_LEAST_FREEDOM = 3
_ROUNDING = 1e-18  # variance of ln F below which states follow the terms exactly, as computed ones do


@dataclass(frozen=True)
class Departure:
    """A departure of the states from the form: the most significant one along an axis, or of a single place.

    Parameters
    ----------
    along : str
        "distance", "height" or "speed": around one value of it, or by further powers of it; "place": at one place.
    distance, height, speed : float
        Where it is [m], [m], [m/s]; NaN for what it does not hang on.
    effect : float
        Where it is largest, the share by which the state's force lies above the form (below, if negative).
    tested : int
        How many departures of this kind were tested.
    p_value : float
        Adjusted for all departures tested (Bonferroni within a kind, Holm 1979 over the kinds).
    """

    along: str
    distance: float
    height: float
    speed: float
    effect: float
    tested: int
    p_value: float

    @property
    def finding(self) -> Finding:
        """What it says."""
        where = {"distance_m": self.distance, "height_m": self.height, "speed_mps": self.speed}
        bends = all(math.isnan(each) for each in where.values())
        return Finding.of(
            FindingKind.FORM_DEPARTURE, along=self.along, **where, bends=bends, effect=self.effect, p=self.p_value
        )


@dataclass(frozen=True)
class FormTest:
    """What the states of a map say against its form.

    Parameters
    ----------
    departures : tuple of Departure
        The most significant one of each kind that can be tested, the smallest p value first.
    states, left_out : int
        How many states were tested, and how many left out because an impact of theirs is censored.
    gaps : tuple of str
        Along which of distance, height and speed a part of more than GAP of the range has at most one value inside.
    not_tested : tuple of str
        The other kinds of departure that the states cannot tell.
    near : int
        Number of pairs of places closer than NEAR.
    slow_places : int
        Number of places measured at the slowest speed.
    slowest : float
        That speed [m/s].
    state_sd : float
        Standard deviation s of ln F of the states about the form.
    """

    departures: tuple[Departure, ...]
    states: int
    left_out: int
    gaps: tuple[str, ...]
    not_tested: tuple[str, ...]
    near: int
    slow_places: int
    slowest: float
    state_sd: float

    @property
    def found(self) -> tuple[Departure, ...]:
        """The departures that are significant."""
        return tuple(each for each in self.departures if each.p_value <= ERROR_PROBABILITY)

    @property
    def p_value(self) -> float:
        """The smallest; NaN if nothing could be tested."""
        return min((each.p_value for each in self.departures), default=math.nan)

    @property
    def finding(self) -> Finding:
        """Whether the form fits, in one."""
        kind, figures = FindingKind, {"states": self.states, "left_out": self.left_out}
        if not self.departures:
            return Finding.of(kind.FORM_NOT_TESTED, **figures)
        if found := self.found:
            return Finding.of(kind.FORM_DOUBTED, *(each.finding for each in found), **figures)
        tested = sum(each.tested for each in self.departures)
        return Finding.of(kind.FORM_NOT_DOUBTED, **figures, tested=tested, p=self.p_value)

    @property
    def unseen(self) -> tuple[Finding, ...]:
        """What these states cannot show."""
        found = []
        if self.gaps:
            found.append(Finding.of(FindingKind.FORM_UNSEEN_BETWEEN, axes=self.gaps))
        elif self.departures and self.not_tested:
            found.append(Finding.of(FindingKind.FORM_PARTLY_TESTED, axes=self.not_tested))
        if self.near:
            found.append(Finding.of(FindingKind.PLACES_NEAR, pairs=self.near, near_m=NEAR))
        if self.slow_places < SLOW_PLACES:
            figures = {"places": self.slow_places, "speed_mps": self.slowest, "least": SLOW_PLACES}
            found.append(Finding.of(FindingKind.SLOW_AT_FEW_PLACES, **figures))
        return tuple(found)

    @property
    def scatter(self) -> tuple[Finding, ...]:
        """That the states scatter about the form by more than they should."""
        figures = {"state_sd": self.state_sd, "most": MOST_SCATTER}
        return (Finding.of(FindingKind.STATES_SCATTER, **figures),) if self.state_sd > MOST_SCATTER else ()

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """What is to be said before every speed."""
        doubt = () if self.departures and not self.found else (self.finding,)
        return (*doubt, *self.scatter, *self.unseen)


def form_test(form: Form, states: States, state_sd: float = math.nan) -> FormTest:
    """Test whether states have the form that is fitted to them.

    Parameters
    ----------
    form : Form
        The fitted form.
    states : States
        The states it was fitted to; those with a censored impact are left out, since their means are too low.
    state_sd : float, optional
        Standard deviation of ln F of the states about the fit.

    Returns
    -------
    FormTest
    """
    from scipy.spatial.distance import pdist

    tested = states.select(states.censored == 0)
    found = []
    if len(tested):
        tester, candidates = _Tester.of(form, tested), list(_candidates(tested))
        for along in dict.fromkeys(each.along for each, _ in candidates):
            tests = [tester.test(*each) for each in candidates if each[0].along == along]
            if known := [each for each in tests if each]:
                least = min(known, key=lambda each: each.p_value)
                found.append(replace(least, tested=len(known), p_value=min(1.0, least.p_value * len(known))))
    adjusted = holm(np.array([each.p_value for each in found])).tolist()
    found = [replace(each, p_value=p) for each, p in zip(found, adjusted, strict=True)]
    slow = states.speed <= states.speed.min() + StateTolerance().speed
    place = states.place
    at_place = np.array([states.coordinates[place == number, :2].mean(axis=0) for number in range(place.max() + 1)])
    gaps = tuple(name for name, x in zip(_AXES, (*at_place.T, states.speed), strict=True) if _gap(x) > GAP)
    told = [each.along for each in found]
    return FormTest(
        departures=tuple(sorted(found, key=lambda each: each.p_value)),
        states=len(tested),
        left_out=len(states) - len(tested),
        gaps=gaps,
        not_tested=tuple(each for each in (*_AXES, "place") if each not in told and each not in gaps),
        near=int(np.count_nonzero(pdist(at_place, "chebyshev") < NEAR)),
        slow_places=np.unique(place[slow]).size,
        slowest=float(states.speed.min()),
        state_sd=state_sd,
    )


def _gap(values: FloatArray) -> float:
    """The largest part of their range with at most one value inside, as a share of it; 0 if they do not vary."""
    spread, ordered = float(np.ptp(values)), np.sort(values)
    if spread <= StateTolerance().place:
        return 0.0
    return float((ordered[2:] - ordered[:-2]).max()) / spread if values.size > 2 else 1.0


def _candidates(states: States) -> Iterator[tuple[Departure, FloatArray]]:
    """Departures, of a kind together, with their columns, shape (m, k)."""
    nowhere = Departure("", math.nan, math.nan, math.nan, math.nan, 0, math.nan)
    for along, values in zip(_AXES, states.coordinates.T, strict=True):
        low, spread = float(values.min()), float(np.ptp(values))
        if spread <= StateTolerance().place:
            continue
        share, departure = (values - low) / spread, replace(nowhere, along=along)
        for centre in np.unique(np.round(share / _BUMP)) * _BUMP:
            around = replace(departure, **{along: low + float(centre) * spread})  # type: ignore[arg-type]
            yield around, np.exp(-np.square((share - centre) / _BUMP))[:, None]
        yield departure, np.column_stack([(2 * share - 1) ** power for power in (1, 2, 3)])
    place = states.place
    for number in range(place.max() + 1):
        here = place == number
        distance, height = float(states.distance[here].mean()), float(states.height[here].mean())
        yield replace(nowhere, along="place", distance=distance, height=height), here.astype(np.float64)[:, None]


@dataclass(frozen=True, eq=False)
class _Tester:
    """What every test of a departure needs: ln F and place of m states, bases of the terms without and with places."""

    response: FloatArray
    place: Indices
    terms: FloatArray
    terms_and_places: FloatArray

    @classmethod
    def of(cls, form: Form, states: States) -> _Tester:
        design, place = form.design(*states.coordinates.T), states.place
        at_place = np.eye(place.max() + 1)[place]
        return cls(states.log_force, place, _base(design), _base(np.hstack([design, at_place])))

    def test(self, departure: Departure, columns: FloatArray) -> Departure | None:
        """The F test of a departure; None where the states cannot tell it.

        What differs between states of a place is told by these alone, whatever their place shares; what does not by
        generalised least squares, whose correlation of places is found with the departure among the terms, and counts
        only the degrees of freedom that places give as far as it is high.
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
        ratio = float(explained @ explained) / explained.size / max(left, _ROUNDING)
        effects = part @ np.linalg.solve(triangle[:-1, :-1], explained)
        largest = float(effects[np.abs(effects).argmax()])
        p_value = float(fdtrc(explained.size, freedom, ratio))
        return replace(departure, effect=math.expm1(largest), p_value=p_value)


def _base(columns: FloatArray) -> FloatArray:
    """An orthonormal base of what columns span, each scaled to length 1."""
    u, s, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    return np.asarray(u[:, s > 1e-8 * s[0]])


def _left(base: FloatArray, columns: FloatArray) -> FloatArray:
    """An orthonormal base of what a base leaves of columns; without what is next to nothing."""
    u, s, _ = np.linalg.svd(columns - base @ (base.T @ columns), full_matrices=False)
    return np.asarray(u[:, s * math.sqrt(max(s.size, 1)) > _LEAST_LEFT * np.linalg.norm(columns)])
