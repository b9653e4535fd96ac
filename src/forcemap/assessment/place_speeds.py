"""Safe speeds for one body area and kind of contact, the standard's formula beside them, and what to measure next."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.assessment.missing import Missing, attempt, present
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.comparisons.contact_model import ContactModel
from forcemap.direction import WIDEST_ANGLE
from forcemap.findings import Finding, FindingKind
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.maps.bounds import Bound, ToleranceBound
from forcemap.maps.force_map import ForceMap
from forcemap.planning.confirm import ConfirmationResult, Confirmed
from forcemap.planning.next.measurements import NextMeasurements, next_measurements
from forcemap.speeds.allowance import Allowance
from forcemap.speeds.safe_speed import SpeedOutcome
from forcemap.speeds.speed_map import SpeedMap, measured_grid, speed_map


@dataclass(frozen=True)
class OpenPlaces:
    """Places without a speed to program, for one reason.

    Parameters
    ----------
    reason : Finding
        Why, in words.
    places : tuple of (float, float)
        Their distances and heights [m].
    """

    reason: Finding
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
        Places inside the measured range without a speed to program.
    standard_speed : float
        What the standard's contact model allows everywhere, the body part constrained [m/s]; a formula, confirmed by no
        measurement. NaN where contact is not permitted or the moving mass is not stated.
    measure_next : NextMeasurements or Missing
        What to measure next for this limit.
    confirmation : ConfirmationResult or None
        Whether impacts at released speeds confirm the map for this limit; None if none were measured.
    fine : SpeedMap or None
        Safe speeds on a finer grid, from end to end of the measured range: what `speeds` misses; None without speeds.
    off_axis : SpeedMap or None
        The same on the grid of `speeds` for motion up to `WIDEST_ANGLE` off the map's direction; None without speeds.
    """

    limit: ForceLimit
    contact: Contact
    speeds: SpeedMap | Missing
    open_places: tuple[OpenPlaces, ...]
    standard_speed: float
    measure_next: NextMeasurements | Missing
    confirmation: ConfirmationResult | None = None
    fine: SpeedMap | None = None
    off_axis: SpeedMap | None = None

    @property
    def contradicted(self) -> bool:
        """True if an impact that was to confirm the map does not."""
        return self.confirmation is not None and self.confirmation.outcome is Confirmed.DOES_NOT_PASS

    @property
    def not_released(self) -> Finding | None:
        """Why none of the speeds may be used: impacts that were to confirm the map do not, or nothing is exported."""
        if self.contradicted and self.confirmation:
            figures = {"limit": self.limit.name.replace("_", " "), "contact": str(self.contact)}
            return Finding.of(FindingKind.CONFIRMATION_FAILED, self.confirmation.reason, **figures)
        return None if isinstance(self.speeds, Missing) else self.speeds.speeds.basis.export_refusal

    @property
    def confirmed_by(self) -> tuple[str, ...]:
        """Recordings of the impacts that confirm the map for this limit; none if they do not, or are not all there."""
        if self.confirmation is None or self.confirmation.outcome is not Confirmed.PASSES:
            return ()
        return tuple(impact.recording for impact in self.confirmation.impacts)

    @cached_property
    def open_box(self) -> tuple[tuple[float, float], tuple[float, float]] | None:
        """Ends in distance and in height of a box around all places of the measured range without a speed [m].

        Those between the places of `speeds`, too; None if there are none.
        """
        return None if self.fine is None else _open_box(self.fine, self.open_places)

    @cached_property
    def open_between(self) -> tuple[Finding, ...]:
        """Why places between those of `speeds` have no speed, where none of the open places says so."""
        if self.fine is None:
            return ()
        said = {group.reason.kind for group in self.open_places}
        kinds = {group.reason.kind: group.reason for group in _open_places(self.fine) if group.reason.kind not in said}
        return tuple(kinds.values())

    @property
    def confirmed(self) -> int:
        """Number of places with a speed to program."""
        if isinstance(self.speeds, Missing) or self.not_released:
            return 0
        return int(np.sum(~np.isnan(self.speeds.speeds.speed_to_program)))

    @cached_property
    def _confirmed(self) -> FloatArray:
        """Speeds at contact and to program where there is one to program, with distance and height, shape (4, n).

        At all places looked at, those of the finer grid, too; none if none is released.
        """
        if isinstance(self.speeds, Missing) or not self.confirmed:
            return np.empty((4, 0))
        found = []
        for grid in (self.speeds, self.fine):
            if grid is not None:
                d, h = np.meshgrid(grid.distance, grid.height, indexing="ij")
                found.append(np.stack([grid.speeds.speed, grid.speeds.speed_to_program, d, h]).reshape(4, -1))
        every = np.hstack(found)
        return np.asarray(every[:, ~np.isnan(every[1])])

    @property
    def of_table(self) -> tuple[float, float]:
        """Lowest and highest of the speeds to program at these places alone [m/s]; NaN if there is none."""
        if isinstance(self.speeds, Missing) or not self.confirmed:
            return math.nan, math.nan
        program = self.speeds.speeds.speed_to_program
        return float(np.nanmin(program)), float(np.nanmax(program))

    @property
    def to_program_off_axis(self) -> FloatArray:
        """Speeds to program [m/s] of the places that have one for motion off the direction, too, in ascending order."""
        if self.off_axis is None or not self.confirmed:
            return np.empty(0)
        program = np.sort(self.off_axis.speeds.speed_to_program, axis=None)
        return np.asarray(program[~np.isnan(program)])

    @property
    def warnings_off_axis(self) -> tuple[Finding, ...]:
        """What must be read before these are used, besides what is said of speeds along the direction."""
        if self.off_axis is None or isinstance(self.speeds, Missing) or not self.to_program_off_axis.size:
            return ()
        return self.off_axis.speeds.basis.warnings_beyond(self.speeds.speeds.basis)

    @property
    def unconfirmed(self) -> int:
        """Number of other places inside the measured range."""
        return sum(len(group.places) for group in self.open_places)

    @property
    def apart(self) -> tuple[float, float]:
        """How far its places are apart in distance and in height [m]; 0 without any, or with one alone."""
        if isinstance(self.speeds, Missing):
            return 0.0, 0.0
        axes = np.asarray(self.speeds.distance), np.asarray(self.speeds.height)
        across, up = (float(np.max(np.diff(axis), initial=0.0)) for axis in axes)
        return across, up

    @property
    def slowest(self) -> float:
        """Lowest of the speeds at contact in the measured range [m/s], between places, too; NaN if there is none."""
        return float(self._confirmed[0].min()) if self.confirmed else math.nan

    @property
    def fastest(self) -> float:
        """Highest of the speeds at contact in the measured range [m/s]; NaN if there is none."""
        return float(self._confirmed[0].max()) if self.confirmed else math.nan

    @property
    def slowest_to_program(self) -> float:
        """Lowest of the speeds to program in the measured range [m/s]; NaN if there is none."""
        return float(self._confirmed[1].min()) if self.confirmed else math.nan

    @property
    def slowest_place(self) -> tuple[float, float]:
        """Distance and height of the lowest speed to program [m]; NaN if there is none."""
        return self._place(int(np.argmin(self._confirmed[1]))) if self.confirmed else (math.nan, math.nan)

    @property
    def fastest_place(self) -> tuple[float, float]:
        """Distance and height of the highest speed to program [m]; NaN if there is none."""
        return self._place(int(np.argmax(self._confirmed[1]))) if self.confirmed else (math.nan, math.nan)

    def _place(self, index: int) -> tuple[float, float]:
        distance, height = self._confirmed[2:, index].tolist()
        return distance, height

    def printed(self, place: tuple[float, float]) -> tuple[float, float]:
        """A place to the millimetre, rounded to the side where there are speeds [m]."""
        exact, middle = 1000 * np.array(place), 1000 * self._confirmed[2:].mean(axis=1)
        distance, height = (np.where(middle > exact, np.ceil(exact - 1e-6), np.floor(exact + 1e-6)) / 1000).tolist()
        return distance, height

    @property
    def fastest_to_program(self) -> float:
        """Highest of the speeds to program in the measured range [m/s]; NaN if there is none."""
        return float(self._confirmed[1].max()) if self.confirmed else math.nan


