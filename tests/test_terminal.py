"""Answers on a terminal: the verdict line first, tables within 100 columns, colour that permits nothing."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
import tomllib

import numpy as np
import pytest
from hypothesis import given, strategies as st

import forcemap as fm
from forcemap.campaigns.template import campaign_text, completed_text
from forcemap.cli.output import table, verdict_first, wrapped

AT = ("--distance", 0.8, "--height", 0.4)
HAND = ("--area", "back_of_hand", "--contact", "transient")
RANGES = ("--distances-m", "0.52,0.89", "--heights-m", "0.14,0.46", "--speeds-mps", "0.2,0.4")
SENTENCES = st.lists(st.text("abcde fg", min_size=1, max_size=150).filter(str.strip), max_size=4)


@given(SENTENCES, st.booleans())
def test_a_verdict_says_itself_what_stands_directly_below_it(doubts, simulated):
    verdict, *below = verdict_first("Program at most 0.2 m/s", doubts, simulated=simulated)
    assert verdict.startswith("Program at most 0.2 m/s")
    assert ("; SIMULATED" in verdict) == simulated
    assert len(below) == len(doubts) + simulated
    assert [line.startswith("  ! ") for line in below] == [False] * simulated + [True] * len(doubts)
    said = re.search(r"; first read the (?:(\d+) doubts|doubt) below$", verdict)
    assert (int(said[1] or 1) if said else 0) == len(doubts)


CELLS = st.lists(st.text("ab-", min_size=1, max_size=14), min_size=1, max_size=4).map(" ".join)


@given(st.integers(1, 6).flatmap(lambda n: st.lists(st.lists(CELLS, min_size=n, max_size=n), min_size=1, max_size=4)))
def test_a_table_stays_within_100_columns_and_breaks_no_word(rows):
    """Columns are read back by their places: where a column of blanks parts them in every line."""
    header = [f"c{number}" for number in range(len(rows[0]))]
    lines = table(header, rows)
    assert max(map(len, lines)) <= 100  # six columns of one word of at most 14 letters always fit
    words = sorted(" ".join(lines).split())
    assert words == sorted(word for row in [header, *rows] for cell in row for word in cell.split())
    if len(lines) == len(rows) + 1:  # nothing had to be broken: aligned
        assert [re.split(r" {2,}", line.strip()) for line in lines] == [header, *rows]


@given(SENTENCES)
def test_what_continues_a_line_is_indented_as_its_text(lines):
    for mark in ("  ! ", "  - ", "  2. ", "  bound    "):
        parts = wrapped([mark + " ".join([*"".join(lines).split(), *["end"] * 40])])
        assert all(len(part) <= 100 for part in parts)
        assert all(len(part) - len(part.lstrip()) == len(mark) for part in parts[1:])


COMMANDS = {
    "speed": ("speed", "{folder}", *AT, *HAND),
    "speed-map": ("speed-map", "{folder}", *HAND, "--step-m", 0.1),
    "fit": ("fit", "{folder}"),
    "evaluate": ("evaluate", "{folder}"),
    "check": ("check", "{folder}", *HAND[:2]),
    "collect": ("collect", "{folder}"),
    "export": ("export", "{folder}", *HAND, "--format", "csv", "-o", "zones.csv"),
    "path": ("path", "{folder}", "down.csv", *HAND),
    "place": ("place", "{folder}", "stroke.csv", *HAND, "--step-m", 0.1),
    "compare": ("compare", "{folder}", *HAND[:2]),
    "estimate": ("estimate", "{folder}", *AT, "--speed-mps", 0.3, "--area", "chest"),
    "report": ("report", "{folder}", *HAND[:2], "-o", "report.html"),
    "next": ("next", "{folder}/impacts.csv", *HAND),
    "forms": ("evaluate", "{folder}", "--forms"),
    "select": ("select", "{folder}"),
    "export-path": ("export-path", "{folder}", "down.csv", *HAND, "--format", "safety", "-o", "sheet.md"),
}


@pytest.fixture
def cell(simulated, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "down.csv").write_text("x_m,y_m,z_m\n0.8,0,0.4\n0.8,0,0.3\n")
    (tmp_path / "stroke.csv").write_text("x_m,y_m,z_m\n0,0,0.1\n0,0,0\n")
    return simulated


@pytest.mark.parametrize("name", COMMANDS)
def test_the_verdict_line_comes_first_and_what_must_be_read_with_it_directly_below(name, cell, forcemap, ask):
    command = [str(word).format(folder=cell) for word in COMMANDS[name]]
    _, out, err = forcemap(*command)
    assert err == ""
    assert max(map(len, out.splitlines())) <= 100
    lines = re.sub(r"\n    +(?=\S)", " ", out).splitlines()
    assert not lines[0].startswith(("  ! ", "SIMULATED"))
    said = re.search(r"; SIMULATED(?:; first read the (?:(\d+) doubts|doubt) below)?$", lines[0])
    assert said, lines[0]
    count = int(said[1] or 1) if "first read" in said[0] else 0
    assert lines[1] == "  SIMULATED impacts: not a measurement of any robot"
    assert [line.startswith("  ! ") for line in lines[2:]] == [number < count for number in range(len(lines) - 2)]
    doubts = [line.removeprefix("  ! ") for line in lines[2 : 2 + count]]
    if "warnings" in (found := ask(*command)[1]) and name != "estimate":
        assert [" ".join(doubt.split()) for doubt in doubts] == found["warnings"]


def on_a_terminal(*arguments, **environment):
    """What a command prints on a terminal, and on which of its streams are terminals."""
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "forcemap", *map(str, arguments)]
    kept = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "TERM", "FORCE_COLOR")}
    with subprocess.Popen(command, stdout=theirs, stderr=theirs, env=kept | {"TERM": "xterm"} | environment) as process:
        os.close(theirs)
        printed = b""
        while True:
            try:
                part = os.read(ours, 65536)
            except OSError:  # the other side is closed
                break
            if not part:
                break
            printed += part
    os.close(ours)
    return process.returncode, printed.decode().replace("\r\n", "\n")


def test_a_terminal_shows_colour_unless_a_person_wants_none(forcemap):
    command = ("speed", "ur10e", *AT, *HAND)
    plain = forcemap(*command)[1]
    code, coloured = on_a_terminal(*command)
    assert code == 0
    assert "\x1b[1m" in coloured.splitlines()[0]  # the verdict
    yellow = [line for line in coloured.splitlines() if line.startswith("\x1b[33m")]
    assert yellow[0].startswith("\x1b[33m  ! FIXED MARGIN")
    assert "\x1b[32m" not in coloured  # no colour says yes
    assert re.sub("\x1b\\[[0-9;]*m", "", coloured) == plain
    assert on_a_terminal(*command, NO_COLOR="1") == (0, plain)


def test_an_error_is_one_line_for_programs_and_wrapped_on_a_terminal(forcemap, tmp_path):
    wrong = ("speed", "ur10e", *AT, "--area", "hand", "--contact", "transient", "--bound", "x" * 90)
    _, _, err = forcemap(*wrong)
    assert err.count("\n") == 1
    code, shown = on_a_terminal(*wrong)
    assert code == 2
    assert shown.startswith("\x1b[31merror: ")
    plain = re.sub("\x1b\\[[0-9;]*m", "", shown)
    assert " ".join(plain.split()) == " ".join(err.split())


@pytest.mark.parametrize(
    ("name", "nearest"),
    [
        ("hand", ["back_of_hand", "hand_fingers"]),
        ("finger", ["hand_fingers", "forefinger_pad", "forefinger_end_joint"]),
        ("elbow", ["upper_arm_elbow"]),
        ("thighs_and_knees", ["thigh_knee", "thigh_muscle", "kneecap"]),
    ],
)
def test_a_part_of_a_name_finds_the_body_area(ask, name, nearest):
    code, found = ask("limits", name)
    assert code == 2
    assert found["error"]["message"].endswith(f"the nearest are {', '.join(nearest)}; forcemap limits lists all")


def test_a_place_in_millimetres_is_outside_with_the_measured_range(forcemap):
    code, out, _ = forcemap("speed", "ur10e", "--distance", 800, "--height", 400, *HAND)
    assert code == 1
    assert out.startswith("No speed to program at d = 800 m, h = 400 m: outside")
    assert "measured distances 0.520 to 0.890 m, heights 0.140 to 0.460 m" in out
    assert "distances and heights are in m: 800 mm are 0.8" in out
    assert "are in m" not in forcemap("speed", "ur10e", "--distance", 1.2, "--height", 0.4, *HAND)[1]


def test_an_earlier_spelling_of_the_area_still_works_and_is_not_shown(ask, forcemap):
    asked = [ask("speed", "ur10e", *AT, *words, *HAND[2:]) for words in (HAND[:2], ("--region=back_of_hand",))]
    assert asked[0] == asked[1]
    for command in ("speed", "path", "export", "report", "compare", "estimate", "check", "plan"):
        out = forcemap(command, "--help")[1]
        assert "--area" in out
        assert "--region" not in out


@pytest.mark.parametrize("command", ["compare", "report", "fleet"])
def test_no_body_area_is_assumed_but_that_of_the_contact_points_is_taken(command, forcemap, ask, tmp_path):
    folder = tmp_path / "cell"
    if command == "compare":
        fm.copy_example("kuka-iiwa7-10nm", folder)
    else:  # a plan alone: quickly reported
        assert planned(ask, folder, "--device-range-N", 500)[0] == 0
    where = {"compare": (folder,), "report": (folder, "-o", tmp_path / "r.html")}
    words = (command, *where.get(command, (folder, "-o", tmp_path / "f.html")))
    code, out, err = forcemap(*words)
    assert code != 0
    assert "expected --area, the body area or region that can be hit" in " ".join((out + err).split())
    point = "P1,H,flange,0.7,0.3,down,thigh_muscle,transient,free,map"
    columns = "point_id,hazard,contact_site,distance_m,height_m,direction,body_area,contact,body,rests_on"
    (folder / "contact_points.csv").write_text(f"{columns}\n{point}\n")
    code, found = ask(*words)
    assert code == (command == "fleet")  # which has no map to show
    assert "thigh_muscle" in str(found)
    assert "hand_fingers" not in str(found.get("speeds", found.get("area", "")))


def test_a_folder_that_was_not_collected_says_so(ask, tmp_path):
    assert ask("plan", tmp_path / "cell", *RANGES, "--device-range-N", 500)[0] == 0
    for source in (tmp_path / "cell", tmp_path / "cell" / "impacts.csv"):
        for command in (("fit", source), ("speed", tmp_path / "cell", *AT, *HAND)):
            code, found = ask(*command)
            assert code == 2
            message = found["error"]["message"]
            assert "not collected" in message
            assert message.endswith(f"forcemap collect {tmp_path / 'cell'} writes it")
    (tmp_path / "empty").mkdir()
    assert "forcemap plan makes one" in ask("fit", tmp_path / "empty")[1]["error"]["message"]


def test_fit_says_what_comes_next(forcemap, cell):
    out = " ".join(forcemap("fit", cell)[1].split())
    assert f"Next: forcemap speed-map {cell} --area AREA --contact transient" in out


def planned(ask, folder, *options):
    return ask("plan", folder, *RANGES, *options)


@pytest.mark.parametrize("before", ["", "[robot]\nmodel = 'x' # mine\n", None])
def test_plan_completes_a_campaign_toml(ask, forcemap, tmp_path, before):
    """An own file, one without sections, and the template with its comments; nothing else in it changes."""
    folder = tmp_path / "cell"
    folder.mkdir()
    text = campaign_text(fm.Conditions()) if before is None else f'schema = "forcemap-campaign/1"\n{before}'
    (folder / "campaign.toml").write_text(text)
    options = ("--device-range-N", 500, "--device-spring-N-per-mm", 75, "--moving-mass-kg", 30)
    code, out, _ = forcemap("plan", folder, *RANGES, *options)
    assert code == 0
    added = "robot.moving_mass_kg = 30.0, device.range_N = 500.0, device.stiffness_N_per_m = 75000.0"
    assert f"campaign.toml was there; added to it: {added}" in " ".join(out.split())
    stated = fm.read_conditions(folder / "campaign.toml")
    assert (stated.device.range, stated.device.stiffness, stated.moving_mass) == (500, 75000, 30)
    assert stated.to_tables() == completed_of(text).to_tables()
    old, new = text.splitlines(), (folder / "campaign.toml").read_text().splitlines()
    assert len([line for line in old if line not in new]) == (
        4 if before is None else 0
    )  # comments that are stated now
    (folder / "plan.csv").unlink()
    code, found = planned(ask, folder, "--device-range-N", 400)
    assert code == 2
    assert "state it there (device.range_N = 400.0)" in found["error"]["message"]


def completed_of(text):
    tables = tomllib.loads(text)
    tables.setdefault("device", {}).update(range_N=500.0, stiffness_N_per_m=75000.0)
    tables.setdefault("robot", {}).update(moving_mass_kg=30.0)
    return fm.Conditions.from_tables({name: part for name, part in tables.items() if name != "schema"})


def test_plan_leaves_a_campaign_toml_that_it_cannot_complete(ask, tmp_path):
    text = 'schema = "forcemap-campaign/1"\ndevice = { model = "x" }\n'
    (tmp_path / "campaign.toml").write_text(text)
    code, found = planned(ask, tmp_path, "--device-range-N", 500)
    assert code == 2
    assert "state it there (device.range_N = 500.0, plan.fastest_mps = 0.4" in found["error"]["message"]
    assert (tmp_path / "campaign.toml").read_text() == text
    assert not (tmp_path / "plan.csv").exists()


@given(st.text("ab \n#=[]'", max_size=40))
def test_completing_a_file_keeps_every_other_line(note):
    text = f"[device]\nmodel = 'x'\n# {' '.join(note.split())}\n[tool]\nname = 'y'\n"
    done = tomllib.loads(completed_text(text, {"device.range_N": 500.0, "robot.moving_mass_kg": 30.0}))
    assert done == {
        "device": {"model": "x", "range_N": 500.0},
        "tool": {"name": "y"},
        "robot": {"moving_mass_kg": 30.0},
    }


@pytest.mark.parametrize("name", fm.PUBLISHED_MAPS)
@pytest.mark.parametrize("area", ["back_of_hand", "thigh_muscle"])
def test_the_standard_beside_a_map_is_what_its_formula_and_the_map_give(ask, name, area):
    """Place by place: the standard's speed, the map's prediction at it, and where the map permits more."""
    force_map, limit = fm.published_map(name), fm.force_limit(area)
    for contact in fm.Contact:
        _, found = ask("speed-map", name, "--area", area, "--contact", contact, "--step-m", 0.1)
        mass = fm.pfl_robot_mass(force_map.conditions.moving_mass, force_map.conditions.payload)
        figures = {"robot_mass": mass, "body_mass": np.inf, "stiffness": limit.stiffness}
        speed = float(fm.pfl_speed_limit(limit.force(contact), **figures))
        standard = found["standard"]
        assert standard["speed_mps"] == pytest.approx(speed)
        inside = [place for place in found["places"] if place["outcome"] != "outside"]
        assert standard["places"] == len(inside)
        usable = [place["speed_mps"] for place in inside if place["speed_to_program_mps"] is not None]
        assert standard["places_with_more"] == sum(each > speed for each in usable)
        assert standard["highest_speed_of_map_mps"] == (max(usable) if usable else None)
        forces = [
            float(force_map.predict(place["distance_m"], place["height_m"], speed))
            for place in inside
            if place["lowest_measured_speed_mps"] <= speed <= place["highest_measured_speed_mps"]
        ]
        assert standard["lowest_predicted_force_N"] == (pytest.approx(min(forces)) if forces else None)
        assert standard["highest_predicted_force_N"] == (pytest.approx(max(forces)) if forces else None)


def test_the_standard_has_no_speed_for_newtons_or_the_head(ask):
    for limit in (("--limit-N", 200), ("--area", "temple", "--contact", "transient")):
        assert ask("speed-map", "ur10e", *limit, "--step-m", 0.2)[1]["standard"] is None
