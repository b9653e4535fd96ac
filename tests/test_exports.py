"""Exported speeds: certified, looked up as they stand, with a head, and refusals that stay refusals."""

from __future__ import annotations

import csv
import hashlib
import io
import itertools
import json
import math
import re
import textwrap
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import forcemap as fm
from forcemap.exports.krl import krl_data, krl_source
from forcemap.exports.safety_proposal import safety_proposal, segments_stopped
from forcemap.exports.scaling import scaling_csv, scaling_result
from forcemap.exports.urscript import urscript
from forcemap.exports.zones import zones_csv, zones_result
from forcemap.paths.task import one_segment_task
from robot_programs import (
    Frame,
    example_in_head,
    krl_arrays,
    krl_example,
    krl_function,
    urscript_example,
    urscript_function,
    urscript_program,
)

QUASI_STATIC = fm.Contact.QUASI_STATIC

HAND = (fm.force_limit("back_of_hand"), fm.Contact.TRANSIENT)
DATE = "2026-11-21"


@pytest.fixture(scope="module")
def table():
    return fm.robot_table(fm.published_map("ur10e"), limits=[HAND], bound=fm.FixedMargin(0.10), date=DATE)


@pytest.fixture(scope="module")
def poses(table):
    """10,000 places all around the base, in and beyond the range, some of them exactly on edges."""
    rng = np.random.default_rng(60)
    angle, d, h = rng.uniform(-np.pi, np.pi, 10_000), rng.uniform(0.45, 0.95, 10_000), rng.uniform(0.1, 0.5, 10_000)
    d[:200], angle[:200] = rng.choice(table.distance_edges, 200), 0.0
    h[200:400] = rng.choice(table.height_edges, 200)
    return np.stack([d * np.cos(angle), d * np.sin(angle), h], axis=1)


def test_the_table_is_certified_and_floored(table):
    ur10e = fm.published_map("ur10e")
    allowance = table.provenance.allowance
    assert allowance == fm.Allowance(0.01, 0.005)
    rng = np.random.default_rng(61)
    for i in range(table.speed_mmps.shape[0]):
        for j in range(table.speed_mmps.shape[1]):
            d = rng.uniform(table.distance_edges[i] - 0.005, table.distance_edges[i + 1] + 0.005, 30)
            h = rng.uniform(table.height_edges[j] - 0.005, table.height_edges[j + 1] + 0.005, 30)
            case = {"limit": 280.0, "contact": QUASI_STATIC, "bound": fm.FixedMargin(0.10)}
            found = fm.safe_speed(ur10e, d, h, angle=5.0, **case)  # a program looks up places, not directions
            if table.speed_mmps[i, j]:
                assert table.speed_mmps[i, j] / 1000 + 0.01 <= found.speed.min()
                assert table.lowest[i, j] - table.speed_mmps[i, j] / 1000 < 0.011 + 1e-9
            else:
                assert not table.outcome[i, j].has_speed
    assert 15 < table.permitted < table.speed_mmps.size
    straight = fm.robot_table(ur10e, limits=[HAND], bound=fm.FixedMargin(0.10), angle=0.0)
    assert table.permitted < straight.permitted
    assert (table.speed_mmps <= straight.speed_mmps).all()
    edges = table.distance_edges
    assert (edges[0], edges[-1]) == (0.525, 0.885)
    np.testing.assert_array_equal(edges, np.round(edges, 3))


def test_the_urscript_function_returns_the_tables_value(table, poses):
    allowed = urscript_function(urscript(table), "forcemap_speed")
    answers = [table.speed(*pose) for pose in poses.tolist()]
    assert [allowed([*pose, 0.0, 3.14, 0.0]) for pose in poses.tolist()] == answers
    assert min(sum(v == 0 for v in answers), sum(v > 0 for v in answers)) > 1000
    for pose in ([math.nan, 0.0, 0.4], [0.8, 0.0, math.nan], [math.inf, 0.0, 0.4], [0.8, 0.0, -math.inf], [0.0] * 3):
        assert allowed([*pose, 0.0, 0.0, 0.0]) == 0.0 == table.speed(*pose)


def test_the_krl_tables_parse_back_and_the_function_returns_their_value(table, poses):
    arrays = krl_arrays(krl_data(table))
    np.testing.assert_allclose(list(arrays["FM_D"].values()), 1000 * table.distance_edges, atol=1e-9)
    np.testing.assert_allclose(list(arrays["FM_H"].values()), 1000 * table.height_edges, atol=1e-9)
    for (i, j), speed in arrays["FM_V"].items():
        assert speed == table.speed_mmps[i - 1, j - 1] / 1000
    allowed = krl_function(krl_source(table), krl_data(table), "FORCEMAP_SPEED")
    inner = poses[400:]  # off the edges, where millimetres and metres round alike
    answers = [allowed(Frame(zip("XYZ", 1000 * pose, strict=True))) for pose in inner]
    assert answers == [table.speed(*pose) for pose in inner.tolist()]
    for values in ([math.nan, 0, 400], [800, 0, math.nan], [math.inf, 0, 400], [0, 0, 0]):
        assert allowed(Frame(zip("XYZ", map(float, values), strict=True))) == 0.0


