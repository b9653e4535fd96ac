"""Pressure and clamping force beside the peak force: one mechanism, and the lowest speed of all of them counts."""

from dataclasses import replace

import numpy as np
import pytest
from oracle import DEVICE, full_grid, printed_force

import forcemap as fm
from forcemap.campaigns.point_list import AtPoint
from forcemap.campaigns.quantity import Quantity
from forcemap.campaigns.state import CONFIRMING
from forcemap.findings import FindingKind, in_words
from forcemap.maps.carry_over import transfer_map
from forcemap.maps.map_file import map_text
from forcemap.planning.confirm import Confirmed
from forcemap.planning.runs import runs_of
from forcemap.recordings.film import Film
from forcemap.speeds.basis import against_bound, doubts_of_fit
from sizes import FULL_SIZE

FORCE, PRESSURE = Quantity.FORCE, Quantity.PRESSURE
NAME = "ur10e"
FILM = Film(sensor="film A", range=600.0, error=0.10, mean_over=1.0)
HAND = fm.force_limit("back_of_hand")  # 140 N and 190 N/cm^2, transient twice that
GRID = full_grid(NAME)
SPREAD = np.concatenate([GRID[:, :2], np.interp(GRID[:, 2:], (0.2, 0.4), (0.05, 0.4))], axis=1)  # 125 states
STEP = 5e-4  # [m/s] of the brute force


def true_pressure(d, h, v):
    """A pressure [N/cm^2] of another shape than the force: it governs far out, the force near the base."""
    return 210 * np.exp(2.6 * (v - 0.2) - 2.2 * (d - 0.7) + 0.5 * (h - 0.3) + 1.0 * v * h)


def table(rng, *, points=SPREAD, measured=slice(None), effect=0.02, film=FILM, range_=500.0, clamping=None, **columns):
    """Impacts with forces, pressures at the `measured` states, and clamping forces if a share of the peak is given."""
    n, repeats = len(points), 3
    state = np.repeat(np.arange(n), repeats)
    force = printed_force(NAME, *points.T) * np.exp(rng.normal(0, effect, n))
    pressure = np.full(n, np.nan)
    pressure[measured] = (true_pressure(*points.T) * np.exp(rng.normal(0, effect, n)))[measured]
    measured_force = force[state] + rng.normal(0, 1.1, state.size)
    measured_pressure = pressure[state] * np.exp(rng.normal(0, 0.01, state.size))
    censored, above_film = measured_force >= range_, measured_pressure >= film.range
    given = {"peak_pressure": np.where(above_film, film.range, measured_pressure), "pressure_censored": above_film}
    if clamping is not None:
        held = clamping(*points.T) * np.exp(rng.normal(0, effect, n))
        columns |= {"phase2_force": held[state], "scenario": ["constrained_with_clamping"] * state.size}
    device = replace(DEVICE, range=range_)
    return fm.ImpactDataset.from_arrays(
        distance=points[state, 0],
        height=points[state, 1],
        speed=points[state, 2],
        peak_force=np.where(censored, range_, measured_force),
        censored=censored,
        state=[f"s{i}" for i in state],
        conditions=fm.Conditions(device=device, film=film),
        **given | columns,
    )


@pytest.fixture(scope="module")
def both():
    """A map with pressures at the nearer and the faster states, so that its range is another than the force's."""
    measured = (SPREAD[:, 0] < 0.85) & (SPREAD[:, 2] > 0.06)
    return fm.fit_force_map(table(np.random.default_rng(5), measured=measured))


CASE = {"limit": HAND, "contact": fm.Contact.TRANSIENT, "bound": fm.ToleranceBound()}


def brute_speeds(force_map, level, d, h):
    """Outcome and speed of one quantity at places, by looking at every 0.5 mm/s: nothing of the search is used."""
    low, high = force_map.measured_range.speeds(d, h)
    inside, speed = ~np.isnan(low), np.full(d.size, np.nan)
    grid = np.arange(0.0, 1.0, STEP)
    upper = fm.ToleranceBound().upper(force_map, d[inside, None], h[inside, None], grid[None, :])
    counted = (grid >= low[inside, None]) & (grid <= high[inside, None])
    ends = [fm.ToleranceBound().upper(force_map, d[inside], h[inside], end[inside]) for end in (low, high)]
    exceeds = counted & (upper > level)
    first = np.where(exceeds.any(axis=1), grid[exceeds.argmax(axis=1)], np.inf)
    found = np.where(np.isinf(first) & (ends[1] <= level), high[inside], np.where(np.isinf(first), high[inside], first))
    speed[inside] = np.where(ends[0] > level, np.nan, found)
    return low, high, speed


