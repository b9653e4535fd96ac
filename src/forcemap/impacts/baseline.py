"""Contact force: what was recorded less the baseline (offset and slow drift), positive into the device."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Mask, columns
from forcemap.recordings.recording import Recording

# Choices, as docs/your_device_files.md states them; checked by tests/test_impacts.py on curves with a known truth.
_LEAST_SAMPLES = 6  # of a baseline: two for the line, the others for its scatter
_LEAST_DURATION = 0.010  # of a baseline [s]
# Standard deviation of the drift that is expected before anything is measured [N/s]: amplifiers of force measuring
# devices wander by some newtons per second. Where a baseline is too short to show its drift, this uncertainty stays.
_DRIFT_SD = 3.0
_DRIFT_SDS = 2.0  # uncertainties of the drift that are allowed for
_LEAST_FLOOR = 5.0  # [N], however quiet the device is
_FLOOR_SDS = 4.0  # of the noise: one sample in 30,000 of a quiet device lies above the floor
_MEAN_FLOOR_SDS = 2.0  # the same for a mean of many samples, which scatters less than one of them
_QUIET_FORCE, _QUIET_SDS = 3.0, 4.0  # [N], [SD]: a sample no further than the larger from the baseline is quiet
_QUIET_ROUNDS = 3  # of leaving out what is not quiet
_STEPPED_SHARE = 0.5  # of the samples repeat the one before: the steps of the readings hide the noise
_LEAST_NOISE_SAMPLES = 5  # three second differences, so that their median is not one of two
_SD_PER_MEDIAN = 1.4826  # of normal noise: standard deviation over median of the absolute values


@dataclass(frozen=True, eq=False)
class ContactForce:
    """The force between robot and device over time.

    Parameters
    ----------
    time : array (n,)
        Time as recorded [s].
    force : array (n,)
        Contact force [N]: baseline removed (of three components each its own, then the norm or projection).
    baseline_samples : int
        Quiet samples before contact that the baseline rests on; 0 if there are too few, then nothing was removed.
    baseline_level : float
        What was taken off at the end of the baseline [N]; of three components the norm.
    baseline_sd : float
        Standard deviation of the contact force over the baseline [N]; of the noise if there is no baseline.
    baseline_start, baseline_end : float
        Time of the first and last quiet sample [s]; NaN without a baseline.
    unquiet : float
        Share of the samples before contact that are not quiet and were left out.
    drift : float
        Drift of the baseline that was removed [N/s], the norm of three components.
    drift_sd : float
        Standard uncertainty of that drift [N/s].
    """

    time: FloatArray
    force: FloatArray
    baseline_samples: int
    baseline_level: float
    baseline_sd: float
    baseline_start: float
    baseline_end: float
    unquiet: float
    drift: float
    drift_sd: float

    @property
    def floor(self) -> float:
        """Force below which there is no contact: f0 = max(5 N, 4 x baseline SD) [N]."""
        return max(_LEAST_FLOOR, _FLOOR_SDS * self.baseline_sd)

    def drift_allowance(self, time: FloatArray) -> FloatArray:
        """Force [N] that drift may simulate at `time` [s]: twice the uncertainty of the removed drift."""
        anchor = self.time[0] if math.isnan(self.baseline_end) else (self.baseline_start + self.baseline_end) / 2
        return _DRIFT_SDS * self.drift_sd * np.maximum(time - anchor, 0.0)

    def floor_at(self, time: FloatArray) -> FloatArray:
        """The floor at `time` [s], including the force that drift may simulate [N]."""
        return self.floor + self.drift_allowance(time)

    def mean_floor_at(self, time: FloatArray) -> FloatArray:
        """The floor for the mean of many samples, with half the allowance for noise [N]."""
        return max(_LEAST_FLOOR, _MEAN_FLOOR_SDS * self.baseline_sd) + self.drift_allowance(time)


def contact_force(recording: Recording, start: int, end: int) -> ContactForce:
    """Contact force of a recording whose samples from `start` up to `end` lie before contact.

    The baseline is a line through the quiet ones of these samples. Its slope is shrunk towards zero, the more so the
    less the samples determine it: b = b_ls p^2 / (p^2 + s^2), with s the standard error of the least-squares slope
    b_ls and p = 3 N/s the standard deviation of the drift expected beforehand.

    Parameters
    ----------
    recording : Recording
    start, end : int
        First sample before contact, and the first that may lie in it.

    Returns
    -------
    ContactForce
    """
    time = recording.time
    components = columns(recording.force)
    before = slice(start, end)
    if end - start < _LEAST_SAMPLES or time[end - 1] - time[start] < _LEAST_DURATION:
        force = _combined(components, recording.direction, 0.0)
        return ContactForce(time, force, 0, 0.0, noise_sd(force), math.nan, math.nan, 0.0, 0.0, _DRIFT_SD)

    lines = [_quiet_line(time[before], axis[before], _hidden_step(axis[start:], end - start)) for axis in components.T]
    quiet = np.logical_and.reduce([line.quiet for line in lines])
    residual = np.column_stack([line.residual(time, axis) for line, axis in zip(lines, components.T, strict=True)])
    spread = residual[before][quiet]
    # The norm of noise is not zero: its mean square is taken off the square of the norm.
    power = float(np.sum(spread * spread)) / spread.shape[0]
    along = spread if recording.direction is None else spread @ np.asarray(recording.direction)
    times = time[before][quiet]
    return ContactForce(
        time=time,
        force=_combined(residual, recording.direction, power),
        baseline_samples=spread.shape[0],
        baseline_level=math.hypot(*(line.level + line.slope * float(times[-1] - line.middle) for line in lines)),
        baseline_sd=math.sqrt(float(np.sum(along * along)) / max(spread.shape[0] - 2, 1)),
        baseline_start=float(times[0]),
        baseline_end=float(times[-1]),
        unquiet=1.0 - spread.shape[0] / quiet.size,
        drift=math.hypot(*(line.slope for line in lines)) if len(lines) > 1 else lines[0].slope,
        drift_sd=math.hypot(*(line.slope_sd for line in lines)),
    )


def _hidden_step(force: FloatArray, quiet: int) -> float:
    """The step of the readings [N] if it hides the noise of the first `quiet` samples, else 0."""
    if np.count_nonzero(force[1:quiet] == force[: quiet - 1]) < _STEPPED_SHARE * quiet:
        return 0.0
    steps = np.abs(np.diff(force))
    return float(steps[steps > 0].min()) if steps.any() else 0.0


def noise_sd(force: FloatArray) -> float:
    """Standard deviation of white noise on a curve [N], from the median of its second differences."""
    if force.size < _LEAST_NOISE_SAMPLES:
        return 0.0
    bends = np.abs(force[2:] - 2.0 * force[1:-1] + force[:-2])
    middle = bends.size // 2
    return float(np.partition(bends, middle)[middle]) * _SD_PER_MEDIAN / math.sqrt(6.0)  # 6 = 1^2 + 2^2 + 1^2


def _combined(components: FloatArray, direction: tuple[float, float, float] | None, power: float) -> FloatArray:
    """One force from its components, shape (n, 1) or (n, 3); `power` is the mean square of their noise."""
    if components.shape[1] == 1:
        return np.ascontiguousarray(components[:, 0])
    if direction is not None:
        return np.asarray(components @ np.asarray(direction))
    return np.asarray(np.sqrt(np.maximum(np.sum(components**2, axis=1) - power, 0.0)))


@dataclass(frozen=True, eq=False)
class _Line:
    """A line through the quiet samples: mean time [s], force there [N], slope and its uncertainty [N/s]."""

    middle: float
    level: float
    slope: float
    slope_sd: float
    quiet: Mask

    def residual(self, time: FloatArray, force: FloatArray) -> FloatArray:
        return force - self.level - self.slope * (time - self.middle)


def _quiet_line(time: FloatArray, force: FloatArray, resolution: float) -> _Line:
    """A line through the samples, leaving out those further from it than max(3 N, 4 SD), in up to three rounds.

    Readings in steps of `resolution` [N] hide a slope of up to one step over the whole time.
    """
    quiet = np.ones(time.size, dtype=np.bool_)
    line = _line(time, force, quiet, resolution)
    for _ in range(_QUIET_ROUNDS):
        if (residual := np.abs(line.residual(time, force))).max() <= _QUIET_FORCE:
            break
        if quiet.all():  # first from the median, which samples that are not quiet do not pull away
            residual = np.abs(force - np.median(force))
        near = residual <= max(_QUIET_FORCE, _QUIET_SDS * _SD_PER_MEDIAN * float(np.median(residual)))
        if near.sum() < _LEAST_SAMPLES or (near == quiet).all():
            break
        quiet, line = near, _line(time, force, near, resolution)
    return line


def _line(time: FloatArray, force: FloatArray, quiet: Mask, resolution: float) -> _Line:
    """The least-squares line through the quiet samples, its slope shrunk towards zero as `contact_force` says."""
    t, f = time[quiet], force[quiet]
    middle, level = float(t.mean()), float(f.mean())
    lever = t - middle
    moment = float(lever @ lever)
    slope = float(lever @ f) / moment
    scatter = f - level - slope * lever
    error = math.sqrt(float(scatter @ scatter) / (t.size - 2) / moment) + resolution / (t[-1] - t[0])
    trust = _DRIFT_SD**2 / (_DRIFT_SD**2 + error**2)
    return _Line(middle, level, slope * trust, error * math.sqrt(trust), quiet)
