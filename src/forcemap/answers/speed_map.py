"""Safe speeds on a grid of places: what `speed-map` answers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Self

import numpy as np

from forcemap.answers.accuracy import AccuracyAnswer
from forcemap.answers.answer import AtPlace, Figure, PlaceAndSpeed, Said
from forcemap.answers.basis import RestsOn, rests_on
from forcemap.findings import Finding
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.force_map import ForceMap
from forcemap.speeds.safe_speed import SpeedOutcome
from forcemap.speeds.speed_map import SpeedMap


class PlaceAnswer(AtPlace):
    """The safe speed at a place of the grid; null unless the outcome is capped or admissible."""

    outcome: str
    reason: Said
    speed_mps: Figure
    extrapolated_speed_mps: Figure
    lowest_measured_speed_mps: Figure
    highest_measured_speed_mps: Figure
    predicted_force_N: Figure
    bound_force_N: Figure


class SpeedMapAnswer(RestsOn):
    """Safe speeds on a grid, distance slowest; outcome and reason are of the fastest place, if any is confirmed."""

    outcome: str
    reason: Said
    counts: dict[str, int]
    fastest: PlaceAndSpeed | None
    places: list[PlaceAnswer]
    accuracy: AccuracyAnswer | None

    @classmethod
    def of_speeds(
        cls, force_map: ForceMap, speeds: SpeedMap, accuracy: Accuracy | None, notes: Iterable[Finding | str] = ()
    ) -> Self:
        """The answer for a speed map."""
        found = speeds.speeds
        figures = (found.outcome, found.reason, found.speed, found.extrapolated_speed)
        measured = (found.lowest_measured_speed, found.highest_measured_speed, found.predicted_force, found.bound_force)
        at = np.meshgrid(speeds.distance, speeds.height, indexing="ij")
        places = PlaceAnswer.of_columns(*at, *figures, *measured)
        best = max(places, key=lambda each: (each.speed_mps or 0.0, each.outcome == SpeedOutcome.UNCONFIRMED))
        return cls.from_result(
            speeds,
            outcome=best.outcome,
            reason=best.reason,
            places=places,
            accuracy=accuracy,
            **rests_on(force_map, found.basis, notes),
        )
