"""I-optimal plans of 18 states against 27 of the default plan and the paper's: the error at new states.

They carry their own state effect.
"""

from __future__ import annotations

import numpy as np
import pytest
from oracle import DISTANCES, HEIGHTS, PRINTED, SPEEDS, full_grid, printed_force, simulate, training_grid

import forcemap as fm
from sequence import EFFECTS
from truths import Box, spread


def errors(name, form, points, seeds):
    """RMSE of ln F at the states of the full grid, one for each seed."""
    test = full_grid(name)
    found = []
    for seed in range(seeds):
        rng = np.random.default_rng([18, seed])
        campaign = simulate(
            name, rng, effect=EFFECTS[name], points=points, train=np.ones(len(points), bool), device_range=2000.0
        )
        measured = np.log(printed_force(name, *test.T)) + rng.normal(0, EFFECTS[name], len(test))
        predicted = fm.fit_force_map(campaign.dataset, form=form).predict(*test.T)
        found.append(np.sqrt(np.mean((np.log(predicted) - measured) ** 2)))
    return np.array(found)


@pytest.mark.parametrize("form", [fm.CFM_3D, fm.LOG_SPEED], ids=lambda form: form.name)
@pytest.mark.parametrize("name", PRINTED)
def test_18_optimal_states_are_hardly_worse_than_27(name, form, full_size):
    plan = fm.plan_measurements(
        DISTANCES[name], HEIGHTS, SPEEDS, design=fm.Design.I_OPTIMAL, states=18, form=form, repeats=1
    )
    chosen = np.column_stack([plan.distance, plan.height, plan.speed])
    seeds = 60 if full_size else 10
    few, default, paper = (
        errors(name, form, points, seeds) for points in (chosen, spread(Box.of(name, SPEEDS[0])), training_grid(name))
    )
    ratio, of_paper = (np.sqrt(np.mean(few**2) / np.mean(each**2)) for each in (default, paper))
    print(f"| {name} | {form.name} | {ratio:.3f} | {few.max() / default.max():.3f} | {of_paper:.3f} |")
    most = 1.10 if full_size else 1.15
    assert ratio <= most
    assert few.mean() <= most * default.mean()
    assert few.max() <= 1.5 * default.max()