def place_speeds(
    limit: ForceLimit,
    contact: Contact,
    force_map: ForceMap | Missing,
    bound: Bound | Missing,
    *,
    measured: ImpactDataset | Conditions,
    plan: MeasurementPlan | None,
    model: ContactModel | Missing,
    step: float,
    allowance: Allowance,
    confirmation: ConfirmationResult | None = None,
) -> PlaceSpeeds:
    """Safe speeds on a grid `step` [m] apart, and what to measure next; a missing part says why.

    Parameters
    ----------
    limit : ForceLimit
    contact : Contact
    force_map : ForceMap or Missing
    bound : Bound or Missing
    measured : ImpactDataset or Conditions
        What was measured so far.
    plan : MeasurementPlan or None
        Gives the range of places if nothing was measured yet.
    model : ContactModel or Missing
        The standard's contact model.
    step : float
        Distance between places [m].
    confirmation : ConfirmationResult, optional
        Of the impacts that were made to confirm the map for this limit.
    """
    if not limit.permitted:
        why = Missing(f"NOT PERMITTED: the standard permits no contact with {limit.name}, at no speed")
        return PlaceSpeeds(limit, contact, why, (), math.nan, why)
    case: dict[str, Any] = {"limit": limit, "contact": contact, "allowance": allowance}
    speeds = attempt(lambda: _speeds(present(force_map), present(bound), step, case))
    off_axis = attempt(lambda: _speeds(present(force_map), present(bound), step, case | {"angle": WIDEST_ANGLE}))
    open_places = () if isinstance(speeds, Missing) else _open_places(speeds)
    fine = attempt(lambda: fine_speeds(limit, contact, present(force_map), present(bound), allowance))
    conditions = measured.conditions if isinstance(measured, ImpactDataset) else measured
    error = conditions.device.error_or_default
    tolerance = bound if isinstance(bound, ToleranceBound) else ToleranceBound(device_error=error)
    ranges: dict[str, Any] = {}
    if plan is not None and not (isinstance(measured, ImpactDataset) and len(measured.train)):
        axes = {"distances": plan.distance, "heights": plan.height}
        ranges = {name: (float(axis.min()), float(axis.max())) for name, axis in axes.items()}
    return PlaceSpeeds(
        limit=limit,
        contact=contact,
        speeds=speeds,
        open_places=open_places,
        standard_speed=math.nan if isinstance(model, Missing) else model.speed_limit(limit, contact),
        measure_next=attempt(lambda: next_measurements(measured, limit, contact=contact, bound=tolerance, **ranges)),
        confirmation=confirmation,
        fine=None if isinstance(fine, Missing) else fine,
        off_axis=None if isinstance(off_axis, Missing) else off_axis,
    )


