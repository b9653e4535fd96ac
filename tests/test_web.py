"""The web page against the library, and against whoever means it ill."""

from __future__ import annotations

import csv
import http.client
import json
import os
import re
import select
import shutil
import signal
import socket
import threading
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import quote, urlencode, urlsplit

import httpx
import numpy as np
import pandas as pd
import pytest

import forcemap as fm
from forcemap.campaigns.recordings_table import Use
from forcemap.cli.app import run
from forcemap.files import hidden_file
from forcemap.web.downloads import Format
from forcemap.words import assumptions, sentence
from web_server import PATIENCE, TOKEN, bearer, client_of, contents, serving

PLAIN = {"content-type": "application/octet-stream"}
HAND = {"area": "back_of_hand"}
PLACE = {"distance_m": 0.8, "height_m": 0.4}
PAGES = ["", "/map", "/speeds", "/compare", "/task", "/conditions", "/columns", "/downloads"]


@pytest.fixture(scope="module")
def measured(tmp_path_factory, simulated):
    """A folder of two campaigns: one with recordings, one with an impacts table alone."""
    root = tmp_path_factory.mktemp("served")
    shutil.copytree(simulated, root / "ur10e")
    fm.copy_example("kuka-iiwa7-30nm", root / "kuka")
    return root


@pytest.fixture(scope="module")
def client(measured):
    with client_of(measured) as client:
        yield client


@pytest.fixture
def half_done(measured, tmp_path):
    """A campaign of which the first ten recordings are there, and the bytes of the others by run."""
    folder = tmp_path / "served" / "half"
    shutil.copytree(measured / "ur10e", folder)
    for name in ("recordings.csv", "impacts.csv"):
        (folder / name).unlink()
    later = {}
    for path in sorted((folder / "recordings").iterdir())[10:]:
        later[path.stem] = path.read_bytes()
        path.unlink()
    return folder, later


@pytest.fixture
def upload(half_done):
    """Post a file to a campaign that is half done."""
    with client_of(half_done[0].parent) as client:

        def post(way, content, file, headers=PLAIN, **more):
            address = f"/api/campaigns/half/{way}?{urlencode(HAND | {'file': file} | more)}"
            return client.post(address, content=content, headers=headers)

        post.base = f"http://{client.base_url.netloc.decode()}"
        yield post


def asked(client, path, **query):
    """An answer, for the back of the hand if the question names no body area."""
    answer = client.get(f"/api/campaigns/{path}", params=HAND | query)
    assert answer.status_code == 200, answer.text
    return answer.json()


@pytest.mark.parametrize("page", PAGES)
@pytest.mark.parametrize("name", ["ur10e", "kuka"])
def test_every_page_opens_and_has_a_json_twin(client, name, page):
    found = client.get(f"/campaigns/{name}{page}", params=HAND)
    assert found.status_code == 200
    assert found.headers["content-type"] == "text/html; charset=utf-8"
    twins = re.findall(r'href="(/api/[^"]*)"', found.text.partition('id="twin"')[2])
    assert twins
    for twin in twins:
        assert client.get(twin.replace("&amp;", "&")).headers["content-type"] == "application/json"


def test_the_overview_lists_the_campaigns_and_a_single_one_opens_at_once(client, measured):
    page = client.get("/").text
    assert "/campaigns/ur10e" in page
    assert "/campaigns/kuka" in page
    lines = client.get("/api/campaigns").json()["campaigns"]
    assert [(line["name"], line["simulated"]) for line in lines] == [("kuka", True), ("ur10e", True)]
    with client_of(measured / "kuka") as one:
        assert one.get("/").url.path == "/campaigns/kuka"


@pytest.mark.parametrize("area", ["back_of_hand", "chest", "neck"])
@pytest.mark.parametrize("bound", ["tolerance", "margin"])
@pytest.mark.parametrize("place", [(0.8, 0.4), (0.53, 0.15), (0.89, 0.46), (0.7, 0.9)])
def test_the_speed_is_the_librarys_floored_and_never_alone(client, measured, area, bound, place):
    dataset = fm.read_dataset(measured / "ur10e")
    force_map = fm.fit_force_map(dataset)
    bounds = {"tolerance": fm.ToleranceBound(device_error=3.0), "margin": fm.FixedMargin(0.10)}
    case = {"limit": fm.force_limit(area), "contact": fm.Contact.TRANSIENT, "bound": bounds[bound]}
    expected = fm.safe_speed(force_map, *place, **case)
    query = {"area": area, "bound": bound, "distance_m": place[0], "height_m": place[1]}
    answer = asked(client, "ur10e/speed", **query)
    assert answer["outcome"] == expected.outcome
    assert answer["speed_mps"] == (None if expected.speed != expected.speed else expected.speed)
    assert answer["limit_N"] == expected.limit
    assert answer["assumptions"] == assumptions([expected.basis])
    page = client.get("/campaigns/ur10e/speeds", params=query).text
    shown = re.findall(r'id="speed">([\d.]+)<', page)
    assert shown == ([fm.floor_speed(expected.speed)] if answer["speed_mps"] is not None else [])
    program = re.findall(r'id="program">([\d.]+)<', page)
    assert program == (
        [fm.floor_speed(expected.speed_to_program)] if answer["speed_to_program_mps"] is not None else []
    )
    assert f"{answer['to_program_outcome']}</span>" in page
    for statement in ("SIMULATED", "person at rest", "pressure not assessed", "bound:"):
        assert statement in page


def test_speeds_of_many_places_are_never_rounded_up(client, measured):
    force_map = fm.fit_force_map(fm.read_dataset(measured / "ur10e"))
    case = {"limit": fm.force_limit("chest"), "contact": fm.Contact.TRANSIENT}
    answer = asked(client, "ur10e/speeds", area="chest", places=400)
    at = np.meshgrid(answer["distance_m"], answer["height_m"], indexing="ij")
    expected = fm.safe_speed(force_map, *at, bound=fm.ToleranceBound(device_error=3.0), **case).speed
    found = np.array(answer["speed_mps"], dtype=float)
    assert (np.isnan(found) == np.isnan(expected)).all()
    assert (found[~np.isnan(found)] <= expected[~np.isnan(found)]).all()


