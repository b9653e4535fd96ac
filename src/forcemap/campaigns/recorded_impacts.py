"""A file of a device -> its recordings with their impacts, as a campaign states them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from forcemap.campaigns.conditions import Conditions
from forcemap.errors import InputError
from forcemap.findings import Finding, in_words
from forcemap.impacts.detect import find_impacts, no_impact
from forcemap.impacts.impact import Impact
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.read import read_recordings
from forcemap.recordings.recording import Recording


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
    def doubt_words(self) -> str:
        """Why its impacts do not show that a limit was kept; empty if they may."""
        return self.not_filtered if self.impacts else no_impact(self.recording)

    @property
    def doubt(self) -> Finding | None:
        """The same as a finding; None if they may."""
        return in_words(self.doubt_words) if self.doubt_words else None


def recorded_impacts(
    path: str | Path,
    conditions: Conditions,
    columns: ColumnMap | None = None,
    *,
    name: str | None = None,
    state: str = "",
) -> list[RecordedImpacts]:
    """The recordings in a file, and their impacts.

    Parameters
    ----------
    path : str or Path
    conditions : Conditions
        Device, date and channel frequency class of the measurement; nothing else counts (`judged_under`).
    columns : ColumnMap, optional
        How the device writes its files.
    name : str, optional
        What the recordings are called in place of the path.
    state : str, optional
        The state they are of, if it is known: of several devices it may tell which.

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
    return [_with_impacts(recording, conditions, state) for recording in read]


def judged_under(conditions: Conditions) -> Conditions:
    """The conditions that `recorded_impacts` depends on, and no others: device, date, channel frequency class."""
    return Conditions(
        device=conditions.device,
        devices=conditions.devices,
        date=conditions.date,
        channel_frequency_class=conditions.channel_frequency_class,
    )


def _with_impacts(recording: Recording, conditions: Conditions, state: str) -> RecordedImpacts:
    """A recording of a state, if that is known, with its impacts on its own device."""
    frequency_class = conditions.channel_frequency_class
    if conditions.devices:
        recording = replace(recording, device=conditions.device_of(state, recording.name))
    try:
        return RecordedImpacts(recording, tuple(find_impacts(recording, channel_frequency_class=frequency_class)))
    except InputError as error:  # sampled too unevenly; its scenario still counts, and that it exceeds a limit
        return RecordedImpacts(recording, tuple(find_impacts(recording)), error.message)
