"""Upper bounds on the force."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Mask, in_blocks
from forcemap.campaigns.dataset import Conditions, Quantity, States, StateTolerance
from forcemap.errors import BoundNotAvailable, InputError
from forcemap.findings import Finding, FindingKind
from forcemap.maps.force_map import ForceMap
from forcemap.maps.places import LEAST_BETWEEN

PAPER_MARGIN = 0.10
"""Share of the force that the paper adds to the prediction (section V-A)."""

CONFIDENCE = CONTENT = 0.95
"""What a tolerance bound promises unless stated otherwise: in this share of campaigns this share of states lies below
it. A choice, the usual one; tried in docs/validity.md."""

DEVICE_ERROR = Conditions().device.error_or_default
"""Error of a device that states none [N]."""

MIN_DEGREES_OF_FREEDOM = 3
"""Residual degrees of freedom between states below which no tolerance bound is given. A choice: with fewer the bound
lies so far above the prediction that it admits next to nothing."""

FEW_STATES = 18
"""Twice the nine coefficients of the default map; fewer leave a wide bound, and a campaign of fewer that happens to
scatter little has one that is too low (docs/decisions.md)."""

_LEAST_PROMISE = 0.5
"""Lowest confidence and content: below it a "bound" would lie under the prediction (docs/decisions.md)."""

_CHANCE = 0.01
"""Test states contradict a bound if chance gives as many above it in less than this share of cases (docs/decisions.md).
A choice: a sound bound is refused in at most one campaign of a hundred."""

_NODES = np.linspace(0.0, 1.0, 2049)
"""Nodes of u = sqrt(l) / (1 + sqrt(l)) in the table of tolerance factors (docs/decisions.md)."""

_REFINED = 4
"""Of so many nodes the quantile is computed for one, the others are interpolated (docs/decisions.md)."""

_QUANTILE_ROUNDING = 1e-9  # share by which the table is raised above the rounding of the quantiles


@runtime_checkable
class Bound(Protocol):
    """An upper bound on the force a map predicts."""

    def upper(self, force_map: ForceMap, distance: ArrayLike, height: ArrayLike, speed: ArrayLike) -> Any:
        """Bound on the force [N] at a place [m] and speed [m/s]; arguments broadcast."""

    def require(self, force_map: ForceMap) -> None:
        """Raise BoundNotAvailable if this bound cannot be computed for the map."""

    def describe(self) -> dict[str, Any]:
        """Kind and parameters, as they stand in JSON."""


@dataclass(frozen=True)
class FixedMargin:
    """The paper's bound: the prediction plus a fixed share of it (section V-A, +10 %).

    It promises nothing by itself: adequate up to a state effect of about 3.3 %.

    Parameters
    ----------
    margin : float
        Share added to the predicted force, from 0 to 1.

    Raises
    ------
    InputError
        A margin outside its range.
    """

    margin: float = PAPER_MARGIN

    def __post_init__(self) -> None:
        if not 0 <= self.margin <= 1:
            raise InputError(
                f"margin: found {self.margin:g}, expected a share of the force from 0 to 1 (0.10 is +10 %)"
            )

    def upper(self, force_map: ForceMap, distance: ArrayLike, height: ArrayLike, speed: ArrayLike) -> Any:
        """F (1 + margin) [N] at a place [m] and speed [m/s], also outside the measured range; arguments broadcast."""
        return force_map.predict(distance, height, speed) * (1 + self.margin)

    def require(self, force_map: ForceMap) -> None:
        """A fixed margin can be computed for every map."""

    def describe(self) -> dict[str, Any]:
        """Kind and parameters, as they stand in JSON."""
        return {"kind": "margin", "margin": self.margin}

    def __str__(self) -> str:
        return f"prediction + {100 * self.margin:.10g} %"


@dataclass(frozen=True)
class ToleranceBound:
    """One-sided tolerance bound: with `confidence`, the force of at least the share `content` of states lies below it.

    With l the leverage of the queried state, s the standard deviation of a state's mean of ln F about the map and t'
    the `confidence` quantile of the noncentral t distribution (degrees of freedom: states less coefficients;
    noncentrality z_content / sqrt(l)), upper = max(F exp(s sqrt(l) t'), F + device error)
    (of a pressure without the device's error: that of a film is a share of the reading)
    (Krishnamoorthy and Mathew 2009, Statistical Tolerance Regions, section 3.4: tolerance limits in regression).
    States of a place share an effect: l and s are those of generalised least squares with a correlation taken at the
    upper end of its likelihood (docs/equations.md, "Places").

    Parameters
    ----------
    confidence : float
        Share of campaigns in which the promise holds, from 0.5 to below 1.
    content : float
        Share of states below the bound, from 0.5 to below 1.
    device_error : float
        Largest error of the device [N]; that of the map's own device counts where it is larger.

    Raises
    ------
    InputError
        A parameter outside its range.
    """

    confidence: float = CONFIDENCE
    content: float = CONTENT
    device_error: float = DEVICE_ERROR

    def __post_init__(self) -> None:
        for name, value in (("confidence", self.confidence), ("content", self.content)):
            if not _LEAST_PROMISE <= value < 1:
                raise InputError(f"{name}: found {value:g}, expected a number from {_LEAST_PROMISE:g} to below 1")
        if not 0 <= self.device_error < math.inf:
            raise InputError(f"device error: found {self.device_error:g} N, expected a finite number of at least 0")

    def upper(self, force_map: ForceMap, distance: ArrayLike, height: ArrayLike, speed: ArrayLike) -> Any:
        """The bound [N] at a place [m] and speed [m/s]; arguments broadcast.

        Algebra, also outside the measured range, where it promises nothing: `safe_speed` gives no speed there
        (`force_map.measured_range.contains`).

        Raises
        ------
        BoundNotAvailable
            The map has no measured states, or too few.
        """
        self.require(force_map)
        assert force_map.fit is not None
        deviation = force_map.fit.state_sd
        table = _tolerance_table(force_map.fit.between_states.degrees_of_freedom, self.confidence, self.content)
        error = self.error_of(force_map)

        def upper(force: FloatArray, leverage: FloatArray) -> FloatArray:
            allowance = deviation * _tolerance_factor(leverage, table)
            with np.errstate(over="ignore", invalid="ignore"):
                bound = np.maximum(force * np.exp(allowance), force + error)
            return np.where(np.isnan(bound), np.inf, bound)

        force = force_map.predict(distance, height, speed)
        return in_blocks(upper, force, force_map.leverage(distance, height, speed))

    def error_of(self, force_map: ForceMap) -> float:
        """How far the bound lies above the prediction at least, in the unit of the map's quantity."""
        of_film = force_map.quantity is Quantity.PRESSURE
        return 0.0 if of_film else float(np.fmax(self.device_error, force_map.conditions.device.error))

    def require(self, force_map: ForceMap) -> None:
        """Raise BoundNotAvailable if the map was not fitted, or has too few states."""
        if force_map.fit is None:
            raise BoundNotAvailable(
                f"map {force_map.name!r} has no measured states, so it knows no tolerance bound; "
                "use a fixed margin (--bound margin) or fit your own impacts"
            )
        freedom = force_map.fit.between_states.degrees_of_freedom
        if freedom < MIN_DEGREES_OF_FREEDOM:
            raise BoundNotAvailable(
                f"found {freedom:.4g} residual degrees of freedom ({len(force_map.fit.states)} measured states, "
                f"{force_map.coefficients.size} coefficients), expected at least {MIN_DEGREES_OF_FREEDOM}; "
                "measure more states or choose a form with fewer terms"
            )
        effect = force_map.fit.place_effect
        if effect.between < LEAST_BETWEEN:
            few = LEAST_BETWEEN - effect.between
            raise BoundNotAvailable(
                f"found {effect.places} measured places, expected at least {effect.places + few}: nothing tells how "
                f"far forces scatter from place to place; measure at {few} more place{'s' if few > 1 else ''}"
            )

    def describe(self) -> dict[str, Any]:
        """Kind and parameters, as they stand in JSON."""
        return {
            "kind": "tolerance",
            "confidence": self.confidence,
            "content": self.content,
            "device_error_N": self.device_error,
        }

    def __str__(self) -> str:
        return (
            f"tolerance bound, {100 * self.confidence:.10g} % confidence that "
            f"{100 * self.content:.10g} % of states lie below"
        )


def weakness(bound: Bound, force_map: ForceMap) -> Finding | None:
    """Why a bound promises less than the usual ones, which must be said first; None if it does not.

    The usual ones are the paper's + 10 % and 95 % confidence for 95 % of states, with 3 N where the device's error is
    not stated. A fixed margin is weak, too, where the impacts of a fitted map contradict it: too few states for a
    tolerance bound, a tolerance bound above the margin, test states above that bound, or a form that does
    not fit so that no bound may cover it. Nothing is exported with a weak bound.
    """
    if type(bound) not in (FixedMargin, ToleranceBound):
        return Finding.of(FindingKind.WEAK_BOUND_UNKNOWN, bound=str(bound))
    if isinstance(bound, FixedMargin):
        if bound.margin < FixedMargin().margin:
            return Finding.of(FindingKind.WEAK_MARGIN, bound=str(bound))
        evidence = _against_margin(bound, force_map)
        return evidence and Finding.of(FindingKind.MARGIN_CONTRADICTED, evidence, bound=str(bound))
    assert isinstance(bound, ToleranceBound)
    usual = ToleranceBound()
    if bound.confidence < usual.confidence or bound.content < usual.content:
        return Finding.of(FindingKind.WEAK_TOLERANCE, bound=str(bound))
    if math.isnan(force_map.conditions.device.error) and bound.device_error < usual.device_error:
        return Finding.of(FindingKind.WEAK_DEVICE_ERROR, error_N=bound.device_error)
    return None


def untested_margin(bound: Bound, force_map: ForceMap) -> Finding | None:
    """That nothing speaks for a fixed margin, as the map has no measured states; else None."""
    untested = isinstance(bound, FixedMargin) and force_map.fit is None
    return Finding.of(FindingKind.MARGIN_UNTESTED, bound=str(bound)) if untested else None


def _against_margin(bound: FixedMargin, force_map: ForceMap) -> Finding | None:
    """How the impacts of a fitted map contradict a fixed margin; None if they do not, or for a published map."""
    if force_map.fit is None:
        return None
    usual = ToleranceBound()
    try:
        usual.require(force_map)
    except BoundNotAvailable:
        return Finding.of(FindingKind.TOO_FEW_FOR_TOLERANCE)
    if why := contradiction(force_map, usual):
        return why
    if (tested := force_map.form_test) and tested.misses and not tested.covered:
        return tested.significant[0].finding
    allowed = margins(usual, force_map)
    exceeded = int(np.sum(allowed > bound.margin))
    figures = {"count": exceeded, "states": int(allowed.size)}
    return Finding.of(FindingKind.TOLERANCE_EXCEEDS_MARGIN, **figures) if exceeded else None


def contradiction(force_map: ForceMap, bound: Bound) -> Finding | None:
    """Whether the test states of a map contradict a tolerance bound; None if they do not.

    States that the map was fitted to, measured again, are no test: they share its error. The others contradict a bound
    for the share `content` of states if so many or more above it have a probability below 1 % (binomial distribution).
    """
    if force_map.fit is None or not isinstance(bound, ToleranceBound) or not len(force_map.tested):
        return None
    from scipy.special import bdtrc

    fit, conditions = force_map.fit, force_map.conditions
    tolerance = StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)
    states = force_map.tested.select(~force_map.tested.repeats_of(fit.states, tolerance))
    if not len(states):
        return None
    beyond = int(np.sum(above_bound(force_map, bound, states)))
    if beyond and bdtrc(beyond - 1, len(states), 1 - bound.content) < _CHANCE:
        return Finding.of(FindingKind.TEST_STATES_ABOVE, count=beyond, states=len(states))
    return None


def above_bound(force_map: ForceMap, bound: Bound, states: States) -> Mask:
    """Which states, shape (m,), measured more than a bound has there, or reached it at least.

    Raises
    ------
    BoundNotAvailable
        The map cannot carry the bound.
    """
    upper = bound.upper(force_map, states.distance, states.height, states.speed)
    return np.asarray(np.fmax(states.force, np.nan_to_num(states.at_least)) > upper)


def margins(bound: Bound, force_map: ForceMap) -> FloatArray:
    """How far a bound lies above the prediction at the measured states, as a share of the prediction, shape (m,).

    Where that of a tolerance bound exceeds `PAPER_MARGIN`, the paper's fixed margin is too small.
    """
    points = force_map.measured_range.points.T
    with np.errstate(invalid="ignore"):  # where both forces overflow
        margin = bound.upper(force_map, *points) / force_map.predict(*points) - 1
    return np.where(np.isnan(margin), np.inf, margin)


def tolerance_nodes(bound: ToleranceBound, force_map: ForceMap) -> tuple[FloatArray, FloatArray, float]:
    """Nodes of sqrt(l), sqrt(l) t'(l) at them, and its slope beyond the last: `upper` is linear between the nodes."""
    freedom = force_map.require_fit().between_states.degrees_of_freedom
    table = _tolerance_table(freedom, bound.confidence, bound.content)
    root = _NODES[:-1] / (1 - _NODES[:-1])
    return root, table[:-1] * (1 + root), float(table[-1])


@lru_cache(maxsize=64)
def _tolerance_table(degrees_of_freedom: int, confidence: float, content: float) -> FloatArray:
    """sqrt(l) t'(l) / (1 + sqrt(l)) at u = sqrt(l) / (1 + sqrt(l)), for u evenly from 0 to 1.

    Straight lines between the nodes lie on or above the function where it is convex (at the usual confidences
    everywhere). Where it is not, the table is raised by twice as much as the lines can lie below it: it only errs
    upwards.
    """
    from scipy.special import chdtri, nctdtrit, ndtri, stdtrit

    z = ndtri(content)

    def at(nodes: FloatArray) -> FloatArray:
        root = nodes[1:-1] / (1 - nodes[1:-1])
        inner = root * nctdtrit(degrees_of_freedom, z / root, confidence) * (1 - nodes[1:-1])
        at_zero = z * math.sqrt(degrees_of_freedom / chdtri(degrees_of_freedom, confidence))
        return np.concatenate([[at_zero], inner, [stdtrit(degrees_of_freedom, confidence)]])

    table = _refined(at(_NODES[::_REFINED]))
    table = at(_NODES) if table is None else table
    known = ~np.isnan(table)  # scipy lacks a few quantiles of extreme noncentrality: interpolated, again upwards
    table = np.interp(_NODES, _NODES[known], table[known])
    sag = max(0.0, -float(np.diff(table, 2).min())) / 8
    return np.asarray((table + 2 * sag) * (1 + _QUANTILE_ROUNDING))


def _refined(values: FloatArray) -> FloatArray | None:
    """Values at all nodes from those at every `_REFINED`-th, on cubics through the four around; None if too rough.

    A cubic is off by up to 1/24 of the fourth difference (at an end of the table, where it is worst).
    """
    off = np.abs(np.diff(values, 4)).max() / 24
    if not off < _QUANTILE_ROUNDING / 2 * np.abs(values).min():  # unknown, too
        return None
    node = np.arange(_NODES.size)
    first = np.clip(node // _REFINED - 1, 0, values.size - 4)
    x = node / _REFINED - first
    weights = [math.prod((x - m) / (k - m) for m in range(4) if m != k) for k in range(4)]
    return np.asarray(sum(weight * values[first + k] for k, weight in enumerate(weights)))


def _tolerance_factor(leverage: FloatArray, table: FloatArray) -> FloatArray:
    """sqrt(l) t'(l), read off the table; infinite where the leverage is.

    The nodes are even: an interval is found by its number, not searched. The values are those of np.interp.
    """
    root = np.sqrt(leverage)
    intervals = table.size - 1  # a power of two, so that nodes and distances from them are exact
    with np.errstate(invalid="ignore"):  # an infinite root; a NaN gives NaN, whatever its number
        node = root / (1 + root) * intervals
        node[np.isinf(root)] = intervals
        number = node.astype(np.intp)
        factor: FloatArray = np.append(np.diff(table), 0.0).take(number, mode="clip")
        factor *= node - number
        factor += table.take(number, mode="clip")
        factor *= 1 + root
    return factor
