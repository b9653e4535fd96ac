"""Forms compared on the same left-out states: against refits, on truths that are known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import statsmodels.api as sm
from oracle import PRINTED, full_grid, simulate, training_grid
from scipy.stats import ttest_1samp

from forcemap import (
    CFM_2D,
    CFM_3D,
    FULL_CUBIC,
    LOG_SPEED,
    FitError,
    FixedMargin,
    ForceMap,
    Form,
    ImpactDataset,
    InputError,
    ToleranceBound,
    fit_force_map,
    leave_one_state_out,
)
from forcemap.comparisons.forms import COMPARED_FORMS, EUCLIDEAN_2D, compare_forms
from forcemap.maps.accuracy import left_out_predictions
from forcemap.words import sentence, sentences

EFFECTS = dict(zip(PRINTED, (0.022, 0.033, 0.021), strict=True))


def campaign(name="kuka-iiwa7-10nm", seed=0, *, points=None, **options):
    rng = np.random.default_rng(seed)
    points = training_grid(name) if points is None else points
    everything = np.ones(len(points), dtype=bool)
    return simulate(name, rng, effect=EFFECTS[name], points=points, train=everything, **options).dataset


def why(comparison):
    """The reasons in words."""
    return "; ".join(sentences(comparison.reasons))


def by_name(comparison):
    return {each.form.name: each for each in comparison.results}


def test_a_full_grid_carries_all_five_forms_on_the_same_states():
    comparison = compare_forms(campaign(points=full_grid("kuka-iiwa7-10nm")))
    assert [each.form for each in comparison.results] == list(COMPARED_FORMS)
    assert not comparison.refused
    assert {each.accuracy.states for each in comparison.results} == {comparison.states}
    found = by_name(comparison)
    assert found["CFM_2D"].error_percent > 3 * found["CFM_3D"].error_percent
    assert found["EUCLIDEAN_2D"].error_percent > 1.5 * found["CFM_3D"].error_percent
    assert found["EUCLIDEAN_2D"].mean_bound_percent > found["CFM_3D"].mean_bound_percent
    assert "rejected by the paper" in " ".join(sentences(found["EUCLIDEAN_2D"].notes))
    assert comparison.recommended is CFM_3D


def test_the_training_states_refuse_the_full_cubic_and_say_why():
    comparison = compare_forms(campaign())
    (refused,) = comparison.refused
    assert refused.form is FULL_CUBIC
    assert "rank 17" in sentence(refused.reason) or "states" in sentence(refused.reason)


@pytest.mark.parametrize("form", [CFM_3D, LOG_SPEED, CFM_2D])
def test_figures_are_those_of_the_map_alone(form):
    dataset = campaign("kuka-iiwa7-30nm", 3, device_range=1000.0, points=full_grid("kuka-iiwa7-30nm")[::3])
    result = by_name(compare_forms(dataset))[form.name]
    force_map = fit_force_map(dataset, form=form)
    assert result.accuracy == leave_one_state_out(force_map)
    states = dataset.states
    bound = ToleranceBound().upper(force_map, *states.coordinates.T) / force_map.predict(*states.coordinates.T) - 1
    assert result.mean_bound_percent == pytest.approx(100 * bound.mean())
    assert result.max_bound_percent == pytest.approx(100 * bound.max())
    assert result.rises_inside == force_map.rises_with_speed


def test_the_euclidean_map_is_the_one_the_paper_names():
    """Every state predicted by a fit of ln F on 1, v, r, r^2 to the others, by statsmodels."""
    dataset = campaign("kuka-iiwa7-30nm", 1, device_range=1000.0)
    states = dataset.states
    r = np.sqrt(states.distance**2 + states.height**2)
    design = np.column_stack([np.ones_like(r), states.speed, r, r**2])
    radius = np.hypot(dataset.distance, dataset.height)
    at_radius = replace(dataset, distance=radius, height=np.zeros_like(radius))
    fitted = fit_force_map(at_radius, form=CFM_2D).fit
    place = fitted.states.place
    sigma = np.where(place[:, None] == place, fitted.place_effect.correlation, 0.0)
    np.fill_diagonal(sigma, 1.0)
    error = []
    for i in range(len(states)):
        others = np.arange(len(states)) != i
        found = sm.GLS(states.log_force[others], design[others], sigma[np.ix_(others, others)]).fit()
        error.append(design[i] @ found.params - states.log_force[i])
    result = by_name(compare_forms(dataset, forms=[EUCLIDEAN_2D, CFM_3D]))["EUCLIDEAN_2D"]
    assert result.error_percent == pytest.approx(100 * np.sqrt(np.mean(np.square(error))), rel=1e-6)
    under = np.minimum(error, 0)
    assert result.underestimation_percent == pytest.approx(100 * np.sqrt(np.mean(np.square(under))), rel=1e-6)


def test_rise_with_speed_inside_and_above():
    """A truth that turns over at 0.5 m/s, measured from 0.2 to 0.4 m/s."""
    points = full_grid("ur10e")
    d, h, v = points.T
    force = np.exp(5.0 - d - h**2 - 6.0 * d * (v - 0.5) ** 2)
    dataset = ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force)
    found = by_name(compare_forms(dataset, forms=[CFM_2D, FULL_CUBIC, LOG_SPEED], bound=FixedMargin(0.1)))
    assert (found["FULL_CUBIC"].rises_inside, found["FULL_CUBIC"].rises_above) == (True, False)
    assert (found["LOG_SPEED"].rises_inside, found["LOG_SPEED"].rises_above) == (True, True)
    assert found["CFM_2D"].mean_bound_percent == pytest.approx(10.0)
    falling = replace(dataset, peak_force=1e4 / force)
    found = by_name(compare_forms(falling, forms=[CFM_2D], bound=FixedMargin(0.1)))
    assert (found["CFM_2D"].rises_inside, found["CFM_2D"].rises_above) == (False, False)


def test_the_default_stays_where_it_is_true(full_size):
    seeds = 40 if full_size else 2
    found = [compare_forms(campaign(name, seed)) for name in PRINTED for seed in range(seeds)]
    stays = [each.recommended is CFM_3D for each in found]
    assert sum(stays) >= 0.98 * len(found)
    assert all(("no form is clearly better" in why(each)) == stay for each, stay in zip(found, stays, strict=True))


def log_speed_truth(seed, effect=0.02):
    """Impacts of a robot whose force is a power of the speed, from 0.05 to 0.8 m/s."""
    speeds = (0.05, 0.1, 0.2, 0.4, 0.8)
    places = np.unique(full_grid("ur10e")[:, :2], axis=0)[::2]
    d, h, v = np.array([(*place, speed) for place in places for speed in speeds]).T
    force = 400 * np.exp(-0.8 * d - 2 * h**2) * v ** (0.5 + 0.2 * d)
    effects = np.random.default_rng(seed).normal(0, effect, d.size)
    return ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force * np.exp(effects))


def test_a_clearly_better_form_is_recommended_with_its_figures():
    for seed in range(3):
        comparison = compare_forms(log_speed_truth(seed))
        assert comparison.recommended is LOG_SPEED
        assert "LOG_SPEED is clearly better than CFM_3D" in why(comparison)
        found = by_name(comparison)
        assert found["LOG_SPEED"].p_better < 0.01 / 3
        assert found["LOG_SPEED"].error_percent < 0.9 * found["CFM_3D"].error_percent
        assert math.isnan(found["CFM_3D"].p_better)


def test_a_form_that_falls_inside_the_measured_range_is_not_recommended():
    """A truth that falls above 0.57 m/s: the nearer form follows it, the linear one rises all the way."""
    d, h, v = log_speed_truth(0).states.coordinates.T
    force = np.exp(4.5 - d - h**2 + 4 * v - 3.5 * v**2) * np.exp(np.random.default_rng(0).normal(0, 0.02, v.size))
    dataset = ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force)
    comparison = compare_forms(dataset, forms=[CFM_2D, Form.of("BENT", ["1", "v", "v^2", "d", "h^2"])])
    found = by_name(comparison)
    assert found["BENT"].error_percent < 0.5 * found["CFM_2D"].error_percent
    assert found["BENT"].p_better < 0.01
    assert (found["CFM_2D"].rises_inside, found["BENT"].rises_inside) == (True, False)
    assert comparison.recommended is CFM_2D
    assert "falls with speed inside the measured range" in why(comparison)


def test_a_default_that_falls_with_speed_gives_way_to_a_form_that_rises():
    """A truth that falls above 0.57 m/s: the nearest form falls, too, and is not recommended for all that."""
    d, h, v = log_speed_truth(0).states.coordinates.T
    force = np.exp(4.5 - d - h**2 + 4 * v - 3.5 * v**2) * np.exp(np.random.default_rng(0).normal(0, 0.02, v.size))
    dataset = ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force)
    comparison = compare_forms(dataset)
    found = by_name(comparison)
    assert [found[name].rises_inside for name in ("CFM_3D", "FULL_CUBIC", "LOG_SPEED")] == [False, False, True]
    assert found["FULL_CUBIC"].p_better < 0.01
    assert comparison.recommended is LOG_SPEED
    assert "LOG_SPEED in place of CFM_3D, whose force falls with speed" in why(comparison)
    assert "a bound may not cover that: measure in between" in why(comparison)
    falling = fit_force_map(dataset)
    slope = [falling.predict(*falling.steepest_fall[:2], falling.steepest_fall[2] + step) for step in (-1e-3, 1e-3)]
    assert slope[1] < slope[0]


def test_where_every_form_falls_with_speed_none_is_recommended():
    d, h, v = log_speed_truth(0).states.coordinates.T
    force = np.exp(6 - d - h**2 - v)
    comparison = compare_forms(ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force))
    assert comparison.recommended is None
    assert "every form falls with speed inside the measured range (CFM_3D, " in why(comparison)


def test_one_height_has_no_default_and_says_so():
    points = np.array([(d, 0.30, v) for d in np.linspace(0.56, 0.86, 7) for v in (0.2, 0.3, 0.4)])
    comparison = compare_forms(campaign(points=points))
    assert comparison.recommended is CFM_2D
    assert {each.form for each in comparison.refused} == {CFM_3D, LOG_SPEED, FULL_CUBIC}
    assert why(comparison).startswith("CFM_3D cannot be fitted")


def test_a_form_with_too_few_states_for_a_bound_keeps_its_errors():
    six = campaign(points=training_grid("kuka-iiwa7-10nm")[[0, 4, 11, 13, 18, 26]])
    comparison = compare_forms(six, forms=[CFM_2D])
    assert comparison.recommended is None
    assert "no form carries a bound" in why(comparison)
    result = by_name(comparison)["CFM_2D"]
    assert math.isnan(result.mean_bound_percent)
    assert "degrees of freedom" in " ".join(sentences(result.notes))
    assert result.error_percent > 0


def test_the_default_without_a_bound_says_so():
    """Eleven states: CFM_3D is the default and nearer, but only CFM_2D carries a bound; the reasons say so."""
    points = training_grid("kuka-iiwa7-10nm")
    eleven = campaign(points=points[[1, 5, 7, 10, 11, 12, 13, 17, 18, 20, 26]], device_range=2000.0)
    comparison = compare_forms(eleven, forms=[CFM_2D, CFM_3D])
    assert math.isnan(by_name(comparison)["CFM_3D"].mean_bound_percent)
    assert by_name(comparison)["CFM_2D"].mean_bound_percent > 0
    assert comparison.recommended is CFM_3D
    assert any("carries no bound" in reason for reason in sentences(comparison.reasons))


def test_wholly_censored_states_count_where_they_are_underestimated():
    dataset = campaign("ur10e", device_range=400.0)
    wholly = int(np.sum(dataset.states.impacts == 0))
    comparison = compare_forms(dataset)
    assert wholly > 0
    assert comparison.states == len(dataset.states) - wholly
    assert any(f"wholly censored states: {wholly}, of which " in line for line in sentences(comparison.statements))
    for each in comparison.results:
        assert each.accuracy.states == comparison.states
        assert each.accuracy.censored_states in (0, wholly)
    alone = leave_one_state_out(fit_force_map(dataset))
    assert by_name(compare_forms(dataset, forms=[CFM_3D]))["CFM_3D"].accuracy == alone


def test_a_form_that_is_worse_where_the_device_was_saturated_is_not_recommended():
    """Alike but for what the device cut off: clearly better below its range, and too low above it."""
    from forcemap.comparisons.forms import _clearly_better

    dataset = campaign("ur10e", device_range=400.0)
    results = by_name(compare_forms(dataset))
    standard = results["CFM_3D"]
    better = replace(
        standard,
        error_percent=0.5 * standard.error_percent,
        underestimation_percent=0.5 * standard.underestimation_percent,
        p_better=1e-9,
    )
    assert _clearly_better(better, standard, 0.01)
    farther = replace(better, censored_underestimation_percent=standard.censored_underestimation_percent + 0.1)
    assert not _clearly_better(farther, standard, 0.01)
    more = replace(better.accuracy, censored_underestimated=standard.accuracy.censored_underestimated + 1)
    assert not _clearly_better(replace(better, accuracy=more), standard, 0.01)
    assert results["CFM_2D"].censored_underestimation_percent > 0
    whole = compare_forms(campaign("ur10e", device_range=2000.0))
    assert {each.censored_underestimation_percent for each in whole.results} == {0.0}


@pytest.mark.parametrize("place_effect", [0.0, 0.03])
def test_p_values_are_those_of_paired_t_tests_state_by_state_and_place_by_place(place_effect):
    """By scipy, from predictions of fits without a state, or without a place."""
    dataset = campaign(device_range=2000.0)
    keys = np.round(np.column_stack([dataset.distance, dataset.height]), 6)
    _, place = np.unique(keys, axis=0, return_inverse=True)
    shared = np.exp(place_effect * np.random.default_rng(5).standard_normal(place.max() + 1))[place]
    dataset = replace(dataset, peak_force=dataset.peak_force * shared)
    forms = (CFM_3D, LOG_SPEED)
    (found,) = [each for each in compare_forms(dataset, forms=forms).results if each.form == LOG_SPEED]
    errors = {}
    for form in forms:
        whole = fit_force_map(dataset, form=form)
        states = whole.require_fit().states
        for of, groups in (("state", None), ("place", states.place)):
            left_out = np.log(left_out_predictions(whole, *([groups] if groups is not None else [])))
            errors[form, of] = left_out - states.log_force
    gain = {of: errors[CFM_3D, of] ** 2 - errors[LOG_SPEED, of] ** 2 for of in ("state", "place")}
    by_place = [gain["place"][states.place == each].sum() for each in np.unique(states.place)]
    p_state, p_place = (ttest_1samp(each, 0, alternative="greater").pvalue for each in (gain["state"], by_place))
    assert found.p_better == pytest.approx(p_state, rel=1e-6)
    assert found.p_better_at_places == pytest.approx(p_place, rel=1e-6)
    assert p_state != pytest.approx(p_place, rel=0.1)


def test_what_cannot_be_compared_is_refused():
    dataset = campaign()
    for wrong in ([], [CFM_3D, CFM_3D], [EUCLIDEAN_2D]):
        with pytest.raises(InputError, match="forms: found"):
            compare_forms(dataset, forms=wrong)
    for wrong in (ToleranceBound, 0.1, ForceMap):
        with pytest.raises(InputError, match="bound: found"):
            compare_forms(dataset, bound=wrong)
    with pytest.raises(FitError, match="no form can be compared: CFM_3D: "):
        compare_forms(dataset.select(dataset.state == "s0"), forms=[CFM_3D])
    few = campaign(points=training_grid("kuka-iiwa7-10nm")[[0, 5, 7, 10, 12, 17, 20, 22, 24]])
    with pytest.raises(FitError, match="no form can be compared"):
        compare_forms(few, forms=[CFM_3D])


@pytest.mark.parametrize("form", [CFM_3D, LOG_SPEED])
def test_the_error_with_all_states_of_a_place_left_out_is_that_of_refits(form):
    """By generalised least squares in numpy on the states of the other places, with the correlation of the whole."""
    points = full_grid("ur10e")
    dataset = campaign("ur10e", points=points[(points[:, 0] > 0.6) & (points[:, 2] < 0.35)])
    assert not dataset.censored.any()
    (result,) = (each for each in compare_forms(dataset, forms=(form,)).results)
    fit = fit_force_map(dataset, form=form).require_fit()
    states, rho = fit.states, fit.place_effect.correlation
    rows, y, place = form.design(*states.coordinates.T), states.log_force, states.place
    errors = np.empty(len(states))
    for number in np.unique(place):
        out = place == number
        same = place[~out][:, None] == place[~out]
        inverse = np.linalg.inv(rho * same + (1 - rho) * np.eye(int((~out).sum())))
        left = np.linalg.solve(rows[~out].T @ inverse @ rows[~out], rows[~out].T @ inverse @ y[~out])
        errors[out] = rows[out] @ left - y[out]
    assert result.place_error_percent == pytest.approx(100 * np.sqrt(np.mean(np.square(errors))), rel=1e-6)
    assert result.place_error_percent > result.error_percent
