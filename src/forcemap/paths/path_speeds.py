"""Speeds along a path: the lower bound over each piece, the strictest body area, and the cycle time they give."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask, Objects
from forcemap.direction import ON_AXIS, RAISED_OFF_AXIS, WIDEST_ANGLE, raised_off_axis
from forcemap.findings import Finding, FindingKind
from forcemap.limits.body_areas import LimitTable, standard_limit_table
from forcemap.limits.force_limits import Contact, ForceLimit, force_limit
from forcemap.limits.pfl import pfl_robot_mass, pfl_speed_limit
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.paths.atlas import Atlas, told_apart
from forcemap.paths.matched_maps import CORNER, MatchedMaps, matched_maps
from forcemap.paths.task import Task
from forcemap.paths.time_law import braking_speeds, time_law
from forcemap.paths.tool_path import CORNER_ANGLE, ToolPath
from forcemap.speeds.allowance import POSITION_TOLERANCE, Allowance
from forcemap.speeds.basis import Basis
from forcemap.speeds.zone_speeds import ZoneSpeeds, zone_speeds
from forcemap.speeds.zones import Segments

LONGEST_PIECE = 0.02
"""Longest piece of a path that gets one speed, unless stated [m]. A choice, tried in the virtual lab (docs/validity.md,
"Motion beside the map's direction")."""

_SPEED_ROUNDING = 1e-9  # share by which a programmed speed may exceed the allowed one
_MORE = 1.01  # times the task's acceleration, from which rows show more than it
_LAST_DIGIT = 0.01  # share by which a log may exceed the task's speed where contact is excluded (docs/decisions.md)


class PieceOutcome(StrEnum):
    """What is known of the speed on a piece of a path."""

    ADMISSIBLE = "admissible"
    CAPPED = "capped"
    UNCONFIRMED = "unconfirmed"
    OUTSIDE = "outside"
    NOT_DOWNWARD = "not_downward"
    NO_MAP = "no_map"
    NOT_PERMITTED = "not_permitted"
    NO_CONTACT = "no_contact"

    @property
    def refused(self) -> bool:
        """True if no speed is permitted."""
        return self not in (PieceOutcome.ADMISSIBLE, PieceOutcome.CAPPED, PieceOutcome.NO_CONTACT)


@dataclass(frozen=True)
class CycleTime:
    """Time of a path at one rule of speed.

    Parameters
    ----------
    rule : str
        Which speeds are driven.
    duration : float
        Time of the whole path [s]; NaN if any piece has no permission, or the rule no speed.
    permitted_duration : float
        Time of the permitted pieces alone, each stretch of them from rest to rest [s]; NaN if there are none.
    speed : float
        The one speed of the rule where contact is possible [m/s]; NaN if it has many, or none.
    """

    rule: str
    duration: float
    permitted_duration: float
    speed: float = math.nan


@dataclass(frozen=True, eq=False)
class PathSpeeds:
    """Speeds along a path, for each of its pieces.

    Parameters
    ----------
    path : ToolPath
        The path in short pieces.
    speed : array, shape (n,)
        Highest speed to program [m/s], unrounded, the allowance subtracted; NaN where none is permitted.
    contact_speed : array, shape (n,)
        The speed at contact behind it [m/s]; NaN where there is none, or contact is excluded.
    outcome : array of PieceOutcome, shape (n,)
        What is known of the speed.
    reason : array of Finding, shape (n,)
        The reason for the outcome.
    governed_by : array of str, shape (n,)
        Body area and contact that give the lowest speed.
    map_name : array of str, shape (n,)
        Name of the map that gives it; empty where none holds.
    limit : array, shape (n,)
        Their force limit [N]; NaN where contact is excluded or not permitted.
    programmed : array, shape (n,)
        Programmed speed [m/s]; of a timed path the highest that its rows allow for, where contact is excluded the mean,
        which counts as the task's speed up to 1 % above it. NaN where not stated.
    allowed, standard, constant, segmented, program, slowed : CycleTime
        Cycle times at the allowed speeds; at the standard's one speed; at the lowest allowed speed throughout; at that
        of each segment, as by one motion command; as programmed; as programmed, slowed to the allowed speed where that
        is lower.
    acceleration : float
        Largest acceleration along the path [m/s^2].
    allowance : Allowance
        What was subtracted.
    bases : tuple of Basis
        What the speeds rest on, for every body area and contact.
    notes : tuple of Finding
        What else the speeds depend on.
    standard_of : Finding or None
        Which limit gives the standard's one speed; None if it has none.
    matched : MatchedMaps
        The map or maps, and where they hold.
    doubts : tuple of Finding
        What must be read before these speeds are used, besides what their bases say.
    """

    path: ToolPath
    speed: FloatArray
    contact_speed: FloatArray
    outcome: Objects
    reason: Objects
    governed_by: Objects
    map_name: Objects
    limit: FloatArray
    programmed: FloatArray
    allowed: CycleTime
    standard: CycleTime
    constant: CycleTime
    segmented: CycleTime
    program: CycleTime
    slowed: CycleTime
    acceleration: float
    allowance: Allowance
    bases: tuple[Basis, ...]
    notes: tuple[Finding, ...]
    standard_of: Finding | None
    matched: MatchedMaps
    doubts: tuple[Finding, ...] = ()

    @property
    def atlas(self) -> Atlas:
        """The map or maps."""
        return self.matched.atlas

    @property
    def simulated(self) -> bool:
        """True if the impacts of a map are simulated."""
        return self.atlas.simulated

    @property
    def refused(self) -> Mask:
        """True for pieces without permission, shape (n,)."""
        return np.array([outcome.refused for outcome in self.outcome])

    @property
    def too_fast(self) -> Mask:
        """True for pieces whose programmed speed exceeds the allowed one, or has no permission, shape (n,)."""
        with np.errstate(invalid="ignore"):
            return self.refused | (self.programmed > self.speed * (1 + _SPEED_ROUNDING))

    @property
    def standard_beyond(self) -> float:
        """Share of the path's length on which the standard's one speed is not permitted by the map; NaN without one."""
        if math.isnan(self.standard.speed):
            return math.nan
        possible = np.array([outcome is not PieceOutcome.NO_CONTACT for outcome in self.outcome])
        beyond = possible & ~(self.speed >= self.standard.speed)
        return float(self.path.lengths[beyond].sum() / self.path.lengths.sum())

    @property
    def commanded(self) -> FloatArray:
        """Speed [m/s] for a robot that changes its speed piece by piece, shape (n,); 0 where none is permitted.

        No piece is entered faster than it allows if the robot brakes with at least `acceleration`; so the piece before
        one without permission has 0, too.
        """
        allowed = np.where(self.refused, 0.0, self.speed)
        return braking_speeds(self.path.lengths, allowed, acceleration=self.acceleration)

    def duration(self, speed: FloatArray) -> float:
        """Time of the whole path [s] at a speed on each piece [m/s], shape (n,); NaN where a piece has none."""
        driven = np.where(speed > 0, speed, math.nan)
        return _cycle_time("", self.path, self.refused, self.acceleration, driven).duration


def path_speeds(
    maps: ForceMap | Atlas,
    path: ToolPath,
    task: Task,
    *,
    bound: Bound,
    allowance: Allowance | None = None,
    step: float = LONGEST_PIECE,
    angle: float = WIDEST_ANGLE,
    table: LimitTable | None = None,
) -> PathSpeeds:
    """Speeds that one or several maps allow along a path, and the resulting cycle times.

    Each piece gets the lowest of the lower bounds for its body areas over all places where it may be, in every map that
    holds for it: that of its direction, tool and payload. Each contact site that can hit needs one. Pieces without,
    outside, or unconfirmed get no permission and no duration. Off a map's direction its bound is raised by 14 %.

    Parameters
    ----------
    maps : ForceMap or Atlas
        The map; its campaign states the direction. Or several maps of one robot.
    path : ToolPath
        The path.
    task : Task
        Body areas and contact of each segment; contact sites, tool and payload where the maps differ in them.
    bound : Bound
        `FixedMargin` or `ToleranceBound`, of every map.
    allowance : Allowance, optional
        What the robot may deviate; `Allowance()` if not given.
    step : float
        Longest piece [m].
    angle : float
        How far a motion may point away from a map's direction [deg], at most 5.
    table : LimitTable, optional
        Table of limits; that of ISO/TS 15066:2016 if not given.

    Returns
    -------
    PathSpeeds

    Raises
    ------
    InputError
        Path and task do not name the same segments, the task differs from the campaign or leaves open what campaigns
        differ in, or a campaign does not state a direction a path can be compared with.
    UnknownName
        The table of limits does not have a body area.
    BoundNotAvailable
        The map, or every map, cannot carry the bound.
    """
    case: dict[str, Any] = {"bound": bound, "allowance": allowance, "step": step, "angle": angle, "table": table}
    return path_speeds_at(maps, path, [np.zeros(3)], task, **case)[0]


def path_speeds_at(
    maps: ForceMap | Atlas,
    path: ToolPath,
    offsets: Sequence[FloatArray],
    task: Task,
    *,
    bound: Bound,
    allowance: Allowance | None = None,
    step: float = LONGEST_PIECE,
    angle: float = WIDEST_ANGLE,
    table: LimitTable | None = None,
) -> list[PathSpeeds]:
    """As `path_speeds`, of a path moved by each of some offsets, shape (3,) [m]; together faster than one by one."""
    task.require_segments(path.names, path.end_name)
    atlas = Atlas.of(maps).carrying(bound)
    atlas.require_task(task)
    raised_off_axis(angle)  # refuses an angle for which nothing was measured
    allowance, table = allowance or Allowance(), table or standard_limit_table()
    paths = [path.moved(offset).resampled(step) for offset in offsets]
    reach = allowance.position + path.deviation
    matched = [matched_maps(atlas, each, task, angle=angle, beside=reach) for each in paths]
    strictest = _strictest(matched, paths, task, bound, allowance, table, reach)
    parts = strictest.parts([len(each) for each in paths])
    return [_path_speeds(*each, task, allowance) for each in zip(paths, matched, parts, strict=True)]


def _path_speeds(
    path: ToolPath, matched: MatchedMaps, strictest: _Strictest, task: Task, allowance: Allowance
) -> PathSpeeds:
    """The speeds along a path in pieces, by the strictest of each piece."""
    segments = [task.segment(name) for name in path.names]
    excluded = np.array([segment.contact is None for segment in segments])
    stated = np.array([segment.speed for segment in segments])
    programmed = _programmed_speeds(path, stated, excluded, task.acceleration)
    outcome, reason = strictest.outcome, strictest.reason
    missing = matched.missing & (outcome != PieceOutcome.NOT_PERMITTED)  # no map would permit that
    reason[missing] = matched.reasons(missing)
    outcome[missing] = [_without_map(each) for each in reason[missing]]
    _say_off_direction(strictest, path, matched)
    outcome[excluded], reason[excluded] = PieceOutcome.NO_CONTACT, Finding.of(FindingKind.CONTACT_EXCLUDED)
    without_speed = matched.missing | np.isinf(strictest.speed)
    speed = np.where(excluded, stated, np.where(without_speed, np.nan, strictest.speed))
    if path.by_one is not None:  # the end that states none may be faster: only that the other is too fast is known
        with np.errstate(invalid="ignore"):
            programmed = np.where(path.by_one & np.isnan(stated) & ~(programmed > speed), np.nan, programmed)

    refused = np.array([piece.refused for piece in outcome])
    driven = speed[~excluded & ~refused]
    lowest = float(driven.min()) if driven.size else math.nan
    standard = _to_program(strictest.standard[~excluded], allowance)
    timing = (path, refused, task.acceleration)
    return PathSpeeds(
        path=path,
        speed=speed,
        contact_speed=np.where(excluded | matched.missing, np.nan, strictest.contact),
        outcome=outcome,
        reason=reason,
        governed_by=strictest.governed_by,
        map_name=strictest.map_name,
        limit=strictest.limit,
        programmed=programmed,
        allowed=_cycle_time("allowed speeds", *timing, speed),
        standard=_cycle_time("the standard's one speed", *timing, np.where(excluded, stated, standard), standard),
        constant=_cycle_time("lowest allowed speed throughout", *timing, np.where(excluded, stated, lowest), lowest),
        segmented=_cycle_time("lowest allowed speed of each segment", *timing, _lowest_of_segments(path.names, speed)),
        program=_as_programmed("as programmed", *timing, programmed, programmed),
        slowed=_as_programmed("as programmed, slowed where too fast", *timing, programmed, speed),
        acceleration=task.acceleration,
        allowance=allowance,
        bases=_without_direction(told_apart(strictest.bases, matched.atlas)),
        notes=_notes(matched, path, task, programmed, excluded, allowance),
        standard_of=None if math.isnan(standard) else strictest.standard_limit(~excluded, path.names),
        matched=matched,
        doubts=(
            *path.doubts,
            *(matched.at_flange if path.of_flange else ()),
            *matched.named_late(path),
            *matched.beside,
            *_rows_apart(path, excluded, task.acceleration, allowance),
            *_blended(path, excluded, allowance),
        ),
    )


def _rows_apart(path: ToolPath, excluded: Mask, acceleration: float, allowance: Allowance) -> Iterator[Finding]:
    """That a robot may have gone farther beyond the rows of a path than the position tolerance."""
    beside, apart = path.beside_turns(acceleration, ~excluded)
    if beside > allowance.position:
        figures = {"beside_m": beside, "apart_s": apart, "acceleration_mps2": acceleration}
        needed = math.sqrt(8 * allowance.position / acceleration)
        yield Finding.of(FindingKind.ROWS_APART, **figures, tolerance_m=allowance.position, needed_s=needed)


def _blended(path: ToolPath, excluded: Mask, allowance: Allowance) -> Iterator[Finding]:
    """That a stated position tolerance covers no corner of a motion with contact that the robot blends."""
    corners = path.turns[(path.turns > CORNER_ANGLE) & ~(excluded[:-1] & excluded[1:])]
    if allowance.position > POSITION_TOLERANCE and corners.size:
        figures = {"tolerance_m": allowance.position, "corners": corners.size, "turn_deg": corners.max()}
        yield Finding.of(FindingKind.CORNERS_BLENDED, **figures)


def _say_off_direction(strictest: _Strictest, path: ToolPath, matched: MatchedMaps) -> None:
    """Add to the reason of pieces without a confirmed speed that they point off the map's direction, and how far."""
    names, unconfirmed = np.array(path.names), strictest.outcome == PieceOutcome.UNCONFIRMED
    for entry, off_angle in zip(matched.atlas.maps, matched.off_angles, strict=True):
        off = unconfirmed & (strictest.map_name == entry.name) & (off_angle > ON_AXIS)
        for name in dict.fromkeys(names[off].tolist()):
            pieces = np.flatnonzero(off & (names == name))
            figures = {"off_deg": float(off_angle[pieces].max()), "raised": RAISED_OFF_AXIS - 1}
            words = {"direction": entry.conditions.direction}
            for piece in pieces:
                reason = strictest.reason[piece]
                strictest.reason[piece] = Finding.of(FindingKind.OFF_DIRECTION, reason, **figures, **words)


