"""Frames, and the mass, centre of mass and inertia of rigid bodies."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.errors import InputError

_ROUNDING = 1e-3  # radius of gyration [m] below which an inertia is rounding (docs/decisions.md)


@dataclass(frozen=True, eq=False)
class Frame:
    """Position and orientation of a frame in another one.

    Parameters
    ----------
    position : array, shape (3,)
        Its origin [m].
    rotation : array, shape (3, 3)
        Its axes as columns.
    """

    position: FloatArray
    rotation: FloatArray

    @classmethod
    def of(cls, xyz: ArrayLike = (0.0, 0.0, 0.0), rpy: ArrayLike = (0.0, 0.0, 0.0)) -> Self:
        """Frame from a position [m] and roll, pitch, yaw about fixed axes [rad], as in a URDF."""
        roll, pitch, yaw = (turn(axis, float(angle)) for axis, angle in zip(np.eye(3), np.asarray(rpy), strict=True))
        return cls(np.array(xyz, dtype=np.float64), yaw @ pitch @ roll)

    def then(self, inner: Frame) -> Frame:
        """A frame given in this one, in the frame that this one is given in."""
        return Frame(self.position + self.rotation @ inner.position, self.rotation @ inner.rotation)


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body in the frame of the joint that carries it.

    Parameters
    ----------
    mass : float
        Mass [kg].
    centre_of_mass : array, shape (3,)
        Centre of mass [m].
    inertia : array, shape (3, 3)
        Inertia about the centre of mass, in axes of the frame [kg m^2].
    """

    mass: float
    centre_of_mass: FloatArray
    inertia: FloatArray

    @classmethod
    def of(cls, mass: float, centre_of_mass: ArrayLike, inertia: ArrayLike) -> Self:
        """Body from its figures, checked.

        Raises
        ------
        InputError
            A mass below zero, an inertia that is not symmetric or has a principal value below zero (by more than that
            of its mass 1 mm from the centre), numbers that are not finite, or an inertia without a mass.
        """
        centre = np.array(centre_of_mass, dtype=np.float64)
        i = np.array(inertia, dtype=np.float64)
        if not 0 <= mass < math.inf:
            raise InputError(f"mass: found {mass:g} kg, expected a finite number of at least 0")
        if centre.shape != (3,) or not np.isfinite(centre).all():
            raise InputError(f"centre of mass: found {centre}, expected three finite numbers in m")
        if i.shape != (3, 3) or not np.isfinite(i).all() or not np.allclose(i, i.T, rtol=1e-9, atol=1e-12):
            raise InputError("inertia: expected a symmetric matrix of 3 x 3 finite numbers in kg m^2")
        least, *_, largest = np.linalg.eigvalsh(i)
        if least < -max(1e-9 * abs(largest), _ROUNDING**2 * mass):
            raise InputError(f"inertia: found the principal value {least:.3g} kg m^2, expected none below 0")
        if mass == 0 and largest > 0:
            raise InputError("inertia: found one without a mass, expected a mass above 0 kg")
        return cls(float(mass), centre, i)


NOTHING = Body(0.0, np.zeros(3), np.zeros((3, 3)))


def moved_body(body: Body, frame: Frame) -> Body:
    """A body described in `frame`, described in the frame that `frame` is given in."""
    r = frame.rotation
    return Body(body.mass, frame.position + r @ body.centre_of_mass, r @ body.inertia @ r.T)


def united(bodies: Iterable[Body]) -> Body:
    """One body made of several in the same frame (parallel-axis theorem)."""
    parts = [body for body in bodies if body.mass > 0 or body.inertia.any()]
    if not parts:
        return NOTHING
    masses, centres = np.array([body.mass for body in parts]), np.array([body.centre_of_mass for body in parts])
    centre = masses @ centres / (masses.sum() or 1.0)
    spread = (centres - centre).T * masses @ (centres - centre)
    inertia = sum((body.inertia for body in parts), np.trace(spread) * np.eye(3) - spread)
    return Body(float(masses.sum()), centre, inertia)


def cross_matrix(vector: FloatArray) -> FloatArray:
    """The matrix that multiplies as the cross product with `vector` does, shape (3, 3)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def turn(axis: FloatArray, angle: float) -> FloatArray:
    """Rotation about a unit vector, shape (3, 3): Rodrigues' formula."""
    k = cross_matrix(axis)
    return np.asarray(np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k)


def unit_direction(direction: ArrayLike, dimensions: int) -> FloatArray:
    """A direction scaled to length one.

    Raises
    ------
    InputError
        Not that many components, a number that is not finite, or the length zero.
    """
    u = np.asarray(direction, dtype=np.float64)
    if u.ndim < 1 or u.shape[-1] != dimensions:
        raise InputError(f"direction: found the shape {u.shape}, expected {dimensions} components on the last axis")
    length = np.linalg.norm(u, axis=-1, keepdims=True)
    if not np.all((length > 0) & (length < np.inf)):
        raise InputError("direction: found the length zero or a number that is not finite; name where the impact goes")
    return np.asarray(u / length)
