"""Safe speeds against a brute-force scan, and everything that must not get a speed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from oracle import full_grid, printed_force, simulate, training_grid

import forcemap as fm
from forcemap.maps.forms import FORMS
from forcemap.maps.measured_range import MeasuredRange
from forcemap.words import assumptions, sentence
from sizes import COSTLY

QUASI_STATIC = fm.Contact.QUASI_STATIC

STEP = 1e-4
ADMISSIBLE, CAPPED = fm.SpeedOutcome.ADMISSIBLE, fm.SpeedOutcome.CAPPED
UNCONFIRMED, OUTSIDE = fm.SpeedOutcome.UNCONFIRMED, fm.SpeedOutcome.OUTSIDE


def scan(force_map, d, h, limit, bound):
    """Outcome and bracket of the safe speed at one place, by brute force; (None, ...) at an edge."""
    low, high = force_map.measured_range.speeds(np.array([d]), np.array([h]))
    if np.isnan(low[0]):
        return OUTSIDE, math.nan, math.nan
    speeds = np.append(np.arange(low[0], high[0], STEP), high[0])
    running = np.maximum.accumulate(bound.upper(force_map, d, h, speeds))
    if np.abs(running[[0, -1]] / limit - 1).min() < 1e-6:
        return None, math.nan, math.nan
    if running[0] > limit:
        return UNCONFIRMED, math.nan, math.nan
    if running[-1] <= limit:
        return CAPPED, high[0], high[0]
    last = np.flatnonzero(running <= limit)[-1]
    return ADMISSIBLE, speeds[last], speeds[last + 1]


def fitted_maps(rng):
    """Fitted maps of each form, full and non-factorial plans."""
    grid = full_grid("ur10e")
    scattered = rng.uniform([0.5, 0.1, 0.1], [0.9, 0.5, 0.5], (60, 3))
    skew = np.vstack([training_grid("ur10e"), [[0.52, 0.46, 0.05], [0.89, 0.46, 0.7], [0.75, 0.2, 0.1]]])
    plans = {"full": grid, "scattered": scattered, "skew": skew}
    for form in FORMS:
        for plan, points in plans.items():
            if form is fm.FULL_CUBIC and plan == "skew":
                continue
            everything = np.ones(len(points), bool)
            campaign = simulate("ur10e", rng, effect=0.03, points=points, train=everything, device_range=900.0)
            yield f"{form.name} {plan}", fm.fit_force_map(campaign.dataset, form=form)


def falling_map():
    """A map that turns over inside its measured range: a second window must not open."""
    ur10e = fm.published_map("ur10e")
    points = full_grid("ur10e") * [1, 1, 4]
    return replace(ur10e, measured_range=MeasuredRange(points))


def test_against_brute_force(full_size):
    rng = np.random.default_rng(20)
    places = 10_000 if full_size else 1_500
    maps = [(name, fm.published_map(name)) for name in fm.PUBLISHED_MAPS] + [("turns over", falling_map())]
    maps += list(fitted_maps(rng))
    outcomes = []
    for name, force_map in maps:
        low, high = force_map.measured_range.lowest, force_map.measured_range.highest
        n = places // len(maps) + 1
        d = rng.uniform(low[0] - 0.01, high[0] + 0.01, n)
        h = rng.uniform(low[1] - 0.01, high[1] + 0.01, n)
        limits = rng.uniform(60, 490, n)
        for bound in (fm.FixedMargin(rng.uniform(0, 0.3)), fm.ToleranceBound(rng.uniform(0.5, 0.99), 0.95)):
            if isinstance(bound, fm.ToleranceBound) and force_map.fit is None:
                continue
            found = fm.safe_speed(force_map, d, h, limit=limits, contact=QUASI_STATIC, bound=bound)
            given_one = np.isin(found.outcome, (ADMISSIBLE, CAPPED))
            at_speed = bound.upper(force_map, d[given_one], h[given_one], found.speed[given_one])
            assert (at_speed <= limits[given_one] * (1 + 1e-9)).all()
            np.testing.assert_array_equal(at_speed, found.bound_force[given_one])
            for i in range(n):
                outcome, below, above = scan(force_map, d[i], h[i], limits[i], bound)
                if outcome is None:
                    continue
                assert found.outcome[i] is outcome, (name, bound, d[i], h[i], limits[i])
                outcomes.append(outcome)
                if outcome in (ADMISSIBLE, CAPPED):
                    assert below <= found.speed[i] <= above
                else:
                    assert math.isnan(found.speed[i])
    tried = set(fm.SpeedOutcome) - {fm.SpeedOutcome.NOT_PERMITTED}
    assert min(outcomes.count(outcome) for outcome in tried) > places / 40  # all four were tried


def test_scalars_and_arrays_agree_exactly(full_size):
    n = 15 if full_size else 5
    rng = np.random.default_rng(21)
    for name, force_map in [("ur10e", fm.published_map("ur10e")), *fitted_maps(rng)]:
        bound = fm.FixedMargin(0.1) if force_map.fit is None else fm.ToleranceBound()
        d, h, limits = rng.uniform(0.5, 0.95, n), rng.uniform(0.1, 0.5, n), rng.uniform(60, 490, n)
        many = fm.safe_speed(force_map, d, h, limit=limits, contact=QUASI_STATIC, bound=bound)
        for i in range(n):
            one = fm.safe_speed(force_map, d[i], h[i], limit=limits[i], contact=QUASI_STATIC, bound=bound)
            assert isinstance(one.speed, float)
            assert isinstance(one.outcome, fm.SpeedOutcome)
            assert one.outcome is many.outcome[i], name
            for field in ("speed", "extrapolated_speed", "bound_force", "predicted_force", "lowest_measured_speed"):
                np.testing.assert_equal(getattr(one, field), getattr(many, field)[i], err_msg=f"{name} {field}")


def test_shapes_broadcast():
    found = fm.safe_speed(
        fm.published_map("ur10e"),
        np.linspace(0.5, 0.9, 4)[:, None],
        [0.2, 0.3, 0.4],
        limit=280.0,
        bound=fm.FixedMargin(),
    )
    assert found.speed.shape == found.outcome.shape == found.reason.shape == (4, 3)


def test_extrapolated_speed_is_where_the_continued_bound_rises_to_the_limit():
    ur10e = fm.published_map("ur10e")
    for margin in (0.0, 0.10):
        found = fm.safe_speed(ur10e, 0.8, 0.4, limit=140.0, contact=QUASI_STATIC, bound=fm.FixedMargin(margin))
        assert found.outcome is UNCONFIRMED
        crossing = ur10e.crossing_speed(0.8, 0.4, 140 / (1 + margin))
        assert found.extrapolated_speed == pytest.approx(crossing, abs=1e-6)
        assert found.extrapolated_speed <= crossing
    assert (
        fm.safe_speed(ur10e, 0.52, 0.14, limit=140.0, contact=QUASI_STATIC, bound=fm.FixedMargin()).extrapolated_speed
        == 0.0
    )
    assert math.isnan(
        fm.safe_speed(ur10e, 0.8, 0.4, limit=280.0, contact=QUASI_STATIC, bound=fm.FixedMargin()).extrapolated_speed
    )
    assert math.isnan(
        fm.safe_speed(ur10e, 0.2, 0.4, limit=140.0, contact=QUASI_STATIC, bound=fm.FixedMargin()).extrapolated_speed
    )


def test_extrapolated_speed_of_a_logarithmic_map():
    rng = np.random.default_rng(2)
    campaign = simulate("ur10e", rng, effect=0.02, train=np.arange(125) % 3 == 0)
    force_map = fm.fit_force_map(campaign.dataset, form=fm.LOG_SPEED)
    bound = fm.ToleranceBound()
    found = fm.safe_speed(force_map, 0.8, 0.4, limit=140.0, contact=QUASI_STATIC, bound=bound)
    assert found.outcome is UNCONFIRMED
    assert 0 < found.extrapolated_speed < 0.2
    assert bound.upper(force_map, 0.8, 0.4, found.extrapolated_speed) == pytest.approx(140, abs=0.01)


def test_equality_is_admissible():
    ur10e = fm.published_map("ur10e")
    at_lowest = ur10e.predict(0.8, 0.4, 0.2)
    assert fm.safe_speed(
        ur10e, 0.8, 0.4, limit=at_lowest, contact=QUASI_STATIC, bound=fm.FixedMargin(0.0)
    ).speed == pytest.approx(0.2, abs=1e-6)
    assert (
        fm.safe_speed(
            ur10e, 0.8, 0.4, limit=at_lowest * (1 - 1e-9), contact=QUASI_STATIC, bound=fm.FixedMargin(0.0)
        ).outcome
        is UNCONFIRMED
    )
    at_highest = ur10e.predict(0.8, 0.4, 0.4)
    assert (
        fm.safe_speed(ur10e, 0.8, 0.4, limit=at_highest, contact=QUASI_STATIC, bound=fm.FixedMargin(0.0)).outcome
        is CAPPED
    )


@pytest.mark.parametrize("limit", [0.0, -140.0, math.nan, math.inf, 497.1, 1e6])
def test_limits_that_cannot_be_confirmed(limit):
    with pytest.raises(fm.InputError, match="limit"):
        fm.safe_speed(fm.published_map("ur10e"), 0.8, 0.4, limit=limit, contact=QUASI_STATIC, bound=fm.FixedMargin())


def test_saturation_bounds_the_limit_without_a_stated_device():
    rng = np.random.default_rng(1)
    dataset = simulate("ur10e", rng, effect=0.02, device_range=400.0).dataset
    force_map = fm.fit_force_map(replace(dataset, conditions=fm.Conditions()))
    with pytest.raises(fm.InputError, match="397"):
        fm.safe_speed(force_map, 0.8, 0.4, limit=398.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())


@pytest.mark.parametrize("place", [(math.nan, 0.4), (0.8, math.nan), (math.inf, 0.4)])
def test_a_place_that_is_none_is_an_error(place):
    with pytest.raises(fm.InputError, match="place"):
        fm.safe_speed(fm.published_map("ur10e"), *place, limit=140.0, contact=QUASI_STATIC, bound=fm.FixedMargin())


def test_contact_goes_with_a_body_area():
    options = {"bound": fm.FixedMargin()}
    ur10e = fm.published_map("ur10e")
    with pytest.raises(fm.InputError, match="contact"):
        fm.safe_speed(ur10e, 0.8, 0.4, limit=fm.force_limit("back_of_hand"), **options)
    with pytest.raises(fm.InputError, match="go with a limit in newtons"):
        fm.safe_speed(
            ur10e, 0.8, 0.4, limit=fm.force_limit("palm"), contact="transient", quasi_static_limit=1.0, **options
        )


@pytest.mark.parametrize("area", ["temple", "middle_of_forehead", "masticatory_muscle", "skull_forehead", "face"])
@pytest.mark.parametrize("contact", list(fm.Contact))
def test_the_head_never_gets_a_speed(area, contact):
    case = {"limit": fm.force_limit(area), "contact": contact, "bound": fm.FixedMargin()}
    found = fm.safe_speed(fm.published_map("ur10e"), [0.8, 9.0], 0.4, **case)
    assert found.outcome.tolist() == ["not_permitted"] * 2
    assert not any(outcome.has_speed for outcome in found.outcome)
    assert np.isnan([found.speed, found.extrapolated_speed, found.bound_force]).all()
    assert math.isnan(found.limit)
    assert area in sentence(found.reason[0])
    with pytest.raises(fm.ContactNotPermitted):
        fm.force_limit(area).force(contact)


def with_phase_two(scenario, phase2_force=None, role=None):
    points = training_grid("kuka-iiwa7-10nm")
    d, h, v = points.T
    return fm.fit_force_map(
        fm.ImpactDataset.from_arrays(
            distance=d,
            height=h,
            speed=v,
            peak_force=printed_force("kuka-iiwa7-10nm", d, h, v),
            scenario=scenario,
            phase2_force=phase2_force,
            role=role,
            device_stiffness=75e3,
        )
    )


def transient(force_map):
    return fm.safe_speed(
        force_map,
        0.8,
        0.4,
        limit=fm.force_limit("back_of_hand"),
        contact=fm.Contact.TRANSIENT,
        bound=fm.ToleranceBound(),
    )


def test_transient_limits_need_phase_two():
    calm = ["unconstrained"] * 27
    assert transient(with_phase_two(calm)).outcome in (ADMISSIBLE, CAPPED)
    for scenario in ("constrained with clamping", "undetermined"):
        found = transient(with_phase_two([*calm[:-1], scenario]))
        assert found.outcome is UNCONFIRMED
        assert math.isnan(found.speed)
        assert "no transient limit" in sentence(found.reason)
    held = transient(with_phase_two(calm, phase2_force=[*[0.0] * 26, 141.0]))
    assert held.outcome is UNCONFIRMED
    assert "141.0 N" in sentence(held.reason)
    within_device_error = transient(with_phase_two(calm, phase2_force=[*[0.0] * 26, 138.0]))
    assert within_device_error.outcome is UNCONFIRMED
    assert transient(with_phase_two(calm, phase2_force=[*[0.0] * 26, 136.0])).outcome in (ADMISSIBLE, CAPPED)


def test_phase_two_that_was_never_recorded_is_said():
    found = transient(with_phase_two(None))
    assert found.outcome in (ADMISSIBLE, CAPPED)
    assert "Phase II not measured" in assumptions([found.basis])
    everywhere = fm.safe_speed(
        with_phase_two(None), *np.meshgrid([0.3, 0.55, 0.7, 0.85], [0.15, 0.3, 0.45]),
        limit=fm.force_limit("back_of_hand"), contact=fm.Contact.TRANSIENT, bound=fm.FixedMargin(),
    )  # fmt: skip
    unseen = ["Phase II not measured" in sentence(reason) for reason in everywhere.reason.ravel()]
    assert unseen == (~np.isnan(everywhere.speed)).ravel().tolist()
    assert set(unseen) == {True, False}


def test_outside_comes_before_the_gate():
    found = fm.safe_speed(
        fm.published_map("kuka-iiwa7-30nm"), [0.1, 0.8], [0.4, 0.4],
        limit=fm.force_limit("back_of_hand"), contact=fm.Contact.TRANSIENT, bound=fm.FixedMargin(),
    )  # fmt: skip
    assert found.outcome.tolist() == [OUTSIDE, UNCONFIRMED]


def test_quasi_static_limits_hold_for_maps_that_clamp():
    found = fm.safe_speed(
        fm.published_map("kuka-iiwa7-10nm"), 0.86, 0.46,
        limit=fm.force_limit("thigh_knee"), contact=fm.Contact.QUASI_STATIC, bound=fm.FixedMargin(),
    )  # fmt: skip
    assert found.outcome is ADMISSIBLE
    assert found.limit == 220.0


@settings(max_examples=COSTLY)
@given(st.integers(0, 2**32 - 1), st.floats(60, 490))
def test_property_no_speed_outside_what_was_measured(seed, limit):
    rng = np.random.default_rng(seed)
    points = rng.uniform([0.5, 0.1, 0.1], [0.9, 0.5, 0.5], (40, 3))
    campaign = simulate("ur10e", rng, effect=0.03, points=points, train=np.ones(40, bool), device_range=900.0)
    force_map = fm.fit_force_map(campaign.dataset)
    d, h = rng.uniform(0.4, 1, 60), rng.uniform(0, 0.6, 60)
    found = fm.safe_speed(force_map, d, h, limit=limit, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    for i in np.flatnonzero(~np.isnan(found.speed)):
        assert force_map.measured_range.contains(*np.array([[d[i]], [h[i]], [found.speed[i]]]))[0]


def test_one_slow_and_one_fast_impact_do_not_open_those_speeds_elsewhere():
    rng = np.random.default_rng(6)
    points = np.vstack([training_grid("kuka-iiwa7-10nm"), [[0.56, 0.14, 0.06], [0.86, 0.46, 0.9]]])
    train = np.ones(len(points), bool)
    dataset = simulate("kuka-iiwa7-10nm", rng, effect=0.02, points=points, train=train).dataset
    force_map = fm.fit_force_map(dataset)
    far = fm.safe_speed(force_map, 0.86, 0.14, limit=120.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    assert (far.lowest_measured_speed, far.highest_measured_speed) == (0.2, 0.4)
    assert far.outcome is UNCONFIRMED
    fast = fm.safe_speed(force_map, 0.56, 0.46, limit=490.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    assert fast.speed <= 0.4


@given(st.floats(0, 5, allow_nan=False))
def test_property_floor_speed_never_rounds_up(speed):
    from fractions import Fraction

    shown = Fraction(fm.floor_speed(speed))
    assert shown <= Fraction(repr(speed)) < shown + Fraction(1, 1000)


def test_floor_speed():
    assert [fm.floor_speed(v) for v in (0.29, 0.2999999, 0.0, math.nan, 0.1, 1.0)] == [
        "0.290", "0.299", "0.000", "-", "0.100", "1.000"
    ]  # fmt: skip


def test_speed_map_and_its_fastest_place():
    ur10e = fm.published_map("ur10e")
    d, h = fm.measured_grid(ur10e, 0.05)
    np.testing.assert_array_equal(d, [0.55, 0.60, 0.65, 0.70, 0.75, 0.80, 0.85])
    np.testing.assert_array_equal(h, [0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45])
    assert [axis.tolist() for axis in fm.measured_grid(ur10e, 2.0)] == [[pytest.approx(0.705)], [pytest.approx(0.3)]]
    speeds = fm.speed_map(ur10e, d, h, limit=280.0, contact=QUASI_STATIC, bound=fm.FixedMargin())
    assert speeds.speeds.speed.shape == (d.size, h.size)
    distance, height, speed = speeds.fastest
    assert speed == np.nanmax(speeds.speeds.speed)
    assert (
        speed == fm.safe_speed(ur10e, distance, height, limit=280.0, contact=QUASI_STATIC, bound=fm.FixedMargin()).speed
    )
    assert sum(speeds.counts.values()) == d.size * h.size
    assert fm.speed_map(ur10e, d, h, limit=100.0, contact=QUASI_STATIC, bound=fm.FixedMargin()).fastest is None
    for step in (0.0, -1.0, math.nan, 1e-7):
        with pytest.raises(fm.InputError, match="step"):
            fm.measured_grid(ur10e, step)


def test_a_prediction_that_falls_with_speed_is_said_and_one_that_rises_is_not():
    points = (
        np.stack(np.meshgrid([0.5, 0.7, 0.9], [0.2, 0.4], [0.1, 0.2, 0.3]), axis=-1).reshape(-1, 3).repeat(2, axis=0)
    )
    for slope, said in ((1.0, False), (-1.0, True)):
        force = 100.0 * np.exp(slope * points[:, 2] - 0.3 * points[:, 0] + 0.1 * points[:, 1])
        named = dict(zip(("distance", "height", "speed"), points.T, strict=True))
        force_map = fm.fit_force_map(fm.ImpactDataset.from_arrays(**named, peak_force=force), form=fm.CFM_2D)
        asked = {"limit": 70.0, "contact": QUASI_STATIC, "bound": fm.FixedMargin(0.10)}
        basis = fm.safe_speed(force_map, 0.7, 0.3, **asked).basis
        assert (fm.FindingKind.FALLS_WITH_SPEED in {finding.kind for finding in basis.warnings}) is said


@pytest.mark.parametrize("overshoot", [0.0, 0.01, 0.0125, 1 / 30])
def test_the_overshoot_on_top_of_a_speed_to_program_never_exceeds_the_speed_at_contact(overshoot):
    """Not by a rounding of the sum either."""
    at_contact = np.random.default_rng(5).uniform(0.04, 1.5, 200_000)
    to_program = fm.Allowance(speed=overshoot).off(at_contact)
    assert np.all(to_program + overshoot <= at_contact)
    np.testing.assert_allclose(to_program, at_contact - overshoot, rtol=1e-14)
