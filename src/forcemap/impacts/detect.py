"""Find the impacts of a recording."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from forcemap.arrays import FloatArray, columns
from forcemap.errors import InputError
from forcemap.impacts.baseline import ContactForce, contact_force, noise_sd
from forcemap.impacts.impact import TRANSIENT_TIME, Flag, Impact, Quality
from forcemap.impacts.interference import find_jumps
from forcemap.impacts.measure import ImpactStart, impact_start, measure
from forcemap.impacts.smooth import low_pass, moving_mean
from forcemap.recordings.recording import Recording

# Choices, most of them stated in docs/your_device_files.md; checked by tests/test_impacts.py on curves of known truth.
_RISE_TIME = 0.05  # an impact raises the force within this time [s]
_LEAST_RISE, _RISE_SDS = 8.0, 6.0  # by at least so much [N], and so many standard deviations of the noise
_RISE_SMOOTHED = 0.001  # half width of the mean over which the rise is read [s]
_LEAST_RISE_SAMPLES = 3  # to see a rise in
_FIRST_SHARE = 0.5  # of the steepest rise: the first rise by as much is the impact's ...
_EARLIER_FLOORS, _EARLIER_SHARE = 2.5, 0.1  # ... unless the force left the baseline by more of both before
_FOOT_TIME = 1.2  # rise times before the rise within which its foot is sought
_FOOT_SHARE, _FOOT_SDS, _FOOT_LEAST = 0.15, 4.0, 0.5  # the foot: within 15 % or 4 SD of the start, at most half way up
_FOOT_SAMPLES = 3  # averaged to see the foot
_CLEAR_TIME, _CLEAR_SAMPLES = 0.002, 2  # before the foot [s]: what lies earlier is certainly no contact
_SPIKE_SHARE = 0.03  # spikes that change no peak by more are not worth a flag
_APART = TRANSIENT_TIME  # contacts further apart than this are different impacts [s]
_AFTER_CONTACT = 0.1  # so long after a contact the search for another impact begins: a choice, within `_APART` [s]
_REST_PART = 20  # a recording without an impact is at rest over its first twentieth
_FORCE_WITHOUT, _FORCE_WITHOUT_SDS, _FORCE_SAMPLES = 10.0, 6.0, 5  # [N], [SD], samples averaged: more is no noise


def find_impacts(recording: Recording, *, channel_frequency_class: float = math.nan) -> list[Impact]:
    """Find the impacts of a recording, in order of time.

    An impact begins where the force rises clearly within 50 ms above what it was before; contacts less than 0.5 s
    apart are one impact with bounces.

    Parameters
    ----------
    recording : Recording
    channel_frequency_class : float, optional
        Also read the peak of the curve after a zero-phase low-pass of this class; the raw curve stays.

    Returns
    -------
    list of Impact
        Empty if the force never rises clearly.

    Raises
    ------
    InputError
        A channel frequency class that the recording's sampling does not allow.
    """
    impacts = _flag_spikes(recording, _impacts(recording))
    filtered = not math.isnan(channel_frequency_class)
    return [_filtered(impact, channel_frequency_class) for impact in impacts] if filtered else impacts


def _impacts(recording: Recording) -> list[Impact]:
    starts: list[ImpactStart] = []
    search: int | None = 0
    while search is not None and (first_rise := _first_rise(recording, search)):
        rise, contact = first_rise
        start = impact_start(contact, search, rise)
        if start.phase1.raw_force < start.contact.floor:
            break  # it rises from below zero: the sign is wrong, or the force acts across the direction
        starts.append(start)
        search = _next_search(start)
    ends = [*(start.last_before for start in starts), recording.samples - 1][1:]
    spans = enumerate(zip(starts, ends, strict=True), 1)
    return [measure(recording, start, end, number) for number, (start, end) in spans]


def _flag_spikes(recording: Recording, impacts: list[Impact]) -> list[Impact]:
    """The impacts, flagged if their peaks are others once spikes are replaced by a line between the samples beside."""
    genuine, beyond = np.ones(recording.samples, dtype=np.bool_), recording.beyond_range
    spikes = []
    for spike in (jump for impact in impacts for jump in find_jumps(impact) if jump.samples):
        span = slice(spike.index + 1, spike.index + 1 + spike.samples)
        if beyond is None or not beyond[span].any():  # the device itself marks what is beyond its range
            genuine[span] = False
            spikes.append(spike)
    if not spikes:
        return impacts
    time, columns_of_force = recording.time, columns(recording.force).T
    force = np.column_stack([np.interp(time, time[genuine], column[genuine]) for column in columns_of_force])
    others = _impacts(dataclasses.replace(recording, force=force.reshape(recording.force.shape)))
    with_spikes, without = [impact.map_force for impact in impacts], [impact.map_force for impact in others]
    if len(with_spikes) == len(without) and np.allclose(with_spikes, without, rtol=_SPIKE_SHARE, atol=0.0):
        return impacts
    read, left = (", ".join(f"{peak:.1f}" for peak in peaks) or "no impact" for peaks in (with_spikes, without))
    first, samples = spikes[0], sum(spike.samples for spike in spikes)
    many = f"{samples} such sample{'s' if samples > 1 else ''} in all: interference"
    there_and_back = f"{first.force:+.1f} N and back at {time[first.index + 1]:.4f} s"
    flag = Flag(Quality.SPIKE, f"{there_and_back}, {many}; {read} N with, {left} N without")
    return [dataclasses.replace(impact, flags=(flag, *impact.flags)) for impact in impacts]


def find_impact(recording: Recording, *, channel_frequency_class: float = math.nan) -> Impact:
    """The first impact of a recording; options as in `find_impacts`.

    Raises
    ------
    InputError
        No impact was found; the message says how far the force goes.
    """
    if not (impacts := find_impacts(recording, channel_frequency_class=channel_frequency_class)):
        raise InputError(no_impact(recording), file=recording.name)
    return impacts[0]


def no_impact(recording: Recording) -> str:
    """The message about a recording without an impact."""
    moved, _ = _from_rest(recording)
    if moved.shape[1] > 1:
        return f"no impact found: the force moves by up to {np.linalg.norm(moved, axis=1).max():.1f} N from its start"
    high, low = float(moved.max()), float(moved.min())
    sign = "; if pressing forces are negative, state sign = -1" if -low > high else ""
    return f"no impact found: the force goes from {low:.1f} to {high:.1f} N about its start{sign}"


def force_without_impact(recording: Recording) -> float:
    """How far the force moves from its start where no impact was found [N]; 0 if by no more than 10 N or noise."""
    away, quiet = _from_rest(recording)
    moved = np.linalg.norm(moving_mean(away, _FORCE_SAMPLES), axis=1)
    noise = float(np.std(moved[:quiet]))
    return float(moved.max()) if moved.max() > max(_FORCE_WITHOUT, _FORCE_WITHOUT_SDS * noise) else 0.0


def _from_rest(recording: Recording) -> tuple[FloatArray, int]:
    """The force less its median over the first twentieth, shape (n, 1 or 3) [N]; the samples of that part."""
    force = columns(recording.force)
    quiet = max(len(force) // _REST_PART, 1)
    return force - np.median(force[:quiet], axis=0), quiet


def _first_rise(recording: Recording, start: int) -> tuple[int, ContactForce] | None:
    """Index of a sample in the rise of the first impact from `start` on, and the contact force; None without one.

    The steepest rise gives the baseline; if the force clearly leaves it earlier, that is the first impact.
    """
    time, force = recording.time[start:], recording.force[start:]
    if time.size < _LEAST_RISE_SAMPLES:
        return None
    half = int(_RISE_SMOOTHED * (time.size - 1) / (time[-1] - time[0]))
    smooth = moving_mean(force, 2 * half + 1)
    rise = smooth - smooth[time.searchsorted(time - _RISE_TIME)]
    if rise.ndim == 2:
        rise = np.sqrt(np.sum(rise * rise, axis=1))
    noise = math.hypot(*(noise_sd(column) for column in columns(force).T))
    if rise.max() < (least := max(_LEAST_RISE, _RISE_SDS * noise)):
        return None
    first = int((rise >= max(least, _FIRST_SHARE * rise.max())).argmax())
    index = start + min(first + half, time.size - 1)  # the moving mean rises that much earlier than the force
    foot = _before_contact(recording, start, index, noise)
    contact = contact_force(recording, start, foot)
    if contact.baseline_samples:
        least = max(_EARLIER_FLOORS * contact.floor, _EARLIER_SHARE * float(contact.force[start:].max()))
        out = contact.force[start:foot] > least
        for earlier in (np.flatnonzero(out[1:] & ~out[:-1]) + start + 1).tolist():
            shortly_before = int(recording.time.searchsorted(recording.time[earlier] - _RISE_TIME))
            if (
                contact.force[min(shortly_before, earlier - 1) : earlier].min() < contact.floor
            ):  # wandering takes longer
                return earlier, contact_force(recording, start, _before_contact(recording, start, earlier, noise))
    return index, contact


def _before_contact(recording: Recording, start: int, rise: int, noise: float) -> int:
    """Index before which contact has certainly not begun: the foot of the rise, and 2 ms or 2 samples before it."""
    time, force = recording.time, recording.force
    first = max(int(time.searchsorted(time[rise] - _FOOT_TIME * _RISE_TIME)), start)
    window = columns(moving_mean(force[first : rise + 1], _FOOT_SAMPLES))
    away = np.linalg.norm(window - window[-1], axis=1)  # distance from the risen force: large before contact
    near = away.max() - max(_FOOT_SHARE * away.max(), _FOOT_SDS * noise)
    foot = first + int(np.flatnonzero(away >= max(near, _FOOT_LEAST * away.max()))[-1])
    return max(min(int(time.searchsorted(time[foot] - _CLEAR_TIME)), foot - _CLEAR_SAMPLES), start)


def _next_search(start: ImpactStart) -> int | None:
    """Index from which to look for another impact: in the first 0.5 s without contact; None if nothing follows."""
    time, first = start.contact.time, start.phase1_end
    acting = np.flatnonzero(start.smooth[first:] > start.contact.floor_at(time[first:])) + first
    marks = np.concatenate([[first], acting])
    gaps = np.flatnonzero(np.diff(time[marks]) >= _APART)
    if not gaps.size:
        return None
    return int(time.searchsorted(time[marks[gaps[0]]] + _AFTER_CONTACT))


def _filtered(impact: Impact, channel_frequency_class: float) -> Impact:
    """The impact with the peak of its low-passed curve."""
    recording = impact.recording
    if not recording.regular:
        message = "a channel frequency class needs even sampling, this recording's is not; leave the class out"
        raise InputError(message, file=recording.name)
    force = low_pass(impact.contact.force, recording.sampling_rate, channel_frequency_class)
    phase1 = (impact.contact.time >= impact.onset) & (impact.contact.time <= impact.phase1_end)
    return dataclasses.replace(impact, filtered_peak_force=float(force[phase1].max()))