def test_lowest_of_both_quantities_by_brute_force_on_ten_thousand_places(both):
    rng = np.random.default_rng(6)
    d, h = rng.uniform(0.50, 0.90, 10_000), rng.uniform(0.12, 0.48, 10_000)
    answer = fm.safe_speed(both, d, h, **CASE)
    pressure = both.other(Quantity.PRESSURE)
    force_low, force_high, by_force = brute_speeds(both, 280.0, d, h)
    film_low, film_high, by_film = brute_speeds(pressure, 380.0 / 1.1, d, h)
    outside = np.isnan(force_low) | np.isnan(film_low)
    lowest = np.fmin(by_force, by_film)
    open_ = ~outside & (np.isnan(by_force) | np.isnan(by_film) | (lowest < np.fmax(force_low, film_low)))
    edge = np.abs(lowest - np.fmax(force_low, film_low)) <= 2 * STEP  # the brute force cannot tell there
    assert np.array_equal(answer.outcome == "outside", outside)
    assert np.array_equal((answer.outcome == "unconfirmed")[~edge], open_[~edge])
    known = ~outside & ~open_ & ~edge
    assert known.sum() > 2000
    assert outside.sum() > 500
    assert open_.sum() > 100
    assert np.all(answer.speed[known] <= lowest[known] + 1e-9)
    assert np.all(answer.speed[known] >= lowest[known] - 2 * STEP)
    told = known & (np.abs(by_force - by_film) > 2 * STEP)
    governing = np.where(by_force < by_film, Quantity.FORCE, Quantity.PRESSURE)
    assert np.array_equal(answer.governed_by[told].astype(str), governing[told].astype(str))
    assert min(np.sum(governing[told] == each) for each in ("force", "pressure")) > 300
    np.testing.assert_allclose(answer.bound_force[known], fm.ToleranceBound().upper(both, d, h, answer.speed)[known])
    np.testing.assert_array_equal(answer.lowest_measured_speed[~outside], np.fmax(force_low, film_low)[~outside])
    np.testing.assert_array_equal(answer.highest_measured_speed[~outside], np.fmin(force_high, film_high)[~outside])


def test_a_scalar_place_says_which_quantity_governs_and_what_it_rests_on(both):
    d, h = (axis.ravel() for axis in np.meshgrid(np.linspace(0.54, 0.78, 9), np.linspace(0.16, 0.44, 9)))
    grid = fm.safe_speed(both, d, h, **CASE)
    each_governs = (np.flatnonzero((grid.governed_by == each) & np.isfinite(grid.speed)) for each in (FORCE, PRESSURE))
    by_force, by_film = (fm.safe_speed(both, d[places[0]], h[places[0]], **CASE) for places in each_governs)
    assert (by_film.governed_by, by_force.governed_by) == (Quantity.PRESSURE, Quantity.FORCE)
    alone = by_film.of_quantities
    assert by_film.speed == alone[Quantity.PRESSURE].speed < alone[Quantity.FORCE].speed
    said = [fm.sentence(finding) for finding in by_film.basis.statements]
    assert "pressure not assessed" not in said
    (pressure,) = [words for words in said if words.startswith("pressure: ")]
    assert "380 N/cm^2" in pressure
    assert "largest mean over 1 cm^2" in pressure
    assert "film A" in pressure
    assert f"{len(both.other(Quantity.PRESSURE).fit.states)} states" in pressure
    assert "peak pressure governs" in fm.sentence(by_film.reason)


def test_zones_lie_below_every_place_in_them(both):
    rng = np.random.default_rng(7)
    near, low = rng.uniform(0.52, 0.78, 60), rng.uniform(0.14, 0.4, 60)
    zones = fm.zone_speeds(both, fm.Zones(near, near + 0.05, low, low + 0.05), **CASE)
    d, h = (rng.uniform(start[:, None], start[:, None] + 0.05, (60, 200)) for start in (near, low))
    places = fm.safe_speed(both, d, h, **CASE)
    given = ~np.isnan(zones.speed)
    assert {"force", "pressure"} <= {str(each) for each in zones.governed_by[given]}
    assert given.sum() > 20
    assert not np.isnan(places.speed[given]).any()
    assert np.all(zones.speed[given] <= places.speed[given].min(axis=1))
    assert np.all(zones.speed[given] > 0.97 * places.speed[given].min(axis=1) - 0.002)


