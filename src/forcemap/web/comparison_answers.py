"""The measured map beside the 2D map and the standard's contact model."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Any

from pydantic import BaseModel, Field

from forcemap import InputError, body_region, compare_force_models, pfl_robot_mass
from forcemap.web.held import Fitted
from forcemap.web.limits import Limits
from forcemap.web.map_answers import AccuracyAnswer, accuracy_answer
from forcemap.web.numbers import number
from forcemap.web.question import Area


class Body(StrEnum):
    """Whether the body part can move away."""

    CONSTRAINED = "constrained"
    FREE = "free"


class ComparisonQuestion(Area):
    """What the standard's contact model needs; masses as campaign.toml states them if not given."""

    body: Body = Field(Body.CONSTRAINED, description="Whether the body part can move away.")
    moving_mass_kg: float | None = Field(None, gt=0, le=10_000, allow_inf_nan=False, description="Of the robot.")
    payload_kg: float | None = Field(None, ge=0, le=10_000, allow_inf_nan=False, description="Effective payload.")


class Extreme(BaseModel):
    """The state a model misses most on one side."""

    state_id: str
    distance_m: float
    height_m: float
    speed_mps: float
    measured_N: float
    predicted_N: float
    error_percent: float


class Model(BaseModel):
    """A force model against the measured states."""

    model: str
    accuracy: AccuracyAnswer
    underestimated_share: float
    most_underestimated: Extreme | None
    most_overestimated: Extreme | None
    note: str


class Allowed(BaseModel):
    """Speeds that a model allows at the measured places; null where it confirms none."""

    model: str
    limit_N: float
    limit_source: str
    places: int
    confirmed_places: int
    lowest_speed_mps: float | None
    median_speed_mps: float | None
    highest_speed_mps: float | None
    note: str


class ComparisonAnswer(BaseModel):
    """Force models on the same states."""

    on: str
    area: str
    permitted: bool
    simulated: bool
    models: list[Model]
    allowed: list[Allowed]
    lowest_force_N: float
    highest_force_N: float
    variation_speed_mps: float
    bound_words: str
    assumptions: list[str]


def comparison_answer(found: Fitted, question: ComparisonQuestion, limits: Limits) -> ComparisonAnswer:
    """The comparison for a body area or region.

    Raises
    ------
    InputError
        The moving mass is neither given nor stated by the campaign.
    """
    limit = limits.of(question.area)
    comparison = compare_force_models(
        found.dataset, **contact_model(found, question), limit=limit if limit.permitted else None
    )
    variation = comparison.variation
    return ComparisonAnswer(
        on=comparison.on,
        area=limit.name,
        permitted=limit.permitted,
        simulated=found.dataset.simulated,
        models=[
            Model(
                model=each.model,
                accuracy=accuracy_answer(each.accuracy),
                underestimated_share=each.underestimated_share,
                most_underestimated=_extreme(each.most_underestimated),
                most_overestimated=_extreme(each.most_overestimated),
                note=each.note,
            )
            for each in comparison.models
        ],
        allowed=[
            Allowed(
                model=each.model,
                limit_N=each.limit,
                limit_source=each.limit_source,
                places=each.places,
                confirmed_places=each.confirmed,
                lowest_speed_mps=number(each.lowest),
                median_speed_mps=number(each.median),
                highest_speed_mps=number(each.highest),
                note=each.note,
            )
            for each in comparison.allowed
        ],
        lowest_force_N=variation.lowest,
        highest_force_N=variation.highest,
        variation_speed_mps=variation.speed,
        bound_words=str(comparison.bound),
        assumptions=[*limits.statements, *comparison.statements],
    )


def contact_model(found: Fitted, question: ComparisonQuestion) -> dict[str, Any]:
    """Masses and spring constant of the standard's contact model."""
    conditions = found.dataset.conditions
    mass = conditions.moving_mass if question.moving_mass_kg is None else question.moving_mass_kg
    if math.isnan(mass):
        raise InputError("moving mass: campaign.toml does not state it; give moving_mass_kg")
    load = conditions.payload if question.payload_kg is None else question.payload_kg
    region = body_region(question.area)
    return {
        "robot_mass": pfl_robot_mass(mass, 0.0 if math.isnan(load) else load),
        "body_mass": math.inf if question.body is Body.CONSTRAINED else region.mass,
        "stiffness": region.stiffness,
    }


def _extreme(found: Any) -> Extreme | None:
    if found is None:
        return None
    return Extreme(
        state_id=found.state,
        distance_m=found.distance,
        height_m=found.height,
        speed_mps=found.speed,
        measured_N=found.measured,
        predicted_N=found.predicted,
        error_percent=found.percent,
    )
