"""Plans: the paper's designs, what is left out and why, what cannot be confirmed, plan.csv and the printed sheet."""

from __future__ import annotations

import csv
import io
import json
import math
from importlib import resources

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import forcemap as fm
from forcemap.campaigns.plan import MeasurementPlan, read_plan, write_plan
from forcemap.errors import InputError, TableError
from forcemap.exports.run_sheet import run_sheet
from forcemap.findings import FindingKind
from forcemap.planning.design import Design
from forcemap.planning.expectation import StandardExpectation
from forcemap.planning.measurements import plan_measurements
from forcemap.words import sentence, sentences

FACTS = json.loads(resources.files("forcemap.maps.published").joinpath("published_maps.json").read_text())["maps"]
DEVICE = fm.Device(range=500.0, error=3.0)
UR10E = {"distances": (0.52, 0.70, 0.89), "heights": (0.14, 0.46), "speeds": (0.2, 0.4), "design": Design.PAPER}


def states_of(plan):
    return set(zip(plan.distance.tolist(), plan.height.tolist(), plan.speed.tolist(), strict=True))


def grid(figures, prefix=""):
    axes = (figures[f"{prefix}{name}"] for name in ("distances_m", "heights_m", "speeds_mps"))
    return {(d, h, v) for axis in [list(axes)] for d in axis[0] for h in axis[1] for v in axis[2]}


@pytest.mark.parametrize("name", ["kuka-iiwa7-30nm", "kuka-iiwa7-10nm"])
def test_ranges_give_the_papers_designs(name):
    figures = FACTS[name]
    ends = {key: (figures[f"{key}_{unit}"][0], figures[f"{key}_{unit}"][-1])
            for key, unit in (("distances", "m"), ("heights", "m"), ("speeds", "mps"))}  # fmt: skip
    training = plan_measurements(**ends, design=Design.PAPER, repeats=figures["repeats"])
    assert states_of(training) == grid(figures, "training_")
    assert len(training) == 27 * figures["repeats"]
    assert set(training.role) == {"train"}
    full = plan_measurements(**ends, design=Design.FULL_GRID)
    measured = {tuple(point) for point in fm.published_map(name).measured_range.points.tolist()}
    assert states_of(full) == measured == grid(figures)
    kept = full.role == "train"
    trains = set(zip(full.distance[kept], full.height[kept], full.speed[kept], strict=True))
    assert trains == grid(figures, "training_")
    assert (len(full.states), len(full), int(kept.sum())) == (125, 375, 81)


def test_values_give_the_ur10es_designs_with_their_uneven_step():
    plan = plan_measurements(**UR10E)
    assert states_of(plan) == grid(FACTS["ur10e"], "training_")
    assert (len(plan.states), len(plan)) == (27, 81)
    axes = [FACTS["ur10e"][name] for name in ("distances_m", "heights_m", "speeds_mps")]
    full = plan_measurements(*axes, design=Design.FULL_GRID)
    assert states_of(full) == grid(FACTS["ur10e"])
    assert int((full.role == "train").sum()) == 81


def test_symmetry_as_large_as_the_papers():
    """117 impacts: 39 combinations with three repeats (section V-A)."""
    plan = plan_measurements(
        np.linspace(0.5, 0.86, 13), 0.14, 0.3, design=Design.SYMMETRY, base_angles=(0, 45, 90), repeats=3
    )
    assert (len(plan.states), len(plan)) == (13, 117)
    assert set(plan.role) == {"test"}
    one = plan.state_id == plan.states[0]
    assert plan.repeat[one].tolist() == list(range(1, 10))
    assert plan.base_angle[one].tolist() == [0.0] * 3 + [45.0] * 3 + [90.0] * 3


def test_order_is_slow_to_fast_far_to_near_low_to_high_with_repeats_together():
    plan = plan_measurements(**UR10E, repeats=2)
    key = list(zip(plan.speed, -plan.distance, plan.height, plan.repeat, strict=True))
    assert key == sorted(key)
    assert plan.recording[:3].tolist() == ["d890-h140-v200-r1", "d890-h140-v200-r2", "d890-h300-v200-r1"]


