"""Whether a force measuring device is stiff enough for a body area: a soft spring reads a hard area's force too low.

The force of an impact grows about as the square root of the spring constant (the contact model, F = v sqrt(k mu)), and
the standard gives each body region its own: 10 N/mm for the abdomen, 75 for the hand, 150 for the forehead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SOFTEST = 0.9
"""A device softer than this share of the area's spring constant confirms nothing: by the contact model it reads more
than 5 % too low, and a simulated robot that retreats or holds departs from the model by more than that."""


DEVICE_ALONE = (
    "LIMIT FOR THE DEVICE ALONE, not for a body part: state the spring of the part that it is meant for "
    "(--limit-spring-N-per-mm, spring_N_per_m=); until then nothing is exported"
)
"""What every answer says first of a limit in newtons without a spring."""


@dataclass(frozen=True)
class DeviceSuitability:
    """What a device's spring is worth for a body area.

    Parameters
    ----------
    raised : float
        Factor on every force that was read, sqrt(k_area / k_device) where the device is slightly softer, else 1.
    refusal : str
        Why its forces confirm nothing; empty if they do.
    statement : str
        The two springs, a line for the assumptions.
    """

    raised: float
    refusal: str
    statement: str


def device_suitability(area: str, area_stiffness: float, device_stiffness: float) -> DeviceSuitability:
    """Compare a device's spring with that of a body area.

    Parameters
    ----------
    area : str
        What the area is called.
    area_stiffness, device_stiffness : float
        Spring constants [N/m]; NaN if not known, not stated.

    Returns
    -------
    DeviceSuitability

    Examples
    --------
    >>> device_suitability("back_of_hand", 75e3, 25e3).refusal.partition("; ")[2]
    'measure with 67.5 N/mm or more'
    >>> round(device_suitability("back_of_hand", 75e3, 70e3).raised, 4)
    1.0351
    """
    if math.isnan(area_stiffness):
        refusal = (
            f"the spring constant of {area} is not known, so nothing tells whether the device suits it; name a body "
            "region of the standard in the table of limits"
        )
        return DeviceSuitability(1.0, refusal, refusal)
    wanted = f"the {area_stiffness / 1000:g} N/mm of {area}"
    if math.isnan(device_stiffness):
        refusal = (
            f"the spring of the measuring device is not stated, and {wanted} need one about as stiff; state "
            "device.stiffness_N_per_m in campaign.toml, or --device-spring-N-per-mm (device_stiffness= in Python)"
        )
        return DeviceSuitability(1.0, refusal, refusal)
    device = f"the device's spring of {device_stiffness / 1000:g} N/mm"
    if device_stiffness < SOFTEST * area_stiffness:
        refusal = f"{device} is softer than {SOFTEST:g} of {wanted}, so its forces read too low; measure with "
        refusal += f"{SOFTEST * area_stiffness / 1000:g} N/mm or more"
        return DeviceSuitability(1.0, refusal, refusal)
    if device_stiffness < area_stiffness:
        raised = math.sqrt(area_stiffness / device_stiffness)
        statement = f"{device} is softer than {wanted}: forces raised by {100 * (raised - 1):.1f} %"
        return DeviceSuitability(raised, "", statement)
    compared = "is stiffer than" if device_stiffness > area_stiffness else "meets"
    return DeviceSuitability(1.0, "", f"{device} {compared} {wanted}")
