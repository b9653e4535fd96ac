"""Several maps together in commands, files, report and page, on simulated campaigns in three directions."""

from __future__ import annotations

import csv
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import forcemap as fm
from conftest import made_once
from forcemap.answers.path import GapAnswer
from forcemap.campaigns.template import campaign_text
from forcemap.cli.path import gap_lines
from forcemap.direction import direction_vector
from forcemap.paths.atlas import is_atlas
from test_web import client_of

AREA = ("--area", "thigh_muscle", "--contact", "transient")
AT = ("--distance", 0.72, "--height", 0.3)
TASK = """schema = "forcemap-task/1"
[campaign]
tool = "none"
contact_sites = ["flange"]
payload_kg = 0.0
[[segments]]
name = "press"
areas = ["thigh_muscle"]
clamping_possible = false
speed_mps = 0.05
[[segments]]
name = "over"
areas = ["thigh_muscle"]
clamping_possible = false
speed_mps = 0.05
"""
PATH = "x_m,y_m,z_m,segment\n0.72,0,0.36,press\n0.72,0,0.30,over\n0.66,0,0.30,over\n"


def simulate(folder, direction, seed):
    """A campaign of the virtual ur10e-like robot in one direction: 27 states, an impact each."""
    from forcemap.lab.simulated_campaign import simulate_campaign
    from forcemap.lab.simulated_device import PAPER_DEVICE, SimulatedDevice
    from forcemap.lab.virtual_robot import virtual_robot

    plan = fm.plan_measurements([0.56, 0.84], [0.16, 0.44], [0.05, 0.35], repeats=1, again=0)
    device = SimulatedDevice(device=replace(PAPER_DEVICE, range=2000.0))
    along = direction_vector(direction, whose="the test")
    stated, rng = fm.Conditions(direction=direction), np.random.default_rng(seed)
    simulate_campaign(plan, virtual_robot("ur10e-like"), device, rng, folder, conditions=stated, along=along)
    fm.build_dataset(fm.read_campaign(folder))


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    def make(folder):
        folder.mkdir(parents=True, exist_ok=True)
        for seed, direction in enumerate(("down", "up", "in")):
            simulate(folder / direction, direction, seed)

    return made_once(tmp_path_factory, "atlas-of-three", make)


@pytest.fixture
def own(cell, tmp_path):
    """A copy of the atlas to change, with a path and a task beside it."""
    shutil.copytree(cell, tmp_path / "cell")
    (tmp_path / "path.csv").write_text(PATH)
    (tmp_path / "task.toml").write_text(TASK)
    return tmp_path / "cell"


def way(own, name="path.csv"):
    return str(own.parent / name)


def test_a_campaign_is_simulated_in_its_direction(cell):
    forces = {each: fm.read_dataset(cell / each).train.states.force for each in ("down", "up", "in")}
    np.testing.assert_allclose(forces["down"], forces["up"], rtol=0.05)  # opposite directions, other noise
    assert np.max(np.abs(np.log(forces["in"] / forces["down"]))) > 0.2
    assert fm.read_dataset(cell / "in").conditions.direction == "in"


@pytest.mark.parametrize("saved", ["rounded", "rounded to 1 N", "map file", "the file itself"])
def test_the_same_impacts_are_of_one_map_however_they_were_saved(own, tmp_path, saved):
    """A copy of a campaign with another direction: its files were saved anew, or are the campaign's own, or a map's."""
    fm.read_atlas(own)
    copy = own / "up"
    if saved == "map file":
        fm.write_map(fm.fit_force_map(fm.read_dataset(own / "down")), own / "down.json")
        (own / "atlas.toml").write_text('schema = "forcemap-atlas/1"\nmaps = ["down.json", "up"]\n')
    toml = (copy / "campaign.toml").read_text()
    shutil.rmtree(copy)
    shutil.copytree(own / "down", copy)
    (copy / "campaign.toml").write_text(toml)
    digits = {"rounded": 1, "rounded to 1 N": 0}.get(saved)
    for file in (copy / "recordings").glob("*.csv") if digits is not None else ():
        lines = file.read_text().split("\n")
        first = next(i for i, line in enumerate(lines) if line[:1].isdigit())
        cells = [line.split(",") for line in lines[first:] if line]
        rounded = [f"{each[0]},{float(each[1]):.{digits}f}" for each in cells]
        file.write_text("\r\n".join([*lines[:first], *rounded, ""]))
    (copy / "recordings.csv").unlink()
    fm.build_dataset(fm.read_campaign(copy))
    said = "recordings of down are those of up" if saved == "the file itself" else "states of down.* have the forces of"
    with pytest.raises(fm.InputError, match=said):
        fm.read_atlas(own)


