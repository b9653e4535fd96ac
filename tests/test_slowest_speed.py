"""A map that holds from a stated speed on: slower impacts are not fitted, and never passed over."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from oracle import DEVICE, full_grid, printed_force

import forcemap as fm
from forcemap.campaigns.quantity import Quantity
from forcemap.errors import CampaignFileError
from forcemap.maps.force_map import NO_STATES
from forcemap.maps.slower_impacts import slow_impacts_missing
from forcemap.recordings.film import Film

GRID = full_grid("ur10e")
HAND = fm.force_limit("back_of_hand")
CASE = {"contact": fm.Contact.TRANSIENT, "bound": fm.ToleranceBound()}
SLOWEST, SLOW = 0.19, 0.1
PLACES = np.unique(GRID[:, :2], axis=0)[[0, 6, 12, 18, 24]]
CORNERS = [0, 8, 2, 6]
PLACES_3 = np.unique(GRID[:, :2], axis=0)[[0, 2, 4, 10, 12, 14, 20, 22, 24]]


def with_scatter(at, conditions, slow_as=0.0):
    """Impacts at (d, h, v), shape (n, 3), of the printed force, of slower ones as at a speed [m/s], with scatter."""
    force = printed_force("ur10e", *at[:, :2].T, np.maximum(at[:, 2], slow_as))
    return fm.ImpactDataset.from_arrays(
        distance=at[:, 0], height=at[:, 1], speed=at[:, 2], conditions=conditions,
        peak_force=force * np.exp(np.random.default_rng(3).normal(0, 0.02, len(at))),
        state=[f"s{i}" for i in range(len(at))], phase2_force=np.full(len(at), 20.0),
    )  # fmt: skip


def impacts(ratios, slowest=SLOWEST, censored=(), role="train", pressures=False, speeds=(SLOW,)):
    """The full grid, and slow impacts at five places: their force is a ratio of the printed one at 0.2 m/s."""
    rng = np.random.default_rng(5)
    force = printed_force("ur10e", *GRID.T) * np.exp(rng.normal(0, 0.02, len(GRID)))
    slow = np.vstack([np.column_stack([PLACES, np.full(len(PLACES), speed)]) for speed in speeds])
    of_slow = np.tile(ratios, len(speeds)) * printed_force("ur10e", *slow[:, :2].T, np.full(len(slow), 0.2))
    states, force = np.vstack([GRID, slow]), np.append(force, of_slow)
    above = np.isin(np.arange(len(states)) - len(GRID), censored)
    film = {"peak_pressure": 0.9 * force} if pressures else {}
    return fm.ImpactDataset.from_arrays(
        distance=states[:, 0],
        height=states[:, 1],
        speed=states[:, 2],
        peak_force=force,
        censored=above,
        state=[f"s{i}" for i in range(len(GRID))] + [f"slow{i}" for i in range(len(slow))],
        role=["train"] * len(GRID) + [role] * len(slow),
        conditions=fm.Conditions(
            device=replace(DEVICE, range=2000.0),
            direction="down",
            slowest=slowest,
            film=Film(range=1800.0, error=0.05, mean_over=1.0),
        ),
        **film,
    )


def alone():
    """The map of the grid without any slower impact."""
    dataset = impacts(np.full(5, 0.5))
    return fm.fit_force_map(dataset.select(~dataset.slower))


def said(found):
    return [fm.sentence(finding) for finding in (*found.basis.refusals, *found.basis.warnings, *found.basis.notes)]


@pytest.mark.parametrize("role", ["train", "test"])
def test_slower_impacts_are_not_fitted_and_said_first(role, tmp_path):
    dataset = impacts([0.5, 0.6, 0.7, 0.8, 0.9], role=role)
    force_map = fm.fit_force_map(dataset)
    assert np.array_equal(force_map.coefficients, alone().coefficients)
    assert force_map.measured_range.lowest[2] == 0.2
    assert force_map.slower.name == tuple(f"slow{i}" for i in range(5))
    assert [each.on for each in fm.map_accuracy(force_map, dataset)] == [
        "leave-one-state-out",
        "leave-one-place-out",
        "all states",
    ]
    assert fm.map_accuracy(force_map, dataset)[-1].states == len(GRID)
    fm.write_map(force_map, tmp_path / "m.json")
    for each in (force_map, fm.read_map(tmp_path / "m.json")):
        found = fm.safe_speed(each, 0.7, 0.3, limit=HAND, **CASE)
        (line,) = [line for line in said(found) if "MAP HOLDS FROM" in line]
        assert "from 0.19 m/s" in line.lower()
        assert "5 slower states are not fitted. Slower motion" in line
        assert found.speed == fm.safe_speed(alone(), 0.7, 0.3, limit=HAND, **CASE).speed
    with_them = fm.fit_force_map(impacts([0.5, 0.6, 0.7, 0.8, 0.9], slowest=float("nan"), role=role))
    assert with_them.measured_range.lowest[2] == (SLOW if role == "train" else 0.2)
    assert not len(with_them.slower)


def test_what_slower_impacts_measured_above_the_map_is_asked_of_the_bound_at_every_places_lowest_speed():
    ratios = [0.9, 1.3, 0.9, 1.1, 0.9]
    force_map = fm.fit_force_map(impacts(ratios))
    slow = np.asarray(ratios) * printed_force("ur10e", *PLACES.T, np.full(5, 0.2))
    raised = float(np.max(slow / alone().predict(*PLACES.T, np.full(5, 0.2))))
    assert raised == pytest.approx(1.3, rel=0.03)
    found = fm.safe_speed(force_map, 0.7, 0.3, limit=400.0, quasi_static_limit=200.0, **CASE)
    assert found.basis.slower == pytest.approx(raised, rel=1e-12)
    force_map, bound = fm.fit_force_map(impacts(ratios)), fm.ToleranceBound()
    d, h = np.meshgrid(np.linspace(0.53, 0.88, 30), np.linspace(0.15, 0.45, 30))
    given = {"limit": 400.0, "quasi_static_limit": 200.0, **CASE}
    with_them, without = (fm.safe_speed(each, d, h, **given) for each in (force_map, alone()))
    opens = raised * bound.upper(force_map, d, h, np.full(d.shape, 0.2)) <= 400
    assert np.array_equal(~np.isnan(with_them.speed), opens)
    assert np.array_equal(with_them.speed[opens], without.speed[opens])
    assert 0.1 < opens.mean() < 0.95 * np.mean(~np.isnan(without.speed))
    zones = fm.Zones(d.ravel() - 0.005, d.ravel() + 0.005, h.ravel() - 0.005, h.ravel() + 0.005)
    of_zones = fm.zone_speeds(force_map, zones, **given).speed
    assert np.isnan(of_zones[~opens.ravel()]).all()
    corners = [
        raised * bound.upper(force_map, d + i, h + j, np.full(d.shape, 0.2))
        for i in (-0.005, 0.005)
        for j in (-0.005, 0.005)
    ]
    open_zones = (np.max(corners, axis=0) < 0.998 * 400).ravel()
    assert not np.isnan(of_zones[open_zones]).any()
    assert (of_zones[open_zones] <= with_them.speed.ravel()[open_zones] + 1e-9).all()
    (closed,) = [np.flatnonzero(~opens.ravel() & ~np.isnan(without.speed.ravel()))[:1]]
    assert "slower motion may exceed" in fm.sentence(with_them.reason.ravel()[closed[0]])
    lines = said(found)
    assert any(
        f"raised by as much everywhere ({100 * (raised - 1):.1f} %), is within the limit" in line for line in lines
    )
    assert any(f"at most {100 * raised:.0f} % of the map's force at its lowest speed, 0.200" in line for line in lines)


@given(st.lists(st.floats(0.3, 2.5), min_size=5, max_size=5), st.sampled_from([140.0, 200.0, 280.0, 400.0]))
def test_property_no_speed_where_slower_motion_measured_more_than_the_limit(ratios, limit):
    dataset = impacts(ratios)
    found = fm.safe_speed(fm.fit_force_map(dataset), *PLACES.T, limit=limit, quasi_static_limit=limit / 2, **CASE)
    exceeds = dataset.peak_force[dataset.slower] > limit
    assert np.isnan(found.speed[exceeds]).all()
    assert not (found.speed < 0.2).any()


def scattered(seed, slowest):
    """A campaign at random places and speeds, hardly two at one place: its hull begins fast at many places."""
    rng = np.random.default_rng(seed)
    d, h, v = rng.uniform(0.52, 0.89, 40), rng.uniform(0.14, 0.46, 40), rng.uniform(0.05, 0.4, 40)
    force = printed_force("ur10e", d, h, np.maximum(v, 0.15)) * np.exp(rng.normal(0, 0.03, v.size))
    force = np.where(v < slowest, force * rng.uniform(0.4, rng.choice([0.9, 1.5]), v.size), force)
    stated = fm.Conditions(device=replace(DEVICE, range=3000.0), direction="down", slowest=slowest)
    return fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force, conditions=stated)


@pytest.mark.parametrize("form", [fm.CFM_3D, fm.LOG_SPEED], ids=lambda form: form.name)
@pytest.mark.parametrize("seed", range(6))
def test_property_no_place_zone_or_piece_is_open_against_the_rule(seed, form):
    """c U(d, h, v_0) at most the limit, by the definition, whatever c is and wherever the hull begins."""
    force_map, rng = fm.fit_force_map(scattered(seed, 0.16), form=form), np.random.default_rng(seed)
    slower, bound = force_map.slower, fm.ToleranceBound()
    v_0 = force_map.measured_range.lowest[2]
    low, high = force_map.measured_range.lowest, force_map.measured_range.highest
    at = np.clip(slower.distance, low[0], high[0]), np.clip(slower.height, low[1], high[1])
    begins = np.fmin(np.nan_to_num(force_map.measured_range.speeds(*at)[0], nan=v_0), 9.0)
    least = np.minimum(force_map.predict(*at, np.full(len(slower), v_0)), force_map.predict(*at, begins))
    c = max(1.0, float(np.max(slower.highest / least)))
    d, h = rng.uniform(low[0], high[0], 400), rng.uniform(low[1], high[1], 400)
    upper = c * bound.upper(force_map, d, h, np.full(400, v_0))
    without = replace(force_map, fit=replace(force_map.fit, slower=NO_STATES))
    seen = 0
    for limit in (150.0, 220.0, 300.0, 400.0):
        given = {"limit": limit, "quasi_static_limit": limit / 2, **CASE}
        speed = fm.safe_speed(force_map, d, h, **given).speed
        assert np.isnan(speed[upper > limit * (1 + 1e-12)]).all()
        alone = fm.safe_speed(without, d, h, **given).speed
        open_ = upper <= limit * (1 - 1e-12)
        assert np.array_equal(speed[open_], alone[open_], equal_nan=True)
        seen += int(np.sum(~np.isnan(alone) & ~open_))
        zones = fm.Zones(d[:80] - 0.01, d[:80] + 0.01, h[:80] - 0.01, h[:80] + 0.01)
        whole = fm.zone_speeds(force_map, zones, **given).speed
        for i, j in ((-0.01, -0.01), (0.01, 0.01), (0.0, 0.0), (0.01, -0.01)):
            there = c * bound.upper(force_map, d[:80] + i, h[:80] + j, np.full(80, v_0))
            assert np.isnan(whole[there > limit * (1 + 1e-12)]).all()
    assert seen > 0 or c == 1.0


@pytest.mark.parametrize("slowest", [float("nan"), 0.16])
def test_a_test_impact_slower_than_a_place_begins_contradicts_speeds_there(slowest):
    """Also where the bound, continued down to the map's lowest speed, lies above it; with no slower impact or one."""
    found = 0
    for seed in range(8):
        rng, plain = np.random.default_rng(seed), scattered(seed, 0.16)
        dataset = plain.select(~plain.slower) if np.isnan(slowest) else plain
        dataset = replace(dataset, conditions=replace(dataset.conditions, slowest=slowest))
        force_map, bound = fm.fit_force_map(dataset, form=fm.LOG_SPEED), fm.ToleranceBound()
        d, h = rng.uniform(0.55, 0.85, 200), rng.uniform(0.17, 0.43, 200)
        begins, v_0 = force_map.measured_range.speeds(d, h)[0], force_map.measured_range.lowest[2]
        upper = bound.upper(force_map, d, h, np.nan_to_num(begins, nan=0.3))
        for i in np.flatnonzero(begins > v_0 + 0.05)[:3]:
            limit = 1.02 * float(upper[i])
            tested = fm.ImpactDataset.from_arrays(
                distance=np.append(dataset.distance, d[i]),
                height=np.append(dataset.height, h[i]),
                speed=np.append(dataset.stated_speed, v_0 + 0.02),
                peak_force=np.append(dataset.peak_force, 1.1 * limit),
                state=[f"s{k}" for k in range(len(dataset))] + ["t0"],
                role=["train"] * len(dataset) + ["test"],
                conditions=dataset.conditions,
            )
            with_it = fm.fit_force_map(tested, form=fm.LOG_SPEED)
            there = fm.safe_speed(with_it, d[i], h[i], limit=limit, quasi_static_limit=limit / 2, **CASE)
            assert np.isnan(there.speed)
            found += any("t0" in line for line in said(there))
    assert found > 5


