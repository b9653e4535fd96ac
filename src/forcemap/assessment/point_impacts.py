"""The impacts made at contact points: which recordings a point names, and how they stand beside its limit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.assessment.contact_points import ContactPoint
from forcemap.assessment.originals import Originals
from forcemap.campaigns.binding import stated_since
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.conditions import (
    CAMPAIGN_FILE,
    Conditions,
    may_be_alike,
    normalised,
    pattern_fits,
    read_campaign_file,
)
from forcemap.campaigns.impact_rows import planned_words
from forcemap.campaigns.point_list import POINTS_FOLDER, names_file
from forcemap.campaigns.point_recordings import POINT_FILMS, PointRecording, point_names, point_recordings
from forcemap.campaigns.pressures import PRESSURES_FOLDER, Films, films_in, measured_pressure
from forcemap.campaigns.recorded_impacts import RecordedImpacts
from forcemap.campaigns.recordings_table import PLANNED, PRESSURE_FROM, REGISTER_FILE, Entry, Use, row_sha256
from forcemap.campaigns.state import StateTolerance
from forcemap.campaigns.units import single_unit_finding
from forcemap.campaigns.walk import CampaignRecording, FileState, mistaken_unit, walk
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.impacts.impact import Quality
from forcemap.impacts.scenario import ContactScenario
from forcemap.limits.force_limits import Contact
from forcemap.verdicts.pressure_verdict import PressureVerdict
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
    pressure : PressureVerdict or None
        Its pressure beside the limit; None where none was measured.
    not_judged : Finding or None
        Why it does not show that the limit was kept; None if it may.
    excluded : bool
        A person excluded it.
    time, force : array
        Time after onset [s] and contact force [N], thinned out, extremes kept; empty without an impact.
    simulated : bool
        True if the file says so.
    own : bool
        True if its file lies in points/, and is no recording of the campaign.
    sinks : bool
        True if its force returned to zero slowly (flag `slow_return`).
    since : Finding or None
        What is stated that was not when its file in points/ was registered; None if nothing is.
    """

    recording: str
    speed: float = math.nan
    place: tuple[float, float] = (math.nan, math.nan)
    peak_force: float = math.nan
    phase2_force: float = math.nan
    scenario: ContactScenario | None = None
    judgements: tuple[Judgement, ...] = ()
    governing: Judgement | None = None
    pressure: PressureVerdict | None = None
    not_judged: Finding | None = None
    excluded: bool = False
    time: FloatArray = field(default_factory=lambda: np.empty(0))
    force: FloatArray = field(default_factory=lambda: np.empty(0))
    simulated: bool = False
    own: bool = False
    sinks: bool = False
    since: Finding | None = None

    @property
    def outcome(self) -> VerdictOutcome:
        """Whether it is within the limits of force and, where measured, pressure; cannot tell if it is not judged."""
        force = self.governing.outcome if self.governing else VerdictOutcome.CANNOT_TELL
        doubt = [VerdictOutcome.CANNOT_TELL] if self.not_judged else []
        return VerdictOutcome.worst([force, *doubt, *([self.pressure.outcome] if self.pressure else [])])

    @property
    def reason(self) -> Finding:
        """Why the outcome is what it is."""
        judged = [each for each in (self.governing, self.pressure) if each and each.outcome is self.outcome]
        return judged[0].reason if judged else self.not_judged or in_words("no impact found")


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
    own = _own(folder, campaign, points, [(point, pattern) for point, pattern in named if _of_point(pattern)])
    planned = [(point, pattern) for point, pattern in named if not _of_point(pattern)]
    looked_at = campaign is not None and (planned or _may_exceed(campaign, points))
    for point, pattern, impacts in (*own, *(_planned(campaign, points, planned) if campaign and looked_at else ())):
        there = found[point.name]
        there[pattern] = (*there.get(pattern, ()), *impacts)
    return found


def unnamed_files(folder: Path, points: Sequence[ContactPoint]) -> tuple[str, ...]:
    """Files in points/ that no point names; errors as `point_recordings`."""
    patterns = [pattern.casefold() for point in points for pattern in point.recordings]
    return tuple(name for name in point_names(folder) if not names_file(patterns, name))


