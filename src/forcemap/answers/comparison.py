"""Force models on the same states: what `compare` answers."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import Self

from forcemap.answers.accuracy import AccuracyAnswer
from forcemap.answers.answer import AllSaid, Answer, Bound, Figure, Said, of
from forcemap.comparisons.force_models import Comparison
from forcemap.findings import Finding
from forcemap.limits.force_limits import ForceLimit


class StateError(Answer):
    """The state with a model's largest error on one side; a negative error is underestimation."""

    state: str
    distance_m: float = of("distance")
    height_m: float = of("height")
    speed_mps: float = of("speed")
    measured_N: float = of("measured")
    predicted_N: float = of("predicted")
    error_percent: float = of("percent")


class ModelAnswer(Answer):
    """A force model against the measured states."""

    model: str
    accuracy: AccuracyAnswer
    accuracy_all: AccuracyAnswer = of("on_all")
    underestimated_share: float
    overestimated_share: float
    most_underestimated: StateError | None
    most_overestimated: StateError | None
    note: Said


class Body(StrEnum):
    """Whether the body part can move away."""

    CONSTRAINED = "constrained"
    FREE = "free"


class AllowedSpeed(Answer):
    """Speeds that a model allows at the measured places; null where it confirms none.

    A map's also at how many places it permits more than the standard's contact model, and a speed but no more; at
    `places_capped` of these nothing faster was measured.
    """

    model: str
    limit_N: float = of("limit")
    limit_source: str
    places: int
    confirmed_places: int = of("confirmed")
    lowest_speed_mps: Figure = of("lowest")
    median_speed_mps: Figure = of("median")
    highest_speed_mps: Figure = of("highest")
    places_with_more: int | None = of("more")
    places_with_less: int | None = of("less")
    places_capped: int | None = of("capped")
    contact: str
    note: Said


class Variation(Answer):
    """How measured forces vary over the workspace at one speed."""

    speed_mps: float = of("speed")
    states: int
    lowest_force_N: float = of("lowest")
    highest_force_N: float = of("highest")
    ratio: float
    rank_correlation_distance: Figure
    rank_correlation_height: Figure


class ComparisonAnswer(Answer):
    """The measured map, the 2D map and the standard's contact model; no speeds where contact is not permitted."""

    on: str
    area: str
    permitted: bool
    simulated: bool
    models: list[ModelAnswer]
    allowed: list[AllowedSpeed]
    variation: Variation
    bound: Bound
    warnings: AllSaid
    assumptions: AllSaid = of("statements")

    @classmethod
    def of_comparison(
        cls, comparison: Comparison, limit: ForceLimit, *, simulated: bool, notes: Iterable[Finding | str] = ()
    ) -> Self:
        """The answer for the limits of a body area or region; `notes` are further remarks on the limits."""
        of_limit = {"area": limit.name, "permitted": limit.permitted, "simulated": simulated}
        return cls.from_result(comparison, **of_limit, statements=[*notes, *comparison.statements])
