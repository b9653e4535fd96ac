"""The tests' own truth: the printed equations of the paper and simulated campaigns, independent of the package."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcemap import Conditions, Device, ImpactDataset

# Paper, section V: the three fitted equations as printed.
PRINTED = {
    "ur10e": (6.2990, 3.3761, -1.1050, -1.3066, -1.5258, -6.6954, 4.0919, -6.0090, 8.5207),
    "kuka-iiwa7-30nm": (7.0641, 4.2943, -4.5286, 0.9917, -0.5795, -6.0074, 3.9366, -7.2169, 7.0446),
    "kuka-iiwa7-10nm": (6.6936, 4.9297, -4.4782, 1.2926, -0.3758, -5.5669, 3.2609, -7.2332, 6.4016),
}
DISTANCES = {
    "ur10e": (0.52, 0.61, 0.70, 0.79, 0.89),
    "kuka-iiwa7-30nm": (0.56, 0.635, 0.71, 0.785, 0.86),
    "kuka-iiwa7-10nm": (0.56, 0.635, 0.71, 0.785, 0.86),
}
HEIGHTS = (0.14, 0.22, 0.30, 0.38, 0.46)
SPEEDS = (0.20, 0.25, 0.30, 0.35, 0.40)
DEVICE = Device(range=500.0, error=3.0, stiffness=75e3)


def printed_force(name, d, h, v):
    """Force [N] by the printed equation, d and h in m, v in m/s."""
    b = PRINTED[name]
    return np.exp(
        b[0] + b[1] * v + b[2] * d + b[3] * d**2 + b[4] * d * h + b[5] * h**2
        + b[6] * d**2 * v + b[7] * d * v**2 + b[8] * d * h**2
    )  # fmt: skip


def full_grid(name):
    """(d, h, v) of the paper's 125 states, shape (125, 3)."""
    return np.stack(np.meshgrid(DISTANCES[name], HEIGHTS, SPEEDS, indexing="ij"), axis=-1).reshape(-1, 3)


def training_grid(name):
    """(d, h, v) of the paper's 27 training states."""
    axes = (DISTANCES[name][::2], HEIGHTS[::2], SPEEDS[::2])
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass
class Campaign:
    """A simulated campaign and the truth behind it."""

    dataset: ImpactDataset
    points: np.ndarray  # (d, h, v) of every state
    force: np.ndarray  # true force of every state, its effect included
    train: np.ndarray  # which states are training states


def simulate(name, rng, *, effect, repeat_sd=1.1, repeats=3, points=None, train=None, device_range=500.0, **options):
    """Impacts on the full grid (or `points`): printed force times a state effect, plus repeat noise."""
    points = full_grid(name) if points is None else np.asarray(points, dtype=float)
    if train is None:
        wanted = {tuple(np.round(p, 6)) for p in training_grid(name)}
        train = np.array([tuple(np.round(p, 6)) in wanted for p in points])
    truth = printed_force(name, *points.T) * np.exp(rng.normal(0, effect, len(points)))
    state = np.repeat(np.arange(len(points)), repeats)
    measured = truth[state] + rng.normal(0, repeat_sd, state.size) if repeat_sd else truth[state]
    censored = measured >= device_range
    dataset = ImpactDataset.from_arrays(
        distance=points[state, 0],
        height=points[state, 1],
        speed=points[state, 2],
        peak_force=np.where(censored, device_range, measured),
        state=[f"s{i}" for i in state],
        role=np.where(train, "train", "test")[state],
        censored=censored,
        conditions=Conditions(device=Device(range=device_range, error=3.0, stiffness=75e3)),
        **options,
    )
    return Campaign(dataset, points, truth, train)


def alike(states, correlation):
    """V: states at one place correlated, places in numbers that are the same to the micrometre."""
    places = np.round(states.coordinates[:, :2], 6)
    return np.where((places[:, None] == places).all(axis=2), correlation, 0.0) + (1 - correlation) * np.eye(len(places))
