"""The whole chain on simulated campaigns: what the lab knows and never says is what the evaluation finds.

`make validity` runs ten campaigns a preset, `make test` one. The lab imports nothing of what it checks.
"""

from __future__ import annotations

import csv

import numpy as np
import pytest

import forcemap as fm
from forcemap.lab.example_campaigns import example_plan
from forcemap.lab.simulated_campaign import TRUTH_FILE, simulate_campaign
from forcemap.lab.simulated_device import SimulatedDevice
from forcemap.lab.virtual_robot import PRESETS, virtual_robot

SEED = 202616
SCENARIO = {"ur10e-like": "unconstrained"}


@pytest.fixture(scope="module", params=zip(PRESETS, fm.EXAMPLE_CAMPAIGNS, strict=True), ids=PRESETS)
def campaigns(request, tmp_path_factory, full_size):
    """Preset, and of each campaign its dataset and the lab's truth by recording."""
    preset, example = request.param
    found = []
    for number in range(10 if full_size else 1):
        folder = tmp_path_factory.mktemp(preset) / "campaign"
        rng = np.random.default_rng([SEED, number])
        simulate_campaign(example_plan(example, tests=True), virtual_robot(preset), SimulatedDevice(), rng, folder)
        dataset = fm.build_dataset(fm.read_campaign(folder))
        remark, *lines = (folder / TRUTH_FILE).read_text().splitlines()
        assert "SIMULATED" in remark
        found.append((dataset, {row["recording"]: row for row in csv.DictReader(lines)}))
    return preset, found


def truth_of(dataset, truth, column):
    return [truth[f"{state}-r{n}"][column] for state, n in zip(dataset.state, dataset.repeat, strict=True)]


def test_every_peak_is_found(campaigns):
    found, made = (sum(map(len, each)) for each in zip(*campaigns[1], strict=True))
    print(f"{campaigns[0]}: {found} of {made} recordings used")
    assert found >= 0.99 * made  # a noisy top may not be told from one that is cut off
    for dataset, truth in campaigns[1]:
        assert len(dataset) >= 0.98 * len(truth)
        true = np.array(truth_of(dataset, truth, "true_peak_force_N"), dtype=float)
        assert (true[~dataset.censored] < 505).all()
        # a soft peak may pass for one that was cut off, which is the safe side
        assert np.sum(true[dataset.censored] < 495) <= 0.01 * len(dataset)
        read = ~dataset.censored
        assert (np.abs(dataset.peak_force - true)[read] <= np.maximum(2.0, 0.01 * true[read])).all()


def test_every_scenario_is_that_of_the_preset(campaigns):
    preset, found = campaigns
    for dataset, truth in found:
        assert {str(each) for each in dataset.scenario} == {SCENARIO.get(preset, "constrained_with_clamping")}
        assert [str(each) for each in dataset.scenario] == truth_of(dataset, truth, "true_scenario")
        refusal = dataset.phase_two.transient_refusal(140.0, 3.0)
        assert bool(refusal) is (preset != "ur10e-like")


def test_the_map_predicts_the_test_states(campaigns):
    for dataset, _ in campaigns[1]:
        accuracy = fm.map_accuracy(fm.fit_force_map(dataset), dataset)[0]
        assert accuracy.on == "test states"
        print(f"{campaigns[0]}: mean underestimation {accuracy.mean_underestimation_percent:.2f} %, "
              f"overestimation {accuracy.mean_overestimation_percent:.2f} %")  # fmt: skip
        assert accuracy.mean_underestimation_percent < 5
        assert accuracy.mean_overestimation_percent < 5
