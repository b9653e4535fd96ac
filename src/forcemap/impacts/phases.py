"""Phases of an impact (paper, section II-A): onset, Phase I and its peak, what follows it, the contact scenario."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.impacts.impact import TRANSIENT_TIME, Impact
from forcemap.impacts.scenario import ContactScenario
from forcemap.impacts.smooth import mean_interval, moving_mean

# Choices, as docs/your_device_files.md states them; checked by tests/test_impacts.py on curves with a known truth.
GAP = 0.02  # longer without a sample while a force acts, and what the force did is unknown [s]
HOLD_WINDOW = (TRANSIENT_TIME, 0.7)  # where a clamping force is read, after onset [s]
HOLD_MIDDLE = 0.6  # of that window; a recording that ends earlier does not show whether the force is held [s]
FALL_SHARE = 0.12  # the first peak is over once the force has fallen by this share: less is ringing on the way up
_FALL_SDS, _LEAST_FALL = 5.0, 1.0  # [SD of the noise], [N]: and by no less than these
# A first guess of the peak, from a lightly smoothed curve, has to fall further; it only sets the smoothing.
_GUESS_SHARE, _GUESS_SDS, _GUESS_SAMPLES = 0.25, 8.0, 3
_RISE_SMOOTHED = 0.06  # half width of the smoothing, as a share of the rise to that peak: flattens no top
_ONSET_LEVEL = 0.3  # share of the peak up to which the rise shows its foot
_ONSET_SAMPLES = 120  # of the rise are enough for the fit of its foot
_STARTS = 24  # onsets tried at a time, twice: first over the rise, then within a step of the best
_SOFTER = 5.0  # by how many times the noise variance a soft foot must fit better than a kink
_END_WINDOWS = (0.0125, 0.004)  # at the end of a recording [s]: the end rule takes the larger mean
_END_SAMPLES = 3  # in each of them, at least
_OVER_FORCE, _OVER_SHARE = 10.0, 0.1  # [N], share of the peak: the contact is over if the larger acts at the end
_STILL_HELD = 0.5  # share of the mean force in the hold window that acts at the end if the force is held
_TOP_LEVELS = (0.75, 0.9)  # shares of the peak above which a polynomial is tried, the wider part first
_TOP_SAMPLES = 5  # at least, for a polynomial through the top
_LOWEST_DEGREE, _HIGHEST_DEGREE, _SAMPLES_A_DEGREE = 2, 4, 8  # a parabola, one degree more for every 8 samples
_MISFIT_SDS, _MISFIT_SHARE = 4.5, 0.005  # [SD of the noise], share of the peak: a polynomial follows the top so closely
_FINE_TOP, _TOP_GRID = 30, 101  # with fewer samples the polynomial is evaluated on so many points between them


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

    Its peak is the first one: a running maximum that ends once the force has fallen clearly below it, by 12 %, five
    times the noise or 1 N, whichever is most. Phase I ends where the force falls below the floor, or at the minimum
    before it rises again by as much, or where it has settled.

    Parameters
    ----------
    time, force : array (n,)
        From the onset on [s], [N].
    floor : float
        Force below which there is no contact [N].
    noise : float
        Standard deviation of the noise [N].
    """
    coarse = moving_mean(force, _GUESS_SAMPLES)
    guess = _running_peak(coarse, max(_GUESS_SDS * noise, _LEAST_FALL), _GUESS_SHARE, floor)
    span = max(time[guess] - time[0], 0.0)
    smooth = moving_mean(force, 2 * int(_RISE_SMOOTHED * span / mean_interval(time)) + 1)
    fall = max(_FALL_SDS * noise, _LEAST_FALL)
    peak = _running_peak(smooth, fall, FALL_SHARE, floor)
    end = _end_of_phase(smooth, peak, max(fall, FALL_SHARE * smooth[peak]), floor)
    raw = float(force[: end + 1].max())
    top = _read_peak(time[: end + 1], force[: end + 1], smooth[: end + 1], peak, noise)
    left, right = flanks(smooth[: end + 1], peak, 0.5 * smooth[peak])
    return PhaseOne(peak, end, top, raw, width=float(time[min(right, end)] - time[max(left, 0)]))


