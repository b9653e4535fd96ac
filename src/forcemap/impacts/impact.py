"""One collision found in a recording, and everything measured of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.impacts.baseline import ContactForce
from forcemap.impacts.scenario import ContactScenario
from forcemap.recordings.recording import Recording

TRANSIENT_TIME = 0.5  # the transient limit holds for this long after the onset of contact [s] (ISO/TS 15066)


class Quality(StrEnum):
    """What can be wrong with an impact."""

    SATURATED = "saturated"
    UNRESOLVED = "unresolved"
    NO_BASELINE = "no_baseline"
    REVERSED = "reversed"
    OBLIQUE = "oblique"
    OFFSET = "offset"
    UNQUIET = "unquiet"
    CUT_OFF = "cut_off"
    DRIFT = "drift"
    DOUBLE_HIT = "double_hit"
    LATER_PEAK = "later_peak"
    SLOW_RETURN = "slow_return"
    RINGING = "ringing"
    TOO_SHORT = "too_short"
    BRAKING_TRANSIENT = "braking_transient"
    GAP = "gap"
    UNIT = "unit"
    SPIKE = "spike"
    JUMP = "jump"
    STEP = "step"
    STUCK = "stuck"
    HUM = "hum"
    CALIBRATION_EXPIRED = "calibration_expired"


@dataclass(frozen=True)
class Flag:
    """A doubt about an impact: its name, and the figure behind it in words."""

    name: Quality
    figure: str

    def __str__(self) -> str:
        return f"{self.name}: {self.figure}"


@dataclass(frozen=True, eq=False)
class Impact:
    """One collision; times on the recording's axis unless they say "after onset".

    Parameters
    ----------
    recording : Recording
        Where it was found; the raw curve stays as it is.
    contact : ContactForce
        The contact force over the whole recording.
    number : int
        1 for the first impact of the recording.
    onset : float
        Start of contact [s].
    end : float
        Time up to which the recording is about this impact: the next one, or the end of the recording [s].
    peak_force : float
        Phase I peak, corrected for noise [N].
    raw_peak_force : float
        Largest sample of Phase I [N].
    filtered_peak_force : float
        Phase I peak of the low-passed curve [N]; NaN if no channel frequency class was given.
    unseen_force : float
        How far the force may have risen above the largest sample between the samples of Phase I [N]: no
        impact is within a limit that this reaches.
    peak_time, phase1_end : float
        Time of the peak and end of Phase I [s].
    phase1_width : float
        Width of Phase I at half of its peak [s].
    phase1_samples, early_samples : int
        Samples across Phase I, and in the first 50 ms of contact.
    largest_force : float
        Largest force within 0.5 s after onset [N].
    later_force : float
        Largest force after Phase I within 0.5 s after onset [N]; NaN if there is none.
    phase2_force, phase2_mean_force : float
        Largest and mean force later than 0.5 s after onset [N]; NaN if the recording ends before.
    hold_force : float
        Mean force from 0.5 to 0.7 s after onset [N]; NaN if the recording does not reach 0.6 s.
    end_force : float
        Force at the end of the recording (of this impact): the larger of the means over 12.5 and over 4 ms [N].
    contact_duration : float
        From onset to the last force above the floor [s]; at least this, if the contact lasts to the end.
    contact_over : bool
        True if the force has fallen below the floor for good within the recording.
    acts_after_phase1 : bool
        True if the force is above the floor after Phase I.
    floor : float
        Force below which there is no contact, f0 and the drift to reckon with [N].
    hold_floor : float
        The same for the mean of many samples, which shows less noise [N].
    force_before : float
        Largest force before the onset, since the start or the impact before [N].
    gap : float
        Longest time without a sample while a force may act, from the onset to 0.7 s after it [s].
    impulse : float
        Integral of the contact force over the contact [N s].
    bounces : int
        How often contact was lost and found again.
    scenario : ContactScenario
        What follows Phase I.
    flags : tuple of Flag
        Doubts, each with its figure.
    """

    recording: Recording
    contact: ContactForce
    number: int
    onset: float
    end: float
    peak_force: float
    raw_peak_force: float
    filtered_peak_force: float
    unseen_force: float
    peak_time: float
    phase1_end: float
    phase1_width: float
    phase1_samples: int
    early_samples: int
    largest_force: float
    later_force: float
    phase2_force: float
    phase2_mean_force: float
    hold_force: float
    end_force: float
    contact_duration: float
    contact_over: bool
    acts_after_phase1: bool
    floor: float
    hold_floor: float
    force_before: float
    gap: float
    impulse: float
    bounces: int
    scenario: ContactScenario
    flags: tuple[Flag, ...]

    @property
    def verdict_peak_force(self) -> float:
        """The larger of the peak corrected for noise and the largest sample of Phase I [N]: what verdicts use."""
        filtered = -math.inf if math.isnan(self.filtered_peak_force) else self.filtered_peak_force
        return max(self.peak_force, self.raw_peak_force, filtered)

    @property
    def map_force(self) -> float:
        """What a map takes as the force of the impact [N]; a lower bound if it is saturated.

        A force after Phase I that exceeds it within the 0.5 s of the transient limit takes its place: a map of the
        lower one would permit too much.
        """
        peak = self.raw_peak_force if self.saturated else self.peak_force
        later = self.has(Quality.LATER_PEAK) or self.has(Quality.DOUBLE_HIT)
        return max(peak, self.later_force) if later else peak

    @property
    def saturated(self) -> bool:
        """True if the device range was reached: the peak is a lower bound."""
        return self.has(Quality.SATURATED)

    @property
    def resolved(self) -> bool:
        """True if there are samples enough to know the Phase I peak."""
        return not self.has(Quality.UNRESOLVED)

    @property
    def recorded_time(self) -> float:
        """How long after onset the recording goes on about this impact [s]."""
        return self.end - self.onset

    def has(self, quality: Quality) -> bool:
        """True if the flag is set."""
        return any(flag.name is quality for flag in self.flags)

    def curve(self) -> tuple[FloatArray, FloatArray]:
        """Time after onset [s] and contact force [N] from the onset to the end of the impact."""
        first, last = np.searchsorted(self.contact.time, [self.onset, self.end])
        stop = last + 1 if math.isclose(self.end, self.contact.time[-1]) else last
        return self.contact.time[first:stop] - self.onset, self.contact.force[first:stop]
