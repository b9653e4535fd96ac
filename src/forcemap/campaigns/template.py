"""The text of a new campaign.toml: what is known is filled in, the rest is there to be filled in."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from operator import attrgetter
from typing import Any

from forcemap.campaigns.conditions import ENTRIES, SCHEMA, Conditions
from forcemap.campaigns.protocol import PROTOCOL_ENTRIES
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.units import ForceUnit, TimeUnit, listed

_DATES = ("date", "calibrated", "calibration_expires")


def _blank(key: str) -> str:
    return "20.0" if key.endswith("_C") else "2026-01-31" if key in _DATES or key.endswith("_date") else '""'


_PROTOCOL = (
    "# Who measured what with which device, for the report; may be stated afterwards. See docs/contact_points.md.",
    "[protocol]",
    *(f"# {name} = {_blank(name)}" for name in PROTOCOL_ENTRIES),
)
_COLUMN_HELP = f"""
# How the device writes its files; see docs/your_device_files.md. Columns by name or by number, counted from 1.
[recordings]
# time = "time_ms"             # or sampling_rate_Hz = 1000.0
# time_unit = "ms"             # {listed(TimeUnit)}; s if not stated
# force = "force_N"            # or three columns: [20, 21, 22]
# force_unit = "N"             # {listed(ForceUnit)} (with newtons_per_count, zero_count); N if not stated
# sign = 1                     # -1 if pressing forces are negative
# direction = [0.0, 0.0, -1.0] # of three columns; left out: their norm
"""


def campaign_text(conditions: Conditions, columns: ColumnMap | None = None) -> str:
    """The text of a campaign.toml with these conditions; entries that are not stated stand there as comments.

    Parameters
    ----------
    conditions : Conditions
    columns : ColumnMap, optional
        How the device writes its files.
    """
    several, stated, section = conditions.devices, conditions.stated, ""
    lines = [f"schema = {json.dumps(SCHEMA)}"]
    for entry, (name, comment) in sorted(ENTRIES.items(), key=lambda item: item[0].startswith("states.")):
        of_one = name.startswith("device.")  # of several each has its own
        if (comment is None and entry not in stated) or (several and of_one):
            continue
        above, _, key = entry.rpartition(".")
        lines += ["", f"[{above}]"] if above != section else []
        section = above
        number = isinstance(attrgetter(name)(Conditions()), float)
        blank = "0.0" if number else _blank(key)
        text = f"{key} = {_toml(stated[entry])}" if entry in stated else f"# {key} = {blank}"
        lines.append(f"{text}  # {comment}" if comment else text)
    if several:
        lines += ["", "# of several devices; the first whose pattern of states or recordings fits counts"]
    for device in conditions.to_tables().get("devices", []):
        lines += ["[[devices]]", *(f"{key} = {_toml(value)}" for key, value in device.items()), ""]
    lines += ["", *_PROTOCOL]
    if columns is None:
        return "\n".join(lines) + "\n" + _COLUMN_HELP
    lines += ["", "[recordings]", *(f"{key} = {_toml(value)}" for key, value in columns.to_table().items())]
    return "\n".join(lines) + "\n"


def completed_text(text: str, entries: Mapping[str, Any]) -> str:
    """The text of a campaign.toml with these entries, nothing else changed.

    An entry takes the place of its line or of the comment that stands for it, else it follows the head of its section,
    which is added where there is none.
    """
    for entry, value in entries.items():
        section, _, key = entry.rpartition(".")
        head = re.search(rf"^\[{re.escape(section)}\][ \t]*(?:#.*)?$", text, re.M)
        line = f"{key} = {_toml(value)}"
        if head is None:
            text = f"{text.rstrip()}\n\n[{section}]\n{line}\n"
            continue
        end = re.compile(r"^[ \t]*\[", re.M).search(text, head.end())
        body = text[head.end() : end.start() if end else len(text)]
        said, count = re.subn(rf"^(?:# )?{re.escape(key)} = [^#\n]*?(?=[ ]*(?:#|$))", line, body, count=1, flags=re.M)
        text = text[: head.end()] + (said if count else f"\n{line}{body}") + text[head.end() + len(body) :]
    return text


def _toml(value: Any) -> str:
    if isinstance(value, float) and math.isfinite(value):
        return repr(value)
    return json.dumps(value, ensure_ascii=False)