def test_without_pressures_everything_is_as_it_was():
    rng = np.random.default_rng(8)
    none = table(rng, measured=slice(0, 0))
    force_map = fm.fit_force_map(none)
    assert not force_map.others
    assert force_map.unmapped is None
    answer = fm.safe_speed(force_map, 0.7, 0.3, **CASE)
    assert answer.governed_by is None
    assert "pressure not assessed" in [fm.sentence(finding) for finding in answer.basis.statements]
    assert "quantit" not in map_text(force_map)
    assert "pressure" not in map_text(replace(force_map, conditions=fm.Conditions()))


def test_too_few_pressures_refuse_every_speed_of_a_body_area():
    few = fm.fit_force_map(table(np.random.default_rng(9), measured=[0, 3, 10]))
    answer = fm.safe_speed(few, [0.7, 0.8], 0.3, **CASE)
    assert list(answer.outcome) == ["unconfirmed"] * 2
    assert "bear no map" in fm.sentence(answer.reason[0])
    assert "peak_pressure_N_per_cm2" in fm.sentence(answer.reason[0])
    in_newtons = fm.safe_speed(few, 0.7, 0.3, limit=280.0, bound=CASE["bound"], contact=fm.Contact.TRANSIENT)
    assert in_newtons.outcome == "admissible"  # newtons name no pressure, as it says
    assert "pressure not assessed" in [fm.sentence(finding) for finding in in_newtons.basis.statements]
    ten = fm.fit_force_map(table(np.random.default_rng(9), measured=np.arange(0, 125, 12)))  # a map, but no bound
    refused = fm.safe_speed(ten, 0.7, 0.3, **CASE)
    assert refused.outcome == "unconfirmed"
    assert fm.sentence(refused.reason).startswith("peak pressure: found ")


@pytest.mark.parametrize("factor", [0.01, 100.0])
def test_pressures_in_another_unit_refuse_every_speed(factor):
    data = table(np.random.default_rng(16), film=Film(range=1e5))
    mistaken = replace(data, peak_pressure=factor * data.peak_pressure)
    answer = fm.safe_speed(fm.fit_force_map(mistaken), 0.7, 0.3, **CASE)
    assert answer.outcome == "unconfirmed"
    assert "are they in another unit?" in fm.sentence(answer.reason)


def test_a_limit_above_the_range_of_the_film_is_refused():
    low = fm.fit_force_map(table(np.random.default_rng(10), film=replace(FILM, range=400.0)))
    with pytest.raises(fm.InputError, match=r"380 N/cm\^2, expected at most 363.6 N/cm\^2, the range of the film"):
        fm.safe_speed(low, 0.7, 0.3, **CASE)
    half = CASE | {"contact": fm.Contact.QUASI_STATIC}
    assert fm.safe_speed(low, 0.7, 0.3, **half).outcome in ("admissible", "unconfirmed")
    unknown = fm.fit_force_map(table(np.random.default_rng(10), film=replace(FILM, range=np.nan)))
    assert np.isnan(unknown.other(Quantity.PRESSURE).device_range)


def test_saturated_cells_count_as_at_least_that_much():
    data = table(np.random.default_rng(11), film=replace(FILM, range=420.0))
    assert data.pressure_censored.sum() > 10
    force_map = fm.fit_force_map(data)
    pressure = force_map.other(Quantity.PRESSURE)
    assert pressure.fit.censored_fit
    assert pressure.fit.censored_samples == data.pressure_censored.sum()
    assert pressure.device_range == 420.0
    states = data.of(Quantity.PRESSURE).states
    all_above = states.select((states.impacts == 0) & (states.speed < 0.41))
    answer = fm.safe_speed(force_map, all_above.distance, all_above.height, **CASE)
    assert not np.any(answer.speed >= all_above.speed)


def test_a_map_of_the_pressure_alone_permits_nothing(both):
    for alone in (
        both.other(Quantity.PRESSURE),
        fm.fit_force_map(table(np.random.default_rng(5)).of(Quantity.PRESSURE)),
    ):
        with pytest.raises(fm.InputError, match="a map of the peak pressure alone, which permits nothing"):
            fm.safe_speed(alone, 0.7, 0.3, **CASE)


def test_impacts_without_a_pressure_are_counted(both):
    data = table(np.random.default_rng(12), measured=slice(0, 100))
    pressures = data.of(Quantity.PRESSURE)
    assert (len(pressures), pressures.without, pressures.quantity) == (300, 75, Quantity.PRESSURE)
    np.testing.assert_array_equal(pressures.peak_force, data.peak_pressure[:300])
    assert fm.fit_force_map(data).other(Quantity.PRESSURE).without == 75
    with pytest.raises(fm.InputError, match="a dataset of the peak pressure"):
        pressures.of(Quantity.CLAMPING_FORCE)


