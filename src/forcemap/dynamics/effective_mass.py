"""Effective mass of a robot at its contact point (paper, section II-C, eq. 4)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Objects
from forcemap.dynamics.rigid_body import unit_direction
from forcemap.errors import InputError

# Length of J^T u over that of J:
_NO_MOTION = 1e-12  # below it only rounding is left
SINGULAR = 1e-5  # below it a thousandth of a degree in the posture changes the effective mass by more than its size
LEAST_PIVOT = 1e-14  # share of the diagonal entry below which rounding decides the sign


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


# an array of dtype object, so that the members stay members
_OUTCOMES = np.array(list(MassOutcome), dtype=object)


@dataclass(frozen=True, eq=False)
class DriveInertia:
    """Inertia of the drives of a robot: rotor inertia times the squared gear ratio.

    Parameters
    ----------
    values : array, shape (n,)
        One per joint [kg m^2], for a prismatic joint [kg].
    source : str
        Where the figures come from.

    Raises
    ------
    InputError
        A figure that is not finite or below zero.
    """

    values: FloatArray
    source: str

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=np.float64)
        if values.ndim != 1 or not np.all((values >= 0) & (values < np.inf)):
            raise InputError(f"drive inertia: found {values}, expected one finite number of at least 0 for every joint")
        values.setflags(write=False)
        object.__setattr__(self, "values", values)


Drives = ArrayLike | DriveInertia | None
"""Inertia of the drives as callers give it."""


def as_drive_inertia(drive_inertia: Drives, joints: int) -> DriveInertia | None:
    """Drive inertia of that many joints; a bare array is "given by the user".

    Raises
    ------
    InputError
        Not one figure for every joint.
    """
    if drive_inertia is None:
        return None
    drives = drive_inertia
    if not isinstance(drives, DriveInertia):
        drives = DriveInertia(np.asarray(drives, dtype=np.float64), "given by the user")
    if drives.values.shape != (joints,):
        raise InputError(f"drive inertia: found {drives.values.size} figures for {joints} joints, expected one each")
    return drives


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
        The drive inertia included in the value; None if only the links are.
    positions : array, shape (..., n)
        Positions of the joints [rad], [m] in those postures, NaN where the place is unreachable; empty if a Jacobian
        and a mass matrix were given.
    """

    value: Any
    outcome: Any
    drive_inertia: DriveInertia | None
    positions: FloatArray = field(default_factory=lambda: np.empty(0))

    @classmethod
    def of(
        cls, value: FloatArray, outcome: Objects, drives: DriveInertia | None, positions: FloatArray | None = None
    ) -> Self:
        """From arrays; arrays without an axis become a float and an outcome."""
        of = np.empty(0) if positions is None else positions
        return cls(value, outcome, drives, of) if value.ndim else cls(float(value), outcome.item(), drives, of)

    @property
    def assumption(self) -> str:
        """What the value says about drive inertia, in words."""
        if self.drive_inertia is None:
            return "drive inertia not included: a geared robot has a larger effective mass"
        return f"drive inertia: {self.drive_inertia.source}"


def effective_mass(
    jacobian: ArrayLike, mass_matrix: ArrayLike, direction: ArrayLike, *, drive_inertia: Drives = None
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
    j, m = (np.asarray(matrices, dtype=np.float64) for matrices in (jacobian, mass_matrix))
    if j.ndim < 2 or j.shape[-2] not in (2, 3) or j.shape[-1] < 1:
        raise InputError(f"jacobian: found the shape {j.shape}, expected (..., 3, n), or (..., 2, n) in a plane")
    k, n = j.shape[-2:]
    if m.ndim < 2 or m.shape[-2:] != (n, n):
        raise InputError(f"mass matrix: found the shape {m.shape}, expected (..., {n}, {n}) as the jacobian has")
    try:
        np.broadcast_shapes(j.shape[:-2], m.shape[:-2])
    except ValueError:
        message = f"jacobian {j.shape} and mass matrix {m.shape} are for different numbers of postures"
        raise InputError(message) from None
    if not (np.isfinite(j).all() and np.isfinite(m).all()):
        raise InputError("jacobian or mass matrix: found a number that is not finite, expected finite numbers")
    if not np.allclose(m, np.swapaxes(m, -1, -2), rtol=1e-6, atol=1e-9):
        raise InputError("mass matrix: found one that is not symmetric, expected a joint-space mass matrix")
    drives = as_drive_inertia(drive_inertia, n)
    u = unit_direction(direction, k)
    try:
        np.broadcast_shapes(j.shape[:-2], m.shape[:-2], u.shape[:-1])
    except ValueError:
        message = f"direction: found the shape {u.shape}, expected one that goes with the jacobian's, {j.shape}"
        raise InputError(message) from None
    return mass_along(j, m, u, drives)


def mass_along(j: FloatArray, m: FloatArray, u: FloatArray, drives: DriveInertia | None) -> EffectiveMass:
    """`effective_mass` without its checks, for arrays that have passed them."""
    lever = np.einsum("...k,...kn->...n", u, j)
    half = _whitened(m if drives is None else m + np.diag(drives.values), lever)
    motion, size = np.linalg.norm(lever, axis=-1), np.sqrt(np.square(j).sum(axis=(-2, -1)))
    lost = np.broadcast_to(motion <= SINGULAR * size, half.shape[:-1])
    outcome = np.asarray(_OUTCOMES[lost.astype(int) + (motion <= _NO_MOTION * size)], dtype=object)
    value = np.asarray(1 / np.where(lost, np.nan, np.square(half).sum(axis=-1)))
    return EffectiveMass.of(value, outcome, drives)


def _whitened(matrix: FloatArray, lever: FloatArray) -> FloatArray:
    """L^-1 v for matrix = L L^T, so that v^T matrix^-1 v is the product of the result with itself."""
    factor = _factor(matrix)
    if factor is not None:
        return np.asarray(np.linalg.solve(factor, lever[..., None])[..., 0])
    n = matrix.shape[-1]
    joint = next(i for i in range(1, n + 1) if _factor(matrix[..., :i, :i]) is None)
    raise InputError(
        f"mass matrix: joint {joint} of {n} moves no inertia of its own, expected a positive definite matrix; "
        "give its link a mass and an inertia, or the joint a drive inertia"
    )


def _factor(matrix: FloatArray) -> FloatArray | None:
    """L of matrix = L L^T; None if one is not positive definite beyond rounding."""
    try:
        factor = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return None
    pivot, entry = (np.diagonal(matrices, axis1=-2, axis2=-1) for matrices in (factor, matrix))
    return np.asarray(factor) if np.all(np.square(pivot) > LEAST_PIVOT * entry) else None


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
