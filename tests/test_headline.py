"""What a campaign opens with, against the library; the lines, the route and the recordings that are drawn."""

from __future__ import annotations

import contextlib
import csv
import math
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

import forcemap as fm
from conftest import other_impacts
from forcemap.web.contours import contours, round_values
from forcemap.web.route import views
from forcemap.words import sentences
from pulses import collect, pulse, save, write_campaign
from web_server import client_of


@pytest.fixture(scope="module")
def root(simulated, tmp_path_factory):
    """Two campaigns of one robot: down, and up with nearly the same forces."""
    root = tmp_path_factory.mktemp("served")
    for name in ("down", "up"):
        shutil.copytree(simulated, root / name)
    other_impacts(root / "up")
    stated = (root / "up" / "campaign.toml").read_text()
    (root / "up" / "campaign.toml").write_text(stated.replace('direction = "down"', 'direction = "up"'))
    return root


@pytest.fixture(scope="module")
def client(root):
    with client_of(root) as client:
        yield client


@pytest.mark.parametrize("area", ["back_of_hand", "chest", "palm"])
def test_the_headline_is_the_librarys(client, root, area):
    force_map = fm.fit_force_map(fm.read_dataset(root / "down"))
    bound, allowance = fm.ToleranceBound(device_error=3.0), fm.Allowance()
    cases = client.get(f"/api/campaigns/down/headline?area={area}").json()["cases"]
    assert [case["contact"] for case in cases] == ["transient", "quasi-static"]
    for case in cases:
        where = fm.measured_grid(force_map, 0.05)
        asked = {"limit": fm.force_limit(area), "contact": fm.Contact(case["contact"])}
        speeds = fm.speed_map(force_map, *where, **asked, bound=bound, allowance=allowance).speeds
        program = speeds.speed_to_program
        assert case["places"] == int(np.sum(speeds.to_program_outcome != fm.SpeedOutcome.OUTSIDE))
        assert case["permitted"] == int(np.sum(~np.isnan(program)))
        assert case["share"] == pytest.approx(case["permitted"] / case["places"])
        if case["permitted"]:
            axes = np.linspace(force_map.measured_range.lowest[:2], force_map.measured_range.highest[:2], 101).T
            fine = fm.speed_map(force_map, *axes, **asked, bound=bound, allowance=allowance).speeds.speed_to_program
            assert case["lowest_speed_mps"] == pytest.approx(np.nanmin(fine), abs=0.002)
            assert case["highest_speed_mps"] == pytest.approx(np.nanmax(fine), abs=0.001)
            assert case["lowest_speed_mps"] <= np.nanmin(program)
            assert case["highest_speed_mps"] >= np.nanmax(program)
        else:
            assert (case["lowest_speed_mps"], case["state"]) == (None, "nowhere")
        standard = case["standard"]
        assert standard["places_with_more"] == int(
            np.sum((speeds.speed > case["standard_speed_mps"]) & ~np.isnan(program))
        )
        if case["contact"] == "transient":
            less = case["places"] - standard["places_with_more"]
            shown = client.get(f"/campaigns/down?area={area}").text
            words = f"more at {standard['places_with_more']} of {case['places']} places", f"less or nothing at {less}"
            assert all(each in shown for each in words) == bool(case["permitted"])
        assert case["rests_on"]["limit_N"] == fm.force_limit(area).force(asked["contact"])
        worst = fm.safe_speed(force_map, case["worst"]["distance_m"], case["worst"]["height_m"], **asked, bound=bound)
        assert (case["worst"]["speed_mps"] is None) == (case["state"] != "permitted")
        assert np.isnan(worst.speed_to_program) == (case["state"] != "permitted")
        assert case["state"] != "permitted" or case["permitted"] == case["places"]


def test_the_page_says_it_with_limit_bound_and_doubts(client):
    page = client.get("/campaigns/down?area=back_of_hand").text
    case = client.get("/api/campaigns/down/headline?area=back_of_hand").json()["cases"][0]
    opening = page.partition('id="headline"')[2].partition("</section>")[0]
    assert f'id="lowest">{fm.floor_speed(case["lowest_speed_mps"])}<' in opening
    assert f'id="highest">{fm.floor_speed(case["highest_speed_mps"])}<' in opening
    assert "limit 280 N" in opening
    assert "95 % of states with 95 % confidence" in page
    for warning in case["rests_on"]["warnings"]:
        assert warning in opening
    face = client.get("/campaigns/down?area=face").text.partition('id="headline"')[2]
    assert "No speed" in face.partition("</section>")[0]
    assert 'id="lowest"' not in face