def test_simulate_takes_the_direction_of_campaign_toml(forcemap, tmp_path):
    folder = tmp_path / "plan"
    folder.mkdir()
    stated = fm.Conditions(direction="Out", device=fm.Device(range=2000.0, stiffness=75e3))
    (folder / "campaign.toml").write_text(campaign_text(stated))
    case = ("--distances-m", "0.6,0.8", "--heights-m", "0.2,0.4", "--speeds-mps", "0.1,0.3", "--moving-mass-kg", "30")
    (folder / "campaign.toml").write_text(campaign_text(replace(stated, moving_mass=30.0)))
    assert forcemap("plan", folder, *case[:-2], "--states", "18", "--repeats", "1", "--again", "0")[0] == 0
    sheet = (folder / "run_sheet.txt").read_text()
    assert "its measuring face pointing in, so that the robot moves out" in sheet
    assert forcemap("simulate", folder, "--preset", "ur10e-like", "-o", tmp_path / "done")[0] == 0
    assert fm.read_conditions(tmp_path / "done" / "campaign.toml").direction == "Out"
    (folder / "campaign.toml").write_text(campaign_text(replace(stated, direction="sideways", moving_mass=30.0)))
    code, _, err = forcemap("simulate", folder, "--preset", "ur10e-like", "-o", tmp_path / "other")
    assert (code, "states 'sideways', expected one of down" in err) == (2, True)
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize("late", [False, True])
def test_names_that_stand_a_row_too_late_are_told_though_the_way_back_has_a_map(ask, own, late):
    """The way down is then named after the carry before it, whose contact is excluded, and the way up permitted."""
    ways = [("over", 0.66, 0.36), ("press", 0.72, 0.36), ("lift", 0.72, 0.30), ("over", 0.72, 0.36), ("", 0.66, 0.36)]
    names = ["", *(name for name, *_ in ways[:-1])] if late else [name for name, *_ in ways]
    names[0] = names[0] or "over"
    rows = [f"{x},0,{z},{name}" for name, (_, x, z) in zip(names, ways, strict=True)]
    (own.parent / "path.csv").write_text("\n".join(["x_m,y_m,z_m,segment", *rows]) + "\n")
    stated = TASK.partition("[[segments]]")[0]
    for name in ("press", "lift", "over"):
        contact = "contact_possible" if name == "over" else 'areas = ["thigh_muscle"]\nclamping_possible'
        stated += f'[[segments]]\nname = "{name}"\n{contact} = false\nspeed_mps = 0.05\n'
    (own.parent / "task.toml").write_text(stated)
    _, found = ask("path", own, way(own), "--task", way(own, "task.toml"))
    assert any(line.startswith("SEGMENT NAMES MAY STAND A ROW TOO LATE") for line in found["warnings"]) == late
    if late:
        outcomes = {piece["segment"]: piece["outcome"] for piece in found["pieces"]}
        assert outcomes["press"] == "admissible"  # the way up, which has a map of its own


def test_a_gap_says_what_it_gains_and_not_what_it_loses():
    gap = {
        "segments": ["lift", "a", "b", "c"],
        "direction": "up",
        "contact_site": "",
        "tool": "",
        "payload_kg": None,
        "length_m": 0.5,
        "states": 18,
    }
    for gain, said in ((1.2, ", 1.2 s faster than by the standard"), (-0.4, ""), (0.01, ""), (None, "")):
        _, line = gap_lines([GapAnswer(**gap, estimated_gain_s=gain)])
        what = "  for lift, a, b and 1 more, moving up: a campaign of at least 18 states"
        assert line == f"{what}, which may permit 0.500 m that has no permission now{said}"
    (_, line) = gap_lines([GapAnswer(**gap | {"direction": "0.834,0,0.552"}, estimated_gain_s=None)])
    assert "moving 12 degrees off up and out (direction 0.834,0,0.552): a campaign of" in line


