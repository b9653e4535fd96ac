"""The standard's one speed beside a map's safe speeds: where it is too fast, and where the map permits more."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from forcemap.campaigns.conditions import Conditions
from forcemap.comparisons.contact_model import contact_model
from forcemap.errors import InputError
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.maps.force_map import ForceMap
from forcemap.speeds.safe_speed import SpeedOutcome
from forcemap.speeds.speed_map import SpeedMap


@dataclass(frozen=True)
class BesideStandard:
    """The standard's one speed, at contact, beside those of a map on a grid.

    Parameters
    ----------
    speed : float
        What the standard's contact model allows everywhere [m/s].
    places, faster : int
        Places of the grid within the measured range, and of these where the map permits more than that speed and has
        a speed to program.
    fastest : float
        The highest speed at contact of a place with a speed to program [m/s]; NaN if there is none.
    fastest_to_program : float
        The highest speed to program [m/s], unrounded; NaN if there is none.
    lowest_predicted, highest_predicted : float
        Forces that the map predicts at that speed where it was measured so fast [N]; NaN where it was nowhere.
    moving_mass, payload : float
        What the model reckons with [kg]; a payload of NaN is not stated, and counts as 0.
    """

    speed: float
    places: int
    faster: int
    fastest: float
    fastest_to_program: float
    lowest_predicted: float
    highest_predicted: float
    moving_mass: float
    payload: float


def beside_standard(force_map: ForceMap, speeds: SpeedMap) -> BesideStandard | None:
    """The standard's speed beside a speed map; None where it has none: newtons, the head, no moving mass stated."""
    result = speeds.speeds
    standard = standard_speed(force_map.conditions, [(result.basis.limit, result.basis.contact)])
    if math.isnan(standard):
        return None
    inside = np.asarray(result.outcome) != SpeedOutcome.OUTSIDE
    measured = inside & (result.lowest_measured_speed <= standard) & (standard <= result.highest_measured_speed)
    distance, height = (axis[measured] for axis in np.meshgrid(speeds.distance, speeds.height, indexing="ij"))
    forces = force_map.predict(distance, height, standard)
    usable = result.speed[~np.isnan(result.speed_to_program)]
    return BesideStandard(
        speed=standard,
        places=int(inside.sum()),
        faster=int((usable > standard).sum()),
        fastest=float(usable.max()) if usable.size else math.nan,
        fastest_to_program=float(np.nanmax(result.speed_to_program)) if usable.size else math.nan,
        lowest_predicted=float(forces.min()) if forces.size else math.nan,
        highest_predicted=float(forces.max()) if forces.size else math.nan,
        moving_mass=force_map.conditions.moving_mass,
        payload=force_map.conditions.payload,
    )


def standard_speed(conditions: Conditions, limits: Iterable[tuple[object, Contact | None]]) -> float:
    """The lowest speed of the standard's contact model for limits of a campaign, at contact [m/s]; NaN if one has none.

    `conditions` are those that the campaign was measured under; each limit is one of a body area with its contact.
    """
    return min((_standard_speed(conditions, limit, contact) for limit, contact in limits), key=lambda v: (v >= 0, v))


def _standard_speed(conditions: Conditions, limit: object, contact: Contact | None) -> float:
    if isinstance(limit, ForceLimit) and limit.permitted and isinstance(contact, Contact):
        with contextlib.suppress(InputError):  # no moving mass, or a region that is not the standard's
            return contact_model(conditions, limit.name).speed_limit(limit, contact)
    return math.nan