def _lowest_of_segments(names: Sequence[str], speed: FloatArray) -> FloatArray:
    """The lowest speed of the segment of each piece, shape (n,); NaN where it has none."""
    starts = np.array([number for number in range(len(names)) if not number or names[number] != names[number - 1]])
    return np.repeat(np.fmin.reduceat(speed, starts), np.diff([*starts, len(names)]))


def _programmed_speeds(path: ToolPath, of_task: FloatArray, excluded: Mask, acceleration: float) -> FloatArray:
    """Programmed speed on each piece [m/s], shape (n,): by the path's times or speeds, else the task's.

    Where contact is excluded the mean that the times give is compared, and up to 1 % above the task's speed it is that
    speed: the last digit of a log is no faster program.
    """
    mean, fastest, stated = path.speeds, path.fastest_speeds(acceleration), path.stated_speeds
    if mean is None or fastest is None:
        if stated is None:
            return of_task
        by_task = np.isnan(stated) if path.by_one is None else np.isnan(stated) | path.by_one
        return np.where(by_task, np.fmax(stated, of_task), stated)
    within = (of_task < mean) & (mean <= of_task * (1 + _LAST_DIGIT))
    return np.where(excluded, np.where(within, of_task, mean), fastest)


def _without_direction(bases: Sequence[Basis]) -> tuple[Basis, ...]:
    """Bases without what they say of the direction of motion: along a path that is said for all pieces together."""
    said = (FindingKind.ALONG_ONLY, FindingKind.RAISED_OFF_AXIS)
    return tuple(replace(each, notes=tuple(note for note in each.notes if note.kind not in said)) for each in bases)


