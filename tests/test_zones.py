"""One speed for a zone or segment, against fine sampling: never above, and close where the zone is small."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from oracle import full_grid, simulate, training_grid

import forcemap as fm
from forcemap.maps.bounds import tolerance_nodes
from forcemap.maps.forms import FORMS
from forcemap.maps.measured_range import MeasuredRange
from forcemap.speeds.enclosures import Patches
from forcemap.speeds.tolerance_steps import ToleranceSteps
from forcemap.speeds.zones import Segments
from forcemap.words import sentence

QUASI_STATIC = fm.Contact.QUASI_STATIC

OUTSIDE, UNCONFIRMED = fm.SpeedOutcome.OUTSIDE, fm.SpeedOutcome.UNCONFIRMED
ADMISSIBLE, CAPPED = fm.SpeedOutcome.ADMISSIBLE, fm.SpeedOutcome.CAPPED


@pytest.fixture(scope="module")
def maps():
    """Maps of every form, on a full grid, on scattered states, and the paper's."""
    rng = np.random.default_rng(30)
    scattered = rng.uniform([0.45, 0.05, 0.08], [0.95, 0.55, 0.5], (70, 3))
    found = [(fm.published_map(name), fm.FixedMargin(0.10)) for name in fm.PUBLISHED_MAPS]
    for form in FORMS:
        for points in (full_grid("ur10e"), scattered):
            dataset = simulate(
                "ur10e", rng, effect=0.02, points=points, train=np.ones(len(points), bool), device_range=900.0
            ).dataset
            found.append((fm.fit_force_map(dataset, form=form), fm.ToleranceBound()))
    return found


def random_segments(rng, n):
    """5 to 30 cm long, any direction; a third of them tangential: their middle is nearest to the axis."""
    angle, distance, height = rng.uniform(-np.pi, np.pi, n), rng.uniform(0.5, 0.9, n), rng.uniform(0.1, 0.5, n)
    middle = np.stack([distance * np.cos(angle), distance * np.sin(angle), height], axis=1)
    direction = rng.normal(size=(n, 3))
    tangent = np.stack([-np.sin(angle), np.cos(angle), np.zeros(n)], axis=1)
    direction = np.where(rng.random((n, 1)) < 1 / 3, tangent, direction)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    half = 0.5 * rng.uniform(0.05, 0.3, (n, 1)) * direction
    return Segments(middle - half, middle + half)


def on_segments(segments, count):
    shares = np.linspace(0, 1, count)[:, None]
    for start, end in zip(segments.start, segments.end, strict=True):
        points = start + (end - start) * shares
        yield np.hypot(points[:, 0], points[:, 1]), points[:, 2]


def in_zones(zones, count):
    for d1, d2, h1, h2 in zip(zones.distance_from, zones.distance_to, zones.height_from, zones.height_to, strict=True):
        yield tuple(x.ravel() for x in np.meshgrid(np.linspace(d1, d2, count), np.linspace(h1, h2, count)))


def against_sampling(force_map, bound, zones, samples, limit, close=math.inf):
    """Outcomes; refusal where a sample is refused, never above the slowest sample, and as close as asked."""
    found = fm.zone_speeds(force_map, zones, limit=limit, contact=QUASI_STATIC, bound=bound)
    samples = list(samples)
    at = fm.safe_speed(
        force_map,
        np.array([d for d, _ in samples]),
        np.array([h for _, h in samples]),
        limit=np.asarray(limit)[..., None] if np.ndim(limit) else limit,
        contact=QUASI_STATIC,
        bound=bound,
    )
    for i in range(len(zones)):
        outcomes = set(at.outcome[i].tolist())
        if OUTSIDE in outcomes:
            assert found.outcome[i] is OUTSIDE
        elif UNCONFIRMED in outcomes:
            assert found.outcome[i] in (UNCONFIRMED, OUTSIDE)
        if not found.outcome[i].has_speed:
            assert math.isnan(found.speed[i])
            continue
        slowest = at.speed[i].min()
        assert found.speed[i] <= slowest
        assert found.speed[i] >= min(slowest * (1 - close), slowest - 0.003)
        assert found.spread[i] >= 0
    return found, at


