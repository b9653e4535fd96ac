"""Safe speeds: a map, an upper bound on its force and a limit give the highest speed that may be driven."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import ROUND_FLOOR, Decimal
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Indices, Mask, Objects
from forcemap.campaigns.dataset import Quantity, StateTolerance
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.maps.slower_impacts import upper_of_slower
from forcemap.speeds.allowance import Allowance
from forcemap.speeds.basis import Basis, exceedances, of_quantity
from forcemap.speeds.crossings import highest_within, lowest_exceeded
from forcemap.speeds.quantities import QuantityCase, cases_of

REPEAT_DISTANCE = StateTolerance().place
"""States this close to a place [m], along both axes, count as measured at it: as far apart as repeats of one state may
lie."""

_PLACES_AT_ONCE = 32_768  # bounds the memory of a search

_COLUMNS = (
    "speed",
    "outcome",
    "extrapolated_speed",
    "lowest_measured_speed",
    "highest_measured_speed",
    "predicted_force",
    "bound_force",
    "reason",
    "speed_to_program",
    "to_program_outcome",
    "to_program_reason",
)


class SpeedOutcome(StrEnum):
    """What is known of the safe speed at a place; the first that holds."""

    NOT_PERMITTED = "not_permitted"
    OUTSIDE = "outside"
    UNCONFIRMED = "unconfirmed"
    CAPPED = "capped"
    ADMISSIBLE = "admissible"

    @property
    def has_speed(self) -> bool:
        """True if a speed is given."""
        return self in (SpeedOutcome.CAPPED, SpeedOutcome.ADMISSIBLE)


@dataclass(frozen=True, eq=False)
class SafeSpeed:
    """Safe speeds at places; floats and single values for one place, arrays of one shape for many.

    Parameters
    ----------
    speed : float or array
        Highest speed at contact confirmed [m/s], unrounded; NaN unless the outcome is capped or admissible.
    outcome : SpeedOutcome or array of object
        What is known of the speed.
    extrapolated_speed : float or array
        Where to measure next [m/s], a hint and no permission: where the bound, continued below the measured
        speeds, rises to the limit; 0.0 if it never lies below. NaN unless the bound makes it unconfirmed, and of a map
        that is to hold from a stated speed on.
    lowest_measured_speed, highest_measured_speed : float or array
        Measured speeds at the place [m/s]; NaN outside.
    predicted_force, bound_force : float or array
        Prediction and bound at that speed [N]; NaN where there is no speed.
    reason : Finding or array of object
        The reason for the outcome.
    speed_to_program : float or array
        Highest speed to program [m/s], unrounded: the speed at contact less the overshoot. NaN where there is none.
    to_program_outcome, to_program_reason : SpeedOutcome, Finding or array of object
        What is known of the speed to program, and why: `unconfirmed` where only the speed at contact reaches the lowest
        measured speed.
    limit : float or array
        The force limit used [N].
    basis : Basis
        What the speeds rest on.
    governed_by : Quantity, None or array of object
        Where several quantities count, the one that gives the speed, or because of which there is none; else None.
    of_quantities : mapping of Quantity to SafeSpeed
        The speeds that each of several quantities allows by itself, which permit nothing alone; forces are in its unit.
    """

    speed: Any
    outcome: Any
    extrapolated_speed: Any
    lowest_measured_speed: Any
    highest_measured_speed: Any
    predicted_force: Any
    bound_force: Any
    reason: Any
    speed_to_program: Any
    to_program_outcome: Any
    to_program_reason: Any
    limit: Any
    basis: Basis
    governed_by: Any = None
    of_quantities: Mapping[Quantity, SafeSpeed] = field(default_factory=dict)


def safe_speed(
    force_map: ForceMap,
    distance: ArrayLike,
    height: ArrayLike,
    *,
    limit: ForceLimit | NewtonLimit | ArrayLike,
    bound: Bound,
    contact: Contact | None = None,
    quasi_static_limit: float | None = None,
    spring_N_per_m: float | None = None,
    angle: float = 0.0,
    allowance: Allowance | None = None,
    hints: bool = True,
) -> SafeSpeed:
    """Highest speed at contact at which the bound on the force stays within a limit, as far as measurements reach.

    With B(v) the running maximum of `bound.upper` from the lowest speed measured at the place: `not_permitted` where
    the standard permits no contact with the body area; `outside` the measured range; `unconfirmed` if B exceeds the
    limit already there; `capped` if B admits even the highest speed measured there; else `admissible`, the speed at
    which B crosses the limit (to 1e-6 m/s, never above).

    A transient limit is used only where Phase II allows it: if impacts clamp, are undetermined, or leave a force
    above the quasi-static limit, every place inside is `unconfirmed` with that reason; a limit in newtons opens no
    gate. So is every place inside where the device's spring is softer than 0.9 of the body area's or not stated, and
    where the impacts table is not what its recordings gave. A spring from 0.9 to 1 of the area's raises the bound by
    the root of their ratio.

    Where the impacts have pressures too, or a clamping force, and the limit names them, the speed is the lowest that
    any quantity allows, within the places and speeds measured for all of them; `governed_by` says which it is.

    The result also has the speed to program, lower by the overshoot of the robot. It is `unconfirmed` where it lies
    below the lowest speed measured at the place.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    distance, height : float or array
        Places [m]; they and a numeric limit broadcast.
    limit : float, array, NewtonLimit or ForceLimit
        Force limit [N], positive, finite and not above the device range less its error (where no range is stated, the
        largest force that was measured); or the limits of a body area together with `contact`.
    bound : Bound
        `FixedMargin` or `ToleranceBound`.
    contact : Contact, optional
        Kind of contact. With a limit in newtons it may be left out only for a map whose impacts are all known to be
        over within 0.5 s.
    quasi_static_limit : float, optional
        With a transient limit in newtons, its quasi-static part [N]; expected where a Phase II force was recorded.
    spring_N_per_m : float, optional
        With a limit in newtons, the spring constant [N/m] of the body part it is meant for.
    angle : float
        How far the motion may point away from the map's direction [deg], at most 5; off it the bound is raised by 14 %.
    allowance : Allowance, optional
        What the robot may deviate; `Allowance()` if not given. At a place its position tolerance does not count.
    hints : bool
        False leaves `extrapolated_speed` out, NaN everywhere: on large grids it takes most of the time.

    Returns
    -------
    SafeSpeed

    Raises
    ------
    InputError
        A place that is not finite, a limit or angle outside its range, or `contact` or `quasi_static_limit` missing.
    BoundNotAvailable
        The map cannot carry the bound.

    Examples
    --------
    >>> from forcemap import FixedMargin, published_map
    >>> result = safe_speed(published_map("ur10e"), 0.8, 0.4, limit=280.0, bound=FixedMargin(0.10))
    >>> result.outcome.value, round(result.speed, 4)
    ('admissible', 0.3212)
    """
    allowance = allowance or Allowance()
    cases = cases_of(
        force_map,
        limit,
        bound=bound,
        contact=contact,
        quasi_static_limit=quasi_static_limit,
        spring_N_per_m=spring_N_per_m,
        angle=angle,
    )
    results = [speeds_of_case(case, distance, height, allowance, hints=hints) for case in cases]
    return lowest_of(cases, results, distance, height, allowance)


def speeds_of_case(
    case: QuantityCase, distance: ArrayLike, height: ArrayLike, allowance: Allowance, *, hints: bool = True
) -> SafeSpeed:
    """Speeds that one quantity allows by itself; arguments and errors as in `safe_speed`."""
    basis, bound = case.basis, case.basis.bound
    assert bound is not None
    if np.ma.is_masked(distance) or np.ma.is_masked(height):
        raise InputError("place: found masked entries, expected numbers")
    try:
        arrays = [np.asarray(value, dtype=np.float64) for value in (distance, height, basis.level)]
        shape = np.broadcast_shapes(*(array.shape for array in arrays))
    except (TypeError, ValueError) as error:
        raise InputError(f"place: expected numbers, and arrays that broadcast: {error}") from None
    d, h, level = (np.ascontiguousarray(np.broadcast_to(array, shape).ravel()) for array in arrays)
    if not (np.isfinite(d).all() and np.isfinite(h).all()):
        raise InputError("place: found a distance or height that is not a finite number, expected metres")
    parts = [
        _safe_speed(case.force_map, d[part], h[part], level[part], bound, basis, allowance, hints)
        for part in _parts(d.size)
    ]
    columns = [np.concatenate(column).reshape(shape) for column in zip(*parts, strict=True)]
    values: dict[str, Any] = {
        name: column if shape else column.item() for name, column in zip(_COLUMNS, columns, strict=True)
    }
    values["bound_force"] = basis.raised * values["bound_force"]
    return SafeSpeed(**values, limit=basis.newtons, basis=replace(basis, allowance=allowance))


def lowest_of(
    cases: Sequence[QuantityCase],
    results: Sequence[SafeSpeed],
    distance: ArrayLike,
    height: ArrayLike,
    allowance: Allowance,
) -> SafeSpeed:
    """The lowest speed of all quantities, within the places and speeds measured for all of them.

    Parameters
    ----------
    cases : sequence of QuantityCase
        The quantities, the force first.
    results : sequence of SafeSpeed
        Their speeds, of one shape.
    distance, height : float or array
        The places [m].
    allowance : Allowance
        What the robot may deviate.
    """
    if len(cases) == 1:
        return results[0]
    shape = np.shape(results[0].speed)
    lowest = lowest_speeds(cases, results)
    of_force, basis = cases[0].force_map, cases[0].basis
    known, (d, h) = np.flatnonzero(~np.isnan(lowest.speed)), np.broadcast_arrays(distance, height)
    places = (np.broadcast_to(axis, shape).ravel()[known] for axis in (d, h))
    state = (*places, lowest.speed[known])
    predicted, bounded = np.full((2, lowest.speed.size), np.nan)
    assert basis.bound is not None
    predicted[known] = of_force.predict(*state)
    bounded[known] = basis.raised * basis.bound.upper(of_force, *state)
    programmed = to_program(lowest.speed, lowest.outcome, lowest.reason, lowest.low, allowance)
    columns = (
        *(lowest.speed, lowest.outcome, lowest.hint, lowest.low, lowest.high),
        *(predicted, bounded, lowest.reason, *programmed, lowest.governed_by),
    )
    values: dict[str, Any] = {
        name: column.reshape(shape) if shape else column.item()
        for name, column in zip((*_COLUMNS, "governed_by"), columns, strict=True)
    }
    of_quantities = {case.quantity: result for case, result in zip(cases, results, strict=True)}
    return SafeSpeed(**values, limit=results[0].limit, basis=results[0].basis, of_quantities=of_quantities)


@dataclass(frozen=True, eq=False)
class LowestSpeeds:
    """The lowest speeds of several quantities, arrays of shape (n,): what is known of them, and by which quantity."""

    speed: FloatArray
    outcome: Objects
    reason: Objects
    hint: FloatArray
    low: FloatArray
    high: FloatArray
    governed_by: Objects


def lowest_speeds(cases: Sequence[QuantityCase], results: Sequence[Any]) -> LowestSpeeds:
    """The lowest speeds of quantities, by their results (`SafeSpeed` or `ZoneSpeeds`), arrays of any one shape.

    Outside where any of them is, else unconfirmed where any of them is, or where the lowest speed lies below the lowest
    one that was measured for another of them.
    """

    def of_all(name: str, kind: type) -> Any:
        return np.array([np.ravel(np.asarray(getattr(each, name), dtype=kind)) for each in results], dtype=kind)

    speed, outcome, reason = of_all("speed", float), of_all("outcome", object), of_all("reason", object)
    lows, highs = of_all("lowest_measured_speed", float), of_all("highest_measured_speed", float)
    hints = (
        of_all("extrapolated_speed", float) if hasattr(results[0], "extrapolated_speed") else np.full_like(lows, np.nan)
    )
    quantities, which = np.array([case.quantity for case in cases], dtype=object), np.arange(speed.shape[1])
    outside, open_ = outcome == SpeedOutcome.OUTSIDE, outcome == SpeedOutcome.UNCONFIRMED
    first = np.where(outside.any(axis=0), outside.argmax(axis=0), open_.argmax(axis=0))
    without = (outside | open_).any(axis=0)
    governing = np.where(without, first, np.where(np.isnan(speed), np.inf, speed).argmin(axis=0))
    value = np.where(without, np.nan, speed[governing, which])
    outcome, governed_by = outcome[governing, which], quantities[governing]
    reason = reason[governing, which]
    reason[:] = [of_quantity(*pair) for pair in zip(governed_by, reason, strict=True)]
    governs = {each: Finding.of(FindingKind.GOVERNS, quantity=each.words) for each in quantities}
    for i in np.flatnonzero(~without):
        reason[i] = reason[i].and_(governs[governed_by[i]])
    for i in np.flatnonzero(value < lows.max(axis=0)):
        other = quantities[lows[:, i].argmax()]
        names = {"quantity": governed_by[i].words, "other": other.words}
        value[i], outcome[i], governed_by[i] = np.nan, SpeedOutcome.UNCONFIRMED, other
        reason[i] = Finding.of(FindingKind.BELOW_MEASURED_OF, **names)
    hint = np.where(open_, hints, np.inf).min(axis=0)  # NaN where one of those that refuse has none
    hint = np.where(without & np.isfinite(hint) & ~outside.any(axis=0), hint, np.nan)
    return LowestSpeeds(value, outcome, reason, hint, lows.max(axis=0), highs.min(axis=0), governed_by)


def to_program(
    speed: FloatArray, outcome: Objects, reason: Objects, lowest: FloatArray, allowance: Allowance
) -> tuple[FloatArray, Objects, Objects]:
    """Speeds to program, their outcomes and reasons, of speeds at contact.

    Parameters
    ----------
    speed : array (n,)
        Speeds at contact [m/s]; NaN where there is none.
    outcome, reason : array (n,)
        What is known of them, and why.
    lowest : array (n,)
        Lowest measured speeds [m/s]; below them nothing is confirmed.
    allowance : Allowance
        What the robot may deviate.
    """
    slower = allowance.off(speed)
    below = np.flatnonzero(slower < lowest)
    outcome, reason = outcome.copy(), reason.copy()
    slower[below], outcome[below] = np.nan, SpeedOutcome.UNCONFIRMED
    reason[below] = Finding.of(FindingKind.BELOW_MEASURED, overshoot_mps=allowance.speed)
    return slower, outcome, reason


def floor_speed(speed: float) -> str:
    """A speed [m/s] as it is shown: cut to 0.001 m/s in decimal, never rounded up; "-" where there is none.

    Examples
    --------
    >>> floor_speed(0.29), floor_speed(0.1599999)
    ('0.290', '0.159')
    """
    if not math.isfinite(speed):
        return "-"
    return str(Decimal(repr(float(speed))).quantize(Decimal("0.001"), rounding=ROUND_FLOOR))


def _parts(size: int) -> Iterator[slice]:
    return (slice(start, start + _PLACES_AT_ONCE) for start in range(0, max(size, 1), _PLACES_AT_ONCE))


def _safe_speed(
    force_map: ForceMap,
    d: FloatArray,
    h: FloatArray,
    limit: FloatArray,
    bound: Bound,
    basis: Basis,
    allowance: Allowance,
    hints: bool,
) -> tuple[Any, ...]:
    """The first columns of SafeSpeed, in its order, for places of shape (n,)."""

    low, high = force_map.measured_range.speeds(d, h)
    speed = np.full(d.size, np.nan)
    hint = speed.copy()
    outcome, reason = np.empty((2, d.size), dtype=object)
    outcome[:], reason[:] = SpeedOutcome.OUTSIDE, Finding.of(FindingKind.OUTSIDE)
    inside = np.flatnonzero(~np.isnan(low))

    if not basis.permitted:
        outcome[:], reason[:] = SpeedOutcome.NOT_PERMITTED, basis.refusal
    elif basis.refusal:
        outcome[inside], reason[inside] = SpeedOutcome.UNCONFIRMED, basis.refusal
    else:
        ends = low[inside], high[inside]
        speed[inside] = highest_within(force_map, bound, d[inside], h[inside], ends, np.log(limit[inside]))
        covered = _slower_covered(force_map, bound, basis, d[inside], h[inside], limit[inside])
        too_slow = inside[~np.isnan(speed[inside]) & ~covered]
        speed[too_slow] = np.nan
        for kind, where in (
            (SpeedOutcome.ADMISSIBLE, speed < high),
            (SpeedOutcome.CAPPED, speed >= high),
            (SpeedOutcome.UNCONFIRMED, np.isnan(speed) & ~np.isnan(low)),
        ):
            unseen = basis.unseen if kind.has_speed else ()
            outcome[where], reason[where] = kind, Finding.of(FindingKind(kind.value)).and_(*unseen)
        reason[too_slow] = Finding.of(FindingKind.SLOWER_NOT_COVERED, slower=basis.slower - 1 or None)
        refused = np.setdiff1d(np.flatnonzero(np.isnan(speed) & ~np.isnan(low)), too_slow)
        usable = (
            hints and not force_map.conditions.slowest > 0
        )  # a map that holds from a speed on is fitted to none below
        slower = refused if usable else np.empty(0, dtype=np.int64)
        hint[slower] = lowest_exceeded(force_map, bound, d[slower], h[slower], low[slower], np.log(limit[slower]))
        for state, where in _measured_beyond(force_map, d, h, limit, speed, "at_least"):
            outcome[where], speed[where], reason[where] = SpeedOutcome.UNCONFIRMED, np.nan, state
        for state, where in _exceeded_elsewhere(force_map, limit, bound, basis, speed):
            outcome[where], speed[where], reason[where] = SpeedOutcome.UNCONFIRMED, np.nan, state
        for state, where in _measured_beyond(force_map, d, h, limit, speed, "highest"):
            reason[where] = [why.and_(state) for why in reason[where]]
    with_speed = np.flatnonzero(~np.isnan(speed))
    predicted, bounded = np.full((2, d.size), np.nan)
    predicted[with_speed] = force_map.predict(d[with_speed], h[with_speed], speed[with_speed])
    bounded[with_speed] = bound.upper(force_map, d[with_speed], h[with_speed], speed[with_speed])
    programmed = to_program(speed, outcome, reason, low, allowance)
    return speed, outcome, hint, low, high, predicted, bounded, reason, *programmed


def _slower_covered(
    force_map: ForceMap, bound: Bound, basis: Basis, d: FloatArray, h: FloatArray, limit: FloatArray
) -> Mask:
    """Where the bound at the map's lowest speed covers slower motion, too, shape (n,)."""
    if not basis.slower:
        return np.ones(d.size, dtype=np.bool_)
    return upper_of_slower(force_map, bound, d, h) <= limit