def test_path_takes_a_folder_of_campaigns(ask, forcemap, own):
    code, found = ask("path", own, way(own), "--task", way(own, "task.toml"))
    assert code == 0
    assert found["permitted"]
    assert {(piece["segment"], piece["map_name"]) for piece in found["pieces"]} == {("press", "down"), ("over", "in")}
    assert [(each["name"], each["direction"], each["payload_kg"]) for each in found["maps"]] == [
        ("down", "down", 0.0), ("in", "in", 0.0), ("up", "up", 0.0)
    ]  # fmt: skip
    assert found["gaps"] == []
    assert found["suggestion"] is None
    assert found["simulated"]
    alone = ask("path", own / "down", way(own), *AREA)
    assert alone[0] == 1
    (gap,) = alone[1]["gaps"]
    assert (gap["direction"], gap["contact_site"], gap["states"]) == ("in", "flange", 18)
    assert found["map_sha256"] not in {each["map_sha256"] for each in found["maps"]}
    out = " ".join(forcemap("path", own / "down", way(own), *AREA)[1].split())
    states = "at least 18 states (flange, tool none, 0 kg), which may permit 0.060 m that has no permission now"
    assert f"for over, moving in: a campaign of {states}" in out
    assert gap["segments"] == ["over"]
    down = {piece["segment"]: piece["speed_mps"] for piece in alone[1]["pieces"]}
    assert down["press"] == {piece["segment"]: piece["speed_mps"] for piece in found["pieces"]}["press"]


def test_assumptions_of_several_maps_stand_by_map(ask, forcemap, own):
    for command in (("path", own, way(own), "--task", way(own, "task.toml")), ("speed", own, *AT, *AREA)):
        _, found = ask(*command)
        of_maps = found["assumptions_by_map"]
        assert {line for lines in of_maps.values() for line in lines} == set(found["assumptions"])
        assert sum(map(len, of_maps.values())) == len(set(found["assumptions"]))  # every line once
        assert any("direction of motion: down" in line for line in of_maps["down"])
        assert "person at rest" in of_maps[""]
        text = forcemap(*command)[1]
        assert "Assumes, of down alone" in text.splitlines()
        assert text.count("person at rest") == 1


def test_a_bent_path_is_written_and_does_what_is_said(ask, forcemap, own):
    slanted = own.parent / "slanted.csv"
    slanted.write_text("x_m,y_m,z_m\n0.74,0,0.36\n0.68,0,0.30\n")
    bent = own.parent / "bent.csv"
    code, found = ask("path", own, slanted, *AREA, "--suggest", bent)
    assert (code, found["permitted"]) == (1, False)
    assert found["suggestion"]["bent_moves"] == 1
    assert found["suggestion"]["permitted_share"] == 1.0
    again = ask("path", own, bent, *AREA)
    assert again[0] == 0
    assert again[1]["cycle_times"][0]["cycle_time_s"] == pytest.approx(found["suggestion"]["cycle_time_s"], rel=1e-5)
    out = forcemap("path", own, slanted, *AREA, "--suggest", bent)[1]  # an earlier result is replaced
    words = " ".join(out.split())
    assert "1 move bent to vertical, radial and circular ones, permitted as a whole" in words
    assert "checked for collisions" in words
    bent.write_text("something else")
    assert forcemap("path", own, slanted, *AREA, "--suggest", bent)[0] == 2
    code, found = ask(
        "path", own, bent.with_name("path.csv"), "--task", way(own, "task.toml"), "--suggest", own / "x.csv"
    )
    assert (found["suggestion"]["bent_moves"], (own / "x.csv").exists()) == (0, False)


def test_speed_gives_the_lowest_of_all_maps(ask, forcemap, own):
    case = ("--distance", "0.72", "--height", "0.36", *AREA)
    code, found = ask("speed", own, *case)
    each = {name: ask("speed", own / name, *case)[1]["speed_to_program_mps"] for name in ("down", "up", "in")}
    assert code == 0
    assert found["speed_to_program_mps"] == min(each.values())
    assert found["governed_by"] == min(each, key=each.get)
    assert {one["map"]["name"]: one["speed"]["speed_to_program_mps"] for one in found["maps"]} == each
    out = forcemap("speed", own, *case)[1]
    assert f"Program at most {fm.floor_speed(min(each.values()))} m/s" in out
    far = ask("speed", own, "--distance", "0.95", "--height", "0.36", *AREA)
    assert (far[0], far[1]["speed_to_program_mps"]) == (1, None)
    assert forcemap("speed", own, *case, "--form", "CFM_2D")[0] == 2
    assert "of several maps" in forcemap("speed-map", own, *AREA)[2]
    assert "of several maps" in forcemap("fit", own)[2]