def _may_exceed(campaign: Campaign, points: Sequence[ContactPoint]) -> bool:
    """Whether a registered recording comes near the lowest limit of any point, has a film, or is unregistered."""
    lowest = min((p.limit.force(Contact.QUASI_STATIC) for p in points if p.limit.permitted), default=math.inf)
    forces = [f for entry in campaign.entries for f in (entry.peak_force, entry.raw_peak_force, entry.phase2_force)]
    unknown = {*campaign.files()} - {entry.file for entry in campaign.entries}
    filmed = any(PRESSURE_FROM in entry.conditions for entry in campaign.entries)
    return bool(unknown) or filmed or any(force > _NEAR * lowest for force in forces)


def _of_point(pattern: str) -> bool:
    return pattern.startswith(f"{POINTS_FOLDER}/")


PASSED_OVER = ""
"""In place of a pattern: recordings of the campaign at a point, or of another point at its spot, that exceed its limit,
and that it does not name."""

_NEAR = 0.8
"""Share of a limit from which on registered forces are looked at again: further than devices' springs raise them."""

_Named = tuple[ContactPoint, str, tuple[PointImpact, ...]]
Film = tuple[Films, Conditions, Entry]  # the films, under which conditions, of which recording


def _own(
    folder: Path, campaign: Campaign | None, every: Sequence[ContactPoint], named: Sequence[tuple[ContactPoint, str]]
) -> Iterator[_Named]:
    """Files in points/ of the campaign's device and file layout, each read once.

    They are held against the limit of every other point at the spot, too, whatever limit theirs has. A copy of another
    file, or of one of the campaign's recordings, is no further impact. Nor is a file of any point that several name
    which do not state the same.
    """
    if not named:
        return
    whose = {
        name: [(point, pattern) for point, pattern in named if fnmatchcase(name.casefold(), pattern.casefold())]
        for name in point_names(folder)
    }
    stated = folder / CAMPAIGN_FILE
    conditions = read_campaign_file(stated)[0] if stated.exists() else Conditions()
    doubt, originals, films = recording_doubt(folder), Originals(campaign), films_in(folder / POINT_FILMS)
    tolerance = StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)
    for recording in point_recordings(folder, [name for name, points in whose.items() if points]):
        points = list(dict.fromkeys(point for point, _ in whose[recording.name]))
        original = originals.of(recording)
        copied = [in_words(f"the same content as {original}, so no further impact")] if original else []
        shared = (
            []
            if len({_made_at(point) for point in points}) == 1
            else [Finding.of(FindingKind.POINT_FILE_SHARED, names=tuple(point.name for point in points))]
        )
        why = next(iter([*copied, *shared, *filter(None, [recording.doubt])]), None)
        film = (films, conditions, Entry(file=recording.name))
        for point, pattern in whose[recording.name]:
            yield point, pattern, tuple(_of_file(point, recording, film, why, doubt))
        for other in every:
            if other not in points and any(_one_spot(other, point, tolerance) for point in points):
                there = replace(other, recorded_at=points[0].recorded_at)
                near = _registered_near(recording, other)
                impacts = _of_file(there, recording, film, why, doubt)
                yield other, PASSED_OVER, tuple(i for i in impacts if near or i.outcome is VerdictOutcome.EXCEEDED)


def _registered_near(
    recording: PointRecording | CampaignRecording, point: ContactPoint, *, moved: bool = False
) -> bool:
    """Whether a recording that shows nothing any more, as it is gone, another, read otherwise or `moved`, came near the
    limit when it was registered, or had a film."""
    entry, limit = recording.entry, point.limit
    if (recording.doubt is None and not moved) or entry is None or not limit.permitted:
        return False
    if entry.exclude and entry.row_sha256 == row_sha256(entry):  # as it was collected
        return False
    forces = (entry.peak_force, entry.raw_peak_force, entry.phase2_force)
    near = any(force > _NEAR * limit.force(Contact.QUASI_STATIC) for force in forces)
    return near or PRESSURE_FROM in entry.conditions


def _one_spot(one: ContactPoint, other: ContactPoint, tolerance: StateTolerance) -> bool:
    """Whether two points may be of one contact site and nearly the same direction, and their places meet."""
    near, alike = tolerance.place, may_be_alike(*_hit(one), *_hit(other))
    along = one.distance <= other.distance_to + near and other.distance <= one.distance_to + near
    up = one.height <= other.height_to + near and other.height <= one.height_to + near
    return alike and along and up


