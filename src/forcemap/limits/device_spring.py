"""Whether a force measuring device is stiff enough for a body area: a soft spring reads the force too low.

The force of an impact grows about as the square root of the spring constant (the contact model, F = v sqrt(k mu)), and
the standard gives each body region its own: 10 N/mm for the abdomen, 75 for the hand, 150 for the forehead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from forcemap.findings import Finding, FindingKind

SOFTEST = 0.9
"""A device softer than this share of the area's spring constant confirms nothing: by the contact model it reads more
than 5 % too low, and a simulated robot that retreats or holds departs from the model by more than that."""


@dataclass(frozen=True)
class DeviceSuitability:
    """How well a device's spring suits a body area.

    Parameters
    ----------
    raised : float
        Factor on every force that was read, sqrt(k_area / k_device) where the device is slightly softer, else 1.
    refusal : Finding or None
        Why its forces confirm nothing; None if they can.
    statement : Finding or None
        How the two springs compare; None if they are not compared.
    """

    raised: float = 1.0
    refusal: Finding | None = None
    statement: Finding | None = None


def device_suitability(area: str, area_stiffness: float, device_stiffness: float) -> DeviceSuitability:
    """Compare a device's spring with that of a body area.

    Parameters
    ----------
    area : str
        Name of the area.
    area_stiffness, device_stiffness : float
        Spring constants [N/m]; NaN if that of the area is unknown, or that of the device not stated.

    Returns
    -------
    DeviceSuitability

    Examples
    --------
    >>> device_suitability("back_of_hand", 75e3, 25e3).refusal.kind.value
    'spring_too_soft'
    >>> round(device_suitability("back_of_hand", 75e3, 70e3).raised, 4)
    1.0351
    """
    raised, needed = 1.0, SOFTEST * area_stiffness
    springs = {"area": area, "area_N_per_m": area_stiffness, "device_N_per_m": device_stiffness}
    if math.isnan(area_stiffness):
        refusal = Finding.of(FindingKind.SPRING_OF_AREA_UNKNOWN, area=area)
    elif math.isnan(device_stiffness):
        refusal = Finding.of(FindingKind.SPRING_OF_DEVICE_NOT_STATED, area=area, area_N_per_m=area_stiffness)
    elif device_stiffness < needed:
        refusal = Finding.of(FindingKind.SPRING_TOO_SOFT, **springs, softest=SOFTEST, needed_N_per_m=needed)
    else:
        kind = FindingKind.SPRING_STIFFER if device_stiffness > area_stiffness else FindingKind.SPRING_MEETS
        if device_stiffness < area_stiffness:
            kind, raised = FindingKind.SPRING_SOFTER, math.sqrt(area_stiffness / device_stiffness)
        return DeviceSuitability(raised, None, Finding.of(kind, **springs, raised=raised - 1))
    return DeviceSuitability(1.0, refusal, refusal)
