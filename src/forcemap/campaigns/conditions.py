"""The conditions a campaign was measured under: `campaign.toml`, and what every result repeats of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from difflib import SequenceMatcher
from fnmatch import fnmatchcase
from functools import cache, cached_property
from operator import attrgetter
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.entries import typed_entry
from forcemap.campaigns.protocol import PROTOCOL_ENTRIES, Protocol
from forcemap.direction import WIDEST_ANGLE, direction_vector, same_direction
from forcemap.errors import CampaignFileError, InputError, nearest_names
from forcemap.files import read_bytes, toml_tables
from forcemap.findings import Finding, FindingKind
from forcemap.recordings.column_map import KEYS, ColumnMap
from forcemap.recordings.device import Device
from forcemap.recordings.film import Film

SCHEMA = "forcemap-campaign/1"
CAMPAIGN_FILE = "campaign.toml"
PLAN_TABLE = "plan"
"""The table of campaign.toml that `plan` writes and `next` keeps to."""

FORM_ENTRY = "map.form"
FORM_NAMES = ("CFM_2D", "CFM_3D", "FULL_CUBIC", "LOG_SPEED")
"""What it may state: the names of `forcemap.maps.forms.FORMS`."""

UNFINISHED = "unfinished"
"""The entry that stands in campaign.toml as long as the lab writes recordings beside it."""

_LARGEST_SPEED_ERROR = 0.5  # more is a percentage, or a campaign that says nothing of speeds
_NEARLY_ALIKE = 0.8
"""Share of letters in which two names of contact sites agree that may be one. A choice: a letter that is missing, too
many, or at the other's place in a word of six."""

