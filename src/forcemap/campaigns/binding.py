"""What an impacts table is bound to: the recordings it was made from, and the conditions they were measured under.

For every recording the register holds the hash of its row in the impacts table, the conditions under which it was first
registered, and the hash of its own row. A table or register that was changed since `forcemap collect` wrote them, or a
campaign.toml that states something else, no longer fits: the peaks are then unknown. Nor does a table fit whose states
show that a unit is mistaken.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from forcemap.campaigns.columns import COLUMNS, NUMBERS, RAW_PEAK, TRUTHS, UNUSED
from forcemap.campaigns.conditions import MEASURED_UNDER, Conditions
from forcemap.campaigns.phase_two import unused_cells
from forcemap.campaigns.point_list import left_out_at_points
from forcemap.campaigns.recordings_table import (
    MEASURED_ON,
    REGISTER_FILE,
    Entry,
    Use,
    none_used,
    read_register,
    row_sha256,
)
from forcemap.campaigns.state import CONFIRMING, States
from forcemap.campaigns.units import unit_finding, unit_of_time_finding
from forcemap.errors import InputError
from forcemap.files import sha256
from forcemap.findings import Finding, FindingKind

MOST_LEFT_OUT = 0.05
"""Share of the impacts that may be left out before speeds say so first. A choice: a slip at the bench now and then."""


class BindingState(StrEnum):
    """Whether an impacts table is what its recordings gave."""

    BOUND = "bound"
    UNBOUND = "unbound"
    BROKEN = "broken"
    NO_RECORDINGS = "no_recordings"


@dataclass(frozen=True)
class Binding:
    """The state of a table's binding.

    Parameters
    ----------
    state : BindingState
        NO_RECORDINGS where the table names none; BROKEN where its figures cannot be what was measured.
    reason : Finding or None
        Why it is unbound or broken; of a bound one that impacts were left out.
    """

    state: BindingState = BindingState.NO_RECORDINGS
    reason: Finding | None = None

    def weaker(self, other: Binding) -> Binding:
        """Of two bindings the one that says less for the figures."""
        return max(self, other, key=lambda binding: (_WEAKNESS.index(binding.state), binding.reason is not None))

    @property
    def refusal(self) -> Finding | None:
        """Why no speed may rest on the table; None if nothing speaks against it."""
        return (self.reason or Finding.of(FindingKind.BINDING_BROKEN)) if self.state is BindingState.BROKEN else None


_WEAKNESS = (BindingState.BOUND, BindingState.NO_RECORDINGS, BindingState.UNBOUND, BindingState.BROKEN)

NOT_BESIDE = Binding(BindingState.UNBOUND, Finding.of(FindingKind.REGISTER_NOT_BESIDE))


def impact_sha256(row: Mapping[str, str]) -> str:
    """Hash of a row of the impacts table: its known columns, numbers by their value and not as they are written."""
    cells = [(column, plain, cell) for column, plain in _PLAIN if (cell := row.get(column, "").strip())]
    plain = [f"{column}={plain(cell) if plain else cell}" for column, plain, cell in cells]
    return sha256("\n".join(plain))[:16]


def binding_of(table: Path, rows: Sequence[Mapping[str, str]], conditions: Conditions) -> Binding:
    """Whether an impacts table is what `forcemap collect` wrote beside its register, under the same conditions.

    Parameters
    ----------
    table : Path
        The file of the table.
    rows : sequence of mapping of str to str
        Its rows, a text for each column.
    conditions : Conditions
        What the impacts are taken to be measured under.
    """
    register = table.parent / REGISTER_FILE
    names = [row.get("recording", "") for row in rows]
    collected = any({RAW_PEAK, *UNUSED} & row.keys() for row in rows)  # columns that only collect writes
    if not register.exists():
        return NOT_BESIDE if any(names) or collected else Binding()
    try:
        entries = read_register(register)
    except InputError as error:
        return _broken(FindingKind.REGISTER_UNUSABLE, words=error.message)
    used = {entry.name: entry for entry in entries if entry.use is Use.USED}
    if not used and not any(names):
        return NOT_BESIDE if collected else Binding()  # typed by hand, beside recordings of which none was used
    if not any(entry.row_sha256 for entry in entries):
        return _broken(FindingKind.NOT_BOUND_YET, table=table.name)
    if edited := [entry.file for entry in entries if entry.row_sha256 != row_sha256(entry)]:
        return _broken(FindingKind.REGISTER_EDITED, all=tuple(edited))
    if not used:
        return _broken(FindingKind.TABLE_OF_BEFORE, table=table.name, words=none_used(entries))
    hashes = {name: entry.impact_sha256 for name, entry in used.items()}
    other = [name for row, name in zip(rows, names, strict=True) if hashes.get(name) != impact_sha256(row)]
    named = set(names)
    other += [name for name in used if name not in named]
    unused = unused_cells(entries).items()
    other = other or [name for name, cell in unused if any(_value(row.get(name, "")) != _value(cell) for row in rows)]
    if other:
        return _broken(FindingKind.TABLE_EDITED, table=table.name, all=tuple(other))
    if changed := changed_conditions(used.values(), conditions):
        return Binding(BindingState.BROKEN, changed)
    if changed_entries := [entry for entry in used.values() if entry.changed]:
        files = tuple(entry.file for entry in changed_entries)
        return _broken(FindingKind.RECORDING_CHANGED, all=files, changed=changed_entries[0].changed)
    springs = np.array([conditions.device_of(entry.state_id, entry.name).stiffness for entry in used.values()])
    durations = np.array([entry.phase1_duration for entry in used.values()])
    mistaken = unit_of_time_finding(durations, springs, conditions.robot_mass)
    if mistaken:
        return Binding(BindingState.BROKEN, mistaken)
    left_out, since = _left_out(table.parent, entries, conditions.contact_site), stated_since(used.values(), conditions)
    return Binding(BindingState.BOUND, since.and_(left_out) if since and left_out else since or left_out)


def _left_out(folder: Path, entries: Sequence[Entry], site: str) -> Finding | None:
    """That impacts do not count, as a person excluded them, no plan names them, or they were discarded; None if so few
    that it says nothing: at most `MOST_LEFT_OUT`, no whole state, none to confirm the map, none at a contact point."""
    hit = [entry for entry in entries if entry.peak_force > 0]
    used = [entry for entry in hit if entry.use is Use.USED]
    out = [entry for entry in hit if entry.use is not Use.USED]
    (points, slips), counted = _at_points(folder, site), {"", *(entry.state_id for entry in used)}
    lost = tuple(dict.fromkeys(entry.state_id for entry in out if entry.state_id not in counted))
    confirming = sum(entry.state_id.startswith(CONFIRMING) for entry in out)
    if not (lost or confirming or points or len(out) > MOST_LEFT_OUT * len([*out, *used])):
        return None
    every = [*out, *points]
    counts = {"impacts": len(every), "of": len(every) + len(used), "confirming": confirming, "points": len(points)}
    highest = float(np.fmax.reduce([math.nan, *(entry.peak_force for entry in every)]))
    return Finding.of(FindingKind.IMPACTS_LEFT_OUT, **counts, lost=lost, highest_N=highest, slips=slips, site=site)


def _at_points(folder: Path, site: str) -> tuple[Sequence[Entry], tuple[str, ...]]:
    """Recordings at contact points that do not count, and the sites by whose spelling they do not; what is wrong with
    list or register is said elsewhere."""
    try:
        return left_out_at_points(folder, site)
    except InputError:
        return (), ()


def in_stated_units(binding: Binding, conditions: Conditions, *groups: States) -> Binding:
    """The binding of impacts, broken where the campaign's states show that a unit is mistaken."""
    slip = unit_finding(conditions, *groups)
    if slip is None or slip.kind is not FindingKind.UNIT_SLIP or binding.refusal:
        return binding
    return Binding(BindingState.BROKEN, slip)


