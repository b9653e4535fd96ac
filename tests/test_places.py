"""Positions of a table against paths timed one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest

import forcemap as fm
from forcemap.paths.table_positions import table_positions
from forcemap.paths.task import one_segment_task

QUASI_STATIC = fm.Contact.QUASI_STATIC
TASK = one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT, acceleration=10.0)
PRESS = fm.ToolPath.through([[0.0, 0.0, 0.06], [0.0, 0.0, 0.0]])


@pytest.fixture(scope="module")
def places():
    return fm.place_task(fm.published_map("ur10e"), PRESS, TASK, bound=fm.FixedMargin(0.10))


def test_the_best_place_is_the_fastest_of_all(places):
    d, h, duration = places.best
    assert duration == np.nanmin(places.duration)
    alone = fm.path_speeds(fm.published_map("ur10e"), PRESS.moved([d, 0, h]), TASK, bound=fm.FixedMargin(0.10))
    assert alone.allowed.duration == duration == places.best_speeds.allowed.duration
    assert (d, h) == (0.85, 0.35)  # far from the base and high, as the paper says
    near = fm.path_speeds(fm.published_map("ur10e"), PRESS.moved([0.55, 0, 0.15]), TASK, bound=fm.FixedMargin(0.10))
    assert math.isnan(near.allowed.duration)
    assert math.isnan(places.duration[places.distance == 0.55][0, places.height == 0.15][0])


def test_sensitivity_tells_what_a_shift_costs(places):
    changes = places.sensitivity
    assert len(changes) >= 3
    for _, _, change in changes:
        assert math.isnan(change) or change >= 0
    assert any(change > 0 for *_, change in changes)


def test_a_task_that_is_nowhere_permitted_has_no_best_place():
    up = fm.ToolPath.through([[0.0, 0.0, 0.0], [0.0, 0.0, 0.05]])
    places = fm.place_task(fm.published_map("ur10e"), up, TASK, bound=fm.FixedMargin(0.10), step=0.1)
    assert places.best is None
    assert places.best_speeds is None
    assert places.sensitivity == []
    assert places.most_permitted[2] == 0


def test_steps_that_make_no_positions():
    for step in (0.0, math.nan, 1e-7):
        with pytest.raises(fm.InputError, match="step"):
            fm.place_task(fm.published_map("ur10e"), PRESS, TASK, bound=fm.FixedMargin(), step=step)


def test_progress_is_told():
    seen = []
    fm.place_task(
        fm.published_map("ur10e"), PRESS, TASK, bound=fm.FixedMargin(), step=0.2,
        progress=seen.append,
    )  # fmt: skip
    distance, height = table_positions(fm.published_map("ur10e"), PRESS, 0.2)
    assert seen == list(range(1, distance.size * height.size + 1))


def multiples(low, high, step):
    """Multiples of a step [m] from low to high, one by one."""
    return [round(k * step, 12) for k in range(-2000, 2001) if low - 1e-9 * step <= k * step <= high + 1e-9 * step]


@pytest.mark.parametrize("step", [0.005, 0.01, 0.02, 0.03, 0.1, 0.13, 0.37])
def test_positions_are_the_multiples_of_the_step_at_which_the_path_meets_the_box(step):
    ur10e = fm.published_map("ur10e")
    low, high = ur10e.measured_range.lowest, ur10e.measured_range.highest
    for points in (
        [[0.0, 0.0, 0.06], [0.0, 0.0, 0.0]],
        [[-0.1, 0.2, 0.0], [0.17, 0.1, 0.25]],
        [[0.7, 0, 0], [0.6, 0, 0]],
    ):
        path = fm.ToolPath.through(points)
        x, z = path.points[:, 0], path.points[:, 2]
        distance, height = table_positions(ur10e, path, step)
        assert distance.tolist() == [d for d in multiples(low[0] - x.max(), high[0] - x.min(), step) if d >= 0]
        assert height.tolist() == multiples(low[1] - z.max(), high[1] - z.min(), step)


def test_at_most_20000_positions_are_tried():
    ur10e, accepted = fm.published_map("ur10e"), []
    for step in np.linspace(0.00262, 0.00268, 25).tolist():
        expected = len(multiples(0.52, 0.89, step)) * len(multiples(0.08, 0.46, step))
        accepted.append(expected <= 20_000)
        if accepted[-1]:
            distance, height = table_positions(ur10e, PRESS, step)
            assert distance.size * height.size == expected
        else:
            with pytest.raises(fm.InputError, match=f"which makes {expected} positions"):
                table_positions(ur10e, PRESS, step)
    assert 5 < sum(accepted) < 20
    with pytest.raises(fm.InputError, match="at most 20000 positions"):
        table_positions(ur10e, PRESS, 1e-15)
    distance, _ = table_positions(ur10e, fm.ToolPath.through([[0, 0, 0], [0, 0, 0.01]]), 1e-2 + 1e-12)
    assert (distance != np.round(distance, 11)).any()  # a step is kept to a picometre
    with pytest.raises(fm.InputError, match="which makes 0 positions"):
        table_positions(ur10e, PRESS, 5.0)


def test_every_position_is_the_path_timed_there():
    """Cycle times, share of the length with permission, the best and the most permitted position, the neighbours."""
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    path = fm.ToolPath.through([[0.0, 0.0, 0.06], [0.0, 0.0, 0.0], [0.03, 0.0, -0.02]])
    for step in (0.07, 0.12):
        for task in (TASK, one_segment_task("path", ("back_of_hand",), QUASI_STATIC)):
            places = fm.place_task(ur10e, path, task, bound=bound, step=step)
            shape = (places.distance.size, places.height.size)
            duration, standard, permitted = np.full((3, *shape), np.nan)
            outside = np.zeros(shape)
            for i, j in np.ndindex(shape):
                moved = path.moved([places.distance[i], 0.0, places.height[j]])
                alone = fm.path_speeds(ur10e, moved, task, bound=bound)
                duration[i, j], standard[i, j] = alone.allowed.duration, alone.standard.duration
                has = np.array([outcome.value in ("admissible", "capped") for outcome in alone.outcome])
                out = np.array([outcome.value == "outside" for outcome in alone.outcome])
                permitted[i, j] = alone.path.lengths[has].sum() / alone.path.lengths.sum()
                outside[i, j] = alone.path.lengths[out].sum()
            np.testing.assert_array_equal(places.duration, duration)
            np.testing.assert_array_equal(places.standard_duration, standard)
            np.testing.assert_allclose(places.permitted, permitted)
            i, j = max(np.ndindex(shape), key=lambda at: (round(permitted[at], 9), -round(outside[at], 9)))
            assert places.most_permitted == (places.distance[i], places.height[j], pytest.approx(permitted[i, j]))
            if np.isnan(duration).all():
                assert places.best is None
                continue
            i, j = min(np.ndindex(shape), key=lambda at: np.nan_to_num(duration[at], nan=np.inf))
            assert places.best == (places.distance[i], places.height[j], duration[i, j])
            around = [(i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)]
            expected = [
                (
                    places.distance[a] - places.distance[i],
                    places.height[b] - places.height[j],
                    duration[a, b] - duration[i, j],
                )
                for a, b in around if 0 <= a < shape[0] and 0 <= b < shape[1]
            ]  # fmt: skip
            np.testing.assert_array_equal(places.sensitivity, expected)
