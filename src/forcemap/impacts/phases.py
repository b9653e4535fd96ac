"""Phases of an impact (paper, section II-A): onset, Phase I and its peak, what follows it, the contact scenario."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.impacts.impact import TRANSIENT_TIME, Impact
from forcemap.impacts.scenario import ContactScenario
from forcemap.impacts.smooth import mean_interval, moving_mean

GAP = 0.02  # without a sample for longer while a force acts, nobody knows what it did [s]
END_WINDOW = 0.0125  # the end rule looks at the last 10 to 15 ms of a recording [s]
HOLD_WINDOW = (0.5, 0.7)  # where a clamping force is read, after onset [s]
_STARTS = 24  # onsets that are tried at a time
_SOFTER = 5.0  # by how many times the noise variance a soft foot must fit better than a kink
_LEAST_HOLD = 0.6  # a recording that ends earlier does not show whether the force is held [s]


@dataclass(frozen=True)
class PhaseOne:
    """Phase I by index into the curve, and its peak."""

    peak: int
    end: int
    force: float
    raw_force: float
    width: float


def first_peak(time: FloatArray, force: FloatArray, floor: float, noise: float) -> PhaseOne:
    """Phase I of a curve that starts at the onset of contact, shape (n,).

    Its peak is the first one: a running maximum that ends once the force has fallen clearly below it, by 12 % or five
    times the noise. Phase I ends where the force falls below the floor, or at the minimum before it rises again as
    clearly, or where it has settled.

    Parameters
    ----------
    time, force : array (n,)
        From the onset on [s], [N].
    floor : float
        Force below which there is no contact [N].
    noise : float
        Standard deviation of the noise [N].
    """
    coarse = moving_mean(force, 3)
    guess = _running_peak(coarse, max(8.0 * noise, 1.0), 0.25, floor)
    span = max(time[guess] - time[0], 0.0)
    smooth = moving_mean(force, 2 * int(0.06 * span / mean_interval(time)) + 1)
    fall = max(5.0 * noise, 1.0)
    peak = _running_peak(smooth, fall, 0.12, floor)
    end = _end_of_phase(smooth, peak, max(fall, 0.12 * smooth[peak]), floor)
    raw = float(force[: end + 1].max())
    top = _read_peak(time[: end + 1], force[: end + 1], smooth[: end + 1], peak, noise)
    left, right = flanks(smooth[: end + 1], peak, 0.5 * smooth[peak])
    return PhaseOne(peak, end, top, raw, width=float(time[min(right, end)] - time[max(left, 0)]))


def onset_time(time: FloatArray, force: FloatArray, first: int, rise: int, peak_force: float, noise: float) -> float:
    """Start of contact [s]: the foot of the rise up to 30 % of the peak.

    Of all F = a (t - t0)^p with p = 1 or 2 (a rise that starts with a kink, or softly) the one nearest to the samples.

    Parameters
    ----------
    time, force : array (n,)
        The curve [s], [N].
    first, rise : int
        Range of samples within which contact starts.
    peak_force, noise : float
        Phase I peak, and the standard deviation of the noise [N].
    """
    risen = rise + int((force[rise:] >= 0.3 * peak_force).argmax())
    stop = max(risen + 1, min(first + 3, time.size))
    thin = max((stop - first) // 120, 1)  # more samples than that tell no more
    t, f = time[first:stop:thin], force[first:stop:thin]
    low, high = float(t[0]), float(t[-1])
    kink, soft = _foot(t, f, low, high, 1), _foot(t, f, low, high, 2)
    power = 2 if soft[0] - kink[0] > _SOFTER * noise**2 else 1  # softer than noise makes a kink look
    start, step = (soft if power == 2 else kink)[1], (high - low) / _STARTS
    return _foot(t, f, max(start - step, low), min(start + step, high), power)[1]


def _foot(t: FloatArray, f: FloatArray, low: float, high: float, power: int) -> tuple[float, float]:
    """Of starts t0 from `low` to `high` that at which a (t - t0)^power fits best, after its gain in squares."""
    tried = low + (high - low) / _STARTS * np.arange(_STARTS)
    basis = np.maximum(t - tried[:, None], 0.0) ** power
    product = basis @ f
    gain = np.where(product > 0, product**2 / np.maximum(np.einsum("ij,ij->i", basis, basis), 1e-300), 0.0)
    k = int(gain.argmax())
    return float(gain[k]), float(tried[k])


def end_level(time: FloatArray, force: FloatArray) -> float:
    """Force at the end of a curve [N]: the larger of the means over its last 12.5 ms and its last 4 ms."""
    firsts = time.searchsorted([time[-1] - END_WINDOW, time[-1] - 0.004])
    return max(float(force[min(first, max(time.size - 3, 0)) :].mean()) for first in firsts.tolist())


def classify_contact(impact: Impact) -> ContactScenario:
    """What the force does after Phase I.

    - unconstrained: it stays below the floor f0;
    - without clamping: it is above f0 after Phase I, and below it for good before 0.5 s;
    - with clamping: its mean from 0.5 to 0.7 s is above f0, and it is not below half of that at the end;
    - undetermined: the recording does not tell. If it ends before 0.5 s, the contact counts as over if no more than
      max(10 N, 10 % of the peak) acts at its end. Nor does it tell if samples are missing for over 20 ms while a force
      acts (50 ms while none does), or if a small force, hidden by noise in each sample, is held.

    Parameters
    ----------
    impact : Impact

    Returns
    -------
    ContactScenario
    """
    over = impact.contact_over and impact.contact_duration < TRANSIENT_TIME
    over = over and not impact.hold_force > impact.hold_floor
    if impact.recorded_time < TRANSIENT_TIME:
        over = impact.end_force <= max(10.0, 0.1 * impact.peak_force)
    held = impact.hold_force > impact.floor and impact.end_force >= 0.5 * impact.hold_force
    if impact.gap > 0 or not (over or held):
        return ContactScenario.UNDETERMINED
    if not over:
        return ContactScenario.WITH_CLAMPING
    return ContactScenario.WITHOUT_CLAMPING if impact.acts_after_phase1 else ContactScenario.UNCONSTRAINED


def hold_force(after: FloatArray, force: FloatArray) -> float:
    """Mean force [N] from 0.5 to 0.7 s after onset; NaN if the curve ends before 0.6 s."""
    first, last = after.searchsorted(HOLD_WINDOW)
    return float(force[first:last].mean()) if after[-1] >= _LEAST_HOLD and last > first else math.nan


def _running_peak(force: FloatArray, least_fall: float, share: float, floor: float) -> int:
    """Index of the running maximum once the force has fallen below it by the share or `least_fall`, the larger."""
    running = np.maximum.accumulate(force)
    fallen = (running - force > np.maximum(least_fall, share * running)) & (running > floor)
    stop = int(fallen.argmax()) if fallen.any() else force.size
    return int(force[: max(stop, 1)].argmax())


def _end_of_phase(force: FloatArray, peak: int, rise: float, floor: float) -> int:
    """Index where Phase I ends."""
    after = force[peak:]
    below = after < floor
    stop = int(below.argmax()) if below.any() else after.size - 1
    lowest = np.minimum.accumulate(after[: stop + 1])
    risen = after[: stop + 1] - lowest > rise
    if risen.any():  # the minimum before it rises again
        return peak + int(after[: int(risen.argmax())].argmin())
    return peak + (stop if below.any() else int((after <= after.min() + rise).argmax()))  # settled


def _read_peak(time: FloatArray, force: FloatArray, smooth: FloatArray, peak: int, noise: float) -> float:
    """The peak read from the raw samples: the largest value of a polynomial through the top of Phase I.

    A top that a polynomial does not follow (a spike, a flat top) is read as the largest sample.
    """
    for share in (0.75, 0.9):
        left, right = flanks(smooth, peak, share * smooth[peak])
        t, f = time[left + 1 : right], force[left + 1 : right]
        if f.size < 5:
            break
        t = (t - time[peak]) / (t[-1] - t[0])
        basis = t[:, None] ** np.arange(min(2 + f.size // 8, 4), -1, -1)
        coefficients = np.linalg.solve(basis.T @ basis, basis.T @ f)
        fitted = basis @ coefficients
        if np.abs(f - fitted).max() <= max(4.5 * noise, 0.005 * smooth[peak]):
            return float((np.polyval(coefficients, np.linspace(t[0], t[-1], 101)) if f.size < 30 else fitted).max())
    return float(force.max())


def flanks(force: FloatArray, peak: int, level: float) -> tuple[int, int]:
    """The samples below a level next to the peak, before and after it; -1 and the number of samples without one."""
    low = np.flatnonzero(force < level)
    after = int(low.searchsorted(peak))
    return (int(low[after - 1]) if after else -1), (int(low[after]) if after < low.size else force.size)
