"""What the censored fit gains over discarding, pooled over simulated campaigns; `make validity` prints the table."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from oracle import SPEEDS, simulate

import forcemap as fm
from truths import Box, spread

SEED = 202611
CASES = list(itertools.product(("ur10e", "kuka-iiwa7-30nm"), (500.0, 400.0, 350.0), (0.022, 0.033)))


def errors(name, device_range, effect, seeds):
    """Log predictions less truth, log bounds less truth, of both fits, and which states are wholly censored."""
    for seed in seeds:
        rng = np.random.default_rng([SEED, int(device_range), int(1000 * effect), seed])
        points = spread(Box.of(name, SPEEDS[0]))
        train = np.ones(len(points), dtype=bool)
        campaign = simulate(name, rng, effect=effect, device_range=device_range, points=points, train=train)
        train = campaign.dataset.train
        if not 0.05 <= train.censored.mean() <= 0.20:
            continue
        truth = np.log(campaign.force[campaign.train])
        where = campaign.points[campaign.train].T
        names = [f"s{i}" for i in np.flatnonzero(campaign.train)]
        impacts = dict(zip(train.states.name, train.states.impacts, strict=True))
        wholly = np.array([impacts[each] == 0 for each in names])
        maps = [fm.fit_force_map(train, impacts=kind) for kind in fm.CensoredImpacts]
        bound = fm.ToleranceBound()
        predicted = [np.log(each.predict(*where)) - truth for each in maps]
        upper = [np.log(bound.upper(each, *where)) - truth for each in maps]
        yield predicted, upper, wholly


@pytest.fixture(scope="module")
def pooled(full_size):
    found = [row for case in CASES for row in errors(*case, range(60 if full_size else 4))]
    wholly = np.concatenate([row[2] for row in found])
    predicted = np.array([np.concatenate([row[0][k] for row in found]) for k in (0, 1)])
    upper = np.array([np.concatenate([row[1][k] for row in found]) for k in (0, 1)])
    under = np.sqrt(np.mean(np.minimum(predicted[:, wholly], 0) ** 2, axis=1))
    rmse = np.sqrt(np.mean(predicted[:, wholly] ** 2, axis=1))
    others = np.sqrt(np.mean(predicted[:, ~wholly] ** 2, axis=1))
    covered = np.mean(upper[:, wholly] >= 0, axis=1)
    width = np.mean(upper[:, wholly] - predicted[:, wholly], axis=1)
    print(f"\n{len(found)} campaigns, {wholly.sum()} wholly censored states; ln F, censored fit | discarding")
    for title, (ours, theirs) in {
        "underestimation there, root mean square": under,
        "RMSE there": rmse,
        "RMSE at the other states": others,
        "share of true forces there below the 95/95 bound": covered,
        "mean width of the bound there": width,
    }.items():
        print(f"| {title} | {ours:.4f} | {theirs:.4f} |")
    return {"under": under, "rmse": rmse, "others": others, "covered": covered}


def test_underestimation_at_censored_states_is_smaller(pooled):
    assert pooled["under"][0] <= 0.90 * pooled["under"][1]


def test_error_at_censored_states_is_not_larger(pooled):
    assert pooled["rmse"][0] <= pooled["rmse"][1]


def test_other_states_are_not_worse(pooled):
    assert pooled["others"][0] <= 1.02 * pooled["others"][1]


def test_the_bound_covers_the_censored_states(pooled):
    assert pooled["covered"][0] >= 0.95