def test_many_places_say_what_one_place_says(client):
    many = asked(client, "ur10e/speeds", area="chest", places=25)
    programmed = Counter(many["outcomes"][at] for at in np.ravel(many["to_program_outcome"]))
    assert +Counter(many["counts"]) == programmed
    for i, distance in enumerate(many["distance_m"]):
        for j, height in enumerate(many["height_m"]):
            one = asked(client, "ur10e/speed", area="chest", distance_m=distance, height_m=height)
            assert many["outcomes"][many["outcome"][i][j]] == one["outcome"]
            assert many["reasons"][many["reason"][i][j]] == one["reason"]
            assert many["outcomes"][many["to_program_outcome"][i][j]] == one["to_program_outcome"]
            assert many["reasons"][many["to_program_reason"][i][j]] == one["to_program_reason"]
            if one["speed_mps"] is not None:
                assert one["speed_mps"] - 1.1e-6 <= many["speed_mps"][i][j] <= one["speed_mps"]


def test_contact_with_the_head_is_refused_with_the_reason(client):
    answer = asked(client, "ur10e/speed", area="face", **PLACE)
    assert (answer["outcome"], answer["speed_mps"], answer["limit_N"]) == ("not_permitted", None, None)
    assert "is not permitted" in answer["reason"]
    for page in ("speeds", "map", "task"):
        text = client.get(f"/campaigns/ur10e/{page}", params={"area": "face"}).text
        assert 'id="speed"' not in text
        assert "is not permitted" in text
    assert set(asked(client, "ur10e/speeds", area="face")["counts"].values()) == {0, 2500}
    refused = client.get("/api/campaigns/ur10e/files/speeds", params={"area": "face"})
    assert (refused.status_code, refused.json()["error"]["kind"]) == (422, "not_permitted")


def test_bounds_are_never_rounded_down(client, measured):
    force_map = fm.fit_force_map(fm.read_dataset(measured / "ur10e"))
    bound = fm.ToleranceBound(device_error=3.0)
    answer = asked(client, "ur10e/slices", **PLACE, speed_mps=0.3)
    for line, at in (("along_distance", lambda d: (d, 0.4, 0.3)), ("along_speed", lambda v: (0.8, 0.4, v))):
        known = [(at(x), upper) for x, upper in zip(answer[line]["at"], answer[line]["bound_N"], strict=True) if upper]
        assert known
        assert all(bound.upper(force_map, *state) <= upper + 1e-6 for state, upper in known)
    places = answer["place_bound_N"]
    assert (len(places), {len(column) for column in places}) == (100, {100})
    rows = [(i, j) for i in range(len(places)) for j in range(len(places[0])) if places[i][j] is not None]
    for i, j in rows[::20]:
        assert bound.upper(force_map, answer["distance_m"][i], answer["height_m"][j], 0.3) <= places[i][j]
    shown = client.get("/campaigns/ur10e/map", params=HAND | PLACE | {"speed_mps": 0.3}).text
    assert float(re.search(r'id="bound">([\d.]+)<', shown)[1]) >= answer["bound_N"]


def test_slices_and_workspace_are_the_map(client, measured):
    force_map = fm.fit_force_map(fm.read_dataset(measured / "ur10e"))
    answer = asked(client, "ur10e/slices", **PLACE, speed_mps=0.3)
    assert answer["predicted_N"] == pytest.approx(force_map.predict(0.8, 0.4, 0.3))
    line = answer["along_speed"]
    assert line["predicted_N"] == pytest.approx([force_map.predict(0.8, 0.4, v) for v in line["at"]], abs=0.01)
    outside = asked(client, "ur10e/slices", distance_m=1.2, height_m=0.4, speed_mps=0.3)
    assert (outside["measured"], outside["predicted_N"], outside["bound_N"]) == (False, None, None)
    cube = asked(client, "ur10e/workspace")
    at = [cube[name][7] for name in ("distance_m", "height_m", "speed_mps")]
    n = len(cube["speed_mps"])
    assert cube["force_N"][7 * n * n + 7 * n + 7] == pytest.approx(force_map.predict(*at), rel=1e-3)


def test_a_task_is_the_librarys(client, measured):
    dataset = fm.read_dataset(measured / "ur10e")
    force_map = fm.fit_force_map(dataset)
    path = fm.ToolPath.through([(0.8, 0.0, 0.44), (0.8, 0.0, 0.2)])
    task = fm.Task((fm.TaskSegment("path", ("back_of_hand",), fm.Contact.TRANSIENT, 0.5),), 1.0)
    expected = fm.path_speeds(force_map, path, task, bound=fm.ToleranceBound(device_error=3.0))
    answer = asked(client, "ur10e/task", points="0.8,0.44;0.8,0.2", programmed_mps=0.5)["path"]
    assert [piece["speed_mps"] for piece in answer["pieces"]] == pytest.approx(expected.speed.tolist())
    assert answer["cycle_times"][0]["cycle_time_s"] == pytest.approx(expected.allowed.duration)
    assert answer["too_fast_length_m"] == pytest.approx(0.24)
    away = asked(client, "ur10e/task", points="0.8,0.44;0.8,-0.3")["path"]
    assert not away["permitted"]
    assert "outside" in {piece["outcome"] for piece in away["pieces"]}
    assert away["cycle_times"][0]["cycle_time_s"] is None
    point = asked(client, "ur10e/task", points="1.9,0.44")
    assert (point["path"], point["points"][0]["outcome"]) == (None, "outside")


