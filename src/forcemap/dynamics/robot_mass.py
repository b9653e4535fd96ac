"""Effective mass of a robot in postures, and at places."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from forcemap.dynamics.effective_mass import EffectiveMass, mass_along, unit_direction, unreachable_as_outcome
from forcemap.dynamics.inverse_kinematics import DOWN, ReachOutcome, inverse_kinematics, places_in_plane
from forcemap.dynamics.kinematics import contact_jacobian, joint_positions, posture_of
from forcemap.dynamics.mass_matrix import posture_mass_matrix
from forcemap.dynamics.robot import Robot
from forcemap.errors import InputError

_BLOCK = 2048  # postures at once: their frames stay in the processor's cache


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
        Not one finite number for every joint, or a direction that is none.
    """
    q = joint_positions(robot, positions)
    u = unit_direction(direction, 3)
    if u.ndim != 1:
        raise InputError(f"direction: found the shape {u.shape}, expected one direction, three components")
    flat = q.reshape(-1, q.shape[-1])
    value, outcome = np.empty(len(flat)), np.empty(len(flat), dtype=object)
    for first in range(0, len(flat), _BLOCK):
        block = slice(first, first + _BLOCK)
        posture = posture_of(robot, np.ascontiguousarray(flat[block].T))
        j, m = contact_jacobian(robot, posture), posture_mass_matrix(robot, posture)
        value[block], outcome[block] = mass_along(j, m, u[:, None], robot.drive_inertia)
    if q.ndim == 1:
        return EffectiveMass(float(value[0]), outcome[0], robot.drive_inertia)
    return EffectiveMass(value.reshape(q.shape[:-1]), outcome.reshape(q.shape[:-1]), robot.drive_inertia)


def robot_effective_mass_at(
    robot: Robot,
    distance: ArrayLike,
    height: ArrayLike,
    *,
    direction: ArrayLike = DOWN,
    tool_direction: ArrayLike = DOWN,
    reference: ArrayLike | None = None,
) -> EffectiveMass:
    """Effective mass of a robot with its contact point at distance d and height h; unreachable places are named.

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
        Posture whose neighbour is taken [rad], [m]; the robot's own if not given.

    Raises
    ------
    InputError
        A place, a direction or a reference that is not finite numbers of the right count.
    """
    places = places_in_plane(distance, height)
    reach = inverse_kinematics(robot, places, tool_direction=tool_direction, reference=reference)
    reached = np.asarray(reach.outcome == ReachOutcome.REACHED)
    stand_in = np.where(reached[..., None], reach.positions, robot.reference_posture)
    return unreachable_as_outcome(robot_effective_mass(robot, stand_in, direction), reached)
