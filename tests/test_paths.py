"""Paths and tasks: reading, cutting, allowed speeds, cycle times against an independent integration."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

import forcemap as fm
from forcemap.cli import task_options
from forcemap.dynamics.inverse_kinematics import inverse_kinematics
from forcemap.dynamics.kinematics import forward_kinematics
from forcemap.dynamics.robots import robot_named
from forcemap.dynamics.urdf import read_urdf
from forcemap.paths.task import one_segment_task
from forcemap.paths.time_law import braking_speeds, time_law
from forcemap.speeds.zones import Segments
from forcemap.words import assumptions, sentence, sentences

BARE = fm.Allowance(speed=0.0, position=0.0)
HAND = one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT)


def dense_time(lengths, limits, acceleration, stops, ds=2e-5):
    """Cycle time by a forward and a backward pass over tiny steps: independent of the closed form."""
    counts = np.maximum(1, np.round(lengths / ds).astype(int))
    step = np.repeat(lengths / counts, counts)
    cap = np.repeat(limits, counts)
    node = np.concatenate([[0.0], np.minimum(cap[:-1], cap[1:]), [0.0]])
    node[np.cumsum(counts)[:-1][stops]] = 0.0
    for i in range(step.size):
        node[i + 1] = min(node[i + 1], math.sqrt(node[i] ** 2 + 2 * acceleration * step[i]))
    for i in range(step.size - 1, -1, -1):
        node[i] = min(node[i], math.sqrt(node[i + 1] ** 2 + 2 * acceleration * step[i]))
    return float(np.sum(2 * step / (node[1:] + node[:-1])))


def random_motion(rng):
    n = int(rng.integers(1, 12))
    return rng.uniform(0.01, 0.2, n), rng.uniform(0.05, 0.8, n), rng.uniform(0.2, 5.0), rng.random(n - 1) < 0.2


def test_cycle_times_agree_with_a_dense_integration():
    rng = np.random.default_rng(50)
    for _ in range(40):
        lengths, limits, acceleration, stops = random_motion(rng)
        law = time_law(lengths, limits, acceleration=acceleration, stops=stops)
        assert law.duration == pytest.approx(dense_time(lengths, limits, acceleration, stops), rel=0.005)


@given(st.integers(0, 2**32 - 1))
def test_property_accelerations_and_limits_hold_and_faster_is_never_slower(seed):
    rng = np.random.default_rng(seed)
    lengths, limits, acceleration, stops = random_motion(rng)
    law = time_law(lengths, limits, acceleration=acceleration, stops=stops)
    assert (law.top_speed <= limits * (1 + 1e-12)).all()
    assert law.start_speed[0] == law.end_speed[-1] == 0
    np.testing.assert_array_equal(law.end_speed[:-1], law.start_speed[1:])
    up, down = law.top_speed**2 - law.start_speed**2, law.top_speed**2 - law.end_speed**2
    assert (up >= -1e-12).all()
    assert (down >= -1e-12).all()
    assert (up + down <= 2 * acceleration * lengths * (1 + 1e-9)).all()
    assert (law.durations > 0).all()
    faster = limits * rng.uniform(1, 1.5, limits.size)
    assert time_law(lengths, faster, acceleration=acceleration, stops=stops).duration <= law.duration * (1 + 1e-12)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_time_law_needs_positive_figures(value):
    for arguments in (([value], [1.0], 1.0), ([1.0], [value], 1.0), ([1.0], [1.0], value)):
        with pytest.raises(fm.InputError, match="positive"):
            time_law(*arguments[:2], acceleration=arguments[2])


def press(distance=0.8, top=0.44, bottom=0.3, angle=0.0):
    x, y = distance * math.cos(angle), distance * math.sin(angle)
    return fm.ToolPath.through([[x, y, top], [x, y, bottom]])


def test_a_press_downwards_gets_the_speeds_of_its_places():
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    found = fm.path_speeds(ur10e, press(angle=2.0), HAND, bound=bound, allowance=BARE)
    assert len(found.path) == 7
    ends = fm.safe_speed(ur10e, 0.8, found.path.points[:, 2], limit=280.0, bound=bound).speed
    slower = np.minimum(ends[:-1], ends[1:])
    assert (found.speed <= slower).all()
    assert (found.speed > slower - 0.003).all()
    assert set(found.governed_by) == {"back_of_hand, transient"}
    assert found.limit.tolist() == [280.0] * 7
    law = time_law(found.path.lengths, found.speed, acceleration=1.0)
    assert found.allowed.duration == pytest.approx(law.duration)
    assert found.constant.speed == found.speed.min()
    assert found.constant.duration > found.allowed.duration
    assert found.standard.speed == pytest.approx(280 / math.sqrt(75e3 * 15))
    assert math.isnan(found.program.duration)
    allowed = fm.path_speeds(ur10e, press(angle=2.0), HAND, bound=bound)
    assert (allowed.speed < found.speed - 0.01).all()
    assert any("position tolerance 0.005 m" in line for line in lines(allowed))
    assert all(basis.allowance == fm.Allowance() for basis in allowed.bases)
    assert (allowed.speed + 0.01 <= allowed.contact_speed).all()


def test_directions_other_than_the_maps_are_named_and_get_nothing():
    points = [
        [0.8, 0, 0.4],
        [0.8, 0, 0.3],
        [0.7, 0, 0.3],
        [0.7, 0, 0.4],
        [0.708, 0, 0.3],
        [0.69, 0, 0.4],
        [0.7, 0, 0.3],
    ]
    found = fm.path_speeds(
        fm.published_map("ur10e"), fm.ToolPath.through(points), HAND, bound=fm.FixedMargin(), step=1.0, allowance=BARE
    )
    sideways = ["not_downward"] * 2
    assert found.outcome.tolist() == ["admissible", *sideways, "admissible", *sideways]  # the fourth by 4.6 degrees
    assert np.isnan(found.speed[[1, 2, 4, 5]]).all()
    assert any("pieces up to 5 degrees off it have it in their speeds" in line for line in lines(found))
    tilted = Segments(points[3], points[4])
    case = {"limit": fm.force_limit("back_of_hand"), "contact": "transient", "bound": fm.FixedMargin()}
    off, along = (fm.zone_speeds(fm.published_map("ur10e"), tilted, **case, angle=a).speed[0] for a in (4.6, 0.0))
    assert found.speed[3] == off < along - 0.02
    assert math.isnan(found.allowed.duration)
    assert found.allowed.permitted_duration > 0
    narrow = fm.path_speeds(
        fm.published_map("ur10e"), fm.ToolPath.through(points), HAND, bound=fm.FixedMargin(), step=1.0, angle=4.0
    )
    assert narrow.outcome[3] == "not_downward"
    up = fm.path_speeds(fm.published_map("ur10e"), press(top=0.3, bottom=0.4), HAND, bound=fm.FixedMargin())
    assert up.refused.all()
    assert math.isnan(up.allowed.permitted_duration)


def test_unconfirmed_and_outside_pieces_have_no_time():
    ur10e = fm.published_map("ur10e")
    low = fm.path_speeds(ur10e, press(distance=0.6, bottom=0.15), HAND, bound=fm.FixedMargin())
    assert {"admissible", "unconfirmed"} == set(low.outcome)
    assert math.isnan(low.allowed.duration)
    beyond = fm.path_speeds(ur10e, press(top=0.5), HAND, bound=fm.FixedMargin())
    assert "outside" in beyond.outcome.tolist()
    clamps = fm.path_speeds(fm.published_map("kuka-iiwa7-30nm"), press(), HAND, bound=fm.FixedMargin())
    assert set(clamps.outcome) == {"unconfirmed"}
    assert "no transient limit" in sentence(clamps.reason[0])


def lines(speeds):
    return assumptions(speeds.bases, speeds.notes)


def test_the_strictest_area_governs_and_the_head_has_no_speed():
    ur10e = fm.published_map("ur10e")
    areas = ("back_of_hand", "deltoid_muscle", "forearm_muscle")
    found = fm.path_speeds(
        ur10e, press(), one_segment_task("path", areas, fm.Contact.TRANSIENT), bound=fm.FixedMargin()
    )
    alone = [
        fm.path_speeds(ur10e, press(), one_segment_task("path", (a,), fm.Contact.TRANSIENT), bound=fm.FixedMargin())
        for a in areas
    ]
    np.testing.assert_array_equal(found.speed, np.min([each.speed for each in alone], axis=0))
    head = one_segment_task("path", ("back_of_hand", "temple"), fm.Contact.TRANSIENT)
    refused = fm.path_speeds(ur10e, press(), head, bound=fm.FixedMargin())
    assert set(refused.outcome) == {"not_permitted"}
    assert "not permitted" in sentence(refused.reason[0])
    assert np.isnan(refused.speed).all()
    assert math.isnan(refused.standard.duration)


def test_excluded_contact_is_driven_as_programmed_and_said():
    points = np.array([[0.8, 0, 0.3], [0.8, 0, 0.44], [0.8, 0, 0.3]])
    path = fm.ToolPath(points, ("lift", "press"))
    task = fm.Task(
        (fm.TaskSegment("lift", (), None, 0.5), fm.TaskSegment("press", ("back_of_hand",), fm.Contact.TRANSIENT))
    )
    found = fm.path_speeds(fm.published_map("ur10e"), path, task, bound=fm.FixedMargin())
    assert set(found.outcome[:7]) == {"no_contact"}
    assert set(found.speed[:7]) == {0.5}
    assert not found.refused.any()
    assert found.allowed.duration > 0
    assert any("excluded" in line for line in lines(found))


def test_timed_paths_tell_where_they_are_too_fast():
    path = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.38], [0.8, 0, 0.3]], time=[0.0, 0.15, 0.95])
    found = fm.path_speeds(fm.published_map("ur10e"), path, HAND, bound=fm.FixedMargin(), allowance=BARE)
    np.testing.assert_allclose(found.path.speeds, [0.4] * 3 + [0.1] * 4)
    np.testing.assert_allclose(found.programmed, [0.475] * 3 + [0.4] * 4)  # v + a T / 2, and sqrt(2 a s)
    assert found.too_fast.all()
    assert found.program.duration == pytest.approx(0.95)
    time = np.linspace(0, 0.95, 96)
    height = np.interp(time, [0.0, 0.15, 0.95], [0.44, 0.38, 0.3])
    points = np.column_stack([np.full(96, 0.8), np.zeros(96), height])
    fine = fm.path_speeds(
        fm.published_map("ur10e"), fm.ToolPath.through(points, time=time), HAND, bound=fm.FixedMargin(), allowance=BARE
    )
    assert fine.too_fast.tolist() == [True] * 15 + [False] * 80
    assert (fine.programmed >= fine.path.speeds).all()
    assert np.max(fine.programmed[17:] - 0.1) < 0.0051
    assert any("between two rows the times tell only the mean" in line for line in lines(fine))


LAYOUTS = {
    "x_m,y_m,z_m": ["0.8,0,0.44", "0.8,0,0.40", "0.8,0,0.36", "0.8,0,0.32", "0.8,0,0.30"],
    "distance_m,height_m": ["0.8,0.44", "0.8,0.40", "0.8,0.36", "0.8,0.32", "0.8,0.30"],
    "joint_1_deg,joint_2_deg,joint_3_deg,joint_4_deg,joint_5_deg,joint_6_deg": [
        f"0,{-95 + 2 * i},-110,-65,90,0" for i in range(5)
    ],
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_motion_has_the_faster_of_the_speeds_stated_at_its_ends(layout, tmp_path):
    robot = robot_named("ur10e") if layout.startswith("joint") else None
    rows = [f"{row},{speed}" for row, speed in zip(LAYOUTS[layout], ("0.2", "0.4", "", "", "0.3"), strict=True)]
    (tmp_path / "path.csv").write_text("\n".join([f"{layout},speed_mps", *rows]))
    path = fm.read_path(tmp_path / "path.csv", robot=robot)
    assert path.time is None
    runs = [speed for speed, _ in itertools.groupby(np.nan_to_num(path.stated_speeds).tolist())]
    assert runs == [0.4, 0.0, 0.3]  # 0.2 to 0.4 and 0.4 to nothing, nothing to nothing, nothing to 0.3
    fine = path.resampled(0.005)
    moves = np.searchsorted(np.cumsum(path.lengths), np.cumsum(fine.lengths) - fine.lengths / 2)
    np.testing.assert_array_equal(fine.stated_speeds, path.stated_speeds[moves])
    np.testing.assert_array_equal(path.moved([0, 0, 0.1]).stated_speeds, path.stated_speeds)


def test_speeds_of_the_file_are_compared_and_the_tasks_fill_in(tmp_path):
    (tmp_path / "path.csv").write_text(
        "x_m,y_m,z_m,segment,speed_mps\n0.8,0,0.44,press,0.2\n0.8,0,0.40,press,0.5\n0.8,0,0.36,press,\n"
        "0.8,0,0.32,lift,\n0.8,0,0.36,lift,0.7\n0.8,0,0.40,lift,\n"
    )
    path = fm.read_path(tmp_path / "path.csv")
    np.testing.assert_array_equal(path.stated_speeds, [0.5, 0.5, np.nan, 0.7, 0.7])
    press, lift = fm.TaskSegment("press", HAND.segments[0].areas, "transient"), fm.TaskSegment("lift", (), None, 0.6)

    def along(press):
        return fm.path_speeds(
            fm.published_map("ur10e"),
            path,
            fm.Task((press, lift), 20.0),
            bound=fm.FixedMargin(),
            step=1.0,
            allowance=BARE,
        )

    unstated = along(press)
    np.testing.assert_array_equal(unstated.programmed, [0.5, 0.5, np.nan, 0.7, 0.7])
    assert unstated.too_fast.tolist() == [True, True, False, True, True]
    assert math.isnan(unstated.program.duration)
    assert math.isnan(unstated.slowed.duration)
    of_rows = "programmed speed: that of the path's rows, on each motion the faster of its two points"
    assert f"{of_rows}; for one that states none the task's counts, if it states one; not stated everywhere" in lines(
        unstated
    )
    filled = along(dataclasses.replace(press, speed=0.1))
    np.testing.assert_array_equal(filled.programmed, [0.5, 0.5, 0.1, 0.7, 0.7])
    np.testing.assert_array_equal(filled.speed[3:], [0.6, 0.6])  # what the task allows where contact is excluded
    assert f"{of_rows}; for one that states none the task's counts, if it states one" in lines(filled)
    np.testing.assert_array_equal(along(dataclasses.replace(press, speed=0.6)).programmed, [0.5, 0.6, 0.6, 0.7, 0.7])
    most = time_law(
        filled.path.lengths, np.minimum(filled.programmed, filled.speed), acceleration=20.0, stops=[0, 0, 1, 0]
    )
    assert filled.slowed.duration == pytest.approx(most.duration)
    assert filled.program.duration < filled.slowed.duration
    assert filled.slowed.duration > filled.allowed.duration  # the program is slower than allowed on a piece


def test_a_row_without_a_speed_is_as_fast_as_the_task_at_both_its_motions(tmp_path):
    """A robot that takes the speed from that row drives the task's; a slower row at the other end hides nothing."""
    rows = ["0.8,0,0.44,press,", "0.8,0,0.40,press,0.2", "0.8,0,0.36,press,0.3", "0.8,0,0.32,press,"]
    (tmp_path / "path.csv").write_text("\n".join(["x_m,y_m,z_m,segment,speed_mps", *rows]))
    path = fm.read_path(tmp_path / "path.csv")
    task = one_segment_task("press", ("back_of_hand",), fm.Contact.TRANSIENT, speed=0.5)
    speeds = fm.path_speeds(fm.published_map("ur10e"), path, task, bound=fm.FixedMargin(0.10))
    ends = np.cumsum(path.lengths)
    piece = np.searchsorted(ends, np.cumsum(speeds.path.lengths) - speeds.path.lengths / 2)
    np.testing.assert_array_equal(speeds.programmed, np.array([0.5, 0.3, 0.5])[piece])
    assert speeds.too_fast[piece != 1].all()


