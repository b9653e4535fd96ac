"""Every recording of a campaign, or of a file, beside force limits: its verdicts, or why there are none."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.campaign import Campaign, read_campaign
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.impacts_table import read_dataset
from forcemap.campaigns.phase_two import force_sinks
from forcemap.campaigns.pressures import PRESSURES_FOLDER, Films, films_in, measured_pressure
from forcemap.campaigns.readout import Reader
from forcemap.campaigns.recorded_impacts import RecordedImpacts, recorded_impacts
from forcemap.campaigns.recordings_table import Entry
from forcemap.campaigns.walk import CampaignRecording, FileState, Measured, Progress, mistaken_unit, walk
from forcemap.errors import InputError
from forcemap.files import file_sha256
from forcemap.findings import Finding, FindingKind
from forcemap.impacts.impact import Quality
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.recordings.column_map import ColumnMap
from forcemap.verdicts.pressure_verdict import PressureVerdict, check_pressure
from forcemap.verdicts.verdict import Interpretation, Judgement, Verdict, VerdictOutcome, check_impact

_BINS = 60  # of a curve for a figure, with the lowest and highest sample of every one; a choice
_FAST = 0.1  # half of the bins lie in this time after onset, where Phase I is; a choice [s]


@dataclass(frozen=True, eq=False)
class CheckedRecording:
    """One recording compared with one limit.

    Parameters
    ----------
    name : str
        The file, and the curve if it holds several.
    recorded : RecordedImpacts or None
        The recording and its impacts; None where it is gone or cannot be read.
    verdicts : tuple of Verdict
        One for every impact; none if a person excluded it, or if the limit permits no contact; if it is not judged,
        only those that exceed the limit.
    not_judged : Finding or None
        Why it shows nothing; None if it does.
    excluded : str
        Why a person excluded it; empty if nobody did.
    pressure : PressureVerdict or None
        Its pressure beside the limit; None where none was measured, or the limit has none.
    """

    name: str
    recorded: RecordedImpacts | None = None
    verdicts: tuple[Verdict, ...] = ()
    not_judged: Finding | None = None
    excluded: str = ""
    pressure: PressureVerdict | None = None


@dataclass(frozen=True, eq=False)
class RecordingsCheck:
    """Recordings compared with one limit.

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
        """The verdicts of all impacts."""
        return [verdict for recording in self.recordings for verdict in recording.verdicts]

    @property
    def outcome(self) -> VerdictOutcome | None:
        """The gravest; cannot tell if one is not judged, or there is none; None if no contact is permitted."""
        if not self.permitted:
            return None
        outcomes = [verdict.outcome for verdict in self.verdicts]
        unjudged = [VerdictOutcome.CANNOT_TELL for recording in self.recordings if recording.not_judged]
        return VerdictOutcome.worst([*outcomes, *unjudged, *(verdict.outcome for verdict in self.pressures)])

    @property
    def pressures(self) -> list[PressureVerdict]:
        """The pressures beside the limit."""
        return [checked.pressure for checked in self.recordings if checked.pressure]

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """What must be said first: that the unit of the force stands in no file, that forces sink slowly, and that of
        the verdicts."""
        judged = [(each.name, each.recorded) for each in self.recordings if each.recorded and each.verdicts]
        unit_open = tuple(recorded.recording.name for _, recorded in judged if not recorded.recording.unit_stated)
        said = [Finding.of(FindingKind.UNIT_NOT_IN_FILE, names=unit_open)] if unit_open else []
        flags = {name: {flag.name for each in recorded.impacts for flag in each.flags} for name, recorded in judged}
        if sinking := tuple(name for name, found in flags.items() if Quality.SLOW_RETURN in found):
            said.append(force_sinks(len(sinking) / len(flags), sinking))
        return (*said, *(line for verdict in self.verdicts for line in verdict.warnings))

    @property
    def simulated(self) -> bool:
        """True if the campaign or a recording says so."""
        read = [checked.recorded.recording for checked in self.recordings if checked.recorded]
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
    folder: Path | None = None,
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
    folder : Path, optional
        Of the campaign: a file in its `pressures/` with the name of this one is judged, too.

    Raises
    ------
    RecordingError
        Anything in the file that could be read wrongly.
    """
    conditions, name = conditions or Conditions(), name or Path(path).name
    asked = {"interpretation": interpretation, "contact": contact}
    measured = list(recorded_impacts(path, conditions, columns, name=name))
    films = None if folder is None or len(measured) > 1 else films_in(folder / PRESSURES_FOLDER)
    film = None if films is None else (films, conditions, Entry(file=Path(path).name))
    recordings = (
        CheckedRecording(
            recorded.recording.name,
            recorded,
            recording_verdicts(recorded, why, limit, **asked),
            why,
            pressure=recording_pressure(film, recorded, limit, contact),
        )
        for recorded, why in ((recorded, recorded.doubt or doubt) for recorded in measured)
    )
    return RecordingsCheck(name, limit, conditions, tuple(recordings))


_OF_EVERY_RECORDING = (FindingKind.UNIT_SLIP, FindingKind.UNIT_OF_TIME_SLIP, FindingKind.CONDITION_CHANGED)


def recording_doubt(folder: str | Path, file: str | Path | None = None) -> Finding | None:
    """What a campaign, as it was collected, says against every recording measured in it; None if nothing.

    A mistaken unit, a changed condition; for a file in its folder also that it was changed.

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
    entry = next((entry for entry in campaign.entries if entry.file == inside and not entry.blank), None)
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
    states: Collection[str] | None = None,
) -> RecordingsCheck:
    """Check the impacts of all recordings of a campaign against a limit, except those that a person excluded.

    If the campaign's states together show that a unit is mistaken, no impact is within.

    Parameters
    ----------
    campaign : Campaign
    limit : ForceLimit or NewtonLimit
    interpretation, contact : optional
        As in `check_impact`.
    progress : callable, optional
        Called with the number of files done and of all files.
    states : collection of str, optional
        States whose recordings alone are checked, and may show that a unit is mistaken; all if not given.

    Raises
    ------
    InputError
        There is no recording.
    CampaignFileError
        A link that leads to no file lies among the recordings.
    """
    asked = {"interpretation": interpretation, "contact": contact}
    recordings = list(walk(campaign, progress=progress, states=states))
    mistaken = mistaken_unit(campaign, filter(None, (recording.measured for recording in recordings)))
    checked, films = [], films_in(campaign.folder / PRESSURES_FOLDER)
    for recording in recordings:
        excluded, recorded, doubt = recording.excluded, recording.recorded, recording.doubt or mistaken
        verdicts = () if excluded else recording_verdicts(recorded, doubt, limit, **asked)
        name, why = recording.entry.name, None if excluded else doubt
        film = (films, campaign.conditions, recording.entry)
        pressure = None if excluded else recording_pressure(film, recorded, limit, contact)
        checked.append(CheckedRecording(name, recorded, verdicts, why, excluded, pressure))
    if not checked and states is None:
        raise InputError("found no recording to check", file=str(campaign.recordings))
    return RecordingsCheck(campaign.folder.resolve().name, limit, campaign.conditions, tuple(checked))