_ROUNDING = 1e-9  # of a speed [m/s]
_USUAL_SPEED_ERROR = 0.03  # that a warning names as an example: at this one, half of campaigns break their promise


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
    speed_error : float
        How much lower than stated the speed at contact may have been in the whole campaign, as a share of it: 0.03 for
        3 %. NaN is "not stated".
    standard_edition, limit_table, operator, date, note : str
        As the campaign states them; the date of the measurements as YYYY-MM-DD.
    channel_frequency_class : float
        Class of the low-pass whose peak is reported beside the raw one; NaN for none.
    place_tolerance, speed_tolerance : float
        How far repeats of a state may lie apart [m], [m/s].
    form : str
        Name of the map's form, one of `FORM_NAMES`; empty for the default.
    slowest : float
        States slower than this are not fitted [m/s]: a map holds from there. NaN for none.
    reach, fastest : float
        What `plan` was told and `next` keeps to: the largest distance of a place from the base's origin [m], the
        fastest speed [m/s]. No conditions of what is measured.
    simulated : bool
        True if the impacts are simulated.
    device : Device
        The force measuring device; of several what they are good for together (`Device.weakest`).
    devices : tuple of (str, Device)
        Where several were used: a pattern of names of states or recordings, with * and ?, and the device of these; the
        first that fits counts.
    film : Film
        The film or array that measures the pressure, if any.
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
    speed_error: float = math.nan
    standard_edition: str = ""
    limit_table: str = ""
    operator: str = ""
    date: str = ""
    note: str = ""
    channel_frequency_class: float = math.nan
    place_tolerance: float = math.nan
    speed_tolerance: float = math.nan
    form: str = ""
    slowest: float = math.nan
    reach: float = math.nan
    fastest: float = math.nan
    simulated: bool = False
    device: Device = field(default_factory=Device)
    devices: tuple[tuple[str, Device], ...] = ()
    film: Film = field(default_factory=Film)

    def __post_init__(self) -> None:
        if self.speed_kind not in ("", "measured", "commanded"):
            raise InputError(f"contact.speed: found {self.speed_kind!r}, expected 'measured' or 'commanded'")
        if not (math.isnan(self.speed_error) or 0 <= self.speed_error < _LARGEST_SPEED_ERROR):
            expected = f"expected a share from 0 to {_LARGEST_SPEED_ERROR:g}, such as 0.03 for 3 %"
            raise InputError(f"robot.speed_error: found {self.speed_error:g}, {expected}")
        if self.moving_mass <= 0 or self.moving_mass == math.inf:  # NaN: not stated
            raise InputError(f"moving mass: found {self.moving_mass:g} kg, expected a positive finite number")
        if self.payload < 0 or self.payload == math.inf:
            raise InputError(f"payload: found {self.payload:g} kg, expected a finite number of at least 0")
        if self.channel_frequency_class <= 0 or self.channel_frequency_class == math.inf:
            raise InputError("channel frequency class: expected a positive finite number, such as 180 or 600")
        if self.form not in ("", *FORM_NAMES):
            raise InputError(f"map.form: found {self.form!r}, expected one of {', '.join(FORM_NAMES)}")
        if self.slowest <= 0:
            raise InputError(f"map.slowest_mps: found {self.slowest:g}, expected metres per second above 0")
        if self.reach <= 0:
            raise InputError(f"plan.reach_m: found {self.reach:g}, expected metres above 0")
        if self.fastest <= 0:
            raise InputError(f"plan.fastest_mps: found {self.fastest:g}, expected metres per second above 0")
        if self.date:
            Device().expired(self.date)  # refuses what is no date
        if math.isinf(self.base_angle):
            raise InputError("base angle: found an infinite number, expected degrees")

    @property
    def load(self) -> float:
        """Effective payload [kg]; 0 where none is stated."""
        return 0.0 if math.isnan(self.payload) else self.payload

    def at_contact(self, stated: FloatArray) -> FloatArray:
        """Speeds at contact that count [m/s], of speeds as the campaign states them: less its speed error."""
        return stated if math.isnan(self.speed_error) else stated * (1 - self.speed_error)

    def as_stated(self, at_contact: FloatArray) -> FloatArray:
        """What the campaign states of speeds at contact that count [m/s], rounded to 1e-9 where an error is stated."""
        return at_contact if math.isnan(self.speed_error) else np.round(at_contact / (1 - self.speed_error), 9)

    def slower_than_map(self, stated: FloatArray) -> Mask:
        """Which speeds [m/s], as the campaign states them, a map is not to hold for."""
        return np.asarray(stated < self.slowest - _ROUNDING)

    @property
    def doubts(self) -> tuple[Finding, ...]:
        """That the device's calibration had expired; that nothing tells how far off the stated speeds are."""
        speed = {"kind": self.speed_kind, "example": _USUAL_SPEED_ERROR}
        told = self.speed_kind == "measured" or not math.isnan(self.speed_error)
        expired = self.date and self.device.expired(self.date)
        until = {"until": str(self.device.expires), "assumed": not self.device.calibration_expires, "date": self.date}
        return (
            *([Finding.of(FindingKind.CALIBRATION_EXPIRED, **until)] if expired else []),
            *([] if told else [Finding.of(FindingKind.SPEED_ERROR_NOT_STATED, **speed)]),
        )

    @property
    def robot_mass(self) -> float:
        """Effective robot mass m_R = M/2 + m_L [kg]; NaN if the moving mass is not stated."""
        return self.moving_mass / 2 + self.load

    def device_of(self, *names: str) -> Device:
        """The device of an impact by the names of its state and its recording, in whatever folder, with any ending."""
        if not self.devices:
            return self.device
        position = self._device_position(*names)
        return Device() if position is None else self.devices[position][1]

    def require_devices_used(self, names: Iterable[tuple[str, str]], file: str) -> None:
        """Refuse an entry [[devices]] that is the first to fit none of these names of states and recordings.

        Raises
        ------
        CampaignFileError
            A slip in a pattern: its recordings would silently be those of another device.
        """
        used = {self._device_position(*pair) for pair in names}
        for number, (pattern, _) in enumerate(self.devices):
            if number not in used and not (pattern == "*" and number == len(self.devices) - 1):
                problem = f"found {pattern!r}, which fits no state or recording that an entry before it does not fit"
                remedy = "expected such as d520-* for the states d520-...; correct it, or take the entry out"
                raise CampaignFileError(f"{problem}; {remedy}", file=file, column=f"devices[{number + 1}].recordings")

    def _device_position(self, *names: str) -> int | None:
        """Position of the first entry of `devices` that fits the names; None if none does."""
        fits = (pattern_fits(pattern, *names) for pattern, _ in self.devices)
        return next((position for position, fit in enumerate(fits) if fit), None)

    def of_devices(self, used: Iterable[Device]) -> Conditions:
        """The same with the devices that were used alone, and what these are good for together."""
        if not self.devices:
            return self
        there = dict.fromkeys(used)
        devices = [entry for entry in self.devices if entry[1] in there]
        if {*there} > {device for _, device in devices}:  # of some impacts no device is stated
            devices.append(("*", Device()))
        return replace(self, device=Device.weakest([*there]), devices=tuple(devices))

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What a speed depends on of them, SIMULATED first; what is not stated is among them."""
        return (
            *([Finding.of(FindingKind.SIMULATED)] if self.simulated else []),
            Finding.of(FindingKind.ROBOT, robot=self.robot),
            Finding.of(FindingKind.DIRECTION, direction=self.direction),
            Finding.of(FindingKind.CONTACT_SITE, contact_site=self.contact_site),
            Finding.of(FindingKind.TOOL, tool=self.tool, payload_kg=float(self.payload), covers=self.covers),
            Finding.of(FindingKind.SAFETY_SETTINGS, safety_settings=self.safety_settings),
            Finding.of(FindingKind.SPEED_KIND, kind=self.speed_kind, error=self.speed_error),
            *([Finding.of(FindingKind.LIMIT_TABLE, table=self.limit_table)] if self.limit_table else []),
            *(_device_finding(*entry) for entry in self.devices or (("", self.device),)),
        )

    @property
    def device_needs(self) -> tuple[Finding, ...]:
        """What collecting, and a speed for a body area, need of the device and is not stated."""
        collect = Finding.of(FindingKind.COLLECT_NEEDS, entry="device.range_N")
        spring = Finding.of(FindingKind.SPRING_NEEDED, entry="device.stiffness_N_per_m")
        return (collect,) * math.isnan(self.device.range) + (spring,) * math.isnan(self.device.stiffness)

    @property
    def note_says_simulated(self) -> bool:
        """True if the note bears the mark that the virtual lab writes, whatever `simulated` states."""
        return self.note.startswith("SIMULATED")

    def with_device_stiffness(self, stiffness: float | None) -> Conditions:
        """The same with the spring constant of the device [N/m], if one is given and none is stated.

        Raises
        ------
        InputError
            Another one is stated.
        """
        if stiffness is None or self.device.stiffness == stiffness:
            return self
        if self.devices:
            raise InputError("device spring: campaign.toml states several devices; state their springs there")
        if not math.isnan(self.device.stiffness):
            stated = f"campaign.toml states {self.device.stiffness / 1000:g} N/mm (device.stiffness_N_per_m)"
            raise InputError(f"device spring: found {stiffness / 1000:g} N/mm, but {stated}; give one of them")
        return replace(self, device=replace(self.device, stiffness=stiffness))

    def with_device_of(self, earlier: Conditions) -> Conditions:
        """The same with the device that is good for what both campaigns' devices are good for.

        Each calibration had to hold for its own campaign: the earlier one counts, on its own day, unless it is known to
        have held then and this campaign states its own.
        """
        weakest, date = Device.weakest([self.device, earlier.device]), self.date
        if earlier.date and earlier.device.expired(earlier.date):
            weakest, date = weakest.calibrated_as(earlier.device), earlier.date
        elif earlier.date and (self.device.calibrated or self.device.calibration_expires):
            weakest = weakest.calibrated_as(self.device)
        several = (*self.devices, ("of an earlier campaign", earlier.device)) if self.devices else ()
        return replace(self, device=weakest, devices=several, date=date)

    def changed_from(self, earlier: Conditions) -> tuple[tuple[str, str, str], ...]:
        """Entry, text then and text now of what an earlier campaign states otherwise; an empty text is "not stated"."""
        then, now = earlier.measured_under(), self.measured_under()
        texts = ((entry, then.get(entry, ""), now.get(entry, "")) for entry in MEASURED_UNDER)
        return tuple(each for each in texts if each[1] != each[2])

    def measured_under(self, *names: str) -> dict[str, str]:
        """What is stated of robot, tool, contact and device, as texts by entry: what a map holds for.

        With the names of a state and a recording the device is theirs.
        """
        texts = self._texts_by_device
        if (device := self.device_of(*names)) not in texts:
            stated = replace(self, device=device).stated.items()
            texts[device] = {entry: condition_text(entry, value) for entry, value in stated if entry in MEASURED_UNDER}
        return dict(texts[device])

    @cached_property
    def _texts_by_device(self) -> dict[Device, dict[str, str]]:
        """What `measured_under` has given so far: it is asked for every recording."""
        return {}

    @property
    def stated(self) -> dict[str, Any]:
        """Every entry of campaign.toml that is stated, such as `tool.name`, with its value (SI units in the names)."""
        values = {entry: attrgetter(name)(self) for entry, (name, _) in ENTRIES.items()}
        return {
            entry: value for entry, value in values.items() if value != "" and value is not False and value == value
        }

    def to_tables(self) -> dict[str, Any]:
        """The stated entries as the tables of campaign.toml (SI units in the names), but those no map has from them.

        No map rests on [plan], and each states its form itself.
        """
        tables: dict[str, Any] = {}
        for entry, value in self.stated.items():
            section, _, key = entry.rpartition(".")
            if section == PLAN_TABLE or entry == FORM_ENTRY:
                continue
            (tables.setdefault(section, {}) if section else tables)[key] = value
        for pattern, device in self.devices:
            stated = Conditions(device=device).to_tables().get("device", {})
            tables["devices"] = [*tables.get("devices", []), {"recordings": pattern, **stated}]
        if self.devices:  # the one device follows from them
            tables.pop("device", None)
            if "device.channel_frequency_class" in self.stated:
                tables["device"] = {"channel_frequency_class": self.channel_frequency_class}
        return tables

    @classmethod
    def from_tables(cls, tables: Mapping[str, Any]) -> Conditions:
        """The conditions stated in the tables of campaign.toml.

        Raises
        ------
        InputError
            An unknown entry, or a value that is not of the expected kind; `column` names the entry.
        """
        flat: dict[str, Any] = {}
        for name, value in tables.items():
            if name == "devices":
                continue
            section = isinstance(value, Mapping)
            flat |= {f"{name}.{key}": item for key, item in value.items()} if section else {name: value}
        known: dict[str, Any] = {}
        device: dict[str, Any] = {}
        film: dict[str, Any] = {}
        for entry, value in flat.items():
            if entry not in ENTRIES or ("." in entry and entry in tables):  # a quoted key is no entry of a section
                near = ", ".join(nearest_names(entry, [*ENTRIES, *_OF_OTHER_TABLES], 3))
                raise InputError(f"unknown entry; the nearest known ones are {near}", column=entry)
            name, _ = ENTRIES[entry]
            target = device if name.startswith("device.") else film if name.startswith("film.") else known
            target[name.rpartition(".")[2]] = typed_entry(entry, value, attrgetter(name)(cls()))
        only = cls(**known, device=Device(**device), film=Film(**film))
        if "devices" not in tables:
            return only
        devices = (*_several(tables["devices"]), *([("*", only.device)] if device else []))  # [device]: of the others
        return replace(only, devices=devices).of_devices(entry[1] for entry in devices)


def _several(entries: Any) -> Iterator[tuple[str, Device]]:
    """Pattern and device of each of the tables [[devices]]."""
    if not isinstance(entries, list) or not entries:
        raise InputError("expected tables [[devices]], one for each device", column="devices")
    for number, entry in enumerate(entries, start=1):
        column = f"devices[{number}]"
        if not isinstance(entry, Mapping) or not isinstance(pattern := entry.get("recordings"), str) or not pattern:
            states = "the name of its states or recordings, * for any text"
            raise InputError(f"expected a table with the entry recordings, {states}", column=column)
        try:
            stated = {key: value for key, value in entry.items() if key != "recordings"}
            if "channel_frequency_class" in stated:
                raise InputError("expected in [device], one for all", column="device.channel_frequency_class")
            yield pattern, Conditions.from_tables({"device": stated}).device
        except InputError as error:
            column = (error.column or "device").replace("device", column, 1)
            raise InputError(error.message, column=column) from None


def _device_finding(recordings: str, device: Device) -> Finding:
    figures = {"range_N": device.range, "spring_N_per_m": device.stiffness, "tried_N": device.tried}
    return Finding.of(FindingKind.DEVICE, recordings=recordings, model=device.model, pad=device.pad, **figures)


_OF_OTHER_TABLES = (*(f"recordings.{key}" for key in KEYS), *(f"protocol.{key}" for key in PROTOCOL_ENTRIES))


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
    content = read_bytes(path)
    try:
        tables = toml_tables(content)
    except InputError as error:
        raise CampaignFileError(error.message, file=str(path), column=error.column) from None
    schema = tables.pop("schema", None)
    if schema != SCHEMA:
        problem = "the entry is missing" if schema is None else f"found {schema!r}"
        raise CampaignFileError(f"{problem}, expected schema = {SCHEMA!r}", file=str(path), column="schema")
    if tables.pop(UNFINISHED, False):
        message = "forcemap simulate was ended before all recordings were written; delete the folder and simulate again"
        raise CampaignFileError(f"an unfinished simulation: {message}", file=str(path), column=UNFINISHED)
    recordings, section = tables.pop("recordings", None), ""
    protocol = tables.pop("protocol", {})
    try:
        Protocol.from_table(protocol)
        conditions = Conditions.from_tables(tables)
        section = "contact.direction"
        if conditions.direction:
            direction_vector(conditions.direction, whose="the campaign")
        section = "recordings"
        if recordings is not None and not isinstance(recordings, Mapping):
            raise InputError("found no table, expected [recordings]")
        return conditions, ColumnMap.from_table(recordings) if recordings else None
    except InputError as error:
        column = ".".join(filter(None, (section, error.column))) or None
        raise CampaignFileError(error.message, file=str(path), column=column) from None


ENTRIES: dict[str, tuple[str, str | None]] = {  # entry: field, and what a new campaign.toml says beside it, if it asks
    "simulated": ("simulated", None),
    "operator": ("operator", "who measures"),
    "date": ("date", "of the measurements"),
    "note": ("note", ""),
    "robot.model": ("robot", ""),
    "robot.controller": ("controller", ""),
    "robot.firmware": ("firmware", "version"),
    "robot.moving_mass_kg": ("moving_mass", "total mass of the moving parts, for the standard's contact model"),
    "robot.safety_settings": (
        "safety_settings",
        "force, power, speed limits, stopping time; or a checksum of the safety configuration",
    ),
    "robot.speed_error": (
        "speed_error",
        "by which share all speeds at contact may have been lower than stated: 0.03 for 3 %; 0 if none; "
        "an error in m/s divided by the slowest planned speed, 0.05 for 0.005 m/s at 0.1 m/s",
    ),
    "tool.name": ("tool", "or none"),
    "tool.payload_kg": ("payload", "effective payload m_L: tool, such as a gripper, and workpiece together; 0 if none"),
    "tool.covers": ("covers", "protective covers, or none"),
    "contact.site": ("contact_site", "part of the robot that hits"),
    "contact.direction": ("direction", "of motion at contact, for example down"),
    "contact.base_angle_deg": ("base_angle", "angle of the base joint"),
    "contact.speed": ("speed_kind", "measured or commanded: what speed_mps is"),
    "states.tolerance_m": ("place_tolerance", None),
    "states.tolerance_mps": ("speed_tolerance", None),
    "device.model": ("device.model", ""),
    "device.range_N": ("device.range", "REQUIRED: largest force it can measure"),
    "device.error_N": ("device.error", "largest error of a reading; 3 if not stated"),
    "device.stiffness_N_per_m": (
        "device.stiffness",
        "spring constant, 75000 for 75 N/mm; REQUIRED for limits of body areas",
    ),
    "device.pad": ("device.pad", 'pad or damping on it, with its hardness; "none" if there is no pad'),
    "device.tried_up_to_N": (
        "device.tried",
        "force that it was seen to read as set on that day, by a weight or a press: flat tops below are not cut off",
    ),
    "device.calibrated": ("device.calibrated", "date of the last calibration"),
    "device.calibration_expires": ("device.calibration_expires", "one year after it if not stated"),
    "device.channel_frequency_class": (
        "channel_frequency_class",
        "low-pass reported beside the raw curve, for example 180",
    ),
    "pressure.sensor": ("film.sensor", None),
    "pressure.range_N_per_cm2": ("film.range", None),
    "pressure.least_N_per_cm2": ("film.least", None),
    "pressure.error": ("film.error", None),
    "pressure.mean_over_cm2": ("film.mean_over", None),
    "pressure.unit": ("film.unit", None),
    "pressure.pitch_m": ("film.pitch", None),
    "standard.edition": ("standard_edition", "for example ISO/TS 15066:2016"),
    "standard.limit_table": ("limit_table", "your own table of limits, if any"),
    FORM_ENTRY: ("form", "terms of the map, CFM_3D if not stated; forcemap evaluate --forms says which suits"),
    "map.slowest_mps": ("slowest", "the map holds from this speed on; slower states are not fitted, but count"),
    f"{PLAN_TABLE}.reach_m": ("reach", "next plans no place farther from the base's origin"),
    f"{PLAN_TABLE}.fastest_mps": ("fastest", "next plans no faster impact, unless --speeds-mps says so"),
}

MEASURED_UNDER = (
    "simulated",
    *(entry for entry in ENTRIES if entry.startswith(("robot.", "tool.", "contact.", "pressure."))),
    *(f"device.{key}" for key in ("model", "range_N", "error_N", "stiffness_N_per_m", "pad", "tried_up_to_N")),
)
"""Entries of campaign.toml that say what was measured, and so what a map holds for."""


def pattern_fits(pattern: str, *names: str) -> bool:
    """Whether a pattern with * and ? fits a state or a recording, by its names, in whatever folder, with any ending."""
    known = [name for text in names for name in (text, PurePosixPath(text.partition("#")[0]).stem)]
    known += [curve for text in names if (curve := text.partition("#")[2])]
    return any(fnmatchcase(name.casefold(), pattern.casefold()) for name in known)


def may_be_alike(site: str, direction: str, other_site: str, other_direction: str) -> bool:
    """Whether impacts may be of one contact site and of directions that speeds hold for together; unstated is any."""
    sites = {normalised(site), normalised(other_site)} - {""}
    along = not (direction and other_direction) or same_direction(direction, other_direction, within=WIDEST_ANGLE)
    return len(sites) < 2 and along


def nearly_alike(site: str, other_site: str) -> bool:
    """Whether two contact sites that differ may be one, with the same digits: spelt alike, or one has the words of the
    other and more, as a tool flange and a flange."""
    one, other = normalised(site), normalised(other_site)
    digits = ["".join(filter(str.isdigit, text)) for text in (one, other)]
    words, others = set(one.split()), set(other.split())
    more = bool(words and others) and (words <= others or others <= words)
    alike = more or SequenceMatcher(None, one, other).ratio() >= _NEARLY_ALIKE
    return one != other and digits[0] == digits[1] and alike


def normalised(text: str) -> str:
    """A stated text as it is compared: in small letters, single spaces."""
    return " ".join(text.lower().split())


def condition_text(entry: str, value: Any) -> str:
    """A stated condition as a text, numbers by their value: a spreadsheet may have written them otherwise."""
    if entry in _numeric_entries():
        with suppress(ValueError):
            return repr(float(str(value).replace(",", ".")))
    return str(value)


@cache
def _numeric_entries() -> frozenset[str]:
    """Entries of campaign.toml that are numbers."""
    empty = Conditions()
    return frozenset(entry for entry, (name, _) in ENTRIES.items() if isinstance(attrgetter(name)(empty), float))
