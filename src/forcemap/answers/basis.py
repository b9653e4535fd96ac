"""What speeds rest on, as every answer with a speed has it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from forcemap.answers.answer import AllSaid, Answer, Bound, Figure, Said
from forcemap.findings import Finding
from forcemap.limits.force_limits import ForceLimit
from forcemap.maps.force_map import ForceMap
from forcemap.maps.map_file import map_sha256
from forcemap.speeds.basis import Basis, confirming_states
from forcemap.words import assumptions, warnings


class RestsOn(Answer):
    """What a speed rests on; warnings come first. The limit is null where the standard permits no contact.

    `speed_kind` and `speed_error` are what the campaign states about its speeds, the error as a share that is
    subtracted from them; `speed_overshoot_mps` is how far a speed to program lies below the speed at contact.
    `confirming_states` were measured to confirm the map; whether they do for this limit says `forcemap confirm`.
    """

    limit: Said
    limit_N: Figure
    limit_source: str
    contact: str | None
    bound: Bound
    speed_kind: str | None
    speed_error: Figure
    speed_overshoot_mps: float
    simulated: bool
    measure_more_first: bool
    confirming_states: int
    warnings: AllSaid
    assumptions: AllSaid
    map_sha256: str
    limits_sha256: str | None


def campaign_speeds(force_map: ForceMap) -> dict[str, Any]:
    """What the campaign of a map states about its speeds."""
    return {"speed_kind": force_map.conditions.speed_kind or None, "speed_error": force_map.conditions.speed_error}


def rests_on(force_map: ForceMap, basis: Basis, notes: Iterable[Finding | str] = ()) -> dict[str, Any]:
    """What speeds of a map rest on; `notes` are further remarks on the limits."""
    limit, source, sha256 = basis.limit, "given by the user in newtons", None
    if isinstance(limit, ForceLimit):
        source, sha256 = f"{limit}, {', '.join(limit.areas)}; {limit.source}", limit.sha256
    return {
        "limit": basis.limit_finding,
        "limit_N": float(np.min(basis.newtons)),
        "limit_source": source,
        "contact": basis.contact,
        "bound": basis.bound,
        **campaign_speeds(force_map),
        "speed_overshoot_mps": math.nan if basis.allowance is None else basis.allowance.speed,
        "simulated": force_map.simulated,
        "measure_more_first": basis.measure_more,
        "confirming_states": len(confirming_states(force_map)),
        "warnings": warnings([basis]),
        "assumptions": [*notes, *assumptions([basis])],
        "map_sha256": map_sha256(force_map),
        "limits_sha256": sha256,
    }
