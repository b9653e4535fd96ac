"""The commands path, place and export, as a person or a program calls them."""

from __future__ import annotations

import csv
import dataclasses
import hashlib
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import forcemap as fm
from forcemap.answers.path import PathAnswer
from forcemap.cli.app import run
from forcemap.cli.export import Format
from forcemap.cli.path import path_lines
from forcemap.dynamics.inverse_kinematics import inverse_kinematics
from forcemap.maps.measured_range import MeasuredRange
from forcemap.paths.atlas import Atlas, AtlasMap
from forcemap.paths.path_file import moved_csv
from forcemap.paths.task import one_segment_task
from robot_programs import urscript_function

HAND = ["--area", "back_of_hand", "--contact", "transient"]
TASK = """schema = "forcemap-task/1"
acceleration_mps2 = 2.0
[campaign]
direction = "down"
[[segments]]
name = "press"
areas = ["back_of_hand"]
clamping_possible = false
speed_mps = 0.4
[[segments]]
name = "lift"
contact_possible = false
speed_mps = 0.5
"""


@pytest.fixture(autouse=True)
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "path.csv").write_text("x_m,y_m,z_m,segment\n0.8,0,0.44,press\n0.8,0,0.36,lift\n0.8,0,0.44,lift\n")
    (tmp_path / "press.csv").write_text("x_m,y_m,z_m\n0.8,0,0.44\n0.8,0,0.36\n")
    (tmp_path / "table.csv").write_text("x_m,y_m,z_m\n0,0,0.05\n0,0,0\n")
    (tmp_path / "task.toml").write_text(TASK)


def capsys_cleared(capsys):
    capsys.readouterr()
    return capsys


