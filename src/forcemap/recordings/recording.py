"""A recording: one force-time curve as measured."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.errors import RecordingError
from forcemap.recordings.device import Device

LEAST_SAMPLES = 2
"""Samples of a curve, at least: with one it has no interval."""
REGULAR = 0.01
"""Sampling is regular if every interval differs from the median by no more than this share of it; a choice."""


@dataclass(frozen=True, eq=False)
class Recording:
    """One force-time curve as measured: its offset is not taken out.

    Parameters
    ----------
    time : array, shape (n,)
        Times of the samples, strictly increasing [s].
    force : array, shape (n,) or (n, 3)
        Force, or its three components, positive into the device [N].
    direction : tuple of 3 floats, optional
        The direction onto which three components are projected, kept as a unit vector. None: one component, or the
        norm of the three, once each is free of its offset.
    device : Device
        What it was measured with.
    beyond_range : array of bool, shape (n,), optional
        Samples at which the device said that its range was exceeded: the force there is a lower bound.
    file, curve : str
        The file it was read from, and the name of the curve within it ("" if it is the only one).
    sha256 : str
        SHA-256 of the file.
    size : int
        Its size [bytes].
    notes : tuple of str
        What a reader should know of the sampling, and what was left out.
    metadata : mapping of str to str
        The lines of the file before the names of the columns.
    unit_stated : bool
        False if the file does not say the unit of the force, so that it is the one of the column map.

    Raises
    ------
    RecordingError
        Shapes that do not fit, fewer than 2 samples, values that are not finite numbers, times that do not increase,
        or a direction that is none.
    """

    time: FloatArray
    force: FloatArray
    direction: tuple[float, float, float] | None = None
    device: Device = field(default_factory=Device)
    beyond_range: Mask | None = None
    file: str = ""
    curve: str = ""
    sha256: str = ""
    size: int = 0
    notes: tuple[str, ...] = ()
    metadata: Mapping[str, str] = field(default_factory=dict)
    unit_stated: bool = True

    def __post_init__(self) -> None:
        # copies, so that nobody changes a recording from outside
        time, force = self._numbers("time", self.time), self._numbers("force", self.force)
        if time.ndim != 1 or force.shape not in ((time.size,), (time.size, 3)):
            problem = f"found time of shape {time.shape} and force of shape {force.shape}"
            raise self._error(f"{problem}, expected (n,) and (n,) or (n, 3)")
        if time.size < LEAST_SAMPLES:
            raise self._error(f"found a curve of {time.size} samples, expected at least {LEAST_SAMPLES}")
        for name, values in (("time", time), ("force", force)):
            if not np.isfinite(values).all():
                raise self._error(f"found a {name} that is not finite, expected finite numbers")
        for first in np.flatnonzero(time[1:] <= time[:-1])[:1]:
            problem = f"found time {time[first + 1]:g} s after {time[first]:g} s (samples {first + 2} and {first + 1})"
            raise self._error(f"{problem}, expected strictly increasing times")
        if self.beyond_range is not None and np.shape(self.beyond_range) != time.shape:
            raise self._error(f"found beyond_range of shape {np.shape(self.beyond_range)}, expected {time.shape}")
        direction = None if self.direction is None else self._unit_vector(force)
        for name, value in (("time", time), ("force", force), ("direction", direction), ("notes", tuple(self.notes))):
            object.__setattr__(self, name, value)

    @property
    def name(self) -> str:
        """The file, and the curve within it after a "#"."""
        return f"{self.file}#{self.curve}" if self.curve else self.file

    @property
    def simulated(self) -> bool:
        """True if a line before the names of the columns says SIMULATED, as the virtual lab writes it."""
        return any("SIMULATED" in text for entry in self.metadata.items() for text in entry)

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.time.size

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def sampling_rate(self) -> float:
        """One over the median interval between samples [Hz]."""
        return 1.0 / float(np.median(np.diff(self.time)))

    @property
    def largest_gap(self) -> float:
        """The largest interval between two samples [s]."""
        return float(np.diff(self.time).max())

    @property
    def regular(self) -> bool:
        """True if every interval lies within 1 % of the median interval."""
        intervals = np.diff(self.time)
        usual = np.median(intervals)
        return bool(np.abs(intervals - usual).max() <= REGULAR * usual)

    def _numbers(self, name: str, values: FloatArray) -> FloatArray:
        array = np.asarray(values)
        if array.dtype.kind not in "iuf" or np.ma.is_masked(values):
            raise self._error(f"found a {name} of {array.dtype.name} (or masked), expected an array of numbers")
        numbers = np.array(array, dtype=np.float64)
        numbers.setflags(write=False)
        return numbers

    def _unit_vector(self, force: FloatArray) -> tuple[float, float, float]:
        if force.ndim != 2:
            raise self._error("found a direction for a force of one component, expected it for three; leave it out")
        try:
            x, y, z = (float(component) for component in self.direction or ())
        except (TypeError, ValueError):
            raise self._error(f"found direction {self.direction!r}, expected three numbers") from None
        if not 0 < (length := math.hypot(x, y, z)) < math.inf:
            raise self._error(f"found direction {self.direction!r}, expected a vector of finite length above 0")
        return (x / length, y / length, z / length)

    def _error(self, message: str) -> RecordingError:
        return RecordingError(message, file=self.name or None)