@settings(max_examples=30)
@given(
    st.lists(st.integers(1, 900), min_size=3, max_size=5, unique=True),
    st.sampled_from([1e-3, 1e-4, 1e-5]),
    st.sampled_from([Design.PAPER, Design.SYMMETRY]),
)
def test_states_never_share_a_name(steps, step, design):
    values = [0.1 + step * each for each in steps]
    angles = (0, 90) if design is Design.SYMMETRY else ()
    fine = fm.StateTolerance(place=1e-7, speed=1e-7)
    plan = plan_measurements(values, values, values, design=design, base_angles=angles, repeats=1, tolerance=fine)
    assert len(plan.states) == len(values) ** 3
    assert len(set(plan.recording.tolist())) == len(plan)
    assert not any("." in name for name in plan.states)


def test_a_plan_makes_a_dataset_that_is_accepted(tmp_path):
    """Names, repeats and roles of a plan pass the checks of an impacts table."""
    robot = fm.published_map("ur10e")
    for design in (Design.PAPER, Design.FULL_GRID):
        plan = plan_measurements((0.52, 0.89), (0.14, 0.46), (0.2, 0.4), design=design, expected_force=robot)
        dataset = fm.ImpactDataset.from_arrays(
            distance=plan.distance, height=plan.height, speed=plan.speed, peak_force=plan.expected_force,
            state=plan.state_id, repeat=plan.repeat, role=plan.role, recording=plan.recording,
        )  # fmt: skip
        assert fm.fit_force_map(dataset).fit.states.name
        np.testing.assert_allclose(fm.fit_force_map(dataset).coefficients, robot.coefficients, rtol=1e-6)


def test_states_above_the_device_range_and_beyond_reach_are_left_out_and_listed():
    robot = fm.published_map("ur10e")
    plan = plan_measurements(**UR10E, expected_force=robot, device=DEVICE, reach=0.95)
    everything = plan_measurements(**UR10E)
    assert len(plan.left_out) + len(plan.states) == len(everything.states) == 27
    assert not set(plan.states) & {line.split(":")[0] for line in sentences(plan.left_out)}
    assert np.all(plan.expected_force <= 497)
    assert "d520-h140-v400: 671 N expected, the device measures up to 497 N (range less error)" in sentences(
        plan.left_out
    )
    assert "d890-h460-v200: 1.002 m from the base, beyond the reach of 0.95 m" in sentences(plan.left_out)
    np.testing.assert_array_equal(plan.expected_force, robot.predict(plan.distance, plan.height, plan.speed))
    assert sentence(plan.expected_from) == "map 'ur10e'"
    assert [each.kind for each in plan.warnings] == [FindingKind.FORM_NOT_DETERMINED]  # at eight places are no bound
    assert plan_measurements(**UR10E, expected_force=robot, device=DEVICE).warnings == ()


def test_a_force_that_just_fits_the_device_is_measured():
    kept = plan_measurements(**UR10E, device=DEVICE, expected_force=lambda d, h, v: 497.0)
    assert len(kept.states) == 27
    with pytest.raises(InputError, match=r"no state is left to measure.*497"):
        plan_measurements(**UR10E, device=DEVICE, expected_force=lambda d, h, v: 497.01)


def test_few_states_are_refused_unless_their_number_is_named():
    weak = {"device": fm.Device(range=300.0, error=3.0), "expected_force": fm.published_map("ur10e")}
    said = {
        fm.CFM_2D: ("the bound is expected to lie 12 %", "the bound is expected to lie 12 %"),
        fm.CFM_3D: ("no tolerance bound can be had", "the states to train do not determine CFM_3D"),  # at eight places
    }
    for form, (refusal, warning) in said.items():
        with pytest.raises(InputError, match=f"found 13 to train, expected at least 18: {refusal}"):
            plan_measurements(**UR10E, **weak, form=form)
        plan = plan_measurements(**UR10E, **weak, form=form, states=13)
        assert len(plan.states) == 13
        assert f"13 states to train, fewer than 18: {warning}" in sentence(plan.warnings[0])
    with pytest.raises(InputError, match="found 12, expected 13, the number to train of this design"):
        plan_measurements(**UR10E, **weak, states=12)
    with pytest.raises(InputError, match="found 18, expected 27"):
        plan_measurements(**UR10E, states=18)


