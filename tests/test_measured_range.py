"""The measured range against linear programming: the hull's lowest and highest speed at a place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from oracle import full_grid, training_grid
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

import forcemap as fm
from forcemap.maps.convex_hull import half_spaces
from forcemap.maps.measured_range import MeasuredRange
from sizes import COSTLY


def by_linear_programming(points, d, h):
    """Lowest and highest v of convex combinations of the points at (d, h); NaN if there is none."""
    n = len(points)
    equations = np.vstack([points[:, 0], points[:, 1], np.ones(n)])
    ends = [linprog(sign * points[:, 2], A_eq=equations, b_eq=[d, h, 1], bounds=(0, None)) for sign in (1, -1)]
    return (np.nan, np.nan) if ends[0].status == 2 else (ends[0].fun, -ends[1].fun)


@settings(max_examples=COSTLY)
@given(st.integers(0, 2**32 - 1), st.integers(4, 30), st.sampled_from(["random", "grid", "jittered"]))
def test_property_speeds_agree_with_linear_programming(seed, n, kind):
    rng = np.random.default_rng(seed)
    points = {
        "random": rng.uniform([0.4, 0.1, 0.1], [0.9, 0.5, 0.5], (n, 3)),
        "grid": rng.permutation(full_grid("ur10e"))[:n],
        "jittered": training_grid("ur10e") + rng.normal(0, 0.002, (27, 3)),
    }[kind]
    measured = MeasuredRange(points)
    places = np.vstack([rng.uniform([0.4, 0.1], [0.95, 0.5], (10, 2)), rng.permutation(points)[:3, :2]])
    low, high = measured.speeds(*places.T)
    for i, (d, h) in enumerate(places):
        expected = by_linear_programming(points, d, h)
        if i < 10 and (np.isnan(expected[0]) or np.isnan(low[i])):
            # at the rim the two may disagree within their tolerances
            inwards = (points.mean(axis=0) - points) * 1e-6
            if np.isnan(low[i]):
                assert np.isnan(by_linear_programming(points + inwards, d, h)[0])
            else:
                assert not np.isnan(by_linear_programming(points - inwards, d, h)[0])
        else:
            np.testing.assert_allclose((low[i], high[i]), expected, atol=2e-7)


@settings(max_examples=COSTLY)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["few", "many", "one height", "one place"]))
def test_property_beside_the_range_the_nearest_place_of_it_counts(seed, kind):
    """By linear programming: the polygon of the places is where there is a speed, and no nearer place is in it."""
    rng = np.random.default_rng(seed)
    points = rng.uniform([0.5, 0.1, 0.1], [0.9, 0.5, 0.4], ({"many": 90, "one place": 3}.get(kind, 20), 3))
    if kind in ("one height", "one place"):
        points[:, 1] = 0.3
    if kind == "one place":
        points[:, 0] = 0.7
    measured = MeasuredRange(points)
    corner = points[rng.integers(len(points)), :2]
    place = corner + rng.normal(0, 0.03, 2)
    if np.isfinite(measured.speeds(*place[:, None])[0][0]):
        return
    shares = np.linspace(0, 1, 2001)[:, None, None]
    ends = points[np.stack(np.triu_indices(len(points)), axis=-1), :2][:400]
    lines = ends[:, 0] + shares * (ends[:, 1] - ends[:, 0])
    away = np.sqrt(np.square(lines - place).sum(axis=-1).min())
    for reach in (0.98 * away - 1e-4, 1.02 * away + 1e-4):
        low, high = measured.speeds_near(*place[:, None], reach)
        if reach > away or len(ends) < 400:
            assert np.isfinite(low[0]) == (reach > away)
        assert not low[0] > high[0]


@pytest.mark.parametrize("place", [(0.52, 0.14), (0.7, 0.3), (0.89, 0.46), (0.6, 0.2)])
def test_a_full_factorial_plan_gives_the_product_of_ranges_exactly(place):
    low, high = MeasuredRange(training_grid("ur10e")).speeds(*np.array([place]).T)
    assert (low[0], high[0]) == (0.2, 0.4)


def test_closed_with_a_small_tolerance():
    measured = MeasuredRange(training_grid("ur10e"))
    d = np.array([0.52 - 5e-10, 0.52 - 1e-6, 0.89 + 5e-10, 0.89 + 1e-6])
    low, _ = measured.speeds(d, np.full(4, 0.3))
    assert np.isnan(low).tolist() == [False, True, False, True]
    inside = measured.contains(np.full(3, 0.7), np.full(3, 0.3), np.array([0.2, 0.4, 0.4001]))
    assert inside.tolist() == [True, True, False]


def test_one_slow_and_one_fast_impact_do_not_open_their_speed_elsewhere():
    grid = training_grid("ur10e")
    points = np.vstack([grid, [[0.52, 0.14, 0.05], [0.89, 0.46, 0.9]]])
    low, high = MeasuredRange(points).speeds(np.array([0.89, 0.52, 0.7]), np.array([0.14, 0.46, 0.3]))
    assert (low[0], high[0]) == (0.2, 0.4)
    assert (low[1], high[1]) == (0.2, 0.4)
    assert 0.05 < low[2] < 0.2
    assert 0.4 < high[2] < 0.9


FLAT = {
    "one height": lambda p: p[p[:, 1] == 0.30],
    "one speed": lambda p: p[p[:, 2] == 0.30],
    "one distance": lambda p: p[p[:, 0] == 0.70],
    "one place": lambda p: p[(p[:, 0] == 0.70) & (p[:, 1] == 0.30)],
    "one state": lambda p: p[:1],
    "two states": lambda p: p[[0, -1]],
}


@pytest.mark.parametrize("kind", FLAT)
def test_flat_ranges(kind):
    points = FLAT[kind](training_grid("ur10e"))
    measured = MeasuredRange(points)
    low, high = measured.speeds(points[:, 0], points[:, 1])
    assert (low <= points[:, 2]).all()
    assert (points[:, 2] <= high).all()
    assert low.min() == points[:, 2].min()
    assert high.max() == points[:, 2].max()
    off, _ = measured.speeds(points[:, 0] + 0.4, points[:, 1] + 0.01)
    assert np.isnan(off).all()
    if kind == "one height":
        assert np.isnan(measured.speeds(np.array([0.7]), np.array([0.3001]))[0]).all()


@pytest.mark.parametrize("kind", ["scattered", "grid", "tenths", "jittered grid", "columns", "sphere"])
def test_the_hull_of_few_points_is_qhulls(kind):
    """Both say the same of points inside, outside and on it, within the tolerance of the range."""
    rng, by_qhull = np.random.default_rng(len(kind)), 0
    grid = np.stack(np.meshgrid([0.4, 0.7, 1.0], [0.0, 0.3, 0.6], [0.1, 0.3, 0.5]), axis=-1).reshape(-1, 3)
    for _ in range(40):
        points = {
            "scattered": rng.uniform(0, 1, (30, 3)),
            "grid": grid[rng.permutation(27)[: rng.integers(12, 28)]],
            "tenths": np.round(rng.uniform(0, 1, (50, 3)), 1),
            "jittered grid": grid + rng.normal(0, 10 ** rng.uniform(-9, -3), grid.shape),
            "columns": np.column_stack([np.repeat(rng.uniform(0, 1, (9, 2)), 3, axis=0), np.tile([0.2, 0.3, 0.4], 9)]),
            "sphere": (lambda x: x / np.linalg.norm(x, axis=1)[:, None])(rng.normal(0, 1, (60, 3))),
        }[kind]
        expected = ConvexHull(points).equations
        by_qhull += np.array_equal(half_spaces(points), expected)
        asked = np.vstack([rng.uniform(-0.2, 1.2, (300, 3)), points, points[::-1] * 0.5 + points * 0.5])
        apart = [(asked @ planes[:, :3].T + planes[:, 3]).max(axis=1) for planes in (half_spaces(points), expected)]
        inside = np.minimum(*apart) < 0
        np.testing.assert_allclose(apart[0][inside], apart[1][inside], atol=1e-9)
        np.testing.assert_array_equal(apart[0] < 1e-9, apart[1] < 1e-9)
        assert inside.any()
    assert by_qhull <= (6 if kind == "jittered grid" else 0)  # the others prove themselves, and need not load it


@pytest.mark.parametrize(("count", "by_qhull"), [(4, False), (5, False), (150, False), (151, True)])
def test_more_than_150_points_are_left_to_qhull(count, by_qhull):
    points = np.random.default_rng(count).normal(0, 1, (count, 3))
    found, expected = half_spaces(points), ConvexHull(points).equations
    assert np.array_equal(found, expected) == by_qhull
    np.testing.assert_allclose(np.sort(found, axis=0), np.sort(expected, axis=0), atol=1e-9)


def test_a_hull_that_does_not_prove_itself_is_left_to_qhull():
    """Points in a plane, all but for rounding, and more points than are added one by one."""
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.uniform(0, 1, (20, 2)), rng.uniform(0, 1e-8, 20)])
    many = rng.uniform(0, 1, (400, 3))
    for points in (flat, many):
        np.testing.assert_array_equal(half_spaces(points), ConvexHull(points).equations)


@pytest.mark.parametrize(("up", "down"), [(0.1, 0.1), (0.1, 0.0), (0.1, 0.02), (-0.02, 0.1)])
@pytest.mark.parametrize("beyond", [-4e-10, 0.0, 4e-10, 9e-10])
def test_where_only_the_tolerance_lets_a_place_in_its_speeds_are_in_order_and_in_the_hull(up, down, beyond):
    """Beside the edge of a needle 1 mm long, the lowest speed of its planes lies above the highest."""
    needle = [[0.9, 0.3], [0.899, 0.3 + up], [0.899, 0.3 - down]]
    points = np.array([[d, h, v] for d, v in needle for h in (0.1, 0.3, 0.5)])
    measured = MeasuredRange(points)
    place = np.array([0.9 + beyond]), np.array([0.3])
    low, high = measured.speeds(*place)
    assert low <= high
    for speed in (low, high):
        apart = measured.facets @ [*np.concatenate(place), speed[0], 1.0]
        assert apart.max() < 1.01e-9
        assert abs(speed[0] - 0.3) < (1e-12 if up == down and beyond >= 0 else 3e-7)
        assert measured.contains(*place, speed)


def test_two_states_measure_the_line_between_them_alone():
    one, other = np.array([0.5, 0.1, 0.2]), np.array([0.8, 0.4, 0.5])
    measured = MeasuredRange(np.array([one, other]))
    for share in (0.0, 0.25, 0.5, 1.0):
        d, h, v = one + share * (other - one)
        low, high = measured.speeds(np.array([d, d, d + 1e-3]), np.array([h, h + 1e-3, h]))
        assert (low[0], high[0]) == pytest.approx((v, v), abs=1e-8)
        assert np.isnan([*low[1:], *high[1:]]).all()
        for off in (-1e-3, 1e-3):
            assert not measured.contains(*(np.array([each]) for each in (d, h, v + off)))


@pytest.mark.parametrize("speeds", [[0.2], [0.2, 0.3], [0.1, 0.2, 0.3], [0.1, 0.2, 0.3, 0.4, 0.7]])
def test_at_a_corner_of_the_range_the_measured_speeds_are_given_back_to_the_last_bit(speeds):
    """Each of four places has its own lowest and highest speed, whichever of all the measured ones they are."""
    corners = [(0.1 + 0.2, 0.1), (0.1 + 0.2, 0.7), (0.9, 0.1), (0.9, 0.7)]
    rng = np.random.default_rng(len(speeds))
    for _ in range(20):
        ends = np.sort(rng.choice(speeds, (4, 2)), axis=1)
        points = np.array([[*corner, speed] for corner, pair in zip(corners, ends, strict=True) for speed in pair])
        low, high = MeasuredRange(points).speeds(*np.array(corners).T)
        np.testing.assert_array_equal(np.column_stack([low, high]), ends)


@pytest.mark.parametrize("spread", [1e-10, 3e-10, 1e-8, 5e-7, 1e-5])
def test_no_point_lies_outside_the_hull_however_close_others_lie(spread):
    """Corners four times over, apart by about what a point may lie off a plane."""
    for seed in range(25):
        rng = np.random.default_rng(seed)
        points = rng.uniform(3, 4, (8, 3)).repeat(4, axis=0) + rng.normal(0, spread, (32, 3))
        planes = half_spaces(points)
        assert (planes[:, :3] @ points.T + planes[:, 3:]).max() < 1.01e-10
        np.testing.assert_allclose(np.linalg.norm(planes[:, :3], axis=1), 1.0)
        asked = rng.uniform(3, 4, (50, 3))
        apart = [(asked @ each[:, :3].T + each[:, 3]).max(axis=1) for each in (planes, ConvexHull(points).equations)]
        sure = np.abs(apart[1]) > 10 * spread + 1e-8
        np.testing.assert_array_equal(apart[0][sure] < 0, apart[1][sure] < 0)


def test_a_state_is_asked_for_by_plain_numbers_and_by_arrays_that_broadcast():
    measured = fm.published_map("ur10e").measured_range
    assert measured.contains(0.7, 0.3, 0.3)
    assert not measured.contains(0.7, 0.3, 3.0)
    inside = measured.contains([[0.7], [1.9]], [0.2, 0.3], 0.3)
    assert inside.tolist() == [[True, True], [False, False]]
