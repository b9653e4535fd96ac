"""Effective mass of a robot at its contact point (paper, section II-C, eq. 4)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Mask, Objects
from forcemap.dynamics.cholesky import whiten
from forcemap.dynamics.drive_inertia import DriveInertia, as_drive_inertia
from forcemap.errors import InputError

# Lengths of J^T u over that of J: below the first only rounding is left; below the second, a thousandth of a degree
# in the posture changes the effective mass by more than its size.
_NO_MOTION = 1e-12
_SINGULAR = 1e-5


class MassOutcome(StrEnum):
    """What is known about an effective mass.

    `regular`: the value holds. `singular`: the posture is so near to losing this direction that no value can be given.
    `no_motion`: no joint moves the contact point in this direction; the formula would divide by zero. `unreachable`:
    the robot does not reach the place.
    """

    REGULAR = "regular"
    SINGULAR = "singular"
    NO_MOTION = "no_motion"
    UNREACHABLE = "unreachable"


# an array of them keeps the names only if it is made as one of objects
_OUTCOMES = np.array(list(MassOutcome), dtype=object)


@dataclass(frozen=True, eq=False)
class EffectiveMass:
    """Effective mass of one posture, or of many.

    Parameters
    ----------
    value : float or array
        Effective mass m_u [kg]; NaN unless regular.
    outcome : MassOutcome or object array of them
        What is known about the value.
    drive_inertia : DriveInertia or None
        The drive inertia in the value; None if the links alone are.
    """

    value: Any
    outcome: Any
    drive_inertia: DriveInertia | None

    @property
    def assumption(self) -> str:
        """What the value says about drive inertia, in words."""
        if self.drive_inertia is None:
            return "drive inertia not included: a geared robot has a larger effective mass"
        return f"drive inertia: {self.drive_inertia.source}"


def effective_mass(
    jacobian: ArrayLike,
    mass_matrix: ArrayLike,
    direction: ArrayLike,
    *,
    drive_inertia: ArrayLike | DriveInertia | None = None,
) -> EffectiveMass:
    """Effective mass m_u = 1 / (u^T J M^-1 J^T u) in a direction u (paper, eq. 4; Khatib 1995).

    Parameters
    ----------
    jacobian : array, shape (..., k, n)
        Translational Jacobian J of the contact point [m/rad] or, for a prismatic joint, 1; k is 3, or 2 in a plane.
    mass_matrix : array, shape (..., n, n)
        Joint-space mass matrix M of the links [kg m^2], [kg m] or [kg].
    direction : array, shape (..., k)
        Direction u of the impact, of any length but zero.
    drive_inertia : array, shape (n,), or DriveInertia, optional
        Inertia of the drives as seen at the joints [kg m^2] or [kg], added to the diagonal of M. Without it the links
        alone count, and the result says so.

    Raises
    ------
    InputError
        Shapes that do not belong together, a number that is not finite, a direction of length zero, a drive inertia
        below zero, a mass matrix that is not symmetric and positive definite.

    Examples
    --------
    One link of 1 m with 4 kg at its end, horizontal, hit from above; and along the link:

    >>> effective_mass([[0.0], [0.0], [1.0]], [[4.0]], [0, 0, -1]).value
    4.0
    >>> effective_mass([[0.0], [0.0], [1.0]], [[4.0]], [1, 0, 0]).outcome
    <MassOutcome.NO_MOTION: 'no_motion'>
    """
    j, m = checked_matrices(jacobian, mass_matrix)
    k, n = j.shape[-2:]
    drives = as_drive_inertia(drive_inertia, n)
    u = unit_direction(direction, k)
    try:
        shape = np.broadcast_shapes(j.shape[:-2], m.shape[:-2], u.shape[:-1])
    except ValueError:
        raise InputError(
            f"direction: found the shape {u.shape}, expected one that goes with the jacobian's, {j.shape}"
        ) from None
    value, outcome = mass_along(batch_last(j, shape, 2), batch_last(m, shape, 2), batch_last(u, shape, 1), drives)
    if shape:
        return EffectiveMass(value.reshape(shape), outcome.reshape(shape), drives)
    return EffectiveMass(float(value[0]), outcome[0], drives)


def mass_along(j: FloatArray, m: FloatArray, u: FloatArray, drives: DriveInertia | None) -> tuple[FloatArray, Objects]:
    """Values and outcomes of `effective_mass` for arrays that are known to be good, the batch on the last axis."""
    lever = (u[:, None] * j).sum(axis=0)
    mobility = (whiten(with_drives(m, drives), lever[:, None]) ** 2).sum(axis=(0, 1))
    return named_masses(np.sqrt((lever**2).sum(axis=0)), np.sqrt((j**2).sum(axis=(0, 1))), mobility)


def standard_effective_mass(moving_mass: float, payload: float = 0.0) -> float:
    """The standard's effective mass m_R = M / 2 + m_L, one figure for every posture (ISO/TS 15066:2016, A.3.4).

    Parameters
    ----------
    moving_mass : float
        Mass M of the moving parts of the robot [kg].
    payload : float
        Effective payload m_L, tool and workpiece [kg].

    Raises
    ------
    InputError
        A mass that is not positive and finite (a payload of 0 is accepted).

    Examples
    --------
    >>> standard_effective_mass(30.0)
    15.0
    """
    if not (0 < moving_mass < np.inf and 0 <= payload < np.inf):
        raise InputError(f"found M = {moving_mass:g} kg, m_L = {payload:g} kg, expected positive finite masses")
    return moving_mass / 2 + payload


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


def unreachable_as_outcome(mass: EffectiveMass, reached: Mask) -> EffectiveMass:
    """The same masses, NaN and `unreachable` where a place was not reached."""
    value = np.where(reached, mass.value, np.nan)
    outcome = np.array(mass.outcome, dtype=object)
    outcome[~reached] = MassOutcome.UNREACHABLE
    if value.ndim:
        return EffectiveMass(value, outcome, mass.drive_inertia)
    return EffectiveMass(float(value), outcome.item(), mass.drive_inertia)


def named_masses(motion: FloatArray, size: FloatArray, mobility: FloatArray) -> tuple[FloatArray, Objects]:
    """Values and outcomes from how J^T u compares with J, and the mobility u^T J M^-1 J^T u."""
    lost = motion <= _SINGULAR * size
    outcome = _OUTCOMES[lost.astype(int) + (motion <= _NO_MOTION * size)]
    return 1 / np.where(lost, np.nan, mobility), outcome


def with_drives(m: FloatArray, drives: DriveInertia | None) -> FloatArray:
    """Mass matrices (n, n, batch) with the drive inertia on their diagonals."""
    return m if drives is None else m + np.diag(drives.values)[..., None]


def batch_last(values: FloatArray, shape: tuple[int, ...], own: int) -> FloatArray:
    """Values broadcast to a shape of postures, their own axes first and the postures as one axis after them."""
    kept = values.shape[values.ndim - own :]
    return np.moveaxis(np.broadcast_to(values, (*shape, *kept)).reshape(-1, *kept), 0, -1)


def checked_matrices(jacobian: ArrayLike, mass_matrix: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Jacobians and mass matrices as arrays.

    Raises
    ------
    InputError
        Shapes that do not belong together, a number that is not finite, or a mass matrix that is not symmetric.
    """
    j = np.asarray(jacobian, dtype=np.float64)
    m = np.asarray(mass_matrix, dtype=np.float64)
    if j.ndim < 2 or j.shape[-2] not in (2, 3) or j.shape[-1] < 1:
        raise InputError(f"jacobian: found the shape {j.shape}, expected (..., 3, n), or (..., 2, n) in a plane")
    n = j.shape[-1]
    if m.ndim < 2 or m.shape[-2:] != (n, n):
        raise InputError(f"mass matrix: found the shape {m.shape}, expected (..., {n}, {n}) as the jacobian has")
    try:
        np.broadcast_shapes(j.shape[:-2], m.shape[:-2])
    except ValueError:
        raise InputError(
            f"jacobian {j.shape} and mass matrix {m.shape} are for different numbers of postures"
        ) from None
    if not (np.isfinite(j).all() and np.isfinite(m).all()):
        raise InputError("jacobian or mass matrix: found a number that is not finite, expected finite numbers")
    if not np.allclose(m, np.swapaxes(m, -1, -2), rtol=1e-6, atol=1e-9):
        raise InputError("mass matrix: found one that is not symmetric, expected a joint-space mass matrix")
    return j, m
