"""Upper bounds against the formula with scipy's noncentral t, and what cannot carry them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from oracle import alike, full_grid, simulate, training_grid
from scipy import stats
from scipy.special import nctdtrit, ndtri

import forcemap as fm
from forcemap.errors import BoundNotAvailable
from forcemap.maps.bounds import _NODES, _tolerance_table, margins, weakness
from forcemap.words import assumptions

QUASI_STATIC = fm.Contact.QUASI_STATIC


def direct(force_map, d, h, v, confidence=0.95, content=0.95, device_error=3.0):
    """The formula: upper = F exp(s sqrt(l) t'), at least F + device error; l and s by plain linear algebra with V."""
    states = force_map.fit.states
    design = force_map.form.design(states.distance, states.height, states.speed)
    weight = np.linalg.inv(alike(states, force_map.fit.place_effect.correlation))
    inverse = np.linalg.inv(design.T @ weight @ design)
    residuals = states.log_force - design @ force_map.coefficients
    freedom = len(states) - design.shape[1]
    s = np.sqrt(residuals @ weight @ residuals / freedom)
    x = force_map.form.design(d, h, v)
    leverage = np.einsum("ij,jk,ik->i", x, inverse, x)
    t = stats.nct.ppf(confidence, freedom, stats.norm.ppf(content) / np.sqrt(leverage))
    force = np.exp(x @ force_map.coefficients)
    return np.maximum(force * np.exp(s * np.sqrt(leverage) * t), force + device_error)


@pytest.mark.parametrize("form", [fm.CFM_2D, fm.CFM_3D, fm.LOG_SPEED])
@pytest.mark.parametrize("effect", [0.005, 0.033, 0.10])
@pytest.mark.parametrize(("confidence", "content"), [(0.95, 0.95), (0.9, 0.99), (0.5, 0.5), (0.99, 0.8)])
def test_tolerance_bound_is_the_formula_and_never_below_it(form, effect, confidence, content):
    rng = np.random.default_rng([7, int(1000 * effect), int(100 * confidence)])
    dataset = simulate("kuka-iiwa7-30nm", rng, effect=effect, train=np.arange(125) % 3 == 0).dataset  # 25 places
    force_map = fm.fit_force_map(dataset, form=form, impacts=fm.CensoredImpacts.DISCARD)
    d, h, v = rng.uniform([0.4, 0.0, 0.05], [1.0, 0.6, 0.6], (400, 3)).T
    bound = fm.ToleranceBound(confidence, content)
    found, expected = bound.upper(force_map, d, h, v), direct(force_map, d, h, v, confidence, content)
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert (found >= expected * (1 - 1e-10)).all()  # 1e-10: the rounding of the plain algebra above


@given(
    st.integers(3, 5000),
    st.floats(0.5, 0.999),
    st.floats(0.5, 0.999),
    st.lists(st.floats(1e-6, 1e3), min_size=1, max_size=5),
)
def test_property_the_table_errs_upwards_by_little(freedom, confidence, content, leverages):
    from forcemap.maps.bounds import _tolerance_factor, _tolerance_table

    leverage = np.array(leverages)
    table = _tolerance_table(freedom, confidence, content)
    found = _tolerance_factor(leverage, table)
    z = stats.norm.ppf(content)
    expected = np.sqrt(leverage) * stats.nct.ppf(confidence, freedom, z / np.sqrt(leverage))
    known = ~np.isnan(expected)
    assert (found[known] >= expected[known] * (1 - 1e-12)).all()
    assert (found[known] - expected[known] <= 2e-5 * (1 + np.sqrt(leverage[known]))).all()


def test_device_error_is_the_least_distance():
    points = np.repeat(training_grid("kuka-iiwa7-10nm"), 2, axis=0)
    campaign = simulate("kuka-iiwa7-10nm", np.random.default_rng(0), effect=1e-6, repeat_sd=0.0)
    force_map = fm.fit_force_map(campaign.dataset)
    d, h, v = points.T
    above = fm.ToleranceBound(device_error=5.0).upper(force_map, d, h, v) - force_map.predict(d, h, v)
    np.testing.assert_allclose(above, 5.0, atol=1e-9)
    # The device of the campaign errs by 3 N: less is not believed.
    above = fm.ToleranceBound(device_error=0.0).upper(force_map, d, h, v) - force_map.predict(d, h, v)
    np.testing.assert_allclose(above, 3.0, atol=1e-9)


def test_published_maps_know_no_tolerance_bound():
    with pytest.raises(BoundNotAvailable, match="no measured states"):
        fm.ToleranceBound().upper(fm.published_map("ur10e"), 0.8, 0.4, 0.3)
    assert fm.FixedMargin(0.10).upper(fm.published_map("ur10e"), 0.8, 0.4, 0.3) == pytest.approx(
        1.1 * fm.published_map("ur10e").predict(0.8, 0.4, 0.3), rel=1e-15
    )


@pytest.mark.parametrize(("states", "accepted"), [(9, False), (11, False), (12, True)])
def test_three_degrees_of_freedom_are_needed(states, accepted):
    rng = np.random.default_rng(3)
    points = rng.permutation(full_grid("kuka-iiwa7-10nm"))[:states]
    force_map = fm.fit_force_map(
        simulate("kuka-iiwa7-10nm", rng, effect=0.02, points=points, train=np.ones(states, bool)).dataset
    )
    if accepted:
        assert fm.ToleranceBound().upper(force_map, 0.7, 0.3, 0.3) > force_map.predict(0.7, 0.3, 0.3)
        return
    with pytest.raises(BoundNotAvailable, match=f"found {states - 9} residual degrees"):
        fm.safe_speed(force_map, 5.0, 5.0, limit=100.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())


@pytest.mark.parametrize("margin", [-0.01, np.nan, np.inf])
def test_margins_that_are_none(margin):
    with pytest.raises(fm.InputError):
        fm.FixedMargin(margin)


@pytest.mark.parametrize("options", [{"confidence": 1.0}, {"confidence": 0.4}, {"content": 1.0}, {"content": np.nan},
                                     {"device_error": -1.0}, {"device_error": np.inf}])  # fmt: skip
def test_promises_that_are_none(options):
    with pytest.raises(fm.InputError):
        fm.ToleranceBound(**options)


def test_the_bound_reaches_beyond_ten_percent_where_it_must():
    rng = np.random.default_rng(8)
    force_map = fm.fit_force_map(simulate("ur10e", rng, effect=0.08).dataset)
    assert margins(fm.ToleranceBound(), force_map).max() > 0.10
    found = fm.safe_speed(force_map, 0.8, 0.4, limit=250.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    assert any("margin is too small" in line for line in assumptions([found.basis]))


@pytest.mark.parametrize("stated", [np.nan, 1.0])
@pytest.mark.parametrize("error", [2.9, 3.0])
def test_a_device_error_below_3_newtons_is_weak_where_the_device_states_none(stated, error):
    force_map = fm.fit_force_map(simulate("ur10e", np.random.default_rng(3), effect=0.02).dataset)
    conditions = replace(force_map.conditions, device=fm.Device(error=stated))
    found = weakness(fm.ToleranceBound(device_error=error), replace(force_map, conditions=conditions))
    assert (found is not None) == (np.isnan(stated) and error < 3.0)


def test_the_table_errs_upwards_where_the_factor_is_not_convex():
    """Densely, at a confidence and content hardly above one half, where it bends most between the nodes."""
    from scipy.special import nctdtrit

    from forcemap.maps.bounds import _tolerance_factor, _tolerance_table

    for freedom, confidence, content in ((500, 0.5, 0.55), (5000, 0.5, 0.6), (20, 0.55, 0.5)):
        root = np.geomspace(1e-3, 1e2, 20_000)
        expected = root * nctdtrit(freedom, stats.norm.ppf(content) / root, confidence)
        found = _tolerance_factor(root**2, _tolerance_table(freedom, confidence, content))
        known = ~np.isnan(expected)
        assert known.sum() > 15_000
        assert (found[known] >= expected[known] * (1 - 1e-12)).all(), (freedom, confidence, content)


@pytest.mark.parametrize(
    ("freedom", "confidence", "content", "most"),
    [(500, 0.5, 0.55, 2e-7), (9, 0.5, 0.55, 2e-7), (20, 0.95, 0.95, 5e-9), (20, 0.55, 0.5, 5e-9)],
)
def test_the_table_is_raised_by_about_what_straight_lines_can_lie_below(freedom, confidence, content, most):
    """Where the leverage is largest the factor is the t quantile itself."""
    from forcemap.maps.bounds import _tolerance_table

    raised = _tolerance_table(freedom, confidence, content)[-1] - stats.t.ppf(confidence, freedom)
    assert 0 < raised < most
    assert (raised > 1e-7) == (most > 1e-7)


@pytest.mark.parametrize("confidence_and_content", [(0.95, 0.95), (0.99, 0.95), (0.95, 0.99), (0.9, 0.6), (0.99, 0.6)])
@pytest.mark.parametrize("freedom", [3, 18, 22.7, 100, 400])
def test_the_table_lies_on_or_just_above_the_quantiles_at_every_node(freedom, confidence_and_content):
    """Those that are interpolated, too; computed one by one where cubics through their neighbours would not do."""
    confidence, content = confidence_and_content
    root = _NODES[1:-1] / (1 - _NODES[1:-1])
    exact = root * nctdtrit(freedom, ndtri(content) / root, confidence) / (1 + root)
    table = _tolerance_table(freedom, confidence, content)[1:-1]
    assert np.nanmin(table / exact - 1) > -1e-9
    assert np.nanmax(table / exact - 1) < (1e-8 if content >= 0.95 else 1e-3)


@pytest.mark.parametrize(("freedom", "confidence", "content"), [(3, 0.99, 0.6), (18, 0.95, 0.95), (22.7, 0.5, 0.5)])
def test_a_factor_is_found_by_its_number_as_by_searching_for_it(freedom, confidence, content):
    """At the nodes, beside them, between them, at no and at boundless leverage."""
    from forcemap.maps.bounds import _tolerance_factor

    table = _tolerance_table(freedom, confidence, content)
    nodes = _NODES[:-1] / (1 - _NODES[:-1])
    rng = np.random.default_rng(202618)
    roots = [nodes, np.nextafter(nodes, np.inf), np.nextafter(nodes[1:], 0), 10 ** rng.uniform(-12, 12, 100_000)]
    root = np.concatenate([*roots, [0.0, 1e150]])
    expected = np.interp(root / (1 + root), _NODES, table) * (1 + root)
    np.testing.assert_allclose(_tolerance_factor(root**2, table), expected, rtol=1e-15)
    beyond = _tolerance_factor(np.array([np.inf, np.nan]), table)
    assert np.isnan(beyond[1])
    assert beyond[0] == np.inf or content == 0.5