def recording_pressure(
    film: tuple[Films, Conditions, Entry] | None,
    recorded: RecordedImpacts | None,
    limit: ForceLimit | NewtonLimit,
    contact: Contact | None,
) -> PressureVerdict | None:
    """The pressure of a recording beside the limit; None if there is none of either."""
    if film is None or not isinstance(limit, ForceLimit) or not limit.permitted:
        return None
    films, conditions, entry = film
    if (measured := measured_pressure(films, conditions.film, entry)) is None:
        return None
    impacts = recorded.impacts if recorded else ()
    return check_pressure(measured, limit, film=conditions.film, impacts=impacts, contact=contact)


def recording_verdicts(
    recorded: RecordedImpacts | None, doubt: Finding | None, limit: ForceLimit | NewtonLimit, **asked: Any
) -> tuple[Verdict, ...]:
    """Verdicts of a recording's impacts; if there is a doubt, only those that exceed the limit."""
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
        Why it shows nothing: excluded by a person, no impact, unreadable, not filtered, changed since
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
    campaign: Campaign,
    limits: Sequence[ForceLimit],
    *,
    progress: Progress | None = None,
    reader: Reader | None = None,
) -> JudgedRecordings:
    """Judge the impacts of every recording that no person excluded; nothing is written.

    Parameters
    ----------
    campaign : Campaign
    limits : sequence of ForceLimit
    progress : callable, optional
        Called with the number of files done and of all files.
    reader : Reader, optional
        One that gives the recordings; as in `walk`.

    Raises
    ------
    CampaignFileError
        A link that leads to no file lies among the recordings.
    """
    permitted = [limit for limit in limits if limit.permitted]
    results: list[RecordingResult] = []
    measured: list[Measured] = []
    gravest: Verdict | None = None  # the others are dropped: curves take memory
    for recording in walk(campaign, progress=progress, reader=reader):
        result, verdicts = _result(recording, limits)
        results.append(result)
        measured += [recording.measured] if recording.measured else []
        gravest = max([*([gravest] if gravest else []), *verdicts], key=_share, default=None)
    if mistaken := mistaken_unit(campaign, measured):
        results = [_doubted(result, mistaken) for result in results]
    return JudgedRecordings(tuple(results), gravest, permitted[0] if gravest else None)


def _doubted(result: RecordingResult, doubt: Finding) -> RecordingResult:
    """The result if no impact may be within: only judgements that exceed the limit remain."""
    if result.not_judged:
        return result
    judgements = tuple(
        judgement if judgement and judgement.outcome is VerdictOutcome.EXCEEDED else None
        for judgement in result.judgements
    )
    return replace(result, judgements=judgements, not_judged=doubt)


def gravest_judgement(judgements: Iterable[Judgement]) -> Judgement | None:
    """The gravest outcome, of those the one that takes the largest share of its limit; None without any."""
    return max(judgements, key=lambda judgement: judgement.gravity, default=None)


def _result(recording: CampaignRecording, limits: Sequence[ForceLimit]) -> tuple[RecordingResult, Sequence[Verdict]]:
    """The result of a recording, and its verdicts under the first permitted limit."""
    entry, recorded = recording.entry, None if recording.excluded else recording.recorded
    time = force = np.empty(0)
    why = Finding.of(FindingKind.EXCLUDED_BY_PERSON) if recording.excluded else recording.doubt
    if recording.state is FileState.NEW:
        entry = Entry(file=entry.file, curve=entry.curve, reason="not registered yet")
    verdicts = [recording_verdicts(recorded, recording.doubt, limit) for limit in limits]
    judgements = tuple(gravest_judgement(verdict.governing for verdict in under) for under in verdicts)
    first = next((k for k, limit in enumerate(limits) if limit.permitted), None)
    if recorded and recorded.impacts and (any(verdicts) or not recording.doubt):
        time, force = thinned(*recorded.impacts[0].curve())
        why = why or (Finding.of(FindingKind.NO_CONTACT_PERMITTED) if first is None else None)
    simulated = recording.recorded is not None and recording.recorded.recording.simulated
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
    extremes = [part[extreme(force[part])] for part in parts for extreme in (np.argmin, np.argmax)]
    chosen = np.unique([0, *extremes, time.size - 1])
    return time[chosen], force[chosen]


def _share(verdict: Verdict) -> float:
    return verdict.governing.force / verdict.governing.limit
