"""Predicting and inverting a map."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.optimize import brentq

import forcemap as fm
from forcemap.arrays import BLOCK
from forcemap.direction import direction_vector, raised_off_axis
from forcemap.maps.forms import FORMS
from forcemap.maps.saturation import saturation_doubt


def any_map(form, coefficients):
    """A map of any form with made-up coefficients."""
    from dataclasses import replace

    return replace(fm.published_map("ur10e"), form=form, coefficients=np.asarray(coefficients, dtype=float))


@pytest.mark.parametrize("simulated", [True, False])
def test_printed_a_map_and_its_impacts_take_a_line_each(examples, simulated):
    dataset = examples["ur10e"]
    force_map = fm.fit_force_map(dataset) if simulated else fm.published_map("ur10e")
    for shown in (repr(force_map), repr(dataset)):
        assert "\n" not in shown
        assert len(shown) < 200
    states = "27 states" if simulated else "no states"
    assert f"CFM_3D, {states}, measured d 0.520 to 0.890 m, h 0.140 to 0.460 m, v 0.200 to 0.400 m/s" in repr(force_map)
    assert ("SIMULATED" in repr(force_map)) == simulated
    assert f"{len(dataset)} impacts, {len(dataset.states)} states" in repr(dataset)


def test_scalars_and_arrays_agree_exactly():
    rng = np.random.default_rng(0)
    d, h, v = rng.uniform(0.4, 1, 500), rng.uniform(0, 0.6, 500), rng.uniform(0.01, 1, 500)
    for form in FORMS:
        force_map = any_map(form, rng.normal(0, 1, len(form.terms)) + 3 * (np.arange(len(form.terms)) == 0))
        forces = force_map.predict(d, h, v)
        crossings = force_map.crossing_speed(d, h, 120.0)
        for i in range(500):
            one = force_map.predict(d[i], h[i], v[i])
            assert isinstance(one, float)
            assert one == forces[i]
            np.testing.assert_equal(force_map.crossing_speed(d[i], h[i], 120.0), crossings[i])


def test_grids_and_blocks_do_not_change_a_bit():
    ur10e = fm.published_map("ur10e")
    d, h, v = np.linspace(0.5, 0.9, 40), np.linspace(0.1, 0.5, 81), np.linspace(0.2, 0.4, 83)
    grid = ur10e.predict(d[:, None, None], h[:, None], v)
    assert grid.shape == (40, 81, 83)
    assert grid.size > 4 * BLOCK
    scattered = ur10e.predict(*(axis.ravel() for axis in np.meshgrid(d, h, v, indexing="ij")))
    np.testing.assert_array_equal(grid.ravel(), scattered)
    long_rows = ur10e.predict(d[:2, None], 0.3, np.linspace(0.2, 0.4, 3 * BLOCK))
    assert long_rows.shape == (2, 3 * BLOCK)
    assert long_rows[1, -1] == ur10e.predict(d[1], 0.3, 0.4)
    assert ur10e.predict(np.empty(0), 0.3, 0.2).shape == (0,)


def test_scikit_learn_style_design_agrees():
    rng = np.random.default_rng(1)
    d, h, v = rng.uniform(0.4, 1, 300), rng.uniform(0, 0.6, 300), rng.uniform(0.05, 0.6, 300)
    for form in FORMS:
        b = rng.normal(0, 1, len(form.terms))
        np.testing.assert_allclose(any_map(form, b).predict(d, h, v), np.exp(form.design(d, h, v) @ b), rtol=1e-11)


coefficient = st.floats(-20, 20).map(lambda x: round(x, 3))


@given(st.lists(coefficient, min_size=4, max_size=4), coefficient.map(lambda x: x / 3 + 0.0005))
def test_property_crossing_speed_is_the_first_rise(powers, level):
    """Against a fine scan and brentq, for cubic, quadratic and linear dependence on speed."""
    for degree in (1, 2, 3):
        form = fm.Form.of("own", ["1", "v", "v^2", "v^3"][: degree + 1])
        b = np.array(powers[: degree + 1])
        force_map = any_map(form, b)
        found = force_map.crossing_speed(0.5, 0.5, np.exp(level))
        polynomial = np.polynomial.Polynomial(b - level * (np.arange(degree + 1) == 0))
        if polynomial(0.0) >= 0:
            assert found == 0.0
            continue
        scan = np.linspace(0, 10, 20001)
        above = np.flatnonzero(polynomial(scan) > 1e-9)
        if above.size == 0:
            assert np.isnan(found) or found > 10 - 1e-3 or abs(polynomial(found)) < 1e-6
            continue
        below = np.flatnonzero(polynomial(scan[: above[0]]) < 0)[-1]
        root = brentq(polynomial, scan[below], scan[above[0]], xtol=1e-13)
        if abs(polynomial.deriv()(root)) > 1e-3:
            assert found == pytest.approx(root, abs=1e-6)


@given(coefficient, coefficient, coefficient.map(lambda x: x / 3 + 0.0005))
def test_property_crossing_speed_of_logarithmic_profiles(constant, log, level):
    force_map = any_map(fm.Form.of("own", ["1", "ln(v)"]), [constant, log])
    found = force_map.crossing_speed(0.5, 0.5, np.exp(level))
    if log < 0 or (log == 0 and constant >= level):
        assert found == 0.0
    elif log == 0:
        assert np.isnan(found)
    elif not np.isnan(found) and found > 1e-200:
        assert np.log(force_map.predict(0.5, 0.5, found)) == pytest.approx(level, abs=1e-6)


def test_crossing_speed_refuses_forces_that_are_none():
    for force in (0.0, -5.0, np.nan, np.inf, [100.0, -1.0]):
        with pytest.raises(fm.InputError):
            fm.published_map("ur10e").crossing_speed(0.8, 0.4, force)


def test_log_speed_at_rest():
    force_map = any_map(fm.LOG_SPEED, [5, 0, 0, 0, 0, 0, 0, 1, 0, 0])
    assert force_map.predict(0.5, 0.3, 0.0) == 0.0
    assert force_map.rises_with_speed
    assert not any_map(fm.LOG_SPEED, [5, 0, 0, 0, 0, 0, 0, 0.5, -1, 0]).rises_with_speed


def test_overflow_is_infinite_not_an_error():
    assert any_map(fm.CFM_2D, [1000, 0, 0, 0]).predict(0.5, 0.3, 0.2) == np.inf


@pytest.mark.parametrize(
    ("force", "state", "censored", "suspected"),
    [
        ([450, 450, 450, 310], "aabc", 0, True),
        ([310, 450, 450, 450], "abbc", 0, True),
        ([450, 450, 310, 310], "abcd", 0, False),  # two may agree by rounding
        ([450, 450, 450, 450], "aaaa", 0, False),  # repeats of one state may
        ([450, 450, 450, 310], "aabc", 1, False),  # it was noticed
        ([450, 450, 449.9, 449.9], "abcd", 0, False),
        ([450, 450, 450, np.nan], "aabc", 0, True),
        ([np.nan] * 3, "abc", 0, False),
    ],
)
def test_saturation_is_suspected_where_three_impacts_of_two_states_share_the_largest_force(
    force, state, censored, suspected
):
    doubt = saturation_doubt(force, list(state), censored=censored)
    assert (doubt is not None) == suspected
    if doubt:
        assert dict(doubt.figures) == {"impacts": 3, "states": 2, "force_N": 450.0}


@pytest.mark.parametrize(("angle", "factor"), [(0.0, 1.0), (0.01, 1.0), (0.0101, 1.14), (2.0, 1.14), (5.0, 1.14)])
def test_a_motion_beside_the_maps_direction_raises_the_bound(angle, factor):
    assert raised_off_axis(angle) == factor


@pytest.mark.parametrize("angle", [-0.001, 5.001, 90.0, np.nan, np.inf])
def test_a_motion_for_which_nothing_was_measured_is_refused(angle):
    with pytest.raises(fm.InputError, match="expected from 0 to 5"):
        raised_off_axis(angle)


@pytest.mark.parametrize("words", ["down", "Vertically  down", " -Z ", "0, 0, -1", "0,0,-1", "downwards"])
def test_a_downward_direction_is_known_in_words(words):
    np.testing.assert_array_equal(direction_vector(words, whose="a map"), [0.0, 0.0, -1.0])


@pytest.mark.parametrize(
    ("words", "said"), [("", "a map does not state it"), ("  ", "does not state"), ("sideways", "'sideways'")]
)
def test_another_direction_is_refused(words, said):
    with pytest.raises(fm.InputError, match=said):
        direction_vector(words, whose="a map")