def test_the_map_of_pressures_is_that_of_the_same_figures_as_forces():
    data = table(np.random.default_rng(13))
    arrays = {name: getattr(data, name) for name in ("distance", "height", "speed", "state")}
    arrays |= {"peak_force": data.peak_pressure, "censored": data.pressure_censored}
    as_force = fm.ImpactDataset.from_arrays(**arrays)
    ours = fm.fit_force_map(data).other(Quantity.PRESSURE)
    theirs = fm.fit_force_map(as_force)
    np.testing.assert_allclose(ours.coefficients, theirs.coefficients, rtol=1e-9)
    place = (0.7, 0.3, 0.25)
    error_free = fm.ToleranceBound(device_error=0.0)
    assert fm.ToleranceBound().upper(ours, *place) == pytest.approx(error_free.upper(theirs, *place), rel=1e-9)


def test_a_map_file_carries_all_quantities_and_units(both, tmp_path):
    fm.write_map(both, tmp_path / "map.json")
    again = fm.read_map(tmp_path / "map.json")
    assert map_text(again) == map_text(both)
    assert '"peak_pressure_N_per_cm2": [' in map_text(both)
    d = np.linspace(0.53, 0.85, 40)
    np.testing.assert_array_equal(fm.safe_speed(again, d, 0.3, **CASE).speed, fm.safe_speed(both, d, 0.3, **CASE).speed)
    few = fm.fit_force_map(table(np.random.default_rng(9), measured=[0, 3, 10]))
    fm.write_map(few, tmp_path / "few.json")
    assert fm.safe_speed(fm.read_map(tmp_path / "few.json"), 0.7, 0.3, **CASE).outcome == "unconfirmed"


@pytest.mark.parametrize("figure", ["peak_pressure_N_per_cm2", "coefficients"])
def test_a_map_file_whose_pressures_were_changed_is_refused(both, tmp_path, figure):
    import json

    from forcemap.files import sha256

    content = json.loads(map_text(both))
    content.pop("content_sha256")
    other = content["other_quantities"][0]
    values = other["measured_states"][figure] if figure in other["measured_states"] else other[figure]
    values[0] *= 0.9
    text = json.dumps(content, indent=1) + "\n"
    changed = json.dumps(content | {"content_sha256": sha256(text)}, indent=1) + "\n"
    (tmp_path / "map.json").write_text(changed)
    with pytest.raises(fm.ForcemapError, match=r"measured states|belong together"):
        fm.read_map(tmp_path / "map.json")


def test_a_map_that_is_carried_over_gives_no_speed_where_pressures_were_measured(both):
    rng = np.random.default_rng(14)
    points = np.column_stack([rng.uniform(0.54, 0.86, 12), rng.uniform(0.16, 0.44, 12), rng.uniform(0.1, 0.35, 12)])
    carried = transfer_map(both, table(rng, points=points, measured=slice(0, 0)))
    answer = fm.safe_speed(carried, points[:, 0], points[:, 1], **CASE)
    assert not np.isfinite(answer.speed).any()
    assert "carried over for the force alone" in " ".join(fm.sentence(why) for why in answer.basis.refusals)


def test_a_held_force_takes_the_quasi_static_limit_of_pressure():
    """Where a Phase II force goes on, the pressure that goes on is not known: a film keeps the largest of all."""
    data = table(np.random.default_rng(15))
    scenario = ["constrained_without_clamping"] * len(data)
    columns = {name: getattr(data, name) for name in ("distance", "height", "peak_force", "state", "peak_pressure")}
    for held, level in ((2.0, 380.0), (60.0, 190.0)):
        again = fm.ImpactDataset.from_arrays(
            **columns, speed=data.speed, censored=data.censored, conditions=data.conditions,
            pressure_censored=data.pressure_censored, phase2_force=np.full(len(data), held), scenario=scenario,
        )  # fmt: skip
        answer = fm.safe_speed(fm.fit_force_map(again), 0.8, 0.3, **CASE)
        assert answer.of_quantities[Quantity.PRESSURE].limit == level


# -- the clamping force


def above_peaks(d, h, v):
    """A held force [N] that hardly depends on the speed, above the peaks of slow impacts: the robot goes on pushing."""
    return 128.0 * np.exp(0.8 * (v - 0.2) + 0.3 * (h - 0.3) + 0 * d)


WITHOUT_PRESSURE = {"measured": slice(0, 0)}
HELD = {"limit": HAND, "contact": fm.Contact.QUASI_STATIC, "bound": fm.ToleranceBound()}


@pytest.fixture(scope="module")
def clamping():
    return table(np.random.default_rng(20), clamping=above_peaks, **WITHOUT_PRESSURE)


