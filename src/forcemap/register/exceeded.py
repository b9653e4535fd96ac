"""Where a force was exceeded, and of how many impacts it cannot be told."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, case, func, or_, select

from forcemap.errors import InputError
from forcemap.register.connection import Register
from forcemap.register.enter import joined
from forcemap.register.tables import CAMPAIGNS, CELLS, IMPACTS, RECORDINGS, USES

_SHOWN = 20  # impacts that are named, the largest first; a choice


@dataclass(frozen=True)
class Exceeded:
    """Impacts of a campaign beside a limit: how many exceed it, and of how many it cannot be told; the largest [N]."""

    cell: str
    campaign: str
    folder: str
    simulated: bool
    exceeded: int
    cannot_tell: int
    largest_N: float | None


@dataclass(frozen=True)
class LargeImpact:
    """An impact above a limit, and the recording that shows it."""

    cell: str
    campaign: str
    file: str
    state_id: str
    largest_N: float
    recording_sha256: str


def where_exceeded(register: Register, limit: float) -> tuple[tuple[Exceeded, ...], tuple[LargeImpact, ...]]:
    """Where impacts exceed a force, the most first, and the largest of them.

    Not told is what lies within the device's error of it, or may have been more than was read.

    Raises
    ------
    InputError
        Not a positive finite force.
    """
    if not 0 < limit < float("inf"):
        raise InputError(f"limit: found {limit:g} N, expected a positive finite number")
    with register.reading() as connection:
        counted = _counted(connection, limit)
        places = _campaign_places(connection, counted)
        large = _largest(connection, limit)
    found = [Exceeded(*places[number], *figures) for number, figures in counted.items()]
    return tuple(sorted(found, key=lambda each: (-each.exceeded, -each.cannot_tell, each.cell, each.folder))), large


def files_above(register: Register, limit: float) -> int:
    """How many files hold an impact above a force [N]: one that was entered for several cells is one."""
    above = select(func.count(IMPACTS.c.recording_id.distinct())).where(IMPACTS.c.largest_N > limit)
    with register.reading() as connection:
        return int(connection.execute(above).scalar() or 0)


def _counted(connection: Connection, limit: float) -> dict[int, list[Any]]:
    """Of each campaign that is not wholly below a force: impacts above it, impacts not told, the largest [N].

    An impact is near if it is within the largest device error that any campaign states that has it.
    """
    error = connection.execute(select(func.max(CAMPAIGNS.c.device_error_N))).scalar() or 0.0
    few = (IMPACTS.c.largest_N <= limit) & (IMPACTS.c.largest_N > limit - error) & (IMPACTS.c.whole == 1)
    near = select(IMPACTS.c.id).join_from(IMPACTS, USES).join(CAMPAIGNS, USES.c.campaign_id == CAMPAIGNS.c.id)
    near = near.where(few, IMPACTS.c.largest_N + CAMPAIGNS.c.device_error_N > limit).distinct()
    above = func.sum(case((IMPACTS.c.largest_N > limit, 1), else_=0))
    told = select(IMPACTS.c.campaign_id, above, func.count() - above, func.max(IMPACTS.c.largest_N))
    told = told.where(or_(IMPACTS.c.largest_N > limit, IMPACTS.c.id.in_(near))).group_by(IMPACTS.c.campaign_id)
    below = or_(IMPACTS.c.largest_N.is_(None), IMPACTS.c.largest_N <= limit)
    not_whole = select(IMPACTS.c.campaign_id, func.count(), func.max(IMPACTS.c.largest_N))
    not_whole = not_whole.where(IMPACTS.c.whole == 0, below).group_by(IMPACTS.c.campaign_id)
    counted: dict[int, list[Any]] = {row[0]: list(row[1:]) for row in connection.execute(told) if row[1] or row[2]}
    for number, count, largest in connection.execute(not_whole):
        figures = counted.setdefault(number, [0, 0, largest])
        figures[1] += count
    return counted


def _campaign_places(connection: Connection, numbers: Iterable[int]) -> dict[int, tuple[str, str, str, bool]]:
    """Cell, name and folder of campaigns."""
    columns = (CAMPAIGNS.c.id, CAMPAIGNS.c.name, CAMPAIGNS.c.folder, CAMPAIGNS.c.simulated)
    query = select(*columns, CELLS.c.site, CELLS.c.name.label("cell"))
    rows = connection.execute(query.join_from(CAMPAIGNS, CELLS, isouter=True))
    wanted = set(numbers)
    return {
        row.id: (joined(row.site, row.cell) if row.cell else "", row.name, row.folder, bool(row.simulated))
        for row in rows
        if row.id in wanted
    }


def _largest(connection: Connection, limit: float) -> tuple[LargeImpact, ...]:
    first = select(IMPACTS.c.id).where(IMPACTS.c.largest_N > limit).order_by(IMPACTS.c.largest_N.desc()).limit(_SHOWN)
    columns = (
        IMPACTS.c.id,
        CELLS.c.site,
        CELLS.c.name.label("cell"),
        CAMPAIGNS.c.name,
        USES.c.file,
        IMPACTS.c.state_id,
    )
    query = select(*columns, IMPACTS.c.largest_N, RECORDINGS.c.sha256).join_from(IMPACTS, CAMPAIGNS).join(RECORDINGS)
    query = query.outerjoin(CELLS, CAMPAIGNS.c.cell_id == CELLS.c.id).join(
        USES, (USES.c.impact_id == IMPACTS.c.id) & (USES.c.campaign_id == CAMPAIGNS.c.id)
    )
    numbers = [row.id for row in connection.execute(first)]
    rows = connection.execute(query.where(IMPACTS.c.id.in_(numbers))).all()
    found = [
        LargeImpact(joined(r.site, r.cell) if r.cell else "", r.name, r.file, r.state_id, r.largest_N, r.sha256)
        for r in rows
    ]
    return tuple(sorted(found, key=lambda each: (-each.largest_N, each.file)))