def changed_conditions(entries: Iterable[Entry], conditions: Conditions) -> Finding | None:
    """Conditions that have changed since recordings were registered; None if none has.

    Every change: the entry, its value then and now, of how many recordings, measured when.
    """
    if not (then := [change for entry in entries for change in _changes(entry, conditions)]):
        return None
    changes = tuple((key, was, now, count, day) for (key, was, now, day), count in Counter(then).items())
    return Finding.of(FindingKind.CONDITION_CHANGED, changes=changes)


def stated_since(entries: Iterable[Entry], conditions: Conditions, *, entered: bool = False) -> Finding | None:
    """What is stated of how the robot hit, and was not when recordings were registered; None if nothing is.

    `forcemap collect` has `entered` it with them, or will: a person may not have meant the recordings that are there.
    """
    used = [entry for entry in entries if entry.use is Use.USED]
    both = [(entry.conditions, conditions.measured_under(entry.state_id, entry.name)) for entry in used]
    new = dict.fromkeys(
        f"{key} = {now[key]}" for then, now in both for key in _HOW_IT_HIT if now.get(key) and not then.get(key)
    )
    return Finding.of(FindingKind.STATED_SINCE, entries=tuple(new), entered=entered or None) if new else None


def as_known(then: Mapping[str, str], now: Mapping[str, str], *, entered: bool) -> dict[str, str]:
    """What is stated `now` of a recording that was registered under `then`: how the robot hit only if that was stated
    then, or is to be `entered`, so that `forcemap collect` alone does, which says it."""
    return {key: text for key, text in now.items() if entered or key in then or key not in _HOW_IT_HIT}


_HOW_IT_HIT = (
    *(f"tool.{key}" for key in ("name", "payload_kg", "covers")),
    *("contact.site", "contact.direction", "robot.safety_settings"),
)
"""Entries whose change changes the force of every impact, and which a person fills in for the robot as it stands."""


def _changes(entry: Entry, conditions: Conditions) -> Iterator[tuple[str, str, str | None, str]]:
    """Conditions changed since a recording was registered: entry, value then and now, and the day stated then."""
    now = conditions.measured_under(entry.state_id, entry.name)
    other = dict(entry.conditions.items() - now.items())
    for key in filter(other.get, MEASURED_UNDER):
        yield key, other[key], now.get(key), entry.conditions.get(MEASURED_ON, "")


def _broken(kind: FindingKind, **figures: Any) -> Binding:
    return Binding(BindingState.BROKEN, Finding.of(kind, **figures))


def _truth(cell: str) -> str:
    return "true" if cell.lower() in ("true", "1") else "false"


@lru_cache(maxsize=4096)  # most figures of a table stand in it again, or were just written
def _value(cell: str) -> str:
    try:
        return repr(float(cell.replace(",", ".")))
    except ValueError:
        return cell


_PLAIN: tuple[tuple[str, Callable[[str], str] | None], ...] = tuple(
    (name, _value if name in NUMBERS else _truth if name in TRUTHS else str.lower if name == "role" else None)
    for name in COLUMNS
)
"""How a cell of a column is brought to one spelling; None if it stays as it is."""
