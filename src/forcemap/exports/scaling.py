"""Speed-scaling factors for the pieces of a trajectory, by which its programmed speed is multiplied."""

from __future__ import annotations

import math
from decimal import ROUND_FLOOR, Decimal
from operator import itemgetter
from typing import Any

from forcemap.exports.head import cell, csv_text, head_lines, head_result, one_line
from forcemap.exports.robot_table import Provenance, require_exportable
from forcemap.paths.path_file import PIECE_PLACES, PIECE_SPEED
from forcemap.paths.path_speeds import PathSpeeds
from forcemap.speeds.safe_speed import floor_speed
from forcemap.words import sentence

_SPEEDS = ("programmed_speed_mps", "allowed_speed_mps", PIECE_SPEED)
_COLUMNS = ("piece", "segment", *PIECE_PLACES, *_SPEEDS, "scaling", "outcome", "governed_by", "limit_N", "reason")
_TEXTS = ("segment", "outcome", "governed_by", "reason")


def scaling_csv(speeds: PathSpeeds, provenance: Provenance) -> str:
    """A row for each piece below a head in comments (#); scaling floored to 0.01, 0.00 where none is permitted.

    Where no speed is programmed there is none to scale: both cells are empty, and the commanded speed stands alone,
    unless that is 0.
    """
    rows = [
        piece
        | {name: cell(piece[name]) for name in _TEXTS}
        | {name: f"{round(piece[name], 6) + 0.0:.6f}" for name in PIECE_PLACES}
        | {name: "" if piece[name] is None else floor_speed(round(piece[name], 9)) for name in _SPEEDS}
        | {"scaling": "" if piece["scaling"] is None else f"{piece['scaling']:.2f}"}
        | {"limit_N": "" if piece["limit_N"] is None else f"{piece['limit_N']:g}"}
        for piece in scaling_result(speeds, provenance)["pieces"]
    ]
    return csv_text(_COLUMNS, map(itemgetter(*_COLUMNS), rows), [*head_lines(provenance), _use(speeds)])


def scaling_result(speeds: PathSpeeds, provenance: Provenance) -> dict[str, Any]:
    """The head and a dictionary for each piece, for JSON; without a programmed speed that is None, and scaling
    unless it is 0.

    Raises
    ------
    NotReleasable
        Nothing may be exported of speeds with their basis.
    """
    for basis in speeds.bases:
        require_exportable(basis)
    rows = []
    points, commanded = speeds.path.points.tolist(), speeds.commanded.tolist()
    for i, name in enumerate(speeds.path.names):
        programmed = None if math.isnan(speeds.programmed[i]) else float(speeds.programmed[i])
        most = Decimal("Infinity") if programmed is None else Decimal(repr(programmed))
        allowed = floor_speed(0.0 if speeds.refused[i] else float(speeds.speed[i]))
        driven = min(Decimal(floor_speed(commanded[i])), most)
        reason = sentence(speeds.reason[i])
        if driven < min(Decimal(allowed), most):
            reason += "; slower here, because a later piece allows less"
        rows.append(
            {
                "piece": i + 1,
                "segment": one_line(name),
                **dict(zip(PIECE_PLACES, [*points[i], *points[i + 1]], strict=True)),
                "programmed_speed_mps": programmed,
                "allowed_speed_mps": float(allowed),
                PIECE_SPEED: float(driven),
                "scaling": _scaling(driven, programmed),
                "outcome": str(speeds.outcome[i]),
                "governed_by": one_line(str(speeds.governed_by[i])),
                "limit_N": None if math.isnan(speeds.limit[i]) else float(speeds.limit[i]),
                "reason": one_line(reason),
            }
        )
    return head_result(provenance) | {"use": _use(speeds), "acceleration_mps2": speeds.acceleration, "pieces": rows}


def _use(speeds: PathSpeeds) -> str:
    """How the factors must be applied, so that they also hold at the boundaries of pieces."""
    return (
        "use: apply each factor, whole percent rounded down, from the start of its piece, on a robot that then "
        f"brakes along the path with at least {speeds.acceleration:g} m/s^2; no piece is then entered faster than "
        "it allows. On one that brakes less, the factor of the slower neighbour must be reached before the boundary. "
        "As motions of a program: one linear motion a piece, to its to_x_m, to_y_m, to_z_m (y is 0 of a path in "
        "distances and heights), at commanded_speed_mps, blended only with the next row of its segment on the same "
        "straight line, by no more than the position tolerance leaves beside the robot's own deviation; at rest "
        "everywhere else. Where no speed is programmed there is no factor but 0, only that speed; where either is 0 "
        "there is no motion to program"
    )


def _scaling(speed: Decimal, programmed: float | None) -> float | None:
    """Commanded over programmed speed, never rounded up; without a programmed one None, 0 if nothing is commanded."""
    if not speed or programmed is None:
        return None if speed else 0.0
    return float((speed / Decimal(repr(programmed))).quantize(Decimal("0.01"), rounding=ROUND_FLOOR))
