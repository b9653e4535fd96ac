"""What a measuring device reads of a force, and the file it writes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.device import Device
from forcemap.recordings.units import TimeUnit

COLUMNS = ColumnMap(time="time_ms", time_unit=TimeUnit.MILLISECONDS, force="force_N")
"""How the files are written, as [recordings] of campaign.toml states it."""

PAPER_DEVICE = Device(range=500.0, error=3.0, stiffness=75_000.0, model="CBSF-75-Basic, simulated")
"""The paper's device (section IV-B)."""

_SCALE_SHARE = 0.5  # of the device's error that is spent on the scale: a choice


@dataclass(frozen=True, kw_only=True)
class SimulatedDevice:
    """A force measuring device: its spring, its range, and how its readings differ from the force.

    Rate, times, noise, offset, drift and resolution are choices if not given.

    Parameters
    ----------
    device : Device
        Range, error and stiffness, all stated. Half of the error is spent on the scale: a device reads all forces too
        high or too low by one share; offset, drift and noise are the rest.
    sampling_rate : float
        Samples per second [Hz].
    before, after : float
        Recorded before and after first contact [s].
    noise : float
        Standard deviation of the noise of a sample [N].
    offset, drift : float
        Largest offset [N] and largest drift [N/s] of a recording.
    resolution : float
        Step of the readings [N].

    Raises
    ------
    InputError
        Range, error or stiffness not stated, or a figure outside its range.
    """

    device: Device = PAPER_DEVICE
    sampling_rate: float = 1000.0
    before: float = 0.1
    after: float = 0.8
    noise: float = 0.4
    offset: float = 3.0
    drift: float = 1.0
    resolution: float = 0.1

    def __post_init__(self) -> None:
        for name in ("range", "error", "stiffness"):
            if math.isnan(getattr(self.device, name)):
                raise InputError(f"device {name}: not stated, expected a number to simulate readings with")
        for name, value in list(vars(self).items())[1:]:
            least = "of at least 0" if name in ("noise", "offset", "drift") else "above 0"
            if not 0 <= value < math.inf or (value == 0 and least == "above 0"):
                raise InputError(f"{name.replace('_', ' ')}: found {value:g}, expected a finite number {least}")

    def scale(self, rng: np.random.Generator) -> float:
        """Reading over force of one such device."""
        return float(1 + rng.uniform(-1, 1) * _SCALE_SHARE * self.device.error / self.device.range)

    def readings(self, course: FloatArray, step: float, scale: float, rng: np.random.Generator) -> FloatArray:
        """Its readings of impacts, shape (samples, batch) [N]; sampling is not synchronised with the contact.

        Parameters
        ----------
        course : array, shape (times, batch)
            Force from first contact on [N], a row every step.
        step : float
            Time between the rows [s].
        scale : float
            Reading over force.
        rng : numpy.random.Generator
            Source of offsets, drifts and noise.
        """
        batch = course.shape[1]
        time = self.times()[:, None]
        row = np.clip((time - self.before - rng.uniform(0, 1 / self.sampling_rate, batch)) / step, 0, len(course) - 1)
        lower = np.minimum(row.astype(np.intp), len(course) - 2)
        impact = np.arange(batch)
        low, high = course[lower, impact], course[lower + 1, impact]
        read = scale * (low + (high - low) * (row - lower)) + rng.uniform(-1, 1, batch) * self.offset
        read += rng.uniform(-1, 1, batch) * self.drift * time + rng.normal(0, self.noise, read.shape)
        limited = np.clip(read, -self.device.range, self.device.range)
        return np.asarray(np.round(limited / self.resolution) * self.resolution)

    def times(self) -> FloatArray:
        """Times of the samples [s]."""
        return np.arange(round((self.before + self.after) * self.sampling_rate)) / self.sampling_rate


def recording_text(time: FloatArray, readings: FloatArray, origin: str) -> str:
    """Text of the file of one recording, shape (samples,); its first line says that it was simulated, and how."""
    rows = zip((1000 * time).tolist(), readings.tolist(), strict=True)
    return f"{origin}\ntime_ms,force_N\n" + "".join([f"{t:.3f},{force:.2f}\n" for t, force in rows])