def test_slower_impacts_above_the_device_range_permit_nothing():
    force_map = fm.fit_force_map(impacts([0.5, 0.5, 3.0, 0.5, 0.5], censored=[2]))
    found = fm.safe_speed(force_map, 0.7, 0.3, limit=HAND, **CASE)
    assert np.isnan(found.speed)
    assert "slow2" in said(found)[0]
    with pytest.raises(fm.NotReleasable, match="slow2"):
        fm.robot_table(force_map, limits=[(HAND, fm.Contact.TRANSIENT)], bound=fm.ToleranceBound(), size=0.1)


def test_it_holds_for_pressures_alike():
    ratios = [0.9, 1.3, 0.9, 1.1, 0.9]
    force_map = fm.fit_force_map(impacts(ratios, pressures=True))
    assert len(force_map.other(Quantity.PRESSURE).slower) == 5
    pressure, grid = (
        force_map.other(Quantity.PRESSURE),
        np.meshgrid(np.linspace(0.53, 0.88, 20), np.linspace(0.15, 0.45, 20)),
    )
    ratio = dict(zip(pressure.slower.name, pressure.slower.highest, strict=True))["slow1"]
    asked = ratio / pressure.predict(*PLACES[1], 0.2)
    found = fm.safe_speed(force_map, *grid, limit=HAND, **CASE).of_quantities[Quantity.PRESSURE]
    assert found.basis.slower == pytest.approx(float(asked), rel=1e-9)
    upper = found.basis.slower * found.basis.raised * fm.ToleranceBound().upper(pressure, *grid, np.full((20, 20), 0.2))
    assert np.array_equal(np.isnan(found.speed), upper > found.limit)


