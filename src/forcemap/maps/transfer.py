"""A map carried over to a changed robot: the states of an earlier map and a few new ones, fitted together.

ln F of the new campaign = ln F of the earlier one + a shift, a sum of few terms. All coefficients, those of the earlier
map and those of the shift, are fitted to the states of both campaigns (docs/equations.md, "A map carried over").
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from forcemap.campaigns.dataset import States
from forcemap.errors import FitError, TooFewStates
from forcemap.findings import Finding, FindingKind
from forcemap.maps.censored import StateData, censored_regression, state_data
from forcemap.maps.forms import Form
from forcemap.maps.measured_range import MeasuredRange
from forcemap.maps.places import (
    PlaceEffect,
    members,
    place_effect,
    place_regression,
    places_between,
    shared_part,
    whitened,
)
from forcemap.maps.regression import EXACT, Regression, ScatterRegression

SHIFT = Form.of("SHIFT", ["1", "d", "h", "v"])
"""Terms of the shift unless stated: between two safety thresholds of the paper's robot they leave 0.9 % rms of ln F
(docs/transfer.md)."""

_LOG_SHIFT = Form.of("SHIFT", ["1", "d", "h", "ln(v)"])

REFUSED_BELOW = 0.05
"""P value of the shift's misfit below which no map is carried over: one in twenty of those that could be is refused."""

MORE_BELOW = 0.5
"""P value of the misfit below which more states are asked for: a narrow ridge shows itself so (docs/transfer.md)."""

MORE_STATES = 6
"""How many more are asked for then."""

FURTHER_STATES = 2
"""States that must be measured beyond the terms of the shift: with fewer nothing tells whether the shift fits. As many
places beyond those that its terms of place take up: else any change from place to place would pass for the shift."""

_PENALTY = 0.1
"""How much the log-likelihood of a part of new places is lowered for each own variance that it adds. Few states would
else make it large by chance (docs/decisions.md)."""

_DIFFERENT_FIRST = (
    "device.model",
    "device.pad",
    "device.stiffness_N_per_m",
    "device.range_N",
    "contact.direction",
    "contact.site",
)
"""Conditions whose change is said before all others, because a shift cannot be told from it. A choice."""


def usual_shift(form: Form) -> Form:
    """Terms of the shift of a form unless stated; ln v in place of v for a form that is linear in ln v."""
    return _LOG_SHIFT if form.logarithmic else SHIFT


@dataclass(frozen=True, eq=False)
class Earlier:
    """A campaign that a map was carried over from.

    Parameters
    ----------
    name : str
        Name of its map.
    map_sha256 : str
        SHA-256 of its map file.
    states : States
        The states its map was fitted to.
    different : tuple of (entry, then, now)
        Conditions of campaign.toml that the next campaign states otherwise; an empty text is "not stated".
    """

    name: str
    map_sha256: str
    states: States
    different: tuple[tuple[str, str, str], ...]