def test_hardly_more_states_than_coefficients_have_no_bound():
    weaker = {"device": fm.Device(range=230.0, error=3.0), "expected_force": fm.published_map("ur10e")}
    with pytest.raises(InputError, match="no tolerance bound can be had from fewer than 12 states of CFM_3D"):
        plan_measurements(**UR10E, **weaker)


def test_what_cannot_be_checked_is_said():
    assert plan_measurements(**UR10E).warnings == ()
    by_range, by_limit = sentences(plan_measurements(**UR10E, device=DEVICE, limit=140).warnings)
    assert "no state was checked against the device range" in by_range
    assert "nothing tells whether 140 N" in by_limit
    (unknown,) = sentences(plan_measurements(**UR10E, expected_force=StandardExpectation(30)).warnings)
    assert "device range is not stated" in unknown


@pytest.mark.parametrize("name", fm.PUBLISHED_MAPS)
@pytest.mark.parametrize("limit", [140.0, 280.0])
def test_the_proposed_speed_is_the_one_the_map_says(name, limit):
    """Against the closed-form crossing: floored, first rise only, places counted."""
    robot = fm.published_map(name)
    figures = FACTS[name]
    axes = [figures[f"training_{axis}"] for axis in ("distances_m", "heights_m", "speeds_mps")]
    plan = plan_measurements(*axes, design=Design.PAPER, expected_force=robot, limit=limit, device=DEVICE)
    places = [(d, h) for d in axes[0] for h in axes[1]]
    exceeding = [place for place in places if 1.1 * robot.predict(*place, 0.2) > limit]
    crossings = [robot.crossing_speed(*place, limit / 1.1) for place in exceeding]
    # Below the limit at 0.05 m/s, so rising through it later; 0.19 m/s would count as a repeat of 0.20 m/s.
    usable = [
        min(math.floor(100 * v) / 100, 0.18)
        for place, v in zip(exceeding, crossings, strict=True)
        if 1.1 * robot.predict(*place, 0.05) <= limit and v >= 0.05
    ]
    lines = [line for line in sentences(plan.warnings) if f"may be too fast for {limit:g} N" in line]
    if not exceeding:
        assert lines == []
        return
    (line,) = lines
    assert f"at {len(exceeding)} of 9 places: there 1.1 times the expected force exceeds the limit" in line
    assert f"planned at once ({min(usable):.2f} m/s, at {len(usable)} of these places) may cost" in line
    hopeless = len(exceeding) - len(usable)
    assert ("no speed from 0.05 m/s up" in line) == (hopeless > 0)
    assert "the map was measured from 0.2 m/s on; below, it is extrapolated" in line
    again = plan_measurements(
        axes[0], axes[1], [min(usable), *axes[2]], design=Design.PAPER, expected_force=robot, limit=limit
    )
    lines = [line for line in sentences(again.warnings) if f"may be too fast for {limit:g} N" in line]
    assert len(lines) == (hopeless > 0)
    assert all(f"at {hopeless} of 9 places" in line and "add " not in line for line in lines)


def test_a_limit_no_speed_is_expected_to_confirm():
    (line,) = sentences(
        plan_measurements(**UR10E, expected_force=lambda d, h, v: 150 + v, limit=140, device=DEVICE).warnings
    )
    assert "at 9 no speed from 0.05 m/s up would be within it" in line
    assert "add" not in line


