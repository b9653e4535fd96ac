"""Sequential campaigns on the tests' own truth: what is planned is measured, until it is time to stop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from oracle import DISTANCES, printed_force

import forcemap as fm

QUASI_STATIC = fm.Contact.QUASI_STATIC

MASSES = {"ur10e": 30.0, "kuka-iiwa7-30nm": 20.0, "kuka-iiwa7-10nm": 20.0}
EFFECTS = {"ur10e": 0.022, "kuka-iiwa7-30nm": 0.033, "kuka-iiwa7-10nm": 0.021}
HEIGHTS = (0.14, 0.46)
REPEATS = 3


@dataclass
class Sequence:
    """A simulated robot and what was measured of it so far."""

    name: str
    device_range: float
    rng: np.random.Generator
    states: np.ndarray  # (d, h, v)
    forces: np.ndarray  # (states, repeats), not cut at the device range

    @classmethod
    def of(cls, name, seed, device_range=500.0):
        return cls(name, device_range, np.random.default_rng([2026, seed]), np.empty((0, 3)), np.empty((0, REPEATS)))

    @property
    def conditions(self):
        return fm.Conditions(
            device=fm.Device(range=self.device_range, error=3.0, stiffness=75e3), moving_mass=MASSES[self.name]
        )

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
        """Measure states, shape (n, 3): true force times a state effect, plus repeat noise."""
        new = np.asarray(new, dtype=float)
        level = printed_force(self.name, *new.T) * np.exp(self.rng.normal(0, EFFECTS[self.name], len(new)))
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
    confirmed places at which the true force, with a new state effect, exceeds the limit.
    """
    axes = np.linspace(*sequence.distances, 38), np.linspace(*HEIGHTS, 33)
    d, h = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    found = fm.safe_speed(
        fm.fit_force_map(sequence.measured), d, h, limit=limit, contact=QUASI_STATIC, bound=fm.ToleranceBound()
    )
    v = np.linspace(0, 0.8, 3201)
    reached = printed_force(sequence.name, d[:, None], h[:, None], v) >= limit
    true_speed = np.where(reached[:, 0], 0.0, v[reached.argmax(axis=1)])
    confirmed = np.array([outcome.has_speed for outcome in found.outcome])
    asked = true_speed >= 0.12
    effect = np.exp(sequence.rng.normal(0, EFFECTS[sequence.name], d.size))
    exceeds = (printed_force(sequence.name, d, h, np.nan_to_num(found.speed)) * effect > limit)[confirmed]
    both = asked & confirmed
    return confirmed[asked].mean(), (found.speed[both] / true_speed[both]).mean(), exceeds.mean()