def test_a_row_without_a_speed_leaves_its_motions_unknown_unless_they_are_too_fast(tmp_path):
    """Without a speed of the task nobody knows what the robot drives there: no factor follows from the other end."""
    rows = ["0.8,0,0.44,0.05", "0.8,0,0.41,", "0.8,0,0.38,0.05", "0.8,0,0.35,0.05", "0.8,0,0.33,", "0.8,0,0.32,0.9"]
    (tmp_path / "path.csv").write_text("\n".join(["x_m,y_m,z_m,speed_mps", *rows]))
    path = fm.read_path(tmp_path / "path.csv")
    hand = ("back_of_hand",), fm.Contact.TRANSIENT

    def along(speed):
        task = one_segment_task("path", *hand, speed=speed)
        return fm.path_speeds(fm.published_map("ur10e"), path, task, bound=fm.FixedMargin(0.10), step=1.0)

    np.testing.assert_array_equal(along(math.nan).programmed, [np.nan, np.nan, 0.05, np.nan, 0.9])
    assert along(math.nan).too_fast.tolist() == [False] * 4 + [True]
    np.testing.assert_array_equal(along(0.06).programmed, [0.06, 0.06, 0.05, 0.06, 0.9])


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(
    ("column", "stated", "whose"),
    [
        (
            "speed_to_point_mps",
            ("0.9", "0.4", "", "0.2", "0.3"),
            "that of the point it leads to",
        ),  # the first begins it
        (
            "speed_from_point_mps",
            ("0.4", "", "0.2", "0.3", "0.9"),
            "that of the point it begins at",
        ),  # the last ends it
    ],
)
def test_a_speed_to_or_from_a_point_is_that_of_one_motion(column, stated, whose, layout, tmp_path):
    robot = robot_named("ur10e") if layout.startswith("joint") else None
    rows = [f"{row},{speed}" for row, speed in zip(LAYOUTS[layout], stated, strict=True)]
    (tmp_path / "path.csv").write_text("\n".join([f"{layout},{column}", *rows]))
    path = fm.read_path(tmp_path / "path.csv", robot=robot)
    runs = [speed for speed, _ in itertools.groupby(np.nan_to_num(path.stated_speeds).tolist())]
    assert runs == [0.4, 0.0, 0.2, 0.3]
    hand = ("back_of_hand",), fm.Contact.TRANSIENT
    task = one_segment_task("path", *hand, speed=0.25)
    speeds = fm.path_speeds(fm.published_map("ur10e"), path, task, bound=fm.FixedMargin(0.10))
    ends, middles = np.cumsum(path.lengths), np.cumsum(speeds.path.lengths) - speeds.path.lengths / 2
    filled = np.where(np.isnan(path.stated_speeds), 0.25, path.stated_speeds)
    np.testing.assert_array_equal(speeds.programmed, filled[np.searchsorted(ends, middles)])
    of_rows = f"programmed speed: that of the path's rows, on each motion {whose}"
    assert f"{of_rows}; for one that states none the task's counts, if it states one" in lines(speeds)
    both = [f"{layout},{column},speed_mps", *(f"{row},1" for row in rows)]
    (tmp_path / "path.csv").write_text("\n".join(both))
    with pytest.raises(fm.InputError, match="expected one of them"):
        fm.read_path(tmp_path / "path.csv", robot=robot)


