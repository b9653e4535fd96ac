"""A speed for a whole zone or segment: a lower bound of the safe speeds at all places in it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Indices, Mask, Objects
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.speeds.allowance import Allowance
from forcemap.speeds.basis import Basis
from forcemap.speeds.enclosures import Patches, enclose
from forcemap.speeds.quantities import QuantityCase, cases_of
from forcemap.speeds.range_enclosure import highest_measured_speed, lowest_measured_speeds
from forcemap.speeds.safe_speed import (
    REPEAT_DISTANCE,
    SafeSpeed,
    SpeedOutcome,
    lowest_of,
    lowest_speeds,
    measured_finding,
    speeds_of_case,
    states_above,
    to_program,
)
from forcemap.speeds.zones import Regions

_GAP_SHARE, _GAP_SPEED = 0.003, 0.0002
"""A zone is cut until its speed lies no further than this below the safe speeds in it: a share of them
(docs/decisions.md) plus an amount [m/s]. The amount is a choice, a fifth of the last digit shown."""

_ROUNDS = 7
"""Halvings of a zone at most. A choice: the gap closes with the square of a patch's size, so that seven leave less than
a ten-thousandth of it."""

_ROOT = 2e-6  # [m/s]; safe_speed may lie this far below a crossing
_RANGE_ROUNDING = 1e-12  # [m/s]; of a highest measured speed that is interpolated between states
_SPEED_ROUNDING = 1e-7  # [m/s]; how far above a state's speed the range enclosure may still begin at it
_PATCHES_AT_ONCE = 8192  # bounds the memory of an enclosure


@dataclass(frozen=True, eq=False)
class ZoneSpeeds:
    """One speed for each zone or segment, in their order.

    Parameters
    ----------
    speed : array, shape (n,)
        A lower bound of the safe speeds of all places of the zone [m/s], unrounded; NaN if the zone is refused.
    outcome : array of SpeedOutcome, shape (n,)
        `not_permitted` for the head, `outside` if any part of the zone is, `unconfirmed` if any part is or may be.
    fastest_probe : array, shape (n,)
        Largest safe speed among the corners or ends [m/s]; NaN where one of them has none.
    lowest_measured_speed, highest_measured_speed : array, shape (n,)
        Highest of the lowest and lowest of the highest measured speeds in the zone [m/s]; the last is NaN outside.
    reason : array of Finding, shape (n,)
        The reason for the outcome.
    speed_to_program, to_program_outcome, to_program_reason : array, shape (n,)
        As in `SafeSpeed`; a speed to program is at no place of the zone below what was measured there.
    limit : array, shape (n,)
        The force limit used [N].
    basis : Basis
        What the speeds rest on.
    governed_by : array of Quantity, shape (n,), or None
        As in `SafeSpeed`; None where the force alone counts.
    """

    speed: FloatArray
    outcome: Objects
    fastest_probe: FloatArray
    lowest_measured_speed: FloatArray
    highest_measured_speed: FloatArray
    reason: Objects
    speed_to_program: FloatArray
    to_program_outcome: Objects
    to_program_reason: Objects
    limit: FloatArray
    basis: Basis
    governed_by: Objects | None = None

    @property
    def spread(self) -> FloatArray:
        """Cost of the zone's size [m/s]: how much faster its fastest corner is; NaN where the zone is refused."""
        return np.asarray(self.fastest_probe - self.speed)

    @property
    def counts(self) -> dict[str, int]:
        """Number of zones of each outcome."""
        outcomes = self.outcome.tolist()
        return {outcome.value: outcomes.count(outcome) for outcome in SpeedOutcome}