@dataclass(frozen=True, eq=False)
class Transfer:
    """Where a map was carried over from, and how well the shift fits.

    Parameters
    ----------
    form : Form
        Terms of the first map.
    earlier : tuple of Earlier
        The campaigns, the first one first.
    shifts : tuple of Form
        Terms of the shift from each of them to the next.
    joint : JointFit
        The fit to the states of all campaigns.
    near : int
        New states at places that an earlier campaign measured.
    """

    form: Form
    earlier: tuple[Earlier, ...]
    shifts: tuple[Form, ...]
    joint: JointFit
    near: int

    @property
    def p_value(self) -> float:
        """Of the F test whether the shift misses more than states scatter."""
        return self.joint.p_value

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What the map was carried over from, by which states, and how well the shift fits."""
        names = ", ".join(earlier.name for earlier in self.earlier)
        figures = {"names": names, "states": sum(len(earlier.states) for earlier in self.earlier)}
        terms = "; then ".join(", ".join(shift.term_names) for shift in self.shifts)
        fit = {"new": self.joint.new, "terms": terms, "p": self.p_value, "extra": math.sqrt(1 + self.joint.extra) - 1}
        return (Finding.of(FindingKind.CARRIED_OVER, **figures, **fit),)

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """What must be said before every speed: other conditions first, then what to measure to be surer."""
        kind = FindingKind
        different = [difference for earlier in self.earlier for difference in earlier.different]
        different.sort(key=lambda difference: difference[0] not in _DIFFERENT_FIRST)
        warnings = [Finding.of(kind.CARRIED_DIFFERENT, changes=tuple(different))] if different else []
        if not self.p_value >= MORE_BELOW:
            warnings.append(Finding.of(kind.CARRIED_DOUBTFUL, p=self.p_value, more=MORE_STATES))
        if self.near:
            warnings.append(Finding.of(kind.CARRIED_AT_OLD_PLACES, states=self.near))
        return tuple(warnings)


def range_of(new: States, earlier: Sequence[Earlier]) -> MeasuredRange:
    """The hull of new states, at no speed below the lowest of an earlier campaign.

    They may lie slower than it by as much as repeats of a state: carried over again and again, that would add up.
    """
    slowest = max(float(each.states.speed.min()) for each in earlier)
    return MeasuredRange(np.column_stack([new.distance, new.height, np.maximum(new.speed, slowest)]))


@dataclass(frozen=True, eq=False)
class JointFit:
    """A fit to the states of several campaigns, the new one last.

    Parameters
    ----------
    data : StateData
        All states; the columns of the design are the terms of the first map and those of each shift.
    form : Form
        Terms of the new map: those of the first and of the shifts, each once.
    regression : TransferRegression
        The new map's coefficients and states.
    place_effect : PlaceEffect
        Correlation of the states of a place of the new campaign.
    extra : float
        Variance that new places have beyond that of states of the campaign before, as a share of the latter: where the
        shift misses something, new states scatter more.
    p_value : float
        Of the test of the shift.
    """

    data: StateData
    form: Form
    regression: TransferRegression
    place_effect: PlaceEffect
    extra: float
    p_value: float

    @property
    def new(self) -> int:
        """Number of new states."""
        return self.regression.response.size


@dataclass(frozen=True, eq=False)
class TransferRegression(ScatterRegression):
    """The new map's part of a fit to several campaigns: C = R^-1 R^-T is the covariance of its coefficients over s^2.

    Design and response are those of the new states, scatter and degrees of freedom those of the whole fit: states of
    all campaigns less all coefficients.

    Parameters
    ----------
    whole : Regression
        The fit of all coefficients to all states.
    """

    whole: Regression

    @cached_property
    def condition_number(self) -> float:
        """Of the whole fit."""
        return self.whole.condition_number


def joint_fit(form: Form, campaigns: Sequence[States], shifts: Sequence[Form], repeat_variance: float) -> JointFit:
    """Fit a map and its shifts to the states of several campaigns, the first one's map first.

    With X the terms of the map and S_k those of the shift to campaign k, ln F of campaign k = X b + sum of S_j g_j over
    j <= k. Own effects have one variance in all campaigns. Places of the first campaign add a share of it, at the upper
    end of its likelihood (`place_effect`); those of each further one add what those of the campaign before do and a
    part of their own, at the maximum of its likelihood.

    Parameters
    ----------
    form : Form
        Terms of the first map.
    campaigns : sequence of States
        States of each campaign.
    shifts : sequence of Form
        Terms of the shift from each campaign to the next.
    repeat_variance : float
        Of ln F between repeats of a state; only censored impacts make use of it.

    Raises
    ------
    TooFewStates
        The new states, or their places, are too few to tell whether the shift fits.
    RankDeficient
        The states do not determine all coefficients.
    """
    known = [states.uncensored for states in campaigns]
    if len(known[-1]) < len(shifts[-1].terms) + FURTHER_STATES:
        raise TooFewStates(
            f"found {len(known[-1])} new states, expected at least {len(shifts[-1].terms) + FURTHER_STATES}, "
            f"{FURTHER_STATES} more than the shift has terms; measure more states, or name a shift with fewer terms"
        )
    spare = places_between(shifts[-1].design(*known[-1].coordinates.T), known[-1].place)
    if spare < FURTHER_STATES:
        places = np.unique(known[-1].place).size
        raise TooFewStates(
            f"found new states at {places} places, expected at least {places + FURTHER_STATES - spare}, "
            f"{FURTHER_STATES} more than the shift takes up: any change from place to place would pass for it; "
            "measure at more places, or name a shift with fewer terms"
        )
    first = place_effect(form.design(*known[0].coordinates.T), known[0].log_force, known[0].place)
    ratio, likely = [first.correlation / (1 - first.correlation)], first.likely / (1 - first.likely)
    between, extra = first.between, 0.0
    for k in range(1, len(campaigns)):
        data = _joint_data(form, known[: k + 1], shifts[:k], [*ratio, ratio[-1]], repeat_variance)
        extra, added = _extra_variance(data, len(known[k]))
        ratio.append(ratio[-1] + extra)
        between += added
    p_value = _misfit(form, known, shifts, likely, first.between)
    data = _joint_data(form, campaigns, shifts, ratio, repeat_variance)
    whole = _regression(data)
    terms = dict.fromkeys(term for part in (form, *shifts) for term in part.terms)
    more = [str(term) for term in terms if term not in form.terms]
    union = Form("+".join([form.name, *more]), tuple(terms)) if more else form
    to_map = np.array([[float(term == own) for part in (form, *shifts) for own in part.terms] for term in terms])
    new = slice(len(data.mean) - len(campaigns[-1]), None)
    triangle = np.asarray(np.linalg.qr((to_map @ whole.inverse_triangle).T, mode="r")).T
    regression = TransferRegression(
        design=union.design(*campaigns[-1].coordinates.T),
        response=data.mean[new],
        coefficients=to_map @ whole.coefficients,
        inverse_triangle=triangle,
        deviation=whole.residual_sd,
        freedom=whole.degrees_of_freedom,
        whole=whole,
    )
    correlation, likeliest = (r / (1 + r) for r in (ratio[-1], likely + ratio[-1] - ratio[0]))
    effect = PlaceEffect(correlation, min(likeliest, correlation), 0.0, np.unique(campaigns[-1].place).size, between)
    return JointFit(data, union, regression, effect, extra / (1 + ratio[-2]), p_value)


def _joint_data(
    form: Form, campaigns: Sequence[States], shifts: Sequence[Form], ratio: Sequence[float], repeat_variance: float
) -> StateData:
    """All states with the terms of the map and of the shifts; `ratio` is shared over own variance, by campaign."""
    parts = []
    for k, states in enumerate(campaigns):
        x = states.coordinates.T
        design = np.hstack([form.design(*x), *(shift.design(*x) * (j < k) for j, shift in enumerate(shifts))])
        parts.append(state_data(design, states, repeat_variance, ratio[k] / (1 + ratio[k])))
    return StateData.joined(parts)


def _regression(data: StateData) -> Regression:
    """The fit of all coefficients to all states."""
    if data.censored.any():
        return censored_regression(data)
    return place_regression(data.design, data.mean, data.place, data.correlation)


def _extra_variance(data: StateData, new: int) -> tuple[float, int]:
    """Variance that the places of the last `new` states add, over that of own effects; degrees of freedom of it."""
    place = data.place[-new:] - data.place[-new:].min()
    member = np.vstack([np.zeros((data.mean.size - new, place.max() + 1)), members(place)])
    white = whitened(np.column_stack([data.design, data.mean, member]), data.place, data.correlation)
    white *= math.sqrt(data.own_share)  # own effects then have the variance 1
    columns = data.design.shape[1]
    _, likely, _, between = shared_part(white[:, :columns], white[:, columns], white[:, columns + 1 :], _PENALTY)
    return likely / (1 - likely), between


def _misfit(form: Form, known: Sequence[States], shifts: Sequence[Form], ratio: float, between: int) -> float:
    """P value of the F test whether the new states lie further off the shifted map than the earlier ones off theirs.

    (S - S') / (m - k) over S' / (n - p): S and S' the generalised sums of squares of all campaigns and of the earlier
    ones alone, m new states, k terms of the shift, n earlier states and p coefficients of theirs (Chow 1960,
    https://doi.org/10.2307/1910133). The higher the correlation of places, the more the degrees of freedom of S' are
    those of the places. Of a state with censored repeats the others count alone.
    """
    from scipy.special import fdtrc

    squares, rest = [], []
    for last in (len(known) - 1, len(known)):
        data = _joint_data(form, known[:last], shifts[: last - 1], [ratio] * last, 0.0)
        fit = place_regression(data.design, data.mean, data.place, data.correlation)
        squares.append(fit.residual_squares)
        rest.append(int(fit.degrees_of_freedom))
    if not rest[0]:
        raise FitError("the earlier map has no degrees of freedom, so nothing tells how far its states scatter")
    correlation = ratio / (1 + ratio)
    freedom = min(between, rest[0]) + (1 - correlation) * max(rest[0] - between, 0)
    further = rest[1] - rest[0]
    quotient = (squares[1] - squares[0]) / further / max(squares[0] / rest[0], EXACT)
    return float(fdtrc(further, freedom, max(quotient, 0.0)))
