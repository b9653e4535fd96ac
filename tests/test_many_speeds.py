"""Safe speeds at many places: what `safe_speed` says, to 0.2 mm/s and never above."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracle import full_grid, simulate

import forcemap as fm
from forcemap.maps.measured_range import MeasuredRange

QUASI_STATIC = fm.Contact.QUASI_STATIC


def compare(force_map, bound, limit, rng, n=4000):
    d, h = rng.uniform(0.48, 0.93, n), rng.uniform(0.1, 0.5, n)
    exact = fm.safe_speed(force_map, d, h, limit=limit, contact=QUASI_STATIC, bound=bound).speed
    found = fm.many_safe_speeds(force_map, d, h, limit=limit, contact=QUASI_STATIC, bound=bound)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(exact))
    known = ~np.isnan(exact)
    assert (found[known] <= exact[known]).all()
    assert (exact[known] - found[known] < 2e-4).all()
    return known.mean()


@pytest.mark.parametrize("form", [fm.CFM_2D, fm.CFM_3D, fm.FULL_CUBIC, fm.LOG_SPEED], ids=lambda form: form.name)
def test_fitted_maps(form):
    rng = np.random.default_rng(40)
    scattered = rng.uniform([0.45, 0.05, 0.08], [0.95, 0.55, 0.5], (70, 3))
    for points in (full_grid("ur10e"), scattered):
        everything = np.ones(len(points), bool)
        dataset = simulate("ur10e", rng, effect=0.02, points=points, train=everything, device_range=900.0).dataset
        force_map = fm.fit_force_map(dataset, form=form)
        shares = [compare(force_map, fm.ToleranceBound(), limit, rng) for limit in (180.0, 280.0, 450.0)]
        assert max(shares) > 0.2


def test_published_maps_and_one_that_turns_over():
    rng = np.random.default_rng(41)
    falling = replace(fm.published_map("ur10e"), measured_range=MeasuredRange(full_grid("ur10e") * [1, 1, 4]))
    for force_map in (*map(fm.published_map, fm.PUBLISHED_MAPS), falling):
        for limit in (200.0, 280.0, 450.0):
            compare(force_map, fm.FixedMargin(0.1), limit, rng)


def test_a_censored_impact_and_the_gate():
    rng = np.random.default_rng(42)
    force_map = fm.fit_force_map(simulate("ur10e", rng, effect=0.02, device_range=400.0).dataset)
    states = force_map.fit.test
    places = np.flatnonzero(states.at_least > 0)[:20]
    d = states.distance[places] + rng.uniform(-0.0015, 0.0015, places.size)
    h = states.height[places] + rng.uniform(-0.0015, 0.0015, places.size)
    for limit in (300.0, 390.0):
        exact = fm.safe_speed(force_map, d, h, limit=limit, contact=QUASI_STATIC, bound=fm.ToleranceBound()).speed
        found = fm.many_safe_speeds(force_map, d, h, limit=limit, contact=QUASI_STATIC, bound=fm.ToleranceBound())
        np.testing.assert_array_equal(np.isnan(found), np.isnan(exact))
    hand = {"limit": fm.force_limit("back_of_hand"), "contact": fm.Contact.TRANSIENT, "bound": fm.FixedMargin()}
    assert np.isnan(fm.many_safe_speeds(fm.published_map("kuka-iiwa7-30nm"), [[0.8]], [[0.4, 0.3]], **hand)).all()


@pytest.mark.parametrize("place", [(np.nan, 0.4), (0.8, np.inf), ([0.8, 0.7], [0.1, 0.2, 0.3])])
def test_places_that_are_none(place):
    with pytest.raises(fm.InputError, match="place"):
        fm.many_safe_speeds(
            fm.published_map("ur10e"), *place, limit=280.0, contact=QUASI_STATIC, bound=fm.FixedMargin()
        )