def test_neutral_tables(table):
    text = zones_csv(table)
    head = [line for line in text.splitlines() if line.startswith("#")]
    rows = list(csv.DictReader(io.StringIO(text[sum(len(line) + 1 for line in head) :])))
    result = json.loads(json.dumps(zones_result(table), allow_nan=False))
    assert len(rows) == len(result["zones"]) == table.speed_mmps.size
    for row, zone in zip(rows, result["zones"], strict=True):
        assert float(row["speed_mps"]) == zone["speed_mps"] == float(row["speed_to_program_mps"])
        assert zone["speed_to_program_mps"] == zone["speed_mps"]
        assert row["outcome"] == zone["outcome"]
        assert float(row["distance_from_m"]) == zone["distance_from_m"]
        assert (zone["speed_mps"] == 0) == (zone["outcome"] in ("unconfirmed", "outside"))
        assert zone["speed_mps"] + 0.01 <= (zone["lower_bound_mps"] or math.inf)
        assert float(row["limit_N"]) == zone["limit_N"] == 280.0
        assert row["map_sha256"] == fm.map_sha256(fm.published_map("ur10e"))
        if row["spread_mps"]:
            assert float(row["spread_mps"]) <= zone["spread_mps"]


def test_a_table_of_zones_says_how_a_speed_is_looked_up(table):
    text = zones_csv(table)
    rule = zones_result(table)["use"]
    assert f"# {rule}\n" in text
    assert "distance is sqrt(x^2 + y^2) and height is z" in rule
    assert "the slowest zone on the whole way counts, looked up every 5 mm" in rule
    assert "where a speed is 0, and outside all zones, do not move" in rule
    rows = [tuple(map(float, row[:5])) for row in csv.reader(text.splitlines()) if row[0][0].isdigit()]
    for x, y, z in np.random.default_rng(8).uniform((0.3, 0.2, 0.1), (0.8, 0.5, 0.6), (500, 3)).tolist():
        d = math.sqrt(x**2 + y**2)
        found = [speed for low, high, down, up, speed in rows if low <= d <= high and down <= z <= up]
        assert min(found, default=0.0) == table.speed(x, y, z)


def test_every_file_says_in_its_head_what_it_rests_on(table):
    texts = [
        zones_csv(table),
        urscript(table),
        krl_data(table),
        krl_source(table),
        safety_proposal(table),
    ]
    wanted = [
        "NOT SAFETY-RATED", "to be accepted before use", fm.map_sha256(fm.published_map("ur10e")), DATE, "280 N",
        "ISO/TS 15066:2016", "table version", "prediction + 10 %", "less 0.01 m/s, the overshoot",
        "position tolerance 0.005 m", "person at rest", "direction of motion: down", "contact site:",
        "safety settings:", "pressure not assessed",
    ]  # fmt: skip
    for text in texts:
        for words in wanted:
            assert words in text, (words, text[:80])
        assert text.isascii()
    result = zones_result(table)
    assert result["safety_rated"] is False
    assert result["speed_overshoot_mps"] == 0.01


def test_scaling_brakes_before_a_slower_piece():
    """From a fast way without contact into one with it: the factors fall over the braking distance before it."""
    points = np.array([[0.8, -0.3, 0.44], [0.8, 0.0, 0.44], [0.8, 0.0, 0.38]])
    segments = (
        fm.TaskSegment("carry", (), None, 1.0),
        fm.TaskSegment("press", ("back_of_hand",), fm.Contact.TRANSIENT, 0.2),
    )
    task = fm.Task(segments, acceleration=2.0)
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    speeds = fm.path_speeds(ur10e, fm.ToolPath(points, ("carry", "press")), task, bound=bound)
    basis = fm.robot_table(ur10e, limits=[HAND], bound=bound, date=DATE).provenance.of_path(speeds)
    pieces = scaling_result(speeds, basis)["pieces"]
    driven = np.array([piece["scaling"] * piece["programmed_speed_mps"] for piece in pieces])
    last = max(i for i, piece in enumerate(pieces) if piece["segment"] == "carry")
    assert driven[last] <= speeds.speed[last + 1] < 0.34
    assert driven[0] == 1.0
    before = driven[: last + 1]
    assert (before[:-1] ** 2 - before[1:] ** 2 <= 2 * 2.0 * speeds.path.lengths[:last] + 0.025).all()
    assert "later piece allows less" in pieces[last]["reason"]


EVIL = (
    "UR\nend\ndef forcemap_speed(pose):\n  return 9.0\nend\r\n"
    "GLOBAL DEFFCT REAL FORCEMAP_SPEED(P:IN)\x85x\u2028y\u2029z\x00\x1b\u202e"
)


