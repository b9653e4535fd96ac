"""Impacts of a cell above the limit of a release at speeds that it permits where they were measured."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from itertools import groupby
from typing import Any

import numpy as np
from sqlalchemy import ColumnElement, Connection, func, select

from forcemap.campaigns.state import PLACE_SIZE
from forcemap.findings import Finding, FindingKind
from forcemap.register.tables import CAMPAIGNS, IMPACTS, RELEASES, USES

_ROUNDING = 1e-9  # of a speed [m/s]
_FIGURES = ("distance_m", "height_m", "speed_mps", "peak_force_N", "phase2_force_N", "largest_N", "state_id")
_OF_IMPACT = (*(IMPACTS.c[name] for name in _FIGURES), CAMPAIGNS.c.name)


def contradicted_since(connection: Connection, *which: ColumnElement[bool]) -> dict[int, Finding]:
    """What impacts that were entered after releases, and measured no earlier, say against them, by the release."""
    query = select(RELEASES.c.id, RELEASES.c.limit_N, RELEASES.c.speeds, *_OF_IMPACT).join_from(
        RELEASES, CAMPAIGNS, _cell
    )
    query = query.join(IMPACTS, IMPACTS.c.campaign_id == CAMPAIGNS.c.id).where(
        IMPACTS.c.largest_N > RELEASES.c.limit_N, IMPACTS.c.entry > RELEASES.c.entry, *which
    )
    since = func.coalesce(CAMPAIGNS.c.measured_on, "9") >= func.coalesce(RELEASES.c.measured_from, "")
    rows = connection.execute(query.where(since).order_by(RELEASES.c.id)).all()
    found = {}
    for number, of_release in groupby(rows, key=lambda row: row.id):
        impacts = list(of_release)
        speeds, limit = json.loads(impacts[0].speeds), impacts[0].limit_N
        if said := _above(FindingKind.RELEASE_CONTRADICTED, speeds, limit, impacts):
            found[number] = said
    return found


def contradicts(connection: Connection, values: Mapping[str, Any]) -> Finding | None:
    """What impacts of other campaigns of its cell, of its days or later, say against a release; None if nothing.

    Parameters
    ----------
    connection : Connection
    values : mapping
        The columns of the release.
    """
    since = func.coalesce(CAMPAIGNS.c.measured_on, "9") >= (values["measured_from"] or "")
    query = select(*_OF_IMPACT).join_from(IMPACTS, CAMPAIGNS).where(CAMPAIGNS.c.cell_id == values["cell_id"], since)
    own = select(IMPACTS.c.recording_id).join(USES).where(USES.c.campaign_id == values["campaign_id"])
    query = query.where(IMPACTS.c.largest_N > values["limit_N"], IMPACTS.c.recording_id.not_in(own))
    rows, speeds = connection.execute(query).all(), json.loads(values["speeds"])
    return _above(FindingKind.RELEASED_CONTRADICTED, speeds, values["limit_N"], rows)


_cell = CAMPAIGNS.c.cell_id == RELEASES.c.cell_id


def _above(kind: FindingKind, speeds: Mapping[str, Any], limit: float, impacts: Iterable[Any]) -> Finding | None:
    """The finding of the impacts that a release permits the speed of, by the one with the largest force."""
    permitted = [(each, _force(each), _permitted(speeds, each.distance_m, each.height_m)) for each in impacts]
    above = [
        (each, force, speed) for each, force, speed in permitted if force > limit and (each.speed_mps or 9) <= speed
    ]
    if not above:
        return None
    worst, force, speed = max(above, key=lambda each: each[1])
    return Finding.of(
        kind,
        impacts=len(above),
        campaign=worst.name,
        state=worst.state_id,
        force_N=force,
        speed_mps=worst.speed_mps,
        permitted_mps=round(speed, 3),
        limit_N=limit,
    )


def _force(impact: Any) -> float:
    """The force of an impact [N], of the two phases the larger; what was read at most where neither was found."""
    phases = (impact.peak_force_N, impact.phase2_force_N)
    return float(max((force for force in phases if force is not None), default=impact.largest_N))


def _permitted(speeds: Mapping[str, Any], distance: float | None, height: float | None) -> float:
    """The speed to program that a release permits at a place [m/s]; 0 if it permits none, or the place is not known."""
    if distance is None or height is None:
        return 0.0
    place = np.array([distance, height])
    if "speed_mmps" in speeds:
        axes = [np.array(speeds[f"{axis}_edges_m"]) for axis in ("distance", "height")]
        if not all(edges[0] <= value <= edges[-1] for edges, value in zip(axes, place, strict=True)):
            return 0.0
        i, j = (min(int(np.searchsorted(e, v, "right")) - 1, e.size - 2) for e, v in zip(axes, place, strict=True))
        return float(speeds["speed_mmps"][i][j]) / 1000 + _ROUNDING
    if "distance_m" in speeds:
        low, high = np.array([speeds["distance_m"], speeds["height_m"]]).T
        near = np.all((place >= low - PLACE_SIZE) & (place <= high + PLACE_SIZE))
        return float(speeds["highest_to_program_mps"]) + _ROUNDING if near else 0.0
    return 0.0
