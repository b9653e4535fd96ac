"""Sequential campaigns: from nothing, 20 states x 3 confirm nearly every place that can be, and saturate no device."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import PRINTED

from sequence import Sequence, released


@pytest.mark.parametrize("device_range", [500.0, 350.0])
@pytest.mark.parametrize("name", PRINTED)
def test_sequential_campaigns_confirm_what_can_be_confirmed(name, device_range, full_size):
    figures, saturated = [], []
    for seed in range(30 if full_size else 3):
        sequence = Sequence.of(name, seed, device_range)
        sequence.run(states=20)
        assert len(sequence.states) <= 20
        figures.append(released(sequence))
        saturated.append(sequence.saturated)
    confirmed, ratio, exceeds = np.mean(figures, axis=0)
    print(
        f"| {name} | {device_range:g} N | {100 * confirmed:.1f} % | {ratio:.3f} | {100 * exceeds:.2f} % "
        f"| {100 * np.mean(saturated):.2f} % |"
    )
    assert confirmed >= 0.95
    assert ratio >= 0.80
    assert exceeds <= 0.025
    assert np.mean(saturated) <= 0.05
