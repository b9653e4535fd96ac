"""The report's first page and the sheets of contact points: what is permitted, photographs, print, many points."""

from __future__ import annotations

import dataclasses
import io
import re
import shlex
import shutil
import time
from pathlib import Path

import numpy as np
import pypdf
import pytest
from PIL import Image, ImageFile

import forcemap as fm
from forcemap.assessment.point_results import PointOutcome
from forcemap.campaigns.not_stated import Matters
from forcemap.errors import InputError, MissingExtra
from forcemap.findings import in_words
from forcemap.report import inputs_list, report_html, report_pdf
from forcemap.report.curves import Curve, force_curves, highest_force
from forcemap.report.permission import cell_words
from forcemap.report.photographs import reencoded
from pulses import collect
from test_contact_points import PLACE, POINT, of_point, registered_points, write_list
from test_report import DATE, Reader, check, facts, parts, rows, text_of

MEASURED = {**POINT, **PLACE, "distance_m": "0.89", "height_m": "0.46", "rests_on": "measurements"}
POINTS = [
    {**POINT, **PLACE, "hazard": "H-1", "distance_to_m": "0.75", "photograph": "P1.jpg", "programmed_mps": "0.1"},
    {**POINT, **PLACE, "point_id": "P2", "distance_m": "0.85", "height_m": "0.42", "photograph": "P2.png"},
    {**MEASURED, "point_id": "P3", "recordings": "d890-h460-v200", "photograph": "none.jpg"},
    {**MEASURED, "point_id": "P4", "contact_site": "finger", "direction": "in", "recordings": "points/P1-*",
     "recorded_at_mps": "0.2", "remark": "<b>&"},
    {**MEASURED, "point_id": "P5", "direction": "out"},
]  # fmt: skip
PROTOCOL = """
[protocol]
document_number = "VAL-7"
revision = "B"
replaces = "VAL-7 A"
customer = "Works & Co"
signed_by = "Sam Officer"
checked_by = "C. Hecker"
"""


