"""The text of a new campaign.toml: what is known is filled in, the rest is there to be filled in."""

from __future__ import annotations

import json
import math
from typing import Any

from forcemap.campaigns.conditions import SCHEMA, Conditions
from forcemap.recordings.column_map import ColumnMap

# entry of campaign.toml -> what to write there; the order of the file
_COMMENTS = {
    "": {"operator": "who measures", "date": "of the measurements", "note": ""},
    "robot": {
        "model": "",
        "controller": "",
        "firmware": "version",
        "moving_mass_kg": "total mass of the moving parts, for the standard's contact model",
        "safety_settings": "force, power, speed limits, stopping time; or a checksum of the safety configuration",
    },
    "tool": {"name": "", "payload_kg": "effective payload", "covers": "protective covers, or none"},
    "contact": {
        "site": "part of the robot that hits",
        "direction": "of motion at contact, for example down",
        "base_angle_deg": "angle of the base joint",
        "speed": "measured or commanded: what speed_mps is",
    },
    "device": {
        "model": "",
        "range_N": "REQUIRED: largest force it can measure",
        "error_N": "largest error of a reading; 3 if not stated",
        "stiffness_N_per_m": "spring constant, 75000 for 75 N/mm; REQUIRED for limits of body areas",
        "calibrated": "date of the last calibration",
        "calibration_expires": "one year after it if not stated",
        "channel_frequency_class": "low-pass reported beside the raw curve, for example 180",
    },
    "standard": {"edition": "for example ISO/TS 15066:2016", "limit_table": "your own table of limits, if any"},
}
_UNITS = ("kg", "deg", "N", "m", "class")  # how the keys of numbers end
_DATES = ("date", "calibrated", "calibration_expires")
_COLUMN_HELP = """
# How the device writes its files; see docs/your_device_files.md. Columns by name or by number, counted from 1.
[recordings]
# time = "time_ms"             # or sampling_rate_Hz = 1000.0
# time_unit = "ms"             # s, ms or us
# force = "force_N"            # or three columns: [20, 21, 22]
# force_unit = "N"             # N, kN or counts (with newtons_per_count, zero_count)
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
    tables = conditions.to_tables()
    lines = [f"schema = {json.dumps(SCHEMA)}"]
    if conditions.simulated:
        lines.append("simulated = true")
    for section, comments in _COMMENTS.items():
        stated = tables.get(section, {}) if section else tables
        lines += ["", f"[{section}]"] if section else []
        for key, comment in comments.items():
            note = f"  # {comment}" if comment else ""
            blank = "0.0" if key.rpartition("_")[2] in _UNITS else "2026-01-31" if key in _DATES else '""'
            entry = f"{key} = {_toml(stated[key])}" if key in stated else f"# {key} = {blank}"
            lines.append(f"{entry}{note}")
    states = tables.get("states", {})
    if states:
        lines += ["", "[states]", *(f"{key} = {_toml(value)}" for key, value in states.items())]
    if columns is None:
        return "\n".join(lines) + "\n" + _COLUMN_HELP
    lines += ["", "[recordings]", *(f"{key} = {_toml(value)}" for key, value in columns.to_table().items())]
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, float) and math.isfinite(value):
        return repr(value)
    return json.dumps(value, ensure_ascii=False)
