"""A robot's task: its segments, which body areas may be hit there and how, and what it shares with the campaign."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.conditions import Conditions, normalised
from forcemap.direction import ON_AXIS, angle_between, direction_vector
from forcemap.errors import InputError, UnknownName, nearest_names
from forcemap.files import read_bytes, toml_tables
from forcemap.findings import Finding, FindingKind
from forcemap.limits.body_areas import LimitTable
from forcemap.limits.force_limits import Contact, force_limit
from forcemap.paths.tool_path import ONE_SEGMENT

SCHEMA = "forcemap-task/1"

ACCELERATION = 1.0
"""Largest acceleration along a path, unless stated [m/s^2]; a choice that every answer prints."""

MOST_ACCELERATION = 50.0
"""Largest acceleration that a task may state [m/s^2]; a choice: more is millimetres, and a robot then brakes as it
cannot."""

_AXES, _FARTHEST = 3, 3.0  # of an offset; [m], farther is no part of a tool
_NEAREST = 3  # names that a message proposes
_SHARED = ("direction", "contact_site", "tool", "safety_settings")
_SEGMENT_KEYS = (
    *("name", "contact_possible", "areas", "contact", "clamping_possible", "speed_mps"),
    *("contact_sites", "tool", "payload_kg"),
)
_LOADED = ("contact_sites", "payload_kg", "site_offsets_m")
_KEYS = ("schema", "note", "acceleration_mps2", "campaign", "segments")


@dataclass(frozen=True)
class TaskSegment:
    """A part of a task with its own body areas and kind of contact.

    Parameters
    ----------
    name : str
        Name, as in the column `segment` of the path.
    areas : tuple of str
        Body areas or regions that may be hit; empty if contact is excluded by other measures.
    contact : Contact or None
        Kind of contact; None if contact is excluded.
    speed : float
        Programmed speed [m/s]; NaN if not stated.
    contact_sites : tuple of str
        All parts of robot and tool that can hit there; empty if as the task or the campaign states.
    tool : str
        The tool there, as its campaign names it; empty likewise.
    payload : float
        Effective payload there [kg]; NaN likewise.
    """

    name: str
    areas: tuple[str, ...]
    contact: Contact | None
    speed: float = math.nan
    contact_sites: tuple[str, ...] = ()
    tool: str = ""
    payload: float = math.nan

    def __post_init__(self) -> None:
        if self.contact is not None:
            object.__setattr__(self, "contact", Contact.parse(self.contact))
        if (self.contact is None) != (not self.areas):
            raise InputError(f"segment {self.name!r}: expected body areas and a kind of contact, or neither")
        if not (math.isnan(self.speed) or 0 < self.speed < math.inf):
            raise InputError(f"segment {self.name!r}: found {self.speed:g} m/s, expected a positive finite speed")
        if self.contact is None and math.isnan(self.speed):
            raise InputError(f"segment {self.name!r}: contact is excluded, so state its speed (speed_mps)")
        _require_payload(self.payload)


@dataclass(frozen=True)
class Task:
    """Segments of a task, and the conditions under which it is done.

    Parameters
    ----------
    segments : tuple of TaskSegment
        Segments with different names.
    acceleration : float
        Largest acceleration along the path [m/s^2].
    conditions : mapping of str to str
        Direction, contact site, tool and safety settings, as far as the task states them.
    source : str
        Name of its file.
    contact_sites : tuple of str
        All parts of robot and tool that can hit on the way; empty if as the campaign states.
    payload : float
        Effective payload on the way [kg]; NaN if as the campaign states.
    site_offsets : mapping of str to tuple of three floats
        Where contact sites lie from the point of the path, in the frame of the base, while the tool does not turn [m].
    """

    segments: tuple[TaskSegment, ...]
    acceleration: float = ACCELERATION
    conditions: Mapping[str, str] = field(default_factory=dict)
    source: str = ""
    contact_sites: tuple[str, ...] = ()
    payload: float = math.nan
    site_offsets: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        names = [segment.name for segment in self.segments]
        if not names or len(set(names)) != len(names):
            raise InputError("task: expected at least one segment, and different names")
        if not 0 < self.acceleration <= MOST_ACCELERATION:
            expected = f"expected a positive number of at most {MOST_ACCELERATION:g} m/s^2 (metres, not millimetres)"
            raise InputError(f"acceleration: found {self.acceleration:g}, {expected}", file=self.source or None)
        _require_payload(self.payload)
        _require_offsets(self.site_offsets)
        if self.contact_sites and "contact_site" in self.conditions:
            raise InputError(
                "contact_site: found it beside contact_sites, expected one of them", file=self.source or None
            )

    def segment(self, name: str) -> TaskSegment:
        """The segment of that name.

        Raises
        ------
        InputError
            The task has none.
        """
        for segment in self.segments:
            if segment.name == name:
                return segment
        raise self._unknown("path", name, "task", [segment.name for segment in self.segments])

    def _unknown(self, one: str, name: str, other: str, names: Collection[str]) -> InputError:
        near = ", ".join(map(repr, nearest_names(name, names, _NEAREST)))
        message = f"the {one} names the segment {name!r}, which the {other} does not have (its nearest: {near})"
        without = f"; a path without the column segment (a log: --column segment=NAME) is one named {name!r}"
        return InputError(f"{message}; both name the same{without * (name == ONE_SEGMENT)}", file=self.source or None)

    def site_offset(self, site: str, *, alone: bool) -> FloatArray:
        """Where a contact site lies from the point of the path [m], shape (3,); zero for one `alone` if none is stated.

        Raises
        ------
        InputError
            Several can hit, or others have an entry, and nothing says where this one lies.
        """
        offsets = {normalised(name): offset for name, offset in self.site_offsets.items()}
        if normalised(site) not in offsets and not (alone and not offsets):
            raise InputError(
                "contact sites: several can hit or have an offset, and nothing says where "
                f"{site or 'one not stated'!r} lies; state it in the task (campaign.site_offsets_m, 0,0,0 at the "
                "path's own point), for parts of a tool that does not turn; a part that moves otherwise needs its own",
                file=self.source or None,
            )
        return np.asarray(offsets.get(normalised(site), (0.0, 0.0, 0.0)), dtype=np.float64)

    def require_segments(self, names: tuple[str, ...], end_name: str = "") -> None:
        """Raise InputError unless path and task name the same segments.

        `end_name` stands in the path's last row, where no motion begins. A name that stands nowhere else tells that
        the rows may name the motions that end at them: an excluded contact would then hold for another motion.
        """
        for name in dict.fromkeys(names):
            self.segment(name)
        beside = end_name and end_name not in names
        if beside and any(segment.name == end_name or segment.contact is None for segment in self.segments):
            raise InputError(
                f"segment: the path's last row names {end_name!r}, and no motion begins there, for a row names the "
                "motion from it to the next one; if yours name the motion that ends at them, move every name up by one "
                "row; else leave that of the last row empty",
                file=self.source or None,
            )
        for segment in self.segments:
            if segment.name not in names:
                raise self._unknown("task", segment.name, "path", set(names))

    def require_same(self, conditions: Conditions, *, but: Collection[str] = ()) -> None:
        """Raise InputError where the task states other conditions than a campaign: direction, contact site, ...

        What is named in `but` is not compared.
        """
        for key, stated in self.conditions.items():
            measured = str(getattr(conditions, key))
            if key not in but and not self._same(key, stated, measured):
                in_campaign = repr(measured) if measured else "nothing"
                raise InputError(
                    f"{key.replace('_', ' ')}: the task states {stated!r}, the campaign {in_campaign}; a map holds "
                    "only for what was measured, so measure again or use the map of a campaign with the same",
                    file=self.source or None,
                )

    @staticmethod
    def _same(key: str, stated: str, measured: str) -> bool:
        """True if two statements of a condition say the same."""
        if key != "direction":
            return normalised(stated) == normalised(measured)
        vectors = direction_vector(stated, whose="the task"), direction_vector(measured, whose="the campaign")
        return angle_between(*vectors) <= ON_AXIS

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What the task does not state, so that it is taken from the campaign."""
        stated = {*self.conditions, *(["contact_site"] if self.contact_sites else [])}
        loads = [self.payload if math.isnan(each.payload) else each.payload for each in self.segments if each.contact]
        stated |= {"payload"} if not np.isnan(loads).any() else set()
        missing = [key.replace("_", " ") for key in (*_SHARED, "payload") if key not in stated]
        return (Finding.of(FindingKind.AS_IN_CAMPAIGN, missing=", ".join(missing)),) if missing else ()