def _without_map(reason: Finding) -> PieceOutcome:
    """The outcome of a piece without a map: where all maps are straight down, that it is not downward."""
    downward = reason.kind is FindingKind.NOT_ALONG and reason.figure("directions") == ("down",)
    return PieceOutcome.NOT_DOWNWARD if downward else PieceOutcome.NO_MAP


def _notes(
    matched: MatchedMaps,
    path: ToolPath,
    task: Task,
    programmed: FloatArray,
    excluded: Mask,
    allowance: Allowance,
) -> tuple[Finding, ...]:
    """What the speeds along a path depend on besides their bases."""
    mass = matched.atlas.conditions.moving_mass
    threatened = matched.payloads[[bool(needs) for needs in matched.needs]].tolist()
    payloads = dict.fromkeys(threatened or [matched.atlas.conditions.payload])
    masses = [Finding.of(FindingKind.STANDARD_MASSES, moving_mass_kg=mass, payload_kg=load) for load in payloads]
    directions = ", ".join(dict.fromkeys(entry.conditions.direction for entry in matched.atlas.maps))
    along = matched.lengths_excluded_along(path)
    although = tuple(f"{name} ({1000 * length:.3g} mm)" for name, length in along.items())
    corners = min(along.values(), default=math.inf) < CORNER
    return (
        *task.findings,
        *matched.atlas.findings,
        *([Finding.of(FindingKind.SITES_NOT_HITTING, sites=sites)] if (sites := matched.not_hitting) else []),
        Finding.of(
            FindingKind.MOTION_WITHIN,
            direction=directions,
            straight_deg=ON_AXIS,
            straight_m=math.tan(math.radians(ON_AXIS)),  # beside 1 m
            widest_deg=WIDEST_ANGLE,
            raised=RAISED_OFF_AXIS - 1,
            angle_deg=matched.angle if matched.raised else None,
        ),
        allowance.of_position,
        Finding.of(FindingKind.ACCELERATION, acceleration_mps2=task.acceleration, corner_deg=CORNER_ANGLE),
        *([] if math.isnan(mass) else masses),
        _programmed(path, programmed, excluded, task.acceleration),
        *([Finding.of(FindingKind.AS_LOGGED)] if path.logged else []),
        *([Finding.of(FindingKind.EXCLUDED_BY_TASK, segments=although, corners=corners)] if excluded.any() else []),
        Finding.of(FindingKind.ONLY_AS_MEASURED),
    )


