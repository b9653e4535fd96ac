"""The paper's planar arm: three links in a vertical plane (section II-C, figure 3), its inspection points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.dynamics.effective_mass import standard_effective_mass
from forcemap.dynamics.inverse_kinematics import Reach, reach_outcomes
from forcemap.errors import InputError

# Nine places "on a grid resembling" the paper's: smallest, middle and largest distance and height of the UR10e [m].
INSPECTION_DISTANCES = (0.52, 0.70, 0.89)
INSPECTION_HEIGHTS = (0.14, 0.30, 0.46)

_ROUNDING = 1e-12  # of the cosine of the elbow's angle: a stretched arm is not too short


class LinkMass(StrEnum):
    """Where the mass of a link is: a point at its far end, a point at its middle, or spread along it as in a rod."""

    POINT_AT_END = "point_at_end"
    POINT_AT_MIDDLE = "point_at_middle"
    UNIFORM_ROD = "uniform_rod"


class Wrist(StrEnum):
    """Whether the last joint gives way in an impact, or is held as if it were fixed."""

    FREE = "free"
    LOCKED = "locked"


_FREE_JOINTS = {Wrist.FREE: 3, Wrist.LOCKED: 2}


class Elbow(StrEnum):
    """On which side of the line from shoulder to wrist the elbow is."""

    UP = "up"
    DOWN = "down"


@dataclass(frozen=True)
class LastLink:
    """Orientation of the last link: an angle above the horizontal, or in line with the link before it.

    Parameters
    ----------
    angle : float
        Angle above the horizontal [rad]; NaN means aligned with the link before.
    """

    angle: float

    def __str__(self) -> str:
        names = {0.0: "horizontal", -math.pi / 2: "down"}
        return "aligned" if math.isnan(self.angle) else names.get(self.angle, f"{math.degrees(self.angle):g} deg")


LINK_DOWN = LastLink(-math.pi / 2)
LINK_HORIZONTAL = LastLink(0.0)
LINK_ALIGNED = LastLink(math.nan)


@dataclass(frozen=True, kw_only=True)
class PlanarArm:
    """A planar arm of three links; what the paper does not state has no default.

    Parameters
    ----------
    link_mass : LinkMass
        Where the mass of a link is.
    last_link : LastLink
        Orientation of the last link.
    wrist : Wrist
        Whether the last joint gives way.
    base_height : float
        Height of the shoulder above the base [m].
    elbow : Elbow
        Side of the elbow; the paper's is up.
    lengths, masses : tuple of float
        Lengths [m] and masses [kg] from the shoulder outwards; the paper's if not given.

    Raises
    ------
    InputError
        A text where one of the named kinds belongs; not three lengths and masses, positive and finite; a base height
        or angle that is not finite.
    """

    link_mass: LinkMass
    last_link: LastLink
    wrist: Wrist
    base_height: float
    elbow: Elbow = Elbow.UP
    # the paper's arm, "inspired by the UR10e": upper arm, forearm, last link
    lengths: tuple[float, ...] = (0.5, 0.45, 0.05)
    masses: tuple[float, ...] = (13.0, 4.0, 4.0)

    def __post_init__(self) -> None:
        for name, kind in (("link_mass", LinkMass), ("wrist", Wrist), ("elbow", Elbow), ("last_link", LastLink)):
            if not isinstance(value := getattr(self, name), kind):
                raise InputError(f"planar arm: found {name} {value!r}, expected a {kind.__name__}")
        for what, values, unit in (("lengths", self.lengths, "m"), ("masses", self.masses, "kg")):
            if len(values) != 3 or not all(0 < value < math.inf for value in values):
                raise InputError(f"planar arm: found the {what} {values}, expected three positive numbers in {unit}")
        if not math.isfinite(self.base_height) or math.isinf(self.last_link.angle):
            raise InputError("planar arm: found a base height or an angle that is not finite, expected m and rad")

    @property
    def standard_effective_mass(self) -> float:
        """The standard's effective mass m_R = M / 2 [kg]."""
        return standard_effective_mass(sum(self.masses))


SHOULDER = 0.18
"""Height of the arm's base, which the paper does not state: that of the UR10e [m]."""


