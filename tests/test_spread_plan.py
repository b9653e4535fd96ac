"""Spread plans, the default: corners, a Latin hypercube of places, set-ups of the device, states measured again."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

import forcemap as fm
from forcemap.campaigns.state import places
from forcemap.errors import InputError, TooFewStates
from forcemap.exports.run_sheet import run_sheet
from forcemap.planning.design import Design
from forcemap.words import sentence, sentences
from sizes import FULL_SIZE

RANGES = {"distances": (0.52, 0.89), "heights": (0.14, 0.46), "speeds": (0.1, 0.4)}
UR10E = fm.published_map("ur10e")


def states_of(plan):
    """(distance, height, speed) of each state, in the order in which it is first measured, shape (n, 3)."""
    first = [plan.first_row[name] for name in plan.states]
    return np.column_stack([plan.distance, plan.height, plan.speed])[first]


def place_blocks(plan):
    """Speeds of the runs at each place that the device is put up at, in order: [((d, h), [v, ...]), ...]."""
    runs = zip(plan.distance.tolist(), plan.height.tolist(), plan.speed.tolist(), strict=True)
    return [(place, [v for *_, v in block]) for place, block in itertools.groupby(runs, key=lambda run: run[:2])]


def require_sound(plan, n, count):
    """What every spread plan promises, whatever its ranges."""
    states = states_of(plan)
    assert len(states) == n
    assert plan.places == count
    apart = np.abs(states[:, None] - states[None]) > np.array([0.005, 0.005, 0.010])
    assert apart.any(axis=2)[~np.eye(n, dtype=bool)].all()  # none would pass for a repeat of another
    place = places(plan.distance, plan.height)
    alike = np.unique(np.column_stack([place, plan.distance, plan.height]), axis=0)
    assert len(alike) == count  # the states of a place lie at one place
    design = fm.CFM_3D.design(*states.T)
    assert np.linalg.matrix_rank(design / np.linalg.norm(design, axis=0)) == 9
    rng = np.random.default_rng(0)
    force = np.exp(rng.normal(5.0, 0.02, n))
    dataset = fm.ImpactDataset.from_arrays(
        distance=states[:, 0], height=states[:, 1], speed=states[:, 2], peak_force=force
    )
    fm.ToleranceBound().require(fm.fit_force_map(dataset))


RANGE = st.tuples(st.floats(0.2, 1.0), st.floats(0.25, 0.8)).map(lambda x: (x[0], x[0] + x[1]))
SPEEDS = st.tuples(st.floats(0.03, 0.3), st.floats(0.25, 1.0)).map(lambda x: (x[0], x[0] + x[1]))


@settings(max_examples=40 if FULL_SIZE else 12)
@given(RANGE, RANGE, SPEEDS, st.integers(18, 60), st.integers(9, 30), st.integers(0, 9))
def test_any_range_any_number_of_states_and_places(distances, heights, speeds, n, count, seed):
    count = min(count, n - 4)
    ranges = {"distances": distances, "heights": (heights[0] - 0.5, heights[1] - 0.5), "speeds": speeds}
    options = {"states": n, "places": count, "repeats": 2, "seed": seed}
    if n - 8 > (count - 4) * (math.floor((speeds[1] - speeds[0]) / 0.011) - 1):
        with pytest.raises(InputError, match="no more speeds fit between the slowest and the fastest"):
            fm.plan_measurements(**ranges, **options)
        return
    plan = fm.plan_measurements(**ranges, **options)
    require_sound(plan, n, count)
    corners = set(itertools.product(*ranges.values()))
    assert corners <= {tuple(state) for state in states_of(plan).tolist()}
    inside = np.array([state for state in states_of(plan).tolist() if tuple(state) not in corners])
    low, high = np.array(list(ranges.values())).T
    assert np.all((low < inside) & (inside < high))
    # Latin: no two places in between share a distance or a height.
    between = {(d, h) for d, h, _ in inside.tolist()}
    assert len({d for d, _ in between}) == len({h for _, h in between}) == len(between) == count - 4
    per_place = [len(set(v)) for place, v in place_blocks(plan) if place in between]
    assert max(per_place) - min(per_place) <= 1
    # The device is put up once at each place, and thrice more at the end.
    blocks = place_blocks(plan)
    assert len(blocks) == plan.set_ups == count + 3
    assert len({place for place, _ in blocks[:count]}) == count
    assert all(v == sorted(v) for _, v in blocks)
    again = fm.plan_measurements(**ranges, **options)
    assert all(np.array_equal(plan.arrays[name], again.arrays[name]) for name in ("state_id", "repeat", "role"))


def test_the_default():
    plan = fm.plan_measurements(**RANGES)
    require_sound(plan, 27, 14)
    assert (len(plan), plan.set_ups, plan.minutes()) == (90, 17, 260.0)
    assert plan.minutes(place=20, impact=0.5) == 17 * 20 + 45
    assert [each.kind for each in plan.warnings] == [fm.FindingKind.PLANNED_SLOW]  # from 0.1 m/s
    assert plan.left_out == fm.plan_measurements(**{**RANGES, "speeds": (0.2, 0.4)}).warnings == ()
    assert sentence(plan.note).startswith("27 states spread over 14 places: the corners at the slowest and the fastest")
    states = states_of(plan)
    np.testing.assert_array_equal(states, states.round(3))
    speeds = {v for v in states[:, 2].tolist() if 0.1 < v < 0.4}
    assert speeds == {0.15, 0.2, 0.25, 0.3, 0.35}
    # places in between are far apart: no square of a quarter of both ranges is without one
    share = (states[:, :2] - [0.52, 0.14]) / [0.37, 0.32]
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 21)] * 2), axis=-1).reshape(-1, 2)
    assert np.linalg.norm(grid[:, None] - share[None], axis=2).min(axis=1).max() < 0.27


def test_the_order_meets_the_largest_forces_between_slower_and_weaker_ones(full_size):
    """Corners first, from far and high to near and low; the others in an order that tells nothing of where they lie."""
    seen = []
    for seed in range(60 if full_size else 20):
        blocks = place_blocks(fm.plan_measurements(**RANGES, repeats=1, again=0, seed=seed))
        assert [place for place, _ in blocks[:4]] == [(0.89, 0.46), (0.89, 0.14), (0.52, 0.46), (0.52, 0.14)]
        seen.append([place[0] for place, _ in blocks[4:]])
    when = np.arange(10)
    correlation = [np.corrcoef(when, distances)[0, 1] for distances in seen]
    assert abs(np.mean(correlation)) < 4 * np.std(correlation) / math.sqrt(len(seen))
    assert np.std(correlation) < 0.45


def test_measured_again_at_the_end_is_no_repeat_and_no_test_of_the_map():
    plan = fm.plan_measurements(**RANGES)
    last = slice(81, 90)
    assert set(plan.role[:81]) == {"train"}
    assert set(plan.role[last]) == {"test"}
    assert plan.repeat[last].tolist() == [4, 5, 6] * 3
    assert plan.again == tuple(sorted(set(plan.state_id[last].tolist())))
    assert set(plan.speed[last]) == {0.1}
    assert len(place_blocks(plan.select(np.arange(81, 90)))) == 3
    assert len(set(plan.recording.tolist())) == 90
    none = fm.plan_measurements(**RANGES, again=0)
    assert (len(none), none.again, none.set_ups) == (81, (), 14)

    rng = np.random.default_rng(3)
    force = UR10E.predict(plan.distance, plan.height, plan.speed) * rng.normal(1, 0.002, 90)
    force[last] *= 1.05  # drift
    dataset = fm.ImpactDataset.from_arrays(
        distance=plan.distance, height=plan.height, speed=plan.speed, peak_force=force,
        state=plan.state_id, repeat=plan.repeat, role=plan.role, recording=plan.recording,
    )  # fmt: skip
    found, before = fm.repeatability(dataset), fm.repeatability(dataset.train)
    assert found.within_state_sd_percent == pytest.approx(before.within_state_sd_percent, rel=0.2)
    assert found.outliers == ()
    assert len(dataset.independent_test) == 0
    force_map = fm.fit_force_map(dataset)
    assert (len(force_map.fit.states), int(force_map.fit.states.impacts.sum())) == (27, 81)
    np.testing.assert_array_equal(force_map.coefficients, fm.fit_force_map(dataset.train).coefficients)


def test_a_campaign_on_disk_keeps_the_roles(tmp_path, ask):
    options = ("--distances-m", "0.52,0.89", "--heights-m", "0.14,0.46", "--speeds-mps", "0.1,0.4",
               "--device-range-N", 500, "--repeats", 1)  # fmt: skip
    code, found = ask("plan", tmp_path / "plan", *options, "--minutes-per-place", 6, "--minutes-per-impact", 2)
    assert (code, found["states"], found["places"], found["set_ups"], found["minutes"]) == (0, 27, 14, 17, 162)
    assert ask("simulate", tmp_path / "plan", "--preset", "ur10e-like", "-o", tmp_path / "cell")[0] == 0
    code, found = ask("collect", tmp_path / "cell")
    assert (code, found["used"], found["states"], found["missing"]) == (0, 30, 27, [])
    dataset = fm.read_dataset(tmp_path / "cell")
    assert (len(dataset.train), len(dataset.test)) == (27, 3)
    assert set(dataset.test.repeat.tolist()) == {2}
    assert ask("collect", tmp_path / "cell")[0] == 0  # again: nothing is taken for another
    assert fm.read_dataset(tmp_path / "cell").binding.refusal is None


def test_the_sheet_goes_from_place_to_place():
    plan = fm.plan_measurements(**RANGES, expected_force=UR10E, device=fm.Device(range=700, error=3))
    lines = run_sheet(plan, UR10E.conditions)
    assert max(map(len, lines)) <= 100
    heads = [line for line in lines if line.startswith("d = ")]
    assert len(heads) == plan.set_ups == 17
    assert heads[0] == "d = 0.89 m, h = 0.46 m"
    rows = [line.split() for line in lines if "____" in line]
    assert [row[1] for row in rows] == plan.recording.tolist()
    assert [float(row[2]) for row in rows] == plan.speed.tolist()
    assert not any(line.startswith("v = ") for line in lines)


@pytest.mark.parametrize("reach", [0.75, 0.85, 0.95])
def test_places_beyond_reach_move_inwards(reach):
    plan = fm.plan_measurements(**RANGES, reach=reach)
    require_sound(plan, 27, 14)
    assert plan.left_out == ()
    assert np.hypot(plan.distance, plan.height).max() <= reach
    (line, *_) = sentences(plan.warnings)
    assert line.startswith(f"the places end within the reach of {reach:g} m: d = 0.")
    states = states_of(plan)
    for height in (states[:, 1].min(), states[:, 1].max()):  # corners at the ends of what is within reach
        there = states[states[:, 1] == height]
        assert set(there[:, 2]) == {0.1, 0.4}
        assert there[:, 0].min() == 0.52
        assert there[:, 0].max() == pytest.approx(min(0.89, math.sqrt(reach**2 - height**2)), abs=0.001)


def test_reach_that_leaves_no_room_is_refused():
    for reach in (0.1, 0.53, 0.56):
        with pytest.raises(InputError, match=rf"(?=.*a larger reach)(?=.*(the reach of|reach: found) {reach:g} m)"):
            fm.plan_measurements(**RANGES, reach=reach)
    for reach in (0.1, 0.4, 0.538):
        with pytest.raises(InputError, match=r"the lowest distance, 0.52 m, at the lowest height, 0.14 m, is beyond"):
            fm.plan_measurements(**RANGES, reach=reach)
    with pytest.raises(InputError, match=r"at the highest height, -0.2 m, is beyond the reach, 0.539 m"):
        fm.plan_measurements(**(RANGES | {"distances": (0.5, 0.9), "heights": (-0.6, -0.2)}), reach=0.5)
    with pytest.raises(InputError, match=r"or at most 10 places: .* within the reach of 0.63 m have no room for 14"):
        fm.plan_measurements(**RANGES, reach=0.63)
    assert fm.plan_measurements(**RANGES, reach=0.63, places=10).places == 10


@settings(max_examples=60 if FULL_SIZE else 20)
@given(RANGE, RANGE, st.floats(0.05, 1.8), st.integers(0, 9))
def test_no_place_lies_outside_the_ranges_or_the_reach(distances, heights, reach, seed):
    heights = heights[0] - 0.5, heights[1] - 0.5
    nearest = math.hypot(distances[0], min(max(heights[0], 0.0), heights[1]))
    ranges = {"distances": distances, "heights": heights, "speeds": (0.1, 0.4)}
    if nearest > reach:
        with pytest.raises(InputError, match="is beyond the reach"):
            fm.plan_measurements(**ranges, reach=reach)
        return
    try:
        plan = fm.plan_measurements(**ranges, reach=reach, seed=seed, repeats=1, again=0)
    except InputError as error:
        assume("no room for 14" not in str(error))
        raise
    at = np.column_stack([plan.distance, plan.height])
    assert np.hypot(*at.T).max() <= reach
    for axis, ends in enumerate((distances, heights)):
        assert ends[0] <= at[:, axis].min() < at[:, axis].max() <= ends[1]
        between = np.setdiff1d(at[:, axis], ends)
        np.testing.assert_array_equal(between, between.round(3))


@pytest.mark.parametrize(("heights", "count"), [((0.14, 0.17), 14), ((0.14, 0.18), 20)])
def test_places_of_a_narrow_range_are_rounded(heights, count):
    plan = fm.plan_measurements((0.3, 0.9), heights, (0.1, 0.4), places=count)
    assert plan.places == count
    np.testing.assert_array_equal(plan.height, plan.height.round(3))


def test_the_order_is_told_from_the_states_not_from_counts():
    for states, count in ((31, 27), (28, 24), (30, 26), (18, 14)):
        assert fm.plan_measurements(**RANGES, states=states, places=count).by_place
    assert fm.plan_measurements(**(RANGES | {"speeds": (0.1, 0.12)}), states=18).by_place
    for design in (Design.PAPER, Design.FULL_GRID):
        assert not fm.plan_measurements(**RANGES, design=design, again=2).by_place
    # a grid within 20 mm is one place, at which the device is put up once, and yet goes from speed to speed
    assert not fm.plan_measurements((0.5, 0.513), (0.1, 0.113), (0.1, 0.4), design=Design.PAPER).by_place


@pytest.mark.parametrize("options", [{"places": 12}, {"states": 27}, {"expected_force": UR10E, "limit": 140.0}])
def test_an_i_optimal_plan_goes_place_by_place(options):
    plan = fm.plan_measurements(**RANGES, design=Design.I_OPTIMAL, **options)
    blocks = place_blocks(plan)
    assert plan.by_place
    assert len(blocks) == plan.set_ups == plan.places <= options.get("places", 27)
    assert all(v == sorted(v) for _, v in blocks)
    assert [place for place, _ in blocks[:4]] == [(0.89, 0.46), (0.89, 0.14), (0.52, 0.46), (0.52, 0.14)]
    assert all({v[0], v[-1]} == {0.1, 0.4} for _, v in blocks[:4])


@pytest.mark.parametrize("largest", [300.0, 350.0, 400.0, 500.0])
def test_states_that_the_device_cannot_measure_are_slower(largest):
    device = fm.Device(range=largest, error=3.0)
    plan = fm.plan_measurements(**RANGES, expected_force=UR10E, device=device)
    assert len(plan.states) == 27
    assert np.all(plan.expected_force <= largest - 3)
    states = states_of(plan)
    slowest, fastest = (UR10E.predict(0.52, 0.14, v) for v in (0.1, 0.4))
    assert slowest < largest - 3 < fastest
    near = states[(states[:, 0] == 0.52) & (states[:, 1] == 0.14), 2]
    assert near.max() == pytest.approx(UR10E.crossing_speed(0.52, 0.14, largest - 3), abs=0.006)
    line = next(line for line in sentences(plan.warnings) if "the fastest speed is lowered" in line)
    assert f"to {near.max():g} m/s at the least" in line
    require_sound(plan, 27, 14)


def test_places_too_forceful_at_any_speed_are_left_out_and_listed():
    def force(d, h, v):
        return 900.0 if d < 0.56 else 100 + 300 * v

    device = fm.Device(range=500.0, error=3.0)
    plan = fm.plan_measurements(**RANGES, expected_force=force, device=device)
    assert len(plan.states) == 27
    assert plan.places + len(plan.left_out) == 14
    assert plan.distance.min() > 0.56
    assert all("900 N expected, the device measures up to 497 N" in line for line in sentences(plan.left_out))
    with pytest.raises(InputError, match=r"places: found 0 of 14, expected at least 9: .* more is expected at 0.1 m/s"):
        fm.plan_measurements(**RANGES, expected_force=lambda d, h, v: 600.0, device=device)


def test_fewer_states_are_a_choice():
    plan = fm.plan_measurements(**RANGES, states=18)
    assert (len(plan.states), plan.places) == (18, 14)
    assert not any("fewer than 18" in line for line in sentences(plan.warnings))
    plan = fm.plan_measurements(**RANGES, states=14)
    assert (len(plan.states), plan.places) == (14, 10)
    assert sentence(plan.warnings[0]).startswith("14 states to train, fewer than 18: the bound is expected to lie")


def test_a_limit_is_asked_of_the_slowest_speed_at_every_place():
    plan = fm.plan_measurements(**RANGES, expected_force=UR10E, limit=140.0)
    (line,) = [line for line in sentences(plan.warnings) if "may be too fast for 140 N" in line]
    at = np.unique(states_of(plan)[:, :2], axis=0)
    exceeding = int(np.sum(1.1 * UR10E.predict(at[:, 0], at[:, 1], 0.1) > 140))
    assert 0 < exceeding < 14
    assert f"at {exceeding} of 14 places" in line


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"distances": (0.5, 0.7, 0.9)}, r"distances: found 3 values, give the lowest and highest, or --design paper"),
        ({"heights": 0.5}, "heights: found 1 value, give the lowest and highest"),
        ({"speeds": (0.2, 0.205)}, "speeds: found 0.2 and 0.205, expected values more than 0.01 apart"),
        ({"places": 8}, r"places: found 8, expected at least 9: fewer do not tell how far forces scatter"),
        ({"places": 12.5}, "places: found 12.5, expected a whole number"),
        ({"states": 0}, "states: found 0, expected a whole number"),
        ({"again": 15}, "again: found 15, expected at most 14, the number of places"),
        ({"again": -1}, "again: found -1"),
        ({"distances": (0.5, 0.54), "heights": (0.1, 0.13)}, "places: found 14, expected wider ranges: .* at least 9"),
        ({"distances": (0.52, 0.6), "heights": (0.14, 0.2), "places": 9}, "places: found 9, expected wider ranges: "),
        ({"speeds": (0.1, 0.14), "states": 60}, "states: found 60, expected at most 28 at these 14 places"),
        (
            {"places": 14, "design": Design.PAPER},
            "places: found 14, expected none: those of --design paper are its grid",
        ),
    ],
)
def test_what_cannot_be_spread_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        fm.plan_measurements(**(RANGES | change))


def test_a_form_that_the_states_do_not_determine():
    assert fm.plan_measurements(**RANGES, form=fm.FULL_CUBIC, states=36).places == 14
    with pytest.raises(TooFewStates, match="do not determine FULL_CUBIC"):
        fm.plan_measurements(**RANGES, form=fm.FULL_CUBIC, states=18)


@pytest.mark.parametrize(
    ("asked", "found", "states", "count"),
    [
        ({"states": 12}, "states: found 12", 14, 10),
        ({"states": 13}, "states: found 13", 14, 10),  # at 9 places only the corners would be measured twice
        ({"states": 9, "places": 9}, "places: found 9 with 9 states", 14, 9),
        ({"places": 27}, "places: found 27 with 27 states", 31, 27),
        ({"states": 20, "places": 17}, "places: found 17 with 20 states", 21, 17),
        ({"states": 18, "form": fm.FULL_CUBIC}, "states: found 18", 24, 14),
    ],
)
def test_a_refusal_for_want_of_states_names_the_number_that_works(asked, found, states, count):
    with pytest.raises(TooFewStates, match=f"^{found}, .* at least {states} states for {count} places .--states"):
        fm.plan_measurements(**RANGES, **asked)
    plan = fm.plan_measurements(**RANGES, **(asked | {"states": states}))
    assert (len(plan.states), plan.places) == (states, count)
    with pytest.raises(TooFewStates):
        fm.plan_measurements(**RANGES, **(asked | {"states": states - 1}))


def test_states_are_measured_again_of_other_designs_when_asked():
    plan = fm.plan_measurements(**RANGES, design=Design.PAPER, again=2)
    assert (len(plan), plan.role.tolist().count("test"), len(plan.again)) == (87, 6, 2)
    angles = fm.plan_measurements(**RANGES, design=Design.SYMMETRY, base_angles=(0, 90), repeats=1, again=1)
    assert angles.base_angle.tolist()[-3:] == [0.0, 90.0, 0.0]
