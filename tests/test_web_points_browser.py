"""The page of contact points in a browser: a point is added, changed, refused, and given a photograph."""

from __future__ import annotations

import shutil

import pytest

from pulses import TOML, collect, write_campaign
from test_contact_points import SITE
from test_web_browser import CHROMIUM, QUIET, playwright
from test_web_points import picture
from web_server import PATIENCE, serving

pytestmark = pytest.mark.skipif(
    shutil.which(CHROMIUM or "") is None, reason="there is no browser; on Debian: apt-get install chromium"
)


def test_a_list_is_made_in_the_browser(tmp_path):
    folder = write_campaign(tmp_path / "cell", toml=TOML + SITE)
    collect(folder)
    with serving(folder) as (_, address, token), playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=QUIET, timeout=1000 * PATIENCE)
        page, complaints = browser.new_page(viewport={"width": 390, "height": 844}), []
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
        page.on("dialog", lambda dialog: dialog.accept())
        page.locator("#point-P1 [data-remove]").click()
        says("P1 is taken out of the list")
        assert not complaints
        browser.close()
    assert not (folder / "contact_points.csv").exists()
    assert (folder / "photographs" / "P1.jpg").exists()
