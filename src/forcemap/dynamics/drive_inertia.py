"""Inertia of the drives, as seen at the joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.errors import InputError


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


def as_drive_inertia(drive_inertia: ArrayLike | DriveInertia | None, joints: int) -> DriveInertia | None:
    """Drive inertia of that many joints; a bare array is "given by the user".

    Raises
    ------
    InputError
        Not one figure for every joint.
    """
    if drive_inertia is None:
        return None
    drives = drive_inertia if isinstance(drive_inertia, DriveInertia) else _given(drive_inertia)
    if drives.values.shape != (joints,):
        raise InputError(f"drive inertia: found {drives.values.size} figures for {joints} joints, expected one each")
    return drives


def _given(values: ArrayLike) -> DriveInertia:
    return DriveInertia(np.asarray(values, dtype=np.float64), "given by the user")