def test_no_row_of_a_path_is_hidden(tmp_path):
    """Lines that begin with # are remarks above the names of the columns alone."""
    rows = ["#1 press,0.8,0,0.44", "#2 dip,0.8,0,0.18", "#3 lift,0.8,0,0.44", ",0.8,0,0.5"]
    (tmp_path / "path.csv").write_text("\n".join(["# a remark", "segment,x_m,y_m,z_m", *rows]))
    assert fm.read_path(tmp_path / "path.csv").names == ("#1 press", "#2 dip", "#3 lift")


@pytest.mark.parametrize("last", ["place", "lift", ""])
def test_names_of_rows_that_end_motions_exclude_no_wrong_motion(last, tmp_path):
    """Rows that name the motion to them have a last name that begins none: the exclusion would be one motion off."""
    rows = ["0.8,0,0.44,carry", "0.8,0,0.30,carry", "0.8,0,0.44,place", f"0.8,0,0.30,{last}"]
    (tmp_path / "path.csv").write_text("\n".join(["x_m,y_m,z_m,segment", *rows]))
    path = fm.read_path(tmp_path / "path.csv")
    assert path.end_name == path.moved([0, 0, 0.01]).resampled(0.01).end_name == last
    hand = {"areas": ("back_of_hand",), "contact": fm.Contact.TRANSIENT}
    carry, place = fm.TaskSegment("carry", (), None, 0.5), fm.TaskSegment("place", **hand)
    for segments, refused in (
        ((carry, place), last == "lift"),
        ((carry, place, fm.TaskSegment("lift", **hand)), True),
        ((fm.TaskSegment("carry", **hand), place), False),
    ):
        asked = {"task": fm.Task(segments), "bound": fm.FixedMargin(0.10)}
        if refused:
            words = "move every name up by one row" if last == "lift" else "which the path does not have"
            with pytest.raises(fm.InputError, match=words):
                fm.path_speeds(fm.published_map("ur10e"), path, **asked)
        else:
            assert fm.path_speeds(fm.published_map("ur10e"), path, **asked).speed.size
    (tmp_path / "path.csv").write_text("x_m,y_m,z_m,segment\n0.8,0,0.44,\n0.8,0,0.30,press\n")
    with pytest.raises(fm.InputError, match="whose motion begins at this row"):
        fm.read_path(tmp_path / "path.csv")


@pytest.mark.parametrize("speeds", [[0.2], [0.2, 0.0], [0.2, -1.0], [0.2, math.inf], [0.2, 10.01]])
def test_stated_speeds_are_one_for_each_piece_positive_and_at_most_10(speeds):
    points = np.array([[0.8, 0, 0.44], [0.8, 0, 0.4], [0.8, 0, 0.36]])
    with pytest.raises(fm.InputError, match="one speed for each piece"):
        fm.ToolPath(points, ("a", "a"), stated_speeds=np.array(speeds))
    assert fm.ToolPath(points, ("a", "a"), stated_speeds=np.array([10.0, np.nan])).speeds is None
    with pytest.raises(fm.InputError, match="expected one of them"):
        fm.ToolPath(points, ("a", "a"), np.array([0.0, 1.0, 2.0]), stated_speeds=np.array([0.1, 0.1]))


@pytest.mark.parametrize(("share", "too_fast"), [(0.99, False), (1.0099, False), (1.0101, True), (1.2, True)])
def test_a_log_may_exceed_the_tasks_speed_by_its_last_digit_where_contact_is_excluded(share, too_fast):
    height = np.linspace(0.3, 0.44, 36)
    points = np.column_stack([np.full(36, 0.8), np.zeros(36), height])
    logged = fm.ToolPath.through(points, time=np.arange(36) * (height[1] - height[0]) / (0.6 * share))
    lift = fm.Task((fm.TaskSegment("path", (), None, 0.6),))
    given = {"bound": fm.FixedMargin(), "allowance": BARE}
    found = fm.path_speeds(fm.published_map("ur10e"), logged, lift, **given)
    assert found.too_fast.tolist() == [too_fast] * 35
    np.testing.assert_allclose(found.programmed, 0.6 if 1 < share < 1.01 else 0.6 * share)
    slower = share if too_fast else 1.0
    assert found.slowed.duration == pytest.approx(found.program.duration * slower)
    assert any("counts as the task's speed up to 1 % above it" in line for line in lines(found))
    stated = dataclasses.replace(logged, time=None, stated_speeds=np.full(35, 0.6 * share))
    assert fm.path_speeds(fm.published_map("ur10e"), stated, lift, **given).too_fast.all() == (share > 1)
    down = dataclasses.replace(logged, points=points[::-1])  # where contact is possible no log is let off
    hand = fm.path_speeds(fm.published_map("ur10e"), down, HAND, **given)
    assert (hand.programmed >= hand.path.speeds).all()
    assert not any("counts as the task's" in line for line in lines(hand))


def test_a_timed_program_slowed_takes_longer_where_it_is_too_fast():
    time = np.array([0.0, 0.15, 0.95, 1.35])
    path = fm.ToolPath(
        np.array([[0.8, 0, 0.44], [0.8, 0, 0.38], [0.8, 0, 0.3]]), ("path",) * 2, time[:3], wait=np.array([0, 0, 0.4])
    )
    found = fm.path_speeds(fm.published_map("ur10e"), path, HAND, bound=fm.FixedMargin(), allowance=BARE)
    own = np.repeat([0.05, 0.2], [3, 4])
    longer = np.maximum(1, np.repeat([0.06 / 0.15, 0.08 / 0.8], [3, 4]) / found.speed)
    assert longer.max() > 1.2
    assert found.slowed.duration == pytest.approx(float((own * longer).sum()) + 0.4)
    assert found.slowed.permitted_duration == found.slowed.duration
    assert found.program.duration == pytest.approx(1.35)


