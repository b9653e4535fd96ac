"""What a table says against itself: exchanged columns and rows, names, base angles; a doubt, said before speeds."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from oracle import printed_force, training_grid

import forcemap as fm
from forcemap.words import sentence

AXES = ("distance", "height", "speed")
PAIRS = {0: "distance and height", 1: "distance and speed", 2: "height and speed"}
EXCHANGES = list(itertools.combinations(range(3), 2))
NAMES = ["ur10e", "kuka-iiwa7-30nm"]


def impacts(name, seed=0):
    """Coordinates, names as a plan gives them, and forces of a training grid, three repeats a state."""
    rng, grid = np.random.default_rng(seed), training_grid(name)
    names = np.array(["-".join(f"{a}{round(1000 * x)}" for a, x in zip("dhv", state, strict=True)) for state in grid])
    force = printed_force(name, *grid.T) * np.exp(rng.normal(0, 0.02, len(grid)))
    return np.repeat(grid, 3, axis=0), np.repeat(names, 3), np.repeat(force, 3) + rng.normal(0, 1, 3 * len(grid))


def table(at, force, state=None, **also):
    return fm.ImpactDataset.from_arrays(**dict(zip(AXES, at.T, strict=True)), peak_force=force, state=state, **also)


def exchanged(at, one, other, rows=slice(None)):
    swapped = at.copy()
    swapped[rows, one], swapped[rows, other] = at[rows, other], at[rows, one]
    return swapped


def kinds(dataset):
    return [each.kind.value for each in dataset.contradictions]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", NAMES)
def test_a_sound_table_raises_no_doubt(name, seed, examples):
    at, names, force = impacts(name, seed)
    assert kinds(table(at, force, names)) == kinds(table(at, force)) == []
    assert kinds(examples[name]) == []


@pytest.mark.parametrize(("device_range", "said"), [(50.0, True), (250.0, True), (500.0, False)])
def test_readings_far_above_the_device_range_are_said(device_range, said):
    """No device gives them: the range is mistyped."""
    at, names, force = impacts("ur10e")
    force = np.minimum(force, 510.0)
    device = fm.Conditions(device=fm.Device(range=device_range))
    dataset = table(at, force, names, censored=force >= device_range, conditions=device)
    assert ("range_exceeded_far" in kinds(dataset)) == said
    if (force >= device_range).all():
        with pytest.raises(fm.ForcemapError, match=r"above the device range of 50 N.*is device\.range_N"):
            fm.fit_force_map(dataset)


def test_the_range_that_counts_is_the_stated_one_of_each_device():
    """Not the lowest force at which something was cut off, nor the range of the other device."""
    at, names, force = impacts("ur10e")
    force = np.minimum(force, 510.0)
    cut = (force >= 500.0) | (np.arange(force.size) == int(force.argmin()))  # one was cut off low down
    weak, strong = fm.Device(range=250.0), fm.Device(range=500.0)
    alone = fm.Conditions(device=strong)
    assert kinds(table(at, force, names, censored=cut, conditions=alone)) == []
    assert kinds(table(at, force, names, censored=np.ones(force.size, dtype=bool), conditions=alone)) == []
    fits = force < 250.0
    named = np.where(fits, np.char.add("weak ", names), np.char.add("strong ", names))
    both = fm.Conditions(device=weak, devices=(("weak *", weak), ("strong *", strong)))
    assert "range_exceeded_far" not in kinds(table(at, force, named, censored=~fits, conditions=both))
    swapped = fm.Conditions(device=weak, devices=(("weak *", strong), ("strong *", weak)))
    (found,) = (
        each
        for each in table(at, force, named, censored=~fits, conditions=swapped).contradictions
        if "range" in each.kind.value
    )
    assert (found.figure("range_N"), found.figure("impacts")) == (250.0, int((force > 300.0).sum()))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("pair", EXCHANGES)
@pytest.mark.parametrize("name", NAMES)
def test_exchanged_columns_are_said(name, pair, seed):
    at, names, force = impacts(name, seed)
    swapped = exchanged(at, *pair)
    found = table(swapped, force, names).contradictions[0]
    assert (found.kind, found.figure("exchanged")) == ("named_otherwise", PAIRS[EXCHANGES.index(pair)])
    without_names = kinds(table(swapped, force))
    assert without_names == (["higher_than_far"] if pair == (0, 1) else ["force_falls_with_speed"])


@pytest.mark.parametrize("pair", EXCHANGES[:2])
@pytest.mark.parametrize("state", range(0, 27, 5))
def test_a_row_that_was_exchanged_is_said(pair, state):
    at, names, force = impacts("ur10e", state)
    swapped = exchanged(at, *pair, rows=slice(3 * state, 3 * state + 3))
    by_name, by_place = table(swapped, force, names), table(swapped, force)
    assert by_name.contradictions[0].figure("state") == names[3 * state]
    (found,) = by_place.contradictions
    assert (found.kind, found.figure("other")) == ("state_exchanged", AXES[pair[1]])
    assert [
        found.figure(f"{axis}_{unit}") for axis, unit in zip(AXES, ("m", "m", "mps"), strict=True)
    ] == pytest.approx(swapped[3 * state].tolist())


@pytest.mark.parametrize(
    ("name", "at", "doubtful"),
    [
        ("d500-h150-v250", (0.5, 0.15, 0.25), False),
        ("next-d500-h-150-v250", (0.5, -0.15, 0.25), False),
        ("D50_H15_V25", (0.5, 0.15, 0.25), False),  # hundredths
        ("d500-h150-v250", (0.508, 0.145, 0.31), False),  # the place and speed as they were measured
        ("d500-h150-v250", (0.52, 0.15, 0.25), True),
        ("d500-h150-v250", (0.15, 0.5, 0.25), True),
        ("d500-h150-v250", (0.5, 0.15, 0.4), True),
        ("d500-h-150-v250", (0.5, 0.15, 0.25), True),
        ("corner", (0.52, 0.15, 0.25), False),
    ],
)
def test_a_name_that_contradicts_its_row(name, at, doubtful):
    others = np.array([[0.6, 0.2, 0.2], [0.7, 0.3, 0.3], [0.65, 0.25, 0.25]])
    hundredths = name.startswith("D50_")
    names = [name, *(("d60h20v20", "d70h30v30") if hundredths else ("d600-h200-v200", "d700-h300-v300")), "my own"]
    dataset = table(np.vstack([at, others]), [200, 150, 210, 180], names)
    assert kinds(dataset) == (["named_otherwise"] if doubtful else [])


def test_names_state_speeds_as_the_campaign_does():
    at, names, force = impacts("ur10e")
    dataset = table(at, force, names)
    dataset = dataclasses.replace(dataset, conditions=dataclasses.replace(dataset.conditions, speed_error=0.08))
    assert dataset.speed[0] < dataset.stated_speed[0]
    assert kinds(dataset) == []


def test_the_doubt_stands_before_every_speed_and_stays_with_the_map(tmp_path):
    at, names, force = impacts("ur10e")
    swapped = exchanged(at, 0, 1, rows=slice(3))
    force_map = fm.fit_force_map(table(swapped, force, names, device_stiffness=75_000.0))
    fm.write_map(force_map, tmp_path / "map.json")
    for each in (force_map, fm.read_map(tmp_path / "map.json")):
        found = fm.safe_speed(each, 0.7, 0.3, limit=300.0, bound=fm.FixedMargin(0.1), contact=fm.Contact.QUASI_STATIC)
        said = [sentence(line) for line in found.basis.warnings]
        assert any(f"{names[0]} is at 0.14 m, 0.52 m" in line and "are exchanged" in line for line in said)


def test_fit_and_json_say_it(forcemap, tmp_path):
    at, names, force = impacts("ur10e")
    dataset = table(exchanged(at, 0, 1), force, names)
    fm.write_dataset(dataset, tmp_path / "impacts.csv")
    code, out, _ = forcemap("fit", tmp_path / "impacts.csv")
    assert code == 0
    assert "are distance and height exchanged?" in out.split("CFM_3D")[0]
    assert '"contradictions": [\n  "states that lie' in forcemap("fit", tmp_path / "impacts.csv", "--json")[1]


@pytest.mark.parametrize(
    ("angles", "stated", "opposite"),
    [
        ([0] * 9, 0, 0),
        ([180] * 9, 0, 9),
        ([-90] * 9, 90, 9),
        ([185] * 9, 0, 9),
        ([150] * 9, 0, 0),
        ([0] * 8 + [180], np.nan, 1),
        ([0] * 8 + [np.nan], 0, 0),
        ([np.nan] * 9, 0, 0),
        ([0, 180] * 4 + [0], 90, 0),
        ([0, 90, 180, 270] * 2 + [0], 0, 0),  # a plan that goes around
        ([0, 90, 180] * 3, np.nan, 0),
    ],
)
def test_a_base_angle_off_by_half_a_turn(angles, stated, opposite):
    at, _, force = impacts("ur10e")
    dataset = table(at[:9], force[:9], base_angle=angles, conditions=fm.Conditions(base_angle=stated))
    found = [each.figure("impacts") for each in dataset.contradictions if each.kind == "base_angle_opposite"]
    assert found == ([opposite] if opposite else [])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("cap", [0.25, np.inf])
def test_a_force_that_hardly_rises_with_speed_is_said(name, seed, cap):
    """A robot that its reduced mode holds at a speed was sent to all of them; sound maps rise about as speed does."""
    rng = np.random.default_rng(seed)
    plan = fm.plan_measurements((0.56, 0.86), (0.14, 0.46), (0.2, 0.4), repeats=1, again=0)
    at = np.column_stack([plan.distance, plan.height, plan.speed])
    force = printed_force(name, *at[:, :2].T, np.minimum(at[:, 2], cap)) * np.exp(rng.normal(0, 0.02, len(at)))
    found = table(at, force).contradictions
    assert ("force_levels" in [each.kind.value for each in found]) == np.isfinite(cap)
    if np.isfinite(cap):
        (said,) = (sentence(each) for each in found if each.kind.value == "force_levels")
        assert "did the robot reach the speeds that were planned" in said