def test_texts_of_a_campaign_stay_in_their_line_of_every_format(poses):
    """A robot's name is not a program: in all six formats it is one line of comment."""
    from forcemap.exports.head import head_lines

    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    conditions = replace(ur10e.conditions, robot=EVIL, tool=EVIL)
    evil = replace(ur10e, name=EVIL, source=EVIL, conditions=conditions)
    table = fm.robot_table(evil, limits=[HAND], bound=bound, date=DATE)
    points = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.3]], name="=cmd|'/c calc'!A0\nx")
    task = one_segment_task(points.names[0], ("back_of_hand",), fm.Contact.TRANSIENT, speed=0.35)
    speeds = fm.path_speeds(evil, points, task, bound=bound)
    basis = table.provenance.of_path(speeds)
    lines = len(head_lines(table.provenance))
    texts = {
        "csv": zones_csv(table), "urscript": urscript(table), "dat": krl_data(table),
        "src": krl_source(table), "scaling": scaling_csv(speeds, basis), "safety": safety_proposal(table),
        "json": json.dumps(zones_result(table) | scaling_result(speeds, basis), ensure_ascii=False),
    }  # fmt: skip
    for name, text in texts.items():
        assert all(letter.isprintable() or letter == "\n" for letter in text), name
        assert "\\n" not in text, name
    plain = fm.robot_table(ur10e, limits=[HAND], bound=bound, date=DATE)
    use = {
        name: sum(map(len, example_in_head(text, mark)))
        for name, text, mark in (("urscript", urscript(plain), "#"), ("src", krl_source(plain), ";"))
    }
    for name, mark in (("csv", "#"), ("urscript", "#"), ("dat", ";"), ("src", ";")):
        assert sum(line.startswith(mark) for line in texts[name].splitlines()) - lines - use.get(name, 0) in (0, 1), (
            name
        )
    for line in texts["safety"].splitlines():
        assert not line.startswith(("end", "def", "DEF"))
    allowed = urscript_function(texts["urscript"], "forcemap_speed")  # refuses a second function
    of_krl = krl_function(texts["src"], texts["dat"], "FORCEMAP_SPEED")
    for pose in poses[400:500].tolist():
        answer = table.speed(*pose)
        assert allowed([*pose, 0.0, 0.0, 0.0]) == answer
        assert of_krl(Frame(zip("XYZ", [1000 * x for x in pose], strict=True))) == answer
    rows = [line for line in texts["scaling"].splitlines() if not line.startswith("#")]
    assert len(rows) == len(speeds.path) + 1
    for row in csv.DictReader(rows):
        assert row["segment"].startswith("'=cmd")
    warned = safety_proposal(table, speeds=speeds)
    assert len(warned.splitlines()) - len(texts["safety"].splitlines()) in (7, 8)


@pytest.mark.parametrize("sign", ["=", "+", "-", "@", " =", "\t@", "\r\n+", "\0="])
def test_no_cell_is_a_formula_to_a_spreadsheet(sign):
    """What a spreadsheet runs begins with one of four signs; a text that begins with one is told to be a text."""
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    name = f"{sign}cmd|'/c calc'!A0"
    path = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.3]], name=name)
    task = one_segment_task(name, ("back_of_hand",), fm.Contact.TRANSIENT, speed=0.35)
    speeds = fm.path_speeds(ur10e, path, task, bound=bound)
    basis = fm.robot_table(ur10e, limits=[HAND], bound=bound, date=DATE).provenance.of_path(speeds)
    rows = [line for line in scaling_csv(speeds, basis).splitlines() if not line.startswith("#")]
    for row in csv.DictReader(rows):
        assert row["segment"] == "'" + sign.strip()[-1] + "cmd|'/c calc'!A0"
    assert len(rows) == len(speeds.path) + 1


def test_the_head_names_the_map_file_and_the_impacts_table(examples, tmp_path):
    fitted = fm.fit_force_map(examples["ur10e"])
    fm.write_map(fitted, tmp_path / "cell 7.json")
    table = fm.robot_table(fm.read_map(tmp_path / "cell 7.json"), limits=[HAND], bound=fm.ToleranceBound())
    table = replace(table, provenance=table.provenance.of_file(tmp_path / "cell 7.json"))
    digest = hashlib.sha256((tmp_path / "cell 7.json").read_bytes()).hexdigest()
    for text in (zones_csv(table), urscript(table), krl_data(table), safety_proposal(table)):
        assert f"map file: cell 7.json, SHA-256 {digest}" in text
        assert f"impacts table: {fitted.fit.table}, SHA-256 {fitted.fit.table_sha256}" in text
    result = zones_result(table)
    assert result["map_file"] == "cell 7.json"
    assert result["map_file_sha256"] == digest
    assert result["impacts_table_sha256"] == fitted.fit.table_sha256


@pytest.mark.parametrize("tolerance", [0.0, 0.002, 0.005, 0.02])
def test_the_example_in_a_programs_head_takes_the_least_of_the_whole_way(tolerance):
    """Both languages agree with the table asked every half millimetre, less what a zone holds beside itself."""
    ur10e, bound, rng = fm.published_map("ur10e"), fm.FixedMargin(0.10), np.random.default_rng(63)
    allowance = fm.Allowance(position=tolerance)
    table = fm.robot_table(ur10e, limits=[HAND], bound=bound, date=DATE, allowance=allowance)
    script, source, apart = urscript(table), krl_source(table), min(max(tolerance, 0.001), 0.005)
    calls = []
    asked, of_krl = urscript_function(script, "forcemap_speed"), krl_function(source, krl_data(table), "FORCEMAP_SPEED")
    names = {
        "forcemap_speed": lambda pose: calls.append(pose[:3]) or asked(pose),
        "point_dist": lambda a, b: float(np.linalg.norm(np.subtract(a, b)[:3])),
        "interpolate_pose": lambda a, b, share: [(1 - share) * x + share * y for x, y in zip(a, b, strict=True)],
    }
    slowed = 0
    for _ in range(12):
        x, y, top = rng.uniform(0.6, 0.85), rng.uniform(-0.2, 0.2), rng.uniform(0.4, 0.45)
        here, there = [x, y, top, 0.0, 3.14, 0.0], [x, y, top - rng.uniform(0.02, 0.2), 0.0, 3.14, 0.0]
        calls.clear()
        least = urscript_example(script, here, there, names)
        places = np.array(sorted(calls, key=lambda pose: -pose[2]))
        assert places[0].tolist() == here[:3]
        assert places[-1].tolist() == there[:3]
        assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() <= apart + 1e-12
        assert least == min(table.speed(*place) for place in places.tolist())
        frames = (Frame(zip("XYZ", [1000 * each for each in pose[:3]], strict=True)) for pose in (here, there))
        assert krl_example(source, *frames, {"FORCEMAP_SPEED": of_krl, "SQRT": math.sqrt}) == least
        slowed += least < asked(here)
    assert slowed > 6
    assert urscript_example(script, here, here, names) == asked(here)


