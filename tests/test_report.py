"""The report: complete, valid, self-contained, the same for the same inputs, with the library's numbers in it."""

from __future__ import annotations

import functools
import hashlib
import html
import io
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser

import html5lib
import numpy as np
import pypdf
import pytest

import forcemap as fm
from forcemap.assessment.missing import Missing
from forcemap.assessment.place_speeds import OpenPlaces, _open_box
from forcemap.campaigns.memory import MEMORY_FILE
from forcemap.errors import MissingExtra
from forcemap.files import sha256
from forcemap.report import MadeFor, inputs_list, report_html, report_pdf
from forcemap.report.permission import headline, nowhere
from forcemap.words import sentence, sentences
from pulses import TOML, collect, pulse, save, write_campaign

DATE = "2026-11-21"
HAND = ("--area", "hand_fingers")
SECTIONS = (
    "answer", "signatures", "sheets", "document", "basis", "robot", "points", "runs", "states", "repeatability", "map",
    "verdicts", "speeds", "standard", "open", "retest", "annex-recordings", "annex-inputs",
)  # fmt: skip
VOID = {"meta", "br", "img", "link", "hr", "input"}
FORBIDDEN = {"script", "iframe", "object", "embed", "form", "base", "link", "foreignObject"}
EVIL = "\"><script>alert(1)</script><b id=evil>&amp; it's"


def write_saturated(folder):
    """Every recording at the device range."""
    write_campaign(folder, recorded=False)
    for seed, name in enumerate(fm.read_plan(folder).recording.tolist()):
        seconds, force = pulse(900.0, rate=1000.0, seed=seed)
        save(folder / "recordings" / f"{name}.csv", seconds, np.minimum(force, 500.0))
    collect(folder)


def write_bare(folder):
    """No condition but the device's range and error."""
    write_campaign(folder, repeats=2)
    collect(folder)


def write_table(folder):
    """impacts.csv and campaign.toml, no recordings."""
    fm.copy_example("ur10e", folder)
    for path in folder.iterdir():
        if path.name not in ("impacts.csv", "campaign.toml"):
            path.unlink()


def write_plan(folder):
    write_campaign(folder, recorded=False)


CASES = {"demo": None, "bare": write_bare, "saturated": write_saturated, "table": write_table, "plan": write_plan}
LIMITS = {"demo": ("back_of_hand", "temple")}


@pytest.fixture(scope="module")
def reports(tmp_path_factory, simulated):
    """Folder, assessment and page of every case, each made once, when it is first asked for."""
    made = {}

    def of(case):
        if case not in made:
            folder = tmp_path_factory.mktemp("reports") / case
            if case == "demo":
                shutil.copytree(simulated, folder)
            else:
                CASES[case](folder)
            limits = [fm.force_limit(name) for name in LIMITS.get(case, ())]
            assessment = fm.assess_campaign(folder, limits=limits)
            made[case] = folder, assessment, report_html(assessment, date=DATE)
        return made[case]

    return of


class Reader(HTMLParser):
    """What a page consists of; fails where a tag is not closed."""

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.ids, self.attributes, self.text = [], set(), [], [], []
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self._seen(tag, attrs)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self._seen(tag, attrs)

    def _seen(self, tag, attrs):
        self.tags.add(tag)
        self.ids += [value for name, value in attrs if name == "id"]
        self.attributes += [(tag, name, value) for name, value in attrs]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> at line {self.getpos()[0]}"

    def handle_data(self, data):
        if not self.open or self.open[-1] != "style":
            self.text.append(data)


def check(page):
    """Valid, closed, complete, and nothing outside of it is named."""
    tree_of(page)
    found = Reader(page)
    assert len(set(found.ids)) == len(found.ids)
    assert set(SECTIONS) <= set(found.ids)
    assert not found.tags & FORBIDDEN
    for tag, name, value in found.attributes:
        assert not name.startswith("on"), (tag, name)
        if name in ("src", "href", "xlink:href", "srcset", "action", "poster", "data"):
            assert value.startswith(("#", "data:image/png;base64,", "data:image/jpeg;base64,")), (tag, name, value[:80])
        if value and value.startswith("#") and name in ("href", "xlink:href"):
            assert value[1:] in found.ids, value
        for target in re.findall(r"url\((.*?)\)", value or ""):
            assert target.startswith("#"), target
            assert target[1:] in found.ids, target
    assert "@import" not in page
    assert not re.search(r"url\((?!#)", page)
    text = " ".join(" ".join(found.text).split())
    assert "An estimate from measurements, not a certificate" in text
    assert "None" not in re.sub(r"None: every|None of the states", "", text)
    assert not re.search(r"\bnan\b|\binf\b|Missing\(|&lt;|StrEnum", text)
    return text