def _to_program(standard: FloatArray, allowance: Allowance) -> float:
    """The standard's one speed for all pieces, the overshoot subtracted [m/s]; NaN if there is none."""
    if not standard.size:
        return math.nan
    speed = float(allowance.off(standard.min()))
    return speed if speed > 0 else math.nan


@dataclass(eq=False)
class _Strictest:
    """The lowest speed of all body areas on each piece, filled area by area; infinite where there is none."""

    speed: FloatArray
    contact: FloatArray
    limit: FloatArray
    standard: FloatArray
    standard_newtons: FloatArray
    outcome: Objects
    reason: Objects
    governed_by: Objects
    map_name: Objects
    standard_case: Objects
    taken: list[tuple[Indices, str, Basis]]

    @property
    def bases(self) -> list[tuple[str, Basis]]:
        """What the speeds rest on, with the name of their map."""
        return [(map_name, basis) for _, map_name, basis in self.taken]

    def standard_limit(self, counted: Mask, names: Sequence[str]) -> Finding:
        """The limit that gives the lowest of the standard's speeds, on the first of the counted pieces that has it."""
        i = int(np.argmin(np.where(counted, self.standard, np.inf)))
        newtons, case = float(self.standard_newtons[i]), self.standard_case[i]
        return Finding.of(FindingKind.STANDARD_LIMIT, limit_N=newtons, case=case, segment=names[i])

    def take(self, pieces: Indices, speeds: ZoneSpeeds, case: str, map_name: str) -> None:
        """Keep the speeds to program on some pieces, of the `case` of a body area, where they are stricter."""
        self.taken.append((pieces, map_name, speeds.basis))
        value = np.where(np.isnan(speeds.speed_to_program), -np.inf, speeds.speed_to_program)
        stricter = np.flatnonzero(value < self.speed[pieces])
        changed = pieces[stricter]
        self.speed[changed], self.limit[changed] = value[stricter], speeds.limit[stricter]
        self.governed_by[changed], self.map_name[changed] = case, map_name
        self.contact[changed] = speeds.speed[stricter]
        self.outcome[changed] = [PieceOutcome(str(outcome)) for outcome in speeds.to_program_outcome[stricter]]
        self.reason[changed] = speeds.to_program_reason[stricter]

    def forbid(self, pieces: Mask, why: Finding, case: str) -> None:
        """No speed on some pieces, shape (n,), whatever the maps say: contact with a body area is not permitted."""
        self.speed[pieces], self.contact[pieces], self.limit[pieces] = -np.inf, np.nan, np.nan
        self.outcome[pieces], self.reason[pieces], self.governed_by[pieces] = PieceOutcome.NOT_PERMITTED, why, case

    def parts(self, sizes: Sequence[int]) -> list[_Strictest]:
        """The same for paths of so many pieces one after the other, each with what its own pieces rest on."""
        columns, ends = dict(vars(self)), np.cumsum(sizes).tolist()
        taken = columns.pop("taken")
        parts = []
        for start, end in itertools.pairwise([0, *ends]):
            own = [each for each in taken if np.any((each[0] >= start) & (each[0] < end))]
            parts.append(_Strictest(**{name: column[start:end] for name, column in columns.items()}, taken=own))
        return parts


