"""Speed-scaling factors for the segments of a trajectory: what its programmed speed is multiplied by."""

from __future__ import annotations

import csv
import io
import math
from decimal import ROUND_FLOOR, Decimal
from typing import Any

from forcemap.errors import InputError
from forcemap.exports.head import head_lines, head_result
from forcemap.paths.path_speeds import PathSpeeds
from forcemap.robot_tables import Provenance
from forcemap.speeds import floor_speed

_COLUMNS = (
    "piece",
    "segment",
    "from_x_m",
    "from_y_m",
    "from_z_m",
    "to_x_m",
    "to_y_m",
    "to_z_m",
    "programmed_speed_mps",
    "allowed_speed_mps",
    "scaling",
    "outcome",
    "governed_by",
    "limit_N",
    "reason",
)


def scaling_csv(speeds: PathSpeeds, provenance: Provenance) -> str:
    """A row for each piece below a head in comments (#); scaling floored to 0.01, 0.00 where none is permitted.

    Raises
    ------
    InputError
        The path has no programmed speed.
    """
    stream = io.StringIO()
    stream.write("\n".join(f"# {line}" for line in head_lines(provenance)) + "\n")
    writer = csv.DictWriter(stream, _COLUMNS, lineterminator="\n")
    writer.writeheader()
    for piece in scaling_result(speeds, provenance)["pieces"]:
        row = piece | {
            "allowed_speed_mps": f"{piece['allowed_speed_mps']:.3f}",
            "scaling": f"{piece['scaling']:.2f}",
            "programmed_speed_mps": f"{piece['programmed_speed_mps']:.6g}",
            "limit_N": "" if piece["limit_N"] is None else f"{piece['limit_N']:g}",
        }
        writer.writerow(row)
    return stream.getvalue()


def scaling_result(speeds: PathSpeeds, provenance: Provenance) -> dict[str, Any]:
    """The head and a dictionary for each piece, for JSON.

    Raises
    ------
    InputError
        The path has no programmed speed.
    """
    if any(math.isnan(value) for value in speeds.programmed.tolist()):
        raise InputError(
            "scaling: the path has no programmed speed; give times (time_s) in the path, or speed_mps in the task"
        )
    rows = []
    points = speeds.path.points.tolist()
    for i, name in enumerate(speeds.path.names):
        allowed, programmed = float(speeds.speed[i]), float(speeds.programmed[i])
        shown = "0.000" if math.isnan(allowed) else floor_speed(allowed)
        rows.append(
            {
                "piece": i + 1,
                "segment": name,
                **dict(zip(_COLUMNS[2:8], [*points[i], *points[i + 1]], strict=True)),
                "programmed_speed_mps": programmed,
                "allowed_speed_mps": float(shown),
                "scaling": _scaling(Decimal(shown), programmed),
                "outcome": str(speeds.outcome[i]),
                "governed_by": str(speeds.governed_by[i]),
                "limit_N": None if math.isnan(speeds.limit[i]) else float(speeds.limit[i]),
                "reason": str(speeds.reason[i]),
            }
        )
    return head_result(provenance) | {"pieces": rows}


def _scaling(allowed: Decimal, programmed: float) -> float:
    """Allowed over programmed speed, at most 1, never rounded up."""
    share = min(Decimal(1), allowed / Decimal(repr(programmed)))
    return float(share.quantize(Decimal("0.01"), rounding=ROUND_FLOOR))
