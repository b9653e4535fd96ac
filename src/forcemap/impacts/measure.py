"""Everything that is measured of an impact once its rise is found."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.impacts.baseline import ContactForce
from forcemap.impacts.clipping import find_tops, not_cut_off, unseen_force
from forcemap.impacts.impact import TRANSIENT_TIME, Impact
from forcemap.impacts.interference import find_jumps, find_swing
from forcemap.impacts.phases import (
    GAP,
    HOLD_MIDDLE,
    HOLD_WINDOW,
    PhaseOne,
    classify_contact,
    end_level,
    first_peak,
    hold_force,
    onset_time,
)
from forcemap.impacts.quality import EARLY, flags_of
from forcemap.impacts.scenario import ContactScenario
from forcemap.impacts.smooth import mean_interval, moving_mean
from forcemap.recordings.recording import Recording

# Choices, checked by tests/test_impacts.py on curves with a known truth.
_SMOOTHING, _LEAST_SMOOTHING = 0.004, 3  # [s], and at least so many samples: of the force after Phase I
_LEAD, _LEAD_OF_RISE = 0.01, 0.5  # the onset is sought from so long before the rise [s], or this share of the rise
_BELOW_FLOOR = 0.5  # share of the floor: the rise begins after the last sample below it
_AT_END = 3  # samples: a force that acts in one of the last is not over
# A gap lasts longer than `GAP` and than three mean intervals; where no force acts beside it, 2.5 times as long (50 ms).
_GAP_INTERVALS, _GAP_AT_REST = 3.0, 2.5


@dataclass(frozen=True, eq=False)
class ImpactStart:
    """Onset and Phase I of an impact; indices into the whole recording.

    Parameters
    ----------
    contact : ContactForce
    smooth : array (n,)
        Its force, smoothed over 4 ms [N].
    smoothing : int
        Number of samples that are averaged for it.
    search : int
        First sample that may belong to it: an earlier impact is over before.
    first : int
        First sample of the rise.
    phase1 : PhaseOne
        Phase I, its indices counted from `first`.
    onset : float
        ImpactStart of contact [s].
    """

    contact: ContactForce
    smooth: FloatArray
    smoothing: int
    search: int
    first: int
    phase1: PhaseOne
    onset: float

    @property
    def phase1_end(self) -> int:
        """Index of the end of Phase I."""
        return self.first + self.phase1.end

    @property
    def last_before(self) -> int:
        """Index of the last sample that shows an earlier impact alone, even when smoothed."""
        return min(int(self.contact.time.searchsorted(self.onset)), self.first) - 1 - self.smoothing // 2


def impact_start(contact: ContactForce, search: int, rise: int) -> ImpactStart:
    """Onset and Phase I of the impact that rises at index `rise`; nothing before index `search` belongs to it."""
    time, force = contact.time, contact.force
    low = force[search : rise + 1] < _BELOW_FLOOR * contact.floor
    first = search + int(np.flatnonzero(low)[-1]) if low.any() else search
    stop = int(time.searchsorted(time[first] + TRANSIENT_TIME))
    phase1 = first_peak(time[first:stop], force[first:stop], contact.floor, contact.baseline_sd)
    onset = float(time[first])
    if phase1.peak > 0:
        earliest = time[first] - max(_LEAD, _LEAD_OF_RISE * (time[first + phase1.peak] - time[first]))
        lead = max(int(time.searchsorted(earliest)), search)
        onset = onset_time(time, force, lead, first, phase1.force, contact.baseline_sd)
    smoothing = max(_LEAST_SMOOTHING, 2 * int(_SMOOTHING / mean_interval(time) / 2) + 1)
    return ImpactStart(contact, moving_mean(force, smoothing), smoothing, search, first, phase1, onset)


def measure(recording: Recording, start: ImpactStart, last: int, number: int) -> Impact:
    """Everything measured of the impact, which the recording shows up to index `last`.

    Parameters
    ----------
    recording : Recording
    start : ImpactStart
        Its onset and Phase I.
    last : int
        Last sample before the next impact, or of the recording.
    number : int
        1 for the first impact of the recording.
    """
    contact, onset, phase1 = start.contact, start.onset, start.phase1
    first = int(contact.time.searchsorted(onset))
    span = slice(first, last + 1)
    time, force, smooth = contact.time[span], contact.force[span], start.smooth[span]
    after = time - onset
    floor = contact.floor_at(time)
    phase1_end = float(contact.time[start.phase1_end])
    phase1_last = start.phase1_end - first
    above = smooth > floor
    acting = np.flatnonzero(above & (force > floor))
    duration = float(after[acting[-1]]) if acting.size else phase1_end - onset
    following = above[phase1_last + 1 + start.smoothing // 2 :]  # clear of Phase I
    transient = int(after.searchsorted(TRANSIENT_TIME, side="right"))
    later, phase2 = force[phase1_last + 1 : transient], force[transient:]
    in_contact = int(after.searchsorted(duration, side="right"))
    before = contact.force[start.search : first]
    hold = np.asarray(onset + HOLD_MIDDLE)
    impact = Impact(
        recording=recording,
        contact=contact,
        number=number,
        onset=onset,
        end=float(contact.time[last]),
        peak_force=phase1.force,
        raw_peak_force=phase1.raw_force,
        filtered_peak_force=math.nan,
        unseen_force=0.0,
        peak_time=float(contact.time[start.first + phase1.peak]),
        phase1_end=phase1_end,
        phase1_width=phase1.width,
        phase1_samples=phase1_last + 1,
        early_samples=int(after.searchsorted(EARLY)),
        largest_force=max(float(force[:transient].max()), phase1.force),
        later_force=float(later.max()) if later.size else math.nan,
        phase2_force=float(phase2.max()) if phase2.size else math.nan,
        phase2_mean_force=float(phase2.mean()) if phase2.size else math.nan,
        hold_force=hold_force(after, force),
        end_force=end_level(time, force),
        contact_duration=duration,
        contact_over=not (acting.size and acting[-1] >= force.size - _AT_END),
        acts_after_phase1=bool(following.any()),
        floor=float(contact.floor_at(hold)),
        hold_floor=float(contact.mean_floor_at(hold)),
        force_before=float(before.max()) if before.size else 0.0,
        gap=_longest_gap(after, above),
        impulse=float(np.trapezoid(force[:in_contact], time[:in_contact])),
        bounces=int(np.sum(~following[:-1] & following[1:])),
        scenario=ContactScenario.UNDETERMINED,
        flags=(),
    )
    tops = not_cut_off(impact, find_tops(impact))
    steps, swing = [jump for jump in find_jumps(impact) if not jump.samples], find_swing(impact)
    flags = flags_of(impact, tops, before, smooth + contact.drift_allowance(time), steps, swing)
    unseen = max(unseen_force(impact, tops), swing.amplitude)
    return replace(impact, scenario=classify_contact(impact), flags=flags, unseen_force=unseen)


def _longest_gap(after: FloatArray, above: Mask) -> float:
    """Longest gap that begins within 0.7 s after onset [s]: over 20 ms if a force acts beside it, else over 50 ms."""
    intervals, acting = np.diff(after), above[1:] | above[:-1]
    least = np.where(acting, 1.0, _GAP_AT_REST) * max(GAP, _GAP_INTERVALS * mean_interval(after))
    return float(intervals[(after[:-1] < HOLD_WINDOW[1]) & (intervals > least)].max(initial=0.0))