def test_the_page_on_kuka_asks_as_the_head_does(table):
    page = (Path(__file__).parents[1] / "docs" / "kuka.md").read_text()
    words, code = example_in_head(krl_source(table), ";")
    assert "\n".join(code) in "\n".join(line.strip() for line in page.splitlines())
    assert "docs/kuka.md" in " ".join(words)
    assert "docs/universal_robots.md" in " ".join(example_in_head(urscript(table), "#")[0])


def test_the_documented_urscript_asks_for_a_whole_way(table):
    """The function of the page on Universal Robots: no place on the way may be driven more slowly."""
    page = (Path(__file__).parents[1] / "docs" / "universal_robots.md").read_text()
    code = textwrap.dedent(page[page.index("       def forcemap_way") : page.index("   A zone's speed holds")])
    names = {
        "forcemap_speed": urscript_function(urscript(table), "forcemap_speed"),
        "floor": math.floor,
        "point_dist": lambda a, b: float(np.linalg.norm(np.subtract(a, b)[:3])),
        "interpolate_pose": lambda a, b, share: [(1 - share) * x + share * y for x, y in zip(a, b, strict=True)],
    }
    way = urscript_program(code, "def forcemap_way(here, there):", names, "here", "there")
    ur10e, rng = fm.published_map("ur10e"), np.random.default_rng(62)
    refused = 0
    for _ in range(60):
        x, y, top = rng.uniform(0.55, 0.85), rng.uniform(-0.2, 0.2), rng.uniform(0.3, 0.46)
        here, there = [x, y, top, 0.0, 3.14, 0.0], [x + 0.02, y, top - rng.uniform(0.01, 0.15), 0.0, 3.14, 0.0]
        speed = way(here, there)
        share = np.linspace(0, 1, 400)[:, None]
        along = np.array(here) * (1 - share) + np.array(there) * share
        safe = fm.safe_speed(
            ur10e,
            np.hypot(along[:, 0], along[:, 1]),
            along[:, 2],
            limit=280.0,
            contact=QUASI_STATIC,
            bound=fm.FixedMargin(0.10),
        )
        refused += speed == 0
        if speed:
            assert speed + 0.01 <= safe.speed.min()
    assert 5 < refused < 55
    assert way([0.8, 0.0, 0.4, 0, 0, 0], [0.8, 0.0, 0.6, 0, 0, 0]) == 0


def test_the_limit_of_a_zone_is_the_number_that_governs_it():
    limits = [(fm.NewtonLimit(force, spring_N_per_m=75e3), None) for force in (300.0, 240.0)]
    table = fm.robot_table(fm.published_map("ur10e"), limits=limits, bound=fm.FixedMargin(0.10), date=DATE)
    rows = list(csv.DictReader(line for line in zones_csv(table).splitlines() if not line.startswith("#")))
    given = [float(row["limit_N"]) for row in rows if float(row["speed_mps"])]
    assert given
    assert set(given) == {240.0}


def test_the_safety_proposal_warns_of_segments_that_it_would_stop(table):
    from forcemap.exports.safety_proposal import widest_block

    text = safety_proposal(table)
    speed = widest_block(table)[4]
    assert f"| tool speed limit | {speed / 1000:.3f} m/s | {speed} mm/s |" in text
    assert "keep the limit of 280 N on the body" in text
    assert "WARNING" not in text
    segments = (
        fm.TaskSegment("carry", (), None, 0.5),
        fm.TaskSegment("press", ("back_of_hand",), fm.Contact.TRANSIENT, 0.05),
        fm.TaskSegment("place", ("back_of_hand",), fm.Contact.TRANSIENT),
    )
    warned = safety_proposal(table, task=fm.Task(segments))
    assert "**WARNING" in warned
    assert "segment carry: programmed up to 0.500 m/s" in warned
    assert "segment press" not in warned
    assert "segment place: no speed is stated" in warned
    slow = one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT, speed=0.05)
    assert "No segment of the task violates" in safety_proposal(table, task=slow)
    assert segments_stopped(table, slow, None) == []
    stopped = segments_stopped(table, fm.Task(segments), None)
    assert stopped == [segment.name for segment in segments if f"- segment {segment.name}:" in warned]
    for bottom, words in (
        (0.40, "No segment of the task violates"),
        (0.10, "NO ENTRIES: this path is not permitted**, on path"),
    ):
        path = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, bottom]])
        speeds = fm.path_speeds(fm.published_map("ur10e"), path, slow, bound=fm.FixedMargin(0.10))
        assert words in safety_proposal(table, speeds=speeds)