def one_segment_task(
    name: str, areas: tuple[str, ...], contact: Contact, *, acceleration: float = ACCELERATION, speed: float = math.nan
) -> Task:
    """A task of a single segment, with its body areas, kind of contact, acceleration [m/s^2] and speed [m/s].

    The arguments are those of `TaskSegment` and `Task`.
    """
    return Task((TaskSegment(name, areas, contact, speed),), acceleration)


def read_task(path: str | Path, *, table: LimitTable | None = None) -> Task:
    """Read a task file (TOML).

    Parameters
    ----------
    path : str or Path
        The file.
    table : LimitTable, optional
        The table that body areas are looked up in; that of ISO/TS 15066:2016 if not given.

    Returns
    -------
    Task

    Raises
    ------
    InputError
        Not TOML, not of this schema, an unknown entry, or a segment that contradicts itself; file and column say
        where.
    """
    content = read_bytes(path)
    try:
        return _task(toml_tables(content), str(path), table)
    except InputError as error:
        raise InputError(error.message, file=str(path), column=error.column) from None


def _task(tables: dict[str, Any], source: str, table: LimitTable | None) -> Task:
    if tables.get("schema") != SCHEMA:
        raise InputError(f"found {tables.get('schema')!r}, expected schema = {SCHEMA!r}", column="schema")
    _known(tables, _KEYS, "")
    shared = tables.get("campaign", {})
    if not isinstance(shared, dict):
        raise InputError("found no table, expected [campaign]", column="campaign")
    _known(shared, (*_SHARED, *_LOADED), "campaign.")
    for key in shared.keys() - {*_LOADED}:
        _typed(shared[key], str, f"campaign.{key}")
    rows = tables.get("segments")
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise InputError("found no segment, expected at least one [[segments]]", column="segments")
    segments = tuple(_segment(row, f"segments[{i}]", table) for i, row in enumerate(rows, start=1))
    acceleration = float(_typed(tables.get("acceleration_mps2", ACCELERATION), float, "acceleration_mps2"))
    stated = {key: value for key, value in shared.items() if key not in _LOADED}
    offsets = _offsets(shared.get("site_offsets_m", {}))
    return Task(segments, acceleration, stated, source, **_loaded(shared, "campaign"), site_offsets=offsets)