def test_a_clamping_force_above_the_peaks_gets_a_quasi_static_answer_where_it_was_mapped(clamping):
    assert clamping.phase_two.above_peak > 10
    force_map = fm.fit_force_map(clamping)
    held = force_map.other(Quantity.CLAMPING_FORCE)
    rng = np.random.default_rng(21)
    d, h = rng.uniform(0.50, 0.90, 2000), rng.uniform(0.12, 0.48, 2000)
    answer = fm.safe_speed(force_map, d, h, **HELD)
    *_, by_peak = brute_speeds(force_map, 140.0, d, h)
    low, _, by_held = brute_speeds(held, 140.0, d, h)
    lowest = np.where(np.isnan(by_peak) | np.isnan(by_held), np.nan, np.fmin(by_peak, by_held))
    assert np.array_equal(np.isnan(answer.speed), np.isnan(lowest))
    assert np.isfinite(lowest).sum() > 500
    known = np.isfinite(lowest)
    assert np.all(answer.speed[known] <= lowest[known] + 1e-9)
    assert np.all(answer.speed[known] >= lowest[known] - 2 * STEP)
    without = replace(force_map, others=())
    refused = fm.safe_speed(without, d[known][0], h[known][0], **HELD)
    assert refused.outcome == "unconfirmed"
    assert "exceed the Phase I peaks" in fm.sentence(refused.reason)
    assert not np.isnan(low[known]).any()


def test_no_clamping_robot_gets_the_transient_limit(clamping):
    force_map = fm.fit_force_map(clamping)
    for limit in (HAND, fm.NewtonLimit(280.0, quasi_static=140.0, spring_N_per_m=75e3)):
        answer = fm.safe_speed(force_map, 0.7, 0.3, **CASE | {"limit": limit})
        assert answer.outcome == "unconfirmed"
        assert "clamp" in fm.sentence(answer.reason)
    in_newtons = fm.safe_speed(force_map, 0.8, 0.3, **HELD | {"limit": 140.0})
    assert in_newtons.speed == fm.safe_speed(force_map, 0.8, 0.3, **HELD).speed


def test_a_high_held_force_governs():
    high = table(np.random.default_rng(22), clamping=lambda *state: 1.2 * above_peaks(*state), **WITHOUT_PRESSURE)
    answer = fm.safe_speed(fm.fit_force_map(high), np.linspace(0.55, 0.87, 30), 0.3, **HELD)
    assert Quantity.CLAMPING_FORCE in set(answer.governed_by)
    far = answer.governed_by == Quantity.CLAMPING_FORCE
    held = answer.of_quantities[Quantity.CLAMPING_FORCE].outcome
    assert set(held[far]) <= {"unconfirmed", "admissible", "capped"}


@pytest.mark.parametrize("case", ["few", "unused"])
def test_a_clamping_force_that_is_not_mapped_leaves_it_as_it_is(clamping, case):
    if case == "few":
        columns = {name: getattr(clamping, name) for name in ("distance", "height", "peak_force", "state", "scenario")}
        some = np.where(clamping.distance > 0.88, clamping.phase2_force, np.nan)  # of one distance: no map
        data = fm.ImpactDataset.from_arrays(
            **columns,
            speed=clamping.speed,
            censored=clamping.censored,
            phase2_force=some,
            conditions=clamping.conditions,
        )
    else:  # a recording that is not in the table clamps above its peak, too
        data = replace(clamping, phase_two=replace(clamping.phase_two, above_peak=clamping.phase_two.above_peak + 1))
    force_map = fm.fit_force_map(data)
    assert not force_map.others
    answer = fm.safe_speed(force_map, 0.8, 0.3, **HELD)
    assert answer.outcome == "unconfirmed"
    assert "exceed the Phase I peaks" in fm.sentence(answer.reason)


def test_a_few_clamping_forces_below_the_limit_refuse_nothing(clamping):
    columns = {name: getattr(clamping, name) for name in ("distance", "height", "peak_force", "state", "scenario")}
    chosen = np.isin(clamping.state, [f"s{i}" for i in range(0, 125, 12)])  # a map of them, but no bound
    data = fm.ImpactDataset.from_arrays(
        **columns,
        speed=clamping.speed,
        censored=clamping.censored,
        phase2_force=np.where(chosen, clamping.phase2_force, np.nan),
        conditions=clamping.conditions,
    )
    force_map = fm.fit_force_map(data)
    assert data.phase_two.above_peak
    assert force_map.other(Quantity.CLAMPING_FORCE)
    case = HELD | {"limit": 1.05 * (data.phase_two.largest_force + 3.0)}
    answer, alone = (fm.safe_speed(each, 0.8, 0.3, **case) for each in (force_map, replace(force_map, others=())))
    assert (answer.outcome, answer.speed) == ("admissible", alone.speed)
    refused = fm.safe_speed(force_map, 0.8, 0.3, **HELD | {"limit": data.phase_two.largest_force - 5.0})
    assert refused.outcome == "unconfirmed"
    assert fm.sentence(refused.reason).startswith("clamping force: ")


