"""Safe speeds on a grid of places: what `speed-map` answers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Self

import numpy as np

from forcemap.answers.accuracy import AccuracyAnswer
from forcemap.answers.answer import Answer, AtPlace, Figure, PlaceAndSpeed, Said, if_any, of
from forcemap.answers.basis import RestsOn, rests_on
from forcemap.comparisons.beside_standard import beside_standard
from forcemap.findings import Finding
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.force_map import ForceMap
from forcemap.speeds.safe_speed import SpeedOutcome, floor_speed
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
    governed_by: str | None = if_any()


class PlaceToProgram(AtPlace):
    """A place and its speed to program."""

    speed_to_program_mps: float


class StandardAnswer(Answer):
    """The standard's one speed at contact, and at how many places of the grid the map permits more than that.

    Places without a speed to program are not among these. The predicted forces are the map's at that speed, null where
    none was measured so fast.
    """

    speed_mps: float = of("speed")
    places: int
    places_with_more: int = of("faster")
    highest_speed_of_map_mps: Figure = of("fastest")
    highest_to_program_of_map_mps: Figure = of("fastest_to_program")
    lowest_predicted_force_N: Figure = of("lowest_predicted")
    highest_predicted_force_N: Figure = of("highest_predicted")
    moving_mass_kg: float = of("moving_mass")
    payload_kg: Figure = of("payload")

    @property
    def lines(self) -> list[str]:
        """The standard's one speed and what the map predicts at it; where the map permits more, if it permits any."""
        low, high, fastest = (
            self.lowest_predicted_force_N,
            self.highest_predicted_force_N,
            self.highest_speed_of_map_mps,
        )
        forces = "no impact was measured at that speed"
        if low is not None and high is not None:
            forces = f"the map predicts {low:.0f} to {high:.0f} N at it"
        speed = f"{floor_speed(self.speed_mps)} m/s everywhere"
        payload = "not stated, so 0 kg" if self.payload_kg is None else f"{self.payload_kg:g} kg"
        masses = f"moving mass {self.moving_mass_kg:g} kg, payload {payload}, body part held in place"
        lines = [f"the standard's contact model: {speed} ({masses}), confirmed by no measurement; {forces}"]
        if fastest is None:
            return lines
        more = self.places_with_more
        program = "" if self.highest_to_program_of_map_mps is None else floor_speed(self.highest_to_program_of_map_mps)
        upto = f", up to {floor_speed(fastest)} m/s at contact ({program} to program)" if more else ""
        less = f"less or nothing at {self.places - more}"
        return [*lines, f"the map permits more at {more} of {self.places} places{upto}, {less}"]


class SpeedMapAnswer(RestsOn):
    """Safe speeds on a grid, place by place in order of distance; outcome and reason are those of the fastest place.

    `outcome`, `counts` and `fastest` refer to speeds at contact; `standard` is null where the standard has no speed.
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
    standard: StandardAnswer | None

    @classmethod
    def of_speeds(
        cls, force_map: ForceMap, speeds: SpeedMap, accuracy: Accuracy | None, notes: Iterable[Finding | str] = ()
    ) -> Self:
        """The answer for a speed map."""
        result = speeds.speeds
        distance, height = np.meshgrid(speeds.distance, speeds.height, indexing="ij")
        places = PlaceAnswer.of_columns(
            distance_m=distance,
            height_m=height,
            outcome=result.outcome,
            reason=result.reason,
            speed_mps=result.speed,
            extrapolated_speed_mps=result.extrapolated_speed,
            lowest_measured_speed_mps=result.lowest_measured_speed,
            highest_measured_speed_mps=result.highest_measured_speed,
            predicted_force_N=result.predicted_force,
            bound_force_N=result.bound_force,
            speed_to_program_mps=result.speed_to_program,
            to_program_outcome=result.to_program_outcome,
            to_program_reason=result.to_program_reason,
            governed_by=np.broadcast_to(np.asarray(result.governed_by, dtype=object), np.shape(result.speed)),
        )
        best = max(places, key=lambda place: (place.speed_mps or 0.0, place.outcome == SpeedOutcome.UNCONFIRMED))
        quick = max(
            places, key=lambda place: (place.speed_to_program_mps or 0.0, place.speed_mps or 0.0, place is best)
        )
        return cls.from_result(
            speeds,
            outcome=best.outcome,
            reason=best.reason,
            to_program_outcome=quick.to_program_outcome,
            to_program_reason=quick.to_program_reason,
            places=places,
            accuracy=accuracy,
            standard=beside_standard(force_map, speeds),
            **rests_on(force_map, result.basis, notes),
        )
