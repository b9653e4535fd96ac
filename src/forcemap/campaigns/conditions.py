"""The conditions a campaign was measured under: `campaign.toml`, and what every result repeats of it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from forcemap.errors import CampaignFileError, InputError, nearest_names
from forcemap.files import read_bytes
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.device import Device

SCHEMA = "forcemap-campaign/1"
CAMPAIGN_FILE = "campaign.toml"


@dataclass(frozen=True)
class Conditions:
    """What a collision-force map is valid for; an empty text or NaN is "not stated".

    Parameters
    ----------
    robot, controller, firmware : str
        The robot and what controls it.
    moving_mass : float
        Total mass M of the moving parts of the robot [kg].
    tool, covers : str
        The tool and any protective covers.
    payload : float
        Effective payload m_L [kg].
    contact_site, direction : str
        The part of the robot that hits, and the direction of motion at contact.
    base_angle : float
        Angle of the base joint at which the impacts were measured [deg].
    safety_settings : str
        The robot's safety settings.
    speed_kind : str
        "measured" or "commanded": what the speed at contact is.
    standard_edition, limit_table, operator, date, note : str
        As the campaign states them; the date of the measurements as YYYY-MM-DD.
    channel_frequency_class : float
        Class of the low-pass whose peak is reported beside the raw one; NaN for none.
    place_tolerance, speed_tolerance : float
        How far repeats of a state may lie apart [m], [m/s].
    simulated : bool
        True if the impacts are simulated.
    device : Device
        The force measuring device.
    """

    robot: str = ""
    controller: str = ""
    firmware: str = ""
    moving_mass: float = math.nan
    tool: str = ""
    payload: float = math.nan
    covers: str = ""
    contact_site: str = ""
    direction: str = ""
    base_angle: float = math.nan
    safety_settings: str = ""
    speed_kind: str = ""
    standard_edition: str = ""
    limit_table: str = ""
    operator: str = ""
    date: str = ""
    note: str = ""
    channel_frequency_class: float = math.nan
    place_tolerance: float = math.nan
    speed_tolerance: float = math.nan
    simulated: bool = False
    device: Device = field(default_factory=Device)

    def __post_init__(self) -> None:
        if self.speed_kind not in ("", "measured", "commanded"):
            raise InputError(f"contact.speed: found {self.speed_kind!r}, expected 'measured' or 'commanded'")
        if not (math.isnan(self.moving_mass) or 0 < self.moving_mass < math.inf):
            raise InputError(f"moving mass: found {self.moving_mass:g} kg, expected a positive finite number")
        if not (math.isnan(self.payload) or 0 <= self.payload < math.inf):
            raise InputError(f"payload: found {self.payload:g} kg, expected a finite number of at least 0")
        if not (math.isnan(self.channel_frequency_class) or 0 < self.channel_frequency_class < math.inf):
            raise InputError("channel frequency class: expected a positive finite number, such as 180 or 600")
        if self.date:
            Device().expired(self.date)  # refuses what is no date
        if math.isinf(self.base_angle):
            raise InputError("base angle: found an infinite number, expected degrees")

    def assumptions(self) -> list[str]:
        """One line for each condition that a speed depends on, "not stated" where it is missing."""
        payload = "not stated" if math.isnan(self.payload) else f"{self.payload:g} kg"
        lines = [
            f"robot: {self.robot or 'not stated'}",
            f"direction of motion: {self.direction or 'not stated'}",
            f"contact site: {self.contact_site or 'not stated'}",
            f"tool: {self.tool or 'not stated'}; payload: {payload}; covers: {self.covers or 'not stated'}",
            f"safety settings: {self.safety_settings or 'not stated'}",
            f"speed at contact: {self.speed_kind or 'measured or commanded: not stated'}",
        ]
        if self.limit_table:
            lines.append(
                f"limit table that the campaign names: {self.limit_table}; compare it with the limit used here"
            )
        if self.date and self.device.expired(self.date):
            lines.append(f"CALIBRATION of the force measuring device had expired on {self.date}")
        return ["SIMULATED impacts: not a measurement of any robot", *lines] if self.simulated else lines

    def with_device_stiffness(self, stiffness: float | None) -> Conditions:
        """The same with the spring constant of the device [N/m], if one is given and none is stated.

        Raises
        ------
        InputError
            Another one is stated.
        """
        if stiffness is None or self.device.stiffness == stiffness:
            return self
        if not math.isnan(self.device.stiffness):
            raise InputError(
                f"device spring: found {stiffness / 1000:g} N/mm, but campaign.toml states "
                f"{self.device.stiffness / 1000:g} N/mm (device.stiffness_N_per_m); give one of them"
            )
        return replace(self, device=replace(self.device, stiffness=stiffness))

    def measured_under(self) -> dict[str, str]:
        """What is stated of robot, tool, contact and device, as texts by entry: what a map holds for."""
        return {entry: condition_text(entry, value) for entry, value in _stated(self) if entry in MEASURED_UNDER}

    def to_tables(self) -> dict[str, Any]:
        """The stated entries as the tables of campaign.toml (SI units in the names)."""
        tables: dict[str, Any] = {}
        for entry, value in _stated(self):
            section, _, key = entry.rpartition(".")
            (tables.setdefault(section, {}) if section else tables)[key] = value
        return tables

    @classmethod
    def from_tables(cls, tables: Mapping[str, Any]) -> Conditions:
        """The conditions stated in the tables of campaign.toml.

        Raises
        ------
        InputError
            An unknown entry, or a value that is not of the expected kind; `column` names the entry.
        """
        found: dict[str, Any] = {}
        device: dict[str, Any] = {}
        for section, key, value in _flat(tables):
            entry = f"{section}.{key}" if section else key
            name = _ENTRIES.get((section, key))
            if name is None:
                known = [f"{s}.{k}" if s else k for s, k in _ENTRIES]
                near = ", ".join(nearest_names(entry, known, 3))
                raise InputError(f"unknown entry; the nearest known ones are {near}", column=entry)
            target = device if name.startswith("device.") else found
            target[name.removeprefix("device.")] = _typed(entry, value, _entry(cls(), name))
        return cls(**found, device=Device(**device))


def read_conditions(path: str | Path) -> Conditions:
    """Read the conditions of a campaign.toml.

    Raises
    ------
    CampaignFileError
        Not TOML, not of this schema, or an entry that cannot be used.
    """
    return read_campaign_file(path)[0]


def read_campaign_file(path: str | Path) -> tuple[Conditions, ColumnMap | None]:
    """Read a campaign.toml: the conditions, and how the device writes its files if that is stated.

    Raises
    ------
    CampaignFileError
        Not TOML, not of this schema, or an entry that cannot be used.
    """
    try:
        tables = tomllib.loads(read_bytes(path).decode("utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CampaignFileError(f"not a TOML file in UTF-8: {error}", file=str(path)) from None
    schema = tables.pop("schema", None)
    if schema != SCHEMA:
        found = "the entry is missing" if schema is None else f"found {schema!r}"
        raise CampaignFileError(f"{found}, expected schema = {SCHEMA!r}", file=str(path), column="schema")
    recordings = tables.pop("recordings", None)
    try:
        conditions = Conditions.from_tables(tables)
    except InputError as error:
        raise CampaignFileError(error.message, file=str(path), column=error.column) from None
    try:
        if recordings is not None and not isinstance(recordings, Mapping):
            raise InputError("found no table, expected [recordings]")
        return conditions, ColumnMap.from_table(recordings) if recordings else None
    except InputError as error:
        column = f"recordings.{error.column}" if error.column else "recordings"
        raise CampaignFileError(error.message, file=str(path), column=column) from None


_ENTRIES = {
    ("", "simulated"): "simulated",
    ("", "operator"): "operator",
    ("", "date"): "date",
    ("", "note"): "note",
    ("robot", "model"): "robot",
    ("robot", "controller"): "controller",
    ("robot", "firmware"): "firmware",
    ("robot", "moving_mass_kg"): "moving_mass",
    ("robot", "safety_settings"): "safety_settings",
    ("tool", "name"): "tool",
    ("tool", "payload_kg"): "payload",
    ("tool", "covers"): "covers",
    ("contact", "site"): "contact_site",
    ("contact", "direction"): "direction",
    ("contact", "base_angle_deg"): "base_angle",
    ("contact", "speed"): "speed_kind",
    ("states", "tolerance_m"): "place_tolerance",
    ("states", "tolerance_mps"): "speed_tolerance",
    ("device", "model"): "device.model",
    ("device", "range_N"): "device.range",
    ("device", "error_N"): "device.error",
    ("device", "stiffness_N_per_m"): "device.stiffness",
    ("device", "calibrated"): "device.calibrated",
    ("device", "calibration_expires"): "device.calibration_expires",
    ("device", "channel_frequency_class"): "channel_frequency_class",
    ("standard", "edition"): "standard_edition",
    ("standard", "limit_table"): "limit_table",
}

MEASURED_UNDER = (
    "simulated",
    *(f"{section}.{key}" for section, key in _ENTRIES if section in ("robot", "tool", "contact")),
    *(f"device.{key}" for key in ("model", "range_N", "error_N", "stiffness_N_per_m")),
)
"""Entries of campaign.toml that say what was measured, and so what a map holds for."""


def condition_text(entry: str, value: Any) -> str:
    """A stated condition as a text, numbers by their value: a spreadsheet may have written them otherwise."""
    section, _, key = entry.rpartition(".")
    if isinstance(_entry(Conditions(), _ENTRIES[section, key]), float):
        with suppress(ValueError):
            return repr(float(str(value).replace(",", ".")))
    return str(value)


def _stated(conditions: Conditions) -> Iterator[tuple[str, Any]]:
    """Every entry that is stated, such as `tool.name`, with its value."""
    for (section, key), name in _ENTRIES.items():
        value = _entry(conditions, name)
        if value != "" and value is not False and not (isinstance(value, float) and math.isnan(value)):
            yield f"{section}.{key}" if section else key, value


def _entry(conditions: Conditions, name: str) -> Any:
    """The value of an entry by its dotted name."""
    head, _, tail = name.partition(".")
    value = getattr(conditions, head)
    return getattr(value, tail) if tail else value


def _flat(tables: Mapping[str, Any]) -> list[tuple[str, str, Any]]:
    """(section, key, value) of every entry, top-level entries with an empty section."""
    flat: list[tuple[str, str, Any]] = []
    for name, value in tables.items():
        if isinstance(value, Mapping):
            flat += [(name, key, inner) for key, inner in value.items()]
        else:
            flat.append(("", name, value))
    return flat


def _typed(entry: str, value: Any, default: Any) -> Any:
    """The value, if it is of the kind of the default: true/false, a finite number, or a text (a date as text)."""
    if isinstance(default, bool):
        if isinstance(value, bool):
            return value
        raise InputError(f"found {value!r}, expected true or false", column=entry)
    if isinstance(default, float):
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
            return float(value)
        raise InputError(f"found {value!r}, expected a finite number", column=entry)
    if isinstance(value, Mapping | list | bool):
        raise InputError(f"found {value!r}, expected a text", column=entry)
    return str(value)
