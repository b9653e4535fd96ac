"""Inputs that once raised, or could raise, a speed unnoticed: each must be refused, or change nothing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from oracle import printed_force, simulate, training_grid

import forcemap as fm
from forcemap.errors import TableError
from forcemap.limits.pfl import pfl_pressure_speed_limit
from forcemap.maps.forms import Term
from forcemap.words import assumptions, sentence

QUASI_STATIC = fm.Contact.QUASI_STATIC

HAND = fm.force_limit("back_of_hand")


@pytest.mark.parametrize("name", ["kuka-iiwa7-30nm", "kuka-iiwa7-10nm"])
def test_contact_by_name_meets_the_same_gate(name):
    options = {"limit": HAND, "bound": fm.FixedMargin()}
    found = fm.safe_speed(fm.published_map(name), 0.8, 0.4, contact="transient", **options)
    assert found.outcome is fm.SpeedOutcome.UNCONFIRMED
    assert (HAND.force("transient"), HAND.force("quasi-static")) == (280, 140)
    with pytest.raises(fm.InputError, match="contact"):
        fm.safe_speed(fm.published_map(name), 0.8, 0.4, contact="gentle", **options)
    with pytest.raises(fm.InputError, match="contact"):
        HAND.force("gentle")


@given(
    st.sampled_from(["height", "speed", "distance"]),
    st.sampled_from([0.0, 5e-17, 1e-12, 1e-9, 1e-8, 1e-6, 3e-5, 1e-3]),
    st.integers(0, 2**32 - 1),
)
def test_property_nearly_flat_plans_open_nothing_outside_their_box(flat, noise, seed):
    rng = np.random.default_rng(seed)
    points = training_grid("ur10e")
    axis = ("distance", "height", "speed").index(flat)
    points = points[points[:, axis] == np.median(points[:, axis])].copy()
    points[:, axis] += rng.uniform(-noise, noise, len(points))
    measured = fm.fit_force_map(
        fm.ImpactDataset.from_arrays(
            distance=points[:, 0], height=points[:, 1], speed=points[:, 2], peak_force=np.full(len(points), 200.0)
        ),
        form=fm.Form.of("constant", ["1"]),
    ).measured_range
    places = rng.uniform([0.0, 0.0], [3.0, 1.0], (200, 2))
    places[:50, 1] = np.median(points[:, 1])
    places[50:100, 0] = np.median(points[:, 0])
    low, high = measured.speeds(*places.T)
    inside = ~np.isnan(low)
    box_low, box_high = points.min(axis=0) - 1e-9, points.max(axis=0) + 1e-9
    assert ((places[inside] >= box_low[:2]) & (places[inside] <= box_high[:2])).all()
    assert (low[inside] >= box_low[2]).all()
    assert (high[inside] <= box_high[2]).all()
    at_low, at_high = measured.speeds(points[:, 0], points[:, 1])
    assert (at_low - 1e-6 <= points[:, 2]).all()
    assert (points[:, 2] <= at_high + 1e-6).all()


def test_one_height_whose_digits_differ_in_the_last_place():
    d, v = (axis.ravel() for axis in np.meshgrid([0.5, 0.6, 0.7, 0.75, 0.8, 0.9], [0.1, 0.2, 0.3, 0.4], indexing="ij"))
    h = np.full(24, 0.3)
    h[[1, 3, 4, 14, 17, 18, 19]] = 0.1 + 0.2
    force = np.round(np.exp(4 + 3 * v - 0.6 * d), 1)
    cell = fm.Conditions(device=fm.Device(range=300.0))
    dataset = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force, conditions=cell)
    force_map = fm.fit_force_map(dataset, form=fm.CFM_2D)
    found = fm.safe_speed(
        force_map, [0.05, 0.49, 0.7, 0.91], [0.3] * 4, limit=250.0, contact=QUASI_STATIC, bound=fm.ToleranceBound()
    )
    assert [outcome.has_speed for outcome in found.outcome] == [False, False, True, False]


@pytest.mark.parametrize("named", ["as they were", "first repeat otherwise", "first measured otherwise"])
def test_states_measured_again_tell_a_drift_whatever_their_names(named):
    """By place and speed they are the same states; by other names they told nothing."""
    points = training_grid("ur10e")
    force = printed_force("ur10e", *points.T) * np.exp(np.random.default_rng(3).normal(0, 0.01, 27))
    twice = [0, 13, 26]
    rows = np.concatenate([np.repeat(np.arange(27), 2), np.repeat(twice, 2)])
    role = np.array(["train"] * 54 + ["test"] * 6)
    state = np.array([f"s{row}" for row in rows], dtype=object)
    if named == "first repeat otherwise":
        state[[2 * row for row in twice]] = [f"a{row}" for row in twice]
    if named == "first measured otherwise":
        state[[2 * row + k for row in twice for k in (0, 1)]] = [f"s{row}-first" for row in twice for _ in (0, 1)]
    d, h, v = points[rows].T
    again = np.where(role == "test", 1.3, 1.0)
    dataset = fm.ImpactDataset.from_arrays(
        distance=d, height=h, speed=v, peak_force=force[rows] * again, state=state, role=role
    )
    drift = fm.fit_force_map(dataset).fit.drift
    assert (dataset.drift.states, drift.states, drift.significant) == (3, 3, True)
    assert drift.change == pytest.approx(0.3)
    assert len(dataset.disagreeing_repeats) == 3
    assert len(dataset.independent_test) == 0
    assert ("as close as repeats and so one" in dataset.states_found) == (named == "first repeat otherwise")


def measured_again(change, slower, confirming=False):
    """27 states at 0.1 to 0.3 m/s, six of them again, `slower` [m/s] and with forces `change` times as large."""
    rng = np.random.default_rng(1)

    def force(d, h, v):
        return 900 * v**1.05 * (d / 0.6) ** -0.6 * (1 + 0.3 * h)

    rows = []
    grid = [(d, h, v) for d in (0.55, 0.7, 0.85) for h in (0.15, 0.3, 0.45) for v in (0.1, 0.2, 0.3)]
    for k, (d, h, v) in enumerate(grid):
        own = rng.normal(0, 0.01)
        rows += [(d, h, v, force(d, h, v) * np.exp(own + rng.normal(0, 0.005)), f"S{k}", "train") for _ in range(3)]
        if k in (0, 3, 6, 9, 12, 15):
            again = force(d, h, v - slower) * change * np.exp(rng.normal(0, 0.01))
            rows += [(d, h, v - slower, again * np.exp(rng.normal(0, 0.005)), f"S{k}", "test") for _ in range(3)]
            rows += [(d, h, v + 0.004, force(d, h, v + 0.004), f"c-{k}", "test")] * confirming
    names = ("distance", "height", "speed", "peak_force", "state", "role")
    return fm.ImpactDataset.from_arrays(**dict(zip(names, map(list, zip(*rows, strict=True)), strict=True)))


@pytest.mark.parametrize("change", [1.0, 1.08, 1.1, 1.11])
@pytest.mark.parametrize("slower", [0.0, 0.009])
def test_a_drift_is_told_whatever_the_speed_of_the_impacts_made_again(change, slower):
    """9 mm/s are 9 % of 0.1 m/s: impacts made again so much slower hid as large a drift."""
    drift = measured_again(change, slower).drift
    assert drift.states == 6
    assert drift.change == pytest.approx(change - 1, abs=0.015)
    assert drift.significant == (change > 1)


@pytest.mark.parametrize("change", [1.03, 1.04, 1.05])
@pytest.mark.parametrize("faster", [0.0, 0.0099])
def test_a_drift_is_not_hidden_by_faster_repeats_where_the_force_hardly_rises(change, faster):
    """A robot that feels slow contacts late: ln F rises by 0.1 of ln v below 0.15 m/s, by 0.9 above."""
    rng = np.random.default_rng(2)

    def force(v):
        return 200 * (v / 0.15) ** (0.1 if v < 0.15 else 0.9)

    rows = []
    for k, (d, h) in enumerate((d, h) for d in (0.55, 0.7, 0.85) for h in (0.15, 0.3, 0.45)):
        for v in (0.1, 0.2, 0.3):
            rows += [(d, h, v, force(v) * np.exp(rng.normal(0, 0.004)), f"S{k}-{v}", "train") for _ in range(3)]
        if k in (0, 4, 8):
            again = force(0.1 + faster) * change
            made = [(d, h, 0.1 + faster, again * np.exp(rng.normal(0, 0.004)), f"S{k}-0.1", "test") for _ in range(3)]
            rows += made
    names = ("distance", "height", "speed", "peak_force", "state", "role")
    columns = dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))
    drift = fm.ImpactDataset.from_arrays(**columns).drift
    assert drift.significant
    assert drift.change > change - 1 - 0.012


@pytest.mark.parametrize("change", [1.05, 1.3])
def test_states_measured_again_are_not_lost_in_a_confirming_state_beside_them(change):
    dataset = measured_again(change, 0.0, confirming=True)
    assert (dataset.drift.states, dataset.drift.significant) == (6, True)
    assert dataset.drift.change == pytest.approx(change - 1, abs=0.015)
    assert not any(name.startswith("c-") for name in dataset.disagreeing_repeats)
    assert {name for name in dataset.state if name.startswith("c-")} == {f"c-{k}" for k in (0, 3, 6, 9, 12, 15)}
    assert fm.fit_force_map(dataset).fit.drift.significant


@pytest.mark.parametrize(("error", "said"), [(0.0, False), (0.04, False), (0.1, True), (0.3, True)])
def test_a_map_says_that_it_begins_slower_than_tilted_motion_was_tried_by_its_speeds_at_contact(error, said):
    points = training_grid("ur10e")
    d, h, v = points.T
    dataset = fm.ImpactDataset.from_arrays(
        distance=d, height=h, speed=v, peak_force=printed_force("ur10e", *points.T),
        conditions=fm.Conditions(speed_error=error, device=fm.Device(range=1000.0, stiffness=75e3)),
    )  # fmt: skip
    case = {"limit": HAND, "contact": QUASI_STATIC, "bound": fm.ToleranceBound()}
    found = fm.safe_speed(fm.fit_force_map(dataset), 0.7, 0.3, **case).basis.statements
    kinds = [each.kind for each in found]
    assert v.min() == 0.2
    assert (fm.FindingKind.SLOWER_THAN_RAISED in kinds) == said


@pytest.mark.parametrize(("error", "said"), [(0.0, False), (0.1, True)])
def test_a_speed_off_the_direction_is_not_shown_without_what_is_not_known_of_slower_tilted_motion(
    error, said, tmp_path, ask
):
    """Beside the speed along it, in answers, reports and at contact points, where there is one."""
    folder = fm.copy_example("ur10e", tmp_path / "cell")
    toml = folder / "campaign.toml"
    toml.write_text(toml.read_text().replace("[robot]\n", f"[robot]\nspeed_error = {error}\n", 1))
    hand = ("--area", "back_of_hand", "--contact", "transient")
    for height, shown in ((0.4, True), (0.15, False)):
        _, answer = ask("speed", folder, "--distance", "0.6" if height < 0.2 else "0.8", "--height", height, *hand)
        assert (answer["off_direction_to_program_mps"] is not None) == shown
        assert any("single tilted impacts" in line for line in answer["warnings"]) == (said and shown)
    found = fm.assess_campaign(folder, limits=[fm.force_limit("back_of_hand")])
    assert any(each.kind is fm.FindingKind.SLOWER_THAN_RAISED for each in found.findings) == said


@pytest.mark.parametrize("beside", ["a training state", "a test state"])
def test_impacts_that_were_to_confirm_a_map_keep_their_name_beside_other_states(beside):
    """By it they are known: one that fails refuses every speed."""
    points = training_grid("ur10e")
    place = points[13] + (0.001, 0.0, 0.0) if beside == "a training state" else points[13] + (0.03, 0.02, 0.0)
    rows = np.vstack([points, *([place] * (beside == "a test state")), place])
    state = [*(f"s{k}" for k in range(27)), *["a"] * (beside == "a test state"), "c-1"]
    force = printed_force("ur10e", *rows.T) * np.append(np.ones(len(rows) - 1), 1.5)
    dataset = fm.ImpactDataset.from_arrays(
        distance=rows[:, 0],
        height=rows[:, 1],
        speed=rows[:, 2],
        peak_force=force,
        state=state,
        role=["train"] * 27 + ["test"] * (len(rows) - 27),
    )
    assert dataset.state[-1] == "c-1"
    answer = fm.safe_speed(
        fm.fit_force_map(dataset),
        0.7,
        0.3,
        limit=fm.force_limit("back_of_hand"),
        contact=fm.Contact.QUASI_STATIC,
        bound=fm.ToleranceBound(),
    )
    assert any("ABOVE ITS BOUND: c-1" in sentence(each) for each in answer.basis.warnings)
    assert np.isnan(answer.speed)


@pytest.mark.parametrize("seed", range(20))
def test_a_name_for_every_row_does_not_make_states(seed):
    rng = np.random.default_rng(seed)
    points = np.repeat(training_grid("ur10e"), 3, axis=0)
    points = points + rng.uniform(-1, 1, points.shape) * [0.002, 0.002, 0.004]
    force = printed_force("ur10e", *points.T) * np.exp(np.repeat(rng.normal(0, 0.05, 27), 3))
    d, h, v = points.T
    named = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force, state=range(81))
    unnamed = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force)
    assert named.states_found.startswith("by state_id, 81 names of 27 states (as close as repeats and so one: ")
    assert named.states_found.endswith(" and 21 more), repeats within 5 mm and 10 mm/s")
    assert (named.repeat.reshape(27, 3) == [1, 2, 3]).all()
    for name in ("distance", "height", "speed", "force", "impacts"):
        np.testing.assert_array_equal(getattr(named.states, name), getattr(unnamed.states, name))
    bounds = [fm.fit_force_map(each).fit.between_states.degrees_of_freedom for each in (named, unnamed)]
    assert bounds[0] == bounds[1] == 18


@pytest.mark.parametrize("seed", range(20))
def test_scattered_plans_with_names_are_accepted(seed):
    """Two that lie within the tolerance by chance are one state."""
    points = np.random.default_rng(seed).uniform([0.5, 0.1, 0.1], [0.9, 0.5, 0.5], (60, 3))
    d, h, v = points.T
    dataset = fm.ImpactDataset.from_arrays(
        distance=d, height=h, speed=v, peak_force=np.full(60, 200.0), state=[f"s{i}" for i in range(60)]
    )
    assert len(dataset.states) >= 59


@pytest.mark.parametrize("exponents", [{"speed": -1}, {"distance": 0.5}, {"log_speed": -1}, {"height": True}])
def test_terms_have_whole_exponents(exponents):
    with pytest.raises(fm.InputError, match="exponent"):
        Term(**exponents)


@pytest.mark.parametrize(
    ("column", "meant"),
    [("Scenario", "scenario"), ("contact_scenario", "scenario"), ("Censored", "censored"), ("is_censored", "censored"),
     ("phase2_force_n", "phase2_force_N"), ("Phase2 force [N]", "phase2_force_N"), ("roles", "role"),
     ("State_ID", "state_id"), ("Peak_Force_N", "peak_force_N")],
)  # fmt: skip
def test_columns_that_are_slips_are_not_passed_over(tmp_path, column, meant):
    path = tmp_path / "impacts.csv"
    path.write_text(f"distance_m,height_m,speed_mps,peak_force_N,{column}\n0.5,0.2,0.25,200,\n")
    with pytest.raises(TableError, match=meant) as caught:
        fm.read_dataset(path)
    assert caught.value.column == column


@pytest.mark.parametrize("column", ["note", "Bemerkung", "temperature_C", "robot_serial", "peak_force_raw_N", "x"])
def test_other_unknown_columns_are_kept(tmp_path, column):
    path = tmp_path / "impacts.csv"
    path.write_text(f"distance_m,height_m,speed_mps,peak_force_N,{column}\n0.5,0.2,0.25,200,hello\n")
    assert fm.read_dataset(path).extra == {column: ("hello",)}


def test_no_speed_at_or_above_a_censored_impact_at_the_same_place():
    points = training_grid("kuka-iiwa7-10nm")
    force = printed_force("kuka-iiwa7-10nm", *points.T)
    odd = int(np.flatnonzero((points == [0.71, 0.30, 0.30]).all(axis=1))[0])
    censored = np.arange(27) == odd
    d, h, v = points.T
    dataset = fm.ImpactDataset.from_arrays(
        distance=d, height=h, speed=v, peak_force=np.where(censored | (force > 499), 500.0, force),
        censored=censored | (force > 499), state=[f"s{i}" for i in range(27)],
    )  # fmt: skip
    force_map = fm.fit_force_map(dataset)
    found = fm.safe_speed(force_map, 0.71, 0.30, limit=400.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    assert not found.speed >= 0.30  # the censored fit itself takes it for a large force
    discarded = fm.fit_force_map(dataset, impacts=fm.CensoredImpacts.DISCARD)
    found = fm.safe_speed(
        discarded, [0.71, 0.68], [0.30, 0.30], limit=400.0, contact=QUASI_STATIC, bound=fm.ToleranceBound()
    )
    assert set(found.outcome) == {fm.SpeedOutcome.UNCONFIRMED}  # elsewhere, too: the same bound permitted it
    assert np.isnan(found.speed).all()
    assert all(f"s{odd}" in sentence(reason) for reason in found.reason)
    assert any(f"s{odd}" in line for line in assumptions([found.basis]))
    several = fm.safe_speed(
        discarded,
        [0.68, 0.68, 0.71],
        0.30,
        limit=[400.0, 200.0, 200.0],
        contact=QUASI_STATIC,
        bound=fm.ToleranceBound(),
    )
    assert [outcome.has_speed for outcome in several.outcome] == [
        False,
        True,
        True,
    ]  # of several limits each for itself
    assert f"s{odd}" in sentence(several.reason[0])
    slower = fm.safe_speed(discarded, 0.71, 0.30, limit=200.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    assert slower.outcome.has_speed
    assert slower.speed < 0.30


LIMITS = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor"


def test_names_in_a_users_table_are_found_however_they_are_written(tmp_path):
    path = tmp_path / "ours.csv"
    path.write_text(f"{LIMITS}\npalm_dominant,P,hand_fingers,260,140,2\nForehead X,F,Hand-Fingers,190,65,0\n")
    limit = fm.force_limit("hand fingers", table=fm.read_limit_table(path))
    assert not limit.permitted
    assert limit.tabulated_quasi_static == 65


@pytest.mark.parametrize(
    "text",
    [
        f"{LIMITS},quasi_static_force_N\npalm,P,hand,260,140,2,1400\n",
        f"{LIMITS}\npalm,P,hand,260,1e9,2\n",
        f"{LIMITS}\npalm,P,hand,260,1_40,2\n",
        f"{LIMITS}\npalm,P,hand,260,140,2\nPalm,P,hand,260,900,2\n",
    ],
)
def test_users_tables_that_would_raise_a_limit(tmp_path, text):
    path = tmp_path / "ours.csv"
    path.write_text(text)
    with pytest.raises(TableError):
        fm.read_limit_table(path)


@pytest.mark.parametrize("width", [1e-5, 1e-4, 3e-4, 5e-4, 7e-4, 3e-3])
def test_narrow_bumps_of_a_log_force_are_found(width):
    """ln F a parabola in v, however narrow: no sampling step hides it."""
    middle = 0.2 + 0.2 * 10.5 / 128

    parabola = np.array([math.log(450) - 0.5 * (middle / width) ** 2, middle / width**2, -0.5 / width**2])
    bump = replace(fm.published_map("ur10e"), form=fm.Form.of("BUMP", ["1", "v", "v^2"]), coefficients=parabola)
    found = fm.safe_speed(bump, 0.8, 0.4, limit=280.0, contact="transient", bound=fm.FixedMargin(0.0))
    crossing = middle - width * math.sqrt(2 * math.log(450 / 280))
    assert crossing - 1e-6 < found.speed <= crossing


@pytest.mark.parametrize("change", [{"stiffness": 75.0}, {"stiffness": 150.0}, {"robot_mass": 1e-310}])
def test_a_stiffness_in_newtons_per_millimetre_is_refused(change):
    with pytest.raises(fm.InputError):
        fm.pfl_speed_limit(140.0, **({"robot_mass": 15.0, "body_mass": math.inf, "stiffness": 75e3} | change))


def test_clamping_seen_in_test_impacts_stays_known():
    dataset = simulate("kuka-iiwa7-10nm", np.random.default_rng(1), effect=0.02).dataset
    scenario = np.where(dataset.role == "test", "constrained_with_clamping", "unconstrained")
    columns = {
        n: getattr(dataset, n) for n in ("distance", "height", "speed", "peak_force", "role", "state", "censored")
    }
    clamping = fm.ImpactDataset.from_arrays(**columns, scenario=scenario)
    for part in (clamping, clamping.train):
        force_map = fm.fit_force_map(part)
        found = fm.safe_speed(force_map, 0.8, 0.4, limit=HAND, contact=fm.Contact.TRANSIENT, bound=fm.ToleranceBound())
        assert found.outcome is fm.SpeedOutcome.UNCONFIRMED


def test_a_repeat_in_another_unit_is_refused():
    arrays = {"distance": [0.5] * 3, "height": [0.2] * 3, "speed": [0.25] * 3}
    with pytest.raises(TableError, match="repeats"):
        fm.ImpactDataset.from_arrays(**arrays, peak_force=[200.0, 201.0, 20.4])
    assert len(fm.ImpactDataset.from_arrays(**arrays, peak_force=[200.0, 201.0, 190.0]).states) == 1


def test_masked_entries_are_refused():
    force = np.ma.masked_array([200.0, 20.0, 210.0], mask=[False, True, False])
    with pytest.raises(TableError, match="masked"):
        fm.ImpactDataset.from_arrays(distance=[0.5, 0.6, 0.7], height=[0.2] * 3, speed=[0.25] * 3, peak_force=force)
    place = np.ma.masked_array([0.8, 0.7], mask=[False, True])
    with pytest.raises(fm.InputError, match="masked"):
        fm.safe_speed(fm.published_map("ur10e"), place, 0.4, limit=280.0, contact=QUASI_STATIC, bound=fm.FixedMargin())


@pytest.mark.parametrize("bound", ["tolerance", None, 0.1, fm.FixedMargin])
def test_a_bound_that_is_none(bound):
    with pytest.raises(fm.InputError, match="bound"):
        fm.safe_speed(fm.published_map("ur10e"), 0.8, 0.4, limit=280.0, contact=QUASI_STATIC, bound=bound)


@pytest.mark.parametrize("place", [("far", 0.4), ([0.8, 0.7], [0.4, 0.4, 0.4])])
def test_places_that_are_none(place):
    with pytest.raises(fm.InputError, match="place"):
        fm.safe_speed(fm.published_map("ur10e"), *place, limit=280.0, contact=QUASI_STATIC, bound=fm.FixedMargin())


def campaign_with(extra_force, *, censored, role):
    """The 27 training states of the KUKA map, three repeats, and extra impacts at (0.71, 0.30, 0.22 m/s)."""
    rng = np.random.default_rng(7)
    points = training_grid("kuka-iiwa7-10nm")
    force = printed_force("kuka-iiwa7-10nm", *points.T) * np.exp(rng.normal(0, 0.02, 27))
    rows = [(*p, f, f > 499, "train", f"s{i}") for i, (p, f) in enumerate(zip(points, force, strict=True))] * 3
    rows += [(0.71, 0.30, 0.22, f, c, role, "extra") for f, c in zip(extra_force, censored, strict=True)]
    names = ("distance", "height", "speed", "peak_force", "censored", "role", "state")
    columns = dict(zip(names, zip(*rows, strict=True), strict=True))
    columns["peak_force"] = np.minimum(columns["peak_force"], 500.0)
    return fm.fit_force_map(fm.ImpactDataset.from_arrays(**columns))


@pytest.mark.parametrize(
    ("force", "censored", "role"),
    [
        ([210.0, 500.0, 500.0], [False, True, True], "train"),
        ([210.0, 500.0, 500.0], [False, True, True], "test"),
        ([500.0], [True], "test"),
    ],
)
def test_any_censored_impact_at_the_place_contradicts(force, censored, role):
    found = fm.safe_speed(
        campaign_with(force, censored=censored, role=role),
        0.71,
        0.30,
        limit=300.0,
        contact=QUASI_STATIC,
        bound=fm.ToleranceBound(),
    )
    assert not found.speed >= 0.22
    assert (
        found.outcome is not fm.SpeedOutcome.UNCONFIRMED or "extra" in sentence(found.reason) or math.isnan(found.speed)
    )


def test_a_measured_impact_beyond_the_limit_leaves_no_speed(tmp_path):
    force_map = campaign_with([450.0], censored=[False], role="test")
    found = fm.safe_speed(force_map, 0.71, 0.30, limit=300.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    assert "EXCEEDED THE LIMIT AT A SPEED THAT THE BOUND PERMITS: extra; highest 450.0 N" in sentence(found.reason)
    assert math.isnan(found.speed)
    fm.write_map(force_map, tmp_path / "map.json")
    again = fm.safe_speed(
        fm.read_map(tmp_path / "map.json"), 0.71, 0.30, limit=300.0, contact=QUASI_STATIC, bound=fm.ToleranceBound()
    )
    assert again.reason == found.reason
    assert math.isnan(again.speed)


def test_scattered_repeats_and_a_shared_highest_force_are_said():
    points = training_grid("kuka-iiwa7-10nm")
    force = printed_force("kuka-iiwa7-10nm", *points.T)
    d, h, v = np.repeat(points, 3, axis=0).T
    scattered = np.repeat(force, 3) * np.tile([0.8, 1.0, 1.2], 27)
    force_map = fm.fit_force_map(fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=scattered))
    found = fm.safe_speed(force_map, 0.75, 0.35, limit=300.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    assert any("27 states" in line and "5 %" in line for line in assumptions([found.basis]))
    d, h, v = points.T
    clipped = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=np.minimum(force, 300.0))
    found = fm.safe_speed(
        fm.fit_force_map(clipped), 0.75, 0.35, limit=200.0, contact=QUASI_STATIC, bound=fm.ToleranceBound()
    )
    assert any("saturated?" in line for line in assumptions([found.basis]))
    assert "device range not stated" in assumptions([found.basis])


def test_quasi_static_speeds_need_peaks_that_hold_phase_two():
    d, h, v = training_grid("kuka-iiwa7-10nm").T
    arrays = {"distance": d, "height": h, "speed": v, "scenario": ["clamping"] * 27, "device_stiffness": 75e3}
    arrays["conditions"] = fm.Conditions(device=fm.Device(range=500.0))
    peaks = printed_force("kuka-iiwa7-10nm", d, h, v) / 4
    for phase2, allowed in ((300.0, False), (0.6 * peaks, True)):
        dataset = fm.ImpactDataset.from_arrays(**arrays, peak_force=peaks, phase2_force=np.broadcast_to(phase2, 27))
        found = fm.safe_speed(
            fm.fit_force_map(dataset), 0.71, 0.30, limit=HAND, contact="quasi-static", bound=fm.ToleranceBound()
        )
        assert found.outcome.has_speed == allowed


def test_selections_keep_what_is_known_of_phase_two():
    dataset = fm.ImpactDataset.from_arrays(
        distance=[0.5, 0.6], height=[0.2, 0.2], speed=[0.2, 0.2], peak_force=[100, 100], role=["train", "test"],
        scenario=["unconstrained", "clamping"],
    )  # fmt: skip
    kept = dataset.select(dataset.role == "train")
    assert fm.ContactScenario.WITH_CLAMPING in kept.phase_two.scenarios
    for index in (np.array([0]), np.array([True])):
        with pytest.raises(fm.InputError, match="mask"):
            dataset.select(index)


@pytest.mark.parametrize(
    "call",
    [
        lambda: pfl_pressure_speed_limit(1.9e6, contact_area=1.0, robot_mass=15, body_mass=math.inf, stiffness=75e3),
        lambda: fm.pfl_speed_limit(1e9, robot_mass=15, body_mass=math.inf, stiffness=75e3),
        lambda: fm.pfl_speed_limit(
            np.ma.masked_array([140.0, 1e4], [False, True]), robot_mass=15, body_mass=math.inf, stiffness=75e3
        ),
        lambda: fm.published_map("ur10e").predict(np.ma.masked_array([0.8, 0.7], [False, True]), 0.4, 0.3),
        lambda: fm.speed_map(
            fm.published_map("ur10e"), np.ma.masked_array([0.8, 0.7], [False, True]), 0.4, limit=280.0,
            bound=fm.FixedMargin(),
        ),
    ],
)  # fmt: skip
def test_figures_in_another_unit_and_masked_entries(call):
    with pytest.raises(fm.InputError):
        call()


@pytest.mark.parametrize(
    "column", ["saturated", "over_range", "clipped", "overload", "clamping", "phaseII_N", "zensiert"]
)
def test_columns_that_would_decide_are_not_passed_over(tmp_path, column):
    path = tmp_path / "impacts.csv"
    path.write_text(f"distance_m,height_m,speed_mps,peak_force_N,{column}\n0.5,0.2,0.25,200,yes\n")
    with pytest.raises(TableError):
        fm.read_dataset(path)


def test_a_flag_that_says_saturated_needs_a_censored_mark():
    arrays = {"distance": [0.5], "height": [0.2], "speed": [0.2], "peak_force": [300.0], "flags": ["saturated"]}
    with pytest.raises(TableError, match="censored"):
        fm.ImpactDataset.from_arrays(**arrays)
    assert fm.ImpactDataset.from_arrays(**arrays, censored=[True]).censored.all()


@pytest.mark.parametrize("named", ["same", "other", "none"])
def test_test_impacts_of_training_states_do_not_flatter_the_map(named):
    campaign = simulate("kuka-iiwa7-10nm", np.random.default_rng(3), effect=0.03).dataset
    train = campaign.train
    names = ("distance", "height", "speed", "peak_force", "censored", "state")
    columns = {name: np.concatenate([getattr(train, name)] * 2) for name in names}
    columns["role"] = np.repeat(["train", "test"], len(train))
    if named == "other":
        columns["state"] = np.char.add(columns["role"], columns["state"])
    if named == "none":
        del columns["state"]
    copied = fm.ImpactDataset.from_arrays(**columns)
    force_map = fm.fit_force_map(copied)
    np.testing.assert_allclose(force_map.coefficients, fm.fit_force_map(train).coefficients, rtol=1e-12)
    assert len(copied.test) == len(train)
    assert len(copied.independent_test) == 0
    assert fm.map_accuracy(force_map, copied)[0].on == "leave-one-state-out"
    hand = {"robot_mass": 10.0, "body_mass": math.inf, "stiffness": 75e3}
    assert fm.compare_force_models(copied, **hand).on == "leave-one-state-out"


def test_test_forces_are_not_held_against_training_ones():
    """What a test impact measured changes no coefficient, however different."""
    train = simulate("kuka-iiwa7-10nm", np.random.default_rng(3), effect=0.03).dataset.train
    names = ("distance", "height", "speed", "censored")
    columns = {name: np.concatenate([getattr(train, name)] * 2) for name in names}
    force = np.concatenate([train.peak_force, 7 * train.peak_force])
    roles = np.repeat(["train", "test"], len(train))
    found = fm.fit_force_map(fm.ImpactDataset.from_arrays(**columns, peak_force=force, role=roles))
    np.testing.assert_allclose(found.coefficients, fm.fit_force_map(train).coefficients, rtol=1e-12)


def test_the_tolerance_of_states_stands_in_campaign_toml(tmp_path):
    (tmp_path / "impacts.csv").write_text(
        "distance_m,height_m,speed_mps,peak_force_N\n0.5,0.2,0.200,100\n0.5,0.2,0.208,104\n0.5,0.2,0.216,108\n"
    )
    with pytest.raises(TableError, match=r"campaign\.toml"):
        fm.read_dataset(tmp_path)
    (tmp_path / "campaign.toml").write_text('schema = "forcemap-campaign/1"\n[states]\ntolerance_mps = 0.004\n')
    assert len(fm.read_dataset(tmp_path).states) == 3


def test_empty_columns_at_the_end_are_dropped(tmp_path):
    path = tmp_path / "impacts.csv"
    path.write_text("distance_m,height_m,speed_mps,peak_force_N,,\n0.5,0.2,0.25,200,,\n0.6,0.2,0.25,200,,\n")
    assert len(fm.read_dataset(path)) == 2


def test_a_test_impact_first_does_not_hide_a_name_for_every_row():
    """Two repeats of each state under two names, one of which has its test impact above its training impact."""
    points = np.repeat(training_grid("kuka-iiwa7-10nm"), 2, axis=0)
    names = np.array([f"r{i}" for i in range(54)])
    hidden = np.arange(54) % 2 == 1
    d, h, v = np.vstack([points[hidden], points]).T
    dataset = fm.ImpactDataset.from_arrays(
        distance=d, height=h, speed=v, peak_force=printed_force("kuka-iiwa7-10nm", d, h, v),
        state=np.concatenate([names[hidden], names]), role=["test"] * 27 + ["train"] * 54,
    )  # fmt: skip
    assert len(dataset.train.states) == 27
    assert len(dataset.independent_test) == 0


def test_a_tolerance_of_ones_own_is_stated_with_the_fit(tmp_path):
    train = simulate("kuka-iiwa7-10nm", np.random.default_rng(5), effect=0.02).dataset.train
    columns = {n: getattr(train, n) for n in ("distance", "height", "speed", "peak_force", "censored")}
    fine = fm.ImpactDataset.from_arrays(**columns, tolerance=fm.StateTolerance(0.001, 0.002))
    assert fm.fit_force_map(fine).fit.states_found == "by coordinates, repeats within 1 mm and 2 mm/s"