def _exceeded_elsewhere(
    force_map: ForceMap, limit: FloatArray, bound: Bound, basis: Basis, speed: FloatArray
) -> Iterator[tuple[Finding, Indices]]:
    """Which of several limits a measurement exceeded at a speed that the bound permits: none of their speeds holds.

    Of one limit alone its basis says so (`exceeded_where_permitted`).
    """
    if FindingKind.EXCEEDED_WHERE_PERMITTED not in [warning.kind for warning in basis.warnings]:
        return
    given = np.flatnonzero(~np.isnan(speed))
    limits, which = np.unique(limit[given] * basis.raised, return_inverse=True)
    for each in exceedances(force_map, bound, limits, basis.raised):
        if (where := given[each.limits[which]]).size:
            yield each.finding(force_map, limits, names=(each.name,)), where


def states_above(force_map: ForceMap, force: str, limit: float) -> Iterator[tuple[str, float, float, float, float]]:
    """Name, place [m], speed [m/s] and force [N] of all states of the campaign whose force lies above a limit [N].

    The force is the one that censored repeats reached at least (`at_least`), or the highest measured one (`highest`).
    """
    if force_map.fit is None:
        return
    for group in force_map.fit.measured:
        for i in np.flatnonzero(getattr(group, force) > limit).tolist():
            figures = (group.distance[i], group.height[i], group.slowest[i], getattr(group, force)[i])
            yield str(group.name[i]), *map(float, figures)  # type: ignore[misc]