def test_a_state_counts_with_the_mean_speed_of_its_repeats():
    """As the campaign states speeds, not less their error."""
    dataset = impacts(np.full(5, 0.5), slowest=0.2)
    assert dataset.slower.sum() == 5
    wider = replace(dataset.conditions, speed_error=0.05)
    assert replace(dataset, conditions=wider).slower.sum() == 5
    force_map = fm.fit_force_map(replace(dataset, conditions=wider))
    assert len(force_map.slower) == 5
    assert force_map.measured_range.lowest[2] == pytest.approx(0.19)
    scattered = dataset.stated_speed.copy()
    scattered[:2], state = [0.195, 0.205], dataset.state.copy()
    state[:2] = "one"
    assert not replace(dataset, stated_speed=scattered, state=state).slower[:2].any()


def moved(dataset, last, **coordinates):
    """The same with other coordinates of its last impacts."""
    arrays = {name: getattr(dataset, name).copy() for name in coordinates}
    for name, array in arrays.items():
        array[-last:] = coordinates[name]
    return replace(dataset, **arrays)


@pytest.mark.parametrize(
    "beside", [{"distance": 0.892}, {"distance": 0.4}, {"height": 0.5}, {"distance": 0.9, "height": 0.47}]
)
def test_slower_impacts_beside_the_measured_places_count_as_at_the_nearest(beside):
    """A millimetre beside the hull, or far: what the robot does when it is slow is not known to differ there."""
    at_place = fm.fit_force_map(impacts([0.5, 0.5, 0.5, 0.5, 1.9]))
    raised = fm.safe_speed(at_place, 0.7, 0.3, limit=HAND, **CASE).basis.slower
    assert raised > 1.8
    found = fm.safe_speed(
        fm.fit_force_map(moved(impacts([0.5, 0.5, 0.5, 0.5, 1.9]), 1, **beside)), 0.7, 0.3, limit=HAND, **CASE
    )
    near = "distance" not in beside or beside["distance"] > 0.8
    assert found.basis.slower == pytest.approx(raised, rel=1e-9) if near else found.basis.slower > 1.2
    above = fm.fit_force_map(moved(impacts([0.5, 0.5, 0.5, 0.5, 3.0], censored=[4]), 1, **beside))
    assert "slow4" in said(fm.safe_speed(above, 0.7, 0.3, limit=HAND, **CASE))[0]


def test_slower_impacts_count_by_the_maps_lowest_speed_where_it_begins_faster():
    """At a corner that has only slow and fast states the hull begins fast: there they would hardly count."""
    dataset = impacts([0.9, 0.9, 0.9, 0.9, 1.3])
    corner = np.all(np.column_stack([dataset.distance, dataset.height]) == PLACES[4], axis=1)
    kept = dataset.select(~corner | (dataset.stated_speed > 0.39) | dataset.slower)
    force_map = fm.fit_force_map(kept)
    assert force_map.measured_range.speeds(*PLACES[4])[0] > 0.35
    assert fm.safe_speed(force_map, 0.7, 0.3, limit=HAND, **CASE).basis.slower > 1.2


