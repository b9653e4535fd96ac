"""What a robot's program looks up: one floored speed for each zone of the workspace, and what it rests on."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from pathlib import Path
from typing import Self

import numpy as np

from forcemap.arrays import FloatArray, Indices, Objects
from forcemap.errors import InputError, NotReleasable
from forcemap.files import file_sha256
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound
from forcemap.maps.direction import WIDEST_ANGLE, direction_vector
from forcemap.maps.force_map import ForceMap
from forcemap.maps.map_file import map_sha256
from forcemap.speeds.safe_speed import SpeedOutcome, floor_speed
from forcemap.speeds.zone_speeds import ZoneSpeeds, zone_speeds
from forcemap.speeds.zones import ONLY_AS_MEASURED, Allowance, Zones

_WHOLE = Decimal("0.001")  # [m]; edges in whole millimetres, which every controller can hold


@dataclass(frozen=True)
class Provenance:
    """What an exported speed rests on, as it stands in the head of every file.

    Parameters
    ----------
    map_name, map_sha256 : str
        The map.
    date : str
        Date of the export, YYYY-MM-DD.
    limits : tuple of str
        Force limits with their table and edition, in words.
    bound : str
        The bound in words.
    bound_forces : tuple of float
        The force limits [N].
    allowance : Allowance
        What was subtracted.
    statements : tuple of str
        Assumptions, a line each.
    warnings : tuple of str
        What must be said first, a line each.
    impacts_table, impacts_table_sha256 : str
        The impacts table that the map was fitted to; empty for a published map.
    map_file, map_file_sha256 : str
        The file that the map was read from; empty if it was fitted for the export, or published.
    """

    map_name: str
    map_sha256: str
    date: str
    limits: tuple[str, ...]
    bound: str
    bound_forces: tuple[float, ...]
    allowance: Allowance
    statements: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    impacts_table: str = ""
    impacts_table_sha256: str = ""
    map_file: str = ""
    map_file_sha256: str = ""

    def of_file(self, path: str | Path) -> Self:
        """The same, with the name and hash of the file that the map was read from."""
        return replace(self, map_file=Path(path).name, map_file_sha256=file_sha256(path))

    def with_statements(self, statements: Iterable[str]) -> Self:
        """The same with other assumptions; those that repeat limit, bound or allowance are left out."""
        repeated = ("limit:", "bound:", str(self.allowance))
        return replace(self, statements=tuple(line for line in statements if not line.startswith(repeated)))


@dataclass(frozen=True, eq=False)
class RobotTable:
    """Speeds for a robot's program, on a grid of zones.

    Parameters
    ----------
    distance_edges, height_edges : array, shapes (n + 1,), (m + 1,)
        Edges of the zones in whole millimetres [m].
    speed_mmps : array of int, shape (n, m)
        Speed to program, floored [mm/s]; 0 where none is permitted.
    outcome, reason : array, shape (n, m)
        What is known of it, and why.
    lowest : array, shape (n, m)
        The lower bound of the safe speeds, before allowance and flooring [m/s]; NaN where there is none.
    spread : array, shape (n, m)
        How much faster the fastest corner of the zone is [m/s]: the price of its size.
    limit : array, shape (n, m)
        The force limit that gives the lowest speed [N].
    provenance : Provenance
        What the speeds rest on.
    refusal : str
        Why no zone has a speed, whatever the bound; empty if nothing forbids it.
    """

    distance_edges: FloatArray
    height_edges: FloatArray
    speed_mmps: Indices
    outcome: Objects
    reason: Objects
    lowest: FloatArray
    spread: FloatArray
    limit: FloatArray
    provenance: Provenance
    refusal: str = ""

    @property
    def permitted(self) -> int:
        """Number of zones with a speed."""
        return int(np.sum(self.speed_mmps > 0))

    def speed(self, x: float, y: float, z: float) -> float:
        """What the program gets for a pose in the frame of the base [m]: a speed [m/s], 0 outside or unconfirmed.

        On an edge between zones the farther and the higher one counts; at every edge both hold.
        """
        d, h = math.sqrt(x * x + y * y), z
        edges = (self.distance_edges, self.height_edges)
        if not all(e[0] <= value <= e[-1] for e, value in zip(edges, (d, h), strict=True)):
            return 0.0
        i, j = (
            min(int(np.searchsorted(e, value, "right")) - 1, e.size - 2) for e, value in zip(edges, (d, h), strict=True)
        )
        return float(self.speed_mmps[i, j]) / 1000


def robot_table(
    force_map: ForceMap,
    *,
    limits: Sequence[tuple[ForceLimit | NewtonLimit | float, Contact | None]],
    bound: Bound,
    size: float = 0.05,
    allowance: Allowance | None = None,
    date: str | None = None,
    angle: float = WIDEST_ANGLE,
) -> RobotTable:
    """One speed for each zone of the workspace, the strictest of several limits, ready for a robot's program.

    A program looks up places, not directions, so the speeds hold for motion within `angle` of the map's direction: off
    it the bound is raised by 14 %. The zones tile the measured range, drawn in by the position tolerance; each speed
    holds for the zone and a margin of that tolerance around it, less the speed overshoot, floored to 0.001 m/s.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    limits : sequence of (limit, contact)
        Limits as in `safe_speed`; all of them hold.
    bound : Bound
        `FixedMargin` or `ToleranceBound`.
    size : float
        Largest extent of a zone [m], at least 0.005.
    allowance : Allowance, optional
        What the robot may deviate; `Allowance()` if not given.
    date : str, optional
        Date of the export, YYYY-MM-DD; today if not given.
    angle : float
        How far the program's motions may point away from the map's direction [deg], at most 5; 0 for along it alone.

    Returns
    -------
    RobotTable

    Raises
    ------
    InputError
        No limit, a size out of range, a date that is none, a range too small for the tolerance, or a campaign that does
        not state a direction that motion can be compared with.
    NotReleasable
        A weak bound, a limit in newtons without its spring, or an impacts table that is not what its recordings gave.
    ContactNotPermitted
        The standard permits no contact with a body area.
    BoundNotAvailable
        The map cannot carry the bound.
    """
    if not limits:
        raise InputError("limits: expected at least one")
    direction_vector(force_map.conditions.direction, whose="the campaign")
    allowance = Allowance() if allowance is None else allowance
    low, high = force_map.measured_range.lowest, force_map.measured_range.highest
    edges = [_edges(float(low[i]) + allowance.position, float(high[i]) - allowance.position, size) for i in (0, 1)]
    near, bottom = np.meshgrid(edges[0][:-1], edges[1][:-1], indexing="ij")
    far, top = np.meshgrid(edges[0][1:], edges[1][1:], indexing="ij")
    zones = Zones(near.ravel(), far.ravel(), bottom.ravel(), top.ravel()).grown(allowance.position)
    found = [
        zone_speeds(force_map, zones, limit=limit, bound=bound, contact=contact, angle=angle)
        for limit, contact in limits
    ]
    for each in found:
        if each.export_refusal:
            raise NotReleasable(f"nothing is exported: {each.export_refusal}")
    governing = np.argmin([np.where(np.isnan(each.speed), -np.inf, each.speed) for each in found], axis=0)

    def strictest(name: str) -> Objects:
        columns = np.array([getattr(each, name) for each in found], dtype=object)
        return np.asarray(columns[governing, np.arange(len(zones))].reshape(near.shape))

    lowest = strictest("speed").astype(np.float64)
    outcome, reason = strictest("outcome"), strictest("reason")
    millimetres = np.array([_floored(value - allowance.speed) for value in lowest.ravel()]).reshape(near.shape)
    spent = (millimetres == 0) & ~np.isnan(lowest)
    outcome[spent], reason[spent] = SpeedOutcome.UNCONFIRMED, "nothing is left once the allowance is subtracted"
    return RobotTable(
        edges[0],
        edges[1],
        millimetres,
        outcome,
        reason,
        lowest,
        strictest("spread").astype(np.float64),
        strictest("limit").astype(np.float64),
        provenance(force_map, found, bound, allowance, date),
        next((each.refusal for each in found if each.refusal), ""),
    )


def provenance(
    force_map: ForceMap, found: Sequence[ZoneSpeeds], bound: Bound, allowance: Allowance, date: str | None
) -> Provenance:
    """What speeds rest on, for the head of an exported file; the date is today's if not given.

    The arguments are those of `robot_table`, and the speeds it made.
    """
    statements = dict.fromkeys(line for each in found for line in each.statements)
    fit = force_map.fit
    return Provenance(
        map_name=force_map.name,
        map_sha256=map_sha256(force_map),
        date=_date(date),
        limits=tuple(dict.fromkeys(line.removeprefix("limit: ") for line in statements if line.startswith("limit:"))),
        bound=str(bound),
        bound_forces=tuple(float(each.limit[0]) for each in found),
        allowance=allowance,
        statements=(),
        warnings=tuple(dict.fromkeys(line for each in found for line in each.warnings)),
        impacts_table="" if fit is None else fit.table,
        impacts_table_sha256="" if fit is None else fit.table_sha256,
    ).with_statements((*statements, ONLY_AS_MEASURED))


def _date(date: str | None) -> str:
    if date is None:
        return datetime.date.today().isoformat()
    try:
        return datetime.date.fromisoformat(date).isoformat()
    except ValueError:
        raise InputError(f"date: found {date!r}, expected YYYY-MM-DD") from None


def _floored(speed: float) -> int:
    """Whole mm/s, never rounded up; 0 for NaN and below."""
    return max(0, int(Decimal(floor_speed(speed)) * 1000)) if math.isfinite(speed) else 0


def _edges(low: float, high: float, size: float) -> FloatArray:
    """Evenly spread edges in whole millimetres, the outer ones drawn inwards."""
    if not 0.005 <= size < math.inf:
        raise InputError(f"zone size: found {size:g} m, expected at least 0.005 m")
    first = Decimal(repr(round(low, 9))).quantize(_WHOLE, rounding=ROUND_CEILING)
    last = Decimal(repr(round(high, 9))).quantize(_WHOLE, rounding=ROUND_FLOOR)
    if not last - first >= _WHOLE:
        raise InputError(
            f"zones: the measured range leaves {high - low:.3g} m once the position tolerance is subtracted on both "
            "sides; measure at more distances and heights, or state a smaller tolerance"
        )
    whole = int((last - first) / _WHOLE)
    count = max(1, math.ceil(whole / 1000 / size - 1e-9))
    if count > 1000:
        raise InputError(f"zone size: found {size:g} m, expected at most 1000 zones along an axis")
    return np.array([float(first + _WHOLE * (whole * i // count)) for i in range(count + 1)])
