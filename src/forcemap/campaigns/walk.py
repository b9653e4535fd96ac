"""The one walk over a campaign's recordings: which file is which run, changed, gone, excluded, readable, filtered."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import PurePosixPath
from typing import Any, NamedTuple

import numpy as np

from forcemap.campaigns.binding import changed_conditions
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.campaigns.readout import FileReadout, Reader, Readout, judging, sha256_of
from forcemap.campaigns.recorded_impacts import RecordedImpacts
from forcemap.campaigns.recordings_table import Entry
from forcemap.campaigns.state import States
from forcemap.campaigns.units import unit_finding, unit_of_time_finding
from forcemap.files import begins_with
from forcemap.findings import Finding, FindingKind, in_words

Progress = Callable[[int, int], None]
"""Called with the number of files done and of all files."""


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
    readout : Readout or None
        What its file shows; None if it is gone or cannot be read.
    recorded : RecordedImpacts or None
        The recording itself; None where the reader does not give it, too.
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
    readout: Readout | None = None
    recorded: RecordedImpacts | None = None
    unreadable: str = ""
    missing_extra: bool = False
    otherwise: Finding | None = None

    @property
    def measured(self) -> Measured | None:
        """Its only impact, for the check of units; None without one, or if a person excluded it."""
        if self.run is None or self.excluded or self.readout is None or len(self.readout.impacts) != 1:
            return None
        impact = self.readout.impacts[0]
        return Measured(self.run, impact.map_force, impact.saturated, impact.phase1_duration)

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
        return self.readout.doubt if self.readout else in_words(self.unreadable)


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


def walk(
    campaign: Campaign,
    *,
    progress: Progress | None = None,
    reader: Reader | None = None,
    states: Collection[str] | None = None,
) -> Iterator[CampaignRecording]:
    """Every recording of a campaign, the registered ones first and in their order; nothing is written.

    Parameters
    ----------
    campaign : Campaign
    progress : callable, optional
        Called with the number of files done and of all files.
    reader : Reader, optional
        Reads a file; if not given, every file is judged, and its recordings are given, too.
    states : collection of str, optional
        States whose registered files alone are read; all files if not given.

    Raises
    ------
    CampaignFileError
        A link that leads to no file lies among the recordings.
    """
    files, read = campaign.files(), reader or judging(campaign)
    known = _registered(campaign, files)
    there = set(files)
    order = [*known, *(file for file in files if file not in known)]
    if states is not None:
        order = [file for file, entries in known.items() if _holds(campaign.plan, entries.values(), states)]
    for done, file in enumerate(order, start=1):
        if file in there:
            yield from _file(campaign, file, known.get(file, {}), read)
        else:
            yield from (CampaignRecording(entry, FileState.GONE) for entry in known[file].values())
        if progress:
            progress(done, len(order))


def _holds(plan: MeasurementPlan, entries: Collection[Entry], states: Collection[str]) -> bool:
    """Whether a file that is registered so holds a recording of one of the states, by register, curve or file name."""
    runs = (plan.run_named(name) for entry in entries for name in (entry.curve, PurePosixPath(entry.file).stem))
    return any(state in states for state in (*(entry.state_id for entry in entries), *(run[0] for run in runs if run)))


def _registered(campaign: Campaign, files: list[str]) -> dict[str, dict[str, Entry]]:
    """The register by file and curve; a file of the same content under a new name is the same recording.

    If several files with that content are gone, it is one that nobody excluded, if there is one; the others are gone.
    """
    known: dict[str, dict[str, Entry]] = {}
    for entry in campaign.entries:
        known.setdefault(entry.file, {})[entry.curve] = entry
    if not (gone := known.keys() - set(files)):
        return known
    new = {sha256_of(campaign.recordings / file): file for file in files if file not in known}
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


def _file(campaign: Campaign, file: str, known: Mapping[str, Entry], read: Reader) -> Iterator[CampaignRecording]:
    """The recordings of an existing file."""
    there = read(file)

    def state(entry: Entry) -> FileState:
        """A file without an impact may be replaced; one that was incomplete begins with what was registered."""
        if not known:
            return FileState.NEW
        if entry.blank or entry.sha256 in ("", there.sha256):
            return FileState.REGISTERED
        path = campaign.recordings / file
        goes_on = entry.size and not entry.exclude and begins_with(path, entry.size, entry.sha256)
        return FileState.GROWN if goes_on else FileState.CHANGED

    if there.unreadable:
        for entry in known.values() or [Entry(file=file)]:
            yield _unreadable(entry, state(entry), there)
        return
    curves = [content.curve for content in there.readouts]
    for curve, entry in known.items():
        if curve not in curves and not (curve == "" and len(known) == 1):
            yield CampaignRecording(entry, FileState.CURVE_GONE, there.sha256)
    for number, curve in enumerate(curves):
        entry = known.get(curve) or known.get("") or Entry(file=file)  # "": registered while it could not be read
        entry = replace(entry, curve=curve) if entry.curve != curve else entry
        run, shown = _run(campaign.plan, entry, alone=len(curves) == 1), there
        if run and _another_device(campaign.conditions, run[0], entry.name):
            shown = read(file, run[0])
            if shown.sha256 != there.sha256:
                shown = replace(shown, unreadable=shown.unreadable or "the file changed while it was read")
        if shown.unreadable:
            yield _unreadable(entry, state(entry), shown)
            continue
        recorded = shown.recorded[number] if shown.recorded else None
        otherwise = changed_conditions([entry], campaign.conditions)
        yield CampaignRecording(
            entry, state(entry), there.sha256, run, shown.readouts[number], recorded, otherwise=otherwise
        )


def _unreadable(entry: Entry, state: FileState, there: FileReadout) -> CampaignRecording:
    words, extra = there.unreadable, there.missing_extra
    return CampaignRecording(entry, state, there.sha256, unreadable=words, missing_extra=extra)


def _another_device(conditions: Conditions, state: str, name: str) -> bool:
    """Whether the state of a recording tells another device than its name alone."""
    return bool(conditions.devices) and conditions.device_of(state, name) != conditions.device_of("", name)


def _run(plan: MeasurementPlan, entry: Entry, *, alone: bool) -> tuple[str, int] | None:
    """State and repeat: as registered, else by the name of the curve, or of the file if it holds one curve alone."""
    if entry.state_id:
        return entry.state_id, entry.repeat
    return plan.run_named(entry.curve) or (plan.run_named(PurePosixPath(entry.file).stem) if alone else None)