def test_a_failed_confirmation_stays_one_when_the_map_is_to_hold_from_a_faster_speed():
    plain = impacts(np.full(5, 0.5))
    upper = float(fm.ToleranceBound().upper(fm.fit_force_map(plain), 0.7, 0.3, 0.26))
    failed = fm.ImpactDataset.from_arrays(
        distance=np.append(plain.distance, 0.7),
        height=np.append(plain.height, 0.3),
        speed=np.append(plain.stated_speed, 0.26),
        peak_force=np.append(plain.peak_force, 1.1 * upper),
        state=[*plain.state, "c-1"],
        role=[*plain.role, "test"],
        conditions=plain.conditions,
    )
    for slowest in (SLOWEST, 0.28):
        force_map = fm.fit_force_map(replace(failed, conditions=replace(failed.conditions, slowest=slowest)))
        lines = said(fm.safe_speed(force_map, 0.7, 0.3, limit=HAND, **CASE))
        assert any("ABOVE ITS BOUND: c-1" in line for line in lines)
    assert any("1 of them made to confirm the map" in line for line in lines)


def test_drift_is_told_by_slower_states_that_were_measured_again(tmp_path):
    dataset = impacts([0.5, 0.6, 0.7, 0.8, 0.9])
    slow = dataset.slower
    again = fm.ImpactDataset.from_arrays(
        **{
            name: np.append(getattr(dataset, name), getattr(dataset, name)[slow])
            for name in ("distance", "height", "base_angle")
        },
        speed=np.append(dataset.stated_speed, dataset.stated_speed[slow]),
        peak_force=np.append(dataset.peak_force, 1.2 * dataset.peak_force[slow]),
        state=np.append(dataset.state, dataset.state[slow]),
        repeat=np.append(np.ones(len(dataset)), np.full(slow.sum(), 2)).astype(int),
        role=np.append(dataset.role, np.full(slow.sum(), "test")),
        conditions=dataset.conditions,
    )
    assert again.drift.change == pytest.approx(0.2)
    fm.write_map(fm.fit_force_map(again), tmp_path / "m.json")
    for force_map in (fm.fit_force_map(again), fm.read_map(tmp_path / "m.json")):
        assert force_map.require_fit().drift.change == pytest.approx(0.2)
        assert any("DRIFT" in line for line in said(fm.safe_speed(force_map, 0.7, 0.3, limit=HAND, **CASE)))
        assert any("5 slower states" in line for line in said(fm.safe_speed(force_map, 0.7, 0.3, limit=HAND, **CASE)))


def test_a_map_is_not_kept_where_new_slower_impacts_lie_above_what_it_allows_for():
    force_map = fm.fit_force_map(impacts([0.5, 0.6, 0.7, 0.8, 0.9]))
    for ratio, outcome in ((0.95, fm.MapOutcome.HOLDS), (1.6, fm.MapOutcome.CANNOT_TELL)):
        new = impacts([ratio] * 5, slowest=float("nan"))
        rng = np.random.default_rng(9)
        new = replace(
            new, distance=new.distance + 0.001, peak_force=new.peak_force * np.exp(rng.normal(0, 0.01, len(new)))
        )
        check = fm.check_map(force_map, new)
        assert check.outcome is outcome
        assert any("MAP HOLDS FROM 0.19" in fm.sentence(each) for each in check.statements)
    assert "slow0" in fm.sentence(check.reason)


def test_a_slower_impact_above_a_map_is_named_with_its_own_force():
    """Not with that of another one, which is larger where the map allows for more."""
    force_map = fm.fit_force_map(impacts([0.9] * 5))
    ratios = np.array([0.9] * 5)
    strongest = int(np.argmax(printed_force("ur10e", *PLACES.T, np.full(5, 0.2))))
    weakest = int(np.argmin(printed_force("ur10e", *PLACES.T, np.full(5, 0.2))))
    ratios[weakest] = 1.3
    new = impacts(ratios, slowest=float("nan"))
    scatter = np.exp(np.random.default_rng(9).normal(0, 0.01, len(new)))
    new = replace(new, distance=new.distance + 0.001, peak_force=new.peak_force * scatter)
    figures = dict(fm.check_map(force_map, new).reason.figures)
    force = dict(zip(new.states.name, new.states.highest, strict=True))
    assert force[f"slow{weakest}"] < force[f"slow{strongest}"]
    assert figures["names"] == (f"slow{weakest}",)
    assert figures["force_N"] == pytest.approx(force[f"slow{weakest}"])
    low = fm.ToleranceBound().upper(force_map, *PLACES[[weakest]].T, force_map.measured_range.lowest[2:])
    assert figures["allowed_N"] == pytest.approx(float(low[0]), rel=0.05)


@pytest.mark.parametrize(
    ("words", "column"),
    [("slowest_mps = 0", "found 0,"), ('slowest_mps = "0.2"', "a finite number"), ("slowst_mps = 0.2", "slowest_mps")],
)
def test_an_entry_that_is_none_is_one_line(words, column, tmp_path):
    file = tmp_path / "campaign.toml"
    file.write_text(f'schema = "forcemap-campaign/1"\n[map]\n{words}\n')
    with pytest.raises(CampaignFileError, match=column):
        fm.read_conditions(file)


def test_where_all_is_slower_nothing_is_fitted_and_it_is_said_why():
    with pytest.raises(fm.FitError, match=r"map\.slowest_mps"):
        fm.fit_force_map(impacts(np.full(5, 0.5), slowest=0.9))


