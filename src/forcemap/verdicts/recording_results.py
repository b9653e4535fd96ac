"""Every recording of a campaign, or of a file, beside force limits: its verdicts, or why there are none."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.campaign import Campaign, read_campaign
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.impacts_table import read_dataset
from forcemap.campaigns.recordings_table import Entry
from forcemap.campaigns.walk import (
    CampaignRecording,
    FileState,
    Measured,
    Progress,
    RecordedImpacts,
    mistaken_unit,
    recorded_impacts,
    walk,
)
from forcemap.errors import InputError
from forcemap.files import file_sha256
from forcemap.findings import Finding, FindingKind
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.recordings.column_map import ColumnMap
from forcemap.verdicts.verdict import Interpretation, Judgement, Verdict, VerdictOutcome, check_impact

_BINS = 60  # of a curve, each with its lowest and highest sample
_FAST = 0.1  # [s] after onset; half of the bins lie before it


@dataclass(frozen=True, eq=False)
class CheckedRecording:
    """One recording held against one limit.

    Parameters
    ----------
    name : str
        The file, and the curve if it holds several.
    recorded : RecordedImpacts or None
        The recording and its impacts; None where it is gone or cannot be read.
    verdicts : tuple of Verdict
        One for each impact; none where a person excluded it, or the limit permits no contact; where it is not judged,
        those that exceed the limit all the same.
    not_judged : Finding or None
        Why nothing can be told from it; None if it can.
    excluded : str
        Why a person excluded it; empty if nobody did.
    """

    name: str
    recorded: RecordedImpacts | None = None
    verdicts: tuple[Verdict, ...] = ()
    not_judged: Finding | None = None
    excluded: str = ""


@dataclass(frozen=True, eq=False)
class RecordingsCheck:
    """Recordings held against one limit.

    Parameters
    ----------
    source : str
        Name of the file or campaign.
    limit : ForceLimit or NewtonLimit
    conditions : Conditions
        What they were measured under.
    recordings : tuple of CheckedRecording
    """

    source: str
    limit: ForceLimit | NewtonLimit
    conditions: Conditions
    recordings: tuple[CheckedRecording, ...]

    @property
    def permitted(self) -> bool:
        """False if the limit permits no contact at all."""
        return isinstance(self.limit, NewtonLimit) or self.limit.permitted

    @property
    def verdicts(self) -> list[Verdict]:
        """Of all impacts."""
        return [verdict for each in self.recordings for verdict in each.verdicts]

    @property
    def outcome(self) -> VerdictOutcome | None:
        """The gravest; cannot tell where one is not judged, or none is there; None if no contact is permitted."""
        if not self.permitted:
            return None
        outcomes = [verdict.outcome for verdict in self.verdicts]
        unjudged = [VerdictOutcome.CANNOT_TELL for each in self.recordings if each.not_judged]
        return VerdictOutcome.worst([*outcomes, *unjudged])

    @property
    def simulated(self) -> bool:
        """True if the campaign or a recording says so."""
        read = [each.recorded.recording for each in self.recordings if each.recorded]
        return self.conditions.simulated or any(recording.simulated for recording in read)


def check_file(
    path: str | Path,
    limit: ForceLimit | NewtonLimit,
    *,
    conditions: Conditions | None = None,
    columns: ColumnMap | None = None,
    interpretation: Interpretation | None = None,
    contact: Contact | None = None,
    name: str | None = None,
    doubt: Finding | None = None,
) -> RecordingsCheck:
    """Check the impacts of all recordings in a file against a limit.

    Parameters
    ----------
    path : str or Path
    limit : ForceLimit or NewtonLimit
    conditions : Conditions, optional
        Device, date and channel frequency class of the measurement.
    columns : ColumnMap, optional
        How the device writes its files.
    interpretation, contact : optional
        As in `check_impact`.
    name : str, optional
        What the file is called; its own name if not given.
    doubt : Finding, optional
        Why none may be within: what `recording_doubt` says of a file in a campaign.

    Raises
    ------
    RecordingError
        Anything in the file that could be read wrongly.
    """
    conditions, name = conditions or Conditions(), name or Path(path).name
    asked = {"interpretation": interpretation, "contact": contact}
    recordings = (
        CheckedRecording(
            each.recording.name, each, _verdicts(each, each.doubt or doubt, limit, **asked), each.doubt or doubt
        )
        for each in recorded_impacts(path, conditions, columns, name=name)
    )
    return RecordingsCheck(name, limit, conditions, tuple(recordings))


_OF_EVERY_RECORDING = (FindingKind.UNIT_SLIP, FindingKind.UNIT_OF_TIME_SLIP, FindingKind.CONDITION_CHANGED)


def recording_doubt(folder: str | Path, file: str | Path | None = None) -> Finding | None:
    """What a campaign, as it was collected, says against every recording measured in it; None if nothing.

    A unit that is mistaken, a condition that was changed; and of a file in its folder that it was changed.

    Parameters
    ----------
    folder : str or Path
        Of the campaign.
    file : str or Path, optional
        A file below its folder of recordings.
    """
    try:
        campaign = read_campaign(folder)
        refusal = read_dataset(folder).binding.refusal
    except InputError:  # not collected yet
        return None
    if refusal and refusal.kind in _OF_EVERY_RECORDING:
        return refusal
    inside = file and Path(file).resolve().relative_to(campaign.recordings.resolve()).as_posix()
    entry = next((each for each in campaign.entries if each.file == inside and not each.blank), None)
    if entry is None or file is None or entry.sha256 in ("", file_sha256(file)):
        return None
    return Finding.of(FindingKind.FILE_CHANGED)


def check_campaign(
    campaign: Campaign,
    limit: ForceLimit | NewtonLimit,
    *,
    interpretation: Interpretation | None = None,
    contact: Contact | None = None,
    progress: Progress | None = None,
) -> RecordingsCheck:
    """Check the impacts of all recordings of a campaign against a limit, but for those that a person excluded.

    Where the campaign's states together show that a unit is mistaken, no impact is within.

    Parameters
    ----------
    campaign : Campaign
    limit : ForceLimit or NewtonLimit
    interpretation, contact : optional
        As in `check_impact`.
    progress : callable, optional
        Called with the number of files done and of all files.

    Raises
    ------
    InputError
        There is no recording.
    CampaignFileError
        A link that leads to no file lies among the recordings.
    """
    asked = {"interpretation": interpretation, "contact": contact}
    found = list(walk(campaign, progress=progress))
    mistaken = mistaken_unit(campaign, filter(None, (each.measured for each in found)))
    checked = []
    for each in found:
        excluded, recorded, doubt = each.excluded, each.recorded, each.doubt or mistaken
        verdicts = () if excluded else _verdicts(recorded, doubt, limit, **asked)
        checked.append(CheckedRecording(each.entry.name, recorded, verdicts, None if excluded else doubt, excluded))
    if not checked:
        raise InputError("found no recording to check", file=str(campaign.recordings))
    return RecordingsCheck(campaign.folder.resolve().name, limit, campaign.conditions, tuple(checked))


def _verdicts(
    recorded: RecordedImpacts | None, doubt: Finding | None, limit: ForceLimit | NewtonLimit, **asked: Any
) -> tuple[Verdict, ...]:
    """Verdicts of a recording's impacts; where there is a doubt, only that a limit is exceeded counts."""
    if recorded is None or (isinstance(limit, ForceLimit) and not limit.permitted):
        return ()
    verdicts = (check_impact(impact, limit, **asked) for impact in recorded.impacts)
    return tuple(v for v in verdicts if not doubt or v.outcome is VerdictOutcome.EXCEEDED)


