"""Logs as controllers write them: read by a column map as the path they hold, or refused where in doubt."""

from __future__ import annotations

import json

import numpy as np
import pytest

import forcemap as fm
from forcemap.cli.app import run
from forcemap.paths.full_speed import doubts_of_full_speed

POINTS = np.array([[0.8, -0.1, 0.44], [0.8, -0.1, 0.4205], [0.8, -0.1, 0.4], [0.8, -0.1, 0.38]])
TIMES = np.array([0.0, 0.2, 0.4, 0.6])
XYZ = {"position": ["X", "Y", "Z"], "length_unit": "mm"}
CLOCK = {"time": "t", "time_unit": "ms"}


def log(head, separator, form, *, scale=1000.0, sign=".", since=0.0):
    """A log: its header, then time, position and orientation."""
    rows = [[f"{since + 1000 * t:.0f}", *(form.format(scale * x) for x in p), "3.14", "0.0", "0.0"]
            for t, p in zip(TIMES, POINTS, strict=True)]  # fmt: skip
    return head + "".join(separator.join(row).replace(".", sign) + "\n" for row in rows)


LOGS = {
    "semicolons and commas": (log("t;X;Y;Z;RX;RY;RZ\n", ";", "{:.1f}", sign=","), XYZ | CLOCK),
    "lines of header and units": (
        log("Log 4711\nrobot: r\n\nt;X;Y;Z;A;B;C\nms;mm;mm;mm;rad;rad;rad\n", ";", "{:.2f}"), XYZ | CLOCK),
    "units in names": (
        log("t [ms],X [mm],Y [mm],Z [mm],A,B,C\n", ",", "{:.2f}"),
        {"position": ["X [mm]", "Y [mm]", "Z [mm]"], "length_unit": "mm", "time": "t [ms]", "time_unit": "ms"}),
    "blanks": (log("t X Y Z A B C\n", "  ", "{:.2f}"), XYZ | CLOCK),
    "tabs, in metres": (log("t\tX\tY\tZ\tA\tB\tC\n", "\t", "{:.4f}", scale=1.0), XYZ | CLOCK | {"length_unit": "m"}),
    "by number, without names": (
        log("", ",", "{:.2f}"), {"position": [2, 3, 4], "length_unit": "mm", "time": 1, "time_unit": "ms"}),
    "inches": (log("t,X,Y,Z,A,B,C\n", ",", "{:.9f}", scale=1 / 0.0254), XYZ | CLOCK | {"length_unit": "in"}),
    "since 1970": (log("t,X,Y,Z,A,B,C\n", ",", "{:.2f}", since=1.7e12), XYZ | CLOCK),
}  # fmt: skip


@pytest.mark.parametrize("name", LOGS)
def test_a_log_is_the_path_that_it_holds(tmp_path, name):
    text, columns = LOGS[name]
    (tmp_path / "log.csv").write_text(text)
    path = fm.read_path(tmp_path / "log.csv", columns=columns)
    np.testing.assert_allclose(path.points, POINTS, atol=1e-9)
    np.testing.assert_allclose(path.time - path.time[0], TIMES, atol=1e-6)
    assert path.names == ("path",) * 3


def test_a_log_without_times_or_of_a_known_rate(tmp_path):
    (tmp_path / "log.csv").write_text(LOGS["blanks"][0])
    assert fm.read_path(tmp_path / "log.csv", columns=XYZ).time is None
    path = fm.read_path(tmp_path / "log.csv", columns=XYZ | {"sampling_rate_Hz": 125.0})
    np.testing.assert_allclose(path.time, np.arange(4) / 125)


