"""Phase detection against curves with known truth: `make validity` runs 2,000 and prints the table by shape.

Promise: with at least 16 samples across Phase I the peak, the onset and the scenario are right; with fewer the impact
says "unresolved"; one contact is one impact.
"""

from __future__ import annotations

import numpy as np
import pytest

import forcemap as fm
from curves import OVER, SHAPES, curve
from sizes import FULL_SIZE

SEED = 202612
ENOUGH, CLEARLY_FEWER = 16, 14  # samples across Phase I
PROMISES = {
    "one impact": 1.0,
    "peak": 0.995,
    "raw peak": 0.995,
    "onset": 0.995,
    "scenario": 0.99,
    "unresolved": 0.995,
}


def check(number):
    """Shape, and for each promise that applies to the curve whether it is kept."""
    truth = curve(SEED, number)
    shape = truth.shape
    device = fm.Device(range=1000.0, error=3.0)
    found = fm.find_impacts(fm.Recording(time=truth.time, force=truth.force, device=device))
    kept = {"one impact": len(found) == 1}
    impact = found[0] if found else None
    if truth.phase1_samples >= ENOUGH:
        kept["peak"] = impact and abs(impact.peak_force - shape.peak) <= max(0.01 * shape.peak, 1 + truth.noise)
        raw_tolerance = max(0.01 * shape.peak, 1 + 4 * truth.noise)
        kept["raw peak"] = impact and abs(impact.raw_peak_force - shape.peak) <= raw_tolerance
        late = 0.003 if shape.name == "sin^2 pulse" else 0.002
        kept["onset"] = impact and abs(impact.onset - truth.onset) <= late
        kept["scenario"] = impact and impact.scenario == shape.scenario == fm.classify_contact(impact)
    elif truth.phase1_samples < CLEARLY_FEWER:
        flagged = impact and "unresolved" in [flag.name for flag in impact.flags]
        kept["unresolved"] = flagged and not impact.resolved
    return shape.name, {promise: bool(holds) for promise, holds in kept.items()}


@pytest.fixture(scope="module")
def results(full_size):
    found = [check(number) for number in range(2000 if full_size else 100)]
    print("\n| shape | " + " | ".join(f"{promise} ({100 * share:g} %)" for promise, share in PROMISES.items()) + " |")
    for name in [*dict(found), "all"]:
        cells = []
        for promise in PROMISES:
            kept = [checks[promise] for shape, checks in found if name in (shape, "all") and promise in checks]
            cells.append(f"{sum(kept)} of {len(kept)}" + (f", {100 * np.mean(kept):.1f} %" if kept else ""))
        print(f"| {name} | " + " | ".join(cells) + " |")
    return found


@pytest.mark.parametrize("promise", PROMISES)
def test_promise_is_kept(results, promise):
    wrong = [(number, name) for number, (name, kept) in enumerate(results) if not kept.get(promise, True)]
    applies = sum(promise in kept for _, kept in results)
    assert applies
    assert 1 - len(wrong) / applies >= PROMISES[promise], f"{promise}: wrong curves of seed {SEED}: {wrong}"


@pytest.mark.parametrize("number", range((10 if FULL_SIZE else 3) * len(SHAPES)))
def test_the_stated_truth_is_that_of_the_force(number):
    """The check of the checker: what the generator states about a curve, against its noiseless force."""
    truth = curve(SEED, number)
    shape = truth.shape
    s = np.linspace(-0.1, 2, 2_100_001)
    force = shape.force(s)
    phase1 = (s > 0) & (s <= shape.phase1_end)
    assert force.min() == 0.0
    assert not force[s <= 0].any()
    assert (force[phase1 & (s < 0.99 * shape.phase1_end)] > 0).all()
    assert force[phase1].max() == pytest.approx(shape.peak, rel=1e-5)
    assert abs(s[phase1][force[phase1].argmax()] - shape.peak_time) < 1e-4
    assert force[phase1][-1] < 0.85 * shape.peak
    settled = force[s > OVER]
    if shape.name == "clamping":
        assert settled.min() > max(13.0, 0.09 * shape.peak)
        assert np.ptp(settled) < 0.3 * settled[-1]
    else:
        assert np.abs(settled).max() < 1e-9
    assert np.sum(truth.time < truth.onset) >= 10
    assert truth.onset - truth.time[0] >= 0.020
    assert truth.time[-1] - truth.onset >= 0.7