def test_a_task_of_one_point_has_the_allowances(client, measured):
    force_map = fm.fit_force_map(fm.read_dataset(measured / "ur10e"))
    case = {"limit": fm.force_limit("chest"), "contact": fm.Contact.TRANSIENT}
    case["bound"] = fm.ToleranceBound(device_error=3.0)
    query = {"points": "0.8,0.4", "area": "chest", "overshoot_mps": 0.05, "position_tolerance_m": 0.02}
    zone = fm.Zones(0.8, 0.8, 0.4, 0.4).grown(0.02)
    expected = float(fm.zone_speeds(force_map, zone, **case).speed[0]) - 0.05
    answer = asked(client, "ur10e/task", **query, programmed_mps=round(expected + 0.001, 3))
    assert answer["point"]["speed_mps"] == pytest.approx(expected, abs=1e-12)
    assert answer["point"]["speed_mps"] < answer["points"][0]["speed_mps"] - 0.05
    assert answer["point"]["too_fast"]
    assert any("less 0.05 m/s, the overshoot assumed" in line for line in answer["assumptions"])
    assert not asked(client, "ur10e/task", **query, programmed_mps=0.05)["point"]["too_fast"]
    page = client.get("/campaigns/ur10e/task", params=query | {"programmed_mps": 0.5}).text
    assert f'id="speed">{fm.floor_speed(expected)}<' in page
    assert "too fast" in page
    edge = f"{force_map.measured_range.highest[0]},0.3"
    assert asked(client, "ur10e/task", points=edge)["point"]["outcome"] == "outside"
    face = asked(client, "ur10e/task", points="0.8,0.4", area="face")
    assert face["point"]["outcome"] == "not_permitted"
    assert any(line.startswith("SIMULATED") for line in face["assumptions"])
    spent = asked(client, "ur10e/task", points="0.8,0.4", overshoot_mps=1)["point"]
    assert (spent["outcome"], spent["speed_mps"]) == ("unconfirmed", None)
    whole = asked(client, "ur10e/task", points="0.8,0.4", overshoot_mps=0, position_tolerance_m=0)
    assert whole["point"]["speed_mps"] == pytest.approx(whole["points"][0]["speed_mps"], abs=1e-3)


def test_reasons_of_permitted_pieces_are_shown(client):
    answer = asked(client, "ur10e/task", points="0.8,0.44;0.8,0.2")["path"]
    reasons = {f"{piece['outcome']}: {piece['reason']}" for piece in answer["pieces"]}
    assert answer["permitted"]
    assert reasons
    page = client.get("/campaigns/ur10e/task?area=back_of_hand&points=0.8,0.44;0.8,0.2").text
    verdict = page.partition('id="verdict"')[2].partition('id="facts"')[0]
    assert all(reason in verdict for reason in reasons)


def test_the_comparison_is_the_librarys(client, measured):
    answer = asked(client, "ur10e/compare")
    expected = fm.compare_force_models(
        fm.read_dataset(measured / "ur10e"),
        robot_mass=fm.pfl_robot_mass(30.0),
        body_mass=float("inf"),
        stiffness=fm.body_region("back_of_hand").stiffness,
        limit=fm.force_limit("back_of_hand"),
    )
    found = [model["accuracy"]["max_underestimation_percent"] for model in answer["models"]]
    assert found == [model.accuracy.max_underestimation_percent for model in expected.models]
    page = client.get("/campaigns/ur10e/compare", params=HAND).text
    for model in expected.models:
        for row, of in (("<", model.accuracy), (", all states<", model.on_all)):
            line = page.partition(f'<th scope="row">{model.model}{row}')[2].partition("</tr>")[0]
            assert f'"n">{of.max_underestimation_percent:.1f} %<' in line
    assert [each["limit_source"] for each in answer["allowed"]] == [each.limit_source for each in expected.allowed]
    assert client.get("/campaigns/ur10e/compare.svg", params=HAND).text.startswith("<svg")


def test_what_is_taken_away_is_what_the_library_writes(client, measured, tmp_path):
    files = "/api/campaigns/ur10e/files"
    (tmp_path / "map.json").write_bytes(client.get(f"{files}/map.json").content)
    force_map = fm.fit_force_map(fm.read_dataset(measured / "ur10e"))
    assert fm.map_sha256(fm.read_map(tmp_path / "map.json")) == fm.map_sha256(force_map)
    report = client.get(f"{files}/report.html?area=chest")
    assert "attachment" in report.headers["content-disposition"]
    assert "SIMULATED" in report.text
    assert "Chest" in report.text or "chest" in report.text
    for form in Format:
        text = client.get(f"{files}/speeds", params=HAND | {"format": form}).text
        assert "SIMULATED" in text.upper()
    assert "factor" in client.get(f"{files}/scaling.csv?area=palm&points=0.8,0.44;0.8,0.2&programmed_mps=0.3").text


@pytest.mark.parametrize("form", Format)
def test_no_file_of_zeros_is_taken_away(client, form):
    """A robot that clamps has no transient speed, and no program that says so with zeros."""
    asked = {"area": "back_of_hand", "contact": "transient", "format": form}
    answer = client.get("/api/campaigns/kuka/files/speeds", params=asked)
    assert (answer.status_code, answer.json()["error"]["kind"]) == (409, "not_releasable")


def test_a_dropped_recording_is_judged_and_nothing_is_stored(upload, half_done):
    folder, later = half_done
    before = contents(folder.parent)
    name, content = next(iter(later.items()))
    answer = upload("judge", content, f"{name}.csv", area="chest").json()
    device = fm.read_campaign(folder).conditions.device
    (expected,) = fm.find_impacts(fm.read_recording(write(folder.parent.parent / "run.csv", content), device=device))
    (impact,) = answer["impacts"]
    assert impact["peak_force_N"] == expected.peak_force
    assert impact["scenario"] == expected.scenario
    verdict = fm.check_impact(expected, fm.force_limit("chest"))
    assert impact["outcome"] == answer["outcome"] == verdict.outcome
    assert contents(folder.parent) == before
    assert upload("judge", content, f"{name}.csv", area="face").json()["outcome"] == "not_permitted"


def test_judging_says_what_it_leaves_open(upload, half_done):
    folder, later = half_done
    name, content = next(iter(later.items()))
    assert upload("judge", content, f"{name}.csv").json()["notes"] == ["pressure is not assessed"]
    stated = (folder / "campaign.toml").read_text()
    (folder / "campaign.toml").write_text(re.sub(r"(?m)^range_N = .*$", "", stated))
    notes = upload("judge", content, f"{name}.csv").json()["notes"]
    unstated = "device range not stated: saturation was judged by the shape of the curves alone"
    assert notes == [unstated, "pressure is not assessed"]
    address = f"{upload.base}/campaigns/half/judge?area=chest&file={name}.csv"
    headers = PLAIN | bearer(TOKEN)
    page = httpx.post(address, content=content, headers=headers, timeout=PATIENCE, trust_env=False).text
    assert all(note in page for note in notes)


