"""The body area of the page and of its API: what was chosen, else the contact points'; none is assumed."""

from __future__ import annotations

import re
import shutil
from urllib.parse import quote

import pytest

import forcemap as fm
from forcemap.campaigns.not_stated import not_stated
from forcemap.campaigns.protocol import read_protocol
from web_server import client_of

PLACE = "distance_m=0.8&height_m=0.4"
RECORDING = "recording=d520-h140-v200-r1.csv"
ASKED = [
    *("headline", "next", f"speed?{PLACE}", "speed-map", "speeds", "compare", "task?points=0.8,0.4"),
    *("path?points=0.8,0.4;0.8,0.3", f"slices?{PLACE}&speed_mps=0.3", "files/report.html", "files/report.zip"),
    *("files/speeds", "files/scaling.csv?points=0.8,0.4;0.8,0.3&programmed_mps=0.3"),
]
"""What under /api cannot be answered without a body area."""

NEEDLESS = ["", "conditions", "map", "evaluate", "workspace", "points", f"recording?{RECORDING}"]
PAGES = ["", "/map", "/speeds", "/compare", "/task", f"/recording?{RECORDING}"]
ANSWERS = ('id="speed"', 'id="program"', 'id="share"', 'id="lowest"', 'class="share"', "outcome admissible", "280 N")


@pytest.fixture(scope="module")
def root(simulated, tmp_path_factory):
    """Two campaigns of one robot: one without contact points, one with those of chest and palm."""
    root = tmp_path_factory.mktemp("served")
    for name in ("bare", "listed"):
        shutil.copytree(simulated, root / name)
    stated = (root / "listed" / "campaign.toml").read_text()
    (root / "listed" / "campaign.toml").write_text(stated.replace('direction = "down"', 'direction = "up"'))
    for number, file in enumerate(sorted((root / "listed" / "recordings").iterdir())):  # an atlas takes no impact twice
        lines = file.read_text().splitlines()
        rows = (line.split(",") for line in lines[2:])
        raised = [f"{time},{(1.004 + 0.004 * (number % 5)) * float(force):.2f}" for time, force in rows]
        file.write_text("\n".join([*lines[:2], *raised, ""]))
    for name in ("recordings.csv", "impacts.csv"):
        (root / "listed" / name).unlink()
    fm.build_dataset(fm.read_campaign(root / "listed"))
    points = "point_id,distance_m,height_m,body_area,contact,body,rests_on\n"
    points += "P1,0.7,0.3,chest,transient,free,map\nP2,0.7,0.3,palm,transient,free,map\n"
    (root / "listed" / "contact_points.csv").write_text(points)
    return root


@pytest.fixture(scope="module")
def client(root):
    with client_of(root) as client:
        yield client


@pytest.mark.parametrize("asked", ASKED)
def test_without_an_area_an_answer_is_refused_and_says_what_is_missing(client, asked):
    answer = client.get(f"/api/campaigns/bare/{asked}")
    assert answer.status_code == 422
    error = answer.json()["error"]
    assert error["kind"] == "area"
    assert error["message"].startswith("area: no body area was chosen")
    assert "forcemap limits lists them" in error["message"]
    empty = client.get(f"/api/campaigns/bare/{asked}{'&' if '?' in asked else '?'}area=")
    assert empty.json() == answer.json()


@pytest.mark.parametrize("asked", NEEDLESS)
def test_what_needs_no_area_is_answered_without(client, asked):
    answer = client.get(f"/api/campaigns/bare/{asked}".rstrip("/"))
    assert answer.status_code == 200
    assert "transient_limit_N" not in answer.text


@pytest.mark.parametrize("asked", ASKED[:-4])
def test_the_first_contact_points_area_is_taken(client, asked):
    answer = client.get(f"/api/campaigns/listed/{asked}").raise_for_status().json()
    chosen = client.get(f"/api/campaigns/listed/{asked}{'&' if '?' in asked else '?'}area=chest")
    assert answer == chosen.raise_for_status().json()


