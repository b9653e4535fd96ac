"""I-optimal designs: against brute force, against random ones, what is kept, what is refused."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from oracle import full_grid

import forcemap as fm
from forcemap.errors import InputError, RankDeficient, TooFewStates
from forcemap.planning.optimal_states import optimal_states
from forcemap.words import sentence

LINE = fm.Form.of("LINE", ["1", "d", "v"])
AXES = (0.5, 0.6, 0.8), (0.2,), (0.1, 0.2, 0.4)
SMALL = np.stack(np.meshgrid(*AXES, indexing="ij"), axis=-1).reshape(-1, 3)


def mean_variance(form, states, region, misfit=0.95):
    """Of generalised least squares, what the form misses being alike at states close to each other."""
    states, region = np.asarray(states), np.asarray(region)
    x, wanted = form.design(*states.T), form.design(*region.T)
    size = np.ptp(region, axis=0)
    apart = (states[:, None] - states[None]) / np.where(size > 0, size, 1)
    v = misfit * np.exp(-np.square(apart).sum(axis=2) / 0.64) + (1 - misfit) * np.eye(len(states))
    return float(np.mean(np.einsum("ij,jk,ik->i", wanted, np.linalg.inv(x.T @ np.linalg.inv(v) @ x), wanted)))


@pytest.fixture(scope="module")
def thousand():
    rng = np.random.default_rng(1)
    return np.column_stack([rng.uniform(0.5, 0.9, 1000), rng.uniform(0.1, 0.5, 1000), rng.uniform(0.2, 0.4, 1000)])


@pytest.mark.parametrize("misfit", [0.0, 0.95])
@pytest.mark.parametrize("n", [3, 4, 5])
def test_a_small_design_is_the_best_of_all(n, misfit):
    best = min(
        mean_variance(LINE, SMALL[list(each)], SMALL, misfit)
        for each in itertools.combinations(range(len(SMALL)), n)
        if np.linalg.matrix_rank(LINE.design(*SMALL[list(each)].T)) == 3
    )
    found = optimal_states(SMALL, n, form=LINE, misfit=misfit)
    assert found.mean_variance == pytest.approx(best, rel=1e-9)
    assert mean_variance(LINE, found.states, SMALL, misfit) == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("form", [fm.CFM_3D, fm.LOG_SPEED], ids=lambda form: form.name)
def test_18_of_a_thousand_are_better_than_random(form, thousand):
    found = optimal_states(thousand, 18, form=form)
    assert len(set(found.index.tolist())) == 18
    np.testing.assert_array_equal(thousand[found.index], found.states)
    rng = np.random.default_rng(2)
    random = [rng.choice(thousand, 18, replace=False) for _ in range(50)]
    assert found.mean_variance < min(mean_variance(form, each, thousand) for each in random)
    classical = optimal_states(thousand, 18, form=form, misfit=0.0).mean_variance
    assert classical < 0.6 * min(mean_variance(form, each, thousand, 0.0) for each in random)
    for seed in (1, 2):
        assert optimal_states(thousand, 18, form=form, seed=seed).mean_variance <= 1.02 * found.mean_variance
    again = optimal_states(thousand, 18, form=form)
    np.testing.assert_array_equal(again.index, found.index)


def test_no_single_exchange_helps(thousand):
    few = thousand[:120]
    found = optimal_states(few, 14)
    for i, other in itertools.product(range(14), few):
        changed = np.vstack([np.delete(found.states, i, axis=0), other])
        assert mean_variance(fm.CFM_3D, changed, few) >= found.mean_variance * (1 - 1e-6)


def test_the_region_its_weights_and_fixed_states_count():
    grid = full_grid("ur10e")
    slow = grid[grid[:, 2] == 0.2]
    everywhere, here = optimal_states(grid, 14), optimal_states(grid, 14, region=slow)
    assert mean_variance(fm.CFM_3D, here.states, slow) < mean_variance(fm.CFM_3D, everywhere.states, slow)
    weighted = optimal_states(grid, 14, weights=(grid[:, 2] == 0.2).astype(float))
    assert weighted.mean_variance == pytest.approx(here.mean_variance)
    measured = here.states
    more = optimal_states(grid, 6, fixed=measured)
    assert more.mean_variance == pytest.approx(mean_variance(fm.CFM_3D, np.vstack([measured, more.states]), grid))
    assert not {tuple(s) for s in more.states} & {tuple(s) for s in measured}
    assert set(optimal_states(grid, 12, required=[0, 7]).index) >= {0, 7}


def test_states_are_no_repeats_of_each_other():
    close = np.vstack([SMALL, SMALL + np.array([0.001, 0, 0.002])])
    states = optimal_states(close, 9, form=LINE).states
    apart = np.abs(states[:, None] - states[None]) / [0.005, 0.005, 0.01]
    assert np.all(apart.max(axis=2)[~np.eye(9, dtype=bool)] > 1)


def test_the_expected_width_is_that_of_the_bound():
    """Simulated: states that scatter by 2.5 %, half the variance shared; the width of the bound, on average."""
    grid = full_grid("ur10e")
    found = optimal_states(grid, 18)
    place = np.unique(found.states[:, :2], axis=0, return_inverse=True)[1]
    rng = np.random.default_rng(3)
    widths = []
    for _ in range(200):
        effect = 0.025 * np.sqrt(0.5) * (rng.normal(size=18)[place] + rng.normal(size=18))
        force = fm.published_map("ur10e").predict(*found.states.T) * np.exp(effect)
        force_map = fm.fit_force_map(
            fm.ImpactDataset.from_arrays(
                distance=found.states[:, 0], height=found.states[:, 1], speed=found.states[:, 2], peak_force=force
            )
        )
        upper = fm.ToleranceBound(device_error=0.0).upper(force_map, *grid.T)
        widths.append(np.mean(upper / force_map.predict(*grid.T) - 1))
    assert found.state_sd == 0.025
    assert found.bound_width == pytest.approx(np.mean(widths), rel=0.06)


def test_states_lie_at_new_places_and_speeds_and_at_no_more_places_than_asked():
    axes = np.linspace(0.52, 0.89, 9), np.linspace(0.14, 0.46, 9), np.linspace(0.1, 0.4, 9)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    def levels(**options):
        states = optimal_states(grid, 18, **options).states
        return len(np.unique(states[:, :2], axis=0)), [np.unique(each).size for each in states.T]

    places, apart = levels()
    classical = levels(misfit=0.0)
    assert places >= 12
    assert min(apart) >= 5 > min(classical[1])
    assert [levels(places=most)[0] for most in (9, 11)] == [9, 11]


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"n": 0}, InputError, "states: found 0"),
        ({"n": 10}, InputError, "from 1 to 9"),
        ({"n": 2}, TooFewStates, "found 2 states, expected at least 3"),
        ({"candidates": [[0.5, 0.1]]}, InputError, "candidates: expected finite"),
        ({"candidates": [[0.5, 0.1, np.nan]] * 9}, InputError, "candidates: expected finite"),
        ({"candidates": []}, InputError, "found none"),
        ({"candidates": SMALL[SMALL[:, 0] == 0.5], "n": 3}, RankDeficient, "do not tell the 3 terms"),
        (
            {"candidates": np.vstack([SMALL[:4], SMALL[:4] + 0.001]), "n": 5},
            RankDeficient,
            "only 4 of the 8 candidates",
        ),
        ({"required": [9]}, InputError, "required: found 9"),
        ({"required": [-1]}, InputError, "required"),
        ({"weights": [1.0]}, InputError, "weights"),
        ({"weights": np.zeros(9)}, InputError, "weights"),
        ({"state_sd": 2.5}, InputError, "state SD: found 2.5"),
        ({"misfit": 1.0}, InputError, "misfit: found 1"),
        ({"places": 0}, InputError, "places: found 0"),
        ({"places": 2, "required": [0, 3, 6]}, InputError, "places: found 2, expected a whole number of at least 3"),
    ],
)
def test_unusable_arguments_are_refused(change, error, message):
    with pytest.raises(error, match=message):
        optimal_states(**({"candidates": SMALL, "n": 4, "form": LINE} | change))


@pytest.mark.parametrize("form", [fm.CFM_3D, fm.LOG_SPEED], ids=lambda form: form.name)
def test_a_plan_keeps_the_corners_of_the_measured_range(form):
    plan = fm.plan_measurements((0.52, 0.89), (0.14, 0.46), (0.2, 0.4), design=fm.Design.I_OPTIMAL, form=form)
    states = set(zip(plan.distance.tolist(), plan.height.tolist(), plan.speed.tolist(), strict=True))
    assert len(plan.states) == len(states) == 18
    assert set(plan.role) == {"train"}
    assert states >= set(itertools.product((0.52, 0.89), (0.14, 0.46), (0.2, 0.4)))
    assert plan.by_place
    assert plan.warnings == ()


def test_a_plan_keeps_to_the_device_range_and_names_the_bound_to_expect():
    options = {"expected_force": fm.published_map("ur10e"), "device": fm.Device(range=350.0, error=3.0)}
    ranges = {"distances": (0.52, 0.89), "heights": (0.14, 0.46), "speeds": (0.1, 0.4), "design": fm.Design.I_OPTIMAL}
    plan = fm.plan_measurements(**ranges, **options)
    assert len(plan.states) == 18
    assert plan.expected_force.max() <= 347
    few = fm.plan_measurements(**ranges, **options, states=13)
    assert len(few.states) == 13
    assert "13 states to train, fewer than 18: the bound is expected to lie" in sentence(few.warnings[0])
    with pytest.raises(InputError, match="states: found 0"):
        fm.plan_measurements(**ranges, states=0)
    for states in (7, 8, 10):
        with pytest.raises(TooFewStates, match=f"found {states}, expected at least 11: the 8 corners of the range"):
            fm.plan_measurements(**ranges, states=states)
