"""Forward kinematics, translational Jacobian and joint-space mass matrix of a robot, many postures at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.dynamics.rigid_body import Body, cross_matrix
from forcemap.dynamics.robot import Joint, JointKind, Robot
from forcemap.errors import InputError

# A symmetric matrix is six rows: xx, yy, zz, xy, xz, yz.
_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
_FULL = [[0, 3, 4], [3, 1, 5], [4, 5, 2]]


@dataclass(frozen=True, eq=False)
class Posture:
    """The frames of all joints in axes of the base; the postures are the last axis, so that each step runs over all.

    Parameters
    ----------
    positions : array, shape (3, n, batch)
        Origin of every joint's frame [m].
    turning : array, shape (3, n, batch)
        Axis of every joint that turns; zero for one that slides.
    sliding : array, shape (3, n, batch)
        Axis of every joint that slides; zero for one that turns.
    rotations : list of array, shape (3, 3, batch)
        Axes of every joint's frame, as columns.
    """

    positions: FloatArray
    turning: FloatArray
    sliding: FloatArray
    rotations: list[FloatArray]

    def rates(self, point: FloatArray) -> FloatArray:
        """Velocity of a point (3, batch) that moves with the tip, at unit speed of each joint: (3, n, batch)."""
        return cross(self.turning, point[:, None] - self.positions) + self.sliding


@dataclass(frozen=True, eq=False)
class Pose:
    """Where the contact point is.

    Parameters
    ----------
    position : array, shape (..., 3)
        The contact point in the frame of the base [m].
    rotation : array, shape (..., 3, 3)
        Axes of the flange as columns; the last is the direction of the tool.
    """

    position: FloatArray
    rotation: FloatArray


def forward_kinematics(robot: Robot, positions: ArrayLike) -> Pose:
    """Place of the contact point and orientation of the flange.

    Parameters
    ----------
    robot : Robot
        The robot.
    positions : array, shape (..., n)
        Positions of the joints [rad], [m]; the joint limits are not applied.

    Raises
    ------
    InputError
        Not one finite number for every joint.
    """
    frame = at_positions(_contact_frame, robot, positions)
    return Pose(frame[..., 0], frame[..., 1:])


def jacobian(robot: Robot, positions: ArrayLike) -> FloatArray:
    """Translational Jacobian of the contact point, shape (..., 3, n) [m/rad], or 1 for a prismatic joint.

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
    return at_positions(contact_jacobian, robot, positions)


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
    return at_positions(posture_mass_matrix, robot, positions)


def at_positions(function: Callable[[Robot, Posture], FloatArray], robot: Robot, positions: ArrayLike) -> FloatArray:
    """A function of postures, which puts the postures last, at positions of shape (..., n): here they come first.

    Raises
    ------
    InputError
        Not one finite number for every joint.
    """
    q = joint_positions(robot, positions)
    values = np.moveaxis(function(robot, posture_of(robot, q.reshape(-1, q.shape[-1]).T)), -1, 0)
    return values.reshape(*q.shape[:-1], *values.shape[1:])


def joint_positions(robot: Robot, positions: ArrayLike) -> FloatArray:
    """Positions as an array, shape (..., n).

    Raises
    ------
    InputError
        Not one finite number for every joint.
    """
    q = np.asarray(positions, dtype=np.float64)
    n = len(robot.joints)
    if q.ndim < 1 or q.shape[-1] != n:
        raise InputError(f"joint positions: found the shape {q.shape}, expected {n} of {robot.name} on the last axis")
    if not np.isfinite(q).all():
        raise InputError("joint positions: found a number that is not finite; leave out places that are not reached")
    return q


def posture_of(robot: Robot, q: FloatArray) -> Posture:
    """Frames of all joints at the positions q, shape (n, batch)."""
    shape = (3, *q.shape)
    positions, turning, sliding = np.empty(shape), np.zeros(shape), np.zeros(shape)
    position, rotation = np.zeros((3, q.shape[1])), np.repeat(np.eye(3)[..., None], q.shape[1], axis=2)
    rotations = []
    for i, (joint, value) in enumerate(zip(robot.joints, q, strict=True)):
        position = position + joint.origin.position @ rotation
        axis = (joint.origin.rotation @ joint.axis) @ rotation
        slides = joint.kind is JointKind.PRISMATIC
        (sliding if slides else turning)[:, i] = axis
        positions[:, i] = position = position + sliding[:, i] * value
        rotation = joint.origin.rotation.T @ rotation if slides else _turned(rotation, joint, value)
        rotations.append(rotation)
    return Posture(positions, turning, sliding, rotations)


def contact_point(robot: Robot, posture: Posture) -> FloatArray:
    """The contact point, shape (3, batch) [m]."""
    offset = robot.flange.position + robot.flange.rotation @ robot.contact_offset
    return np.asarray(posture.positions[:, -1] + offset @ posture.rotations[-1])


def contact_jacobian(robot: Robot, posture: Posture) -> FloatArray:
    """Translational Jacobian of the contact point, shape (3, n, batch)."""
    return posture.rates(contact_point(robot, posture))


def _contact_frame(robot: Robot, posture: Posture) -> FloatArray:
    """The contact point and, as columns, the axes of the flange, shape (3, 4, batch)."""
    axes = robot.flange.rotation.T @ posture.rotations[-1]
    return np.concatenate([contact_point(robot, posture)[:, None], axes], axis=1)


def posture_mass_matrix(robot: Robot, posture: Posture) -> FloatArray:
    """Mass matrix by composite rigid bodies, shape (n, n, batch) (Featherstone 2008, chapter 6).

    From the tip to the base the bodies beyond each joint are gathered into one: its mass, first moment and inertia.
    Moving joint i at unit speed gives that body a momentum; its component along joint j before it is M_ij. All moments
    are taken about the origin of the last joint, where the small inertias are, so that large ones do not cancel.
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
        _add_inertia(inertia, body, posture.rotations[i], centre)
        linear = mass * sliding[:, i] + cross(turning[:, i], moment)
        angular = _dot(inertia[_FULL], turning[:, i]) + cross(moment, sliding[:, i])
        before = slice(0, i + 1)
        matrix[i, before] = matrix[before, i] = _dot(turning[:, before], angular) + _dot(sliding[:, before], linear)
    return matrix


def _add_inertia(total: FloatArray, body: Body, rotation: FloatArray, centre: FloatArray) -> None:
    """Add R I R^T, and the inertia of a point mass at the centre."""
    half, moment = body.inertia @ rotation, body.mass * centre
    total[:3] += _dot(moment, centre)
    for row, (a, b) in zip(total, _PAIRS, strict=True):
        row += _dot(half[a], rotation[b]) - moment[a] * centre[b]


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product along the first axis."""
    return np.stack([a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1))])


def _turned(rotation: FloatArray, joint: Joint, angle: FloatArray) -> FloatArray:
    """Rotation after the joint: Rodrigues' formula, with the constant matrices multiplied out beforehand."""
    along = np.outer(joint.axis, joint.axis)
    parts = np.concatenate([along.T, np.eye(3) - along.T, cross_matrix(joint.axis).T]) @ joint.origin.rotation.T
    fixed, cosine, sine = np.split(parts @ rotation, 3, axis=1)
    return np.ascontiguousarray(cosine * np.cos(angle) + sine * np.sin(angle) + fixed)
