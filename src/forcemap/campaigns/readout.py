"""What a campaign's tables take from a file: a few figures of every recording and impact in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, Protocol

from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.copies import Edge, edge_of
from forcemap.campaigns.recorded_impacts import RecordedImpacts, judged_under, recorded_impacts
from forcemap.errors import InputError, MissingExtra, RecordingError
from forcemap.files import file_sha256
from forcemap.findings import Finding, in_words
from forcemap.impacts.detect import force_without_impact
from forcemap.impacts.impact import Flag, Impact
from forcemap.impacts.scenario import ContactScenario
from forcemap.recordings.recording import Recording


class ImpactReadout(NamedTuple):
    """The figures of an impact, under the names and in the units of `Impact`; and what tells a copy of it."""

    onset: float
    phase1_duration: float
    peak_force: float
    raw_peak_force: float
    map_force: float
    phase2_force: float
    saturated: bool
    scenario: ContactScenario
    edge: Edge
    flags: tuple[Flag, ...]

    @classmethod
    def of(cls, impact: Impact, recording: Recording) -> ImpactReadout:
        """The figures of an impact in a recording."""
        return cls(
            onset=float(impact.onset),
            phase1_duration=float(impact.phase1_end - impact.onset),
            peak_force=float(impact.peak_force),
            raw_peak_force=float(impact.raw_peak_force),
            map_force=float(impact.map_force),
            phase2_force=float(impact.phase2_force),
            saturated=bool(impact.saturated),
            scenario=impact.scenario,
            edge=edge_of(impact, recording),
            flags=impact.flags,
        )


class Readout(NamedTuple):
    """The figures of a recording: its curve's name, the file's size [bytes], and what its impacts show.

    `force_without` is the force where no impact was found [N]; `doubt_words` why it shows no limit kept.
    """

    curve: str
    size: int
    simulated: bool
    notes: tuple[str, ...]
    force_without: float
    doubt_words: str
    impacts: tuple[ImpactReadout, ...]

    @property
    def doubt(self) -> Finding | None:
        """Why it does not show that a limit was kept; None if it may."""
        return in_words(self.doubt_words) if self.doubt_words else None

    @classmethod
    def of(cls, recorded: RecordedImpacts) -> Readout:
        """The figures of a recording and its impacts."""
        recording, impacts = recorded.recording, recorded.impacts
        return cls(
            curve=recording.curve,
            size=recording.size,
            simulated=recording.simulated,
            notes=recording.notes,
            force_without=0.0 if impacts else float(force_without_impact(recording)),
            doubt_words=recorded.doubt_words,
            impacts=tuple(ImpactReadout.of(impact, recording) for impact in impacts),
        )


@dataclass(frozen=True, eq=False)
class FileReadout:
    """What was read of a file.

    Parameters
    ----------
    sha256 : str
        Of the file; empty if it cannot be opened.
    readouts : tuple of Readout
        One for each recording in it; none if it cannot be read.
    unreadable : str
        Why it cannot be read.
    missing_extra : bool
        It cannot be read here because an optional dependency is not installed.
    recorded : tuple of RecordedImpacts
        The recordings themselves, where they were asked for.
    """

    sha256: str
    readouts: tuple[Readout, ...] = ()
    unreadable: str = ""
    missing_extra: bool = False
    recorded: tuple[RecordedImpacts, ...] = ()


class Reader(Protocol):
    """Reads a file of a campaign by its name below the folder of recordings."""

    def __call__(self, file: str, state: str = "") -> FileReadout:
        """What the file holds; `state` as in `recorded_impacts`."""


def judging(campaign: Campaign) -> Reader:
    """The reader that judges every file it is asked for, and gives the recordings themselves."""
    conditions, columns = judged_under(campaign.conditions), campaign.columns

    def read(file: str, state: str = "") -> FileReadout:
        path = campaign.recordings / file
        try:
            recorded = tuple(recorded_impacts(path, conditions, columns, name=file, state=state))
        except (InputError, MissingExtra) as error:
            row = error.row if isinstance(error, RecordingError) else None
            unreadable = f"row {row}, {error.message}" if row is not None else error.message
            return FileReadout(sha256_of(path), (), unreadable, isinstance(error, MissingExtra))
        checksum = recorded[0].recording.sha256 if recorded else sha256_of(path)
        return FileReadout(checksum, tuple(map(Readout.of, recorded)), recorded=recorded)

    return read


def judging_once(campaign: Campaign) -> tuple[Reader, Reader]:
    """Two readers that judge a file once between them: one gives the recordings, too; the other what that one has read.

    For two walks over a campaign one after the other, which then see the same files.
    """
    judge, seen = judging(campaign), dict[tuple[str, str], FileReadout]()

    def first(file: str, state: str = "") -> FileReadout:
        shown = judge(file, state)
        seen[file, state] = replace(shown, recorded=())  # curves take memory
        return shown

    def again(file: str, state: str = "") -> FileReadout:
        return seen.get((file, state)) or judge(file, state)

    return first, again


def sha256_of(path: str | Path) -> str:
    """SHA-256 of a file; empty if it cannot be opened."""
    try:
        return file_sha256(path)
    except InputError:
        return ""
