"""Zones with their speeds as neutral tables: CSV for people and spreadsheets, JSON for programs."""

from __future__ import annotations

import csv
import io
import math
from typing import Any

from forcemap.exports.head import cell, commented, head_lines, head_result, one_line
from forcemap.exports.robot_table import RobotTable

_COLUMNS = (
    "distance_from_m",
    "distance_to_m",
    "height_from_m",
    "height_to_m",
    "speed_mps",
    "outcome",
    "lower_bound_mps",
    "spread_mps",
    "reason",
    "limit_N",
    "bound",
    "map_sha256",
)


def zones_csv(table: RobotTable) -> str:
    """A row for each zone below a head in comments (#); speeds [m/s] floored, 0.000 where none is permitted."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    stream.write("\n".join(f"# {line}" for line in head_lines(table.provenance)) + "\n")
    writer.writerow(_COLUMNS)
    for zone in zones_result(table)["zones"]:
        cells = [zone[name] for name in _COLUMNS[:4]]
        speeds = [f"{zone['speed_mps']:.3f}", zone["outcome"], *map(_milli, (zone[n] for n in _COLUMNS[6:8]))]
        basis = [f"{zone['limit_N']:g}", cell(table.provenance.bound), table.provenance.map_sha256]
        writer.writerow([*cells, *speeds, cell(zone["reason"]), *basis])
    return stream.getvalue()


def zones_result(table: RobotTable) -> dict[str, Any]:
    """The head and a dictionary for each zone, for JSON; lower bound and spread null where there is none."""
    rows = []
    for i in range(table.speed_mmps.shape[0]):
        for j in range(table.speed_mmps.shape[1]):
            lowest, spread = float(table.lowest[i, j]), float(table.spread[i, j])
            rows.append(
                {
                    "distance_from_m": float(table.distance_edges[i]),
                    "distance_to_m": float(table.distance_edges[i + 1]),
                    "height_from_m": float(table.height_edges[j]),
                    "height_to_m": float(table.height_edges[j + 1]),
                    "speed_mps": int(table.speed_mmps[i, j]) / 1000,
                    "outcome": str(table.outcome[i, j]),
                    "lower_bound_mps": None if math.isnan(lowest) else lowest,
                    "spread_mps": None if math.isnan(spread) else spread,
                    "reason": one_line(str(table.reason[i, j])),
                    "limit_N": float(table.limit[i, j]),
                }
            )
    return head_result(table.provenance) | {"zones": rows}


def _milli(speed: float | None) -> str:
    """A speed cut to 0.0001 m/s, empty if there is none."""
    return "" if speed is None else f"{math.floor(speed * 1e4) / 1e4:.4f}"


def head_comment(table: RobotTable, mark: str) -> list[str]:
    """The head of a table as comment lines of a program."""
    return commented(head_lines(table.provenance), mark)
