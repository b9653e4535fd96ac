"""Safe speeds at many places: exact to 1e-6 m/s and never above, with outcome and reason for every place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracle import full_grid, simulate

import forcemap as fm
from forcemap.maps.forms import FORMS, _first_root_cubic, _first_root_quadratic
from forcemap.maps.measured_range import MeasuredRange
from sizes import FULL_SIZE

QUASI_STATIC = fm.Contact.QUASI_STATIC


def compare(force_map, bound, limit, rng, n=4000 if FULL_SIZE else 400):
    """Nothing up to a speed exceeds the limit, and 2e-6 m/s above it the bound does."""
    d, h = rng.uniform(0.48, 0.93, n), rng.uniform(0.1, 0.5, n)
    found = fm.safe_speed(force_map, d, h, limit=limit, contact=QUASI_STATIC, bound=bound)
    low, high = force_map.measured_range.speeds(d, h)
    np.testing.assert_array_equal(np.isnan(low), found.outcome == "outside")
    inside = ~np.isnan(low)
    exceeded = np.full(n, False)
    exceeded[inside] = bound.upper(force_map, d[inside], h[inside], low[inside]) > limit
    np.testing.assert_array_equal(exceeded, found.outcome == "unconfirmed")
    given = np.flatnonzero(inside & ~exceeded)
    speed = found.speed[given]
    share = np.linspace(0, 1, 65)
    v = low[given, None] + (speed - low[given])[:, None] * share
    assert (bound.upper(force_map, d[given, None], h[given, None], v) <= limit * (1 + 1e-12)).all()
    capped = found.outcome[given] == "capped"
    np.testing.assert_array_equal(speed[capped], high[given][capped])
    at = given[~capped]
    assert (bound.upper(force_map, d[at], h[at], found.speed[at] + 2e-6) > limit).all()
    reasons = dict(zip(found.outcome, found.reason, strict=True))
    assert all(reasons[outcome].kind.value == outcome for outcome in reasons)
    return given.size / n


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
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
        case = {"limit": limit, "contact": QUASI_STATIC, "bound": fm.ToleranceBound()}
        found = fm.safe_speed(force_map, d, h, **case)
        alone = [fm.safe_speed(force_map, x, y, **case) for x, y in zip(d, h, strict=True)]
        np.testing.assert_array_equal(found.speed, [each.speed for each in alone])
        assert found.reason.tolist() == [each.reason for each in alone]
        bare = fm.safe_speed(force_map, d, h, **case, hints=False)
        np.testing.assert_array_equal(found.speed, bare.speed)
        assert np.isnan(bare.extrapolated_speed).all()
    hand = {"limit": fm.force_limit("back_of_hand"), "contact": fm.Contact.TRANSIENT, "bound": fm.FixedMargin()}
    assert np.isnan(fm.safe_speed(fm.published_map("kuka-iiwa7-30nm"), [[0.8]], [[0.4, 0.3]], **hand).speed).all()


@pytest.mark.parametrize("place", [(np.nan, 0.4), (0.8, np.inf), ([0.8, 0.7], [0.1, 0.2, 0.3])])
def test_places_that_are_none(place):
    with pytest.raises(fm.InputError, match="place"):
        fm.safe_speed(fm.published_map("ur10e"), *place, limit=280.0, contact=QUASI_STATIC, bound=fm.FixedMargin())


def test_an_allowance_that_falls_with_leverage(full_size):
    """At low confidence and few degrees of freedom: no speed lies above the first crossing."""
    bound, given = fm.ToleranceBound(0.5, 0.999, 0.0), 0
    for seed in range(600 if full_size else 20):
        rng = np.random.default_rng(seed)
        form = (fm.CFM_2D, fm.CFM_3D, fm.LOG_SPEED)[seed % 3]
        n = len(form.terms) + rng.integers(3, 6)
        d, h, v = rng.uniform(0.4, 1.0, n), rng.uniform(0.0, 0.6, n), rng.uniform(0.05, 0.5, n)
        force = np.exp(5 + rng.normal(0, 0.5) * v + rng.normal(0, 1.0) * (v - 0.25) ** 2 + rng.normal(0, 0.15, n))
        columns = {"distance": d, "height": h, "speed": v, "peak_force": force}
        dataset = fm.ImpactDataset.from_arrays(**columns, scenario=["unconstrained"] * n, phase2_force=[0.001] * n)
        try:
            force_map = fm.fit_force_map(dataset, form=form)
            bound.require(force_map)
        except (fm.FitError, fm.BoundNotAvailable):
            continue
        pairs = rng.integers(n, size=(2, 200))
        x, y = (0.5 * (each[pairs[0]] + each[pairs[1]]) for each in (d, h))
        low, high = force_map.measured_range.speeds(x, y)
        x, y, low, high = (each[low < high] for each in (x, y, low, high))
        limit = np.minimum(bound.upper(force_map, x, y, low + (high - low) * rng.random(x.size)), force.max() - 3)
        found = fm.safe_speed(force_map, x, y, limit=limit, bound=bound, contact=QUASI_STATIC)
        at = np.flatnonzero(~np.isnan(found.speed))
        assert (found.speed[at] <= high[at]).all()
        speeds = low[at, None] + (found.speed - low)[at, None] * np.linspace(0, 1, 201)
        upper = bound.upper(force_map, x[at, None], y[at, None], speeds)
        assert (upper <= limit[at, None] * (1 + 1e-12)).all()
        given += at.size
    assert given > (500 if full_size else 100)


def test_zones_of_a_bound_that_only_derives_from_ours_are_refused():
    """What is proven of ours says nothing of it."""

    class Raised(fm.FixedMargin):
        def upper(self, force_map, distance, height, speed):
            return 1.3 * super().upper(force_map, distance, height, speed)

    zone = fm.Zones(0.79, 0.81, 0.39, 0.41)
    with pytest.raises(fm.InputError, match="can be enclosed"):
        fm.zone_speeds(fm.published_map("ur10e"), zone, limit=280.0, bound=Raised(0.1))


@pytest.mark.parametrize("seed", range(8))
def test_the_first_root_of_polynomials_is_that_of_numpy(seed):
    """Drawn polynomials, negative at rest, among them ones that touch 0, turn twice, or are of a lower degree."""
    rng = np.random.default_rng([44, seed])
    c, b, a, cubic = -rng.uniform(0.01, 3, 60), *rng.normal(0, 8, (3, 60)) * rng.integers(0, 2, (3, 60))
    roots = rng.uniform(0.05, 3, (60, 3)) * np.where(rng.random((60, 1)) < 0.3, [1, 1, 1], [1, 1, -1])
    for i in range(0, 60, 3):  # products of known factors, with their constant below 0
        cubic[i], a[i], b[i], c[i] = np.poly(roots[i]) * -np.sign(np.poly(roots[i])[3])
    for i, (found, quadratic) in enumerate(
        zip(_first_root_cubic(c, b, a, cubic), _first_root_quadratic(c, b, a), strict=True)
    ):
        for root, polynomial in ((found, [cubic[i], a[i], b[i], c[i]]), (quadratic, [a[i], b[i], c[i]])):
            real = [each.real for each in np.roots(polynomial) if abs(each.imag) < 1e-9 and each.real > 0]
            if real:
                assert root == pytest.approx(min(real), rel=1e-6)
            else:
                assert np.isnan(root) or root > 1e5