def _offsets(entries: Any) -> dict[str, tuple[float, ...]]:
    """Where contact sites lie from the point of the path [m]."""
    column = "campaign.site_offsets_m"
    if not isinstance(entries, dict):
        raise InputError('expected a table such as { "flange" = [0.0, 0.0, 0.15] }', column=column)
    for name, values in entries.items():
        if not (isinstance(values, list) and len(values) == _AXES):
            raise InputError("expected three numbers [m], in the frame of the base", column=f"{column}.{name}")
        for value in values:
            if abs(_typed(value, float, f"{column}.{name}")) > _FARTHEST:
                message = f"found {value:g} m, expected at most {_FARTHEST:g}; metres, not millimetres"
                raise InputError(message, column=f"{column}.{name}")
    return {name: tuple(map(float, values)) for name, values in entries.items()}


def _segment(row: dict[str, Any], where: str, table: LimitTable | None) -> TaskSegment:
    _known(row, _SEGMENT_KEYS, f"{where}.")
    name = _typed(row.get("name"), str, f"{where}.name")
    speed = float(_typed(row["speed_mps"], float, f"{where}.speed_mps")) if "speed_mps" in row else math.nan
    loaded = _loaded(row, where) | ({"tool": _typed(row["tool"], str, f"{where}.tool")} if "tool" in row else {})
    areas = row.get("areas", [])
    if not isinstance(areas, list) or not all(isinstance(area, str) for area in areas):
        raise InputError('expected a list of names such as ["back_of_hand"]', column=f"{where}.areas")
    for area in areas:
        try:
            force_limit(area, table=table)
        except UnknownName as error:
            raise InputError(error.message, column=f"{where}.areas") from None
    if not _typed(row.get("contact_possible", True), bool, f"{where}.contact_possible"):
        if areas or "contact" in row or "clamping_possible" in row:
            raise InputError(
                f"segment {name!r}: contact is not possible, so expected no areas and no kind of contact", column=where
            )
        return TaskSegment(name, (), None, speed, **loaded)
    if not areas:
        raise InputError(f"segment {name!r}: expected the body areas that may be hit", column=f"{where}.areas")
    if "clamping_possible" not in row:
        raise InputError("expected true or false: can a person be clamped here?", column=f"{where}.clamping_possible")
    clamping = _typed(row["clamping_possible"], bool, f"{where}.clamping_possible")
    contact = Contact.QUASI_STATIC if clamping else Contact.TRANSIENT
    stated = Contact.parse(_typed(row.get("contact", contact.value), str, f"{where}.contact"))
    if clamping and stated is Contact.TRANSIENT:
        raise InputError(
            f"segment {name!r}: clamping is possible, so the transient limit is not its limit; expected quasi-static",
            column=f"{where}.contact",
        )
    return TaskSegment(name, tuple(areas), stated, speed, **loaded)


