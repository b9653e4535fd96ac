"""What an impacts table is bound to: the recordings it was made from, and the conditions they were measured under.

The register holds for every recording the hash of its row in the impacts table, the conditions under which it was first
registered, and the hash of its own row. A table or register that was changed since `forcemap collect` wrote them, or a
campaign.toml that states something else, no longer fits: nothing then tells what the peaks are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from forcemap.campaigns.columns import COLUMNS, NUMBERS
from forcemap.campaigns.conditions import CAMPAIGN_FILE, MEASURED_UNDER, Conditions
from forcemap.campaigns.recordings_table import REGISTER_FILE, Entry, Use, read_register, row_sha256
from forcemap.campaigns.remark import REMARK, not_in_table
from forcemap.errors import InputError
from forcemap.files import sha256


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
        NO_RECORDINGS where the table names none.
    reason : str
        Why it is unbound or broken, in words.
    """

    state: BindingState = BindingState.NO_RECORDINGS
    reason: str = ""

    @property
    def refusal(self) -> str:
        """Why no speed may rest on the table; empty if nothing speaks against it."""
        return (self.reason or _UNKNOWN) if self.state is BindingState.BROKEN else ""


_UNKNOWN = "the impacts are not what their recordings gave"
NOT_BESIDE = Binding(
    BindingState.UNBOUND,
    f"UNBOUND impacts: the register of their recordings ({REGISTER_FILE}) is not beside them, so nothing tells whether "
    f"the peaks are what the recordings gave; put {REGISTER_FILE} there, too",
)


def impact_sha256(row: Mapping[str, str]) -> str:
    """Hash of a row of the impacts table: its known columns, numbers by their value and not as they are written."""
    cells = {column: row[column].strip() for column in COLUMNS if row.get(column, "").strip()}
    plain = [f"{column}={_plain(column, cell)}" for column, cell in cells.items()]
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
    collected = any({"raw_peak_N", REMARK} & row.keys() for row in rows)  # columns that only collect writes
    if not register.exists():
        return NOT_BESIDE if any(names) or collected else Binding()
    try:
        entries = read_register(register)
    except InputError as error:
        return _broken(f"{REGISTER_FILE} cannot be used: {error.message}")
    used = {entry.name: entry for entry in entries if entry.use is Use.USED}
    if not used and not any(names):
        return NOT_BESIDE if collected else Binding()  # typed by hand, beside recordings of which none was used
    if not any(entry.row_sha256 for entry in entries):
        return _broken(f"{REGISTER_FILE} does not bind {table.name} to its recordings yet: run forcemap collect")
    edited = [entry.file for entry in entries if entry.row_sha256 != row_sha256(entry)]
    if edited:
        return _broken(
            f"{REGISTER_FILE} was changed since it was written ({_first(edited)}): run forcemap collect again"
        )
    other = [name for row, name in zip(rows, names, strict=True) if not _same(row, used.get(name))]
    other += [name for name in used if name not in names]
    if other or {row.get(REMARK, "") for row in rows} != {not_in_table(entries)}:
        return _broken(
            f"{table.name} is not what forcemap collect wrote from the recordings ({_first(other) or REMARK}); restore "
            "it, or move it away and run forcemap collect"
        )
    changes = _changes(list(used.values()), conditions.measured_under())
    if changes:
        columns = ", ".join(dict.fromkeys(key for key, _ in changes))
        return _broken(
            f"{'; '.join(words for _, words in changes)}. If it was changed on the robot, measure again; if it was "
            f"mistaken before, empty the column {columns} of {REGISTER_FILE} and run forcemap collect"
        )
    moved = [entry for entry in used.values() if entry.changed]
    if moved:
        return _broken(
            f"{_first([entry.file for entry in moved])}: {moved[0].changed}. Restore it; if it was mistaken before, "
            f"empty that column of {REGISTER_FILE}; then run forcemap collect"
        )
    return Binding(BindingState.BOUND)


def _broken(reason: str) -> Binding:
    return Binding(BindingState.BROKEN, reason)


def _same(row: Mapping[str, str], entry: Entry | None) -> bool:
    return entry is not None and entry.impact_sha256 == impact_sha256(row)


def _first(names: Sequence[str]) -> str:
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return f"{names[0] or 'a row without recording'}{more}" if names else ""


def _changes(used: Sequence[Entry], now: Mapping[str, str]) -> list[tuple[str, str]]:
    """What is stated otherwise than when recordings of the table were first registered: the entry, and in words."""
    then = Counter(
        (key, entry.conditions[key])
        for entry in used
        for key in MEASURED_UNDER
        if entry.conditions.get(key) and now.get(key) != entry.conditions[key]
    )
    return [
        (
            key,
            f"{key} was {value!r} when {count} of the recordings were registered, {CAMPAIGN_FILE} "
            + (f"says {now[key]!r}" if key in now else "does not state it"),
        )
        for (key, value), count in then.items()
    ]


def _plain(column: str, cell: str) -> str:
    if column in NUMBERS:
        try:
            return repr(float(cell.replace(",", ".")))
        except ValueError:
            return cell
    if column == "censored":
        return "true" if cell.lower() in ("true", "1") else "false"
    return cell.lower() if column == "role" else cell