def _made_at(point: ContactPoint) -> tuple[str, ...]:
    """What a point states of a recording that is made at it."""
    place = (point.distance, point.distance_to, point.height, point.height_to, point.recorded_at)
    return (normalised(point.contact_site), point.direction, *map(repr, place))


def _of_file(
    point: ContactPoint, recording: PointRecording, film: Film, why: Finding | None, doubt: Finding | None
) -> Iterator[PointImpact]:
    """The recordings of a file in points/ beside the limit of a point."""
    if recording.excluded:
        excluded = Finding.of(FindingKind.EXCLUDED_BY_PERSON)
        yield PointImpact(recording.name, point.recorded_at, not_judged=why or excluded, excluded=why is None, own=True)
        return
    if not recording.recorded:
        yield PointImpact(recording.name, point.recorded_at, not_judged=why, own=True)
    for each in recording.recorded:
        pressure = recording_pressure(film, each, point.limit, point.contact)
        peaks = (impact.verdict_peak_force for impact in each.impacts)
        peak = max((force for force in peaks if not math.isnan(force)), default=math.nan)
        slip = single_unit_finding(film[1], point.recorded_at, peak)
        several = in_words("one film of a file with several recordings, expected a file for each recording")
        unclear = several if pressure and len(recording.recorded) > 1 else None
        doubts = why or unclear or each.doubt or doubt or slip
        found = _impact(point, each.recording.name, each, doubts, point.recorded_at, pressure=pressure, own=True)
        yield replace(found, since=stated_since(filter(None, [recording.entry]), film[1]))


def _planned(
    campaign: Campaign, every: Sequence[ContactPoint], named: Sequence[tuple[ContactPoint, str]]
) -> Iterator[_Named]:
    """Recordings of the campaign, in one walk over them; those that a point passes over although they exceed, too."""
    found: dict[tuple[str, str], list[PointImpact]] = {}
    measured, passed_over = [], dict[str, list[PointImpact]]()
    films = films_in(campaign.folder / PRESSURES_FOLDER)
    points = {
        point.name: (point, patterns)
        for point in every
        if (patterns := [each for whose, each in named if whose is point]) or _hit_alike(point, campaign.conditions)
    }
    tolerance = StateTolerance.stated(campaign.conditions.place_tolerance, campaign.conditions.speed_tolerance)
    for recording in walk(campaign):
        measured += [recording.measured] if recording.measured else []
        state = recording.run[0] if recording.run else recording.entry.state_id
        for point, pattern in named:
            if pattern_fits(pattern, state, recording.entry.name):
                found.setdefault((point.name, pattern), []).append(_of_campaign(campaign, point, recording, films))
        moved = _moved(campaign, recording)
        for point, patterns in points.values():
            if not (moved or _is_at(point, _place(campaign, recording), tolerance)):
                continue
            if any(pattern_fits(pattern, state, recording.entry.name) for pattern in patterns):
                continue
            there = _of_campaign(campaign, point, recording, films)
            near = _registered_near(recording, point, moved=moved)
            if there.outcome is VerdictOutcome.EXCEEDED or near:
                passed_over.setdefault(point.name, []).append(there)
    mistaken = mistaken_unit(campaign, measured)
    for point, pattern in named:
        impacts = found.get((point.name, pattern), [])
        yield point, pattern, tuple(_doubted(impact, mistaken) for impact in impacts)
    for name, impacts in passed_over.items():
        point, patterns = points[name]
        named_speeds = [impact.speed for pattern in patterns for impact in found.get((name, pattern), [])]
        fastest = max((speed for speed in named_speeds if not math.isnan(speed)), default=math.inf)
        yield point, PASSED_OVER, tuple(i for i in impacts if not i.speed > fastest + tolerance.speed)


def _hit_alike(point: ContactPoint, conditions: Conditions) -> bool:
    """Whether a point may be of the campaign's contact site and direction."""
    return may_be_alike(*_hit(point), *_hit(conditions))


def _hit(stated: ContactPoint | Conditions) -> tuple[str, str]:
    return stated.contact_site, stated.direction


