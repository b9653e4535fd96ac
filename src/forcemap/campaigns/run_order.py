"""Recordings whose names say no run, assigned to the runs of the plan in the order in which they were made."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum

from forcemap.campaigns.build import build_dataset
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.recordings_table import Entry
from forcemap.campaigns.walk import CampaignRecording, FileState, Progress, walk
from forcemap.errors import CampaignFileError

_SHOWN = 6  # names in a message; the others are counted


class RecordingOrder(StrEnum):
    """What shows the order in which recordings were made: the numbers in their names, or the times of their files."""

    NAME = "name"
    TIME = "time"


@dataclass(frozen=True)
class RunProposal:
    """A recording and the run that it is taken for; nothing is written yet.

    Parameters
    ----------
    entry : Entry
        The recording, with the run's state and repeat.
    run : str
        Name of the run in the plan.
    written : str
        Time of the file, YYYY-MM-DD HH:MM:SS.
    distance, height, speed : float
        As planned [m, m, m/s].
    expected_force : float
        As planned [N]; NaN where nothing tells.
    peak_force : float
        Phase I peak as read [N].
    out_of_order : bool
        The file's name and time tell different orders here.
    """

    entry: Entry
    run: str
    written: str
    distance: float
    height: float
    speed: float
    expected_force: float
    peak_force: float
    out_of_order: bool

    @property
    def name(self) -> str:
        """The recording: file, and curve if it holds several."""
        return self.entry.name


def propose_runs(
    campaign: Campaign, *, by: RecordingOrder = RecordingOrder.NAME, last: str = "", progress: Progress | None = None
) -> tuple[RunProposal, ...]:
    """The recordings that name no run, beside the runs that have no recording, both in order; nothing is written.

    Parameters
    ----------
    campaign : Campaign
    by : RecordingOrder
        What shows the order of the recordings; by name, "Messung 2" comes before "Messung 10".
    last : str
        Name of the run that was made last, as in the plan; needed where there are fewer recordings than runs.
    progress : callable, optional
        Called with the number of files done and of all files.

    Raises
    ------
    CampaignFileError
        Not as many recordings as runs, up to the last; or a recording without exactly one impact: that run may have
        been made again, so that the order no longer shows which run is which.
    """
    recordings = list(walk(campaign, progress=progress))
    taken = {recording.run or (recording.entry.state_id, recording.entry.repeat) for recording in recordings}
    unnamed = [recording for recording in recordings if recording.run is None and recording.state is not FileState.GONE]
    unnamed = [recording for recording in unnamed if not recording.excluded]
    plan = campaign.plan
    free = [row for run, row in plan.row_of.items() if run not in taken] or _made_again(campaign, recordings)
    where, register = str(campaign.recordings), campaign.register_file.name
    remedy = f"write into {register} why it does not count (exclude), or which run it is (state_id, repeat)"
    if unread := [recording for recording in unnamed if recording.readout is None]:
        raise CampaignFileError(f"{_unread(unread)}, or if it does not count {remedy}", file=where)
    if failed := [
        recording.entry.name for recording in unnamed if recording.readout and len(recording.readout.impacts) != 1
    ]:
        problem = (
            f"found {_listed(failed)} without exactly one impact: if a run was made again, the order does not tell"
        )
        raise CampaignFileError(f"{problem}; {remedy}", file=where)
    if len(unnamed) > len(free):
        problem = f"found {len(unnamed)} recordings that say no run, and {len(free)} runs without a recording"
        raise CampaignFileError(f"{problem}; of each that is too many {remedy}", file=where)
    runs = [str(plan.recording[row]) for row in free]
    if last and last not in runs:
        raise CampaignFileError(f"found no run {last!r} without a recording; name it as in plan.csv", file=where)
    up_to = runs.index(last) + 1 if last else len(runs)
    if unnamed and len(unnamed) != up_to:
        problem = f"found {len(unnamed)} recordings that say no run, and {up_to} runs without one"
        problem += f" up to {last!r}" if last else ""
        shifts = "a run that was left out shifts all after it"
        which = (
            "take the row of that run out of plan.csv, assign, and put it back; or write into "
            f"{register} which run each recording is (state_id, repeat)"
        )
        remedy = which if last else f"name the last run that was made (--last), or {which}"
        raise CampaignFileError(f"{problem}; {shifts}: {remedy}", file=where)
    orders = {
        order: sorted(unnamed, key=lambda recording: _key(campaign, recording, order)) for order in RecordingOrder
    }
    names = [recording.entry.name for recording in next(orders[order] for order in RecordingOrder if order is not by)]
    proposals = []
    for recording, row, other in zip(orders[by], free, names, strict=False):
        state, repeat = str(plan.state_id[row]), int(plan.repeat[row])
        peak = recording.readout.impacts[0].peak_force if recording.readout else math.nan
        proposals.append(
            RunProposal(
                entry=replace(recording.entry, state_id=state, repeat=repeat),
                run=str(plan.recording[row]),
                written=datetime.fromtimestamp(_time(campaign, recording)).isoformat(" ", "seconds"),
                distance=float(plan.distance[row]),
                height=float(plan.height[row]),
                speed=float(plan.speed[row]),
                expected_force=float(plan.expected_force[row]),
                peak_force=peak,
                out_of_order=recording.entry.name != other,
            )
        )
    return tuple(proposals)


def assign_runs(
    campaign: Campaign, proposals: Sequence[RunProposal], *, progress: Progress | None = None
) -> ImpactDataset:
    """Register recordings as the runs proposed, and collect the campaign; files keep their names.

    Parameters
    ----------
    campaign : Campaign
        As `propose_runs` took it: if its register was changed since, nothing is written.
    proposals : sequence of RunProposal
    progress : callable, optional
        Called with the number of files done and of all files.

    Raises
    ------
    CampaignFileError
        As `build_dataset`.
    """
    assigned = {proposal.name: proposal.entry for proposal in proposals}
    known = [assigned.pop(entry.name, entry) for entry in campaign.entries]
    entries = (*known, *assigned.values())  # other than the folder's, so that it is not as it was left
    return build_dataset(replace(campaign, entries=entries, stated_sha256=()), progress=progress)


def _made_again(campaign: Campaign, recordings: Sequence[CampaignRecording]) -> list[int]:
    """Row of the one run that is to be made again, where every run has a recording: those of it were all excluded, or
    show no impact. Of several the order of new recordings would not tell which is which."""
    counts = {recording.run for recording in recordings if not recording.excluded and _shows_one(recording)}
    again = [row for run, row in campaign.plan.row_of.items() if run not in counts]
    return again if len(again) == 1 else []


def _shows_one(recording: CampaignRecording) -> bool:
    return recording.readout is None or len(recording.readout.impacts) == 1


def _key(campaign: Campaign, recording: CampaignRecording, order: RecordingOrder) -> tuple[object, ...]:
    """Sorting key of recordings; the curves of a file keep their order."""
    parts = re.split(r"([0-9]+)", recording.entry.file.casefold())
    numbered = [int(part) if position % 2 else part for position, part in enumerate(parts)]
    return (numbered,) if order is RecordingOrder.NAME else (_time(campaign, recording), numbered)


def _time(campaign: Campaign, recording: CampaignRecording) -> float:
    return os.stat(campaign.recordings / recording.entry.file).st_mtime


def _unread(recordings: Sequence[CampaignRecording]) -> str:
    """Why the first of recordings cannot be read, how many others cannot, and what to do."""
    first, *more = recordings
    others = f", and {len(more)} more that cannot be read" if more else ""
    look = f"state the layout in campaign.toml, [recordings] (forcemap inspect {first.entry.file} shows it)"
    return f"{first.entry.name}, {first.unreadable}{others}; {look}"


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(repr(name) for name in names[:_SHOWN]) + more
