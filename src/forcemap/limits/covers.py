"""What a protective cover or another payload may change: an estimate for planning, never a permission.

The contact model stores the energy mu v^2 / 2 in the spring of the body part and in the cover, in series. With the
force limit F, the body's spring constant k, the cover's k_c and its compressible thickness d_c

    v_max = sqrt{ [F^2 / k + min(F^2 / k_c, k_c d_c^2)] / mu },  mu = (1 / m_R + 1 / m_H)^-1

The second branch is a cover that bottoms out: it then absorbs no more energy. Energy form after Svarny et
al. 2022, Effect of active and passive protective soft skins on collision forces in human-robot collaboration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from forcemap.errors import InputError
from forcemap.limits.pfl import pfl_robot_mass, pfl_speed_limit

ESTIMATE = (
    "MODEL ESTIMATE to plan with: nothing of it was measured, and no speed may be driven because of it; measure again "
    "with the cover or payload"
)
"""Stated with every figure of this file."""

# Outside these a figure is in another unit.
_LEAST_STIFFNESS = 100.0  # [N/m]; a cover of 0.1 N/mm resists nothing
_LARGEST_THICKNESS = 0.2  # [m]


@dataclass(frozen=True)
class Cover:
    """A protective cover: a spring that can be compressed so far and no farther.

    Parameters
    ----------
    stiffness : float
        Spring constant k_c [N/m], at least 100.
    thickness : float
        Thickness d_c by which it can be compressed [m], at most 0.2.

    Raises
    ------
    InputError
        A figure outside its range.
    """

    stiffness: float
    thickness: float

    def __post_init__(self) -> None:
        if not _LEAST_STIFFNESS <= self.stiffness < math.inf:
            least = f"at least {_LEAST_STIFFNESS:g} and finite"
            raise InputError(f"cover stiffness: found {self.stiffness:g}, expected N/m, {least}")
        if not 0 <= self.thickness <= _LARGEST_THICKNESS:
            expected = f"metres, from 0 to {_LARGEST_THICKNESS:g}"
            raise InputError(f"cover thickness: found {self.thickness:g}, expected {expected}")

    def absorbed(self, force: float) -> float:
        """Twice the energy [J] that it holds at a force [N]."""
        return min(force**2 / self.stiffness, self.stiffness * self.thickness**2)

    def bottoms_out(self, force: float) -> bool:
        """True if it is compressed fully before the force [N] is reached."""
        return force / self.stiffness > self.thickness

    def force(self, energy: float, stiffness: float) -> float:
        """Force [N] at which it and a body's spring [N/m] in series hold twice an energy [J]."""
        whole = math.sqrt(energy / (1 / stiffness + 1 / self.stiffness))
        if not self.bottoms_out(whole):
            return whole
        return math.sqrt(stiffness * (energy - self.stiffness * self.thickness**2))


@dataclass(frozen=True)
class Estimate:
    """What the contact model expects of a change.

    Parameters
    ----------
    speed_before, speed_after : float
        Speed limits of the contact model before and after the change [m/s].
    bottoms_out : bool
        True if the cover is compressed fully before the force limit is reached.
    statement : str
        That it is an estimate.
    """

    speed_before: float
    speed_after: float
    bottoms_out: bool = False
    statement: str = ESTIMATE

    @property
    def ratio(self) -> float:
        """Speed after over speed before."""
        return self.speed_after / self.speed_before


def cover_estimate(
    max_force: float,
    *,
    robot_mass: float,
    body_mass: float,
    stiffness: float,
    cover_stiffness: float,
    cover_thickness: float,
) -> Estimate:
    """What the contact model expects of a protective cover.

    Parameters
    ----------
    max_force : float
        Force limit F [N].
    robot_mass, body_mass, stiffness : float
        As in `pfl_speed_limit` [kg], [kg], [N/m].
    cover_stiffness : float
        Spring constant k_c of the cover [N/m].
    cover_thickness : float
        Thickness d_c by which the cover can be compressed [m], at most 0.2.

    Returns
    -------
    Estimate

    Raises
    ------
    InputError
        A figure outside its range.

    Examples
    --------
    >>> estimate = cover_estimate(
    ...     140.0, robot_mass=15.0, body_mass=math.inf, stiffness=75e3, cover_stiffness=20e3, cover_thickness=0.02
    ... )
    >>> round(estimate.speed_before, 4), round(estimate.speed_after, 4), estimate.bottoms_out
    (0.132, 0.2877, False)
    """
    before = float(pfl_speed_limit(max_force, robot_mass=robot_mass, body_mass=body_mass, stiffness=stiffness))
    cover = Cover(cover_stiffness, cover_thickness)
    gain = cover.absorbed(max_force) * stiffness / max_force**2
    return Estimate(before, before * math.sqrt(1 + gain), cover.bottoms_out(max_force))


def payload_estimate(
    max_force: float, *, moving_mass: float, payload: float, new_payload: float, body_mass: float, stiffness: float
) -> Estimate:
    """What the contact model expects of another payload.

    Parameters
    ----------
    max_force : float
        Force limit [N].
    moving_mass : float
        Total mass M of the moving parts of the robot [kg].
    payload, new_payload : float
        Effective payload m_L before and after [kg].
    body_mass, stiffness : float
        As in `pfl_speed_limit` [kg], [N/m].

    Returns
    -------
    Estimate

    Raises
    ------
    InputError
        A figure outside its range.
    """
    masses = [pfl_robot_mass(moving_mass, load) for load in (payload, new_payload)]
    spring = {"body_mass": body_mass, "stiffness": stiffness}
    before, after = (float(pfl_speed_limit(max_force, robot_mass=mass, **spring)) for mass in masses)
    return Estimate(before, after)