def test_a_map_is_carried_over_with_its_slower_impacts_or_not_at_all(tmp_path):
    """What they measure at the changed robot is not known: where they raise the bound, nothing is carried over."""
    d, h, v = (GRID + np.array([0.03, 0.03, 0.01]))[GRID[:, 0] < 0.85].T
    new = fm.ImpactDataset.from_arrays(
        distance=d,
        height=h,
        speed=v,
        peak_force=1.1 * printed_force("ur10e", d, h, v) * np.exp(np.random.default_rng(2).normal(0, 0.02, d.size)),
        conditions=replace(impacts(np.full(5, 0.5)).conditions, slowest=float("nan")),
    )
    slow = replace(new, stated_speed=np.where(np.arange(d.size) == 7, SLOW, new.stated_speed))
    carried = fm.transfer_map(fm.fit_force_map(impacts([0.5, 0.6, 0.7, 0.8, 0.9])), slow)
    assert slow.state[7] in carried.slower.name  # although the new campaign states no slowest speed
    told = fm.fit_force_map(impacts([0.5, 0.6, 0.7, 0.8, 0.9], speeds=(0.14, SLOW)))
    theirs = fm.transfer_map(told, new)  # at the changed robot nothing slow was measured
    assert (slow_impacts_missing(told), slow_impacts_missing(theirs) is not None) == (None, True)
    words = " ".join(said(fm.safe_speed(theirs, 0.7, 0.3, limit=HAND, **CASE)))
    assert "10 of them of the EARLIER robot or setting" in words
    force_map = fm.transfer_map(fm.fit_force_map(impacts([0.5, 0.6, 0.7, 0.8, 0.9])), new)
    fm.write_map(force_map, tmp_path / "m.json")
    for each in (force_map, fm.read_map(tmp_path / "m.json")):
        assert len(each.slower) == 5
        assert any("MAP HOLDS FROM 0.19" in line for line in said(fm.safe_speed(each, 0.7, 0.3, limit=HAND, **CASE)))
    again = replace(new, role=np.where(np.arange(d.size) == 7, "test", "train"))  # of the name of an old slower state
    again = replace(again, state=np.where(np.arange(d.size) == 7, "slow0", again.state))
    assert fm.transfer_map(fm.fit_force_map(impacts([0.5, 0.6, 0.7, 0.8, 0.9])), again).fit.drift is None
    with pytest.raises(fm.FitError, match="measure a new map"):
        fm.transfer_map(fm.fit_force_map(impacts([0.5, 1.3, 0.7, 0.8, 0.9])), new)


def test_maps_from_each_speed_on_stand_beside_each_other(tmp_path, ask, forcemap):
    """Against the same campaign that states each of them."""
    folder = tmp_path / "c"
    dataset = impacts([0.9, 1.3, 0.9, 1.1, 0.9])
    fm.write_dataset(dataset, tmp_path / "impacts.csv")
    folder.mkdir()
    shutil.copy(tmp_path / "impacts.csv", folder)
    stated = 'schema = "forcemap-campaign/1"\n[contact]\ndirection = "down"\n[device]\nrange_N = 2000.0\n'
    stated += "error_N = 3.0\nstiffness_N_per_m = 75000.0\n"
    (folder / "campaign.toml").write_text(stated)
    hand = ("--area", "back_of_hand", "--contact", "transient")
    code, answer = ask("evaluate", folder, "--slowest", *hand)
    rows = answer["from_speeds"]
    assert code == 0
    assert [row["slowest_mps"] for row in rows] == [SLOW, 0.2, 0.25, 0.3, 0.35][: len(rows)]
    for row in rows[:3]:
        (folder / "campaign.toml").write_text(f"{stated}[map]\nslowest_mps = {row['slowest_mps']}\n")
        fitted, speeds = ask("fit", folder)[1], ask("speed-map", folder, *hand, "--step-m", "0.05")[1]
        assert row["states"] == fitted["states"]
        assert row["bound_margin_percent"] == pytest.approx(fitted["bound_margin_percent"])
        given = [place["speed_to_program_mps"] for place in speeds["places"] if place["speed_to_program_mps"]]
        assert (row["places_with_a_speed"], row["places_looked_at"]) == (len(given), len(speeds["places"]))
        assert row["highest_to_program_mps"] == pytest.approx(max(given))
        d, h = (np.array([place[name] for place in speeds["places"]]) for name in ("distance_m", "height_m"))
        dataset, case = fm.read_dataset(folder), {"limit": HAND, "angle": 5.0, **CASE}
        tilted = fm.safe_speed(fm.fit_force_map(dataset), d, h, **case).speed_to_program
        assert row["places_with_a_speed_5_deg_off"] == np.sum(~np.isnan(tilted)) < row["places_with_a_speed"]
        assert ask("evaluate", folder, "--slowest", *hand)[1]["from_speeds"] == rows
    assert rows[1]["slower_over_map"] > 1.25 > rows[0]["slower_over_map"] == 0
    (folder / "campaign.toml").write_text(f"{stated}[map]\nslowest_mps = {rows[1]['slowest_mps']}\n")
    assert ask("speed-map", folder, *hand)[1]["warnings"] == rows[1]["warnings"] != []
    with_places = " ".join(forcemap("evaluate", folder, "--slowest", *hand)[1].split())
    assert "NO PERMISSION" in with_places
    bounded = [row["warnings"] for row in rows if row["bound_margin_percent"]]
    shared = [line for line in bounded[0] if all(line in said for said in bounded)]
    assert shared
    assert all(line in with_places for line in shared)
    for row in rows:  # those that the answer names say their own doubts
        own = [line for line in row["warnings"] if line not in shared]
        named = f"from {row['slowest_mps']:.3f} m/s" in with_places.split("NO PERMISSION")[0]
        assert not named or all(line in with_places for line in own)
    text = forcemap("evaluate", folder, "--slowest")[1]
    assert text.startswith("Narrowest bound: from ")
    assert "m/s to program" not in text
    assert ask("evaluate", folder, "--slowest", "--area", "back_of_hand")[0] == 2
    assert ask("evaluate", folder, "--area", "back_of_hand")[0] == 2
    assert ask("evaluate", folder, "--slowest", "--forms")[0] == 2