@pytest.mark.parametrize("case", CASES)
def test_reports_are_valid_complete_and_self_contained(reports, case):
    folder, assessment, page = reports(case)
    text = check(page)
    assert len(page) < 3e6
    assert text.count("SIMULATED Simulated impacts") == assessment.simulated
    assert ("SIMULATED" in text) == assessment.simulated
    assert ('content: "SIMULATED"' in page) == assessment.simulated  # at the foot of every printed page
    for line in sentences(assessment.findings):
        assert line in text
    listed = inputs_list(assessment.inputs).splitlines()
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and path.name not in ("truth.csv", MEMORY_FILE))
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(folder)}" for path in paths]
    assert sorted(listed) == sorted(lines)
    digest = hashlib.sha256("".join(sorted(f"{line}\n" for line in listed)).encode()).hexdigest()
    assert page.count(digest) == 3  # for programs, on the page that is signed, in the annex


def test_missing_entries_are_shown_as_missing(reports):
    rows = dict(facts(reports("bare")[2], "robot"))
    assert rows.pop("Device range") == "500 N"
    assert rows.pop("Device error") == "3 N"
    assert rows.pop("Device stiffness") == "75000 N/m"
    assert rows.pop("Speed at contact") in ("commanded", "missing")
    assert set(rows.values()) == {"missing"}, rows
    assert "Robot: missing" in reports("bare")[2]


def test_saturated_recordings_give_no_speed(reports):
    _, assessment, page = reports("saturated")
    assert [cells[2] for cells in rows(page, "answer")] == ["NO PERMISSION", "NO PERMISSION"]
    assert "m/s, there, between" not in page
    assert rows(page, "verdicts")[0][1:] == ["27 states", "0 states", "0 states", "0 states"]
    assert page.count('<svg class="curve"') == len(assessment.states) == 27


def test_the_first_page_says_what_is_confirmed_and_what_is_not(reports):
    _, assessment, page = reports("demo")
    answers = rows(page, "answer")
    assert [cells[0] for cells in answers] == [
        "back of hand, transient", "back of hand, quasi-static", "temple, transient", "temple, quasi-static",
    ]  # fmt: skip
    found = assessment.speeds[0]
    there = f"{fm.floor_speed(found.of_table[0])} to {fm.floor_speed(found.of_table[1])} m/s"
    program = f"{fm.floor_speed(found.slowest_to_program)} to {fm.floor_speed(found.fastest_to_program)} m/s"
    off = found.off_axis.speeds.speed_to_program
    lowest, highest = fm.floor_speed(np.nanmin(off)), fm.floor_speed(np.nanmax(off))
    off_axis = f"up to 5 degrees off the direction: {lowest} to {highest} m/s at {int((off > 0).sum())} of them"
    assert highest < fm.floor_speed(found.fastest_to_program)
    assert answers[0][1] == "280 N"
    assert answers[0][2].startswith(f"PERMITTED BY THE MAP at {found.confirmed} of ")
    assert answers[0][3] == f"{program} ({there}) {off_axis}"
    assert answers[0][4].startswith("0.263 m/s")
    assert [cells[2] for cells in answers[1:]] == ["NO PERMISSION", "NOT PERMITTED", "NOT PERMITTED"]
    assert [cells[1] for cells in answers[2:]] == ["no contact", "no contact"]
    assert not any("m/s" in cells[3] for cells in answers[1:])


def test_the_lowest_and_the_highest_speed_hold_where_they_are_said_to(reports):
    folder, assessment, page = reports("demo")
    found, text = assessment.speeds[0], " ".join(re.sub(r"<[^>]+>", " ", page).split())
    places = found.slowest_place, found.fastest_place
    case = {"limit": found.limit, "contact": found.contact, "bound": fm.ToleranceBound()}
    at = fm.safe_speed(fm.fit_force_map(fm.read_dataset(folder)), *np.transpose(places), **case)
    np.testing.assert_allclose(at.speed_to_program, [found.slowest_to_program, found.fastest_to_program], rtol=1e-9)
    assert ("but not at each place (section 9)" in text) == assessment.force_map.form_test.misses
    (low, high), speeds = map(found.printed, places), [fm.floor_speed(speed) for speed in at.speed_to_program]
    for place in (found.printed(found.slowest_place), found.printed(found.fastest_place)):
        assert fm.safe_speed(fm.fit_force_map(fm.read_dataset(folder)), *place, **case).speed_to_program > 0
    slow = f"from {speeds[0]} m/s (near distance {low[0]:.3f} m, height {low[1]:.3f} m)"
    assert f"{slow} to {speeds[1]} m/s (near {high[0]:.3f} m, {high[1]:.3f} m)" in text