def test_a_table_given_to_the_server_is_read_as_its_file_is_now(measured, tmp_path):
    own, standard = tmp_path / "own.csv", Path(fm.__file__).parent / "limits" / "tables" / "body_areas.csv"
    shutil.copy(standard, own)
    with client_of(measured, limit_table=str(own)) as client:
        before = asked(client, "ur10e/speed", area="back_of_hand", **PLACE)
        own.write_text(re.sub(r"(?m)^(back_of_hand_.*),140,2$", r"\g<1>,100,2", own.read_text()))
        after = asked(client, "ur10e/speed", area="back_of_hand", **PLACE)
        assert (before["limit_N"], after["limit_N"]) == (280, 200)
        assert after["speed_mps"] < before["speed_mps"]
        own.unlink()
        refused = client.get("/api/campaigns/ur10e/speed", params={"area": "back_of_hand"} | PLACE)
        assert (refused.status_code, "own.csv" in refused.text) == (422, True)


def test_the_limit_table_of_the_campaign_is_used_or_named(measured, tmp_path):
    folder = tmp_path / "served" / "ur10e"
    shutil.copytree(measured / "ur10e", folder)
    own = (Path(fm.__file__).parent / "limits" / "tables" / "body_areas.csv").read_text()
    own = own.replace("edition: ISO/TS 15066:2016", "edition: of the house").replace("back_of_hand", "palm_of_hand")
    stated = (folder / "campaign.toml").read_text()
    with client_of(folder.parent) as client:

        def named(table):
            text = re.sub(r"(?m)^limit_table = .*\n", "", stated)
            text = text.replace("[standard]", f'[standard]\nlimit_table = "{table}"', 1)
            if "[standard]" not in text:
                text += f'\n[standard]\nlimit_table = "{table}"\n'
            (folder / "campaign.toml").write_text(text)

        def said(*ways):
            recording = next((folder / "recordings").iterdir()).read_bytes()
            judge = "/api/campaigns/ur10e/judge?file=r.csv&area=chest"
            files, path = "/api/campaigns/ur10e/files", {"points": "0.8,0.44;0.8,0.2", "programmed_mps": 0.3}
            return [
                json.dumps(asked(client, "ur10e/speed", area="chest", **PLACE)),
                *(json.dumps(asked(client, f"ur10e/{way}", area="chest")) for way in ways),
                json.dumps(asked(client, "ur10e/task", area="chest", points="0.8,0.4")),
                client.post(judge, content=recording, headers=PLAIN).text,
                client.get(f"{files}/scaling.csv", params=path | {"area": "chest"}).text,
                *(client.get(f"/campaigns/ur10e/{page}?area=chest").text for page in ("speeds", "map", "task")),
            ]

        named("house rules")
        unused = "campaign.toml names the limit table house rules, which is not used here: start with --limit-table"
        assert all(unused in text for text in said("speeds", "workspace", "compare"))
        named("../own.csv")
        for way in ("speed", "speeds", "workspace", "compare"):  # the standard's limits could be higher
            refused = client.get(
                f"/api/campaigns/ur10e/{way}", params={"area": "chest"} | (PLACE if way == "speed" else {})
            )
            assert (refused.status_code, "which is no file of this folder" in refused.text) == (422, True), way
        write(folder / "own.csv", own.encode())
        named("own.csv")
        assert all("of the house" in text and "not used here" not in text for text in said("speeds"))
        for page in PAGES:  # the usual area is not in this table
            assert client.get(f"/campaigns/ur10e{page}").status_code == 200
        write(folder / "own.csv", b"area,name\nx,y\n")
        refused = client.get("/api/campaigns/ur10e/speeds", params={"area": "chest"})
        assert (refused.status_code, "the table cannot be used" in refused.text) == (422, True)
        for page in PAGES:
            shown = client.get(f"/campaigns/ur10e{page}?area=chest")
            assert "m/s to program" not in shown.text
        assert client.get("/campaigns/ur10e/conditions").status_code == 200  # where it is mended


def test_a_dropped_table_is_held_against_the_map(client, measured, tmp_path):
    own = (measured / "ur10e" / "impacts.csv").read_bytes()
    answer = client.post("/api/campaigns/ur10e/judge?file=table.csv", content=own, headers=PLAIN).json()
    assert (answer["kind"], answer["states"], answer["against_campaign"]) == ("table", 27, "cannot tell")
    assert "that the map was fitted to" in answer["against_reason"]
    assert "CFM_3D" in answer["map"]
    assert client.post("/api/campaigns/ur10e/recordings?file=t.csv", content=own, headers=PLAIN).status_code == 422
    harder = pd.read_csv(measured / "ur10e" / "impacts.csv", comment="#")
    harder["peak_force_N"] *= 1.3
    harder = harder[(harder["role"] == "test") & (harder["peak_force_N"] < 480)]
    shutil.copy(measured / "ur10e" / "campaign.toml", tmp_path)
    harder.to_csv(tmp_path / "table.csv", index=False)
    content = (tmp_path / "table.csv").read_bytes()
    answer = client.post("/api/campaigns/ur10e/judge?file=table.csv", content=content, headers=PLAIN).json()
    force_map = fm.fit_force_map(fm.read_dataset(measured / "ur10e"))
    expected = fm.check_map(force_map, fm.read_dataset(tmp_path / "table.csv"))
    assert expected.outcome is not fm.MapOutcome.HOLDS
    assert answer["against_campaign"] == expected.outcome.replace("_", " ")
    assert sentence(expected.reason) in answer["against_reason"]


def test_a_recording_is_added_as_a_run_of_the_plan(upload, half_done):
    folder, later = half_done
    names = list(later)
    stored = upload("recordings", later[names[0]], f"{names[0]}.csv").json()
    assert (stored["stored_as"], stored["use"]) == (f"{names[0]}.csv", "used")
    stored = upload("recordings", later[names[1]], "measurement 17.CSV", run=names[1]).json()
    assert (stored["stored_as"], stored["use"]) == (f"{names[1]}.csv", "used")
    for name in names[:2]:
        assert (folder / "recordings" / f"{name}.csv").read_bytes() == later[name]
    campaign = fm.read_campaign(folder)
    assert {Path(entry.file).stem for entry in campaign.entries if entry.use is Use.USED} >= set(names[:2])
    unnamed = upload("recordings", later[names[2]], "measurement 18.csv").json()
    assert unnamed["stored_as"].startswith("upload-")
    assert unnamed["use"] != "used"


