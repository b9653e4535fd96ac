"""Quality flags of an impact, each with the figure behind it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.impacts.clipping import Top, samples_across
from forcemap.impacts.impact import TRANSIENT_TIME, Flag, Impact, Quality
from forcemap.impacts.interference import Jump, Swing, corner, lopsided, still
from forcemap.impacts.smooth import mean_interval
from forcemap.recordings.recording import Recording

LEAST_SAMPLES = 16  # across Phase I, for its peak to be known
LEAST_EARLY_SAMPLES = 10  # in the first 50 ms of contact, whatever the apparent width of Phase I
EARLY = 0.05  # [s]
LEAST_ACROSS = 7  # samples across the half width of the peak: with straight flanks the largest is 7 % too low at worst
# Shares of the largest reading; in docs/validity.md, "Peaks that are not the peak": what is missed and lost with them.
MOST_BETWEEN = 0.04  # the top may lie so much higher by what its flanks say
# So much higher even if its stay is counted a sampling interval shorter: it may be cut off; and it is, a lower bound.
MOST_HIDDEN, CUT_OFF_BY = 0.013, 0.03  # one false lower bound spoils a campaign, one peak too few does not
MOST_OBLIQUE = 1.06  # whole force over that in the stated direction
MOST_SWING = 0.05  # amplitude before contact; the peak may be lifted or lowered by as much, or by what goes on of it:
MOST_LOWERED, MOST_LIFTED = 0.04, 0.05
_FINER = 1.5  # what is missed falls with the square of the sampling rate, and for a noisy top more slowly

UNKNOWN_PEAK = (  # the peak is not known: by its zero, its direction, its samples, or what is not the contact's
    *(Quality.NO_BASELINE, Quality.OFFSET, Quality.UNQUIET),
    *(Quality.REVERSED, Quality.OBLIQUE),
    *(Quality.UNRESOLVED, Quality.CUT_OFF, Quality.GAP, Quality.UNIT),
    *(Quality.SPIKE, Quality.JUMP, Quality.STUCK),
)
# No impact is within a limit with one of these.
DOUBTFUL = (*UNKNOWN_PEAK, Quality.SATURATED, Quality.STEP, Quality.HUM)
_MOST_DRIFT = 15.0  # [N/s]; more is a force that grows
_LOPSIDED = 4.0  # times; real and simulated impacts that are followed by a higher force: up to 3
_MOST_UNQUIET = 0.25  # share of the samples before contact
_MOST_OFFSET = 50.0  # [N], or a tenth of the device range; more is a load
_NARROWEST = 4e-4  # Phase I of steel on steel [s]
_PULL = 0.01  # a device cannot pull for longer [s]


def flags_of(
    impact: Impact, found: list[Top], before: FloatArray, smooth: FloatArray, steps: list[Jump], swing: Swing
) -> tuple[Flag, ...]:
    """The flags of an impact.

    Parameters
    ----------
    impact : Impact
    found : list of Top
        Its tops.
    before : array (k,)
        Contact force before onset, since the start or the impact before [N].
    smooth : array (n,)
        Smoothed contact force from the onset on, and the drift to reckon with [N].
    steps : list of Jump
        Changes of the force that are not taken back.
    swing : Swing
        How the force swings before contact.
    """
    cut = tuple(_saturated(impact, found))
    few = _unresolved(impact, 0.0 if cut else _missed(found))  # where it is cut off, it is a lower bound
    others = (
        _baseline(impact),
        _reversed(impact, before, smooth),
        _oblique(impact),
        _course(impact),
        _gap(impact),
        _unit(impact),
    )
    foreign = (*(() if cut else (*_jumps(impact, steps, swing), *_stuck(impact))), *_hum(impact, swing))
    return tuple(Flag(*doubt) for doubt in (*cut, *few, *foreign, *chain(*others), *_calibration(impact.recording)))


_Doubts = Iterator[tuple[Quality, str]]


def _saturated(impact: Impact, found: list[Top]) -> _Doubts:
    first, last = impact.recording.time.searchsorted([impact.onset, impact.end])
    recorded, device_range = impact.recording.force[first : last + 1], impact.recording.device.range
    read = float(np.linalg.norm(recorded.reshape(len(recorded), -1), axis=1).max())
    reading = max(read, impact.verdict_peak_force, float(impact.contact.force[first : last + 1].max()))
    cut_off = [top for top in found if top.least >= CUT_OFF_BY * top.reading]
    beyond = impact.recording.beyond_range
    if beyond is not None and (samples := int(beyond[first : last + 1].sum())):
        what = f"the device said {samples} time{'s' if samples > 1 else ''} that its range was exceeded"
        yield Quality.SATURATED, f"{what}: at least {reading:.1f} N"
    elif reading >= 0.999 * device_range:
        what = f"read {read:.1f} N" if read >= 0.999 * device_range else f"{reading:.1f} N of contact force"
        yield Quality.SATURATED, f"{what} of a device range of {device_range:g} N"
    elif cut_off:
        top = f"{cut_off[0].samples} like samples at the top, {cut_off[0].recorded:.1f} N"
        higher = f"the flanks point at least {cut_off[0].least:.1f} N higher"
        yield Quality.SATURATED, f"{top}: cut off below the range, {higher}"


def _missed(found: list[Top]) -> float:
    """How far the top may lie above the largest reading, as a share of it; 0 if no further than it may by chance."""
    shares = [(top.likely / top.reading, top.least / top.reading) for top in found]
    return max(max(share) if share[0] >= MOST_BETWEEN or share[1] >= MOST_HIDDEN else 0.0 for share in shares)


def _unresolved(impact: Impact, between: float) -> _Doubts:
    duration, rate = impact.phase1_end - impact.onset, impact.recording.sampling_rate
    across = samples_across(impact)
    shortest = max(duration - 1 / rate, duration / 4, 1e-4)  # what Phase I may last between the samples
    early_few = impact.early_samples < LEAST_EARLY_SAMPLES and impact.recorded_time >= EARLY
    finer = _FINER * max(math.sqrt(min(between, 1.0) / MOST_BETWEEN), 1.0)
    needed = max(
        LEAST_SAMPLES / shortest if impact.phase1_samples < LEAST_SAMPLES else 0.0,
        1000.0 if early_few else 0.0,
        rate * LEAST_ACROSS / max(across - 1, 1) if across < LEAST_ACROSS else 0.0,
        rate * finer if between > 0 else 0.0,
    )
    if needed:
        missed = f"the top may lie {between:.0%} above the largest sample, or be cut off; " if between > 0 else ""
        yield (
            Quality.UNRESOLVED,
            f"{impact.phase1_samples} samples across Phase I (at least {LEAST_SAMPLES}), {across} across the half "
            f"width of its peak (at least {LEAST_ACROSS}), {impact.early_samples} in the first 50 ms (at least "
            f"{LEAST_EARLY_SAMPLES}); {missed}it takes {math.ceil(needed / 100) * 100:d} Hz or more, "
            f"this is {rate:.0f} Hz",
        )


def _jumps(impact: Impact, steps: list[Jump], swing: Swing) -> _Doubts:
    if steps:
        largest = max(steps, key=lambda step: (step.hides_top, abs(step.force)))
        after = impact.contact.time[largest.index] - impact.onset
        change = f"the force changes by {largest.force:+.1f} N from one sample to the next {after:.4f} s after onset"
        name = Quality.JUMP if largest.hides_top else Quality.STEP
        yield name, f"{change}, far more than before and after: samples may be missing"
    if impact.later_force > impact.verdict_peak_force and (times := lopsided(impact)) > _LOPSIDED:
        falls = f"Phase I falls to half in {times:.1f} times as long as it rose from there"
        yield Quality.STEP, f"{falls}, and {impact.later_force:.1f} N follow: its peak may be missing"
    if not any(step.hides_top for step in steps) and (turn := corner(impact, swing.hum)):
        rise, fall = (slope / 1000.0 for slope in turn)
        turns = f"the force turns from one sample to the next, from {rise:+.3g} to {fall:+.3g} N/ms"
        yield Quality.JUMP, f"{turns}, where a top is round: samples may be missing"


def _stuck(impact: Impact) -> _Doubts:
    if run := still(impact):
        at = f"{run.samples} equal readings, {run.duration:.4f} s long, {run.time - impact.onset:.4f} s after onset"
        name = Quality.STUCK if run.hides_top else Quality.STEP
        yield name, f"{at}, while the force moves: the logger stood still"


def _hum(impact: Impact, swing: Swing) -> _Doubts:
    peak = np.fmax(impact.peak_force, impact.later_force)
    moved = swing.lowers > MOST_LOWERED * peak or swing.lifts > MOST_LIFTED * peak
    often = f"about {swing.frequency:.0f} times a second"
    if moved or swing.amplitude > MOST_SWING * peak:
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
    if contact.baseline_sd > max(10.0, 0.05 * impact.peak_force):
        yield Quality.NO_BASELINE, scatter
    if contact.baseline_level > max(_MOST_OFFSET, 0.1 * np.nan_to_num(impact.recording.device.range)):
        yield Quality.OFFSET, f"{contact.baseline_level:.1f} N before contact: a load, or a zero that is off"
    if abs(contact.drift) > _MOST_DRIFT + 2 * contact.drift_sd:
        yield Quality.UNQUIET, f"the force changes by {contact.drift:.1f} N/s before contact"
    elif contact.unquiet > _MOST_UNQUIET:
        yield Quality.UNQUIET, unquiet
    if abs(contact.drift * min(impact.recorded_time, 2 * TRANSIENT_TIME)) > 3.0:
        yield Quality.DRIFT, f"the baseline drifts by {contact.drift:.1f} N/s; taken off"
    elif contact.unquiet > 0.1:
        yield Quality.DRIFT, f"{unquiet}; left out"


def _reversed(impact: Impact, before: FloatArray, smooth: FloatArray) -> _Doubts:
    # where the sign is wrong, the rise is that back to zero, and the contact lies before it
    opposite = -float(np.concatenate([before, impact.curve()[1]]).min(initial=0.0))
    pulls = np.count_nonzero(smooth < -2.0 * impact.contact.floor) / impact.recording.sampling_rate
    if opposite > max(0.5 * impact.raw_peak_force, impact.floor):
        yield Quality.REVERSED, f"{opposite:.1f} N against the stated direction; is the sign right?"
    elif pulls > _PULL:
        below = f"the force goes {-float(smooth.min()):.1f} N below that before contact"
        yield Quality.REVERSED, f"{below}, where a load must have acted"


def _oblique(impact: Impact) -> _Doubts:
    recording, along = impact.recording, impact.raw_peak_force
    peak, onset = recording.time.searchsorted([impact.peak_time, impact.onset])
    whole = float(np.linalg.norm(recording.force[peak] - recording.force[max(onset - 1, 0)]))
    if recording.direction is not None and whole > MOST_OBLIQUE * along + impact.floor:
        yield Quality.OBLIQUE, f"{whole:.1f} N act, {along:.1f} N of them in the stated direction"


def _course(impact: Impact) -> _Doubts:
    contact, later, peak = impact.contact, impact.later_force, impact.peak_force
    if later > impact.verdict_peak_force or (impact.bounces and later > 0.8 * peak):
        name = Quality.DOUBLE_HIT if impact.bounces else Quality.LATER_PEAK
        yield name, f"{later:.1f} N after a Phase I peak of {peak:.1f} N"
    if impact.recorded_time < TRANSIENT_TIME:
        _, force = impact.curve()
        if force[-1] >= 0.88 * force.max() - 4.0 * contact.baseline_sd:  # clear of noise
            yield Quality.CUT_OFF, f"the recording ends while {impact.end_force:.1f} N act, before the peak is over"
        yield Quality.TOO_SHORT, f"recorded for {impact.recorded_time:.3f} s after onset, expected 0.7 s"
    excess = impact.raw_peak_force - peak
    if excess > max(0.05 * peak, 5.0 * contact.baseline_sd):
        yield Quality.RINGING, f"the largest sample of Phase I is {excess:.1f} N above the peak without noise"
    if contact.baseline_samples and impact.force_before > max(2.0 * contact.floor, 0.05 * peak):
        yield Quality.BRAKING_TRANSIENT, f"{impact.force_before:.1f} N before contact"


def _gap(impact: Impact) -> _Doubts:
    time = impact.recording.time
    first, last = time.searchsorted([impact.onset, impact.phase1_end])
    span = slice(max(int(first) - 1, 0), int(last) + 1)
    steps, usual = np.diff(time[span]), mean_interval(time)
    high = impact.contact.force[span] > 0.5 * impact.raw_peak_force
    longest = float(steps.max(initial=0.0))
    at_top = float(steps[high[1:] | high[:-1]].max(initial=0.0))
    if longest > max((impact.phase1_end - impact.onset) / 8, 5.0 * usual):
        yield Quality.GAP, f"no sample for {longest:.4f} s of Phase I"
    elif at_top > max(2.5 * usual, impact.phase1_width / 8):
        yield Quality.GAP, f"no sample for {at_top:.4f} s at the top of Phase I"
    elif impact.gap:
        yield Quality.GAP, f"no sample for {impact.gap:.4f} s after Phase I"


def _unit(impact: Impact) -> _Doubts:
    if impact.phase1_width < _NARROWEST:
        wide = f"Phase I is {1000 * impact.phase1_width:.3g} ms wide, narrower than {1000 * _NARROWEST:g} ms"
        yield Quality.UNIT, f"{wide} no contact of a robot is; is the time in another unit?"


def _calibration(recording: Recording) -> _Doubts:
    if (on := recording.metadata.get("date", "")) and recording.device.expired(on):
        yield Quality.CALIBRATION_EXPIRED, f"the device's calibration had expired on {on}"
