"""The team's register on both databases: what is entered, asked, refused, lost, edited and migrated."""

from __future__ import annotations

import csv
import datetime
import html
import itertools
import json
import multiprocessing
import os
import random
import re
import resource
import shutil
import signal
import socket
import sqlite3
import ssl
import struct
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import func, inspect, select, text
from sqlalchemy.exc import DBAPIError

import forcemap as fm
import postgres
from forcemap.answers.register import CellAnswer
from forcemap.errors import RegisterError
from forcemap.exports.head import head_result
from forcemap.register.audit import Action, verify
from forcemap.register.connection import connect, file_system, is_local, is_network
from forcemap.register.due import what_is_due
from forcemap.register.enter import change, enter
from forcemap.register.folder import read_content
from forcemap.register.release import release, withdraw
from forcemap.register.schema import ROLES, SCHEMA, make_register, open_register
from forcemap.register.states import cell_state
from forcemap.register.structure import altered
from forcemap.register.tables import METADATA, RELEASES
from pulses import pulse, save
from register_folders import DAY, collected, toml_of
from sizes import FULL_SIZE
from web_server import bearer, client_of

DATABASES = ("sqlite", "postgresql")
PROCESSES = multiprocessing.get_context("forkserver")
PROCESSES.set_forkserver_preload(["forcemap.register.enter", "forcemap.register.schema", "register_folders", "psycopg"])
FIRST_DAY = "2026-01-20"
NOT_BEFORE = (
    "OTHER CAMPAIGNS OF THIS CELL WERE ENTERED AFTER THE ONE THAT IT RESTS ON, OR NOT KNOWN TO BE MEASURED BEFORE:"
)
UNTIL = (datetime.date.today() + datetime.timedelta(days=300)).isoformat()
SHARED = "-c fsync=off -c max_connections=200 -c listen_addresses='' -c shared_buffers=64MB"


@pytest.fixture(scope="module")
def server():
    if postgres.PROGRAMS is None:
        pytest.skip(postgres.REASON)
    started = postgres.Server()
    yield started
    started.close()


@pytest.fixture(scope="module")
def blank(server_or_none, tmp_path_factory):
    """An empty register of each database, to be copied."""
    home = tmp_path_factory.mktemp("blank")
    make_register(str(home / "blank.sqlite"))[0].engine.dispose()
    if server_or_none:
        register, _, roles = make_register(server_or_none.new("blank"))
        register.engine.dispose()
        assert roles
    return home / "blank.sqlite"


@pytest.fixture(scope="module")
def server_or_none(request):
    return request.getfixturevalue("server") if postgres.PROGRAMS else None


@pytest.fixture(params=DATABASES)
def where(request, blank, server_or_none, tmp_path):
    """A new register."""
    full = request.getfixturevalue("full") if "full" in request.fixturenames else {}
    if request.param == "sqlite":
        return str(shutil.copy(full.get("sqlite", blank), tmp_path / "register.sqlite"))
    if server_or_none is None:
        pytest.skip(postgres.REASON)
    return new_database(server_or_none, database_of(full.get("postgresql", "@/blank")))


def database_of(url):
    return url.partition("@/")[2].partition("?")[0]


_NAMES = iter(range(10**6))


def new_database(server, template):
    name = f"register{next(_NAMES)}"
    server._run("createdb", "-h", server.home, "-U", "owner", "-T", template, name)
    return server.url(name)


@pytest.fixture
def register(where):
    opened = open_register(where)
    yield opened
    opened.engine.dispose()


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Five campaigns of three cells, 40 recordings each, the first two of one cell."""
    home = tmp_path_factory.mktemp("campaigns")
    cells = ("cell-1", "cell-1", "cell-2", "cell-3", "cell-3")
    stated = [{"cell": cell, "date": f"2026-02-0{1 + i}", "serial": f"D{i % 2}"} for i, cell in enumerate(cells)]
    return [collected(home / f"c{i}", 40, i, **each) for i, each in enumerate(stated)]


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A campaign with curves that were collected, its report and contact points."""
    folder = tmp_path_factory.mktemp("measured") / "west"
    folder.mkdir()
    (folder / "campaign.toml").write_text(toml_of(calibrated="2026-01-05"))
    fm.write_plan(fm.plan_measurements((0.56, 0.86), (0.14, 0.46), (0.1, 0.3), repeats=1, again=0), folder)
    rng, plan = np.random.default_rng(1), fm.read_plan(folder)
    peaks = fm.published_map("ur10e").predict(plan.distance, plan.height, plan.speed)
    for name, peak in zip(plan.recording.tolist(), peaks.tolist(), strict=True):
        save(
            folder / "recordings" / f"{name}.csv", *pulse(0.6 * peak * np.exp(rng.normal(0, 0.02)), rate=1000.0, seed=1)
        )
    header = "point_id,body_area,contact,body,rests_on,distance_m,height_m,direction,contact_site"
    (folder / "contact_points.csv").write_text(
        f"{header}\nP1,chest,transient,free,map,0.7,0.3,down,flange\nP2,temple,transient,free,map,0.7,0.3,down,flange\n"
    )
    fm.build_dataset(fm.read_campaign(folder))
    from forcemap.cli.app import run

    assert run(["report", str(folder), "--area", "chest"]) == 0
    return folder


def reported(folder, change, *areas):
    """A folder that was changed, with the report of it."""
    from forcemap.cli.app import run

    change(folder)
    assert run(["report", str(folder), *(word for area in areas for word in ("--area", area))]) == 0
    return folder


@pytest.fixture(scope="module")
def of_two_areas(measured, tmp_path_factory):
    """The same with a report of chest and thigh."""
    folder = shutil.copytree(measured, tmp_path_factory.mktemp("two") / "c")
    return reported(folder, lambda folder: (folder / "report.html").unlink(), "chest", "thigh_knee")


@pytest.fixture(scope="module")
def of_another_day(measured, tmp_path_factory):
    """The same, collected as of a day when its device's calibration was over; then an earlier one is stated."""

    def stated_otherwise(folder):
        for path in (folder / "recordings.csv", folder / "impacts.csv"):
            path.unlink()
        edit(folder / "campaign.toml", f'date = "{DAY}"', 'date = "2026-08-01"')
        edit(folder / "campaign.toml", 'calibrated = "2026-01-05"', 'calibrated = "2025-07-01"')
        fm.build_dataset(fm.read_campaign(folder))
        edit(folder / "campaign.toml", 'date = "2026-08-01"', 'date = "2026-06-01"')

    folder = shutil.copytree(measured, tmp_path_factory.mktemp("day") / "c")
    return reported(folder, stated_otherwise, "chest")


