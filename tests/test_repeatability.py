"""Repeatability: against scipy and statsmodels, the paper's figures by simulation, and false alarms of outliers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

import forcemap as fm
from forcemap.campaigns.repeatability import _medians_of_others, repeatability


def campaign(force, *, angle=None, censored=None, angles_of=None, conditions=None):
    """A dataset from a list of forces for every state; states 20 mm apart in distance."""
    state = np.repeat(np.arange(len(force)), [len(each) for each in force])
    n = state.size
    return fm.ImpactDataset.from_arrays(
        distance=0.3 + 0.02 * state, height=np.full(n, 0.1), speed=np.full(n, 0.3),
        peak_force=np.concatenate(force), state=[f"s{i:03d}" for i in state], censored=censored, base_angle=angle,
        recording=[f"file{i}" for i in range(n)], conditions=conditions,
    )  # fmt: skip


def noisy(rng, states, repeats, *, newtons=0.0, percent=0.0):
    mean = rng.uniform(100, 480, states)[:, None]
    shape = (states, repeats)
    return list(mean * np.exp(rng.normal(0, percent / 100, shape)) + rng.normal(0, newtons, shape))


def test_figures_of_a_small_campaign_by_hand():
    result = repeatability(campaign([[100.0, 102.0, 104.0], [200.0, 201.0], [300.0]]))
    assert result.state == ("s000", "s001", "s002")
    assert result.impacts.tolist() == [3, 2, 1]
    np.testing.assert_allclose(result.mean, [102, 200.5, 300])
    np.testing.assert_allclose(result.sd, [2, math.sqrt(0.5), math.nan])
    assert result.max_sd == pytest.approx(2)
    assert result.mean_sd == pytest.approx((2 + math.sqrt(0.5)) / 2)
    assert result.max_sd_percent == pytest.approx(200 / 102)
    assert result.mean_sd_percent == pytest.approx((200 / 102 + 100 * math.sqrt(0.5) / 200.5) / 2)
    assert result.within_state_sd == pytest.approx(math.sqrt((8 + 0.5) / 3))
    assert (result.outliers, result.symmetry) == ((), None)


@pytest.mark.parametrize("counts", [[3] * 9, [3, 2, 5, 1, 3, 4, 1, 2]])
def test_components_agree_with_an_analysis_of_variance(counts):
    rng = np.random.default_rng(3)
    force = [300 + rng.normal(0, 20) + rng.normal(0, 4, n) for n in counts]
    result = repeatability(campaign(force))
    n = np.array(counts)
    effective = (n.sum() - (n**2).sum() / n.sum()) / (n.size - 1)
    for values, within, between in (
        (force, result.within_state_sd, result.between_state_sd),
        ([np.log(f) for f in force], result.within_state_sd_percent / 100, result.between_state_sd_percent / 100),
    ):
        f_ratio = stats.f_oneway(*values).statistic
        squares = sum(np.sum((each - each.mean()) ** 2) for each in values)
        assert within == pytest.approx(math.sqrt(squares / (n.sum() - n.size)), rel=1e-9)
        assert between == pytest.approx(within * math.sqrt((f_ratio - 1) / effective), rel=1e-9)


def test_components_agree_with_a_mixed_model():
    """REML equals the method of moments for equal numbers of repeats."""
    pytest.importorskip("statsmodels")
    from statsmodels.regression.mixed_linear_model import MixedLM

    rng = np.random.default_rng(5)
    force = [300 + rng.normal(0, 20) + rng.normal(0, 4, 3) for _ in range(30)]
    result = repeatability(campaign(force))
    groups = np.repeat(np.arange(30), 3)
    fit = MixedLM(np.concatenate(force), np.ones((90, 1)), groups).fit(reml=True)
    assert result.within_state_sd == pytest.approx(math.sqrt(fit.scale), rel=1e-3)
    assert result.between_state_sd == pytest.approx(math.sqrt(fit.cov_re.item()), rel=1e-3)


def test_components_are_recovered_on_average():
    """Relative scatter of 2 % between and 0.4 % within states, unequal numbers of repeats."""
    rng = np.random.default_rng(7)
    squares = []
    for _ in range(300):
        force = [300 * np.exp(rng.normal(0, 0.02) + rng.normal(0, 0.004, n)) for n in [3] * 20 + [2] * 5 + [1] * 2]
        result = repeatability(campaign(force))
        squares.append([result.within_state_sd_percent**2, result.between_state_sd_percent**2])
    np.testing.assert_allclose(np.sqrt(np.mean(squares, axis=0)), [0.4, 2.0], rtol=0.03)


def test_no_scatter_between_states_is_zero_not_negative():
    rng = np.random.default_rng(11)
    found = [repeatability(campaign(list(300 + rng.normal(0, 4, (9, 3))))).between_state_sd for _ in range(50)]
    assert min(found) == 0.0
    assert not np.isnan(found).any()


def test_what_cannot_be_told_is_nan():
    single = repeatability(campaign([[100.0], [200.0]]))
    figures = (single.max_sd, single.mean_sd_percent, single.within_state_sd, single.between_state_sd_percent)
    assert all(math.isnan(figure) for figure in figures)
    assert single.outliers == ()
    lonely = repeatability(campaign([[100.0, 101.0]]))
    assert lonely.within_state_sd == pytest.approx(math.sqrt(0.5))
    assert math.isnan(lonely.between_state_sd)
    nothing = repeatability(campaign([[500.0, 500.0]], censored=[True, True]))
    assert (nothing.impacts.tolist(), nothing.censored.tolist()) == ([0], [2])
    assert math.isnan(nothing.mean[0])
    assert math.isnan(nothing.max_sd)


def test_censored_impacts_are_left_out_and_counted():
    result = repeatability(
        campaign([[490.0, 492.0, 500.0], [100.0, 101.0]], censored=[False, False, True, False, False])
    )
    assert result.impacts.tolist() == [2, 2]
    assert result.censored.tolist() == [1, 0]
    assert result.mean[0] == 491
    assert result.sd[0] == pytest.approx(math.sqrt(2))


def test_the_papers_repeatability():
    """SD 1.12 N on average and 3.85 N at most over 115 states of three repeats (section V-A): noise of about 1.26 N.

    The mean of SDs of three is 0.886 of the SD itself.
    """
    rng = np.random.default_rng(13)
    means = [repeatability(campaign(noisy(rng, 115, 3, newtons=1.26))).mean_sd for _ in range(20)]
    assert np.mean(means) == pytest.approx(1.12, abs=0.02)
    means = [repeatability(campaign(noisy(rng, 115, 3, newtons=1.1))).mean_sd for _ in range(20)]
    assert np.mean(means) == pytest.approx(0.975, abs=0.02)


def test_examples_have_the_papers_repeatability(examples):
    result = repeatability(examples["ur10e"])
    assert 0.3 < result.mean_sd < 3
    assert result.symmetry is None
    once = examples["kuka-iiwa7-10nm"].independent_test
    assert math.isnan(repeatability(once).mean_sd)  # one impact a state


# outliers


def test_an_outlier_is_named_with_its_recording():
    rng = np.random.default_rng(17)
    force = noisy(rng, 27, 3, newtons=1.1)
    force[4][1] += 20
    (found,) = repeatability(campaign(force)).outliers
    assert (found.state, found.repeat, found.recording) == ("s004", 2, "file13")
    others = (force[4][0] + force[4][2]) / 2
    assert (found.force, found.others_median) == pytest.approx((force[4][1], others))
    assert found.deviation == pytest.approx(force[4][1] - others)


def test_many_outliers_do_not_hide_each_other():
    rng = np.random.default_rng(19)
    force = noisy(rng, 27, 3, newtons=1.1)
    for state in range(0, 27, 3):
        force[state][0] -= 25
    found = repeatability(campaign(force)).outliers
    assert {(each.state, each.repeat) for each in found} == {(f"s{i:03d}", 1) for i in range(0, 27, 3)}


def test_of_two_that_disagree_both_are_named():
    rng = np.random.default_rng(23)
    force = noisy(rng, 27, 2, newtons=1.1)
    force[3] = np.array([200.0, 230.0])
    assert {(each.state, each.repeat) for each in repeatability(campaign(force)).outliers} == {("s003", 1), ("s003", 2)}


def test_nothing_within_the_device_error_is_an_outlier():
    force = [np.array([200.0, 200.0, 200.0 + 2.9 * (i == 0)]) for i in range(27)]
    assert repeatability(campaign(force)).outliers == ()
    strict = fm.Conditions(device=fm.Device(range=500, error=1.0))
    assert len(repeatability(campaign(force, conditions=strict)).outliers) == 1


@pytest.mark.parametrize("noise", [{"newtons": 3.0}, {"percent": 1.5}])
@pytest.mark.parametrize(("states", "repeats"), [(27, 3), (27, 2), (8, 10)])
def test_noise_alone_is_rarely_named(noise, states, repeats, full_size):
    """Fewer than 1 campaign in 100 names more than one, and fewer than 3 any; noise well above the device error."""
    rng = np.random.default_rng(29)
    campaigns = 4000 if full_size else 60
    named = np.array([
        len(repeatability(campaign(noisy(rng, states, repeats, **noise))).outliers) for _ in range(campaigns)
    ])  # fmt: skip
    assert stats.binomtest(int(np.sum(named > 1)), campaigns, 0.01, "greater").pvalue > 0.001
    assert stats.binomtest(int(np.sum(named > 0)), campaigns, 0.03, "greater").pvalue > 0.001


# rotational symmetry


def circle(force_by_angle, **options):
    force = np.concatenate(list(force_by_angle.values()))
    angle = np.repeat(list(force_by_angle), [len(each) for each in force_by_angle.values()])
    return repeatability(campaign([force], angle=angle, **options))


def test_a_circle_by_hand():
    result = circle({0.0: [100.0, 102.0], 45.0: [104.0, 106.0], 90.0: [100.0, 100.0]})
    (found,) = result.symmetry.circles
    assert found.angle.tolist() == [0.0, 45.0, 90.0]
    assert found.force.tolist() == [101.0, 105.0, 100.0]
    assert found.impacts.tolist() == [2, 2, 2]
    assert found.difference == result.symmetry.max_difference == result.symmetry.mean_difference == 5
    assert found.difference_percent == pytest.approx(500 / 102)
    # Repeats are those at one angle: the difference between angles is not their scatter, nor an outlier.
    assert result.sd[0] == pytest.approx(math.sqrt((2 + 2 + 0) / 3))
    assert result.outliers == ()


@pytest.mark.parametrize("angles", [(0.0, 1.0), (359.8, 0.3), (-0.4, 360.4), (10.0, 370.9), (180.0, -180.0)])
def test_angles_within_a_degree_are_one(angles):
    assert circle({angle: [100.0, 101.0] for angle in angles}).symmetry is None


@pytest.mark.parametrize("angles", [(0.0, 1.1), (359.0, 0.3), (-90.0, 90.0)])
def test_angles_further_apart_are_a_circle(angles):
    result = circle({angles[0]: [100.0, 101.0], angles[1]: [110.0, 111.0]})
    assert result.symmetry.max_difference == 10


def test_the_campaigns_angle_stands_for_one_that_is_not_stated():
    forces = {math.nan: [100.0, 101.0], 90.0: [104.0, 105.0]}
    assert circle(forces).symmetry is None
    assert circle(forces, conditions=fm.Conditions(base_angle=0.0)).symmetry.max_difference == 4
    assert circle(forces, conditions=fm.Conditions(base_angle=90.0)).symmetry is None


def test_a_wholly_censored_angle_is_shown_as_unknown():
    result = circle({0.0: [480.0, 482.0], 90.0: [500.0, 500.0]}, censored=[False, False, True, True])
    (found,) = result.symmetry.circles
    assert found.censored == 2
    assert np.isnan(found.force[1])
    assert math.isnan(found.difference)
    assert math.isnan(result.symmetry.max_difference)


def test_noise_alone_makes_the_papers_mean_difference_between_angles():
    """13 circles at 3 angles with 3 repeats: noise of 1.1 N alone differs by 1.07 N; the paper found 1 N."""
    rng = np.random.default_rng(31)
    found = []
    for _ in range(40):
        force = list(rng.uniform(100, 480, 13)[:, None] + rng.normal(0, 1.1, (13, 9)))
        result = repeatability(campaign(force, angle=np.tile(np.repeat([0.0, 45.0, 90.0], 3), 13)))
        found.append(result.symmetry.mean_difference)
    assert len(result.symmetry.circles) == 13
    assert np.mean(found) == pytest.approx(1.1 * 1.693 / math.sqrt(3), abs=0.05)


def test_a_joint_that_matters_is_seen():
    rng = np.random.default_rng(37)
    angle = np.repeat([0.0, 45.0, 90.0], 3)
    force = list(300 + rng.normal(0, 1.1, (13, 9)) + 10 * (angle == 90))
    result = repeatability(campaign(force, angle=np.tile(angle, 13)))
    assert 9 < result.symmetry.mean_difference < 13
    assert result.within_state_sd < 1.5


def test_property_the_medians_of_others_are_those_of_what_is_left():
    rng = np.random.default_rng(202618)
    for _ in range(300):
        values = rng.choice([rng.normal(size=6), rng.integers(0, 3, 6)])[rng.integers(0, 6, rng.integers(2, 12))] * 1.0
        expected = [np.median(np.delete(values, i)) for i in range(values.size)]
        assert _medians_of_others(values).tolist() == expected
