"""The figures of the standard's contact model for a robot and a body region."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from forcemap.campaigns.conditions import Conditions
from forcemap.errors import InputError
from forcemap.limits.body_areas import body_region
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.limits.pfl import pfl_robot_mass, pfl_speed_limit


@dataclass(frozen=True)
class ContactModel:
    """Masses and spring of the standard's contact model.

    Parameters
    ----------
    robot_mass : float
        Effective robot mass m_R [kg].
    body_mass : float
        Effective mass of the body region [kg]; infinite: the body part is constrained.
    stiffness : float
        Spring constant of the body region [N/m].
    payload_stated : bool
        False where no payload is stated and 0 kg was taken.
    """

    robot_mass: float
    body_mass: float
    stiffness: float
    payload_stated: bool

    @property
    def figures(self) -> dict[str, Any]:
        """Masses and spring as the formulas of `limits.pfl` take them."""
        return {"robot_mass": self.robot_mass, "body_mass": self.body_mass, "stiffness": self.stiffness}

    def speed_limit(self, limit: ForceLimit, contact: Contact) -> float:
        """The speed that the model allows everywhere [m/s]; a formula, confirmed by no measurement."""
        return float(pfl_speed_limit(limit.force(contact), **self.figures))


def contact_model(
    conditions: Conditions,
    region: str,
    *,
    moving_mass: float | None = None,
    payload: float | None = None,
    constrained: bool = True,
) -> ContactModel:
    """The contact model of a campaign; a payload that is neither given nor stated counts as 0 kg.

    Parameters
    ----------
    conditions : Conditions
        What the campaign states.
    region : str
        Body area or region that is hit.
    moving_mass, payload : float, optional
        Mass of the robot's moving parts and effective payload [kg]; those that the campaign states if not given.
    constrained : bool
        True: the body part cannot move away; False: it has the region's own mass.

    Raises
    ------
    InputError
        The moving mass is neither given nor stated.
    UnknownName
        The standard has no body region of that name.
    """
    mass = conditions.moving_mass if moving_mass is None else moving_mass
    if math.isnan(mass):
        raise InputError(
            "moving mass: campaign.toml does not state robot.moving_mass_kg, which the standard's contact model needs; "
            "state it, or give --moving-mass-kg (moving_mass_kg)"
        )
    body = body_region(region)
    return ContactModel(
        robot_mass=pfl_robot_mass(mass, conditions.load if payload is None else payload),
        body_mass=math.inf if constrained else body.mass,
        stiffness=body.stiffness,
        payload_stated=payload is not None or not math.isnan(conditions.payload),
    )
