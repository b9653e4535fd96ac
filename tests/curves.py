"""Synthetic force-time curves with known truth, to check phase detection against; independent of forcemap.

A shape is a function of the time since contact, zero before it. Phase I ends where contact is lost first or, if it is
kept, at the first minimum after the first peak; the scenario follows from how the shape was built.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

UNCONSTRAINED, WITHOUT_CLAMPING, WITH_CLAMPING = (
    "unconstrained",
    "constrained_without_clamping",
    "constrained_with_clamping",
)
OVER = 0.45  # [s] after contact: every bounce is over, every oscillation has settled


@dataclass(frozen=True)
class Shape:
    """The true force [N] as a function of the time since contact [s]; Phase I peak [N]; times since contact [s]."""

    name: str
    force: Callable[[np.ndarray], np.ndarray]
    peak: float
    peak_time: float
    phase1_end: float
    scenario: str


@dataclass(frozen=True)
class Curve:
    """What a device records of a shape, by sample [s], [N]; true onset on that time axis; SD of the noise [N]."""

    shape: Shape
    time: np.ndarray
    force: np.ndarray
    onset: float
    noise: float

    @property
    def phase1_samples(self) -> int:
        since_contact = self.time - self.onset
        return int(np.sum((since_contact >= 0) & (since_contact <= self.shape.phase1_end)))

    def until(self, since_contact: float) -> Curve:
        """The same recording, cut at a time since contact [s]."""
        kept = self.time <= self.onset + since_contact
        return Curve(self.shape, self.time[kept], self.force[kept], self.onset, self.noise)


def arch(time, duration, start=0.0):
    """One half-sine of height 1, zero elsewhere."""
    turn = (time - start) / duration
    return np.where((turn > 0) & (turn < 1), np.sin(np.pi * np.clip(turn, 0, 1)), 0.0)


def half_sine(rng, peak, duration, noise):
    return Shape("half-sine", lambda t: peak * arch(t, duration), peak, duration / 2, duration, UNCONSTRAINED)


def soft_foot(rng, peak, duration, noise):
    """A sin^2 pulse: neither force nor slope jumps at contact."""
    return Shape("sin^2 pulse", lambda t: peak * arch(t, duration) ** 2, peak, duration / 2, duration, UNCONSTRAINED)


def bounces(rng, peak, duration, noise):
    """Two to four further contacts, each lower than the one before, with gaps of no contact."""
    while True:
        count = rng.integers(2, 5)
        lengths = rng.uniform(np.maximum(0.008, duration / 2), duration, count)
        gaps = rng.uniform(0.010, 0.080, count)
        starts = duration + np.cumsum(gaps) + np.cumsum(lengths) - lengths
        if starts[-1] + lengths[-1] < OVER:
            break
    heights = peak * np.sort(rng.uniform(0.2, 0.7, count))[::-1]

    def force(t):
        later = (h * arch(t, length, s) for h, length, s in zip(heights, lengths, starts, strict=True))
        return peak * arch(t, duration) + sum(later)

    return Shape("bounces", force, peak, duration / 2, duration, WITHOUT_CLAMPING)


def double_hump(rng, peak, duration, noise):
    """Two humps without loss of contact; smooth at the peaks and in the valley between, which ends Phase I."""
    second = peak * rng.uniform(0.4, 1.3)
    valley = rng.uniform(0, min(peak, second) - max(0.15 * peak, 8 * noise))
    top = duration * rng.uniform(0.4, 0.6)
    second_top, end = duration + rng.uniform(0.008, 0.060) * np.array([0.5, 1.0])

    def force(t):
        up = peak * np.sin(np.pi / 2 * np.clip(t / top, 0, 1))
        down = (valley - peak) * (1 - np.cos(np.pi * np.clip((t - top) / (duration - top), 0, 1))) / 2
        again = (second - valley) * (1 - np.cos(np.pi * np.clip((t - duration) / (second_top - duration), 0, 1))) / 2
        last = second * (np.cos(np.pi / 2 * np.clip((t - second_top) / (end - second_top), 0, 1)) - 1)
        return up + down + again + last

    return Shape("double hump", force, peak, top, duration, WITHOUT_CLAMPING)


def clamping(rng, peak, duration, noise):
    """A damped oscillation about a level that stays; where it would pull, contact is lost (force 0)."""
    level = rng.uniform(max(15.0, 0.1 * peak), 0.6 * peak)
    settles = np.log((peak - level) / (0.05 * level)) / 0.35 * duration / 4.2  # damping ratio that settles before OVER
    damping = max(rng.uniform(0.06, 0.3), settles)
    phase = np.linspace(0, 8, 8001)  # [rad], more than one turn

    def swing(x, amplitude):
        x = np.maximum(x, 0)
        return np.maximum(level * (1 - np.exp(-2 * x)) + amplitude * np.exp(-damping * x) * np.sin(x), 0)

    low, high = 0.0, 5 * peak
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if swing(phase, middle).max() < peak else (low, middle)
    first = swing(phase, high)
    top = int(first.argmax())
    end = top + int(np.argmax(np.diff(first[top:]) >= 0))  # the minimum, or the first sample without contact
    pace = phase[end] / duration  # stretched so that Phase I lasts what was asked for
    return Shape("clamping", lambda t: swing(pace * t, high), peak, phase[top] / pace, duration, WITH_CLAMPING)


SHAPES = (half_sine, soft_foot, bounces, double_hump, clamping)


def curve(seed: int, number: int) -> Curve:
    """The curve of that number: the shapes take turns, everything else is drawn."""
    rng = np.random.default_rng([seed, number])
    noise = rng.choice([0.0, rng.uniform(0, 2)], p=[0.1, 0.9])
    shape = SHAPES[number % len(SHAPES)](rng, rng.uniform(60, 450), rng.uniform(0.008, 0.060), noise)
    step = 1 / np.exp(rng.uniform(np.log(500), np.log(20_000)))
    shortest = max(0.020, 10 * step)
    before = rng.choice([shortest, np.exp(rng.uniform(np.log(shortest), 0))], p=[0.2, 0.8]) + step * rng.uniform()
    ticks = np.arange(np.ceil((before + rng.uniform(0.7, 2)) / step) + 1) * step
    jitter = rng.choice([0.0, 0.05], p=[0.7, 0.3]) * step
    ticks[1:] += rng.uniform(-jitter, jitter, len(ticks) - 1)
    recorded = shape.force(ticks - before) + rng.uniform(-30, 30) + rng.uniform(-5, 5) * ticks
    recorded = recorded + rng.normal(0, noise, len(ticks))
    if rng.uniform() < 0.3:
        recorded = np.round(recorded, 1)
    start = rng.choice([0.0, -before, rng.uniform(-100, 100)])
    return Curve(shape, start + ticks, recorded, start + before, noise)
