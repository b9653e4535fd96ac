"""Impacts of a cell above the limit of a release, or that clamp, at speeds that it permits where they were measured."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from itertools import groupby
from typing import Any

import numpy as np
from sqlalchemy import ColumnElement, Connection, case, func, or_, select, true

from forcemap.campaigns.recordings_table import Use
from forcemap.campaigns.state import PLACE_SIZE
from forcemap.errors import few
from forcemap.findings import Finding, FindingKind
from forcemap.limits.body_areas import MAX_TRANSIENT_FACTOR
from forcemap.limits.force_limits import Contact
from forcemap.register.enter import same_campaign
from forcemap.register.in_force import DEVICE, KINDS
from forcemap.register.tables import CAMPAIGNS, IMPACTS, RELEASES, USES
from forcemap.speeds.allowance import Allowance

_CELL = CAMPAIGNS.c.cell_id == RELEASES.c.cell_id
_NOT_COUNTED = [str(use) for use in (Use.EXCLUDED, Use.UNREADABLE)]  # one that was discarded may have read too little
_ANY = IMPACTS.c.whole.in_((0, 1)) & IMPACTS.c.use.not_in(_NOT_COUNTED)  # the index begins with the first column
_OVERSHOOT = Allowance().speed + 1e-9  # with what rounding leaves of a speed [m/s]
POINT = "point "
"""With which the subject of a contact point's release begins."""

_FIGURES = ("distance_m", "height_m", "speed_mps", "peak_force_N", "phase2_force_N", "largest_N", "state_id")
_OF_IMPACT = (
    *(IMPACTS.c[name] for name in _FIGURES),
    CAMPAIGNS.c.name,
    CAMPAIGNS.c.conditions,
    CAMPAIGNS.c.measured_on,
)


def contradicted_since(connection: Connection, *which: ColumnElement[bool]) -> dict[int, Finding]:
    """What impacts that were entered after releases say against them, by the release."""
    query = select(RELEASES.c.id, *_OF_IMPACT).join_from(RELEASES, CAMPAIGNS, _CELL)
    query = query.join(IMPACTS, IMPACTS.c.campaign_id == CAMPAIGNS.c.id + 0)  # + 0: campaigns first, then their impacts
    limit, transient = RELEASES.c.limit_N, RELEASES.c.contact.contains(Contact.TRANSIENT)
    least = case((transient, limit / MAX_TRANSIENT_FACTOR), else_=limit)
    exceeds = or_(IMPACTS.c.largest_N > limit, IMPACTS.c.phase2_force_N > least)
    later = (CAMPAIGNS.c.entry > RELEASES.c.entry) & _ANY & (IMPACTS.c.largest_N > least) & exceeds  # by the index
    rows = connection.execute(query.where(later, *which).order_by(RELEASES.c.id)).all()
    found: dict[int, Finding] = {}
    for number, above in groupby(rows, key=lambda row: row.id):
        of = connection.execute(select(RELEASES).where(RELEASES.c.id == number)).mappings().one()
        said = _above(FindingKind.RELEASE_CONTRADICTED, dict(of), above)
        found |= {number: said} if said else {}
    return found


def contradicts(connection: Connection, values: Mapping[str, Any]) -> Finding | None:
    """What impacts of other campaigns of its cell say against a release; None if nothing.

    Parameters
    ----------
    connection : Connection
    values : mapping
        The columns of the release.
    """
    query = select(*_OF_IMPACT).join_from(IMPACTS, CAMPAIGNS).where(CAMPAIGNS.c.cell_id == values["cell_id"])
    own = select(IMPACTS.c.recording_id).join(USES).where(USES.c.campaign_id == values["campaign_id"])
    exceeds = or_(IMPACTS.c.largest_N > values["limit_N"], IMPACTS.c.phase2_force_N > _held(values))
    query = query.where(_ANY, exceeds, IMPACTS.c.recording_id.not_in(own))
    return _above(FindingKind.RELEASED_CONTRADICTED, values, connection.execute(query))


def entered_after(connection: Connection, campaign: int) -> Finding | None:
    """That other campaigns of its cell were entered after one, or not measured before its first day as far as is known;
    None if none was."""
    own, other = CAMPAIGNS, CAMPAIGNS.alias()
    first = func.coalesce(own.c.measured_from, own.c.measured_on)
    newer = (other.c.entry > own.c.entry) | func.coalesce(other.c.measured_on >= first, true())
    later = (other.c.cell_id == own.c.cell_id) & newer & ~same_campaign(other)
    query = select(other.c.name).join_from(own, other, later).where(own.c.id == campaign).order_by(other.c.id)
    names = tuple(dict.fromkeys(connection.execute(query).scalars()))
    return Finding.of(FindingKind.RELEASED_NOT_COMPARED, campaigns=few(names)) if names else None


