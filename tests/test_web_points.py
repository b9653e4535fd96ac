"""The page of contact points: the list is edited whole or not at all, files are stored or refused."""

from __future__ import annotations

import csv
import io
import zipfile

import httpx
import numpy as np
import pytest
from PIL import Image

import forcemap as fm
from forcemap.report import verify_report
from pulses import TOML, collect, pulse, write_campaign
from test_contact_points import PLACE, POINT, SITE
from web_server import client_of, contents

API = "/api/campaigns/cell"
PRESSURE = "[pressure]\nrange_N_per_cm2 = 500.0\nmean_over_cm2 = 0.0\n"
NEW = {**POINT, **PLACE, "contact": "quasi-static"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = write_campaign(tmp_path_factory.mktemp("page") / "cell", toml=TOML + SITE + PRESSURE)
    collect(folder)
    return folder


@pytest.fixture(scope="module")
def served(folder):
    with client_of(folder) as client:
        yield client


@pytest.fixture
def client(served, folder):
    """The page of the campaign as it was without points."""
    before = contents(folder)
    yield served
    for path, content in contents(folder).items():
        if path not in before:
            (folder / path).unlink()
        elif content != before[path]:
            (folder / path).write_bytes(before[path])


def points(client):
    return client.get(f"{API}/points").raise_for_status().json()


def change(client, cells, replaces="", list_sha256=None):
    seen = points(client)["list_sha256"] if list_sha256 is None else list_sha256
    return client.post(f"{API}/points", json={"list_sha256": seen, "replaces": replaces, "cells": cells})


def sent(client, way, content, **query):
    headers = {"content-type": "application/octet-stream"}
    return client.post(f"{API}/{way}", params=query, content=content, headers=headers)


def of_point(client, way, content, file, point="P1"):
    return sent(client, way, content, point=point, list_sha256=points(client)["list_sha256"], file=file)


def picture(kind, size=(60, 40), **options):
    stream = io.BytesIO()
    Image.fromarray(np.random.default_rng(1).integers(0, 255, (*size[::-1], 3), dtype=np.uint8)).save(
        stream, kind, **options
    )
    return stream.getvalue()


def csv_of(peak, seed):
    rows = zip(*pulse(peak, rate=1000.0, seed=seed), strict=True)
    return ("time_s,force_N\n" + "".join(f"{t},{f}\n" for t, f in rows)).encode()


def test_a_point_is_added_changed_and_taken_out(client, folder):
    assert points(client)["points"] == []
    assert "There is no list of contact points yet" in client.get("/campaigns/cell/points").text
    (added,) = change(client, NEW).raise_for_status().json()["points"]
    assert added["outcome"] == "permitted_by_the_map"
    assert added["speed_to_program_mps"] == pytest.approx(fm.assess_campaign(folder).points[0].speed)
    for part in (
        "P1",
        "back of hand",
        "140 N",
        "ISO/TS 15066:2016",
        "75 N/mm",
        "not confirmed by measurement",
        "signed",
    ):
        assert part in added["permission"]
    change(client, {**NEW, "point_id": "P2", "programmed_mps": "0,9", "hazard": "<b>H&1"}).raise_for_status()
    page = client.get("/campaigns/cell/points").text
    assert "&lt;b&gt;H&amp;1" in page
    assert "the program has 0.9 m/s here" in page
    assert "<strong>The cell may not run as programmed.</strong>" in page
    assert any(line.startswith("ONLY for motion straight along the map's direction") for line in added["rests_on"])
    assert added["rests_on"] == [fm.sentence(each) for each in fm.assess_campaign(folder).points[0].rests_on]
    too_fast = points(client)["points"][1]
    assert too_fast["speed_to_program_mps"] is None
    at_most = fm.floor_speed(too_fast["program_at_most_mps"])
    assert f"permitted are at most {at_most} m/s" in " ".join(too_fast["lacks"])
    table = page.partition("<tbody>")[2].partition("</tbody>")[0]
    assert f'>P2</a></th><td>not permitted</td><td class="n">{at_most}</td>' in table
    (first, second) = change(client, {**NEW, "point_id": "P9"}, replaces="P1").raise_for_status().json()["points"]
    assert (first["cells"]["point_id"], second["cells"]["programmed_mps"]) == ("P9", "0.9")
    for name, left in (("P9", 1), ("P2", 0)):
        query = {"point": name, "list_sha256": points(client)["list_sha256"]}
        assert len(client.delete(f"{API}/points", params=query).raise_for_status().json()["points"]) == left
    assert not (folder / "contact_points.csv").exists()


@pytest.mark.parametrize(
    ("cells", "replaces", "status", "said"),
    [
        ({"body_area": "hnad"}, "", 422, "nearest"),
        ({"point_id": "P1"}, "", 422, "twice"),
        ({"point_id": "../x"}, "", 422, "1 to 36"),
        ({"distance_m": "700"}, "", 422, "metres"),
        ({"photograph": "../../x.png"}, "", 422, "photographs/"),
        ({"point_id": "P3"}, "P7", 404, "no point 'P7'"),
        ({"remark": "x" * 600}, "", 422, "500"),
    ],
)
def test_what_cannot_be_used_is_refused_and_nothing_is_written(client, folder, cells, replaces, status, said):
    change(client, NEW).raise_for_status()
    before = contents(folder)
    refused = change(client, {**NEW, "point_id": "P2", **cells}, replaces)
    assert refused.status_code == status
    assert said in refused.json()["error"]["message"]
    assert contents(folder) == before


def test_a_list_that_changed_meanwhile_is_not_written_over(client, folder):
    change(client, NEW).raise_for_status()
    seen = points(client)["list_sha256"]
    text = (folder / "contact_points.csv").read_text()
    (folder / "contact_points.csv").write_text(text.replace("P1", "P8"))
    for refused in (
        change(client, {**NEW, "point_id": "P2"}, list_sha256=seen),
        client.delete(f"{API}/points", params={"point": "P8", "list_sha256": seen}),
        sent(client, "photographs", picture("PNG"), point="P8", list_sha256=seen, file="a.png"),
    ):
        assert refused.status_code == 409
    assert "P8" in (folder / "contact_points.csv").read_text()
    assert not (folder / "photographs").exists()


def test_a_list_of_a_spreadsheet_keeps_its_points(client, folder):
    (folder / "contact_points.csv").write_text(
        "point_id;distance_m;height_m;body_area;contact;body;rests_on\nP1;0,7;0,3;back_of_hand;transient;free;map\n"
    )
    change(client, {**NEW, "point_id": "P2"}).raise_for_status()
    rows = list(csv.DictReader(io.StringIO((folder / "contact_points.csv").read_text())))
    assert [(row["point_id"], row["distance_m"], row["body"]) for row in rows] == [
        ("P1", "0.7", "free"), ("P2", "0.7", "free"),
    ]  # fmt: skip


def test_photographs_are_encoded_anew_without_what_they_carried(client, folder):
    change(client, NEW).raise_for_status()
    exif = Image.Exif()
    exif[0x010E] = "SECRET PLACE"
    for content, name in (
        (picture("JPEG", exif=exif), "P1.jpg"),
        (picture("PNG"), "P1.png"),
        (picture("PNG"), "P1-2.png"),
    ):
        answer = of_point(client, "photographs", content, "../of the cell.jpeg").raise_for_status().json()
        assert answer["stored_as"] == name
        stored = (folder / "photographs" / name).read_bytes()
        assert b"SECRET" not in stored
        assert points(client)["points"][0]["cells"]["photograph"] == name
        shown = client.get(f"/campaigns/cell/photographs/{name}").raise_for_status()
        assert shown.headers["content-type"] in ("image/jpeg", "image/png")
    assert 'src="/campaigns/cell/photographs/P1-2.png"' in client.get("/campaigns/cell/points").text


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"<svg xmlns='http://www.w3.org/2000/svg'><script>alert(1)</script></svg>",
        b"GIF89a" + bytes(40),
        b"\xff\xd8\xff" + bytes(100),
        b"<html>",
    ],
)
def test_what_is_no_photograph_is_not_stored(client, folder, content):
    change(client, NEW).raise_for_status()
    before = contents(folder)
    assert of_point(client, "photographs", content, "a.jpg").status_code == 422
    gif = of_point(client, "photographs", picture("GIF"), "a.png")
    assert gif.status_code == 422
    assert "no JPEG or PNG picture" in gif.json()["error"]["message"]
    assert contents(folder) == before
    assert client.get("/campaigns/cell/photographs/..%2Fcampaign.toml").status_code == 404


