"""fleet: what changed is made again and nothing else; one bad folder stops nothing; a map that fails stays failed."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import html5lib
import numpy as np
import pytest

import forcemap as fm
from forcemap.assessment.fleet import made_from, named_limits, rests_on
from pulses import TOML, pulse, save
from sizes import FULL_SIZE

DAY = "2026-06-01"
HAND = ("--area", "hand_fingers")
STATED = TOML.replace("[device]", 'date = "2026-02-01"\n[contact]\ndirection = "down"\nspeed = "measured"\n[device]')
NEW = [(0.60, 0.20, 0.14), (0.66, 0.40, 0.26), (0.72, 0.25, 0.20), (0.78, 0.35, 0.15), (0.82, 0.30, 0.27)]


def measure(folder, factor=1.0, seed=0):
    """A recording of every planned run that has none: the force of a printed map, each state 2 % off it."""
    rng, plan = np.random.default_rng(seed), fm.read_plan(folder)
    peaks = fm.published_map("ur10e").predict(plan.distance, plan.height, plan.speed)
    for name, peak in zip(plan.recording.tolist(), peaks.tolist(), strict=True):
        if not (file := folder / "recordings" / f"{name}.csv").exists():
            save(file, *pulse(factor * peak * np.exp(rng.normal(0, 0.02)), rate=1000.0, seed=seed))


def campaign(folder, seed):
    folder.mkdir(parents=True)
    (folder / "campaign.toml").write_text(f'{STATED}calibrated = "2025-07-01"\n')
    fm.write_plan(fm.plan_measurements((0.56, 0.86), (0.14, 0.46), (0.1, 0.3), repeats=1, again=0), folder)
    measure(folder, seed=seed)
    return folder


def plan_more(folder):
    """Five more states at places of their own."""
    rows = [f"n{i}-r1,n{i},1,train,{d},{h},{v},," for i, (d, h, v) in enumerate(NEW)]
    with (folder / "plan.csv").open("a") as plan:
        plan.write("\n".join([*rows, ""]))


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in Path(folder).rglob("*") if path.is_file()}


def fleet(ask, folders, *options):
    """Exit code, and the campaigns by name."""
    home = folders[0].parent
    options = options if "--area" in options else (*HAND, *options)
    code, answer = ask("fleet", *folders, "-o", home / "fleet.html", "--date", DAY, *options)
    rows = {Path(row["folder"]).name: row for row in answer["campaigns"]}
    assert answer["made_again"] == sum(row["made_again"] for row in rows.values())
    assert answer["failed"] == sum(row["failed"] is not None for row in rows.values())
    assert (code == 1) == (answer["failed"] > 0)
    return rows


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Two good campaigns, one without a map, a file and a folder that are none: made in two processes."""
    from forcemap.cli.app import run

    home = tmp_path_factory.mktemp("fleet")
    for name, seed in (("north", 1), ("south", 2), ("begun", 3)):
        campaign(home / name, seed)
    for file in sorted((home / "begun" / "recordings").iterdir())[6:]:
        file.unlink()
    (home / "notes.txt").write_text("no campaign")
    (home / "empty").mkdir()
    folders = [home / name for name in ("north", "notes.txt", "begun", "empty", "south")]
    assert (
        run(["fleet", *map(str, folders), "-o", str(home / "fleet.html"), "--date", DAY, *HAND, "--workers", "2"]) == 1
    )
    return folders


@pytest.fixture
def north(made, tmp_path):
    """A good campaign that was made."""
    return Path(shutil.copytree(made[0], tmp_path / "north"))


def test_one_bad_folder_stops_nothing_and_what_is_unchanged_stays(made, ask):
    before = {folder.name: contents(folder) for folder in made if folder.is_dir()}
    rows = fleet(ask, made)
    assert {name for name, row in rows.items() if row["failed"]} == {"notes.txt", "begun", "empty"}
    assert "name the folder of a campaign" in rows["notes.txt"]["failed"]
    assert "neither campaign.toml" in rows["empty"]["failed"]
    assert "no force map: " in rows["begun"]["failed"]
    assert not any(row["made_again"] for row in rows.values())
    assert rows["begun"]["missing_runs"] == 21
    assert "planned runs to be measured: 21" in rows["begun"]["due"]
    assert {folder.name: contents(folder) for folder in made if folder.is_dir()} == before