def test_next_plans_nothing_slower():
    """Than the map is to hold from, once slow impacts tell of slower motion without a gap."""
    kept, ratios = np.arange(len(GRID) + 10) % 3 != 1, [0.5, 0.6, 0.7, 0.8, 0.9]
    kept[len(GRID) :] = True
    dataset = impacts(ratios, speeds=(0.14, SLOW)).select(kept)
    options = {"limit": HAND, "contact": fm.Contact.TRANSIENT, "largest_force": 900.0}
    gap = impacts(ratios).select(kept[:-5])
    found = fm.next_measurements(gap.bound_by(impacts(np.full(5, 0.5)).binding), **options)
    assert set(found.plan.speed) == {0.14}
    for speeds in ((), (0.05, 0.4)):
        found = fm.next_measurements(dataset.bound_by(gap.binding), speeds=speeds, **options)
        assert any("map.slowest_mps" in fm.sentence(each) for each in found.within)
        assert found.plan is None or (found.plan.speed >= SLOWEST).all()
    for speeds, slowest in (((), 0.5), ((0.05, 0.15), SLOWEST), ((0.1, SLOWEST), SLOWEST)):  # not faster than asked for
        stated = replace(dataset.conditions, slowest=slowest)
        with pytest.raises(fm.InputError, match=r"above map\.slowest_mps"):
            fm.next_measurements(stated, speeds=speeds, **options)


@pytest.mark.parametrize("error", [0.0, 0.03])
@pytest.mark.parametrize(("ratios", "more"), [([0.9, 1.3, 0.9, 1.1, 0.9], True), ([0.5, 1.3, 0.6, 0.5, 0.6], False)])
def test_next_says_at_how_many_places_the_map_of_all_states_has_a_speed_if_these_are_more(ratios, more, error):
    """Slower impacts that lie above the map close places that the map fitted to them may permit."""
    dataset = impacts(ratios)
    dataset = replace(dataset, conditions=replace(dataset.conditions, speed_error=error))
    case = {"limit": fm.NewtonLimit(260.0, quasi_static=130.0), "contact": fm.Contact.TRANSIENT, "largest_force": 900.0}
    found = fm.next_measurements(dataset, **case)
    every = fm.next_measurements(replace(dataset, conditions=replace(dataset.conditions, slowest=np.nan)), **case)
    assert (every.confirmed > found.confirmed, every.of_all) == (more, None)
    assert found.of_all == (every.confirmed if more else None)
    assert (f"without map.slowest_mps, {every.confirmed}" in fm.sentence(found.progress)) == more
    (told,) = (line for line in said(fm.safe_speed(fm.fit_force_map(dataset), 0.7, 0.3, limit=HAND, **CASE))
               if line.startswith("THE MAP HOLDS FROM 0.19 m/s"))  # fmt: skip
    at = "0.194 m/s (" if error else "0.200 m/s ("
    assert (at in told, "both speeds less the stated error" in told) == (True, error > 0)


def test_commands_say_which_states_are_slower(example_folders, tmp_path, ask):
    folder = shutil.copytree(example_folders["ur10e"], tmp_path / "c")
    before = ask("fit", folder)[1]
    with (folder / "campaign.toml").open("a") as file:
        file.write("\n[map]\nslowest_mps = 0.25\n")
    code, answer = ask("fit", folder, "-o", tmp_path / "m.json")
    assert code == 0
    assert answer["states"] < before["states"]
    slower = [each for each in answer["measured_states"] if each["role"] == "slower"]
    assert slower
    assert all(each["speed_mps"] < 0.25 for each in slower)
    assert min(e["speed_mps"] for e in answer["measured_states"] if e["role"] == "train") >= 0.25
    assert any("MAP HOLDS FROM 0.25" in doubt for doubt in answer["doubts"])
    for command in (["evaluate", folder], ["compare", folder, "--area", "back_of_hand"]):
        assert ask(*command)[0] == 0


@pytest.mark.parametrize(
    ("lowest", "beside", "missing"),
    [
        (0.2, 0, True),
        (0.11, 0, True),
        (0.105, 0, False),
        (0.1, 0, False),
        (0.2, 5, True),  # test states widen no bound
    ],
)
def test_a_map_that_nothing_slow_was_measured_for_says_so_first(lowest, beside, missing):
    """Every motion passes through slower speeds than the map's; until then it is one of many assumptions."""
    plan = fm.plan_measurements((0.52, 0.89), (0.14, 0.46), (lowest, 0.4), repeats=1, again=0)
    at = np.column_stack([plan.distance, plan.height, plan.speed])
    slow = np.column_stack([PLACES[:beside], np.full(beside, SLOW)])
    d, h, v = np.vstack([at, slow]).T
    force = printed_force("ur10e", d, h, v) * np.exp(np.random.default_rng(3).normal(0, 0.02, d.size))
    dataset = fm.ImpactDataset.from_arrays(
        distance=d, height=h, speed=v, peak_force=force, state=[f"s{i}" for i in range(d.size)],
        role=["train"] * len(at) + ["test"] * beside, phase2_force=np.full(d.size, 20.0),
        conditions=fm.Conditions(device=replace(DEVICE, range=2000.0), direction="down"),
    )  # fmt: skip
    basis = fm.safe_speed(fm.fit_force_map(dataset), 0.8, 0.4, limit=HAND, **CASE).basis
    assert ("slow_impacts_missing" in [each.kind.value for each in basis.warnings]) is missing
    assert ("slower_unmeasured" in [each.kind.value for each in basis.notes]) is not missing
    planned = fm.next_measurements(dataset, HAND, contact=fm.Contact.TRANSIENT)
    first = planned.plan is not None and [each.kind.value for each in planned.reasons] == ["slow_planned"]
    assert first is missing
    if missing:
        assert set(planned.plan.speed.round(9)) == {round(0.7 * lowest, 2)}
        assert planned.needs_more
        at_lowest = fm.ToleranceBound().upper(
            fm.fit_force_map(dataset), planned.plan.distance, planned.plan.height, lowest
        )
        assert (planned.upper_force >= at_lowest - 1e-9).all()  # below the map its bound does not fall
        assert f"state slowest_mps = {lowest:g}" in fm.sentence(planned.reasons[0]) or lowest < 0.19
        stated = fm.next_measurements(
            replace(dataset, conditions=replace(dataset.conditions, slowest=lowest)), HAND, contact=fm.Contact.TRANSIENT
        )
        assert beside or fm.sentence(stated.reasons[0]).endswith("counts for every speed")
    if lowest == 0.2 and missing:  # once they are fitted, nothing tells which speeds the map was planned for
        corners = np.column_stack([planned.plan.distance, planned.plan.height, planned.plan.speed])
        more = printed_force("ur10e", *corners.T) * 1.05
        dataset = fm.ImpactDataset.from_arrays(
            **dict(zip(("distance", "height", "speed"), np.vstack([at, corners]).T, strict=True)),
            peak_force=np.concatenate([force[: len(at)], more]),
            state=[f"s{i}" for i in range(len(at) + len(corners))],
            phase2_force=np.full(len(at) + len(corners), 20.0), conditions=dataset.conditions,
        )  # fmt: skip
        planned = fm.next_measurements(dataset, HAND, contact=fm.Contact.TRANSIENT)
        assert set(planned.plan.speed.round(9)) == {0.1}
        assert "state the slowest of these" in fm.sentence(planned.reasons[0])


