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

from forcemap.arrays import FloatArray, columns
from forcemap.impacts.impact import Impact
from forcemap.impacts.phases import flanks
from forcemap.impacts.smooth import moving_mean

# Tuned on tests/test_clipped_curves.py and tests/curves.py with seeds other than theirs, and on the real recordings of
# docs/validity.md, "Peaks that are not the peak".
_TOP_SHARE = 0.10  # of the largest reading: so far below it is near the top; a parabola there, and clear of noise
_NARROW_TOP_SHARE = 0.03  # ... where the curve rings by no more than that
_LEAST_DEPTHS = 4.0  # ... and at least so many times the depth of the band at the top
_MOST_TOP_SHARE = 0.45  # ... but no more than this, however noisy: twice as deep there must still be a rise
_BAND_SDS = 5.0  # [SD of the noise]: width of the band at the top
_DEPTH_SDS, _LIFT_SDS = 3.0, 2.0  # [SD of the noise]: of which so much below the curve without noise, so much above it
QUANTISATION_SD = 0.3  # noise of a reading, in steps of the readings (1 / sqrt(12), rounded up)
_NOISE_LEFT = (1.0, 0.65, 0.4)  # shares of the noise that a ceiling may leave at the top: it cuts what comes before it
_NOISE_ERROR_SDS = 2.0  # standard deviations by which a few samples before contact may understate the noise
_AVERAGED_PART = 24  # noise may be averaged over one part in 24 of the time near the top without flattening it
_DEPTH_AVERAGED_SDS = 36.0  # [SD of the averaged noise]: the depth near the top; with less, noise blurs the times
_LONGEST_PEAK = 0.15  # a longer stay at the top is a force that is held: no impact's peak is as flat for as long [s]
_CUT_RISE = 1.2  # times as long as over the part before a rise takes over its last if it is cut off; a round one 1.6
FROZEN_STEPS = 2.0  # [steps of the readings]: with more noise a force that is held does not repeat its largest reading
_REPEATS, _REPEATED_SHARE = 8, 0.5  # ... so many times, and for over half of the stay
_NOISE_LIFT_SDS = 1.5  # [SD of the noise]: a height that noise alone may simulate
_MOST_RATIO = 0.99  # of r: as the flanks become steps, r goes to 1 and h to infinity
_LEAST_COMPONENT = 0.3  # share of the peak: a component that shows less of it says nothing about the peak ...
_LEAST_CUT_COMPONENT = 0.05  # ... unless it is cut off, from this share on ...
_RAISED_BY_CUT = 0.02  # ... and what its flanks imply raises the peak by so much
_LEAD_SAMPLES, _ZERO_SAMPLES = 4, 200  # before the onset: so many belong to the rise; from so many its zero is read
_FLANK_FACTOR = 2.0  # the flanks may imply only half of what was missed
_LEAST_UNSEEN = 0.01  # share of the peak: the peak is not promised more closely
# Straight flanks hide half a step between n samples across the half width, 0.5 / n of the peak, so more of the reading.
_COARSE_SHARE, _DENSE_SAMPLES = 0.55, 14
_CLOSE_SAMPLES = 28  # across the half width: a parabola rises by less than 0.1 % of its peak between two of them
_ROUGH_TOP_SHARE, _ROUGH_SDS = 0.2, 3.5  # share of the peak that counts as its top; [SD] that noise alone may do there


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
        Force above the largest reading that the flanks imply, less the noise [N]: `likely` if the stay at the top lasts
        as many sampling intervals as it has samples, `least` if it lasts one fewer.
    """

    reading: float
    recorded: float
    samples: int
    least: float
    likely: float


@dataclass(frozen=True)
class _Band:
    """Readings that count as the top [N]: those within `width` of the largest, which noise raises by `lift`.

    A curve without noise would be within `depth` of its top there. `exact` if equal readings are no coincidence.
    """

    width: float
    depth: float
    lift: float
    noise: float
    exact: bool = False

    def near(self, top: float, share: float) -> float:
        """How far below the top still counts as near it [N]."""
        return min(max(share * top, _LEAST_DEPTHS * self.depth), _MOST_TOP_SHARE * top)


@dataclass(frozen=True)
class _Stay:
    """A stay near the top: number of samples within the band at the top, the first and last of them, and times [s].

    `between` first and last, `rise` up to the first, `fall` after the last, and the sampling interval.
    """

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
        """Time near the top, both flanks as long as their geometric mean [s]: a long tail says little of the top."""
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
    r = min(ratio, _MOST_RATIO)
    return max((deep * r - shallow) / (1.0 - r), 0.0)


def find_tops(impact: Impact) -> list[Top]:
    """The top of Phase I, and of every recorded component that shows enough of the peak or was cut off."""
    recording, contact = impact.recording, impact.contact
    onset, peak_end, end = recording.time.searchsorted([impact.onset, impact.phase1_end, impact.end])
    start = max(int(onset) - _LEAD_SAMPLES, 0)
    time, phase1 = recording.time[start : end + 1], int(peak_end) + 1 - start
    noise = contact.baseline_sd * (1.0 + _NOISE_ERROR_SDS / math.sqrt(max(contact.baseline_samples, 1)))
    contact_top = _top(time[:phase1], contact.force[start : peak_end + 1], noise, 0.0, -1)
    tops = [replace(contact_top, least=0.0)]  # whether it was cut off shows in the recorded components
    several = recording.force.ndim > 1 and recording.force.shape[1] > 1
    for component in columns(recording.force).T:
        away = component[start : end + 1] - np.median(component[max(start - _ZERO_SAMPLES, 0) : max(int(onset) - 1, 1)])
        further = away.max() >= -away.min()
        for side, is_further in ((away, further), (-away, not further)):
            if side.max() < _LEAST_CUT_COMPONENT * impact.raw_peak_force or not (several or is_further):
                continue  # of several components the side that swings less far may be cut off, too
            top = _top(time, side, noise, smallest_step(component), phase1)
            shows = is_further and top.reading >= _LEAST_COMPONENT * impact.raw_peak_force
            if shows or _raises(impact.raw_peak_force, top):
                tops.append(replace(top, recorded=abs(float(component[start + int(side.argmax())]))))
    return tops


def _raises(peak: float, component: Top) -> bool:
    """True if the force [N] would be much larger by what the flanks of a small component imply."""
    hidden = (component.reading + component.least) ** 2 - component.reading**2
    return math.sqrt(peak**2 + hidden) >= (1.0 + _RAISED_BY_CUT) * peak


def not_cut_off(impact: Impact, tops: list[Top]) -> list[Top]:
    """The same tops; of a device that was seen to read all that their flanks imply, none is cut off.

    Only where samples lie so close that no top hides between them.
    """
    implied = max((max(top.recorded, top.reading) + _FLANK_FACTOR * top.likely for top in tops), default=math.inf)
    if not (implied <= impact.recording.device.tried and samples_across(impact) >= _CLOSE_SAMPLES):
        return tops
    return [replace(top, least=0.0, likely=0.0) for top in tops]


def unseen_force(impact: Impact, tops: list[Top]) -> float:
    """How far the force may have risen above the largest sample of Phase I, between samples [N].

    The larger of twice what the flanks of its tops imply, and of the deviation of a sample near the top from a cubic
    through two neighbours on either side, less what noise does: a rough curve is as rough between its samples. With few
    samples across the half width, no less than a peak with straight flanks hides between them.
    """
    onset, peak_end = impact.contact.time.searchsorted([impact.onset, impact.phase1_end])
    force = impact.contact.force[max(int(onset) - 2, 0) : int(peak_end) + 3]
    off = force[2:-2] - (4.0 * (force[1:-3] + force[3:-1]) - force[:-4] - force[4:]) / 6.0
    at_top = force[2:-2] >= (1.0 - _ROUGH_TOP_SHARE) * force.max()
    rough = float(np.abs(off[at_top]).max(initial=0.0)) - _ROUGH_SDS * impact.contact.baseline_sd
    missed = max(rough, *(_FLANK_FACTOR * top.likely for top in tops))
    across = max(samples_across(impact), 1)
    coarse = _COARSE_SHARE / across * impact.raw_peak_force if across < _DENSE_SAMPLES else 0.0
    return max(missed if missed > _LEAST_UNSEEN * impact.raw_peak_force else 0.0, coarse)


def samples_across(impact: Impact) -> int:
    """Samples across the half width of the peak, with its steeper flank on both sides."""
    first, last = impact.contact.time.searchsorted([impact.onset, impact.phase1_end])
    force = impact.contact.force[max(int(first) - 1, 0) : int(last) + 1]
    peak = int(force.argmax())
    left, right = flanks(force, peak, 0.5 * impact.raw_peak_force)
    return 2 * min((abs(sample - peak) for sample in (left, right) if 0 <= sample < force.size), default=1) - 1


def smallest_step(readings: FloatArray) -> float:
    """Smallest step of the readings [N]; 0 if all are equal."""
    steps = np.diff(np.unique(readings))
    steps = steps[steps > 1e-9 * np.abs(readings).max()]  # no rounding error
    return float(steps.min()) if steps.size else 0.0


def _top(time: FloatArray, force: FloatArray, noise: float, step: float, last: int) -> Top:
    """The top of a curve [s], [N] with that noise and step of its readings [N]; Phase I ends at sample `last`."""
    curves = [(force, _Band(0.5 * step, step, 0.0, 0.0, exact=noise >= FROZEN_STEPS * step))]
    for share in _NOISE_LEFT:
        averaged = _averaged(time, force, max(share * noise, QUANTISATION_SD * step))
        left = max(share * noise / math.sqrt(averaged), QUANTISATION_SD * step)
        band = _Band(_BAND_SDS * left, _DEPTH_SDS * left, _LIFT_SDS * left, share * noise)
        curves.append((moving_mean(force, averaged), band))
    wide = [top for curve, band in curves for top in _at_top(time, curve, band, _TOP_SHARE, last)]
    narrow = [top for curve, band in curves[:2] for top in _at_top(time, curve, band, _NARROW_TOP_SHARE, last)]
    reading = float(force.max())
    surest = max([*wide, *narrow], key=lambda top: top.least, default=Top(reading, reading, 0, 0.0, 0.0))
    likely = max((top.likely for top in wide), default=0.0)
    return Top(reading, reading, surest.samples, surest.least, likely)


def _averaged(time: FloatArray, force: FloatArray, scatter: float) -> int:
    """Odd number of samples whose mean shows the top clear of noise without flattening it."""
    top = float(force.max())
    band = _Band(_BAND_SDS * scatter, _DEPTH_SDS * scatter, _LIFT_SDS * scatter, scatter)
    stays = _stays(time, force, top - band.width, top - band.near(top, _TOP_SHARE) - band.lift)
    longest = max((stay.near if stay.ends else stay.rise) / stay.interval for stay in stays)
    clear = (_DEPTH_AVERAGED_SDS * scatter / (_TOP_SHARE * top)) ** 2
    return 2 * int(min(clear, min(longest, time.size) / _AVERAGED_PART) / 2) + 1


def _at_top(time: FloatArray, force: FloatArray, band: _Band, share: float, last: int) -> Iterator[Top]:
    """The top by every stay there, and by all together; a force that is held shows it by its rise, or stands still."""
    top = float(force.max())
    deep = band.near(top, share)
    stays = _stays(time, force, top - band.width, top - deep - band.lift)
    peaks = [stay for stay in stays if stay.ends and stay.between < _LONGEST_PEAK]
    for group in [*([peak] for peak in peaks), *([peaks] if len(peaks) > 1 else [])]:
        near, interval = sum(stay.near for stay in group), group[0].interval
        samples = sum(stay.samples for stay in group)
        ratios = ((intervals * interval / near) ** 2 if near > 0 else 1.0 for intervals in (samples - 1, samples))
        least, likely = (max(hidden_force(r, band.depth, deep) - _NOISE_LIFT_SDS * band.noise, 0.0) for r in ratios)
        if band.noise and not any(_cut(time, force, stay, top - band.lift, deep) for stay in group):
            least = 0.0  # flat, but round
        yield Top(top, top, samples, least, likely)
    for stay in stays:
        cut = stay.first <= last and _cut_rise(time, force, stay.first, top - band.lift, deep)
        if stay.between >= _LONGEST_PEAK and (cut or _frozen(stay, band)):
            yield Top(top, top, stay.samples, deep, deep)


def _cut(time: FloatArray, force: FloatArray, stay: _Stay, top: float, deep: float) -> bool:
    """True if a stay at the top begins and ends at an edge."""
    backward = force.size - 1 - stay.last
    return _cut_rise(time, force, stay.first, top, deep) and _cut_rise(-time[::-1], force[::-1], backward, top, deep)


def _cut_rise(time: FloatArray, force: FloatArray, first: int, top: float, deep: float) -> bool:
    """True if the rise does not slow down on its way to the top, sample `first`, as a round one does."""
    if not (force[:first] < top - 2.0 * deep).any():
        return True  # it does not come from deep enough to show
    levels = (top - deep, top - 2.0 * deep)
    below = [int(np.flatnonzero(force[:first] < level)[-1]) for level in levels]
    entered, before = (_crossing(time, force, k, k + 1, level) for k, level in zip(below, levels, strict=True))
    return float(time[first]) - entered <= _CUT_RISE * (entered - before) + float(time[first] - time[first - 1])


def _frozen(stay: _Stay, band: _Band) -> bool:
    """True if one reading repeats itself where noise would change it."""
    return band.exact and stay.samples >= max(_REPEATS, _REPEATED_SHARE * stay.between / stay.interval)


def _stays(time: FloatArray, force: FloatArray, band: float, near: float) -> list[_Stay]:
    """The stays above the level `near` [N] that reach the level `band` [N]."""
    above = np.concatenate([[False], force >= near, [False]])
    edges = np.flatnonzero(above[1:] != above[:-1])
    stays = []
    for start, stop in (edges.reshape(-1, 2) - (0, 1)).tolist():
        if (in_band := start + np.flatnonzero(force[start : stop + 1] >= band)).size:
            first, last = int(in_band[0]), int(in_band[-1])
            before, after = max(start - 1, 0), min(stop + 1, force.size - 1)
            rise = float(time[first]) - _crossing(time, force, before, start, near) if before < start else math.inf
            fall = _crossing(time, force, after, stop, near) - float(time[last]) if after > stop else math.inf
            interval = float(time[after] - time[before]) / (after - before)
            stays.append(_Stay(in_band.size, first, last, float(time[last] - time[first]), rise, fall, interval))
    return stays


def _crossing(time: FloatArray, force: FloatArray, below: int, above: int, level: float) -> float:
    """Time at which the line from sample `below` to sample `above` reaches the level [s]."""
    share = float(level - force[below]) / float(force[above] - force[below])
    return float(time[below]) + share * float(time[above] - time[below])
