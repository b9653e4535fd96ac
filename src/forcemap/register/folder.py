"""What the register takes of a campaign's folder: conditions, recordings, impacts, maps, contact points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import forcemap as fm
from forcemap.assessment.contact_points import POINTS_FILE, ContactPoint, read_contact_points
from forcemap.assessment.folder import campaign_inputs, campaign_limit_table, inputs_sha256
from forcemap.campaigns.build import registered_recordings
from forcemap.campaigns.campaign import RECORDINGS_FOLDER, Campaign
from forcemap.campaigns.conditions import CAMPAIGN_FILE
from forcemap.campaigns.impacts_table import TABLE_FILE
from forcemap.campaigns.point_list import names_file
from forcemap.campaigns.point_recordings import point_files, point_recordings, registered_points
from forcemap.campaigns.protocol import Protocol, read_protocol
from forcemap.campaigns.recordings_table import MEASURED_ON, Entry, Use
from forcemap.errors import CampaignFileError, one_line
from forcemap.words import sentence

_ENTRIES = {
    "robot": "robot.model, protocol.robot_serial_number",
    "controller": "robot.controller",
    "firmware": "robot.firmware",
    "safety_checksum": "protocol.safety_checksum",
    "tool": "tool.name",
    "program": "protocol.program",
    "covers": "tool.covers",
    "device": "device.model, protocol.device_serial_number",
}
"""Where campaign.toml states the conditions of a cell."""


@dataclass(frozen=True, eq=False)
class CampaignContent:
    """A campaign's folder as it is now.

    Parameters
    ----------
    campaign : Campaign
    protocol : Protocol
    sha256 : str
        Of all files that its result rests on.
    dataset : ImpactDataset or None
        Its impacts; None where there is no impacts table yet.
    points : tuple of ContactPoint
    maps : tuple of (file, SHA-256, form)
        The maps in its folder.
    """

    campaign: Campaign
    protocol: Protocol
    sha256: str
    dataset: fm.ImpactDataset | None
    points: tuple[ContactPoint, ...]
    maps: tuple[tuple[str, str, str], ...]

    @property
    def folder(self) -> Path:
        """The folder."""
        return self.campaign.folder

    @property
    def conditions(self) -> dict[str, str | None]:
        """The conditions of the cell when it was measured, by `forcemap.register.in_force.KINDS`; None: not stated."""
        stated, protocol = self.campaign.conditions, self.protocol
        texts = {
            "robot": _together(stated.robot, protocol.robot_serial_number),
            "controller": _together(stated.controller, protocol.controller_serial_number),
            "firmware": stated.firmware,
            "safety_checksum": protocol.safety_checksum,
            "tool": stated.tool,
            "program": protocol.program,
            "covers": stated.covers,
            "device": self.device,
        }
        return {kind: one_line(text).strip() or None for kind, text in texts.items()}

    @property
    def not_stated(self) -> list[str]:
        """Entries of campaign.toml that a condition needs and that are not stated."""
        return [f"{kind} ({_ENTRIES[kind]})" for kind, text in self.conditions.items() if text is None]

    @property
    def device(self) -> str:
        """Model and serial number of the measuring device; empty where either is not stated."""
        model, number = self.campaign.conditions.device.model, self.protocol.device_serial_number
        return f"{model}, {number}" if model and number else ""

    @property
    def calibration(self) -> tuple[str | None, str | None]:
        """From when to when the calibrations of all devices held; the end is None where one is not stated."""
        conditions = self.campaign.conditions
        devices = [device for _, device in conditions.devices] or [conditions.device]
        if not all(device.calibration_stated for device in devices):
            return None, None
        return max(device.calibrated for device in devices) or None, min(d.expires for d in devices).isoformat()

    @property
    def measured(self) -> tuple[str | None, str | None]:
        """First and last day of the measurements, at contact points, too, as they stood when they were registered.

        The last is None if none is stated; so is the first if a recording was registered before one was stated: such a
        day holds for recordings registered from then on (docs/campaign_file.md).
        """
        used = [entry for entry in registered_recordings(self.campaign) if entry.use is Use.USED]
        days = {entry.conditions.get(MEASURED_ON, "") for entry in used}
        first = None if "" in days else min(days, default=None)
        return first, max((days | {self.campaign.conditions.date}) - {""}, default=None)

    @property
    def binding(self) -> str:
        """Whether the impacts table is what its recordings gave, and why not."""
        if self.dataset is None:
            return f"no {TABLE_FILE}"
        binding = self.dataset.binding
        return ": ".join(filter(None, (str(binding.state), sentence(binding.reason))))

    def impacts(self) -> list[tuple[Entry, dict[str, Any]]]:
        """Every recording, those at contact points, too, and what was found in it, by the register's columns."""
        return [*self._planned(), *self._at_points()]

    def _planned(self) -> list[tuple[Entry, dict[str, Any]]]:
        places: dict[str, tuple[Any, ...]] = {}
        plan = self.campaign.plan
        at = zip(plan.distance.tolist(), plan.height.tolist(), plan.speed.tolist(), strict=True)
        planned = dict(zip(plan.state_id.tolist(), at, strict=True))
        if (table := self.dataset) is not None:
            columns = (table.distance, table.height, table.stated_speed, table.censored)
            rows = zip(*(column.tolist() for column in columns), strict=True)
            places = dict(zip(table.recording.tolist(), rows, strict=True))
        found = []
        for entry in self.campaign.entries:
            *where, fast = planned.get(entry.state_id, (None, None, math.nan))
            there = *where, fast if math.isnan(entry.speed) else entry.speed, True  # of one that is not used
            distance, height, speed, censored = places.get(entry.name, there)
            whole = entry.use is Use.USED and not censored
            found.append((entry, _values(entry, whole) | {"distance_m": distance, "height_m": height}))
            found[-1][1]["speed_mps"] = _figure(speed)
        return found

    def _at_points(self) -> list[tuple[Entry, dict[str, Any]]]:
        """Each recording of a file in points/; of a file without an impact that it cannot be told."""
        found = []
        for file in point_recordings(self.folder):
            assert file.entry is not None  # `_require_collected`
            shown = file.shown or ((file.entry, False),)
            at = self._point_of(file.name)
            found += [(entry, _values(entry, whole) | at) for entry, whole in shown]
        return found

    def _point_of(self, file: str) -> dict[str, Any]:
        """Name, place, if it is one, and stated speed of the contact point that names a file in points/; as columns."""
        named = (p for p in self.points if names_file([pattern.casefold() for pattern in p.recordings], file))
        if (point := next(named, None)) is None:
            return {}
        at = {"distance_m": point.distance, "height_m": point.height} if point.placed and not point.extent else {}
        figures = {name: _figure(value) for name, value in (at | {"speed_mps": point.recorded_at}).items()}
        return {"state_id": point.name, **figures}