def photograph(path, size=(1600, 1200), seed=0, **options):
    """Noise, as no picture is harder to make small, with the place where it was taken in its metadata."""
    path.parent.mkdir(exist_ok=True)
    pixels = np.random.default_rng(seed).integers(0, 255, (size[1] // 8, size[0] // 8, 3), dtype=np.uint8)
    exif = Image.Exif()
    exif[0x010E] = "SECRET PLACE"
    exif[0x0112] = 6  # to be turned by 90 degrees
    Image.fromarray(pixels).resize(size).save(path, exif=exif, **options)


@pytest.fixture(scope="module")
def cell(tmp_path_factory, simulated):
    folder = shutil.copytree(simulated, tmp_path_factory.mktemp("sheets") / "cell")
    with (folder / "campaign.toml").open("a") as stream:
        stream.write("")
    text = (folder / "campaign.toml").read_text()
    (folder / "campaign.toml").write_text(text.partition("# Who measured what")[0] + PROTOCOL + "\n[recordings]"
                                          + text.partition("[recordings]")[2])  # fmt: skip
    write_list(folder, *POINTS)
    photograph(folder / "photographs" / "P1.jpg")
    Image.new("RGBA", (400, 300), (0, 0, 0, 0)).save(folder / "photographs" / "P2.png")
    of_point(folder, [200, 210, 205])
    for path in (folder / "points").iterdir():  # as the campaign's device writes its files
        lines = path.read_text().splitlines()[1:]
        cells = [line.split(",") for line in lines]
        head = (folder / "recordings").glob("*.csv").__next__().read_text().splitlines()
        start = next(i for i, line in enumerate(head) if line.startswith("time_ms"))
        body = "".join(f"{1000 * float(t):.3f};{f}\n" for t, f in cells)
        path.write_text("\n".join(head[: start + 1]).replace(",", ";") + "\n" + body)
    (folder / "point_recordings.csv").unlink()
    registered_points(folder)
    return folder


@pytest.fixture(scope="module")
def report(cell):
    found = fm.assess_campaign(cell)
    return found, report_html(found, date=DATE)


def words(element):
    return " ".join(text_of(element).split())


def test_the_first_page_names_what_is_not_permitted_and_holds_document_signatures_and_digest(report):
    _, page = report
    text = check(page)
    (answer,) = parts(page, "answer", None)
    assert "5 contact points: 2 confirmed; 2 permitted by the map; 1 not permitted" in words(answer)
    assert "NOT PERMITTED: P5 (not measured)" in words(answer)
    (signatures,) = parts(page, "signatures", None)
    said = words(signatures)
    assert "VAL-7, revision B, replaces VAL-7 A; customer Works & Co" in said
    for name in ("C. Hecker", "Sam Officer", "virtual impact lab"):
        assert name in said
    assert re.search(r"Digest of the \d+ input files ?[0-9a-f]{64}", said)
    lacking = [each.words for each in report[0].not_stated if each.matters is Matters.TRACE]
    assert f"{len(report[0].not_stated)} entries of the protocol; the {len(lacking)} that matter most: " in said
    assert ", ".join(lacking) + " (all: section 2)" in said
    assert "robot serial number" in said
    assert "have passed into ISO 10218-2:2025" in text


def test_every_permitting_sentence_names_point_limit_edition_device_and_who_signs(report):
    _, page = report
    sentences = [
        words(p) for section in ("answer", "sheets") for p in parts(page, section, "p") if "to be signed by" in words(p)
    ]
    joined = " ".join(sentences)
    for name in ("P1", "P2", "P3", "P4"):
        assert re.search(rf"Contact point {name}, back of hand, transient contact, within the limit of 280 N of ISO/TS "
                         rf"15066:2016.*?CBSF-75-Basic.*?75 N/mm.*?signed by Sam Officer", joined), name  # fmt: skip
    for sentence in re.findall(r"(?:Contact points?|At contact site) .*?to be signed by [^.]*\.", joined):
        for part in ("280 N", "ISO/TS 15066:2016", "CBSF-75-Basic", "Sam Officer"):
            assert part in sentence, (part, sentence)
    assert "Contact point P5" not in joined
    assert "Contact points P1 (program at most" in joined


@pytest.mark.parametrize(("contact", "levels"), [("transient", (280, 140)), ("quasi-static", (140, 140))])
def test_the_curves_of_a_point_are_drawn_with_the_limits_of_its_contact(contact, levels):
    hand, kind = fm.force_limit("back_of_hand"), fm.Contact(contact)
    curves = [Curve("a.csv", np.array([0.0, 0.02]), np.array([0.0, 100.0]))]
    drawn = force_curves(curves, hand, highest_force(curves, hand, kind), kind)
    start, then = re.search(r'd="M34 ([\d.]+)H\d+V([\d.]+)H', drawn).groups()
    (highest,) = re.findall(r'points="\d+,\d+ \d+,(\d+)"', drawn)
    per_newton = (100 - float(highest)) / 100
    np.testing.assert_allclose([100 - float(start), 100 - float(then)], np.multiply(levels, per_newton), atol=1.5)


def test_impacts_that_are_not_fitted_are_named_in_section_6(report):
    found, page = report
    (runs,) = parts(page, "runs", None)
    again, train = found.dataset.test, found.dataset.train
    assert len(found.dataset.independent_test) == 0 < len(again)
    said = f"{len(train)} are there to be fitted. Not fitted (role test) are {len(again)} that repeat"
    assert f"{said} {len(again.states)} states, to tell drift." in words(runs)
    fit = found.force_map.fit
    assert fit.samples + fit.censored_samples == len(train)


def test_the_verification_that_the_report_prints_runs_as_printed(report, cell, ask, tmp_path, monkeypatch):
    folder = shutil.copytree(cell, tmp_path / report[0].name)
    (folder / "report.html").write_text(report[1])
    (folder / "report.sha256").write_text(inputs_list(report[0].inputs))
    monkeypatch.chdir(tmp_path)
    (document,) = parts(report[1], "document", None)
    (printed,) = re.findall(r"forcemap (report --verify \S+/report\.html \S+) ", words(document))
    assert ask(*printed.split())[1]["report_intact"]


def test_a_report_of_another_name_prints_the_verification_of_itself(cell, ask, tmp_path, monkeypatch):
    folder = shutil.copytree(cell, tmp_path / "my cell")
    monkeypatch.chdir(tmp_path)
    for name in ("my cell/other.html", "other.html"):
        assert ask("report", folder, "-o", name)[0] == 0
        (document,) = parts(Path(name).read_text(), "document", None)
        (printed,) = re.findall(r"forcemap (report --verify .*?) \(with", words(document))
        code, found = ask(*shlex.split(printed))
        assert (code, found["holds"]) == (0, True)


def test_the_sheet_says_why_its_speed_is_lower_and_that_a_refused_point_is_not_permitted(cell, tmp_path):
    folder = shutil.copytree(cell, tmp_path / "cell")
    fast = {**POINT, **PLACE, "programmed_mps": "0.9"}
    write_list(folder, POINTS[0], {**fast, "point_id": "P6"})
    found = fm.assess_campaign(folder)
    page = report_html(found, date=DATE)
    sheet, refused = re.findall(r'<div class="sheet" id="point-\d">(.*?)Signature:', page, re.S)
    zone, place = found.points
    assert "within 5 mm around it: it may be lower than the table of safe speeds" in sheet
    assert f" permitted by the map up to {fm.floor_speed(zone.speed)} m/s" in re.sub(r"<.*?>", " ", sheet)
    assert "writes what to measure" in sheet
    assert "would be permitted" not in sheet
    assert f"would be permitted by the map up to {fm.floor_speed(place.program_at_most)} m/s to program" in refused
    assert dict(facts(page, "basis"))["Body areas"] == "those of the contact points (contact_points.csv)"
    alone = fm.assess_campaign(folder, limits=[fm.force_limit("back_of_hand")])
    assert alone.limits_chosen == found.limits_chosen
    assert fm.assess_campaign(folder, limits=[fm.force_limit("chest")]).limits_chosen == "given by the user"


def test_page_one_says_whether_the_cell_may_run_as_programmed(report):
    found, page = report
    assert "The cell may not run as programmed." in words(parts(page, "answer", None)[0])
    permitted = [each for each in found.points if not each.lacks]
    stated = [dataclasses.replace(each, point=dataclasses.replace(each.point, programmed=0.1)) for each in permitted]
    confirmed = [each for each in stated if each.outcome is PointOutcome.CONFIRMED]
    assert 0 < len(confirmed) < len(stated)

    def said(points, simulated=False, findings=()):
        return cell_words(dataclasses.replace(found, points=tuple(points), simulated=simulated, findings=findings))

    assert said(confirmed) == "At these contact points the cell may run as programmed."
    assert said(stated).endswith("may run as programmed once impacts confirm the map (forcemap confirm).")
    assert "if nothing under Read this first" in said(confirmed, findings=(in_words("x"),))
    assert said([]) == ""
    assert said(confirmed, simulated=True).endswith("does not follow: the impacts are simulated.")
    assert said([*confirmed, permitted[1]]).endswith("no programmed speed is stated for P2.")
    (sheets,) = parts(page, "sheets", None)
    assert "forcemap confirm with --area back_of_hand --contact transient" in words(sheets)


def test_the_sheets(report):
    found, page = report
    table = {cells[0]: cells for cells in rows(page, "sheets") if re.fullmatch(r"P\d", cells[0])}
    verdicts = ["permitted by the map"] * 2 + ["confirmed"] * 2 + ["not permitted"]
    assert [cells[5] for cells in table.values()] == verdicts
    assert [cells[7] for cells in table.values()] == [
        "–" if np.isnan(result.speed) else fm.floor_speed(result.speed) for result in found.points
    ]
    (sheets,) = parts(page, "sheets", None)
    said = words(sheets)
    assert said.count("Signature:") == 5
    assert said.count("Pressurenot assessed") == 5
    assert "P5: NOT PERMITTED" in said
    resting = [r.point for r in found.points if r.point.by_map]
    assert said.count("The map takes the device to stand fixed") == len(resting)
    assert said.count("the safe side for a body part that can give way") == sum(p.body == "free" for p in resting)
    assert "photograph none.jpg: there is no such file" in said
    assert "<b>&" in said
    assert len(parts(page, "sheets", "img")) == 2
    margins = [cells for cells in rows(page, "sheets") if cells[0].startswith("points/P1-1")]
    assert len(margins) == 1
    assert all("(within)" in cell for cell in margins[0][5:8])
    assert "SIMULATED" in said


def test_photographs_are_small_upright_and_without_metadata(report):
    _, page = report
    import base64

    data = re.findall(r'src="data:image/(\w+);base64,([^"]*)"', "".join(re.findall(r'class="photograph".*?>', page)))
    assert [kind for kind, _ in data] == ["jpeg", "png"]
    pictures = [Image.open(io.BytesIO(base64.b64decode(content))) for _, content in data]
    for (_, content), picture in zip(data, pictures, strict=True):
        assert len(content) < 90_000
        assert max(picture.size) <= 900
        assert not picture.getexif()
        assert b"SECRET" not in base64.b64decode(content)
    assert pictures[0].size[0] / pictures[0].size[1] == pytest.approx(3 / 4, abs=0.01)  # turned


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (b"", "no JPEG or PNG"),
        (b"<svg xmlns='http://www.w3.org/2000/svg'><script/></svg>", "no JPEG or PNG"),
        (b"GIF89a" + bytes(100), "no JPEG or PNG"),
        (b"\x89PNG\r\n\x1a\n" + bytes(100), "no JPEG or PNG"),
    ],
)
def test_what_is_no_photograph(content, part):
    with pytest.raises(InputError, match=part):
        reencoded(content, "a.png")