@pytest.mark.parametrize("error", [0.02, 0.05, 0.08, 0.1])
def test_slow_impacts_that_next_plans_are_those_that_it_asks_for_whatever_the_speed_error(error):
    """Speeds at contact are less than commanded: steps of 0.7 are of the same ones, and no gap stays between them."""
    conditions = fm.Conditions(device=replace(DEVICE, range=2000.0), direction="down", slowest=0.2, speed_error=error)
    plan = fm.plan_measurements((0.52, 0.89), (0.14, 0.46), (0.2, 0.4), repeats=1, again=0)
    at = np.column_stack([plan.distance, plan.height, plan.speed])
    asked = []
    for _ in range(4):
        dataset = with_scatter(at, conditions, slow_as=0.2)
        found = slow_impacts_missing(fm.fit_force_map(dataset))
        if found is None:
            break
        planned = fm.next_measurements(dataset, HAND, contact=fm.Contact.TRANSIENT)
        assert [each.kind.value for each in planned.reasons] == ["slow_planned"]
        asked.append(sorted(set(planned.plan.speed.round(9).tolist())))
        first = planned.plan.select(planned.plan.repeat == 1)
        at = np.vstack([at, np.column_stack([first.distance, first.height, first.speed])])
    assert asked == [[0.14], [0.1]]


@pytest.mark.parametrize(
    ("speeds", "said", "plans"),
    [
        ((0.1, 0.25, 0.4), "from there down to 0.100 m/s", [[0.17], [0.12]]),
        ((0.1, 0.175, 0.25, 0.325, 0.4), "from there down to 0.100 m/s", [[0.12]]),
        ((0.05, 0.1, 0.15, 0.2, 0.3), None, []),
        ((0.05, 0.225, 0.4), "from there down to 0.050 m/s", [[0.16], [0.11], [0.08]]),
    ],
)
def test_a_gap_between_fitted_slow_speeds_is_said_first_and_next_fills_it(speeds, said, plans):
    """A grid of few speeds passes over the speed at which a robot that feels slow contacts late pushes on the most."""
    at = np.column_stack([np.repeat(PLACES_3, len(speeds), axis=0), np.tile(speeds, len(PLACES_3))])
    asked, conditions = [], fm.Conditions(device=replace(DEVICE, range=2000.0), direction="down")
    for _ in range(5):
        dataset = with_scatter(at, conditions)
        found = slow_impacts_missing(fm.fit_force_map(dataset))
        if found is None:
            break
        assert asked or said in fm.sentence(found)
        planned = fm.next_measurements(dataset, HAND, contact=fm.Contact.TRANSIENT)
        assert [fm.sentence(each).endswith("counts for every speed") for each in planned.reasons] == [True]
        asked.append(sorted(set(planned.plan.speed.round(9).tolist())))
        first = planned.plan.select(planned.plan.repeat == 1)
        at = np.vstack([at, np.column_stack([first.distance, first.height, first.speed])])
    assert asked == plans


@pytest.mark.parametrize("fitted", [False, True])
@pytest.mark.parametrize(
    ("places", "speeds", "missing"),
    [
        *[(2, (0.14, 0.1), 0.2), (3, (0.14, 0.1), None), (4, (0.14,), 0.14), (4, (0.14, 0.1), None), (1, (0.05,), 0.2)],
        *[(4, (0.1,), 0.2), (4, (0.15, 0.1), None), (4, (0.18, 0.14, 0.1), None), (4, (0.16, 0.1), 0.16)],
    ],
)
def test_slower_impacts_tell_of_slower_motion_at_several_places_alone(places, speeds, missing, fitted):
    """One slow impact anywhere, or a stated slowest speed without any, tells of nothing; nor do those below a gap."""
    plan = fm.plan_measurements((0.52, 0.89), (0.14, 0.46), (0.2, 0.4), repeats=1, again=0)
    slow = [[*place, speed] for place in PLACES_3[CORNERS][:places] for speed in speeds]
    d, h, v = np.vstack([np.column_stack([plan.distance, plan.height, plan.speed]), slow]).T
    force = printed_force("ur10e", d, h, np.maximum(v, 0.2)) * np.exp(np.random.default_rng(3).normal(0, 0.02, d.size))
    dataset = fm.ImpactDataset.from_arrays(
        distance=d, height=h, speed=v, peak_force=force, state=[f"s{i}" for i in range(d.size)],
        phase2_force=np.full(d.size, 20.0),
        conditions=fm.Conditions(device=replace(DEVICE, range=2000.0), direction="down", slowest=0.2),
    )  # fmt: skip
    of_all = replace(dataset, conditions=replace(dataset.conditions, slowest=float("nan")))
    force_map = fm.fit_force_map(of_all if fitted else dataset)
    found = slow_impacts_missing(force_map)
    assert (found and found.figure("lowest_mps")) == (missing and pytest.approx(missing))
    none = fm.fit_force_map(dataset.select(~dataset.slower))
    assert slow_impacts_missing(none).figure("lowest_mps") == pytest.approx(0.2)


