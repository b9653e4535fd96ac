"""Safe speeds at a place and over the measured range, with all that they rest on."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pydantic import BaseModel

from forcemap import (
    ContactNotPermitted,
    FixedMargin,
    SpeedOutcome,
    floor_speed,
    many_safe_speeds,
    map_sha256,
    safe_speed,
)
from forcemap.web.held import Fitted
from forcemap.web.limits import Limits
from forcemap.web.numbers import floored, number
from forcemap.web.question import Place, Question, Resolution

NOT_PERMITTED = "not_permitted"
_OUTCOMES = (*(outcome.value for outcome in SpeedOutcome), NOT_PERMITTED)


class Basis(BaseModel):
    """What a speed rests on."""

    area: str
    contact: str
    limit_N: float | None
    limit_source: str
    bound: dict[str, str | float]
    bound_words: str
    map_sha256: str
    limits_sha256: str
    simulated: bool
    warnings: list[str]
    assumptions: list[str]


class SpeedAnswer(BaseModel):
    """The safe speed at a place; null unless the outcome is capped or admissible."""

    distance_m: float
    height_m: float
    outcome: str
    reason: str
    speed_mps: float | None
    speed_shown: str
    extrapolated_speed_mps: float | None
    lowest_measured_speed_mps: float | None
    highest_measured_speed_mps: float | None
    predicted_force_N: float | None
    bound_force_N: float | None
    margin_10_speed_mps: float | None
    margin_10_outcome: str
    basis: Basis


class SpeedMapAnswer(BaseModel):
    """Safe speeds on a grid, rows along distance; an outcome is the number of its name in `outcomes`.

    Speeds lie up to 0.2 mm/s below those of a place asked for alone, never above.
    """

    distance_m: list[float]
    height_m: list[float]
    speed_mps: list[list[float | None]]
    outcomes: list[str]
    outcome: list[list[int]]
    counts: dict[str, int]
    reason: str
    basis: Basis


def speed_answer(found: Fitted, question: Place, limits: Limits) -> SpeedAnswer:
    """The safe speed at the place of a question."""
    return place_speed(found, question, question.distance_m, question.height_m, limits)


def place_speed(found: Fitted, question: Question, distance: float, height: float, limits: Limits) -> SpeedAnswer:
    """The safe speed at a place."""
    force_map, limit = found.force_map, limits.of(question.area)
    place: dict[str, Any] = {"distance_m": distance, "height_m": height}
    bound = question.bound_of(force_map)
    case: dict[str, Any] = {"limit": limit, "contact": question.contact}
    try:
        speed = safe_speed(force_map, distance, height, bound=bound, **case)
        beside = safe_speed(force_map, distance, height, bound=FixedMargin(0.10), **case)
    except ContactNotPermitted as error:
        nothing: dict[str, Any] = dict.fromkeys(("speed_mps", "extrapolated_speed_mps", "lowest_measured_speed_mps"))
        nothing |= dict.fromkeys(("highest_measured_speed_mps", "predicted_force_N", "bound_force_N"))
        return SpeedAnswer(
            **place,
            **nothing,
            outcome=NOT_PERMITTED,
            reason=error.message,
            speed_shown="-",
            margin_10_speed_mps=None,
            margin_10_outcome=NOT_PERMITTED,
            basis=basis_of(found, question, limits, ()),
        )
    return SpeedAnswer(
        **place,
        outcome=speed.outcome.value,
        reason=speed.reason,
        speed_mps=number(speed.speed),
        speed_shown=floor_speed(speed.speed),
        extrapolated_speed_mps=number(speed.extrapolated_speed),
        lowest_measured_speed_mps=number(speed.lowest_measured_speed),
        highest_measured_speed_mps=number(speed.highest_measured_speed),
        predicted_force_N=number(speed.predicted_force),
        bound_force_N=number(speed.bound_force),
        margin_10_speed_mps=number(beside.speed),
        margin_10_outcome=beside.outcome.value,
        basis=basis_of(found, question, limits, speed.statements, speed.warnings),
    )


def speed_map_answer(found: Fitted, question: Resolution, limits: Limits) -> SpeedMapAnswer:
    """Safe speeds on a grid over the box around the measured range."""
    force_map, limit = found.force_map, limits.of(question.area)
    d, h = grid(found, question.places)
    at_d, at_h = (np.ascontiguousarray(each) for each in np.meshgrid(d, h, indexing="ij"))
    case: dict[str, Any] = {"limit": limit, "bound": question.bound_of(force_map), "contact": question.contact}
    _, high = force_map.measured_range.speeds(at_d, at_h)
    try:
        speed = many_safe_speeds(force_map, at_d, at_h, **case)
        middle = safe_speed(force_map, float(d.mean()), float(h.mean()), **case)
        reason, statements, warnings = middle.refusal, middle.statements, middle.warnings
        outcome = np.full(speed.shape, _OUTCOMES.index(SpeedOutcome.ADMISSIBLE))
        outcome[speed >= high] = _OUTCOMES.index(SpeedOutcome.CAPPED)
        outcome[np.isnan(speed)] = _OUTCOMES.index(SpeedOutcome.UNCONFIRMED)
        if not reason and middle.outcome is SpeedOutcome.UNCONFIRMED:
            reason = middle.reason
    except ContactNotPermitted as error:
        speed = np.full(at_d.shape, math.nan)
        reason, statements, warnings = error.message, (), ()
        outcome = np.full(speed.shape, _OUTCOMES.index(NOT_PERMITTED))
    outcome[np.isnan(high)] = _OUTCOMES.index(SpeedOutcome.OUTSIDE)
    return SpeedMapAnswer(
        distance_m=d.tolist(),
        height_m=h.tolist(),
        speed_mps=floored(speed, 6),
        outcomes=list(_OUTCOMES),
        outcome=outcome.tolist(),
        counts={name: int(np.sum(outcome == i)) for i, name in enumerate(_OUTCOMES)},
        reason=reason,
        basis=basis_of(found, question, limits, statements, warnings),
    )


def grid(found: Fitted, places: int) -> tuple[Any, Any]:
    """Axes of a grid of about so many places over the box around the measured range [m]."""
    box = found.force_map.measured_range
    size = max(2, round(math.sqrt(places)))

    def axis(low: float, high: float) -> Any:
        return np.round(np.linspace(low, high, size if high > low else 1), 6).clip(low, high)

    return axis(box.lowest[0], box.highest[0]), axis(box.lowest[1], box.highest[1])


def basis_of(
    found: Fitted, question: Question, limits: Limits, statements: tuple[str, ...], warnings: tuple[str, ...] = ()
) -> Basis:
    """What an answer rests on; without statements of a speed, what the map assumes. Warnings are said first."""
    bound, limit = question.bound_of(found.force_map), limits.of(question.area)
    return Basis(
        area=limit.name,
        contact=question.contact.value,
        limit_N=limit.force(question.contact) if limit.permitted else None,
        limit_source=str(limit),
        bound=bound.describe(),
        bound_words=str(bound),
        map_sha256=map_sha256(found.force_map),
        limits_sha256=limit.sha256,
        simulated=found.force_map.simulated,
        warnings=list(warnings),
        assumptions=[*limits.statements, *(statements or found.force_map.conditions.assumptions())],
    )