@dataclass(frozen=True, eq=False)
class RecordingResult:
    """One recording beside several limits.

    Parameters
    ----------
    entry : Entry
        What it is and what became of it, as registered.
    judgements : tuple of (Judgement or None)
        The strictest judgement of its gravest impact, one for each limit; None where nothing was judged.
    not_judged : Finding or None
        Why nothing can be told from it: excluded by a person, no impact, unreadable, not filtered, changed since
        registration, no contact permitted; None otherwise.
    time, force : array
        Time after onset [s] and contact force [N] of the first impact, thinned out, extremes kept; empty without one.
    simulated : bool
        True if the file says so.
    """

    entry: Entry
    judgements: tuple[Judgement | None, ...]
    not_judged: Finding | None
    time: FloatArray
    force: FloatArray
    simulated: bool


@dataclass(frozen=True, eq=False)
class JudgedRecordings:
    """All recordings of a campaign.

    Parameters
    ----------
    results : tuple of RecordingResult
        In the order of the register, those that are not registered last.
    gravest : Verdict or None
        The impact that takes the largest share of the first permitted limit, with its whole curve; None without one.
    gravest_limit : ForceLimit or None
        That limit.
    """

    results: tuple[RecordingResult, ...]
    gravest: Verdict | None
    gravest_limit: ForceLimit | None


