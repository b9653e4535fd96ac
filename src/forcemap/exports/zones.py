"""Zones with their speeds as neutral tables: CSV for people and spreadsheets, JSON for programs."""

from __future__ import annotations

import itertools
import math
from typing import Any

from forcemap.exports.head import cell, csv_text, head_lines, head_result, one_line, way_spacing
from forcemap.exports.robot_table import Provenance, RobotTable
from forcemap.words import sentence

_EDGES = ("distance_from_m", "distance_to_m", "height_from_m", "height_to_m")
_PROGRAM = ("speed_to_program_mps", "speed_mps")  # one speed: by its name in every table, and by its older one here
_OF_ZONE = ("outcome", "lower_bound_mps", "spread_mps")


def zones_csv(table: RobotTable) -> str:
    """A row for each zone below a head in comments (#); speeds [m/s] floored, 0.000 where none is permitted."""
    head = [*head_lines(table.provenance), use_of_zones(table.provenance)]
    return csv_text(zone_columns(), zone_cells(table), head)


def use_of_zones(provenance: Provenance, rows: str = "") -> str:
    """How a person or a program finds the speed of a motion in a table of zones; `rows` says which ones count."""
    return (
        f"use: {rows}distance is sqrt(x^2 + y^2) and height is z of the contact site in the frame of the base; on a "
        "straight motion in the map's direction the slowest zone on the whole way counts, looked up every "
        f"{1000 * way_spacing(provenance):g} mm; where a speed is 0, and outside all zones, do not move "
        "(docs/robot_program.md)"
    )


def zone_columns() -> list[str]:
    """The columns of a table of zones."""
    return [*_EDGES, *_PROGRAM, *_OF_ZONE, "reason", "limit_N", "bound", "map_sha256"]


def zone_cells(table: RobotTable) -> list[list[Any]]:
    """The cells of a row for each zone."""
    rows = []
    for zone in zones_of(table):
        cells = [zone[name] for name in _EDGES]
        speeds = [*(f"{zone[name]:.3f}" for name in _PROGRAM), zone["outcome"]]
        speeds += map(_milli, (zone[name] for name in _OF_ZONE[1:]))
        basis = [f"{zone['limit_N']:g}", cell(str(table.provenance.bound)), table.provenance.map_sha256]
        rows.append([*cells, *speeds, cell(zone["reason"]), *basis])
    return rows


def zones_result(table: RobotTable) -> dict[str, Any]:
    """The head and a dictionary for each zone, for JSON; lower bound and spread null where there is none."""
    head = head_result(table.provenance) | {"use": use_of_zones(table.provenance)}
    return head | {"zones": zones_of(table)}


def zones_of(table: RobotTable) -> list[dict[str, Any]]:
    """A dictionary for each zone."""
    rows = []
    for i, j in itertools.product(*map(range, table.speed_mmps.shape)):
        lowest, spread = float(table.lowest[i, j]), float(table.spread[i, j])
        edges = *table.distance_edges[i : i + 2].tolist(), *table.height_edges[j : j + 2].tolist()
        rows.append(
            dict(zip(_EDGES, edges, strict=True))
            | dict.fromkeys(_PROGRAM, int(table.speed_mmps[i, j]) / 1000)
            | {
                "outcome": str(table.outcome[i, j]),
                "lower_bound_mps": None if math.isnan(lowest) else lowest,
                "spread_mps": None if math.isnan(spread) else spread,
                "reason": one_line(sentence(table.reason[i, j])),
                "limit_N": float(table.limit[i, j]),
            }
        )
    return rows


def _milli(speed: float | None) -> str:
    """A speed cut to 0.0001 m/s, empty if there is none."""
    return "" if speed is None else f"{math.floor(speed * 1e4) / 1e4:.4f}"
