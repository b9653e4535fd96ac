"""Quality flags of an impact, each with the figure behind it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.impacts.baseline import ContactForce
from forcemap.impacts.clipping import Top, samples_across
from forcemap.impacts.impact import TRANSIENT_TIME, Flag, Impact, Quality
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
_FINER = 1.5  # what is missed falls with the square of the sampling rate, and for a noisy top more slowly

UNKNOWN_PEAK = (  # the peak is not known
    Quality.UNRESOLVED,
    Quality.NO_BASELINE,
    Quality.REVERSED,
    Quality.OBLIQUE,
    Quality.OFFSET,
    Quality.UNQUIET,
    Quality.CUT_OFF,
    Quality.GAP,
)
_MOST_DRIFT = 15.0  # [N/s]; more is a force that grows
_MOST_UNQUIET = 0.25  # share of the samples before contact
_MOST_OFFSET = 50.0  # [N], or a tenth of the device range; more is a load
_PULL = 0.01  # a device cannot pull for longer [s]


def flags_of(impact: Impact, found: list[Top], before: FloatArray, smooth: FloatArray) -> tuple[Flag, ...]:
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
    """
    saturated = tuple(_saturated(impact, found))
    return (
        *saturated,
        *_unresolved(impact, 0.0 if saturated else _missed(found)),  # where it is cut off, it is a lower bound
        *_baseline(impact.contact, impact),
        *_reversed(impact, before, smooth),
        *_oblique(impact),
        *_course(impact),
        *_ringing(impact),
        *_braking(impact),
        *_gap(impact),
        *_calibration(impact.recording),
    )


def _saturated(impact: Impact, found: list[Top]) -> Iterator[Flag]:
    first, last = impact.recording.time.searchsorted([impact.onset, impact.end])
    recorded = impact.recording.force[first : last + 1]
    readings = np.abs(recorded) if recorded.ndim == 1 else np.linalg.norm(recorded, axis=1)
    forces = (readings.max(), impact.verdict_peak_force, impact.contact.force[first : last + 1].max())
    reading, device_range = float(max(forces)), impact.recording.device.range
    if reading >= 0.999 * device_range:
        read = float(readings.max())
        what = f"read {read:.1f} N" if read >= 0.999 * device_range else f"{reading:.1f} N of contact force"
        yield Flag(Quality.SATURATED, f"{what} of a device range of {device_range:g} N")
        return
    for top in found:
        if top.least >= CUT_OFF_BY * top.reading:
            yield Flag(
                Quality.SATURATED,
                f"{top.samples} like samples at the top, {top.recorded:.1f} N: cut off below the range, the flanks "
                f"point at least {top.least:.1f} N higher",
            )
            return


def _missed(found: list[Top]) -> float:
    """How far the top may lie above the largest reading, as a share of it; 0 if no further than it may by chance."""
    return max(
        max(top.likely, top.least) / top.reading
        if top.likely >= MOST_BETWEEN * top.reading or top.least >= MOST_HIDDEN * top.reading
        else 0.0
        for top in found
    )


def _unresolved(impact: Impact, between: float) -> Iterator[Flag]:
    duration, rate = impact.phase1_end - impact.onset, impact.recording.sampling_rate
    across = samples_across(impact)
    few = impact.phase1_samples < LEAST_SAMPLES
    early_few = impact.early_samples < LEAST_EARLY_SAMPLES and impact.recorded_time >= EARLY
    if few or early_few or across < LEAST_ACROSS or between > 0:
        shortest = max(duration - 1 / rate, duration / 4, 1e-4)  # what Phase I may last between the samples
        needed = max(
            LEAST_SAMPLES / shortest if few else 0.0,
            1000.0 if early_few else 0.0,
            rate * LEAST_ACROSS / max(across - 1, 1) if across < LEAST_ACROSS else 0.0,
            rate * _FINER * max(math.sqrt(min(between, 1.0) / MOST_BETWEEN), 1.0) if between > 0 else 0.0,
        )
        missed = f"the top may lie {between:.0%} above the largest sample, or be cut off; " if between > 0 else ""
        yield Flag(
            Quality.UNRESOLVED,
            f"{impact.phase1_samples} samples across Phase I (at least {LEAST_SAMPLES}), {across} across the half "
            f"width of its peak (at least {LEAST_ACROSS}), {impact.early_samples} in the first 50 ms (at least "
            f"{LEAST_EARLY_SAMPLES}); {missed}it takes {math.ceil(needed / 100) * 100:d} Hz or more, "
            f"this is {rate:.0f} Hz",
        )


def _baseline(contact: ContactForce, impact: Impact) -> Iterator[Flag]:
    if contact.baseline_samples == 0:
        yield Flag(
            Quality.NO_BASELINE,
            f"{impact.onset - contact.time[0]:.4f} s before contact do not show it, 0.02 s and 10 samples would; "
            "the device's zero is taken as it stands",
        )
        return
    if contact.baseline_sd > max(10.0, 0.05 * impact.peak_force):
        yield Flag(
            Quality.NO_BASELINE,
            f"the {contact.baseline_samples} samples before contact scatter by {contact.baseline_sd:.1f} N",
        )
    if contact.baseline_level > max(_MOST_OFFSET, 0.1 * np.nan_to_num(impact.recording.device.range)):
        yield Flag(Quality.OFFSET, f"{contact.baseline_level:.1f} N before contact: a load, or a zero that is off")
    if abs(contact.drift) > _MOST_DRIFT + 2 * contact.drift_sd:
        yield Flag(Quality.UNQUIET, f"the force changes by {contact.drift:.1f} N/s before contact")
    elif contact.unquiet > _MOST_UNQUIET:
        yield Flag(Quality.UNQUIET, f"{contact.unquiet:.0%} of the samples before contact are not quiet")
    moved = contact.drift * min(impact.recorded_time, 2 * TRANSIENT_TIME)
    if abs(moved) > 3.0:
        yield Flag(Quality.DRIFT, f"the baseline drifts by {contact.drift:.1f} N/s; taken off")
    elif contact.unquiet > 0.1:
        yield Flag(Quality.DRIFT, f"{contact.unquiet:.0%} of the samples before contact are not quiet; left out")


