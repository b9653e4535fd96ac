"""Maps that hold from a stated speed on (map.slowest_mps), on the virtual lab's truth: is slower motion safe with them?

A place that is permitted a speed is too fast if the lab's force there exceeds the limit at any speed up to it, also
slower than the map holds for, and also of an impact up to 5 degrees off the direction, where the speed is one for that.
The default plan from 0.05 m/s on, of which the states below 0.2 m/s are not fitted. `make validity` runs 100 campaigns
a row and prints the tables of docs/validity.md.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest
from test_lab_bound import NOISE, REPEATS, box

import forcemap as fm
from forcemap.direction import WIDEST_ANGLE
from forcemap.lab.bench import simulate_peaks
from forcemap.lab.virtual_robot import PRESETS, virtual_robot
from forcemap.maps.slower_impacts import cover_slower, slow_impacts_missing
from sizes import FULL_SIZE
from test_tilted_paths import around, tilted
from truths import spread

SEED, SLOWEST, MEASURED_FROM, EFFECT = 202627, 0.2, 0.05, 0.022
STATES = {27: 14, 36: 18}  # of the plan, and its places
LIMITS = (140.0, 180.0, 220.0, 260.0, 300.0, 340.0)  # N
LEVELS = np.linspace(0.05, 0.4, 36)  # m/s, at which the lab's force is known


@functools.cache
def truth(preset, other=None):
    """Places of a fine grid, shape (n, 2), and the largest forces of the lab up to each of LEVELS there, (n, 36).

    By the angle [deg] up to which the motion may point off the direction: of the straight impact, and of it and those
    tilted by half the angle and the whole towards twelve sides.
    """
    places = np.unique(box(preset, MEASURED_FROM).grid(*(13, 13) if FULL_SIZE else (7, 7), 2)[:, :2], axis=0)
    d, h = places.repeat(LEVELS.size, axis=0).T
    robot = OTHERS[other](virtual_robot(preset)) if other else virtual_robot(preset)
    at = robot, d, h, np.tile(LEVELS, len(places))
    straight = simulate_peaks(*at)
    tilts = [tilted(angle, side) for angle in (WIDEST_ANGLE / 2, WIDEST_ANGLE) for side in around(12)]
    off = np.max([straight, *(simulate_peaks(*at, direction=tilt) for tilt in tilts)], axis=0)
    force = {0.0: straight, WIDEST_ANGLE: off}
    return places, {angle: np.maximum.accumulate(f.reshape(len(places), -1), axis=1) for angle, f in force.items()}


def campaign(preset, states, number, *, measured_from=MEASURED_FROM, slowest=SLOWEST, more=(), robot=None):
    """A seeded campaign whose robot's speeds scatter; the conditions state from which speed on its map is to hold.

    `more`: further states, shape (n, 3).
    """
    robot, rng = robot or virtual_robot(preset), np.random.default_rng([SEED, number])
    planned = spread(box(preset, measured_from), states=states, places=STATES[states])
    d, h, v = np.vstack([planned, *([more] if len(more) else [])]).repeat(REPEATS, axis=0).T
    state = np.arange(v.size) // REPEATS
    peak = simulate_peaks(robot, d, h, v * (1 + robot.speed_scatter * rng.standard_normal(v.size)))
    force = peak * np.exp(EFFECT * rng.standard_normal(state[-1] + 1)[state]) + rng.normal(0, NOISE, v.size)
    stated = fm.Conditions(direction="down", slowest=slowest, device=fm.Device(stiffness=75e3, range=2000.0, error=3.0))
    names = [f"s{i}" for i in state]
    return fm.ImpactDataset.from_arrays(
        distance=d,
        height=h,
        speed=v,
        peak_force=force,
        state=names,
        conditions=stated,
        phase2_force=np.full(v.size, 20.0),
    )


def counted(force_maps, known, angle=0.0):
    """Places permitted a speed; the shares of them [%] at which the lab exceeds the limit at any speed up to it, and at
    one below SLOWEST; the largest force over its limit; campaigns and limits with over 20 % of places above [%].

    Speeds and forces are those of motion up to `angle` [deg] off the direction.
    """
    places, highest = known[0], known[1][angle]
    permitted = above = slower = much = campaigns = 0
    worst = 0.0
    for force_map in force_maps:
        for limit in LIMITS:
            found = fm.safe_speed(
                force_map, *places.T, limit=limit, bound=fm.ToleranceBound(), contact=fm.Contact.TRANSIENT,
                quasi_static_limit=limit / 2, angle=angle,
            )  # fmt: skip
            has = ~np.isnan(found.speed)
            if not has.any():
                continue
            reached = highest[has, np.searchsorted(LEVELS, found.speed[has] + 1e-9) - 1]
            below = highest[has, np.searchsorted(LEVELS, SLOWEST + 1e-9) - 1]
            campaigns, permitted = campaigns + 1, permitted + int(has.sum())
            above, slower = above + int((reached > limit).sum()), slower + int((below > limit).sum())
            much += np.mean(reached > limit) > 0.2
            worst = max(worst, float((reached / limit).max()))
    return permitted, 100 * above / permitted, 100 * slower / permitted, worst, 100 * much / campaigns


def off_direction(force_maps, known):
    """The same for motion up to 5 degrees off the direction: the share above, the largest force, and a row of both."""
    permitted, above, _, worst, _ = counted(force_maps, known, WIDEST_ANGLE)
    return above, worst, f"{permitted:,} | {above:.1f} % | {worst:.3f}"


@pytest.mark.parametrize("states", STATES if FULL_SIZE else [36])
@pytest.mark.parametrize("preset", PRESETS if FULL_SIZE else ["ur10e-like"])
def test_slower_motion_is_safe_where_a_speed_is_permitted(preset, states, full_size):
    """Counted as the promise: 95 % of the places in 95 % of campaigns, and far off nowhere."""
    force_maps = [fm.fit_force_map(campaign(preset, states, number)) for number in range(100 if full_size else 4)]
    assert all(force_map.measured_range.lowest[2] >= SLOWEST for force_map in force_maps)
    known = truth(preset)
    permitted, above, slower, worst, much = counted(force_maps, known)
    of_tilts, worst_tilt, off = off_direction(force_maps, known)
    raised = max(cover_slower(force_map).raised for force_map in force_maps)
    row = f"{permitted:,} | {above:.2f} % | {slower:.2f} % | {worst:.3f} | {much:.1f} %"
    print(f"| {preset} | {states} | {row} | {100 * (max(raised, 1.0) - 1):.1f} % | {off} |")
    assert permitted > 60
    assert max(above, of_tilts) <= 5.0
    assert max(worst, worst_tilt) < 1.15


@pytest.mark.parametrize("slowest", [np.nan, SLOWEST])
@pytest.mark.parametrize("preset", PRESETS if FULL_SIZE else ["ur10e-like"])
def test_slow_impacts_that_are_missing_are_said_planned_and_close_what_slower_motion_would_exceed(
    preset, slowest, full_size
):
    """A campaign from 0.2 m/s on, without slower impacts and with those that `next` plans, fitted or counted beside."""
    known, kind = truth(preset), fm.FindingKind.SLOW_IMPACTS_MISSING
    rows = []
    for planned in (False, True):
        force_maps = []
        for number in range(100 if full_size else 4):
            stated = {"measured_from": SLOWEST, "slowest": slowest}
            dataset = campaign(preset, 27, number, **stated)
            slow = np.empty((0, 3))
            for speed in (0.14, 0.1) if planned else ():
                found = fm.next_measurements(dataset, 280.0, contact=fm.Contact.QUASI_STATIC, repeats=1)
                assert kind in {each.kind for each in found.warnings}
                assert (found.plan.speed == speed).all()
                more = np.column_stack([found.plan.distance, found.plan.height, found.plan.speed])
                slow = np.vstack([slow, more])
                dataset = campaign(preset, 27, number, **stated, more=slow)
            force_maps.append(fm.fit_force_map(dataset))
            basis = fm.safe_speed(force_maps[-1], 0.7, 0.3, limit=280.0, bound=fm.ToleranceBound(),
                                  contact=fm.Contact.TRANSIENT, quasi_static_limit=140.0).basis  # fmt: skip
            assert (kind in {each.kind for each in basis.warnings}) is not planned
        permitted, above, _, worst, _ = counted(force_maps, known)
        of_tilts, worst_tilt, off = off_direction(force_maps, known)
        rows.append(above)
        how = ("beside" if slowest == SLOWEST else "fitted") if planned else "none"
        print(f"| {preset} | {how} | {permitted:,} | {above:.1f} % | {worst:.3f} | {off} |")
        assert permitted > 50
        assert of_tilts <= above
        assert worst_tilt < worst
    assert rows[1] <= 5.0
    assert preset != "ur10e-like" or rows[0] > 10.0


OTHERS = {
    "40 Nm": lambda robot: robot.with_threshold(40.0),
    "60 Nm": lambda robot: robot.with_threshold(60.0),
    "70 Nm": lambda robot: robot.with_threshold(70.0),
    "80 Nm": lambda robot: robot.with_threshold(80.0),
    "110 Nm": lambda robot: robot.with_threshold(110.0),
    "2 kg": lambda robot: robot.with_payload(2.0),
    "cover of 20 kN/m": lambda robot: robot.with_cover(20e3),
}


@pytest.mark.parametrize("other", OTHERS if FULL_SIZE else ["70 Nm"])
@pytest.mark.parametrize("preset", PRESETS if FULL_SIZE else ["ur10e-like"])
def test_a_map_that_was_measured_as_slowly_as_asked_for_tells_of_slower_motion(preset, other, full_size):
    """From 0.1 m/s on, with other safety settings, a payload, a cover than the speed was chosen with."""
    robot = OTHERS[other](virtual_robot(preset))
    stated = {"measured_from": 0.1, "slowest": np.nan, "robot": robot}
    force_maps = [fm.fit_force_map(campaign(preset, 27, number, **stated)) for number in range(20 if full_size else 3)]
    assert all(slow_impacts_missing(force_map) is None for force_map in force_maps)
    known = truth(preset, other)
    permitted, above, _, worst, _ = counted(force_maps, known)
    of_tilts, worst_tilt, off = off_direction(force_maps, known)
    print(f"| {preset} | {other} | {permitted:,} | {above:.1f} % | {worst:.3f} | {off} |")
    assert permitted > 50
    assert max(above, of_tilts) <= 10.0
    assert max(worst, worst_tilt) < 1.25


@pytest.mark.parametrize("preset", PRESETS if FULL_SIZE else ["ur10e-like"])
def test_what_is_planned_next_exceeds_what_it_is_expected_to_reach_no_more_often_than_the_bound(preset, full_size):
    """Also below the map's lowest speed, where slower impacts say how far the bound is to be raised: there first the
    corners, at which the plan measured nothing between its slowest and its fastest speed."""
    robot, states, above, worst, corners = virtual_robot(preset), 0, 0, 0.0, 0
    for number in range(60 if full_size else 4):
        dataset = campaign(preset, 27, number)
        found = fm.next_measurements(dataset, 280.0, contact=fm.Contact.QUASI_STATIC, speeds=(SLOWEST, 0.4))
        if found.plan is None or found.upper_force is None:
            continue
        at = found.plan.distance, found.plan.height, found.plan.speed
        ratio = simulate_peaks(robot, *at) / found.upper_force
        states, above, worst = states + ratio.size, above + int((ratio > 1).sum()), max(worst, float(ratio.max()))
        ends = [
            np.isin(axis, (axis_of.min(), axis_of.max()))
            for axis, axis_of in zip(at[:2], places_of(dataset), strict=True)
        ]
        corners += int((ends[0] & ends[1] & (at[2] < 0.25)).sum())
    print(f"| {preset} | {states} | {100 * above / states:.1f} % | {worst:.3f} | {corners} |")
    assert states > 10
    assert above <= 0.05 * states
    assert worst < 1.15
    assert corners


def places_of(dataset):
    """Distances and heights of the states."""
    return dataset.distance, dataset.height