@pytest.mark.parametrize(("fall", "bent", "doubted"), [(0.0, 0.0, False), (3.0, 0.0, True), (0.0, 8.0, True)])
def test_a_held_force_is_doubted_where_it_falls_with_speed_by_more_than_its_scatter(fall, bent, doubted):
    """Terms of speed fitted to a held force, which hardly depends on speed, fall somewhere; also between its ends."""
    course = {"clamping": lambda d, h, v: 128 * np.exp(-fall * v + bent * (v - 0.3) ** 2) + 0 * d}
    data = table(np.random.default_rng(24), **course, **WITHOUT_PRESSURE)
    held = fm.fit_force_map(data).other(Quantity.CLAMPING_FORCE)
    assert not held.rises_with_speed
    said = [fm.sentence(each) for each in doubts_of_fit(held) if each.kind is fm.FindingKind.FALLS_WITH_SPEED]
    assert bool(said) == doubted
    assert not any("--forms" in line for line in said)  # it compares forms of the peak force


def test_noise_around_nothing_is_no_clamping_force():
    data = table(np.random.default_rng(23), clamping=lambda d, h, v: 0.3 + 0 * d, **WITHOUT_PRESSURE)
    assert data.of(Quantity.CLAMPING_FORCE).without == len(data)
    assert not fm.fit_force_map(data).others


# -- the bound's promise

_CAMPAIGNS = 400 if FULL_SIZE else 40
_FINE = np.stack(np.meshgrid(np.linspace(0.53, 0.88, 8), np.linspace(0.15, 0.45, 7), np.linspace(0.06, 0.39, 7)), -1)
_STATES = _FINE.reshape(-1, 3)
_PLAN = SPREAD[np.random.default_rng(0).permutation(125)[:45]]


def covered(quantity, truth, rng):
    """Share of campaigns whose bound covers 95 % of true states, effects included; binomial scatter of it."""
    good = 0
    for _ in range(_CAMPAIGNS):
        data = table(rng, points=_PLAN, clamping=above_peaks)
        other = fm.fit_force_map(data).other(quantity)
        upper = fm.ToleranceBound(device_error=0.0).upper(other, *_STATES.T)
        margin = (np.log(upper) - np.log(truth(*_STATES.T))) / 0.02
        from scipy.special import ndtr

        good += np.mean(ndtr(margin)) >= 0.95
    return good / _CAMPAIGNS, np.sqrt(0.95 * 0.05 / _CAMPAIGNS)


@pytest.mark.parametrize(
    ("quantity", "truth"), [(Quantity.PRESSURE, true_pressure), (Quantity.CLAMPING_FORCE, above_peaks)]
)
def test_the_bound_of_other_quantities_keeps_its_promise(quantity, truth):
    share, scatter = covered(quantity, truth, np.random.default_rng(31))
    print(f"\n{quantity.words}: {share:.3f} of {_CAMPAIGNS} campaigns")
    assert share >= 0.95 - 3 * scatter


# -- what takes speeds from a map


def test_a_confirmation_asks_for_the_pressure_of_its_impacts(both):
    plan = fm.confirm_plan(both, HAND, bound=fm.ToleranceBound(), contact=fm.Contact.TRANSIENT)
    assert "MEASURE THE PRESSURE OF THESE IMPACTS, TOO" in fm.sentence(plan.warnings[0])
    runs = plan.plan
    released = fm.safe_speed(both, runs.distance, runs.height, **CASE)
    np.testing.assert_allclose(released.speed, plan.released, atol=1e-3)
    again = fm.confirm_plan(both, HAND, bound=fm.ToleranceBound(), contact=fm.Contact.TRANSIENT, planned=runs)
    assert not len(again.added)


def test_what_is_measured_next_is_said_to_be_planned_by_the_force():
    points = SPREAD[::4]
    with_film, without = (
        table(np.random.default_rng(8), points=points),
        table(np.random.default_rng(8), points=points, peak_pressure=None, pressure_censored=None),
    )
    for data, words in ((with_film, 1), (without, 0)):
        found = fm.next_measurements(data, HAND, contact=fm.Contact.TRANSIENT, bound=fm.ToleranceBound())
        said = [fm.sentence(each) for each in found.warnings]
        assert sum("PLANNED BY THE FORCE ALONE" in each for each in said) == words
        assert not words or "the peak pressure" in said[0]