def result(capsys, *arguments, code=0):
    assert run([*arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def test_path_says_where_it_must_slow_down(capsys):
    assert run(["path", "ur10e", "path.csv", "--task", "task.toml"]) == 1  # every piece permitted, but too fast
    text = capsys.readouterr().out
    assert "0.400 !" in text
    assert "TOO FAST where marked !" in text
    assert "the standard's one speed" in text
    assert "position tolerance 0.005 m" in text
    found = result(capsys, "path", "ur10e", "path.csv", "--task", "task.toml", code=1)
    assert (found["permitted"], found["too_fast"], found["programmed"]) == (True, True, True)
    assert {piece["outcome"] for piece in found["pieces"]} == {"admissible", "no_contact"}
    assert all(piece["too_fast"] == (piece["segment"] == "press") for piece in found["pieces"])
    assert found["cycle_times"][0]["rule"] == "allowed speeds"
    *_, program, slowed = found["cycle_times"]
    assert (program["rule"], slowed["rule"]) == ("as programmed", "as programmed, slowed where too fast")
    assert (found["acceleration_mps2"], found["timed"], found["inside"]) == (2.0, False, [])
    both = f"({slowed['cycle_time_s']:.3f} s so slowed, {program['cycle_time_s']:.3f} s as programmed)"
    assert both in " ".join(text.split())
    assert "cycle time at (at most 2 m/s^2)" in text
    assert "by the file's times" not in text
    assert found["contact_excluded"] is True
    assert "where contact is excluded, every row is at the task's speed" in text
    assert found["map_sha256"] == fm.map_sha256(fm.published_map("ur10e"))


def test_a_verdict_says_what_is_refused_and_what_is_too_fast(capsys, tmp_path):
    areas = 'areas = ["back_of_hand"]\nclamping_possible = false'
    (tmp_path / "both.toml").write_text(TASK.replace("contact_possible = false", areas))
    assert run(["path", "ur10e", "path.csv", "--task", "both.toml"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert out.startswith("NOT PERMITTED on 50 % of the path; there the robot must not")
    assert "; TOO FAST where marked !, on 50 % of the path: slow down to the allowed speed there;" in out
    assert "! programmed faster than this path may be driven there" in out
    (tmp_path / "slow.toml").write_text(TASK.replace("speed_mps = 0.4", "speed_mps = 0.2"))
    assert run(["path", "ur10e", "path.csv", "--task", "slow.toml"]) == 0
    assert "! programmed" not in capsys.readouterr().out


def test_exit_code_0_means_permitted_and_not_too_fast(capsys, tmp_path):
    (tmp_path / "slow.toml").write_text(TASK.replace("speed_mps = 0.4", "speed_mps = 0.2"))
    assert run(["path", "ur10e", "path.csv", "--task", "slow.toml"]) == 0
    assert "permitted as programmed" in capsys.readouterr().out
    (tmp_path / "none.toml").write_text(TASK.replace("speed_mps = 0.4", ""))
    assert run(["path", "ur10e", "path.csv", "--task", "none.toml"]) == 0
    assert "not compared with a program, which is not stated" in " ".join(capsys.readouterr().out.split())
    assert result(capsys, "path", "ur10e", "path.csv", "--task", "none.toml")["programmed"] is False
    (tmp_path / "timed.csv").write_text("time_s,x_m,y_m,z_m\n0,0.8,0,0.44\n0.4,0.8,0,0.36\n")  # 0.2 m/s on average
    found = result(capsys, "path", "ur10e", "timed.csv", *HAND, code=1)
    assert [piece["programmed_speed_mps"] for piece in found["pieces"]] == pytest.approx([0.4] * 4)
    assert found["timed"] is True
    assert run(["path", "ur10e", "timed.csv", *HAND]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "by the file's times; the other rows computed with at most 1 m/s^2, state yours (acceleration_mps2 in" in out
    rows = "".join(f"{t / 50:.3f},0.8,0,{0.44 - 0.2 * t / 50:.6f}\n" for t in range(21))
    (tmp_path / "timed.csv").write_text(f"time_s,x_m,y_m,z_m\n{rows}")
    assert result(capsys, "path", "ur10e", "timed.csv", *HAND)["too_fast"] is False


@pytest.mark.parametrize(
    ("column", "doubt"),
    [
        (None, "NOTHING SAYS THAT THE TIMES OF THE PATH ARE OF A RUN AT FULL SPEED"),
        (("speed_scaling", "1.0"), None),
        (("target_speed_fraction", "1.0"), None),
        (("Override_%", "100"), None),
        (("speed_scaling_requested", "1.0"), "NOTHING SAYS THAT THE TIMES OF THE PATH ARE OF A RUN AT FULL SPEED"),
        (("speed_scaling", "half"), "NOTHING SAYS THAT THE TIMES OF THE PATH ARE OF A RUN AT FULL SPEED"),
        (("speed_scaling", "0.5"), "THE LOG MAY BE OF A SLOWED RUN"),
        (
            ("robot_mode,speed_scaling", "MANUAL_REDUCED_SPEED,1.0"),
            "NOTHING SAYS THAT THE TIMES OF THE PATH ARE OF A RUN",
        ),
        (("mode,speed_scaling", "T1 mode,1.0"), "NOTHING SAYS THAT THE TIMES OF THE PATH ARE OF A RUN"),
        (("mode,speed_scaling", "AUTOMATIC,1.0"), None),
        (("mode", "T1"), "NOTHING SAYS THAT THE TIMES OF THE PATH ARE OF A RUN AT FULL SPEED"),
    ],
)
@pytest.mark.parametrize("joints", [False, True])
def test_times_of_a_path_are_doubted_unless_a_column_tells_that_they_are_of_a_run_at_full_speed(
    column, doubt, joints, capsys, tmp_path
):
    """As those of a log: at half the speed of its program a run looks permitted."""
    at = np.arange(21) / 50
    points = np.column_stack([np.full(21, 0.8), np.zeros(21), 0.44 - 0.2 * at])
    names, rows, more = "x_m,y_m,z_m", points, ()
    if joints:
        robot = fm.robot_named("ur10e")
        rows = inverse_kinematics(robot, points, tool_direction=(0.0, 0.0, -1.0)).positions
        names = ",".join(f"joint_{i}_rad" for i in range(1, 7))
        more = ("--robot", "ur10e", "--contact-offset-m", "0,0,0")
    head = ",".join([names, "time_s", *(column[:1] if column else ())])
    lines = [",".join(map(str, [*row, t, *(column[1:] if column else ())])) for row, t in zip(rows, at, strict=True)]
    (tmp_path / "timed.csv").write_text("\n".join([head, *lines]))
    found = result(capsys, "path", "ur10e", "timed.csv", *HAND, *more)
    said = [each for each in found["warnings"] if "FULL SPEED" in each or "SLOWED RUN" in each]
    assert [each.startswith(doubt) for each in said] == [True] if doubt else said == []


@pytest.mark.parametrize("unit", ["ms", "s"])
def test_times_in_another_unit_are_no_slow_program(unit, capsys, tmp_path):
    rows = "".join(f"{0.8},0,{0.44 - 0.25 * t},{1000 * t if unit == 'ms' else t}\n" for t in np.arange(40) * 0.008)
    (tmp_path / "timed.csv").write_text(f"x_m,y_m,z_m,time_s\n{rows}")
    code = run(["path", "ur10e", "timed.csv", *HAND])
    words = "between two rows by their times, expected 0.001 m/s and more: are the times in seconds"
    assert (code == 2) is (unit == "ms") is (words in capsys.readouterr().err)


@pytest.mark.parametrize(("given", "permitted"), [("2000", False), ("51", False), ("50", True)])
def test_an_acceleration_in_another_unit_is_refused_by_task_and_option(given, permitted, capsys, tmp_path):
    """With 2000 a robot that brakes with 2 m/s^2 enters the segment with contact at 0.75 m/s in place of 0.31."""
    (tmp_path / "fast.toml").write_text(TASK.replace("acceleration_mps2 = 2.0", f"acceleration_mps2 = {given}"))
    for command in (["--task", "fast.toml"], [*HAND, "--acceleration-mps2", given]):
        code = run(["path", "ur10e", "path.csv", *command])
        words = f"found {given}, expected a positive number of at most 50 m/s^2 (metres, not millimetres)"
        assert (code == 2) is not permitted
        assert (words in capsys.readouterr().err) is not permitted


def test_a_position_tolerance_that_stands_for_blends_is_said_to_cover_no_direction(capsys, tmp_path):
    task = '[[segments]]\nname = "carry"\ncontact_possible = false\nspeed_mps = 0.2\n'
    (tmp_path / "blend.toml").write_text(
        'schema = "forcemap-task/1"\n[[segments]]\nname = "press"\nareas = ["back_of_hand"]\n'
        f"clamping_possible = false\nspeed_mps = 0.2\n{task}"
    )
    rows = "0.8,0,0.42,press\n0.8,0,0.38,carry\n0.86,0,0.38,\n"
    (tmp_path / "blend.csv").write_text(f"x_m,y_m,z_m,segment\n{rows}")
    for tolerance, said in (("0.005", False), ("0.03", True)):
        ask = ["path", "ur10e", "blend.csv", "--task", "blend.toml", "--position-tolerance-m", tolerance]
        warnings = result(capsys, *ask)["warnings"]
        corner = "the path turns by up to 90 degrees within or beside motion with contact (1 times)"
        assert any(corner in each for each in warnings) is said


@pytest.mark.parametrize("every_ms", [12, 20])
def test_a_log_without_the_row_of_a_corner_is_told_so_and_not_to_exclude_contact(capsys, tmp_path, every_ms):
    """The descent ends at 0.384 s, where a row lies every 12 ms but not every 20."""
    at = [k * every_ms / 1000 for k in range(int(0.7 / every_ms * 1000))]
    height = [0.44 - 0.2 * t if t <= 0.384 else 0.44 - 0.2 * 0.384 + 0.2 * (t - 0.384) for t in at]
    names = ["down" if t <= 0.384 else "up" for t in at]
    rows = "".join(f"{t:.3f},0.8,0,{z:.6f},{name}\n" for t, z, name in zip(at, height, names, strict=True))
    (tmp_path / "log.csv").write_text(f"time_s,x_m,y_m,z_m,segment\n{rows}")
    (tmp_path / "log.toml").write_text(
        'schema = "forcemap-task/1"\n[[segments]]\nname = "down"\nareas = ["back_of_hand"]\nclamping_possible = false\n'
        '[[segments]]\nname = "up"\ncontact_possible = false\nspeed_mps = 0.3\n'
    )
    run(["path", "ur10e", "log.csv", "--task", "log.toml"])
    out = " ".join(capsys.readouterr().out.split())
    corner = "if the robot turned there, the row of the corner is missing or has the name of the other motion"
    assert (corner in out) == ("not_downward" in out)
    if every_ms == 20:  # the last row down lies above the first one up: it points up
        assert "mm of down where it meets another segment, 0.380 s after the first row: if the robot" in out
        assert "contact_possible = false" not in out
        assert "outside: move the path" not in out
        assert "To close the gaps" not in out
        high = "0.0,0.8,0,0.80,high\n1.0,0.8,0,0.70,high\n1.9,0.8,0,0.44,high\n"  # begins above the measured range
        later = re.sub(r"^([\d.]+)", lambda time: f"{float(time[1]) + 2:.3f}", rows, flags=re.MULTILINE)
        (tmp_path / "high.csv").write_text(f"time_s,x_m,y_m,z_m,segment\n{high}{later}")
        (tmp_path / "high.toml").write_text(
            (tmp_path / "log.toml").read_text()
            + '[[segments]]\nname = "high"\nareas = ["back_of_hand"]\nclamping_possible = false\n'
        )
        run(["path", "ur10e", "high.csv", "--task", "high.toml"])
        out = " ".join(capsys.readouterr().out.split())
        assert corner in out
        assert "outside: move the path into the measured range" in out
        assert "contact_possible = false" not in out
    (tmp_path / "whole.csv").write_text(f"time_s,x_m,y_m,z_m,segment\n{rows}")
    run(["path", "ur10e", "whole.csv", "--area", "back_of_hand", "--contact", "transient"])
    out = " ".join(capsys.readouterr().out.split())
    assert "contact_possible = false" in out  # of a whole way up it stays the advice
    assert "no permission, the motion points" in out


@pytest.mark.parametrize("log", ["corner", "misnamed", "slide aside", "slide ahead", "long", "after a refusal"])
def test_only_what_points_between_two_motions_may_be_a_corner_without_its_row(capsys, tmp_path, log):
    """A descent to 0.36 m, then outwards; the last piece of the descent is the one in question."""
    piece = {"slide aside": (0, 0.001, 0), "slide ahead": (0.002, 0, 0), "long": (0.004, 0, -0.004)}
    piece |= {"misnamed": (0.0001, 0, 0)}  # the first row of the next motion, by the name of the one before
    start, end = np.array([0.8, 0.0, 0.36]), np.array([0.8, 0.0, 0.36]) + piece.get(log, (0.001, 0, -0.001))
    top = start + ((0.0, 0.08, 0.0) if log == "after a refusal" else (0.0, 0.0, 0.08))
    way = [(top, "down"), (start, "down"), (end, "out"), (end + np.array([0.05, 0.0, 0.0]), "")]
    rows = "".join(f"{k},{','.join(f'{x:.5f}' for x in point)},{name}\n" for k, (point, name) in enumerate(way))
    (tmp_path / "log.csv").write_text(f"time_s,x_m,y_m,z_m,segment\n{rows}")
    (tmp_path / "log.toml").write_text(
        'schema = "forcemap-task/1"\n[[segments]]\nname = "down"\nareas = ["back_of_hand"]\nclamping_possible = false\n'
        '[[segments]]\nname = "out"\ncontact_possible = false\nspeed_mps = 0.3\n'
    )
    assert run(["path", "ur10e", "log.csv", "--task", "log.toml", "--position-tolerance-m", "0.01"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert ("if the robot turned there" in out) == (log in ("corner", "misnamed"))
    partly = "only a part of down points another way: do not exclude contact on all of it"
    assert (partly in out) == (log not in ("corner", "misnamed", "after a refusal"))
    assert ("contact_possible = false" in out) == (log == "after a refusal")


@pytest.mark.parametrize(
    ("first", "told"),
    [((0.0001, 0, 0), True), ((0.001, 0, -0.001), True), ((0, 0.001, 0), False), ((0.003, 0, 0), False)],
    ids=["named early", "corner", "aside", "long"],
)
def test_a_row_named_after_the_motion_that_follows_is_found_by_its_time(capsys, tmp_path, first, told):
    """Outwards, a wait of 1 s, then a descent of 80 mm; the first piece of the descent is the one in question."""
    end = np.array([0.8, 0.0, 0.44])
    turn, rows = end - np.array(first), ["0,0.7,0,0.44,out"]
    for time, point, name in [(1, turn, "down"), (2, turn, "down"), (2.1, end, "down"), (3, end - [0, 0, 0.08], "")]:
        rows.append(f"{time},{','.join(f'{x:.5f}' for x in point)},{name}")
    (tmp_path / "log.csv").write_text("time_s,x_m,y_m,z_m,segment\n" + "".join(f"{row}\n" for row in rows))
    (tmp_path / "log.toml").write_text(
        'schema = "forcemap-task/1"\n[[segments]]\nname = "down"\nareas = ["back_of_hand"]\nclamping_possible = false\n'
        '[[segments]]\nname = "out"\ncontact_possible = false\nspeed_mps = 0.3\n'
    )
    ask = ["path", "ur10e", "log.csv", "--task", "log.toml", "--position-tolerance-m", "0.01"]
    assert run(ask) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert ("of down where it meets another segment, 2.000 s after the first row: if the robot turned" in out) is told
    assert "2.000 s after the first row: no permission" in out
    assert run([*ask, "--json"]) == 1
    pieces = json.loads(capsys.readouterr().out)["pieces"]
    starts = {piece["segment"]: piece["time_s"] for piece in reversed(pieces)}
    assert starts == {"out": 0.0, "down": 2.0}


@pytest.mark.parametrize(("apart", "mm"), [(0.04, 0), (0.4, 20)])
def test_a_log_whose_rows_are_too_far_apart_to_tell_where_it_turned_is_told_so(capsys, tmp_path, apart, mm):
    """Down by at most 80 mm and up again, 1 m/s^2."""
    time = np.arange(0.0, 1.21, apart)
    rows = "".join(f"{t:.3f},0.8,0,{0.36 + 0.08 * abs(t - 0.63) / 0.63:.5f},move\n" for t in time)
    (tmp_path / "log.csv").write_text(f"time_s,x_m,y_m,z_m,segment\n{rows}")
    run(["path", "ur10e", "log.csv", *HAND, "--acceleration-mps2", "1"])
    out = " ".join(capsys.readouterr().out.split())
    assert ("APART WHERE THE MOTION TURNS" in out) == (mm > 0)
    for form in ("scaling", "safety"):  # and so is what a robot takes
        file = tmp_path / f"{apart}-{form}"
        run(["export-path", "ur10e", "log.csv", *HAND, "--format", form, "-o", str(file)])
        out = " ".join(capsys.readouterr().out.split())
        assert ("APART WHERE THE MOTION TURNS" in out) == ("APART WHERE THE MOTION" in file.read_text()) == (mm > 0)


@pytest.mark.parametrize(("gap", "told"), [(0.05, False), (3.0, True)])
def test_a_gap_at_whose_ends_a_log_is_at_the_same_place_is_none_that_stands(capsys, tmp_path, gap, told):
    """Down, 3 s without a row or with one every 0.05 s, and up again."""
    down, up = np.linspace(0.44, 0.40, 9), np.linspace(0.40, 0.44, 9)
    stand = np.full(round(3.0 / gap), 0.40)
    time = np.cumsum([0.0, *[0.05] * 8, *[gap] * stand.size, *[0.05] * 8])
    height = [*down, *stand, *up[1:]]
    rows = "".join(f"{t:.3f},0.8,0,{z:.5f},move\n" for t, z in zip(time, height, strict=True))
    (tmp_path / "log.csv").write_text(f"time_s,x_m,y_m,z_m,segment\n{rows}")
    run(["path", "ur10e", "log.csv", *HAND])
    out = " ".join(capsys.readouterr().out.split())
    assert ("ROWS ARE 3 s APART WHERE THE MOTION TURNS" in out) == told
    assert "the file's waits, 3.000 s, are in every row" in out


def test_a_log_that_is_slowed_nowhere_takes_what_it_took(capsys, tmp_path):
    rows = "".join(f"{t / 50:.3f},0.8,0,{0.44 - 0.2 * t / 50:.6f}\n" for t in range(21))
    (tmp_path / "timed.csv").write_text(f"time_s,x_m,y_m,z_m\n{rows}")
    assert run(["export-path", "ur10e", "timed.csv", *HAND, "-o", str(tmp_path / "scaling.csv")]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "0 of them slowed down, 0.400 s as logged (" in out
    assert "braking ahead" not in out
    (tmp_path / "fast.csv").write_text(f"time_s,x_m,y_m,z_m\n{rows}".replace("0.400,", "0.390,"))
    assert run(["export-path", "ur10e", "fast.csv", *HAND, "-o", str(tmp_path / "scaling.csv")]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert re.search(
        r"[12] of them slowed down.*, 0\.39\d s as logged, slowed where too fast \(.* keep the corners", out
    )


def test_path_says_where_the_slowest_place_is_and_by_which_limit(capsys, tmp_path):
    for task in ("task.toml", "excluded.toml"):
        (tmp_path / "excluded.toml").write_text(
            TASK.replace('areas = ["back_of_hand"]\nclamping_possible = false', "contact_possible = false")
        )
        assert run(["path", "ur10e", "path.csv", "--task", task]) in (0, 1)
        out = " ".join(capsys.readouterr().out.split())
        found = result(capsys, "path", "ur10e", "path.csv", "--task", task, code=int(task == "task.toml"))
        press = [piece for piece in found["pieces"] if piece["outcome"] == "admissible"]
        if not press:
            assert found["slowest"] is None
            assert "slowest:" not in out
            continue
        lowest = min(press, key=lambda piece: piece["speed_to_program_mps"])
        named = ("segment", "from_m", "to_m", "outcome", "speed_to_program_mps", "governed_by", "map_name", "limit_N")
        assert found["slowest"] == {name: lowest[name] for name in named}
        (_, _, low), (_, _, lower) = lowest["from_m"], lowest["to_m"]
        speed = fm.floor_speed(lowest["speed_to_program_mps"])
        assert f"slowest: {speed} m/s on press from 0.800, {low:.3f} to 0.800, {lower:.3f}: 280 N, back_of_hand" in out


@pytest.mark.parametrize(
    ("seconds", "by_mean", "words"), [(0.4, 0.0, "(nowhere by the mean"), (0.2, 0.08, "on 100 % of the path: slow")]
)
def test_a_log_that_is_too_fast_by_its_means_or_by_what_its_rows_leave_open(capsys, tmp_path, seconds, by_mean, words):
    (tmp_path / "timed.csv").write_text(f"time_s,x_m,y_m,z_m\n0,0.8,0,0.44\n{seconds},0.8,0,0.36\n")
    found = result(capsys, "path", "ur10e", "timed.csv", *HAND, code=1)
    assert found["too_fast_length_m"] == pytest.approx(0.08)
    assert found["too_fast_by_mean_length_m"] == pytest.approx(by_mean)
    assert run(["path", "ur10e", "timed.csv", *HAND]) == 1
    assert words in " ".join(capsys.readouterr().out.split())


def test_an_untimed_path_has_no_means(capsys):
    found = result(capsys, "path", "ur10e", "path.csv", "--task", "task.toml", code=1)
    assert found["too_fast_by_mean_length_m"] is None


def test_of_several_limits_each_one_says_how_many_zones_it_permits_alone(capsys, tmp_path):
    also = '[[segments]]\nname = "lift"\nareas = ["thigh_muscle"]\nclamping_possible = true\n'
    (tmp_path / "two.toml").write_text(TASK.partition('[[segments]]\nname = "lift"')[0] + also)
    assert run(["export", "ur10e", "--format", "urscript", "--task", "two.toml", "-o", "x.script"]) in (0, 1)
    out = " ".join(capsys.readouterr().out.split())
    assert "every limit holds in every zone, as zones know no segments" in out
    for area, contact, limit in (("back_of_hand", "transient", "280 N"), ("thigh_muscle", "quasi-static", "220 N")):
        case = ["export", "ur10e", "--format", "json", "--area", area, "--contact", contact]
        assert run([*case, "-o", "one.json"]) in (0, 1)
        assert "every limit holds" not in capsys.readouterr().out
        zones = json.loads(Path("one.json").read_text())["zones"]
        alone = sum(zone["speed_to_program_mps"] > 0 for zone in zones)
        assert f"{alone} of {len(zones)}: {limit}, {contact} contact, {area}" in out


def test_a_path_that_is_not_exported_says_which_segment_and_what_to_do(capsys):
    assert run(["export-path", "kuka-iiwa7-30nm", "press.csv", *HAND, "-o", "x.csv"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert out.startswith("nothing is exported: no transient limit may be used")
    assert "path: no transient limit may be used" in out
    assert "ask for the quasi-static limit there (--contact quasi-static" in out
    assert not Path("x.csv").exists()


def test_where_the_standards_one_speed_is_not_permitted_stands_beside_its_time(capsys, tmp_path):
    """In `place` as in `path`, and where a part of the path has no permission at all."""
    near = ["place", "ur10e", "table.csv", *HAND, "--step-m", "0.1", "-o", "moved.csv"]
    (tmp_path / "table.csv").write_text("x_m,y_m,z_m,segment\n0,0,0.2,a\n0,0,0.14,b\n-0.1,0,0.2,a\n-0.1,0,0.14,\n")
    task = TASK.replace('"press"', '"a"').replace('"lift"', '"b"').replace("speed_mps = 0.4", "")
    (tmp_path / "b.toml").write_text(task)
    case = [*near[:3], "--task", "b.toml", *near[-4:]]
    best = result(capsys, *case)
    found = result(capsys, "path", "ur10e", "moved.csv", "--task", "b.toml")
    standard = found["cycle_times"][1]["speed_mps"]
    possible = [piece for piece in found["pieces"] if piece["outcome"] != "no_contact"]
    slower = sum(piece["length_m"] for piece in possible if piece["speed_to_program_mps"] < standard)
    assert best["standard_beyond_share"] == pytest.approx(slower / found["length_m"])
    assert found["standard_beyond_share"] == pytest.approx(best["standard_beyond_share"])
    assert run(case) == 0
    out = " ".join(capsys.readouterr().out.split())
    words = f"the map does not permit {{}}on {100 * best['standard_beyond_share']:.0f} % of the path"
    assert slower > 0
    assert f"which {words.format('')}" in out
    assert words.format("the standard's one speed ") in out
    partly = result(capsys, "path", "ur10e", "path.csv", *HAND, code=1)
    refused = sum(piece["length_m"] for piece in partly["pieces"] if not (piece["speed_mps"] or 0) >= standard)
    assert 0 < partly["standard_beyond_share"] == pytest.approx(refused / partly["length_m"])
    assert run(["path", "ur10e", "path.csv", *HAND]) == 1
    assert "the map does not permit the standard's one speed on" in " ".join(capsys.readouterr().out.split())


def test_a_scaling_file_moves_as_a_whole(tmp_path):
    """Both ends of every piece, so that it is the path at another place."""
    assert run(["export-path", "ur10e", "press.csv", *HAND, "-o", "s.csv"]) == 0
    (tmp_path / "moved.csv").write_text(moved_csv("s.csv", 0.05, -0.02))
    there, moved = (fm.read_path(tmp_path / name).points for name in ("s.csv", "moved.csv"))
    np.testing.assert_allclose(moved - there, np.tile([0.05, 0.0, -0.02], (len(there), 1)), atol=1e-9)


def test_place_writes_the_path_as_it_lies_at_the_best_position(capsys, tmp_path):
    best = result(capsys, "place", "ur10e", "table.csv", *HAND, "--step-m", "0.1", "-o", "moved.csv")
    assert best["file"] == "moved.csv"
    found = result(capsys, "path", "ur10e", "moved.csv", *HAND)
    assert found["cycle_times"][0]["cycle_time_s"] == pytest.approx(best["best"]["cycle_time_s"], abs=1e-9)
    (x, _, z), *_ = (piece["from_m"] for piece in found["pieces"])
    assert (x, z) == pytest.approx((best["best"]["distance_m"], best["best"]["height_m"] + 0.05))
    assert run(["place", "ur10e", "table.csv", *HAND, "--step-m", "0.1", "-o", "moved.csv"]) == 0
    assert "moved.csv: the path moved there, in the frame of the base" in " ".join(capsys.readouterr().out.split())
    (tmp_path / "fast.csv").write_text("x_m;y_m;z_m;segment;speed_mps\n0;0;0,05;path;0,5\n0;0;0;path;0,5\n")
    line = ["place", "ur10e", "fast.csv", *HAND, "--step-m", "0.1"]
    assert run([*line, "-o", "moved.csv"]) == 0  # an earlier result is replaced
    assert result(capsys_cleared(capsys), "path", "ur10e", "moved.csv", *HAND, code=1)["too_fast"]
    for own in ("fast.csv", "press.csv"):
        before = (tmp_path / own).read_bytes()
        assert run([*line, "-o", own]) == 2
        assert "it is not overwritten" in capsys.readouterr().err
        assert (tmp_path / own).read_bytes() == before
    (tmp_path / "plane.csv").write_text("distance_m,height_m,time_s\n0,0.05,0\n0,0,1.5\n")
    assert run(["place", "ur10e", "plane.csv", *HAND, "--step-m", "0.1", "-o", "plane-moved.csv"]) == 0
    assert fm.read_path("plane-moved.csv").time.tolist() == [0.0, 1.5]
    capsys.readouterr()
    none = result(capsys, "place", "kuka-iiwa7-30nm", "table.csv", *HAND, "--step-m", "0.2", "-o", "none.csv", code=1)
    assert none["file"] is None
    assert not (tmp_path / "none.csv").exists()


def test_the_sheet_of_a_path_advises_no_option_that_it_lacks(capsys):
    line = ["ur10e", "press.csv", *HAND, "--format", "safety", "-o", "sheet.md"]
    assert run(["export-path", *line]) in (0, 1)
    out = capsys.readouterr().out
    assert "--angle-deg 0" in out
    assert "--zone-m" not in out


def test_a_refused_path_is_a_no_and_invents_no_time(capsys):
    found = result(capsys, "path", "ur10e", "path.csv", *HAND, code=1)
    assert {piece["outcome"] for piece in found["pieces"]} == {"admissible", "not_downward"}
    assert found["cycle_times"][0]["cycle_time_s"] is None
    assert found["contact_excluded"] is False
    assert found["pieces"][-1]["speed_mps"] is None
    assert run(["path", "kuka-iiwa7-30nm", "press.csv", *HAND]) == 1
    assert "no transient limit may be used" in capsys.readouterr().out
    assert run(["path", "ur10e", "press.csv", "--area", "temple", "--contact", "transient"]) == 1
    assert "not permitted" in capsys.readouterr().out


def test_joint_paths_need_their_robot(capsys, tmp_path):
    from forcemap.dynamics.robots import robot_named

    q = robot_named("ur10e").reference_posture
    header = ",".join(f"joint_{i}_rad" for i in range(1, 7))
    rows = [",".join(map(str, q)), ",".join(map(str, [q[0], q[1] + 0.1, *q[2:]]))]
    (tmp_path / "joints.csv").write_text("\n".join([header, *rows]))
    assert run(["path", "ur10e", "joints.csv", *HAND, "--robot", "ur10e", "--contact-offset-m", "0,0,0.1"]) in (0, 1)
    out = " ".join(capsys.readouterr().out.split())
    assert "Speeds to program along" in out
    assert (
        "others off it raised by 14 %; the zones of forcemap export raise it everywhere, unless with --angle-deg 0"
        in out
    )
    assert run(["path", "ur10e", "joints.csv", *HAND]) == 2


def test_place_finds_where_to_put_the_table(capsys):
    quick = ["place", "ur10e", "table.csv", *HAND, "--step-m", "0.1", "--acceleration-mps2", "10"]
    found = result(capsys, *quick)
    assert found["best"]["distance_m"] == pytest.approx(0.8)
    assert min(each["cycle_time_s"] or math.inf for each in found["positions"]) == found["best"]["cycle_time_s"]
    assert run(quick) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "best:" in said
    assert found["as_fast"] == 1
    assert found["best"]["distance_m"] == max(each["distance_m"] for each in found["positions"])
    assert "it lies at the edge of the positions tried, in d" in said
    finer = result(capsys, *quick[:-3], "0.05", *quick[-2:])
    assert finer["best"]["distance_m"] > found["best"]["distance_m"]
    assert finer["best"]["cycle_time_s"] < found["best"]["cycle_time_s"]
    assert run(["place", "kuka-iiwa7-30nm", "table.csv", *HAND, "--step-m", "0.2"]) == 1
    assert "no transient limit may be used" in capsys.readouterr().out


def test_a_bent_path_says_what_it_leaves_without_permission(capsys, tmp_path):
    (tmp_path / "slant.csv").write_text("x_m,y_m,z_m\n0.7,0,0.44\n0.72,0,0.28\n")
    found = result(capsys, "path", "ur10e", "slant.csv", *HAND, "--suggest", "bent.csv", code=1)["suggestion"]
    assert (found["bent_moves"], found["cycle_time_s"]) == (1, None)
    left = 1000 * (1 - found["permitted_share"]) * found["length_m"]
    assert run(["path", "ur10e", "slant.csv", *HAND, "--suggest", "bent.csv"]) == 1
    said = " ".join(capsys.readouterr().out.split())
    permitted = found["permitted_share"] * found["length_m"]
    assert f"permitted on {permitted:.3f} of {found['length_m']:.3f} m, the rest has no permission; another" in said
    assert "give them one of their own in this file, and in the task with contact_possible = false" in said
    again = result(capsys, "path", "ur10e", "bent.csv", *HAND, code=1)
    refused = sum(1000 * piece["length_m"] for piece in again["pieces"] if piece["speed_mps"] is None)
    assert refused == pytest.approx(left, rel=1e-3)


def test_of_positions_as_fast_place_takes_the_one_with_the_highest_speeds(capsys, tmp_path):
    """A short stroke is never as fast as is allowed: the acceleration decides."""
    (tmp_path / "table.csv").write_text("x_m,y_m,z_m\n0,0,0.02\n0,0,0\n")
    found = result(capsys, "place", "ur10e", "table.csv", *HAND, "--step-m", "0.05", "--acceleration-mps2", "0.5")
    times = {(p["distance_m"], p["height_m"]): p["cycle_time_s"] for p in found["positions"] if p["cycle_time_s"]}
    fast = [place for place, time in times.items() if time <= min(times.values()) + 5e-4]
    assert found["as_fast"] == len(fast) > 3
    allowed = {}
    for d, h in fast:
        (tmp_path / "there.csv").write_text(f"x_m,y_m,z_m\n{d},0,{h + 0.02}\n{d},0,{h}\n")
        pieces = result(capsys, "path", "ur10e", "there.csv", *HAND)["pieces"]
        allowed[d, h] = min(piece["speed_mps"] for piece in pieces)
    assert (found["best"]["distance_m"], found["best"]["height_m"]) == max(allowed, key=allowed.get)
    assert run(["place", "ur10e", "table.csv", *HAND, "--step-m", "0.05", "--acceleration-mps2", "0.5"]) == 0
    assert f"{len(fast)} positions are as fast to 1 ms" in capsys.readouterr().out


@pytest.mark.parametrize("base", [False, True])
def test_place_tells_a_path_in_the_frame_of_the_base(capsys, base):
    Path("press.csv").write_text(f"x_m,y_m,z_m\n{0.8 * base},0,{0.4 * base + 0.04}\n{0.8 * base},0,{0.4 * base}\n")
    said = result(capsys, "place", "ur10e", "press.csv", *HAND)["assumptions"]
    assert any("0.89 m from the path: if its rows are in the frame of the base" in line for line in said) == base


def test_place_says_why_no_position_is_permitted(capsys, tmp_path):
    (tmp_path / "table.csv").write_text("x_m,y_m,z_m,segment\n0,0,0.05,press\n0,0,0,lift\n0,0,0.05,lift\n")
    assert run(["place", "ur10e", "table.csv", *HAND, "--step-m", "0.1"]) == 1
    text = capsys.readouterr().out
    assert "NO POSITION has permission for the whole path on a grid of 0.1 m; most, 50 %" in " ".join(text.split())
    assert "a finer grid may still have one" not in text
    assert "lift: 0.050 m not downward, the motion points more than 5 degrees away" in text
    assert "contact_possible = false" in " ".join(text.split())
    found = result(capsys, "place", "ur10e", "table.csv", *HAND, "--step-m", "0.1", code=1)
    assert [(each["segment"], each["outcome"]) for each in found["refusals"]] == [("lift", "not_downward")]
    assert run(["place", "ur10e", "table.csv", "--task", "task.toml", "--step-m", "0.1"]) == 0
    (tmp_path / "table.csv").write_text("x_m,y_m,z_m\n0,0,0.6\n0,0,0\n")
    assert run(["place", "ur10e", "table.csv", *HAND, "--step-m", "0.2"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "outside: move the path into the measured range, less the position tolerance (d 0.525 to 0.885 m, h" in out
    assert "on a grid of 0.2 m, nor around the best of it on one of 0.04 m; most" in out
    assert "a finer grid may still have one: --step-m 0.02, which takes longer" in out


def test_place_looks_closer_where_its_grid_has_no_position(capsys, tmp_path):
    """Every position of 5 cm leaves the range or the permission; the finer answer is that of its own step."""
    (tmp_path / "table.csv").write_text("x_m,y_m,z_m\n0,0,0.31\n0,0,0.02\n")
    found = result(capsys, "place", "ur10e", "table.csv", *HAND)
    assert (found["step_m"], found["finer_step_m"]) == (0.05, 0.01)
    fine = result(capsys, "place", "ur10e", "table.csv", *HAND, "--step-m", "0.01")
    assert (fine["step_m"], fine["finer_step_m"]) == (0.01, None)
    times = {(each["distance_m"], each["height_m"]): each["cycle_time_s"] for each in fine["positions"]}
    own = {(each["distance_m"], each["height_m"]): each["cycle_time_s"] for each in found["positions"]}
    assert len(own) <= 121 < len(times)
    assert own == {place: times[place] for place in own}
    assert found["best"]["cycle_time_s"] == min(time for time in own.values() if time)
    assert run(["place", "ur10e", "table.csv", *HAND]) == 0
    assert "; on a grid of 0.01 m, since one of 0.05 m has none" in " ".join(capsys.readouterr().out.split())
    assert run(["place", "ur10e", "table.csv", *HAND, "--step-m", "0.01"]) == 0
    out = capsys.readouterr().out
    permitted = sorted((time, place) for place, time in times.items() if time)
    assert f"the fastest of {len(permitted)} positions with permission for the whole path, of {len(times)}" in out
    listed = [line.split() for line in out.partition("cycle time [s]\n")[2].splitlines()[: min(10, len(permitted))]]
    assert [float(row[2]) for row in listed] == pytest.approx([time for time, _ in permitted[:10]], abs=6e-4)


def test_place_says_where_no_position_helps_and_what_is_programmed_too_fast(capsys, tmp_path):
    (tmp_path / "table.csv").write_text("x_m,y_m,z_m\n0,0,0.12\n0,0,0.02\n")
    limit = ["--area", "back_of_hand", "--contact", "quasi-static"]
    found = result(capsys, "place", "ur10e", "table.csv", *limit, code=1)
    assert found["without"] == ["path"]
    assert {part["outcome"] for part in found["refusals"]} == {
        "unconfirmed"
    }  # of equal shares the one inside the range
    assert run(["place", "ur10e", "table.csv", *limit]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "path: a part has a speed at none of the positions" in out
    assert "a finer grid may" not in out
    assert "forcemap place" not in out
    (tmp_path / "fast.csv").write_text("x_m,y_m,z_m,speed_mps\n0,0,0.12,0.45\n0,0,0.02,0.45\n")
    found = result(capsys, "place", "ur10e", "fast.csv", *HAND)
    assert found["too_fast_share"] == pytest.approx(1.0)
    assert run(["place", "ur10e", "fast.csv", *HAND]) == 0
    assert "! programmed too fast there on 100 % of the path" in " ".join(capsys.readouterr().out.split())


def test_a_refusal_within_the_position_tolerance_says_so(capsys, tmp_path):
    """`speed` permits the end of the way, `path` not the last piece: it counts the places beside it, and says it."""
    (tmp_path / "way.csv").write_text("x_m,y_m,z_m\n0.7,0,0.45\n0.7,0,0.237\n")
    at = ["speed", "ur10e", "--distance", "0.7", "--height", "0.237", *HAND]
    assert run(at) == 0
    said = "holds at the place itself, straight along the map's direction; lower in what forcemap path and export give"
    assert said in " ".join(capsys.readouterr().out.split())
    assert run(["speed-map", "ur10e", *HAND]) == 0
    assert said in " ".join(capsys.readouterr().out.split())
    assert run(["path", "ur10e", "way.csv", *HAND]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "a piece counts all places up to 5 mm beside it (position tolerance), so it may be refused where" in out
    assert "limit that holds" not in out
    assert run(["path", "ur10e", "way.csv", *HAND, "--position-tolerance-m", "0"]) == 0
    capsys.readouterr()
    assert run(["path", "kuka-iiwa7-30nm", "press.csv", *HAND]) == 1
    assert "ask for the quasi-static limit there (--contact quasi-static" in " ".join(capsys.readouterr().out.split())


def test_path_shows_where_the_program_becomes_too_fast_and_both_cycle_times(capsys, tmp_path):
    (tmp_path / "way.csv").write_text("x_m,y_m,z_m,speed_mps\n0.8,0,0.45,0.27\n0.8,0,0.25,0.27\n")
    found = result(capsys, "path", "ur10e", "way.csv", *HAND, code=1)
    fast = [piece["too_fast"] for piece in found["pieces"]]
    assert fast == sorted(fast)
    height = next(piece["from_m"][2] for piece in found["pieces"] if piece["too_fast"])
    assert run(["path", "ur10e", "way.csv", *HAND]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert f"0.800, {height:.3f} to" in out.partition("segment length")[2].partition("0.270 !")[0]
    allowed, standard, *_ = (each["cycle_time_s"] for each in found["cycle_times"])
    of_standard = found["cycle_times"][1]["speed_mps"]
    slower = sum(each["length_m"] for each in found["pieces"] if each["speed_mps"] < of_standard) / found["length_m"]
    assert 0 < slower < 1
    said = f"at the standard's one speed, which the map does not permit on {100 * slower:.0f} % of the path)"
    assert f"at the allowed speeds {allowed:.3f} s ({standard:.3f} s {said}" in out


def test_a_path_that_leaves_the_range_is_told_where_it_lies_inside(capsys, tmp_path):
    (tmp_path / "out.csv").write_text("x_m,y_m,z_m\n0.8,0,0.456\n0.8,0,0.3\n")
    for tolerance, inside in (("0.005", "d 0.525 to 0.885 m, h 0.145 to 0.455 m"), ("0.0073", "d 0.528 to 0.882 m")):
        command = ["path", "ur10e", "out.csv", *HAND, "--position-tolerance-m", tolerance]
        assert run(command) == 1
        out = " ".join(capsys.readouterr().out.split())
        assert "no permission, not wholly inside the measured range" in out
        assert f"less the position tolerance ({inside}" in out
    (tmp_path / "in.csv").write_text("x_m,y_m,z_m\n0.8,0,0.455\n0.8,0,0.145\n")
    found = result(capsys, "path", "ur10e", "in.csv", *HAND)
    assert found["inside"] == []
    found = result(capsys, *command, code=1)
    (inside,) = found["inside"]
    assert (inside["whole"], inside["contact_site"]) == (True, "")
    assert inside["height_to_m"] == pytest.approx(0.46 - 0.0073)
    low, high = np.array([0.52, 0.14]), np.array([0.89, 0.46])
    corners = np.array([[*low, 0.2], [high[0], low[1], 0.2], [low[0], high[1], 0.3], [0.7, 0.2, 0.4], [0.6, 0.2, 0.1]])
    corner = dataclasses.replace(fm.published_map("ur10e"), measured_range=MeasuredRange(corners))
    hand, bound = one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT), fm.FixedMargin()
    for tolerance, said in (
        (0.005, "(within d 0.525 to 0.885 m, h 0.145 to 0.455 m)"),
        (0.2, "no d, its range is too"),
    ):
        given = {"bound": bound, "allowance": fm.Allowance(position=tolerance)}
        speeds = fm.path_speeds(corner, fm.read_path("out.csv"), hand, **given)
        assert said in " ".join(path_lines(PathAnswer.of_path(speeds, bound), "out.csv"))


def test_of_several_maps_each_range_is_said_and_whose_place_counts():
    ur10e, bound, sites = fm.published_map("ur10e"), fm.FixedMargin(), ("flange", "gripper")
    stated = [dataclasses.replace(ur10e.conditions, contact_site=site) for site in sites]
    maps = [dataclasses.replace(ur10e, conditions=each) for each in stated]
    atlas = Atlas(tuple(AtlasMap(*each) for each in zip(("one", "two"), stated, maps, strict=True)))
    segment = fm.TaskSegment("path", ("back_of_hand",), fm.Contact.TRANSIENT, contact_sites=sites)
    task = fm.Task((segment,), site_offsets={"flange": (0.0, 0.0, 0.1), "gripper": (0.0, 0.0, 0.0)})
    speeds = fm.path_speeds(atlas, fm.read_path("press.csv"), task, bound=bound)
    answer = PathAnswer.of_path(speeds, bound)
    assert [(each.map_name, each.contact_site) for each in answer.inside] == [("one", "flange"), ("two", "")]
    said = "(one: d 0.525 to 0.885 m, h 0.145 to 0.455 m of flange; two: d 0.525 to 0.885 m, h 0.145 to 0.455 m)"
    assert said in " ".join(path_lines(answer, "press.csv"))


def time_by(rule, found):
    """Cycle time by a rule, as it is shown."""
    return next(f"{each['cycle_time_s']:.3f}" for each in found["cycle_times"] if each["rule"] == rule)


@pytest.mark.parametrize("rows", [1, 5])
@pytest.mark.parametrize("press", ["areas", "contact_possible"])
def test_names_that_stand_a_row_too_late_are_said_first(capsys, rows, press):
    """Named after the row that they lead to, the way down has the name of the motion before it: contact excluded."""
    down = np.linspace(0.44, 0.36, rows + 1)
    ways = [("home", np.array([0.44])), ("approach", np.array([0.44])), ("press", down[1:]), ("lift", down[-2::-1])]
    rows_of = [(name, height) for name, heights in ways for height in heights] + [("home", 0.44)]
    points = [
        f"{0.75 + 0.05 * bool(i and i < len(rows_of) - 1)},0,{height:.3f}" for i, (_, height) in enumerate(rows_of)
    ]
    names = [name for name, _ in rows_of]
    stated = dict.fromkeys(("home", "approach", "lift"), "contact_possible = false")
    with_contact = 'areas = ["back_of_hand"]\ncontact = "transient"\nclamping_possible = false'
    stated["press"] = with_contact if press == "areas" else "contact_possible = false"
    segments = [f'[[segments]]\nname = "{name}"\n{entries}\nspeed_mps = 0.3\n' for name, entries in stated.items()]
    Path("task.toml").write_text('schema = "forcemap-task/1"\n' + "".join(segments))

    def said(begin):
        lines = [f"{point},{name}" for point, name in zip(points, begin, strict=True)]
        Path("path.csv").write_text("x_m,y_m,z_m,segment\n" + "\n".join(lines) + "\n")
        run(["path", "ur10e", "path.csv", "--task", "task.toml"])
        first, rest = " ".join(capsys.readouterr().out.split()).split("Speeds to program along")
        assert ("although the path moves about in the direction of a map there" in rest.split("Assumes")[1]) == (
            begin == names or press == "contact_possible"
        )
        return "! SEGMENT NAMES MAY STAND A ROW TOO LATE: contact is excluded on " in first

    assert said(names)
    assert said([*names[1:], "home"]) == (press == "contact_possible")  # as it should be: the press alone goes down


@pytest.mark.parametrize(
    ("names", "down_m", "told"),
    [
        ("carry carry approach insert lift lift", 0.04, True),
        ("carry carry approach insert lift lift", 0.0002, True),
        ("carry carry approach insert lift lift", 0.00003, False),  # a log has its row at a corner to 0.1 mm
        ("carry approach insert lift lift lift", 0.04, False),
    ],
)
def test_a_descent_named_after_the_carry_before_it_is_told_though_another_follows(capsys, names, down_m, told):
    places = [(0.72, 0.44), (0.8, 0.44), (0.8, 0.44 - down_m), (0.8, 0.36), (0.8, 0.44), (0.72, 0.44)]
    rows = [f"{x},0,{z},{name}" for (x, z), name in zip(places, names.split(), strict=True)]
    Path("path.csv").write_text("\n".join(["x_m,y_m,z_m,segment", *rows]) + "\n")
    hand = 'areas = ["back_of_hand"]\ncontact = "transient"\nclamping_possible'
    used = {name: hand if name == "approach" else "contact_possible" for name in names.split()[:-1]}
    segments = [f'[[segments]]\nname = "{name}"\n{of} = false\nspeed_mps = 0.2\n' for name, of in used.items()]
    Path("task.toml").write_text('schema = "forcemap-task/1"\n' + "".join(segments))
    found = result(capsys, "path", "ur10e", "path.csv", "--task", "task.toml")
    assert any(line.startswith("SEGMENT NAMES MAY STAND A ROW TOO LATE") for line in found["warnings"]) == told
    (excluded,) = [line for line in found["assumptions"] if line.startswith("contact excluded by other measures")]
    along = sum(name == "carry" for name in names.split()) > 1
    assert (f"on carry ({1000 * down_m:.3g} mm)" in excluded) == along
    assert ("is a row at a corner that has the name of the motion before" in excluded) == (along and not told)


def test_waits_beside_a_refused_piece_are_in_every_row_of_the_permitted_part(capsys):
    """Down, 0.2 s at rest, aside, which no map is of, 0.1 s at rest, and down again."""
    rows = [
        (0.0, 0.8, 0.44),
        (0.4, 0.8, 0.40),
        (0.6, 0.8, 0.40),
        (0.8, 0.82, 0.40),
        (0.9, 0.82, 0.40),
        (1.3, 0.82, 0.36),
    ]
    lines = [f"{t},{x},0,{z}" for t, x, z in rows]
    Path("path.csv").write_text("\n".join(["time_s,x_m,y_m,z_m", *lines]) + "\n")
    hand = ("--area", "back_of_hand", "--contact", "transient")
    assert run(["path", "ur10e", "path.csv", *hand, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    times = {each["rule"]: each["permitted_time_s"] for each in found["cycle_times"]}
    assert found["permitted"] is False
    assert times["as programmed"] == pytest.approx(0.4 + 0.4 + 0.3)
    moving = 2 * 2 * (0.04 / 1.0) ** 0.5  # 0.1 m/s in the file; faster where that is allowed, from rest to rest
    assert 0.3 < times["allowed speeds"] <= 0.3 + moving
    assert times["as programmed, slowed where too fast"] >= times["as programmed"]


@pytest.mark.parametrize("where", [0, 1, 2])
def test_a_gap_in_which_a_log_stands_is_told_wherever_it_is(capsys, where):
    """At its first row, amid a straight line and at its last: what was driven in between is not known."""
    heights, time, rows = [0.44, 0.40, 0.36], 0.0, []
    for number, height in enumerate(heights):
        rows.append(f"0.8,0,{height},{time}")
        if number == where:
            time += 4.0
            rows.append(f"0.8,0,{height},{time}")
        time += 0.2
    Path("log.csv").write_text("\n".join(["x_m,y_m,z_m,time_s", *rows]) + "\n")
    run(["path", "ur10e", "log.csv", *HAND])
    assert "ROWS ARE 4 s APART" in " ".join(capsys.readouterr().out.split())


def test_speeds_of_a_files_rows_are_compared_and_scaled(capsys, tmp_path):
    (tmp_path / "rows.csv").write_text(
        "x_m,y_m,z_m,segment,speed_mps\n0.8,0,0.44,press,0.2\n0.8,0,0.36,lift,0.45\n0.8,0,0.44,lift,\n"
    )
    found = result(capsys, "path", "ur10e", "rows.csv", "--task", "task.toml", code=1)
    # 0.4 and 0.5 in the task, whose 0.5 counts for the empty cell
    assert [piece["programmed_speed_mps"] for piece in found["pieces"]] == [0.45] * 4 + [0.5] * 4
    assert [piece["too_fast"] for piece in found["pieces"]] == [True] * 4 + [False] * 4
    assert run(["export-path", "ur10e", "rows.csv", "--task", "task.toml", "-o", "s.csv"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    unbraked = f"({time_by('as programmed, slowed where too fast', found)} s without braking ahead of slower pieces"
    assert f"8 of 8 pieces permitted, 4 of them slowed down, 0.819 s at their commanded speeds {unbraked});" in said
    text = (tmp_path / "rows.csv").read_text().replace("lift,0.45", "lift,0.2")
    (tmp_path / "rows.csv").write_text(text.replace("lift,\n", "lift,\n0.8,0,0.36,press,0.4\n0.8,0,0.30,press,0.3\n"))
    assert run(["export-path", "ur10e", "rows.csv", "--task", "task.toml", "-o", "s.csv"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    found = result(capsys, "path", "ur10e", "rows.csv", "--task", "task.toml", code=1)
    slowed, allowed = (time_by(rule, found) for rule in ("as programmed, slowed where too fast", "allowed speeds"))
    costs = f"({slowed} s without braking ahead of slower pieces; {allowed} s if the program were as fast as allowed:"
    assert "of them slowed down (" in said
    assert costs in said
    assert slowed > allowed
    assert "only to brake for a slower one)" in said
    assert run(["path", "ur10e", "path.csv", *HAND, "--column", "speed=v"]) == 2
    assert "the columns x_m, y_m, z_m, speed_to_point_mps" in capsys.readouterr().err


def test_a_scaling_file_is_a_path_at_its_commanded_speeds(capsys):
    Path("tilted.csv").write_text("x_m,y_m,z_m,segment\n0.8,0.1,0.44,press\n0.7,0.3,0.36,lift\n0.7,0.3,0.44,\n")
    for path in ("path.csv", "tilted.csv"):
        run(["export-path", "ur10e", path, "--task", "task.toml", "-o", "s.csv"])
        capsys.readouterr()
        text = Path("s.csv").read_text()
        rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
        before = fm.read_path(path)
        if path == "tilted.csv":
            assert {row["commanded_speed_mps"] for row in rows} >= {"0.000"}
            with pytest.raises(fm.InputError, match=r"'0\.000', expected a positive number.*no permission"):
                fm.read_path("s.csv")
            continue
        again = fm.read_path("s.csv")
        assert again.points == pytest.approx(np.vstack([again.points[:1], again.points[1:]]), abs=1e-6)
        assert again.lengths.sum() == pytest.approx(before.lengths.sum(), abs=1e-5)
        assert again.stated_speeds.tolist() == [float(row["commanded_speed_mps"]) for row in rows]
        assert again.names == tuple(row["segment"] for row in rows)
        found = result(capsys, "path", "ur10e", "s.csv", "--task", "task.toml")
        assert [each["programmed_speed_mps"] for each in found["pieces"]] == again.stated_speeds.tolist()
        assert run(["path", "ur10e", "s.csv", "--task", "task.toml"]) == 0
        low, high = (f"{each([float(row['commanded_speed_mps']) for row in rows[:4]]):.3f}" for each in (min, max))
        assert low < high
        assert f"{low} to {high}" in capsys.readouterr().out
        Path("s.csv").write_text(text.replace("\n2,", "\n2,no,", 1))
        with pytest.raises(fm.InputError):
            fm.read_path("s.csv")
        lines = text.splitlines()
        first = next(number for number, line in enumerate(lines) if line.startswith("1,"))
        lines[first : first + 2] = lines[first + 1], lines[first]
        Path("s.csv").write_text("\n".join(lines) + "\n")
        with pytest.raises(fm.InputError, match="does not begin where the one before ends"):
            fm.read_path("s.csv")


def test_the_terminal_says_which_segments_a_safety_sheet_would_stop(capsys):
    for command in (["export", "ur10e"], ["export-path", "ur10e", "path.csv"]):
        run([*command, "--format", "safety", "--task", "task.toml", "-o", "safety.md"])
        said = " ".join(capsys.readouterr().out.split())
        stopped = re.findall(r"^- segment (\w+):", Path("safety.md").read_text(), re.M)
        assert stopped
        assert f"THESE ENTRIES WOULD STOP THE ROBOT on {', '.join(dict.fromkeys(stopped))} (the sheet says why)" in said


def test_the_safety_sheet_of_a_path_says_where_a_block_holds_it_for_straight_motion_alone(capsys):
    """A press down where the zones, raised by 14 %, have no speed, and those of straight motion have one."""
    Path("down.csv").write_text("x_m,y_m,z_m\n0.72,0,0.38\n0.72,0,0.30\n")
    command = ["export-path", "ur10e", "down.csv", "--format", "safety", *HAND, "-o", "safety.md"]
    run(command)
    said, sheet = " ".join(capsys.readouterr().out.split()), Path("safety.md").read_text()
    assert "segment path: leaves the block of zones" in sheet
    hint = "for motion exactly along the map's direction ONLY (--angle-deg 0) there is a block that holds the path"
    assert hint in said
    assert hint in sheet
    limit = re.search(r"where contact is possible, at most (\d\.\d{3}) m/s", sheet)[1]
    run([*command, "--angle-deg", "0"])
    said, sheet = " ".join(capsys.readouterr().out.split()), Path("safety.md").read_text()
    assert f"| tool speed limit | {limit} m/s |" in sheet
    assert "leaves the block" not in sheet
    assert "(--angle-deg 0)" not in sheet
    Path("aslant.csv").write_text("x_m,y_m,z_m\n0.72,0,0.38\n0.723,0,0.30\n")  # 2 degrees off the direction
    run([*command[:2], "aslant.csv", *command[3:]])
    assert "(--angle-deg 0)" not in Path("safety.md").read_text()


def test_rows_too_close_to_blend_are_said_of_a_scaling_file(capsys):
    for step, said_so in ((0.004, True), (0.02, False)):
        heights = np.arange(0.44, 0.36 - 1e-9, -step)
        Path("rows.csv").write_text("x_m,y_m,z_m\n" + "".join(f"0.8,0,{h:.4f}\n" for h in heights))
        run(["export-path", "ur10e", "rows.csv", *HAND, "-o", "scaling.csv"])
        said = " ".join(capsys.readouterr().out.split())
        assert ("ROWS AS CLOSE AS 4.0 mm: blends there must not exceed 2.0 mm" in said) == said_so


def test_a_short_slowest_piece_of_a_log_is_a_missing_corner_only_where_it_points_aside(capsys):
    """A robot that brakes to rest leaves a short last piece along its motion: nothing is missing there."""
    rows = ["x_m,y_m,z_m,time_s", "0.8,0,0.44,0", "0.8,0,0.40,0.2", "0.8,0,0.38,0.3", "0.8,0,0.3797,0.35"]
    Path("braking.csv").write_text("\n".join(rows))
    run(["path", "ur10e", "braking.csv", *HAND])
    said = " ".join(capsys.readouterr().out.split())
    assert re.search(r"slowest: [^:]*: 280 N, back_of_hand, transient, over 0.3 mm", said)
    assert "no row at a corner" not in said
    corner = [*rows[:3], "0.80002,0,0.3997,0.21", "0.82,0,0.3697,0.3"]
    Path("corner.csv").write_text("\n".join(corner))
    run(["path", "ur10e", "corner.csv", *HAND])
    assert "transient, over 0.3 mm, as where a log has no row at a corner" in " ".join(capsys.readouterr().out.split())


def test_times_in_another_unit_are_refused(capsys):
    """A speed that no robot has: a log in milliseconds read as one in seconds, or the other way round."""
    Path("log.csv").write_text("x_m,y_m,z_m,time_s\n0.8,0,0.44,0\n0.8,0,0.40,0.0002\n")
    with pytest.raises(fm.InputError, match=r"log.csv: path: found 200 m/s between two rows .* at most 10 m/s; times"):
        fm.read_path("log.csv")
    Path("ms.csv").write_text("t,X,Y,Z\n0,800,0,440\n200,800,0,400\n")
    given = {"position": ["X", "Y", "Z"], "length_unit": "mm", "time": "t"}
    assert fm.read_path("ms.csv", columns=given | {"time_unit": "ms"}).speeds == pytest.approx([0.2])
    with pytest.raises(fm.InputError, match="found 200 m/s"):
        fm.read_path("ms.csv", columns=given | {"time_unit": "us"})


def test_exports_into_a_folder_that_is_not_there_say_what_to_do(capsys, tmp_path):
    for form, name in (("csv", "cell/zones.csv"), ("krl", "cell")):
        assert run(["export", "ur10e", "--format", form, *HAND, "-o", name]) == 2
        assert "make it (mkdir -p cell) or name one that exists" in capsys.readouterr().err
    assert not (tmp_path / "cell").exists()


def test_exports_name_the_map_file_and_warn_in_the_safety_sheet(capsys, tmp_path):
    fm.write_map(fm.published_map("ur10e"), tmp_path / "cell.json")
    digest = hashlib.sha256((tmp_path / "cell.json").read_bytes()).hexdigest()
    for form in ("scaling", *Format):
        if form == Format.JSON:
            continue
        command = ["export-path", "cell.json", "path.csv"] if form in ("scaling", "safety") else ["export", "cell.json"]
        assert run([*command, "--format", form, "--task", "task.toml"]) == 0
        text = capsys.readouterr().out
        assert f"map file: cell.json, SHA-256 {digest}" in text
        assert "no speed for any other direction of motion" in text
    assert "segment lift: programmed up to 0.500 m/s, the tool speed limit is" in text
    found = result(capsys, "export-path", "cell.json", "path.csv", "--task", "task.toml")
    assert found["map_file_sha256"] == digest
    assert found["acceleration_mps2"] == 2


@pytest.mark.parametrize("form", [form for form in Format if form is not Format.KRL])  # two files
def test_export_writes_what_it_prints(form, capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1795219200")  # 2026-11-21
    command = ["export", "ur10e", "--format", form, *HAND]
    assert run(command) == 0
    printed = capsys.readouterr().out
    assert run([*command, "-o", "out.txt"]) == 0
    said = grid = capsys.readouterr().out
    heads = re.search(r"h . d \[m\]((?:  0\.\d{3})+)\n", grid)[1].split()
    assert len(heads) == 8
    words = "20 of 56 zones permitted, 0.201 to 0.281 m/s to program, 4 of them above the 0.253 m/s to program of"
    said = " ".join(said.split())
    assert (
        f"{words} the standard's one speed (on a way its slowest zone counts); up to 0.052 m/s slower than their "
        "fastest corner; not safety-rated" in said
    )
    assert "path's own factors (forcemap export-path --format scaling), or smaller zones (--zone-m 0.02)" in said
    assert "the bound is raised by 14 % everywhere" in " ".join(said.split())
    assert "for motion exactly along the direction ONLY, --angle-deg 0 leaves these degrees out" in said
    table = fm.robot_table(
        fm.published_map("ur10e"), limits=[(fm.force_limit("back_of_hand"), fm.Contact.TRANSIENT)],
        bound=fm.FixedMargin(0.10),
    )  # fmt: skip
    for row in re.findall(r"(?<=\n)(0\.\d{3})((?:  +[\d.?]+)+)(?=\n)", grid):
        height = float(row[0])
        for column, cell in zip(heads, row[1].split(), strict=True):
            speed = table.speed(float(column), 0.0, height)
            assert cell == (f"{speed:.3f}" if speed else "?")
    assert run([*command, "--angle-deg", "0", "-o", "out0.txt"]) == 0
    straight = " ".join(capsys.readouterr().out.split())
    assert run([*command, "--zone-m", "0.02", "-o", "small.txt"]) == 0
    small = " ".join(capsys.readouterr().out.split())
    assert "smaller zones" not in small
    assert "speeds of the zones: more than a line takes, see --format csv" in small
    assert "raised" not in straight
    assert "up to 0 degrees" not in straight
    assert "a zone has the lowest speed of all its places" in straight
    assert "14 %" not in straight
    assert run([*command, "--angle-deg", "0"]) == 0  # motion along the map's direction alone
    assert "forces raised by 14 %" not in capsys.readouterr().out
    assert "forces raised by 14 %" in printed
    assert (tmp_path / "out.txt").read_text() == printed
    assert "2026-11-21" in printed
    assert run([*command, "-o", "out.txt"]) == 0  # an earlier result may be replaced
    assert run([*command, "-o", "path.csv"]) == 2  # another file may not


def test_a_format_that_is_named_for_its_maker_is_refused_with_its_name(capsys):
    for arguments, words in ((("--format", "kuka"), "; krl is KUKA's"), (("--format=UR",), "; urscript is Universal")):
        assert run(["export", "ur10e", *arguments, *HAND]) == 2
        assert words in capsys.readouterr().err
    assert run(["export", "ur10e", "--format", "dobot", *HAND]) == 2
    assert "KUKA" not in capsys.readouterr().err


def test_where_no_zone_is_permitted_the_verdict_says_what_raised_the_bound(capsys):
    limit = ["--area", "palm", "--contact", "quasi-static"]
    assert run(["export", "ur10e", "--format", "csv", *limit, "-o", "out.csv"]) == 1
    verdict = " ".join(capsys.readouterr().out.split())
    assert verdict.startswith("0 of 56 zones permitted, with the bound raised by 14 % for motion up to 5 degrees off")
    verdict = verdict.partition("; not safety")[0]
    assert "whether any is without these, --angle-deg 0 tells, for motion exactly along the direction ONLY" in verdict


def test_export_of_programs(capsys, tmp_path):
    assert run(["export", "ur10e", "--format", "krl", "--task", "task.toml", "-o", "."]) == 0
    assert (tmp_path / "FORCEMAP.DAT").read_text().startswith("DEFDAT FORCEMAP PUBLIC")
    assert "FORCEMAP_SPEED" in (tmp_path / "FORCEMAP.SRC").read_text()
    assert run(["export", "ur10e", "--format", "krl", "--task", "task.toml", "-o", "no/folder"]) == 2
    capsys.readouterr()
    assert run(["export", "ur10e", "--format", "urscript", *HAND]) == 0
    allowed = urscript_function(capsys.readouterr().out, "forcemap_speed")
    assert 0 < allowed([0.8, 0.0, 0.4, 0, 0, 0]) < 0.33
    found = result(capsys, "export-path", "ur10e", "path.csv", "--task", "task.toml")
    assert {piece["scaling"] for piece in found["pieces"] if piece["segment"] == "lift"} == {1.0}
    assert max(piece["scaling"] for piece in found["pieces"] if piece["segment"] == "press") < 0.9
    Path("slow.toml").write_text(TASK.replace("speed_mps = 0.4", "speed_mps = 0.21"))  # slower than is allowed
    found = result(capsys, "export-path", "ur10e", "path.csv", "--task", "slow.toml")
    press = [piece for piece in found["pieces"] if piece["segment"] == "press"]
    assert all(piece["allowed_speed_mps"] > 0.21 for piece in press)
    assert {(piece["commanded_speed_mps"], piece["scaling"]) for piece in press} == {(0.21, 1.0)}
    assert result(capsys, "export", "kuka-iiwa7-30nm", "--format", "json", *HAND, code=1)["zones"][0]["speed_mps"] == 0
    refused = result(capsys, "export", "ur10e", "--format", "csv", "--area", "temple", "--contact", "transient", code=1)
    assert refused["outcome"] == "not_permitted"


def test_the_allowed_speeds_are_had_without_a_program_and_pass_as_one(capsys, tmp_path):
    """The file as `docs/robot_program.md` says it is checked: each speed on the row of the point it leads to."""
    assert run(["export-path", "ur10e", "press.csv", *HAND, "-o", "s.csv"]) == 0
    capsys.readouterr()
    rows = list(csv.DictReader(line for line in (tmp_path / "s.csv").read_text().splitlines() if line[0] != "#"))
    assert {(row["programmed_speed_mps"], row["scaling"]) for row in rows} == {("", "")}
    allowed = [piece["speed_mps"] for piece in result(capsys, "path", "ur10e", "press.csv", *HAND)["pieces"]]
    for row, speed in zip(rows, allowed, strict=True):
        assert 0 < float(row["commanded_speed_mps"]) <= float(row["allowed_speed_mps"]) <= speed
    points = [(row["to_x_m"], row["to_y_m"], row["to_z_m"], row["commanded_speed_mps"]) for row in rows]
    first = (rows[0]["from_x_m"], rows[0]["from_y_m"], rows[0]["from_z_m"], rows[0]["commanded_speed_mps"])
    text = "x_m,y_m,z_m,speed_to_point_mps\n" + "".join(",".join(point) + "\n" for point in (first, *points))
    (tmp_path / "back.csv").write_text(text)
    assert run(["path", "ur10e", "back.csv", *HAND]) == 0
    assert "permitted as programmed" in capsys.readouterr().out


BAD = {
    "no such path": (["path", "ur10e", "none.csv", *HAND], "no such file"),
    "not a number": (["path", "ur10e", "bad.csv", *HAND], "row 2, column z_m: found 'nan'"),
    "no length": (["path", "ur10e", "still.csv", *HAND], "same place"),
    "mixed units": (["path", "ur10e", "mixed.csv", *HAND], "column z_mm"),
    "unknown area": (["path", "ur10e", "path.csv", "--area", "hnad", "--contact", "transient"], "no body area"),
    "unknown area in the task": (["path", "ur10e", "path.csv", "--task", "area.toml"], "no body area"),
    "no such segment": (["path", "ur10e", "path.csv", "--task", "segment.toml"], "'move', which the path"),
    "segment without a task": (["path", "ur10e", "more.csv", "--task", "task.toml"], "'carry', which the task"),
    "no task": (["path", "ur10e", "path.csv"], "expected --task"),
    "task and area": (["path", "ur10e", "path.csv", "--task", "task.toml", *HAND], "give it alone"),
    "another tool": (["path", "ur10e", "path.csv", "--task", "tool.toml"], "tool: the task states 'gripper'"),
    "another tool, exported": (["export", "ur10e", "--format", "csv", "--task", "tool.toml"], "tool"),
    "another direction": (["export", "ur10e", "--format", "urscript", "--task", "direction.toml"], "direction"),
    "a step of nothing": (["path", "ur10e", "path.csv", *HAND, "--step-m", "0"], "step"),
    "an angle": (["path", "ur10e", "path.csv", *HAND, "--angle-deg", "45"], "expected from 0 to 5"),
    "a tolerance": (["path", "ur10e", "path.csv", *HAND, "--position-tolerance-m", "nan"], "position tolerance"),
    "scaling of places": (["export", "ur10e", "--format", "scaling", *HAND], "'scaling' is not one of"),
    "zones with a path": (["export", "ur10e", "--format", "csv", *HAND, "--path", "path.csv"], "forcemap export-path"),
    "times and speeds": (["path", "ur10e", "both.csv", *HAND], "column speed_mps: found it beside time_s"),
    "newtons along a path": (["path", "ur10e", "path.csv", "--limit-N", "140"], "--limit-N"),
    "positions": (["place", "ur10e", "table.csv", *HAND, "--step-m", "1e-9"], "step"),
}  # fmt: skip


@pytest.mark.parametrize(("arguments", "words"), BAD.values(), ids=BAD)
def test_bad_input_gets_one_line_and_exit_code_2(arguments, words, capsys, tmp_path):
    (tmp_path / "bad.csv").write_text("x_m,y_m,z_m\n0.8,0,nan\n0.8,0,0.3\n")
    (tmp_path / "still.csv").write_text("x_m,y_m,z_m\n0.8,0,0.4\n0.8,0,0.4\n")
    (tmp_path / "mixed.csv").write_text("x_m,y_m,z_mm\n0.8,0,400\n0.8,0,300\n")
    (tmp_path / "both.csv").write_text("x_m,y_m,z_m,time_s,speed_mps\n0.8,0,0.4,0,0.2\n0.8,0,0.3,1,0.2\n")
    (tmp_path / "more.csv").write_text("x_m,y_m,z_m,segment\n0.8,0,0.4,press\n0.8,0,0.3,carry\n0.8,0,0.4,lift\n")
    (tmp_path / "area.toml").write_text(TASK.replace("back_of_hand", "back_of_hnad"))
    (tmp_path / "segment.toml").write_text(
        TASK.replace('"lift"', '"lift"\nspeed_mps = 0.5\ncontact_possible = false\n[[segments]]\nname = "move"')
    )
    (tmp_path / "tool.toml").write_text(TASK.replace('"down"', '"down"\ntool = "gripper"'))
    (tmp_path / "direction.toml").write_text(TASK.replace('"down"', '"forward"'))
    assert run([*arguments, "--json"]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert words in captured.err
    assert json.loads(captured.out)["error"]["message"]