def test_random_segments_against_fine_sampling(maps, full_size):
    rng = np.random.default_rng(31)
    outcomes = []
    for force_map, bound in maps:
        n = (10_000 if full_size else 400) // len(maps) + 1
        segments = random_segments(rng, n)
        limits = rng.uniform(200, 480, n)
        samples = on_segments(segments, 201 if full_size else 61)
        outcomes += against_sampling(force_map, bound, segments, samples, limits, 0.03)[0].outcome.tolist()
    assert min(outcomes.count(each) for each in (OUTSIDE, UNCONFIRMED, ADMISSIBLE)) > 30


def test_random_zones_against_fine_sampling(maps, full_size):
    rng = np.random.default_rng(32)
    outcomes, refused_though_sampled = [], 0
    for force_map, bound in maps:
        n = (10_000 if full_size else 400) // len(maps) + 1
        d, h = rng.uniform(0.5, 0.87, n), rng.uniform(0.12, 0.44, n)
        zones = fm.Zones(d, d + rng.choice([0.0, 0.02, 0.05], n), h, h + rng.choice([0.0, 0.02, 0.05], n))
        found, at = against_sampling(
            force_map, bound, zones, in_zones(zones, 25 if full_size else 9), rng.uniform(200, 480, n), 0.03
        )
        outcomes += found.outcome.tolist()
        refused_though_sampled += int(np.sum(np.isfinite(at.speed).all(axis=1) & np.isnan(found.speed)))
    assert min(outcomes.count(each) for each in (OUTSIDE, UNCONFIRMED, ADMISSIBLE, CAPPED)) > 20
    assert refused_though_sampled < len(outcomes) / 100


def test_large_zones_are_cut_until_they_are_close(maps):
    for force_map, bound in maps:
        low, high = force_map.measured_range.lowest, force_map.measured_range.highest
        middle, extent = (low + high) / 2, (high - low) / 5
        zone = fm.Zones(middle[0], middle[0] + extent[0], middle[1], middle[1] + extent[1])
        against_sampling(force_map, bound, zone, in_zones(zone, 41), 300.0, 0.01)


def peak_map():
    """ln F has its maximum in the middle of a zone, at d = 0.7 m and h = 0.3 m; the corners know nothing of it."""
    form = fm.Form.of("PEAK", ["1", "v", "d", "d^2", "h", "h^2"])
    steep = 150.0
    coefficients = np.array([5.4 - steep * (0.7**2 + 0.3**2), 1.0, 2 * steep * 0.7, -steep, 2 * steep * 0.3, -steep])
    return replace(fm.published_map("ur10e"), form=form, coefficients=coefficients)


def test_corners_are_no_certificate():
    force_map, bound = peak_map(), fm.FixedMargin(0.0)
    zone = fm.Zones(0.65, 0.75, 0.25, 0.35)
    corners = fm.safe_speed(force_map, *zone.probes, limit=280.0, contact=QUASI_STATIC, bound=bound)
    assert (corners.speed == 0.4).all()
    middle = fm.safe_speed(force_map, 0.7, 0.3, limit=280.0, contact=QUASI_STATIC, bound=bound)
    found = fm.zone_speeds(force_map, zone, limit=280.0, contact=QUASI_STATIC, bound=bound)
    assert middle.speed - 0.003 < found.speed[0] <= middle.speed < 0.25
    assert found.spread[0] > 0.15
    refused = fm.zone_speeds(force_map, zone, limit=265.0, contact=QUASI_STATIC, bound=bound)
    assert refused.outcome[0] is UNCONFIRMED
    segment = Segments([0.6, 0.0, 0.2], [0.8, 0.0, 0.4])
    across = fm.zone_speeds(force_map, segment, limit=280.0, contact=QUASI_STATIC, bound=bound)
    assert middle.speed - 0.003 < across.speed[0] <= middle.speed


