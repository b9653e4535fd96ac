"""Who relies on a condition, a map, a device or a recording."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, func, or_, select

from forcemap.errors import InputError
from forcemap.register.audit import stated
from forcemap.register.connection import Register
from forcemap.register.enter import LONGEST, current, joined
from forcemap.register.in_force import DEVICE, KINDS, Fact
from forcemap.register.states import NOT_REPLACED, ReleaseState, facts_by_cell, release_states
from forcemap.register.tables import CAMPAIGNS, CELLS, FACTS, IMPACTS, MAPS, RECORDINGS, RELEASES, USES

_SHORTEST = 8  # characters of a hash that is looked up; a choice
_HASH = re.compile(r"[0-9a-f]+")


@dataclass(frozen=True)
class Relying:
    """A cell that relies on what was asked for, why, and its releases that do and were not replaced."""

    cell: str
    because: str
    releases: tuple[ReleaseState, ...]


def relying_on_condition(register: Register, kind: str, value: str) -> tuple[Relying, ...]:
    """Cells that have a condition now, such as a firmware, or releases that were made under it."""
    value = stated(kind, value, longest=LONGEST)
    with register.reading() as connection:
        with_it = select(FACTS.c.cell_id).where(FACTS.c.kind == kind, FACTS.c.value == value)
        rows = connection.execute(select(CELLS).where(CELLS.c.id.in_(with_it))).all()
        numbers = [row.id for row in rows]
        facts = facts_by_cell(connection, FACTS.c.cell_id.in_(with_it), FACTS.c.kind == kind)
        releases = (
            release_states(register, connection, RELEASES.c.cell_id.in_(with_it), NOT_REPLACED) if numbers else []
        )
    found = []
    for row in rows:
        cell, now = joined(row.site, row.name), current(facts[row.id])[kind]
        resting = tuple(each for each in releases if each.cell == cell and each.conditions.get(kind) == value)
        if now.value == value:
            found.append(Relying(cell, f"has {kind} {value} since {now.since[:10]}", resting))
        elif resting:
            found.append(Relying(cell, f"had {kind} {value} when it was released", resting))
    return tuple(sorted(found, key=lambda each: each.cell))


def not_known_of(register: Register, kind: str) -> tuple[str, ...]:
    """Cells of which it is not known whether they rely on something of a kind; none for maps and recordings."""
    if kind not in KINDS:
        return ()
    of_kind = FACTS.c.kind == kind
    stated_of = select(FACTS.c.cell_id).where(of_kind, FACTS.c.value.is_not(None))
    doubtful = select(FACTS.c.cell_id).where(of_kind, FACTS.c.value.is_(None))
    query = select(CELLS).where(or_(CELLS.c.id.not_in(stated_of), CELLS.c.id.in_(doubtful)))
    if kind == DEVICE:
        unnamed = select(CAMPAIGNS.c.cell_id).where(CAMPAIGNS.c.device == "", CAMPAIGNS.c.cell_id.is_not(None))
        query = select(CELLS).where(or_(CELLS.c.id.not_in(stated_of), CELLS.c.id.in_(unnamed)))
    with register.reading() as connection:
        rows = connection.execute(query).all()
        facts = facts_by_cell(connection, FACTS.c.cell_id.in_(doubtful), of_kind)
    unknown = [row for row in rows if kind == DEVICE or _is_unknown(facts.get(row.id, []), kind)]
    return tuple(sorted(joined(row.site, row.name) for row in unknown))


def _is_unknown(facts: Sequence[Fact], kind: str) -> bool:
    return not facts or current(facts)[kind].value is None


def known_of(register: Register, kind: str) -> tuple[str, ...]:
    """What there is of a kind, sorted: for whoever asked for something that there is not. None for maps, recordings."""
    column = {DEVICE: CAMPAIGNS.c.device, **dict.fromkeys(KINDS[:-1], FACTS.c.value)}.get(kind)
    if column is None:
        return ()
    query = select(column).where(column != "").distinct().order_by(column)
    with register.reading() as connection:
        found = connection.execute(query if kind == DEVICE else query.where(FACTS.c.kind == kind))
        return tuple(found.scalars().all())


def relying_on_map(register: Register, digest: str) -> tuple[Relying, ...]:
    """Cells with releases that rest on a map, by its hash or the beginning of it, or with a campaign that holds it."""
    with register.reading() as connection:
        holds = select(MAPS.c.campaign_id).where(_begins(MAPS.c.sha256, digest))
        on_it = or_(_begins(RELEASES.c.map_sha256, digest), RELEASES.c.campaign_id.in_(holds))
        rest = release_states(register, connection, on_it, NOT_REPLACED)
        query = select(CELLS.c.site, CELLS.c.name, MAPS.c.file).join_from(MAPS, CAMPAIGNS).outerjoin(CELLS)
        held = connection.execute(query.where(_begins(MAPS.c.sha256, digest))).all()
    found: dict[str, tuple[str, list[ReleaseState]]] = {}
    for row in held:
        cell = joined(row.site, row.name) if row.name else ""
        found[cell] = (f"holds the map as {row.file}", [])
    for release in rest:
        found.setdefault(release.cell, ("releases rest on the map", []))[1].append(release)
    return tuple(Relying(cell, why, tuple(releases)) for cell, (why, releases) in sorted(found.items()))


def relying_on_device(register: Register, device: str) -> tuple[Relying, ...]:
    """Cells that were measured with a device, by a part of its model and serial number, in small letters or large."""
    plain = stated("device", device)
    named = func.lower(CAMPAIGNS.c.device).contains(plain.lower(), autoescape=True)
    return _relying_on_campaigns(register, named, f"measured with {plain}")


def relying_on_recording(register: Register, digest: str) -> tuple[Relying, ...]:
    """Cells whose campaigns have a recording, by the hash of its file or the beginning of it."""
    with register.reading() as connection:  # one after the other: of a join databases guess too many, and read it all

        def numbers(column: Any, which: ColumnElement[bool]) -> Sequence[int]:
            return connection.execute(select(column).where(which).distinct()).scalars().all()

        recordings = numbers(RECORDINGS.c.id, _begins(RECORDINGS.c.sha256, digest))
        impacts = numbers(IMPACTS.c.id, IMPACTS.c.recording_id.in_(recordings))
        has = numbers(USES.c.campaign_id, USES.c.impact_id.in_(impacts))
    return _relying_on_campaigns(register, CAMPAIGNS.c.id.in_(has), "has the recording")


def _relying_on_campaigns(register: Register, which: ColumnElement[bool], because: str) -> tuple[Relying, ...]:
    """The cells of campaigns, and the releases that rest on these."""
    with register.reading() as connection:
        query = select(CAMPAIGNS.c.id, CAMPAIGNS.c.name, CELLS.c.site, CELLS.c.name.label("cell"))
        rows = connection.execute(query.join_from(CAMPAIGNS, CELLS, isouter=True).where(which)).all()
        numbers = select(CAMPAIGNS.c.id).where(which)
        releases = (
            release_states(register, connection, RELEASES.c.campaign_id.in_(numbers), NOT_REPLACED) if rows else []
        )
    campaigns: dict[str, list[str]] = {}
    for row in rows:
        campaigns.setdefault(joined(row.site, row.cell) if row.cell else "", []).append(row.name)
    return tuple(
        Relying(
            cell,
            f"{because} in {', '.join(dict.fromkeys(names))}",
            tuple(release for release in releases if release.cell == cell),
        )
        for cell, names in sorted(campaigns.items())
    )


def _begins(column: Any, digest: str) -> ColumnElement[bool]:
    """Whether a hash begins with these characters."""
    plain = digest.strip().lower()
    if not (_SHORTEST <= len(plain) <= 64 and _HASH.fullmatch(plain)):
        raise InputError(f"hash: found {digest[:100]!r}, expected {_SHORTEST} to 64 hexadecimal digits, or a file")
    if len(plain) == 64:
        whole: ColumnElement[bool] = column == plain
        return whole
    begins: ColumnElement[bool] = (column >= plain) & (column < f"{plain}g")
    return begins
