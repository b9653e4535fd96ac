"""Entries of a campaign.toml changed in its text: what is not changed stays as it was written, remarks too."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

from forcemap.errors import InputError
from forcemap.files import toml_tables

Entries = Mapping[tuple[str, str], Any]
"""Values by table and key; None takes an entry out. The table of an entry above all tables is an empty text."""

_TABLE = re.compile(r"\s*\[([^\[\]]+)\]\s*(#.*)?")
_SEVERAL = re.compile(r"\s*\[\[.+\]\]\s*(#.*)?")


def with_entries(text: str, entries: Entries) -> str:
    """The text of a campaign.toml with entries changed, added or taken out.

    The result is read again: it says what the text said before, but for these entries.

    Parameters
    ----------
    text : str
        The file as it is.
    entries : mapping of (str, str) to value
        Texts, numbers, truths and lists of them by table and key; None takes an entry out.

    Raises
    ------
    InputError
        The file is written in a way that no entry can be changed in without losing another one.
    """
    lines = text.removesuffix("\n").split("\n")
    for (table, key), value in entries.items():
        lines = _changed(lines, table, key, value)
    changed = "\n".join(lines) + "\n"
    wanted = toml_tables(text.encode())
    for (table, key), value in entries.items():
        inside = wanted.setdefault(table, {}) if table else wanted
        inside.pop(key, None)
        if value is not None:
            inside[key] = value
    if not _says(changed, wanted):
        raise InputError("campaign.toml is written in a way that the page cannot change; change it in an editor")
    return changed


def _says(text: str, wanted: Mapping[str, Any]) -> bool:
    try:
        return _plain(toml_tables(text.encode())) == _plain(wanted)
    except InputError:  # a table a second time
        return False


def _changed(lines: list[str], table: str, key: str, value: Any) -> list[str]:
    start, end = _part(lines, table)
    if start < 0:
        return lines if value is None else [*lines, "", f"[{table}]", f"{key} = {_toml(value)}"]
    stated = re.compile(rf"\s*{re.escape(key)}\s*=")
    hint = re.compile(rf"\s*#\s*{re.escape(key)}\s*=")
    at = next((i for i in range(start, end) if stated.match(lines[i])), None)
    line = None if value is None else f"{key} = {_toml(value)}"
    if at is not None:
        remark = _remark(lines[at])
        return [*lines[:at], (line or f'# {key} = ""') + remark, *lines[at + 1 :]]
    if line is None:
        return lines
    at = next((i for i in range(start, end) if hint.match(lines[i])), None)
    if at is not None:
        return [*lines[:at], line + _remark(lines[at].lstrip().removeprefix("#")), *lines[at + 1 :]]
    last = next((i for i in range(end - 1, start - 1, -1) if lines[i].strip()), start - 1)
    return [*lines[: last + 1], line, *lines[last + 1 :]]


def _part(lines: list[str], table: str) -> tuple[int, int]:
    """First line of a table, below its name, and the line behind its last; -1 where there is none."""
    heads = [(i, match[1].strip()) for i, line in enumerate(lines) if (match := _TABLE.fullmatch(line))]
    ends = sorted(
        [*(i for i, _ in heads), *(i for i, line in enumerate(lines) if _SEVERAL.fullmatch(line)), len(lines)]
    )
    start = 0 if not table else next((i + 1 for i, name in heads if name == table), -1)
    return start, next((end for end in ends if end >= start), len(lines))


def _remark(line: str) -> str:
    """The remark behind an entry, with its sign and the blanks before it; empty if there is none."""
    _, _, stated = line.partition("=")
    for sign in (i for i, character in enumerate(stated) if character == "#"):
        try:
            toml_tables(f"x = {stated[:sign]}".encode())
        except InputError:  # the sign stands in a text
            continue
        return "  " + stated[sign:]
    return ""


def _toml(value: Any) -> str:
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False)


def _plain(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables without those that are empty, dates as texts."""
    plain = {name: _plain(item) if isinstance(item, dict) else item for name, item in tables.items()}
    return {
        name: item.isoformat() if hasattr(item, "isoformat") else item for name, item in plain.items() if item != {}
    }