def test_the_next_step_is_what_is_missing_then_the_librarys_plan(client, root):
    asked = "/api/campaigns/down/next?area=back_of_hand"
    answer = client.get(asked).json()
    dataset, limit = fm.read_dataset(root / "down"), fm.force_limit("back_of_hand")
    bound = fm.ToleranceBound(device_error=3.0)
    measure = fm.next_measurements(dataset, limit, contact=fm.Contact.TRANSIENT, bound=bound)
    plan = measure.plan
    counted = f"{measure.confirmed} of {measure.places} places spread evenly over the range"
    assert answer["sentence"].startswith("measure 4 slow states; every start and stop passes through slow")
    assert "; ".join([answer["what"], *answer["why"]]) == answer["sentence"]
    assert answer["what"] == "measure 4 slow states"
    shown = client.get("/api/campaigns/down/headline?area=back_of_hand").json()["cases"][0]["rests_on"]["warnings"]
    assert {*answer["warnings"]} - {*answer["further_warnings"]} <= {*shown}  # the headline says these
    assert f"{counted} to measure have a speed at contact now" in answer["sentence"]
    assert answer["warnings"] == sentences(measure.warnings)
    expected = {tuple(row) for row in np.column_stack([plan.distance, plan.height, plan.speed]).tolist()}
    assert {tuple(state.values())[:3] for state in answer["states"]} == expected
    assert {state["upper_force_N"] for state in answer["states"]} <= {*measure.upper_force.tolist()}
    assert answer["command"] == "forcemap next down --area back_of_hand --contact transient"
    assert "no contact" in client.get("/api/campaigns/down/next?area=face").json()["sentence"]
    register = (root / "down" / "recordings.csv").read_text()
    (root / "down" / "recordings.csv").write_text("".join(register.splitlines(keepends=True)[:-1]))
    assert "1 planned runs that are missing" in client.get(asked).json()["sentence"]
    (root / "down" / "recordings.csv").write_text(register)
    table = (root / "down" / "impacts.csv").read_text()
    (root / "down" / "impacts.csv").write_text(table.replace("378.6", "178.6", 1))
    answer = client.get(asked).json()
    assert (answer["states"], answer["command"]) == ([], "")
    assert "impacts.csv" in answer["sentence"]
    (root / "down" / "impacts.csv").write_text(table)


