"""Whether an impact is one that was read before, under another name, in another file, or cut off elsewhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.copies import Edge, Edges, as_high, edge_of
from forcemap.campaigns.point_recordings import PointRecording
from forcemap.campaigns.recorded_impacts import RecordedImpacts, recorded_impacts
from forcemap.errors import ForcemapError


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
        for impact, _ in impacts:
            self._look_up(float(impact.raw_peak_force))
        known = [self._files.setdefault(recording.sha256, recording.name)]
        for impact, of in impacts:
            edge = edge_of(impact, of)
            known += [self._names[i] for i in self._edges.same_as(edge)]
            self._add(recording.name, edge)
        return next((name for name in known if name != recording.name), "")

    def _look_up(self, peak: float) -> None:
        """Read the campaign's recordings whose peak may be that of a copy [N]."""
        entries = () if self._campaign is None else self._campaign.entries
        same = as_high(peak, np.array([entry.raw_peak_force for entry in entries]))
        for file in dict.fromkeys(entries[i].file for i in np.flatnonzero(same) if entries[i].file not in self._read):
            self._read.add(file)
            for each in self._recorded(file):
                for impact in each.impacts:
                    self._add(file, edge_of(impact, each.recording))

    def _add(self, name: str, edge: Edge) -> None:
        self._names.append(name)
        self._edges.add([edge])

    def _recorded(self, file: str) -> list[RecordedImpacts]:
        assert self._campaign is not None
        path: Path = self._campaign.recordings / file
        try:
            return recorded_impacts(path, self._campaign.conditions, self._campaign.columns)
        except ForcemapError:  # what becomes of it is said elsewhere
            return []
