"""Where the joints of a robot stand: forward kinematics and the translational Jacobian, many postures at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.dynamics.rigid_body import cross_matrix
from forcemap.dynamics.robot import Joint, JointKind, Robot
from forcemap.errors import InputError


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
    q = joint_positions(robot, positions)
    posture = posture_of(robot, q.reshape(-1, q.shape[-1]).T)
    rotation = posture.rotations[-1]
    return Pose(
        _batch_first(contact_point(robot, posture), q.shape[:-1]),
        _batch_first(robot.flange.rotation.T @ rotation, q.shape[:-1]),
    )


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
    q = joint_positions(robot, positions)
    return _batch_first(contact_jacobian(robot, posture_of(robot, q.reshape(-1, q.shape[-1]).T)), q.shape[:-1])


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
        if joint.kind is JointKind.PRISMATIC:
            sliding[:, i] = axis
            position = position + axis * value
            rotation = joint.origin.rotation.T @ rotation
        else:
            turning[:, i] = axis
            rotation = _turned(rotation, joint, value)
        positions[:, i] = position
        rotations.append(rotation)
    return Posture(positions, turning, sliding, rotations)


def contact_point(robot: Robot, posture: Posture) -> FloatArray:
    """The contact point, shape (3, batch) [m]."""
    offset = robot.flange.position + robot.flange.rotation @ robot.contact_offset
    return np.asarray(posture.positions[:, -1] + offset @ posture.rotations[-1])


def contact_jacobian(robot: Robot, posture: Posture) -> FloatArray:
    """Translational Jacobian of the contact point, shape (3, n, batch)."""
    return posture.rates(contact_point(robot, posture))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product along the first axis."""
    product = np.empty_like(a)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[j], b[k], out=product[i])
        product[i] -= a[k] * b[j]
    return product


def _turned(rotation: FloatArray, joint: Joint, angle: FloatArray) -> FloatArray:
    """Rotation after the joint: Rodrigues' formula, with the constant matrices multiplied out beforehand."""
    along = np.outer(joint.axis, joint.axis)
    parts = np.concatenate([along.T, np.eye(3) - along.T, cross_matrix(joint.axis).T]) @ joint.origin.rotation.T
    turned = parts @ rotation
    fixed, cosine, sine = turned[:, :3], turned[:, 3:6], turned[:, 6:]
    cosine *= np.cos(angle)
    sine *= np.sin(angle)
    cosine += sine
    cosine += fixed
    return np.ascontiguousarray(cosine)


def _batch_first(values: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    moved = np.moveaxis(values, -1, 0)
    return moved.reshape(*shape, *moved.shape[1:])