def test_numbers_are_those_of_the_library(reports):
    folder, _, page = reports("demo")
    dataset = fm.read_dataset(folder)
    force_map = fm.fit_force_map(dataset)
    bound, limit = fm.ToleranceBound(device_error=3.0), fm.force_limit("back_of_hand")
    coefficients = [row for row in rows(page, "map") if row[0] in force_map.form.term_names]
    assert [row[0] for row in coefficients] == list(force_map.form.term_names)
    assert [row[1] for row in coefficients] == [f"{value:.4f}" for value in force_map.coefficients]
    tables = parts(page, "speeds", "table")
    heads = [text_of(cell) for cell in tables[0].iterfind(".//thead/tr/th")][1:]
    compared = 0
    for row in tables[0].iterfind(".//tbody/tr"):
        height, *cells = [" ".join(text_of(cell).split()) for cell in row]
        for distance, cell in zip(heads, cells, strict=True):
            place = float(distance), float(height)
            answer = fm.safe_speed(force_map, *place, limit=limit, bound=bound, contact=fm.Contact.TRANSIENT)
            off = fm.safe_speed(
                force_map, *place, limit=limit, bound=bound, contact=fm.Contact.TRANSIENT, angle=5.0
            ).speed_to_program
            off = "–" if np.isnan(off) else fm.floor_speed(off)
            speed = f"{fm.floor_speed(answer.speed_to_program)}({fm.floor_speed(answer.speed)})"
            outcome = answer.to_program_outcome
            shown = {"admissible": f"{speed}{off}", "capped": f"{speed}capped{off}", "unconfirmed": "nospeed"}
            expected = shown.get(outcome, outcome)
            assert cell.replace(" ", "") == expected
            compared += 1
    assert compared >= 49
    states = {row[0]: row for row in rows(page, "states")}
    for i in range(0, len(dataset.states), 13):
        state = states[dataset.states.name[i]]
        assert state[3] == fm.floor_speed(dataset.states.speed[i])
        assert state[6] == ("–" if np.isnan(dataset.states.force[i]) else f"{dataset.states.force[i]:.1f}")
    accuracy = fm.map_accuracy(force_map, dataset)[0]
    (row,) = [row for row in rows(page, "map") if row[0] == accuracy.on]
    assert row[2].startswith(f"{accuracy.max_underestimation_percent:.2f} %")
    compared = fm.assess_campaign(folder, limits=[limit]).comparisons[0].models
    body = parts(page, "standard", "tbody")[0]
    standard = {text_of(row[0]): [text_of(cell) for cell in row[1:6]] for row in body.iter("tr")}
    for model in compared:
        for name, of in ((model.model, model.accuracy), (f"{model.model}, all states", model.on_all)):
            errors = (of.max_underestimation_percent, of.mean_underestimation_percent)
            errors += (of.max_overestimation_percent, of.mean_overestimation_percent)
            assert standard[name] == [str(of.states), *(f"{error:.1f} %" for error in errors)]


def test_assumptions_stand_beside_every_speed(reports):
    _, assessment, page = reports("demo")
    (speeds,) = parts(page, "speeds", None)
    text = " ".join(text_of(speeds).split())
    shown = [each for each in assessment.speeds if not isinstance(each.speeds, Missing)]
    assert len(shown) == 2
    assert any(not each.confirmed for each in shown)
    for each in shown:
        if each.confirmed:
            for line in sentences(each.speeds.speeds.basis.statements):
                assert line in text
        else:
            assert f"No speed to program at any of {each.unconfirmed} places" in text
    assert text.count("These speeds hold only under all of this") == sum(bool(each.confirmed) for each in shown)
    assert len(list(speeds.iter("table"))) == sum(bool(each.confirmed) for each in shown)


@pytest.mark.parametrize(
    "text", [EVIL, "a\u202eb\x7fc", "ﷺ {{ 7*7 }} {% raw %} ${x}"], ids=["tags", "controls", "braces"]
)
def test_texts_of_files_are_escaped(tmp_path, text):
    folder = tmp_path / "<i>cell & more"
    write_campaign(folder, recorded=False)
    entry = text.replace("\\", "\\\\").replace('"', '\\"').replace("\u202e", "\\u202E").replace("\x7f", "\\u007F")
    toml = "".join(
        f'[{section}]\n{key} = "{entry}"\n'
        for section, key in (("robot", "model"), ("tool", "name"), ("contact", "site"), ("standard", "edition"))
    )
    head, _, device = TOML.partition("[device]")
    (folder / "campaign.toml").write_text(f'{head}operator = "{entry}"\nnote = "{entry}"\n{toml}[device]{device}')
    save(folder / "recordings" / "<script>alert(2)<&.csv", *pulse(99.0))
    page = report_html(fm.assess_campaign(folder), date=DATE)
    found = Reader(page)
    tree_of(page)
    assert "script" not in found.tags
    assert "evil" not in found.ids
    assert not re.search("[\u202a-\u202e\x00-\x08\x0b\x0c\x0e-\x1f\x7f]", page)
    shown = text.replace("\u202e", "\ufffd").replace("\x7f", "\ufffd")
    assert dict(facts(page, "document"))["Measured by"] == shown
    assert dict(facts(page, "robot"))["Tool"] == shown
    assert "<script>alert(2)<&.csv" in "".join(found.text)


def test_page_one_says_from_where_each_height_has_speeds_where_a_box_around_those_without_tells_nothing(reports):
    folder, found, _ = reports("demo")
    case = {"limit": fm.force_limit("abdomen"), "contact": fm.Contact.TRANSIENT, "bound": found.bound}
    speeds = fm.speed_map(found.force_map, *fm.measured_grid(found.force_map, 0.05), **case, allowance=fm.Allowance())
    given = ~np.isnan(speeds.speeds.speed_to_program)
    assert (np.diff(given.astype(int), axis=0) >= 0).all()  # once there is one, there are some to the far end
    again = fm.assess_campaign(folder, limits=[case["limit"]])
    (results,) = (each for each in again.speeds if each.contact is fm.Contact.TRANSIENT)
    said = nowhere([headline(results)])[-1]
    begins = {float(h): float(d) for d, h in re.findall(r"([\d.]+) m \(h ([\d.]+) m\)", said)}
    firsts = {round(h, 2): round(speeds.distance[given[:, j].argmax()], 2)
              for j, h in enumerate(speeds.height.tolist()) if given[:, j].any()}  # fmt: skip
    assert begins == firsts
    assert said.endswith("on, at other heights none") is (len(firsts) < speeds.height.size)


