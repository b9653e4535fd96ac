"""How far predictions are from measured forces: what `evaluate` answers."""

from __future__ import annotations

from typing import Self

from forcemap.answers.answer import Answer, Percent, of, of_if_any
from forcemap.answers.form_test import DriftAnswer, FormTestAnswer
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.force_map import ForceMap


class AccuracyAnswer(Answer):
    """Errors over states, percent of the measured force; underestimation is the dangerous side."""

    on: str
    states: int
    underestimated: int
    max_underestimation_percent: float
    max_underestimation_N: float = of("max_underestimation")
    mean_underestimation_percent: float
    mean_underestimation_N: float = of("mean_underestimation")
    overestimated: int
    max_overestimation_percent: float
    max_overestimation_N: float = of("max_overestimation")
    mean_overestimation_percent: float
    mean_overestimation_N: float = of("mean_overestimation")
    rmse_N: float = of("rmse")
    worst_state: str
    censored_states: int
    censored_underestimated: int
    skipped_states: int


class PlaceFigures(Answer):
    """Scatter that states of a place share, and that of single states, as the bound uses them; null if not fitted."""

    places: int | None = of_if_any("fit", "place_effect", "places")
    place_correlation: float | None = of_if_any("fit", "place_effect", "correlation")
    likely_place_correlation: float | None = of_if_any("fit", "place_effect", "likely")
    place_sd_percent: Percent = of_if_any("fit", "place_sd")
    own_sd_percent: Percent = of_if_any("fit", "own_sd")


class EvaluateAnswer(PlaceFigures):
    """How far a map's predictions are from the forces of a table.

    For a fitted map also whether its form fits and whether forces have drifted; else null.
    """

    map: str
    form: str
    simulated: bool
    accuracies: list[AccuracyAnswer]
    form_test: FormTestAnswer | None
    drift: DriftAnswer | None

    @classmethod
    def of_map(cls, force_map: ForceMap, dataset: ImpactDataset, accuracies: tuple[Accuracy, ...]) -> Self:
        """The answer for a map and impacts; the accuracy to trust first comes first."""
        named = {"map": force_map.source, "form": force_map.form.name, "simulated": dataset.simulated}
        drift = force_map.fit.drift if force_map.fit else None
        return cls.from_result(force_map, **named, accuracies=accuracies, drift=drift)