def test_the_standards_model_is_doubled_because_maps_exceed_it():
    """The factor covers every state of every published grid."""
    for name, mass in (("ur10e", 30), ("kuka-iiwa7-30nm", 20), ("kuka-iiwa7-10nm", 20)):
        robot = fm.published_map(name)
        points = robot.measured_range.points
        standard = np.array([StandardExpectation(mass)(*point) for point in points.tolist()])
        assert 1.5 < np.max(robot.predict(*points.T) / standard) < 2.0
    expected = StandardExpectation(30)
    assert expected(0.5, 0.3, 0.3) == pytest.approx(318.2, abs=0.05)
    plan = plan_measurements(**UR10E, expected_force=expected, limit=140, device=DEVICE)
    overload, line = sentences(plan.warnings)
    rows = zip(plan.distance.tolist(), plan.height.tolist(), plan.speed.tolist(), strict=True)
    states = dict(zip(rows, plan.expected_force.tolist(), strict=True))
    above = sum(max(2 * force, force + 190) > DEVICE.range - DEVICE.error_or_default for force in states.values())
    assert overload.startswith(f"the device may be overloaded at {above} of {len(states)} planned states: at worst, at")
    assert 0 < above < len(states)
    assert "2 times the expected force" in line
    assert "planned at once (0.06 m/s, at" in line  # 0.1320 / 2
    assert "a robot's force does not vanish at rest, as the model's does" in line


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"distances": (0.5,)}, r"distances: found 1, expected \(lowest, highest\) or at least 3"),
        ({"distances": 0.5}, "distances: found 1"),
        ({"distances": ()}, "distances: found 0"),
        ({"distances": (520, 890)}, "distances: found 520, expected metres above 0 and up to 10; is it in mm"),
        ({"distances": (0.0, 0.5)}, "distances: found 0, expected metres above 0"),
        ({"speeds": (20, 40)}, "speeds: found 20, expected .* is it in mm/s or cm/s"),
        ({"distances": "far"}, "distances: found 'far'"),
        ({"distances": [[0.5, 0.6], [0.7, 0.8]]}, "distances: found an array of shape"),
        ({"heights": (0.1, math.nan)}, "heights: found nan"),
        ({"heights": (0.1, math.inf)}, "heights: found inf"),
        ({"heights": (0.100, 0.108)}, "heights: found 0.1 and 0.104, expected values more than 0.005 apart"),
        ({"heights": (0.1, 0.2, 0.2)}, "heights: found 0.2 and 0.2"),
        ({"speeds": (-0.1, 0.2)}, "speeds: found -0.1"),
        ({"speeds": (0.2, 0.21, 0.3)}, "speeds: found 0.2 and 0.21, expected values more than 0.01 apart"),
        ({"repeats": 0}, "repeats: found 0"),
        ({"repeats": 2.5}, "repeats: found 2.5"),
        ({"repeats": True}, "repeats: found True"),
        ({"reach": 0}, "reach: found 0"),
        ({"reach": math.nan}, "reach: found nan"),
        ({"reach": 0.1}, "no state is left to measure"),
        ({"limit": -1}, "limit: found -1"),
        ({"limit": math.inf}, "limit: found inf"),
        ({"limit": 498, "device": DEVICE}, "limit: found 498 N, expected at most 497 N"),
        ({"base_angles": (0, 90)}, "base angles: found 2, expected at most one"),
        ({"base_angles": (math.nan,)}, "base angles: found nan"),
        ({"design": "full-grid"}, "design: found 'full-grid'"),
        ({"design": Design.FULL_GRID}, "distances: found 3, expected .* at least 4"),
        ({"design": Design.SYMMETRY}, "base angles: found 0, expected at least two"),
        ({"design": Design.SYMMETRY, "base_angles": (0, 360.5)}, "base angles: found 0 and 360.5"),
        ({"expected_force": lambda d, h, v: math.nan}, "expected force: found nan N at d = "),
        ({"expected_force": lambda d, h, v: 0}, "expected force: found 0 N"),
    ],
)
def test_unusable_arguments_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        plan_measurements(**(UR10E | change))


def test_heights_may_be_below_the_base():
    plan = plan_measurements((0.5, 0.8), (-0.1, 0.2), (0.1, 0.3), design=Design.PAPER, base_angles=(30,))
    assert "d500-h-100-v100" in plan.states
    assert set(plan.base_angle) == {30.0}


# plan.csv