def test_page_one_says_in_metres_where_there_is_no_speed(reports):
    _, found, page = reports("demo")
    force_map = found.force_map
    limit, contact = fm.force_limit("back_of_hand"), fm.Contact.TRANSIENT
    axes = fm.measured_grid(force_map, 0.05)
    case = {"limit": limit, "contact": contact, "bound": found.bound, "allowance": fm.Allowance()}
    speeds = fm.speed_map(force_map, *axes, **case).speeds.speed_to_program
    said = " ".join(text_of(parts(page, "answer", None)[0]).split())
    pattern = (
        r"back of hand, transient: (\d+) of 49 places and around them, all in d ([\d.]+) to ([\d.]+) m, "
        r"h ([\d.]+) to ([\d.]+) m \(others in there have a speed\) \(why: section 13\)"
    )
    none, near, far, low, high = map(float, re.search(pattern, said).groups())
    assert none == np.isnan(speeds).sum()
    fine = fm.speed_map(force_map, *fm.measured_grid(force_map, 0.003), **case)
    without = np.isnan(fine.speeds.speed_to_program) & (fine.speeds.outcome != fm.SpeedOutcome.OUTSIDE)
    i, j = np.nonzero(without)
    assert len(i) > 1000
    program = fine.speeds.speed_to_program
    answer = next(cells[3] for cells in rows(page, "answer") if "transient" in cells[0])
    slowest, fastest = map(float, re.match(r"([\d.]+) to ([\d.]+) m/s", answer).groups())
    assert slowest == pytest.approx(np.nanmin(program), abs=0.0025)
    assert fastest == pytest.approx(np.nanmax(program), abs=0.0015)
    assert near <= fine.distance[i].min() < near + 0.01
    assert far - 0.015 < fine.distance[i].max() <= far
    assert low <= fine.height[j].min() < low + 0.01
    assert high - 0.015 < fine.height[j].max() <= high
    for beside in np.linspace(0.52, 0.89, 40):
        answer = fm.safe_speed(force_map, beside, np.linspace(high + 1e-4, 0.46, 20), **case)
        assert not np.isnan(answer.speed_to_program).any()
    for above in np.linspace(0.14, 0.46, 40):
        answer = fm.safe_speed(force_map, np.linspace(far + 1e-4, 0.89, 20), above, **case)
        assert not np.isnan(answer.speed_to_program).any()
    assert "for places 5 cm apart (between them and at the edge: forcemap speed)" in said
    lowest, highest = force_map.measured_range.lowest, force_map.measured_range.highest
    within = f"within d {lowest[0]:.3f} to {highest[0]:.3f} m, h {lowest[1]:.3f} to {highest[1]:.3f} m"
    assert f"No permission: outside the measured range ({within});" in said
    assert "h: height above the base, not the floor" in said
    assert "SLOW IMPACTS ARE MISSING: motion below 0.200 m/s, as at every start and stop" in page
    assert "the standard itself was not opened" in said
    (safe,) = parts(page, "speeds", None)
    assert (
        "A robot program made by forcemap export has lower speeds than these tables, and at fewer places"
        in " ".join(text_of(safe).split())
    )


def test_places_without_a_speed_between_those_that_all_have_one_are_named(reports):
    """And no place that the tables name without a speed is missed by the finer grid of the box."""
    _, found, _ = reports("demo")
    results = next(part for part in found.speeds if (part.limit.name, part.contact) == ("back_of_hand", "transient"))
    (near, far), (low, high) = results.open_box
    for group in results.open_places:
        d, h = np.array(group.places).T
        assert near <= d.min() <= d.max() <= far
        assert low <= h.min() <= h.max() <= high
    line = headline(results) | {"kind": "confirmed", "places": 39, "results": replace(results, open_places=())}
    (said,) = nowhere([line])
    between = (
        r"back of hand, transient: between the 39 places, all in d 0.520 to [\d.]+ m, h .* m \(others in there.*\)"
    )
    assert re.fullmatch(between, said)
    at_all = fm.speed_map(found.force_map, [0.8, 0.85], [0.35, 0.4], limit=results.limit, contact=results.contact,
                          bound=found.bound, allowance=fm.Allowance())  # fmt: skip
    everywhere = headline(replace(results, speeds=at_all, open_places=()))
    assert everywhere["word"] == "PERMITTED BY THE MAP at 4 of 4 places, not everywhere between them"
    fine = replace(results.speeds, speeds=replace(results.speeds.speeds, to_program_outcome=np.full((7, 7), "x")))
    hole = OpenPlaces("why", ((0.7, 0.3),))  # smaller than the fine grid sees
    (near, far), (low, high) = _open_box(fine, (hole,))
    assert near < 0.7 < far
    assert low < 0.3 < high
    assert _open_box(fine, ()) is None