def onset_time(time: FloatArray, force: FloatArray, first: int, rise: int, peak_force: float, noise: float) -> float:
    """Start of contact [s]: the foot of the rise up to 30 % of the peak.

    The least-squares fit of F = a (t - t0)^p with p = 1 or 2: a rise that starts with a kink, or softly.

    Parameters
    ----------
    time, force : array (n,)
        The curve [s], [N].
    first, rise : int
        Range of samples within which contact starts.
    peak_force, noise : float
        Phase I peak, and the standard deviation of the noise [N].
    """
    risen = rise + int((force[rise:] >= _ONSET_LEVEL * peak_force).argmax())
    stop = max(risen + 1, min(first + 3, time.size))
    every = max((stop - first) // _ONSET_SAMPLES, 1)
    t, f = time[first:stop:every], force[first:stop:every]
    low, high = float(t[0]), float(t[-1])
    kink, soft = _foot(t, f, low, high, 1), _foot(t, f, low, high, 2)
    is_soft = soft[0] - kink[0] > _SOFTER * noise**2  # softer than noise makes a kink look
    start, step = (soft if is_soft else kink)[1], (high - low) / _STARTS
    return _foot(t, f, max(start - step, low), min(start + step, high), 2 if is_soft else 1)[1]


def _foot(t: FloatArray, f: FloatArray, low: float, high: float, power: int) -> tuple[float, float]:
    """The best fit of a (t - t0)^power over t0 from `low` to `high`: decrease of the sum of squares, and t0."""
    starts = low + (high - low) / _STARTS * np.arange(_STARTS)
    basis = np.maximum(t - starts[:, None], 0.0) ** power
    product = basis @ f
    norm = np.maximum(np.einsum("ij,ij->i", basis, basis), 1e-300)  # no division by zero
    gain = np.where(product > 0, product**2 / norm, 0.0)
    best = int(gain.argmax())
    return float(gain[best]), float(starts[best])


def end_level(time: FloatArray, force: FloatArray) -> float:
    """Force at the end of a curve [N]: the larger of the means over its last 12.5 ms and its last 4 ms."""
    firsts = time.searchsorted([time[-1] - window for window in _END_WINDOWS])
    latest = max(time.size - _END_SAMPLES, 0)
    return max(float(force[min(first, latest) :].mean()) for first in firsts.tolist())


def classify_contact(impact: Impact) -> ContactScenario:
    """What the force does after Phase I.

    - unconstrained: it stays below the floor f0;
    - without clamping: it is above f0 after Phase I, and below it for good before 0.5 s;
    - with clamping: its mean from 0.5 to 0.7 s is above f0, and it is not below half of that at the end;
    - undetermined: the recording does not tell. If it ends before 0.5 s, the contact counts as over if no more than
      max(10 N, 10 % of the peak) acts at its end. Nor does it tell if samples are missing for over 20 ms while a force
      acts (50 ms while none does), or if a force too small to stand out from the noise of single samples is held.

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
        over = impact.end_force <= max(_OVER_FORCE, _OVER_SHARE * impact.peak_force)
    clamps = impact.hold_force > impact.floor and impact.end_force >= _STILL_HELD * impact.hold_force
    if impact.gap > 0 or not (over or clamps):
        return ContactScenario.UNDETERMINED
    if not over:
        return ContactScenario.WITH_CLAMPING
    return ContactScenario.WITHOUT_CLAMPING if impact.acts_after_phase1 else ContactScenario.UNCONSTRAINED


def hold_force(after: FloatArray, force: FloatArray) -> float:
    """Mean force [N] from 0.5 to 0.7 s after onset; NaN if the curve ends before 0.6 s."""
    first, last = after.searchsorted(HOLD_WINDOW)
    return float(force[first:last].mean()) if after[-1] >= HOLD_MIDDLE and last > first else math.nan


def _running_peak(force: FloatArray, least_fall: float, share: float, floor: float) -> int:
    """Index of the first maximum below which the force falls by the larger of the share and `least_fall` [N]."""
    running = np.maximum.accumulate(force)
    fallen = (running - force > np.maximum(least_fall, share * running)) & (running > floor)
    stop = int(fallen.argmax()) if fallen.any() else force.size
    return int(force[:stop].argmax())  # the first has not fallen


def _end_of_phase(force: FloatArray, peak: int, rise: float, floor: float) -> int:
    """Index where Phase I ends; a force that rises again by more than `rise` [N] belongs to what follows."""
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

    A top that no polynomial follows (a spike, a flat top) is read as the largest sample.
    """
    for share in _TOP_LEVELS:
        left, right = flanks(smooth, peak, share * smooth[peak])
        t, f = time[left + 1 : right], force[left + 1 : right]
        if f.size < _TOP_SAMPLES:
            break
        t = (t - time[peak]) / (t[-1] - t[0])
        degree = min(_LOWEST_DEGREE + f.size // _SAMPLES_A_DEGREE, _HIGHEST_DEGREE)
        basis = t[:, None] ** np.arange(degree, -1, -1)
        coefficients = np.linalg.solve(basis.T @ basis, basis.T @ f)
        fitted = basis @ coefficients
        if np.abs(f - fitted).max() > max(_MISFIT_SDS * noise, _MISFIT_SHARE * smooth[peak]):
            continue
        if f.size < _FINE_TOP:
            fitted = np.polyval(coefficients, np.linspace(t[0], t[-1], _TOP_GRID))
        return float(fitted.max())
    return float(force.max())


def flanks(force: FloatArray, peak: int, level: float) -> tuple[int, int]:
    """Indices of the samples below a level next to the peak, before and after it.

    -1 and the number of samples where there is none.
    """
    low = np.flatnonzero(force < level)
    after = int(low.searchsorted(peak))
    return (int(low[after - 1]) if after else -1), (int(low[after]) if after < low.size else force.size)