def measured_finding(force_map: ForceMap, kind: FindingKind, **figures: Any) -> Finding:
    """What a state of a map measured; of another quantity than the force with its unit."""
    unit = {} if force_map.quantity is Quantity.FORCE else {"unit": force_map.quantity.unit}
    return Finding.of(kind, **figures, **unit)


def _measured_beyond(
    force_map: ForceMap, d: FloatArray, h: FloatArray, limit: FloatArray, speed: FloatArray, force: str
) -> Iterator[tuple[Finding, Indices]]:
    """States of the campaign, test ones too, whose `at_least` or `highest` force contradicts speeds at their place.

    They exceeded the limit at a speed not above the one given. How far a censored impact exceeded it is unknown, so
    such an impact refuses the speed; of measured ones the bound allows for some.
    """
    kind = {"at_least": FindingKind.REACHED_AT_PLACE, "highest": FindingKind.MEASURED_AT_PLACE}[force]
    order = np.argsort(d, kind="stable")
    for name, d_state, h_state, v, newtons in states_above(force_map, force, float(limit.min(initial=np.inf))):
        first, last = np.searchsorted(d[order], (d_state - 2 * REPEAT_DISTANCE, d_state + 2 * REPEAT_DISTANCE))
        near = order[first:last]
        here = (np.abs(d[near] - d_state) <= REPEAT_DISTANCE) & (np.abs(h[near] - h_state) <= REPEAT_DISTANCE)
        where = near[here & (speed[near] >= v) & (limit[near] < newtons)]
        if where.size:
            yield measured_finding(force_map, kind, state=name, force_N=newtons, speed_mps=v), where
