"""The planar arm at places: analytic inverse kinematics, effective mass, the nine inspection points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.dynamics.drive_inertia import DriveInertia
from forcemap.dynamics.effective_mass import EffectiveMass, effective_mass, unreachable_as_outcome
from forcemap.dynamics.inverse_kinematics import ReachOutcome, reach_outcomes
from forcemap.dynamics.planar_arm import Elbow, PlanarArm, planar_jacobian, planar_mass_matrix
from forcemap.errors import InputError

PLANAR_DOWN = (0.0, -1.0)

# Nine places "on a grid resembling" the paper's: smallest, middle and largest distance and height of the UR10e [m].
INSPECTION_DISTANCES = (0.52, 0.70, 0.89)
INSPECTION_HEIGHTS = (0.14, 0.30, 0.46)

_ROUNDING = 1e-12  # by which a stretched arm may seem too short


@dataclass(frozen=True, eq=False)
class PlanarReach:
    """Postures of a planar arm at places.

    Parameters
    ----------
    positions : array, shape (..., 3)
        Angles of the joints [rad]; NaN where the place is unreachable.
    outcome : ReachOutcome or object array of them
        Whether the place is reached; here `unreachable` is exact.
    """

    positions: FloatArray
    outcome: Any


def planar_inverse_kinematics(arm: PlanarArm, distance: ArrayLike, height: ArrayLike) -> PlanarReach:
    """Joint angles that bring the end of the last link to a place.

    Parameters
    ----------
    arm : PlanarArm
        The arm; its elbow and last link choose the posture.
    distance, height : float or array
        Distance d from the base and height h above it [m].

    Raises
    ------
    InputError
        A place that is not finite.

    Examples
    --------
    The paper's arm is 1.0 m long, and from a base at height 0 this place is 1.002 m away:

    >>> from forcemap.dynamics.planar_arm import LINK_ALIGNED, LinkMass, PlanarArm, Wrist
    >>> arm = PlanarArm(link_mass=LinkMass.UNIFORM_ROD, last_link=LINK_ALIGNED, wrist=Wrist.FREE, base_height=0.0)
    >>> planar_inverse_kinematics(arm, 0.89, 0.46).outcome
    <ReachOutcome.UNREACHABLE: 'unreachable'>
    """
    d, h = np.broadcast_arrays(np.asarray(distance, dtype=np.float64), np.asarray(height, dtype=np.float64))
    if not (np.isfinite(d).all() and np.isfinite(h).all()):
        raise InputError("distance or height: found a number that is not finite, expected m")
    l1, l2, l3 = arm.lengths
    phi = arm.last_link.angle
    x, z = d, h - arm.base_height
    if math.isnan(phi):
        l2 += l3  # aligned: two links, the second one longer
    else:
        x, z = x - l3 * math.cos(phi), z - l3 * math.sin(phi)
    cosine = (x**2 + z**2 - l1**2 - l2**2) / (2 * l1 * l2)
    reached = np.abs(cosine) <= 1 + _ROUNDING
    bend = np.arccos(np.clip(cosine, -1.0, 1.0)) * (-1 if arm.elbow is Elbow.UP else 1)
    first = np.arctan2(z, x) - np.arctan2(l2 * np.sin(bend), l1 + l2 * np.cos(bend))
    last = np.zeros_like(bend) if math.isnan(phi) else phi - first - bend
    q = np.where(reached[..., None], np.stack([first, bend, last], axis=-1), np.nan)
    return PlanarReach(q, reach_outcomes(np.asarray(reached)))


def planar_effective_mass_at(
    arm: PlanarArm,
    distance: ArrayLike,
    height: ArrayLike,
    *,
    direction: ArrayLike = PLANAR_DOWN,
    drive_inertia: ArrayLike | DriveInertia | None = None,
) -> EffectiveMass:
    """Effective mass of a planar arm with its end at distance d and height h; unreachable places are named.

    Parameters
    ----------
    arm : PlanarArm
        The arm.
    distance, height : float or array
        Distance d from the base and height h above it [m].
    direction : array, shape (2,)
        Direction of the impact, outwards and upwards; down if not given, as in the paper.
    drive_inertia : array, shape (n,), or DriveInertia, optional
        Inertia of the drives [kg m^2]; n is 3, or 2 with the wrist locked.

    Raises
    ------
    InputError
        A place or a direction that is not finite, or not one drive inertia for every joint.
    """
    reach = planar_inverse_kinematics(arm, distance, height)
    reached = np.asarray(reach.outcome == ReachOutcome.REACHED)
    q = np.where(reached[..., None], reach.positions, 0.5)  # any posture will do where there is none
    mass = effective_mass(planar_jacobian(arm, q), planar_mass_matrix(arm, q), direction, drive_inertia=drive_inertia)
    return unreachable_as_outcome(mass, reached)
