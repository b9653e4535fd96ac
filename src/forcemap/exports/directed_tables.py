"""Tables of zones for several directions of motion, contact sites and tools; a program chooses by its motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.direction import WIDEST_ANGLE
from forcemap.errors import InputError, NotReleasable
from forcemap.exports.head import cell, csv_text, head_lines, head_result, one_line
from forcemap.exports.robot_table import ZONE_SIZE, Provenance, RobotTable, robot_table
from forcemap.exports.zones import use_of_zones, zone_cells, zone_columns, zones_of
from forcemap.files import sha256
from forcemap.findings import Finding
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound
from forcemap.paths.atlas import Atlas, AtlasMap, Loaded, told_apart
from forcemap.paths.task import Task, TaskSegment
from forcemap.speeds.allowance import Allowance

_LEAST_ANGLE = 1.0  # [deg]; below it a number of 24 bits tells directions no longer apart
_CODES = 1000, 9000  # the first number of a tool in a program, and how many there are
_MARGIN = 1e-3  # [deg] by which a program is stricter than the library: numbers of a controller may have 24 bits
_CLOSEST = 0.01  # [m]; a choice: no map reaches nearer
_LOAD_COLUMNS = ("direction", "contact_site", "tool", "payload_kg")


_ANY = TaskSegment("every motion", ("hand",), Contact.TRANSIENT)


@dataclass(frozen=True, eq=False)
class DirectedTable:
    """The zones of one map, and what it holds for.

    Parameters
    ----------
    campaign : AtlasMap
        The map.
    table : RobotTable
        Its zones.
    """

    campaign: AtlasMap
    table: RobotTable


@dataclass(frozen=True, eq=False)
class DirectedTables:
    """What a program looks up for a straight motion: the zones of the map of its direction, for each contact site.

    Parameters
    ----------
    tables : tuple of DirectedTable
        The tables.
    tools : tuple of tuple of Loaded
        For each tool its contact sites that can hit.
    offsets : tuple of array, shape (3,)
        Where each of `sites` lies from the point whose motion a program asks for, in the frame of the base [m].
    angle : float
        How far a motion may point away from the direction of a map [deg].
    provenance : Provenance
        What the speeds rest on.
    """

    tables: tuple[DirectedTable, ...]
    tools: tuple[tuple[Loaded, ...], ...]
    offsets: tuple[FloatArray, ...]
    angle: float
    provenance: Provenance

    @property
    def refusal(self) -> Finding | None:
        """Why no zone has a speed, whatever the bound; None if nothing forbids it in one of the tables."""
        refusals = [each.table.refusal for each in self.tables]
        return refusals[0] if all(refusals) else None

    @property
    def zones(self) -> int:
        """Number of zones, of all tables."""
        return sum(each.table.speed_mmps.size for each in self.tables)

    @property
    def permitted(self) -> int:
        """Number of zones with a speed, of all tables."""
        return sum(each.table.permitted for each in self.tables)

    @property
    def codes(self) -> tuple[int, ...]:
        """The number of each tool in a program; of its name and payload alone, so it stays when others are added."""
        return tuple(_code(sites[0]) for sites in self.tools)

    @property
    def sites(self) -> tuple[str, ...]:
        """The contact sites of all tools."""
        return tuple(dict.fromkeys(site.contact_site for sites in self.tools for site in sites))

    @property
    def needed(self) -> list[list[int]]:
        """1 for every contact site that can hit with a tool, else 0: a row for each tool."""
        return [[int(any(site.contact_site == name for site in sites)) for name in self.sites] for sites in self.tools]

    def numbers(self, each: DirectedTable) -> tuple[int, int]:
        """Numbers of a table's contact site and tool in their lists, counted from 1."""
        loaded = each.campaign.loaded
        return self.sites.index(loaded.contact_site) + 1, next(i for i, s in enumerate(self.tools, 1) if loaded in s)

    @property
    def closest(self) -> float:
        """A program permits nothing that comes as near to the base's z-axis as this [m]: directions turn there."""
        _, sine = self.cosine_and_sine
        return max(_CLOSEST, self.provenance.allowance.position / sine)

    @property
    def cosine_and_sine(self) -> tuple[float, float]:
        """Cosine and sine of the angle that a program compares with, a little smaller than that of the library."""
        angle = math.radians(self.angle - _MARGIN)
        return math.cos(angle), math.sin(angle)

    @property
    def spread(self) -> FloatArray:
        """How much faster the fastest corner of each zone with a speed is [m/s]."""
        return np.concatenate([each.table.spread[each.table.speed_mmps > 0] for each in self.tables])

    @property
    def lines(self) -> list[str]:
        """Head of a program: what it rests on, its tools and its tables."""
        tools = [
            f"tool {code}: {sites[0].tool or 'not stated'}, {_payload(sites[0])}; contact sites that can hit: "
            + ", ".join(site.contact_site or "not stated" for site in sites)
            for code, sites in zip(self.codes, self.tools, strict=True)
        ]
        places = [
            f"contact site {site or 'not stated'} lies {', '.join(f'{x:g}' for x in offset.tolist())} m (x, y, z of "
            "the base) from the point whose motion is asked for; only while the tool does not turn"
            for site, offset in zip(self.sites, self.offsets, strict=True)
            if offset.any()
        ]
        tables = [
            f"table {number}: motion {each.campaign.conditions.direction}, contact site "
            f"{each.campaign.loaded.contact_site or 'not stated'}, tool {each.campaign.loaded.tool or 'not stated'}, "
            f"{_payload(each.campaign.loaded)}, of {each.campaign.name}, SHA-256 {each.table.provenance.map_sha256}"
            for number, each in enumerate(self.tables, start=1)
        ]
        return [*head_lines(self.provenance), *map(one_line, (*tools, *places, *tables))]