def test_nothing_is_replaced_and_nothing_is_counted_twice(upload, half_done):
    folder, later = half_done
    one, other = list(later)[:2]
    assert upload("recordings", later[one], f"{one}.csv").status_code == 200
    before = contents(folder)
    for name, run_, kind in ((one, None, "duplicate"), ("again", other, "duplicate")):
        answer = upload("recordings", later[one], f"{name}.csv", **({"run": run_} if run_ else {}))
        assert (answer.status_code, answer.json()["error"]["kind"]) == (409, kind)
    answer = upload("recordings", later[other], f"{one}.csv")
    assert (answer.status_code, answer.json()["error"]["kind"]) == (409, "run_taken")
    assert upload("recordings", later[other], "x.csv", run="no such run").status_code == 422
    assert contents(folder) == before


@pytest.mark.parametrize("name", ["../../evil.csv", "/etc/evil.csv", "..\\..\\evil.csv", "a/../../../evil.csv", ".csv"])
def test_names_are_no_paths(upload, half_done, name):
    folder, later = half_done
    above = folder.parent.parent
    before = contents(above)
    answer = upload("recordings", later[next(iter(later))], name)
    new = {path for path in contents(above) if path not in before}
    allowed = {f"served/half/{file}" for file in ("recordings.csv", "impacts.csv")}
    if answer.status_code == 200:
        allowed.add(f"served/half/recordings/{answer.json()['stored_as']}")
        assert re.fullmatch(r"upload-[0-9a-f]{12}\.csv", answer.json()["stored_as"])
    assert {path.as_posix() for path in new} <= allowed
    assert upload("recordings", b"x", "run.csv", run=name).status_code == 422


@pytest.mark.parametrize(
    "name", ["..", "../ur10e", "%2e%2e", "..%2f..%2fetc", "/etc", "ur10e/../kuka", "ur10e%00", "."]
)
def test_only_campaigns_have_names(client, name):
    for address in (
        f"/api/campaigns/{quote(name, safe='')}",
        f"/api/campaigns/{name}/map",
        f"/campaigns/{name}/map",
        f"/static/{name}/app.py",
        f"/static/{quote(f'{name}/app.py', safe='')}",
    ):
        connection = http.client.HTTPConnection(client.base_url.netloc.decode())  # sends an address as it is
        connection.request("GET", address, headers=bearer(TOKEN))
        assert connection.getresponse().status == 404, address
        connection.close()


def test_uploads_are_limited_in_size_type_and_form(upload, half_done):
    before = contents(half_done[0])

    def chunks():
        for _ in range(21):
            yield b"1,2\n" * 250_000

    for way in ("judge", "recordings"):
        for content in (b"0" * 20_000_001, chunks()):
            answer = upload(way, content, "large.csv")
            assert (answer.status_code, answer.json()["error"]["kind"]) == (413, "too_large")
            assert "20 MB" in answer.json()["error"]["message"]
        assert upload(way, b"<html>", "page.html").status_code == 415
        for ending in ("csv", "CSV", "txt", "tsv", "dat", "asc", "log", "lvm", "tdms"):
            assert upload(way, b"", f"run.{ending}").status_code != 415
        assert upload(way, b"MZ", "program.exe").status_code == 415
        assert upload(way, b"x", "run.csv", headers={"content-type": "text/plain"}).status_code == 415
        assert upload(way, b"", "run.csv").status_code == 422
        for content in (b"\x00\x01\x02" * 100, b"time_ms,force_N\n1,2\n", b"a,b\n1,x\n", b"\xff" * 50):
            answer = upload(way, content, "run.csv")
            assert answer.status_code == 422
            assert "\n" not in answer.json()["error"]["message"]
            assert ".forcemap" not in answer.text
    assert contents(half_done[0]) == before


def test_text_of_files_is_text(measured, tmp_path):
    evil = "<script>alert(1)</script>"
    folder = tmp_path / "served" / "<b>bold<b>"
    shutil.copytree(measured / "kuka", folder)
    table = (folder / "impacts.csv").read_text()
    (folder / "campaign.toml").write_text(
        (folder / "campaign.toml").read_text().replace('model = "KUKA', f'model = "{evil}KUKA')
    )
    (folder / "impacts.csv").write_text(table)
    with client_of(tmp_path / "served") as client:
        name = quote(folder.name, safe="")
        pages = [client.get("/"), *(client.get(f"/campaigns/{name}{page}") for page in PAGES)]
        pages += [client.get(f"/campaigns/{name}/speeds?area={quote(evil)}"), client.get(f"/campaigns/{quote(evil)}")]
        judged = client.post(f"/campaigns/{name}/judge?file={quote(evil)}.csv", content=b"1", headers=PLAIN)
        for page in (*pages, judged):
            assert evil not in page.text
            assert "<b>bold" not in page.text
        assert "&lt;script&gt;" in pages[0].text
        assert all(page.status_code == 200 for page in pages[:-2])


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "localhost.evil", "0.0.0.0", ""])
def test_other_host_names_are_refused(client, host):
    answer = client.get("/api/campaigns", headers={"host": host})
    assert (answer.status_code, answer.json()["error"]["kind"]) == (421, "host")