def papers_arms() -> dict[str, PlanarArm]:
    """The readings of the paper's arm by name: what it leaves open is the last link's orientation and its joint.

    Each with links like rods, and its shoulder as high above the base as that of the UR10e.
    """
    return {
        f"last link {link}, wrist {wrist}": PlanarArm(
            link_mass=LinkMass.UNIFORM_ROD, last_link=link, wrist=wrist, base_height=SHOULDER
        )
        for link in (LINK_ALIGNED, LINK_HORIZONTAL, LINK_DOWN)
        for wrist in Wrist
    }


def planar_contact_point(arm: PlanarArm, positions: ArrayLike) -> FloatArray:
    """The end of the last link, shape (..., 2): distance and height [m].

    Parameters
    ----------
    arm : PlanarArm
        The arm.
    positions : array, shape (..., 3)
        Angle of the first link above the horizontal, and of each further link to the one before [rad].

    Raises
    ------
    InputError
        Not three finite numbers.
    """
    angles = _angles(positions)
    along = np.stack([np.cos(angles), np.sin(angles)], axis=-2) @ np.array(arm.lengths)
    return np.asarray(along + np.array([0.0, arm.base_height]))


def planar_jacobian(arm: PlanarArm, positions: ArrayLike) -> FloatArray:
    """Jacobian of the end of the last link, shape (..., 2, n) [m/rad]; n is 3, or 2 with the wrist locked.

    Parameters
    ----------
    arm : PlanarArm
        The arm.
    positions : array, shape (..., 3)
        As for `planar_contact_point`.

    Raises
    ------
    InputError
        Not three finite numbers.
    """
    return _point_rates(_angles(positions), arm.lengths)[..., : _FREE_JOINTS[arm.wrist]]


def planar_mass_matrix(arm: PlanarArm, positions: ArrayLike) -> FloatArray:
    """Joint-space mass matrix, shape (..., n, n) [kg m^2]; n is 3, or 2 with the wrist locked.

    Parameters
    ----------
    arm : PlanarArm
        The arm.
    positions : array, shape (..., 3)
        As for `planar_contact_point`.

    Raises
    ------
    InputError
        Not three finite numbers.
    """
    angles = _angles(positions)
    place = 1.0 if arm.link_mass is LinkMass.POINT_AT_END else 0.5
    matrix = np.zeros((*angles.shape[:-1], 3, 3))
    for i, (length, mass) in enumerate(zip(arm.lengths, arm.masses, strict=True)):
        rates = _point_rates(angles, [*arm.lengths[:i], place * length, *[0.0] * (2 - i)])
        turning = np.arange(3) <= i  # the joints that turn link i
        inertia = mass * length**2 / 12 if arm.link_mass is LinkMass.UNIFORM_ROD else 0.0
        matrix += mass * np.swapaxes(rates, -1, -2) @ rates + inertia * np.outer(turning, turning)
    n = _FREE_JOINTS[arm.wrist]
    return matrix[..., :n, :n]


def planar_inverse_kinematics(arm: PlanarArm, distance: ArrayLike, height: ArrayLike) -> Reach:
    """Joint angles that bring the end of the last link to a place; here `unreachable` is exact, and no error is given.

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
    return Reach(q, reach_outcomes(np.asarray(reached)))


def _point_rates(angles: FloatArray, lengths: ArrayLike) -> FloatArray:
    """Jacobian of a point that is reached along the links by these lengths, shape (..., 2, 3)."""
    steps = np.stack([-np.sin(angles), np.cos(angles)], axis=-2) * np.asarray(lengths)
    return np.asarray(np.cumsum(steps[..., ::-1], axis=-1)[..., ::-1])


def _angles(positions: ArrayLike) -> FloatArray:
    """Angles of the links above the horizontal [rad]."""
    q = np.asarray(positions, dtype=np.float64)
    if q.ndim < 1 or q.shape[-1] != 3 or not np.isfinite(q).all():
        raise InputError(f"joint positions: found the shape {q.shape} or no finite numbers, expected (..., 3) in rad")
    return np.cumsum(q, axis=-1)
