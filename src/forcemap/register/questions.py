"""What the register is asked: the state of cells, what is due, who relies on what, where a force was exceeded."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

from sqlalchemy import ColumnElement, Connection, case, func, or_, select, union

from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.register.audit import head
from forcemap.register.connection import Register
from forcemap.register.enter import current, facts_of, joined, require_cell
from forcemap.register.in_force import KINDS, Fact, Withdrawal, failed
from forcemap.register.release import released
from forcemap.register.tables import (
    AUDIT,
    CAMPAIGNS,
    CELLS,
    FACTS,
    IMPACTS,
    MAPS,
    RECORDINGS,
    RELEASES,
    USES,
    WITHDRAWALS,
)

DUE_WITHIN = 30
"""Days before a release or a calibration ends in which it is due, unless stated; a choice: laboratories take weeks."""

_LATER = RELEASES.alias()
_NOT_REPLACED = ~select(_LATER.c.id).where(_LATER.c.replaces == RELEASES.c.id).exists()
_SHOWN = 20  # impacts that are named, the largest first; a choice
_SHORTEST = 8  # characters of a hash that is looked up; a choice
_HASH = re.compile(r"[0-9a-f]+")


@dataclass(frozen=True)
class ReleaseState:
    """A release, and why it is not in force.

    Parameters
    ----------
    release : int
        Its number.
    cell, subject, areas, contact, bound : str
        What is released: for which cell, of its workspace, a task or a contact point, and what it rests on.
    limit_N : float or None
        The lowest force limit [N].
    speeds_json : str
        What was released, as it was entered.
    map_sha256 : str or None
        None where it rests on impacts alone.
    report_sha256, person, at : str
        The report's hash; who released it, and when.
    valid_until : str or None
        The last day on which it holds.
    conditions : mapping of str to (str or None)
        What it was measured under.
    replaces : int or None
        The release whose place it took.
    simulated : bool
    failed : tuple of Finding
        Why it is not in force; empty if it is.
    """

    release: int
    cell: str
    subject: str
    areas: str
    contact: str
    bound: str
    limit_N: float | None
    speeds_json: str
    map_sha256: str | None
    report_sha256: str
    person: str
    at: str
    valid_until: str | None
    conditions: Mapping[str, str | None]
    replaces: int | None
    simulated: bool
    failed: tuple[Finding, ...]

    @property
    def speeds(self) -> dict[str, Any]:
        """What was released, speeds in m/s to program."""
        return dict(json.loads(self.speeds_json))

    @property
    def in_force(self) -> bool:
        """True if nothing speaks against it."""
        return not self.failed

    @property
    def counts(self) -> bool:
        """False once it is withdrawn or replaced: then nothing is due of it."""
        gone = (FindingKind.RELEASE_WITHDRAWN, FindingKind.RELEASE_REPLACED)
        return not any(finding.kind in gone for finding in self.failed)


@dataclass(frozen=True)
class CellState:
    """A cell: what is known of it, and its releases, the newest first.

    Parameters
    ----------
    cell : str
        SITE/NAME.
    facts : tuple of Fact
        What holds now; what was never stated is not among them.
    releases : tuple of ReleaseState
    """

    cell: str
    facts: tuple[Fact, ...]
    releases: tuple[ReleaseState, ...]

    @property
    def unknown(self) -> tuple[str, ...]:
        """Conditions that are not known."""
        known = {fact.kind for fact in self.facts if fact.value is not None}
        return tuple(kind for kind in KINDS if kind not in known)

    @property
    def in_force(self) -> bool:
        """True if every release that counts is in force, and there is one."""
        counting = [release for release in self.releases if release.counts]
        return bool(counting) and all(release.in_force for release in counting)


@dataclass(frozen=True)
class Event:
    """An entry of the audit trail that touched a cell."""

    entry: int
    at: str
    person: str
    action: str
    subject: str
    content: Mapping[str, Any]


@dataclass(frozen=True)
class Due:
    """What is due of a cell, of a release of it if any, or of a device, whose cell is empty."""

    cell: str
    release: int | None
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class Relying:
    """A cell that relies on what was asked for, why, and its releases that do and were not replaced."""

    cell: str
    because: str
    releases: tuple[ReleaseState, ...]


@dataclass(frozen=True)
class Exceeded:
    """Impacts of a campaign beside a limit: how many exceed it, and of how many it cannot be told; the largest [N]."""

    cell: str
    campaign: str
    folder: str
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


def cell_states(register: Register) -> tuple[CellState, ...]:
    """All cells by their names."""
    return _states(register)


def _states(register: Register, *which: ColumnElement[bool]) -> tuple[CellState, ...]:
    """All cells, with these releases."""
    with register.reading() as connection:
        cells = {row.id: joined(row.site, row.name) for row in connection.execute(select(CELLS)).all()}
        facts = _facts(connection)
        releases = _releases(register, connection, *which, facts=facts)
    of_cell: dict[str, list[ReleaseState]] = {}
    for release in releases:
        of_cell.setdefault(release.cell, []).append(release)
    states = (
        CellState(name, tuple(current(facts.get(number, ())).values()), tuple(of_cell.get(name, ())))
        for number, name in cells.items()
    )
    return tuple(sorted(states, key=lambda state: state.cell))


def cell_state(register: Register, cell: str) -> tuple[CellState, tuple[Event, ...]]:
    """A cell, and its history, the newest first.

    Raises
    ------
    RegisterError
        There is no such cell, or several.
    """
    with register.reading() as connection:
        number, name = require_cell(connection, cell)
        facts = facts_of(connection, number)
        releases = _releases(register, connection, RELEASES.c.cell_id == number)
        events = _events(connection, number)
    return CellState(name, tuple(current(facts).values()), tuple(releases)), events


def due(register: Register, *, within: int = DUE_WITHIN) -> tuple[Due, ...]:
    """What is due: releases that do not hold or end within so many days, cells without one, calibrations that end."""
    found: list[Due] = []
    states = _states(register, _NOT_REPLACED)
    with register.reading() as connection:
        today = _now(register, connection)[:10]
        devices = _devices(connection)
    for state in states:
        counting = [release for release in state.releases if release.counts]
        for release in counting:
            if release.failed:
                found.append(Due(state.cell, release.release, release.failed))
            elif (days := _days(today, release.valid_until or today)) <= within:
                figures = {"until": release.valid_until, "days": days}
                found.append(Due(state.cell, release.release, (Finding.of(FindingKind.RELEASE_ENDS, **figures),)))
        if not counting:
            found.append(Due(state.cell, None, (Finding.of(FindingKind.RELEASE_NONE),)))
    for device, until in devices.items():
        if until is None:
            found.append(Due("", None, (Finding.of(FindingKind.CALIBRATION_UNDATED, model=device),)))
        elif (days := _days(today, until)) <= within:
            kind = FindingKind.CALIBRATION_OVER if days < 0 else FindingKind.CALIBRATION_ENDS
            found.append(Due("", None, (Finding.of(kind, model=device, until=until, days=days),)))
    return tuple(found)


def relying_on_condition(register: Register, kind: str, value: str) -> tuple[Relying, ...]:
    """Cells that have a condition now, such as a firmware, or releases that were made under it."""
    with register.reading() as connection:
        with_it = select(FACTS.c.cell_id).where(FACTS.c.kind == kind, FACTS.c.value == value)
        rows = connection.execute(select(CELLS).where(CELLS.c.id.in_(with_it))).all()
        numbers = [row.id for row in rows]
        facts = _facts(connection, FACTS.c.cell_id.in_(with_it), FACTS.c.kind == kind)
        releases = _releases(register, connection, RELEASES.c.cell_id.in_(with_it), _NOT_REPLACED) if numbers else []
    found = []
    for row in rows:
        cell, now = joined(row.site, row.name), current(facts[row.id])[kind]
        resting = tuple(each for each in releases if each.cell == cell and each.conditions.get(kind) == value)
        if now.value == value:
            found.append(Relying(cell, f"has {kind} {value} since {now.since[:10]}", resting))
        elif resting:
            found.append(Relying(cell, f"had {kind} {value} when it was released", resting))
    return tuple(sorted(found, key=lambda each: each.cell))


def relying_on_map(register: Register, digest: str) -> tuple[Relying, ...]:
    """Cells with releases that rest on a map, by its hash or the beginning of it, or with a campaign that holds it."""
    with register.reading() as connection:
        rest = _releases(register, connection, _begins(RELEASES.c.map_sha256, digest), _NOT_REPLACED)
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
    """Cells that were measured with a device, by model and serial number or the serial number alone."""
    plain = device.strip()
    serial = CAMPAIGNS.c.device.endswith(f", {plain}", autoescape=True)
    return _relying_on_campaigns(register, or_(CAMPAIGNS.c.device == plain, serial), f"measured with {plain}")


def relying_on_recording(register: Register, digest: str) -> tuple[Relying, ...]:
    """Cells whose campaigns have a recording, by the hash of its file or the beginning of it."""
    has = (
        select(USES.c.campaign_id).join_from(RECORDINGS, IMPACTS).join(USES).where(_begins(RECORDINGS.c.sha256, digest))
    )
    return _relying_on_campaigns(register, CAMPAIGNS.c.id.in_(has), "has the recording")


def exceeded(register: Register, limit: float) -> tuple[tuple[Exceeded, ...], tuple[LargeImpact, ...]]:
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


def _counted(connection: Connection, limit: float) -> dict[int, list[Any]]:
    """Of each campaign that is not wholly below a force: impacts above it, impacts not told, the largest [N]."""
    error = connection.execute(select(func.max(CAMPAIGNS.c.device_error_N))).scalar() or 0.0
    above = func.sum(case((IMPACTS.c.largest_N > limit, 1), else_=0))
    near = (IMPACTS.c.largest_N <= limit) & (IMPACTS.c.largest_N + CAMPAIGNS.c.device_error_N > limit)
    told = select(
        IMPACTS.c.campaign_id,
        above,
        func.sum(case((near & (IMPACTS.c.whole == 1), 1), else_=0)),
        func.max(IMPACTS.c.largest_N),
    )
    told = told.join_from(IMPACTS, CAMPAIGNS).where(IMPACTS.c.largest_N > limit - error).group_by(IMPACTS.c.campaign_id)
    below = or_(IMPACTS.c.largest_N.is_(None), IMPACTS.c.largest_N <= limit)
    not_whole = select(IMPACTS.c.campaign_id, func.count(), func.max(IMPACTS.c.largest_N))
    not_whole = not_whole.where(IMPACTS.c.whole == 0, below).group_by(IMPACTS.c.campaign_id)
    counted: dict[int, list[Any]] = {row[0]: list(row[1:]) for row in connection.execute(told) if row[1] or row[2]}
    for number, count, largest in connection.execute(not_whole):
        figures = counted.setdefault(number, [0, 0, largest])
        figures[1] += count
    return counted


def _campaign_places(connection: Connection, numbers: Iterable[int]) -> dict[int, tuple[str, str, str]]:
    """Cell, name and folder of campaigns."""
    query = select(CAMPAIGNS.c.id, CELLS.c.site, CELLS.c.name.label("cell"), CAMPAIGNS.c.name, CAMPAIGNS.c.folder)
    rows = connection.execute(query.join_from(CAMPAIGNS, CELLS, isouter=True))
    wanted = set(numbers)
    return {
        row.id: (joined(row.site, row.cell) if row.cell else "", row.name, row.folder)
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


def _relying_on_campaigns(register: Register, which: ColumnElement[bool], because: str) -> tuple[Relying, ...]:
    """The cells of campaigns, and the releases that rest on these."""
    with register.reading() as connection:
        query = select(CAMPAIGNS.c.id, CAMPAIGNS.c.name, CELLS.c.site, CELLS.c.name.label("cell"))
        rows = connection.execute(query.join_from(CAMPAIGNS, CELLS, isouter=True).where(which)).all()
        numbers = select(CAMPAIGNS.c.id).where(which)
        releases = _releases(register, connection, RELEASES.c.campaign_id.in_(numbers), _NOT_REPLACED) if rows else []
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


def _releases(
    register: Register,
    connection: Connection,
    *which: ColumnElement[bool],
    facts: Mapping[int, Sequence[Fact]] | None = None,
) -> list[ReleaseState]:
    """Releases with why they are not in force, the newest first; all facts are given, or those of their cells read."""
    now = _now(register, connection)
    query = select(RELEASES, CELLS.c.site, CELLS.c.name).join_from(RELEASES, CELLS).where(*which)
    rows = connection.execute(query.order_by(RELEASES.c.id.desc())).mappings().all()
    if facts is None:
        facts = _facts(connection, FACTS.c.cell_id.in_(select(RELEASES.c.cell_id).where(*which))) if rows else {}
    withdrawn: dict[int, list[Withdrawal]] = {}
    for row in connection.execute(select(WITHDRAWALS)):
        withdrawn.setdefault(row.release_id, []).append(Withdrawal(row.person, row.at, row.reason))
    pairs = select(RELEASES.c.replaces, RELEASES.c.id).where(RELEASES.c.replaces.is_not(None))
    replaced = {row[0]: row[1] for row in connection.execute(pairs)}
    return [
        ReleaseState(
            release=row["id"],
            cell=joined(row["site"], row["name"]),
            **{name: row[name] for name in ("subject", "areas", "contact", "bound", "limit_N", "map_sha256", "at")},
            **{name: row[name] for name in ("report_sha256", "person", "valid_until", "replaces")},
            speeds_json=row["speeds"],
            conditions=json.loads(row["conditions"]),
            simulated=bool(row["simulated"]),
            failed=failed(
                released(row),
                facts.get(row["cell_id"], ()),
                withdrawn.get(row["id"], ()),
                replaced_by=replaced.get(row["id"]),
                now=now,
            ),
        )
        for row in rows
    ]


def _facts(connection: Connection, *which: ColumnElement[bool]) -> dict[int, list[Fact]]:
    """Facts by the number of their cell."""
    query = select(FACTS.c.cell_id, FACTS.c.kind, FACTS.c.value, FACTS.c.since, FACTS.c.entry).where(*which)
    found: dict[int, list[Fact]] = {}
    for number, *fact in connection.execute(query).all():  # one after the other takes twice as long
        found.setdefault(number, []).append(Fact(*fact))
    return found


def _events(connection: Connection, cell: int) -> tuple[Event, ...]:
    of_cell = select(RELEASES.c.id).where(RELEASES.c.cell_id == cell)
    entries = union(
        *(select(table.c.entry).where(table.c.cell_id == cell) for table in (FACTS, CAMPAIGNS, RELEASES)),
        select(WITHDRAWALS.c.entry).where(WITHDRAWALS.c.release_id.in_(of_cell)),
    )
    rows = connection.execute(select(AUDIT).where(AUDIT.c.id.in_(entries)).order_by(AUDIT.c.id.desc()))
    return tuple(Event(row.id, row.at, row.person, row.action, row.subject, json.loads(row.content)) for row in rows)


def _devices(connection: Connection) -> dict[str, str | None]:
    """Devices, and until when the latest calibration that is known of each holds."""
    query = select(CAMPAIGNS.c.device, func.max(CAMPAIGNS.c.calibrated_until)).where(CAMPAIGNS.c.device != "")
    return {
        row[0]: row[1] for row in connection.execute(query.group_by(CAMPAIGNS.c.device).order_by(CAMPAIGNS.c.device))
    }


def _now(register: Register, connection: Connection) -> str:
    """The time; a clock that was set back stands still at the newest entry."""
    return max(register.clock(connection), head(connection).at)


def _days(today: str, until: str) -> int:
    return (date.fromisoformat(until) - date.fromisoformat(today)).days


def _begins(column: Any, digest: str) -> ColumnElement[bool]:
    """Whether a hash begins with these characters."""
    plain = digest.strip().lower()
    if not (_SHORTEST <= len(plain) <= 64 and _HASH.fullmatch(plain)):
        raise InputError(f"hash: found {digest[:100]!r}, expected {_SHORTEST} to 64 hexadecimal digits, or a file")
    found: ColumnElement[bool] = (column >= plain) & (column < f"{plain}g")
    return found