def test_the_same_alone_as_in_a_pool(made, tmp_path, ask):
    """But for the reason that it was made, also by another name of the folder."""
    (tmp_path / "south").mkdir()
    there = {
        name: content
        for name, content in contents(made[4]).items()
        if name.parts[0] in ("campaign.toml", "plan.csv", "recordings")
    }
    for name, content in there.items():
        (tmp_path / "south" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "south" / name).write_bytes(content)
    rows = fleet(ask, [tmp_path / "south"], "--workers", "1")
    assert rows["south"]["changed"] == ["no report yet"]
    assert contents(tmp_path / "south") == contents(made[4])


def test_its_speeds_are_those_of_the_report_with_what_must_be_read_first(made, ask):
    rows = fleet(ask, made)
    assessment = fm.assess_campaign(made[0], limits=[fm.force_limit("hand_fingers")])
    (quick,) = [part for part in assessment.speeds if part.contact is fm.Contact.TRANSIENT]
    (shown,) = [speed for speed in rows["north"]["report"]["speeds"] if speed["contact"] == "transient"]
    assert shown["permitted_places"] == quick.confirmed > 0
    assert shown["lowest_speed_to_program_mps"] == quick.slowest_to_program
    assert rows["north"]["report"]["findings"] == [fm.sentence(finding) for finding in assessment.findings]
    with (made[0].parent / "fleet.csv").open(newline="") as table:
        found = [
            row for row in csv.DictReader(table) if row["folder"].endswith("north") and row["contact"] == "transient"
        ]
    assert found[0]["lowest_speed_to_program_mps"] == fm.floor_speed(quick.slowest_to_program)
    page = (made[0].parent / "fleet.html").read_text()
    assert fm.floor_speed(quick.slowest_to_program) in page
    assert 'href="north/report.html"' in page
    html5lib.HTMLParser(strict=True).parse(page)
    for heading in ("failed", "due", "changed", "all"):
        assert f'<h2 id="{heading}">' in page


CHANGES = {
    "a recording": lambda folder: save(folder / "recordings" / "d560-h140-v100-r1.csv", *pulse(90.0, rate=1000.0)),
    "a new one": lambda folder: save(folder / "recordings" / "below" / "d900.csv", *pulse(90.0, rate=1000.0)),
    "a name": lambda folder: (folder / "recordings" / "d560-h140-v100-r1.csv").rename(folder / "recordings" / "x.csv"),
    "a condition": lambda folder: edit(folder / "campaign.toml", "[contact]", '[contact]\nsite = "flange"'),
    "the plan": lambda folder: plan_more(folder),
    "the register": lambda folder: edit(folder / "recordings.csv", "used", "used "),
    "the table": lambda folder: (folder / "impacts.csv").unlink(),
    "a map": lambda folder: (folder / "maps").mkdir() or (folder / "maps" / "note.txt").write_text("new"),
    "its own limits": lambda folder: edit(folder / "limits.csv", "version: 1", "version: 2"),
    "nothing but its date": lambda folder: os.utime(folder / "impacts.csv", (0, 0)),
}


def edit(file, old, new):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def rests(folder):
    limits, own = named_limits(folder, fm.read_conditions(folder / "campaign.toml"), ["chest"])
    assert own == "limits.csv"
    return rests_on(folder, limits, own)


@pytest.fixture(scope="module")
def assessed(made, tmp_path_factory):
    """A campaign with limits of its own, and the hash of what its assessment rests on."""
    folder = Path(shutil.copytree(made[0], tmp_path_factory.mktemp("assessed") / "north"))
    table = next(Path(fm.__file__).parent.glob("limits/tables/body_areas.csv"))
    shutil.copy(table, folder / "limits.csv")
    with (folder / "campaign.toml").open("a") as stated:
        stated.write('[standard]\nlimit_table = "limits.csv"\n')
    return folder, made_from(fm.assess_campaign(folder, limits=[named_chest(folder)]))


