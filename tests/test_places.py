"""Positions of a table against paths timed one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest

import forcemap as fm
from forcemap.paths.table_positions import table_positions
from forcemap.paths.task import one_segment_task

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