def test_every_reason_why_a_place_has_no_speed_stands_in_the_report(reports):
    """Those of places between the ones of its tables, too."""
    _, found, page = reports("demo")
    results = next(part for part in found.speeds if (part.limit.name, part.contact) == ("back_of_hand", "transient"))
    places = np.random.default_rng(3).uniform([0.52, 0.14], [0.89, 0.46], (2000, 2)).T
    case = {"limit": results.limit, "contact": results.contact, "bound": found.bound, "allowance": fm.Allowance()}
    answer = fm.safe_speed(found.force_map, *places, **case)
    kinds = {reason.kind for reason in answer.to_program_reason[np.isnan(answer.speed_to_program)]}
    said = {group.reason.kind for group in results.open_places}
    between = {reason.kind: reason for reason in results.open_between}
    assert said < kinds == said | set(between)
    (section,) = parts(page, "open", None)
    shown = " ".join(text_of(section).split())
    for reason in between.values():
        assert f"between these places also: {sentence(reason)}" in shown


def test_the_same_inputs_give_the_same_bytes(reports, tmp_path):
    """In another place, at another time, in another process with another order of hashing; all but the date."""
    folder, _, page = reports("bare")
    shutil.copytree(folder, tmp_path / "elsewhere" / "bare")
    code = (
        "import sys, forcemap as fm\nfrom forcemap.report import report_html\n"
        f"sys.stdout.write(report_html(fm.assess_campaign(sys.argv[1]), date={DATE!r}))"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "7", "SOURCE_DATE_EPOCH": "1", "TZ": "Asia/Tokyo"}
    command = [sys.executable, "-c", code, str(tmp_path / "elsewhere" / "bare")]
    other = subprocess.run(command, env=environment, capture_output=True, check=True).stdout.decode()
    assert other == page


def test_only_the_stated_date_differs(reports):
    _, assessment, page = reports("saturated")
    other = report_html(assessment, date="2027-01-05")
    own = re.compile(r'(?<=forcemap-report-sha256" content=")[0-9a-f]{64}')
    assert own.sub("", other) == own.sub("", page).replace(DATE, "2027-01-05")
    assert other != page


@pytest.mark.parametrize("date", ["21.11.2026", "2026-02-30", "2026-1-5", "today", "<b>", "2026-11-21\n"])
def test_a_date_that_is_none(reports, date):
    with pytest.raises(fm.InputError, match="expected YYYY-MM-DD"):
        report_html(reports("plan")[1], date=date)


@pytest.fixture
def written(reports, tmp_path):
    """A campaign with its report."""
    folder = shutil.copytree(reports("saturated")[0], tmp_path / "cell")
    (folder / "report.html").write_text(reports("saturated")[2])
    (folder / "report.sha256").write_text(inputs_list(reports("saturated")[1].inputs))
    return folder


def test_verify_says_what_changed(written, ask, forcemap):
    verify = ("report", "--verify", written / "report.html", written)
    code, found = ask(*verify)
    assert code == 0
    assert found["holds"]
    assert found["report_intact"]
    assert (found["changed"], found["vanished"], found["new"]) == ([], [], [])
    assert found["unchanged"] == 27 + 4
    assert found["date"] == DATE
    assert found["digest"] == found["digest_now"]
    assert found["digest"] in "".join(forcemap(*verify)[1].split())
    (written / "speeds-transient.csv").write_text("speed_mps\n0.4\n")  # a result, on which the report does not rest
    assert ask(*verify)[1]["not_compared"] == ["speeds-transient.csv"]
    out = forcemap(*verify)[1]
    first = " ".join(out.split("Report of")[0].split())
    said = "the report and its 31 input files are as they were when it was written"
    assert first == f"Unchanged: {said}; 1 other file of the folder not compared"
    assert "Not compared, as the report does not list them among its inputs\n  - speeds-transient.csv\n" in out
    (written / "impacts.csv").write_text((written / "impacts.csv").read_text() + "\n")
    (written / "recordings" / "d500-h200-v100-r1.csv").unlink()
    save(written / "recordings" / "more.csv", *pulse())
    code, found = ask(*verify)
    assert code == 1
    assert not found["holds"]
    assert found["changed"] == ["impacts.csv"]
    assert found["vanished"] == ["recordings/d500-h200-v100-r1.csv"]
    assert found["new"] == ["recordings/more.csv"]
    assert found["digest"] != found["digest_now"]
    _, out, _ = forcemap(*verify)
    for line in (
        "CHANGED since the report was written: input files; do not sign it",
        "\nChanged\n",
        "\nVanished\n",
        "\nNew\n",
        "impacts.csv",
    ):
        assert line in out


@pytest.mark.parametrize(
    ("old", "new"),
    [("NO PERMISSION", "CONFIRMED"), ("27 states", "0 states"), ('content="forcemap 0', 'content="forcemap 9'),
     ("</body>", "<p>0.9 m/s</p></body>"), ("Document and signatures", "Document, signed")],
)  # fmt: skip
def test_verify_finds_an_altered_report(written, ask, forcemap, old, new):
    report = written / "report.html"
    page = report.read_text()
    assert old in page
    report.write_text(page.replace(old, new, 1))
    code, found = ask("report", "--verify", report, written)
    assert code == 1
    assert not found["report_intact"]
    out = forcemap("report", "--verify", report, written)[1]
    assert "ALTERED" in out
    assert "do not sign it; keep this file" in out
    require_kept(written, forcemap, "this report was ALTERED")