def test_recordings_and_films_of_a_point_confirm_it(client, folder):
    measured = {**POINT, "rests_on": "measurements", "recorded_at_mps": "0.2", "contact": "quasi-static"}
    change(client, measured).raise_for_status()
    assert "NOT MEASURED" in points(client)["points"][0]["lacks"][0]
    for number, peak in enumerate((100, 110, 105), start=1):
        answer = of_point(client, "point-recordings", csv_of(peak, number), "device 7.csv").raise_for_status().json()
        assert (answer["stored_as"], answer["problem"]) == (f"points/P1-{number}.csv", "")
    again = of_point(client, "point-recordings", csv_of(100, 1), "other.csv")
    assert (again.status_code, again.json()["error"]["kind"]) == (409, "duplicate")
    (point,) = points(client)["points"]
    assert (point["outcome"], point["speed_to_program_mps"]) == ("confirmed", 0.2)
    assert "pressure not assessed" in point["permission"]
    for number, pressure in enumerate((150, 160, 155), start=1):
        film = f"unit: N/cm2\npitch: 6 mm\n0;{pressure};0\n{pressure};9;0\n"
        answer = sent(client, "pressures", film.encode(), file=f"P1-{number}.txt").raise_for_status().json()
        assert (answer["stored_as"], answer["pressure_N_per_cm2"]) == (f"pressures/points/P1-{number}.txt", pressure)
    (point,) = points(client)["points"]
    assert "pressure within its limit of 190 N/cm² by the film" in point["permission"]
    assert [impact["pressure_N_per_cm2"] for impact in point["impacts"]] == [150, 160, 155]