def read_content(folder: str | Path) -> CampaignContent:
    """Read a campaign's folder as it was collected; nothing is written.

    Raises
    ------
    CampaignFileError
        A recording is not as it was collected, or was not collected.
    ForcemapError
        The folder cannot be used.
    """
    campaign = fm.read_campaign(folder)
    conditions, maps = campaign.conditions, []
    own = campaign_limit_table(folder, conditions)
    inputs = campaign_inputs(folder, further=filter(None, [own.file]))
    _require_collected(campaign, {file.path: file.sha256 for file in inputs})
    for file in inputs:
        if file.path.startswith("maps/") and file.path.endswith(".json"):
            force_map = fm.read_map(campaign.folder / file.path)
            maps.append((file.path, fm.map_sha256(force_map), force_map.form.name))
    points: tuple[ContactPoint, ...] = ()
    if (listed := campaign.folder / POINTS_FILE).exists():
        points = read_contact_points(listed, table=own.table)
    return CampaignContent(
        campaign=campaign,
        protocol=read_protocol(campaign.folder / CAMPAIGN_FILE),
        sha256=inputs_sha256(inputs),
        dataset=fm.read_dataset(folder) if campaign.table_file.exists() else None,
        points=points,
        maps=tuple(maps),
    )


def _require_collected(campaign: Campaign, there: dict[str, str]) -> None:
    """Refuse a folder whose recordings, or files in points/, are not those that were registered."""
    below = f"{RECORDINGS_FOLDER}/"
    stated = {below + entry.file: entry.sha256 for entry in campaign.entries}
    of_points = {entry.file: entry.sha256 for entry in registered_points(campaign.folder)}
    differing = [name for name, digest in (stated | of_points).items() if there.get(name) != digest or not digest]
    differing += [name for name in there if name.startswith(below) and name not in stated]
    differing += [name for name in point_files(campaign.folder) if name not in of_points]
    if differing:
        more = f" and {len(differing) - 1} more" if len(differing) > 1 else ""
        message = f"found recordings that are not as they were collected ({one_line(differing[0])}{more})"
        raise CampaignFileError(f"{message}; forcemap collect, then enter it", file=str(campaign.folder))
    if not stated:
        raise CampaignFileError("found no recordings; forcemap collect, then enter it", file=str(campaign.folder))


def force_map_of(content: CampaignContent) -> fm.ForceMap:
    """The map of a campaign's impacts, as exports fit it.

    Raises
    ------
    ForcemapError
        There are no impacts, or they determine none.
    """
    from forcemap.assessment.folder_map import folder_map

    if content.dataset is None:
        raise CampaignFileError(f"there is no {TABLE_FILE} yet; forcemap collect writes it", file=str(content.folder))
    return folder_map(content.folder, content.dataset).force_map


def _together(*texts: str) -> str:
    return ", ".join(filter(None, texts))


def _values(entry: Entry, whole: bool) -> dict[str, Any]:
    """What a recording shows, by the columns of the register's impacts; where and how fast is not known."""
    forces = [force for force in (entry.peak_force, entry.raw_peak_force, entry.phase2_force) if force == force]
    return {
        "curve": entry.curve,
        "state_id": entry.state_id,
        "repeat": entry.repeat,
        "use": str(entry.use),
        "flags": entry.flags,
        "whole": int(whole),
        **dict.fromkeys(("distance_m", "height_m", "speed_mps")),
        "peak_force_N": _figure(entry.peak_force),
        "phase2_force_N": _figure(entry.phase2_force),
        "largest_N": max(forces, default=None),
    }


def _figure(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)
