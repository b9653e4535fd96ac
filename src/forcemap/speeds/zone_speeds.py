"""A speed for a whole zone or segment: a lower bound of the safe speeds at all places in it."""

from __future__ import annotations

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
from forcemap.speeds.range_enclosure import highest_measured_speed, lowest_measured_speeds
from forcemap.speeds.safe_speed import SAME_PLACE, SpeedOutcome, safe_speed, states_above, to_program
from forcemap.speeds.zones import Regions

_ROUNDS = 7  # halvings of a zone at most
_GAP_SHARE, _GAP_SPEED = 0.003, 0.0002  # how close to the safe speeds found a zone's speed is to come; [m/s]
_ROOT = 2e-6  # [m/s]; safe_speed may lie this far below a crossing
_PATCHES_AT_ONCE = 8192


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
        Why.
    speed_to_program, to_program_outcome, to_program_reason : array, shape (n,)
        As in `SafeSpeed`; a speed to program is at no place of the zone below what was measured there.
    limit : array, shape (n,)
        The force limit used [N].
    basis : Basis
        What the speeds rest on.
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

    @property
    def spread(self) -> FloatArray:
        """What the zone's size costs [m/s]: how much faster its fastest corner is; NaN where it is refused."""
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
    """A speed for each zone that exceeds the safe speed at no place in it.

    The bound is enclosed from above on patches that cover the zone, and the patches are cut until the speed is within
    0.3 % of the safe speeds found; it is a proof, not a sample. A zone is refused as a whole if any part of it lies
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
    >>> found = zone_speeds(published_map("ur10e"), zone, limit=280.0, bound=FixedMargin(0.10))
    >>> found.outcome[0].value, round(float(found.speed[0]), 3)
    ('admissible', 0.306)
    """
    n, allowance = len(zones), allowance or Allowance()
    distance, height = zones.probes
    at = safe_speed(
        force_map,
        distance,
        height,
        limit=_each(limit, n),
        bound=bound,
        contact=contact,
        quasi_static_limit=quasi_static_limit,
        spring_N_per_m=spring_N_per_m,
        angle=angle,
        allowance=allowance,
        hints=False,
    )
    newtons, level = (
        np.broadcast_to(np.asarray(force, dtype=np.float64), distance.shape)[:, 0].copy()
        for force in (at.limit, at.basis.level)
    )
    highest = force_map.measured_range.speeds(*zones.extremes(force_map.measured_range))[1].min(axis=1)
    whole = zones.patches(np.arange(n), np.tile([0.0, 1.0, 0.0, 1.0], (n, 1)))
    lowest = lowest_measured_speeds(force_map.measured_range, *whole.corners)[1]
    snapped = np.isin(highest, force_map.measured_range.points[:, 2])
    highest = np.where(snapped, highest, highest - 1e-12)

    speed = np.full(n, np.nan)
    outcome, reason = np.empty((2, n), dtype=object)
    outcome[:], reason[:] = SpeedOutcome.UNCONFIRMED, Finding.of(FindingKind.ZONE_UNCONFIRMED)
    barred = np.isin(at.outcome, (SpeedOutcome.UNCONFIRMED, SpeedOutcome.NOT_PERMITTED))
    outside = (np.isnan(highest) | (at.outcome == SpeedOutcome.OUTSIDE).any(axis=1)) & at.basis.permitted
    refused = barred.any(axis=1) & ~outside
    outcome[outside], reason[outside] = SpeedOutcome.OUTSIDE, Finding.of(FindingKind.ZONE_OUTSIDE)
    first = np.arange(n), barred.argmax(axis=1)
    outcome[refused], reason[refused] = at.outcome[first][refused], at.reason[first][refused]
    contradicted = np.zeros(n, dtype=np.bool_)
    for state, where in _contradictions(force_map, zones, level, bound):
        where &= ~(outside | refused)
        contradicted |= where
        reason[where] = state
    open_ = np.flatnonzero(~(outside | refused | contradicted))
    found = _divided(force_map, zones, open_, np.log(level), bound, highest, at.speed.min(axis=1))
    known = np.isfinite(found)
    given = open_[known]
    capped = found[known] >= highest[given]
    speed[given] = np.where(capped, highest[given], np.maximum(found[known] - _ROOT, 0.0))
    for kind, mask in ((SpeedOutcome.CAPPED, capped), (SpeedOutcome.ADMISSIBLE, ~capped)):
        outcome[given[mask]], reason[given[mask]] = kind, Finding.of(FindingKind[f"ZONE_{kind.name}"])
    for state, where in _measured_above(force_map, zones, level, speed):
        reason[where] = [why.and_(state) for why in reason[where]]
    fastest = np.where(np.isnan(speed), np.nan, at.speed.max(axis=1))
    basis = replace(at.basis, notes=(*at.basis.notes, Finding.of(FindingKind.WHOLE_ZONE)))
    programmed = to_program(speed, outcome, reason, lowest, allowance)
    return ZoneSpeeds(speed, outcome, fastest, lowest, highest, reason, *programmed, newtons, basis)