@pytest.mark.parametrize("steepness", [60.0, 200.0, 1000.0, 5000.0, 40_000.0, 1e6])
def test_a_ridge_across_a_zone_holds_its_speed_down(steepness):
    """ln F = ln(300 / 1.1) + 3 (v - 0.3) - k (d - 0.705)^2: along the ridge 0.3 m/s, however narrow it is."""
    terms = [math.log(300 / 1.1) - 0.9 - steepness * 0.705**2, 3.0, 2 * steepness * 0.705, -steepness, *[0.0] * 5]
    ridge = replace(fm.published_map("ur10e"), coefficients=np.array(terms))
    zones = fm.Zones([0.52, 0.6, 0.69, 0.6], [0.89, 0.8, 0.73, 0.65], [0.14, 0.2, 0.3, 0.2], [0.46, 0.4, 0.31, 0.4])
    found = fm.zone_speeds(ridge, zones, limit=300.0, contact=QUASI_STATIC, bound=fm.FixedMargin(0.10))
    assert not (found.speed[:3] > 0.3).any()
    assert steepness > 1000 or (found.speed[:3] > 0.3 * 0.997 - 0.0003).all()
    assert found.speed[3] > 0.3


def test_a_map_that_turns_over_opens_no_second_window():
    falling = replace(fm.published_map("ur10e"), measured_range=MeasuredRange(full_grid("ur10e") * [1, 1, 4]))
    rng = np.random.default_rng(33)
    d, h = rng.uniform(0.52, 0.84, 60), rng.uniform(0.14, 0.41, 60)
    zones = fm.Zones(d, d + 0.05, h, h + 0.05)
    against_sampling(falling, fm.FixedMargin(0.0), zones, in_zones(zones, 9), rng.uniform(380, 490, 60), 0.05)


def test_tangential_segments_are_judged_by_their_middle():
    """Along the inner edge of the measured range: both ends inside, the middle exactly on the edge, or beyond it."""
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    for shift, outcome in ((0.0, True), (-1e-4, False)):
        segment = Segments([0.52 + shift, -0.15, 0.44], [0.52 + shift, 0.15, 0.44])
        found = fm.zone_speeds(ur10e, segment, limit=280.0, contact=QUASI_STATIC, bound=bound)
        ends = fm.safe_speed(ur10e, np.hypot(0.52 + shift, 0.15), 0.44, limit=280.0, contact=QUASI_STATIC, bound=bound)
        assert ends.outcome.has_speed
        assert found.outcome[0].has_speed is outcome
        assert found.outcome[0] is OUTSIDE or found.speed[0] < ends.speed - 0.005


def test_skew_ranges_are_left_where_a_segment_bulges():
    """A range cut obliquely in (d, h): the chord of a tangential segment lies inside, the segment itself does not."""
    points = np.array([[d, h, v] for d, h in ((0.5, 0.1), (0.9, 0.5), (0.9, 0.1)) for v in (0.2, 0.4)])
    force_map = replace(fm.published_map("ur10e"), measured_range=MeasuredRange(points))
    bound = fm.FixedMargin(0.0)
    segment = Segments([0.65, -0.2, 0.23], [0.65, 0.2, 0.26])
    against_sampling(force_map, bound, segment, on_segments(segment, 2001), 400.0)
    for height in np.linspace(0.2, 0.27, 30):
        segment = Segments([0.65, -0.2, height], [0.65, 0.2, height + 0.03])
        against_sampling(force_map, bound, segment, on_segments(segment, 2001), 400.0)


def test_the_gate_and_the_head_hold_for_zones():
    zones = fm.zone_grid(fm.published_map("kuka-iiwa7-30nm").measured_range, 0.1)
    clamps = fm.zone_speeds(
        fm.published_map("kuka-iiwa7-30nm"), zones,
        limit=fm.force_limit("back_of_hand"), contact=fm.Contact.TRANSIENT, bound=fm.FixedMargin(),
    )  # fmt: skip
    assert set(clamps.outcome) == {UNCONFIRMED}
    assert "no transient limit" in sentence(clamps.reason[0])
    head = fm.zone_speeds(
        fm.published_map("ur10e"), zones,
        limit=fm.force_limit("temple"), contact=fm.Contact.QUASI_STATIC, bound=fm.FixedMargin(),
    )  # fmt: skip
    assert set(head.outcome) == {"not_permitted"}
    assert np.isnan(head.speed).all()
    assert "temple" in sentence(head.reason[0])