@given(st.integers(0, 2**32 - 1), st.floats(0.3, 5.0))
def test_property_a_timed_program_is_never_faster_than_is_assumed(seed, acceleration):
    """Motions within an acceleration, told by a few rows: the speed taken is not below the true one."""
    rng = np.random.default_rng(seed)
    change = rng.choice([-acceleration, 0.0, acceleration], 400)
    speed = np.maximum(np.cumsum(np.concatenate([[0.2], change * 0.005])), 0.01)
    time = 0.005 * np.arange(401)
    way = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * 0.005)])
    rows = np.unique(np.concatenate([[0, 400], rng.choice(401, rng.integers(1, 60))]))
    path = fm.ToolPath.through(np.column_stack([way[rows], np.zeros((rows.size, 2))]), time=time[rows])
    fine = path.resampled(0.01)
    fastest = [speed[a : b + 1].max() for a, b in itertools.pairwise(rows)]
    assert (path.fastest_speeds(acceleration) >= np.array(fastest) - 1e-9).all()
    assert (fine.fastest_speeds(acceleration) >= np.array(fastest)[fine.rows] - 1e-9).all()


@given(st.integers(0, 2**32 - 1), st.floats(0.3, 5.0))
def test_property_a_motion_turns_no_farther_beyond_its_rows_than_is_assumed(seed, acceleration):
    """To and fro on a line within an acceleration, told by a few rows."""
    rng = np.random.default_rng(seed)
    speed = np.cumsum(np.concatenate([[0.1], rng.choice([-acceleration, acceleration], 400) * 0.005]))
    time = 0.005 * np.arange(401)
    way = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * 0.005)])
    rows = np.unique(np.concatenate([[0, 400], rng.choice(401, rng.integers(1, 60))]))
    rows = rows[np.concatenate([[True], np.abs(np.diff(way[rows])) > 1e-6])]
    assume(rows.size > 2)
    path = fm.ToolPath.through(np.column_stack([way[rows], np.zeros((rows.size, 2))]), time=time[rows])
    beside, apart = path.beside_turns(acceleration, np.ones(len(path), dtype=np.bool_))
    forward = np.diff(way[rows]) > 0
    turns = np.flatnonzero(forward[1:] != forward[:-1]) + 1
    assert (beside > 0) == (turns.size > 0)
    for row in turns:
        a, b = rows[row - 1], rows[row + 1]
        around = way[rows[row - 1 : row + 2]]
        beyond = np.fmax(way[a : b + 1] - around.max(), around.min() - way[a : b + 1]).max()
        assert beyond <= beside + 1e-9
    assert apart == 0 or np.isclose(np.diff(time[rows]), apart).any()
    fine = path.resampled(0.01).beside_turns(acceleration, np.ones(len(path.resampled(0.01)), dtype=np.bool_))
    assert fine == pytest.approx((beside, apart))
    assert path.beside_turns(acceleration, np.zeros(len(path), dtype=np.bool_)) == (0.0, 0.0)


@given(st.integers(0, 2**32 - 1))
def test_property_speeds_commanded_piece_by_piece_enter_no_piece_too_fast(seed):
    """A robot that takes each piece's speed from its start on, and brakes no harder than stated."""
    rng = np.random.default_rng(seed)
    lengths, limits, acceleration, _ = random_motion(rng)
    limits[rng.random(limits.size) < 0.2] = 0.0
    commanded = braking_speeds(lengths, limits, acceleration=acceleration)
    assert (commanded <= limits).all()
    entry = commanded[0]
    for i, length in enumerate(lengths):
        assert entry**2 <= limits[i] ** 2 + 1e-12
        entry = max(commanded[i], math.sqrt(max(entry**2 - 2 * acceleration * length, 0.0)))
    free = braking_speeds(lengths, np.full(limits.size, 0.3), acceleration=acceleration)
    assert (free == 0.3).all()


@pytest.mark.parametrize("angle", [5.1, 89.0, -1.0, math.nan])
def test_motion_in_another_direction_cannot_be_asked_for(angle):
    with pytest.raises(fm.InputError, match="from 0 to 5"):
        fm.path_speeds(fm.published_map("ur10e"), press(), HAND, bound=fm.FixedMargin(), angle=angle)


def test_what_was_not_stated_is_said():
    bare = fm.path_speeds(fm.published_map("ur10e"), press(), HAND, bound=fm.FixedMargin())
    assert any("programmed speed: not stated" in line for line in lines(bare))
    assert any("moving mass 30 kg, payload 0 kg" in line for line in lines(bare))
    assert any("no speed for any other direction" in line for line in lines(bare))
    ur10e = fm.published_map("ur10e")
    unstated = dataclasses.replace(ur10e, conditions=dataclasses.replace(ur10e.conditions, payload=math.nan))
    found = fm.path_speeds(unstated, press(), HAND, bound=fm.FixedMargin())
    assert any("payload 0 kg (assumed, the campaign does not state it)" in line for line in lines(found))


def test_standing_still_in_a_timed_path_is_a_wait(tmp_path):
    file = tmp_path / "path.csv"
    rows = [(0, 0.44), (0.5, 0.44), (1, 0.38), (2, 0.38), (2.5, 0.38), (3, 0.3), (3.25, 0.3)]
    file.write_text("time_s,distance_m,height_m\n" + "".join(f"{t},0.8,{h}\n" for t, h in rows))
    path = fm.read_path(file)
    assert path.wait.tolist() == [0.5, 1.5, 0.25]
    np.testing.assert_allclose(path.speeds, [0.12, 0.16])
    fine = path.resampled(0.02)
    np.testing.assert_allclose(fine.speeds, [0.12] * 3 + [0.16] * 4)
    assert fine.wait.sum() == 2.25
    found = fm.path_speeds(fm.published_map("ur10e"), path, HAND, bound=fm.FixedMargin(), allowance=BARE)
    assert found.program.duration == pytest.approx(3.25)
    halves = [
        fm.path_speeds(
            fm.published_map("ur10e"), fm.ToolPath.through([[0.8, 0, a], [0.8, 0, b]]), HAND,
            bound=fm.FixedMargin(), allowance=BARE,
        ).allowed.duration
        for a, b in ((0.44, 0.38), (0.38, 0.3))
    ]  # fmt: skip
    assert found.allowed.duration == pytest.approx(sum(halves) + 2.25)
    file.write_text("time_s,distance_m,height_m\n0,0.8,0.4\n1,0.8,0.4\n")
    with pytest.raises(fm.InputError, match="at least two points"):
        fm.read_path(file)


@given(st.integers(0, 2**32 - 1), st.floats(0.005, 0.2))
def test_property_resampling_keeps_the_path(seed, step):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.uniform(-0.1, 0.1, (6, 3)), axis=0)
    path = fm.ToolPath(points, tuple("abcde"), np.cumsum(rng.uniform(0.1, 1, 6)))
    fine = path.resampled(step)
    assert fine.lengths.max() <= step * (1 + 1e-9)
    assert fine.lengths.sum() == pytest.approx(path.lengths.sum())
    assert fine.time[-1] == path.time[-1]
    for point in points:
        assert np.linalg.norm(fine.points - point, axis=1).min() < 1e-12
    for name in "abcde":
        assert fine.lengths[[n == name for n in fine.names]].sum() == pytest.approx(path.lengths["abcde".index(name)])


def test_files_of_positions(tmp_path):
    file = tmp_path / "path.csv"
    file.write_text("time_s;x_m;y_m;z_m;segment\n0;0,8;0;0,44;press\n1;0,8;0;0,3;press\n2;0,8;0;0,4;lift\n")
    path = fm.read_path(file)
    np.testing.assert_array_equal(path.points, [[0.8, 0, 0.44], [0.8, 0, 0.3], [0.8, 0, 0.4]])
    assert path.names == ("press", "press")
    assert path.time.tolist() == [0, 1, 2]
    file.write_text("distance_m,height_m\n0.8,0.44\n0.8,0.3\n")
    np.testing.assert_array_equal(fm.read_path(file).points, [[0.8, 0, 0.44], [0.8, 0, 0.3]])


