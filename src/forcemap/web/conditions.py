"""The entries of a campaign.toml, read and changed: checked by its reader, then written as a whole."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from operator import attrgetter
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

import forcemap as fm
from forcemap.answers.answer import Answer
from forcemap.campaigns.binding import changed_conditions
from forcemap.campaigns.conditions import CAMPAIGN_FILE, ENTRIES, MEASURED_UNDER, read_campaign_file
from forcemap.campaigns.impact_rows import columns_words
from forcemap.campaigns.not_stated import not_stated
from forcemap.campaigns.protocol import Protocol, read_protocol
from forcemap.campaigns.recordings_table import READ_WITH, REGISTER_FILE, Entry, Use, read_register
from forcemap.errors import CampaignFileError, InputError
from forcemap.files import hidden_file, read_bytes, sha256, toml_tables, write_atomically
from forcemap.recordings.column_map import ColumnMap
from forcemap.web.campaign_file import Entries, with_entries
from forcemap.web.question import NUMBER
from forcemap.web.request_error import RequestError
from forcemap.words import sentence

_WRITING = threading.Lock()  # one change at a time: each is made to the file as it then is
_NOT_HERE = {"simulated"}  # whether a campaign was measured at all is nothing to change in passing
_DATES = ("date", "calibrated", "calibration_expires", "device_certificate_date", "film_certificate_date")
_UNITS = {
    "_N_per_m": "N/m",
    "_N_per_cm2": "N/cm2",
    "_cm2": "cm2",
    "_kg": "kg",
    "_N": "N",
    "_deg": "degrees",
    "_m": "m",
    "_mps": "m/s",
    "_C": "degrees Celsius",
}
"""Units by the end of an entry's name, the longest first."""
_RECORDINGS = "recordings"


class ConditionEntry(Answer):
    """An entry of campaign.toml: its text, and how many recordings were registered under it (0 if it binds none)."""

    entry: str
    words: str
    unit: str
    kind: Literal["text", "number", "date", "choice"]
    value: str
    meaning: str
    binds: int


class ConditionsAnswer(Answer):
    """What a campaign.toml states, in its tables, and the hash of the file as it was looked at.

    `not_stated` is what a protocol needs and lacks, under each reason why it matters, the gravest first.
    `several_devices` where tables [[devices]] state the devices: these are changed in an editor.
    """

    tables: dict[str, list[ConditionEntry]]
    not_stated: dict[str, list[str]]
    several_devices: bool
    simulated: bool
    recordings: dict[str, str]
    looked_at: str


class ConditionsChange(BaseModel):
    """Entries to change, by name such as `tool.name`, as texts; an empty one takes the entry out.

    `looked_at` is the hash of the file that was looked at; `confirmed` writes what no longer fits the recordings, too.
    """

    model_config = ConfigDict(extra="forbid")

    entries: dict[str, str] = Field(max_length=100)
    looked_at: str = Field(max_length=64)
    confirmed: bool = False


class ColumnsChange(BaseModel):
    """The table [recordings], as `ColumnMap` has its entries."""

    model_config = ConfigDict(extra="forbid")

    columns: dict[str, Any] = Field(max_length=20)
    looked_at: str = Field(max_length=64)
    confirmed: bool = False


class ChangeAnswer(Answer):
    """Whether a change was written; if not, what it would do, to be confirmed first."""

    written: bool
    binding: str
    looked_at: str


def conditions_answer(campaign: Path) -> ConditionsAnswer:
    """The entries of a campaign's file.

    Raises
    ------
    CampaignFileError
        It cannot be used.
    """
    content = _content(campaign)
    conditions, columns = read_campaign_file(campaign / CAMPAIGN_FILE)
    tables = toml_tables(content)
    used = [entry for entry in _registered(campaign) if entry.use is Use.USED]
    shown: dict[str, list[ConditionEntry]] = {}
    for entry, (meaning, kind) in _entries().items():
        section, _, key = entry.rpartition(".")
        if (section == "device" and "devices" in tables) or entry in _NOT_HERE:
            continue
        words, unit = _words_and_unit(key)
        value = (tables.get(section, {}) if section else tables).get(key, "")
        line = ConditionEntry(
            entry=entry,
            words=words,
            unit=unit,
            kind=kind,
            value=str(value),
            meaning=meaning,
            binds=sum(entry in each.conditions for each in used) if entry in MEASURED_UNDER else 0,
        )
        shown.setdefault(section, []).append(line)
    lacking: dict[str, list[str]] = {}
    for each in not_stated(conditions, read_protocol(campaign / CAMPAIGN_FILE)):
        lacking.setdefault(each.matters, []).append(each.entry)
    return ConditionsAnswer(
        tables=shown,
        not_stated=lacking,
        several_devices="devices" in tables,
        simulated=conditions.simulated,
        recordings={key: str(value) for key, value in (columns.to_table() if columns else {}).items()},
        looked_at=sha256(content),
    )