def same(one, other):
    for name in ("state_id", "repeat", "role", "distance", "height", "speed", "base_angle", "expected_force"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("design", Design)
def test_a_plan_survives_the_file(tmp_path, design):
    angles = (0, 90) if design is Design.SYMMETRY else ()
    values = (0.521, 0.7 + 1e-9, 0.8, 0.89), (0.1, 0.2, 0.3, 0.4), (0.1, 0.2, 0.3, 0.4)
    plan = plan_measurements(
        *((axis[0], axis[-1]) if design is Design.SPREAD else axis for axis in values),
        design=design, base_angles=angles, expected_force=fm.published_map("ur10e"),
    )  # fmt: skip
    write_plan(plan, tmp_path)
    same(read_plan(tmp_path), plan)
    same(read_plan(tmp_path / "plan.csv"), plan)
    header = (tmp_path / "plan.csv").read_text().splitlines()[0]
    assert header == ("recording,state_id,repeat,role,distance_m,height_m,speed_mps,base_angle_deg,expected_force_N")


def table(delimiter=",", decimal=".", **changes):
    """A plan of two runs; a change to None takes a column out."""
    columns = {
        "recording": ["a-r1", ""],
        "state_id": ["a", "b"],
        "repeat": ["1", "1"],
        "role": ["test", ""],
        "distance_m": ["0.5", "0.6"],
        "height_m": ["0.1", "0.1"],
        "speed_mps": ["0.2", "0.2"],
        "base_angle_deg": ["", "10"],
        "expected_force_N": ["", "123.5"],
    } | changes
    columns = {name: cells for name, cells in columns.items() if cells is not None}
    stream = io.StringIO()
    writer = csv.writer(stream, delimiter=delimiter)
    writer.writerow(columns)
    for row in zip(*columns.values(), strict=True):
        numeric = [cell.replace(".", decimal) if name[-2:] in ("_m", "ps", "_N") else cell
                   for name, cell in zip(columns, row, strict=True)]  # fmt: skip
        writer.writerow(numeric)
    return stream.getvalue()


def read(tmp_path, text):
    path = tmp_path / "plan.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_plan(path)


@pytest.mark.parametrize(
    "text",
    [
        table(),
        table(";", ","),
        table("\t", ","),
        table(";", "."),
        "\ufeff" + table(),
        table() + ",,,,,,,,\r\n",
        "".join(line + ";;\r\n" for line in table(";", ",").splitlines()),
    ],
)
def test_what_a_spreadsheet_saves_is_read(tmp_path, text):
    plan = read(tmp_path, text)
    assert plan.recording.tolist() == ["a-r1", "b-r1"]
    assert plan.role.tolist() == ["test", "train"]
    assert plan.distance.tolist() == [0.5, 0.6]
    np.testing.assert_array_equal(plan.expected_force, [math.nan, 123.5])
    np.testing.assert_array_equal(plan.base_angle, [math.nan, 10.0])
    assert (plan.left_out, plan.warnings, plan.expected_from) == ((), (), None)


def test_only_five_columns_are_needed(tmp_path):
    optional = dict.fromkeys(["recording", "role", "base_angle_deg", "expected_force_N"])
    plan = read(tmp_path, table(**optional))
    assert len(plan) == 2
    assert isinstance(plan, MeasurementPlan)


@pytest.mark.parametrize(
    ("text", "row", "column", "message"),
    [
        (table(distance_m=["0.5", "far"]), 3, "distance_m", "found 'far', expected a number"),
        (table(distance_m=["0.5", ""]), 3, "distance_m", "found ''"),
        (table(distance_m=["520", "0.6"]), 2, "distance_m", "metres above 0 and up to 10; is it in mm"),
        (table(speed_mps=["0", "0.2"]), 2, "speed_mps", "metres per second above 0"),
        (table(speed_mps=["nan", "0.2"]), 2, "speed_mps", "found 'nan'"),
        (table(expected_force_N=["-3", ""]), 2, "expected_force_N", "newtons"),
        (table(repeat=["1", "1.5"]), 3, "repeat", "found '1.5', expected a whole number"),
        (table(repeat=["1", ""]), 3, "repeat", "found ''"),
        (table(role=["test", "spare"]), 3, "role", "train or test"),
        (table(state_id=["a", ""]), 3, "state_id", "1 to 36 letters"),
        (table(state_id=["a", "b/c"]), 3, "state_id", "it names a file"),
        (table(state_id=["a", "b" * 37]), 3, "state_id", "it names a file"),
        (table(state_id=["a", "A"]), 3, "state_id", "more than capitals"),
        (table(recording=["a-r2", ""]), 2, "recording", "found 'a-r2', expected 'a-r1' or an empty cell"),
        (table(state_id=["a", "a"], distance_m=["0.5", "0.5"]), 3, "repeat", "again"),
        (table(state_id=["a", "a"], repeat=["1", "2"]), 2, "distance_m", "apart"),
        (table(distance_m=["0.5", "0.5"], role=["", ""]), 3, "state_id", "as close to 'a' as repeats may be"),
        (table(speed_mps=None), 1, "speed_mps", "the column is missing"),
        (table(note=["x", "y"]), 1, "note", "unknown column 'note', the nearest known ones are"),
        (table(distance_mm=["x", "y"]), 1, "distance_mm", "the nearest known ones are distance_m"),
        (table().replace("role", "repeat", 1), 1, "repeat", "twice"),
        (table(";", ",") + "b-r2;b;2;;0.6;0,1;0,2;;\r\n", 4, "distance_m", "one decimal sign"),
        (table() + "a-r2,a,2\r\n", 4, None, "found 3 cells, expected 9"),
        (table().splitlines()[0], 1, None, "a header and no run"),
        ("", None, None, "the file is empty"),
        (b"\xff\xfe\x00", 1, None, "not text in UTF-8"),
    ],
)
def test_bad_cells_are_refused_with_row_and_column(tmp_path, text, row, column, message):
    with pytest.raises(TableError, match=message) as caught:
        read(tmp_path, text)
    assert (caught.value.row, caught.value.column) == (row, column)
    assert caught.value.file == str(tmp_path / "plan.csv")


def test_a_missing_plan_is_named(tmp_path):
    with pytest.raises(InputError, match="there is no such file"):
        read_plan(tmp_path)


@settings(max_examples=150)
@given(st.data())
def test_no_file_leads_to_anything_but_a_plan_or_a_refusal(tmp_path_factory, data):
    text = table().encode()
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(len(text), start + 12)))
    broken = text[:start] + data.draw(st.binary(max_size=6)) + text[end:]
    try:
        plan = read(tmp_path_factory.mktemp("fuzz"), broken)
    except InputError:
        return
    assert len(set(plan.recording.tolist())) == len(plan) >= 1


