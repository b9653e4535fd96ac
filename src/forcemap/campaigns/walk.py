"""The one walk over a campaign's recordings: which file is which run, changed, gone, excluded, readable, filtered."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

import numpy as np

from forcemap.campaigns.binding import changed_conditions
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.campaigns.recordings_table import Entry
from forcemap.campaigns.state import States
from forcemap.campaigns.units import unit_finding, unit_of_time_finding
from forcemap.errors import InputError, MissingExtra, RecordingError
from forcemap.files import begins_with, file_sha256
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.impacts.detect import find_impacts, no_impact
from forcemap.impacts.impact import Impact
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.read import read_recordings
from forcemap.recordings.recording import Recording

Progress = Callable[[int, int], None]
"""Called with the number of files done and of all files."""


@dataclass(frozen=True, eq=False)
class RecordedImpacts:
    """A recording and its impacts.

    Parameters
    ----------
    recording : Recording
    impacts : tuple of Impact
    not_filtered : str
        Why the low-pass of the channel frequency class cannot be applied; empty if it was, or none was asked for.
    """

    recording: Recording
    impacts: tuple[Impact, ...]
    not_filtered: str = ""

    @property
    def doubt(self) -> Finding | None:
        """Why its impacts do not show that a limit was kept; None if they may."""
        words = self.not_filtered if self.impacts else no_impact(self.recording)
        return in_words(words) if words else None


class FileState(StrEnum):
    """A recording beside the register."""

    NEW = "new"
    REGISTERED = "registered"
    GROWN = "grown"
    CHANGED = "changed"
    GONE = "gone"
    CURVE_GONE = "curve_gone"


_DOUBTS = {
    FileState.GROWN: FindingKind.FILE_GROWN,
    FileState.CHANGED: FindingKind.FILE_CHANGED,
    FileState.GONE: FindingKind.FILE_GONE,
    FileState.CURVE_GONE: FindingKind.CURVE_GONE,
}


class Measured(NamedTuple):
    """Run, force [N], whether that is a lower bound, and duration of Phase I [s] of an impact."""

    run: tuple[str, int]
    force: float
    saturated: bool
    duration: float


@dataclass(frozen=True, eq=False)
class CampaignRecording:
    """A recording of a campaign as its folder has it now.

    Parameters
    ----------
    entry : Entry
        As registered, under the name that its file has now; a new one if it is not.
    state : FileState
    sha256 : str
        Of the file as it is; empty if it is gone or cannot be opened.
    run : tuple of str and int, or None
        State and repeat, by the register, else by its name; None if neither says.
    recorded : RecordedImpacts or None
        What the file holds; None if it is gone or cannot be read.
    unreadable : str
        Why it cannot be read.
    missing_extra : bool
        It cannot be read here because an optional dependency is not installed.
    otherwise : Finding or None
        What campaign.toml now states otherwise than when it was registered.
    """

    entry: Entry
    state: FileState
    sha256: str = ""
    run: tuple[str, int] | None = None
    recorded: RecordedImpacts | None = None
    unreadable: str = ""
    missing_extra: bool = False
    otherwise: Finding | None = None

    @property
    def measured(self) -> Measured | None:
        """Its only impact, for the check of units; None without one, or if a person excluded it."""
        if self.run is None or self.excluded or self.recorded is None or len(self.recorded.impacts) != 1:
            return None
        impact = self.recorded.impacts[0]
        return Measured(self.run, impact.map_force, impact.saturated, impact.phase1_end - impact.onset)

    @property
    def excluded(self) -> str:
        """Why a person excluded it; empty if nobody did, or where the file is no longer the one that was excluded."""
        return "" if self.state in _DOUBTS else self.entry.exclude

    @property
    def doubt(self) -> Finding | None:
        """Why it does not show that a limit was kept; None if it may."""
        if self.state in _DOUBTS:
            return Finding.of(_DOUBTS[self.state])
        if self.otherwise:
            return self.otherwise
        return self.recorded.doubt if self.recorded else in_words(self.unreadable)


def mistaken_unit(campaign: Campaign, measured: Iterable[Measured]) -> Finding | None:
    """The finding that forces, speeds or times of a campaign are in another unit than stated; else None."""
    plan, conditions = campaign.plan, campaign.conditions
    planned = [
        (plan.row_of[impact.run], impact) for impact in measured if impact.run in plan.row_of and impact.force > 0
    ]
    if not planned:
        return None
    rows, force = [row for row, _ in planned], np.array([impact.force for _, impact in planned])
    places = np.column_stack([plan.distance, plan.height, plan.speed])[rows]
    names, censored = plan.state_id[rows], np.array([impact.saturated for _, impact in planned])
    slip = unit_finding(conditions, States.of(places, force, names, censored))
    if slip and slip.kind is FindingKind.UNIT_SLIP:
        return slip
    springs = np.array([conditions.device_of(name).stiffness for name in names.tolist()])
    return unit_of_time_finding(np.array([impact.duration for _, impact in planned]), springs, conditions.robot_mass)


def recorded_impacts(
    path: str | Path, conditions: Conditions, columns: ColumnMap | None = None, *, name: str | None = None
) -> list[RecordedImpacts]:
    """The recordings in a file, and their impacts.

    Parameters
    ----------
    path : str or Path
    conditions : Conditions
        Device, date and channel frequency class of the measurement.
    columns : ColumnMap, optional
        How the device writes its files.
    name : str, optional
        What the recordings are called in place of the path.

    Raises
    ------
    RecordingError
        Anything in the file that could be read wrongly.
    InputError
        No such file.
    MissingExtra
        A TDMS file without the package that reads it.
    """
    date = {"date": conditions.date} if conditions.date else {}
    read = read_recordings(path, columns=columns, device=conditions.device)
    if name or date:
        read = [
            replace(recording, file=name or recording.file, metadata={**recording.metadata, **date})
            for recording in read
        ]
    return [_with_impacts(recording, conditions) for recording in read]


def _with_impacts(recording: Recording, conditions: Conditions, state: str = "") -> RecordedImpacts:
    """A recording of a state, if that is known, with its impacts on its own device."""
    frequency_class = conditions.channel_frequency_class
    if conditions.devices:
        device = conditions.device_of(state, f"{recording.file}#{recording.curve}")
        recording = replace(recording, device=device)
    try:
        return RecordedImpacts(recording, tuple(find_impacts(recording, channel_frequency_class=frequency_class)))
    except InputError as error:  # sampled too unevenly; its scenario still counts, and that it exceeds a limit
        return RecordedImpacts(recording, tuple(find_impacts(recording)), error.message)


def walk(campaign: Campaign, *, progress: Progress | None = None) -> Iterator[CampaignRecording]:
    """Every recording of a campaign, the registered ones first and in their order; nothing is written.

    Parameters
    ----------
    campaign : Campaign
    progress : callable, optional
        Called with the number of files done and of all files.

    Raises
    ------
    CampaignFileError
        A link that leads to no file lies among the recordings.
    """
    files = campaign.files()
    known = _registered(campaign, files)
    there = set(files)
    order = [*known, *(file for file in files if file not in known)]
    for done, file in enumerate(order, start=1):
        if file in there:
            yield from _file(campaign, file, known.get(file, {}))
        else:
            yield from (CampaignRecording(entry, FileState.GONE) for entry in known[file].values())
        if progress:
            progress(done, len(order))


def _registered(campaign: Campaign, files: list[str]) -> dict[str, dict[str, Entry]]:
    """The register by file and curve; a file of the same content under a new name is the same recording.

    If several files with that content are gone, it is one that nobody excluded, if there is one; the others are gone.
    """
    known: dict[str, dict[str, Entry]] = {}
    for entry in campaign.entries:
        known.setdefault(entry.file, {})[entry.curve] = entry
    if not (gone := known.keys() - set(files)):
        return known
    new = {_sha256(campaign.recordings / file): file for file in files if file not in known}
    named: dict[str, dict[str, Entry]] = {}
    taken = {}
    for file in sorted(gone, key=lambda file: any(entry.exclude for entry in known[file].values())):
        sha256 = next(iter(known[file].values())).sha256
        taken[file] = new.pop(sha256, file) if sha256 else file
    for file, entries in known.items():
        name = taken.get(file, file)
        # its new name says which run it is, if it says so
        unnamed: dict[str, Any] = {"state_id": "", "repeat": 0}
        changed = unnamed if name != file and campaign.plan.run_named(PurePosixPath(name).stem) else {}
        named[name] = {curve: replace(entry, file=name, **changed) for curve, entry in entries.items()}
    return named


def _sha256(path: Path) -> str:
    """SHA-256 of a file; empty if it cannot be opened."""
    try:
        return file_sha256(path)
    except InputError:
        return ""


def _file(campaign: Campaign, file: str, known: Mapping[str, Entry]) -> Iterator[CampaignRecording]:
    """The recordings of an existing file."""
    path, unreadable, missing_extra = campaign.recordings / file, "", False
    recorded: list[RecordedImpacts] = []
    try:
        recorded = recorded_impacts(path, campaign.conditions, campaign.columns, name=file)
    except (InputError, MissingExtra) as error:
        row = error.row if isinstance(error, RecordingError) else None
        unreadable = f"row {row}, {error.message}" if row is not None else error.message
        missing_extra = isinstance(error, MissingExtra)
    sha256 = recorded[0].recording.sha256 if recorded else _sha256(path)

    def state(entry: Entry) -> FileState:
        """A file without an impact may be replaced; one that was incomplete begins with what was registered."""
        if not known:
            return FileState.NEW
        if entry.blank or entry.sha256 in ("", sha256):
            return FileState.REGISTERED
        goes_on = entry.size and not entry.exclude and begins_with(path, entry.size, entry.sha256)
        return FileState.GROWN if goes_on else FileState.CHANGED

    if unreadable:
        for entry in known.values() or [Entry(file=file)]:
            yield CampaignRecording(entry, state(entry), sha256, None, None, unreadable, missing_extra)
        return
    curves = [content.recording.curve for content in recorded]
    for curve, entry in known.items():
        if curve not in curves and not (curve == "" and len(known) == 1):
            yield CampaignRecording(entry, FileState.CURVE_GONE, sha256)
    for content in recorded:
        curve = content.recording.curve
        entry = known.get(curve) or known.get("") or Entry(file=file)  # "": registered while it could not be read
        entry = replace(entry, curve=curve)
        run = _run(campaign.plan, entry, alone=len(recorded) == 1)
        if run and campaign.conditions.device_of(run[0], entry.name) != content.recording.device:  # by its state alone
            content = _with_impacts(content.recording, campaign.conditions, run[0])
        otherwise = changed_conditions([entry], campaign.conditions)
        yield CampaignRecording(entry, state(entry), sha256, run, content, otherwise=otherwise)


def _run(plan: MeasurementPlan, entry: Entry, *, alone: bool) -> tuple[str, int] | None:
    """State and repeat: as registered, else by the name of the curve, or of the file if it holds one curve alone."""
    if entry.state_id:
        return entry.state_id, entry.repeat
    return plan.run_named(entry.curve) or (plan.run_named(PurePosixPath(entry.file).stem) if alone else None)