def change_conditions(campaign: Path, change: ConditionsChange) -> ChangeAnswer:
    """Change entries of a campaign's file; what no longer fits its recordings is written only if that was confirmed.

    Raises
    ------
    InputError
        An entry that cannot be changed here, or a value that the reader refuses; nothing is written.
    RequestError
        The file was changed by somebody else meanwhile.
    """
    known, entries = _entries(), {}
    for entry, text in change.entries.items():
        if entry not in known or entry in _NOT_HERE:
            raise InputError("no entry that the page changes; change it in an editor", column=entry)
        section, _, key = entry.rpartition(".")
        entries[section, key] = _value(entry, text.strip(), known[entry][1])
    return _change(campaign, entries, change.looked_at, change.confirmed)


def change_columns(campaign: Path, change: ColumnsChange) -> ChangeAnswer:
    """Change how a campaign reads the files of its device; otherwise as `change_conditions`."""
    wanted = stated_columns(change.columns).to_table()
    tables = toml_tables(_content(campaign))
    before = tables.get(_RECORDINGS, {})
    gone = {(_RECORDINGS, key): None for key in before if key not in wanted}
    entries = gone | {(_RECORDINGS, key): value for key, value in wanted.items() if before.get(key) != value}
    return _change(campaign, entries, change.looked_at, change.confirmed)


def stated_columns(table: Mapping[str, Any]) -> ColumnMap:
    """A column map as a page or a program states it.

    Raises
    ------
    InputError
        An unknown entry, or a value that cannot be used; `column` names the entry.
    """
    try:
        return ColumnMap.from_table(table)
    except InputError as error:
        column = f"{_RECORDINGS}.{error.column}" if error.column else _RECORDINGS
        raise InputError(error.message, column=column) from None


def _change(campaign: Path, entries: Entries, looked_at: str, confirmed: bool) -> ChangeAnswer:
    file = campaign / CAMPAIGN_FILE
    with _WRITING:
        content = _content(campaign)
        if sha256(content) != looked_at:
            message = "campaign.toml was changed meanwhile; open this page again, nothing was written"
            raise RequestError(409, "changed", message)
        text = with_entries(content.decode("utf-8-sig"), entries)
        with hidden_file(campaign) as (hidden, stream), _named(hidden):
            stream.write(text.encode())
            stream.flush()
            conditions, columns = read_campaign_file(hidden)
        binding = _binding(campaign, conditions, columns)
        if binding and not confirmed and binding != _binding(campaign, *read_campaign_file(file)):
            return ChangeAnswer(written=False, binding=binding, looked_at=looked_at)
        write_atomically(file, text)
        return ChangeAnswer(written=True, binding=binding, looked_at=sha256(text))


def _binding(campaign: Path, conditions: fm.Conditions, columns: ColumnMap | None) -> str:
    """What no longer fits the recordings that were registered, in words; empty if everything does."""
    used = [entry for entry in _registered(campaign) if entry.use is Use.USED]
    said = [sentence(changed_conditions(used, conditions))]
    now = columns_words(columns)
    otherwise = sum(entry.conditions.get(READ_WITH, now) not in ("", now) for entry in used)
    if otherwise:
        said.append(
            f"{otherwise} recordings were read with other entries of [recordings]; collect compares what they give"
        )
    return "; ".join(filter(None, said))


def _registered(campaign: Path) -> tuple[Entry, ...]:
    register = campaign / REGISTER_FILE
    return tuple(read_register(register)) if register.exists() else ()


def _content(campaign: Path) -> bytes:
    return read_bytes(campaign / CAMPAIGN_FILE)


@contextmanager
def _named(hidden: Path) -> Iterator[None]:
    """Let errors name the file that is changed, not the hidden one."""
    try:
        yield
    except CampaignFileError as error:
        if error.file != str(hidden):
            raise
        raise CampaignFileError(error.message, file=CAMPAIGN_FILE, row=error.row, column=error.column) from None


def _entries() -> dict[str, tuple[str, Literal["text", "number", "date", "choice"]]]:
    """Every entry that can be stated: what it means, and what kind of value it has."""
    blank, protocol = fm.Conditions(), Protocol()
    kinds: dict[str, tuple[str, Literal["text", "number", "date", "choice"]]] = {}
    for entry, (name, words) in ENTRIES.items():
        number = isinstance(attrgetter(name)(blank), float)
        date = entry.rpartition(".")[2] in _DATES
        kind: Any = "choice" if entry == "contact.speed" else "number" if number else "date" if date else "text"
        kinds[entry] = ((words or "").removeprefix("REQUIRED: "), kind)
    for field in fields(Protocol):
        number = isinstance(getattr(protocol, field.name), float)
        kinds[f"protocol.{field.name}"] = ("", "number" if number else "date" if field.name in _DATES else "text")
    return kinds


def _words_and_unit(key: str) -> tuple[str, str]:
    """An entry's name in words, and the unit at its end; empty if there is none."""
    ending = next((end for end in _UNITS if key.endswith(end)), "")
    return key.removesuffix(ending).replace("_", " "), _UNITS.get(ending, "")


def _value(entry: str, text: str, kind: str) -> Any:
    if not text:
        return None
    if kind != "number":
        return text
    if not NUMBER.fullmatch(text):
        raise InputError(f"found {text!r}, expected a number such as 0.25", column=entry)
    return float(text)
