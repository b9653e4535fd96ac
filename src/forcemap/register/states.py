"""The state of cells and releases: what is known of them now, and what speaks against a release."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Connection, select, union

from forcemap.errors import few
from forcemap.findings import Finding, FindingKind
from forcemap.register.audit import head
from forcemap.register.connection import Register
from forcemap.register.contradicted import campaigns_since, contradicted_since
from forcemap.register.enter import current, facts_of, joined, require_cell
from forcemap.register.in_force import KINDS, Fact, Withdrawal, failed
from forcemap.register.release import entered_again, entered_elsewhere, released
from forcemap.register.tables import AUDIT, CAMPAIGNS, CELLS, FACTS, RELEASES, WITHDRAWALS

_LATER = RELEASES.alias()
NOT_REPLACED = ~select(_LATER.c.id).where(_LATER.c.replaces == RELEASES.c.id).exists()


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
    since : tuple of str
        Other campaigns of its cell that were entered since: whether its map holds beside them is not compared.
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
    since: tuple[str, ...]
    failed: tuple[Finding, ...]

    @property
    def speeds(self) -> dict[str, Any]:
        """What was released, speeds in m/s to program."""
        return dict(json.loads(self.speeds_json))

    @property
    def not_compared(self) -> Finding | None:
        """That other campaigns were entered since; None if none was."""
        return Finding.of(FindingKind.RELEASE_NOT_COMPARED, campaigns=few(self.since)) if self.since else None

    @property
    def confirmed(self) -> bool | None:
        """Whether impacts at released speeds confirmed it; None of an earlier version, which did not keep it."""
        return self.speeds.get("confirmed")

    @property
    def points_refused(self) -> list[str] | None:
        """Contact points that its report does not permit; None of an earlier version, which did not keep them."""
        return self.speeds.get("points_not_permitted")

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


def cell_states(register: Register) -> tuple[CellState, ...]:
    """All cells by their names."""
    return states_with(register)


def states_with(register: Register, *which: ColumnElement[bool]) -> tuple[CellState, ...]:
    """All cells, with these releases."""
    with register.reading() as connection:
        cells = {row.id: joined(row.site, row.name) for row in connection.execute(select(CELLS)).all()}
        facts = facts_by_cell(connection)
        releases = release_states(register, connection, *which, facts=facts)
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
        releases = release_states(register, connection, RELEASES.c.cell_id == number)
        events = _events(connection, number)
    return CellState(name, tuple(current(facts).values()), tuple(releases)), events


def release_states(
    register: Register,
    connection: Connection,
    *which: ColumnElement[bool],
    facts: Mapping[int, Sequence[Fact]] | None = None,
) -> list[ReleaseState]:
    """Releases with why they are not in force, the newest first; all facts are given, or those of their cells read."""
    now = current_time(register, connection)
    query = select(RELEASES, CELLS.c.site, CELLS.c.name).join_from(RELEASES, CELLS).where(*which)
    rows = connection.execute(query.order_by(RELEASES.c.id.desc())).mappings().all()
    if facts is None:
        facts = facts_by_cell(connection, FACTS.c.cell_id.in_(select(RELEASES.c.cell_id).where(*which))) if rows else {}
    withdrawn: dict[int, list[Withdrawal]] = {}
    for row in connection.execute(select(WITHDRAWALS)):
        withdrawn.setdefault(row.release_id, []).append(Withdrawal(row.person, row.at, row.reason))
    pairs = select(RELEASES.c.replaces, RELEASES.c.id).where(RELEASES.c.replaces.is_not(None))
    replaced = {row[0]: row[1] for row in connection.execute(pairs)}
    again = entered_again(connection, *which) if rows else {}
    elsewhere = entered_elsewhere(connection, *which) if rows else {}
    contradicted = contradicted_since(connection, *which) if rows else {}
    since = campaigns_since(connection, *which) if rows else {}
    return [
        ReleaseState(
            release=row["id"],
            cell=joined(row["site"], row["name"]),
            **{name: row[name] for name in ("subject", "areas", "contact", "bound", "limit_N", "map_sha256", "at")},
            **{name: row[name] for name in ("report_sha256", "person", "valid_until", "replaces")},
            speeds_json=row["speeds"],
            conditions=json.loads(row["conditions"]),
            simulated=bool(row["simulated"]),
            since=since.get(row["id"], ()),
            failed=failed(
                released(row),
                facts.get(row["cell_id"], ()),
                withdrawn.get(row["id"], ()),
                replaced_by=replaced.get(row["id"]),
                entered_again=again.get(row["id"]),
                entered_elsewhere=elsewhere.get(row["id"]),
                contradicted=contradicted.get(row["id"]),
                now=now,
            ),
        )
        for row in rows
    ]


def facts_by_cell(connection: Connection, *which: ColumnElement[bool]) -> dict[int, list[Fact]]:
    """Facts by the number of their cell."""
    columns = (FACTS.c.kind, FACTS.c.value, FACTS.c.since, FACTS.c.entry, FACTS.c.campaign_id)
    query = select(FACTS.c.cell_id, *columns).where(*which)
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


def current_time(register: Register, connection: Connection) -> str:
    """The time; a clock that was set back stands still at the newest entry."""
    return max(register.clock(connection), head(connection).at)
