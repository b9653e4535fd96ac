"""The impacts made at contact points: which recordings a point names, and how they stand beside its limit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.assessment.contact_points import POINTS_FOLDER, ContactPoint
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.conditions import CAMPAIGN_FILE, Conditions, pattern_fits, read_campaign_file
from forcemap.campaigns.recorded_impacts import RecordedImpacts, recorded_impacts
from forcemap.campaigns.walk import CampaignRecording, mistaken_unit, walk
from forcemap.errors import ForcemapError
from forcemap.files import file_sha256
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.impacts.scenario import ContactScenario
from forcemap.limits.force_limits import Contact
from forcemap.verdicts.recording_results import recording_doubt, recording_pressure, recording_verdicts, thinned
from forcemap.verdicts.verdict import Judgement, Verdict, VerdictOutcome


@dataclass(frozen=True, eq=False)
class PointImpact:
    """A recording made at a contact point.

    Parameters
    ----------
    recording : str
        Its name; of a file in points/ with that folder.
    speed : float
        Speed at contact [m/s]; of a file in points/ the speed that was programmed; NaN if nothing tells.
    place : tuple of (float, float)
        Distance and height [m]; NaN if nothing tells.
    peak_force, phase2_force : float
        Phase I peak and largest force after 0.5 s of its gravest impact [N]; NaN without one.
    scenario : ContactScenario or None
    judgements : tuple of Judgement
        Of that impact, one for each interpretation; none without one.
    governing : Judgement or None
        The strictest of them.
    not_judged : Finding or None
        Why it does not show that the limit was kept; None if it may.
    excluded : bool
        A person excluded it.
    time, force : array
        Time after onset [s] and contact force [N], thinned out, extremes kept; empty without an impact.
    simulated : bool
        True if the file says so.
    """

    recording: str
    speed: float = math.nan
    place: tuple[float, float] = (math.nan, math.nan)
    peak_force: float = math.nan
    phase2_force: float = math.nan
    scenario: ContactScenario | None = None
    judgements: tuple[Judgement, ...] = ()
    governing: Judgement | None = None
    not_judged: Finding | None = None
    excluded: bool = False
    time: FloatArray = field(default_factory=lambda: np.empty(0))
    force: FloatArray = field(default_factory=lambda: np.empty(0))
    simulated: bool = False

    @property
    def own(self) -> bool:
        """True if it lies in points/."""
        return self.recording.startswith(f"{POINTS_FOLDER}/")

    @property
    def outcome(self) -> VerdictOutcome:
        """Whether it is within the limit; cannot tell if it is not judged."""
        if self.governing is None:
            return VerdictOutcome.CANNOT_TELL
        doubt = [VerdictOutcome.CANNOT_TELL] if self.not_judged else []
        return VerdictOutcome.worst([self.governing.outcome, *doubt])

    @property
    def reason(self) -> Finding:
        """Why the outcome is what it is."""
        found = self.governing is not None and (self.governing.outcome is self.outcome or not self.not_judged)
        return self.governing.reason if found and self.governing else self.not_judged or in_words("no impact found")


def point_impacts(
    folder: Path, campaign: Campaign | None, points: Sequence[ContactPoint]
) -> dict[str, dict[str, tuple[PointImpact, ...]]]:
    """The recordings that every point names, by point and by the pattern that named them; nothing is written.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    campaign : Campaign or None
        None if it cannot be read; then only files in points/ are found.
    points : sequence of ContactPoint
    """
    named = [(point, pattern) for point in points for pattern in point.recordings]
    found: dict[str, dict[str, tuple[PointImpact, ...]]] = {point.name: {} for point in points}
    known = {} if campaign is None else {entry.sha256: entry.file for entry in campaign.entries if entry.sha256}
    own = _own(folder, [(point, pattern) for point, pattern in named if _of_point(pattern)], known)
    planned = [(point, pattern) for point, pattern in named if not _of_point(pattern)]
    for point, pattern, impacts in (*own, *(_planned(campaign, planned) if campaign and planned else ())):
        there = found[point.name]
        there[pattern] = (*there.get(pattern, ()), *impacts)
    return found


def _of_point(pattern: str) -> bool:
    return pattern.startswith(f"{POINTS_FOLDER}/")


_Named = tuple[ContactPoint, str, tuple[PointImpact, ...]]


def _own(folder: Path, named: Sequence[tuple[ContactPoint, str]], known: Mapping[str, str]) -> Iterator[_Named]:
    """Files in points/ of the campaign's device and file layout, each read once.

    `known` are names of the campaign's recordings by hash: a copy of one, or of another file, is no further impact.
    """
    if not named:
        return
    root = folder / POINTS_FOLDER
    paths = (path for path in root.rglob("*") if path.is_file() and not path.is_symlink())
    inside = {f"{POINTS_FOLDER}/{path.relative_to(root).as_posix()}": path for path in paths}
    files = {name: path for name, path in inside.items() if "/." not in name}
    stated = folder / CAMPAIGN_FILE
    conditions, columns = read_campaign_file(stated) if stated.exists() else (Conditions(), None)
    doubt = recording_doubt(folder)
    first = dict(known)
    for name, path in sorted(files.items()):
        whose = [(point, pattern) for point, pattern in named if fnmatchcase(name.casefold(), pattern.casefold())]
        if not whose:
            continue
        try:
            original = first.setdefault(file_sha256(path), name)
            read = recorded_impacts(path, conditions, columns, name=name)
        except ForcemapError as error:
            for point, pattern in whose:
                words = in_words(error.message if error.row is None else f"row {error.row}, {error.message}")
                yield point, pattern, (PointImpact(name, point.recorded_at, not_judged=words),)
            continue
        copied = None if original == name else in_words(f"the same content as {original}, so no further impact")
        for point, pattern in whose:
            impacts = (_impact(point, r.recording.name, r, copied or r.doubt or doubt, point.recorded_at) for r in read)
            yield point, pattern, tuple(impacts)


def _planned(campaign: Campaign, named: Sequence[tuple[ContactPoint, str]]) -> Iterator[_Named]:
    """Recordings of the campaign, in one walk over them."""
    found: dict[tuple[str, str], list[PointImpact]] = {}
    measured = []
    for recording in walk(campaign):
        measured += [recording.measured] if recording.measured else []
        state = recording.run[0] if recording.run else recording.entry.state_id
        for point, pattern in named:
            if pattern_fits(pattern, state, recording.entry.name):
                found.setdefault((point.name, pattern), []).append(_of_campaign(campaign, point, recording))
    mistaken = mistaken_unit(campaign, measured)
    for point, pattern in named:
        impacts = found.get((point.name, pattern), [])
        yield point, pattern, tuple(_doubted(impact, mistaken) for impact in impacts)


def _doubted(impact: PointImpact, doubt: Finding | None) -> PointImpact:
    return impact if doubt is None or impact.not_judged else replace(impact, not_judged=doubt)


def _of_campaign(campaign: Campaign, point: ContactPoint, recording: CampaignRecording) -> PointImpact:
    speed, place, row = recording.entry.speed, (math.nan, math.nan), campaign.plan.row_of.get(recording.run or ("", 0))
    if row is not None:
        place = float(campaign.plan.distance[row]), float(campaign.plan.height[row])
        speed = float(campaign.plan.speed[row]) if math.isnan(speed) else speed
    at_contact = float(campaign.conditions.at_contact(np.array(speed)))
    doubt = Finding.of(FindingKind.EXCLUDED_BY_PERSON) if recording.excluded else recording.doubt
    name = recording.entry.name
    film = (campaign.folder, campaign.conditions, recording.entry)
    pressure = recording_pressure(film, recording.recorded, point.limit, point.contact)
    if pressure and pressure.outcome is not VerdictOutcome.WITHIN:
        doubt = doubt or pressure.reason
    return _impact(point, name, recording.recorded, doubt, at_contact, place, excluded=bool(recording.excluded))


def _impact(
    point: ContactPoint,
    name: str,
    recorded: RecordedImpacts | None,
    doubt: Finding | None,
    speed: float,
    place: tuple[float, float] = (math.nan, math.nan),
    *,
    excluded: bool = False,
) -> PointImpact:
    """A recording beside the limit of a point; of several impacts the gravest."""
    if recorded is None or not recorded.impacts or excluded:
        return PointImpact(name, speed, place, not_judged=doubt, excluded=excluded)
    whole = point.contact if point.contact is Contact.QUASI_STATIC else None
    verdicts = recording_verdicts(recorded, doubt, point.limit, contact=whole)
    verdict = max(verdicts, key=_gravity, default=None)
    impact = verdict.impact if verdict else recorded.impacts[0]
    time, force = thinned(*impact.curve())
    return PointImpact(
        name,
        speed,
        place,
        peak_force=impact.verdict_peak_force,
        phase2_force=impact.phase2_force,
        scenario=impact.scenario,
        judgements=verdict.judgements if verdict else (),
        governing=verdict.governing if verdict else None,
        not_judged=doubt,
        time=time,
        force=force,
        simulated=recorded.recording.simulated,
    )


def _gravity(verdict: Verdict) -> tuple[int, float]:
    return verdict.governing.gravity