@pytest.mark.parametrize(
    ("file", "text", "status", "said"),
    [
        ("d1.csv", "unit: N/cm2\npitch: 6 mm\n0;150\n9;9\n", 422, "expected that of a run"),
        ("d700-h300-v100-r1.exe", "unit: N/cm2\npitch: 6 mm\n0;150\n9;9\n", 415, "expected one of"),
        ("d700-h300-v100-r1.csv", "unit: N/cm2\npitch: 6 mm\n0;150\n9;x\n", 422, "found 'x'"),
        ("d700-h300-v100-r1.csv", "unit: N/cm2\npitch: 0.1 mm\n0;150\n9;8\n", 422, "does not cover the contact"),
    ],
)
def test_films_that_cannot_be_used_are_not_stored(client, folder, file, text, status, said):
    before = contents(folder)
    refused = sent(client, "pressures", text.encode(), file=file)
    assert refused.status_code == status
    assert said in refused.json()["error"]["message"]
    assert contents(folder) == before


def test_a_film_of_a_run_is_collected_and_not_replaced(client, folder):
    film = b"unit: N/cm2\npitch: 6 mm\n0;150;0\n250;9;3\n"
    stored = sent(client, "pressures", film, file="d700-h300-v100-r1.csv").raise_for_status().json()
    assert (stored["stored_as"], stored["problem"]) == ("pressures/d700-h300-v100-r1.csv", "")
    assert "250.00" in (folder / "impacts.csv").read_text()
    assert sent(client, "pressures", film, file="d700-h300-v100-r1.txt").status_code == 409


def test_the_report_is_taken_away_with_its_list(client, folder, tmp_path):
    packed = client.get(f"{API}/files/report.zip", params={"area": "back_of_hand"}).raise_for_status()
    with zipfile.ZipFile(io.BytesIO(packed.content)) as archive:
        assert archive.namelist() == ["report.html", "report.sha256"]
        archive.extractall(tmp_path)
    found = verify_report(tmp_path / "report.html", folder)
    assert found.holds
    assert found.listed
    film = folder / "pressures" / "d700-h300-v100-r1.csv"
    film.parent.mkdir(exist_ok=True)
    film.write_text("unit: N/cm2\n")
    assert verify_report(tmp_path / "report.html", folder).new == ("pressures/d700-h300-v100-r1.csv",)


def test_links_out_of_the_folder_are_not_followed(client, folder, tmp_path):
    (tmp_path / "secret.png").write_bytes(picture("PNG"))
    (folder / "photographs").mkdir(exist_ok=True)
    (folder / "photographs" / "a.png").symlink_to(tmp_path / "secret.png")
    try:
        for address in ("/campaigns/cell/photographs/a.png", f"{API}/points", "/campaigns/cell/points"):
            assert client.get(address).status_code == 409
    finally:
        (folder / "photographs" / "a.png").unlink()


def test_a_list_that_cannot_be_used_is_said_on_the_page(client, folder):
    (folder / "contact_points.csv").write_text("point_id\nP1\n")
    answer = points(client)
    assert "column is missing" in answer["problem"]
    assert "No contact point is permitted" in client.get("/campaigns/cell/points").text
    assert isinstance(change(client, NEW), httpx.Response)
    assert (folder / "contact_points.csv").read_text() == "point_id\nP1\n"
