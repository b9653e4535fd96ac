"""Contact force: what was recorded less the baseline (offset and slow drift), positive into the device."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.recordings.recording import Recording

LEAST_SAMPLES = 6  # of a baseline
LEAST_DURATION = 0.010  # of a baseline [s]
# Drift to reckon with before anything is measured [N/s], standard deviation: amplifiers of force measuring devices
# wander by some newtons per second; what a short baseline cannot tell stays an uncertainty of this size.
_DRIFT_SD = 3.0


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
        return max(5.0, 4.0 * self.baseline_sd)

    def drift_allowance(self, time: FloatArray) -> FloatArray:
        """Force [N] at `time` [s] that drift may feign: twice the uncertainty of the removed drift."""
        anchor = self.time[0] if math.isnan(self.baseline_end) else (self.baseline_start + self.baseline_end) / 2
        return 2.0 * self.drift_sd * np.maximum(time - anchor, 0.0)

    def floor_at(self, time: FloatArray) -> FloatArray:
        """The floor at `time` [s], with the force that drift may feign [N]."""
        return self.floor + self.drift_allowance(time)

    def mean_floor_at(self, time: FloatArray) -> FloatArray:
        """The floor for the mean of many samples, in which noise of one sample counts for half [N]."""
        return max(5.0, 2.0 * self.baseline_sd) + self.drift_allowance(time)


def contact_force(recording: Recording, start: int, end: int) -> ContactForce:
    """Contact force of a recording whose samples from `start` up to `end` lie before contact.

    The baseline is a line through the quiet ones of these samples. Its slope is shrunk towards zero as far as the
    samples cannot tell it: b = b_ls p^2 / (p^2 + s^2), with s the standard error of the slope b_ls of least squares
    and p = 3 N/s the drift to reckon with.

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
    components = recording.force.reshape(time.size, -1)
    before = slice(start, end)
    if end - start < LEAST_SAMPLES or time[end - 1] - time[start] < LEAST_DURATION:
        force = _combined(components, recording.direction, 0.0)
        return ContactForce(time, force, 0, 0.0, noise_sd(force), math.nan, math.nan, 0.0, 0.0, _DRIFT_SD)

    lines = [_quiet_line(time[before], each[before], _hidden_step(each[start:], end - start)) for each in components.T]
    quiet = np.logical_and.reduce([line.quiet for line in lines])
    residual = np.column_stack([line.residual(time, each) for line, each in zip(lines, components.T, strict=True)])
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
    if np.count_nonzero(force[1:quiet] == force[: quiet - 1]) < 0.5 * quiet:
        return 0.0
    steps = np.abs(np.diff(force))
    return float(steps[steps > 0].min()) if steps.any() else 0.0


def noise_sd(force: FloatArray) -> float:
    """Standard deviation of white noise on a curve [N], from the median of its second differences."""
    if force.size < 5:
        return 0.0
    bends = np.abs(force[2:] - 2.0 * force[1:-1] + force[:-2])
    middle = bends.size // 2
    return float(np.partition(bends, middle)[middle]) * 1.4826 / math.sqrt(6.0)


def _combined(components: FloatArray, direction: tuple[float, float, float] | None, power: float) -> FloatArray:
    """One force from its components, shape (n, 1) or (n, 3); `power` is the mean square of their noise."""
    if components.shape[1] == 1:
        return np.ascontiguousarray(components[:, 0])
    if direction is not None:
        return np.asarray(components @ np.asarray(direction))
    return np.asarray(np.sqrt(np.maximum(np.sum(components**2, axis=1) - power, 0.0)))


@dataclass(frozen=True, eq=False)
class _Line:
    middle: float
    level: float
    slope: float
    slope_sd: float
    quiet: Mask

    def residual(self, time: FloatArray, force: FloatArray) -> FloatArray:
        return force - self.level - self.slope * (time - self.middle)


def _quiet_line(time: FloatArray, force: FloatArray, resolution: float) -> _Line:
    """A line through the quiet samples; those further from it than max(3 N, 4 SD) are left out, in three rounds.

    Readings in steps of `resolution` [N] hide a slope of up to one step over the whole time.
    """
    quiet = np.ones(time.size, dtype=np.bool_)
    line = _line(time, force, quiet, resolution)
    for _ in range(3):
        if (residual := np.abs(line.residual(time, force))).max() <= 3.0:
            break
        if quiet.all():  # start from the median, which a part that is not quiet does not pull away
            residual = np.abs(force - np.median(force))
        kept = residual <= max(3.0, 4.0 * 1.4826 * float(np.median(residual)))
        if kept.sum() < LEAST_SAMPLES or (kept == quiet).all():
            break
        quiet, line = kept, _line(time, force, kept, resolution)
    return line


def _line(time: FloatArray, force: FloatArray, quiet: Mask, resolution: float) -> _Line:
    t, f = time[quiet], force[quiet]
    middle, level = float(t.mean()), float(f.mean())
    lever = t - middle
    moment = float(lever @ lever)
    slope = float(lever @ f) / moment
    scatter = f - level - slope * lever
    error = math.sqrt(float(scatter @ scatter) / max(t.size - 2, 1) / moment) + resolution / (t[-1] - t[0])
    trust = _DRIFT_SD**2 / (_DRIFT_SD**2 + error**2)
    return _Line(middle, level, slope * trust, error * math.sqrt(trust), quiet)