@pytest.mark.parametrize("seed", range(20))
def test_the_block_of_a_path_holds_it_and_is_permitted_throughout(table, seed):
    """By its points one by one: the block holds each, no smaller one does, and every zone in it allows the speed."""
    from forcemap.exports.safety_proposal import block_of_path

    rng = np.random.default_rng(seed)
    distance, tops = rng.uniform(0.7, 0.88), np.sort(rng.uniform(0.25, 0.45, 3))[::-1]
    distance = table.distance_edges[-1] if seed % 5 == 0 else distance  # the outermost edge, too
    points = [[distance, 0.0, top] for top in tops]
    task = one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT, speed=0.05)
    speeds = fm.path_speeds(fm.published_map("ur10e"), fm.ToolPath.through(points), task, bound=fm.FixedMargin(0.10))
    places = np.array(speeds.path.points)[:, [0, 2]]
    edges = (table.distance_edges, table.height_edges)
    inside = all(e[0] <= p.min() and p.max() <= e[-1] for e, p in zip(edges, places.T, strict=True))
    block = block_of_path(table, speeds)
    zones = [[(table.speed(d, 0.0, h) > 0) for h in places[:, 1]] for d in places[:, 0]]
    if block is None:
        assert not inside or not np.all(zones) or speeds.refused.any()
        return
    first, last, bottom, top, speed = block
    for (a, b), e, p in zip(((first, last), (bottom, top)), edges, places.T, strict=True):
        assert e[a] <= p.min() <= e[a + 1]
        assert e[b - 1] <= p.max() <= e[b]
    assert table.speed_mmps[first:last, bottom:top].min() == speed > 0
    text = safety_proposal(table, speeds=speeds)
    assert f"| tool speed limit | {speed / 1000:.3f} m/s |" in text
    assert "leaves the block" not in text


def test_a_sheet_for_a_path_without_permission_says_so(table):
    """Sideways no zone holds, whatever its speed is."""
    from forcemap.exports.safety_proposal import block_of_path

    path = fm.ToolPath.through([[0.80, 0, 0.40], [0.84, 0, 0.40]])
    task = one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT, speed=0.05)
    speeds = fm.path_speeds(fm.published_map("ur10e"), path, task, bound=fm.FixedMargin(0.10))
    assert speeds.refused.all()
    assert block_of_path(table, speeds) is None
    sheet = safety_proposal(table, speeds=speeds)
    assert "NO ENTRIES: this path is not permitted**, on path" in sheet
    assert "tool speed limit" not in sheet


def test_the_strictest_of_several_limits_and_the_gate_hold():
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    own = (fm.NewtonLimit(300.0, spring_N_per_m=75e3), None)
    alone = [fm.robot_table(ur10e, limits=[limit], bound=bound) for limit in (own, HAND)]
    both = fm.robot_table(ur10e, limits=[own, HAND], bound=bound)
    np.testing.assert_array_equal(both.speed_mmps, np.minimum(*(each.speed_mmps for each in alone)))
    assert len(both.provenance.limits_N) == 2
    assert both.alone == tuple(each.permitted for each in alone)
    assert min(both.alone) == both.permitted < max(both.alone)
    clamps = fm.robot_table(fm.published_map("kuka-iiwa7-30nm"), limits=[HAND], bound=bound)
    assert clamps.permitted == 0
    assert "nothing to configure" in safety_proposal(clamps)
    assert urscript_function(urscript(clamps), "forcemap_speed")([0.8, 0.0, 0.4, 0, 0, 0]) == 0
    head = fm.robot_table(ur10e, limits=[(fm.force_limit("temple"), fm.Contact.TRANSIENT), HAND], bound=bound)
    assert head.refusal.kind is fm.FindingKind.NOT_PERMITTED
    assert head.permitted == 0
    assert set(head.outcome.ravel()) == {"not_permitted"}


def test_the_safety_proposal_names_a_block_of_permitted_zones(table):
    from forcemap.exports.safety_proposal import widest_block

    first, last, bottom, top, speed = widest_block(table)
    block = table.speed_mmps[first:last, bottom:top]
    assert block.min() == speed > 0
    assert f"{speed / 1000:.3f} m/s" in safety_proposal(table)
    best = max(
        table.speed_mmps[a:b, c:d].min() * (table.distance_edges[b] - table.distance_edges[a])
        * (table.height_edges[d] - table.height_edges[c])
        for a in range(8) for b in range(a + 1, table.speed_mmps.shape[0] + 1)
        for c in range(7) for d in range(c + 1, table.speed_mmps.shape[1] + 1)
        if a < table.speed_mmps.shape[0] and c < table.speed_mmps.shape[1]
    )  # fmt: skip
    wide = table.distance_edges[last] - table.distance_edges[first]
    assert speed * wide * (table.height_edges[top] - table.height_edges[bottom]) == pytest.approx(best)