def require_kept(folder, forcemap, words):
    """A report and its list stay as they are, and it is said why."""
    before = [(folder / name).read_bytes() for name in ("report.html", "report.sha256")]
    for more in ((), ("--bound", "margin")):  # one that answers for less would be refused anyway
        code, _, err = forcemap("report", folder, *HAND, *more)
        assert code == 2
        assert words in err
        assert "not replaced" in err
    assert [(folder / name).read_bytes() for name in ("report.html", "report.sha256")] == before


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b'-sha256" content="', b'-sha256" content="0'),
        (b"forcemap-report-sha256", b"forcemap-report-sha"),
        (b"</body>", b"\xff</body>"),
        (b'content="forcemap-report/1"', b'content="forcemap-report/0"'),
    ],
)
def test_an_altered_report_whose_seal_is_damaged_is_not_replaced(written, forcemap, old, new):
    report = written / "report.html"
    page = report.read_bytes()
    assert old in page
    report.write_bytes(page.replace(old, new, 1))
    require_kept(written, forcemap, "this report was ALTERED")
    code, out, err = forcemap("report", "--verify", report, written)
    assert code
    assert "write it again" not in out + err


def test_a_report_whose_list_was_altered_is_not_replaced(written, ask, forcemap):
    listed = written / "report.sha256"
    listed.write_text(listed.read_text().replace("impacts.csv", "impact.csv"))
    require_kept(written, forcemap, "the list of inputs beside this report (report.sha256) was ALTERED")
    verify = ("report", "--verify", written / "report.html", written)
    assert ask(*verify)[1]["list_altered"]
    assert "written: the list of its inputs; do not sign" in " ".join(forcemap(*verify)[1].split())
    (written / "campaign.toml").write_text((written / "campaign.toml").read_text() + "\n")
    assert "written: the list of its inputs, input files; do not" in " ".join(forcemap(*verify)[1].split())


def test_a_list_is_not_replaced_by_that_of_another_page(written, forcemap):
    listed = written / "report.sha256"
    before = listed.read_bytes()
    for name in ("report.htm", "report.HTML"):
        code, _, err = forcemap("report", written, *HAND, "-o", written / name)
        assert (code, "report.sha256: this is the list of report.html; choose another name" in err) == (2, True)
    assert listed.read_bytes() == before
    listed.write_bytes(b"junk\n" + before)
    require_kept(written, forcemap, "move it and report.sha256 away and keep both")


@pytest.mark.parametrize("place", ["limits/own.csv", "own.CSV", "named"])
def test_a_table_of_limits_anywhere_in_the_folder_is_an_input(written, ask, place):
    table = written / ("own.csv" if place == "named" else place)
    table.parent.mkdir(exist_ok=True)
    columns = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor\n"
    table.write_text(f"# edition: own\n# source: own\n# version: 1\n{columns}own,own,own,200,150,2\n")
    if place == "named":  # by campaign.toml, but a file that is not there
        stated = written / "campaign.toml"
        stated.write_text(stated.read_text() + '\n[standard]\nlimit_table = "gone.csv"\n')
    for name in ("report.html", "report.sha256"):
        (written / name).unlink()
    assert ask("report", written, "--area", "own", "--limit-table", table)[0] == 0
    verify = ("report", "--verify", written / "report.html", written)
    assert ask(*verify)[1]["tables_not_compared"] == []
    table.write_text(table.read_text().replace("150", "200"))
    assert ask(*verify)[1]["changed"] == [table.relative_to(written).as_posix()]


def test_a_table_of_limits_that_was_given_is_compared(written, tmp_path, ask, forcemap):
    """In the folder it is an input; elsewhere the report cannot be told unchanged."""
    table = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor\n"
    table = f"# edition: own\n# source: own\n# version: 1\n{table}own,own,own,200,150,2\n"
    for place in (written, tmp_path):
        (place / "own-limits.csv").write_text(table)
        for name in ("report.html", "report.sha256"):
            (written / name).unlink(missing_ok=True)
        assert ask("report", written, "--area", "own", "--limit-table", place / "own-limits.csv")[0] == 0
        verify = ("report", "--verify", written / "report.html", written)
        if place is written:
            assert ask(*verify)[0] == 0
            (place / "own-limits.csv").write_text(table.replace("150", "100"))
            code, found = ask(*verify)
            assert (code, found["changed"]) == (1, ["own-limits.csv"])
            (place / "own-limits.csv").unlink()
            assert ask(*verify)[1]["vanished"] == ["own-limits.csv"]
    digits = sha256(table)[:12]
    code, found = ask(*verify)
    assert (code, found["holds"], found["tables_not_compared"]) == (2, False, [digits])
    assert f"CANNOT TELL whether all is as when the report was written: its table of limits (SHA-256 {digits}" in (
        " ".join(forcemap(*verify)[1].split())
    )


