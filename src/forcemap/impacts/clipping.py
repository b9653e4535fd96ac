"""Whether the largest reading of a curve is its peak: what the flanks say of the force above the largest reading.

Near its top a smooth curve is a parabola, and stays above a depth x below its top for a time that grows as sqrt(x). If
the largest reading lies a force h below the top (cut off by an amplifier, or between two samples), the times T spent
within b and within d > b of the largest reading give it away:

    (T_b / T_d)^2 = (b + h) / (d + h),    so    h = (d r - b) / (1 - r)  with  r = (T_b / T_d)^2.

T_b is known to one sampling interval more or less, and so h has a least and a likely value. All stays at the largest
reading count together, so that a curve that rings and touches a ceiling many times shows it as one that stays there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.impacts.impact import Impact
from forcemap.impacts.phases import flanks
from forcemap.impacts.smooth import moving_mean

# Tried on tests/test_clipped_curves.py and tests/curves.py with other seeds than theirs, and on the real recordings.
_NEAR = 0.10  # share of the largest reading that counts as near the top: a parabola there, and clear of noise
_SLIGHT = 0.03  # ... where the curve rings by no more than that
_CLEAR = 4.0  # ... and at least so many times the depth of the band at the top
_DEEPEST = 0.45  # ... but no more than this, however noisy: twice as deep there must still be a rise
_BAND, _DEPTH, _LIFT = 5.0, 3.0, 2.0  # [SD] of the noise: width of the band at the top; below, above the curve
QUANTUM = 0.3  # noise of a reading in steps of the readings (1 / sqrt(12))
_LEFT = (1.0, 0.65, 0.4)  # shares of the noise that may be left at the top: a ceiling takes away what comes before it
_FEW = 2.0  # standard deviations by which a few samples before contact may understate the noise
_AVERAGED = 24  # noise may be averaged over this part of the time near the top, without flattening it
_QUIET = 36.0  # [SD] of the averaged noise in the depth "near"; with less, noise blurs the times
_HELD = 0.15  # a longer stay at the top is a force that is held: no peak of an impact is as flat for as long [s]
_KEPT = 1.2  # a rise that is cut takes so much longer for its last part than for the one before; a round one 1.6 times
FROZEN = 2.0  # [steps]; with more noise than this a force that is held does not repeat its largest reading
_REPEATS = 8  # ... so many times, and for over half of the stay
_TAKEN_OFF = 1.5  # [SD] of the noise, which may feign as much
_MOST = 0.99  # of r, where the flanks are steps and h has no end
_SHARE = 0.3  # of the peak; a component that shows less of it tells nothing of the peak
_BEFORE, _ZERO = 4, 200  # samples before the onset that belong to the rise, and from which its zero is read
_TWICE = 2.0  # what the flanks imply may be half of what was missed
_TELLING = 0.01  # share of the peak; the peak is not promised to be nearer
_COARSE, _DENSE = 0.55, 14  # between n samples straight flanks hide half a step, 0.5 / n of the peak: more of a reading
_ROUGH, _CHANCE = 0.2, 3.5  # share of the peak that counts as its top; [SD] that noise alone may do there


@dataclass(frozen=True)
class Top:
    """The top of a curve.

    Parameters
    ----------
    reading, recorded : float
        Largest reading [N]: above what was read before contact, and as it was recorded.
    samples : int
        Readings at the top that differ by no more than the noise.
    least, likely : float
        Force above the largest reading that the flanks imply, less the noise [N]: if the stay at the top is a sampling
        interval shorter than it has samples, and if it is as long.
    """

    reading: float
    recorded: float
    samples: int
    least: float
    likely: float


@dataclass(frozen=True)
class _Band:
    """What counts as at the top [N]: readings within `width` of the largest, which noise lifts by `lift`.

    A curve without noise would be within `depth` of its top there. `exact` if equal readings are no work of chance.
    """

    width: float
    depth: float
    lift: float
    noise: float
    exact: bool = False

    def near(self, top: float, share: float) -> float:
        """How far below the top is near it [N]."""
        return min(max(share * top, _CLEAR * self.depth), _DEEPEST * top)


@dataclass(frozen=True)
class _Stay:
    """A stay near the top: samples within the band at the top, the first and last of them, and times [s]."""

    samples: int
    first: int
    last: int
    between: float
    rise: float
    fall: float
    interval: float

    @property
    def ends(self) -> bool:
        """True if the curve comes from below and falls again."""
        return math.isfinite(self.rise + self.fall)

    @property
    def near(self) -> float:
        """Time near the top, each flank as steep as their geometric mean: a long tail tells little of the top [s]."""
        return self.between + 2.0 * math.sqrt(self.rise * self.fall)


def hidden_force(ratio: float, shallow: float, deep: float) -> float:
    """Height h of a parabola above the largest reading [N].

    Parameters
    ----------
    ratio : float
        (shallow + h) / (deep + h), the square of the ratio of the times.
    shallow, deep : float
        The two depths below the largest reading [N].
    """
    r = min(ratio, _MOST)
    return max((deep * r - shallow) / (1.0 - r), 0.0)


def tops(impact: Impact) -> list[Top]:
    """The top of Phase I of an impact, and those of each component that the device recorded and that tells of it."""
    recording, contact = impact.recording, impact.contact
    onset, peak_end, end = recording.time.searchsorted([impact.onset, impact.phase1_end, impact.end])
    start = max(int(onset) - _BEFORE, 0)
    time, phase1 = recording.time[start : end + 1], int(peak_end) + 1 - start
    noise = contact.baseline_sd * (1.0 + _FEW / math.sqrt(max(contact.baseline_samples, 1)))
    alone = _top(time[:phase1], contact.force[start : peak_end + 1], noise, 0.0, -1)
    found = [replace(alone, least=0.0)]  # whether it was cut off shows in what was recorded
    for component in recording.force.reshape(recording.samples, -1).T:
        away = component[start : end + 1] - np.median(component[max(start - _ZERO, 0) : max(int(onset) - 1, 1)])
        away = away if away.max() >= -away.min() else -away
        if away.max() >= _SHARE * impact.raw_peak_force:
            top = _top(time, away, noise, smallest_step(component), phase1)
            found.append(replace(top, recorded=abs(float(component[start + int(away.argmax())]))))
    return found


def unseen_force(impact: Impact, found: list[Top]) -> float:
    """How far the force may have risen above the largest sample of Phase I, between samples [N].

    Twice as far as the flanks of its tops imply, or as a sample near the top lies off what two neighbours on either
    side say of it (a cubic through them), less what noise does: a rough curve is as rough between its samples. With few
    samples across the half width, no less than a peak with straight flanks hides between them.
    """
    onset, peak_end = impact.contact.time.searchsorted([impact.onset, impact.phase1_end])
    force = impact.contact.force[max(int(onset) - 2, 0) : int(peak_end) + 3]
    off = force[2:-2] - (4.0 * (force[1:-3] + force[3:-1]) - force[:-4] - force[4:]) / 6.0
    at_top = force[2:-2] >= (1.0 - _ROUGH) * force.max()
    rough = float(np.abs(off[at_top]).max(initial=0.0)) - _CHANCE * impact.contact.baseline_sd
    missed = max(rough, *(_TWICE * top.likely for top in found))
    across = max(samples_across(impact), 1)
    coarse = _COARSE / across * impact.raw_peak_force if across < _DENSE else 0.0
    return max(missed if missed > _TELLING * impact.raw_peak_force else 0.0, coarse)


def samples_across(impact: Impact) -> int:
    """Samples across the half width of the peak, with its steeper flank on both sides."""
    first, last = impact.contact.time.searchsorted([impact.onset, impact.phase1_end])
    force = impact.contact.force[max(int(first) - 1, 0) : int(last) + 1]
    peak = int(force.argmax())
    left, right = flanks(force, peak, 0.5 * impact.raw_peak_force)
    return 2 * min((abs(at - peak) for at in (left, right) if 0 <= at < force.size), default=1) - 1


def smallest_step(readings: FloatArray) -> float:
    """Smallest step of the readings [N]."""
    steps = np.diff(np.unique(readings))
    steps = steps[steps > 1e-9 * np.abs(readings).max()]
    return float(steps.min()) if steps.size else 0.0


def _top(time: FloatArray, force: FloatArray, noise: float, step: float, last: int) -> Top:
    """The top of a curve [s], [N] with such noise and steps of its readings [N]; Phase I ends at sample `last`."""
    curves = [(force, _Band(0.5 * step, step, 0.0, 0.0, exact=noise >= FROZEN * step))]
    for share in _LEFT:
        averaged = _averaged(time, force, max(share * noise, QUANTUM * step))
        left = max(share * noise / math.sqrt(averaged), QUANTUM * step)
        band = _Band(_BAND * left, _DEPTH * left, _LIFT * left, share * noise)
        curves.append((moving_mean(force, averaged), band))
    wide = [top for curve, band in curves for top in _at_top(time, curve, band, _NEAR, last)]
    slight = [top for curve, band in curves[:2] for top in _at_top(time, curve, band, _SLIGHT, last)]
    reading = float(force.max())
    surest = max([*wide, *slight], key=lambda top: top.least, default=Top(reading, reading, 0, 0.0, 0.0))
    likely = max((top.likely for top in wide), default=0.0)
    return Top(reading, reading, surest.samples, surest.least, likely)


def _averaged(time: FloatArray, force: FloatArray, scatter: float) -> int:
    """Odd number of samples whose mean shows the top clear of noise, and does not flatten it."""
    top = float(force.max())
    band = _Band(_BAND * scatter, _DEPTH * scatter, _LIFT * scatter, scatter)
    stays = _stays(time, force, top - band.width, top - band.near(top, _NEAR) - band.lift)
    longest = max((stay.near if stay.ends else stay.rise) / stay.interval for stay in stays)
    return 2 * int(min((_QUIET * scatter / (_NEAR * top)) ** 2, min(longest, time.size) / _AVERAGED) / 2) + 1


def _at_top(time: FloatArray, force: FloatArray, band: _Band, share: float, last: int) -> Iterator[Top]:
    """What each stay at the top tells, and all together; a force that is held tells it by its rise, or stands still."""
    top = float(force.max())
    deep = band.near(top, share)
    stays = _stays(time, force, top - band.width, top - deep - band.lift)
    peaks = [stay for stay in stays if stay.ends and stay.between < _HELD]
    for group in [*([peak] for peak in peaks), *([peaks] if len(peaks) > 1 else [])]:
        near, interval = sum(stay.near for stay in group), group[0].interval
        samples = sum(stay.samples for stay in group)
        ratios = (((samples + more) * interval / near) ** 2 if near > 0 else 1.0 for more in (-1, 0))
        least, likely = (max(hidden_force(r, band.depth, deep) - _TAKEN_OFF * band.noise, 0.0) for r in ratios)
        if band.noise and not any(_cut(time, force, stay, top - band.lift, deep) for stay in group):
            least = 0.0  # flat, but round
        yield Top(top, top, samples, least, likely)
    for stay in stays:
        cut = stay.first <= last and _cut_rise(time, force, stay.first, top - band.lift, deep)
        if stay.between >= _HELD and (cut or _frozen(stay, band)):
            yield Top(top, top, stay.samples, deep, deep)


def _cut(time: FloatArray, force: FloatArray, stay: _Stay, top: float, deep: float) -> bool:
    """True if a stay at the top begins and ends at an edge."""
    backward = force.size - 1 - stay.last
    return _cut_rise(time, force, stay.first, top, deep) and _cut_rise(-time[::-1], force[::-1], backward, top, deep)


def _cut_rise(time: FloatArray, force: FloatArray, first: int, top: float, deep: float) -> bool:
    """True if the rise keeps its slope up to the top, sample `first`; a round one approaches it ever slower."""
    if not (force[:first] < top - 2.0 * deep).any():
        return True  # it does not come from deep enough to tell
    levels = (top - deep, top - 2.0 * deep)
    below = [int(np.flatnonzero(force[:first] < level)[-1]) for level in levels]
    entered, before = (_crossing(time, force, k, k + 1, level) for k, level in zip(below, levels, strict=True))
    return float(time[first]) - entered <= _KEPT * (entered - before) + float(time[first] - time[first - 1])


def _frozen(stay: _Stay, band: _Band) -> bool:
    """True if one reading repeats itself where noise would change it."""
    return band.exact and stay.samples >= max(_REPEATS, 0.5 * stay.between / stay.interval)


def _stays(time: FloatArray, force: FloatArray, band: float, near: float) -> list[_Stay]:
    """The stays above the level `near` [N] that reach the level `band` [N]."""
    above = np.concatenate([[False], force >= near, [False]])
    edges = np.flatnonzero(above[1:] != above[:-1])
    stays = []
    for start, stop in (edges.reshape(-1, 2) - (0, 1)).tolist():
        if (at := start + np.flatnonzero(force[start : stop + 1] >= band)).size:
            first, last = int(at[0]), int(at[-1])
            before, after = max(start - 1, 0), min(stop + 1, force.size - 1)
            rise = float(time[first]) - _crossing(time, force, before, start, near) if before < start else math.inf
            fall = _crossing(time, force, after, stop, near) - float(time[last]) if after > stop else math.inf
            interval = float(time[after] - time[before]) / (after - before)
            stays.append(_Stay(at.size, first, last, float(time[last] - time[first]), rise, fall, interval))
    return stays


def _crossing(time: FloatArray, force: FloatArray, below: int, above: int, level: float) -> float:
    share = float(level - force[below]) / float(force[above] - force[below])
    return float(time[below]) + share * float(time[above] - time[below])