def test_scaling_factors_keep_the_program_within_the_allowed_speeds():
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    points = [[0.8, 0, 0.44], [0.8, 0, 0.3], [0.6, 0, 0.3]]
    task = one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT, speed=0.35)
    speeds = fm.path_speeds(ur10e, fm.ToolPath.through(points), task, bound=bound)
    table = fm.robot_table(ur10e, limits=[HAND], bound=bound, date=DATE)
    basis = table.provenance.of_path(speeds)
    pieces = scaling_result(speeds, basis)["pieces"]
    assert {piece["outcome"] for piece in pieces} == {"admissible", "not_downward"}
    braked = [math.floor(1000 * speed) / 1000 for speed in speeds.commanded]
    slower = [speed < min(piece["allowed_speed_mps"], 0.35) for speed, piece in zip(braked, pieces, strict=True)]
    assert [piece["reason"].endswith("; slower here, because a later piece allows less") for piece in pieces] == slower
    assert 0 < sum(slower) < len(slower)
    driven = [piece["scaling"] * 0.35 for piece in pieces]
    commanded = [piece["commanded_speed_mps"] for piece in pieces]
    assert commanded == [min(speed, 0.35) for speed in braked]
    assert all(0 <= speed - by_factor < 0.0035 for speed, by_factor in zip(commanded, driven, strict=True))
    assert all(piece["commanded_speed_mps"] <= piece["allowed_speed_mps"] for piece in pieces)
    for i, speed in enumerate(speeds.speed):
        if math.isnan(speed):
            assert driven[i] == driven[i - 1] == 0  # the piece before it would enter it
        elif driven[i]:
            following = min(speed, speeds.speed[i + 1])
            assert driven[i] <= following + 1e-12
            stop = math.sqrt(2 * 1.0 * sum(speeds.path.lengths[i + 1 : 6]))  # braked away before the piece of 0
            assert min(following, stop) - driven[i] < 0.0046
    assert max(driven) > 0.3
    assert math.isnan(speeds.duration(np.array(driven)))  # pieces without a speed take no time
    text = scaling_csv(speeds, basis)
    assert "NOT SAFETY-RATED" in text
    assert "brakes along the path with at least 1 m/s^2" in text
    assert "no speed for any other direction of motion" in text
    assert text.count("280 N, transient contact") == 1
    assert ",0.800000,0.000000,0.440000,0.800000,0.000000,0.420000,0.350,0.31" in text
    assert sum(not line.startswith("#") for line in text.splitlines()) == len(pieces) + 1
    unstated = fm.path_speeds(
        ur10e,
        fm.ToolPath.through(points),
        one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT),
        bound=bound,
    )
    rows = [line.split(",") for line in scaling_csv(unstated, basis).splitlines() if not line.startswith("#")]
    columns = {name: [row[rows[0].index(name)] for row in rows[1:]] for name in ("programmed_speed_mps", "scaling")}
    assert {*columns["programmed_speed_mps"]} == {""}
    assert {*columns["scaling"]} == {"", "0.00"}  # a piece that is not permitted, and the one before it
    low = [[0.8, 0, 0.44], [0.8, 0, 0.2], [0.8, 0, 0.05]]  # leaves the measured range
    refused = fm.path_speeds(
        ur10e, fm.ToolPath.through(low), one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT), bound=bound
    )
    pieces = scaling_result(refused, basis)["pieces"]
    assert {piece["scaling"] for piece in pieces if not piece["commanded_speed_mps"]} == {0.0}
    assert {piece["scaling"] for piece in pieces if piece["commanded_speed_mps"]} == {None}
    sheet = safety_proposal(fm.robot_table(ur10e, limits=[HAND], bound=bound, date=DATE), speeds=refused)
    assert "**NO ENTRIES: this path is not permitted**, on path" in sheet
    assert "tool speed limit" not in sheet


def test_the_time_at_commanded_speeds_is_that_of_the_motion():
    """Against the sum of short steps of the fastest motion from rest to rest within the speeds."""
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    task = one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT, speed=2.0)
    path = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.3]])
    speeds = fm.path_speeds(ur10e, path, task, bound=bound)
    basis = fm.robot_table(ur10e, limits=[HAND], bound=bound, date=DATE).provenance.of_path(speeds)
    commanded = np.array([piece["commanded_speed_mps"] for piece in scaling_result(speeds, basis)["pieces"]])
    assert speeds.duration(speeds.speed) == speeds.allowed.duration
    ends, steps = np.cumsum(speeds.path.lengths), 14000
    step = ends[-1] / steps
    piece = np.minimum(np.searchsorted(ends, step * np.arange(steps + 1)), commanded.size - 1)
    squared = commanded[piece] ** 2
    for order in (1, -1):  # v^2 rises and falls by at most 2 a a step, from rest to rest
        most = -2 * speeds.acceleration * step
        for i in range(steps + 1)[::order]:
            squared[i] = most = min(squared[i], most + 2 * speeds.acceleration * step)
    speed = np.sqrt(squared)
    assert speeds.duration(commanded) == pytest.approx(np.sum(2 * step / (speed[1:] + speed[:-1])), rel=1e-3)
    assert speeds.duration(commanded) > speeds.allowed.duration


def blended(pieces, starts, late, acceleration, step=1e-4):
    """Heights [m] and speeds [m/s] down a descent, each piece's speed begun `late` [m] behind its start; faster at
    once, slower by braking. At `starts` the robot has come to rest."""
    height, speed = [], []
    for a, b in itertools.pairwise([*starts, len(pieces)]):
        top = pieces[a]["from_z_m"]
        along = np.arange(0.0, top - pieces[b - 1]["to_z_m"], step)
        ends = top - np.array([piece["to_z_m"] for piece in pieces[a:b]])
        number = np.minimum(np.searchsorted(ends, np.maximum(along - late, 0.0), side="right"), b - a - 1)
        now = 0.0
        for target in np.array([piece["commanded_speed_mps"] for piece in pieces[a:b]])[number]:
            now = max(target, math.sqrt(max(now**2 - 2 * acceleration * step, 0.0)))
            speed.append(now)
        height.append(top - along)
    return np.concatenate(height), np.array(speed)