@pytest.mark.parametrize("format", ["csv", "json", "urscript", "krl"])
def test_export_takes_a_folder_of_campaigns(forcemap, own, format):
    target = own.parent if format == "krl" else own.parent / "out"
    code, out, _ = forcemap("export", own, "--format", format, "--task", way(own, "task.toml"), "-o", target)
    assert (code, "zones permitted" in out) == (0, True)
    text = (own.parent / "FORCEMAP.SRC" if format == "krl" else target).read_text()
    for words in ("SIMULATED", "contact sites that can hit: flange", "table 3: motion up"):
        assert words in text or format == "json", words
    if format == "json":
        result = json.loads(text)
        assert [each["direction"] for each in result["tables"]] == ["down", "in", "up"]
        assert result["tools"] == [
            {"number": result["tools"][0]["number"], "tool": "none", "payload_kg": 0.0, "contact_sites": ["flange"]}
        ]
    if format == "csv":
        rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
        assert {row["direction"] for row in rows} == {"down", "in", "up"}


def test_scaling_along_a_path_and_a_safety_sheet(forcemap, own):
    task, target = ("--task", way(own, "task.toml")), own.parent / "scaling.csv"
    assert forcemap("export-path", own, way(own), *task, "-o", target)[0] == 0
    rows = list(csv.DictReader(line for line in target.read_text().splitlines() if not line.startswith("#")))
    assert {row["scaling"] for row in rows} == {"1.00"}
    for command in (("export", own), ("export-path", own, way(own))):
        code, _, err = forcemap(*command, "--format", "safety", *task)
        assert (code, "a safety configuration knows no direction of motion" in err) == (2, True)


def test_a_report_of_every_campaign_and_one_of_all(ask, forcemap, own):
    (own / "down" / "contact_points.csv").write_text(
        "point_id,distance_m,height_m,body_area,contact,body,rests_on\n"
        "P1,0.7,0.3,thigh_muscle,transient,free,map\nP2,,,thigh_muscle,transient,free,measurements\n"
    )
    (own / "in" / "contact_points.csv").write_text("point_id\nP1\n")
    code, found = ask("report", own, "--area", "thigh_muscle", "--date", "2026-11-23")
    assert code == 1  # one list cannot be used
    assert {Path(file).relative_to(own).as_posix() for file in found["files"]} == {
        *(f"{name}/report.{ending}" for name in ("down", "in", "up") for ending in ("html", "sha256")), "atlas.html"
    }  # fmt: skip
    page = (own / "atlas.html").read_text()
    for words in (
        "SIMULATED",
        'href="down/report.html"',
        "PERMITTED BY THE MAP",
        "2026-11-23",
        "tolerance bound",
        found["map_sha256"],
    ):
        assert words in page, words
    assert "STATES SCATTER" in page or "SPEED COMMANDED" in page
    points = page.split('<section id="points">')[1].split("</section>")[0]
    assert "<strong>2 not permitted</strong>" in points
    assert "the list of in cannot be used: none of its points is permitted" in points
    assert "contact site: not stated" in points
    assert "NOT MEASURED" in points
    assert forcemap("report", "--verify", own / "down" / "report.html", own / "down")[0] == 0