def test_joint_trajectories_follow_the_robot(tmp_path):
    robot = robot_named("ur10e")
    q = robot.reference_posture + np.array([[0.0], [0.4]]) * np.array([1, 0.3, -0.2, 0.1, 0, 0.5])
    file = tmp_path / "joints.csv"
    header = ",".join(f"joint_{i}_deg" for i in range(1, 7))
    file.write_text(
        "\n".join([f"time_s,{header}", *(",".join(map(str, [t, *np.degrees(row)])) for t, row in enumerate(q))])
    )
    path = fm.read_path(file, robot=robot)
    fine = forward_kinematics(robot, q[0] + (q[1] - q[0]) * np.linspace(0, 1, 500)[:, None]).position
    start, along = path.points[:-1], np.diff(path.points, axis=0)
    for point in fine:
        share = np.clip(np.sum((point - start) * along, axis=1) / np.sum(along**2, axis=1), 0, 1)
        assert np.linalg.norm(start + share[:, None] * along - point, axis=1).min() < 2e-4
    assert path.time[-1] == 1
    assert set(path.rows) == {0}  # one row's times, however many pieces
    with pytest.raises(fm.InputError, match="name their robot"):
        fm.read_path(file)


def joint_file(tmp_path, q):
    header = ",".join(f"joint_{i}_rad" for i in range(1, q.shape[1] + 1))
    (tmp_path / "joints.csv").write_text("\n".join([header, *(",".join(map(repr, row)) for row in q.tolist())]))
    return tmp_path / "joints.csv"


def distance_from(path, points):
    """How far points lie from a path [m]."""
    start, along = path.points[:-1], np.diff(path.points, axis=0)
    far = []
    for point in points:
        share = np.clip(np.sum((point - start) * along, axis=1) / np.sum(along**2, axis=1), 0, 1)
        far.append(np.linalg.norm(start + share[:, None] * along - point, axis=1).min())
    return np.array(far)


@pytest.mark.parametrize(
    "turn", [[2, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 1], [0, 0, 1, 0, 0, 0], [1, -1, 1, -1, 1, -1]]
)
def test_joint_motions_of_a_full_turn_are_followed(turn, tmp_path):
    """The ends of such a motion are one place, and halves of a symmetric one may lie on a chord."""
    robot = robot_named("ur10e").with_tool(mass=0.0, centre_of_mass=(0, 0, 0), contact_offset=(0, 0, 0.1))
    middle = np.zeros(6) if turn[2] == 1 and turn[0] == 0 else robot.reference_posture
    size = np.pi * 0.99 if turn[2] else np.pi  # the elbow turns by less
    q = np.array([[-size], [size]]) * np.array(turn) + middle * (np.array(turn) == 0)
    path = fm.read_path(joint_file(tmp_path, q), robot=robot)
    true = forward_kinematics(robot, q[0] + (q[1] - q[0]) * np.linspace(0, 1, 3001)[:, None]).position
    assert distance_from(path, true).max() <= path.deviation + 1e-9
    assert path.deviation == 1e-4


@pytest.mark.parametrize("turn", np.linspace(0.05, 0.2, 9).tolist())
def test_a_long_tool_on_the_last_joint_keeps_to_its_chords(turn, tmp_path):
    """An arc of radius 2 m, whose height above its chord is known."""
    robot = robot_named("ur10e").with_tool(mass=0.0, centre_of_mass=(0, 0, 0), contact_offset=(2.0, 0, 0))
    q = np.array([robot.reference_posture, robot.reference_posture])
    q[1, 5] += turn
    path = fm.read_path(joint_file(tmp_path, q), robot=robot)
    height = 2.0 * (1 - math.cos(turn / len(path) / 2))
    assert height <= path.deviation
    assert 2.0 * (1 - math.cos(turn / max(len(path) - 1, 1) / 2)) > 0.6 * path.deviation


def test_joint_motion_gets_no_more_than_the_true_motion_allows(tmp_path):
    """A base that turns far while the arm presses down: dense samples of the true motion against the pieces."""
    robot = robot_named("ur10e")
    reach = inverse_kinematics(robot, [[0.8, 0.0, 0.44], [0.8, 0.0, 0.34]])
    q = reach.positions.copy()
    q[1, 0] += 0.006
    path = fm.read_path(joint_file(tmp_path, q), robot=robot)
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    found = fm.path_speeds(ur10e, path, HAND, bound=bound, allowance=BARE, step=1.0)
    assert found.speed.size == len(path) >= 10
    true = forward_kinematics(robot, q[0] + (q[1] - q[0]) * np.linspace(0, 1, 4001)[:, None]).position
    at = fm.safe_speed(ur10e, np.hypot(true[:, 0], true[:, 1]), true[:, 2], limit=280.0, bound=bound, angle=5.0).speed
    share = np.linspace(0, 1, 4001) * len(path)
    for i in np.flatnonzero(~found.refused):
        assert found.speed[i] <= at[(share >= i) & (share <= i + 1)].min()
    assert 0.5 * len(path) < (~found.refused).sum() < len(path)


def test_joint_motion_that_pieces_cannot_follow_is_refused(tmp_path):
    robot = robot_named("ur10e").with_tool(mass=0.0, centre_of_mass=(0, 0, 0), contact_offset=(0, 0, 1e9))
    with pytest.raises(fm.InputError, match="straight pieces do not follow it") as error:
        fm.read_path(joint_file(tmp_path, np.array([np.zeros(6), np.ones(6)])), robot=robot)
    assert "\n" not in str(error.value)
    still = np.array([[0.0] * 6, [0.0] * 5 + [1.0]])
    with pytest.raises(fm.InputError, match="does not move"):
        fm.read_path(joint_file(tmp_path, still), robot=robot_named("ur10e"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x_m,y_m,z_m\n0.8,0,0.4\n0.8,0,0.4\n", "same place"),
        ("x_m,y_m,z_m\n0.8,0,0.4\n", "at least two"),
        ("x_m,y_m,z_m\n0.8,0,nan\n0.8,0,0.3\n", "expected a number"),
        ("x_m,y_m,z_m\n800,0,400\n800,0,300\n", "millimetres"),
        ("x_mm,y_mm,z_mm\n800,0,400\n800,0,300\n", "without its unit, or in another"),
        ("x_m,y_m,z_mm\n0.8,0,400\n0.8,0,300\n", "without its unit, or in another"),
        ("x_m,y_m,z_m,distance_m,height_m\n0.8,0,0.4,0.8,0.4\n0.8,0,0.3,0.8,0.3\n", "unknown column"),
        ("a,b\n1,2\n3,4\n", "unknown column"),
        ("time_s\n1\n2\n", "found no positions"),
        ("time_s,x_m,y_m,z_m\n1,0.8,0,0.4\n1,0.8,0,0.3\n", "row 3, column time_s: found 1, expected a time after"),
        ("segment,x_m,y_m,z_m\n,0.8,0,0.4\n,0.8,0,0.3\n", "found no name"),
        ("distance_m,height_m\n-0.8,0.4\n0.8,0.3\n", "negative distance"),
        ("joint_1_rad,joint_2_deg\n1,2\n3,4\n", "name their robot"),
        ("", "empty"),
    ],
)
def test_files_that_are_no_path(text, words, tmp_path):
    file = tmp_path / "path.csv"
    file.write_text(text)
    with pytest.raises(fm.InputError, match=words) as error:
        fm.read_path(file)
    assert "\n" not in str(error.value)


TASK = """schema = "forcemap-task/1"
acceleration_mps2 = 2
[campaign]
direction = "down"
tool = "none"
[[segments]]
name = "press"
areas = ["back_of_hand", "palm"]
clamping_possible = false
speed_mps = 0.25
[[segments]]
name = "lift"
contact_possible = false
speed_mps = 0.5
"""


def write(tmp_path, text):
    (tmp_path / "task.toml").write_text(text)
    return tmp_path / "task.toml"