def zone_speeds(
    force_map: ForceMap,
    zones: Regions,
    *,
    limit: ForceLimit | NewtonLimit | ArrayLike,
    bound: Bound,
    contact: Contact | None = None,
    quasi_static_limit: float | None = None,
    spring_N_per_m: float | None = None,
    angle: float = 0.0,
    allowance: Allowance | None = None,
) -> ZoneSpeeds:
    """A speed for each zone that is not above the safe speed of any place in it.

    The bound is enclosed from above on patches that cover the zone, and the patches are cut until the speed is within
    0.3 % of the safe speeds in it; it is a proof, not a sample. A zone is refused as a whole if any part of it lies
    outside the measured range or is unconfirmed, or if a censored impact contradicts a speed in it.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    zones : Zones or Segments
        Intervals of distance and height, or straight segments in space.
    limit : float, array, NewtonLimit or ForceLimit
        As in `safe_speed`; an array has one limit for each zone.
    bound : Bound
        `FixedMargin` or `ToleranceBound`.
    contact, quasi_static_limit, spring_N_per_m, angle, allowance : optional
        As in `safe_speed`; widening the zones by the position tolerance (`grown`) is left to the caller.

    Returns
    -------
    ZoneSpeeds

    Raises
    ------
    InputError
        As `safe_speed`, and for limits that are not one for each zone.
    BoundNotAvailable
        The map cannot carry the bound.

    Examples
    --------
    >>> from forcemap import FixedMargin, Zones, published_map
    >>> zone = Zones(0.78, 0.82, 0.38, 0.42)
    >>> result = zone_speeds(published_map("ur10e"), zone, limit=280.0, bound=FixedMargin(0.10))
    >>> result.outcome[0].value, round(float(result.speed[0]), 3)
    ('admissible', 0.306)
    """
    n, allowance = len(zones), allowance or Allowance()
    cases = cases_of(
        force_map,
        limit=_limit_column(limit, n),
        bound=bound,
        contact=contact,
        quasi_static_limit=quasi_static_limit,
        spring_N_per_m=spring_N_per_m,
        angle=angle,
    )
    probes = [speeds_of_case(case, *zones.probes, allowance, hints=False) for case in cases]
    results = [_of_case(case, zones, probe, allowance) for case, probe in zip(cases, probes, strict=True)]
    if len(cases) == 1:
        return results[0]
    together = lowest_of(cases, probes, *zones.probes, allowance)
    lowest = lowest_speeds(cases, results)
    fastest = np.where(np.isnan(lowest.speed), np.nan, together.speed.max(axis=1))
    programmed = to_program(lowest.speed, lowest.outcome, lowest.reason, lowest.low, allowance)
    return ZoneSpeeds(
        *(lowest.speed, lowest.outcome, fastest, lowest.low, lowest.high, lowest.reason, *programmed),
        *(results[0].limit, results[0].basis, lowest.governed_by),
    )


def _of_case(case: QuantityCase, zones: Regions, probes: SafeSpeed, allowance: Allowance) -> ZoneSpeeds:
    """The speeds that one quantity allows by itself."""
    n, force_map, bound = len(zones), case.force_map, case.basis.bound
    assert bound is not None
    newtons, level = (
        np.broadcast_to(np.asarray(force, dtype=np.float64), probes.speed.shape)[:, 0].copy()
        for force in (probes.limit, probes.basis.level)
    )
    lowest, highest = _measured_speeds(force_map, zones)
    refused, outcome, reason = _refusals(force_map, zones, probes, highest, level, bound)
    open_ = np.flatnonzero(~refused)
    slower = case.basis.slower
    logs = np.log(level), math.log(slower) if slower else -math.inf
    certified = _divided(force_map, zones, open_, logs, bound, highest, probes.speed.min(axis=1))
    known = np.isfinite(certified)
    given = open_[known]
    capped = certified[known] >= highest[given]
    speed = np.full(n, np.nan)
    speed[given] = np.where(capped, highest[given], np.maximum(certified[known] - _ROOT, 0.0))
    for kind, mask in ((SpeedOutcome.CAPPED, capped), (SpeedOutcome.ADMISSIBLE, ~capped)):
        outcome[given[mask]], reason[given[mask]] = kind, Finding.of(FindingKind[f"ZONE_{kind.name}"])
    for state, where in _measured_above(force_map, zones, level, speed):
        reason[where] = [why.and_(state) for why in reason[where]]
    fastest = np.where(np.isnan(speed), np.nan, probes.speed.max(axis=1))
    basis = replace(probes.basis, notes=(*probes.basis.notes, Finding.of(FindingKind.WHOLE_ZONE)))
    programmed = to_program(speed, outcome, reason, lowest, allowance)
    return ZoneSpeeds(speed, outcome, fastest, lowest, highest, reason, *programmed, newtons, basis)