def test_an_altered_report_of_an_atlas_stays_and_so_do_the_others(forcemap, own):
    report = ("report", own, "--area", "thigh_muscle", "--date")
    assert forcemap(*report, "2026-11-23")[0] == 0
    for altered in (own / "atlas.html", own / "in" / "report.html", own / "in" / "report.sha256"):
        page = altered.read_bytes()
        altered.write_bytes(
            page.replace(b"</body>", b"<p>1 m/s</p></body>") + b"junk\n" * (altered.suffix == ".sha256")
        )
        before = {path: path.read_bytes() for path in own.rglob("*") if path.is_file()}
        code, _, err = forcemap(*report, "2026-11-24")
        assert (code, "was ALTERED since it was written" in err) == (2, True)
        assert {path: path.read_bytes() for path in own.rglob("*") if path.is_file()} == before
        altered.write_bytes(page)
    (own / "in" / "report.html").unlink()
    assert forcemap(*report, "2026-11-24")[0] == 0
    for one, other in ((own, own / "in"), (own / "in", own)):
        page = other / ("report.html" if one is own else "atlas.html")
        before = page.read_bytes()
        code, _, err = forcemap("report", one, "--area", "thigh_muscle", "-o", page)
        words = "the report of a campaign" if one is own else "the page of an atlas"
        assert (code, f"this is {words}: it is not replaced" in err, page.read_bytes()) == (2, True, before)
    own_seal = re.compile(r'<meta name="forcemap-report-sha256"[^>]*>\n')
    (own / "atlas.html").write_text(own_seal.sub("", (own / "atlas.html").read_text()))
    assert "or is of an earlier version, without a seal" in forcemap(*report, "2026-11-25")[2]


def test_a_table_of_limits_that_all_campaigns_name_is_that_of_the_atlas(ask, own):
    """One that another campaign does not name is not used, and each that names one says so."""
    table = (Path(fm.__file__).parent / "limits" / "tables" / "body_areas.csv").read_text()
    lower = re.sub(r"(?m)^(thigh_muscle,.*),220,2$", r"\g<1>,150,2", table.replace("ISO/TS 15066:2016", "the house"))
    place = ("--distance", 0.7, "--height", 0.3, "--area", "thigh_muscle", "--contact", "quasi-static")
    for number, name in enumerate(("down", "in", "up")):
        (own / name / "own.csv").write_text(lower)
        stated = own / name / "campaign.toml"
        stated.write_text(re.sub(r"(?m)^limit_table = .*\n", "", stated.read_text()))
        text = stated.read_text()
        head = "[standard]\n" if "[standard]" in text else ""
        line = 'limit_table = "own.csv"\n'
        stated.write_text(text.replace(head, head + line) if head else f"{text}[standard]\n{line}")
        found = ask("speed", own, *place)[1]
        every = number == 2
        edition = "the house" if every else "ISO/TS 15066:2016"
        assert all(edition in " ".join(part["speed"]["assumptions"]) for part in found["maps"])
        assert any("names the limit table own.csv" in each for each in found["warnings"]) is not every


def test_a_campaign_without_a_map_is_said_first_and_permits_nothing(ask, forcemap, own):
    (own / "in" / "impacts.csv").unlink()
    code, found = ask("path", own, way(own), "--task", way(own, "task.toml"))
    assert code == 1
    assert {piece["segment"] for piece in found["pieces"] if piece["outcome"] == "no_map"} == {"over"}
    (warning,) = [line for line in found["warnings"] if line.startswith("NO MAP of in")]
    assert "what it was to permit has no permission" in warning
    out = forcemap("path", own, way(own), "--task", way(own, "task.toml"))[1]
    verdict, *doubts = out.split("\n  ! ")
    assert verdict.startswith("NOT PERMITTED")
    assert any(doubt.startswith("NO MAP of in") for doubt in doubts)


ATLAS = 'schema = "forcemap-atlas/1"\nnote = "x"\nmaps = {maps}\n'


def test_an_atlas_file_names_folders_and_map_files(ask, own):
    fm.write_map(fm.fit_force_map(fm.read_dataset(own / "up")), own.parent / "up.json")
    (own.parent / "atlas.toml").write_text(ATLAS.format(maps='["cell/down", "cell/in", "up.json"]'))
    code, found = ask("path", own.parent / "atlas.toml", way(own), "--task", way(own, "task.toml"))
    assert code == 0
    assert [each["name"] for each in found["maps"]] == ["cell/down", "cell/in", "up.json"]
    whole = ask("path", own, way(own), "--task", way(own, "task.toml"))[1]
    assert [piece["speed_mps"] for piece in found["pieces"]] == [piece["speed_mps"] for piece in whole["pieces"]]
    assert ask("path", own.parent, way(own), "--task", way(own, "task.toml"))[1]["maps"] == found["maps"]
    (own.parent / "atlas.toml").write_text(ATLAS.format(maps='["cell/down", "up.json"]'))
    assert ask("report", own.parent / "atlas.toml", "--area", "thigh_muscle")[0] == 0
    assert "a map file: see the report of its campaign" in (own.parent / "atlas.html").read_text()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ATLAS.format(maps='["down", "down"]'), "maps: found a campaign twice"),
        (ATLAS.format(maps="[]"), "maps: expected a list of campaign folders"),
        (ATLAS.format(maps="[1]"), "maps: expected a list of campaign folders"),
        (ATLAS.format(maps='["nowhere"]'), "nowhere: there is no such file"),
        ('maps = ["down"]', "schema: found None, expected schema = 'forcemap-atlas/1'"),
        (ATLAS.format(maps='["down"]') + "robot = 1", "robot: unknown entry, expected schema, note and maps"),
        ("maps = [", "atlas.toml: not a TOML file"),
    ],
)
def test_a_broken_atlas_file_is_one_line(forcemap, own, text, message):
    (own / "atlas.toml").write_text(text)
    code, _, err = forcemap("path", own, way(own), *AREA)
    assert code == 2
    assert err.count("\n") == 1
    assert message in err.replace("column ", ""), err


