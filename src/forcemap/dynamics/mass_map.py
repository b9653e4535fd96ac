"""Effective mass of robots and planar arms: in postures, at places, over the plane of distances and heights."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.dynamics.effective_mass import (
    LEAST_PIVOT,
    SINGULAR,
    Drives,
    EffectiveMass,
    MassOutcome,
    effective_mass,
    mass_along,
)
from forcemap.dynamics.inverse_kinematics import DOWN, Reach, ReachOutcome, inverse_kinematics, places_in_plane
from forcemap.dynamics.kernels import many_masses
from forcemap.dynamics.kinematics import (
    contact_jacobian,
    forward_kinematics,
    joint_positions,
    posture_mass_matrix,
    posture_of,
)
from forcemap.dynamics.planar_arm import PlanarArm, planar_inverse_kinematics, planar_jacobian, planar_mass_matrix
from forcemap.dynamics.rigid_body import unit_direction
from forcemap.dynamics.robot import Robot
from forcemap.errors import InputError

PLANAR_DOWN = (0.0, -1.0)

_BLOCK = 2048  # postures at once, so that their frames stay in the processor's cache: a choice
_CONSTANT = 1e-6  # change of ln m_u below which it is rounding: a choice


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


def robot_effective_mass(robot: Robot, positions: ArrayLike, direction: ArrayLike = DOWN) -> EffectiveMass:
    """Effective mass of a robot in postures, with the robot's drive inertia if it has one.

    Parameters
    ----------
    robot : Robot
        The robot.
    positions : array, shape (..., n)
        Positions of the joints [rad], [m].
    direction : array, shape (3,)
        Direction of the impact in the frame of the base; down if not given.

    Raises
    ------
    InputError
        Not one finite number for every joint, or a direction of length zero.
    """
    q = joint_positions(robot, positions)
    u = unit_direction(direction, 3)
    if u.ndim != 1:
        raise InputError(f"direction: found the shape {u.shape}, expected one direction, three components")
    flat = q.reshape(-1, q.shape[-1])
    outcome = np.full(len(flat), MassOutcome.REGULAR, dtype=object)
    value = many_masses(robot, flat, u, SINGULAR, LEAST_PIVOT)
    value = np.full(len(flat), np.nan) if value is None else value
    by_numpy = np.flatnonzero(np.isnan(value))
    for first in range(0, by_numpy.size, _BLOCK):
        block = by_numpy[first : first + _BLOCK]
        posture = posture_of(robot, np.ascontiguousarray(flat[block].T))
        j, m = (np.moveaxis(f(robot, posture), -1, 0) for f in (contact_jacobian, posture_mass_matrix))
        mass = mass_along(j, m, u, robot.drive_inertia)
        value[block], outcome[block] = mass.value, mass.outcome
    return EffectiveMass.of(value.reshape(q.shape[:-1]), outcome.reshape(q.shape[:-1]), robot.drive_inertia, q)


def robot_effective_mass_at(
    robot: Robot,
    distance: ArrayLike,
    height: ArrayLike,
    *,
    direction: ArrayLike = DOWN,
    tool_direction: ArrayLike = DOWN,
    reference: ArrayLike | None = None,
) -> EffectiveMass:
    """Effective mass of a robot whose contact point is at distance d and height h, with a named outcome at each place.

    Parameters
    ----------
    robot : Robot
        The robot.
    distance, height : float or array
        Distance from the base z-axis and height above the base [m].
    direction : array, shape (3,)
        Direction of the impact in the frame of the base; down if not given.
    tool_direction : array, shape (3,)
        Where the z axis of the flange points; down if not given.
    reference : array, shape (n,), optional
        Posture to keep near to [rad], [m]; the robot's own if not given.

    Raises
    ------
    InputError
        A place, a direction or a reference that is not finite numbers of the right count.
    """
    places = places_in_plane(distance, height)
    reach = inverse_kinematics(robot, places, tool_direction=tool_direction, reference=reference)
    return _where_reached(reach, robot.reference_posture, lambda q: robot_effective_mass(robot, q, direction))


def planar_effective_mass_at(
    arm: PlanarArm,
    distance: ArrayLike,
    height: ArrayLike,
    *,
    direction: ArrayLike = PLANAR_DOWN,
    drive_inertia: Drives = None,
) -> EffectiveMass:
    """Effective mass of a planar arm whose end is at distance d and height h, with a named outcome at each place.

    Parameters
    ----------
    arm : PlanarArm
        The arm.
    distance, height : float or array
        Distance d from the base and height h above it [m].
    direction : array, shape (2,)
        Direction of the impact, outwards and upwards; down if not given, as in the paper.
    drive_inertia : array, shape (n,), or DriveInertia, optional
        Inertia of the drives [kg m^2]; n is 3, or 2 with the wrist locked.

    Raises
    ------
    InputError
        A place or a direction that is not finite, or not one drive inertia for every joint.
    """

    def mass_of(q: FloatArray) -> EffectiveMass:
        j, m = planar_jacobian(arm, q), planar_mass_matrix(arm, q)
        return effective_mass(j, m, direction, drive_inertia=drive_inertia)

    bent = np.full(3, 0.5)  # any posture that is not singular [rad]
    return _where_reached(planar_inverse_kinematics(arm, distance, height), bent, mass_of)


def _where_reached(reach: Reach, stand_in: FloatArray, mass_of: Callable[[FloatArray], EffectiveMass]) -> EffectiveMass:
    """Masses in postures; NaN and `unreachable` where a place is not reached and `stand_in` fills the arrays."""
    reached = np.asarray(reach.outcome == ReachOutcome.REACHED)
    mass = mass_of(np.where(reached[..., None], reach.positions, stand_in))
    outcome = np.array(mass.outcome, dtype=object)
    outcome[~reached] = MassOutcome.UNREACHABLE
    return EffectiveMass.of(np.where(reached, mass.value, np.nan), outcome, mass.drive_inertia, reach.positions)


def planar_mass_map(
    arm: PlanarArm,
    distances: ArrayLike,
    heights: ArrayLike,
    *,
    direction: ArrayLike = PLANAR_DOWN,
    drive_inertia: Drives = None,
) -> MassMap:
    """Effective mass of a planar arm on a grid (paper, figure 3).

    Parameters
    ----------
    arm : PlanarArm
        The arm.
    distances, heights : array, shape (nd,) and (nh,)
        Distances from the base and heights above it [m], ascending.
    direction, drive_inertia : optional
        As for `planar_effective_mass_at`.

    Raises
    ------
    InputError
        Distances or heights that are not ascending finite numbers.
    """
    d, h = _axes(distances=distances, heights=heights)
    return MassMap(d, h, planar_effective_mass_at(arm, d[:, None], h, direction=direction, drive_inertia=drive_inertia))


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
    direction, tool_direction, reference : optional
        As for `robot_effective_mass_at`.

    Raises
    ------
    InputError
        Distances or heights that are not ascending finite numbers.
    """
    d, h = _axes(distances=distances, heights=heights)
    mass = robot_effective_mass_at(
        robot, d[:, None], h, direction=direction, tool_direction=tool_direction, reference=reference
    )
    return MassMap(d, h, mass)


