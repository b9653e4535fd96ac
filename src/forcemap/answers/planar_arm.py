"""Effective mass of the paper's planar arm over places: what `planar-arm` answers."""

from __future__ import annotations

import math
from typing import Self

import numpy as np

from forcemap.answers.answer import Answer, AtPlace, Figure
from forcemap.dynamics.effective_mass import MassOutcome
from forcemap.dynamics.mass_map import MassMap, Trend
from forcemap.dynamics.planar_arm import PlanarArm


class PlanarPlace(AtPlace):
    """Effective mass at a place."""

    effective_mass_kg: Figure
    outcome: MassOutcome


class PlanarArmAnswer(Answer):
    """Effective mass of a planar arm downwards; an angle of null: the last link is in line with the one before."""

    link_mass: str
    last_link_deg: Figure
    wrist: str
    base_height_m: float
    lengths_m: tuple[float, ...]
    masses_kg: tuple[float, ...]
    standard_effective_mass_kg: float
    places: list[PlanarPlace]
    trend_with_distance: Trend
    trend_with_height: Trend
    force_ratio: Figure

    @classmethod
    def of_map(cls, arm: PlanarArm, mass_map: MassMap) -> Self:
        """The answer for an arm and its masses over places."""
        grid = np.meshgrid(mass_map.distances, mass_map.heights, indexing="ij")
        return cls.from_result(
            mass_map,
            link_mass=arm.link_mass.value,
            last_link_deg=math.degrees(arm.last_link.angle),
            wrist=arm.wrist.value,
            base_height_m=arm.base_height,
            lengths_m=arm.lengths,
            masses_kg=arm.masses,
            standard_effective_mass_kg=arm.standard_effective_mass,
            places=PlanarPlace.of_columns(
                distance_m=grid[0],
                height_m=grid[1],
                effective_mass_kg=mass_map.mass.value,
                outcome=mass_map.mass.outcome,
            ),
        )
