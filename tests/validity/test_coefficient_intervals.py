"""How often the 95 % intervals of coefficients hold the true ones: the table of docs/validity.md under `make validity`.

Campaigns of the published UR10e map, with states that share none, half or most of their effect within a place; planned
at 9 places with 3 speeds each, and scattered, where next to nothing tells what states of a place share.
"""

from __future__ import annotations

import numpy as np
import pytest

import forcemap as fm
from forcemap.maps.coefficients import coefficient_intervals
from sizes import FULL_SIZE

CAMPAIGNS = 1000 if FULL_SIZE else 150
DEVIATION, NOISE, REPEATS = 0.022, 1.1, 3  # of ln F of a state; [N] of an impact; impacts of a state
LEAST = 0.925 if FULL_SIZE else 0.885  # 0.95 less 3.6 standard errors of the share: the lowest of 54


def planned(rng):
    d, h, v = np.meshgrid([0.52, 0.70, 0.89], [0.14, 0.30, 0.46], [0.2, 0.3, 0.4], indexing="ij")
    return d.ravel(), h.ravel(), v.ravel()


def scattered(rng, n=20):
    return rng.uniform(0.5, 0.9, n), rng.uniform(0.15, 0.5, n), rng.uniform(0.15, 0.4, n)


@pytest.mark.parametrize("shared", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("states", [planned, scattered])
def test_intervals_hold_the_true_coefficients(states, shared):
    truth, rng = fm.published_map("ur10e"), np.random.default_rng(round(100 * shared))
    true = dict(zip(truth.form.term_names, truth.coefficients.tolist(), strict=True))
    within = []
    for _ in range(CAMPAIGNS):
        d, h, v = states(rng)
        place = np.unique(np.column_stack([d, h]), axis=0, return_inverse=True)[1].ravel()
        both = np.sqrt(shared) * rng.normal(size=d.size)[place] + np.sqrt(1 - shared) * rng.normal(size=d.size)
        force = np.repeat(truth.predict(d, h, v) * np.exp(DEVIATION * both), REPEATS)
        impacts = {
            "distance": np.repeat(d, REPEATS),
            "height": np.repeat(h, REPEATS),
            "speed": np.repeat(v, REPEATS),
            "peak_force": force + rng.normal(0, NOISE, force.size),
        }
        found = coefficient_intervals(fm.fit_force_map(fm.ImpactDataset.from_arrays(**impacts)))
        within.append([each.low <= true[each.term] <= each.high for each in found])
    covered = dict(zip((each.term for each in found), np.mean(within, axis=0).tolist(), strict=True))
    speed = [share for term, share in covered.items() if "v" in term]
    others = [share for term, share in covered.items() if "v" not in term]
    words = " | ".join(f"{min(part):.3f} to {max(part):.3f}" for part in (speed, others))
    print(f"| {states.__name__} | {shared:g} | {words} |")
    assert min(covered.values()) >= LEAST