def _strictest(
    matched: Sequence[MatchedMaps],
    paths: Sequence[ToolPath],
    task: Task,
    bound: Bound,
    allowance: Allowance,
    table: LimitTable,
    reach: float,
) -> _Strictest:
    """The lowest speed over the body areas and maps of each piece, and up to `reach` [m] beside it, of one path at
    several offsets.
    """
    segment_of = [task.segment(name) for path in paths for name in path.names]
    starts, ends = (np.concatenate([path.points[part] for path in paths]) for part in (slice(-1), slice(1, None)))
    off_angles, n = np.hstack([each.off_angles for each in matched]), len(segment_of)
    outcome, reason, governed_by, map_name, case = np.full((5, n), "", dtype=object)
    none, unlimited = np.full(n, np.nan), np.full(n, np.inf)
    figures = (unlimited, none, none.copy(), unlimited.copy(), none.copy())
    strictest = _Strictest(*figures, outcome, reason, governed_by, map_name, case, [])
    for area, contact in {(area, segment.contact): None for segment in task.segments for area in segment.areas}:
        assert contact is not None
        limit = force_limit(area, table=table)
        threatened = np.array([segment.contact is contact and area in segment.areas for segment in segment_of])
        standard = np.concatenate([_standard_speeds(each, limit, contact) for each in matched])[threatened]
        stricter = np.flatnonzero(threatened)[standard < strictest.standard[threatened]]
        strictest.standard[threatened] = np.minimum(strictest.standard[threatened], standard)
        strictest.standard_newtons[stricter] = limit.force(contact) if limit.permitted else np.nan
        strictest.standard_case[stricter] = f"{area}, {contact}"
        if why := limit.refusal:
            strictest.forbid(threatened, why, f"{area}, {contact}")
        for entry, off_angle in zip(matched[0].atlas.maps, off_angles, strict=True):
            assert entry.force_map is not None
            for side in (off_angle <= ON_AXIS, off_angle > ON_AXIS):
                pieces = np.flatnonzero(threatened & side)
                if pieces.size:
                    offset = matched[0].offsets[entry.loaded]
                    segments = Segments(starts[pieces] + offset, ends[pieces] + offset)
                    speeds = zone_speeds(
                        entry.force_map,
                        segments.zones.grown(reach) if reach > 0 else segments,
                        limit=limit,
                        bound=bound,
                        contact=contact,
                        angle=min(float(off_angle[pieces].max()), WIDEST_ANGLE),
                        allowance=allowance,
                    )
                    strictest.take(pieces, speeds, f"{area}, {contact}", entry.name)
    return strictest


