"""Whether an impact is one that was read before, under another name, in another file, or cut off elsewhere."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.point_recordings import PointRecording
from forcemap.campaigns.recorded_impacts import RecordedImpacts, recorded_impacts
from forcemap.errors import ForcemapError
from forcemap.files import sha256
from forcemap.impacts.impact import Impact


class Originals:
    """The impacts read so far, by the forces of their Phase I, and those of a campaign's recordings.

    Parameters
    ----------
    campaign : Campaign or None
        Its recordings with the same peak are read, once.
    """

    def __init__(self, campaign: Campaign | None) -> None:
        self._campaign, self._read = campaign, set[str]()
        entries = () if campaign is None else campaign.entries
        self._files = {entry.sha256: entry.file for entry in entries if entry.sha256}
        self._impacts: dict[str, str] = {}

    def of(self, recording: PointRecording) -> str:
        """The name of the recording that a file repeats; empty if it repeats none."""
        if not recording.sha256:
            return ""
        impacts = [impact for each in recording.recorded for impact in each.impacts]
        self._look_up({f"{impact.raw_peak_force:.2f}" for impact in impacts})
        known = [self._files.setdefault(recording.sha256, recording.name)]
        known += [self._impacts.setdefault(_signature(impact), recording.name) for impact in impacts]
        return next((name for name in known if name != recording.name), "")

    def _look_up(self, peaks: Iterable[str]) -> None:
        """Read the campaign's recordings whose peaks [N] are these."""
        for file in self._files_with({*peaks}):
            self._read.add(file)
            for each in self._recorded(file):
                for impact in each.impacts:
                    self._impacts.setdefault(_signature(impact), file)

    def _files_with(self, peaks: set[str]) -> Iterator[str]:
        entries = () if self._campaign is None else self._campaign.entries
        yield from dict.fromkeys(
            entry.file for entry in entries if entry.file not in self._read and f"{entry.raw_peak_force:.2f}" in peaks
        )

    def _recorded(self, file: str) -> list[RecordedImpacts]:
        assert self._campaign is not None
        path: Path = self._campaign.recordings / file
        try:
            return recorded_impacts(path, self._campaign.conditions, self._campaign.columns)
        except ForcemapError:  # what becomes of it is said elsewhere
            return []


def _signature(impact: Impact) -> str:
    """A hash of the forces of Phase I, as they were sampled."""
    time, force = impact.curve()
    return sha256(np.round(force[time <= impact.phase1_end - impact.onset], 3).tobytes())
