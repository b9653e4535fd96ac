"""The bound on the virtual lab's own truth, which has no form: the default plan of every preset.

A campaign is covered if its bound lies above 95 % of the lab's forces of a fine grid, state effects included. `make
validity` runs 400 campaigns a row and prints the table of docs/validity.md.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

import forcemap as fm
from forcemap.lab.bench import simulate_peaks
from forcemap.lab.virtual_robot import PRESETS, virtual_robot
from sizes import FULL_SIZE
from test_tilted_paths import RANGE
from truths import Box, spread

SEED, REPEATS, NOISE = 202618, 3, 1.1  # [N]
HEIGHTS, FASTEST = (0.14, 0.46), 0.4


def box(preset, slowest):
    near, far = RANGE[preset]
    return Box(np.array([near, HEIGHTS[0], slowest]), np.array([far, HEIGHTS[1], FASTEST]))


def true_force(preset, slowest):
    """Points of the fine grid, shape (n, 3), and the lab's force there."""
    at = box(preset, slowest).grid(13, 13, 10)
    return at, simulate_peaks(virtual_robot(preset), *at.T)


def campaigns(preset, slowest, effects, count):
    """Maps of seeded campaigns, one for each state effect: the same impacts, at speeds that scatter as the robot's."""
    robot, points = virtual_robot(preset), spread(box(preset, slowest)).repeat(REPEATS, axis=0)
    d, h, v = points.T
    state = np.arange(v.size) // REPEATS
    for number in range(count):
        rng = np.random.default_rng([SEED, number])
        peak = simulate_peaks(robot, d, h, v * (1 + robot.speed_scatter * rng.standard_normal(v.size)))
        of_state, noise = rng.standard_normal(state[-1] + 1)[state], rng.normal(0, NOISE, v.size)
        yield [
            fm.fit_force_map(
                fm.ImpactDataset.from_arrays(
                    distance=d, height=h, speed=v, peak_force=peak * np.exp(effect * of_state) + noise,
                    state=[f"s{i}" for i in state],
                )
            )
            for effect in effects
        ]  # fmt: skip


EFFECTS = (0.0, 0.022)


@pytest.mark.parametrize("slowest", [0.1, 0.2] if FULL_SIZE else [0.2])
@pytest.mark.parametrize("preset", PRESETS)
def test_the_default_plan_covers_what_the_lab_does(preset, slowest, full_size):
    at, force = true_force(preset, slowest)
    bound, found = fm.ToleranceBound(device_error=0), []
    for maps in campaigns(preset, slowest, EFFECTS, 400 if full_size else 10):
        margin = np.log([bound.upper(each, *at.T) for each in maps] / force)
        below = [norm.cdf(each / effect) if effect else each >= 0 for each, effect in zip(margin, EFFECTS, strict=True)]
        found.append([np.mean(below, axis=1) >= 0.95, margin.mean(axis=1)])
    share, width = np.mean(found, axis=0)
    print(f"| {preset} | {slowest:g} m/s | {share[0]:.2f} ({width[0]:.3f}) | {share[1]:.2f} ({width[1]:.3f}) |")
    assert share.min() >= (0.93 if full_size else 0.8)