def censored_at(place, speed, force=500.0):
    """A calm campaign in which one impact exceeded the device range."""
    points = training_grid("kuka-iiwa7-10nm")
    d, h, v = points.T
    peak = fm.published_map("kuka-iiwa7-10nm").predict(d, h, v)
    return fm.fit_force_map(
        fm.ImpactDataset.from_arrays(
            distance=[*d, place[0]], height=[*h, place[1]], speed=[*v, speed],
            peak_force=[*np.minimum(peak, 499), force],
            role=["train"] * len(d) + ["test"], censored=[False] * len(d) + [True],
        )
    )  # fmt: skip


def test_an_impact_above_the_device_range_refuses_the_zone_it_lies_in():
    bound = fm.ToleranceBound()
    zones = fm.Zones([0.70, 0.7575, 0.70], [0.746, 0.78, 0.746], [0.35, 0.35, 0.40], [0.40, 0.39, 0.45])
    contradicted = censored_at((0.752, 0.36), 0.22)
    found = fm.zone_speeds(contradicted, zones, limit=300.0, contact=QUASI_STATIC, bound=bound)
    assert [outcome.has_speed for outcome in found.outcome] == [False, False, False]  # beside it, too: the same bound
    wide = fm.zone_speeds(
        contradicted, fm.Zones(0.70, 0.78, 0.35, 0.40), limit=300.0, contact=QUASI_STATIC, bound=bound
    )
    assert wide.outcome[0] is UNCONFIRMED
    assert "highest 500.0 N at d = 0.752 m, h = 0.36 m and 0.22 m/s, limit 300 N" in sentence(wide.reason[0])
    crossing = fm.zone_speeds(
        contradicted, Segments([0.70, 0.0, 0.36], [0.78, 0.0, 0.36]), limit=300.0, contact=QUASI_STATIC, bound=bound
    )
    assert crossing.outcome[0] is UNCONFIRMED
    faster = fm.zone_speeds(
        censored_at((0.752, 0.36), 0.4),
        fm.Zones(0.70, 0.78, 0.35, 0.40),
        limit=300.0,
        contact=QUASI_STATIC,
        bound=bound,
    )
    assert not faster.outcome[0].has_speed  # the bound itself allows no such speed there, but 500 N lie far above it
    near = float(bound.upper(censored_at((0.752, 0.36), 0.4), 0.752, 0.36, 0.4)) + 4.0
    fast = censored_at((0.752, 0.36), 0.4, near)
    permitted = near - 2.0
    assert 300.0 < permitted < 500.0
    apart = fm.zone_speeds(fast, zones, limit=[300.0, permitted, 300.0], contact=QUASI_STATIC, bound=bound)
    assert [outcome.has_speed for outcome in apart.outcome] == [True, False, True]  # of several limits each for itself


def test_a_measured_impact_beyond_the_limit_leaves_no_speed_in_any_zone():
    points = training_grid("ur10e")
    d, h, v = points.T
    peak = fm.published_map("ur10e").predict(d, h, v)
    dataset = fm.ImpactDataset.from_arrays(
        distance=[*d, 0.752], height=[*h, 0.36], speed=[*v, 0.21], peak_force=[*peak, 350.0],
        role=["train"] * len(d) + ["test"],
    )  # fmt: skip
    found = fm.zone_speeds(
        fm.fit_force_map(dataset),
        fm.Zones(0.7, 0.78, 0.35, 0.4),
        limit=300.0,
        contact=QUASI_STATIC,
        bound=fm.ToleranceBound(),
    )
    assert not found.outcome[0].has_speed
    assert "highest 350.0 N at d = 0.752 m, h = 0.36 m and 0.21 m/s, limit 300 N" in sentence(found.reason[0])


