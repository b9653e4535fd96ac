"""What a recording holds: its sampling, its impacts with their figures, and its curve if asked for."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from forcemap.answers.answer import Answer, Figure, Figures, Said, of
from forcemap.arrays import FloatArray, Indices
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.recorded_impacts import RecordedImpacts

_DRAWN = 1500  # most samples drawn of a curve, its extremes among them: a choice
_DRAWN_OF_ALL = 15_000  # most samples drawn of all curves of a file together: a choice, to keep the answer small


class FlagAnswer(Answer):
    """A quality flag, and the figure behind it in words."""

    name: str
    figure: str


class ImpactFigures(Answer):
    """An impact; times are on the recording's axis unless the key says otherwise."""

    impact: int = of("number")
    onset_s: float = of("onset")
    peak_force_N: float = of("peak_force")
    raw_peak_force_N: float = of("raw_peak_force")
    unseen_force_N: float = of("unseen_force")
    filtered_peak_force_N: Figure = of("filtered_peak_force")
    peak_time_s: float = of("peak_time")
    phase1_end_s: float = of("phase1_end")
    phase1_width_s: Figure = of("phase1_width")
    phase1_samples: int
    largest_force_N: float = of("largest_force")
    later_force_N: Figure = of("later_force")
    phase2_force_N: Figure = of("phase2_force")
    phase2_mean_force_N: Figure = of("phase2_mean_force")
    end_force_N: Figure = of("end_force")
    contact_duration_s: float = of("contact_duration")
    contact_over: bool
    impulse_Ns: Figure = of("impulse")
    bounces: int
    floor_N: float = of("floor")
    baseline_sd_N: Figure = of("contact", "baseline_sd")
    baseline_samples: int = of("contact", "baseline_samples")
    drift_N_per_s: Figure = of("contact", "drift")
    scenario: str
    scenario_words: str = of("scenario", "words")
    flags: list[FlagAnswer]


class Curve(Answer):
    """Force over time, thinned to what can be drawn with its extremes kept."""

    time_s: Figures
    force_N: Figures


class RecordingAnswer(Answer):
    """A recording."""

    recording: str = of("name")
    sha256: str
    samples: int
    duration_s: float = of("duration")
    sampling_rate_Hz: float = of("sampling_rate")
    largest_gap_s: float = of("largest_gap")
    notes: list[str]


class InspectedRecording(RecordingAnswer):
    """A recording and its impacts; `problem` says why there are none, or what was not done."""

    impacts: list[ImpactFigures]
    problem: Said


class InspectAnswer(Answer):
    """What a file of recordings holds."""

    file: str
    simulated: bool
    device_range_N: Figure
    recordings: list[InspectedRecording]

    @classmethod
    def of_file(cls, file: str, recorded: Sequence[RecordedImpacts], conditions: Conditions) -> InspectAnswer:
        """The recordings of a file, measured under these conditions."""
        simulated = conditions.simulated or any(entry.recording.simulated for entry in recorded)
        inspected = [InspectedRecording.from_result(r.recording, impacts=r.impacts, problem=r.doubt) for r in recorded]
        return cls(file=file, simulated=simulated, device_range_N=conditions.device.range, recordings=inspected)


def curves(recorded: Sequence[RecordedImpacts]) -> list[Curve]:
    """The curve of every recording: contact force if it has an impact, else what was measured."""
    most = min(_DRAWN, max(2, _DRAWN_OF_ALL // max(len(recorded), 1)))
    return [_curve(entry, most) for entry in recorded]


def _curve(recorded: RecordedImpacts, most: int) -> Curve:
    time, force = recorded.recording.time, recorded.recording.force
    if recorded.impacts:
        time, force = recorded.impacts[0].contact.time, recorded.impacts[0].contact.force
    elif force.ndim > 1:
        force = np.linalg.norm(force, axis=1)
    drawn = _drawn(force, most)
    return Curve(time_s=np.round(time[drawn], 5).tolist(), force_N=np.round(force[drawn], 2).tolist())


def _drawn(force: FloatArray, most: int) -> Indices:
    """Indices of the samples to draw: the lowest and the highest of every stretch of equal length, and both ends."""
    if force.size <= most:
        return np.arange(force.size)
    edges = np.linspace(0, force.size, most // 2 + 1).astype(np.int64)
    extremes = [start + end(force[start:stop]) for start, stop in pairwise(edges) for end in (np.argmin, np.argmax)]
    return np.unique([0, *extremes, force.size - 1])
