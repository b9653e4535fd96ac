"""The register of a campaign's recordings, `recordings.csv`: what each file is, and what became of it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import StrEnum
from functools import lru_cache, partial
from pathlib import Path

from forcemap.campaigns.columns import LARGEST
from forcemap.campaigns.conditions import MEASURED_UNDER, condition_text
from forcemap.csv_table import csv_cell, csv_text, read_table
from forcemap.errors import InputError
from forcemap.files import read_bytes, sha256
from forcemap.impacts.quality import UNKNOWN_PEAK
from forcemap.impacts.scenario import ContactScenario

REGISTER_FILE = "recordings.csv"


class Use(StrEnum):
    """What became of a recording."""

    USED = "used"
    DISCARDED = "discarded"
    EXCLUDED = "excluded"
    UNASSIGNED = "unassigned"
    UNREADABLE = "unreadable"


@dataclass(frozen=True)
class Entry:
    """One recording of a campaign.

    Parameters
    ----------
    file, curve : str
        Path below the folder of recordings, with slashes; name of the curve in a file of several.
    sha256 : str
        Of the file.
    size : int
        Of the file [bytes]; 0 if it could not be read.
    state_id : str
        The state it belongs to; empty if unknown.
    repeat : int
        Number of the repeat; 0 if unknown.
    speed : float
        Speed at contact as measured [m/s]; NaN: as planned.
    exclude : str
        Why a person took it out; empty if nobody did.
    use : Use
        What became of it.
    reason : str
        Why it is not used.
    scenario : ContactScenario or None
        What was found to follow Phase I; None without an impact.
    peak_force, raw_peak_force, phase2_force : float
        Phase I peak corrected for noise, its largest sample, and the largest force after 0.5 s [N].
    phase1_duration : float
        Duration of Phase I [s].
    flags : str
        Quality flags with their figures.
    impact_sha256 : str
        Hash of its row in the impacts table; empty if it is not used.
    conditions : mapping of str to str
        What campaign.toml stated of the measurement when it was first registered, by entry such as `tool.name`, with
        the `date` of the measurements; and from when it was first used, `planned`, its place in the plan, `read_with`,
        the entries of [recordings], and `first_read`, what they gave; where its pressure was measured, too,
        `pressure_from`, the file with its hash and what it gave, and at contact points that figure alone as
        `peak_pressure_N_per_cm2`.
    changed : str
        How its place in the plan, or the way its file is read, differs from when it was first used; empty if it does
        not.
    row_sha256 : str
        Hash of this row as it was written; a different one shows that a person has changed it since.
    """

    file: str
    curve: str = ""
    sha256: str = ""
    size: int = 0
    state_id: str = ""
    repeat: int = 0
    speed: float = math.nan
    exclude: str = ""
    use: Use = Use.UNASSIGNED
    reason: str = ""
    scenario: ContactScenario | None = None
    peak_force: float = math.nan
    raw_peak_force: float = math.nan
    phase2_force: float = math.nan
    phase1_duration: float = math.nan
    flags: str = ""
    impact_sha256: str = ""
    changed: str = ""
    conditions: Mapping[str, str] = field(default_factory=dict)
    row_sha256: str = ""

    @property
    def name(self) -> str:
        """The file, and the curve if it holds several."""
        return f"{self.file}#{self.curve}" if self.curve else self.file

    @property
    def blank(self) -> bool:
        """True if no impact was found in it and no person excluded it: it may go, or be replaced."""
        return not (self.scenario or self.impact_sha256 or self.exclude)


def none_used(entries: Sequence[Entry]) -> str:
    """That none of the recordings can be used, what became of how many, and how often each flag doubts a peak."""
    became = Counter(entry.use.value for entry in entries)
    flagged = Counter(name for entry in entries for name in UNKNOWN_PEAK if f"; {name}: " in f"; {entry.flags}")
    counted = [", ".join(f"{count} {name}" for name, count in each.most_common()) for each in (became, flagged)]
    return f"none of {len(entries)} recordings gave an impact that can be used: " + "; flags: ".join(
        filter(None, counted)
    )


_UNITS = {"speed": "speed_mps", "size": "size_bytes", "phase1_duration": "phase1_duration_s"} | {
    name: f"{name}_N" for name in ("peak_force", "raw_peak_force", "phase2_force")
}
_COLUMNS = {
    _UNITS.get(attribute.name, attribute.name): attribute.name
    for attribute in fields(Entry)
    if attribute.name not in ("conditions", "row_sha256")
}
_SHOWN = {column: {"_N": ".2f", "_s": ".4g"}.get(column[-2:], "") for column in _COLUMNS}
PLANNED, READ_WITH, FIRST_READ, MEASURED_ON = "planned", "read_with", "first_read", "date"
PRESSURE_FROM, PEAK_PRESSURE = "pressure_from", "peak_pressure_N_per_cm2"
_ROW_SHA256 = "row_sha256"
_SEALED = (*MEASURED_UNDER, MEASURED_ON, PLANNED, READ_WITH, FIRST_READ, PRESSURE_FROM, PEAK_PRESSURE)
_KNOWN = (*_COLUMNS, *_SEALED, _ROW_SHA256)
_USES = frozenset(Use)
_WHOLE = ("size_bytes", "repeat")
_MOST_DIGITS = 9  # of a whole number, so that a slip is refused: no file has a gigabyte
_NUMBERS = tuple(unit for unit in _UNITS.values() if unit not in _WHOLE)


def read_register(path: str | Path) -> tuple[Entry, ...]:
    """Read a register; a person may have edited `state_id`, `repeat`, `speed_mps` and `exclude`, and added rows.

    Raises
    ------
    TableError
        Not a table; an unknown column; a cell that cannot be used; the same recording twice.
    """
    return _entries(read_bytes(path), str(path))


@lru_cache(maxsize=4)
def _entries(content: bytes, file: str) -> tuple[Entry, ...]:
    """The entries of a content, asked for again: of both registers as they were, and as they were written."""
    table = read_table(content, file, what="recording")
    table.require_columns(("file",), _KNOWN)
    table = table.with_decimal_points(_NUMBERS)
    cells: dict[str, Sequence[str | float]] = {
        name: table.numbers(name, required=False) if name in _NUMBERS else table.columns[name] for name in table.columns
    }
    stated = {name: list(map(partial(_condition, name), table.columns[name])) for name in _SEALED if name in cells}
    names = [_COLUMNS.get(name, name) for name in cells if name not in _SEALED]
    rows = zip(*(column for name, column in cells.items() if name not in _SEALED), strict=True)
    entries: dict[str, Entry] = {}
    for i, (line, row) in enumerate(zip(table.rows, rows, strict=True)):
        values = dict(zip(names, row, strict=True))
        conditions = {name: column[i] for name, column in stated.items() if column[i]}
        try:
            entry = _entry(values, conditions)
        except InputError as error:
            raise table.error(error.message, line, error.column) from None
        if entry.name in entries or not entry.file:
            problem = "an empty cell" if not entry.file else f"{entry.name!r} twice"
            raise table.error(f"found {problem}, expected each recording once", line, "file")
        entries[entry.name] = entry
    return tuple(entries.values())


@lru_cache(maxsize=256)
def _condition(name: str, cell: str) -> str:
    """A sealed condition as `condition_text` gives it: most rows state the same."""
    return condition_text(name, cell) if cell else ""


def register_text(entries: Iterable[Entry]) -> str:
    """A register as CSV."""
    rows = [cells | {_ROW_SHA256: _sha256_of(cells)} for cells in map(_cells, entries)]
    sealed = [name for name in _SEALED if any(row.get(name) for row in rows)]
    return csv_text({name: [row.get(name, "") for row in rows] for name in (*_COLUMNS, *sealed, _ROW_SHA256)})


def row_sha256(entry: Entry) -> str:
    """Hash of what a row of the register says."""
    return _sha256_of(_cells(entry))


def _sha256_of(cells: Mapping[str, str]) -> str:
    return sha256("\n".join([f"{column}={cell}" for column, cell in cells.items() if cell]))[:16]


def _cells(entry: Entry) -> dict[str, str]:
    cells = {column: csv_cell(getattr(entry, name), _SHOWN[column]) for column, name in _COLUMNS.items()}
    cells |= {column: "" for column in _WHOLE if cells[column] == "0"}
    return cells | {name: entry.conditions[name] for name in _SEALED if name in entry.conditions}


def _entry(values: dict[str, str | float], conditions: Mapping[str, str]) -> Entry:
    """An entry from the cells of its row."""
    whole = {_COLUMNS[column]: str(values.get(_COLUMNS[column], "")) or "0" for column in _WHOLE}
    for column, cell in zip(_WHOLE, whole.values(), strict=True):
        if not (cell.isascii() and cell.isdigit() and len(cell) <= _MOST_DIGITS):
            raise InputError(f"found {cell!r}, expected a whole number or an empty cell", column=column)
    speed = values.get("speed", math.nan)
    if isinstance(speed, float) and not (math.isnan(speed) or 0 < speed <= LARGEST):
        raise InputError(f"found {speed:g}, expected metres per second above 0 and up to 10", column="speed_mps")
    exclude = str(values.get("exclude", "")).lower()
    if exclude in ("no", "false", "0", "-", "none", "nein", "n"):
        expected = "expected a reason, or an empty cell to keep the recording"
        raise InputError(f"found {exclude!r}, {expected}", column="exclude")
    if values.get("use") and not values.get("sha256"):
        raise InputError("the cell is empty; delete the whole row to register the file anew", column="sha256")
    use = str(values.get("use", "")) or Use.UNASSIGNED
    if use not in _USES:
        raise InputError(f"found {use!r}, expected one of {', '.join(Use)} or an empty cell", column="use")
    scenario = str(values.get("scenario", ""))
    parsed = {name: int(cell) for name, cell in whole.items()} | {
        "use": Use(use),
        "scenario": ContactScenario.parse(scenario) if scenario else None,
    }
    return Entry(**{**values, **parsed}, conditions=conditions)  # type: ignore[arg-type]