def test_what_is_an_atlas(own):
    assert is_atlas(own)
    assert not is_atlas(own / "down")
    assert not is_atlas(own.parent / "path.csv")
    assert not is_atlas("ur10e")
    for mark in ("impacts.csv", "plan.csv"):  # a campaign itself, whatever lies below
        (own / mark).write_text("")
        assert not is_atlas(own)
        (own / mark).unlink()
    empty = own.parent / "empty"
    (empty / ".hidden").mkdir(parents=True)
    (empty / ".hidden" / "campaign.toml").write_text("")
    assert not is_atlas(empty)
    with pytest.raises(fm.InputError, match=r"neither atlas.toml nor folders with a campaign.toml"):
        fm.read_atlas(empty)
    with pytest.raises(fm.InputError, match=r"nowhere: there is no such file or folder"):
        fm.read_atlas(own / "nowhere")


def test_a_command_for_one_campaign_names_those_of_the_folder(forcemap, own):
    code, _, err = forcemap("collect", own)
    assert (code, "this folder holds campaigns (down, in, up); name one of them" in err) == (2, True)
    code, _, err = forcemap("report", "--verify", own / "atlas.html", own)
    assert (code, "of several maps; name the folder of one campaign" in err) == (2, True)


def test_the_page_of_an_atlas_is_verified_with_its_reports(ask, forcemap, own):
    shutil.move(own / "up", own.parent / "up")
    assert ask("report", own, "--area", "thigh_muscle")[0] == 0
    page, toml = own / "atlas.html", own / "down" / "campaign.toml"
    before = {path: path.read_bytes() for path in (page, toml, own / "in" / "report.html")}

    def found():
        code, answer = ask("report", "--verify", page, own)
        assert answer["holds"] == (code == 0)
        return code, answer["report_intact"], *(answer[name] for name in ("changed", "vanished", "new"))

    assert found() == (0, True, [], [], [])
    report = own / "down" / "report.html"
    of_page = report.read_bytes()
    for other in (("--area", "chest"), ("--area", "thigh_muscle", "--bound", "margin")):
        report.unlink()
        assert ask("report", own / "down", *other)[0] == 0
        assert found() == (1, True, ["down"], [], []), other
    report.write_bytes(of_page)
    assert found() == (0, True, [], [], [])
    assert forcemap("report", "--verify", page, own)[1].startswith(
        "Unchanged: the page, its campaigns and their reports"
    )
    toml.write_bytes(before[toml] + b"# a remark\n")
    assert found() == (1, True, ["down"], [], [])
    assert ask("report", own / "down", "--area", "thigh_muscle")[0] == 0  # a new report, and the page is of the old one
    assert found() == (1, True, ["down"], [], [])
    assert "CHANGED since the page was written: campaigns" in forcemap("report", "--verify", page, own)[1]
    toml.write_bytes(before[toml])
    assert ask("report", own / "down", "--area", "thigh_muscle")[0] == 0
    assert found() == (0, True, [], [], [])
    (own / "in" / "report.html").write_bytes(before[own / "in" / "report.html"].replace(b"m/s", b"m/S", 1))
    assert found() == (1, True, ["in"], [], [])
    (own / "in" / "report.html").unlink()
    assert found() == (1, True, ["in"], [], [])
    page.write_bytes(before[page].replace(b"PERMITTED", b"permitted", 1))
    shutil.move(own / "in", own.parent / "in")
    shutil.copytree(own.parent / "up", own / "up")
    assert found() == (1, False, [], ["in"], ["up"])
    page.write_bytes(before[page].replace(b"forcemap-campaigns", b"forcemap-others"))
    code, answer = ask("report", "--verify", page, own)
    assert (code, "does not say what it rests on" in answer["error"]["message"]) == (2, True)


