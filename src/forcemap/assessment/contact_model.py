"""The figures of the standard's contact model for a campaign and a body area."""

from __future__ import annotations

import math
from dataclasses import dataclass

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

    def speed_limit(self, limit: ForceLimit, contact: Contact) -> float:
        """The speed that the model allows everywhere [m/s]; a formula, confirmed by no measurement."""
        return float(
            pfl_speed_limit(
                limit.force(contact), robot_mass=self.robot_mass, body_mass=self.body_mass, stiffness=self.stiffness
            )
        )


def contact_model(conditions: Conditions, limit: ForceLimit) -> ContactModel:
    """The contact model of a campaign, the body part constrained; a payload that is not stated counts as 0 kg.

    Raises
    ------
    InputError
        The moving mass is not stated.
    UnknownName
        The standard has no body region of that name.
    """
    if math.isnan(conditions.moving_mass):
        raise InputError("campaign.toml does not state robot.moving_mass_kg, which the standard's contact model needs")
    stated = not math.isnan(conditions.payload)
    return ContactModel(
        robot_mass=pfl_robot_mass(conditions.moving_mass, conditions.payload if stated else 0.0),
        body_mass=math.inf,
        stiffness=body_region(limit.name).stiffness,
        payload_stated=stated,
    )
