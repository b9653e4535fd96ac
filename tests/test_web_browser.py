"""The page in a real Chromium: what a person sees, with mouse and with keyboard, and what leaves the machine."""

from __future__ import annotations

import os
import re
import shutil
import time
from contextlib import closing
from urllib.parse import urlsplit

import numpy as np
import pandas as pd
import pytest

import forcemap as fm
from conftest import other_impacts
from sizes import FULL_SIZE
from web_server import PATIENCE, contents, serving

Axe = pytest.importorskip("axe_core_python.sync_playwright", reason="axe is missing: pip install '.[test]'").Axe
playwright = pytest.importorskip("playwright.sync_api", reason="playwright is missing: pip install '.[test]'")

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no browser; on Debian: apt-get install chromium")
QUIET = [
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--process-per-site",  # one process for all pages of a window, not one for each
    *(["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []),
]


DOWNLOADED = "net::ERR_ABORTED"  # what Chromium says of a visit that becomes a download
HAND = "area=back_of_hand"
FIRST = "recording=d520-h140-v200-r1.csv"
SHIFTS = """
window.shifted = 0;
window.moved = [];
const seen = (entry) => {
  if (entry.hadRecentInput) return;
  shifted += entry.value;
  for (const { node, previousRect, currentRect } of entry.sources)
    moved.push([entry.startTime, node?.outerHTML?.slice(0, 90), previousRect.toJSON(), currentRect.toJSON()]);
};
new PerformanceObserver((list) => list.getEntries().forEach(seen)).observe({ type: "layout-shift", buffered: true });
"""
NOTED = """
window.taken = [];
for (const way of ["text", "json"]) {
  const read = Response.prototype[way];
  Response.prototype[way] = async function () {
    const found = await read.call(this);
    setTimeout(() => taken.push(this.url)); // after all that the page does with it at once
    return found;
  };
}
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory, simulated):
    """Address of a page of a campaign that lacks its last recording, its folder, that recording, and the token."""
    folder = tmp_path_factory.mktemp("served") / "lab"
    shutil.copytree(simulated, folder)
    for name in ("recordings.csv", "impacts.csv"):
        (folder / name).unlink()
    last = sorted((folder / "recordings").iterdir())[-1]
    kept = folder.parent / last.name
    last.rename(kept)
    fm.build_dataset(fm.read_campaign(folder))
    with serving(folder) as (_, address, token):
        yield address, folder, kept, token


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as started:
        playwright.expect.set_options(timeout=1000 * PATIENCE)
        browser = started.chromium.launch(executable_path=CHROMIUM, args=QUIET, timeout=1000 * PATIENCE)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def admitted(browser, served):
    """The windows of a browser that was let in: one for each look, which its pages share."""
    windows = {}

    def window(**options):
        look = str(options)
        if look not in windows:
            windows[look] = browser.new_context(base_url=served[0], **options)
            windows[look].set_default_timeout(1000 * PATIENCE)
            windows[look].request.get(f"/?token={served[3]}")
            windows[look].new_page().goto("/static/look.js")  # it stays, and so the process of its site
        return windows[look]

    yield window
    for each in windows.values():
        each.close()


@pytest.fixture
def opened(admitted):
    """Open a page of its own, closed in the end; it waits as long as it takes."""
    pages = []

    def open_page(**options):
        pages.append(admitted(**options).new_page())
        return pages[-1]

    yield open_page
    for page in pages:
        page.close()


LOOKS = [pytest.param((1280, "light"), id="desk"), pytest.param((390, "dark"), id="phone, dark")]
# for what is done on a page, not how it looks
desk_will_do = pytest.mark.parametrize("page", LOOKS if FULL_SIZE else LOOKS[:1], indirect=True)


@pytest.fixture(params=LOOKS)
def page(request, opened):
    """A page that must not complain and must not ask anybody else."""
    width, scheme = request.param
    page = opened(viewport={"width": width, "height": 844}, color_scheme=scheme, accept_downloads=True)
    complaints, hosts = [], set()
    page.on("console", lambda said: complaints.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("requestfailed", lambda failed: failed.failure == DOWNLOADED or complaints.append(failed.url))
    page.on("request", lambda asked: hosts.add(urlsplit(asked.url).hostname))
    yield page
    page.close()
    assert complaints == []
    assert hosts <= {"127.0.0.1", None}  # None: data: and blob: addresses


@pytest.fixture
def single(opened):
    """A page for what does not depend on its size; it notes which answers its scripts have taken."""
    page = opened(viewport={"width": 1280, "height": 3000})  # the workspace is asked for where it is seen
    page.add_init_script(NOTED)
    return page


@pytest.fixture(scope="module")
def force_map(served):
    return fm.fit_force_map(fm.read_dataset(served[1]))


def librarys_speed(force_map, distance, height, area="back_of_hand"):
    limit = fm.force_limit(area)
    bound = fm.ToleranceBound(device_error=3.0)
    return fm.safe_speed(force_map, distance, height, limit=limit, bound=bound, contact=fm.Contact.TRANSIENT)


def tasks_speed(force_map, distance, height):
    """The speed to program at a point, with the usual allowances."""
    case = {"limit": fm.force_limit("back_of_hand"), "contact": fm.Contact.TRANSIENT}
    zone = fm.Zones(distance, distance, height, height).grown(fm.Allowance().position)
    found = fm.zone_speeds(force_map, zone, bound=fm.ToleranceBound(device_error=3.0), **case)
    return float(found.speed[0]) - fm.Allowance().speed


def let_go(page, route):
    """Let a question go on that was held, and wait until the scripts of the page are done with its answer."""
    route.continue_()
    page.wait_for_function("address => taken.includes(address)", arg=route.request.url)


def answered(page):
    """Wait until the page says what belongs to its form."""
    page.wait_for_selector("body:not(.asking)")


def place(page):
    return [float(page.input_value(f"#{name}")) for name in ("distance_m", "height_m")]


@pytest.mark.parametrize(
    "part",
    [
        *(f"{part}?{HAND}" for part in ("", "/map", "/speeds", "/compare", "/task", "/downloads")),
        *("/conditions", "/columns", f"/recording?{FIRST}&{HAND}", "", "/map", "/task", f"/recording?{FIRST}"),
    ],
)
def test_each_page_fits_and_is_for_everybody(page, part):
    """Within its window, every field named, and what axe finds of contrast, names and order."""
    page.add_init_script(SHIFTS)
    page.goto(f"/campaigns/lab{part}")
    page.wait_for_selector("h1")
    page.wait_for_load_state("networkidle")
    page.wait_for_function("!document.querySelector('.waiting')")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert page.evaluate(
        "[...document.querySelectorAll('input:not([type=hidden]),select,textarea')]"
        ".every(field => field.labels.length || field.ariaLabel)"
    )
    names = page.evaluate("[...document.querySelectorAll('[id]')].map(each => each.id)")
    assert len(names) == len(set(names))
    assert page.locator(".tabs [aria-current]").is_visible()
    edges = page.evaluate(
        "['.brand', '.tabs a', 'h1'].map(s => document.querySelector(s).getBoundingClientRect().left)"
    )
    assert max(edges) - min(edges) < 1  # one left edge
    assert page.evaluate("shifted") < 0.02, page.evaluate("moved")
    assert [f"{each['id']}: {each['nodes'][0]['html']}" for each in Axe().run(page)["violations"]] == []


@desk_will_do
def test_a_body_area_is_asked_for_and_kept(page):
    """Choosing it answers at once; it goes along from tab to tab, and whoever uses the keyboard is not cut short."""
    page.goto("/campaigns/lab")
    assert page.locator("#share, #lowest, #speed").count() == 0
    page.click(".opens tbody tr >> nth=0")
    page.wait_for_selector("#opened .chart.curve polyline")  # a curve needs none
    assert page.locator("#opened .outcome.within, #opened .outcome.exceeded").count() == 0
    page.keyboard.press("Escape")
    asked = page.locator("#headline .area-asked select")
    asked.focus()
    page.keyboard.press("ArrowDown")
    assert asked.input_value() != ""
    assert page.locator("#share").count() == 0
    asked.select_option("")
    asked.dispatch_event("pointerdown")
    asked.select_option("chest")
    page.wait_for_selector("#share")
    playwright.expect(page.locator("#headline .cap")).to_contain_text("chest", ignore_case=True)
    for tab, answer in (("Safe speeds", "#verdict .figure"), ("Map", "#bound"), ("Task", "#verdict .figure")):
        page.click(f".tabs a:has-text('{tab}')")
        page.wait_for_selector(answer)
        assert page.locator("[name=area]").input_value() == "chest"
    page.wait_for_load_state()
    page.select_option("[name=area]", "palm")
    playwright.expect(page.locator(".tabs a >> nth=0")).to_have_attribute("href", re.compile("area=palm"))
    page.click(".place")
    page.wait_for_selector("#headline .cap")
    playwright.expect(page.locator("#headline .cap")).to_contain_text("palm", ignore_case=True)
    page.wait_for_load_state()  # its scripts are there
    page.select_option("#drop [name=area]", "chest")
    playwright.expect(page.locator("#headline .cap")).to_contain_text("chest")
    with page.expect_navigation(url=re.compile("area=chest")):
        page.click(".brand")
    playwright.expect(page.locator("#headline .cap")).to_contain_text("chest", ignore_case=True)


@desk_will_do
def test_a_dropped_recording_waits_for_its_body_area(page, served):
    page.goto("/campaigns/lab")
    page.set_input_files("#file", served[2])
    playwright.expect(page.locator("#judged")).to_contain_text("no body area was chosen")
    page.select_option("#drop [name=area]", "back_of_hand")
    page.wait_for_selector("#judgement")
    page.wait_for_selector("#headline #share")


@desk_will_do
def test_a_dropped_recording_is_judged_at_once(page, served):
    _, folder, kept, _ = served
    before = contents(folder)
    page.goto("/campaigns/lab?area=back_of_hand")
    carried = page.evaluate_handle(
        "([text, name]) => { const d = new DataTransfer(); d.items.add(new File([text], name)); return d }",
        [kept.read_text(), kept.name],
    )
    page.dispatch_event("#zone", "drop", {"dataTransfer": carried})
    page.wait_for_selector("#judgement")
    (impact,) = fm.find_impacts(fm.read_recording(kept))
    verdict = fm.check_impact(impact, fm.force_limit("back_of_hand"))
    playwright.expect(page.locator("#judgement")).to_have_text(verdict.outcome.replace("_", " "))
    playwright.expect(page.locator("#scenario-1")).to_have_text(impact.scenario.words)
    playwright.expect(page.locator(".peak").first).to_have_text(f"{impact.peak_force:.1f}")
    page.wait_for_selector("#curve polyline")
    assert contents(folder) == before
    page.select_option("[name=area]", "face")
    page.wait_for_selector("#judgement.not_permitted")


@desk_will_do
def test_a_recording_is_added_on_request(page, served):
    _, folder, kept, _ = served
    page.goto("/campaigns/lab?area=back_of_hand")
    playwright.expect(page.locator("#swap-state")).to_contain_text("89 of 89")
    page.set_input_files("#file", kept)
    page.click("#add button")
    page.wait_for_selector("#added strong")
    playwright.expect(page.locator("#added strong")).to_have_text(kept.name)
    assert (folder / "recordings" / kept.name).read_bytes() == kept.read_bytes()
    playwright.expect(page.locator("#swap-state")).to_contain_text("90 of 90")
    (folder / "recordings" / kept.name).unlink()
    (folder / "recordings.csv").unlink()
    fm.build_dataset(fm.read_campaign(folder))


@desk_will_do
def test_each_slider_changes_the_speed_to_the_librarys(page, force_map):
    page.goto("/campaigns/lab/map?area=back_of_hand")
    for name, value in (("distance_m", 0.8), ("height_m", 0.4), ("distance_m", 0.55), ("speed_mps", 0.25)):
        page.locator(f"[data-for={name}]").evaluate(
            "(range, value) => { range.value = value; range.dispatchEvent(new Event('input', {bubbles: true})) }", value
        )
        answered(page)
        at = place(page)
        expected = librarys_speed(force_map, *at)
        playwright.expect(page.locator("#speed")).to_have_text(fm.floor_speed(expected.speed))
        assert f"{at[0]:.3f} m from the base axis, {at[1]:.3f} m above the base" in page.inner_text("#verdict")
    speed = float(page.input_value("#speed_mps"))
    playwright.expect(page.locator("#force")).to_have_text(f"{force_map.predict(*at, speed):.1f}")
    page.wait_for_selector("#along_speed polyline")
    page.fill("#distance_m", "3")
    answered(page)
    playwright.expect(page.locator("#verdict")).to_contain_text("Outside what was measured")
    assert page.locator("#speed").count() == 0


def test_the_head_is_refused_with_the_reason(page):
    page.goto("/campaigns/lab/speeds?area=back_of_hand")
    page.wait_for_selector("#speed")
    page.select_option("[name=area]", "face")
    page.wait_for_selector("#verdict .outcome.not_permitted")
    playwright.expect(page.locator("#verdict")).to_contain_text("is not permitted")
    assert page.locator("#speed").count() == 0
    playwright.expect(page.locator("#counts")).to_contain_text("contact not permitted")


@desk_will_do
def test_a_task_is_dragged_and_outside_is_said(page, force_map):
    page.goto("/campaigns/lab/task?points=0.8,0.4&area=back_of_hand")
    playwright.expect(page.locator("#speed")).to_have_text(fm.floor_speed(tasks_speed(force_map, 0.8, 0.4)))
    drag(page, 0, 30, 20)
    answered(page)
    (moved,) = points(page)
    assert moved != (0.8, 0.4)
    playwright.expect(page.locator("#speed")).to_have_text(fm.floor_speed(tasks_speed(force_map, *moved)))
    drag(page, 0, 600, 0)
    answered(page)
    playwright.expect(page.locator("#verdict")).to_contain_text("outside")
    assert page.locator("#speed").count() == 0
    page.goto("/campaigns/lab/task?points=0.8,0.44;0.8,0.2&programmed_mps=0.3&area=back_of_hand")
    assert page.locator("#speed").count() == 1
    drag(page, 1, 0, 300)
    answered(page)
    playwright.expect(page.locator("#verdict")).to_contain_text("outside")
    playwright.expect(page.locator("#verdict")).to_contain_text("No permission")
    page.click("#more")
    answered(page)
    assert len(points(page)) == 3


def test_an_answer_never_outlives_its_question(opened):
    page = opened()
    page.goto("/campaigns/lab/speeds?area=back_of_hand")
    page.wait_for_selector("#speed")
    page.fill("#distance_m", "")
    answered(page)
    assert page.locator("#speed").count() == 0
    playwright.expect(page.locator("#verdict")).to_contain_text("Distance")
    page.fill("#distance_m", "0.8")
    answered(page)
    assert page.locator("#speed").count() == 1
    page.wait_for_load_state("networkidle")
    page.route("**/speeds?*", lambda route: route.fulfill(status=500, body="<p>nothing</p>", content_type="text/html"))
    page.fill("#distance_m", "0.7")
    answered(page)
    assert page.locator("#speed").count() == 0
    assert page.locator("#facts dl").count() == 0


def test_a_late_judgement_does_not_replace_a_newer_one(single, served):
    held = []
    single.route("**/judge?*area=back_of_hand*", lambda route: held.append(route))
    single.goto("/campaigns/lab?area=back_of_hand")
    single.set_input_files("#file", served[2])
    until(single, lambda: held)
    single.select_option("[name=area]", "face")
    single.wait_for_selector("#judgement.not_permitted")
    let_go(single, held[0])
    assert single.get_attribute("#judgement", "class") == "outcome not_permitted"
    playwright.expect(single.locator("#judged")).to_contain_text("for face")
    single.unroute("**/judge?*area=back_of_hand*")
    single.route("**/judge?*area=chest*", lambda route: held.append(route))
    single.select_option("[name=area]", "chest")
    until(single, lambda: len(held) == 2)
    assert single.locator("#judgement").count() == 0
    assert single.locator("#curve").is_hidden()


def test_late_speeds_do_not_replace_newer_ones(single):
    held = []
    single.route("**/api/**/speeds?*area=chest*", lambda route: held.append(route))
    single.goto("/campaigns/lab/speeds?area=back_of_hand")
    single.wait_for_selector("#counts svg")
    single.select_option("[name=area]", "chest")
    until(single, lambda: held)
    playwright.expect(single.locator("#counts")).to_contain_text("Asking")
    assert single.locator("#plane canvas").count() == 0
    single.select_option("[name=area]", "face")
    playwright.expect(single.locator("#counts")).to_contain_text("contact not permitted")
    let_go(single, held[0])
    playwright.expect(single.locator("#counts")).to_contain_text("contact not permitted")


@pytest.mark.parametrize("part", ["speeds", "map"])
def test_a_page_is_of_one_map(single, served, part):
    """The campaign's files change: before the plane or the workspace is there, and while the page is open."""
    folder = served[1]
    table = (folder / "impacts.csv").read_bytes()
    register = (folder / "recordings.csv").rename(folder.parent / "recordings.csv")  # the table is changed by hand
    plane, legend = {"speeds": ("speeds", "#counts svg"), "map": ("workspace", "#forces svg")}[part]
    held = []
    try:
        single.route(f"**/api/**/{plane}*", lambda route: held.append(route), times=1)
        single.goto(f"/campaigns/lab/{part}?area=back_of_hand&distance_m=0.8&height_m=0.4")
        until(single, lambda: held)
        changed(folder, 0.8)
        held[0].continue_()
        single.wait_for_selector(legend)
        assert single.text_content(".basis code") == shown_map(folder)
        before = single.inner_text(legend.split()[0])
        changed(folder, 0.8)
        with single.expect_navigation():
            single.fill("#distance_m", "0.7")
        single.wait_for_selector(legend)
        assert single.text_content(".basis code") == shown_map(folder)
        assert single.inner_text(legend.split()[0]) != before
        assert single.input_value("#distance_m") == "0.7"
    finally:
        (folder / "impacts.csv").write_bytes(table)
        register.rename(folder / "recordings.csv")


def test_going_back_shows_no_answer_to_another_question(single, force_map):
    single.goto("/campaigns/lab/speeds?distance_m=0.8&height_m=0.4&area=back_of_hand")
    single.fill("#distance_m", "")
    answered(single)
    assert single.locator("#speed").count() == 0
    single.goto("/campaigns/lab?area=back_of_hand")
    single.go_back()
    single.wait_for_load_state()
    answered(single)
    stated = single.input_value("#distance_m")
    expected = [] if stated == "" else [fm.floor_speed(librarys_speed(force_map, float(stated), 0.4).speed)]
    assert single.locator("#speed").all_inner_texts() == expected


def test_speeds_are_cut_like_the_librarys(single):
    single.goto("/campaigns/lab?area=back_of_hand")
    speeds = [0.29, 0.57, 0.1599999, 0.2999999999, 0.0005, 1e-9, 0.001, 1.25, 2.0]
    found = single.evaluate("speeds => import('/static/look.js').then(look => speeds.map(look.floored))", speeds)
    assert found == [fm.floor_speed(speed) for speed in speeds]


@desk_will_do
def test_a_campaign_opens_with_its_answer_and_the_next_step(page, served, force_map):
    page.goto("/campaigns/lab?area=back_of_hand")
    measured = force_map.measured_range
    where = np.linspace(measured.lowest[:2], measured.highest[:2], 181).T
    asked = {"limit": fm.force_limit("back_of_hand"), "contact": fm.Contact.TRANSIENT}
    bound = fm.ToleranceBound(device_error=3.0)
    program = fm.speed_map(force_map, *where, **asked, bound=bound, allowance=fm.Allowance()).speeds.speed_to_program
    for name, expected in (("#lowest", np.nanmin(program)), ("#highest", np.nanmax(program))):
        assert float(page.locator(name).inner_text()) == pytest.approx(expected, abs=0.0015)
    playwright.expect(page.locator("#confirmed")).to_contain_text(
        "Not confirmed by impacts at these speeds yet; before they are released: forcemap confirm lab"
    )
    opening, table = page.locator("#headline").bounding_box(), page.locator("#recordings").bounding_box()
    assert opening["y"] < table["y"]
    assert page.locator("#headline .basis > ul > li").count() == 3
    assert not page.locator("#headline .basis details ul").is_visible()
    page.click("#headline .basis summary")
    playwright.expect(page.locator("#headline .basis details")).to_contain_text("person at rest")
    playwright.expect(page.locator("#next")).to_contain_text("1 planned runs that are missing")
    assert page.locator("#next details").count() == 0
    page.select_option("[name=area]", "face")
    playwright.expect(page.locator("#headline")).to_contain_text("not permitted")
    assert page.locator("#lowest").count() == 0


@desk_will_do
def test_a_row_opens_with_its_curve(page):
    page.goto("/campaigns/lab?area=back_of_hand")
    page.click("#recordings tbody tr:nth-child(3) td:nth-child(3)")
    page.wait_for_selector("#opened .chart.curve polyline")
    name = page.inner_text("#recordings tbody tr:nth-child(3) th")
    playwright.expect(page.locator("#opened h1")).to_have_text(name)
    verdicts = page.locator("#opened .outcome").all_inner_texts()
    assert {"used", "exceeded", "within"} & {*verdicts}
    for words in ("Phase I ends", "transient limit 280 N", "quasi-static limit 140 N"):
        assert words in page.locator("#opened").inner_text() + page.locator("#opened .chart.curve").text_content()
    page.hover("#opened .chart.curve")
    playwright.expect(page.locator("#opened .readout")).to_contain_text("force")
    page.click("#opened [name=after]")
    playwright.expect(page.locator("#opened h1")).to_have_text(page.inner_text("#recordings tbody tr:nth-child(4) th"))
    page.keyboard.press("Escape")
    assert not page.locator("#opened").is_visible()
    page.focus("#recordings tbody tr:nth-child(2) a")  # with the keyboard alone
    page.keyboard.press("Enter")
    page.wait_for_selector("#opened .chart.curve polyline")
    tab_to(page, "#opened .chart.curve")
    page.keyboard.press("ArrowRight")
    first = page.inner_text("#opened .readout")
    page.keyboard.press("ArrowRight")
    assert page.inner_text("#opened .readout") != first != ""
    page.keyboard.press("Escape")
    assert page.evaluate("document.activeElement.closest('tr').rowIndex") == 2


@desk_will_do
def test_tables_are_sorted_searched_and_filtered(page):
    page.goto("/campaigns/lab?area=back_of_hand")
    page.wait_for_selector("#recordings th button")
    rows = page.locator("#recordings tbody tr:visible")
    assert rows.count() == 89  # all of them, in no box
    assert page.evaluate(
        "document.getElementById('recordings').parentElement.scrollHeight <= "
        "document.getElementById('recordings').parentElement.clientHeight + 2"
    )
    peaks = "[...document.querySelectorAll('#recordings tbody td:nth-child(4)')].map(each => Number(each.textContent))"
    page.click("#recordings th:nth-child(4) button")
    assert page.evaluate(peaks) == sorted(page.evaluate(peaks))
    page.focus("#recordings th:nth-child(4) button")
    page.keyboard.press("Enter")
    assert page.evaluate(peaks) == sorted(page.evaluate(peaks), reverse=True)
    assert page.get_attribute("#recordings th:nth-child(4)", "aria-sort") == "descending"
    page.fill("[aria-label='Search the recordings']", "h140-v400 saturated")
    assert rows.count() == 3
    assert page.locator(".listed:has(#recordings) .shown").inner_text() == "3 of 89"
    page.fill("[aria-label='Search the recordings']", "")
    page.select_option(".listed:has(#recordings) select", "used")
    assert rows.count() == 89
    page.select_option(".listed:has(#states) select", "train")
    assert {*page.locator("#states tbody tr:visible td:nth-child(2)").all_inner_texts()} == {"train"}


@desk_will_do
def test_the_plane_is_clicked_read_and_numbered(page, force_map):
    page.goto("/campaigns/lab/speeds?distance_m=0.8&height_m=0.4&area=back_of_hand")
    page.wait_for_selector("#plane .contour")
    box = page.locator("#plane").bounding_box()
    page.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + 0.3 * box["height"])
    answered(page)
    at = place(page)
    assert at != [0.8, 0.4]
    playwright.expect(page.locator("#program")).to_have_text(
        fm.floor_speed(librarys_speed(force_map, *at).speed_to_program)
    )
    assert page.evaluate("document.activeElement.matches('.handle')")
    page.mouse.move(box["x"] + 0.7 * box["width"], box["y"] + 0.25 * box["height"])
    playwright.expect(page.locator(".readout")).to_contain_text("m/s to program")
    numbers = [float(number) for number in page.locator("#plane .number").all_text_contents()]
    assert len(numbers) >= 3
    lowest, highest = min(numbers), max(numbers)
    assert 0.1 < lowest < highest < 0.4
    states = force_map.require_fit().states
    places = {tuple(state) for state in np.round(states.coordinates[:, :2], 6).tolist()}
    centre = "dots => dots.map(dot => `${dot.getAttribute('cx')},${dot.getAttribute('cy')}`)"
    drawn = page.locator("#plane .state").evaluate_all(centre)
    assert len({*drawn}) == len(places)


@desk_will_do
def test_a_wait_shows(page):
    held = []
    page.route("**/api/**/speeds?*", lambda route: held.append(route))
    page.goto("/campaigns/lab/speeds?area=back_of_hand")
    until(page, lambda: held)
    assert page.locator("#counts progress").count() == 1
    page.wait_for_selector("#wait", state="visible")
    held[0].continue_()
    page.wait_for_selector("#counts svg")
    page.wait_for_selector("#wait", state="hidden")
    page.route("**/files/report.html*", lambda route: held.append(route))
    page.goto("/campaigns/lab/downloads?area=back_of_hand")
    page.click("text=Download the report")
    playwright.expect(page.locator("form[aria-label=Report] .state")).to_contain_text("judged again")
    assert page.locator("form[aria-label=Report] button:has-text('Download')").is_disabled()
    until(page, lambda: len(held) == 2)
    page.wait_for_selector("#wait", state="visible")
    file = {"content-disposition": 'attachment; filename="report.html"'}
    held[1].fulfill(body="<p>report</p>", content_type="text/html", headers=file)
    playwright.expect(page.locator("form[aria-label=Report] .state")).to_contain_text("report.html is made")


def test_the_answer_stays_in_view(page):
    page.goto("/campaigns/lab/speeds?area=back_of_hand")
    page.wait_for_selector("#counts svg")
    page.locator("[name=overshoot_mps]").scroll_into_view_if_needed()
    page.evaluate("scrollBy(0, 200)")
    answer, field = page.locator("#verdict .figure").bounding_box(), page.locator("[name=overshoot_mps]").bounding_box()
    assert 0 <= answer["y"] < 844 - answer["height"]
    assert field["y"] < 844
    page.goto("/campaigns/lab/task?area=back_of_hand")
    page.wait_for_selector("#counts svg")
    page.locator("#less").scroll_into_view_if_needed()
    assert 0 <= page.locator("#verdict .figure").bounding_box()["y"] < 844


def test_several_campaigns_at_a_glance_and_together(browser, simulated, tmp_path):
    """The overview with its states, and the path through the maps of two directions, drawn; for everybody."""
    for name in ("down", "up"):
        left = shutil.ignore_patterns("recordings") if name == "up" else None
        shutil.copytree(simulated, tmp_path / "cell" / name, ignore=left)
    stated = tmp_path / "cell" / "up" / "campaign.toml"
    stated.write_text(stated.read_text().replace('direction = "down"', 'direction = "up"'))
    other_impacts(tmp_path / "cell" / "up")
    with serving(tmp_path / "cell") as (_, address, token), closing(browser.new_context(base_url=address)) as context:
        context.set_default_timeout(1000 * PATIENCE)
        page = context.new_page()
        page.goto(f"/?token={token}")
        assert page.locator(".card h2 a").all_inner_texts() == ["down", "up"]
        assert "of the measured workspace" not in page.inner_text(".cards")
        page.select_option(".area-asked select", "back_of_hand")  # one choice for all
        page.wait_for_selector(".card .share")
        playwright.expect(page.locator(".card >> nth=0")).to_contain_text("of the measured workspace")
        assert all("back of hand" in card for card in page.locator(".card").all_inner_texts())
        assert Axe().run(page)["violations"] == []
        page.click("text=A path through the maps")
        page.wait_for_selector("#drawn svg[role=img]")
        assert page.locator("#drawn svg[role=img]").count() == 2
        before = page.locator("#drawn polyline").first.get_attribute("points")
        page.fill("[name=points]", "0.7,0.1,0.4;0.7,0.1,0.2;0.8,0.1,0.2")
        answered(page)
        playwright.expect(page.locator("#drawn polyline").first).not_to_have_attribute("points", before)
        looks = page.locator("#drawn polyline").evaluate_all("all => all.map(each => each.className.baseVal)")
        assert "no_map" in looks
        page.click("text=by map")
        groups = page.locator(".basis details h2").all_inner_texts()
        assert groups[0] == "Of all maps"
        assert {"down", "up"} >= {*groups[1:]}
        assert Axe().run(page)["violations"] == []
        page.goto("/campaigns/down?area=back_of_hand")  # what to do stands first, why behind a click
        playwright.expect(page.locator("#next > p").first).to_have_text("measure 4 slow states")
        assert not page.locator("#next details p").first.is_visible()
        page.click("#next summary")
        playwright.expect(page.locator("#next details")).to_contain_text(
            "every start and stop passes through slow speeds"
        )


@desk_will_do
def test_words_have_a_short_help(page):
    page.goto("/campaigns/lab/map?area=back_of_hand")
    for term, words in (("contact", "clamped"), ("bound", "95 % confidence"), ("CFM_3D", "nine coefficients")):
        assert not page.locator(f"#help-{term}").is_visible()
        page.focus(f"[popovertarget=help-{term}] >> nth=0")
        page.keyboard.press("Enter")
        assert words in page.locator(f"#help-{term}").inner_text()
        page.keyboard.press("Escape")
        assert not page.locator(f"#help-{term}").is_visible()


@desk_will_do
def test_an_entry_is_changed_with_the_keyboard(page, served):
    file = served[1] / "campaign.toml"
    kept = file.read_text()
    try:
        page.goto("/campaigns/lab/conditions")
        page.wait_for_selector("#save:disabled")
        page.focus("[data-entry='robot.firmware']")
        page.keyboard.type("5.15")
        assert "robot.firmware" in page.locator("#not-stated").inner_text()
        page.keyboard.press("Enter")
        playwright.expect(page.locator("#said")).to_contain_text("Written to campaign.toml")
        playwright.expect(page.locator("#not-stated")).not_to_contain_text("robot.firmware")
        assert 'firmware = "5.15"  # version' in file.read_text()
        page.fill("[data-entry='tool.name']", "gripper")
        page.keyboard.press("Enter")
        playwright.expect(page.locator("#said")).to_contain_text("tool.name was 'none' when 89 of the recordings")
        assert 'name = "gripper"' not in file.read_text()
        assert page.evaluate("document.activeElement.id") == "confirm"
        page.fill("[data-entry='tool.name']", "none")
        assert not page.locator("#confirm").is_visible()
    finally:
        file.write_text(kept)


def test_a_wrong_entry_is_named_and_nothing_written(opened, served):
    page, kept = opened(), (served[1] / "campaign.toml").read_text()
    page.goto("/campaigns/lab/conditions")
    page.fill("[data-entry='date']", "yesterday")
    page.click("#save")
    playwright.expect(page.locator("#said")).to_contain_text("expected YYYY-MM-DD")
    page.fill("[data-entry='date']", "")
    page.fill("[data-entry='device.range_N']", "many")
    page.click("#save")
    playwright.expect(page.locator("#said")).to_contain_text("device.range_N: found 'many', expected a number")
    assert page.evaluate("document.activeElement.dataset.entry") == "device.range_N"
    assert (served[1] / "campaign.toml").read_text() == kept


@desk_will_do
def test_columns_are_clicked(page, served, tmp_path):
    file, kept = served[1] / "campaign.toml", (served[1] / "campaign.toml").read_text()
    rows = [line.split(",") for line in served[2].read_text().splitlines() if line[:1].isdigit()]
    path = tmp_path / "run.csv"
    path.write_text("t [ms];level;F\n" + "\n".join(f"{time};1.5;{force}" for time, force in rows) + "\n")
    (impact,) = fm.find_impacts(fm.read_recording(served[2]))
    try:
        page.goto("/campaigns/lab/columns")
        page.set_input_files("#file", path)
        page.wait_for_selector("#table th.chosen")  # the time states its unit
        assert page.locator("#table th.chosen").all_inner_texts()[0].split("\n")[0] == "t [ms]"
        page.focus("#table th:nth-child(3) button")
        playwright.expect(page.locator("#judged")).to_contain_text("Still missing: a force")
        page.keyboard.press("Enter")
        playwright.expect(page.locator("#judged")).to_contain_text(f"Phase I peak {impact.peak_force:.1f} N")
        page.wait_for_selector("#curve polyline")
        page.click("#save")
        playwright.expect(page.locator("#said")).to_contain_text("were read with other entries")
        assert file.read_text() == kept
        page.click("#confirm")
        playwright.expect(page.locator("#said")).to_contain_text("Written")
        assert fm.read_campaign(served[1]).columns.force == "F"
    finally:
        file.write_text(kept)


@desk_will_do
def test_the_keyboard_is_enough(page, force_map):
    page.goto("/campaigns/lab/speeds?area=back_of_hand")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    for selector, key in (("[data-for=distance_m]", "ArrowRight"), ("[data-for=height_m]", "ArrowUp")):
        before = place(page)
        tab_to(page, selector)
        assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none"
        page.keyboard.press(key)
        answered(page)
        assert place(page) != before
    expected = librarys_speed(force_map, *place(page))
    playwright.expect(page.locator("#speed")).to_have_text(fm.floor_speed(expected.speed))
    page.goto("/campaigns/lab/task?points=0.8,0.4&area=back_of_hand")
    page.wait_for_selector(".handle")
    tab_to(page, ".handle")
    for _ in range(3):
        page.keyboard.press("ArrowLeft")
        answered(page)
    assert points(page) == [(0.785, 0.4)]
    page.goto("/campaigns/lab/map?area=back_of_hand")
    tab_to(page, "#workspace")
    page.wait_for_selector("#workspace[data-points]")
    page.keyboard.press("ArrowLeft")


@desk_will_do
def test_the_report_and_the_map_are_taken_away(page, force_map, tmp_path):
    page.goto("/campaigns/lab/downloads?area=back_of_hand")
    with page.expect_download() as taken:
        page.click("text=map.json")
    taken.value.save_as(tmp_path / "map.json")
    assert fm.map_sha256(fm.read_map(tmp_path / "map.json")) == fm.map_sha256(force_map)
    with page.expect_download() as taken:
        page.click("text=Download the report")
    taken.value.save_as(tmp_path / "report.html")
    assert "SIMULATED" in (tmp_path / "report.html").read_text()
    with page.expect_download() as taken:
        page.click("text=Download the speeds")
    assert taken.value.suggested_filename == "speeds.csv"


@desk_will_do
def test_a_hundred_thousand_points_are_turned(page):
    page.goto("/campaigns/lab/map?area=back_of_hand")
    page.wait_for_selector("#along_speed polyline")
    assert page.get_attribute("#workspace", "data-points") is None  # it comes when it is seen
    page.locator("#workspace").scroll_into_view_if_needed()
    page.wait_for_selector("#workspace[data-points]")
    assert int(page.get_attribute("#workspace", "data-points")) >= 100_000
    page.locator("#workspace").scroll_into_view_if_needed()
    box = page.locator("#workspace").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    pictures = [workspace(page)]
    until(page, lambda: pictures.append(workspace(page)) or pictures[-1] == pictures[-2])
    page.mouse.down()
    page.mouse.move(x, y)
    assert workspace(page) == pictures[-1]  # what follows is the turning
    page.mouse.move(x + 90, y + 30)
    page.mouse.up()
    turned = workspace(page)
    assert turned != pictures[-1]
    page.mouse.move(x, y)
    assert workspace(page) == turned


def test_a_long_table_is_shown_page_by_page(browser, tmp_path):
    """Every row can be reached, sorted and found, and what stands below is a few keys away; for everybody."""
    places = [(d, h, v) for v in (0.1, 0.2, 0.3) for d in np.linspace(0.5, 0.9, 10) for h in np.linspace(0.1, 0.5, 9)]
    lines = [f"{d:.3f},{h:.3f},{v},{1000 * v * (1 - d * h):.1f}" for d, h, v in places]
    (tmp_path / "impacts.csv").write_text("\n".join(["distance_m,height_m,speed_mps,peak_force_N", *lines]) + "\n")
    with serving(tmp_path) as (_, address, token), closing(browser.new_context(base_url=address)) as context:
        context.set_default_timeout(1000 * PATIENCE)
        page = context.new_page()
        page.goto(f"/?token={token}")
        seen, rows = set(), page.locator("#states tbody tr:visible th")
        for number, place in enumerate(("1 to 100 of 270", "101 to 200 of 270", "201 to 270 of 270")):
            playwright.expect(page.locator(".pages span")).to_have_text(place)
            assert rows.count() == (70 if number == 2 else 100)
            seen |= {*rows.all_inner_texts()}
            if number < 2:
                page.focus("text=Next rows")
                page.keyboard.press("Enter")
        assert len(seen) == 270
        assert page.evaluate("document.activeElement.textContent") == "Rows before"  # the focus is not lost
        assert Axe().run(page)["violations"] == []
        page.click("#states th button >> nth=6")  # by force, the highest first
        page.click("#states th button >> nth=6")
        playwright.expect(page.locator(".pages span")).to_have_text("1 to 100 of 270")
        forces = [float(text) for text in page.locator("#states tbody tr:visible td:nth-child(7)").all_inner_texts()]
        assert forces == sorted(forces, reverse=True)
        assert forces[0] == max(float(line.split(",")[3]) for line in lines)
        page.fill("[aria-label='Search the states']", rows.last.inner_text())
        assert rows.count() >= 1
        assert not page.locator(".pages").is_visible()


def test_light_and_dark_differ(opened):
    grounds = []
    for scheme in ("light", "dark"):
        page = opened(color_scheme=scheme)
        page.goto("/campaigns/lab?area=back_of_hand")
        colour = page.evaluate("getComputedStyle(document.body).backgroundColor")
        grounds.append(sum(map(int, re.findall(r"\d+", colour)[:3])))
    assert grounds[0] > 600
    assert grounds[1] < 150


@pytest.mark.parametrize("width", [1280, 390])
def test_without_the_token_the_page_says_where_it_is(browser, served, width):
    """From the printed address on a person works as before; a link of another site needs one more click."""
    address, _, _, token = served
    with closing(browser.new_context(base_url=address, viewport={"width": width, "height": 844})) as context:
        context.set_default_timeout(1000 * PATIENCE)
        page = context.new_page()
        asked = "/campaigns/lab/speeds?distance_m=0.8&height_m=0.4&area=back_of_hand"
        assert page.goto(asked).status == 401
        playwright.expect(page.locator("#problem")).to_contain_text("forcemap serve printed where it was started")
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        assert "lab" not in page.inner_text("body")
        page.click("#again")
        assert page.locator("#problem").count() == 1
        page.goto(f"/?token={token}")
        assert page.url == f"{address}/campaigns/lab"
        (cookie,) = context.cookies()
        assert (cookie["httpOnly"], cookie["sameSite"], cookie["expires"]) == (True, "Strict", -1)
        assert token not in page.content()
        assert page.evaluate("document.cookie") == ""
        page.goto(asked)
        page.wait_for_selector("#speed")
        page.route("http://elsewhere.test/", lambda route: route.fulfill(body=f"<a href='{address}{asked}'>link</a>"))
        page.goto("http://elsewhere.test/")
        page.click("a")
        page.click("#again")  # a browser sends the cookie from this site alone
        page.wait_for_selector("#speed")


def drag(page, number, right, down):
    page.wait_for_selector("#counts span")  # the plane is complete
    handle = page.locator(f"[data-point='{number}'] circle").last
    handle.scroll_into_view_if_needed()
    box = handle.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + right / 2, y + down / 2)
    page.mouse.move(x + right, y + down)
    page.mouse.up()


def points(page):
    return [tuple(map(float, each.split(","))) for each in page.input_value("[name=points]").split(";")]


def workspace(page):
    """The picture of the workspace, once all that was asked of it is drawn."""
    return page.evaluate(
        "new Promise(done => requestAnimationFrame(() => requestAnimationFrame("
        "() => done(document.getElementById('workspace').toDataURL()))))"
    )


def until(page, true):
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end, "nothing happened"
        page.wait_for_timeout(25)


def changed(folder, factor):
    """Forces of the campaign's impacts times a factor."""
    table = pd.read_csv(folder / "impacts.csv", comment="#")
    table["peak_force_N"] *= factor
    table.to_csv(folder / "next.csv", index=False)
    os.replace(folder / "next.csv", folder / "impacts.csv")


def shown_map(folder):
    return fm.map_sha256(fm.fit_force_map(fm.read_dataset(folder)))[:16]


def tab_to(page, selector):
    for _ in range(80):
        if page.evaluate("selector => document.activeElement.matches(selector)", selector):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"{selector} cannot be reached with the Tab key")