def campaigns_since(connection: Connection, *which: ColumnElement[bool]) -> dict[int, tuple[str, ...]]:
    """Other campaigns of their cells that were entered after releases, by the release."""
    later = CAMPAIGNS.alias()
    query = select(RELEASES.c.id, later.c.name).join_from(RELEASES, CAMPAIGNS, RELEASES.c.campaign_id == CAMPAIGNS.c.id)
    query = query.join(later, later.c.cell_id == RELEASES.c.cell_id)
    query = query.where((later.c.entry > RELEASES.c.entry) & ~same_campaign(later), *which)
    found: dict[int, dict[str, None]] = {}
    for number, name in connection.execute(query.order_by(later.c.id)):
        found.setdefault(number, {})[name] = None
    return {number: tuple(names) for number, names in found.items()}


def _above(kind: FindingKind, of: Mapping[str, Any], impacts: Iterable[Any]) -> Finding | None:
    """The finding of the impacts that a release, `of` its columns, permits the speed of, by the one furthest above.

    Earlier ones than its own count if they were made under the same conditions; one whose speed is not known is slow.
    """
    speeds, limit, held = json.loads(of["speeds"]), of["limit_N"], _held(of)
    counted = [each for each in impacts if _counts(each, of)]
    permitted = ((each, _permitted(of["subject"], speeds, each)) for each in counted)
    at_permitted = [(each, to) for each, to in permitted if to and (each.speed_mps or 0.0) <= to]
    shares = [max(_force(each) / limit, (each.phase2_force_N or 0.0) / held) for each, _ in at_permitted]
    above = [(share, each, to) for share, (each, to) in zip(shares, at_permitted, strict=True) if share > 1]
    if not above:
        return None
    _, worst, to = max(above, key=lambda each: each[0])
    force = _force(worst)
    return Finding.of(
        kind,
        impacts=len(above),
        campaign=worst.name,
        state=worst.state_id,
        force_N=force if force > limit else worst.phase2_force_N,
        held_N=None if force > limit else held,
        speed_mps=worst.speed_mps,
        permitted_mps=round(to - _OVERSHOOT, 3),
        limit_N=limit,
    )


def _held(of: Mapping[str, Any]) -> float:
    """Largest Phase II force [N] beside a release: of a transient limit the least that a quasi-static one has of it."""
    return float(of["limit_N"]) / (MAX_TRANSIENT_FACTOR if Contact.TRANSIENT in of["contact"] else 1.0)


def _counts(impact: Any, of: Mapping[str, Any]) -> bool:
    """Whether an impact was made in the days of a release or later, or before under its conditions, whatever device."""
    then, now = json.loads(impact.conditions), json.loads(of["conditions"])
    same = all(then.get(kind) == now.get(kind) for kind in KINDS if kind != DEVICE)
    return same or (impact.measured_on or "9") >= (of["measured_from"] or "")


def _force(impact: Any) -> float:
    """The force of an impact [N], of the two phases the larger; what was read at most where neither was found."""
    phases = (impact.peak_force_N, impact.phase2_force_N)
    return float(max((force for force in phases if force is not None), default=impact.largest_N))


def _permitted(subject: str, speeds: Mapping[str, Any], impact: Any) -> float:
    """The speed at contact that a release permits where an impact was made [m/s]; 0 if it permits none there.

    Within PLACE_SIZE of a zone or point the robot may be there. An impact at a contact point has the point's name.
    """
    if subject == f"{POINT}{impact.state_id}":
        return float(speeds["highest_to_program_mps"]) + _OVERSHOOT
    if impact.distance_m is None or impact.height_m is None:
        return 0.0
    place = np.array([impact.distance_m, impact.height_m])
    if "speed_mmps" in speeds:
        edges = [np.array(speeds[f"{axis}_edges_m"]) for axis in ("distance", "height")]
        near = [(e[:-1] <= v + PLACE_SIZE) & (v - PLACE_SIZE <= e[1:]) for e, v in zip(edges, place, strict=True)]
        fastest = float(np.max(np.array(speeds["speed_mmps"])[np.ix_(*near)], initial=0)) / 1000
    elif "distance_m" in speeds:
        low, high = np.array([speeds["distance_m"], speeds["height_m"]]).T
        beside = np.any((place < low - PLACE_SIZE) | (place > high + PLACE_SIZE))
        fastest = 0.0 if beside else float(speeds["highest_to_program_mps"])
    else:
        return 0.0
    return fastest + _OVERSHOOT if fastest else 0.0
