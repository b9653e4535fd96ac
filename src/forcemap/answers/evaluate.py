"""How far a map's predictions are from the forces of a table: what `evaluate` answers."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from forcemap.answers.accuracy import AccuracyAnswer, PlaceFigures
from forcemap.answers.answer import AllSaid
from forcemap.answers.form_test import DriftAnswer, FormTestAnswer
from forcemap.answers.map import names_above_bound
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.force_map import ForceMap
from forcemap.speeds.basis import doubts_of_fit


class EvaluateAnswer(PlaceFigures):
    """How far a map's predictions are from the forces of a table.

    For a fitted map also whether its form fits and whether forces have drifted, and which of the states that it was not
    fitted to lie above its tolerance bound; else null. Outside its measured range, where some of them may lie, that
    promises nothing.
    """

    map: str
    form: str
    simulated: bool
    states_found: str
    accuracies: list[AccuracyAnswer]
    fitted_states: int
    new_states: int
    new_states_outside: int
    new_states_censored: int
    new_states_above_bound: list[str] | None
    form_test: FormTestAnswer | None
    drift: DriftAnswer | None
    doubts: AllSaid

    @classmethod
    def of_map(
        cls,
        force_map: ForceMap,
        dataset: ImpactDataset,
        accuracies: tuple[Accuracy, ...],
        new: ImpactDataset | None = None,
    ) -> Self:
        """The answer for a map and impacts; the accuracy to trust first comes first.

        `new` are the impacts that the map was not fitted to; those of role test, but for repeats, if not given.
        """
        new = dataset.independent_test if new is None else new
        named: dict[str, Any] = {"map": force_map.source, "form": force_map.form.name, "simulated": dataset.simulated}
        named["states_found"] = dataset.states_found
        named["new_states"] = len(new.states) if len(new) else 0
        named["fitted_states"] = len(dataset.states) - named["new_states"] if force_map.fit else 0
        reach = dataset.tolerance.scale
        outside = ~force_map.measured_range.near(new.states.coordinates, reach) if len(new) else np.zeros(0)
        named["new_states_outside"] = int(outside.sum())
        named["new_states_censored"] = int(np.sum(new.states.impacts == 0)) if len(new) else 0
        named["new_states_above_bound"] = names_above_bound(force_map, new.states) if len(new) else None
        drift = force_map.fit.drift if force_map.fit else None
        doubts = doubts_of_fit(force_map)
        return cls.from_result(force_map, **named, accuracies=accuracies, drift=drift, doubts=doubts)