def test_a_robots_table_takes_the_lowest_of_both(both):
    down = replace(both, conditions=replace(both.conditions, direction="down"))
    exported = fm.robot_table(down, limits=[(HAND, fm.Contact.TRANSIENT)], bound=fm.ToleranceBound(), size=0.05)
    with_speed = exported.speed_mmps > 0
    middles = np.meshgrid(
        *((edges[:-1] + edges[1:]) / 2 for edges in (exported.distance_edges, exported.height_edges)), indexing="ij"
    )
    places = fm.safe_speed(down, *middles, **CASE)
    assert with_speed.sum() > 5
    assert np.all(exported.speed_mmps[with_speed] <= 1000 * places.speed[with_speed])
    assert Quantity.PRESSURE in set(places.governed_by[with_speed])
    assert any("pressure: 380 N/cm^2" in fm.sentence(note) for note in exported.provenance.bases[0].statements)


# -- what measurements say against the map of another quantity


def with_test_states(dataset, runs, force, **columns):
    """The impacts of a table, and those of confirming runs with role test."""
    count, nothing = len(runs), np.full(len(runs), np.nan)
    given = {"peak_pressure": nothing, "phase2_force": nothing} | columns
    added = {
        "distance": runs.distance,
        "height": runs.height,
        "speed": runs.speed,
        "peak_force": force,
        "role": ["test"] * count,
        "state": runs.state_id,
        "recording": runs.recording,
    } | given
    names = ("distance", "height", "speed", "peak_force", "peak_pressure", "phase2_force", "role", "state", "recording")
    held = {name: np.concatenate([getattr(dataset, name), np.asarray(added[name])]) for name in names}
    more = {}
    for name in ("censored", "pressure_censored"):
        more[name] = np.concatenate([getattr(dataset, name), np.full(count, False)])
    more["scenario"] = [*dataset.scenario, *([dataset.scenario[0]] * count)]
    return fm.ImpactDataset.from_arrays(**held, **more, conditions=dataset.conditions)


def confirmed(case, quantity, share):
    """A campaign whose confirming impacts have 0.9 of the force's bound and a share of that of another quantity."""
    dataset = table(np.random.default_rng(5)) if quantity is PRESSURE else clamping_table()
    force_map = fm.fit_force_map(dataset)
    first = fm.confirm_plan(force_map, case["limit"], bound=case["bound"], contact=case["contact"])
    at = first.plan.distance, first.plan.height, first.plan.speed
    below = 0.9 * np.asarray(case["bound"].upper(force_map, *at))
    other = share * np.asarray(case["bound"].upper(force_map.other(quantity), *at))
    pressure = other if quantity is PRESSURE else np.full(len(below), np.nan)
    columns = {"peak_pressure": pressure, "phase2_force": other if quantity is not PRESSURE else np.zeros(len(below))}
    whole = with_test_states(dataset, first.plan, below, **columns)
    plan = {"planned": first.plan, "recorded": first.plan.state_id.tolist()}
    refitted = fm.fit_force_map(whole)
    asked = {"bound": case["bound"], "contact": case["contact"]}
    checked = {str(name): (True, in_words("within")) for name in first.plan.recording}
    judged = fm.confirm_plan(refitted, case["limit"], **asked, **plan).judged(whole, checked)
    return refitted, judged.result


def clamping_table():
    return table(np.random.default_rng(20), clamping=above_peaks, **WITHOUT_PRESSURE)


@pytest.mark.parametrize(("quantity", "case"), [(PRESSURE, CASE), (Quantity.CLAMPING_FORCE, HELD)])
@pytest.mark.parametrize(("share", "passes"), [(0.9, True), (1.05, False), (1.6, False)])
def test_impacts_that_are_to_confirm_a_map_are_held_against_every_quantity_that_the_limit_names(
    quantity, case, share, passes
):
    """Whatever their force: above the bound of the pressure, or of the clamping force, they contradict the map."""
    force_map, result = confirmed(case, quantity, share)
    assert (result.outcome is Confirmed.PASSES) is passes
    assert all(impact.above_bound is not passes for impact in result.impacts)
    answer = fm.safe_speed(force_map, 0.7, 0.3, **case)
    refused = [each for each in answer.basis.refusals if each.kind is FindingKind.OF_QUANTITY]
    assert bool(refused) is not passes
    assert np.isnan(answer.speed) is not passes or answer.outcome == "unconfirmed"
    if passes:
        assert f"in {quantity.words}, too" in fm.sentence(result.reason)
        return
    assert answer.outcome == "unconfirmed"
    assert all(fm.sentence(each).startswith(f"{quantity.words}: ") for each in refused)
    assert [each.kind for each in against_bound(force_map, case["bound"])] == [FindingKind.OF_QUANTITY] * len(refused)
    exceeding = [impact.reason for impact in result.impacts]
    assert all(f"{quantity.words}: " in fm.sentence(each) for each in exceeding)