@given(st.integers(0, 2**32 - 1), st.floats(150, 480))
def test_property_a_part_is_never_slower_than_the_whole(seed, limit):
    """Nearly: each is within its own tolerance of the truth."""
    rng = np.random.default_rng(seed)
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    d, h = np.sort(rng.uniform(0.52, 0.89, 4)), np.sort(rng.uniform(0.14, 0.46, 4))
    zones = fm.Zones([d[0], d[1]], [d[3], d[2]], [h[0], h[1]], [h[3], h[2]])
    whole, part = fm.zone_speeds(ur10e, zones, limit=limit, contact=QUASI_STATIC, bound=bound).speed
    assert math.isnan(whole) or part >= whole * 0.996 - 0.0003


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: fm.Zones(0.6, 0.5, 0.2, 0.3), "ends before"),
        (lambda: fm.Zones(math.nan, 0.5, 0.2, 0.3), "finite"),
        (lambda: Segments([0.5, 0.0, 0.2], [0.5, 0.0, 0.2]), "no length"),
        (lambda: Segments([0.5, 0.0], [0.5, 0.1]), "shape"),
        (lambda: Segments([0.5, 0.0, math.inf], [0.5, 0.1, 0.2]), "finite"),
        (lambda: fm.zone_grid(fm.published_map("ur10e").measured_range, 0.0), "zone size"),
    ],
)
def test_what_is_no_zone(make, words):
    with pytest.raises(fm.InputError, match=words):
        make()


def test_limits_of_zones_are_one_or_one_each():
    zones = fm.zone_grid(fm.published_map("ur10e").measured_range, 0.1)
    one = fm.zone_speeds(fm.published_map("ur10e"), zones, limit=300.0, contact=QUASI_STATIC, bound=fm.FixedMargin())
    each = fm.zone_speeds(
        fm.published_map("ur10e"), zones, limit=np.full(len(zones), 300.0), contact=QUASI_STATIC, bound=fm.FixedMargin()
    )
    np.testing.assert_array_equal(one.speed, each.speed)
    with pytest.raises(fm.InputError, match="one limit for each"):
        fm.zone_speeds(
            fm.published_map("ur10e"), zones, limit=[300.0, 200.0], contact=QUASI_STATIC, bound=fm.FixedMargin()
        )


def test_another_bound_cannot_be_enclosed():
    class Guess(fm.FixedMargin.__mro__[1]):
        def upper(self, force_map, distance, height, speed):
            return force_map.predict(distance, height, speed)

        def require(self, force_map):
            pass

        def describe(self):
            return {}

    with pytest.raises(fm.InputError, match="enclosed"):
        fm.zone_speeds(
            fm.published_map("ur10e"), fm.Zones(0.7, 0.75, 0.3, 0.35), limit=300.0, contact=QUASI_STATIC, bound=Guess()
        )


def test_zones_tile_the_measured_range():
    range_ = fm.published_map("ur10e").measured_range
    zones = fm.zone_grid(range_, 0.05)
    assert len(zones) == 8 * 7
    assert zones.distance_to.max() == 0.89
    assert (zones.distance_to - zones.distance_from).max() <= 0.05
    area = np.sum((zones.distance_to - zones.distance_from) * (zones.height_to - zones.height_from))
    assert area == pytest.approx(0.37 * 0.32)


def test_the_spread_of_a_zone_is_what_its_size_costs():
    """However much faster its fastest corner is."""
    zones = fm.Zones.between(np.array([0.6, 0.7]), np.array([0.2, 0.3]))
    bound = fm.FixedMargin(0.10)
    found = fm.zone_speeds(fm.published_map("ur10e"), zones, limit=150.0, contact=QUASI_STATIC, bound=bound)
    for slowest, fastest in ((0.1, 0.35), (0.2, 0.25), (0.3, 0.3)):
        other = replace(found, speed=np.array([slowest]), fastest_probe=np.array([fastest]))
        np.testing.assert_allclose(other.spread, [fastest - slowest])


