"""Quality flags of an impact, each with the figure behind it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain

import numpy as np

from forcemap.arrays import FloatArray, columns
from forcemap.impacts.clipping import Top, samples_across
from forcemap.impacts.impact import TRANSIENT_TIME, Flag, Impact, Quality
from forcemap.impacts.interference import Jump, Swing, find_corner, find_standstill, lopsided
from forcemap.impacts.phases import FALL_SHARE, HOLD_WINDOW
from forcemap.impacts.smooth import mean_interval
from forcemap.recordings.recording import Recording

# Choices; docs/your_device_files.md states them in its table of flags, tests/test_impacts.py has a curve for each flag.
# Too few samples, and the peak is not known.
_LEAST_SAMPLES = 16  # across Phase I
EARLY, _LEAST_EARLY_SAMPLES = 0.05, 10  # so many in the first 50 ms of contact [s], whatever the width of Phase I
_EARLY_RATE = 1000.0  # sampling rate that gives them with certainty [Hz]
_LEAST_ACROSS = 7  # across the half width of the peak: with straight flanks the largest is 7 % too low at worst
# The shortest Phase I that such samples allow: one part in 4 of what they show, and no less than this [s].
_SHORTEST_PART, _SHORTEST = 4, 1e-4
_RATE_STEP = 100  # the sampling rate that is asked for is rounded up to this [Hz]
# Shares of the largest reading; what is missed and lost with them: docs/validity.md, "Peaks that are not the peak".
_MOST_BETWEEN = 0.04  # the flanks say that the top may lie so much higher
# So much higher even if its stay is counted a sampling interval shorter: it may be cut off; and it is, a lower bound.
_MOST_HIDDEN, _CUT_OFF_BY = 0.013, 0.03  # one false lower bound spoils a campaign, one peak too few does not
_MOST_TOLD = 1.0  # a choice: that the top may lie so much higher says no more than that it is not known
_FINER = 1.5  # what is missed falls with the square of the sampling rate, and for a noisy top more slowly
_RANGE_SHARE = 0.999  # of the device range counts as the range: readings are rounded
_MOST_OBLIQUE = 1.06  # whole force over that in the stated direction
_MOST_SWING = 0.05  # amplitude before contact, as a share of the peak; it may lift or lower the peak by as much ...
MOST_LOWERED, MOST_LIFTED = 0.04, 0.05  # ... and the part of it that is known to go on, by so much

UNKNOWN_PEAK = (  # the peak is not known: by its zero, its direction, its samples, or what is not the contact's
    *(Quality.NO_BASELINE, Quality.OFFSET, Quality.UNQUIET),
    *(Quality.REVERSED, Quality.OBLIQUE),
    *(Quality.UNRESOLVED, Quality.CUT_OFF, Quality.GAP, Quality.UNIT),
    *(Quality.SPIKE, Quality.JUMP, Quality.STUCK),
)
# No impact is within a limit with one of these.
DOUBTFUL = (*UNKNOWN_PEAK, Quality.SATURATED, Quality.STEP, Quality.HUM)
_MOST_LOPSIDED = 4.0  # fall over rise [s/s]; of real and simulated impacts that a higher force follows: up to 3
# The baseline
_MOST_NOISE, _MOST_NOISE_SHARE = 10.0, 0.05  # [N], share of the peak: a baseline that scatters by more shows no zero
_MOST_OFFSET, _MOST_OFFSET_SHARE = 50.0, 0.1  # [N], share of the device range; more is a load
_MOST_DRIFT, _DRIFT_SDS = 15.0, 2.0  # [N/s], and so many of its uncertainties; more is a force that grows
_MOST_UNQUIET, _SOME_UNQUIET = 0.25, 0.1  # shares of the samples before contact: for a doubt, for a note
_NOTED_DRIFT, _DRIFT_TIME = 3.0, 2 * TRANSIENT_TIME  # [N] over this time or the recording [s]: worth a note
# The direction
_MOST_OPPOSITE = 0.5  # share of the peak that acts against the stated direction
_PULL, _PULL_FLOORS = 0.01, 2.0  # a device cannot pull for longer [s], by more than so many floors
# What follows
_SECOND_HIT = 0.8  # share of the peak: a later contact with more is a second hit
_NOT_OVER = 1.0 - FALL_SHARE  # share of the largest force: a recording that ends above it ends before the peak is over
_NOT_OVER_SDS = 4.0  # ... unless noise lifts it there
_SINKS_FROM, _RETURNED = 0.3, 0.03  # shares of the peak between which a force sinks slowly ...
_SINKS, _SINKS_FOR = 0.6, 0.02  # ... if it takes so much of the time from the peak to there, and so long [s]
_RINGING, _RINGING_SDS = 0.05, 5.0  # share of the peak, [SD]: the largest sample of Phase I is above the peak by more
_BRAKING, _BRAKING_FLOORS = 0.05, 2.0  # share of the peak, floors: a force before contact is larger than both
_HIGH = 0.5  # share of the peak: a gap beside a higher sample is one at the top
_GAP_PART = 8  # a gap is longer than one part in 8 of Phase I; at its top, of its half width ...
_GAP_INTERVALS, _TOP_GAP_INTERVALS = 5.0, 2.5  # ... and than so many mean sampling intervals
_NARROWEST = 4e-4  # Phase I of steel on steel [s]


def flags_of(
    impact: Impact, tops: list[Top], before: FloatArray, smooth: FloatArray, steps: list[Jump], swing: Swing
) -> tuple[Flag, ...]:
    """The flags of an impact.

    Parameters
    ----------
    impact : Impact
    tops : list of Top
        Its tops.
    before : array (k,)
        Contact force before onset, since the start or the impact before [N].
    smooth : array (n,)
        Smoothed contact force from the onset on, plus what drift may have taken from it [N].
    steps : list of Jump
        Changes of the force that are not taken back.
    swing : Swing
        How the force swings before contact.
    """
    cut = tuple(_saturated(impact, tops))
    few = _unresolved(impact, 0.0 if cut else _missed(tops))  # a peak that is cut off is a lower bound
    others = (
        _baseline(impact),
        _reversed(impact, before, smooth),
        _oblique(impact),
        _course(impact),
        _slow_return(impact),
        _gap(impact),
        _unit(impact),
    )
    foreign = (*(() if cut else (*_jumps(impact, steps, swing), *_stuck(impact))), *_hum(impact, swing))
    return tuple(Flag(*doubt) for doubt in (*cut, *few, *foreign, *chain(*others), *_calibration(impact.recording)))


_Doubts = Iterator[tuple[Quality, str]]


def _saturated(impact: Impact, tops: list[Top]) -> _Doubts:
    first, last = impact.recording.time.searchsorted([impact.onset, impact.end])
    recorded, device_range = impact.recording.force[first : last + 1], impact.recording.device.range
    read = float(np.linalg.norm(columns(recorded), axis=1).max())
    reading = max(read, impact.verdict_peak_force, float(impact.contact.force[first : last + 1].max()))
    cut_off = [top for top in tops if top.least >= _CUT_OFF_BY * top.reading]
    beyond = impact.recording.beyond_range
    if beyond is not None and (samples := int(beyond[first : last + 1].sum())):
        what = f"the device said {samples} time{'s' if samples > 1 else ''} that its range was exceeded"
        yield Quality.SATURATED, f"{what}: at least {reading:.1f} N"
    elif reading >= _RANGE_SHARE * device_range:
        of = f"of a device range of {device_range:g} N"
        if read >= _RANGE_SHARE * device_range:
            yield Quality.SATURATED, f"read {read:.1f} N {of}, its zero line not taken off"
        else:
            yield Quality.SATURATED, f"{reading:.1f} N of contact force {of}"
    elif cut_off:
        of = "" if recorded.ndim == 1 else " of one component, as it was recorded"
        top = f"{cut_off[0].samples} samples alike within the noise at the top{of}, {cut_off[0].recorded:.1f} N"
        higher = f"the flanks point at least {cut_off[0].least:.1f} N higher"
        yield Quality.SATURATED, f"{top}: as if cut off below the range, {higher}"


def _missed(tops: list[Top]) -> float:
    """How far the top may lie above the largest reading, as a share of it; 0 if no further than it may by chance."""
    shares = [(top.likely / top.reading, top.least / top.reading) for top in tops]
    return max(
        max(likely, least) if likely >= _MOST_BETWEEN or least >= _MOST_HIDDEN else 0.0 for likely, least in shares
    )


def _unresolved(impact: Impact, between: float) -> _Doubts:
    duration, rate = impact.phase1_end - impact.onset, impact.recording.sampling_rate
    across = samples_across(impact)
    shortest = max(duration - 1 / rate, duration / _SHORTEST_PART, _SHORTEST)
    early_few = impact.early_samples < _LEAST_EARLY_SAMPLES and impact.recorded_time >= EARLY
    finer = _FINER * max(math.sqrt(min(between, 1.0) / _MOST_BETWEEN), 1.0)
    needed = dict[str, float]()  # [Hz], by what is wrong
    if impact.phase1_samples < _LEAST_SAMPLES:
        needed[f"{impact.phase1_samples} samples across Phase I (at least {_LEAST_SAMPLES})"] = (
            _LEAST_SAMPLES / shortest
        )
    if across < _LEAST_ACROSS:
        steeper = "across the half width of its peak if both its flanks were the steeper one"
        needed[f"{across} samples {steeper} (at least {_LEAST_ACROSS})"] = rate * _LEAST_ACROSS / max(across - 1, 1)
    if early_few:
        needed[f"{impact.early_samples} samples in the first 50 ms (at least {_LEAST_EARLY_SAMPLES})"] = _EARLY_RATE
    remedy = "" if needed else "measure it again, and if that is so again, "
    if between > 0:
        above = f"the flanks point {between:.0%} above the largest sample: the top may lie there, or be cut off"
        if between > _MOST_TOLD:
            above = "how far the top lies above the largest sample, or is cut off, cannot be told from these samples"
        needed[above] = rate * finer
    if needed:
        enough = math.ceil(max(needed.values()) / _RATE_STEP) * _RATE_STEP
        few = f"{'; '.join(needed)}; {remedy}it takes {enough:d} Hz or more, this is {rate:.0f} Hz"
        yield Quality.UNRESOLVED, few


def _jumps(impact: Impact, steps: list[Jump], swing: Swing) -> _Doubts:
    if steps:
        largest = max(steps, key=lambda step: (step.hides_top, abs(step.force)))
        after = impact.contact.time[largest.index] - impact.onset
        change = f"the force changes by {largest.force:+.1f} N from one sample to the next {after:.4f} s after onset"
        name = Quality.JUMP if largest.hides_top else Quality.STEP
        yield name, f"{change}, far more than before and after: samples may be missing"
    if impact.later_force > impact.verdict_peak_force and (times := lopsided(impact)) > _MOST_LOPSIDED:
        falls = f"Phase I falls to half in {times:.1f} times as long as it rose from there"
        yield Quality.STEP, f"{falls}, and {impact.later_force:.1f} N follow: its peak may be missing"
    if not any(step.hides_top for step in steps) and (turn := find_corner(impact, swing.hum)):
        rise, fall = (slope / 1000.0 for slope in turn)
        turns = f"the force turns from one sample to the next, from {rise:+.3g} to {fall:+.3g} N/ms"
        yield Quality.JUMP, f"{turns}, where a top is round: samples may be missing"


def _stuck(impact: Impact) -> _Doubts:
    if run := find_standstill(impact):
        equal = f"{run.samples} equal readings, {run.duration:.4f} s long, {run.time - impact.onset:.4f} s after onset"
        name = Quality.STUCK if run.hides_top else Quality.STEP
        yield name, f"{equal}, while the force moves: the logger stood still"


def _hum(impact: Impact, swing: Swing) -> _Doubts:
    peak = np.fmax(impact.peak_force, impact.later_force)
    moved = swing.lowers > MOST_LOWERED * peak or swing.lifts > MOST_LIFTED * peak
    often = f"about {swing.frequency:.0f} times a second"
    if moved or swing.amplitude > _MOST_SWING * peak:
        of_peak = f"{swing.amplitude / peak:.0%} of the peak"
        yield Quality.HUM, f"the force before contact swings by {swing.amplitude:.1f} N {often}, {of_peak}"
    if moved:
        change = f"{swing.lowers:.1f} N of the peak, or lift it by {swing.lifts:.1f} N"
        yield Quality.UNQUIET, f"the force before contact swings {often}, which may have taken {change}"


def _baseline(impact: Impact) -> _Doubts:
    contact = impact.contact
    if contact.baseline_samples == 0:
        missing = f"{impact.onset - contact.time[0]:.4f} s before contact do not show it, 0.02 s and 10 samples would"
        yield Quality.NO_BASELINE, f"{missing}; the device's zero is taken as it stands"
        return
    scatter = f"the {contact.baseline_samples} samples before contact scatter by {contact.baseline_sd:.1f} N"
    unquiet = f"{contact.unquiet:.0%} of the samples before contact are not quiet"
    if contact.baseline_sd > max(_MOST_NOISE, _MOST_NOISE_SHARE * impact.peak_force):
        yield Quality.NO_BASELINE, scatter
    if contact.baseline_level > max(_MOST_OFFSET, _MOST_OFFSET_SHARE * np.nan_to_num(impact.recording.device.range)):
        yield Quality.OFFSET, f"{contact.baseline_level:.1f} N before contact: a load, or a zero that is off"
    if abs(contact.drift) > _MOST_DRIFT + _DRIFT_SDS * contact.drift_sd:
        yield Quality.UNQUIET, f"the force changes by {contact.drift:.1f} N/s before contact"
    elif contact.unquiet > _MOST_UNQUIET:
        yield Quality.UNQUIET, unquiet
    if abs(contact.drift * min(impact.recorded_time, _DRIFT_TIME)) > _NOTED_DRIFT:
        yield Quality.DRIFT, f"the baseline drifts by {contact.drift:.1f} N/s; taken off"
    elif contact.unquiet > _SOME_UNQUIET:
        yield Quality.DRIFT, f"{unquiet}; left out"


def _reversed(impact: Impact, before: FloatArray, smooth: FloatArray) -> _Doubts:
    # where the sign is wrong, what seems to rise is the return to zero, and the contact lies before it
    opposite = -float(np.concatenate([before, impact.curve()[1]]).min(initial=0.0))
    pulls = np.count_nonzero(smooth < -_PULL_FLOORS * impact.contact.floor) / impact.recording.sampling_rate
    if opposite > max(_MOST_OPPOSITE * impact.raw_peak_force, impact.floor):
        yield Quality.REVERSED, f"{opposite:.1f} N against the stated direction; is the sign right?"
    elif pulls > _PULL:
        below = f"the force goes {-float(smooth.min()):.1f} N below that before contact"
        yield Quality.REVERSED, f"{below}, where a load must have acted"


def _oblique(impact: Impact) -> _Doubts:
    recording, along = impact.recording, impact.raw_peak_force
    peak, onset = recording.time.searchsorted([impact.peak_time, impact.onset])
    whole = float(np.linalg.norm(recording.force[peak] - recording.force[max(onset - 1, 0)]))
    if recording.direction is not None and whole > _MOST_OBLIQUE * along + impact.floor:
        yield Quality.OBLIQUE, f"{whole:.1f} N act, {along:.1f} N of them in the stated direction"


def _course(impact: Impact) -> _Doubts:
    contact, later, peak = impact.contact, impact.later_force, impact.peak_force
    if later > impact.verdict_peak_force or (impact.bounces and later > _SECOND_HIT * peak):
        name = Quality.DOUBLE_HIT if impact.bounces else Quality.LATER_PEAK
        yield name, f"{later:.1f} N after a Phase I peak of {peak:.1f} N"
    if impact.recorded_time < TRANSIENT_TIME:
        _, force = impact.curve()
        if force[-1] >= _NOT_OVER * force.max() - _NOT_OVER_SDS * contact.baseline_sd:
            yield Quality.CUT_OFF, f"the recording ends while {impact.end_force:.1f} N act, before the peak is over"
        expected = f"expected {HOLD_WINDOW[1]:g} s"
        yield Quality.TOO_SHORT, f"recorded for {impact.recorded_time:.3f} s after onset, {expected}"
    excess = impact.raw_peak_force - peak
    if excess > max(_RINGING * peak, _RINGING_SDS * contact.baseline_sd):
        yield Quality.RINGING, f"the largest sample of Phase I is {excess:.1f} N above the peak without noise"
    if contact.baseline_samples and impact.force_before > max(_BRAKING_FLOORS * contact.floor, _BRAKING * peak):
        yield Quality.BRAKING_TRANSIENT, f"{impact.force_before:.1f} N before contact"


def _slow_return(impact: Impact) -> _Doubts:
    # a held force that a channel lets sink to zero looks so; robots that let go do so in under half of the time
    time, force = impact.curve()
    top = int(time.searchsorted(impact.peak_time - impact.onset))
    over = np.flatnonzero(force[top:] < max(_RETURNED * impact.peak_force, impact.floor))
    if not over.size:
        return
    end = top + int(over[0])
    begins = int(np.flatnonzero(force[: end + 1] >= _SINKS_FROM * impact.peak_force)[-1])
    fall, sinks = time[begins] - time[top], time[end] - time[begins]
    if sinks > max(_SINKS * fall, _SINKS_FOR):
        share = f"from {100 * _SINKS_FROM:g} to {100 * _RETURNED:g} % of its peak"
        yield (
            Quality.SLOW_RETURN,
            f"the force sinks {share} in {1000 * sinks:.0f} ms, after {1000 * fall:.0f} ms to there",
        )


def _gap(impact: Impact) -> _Doubts:
    time = impact.recording.time
    first, last = time.searchsorted([impact.onset, impact.phase1_end])
    span = slice(max(int(first) - 1, 0), int(last) + 1)
    steps, usual = np.diff(time[span]), mean_interval(time)
    high = impact.contact.force[span] > _HIGH * impact.raw_peak_force
    longest = float(steps.max(initial=0.0))
    at_top = float(steps[high[1:] | high[:-1]].max(initial=0.0))
    if longest > max((impact.phase1_end - impact.onset) / _GAP_PART, _GAP_INTERVALS * usual):
        yield Quality.GAP, f"no sample for {longest:.4f} s of Phase I"
    elif at_top > max(_TOP_GAP_INTERVALS * usual, impact.phase1_width / _GAP_PART):
        yield Quality.GAP, f"no sample for {at_top:.4f} s at the top of Phase I"
    elif impact.gap:
        yield Quality.GAP, f"no sample for {impact.gap:.4f} s after Phase I"


def _unit(impact: Impact) -> _Doubts:
    if impact.phase1_width < _NARROWEST:
        wide = f"Phase I is {1000 * impact.phase1_width:.3g} ms wide, narrower than {1000 * _NARROWEST:g} ms"
        yield Quality.UNIT, f"{wide} no contact of a robot is; is the time in another unit?"


def _calibration(recording: Recording) -> _Doubts:
    if (date := recording.metadata.get("date", "")) and recording.device.expired(date):
        until = f"the device's calibration held until {recording.device.expires}"
        yield Quality.CALIBRATION_EXPIRED, f"{until}, and it measured on {date}"
