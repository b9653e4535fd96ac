"""Whether an impact is one that was read before, under another name, in another file, or cut off elsewhere."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.copies import Edge, Edges, edge_of
from forcemap.campaigns.point_recordings import PointRecording
from forcemap.campaigns.recorded_impacts import RecordedImpacts, recorded_impacts
from forcemap.errors import ForcemapError

_PEAK_SHARE, _PEAK_APART = 0.01, 3.0  # by which the peak of a copy may differ, cut off or rounded: a share, and [N]


class Originals:
    """The impacts read so far, and those of a campaign's recordings.

    Parameters
    ----------
    campaign : Campaign or None
        Its recordings with nearly the same peak are read, once.
    """

    def __init__(self, campaign: Campaign | None) -> None:
        self._campaign, self._read = campaign, set[str]()
        entries = () if campaign is None else campaign.entries
        self._files = {entry.sha256: entry.file for entry in entries if entry.sha256}
        self._names, self._edges = list[str](), Edges()

    def of(self, recording: PointRecording) -> str:
        """The name of the recording that a file repeats; empty if it repeats none."""
        if not recording.sha256:
            return ""
        impacts = [(impact, each.recording) for each in recording.recorded for impact in each.impacts]
        self._look_up([float(impact.raw_peak_force) for impact, _ in impacts])
        known = [self._files.setdefault(recording.sha256, recording.name)]
        for impact, of in impacts:
            edge = edge_of(impact, of)
            known += [self._names[i] for i in self._edges.same_as(edge)]
            self._add(recording.name, edge)
        return next((name for name in known if name != recording.name), "")

    def _look_up(self, peaks: Iterable[float]) -> None:
        """Read the campaign's recordings whose peaks [N] are nearly these."""
        for file in self._files_with(np.array([*peaks])):
            self._read.add(file)
            for each in self._recorded(file):
                for impact in each.impacts:
                    self._add(file, edge_of(impact, each.recording))

    def _add(self, name: str, edge: Edge) -> None:
        self._names.append(name)
        self._edges.add([edge])

    def _files_with(self, peaks: FloatArray) -> Iterator[str]:
        entries = () if self._campaign is None else self._campaign.entries
        near = _PEAK_APART + _PEAK_SHARE * peaks
        yield from dict.fromkeys(
            entry.file
            for entry in entries
            if entry.file not in self._read and np.any(np.abs(entry.raw_peak_force - peaks) <= near)
        )

    def _recorded(self, file: str) -> list[RecordedImpacts]:
        assert self._campaign is not None
        path: Path = self._campaign.recordings / file
        try:
            return recorded_impacts(path, self._campaign.conditions, self._campaign.columns)
        except ForcemapError:  # what becomes of it is said elsewhere
            return []