@pytest.fixture(scope="module")
def of_two_days(measured, tmp_path_factory):
    """The same, whose first recordings were collected twelve days before the others."""

    def stated_otherwise(folder):
        for path in (folder / "recordings.csv", folder / "impacts.csv"):
            path.unlink()
        recordings = sorted((folder / "recordings").iterdir())
        later = {path: path.rename(folder / path.name) for path in recordings[len(recordings) // 2 :]}
        edit(folder / "campaign.toml", f'date = "{DAY}"', f'date = "{FIRST_DAY}"')
        fm.build_dataset(fm.read_campaign(folder))
        edit(folder / "campaign.toml", f'date = "{FIRST_DAY}"', f'date = "{DAY}"')
        for path, moved in later.items():
            moved.rename(path)
        fm.build_dataset(fm.read_campaign(folder))

    folder = shutil.copytree(measured, tmp_path_factory.mktemp("days") / "c")
    return reported(folder, stated_otherwise, "chest")


@pytest.fixture(scope="module")
def of_another_point(measured, tmp_path_factory):
    """The same, whose first contact point is of another area."""
    folder = shutil.copytree(measured, tmp_path_factory.mktemp("point") / "west")
    return reported(folder, lambda folder: edit(folder / "contact_points.csv", "P1,chest", "P1,thigh_knee"), "chest")


@pytest.fixture
def asked(ask, where):
    """A register's command with --json: (exit code, answer)."""
    return lambda *arguments: ask("register", *arguments, "--register", where)


def rows(register, table):
    with register.reading() as connection:
        return [dict(row) for row in connection.execute(select(METADATA.tables[table])).mappings()]


def count(register, table):
    with register.reading() as connection:
        return connection.execute(select(func.count()).select_from(METADATA.tables[table])).scalar()


def whole(register):
    with register.reading() as connection:
        return verify(connection) == ()


# what is entered


def test_what_is_entered_again_is_there_once(register, folders, where, asked):
    code, answer = asked("enter", *folders)
    assert code == 0
    assert [each["new_recordings"] for each in answer["entered"]] == [40] * 5
    before = {name: count(register, name) for name in METADATA.tables}
    assert (before["recordings"], before["impacts"], before["campaigns"], before["cells"]) == (200, 200, 5, 3)
    assert before["audit"] == 5
    code, answer = asked("enter", *folders[::-1])
    assert code == 0
    assert not any(each["new"] for each in answer["entered"])
    assert {name: count(register, name) for name in METADATA.tables} == before
    found = {row["sha256"] for row in rows(register, "recordings")}
    assert found == {entry.sha256 for folder in folders for entry in fm.read_campaign(folder).entries}
    for row, entry in zip(rows(register, "impacts")[:40], fm.read_campaign(folders[0]).entries, strict=True):
        assert (row["peak_force_N"], row["largest_N"], row["whole"]) == (entry.peak_force, entry.peak_force, 1)
    code, answer = asked("verify")
    assert (code, answer["holds"]) == (0, True)


def test_a_campaign_that_has_grown_brings_what_is_new(register, tmp_path):
    collected(tmp_path / "a", 30, 1)
    collected(tmp_path / "b", 36, 1, site="", cell="")
    first = enter(register, tmp_path / "a")
    second = enter(register, tmp_path / "b", cell="plant/cell-1")
    assert (first.new_recordings, second.recordings, second.new_recordings) == (30, 36, 6)
    assert second.new_impacts < 36
    elsewhere = enter(register, tmp_path / "b", cell="plant/another", new=True)
    assert (elsewhere.new, elsewhere.new_recordings, elsewhere.new_impacts) == (True, 0, 36)
    assert whole(register)


def test_a_cell_that_is_named_and_not_known_is_made_only_if_it_is_to_be_new(blank, folders, tmp_path, ask):
    """A slip in --cell would leave the releases of the cell that was meant in force."""
    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    bare = collected(tmp_path / "bare", 30, 8, site="", cell="")
    further = collected(tmp_path / "further", 30, 9, site="", cell="")
    code, answer = ask("register", "enter", bare, "--cell", "plant/cell-1", "--register", where)
    assert code == 0  # the first one of a register is no slip for another
    assert answer["entered"][0]["new_cell"]
    for slip in ("plant/cel-1", "cel-1", "hall/cell-1"):
        code, answer = ask("register", "enter", further, "--cell", slip, "--register", where)
        assert code == 2
        assert "there is no cell" in answer["error"]["message"]
        assert "--new" in answer["error"]["message"]
    assert "'plant/cell-1'" in answer["error"]["message"]
    for name, options, made in (("cell-1", (), False), ("plant/cell-2", ("--new",), True)):
        code, answer = ask("register", "enter", further, "--cell", name, *options, "--register", where)
        assert (code, answer["entered"][0]["new_cell"]) == (0, made)
    (entered,) = ask("register", "enter", folders[4], "--register", where)[1]["entered"]
    assert (entered["cell"], entered["new_cell"]) == ("plant/cell-3", True)  # as [protocol] states


def test_recordings_that_are_entered_for_another_cell_under_other_conditions_end_a_release(register, tmp_path):
    """One recording was measured at one cell, under one firmware: entered otherwise it contradicts the release."""
    before = collected(tmp_path / "before", 30, 3, firmware="5.10")
    enter(register, before)
    copies = {}
    for name, firmware, robot in (
        ("same", "5.10", "1"),
        ("sister", "5.13", "2"),
        ("other", "5.11", "1"),
        ("none", "5.12", "1"),
    ):
        where = {"site": "", "cell": ""} if name == "none" else {"cell": f"cell-{name}"}
        copies[name] = collected(tmp_path / name, 30, 3, firmware=firmware, **where)
        for number in ("R", "C"):  # serial numbers of robot and controller
            edit(copies[name] / "campaign.toml", f"{number}-{where['cell']}", f"{number}-cell-{robot}")

    def standing(number):
        found = {each.release: each for each in cell_state(register, "cell-1")[0].releases}[number]
        return [finding.kind.value for finding in found.failed]

    first = add_release(register, subject="task 1")
    assert standing(first) == []
    for name in ("same", "sister"):
        assert "plant/cell-1" in enter(register, copies[name]).also_of
        assert standing(first) == []
    enter(register, copies["other"])
    assert standing(first) == ["release_entered_elsewhere"]
    second = add_release(register, subject="task 2")
    assert standing(second) == []  # released anew by somebody who knows
    enter(register, copies["none"])
    assert standing(first) == standing(second) == ["release_entered_elsewhere"]
    due = [each for each in what_is_due(register) if each.release == second]
    assert [finding.kind.value for each in due for finding in each.findings] == ["release_entered_elsewhere"]


def test_recordings_at_contact_points_are_entered_with_what_they_show(register, measured, tmp_path, asked):
    folder = shutil.copytree(measured, tmp_path / "c")
    of_plan = len(fm.read_campaign(folder).entries)
    save(folder / "points" / "P1-1.csv", *pulse(455.0, rate=1000.0, seed=3))
    save(folder / "points" / "P1-2.csv", *pulse(150.0, rate=1000.0, held=452.0, seed=4))
    (folder / "points" / "P1-3.csv").write_text("not a recording\n")
    code, answer = asked("enter", folder)
    assert code == 2
    assert "points/P1-1.csv and 2 more" in str(answer)
    fm.build_dataset(fm.read_campaign(folder))
    assert asked("enter", folder)[1]["entered"][0]["new_recordings"] == of_plan + 3
    code, answer = asked("exceeded", "--limit-N", "450")
    assert code == 1
    assert [each["file"] for each in answer["largest"]] == ["points/P1-1.csv", "points/P1-2.csv"]
    assert [each["largest_N"] for each in answer["largest"]] == pytest.approx([455.0, 452.0], abs=3.0)
    assert (answer["campaigns"][0]["exceeded"], answer["campaigns"][0]["cannot_tell"]) == (2, 1)
    assert asked("who", "--recording", folder / "points" / "P1-1.csv")[1]["cells"][0]["cell"] == "plant/cell-1"
    (folder / "points" / "P1-1.csv").unlink()
    assert asked("enter", folder)[0] == 2  # gone: nothing of it is believed


DAMAGES = {
    "a recording was changed": lambda f: (f / "recordings" / "s00-r1.csv").write_bytes(b"other"),
    "one is gone": lambda f: (f / "recordings" / "s00-r1.csv").unlink(),
    "one was not collected": lambda f: (f / "recordings" / "x.csv").write_bytes(b"x"),
    "there is no date": lambda f: edit(f / "campaign.toml", f'date = "{DAY}"', ""),
    "its date lies ahead": lambda f: edit(f / "campaign.toml", f'date = "{DAY}"', 'date = "2999-01-01"'),
    "no campaign": lambda f: (f / "campaign.toml").unlink(),
    "a map is none": lambda f: (f / "maps").mkdir() or (f / "maps" / "m.json").write_text("{}"),
    "another encoding": lambda f: (f / "campaign.toml").write_bytes(b"\xff\xfe\x00"),
}


def edit(file, old, new):
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_bad_folder_is_one_line_and_stops_nothing(damage, blank, tmp_path, folders, ask):
    where = shutil.copy(blank, tmp_path / "register.sqlite")
    bad = collected(tmp_path / "bad", 30)
    DAMAGES[damage](bad)
    code, answer = ask("register", "enter", bad, folders[0], "--register", where)
    assert code == 1
    assert len(answer["failed"]) == len(answer["entered"]) == 1
    code, answer = ask("register", "enter", bad, "--register", where)
    assert code == 2
    assert answer["error"]["message"]


# what is in force


def test_from_a_release_to_its_end(register, measured, asked):
    release = ["release", "cell-1", measured, "--area", "chest", "--contact", "transient", "--valid-until", UNTIL]
    assert asked(*release)[0] == 2  # the cell is not known
    assert asked("enter", measured)[0] == 0
    code, answer = asked("state", "cell-1")
    assert (code, answer["in_force"], answer["releases"]) == (1, False, [])
    code, made = asked(*release)
    assert (code, made["release"], made["new"]) == (0, 1, True)
    assert asked(*release)[1] | {"head": 0} == made | {"new": False, "head": 0}
    code, answer = asked("state", "plant/cell-1")
    (shown,) = answer["releases"]
    assert (code, shown["in_force"], shown["areas"], shown["why_not"]) == (0, True, "chest", [])
    table = fm.robot_table(
        fm.fit_force_map(fm.read_dataset(measured)),
        limits=[(fm.force_limit("chest"), fm.Contact.TRANSIENT)],
        bound=fm.ToleranceBound(device_error=3.0),
    )
    assert shown["speeds"]["speed_mmps"] == table.speed_mmps.tolist()
    said = head_result(table.provenance)
    beside, unconfirmed, *warnings = shown["speeds"]["warnings"]
    assert beside.startswith("THE CELL MAY NOT RUN AS PROGRAMMED")
    assert (beside[-3:], shown["speeds"]["points_not_permitted"]) == (" P2", ["P2"])
    assert unconfirmed.startswith("NOT CONFIRMED BY MEASUREMENT when it was released")
    assert (warnings, bool(said["warnings"]), shown["speeds"]["confirmed"]) == (said["warnings"], True, False)
    cell_of = CellAnswer.of(cell_state(register, "plant/cell-1")[0])
    standing = "in force, NOT CONFIRMED BY MEASUREMENT, BUT CONTACT POINTS ARE NOT PERMITTED: P2"
    assert cell_of.standing == standing
    one = cell_of.releases[0]
    over = one.model_copy(update={"release": 2, "subject": "point P4", "in_force": False, "speeds": None})
    partly = cell_of.model_copy(update={"in_force": False, "releases": [over, one]})
    assert partly.standing == f"NOT IN FORCE: release 2 (point P4); 1 of 2 releases {standing}"
    replaced = over.model_copy(update={"counts": False})
    assert partly.model_copy(update={"releases": [replaced]}).standing == "NOT IN FORCE: it has no release"
    assert partly.model_copy(update={"releases": [over]}).standing == "NOT IN FORCE"
    both = partly.model_copy(update={"in_force": True, "releases": [one, replaced]})
    assert both.standing == standing
    permitted = one.model_copy(update={"speeds": one.speeds | {"points_not_permitted": []}})
    assert both.model_copy(update={"releases": [permitted]}).standing == "in force, NOT CONFIRMED BY MEASUREMENT"
    (of_release,) = cell_of.releases
    assert of_release.rests_on == of_release.bound
    confirmed = of_release.model_copy(update={"speeds": of_release.speeds | {"confirmed": True}})
    assert confirmed.rests_on == f"{of_release.bound}, confirmed by measurement"
    by_six = of_release.model_copy(update={"speeds": of_release.speeds | {"confirmed": True, "confirming_impacts": 6}})
    assert by_six.rests_on == f"{of_release.bound}, confirmed by 6 impacts"
    assert set(said["assumptions"]) < set(shown["speeds"]["assumptions"])
    assert shown["map_sha256"] == fm.map_sha256(fm.fit_force_map(fm.read_dataset(measured)))
    due, points = asked("due")[1]["due"]
    assert (due["release"], due["findings"][0][:30]) == (1, "in force, but released without")
    assert (points["release"], points["findings"][0][:44]) == (1, "in force beside contact points that are NOT ")
    unconfirmed, refused, ends = asked("due", "--days", "400")[1]["due"][:3]
    assert (unconfirmed, refused, UNTIL in ends["findings"][0]) == (due, points, True)

    if not register.postgresql or FULL_SIZE:  # a contact point needs the whole assessment, seconds each
        point = ["release", "cell-1", measured, "--point", "P1", "--valid-until", UNTIL]
        assert asked(*point)[1]["release"] == 2
        of_point = asked("state", "cell-1")[1]["releases"][0]["speeds"]
        of_tilted = [line for line in said["warnings"] if line.startswith("OFF THE MAP'S DIRECTION")]
        assert set(said["warnings"]) - {*of_tilted} <= set(of_point["warnings"])
        assert len(of_tilted) == 1
        assert any("map" in line for line in of_point["assumptions"])
    assert asked("change", "plant/cel-1", "firmware=5.12")[0] == 2  # a slip changes nothing
    assert asked("change", "cell-1", "device=PFMD, D9")[0] == 0
    assert asked("state", "plant/cell-1")[0] == 0
    assert asked("change", "plant/cell-1", "firmware=5.12")[0] == 0
    code, answer = asked("state", "plant/cell-1")
    assert (code, answer["in_force"]) == (1, False)
    for shown in answer["releases"]:
        assert shown["speeds"] is None
        assert "firmware was 5.11 when measured, and is 5.12" in shown["why_not"][0]
    code, answer = asked(*release)
    assert code == 2
    assert "firmware was 5.11" in answer["error"]["message"]
    assert asked("change", "plant/cell-1", "firmware=5.11")[0] == 0
    code, back = asked("state", "plant/cell-1")  # changed and changed back
    assert code == 1
    assert "firmware was 5.11 when measured, was 5.12 from" in back["releases"][0]["why_not"][0]
    assert "and is 5.11 again: what changed back has changed" in back["releases"][0]["why_not"][0]
    assert asked(*release)[1]["replaces"] == 1
    again = asked("state", "plant/cell-1")[1]["releases"][0]
    assert again["in_force"]
    back = "CHANGED SINCE IT WAS MEASURED, AND BACK: firmware 5.12 from 2"
    assert any(line.startswith(back) for line in again["speeds"]["warnings"][:2])
    assert asked("withdraw", "1", "--reason", "firmware")[0] == 0
    assert "withdrawn" in asked("state", "plant/cell-1")[1]["releases"][-1]["why_not"][0]
    assert asked("withdraw", "9", "--reason", "x")[0] == 2
    done = [each["action"] for each in asked("state", "plant/cell-1")[1]["history"]]
    assert list(dict.fromkeys(done)) == ["withdraw", "release", "change", "enter"]
    assert whole(register)


def test_a_figure_of_minus_zero_is_entered_as_zero(blank, tmp_path, ask):
    """SQLite gives minus zero back as zero: a hash of the former would call an untouched register altered."""
    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    folder = collected(tmp_path / "c", 5, phase2=-0.0)
    assert "-0.00" in (folder / "recordings.csv").read_text()
    assert ask("register", "enter", folder, "--register", where)[0] == 0
    assert ask("register", "verify", "--register", where)[1]["problems"] == []


def test_speeds_of_a_release_are_shown_behind_what_must_be_said_first(blank, measured, forcemap, ask, tmp_path):
    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    chest = [(fm.force_limit("chest"), fm.Contact.TRANSIENT)]
    with open_register(where) as register:
        enter(register, measured)
        release(register, "cell-1", measured, limits=chest, valid_until=UNTIL)
        warnings = cell_state(register, "cell-1")[0].releases[0].speeds["warnings"]
        add_release(register, subject="task old")  # as an earlier version entered it
    said = (warnings[0], "WHAT MUST BE SAID FIRST IS NOT KNOWN")
    _, answer = ask("register", "state", "cell-1", "--register", where)
    assert [each["speeds"]["warnings"][0].startswith(said[1]) for each in answer["releases"]] == [True, False]
    text = " ".join(forcemap("register", "state", "cell-1", "--register", where)[1].split())
    newest, before = text.split("Releases")[1].split("History")[0].split("- release")[1:]
    for shown, warning in ((newest, said[1]), (before, said[0])):
        assert 0 < shown.index("in force until") < shown.index(warning) < shown.index("program at most")
    assert said[0] not in newest
    with client_of(measured.parent, register=where) as client:
        page = html.unescape(client.get("/register/cell?cell=cell-1").text)
    assert all(warning in page for warning in said)


def test_a_release_of_a_point_says_first_that_it_is_held_and_what_it_holds_for(blank, measured, forcemap, tmp_path):
    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    folder = shutil.copytree(measured, tmp_path / "west")
    reported(
        folder, lambda f: edit(f / "contact_points.csv", "P1,chest,transient,free", "P1,chest,transient,constrained")
    )
    with open_register(where) as register:
        enter(register, folder)
        release(register, "cell-1", folder, point="P1", limits=[], valid_until=UNTIL)
    text = " ".join(forcemap("register", "state", "cell-1", "--register", where)[1].split())
    held = text.index("TRANSIENT LIMIT FOR A BODY PART THAT CANNOT GIVE WAY, contact point P1")
    assert held < text.index("program at most") < text.index("; ONLY for motion straight along the map's direction")
    page = " ".join((folder / "report.html").read_text().split())
    assert page.index('</h3> <p class="refused"><strong>TRANSIENT LIMIT FOR A BODY PART THAT CANNOT GIVE WAY') > 0


def collected_on_measurements(folder, at="0.2", force=140.0):
    """Collect a campaign whose only contact point rests on three impacts of its own, made at a speed."""
    (folder / "points").mkdir()
    for repeat in range(3):
        save(
            folder / "points" / f"P1-{repeat}.csv",
            *pulse(force + repeat, rate=1000.0, seed=len(folder.name) + 70 + repeat),
        )
    header, first, _ = (folder / "contact_points.csv").read_text().splitlines()
    rests = first.replace(",map,", ",measurements,") + f",points/P1-*,{at}"
    (folder / "contact_points.csv").write_text(f"{header},recordings,recorded_at_mps\n{rests}\n")
    fm.build_dataset(fm.read_campaign(folder))


def test_a_release_of_a_point_that_rests_on_measurements_has_the_campaigns_doubts(
    blank, measured, ask, forcemap, tmp_path
):
    """That nothing tells how far off the commanded speeds are holds for its impacts as for those of a map."""
    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    folder = Path(shutil.copytree(measured, tmp_path / "west"))
    edit(folder / "campaign.toml", 'speed = "measured"', 'speed = "commanded"')
    (folder / "recordings.csv").unlink()
    collected_on_measurements(folder)
    assert forcemap("report", folder, "--area", "chest")[0] == 0
    ask("register", "enter", folder, "--register", where)
    code, found = ask(
        "register", "release", "cell-1", folder, "--point", "P1", "--valid-until", UNTIL, "--register", where
    )
    assert code == 0, found
    (kept,) = ask("register", "state", "cell-1", "--register", where)[1]["releases"]
    assert kept["speeds"]["outcome"] == "confirmed"
    assert any(line.startswith("SPEED COMMANDED, error not stated") for line in kept["speeds"]["warnings"])


@pytest.mark.parametrize("first", ["of the cell", "of no cell"])
def test_the_same_recordings_under_another_day_and_firmware_are_said_first(
    blank, measured, ask, forcemap, tmp_path, first
):
    """A recording was made once; that the cell changed since it was made is not undone by a stated day."""
    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    earlier, toml = Path(shutil.copytree(measured, tmp_path / "earlier")), (measured / "campaign.toml").read_text()
    if first == "of no cell":
        (earlier / "campaign.toml").write_text(re.sub(r"(?m)^(site|cell) = .*\n", "", toml))
    assert ask("register", "enter", earlier, "--register", where)[0] == 0
    folder = Path(shutil.copytree(measured, tmp_path / "again"))
    stated = (folder / "campaign.toml").read_text()
    day = fm.read_conditions(folder / "campaign.toml").date
    (folder / "campaign.toml").write_text(stated.replace(day, "2026-02-20"))
    for name in ("recordings.csv", "impacts.csv", "report.html"):
        (folder / name).unlink()
    assert forcemap("collect", folder)[0] == 0
    assert forcemap("report", folder, "--area", "chest")[0] == 0
    assert ask("register", "enter", folder, "--register", where)[0] == 0
    case = ("--area", "chest", "--contact", "transient", "--valid-until", UNTIL, "--register", where)
    code, found = ask("register", "release", "cell-1", folder, *case)
    assert code == 0, found
    newest = ask("register", "state", "cell-1", "--register", where)[1]["releases"][0]
    first = next(line for line in newest["speeds"]["warnings"] if line.startswith("THE SAME RECORDINGS WERE ENTERED"))
    assert f"date was {day}, now 2026-02-20" in first


def test_no_point_is_released_without_the_table_that_its_campaign_had(blank, measured, ask, forcemap, tmp_path):
    """Its doubts, and what speaks against its impacts, would be gone with impacts.csv."""
    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    folder = Path(shutil.copytree(measured, tmp_path / "west"))
    collected_on_measurements(folder)
    (folder / "impacts.csv").unlink()
    (folder / "report.html").unlink()
    forcemap("report", folder, "--area", "chest")
    ask("register", "enter", folder, "--register", where)
    code, found = ask(
        "register", "release", "cell-1", folder, "--point", "P1", "--valid-until", UNTIL, "--register", where
    )
    assert code == 1 or code == 2
    assert "there is no impacts.csv" in found["error"]["message"]


REFUSALS = {
    "the report is gone": (lambda f: (f / "report.html").unlink(), (), "forcemap report writes it"),
    "the report is of something else": (
        lambda f: (f / "maps").mkdir() or (f / "maps/x.txt").write_text("x"),
        (),
        "not of the campaign as it is now; move it away and write another",
    ),
    "the report is altered": (
        lambda f: (f / "report.html").write_text((f / "report.html").read_text().replace("</body>", "<p>x</p></body>")),
        (),
        "the report was ALTERED since it was written: keep both as evidence",
    ),
    "the report has an altered list": (
        lambda f: (f / "report.sha256").write_text((f / "report.sha256").read_text().replace("impacts", "impact")),
        (),
        "the list of inputs beside the report was ALTERED",
    ),
    "the report is of other areas": (lambda f: None, ("--area", "back_of_hand"), "not of back_of_hand"),
    "no area and no point": (lambda f: None, None, "expected body areas"),
    "no contact": (lambda f: None, ("--area", "chest"), "expected --contact"),
    "the head": (lambda f: None, ("--area", "face", "--contact", "transient"), ""),
    "a point of the head": (lambda f: None, ("--point", "P2"), "not permitted"),
    "over already": (
        lambda f: None,
        ("--area", "chest", "--contact", "transient", "--valid-until", "2026-01-01"),
        "valid",
    ),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_what_may_not_be_released_is_refused(case, blank, measured, tmp_path, ask):
    where, folder = shutil.copy(blank, tmp_path / "r.sqlite"), Path(shutil.copytree(measured, tmp_path / "west"))
    damage, options, words = REFUSALS[case]
    damage(folder)
    assert ask("register", "enter", folder, "--register", where)[0] == 0
    options = [*(options if options is not None else ())]
    if case.startswith("the report") and "--area" not in options:
        options = ["--area", "chest"]
    if case.startswith("the report"):
        options += ["--contact", "transient"]
    until = [] if "--valid-until" in options else ["--valid-until", UNTIL]
    code, answer = ask("register", "release", "cell-1", folder, *options, *until, "--register", where)
    assert code == 2
    assert words in answer["error"]["message"]
    assert sqlite3.connect(where).execute("select count(*) from releases").fetchone() == (0,)


EDITS = {
    "not calibrated then": ('calibrated = "2026-01-05"', 'calibrated = "2024-01-05"', "held"),
    "calibration not stated": ('calibrated = "2026-01-05"', "", "is not known"),
    "no checksum": ('safety_checksum = "A1B2"', "", "is not known: safety_checksum (protocol.safety_checksum)"),
    "no serial number of the device": (
        'device_serial_number = "D1"',
        "",
        "is not known: device (device.model, protocol.device_serial_number)",
    ),
    "another firmware after it was measured": ('firmware = "5.11"', 'firmware = "5.12"', "nothing is exported"),
    "a softer spring after it was measured": (
        "stiffness_N_per_m = 75000.0",
        "stiffness_N_per_m = 20000.0",
        "nothing is",
    ),
    "no direction": ('direction = "down"', "", ""),
}


@pytest.mark.parametrize("case", EDITS)
def test_what_would_not_be_in_force_or_exported_is_not_released(case, blank, measured, tmp_path, ask, monkeypatch):
    where, folder = shutil.copy(blank, tmp_path / "r.sqlite"), Path(shutil.copytree(measured, tmp_path / "west"))
    old, new, words = EDITS[case]
    edit(folder / "campaign.toml", old, new)
    monkeypatch.setattr("forcemap.register.release._require_report", lambda *_: ())  # made once for all: two seconds
    assert ask("register", "enter", folder, "--register", where)[0] == 0
    stated = ["--area", "chest", "--contact", "transient", "--valid-until", UNTIL]
    code, answer = ask("register", "release", "cell-1", folder, *stated, "--register", where)
    assert code == 2
    assert words in answer["error"]["message"]


def released(asked, folder, cell="cell-1", areas=("chest",), *more):
    """A release of the chest, and whether it is in force."""
    named = [word for area in areas for word in ("--area", area)]
    code, answer = asked("release", cell, folder, *named, "--contact", "transient", "--valid-until", UNTIL, *more)
    return answer["release"] if code == 0 else answer["error"]["message"]


def in_force(asked, cell="plant/cell-1"):
    return [each["release"] for each in asked("state", cell)[1]["releases"] if each["in_force"]]


TODAY = datetime.datetime.now(datetime.UTC).date().isoformat()


@pytest.mark.parametrize(
    "changes",
    [
        [("firmware=5.12", DAY)],  # of the day of the measurements, said later
        [("firmware=5.12", TODAY)],
        [("firmware=5.12", TODAY), ("firmware=5.11", TODAY)],  # and back on the day of the release
        [("firmware=5.12", "2026-02-20"), ("firmware=5.11", "2026-02-21")],
    ],
)
def test_what_is_said_of_a_day_after_the_release_ends_it(changes, register, measured, asked):
    asked("enter", measured)
    assert released(asked, measured) == 1
    for words, day in changes:
        assert asked("change", "cell-1", words, "--since", day)[0] == 0
    assert in_force(asked) == []


def test_what_is_stated_last_of_a_day_holds_and_an_older_change_says_what_holds_now(register, measured, asked):
    asked("enter", measured)
    for words in ("tool=hook", "tool=gripper"):
        asked("change", "cell-1", words)
    assert released(asked, measured) == 1
    asked("change", "cell-1", "tool=hook", "--since", TODAY)
    assert in_force(asked) == []
    done = asked("change", "cell-1", "firmware=5.09", "--since", "2020-01-01")[1]["done"]
    assert "firmware is 5.11 since 2026-02-01" in done


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("day", ["2026-03-01", "2026-02-20"])
def test_campaigns_tell_the_same_in_whatever_order_they_are_entered(order, day, blank, tmp_path):
    """The one of 1 March shows firmware 5.12, whatever those before it show; of one day two are not known."""
    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    folders = [
        collected(tmp_path / "a", 30, 5, firmware="5.12", date="2026-02-15"),
        collected(tmp_path / "b", 30, 6, firmware="5.12", date="2026-03-01"),
        collected(tmp_path / "c", 30, 7, firmware="5.11", date=day),
    ]
    with open_register(where) as opened:
        for number in order:
            enter(opened, folders[number])
        (fact,) = [each for each in cell_state(opened, "cell-1")[0].facts if each.kind == "firmware"]
    assert fact.since[:10] == "2026-03-01"
    assert fact.value == ("5.12" if day < "2026-03-01" else None)


def test_a_day_that_is_stated_otherwise_later_makes_no_calibration_valid(register, of_another_day, asked):
    asked("enter", of_another_day)
    assert "measured on 2026-08-01" in released(asked, of_another_day)


BETWEEN = {
    "changed and changed back": ["firmware=5.12 2026-01-25", "firmware=5.11 2026-01-28"],
    "changed": ["firmware=5.10 2026-01-10", "firmware=5.11 2026-01-25"],
    "not known meanwhile": ["firmware=? 2026-01-25", "firmware=5.11 2026-01-28"],
}


@pytest.mark.parametrize("told", ["before entering", "before releasing", "after it"])
@pytest.mark.parametrize("case", BETWEEN)
def test_what_changed_while_it_was_measured_ends_a_release(case, told, register, of_two_days, asked):
    def change_meanwhile():
        for words in BETWEEN[case]:
            assert asked("change", "plant/cell-1", "--new", words.split()[0], "--since", words.split()[1])[0] == 0

    if told == "before entering":
        change_meanwhile()
    asked("enter", of_two_days)
    if told == "before releasing":
        change_meanwhile()
    answer = released(asked, of_two_days)
    if told != "after it":
        assert "nothing is released, it would not be in force: firmware" in answer
        return
    assert in_force(asked) == [answer] == [1]
    change_meanwhile()
    assert in_force(asked) == []


def test_what_was_measured_on_two_days_and_did_not_change_is_in_force(register, of_two_days, folders, asked):
    change(register, "plant/cell-1", {"firmware": "5.10"}, since="2026-01-10", new=True)
    asked("enter", of_two_days)
    change(register, "plant/cell-1", {"firmware": "5.11"}, since="2026-02-02")
    facts = {fact.kind: fact for fact in cell_state(register, "cell-1")[0].facts}
    assert (facts["firmware"].value, facts["tool"].since[:10]) == ("5.11", FIRST_DAY)
    assert released(asked, of_two_days) == 1
    change(register, "plant/cell-1", {"firmware": "5.09"}, since="2026-01-05")
    assert in_force(asked) == [1]
    change(register, "plant/cell-1", {"firmware": "5.09"}, since=FIRST_DAY)
    assert in_force(asked) == []


def test_one_release_of_each_subject_whatever_the_order_of_its_areas(register, of_two_areas, asked):
    folder = of_two_areas
    asked("enter", folder)
    assert released(asked, folder, "cell-1", ("chest", "thigh_knee")) == 1
    assert asked("withdraw", "1", "--reason", "x")[0] == 0
    assert released(asked, folder, "cell-1", ("thigh_knee", "chest")) == 2
    assert asked("state", "cell-1")[1]["releases"][0]["replaces"] == 1


def test_a_report_of_other_limits_carries_no_release(register, tmp_path, measured, asked):
    limits = tmp_path / "limits.csv"
    assert asked("enter", measured)[0] == 0
    rows = ["sternum,S,chest,120,240,2", "pectoral_muscle,P,chest,120,240,2", "est,E,chest,120,240,2"]
    header = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor"
    limits.write_text("\n".join(["# edition: ours", "# source: ours", "# version: 1", header, *rows, ""]))
    for area in ("chest", "est"):
        words = released(asked, measured, "cell-1", (area,), "--limit-table", limits)
        assert f"the report is not of {area}" in str(words)


def test_a_campaign_that_is_entered_again_has_to_be_released_again(
    register, tmp_path, measured, asked, of_another_point
):
    folder = shutil.copytree(measured, tmp_path / "west")
    asked("enter", folder)
    assert released(asked, folder) == 1
    assert in_force(asked) == [1]
    edit(folder / "contact_points.csv", "P1,chest", "P1,thigh_knee")
    asked("enter", folder)
    assert in_force(asked) == []
    assert any("entered again" in words for due in asked("due")[1]["due"] for words in due["findings"])
    for name in ("report.html", "report.sha256"):
        shutil.copy(of_another_point / name, folder)
    assert released(asked, folder) == 2
    assert in_force(asked) == [2]
    assert asked("enter", folder)[1]["entered"][0]["since"] == ""
    edit(folder / "contact_points.csv", "P1,thigh_knee", "P1,chest")  # what it was before: there already, and said
    back = asked("enter", folder)[1]["entered"][0]
    assert (back["new"], back["since"] > "") == (False, True)


def harder(measured, folder, factor, day, near=None, firmware="", held=0.0, coarse=()):
    """A campaign on another day, with forces that are a factor of the first one's: of its plan, or near a place.

    `held`: what acts after each impact [N]; `coarse`: states whose force is thrice as much, sampled at 100 Hz.
    """
    shutil.copytree(
        measured, folder, ignore=shutil.ignore_patterns("report*", "recordings.csv", "impacts.csv", "points")
    )
    (folder / "contact_points.csv").unlink()
    edit(folder / "campaign.toml", DAY, day)
    if firmware:
        edit(folder / "campaign.toml", 'firmware = "5.11"', f'firmware = "{firmware}"')
    if near:
        (folder / "plan.csv").unlink()
        shutil.rmtree(folder / "recordings")
        ranges = ((start, start + 0.1) for start in near)
        fm.write_plan(fm.plan_measurements(*ranges, (0.1, 0.3), repeats=1, again=0), folder)
    plan, rng = fm.read_plan(folder), np.random.default_rng(7)
    peaks = 0.6 * factor * fm.published_map("ur10e").predict(plan.distance, plan.height, plan.speed)
    for name, peak in zip(plan.recording.tolist(), peaks.tolist(), strict=True):
        slow = any(name.startswith(state) for state in coarse)
        force = peak * np.exp(rng.normal(0, 0.01)) * (3 if slow else 1)
        curve = pulse(force, rate=100.0 if slow else 1000.0, held=held, seed=2)
        save(folder / "recordings" / f"{name}.csv", *curve)
    fm.build_dataset(fm.read_campaign(folder))
    return folder


@pytest.mark.parametrize(
    ("factor", "day", "ends"), [(1.7, TODAY, True), (0.9, TODAY, False), (1.7, "2026-01-09", True), (1.7, "", False)]
)
def test_later_impacts_of_a_cell_above_the_limit_at_a_released_speed_end_a_release(
    factor, day, ends, register, measured, tmp_path, asked
):
    """Those of days before the measurements under another firmware do not: the robot was another one."""
    west = shutil.copytree(measured, tmp_path / "west")
    asked("enter", west)
    assert released(asked, west) == 1
    speeds = asked("state", "cell-1")[1]["releases"][0]["speeds"]
    assert "direction of motion: down; contact site: flange" in speeds["measured_for"]
    east = harder(measured, tmp_path / "east", factor, day or "2026-01-09", firmware="" if day else "5.09")
    assert asked("enter", east)[1]["entered"][0]["releases"] == [1]
    chest = (fm.force_limit("chest"), fm.Contact.TRANSIENT)
    force_map, bound = fm.fit_force_map(fm.read_dataset(west)), fm.ToleranceBound(device_error=3.0)
    table = fm.robot_table(force_map, limits=[chest], bound=bound)
    assert table.speed_mmps.tolist() == speeds["speed_mmps"]
    made, beside = fm.read_dataset(east), np.linspace(-0.02, 0.02, 9)  # the robot may be there, too
    permitted = np.array([max(table.speed(d + i, 0.0, h + j) for i in beside for j in beside)
                          for d, h in zip(made.distance, made.height, strict=True)])  # fmt: skip
    force, limit = np.fmax(made.peak_force, made.phase2_force), fm.force_limit("chest").force(fm.Contact.TRANSIENT)
    above = int(np.sum((permitted > 0) & (made.stated_speed <= permitted + 0.01) & (force > limit)))
    assert (above > 0) is (factor > 1)
    standing = asked("state", "cell-1")[1]["releases"][0]
    assert standing["in_force"] is not ends
    assert any(words.startswith(f"{above} impacts of the cell that were entered since exceed") for words in
               standing["why_not"]) is ends  # fmt: skip
    since = "CAMPAIGNS OF THIS CELL WERE ENTERED SINCE: east."
    if not ends:
        assert standing["speeds"]["warnings"][0].startswith(since)
        assert any(since in words for due in asked("due")[1]["due"] for words in due["findings"])
    if ends:
        assert released(asked, west) == 2  # a person may know that they are of another tool: said first from then on
        newest = asked("state", "cell-1")[1]["releases"][0]
        assert newest["in_force"]
        assert newest["speeds"]["warnings"][0].startswith("IMPACTS OF ANOTHER CAMPAIGN OF THIS CELL EXCEED ITS LIMIT")
        assert released(asked, west) == 2  # the same, there already
        north = harder(measured, tmp_path / "north", factor, day)
        assert asked("enter", north)[1]["entered"][0]["new"] is False  # the same recordings
        assert in_force(asked) == [2]


def test_later_impacts_that_clamp_or_were_sampled_too_slowly_end_a_release_of_a_transient_limit(
    register, measured, tmp_path, asked
):
    """Half of the transient limit is the least that a quasi-static one has; a discarded impact read too little."""
    west = shutil.copytree(measured, tmp_path / "west")
    asked("enter", west)
    assert released(asked, west) == 1
    kept = harder(measured, tmp_path / "kept", 0.9, TODAY, held=130.0)
    assert {str(each) for each in fm.read_dataset(kept).scenario} == {"constrained_with_clamping"}
    asked("enter", kept)
    assert in_force(asked) == [1]
    asked("enter", harder(measured, tmp_path / "held", 0.9, TODAY, held=150.0))
    standing = asked("state", "cell-1")[1]["releases"][0]
    assert not standing["in_force"]
    assert any("or clamp with more than 140 N, so that no transient limit" in words for words in standing["why_not"])
    assert released(asked, west) == 2
    first, second = asked("state", "cell-1")[1]["releases"][0]["speeds"]["warnings"][:2]
    assert "at speeds that it permits, or clamp, so that no transient limit may be used" in first
    assert second.startswith(f"{NOT_BEFORE} kept, held.")
    coarse = harder(measured, tmp_path / "coarse", 0.9, TODAY, near=(0.7, 0.3), coarse=("d7",))
    used = [entry.use for entry in fm.read_campaign(coarse).entries]
    assert {"discarded", "used"} <= {*used}
    asked("enter", coarse)
    assert in_force(asked) == []


def test_withdrawing_a_release_that_was_replaced_says_which_stays(register, measured, tmp_path, asked, forcemap, where):
    west = shutil.copytree(measured, tmp_path / "west")
    asked("enter", west)
    assert released(asked, west) == 1
    line = ["release", "cell-1", west, "--area", "chest", "--contact", "transient", "--valid-until"]
    assert asked(*line, "2099-01-01")[1]["release"] == 2
    withdrawn = forcemap("register", "withdraw", 1, "--reason", "a slip", "--register", where)[1]
    assert "Release 1 is withdrawn; release 2, which took its place, is NOT: withdraw it by its own number" in withdrawn
    assert in_force(asked) == [2]
    assert "NOT" not in forcemap("register", "withdraw", 2, "--reason", "a slip", "--register", where)[1]
    assert in_force(asked) == []


def test_a_release_that_was_not_compared_is_released_anew_and_says_so(register, measured, tmp_path, asked):
    west = shutil.copytree(measured, tmp_path / "west")
    asked("enter", west)
    assert released(asked, west) == 1
    asked("enter", harder(measured, tmp_path / "east", 0.9, TODAY))
    assert any("forcemap evaluate" in words for due in asked("due")[1]["due"] for words in due["findings"])
    assert released(asked, west) == 2  # the same words as of the first, as it says
    assert not any("evaluate" in words for due in asked("due")[1]["due"] for words in due["findings"])
    said = asked("state", "cell-1")[1]["releases"][0]["speeds"]["warnings"][0]
    assert said.startswith(f"{NOT_BEFORE} east.")
    assert released(asked, west) == 2


@pytest.mark.parametrize(("day", "told"), [(TODAY, True), (DAY, True), ("", True), ("2020-01-02", False)])
def test_a_campaign_that_is_not_known_to_be_measured_before_is_said_whichever_was_entered_first(
    day, told, register, measured, tmp_path, asked
):
    west = shutil.copytree(measured, tmp_path / "west")
    asked("enter", harder(measured, tmp_path / "east", 0.9, day or DAY))
    if not day:
        (toml := tmp_path / "east" / "campaign.toml").write_text(
            re.sub(r"(?m)^date = .*\n", "", (tmp_path / "east" / "campaign.toml").read_text())
        )
        assert DAY not in toml.read_text()
    asked("enter", west)
    assert released(asked, west) == 1
    said = asked("state", "cell-1")[1]["releases"][0]["speeds"]["warnings"][0]
    assert told is said.startswith(f"{NOT_BEFORE} east.")


@pytest.mark.parametrize(("near", "ends"), [((0.71, 0.31), True), ((0.73, 0.31), False)])
def test_later_impacts_at_a_contact_point_above_its_limit_at_its_released_speed_end_its_release(
    near, ends, register, measured, tmp_path, asked
):
    west = shutil.copytree(measured, tmp_path / "west")
    asked("enter", west)
    code, answer = asked("release", "cell-1", west, "--point", "P1", "--valid-until", UNTIL)
    assert code == 0, answer
    asked("enter", harder(measured, tmp_path / "east", 4.0, TODAY, near))
    assert (in_force(asked) == []) is ends


def test_impacts_at_the_edge_of_the_range_end_a_release_and_none_are_entered_without_their_places(
    register, measured, tmp_path, asked
):
    """A robot that is programmed to the edge of the last zone may be where the range ends."""
    west = shutil.copytree(measured, tmp_path / "west")
    asked("enter", west)
    assert released(asked, west) == 1
    edge = harder(measured, tmp_path / "edge", 4.0, TODAY, (0.86, 0.46))
    (edge / "impacts.csv").rename(tmp_path / "impacts.csv")
    assert "there is no impacts.csv" in asked("enter", edge)[1]["error"]["message"]
    assert in_force(asked) == [1]
    (tmp_path / "impacts.csv").rename(edge / "impacts.csv")
    asked("enter", edge)
    assert in_force(asked) == []


@pytest.mark.parametrize(
    ("force", "at", "ends"), [(395.0, "0.2", True), (395.0, "", True), (395.0, "0.5", False), (140.0, "0.2", False)]
)
def test_later_impacts_at_a_point_that_rests_on_its_own_end_its_release(
    force, at, ends, register, measured, tmp_path, asked, forcemap
):
    """The point is told by its name, and an impact whose speed nobody stated counts as slow."""
    west, later = (Path(shutil.copytree(measured, tmp_path / name)) for name in ("west", "later"))
    for folder in (west, later):
        (folder / "recordings.csv").unlink()
        edit(folder / "campaign.toml", DAY, DAY if folder == west else TODAY)
        rng = np.random.default_rng(len(folder.name))
        for path in (folder / "recordings").iterdir():  # other recordings of the same plan, well below the limit
            save(path, *pulse(50.0 + rng.uniform(0, 9), rate=1000.0, seed=int(rng.integers(1 << 30))))
        collected_on_measurements(
            folder, at=at if folder == later else "0.2", force=force if folder == later else 140.0
        )
        if folder == west:
            assert forcemap("report", folder, "--area", "chest")[0] == 0
            asked("enter", folder)
            code, answer = asked("release", "cell-1", folder, "--point", "P1", "--valid-until", UNTIL)
            assert code == 0, answer
    entered = asked("enter", later)[1]["entered"][0]
    assert entered["releases"] == [1]
    assert (in_force(asked) == []) is ends


def released_and_kept(measured, tmp_path, asked):
    """A campaign with a release in force, and a copy of its folder as it is then."""
    folder = Path(shutil.copytree(measured, tmp_path / "west"))
    asked("enter", folder)
    assert released(asked, folder) == 1
    return folder, shutil.copytree(folder, tmp_path / "kept")


def collect_and_enter(folder, forcemap, asked):
    code, _, error = forcemap("collect", folder)
    assert code == 0, error
    code, answer = asked("enter", folder)
    assert code == 0, answer


@pytest.mark.parametrize("newer", ["more impacts", "other conditions"])
def test_older_content_is_not_released_once_newer_that_measured_more_was_entered(
    newer, register, tmp_path, measured, asked, forcemap
):
    """A folder restored from a copy: what was measured since counts."""
    folder, kept = released_and_kept(measured, tmp_path, asked)
    if newer == "more impacts":
        file = folder / "recordings" / fm.read_campaign(folder).entries[0].file
        again = file.with_name(file.name.replace("-r1", "-r2"))
        again.write_text(file.read_text().replace("\n", "\n\n", 1))
    else:
        edit(folder / "campaign.toml", "error_N = 3.0", "error_N = 30.0")
    collect_and_enter(folder, forcemap, asked)
    assert in_force(asked) == []
    shutil.rmtree(folder)
    shutil.copytree(kept, folder)
    asked("enter", folder)
    assert "a newer state of this campaign, entered for the cell" in released(asked, folder)
    assert in_force(asked) == []


@pytest.mark.parametrize("name", ["west", "other"])
def test_impacts_that_were_to_confirm_a_map_are_not_forgotten_by_a_changed_copy(
    name, register, tmp_path, measured, asked, forcemap
):
    """A folder restored from a copy, with a word changed or another name, is new content, and still lacks them."""
    folder, kept = released_and_kept(measured, tmp_path, asked)
    rows_of_plan = (folder / "plan.csv").read_text().splitlines()
    header, first = rows_of_plan[0].split(","), rows_of_plan[1].split(",")
    confirming = dict(zip(header, first, strict=True)) | {"state_id": "c-d700", "role": "test"}
    confirming["recording"] = "c-d700-r1"
    (folder / "plan.csv").write_text("\n".join([*rows_of_plan, ",".join(confirming[key] for key in header)]) + "\n")
    made = fm.read_campaign(folder).entries[0].file
    text = (folder / "recordings" / made).read_text().replace("\n", "\n\n", 1)
    (folder / "recordings" / "c-d700-r1.csv").write_text(text)
    collect_and_enter(folder, forcemap, asked)
    again = tmp_path / name
    shutil.rmtree(folder)
    shutil.copytree(kept, again)
    edit(again / "campaign.toml", 'program = "', 'document_number = "7"\nprogram = "')
    assert forcemap("collect", again)[0] == 0
    (again / "report.html").unlink()
    assert forcemap("report", again, "--area", "chest")[0] == 0
    assert asked("enter", again)[0] == 0
    assert "are not in this folder: c-d700; what they measured counts" in released(asked, again)
    assert in_force(asked) == []


def add_point(folder, forcemap):
    """A contact point in place of those of a campaign, with an impact of its own."""
    (folder / "points").mkdir()
    save(folder / "points" / "P3-1.csv", *pulse(400.0, rate=1000.0, seed=9))
    header = "point_id,body_area,contact,body,rests_on,distance_m,height_m,direction,contact_site,recordings"
    (folder / "contact_points.csv").write_text(
        f"{header},recorded_at_mps\nP3,chest,transient,free,map,0.7,0.3,down,flange,points/P3-*,0.2\n"
    )
    assert forcemap("collect", folder)[0] == 0


def test_a_copy_of_another_name_that_measured_more_ends_the_release(register, tmp_path, measured, asked, forcemap):
    """It shares recordings: an impact at a contact point above the limit speaks against both."""
    folder, _ = released_and_kept(measured, tmp_path, asked)
    copy = Path(shutil.copytree(folder, tmp_path / "west-2"))
    add_point(copy, forcemap)
    assert asked("enter", copy)[0] == 0
    assert in_force(asked) == []
    assert any("entered again" in words for due in asked("due")[1]["due"] for words in due["findings"])
    assert (
        "at its contact points, were entered for the cell plant/cell-1 and are not in this folder: points/P3-1.csv"
        in (released(asked, folder))
    )


def test_a_point_that_a_copy_measured_before_counts_for_the_first_release(
    register, tmp_path, measured, asked, forcemap
):
    folder, copy = (Path(shutil.copytree(measured, tmp_path / name)) for name in ("west", "west-2"))
    add_point(copy, forcemap)
    asked("enter", copy)
    asked("enter", folder)
    assert "are not in this folder: points/P3-1.csv" in released(asked, folder)


def test_days_at_contact_points_are_days_of_the_measurements(tmp_path, measured, forcemap):
    """Calibration and conditions must hold on them as on the others."""
    folder = Path(shutil.copytree(measured, tmp_path / "west"))
    assert read_content(folder).measured == (DAY, DAY)
    edit(folder / "campaign.toml", f'date = "{DAY}"', 'date = "2026-03-09"')
    add_point(folder, forcemap)
    edit(folder / "campaign.toml", 'date = "2026-03-09"', f'date = "{DAY}"')
    assert read_content(folder).measured == (DAY, "2026-03-09")


def test_a_day_that_is_stated_later_is_not_that_of_what_was_collected_before(tmp_path, measured, forcemap):
    """Nor is it at contact points once they are collected again."""
    folder = Path(shutil.copytree(measured, tmp_path / "west"))
    edit(folder / "campaign.toml", f'date = "{DAY}"', "# no date")
    add_point(folder, forcemap)
    edit(folder / "campaign.toml", "# no date", f'date = "{DAY}"')
    assert forcemap("collect", folder)[0] == 0
    assert read_content(folder).measured == (None, DAY)


def test_a_campaign_of_other_recordings_ends_no_release(register, tmp_path, measured, asked, folders):
    asked("enter", measured)
    assert released(asked, measured) == 1
    assert asked("enter", folders[0])[0] == 0
    assert in_force(asked) == [1]


def test_the_campaigns_own_limits_are_those_of_its_release_and_part_of_its_content(
    register, tmp_path, measured, asked, forcemap
):
    """A table that is lowered afterwards ends the release."""
    folder = Path(shutil.copytree(measured, tmp_path / "west"))
    columns = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor"
    lines = ["# edition: own", "# source: own", "# version: 1", columns, "chest,Chest,chest,100,170,2"]
    lines.append("temple,Temple,skull_forehead,100,130,0")
    (folder / "mine.csv").write_text("\n".join(lines) + "\n")
    stated = folder / "campaign.toml"
    stated.write_text(stated.read_text() + '\n[standard]\nlimit_table = "mine.csv"\n')
    assert forcemap("collect", folder)[0] == 0
    (folder / "report.html").unlink()
    assert forcemap("report", folder)[0] == 0
    assert asked("enter", folder)[0] == 0
    assert released(asked, folder) == 1
    (release,) = asked("state", "plant/cell-1")[1]["releases"]
    assert (release["in_force"], release["limit_N"]) == (True, 340.0)
    edit(folder / "mine.csv", "100,170,2", "100,60,2")
    asked("enter", folder)
    assert in_force(asked) == []


def test_a_cell_without_a_site_stays_reachable(register, tmp_path, asked, folders):
    bare = collected(tmp_path / "bare", 30, 9, site="")
    asked("enter", bare)
    asked("enter", folders[0])
    assert asked("state", "cell-1")[0] == 2
    assert asked("state", "/cell-1")[1]["cell"] == "cell-1"
    assert asked("change", "/cell-1", "firmware=5.12")[0] == 0
    assert asked("state", "plant/cell-1")[1]["cell"] == "plant/cell-1"


def test_a_cell_that_the_folder_does_not_state_is_refused(register, folders, asked):
    code, answer = asked("enter", folders[0], "--cell", "plant/cell-9")
    assert code == 2
    assert "[protocol] states the cell 'plant/cell-1'" in answer["error"]["message"]
    assert asked("enter", folders[0], "--cell", "plant/cell-1")[0] == 0


def test_a_larger_device_error_that_is_stated_later_counts(register, folders, tmp_path, asked):
    folder = shutil.copytree(folders[0], tmp_path / "c")
    asked("enter", folder)
    largest = max(entry.peak_force for entry in fm.read_campaign(folder).entries)
    assert asked("exceeded", "--limit-N", str(largest + 10))[0] == 0
    edit(folder / "campaign.toml", "error_N = 3.0", "error_N = 30.0")
    asked("enter", folder)
    code, answer = asked("exceeded", "--limit-N", str(largest + 10))
    assert code == 2
    assert answer["cannot_tell"] > 0


def test_what_is_the_same_elsewhere_or_not_known_is_said(register, measured, tmp_path, asked, forcemap, where):
    first, second = (shutil.copytree(measured, tmp_path / name) for name in ("c7", "c8"))
    edit(second / "campaign.toml", 'cell = "cell-1"', 'cell = "cell-8"')
    edit(second / "campaign.toml", 'firmware = "5.11"\n', "")
    fm.build_dataset(fm.read_campaign(second))
    assert asked("enter", first)[1]["entered"][0]["also_of"] == []
    assert asked("enter", second)[1]["entered"][0]["also_of"] == ["plant/cell-1"]
    told = forcemap("register", "enter", second, "--register", where)
    assert "THE SAME RECORDINGS ARE THOSE OF plant/cell-1" in " ".join(told[1].split())
    answer = asked("who", "--firmware", "5.11")[1]
    assert ([each["cell"] for each in answer["cells"]], answer["not_known"]) == (["plant/cell-1"], ["plant/cell-8"])
    asked("change", "cell-1", "firmware=?")
    assert asked("who", "--firmware", "5.11")[1]["not_known"] == ["plant/cell-1", "plant/cell-8"]
    assert asked("who", "--recording", "run7.csv")[1]["error"]["message"] == "there is no such file"
    assert asked("due")[0] == 1
    history = asked("state", "cell-1")[1]["history"]
    assert history[0]["content"]["facts"] == {"firmware": None}
    assert "firmware=?" in forcemap("register", "state", "cell-1", "--register", where)[1]


def test_what_is_asked_for_otherwise_written_is_found_and_what_is_not_there_is_said(register, folders, asked):
    asked("enter", *folders)
    assert len(asked("who", "--firmware", " 5.11 ")[1]["cells"]) == 3
    assert len(asked("who", "--device", "pfmd, d0")[1]["cells"]) == 3
    answer = asked("who", "--firmware", "5.1l")[1]
    assert (answer["cells"], answer["known"]) == ([], ["5.11"])


def test_conditions_of_a_campaign_are_facts_of_its_day(register, tmp_path):
    def now():
        return {fact.kind: fact.value for fact in cell_state(register, "cell-1")[0].facts}

    enter(register, collected(tmp_path / "b", 30, 2, firmware="5.12", date="2026-02-10"))
    enter(register, collected(tmp_path / "a", 30, 1, firmware="5.10", date="2026-02-01"))  # an older one, later
    assert now()["firmware"] == "5.12"
    change(register, "plant/cell-1", {"tool": "hook"}, since="2026-03-01")
    enter(register, collected(tmp_path / "c", 30, 3, firmware="5.12", date="2026-03-01"))
    assert now()["tool"] is None  # of one day two tools are stated
    enter(register, collected(tmp_path / "d", 30, 4, firmware="5.12", date="2026-03-02"))
    assert now() == {
        "robot": "UR10e, R-cell-1",
        "controller": "CB5, C-cell-1",
        "firmware": "5.12",
        "safety_checksum": "A1B2",
        "tool": "gripper",
        "program": "pick 3",
        "covers": "none",
        "device": "PFMD, D1",
    }
    change(register, "plant/cell-1", {"covers": "?"})
    assert now()["covers"] is None


@pytest.mark.parametrize("words", [["firmware"], ["speed=1"], ["firmware="], ["tool=a", "tool=b"], ["tool=a\0b"]])
def test_a_change_that_says_nothing_is_refused(words, blank, tmp_path, ask):
    where = shutil.copy(blank, tmp_path / "r.sqlite")
    code, answer = ask("register", "change", "plant/cell-1", *words, "--new", "--register", where)
    assert (code, answer["error"]["kind"]) == (2, "input")
    assert ask("register", "change", "plant/x", "tool=a", "--new", "--since", "2999-01-01", "--register", where)[0] == 2


def test_a_cell_is_spelt_in_one_way(register, folders, tmp_path):
    """A slip of a capital would make a second cell, and what is entered there would end no release of the first."""
    enter(register, folders[0])
    (cell,) = rows(register, "cells")
    site, name = cell["site"], cell["name"]
    with pytest.raises(RegisterError, match="write it as there"):
        change(register, f"{site.upper()}/{name.upper()}", {"firmware": "5.13"}, new=True)
    folder = shutil.copytree(folders[0], tmp_path / "slip")
    stated = (folder / "campaign.toml").read_text()
    assert f'cell = "{name}"' in stated
    (folder / "campaign.toml").write_text(stated.replace(f'cell = "{name}"', f'cell = "{name.upper()}"'))
    with pytest.raises(RegisterError, match=f"there is a cell '{site}/{name}', found '{site}/{name.upper()}'"):
        enter(register, folder)
    assert rows(register, "cells") == [cell]


def add_release(register, cell=1, **stated):
    """A release as a row, without the campaign that it would be made of."""
    under = {fact.kind: fact.value for fact in cell_state(register, "cell-1")[0].facts}
    values = {"subject": "workspace", "areas": "chest", "contact": "transient", "bound": "b"}
    values["speeds"] = json.dumps({"lowest_to_program_mps": 0.1, "highest_to_program_mps": 0.2})
    values |= {"report_sha256": "0" * 64, "map_sha256": "ab" * 32, "conditions": json.dumps(under), "simulated": 0}
    values |= {"valid_until": UNTIL, "measured_on": DAY, "calibrated": None, "calibrated_until": "2026-12-31"}
    values |= {"device_spring_N_per_m": 75e3, "area_spring_N_per_m": 25e3, "limit_N": 280.0, "replaces": None}
    with register.writing() as connection:
        action = Action(register, connection, "operator")
        numbers = {"cell_id": cell, "campaign_id": cell, "person": "operator", "at": action.at}
        number = action.add(RELEASES, **values | numbers | stated)
        action.done("release", f"release {number}")
    return number


def test_a_release_is_that_of_its_report(blank, measured, tmp_path, ask, forcemap):
    """Bound, form and table of limits of the report count, and its word on the contact points."""
    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    folder = Path(shutil.copytree(measured, tmp_path / "west"))
    edit(folder / "contact_points.csv", "P2,temple", "P2,chest")
    workspace = ["--area", "chest", "--contact", "transient"]

    def reports(*options):
        (folder / "report.html").unlink(missing_ok=True)
        assert forcemap("report", folder, *options)[0] == 0
        assert ask("register", "enter", folder, "--register", where)[0] == 0

    def releases(*what):
        line = ["register", "release", "cell-1", folder, *what, "--valid-until", UNTIL, "--register", where]
        code, answer = ask(*line)
        return answer["release"] if not code else answer["error"]["message"]

    for options, words in (
        (["--bound", "tolerance:0.99/0.99"], "the report is of CFM_3D with tolerance bound, 99 %"),
        (["--form", "CFM_2D"], "the report is of CFM_2D with"),
    ):
        reports("--area", "chest", *options)
        assert words in releases(*workspace)
        assert words in releases("--point", "P1")
    reports("--area", "chest")
    assert releases(*workspace) == 1
    assert (
        ask("register", "state", "cell-1", "--register", where)[1]["releases"][0]["speeds"]["points_not_permitted"]
        == []
    )
    edit(folder / "contact_points.csv", "P2,chest", "P2,temple")
    reports("--area", "chest")
    assert releases(*workspace) == 2
    assert "not permitted" in releases("--point", "P2")
    listed = (folder / "contact_points.csv").read_text()

    def not_permitted():
        newest = ask("register", "state", "cell-1", "--register", where)[1]["releases"][0]
        return newest["release"], newest["speeds"]["points_not_permitted"]

    for number, stated, names in (
        (3, None, ["P2"]),  # without a list the campaign says nothing of the points
        (4, listed.replace("P2,temple", "P2,chest"), []),
        (5, None, []),
    ):
        (folder / "contact_points.csv").write_text(stated) if stated else (folder / "contact_points.csv").unlink()
        reports("--area", "chest")
        assert releases(*workspace) == number
        assert not_permitted() == (number, names)
        if names:
            newest = ask("register", "state", "cell-1", "--register", where)[1]["releases"][0]
            assert "by an earlier release of this cell" in newest["speeds"]["warnings"][0]


def test_of_a_release_of_before_it_is_not_known_whether_its_points_are_permitted(register, folders):
    enter(register, folders[0])
    add_release(register)
    cell = CellAnswer.of(cell_state(register, "cell-1")[0])
    assert cell.standing.endswith("CONTACT POINTS NOT KNOWN")
    kept = json.dumps({"lowest_to_program_mps": 0.1, "highest_to_program_mps": 0.2, "warnings": ["w"]})
    add_release(register, subject="task kept", speeds=kept)
    newest = CellAnswer.of(cell_state(register, "cell-1")[0]).releases[0]
    assert newest.warnings[0].startswith("WHETHER ITS CONTACT POINTS WERE PERMITTED IS NOT KNOWN")
    assert newest.warnings[1:] == ["w"]


def test_a_release_of_simulated_impacts_is_due(register, folders):
    enter(register, folders[0])
    add_release(register, subject="task measured")
    number = add_release(register, simulated=1)
    (due,) = [each for each in what_is_due(register) if each.release]
    assert (due.release, [finding.kind.value for finding in due.findings]) == (number, ["release_simulated"])


def test_a_clock_that_is_set_back_brings_nothing_into_force(register, folders):
    from dataclasses import replace

    enter(register, folders[0])
    real = datetime.datetime.now(datetime.UTC)
    ahead = replace(register, time=lambda: real + datetime.timedelta(days=2))
    number = add_release(ahead)
    assert cell_state(ahead, "cell-1")[0].in_force
    change(register, "plant/cell-1", {"tool": "hook"})  # two days before the release, says this clock
    assert not cell_state(ahead, "cell-1")[0].in_force
    assert not cell_state(register, "cell-1")[0].in_force
    withdraw(register, number, "x")
    times = [row["at"] for row in rows(register, "audit")]
    assert times == sorted(times)
    short = add_release(register, valid_until=real.date().isoformat())
    (found,) = [each for each in cell_state(register, "cell-1")[0].releases if each.release == short]
    assert not found.in_force  # the newest entry is of a day when it was over
    assert whole(register)


# what is asked


def test_questions_against_the_folders_themselves(register, folders, asked, tmp_path):
    asked("enter", *folders)
    add_release(register)
    entries = {folder.name: fm.read_campaign(folder).entries for folder in folders}
    limit = sorted(entry.peak_force for each in entries.values() for entry in each)[-30]
    code, answer = asked("exceeded", "--limit-N", str(limit))
    assert code == 1
    expected = {name: sum(entry.peak_force > limit for entry in each) for name, each in entries.items()}
    near = {name: sum(limit - 3 < entry.peak_force <= limit for entry in each) for name, each in entries.items()}
    found = {each["campaign"]: each for each in answer["campaigns"]}
    assert {name: each["exceeded"] for name, each in found.items()} == {
        n: c for n, c in expected.items() if c or near[n]
    }
    assert all(each["cannot_tell"] == near[name] for name, each in found.items())
    highest = max((entry.peak_force, name, entry.file) for name, each in entries.items() for entry in each)
    assert tuple(answer["largest"][0][key] for key in ("largest_N", "campaign", "file")) == highest
    assert asked("exceeded", "--limit-N", "5000")[0] == 0
    assert asked("exceeded", "--limit-N", "0")[0] == 2

    digest = entries["c1"][5].sha256
    for word in (digest, digest[:10], str(folders[1] / "recordings" / entries["c1"][5].file)):
        assert [each["cell"] for each in asked("who", "--recording", word)[1]["cells"]] == ["plant/cell-1"]
    assert asked("who", "--recording", "f" * 64)[1]["cells"] == []
    assert [each["cell"] for each in asked("who", "--device", "D1")[1]["cells"]] == ["plant/cell-1", "plant/cell-3"]
    assert [each["cell"] for each in asked("who", "--map", "ab" * 32)[1]["cells"]] == ["plant/cell-1"]
    asked("change", "plant/cell-2", "firmware=5.12")
    assert [each["cell"] for each in asked("who", "--firmware", "5.12")[1]["cells"]] == ["plant/cell-2"]
    assert len(asked("who", "--firmware", "5.11")[1]["cells"]) == 2
    due = {each["cell"] for each in asked("due")[1]["due"]}
    assert due == {"", "plant/cell-2", "plant/cell-3"}  # nothing released; the devices' calibrations are over
    for ending, read in (
        (".csv", lambda f: list(csv.DictReader(f.read_text().splitlines()))),
        (".json", lambda f: json.loads(f.read_text())),
    ):
        assert asked("export", "impacts", "-o", tmp_path / f"x{ending}")[1]["rows"] == 200
        written = read(tmp_path / f"x{ending}")
        assert sum(float(row["largest_N"]) for row in written) == sum(
            e.peak_force for each in entries.values() for e in each
        )
    assert asked("export", "impacts", "-o", tmp_path / "x.csv")[0] == 2
    assert asked("export", "releases", "-o", tmp_path / "r.json")[0] == 0
    (written,) = json.loads((tmp_path / "r.json").read_text())
    assert (written["in_force"], written["why_not"], written["points_not_permitted"]) == (1, "", "not known")


# what keeps it as it is


def filled(register, folders):
    """A row in every table."""
    folder = folders[0]
    enter(register, folder)
    with register.writing() as connection:
        action = Action(register, connection, "operator")
        action.add(METADATA.tables["maps"], campaign_id=1, sha256="ab" * 32, file="maps/a.json", form="CFM_3D")
        words = {"name": "P1", "area": "chest", "contact": "transient", "rests_on": "map"}
        action.add(METADATA.tables["contact_points"], campaign_id=1, **words, programmed_mps=0.25)
        action.done("enter", "more")
    withdraw(register, add_release(register), "x", person="operator")


@pytest.fixture(scope="module")
def full(blank, server_or_none, folders, tmp_path_factory):
    """A register of each database with a row in every table: whoever asks for it has a copy of it for a new one."""
    made = {"sqlite": str(shutil.copy(blank, tmp_path_factory.mktemp("full") / "full.sqlite"))}
    if server_or_none:
        made["postgresql"] = new_database(server_or_none, "blank")
    for where in made.values():
        with open_register(where) as register:
            filled(register, folders)
    return made


def owner(register, *statements):
    """Run statements as the one that owns the database, in one transaction."""
    with register.engine.connect() as connection, connection.begin():
        for statement in statements:
            connection.execute(text(statement))


def test_no_row_is_changed_or_deleted(register, folders):
    filled(register, folders)
    before = {name: rows(register, name) for name in METADATA.tables}
    assert all(before.values())
    for name, there in before.items():
        column = next(column for column in there[0] if column not in ("id", "entry"))
        statements = [f'update {name} set "{column}" = "{column}"', f"delete from {name}"]
        if register.postgresql:
            statements.append(f"truncate {name} cascade")
        elif name in ("audit", "recordings", "impacts", "releases", "withdrawals"):
            statements.append(f"insert or replace into {name} select * from {name}")
        for statement in statements:
            with pytest.raises(Exception, match="never changed or deleted"):
                owner(register, statement)
    assert {name: rows(register, name) for name in METADATA.tables} == before


TAMPERED = [*(name for name in METADATA.tables if name != "audit"), "an entry", "its words", "the newest entries"]


@pytest.mark.parametrize("database", DATABASES)
def test_a_changed_row_or_a_removed_entry_is_found(database, request, blank, server_or_none, folders, tmp_path):
    if database == "postgresql" and server_or_none is None:
        pytest.skip(postgres.REASON)
    template = (
        shutil.copy(blank, tmp_path / "t.sqlite") if database == "sqlite" else new_database(server_or_none, "blank")
    )
    register = open_register(str(template))
    filled(register, folders)
    unkept(register)
    with register.reading() as connection:
        assert verify(connection) == ()
    head = newest(register)
    register.engine.dispose()
    for what in TAMPERED:
        if database == "sqlite":
            where = str(shutil.copy(template, tmp_path / f"{TAMPERED.index(what)}.sqlite"))
        else:
            where = new_database(server_or_none, database_of(template))
        opened = open_register(where)
        tamper(opened, what)
        with opened.reading() as connection:
            problems = verify(connection, head)
            assert problems, what
            assert verify(connection) == () if what == "the newest entries" else verify(connection)
        opened.engine.dispose()


def newest(register):
    with register.reading() as connection:
        from forcemap.register.audit import head

        return str(head(connection))


def unkept(register):
    """Take away the triggers, as whoever owns the database can."""
    if register.postgresql:
        owner(register, "drop function forcemap_keep() cascade")
        keys = "select conrelid::regclass || ' drop constraint ' || conname from pg_constraint where contype = 'f'"
        with register.reading() as connection:
            found = [row[0] for row in connection.execute(text(keys))]
        owner(register, *(f"alter table {each}" for each in found))
        return
    with register.reading() as connection:
        found = [row[0] for row in connection.execute(text("select name from sqlite_master where type = 'trigger'"))]
    owner(register, *(f"drop trigger {name}" for name in found))


def tamper(register, what):
    if not register.postgresql:
        from sqlalchemy import event

        event.listen(register.engine, "checkout", lambda raw, *_: raw.execute("pragma foreign_keys = off"))
    if what == "an entry":
        owner(register, "delete from audit where id = 2")
    elif what == "its words":
        owner(register, "update audit set person = 'somebody' where id = 2")
    elif what == "the newest entries":
        last = count(register, "audit")
        owner(register, f"delete from withdrawals where entry = {last}", f"delete from audit where id = {last}")
    else:
        table = METADATA.tables[what]
        column = next(c.name for c in table.columns if c.name not in ("id", "entry") and not c.foreign_keys)
        value = "0.1" if "FLOAT" in str(table.c[column].type) or "INT" in str(table.c[column].type) else "'tampered'"
        owner(register, f'update {what} set "{column}" = {value} where id = (select max(id) from {what})')


LAST = 2**63 - 1
AN_ENTRY = (
    "insert into audit select {id}, at, person, {login}, action, subject, content, {previous}, '{hash}' from audit"
)
AN_ENTRY += " where id = (select max(id) from audit)"
NEXT = {"id": "id + 1", "login": "login", "previous": "sha256", "hash": "0" * 64}
ROWS_THAT_DO_NOT_FOLLOW = {
    "an entry at the end of all numbers": AN_ENTRY.format(**NEXT | {"id": LAST}),
    "an entry before the first": AN_ENTRY.format(**NEXT | {"id": 0}),
    "an entry that leaves one out": AN_ENTRY.format(**NEXT | {"id": "id + 2"}),
    "an entry chained to another": AN_ENTRY.format(**NEXT | {"previous": "previous || 'x'"}),
    "a row at the end of all numbers": f"insert into cells select {LAST}, site, 'x', entry from cells",
    "a row of an earlier entry": "insert into cells select (select max(id) from cells) + 1, site, 'x', 1 from cells "
    "where id = 1",
}


@pytest.mark.parametrize("case", ROWS_THAT_DO_NOT_FOLLOW)
def test_a_row_that_does_not_follow_the_newest_is_refused(case, full, register, asked):
    before = {name: rows(register, name) for name in METADATA.tables}
    with pytest.raises(Exception, match="a new one follows the newest"):
        owner(register, ROWS_THAT_DO_NOT_FOLLOW[case])
    assert {name: rows(register, name) for name in METADATA.tables} == before
    change(register, "plant/cell-1", {"tool": "hook"})
    assert asked("verify")[1]["problems"] == []


def test_an_entry_in_the_name_of_another_account_is_refused(server, folders):
    url = new_database(server, "blank")
    register = open_register(url)
    filled(register, folders)
    name = f"anna{next(_NAMES)}"
    owner(register, f"create role {name} login in role forcemap_operator")
    own = {"login": "session_user"}
    rows_of = (
        "insert into cells select (select max(id) from cells) + 1, site, 'x', (select max(id) from audit) from cells"
    )
    with connect(url.replace("owner@", f"{name}@")) as anna:
        for before in (
            (),
            ("create temp table audit as select * from audit limit 0", "set search_path = pg_temp, public"),
        ):
            for entry in (AN_ENTRY.format(**NEXT), AN_ENTRY.format(**NEXT | own | {"id": LAST}), rows_of):
                entry = entry.replace("into audit", "into public.audit").replace("from audit", "from public.audit")
                with pytest.raises(Exception, match="of the account that enters it"):
                    owner(anna, *before, entry)
        owner(anna, AN_ENTRY.format(**NEXT | own))
    register.engine.dispose()


PARTIAL = "update sqlite_master set sql = sql || ' where id < 0' where name = '{0}'"
RESTORED = "update sqlite_master set sql = replace(sql, ' where id < 0', '')"
STRUCTURES = {  # what is done, of which database, and what verify says
    "trigger dropped": ("sqlite", "drop trigger facts_kept_update", "trigger facts_kept_update is missing"),
    "trigger of another": (
        "sqlite",
        "create trigger mine after insert on audit begin select 1\\; end",
        "trigger mine is none",
    ),
    "trigger altered": (
        "sqlite",
        "drop trigger cells_kept_delete;create trigger cells_kept_delete before delete on cells begin select 1\\; end",
        "trigger cells_kept_delete is not as it was made",
    ),
    "index partial": (
        "sqlite",
        PARTIAL.format("facts_cell") + ";reindex facts_cell",
        "index facts_cell is not as it was made",
    ),
    "index without rows": (
        "sqlite",
        PARTIAL.format("facts_cell") + ";reindex facts_cell;" + RESTORED,
        "the file is damaged: row 1 missing from index facts_cell",
    ),
    "index dropped": ("both", "drop index facts_cell", "facts_cell is missing"),
    "table of another": ("both", "create table mine (x integer)", "table mine is none of the register's"),
    "view of another": ("sqlite", "create view mine as select 1", "view mine is none"),
    "column added": ("both", "alter table facts add column mine integer", "facts"),
    "trigger dropped there": (
        "postgresql",
        "drop trigger facts_kept_row on facts",
        "trigger facts_kept_row of facts is missing",
    ),
    "trigger disabled": (
        "postgresql",
        "alter table facts disable trigger facts_kept_row",
        "trigger facts_kept_row of facts is not",
    ),
    "all disabled": ("postgresql", "alter table uses disable trigger all", "foreign keys of uses is switched off"),
    "only sometimes": (
        "postgresql",
        "drop trigger maps_kept_row on maps;create trigger maps_kept_row before update or delete on maps for each row "
        "when (old.id > 5) execute function forcemap_keep()",
        "trigger maps_kept_row of maps is not",
    ),
    "function altered": (
        "postgresql",
        "create or replace function forcemap_keep() returns trigger language plpgsql as $$ begin return old\\; end $$",
        "trigger facts_kept_row of facts is not",
    ),
    "trigger of another there": (
        "postgresql",
        "create trigger mine before insert on facts for each row execute function forcemap_keep()",
        "trigger mine of facts is none",
    ),
    "index partial there": (
        "postgresql",
        "drop index facts_cell;create index facts_cell on facts (cell_id, kind) where id < 0",
        "index facts_cell leaves out rows",
    ),
    "row security": ("postgresql", "alter table facts enable row level security", "table facts has rules"),
    "rule": ("postgresql", "create rule mine as on insert to facts do instead nothing", "table facts has rules"),
    "key dropped": ("postgresql", "alter table facts drop constraint facts_pkey", "table facts has rules"),
    "heir": ("postgresql", "create table mine () inherits (facts)", "table facts has rules"),
}


@pytest.mark.parametrize(
    ("where", "case"),
    [(name, case) for case, (of, *_) in STRUCTURES.items() for name in (DATABASES if of == "both" else (of,))],
    indirect=["where"],
)
def test_a_structure_that_is_not_as_it_was_made_is_found(case, full, register, asked, where):
    _, statements, words = STRUCTURES[case]
    assert asked("verify")[0] == 0
    each = [statement.replace("\\;", ";") for statement in re.split(r"(?<!\\);", statements)]
    if register.postgresql:
        owner(register, *each)
    for statement in [] if register.postgresql else each:
        with closing(sqlite3.connect(where, isolation_level=None)) as raw:
            raw.execute("pragma writable_schema = on")
            raw.execute(statement)
    code, answer = asked("verify", "--head", newest(register))
    assert (code, answer["holds"]) == (1, False)
    assert any(words in problem for problem in answer["problems"]), answer["problems"]


def test_a_name_of_a_register_that_is_empty_is_refused(ask):
    code, answer = ask("register", "state", "cell-1", "--register", "")
    assert code == 2
    assert "found no name" in answer["error"]["message"]


NO_HEADS = [
    "",
    " ",
    "0:" + "f" * 64,
    "0",
    "1:",
    "1:" + "F" * 64,
    "01:" + "0" * 64,
    "\u0661:" + "0" * 64,
    "-1:" + "0" * 64,
]


def test_what_is_no_head_is_refused(asked):
    for head in NO_HEADS:
        code, answer = asked("verify", "--head", head)
        assert (code, answer["error"]["kind"]) == (2, "input"), head
        assert "expected NUMBER:SHA256" in answer["error"]["message"], head
    assert asked("verify", "--head", asked("verify")[1]["head"]["noted"])[0] == 0  # of an empty register


# a file that is taken away


def with_copy(where, *, also=False):
    copy = f"{where}.copy"
    with sqlite3.connect(where) as source, sqlite3.connect(copy) as target:
        source.backup(target)
    if also:
        shutil.copyfile(copy, where)
    else:
        os.replace(copy, where)


TAKEN_AWAY = {
    "replaced": with_copy,
    "deleted": os.unlink,
    "moved": lambda where: os.rename(where, f"{where}.old"),
    "its log deleted": lambda where: os.unlink(f"{where}-wal"),
    "the log's index deleted": lambda where: os.unlink(f"{where}-shm"),
    "all deleted": lambda where: [os.unlink(f"{where}{end}") for end in ("", "-wal", "-shm")],
    "overwritten": lambda where: Path(where).write_bytes(b"rubbish"),
    "overwritten, as long": lambda where: Path(where).write_bytes(b"rubbish " * (os.path.getsize(where) // 8)),
    "its pages overwritten": lambda where: overwritten(where, 4096),
    "no directory": lambda where: os.rename(Path(where).parent, Path(where).parent.with_name("gone")),
}


def overwritten(where, first):
    size = os.path.getsize(where)
    with open(where, "r+b") as file:
        file.seek(first)
        file.write(b"rubbish " * ((size - first) // 8))


@pytest.mark.parametrize("case", TAKEN_AWAY)
def test_a_file_that_was_taken_away_is_neither_shown_nor_written(case, blank, folders, tmp_path):
    (tmp_path / "place").mkdir()
    where = str(shutil.copy(blank, tmp_path / "place" / "r.sqlite"))
    with open_register(where) as register:
        enter(register, folders[0])
        add_release(register)
    with client_of(folders[0].parent, register=where) as client, open_register(where) as register:
        assert "In force until" in client.get("/register/cell?cell=plant/cell-1").text
        assert client.get("/register").status_code == 200
        TAKEN_AWAY[case](where)
        there = os.path.exists(where)
        for path in (
            "/register",
            "/register/cell?cell=plant/cell-1",
            "/api/register",
            "/api/register/cell?cell=cell-1",
        ):
            for _ in range(2):
                answer = client.get(path)
                assert answer.status_code >= 400, (path, answer.text)
                assert "0.100" not in answer.text
        for _ in range(2):
            with pytest.raises(fm.InputError) as caught:
                change(register, "plant/cell-1", {"tool": "hook"})
            assert str(caught.value).count("\n") == 0
        assert os.path.exists(where) == there


def test_a_file_that_is_taken_away_while_it_is_written_acknowledges_nothing(blank, tmp_path):
    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    with open_register(where) as register:
        change(register, "plant/cell-1", {"tool": "hook"}, new=True)
        with pytest.raises(fm.InputError, match="replaced or deleted"):
            moved_meanwhile(register, where)


def moved_meanwhile(register, where):
    with register.writing() as connection:
        Action(register, connection, "operator").done("change", "plant/cell-1")
        os.rename(where, f"{where}.old")


@pytest.mark.skipif(not hasattr(os, "seteuid") or os.getuid() != 0, reason="takes another account")
def test_a_file_that_may_not_be_read_any_more_is_not_shown(blank):
    with tempfile.TemporaryDirectory() as home:
        os.chmod(home, 0o777)
        where = shutil.copy(blank, Path(home) / "r.sqlite")
        os.chown(where, 65534, -1)
        os.seteuid(65534)
        try:
            with open_register(str(where)) as register:
                change(register, "plant/cell-1", {"tool": "hook"}, new=True)
                os.chmod(where, 0)
                with pytest.raises(fm.InputError, match="cannot be opened"):
                    cell_state(register, "plant/cell-1")
        finally:
            os.seteuid(0)


# who may do what


def test_every_role_against_every_table_and_statement(server, folders):
    url = new_database(server, "blank")
    register = open_register(url)
    filled(register, folders)
    second = add_release(register)
    owner(
        register, *(f"create role {role}_1 login in role {role}" for role in ROLES if not known(register, f"{role}_1"))
    )
    owner(register, "create role outsider login") if not known(register, "outsider") else None
    for role, own in {**ROLES, "outsider": None}.items():
        user = f"{role}_1" if own is not None else role
        other = connect(url.replace("owner@", f"{user}@"))
        for name, table in METADATA.tables.items():
            columns = ", ".join(f'"{column.name}"' for column in table.columns)
            tried = {
                f"select * from {name}": own is not None,
                f"insert into {name} ({columns}) select {columns} from {name} where false": own is not None
                and name in own,
                f"update {name} set id = id": False,
                f"delete from {name}": False,
                f"truncate {name}": False,
                f"drop table {name}": False,
                f"alter table {name} disable trigger all": False,
                f"create trigger mine before insert on {name} execute function forcemap_keep()": False,
            }
            for statement, allowed in tried.items():
                assert may(other, statement) == allowed, (user, statement)
        other.engine.dispose()
    reader = connect(url.replace("owner@", "forcemap_reader_1@"))
    with pytest.raises(fm.InputError, match="this account may not do that"):
        change(reader, "plant/cell-1", {"tool": "hook"})
    operator = connect(url.replace("owner@", "forcemap_operator_1@"))
    change(operator, "plant/cell-1", {"tool": "hook"})
    enter(operator, folders[2])
    with pytest.raises(fm.InputError, match="this account may not do that"):
        withdraw(operator, second, "x")
    releaser = connect(url.replace("owner@", "forcemap_releaser_1@"))
    withdraw(releaser, second, "x")
    assert [row["login"] for row in rows(register, "audit")][-3:] == [
        *("forcemap_operator_1", "forcemap_operator_1", "forcemap_releaser_1"),
    ]
    assert whole(reader)
    with reader.reading() as connection:
        assert altered(connection) == ()
    for each in (reader, operator, releaser, register):
        each.engine.dispose()


def known(register, role):
    with register.reading() as connection:
        return connection.execute(text(f"select 1 from pg_roles where rolname = '{role}'")).first() is not None


def may(register, statement):
    """Whether this account may; a trigger that refuses it is none of its rights."""
    with register.engine.connect() as connection:
        transaction = connection.begin()
        try:
            connection.execute(text(statement))
        except DBAPIError as error:
            if error.orig.sqlstate == "42501":
                return False
            raise
        finally:
            transaction.rollback()
    return True


# what goes on at once, or ends in the middle


def in_process(where, folders, order, waits):
    opened = open_register(where)
    for folder in random.Random(order).sample(folders, len(folders)):
        start = time.perf_counter()
        enter(opened, folder)
        waits.put(time.perf_counter() - start)
    opened.engine.dispose()


def test_twenty_processes_enter_the_same(register, where, tmp_path):
    many = 20 if FULL_SIZE else 6
    folders = [collected(tmp_path / f"c{i}", 30, i, cell=f"cell-{i}") for i in range(20 if FULL_SIZE else 3)]
    waits = PROCESSES.Queue()
    workers = [PROCESSES.Process(target=in_process, args=(where, folders, i, waits)) for i in range(many)]
    for each in workers:
        each.start()
    times = [waits.get(timeout=120) for _ in range(many * len(folders))]
    for each in workers:
        each.join(60)
    assert [each.exitcode for each in workers] == [0] * many
    assert count(register, "campaigns") == count(register, "audit") == len(folders)
    assert count(register, "recordings") == count(register, "impacts") == 30 * len(folders)
    assert whole(register)
    if FULL_SIZE:
        print(f"{register.engine.dialect.name}: 99 % of {len(times)} within {np.quantile(times, 0.99):.2f} s")
        assert np.quantile(times, 0.99) < (1.0 if register.postgresql else 3.0)


def going_on(where, folder, number, told):
    """Enter, change and withdraw for ever; say what was acknowledged."""
    opened, i = open_register(where), 0
    while True:
        i += 1
        head = change(opened, f"plant/k{number}", {"tool": f"{i}"}, new=True, person="operator").head
        told.send(head.number)
        enter(opened, folder, cell=f"plant/k{number}-{i}", new=True, person="operator")
        told.send(count(opened, "audit"))


def releasing(where, folder, number, told):
    """Release and withdraw for ever; say what was acknowledged."""
    opened = open_register(where)
    chest = [(fm.force_limit("chest"), fm.Contact.TRANSIENT)]
    while True:
        made = release(opened, "plant/cell-1", folder, limits=chest, valid_until=UNTIL, person="releaser")
        told.send(made.head.number)
        told.send(withdraw(opened, made.release, f"by {number}", person="releaser").number)


def test_killed_at_any_moment_nothing_is_half_and_nothing_acknowledged_is_lost(register, where, tmp_path, measured):
    folder, rng, newest_told = collected(tmp_path / "c", 30, site="", cell=""), random.Random(1), 0
    enter(register, measured, person="operator")
    of_measured = len(fm.read_campaign(measured).entries)
    for number in range(200 if FULL_SIZE else 4):
        ours, theirs = PROCESSES.Pipe(duplex=False)
        goes_on, content = (releasing, measured) if number % 4 == 3 else (going_on, folder)
        process = PROCESSES.Process(target=goes_on, args=(where, content, number, theirs))
        process.start()
        theirs.close()
        for _ in range(rng.randrange(1, 5)):
            newest_told = max(newest_told, ours.recv())
        time.sleep(rng.uniform(0, 0.05))
        os.kill(process.pid, signal.SIGKILL)
        process.join(30)
        while ours.poll():
            try:
                newest_told = max(newest_told, ours.recv())
            except EOFError:
                break
    assert whole(register)
    assert count(register, "audit") >= newest_told > 0
    assert count(register, "recordings") == 30 + of_measured
    assert count(register, "uses") == 30 * (count(register, "campaigns") - 1) + of_measured
    releases, withdrawn = rows(register, "releases"), rows(register, "withdrawals")
    assert len({each["entry"] for each in (*releases, *withdrawn)}) == len(releases) + len(withdrawn) > 0
    assert len(releases) - len(withdrawn) in (0, 1)


def test_a_server_that_is_killed_and_started_again(folders):
    if postgres.PROGRAMS is None:
        pytest.skip(postgres.REASON)
    server = postgres.Server(SHARED.replace("fsync=off", "fsync=on"))
    try:
        url = server.new("register")
        opened = make_register(url)[0]
        for i in range(20 if FULL_SIZE else 2):
            told = change(opened, "plant/cell-1", {"tool": f"t{i}"}, new=True).head
            with pytest.raises(fm.InputError, match="no connection to the server") as caught:
                lose(opened, server, f"h{i}")
            assert str(caught.value).count("\n") == 0
            with pytest.raises(fm.InputError, match="no connection to the server"):
                change(opened, "plant/cell-1", {"tool": "x"})
            server.start()
            assert newest(opened) == str(told)
        assert whole(opened)
        assert [row["site"] for row in rows(opened, "cells")] == ["plant"]
        opened.engine.dispose()
    finally:
        server.close()


def lose(opened, server, name):
    """Enter something, and kill the server in the middle of it."""
    with opened.writing() as connection:
        action = Action(opened, connection, "operator")
        action.add(METADATA.tables["cells"], site="half", name=name)
        server.stop()
        action.done("change", "half")


def test_a_full_disk_is_one_line_and_nothing_is_lost(blank, folders, tmp_path):
    """A file may not grow beyond a size, as on a disk that is full."""
    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    size = os.path.getsize(where) + 30_000

    def limited():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    command = [sys.executable, "-m", "forcemap", "register", "enter", *map(str, folders), "--register", where]
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=limited)
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr + done.stdout
    assert "disk" in done.stdout
    register = open_register(where)
    assert whole(register)
    assert enter(register, folders[0]).recordings == 40
    register.engine.dispose()


# what is typed


ROUGH = ["'; drop table audit; --", 'a"b', "%s %(x)s :x ?", "naïve 東京 🤖", "x" * 200, "é"]


@pytest.mark.parametrize("words", ROUGH)
def test_rough_words_are_kept_as_they_are(words, register, asked):
    assert asked("change", f"site/{words}", f"tool={words}", "--by", words[:100], "--new")[0] == 0
    assert asked("change", "other/one", "firmware=5.1", "--new")[0] == 0
    import unicodedata

    plain = unicodedata.normalize("NFC", words)
    (fact,) = asked("state", words)[1]["facts"]
    assert fact["value"] == plain
    assert asked("who", "--firmware", words)[1]["cells"] == []
    assert asked("who", "--device", words)[1]["cells"] == []
    assert asked("who", "--map", words)[0] == 2
    assert whole(register)


@pytest.mark.parametrize("words", ["", " ", "a\0b", "a\nb", "\u202eabc", "x" * 10_000_000, "\udcff"])
def test_words_that_no_register_takes_are_one_line(words, blank, tmp_path, ask):
    where = shutil.copy(blank, tmp_path / "r.sqlite")
    for arguments in (
        ["change", f"plant/{words}", "tool=a", "--new"],
        ["change", "p/c", f"tool={words}", "--new"],
        ["state", words],
    ):
        code, answer = ask("register", *arguments, "--register", where)
        assert code == 2
        assert len(answer["error"]["message"]) < 3000
    assert sqlite3.connect(where).execute("select count(*) from audit").fetchone() == (0,)


SECRETS = [
    "postgresql://owner:s3cret@example.org/db",
    "postgres://owner:s3cret@localhost/db",
    "postgresql://owner@localhost/db?password=s3cret",
    "postgresql://owner:s3c:ret@[::1/db",
    "postgresql://owner:s3cret@x@y/db",
    "mysql://owner:s3cret@localhost/db",
]


@pytest.mark.parametrize("url", SECRETS)
def test_a_password_is_refused_and_not_repeated(url, forcemap):
    for command in (["init"], ["due"], ["verify"]):
        code, out, err = forcemap("register", *command, "--register", url)
        assert code == 2
        assert "s3c" not in out + err
        assert err.count("\n") == 1


ELSEWHERE = {  # URL, service file and environment that lead to another machine with less than a verified certificate
    "stated": ("postgresql://example.invalid/db?sslmode=disable", "", {}),
    "not verified": ("postgresql://example.invalid/db?sslmode=require", "", {}),
    "libpq's own": ("postgresql://example.invalid/db?sslmode=prefer", "", {}),
    "one of two": ("postgresql://localhost,example.invalid/db?sslmode=allow", "", {}),
    "service": ("postgresql:///?service=forcemap", "host=example.invalid\nsslmode=require", {}),
    "service, URL": ("postgresql:///db?service=forcemap&sslmode=disable", "hostaddr=192.0.2.1", {}),
    "service, local name": (
        "postgresql:///?service=forcemap&sslmode=disable",
        "host=localhost\nhostaddr=192.0.2.1",
        {},
    ),
    "environment": ("postgresql:///db", "", {"PGHOST": "example.invalid", "PGSSLMODE": "disable"}),
    "address": ("postgresql://localhost/db", "", {"PGHOSTADDR": "192.0.2.1", "PGSSLMODE": "allow"}),
    "service of the environment": ("postgresql:///db", "host=192.0.2.1\nsslmode=allow", {"PGSERVICE": "forcemap"}),
}


@pytest.mark.parametrize("case", ELSEWHERE)
def test_less_than_a_verified_certificate_is_refused_to_another_machine(case, forcemap, tmp_path, monkeypatch):
    url, service, environment = ELSEWHERE[case]
    monkeypatch.setenv("PGSERVICEFILE", str(tmp_path / "service"))
    (tmp_path / "service").write_text(f"[forcemap]\n{service}\n")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    code, _, err = forcemap("register", "due", "--register", url)
    assert (code, err.count("\n")) == (2, 1)
    assert "expected one of verify-ca, verify-full" in err


def test_an_address_is_local_only_if_it_is_known_to_be():
    local = ("", "/tmp", "@socket", "localhost", "127.0.0.1", "127.3.2.1", "::1")
    other = ("example.org", "10.0.0.1", "127.1", "localhost.example.org", "127.0.0.1.example.org", "fe80::1%lo")
    assert [each for each in (*local, *other) if is_local(each)] == list(local)


@pytest.mark.parametrize("where", ["postgresql"], indirect=True)
def test_a_service_file_names_the_server(server, where, tmp_path, monkeypatch, ask, forcemap):
    name = database_of(where)
    monkeypatch.setenv("PGSERVICEFILE", str(tmp_path / "service"))
    (tmp_path / "service").write_text(f"[forcemap]\nhost={server.home}\nuser=owner\ndbname={name}\npassword=s3cret\n")
    for url in ("postgresql:///?service=forcemap", f"postgresql:///{name}?service=forcemap"):
        assert ask("register", "verify", "--register", url)[1]["holds"]
    code, out, err = forcemap("register", "due", "--register", "postgresql:///?service=other")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert 'definition of service "other" not found' in err
    monkeypatch.setenv("PGSERVICE", "forcemap")
    assert ask("register", "verify", "--register", "postgresql:///")[1]["holds"]


def certificate(home, name):
    """A certificate of a server of that name, which signs itself, and its key."""
    made = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", f"/CN={name}"]
    made += ["-addext", f"subjectAltName=DNS:{name}", "-keyout", home / "key.pem", "-out", home / "certificate.pem"]
    subprocess.run([str(each) for each in made], check=True, capture_output=True)
    return home / "certificate.pem", home / "key.pem"


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificate")
@pytest.mark.parametrize("named", ["URL", "service file", "environment"])
def test_a_server_whose_certificate_is_not_verified_gets_no_password(named, tmp_path, forcemap, monkeypatch):
    """127.1 is this machine, by a name that is not known to be: whoever answers there has a certificate of its own."""
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    tls.load_cert_chain(*certificate(tmp_path, "127.1"))
    told = []

    def answers(listening):
        while True:
            try:
                asking, _ = listening.accept()
            except OSError:
                return
            with asking:
                asking.settimeout(5)
                told.append(asking.recv(8))
                asking.sendall(b"S")
                try:
                    with tls.wrap_socket(asking, server_side=True) as secret:
                        told.append(secret.recv(1000))
                except OSError:
                    pass

    with socket.create_server(("127.0.0.1", 0)) as listening:
        thread = threading.Thread(target=answers, args=(listening,))
        thread.start()
        port = listening.getsockname()[1]
        monkeypatch.setenv("PGPASSWORD", "s3cret")
        monkeypatch.setenv("PGSERVICEFILE", str(tmp_path / "service"))
        (tmp_path / "service").write_text(f"[forcemap]\nhost=127.1\nport={port}\n")
        if named == "environment":
            monkeypatch.setenv("PGHOST", "127.1")
            monkeypatch.setenv("PGPORT", str(port))
        url = {"URL": f"//anna@127.1:{port}/db", "service file": "//anna@/db?service=forcemap"}.get(named, "//anna@/db")
        code, out, err = forcemap("register", "due", "--register", f"postgresql:{url}")
        listening.shutdown(socket.SHUT_RDWR)
        thread.join(10)
    assert (code, err.count("\n")) == (2, 1)
    assert "certificate verify failed" in err
    assert "s3cret" not in out + err
    assert set(told) == {struct.pack("!ii", 8, 80877103)}  # it asked for TLS, and said no more


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificate")
def test_a_server_whose_certificate_is_verified_is_used(tmp_path, ask, forcemap):
    if postgres.PROGRAMS is None:
        pytest.skip(postgres.REASON)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
    server = postgres.Server(f"-c fsync=off -c listen_addresses=127.0.0.1 -c port={port}")
    try:
        own, _ = certificate(tmp_path, "127.1")
        for file in ("certificate.pem", "key.pem"):
            shutil.copy(tmp_path / file, server.data)
            shutil.chown(server.data / file, server.data.owner())
            (server.data / file).chmod(0o600)
        with (server.data / "postgresql.auto.conf").open("a") as settings:
            settings.write("ssl = on\nssl_cert_file = 'certificate.pem'\nssl_key_file = 'key.pem'\n")
        server.stop("fast")
        server.start()
        url = f"postgresql://owner@127.1:{port}/postgres"
        assert "certificate verify failed" in forcemap("register", "init", "--register", url)[2]
        assert ask("register", "init", "--register", f"{url}?sslrootcert={own}")[1]["schema_now"] == SCHEMA
        assert ask("register", "verify", "--register", f"{url}?sslrootcert={own}&sslmode=verify-ca")[1]["holds"]
        assert ask("register", "verify", "--register", url.replace("127.1", "127.0.0.1"))[1]["holds"]
    finally:
        server.close()


def test_files_of_other_kinds_and_places(tmp_path, ask, folders):
    (tmp_path / "text.sqlite").write_text("not a database, but long enough to be one" * 100)
    other = sqlite3.connect(tmp_path / "other.sqlite")
    other.execute("create table mine (x)")
    other.commit()
    before = {name: (tmp_path / name).read_bytes() for name in ("text.sqlite",)}
    for name, words in {
        "text.sqlite": "another file",
        "other.sqlite": "register",
        "missing.sqlite": "forcemap register init makes it",
        "no/folder/a.sqlite": "forcemap register init makes it",
        "": "",
    }.items():
        code, answer = ask("register", "due", "--register", tmp_path / name)
        assert code == 2
        assert words in answer["error"]["message"]
    assert ask("register", "init", "--register", tmp_path / "other.sqlite")[0] == 2
    assert ask("register", "init", "--register", tmp_path / "text.sqlite")[0] == 2
    assert {name: (tmp_path / name).read_bytes() for name in before} == before
    assert ask("register", "init", "--register", tmp_path / "a" / "b.sqlite")[1]["schema_before"] is None
    assert ask("register", "init", "--register", tmp_path / "a" / "b.sqlite")[1]["schema_before"] == SCHEMA


def test_network_file_systems_are_told_by_what_is_mounted():
    mounts = (
        "/dev/sda / ext4 rw 0 0\nserver:/x /srv nfs4 rw 0 0\n//s/y /srv/a\\040b cifs rw 0 0\ntmp /srv/own tmpfs rw\n"
    )
    kinds = {"/home/x": "ext4", "/srv/x/y": "nfs4", "/srv/a b/x": "cifs", "/srv/own/x": "tmpfs", "/srvx": "ext4"}
    assert {path: file_system(Path(path), mounts) for path in kinds} == kinds
    assert [is_network(kind) for kind in ("ext4", "tmpfs", "overlay", "nfs4", "cifs", "fuse.sshfs", "9p")] == [
        *(False, False, False, True, True, True, True),
    ]


# migrations


@pytest.mark.parametrize("schema", ["v1", "v2", "v3"])
@pytest.mark.parametrize("database", DATABASES)
def test_an_earlier_schema_is_migrated_with_its_data_and_triggers(
    database, schema, server_or_none, tmp_path, folders, ask
):
    dump = Path(__file__).with_name(f"register_{schema}.{database}.sql")
    where = an_empty_database(database, server_or_none, tmp_path)
    if database == "sqlite":
        with sqlite3.connect(where) as raw:
            raw.executescript(dump.read_text())
    else:
        name = database_of(where)
        server_or_none._run(
            "psql", "-q", "-v", "ON_ERROR_STOP=1", "-h", server_or_none.home, "-U", "owner", "-f", dump, name
        )
    code, answer = ask("register", "due", "--register", where)
    assert (code, answer["error"]["kind"]) == (2, "register")
    assert f"schema {schema}, expected {SCHEMA}" in answer["error"]["message"]
    old = connect(where)
    with old.reading() as connection:
        names = [name for name in METADATA.tables if inspect(connection).has_table(name)]
        before = {name: [*connection.execute(text(f"select * from {name}")).mappings()] for name in names}
    assert len(before) == len(METADATA.tables) - (schema == "v1")
    assert all(before.values())
    assert ask("register", "init", "--register", where)[1]["schema_before"] == schema
    added = {name: {"measured_from": None} for name in ("campaigns", "releases")}
    assert {name: rows(old, name) for name in before} == {
        name: [{**row, **added.get(name, {})} for row in there] for name, there in before.items()
    }
    assert ask("register", "verify", "--register", where)[1]["problems"] == []
    for name in before:
        with pytest.raises(Exception, match="never changed or deleted"):
            owner(old, f"delete from {name}")
    for statement in ROWS_THAT_DO_NOT_FOLLOW.values():
        with pytest.raises(Exception, match="a new one follows the newest"):
            owner(old, statement)
    enter(old, folders[3])
    with old.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), METADATA) == []
    assert ask("register", "verify", "--register", where)[0] == 0
    old.engine.dispose()


def an_empty_database(database, server_or_none, tmp_path):
    if database == "sqlite":
        return str(tmp_path / "empty.sqlite")
    if server_or_none is None:
        pytest.skip(postgres.REASON)
    return server_or_none.new(f"register{next(_NAMES)}")


@pytest.mark.parametrize("database", DATABASES)
def test_a_migration_that_fails_in_the_middle_leaves_the_schema_before(database, server_or_none, tmp_path, ask):
    where = an_empty_database(database, server_or_none, tmp_path)
    register = make_register(where, schema="v1")[0]
    owner(register, "create index impacts_whole on impacts (whole)")
    code, answer = ask("register", "init", "--register", where)
    assert (code, answer["error"]["kind"]) == (2, "register")
    owner(register, "drop index impacts_whole")
    with register.reading() as connection:
        assert not inspect(connection).has_table("contact_points")
    assert ask("register", "init", "--register", where)[1]["schema_before"] == "v1"
    register.engine.dispose()


def test_a_later_schema_is_not_touched(register, where, ask):
    owner(register, "update alembic_version set version_num = 'v99'")
    for command in ("init", "due"):
        code, answer = ask("register", command, "--register", where)
        assert code == 2
        assert "v99" in answer["error"]["message"]


def test_many_make_the_same_register_at_once(tmp_path):
    workers = [PROCESSES.Process(target=make_register, args=(str(tmp_path / "r.sqlite"),)) for _ in range(4)]
    for each in workers:
        each.start()
    for each in workers:
        each.join(60)
    assert [each.exitcode for each in workers] == [0] * 4
    assert whole(open_register(str(tmp_path / "r.sqlite")))


def test_who_makes_a_register_waits_for_who_writes_into_the_new_file(tmp_path):
    file = tmp_path / "r.sqlite"
    other = sqlite3.connect(file, isolation_level=None, check_same_thread=False)
    other.execute("begin immediate")
    begun, writing = time.monotonic(), threading.Timer(0.5, other.execute, ["rollback"])
    writing.start()
    made = make_register(str(file))[0]
    assert time.monotonic() - begun >= 0.5
    writing.join()
    other.close()
    assert whole(made)
    made.engine.dispose()


def test_a_backup_is_restored_whole(register, where, folders, tmp_path, server_or_none):
    """As docs/register.md says, while somebody writes."""
    filled(register, folders)
    noted, before = newest(register), {name: rows(register, name) for name in METADATA.tables}
    if register.postgresql:
        dump, name = tmp_path / "register.dump", database_of(where)
        with register.writing() as connection:
            Action(register, connection, "operator").add(METADATA.tables["cells"], site="a", name="b")
            server = server_or_none
            made = [
                postgres.PROGRAMS / "pg_dump",
                "-h",
                server.home,
                "-U",
                "owner",
                "--format=custom",
                f"--file={dump}",
                name,
            ]
            subprocess.run([str(each) for each in made], check=True)
        again, restored = server.new(f"{name}_again"), postgres.PROGRAMS / "pg_restore"
        arguments = [restored, "-h", server.home, "-U", "owner", f"--dbname={name}_again", dump]
        subprocess.run([str(each) for each in arguments], check=True)
    else:
        again = str(tmp_path / "again.sqlite")
        with register.writing() as connection:
            Action(register, connection, "operator").add(METADATA.tables["cells"], site="a", name="b")
            source, target = sqlite3.connect(where), sqlite3.connect(again)
            source.backup(target)
            source.close()
            target.close()
    with open_register(again) as copied:
        assert {name: rows(copied, name) for name in METADATA.tables} == before
        with copied.reading() as connection:
            assert verify(connection, noted) == ()
        with pytest.raises(Exception, match="never changed or deleted"):
            owner(copied, "delete from audit")


# what else names it


def test_without_the_extra_one_line_says_how_to_install_it(tmp_path):
    (tmp_path / "sqlalchemy.py").write_text("raise ModuleNotFoundError('none', name='sqlalchemy')")
    environment = os.environ | {"PYTHONPATH": f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}"}
    done = subprocess.run(
        [sys.executable, "-m", "forcemap", "register", "due"], capture_output=True, text=True, env=environment
    )
    assert done.returncode == 2
    assert done.stderr == (
        "error: this needs the package sqlalchemy; install it from the project's folder: pip install '.[register]'\n"
    )


def test_pages_show_the_register_and_only_read_it(blank, folders, tmp_path):
    import html5lib

    where = str(shutil.copy(blank, tmp_path / "r.sqlite"))
    with open_register(where) as register:
        enter(register, folders[0])
        enter(register, collected(tmp_path / "bare", 30, 8, site="", cell=""), cell="a b/<i>", new=True)
        change(register, "plant/unknown", {"program": "x"}, new=True)
        add_release(register)
    with client_of(folders[0].parent, register=where) as client:
        for path in ("/register", "/register/cell?cell=plant/cell-1", "/register/cell?cell=a+b/%3Ci%3E"):
            page = client.get(path)
            assert page.status_code == 200, page.text
            html5lib.HTMLParser(strict=True).parse(page.text)
            assert "<i>" not in page.text
        shown = client.get("/register/cell?cell=plant/cell-1").text
        assert "In force until" in shown
        assert "0.100 to 0.200 m/s" in shown
        site = client.get("/api/register").json()
        assert [cell["in_force"] for cell in site["cells"]] == [False, True, False]
        assert client.get("/api/register/cell?cell=none").status_code >= 400
        assert client.get("/register/cell?cell=none").status_code >= 400
        assert client.get("/register", headers=bearer("another")).status_code == 401
        for method in ("POST", "PUT", "DELETE"):
            assert client.request(method, "/register").status_code in (403, 405)
        with open_register(where) as register:
            assert newest(register) == site["head"]["noted"]
            change(register, "plant/cell-1", {"tool": "hook"})
        shown = client.get("/register/cell?cell=plant/cell-1").text
        assert "NOT IN FORCE: tool was gripper when measured" in shown
        assert "0.100" not in shown
    with client_of(folders[0].parent) as client:
        assert client.get("/register").status_code == 404


def test_fleet_enters_what_it_collected_and_a_report_names_the_head(blank, measured, tmp_path, ask):
    where, folder = str(shutil.copy(blank, tmp_path / "r.sqlite")), shutil.copytree(measured, tmp_path / "west")
    command = ["fleet", folder, "-o", tmp_path / "fleet.html", "--area", "chest", "--register", where]
    assert [each["entered"] for each in ask(*command)[1]["campaigns"]] == [True]
    assert [each["entered"] for each in ask(*command)[1]["campaigns"]] == [False]
    with open_register(where) as register:
        assert ask("report", folder, "--area", "chest", "-o", tmp_path / "r.html", "--register", where)[0] == 0
        assert newest(register) in (tmp_path / "r.html").read_text()
    assert ask("report", "--verify", tmp_path / "r.html", folder)[0] == 0