def test_the_headline_has_the_areas_of_all_contact_points(client):
    cases = client.get("/api/campaigns/listed/headline").json()["cases"]
    assert [case["area"] for case in cases] == ["chest", "chest", "palm", "palm"]
    cases = client.get("/api/campaigns/listed/headline?area=back_of_hand").json()["cases"]
    assert [case["area"] for case in cases[::2]] == ["back_of_hand", "chest", "palm"]


def test_the_page_says_how_many_contact_points_are_listed(client):
    found = client.get("/api/campaigns/listed/headline").json()
    assert (found["contact_points"], found["contact_points_problem"]) == (2, "")
    page = client.get("/campaigns/listed?area=chest").text
    said = page.partition('id="listed"')[2].partition("</p>")[0]
    assert "2 contact points are listed" in said
    assert 'href="/campaigns/listed/points?area=chest&amp;' in said
    assert client.get("/api/campaigns/bare/headline?area=chest").json()["contact_points"] == 0
    lines = {line["name"]: line for line in client.get("/api/campaigns").json()["campaigns"]}
    assert {name: lines[name]["contact_points"] for name in ("listed", "bare")} == {"listed": 2, "bare": 0}
    assert "2 contact points, judged on their page" in client.get("/").text
    bare = client.get("/campaigns/bare?area=chest").text
    said = bare.partition('id="listed"')[2].partition("</p>")[0]
    assert ">contact points</a> are listed: this is of the map alone" in said
    assert "entries</a> to be stated before anybody signs" in bare


def test_the_conditions_page_lists_what_is_missing_before_signing(client, root):
    file = root / "bare" / "campaign.toml"
    expected = not_stated(fm.read_conditions(file), read_protocol(file))
    found = client.get("/api/campaigns/bare/conditions").json()["not_stated"]
    assert [(entry, matters) for matters, entries in found.items() for entry in entries] == [
        (each.entry, each.matters) for each in expected
    ]
    page = client.get("/campaigns/bare/conditions").text
    listed = page.partition('id="not-stated"')[2].partition("</div>")[0]
    assert all(each.entry in listed and each.matters in listed for each in expected)


def test_of_a_list_that_cannot_be_used_no_area_is_taken(root, tmp_path):
    shutil.copytree(root / "listed", tmp_path / "lab")
    (tmp_path / "lab" / "contact_points.csv").write_text("point_id,body_area\nP1,hnad\n")
    with client_of(tmp_path / "lab") as client:
        assert client.get(f"/api/campaigns/lab/speed?{PLACE}").json()["error"]["kind"] == "area"
        page = client.get("/campaigns/lab").text
        assert 'class="area-asked"' in page
        assert "No contact point is permitted" in page.partition('id="listed"')[2].partition("</p>")[0]


@pytest.mark.parametrize("page", PAGES)
def test_a_page_asks_where_its_answer_would_stand(client, page):
    text = client.get(f"/campaigns/bare{page}").raise_for_status().text
    assert text.count('class="area-asked"') == 1
    assert not any(part in text.partition('class="area-asked"')[2] for part in ANSWERS)
    main = re.sub("<form.*?</form>", "", text.partition("<main")[2], flags=re.DOTALL)
    assert not re.search(r"\d m/s( to program| at contact)", main)
    chosen = client.get(f"/campaigns/bare{page}{'&' if '?' in page else '?'}area=chest").raise_for_status().text
    assert 'class="area-asked"' not in chosen
    assert 'class="area-asked"' not in client.get(f"/campaigns/listed{page}").raise_for_status().text


@pytest.mark.parametrize("page", ["/conditions", "/columns", "/points", "/downloads", "/map", ""])
def test_a_page_shows_what_needs_no_area_at_once(client, page):
    there = {"": "d520-h140-v200-r1.csv", "/map": "Measured states", "/downloads": "map.json"}
    text = client.get(f"/campaigns/bare{page}").raise_for_status().text
    assert there.get(page, "<h1>") in text


def test_a_curve_is_shown_without_a_verdict(client):
    answer = client.get(f"/api/campaigns/bare/recording?{RECORDING}").json()["judgement"]
    judged = client.get(f"/api/campaigns/bare/recording?{RECORDING}&area=chest").json()["judgement"]
    assert (answer["kind"], judged["kind"]) == ("measured", "recording")
    assert answer["curves"] == judged["curves"]
    assert answer["recordings"] == judged["recordings"]
    (impact,) = answer["impacts"]
    assert impact.items() <= judged["impacts"][0].items()
    assert "outcome" not in str(answer)