@pytest.mark.parametrize("late", [-0.003, 0.0, 0.003])
@pytest.mark.parametrize("seed", range(4))
def test_rows_blended_as_motions_of_one_segment_are_never_too_fast(seed, late):
    """Late or early by the blending, beside by what is left of the position tolerance; across segments it would be."""
    rng = np.random.default_rng([2026, seed])
    ur10e, bound, allowance = fm.published_map("ur10e"), fm.FixedMargin(0.10), fm.Allowance(0.01, 0.005)
    d, top, change, bottom = rng.uniform(0.7, 0.87), 0.45, rng.uniform(0.36, 0.42), rng.uniform(0.3, 0.33)
    path = fm.ToolPath(np.array([[d, 0, top], [d, 0, change], [d, 0, bottom]]), ("approach", "press"))
    press = fm.TaskSegment("press", ("back_of_hand",), fm.Contact.TRANSIENT, 0.5)
    task = fm.Task((fm.TaskSegment("approach", (), None, 0.5), press), 2.0)
    speeds = fm.path_speeds(ur10e, path, task, bound=bound, allowance=allowance)
    of_map = fm.robot_table(ur10e, limits=[HAND], bound=bound, allowance=allowance, date=DATE)
    pieces = scaling_result(speeds, of_map.provenance.of_path(speeds))["pieces"]
    begin = [piece["segment"] for piece in pieces].index("press")

    def too_fast(starts):
        height, speed = blended(pieces, starts, late, task.acceleration)
        pressed = height <= pieces[begin]["from_z_m"]
        where = height[pressed] + rng.uniform(-0.002, 0.002, pressed.sum()), rng.uniform(-0.002, 0.002, pressed.sum())
        allowed = fm.safe_speed(ur10e, d + where[1], where[0], limit=HAND[0], contact=HAND[1], bound=bound)
        assert np.isfinite(allowed.speed).all()
        assert pressed.sum() > 100
        return bool((speed[pressed] + allowance.speed > allowed.speed).any())

    assert not too_fast([0, begin])
    assert too_fast([0]) == (late > 0)


def test_the_last_digit_of_a_log_slows_nothing_where_contact_is_excluded(table):
    height = np.round(np.arange(0.3, 0.44, 0.6 * 0.008), 6) + np.arange(30) % 2 * 1e-6  # 0.6 m/s, to 1 um
    points = np.column_stack([np.full(30, 0.8), np.zeros(30), height])
    path = fm.ToolPath.through(points, time=0.008 * np.arange(30))
    assert path.speeds.max() > 0.6001
    lift = fm.Task((fm.TaskSegment("path", (), None, 0.6),))
    speeds = fm.path_speeds(fm.published_map("ur10e"), path, lift, bound=fm.FixedMargin())
    assert not speeds.too_fast.any()
    factors = {piece["scaling"] for piece in scaling_result(speeds, table.provenance.of_path(speeds))["pieces"]}
    assert factors == {1.0}


def test_a_scaling_factor_is_never_above_1_and_never_rounded_up():
    """Whatever speeds stand in a result, a program is slowed down, not driven faster than it is."""
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    task = one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT, speed=0.30)
    speeds = fm.path_speeds(ur10e, fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.3]]), task, bound=bound)
    basis = fm.robot_table(ur10e, limits=[HAND], bound=bound, date=DATE).provenance.of_path(speeds)
    for allowed, factor in ((0.60, 1.0), (0.3009, 1.0), (0.30, 1.0), (0.2999, 0.99), (0.0301, 0.10), (0.0298, 0.09)):
        replaced = replace(speeds, speed=np.full(speeds.speed.size, allowed), acceleration=1e6)
        assert {piece["scaling"] for piece in scaling_result(replaced, basis)["pieces"]} == {factor}
        assert scaling_csv(replaced, basis).count(f",{factor:.2f},admissible,") > 3


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"limits": []}, "at least one"),
        ({"size": 0.0}, "zone size"),
        ({"size": math.nan}, "zone size"),
        ({"date": "21.11.2026"}, "date"),
        ({"allowance": fm.Allowance(0.01, 0.2)}, "measured range leaves"),
    ],
)
def test_tables_that_cannot_be_made(options, words):
    given = {"limits": [HAND], "bound": fm.FixedMargin()} | options
    with pytest.raises(fm.InputError, match=words):
        fm.robot_table(fm.published_map("ur10e"), **given)


@pytest.mark.parametrize("value", [-0.01, math.nan, math.inf])
def test_allowances_are_positive(value):
    with pytest.raises(fm.InputError, match="overshoot"):
        fm.Allowance(speed=value)


def test_an_allowance_that_leaves_nothing_permits_nothing():
    table = fm.robot_table(
        fm.published_map("ur10e"), limits=[HAND], bound=fm.FixedMargin(), allowance=fm.Allowance(speed=0.5)
    )
    assert table.permitted == 0
    assert not any(outcome.has_speed for outcome in table.outcome.ravel())


def test_a_piece_of_which_one_end_leaves_the_block_leaves_it(table):
    """The safety plane stops the robot where it passes, wherever the rest of the piece lies."""
    from forcemap.exports.safety_proposal import widest_block

    first, last, bottom, _, speed = widest_block(table)
    column = int(table.speed_mmps[first:last, bottom - 1].argmin()) + first
    assert table.speed_mmps[column, bottom - 1] == 0  # so no block holds a path that goes below
    distance = float(table.distance_edges[column : column + 2].mean())
    ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
    task = one_segment_task("path", ("back_of_hand",), HAND[1], speed=0.9 * speed / 1000)
    for beyond, leaves in ((0.003, True), (-0.003, False)):
        low = float(table.height_edges[bottom]) - beyond
        path = fm.ToolPath.through([[distance, 0, low + 0.05], [distance, 0, low]])
        found = fm.path_speeds(ur10e, path, task, bound=bound)
        assert ("leaves the block" in safety_proposal(table, task=task, speeds=found)) == leaves