def robot_mass_in_posture(robot: Robot, positions: ArrayLike, *, direction: ArrayLike = DOWN) -> MassMap:
    """Effective mass of a robot in one posture, as a map of the single place where its contact point is.

    Parameters
    ----------
    robot : Robot
        The robot.
    positions : array, shape (n,)
        Positions of the joints [rad], [m].
    direction : array, shape (3,)
        Direction of the impact in the frame of the base; down if not given.

    Raises
    ------
    InputError
        Not one finite number for every joint, or a direction of length zero.
    """
    q = joint_positions(robot, positions)
    x, y, z = forward_kinematics(robot, q).position
    return MassMap(np.array([np.hypot(x, y)]), np.array([z]), robot_effective_mass(robot, q[None, None], direction))


def _trend(steps: FloatArray) -> Trend:
    known = steps[np.isfinite(steps)]
    signs = np.unique(np.where(np.abs(known) <= _CONSTANT, 0, np.sign(known)))
    if signs.size != 1:
        return Trend.MIXED if signs.size else Trend.UNKNOWN
    return {-1: Trend.FALLS, 0: Trend.CONSTANT, 1: Trend.RISES}[int(signs[0])]


def _axes(**axes: ArrayLike) -> list[FloatArray]:
    checked = {what: np.array(values, dtype=np.float64) for what, values in axes.items()}
    for what, axis in checked.items():
        if axis.ndim != 1 or axis.size < 1 or not np.isfinite(axis).all() or np.any(np.diff(axis) <= 0):
            raise InputError(f"{what}: found {axes[what]!r}, expected ascending finite numbers in m")
    return list(checked.values())