def _programmed(path: ToolPath, programmed: FloatArray, excluded: Mask, acceleration: float) -> Finding:
    """Where the programmed speeds come from."""
    missing, stated = bool(np.isnan(programmed).any()), path.stated_speeds
    if np.isnan(programmed).all():
        return Finding.of(FindingKind.PROGRAMMED_NOT_STATED)
    if stated is not None:
        empty = path.by_one is not None or bool(np.isnan(stated).any())
        motion = {name: path.speeds_of == name for name in ("to_point", "from_point")} | {"either": not path.speeds_of}
        return Finding.of(FindingKind.PROGRAMMED_BY_POINTS, **motion, empty=empty, missing=missing)
    if path.speeds is None:
        return Finding.of(FindingKind.PROGRAMMED_BY_TASK, missing=missing)
    above_mean = max(0.0, float(np.max(programmed - path.speeds)))
    shown = path.shown_acceleration
    figures = {
        "above_mps": above_mean,
        "acceleration_mps2": max(acceleration, shown),
        "shown": shown > _MORE * acceleration,
    }
    digit = _LAST_DIGIT if excluded.any() else None
    return Finding.of(FindingKind.PROGRAMMED_BY_ROWS, **figures, last_digit=digit)


def _standard_speeds(matched: MatchedMaps, limit: ForceLimit, contact: Contact) -> FloatArray:
    """Speeds of the standard's contact model for a constrained body part [m/s], shape (n,); NaN if a figure is missing.

    A payload that is not stated counts as 0 kg.
    """
    mass, payloads = matched.atlas.conditions.moving_mass, np.nan_to_num(matched.payloads)
    if math.isnan(mass) or math.isnan(limit.stiffness) or not limit.permitted:
        return np.full(payloads.shape, np.nan)
    force, stiffness = limit.force(contact), limit.stiffness
    loads, which = np.unique(payloads, return_inverse=True)
    speeds = [
        pfl_speed_limit(force, robot_mass=pfl_robot_mass(mass, load), body_mass=math.inf, stiffness=stiffness)
        for load in loads.tolist()
    ]
    return np.array(speeds, dtype=np.float64)[which]