def test_damaged_and_huge_photographs(tmp_path, monkeypatch):
    photograph(tmp_path / "a" / "p.jpg")
    content = (tmp_path / "a" / "p.jpg").read_bytes()
    for lenient in (False, True):  # as it is once a PDF was made
        monkeypatch.setattr(ImageFile, "LOAD_TRUNCATED_IMAGES", lenient)
        with pytest.raises(InputError, match="no JPEG or PNG"):
            reencoded(content[: len(content) // 2], "p.jpg")
    stream = io.BytesIO()
    Image.new("1", (8000, 8000)).save(stream, "PNG")  # 64 million pixels in some kB
    with pytest.raises(InputError, match="million pixels"):
        reencoded(stream.getvalue(), "p.png")
    for mode in ("L", "P", "1", "CMYK"):
        stream = io.BytesIO()
        Image.new(mode, (30, 20)).save(stream, "JPEG" if mode == "CMYK" else "PNG")
        assert reencoded(stream.getvalue(), "p")[0] in ("image/png", "image/jpeg")


def test_verify_notices_photographs_sheets_and_tables(report, cell, ask, tmp_path):
    found, page = report
    folder = shutil.copytree(cell, tmp_path / "cell")
    (tmp_path / "r.html").write_text(page)
    (tmp_path / "r.sha256").write_text(inputs_list(found.inputs))
    verify = ("report", "--verify", tmp_path / "r.html", folder)
    assert ask(*verify)[0] == 0
    photograph(folder / "photographs" / "P1.jpg", seed=1)
    (folder / "photographs" / "P2.png").unlink()
    photograph(folder / "photographs" / "P9.jpg")
    (folder / "contact_points.csv").write_text((folder / "contact_points.csv").read_text().replace("H-1", "H-2"))
    (folder / "points" / "P1-1.csv").unlink()
    code, changes = ask(*verify)
    assert code == 1
    assert sorted(changes["changed"]) == ["contact_points.csv", "photographs/P1.jpg"]
    assert sorted(changes["vanished"]) == ["photographs/P2.png", "points/P1-1.csv"]
    assert changes["new"] == ["photographs/P9.jpg"]
    (tmp_path / "r.html").write_text(page.replace("P5: NOT PERMITTED", "P5: PERMITTED"))
    assert not ask(*verify)[1]["report_intact"]


def pdf_of(page):
    """The pages of a report as they are printed; drawings keep their places and stay empty: they take half the time."""
    page = re.sub(r"(<svg[^>]*>).*?</svg>", r"\1</svg>", page, flags=re.S)
    try:
        return pypdf.PdfReader(io.BytesIO(report_pdf(page))).pages
    except MissingExtra as error:
        pytest.skip(str(error))


def test_print_page_one_holds_the_signatures_for_three_body_areas(cell):
    limits = [fm.force_limit(name) for name in ("back_of_hand", "forearm_muscle", "sternum")]
    page = report_html(fm.assess_campaign(cell, limits=limits), date=DATE)
    first, next_page, _ = page.partition('<section id="sheets" class="fresh">')  # begins a page of its own
    assert next_page
    first = pdf_of(first)[0].extract_text()
    assert "Safety officer, releases" in first
    assert "Who signs confirms" in first


def test_print_page_one_is_whole_and_no_heading_is_left_alone(report):
    """The signed page holds verdict, signatures and digest; no page ends with a heading."""
    _, page = report
    pages = [[line.strip() for line in each.extract_text().splitlines() if line.strip()] for each in pdf_of(page)]
    first = " ".join(pages[0])
    for part in ("NOT PERMITTED: P5", "What it rests on", "Safety officer, releases", "Digest of the"):
        assert part in first, part
    headings = {" ".join(re.sub("<.*?>", "", text).split()) for text in re.findall(r"<h[234]>(.*?)</h[234]>", page)}
    for number, lines in enumerate(pages, start=1):
        body = [line for line in lines if line != "•" and "Page " not in line]
        assert body[-1] not in headings, (number, body[-1])


def report_of(demo):
    return (demo / "cell" / "forcemap-demo-2" / "report.html").read_text()


def test_the_demos_report_has_at_most_20_pages(demo):
    count = len(pdf_of(report_of(demo)))
    print(f"{count} pages")
    assert count <= 20


def test_many_points_with_photographs(cell, tmp_path, full_size):
    """300 at full size: below 60 s of processor time, on one thread, and 30 MB."""
    count = 300 if full_size else 6
    folder = shutil.copytree(cell, tmp_path / "cell")
    points = []
    for i in range(count):
        photograph(folder / "photographs" / f"Q{i}.jpg", seed=i, size=(4000, 3000) if full_size else (1600, 1200))
        points.append({**POINTS[i % 5], "point_id": f"Q{i}", "photograph": f"Q{i}.jpg"})
    write_list(folder, *points)
    started = time.process_time()
    page = report_html(fm.assess_campaign(folder), date=DATE)
    taken, size = time.process_time() - started, len(page.encode()) / 1e6
    print(f"{count} contact points: {taken:.1f} s of processor time, {size:.1f} MB")
    Reader(page)
    assert page.count('class="photograph"') == count
    assert size < 30 * max(count, 60) / 300
    assert taken < 60


def test_without_a_list_or_with_one_that_cannot_be_used(demo, simulated, tmp_path, forcemap):
    folder = shutil.copytree(simulated, tmp_path / "cell")
    assert "there is no list of contact points" in check(report_of(demo))
    (answer,) = parts(report_of(demo), "answer", None)
    assert "There is no list of contact points: this is about the map alone" in words(answer)
    (folder / "contact_points.csv").write_text("point_id\nP1\n")
    text = check(report_html(fm.assess_campaign(folder), date=DATE))
    assert "NO CONTACT POINT IS PERMITTED" in text
    assert "THE LIST OF CONTACT POINTS CANNOT BE USED" in text
    assert forcemap("report", folder, "--area", "back_of_hand")[0] == 1
    refused = forcemap("report", folder, "--area", "back_of_hand", "--bound", "margin")[2]
    assert "made for tolerance bound" in refused
    assert "back_of_hand" not in refused.partition("it is not replaced")[0]


def test_confirming_impacts_that_fail_take_all_speeds_away(tmp_path):
    from forcemap.campaigns.plan import write_plan
    from forcemap.planning.runs import extend_plan
    from pulses import pulse, save, write_campaign
    from test_contact_points import SITE, TOML

    folder = write_campaign(tmp_path / "cell", repeats=3, toml=TOML + SITE)
    dataset, plan, limit = collect(folder), fm.read_plan(folder), fm.force_limit("back_of_hand")
    asked = {"bound": fm.ToleranceBound(device_error=3.0), "contact": fm.Contact.TRANSIENT, "planned": plan}
    added = fm.confirm_plan(fm.fit_force_map(dataset), limit, **asked, recorded=set(dataset.state.tolist())).added
    write_plan(extend_plan(plan, added), folder)
    name = added.recording[0].item()
    save(folder / "recordings" / f"{name}.csv", *pulse(300.0, rate=1000.0))
    collect(folder)
    found = fm.assess_campaign(folder, limits=[limit])
    page = report_html(found, date=DATE)
    transient = found.speeds[0]
    assert transient.contradicted
    assert transient.confirmed == 0
    (speeds,) = parts(page, "speeds", None)
    before = words(speeds).split("quasi-static contact")[0]
    assert "the impacts that were to confirm the map for back of hand, transient contact, do not" in before
    assert not re.search(r"\d\.\d{3} \(", before)
