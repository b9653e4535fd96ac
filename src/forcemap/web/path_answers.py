"""A task in the plane of distance and height: a point, or a path with its allowed speeds and cycle times."""

from __future__ import annotations

import math

import numpy as np
from pydantic import BaseModel

from forcemap import (
    Allowance,
    ContactNotPermitted,
    CycleTime,
    InputError,
    PathSpeeds,
    SpeedOutcome,
    Task,
    TaskSegment,
    ToolPath,
    Zones,
    floor_speed,
    path_speeds,
    zone_speeds,
)
from forcemap.web.held import Fitted
from forcemap.web.limits import Limits
from forcemap.web.numbers import number
from forcemap.web.question import PathQuestion
from forcemap.web.speed_answers import NOT_PERMITTED, Basis, basis_of, place_speed

LONGEST_PATH = 20.0
"""The longest path that is taken [m]."""


class TaskPoint(BaseModel):
    """A point of a task and the safe speed at it, without the allowances of a task."""

    distance_m: float
    height_m: float
    outcome: str
    reason: str
    speed_mps: float | None
    speed_shown: str


class Stop(BaseModel):
    """A task of one point: the speed to program there, overshoot subtracted, anywhere within the position tolerance."""

    outcome: str
    reason: str
    speed_mps: float | None
    speed_shown: str
    programmed_speed_mps: float | None
    too_fast: bool


class Piece(BaseModel):
    """A short piece of a path; speed null where none is permitted."""

    from_distance_m: float
    from_height_m: float
    to_distance_m: float
    to_height_m: float
    length_m: float
    speed_mps: float | None
    speed_shown: str
    programmed_speed_mps: float | None
    too_fast: bool
    outcome: str
    reason: str
    governed_by: str


class Time(BaseModel):
    """A cycle time at one rule of speed; null if a piece has no permission, or the rule no speed."""

    rule: str
    cycle_time_s: float | None
    permitted_time_s: float | None
    speed_mps: float | None
    speed_shown: str


class Along(BaseModel):
    """Allowed speeds along a path; the lowest is that of the pieces with permission, remarks are its reasons."""

    length_m: float
    refused_length_m: float
    too_fast_length_m: float
    permitted: bool
    outcomes: list[str]
    reasons: list[str]
    remarks: list[str]
    lowest_speed_mps: float | None
    lowest_speed_shown: str
    pieces: list[Piece]
    cycle_times: list[Time]


class TaskAnswer(BaseModel):
    """A task: its points, and what one of them, or the path through two or more, allows."""

    points: list[TaskPoint]
    point: Stop | None
    path: Along | None
    basis: Basis


def task_answer(found: Fitted, question: PathQuestion, limits: Limits) -> TaskAnswer:
    """A task of one point, or of a path through points."""
    if len(question.places) > 1:
        speeds = speeds_along(found, question, limits)
        along, stop, statements, warnings = _along(speeds), None, speeds.statements, speeds.warnings
    else:
        along, (stop, statements, warnings) = None, _stop(found, question, limits)
    points = []
    for distance, height in question.places:
        at = place_speed(found, question, distance, height, limits)
        names = set(TaskPoint.model_fields) - {"distance_m", "height_m"}
        points.append(TaskPoint(distance_m=distance, height_m=height, **{name: getattr(at, name) for name in names}))
    return TaskAnswer(
        points=points, point=stop, path=along, basis=basis_of(found, question, limits, statements, warnings)
    )


def speeds_along(found: Fitted, question: PathQuestion, limits: Limits) -> PathSpeeds:
    """The library's answer for a path that runs straight out from the base.

    Raises
    ------
    InputError
        The path is longer than any task needs, or has no length.
    """
    path = ToolPath.through([(d, 0.0, h) for d, h in question.places])
    length = float(path.lengths.sum())
    if length > LONGEST_PATH:
        raise InputError(f"points: found a path of {length:.1f} m, expected at most {LONGEST_PATH:g} m; ask in parts")
    segment = TaskSegment("path", (question.area,), question.contact, question.programmed)
    return path_speeds(
        found.force_map,
        path,
        Task((segment,), question.acceleration_mps2),
        bound=question.bound_of(found.force_map),
        allowance=_allowance(question),
        table=limits.table,
    )