def test_other_sites_cannot_act(upload, half_done):
    folder, later = half_done
    before = contents(folder)
    for headers in (
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://127.0.0.1:9999"},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "same-site"},
    ):
        answer = upload("recordings", later[next(iter(later))], "run.csv", headers=PLAIN | headers)
        assert (answer.status_code, answer.json()["error"]["kind"]) == (403, "origin")
    assert contents(folder) == before
    host, origin = upload.base.removeprefix("http://"), "http://evil.example"
    connection = http.client.HTTPConnection(host)
    connection.putrequest("POST", "/api/campaigns/half/recordings?file=run.csv")
    sent = (("origin", upload.base), ("origin", origin), *(PLAIN | bearer(TOKEN)).items(), ("content-length", "0"))
    for header in sent:
        connection.putheader(*header)
    connection.endheaders()
    assert connection.getresponse().status == 403
    connection.close()
    own = PLAIN | {"origin": upload.base, "sec-fetch-site": "same-origin"}
    assert upload("recordings", later[next(iter(later))], "run.csv", headers=own).status_code == 200


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_other_sites_cannot_ask_but_may_link(client, site):
    """A page of another site must not make this server work; a link to a page is a person's own visit."""
    link = {"sec-fetch-site": site, "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}
    image = {"sec-fetch-site": site, "sec-fetch-mode": "no-cors", "sec-fetch-dest": "image"}
    frame = {"sec-fetch-site": site, "sec-fetch-mode": "navigate", "sec-fetch-dest": "iframe"}
    for path in ("/", "/campaigns/ur10e/speeds"):
        assert client.get(path, headers=link).status_code == 200
        assert client.get(path, headers=image).status_code == client.get(path, headers=frame).status_code == 403
    speed = "/api/campaigns/ur10e/speed?area=palm&distance_m=0.8&height_m=0.4"
    for path in ("/api/campaigns", speed, "/static/page.css"):
        for headers in (link, image, frame, {"origin": "http://evil.example"}):
            answer = client.get(path, headers=headers)
            assert (answer.status_code, answer.json()["error"]["kind"]) == (403, "origin")
        assert client.get(path, headers=image | {"sec-fetch-site": "same-origin"}).status_code == 200


def test_light_answers_do_not_wait_behind_heavy_ones(measured):
    """The heavy ones are asked first, all of them: the order of answers counts, not when they come."""
    points = ";".join(f"0.8,{0.44 if i % 2 else 0.2}" for i in range(50))
    with serving(measured) as (_, address, token), ExitStack() as stack:
        host = urlsplit(address)

        def ask(way, **query):
            connection = stack.enter_context(socket.create_connection((host.hostname, host.port), timeout=PATIENCE))
            head = f"GET /api/campaigns/ur10e/{way}?{urlencode(HAND | query)} HTTP/1.1\r\nhost: {host.netloc}\r\n"
            connection.sendall(f"{head}authorization: Bearer {token}\r\n\r\n".encode())
            return connection

        def status(connection):
            return int(connection.recv(1000).split()[1])

        assert status(ask("speed", **PLACE)) == 200  # the map is fitted
        heavy = [ask("task", points=points) for _ in range(45)]
        assert status(ask("speed", **PLACE)) == 200
        answered = select.select(heavy, [], [], 0)[0]
        assert len(answered) <= 10
        assert {status(each) for each in heavy[:2]} == {200}


def test_long_paths_are_refused(client):
    far = ";".join(f"0.8,{0.44 if i % 2 else -9}" for i in range(10))
    for path in ("/api/campaigns/ur10e/task", "/campaigns/ur10e/task", "/api/campaigns/ur10e/files/scaling.csv"):
        answer = client.get(path, params=HAND | {"points": far, "programmed_mps": 0.3})
        assert answer.status_code == 422
        assert "found a path of 85.0 m, expected at most 20 m" in answer.text


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="there is no /proc to read memory from")
def test_large_files_do_not_fill_the_memory(half_done):
    folder, later = half_done
    text = next(iter(later.values())).decode()
    head = text[: text.index("force_N\n") + 8]
    content = (head + "".join(f"{i},{2 + i % 3}\n" for i in range(900_000))).encode()
    with serving(folder.parent) as (process, address, token), ThreadPoolExecutor(5) as crowd:

        def memory(key):
            return int(re.search(rf"{key}:\s+(\d+) kB", Path(f"/proc/{process.pid}/status").read_text())[1]) / 1000

        send = f"{address}/api/campaigns/half/judge?file=large.csv&area=chest"
        as_ours = {"headers": PLAIN | bearer(token), "timeout": PATIENCE, "trust_env": False}
        small = next(iter(later.values()))  # what is loaded for the first file does not count
        assert httpx.post(send, content=small, **as_ours).status_code == 200
        before = memory("VmRSS")
        assert httpx.post(send, content=content, **as_ours).status_code == 200
        one = memory("VmHWM") - before
        assert one < 70
        crowd_asks = [crowd.submit(httpx.post, send, content=content, **as_ours) for _ in range(5)]
        assert {each.result().status_code for each in crowd_asks} == {200}
        assert memory("VmHWM") - before < 4.5 * one  # two are judged together, others arrive; five would be 5.2 to 5.7
    table = b"distance_m,height_m,speed_mps,peak_force_N\n" + b"0.5,0.5,0.5,100\n" * 200_000
    with client_of(folder) as client:
        answer = client.post("/api/campaigns/half/judge?file=table.csv", content=table, headers=PLAIN)
    assert (answer.status_code, answer.json()["error"]["kind"]) == (413, "too_large")


def test_a_map_is_of_the_files_whose_hash_it_has(measured, tmp_path, full_size):
    """A file that is replaced between its hash and its reading is not taken for the other."""
    folder = tmp_path / "served" / "kuka"
    shutil.copytree(measured / "kuka", folder)
    one = pd.read_csv(folder / "impacts.csv", comment="#")
    tables = []
    for _ in range(6 if full_size else 3):
        one["peak_force_N"] *= 0.99
        tables.append(one.to_csv(index=False).encode())
    expected = []
    for table in tables:
        write(folder / "impacts.csv", table)
        expected.append(fm.map_sha256(fm.fit_force_map(fm.read_dataset(folder))))
    stop = threading.Event()

    def replace():
        while not stop.is_set():
            for table in tables:
                os.replace(write(folder / "next.csv", table), folder / "impacts.csv")

    changing = threading.Thread(target=replace)
    with client_of(folder.parent) as client:
        changing.start()
        try:
            answers = [client.get("/api/campaigns/kuka/map") for _ in range(12 if full_size else 6)]
        finally:
            stop.set()
            changing.join()
        assert {answer.status_code for answer in answers} <= {200, 409}
        for table, sha256 in zip(tables, expected, strict=True):
            write(folder / "impacts.csv", table)
            assert asked(client, "kuka/map")["map_sha256"] == sha256