def test_slow_impacts_beside_the_range_or_below_a_gap_under_a_fast_map_tell_nothing():
    """The corners of another cell's range; and 0.2, 0.14, 0.1 m/s beside a map from 0.4 m/s on."""
    conditions = fm.Conditions(device=replace(DEVICE, range=2000.0), direction="down", slowest=0.2)
    plan = fm.plan_measurements((0.52, 0.70), (0.14, 0.30), (0.2, 0.4), repeats=1, again=0)
    at = np.column_stack([plan.distance, plan.height, plan.speed])
    for off, missing in ((0.0, False), (0.015, False), (0.1, True)):
        places = np.array([[0.52, 0.14], [0.52, 0.30], [0.70, 0.14], [0.70, 0.30]]) + off
        slow = [[*place, speed] for place in places for speed in (0.14, 0.1)]
        found = slow_impacts_missing(fm.fit_force_map(with_scatter(np.vstack([at, slow]), conditions, slow_as=0.2)))
        assert (found is not None) is missing, off
    corners = np.unique(at[:, :2], axis=0)[np.array([0, -1])]
    ramp = [[d, h, v] for d in corners[:, 0] for h in corners[:, 1] for v in (0.14, 0.1)]
    alone = np.vstack(
        [at + np.array([0.0, 0.0, 0.2]), [[0.6, 0.2, 0.2]], ramp]
    )  # one fitted state at 0.2 m/s, at one place
    found = slow_impacts_missing(fm.fit_force_map(with_scatter(alone, conditions, slow_as=0.2)))
    assert found.figure("lowest_mps") == pytest.approx(0.4)
    fast = at + np.array([0.0, 0.0, 0.2])
    stated = replace(conditions, slowest=0.4)
    for speeds, lowest in (((0.2, 0.14, 0.1), 0.4), ((0.28, 0.2, 0.14, 0.1), None)):
        slow = [[d, h, v] for d in corners[:, 0] for h in corners[:, 1] for v in speeds]
        found = slow_impacts_missing(fm.fit_force_map(with_scatter(np.vstack([fast, slow]), stated, slow_as=0.4)))
        assert (found and found.figure("lowest_mps")) == (lowest and pytest.approx(lowest))


@pytest.mark.parametrize(("spread", "missing"), [((0.18, 0.15), True), ((0.2, 0.1), True), ((0.2, 0.18), False)])
def test_slow_impacts_in_one_corner_of_the_range_tell_nothing_of_the_others(spread, missing):
    """A range of 0.37 m by 0.32 m: half of it has to lie between them in distance and in height."""
    plan = fm.plan_measurements((0.52, 0.89), (0.14, 0.46), (0.2, 0.4), repeats=1, again=0)
    places = np.array([0.89, 0.46]) - np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) * spread
    slow = [[*place, speed] for place in places for speed in (0.14, 0.1)]
    at = np.vstack([np.column_stack([plan.distance, plan.height, plan.speed]), slow])
    conditions = fm.Conditions(device=replace(DEVICE, range=2000.0), direction="down", slowest=0.2)
    assert (slow_impacts_missing(fm.fit_force_map(with_scatter(at, conditions, slow_as=0.2))) is not None) is missing


@pytest.mark.parametrize("slowest", [float("nan"), 0.05, SLOW])
@pytest.mark.parametrize(("times", "refused"), [(0.9, False), (1.0, False), (1.4, True)])
def test_a_slow_test_state_above_the_bound_at_the_lowest_speed_ends_every_speed(times, refused, slowest):
    """It shows that slower motion leads to more force, whatever slower speed the map is stated to hold from."""
    dataset = impacts(np.full(5, times), slowest, role="test")
    basis = fm.safe_speed(fm.fit_force_map(dataset), 0.8, 0.4, limit=fm.force_limit("thigh_muscle"), **CASE).basis
    assert ("far_above_bound" in [each.kind.value for each in basis.refusals]) is refused


@pytest.mark.parametrize(("times", "holds"), [(0.9, True), (1.4, False)])
def test_a_map_does_not_hold_beside_slow_impacts_above_its_bound_that_it_was_not_stated_to_hold_from(times, holds):
    force_map = alone()
    force_map = replace(force_map, conditions=replace(force_map.conditions, slowest=float("nan")))
    dataset = impacts(np.full(5, times), float("nan"))
    dataset = replace(dataset, peak_force=1.002 * dataset.peak_force)
    found = fm.check_map(force_map, dataset)
    assert (found.outcome.value == "holds") is holds, found


def test_published_maps_say_that_nothing_slow_is_known():
    for name in fm.PUBLISHED_MAPS:
        basis = fm.safe_speed(fm.published_map(name), 0.7, 0.3, limit=HAND, bound=fm.FixedMargin(0.1),
                              contact=fm.Contact.TRANSIENT).basis  # fmt: skip
        assert "slow_impacts_missing" in [each.kind.value for each in basis.warnings]


def test_a_map_that_holds_from_a_speed_on_hints_at_none_below(ask, forcemap, tmp_path):
    """Impacts there are not fitted, so that measuring them gains nothing."""
    at = (*np.unique(GRID[:, :2], axis=0).T,)
    found = {slowest: fm.safe_speed(fm.fit_force_map(impacts(np.full(5, 1.02), slowest)), *at, limit=HAND, **CASE)
             for slowest in (SLOWEST, float("nan"))}  # fmt: skip
    unconfirmed = found[SLOWEST].outcome == fm.SpeedOutcome.UNCONFIRMED
    assert unconfirmed.any()
    assert np.isnan(found[SLOWEST].extrapolated_speed).all()
    assert np.isfinite(fm.safe_speed(alone(), *at, limit=HAND, **CASE).extrapolated_speed).any() is np.False_