@pytest.mark.parametrize(
    "stated",
    ["", "hand_fingers (ISO/TS 15066:2016, Annex A, 3f), no bound", '"hand"', "[]", '["hand", "b"]',
     '[["hand", 1], "b"]',
     '[["hand"], 1]', '[["hand"], "b", "c"]', '[[["hand"]], "b"]', '{"areas": 1, "bound": 2}', "[" * 9999],
)  # fmt: skip
def test_a_report_that_does_not_state_what_it_answers_for_is_not_replaced(written, forcemap, stated):
    assert MadeFor.read(stated) == MadeFor()
    page = (written / "report.html").read_text()
    own = re.search(r'<meta name="forcemap-limits" content="([^"]*)">', page)[1]
    assert MadeFor.read(html.unescape(own)).areas
    assert forcemap("report", written, *HAND)[0] == 0
    (written / "report.html").write_text(page.replace(own, html.escape(stated), 1))
    code, _, err = forcemap("report", written, *HAND)
    assert code == 2
    assert "made for what it does not state" in err


def test_a_name_may_look_like_the_text_around_it():
    for name in ("a), b", '"], "c', "d\\", "\n"):
        made_for = MadeFor((f"hand ({name}, 3f)", "palm (x, 4e)"), name)
        assert MadeFor.read(made_for.text) == made_for


def test_verify_survives_changed_line_ends(written, ask):
    """Mail turns LF into CRLF, and may end a text with an empty line: of the report, the list, and tables."""
    verify = ("report", "--verify", written / "report.html", written)
    for name in ("report.html", "report.sha256", "impacts.csv", "campaign.toml"):
        text = (written / name).read_bytes()
        (written / name).write_bytes(text.replace(b"\n", b"\r\n") + (b"\r\n" if name == "report.html" else b""))
    code, found = ask(*verify)
    assert code == 0
    assert found["report_intact"]
    assert found["listed"]
    assert sorted(found["line_ends"]) == ["campaign.toml", "impacts.csv"]
    assert found["changed"] == []
    curve = written / "recordings" / "d500-h200-v100-r1.csv"
    curve.write_bytes(curve.read_bytes().replace(b"0", b"1", 1))
    code, found = ask(*verify)
    assert code == 1
    assert found["changed"] == ["recordings/d500-h200-v100-r1.csv"]


def test_verify_by_the_digest_alone_and_with_another_list(written, ask):
    verify = ("report", "--verify", written / "report.html", written)
    text = (written / "report.sha256").read_text()
    (written / "report.sha256").write_text(text.replace("0", "1", 1))
    code, found = ask(*verify)
    assert code == 1
    assert found["list_altered"]
    (written / "report.sha256").unlink()
    code, found = ask(*verify)
    assert code == 0
    assert not found["listed"]
    assert found["unchanged"] == 27 + 4
    save(written / "recordings" / "more.csv", *pulse())
    code, found = ask(*verify)
    assert code == 1
    assert not found["inputs_hold"]
    (written / "report.sha256").write_text("my notes\n")
    code, found = ask("report", written, *HAND)
    assert code == 2
    assert (written / "report.sha256").read_text() == "my notes\n"


def test_the_list_is_one_that_other_tools_check(written):
    check = ["sha256sum", "-c", "--quiet", "report.sha256"]
    if shutil.which("sha256sum") is None:
        pytest.skip("needs sha256sum")
    assert subprocess.run(check, cwd=written, capture_output=True).returncode == 0
    (written / "impacts.csv").write_text("other")
    assert subprocess.run(check, cwd=written, capture_output=True).returncode != 0


@pytest.mark.parametrize("name", ["report.pdf", "printed.html"])
@pytest.mark.parametrize("listed", [True, False])
def test_a_pdf_is_checked_by_the_digest_of_the_folder(written, ask, name, listed):
    digest = ask("report", "--verify", written / "report.html", written)[1]["digest"]
    assert digest in re.sub(r"<.*?>", "", (written / "report.html").read_text())
    (written / name).write_bytes(b"%PDF-1.7\n\xff")
    if not listed:
        (written / "report.sha256").unlink()
    code, found = ask("report", "--verify", written / name, written)
    assert code == 2
    assert f"page 1 with this one, of the folder as it is now: {digest}" in found["error"]["message"]
    (written / "impacts.csv").write_text("other")
    assert digest not in ask("report", "--verify", written / name, written)[1]["error"]["message"]


def test_verify_that_cannot_tell(written, ask):
    (written / "note.html").write_text("<!DOCTYPE html><title>note</title>")
    page = (written / "report.html").read_text()
    (written / "unsealed.html").write_text(re.sub(r'<meta name="forcemap-report-sha256".*?>', "", page))
    for name in ("note.html", "unsealed.html", "nothing.html"):
        code, found = ask("report", "--verify", written / name, written)
        assert code == 2, name
        assert found["error"]["file"].endswith(name)
    assert ask("report", "--verify", written / "report.html", written / "nowhere")[0] == 2
    assert ask("report", "--verify", written / "report.html", written, "--date", DATE)[0] == 2