_FINE = 61
"""Places along distance, and along height, that are looked at between the ends of the measured range; a choice."""


def fine_speeds(
    limit: ForceLimit, contact: Contact, force_map: ForceMap, bound: Bound, allowance: Allowance
) -> SpeedMap:
    """Safe speeds on a fine grid from end to end of the measured range: the lowest and the highest are those of it."""
    axes = np.linspace(force_map.measured_range.lowest[:2], force_map.measured_range.highest[:2], _FINE).T
    return speed_map(force_map, *axes, limit=limit, bound=bound, contact=contact, allowance=allowance)


def _open_box(
    fine: SpeedMap, open_places: tuple[OpenPlaces, ...]
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """A box around all places without a speed, those of a fine grid and those that are named.

    It ends a step of the grid beyond the outer ones, for between two places nothing says from where on, and not beyond
    the measured range.
    """
    axes = np.stack([fine.distance, fine.height])
    without = np.argwhere(fine.speeds.to_program_outcome == SpeedOutcome.UNCONFIRMED)
    named = np.array([place for group in open_places for place in group.places]).reshape(-1, 2)
    every = np.vstack([axes[[0, 1], without], named])
    if not len(every):
        return None
    step = axes[:, 1] - axes[:, 0]
    low, high = np.maximum(every.min(axis=0) - step, axes[:, 0]), np.minimum(every.max(axis=0) + step, axes[:, -1])
    return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))


def _speeds(force_map: ForceMap, bound: Bound, step: float, case: dict[str, Any]) -> SpeedMap:
    return speed_map(force_map, *measured_grid(force_map, step), bound=bound, **case)


def _open_places(grid: SpeedMap) -> tuple[OpenPlaces, ...]:
    speeds = grid.speeds
    reasons: dict[Finding, list[tuple[float, float]]] = {}
    for i, j in np.argwhere(speeds.to_program_outcome == SpeedOutcome.UNCONFIRMED).tolist():
        place = float(grid.distance[i]), float(grid.height[j])
        reasons.setdefault(speeds.to_program_reason[i, j], []).append(place)
    return tuple(OpenPlaces(reason, tuple(places)) for reason, places in reasons.items())
