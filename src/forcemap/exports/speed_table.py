"""A speed map as CSV, for people and spreadsheets."""

from __future__ import annotations

import math
from typing import Any

from forcemap.exports.head import cell, csv_text
from forcemap.speeds.safe_speed import floor_speed
from forcemap.speeds.speed_map import SpeedMap
from forcemap.words import assumptions, sentence, warnings

_SPEEDS = {
    "speed_mps": "speed",
    "speed_to_program_mps": "speed_to_program",
    "extrapolated_speed_mps": "extrapolated_speed",
    "lowest_measured_speed_mps": "lowest_measured_speed",
    "highest_measured_speed_mps": "highest_measured_speed",
}
_FORCES = {"predicted_force_N": "predicted_force", "bound_force_N": "bound_force"}


def speed_map_csv(speed_map: SpeedMap, *, basis: dict[str, str]) -> str:
    """A row for each place, speeds at contact and to program [m/s] floored to 0.001 and empty where there is none.

    Parameters
    ----------
    speed_map : SpeedMap
        The speeds.
    basis : dict
        What every speed rests on (limit, bound, map): columns with the same text in every row.
    """
    several = speed_map.speeds.governed_by is not None
    reasons = ["limit_N", "reason", "to_program_outcome", "to_program_reason", *["governed_by"] * several]
    columns = ["distance_m", "height_m", "outcome", *_SPEEDS, *_FORCES, *reasons, *basis, "assumptions"]
    rows: list[list[str]] = []
    bases = [speed_map.speeds.basis]
    rests_on = cell("; ".join((*warnings(bases), *assumptions(bases))))
    stated = [cell(value) for value in basis.values()]
    for place in _places(speed_map):
        speeds = [floor_speed(place[column]).replace("-", "") for column in _SPEEDS]
        forces = ["" if math.isnan(place[column]) else f"{place[column]:.1f}" for column in _FORCES]
        where = [repr(place["distance_m"]), repr(place["height_m"]), place["outcome"]]
        limit, program = f"{speed_map.speeds.limit:g}", [place["to_program_outcome"], cell(place["to_program_reason"])]
        program += [place["governed_by"]] * several
        rows.append([*where, *speeds, *forces, limit, cell(place["reason"]), *program, *stated, rests_on])
    return csv_text(columns, rows)


def _places(speed_map: SpeedMap) -> list[dict[str, Any]]:
    """A dictionary for each place, figures unrounded and NaN where there are none."""
    speeds = speed_map.speeds
    return [
        {
            "distance_m": distance,
            "height_m": height,
            "outcome": speeds.outcome[i, j].value,
            "reason": sentence(speeds.reason[i, j]),
            "to_program_outcome": speeds.to_program_outcome[i, j].value,
            "to_program_reason": sentence(speeds.to_program_reason[i, j]),
            "governed_by": "" if speeds.governed_by is None else str(speeds.governed_by[i, j]),
            **{column: float(getattr(speeds, name)[i, j]) for column, name in (_SPEEDS | _FORCES).items()},
        }
        for i, distance in enumerate(speed_map.distance.tolist())
        for j, height in enumerate(speed_map.height.tolist())
    ]