def _is_at(point: ContactPoint, place: tuple[float, float], tolerance: StateTolerance) -> bool:
    """Whether a place [m] is that of a point, as far as repeats of a state may lie apart."""
    ends = ((point.distance, point.distance_to), (point.height, point.height_to))
    return all(low - tolerance.place <= x <= high + tolerance.place for x, (low, high) in zip(place, ends, strict=True))


def _doubted(impact: PointImpact, doubt: Finding | None) -> PointImpact:
    return impact if doubt is None or impact.not_judged else replace(impact, not_judged=doubt)


def _row(campaign: Campaign, recording: CampaignRecording) -> int | None:
    """The row of the plan of a recording, as registered if nothing tells any more; None if it belongs to no run."""
    return campaign.plan.row_of.get(recording.run or (recording.entry.state_id, recording.entry.repeat))


def _moved(campaign: Campaign, recording: CampaignRecording) -> bool:
    """Whether the plan no longer puts a recording where it did when that was registered: it may be of any place."""
    then = dict(recording.entry.conditions).get(PLANNED, "")
    return bool(then) and then != planned_words(campaign.plan, recording.entry)


def _place(campaign: Campaign, recording: CampaignRecording) -> tuple[float, float]:
    """Distance and height of a recording [m]; NaN if it belongs to no run."""
    if (row := _row(campaign, recording)) is None:
        return (math.nan, math.nan)
    return float(campaign.plan.distance[row]), float(campaign.plan.height[row])


def _of_campaign(campaign: Campaign, point: ContactPoint, recording: CampaignRecording, films: Films) -> PointImpact:
    speed, place, row = recording.entry.speed, _place(campaign, recording), _row(campaign, recording)
    if row is not None:
        speed = float(campaign.plan.speed[row]) if math.isnan(speed) else speed
    at_contact = float(campaign.conditions.at_contact(np.array(speed)))
    name = recording.entry.name
    film = (films, campaign.conditions, recording.entry)
    pressure = recording_pressure(film, recording.recorded, point.limit, point.contact)
    doubt = Finding.of(FindingKind.EXCLUDED_BY_PERSON) if recording.excluded else recording.doubt
    doubt = doubt or _not_as_collected(recording, film)
    excluded = bool(recording.excluded)
    return _impact(point, name, recording.recorded, doubt, at_contact, place, excluded=excluded, pressure=pressure)


def _not_as_collected(recording: CampaignRecording, film: Film) -> Finding | None:
    """Why a recording of the campaign is not one that was collected and used, with its film; None if it is."""
    entry, (films, conditions, _) = recording.entry, film
    if recording.state is FileState.NEW:
        return Finding.of(FindingKind.POINT_NOT_COLLECTED)
    if entry.use is Use.DISCARDED:
        return in_words(entry.reason)
    was, measured = dict(entry.conditions).get(PRESSURE_FROM, ""), measured_pressure(films, conditions.film, entry)
    now = f"{measured.file} {measured.sha256[:16]}" if measured else ""
    if was.partition(": ")[0] == now:
        return None
    words = f"{PRESSURE_FROM} was {was or 'none'!r}, now it is {now or 'none'!r}; forcemap collect"
    return Finding.of(FindingKind.RECORDING_CHANGED, all=(entry.file,), changed=words, register=REGISTER_FILE)


def _impact(
    point: ContactPoint,
    name: str,
    recorded: RecordedImpacts | None,
    doubt: Finding | None,
    speed: float,
    place: tuple[float, float] = (math.nan, math.nan),
    *,
    excluded: bool = False,
    pressure: PressureVerdict | None = None,
    own: bool = False,
) -> PointImpact:
    """A recording beside the limit of a point; of several impacts the gravest."""
    if recorded is None or not recorded.impacts or excluded:
        shown = None if excluded else pressure
        return PointImpact(name, speed, place, pressure=shown, not_judged=doubt, excluded=excluded, own=own)
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
        pressure=pressure,
        not_judged=doubt,
        time=time,
        force=force,
        simulated=recorded.recording.simulated,
        own=own,
        sinks=any(flag.name is Quality.SLOW_RETURN for flag in impact.flags),
    )


def _gravity(verdict: Verdict) -> tuple[int, float]:
    return verdict.governing.gravity
