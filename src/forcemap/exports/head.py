"""The head of every exported file: what its speeds rest on, and who must confirm them."""

from __future__ import annotations

from typing import Any

from forcemap.robot_tables import Provenance

NOT_SAFETY_RATED = (
    "NOT SAFETY-RATED: an estimate from measurements, looked up by an ordinary program; the robot's own safety "
    "functions must hold without it"
)
SIMULATED = "SIMULATED: made from simulated impacts, not a measurement of any robot; not for use on one"
WHO_CONFIRMS = (
    "to be confirmed before use: by the person responsible for the risk assessment, with measurements at the speeds "
    "used, and by whoever changes the safety configuration"
)


def head_lines(provenance: Provenance) -> list[str]:
    """The head as lines of text."""
    return [
        *([SIMULATED] if any(line.startswith("SIMULATED") for line in provenance.statements) else []),
        "allowed speeds of the contact point, made by forcemap",
        NOT_SAFETY_RATED,
        WHO_CONFIRMS,
        f"map: {provenance.map_name}, SHA-256 {provenance.map_sha256}",
        f"date: {provenance.date}",
        *(f"limit: {limit}" for limit in provenance.limits),
        f"bound: {provenance.bound}",
        f"allowance: {provenance.allowance}",
        *(f"assumes: {line}" for line in provenance.statements),
    ]


def head_result(provenance: Provenance) -> dict[str, Any]:
    """The head for JSON, units in the keys."""
    return {
        "safety_rated": False,
        "notice": NOT_SAFETY_RATED,
        "to_confirm": WHO_CONFIRMS,
        "map": provenance.map_name,
        "map_sha256": provenance.map_sha256,
        "date": provenance.date,
        "limits": list(provenance.limits),
        "limits_N": list(provenance.bound_forces),
        "bound": provenance.bound,
        "speed_overshoot_mps": provenance.allowance.speed,
        "position_tolerance_m": provenance.allowance.position,
        "assumptions": list(provenance.statements),
    }


def commented(lines: list[str], mark: str) -> list[str]:
    """Lines as comments of a program, in ASCII, which every controller reads."""
    return [f"{mark} {line}".encode("ascii", "replace").decode() for line in lines]
