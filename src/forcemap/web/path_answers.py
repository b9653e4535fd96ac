"""A task in the plane of distance and height: a point, or a path with its allowed speeds and cycle times."""

from __future__ import annotations

import numpy as np
from pydantic import BaseModel

from forcemap import (
    Allowance,
    CycleTime,
    LimitTable,
    PathSpeeds,
    Task,
    TaskSegment,
    ToolPath,
    floor_speed,
    force_limit,
    path_speeds,
)
from forcemap.web.held import Fitted
from forcemap.web.numbers import number
from forcemap.web.question import PathQuestion
from forcemap.web.speed_answers import Basis, basis_of, place_speed


class TaskPoint(BaseModel):
    """A point of a task and the safe speed at it, without the allowances of a path."""

    distance_m: float
    height_m: float
    outcome: str
    reason: str
    speed_mps: float | None
    speed_shown: str


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
    """Allowed speeds along a path; the lowest is that of the pieces with permission."""

    length_m: float
    refused_length_m: float
    too_fast_length_m: float
    permitted: bool
    outcomes: list[str]
    reasons: list[str]
    lowest_speed_mps: float | None
    lowest_speed_shown: str
    pieces: list[Piece]
    cycle_times: list[Time]


class TaskAnswer(BaseModel):
    """A task: its points, and the path through them if they are two or more."""

    points: list[TaskPoint]
    path: Along | None
    basis: Basis


def task_answer(found: Fitted, question: PathQuestion, table: LimitTable | None) -> TaskAnswer:
    """A task of one point, or of a path through points."""
    limit = force_limit(question.area, table=table)
    points = []
    for distance, height in question.places:
        at = place_speed(found, question, distance, height, limit)
        names = set(TaskPoint.model_fields) - {"distance_m", "height_m"}
        points.append(TaskPoint(distance_m=distance, height_m=height, **{name: getattr(at, name) for name in names}))
    if len(points) == 1:
        return TaskAnswer(points=points, path=None, basis=at.basis)
    speeds = speeds_along(found, question, table)
    return TaskAnswer(points=points, path=_along(speeds), basis=basis_of(found, question, limit, speeds.statements))


def speeds_along(found: Fitted, question: PathQuestion, table: LimitTable | None) -> PathSpeeds:
    """The library's answer for a path that runs straight out from the base."""
    path = ToolPath.through([(d, 0.0, h) for d, h in question.places])
    segment = TaskSegment("path", (question.area,), question.contact, question.programmed)
    return path_speeds(
        found.force_map,
        path,
        Task((segment,), question.acceleration_mps2),
        bound=question.bound_of(found.force_map),
        allowance=Allowance(speed=question.overshoot_mps, position=question.position_tolerance_m),
        table=table,
    )


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
    reasons = dict.fromkeys(f"{piece.outcome.replace('_', ' ')}: {piece.reason}" for piece in without)
    lowest = speeds.constant.speed
    return Along(
        length_m=float(lengths.sum()),
        refused_length_m=float(lengths[refused].sum()),
        too_fast_length_m=float(lengths[speeds.too_fast & ~refused].sum()),
        permitted=not refused.any(),
        outcomes=list(dict.fromkeys(piece.outcome for piece in pieces)),
        reasons=list(reasons),
        lowest_speed_mps=number(lowest),
        lowest_speed_shown=floor_speed(lowest),
        pieces=pieces,
        cycle_times=[_time(each) for each in (speeds.allowed, speeds.standard, speeds.constant, speeds.program)],
    )


def _time(found: CycleTime) -> Time:
    return Time(
        rule=found.rule,
        cycle_time_s=number(found.duration),
        permitted_time_s=number(found.permitted_duration),
        speed_mps=number(found.speed),
        speed_shown=floor_speed(found.speed),
    )
