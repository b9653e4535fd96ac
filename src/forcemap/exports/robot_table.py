"""What a robot's program looks up: one floored speed for each zone of the workspace, and what it rests on."""

from __future__ import annotations

import datetime
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from pathlib import Path
from typing import Self

import numpy as np

from forcemap.arrays import FloatArray, Indices, Objects
from forcemap.direction import WIDEST_ANGLE, direction_vector
from forcemap.errors import InputError, NotReleasable
from forcemap.files import file_sha256, stated_date
from forcemap.findings import Finding, FindingKind
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.maps.map_file import map_sha256
from forcemap.paths.path_speeds import PathSpeeds
from forcemap.speeds.allowance import Allowance
from forcemap.speeds.basis import Basis
from forcemap.speeds.quantities import cases_of
from forcemap.speeds.safe_speed import floor_speed
from forcemap.speeds.zone_speeds import ZoneSpeeds, zone_speeds
from forcemap.speeds.zones import Zones
from forcemap.words import sentence, sentences, warnings

ZONE_SIZE = 0.05
"""Largest extent of a zone, unless stated [m]; a choice between the speed that a zone's size costs and the length of
the program."""

_LEAST_SIZE = 0.005  # [m] of a zone; a choice: the default position tolerance
_MOST_ZONES = 1000  # along an axis; a choice
_WHOLE = Decimal("0.001")  # [m]; edges in whole millimetres, which every controller can hold
_MM_PER_M = 1000
_ROUNDING, _DECIMALS = 1e-9, 9  # of a number of zones; of an edge [m]


@dataclass(frozen=True)
class Provenance:
    """What an exported speed rests on, as it stands in the head of every file.

    Parameters
    ----------
    map_name, map_sha256 : str
        The map.
    date : str
        Date of the export, YYYY-MM-DD.
    bound : Bound
        The bound.
    allowance : Allowance
        What was subtracted.
    bases : tuple of Basis
        The limits, and what the speeds of each rest on.
    notes : tuple of Finding
        What else the speeds depend on.
    simulated : bool
        True if the impacts are simulated.
    impacts_table, impacts_table_sha256 : str
        The impacts table that the map was fitted to; empty for a published map.
    map_file, map_file_sha256 : str
        The file that the map was read from; empty if it was fitted for the export, or published.
    doubts : tuple of Finding
        What must be read before the speeds are used, besides what their bases say.
    """

    map_name: str
    map_sha256: str
    date: str
    bound: Bound
    allowance: Allowance
    bases: tuple[Basis, ...]
    notes: tuple[Finding, ...]
    simulated: bool
    impacts_table: str = ""
    impacts_table_sha256: str = ""
    map_file: str = ""
    map_file_sha256: str = ""
    doubts: tuple[Finding, ...] = ()

    @property
    def warnings(self) -> list[str]:
        """What must be read before the speeds are used."""
        return [*sentences(self.doubts), *warnings(self.bases)]

    def doubted(self, speeds: PathSpeeds) -> Self:
        """The same, with what must be read before the speeds along a path are used."""
        return replace(self, doubts=(*speeds.atlas.warnings, *speeds.doubts))

    def of_file(self, path: str | Path) -> Self:
        """The same, with the name and hash of the file that the map was read from."""
        return replace(self, map_file=Path(path).name, map_file_sha256=file_sha256(path))

    def of_path(self, speeds: PathSpeeds) -> Self:
        """The same for the speeds along a path."""
        return replace(self.doubted(speeds), bases=speeds.bases or self.bases, notes=speeds.notes)

    @property
    def limits_N(self) -> tuple[float, ...]:
        """The force limits [N]."""
        return tuple({basis.limit_finding: float(np.min(basis.newtons)) for basis in self.bases}.values())


