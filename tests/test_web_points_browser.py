"""The page of contact points in a browser: a point is added, changed, refused, and given a photograph; a cell from plan
to report."""

from __future__ import annotations

import html
import re
import shutil
import zipfile

import pytest

import forcemap as fm
from forcemap.cli.app import run
from pulses import TOML, collect, truth, write_campaign
from test_contact_points import SITE
from test_web_browser import CHROMIUM, QUIET, playwright
from test_web_points import PRESSURE, csv_of, picture
from web_server import PATIENCE, serving

pytestmark = pytest.mark.skipif(
    shutil.which(CHROMIUM or "") is None, reason="there is no browser; on Debian: apt-get install chromium"
)


def test_a_list_is_made_in_the_browser(tmp_path):
    folder = write_campaign(tmp_path / "cell", toml=TOML + SITE)
    collect(folder)
    with serving(folder) as (_, address, token), playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=QUIET, timeout=1000 * PATIENCE)
        page, complaints = browser.new_context(viewport={"width": 390, "height": 844}).new_page(), []
        page.set_default_timeout(1000 * PATIENCE)
        page.on("pageerror", lambda error: complaints.append(str(error)))

        def says(words):
            playwright.expect(page.locator("#said")).to_contain_text(words, timeout=1000 * PATIENCE)

        page.goto(f"{address}/campaigns/cell/points?token={token}")
        new = page.locator("section:has(#new-title) form")
        for column, text in (
            ("point_id", "P1"),
            ("contact_site", "flange"),
            ("distance_m", "0,7"),
            ("height_m", "0.3"),
        ):
            new.locator(f"[name={column}]").fill(text)
        new.locator("[name=direction]").fill("down")
        assert new.locator("[name=body_area]").input_value() == ""  # none is assumed
        new.locator("[name=body_area]").select_option("back_of_hand")
        new.locator("button").click()
        says("P1 is saved")
        playwright.expect(page.locator("#point-P1 h2")).to_contain_text("P1: permitted by the map")
        page.locator("#point-P1 summary").click()
        page.locator("#point-P1 [name=height_m]").fill("300")
        page.locator("#point-P1 button:not(.plain)").click()
        says("height_m, found 300, expected metres")
        page.locator("#point-P1 [name=height_m]").fill("0.35")
        page.locator("#point-P1 button:not(.plain)").click()
        says("P1 is saved")
        photograph = {"name": "cell.jpg", "mimeType": "image/jpeg", "buffer": picture("JPEG")}
        page.locator("#point-P1 [data-way=photographs]").set_input_files(files=[photograph])
        says("cell.jpg is stored as P1.jpg")
        shown = page.locator("#point-P1 img.photograph")
        shown.scroll_into_view_if_needed()
        assert shown.evaluate("image => image.decode().then(() => image.naturalWidth)") == 60
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "nothing lies beyond the screen"
        beside = page.context.new_page()
        beside.goto(f"{address}/campaigns/cell")
        playwright.expect(beside.locator("#listed")).to_contain_text("1 of 1 contact point permitted")
        beside.close()
        page.on("dialog", lambda dialog: dialog.accept())
        page.locator("#point-P1 [data-remove]").click()
        says("P1 is taken out of the list")
        assert not complaints
        browser.close()
    assert not (folder / "contact_points.csv").exists()
    assert (folder / "photographs" / "P1.jpg").exists()


PROTOCOL = '[protocol]\ndocument_number = "V-17"\nsigned_by = "the safety officer"\n'
CHOSEN = ("body_area", "contact", "rests_on")
HAND = {"body_area": "back_of_hand"}
AT = {**HAND, "contact_site": "flange", "distance_m": "0.7", "height_m": "0.3", "direction": "down"}
ELSEWHERE = {**HAND, "contact_site": "finger", "direction": "in", "contact": "quasi-static", "rests_on": "measurements"}
MEASURED = {**ELSEWHERE, "recorded_at_mps": "0.2"}
FIVE = {
    "P1": AT,
    "P2": {**AT, "height_m": "0.25", "height_to_m": "0.35", "contact": "quasi-static", "hazard": "H-2"},
    "P3": {**MEASURED, "hazard": "H-3"},
    "P4": {**MEASURED, "hazard": "H-4", "programmed_mps": "0.15"},
    "P5": {**ELSEWHERE, "hazard": "H-5"},
}


def files(names, contents, kind="text/csv"):
    return [{"name": name, "mimeType": kind, "buffer": content} for name, content in zip(names, contents, strict=True)]