def _each(limit: ForceLimit | NewtonLimit | ArrayLike, n: int) -> ForceLimit | NewtonLimit | Any:
    """A numeric limit as a column, one row for each zone."""
    if isinstance(limit, NewtonLimit):
        return replace(limit, force=_each(limit.force, n))
    if isinstance(limit, ForceLimit) or np.ndim(limit) == 0:
        return limit
    if np.shape(limit) != (n,):
        raise InputError(f"limit: found the shape {np.shape(limit)}, expected one limit for each of {n} zones")
    return np.asarray(limit)[:, None]


def _divided(
    force_map: ForceMap,
    zones: Regions,
    open_: Indices,
    log_limit: FloatArray,
    bound: Bound,
    cap: FloatArray,
    at_probes: FloatArray,
) -> FloatArray:
    """Certified speed of the open zones, shape (m,), from patches cut where it is not yet close; -inf if refused."""
    goal = np.minimum(at_probes, cap)
    found = np.full(len(zones), np.inf)
    which, part = open_, np.tile([0.0, 1.0, 0.0, 1.0], (open_.size, 1))
    for remaining in range(_ROUNDS, -1, -1):
        if not which.size:
            break
        speed = _certified(force_map, zones.patches(which, part), bound, log_limit[which], cap[which])
        cut = speed < goal[which] * (1 - _GAP_SHARE) - _GAP_SPEED if remaining else np.zeros(which.size, np.bool_)
        np.minimum.at(found, which[~cut], speed[~cut])
        which, part = which[cut], part[cut]
        middle = _middle(zones.patches(which, part))
        np.minimum.at(goal, which, _certified(force_map, middle, bound, log_limit[which], cap[which]))
        hopeless = np.isneginf(goal) & np.isin(np.arange(len(zones)), which)
        found[hopeless] = -np.inf
        keep = ~hopeless[which]
        halves = zones.halves(part[keep])
        which, part = np.tile(which[keep], len(halves)), halves.reshape(-1, 4)
    return np.asarray(found[open_])


def _middle(patches: Patches) -> Patches:
    """The middle of each patch, as a patch without extent: whether cutting can help."""
    nothing = np.zeros_like(patches.first)
    return Patches(patches.corner + 0.5 * (patches.first + patches.second), nothing, nothing)


def _certified(
    force_map: ForceMap, patches: Patches, bound: Bound, log_limit: FloatArray, cap: FloatArray
) -> FloatArray:
    """A speed up to the cap certified on each patch, shape (n,); -inf where not even the lowest measured one is."""
    speeds = [np.empty(0)]
    for start in range(0, len(patches), _PATCHES_AT_ONCE):
        at = slice(start, start + _PATCHES_AT_ONCE)
        patch = Patches(patches.corner[at], patches.first[at], patches.second[at])
        least, most = lowest_measured_speeds(force_map.measured_range, *patch.corners)
        top = np.maximum(cap[at], most)
        enclosed = enclose(force_map, bound, patch, least, top)
        speed = enclosed.speed(enclosed.certified(log_limit[at]))
        enough = speed >= np.minimum(most, top)
        speeds.append(np.where(enough, np.minimum(speed, cap[at]), -np.inf))
    return np.concatenate(speeds)


def _contradictions(
    force_map: ForceMap, zones: Regions, limit: FloatArray, bound: Bound
) -> Iterator[tuple[Finding, Mask]]:
    """Zones in which an impact above the device range contradicts a speed, and the state.

    As `safe_speed` does at each place within 5 mm, unless the bound itself exceeds the limit there at the speed of the
    state, so that no place is given that speed.
    """
    for name, d, h, v, newtons in states_above(force_map, "at_least", float(limit.min())):
        where = zones.touching(d, h, SAME_PLACE) & (limit < newtons)
        edges = np.array([[d - SAME_PLACE], [d + SAME_PLACE], [h - SAME_PLACE], [h + SAME_PLACE]])
        patch = Patches.box(*edges)
        if not where.any() or highest_measured_speed(force_map.measured_range, *patch.corners)[0] < v:
            continue
        if lowest_measured_speeds(force_map.measured_range, *patch.corners)[1][0] <= v + 1e-7:
            ends, at = (np.array([0.0]), np.array([1.0])), np.array([v])
            where &= ~(enclose(force_map, bound, patch, at, at).smallest(*ends)[0] > np.log(limit))
        yield Finding.of(FindingKind.REACHED_IN_ZONE, state=name, force_N=newtons, speed_mps=v), where


def _measured_above(
    force_map: ForceMap, zones: Regions, limit: FloatArray, speed: FloatArray
) -> Iterator[tuple[Finding, Mask]]:
    """Zones in which a measured impact exceeded the limit at or below the speed given, and the state."""
    for name, d, h, v, newtons in states_above(force_map, "highest", float(limit.min())):
        where = zones.touching(d, h, SAME_PLACE) & (limit < newtons) & (speed >= v)
        yield Finding.of(FindingKind.MEASURED_IN_ZONE, state=name, force_N=newtons, speed_mps=v), where