def directed_tables(
    atlas: Atlas,
    *,
    limits: Sequence[tuple[ForceLimit | NewtonLimit | float, Contact | None]],
    bound: Bound,
    task: Task | None = None,
    size: float = ZONE_SIZE,
    allowance: Allowance | None = None,
    date: str | None = None,
    angle: float = WIDEST_ANGLE,
) -> DirectedTables:
    """The zones of every map of an atlas, as `robot_table` gives them.

    Parameters
    ----------
    atlas : Atlas
        The maps.
    task : Task, optional
        What can hit, with which tools and payloads; without one each tool of the atlas, with its only contact site.
    limits, bound, size, allowance, date, angle
        As in `robot_table`; the angle is at least 0.1 degrees.

    Raises
    ------
    InputError
        As `robot_table`, and if the task leaves open what the campaigns differ in.
    NotReleasable, BoundNotAvailable
        As `robot_table`.
    """
    if not angle >= _LEAST_ANGLE:
        raise InputError(
            f"angle: found {angle:g} degrees, expected at least {_LEAST_ANGLE:g}: a program that chooses by its motion "
            "compares directions"
        )
    atlas, allowance = atlas.carrying(bound), allowance or Allowance()
    tools = _tools(atlas, task)
    case: dict[str, Any] = {"limits": limits, "bound": bound, "size": size, "allowance": allowance, "date": date}
    wanted = {site for sites in tools for site in sites}
    kept = [each for each in atlas.maps if each.loaded in wanted and (task is None or atlas.in_direction(each, task))]
    tables = tuple(DirectedTable(each, _table(each, angle=angle, **case)) for each in kept)
    if not tables:
        raise InputError("no map of the atlas is of a contact site, tool and payload that the task names")
    offsets = {
        site.contact_site: (task or Task((_ANY,))).site_offset(site.contact_site, alone=len(sites) == 1)
        for sites in tools
        for site in sites
    }
    found = DirectedTables(tables, tools, tuple(offsets.values()), angle, _provenance(atlas, tables))
    if len({*found.codes}) < len(found.codes):
        raise InputError("tools: two have the same number in a program; name one of them otherwise")
    return found


def _table(campaign: AtlasMap, **case: Any) -> RobotTable:
    """The zones of a map; what forbids them names it."""
    assert campaign.force_map is not None
    try:
        return robot_table(campaign.force_map, **case)
    except (InputError, NotReleasable) as error:
        raise type(error)(f"{campaign.name}: {error.message}") from None


