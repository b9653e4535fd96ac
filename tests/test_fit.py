"""Fitting: the paper's coefficients back, and statsmodels as an independent oracle."""

from __future__ import annotations

import math

import numpy as np
import pytest
import statsmodels.api as sm
from hypothesis import given, settings, strategies as st
from oracle import PRINTED, alike, full_grid, printed_force, simulate, training_grid

import forcemap as fm
from forcemap.maps.forms import FORMS, Term
from forcemap.maps.regression import holm, least_squares
from sizes import COSTLY

QUASI_STATIC = fm.Contact.QUASI_STATIC


def noise_free(name, points, **options):
    force = printed_force(name, *points.T)
    kept = force < 500
    d, h, v = points[kept].T
    return fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force[kept], **options)


@pytest.mark.parametrize("name", fm.PUBLISHED_MAPS)
def test_noise_free_samples_give_back_the_printed_coefficients(name):
    found = fm.fit_force_map(noise_free(name, training_grid(name)))
    np.testing.assert_allclose(found.coefficients, PRINTED[name], rtol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_terms_of_every_form_are_what_their_names_say(form):
    d, h, v = full_grid("ur10e").T
    names = {"d": d, "h": h, "v": v, "ln": np.log}
    expected = np.column_stack([np.ones_like(d) * eval(t.replace("^", "**"), names) for t in form.term_names])
    np.testing.assert_allclose(form.design(d, h, v), expected, rtol=1e-14)
    assert [str(Term.parse(name)) for name in form.term_names] == form.term_names


def test_forms():
    assert fm.CFM_3D.term_names == ["1", "v", "d", "d^2", "d*h", "h^2", "d^2*v", "d*v^2", "d*h^2"]
    assert fm.CFM_2D.term_names == ["1", "v", "d", "d^2"]
    assert len(fm.FULL_CUBIC.terms) == 20
    assert {t.distance + t.height + t.speed for t in fm.FULL_CUBIC.terms} == {0, 1, 2, 3}
    assert len(fm.LOG_SPEED.terms) == 10
    assert fm.form_named("cfm-3d") is fm.CFM_3D
    with pytest.raises(fm.InputError, match="CFM_3D"):
        fm.form_named("CFM_3E")
    for terms in (["v^4"], ["v", "ln(v)"], ["ln(v)^2"], ["d", "d"], [], ["x"], ["d*d"]):
        with pytest.raises(fm.InputError):
            fm.Form.of("own", terms)


@pytest.mark.parametrize("form", [fm.CFM_2D, fm.CFM_3D, fm.LOG_SPEED])
@pytest.mark.parametrize("name", fm.EXAMPLE_CAMPAIGNS)
def test_inference_agrees_with_statsmodels(examples, name, form):
    fit = fm.fit_force_map(examples[name], form=form, impacts=fm.CensoredImpacts.DISCARD).fit
    states = fit.states
    train = examples[name].train
    train = train.select(~train.censored)
    samples = form.design(train.distance, train.height, train.speed), np.log(train.peak_force)
    between = form.design(states.distance, states.height, states.speed), states.log_force
    theirs = (
        sm.GLS(between[1], between[0], sigma=alike(states, fit.place_effect.correlation)).fit(),
        sm.OLS(samples[1], samples[0]).fit(),
    )
    for regression, oracle, (design, response) in zip(
        (fit.between_states, fit.over_samples), theirs, (between, samples), strict=True
    ):
        for found, expected in (
            (regression.coefficients, oracle.params),
            (regression.standard_errors, oracle.bse),
            (regression.t_values, oracle.tvalues),
            (regression.p_values, oracle.pvalues),
        ):
            np.testing.assert_allclose(found, expected, rtol=1e-8)
        residual = response - design @ oracle.params
        total = np.sum((response - response.mean()) ** 2)
        assert regression.r_squared == pytest.approx(1 - residual @ residual / total, rel=1e-9)
        assert regression.residual_sd == pytest.approx(np.sqrt(oracle.mse_resid), rel=1e-9)
        covariance = oracle.cov_params() / oracle.mse_resid
        np.testing.assert_allclose(regression.leverage, np.einsum("ij,jk,ik->i", design, covariance, design), rtol=1e-7)
        scaled = design / np.linalg.norm(design, axis=0)
        assert regression.condition_number == pytest.approx(np.linalg.cond(scaled), rel=1e-9)


def test_balanced_repeats_give_the_coefficients_of_all_samples():
    dataset = simulate("kuka-iiwa7-30nm", np.random.default_rng(2), effect=0.033, device_range=2000.0).dataset
    fit = fm.fit_force_map(dataset).fit
    np.testing.assert_allclose(fit.between_states.coefficients, fit.over_samples.coefficients, rtol=1e-9)
    # Repeats share the state effect: between states the errors are larger, by about sqrt(3).
    ratio = fit.between_states.standard_errors / fit.over_samples.standard_errors
    assert (ratio > 1.5).all()


def test_the_fit_says_what_it_rests_on():
    dataset = simulate("ur10e", np.random.default_rng(3), effect=0.022).dataset
    force_map = fm.fit_force_map(dataset, impacts=fm.CensoredImpacts.DISCARD)
    train = dataset.train
    assert len(force_map.fit.states) + len(force_map.fit.left_out) == 27
    assert len(fm.fit_force_map(dataset).fit.states) == 27
    assert not len(fm.fit_force_map(dataset).fit.left_out)
    assert force_map.fit.samples == int((~train.censored).sum())
    assert force_map.fit.censored_samples == int(train.censored.sum()) > 0
    assert force_map.fit.repeats == (3, 3)
    assert force_map.fit.states_found == "by state_id, repeats within 5 mm and 10 mm/s"
    predicted = force_map.predict(
        force_map.fit.states.distance, force_map.fit.states.height, force_map.fit.states.speed
    )
    rmse = np.sqrt(np.mean((predicted - force_map.fit.states.force) ** 2))
    assert force_map.fit.rmse_force == pytest.approx(rmse, rel=1e-9)


def test_discarded_censored_forces_are_never_used():
    dataset = simulate("ur10e", np.random.default_rng(4), effect=0.022).dataset
    from dataclasses import replace

    changed = replace(dataset, peak_force=np.where(dataset.censored, 5000.0, dataset.peak_force))
    fits = [fm.fit_force_map(each, impacts=fm.CensoredImpacts.DISCARD) for each in (changed, dataset)]
    np.testing.assert_array_equal(fits[0].coefficients, fits[1].coefficients)


def test_only_train_rows_are_fitted(examples):
    dataset = examples["ur10e"]
    np.testing.assert_array_equal(fm.fit_force_map(dataset).coefficients, fm.fit_force_map(dataset.train).coefficients)
    with pytest.raises(fm.FitError, match="train"):
        fm.fit_force_map(dataset.test)


def test_full_cubic_is_rank_deficient_on_the_training_states():
    points = training_grid("kuka-iiwa7-10nm")
    dataset = fm.ImpactDataset.from_arrays(
        distance=points[:, 0], height=points[:, 1], speed=points[:, 2], peak_force=np.full(27, 200.0)
    )
    with pytest.raises(fm.RankDeficient, match="rank 17"):
        fm.fit_force_map(dataset, form=fm.FULL_CUBIC)
    assert fm.fit_force_map(noise_free("kuka-iiwa7-10nm", full_grid("ur10e")), form=fm.FULL_CUBIC).fit


def test_too_few_states():
    points = training_grid("kuka-iiwa7-10nm")[-8:]
    with pytest.raises(fm.TooFewStates, match="8 measured states"):
        fm.fit_force_map(noise_free("kuka-iiwa7-10nm", points))


def test_one_height_does_not_determine_a_3d_map():
    points = training_grid("kuka-iiwa7-30nm")
    with pytest.raises(fm.RankDeficient):
        fm.fit_force_map(noise_free("kuka-iiwa7-30nm", points[points[:, 1] == 0.30]))
    flat = fm.fit_force_map(noise_free("kuka-iiwa7-30nm", points[points[:, 1] == 0.30]), form=fm.CFM_2D)
    assert flat.fit.between_states.degrees_of_freedom == 5


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_coordinate_that_varies_within_the_tolerance_carries_no_term(axis):
    """Two millimetres of jitter at one height must not pass for a height dependence."""
    rng = np.random.default_rng(axis)
    points = full_grid("kuka-iiwa7-10nm")
    points = points[points[:, axis] == np.unique(points[:, axis])[2]].copy()
    points[:, axis] += rng.uniform(-1, 1, len(points)) * (0.002, 0.002, 0.004)[axis]
    with pytest.raises(fm.RankDeficient, match=("distances", "heights", "speeds")[axis]):
        fm.fit_force_map(noise_free("kuka-iiwa7-10nm", points))
    if axis == 1:
        assert fm.fit_force_map(noise_free("kuka-iiwa7-10nm", points), form=fm.CFM_2D).fit


@settings(max_examples=COSTLY)
@given(st.integers(0, 2**32 - 1))
def test_property_row_order_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    dataset = simulate("kuka-iiwa7-30nm", rng, effect=0.033).dataset
    order = rng.permutation(len(dataset))
    names = ("distance", "height", "speed", "peak_force", "role", "censored")
    columns = {name: getattr(dataset, name) for name in names}
    shuffled = fm.ImpactDataset.from_arrays(**{name: values[order] for name, values in columns.items()})
    np.testing.assert_allclose(
        fm.fit_force_map(shuffled).coefficients, fm.fit_force_map(dataset).coefficients, rtol=1e-9
    )


@pytest.mark.parametrize("with_state_id", [True, False])
def test_repeats_that_differ_by_a_few_millimetres_per_second(with_state_id):
    """Same states, coefficients to 1e-3 of their size and bounds as the ideal table."""
    rng = np.random.default_rng(11)
    points = np.repeat(training_grid("kuka-iiwa7-10nm"), 3, axis=0)
    effect = np.repeat(rng.normal(0, 0.02, 27), 3)
    ids = np.repeat([f"s{i}" for i in range(27)], 3)
    jitter = np.tile([-0.003, 0.0, 0.003], 27)  # the mean of the repeats is the planned speed
    force = printed_force("kuka-iiwa7-10nm", *points.T) * np.exp(effect)
    moved = printed_force("kuka-iiwa7-10nm", points[:, 0], points[:, 1], points[:, 2] + jitter) * np.exp(effect)
    maps = []
    for extra, measured in ((0.0, force), (jitter, moved)):
        d, h, v = points.T
        dataset = fm.ImpactDataset.from_arrays(
            distance=d, height=h, speed=v + extra, peak_force=measured, state=ids if with_state_id else None
        )
        maps.append(fm.fit_force_map(dataset))
        assert len(maps[-1].fit.states) == 27
    ideal, jittered = maps
    np.testing.assert_allclose(jittered.coefficients, ideal.coefficients, rtol=1e-3)
    d, h, v = training_grid("kuka-iiwa7-10nm").T
    bound = fm.ToleranceBound()
    np.testing.assert_allclose(bound.upper(jittered, d, h, v), bound.upper(ideal, d, h, v), rtol=1e-3)


finite_tables = st.lists(
    st.tuples(
        st.sampled_from([0.3, 0.5, 0.7, 0.9]) | st.floats(0.05, 9.0),
        st.sampled_from([-0.2, 0.1, 0.3, 0.5]) | st.floats(-9.0, 9.0),
        st.sampled_from([0.1, 0.2, 0.3, 0.4]) | st.floats(0.01, 9.0),
        st.floats(1.0, 1e5),
        st.booleans(),
        st.sampled_from(["train", "test"]),
    ),
    min_size=1,
    max_size=60,
)


@given(finite_tables, st.sampled_from(FORMS))
def test_property_every_accepted_table_fits_or_is_refused(table, form):
    columns = dict(
        zip(("distance", "height", "speed", "peak_force", "censored", "role"), zip(*table, strict=True), strict=True)
    )
    try:
        dataset = fm.ImpactDataset.from_arrays(**columns)
        force_map = fm.fit_force_map(dataset, form=form)
        fm.map_accuracy(force_map, dataset)
        d, h, _ = force_map.measured_range.points.T
        found = fm.safe_speed(force_map, d, h, limit=50.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    except fm.ForcemapError:
        return
    assert np.isfinite(force_map.coefficients).all()
    assert (found.bound_force[~np.isnan(found.speed)] <= 50.0 * (1 + 1e-9)).all()


@pytest.mark.parametrize("seed", [2, 8, 20, 62, 83, 113, 565, 672])
def test_forces_of_every_size_fit_or_are_refused(seed):
    """Censored fits whose repeats hardly differ, or whose predictions no number holds."""
    rng = np.random.default_rng(seed)
    n = rng.integers(10, 60)

    def mixed(values, low, high):
        regular = rng.random(n) < rng.choice([0.5, 0.9, 1.0])
        return np.where(regular, rng.choice(values, n), rng.uniform(low, high, n))

    columns = {
        "distance": mixed([0.3, 0.5, 0.7, 0.9], 0.01, 9),
        "height": mixed([-0.2, 0.1, 0.3, 0.5], -9, 9),
        "speed": mixed([0.1, 0.2, 0.3, 0.4], 0.01, 9),
    }
    force = np.exp(rng.uniform(0, np.log(1e5), n)) if rng.random() < 0.5 else rng.uniform(1, 1e5, n)
    if rng.random() < 0.3:
        force = 150 * np.exp(rng.normal(0, rng.choice([1e-6, 1e-3, 0.1, 1]), n))
    censored = rng.random(n) < rng.choice([0.05, 0.2, 0.5])
    role = np.where(rng.random(n) < 0.8, "train", "test")
    form = FORMS[rng.integers(len(FORMS))]
    try:
        dataset = fm.ImpactDataset.from_arrays(**columns, peak_force=force, censored=censored, role=role)
        force_map = fm.fit_force_map(dataset, form=form)
    except fm.ForcemapError:
        return
    fm.map_accuracy(force_map, dataset)
    d, h, _ = force_map.measured_range.points.T
    try:
        found = fm.safe_speed(force_map, d, h, limit=50.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    except fm.ForcemapError:
        return
    assert (found.bound_force[~np.isnan(found.speed)] <= 50.0 * (1 + 1e-9)).all()


@pytest.mark.parametrize(("condition", "determined"), [(0.7e8, True), (1.4e8, False)])
def test_columns_too_alike_determine_nothing(condition, determined):
    """Two columns of length 1 at an angle a have the condition number cot(a / 2); their scale tells nothing."""
    angle = 2 * math.atan(1 / condition)
    design = np.array([[1.0, math.cos(angle)], [0.0, math.sin(angle)], [0.0, 0.0]])
    for scale in (1e-6, 1.0, 1e6):
        if determined:
            fitted = least_squares(design * [1.0, scale], np.ones(3))
            assert fitted.condition_number == pytest.approx(condition, rel=0.01)
        else:
            with pytest.raises(fm.RankDeficient, match=r"determine 1 .* 2 coefficients \(rank 1\), expected 2"):
                least_squares(design * [1.0, scale], np.ones(3))


@pytest.mark.parametrize("rank", [1, 2, 3, 4])
@pytest.mark.parametrize("zeros", [False, True])
def test_the_rank_that_is_said_is_that_of_the_design(rank, zeros):
    """Whether its columns are combinations of each other or of zeros, and whatever their units."""
    rng = np.random.default_rng(rank)
    known, others = (
        rng.normal(size=(12, rank)),
        np.zeros((rank, 5 - rank)) if zeros else rng.normal(size=(rank, 5 - rank)),
    )
    design = np.hstack([known, known @ others])[:, rng.permutation(5)] * 10.0 ** rng.integers(-3, 4, 5)
    assert np.linalg.matrix_rank(design / np.maximum(np.linalg.norm(design, axis=0), 1e-9)) == rank
    words = rf"determine {rank} combinations of the 5 coefficients \(rank {rank}\), expected 5"
    with pytest.raises(fm.RankDeficient, match=words):
        least_squares(design, np.ones(12))


def test_p_values_are_adjusted_as_holm_does():
    """Each one by how many are as large or larger, but never below one that is smaller, nor above 1."""
    rng = np.random.default_rng(5)
    for number in (1, 2, 3, 8):
        for most in (0.05, 1.0):
            p_values = rng.uniform(0, most, number)
            times = np.array([p * np.sum(p_values >= p) for p in p_values])
            expected = [min(1.0, times[p_values <= p].max()) for p in p_values]
            np.testing.assert_allclose(holm(p_values), expected, rtol=1e-12)
    np.testing.assert_allclose(holm(np.array([0.01, 0.01, 0.4])), [0.03, 0.03, 0.4])


@pytest.mark.parametrize(("n", "p"), [(12, 3), (5, 4), (4, 4)])
def test_the_figures_of_a_regression_are_those_of_statsmodels(n, p):
    rng = np.random.default_rng(n)
    design, response = np.hstack([np.ones((n, 1)), rng.normal(size=(n, p - 1))]), rng.normal(5.0, 1.0, n)
    found, expected = least_squares(design, response), sm.OLS(response, design).fit()
    np.testing.assert_allclose(found.coefficients, expected.params, rtol=1e-9)
    np.testing.assert_allclose(found.leverage, expected.get_influence().hat_matrix_diag, rtol=1e-9)
    np.testing.assert_allclose(found.residuals, expected.resid, atol=1e-12)
    assert found.degrees_of_freedom == expected.df_resid
    assert found.rmse == pytest.approx(np.sqrt(np.mean(expected.resid**2)), abs=1e-12)
    assert found.r_squared == pytest.approx(expected.rsquared, rel=1e-9)
    if n == p:
        assert np.isnan([found.residual_sd, *found.standard_errors]).all()
        return
    assert found.residual_sd == pytest.approx(np.sqrt(expected.mse_resid), rel=1e-9)
    np.testing.assert_allclose(found.standard_errors, expected.bse, rtol=1e-9)
    np.testing.assert_allclose(found.t_values, expected.tvalues, rtol=1e-9)
    np.testing.assert_allclose(found.p_values, expected.pvalues, rtol=1e-9)


def test_constant_observations_have_no_coefficient_of_determination():
    fitted = least_squares(np.column_stack([np.ones(4), np.arange(4.0)]), np.full(4, 2.0))
    assert np.isnan(fitted.r_squared)


def test_a_map_is_that_of_the_impacts_as_they_are_now():
    dataset = noise_free("ur10e", training_grid("ur10e"))
    before = fm.fit_force_map(dataset)
    assert fm.fit_force_map(dataset) is before  # fitted once
    dataset.peak_force[:] *= 1.1
    np.testing.assert_allclose(fm.fit_force_map(dataset).coefficients[0], before.coefficients[0] + np.log(1.1))
    dataset.peak_force[:] /= 1.1
    dataset.role[::2] = "test"
    assert len(fm.fit_force_map(dataset).fit.states) < len(before.fit.states)
    with pytest.raises(ValueError, match="read-only"):
        before.coefficients[0] -= 1.0  # whoever asks next has the same map


def test_states_in_which_one_coordinate_follows_another_say_which():
    """As many levels as a form needs, and yet no map: another person's table cannot be measured again by guessing."""
    at = np.array([(d, h, v) for d in (0.5, 0.6, 0.7, 0.8, 0.9) for h, v in ((0.1, 0.1), (0.25, 0.2), (0.4, 0.3))])
    force = printed_force("ur10e", *at.T)
    dataset = fm.ImpactDataset.from_arrays(distance=at[:, 0], height=at[:, 1], speed=at[:, 2], peak_force=force)
    words = (
        "each height at one speed alone and each speed at one height alone: found that the measured states determine"
    )
    with pytest.raises(fm.RankDeficient, match=words) as error:
        fm.fit_force_map(dataset)
    assert error.value.remedy.startswith("measure heights at several speeds")
    at = np.vstack([at, [(0.5, 0.1, 0.3), (0.9, 0.4, 0.1), (0.7, 0.25, 0.3), (0.6, 0.1, 0.2)]])
    force = printed_force("ur10e", *at.T)
    spread = fm.ImpactDataset.from_arrays(distance=at[:, 0], height=at[:, 1], speed=at[:, 2], peak_force=force)
    np.testing.assert_allclose(fm.fit_force_map(spread).coefficients, PRINTED["ur10e"], rtol=1e-6)
