"""Effective mass, and forces beside it: what `effective-mass` and `compare --effective-mass` answer."""

from __future__ import annotations

from typing import Self

import numpy as np
from pydantic import ConfigDict, Field

from forcemap.answers.accuracy import AccuracyAnswer
from forcemap.answers.answer import AllSaid, Answer, AtPlace, Figure, of
from forcemap.comparisons.effective_mass import MassComparison
from forcemap.dynamics.effective_mass import MassOutcome
from forcemap.dynamics.mass_map import MassMap, Trend
from forcemap.dynamics.robot import Robot


class PlaceMass(AtPlace):
    """Effective mass at a place, and the posture there: positions by joint, with units."""

    effective_mass_kg: Figure
    outcome: MassOutcome
    posture: dict[str, float] | None


class MassAnswer(Answer):
    """Which robot's effective mass it is, and what it says about drive inertia."""

    model_config = ConfigDict(serialize_by_alias=True)

    robot: str = of("name")
    source: str
    findings: AllSaid
    moving_mass_kg: float = of("moving_mass")
    load_kg: float = of("load")
    standard_effective_mass_kg: float = of("standard_effective_mass")
    direction: tuple[float, ...]
    tool_direction: tuple[float, ...]
    tool_axis: tuple[float, ...]
    contact_offset_m: tuple[float, ...] = of("contact_offset")
    reference_posture: dict[str, float]
    drive_inertia_kg_m2: list[float] | None
    assumption: str
    not_: str = Field("effective mass is no force: no safe speed follows from it", serialization_alias="not")

    @classmethod
    def of_map(cls, robot: Robot, mass_map: MassMap, **stands: tuple[float, ...]) -> Self:
        """The answer for a map; for its place if it has only one."""
        mass, drives = mass_map.mass, mass_map.mass.drive_inertia
        grid = np.meshgrid(mass_map.distances, mass_map.heights, indexing="ij")
        places = PlaceMass.of_columns(
            distance_m=grid[0],
            height_m=grid[1],
            effective_mass_kg=mass.value,
            outcome=mass.outcome,
            posture=robot.stated_postures(mass.positions),
        )
        also = {
            **vars(places[0]),
            "places": places,
            "trend_with_distance": mass_map.trend_with_distance,
            "trend_with_height": mass_map.trend_with_height,
            "force_ratio": mass_map.force_ratio,
            "drive_inertia_kg_m2": None if drives is None else drives.values.tolist(),
            "assumption": mass.assumption,
            "reference_posture": robot.stated(robot.reference_posture),
        }
        return cls.from_result(robot, **stands, **also)


class PlaceMassAnswer(MassAnswer, PlaceMass):
    """Effective mass of a robot at a place."""


class MassMapAnswer(MassAnswer):
    """Effective mass of a robot over places."""

    places: list[PlaceMass]
    trend_with_distance: Trend
    trend_with_height: Trend
    force_ratio: Figure


class PlaceExplanation(Answer):
    """What one effective mass gives for the force at a place."""

    effective_mass_kg: Figure
    outcome: MassOutcome
    force_N: Figure
    ratio: Figure


class ComparedPlace(AtPlace):
    """A force, the effective mass that it would take, the posture, and what effective masses give."""

    force_N: float
    measured_effective_mass_kg: float
    posture: dict[str, float] | None
    by_mass: list[PlaceExplanation]


class Explanation(Answer):
    """How well one effective mass explains all forces."""

    name: str
    assumption: str = of("mass", "assumption")
    places: int
    rank_correlation: Figure
    explained_share: Figure
    explained_share_scaled: Figure
    accuracy: AccuracyAnswer
    ratio_lowest: float
    ratio_highest: float


class MassComparisonAnswer(Answer):
    """Forces at one speed beside what effective mass would give."""

    on: str
    robot: str
    speed_mps: float = of("speed")
    stiffness_N_per_m: float = of("stiffness")
    force_spread: float
    places: list[ComparedPlace]
    by_mass: list[Explanation]
    statements: AllSaid

    @classmethod
    def of_comparison(cls, comparison: MassComparison) -> Self:
        """The answer for a comparison."""
        explanations = comparison.explanations
        ratios = [{"ratio_lowest": np.nanmin(e.ratio), "ratio_highest": np.nanmax(e.ratio)} for e in explanations]
        by_mass = [Explanation.from_result(e, **of_mass) for e, of_mass in zip(explanations, ratios, strict=True)]
        said = [
            PlaceExplanation.of_columns(
                effective_mass_kg=e.mass.value, outcome=e.mass.outcome, force_N=e.force, ratio=e.ratio
            )
            for e in explanations
        ]
        places = ComparedPlace.of_columns(
            distance_m=comparison.distance,
            height_m=comparison.height,
            force_N=comparison.measured_force,
            measured_effective_mass_kg=comparison.measured_mass,
            posture=comparison.postures,
            by_mass=zip(*said, strict=True),
        )
        return cls.from_result(comparison, places=places, by_mass=by_mass)
