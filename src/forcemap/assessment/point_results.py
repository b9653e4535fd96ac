"""Every contact point with its verdict: what permits contact there, up to which speed, and what it needs and lacks."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from forcemap.assessment.confirmation import Confirmations
from forcemap.assessment.contact_points import PHOTOGRAPHS_FOLDER, ContactPoint
from forcemap.assessment.missing import Missing
from forcemap.assessment.point_impacts import PASSED_OVER, PointImpact, point_impacts
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.conditions import Conditions, normalised
from forcemap.campaigns.dataset import Quantity
from forcemap.campaigns.phase_two import force_sinks
from forcemap.campaigns.point_list import POINTS_FOLDER
from forcemap.campaigns.state import StateTolerance
from forcemap.direction import (
    ON_AXIS,
    WIDEST_ANGLE,
    angle_between,
    direction_vector,
    raised_off_axis,
)
from forcemap.errors import BoundNotAvailable, ForcemapError, InputError
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.maps.below_map import far_below
from forcemap.maps.bounds import Bound, ToleranceBound
from forcemap.maps.force_map import ForceMap
from forcemap.maps.slower_impacts import SLOW, upper_of_slower
from forcemap.planning.confirm import ConfirmationResult, Confirmed
from forcemap.speeds.allowance import Allowance
from forcemap.speeds.safe_speed import floor_speed
from forcemap.speeds.zone_speeds import zone_speeds
from forcemap.speeds.zones import Zones
from forcemap.verdicts.verdict import VerdictOutcome

FEWEST_REPEATS = 3
"""Repeats that a point needs which rests on measurements: as many as the paper made of a state. A choice."""


_NO_WAY = {"grown_m": None, "area": None} | dict.fromkeys(("here", "zone", "both", "edge"), False)
"""What a point needs where its refusal says that itself."""


class PointOutcome(StrEnum):
    """Whether contact at a point is permitted; only `confirmed` rests on impacts at released speeds."""

    CONFIRMED = "confirmed"
    BY_MAP = "permitted_by_the_map"
    NOT_PERMITTED = "not_permitted"


@dataclass(frozen=True, eq=False)
class PointResult:
    """A contact point and what was found of it.

    Parameters
    ----------
    point : ContactPoint
    outcome : PointOutcome
    speed : float
        Highest speed to program there [m/s], unrounded; NaN if it is not permitted.
    rests_on : tuple of Finding
        What permits it.
    lacks : tuple of Finding
        What it lacks to be permitted; none if it is.
    impacts : tuple of PointImpact
        The recordings it names.
    confirmed_by : tuple of str
        Recordings of the impacts that confirm it.
    photograph : Path or None
        Its photograph's file, there or not.
    pressed : bool
        True if the permission holds for the pressure, too: by a map of it, and of every impact that confirms the point.
    warnings_off_axis : tuple of Finding
        What must be read before `off_axis` is used.
    """

    point: ContactPoint
    outcome: PointOutcome
    speed: float
    rests_on: tuple[Finding, ...]
    lacks: tuple[Finding, ...]
    impacts: tuple[PointImpact, ...]
    confirmed_by: tuple[str, ...]
    photograph: Path | None
    pressed: bool = False
    warnings_off_axis: tuple[Finding, ...] = ()

    @property
    def words(self) -> str:
        """The outcome in words, which tell impacts at the point from those that confirm the map elsewhere.

        For a body part that is held at a transient limit nothing is permitted without a reason that people have.
        """
        by_map_alone = self.outcome is PointOutcome.CONFIRMED and not self.point.by_measurements
        said = "permitted by the confirmed map" if by_map_alone else self.outcome.replace("_", " ")
        return f"{said}, IF the risk assessment says why" if self.if_reason else said

    @property
    def if_reason(self) -> bool:
        """True if it is permitted by a transient limit for a body part that is held."""
        return self.point.held_as_free and not self.lacks

    @property
    def off_axis(self) -> float | None:
        """Speed to program for motion up to `WIDEST_ANGLE` off the direction [m/s], NaN if there is none; None if
        `speed` holds for it, too, or there is none."""
        for note in self.rests_on if not self.lacks else ():
            if note.kind is FindingKind.ALONG_ONLY:
                return math.nan if note.figure("no_off") else min(self.speed, float(note.figure("off_mps")))
        return None

    @property
    def straight_only(self) -> bool:
        """True if its program is permitted only for motion straight along the direction."""
        off, programmed = self.off_axis, self.point.programmed
        return off is not None and (programmed > off or (math.isnan(off) and not math.isnan(programmed)))

    @property
    def program_at_most(self) -> float:
        """Speed that the program may have [m/s], also where it has more; NaN if there is none."""
        too_fast = [finding for finding in self.lacks if finding.kind is FindingKind.POINT_TOO_FAST]
        return float(too_fast[0].figure("permitted_mps")) if too_fast else self.speed

    @property
    def gravest(self) -> PointImpact | None:
        """The impact with the gravest verdict, None without any."""
        judged = [impact for impact in self.impacts if impact.governing]
        return max(judged, key=lambda each: each.governing.gravity if each.governing else (0, 0.0), default=None)


@dataclass(frozen=True, eq=False)
class _Part:
    """What the map, or measurements, say of a point: a speed to program with what it rests on, or what is lacking."""

    speed: float
    rests_on: tuple[Finding, ...] = ()
    lacks: tuple[Finding, ...] = ()
    confirmed_by: tuple[str, ...] = ()
    pressed: bool = False
    warnings_off_axis: tuple[Finding, ...] = ()


def point_results(
    points: Sequence[ContactPoint],
    *,
    folder: Path,
    conditions: Conditions,
    campaign: Campaign | Missing,
    force_map: ForceMap | Missing,
    bound: Bound | Missing,
    confirmed: Confirmations,
    allowance: Allowance,
) -> tuple[PointResult, ...]:
    """Every contact point with its verdict, in the order of the list.

    Parameters
    ----------
    points : sequence of ContactPoint
    folder : Path
        Of the campaign.
    conditions : Conditions
        What it was measured under.
    campaign, force_map, bound
        Of the campaign; a missing one permits nothing.
    confirmed : callable
        The result of the impacts that confirm the map, for a limit, a contact and a bound.
    allowance : Allowance
        How far the robot may deviate from its program.
    """
    impacts = point_impacts(folder, None if isinstance(campaign, Missing) else campaign, points)
    mapped = _by_map([point for point in points if point.by_map], conditions, force_map, bound, confirmed, allowance)
    return tuple(
        _result(
            point,
            folder,
            [_not_contradicted(mapped[point.name], impacts[point.name], allowance)] if point.by_map else [],
            [_not_below(_measured(point, impacts[point.name], conditions, allowance), force_map)]
            if point.by_measurements
            else [],
            impacts[point.name],
        )
        for point in points
    )


def _with_lacks(lacks: Sequence[Finding], rests_on: Sequence[Finding]) -> tuple[Finding, ...]:
    """What a permission rests on; of a refused one what it would."""
    by_map = (FindingKind.POINT_BY_MAP, FindingKind.POINT_CONFIRMED_MAP)
    refused = (("refused", bool(lacks)),)
    return tuple(replace(f, figures=f.figures + refused) if f.kind in by_map else f for f in rests_on)


def _result(
    point: ContactPoint,
    folder: Path,
    mapped: list[_Part],
    measured: list[_Part],
    impacts: Mapping[str, tuple[PointImpact, ...]],
) -> PointResult:
    parts, refusal = [*mapped, *measured], point.limit.refusal
    lacks = (refusal,) if refusal else tuple(finding for part in parts for finding in part.lacks)
    speed = min((part.speed for part in parts), default=math.nan) if not lacks else math.nan
    if not lacks and point.programmed > speed:
        lacks = (
            Finding.of(
                FindingKind.POINT_TOO_FAST, programmed_mps=point.programmed, permitted_mps=float(floor_speed(speed))
            ),
        )
    confirmed_by = tuple(name for part in parts for name in part.confirmed_by)
    outcome = PointOutcome.CONFIRMED if confirmed_by else PointOutcome.BY_MAP
    named = {impact.recording: impact for each in impacts.values() for impact in each}
    held = [Finding.of(FindingKind.POINT_HELD_AS_FREE, names=(point.name,))] * point.held_as_free
    rests_on = [*held, *(finding for part in parts for finding in part.rests_on)]
    return PointResult(
        point=point,
        outcome=PointOutcome.NOT_PERMITTED if lacks else outcome,
        speed=math.nan if lacks else speed,
        rests_on=() if refusal else _with_lacks(lacks, rests_on),
        lacks=lacks,
        impacts=tuple(named.values()),
        confirmed_by=() if lacks else confirmed_by,
        photograph=folder / PHOTOGRAPHS_FOLDER / point.photograph if point.photograph else None,
        pressed=not lacks and all(part.pressed for part in parts),
        warnings_off_axis=() if lacks else tuple(doubt for part in parts for doubt in part.warnings_off_axis),
    )


def _tolerance(conditions: Conditions) -> StateTolerance:
    return StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)


def _by_map(
    points: Sequence[ContactPoint],
    conditions: Conditions,
    force_map: ForceMap | Missing,
    bound: Bound | Missing,
    confirmed: Confirmations,
    allowance: Allowance,
) -> dict[str, _Part]:
    """What the map says of points, those of a limit, contact and angle together."""
    parts: dict[str, _Part] = {}
    groups: dict[tuple[ForceLimit, Contact, float], list[ContactPoint]] = {}
    for point in points:
        lacks = list(_not_as_measured(point, conditions, on_map=True))
        for missing in (force_map, bound):
            if isinstance(missing, Missing) and not lacks:
                lacks.append(Finding.of(FindingKind.POINT_NO_MAP, words=missing.reason))
        if lacks or not point.limit.permitted:
            parts[point.name] = _Part(math.nan, lacks=tuple(lacks))
        else:
            angle = _angle(point, conditions)
            groups.setdefault((point.limit, point.contact, angle if angle > ON_AXIS else 0.0), []).append(point)
    for (limit, contact, angle), group in groups.items():
        assert isinstance(force_map, ForceMap)
        assert not isinstance(bound, Missing)
        ends = ([getattr(p, name) for p in group] for name in ("distance", "distance_to", "height", "height_to"))
        zones = Zones(*map(np.array, ends)).grown(allowance.position)
        case: dict[str, Any] = {"limit": limit, "bound": bound, "contact": contact, "allowance": allowance}
        try:
            speeds = zone_speeds(force_map, zones, **case, angle=angle)
        except ForcemapError as error:
            why = Finding.of(FindingKind.POINT_MAP_REFUSES, in_words(error.message), **_NO_WAY)
            parts |= {point.name: _Part(math.nan, lacks=(why,)) for point in group}
            continue
        refusal = speeds.basis.export_refusal
        near = {"grown_m": allowance.position or None, "raised": raised_off_axis(angle) - 1 or None}
        straight = [note for note in speeds.basis.notes if note.kind is FindingKind.ALONG_ONLY]
        off_axis = zone_speeds(force_map, zones, **case, angle=WIDEST_ANGLE) if straight else speeds
        doubts = off_axis.basis.warnings_beyond(speeds.basis)
        lowest = Finding.of(FindingKind.POINT_LOWEST_NEAR, **near)
        asked = {"area": limit.name, "contact": contact.value, "grown_m": allowance.position or None}
        for i, point in enumerate(group):
            if refusal:
                why = Finding.of(FindingKind.POINT_NOT_RELEASED, refusal)
                parts[point.name] = _Part(math.nan, lacks=(why,))
                continue
            zone = point.extent > _tolerance(conditions).place
            ways = {"zone": zone, "both": not zone and point.by_measurements}
            ways["here"] = not any(ways.values())
            outside = speeds.to_program_reason[i].kind is FindingKind.ZONE_OUTSIDE
            ways["edge"] = outside and _inside(force_map, point)
            reason = Finding.of(FindingKind.POINT_MAP_REFUSES, speeds.to_program_reason[i], **asked, **ways)
            result, beside = confirmed(limit, contact, bound), _tolerance(conditions).place
            part = _mapped(float(speeds.speed_to_program[i]), reason, result, point, beside)
            along = [_with_off_axis(note, float(off_axis.speed_to_program[i])) for note in straight]
            rests_on = (*along, *part.rests_on, lowest) if part.rests_on else ()
            pressed = force_map.other(Quantity.PRESSURE) is not None
            parts[point.name] = replace(part, rests_on=rests_on, pressed=pressed, warnings_off_axis=doubts)
    return parts


def _with_off_axis(straight: Finding, speed: float) -> Finding:
    """That a speed holds for motion straight along the direction, with the one to program off it [m/s], NaN if none."""
    none = math.isnan(speed)
    figures = {"off_mps": None if none else float(floor_speed(speed)), "no_off": none or None}
    return Finding.of(straight.kind, **dict(straight.figures) | figures)


def _inside(force_map: ForceMap, point: ContactPoint) -> bool:
    """True if a point, with its zone but nothing around it, lies inside the measured range."""
    ends = np.array([point.distance, point.distance_to]), np.array([point.height, point.height_to])
    distance, height = map(np.ravel, np.meshgrid(*ends))
    return bool(np.isfinite(force_map.measured_range.speeds(distance, height)[1]).all())


def _mapped(
    speed: float, reason: Finding, result: ConfirmationResult | None, point: ContactPoint, beside: float
) -> _Part:
    """What a speed of the map is worth at a point; impacts no farther than `beside` [m] were made there."""
    if math.isnan(speed):
        return _Part(math.nan, lacks=(reason,))
    if result is not None and result.outcome is Confirmed.DOES_NOT_PASS:
        return _Part(math.nan, lacks=(Finding.of(FindingKind.POINT_NOT_CONFIRMED, result.reason),))
    if result is None or result.outcome is not Confirmed.PASSES:
        asked = {"area": point.limit.name, "contact": point.contact.value}
        return _Part(speed, (Finding.of(FindingKind.POINT_BY_MAP, speed_mps=float(floor_speed(speed)), **asked),))
    names = tuple(impact.recording for impact in result.impacts)
    here = sum(
        point.distance - beside <= impact.distance <= point.distance_to + beside
        and point.height - beside <= impact.height <= point.height_to + beside
        for impact in result.impacts
    )
    figures: dict[str, Any] = {"speed_mps": float(floor_speed(speed)), "impacts": len(names), "names": names}
    figures |= {"here": here or None, **result.missed}
    return _Part(speed, (Finding.of(FindingKind.POINT_CONFIRMED_MAP, **figures),), confirmed_by=names)


def _not_contradicted(part: _Part, named: Mapping[str, tuple[PointImpact, ...]], allowance: Allowance) -> _Part:
    """What the map says of a point, unless an impact made there exceeded its limit at a speed that the map permits."""
    if math.isnan(part.speed):
        return part
    against = [
        Finding.of(FindingKind.POINT_SPEED_EXCEEDED, impact.reason, recording=impact.recording, speed_mps=impact.speed)
        for impact in {each.recording: each for of_pattern in named.values() for each in of_pattern}.values()
        if impact.outcome is VerdictOutcome.EXCEEDED and not impact.speed > part.speed + allowance.speed
    ]
    return _Part(math.nan, lacks=tuple(against)) if against else part


def _angle(point: ContactPoint, conditions: Conditions) -> float:
    """Angle between the motion at a point and that of the campaign [deg]; infinite if one of them is not stated."""
    try:
        directions = [direction_vector(words, whose="it") for words in (point.direction, conditions.direction)]
    except InputError:
        return math.inf
    return angle_between(*directions)


def _not_as_measured(point: ContactPoint, conditions: Conditions, *, on_map: bool) -> list[Finding]:
    """Why what the campaign measured says nothing of a point: another place, site or direction, or not stated."""
    findings, angle = [], _angle(point, conditions)
    site, measured = point.contact_site, conditions.contact_site
    if not point.placed:
        findings.append(Finding.of(FindingKind.POINT_PLACE_MISSING, map=on_map))
    if not site or normalised(site) != normalised(measured):
        findings.append(Finding.of(FindingKind.POINT_SITE_OTHER, site=site, measured=measured))
    if angle > (WIDEST_ANGLE if on_map else ON_AXIS):
        stated = {"direction": point.direction, "measured": conditions.direction}
        findings.append(Finding.of(FindingKind.POINT_DIRECTION_OTHER, **stated, angle_deg=angle))
    return findings


def _measured(
    point: ContactPoint,
    named: Mapping[str, tuple[PointImpact, ...]],
    conditions: Conditions,
    allowance: Allowance,
) -> _Part:
    """What the impacts made at a point say of it."""
    if not point.recordings:
        return _Part(math.nan, lacks=(Finding.of(FindingKind.POINT_NOT_MEASURED),))
    lacks = [
        Finding.of(FindingKind.POINT_NO_SUCH_RECORDING, pattern=pattern)
        for pattern in point.recordings
        if not named.get(pattern)
    ]
    by_name = {pattern: each for pattern, each in named.items() if pattern != PASSED_OVER}
    every = {impact.recording: impact for each in by_name.values() for impact in each if not impact.excluded}
    impacts = list(every.values())
    tolerance = _tolerance(conditions)
    slower, faster = _not_named(impacts, named.get(PASSED_OVER, ()), tolerance.speed + allowance.speed)
    if not point.by_map and point.extent > tolerance.place:
        lacks.append(Finding.of(FindingKind.POINT_ZONE_MEASURED))
    if any(not impact.own for impact in impacts):
        lacks += _not_as_measured(point, conditions, on_map=False)
    lacks += [finding for impact in (*impacts, *slower) if (finding := _unusable(point, impact, tolerance))]
    if len(impacts) < FEWEST_REPEATS:
        lacks.append(Finding.of(FindingKind.POINT_FEW_REPEATS, impacts=len(impacts), needed=FEWEST_REPEATS))
    speeds = np.array([impact.speed for impact in impacts if not math.isnan(impact.speed)])
    if speeds.size and np.ptp(speeds) > tolerance.speed:
        ends = {"low_mps": float(speeds.min()), "high_mps": float(speeds.max())}
        lacks.append(Finding.of(FindingKind.POINT_SPEEDS_DIFFER, **ends))
    also = [Finding.of(FindingKind.POINT_FASTER_NOT_COUNTED, low_mps=min(i.speed for i in faster))] if faster else []
    if lacks:
        return _Part(math.nan, tuple(also), lacks=tuple(lacks))
    # speeds are stated in decimals: 0.235 - 0.01 is 0.225
    speed = min(i.speed if i.own else round(float(allowance.off(np.array(i.speed))), 9) for i in impacts)
    if speed <= 0:
        return _Part(math.nan, lacks=(Finding.of(FindingKind.POINT_SPEED_MISSING, recording=impacts[0].recording),))
    names = tuple(impact.recording for impact in impacts)
    rests = Finding.of(FindingKind.POINT_MEASURED, impacts=len(names), speed_mps=float(floor_speed(speed)))
    with_pressure = sum(impact.pressure is not None for impact in impacts)
    partly = Finding.of(FindingKind.POINT_PRESSURE_PARTLY, measured=with_pressure, impacts=len(impacts))
    excluded = sorted({i.recording for each in named.values() for i in each if i.excluded})
    taken_out = [in_words(f"taken out by a person, and not counted: {', '.join(excluded)}")] if excluded else []
    unlike = [partly] if 0 < with_pressure < len(impacts) else []
    pressed = with_pressure == len(impacts)
    return _Part(speed, (rests, *unlike, *taken_out, *also), confirmed_by=names, pressed=pressed)


def doubts_at_points(points: Sequence[PointResult], force_map: ForceMap | Missing) -> list[Finding]:
    """What is to be known of the impacts that confirm contact points: what is stated since, that their forces sink; and
    that nothing tells of slower motion, nor whether their stated speeds were reached, but of those of a map that says
    it of itself and permits their places for slower motion."""
    confirming = {
        e.point.name: [impact for impact in e.impacts if impact.recording in e.confirmed_by]
        for e in points
        if e.point.by_measurements
    }
    every = [impact for impacts in confirming.values() for impact in impacts]
    found = list(dict.fromkeys(impact.since for impact in every if impact.since))
    if at := tuple(name for name, impacts in confirming.items() if any(impact.sinks for impact in impacts)):
        found.append(force_sinks(float(np.mean([impact.sinks for impact in every])), at))
    found += filter(None, (_below_prediction(each, force_map) for each in points))
    of_none = [e for e in points if e.confirmed_by and e.point.by_measurements and not _of_map(e, force_map)]
    if not of_none:
        return found
    found.append(Finding.of(FindingKind.POINT_SPEED_UNTOLD, names=tuple(each.point.name for each in of_none)))
    fast = [each.speed for each in of_none if each.speed >= SLOW + StateTolerance().speed]
    if isinstance(force_map, Missing) and fast:
        found.append(
            Finding.of(FindingKind.SLOW_IMPACTS_MISSING, lowest_mps=min(fast), stated_mps=None, below_mps=None)
        )
    return found


def _below_prediction(result: PointResult, force_map: ForceMap | Missing) -> Finding | None:
    """That impacts permit a point where the map of its contact site and direction predicts more than the limit."""
    point = result.point
    if isinstance(force_map, Missing) or not force_map.fit or not (result.confirmed_by and point.by_measurements):
        return None
    states = force_map.fit.at_points.select(np.isin(force_map.fit.at_points.name, result.confirmed_by))
    limit, predicted = point.limit.force(point.contact), force_map.predict(*states.coordinates.T)
    if not np.any(predicted > limit):
        return None
    i = int(np.nanargmax(predicted))
    figures = {"predicted_N": float(predicted[i]), "speed_mps": float(states.speed[i]), "limit_N": limit}
    return Finding.of(
        FindingKind.POINT_BELOW_PREDICTION, name=point.name, force_N=float(states.highest.max()), **figures
    )


def _of_map(result: PointResult, force_map: ForceMap | Missing) -> bool:
    """Whether a map is of the contact site, direction and place of the impacts at a point, and permits slower motion
    there."""
    if isinstance(force_map, Missing) or not (fit := force_map.fit):
        return False
    point = result.point
    if any(name.startswith(f"{POINTS_FOLDER}/") and name not in fit.at_points.name for name in result.confirmed_by):
        return False
    d = np.array([point.distance, np.fmax(point.distance, point.distance_to)])
    h = np.array([point.height, np.fmax(point.height, point.height_to)])
    if np.isnan(force_map.measured_range.speeds(d, h)[0]).any():
        return False
    bound = ToleranceBound(device_error=force_map.conditions.device.error_or_default)
    with contextlib.suppress(BoundNotAvailable):
        return bool((upper_of_slower(force_map, bound, d, h) <= point.limit.force(point.contact)).all())
    return True


def _not_below(part: _Part, force_map: ForceMap | Missing) -> _Part:
    """What impacts at a point say of it; nothing where they lie far below the map of its contact site and direction."""
    if isinstance(force_map, Missing) or not (fit := force_map.fit) or not len(fit.at_points):
        return part
    below = far_below(force_map, fit.at_points.select(np.isin(fit.at_points.name, part.confirmed_by)))
    return _Part(math.nan, lacks=(below,)) if below else part


def _not_named(
    impacts: Sequence[PointImpact], others: Sequence[PointImpact], more: float
) -> tuple[list[PointImpact], list[PointImpact]]:
    """Of impacts at a point that it does not name: those no faster than the ones it names, which count, and the rest.

    `more` [m/s] is how much faster than stated an impact may have been made; one whose speed is not known counts.
    """
    fastest = max((impact.speed for impact in impacts), default=math.inf) + more
    faster = [impact for impact in others if impact.speed > fastest]
    return [impact for impact in others if impact not in faster], faster


def _unusable(point: ContactPoint, impact: PointImpact, tolerance: StateTolerance) -> Finding | None:
    """Why an impact says nothing of a point, or forbids it; None if it was within the limit there."""
    name = {"recording": impact.recording}
    if impact.outcome is not VerdictOutcome.WITHIN:
        return Finding.of(FindingKind.POINT_IMPACT_NOT_WITHIN, impact.reason, **name)
    if not impact.own and math.isnan(impact.place[0]):
        return Finding.of(FindingKind.POINT_UNPLANNED, **name)
    if math.isnan(impact.speed):
        return Finding.of(FindingKind.POINT_SPEED_MISSING, **name, own=impact.own)
    ends = ((point.distance, point.distance_to), (point.height, point.height_to))
    apart = max(max(low - x, x - high) for x, (low, high) in zip(impact.place, ends, strict=True))
    if not impact.own and point.placed and apart > tolerance.place + 1e-9:
        at = {"distance_m": impact.place[0], "height_m": impact.place[1]}
        return Finding.of(FindingKind.POINT_ELSEWHERE, **name, **at)
    return None
