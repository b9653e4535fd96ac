"""Effective mass over the plane of distances and heights."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.dynamics.drive_inertia import DriveInertia
from forcemap.dynamics.effective_mass import EffectiveMass
from forcemap.dynamics.inverse_kinematics import DOWN
from forcemap.dynamics.planar_arm import PlanarArm
from forcemap.dynamics.planar_places import PLANAR_DOWN, planar_effective_mass_at
from forcemap.dynamics.robot import Robot
from forcemap.dynamics.robot_mass import robot_effective_mass_at
from forcemap.errors import InputError

_STILL = 1e-6  # a change of the logarithm that is none


class Trend(StrEnum):
    """How the effective mass changes along every line of a map.

    `constant`: by less than 1e-6 of itself; `mixed`: it falls here and rises, or stays, there; `unknown`: fewer than
    two neighbouring places have a regular value.
    """

    FALLS = "falls"
    RISES = "rises"
    CONSTANT = "constant"
    MIXED = "mixed"
    UNKNOWN = "unknown"


@dataclass(frozen=True, eq=False)
class MassMap:
    """Effective mass on a grid of places.

    Parameters
    ----------
    distances, heights : array, shape (nd,) and (nh,)
        Distances from the base z-axis and heights above the base [m], ascending.
    mass : EffectiveMass
        Effective masses, shape (nd, nh) [kg], with their outcomes.
    """

    distances: FloatArray
    heights: FloatArray
    mass: EffectiveMass

    @property
    def trend_with_distance(self) -> Trend:
        """How the effective mass changes with the distance, at every height."""
        return _trend(np.diff(np.log(self.mass.value), axis=0))

    @property
    def trend_with_height(self) -> Trend:
        """How the effective mass changes with the height, at every distance."""
        return _trend(np.diff(np.log(self.mass.value), axis=1))

    @property
    def force_ratio(self) -> float:
        """sqrt(max / min): by how much the force of an impact would vary over the map if F = v sqrt(k m_u)."""
        values = self.mass.value[np.isfinite(self.mass.value)]
        return float(np.sqrt(values.max() / values.min())) if values.size else float("nan")


def planar_mass_map(
    arm: PlanarArm,
    distances: ArrayLike,
    heights: ArrayLike,
    *,
    direction: ArrayLike = PLANAR_DOWN,
    drive_inertia: ArrayLike | DriveInertia | None = None,
) -> MassMap:
    """Effective mass of a planar arm on a grid (paper, figure 3).

    Parameters
    ----------
    arm : PlanarArm
        The arm.
    distances, heights : array, shape (nd,) and (nh,)
        Distances from the base and heights above it [m], ascending.
    direction : array, shape (2,)
        Direction of the impact; down if not given.
    drive_inertia : array, shape (n,), or DriveInertia, optional
        Inertia of the drives [kg m^2].

    Raises
    ------
    InputError
        Distances or heights that are not ascending finite numbers.
    """
    d, h = _axis("distances", distances), _axis("heights", heights)
    mass = planar_effective_mass_at(arm, d[:, None], h, direction=direction, drive_inertia=drive_inertia)
    return MassMap(d, h, mass)


def robot_mass_map(
    robot: Robot,
    distances: ArrayLike,
    heights: ArrayLike,
    *,
    direction: ArrayLike = DOWN,
    tool_direction: ArrayLike = DOWN,
    reference: ArrayLike | None = None,
) -> MassMap:
    """Effective mass of a robot on a grid in the plane y = 0.

    Parameters
    ----------
    robot : Robot
        The robot.
    distances, heights : array, shape (nd,) and (nh,)
        Distances from the base z-axis and heights above the base [m], ascending.
    direction, tool_direction : array, shape (3,)
        Direction of the impact, and of the tool; down if not given.
    reference : array, shape (n,), optional
        Posture whose neighbours are taken [rad], [m]; the robot's own if not given.

    Raises
    ------
    InputError
        Distances or heights that are not ascending finite numbers.
    """
    d, h = _axis("distances", distances), _axis("heights", heights)
    mass = robot_effective_mass_at(
        robot, d[:, None], h, direction=direction, tool_direction=tool_direction, reference=reference
    )
    return MassMap(d, h, mass)


def _trend(steps: FloatArray) -> Trend:
    known = steps[np.isfinite(steps)]
    if not known.size:
        return Trend.UNKNOWN
    for trend, holds in (
        (Trend.FALLS, known < -_STILL),
        (Trend.RISES, known > _STILL),
        (Trend.CONSTANT, np.abs(known) <= _STILL),
    ):
        if np.all(holds):
            return trend
    return Trend.MIXED


def _axis(what: str, values: ArrayLike) -> FloatArray:
    axis = np.array(values, dtype=np.float64)
    if axis.ndim != 1 or axis.size < 1 or not np.isfinite(axis).all() or np.any(np.diff(axis) <= 0):
        raise InputError(f"{what}: found {values!r}, expected ascending finite numbers in m")
    return axis
