"""Find the impacts of a recording."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError
from forcemap.impacts.baseline import ContactForce, contact_force, noise_sd
from forcemap.impacts.impact import Flag, Impact, Quality
from forcemap.impacts.interference import jumps
from forcemap.impacts.measure import Start, found_start, measure
from forcemap.impacts.smooth import low_pass, moving_mean
from forcemap.recordings.recording import Recording

_RISE_TIME = 0.05  # an impact raises the force within this time [s]
_LEAST_RISE = 8.0  # by at least this much [N]
_SPIKE_TELLS = 0.03  # share of the peak that spikes may change
_APART = 0.5  # contacts further apart than this are different impacts [s]


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
    starts: list[Start] = []
    search: int | None = 0
    while search is not None and (found := _first_rise(recording, search)):
        start = found_start(found[1], search, found[0])
        if start.one.raw_force < start.contact.floor:
            break  # it rises from below zero: the sign is wrong, or the force acts across the direction
        starts.append(start)
        search = _next_search(start)
    ends = [*(start.before for start in starts), recording.samples - 1][1:]
    return [measure(recording, *each, number) for number, each in enumerate(zip(starts, ends, strict=True), 1)]


def _flag_spikes(recording: Recording, impacts: list[Impact]) -> list[Impact]:
    """The impacts, flagged if spikes make other peaks of them than the samples beside the spikes do."""
    kept, beyond = np.ones(recording.samples, dtype=np.bool_), recording.beyond_range
    spikes = []
    for spike in (jump for impact in impacts for jump in jumps(impact) if jump.samples):
        taken = slice(spike.index + 1, spike.index + 1 + spike.samples)
        if beyond is None or not beyond[taken].any():  # what is beyond the range is told by the device
            kept[taken] = False
            spikes.append(spike)
    if not spikes:
        return impacts
    columns = recording.force.reshape(recording.samples, -1).T
    force = np.column_stack([np.interp(recording.time, recording.time[kept], each[kept]) for each in columns])
    others = _impacts(dataclasses.replace(recording, force=force.reshape(recording.force.shape)))
    peaks, without = ([each.map_force for each in found] for found in (impacts, others))
    if len(peaks) == len(without) and np.allclose(peaks, without, rtol=_SPIKE_TELLS, atol=0.0):
        return impacts
    read, left = (", ".join(f"{each:.1f}" for each in forces) or "no impact" for forces in (peaks, without))
    first, samples = spikes[0], sum(spike.samples for spike in spikes)
    many = f"{samples} such sample{'s' if samples > 1 else ''} in all: interference"
    spike_at = f"{first.force:+.1f} N and back at {recording.time[first.index + 1]:.4f} s"
    flag = Flag(Quality.SPIKE, f"{spike_at}, {many}; {read} N with, {left} N without")
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
    """What to say of a recording without an impact."""
    moved, _ = _from_start(recording)
    if moved.shape[1] > 1:
        return f"no impact found: the force moves by up to {np.linalg.norm(moved, axis=1).max():.1f} N from its start"
    high, low = float(moved.max()), float(moved.min())
    sign = "; if pressing forces are negative, state sign = -1" if -low > high else ""
    return f"no impact found: the force goes from {low:.1f} to {high:.1f} N about its start{sign}"


def force_without_impact(recording: Recording) -> float:
    """How far the force goes from its start where no impact was found [N]; 0 if it stays within noise and 10 N."""
    away, quiet = _from_start(recording)
    moved = np.linalg.norm(moving_mean(away, 5), axis=1)
    return float(moved.max()) if moved.max() > max(10.0, 6.0 * float(np.std(moved[:quiet]))) else 0.0


def _from_start(recording: Recording) -> tuple[FloatArray, int]:
    """The force less its median over the first twentieth, shape (n, 1 or 3) [N]; the samples of that part."""
    force = recording.force.reshape(recording.samples, -1)
    quiet = max(len(force) // 20, 1)
    return force - np.median(force[:quiet], axis=0), quiet


def _first_rise(recording: Recording, start: int) -> tuple[int, ContactForce] | None:
    """Index of a sample in the rise of the first impact from `start` on, and the contact force; None without one.

    The steepest rise gives the baseline; an earlier excursion that clearly leaves it is the first impact.
    """
    time, force = recording.time[start:], recording.force[start:]
    if time.size < 3:
        return None
    half = int(0.001 * (time.size - 1) / (time[-1] - time[0]))
    smooth = moving_mean(force, 2 * half + 1)
    rise = smooth - smooth[time.searchsorted(time - _RISE_TIME)]
    if rise.ndim == 2:
        rise = np.sqrt(np.sum(rise * rise, axis=1))
    noise = math.hypot(*(noise_sd(column) for column in force.reshape(time.size, -1).T))
    if rise.max() < (least := max(_LEAST_RISE, 6.0 * noise)):
        return None
    first = int((rise >= max(least, 0.5 * rise.max())).argmax())
    index = start + min(first + half, time.size - 1)  # the moving mean rises that much earlier than the force
    foot = _before_contact(recording, start, index, noise)
    contact = contact_force(recording, start, foot)
    if contact.baseline_samples:
        leaves = max(2.5 * contact.floor, 0.1 * float(contact.force[start:].max()))
        out = contact.force[start:foot] > leaves
        for sooner in (np.flatnonzero(out[1:] & ~out[:-1]) + start + 1).tolist():
            shortly = contact.force[recording.time.searchsorted(recording.time[sooner] - _RISE_TIME) : sooner]
            if shortly.min() < contact.floor:  # wandering takes longer
                return sooner, contact_force(recording, start, _before_contact(recording, start, sooner, noise))
    return index, contact


def _before_contact(recording: Recording, start: int, rise: int, noise: float) -> int:
    """Index before which contact has certainly not begun: the foot of the rise, and 2 ms or 2 samples before it."""
    time, force = recording.time, recording.force
    first = max(int(time.searchsorted(time[rise] - 1.2 * _RISE_TIME)), start)
    window = moving_mean(force[first : rise + 1], 3).reshape(rise + 1 - first, -1)
    away = np.linalg.norm(window - window[-1], axis=1)  # distance from the risen force: large before contact
    near = away.max() - max(0.15 * away.max(), 4.0 * noise)
    foot = first + int(np.flatnonzero(away >= max(near, 0.5 * away.max()))[-1])
    return max(min(int(time.searchsorted(time[foot] - 0.002)), foot - 2), start)


def _next_search(start: Start) -> int | None:
    """Where to look for another impact: in the first 0.5 s without contact; None if nothing follows them."""
    time, first = start.contact.time, start.phase1_end
    acting = np.flatnonzero(start.smooth[first:] > start.contact.floor_at(time[first:])) + first
    marks = np.concatenate([[first], acting, [time.size - 1]])
    gaps = np.flatnonzero(np.diff(time[marks]) >= _APART)
    if not gaps.size or gaps[0] == marks.size - 2:
        return None
    return int(time.searchsorted(time[marks[gaps[0]]] + 0.1))


def _filtered(impact: Impact, channel_frequency_class: float) -> Impact:
    """The impact with the peak of its low-passed curve."""
    recording = impact.recording
    if not recording.regular:
        message = "a channel frequency class needs even sampling, this recording's is not; leave the class out"
        raise InputError(message, file=recording.name)
    force = low_pass(impact.contact.force, recording.sampling_rate, channel_frequency_class)
    phase1 = (impact.contact.time >= impact.onset) & (impact.contact.time <= impact.phase1_end)
    return dataclasses.replace(impact, filtered_peak_force=float(force[phase1].max()))
