"""The safe speed at a place: what `speed` answers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Self

import numpy as np

from forcemap.answers.accuracy import AccuracyAnswer
from forcemap.answers.answer import Answer, Figure, PlaceAndSpeed, Said, if_any, of
from forcemap.answers.basis import RestsOn, rests_on
from forcemap.campaigns.dataset import SPEED_NOT_STATED
from forcemap.campaigns.state import PLACE_SIZE
from forcemap.direction import WIDEST_ANGLE
from forcemap.findings import Finding
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.bounds import FixedMargin
from forcemap.maps.force_map import ForceMap
from forcemap.speeds.safe_speed import SafeSpeed, SpeedOutcome, safe_speed
from forcemap.words import sentences

SLOWEST_HINT = 0.02
"""Slowest speed to propose for a measurement [m/s]; a choice: no robot is measured slower."""

_MARGIN_10 = FixedMargin(0.10)  # the 10 % in the keys' names


class QuantityAnswer(Answer):
    """The speed at contact that one of several quantities allows by itself, which permits nothing alone.

    Limit, prediction and bound at that speed are in the quantity's unit, the limit as the table of limits has it.
    """

    quantity: str
    unit: str
    limit: Figure
    outcome: str
    speed_mps: Figure
    predicted: Figure
    bound: Figure


class ForcesAtLowest(Answer):
    """What the map says at the lowest speed measured at a place that has no speed; it permits nothing."""

    speed_mps: float
    predicted_force_N: float
    bound_force_N: float


class NearestState(PlaceAndSpeed):
    """A state measured at the place nearest to the one asked for, and the largest of its forces.

    The force is at least the figure where an impact of the state was above the device range. A state that was measured
    again is listed twice.
    """

    state_id: str
    force_N: float
    at_least: bool


class SpeedAnswer(RestsOn):
    """The safe speed at a place: at contact, and to program; null unless its outcome is capped or admissible.

    Where several quantities count, `governed_by` is the one that gives the speed, or because of which there is none.

    `measure_next` is where a measurement could turn "unconfirmed" into an answer: a hint, no permission. `at_lowest` is
    null unless the outcome is unconfirmed; `nearest` is empty for a map without states, as a published one.
    `off_direction_to_program_mps` is the speed to program for motion up to 5 degrees off the map's direction, and
    `off_direction_warnings` are those of the warnings that are about it alone.
    """

    outcome: str
    reason: Said
    distance_m: float
    height_m: float
    speed_mps: Figure = of("speed")
    to_program_outcome: str
    to_program_reason: Said
    speed_to_program_mps: Figure = of("speed_to_program")
    extrapolated_speed_mps: Figure = of("extrapolated_speed")
    bound_force_N: Figure = of("bound_force")
    predicted_force_N: Figure = of("predicted_force")
    off_direction_to_program_mps: Figure
    off_direction_warnings: list[str]
    margin_10_speed_mps: Figure
    margin_10_outcome: str
    lowest_measured_speed_mps: Figure = of("lowest_measured_speed")
    highest_measured_speed_mps: Figure = of("highest_measured_speed")
    measured_distance_m: list[float]
    measured_height_m: list[float]
    measure_next: PlaceAndSpeed | None
    at_lowest: ForcesAtLowest | None
    nearest: list[NearestState]
    accuracy: AccuracyAnswer | None
    governed_by: str | None = if_any()
    quantities: list[QuantityAnswer] | None = if_any()

    @classmethod
    def of_place(
        cls,
        force_map: ForceMap,
        place: tuple[float, float],
        accuracy: Accuracy | None,
        notes: Iterable[Finding | str] = (),
        **case: Any,
    ) -> Self:
        """The answer for a place, distance and height [m]; `case` are the other arguments of `safe_speed`."""
        speed = safe_speed(force_map, *place, **case)
        off_direction = safe_speed(force_map, *place, **case | {"angle": WIDEST_ANGLE})
        with_margin = safe_speed(force_map, *place, **case | {"bound": _MARGIN_10})
        coordinates = {"distance_m": place[0], "height_m": place[1]}
        low, high = force_map.measured_range.lowest.tolist(), force_map.measured_range.highest.tolist()
        has_off = not math.isnan(off_direction.speed_to_program)
        off_doubts = off_direction.basis.warnings_beyond(speed.basis) if has_off else ()
        basis = replace(speed.basis, warnings=(*speed.basis.warnings, *off_doubts))
        hint = speed.outcome is SpeedOutcome.UNCONFIRMED and speed.extrapolated_speed > SLOWEST_HINT
        return cls.from_result(
            speed,
            **coordinates,
            off_direction_to_program_mps=off_direction.speed_to_program,
            off_direction_warnings=sentences(off_doubts),
            margin_10_speed_mps=with_margin.speed,
            margin_10_outcome=with_margin.outcome,
            measure_next=coordinates | {"speed_mps": speed.extrapolated_speed} if hint else None,
            measured_distance_m=[low[0], high[0]],
            measured_height_m=[low[1], high[1]],
            at_lowest=_at_lowest(force_map, place, speed),
            nearest=_nearest(force_map, place),
            accuracy=accuracy,
            governed_by=speed.governed_by,
            quantities=_of_quantities(speed),
            **rests_on(force_map, basis, notes),
        )


def _at_lowest(force_map: ForceMap, place: tuple[float, float], speed: SafeSpeed) -> ForcesAtLowest | None:
    """Prediction and bound at the lowest speed measured at a place that is unconfirmed; None elsewhere."""
    if speed.to_program_outcome != SpeedOutcome.UNCONFIRMED or speed.basis.bound is None:
        return None
    low = float(speed.lowest_measured_speed)
    if math.isnan(low):
        return None
    predicted = force_map.predict(*place, low)
    upper = speed.basis.raised * speed.basis.bound.upper(force_map, *place, low)
    return ForcesAtLowest(speed_mps=low, predicted_force_N=float(predicted), bound_force_N=float(upper))


def _nearest(force_map: ForceMap, place: tuple[float, float]) -> list[NearestState]:
    """The measured states of the place nearest to another, slow to fast; none of a zone, or of a speed not stated."""
    found: list[NearestState] = []
    for states in force_map.fit.measured if force_map.fit else ():
        known = np.array([states.name.count(name) == 1 for name in states.name], dtype=np.bool_)
        placed = states.select(known & (states.slowest > SPEED_NOT_STATED))
        found += NearestState.of_columns(
            distance_m=placed.distance,
            height_m=placed.height,
            speed_mps=placed.speed,
            state_id=placed.name,
            force_N=np.fmax(placed.highest, placed.at_least),
            at_least=placed.at_least > np.nan_to_num(placed.highest),
        )
    if not found:
        return []
    places = [(each.distance_m, each.height_m) for each in found]
    nearest = min(places, key=lambda other: math.dist(other, place))
    here = [each for each, other in zip(found, places, strict=True) if math.dist(other, nearest) <= PLACE_SIZE]
    return sorted(here, key=lambda each: each.speed_mps)


def _of_quantities(speed: SafeSpeed) -> list[QuantityAnswer] | None:
    """What each quantity allows by itself; None where the force alone counts."""
    return [
        QuantityAnswer(
            quantity=each.value,
            unit=each.unit,
            limit=of.limit,
            outcome=of.outcome,
            speed_mps=of.speed,
            predicted=of.predicted_force,
            bound=of.bound_force,
        )
        for each, of in speed.of_quantities.items()
    ] or None