@pytest.mark.parametrize("change", CHANGES)
def test_one_hash_is_of_all_that_a_report_rests_on(assessed, tmp_path, change):
    there, before = contents(assessed[0]), assessed[1]
    folder = Path(shutil.copytree(assessed[0], tmp_path / "north"))
    assert rests(folder) == before
    CHANGES[change](folder)
    assert (rests(folder) == before) == (change == "nothing but its date")
    for name in contents(folder):
        (folder / name).unlink()
    for name, content in there.items():
        (folder / name).write_bytes(content)
    assert rests(folder) == before


def named_chest(folder):
    return named_limits(folder, fm.read_conditions(folder / "campaign.toml"), ["chest"])[0][0]


def test_a_report_that_was_altered_stays_until_a_person_has_seen_it(north, ask):
    edit(north / "report.html", "PERMITTED BY THE MAP", "PERMITTED")
    altered = (north / "report.html").read_bytes()
    for _ in range(2):
        row = fleet(ask, [north])["north"]
        assert not row["made_again"]
        assert "ALTERED since it was written" in str(row["failed"])
    assert (north / "report.html").read_bytes() == altered
    (north / "report.html").rename(north / "altered.html")
    assert fleet(ask, [north])["north"]["made_again"]


def test_a_list_that_was_altered_is_no_unchanged_campaign(north, ask):
    edit(north / "report.sha256", "impacts", "impact")
    row = fleet(ask, [north])["north"]
    assert "the list of inputs beside this report (report.sha256) was ALTERED" in str(row["failed"])


@pytest.mark.parametrize("change", ["gone", "memory"] if FULL_SIZE else ["gone"])
def test_a_report_that_is_gone_or_not_known_is_made_again(north, ask, change):
    (north / {"gone": "report.html", "memory": "fleet.json"}[change]).unlink()
    before = (north / "impacts.csv").read_bytes()
    row = fleet(ask, [north])["north"]
    assert row["made_again"]
    assert (
        row["changed"]
        == {
            "gone": ["no report yet"],
            "memory": ["body areas, tables of limits, or what fleet knew of it"],
        }[change]
    )
    assert (north / "impacts.csv").read_bytes() == before
    assert not fleet(ask, [north])["north"]["made_again"]


def test_another_version_makes_it_again_and_other_areas_are_refused(north, tmp_path, ask):
    source = Path(fm.__file__).parents[1]
    shutil.copytree(source, tmp_path / "src")
    (tmp_path / "src" / "forcemap" / "_version.py").write_text('__version__ = "99.0"\n')
    command = [
        sys.executable,
        "-m",
        "forcemap",
        "fleet",
        north,
        "-o",
        tmp_path / "f.html",
        "--date",
        DAY,
        *HAND,
        "--json",
    ]
    done = subprocess.run(command, env={"PYTHONPATH": str(tmp_path / "src")}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (row,) = json.loads(done.stdout)["campaigns"]
    assert row["made_again"]
    assert row["changed"] == [f"made by forcemap {fm.__version__}"]
    assert "not for chest" in fleet(ask, [north], "--area", "chest")["north"]["failed"]


def test_a_memory_that_was_altered_or_that_another_account_sealed_counts_for_nothing(north, ask, monkeypatch, tmp_path):
    text = (north / "fleet.json").read_text()
    (north / "fleet.json").write_text(re.sub(r'("lowest_speed_to_program_mps": )[\d.]+', r"\g<1>0.9", text))
    row = fleet(ask, [north])["north"]
    assert row["made_again"]
    assert 0.9 not in [speed["lowest_speed_to_program_mps"] for speed in row["report"]["speeds"]]
    assert not fleet(ask, [north])["north"]["made_again"]
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "another account"))
    assert fleet(ask, [north])["north"]["made_again"]


def test_new_impacts_that_agree_with_the_last_map_replace_it(north, ask):
    before = (north / "fleet-map.json").read_bytes()
    plan_more(north)
    row = fleet(ask, [north])["north"]
    assert row["made_again"]
    assert row["changed"] == ["plan.csv changed"]
    assert row["last_map"] is None
    assert (north / "fleet-map.json").read_bytes() == before  # runs are missing
    measure(north, seed=9)
    row = fleet(ask, [north])["north"]
    assert row["failed"] is None
    assert row["last_map"]["outcome"] == "holds"
    assert "recordings/n0-r1.csv new" in row["changed"]
    assert (north / "fleet-map.json").read_bytes() != before
    assert fleet(ask, [north])["north"]["last_map"]["outcome"] == "holds"


