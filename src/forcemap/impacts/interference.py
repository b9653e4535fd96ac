"""What no contact does: a force that jumps between two samples, readings that stand still, a force that swings at rest.

Between robot and device lies a mass on a spring, so that a resolved contact force goes on as it came: from sample to
sample it changes about as much as before and after. A change that stands out is not the contact's: interference, or
samples that the logger lost and closed up. Nor does it stop on one reading and go on elsewhere, unless the logger does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.impacts.baseline import noise_sd
from forcemap.impacts.clipping import FROZEN, QUANTUM, smallest_step
from forcemap.impacts.impact import TRANSIENT_TIME, Impact
from forcemap.impacts.phases import flanks
from forcemap.impacts.smooth import moving_mean

# Tried on tests/test_damaged_recordings.py and the shapes of tests/curves.py with other seeds than theirs.
_JUMP = 0.025  # share of the largest force by which a change stands out
_NOISE, _STEPS = 5.0, 2.5  # [SD of the noise], [steps of the readings]: and more than these may do
_BESIDE, _STANDS_OUT = 4, 0.7  # changes before and after it; more than so many times their range
_SPIKE, _SPIKE_HEIGHT = 3, 0.08  # samples within which a spike is taken back; share of the largest force
_PART = 10  # of the half width of Phase I: how far beside a jump it is read how the force goes on
_HALF_SINE = _PART * 1.5 / math.pi  # a half-sine of amplitude A: A^2 = F^2 + (F' T / pi)^2, two thirds of T wide
# Shares of the largest force: what a force moves by that goes on beside a jump, or has fallen from its top; what lies
_GOES_ON, _FALLEN, _FAR_BELOW = 0.03, 0.02, 0.5  # too far below it to hide a higher top.
_AT_TOP, _NO_HIGHER, _HIGHER, _MUCH = 0.90, 1.005, 1.03, 0.12  # a top, that points no higher; points higher; changes
# A corner: a change of slope by so many times top / half width more than beside it; neither side flatter than so many;
_CORNER, _STEEP, _QUARTER = 1.4, 0.3, 3  # a quarter of the half width has so many samples.
# A rise less steep to its end than so many times before, or a force that falls back on its flanks by over the first of
# these shares of the top (by the second it rings too much): then so much of the turn is seen from nearer, too.
_STRAIGHT, _RINGS, _SEEN = 0.9, (0.07, 0.2), 0.8
# Equal readings; [share of the largest], [steps] by which a stuck logger leaves them; of the half width of Phase I
_STILL, _LEFT, _AWAY, _LONG = 4, 0.02, 5.0, 0.2
_SWING, _CHANCE = 0.125, 3.0  # of the half width, the means that show a swing; [SD] that noise alone may do to them
_MAINS = (50.0, 60.0)  # [Hz]


@dataclass(frozen=True)
class Jump:
    """A change of force [N] that stands out, from sample `index` to the next.

    It is taken back after `samples`, 0 if it is not; `hides_top` if a higher force is likely to be missing there.
    """

    index: int
    force: float
    samples: int
    hides_top: bool


def jumps(impact: Impact) -> list[Jump]:
    """Changes of the contact force that stand out, from onset until the largest force is over: spikes, and steps.

    Steps count where a top may be missing: the force does not rise on after them, nor did it fall before.
    """
    near = _near(impact)
    highest, lowest = _beside(near.change, np.fmax), _beside(near.change, np.fmin)
    excess = np.nan_to_num(np.fmax(near.change - highest, lowest - near.change))
    least = max(
        _JUMP * near.largest, _NOISE * max(impact.contact.baseline_sd, noise_sd(near.force)), _STEPS * near.step
    )
    found: list[Jump] = []
    for k in np.flatnonzero((excess > least) & (excess > _STANDS_OUT * (highest - lowest))).tolist():
        if found and k <= found[-1].index - near.first + found[-1].samples:
            continue  # the way back
        back = np.abs(near.force[k + 2 : k + 2 + _SPIKE] - near.force[k]) < 0.5 * abs(near.change[k])
        if back.any():
            if excess[k] > _SPIKE_HEIGHT * near.largest:
                found.append(Jump(near.first + k, float(near.change[k]), int(back.argmax()) + 1, hides_top=False))
        elif near.may_hide(k, k + 1):
            found.append(Jump(near.first + k, float(near.change[k]), 0, near.hides_top(k, k + 1, near.change[k])))
    return found


def corner(impact: Impact, hum: FloatArray) -> tuple[float, float] | None:
    """How steeply the force rises up to its top and falls from it [N/s] if it turns there from one sample to the next.

    Hum is taken off before. A round top turns as much between any two quarters of its half width, that of a force that
    rings only seen from afar. Looked at are the peak of Phase I and the largest force within 0.5 s. None if neither is
    a corner.
    """
    near, found = _near(impact), None
    force = near.force - hum
    noise = max(impact.contact.baseline_sd, QUANTUM * near.step)
    for peak in {int(force[: near.phase1.size].argmax()), int(force.argmax())}:
        top = float(force[peak])
        foot, end = flanks(force, peak, 0.5 * top)
        quarter = min(peak - foot, end - peak) // 2
        sides = force[foot + 1 : peak + 1], force[peak:end][::-1]
        rings = max(float((np.maximum.accumulate(side) - side).max()) for side in sides) - _CHANCE * noise
        if quarter < _QUARTER or top < _FAR_BELOW * near.largest or rings > _RINGS[1] * top:
            continue
        third, width = max(quarter // 3, 1), 4 * quarter
        doubt, nearer_doubt = (2.0 * noise * width * math.sqrt(12.0 / n**3) for n in (quarter, third))
        for turn in (peak, peak + 1):
            before, rise, fall, after = _slopes(force, turn, quarter, width)
            bend = rise - fall - max(before - rise, fall - after, 0.0) - doubt
            if bend < _CORNER * top or min(rise, -fall) < _STEEP * top or np.isnan(near.change[turn - 1]):
                continue
            _, closer, further, _ = _slopes(force, turn, third, width)
            as_sharp = third > 1 and closer - further + nearer_doubt > _SEEN * (rise - fall)
            if as_sharp or (rings < _RINGS[0] * top and rise > _STRAIGHT * before):
                found = rise / (width * near.usual), fall / (width * near.usual)
    return found


def _slopes(force: FloatArray, turn: int, samples: int, width: int) -> list[float]:
    """How far lines through four parts of so many samples, two before the turn, rise over the width [N]."""
    return [_rise(force[max(turn + k * samples, 0) : turn + (k + 1) * samples], width) for k in (-2, -1, 0, 1)]


def lopsided(impact: Impact) -> float:
    """How many times as long Phase I takes to fall to half of its peak as it took to rise from there; 0 if unknown.

    A resolved peak of a mass on a spring is not: where it is lost, the foot of its rise is followed by its long tail.
    """
    force = _near(impact).phase1
    peak = int(force.argmax())
    foot, end = flanks(force, peak, 0.5 * float(force[peak]))
    return (end - peak) / (peak - foot) if foot >= 0 and end < force.size else 0.0


@dataclass(frozen=True)
class Still:
    """Readings that stand still in contact though the force moves: time of the first [s], how long [s], how many.

    `hides_top` if a higher force is likely to be missing there.
    """

    time: float
    duration: float
    samples: int
    hides_top: bool


def still(impact: Impact) -> Still | None:
    """The longest run of equal readings that the force jumps to or from, of those that hide a top if any; else None.

    Readings in coarse steps repeat where the force hardly moves, and then leave by one step.
    """
    near = _near(impact)
    same = np.concatenate([[False], near.same, [False]])
    edges = np.flatnonzero(same[1:] != same[:-1]).reshape(-1, 2)  # first and last reading of each run
    edges = edges[(edges[:, 1] - edges[:, 0] + 1 >= _STILL) & (near.force[edges[:, 0]] > impact.contact.floor)]
    leap = np.pad(np.nan_to_num(np.abs(near.change)), 1)
    leaves = np.maximum(leap[edges[:, 0]], leap[edges[:, 1] + 1])
    duration = near.time[edges[:, 1]] - near.time[edges[:, 0]]
    noisy = impact.contact.baseline_sd > FROZEN * near.step  # would change what the force does not
    stuck = (noisy | (leaves > max(_LEFT * near.largest, _AWAY * near.step))) & (duration > _LONG * impact.phase1_width)
    runs = []
    for k in np.flatnonzero(stuck).tolist():
        start, last = edges[k].tolist()
        hides = near.hides_top(start, last, leaves[k])
        runs.append(Still(float(near.time[start]), float(duration[k]), last - start + 1, hides))
    return max(runs, key=lambda run: (run.hides_top, run.samples), default=None)


@dataclass(frozen=True)
class Swing:
    """A force that swings before contact: amplitude [N], and how often a second [Hz].

    `lowers` and `lifts` is what it may take from the top or add to it [N]; `hum` how it goes on, as far as that is
    known, by sample from shortly before the onset until the largest force is over [N].
    """

    amplitude: float
    frequency: float
    lowers: float
    lifts: float
    hum: FloatArray


def swing(impact: Impact) -> Swing:
    """How far the force swings before contact, slowly enough to move the top of Phase I; 0 N if noise may do it.

    Hum of the mains, a cell that shakes: what is left of the baseline once it is averaged over a part of the peak. Hum
    goes on as it came, so that its part of the top is known; what else swings may do to it what it can.
    """
    contact, near = impact.contact, _near(impact)
    none = Swing(0.0, 0.0, 0.0, 0.0, np.zeros(near.force.size))
    if not contact.baseline_samples:
        return none
    first, last = contact.time.searchsorted([contact.baseline_start, contact.baseline_end])
    time, rest = contact.time[first : last + 1] - impact.onset, contact.force[first : last + 1]
    rest = np.clip(rest, -4.0 * contact.baseline_sd, 4.0 * contact.baseline_sd)
    duration = float(time[-1] - time[0])
    samples = 2 * int(_SWING * impact.phase1_width / duration * rest.size / 2) + 1
    means = moving_mean(rest, samples)
    amplitude = math.sqrt(2.0) * float(means.std())
    if amplitude < _CHANCE * math.sqrt(2.0) * noise_sd(rest) / math.sqrt(samples):
        return none
    hums = [_hum(time, rest, near.time - impact.onset, frequency) for frequency in _MAINS]
    left, hum = min(hums, key=lambda hum: float(hum[0].std()))
    other = math.sqrt(2.0) * float(moving_mean(left, samples).std())
    lift = near.largest - float((near.force - hum).max())
    frequency = float(np.count_nonzero((means[1:] > 0) != (means[:-1] > 0))) / 2.0 / duration
    return Swing(amplitude, frequency, max(-lift, other), max(lift, other), hum)


def _hum(time: FloatArray, rest: FloatArray, later: FloatArray, frequency: float) -> tuple[FloatArray, FloatArray]:
    """What hum of a frequency and its third harmonic leave of the force at rest, and its course later on [N].

    By least squares, beside a line.
    """

    def courses(at: FloatArray) -> FloatArray:
        turns = 2.0 * math.pi * frequency * np.outer(at, (1, 3))
        return np.hstack([np.sin(turns), np.cos(turns)])

    line = np.column_stack([np.ones(time.size), time])
    design = np.hstack([courses(time), line])
    solution = np.linalg.lstsq(design, rest, rcond=None)[0]
    return rest - design @ solution, courses(later) @ solution[:4]


@dataclass(frozen=True, eq=False)
class _Near:
    """An impact from shortly before its onset until its largest force is over, by sample (n,), changes (n - 1,).

    `same` is where a sample reads as the one before; the change over an interval without samples is NaN; `width`
    samples tell how the force goes on.
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
        """How far the force rises up to a sample, and falls from another on, over the width [N].

        Readings that stand still tell nothing: they are left out.
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
        """True if one is likely to be missing: a force that changes by so much beside them [N], or points higher.

        It points as far as a half-sine of the width of Phase I goes on. Not where it comes to a top on the higher side.
        """
        sides, moves = (float(self.force[before]), float(self.force[after])), self.moves(before, after)
        points = [math.hypot(side, _HALF_SINE * move) for side, move in zip(sides, moves, strict=True)]
        at_top = max(sides) > _AT_TOP * self.largest and points[sides[1] > sides[0]] < _NO_HIGHER * self.largest
        if at_top or not self.may_hide(before, after):
            return False
        return abs(change) > _MUCH * self.largest or min(points) > _HIGHER * self.largest


def _near(impact: Impact) -> _Near:
    time, force = impact.contact.time, impact.contact.force
    onset, stop = time.searchsorted([impact.onset, min(impact.end, impact.onset + TRANSIENT_TIME)])
    largest = int(onset) + int(force[onset : stop + 1].argmax())
    foot, _ = flanks(force[: largest + 1], largest, 0.5 * float(force[largest]))
    wide = max(impact.phase1_width, float(time[largest] - time[max(foot, 0)]))
    over = max(float(time[largest]) + 1.25 * wide, impact.phase1_end)
    first, last = max(int(onset) - 2 * _BESIDE, 0), int(time.searchsorted(over)) + 2 * _BESIDE
    span = slice(first, last)
    intervals, change = np.diff(time[span]), np.diff(force[span])
    usual = float(np.median(intervals))
    change[intervals > 1.5 * usual] = np.nan
    recorded = impact.recording.force[span].reshape(change.size + 1, -1)
    same, step = (recorded[1:] == recorded[:-1]).all(axis=1), max(map(smallest_step, recorded.T))
    width = max(int(impact.phase1_width / _PART / usual), 3)
    phase1 = force[first : max(int(time.searchsorted(impact.phase1_end, side="right")), first + 1)]
    return _Near(first, time[span], force[span], phase1, same, change, float(force[largest]), usual, step, width)


def _beside(change: FloatArray, extreme: np.ufunc) -> FloatArray:
    """The extreme of the changes beside each one; NaN where there are none."""
    padded = np.concatenate([np.full(_BESIDE, np.nan), change, np.full(_BESIDE, np.nan)])
    result = np.full(change.size, np.nan)
    for shift in range(2 * _BESIDE + 1):
        if shift != _BESIDE:
            result = extreme(result, padded[shift : shift + change.size])
    return result


def _rise(force: FloatArray, samples: int) -> float:
    """How far a line through the force rises over so many samples [N]; 0 through fewer than two."""
    if force.size < 2:
        return 0.0
    lever = np.arange(force.size) - (force.size - 1) / 2
    return float(lever @ force / (lever @ lever) * samples)
