"""Joint-space mass matrix: composite rigid bodies, many postures at once (Featherstone 2008, chapter 6)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.dynamics.kinematics import Posture, cross, joint_positions, posture_of
from forcemap.dynamics.robot import Robot


def mass_matrix(robot: Robot, positions: ArrayLike) -> FloatArray:
    """Joint-space mass matrix of the links, tool and payload, shape (..., n, n) [kg m^2], [kg m], [kg].

    Drive inertia is not in it, `effective_mass` adds it.

    Parameters
    ----------
    robot : Robot
        The robot.
    positions : array, shape (..., n)
        Positions of the joints [rad], [m].

    Raises
    ------
    InputError
        Not one finite number for every joint.
    """
    q = joint_positions(robot, positions)
    n = q.shape[-1]
    matrix = posture_mass_matrix(robot, posture_of(robot, q.reshape(-1, n).T))
    return np.moveaxis(matrix, -1, 0).reshape(*q.shape[:-1], n, n)


def posture_mass_matrix(robot: Robot, posture: Posture) -> FloatArray:
    """The same from frames that are known, shape (n, n, batch).

    From the tip to the base the bodies beyond each joint are gathered into one: its mass, first moment and inertia.
    Moving joint i at unit speed gives that body a momentum; what joint j before it feels of that is M_ij. All is taken
    about the origin of the last joint, where the small inertias are, so that no large ones cancel in them.
    """
    n, batch = posture.positions.shape[1:]
    reference = posture.positions[:, -1]
    turning, sliding = posture.turning, posture.rates(reference)
    matrix = np.empty((n, n, batch))
    mass, moment, inertia = 0.0, np.zeros((3, batch)), np.zeros((6, batch))
    for i in reversed(range(n)):
        body = robot.joints[i].body
        centre = body.centre_of_mass @ posture.rotations[i] + (posture.positions[:, i] - reference)
        mass += body.mass
        moment += body.mass * centre
        _add_turned(inertia, body.inertia, posture.rotations[i])
        _add_point(inertia, body.mass, centre)
        linear = mass * sliding[:, i] + cross(turning[:, i], moment)
        angular = _times(inertia, turning[:, i]) + cross(moment, sliding[:, i])
        before = slice(0, i + 1)
        matrix[i, before] = matrix[before, i] = _dot(turning[:, before], angular) + _dot(sliding[:, before], linear)
    return matrix


# A symmetric matrix is six rows: xx, yy, zz, xy, xz, yz.
_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _add_turned(total: FloatArray, inertia: FloatArray, rotation: FloatArray) -> None:
    """Add R I R^T."""
    half = inertia @ rotation
    for row, (a, b) in zip(total, _PAIRS, strict=True):
        row += _dot(half[a], rotation[b])


def _add_point(total: FloatArray, mass: float, x: FloatArray) -> None:
    """Add the inertia of a point mass at x."""
    weighted = mass * x
    total[:3] += _dot(weighted, x)
    for row, (a, b) in zip(total, _PAIRS, strict=True):
        row -= weighted[a] * x[b]


def _times(i: FloatArray, v: FloatArray) -> FloatArray:
    return np.stack([_dot(i[[0, 3, 4]], v), _dot(i[[3, 1, 5]], v), _dot(i[[4, 5, 2]], v)])


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    total = a[0] * b[0]
    total += a[1] * b[1]
    total += a[2] * b[2]
    return np.asarray(total)
