"""Recordings that end early: a force still standing at the end is undetermined, a force that is gone is not."""

from __future__ import annotations

import numpy as np

import forcemap as fm
from curves import OVER, curve
from sizes import FULL_SIZE

SEED, CURVES = 202613, 1000 if FULL_SIZE else 150
LEVEL_WINDOW, SILENT_WINDOW = 0.0125, 0.015  # [s] before the end of the recording
CLEARLY = 1.5


def cut_curve(number):
    """The curve of that number, cut between the end of Phase I (sometimes shortly before) and 0.45 s after contact."""
    whole = curve(SEED, number)
    rng = np.random.default_rng([SEED, number, 1])
    end = whole.shape.phase1_end
    # The square puts most cuts soon after Phase I, where something is still going on.
    after = end + (OVER - end) * rng.uniform() ** 2
    before = rng.uniform(whole.shape.peak_time, end)
    return whole.until(before if rng.uniform() < 0.15 else after)


def must_be_undetermined(cut):
    """True, False, or None where the true force near the end is too close to the threshold to tell."""
    ends = cut.time[-1] - cut.onset
    threshold = max(10.0, 0.1 * cut.shape.peak)
    if cut.shape.force(ends - np.linspace(0, LEVEL_WINDOW, 1001)).mean() > CLEARLY * threshold:
        return True
    if cut.shape.force(ends - np.linspace(0, SILENT_WINDOW, 1001)).max() < threshold / CLEARLY:
        return False
    return None


def test_cut_recordings_are_undetermined_where_the_force_still_stands():
    counts, wrong = {}, []
    for number in range(CURVES):
        cut = cut_curve(number)
        expected = must_be_undetermined(cut)
        if expected is None or cut.phase1_samples < 16 or cut.time[-1] - cut.onset < cut.shape.peak_time:
            continue
        recording = fm.Recording(time=cut.time, force=cut.force, device=fm.Device(range=1000.0, error=3.0))
        impact = fm.find_impact(recording)
        is_undetermined = impact.scenario is fm.ContactScenario.UNDETERMINED
        count = counts.setdefault(cut.shape.name, {True: [], False: []})
        count[expected].append(is_undetermined)
        if is_undetermined != expected:
            wrong.append((number, cut.shape.name, expected))
    print("\n| shape | force stands: undetermined | force gone: determined |")
    for name, count in counts.items():
        stands, gone = count[True], count[False]
        print(f"| {name} | {sum(stands)} of {len(stands)} | {len(gone) - sum(gone)} of {len(gone)} |")
    assert sum(len(count[True]) for count in counts.values()) > CURVES / 10
    assert sum(len(count[False]) for count in counts.values()) > CURVES / 10
    assert not wrong, f"cut curves of seed {SEED} (number, shape, must be undetermined): {wrong}"