def _limit_column(limit: ForceLimit | NewtonLimit | ArrayLike, n: int) -> ForceLimit | NewtonLimit | Any:
    """A numeric limit as a column, one row for each zone."""
    if isinstance(limit, NewtonLimit):
        return replace(limit, force=_limit_column(limit.force, n))
    if isinstance(limit, ForceLimit) or np.ndim(limit) == 0:
        return limit
    if np.shape(limit) != (n,):
        raise InputError(f"limit: found the shape {np.shape(limit)}, expected one limit for each of {n} zones")
    return np.asarray(limit)[:, None]


def _measured_speeds(force_map: ForceMap, zones: Regions) -> tuple[FloatArray, FloatArray]:
    """Highest of the lowest and lowest of the highest measured speeds [m/s] in each zone, shapes (n,).

    The second is NaN where a zone reaches outside the measured range.
    """
    measured_range, n = force_map.measured_range, len(zones)
    highest = measured_range.speeds(*zones.extremes(measured_range))[1].min(axis=1)
    whole = zones.patches(np.arange(n), np.tile([0.0, 1.0, 0.0, 1.0], (n, 1)))
    lowest = lowest_measured_speeds(measured_range, *whole.corners)[1]
    snapped = np.isin(highest, measured_range.points[:, 2])
    return lowest, np.where(snapped, highest, highest - _RANGE_ROUNDING)


def _refusals(
    force_map: ForceMap, zones: Regions, probes: SafeSpeed, highest: FloatArray, level: FloatArray, bound: Bound
) -> tuple[Mask, Objects, Objects]:
    """Which zones get no speed before their bound is looked at, shape (n,), and outcome and reason of every zone.

    A zone that is not refused here is unconfirmed until a speed is certified.
    """
    n = len(zones)
    outcome, reason = np.empty((2, n), dtype=object)
    outcome[:], reason[:] = SpeedOutcome.UNCONFIRMED, Finding.of(FindingKind.ZONE_UNCONFIRMED)
    barred = np.isin(probes.outcome, (SpeedOutcome.UNCONFIRMED, SpeedOutcome.NOT_PERMITTED))
    outside = np.isnan(highest) | (probes.outcome == SpeedOutcome.OUTSIDE).any(axis=1)
    outside &= probes.basis.permitted
    refused = barred.any(axis=1) & ~outside
    outcome[outside], reason[outside] = SpeedOutcome.OUTSIDE, Finding.of(FindingKind.ZONE_OUTSIDE)
    first = np.arange(n), barred.argmax(axis=1)
    outcome[refused], reason[refused] = probes.outcome[first][refused], probes.reason[first][refused]
    contradicted = np.zeros(n, dtype=np.bool_)
    for state, where in _contradictions(force_map, zones, level, bound):
        where &= ~(outside | refused)
        contradicted |= where
        reason[where] = state
    return outside | refused | contradicted, outcome, reason


def _divided(
    force_map: ForceMap,
    zones: Regions,
    open_: Indices,
    logs: tuple[FloatArray, float],
    bound: Bound,
    cap: FloatArray,
    probed: FloatArray,
) -> FloatArray:
    """Certified speed of the open zones, shape (m,); -inf if refused.

    `logs` are ln of the limits, shape (n,), and by how much more ln of the bound lies below them at the lowest speeds.
    Patches are cut where it is not yet close to the lowest safe speed `probed` in the zone.
    """
    goal, (log_limit, slower) = np.minimum(probed, cap), logs
    certified = np.full(len(zones), np.inf)
    which, part = open_, np.tile([0.0, 1.0, 0.0, 1.0], (open_.size, 1))
    for remaining in range(_ROUNDS, -1, -1):
        if not which.size:
            break
        speed = _certified(force_map, zones.patches(which, part), bound, (log_limit[which], slower), cap[which])
        cut = speed < goal[which] * (1 - _GAP_SHARE) - _GAP_SPEED if remaining else np.zeros(which.size, np.bool_)
        np.minimum.at(certified, which[~cut], speed[~cut])
        which, part = which[cut], part[cut]
        middle = _middle(zones.patches(which, part))
        np.minimum.at(goal, which, _certified(force_map, middle, bound, (log_limit[which], slower), cap[which]))
        hopeless = np.isneginf(goal) & np.isin(np.arange(len(zones)), which)
        certified[hopeless] = -np.inf
        keep = ~hopeless[which]
        halves = zones.halves(part[keep])
        which, part = np.tile(which[keep], len(halves)), halves.reshape(-1, 4)
    return np.asarray(certified[open_])


