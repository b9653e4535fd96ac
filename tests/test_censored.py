"""The censored fit against independent likelihoods, and against least squares where nothing is censored."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from oracle import printed_force, simulate
from scipy import integrate, optimize, stats

import forcemap as fm
from forcemap.errors import RankDeficient
from forcemap.maps.censored import StateData, censored_regression, state_data
from forcemap.maps.fit import repeat_variance
from forcemap.maps.map_file import map_text
from forcemap.maps.places import place_regression
from sizes import FULL_SIZE

DISCARD = fm.CensoredImpacts.DISCARD


def campaign(seed, *, name="ur10e", device_range=400.0, effect=0.022, repeats=3):
    return simulate(
        name, np.random.default_rng(seed), effect=effect, repeats=repeats, device_range=device_range
    ).dataset.train


def data_of(train, form=fm.CFM_3D, correlation=0.0):
    return state_data(form.design(*train.states.coordinates.T), train.states, repeat_variance(train), correlation)


@pytest.mark.parametrize("form", [fm.CFM_2D, fm.CFM_3D, fm.LOG_SPEED])
@pytest.mark.parametrize("repeats", [1, 3])
@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_without_censoring_it_is_least_squares(form, repeats, correlation):
    data = data_of(campaign(1, device_range=1e4, repeats=repeats), form, correlation)
    found = censored_regression(data)
    expected = place_regression(data.design, data.mean, data.place, correlation)
    near = 1e-8 if correlation == 0 else 1e-6
    np.testing.assert_allclose(found.coefficients, expected.coefficients, rtol=near)
    np.testing.assert_allclose(found.standard_errors, expected.standard_errors, rtol=near)
    np.testing.assert_allclose(found.leverage, expected.leverage, rtol=near)
    assert found.residual_sd == pytest.approx(expected.residual_sd, rel=near)
    assert found.degrees_of_freedom == pytest.approx(expected.degrees_of_freedom, rel=1e-5)
    assert found.rmse == pytest.approx(expected.rmse, rel=1e-8)
    assert found.r_squared == pytest.approx(expected.r_squared, rel=1e-8)


def test_single_repeats_give_the_tobit_likelihood():
    """With one repeat a state: normal density or normal survival function, maximised by scipy."""
    data = data_of(campaign(2, repeats=1))
    found = censored_regression(data)
    s = found.residual_sd
    cut = data.censored > 0
    assert cut.sum() >= 4

    def minus_log_likelihood(b):
        level = data.design @ b
        density = stats.norm.logpdf(data.mean[~cut], level[~cut], s).sum()
        return -density - stats.norm.logsf(data.threshold[cut], level[cut], s).sum()

    best = optimize.minimize(minus_log_likelihood, found.coefficients, method="BFGS", options={"gtol": 1e-7})
    assert minus_log_likelihood(found.coefficients) <= best.fun + 1e-7
    np.testing.assert_allclose(data.design @ found.coefficients, data.design @ best.x, atol=1e-5)


@pytest.mark.parametrize("seed", [3, 5] if FULL_SIZE else [3])
def test_repeats_give_the_likelihood_of_two_variance_components(seed):
    """The likelihood of every state by adaptive quadrature over its effect, repeat by repeat."""
    train = campaign(seed, device_range=380.0, effect=0.03)
    data = data_of(train)
    found = censored_regression(data)
    sigma = math.sqrt(data.repeat_variance)
    tau = math.sqrt(found.residual_sd**2 - data.repeat_variance / 3)

    def minus_log_likelihood(b):
        total = 0.0
        for level, mean, n, k, c in zip(
            data.design @ b, data.mean, data.impacts, data.censored, data.threshold, strict=True
        ):

            def density(a, level=level, mean=mean, n=n, k=k, c=c):
                value = stats.norm.pdf(a, 0, tau)
                if n:
                    value *= stats.norm.pdf(mean, level + a, sigma / math.sqrt(n))
                return value * stats.norm.cdf((level + a - c) / sigma) ** k if k else value

            points = sorted({p - level for p in (mean, c) if not math.isnan(p)})
            total += math.log(
                integrate.quad(density, -9 * tau, 9 * tau, points=points, limit=300, epsabs=0, epsrel=1e-9)[0]
            )
        return -total

    at_best = minus_log_likelihood(found.coefficients)
    rng = np.random.default_rng(seed)
    for _ in range(2 if FULL_SIZE else 1):  # no direction leads further up
        step = rng.normal(size=data.design.shape[1])
        step *= 1e-3 / np.abs(data.design @ step).max()
        ahead, behind = (minus_log_likelihood(found.coefficients + sign * step) for sign in (1, -1))
        assert min(ahead, behind) > at_best - 1e-9
        assert abs(ahead - behind) < 0.02 * (ahead + behind - 2 * at_best) + 1e-7


def test_censored_states_belong_to_the_map():
    train = campaign(6)
    force_map, discarded = fm.fit_force_map(train), fm.fit_force_map(train, impacts=DISCARD)
    wholly = train.states.impacts == 0
    assert wholly.sum() >= 3
    assert force_map.fit.censored_fit
    assert not discarded.fit.censored_fit
    assert len(force_map.fit.states) == 27
    assert not len(force_map.fit.left_out)
    assert len(discarded.fit.states) == 27 - wholly.sum() == 27 - len(discarded.fit.left_out)
    assert len(force_map.measured_range.points) == 27
    discarded_freedom = discarded.fit.between_states.degrees_of_freedom
    assert 0.9 * discarded_freedom < force_map.fit.between_states.degrees_of_freedom <= 18
    accuracy = fm.leave_one_state_out(force_map)
    assert accuracy.censored_states == wholly.sum()
    assert accuracy.max_underestimation_percent < 20


def test_left_out_predictions_are_refits():
    train = campaign(7, effect=0.03)
    force_map = fm.fit_force_map(train)
    from forcemap.maps.accuracy import left_out_predictions

    predicted = left_out_predictions(force_map)
    states = force_map.fit.states
    for i in range(0, 27, 4):
        again = fm.fit_force_map(train.select(train.state != states.name[i]))
        # the variance is kept, which moves what the censored states pull by little
        assert predicted[i] == pytest.approx(
            again.predict(states.distance[i], states.height[i], states.speed[i]), rel=0.01
        )


def test_a_map_file_gives_back_the_same_bound(tmp_path):
    force_map = fm.fit_force_map(campaign(8))
    fm.write_map(force_map, tmp_path / "map.json")
    again = fm.read_map(tmp_path / "map.json")
    rng = np.random.default_rng(8)
    d, h, v = rng.uniform([0.52, 0.14, 0.2], [0.89, 0.46, 0.4], (500, 3)).T
    bound = fm.ToleranceBound()
    np.testing.assert_array_equal(bound.upper(again, d, h, v), bound.upper(force_map, d, h, v))
    np.testing.assert_array_equal(again.predict(d, h, v), force_map.predict(d, h, v))
    assert map_text(again) == map_text(force_map)
    assert again.fit.censored_fit


def test_a_higher_censored_force_never_lowers_the_map_there():
    """What is known to be at least 400 N, made at least 450 N: the prediction there does not fall."""
    train = campaign(9)
    raised = replace(train, peak_force=np.where(train.censored, 450.0, train.peak_force))
    wholly = train.states.select(train.states.impacts == 0)
    where = (wholly.distance, wholly.height, wholly.speed)
    low, high = fm.fit_force_map(train).predict(*where), fm.fit_force_map(raised).predict(*where)
    assert (high >= low * (1 - 1e-9)).all()
    assert (high > low * 1.001).any()


def test_repeats_that_contradict_each_other_give_a_wide_bound_or_a_refusal():
    train = campaign(10, device_range=1e4)
    rows = train.state == train.states.name[13]
    force = np.where(rows & (train.repeat > 1), 1500.0, train.peak_force)
    odd = replace(train, peak_force=force, censored=rows & (train.repeat > 1))
    assert fm.fit_force_map(odd).fit.state_sd > 2 * fm.fit_force_map(train).fit.state_sd


def test_as_few_uncensored_states_as_coefficients_discard_and_say_so():
    train = campaign(11, device_range=1e4)
    kept = np.isin(train.state, np.array(train.states.name)[[0, 2, 8, 13, 18, 20, 24, 26, 9, 17]])
    names = np.array(train.select(kept).states.name)
    few = train.select(kept)
    cut = replace(few, censored=few.state == names[-1])
    force_map = fm.fit_force_map(cut)
    assert not force_map.fit.censored_fit
    assert force_map.fit.left_out.name == (names[-1],)


def test_a_form_that_the_states_do_not_tell_is_refused_with_its_own_coefficients():
    with pytest.raises(RankDeficient, match="of the 20 coefficients"):  # and not of the effects of places, too
        fm.fit_force_map(campaign(6, device_range=600.0), form=fm.FULL_CUBIC)


def test_state_data_is_what_repeats_say():
    data = data_of(campaign(13))
    assert isinstance(data, StateData)
    assert ((data.impacts + data.censored) == 3).all()
    assert (np.isnan(data.mean) == (data.impacts == 0)).all()
    assert (np.isnan(data.threshold) == (data.censored == 0)).all()
    np.testing.assert_allclose(np.exp(data.threshold[data.censored > 0]), 400.0)


def test_the_mode_of_a_lower_bounds_effect_is_where_its_density_is_largest():
    """Against all values on a fine grid: a normal effect of a state, times the chance that so many repeats exceed c."""
    from scipy.special import log_ndtr

    from forcemap.maps.censored import _mode

    rng = np.random.default_rng(28)
    sd, noise = rng.uniform(0.001, 0.01, 40), 0.05
    m, threshold, count = rng.uniform(4.6, 5.4, 40), rng.uniform(4.9, 5.1, 40), rng.integers(1, 6, 40)
    for i, mode in enumerate(_mode(m, sd, threshold, noise, count)):
        u = np.linspace(-1, 12, 130_001)
        log_density = -0.5 * u**2 + count[i] * log_ndtr((m[i] + sd[i] * u - threshold[i]) / noise)
        assert abs((mode - m[i]) / sd[i] - u[log_density.argmax()]) < 2e-3


@pytest.mark.parametrize("form", [fm.CFM_3D, fm.LOG_SPEED])
def test_a_state_known_as_at_least_alone_changes_no_standard_error(form):
    """Far below the map's force it tells nothing: the errors are those of the others, in numpy from equation 10."""
    rng = np.random.default_rng(4)
    plan = fm.plan_measurements((0.52, 0.89), (0.14, 0.46), (0.2, 0.4), repeats=1, again=0)
    at = np.column_stack([plan.distance, plan.height, plan.speed])
    _, place = np.unique(at[:, :2].round(6), axis=0, return_inverse=True)
    force = printed_force("ur10e", *at.T) * np.exp(
        rng.normal(0, 0.02, place.max() + 1)[place] + rng.normal(0, 0.004, 27)
    )
    highest = int(force.argmax())
    force[highest] *= 0.5
    given = {"distance": at[:, 0], "height": at[:, 1], "speed": at[:, 2], "peak_force": force}
    given |= {"state": [f"s{i}" for i in range(27)], "censored": np.arange(27) == highest}
    fit = fm.fit_force_map(fm.ImpactDataset.from_arrays(**given), form=form).require_fit()
    known = np.arange(27) != highest
    rows, own = form.design(*at[known].T), place[known]
    same = own[:, None] == own

    def errors(rho):
        effect = fit.place_effect
        inverse = np.linalg.inv(effect.correlation * same + (1 - effect.correlation) * np.eye(26))
        estimator = np.linalg.solve(rows.T @ inverse @ rows, rows.T @ inverse)
        return np.sqrt(np.diag(estimator @ (rho * same + (1 - rho) * np.eye(26)) @ estimator.T))

    ends = errors(fit.place_effect.correlation), errors(fit.place_effect.least)
    wanted = fit.state_sd * np.maximum(*ends)
    np.testing.assert_allclose(fit.standard_errors, wanted, rtol=2e-3)
    assert (ends[1] > 1.01 * ends[0]).any()