def _reversed(impact: Impact, before: FloatArray, smooth: FloatArray) -> Iterator[Flag]:
    # where the sign is wrong, the rise is that back to zero, and the contact lies before it
    force = np.concatenate([before, impact.curve()[1]])
    opposite = -float(force.min()) if force.size else 0.0
    if opposite > max(0.5 * impact.raw_peak_force, impact.floor):
        yield Flag(Quality.REVERSED, f"{opposite:.1f} N against the stated direction; is the sign right?")
        return
    pulls = smooth < -2.0 * impact.contact.floor
    if pulls.any() and np.count_nonzero(pulls) / impact.recording.sampling_rate > _PULL:
        yield Flag(
            Quality.REVERSED,
            f"the force goes {-float(smooth.min()):.1f} N below that before contact, where a load must have acted",
        )


def _oblique(impact: Impact) -> Iterator[Flag]:
    recording = impact.recording
    if recording.direction is None:
        return
    peak = int(recording.time.searchsorted(impact.peak_time))
    quiet = int(recording.time.searchsorted(impact.onset)) - 1
    whole = float(np.linalg.norm(recording.force[peak] - recording.force[max(quiet, 0)]))
    if whole > 1.2 * impact.raw_peak_force + impact.floor:
        yield Flag(Quality.OBLIQUE, f"{whole:.1f} N act, {impact.raw_peak_force:.1f} N of them in the stated direction")


def _course(impact: Impact) -> Iterator[Flag]:
    later = impact.later_force
    if later > impact.verdict_peak_force:
        name = Quality.DOUBLE_HIT if impact.bounces else Quality.LATER_PEAK
        yield Flag(name, f"{later:.1f} N after a Phase I peak of {impact.peak_force:.1f} N")
    elif impact.bounces and later > 0.8 * impact.peak_force:
        yield Flag(Quality.DOUBLE_HIT, f"{later:.1f} N after a Phase I peak of {impact.peak_force:.1f} N")
    after, force = impact.curve()
    following = force[after.searchsorted(impact.peak_time - impact.onset) + 1 :]
    fallen = 0.88 * impact.raw_peak_force - 4.0 * impact.contact.baseline_sd  # clear of noise
    if impact.recorded_time < TRANSIENT_TIME and not (following < fallen).any():
        yield Flag(Quality.CUT_OFF, f"the recording ends while {impact.end_force:.1f} N act, before the peak is over")
    if impact.recorded_time < TRANSIENT_TIME:
        yield Flag(Quality.TOO_SHORT, f"recorded for {impact.recorded_time:.3f} s after onset, expected 0.7 s")


def _ringing(impact: Impact) -> Iterator[Flag]:
    excess = impact.raw_peak_force - impact.peak_force
    least = max(0.05 * impact.peak_force, 5.0 * impact.contact.baseline_sd)
    if excess > least:
        yield Flag(Quality.RINGING, f"the largest sample of Phase I is {excess:.1f} N above the peak without noise")


def _braking(impact: Impact) -> Iterator[Flag]:
    least = max(2.0 * impact.contact.floor, 0.05 * impact.peak_force)
    if impact.contact.baseline_samples and impact.force_before > least:
        yield Flag(Quality.BRAKING_TRANSIENT, f"{impact.force_before:.1f} N before contact")


def _gap(impact: Impact) -> Iterator[Flag]:
    time, force = impact.recording.time, impact.contact.force
    first, last = time.searchsorted([impact.onset, impact.phase1_end])
    span = slice(max(int(first) - 1, 0), int(last) + 1)
    steps = np.diff(time[span])
    longest = float(steps.max()) if steps.size else 0.0
    usual = mean_interval(time)
    high = force[span] > 0.5 * impact.raw_peak_force
    at_top = steps[high[1:] | high[:-1]]
    if longest > (impact.phase1_end - impact.onset) / 8 and longest > 5.0 * usual:
        yield Flag(Quality.GAP, f"no sample for {longest:.4f} s of Phase I")
    elif at_top.size and at_top.max() > 2.5 * usual and at_top.max() > impact.phase1_width / 8:
        yield Flag(Quality.GAP, f"no sample for {at_top.max():.4f} s at the top of Phase I")
    elif impact.gap:
        yield Flag(Quality.GAP, f"no sample for {impact.gap:.4f} s after Phase I")


def _calibration(recording: Recording) -> Iterator[Flag]:
    on = recording.metadata.get("date", "")
    if on and recording.device.expired(on):
        yield Flag(Quality.CALIBRATION_EXPIRED, f"the device's calibration had expired on {on}")