@pytest.mark.parametrize(("quantity", "case"), [(PRESSURE, CASE), (Quantity.CLAMPING_FORCE, HELD)])
@pytest.mark.parametrize(("share", "refuses"), [(0.8, False), (1.6, True)])
def test_what_a_contact_point_shows_of_another_quantity_speaks_against_its_map(
    quantity, case, share, refuses, tmp_path
):
    dataset = table(np.random.default_rng(5)) if quantity is PRESSURE else clamping_table()
    dataset = replace(dataset, conditions=replace(dataset.conditions, direction="down"))
    force_map = fm.fit_force_map(dataset)
    place = 0.7, 0.3, 0.15
    shown = share * float(case["bound"].upper(force_map.other(quantity), *place))
    figures = {"pressure": shown} if quantity is PRESSURE else {"phase2": shown}
    made = {"distance": (0.7, 0.7), "height": (0.3, 0.3), "speed": 0.15, "force": 60.0, "peak": 60.0, "phase2": 0.0}
    point = AtPoint("points/P1-1.csv", "down", scenario=None, **made | figures)
    refitted = fm.fit_force_map(replace(dataset, at_points=(point,)))
    fm.write_map(refitted, tmp_path / "map.json")
    for each in (refitted, fm.read_map(tmp_path / "map.json")):
        answer = fm.safe_speed(each, 0.7, 0.3, **case)
        said = [fm.sentence(why) for why in (*answer.basis.refusals, *answer.basis.warnings)]
        told = [line for line in said if "points/P1-1.csv" in line]
        assert bool(told) is refuses
        assert all(line.startswith(f"{quantity.words}: ") for line in told if quantity is PRESSURE)
        assert all(f"{shown:.1f} {quantity.unit}" in line for line in told)
        assert (answer.outcome == "unconfirmed") is refuses
        assert bool(answer.basis.export_refusal) is refuses


@pytest.mark.parametrize("pressed", ["as before", "risen", "not measured"])
def test_a_map_holds_for_new_impacts_only_with_its_other_quantities(pressed):
    """The forces are as before; the pressures are, or have risen by 40 %, or nobody measured them."""
    force_map = fm.fit_force_map(table(np.random.default_rng(5)))
    new = table(np.random.default_rng(6), points=SPREAD[::3] + np.array([0.01, 0.01, 0.004]))
    factor = {"as before": 1.0, "risen": 1.4, "not measured": np.nan}[pressed]
    new = replace(new, peak_pressure=factor * new.peak_pressure)
    found = fm.check_map(force_map, new)
    assert found.outcome == {"as before": "holds", "risen": "does_not_hold", "not measured": "cannot_tell"}[pressed]
    assert any(fm.sentence(each).startswith("peak pressure: ") for each in found.statements)
    assert fm.sentence(found.reason).startswith("peak pressure: ") is (pressed != "as before")
    assert fm.check_map(replace(force_map, others=()), new).outcome == "holds"


def test_what_speaks_against_the_pressure_is_to_be_measured_next_and_nobody_may_stop():
    """At the states whose films failed, whatever the force leaves to gain elsewhere."""
    force_map, result = confirmed(CASE, PRESSURE, 1.6)
    failed = {impact.state for impact in result.impacts}
    test = force_map.fit.test
    whole = with_test_states(
        table(np.random.default_rng(5)),
        runs_of(test.coordinates, 1, np.full(len(test), np.nan), role="test", prefix=CONFIRMING),
        test.force,
        peak_pressure=force_map.other(PRESSURE).fit.test.force,
    )
    found = fm.next_measurements(whole, HAND, contact=fm.Contact.TRANSIENT, bound=fm.ToleranceBound(), batch=10)
    assert found.needs_more
    said = [fm.sentence(each) for each in found.warnings]
    assert any(
        line.startswith("peak pressure: IMPACTS THAT WERE TO CONFIRM THE MAP LIE ABOVE ITS BOUND") for line in said
    )
    planned = np.unique(np.column_stack([found.plan.distance, found.plan.height, found.plan.speed]), axis=0)
    assert len(planned) == len(failed)
    np.testing.assert_allclose(np.sort(planned, axis=0), np.sort(test.coordinates, axis=0), atol=2e-3)