def test_the_corners_of_a_patch_are_those_of_its_zone():
    near, far, low, high = np.array([[0.5, 0.6], [0.55, 0.8], [0.1, 0.2], [0.3, 0.25]])
    distance, height = Patches.box(near, far, low, high).corners
    for i in range(2):
        expected = {(d, h) for d in (near[i], far[i]) for h in (low[i], high[i])}
        assert {(round(d, 9), round(h, 9)) for d, h in zip(distance[i], height[i], strict=True)} == expected


@pytest.mark.parametrize("which", [0, 1, 4])
def test_a_segment_without_length_is_named(which):
    start = np.tile([0.5, 0.0, 0.2], (5, 1))
    end = np.tile([0.5, 0.0, 0.3], (5, 1))
    end[which] = start[which] + [0.0, 0.9e-9, 0.0]
    with pytest.raises(fm.InputError, match=f"^segment {which + 1}: found no length"):
        Segments(start, end)
    end[which] = start[which] + [0.0, 1.1e-9, 0.0]
    assert len(Segments(start, end)) == 5


def test_a_segment_touches_what_it_comes_near():
    """Each of many segments against places on all their sides: dense samples within the reach, or none by far."""
    rng = np.random.default_rng(33)
    segments = random_segments(rng, 60)
    along = segments.start + (segments.end - segments.start) * np.linspace(0, 1, 301)[:, None, None]
    distance, height = np.hypot(along[..., 0], along[..., 1]), along[..., 2]
    met = missed = 0
    for _ in range(100):
        beside, on = rng.uniform(-0.04, 0.04, 2), (rng.integers(301), rng.integers(60))
        d, h, reach = distance[on] + beside[0], height[on] + beside[1], rng.uniform(0.0, 0.02)
        off = np.maximum(np.abs(distance - d), np.abs(height - h)).min(axis=0)
        found = segments.touching(d, h, reach)
        assert found[off <= reach].all()
        assert not found[off > reach + 0.001].any()
        met, missed = met + found.sum(), missed + (~found).sum()
    assert min(met, missed) >= 100


def test_a_zone_touches_what_it_comes_near():
    zones = fm.Zones(0.6, 0.7, 0.2, 0.3)
    for beside in (0.0199, 0.0201):
        touches = beside < 0.02
        for d, h in ((0.6 - beside, 0.25), (0.7 + beside, 0.25), (0.65, 0.2 - beside), (0.65, 0.3 + beside)):
            assert zones.touching(d, h, 0.02).tolist() == [touches], (d, h)
    closed, upright = fm.Zones(0.5, 0.75, 0.25, 0.5), Segments([0.5, 0.0, 0.25], [0.5, 0.0, 0.5])
    for d, h in ((0.375, 0.25), (0.5, 0.125), (0.5, 0.625), (0.625, 0.3)):  # an eighth away, to the last bit
        assert upright.touching(d, h, 0.125).tolist() == [True]
        assert not upright.touching(d, h, 0.1249).any()
    for d, h in ((0.375, 0.25), (0.5, 0.125), (0.5, 0.625), (0.875, 0.3)):
        assert closed.touching(d, h, 0.125).tolist() == [True]


@pytest.mark.parametrize("size", [0.011, 0.05, 0.0925, 0.1, 0.36, 0.37, 1.0])
def test_a_grid_has_the_fewest_equal_zones_within_the_size(size):
    range_ = fm.published_map("ur10e").measured_range
    zones = fm.zone_grid(range_, size)
    sides = [(zones.distance_from, zones.distance_to), (zones.height_from, zones.height_to)]
    for i, (start, stop) in enumerate(sides):
        extent = float(range_.highest[i] - range_.lowest[i])
        count = len(set(start.tolist()))
        assert extent / count <= size * (1 + 1e-9)
        assert count == 1 or extent / (count - 1) > size
        np.testing.assert_allclose(stop - start, extent / count)
        assert (start.min(), stop.max()) == (range_.lowest[i], range_.highest[i])
    with pytest.raises(fm.InputError, match="at most 100 000"):
        fm.zone_grid(range_, 0.00108)
    assert 99_000 < len(fm.zone_grid(range_, 0.00109)) <= 100_000