def test_a_cell_of_five_points_from_the_plan_to_the_report_on_the_page_alone(tmp_path, capsys):
    """Two points by the map, two by single measurements, of one the pressure, too; one is not measured."""
    folder = write_campaign(tmp_path / "cell", recorded=False, toml=TOML + SITE + PRESSURE + PROTOCOL)
    plan = fm.read_plan(folder)
    states = zip(plan.distance, plan.height, plan.speed, strict=True)
    runs = files([f"{name}.csv" for name in plan.recording], [csv_of(truth(*s), i) for i, s in enumerate(states)])
    with serving(folder) as (_, address, token), playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=QUIET, timeout=1000 * PATIENCE)
        page, complaints = browser.new_page(accept_downloads=True), []
        playwright.expect.set_options(timeout=1000 * PATIENCE)
        page.set_default_timeout(1000 * PATIENCE)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(f"{address}/?token={token}")
        page.goto(f"{address}/campaigns/cell")
        page.set_input_files("#file", files=runs)
        page.click("#add button")
        playwright.expect(page.locator("#added")).to_contain_text("27 of 27 are stored")
        playwright.expect(page.locator("#swap-state")).to_contain_text("27 of 27")
        page.click("text=Contact points")

        def says(words):
            playwright.expect(page.locator("#said")).to_contain_text(words)

        def given(point, way, names, contents, kind="text/csv"):
            page.locator(f"{point} [data-way={way}]").set_input_files(files=files(names, contents, kind))
            says(f"{names[-1]} is stored as")

        for name, cells in FIVE.items():
            new = page.locator("section:has(#new-title) form")
            for column, text in {"point_id": name, **cells}.items():
                field = new.locator(f"[name={column}]")
                field.select_option(text) if column in CHOSEN else field.fill(text)
            new.locator("button").click()
            says(f"{name} is saved")
            page.locator(f"#point-{name} summary").click()
            given(f"#point-{name}", "photographs", [f"{name}.jpg"], [picture("JPEG")], "image/jpeg")
        for name, peak in (("P3", 100), ("P4", 80)):
            repeats = [csv_of(peak + i, 10 * peak + i) for i in range(3)]
            given(f"#point-{name}", "point-recordings", ["a.csv", "b.csv", "c.csv"], repeats)
        films = [f"unit: N/cm2\npitch: 6 mm\n0;{p};0\n{p};9;0\n".encode() for p in (150, 160, 155)]
        given("", "pressures", ["P3-1.txt", "P3-2.txt", "P3-3.txt"], films)
        verdicts = ("permitted by the map", "permitted by the map", "confirmed", "confirmed", "not permitted")
        for name, verdict in zip(FIVE, verdicts, strict=True):
            held = "contact" not in FIVE[name]  # the form's own choices: constrained, transient
            said = f"{name}: {verdict}{', IF the risk assessment says why' * held}"
            playwright.expect(page.locator(f"#point-{name} h2")).to_have_text(said)
        page.click("text=Downloads")
        with page.expect_download() as taken:
            page.click("text=With the list of its inputs")
        taken.value.save_as(tmp_path / "report.zip")
        assert not complaints
        browser.close()
    with zipfile.ZipFile(tmp_path / "report.zip") as archive:
        archive.extractall(tmp_path)
    report = (tmp_path / "report.html").read_text()
    assert report.count("data:image/jpeg") == 5
    first = " ".join(html.unescape(re.sub(r"<[^>]*>", " ", report.partition("Document and signatures")[0])).split())
    held = "1 permitted by the map, IF the risk assessment says why"
    assert f"5 contact points: 2 confirmed ; {held} ; 1 permitted by the map ; 1 not permitted" in first
    assert "NOT PERMITTED: P5 (not measured)" in first
    for point, speed, pressure in (
        ("P3", "0.200 m/s", "pressure within its limit of 190 N/cm² by the film at this point"),
        ("P4", "0.200 m/s, now 0.15", "pressure not assessed"),
    ):
        named = f"{point} (program at most {speed}, 3 impacts)"
        assert f"{named}, back of hand, quasi-static contact" in first
        assert f"(75 N/mm); {pressure}; to be signed by the safety officer." in first
    assert run(["report", str(folder), "--verify", str(tmp_path / "report.html")]) == 0
    (folder / "photographs" / "P5.jpg").write_bytes(picture("JPEG", size=(61, 40)))
    assert run(["report", str(folder), "--verify", str(tmp_path / "report.html")]) == 1
    assert "photographs/P5.jpg" in capsys.readouterr().out
