"""A robot at the moment of contact, reduced to the modes of its servo-held joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcemap.arrays import FloatArray
from forcemap.dynamics.inverse_kinematics import ReachOutcome, inverse_kinematics, places_in_plane
from forcemap.dynamics.kinematics import contact_point, posture_of
from forcemap.dynamics.mass_matrix import posture_mass_matrix
from forcemap.dynamics.robot import Robot
from forcemap.errors import InputError

DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True, eq=False)
class Impactor:
    """Robots in their postures at contact, moving straight; mass matrix and Jacobian stay what they are there.

    The servo of every joint has a stiffness and a damping in proportion to its own inertia A_ii, A the mass matrix with
    the drives. So the joints' motion falls apart into modes that only the contact couples:
    y'' = s (w^2 (a r - y) + 2 z w (a r' - y')) - s l F, with r the commanded path, w and z frequency and damping of the
    servo, F the contact force; the depth of the contact point is l . y.

    Parameters
    ----------
    shares : array, shape (n, batch)
        s, by how much a mode is stiffer than the servo of a single joint [1].
    levers : array, shape (n, batch)
        l, motion of the contact point per mode [kg^-1/2].
    approach : array, shape (n, batch)
        a, motion of the modes per motion along the commanded path [kg^1/2].
    joint_lever : array, shape (batch,)
        Largest torque at a joint per force at the contact point [m].
    """

    shares: FloatArray
    levers: FloatArray
    approach: FloatArray
    joint_lever: FloatArray

    @classmethod
    def of(cls, mass: FloatArray, rates: FloatArray, turning: FloatArray, direction: FloatArray = DOWN) -> Self:
        """From mass matrices with drives (batch, n, n) and what the joints move: the contact point (3, n, batch)
        [m/rad] and the tool's orientation (3, n, batch) [1]; and where it moves, unit vectors (batch, 3) or one (3,).
        """
        along = np.broadcast_to(direction, (rates.shape[-1], 3))
        lever = (rates * along.T[:, None]).sum(axis=0)
        path = np.concatenate([rates, turning])
        wanted = np.concatenate([along, np.zeros_like(along)], axis=1)[..., None]
        motion = (np.linalg.pinv(np.moveaxis(path, -1, 0)) @ wanted)[..., 0].T  # the tool's orientation kept
        motion /= (lever * motion).sum(axis=0)
        inertia = np.sqrt(np.diagonal(mass, axis1=1, axis2=2))  # (batch, n)
        # eigenvectors of the scaled matrix are those of its inverse; the shares are one over the eigenvalues
        values, vectors = np.linalg.eigh(mass / (inertia[:, :, None] * inertia[:, None, :]))
        turned = np.swapaxes(vectors, 1, 2)
        levers = (turned @ (lever.T / inertia)[..., None])[..., 0]
        approach = (turned @ (motion.T * inertia)[..., None])[..., 0]
        return cls(1 / values.T, levers.T, approach.T, np.abs(lever).max(axis=0))

    def at(self, places: NDArray[np.intp]) -> Impactor:
        """The same robots, for impacts at these places by number."""
        return Impactor(
            self.shares[:, places], self.levers[:, places], self.approach[:, places], self.joint_lever[places]
        )


@dataclass(frozen=True, eq=False)
class Posed:
    """A robot posed at places: mass matrices of the links and what the joints move there; names as in `Impactor.of`."""

    mass: FloatArray
    rates: FloatArray
    turning: FloatArray

    def with_drives(self, drive_inertia: FloatArray, direction: FloatArray = DOWN) -> Impactor:
        """The robots with the inertia of their drives [kg m^2], shape (n,), moving along unit vectors (batch, 3)."""
        return Impactor.of(self.mass + np.diag(drive_inertia), self.rates, self.turning, direction)


def posed(
    robot: Robot, distance: ArrayLike, height: ArrayLike, *, tool_direction: ArrayLike, contact_radius: float
) -> Posed:
    """Pose a robot with its lowest point of contact at places.

    Parameters
    ----------
    robot : Robot
        The robot.
    distance, height : array, shape (batch,)
        Distance from the base z-axis and height above the base [m].
    tool_direction : array, shape (3,)
        Where the z axis of the flange points.
    contact_radius : float
        The contact point lies this far below the robot's own [m]: the radius of a flange that hits with its rim.

    Raises
    ------
    InputError
        A place the robot cannot reach so.
    """
    d, h = np.broadcast_arrays(np.asarray(distance, dtype=np.float64), np.asarray(height, dtype=np.float64))
    reach = inverse_kinematics(robot, places_in_plane(d, h + contact_radius), tool_direction=tool_direction)
    reached = np.asarray(reach.outcome == ReachOutcome.REACHED)
    if not reached.all():
        i = int(np.argmin(reached))
        raise InputError(
            f"{robot.name}: found {int(np.sum(~reached))} places it cannot reach with this tool direction, first "
            f"d = {d[i]:g} m, h = {h[i]:g} m; leave them out of the plan"
        )
    posture = posture_of(robot, reach.positions.T)
    rates = posture.rates(contact_point(robot, posture) + contact_radius * DOWN[:, None])
    return Posed(np.moveaxis(posture_mass_matrix(robot, posture), -1, 0), rates, posture.turning)