def test_what_is_no_file_is_not_waited_for(measured, tmp_path):
    files = ["impacts.csv", "plan.csv", "campaign.toml", "recordings.csv"]
    odd = [(os.mkdir, name) for name in files]
    if hasattr(os, "mkfifo"):
        odd += [(os.mkfifo, name) for name in (*files, "recordings/a.csv", "recordings/below/a.csv")]
    for i, (make, name) in enumerate(odd):
        folder = tmp_path / f"odd-{i}"
        shutil.copytree(measured / "kuka", folder)
        (folder / name).unlink(missing_ok=True)
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        make(folder / name)
    with client_of(tmp_path) as client:
        campaigns = client.get("/api/campaigns").json()["campaigns"]
        assert len(campaigns) == len(odd)
        for campaign in campaigns:
            assert "not a file" in campaign["problem"]
            for page in ("/api/campaigns/{}", "/api/campaigns/{}/map", "/campaigns/{}/downloads"):
                answer = client.get(page.format(campaign["name"]))
                assert answer.status_code == 409
                assert "not a file" in answer.text


def test_leftovers_of_a_killed_server_are_swept(measured, tmp_path):
    """Whatever time they bear; not what a process still writes, nor what is no file."""
    folder = tmp_path / "served" / "kuka"
    shutil.copytree(measured / "kuka", folder)
    for name, time in (("old", 0), ("ahead", 4e9)):
        os.utime(write(folder / f".forcemap-part-{name}.csv", b"1"), (time, time))
    (folder / ".forcemap-part-folder").mkdir()
    with hidden_file(folder, ".csv") as (written, _), client_of(folder.parent) as client:
        assert client.get("/api/campaigns/kuka").status_code == 200
        assert {path.name for path in folder.glob(".*")} == {".forcemap-part-folder", written.name}


@pytest.mark.parametrize("query", ["heigth_m=0.2", "utm_source=x"])
@pytest.mark.parametrize("page", PAGES)
def test_unknown_parameters_are_refused(client, page, query):
    assert client.get(f"/campaigns/ur10e{page}?{query}").status_code == 422
    assert client.get(f"/campaigns/ur10e{page}?area=chest&contact=transient&distance_m=0.8").status_code == 200


@pytest.mark.parametrize("value", ["0_8", "1_0e-1", "%D9%A0.8", "%200.8", "0.8%0a", "nan", "0x1"])
def test_numbers_are_written_plainly(client, value):
    for address in ("/campaigns/ur10e/speeds?", "/api/campaigns/ur10e/speed?area=chest&height_m=0.4&"):
        assert client.get(f"{address}distance_m={value}").status_code == 422
        assert client.get(f"{address}distance_m=8e-1").status_code == 200
    assert client.get(f"/api/campaigns/ur10e/task?points={value},0.4").status_code == 422


def test_campaigns_of_one_name_are_refused(measured, tmp_path):
    for name in (b"lab-\xfe", b"lab-\xff", b"lab"):
        try:
            shutil.copytree(measured / "kuka", os.fsdecode(os.path.join(os.fsencode(tmp_path), name)))
        except OSError:
            pytest.skip("names of files must be text here")
    with client_of(tmp_path) as client:
        lines = client.get("/api/campaigns").json()["campaigns"]
        assert [line["name"] for line in lines] == ["lab", "lab-\ufffd"]
        assert "2 folders" in lines[1]["problem"]
        answer = client.get(f"/api/campaigns/{quote(lines[1]['name'])}/map")
        assert (answer.status_code, answer.json()["error"]["kind"]) == (409, "ambiguous")
        assert client.get("/api/campaigns/lab/map").status_code == 200


@pytest.mark.parametrize("path", ["/", "/campaigns/ur10e/map", "/api/campaigns", "/no such page", "/static/page.css"])
def test_every_answer_trusts_nobody(client, path):
    headers = client.get(path).headers
    policy = dict(part.partition(" ")[::2] for part in headers["content-security-policy"].split("; "))
    assert policy["default-src"] == policy["frame-ancestors"] == policy["base-uri"] == "'none'"
    assert policy["script-src"] == policy["connect-src"] == "'self'"
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["cache-control"] == "no-store"
    assert "access-control-allow-origin" not in headers


def test_nothing_is_fetched_from_elsewhere(client):
    root = Path(fm.__file__).parent / "web"
    for path in (*root.glob("static/*"), *root.glob("templates/*")):
        text = path.read_text().replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://|//[a-z]+\.", text), path
        assert not re.search(r"\bon[a-z]+=|<script>|javascript:|eval\(|innerHTML =[^=]", text), path
    assert client.get("/docs").status_code == client.get("/redoc").status_code == 404


def test_links_that_lead_out_are_not_followed(measured, tmp_path):
    root = tmp_path / "served"
    shutil.copytree(measured / "ur10e", root / "inside")
    secret = write(tmp_path / "secret.csv", b"secret,1\n")
    outside = tmp_path / "outside"
    shutil.copytree(measured / "kuka", outside)
    (root / "linked").symlink_to(outside, target_is_directory=True)
    with client_of(root) as client:
        assert client.get("/api/campaigns/linked").status_code == 404
        before = contents(tmp_path / "outside")
        for name in ("recordings/evil.csv", "impacts.csv", "campaign.toml", "recordings.csv"):
            path = root / "inside" / name
            kept = path.read_bytes() if path.exists() else None
            path.unlink(missing_ok=True)
            path.symlink_to(secret)
            for address in ("", "/map", "/files/report.html"):
                answer = client.get(f"/api/campaigns/inside{address}")
                assert answer.status_code == 409, (name, address)
                assert "secret,1" not in answer.text
            assert client.post("/api/campaigns/inside/collect").status_code == 409
            path.unlink()
            if kept is not None:
                path.write_bytes(kept)
        assert client.get("/api/campaigns/inside").status_code == 200
    assert secret.read_bytes() == b"secret,1\n"
    assert contents(outside) == before


def test_errors_are_told_in_a_line_and_as_a_page(client, measured, tmp_path):
    assert client.get("/api/nothing").json()["error"]["kind"] == "not_found"
    page = client.get("/campaigns/ur10e/speeds?distance_m=far")
    assert (page.status_code, page.headers["content-type"]) == (422, "text/html; charset=utf-8")
    assert "distance_m" in page.text
    folder = tmp_path / "served" / "broken"
    shutil.copytree(measured / "kuka", folder)
    lines = (folder / "impacts.csv").read_text().splitlines()
    lines[5] = lines[5].replace("0.", "zero", 1)
    write(folder / "impacts.csv", "\n".join(lines).encode())
    with client_of(folder.parent) as broken:
        answer = broken.get("/api/campaigns/broken/map")
        error = answer.json()["error"]
        assert answer.status_code == 422
        assert error["row"] == 6
        assert error["column"]
        assert "Traceback" not in answer.text
        assert "row 6" in broken.get("/").text