def _tools(atlas: Atlas, task: Task | None) -> tuple[tuple[Loaded, ...], ...]:
    """The contact sites that can hit with each tool and payload."""
    if task is None:
        loads = dict.fromkeys((each.conditions.tool, each.conditions.payload) for each in atlas.campaigns)
        segments = (replace(_ANY, name=str(i), tool=tool, payload=load) for i, (tool, load) in enumerate(loads))
        task = Task(tuple(segments))
    else:
        atlas.require_task(task)
    needs = [need for segment in task.segments if segment.contact for need in atlas.needs(task, segment)]
    in_order = sorted(dict.fromkeys(needs), key=_tool_of)
    return tuple(tuple(sites) for _, sites in groupby(in_order, key=_tool_of))


def _tool_of(loaded: Loaded) -> tuple[str, float]:
    return loaded.tool, -1.0 if loaded.payload is None else loaded.payload


def _provenance(atlas: Atlas, tables: Sequence[DirectedTable]) -> Provenance:
    """What the speeds of all tables rest on."""
    heads = [each.table.provenance for each in tables]
    bases = told_apart([(each.campaign.name, basis) for each in tables for basis in each.table.provenance.bases], atlas)
    notes = (*atlas.findings, *heads[0].notes)
    simulated = any(head.simulated for head in heads)
    head = replace(heads[0], bases=bases, notes=notes, simulated=simulated, impacts_table="", impacts_table_sha256="")
    head = replace(head, doubts=atlas.warnings)
    return replace(head, map_name=Path(atlas.source).name, map_sha256=atlas.sha256)


def _code(loaded: Loaded) -> int:
    """A number for a tool with its payload, of four digits."""
    first, count = _CODES
    return first + int(sha256(repr((loaded.tool, loaded.payload)).encode("utf-8", "surrogateescape")), 16) % count


def _payload(loaded: Loaded) -> str:
    return "payload not stated" if loaded.payload is None else f"payload {loaded.payload:g} kg"


def directed_csv(tables: DirectedTables) -> str:
    """A row for each zone of each table below a head in comments (#), as `zones_csv`."""
    rows = [[*map(cell, _loaded_texts(each)), *row] for each in tables.tables for row in zone_cells(each.table)]
    return csv_text([*_LOAD_COLUMNS, *zone_columns()], rows, [*tables.lines, _use_of_zones(tables)])


def directed_result(tables: DirectedTables) -> dict[str, Any]:
    """The head, the tools and the tables with a dictionary for each zone, for JSON."""
    tools = [
        {
            "number": code,
            "tool": one_line(sites[0].tool),
            "payload_kg": sites[0].payload,
            "contact_sites": [one_line(site.contact_site) for site in sites],
        }
        for code, sites in zip(tables.codes, tables.tools, strict=True)
    ]
    listed = [
        {
            "direction": one_line(each.campaign.conditions.direction),
            "direction_vector": each.campaign.direction.tolist(),
            "contact_site": one_line(each.campaign.loaded.contact_site),
            "tool": one_line(each.campaign.loaded.tool),
            "payload_kg": each.campaign.loaded.payload,
            "map_sha256": each.table.provenance.map_sha256,
            "zones": zones_of(each.table),
        }
        for each in tables.tables
    ]
    places = {one_line(site): offset.tolist() for site, offset in zip(tables.sites, tables.offsets, strict=True)}
    head = head_result(tables.provenance) | {"angle_deg": tables.angle, "site_offsets_m": places}
    head |= {"use": _use_of_zones(tables)}
    return head | {"tools": tools, "tables": listed}


def _use_of_zones(tables: DirectedTables) -> str:
    """As `use_of_zones`, with how the rows are chosen."""
    rows = (
        f"take the rows whose direction is the motion's, within {tables.angle:g} degrees, of the tool and payload on "
        "the robot, for each contact site that can hit, and the lowest of these speeds; without such rows do not move; "
    )
    return use_of_zones(tables.provenance, rows)


def _loaded_texts(each: DirectedTable) -> list[str]:
    conditions, payload = each.campaign.conditions, each.campaign.loaded.payload
    texts = [conditions.direction, conditions.contact_site, conditions.tool]
    return [*texts, "" if payload is None else f"{payload:g}"]