def _cycle_time(
    rule: str, path: ToolPath, refused: Mask, acceleration: float, speed: FloatArray, rule_speed: float = math.nan
) -> CycleTime:
    """Time of the permitted stretches; of the whole only if nothing is refused."""
    if refused.all() or np.isnan(speed[~refused]).any():
        return CycleTime(rule, math.nan, math.nan, rule_speed)
    stops = (path.turns > CORNER_ANGLE) | (_waits(path)[1:-1] > 0)
    total = _waited(path, refused)
    for start, stop in _stretches(refused):
        piece, between = slice(start, stop), slice(start, stop - 1)
        total += time_law(path.lengths[piece], speed[piece], acceleration=acceleration, stops=stops[between]).duration
    return CycleTime(rule, math.nan if refused.any() else total, total, rule_speed)


def _stretches(refused: Mask) -> Indices:
    """First piece of each permitted stretch, and the one after its last, shape (k, 2)."""
    return np.flatnonzero(np.diff(np.concatenate([[True], refused, [True]]).astype(np.int8))).reshape(-1, 2)


def _waits(path: ToolPath) -> FloatArray:
    """How long the program stands at each point [s], shape (n + 1,)."""
    return np.zeros(len(path) + 1) if path.wait is None else path.wait


def _waited(path: ToolPath, refused: Mask) -> float:
    """How long the program stands at points of permitted stretches, their ends included [s]."""
    return float(sum(_waits(path)[start : stop + 1].sum() for start, stop in _stretches(refused)))


def _as_programmed(
    rule: str, path: ToolPath, refused: Mask, acceleration: float, programmed: FloatArray, most: FloatArray
) -> CycleTime:
    """Cycle time of the program, nowhere faster than `most` [m/s]; of a timed path by its own times, waits included.

    A timed piece takes the time that its mean speed then takes, at least its own: how fast it is in between, and what
    braking before it costs, is not known.
    """
    if path.time is None or path.speeds is None:
        return _cycle_time(rule, path, refused, acceleration, np.minimum(programmed, most))
    if refused.all():
        return CycleTime(rule, math.nan, math.nan)
    lost = path.lengths / path.speeds * (np.maximum(1.0, np.minimum(programmed, path.speeds) / most) - 1)
    moving = np.diff(path.time) - _waits(path)[:-1]
    time = float((moving + lost)[~refused].sum()) + _waited(path, refused)
    return CycleTime(rule, math.nan if refused.any() else time, time)
