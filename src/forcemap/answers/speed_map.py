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
    """The safe speed at a place of the grid, at contact and to program; null unless its outcome has a speed."""

    outcome: str
    reason: Said
    speed_mps: Figure
    extrapolated_speed_mps: Figure
    lowest_measured_speed_mps: Figure
    highest_measured_speed_mps: Figure
    predicted_force_N: Figure
    bound_force_N: Figure
    speed_to_program_mps: Figure
    to_program_outcome: str
    to_program_reason: Said


class PlaceToProgram(AtPlace):
    """A place and its speed to program."""

    speed_to_program_mps: float


class SpeedMapAnswer(RestsOn):
    """Safe speeds on a grid, distance slowest; outcome and reason are of the fastest place, if any is confirmed.

    `outcome`, `counts` and `fastest` are of speeds at contact.
    """

    outcome: str
    reason: Said
    counts: dict[str, int]
    fastest: PlaceAndSpeed | None
    fastest_to_program: PlaceToProgram | None
    to_program_outcome: str
    to_program_reason: Said
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
        program = (found.speed_to_program, found.to_program_outcome, found.to_program_reason)
        places = PlaceAnswer.of_columns(*at, *figures, *measured, *program)
        best = max(places, key=lambda each: (each.speed_mps or 0.0, each.outcome == SpeedOutcome.UNCONFIRMED))
        quick = max(places, key=lambda each: (each.speed_to_program_mps or 0.0, each.speed_mps or 0.0, each is best))
        return cls.from_result(
            speeds,
            outcome=best.outcome,
            reason=best.reason,
            to_program_outcome=quick.to_program_outcome,
            to_program_reason=quick.to_program_reason,
            places=places,
            accuracy=accuracy,
            **rests_on(force_map, found.basis, notes),
        )
