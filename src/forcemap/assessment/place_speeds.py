"""Safe speeds of one body area and kind of contact, what the standard's formula says beside, and what to measure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from forcemap.assessment.contact_model import ContactModel
from forcemap.assessment.missing import Missing, attempt
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.maps.bounds import Bound, ToleranceBound
from forcemap.maps.force_map import ForceMap
from forcemap.planning.next.measurements import NextMeasurements, next_measurements
from forcemap.speeds.safe_speed import SpeedOutcome
from forcemap.speeds.speed_map import SpeedMap, measured_grid, speed_map


@dataclass(frozen=True)
class OpenPlaces:
    """Places without a confirmed speed, for one reason.

    Parameters
    ----------
    reason : str
        Why, in words.
    places : tuple of (float, float)
        Their distances and heights [m].
    """

    reason: str
    places: tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class PlaceSpeeds:
    """Safe speeds for one limit and kind of contact.

    Parameters
    ----------
    limit : ForceLimit
        The limits of the body area.
    contact : Contact
        Kind of contact.
    speeds : SpeedMap or Missing
        Safe speeds on a grid.
    open_places : tuple of OpenPlaces
        Places inside the measured range without a confirmed speed.
    standard_speed : float
        What the standard's contact model allows everywhere, the body part constrained [m/s]; a formula, confirmed by no
        measurement. NaN where contact is not permitted or the moving mass is not stated.
    measure_next : NextMeasurements or Missing
        What to measure next for this limit.
    """

    limit: ForceLimit
    contact: Contact
    speeds: SpeedMap | Missing
    open_places: tuple[OpenPlaces, ...]
    standard_speed: float
    measure_next: NextMeasurements | Missing

    @property
    def confirmed(self) -> int:
        """Number of places with a confirmed speed."""
        return 0 if isinstance(self.speeds, Missing) else int(np.sum(~np.isnan(self.speeds.speeds.speed)))

    @property
    def slowest(self) -> float:
        """Lowest of the confirmed speeds [m/s]: what holds at all confirmed places; NaN if there is none."""
        if isinstance(self.speeds, Missing) or not self.confirmed:
            return math.nan
        return float(np.nanmin(self.speeds.speeds.speed))

    @property
    def fastest(self) -> float:
        """Highest of the confirmed speeds [m/s]; NaN if there is none."""
        if isinstance(self.speeds, Missing) or not self.confirmed:
            return math.nan
        return float(np.nanmax(self.speeds.speeds.speed))


def place_speeds(
    limit: ForceLimit,
    contact: Contact,
    *,
    force_map: ForceMap | Missing,
    bound: Bound | Missing,
    measured: ImpactDataset | Conditions,
    plan: MeasurementPlan | None,
    model: ContactModel | Missing,
    step: float,
) -> PlaceSpeeds:
    """Safe speeds on a grid `step` [m] apart, and what to measure next; each is missing where it cannot be had.

    Parameters
    ----------
    limit : ForceLimit
    contact : Contact
    force_map : ForceMap or Missing
    bound : Bound or Missing
    measured : ImpactDataset or Conditions
        What the next measurements go on from.
    plan : MeasurementPlan or None
        Tells the range of places where nothing was measured yet.
    model : ContactModel or Missing
        The standard's contact model.
    step : float
        Distance between places [m].
    """
    if not limit.permitted:
        why = Missing(f"NOT PERMITTED: the standard permits no contact with {limit.name}, at no speed")
        return PlaceSpeeds(limit, contact, why, (), math.nan, why)
    speeds = attempt(lambda: _speeds(limit, contact, force_map, bound, step))
    tolerance = bound if isinstance(bound, ToleranceBound) else ToleranceBound(device_error=_error(measured))
    ranges: dict[str, Any] = {}
    if plan is not None and not (isinstance(measured, ImpactDataset) and len(measured.train)):
        ranges = {
            "distances": (float(plan.distance.min()), float(plan.distance.max())),
            "heights": (float(plan.height.min()), float(plan.height.max())),
        }
    return PlaceSpeeds(
        limit=limit,
        contact=contact,
        speeds=speeds,
        open_places=() if isinstance(speeds, Missing) else _open_places(speeds),
        standard_speed=math.nan if isinstance(model, Missing) else model.speed_limit(limit, contact),
        measure_next=attempt(lambda: next_measurements(measured, limit, contact=contact, bound=tolerance, **ranges)),
    )


def _speeds(
    limit: ForceLimit, contact: Contact, force_map: ForceMap | Missing, bound: Bound | Missing, step: float
) -> SpeedMap | Missing:
    for part in (force_map, bound):
        if isinstance(part, Missing):
            return part
    assert isinstance(force_map, ForceMap)
    assert not isinstance(bound, Missing)
    distance, height = measured_grid(force_map, step)
    return speed_map(force_map, distance, height, limit=limit, bound=bound, contact=contact)


def _open_places(found: SpeedMap) -> tuple[OpenPlaces, ...]:
    speeds = found.speeds
    reasons: dict[str, list[tuple[float, float]]] = {}
    for i, j in np.argwhere(speeds.outcome == SpeedOutcome.UNCONFIRMED).tolist():
        reasons.setdefault(speeds.reason[i, j], []).append((float(found.distance[i]), float(found.height[j])))
    return tuple(OpenPlaces(reason, tuple(places)) for reason, places in reasons.items())


def _error(measured: ImpactDataset | Conditions) -> float:
    conditions = measured.conditions if isinstance(measured, ImpactDataset) else measured
    return conditions.device.error_or_default
