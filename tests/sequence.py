"""Sequential campaigns on the tests' own truth: what is planned is measured, until it is time to stop."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from oracle import DISTANCES, printed_force

import forcemap as fm

QUASI_STATIC = fm.Contact.QUASI_STATIC

MASSES = {"ur10e": 30.0, "kuka-iiwa7-30nm": 20.0, "kuka-iiwa7-10nm": 20.0}
EFFECTS = {"ur10e": 0.022, "kuka-iiwa7-30nm": 0.033, "kuka-iiwa7-10nm": 0.021}
HEIGHTS = (0.14, 0.46)
REPEATS = 3


SHAPES = "plateau", "kink", "ridge", "stretched arm", "bump", "low level"
"""Truths outside the form: science of the project, and one band of distances measured 10 % too low."""


@dataclass
class Sequence:
    """A simulated robot and what was measured of it so far."""

    name: str
    device_range: float
    rng: np.random.Generator
    states: np.ndarray  # (d, h, v)
    forces: np.ndarray  # (states, repeats), not cut at the device range
    shape: str = ""  # of SHAPES, on the printed map
    shared: float = 0.0  # standard deviation of the effect of a place
    own: float = math.nan  # of the effect of a state
    middle: tuple[float, float] = (0.0, 0.0)  # of the shape
    places: dict = field(default_factory=dict)

    @classmethod
    def of(cls, name, seed, device_range=500.0, **truth):
        rng = np.random.default_rng([2026, seed])
        ends = np.array([[DISTANCES[name][0], DISTANCES[name][-1]], HEIGHTS])
        middle = tuple(np.random.default_rng([7, seed]).uniform(*ends.T))
        own = truth.pop("own", EFFECTS[name])
        return cls(name, device_range, rng, np.empty((0, 3)), np.empty((0, REPEATS)), own=own, middle=middle, **truth)

    @property
    def conditions(self):
        mass = 10.0 if self.shape in ("plateau", "kink") else MASSES[self.name]
        device = fm.Device(range=self.device_range, error=3.0, stiffness=75e3)
        return fm.Conditions(device=device, moving_mass=mass)

    def force(self, d, h, v):
        """True force [N] without effects of places and states."""
        d, h, v = (np.asarray(each, dtype=float) for each in (d, h, v))
        nearest = self.distances[0]
        falling = np.exp(-1.6 * (d - nearest) - 1.3 * (h - 0.14))
        along, across = np.square((d - self.middle[0]) / 0.04), np.square((h - self.middle[1]) / 0.04)
        if self.shape == "plateau":
            return np.maximum(150, 1100 * v) * falling
        if self.shape == "kink":
            return (60 + 700 * v + 1500 * np.maximum(v - 0.3, 0)) * falling
        force = printed_force(self.name, d, h, v)
        if self.shape == "ridge":
            return force * (1 + 0.15 * np.exp(-along))
        if self.shape == "stretched arm":
            return force * np.exp(30 * np.square(np.maximum(d - nearest - 0.26, 0)))
        return force * (1 + 0.25 * np.exp(-along - across)) if self.shape == "bump" else force

    @property
    def distances(self):
        return DISTANCES[self.name][0], DISTANCES[self.name][-1]

    @property
    def measured(self):
        """The impacts so far; the conditions if there are none."""
        if not len(self.states):
            return self.conditions
        state = np.repeat(np.arange(len(self.states)), REPEATS)
        force = self.forces.ravel()
        return fm.ImpactDataset.from_arrays(
            distance=self.states[state, 0], height=self.states[state, 1], speed=self.states[state, 2],
            peak_force=np.minimum(force, self.device_range), censored=force >= self.device_range,
            state=[f"s{i}" for i in state], conditions=self.conditions,
        )  # fmt: skip

    @property
    def saturated(self):
        """Share of impacts at or above the device range."""
        return float(np.mean(self.forces >= self.device_range))

    def next(self, limit=140.0, **options):
        return fm.next_measurements(self.measured, limit, distances=self.distances, heights=HEIGHTS, **options)

    def measure(self, new):
        """Measure states, shape (n, 3): true force times the effects of place and state, plus repeat noise."""
        new = np.asarray(new, dtype=float)
        level = self.force(*new.T) * np.exp(self.rng.normal(0, self.own, len(new)))
        if self.shared:
            names = [tuple(each) for each in new[:, :2].round(3).tolist()]
            level *= np.exp([self.places.setdefault(each, self.rng.normal(0, self.shared)) for each in names])
        if self.shape == "low level":
            level *= np.where(np.abs(new[:, 0] - self.middle[0]) < 0.03, 0.9, 1.0)
        self.states = np.vstack([self.states, new])
        self.forces = np.vstack([self.forces, level[:, None] + self.rng.normal(0, 1.1, (len(new), REPEATS))])

    def run(self, **options):
        """Measure what is planned until it is time to stop; the last answer."""
        while True:
            found = self.next(**options)
            if found.plan is None:
                return found
            self.measure(planned_states(found.plan))


def planned_states(plan):
    """(d, h, v) of every state of a plan, in its order."""
    first = plan.repeat == 1
    return np.column_stack([plan.distance[first], plan.height[first], plan.speed[first]])


def released(sequence, limit=140.0):
    """What the campaign confirms on a dense grid, beside the truth.

    Share confirmed and mean confirmed / true speed of the places whose true speed is 0.12 m/s or more; share of all
    confirmed places at which the true force, with new effects, exceeds the limit; and without them, where the
    confirmed speed is above the true one.
    """
    axes = np.linspace(*sequence.distances, 38), np.linspace(*HEIGHTS, 33)
    d, h = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    found = fm.safe_speed(
        fm.fit_force_map(sequence.measured), d, h, limit=limit, contact=QUASI_STATIC, bound=fm.ToleranceBound()
    )
    v = np.linspace(0, 0.8, 3201)
    reached = sequence.force(*np.broadcast_arrays(d[:, None], h[:, None], v)) >= limit
    true_speed = np.where(reached.any(axis=1), v[reached.argmax(axis=1)], v[-1])
    confirmed = np.array([outcome.has_speed for outcome in found.outcome])
    asked = true_speed >= 0.12
    effect = np.exp(sequence.rng.normal(0, math.hypot(sequence.own, sequence.shared), d.size))
    force = sequence.force(d, h, np.nan_to_num(found.speed))
    both = asked & confirmed
    ratio = (found.speed[both] / true_speed[both]).mean() if both.any() else math.nan
    exceeds = [np.mean(each[confirmed] > limit) if confirmed.any() else 0.0 for each in (force * effect, force)]
    return confirmed[asked].mean(), ratio, *exceeds