def test_task_files(tmp_path):
    task = fm.read_task(write(tmp_path, TASK))
    press, lift = task.segments
    assert press == fm.TaskSegment("press", ("back_of_hand", "palm"), fm.Contact.TRANSIENT, 0.25)
    assert lift.contact is None
    assert task.acceleration == 2
    task.require_same(fm.published_map("ur10e").conditions)
    assert sentences(task.findings) == [
        "taken to be as in the campaign, not stated by the task: contact site, safety settings, payload"
    ]
    clamping = fm.read_task(write(tmp_path, TASK.replace("possible = false\nspeed_mps = 0.25", "possible = true")))
    assert clamping.segments[0].contact is fm.Contact.QUASI_STATIC


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("forcemap-task/1", "other", "expected schema"),
        ("acceleration_mps2 = 2", "acceleration = 2", "unknown entry"),
        ("acceleration_mps2 = 2", "acceleration_mps2 = 0", "positive number of at most 50"),
        ("acceleration_mps2 = 2", "acceleration_mps2 = nan", "finite number"),
        ('"palm"', '"plam"', "no body area"),
        ("clamping_possible = false", "", "can a person be clamped"),
        ("clamping_possible = false", "clamping_possible = 0", "true or false"),
        ("clamping_possible = false", 'clamping_possible = true\ncontact = "transient"', "not its limit"),
        ('areas = ["back_of_hand", "palm"]', "areas = []", "expected the body areas"),
        ("speed_mps = 0.5", "", "state its speed"),
        ("speed_mps = 0.5", "speed_mps = -0.5", "positive finite speed"),
        ("speed_mps = 0.5", 'speed_mps = 0.5\nareas = ["palm"]', "contact is not possible"),
        ('name = "lift"', 'name = "press"', "different names"),
        ("[[segments]]", "[[segment]]", "unknown entry"),
        ('tool = "none"', "tool = 3", "expected a text"),
        ('schema = "', "schema = ", "not a TOML file"),
    ],
)
def test_task_files_that_cannot_be_used(old, new, words, tmp_path):
    with pytest.raises(fm.InputError, match=words) as error:
        fm.read_task(write(tmp_path, TASK.replace(old, new)))
    assert "task.toml" in str(error.value)


def test_path_and_task_name_the_same_segments(tmp_path):
    task = fm.read_task(write(tmp_path, TASK))
    path = fm.ToolPath(np.array([[0.8, 0, 0.44], [0.8, 0, 0.3], [0.8, 0, 0.4]]), ("press", "left"))
    with pytest.raises(fm.InputError, match=r"'left'.*nearest: 'lift'"):
        fm.path_speeds(fm.published_map("ur10e"), path, task, bound=fm.FixedMargin())
    with pytest.raises(fm.InputError, match="'lift', which the path does not have"):
        fm.path_speeds(
            fm.published_map("ur10e"), fm.ToolPath(path.points[:2], ("press",)), task, bound=fm.FixedMargin()
        )


@pytest.mark.parametrize(
    ("key", "value"),
    [("direction", "forward"), ("contact_site", "flange"), ("tool", "gripper"), ("safety_settings", "another")],
)
def test_a_task_under_other_conditions_is_refused(key, value):
    task = fm.Task(HAND.segments, conditions={key: value})
    with pytest.raises(fm.InputError, match=key.replace("_", " ")):
        fm.path_speeds(fm.published_map("ur10e"), press(), task, bound=fm.FixedMargin())


def test_a_campaign_without_a_direction_answers_nothing(examples):
    from dataclasses import replace

    force_map = fm.fit_force_map(replace(examples["ur10e"], conditions=fm.Conditions()))
    with pytest.raises(fm.InputError, match="direction"):
        fm.path_speeds(force_map, press(), HAND, bound=fm.ToleranceBound())


@pytest.mark.parametrize(
    ("name", "contact", "bare", "with_margin", "paper"),
    [
        ("ur10e", fm.Contact.TRANSIENT, 0.3560, 0.3212, 0.36),
        ("ur10e", fm.Contact.QUASI_STATIC, 0.1590, 0.1381, 0.16),
        ("kuka-iiwa7-30nm", fm.Contact.TRANSIENT, None, None, None),
        ("kuka-iiwa7-30nm", fm.Contact.QUASI_STATIC, 0.1953, 0.1749, 0.20),
    ],
)
def test_the_papers_conclusion(name, contact, bare, with_margin, paper):
    """A task 0.8 m away and 0.4 m above the base: no speed the paper states is confirmed by its own map."""
    for margin, figure in ((0.0, bare), (0.10, with_margin)):
        found = fm.safe_speed(
            fm.published_map(name), 0.8, 0.4,
            limit=fm.force_limit("back_of_hand"), contact=contact, bound=fm.FixedMargin(margin),
        )  # fmt: skip
        if name == "ur10e" and contact is fm.Contact.TRANSIENT:
            assert found.outcome is fm.SpeedOutcome.ADMISSIBLE
            assert found.speed == pytest.approx(figure, abs=6e-5)
            assert found.speed < paper
        else:
            assert found.outcome is fm.SpeedOutcome.UNCONFIRMED
            if figure is not None:  # what would have to be measured
                assert found.extrapolated_speed == pytest.approx(figure, abs=6e-5)
                assert found.extrapolated_speed < paper


def test_what_a_path_deviates_from_its_points_adds_to_the_tolerance():
    """A path through joint values runs beside the chords between its points, by so much at most."""
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    for deviation, tolerance in ((0.02, 0.005), (0.001, 0.03), (0.05, 0.0)):
        bent = dataclasses.replace(press(), deviation=deviation)
        found = fm.path_speeds(ur10e, bent, HAND, bound=bound, allowance=fm.Allowance(position=tolerance))
        wide = fm.Allowance(position=tolerance + deviation)
        expected = fm.path_speeds(ur10e, press(), HAND, bound=bound, allowance=wide)
        straight = fm.path_speeds(ur10e, press(), HAND, bound=bound, allowance=fm.Allowance(position=tolerance))
        np.testing.assert_allclose(found.speed, expected.speed, rtol=1e-12)
        assert np.nanmin(found.speed) < np.nanmin(straight.speed)


@pytest.mark.parametrize(
    "joints",
    [
        [1, 2, 3, 4, 5],
        [1, 2, 3, 4, 5, 7],
        [0, 1, 2, 3, 4, 5],
        [2, 3, 4, 5, 6, 7],
        [1, 2, 3, 4, 5, 6, 7],
    ],
)
def test_joints_that_are_not_those_of_the_robot_are_refused(joints, tmp_path):
    (tmp_path / "path.csv").write_text(
        ",".join(f"joint_{i}_rad" for i in joints) + ("\n" + ",".join("0" for _ in joints)) * 2
    )
    with pytest.raises(fm.ForcemapError, match="joint"):
        fm.read_path(tmp_path / "path.csv", robot=robot_named("ur10e"))


def test_radians_beyond_two_turns_are_taken_for_degrees(tmp_path):
    for position, words in ((4 * math.pi + 0.01, "more than two turns"), (4 * math.pi - 0.01, "beyond the limits")):
        for side in (-1, 1):
            q = np.array([robot_named("ur10e").reference_posture] * 2)
            q[1, 0] = side * position
            with pytest.raises(fm.InputError, match=words):
                fm.read_path(joint_file(tmp_path, q), robot=robot_named("ur10e"))


def test_joints_stand_in_any_order_and_in_one_unit(tmp_path):
    """Radians up to two turns; what is more is in degrees."""
    robot, q = robot_named("ur10e"), np.array([[0.1, -1.2, 1.4, -0.3, 0.2, 0.5], [0.12, -1.18, 1.41, -0.28, 0.2, 0.5]])
    expected = fm.read_path(joint_file(tmp_path, q), robot=robot).points
    order = [3, 0, 5, 1, 4, 2]
    header = ",".join(f"joint_{i + 1}_rad" for i in order)
    other = tmp_path / "other.csv"
    other.write_text("\n".join([header, *(",".join(map(repr, row)) for row in q[:, order].tolist())]))
    np.testing.assert_allclose(fm.read_path(other, robot=robot).points, expected)
    other.write_text(other.read_text().replace("joint_1_rad", "joint_1_deg"))
    with pytest.raises(fm.InputError, match="all in _rad or all in _deg"):
        fm.read_path(other, robot=robot)
    degrees = np.degrees(q)
    with pytest.raises(fm.InputError, match="more than two turns"):
        fm.read_path(joint_file(tmp_path, degrees), robot=robot)


