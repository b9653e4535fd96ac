"""Sequential campaigns: from nothing, 20 states x 3 confirm nearly every place that can be, and saturate no device."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import PRINTED

from sequence import SHAPES, Sequence, released


@pytest.mark.parametrize("device_range", [500.0, 350.0])
@pytest.mark.parametrize("name", PRINTED)
def test_sequential_campaigns_confirm_what_can_be_confirmed(name, device_range, full_size):
    figures, saturated = [], []
    for seed in range(30 if full_size else 1):
        sequence = Sequence.of(name, seed, device_range)
        sequence.run(states=20)
        assert len(sequence.states) <= 20
        figures.append(released(sequence))
        saturated.append(sequence.saturated)
    confirmed, ratio, exceeds, _ = np.mean(figures, axis=0)
    print(
        f"| {name} | {device_range:g} N | {100 * confirmed:.1f} % | {ratio:.3f} | {100 * exceeds:.2f} % "
        f"| {100 * np.mean(saturated):.2f} % |"
    )
    assert confirmed >= 0.95
    assert ratio >= (0.80 if full_size else 0.65)
    assert exceeds <= 0.025
    assert np.mean(saturated) <= 0.05


TRUTHS = {name: {"name": name} for name in PRINTED}
TRUTHS |= {f"{own:.1%} of 2.2 %": {"name": "ur10e", "shared": 0.022, "own": own} for own in (0.005, 0.015)}
TRUTHS |= {shape: {"name": "ur10e", "shape": shape} for shape in SHAPES}


@pytest.mark.parametrize("truth", TRUTHS)
def test_hardly_a_confirmed_speed_is_above_the_true_one(truth, full_size):
    """Truths outside the form, and effects shared by places, too: at most 30 states."""
    figures, states, places = [], [], []
    for seed in range(40 if full_size else 1):
        sequence = Sequence.of(seed=1000 + seed, **TRUTHS[truth])
        sequence.run(states=30 if full_size else 18, batch=4 if full_size else 6)
        states.append(len(sequence.states))
        places.append(len(np.unique(sequence.states[:, :2], axis=0)))
        figures.append(released(sequence))
    confirmed, ratio, exceeds, above = np.nanmean(figures, axis=0)
    print(
        f"| {truth} | {np.mean(states):.1f} | {np.mean(places):.1f} | {100 * confirmed:.1f} % | {ratio:.3f} "
        f"| {100 * exceeds:.2f} % | {100 * above:.2f} % |"
    )
    assert max(states) <= 30
    assert min(places) >= 9  # as many as a bound needs
    assert exceeds <= (0.05 if full_size else 0.2)
    assert above <= (0.05 if full_size else 0.2)