@pytest.mark.parametrize(("bend", "falls"), [(0.0, False), (0.1, False), (0.0, True)])
def test_a_form_is_asked_about_before_the_map_is_confirmed(root, tmp_path, bend, falls):
    """Low enough for a speed everywhere: in the form; bent, which the bound covers; falling with speed."""
    folder = tmp_path / "bent"
    shutil.copytree(root / "up", folder)
    (folder / "plan.csv").unlink()
    rows = list(csv.DictReader((folder / "impacts.csv").read_text().splitlines()))
    truth, scatter = fm.published_map("ur10e"), np.random.default_rng(3).normal(1, 0.01, len(rows))
    for row, factor in zip(rows, scatter, strict=True):
        distance, height, speed = (float(row[name]) for name in ("distance_m", "height_m", "speed_mps"))
        force = 0.5 * factor * truth.predict(distance, height, 0.3 if falls else speed)
        force *= 1 + bend * ((height - 0.3) / 0.16) ** 2 - falls * (speed - 0.3)
        row["peak_force_N"] = f"{force:.2f}"
        row["speed_mps"] = f"{0.5 * speed:.4f}"  # slow impacts are not missing
    with (folder / "impacts.csv").open("w") as stream:
        table = csv.DictWriter(stream, rows[0], lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    with client_of(folder) as client:
        answer = client.get("/api/campaigns/bent/next?area=chest").json()
    wanted = "forcemap evaluate bent --forms" if falls else "forcemap confirm bent --area chest --contact transient"
    assert answer["command"] == wanted, answer
    assert falls or "to be released" in answer["sentence"]


def test_where_no_more_is_to_be_measured_the_next_step_is_the_confirmation(tmp_path):
    """Every state of the paper's grid is fitted, at half the speeds, so that slow impacts are not missing."""
    folder = fm.copy_example("ur10e", tmp_path / "whole")
    rows = list(csv.DictReader((folder / "impacts.csv").read_text().splitlines()))
    for row in rows:
        row["role"], row["speed_mps"] = "train", f"{0.5 * float(row['speed_mps']):.4f}"
        row["peak_force_N"] = f"{0.5 * float(row['peak_force_N']):.2f}"
    with (folder / "impacts.csv").open("w") as stream:
        table = csv.DictWriter(stream, rows[0], lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    with (folder / "campaign.toml").open("a") as stream:
        stream.write("\n[map]\nslowest_mps = 0.1\n")
    with client_of(folder) as client:
        answer = client.get("/api/campaigns/whole/next?area=back_of_hand&contact=quasi-static").json()
    assert answer["states"] == []
    assert answer["sentence"].startswith(
        "confirm the map by impacts at the speeds to be released; measure nothing more"
    )
    assert answer["command"] == "forcemap confirm whole --area back_of_hand --contact quasi-static"


def test_the_overview_says_state_share_and_what_is_due(client):
    lines = {line["name"]: line for line in client.get("/api/campaigns?area=back_of_hand").json()["campaigns"]}
    case = client.get("/api/campaigns/down/headline?area=back_of_hand").json()["cases"][0]
    assert lines["down"]["case"] == case
    assert (lines["down"]["state"], lines["down"]["due"]) == ("ready", [])
    assert lines["up"]["due"] == ["90 runs to measure", "90 recordings to collect"]
    lacking = client.get("/api/campaigns/down/conditions").json()["not_stated"]
    assert lines["down"]["not_stated"] == sum(map(len, lacking.values())) > 0
    page = client.get("/?area=back_of_hand").text
    assert f"{math.floor(100 * case['share'])} % of the measured workspace" in page
    assert "90 runs to measure" in page
    assert f"{lines['down']['not_stated']} entries before signing" in page


def test_a_recording_is_judged_as_check_judges_it(client, root):
    limit = fm.force_limit("chest")
    name = "d520-h140-v400-r1.csv"
    answer = client.get("/api/campaigns/down/recording", params={"recording": name, "area": "chest"}).json()
    campaign = fm.read_campaign(root / "down")
    device = campaign.conditions.device
    recording = fm.read_recording(campaign.recordings / name, columns=campaign.columns, device=device)
    verdict = fm.check_impact(fm.find_impact(recording), limit)
    assert answer["judgement"]["outcome"] == verdict.outcome
    (curve,) = answer["judgement"]["curves"]
    assert max(curve["force_N"]) == pytest.approx(answer["judgement"]["impacts"][0]["raw_peak_force_N"], abs=0.01)
    assert answer["before"] < name < answer["after"]
    page = client.get("/campaigns/down/recording", params={"recording": name, "area": "chest"})
    assert verdict.outcome.replace("_", " ") in page.text
    for wrong in ("../campaign.toml", "nothing.csv", ""):
        found = client.get("/api/campaigns/down/recording", params={"recording": wrong})
        assert found.status_code in (404, 422)


def test_lines_lie_where_the_values_do():
    distance, height = np.linspace(0.5, 0.9, 41), np.linspace(0.1, 0.5, 31)
    values = np.add.outer(distance, 0.5 * height)
    values[:10, :10] = np.nan
    found = contours(distance, height, values, also=0.8125)
    assert {round(line.at, 9) for line in found} == {*round_values(np.nanmin(values), np.nanmax(values)), 0.8125}
    for line in found:
        places = np.array([place for part in line.lines for place in part])
        assert places @ [1, 0.5] == pytest.approx(line.at, abs=1e-3)
        assert not ((places[:, 0] < distance[9]) & (places[:, 1] < height[9])).any()
    assert contours(distance[:1], height, values[:1]) == contours(distance, height, np.full_like(values, np.nan)) == []


def test_a_route_is_drawn_in_its_place_and_by_its_outcomes(client):
    points = [[0.6, 0.1, 0.4], [0.6, 0.1, 0.2], [0.8, -0.1, 0.2]]
    asked = {"points": ";".join(",".join(map(str, point)) for point in points), "contact_sites": "flange"}
    asked["area"] = "back_of_hand"
    answer = client.get("/api/together/path", params=asked)
    path = SimpleNamespace(pieces=[SimpleNamespace(**piece) for piece in answer.json()["pieces"]])
    for view in views(path, points):
        outcomes = [stretch.outcome for stretch in view.stretches for _ in stretch.places[1:]]
        assert outcomes == [piece.outcome for piece in path.pieces]
        inside = np.array([*view.corners, *(place for each in view.stretches for place in each.places)])
        assert (inside >= 0).all()
        assert (inside <= [view.width, view.height]).all()
        assert view.stretches[0].places[0] == view.corners[0]
        assert view.stretches[-1].places[-1] == view.corners[-1]
    page = client.get("/together", params=asked).text
    assert page.count('<svg class="route" viewBox') == 2
    stated = page.partition("Of all maps")[2]
    for line in answer.json()["assumptions"]:
        assert line.replace("'", "&#39;").replace('"', "&#34;") in stated


def test_a_campaign_of_which_no_recording_can_be_used_says_so_and_that_they_clamp(tmp_path):
    """Discarded recordings count: whoever measures on with the same device would learn late that contact clamps."""
    folder = write_campaign(tmp_path / "all" / "slow", recorded=False)
    plan = fm.read_plan(folder)
    for name in plan.recording.tolist()[:4]:
        time, force = pulse(250.0, rate=100.0)
        save(folder / "recordings" / f"{name}.csv", time, force + 60.0 * (time > 0.02))
    with contextlib.suppress(fm.ForcemapError):
        collect(folder)
    entries = fm.read_campaign(folder).entries
    clamp = sum("with_clamping" in str(entry.scenario and entry.scenario.value) for entry in entries)
    assert {entry.use.value for entry in entries} == {"discarded"}
    with client_of(tmp_path / "all") as client:
        answer, page = client.get("/api/campaigns/slow").json(), client.get("/campaigns/slow").text
    assert answer["problem"] == "no map: none of the recordings that were collected can be used; why stands beside each"
    assert answer["phase_two"] == (f"{clamp} of 4 recordings clamp" if clamp else "")
    assert answer["problem"] in page
    assert "run forcemap collect" not in page
    assert clamp > 0
