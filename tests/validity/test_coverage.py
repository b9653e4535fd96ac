"""The statistical promise of ToleranceBound on the default plan, by seeded simulation with the state effect.

Promise: in at least 93 % of campaigns at least 95 % of the full grid's true forces (effects included) lie below
the bound, and the mean coverage is at least 0.97. `make validity` runs it at full size and prints the table of
docs/validity.md.
"""

from __future__ import annotations

import numpy as np
import pytest
from oracle import SPEEDS, full_grid, printed_force, simulate

import forcemap as fm
from truths import Box, spread

EFFECTS = (0.01, 0.033, 0.06)


def as_if_independent(force_map, d, h, v):
    """A 95 % upper prediction bound that treats all repeats as independent: what the promise must rule out."""
    from scipy import stats

    regression = force_map.fit.over_samples
    x = force_map.form.design(d, h, v)
    leverage = np.square(x @ regression.inverse_triangle).sum(axis=1)
    t = stats.t.ppf(0.95, regression.degrees_of_freedom)
    return np.exp(x @ regression.coefficients + t * regression.residual_sd * np.sqrt(1 + leverage))


BOUNDS = {
    "tolerance bound": fm.ToleranceBound().upper,
    "repeats as independent": as_if_independent,
    "prediction + 10 %": fm.FixedMargin(0.10).upper,
}


def coverages(name, effect, campaigns, seed):
    """Share of test states covered, for each bound and campaign."""
    found = {bound: [] for bound in BOUNDS}
    plan, grid = spread(Box.of(name, SPEEDS[0])), full_grid(name)
    points, train = np.vstack([plan, grid]), np.arange(len(plan) + len(grid)) < len(plan)
    for number in range(campaigns):
        rng = np.random.default_rng([seed, number])
        campaign = simulate(name, rng, effect=effect, points=points, train=train)
        force_map = fm.fit_force_map(campaign.dataset)
        test = ~train & (printed_force(name, *points.T) < 500)
        at, truth = points[test].T, campaign.force[test]
        for bound, upper in BOUNDS.items():
            found[bound].append(np.mean(truth <= upper(force_map, *at)))
    return {bound: np.array(shares) for bound, shares in found.items()}


def keeps_the_promise(shares):
    return shares.mean() >= 0.97 and np.mean(shares >= 0.95) >= (0.93 if len(shares) >= 400 else 0.85)


@pytest.mark.parametrize("effect", EFFECTS)
@pytest.mark.parametrize("name", ["ur10e", "kuka-iiwa7-30nm"])
def test_tolerance_bound_keeps_its_promise(name, effect, full_size):
    campaigns = 400 if full_size else 20
    found = coverages(name, effect, campaigns, seed=202611)
    for bound, shares in found.items():
        kept = np.mean(shares >= 0.95)
        print(f"| {name} | {100 * effect:g} % | {bound} | {shares.mean():.4f} | {100 * kept:.1f} % |")
    assert keeps_the_promise(found["tolerance bound"])
    if effect >= 0.033:
        assert not keeps_the_promise(found["repeats as independent"])
    if effect >= 0.06:
        assert not keeps_the_promise(found["prediction + 10 %"])
