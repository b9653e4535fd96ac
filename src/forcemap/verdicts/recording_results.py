"""Every recording of a campaign beside the force limits: its curve, and what becomes of it under every limit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.recordings_table import Entry
from forcemap.errors import InputError, RecordingError
from forcemap.files import file_sha256
from forcemap.impacts.detect import find_impacts, no_impact
from forcemap.impacts.impact import Impact
from forcemap.limits.force_limits import ForceLimit
from forcemap.recordings.read import read_recordings
from forcemap.recordings.recording import Recording
from forcemap.verdicts.verdict import Judgement, Verdict, VerdictOutcome, check_impact

_BINS = 60  # of a curve, each with its lowest and highest sample
_FAST = 0.1  # [s] after onset; half of the bins lie before it
_SEVERITY = (VerdictOutcome.WITHIN, VerdictOutcome.CANNOT_TELL, VerdictOutcome.EXCEEDED)


@dataclass(frozen=True, eq=False)
class RecordingResult:
    """One recording beside the limits.

    Parameters
    ----------
    entry : Entry
        What it is and what became of it, as registered.
    judgements : tuple of (Judgement or None)
        The strictest judgement of its gravest impact, one for each limit; None where nothing was judged.
    not_judged : str
        Why nothing was judged: excluded by a person, no impact, unreadable, changed since registration, no contact
        permitted; empty otherwise.
    time, force : array
        Time after onset [s] and contact force [N] of the first impact, thinned out, extremes kept; empty without one.
    simulated : bool
        True if the file says so.
    """

    entry: Entry
    judgements: tuple[Judgement | None, ...]
    not_judged: str
    time: FloatArray
    force: FloatArray
    simulated: bool = False


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
    campaign: Campaign, limits: Sequence[ForceLimit], *, progress: Callable[[int, int], None] | None = None
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
    entries: dict[str, list[Entry]] = {entry.file: [] for entry in campaign.entries}
    for entry in campaign.entries:
        entries[entry.file].append(entry)
    there = set(campaign.files())
    files = [*entries, *sorted(there - entries.keys())]
    results: list[RecordingResult] = []
    verdicts: list[Verdict] = []
    for done, file in enumerate(files, start=1):
        known = entries.get(file, [])
        if file not in there:
            results += [_silent(entry, limits, "registered, but the file is gone") for entry in known]
            continue
        for result, verdict in _judge_file(campaign, file, known, limits):
            results.append(result)
            verdicts = sorted([*verdicts, *([verdict] if verdict else [])], key=_share)[-1:]  # curves take memory
        if progress:
            progress(done, len(files))
    if not verdicts:
        return JudgedRecordings(tuple(results), None, None)
    return JudgedRecordings(tuple(results), verdicts[0], permitted[0])


def gravest_judgement(judgements: Sequence[Judgement]) -> Judgement | None:
    """The gravest outcome, of those the one that takes the largest share of its limit; None without any."""
    return max(judgements, key=lambda j: (_SEVERITY.index(j.outcome), j.force / j.limit), default=None)


def _judge_file(
    campaign: Campaign, file: str, known: Sequence[Entry], limits: Sequence[ForceLimit]
) -> Iterator[tuple[RecordingResult, Verdict | None]]:
    """The result of every recording of a file, and the gravest verdict under the first permitted limit."""
    path = campaign.recordings / file
    unregistered = [Entry(file=file, reason="not registered yet")]
    by_curve = {entry.curve: entry for entry in known}
    try:
        if any(entry.sha256 and entry.sha256 != file_sha256(path) for entry in known[:1]):
            yield from ((_silent(entry, limits, "CHANGED since it was registered"), None) for entry in known)
            return
        recordings = read_recordings(path, columns=campaign.columns, device=campaign.conditions.device)
    except (RecordingError, InputError) as error:
        yield from ((_silent(entry, limits, error.message), None) for entry in known or unregistered)
        return
    for recording in recordings:
        whole = by_curve.get("", replace(unregistered[0], curve=recording.curve))
        entry = by_curve.get(recording.curve, whole)
        if entry.exclude:
            yield replace(_silent(entry, limits, "excluded by a person"), simulated=recording.simulated), None
        else:
            yield _judge(campaign, replace(recording, file=file), entry, limits)  # its name, wherever the folder lies


def _judge(
    campaign: Campaign, recording: Recording, entry: Entry, limits: Sequence[ForceLimit]
) -> tuple[RecordingResult, Verdict | None]:
    impacts = _impacts(campaign, recording)
    if not impacts:
        silent = _silent(entry, limits, no_impact(recording))
        return replace(silent, simulated=recording.simulated), None
    verdicts = [[check_impact(each, limit) for each in impacts] if limit.permitted else [] for limit in limits]
    first = next((found for found in verdicts if found), [])
    time, force = thinned(*impacts[0].curve())
    result = RecordingResult(
        entry=entry,
        judgements=tuple(gravest_judgement([verdict.governing for verdict in found]) for found in verdicts),
        not_judged="" if first else "no contact permitted",
        time=time,
        force=force,
        simulated=recording.simulated,
    )
    return result, max(first, key=_share, default=None)


def _impacts(campaign: Campaign, recording: Recording) -> list[Impact]:
    conditions = campaign.conditions
    if conditions.date:
        recording = replace(recording, metadata={**recording.metadata, "date": conditions.date})
    try:
        return find_impacts(recording, channel_frequency_class=conditions.channel_frequency_class)
    except InputError:  # sampled too unevenly for the low-pass: the raw peak counts all the same
        return find_impacts(recording)


def thinned(time: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A curve, arrays of shape (n,), with the lowest and highest sample of every interval, and both of its ends.

    Half of the intervals lie in the first 0.1 s, where Phase I is.
    """
    if time.size <= 2 * _BINS:
        return time, force
    half = _BINS // 2
    fast = min(_FAST, time[-1])
    edges = np.concatenate([np.linspace(0, fast, half + 1)[1:-1], np.linspace(fast, time[-1], half)])
    kept = {0, time.size - 1}
    for part in np.split(np.arange(time.size), np.searchsorted(time, edges)):
        if part.size:
            kept |= {int(part[force[part].argmin()]), int(part[force[part].argmax()])}
    chosen = np.array(sorted(kept))
    return time[chosen], force[chosen]


def _silent(entry: Entry, limits: Sequence[ForceLimit], why: str) -> RecordingResult:
    return RecordingResult(entry, tuple(None for _ in limits), why, np.empty(0), np.empty(0))


def _share(verdict: Verdict) -> float:
    return verdict.governing.force / verdict.governing.limit