def test_a_campaign_that_would_be_overlooked_is_refused(forcemap, own):
    """In the command and on the page alike: it may be the one that says what can hit."""
    shutil.move(own / "in", own.parent / "in")

    def said():
        code, _, err = forcemap("path", own, way(own), "--task", way(own, "task.toml"))
        with client_of(own) as client:
            answer = client.get("/api/together/path", params={"points": "0.72,0,0.36;0.72,0,0.30"})
        assert (code, answer.status_code) == (2, 409)
        return err, answer.text

    (own / "linked").symlink_to(own.parent / "in")
    assert all("a link, would be overlooked" in text for text in said())
    (own / "linked").unlink()
    (own / "sub").mkdir()
    shutil.copytree(own.parent / "in", own / "sub" / "in")
    assert all("a folder deeper than the others" in text for text in said())
    shutil.move(own / "sub" / "in", own / "in")
    (own / "in" / "campaign.toml").unlink()
    assert all("without campaign.toml, would be overlooked" in text for text in said())
    shutil.rmtree(own / "in")
    (own / "atlas.toml").write_text(ATLAS.format(maps='["down", "../in"]'))
    with client_of(own) as client:
        assert client.get("/api/together").status_code == 409


def test_a_campaign_without_a_map_gives_no_speed(ask, forcemap, own):
    case = ("--distance", "0.72", "--height", "0.36", *AREA)
    (own / "in" / "impacts.csv").unlink()
    code, found = ask("speed", own, *case)
    assert (code, found["speed_to_program_mps"], found["without_map"]) == (1, None, ["in"])
    assert "in give none" in " ".join(forcemap("speed", own, *case)[1].split())


@pytest.mark.parametrize("entry", ['contact_sites = ["elbow"]', "payload_kg = 8.0", 'tool = "welder"'])
def test_export_of_one_campaign_heeds_what_the_task_names(forcemap, own, entry):
    task = own.parent / "other.toml"
    lines = TASK.replace('contact_sites = ["flange"]\npayload_kg = 0.0\n', "").replace('tool = "none"\n', "")
    task.write_text(lines.replace('name = "over"', f'name = "over"\n{entry}'))
    for command in (("export", own / "down", "--format", "csv"), ("export-path", own / "down", way(own))):
        code, _, err = forcemap(*command, "--task", task)
        assert (code, "segment 'over': no map of contact site" in err) == (2, True), err


def test_a_table_of_places_knows_no_offset(forcemap, own):
    """Looked up where the tool is, a table of the contact site's places would be read at another place."""
    task = own.parent / "offset.toml"
    task.write_text(TASK.replace("payload_kg = 0.0", "payload_kg = 0.0\nsite_offsets_m = { flange = [0, 0, 0.15] }"))
    for format in ("csv", "urscript", "krl", "safety"):
        code, _, err = forcemap("export", own / "down", "--format", format, "--task", task)
        assert (code, "expected no offset" in err) == (2, True), err
    code, said, _ = forcemap("path", own, way(own), "--task", task)
    assert code in (0, 1)
    assert "ONLY IF THE TOOL DOES NOT TURN on this path: flange lies beside its point" in " ".join(said.split())


def test_a_recording_at_a_point_lies_beside_the_map_that_it_is_held_against(ask, own):
    """In the folder of another campaign it would count for nothing."""
    down = own / "down"
    (down / "points").mkdir()
    (down / "points" / "P1-1.csv").write_bytes(sorted((own / "in" / "recordings").iterdir())[0].read_bytes())
    header = (
        "point_id,contact_site,distance_m,height_m,direction,body_area,contact,body,rests_on,recordings,recorded_at_mps"
    )
    row = 'P1,flange,0.7,0.3,"{}",thigh_muscle,transient,free,measurements,points/P1-*,0.2'
    for direction, refused in (("in", True), ("-1,0,0.05", True), ("down", False), ("out", False)):
        (down / "contact_points.csv").write_text(f"{header}\n{row.format(direction)}\n")
        assert ask("collect", down)[0] == 0
        found, answer = ask("speed", own, "--distance", "0.7", "--height", "0.3", *AREA)
        assert (found == 2) == refused == ("move the file there from down" in str(answer.get("error"))), answer
        with client_of(own) as client:
            page = client.get("/api/together/path", params={"points": "0.72,0,0.36;0.72,0,0.30"})
        assert (page.status_code == 409) == refused == ("move the file there from down" in page.text), page.text


