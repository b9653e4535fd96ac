"""How far a map's predictions are from the forces of a table: what `evaluate` answers."""

from __future__ import annotations

from typing import Self

from forcemap.answers.accuracy import AccuracyAnswer, PlaceFigures
from forcemap.answers.answer import AllSaid
from forcemap.answers.form_test import DriftAnswer, FormTestAnswer
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.force_map import ForceMap
from forcemap.speeds.basis import doubts_of_fit


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
    doubts: AllSaid

    @classmethod
    def of_map(cls, force_map: ForceMap, dataset: ImpactDataset, accuracies: tuple[Accuracy, ...]) -> Self:
        """The answer for a map and impacts; the accuracy to trust first comes first."""
        named = {"map": force_map.source, "form": force_map.form.name, "simulated": dataset.simulated}
        drift = force_map.fit.drift if force_map.fit else None
        doubts = doubts_of_fit(force_map)
        return cls.from_result(force_map, **named, accuracies=accuracies, drift=drift, doubts=doubts)