def test_the_block_is_the_one_of_largest_area_times_speed_of_any_table(table):
    """Against all rectangles of drawn tables, some of them with few permitted zones, or none."""
    from forcemap.exports.safety_proposal import widest_block

    rng = np.random.default_rng(63)
    found = set()
    for number in range(60):
        rows, columns = rng.integers(1, 6, 2)
        speeds = rng.integers(1, rng.choice([3, 400]), (rows, columns)) * (rng.random((rows, columns)) < number / 59)
        d, h = np.cumsum(rng.integers(10, 90, rows + 1)) / 1000, np.cumsum(rng.integers(10, 90, columns + 1)) / 1000
        worth = {
            (a, b, c, e): speeds[a:b, c:e].min() * (d[b] - d[a]) * (h[e] - h[c])
            for a in range(rows) for b in range(a + 1, rows + 1)
            for c in range(columns) for e in range(c + 1, columns + 1)
        }  # fmt: skip
        block = widest_block(replace(table, distance_edges=d, height_edges=h, speed_mmps=speeds))
        found.add(None if block is None else block[:4])
        if max(worth.values()) == 0:
            assert block is None
        else:
            assert worth[block[:4]] == pytest.approx(max(worth.values()))
            assert block[4] == speeds[block[0] : block[1], block[2] : block[3]].min()
    assert len(found) > 20


@pytest.mark.parametrize("tolerance", [0.0, 0.005, 0.0053, 0.005 + 3e-9, 0.005 + 1e-10, 0.02])
@pytest.mark.parametrize("size", [0.005, 0.05, 0.09, 0.1, 0.36])
def test_zones_are_the_fewest_whole_millimetres_within_the_range_drawn_in(tolerance, size):
    ur10e, bound, allowance = fm.published_map("ur10e"), fm.FixedMargin(0.10), fm.Allowance(position=tolerance)
    wide = (fm.NewtonLimit(1.0, spring_N_per_m=75e3), None)  # no zone has a speed
    found = fm.robot_table(ur10e, limits=[wide], bound=bound, size=size, allowance=allowance, date=DATE)
    for i, edges in enumerate((found.distance_edges, found.height_edges)):
        low, high = ur10e.measured_range.lowest[i] + tolerance, ur10e.measured_range.highest[i] - tolerance
        millimetres = np.round(1000 * edges).astype(int)
        np.testing.assert_array_equal(edges, millimetres / 1000)
        assert -1e-9 < edges[0] - low < 0.001 - 1e-9
        assert -1e-9 < high - edges[-1] < 0.001 - 1e-9
        whole = int(millimetres[-1] - millimetres[0])
        assert edges.size - 1 == math.ceil(round(whole / (1000 * size), 6))
        assert np.ptp(np.diff(millimetres)) <= 1


def test_a_table_has_zones_of_at_least_5_mm_and_a_range_of_at_least_one():
    given = {"limits": [HAND], "bound": fm.FixedMargin(0.10), "date": DATE}
    ur10e = fm.published_map("ur10e")
    with pytest.raises(fm.InputError, match="expected at least"):
        fm.robot_table(ur10e, size=0.00499, **given)
    lowest, highest = ur10e.measured_range.lowest, ur10e.measured_range.highest
    half = float(highest[1] - lowest[1]) / 2
    narrow = fm.robot_table(ur10e, allowance=fm.Allowance(position=half - 0.001), **given)
    assert np.ptp(narrow.height_edges) == pytest.approx(0.002)
    assert narrow.speed_mmps.shape[1] == 1
    with pytest.raises(fm.InputError, match="measured range leaves"):
        fm.robot_table(ur10e, allowance=fm.Allowance(position=half - 0.0004), **given)


def test_runs_planned_earlier_are_numbered_after_the_others():
    from forcemap.exports.run_sheet import run_sheet

    plan = fm.plan_measurements((0.5, 0.7, 0.9), (0.2, 0.3, 0.4), (0.1, 0.2, 0.3), design=fm.Design.PAPER, repeats=1)
    lines = run_sheet(plan, fm.Conditions(), waiting=plan)
    at = lines.index("Planned earlier and not measured yet")
    for part, first in ((lines[:at], 1), (lines[at:], len(plan) + 1)):
        runs = [line.split()[:2] for line in part if re.match(r" *[0-9]+ .*____", line)]
        assert runs == [[str(first + i), name] for i, name in enumerate(plan.recording.tolist())]


def test_scaling_factors_of_speeds_that_may_not_be_exported_are_refused():
    """Whatever the head says: it may be of a table made with another bound."""
    ur10e = fm.published_map("ur10e")
    task = one_segment_task("path", ("back_of_hand",), fm.Contact.TRANSIENT, speed=0.35)
    path = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.3]])
    head = fm.robot_table(ur10e, limits=[HAND], bound=fm.FixedMargin(0.10), date=DATE).provenance
    weak = fm.path_speeds(ur10e, path, task, bound=fm.FixedMargin(0.05))
    for write in (scaling_result, scaling_csv):
        with pytest.raises(fm.NotReleasable):
            write(weak, head)
