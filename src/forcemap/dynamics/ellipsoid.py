"""The ellipsoid of effective mass: its axes, and the mean over all directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Objects
from forcemap.dynamics.cholesky import whiten
from forcemap.dynamics.drive_inertia import DriveInertia, as_drive_inertia
from forcemap.dynamics.effective_mass import (
    EffectiveMass,
    MassOutcome,
    batch_last,
    checked_matrices,
    named_masses,
    with_drives,
)


@dataclass(frozen=True, eq=False)
class PrincipalMasses:
    """Axes of the ellipsoid of effective mass.

    Parameters
    ----------
    value : array, shape (..., k)
        Principal effective masses [kg], ascending; NaN unless regular.
    direction : array, shape (..., k, k)
        Unit vectors; direction[..., i, :] belongs to value[..., i].
    outcome : object array of MassOutcome, shape (..., k)
        What is known about each value.
    drive_inertia : DriveInertia or None
        The drive inertia in the values; None if the links alone are.
    """

    value: FloatArray
    direction: FloatArray
    outcome: Objects
    drive_inertia: DriveInertia | None


def principal_effective_masses(
    jacobian: ArrayLike, mass_matrix: ArrayLike, *, drive_inertia: ArrayLike | DriveInertia | None = None
) -> PrincipalMasses:
    """Axes of the ellipsoid of effective mass: the eigenvectors of J M^-1 J^T, one over its eigenvalues.

    Parameters
    ----------
    jacobian : array, shape (..., k, n)
        Translational Jacobian of the contact point [m/rad], as for `effective_mass`.
    mass_matrix : array, shape (..., n, n)
        Joint-space mass matrix of the links [kg m^2].
    drive_inertia : array, shape (n,), or DriveInertia, optional
        Inertia of the drives as seen at the joints [kg m^2].

    Raises
    ------
    InputError
        As for `effective_mass`.

    Examples
    --------
    >>> principal_effective_masses([[1.0, 0.0], [0.0, 1.0]], [[2.0, 0.0], [0.0, 5.0]]).value
    array([2., 5.])
    """
    j, m = checked_matrices(jacobian, mass_matrix)
    k, n = j.shape[-2:]
    drives = as_drive_inertia(drive_inertia, n)
    shape = np.broadcast_shapes(j.shape[:-2], m.shape[:-2])
    half = whiten(with_drives(batch_last(m, shape, 2), drives), np.swapaxes(batch_last(j, shape, 2), 0, 1))
    half = np.moveaxis(half, -1, 0).reshape(*shape, n, k)
    # the axes are right singular vectors of L^-1 J^T: squaring it first would lose half of the digits
    _, singular_values, directions = np.linalg.svd(half, full_matrices=True)
    mobility = np.zeros((*shape, k))
    mobility[..., : singular_values.shape[-1]] = singular_values**2
    motion = np.linalg.norm(np.einsum("...kn,...ik->...in", j, directions), axis=-1)
    size = np.broadcast_to(np.linalg.norm(j, axis=(-2, -1))[..., None], motion.shape)
    value, outcome = named_masses(motion, size, mobility)
    return PrincipalMasses(value, directions, outcome, drives)


def mean_effective_mass(
    jacobian: ArrayLike, mass_matrix: ArrayLike, *, drive_inertia: ArrayLike | DriveInertia | None = None
) -> EffectiveMass:
    """Mean of the effective mass over all directions of space, or of the plane for k = 2.

    With the principal effective masses a, b, c it is Carlson's integral R_F(1/(bc), 1/(ca), 1/(ab)) in space
    and sqrt(ab) in the plane. It is singular, with the value NaN, where one axis is.

    Parameters
    ----------
    jacobian : array, shape (..., k, n)
        Translational Jacobian of the contact point [m/rad], as for `effective_mass`.
    mass_matrix : array, shape (..., n, n)
        Joint-space mass matrix of the links [kg m^2].
    drive_inertia : array, shape (n,), or DriveInertia, optional
        Inertia of the drives as seen at the joints [kg m^2].

    Raises
    ------
    InputError
        As for `effective_mass`.

    Examples
    --------
    >>> mean_effective_mass([[1.0, 0.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, 16.0]]).value
    4.0
    """
    axes = principal_effective_masses(jacobian, mass_matrix, drive_inertia=drive_inertia)
    if axes.value.shape[-1] == 2:
        value = np.sqrt(axes.value[..., 0] * axes.value[..., 1])
    else:
        from scipy.special import elliprf

        a, b, c = np.moveaxis(1 / axes.value, -1, 0)
        value = elliprf(b * c, c * a, a * b)
    names = np.array([MassOutcome.REGULAR, MassOutcome.SINGULAR], dtype=object)
    outcome = names[np.isnan(value).astype(int)]
    if np.ndim(value):
        return EffectiveMass(value, outcome, axes.drive_inertia)
    return EffectiveMass(float(value), outcome, axes.drive_inertia)