def test_the_command_writes_report_and_list_and_changes_nothing_else(reports, ask, tmp_path):
    folder = shutil.copytree(reports("saturated")[0], tmp_path / "cell")
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    code, found = ask("report", folder, *HAND, "--date", DATE)
    assert code == 0
    assert found["files"] == [str(folder / "report.html"), str(folder / "report.sha256")]
    assert {each["outcome"] for each in found["speeds"]} == {"unconfirmed"}
    assert "force_map" in found["missing"]
    after = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert after.keys() - before.keys() == {folder / "report.html", folder / "report.sha256"}
    assert {path: after[path] for path in before} == before
    first = (folder / "report.html").read_bytes()
    assert ask("report", folder, *HAND, "--date", DATE)[0] == 0
    assert (folder / "report.html").read_bytes() == first


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("-o", "impacts.csv"), "expected .html"),
        ((), "expected --area"),
        ((*HAND, "-o", "mine.html"), "not overwritten"),
        ((*HAND, "--date", "soon"), "YYYY-MM-DD"),
        (("--area", "hnad"), "nearest"),
        ((*HAND, "--margin", 0.1), "--bound margin"),
        (("--bound", "margin", "--confidence", 0.9), "--bound tolerance"),
        (("--limit-table", "mine.csv"), "goes with --area"),
        ((*HAND, "--step-m", 0), "step"),
    ],
)
def test_errors_are_one_line(reports, ask, monkeypatch, tmp_path, arguments, part):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.html").write_text("my page")
    code, found = ask("report", reports("plan")[0], *arguments)
    assert code == 2
    assert part in found["error"]["message"]
    assert (tmp_path / "mine.html").read_text() == "my page"
    assert os.listdir(tmp_path) == ["mine.html"]


def pdf_of(page):
    try:
        return report_pdf(page)
    except MissingExtra as error:
        pytest.skip(str(error))


def test_the_pdf_is_the_same_page(reports, full_size):
    page = reports("bare" if full_size else "saturated")[2]
    pages = pypdf.PdfReader(io.BytesIO(pdf_of(page))).pages
    texts = [" ".join(each.extract_text().split()) for each in pages]
    assert "Verdict" in texts[0]
    assert "An estimate from measurements, not a certificate" in texts[0]
    for i, text in enumerate(texts, start=1):
        assert f"Page {i} of {len(texts)}" in text
    whole = " ".join(texts)
    for title in re.findall(r"<h2>(\d+ .*?|Annex.*?)</h2>", page):
        assert title in whole
    width, height = (float(side) for side in pages[0].mediabox[2:])
    assert (width, height) == pytest.approx((595.3, 841.9), abs=0.5)


def test_the_pdf_fetches_nothing(reports, tmp_path):
    """A page with references, as no report has them: neither a file nor an address is opened."""
    secret = tmp_path / "secret.css"
    secret.write_text("body::before { content: 'SECRET' }")
    page = reports("plan")[2].replace("</title>", f'</title><link rel="stylesheet" href="file://{secret}">', 1)
    text = "".join(each.extract_text() for each in pypdf.PdfReader(io.BytesIO(pdf_of(page))).pages)
    assert "SECRET" not in text


def test_many_recordings(reports, tmp_path, full_size):
    """2,025 recordings at full size: below 15 MB."""
    page = reports("bare")[2]
    if full_size:
        write_campaign(tmp_path / "many", repeats=75)
        collect(tmp_path / "many")
        page = report_html(fm.assess_campaign(tmp_path / "many"), date=DATE)
        check(page)
    recordings = 27 * (75 if full_size else 2)
    print(f"{recordings} recordings: {len(page.encode()) / 1e6:.1f} MB")
    assert page.count("<polyline") == recordings
    assert len(page.encode()) < (15e6 if full_size else 3e6)


def text_of(element):
    return "".join(element.itertext()).strip()


@functools.cache
def tree_of(page):
    """The elements of a page; fails where it is not valid."""
    return html5lib.HTMLParser(strict=True, namespaceHTMLElements=False).parse(page)


def parts(page, section, tag):
    """The elements of a tag within a section; the section itself for None."""
    (found,) = tree_of(page).iterfind(f".//section[@id='{section}']")
    return [found] if tag is None else list(found.iter(tag))


def rows(page, section):
    """The cells of every row of the bodies of tables."""
    bodies = parts(page, section, "tbody")
    return [[" ".join(text_of(cell).split()) for cell in row] for body in bodies for row in body.iter("tr")]


def facts(page, section):
    """Name and value of a table of facts."""
    return [(text_of(row[0]), text_of(row[1])) for row in parts(page, section, "tr") if len(row) == 2]


def test_a_pdf_of_an_earlier_report_is_named(tmp_path, forcemap):
    """It lies beside the new report under its name: somebody might sign it."""
    folder = fm.copy_example("ur10e", tmp_path / "cell")
    (folder / "report.pdf").write_bytes(b"%PDF-1.7 of an earlier report")
    said = " ".join(forcemap("report", folder, "--area", "chest")[1].split())
    assert f"{folder / 'report.pdf'}: of an earlier report, not of this one; --pdf writes it again" in said
    (folder / "report.pdf").unlink()
    assert "earlier report" not in forcemap("report", folder, "--area", "chest")[1]
