"""Accuracy by hand, and states and places left out against refitting."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import statsmodels.api as sm
from oracle import alike, simulate

import forcemap as fm


def states_at(measured, censored=None):
    """A constant map that predicts e^5 N, on states measured at given multiples of it."""
    force = np.exp(5.0) * np.asarray(measured)
    return fm.ImpactDataset.from_arrays(
        distance=np.linspace(0.5, 0.9, len(force)),
        height=[0.2] * len(force),
        speed=[0.3] * len(force),
        peak_force=force,
        censored=censored,
    )


def constant_map():
    from dataclasses import replace

    return replace(fm.published_map("ur10e"), form=fm.Form.of("constant", ["1"]), coefficients=np.array([5.0]))


def test_by_hand():
    # measured 1.25, 1.6, 0.8 and 1.0 times the prediction: -20 %, -37.5 %, +25 %, 0 %
    accuracy = fm.force_map_accuracy(constant_map(), states_at([1.25, 1.6, 0.8, 1.0]))
    f = np.exp(5.0)
    assert accuracy.states == 4
    assert (accuracy.underestimated, accuracy.overestimated) == (2, 1)
    assert accuracy.max_underestimation_percent == pytest.approx(37.5)
    assert accuracy.max_underestimation == pytest.approx(0.6 * f)
    assert accuracy.mean_underestimation_percent == pytest.approx((20 + 37.5) / 2)
    assert accuracy.mean_underestimation == pytest.approx((0.25 + 0.6) / 2 * f)
    assert accuracy.max_overestimation_percent == pytest.approx(25)
    assert accuracy.max_overestimation == pytest.approx(0.2 * f)
    assert accuracy.rmse == pytest.approx(f * np.sqrt((0.25**2 + 0.6**2 + 0.2**2) / 4))
    assert accuracy.worst_state == "S2"


def test_the_newtons_are_those_of_the_state_of_the_maximum_percent():
    small, large = 0.5, 4.0  # +100 % of 0.5 F is 0.5 F; -75 % of 4 F is 3 F
    accuracy = fm.force_map_accuracy(constant_map(), states_at([small, 0.55, large, 3.9]))
    assert accuracy.max_overestimation == pytest.approx(0.5 * np.exp(5.0))
    assert accuracy.max_underestimation == pytest.approx(3.0 * np.exp(5.0))


def test_censored_states_are_counted_not_compared():
    accuracy = fm.force_map_accuracy(constant_map(), states_at([1.1, 1.2, 0.9], censored=[False, True, True]))
    assert (accuracy.states, accuracy.censored_states, accuracy.censored_underestimated) == (1, 2, 1)
    with pytest.raises(fm.InputError, match="no uncensored"):
        fm.force_map_accuracy(constant_map(), states_at([1.1, 1.2], censored=[True, True]))
    with pytest.raises(fm.InputError, match="no impact"):
        fm.force_map_accuracy(constant_map(), states_at([1.1, 1.2]).test)


@pytest.mark.parametrize("form", [fm.CFM_2D, fm.CFM_3D, fm.LOG_SPEED])
@pytest.mark.parametrize("left_out", [fm.leave_one_state_out, fm.leave_one_place_out])
def test_leaving_out_is_refitting(form, left_out):
    dataset = simulate("kuka-iiwa7-30nm", np.random.default_rng(12), effect=0.033, device_range=2000.0).dataset.train
    force_map = fm.fit_force_map(dataset, form=form)
    states = force_map.fit.states
    design, predicted = form.design(*states.coordinates.T), np.empty(len(states))
    places = np.unique(states.coordinates[:, :2], axis=0, return_inverse=True)[1]
    for number in np.unique(group := np.arange(len(states)) if left_out is fm.leave_one_state_out else places):
        rest = group != number
        sigma = alike(states, force_map.fit.place_effect.correlation)[np.ix_(rest, rest)]
        predicted[~rest] = np.exp(design[~rest] @ sm.GLS(states.log_force[rest], design[rest], sigma).fit().params)
    percent = 100 * (predicted / states.force - 1)
    accuracy = left_out(force_map)
    assert accuracy.states == len(states)
    assert accuracy.max_underestimation_percent == pytest.approx(-percent.min(), rel=1e-8)
    assert accuracy.max_overestimation_percent == pytest.approx(percent.max(), rel=1e-8)
    assert accuracy.mean_underestimation_percent == pytest.approx(-percent[percent < 0].mean(), rel=1e-8)


def test_published_maps_leave_no_state_out():
    with pytest.raises(fm.InputError, match="not fitted"):
        fm.leave_one_state_out(fm.published_map("ur10e"))


def test_as_many_states_as_coefficients():
    rng = np.random.default_rng(3)
    points = [(0.5, 0.2, 0.2), (0.6, 0.2, 0.3), (0.7, 0.2, 0.4), (0.8, 0.2, 0.2)]
    dataset = simulate("ur10e", rng, effect=0.01, points=points, train=np.ones(4, bool), device_range=900.0).dataset
    force_map = fm.fit_force_map(dataset, form=fm.CFM_2D)
    assert np.isnan(force_map.fit.state_sd)
    for left_out, what in ((fm.leave_one_state_out, "state"), (fm.leave_one_place_out, "place")):
        with pytest.raises(fm.InputError, match=f"no {what} can be left out"):
            left_out(force_map)
    assert [accuracy.on for accuracy in fm.map_accuracy(force_map, dataset)] == ["all states"]


def test_which_accuracy_comes_first(examples):
    dataset = examples["ur10e"]
    force_map = fm.fit_force_map(dataset)
    in_turn = ["leave-one-state-out", "leave-one-place-out"]
    assert [a.on for a in fm.map_accuracy(force_map, dataset)] == ["test states", *in_turn, "all states"]
    assert fm.map_accuracy(force_map, dataset.train)[0].on == "leave-one-state-out"
    # impacts that confirm were made where the map permitted speeds alone: they stand beside the others, not first
    tests = np.flatnonzero(dataset.role == "test")
    name = dataset.state.astype("U64")
    name[tests] = [f"c-{each}" for each in name[tests]]
    confirming = replace(dataset, state=name)
    found = fm.map_accuracy(force_map, confirming)
    assert [a.on for a in found] == [*in_turn, "confirming impacts", "all states"]
    assert found[2].max_underestimation == fm.map_accuracy(force_map, dataset)[0].max_underestimation
