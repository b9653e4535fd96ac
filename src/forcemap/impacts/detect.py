"""Find the impacts of a recording."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from forcemap.errors import InputError
from forcemap.impacts.baseline import ContactForce, contact_force, noise_sd
from forcemap.impacts.impact import Impact
from forcemap.impacts.measure import Start, found_start, measure
from forcemap.impacts.smooth import low_pass, moving_mean
from forcemap.recordings.recording import Recording

_RISE_TIME = 0.05  # an impact raises the force within this time [s]
_LEAST_RISE = 8.0  # by at least this much [N]
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
    starts: list[Start] = []
    search: int | None = 0
    while search is not None:
        found = _first_rise(recording, search)
        if found is None:
            break
        start = found_start(found[1], search, found[0])
        if start.one.raw_force < start.contact.floor:
            break  # it rises from below zero: the sign is wrong, or the force acts across the direction
        starts.append(start)
        search = _next_search(start)
    if not starts:
        return []
    time = recording.time
    ends = [start.before for start in starts[1:]]
    impacts = [
        measure(recording, start, end, number)
        for number, (start, end) in enumerate(zip(starts, [*ends, time.size - 1], strict=True), start=1)
    ]
    if math.isnan(channel_frequency_class):
        return impacts
    return [_filtered(impact, channel_frequency_class) for impact in impacts]


def find_impact(recording: Recording, *, channel_frequency_class: float = math.nan) -> Impact:
    """The first impact of a recording; options as in `find_impacts`.

    Raises
    ------
    InputError
        No impact was found; the message says how far the force goes.
    """
    impacts = find_impacts(recording, channel_frequency_class=channel_frequency_class)
    if not impacts:
        raise InputError(no_impact(recording), file=recording.name)
    return impacts[0]


def no_impact(recording: Recording) -> str:
    """What to say of a recording without an impact."""
    force = recording.force.reshape(recording.time.size, -1)
    moved = force - np.median(force[: max(force.shape[0] // 20, 1)], axis=0)
    if moved.shape[1] == 1:
        high, low = float(moved.max()), float(moved.min())
        sign = "; if pressing forces are negative, state sign = -1" if -low > high else ""
        return f"no impact found: the force goes from {low:.1f} to {high:.1f} N about its start{sign}"
    return f"no impact found: the force moves by up to {np.linalg.norm(moved, axis=1).max():.1f} N from its start"


def force_without_impact(recording: Recording) -> float:
    """How far the force goes from its start where no impact was found [N]; 0 if it stays within noise and 10 N."""
    force = recording.force.reshape(recording.time.size, -1)
    quiet = max(force.shape[0] // 20, 1)
    moved = np.linalg.norm(moving_mean(force - np.median(force[:quiet], axis=0), 5), axis=1)
    largest = float(moved.max())
    return largest if largest > max(10.0, 6.0 * float(np.std(moved[:quiet]))) else 0.0


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
    least = max(_LEAST_RISE, 6.0 * noise)
    top = float(rise.max())
    if top < least:
        return None
    first = int((rise >= max(least, 0.5 * top)).argmax())
    index = start + min(first + half, time.size - 1)  # the moving mean rises that much earlier than the force
    foot = _before_contact(recording, start, index, noise)
    contact = contact_force(recording, start, foot)
    if contact.baseline_samples:
        leaves = max(2.5 * contact.floor, 0.1 * float(contact.force[start:].max()))
        out = contact.force[start:foot] > leaves
        for sooner in (np.flatnonzero(out[1:] & ~out[:-1]) + start + 1).tolist():
            shortly = contact.force[recording.time.searchsorted(recording.time[sooner] - _RISE_TIME) : sooner]
            before = _before_contact(recording, start, sooner, noise)
            if shortly.min() < contact.floor:  # wandering takes longer
                return sooner, contact_force(recording, start, before)
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
        raise InputError(
            "a channel frequency class needs even sampling, this recording's is not; leave the class out",
            file=recording.name,
        )
    force = low_pass(impact.contact.force, recording.sampling_rate, channel_frequency_class)
    phase1 = (impact.contact.time >= impact.onset) & (impact.contact.time <= impact.phase1_end)
    return dataclasses.replace(impact, filtered_peak_force=float(force[phase1].max()))
