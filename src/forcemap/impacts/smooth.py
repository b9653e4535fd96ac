"""Smoothing that keeps the length of a curve and does not shift it."""

from __future__ import annotations

import math

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError

_CORNER_PER_CLASS = 2.0775  # corner frequency of one run over the channel frequency class (SAE J211-1, appendix C)
_PADDING = 3  # periods of the corner frequency added at either end, so that the filter has settled


def moving_mean(values: FloatArray, samples: int) -> FloatArray:
    """Centred moving mean over an odd number of samples, shape (n,) or (n, k); the window shrinks at the ends."""
    half = min(samples // 2, (values.shape[0] - 1) // 2)
    if half < 1:
        return values
    n = values.shape[0]
    total = np.zeros((n + 1, *values.shape[1:]))
    np.cumsum(values, axis=0, out=total[1:])
    smooth = np.empty_like(values)
    smooth[half : n - half] = (total[2 * half + 1 :] - total[: n - 2 * half]) / (2 * half + 1)
    widths = np.arange(1, 2 * half, 2)
    divisors = widths.reshape(widths.size, *[1] * (values.ndim - 1))
    smooth[:half] = total[widths] / divisors
    smooth[n - half :] = ((total[n] - total[n - widths]) / divisors)[::-1]
    return smooth


def mean_interval(time: FloatArray) -> float:
    """Mean sampling interval [s] of at least two time stamps."""
    return float(time[-1] - time[0]) / (time.size - 1) if time.size > 1 else 1.0


def low_pass(force: FloatArray, sampling_rate: float, channel_frequency_class: float) -> FloatArray:
    """Zero-phase low-pass of a channel frequency class (CFC), shape (n,).

    A Butterworth filter of second order run forwards and backwards, corner frequency 2.0775 x CFC in each run
    (SAE J211-1, appendix C).

    Parameters
    ----------
    force : array (n,)
        Evenly sampled.
    sampling_rate : float
        [Hz].
    channel_frequency_class : float
        60, 180, 600 or 1000 in the standard; any other positive number is accepted.

    Raises
    ------
    InputError
        The sampling rate is too low for the class.
    """
    corner = _CORNER_PER_CLASS * channel_frequency_class
    if not (channel_frequency_class > 0 and corner < sampling_rate / 2):
        needed = f"channel frequency class {channel_frequency_class:g} needs more than {2 * corner:.0f} Hz"
        raise InputError(f"{needed}, the recording has {sampling_rate:.0f} Hz; take a lower class or none")
    from scipy.signal import butter, sosfiltfilt

    sections = butter(2, corner, fs=sampling_rate, output="sos")
    padding = min(force.size - 1, math.ceil(_PADDING * sampling_rate / corner))
    return np.asarray(sosfiltfilt(sections, force, padlen=padding), dtype=np.float64)