def test_place_says_what_its_best_position_rests_on(ask, own):
    """Of three maps, whatever position comes first."""
    table = own.parent / "table.csv"
    table.write_text("x_m,y_m,z_m\n0,0,0.04\n0,0,0\n0,0,0.04\n")
    code, found = ask("place", own, table, *AREA, "--step-m", "0.1")
    assert code == 0
    assert any("SPEED COMMANDED" in line for line in found["warnings"])


def test_other_robots_in_one_folder_are_refused(forcemap, own):
    toml = own / "in" / "campaign.toml"
    toml.write_text(toml.read_text().replace("virtual ur10e-like", "another robot"))
    code, _, err = forcemap("path", own, way(own), "--task", way(own, "task.toml"))
    assert (code, "robot.model: down states" in err) == (2, True)


# the page


def test_the_page_shows_all_maps_and_what_a_path_is_allowed(ask, own):
    with client_of(own) as client:
        maps = client.get("/api/together").json()
        assert [each["name"] for each in maps["maps"]] == ["down", "in", "up"]
        query = {"points": "0.72,0,0.36;0.72,0,0.30;0.66,0,0.30", "area": "thigh_muscle"}
        found = client.get("/api/together/path", params=query).json()
        of_command = ask("path", own, way(own), "--task", way(own, "task.toml"))[1]
        assert [piece["speed_mps"] for piece in found["pieces"]] == [
            piece["speed_mps"] for piece in of_command["pieces"]
        ]
        assert found["map_sha256"] == of_command["map_sha256"] == maps["map_sha256"]
        page = client.get("/together", params=query).text
        assert "to program" in page
        assert "No permission" not in page
        assert 'href="/together"' in client.get("/").text
        other = client.get("/api/together/path", params=query | {"tool": "hammer"}).json()
        assert not other["permitted"]
        assert {piece["outcome"] for piece in other["pieces"]} == {"no_map"}
        assert "No permission" in client.get("/together", params=query | {"tool": "hammer"}).text
        assert client.get("/api/together/path", params=query | {"points": "0.7,0,0.4"}).status_code == 422
        assert client.get("/together").status_code == 200


def test_campaigns_that_make_no_atlas_say_why_on_the_page(own):
    toml = own / "in" / "campaign.toml"
    toml.write_text(toml.read_text().replace("virtual ur10e-like", "another robot"))
    with client_of(own) as client:
        answer = client.get("/api/together")
        assert answer.status_code == 409
        assert "these campaigns make no atlas: robot.model: down states" in answer.text
        assert "make no atlas" in client.get("/together").text


def test_the_page_of_an_atlas_with_limits_from_elsewhere_cannot_be_verified_whole(ask, forcemap, own):
    shutil.move(own / "up", own.parent / "up")
    table = own.parent / "limits.csv"
    columns = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor"
    lines = ["# edition: own", "# source: own", "# version: 1", columns, "thigh_muscle,Thigh,thigh_knee,100,200,2"]
    table.write_text("\n".join(lines) + "\n")
    code, answer = ask("report", own, "--area", "thigh_muscle", "--limit-table", table)
    assert code == 0, answer
    code, answer = ask("report", "--verify", own / "atlas.html", own)
    assert (code, answer["holds"], answer["changed"], answer["not_compared"]) == (2, False, [], ["down", "in"])
    out = " ".join(forcemap("report", "--verify", own / "atlas.html", own)[1].split())
    assert out.startswith("CANNOT TELL whether all is as when the page was written: down, in rest on a table of limits")
    (own / "in" / "impacts.csv").write_bytes((own / "in" / "impacts.csv").read_bytes() + b"\n")
    assert ask("report", "--verify", own / "atlas.html", own)[0] == 1
