"""I-optimal plans of 18 states against the paper's 27: the error at test states that carry their own state effect."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import DISTANCES, HEIGHTS, PRINTED, SPEEDS, full_grid, printed_force, simulate, training_grid

import forcemap as fm
from sequence import EFFECTS


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
    few, paper = errors(name, form, chosen, seeds), errors(name, form, training_grid(name), seeds)
    ratio = np.sqrt(np.mean(few**2) / np.mean(paper**2))
    print(f"| {name} | {form.name} | {ratio:.3f} | {few.max() / paper.max():.3f} |")
    assert ratio <= 1.10
    assert few.mean() <= 1.10 * paper.mean()
    assert few.max() <= 1.5 * paper.max()