@pytest.mark.parametrize("unit", ["rad", "deg"])
@pytest.mark.parametrize("joint", range(6))
def test_a_joint_beyond_its_limits_is_named_with_its_row(joint, unit, tmp_path):
    """A millionth of a radian beyond is rounding; more is refused, on either side."""
    robot, factor = robot_named("ur10e"), 1.0 if unit == "rad" else math.degrees(1.0)
    file, header = tmp_path / "joints.csv", ",".join(f"joint_{i}_{unit}" for i in range(1, 7))
    for limit, side in ((robot.lower[joint], -1.0), (robot.upper[joint], 1.0)):
        q = np.tile(robot.reference_posture, (3, 1))
        q[:, joint] = limit - side * np.array([0.04, 0.02, 0.0])
        q[:, (joint + 1) % 6] += [0.0, 0.01, 0.02]
        for beyond in (0.9e-6, 1.1e-6):
            q[2, joint] = limit + side * beyond
            file.write_text("\n".join([header, *(",".join(map(repr, row)) for row in (factor * q).tolist())]))
            if beyond < 1e-6:
                assert len(fm.read_path(file, robot=robot)) >= 2
                continue
            with pytest.raises(fm.InputError, match="beyond the limits of") as error:
                fm.read_path(file, robot=robot)
            assert (error.value.row, error.value.column) == (4, f"joint_{joint + 1}_{unit}")


SLIDES = """<robot name="slides"><link name="base"/>
  <link name="carriage"><inertial><mass value="9"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
    </inertial></link>
  <link name="arm"><inertial><mass value="5"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    </link>
  <link name="quill"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    </link>
  <joint name="rail" type="prismatic"><parent link="base"/><child link="carriage"/><origin xyz="0.1 0.2 0.3"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="turn" type="revolute"><parent link="carriage"/><child link="arm"/><origin xyz="0 0 0.2"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="stroke" type="prismatic"><parent link="arm"/><child link="quill"/><origin xyz="0.4 0 0"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""


@pytest.mark.parametrize("slide", [0.004, 0.0101, 0.105, 0.109, 0.2])
def test_a_slide_is_cut_into_pieces_of_a_centimetre(slide, tmp_path):
    """A straight motion needs no pieces to be followed; what a joint does in one is limited all the same."""
    (tmp_path / "slides.urdf").write_text(SLIDES)
    robot = read_urdf(tmp_path / "slides.urdf")
    path = fm.read_path(joint_file(tmp_path, np.array([[0.0, 0.3, 0.1], [slide, 0.3, 0.1]])), robot=robot)
    assert len(path) == math.ceil(slide / 0.01)
    np.testing.assert_allclose(path.lengths, slide / len(path))
    assert path.turning.max() == 0


@pytest.mark.parametrize("turn", [0.08, 0.09, 0.5, 1.0])
def test_a_joint_turns_by_5_degrees_in_a_piece(turn, tmp_path):
    """The last joint turns about the contact point, which the first one moves a little."""
    robot = robot_named("ur10e")
    q = np.array([robot.reference_posture, robot.reference_posture])
    q[1] += [0.002, 0, 0, 0, 0, turn]
    assert len(fm.read_path(joint_file(tmp_path, q), robot=robot)) == math.ceil(math.degrees(turn) / 5)


@pytest.mark.parametrize("number", range(8))
def test_the_pieces_of_a_joint_motion_hold_what_they_state(number, tmp_path):
    """Against dense samples of drawn motions: how far one runs beside a piece, points away from it, and when."""
    rng = np.random.default_rng([64, number])
    (tmp_path / "slides.urdf").write_text(SLIDES)
    tool = {"mass": 0.0, "centre_of_mass": (0, 0, 0), "contact_offset": (0.1, 0.05, 0.1)}
    robot = (robot_named("ur10e") if number % 2 else read_urdf(tmp_path / "slides.urdf")).with_tool(**tool)
    n = len(robot.joints)
    start = robot.reference_posture if number % 2 else np.array([0.1, 0.3, 0.7])
    q = start + np.cumsum(rng.uniform(-0.15, 0.15, (4, n)), axis=0)
    clock = np.cumsum(rng.uniform(0.5, 2.0, 4))
    lines = [
        "time_s," + ",".join(f"joint_{i}_rad" for i in range(1, n + 1)),
        *(",".join(map(repr, [t, *row])) for t, row in zip(clock.tolist(), q.tolist(), strict=True)),
    ]
    (tmp_path / "joints.csv").write_text("\n".join(lines))
    path = fm.read_path(tmp_path / "joints.csv", robot=robot)
    assert path.deviation == 1e-4
    np.testing.assert_allclose([path.time[0], path.time[-1]], clock[[0, -1]])
    for i in range(len(path)):
        t = np.linspace(path.time[i], path.time[i + 1], 40)
        joints = np.stack([np.interp(t, clock, q[:, j]) for j in range(n)], axis=1)
        true = forward_kinematics(robot, joints).position
        np.testing.assert_allclose(true[[0, -1]], path.points[[i, i + 1]], atol=1e-9)
        along = path.directions[i]
        beside = true - true[0] - ((true - true[0]) @ along)[:, None] * along
        assert np.linalg.norm(beside, axis=1).max() <= path.deviation
        step = np.diff(true, axis=0)
        angle = np.degrees(np.arccos(np.clip(step @ along / np.linalg.norm(step, axis=1), -1, 1)))
        assert angle.max() <= path.turning[i] + 1e-3
        assert clock[path.rows[i]] <= path.time[i] + 1e-9
        assert path.time[i + 1] <= clock[path.rows[i] + 1] + 1e-9
        limits = [0.01 if joint.kind == "prismatic" else math.radians(5) for joint in robot.joints]
        assert (np.abs(joints[-1] - joints[0]) <= np.array(limits) * (1 + 1e-9)).all()
    assert path.turning.max() <= 1.5


@pytest.mark.parametrize("which", [0, 1, 3])
def test_a_point_twice_in_a_row_is_named(which):
    points = np.array([[0.8, 0.0, 0.4 - 0.01 * i] for i in range(6)])
    points[which + 1] = points[which] + [0.9e-6, 0.0, 0.0]
    with pytest.raises(fm.InputError, match=f"points {which + 1} and {which + 2} are the same place"):
        fm.ToolPath.through(points)
    points[which + 1] = points[which] + [1.1e-6, 0.0, 0.0]
    assert len(fm.ToolPath.through(points)) == 5


def test_a_coordinate_is_at_most_10_metres():
    assert len(fm.ToolPath.through([[10.0, 0, 0], [0, 0, -10.0]])) == 1
    for wrong in ([10.01, 0, 0], [0, -10.01, 0]):
        with pytest.raises(fm.InputError, match="at most 10 m"):
            fm.ToolPath.through([[0, 0, 0], wrong])


SHORT_TASK = 'schema = "forcemap-task/1"\n'
HIT = {"name": "a", "areas": ["palm"], "clamping_possible": False}
FREE = {"name": "b", "contact_possible": False, "speed_mps": 0.5}


def inline(value):
    """A value as TOML writes it, in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {inline(each)}" for key, each in value.items()) + "}"
    return "[" + ", ".join(map(inline, value)) + "]" if isinstance(value, list) else json.dumps(value)