@pytest.fixture(scope="module")
def allowances(examples):
    """Of bounds over a map: nodes of sqrt(leverage), the allowance at them, its slope beyond, the error, the steps."""
    fitted = fm.fit_force_map(examples["ur10e"])
    found = []
    for confidence, content, error in ((0.95, 0.95, 3.0), (0.5, 0.99, 10.0), (0.5, 0.5, 0.0), (0.99, 0.9, 3.0)):
        bound = fm.ToleranceBound(confidence=confidence, content=content, device_error=error)
        root, factor, beyond = tolerance_nodes(bound, fitted)
        sd, error = fitted.fit.state_sd, max(error, fitted.conditions.device.error)
        found.append((root, sd * factor, sd * beyond, error, ToleranceSteps.of(bound, fitted)))
    return found


def test_what_a_bound_adds_between_leverages_is_its_largest_and_its_smallest(allowances):
    """Against a fine search over all leverages at most, and at least, as large; the device's error counts beside it."""
    rng = np.random.default_rng(34)
    fell = 0
    for root, allowance, beyond, error, steps in allowances:
        log_force, at = rng.uniform(np.log(5), np.log(600), 300), rng.uniform(0, 3, 300)
        at[:20] *= root[-1]
        fine = np.unique(np.concatenate([np.linspace(0, 3, 20_001), root, at]))
        added = np.interp(fine, root, allowance) + np.maximum(fine - root[-1], 0) * beyond
        fell += (np.diff(added) < 0).any()
        index = np.searchsorted(fine, at, "right")
        most, least = np.maximum.accumulate(added)[index - 1], np.minimum.accumulate(added[::-1])[::-1][index - 1]
        with_error = np.log(np.exp(log_force) + error)
        close = 2e-9 + np.abs(np.diff(allowance[root < 3.5])).max()  # both are straight between nodes
        for found, expected, side in (
            (steps.largest(log_force, at**2), np.maximum(log_force + most, with_error), 1),
            (steps.smallest(log_force, at**2), np.maximum(log_force + least, with_error), -1),
        ):
            over = side * (found - expected)
            assert over.min() > 0
            assert over[20:].max() < close
            assert side == -1 or over[at > root[-1]].max() < 1e-4
        np.testing.assert_allclose(steps.share(log_force), np.exp(log_force) / (np.exp(log_force) + error), rtol=1e-12)
    assert fell


def test_the_slope_of_what_a_bound_adds_lies_between_its_bounds(allowances):
    """While a leverage changes by no more than stated: its allowance, in small steps."""
    rng = np.random.default_rng(35)
    for root, allowance, beyond, _, steps in allowances:
        for _ in range(200):
            least, most = np.sort(rng.uniform(0.01, 1.5, 2) ** 2)
            falls, rises = np.sort(rng.normal(0, 2, 2))
            low, high = steps.slopes(*(np.array([x]) for x in (falls, rises, least, most)))
            leverage = np.linspace(least, most, 200)
            ends = np.sqrt(leverage)
            added = np.interp(ends, root, allowance) + np.maximum(ends - root[-1], 0) * beyond
            per_leverage = np.diff(added) / np.diff(leverage)
            for change in (falls, rises, 0.0):
                assert (per_leverage * change >= low[0] - 1e-9).all()
                assert (per_leverage * change <= high[0] + 1e-9).all()
            slope = np.diff(allowance) / np.diff(root)
            inside = slope[: np.searchsorted(root, np.sqrt(most)) + 1]
            products = [s * c / (2 * np.sqrt(least)) for s in (*inside, 0.0) for c in (falls, rises)]
            assert low[0] >= min(products) - 1e-9
            assert high[0] <= max(products) + 1e-9


def test_of_several_segments_without_length_the_first_is_named():
    start = np.array([[0.6, 0.0, 0.3], [0.7, 0.0, 0.3], [0.8, 0.0, 0.3]])
    end = start + np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    with pytest.raises(fm.InputError, match=r"^segment 2: found no length"):
        Segments(start, end)