def test_a_last_map_that_does_not_hold_fails_until_a_person_acts(north, ask):
    before = (north / "fleet-map.json").read_bytes()
    plan_more(north)
    measure(north, factor=1.3, seed=9)
    for again in ("made", "unchanged", "another entry"):
        if again == "another entry":
            edit(north / "campaign.toml", "[contact]", '[tool]\nname = "gripper"\n[contact]')
        row = fleet(ask, [north])["north"]
        assert row["made_again"] == (again != "unchanged")
        assert row["last_map"]["outcome"] == "does_not_hold"
        assert row["last_map"]["mean_ratio"] > 1.2
        assert row["failed"].startswith(("the last map does not hold: ", "no speed: "))
        assert row["last_map"]["next_step"] in row["due"]
        assert (north / "fleet-map.json").read_bytes() == before
        if again == "unchanged":
            assert row["failed"].startswith("the last map does not hold: ")


def test_a_campaign_whose_impacts_contradict_its_own_map_fails_and_its_map_is_not_kept(north, ask):
    before = (north / "fleet-map.json").read_bytes()
    with (north / "plan.csv").open("a") as plan:
        plan.write("x0-r1,x0,1,test,0.70,0.30,0.20,,\n")
    measure(north, factor=1.6, seed=3)
    row = fleet(ask, [north])["north"]
    assert row["failed"].startswith("no speed: THE MAP DOES NOT HOLD WHERE IT WAS MEASURED: x0; highest ")
    assert (north / "fleet-map.json").read_bytes() == before


@pytest.mark.parametrize(
    ("day", "expected"),
    [
        ("2026-06-01", "holds until 2026-07-01, 30 more days"),
        ("2026-05-31", None),
        ("2026-07-01", "holds until 2026-07-01, 0 more days"),
        ("2026-07-02", "held until 2026-07-01: calibrate it"),
    ],
)
def test_what_is_due_is_told_by_the_day_not_by_the_memory(made, ask, day, expected):
    code, answer = ask("fleet", made[0], "-o", made[0].parent / "day.html", "--date", day, *HAND)
    (row,) = answer["campaigns"]
    assert code == 0
    assert not row["made_again"]
    assert row["due"] == ([] if expected is None else [due for due in row["due"] if expected in due])
    assert len(row["due"]) == (expected is not None)


def test_slips_of_the_command_are_one_error(made, tmp_path, ask):
    assert "expected .html" in ask("fleet", made[0], "-o", tmp_path / "fleet.txt")[1]["error"]["message"]
    assert "expected --area" in ask("fleet", made[0], "-o", tmp_path / "f.html")[1]["campaigns"][0]["failed"]
    assert "the nearest are" in fleet(ask, made[:1], "--area", "handd")["north"]["failed"]
    (tmp_path / "mine.html").write_text("mine")
    assert "another file" in ask("fleet", made[0], *HAND, "-o", tmp_path / "mine.html")[1]["error"]["message"]


def test_a_folder_whose_name_is_no_text(north, ask):
    strange = north.rename(os.fsdecode(os.fsencode(north.parent) + b"/caf\xe9\n<b>"))
    rows = fleet(ask, [strange])
    (row,) = rows.values()
    assert row["folder"].endswith("caf\\udce9\\n<b>")
    assert row["failed"] is None
    assert not row["made_again"]
    page = (strange.parent / "fleet.html").read_text()
    assert "&lt;b&gt;" in page
    assert "caf%E9%0A%3Cb%3E/report.html" in page


def test_a_pdf_of_an_earlier_report_is_due(north, ask):
    """It lies beside the new report: somebody might sign it."""
    printed = north / "report.pdf"
    printed.write_bytes(b"%PDF-1.7 of an earlier report")
    os.utime(printed, (0, 0))
    assert (
        "report.pdf is older than report.html: of an earlier report; forcemap report --pdf writes both"
        in fleet(ask, [north])["north"]["due"]
    )
    os.utime(printed)
    assert not any("report.pdf" in line for line in fleet(ask, [north])["north"]["due"])