# the sheet for the person at the robot


def test_the_sheet_names_every_run_once_and_fits_the_paper():
    robot = fm.published_map("ur10e")
    plan = plan_measurements(
        UR10E["distances"], (0.14, 0.46), (0.2, 0.3, 0.4), design=Design.PAPER,
        expected_force=robot, limit=140, reach=0.95, device=DEVICE,
    )  # fmt: skip
    lines = run_sheet(plan, robot.conditions)
    assert max(map(len, lines)) <= 100
    text = "\n".join(lines)
    rows = [line.split() for line in lines if "____" in line]
    assert [row[1] for row in rows] == plan.recording.tolist()
    assert [int(row[0]) for row in rows] == list(range(1, len(plan) + 1))
    assert [float(row[2]) for row in rows] == plan.distance.tolist()
    assert [int(row[6]) for row in rows] == np.round(plan.expected_force).tolist()
    assert [line for line in lines if line.startswith("v = ")] == ["v = 0.2 m/s", "v = 0.3 m/s", "v = 0.4 m/s"]
    flowing = " ".join(text.split())
    assert all(warning in flowing for warning in sentences(plan.warnings))
    assert all(line in flowing for line in sentences(plan.left_out))
    assert "device: CBSF-75-Basic" in text


def test_the_sheet_says_what_is_not_stated():
    lines = run_sheet(plan_measurements(**UR10E), fm.Conditions())
    for name in ("robot", "controller", "firmware", "device calibrated", "operator", "expected forces"):
        assert f"{name}: not stated" in lines
    assert any(line.startswith("force measuring device: model not stated, spring not stated") for line in lines)


def test_long_names_still_fit(tmp_path):
    name = "a" * 36
    plan = read(tmp_path, table(state_id=[name, "b"], recording=["", ""], repeat=["999", "1"]))
    lines = run_sheet(plan, fm.Conditions())
    assert max(map(len, lines)) <= 100
    assert any(f"{name}-r999" in line for line in lines)
