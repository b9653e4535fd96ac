"""Term selection against the paper's eight terms, an independent step-by-step reading, and its stability."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import PRINTED, full_grid, simulate, training_grid
from scipy import stats

from forcemap import (
    CFM_2D,
    CFM_3D,
    FULL_CUBIC,
    FitError,
    Form,
    ImpactDataset,
    InputError,
    RankDeficient,
    TooFewStates,
    fit_force_map as fit,
)
from forcemap.comparisons.selection import PAPER_COUNTS, STABLE_SHARE, select_terms, selection_stability
from forcemap.words import sentence, sentences

REPEAT_SD = dict(zip(PRINTED, (1.1, 0.6, 0.6), strict=True))
REPEATS = dict(zip(PRINTED, (3, 3, 1), strict=True))
NO_EFFECT = (0.0, 0.0, 0.0)
STATE_EFFECTS = (0.022, 0.033, 0.021)


def papers_grid(name):
    """The paper's states: the UR10e's without its two omitted places."""
    points = full_grid(name)
    omitted = np.isclose(points[:, 1], 0.30) & np.isin(points[:, 0], (0.61, 0.79))
    return points[~omitted] if name == "ur10e" else points


def campaigns(seed, effects):
    rng = np.random.default_rng(seed)
    return [
        simulate(
            name, rng, effect=effect, repeat_sd=REPEAT_SD[name], repeats=REPEATS[name], points=papers_grid(name)
        ).dataset
        for name, effect in zip(PRINTED, effects, strict=True)
    ]


def literal_reading(datasets):
    """The paper's two stages, every fit anew by numpy: p values, terms left after each step, and changes."""
    rows = []
    for dataset in datasets:
        used = ~dataset.censored
        columns = [
            dataset.distance[used] ** t.distance * dataset.height[used] ** t.height * dataset.speed[used] ** t.speed
            for t in FULL_CUBIC.terms
        ]
        rows.append((np.column_stack(columns), dataset.peak_force[used]))

    def quality(kept):
        rmse, r_squared = [], []
        for design, force in rows:
            coefficients = np.linalg.lstsq(design[:, kept], np.log(force))[0]
            log_force = design[:, kept] @ coefficients
            rmse.append(np.sqrt(np.mean((np.exp(log_force) - force) ** 2)))
            r_squared.append(
                1 - np.sum((log_force - np.log(force)) ** 2) / np.sum((np.log(force) - np.log(force).mean()) ** 2)
            )
        return np.array(rmse), np.array(r_squared)

    p_values = []
    for design, force in rows:
        coefficients, squares, *_ = np.linalg.lstsq(design, np.log(force))
        freedom = len(force) - design.shape[1]
        covariance = np.linalg.pinv(design.T @ design, rcond=1e-14) * squares[0] / freedom
        p_values.append(2 * stats.t.sf(np.abs(coefficients / np.sqrt(np.diag(covariance))), freedom))
    p_values = np.array(p_values)
    kept = [j for j in range(20) if j == 0 or (p_values[:, j] <= 0.05).any()]
    sets, changes = [kept], []
    while len(kept) > 1:
        now = quality(kept)
        trial = {}
        for j in kept[1:]:
            rmse, r_squared = quality([k for k in kept if k != j])
            trial[j] = np.sum(rmse - now[0] + 100 * (now[1] - r_squared))
        least = min(trial, key=trial.get)
        changes.append(trial[least])
        if trial[least] > 0.5:
            break
        kept = [k for k in kept if k != least]
        sets.append(kept)
    return p_values, sets, changes, quality


def test_with_repeat_noise_alone_the_papers_eight_terms_come_out(full_size):
    seeds = 1000 if full_size else 40
    found = [select_terms(campaigns(seed, NO_EFFECT)) for seed in range(seeds)]
    papers = [not each.only_here and not each.only_in_paper for each in found]
    assert sum(papers) >= 0.95 * seeds
    assert all(set(each.form.terms) == set(CFM_3D.terms) for each, right in zip(found, papers, strict=True) if right)
    assert PAPER_COUNTS == (19, 13, 8)
    assert {(each.counts[0], each.counts[2]) for each, right in zip(found, papers, strict=True) if right} == {(19, 8)}


@pytest.mark.parametrize("effects", [NO_EFFECT, STATE_EFFECTS])
def test_the_trace_is_that_of_a_literal_reading(effects):
    for seed in range(3):
        datasets = campaigns(100 + seed, effects)
        selection = select_terms(datasets)
        p_values, sets, changes, quality = literal_reading(datasets)
        terms = FULL_CUBIC.terms
        assert [each.term for each in selection.stage_one] == list(terms[1:])
        np.testing.assert_allclose([each.p_values for each in selection.stage_one], p_values[:, 1:].T, atol=1e-6)
        assert [each.term for each in selection.stage_one if not each.removed] == [terms[j] for j in sets[0][1:]]
        last = [selection.refused] if selection.refused else []
        stage_two = [*selection.steps[2:], *last]
        np.testing.assert_allclose([step.change for step in stage_two], changes, atol=1e-7)
        for step, kept in zip(selection.steps[1:], sets, strict=True):
            rmse, r_squared = quality(kept)
            np.testing.assert_allclose(step.rmse, rmse, rtol=1e-7)
            np.testing.assert_allclose(step.r_squared, r_squared, rtol=1e-9)
            assert step.terms == len(kept) - 1
        rmse, r_squared = quality(list(range(20)))
        np.testing.assert_allclose(selection.steps[0].rmse, rmse, rtol=1e-7)
        stage_one_change = np.sum(quality(sets[0])[0] - rmse + 100 * (r_squared - quality(sets[0])[1]))
        assert selection.steps[1].change == pytest.approx(stage_one_change, abs=1e-7)
        assert list(selection.form.terms) == [terms[j] for j in sets[-1]]