def judge_recordings(
    campaign: Campaign, limits: Sequence[ForceLimit], *, progress: Progress | None = None
) -> JudgedRecordings:
    """Judge the impacts of every recording that no person excluded; nothing is written.

    Parameters
    ----------
    campaign : Campaign
    limits : sequence of ForceLimit
    progress : callable, optional
        Called with the number of files done and of all files.

    Raises
    ------
    CampaignFileError
        A link that leads to no file lies among the recordings.
    """
    permitted = [limit for limit in limits if limit.permitted]
    results: list[RecordingResult] = []
    measured: list[Measured] = []
    gravest: Verdict | None = None  # no other is held: curves take memory
    for found in walk(campaign, progress=progress):
        result, verdicts = _result(found, limits)
        results.append(result)
        measured += [found.measured] if found.measured else []
        gravest = max([*([gravest] if gravest else []), *verdicts], key=_share, default=None)
    if mistaken := mistaken_unit(campaign, measured):
        results = [_doubted(result, mistaken) for result in results]
    return JudgedRecordings(tuple(results), gravest, permitted[0] if gravest else None)


def _doubted(result: RecordingResult, doubt: Finding) -> RecordingResult:
    """The result where no impact may be within: only that a limit is exceeded counts."""
    if result.not_judged:
        return result
    exceeded = tuple(each if each and each.outcome is VerdictOutcome.EXCEEDED else None for each in result.judgements)
    return replace(result, judgements=exceeded, not_judged=doubt)


def gravest_judgement(judgements: Iterable[Judgement]) -> Judgement | None:
    """The gravest outcome, of those the one that takes the largest share of its limit; None without any."""
    return max(judgements, key=lambda judgement: judgement.gravity, default=None)


def _result(found: CampaignRecording, limits: Sequence[ForceLimit]) -> tuple[RecordingResult, Sequence[Verdict]]:
    """The result of a recording, and its verdicts under the first permitted limit."""
    entry, recorded = found.entry, None if found.excluded else found.recorded
    time = force = np.empty(0)
    why = Finding.of(FindingKind.EXCLUDED_BY_PERSON) if found.excluded else found.doubt
    if found.state is FileState.NEW:
        entry = Entry(file=entry.file, curve=entry.curve, reason="not registered yet")
    verdicts = [_verdicts(recorded, found.doubt, each) for each in limits]
    judgements = tuple(gravest_judgement(verdict.governing for verdict in under) for under in verdicts)
    first = next((k for k, limit in enumerate(limits) if limit.permitted), None)
    if recorded and recorded.impacts and (any(verdicts) or not found.doubt):
        time, force = thinned(*recorded.impacts[0].curve())
        why = why or (Finding.of(FindingKind.NO_CONTACT_PERMITTED) if first is None else None)
    simulated = found.recorded is not None and found.recorded.recording.simulated
    return RecordingResult(entry, judgements, why, time, force, simulated), () if first is None else verdicts[first]


def thinned(time: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A curve, arrays of shape (n,), with the lowest and highest sample of every interval, and both of its ends.

    Half of the intervals lie in the first 0.1 s, where Phase I is.
    """
    if time.size <= 2 * _BINS:
        return time, force
    half = _BINS // 2
    fast = min(_FAST, time[-1])
    edges = np.concatenate([np.linspace(0, fast, half + 1)[1:-1], np.linspace(fast, time[-1], half)])
    parts = [part for part in np.split(np.arange(time.size), np.searchsorted(time, edges)) if part.size]
    extremes = [part[at(force[part])] for part in parts for at in (np.argmin, np.argmax)]
    chosen = np.unique([0, *extremes, time.size - 1])
    return time[chosen], force[chosen]


def _share(verdict: Verdict) -> float:
    return verdict.governing.force / verdict.governing.limit