@pytest.mark.parametrize(
    ("entries", "column", "words"),
    [
        ({}, "segments", "found no segment"),
        ({"segments": []}, "segments", "found no segment"),
        ({"segments": "press"}, "segments", "found no segment"),
        ({"segments": {}}, "segments", "found no segment"),
        ({"segments": [1, 2]}, "segments", "found no segment"),
        ({"segments": [HIT, 2]}, "segments", "found no segment"),
        ({"campaign": 3}, "campaign", "found no table"),
        ({"campaign": {"tol": "none"}}, "campaign.tol", "nearest known ones are tool"),
        ({"campaign": {"tool": ""}}, "campaign.tool", "expected a text"),
        ({"acceleration_mps2": True}, "acceleration_mps2", "expected a finite number"),
        ({"acceleration_mps2": "2"}, "acceleration_mps2", "expected a finite number"),
        ({"segments": [HIT, FREE | {"nam": "c"}]}, "segments[2].nam", "unknown entry"),
        ({"segments": [{"areas": ["palm"]}]}, "segments[1].name", "expected a text"),
        ({"segments": [HIT | {"name": 3}]}, "segments[1].name", "expected a text"),
        ({"segments": [HIT, FREE | {"speed_mps": True}]}, "segments[2].speed_mps", "finite number"),
        ({"segments": [HIT | {"areas": "palm"}]}, "segments[1].areas", "list of names"),
        ({"segments": [HIT | {"areas": ["palm", 3]}]}, "segments[1].areas", "list of names"),
        ({"segments": [FREE, HIT | {"areas": ["palm", "plam"]}]}, "segments[2].areas", "no body area"),
        ({"segments": [HIT | {"contact_possible": 1}]}, "segments[1].contact_possible", "true or false"),
        ({"segments": [FREE | {"areas": ["palm"]}]}, "segments[1]", "contact is not possible"),
        ({"segments": [FREE | {"contact": "transient"}]}, "segments[1]", "contact is not possible"),
        ({"segments": [FREE | {"clamping_possible": False}]}, "segments[1]", "contact is not possible"),
        ({"segments": [HIT | {"areas": []}]}, "segments[1].areas", "may be hit"),
        ({"segments": [{"name": "a", "areas": ["palm"]}]}, "segments[1].clamping_possible", "can a person be clamped"),
        ({"segments": [HIT | {"contact": 3}]}, "segments[1].contact", "expected a text"),
        (
            {"segments": [HIT | {"clamping_possible": True, "contact": "transient"}]},
            "segments[1].contact",
            "clamping is possible",
        ),
    ],
)
def test_a_task_file_says_which_entry_is_wrong(entries, column, words, tmp_path):
    entries = ({"segments": [HIT]} | entries) if entries else {}
    text = SHORT_TASK + "".join(f"{key} = {inline(value)}\n" for key, value in entries.items())
    with pytest.raises(fm.InputError, match=words) as error:
        fm.read_task(write(tmp_path, text))
    assert error.value.column == column


@pytest.mark.parametrize(
    ("clamping", "stated", "contact"),
    [
        (False, None, fm.Contact.TRANSIENT),
        (True, None, fm.Contact.QUASI_STATIC),
        (False, "transient", fm.Contact.TRANSIENT),
        (False, "quasi-static", fm.Contact.QUASI_STATIC),
        (True, "quasi-static", fm.Contact.QUASI_STATIC),
    ],
)
def test_a_segment_has_the_contact_that_it_states_or_that_clamping_gives(clamping, stated, contact, tmp_path):
    row = HIT | {"clamping_possible": clamping} | ({} if stated is None else {"contact": stated})
    task = fm.read_task(write(tmp_path, SHORT_TASK + f"segments = {inline([row, FREE])}\n"))
    assert [segment.contact for segment in task.segments] == [contact, None]
    assert math.isnan(task.segments[0].speed)
    assert (task.segments[1].speed, task.acceleration, task.conditions) == (0.5, 1.0, {})


@pytest.mark.parametrize("given", [{"acceleration": 0.0}, {"acceleration": math.inf}, {"segments": ()}])
def test_a_task_without_segments_or_with_an_acceleration_that_is_none_is_refused(given):
    with pytest.raises(fm.InputError, match="expected"):
        fm.Task(**({"segments": HAND.segments} | given))


@pytest.mark.parametrize("speed", [0.0, -0.1, math.inf])
def test_a_segments_speed_is_positive_and_finite(speed):
    with pytest.raises(fm.InputError, match="positive finite speed"):
        fm.TaskSegment("a", ("palm",), fm.Contact.TRANSIENT, speed)


def test_a_segment_has_areas_and_a_contact_or_neither():
    for areas, contact in (((), fm.Contact.TRANSIENT), (("palm",), None)):
        with pytest.raises(fm.InputError, match="or neither"):
            fm.TaskSegment("a", areas, contact, 0.1)


@pytest.mark.parametrize("seed", range(20))
def test_rows_that_show_more_than_the_tasks_acceleration_count_with_it_everywhere(seed):
    """A trapezoid with more acceleration than the task says: it is nowhere faster than what rows leave possible."""
    rng = np.random.default_rng(seed)
    acceleration, apart, top = rng.uniform(1.0, 5.0), rng.uniform(0.02, 0.1), 1.0
    ramp = max(top / acceleration, 4 * apart)  # of four rows at least
    top, cruise = acceleration * ramp, rng.uniform(0.3, 0.6)
    whole = 2 * ramp + cruise

    def speed(t):
        return np.clip(np.minimum(acceleration * t, acceleration * (whole - t)), 0, top)

    fine = np.linspace(0, whole, 20001)
    way = np.append(0, np.cumsum((speed(fine[1:]) + speed(fine[:-1])) / 2 * np.diff(fine)))
    rows = np.append(np.arange(0, whole - apart / 2, apart), whole)
    down = np.interp(rows, fine, way)
    position = np.column_stack([np.full(rows.size, 0.7), np.zeros(rows.size), 3.0 - down])
    path = fm.ToolPath(position, ("press",) * (rows.size - 1), time=rows)
    possible = path.fastest_speeds(0.5)
    for first, last, most in zip(rows[:-1], rows[1:], possible, strict=True):
        assert speed(np.linspace(first, last, 50)).max() <= most + 1e-6
    assert path.shown_acceleration <= acceleration + 1e-3


@pytest.mark.parametrize(
    ("first", "last", "said"),
    [("0.5", "0.38", True), ("", "0.38", False), ("0.5", "0.44", False)],  # not stated; it ends where it began
)
def test_a_list_of_waypoints_says_that_the_way_back_is_not_looked_at(first, last, said, tmp_path):
    rows = [f"0.8,0,0.44,press,{first}", f"0.8,0,0.38,{'lift' if last == '0.44' else ''},0.2"]
    rows += ["0.8,0,0.44,,0.5"] * (last == "0.44")
    (tmp_path / "path.csv").write_text("x_m,y_m,z_m,segment,speed_to_point_mps\n" + "\n".join(rows) + "\n")
    path = fm.read_path(tmp_path / "path.csv")
    assert [each.kind.value for each in path.doubts] == ["way_back"] * said
    task = one_segment_task("press", ("back_of_hand",), fm.Contact.TRANSIENT)
    task = (
        dataclasses.replace(task, segments=(*task.segments, fm.TaskSegment("lift", (), None, 0.5)))
        if last == "0.44"
        else task
    )
    found = fm.path_speeds(fm.published_map("ur10e"), path, task, bound=fm.FixedMargin())
    assert ("way_back" in [each.kind.value for each in found.doubts]) is said


DESCENT = [
    [167.426755, -77.340961, 100.192256, -112.851296, -90.000000, 0.000000],
    [167.426755, -74.841606, 103.662861, -118.821256, -90.000000, 0.000000],
]
"""Joints of a UR10e [deg], its flange straight down at a distance of 0.8 m."""


@pytest.mark.parametrize(
    ("site", "stated", "said"),
    [("gripper finger", (), True), ("flange", (), False), ("gripper finger", ("0,0,0.1",), False)],
)
def test_a_path_of_the_flange_is_not_taken_for_that_of_another_contact_site(site, stated, said, tmp_path):
    joints = np.array(DESCENT)
    header = ",".join(f"joint_{i}_deg" for i in range(1, 7))
    (tmp_path / "path.csv").write_text(
        header + "\n" + "\n".join(",".join(map(repr, q)) for q in joints.tolist()) + "\n"
    )
    conditions = dataclasses.replace(fm.published_map("ur10e").conditions, contact_site=site)
    force_map = dataclasses.replace(fm.published_map("ur10e"), conditions=conditions)
    path = task_options.path_from(str(tmp_path / "path.csv"), ["ur10e", *stated])
    task = one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT)
    found = fm.path_speeds(force_map, path, task, bound=fm.FixedMargin())
    assert ("site_not_at_flange" in [each.kind.value for each in found.doubts]) is said


def test_a_task_says_that_it_does_not_state_the_payload(tmp_path):
    """The flange that was measured was empty; a part that is carried counts."""

    def unstated(text):
        return fm.read_task(write(tmp_path, text)).findings[0].figure("missing")

    assert unstated(TASK) == "contact site, safety settings, payload"
    assert (
        unstated(TASK.replace('tool = "none"\n', 'tool = "none"\npayload_kg = 0.5\n'))
        == "contact site, safety settings"
    )
    of_segment = TASK.replace("speed_mps = 0.25\n", "speed_mps = 0.25\npayload_kg = 0.5\n", 1)
    assert unstated(of_segment) == "contact site, safety settings"
