"""The audit trail: one entry for each action, in a chain of hashes, with the hash of the rows that it added."""

from __future__ import annotations

import getpass
import hashlib
import json
import re
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Table, func, insert, select, text

from forcemap.errors import InputError
from forcemap.files import sha256
from forcemap.register.connection import Register
from forcemap.register.tables import AUDIT, ROWS
from forcemap.register.triggers import FIRST

_HEAD = re.compile(f"0:{FIRST}|[1-9][0-9]*:[0-9a-f]{{{len(FIRST)}}}")
_AT_ONCE = 5000  # rows that a statement enters, or that are fetched together; a choice
_SIGNED = ("id", "at", "person", "login", "action", "subject", "content", "previous")


@dataclass(frozen=True)
class Head:
    """The newest entry of the chain.

    Parameters
    ----------
    number : int
        Its number; 0 without entries.
    sha256 : str
        Its hash.
    at : str
        Its time; empty without entries.
    """

    number: int
    sha256: str
    at: str

    def __str__(self) -> str:
        return f"{self.number}:{self.sha256}"


def head(connection: Connection) -> Head:
    """The newest entry of the chain."""
    row = connection.execute(
        select(AUDIT.c.id, AUDIT.c.sha256, AUDIT.c.at).order_by(AUDIT.c.id.desc()).limit(1)
    ).first()
    return Head(*row) if row else Head(0, FIRST, "")


class Action:
    """One action in its transaction, which holds the register alone: rows are added, then its entry is written.

    Parameters
    ----------
    register : Register
    connection : Connection
        Of `Register.writing`.
    person : str
        Who acts; the account of this machine if it is empty.
    """

    def __init__(self, register: Register, connection: Connection, person: str = "") -> None:
        self.connection, self._before = connection, head(connection)
        self.entry = self._before.number + 1
        self.at = max(register.clock(connection), self._before.at)  # a clock that was set back moves nothing
        self._login = str(connection.execute(text("select session_user")).scalar()) if register.postgresql else ""
        self.person = stated("person", person or _account(), longest=100)
        self._rows: dict[str, list[dict[str, Any]]] = {}
        self._next: dict[str, int] = {}

    def add(self, table: Table, **values: Any) -> int:
        """Add a row, minus zero as zero: not every database keeps it, and the hash would differ; the row's number."""
        if table.name not in self._next:
            self._next[table.name] = (self.connection.execute(select(func.max(table.c.id))).scalar() or 0) + 1
        number = self._next[table.name]
        self._next[table.name] += 1
        kept = {name: value + 0.0 if isinstance(value, float) else value for name, value in values.items()}
        self._rows.setdefault(table.name, []).append({"id": number, **kept, "entry": self.entry})
        return number

    def done(self, action: str, subject: str, **figures: Any) -> Head:
        """Write the action's entry and its rows; the new head of the chain.

        Parameters
        ----------
        action, subject : str
            What was done to what.
        **figures
            What else the entry says, as JSON.
        """
        digests = {}
        for table in ROWS:
            if rows := self._rows.get(table.name):
                digest = hashlib.sha256()
                for row in rows:
                    digest.update(_line(row))
                digests[table.name] = [len(rows), digest.hexdigest()]
        content = json.dumps({**figures, "rows": digests}, ensure_ascii=False, sort_keys=True)
        entry = {"id": self.entry, "at": self.at, "person": self.person, "login": self._login, "action": action}
        entry |= {"subject": subject, "content": content, "previous": self._before.sha256}
        entry["sha256"] = entry_sha256(entry)
        self.connection.execute(insert(AUDIT), entry)
        for table in ROWS:
            for part in _parts(self._rows.get(table.name, [])):
                self.connection.execute(insert(table), part)
        return Head(self.entry, str(entry["sha256"]), self.at)


def entry_sha256(entry: Mapping[str, Any]) -> str:
    """The hash of an entry of the audit trail, and with `previous` of all before it."""
    return sha256(_line({name: entry[name] for name in _SIGNED}))


def stated(what: str, words: str, *, longest: int = 200) -> str:
    """A text as the register keeps it, without spaces around it.

    Raises
    ------
    InputError
        It is empty, too long, or holds what cannot be printed.
    """
    plain = unicodedata.normalize("NFC", words.strip())
    if not plain or len(plain) > longest:
        raise InputError(f"{what}: found {len(plain)} characters, expected 1 to {longest}")
    if not plain.isprintable():
        raise InputError(f"{what}: found characters that cannot be printed, expected words")
    return plain


def verify(connection: Connection, noted: str | None = None) -> tuple[str, ...]:
    """What shows that the register is not as it was written; empty if nothing does.

    Parameters
    ----------
    connection : Connection
    noted : str, optional
        Head of the chain that was noted elsewhere, `NUMBER:SHA256` as reports print it: entries that were removed at
        the end of the chain leave no other trace.

    Raises
    ------
    InputError
        What was noted is no head.
    """
    if noted is not None and not _HEAD.fullmatch(noted.strip()):
        raise InputError("head: expected NUMBER:SHA256, as the report and forcemap register verify print it")
    problems, entries = [], list(connection.execute(select(AUDIT).order_by(AUDIT.c.id)).mappings())
    before, vouched = FIRST, dict[tuple[str, int], list[Any]]()
    for number, entry in enumerate(entries, start=1):
        if entry["id"] != number:
            problems.append(f"entry {number} of the audit trail is missing")
            break
        if entry["previous"] != before or entry["sha256"] != entry_sha256(dict(entry)):
            problems.append(f"entry {number} of the audit trail is not as it was written")
            break
        before = entry["sha256"]
        for name, found in json.loads(entry["content"])["rows"].items():
            vouched[name, number] = found
    for table in ROWS:
        there = dict(_digests(connection, table))
        expected = {number: found for (name, number), found in vouched.items() if name == table.name}
        for number in sorted(there.keys() | expected.keys()):
            if there.get(number) != expected.get(number):
                problems.append(f"{table.name}: rows of entry {number} of the audit trail are not as they were entered")
    if noted is not None:
        problems += _differs(noted, {str(entry["id"]): str(entry["sha256"]) for entry in entries})
    return tuple(problems)


def _differs(noted: str, chain: Mapping[str, str]) -> list[str]:
    number, _, digest = noted.strip().partition(":")
    if number == "0":
        return []
    if number not in chain:
        return [f"entry {number}, which was noted, is not there: the newest entries were removed"]
    return [] if chain[number] == digest else [f"entry {number} is not the one that was noted"]


def _digests(connection: Connection, table: Table) -> Iterator[tuple[int, list[Any]]]:
    """Number and hash of the rows of each entry of the audit trail."""
    rows = connection.execution_options(yield_per=_AT_ONCE).execute(select(table).order_by(table.c.id))
    found: dict[int, list[Any]] = {}
    for row in rows.mappings():
        counted = found.setdefault(row["entry"], [0, hashlib.sha256()])
        counted[0] += 1
        counted[1].update(_line(dict(row)))
    return ((number, [count, digest.hexdigest()]) for number, (count, digest) in found.items())


def _line(row: Mapping[str, Any]) -> bytes:
    """A row as it is hashed: what it states, so that a column that a later schema adds leaves the hash as it is."""
    known = {name: value for name, value in row.items() if value is not None}
    return json.dumps(known, ensure_ascii=False, sort_keys=True).encode() + b"\n"


def _parts(rows: list[dict[str, Any]]) -> Iterator[list[dict[str, Any]]]:
    return (rows[start : start + _AT_ONCE] for start in range(0, len(rows), _AT_ONCE))


def _account() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return "unknown"