def test_a_column_names_the_segments(tmp_path):
    (tmp_path / "log.csv").write_text("X,Y,Z,step\n800,0,440,down\n800,0,400,up\n800,0,440,up\n")
    columns = XYZ | {"segment": "step"}
    assert fm.read_path(tmp_path / "log.csv", columns=columns).names == ("down", "up")
    text = (tmp_path / "log.csv").read_text()
    (tmp_path / "log.csv").write_text(f"{text.removesuffix(',up' + chr(10))},\n")
    assert fm.read_path(tmp_path / "log.csv", columns=columns).names == ("down", "up")  # at the last row none begins
    (tmp_path / "log.csv").write_text(text.replace("up", "", 1))
    with pytest.raises(fm.ForcemapError, match="expected that of the segment whose motion begins at this row"):
        fm.read_path(tmp_path / "log.csv", columns=columns)


ROWS = "t,X,Y,Z\n0,800,0,440\n100,800,0,420\n"
REFUSED = {
    "unit of length": (ROWS, {"position": ["X", "Y", "Z"]}, "length_unit, the unit of the positions: m, cm, mm, in"),
    "unit of time": (ROWS, XYZ | {"time": "t"}, "time_unit: not stated; expected time_unit, the unit of"),
    "no unit": (
        ROWS, {"position": ["X", "Y", "Z"], "time": "t"},
        "positions: m, cm, mm, in; time_unit, the unit of the time column: s, ms, us or ns"),
    "no such unit": (ROWS, XYZ | {"length_unit": "yd"}, "length_unit: found 'yd', expected one of m, cm, mm, in"),
    "milliseconds as seconds": (
        "t,X,Y,Z\n0,800,0,440\n1,800,0,439\n2,800,0,438\n", XYZ | {"time": "t", "time_unit": "s"},
        "found samples 1 s apart (median), slower than any controller writes a log; correct time_unit"),
    "a sample a second": (
        ROWS, XYZ | {"sampling_rate_Hz": 1.0}, "slower than any controller writes a log; correct sampling_rate_Hz"),
    "one column": (ROWS, XYZ | {"position": "X"}, "position: found 'X', expected three columns such as position=X,Y,Z"),
    "no such entry": (ROWS, XYZ | {"force": "X"}, "force: unknown entry"),
    "no such column": (ROWS, XYZ | {"position": ["X", "Y", "H"]}, "column H: no column is named 'H'; found 't', 'X'"),
    "a column twice": (ROWS, XYZ | {"position": ["X", "Y", "Y"]}, "found a column in two places"),
    "metres in mm": (ROWS, XYZ | {"length_unit": "m"}, "at most 10 m; positions are in metres"),
    "names say otherwise": (
        ROWS.replace("X,Y,Z", "X [m],Y [m],Z [m]"),
        {"position": ["X [m]", "Y [m]", "Z [m]"], "length_unit": "mm"},
        "column X [m]: the file says 'm', the column map length_unit = 'mm'"),
    "a line says otherwise": (
        ROWS.replace("Z\n", "Z\ns,in,in,in\n"), XYZ, "column X: the file says 'in', the column map length_unit = 'mm'"),
    "the time's name says otherwise": (
        ROWS.replace("t,", "t_s,"), XYZ | {"time": "t_s", "time_unit": "ms"}, "the file says 's'"),
    "no number": (ROWS + "200,800,x,400\n300,800,0,380\n", XYZ, "row 4, column Y: found 'x', expected a number"),
    "cut off": (ROWS + "200,800,0,400\n300,80", XYZ | CLOCK, "row 5, is cut off and left out: expected a whole log"),
    "more below": (ROWS + "200,800,0,400\nend of log\n", XYZ | CLOCK, "left out: expected a whole log"),
    "thousands": ("X;Y;Z\n1,100;0,100;0,440\n1,200;0,100;0,440\n".replace("0,", "1,"), XYZ, "state decimal"),
    "one point": ("X,Y,Z\n800,0,440\n", XYZ, "found 1 points, expected at least two"),
    "back in time": ("t,X,Y,Z\n100,800,0,440\n0,800,0,420\n", XYZ | CLOCK, "row 3, column t: found 0 s"),
    "no log": ("", XYZ, "the file is empty"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_could_be_read_wrongly_is_refused(tmp_path, name):
    text, columns, said = REFUSED[name]
    (tmp_path / "log.csv").write_text(text)
    with pytest.raises(fm.InputError) as error:
        fm.read_path(tmp_path / "log.csv", columns=columns)
    assert said in str(error.value)


def test_commands_read_a_log(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text(LOGS["lines of header and units"][0])
    (tmp_path / "path.csv").write_text("time_s,x_m,y_m,z_m\n" + "".join(
        f"{t},{x},{y},{z}\n" for t, (x, y, z) in zip(TIMES, POINTS, strict=True)))  # fmt: skip
    hand = ["--area", "back_of_hand", "--contact", "transient"]
    words = ["position=X,Y,Z", "length_unit=mm", "time=t", "time_unit=ms"]
    columns = [each for word in words for each in ("--column", word)]
    answers = []
    for file in (["log.csv", *columns], ["path.csv"]):
        code = run(["path", "ur10e", *file, *hand, "--json"])
        answers.append((code, json.loads(capsys.readouterr().out)["pieces"]))
        assert run(["export-path", "ur10e", *file, *hand, "-o", f"{file[0]}.scaling"]) == 0
        capsys.readouterr()
    assert answers[0][0] == answers[1][0]
    for one, other in zip(answers[0][1], answers[1][1], strict=True):
        assert one["speed_mps"] == pytest.approx(other["speed_mps"])
        assert one["programmed_speed_mps"] == pytest.approx(other["programmed_speed_mps"])
    capsys.readouterr()
    assert run(["path", "ur10e", "log.csv", *hand]) == 2
    assert (
        "needs a column map, in path and export-path (--column position=X,Y,Z --column length_unit=mm)"
        in capsys.readouterr().err
    )
    (tmp_path / "other.csv").write_text("X,Y,Z\n800,0,440\n800,0,400\n")
    assert run(["path", "ur10e", "other.csv", *hand]) == 2
    assert "found 'X', 'Y', 'Z', expected x_m, y_m, z_m" in capsys.readouterr().err
    assert run(["path", "ur10e", "other.csv", *hand, *columns[:4], "--robot", "ur10e"]) == 2
    assert "a column map is one of positions" in capsys.readouterr().err


@pytest.mark.parametrize(("unit", "refused"), [("us", "at most 10 m/s"), ("ms", ""), ("s", "correct time_unit")])
def test_times_in_another_unit_than_the_files_do_not_make_a_path(tmp_path, unit, refused):
    """Rows of 8 ms: taken for seconds, 0.5 m/s would look like 0.0005 m/s, and nothing would be too fast."""
    log = tmp_path / "log.csv"
    log.write_text("T,X,Y,Z\n" + "".join(f"{8 * i},700,0,{400 - 4 * i}\n" for i in range(30)))
    columns = {"position": ["X", "Y", "Z"], "length_unit": "mm", "time": "T", "time_unit": unit}
    if not refused:
        assert len(fm.read_path(log, columns=columns).points) == 30
    else:
        with pytest.raises(fm.InputError, match=refused):
            fm.read_path(log, columns=columns)


RTDE = "t;X;Y;Z;{}\n"


@pytest.mark.parametrize(
    ("name", "values", "slowed"),
    [
        ("speed_scaling", (0.4, 0.4, 0.4, 0.4), 0.4),
        ("target_speed_fraction", (1.0, 1.0, 0.5, 1.0), 0.5),
        ("Override [%]", (0, 100, 30, 100), 0.3),
        ("$OV_PRO", (100, 100, 50, 100), 0.5),
        ("OV_PRO", (1, 1, 1, 1), 0.01),
        ("Feed rate %", ("50 %", "50 %", "100 %", "100 %"), 0.5),
        ("SpeedRatio", (1.0, 0.3, 1.0, 1.0), 0.3),
        ("Geschwindigkeit %", (100, 80, 100, 100), 0.8),
        *[
            (name, (50, 50, 50, 50), 0.5)
            for name in ("Speed [%]", "speed (%)", "Velocity [%]", "OVR [%]", "Tempo [%]", "v_pct")
        ],
        ("Override status", (30, 30, 30, 30), 0.3),  # may be a word, and may be the override
        ("speed_scaling", (2, 2, 2, 2), 0.02),
        *[(name, (0.5, 0.5, 0.5, 0.5), 0.5) for name in ("speed_factor", "SpeedMul")],
        ("speed_scaling", (0.0, 1.0, 1.0, 1.0), None),  # it stands
        ("Override [%]", (100, 100, 100, 100), None),
        ("speed_scaling", (1.02, 1.02, 1.02, 1.02), None),
        *[(name, (25, 25, 25, 25), 0.25) for name in ("ovr", "OV", "spd_ovrd", "Geschw. %", "Vitesse %")],
        *[(name, (100, 100, 100, 100), None) for name in ("OVRD", "ROB_OV", "Geschw. %", "Vitesse %", "override")],
        *[(name, (1, 1, 1, 1), "not told") for name in ("acceleration_scaling_factor", "Override enabled")],
        *[(name, (100, 100, 100, 100), "not told") for name in ("jog_override", "override_max", "force_override")],
        ("override", (500, 500, 500, 500), "not told"),  # per mille, or whatever it is
        *[(name, (100, 100, 100, 100), "not told") for name in ("OverrideOn", "override_id", "Override_Achse7")],
        ("OV_PRO;MODE_OP", ("100;T1", "100;T1", "100;T1", "100;T1"), "not told"),  # at most 0.25 m/s there
        ("OV_PRO;MODE_OP", ("100;EXT", "100;EXT", "100;EXT", "100;EXT"), None),
        *[(name, (3, 3, 3, 3), "not told") for name in ("joint_speed_ratio_limit", "feed rate [mm/s]", "safety_mode")],
        ("current", (0.4, 0.4, 0.4, 0.4), "not told"),
        ("Override", ("ON", "ON", "ON", "ON"), "not told"),
    ],
)
def test_a_log_of_a_slowed_run_says_so(tmp_path, name, values, slowed):
    """What is as programmed in it is not what the program does."""
    rows = [
        ";".join([*(f"{x:g}" for x in (1000 * t, *(1000 * p))), str(v)])
        for t, p, v in zip(TIMES, POINTS, values, strict=True)
    ]
    (tmp_path / "log.csv").write_text(RTDE.format(name) + "\n".join(rows) + "\n")
    path = fm.read_path(tmp_path / "log.csv", columns=XYZ | CLOCK)
    said = [] if slowed is None else ["log_full_speed_untold" if slowed == "not told" else "log_slowed"]
    assert [each.kind.value for each in path.doubts] == said
    task = fm.Task((fm.TaskSegment("path", ("back_of_hand",), fm.Contact.TRANSIENT),))
    found = fm.path_speeds(fm.published_map("ur10e"), path, task, bound=fm.FixedMargin(0.1))
    assert [each.kind.value for each in found.doubts][: len(path.doubts)] == said
    assert "as_logged" in {each.kind.value for each in found.notes}
    if said == ["log_slowed"]:
        assert path.doubts[0].figure("lowest") == pytest.approx(slowed)


@pytest.mark.parametrize(("rate", "refused"), [(5.0, False), (5.2, False), (2.0, True), (50.0, True)])
def test_a_rate_that_the_times_of_a_log_contradict_is_refused(tmp_path, rate, refused):
    (tmp_path / "log.csv").write_text(LOGS["units in names"][0])
    columns = {"position": ["X [mm]", "Y [mm]", "Z [mm]"], "length_unit": "mm", "sampling_rate_Hz": rate}
    if refused:
        with pytest.raises(fm.ForcemapError, match=r"found rows 0.2 s apart by this column, sampling_rate_Hz"):
            fm.read_path(tmp_path / "log.csv", columns=columns)
    else:
        assert len(fm.read_path(tmp_path / "log.csv", columns=columns)) == 3


@pytest.mark.parametrize(("rate", "refused"), [(2000.0, False), (1000.0, True)])
def test_times_that_repeat_for_they_are_rounded_contradict_no_rate(tmp_path, rate, refused):
    rows = [f"{i // 2};{min(i, 60 - i) if i < 60 else 0}" for i in range(400)]
    (tmp_path / "impact.csv").write_text("Time [ms];Force [N]\n" + "\n".join(rows) + "\n")
    columns = fm.ColumnMap(sampling_rate=rate, force="Force [N]")
    if refused:
        with pytest.raises(fm.ForcemapError, match="state the column as time, or the rate that it has"):
            fm.read_recording(tmp_path / "impact.csv", columns=columns)
    else:
        assert fm.read_recording(tmp_path / "impact.csv", columns=columns).sampling_rate == pytest.approx(rate)


def kinds(moved=100.0, **columns):
    """The doubts that columns give of four rows, `moved` [mm] apart; one cell is that of every row."""
    cells = [
        (name.replace("__", " "), each if isinstance(each, list) else [each] * 4) for name, each in columns.items()
    ]
    rows = np.column_stack([np.arange(4) * moved / 1000, np.zeros((4, 2))])
    return [finding.kind.value for finding in doubts_of_full_speed(cells, rows, log=True)]


UNTOLD, SLOWED = ["log_full_speed_untold"], ["log_slowed"]


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        (["1"] * 4, []),
        (["1", "1", "1", ""], []),  # no motion begins at the last row
        (["1", "", "", ""], UNTOLD),
        (["1", "half", "1", "1"], UNTOLD),
        (["1", "", "0.5", "1"], SLOWED),
        (["0,5", "1,0", "1,0", "1,0"], SLOWED),
        (["0", "0", "0", "1"], UNTOLD),  # the robot moves there
        (["-1", "-1", "-1", "1"], UNTOLD),
        (["nan"] * 4, UNTOLD),
        ([""] * 4, UNTOLD),
    ],
)
def test_a_column_of_the_override_tells_of_full_speed_only_where_it_is_filled_in_every_row_that_moves(cells, said):
    assert kinds(speed_scaling=cells) == said


def test_an_override_of_zero_where_the_robot_stands_says_nothing_against_full_speed():
    assert kinds(moved=0.5, speed_scaling=["0", "0", "0", "1"]) == []
    assert kinds(moved=0.5, speed_scaling=["1"] * 4, other=["0"] * 4) == []


OF_SOMETHING_ELSE = (
    "gripper_speed_percent spindle_override Laser__override__[%] fan__speed__% Pump__speed__percent feeder__speed__% "
    "screwdriver_speed_pct velocity_filter_factor override_cmd speed_override_setpoint Override__Soll__[%] "
    "default_override Override__aktiv override_request acceleration_override"
)


@pytest.mark.parametrize("name", OF_SOMETHING_ELSE.split())
def test_only_what_is_known_to_be_the_robots_override_tells_of_full_speed(name):
    assert kinds(**{name: "100"}) == UNTOLD
    assert kinds(**{name: "100", "speed_scaling": "1.0"}) == []
    assert kinds(**{name: "100", "speed_scaling": "0.5"}) == SLOWED


@pytest.mark.parametrize("name", ["$RED_VEL", "Speed reduction", "Geschwindigkeitsreduktion"])
def test_a_share_by_which_a_robot_is_slowed_is_said_whatever_the_override(name):
    assert kinds(**{name: "10", "override": "100"}) == SLOWED
    assert kinds(**{name: "0", "override": "100"}) == []


@pytest.mark.parametrize("name", ["jog_override", "spindle_override", "gripper_speed_percent", "acc_override"])
def test_an_override_of_another_device_is_no_doubt_beside_the_robots_own(name):
    assert kinds(**{name: "10", "speed_override": "100"}) == []
    assert kinds(OV_APPL="50", speed_override="100") == SLOWED  # nobody knows whose that is


def test_an_override_that_is_one_everywhere_may_be_a_flag_or_a_percent():
    assert kinds(speed_override="1") == kinds(override="1") == UNTOLD
    assert kinds(speed_override="1.0") == kinds(speed_scaling="1") == []


@pytest.mark.parametrize(
    ("column", "cell", "automatic"),
    [
        ("MODE_OP", "#EX", True), ("mode", "AUTO", True), ("safety_mode", "1", True), ("robot_mode", "7", True),
        ("mode", "Automatik", True), ("joint_mode_0", "253", True), ("gripper_model", "Hand-E", True),
        ("reduced_mode", "0", True), ("is_manual", "False", True), ("program", "pick", True),
        ("Betriebsart", "Handbetrieb", False), ("Betriebsart", "Tippbetrieb", False),
        ("Betriebsart", "Einrichten", False), ("op_mode", "SETUP", False),
        ("op_mode", "1", False), ("mode", "ModeT1", False), ("mode", "T 1", False),
        ("mode", "SLOW", False), ("mode", "250 mm/s", False), ("mode", "", False),
        ("operating_mode", "HandGuiding", False),
        ("reduced_mode", "1", False), ("reduced_mode", "True", False), ("manual_mode", "True", False),
        ("safety_mode", "2", False), ("safety_mode", "REDUCED", False), ("robot_mode", "5", False),
        ("key_switch", "T1", False), ("opstate", "#T1", False), ("Operation", "MANUAL", False), ("T1", "1", False),
        ("mode", "MANUAL_REDUCED_SPEED", False), ("mode", "Test run", False), ("mode", "Dry run", False),
        ("mode", "Step run", False), ("mode", "Run 30 %", False), ("mode", "Not automatic", False),
        ("mode", "Auto off", False), ("mode", "Automatic 250 mm/s", False), ("mode", "AUTO 250", False),
        ("Key switch", "T1 250 mm/s", False), ("Controller state", "Manual reduced speed", False),
        ("Betrieb", "Einrichtbetrieb mit 250 mm/s", False), ("dry run", "10 percent", False),
        ("mode", "ROBOT_MODE_RUNNING", True), ("safety_mode", "NORMAL", True), ("operation mode", "#AUT", True),
    ],
)  # fmt: skip
def test_only_modes_that_are_known_to_be_automatic_say_nothing_against_full_speed(column, cell, automatic):
    assert kinds(**{column: cell, "speed_scaling": "1.0"}) == ([] if automatic else UNTOLD)


def test_modes_in_any_column_of_a_log_are_read(tmp_path):
    for cell, said in (("T1", UNTOLD), ("pick", [])):
        rows = "".join(
            f"{1000 * t:g};{1000 * x};{1000 * y};{1000 * z};{cell};1.0\n"
            for t, (x, y, z) in zip(TIMES, POINTS, strict=True)
        )
        (tmp_path / "log.csv").write_text(f"t;X;Y;Z;key_switch;speed_scaling\n{rows}")
        assert [each.kind.value for each in fm.read_path(tmp_path / "log.csv", columns=XYZ | CLOCK).doubts] == said


def test_positions_without_times_are_not_held_against_a_rate_that_nobody_stated(tmp_path):
    log, columns = tmp_path / "log.csv", {"position": ["X", "Y", "Z"], "length_unit": "mm"}
    rows = "".join(f"{700 + i};0;{400 - 2 * i}\n" for i in range(30))
    log.write_text(f"Robot UR\nSample rate [Hz];500\nX;Y;Z\n{rows}")
    assert fm.read_path(log, columns=columns).time is None
    with pytest.raises(fm.ForcemapError, match=r"the file says 'Sample rate \[Hz\];500'"):
        fm.read_path(log, columns=columns | {"sampling_rate_Hz": 50.0})
    log.write_text("t [s];X;Y;Z\n" + "".join(f"{8 * i / 1000};{row}\n" for i, row in enumerate(rows.splitlines())))
    with pytest.raises(fm.ForcemapError, match=r"found a column of times, expected it to be stated"):
        fm.read_path(log, columns=columns)