def test_an_empty_plan_has_pages_that_say_so(tmp_path):
    plan = [
        "plan",
        str(tmp_path / "new"),
        "--distances-m",
        "0.5,0.9",
        "--heights-m",
        "0.1,0.5",
        "--speeds-mps",
        "0.1,0.3",
    ]
    assert run([*plan, "--device-range-N", "500"]) == 0
    with client_of(tmp_path / "new") as client:
        page = client.get("/campaigns/new")
        assert page.status_code == 200
        assert "no impacts yet" in page.text
        assert "- %" not in page.text
        assert "planned runs that are missing; the next is" in page.text
        for part in ("/map", "/speeds", "/compare", "/task"):
            assert client.get(f"/campaigns/new{part}").status_code == 409
        assert client.get("/campaigns/new/conditions").status_code == 200


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.7", "example.org"])
def test_only_loopback_is_served(measured, capsys, host):
    assert run(["serve", str(measured), "--host", host]) == 2
    assert "expected 127.0.0.1" in capsys.readouterr().err


def test_an_interrupt_ends_it_and_a_taken_port_is_said(measured, capsys):
    with serving(measured) as (process, address, token):
        assert run(["serve", str(measured), "--port", str(urlsplit(address).port)]) == 2
        assert "choose another with --port" in capsys.readouterr().err
        answer = httpx.get(address, headers=bearer(token), timeout=PATIENCE, trust_env=False)
        assert answer.status_code in (200, 307)  # it has started
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0
    assert run(["serve", str(measured / "nothing")]) == 2
    assert "there is no such folder" in capsys.readouterr().err


def test_the_page_opens_with_a_body_area_that_was_named(measured, capsys):
    assert run(["serve", str(measured), "--area", "hand"]) == 2
    assert "back_of_hand" in capsys.readouterr().err
    browsing = httpx.Client(trust_env=False, timeout=PATIENCE, follow_redirects=True)
    with serving(measured, "--area", "back_of_hand") as (_, address, opening), browsing as browser:
        page = browser.get(f"{address}/?token={opening}")
    assert page.url.params["area"] == "back_of_hand"
    assert "of the measured workspace" in page.text


def test_parallel_uploads_lose_nothing(half_done, full_size):
    folder, later = half_done
    number = 200 if full_size else 25
    some = dict(list(later.items())[:number])
    outside = contents(folder.parent.parent).keys()
    with serving(folder.parent) as (_, address, token), ThreadPoolExecutor(number) as crowd:
        answers = list(crowd.map(lambda run: post(address, token, run, some[run]), some))
    assert [status for status, _ in answers] == [200] * number
    assert {json.loads(body)["use"] for _, body in answers} == {"used"}
    for name, content in some.items():
        assert (folder / "recordings" / f"{name}.csv").read_bytes() == content
    campaign = fm.read_campaign(folder)
    assert {Path(entry.file).stem for entry in campaign.entries} >= set(some)
    assert len(fm.read_dataset(folder)) == number + 10
    new = {path.as_posix() for path in contents(folder.parent.parent).keys() - outside}
    kept = {f"served/half/recordings/{name}.csv" for name in some}
    assert new == kept | {"served/half/impacts.csv", "served/half/recordings.csv"}


def test_a_killed_server_loses_nothing(half_done):
    folder, later = half_done
    some = dict(list(later.items())[:60])
    done = {}

    def send(run):
        try:
            status, _ = post(address, token, run, some[run])
        except (OSError, http.client.HTTPException):
            return
        done[run] = status
        if len(done) >= 12:
            process.kill()

    with serving(folder.parent) as (process, address, token), ThreadPoolExecutor(8) as crowd:
        list(crowd.map(send, some))
    assert 12 <= len(done) < 60
    stored = {path.stem: path.read_bytes() for path in (folder / "recordings").iterdir()}
    assert all(content == later.get(name, content) for name, content in stored.items())
    assert all(done[run] == 200 and run in stored for run in done)
    fm.build_dataset(fm.read_campaign(folder))
    assert {Path(entry.file).stem for entry in fm.read_campaign(folder).entries} == set(stored)


def post(address, token, run, content):
    connection = http.client.HTTPConnection(urlsplit(address).netloc, timeout=PATIENCE)
    try:
        connection.request("POST", f"/api/campaigns/half/recordings?file={run}.csv", content, PLAIN | bearer(token))
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()


def write(path, content):
    path.write_bytes(content)
    return path


def test_a_file_added_on_the_page_enters_nothing_that_is_stated_since_and_collect_says_what_it_enters(half_done):
    """Who adds a recording after the gripper was mounted says nothing of those that were made before."""
    folder, later = half_done
    toml = folder / "campaign.toml"
    stated = re.sub(r"(?m)^payload_kg = .*\n", "", toml.read_text())
    toml.write_text(stated)
    fm.collect_campaign(folder)
    toml.write_text(
        stated.replace("[tool]\n", "[tool]\npayload_kg = 5.0\n")
        if "[tool]\n" in stated
        else f"{stated}[tool]\npayload_kg = 5.0\n"
    )
    run, content = next(iter(later.items()))

    def entered():
        rows = csv.DictReader((folder / "recordings.csv").read_text().splitlines())
        return Counter(row.get("tool.payload_kg", "") for row in rows)

    with client_of(folder.parent) as client:
        added = client.post(
            f"/api/campaigns/half/recordings?{urlencode(HAND | {'file': f'{run}.csv', 'run': run})}",
            content=content, headers=PLAIN,
        )  # fmt: skip
        assert added.status_code == 200, added.text
        assert entered() == {"": 10, "5.0": 1}
        assert "tool.payload_kg = 5.0" in client.post("/api/campaigns/half/collect").json()["stated_since"]
        assert entered() == {"5.0": 11}
        assert client.post("/api/campaigns/half/collect").json()["stated_since"] == ""