def _loaded(entries: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The contact sites and the payload that a table of the file states, as arguments."""
    sites = entries.get("contact_sites", [])
    if not isinstance(sites, list) or not all(isinstance(site, str) and site.strip() for site in sites):
        raise InputError('expected a list of names such as ["flange", "gripper"]', column=f"{where}.contact_sites")
    if "contact_sites" in entries and not sites:
        raise InputError("expected at least one", column=f"{where}.contact_sites")
    column = f"{where}.payload_kg"
    payload = float(_typed(entries["payload_kg"], float, column)) if "payload_kg" in entries else math.nan
    return {"contact_sites": tuple(sites), "payload": payload}


def _require_offsets(offsets: Mapping[str, tuple[float, ...]]) -> None:
    """Refuse offsets [m] that are no three finite numbers, and two for one contact site."""
    for name, offset in offsets.items():
        if len(offset) != _AXES or not np.isfinite(np.asarray(offset, dtype=np.float64)).all():
            raise InputError(f"offset of {name!r}: found {offset!r}, expected three finite numbers of metres")
    if len({normalised(name) for name in offsets}) < len(offsets):
        raise InputError("offsets: found two for one contact site, expected one each")


def _require_payload(payload: float) -> None:
    """Refuse a payload [kg] that is none; NaN is one that is not stated."""
    if payload < 0 or payload == math.inf:
        raise InputError(f"payload: found {payload:g} kg, expected a finite number of at least 0")


def _known(entries: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in entries:
        if key not in known:
            near = ", ".join(nearest_names(key, known, _NEAREST))
            raise InputError(f"unknown entry; the nearest known ones are {near}", column=f"{where}{key}")


def _typed(value: Any, kind: type, where: str) -> Any:
    """The value, if it is of a kind; a whole number is accepted as a number."""
    number = kind is float and isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if number or (kind is not float and isinstance(value, kind) and value != ""):
        return value
    words = {str: "a text", float: "a finite number", bool: "true or false"}[kind]
    raise InputError(f"found {value!r}, expected {words}", column=where)