def _middle(patches: Patches) -> Patches:
    """The middle of each patch, as a patch without extent; the speed there shows whether cutting can help."""
    nothing = np.zeros_like(patches.first)
    return Patches(patches.corner + 0.5 * (patches.first + patches.second), nothing, nothing)


def _certified(
    force_map: ForceMap, patches: Patches, bound: Bound, logs: tuple[FloatArray, float], cap: FloatArray
) -> FloatArray:
    """Speed up to the cap that is certified on each patch, shape (n,); -inf if not even the lowest measured one is,
    with what slower motion asks for there."""
    speeds, (log_limit, slower) = [np.empty(0)], logs
    for start in range(0, len(patches), _PATCHES_AT_ONCE):
        batch = slice(start, start + _PATCHES_AT_ONCE)
        patch = Patches(patches.corner[batch], patches.first[batch], patches.second[batch])
        least, most = lowest_measured_speeds(force_map.measured_range, *patch.corners)
        top = np.maximum(cap[batch], most)
        enclosed = enclose(force_map, bound, patch, least, top)
        speed = enclosed.speed(enclosed.certified(log_limit[batch]))
        enough = speed >= np.minimum(most, top)
        if slower > -math.inf:
            lowest = np.full(len(patch), force_map.measured_range.lowest[2])
            begun, ends = enclose(force_map, bound, patch, lowest, lowest), np.zeros(len(patch))
            enough &= begun.largest(ends, ends) <= log_limit[batch] - slower
        speeds.append(np.where(enough, np.minimum(speed, cap[batch]), -np.inf))
    return np.concatenate(speeds)


def _contradictions(
    force_map: ForceMap, zones: Regions, limit: FloatArray, bound: Bound
) -> Iterator[tuple[Finding, Mask]]:
    """Zones in which an impact above the device range contradicts a speed, with its state.

    As in `safe_speed`, at each place within `REPEAT_DISTANCE`; unless the bound itself exceeds the limit there at the
    speed of the state, so that no place is given that speed.
    """
    for name, d, h, v, newtons in states_above(force_map, "at_least", float(limit.min())):
        where = zones.touching(d, h, REPEAT_DISTANCE) & (limit < newtons)
        near, far, low, high = (np.array([x + side * REPEAT_DISTANCE]) for x in (d, h) for side in (-1, 1))
        patch = Patches.box(near, far, low, high)
        if not where.any() or highest_measured_speed(force_map.measured_range, *patch.corners)[0] < v:
            continue
        if lowest_measured_speeds(force_map.measured_range, *patch.corners)[1][0] <= v + _SPEED_ROUNDING:
            ends, speed = (np.array([0.0]), np.array([1.0])), np.array([v])
            where &= ~(enclose(force_map, bound, patch, speed, speed).smallest(*ends)[0] > np.log(limit))
        yield measured_finding(force_map, FindingKind.REACHED_IN_ZONE, state=name, force_N=newtons, speed_mps=v), where


def _measured_above(
    force_map: ForceMap, zones: Regions, limit: FloatArray, speed: FloatArray
) -> Iterator[tuple[Finding, Mask]]:
    """Zones in which a measured impact exceeded the limit at or below the speed given, with its state."""
    for name, d, h, v, newtons in states_above(force_map, "highest", float(limit.min())):
        where = zones.touching(d, h, REPEAT_DISTANCE) & (limit < newtons) & (speed >= v)
        yield measured_finding(force_map, FindingKind.MEASURED_IN_ZONE, state=name, force_N=newtons, speed_mps=v), where
