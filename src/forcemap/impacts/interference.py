"""What no contact does: a force that jumps between two samples, readings that stand still, a force that swings at rest.

Between robot and device lies a mass on a spring, so that a resolved contact force goes on as it came: from sample to
sample it changes about as much as before and after. A change that stands out is not the contact's: interference, or
samples that the logger lost and closed up. Nor does it stop on one reading and go on elsewhere, unless the logger does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Mask, columns
from forcemap.impacts.baseline import noise_sd
from forcemap.impacts.clipping import FROZEN_STEPS, QUANTISATION_SD, smallest_step
from forcemap.impacts.impact import TRANSIENT_TIME, Impact
from forcemap.impacts.phases import flanks
from forcemap.impacts.smooth import moving_mean

# Tuned on tests/test_damaged_recordings.py with the seeds named in docs/validity.md, "Damaged recordings", and on the
# shapes of tests/curves.py with seeds other than the tests'.

# A change between two samples stands out if it exceeds those beside it by more than each of these.
_JUMP_SHARE = 0.025  # of the largest force
_JUMP_SDS, _JUMP_STEPS = 5.0, 2.5  # [SD of the noise], [steps of the readings]
_BESIDE, _JUMP_RANGES = 4, 0.7  # so many changes on either side; times their range
_SPIKE_SAMPLES = 3  # within which a spike is taken back
_SPIKE_SHARE = 0.08  # of the largest force that a spike has at least
_TAKEN_BACK = 0.5  # share of a jump: the force is back if it is nearer to where it came from
_LOST = 1.5  # usual intervals: a change over a longer one says nothing about jumps
# Whether a jump hides a top: how the force goes on beside it is read over one part in ten of the half width of Phase I.
_PART, _LEAST_PART = 10, 3  # the second in samples
_HALF_SINE = _PART * 1.5 / math.pi  # a half-sine of amplitude A: A^2 = F^2 + (F' T / pi)^2, two thirds of T wide
# Shares of the largest force.
_GOES_ON = 0.03  # a force moves by as much if it falls before a jump or rises on after it: no top lies there
_FALLEN = 0.02  # ... or has fallen by as much from a top before it
_FAR_BELOW = 0.5  # what is lower hides no higher top
_NEAR_TOP, _NO_HIGHER = 0.90, 1.005  # the jump ends at the top: it lies so high, and the force points no higher
_HIGHER, _LARGE_CHANGE = 1.03, 0.12  # else a top is likely if both sides point so high, or the change is so large
_PAST_TOP = 1.25  # half widths after the largest force up to which the course is looked at
# A corner: in units of top / half width, the slope changes by so much more than beside it, neither side is flatter ...
_CORNER_TURN, _CORNER_SLOPE = 1.4, 0.3
_CORNER_SAMPLES = 3  # ... and a quarter of the half width has at least so many samples.
# A rise that does not slow down to its top (its last slope over the one before), on a force that hardly rings (share of
# the top by which it falls back on its flanks), is one; else so much of the turn must be seen from nearer, too.
_STRAIGHT_RISE, _HARDLY_RINGS, _TURN_NEARER = 0.9, 0.07, 0.8
_RINGS = 0.2  # share of the top: a force that rings by more shows no corner
_CORNER_SDS = 2.0  # [SD of the noise] that are allowed for in a change of slope
# Equal readings: at least so many, over so much of the half width of Phase I, and left by so much at once.
_STILL_SAMPLES, _STILL_TIME = 4, 0.2
_LEAP_SHARE, _LEAP_STEPS = 0.02, 5.0  # of the largest force, [steps of the readings]
_SWING_WIDTH = 0.125  # of the half width: over so much the force at rest is averaged to show a swing that moves a top
_CHANCE_SDS = 3.0  # [SD] that noise alone may do, to such means and on the flanks of a top
_CLIP_SDS = 4.0  # [SD of the noise]: what lies further off is not quiet, and counts as so much
_MAINS = (50.0, 60.0)  # frequencies of the mains [Hz]
_HARMONICS = (1, 3)  # of the mains that are fitted


@dataclass(frozen=True)
class Jump:
    """A change of force [N] that stands out, from sample `index` to the next.

    It is taken back after `samples`, 0 if it is not; `hides_top` if a higher force is likely to be missing there.
    """

    index: int
    force: float
    samples: int
    hides_top: bool


def find_jumps(impact: Impact) -> list[Jump]:
    """Changes of the contact force that stand out, from onset until the largest force is over: spikes and steps.

    Steps count where a top may be missing: the force does not rise on after them, nor did it fall before.
    """
    course = _course(impact)
    force, change = course.force, course.change
    highest, lowest = _beside(change, np.fmax), _beside(change, np.fmin)
    excess = np.nan_to_num(np.fmax(change - highest, lowest - change))
    noise = max(impact.contact.baseline_sd, noise_sd(force))
    least = max(_JUMP_SHARE * course.largest, _JUMP_SDS * noise, _JUMP_STEPS * course.step)
    jumps: list[Jump] = []
    for k in np.flatnonzero((excess > least) & (excess > _JUMP_RANGES * (highest - lowest))).tolist():
        if jumps and k <= jumps[-1].index - course.first + jumps[-1].samples:
            continue  # the way back
        back = np.abs(force[k + 2 : k + 2 + _SPIKE_SAMPLES] - force[k]) < _TAKEN_BACK * abs(change[k])
        if back.any():
            if excess[k] > _SPIKE_SHARE * course.largest:
                jumps.append(Jump(course.first + k, float(change[k]), int(back.argmax()) + 1, hides_top=False))
        elif course.may_hide(k, k + 1):
            hides_top = course.hides_top(k, k + 1, change[k])
            jumps.append(Jump(course.first + k, float(change[k]), 0, hides_top))
    return jumps


def find_corner(impact: Impact, hum: FloatArray) -> tuple[float, float] | None:
    """Slopes of the rise to a top and of the fall from it [N/s] if the force turns there from one sample to the next.

    Hum is taken off first. A round top turns as much between any two quarters of its half width; the top of a force
    that rings does so only if seen over long parts. Both the peak of Phase I and the largest force within 0.5 s are
    examined. None if neither is a corner.
    """
    course, corner = _course(impact), None
    force = course.force - hum
    noise = max(impact.contact.baseline_sd, QUANTISATION_SD * course.step)
    for peak in {int(force[: course.phase1.size].argmax()), int(force.argmax())}:
        top = float(force[peak])
        foot, end = flanks(force, peak, 0.5 * top)
        quarter = min(peak - foot, end - peak) // 2
        sides = force[foot + 1 : peak + 1], force[peak:end][::-1]
        rings = max(float((np.maximum.accumulate(side) - side).max()) for side in sides) - _CHANCE_SDS * noise
        if quarter < _CORNER_SAMPLES or top < _FAR_BELOW * course.largest or rings > _RINGS * top:
            continue
        third, width = max(quarter // 3, 1), 4 * quarter
        # The standard error of a slope through n samples is SD sqrt(12 / n^3).
        doubt, nearer_doubt = (_CORNER_SDS * noise * width * math.sqrt(12.0 / n**3) for n in (quarter, third))
        for turn in (peak, peak + 1):
            before, rise, fall, after = _slopes(force, turn, quarter, width)
            bend = rise - fall - max(before - rise, fall - after, 0.0) - doubt
            flat = min(rise, -fall) < _CORNER_SLOPE * top
            if bend < _CORNER_TURN * top or flat or np.isnan(course.change[turn - 1]):
                continue
            _, nearer_rise, nearer_fall, _ = _slopes(force, turn, third, width)
            as_sharp = third > 1 and nearer_rise - nearer_fall + nearer_doubt > _TURN_NEARER * (rise - fall)
            if as_sharp or (rings < _HARDLY_RINGS * top and rise > _STRAIGHT_RISE * before):
                corner = rise / (width * course.usual), fall / (width * course.usual)
    return corner


def _slopes(force: FloatArray, turn: int, samples: int, width: int) -> list[float]:
    """Rise over `width` of lines through four parts of `samples` each, two before the turn and two after it [N]."""
    return [_rise(force[max(turn + k * samples, 0) : turn + (k + 1) * samples], width) for k in (-2, -1, 0, 1)]


def lopsided(impact: Impact) -> float:
    """Time in which Phase I falls to half of its peak, over that in which it rose from there; 0 if unknown.

    The peak of a mass on a spring is about symmetric. Where it is lost, the foot of its rise is followed by its long
    tail.
    """
    force = _course(impact).phase1
    peak = int(force.argmax())
    foot, end = flanks(force, peak, 0.5 * float(force[peak]))
    return (end - peak) / (peak - foot) if foot >= 0 and end < force.size else 0.0


@dataclass(frozen=True)
class Standstill:
    """Readings that stand still in contact though the force moves: time of the first [s], how long [s], how many.

    `hides_top` if a higher force is likely to be missing there.
    """

    time: float
    duration: float
    samples: int
    hides_top: bool


def find_standstill(impact: Impact) -> Standstill | None:
    """The longest run of equal readings that the force jumps to or from; one that hides a top goes first.

    None if there is none. Readings in coarse steps repeat where the force hardly moves, and then leave by one step.
    """
    course = _course(impact)
    same = np.concatenate([[False], course.same, [False]])
    edges = np.flatnonzero(same[1:] != same[:-1]).reshape(-1, 2)  # first and last reading of each run
    long_enough = edges[:, 1] - edges[:, 0] + 1 >= _STILL_SAMPLES
    edges = edges[long_enough & (course.force[edges[:, 0]] > impact.contact.floor)]
    leap = np.pad(np.nan_to_num(np.abs(course.change)), 1)
    leaps = np.maximum(leap[edges[:, 0]], leap[edges[:, 1] + 1])
    duration = course.time[edges[:, 1]] - course.time[edges[:, 0]]
    noisy = impact.contact.baseline_sd > FROZEN_STEPS * course.step  # noise would change equal readings
    stuck = noisy | (leaps > max(_LEAP_SHARE * course.largest, _LEAP_STEPS * course.step))
    runs = []
    for k in np.flatnonzero(stuck & (duration > _STILL_TIME * impact.phase1_width)).tolist():
        start, last = edges[k].tolist()
        hides_top = course.hides_top(start, last, leaps[k])
        runs.append(Standstill(float(course.time[start]), float(duration[k]), last - start + 1, hides_top))
    return max(runs, key=lambda run: (run.hides_top, run.samples), default=None)


@dataclass(frozen=True)
class Swing:
    """A force that swings before contact: amplitude [N] and frequency [Hz].

    It may take `lowers` from the top or add `lifts` to it [N]. `hum` is its known continuation by sample, from shortly
    before the onset until the largest force is over [N].
    """

    amplitude: float
    frequency: float
    lowers: float
    lifts: float
    hum: FloatArray


def find_swing(impact: Impact) -> Swing:
    """How far the force swings before contact, slowly enough to move the top of Phase I; 0 N if noise may do it.

    Hum of the mains or a cell that shakes: what is left of the baseline once it is averaged over a part of the peak.
    Hum goes on as it came, so that its effect on the top is known; any other swing may have its full amplitude there.
    """
    contact, course = impact.contact, _course(impact)
    none = Swing(0.0, 0.0, 0.0, 0.0, np.zeros(course.force.size))
    if not contact.baseline_samples:
        return none
    first, last = contact.time.searchsorted([contact.baseline_start, contact.baseline_end])
    time, rest = contact.time[first : last + 1] - impact.onset, contact.force[first : last + 1]
    rest = np.clip(rest, -_CLIP_SDS * contact.baseline_sd, _CLIP_SDS * contact.baseline_sd)
    duration = float(time[-1] - time[0])
    samples = 2 * int(_SWING_WIDTH * impact.phase1_width / duration * rest.size / 2) + 1
    means = moving_mean(rest, samples)
    amplitude = math.sqrt(2.0) * float(means.std())  # of a sine
    if amplitude < _CHANCE_SDS * math.sqrt(2.0) * noise_sd(rest) / math.sqrt(samples):
        return none
    hums = [_hum(time, rest, course.time - impact.onset, frequency) for frequency in _MAINS]
    remainder, hum = min(hums, key=lambda fit: float(fit[0].std()))
    other = math.sqrt(2.0) * float(moving_mean(remainder, samples).std())
    lift = course.largest - float((course.force - hum).max())
    frequency = float(np.count_nonzero((means[1:] > 0) != (means[:-1] > 0))) / 2.0 / duration
    return Swing(amplitude, frequency, max(-lift, other), max(lift, other), hum)


def _hum(time: FloatArray, rest: FloatArray, later: FloatArray, frequency: float) -> tuple[FloatArray, FloatArray]:
    """Least-squares fit of hum of a frequency and its third harmonic, beside a line, to the force at rest.

    Returns the residual at rest, and the hum at the `later` times [N].
    """

    def harmonics(times: FloatArray) -> FloatArray:
        angles = 2.0 * math.pi * frequency * np.outer(times, _HARMONICS)
        return np.hstack([np.sin(angles), np.cos(angles)])

    line = np.column_stack([np.ones(time.size), time])
    design = np.hstack([harmonics(time), line])
    solution = np.linalg.lstsq(design, rest, rcond=None)[0]
    return rest - design @ solution, harmonics(later) @ solution[: 2 * len(_HARMONICS)]


@dataclass(frozen=True, eq=False)
class _Course:
    """An impact from shortly before its onset until its largest force is over, by sample (n,), changes (n - 1,).

    `same` is where a sample reads as the one before; the change over an interval without samples is NaN; how the force
    goes on is read over `width` samples; `usual` is the usual sampling interval [s], `step` that of the readings [N].
    """

    first: int
    time: FloatArray
    force: FloatArray
    phase1: FloatArray
    same: Mask
    change: FloatArray
    largest: float
    usual: float
    step: float
    width: int

    def moves(self, before: int, after: int) -> tuple[float, float]:
        """How far the force rises up to one sample, and falls from another on, over the width [N].

        Readings that stand still are left out.
        """
        start, stop = before, after
        while start > 0 and self.same[start - 1]:
            start -= 1
        while stop < self.same.size and self.same[stop]:
            stop += 1
        rises = _rise(self.force[max(start + 1 - max(self.width, before - start), 0) : start + 1], self.width)
        falls = -_rise(self.force[stop : stop + max(self.width, stop - after) + 1], self.width)
        return rises, falls

    def may_hide(self, before: int, after: int) -> bool:
        """True if a higher top may be missing between two samples.

        Not where the force falls before them or rises on after them, had a top before from which it falls over them,
        or is far below the largest.
        """
        higher, highest = max(self.force[before], self.force[after]), self.force[: before + 1].max()
        fallen = self.force[after] < higher < highest - _FALLEN * self.largest
        goes_on = min(self.moves(before, after)) < -_GOES_ON * self.largest
        return not (fallen or goes_on or higher < _FAR_BELOW * self.largest)

    def hides_top(self, before: int, after: int, change: float) -> bool:
        """True if a higher top is likely to be missing: the force changes by much [N], or points higher on both sides.

        It points as high as a half-sine of the width of Phase I would go. Not where it comes to a top on the higher
        side.
        """
        sides, moves = (float(self.force[before]), float(self.force[after])), self.moves(before, after)
        tops = [math.hypot(side, _HALF_SINE * move) for side, move in zip(sides, moves, strict=True)]
        at_top = max(sides) > _NEAR_TOP * self.largest and tops[sides[1] > sides[0]] < _NO_HIGHER * self.largest
        if at_top or not self.may_hide(before, after):
            return False
        return abs(change) > _LARGE_CHANGE * self.largest or min(tops) > _HIGHER * self.largest


def _course(impact: Impact) -> _Course:
    time, force = impact.contact.time, impact.contact.force
    onset, stop = time.searchsorted([impact.onset, min(impact.end, impact.onset + TRANSIENT_TIME)])
    largest = int(onset) + int(force[onset : stop + 1].argmax())
    foot, _ = flanks(force[: largest + 1], largest, 0.5 * float(force[largest]))
    wide = max(impact.phase1_width, float(time[largest] - time[max(foot, 0)]))
    over = max(float(time[largest]) + _PAST_TOP * wide, impact.phase1_end)
    first, last = max(int(onset) - 2 * _BESIDE, 0), int(time.searchsorted(over)) + 2 * _BESIDE
    span = slice(first, last)
    intervals, change = np.diff(time[span]), np.diff(force[span])
    usual = float(np.median(intervals))
    change[intervals > _LOST * usual] = np.nan
    recorded = columns(impact.recording.force[span])
    same, step = (recorded[1:] == recorded[:-1]).all(axis=1), max(map(smallest_step, recorded.T))
    width = max(int(impact.phase1_width / _PART / usual), _LEAST_PART)
    phase1 = force[first : max(int(time.searchsorted(impact.phase1_end, side="right")), first + 1)]
    return _Course(first, time[span], force[span], phase1, same, change, float(force[largest]), usual, step, width)


def _beside(change: FloatArray, extreme: np.ufunc) -> FloatArray:
    """The extreme of the changes on either side of every change; NaN where there are none."""
    padded = np.concatenate([np.full(_BESIDE, np.nan), change, np.full(_BESIDE, np.nan)])
    result = np.full(change.size, np.nan)
    for shift in range(2 * _BESIDE + 1):
        if shift != _BESIDE:
            result = extreme(result, padded[shift : shift + change.size])
    return result


def _rise(force: FloatArray, samples: int) -> float:
    """How far a line through the force rises over that many samples [N]; 0 if there are fewer than two."""
    if force.size < 2:
        return 0.0
    lever = np.arange(force.size) - (force.size - 1) / 2
    return float(lever @ force / (lever @ lever) * samples)