@dataclass(frozen=True, eq=False)
class RobotTable:
    """Speeds for a robot's program, on a grid of zones.

    Parameters
    ----------
    distance_edges, height_edges : array, shapes (n + 1,), (m + 1,)
        Edges of the zones in whole millimetres [m].
    speed_mmps : array of int, shape (n, m)
        Speed to program, floored [mm/s]; 0 where none is permitted.
    outcome, reason : array of SpeedOutcome, array of Finding, shape (n, m)
        What is known of the speed, and why.
    lowest : array, shape (n, m)
        The speed at contact: the lower bound of the safe speeds, before allowance and flooring [m/s]; NaN where there
        is none.
    spread : array, shape (n, m)
        How much faster the fastest corner of the zone is [m/s]: the cost of its size.
    limit : array, shape (n, m)
        The force limit that gives the lowest speed [N].
    provenance : Provenance
        What the speeds rest on.
    alone : tuple of int
        Zones that would have a speed by each limit alone, in the order of `provenance.bases`.
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
    alone: tuple[int, ...]

    @property
    def refusal(self) -> Finding | None:
        """Why no zone has a speed, whatever the bound; None if nothing forbids it."""
        return next((basis.refusal for basis in self.provenance.bases if basis.refusal), None)

    @property
    def permitted(self) -> int:
        """Number of zones with a speed."""
        return int(np.sum(self.speed_mmps > 0))

    def speed(self, x: float, y: float, z: float) -> float:
        """What the program gets for a pose in the frame of the base [m]: a speed [m/s], 0 outside or unconfirmed.

        On an edge between zones the farther and the higher one counts; both hold there.
        """
        axes = ((self.distance_edges, math.sqrt(x * x + y * y)), (self.height_edges, z))
        if not all(edges[0] <= value <= edges[-1] for edges, value in axes):
            return 0.0
        i, j = (min(int(np.searchsorted(edges, value, "right")) - 1, edges.size - 2) for edges, value in axes)
        return float(self.speed_mmps[i, j]) / _MM_PER_M


def robot_table(
    force_map: ForceMap,
    *,
    limits: Sequence[tuple[ForceLimit | NewtonLimit | float, Contact | None]],
    bound: Bound,
    size: float = ZONE_SIZE,
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
        No limit, a size out of range, an invalid date, a range too small for the tolerance, or a campaign that does
        not state a direction that motion can be compared with.
    NotReleasable
        A weak bound, a limit in newtons without its spring, or an impacts table that is not what its recordings gave.
    BoundNotAvailable
        The map cannot carry the bound.
    """
    if not limits:
        raise InputError("limits: found none, expected at least one; a task that excludes contact everywhere has none")
    direction_vector(force_map.conditions.direction, whose="the campaign")
    allowance = Allowance() if allowance is None else allowance
    low, high = force_map.measured_range.lowest, force_map.measured_range.highest
    edges = [_edges(float(low[i]) + allowance.position, float(high[i]) - allowance.position, size) for i in (0, 1)]
    zones, shape = Zones.between(*edges).grown(allowance.position), tuple(axis.size - 1 for axis in edges)
    for limit, contact in limits:
        require_exportable(cases_of(force_map, limit, bound=bound, contact=contact, angle=angle)[0].basis)
    speeds = [
        zone_speeds(force_map, zones, limit=limit, bound=bound, contact=contact, angle=angle, allowance=allowance)
        for limit, contact in limits
    ]
    governing = np.argmin([np.where(np.isnan(zone.speed), -np.inf, zone.speed) for zone in speeds], axis=0)

    def strictest(name: str) -> Objects:
        columns = np.array([getattr(zone, name) for zone in speeds], dtype=object)
        return np.asarray(columns[governing, np.arange(len(zones))].reshape(shape))

    lowest = strictest("speed").astype(np.float64)
    outcome, reason = strictest("to_program_outcome"), strictest("to_program_reason")
    millimetres = np.array([_floored(value) for value in strictest("speed_to_program").ravel()]).reshape(shape)
    spread, limit_N = strictest("spread").astype(np.float64), strictest("limit").astype(np.float64)
    head = provenance(force_map, speeds, bound, allowance, date)
    alone = tuple(sum(_floored(value) > 0 for value in zone.speed_to_program) for zone in speeds)
    return RobotTable(edges[0], edges[1], millimetres, outcome, reason, lowest, spread, limit_N, head, alone)


def provenance(
    force_map: ForceMap, speeds: Sequence[ZoneSpeeds], bound: Bound, allowance: Allowance, date: str | None
) -> Provenance:
    """What speeds rest on, for the head of an exported file; the date is today's if not given.

    The arguments are those of `robot_table`, and its speeds for each limit.
    """
    fit = force_map.fit
    return Provenance(
        map_name=force_map.name,
        map_sha256=map_sha256(force_map),
        date=(datetime.date.today() if date is None else stated_date("date", date)).isoformat(),
        bound=bound,
        allowance=allowance,
        bases=tuple(zone.basis for zone in speeds),
        notes=(Finding.of(FindingKind.ONLY_AS_MEASURED),),
        simulated=force_map.simulated,
        impacts_table="" if fit is None else fit.table,
        impacts_table_sha256="" if fit is None else fit.table_sha256,
    )


def require_exportable(basis: Basis) -> None:
    """Raise NotReleasable if nothing may be exported of speeds with this basis."""
    if basis.export_refusal:
        raise NotReleasable(f"nothing is exported: {sentence(basis.export_refusal)}")


def _floored(speed: float) -> int:
    """Whole mm/s, never rounded up; 0 for NaN and below."""
    return max(0, int(Decimal(floor_speed(speed)) * _MM_PER_M)) if math.isfinite(speed) else 0


def _edges(low: float, high: float, size: float) -> FloatArray:
    """Evenly spaced edges in whole millimetres, the outer ones moved inwards."""
    if not _LEAST_SIZE <= size < math.inf:
        raise InputError(f"zone size: found {size:g} m, expected at least {_LEAST_SIZE:g} m")
    first = Decimal(repr(round(low, _DECIMALS))).quantize(_WHOLE, rounding=ROUND_CEILING)
    last = Decimal(repr(round(high, _DECIMALS))).quantize(_WHOLE, rounding=ROUND_FLOOR)
    if not last - first >= _WHOLE:
        raise InputError(
            f"zones: the measured range leaves {high - low:.3g} m once the position tolerance is subtracted on both "
            "sides; measure at more distances and heights, or state a smaller tolerance"
        )
    whole = int((last - first) / _WHOLE)
    count = max(1, math.ceil(whole / _MM_PER_M / size - _ROUNDING))
    if count > _MOST_ZONES:
        raise InputError(f"zone size: found {size:g} m, expected at most {_MOST_ZONES} zones along an axis")
    return np.array([float(first + _WHOLE * (whole * i // count)) for i in range(count + 1)])