def _stop(found: Fitted, question: PathQuestion, limits: Limits) -> tuple[Stop, tuple[str, ...], tuple[str, ...]]:
    """What holds at the one point and as far around it as the robot may be; what it rests on, what is said first."""
    allowance, programmed = _allowance(question), number(question.programmed)
    distance, height = np.array(question.places).T
    statements: tuple[str, ...] = tuple(found.force_map.conditions.assumptions())
    warnings: tuple[str, ...] = ()
    try:
        zone = zone_speeds(
            found.force_map,
            Zones(distance, distance, height, height).grown(allowance.position),
            limit=limits.of(question.area),
            bound=question.bound_of(found.force_map),
            contact=question.contact,
        )
    except ContactNotPermitted as error:
        speed, outcome, reason = math.nan, NOT_PERMITTED, error.message
    else:
        speed = float(zone.speed[0]) - allowance.speed
        outcome, reason = str(zone.outcome[0]), str(zone.reason[0])
        statements, warnings = zone.statements, zone.warnings
        if speed <= 0:
            speed, outcome = math.nan, SpeedOutcome.UNCONFIRMED.value
            reason = "nothing is left once the speed overshoot is subtracted"
    stop = Stop(
        outcome=outcome,
        reason=reason,
        speed_mps=number(speed),
        speed_shown=floor_speed(speed),
        programmed_speed_mps=programmed,
        too_fast=programmed is not None and not programmed <= speed,
    )
    compared = "not stated, so none is compared with the allowed one" if programmed is None else f"{programmed:g} m/s"
    return stop, (*statements, str(allowance), f"programmed speed: {compared}"), warnings


def _allowance(question: PathQuestion) -> Allowance:
    return Allowance(speed=question.overshoot_mps, position=question.position_tolerance_m)


def _along(speeds: PathSpeeds) -> Along:
    refused, lengths = speeds.refused, speeds.path.lengths
    distances, heights = speeds.path.pieces.places(np.array([[0.0, 1.0]] * len(speeds.path)))
    pieces = [
        Piece(
            from_distance_m=float(distances[i, 0]),
            from_height_m=float(heights[i, 0]),
            to_distance_m=float(distances[i, 1]),
            to_height_m=float(heights[i, 1]),
            length_m=float(lengths[i]),
            speed_mps=number(speeds.speed[i]),
            speed_shown=floor_speed(float(speeds.speed[i])),
            programmed_speed_mps=number(speeds.programmed[i]),
            too_fast=bool(speeds.too_fast[i]),
            outcome=str(speeds.outcome[i]),
            reason=str(speeds.reason[i]),
            governed_by=str(speeds.governed_by[i]),
        )
        for i in range(len(speeds.path))
    ]
    without = [piece for piece, no in zip(pieces, refused, strict=True) if no]
    permitted = [piece for piece, no in zip(pieces, refused, strict=True) if not no]
    lowest = speeds.constant.speed
    return Along(
        length_m=float(lengths.sum()),
        refused_length_m=float(lengths[refused].sum()),
        too_fast_length_m=float(lengths[speeds.too_fast & ~refused].sum()),
        permitted=not refused.any(),
        outcomes=list(dict.fromkeys(piece.outcome for piece in pieces)),
        reasons=_reasons(without),
        remarks=_reasons(permitted),
        lowest_speed_mps=number(lowest),
        lowest_speed_shown=floor_speed(lowest),
        pieces=pieces,
        cycle_times=[_time(each) for each in (speeds.allowed, speeds.standard, speeds.constant, speeds.program)],
    )


def _reasons(pieces: list[Piece]) -> list[str]:
    return list(dict.fromkeys(f"{p.outcome.replace('_', ' ')}: {p.reason}" for p in pieces if p.reason))


def _time(found: CycleTime) -> Time:
    return Time(
        rule=found.rule,
        cycle_time_s=number(found.duration),
        permitted_time_s=number(found.permitted_duration),
        speed_mps=number(found.speed),
        speed_shown=floor_speed(found.speed),
    )
