"""Force models side by side, checked by independent arithmetic."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from oracle import simulate
from scipy.stats import kendalltau

import forcemap as fm
from forcemap.words import sentence

HAND = {"robot_mass": 15.0, "body_mass": math.inf, "stiffness": 75e3}


@pytest.fixture(scope="module")
def campaign():
    return simulate("ur10e", np.random.default_rng(30), effect=0.022)


@pytest.fixture(scope="module")
def comparison(campaign):
    return fm.compare_force_models(campaign.dataset, **HAND, limit=fm.force_limit("back_of_hand"))


def model(comparison, name):
    return next(each for each in comparison.models if each.model == name)


def test_all_models_on_the_same_states(campaign, comparison):
    test_states = int((campaign.dataset.test.states.impacts > 0).sum())
    assert [each.model for each in comparison.models] == ["CFM_3D", "CFM_2D", "CFM_2D per height", "contact model"]
    assert {each.accuracy.states for each in comparison.models} == {test_states}


def test_the_contact_model_by_hand(campaign, comparison):
    states = campaign.dataset.test.states.uncensored
    predicted = states.speed * math.sqrt(75e3 * 15.0)
    percent = 100 * (predicted / states.force - 1)
    found = model(comparison, "contact model")
    assert found.underestimated_share == pytest.approx(np.mean(percent < 0))
    assert found.overestimated_share == pytest.approx(np.mean(percent > 0))
    worst = int(np.argmin(percent))
    assert found.most_underestimated.percent == pytest.approx(percent[worst])
    assert found.most_underestimated.state == states.name[worst]
    assert found.most_underestimated.distance == states.distance[worst]
    assert found.most_overestimated.percent == pytest.approx(percent.max())
    # the paper: wrong by -50 % to +50 % across the workspace
    assert percent.min() < -35
    assert percent.max() > 40


def test_the_2d_map_underestimates_more(comparison):
    """Paper, section V-C."""
    own, flat, per_height = (model(comparison, n).accuracy for n in ("CFM_3D", "CFM_2D", "CFM_2D per height"))
    assert flat.max_underestimation_percent > 3 * own.max_underestimation_percent
    assert per_height.max_underestimation_percent < flat.max_underestimation_percent


def test_the_2d_map_per_height_by_plain_least_squares(campaign, comparison):
    dataset = campaign.dataset
    states = dataset.states.uncensored
    test = dataset.test.states.uncensored
    predicted = np.empty(len(test))
    for height in np.unique(states.height):
        used = (states.height == height) & np.isin(states.speed, (0.2, 0.3, 0.4))
        d, v = states.distance[used], states.speed[used]
        b = np.linalg.lstsq(np.column_stack([np.ones_like(d), v, d, d**2]), states.log_force[used], rcond=None)[0]
        here = test.height == height
        d, v = test.distance[here], test.speed[here]
        predicted[here] = np.exp(np.column_stack([np.ones_like(d), v, d, d**2]) @ b)
    percent = 100 * (predicted / test.force - 1)
    found = model(comparison, "CFM_2D per height").accuracy
    assert found.max_underestimation_percent == pytest.approx(-percent.min(), rel=1e-6)
    assert found.max_overestimation_percent == pytest.approx(percent.max(), rel=1e-6)


def test_the_note_of_maps_per_height_counts_the_states_without_one(forcemap, example_folders, comparison):
    """The example has training states at heights of their own; the simulated grid has none."""
    words = forcemap("compare", example_folders["ur10e"], "--area", "back_of_hand")[1].splitlines()
    states = [int(line.split()[2]) for line in words if line.lstrip().startswith("all states")]
    assert states == [125, 125, 106, 125]
    note = "states not compared, as their heights have too few states for such a map"
    assert f"{note}: 19" in " ".join(" ".join(words).split())
    per_height = model(comparison, "CFM_2D per height")
    assert dict(per_height.note.figures)["without"] == 0
    assert note not in sentence(per_height.note)


def test_without_test_states_each_is_left_out_in_turn(campaign):
    comparison = fm.compare_force_models(campaign.dataset.train, **HAND)
    assert comparison.on == "leave-one-state-out"
    loso = fm.leave_one_state_out(fm.fit_force_map(campaign.dataset.train))
    found = model(comparison, "CFM_3D").accuracy
    assert found.max_underestimation_percent == pytest.approx(loso.max_underestimation_percent, rel=1e-12)
    assert comparison.allowed == ()


def test_impacts_that_are_to_confirm_the_map_are_among_all_states_alone(campaign):
    """Made at its permitted speeds they flatter every model; other test states are what a comparison is on."""
    table = campaign.dataset.select(campaign.dataset.role == "train")
    tests = campaign.dataset.select(campaign.dataset.role == "test")
    columns = {
        name: np.concatenate([getattr(table, name), getattr(tests, name)])
        for name in ("distance", "height", "speed", "peak_force", "censored", "repeat", "role")
    }
    named = [*table.state.tolist(), *(f"c-{name}" for name in tests.state.tolist())]
    both = fm.ImpactDataset.from_arrays(**columns, state=named, conditions=table.conditions)
    alone, with_them = (fm.compare_force_models(each, **HAND) for each in (table, both))
    for before, after in zip(alone.models, with_them.models, strict=True):
        assert after.accuracy.on == "leave-one-state-out"
        if after.model != "CFM_2D per height":  # which is fitted to all states
            assert after.accuracy == before.accuracy
        assert after.on_all.states > before.on_all.states


def test_a_contact_without_a_speed_is_not_said_to_be_unconfirmed(campaign):
    limits = fm.force_limit("back_of_hand")
    found = fm.compare_force_models(campaign.dataset, **HAND, limit=limits)
    for row in (row for row in found.allowed if row.model == "CFM_3D"):
        unconfirmed = [each for each in row.warnings if each.kind in ("not_confirmed", "not_confirmed_yet")]
        assert bool(unconfirmed) is (row.confirmed > 0), row.contact


def test_what_each_allows(comparison):
    rows = {(row.model, row.limit): row for row in comparison.allowed}
    assert rows["contact model", 140.0].lowest == pytest.approx(0.1320, abs=5e-5)
    assert rows["contact model", 280.0].highest == pytest.approx(0.2640, abs=5e-5)
    assert rows["contact model", 280.0].confirmed == 0
    assert rows["CFM_3D", 140.0].confirmed == 0
    assert "lowest speed" in sentence(rows["CFM_3D", 140.0].note)
    assert rows["CFM_3D", 280.0].confirmed > 0
    assert rows["CFM_3D", 280.0].highest > 0.30


def test_variation_over_the_workspace(campaign, comparison):
    variation = comparison.variation
    assert variation.speed in (0.2, 0.25, 0.3)
    states = campaign.dataset.states.uncensored
    here = states.speed == variation.speed
    assert variation.states == here.sum()
    assert variation.ratio == pytest.approx(states.force[here].max() / states.force[here].min())
    assert variation.ratio > 2
    for found, axis in (
        (variation.rank_correlation_distance, states.distance),
        (variation.rank_correlation_height, states.height),
    ):
        assert -1 <= found < -0.3
        assert np.sign(found) == np.sign(kendalltau(axis[here], states.force[here]).statistic)


def test_clamping_forbids_transient_speeds_here_too(examples):
    comparison = fm.compare_force_models(
        examples["kuka-iiwa7-30nm"], **(HAND | {"robot_mass": 10.0}), limit=fm.force_limit("hand_fingers")
    )
    row = next(row for row in comparison.allowed if row.model == "CFM_3D" and row.limit == 280.0)
    assert row.confirmed == 0
    assert "clamp" in sentence(row.note)


def test_the_head_is_refused(campaign):
    with pytest.raises(fm.ContactNotPermitted):
        fm.compare_force_models(campaign.dataset, **HAND, limit=fm.force_limit("temple"))


def test_limits_above_the_device_range_are_noted_not_given(campaign):
    comparison = fm.compare_force_models(campaign.dataset, **HAND, limit=498.0)
    row = next(row for row in comparison.allowed if row.model == "CFM_3D")
    assert math.isnan(row.highest)
    assert "device" in sentence(row.note)


@pytest.fixture
def alone(tmp_path):
    """A table without campaign.toml beside it, whose test states lie above the fitted ones."""
    rng, rows = np.random.default_rng(5), ["distance_m,height_m,speed_mps,peak_force_N,role"]
    for d, h in itertools.product((0.5, 0.6, 0.7, 0.8, 0.9), (0.15, 0.25, 0.35, 0.45)):
        for v in (0.2, 0.3, 0.4):
            force = 1900 * v**0.9 * np.exp(-0.9 * d - 0.4 * h + rng.normal(0, 0.02))
            role = "test" if h == 0.45 else "train"
            rows += [f"{d},{h},{v},{force * np.exp(rng.normal(0, 0.004)):.3f},{role}" for _ in range(3)]
    (file := tmp_path / "impacts.csv").write_text("\n".join(rows) + "\n")
    return file


def test_what_a_table_alone_lacks_is_said_where_it_matters(alone, ask, forcemap):
    verdict, _, rest = " ".join(forcemap("fit", alone)[1].split()).partition("; ")
    assert "follow only once the device's spring is stated" in verdict
    found = ask("fit", alone)[1]
    assert (found["spring_stated"], found["test_samples"]) == (False, 45)
    assert [each["outside_states"] for each in found["accuracies"]] == [15, None, None, 15]
    assert "outside the map's measured range by more than repeats differ: 15 of 15 (test states)" in rest
    assert "Next: state the device's spring, device.stiffness_N_per_m in campaign.toml" in rest
    other = alone.parent / "other.csv"
    other.write_text(alone.read_text().replace("0.45,", "0.3,"))
    forcemap("fit", alone, "-o", map_file := alone.parent / "map.json")
    for table, outside in ((alone, 15), (other, 0)):
        assert ask("evaluate", table, "--map", map_file)[1]["accuracies"][0]["outside_states"] == outside
        assert ("measured range" in forcemap("evaluate", table, "--map", map_file)[1]) == bool(outside)


def test_places_without_a_speed_have_their_reason_beside_those_with_one(alone, ask, forcemap):
    (alone.parent / "campaign.toml").write_text(
        'schema = "forcemap-campaign/1"\n[robot]\nmoving_mass_kg = 30.0\n[contact]\ndirection = "down"\n'
        "[device]\nstiffness_N_per_m = 75000.0\nrange_N = 600.0\n"
    )
    command = ("compare", alone, "--area", "back_of_hand")
    of_map = ask(*command)[1]["allowed"][0]
    assert 0 < of_map["confirmed_places"] < of_map["places"] == 20
    text = " ".join(forcemap(*command)[1].split())
    without = 20 - of_map["confirmed_places"]
    assert f"at 280 N: {without} of 20 places have no speed, most of them for this: the place lies outside" in text
    assert "of 15 states" in text


def test_a_publication_without_a_moving_mass_keeps_the_maps_of_two_dimensions(alone, forcemap, tmp_path):
    code, out, _ = forcemap("publication", alone, "-o", tmp_path / "bundle", "--area", "back_of_hand")
    assert code == 0
    rows = (tmp_path / "bundle" / "tables" / "accuracy.csv").read_text().splitlines()
    assert {row.split(",")[0] for row in rows[1:]} == {"CFM_3D", "CFM_2D", "CFM_2D per height"}
    assert "tables/accuracy.csv, contact model: " in " ".join(out.split())
    assert "as it was measured: `impacts.csv` |" in (tmp_path / "bundle" / "README.md").read_text()
