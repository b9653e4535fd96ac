"""Everything that is measured of an impact once its rise is found."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.impacts.baseline import ContactForce
from forcemap.impacts.clipping import tops, unseen_force
from forcemap.impacts.impact import TRANSIENT_TIME, Impact
from forcemap.impacts.interference import jumps, swing
from forcemap.impacts.phases import GAP, PhaseOne, classify_contact, end_level, first_peak, hold_force, onset_time
from forcemap.impacts.quality import EARLY, flags_of
from forcemap.impacts.scenario import ContactScenario
from forcemap.impacts.smooth import mean_interval, moving_mean
from forcemap.recordings.recording import Recording

_SMOOTHING = 0.004  # of the force after Phase I [s]
_LEAD = 0.01  # the foot of the rise is looked for from so long before it, or half the rise [s]
_HOLD_END = 0.7  # the scenario is read up to here [s]
_FLOOR_AT = 0.6  # the floor that is reported is that at the middle of the hold window [s]


@dataclass(frozen=True, eq=False)
class Start:
    """Onset and Phase I of an impact; indices into the whole recording.

    Parameters
    ----------
    contact : ContactForce
    smooth : array (n,)
        Its force, smoothed over 4 ms [N].
    smoothing : int
        Samples it is smoothed over.
    search : int
        First sample that may belong to it: an earlier impact is over before.
    first : int
        First sample of the rise.
    one : PhaseOne
        Phase I, its indices counted from `first`.
    onset : float
        Start of contact [s].
    """

    contact: ContactForce
    smooth: FloatArray
    smoothing: int
    search: int
    first: int
    one: PhaseOne
    onset: float

    @property
    def phase1_end(self) -> int:
        """Index of the end of Phase I."""
        return self.first + self.one.end

    @property
    def before(self) -> int:
        """Index of the last sample that tells of an earlier impact alone, smoothed too."""
        return min(int(self.contact.time.searchsorted(self.onset)), self.first) - 1 - self.smoothing // 2


def found_start(contact: ContactForce, search: int, rise: int) -> Start:
    """Onset and Phase I of the impact that rises at index `rise`; nothing before index `search` belongs to it."""
    time, force = contact.time, contact.force
    low = force[search : rise + 1] < 0.5 * contact.floor
    first = search + int(np.flatnonzero(low)[-1]) if low.any() else search
    stop = int(time.searchsorted(time[first] + TRANSIENT_TIME))
    one = first_peak(time[first:stop], force[first:stop], contact.floor, contact.baseline_sd)
    earliest = time[first] - max(_LEAD, 0.5 * (time[first + one.peak] - time[first]))
    lead = max(int(time.searchsorted(earliest)), search)
    onset = onset_time(time, force, lead, first, one.force, contact.baseline_sd) if one.peak > 0 else float(time[first])
    smoothing = max(3, 2 * int(_SMOOTHING / mean_interval(time) / 2) + 1)
    return Start(contact, moving_mean(force, smoothing), smoothing, search, first, one, onset)


def measure(recording: Recording, start: Start, last: int, number: int) -> Impact:
    """The impact, which the recording is about up to index `last`.

    Parameters
    ----------
    recording : Recording
    start : Start
        Its onset and Phase I.
    last : int
        Last sample before the next impact, or of the recording.
    number : int
        1 for the first impact of the recording.
    """
    contact, onset, one = start.contact, start.onset, start.one
    first = int(contact.time.searchsorted(onset))
    span = slice(first, last + 1)
    time, force, smooth = contact.time[span], contact.force[span], start.smooth[span]
    after = time - onset
    floor = contact.floor_at(time)
    phase1_end = float(contact.time[start.phase1_end])
    phase1 = start.phase1_end - first
    above = smooth > floor
    acting = np.flatnonzero(above & (force > floor))
    duration = float(after[acting[-1]]) if acting.size else phase1_end - onset
    following = above[phase1 + 1 + start.smoothing // 2 :]  # clear of Phase I
    transient = int(after.searchsorted(TRANSIENT_TIME, side="right"))
    later, held = force[phase1 + 1 : transient], force[transient:]
    in_contact = int(after.searchsorted(duration, side="right"))
    before = contact.force[start.search : first]
    hold = np.asarray(onset + _FLOOR_AT)
    impact = Impact(
        recording=recording,
        contact=contact,
        number=number,
        onset=onset,
        end=float(contact.time[last]),
        peak_force=one.force,
        raw_peak_force=one.raw_force,
        filtered_peak_force=math.nan,
        unseen_force=0.0,
        peak_time=float(contact.time[start.first + one.peak]),
        phase1_end=phase1_end,
        phase1_width=one.width,
        phase1_samples=phase1 + 1,
        early_samples=int(after.searchsorted(EARLY)),
        largest_force=max(float(force[:transient].max()), one.force),
        later_force=float(later.max()) if later.size else math.nan,
        phase2_force=float(held.max()) if held.size else math.nan,
        phase2_mean_force=float(held.mean()) if held.size else math.nan,
        hold_force=hold_force(after, force),
        end_force=end_level(time, force),
        contact_duration=duration,
        contact_over=not (acting.size and acting[-1] >= force.size - 3),
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
    found = tops(impact)
    steps, swings = [jump for jump in jumps(impact) if not jump.samples], swing(impact)
    flags = flags_of(impact, found, before, smooth + contact.drift_allowance(time), steps, swings)
    unseen = max(unseen_force(impact, found), swings.amplitude)
    return replace(impact, scenario=classify_contact(impact), flags=flags, unseen_force=unseen)


def _longest_gap(after: FloatArray, above: Mask) -> float:
    """Longest time without a sample up to 0.7 s after onset [s]: where a force acts beside it, else if over 50 ms."""
    steps, acting = np.diff(after), above[1:] | above[:-1]
    least = np.where(acting, 1.0, 2.5) * max(GAP, 3.0 * mean_interval(after))
    return float(steps[(after[:-1] < _HOLD_END) & (steps > least)].max(initial=0.0))