def test_a_selection_is_stable_with_repeat_noise_alone_and_not_with_state_effects(full_size):
    seeds = range(40 if full_size else 3)
    alone = [selection_stability(campaigns(seed, NO_EFFECT), resamples=40) for seed in seeds]
    assert sum(each.stable for each in alone) >= 0.75 * len(seeds)
    real = [selection_stability(campaigns(seed, STATE_EFFECTS), resamples=40) for seed in seeds]
    assert all(each.same_terms < 0.4 < STABLE_SHARE for each in real)
    for each in (*alone, *real):
        assert each.stable == sentence(each.reason).startswith("stable: ")
        assert each.stable != sentence(each.reason).startswith("not stable: ")


def test_how_often_terms_survive_is_reproducible_and_counts_every_term():
    datasets = campaigns(1, STATE_EFFECTS)
    first = selection_stability(datasets, resamples=20, seed=5)
    assert first == selection_stability(datasets, resamples=20, seed=5)
    assert first.survival != selection_stability(datasets, resamples=20, seed=6).survival
    assert [each.term for each in first.survival] == list(FULL_CUBIC.terms[1:])
    assert {each.term for each in first.survival if each.selected} == set(first.selection.terms)
    assert all(0 <= each.share <= 1 for each in first.survival)
    assert first.undetermined == 0


def test_the_order_of_impacts_does_not_matter():
    datasets = campaigns(2, STATE_EFFECTS)
    shuffled = []
    for dataset in datasets:
        order = np.random.default_rng(0).permutation(len(dataset))
        arrays = {
            name: getattr(dataset, name)[order]
            for name in ("distance", "height", "speed", "peak_force", "state", "censored")
        }
        shuffled.append(ImpactDataset.from_arrays(**arrays))
    assert select_terms(shuffled).form == select_terms(datasets).form


def test_the_outcome_is_a_form_that_a_person_may_pass_on():
    datasets = campaigns(0, NO_EFFECT)
    form = select_terms(datasets).form
    assert form.name == "SELECTED"
    place = (0.7, 0.3, 0.3)
    assert fit(datasets[0], form=form).predict(*place) == pytest.approx(fit(datasets[0]).predict(*place), rel=1e-9)


def test_it_ends_at_the_intercept_and_can_start_anywhere():
    datasets = campaigns(0, NO_EFFECT)
    nothing = select_terms(datasets, threshold=1e9)
    assert nothing.terms == ()
    assert nothing.refused is None
    assert nothing.only_in_paper == CFM_3D.terms[1:]
    assert select_terms(datasets, start=CFM_3D).form.terms == CFM_3D.terms
    assert select_terms([simulate("ur10e", np.random.default_rng(0), effect=0.0).dataset], start=CFM_2D).counts[0] == 3


def test_censored_impacts_are_counted_and_not_used():
    datasets = campaigns(0, NO_EFFECT)
    censored = sum(int(dataset.censored.sum()) for dataset in datasets)
    assert censored > 0
    selection = select_terms(datasets)
    assert f"{censored} censored impacts not used" in sentences(selection.statements)
    assert select_terms([each.select(~each.censored) for each in datasets]).steps == selection.steps


def test_training_states_alone_are_refused():
    rng = np.random.default_rng(0)
    dataset = simulate("kuka-iiwa7-10nm", rng, effect=0.02, points=training_grid("kuka-iiwa7-10nm")).dataset
    with pytest.raises(RankDeficient, match=r"starts from FULL_CUBIC.*rank 17.*training states alone are too few"):
        select_terms([dataset])
    with pytest.raises(TooFewStates, match="found 12 measured states"):
        select_terms([dataset.select(np.isin(dataset.state, np.unique(dataset.state)[:12]))])
    with pytest.raises(FitError, match="no uncensored impact"):
        select_terms([simulate("ur10e", rng, effect=0.0, device_range=10.0).dataset])


def test_what_cannot_be_selected_from_is_refused():
    (dataset, *_) = datasets = campaigns(0, NO_EFFECT)
    flat = ImpactDataset.from_arrays(
        distance=dataset.distance, height=dataset.height, speed=dataset.speed, peak_force=np.full(len(dataset), 100.0)
    )
    with pytest.raises(FitError, match="the same force"):
        select_terms([flat])
    for wrong in ([], dataset):
        with pytest.raises(InputError, match="list of at least one dataset"):
            select_terms(wrong)
    with pytest.raises(InputError, match="no intercept"):
        select_terms(datasets, start=Form.of("X", ["d", "v"]))
    for significance in (0.0, 1.0, float("nan")):
        with pytest.raises(InputError, match="significance"):
            select_terms(datasets, significance=significance)
    for threshold in (-1.0, float("inf"), float("nan")):
        with pytest.raises(InputError, match="threshold"):
            select_terms(datasets, threshold=threshold)
    with pytest.raises(InputError, match="at least 20"):
        selection_stability(datasets, resamples=5)