def test_a_dropped_file_is_judged_for_a_chosen_area_alone_but_added_without(root, tmp_path):
    shutil.copytree(root / "bare", tmp_path / "lab")
    (tmp_path / "lab" / "recordings.csv").unlink()
    file = tmp_path / "lab" / "recordings" / "d520-h140-v200-r1.csv"
    content, plain = file.read_bytes(), {"content-type": "application/octet-stream"}
    file.unlink()
    with client_of(tmp_path / "lab") as client:
        for page in ("/api", ""):
            answer = client.post(f"{page}/campaigns/lab/judge?file=a.csv", content=content, headers=plain)
            assert answer.status_code == 422
            assert "no body area was chosen" in answer.text
        stored = client.post(f"/api/campaigns/lab/recordings?file={file.name}", content=content, headers=plain).json()
    assert (stored["stored_as"], stored["use"], stored["judgement"]["kind"]) == (file.name, "used", "measured")
    assert file.read_bytes() == content


def test_what_was_chosen_is_kept_and_what_was_not_is_not_carried_to_others(client):
    chosen = client.get("/campaigns/bare/downloads?area=chest").text
    head, tabs = chosen.partition("<main")[0].partition("<nav")[::2]
    assert 'href="/?area=chest"' in head
    assert tabs.count("area=chest") == tabs.count("<a ")
    tabs = client.get("/campaigns/listed/downloads").text.partition("<main")[0]
    assert "area=" not in tabs  # that of a contact point of this campaign is nobody's choice for others
    assert "area=chest" in client.get("/campaigns/bare/speeds?area=chest&distance_m=0.8").text.partition("<main")[0]
    shown = client.get("/?area=chest").text
    assert '"/campaigns/bare?area=chest"' in shown
    assert '"/together?area=chest"' in shown


def test_the_overview_has_one_choice_for_all_campaigns(client):
    lines = client.get("/api/campaigns").json()
    assert lines["area"] == ""
    assert [line["case"] and line["case"]["area"] for line in lines["campaigns"]] == [None, "chest"]
    assert [line["state"] for line in lines["campaigns"]] == ["ready", "ready"]
    bare = client.get("/").text.partition(">listed</a>")[0]
    assert "No body area is chosen" in bare
    assert not any(part in bare for part in ANSWERS)
    lines = client.get("/api/campaigns?area=back_of_hand").json()
    assert {line["case"]["area"] for line in lines["campaigns"]} == {lines["area"]} == {"back_of_hand"}
    assert client.get("/?area=back_of_hand").text.count("back of hand. Limit") == 2


def test_together_the_area_is_asked_for_unless_one_is_listed(client, root):
    way = "points=0.8,0,0.4;0.8,0,0.3&contact_sites=flange"
    asked = client.get(f"/together?{way}").text
    assert 'class="area-asked"' in asked
    assert 'value="0.8,0,0.4;0.8,0,0.3"' in asked.partition('class="area-asked"')[2]
    assert client.get(f"/api/together/path?{way}").json()["error"]["kind"] == "area"  # chest and palm: none is first
    points = (root / "listed" / "contact_points.csv").read_text()
    (root / "listed" / "contact_points.csv").write_text(points.replace("palm", "chest"))
    try:
        answer = client.get(f"/api/together/path?{way}").raise_for_status().json()
        assert answer == client.get(f"/api/together/path?{way}&area=chest").json()
    finally:
        (root / "listed" / "contact_points.csv").write_text(points)


def test_an_area_that_does_not_exist_is_said_and_not_shown_as_chosen_elsewhere(client):
    evil = "<script>alert(1)</script>"
    for page in ("/", "/campaigns/bare", "/campaigns/bare/speeds", "/together"):
        text = client.get(f"{page}?area={quote(evil)}").text
        assert evil not in text
    refused = client.get("/campaigns/bare/speeds?area=hnad")
    assert refused.status_code == 422
    assert "area=hnad" not in refused.text
