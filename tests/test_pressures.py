"""Files of a film or array: read as they are, refused where damaged, one figure by a named rule; campaigns of them."""

import csv
import json
import math
import re
import shutil

import numpy as np
import pytest

import forcemap as fm
from forcemap.campaigns.pressures import MeasuredPressure
from forcemap.campaigns.quantity import Quantity
from forcemap.lab.bench import simulate_impacts
from forcemap.lab.contact_surface import ContactSurface
from forcemap.lab.simulated_campaign import simulate_campaign
from forcemap.lab.simulated_device import SimulatedDevice
from forcemap.lab.virtual_robot import virtual_robot
from forcemap.recordings.film import Film
from forcemap.recordings.pressure_matrix import UNITS, PressureMatrix, largest_mean, read_pressure_matrix
from forcemap.verdicts.pressure_verdict import check_pressure
from sizes import FULL_SIZE

LAYOUTS = {  # delimiter, decimal sign, lines before the matrix
    "comma": (",", ".", "unit: {unit}\npitch: {pitch} mm\n"),
    "semicolon": (";", ",", "Film export\nDruck in {unit}\nRaster {pitch} mm\n\n"),
    "tab": ("\t", ".", ""),
}


def written(path, pressure, *, unit="N/cm2", layout="comma", pitch=1.0):
    """A file of pressures [N/cm^2] as a device may write it; the cells as they stand in it."""
    delimiter, sign, head = LAYOUTS[layout]
    cells = [[f"{value / UNITS[unit]:.4f}".replace(".", sign) for value in row] for row in pressure]
    pitch_text = f"{pitch:g}".replace(".", sign)
    text = head.format(unit=unit, pitch=pitch_text) + "\n".join(delimiter.join(row) for row in cells) + "\n"
    path.write_text(text, encoding="utf-8")
    return len(head.splitlines())


def dome(size, rng):
    """A contact somewhere on a film of size x size cells, shape (size, size)."""
    x, y = np.meshgrid(np.arange(size), np.arange(size))
    at = rng.uniform(0.3, 0.7, 2) * size
    depth = 1 - ((x - at[0]) ** 2 + (y - at[1]) ** 2) / (0.25 * size) ** 2
    return np.round(240 * np.sqrt(np.maximum(depth, 0.0)) * rng.uniform(0.9, 1.1, (size, size)), 2)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("unit", ["N/cm2", "kPa", "MPa"])
@pytest.mark.parametrize("size", [20, 73, 200])
def test_matrices_are_read_in_every_unit_and_layout(tmp_path, size, unit, layout):
    rng = np.random.default_rng(size)
    pressure = dome(size, rng)
    written(tmp_path / "run.csv", pressure, unit=unit, layout=layout, pitch=0.5)
    film = Film(unit=unit, pitch=0.5e-3, mean_over=1.0, range=600.0)
    matrix = read_pressure_matrix(tmp_path / "run.csv", film)
    np.testing.assert_allclose(matrix.pressure, pressure, atol=6e-5 * UNITS[unit])
    assert matrix.pitch == pytest.approx(0.5e-3)
    window = min(20, size)  # 10 mm
    sums = [
        pressure[i : i + window, j : j + window].sum()
        for i in range(size - window + 1)
        for j in range(size - window + 1)
    ]
    figure, above = matrix.peak(film)
    assert (figure, above) == (pytest.approx(max(sums) / 400, abs=1e-3), False)
    largest, _ = matrix.peak(Film(mean_over=0.0))
    assert largest == pytest.approx(pressure.max(), abs=6e-5 * UNITS[unit])


@pytest.mark.parametrize(
    ("damage", "said", "column"),
    [
        ("", "found '', expected a pressure", "3"),
        ("nan", "found 'nan', expected a pressure", "3"),
        ("-4.0", "found '-4.0', expected a pressure", "3"),
        ("1.0.0", "found '1.0.0', expected a pressure", "3"),
        ("12 N", "found '12 N', expected a pressure", "3"),
        ("1.0,2.0", "found 21 cells, expected 20", None),
    ],
)
def test_a_damaged_cell_is_refused_with_row_and_column(tmp_path, damage, said, column):
    first = written(tmp_path / "run.csv", dome(20, np.random.default_rng(1)))
    lines = (tmp_path / "run.csv").read_text().splitlines()
    row = first + 7
    cells = lines[row].split(",")
    cells[2] = damage
    lines[row] = ",".join(cells)
    (tmp_path / "run.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(fm.RecordingError, match=re.escape(said)) as refused:
        read_pressure_matrix(tmp_path / "run.csv")
    assert (refused.value.row, refused.value.column) == (row + 1, column)


def cut(lines):
    return [*lines[:-1], lines[-1][: len(lines[-1]) // 2]]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (cut, "cells, expected 20"),
        (lambda lines: lines[:3], "expected a matrix"),
        (lambda lines: lines[2:], "found the unit none"),
        (lambda lines: [lines[0], *lines[2:]], "found none between cells"),
        (lambda lines: ["unit: kPa", *lines], "found the unit N/cm2, kPa"),
        (lambda lines: ["pitch: 2 mm", *lines], "between cells, expected one distance"),
        (lambda lines: ["pitch: 1.27 m" if "pitch" in line else line for line in lines], "found none between cells"),
        (lambda lines: [*lines[:2], ",".join(str(i) for i in range(20)), *lines[3:]], "rise evenly, like positions"),
        (
            lambda lines: [*lines[:2], *(f"{i}.5,{line}" for i, line in enumerate(lines[2:]))],
            "rise evenly, like positions",
        ),
        (lambda lines: [*lines[:2], *(line.replace(",", " ; ") + ";x" for line in lines[2:])], "found 'x'"),
    ],
)
def test_what_could_be_read_wrongly_is_refused(tmp_path, change, said):
    written(tmp_path / "run.csv", dome(20, np.random.default_rng(2)))
    lines = (tmp_path / "run.csv").read_text().splitlines()
    (tmp_path / "run.csv").write_text("\n".join(change(lines)) + "\n")
    with pytest.raises(fm.RecordingError, match=re.escape(said)):
        read_pressure_matrix(tmp_path / "run.csv")


def test_mixed_decimal_signs_and_other_files_are_refused(tmp_path):
    file = tmp_path / "run.txt"
    for content, said in (
        (b"unit: kPa pitch: 1 mm\n1.0;2,0\n3.0;4.0\n", "one sign throughout"),
        (b"", "is empty"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1 workbook", "Excel workbook"),
        (b"unit: kPa\n5\n6\n7\n", "expected columns"),
    ):
        file.write_bytes(content)
        with pytest.raises(fm.RecordingError, match=said):
            read_pressure_matrix(file)


def test_averaging_is_a_named_rule():
    cells = np.zeros((30, 30))
    cells[10:16, 12:18] = 300.0  # 36 mm^2
    assert largest_mean(cells, 1e-3, 0.0) == 300.0
    assert largest_mean(cells, 1e-3, 1.0) == pytest.approx(108.0)  # of 10 x 10 cells
    assert largest_mean(cells, 1e-3, 0.3) == 300.0  # 5 x 5 cells fit, no more than the area
    assert largest_mean(cells, 0.9e-3, 1.0) == pytest.approx(300 * 36 / 121)
    for area in (-0.1, 1.01, math.nan):
        with pytest.raises(fm.InputError, match="averaging"):
            largest_mean(cells, 1e-3, area)
    with pytest.raises(fm.InputError, match="of a cell"):
        largest_mean(cells, 5e-3, 0.2)
    with pytest.raises(fm.InputError, match=r"state pressure.mean_over_cm2"):
        read_like(cells).peak(Film())


def read_like(cells):
    return PressureMatrix(cells, 1e-3)


def test_cells_at_the_range_and_below_what_the_film_shows():
    cells = np.zeros((20, 20))
    cells[4:8, 4:8] = 200.0
    film = Film(range=200.0, least=50.0, mean_over=1.0)
    figure, above = read_like(cells).peak(film)
    assert above
    assert figure == pytest.approx((16 * 200 + 84 * 50) / 100)  # what it does not show may be as much as 50
    assert read_like(0.9 * cells).peak(film)[1] is False


# -- campaigns


ROBOT = "iiwa7-like-30nm"


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    return filmed(tmp_path_factory.mktemp("films") / "campaign")


def filmed(folder, name=ROBOT, seed=3):
    """A campaign of an iiwa-like robot with films under a face of 0.8 cm^2, clamping with its preset's force."""
    plan = fm.plan_measurements((0.56, 0.86), (0.14, 0.46), (0.1, 0.35), repeats=2)
    device = SimulatedDevice(device=fm.Device(range=700.0, error=3.0, stiffness=75e3), sampling_rate=4000.0)
    robot, rng = virtual_robot(name), np.random.default_rng(seed)
    film = Film(sensor="film", range=900.0, least=5.0, error=0.05, mean_over=0.0)
    simulate_campaign(
        plan, robot, device, rng, folder, conditions=fm.Conditions(film=film), surface=ContactSurface(0.8)
    )
    fm.collect_campaign(folder)
    return folder


@pytest.fixture
def copy(campaign, tmp_path):
    return shutil.copytree(campaign, tmp_path / "campaign")


def truths(folder):
    rows = (folder / "truth.csv").read_text().splitlines()[1:]
    return {row["recording"]: row for row in csv.DictReader(rows)}


def test_collect_reads_the_films(campaign):
    dataset, true = fm.read_dataset(campaign), truths(campaign)
    names = [name.removesuffix(".csv") for name in dataset.recording]
    expected = np.array([float(true[name]["true_peak_pressure_N_per_cm2"]) for name in names])
    share = dataset.peak_pressure / expected
    assert dataset.pressures == len(dataset)
    assert np.all((share > 0.96) & (share < 1.15))  # the largest of some hundred noisy cells, and the film's scale
    assert dataset.binding.state == "bound"
    again = (campaign / "impacts.csv").read_bytes()
    fm.collect_campaign(campaign)
    assert (campaign / "impacts.csv").read_bytes() == again


def test_a_changed_removed_or_unknown_film_is_noticed(copy):
    file = sorted((copy / "pressures").iterdir())[0]
    text = file.read_text()
    file.write_text(re.sub(r"(?m)^0\.00;", "1.00;", text))
    _, dataset = fm.collect_campaign(copy)
    assert dataset.binding.refusal is not None
    assert "pressure_from was" in fm.sentence(dataset.binding.refusal)
    file.unlink()
    _, dataset = fm.collect_campaign(copy)
    assert "now it is 'none'" in fm.sentence(dataset.binding.refusal)
    (copy / "pressures" / "d1.csv").write_text(text)
    with pytest.raises(fm.InputError, match="expected that of a run or recording"):
        fm.collect_campaign(copy)


def test_a_damaged_film_stops_collect_and_names_the_cell(copy):
    file = sorted((copy / "pressures").iterdir())[0]
    file.write_text(file.read_text().replace("0.00;0.00;", "0.00;x;", 1))
    with pytest.raises(fm.RecordingError, match=rf"{file.name}, row 4, column 2: found 'x'"):
        fm.collect_campaign(copy)


@pytest.mark.parametrize("written_as", ["as it is", "other text"])
def test_a_film_that_is_a_copy_of_another_one_stops_collect(copy, written_as):
    """A low film in place of others would confirm any pressure, whatever its file is named and how it is written."""
    first, second = sorted((copy / "pressures").iterdir())[:2]
    text = first.read_text()
    second.write_text(text if written_as == "as it is" else text.replace(".00;", ".0;"))
    with pytest.raises(fm.InputError, match=rf"{second.name}: found the same pressures as in .*{first.name}"):
        fm.collect_campaign(copy)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("unit: N/cm2", "unit: psi"), "on the device, expected 85 % of that at least"),
        (("pitch: 1 mm", "pitch: 0.8 mm"), "on the device, expected 85 % of that at least"),
        (("pitch: 1 mm", "pitch: 1.00 mm"), ""),
    ],
)
@pytest.mark.parametrize("films", [60, 20, 1])
def test_films_that_show_less_than_the_force_stop_collect(copy, change, said, films):
    """Each shows more than half; those of some places alone gave speeds 13 % too high when their median counted."""
    for file in sorted((copy / "pressures").iterdir())[:films]:
        text = file.read_text()
        assert change[0] in text, text[:200]
        file.write_text(text.replace(*change))
    for name in ("recordings.csv", "impacts.csv"):
        (copy / name).unlink()
    if said:
        with pytest.raises(fm.InputError, match=said):
            fm.collect_campaign(copy)
    else:
        assert fm.collect_campaign(copy)[1].pressures == 60


def test_pressures_in_impacts_csv_are_bound_to_it(copy):
    table = copy / "impacts.csv"
    lines = table.read_text().splitlines()
    column = lines[0].split(",").index("peak_pressure_N_per_cm2")
    cells = lines[1].split(",")
    cells[column] = f"{0.9 * float(cells[column]):.2f}"
    table.write_text("\n".join([lines[0], ",".join(cells), *lines[2:]]) + "\n")
    assert "is not what forcemap collect wrote" in fm.sentence(fm.read_dataset(copy).binding.refusal)


def test_the_iiwa_like_robot_gets_quasi_static_speeds_and_never_a_transient_one(campaign):
    dataset = fm.read_dataset(campaign)
    assert dataset.phase_two.above_peak > 0
    assert {other.quantity for other in fm.fit_force_map(dataset).others} == {
        Quantity.PRESSURE,
        Quantity.CLAMPING_FORCE,
    }
    assert all(share <= 0.05 for share in above_limits(campaign, ROBOT))


def above_limits(folder, name):
    """Shares of the places with a quasi-static speed at which the robot, simulated, exceeds force and pressure."""
    force_map = fm.fit_force_map(fm.read_dataset(folder))
    case = {"bound": fm.ToleranceBound(), "limit": fm.force_limit("back_of_hand")}
    grid = np.meshgrid(np.linspace(0.58, 0.84, 14), np.linspace(0.16, 0.44, 15), indexing="ij")
    answer = fm.safe_speed(force_map, *grid, contact=fm.Contact.QUASI_STATIC, **case)
    given = np.isfinite(answer.speed)
    assert given.sum() > 40
    assert set(answer.governed_by[given]) <= {*Quantity}
    places = [axis[given] for axis in grid]
    impacts = simulate_impacts(virtual_robot(name), *places, answer.speed[given], duration=0.8)
    late = impacts.force[impacts.time >= 0.5].max(axis=0)
    transient = fm.safe_speed(force_map, *grid, contact=fm.Contact.TRANSIENT, **case)
    assert not np.isfinite(transient.speed).any()
    print(f"{given.sum()} of {given.size} places with a quasi-static speed", end=" ")
    pressure = ContactSurface(0.8).pressure(impacts.force.max(axis=0))
    return np.mean(np.fmax(impacts.peak_force, late) > 140.0), np.mean(pressure > 190.0)


def test_the_labs_truth_lies_below_the_bounds_of_all_quantities(campaign):
    assert all(share >= 0.95 for share, _ in below_bounds(campaign, ROBOT))


def below_bounds(folder, name):
    """Shares of states below their bounds, between the measured ones, too; and how far these lie above, the median."""
    force_map = fm.fit_force_map(fm.read_dataset(folder))
    axes = (np.linspace(0.57, 0.85, 8), np.linspace(0.15, 0.45, 8), np.linspace(0.11, 0.34, 6))
    states = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    truth = simulate_impacts(virtual_robot(name), *states.T, duration=0.8)
    for other, true, raised in (
        (force_map, truth.peak_force, 1.0),
        (force_map.other(Quantity.CLAMPING_FORCE), truth.force[truth.time >= 0.5].max(axis=0), 1.0),
        (force_map.other(Quantity.PRESSURE), ContactSurface(0.8).pressure(truth.force.max(axis=0)), 1.05),
    ):
        upper = raised * fm.ToleranceBound().upper(other, *states.T)
        yield np.mean(true <= upper), np.median(upper / true) - 1


@pytest.mark.parametrize("name", [ROBOT, "iiwa7-like-10nm"] if FULL_SIZE else ["iiwa7-like-10nm"])
@pytest.mark.parametrize("seed", [3, 4, 5] if FULL_SIZE else [3])
def test_six_campaigns_with_films(tmp_path, name, seed):
    folder = filmed(tmp_path / "campaign", name, seed)
    below, above = list(below_bounds(folder, name)), above_limits(folder, name)
    print(f"{name}, seed {seed}: ", *(f"{share:.3f} below, {over:.1%} over;" for share, over in below), "above", *above)
    assert all(share >= 0.95 for share, _ in below)
    assert all(share <= 0.05 for share in above)


def test_a_higher_clamping_force_leaves_fewer_places():
    robot = virtual_robot("iiwa7-like-30nm")
    state = (0.7, 0.3, np.array([0.1, 0.3]))
    usual, higher = (simulate_impacts(each, *state) for each in (robot, robot.with_hold_force(150.0)))
    assert np.all(higher.held_force > usual.held_force + 20)
    np.testing.assert_allclose(higher.peak_force[1:], usual.peak_force[1:], rtol=0.15)
    with pytest.raises(fm.InputError, match="retreat"):
        virtual_robot("ur10e-like").with_hold_force(100.0)


# -- commands


CASE = ("--area", "back_of_hand", "--contact", "quasi-static")


@pytest.fixture
def command(forcemap):
    """Run a command: (exit code, its words, what it printed)."""

    def call(*words):
        code, out, _ = forcemap(*words)
        return code, " ".join(out.split()), out

    return call


def test_commands_say_which_quantity_governs(command, campaign, tmp_path):
    code, words, _ = command("speed", campaign, "--distance", 0.84, "--height", 0.4, *CASE)
    assert code == 0
    assert "GOVERNS" in words
    assert "clamping force: the quasi-static limit of 140 N" in words
    code, _, text = command("speed", campaign, "--distance", 0.84, "--height", 0.4, *CASE, "--json")
    answer = json.loads(text)
    by_itself = {each["quantity"]: each for each in answer["quantities"]}
    assert by_itself.keys() == {"force", "pressure", "clamping_force"}
    assert answer["speed_mps"] == by_itself[answer["governed_by"]]["speed_mps"]
    assert answer["speed_mps"] == min(each["speed_mps"] for each in by_itself.values())
    code, words, _ = command("fit", campaign, "-o", tmp_path / "map.json")
    assert "also mapped: pressure [N/cm^2]" in words
    assert "also mapped: clamping force [N]" in words
    _, _, of_file = command("speed", tmp_path / "map.json", "--distance", 0.84, "--height", 0.4, *CASE, "--json")
    assert json.loads(of_file)["speed_mps"] == answer["speed_mps"]
    code, _, _ = command("speed-map", campaign, *CASE, "-o", tmp_path / "speeds.csv")
    rows = list(csv.DictReader((tmp_path / "speeds.csv").read_text().splitlines()))
    assert {row["governed_by"] for row in rows if row["outcome"] == "admissible"} <= {*Quantity}
    assert any(row["governed_by"] for row in rows)


def test_chances_to_confirm_are_said_to_be_of_the_force_alone_where_others_count(command, campaign, tmp_path):
    folder = shutil.copytree(campaign, tmp_path / "campaign")
    chances = "These are chances of the force alone: {} may miss its bound, too"
    _, words, _ = command("confirm", folder, *CASE)
    both = (Quantity.PRESSURE, Quantity.CLAMPING_FORCE)
    assert all(chances.format(each.words) in " ".join(words.split()) for each in both)
    _, words, _ = command("confirm", folder, "--limit-N", 140, "--contact", "quasi-static")
    assert chances.format(Quantity.PRESSURE.words) not in " ".join(words.split())


def test_the_report_says_that_pressure_was_held_against_its_map(command, campaign, tmp_path):
    folder = shutil.copytree(campaign, tmp_path / "campaign")
    code, _, _ = command("report", folder, "--area", "back_of_hand")
    page = (folder / "report.html").read_text()
    assert code == 0
    assert "pressure held against its own map" in page
    speeds = page.split('<section id="speeds">')[1].split("</section>")[0]
    assert "pressure not assessed" not in speeds  # of the standard's formula, in another section, it is said
    assert "peak pressure</small>" in speeds


def test_check_holds_the_film_of_a_recording_against_the_limit_of_pressure(command, copy):
    dataset = fm.read_dataset(copy)
    order = np.argsort(dataset.peak_pressure)
    gentle, hard = (dataset.recording[i] for i in (order[0], order[-1]))
    code, words, _ = command("check", copy / "recordings" / gentle, "--area", "thigh_muscle")
    assert "within, pressure: " in words
    assert "limit 250 N/cm^2 (quasi-static), error 5 % of the reading" in words
    assert "pressure is not assessed" not in words
    code, _, text = command("check", copy / "recordings" / hard, "--area", "back_of_hand", "--json")
    answer = json.loads(text)
    assert (code, answer["outcome"], answer["pressures"][0]["outcome"]) == (1, "exceeded", "exceeded")
    (copy / "pressures" / gentle).unlink()
    _, words, _ = command("check", copy / "recordings" / gentle, "--area", "thigh_muscle")
    assert "pressure is not assessed" in words
    _, words, _ = command("check", copy, "--area", "back_of_hand")
    assert "pressure is not assessed of 1 recordings" in words


@pytest.mark.parametrize(
    ("figure", "above", "outcome"),
    [(180.0, False, "within"), (181.0, False, "cannot_tell"), (199.0, False, "cannot_tell"), (200.0, False, "exceeded"),
     (150.0, True, "cannot_tell"), (300.0, True, "exceeded")],
)  # fmt: skip
def test_a_pressure_is_within_only_beyond_the_films_error(figure, above, outcome):
    measured = MeasuredPressure(figure, above, "run.csv", "")
    film, hand = Film(range=500.0, error=0.05), fm.force_limit("back_of_hand")  # 190 N/cm^2
    assert check_pressure(measured, hand, film=film).outcome == outcome


@pytest.mark.parametrize(
    ("error", "share", "outcome"),
    [(0.1, 0.82, "within"), (0.1, 0.80, "cannot_tell"), (0.2, 0.72, "cannot_tell"), (0.6, 0.51, "cannot_tell"),
     (0.6, 0.53, "within"), (0.9, 0.49, "cannot_tell")],
)  # fmt: skip
def test_a_film_that_shows_less_force_than_its_error_explains_is_within_no_limit(error, share, outcome):
    time = np.arange(0, 0.9, 1e-3)
    pulse = fm.Recording(
        time, 200 * np.exp(-(((time - 0.12) / 0.01) ** 2)), device=fm.Device(range=500.0, error=3.0, stiffness=75e3)
    )
    impact = fm.find_impact(pulse)
    measured = MeasuredPressure(50.0, False, "run.csv", "", most_force=share * impact.peak_force)
    film, hand = Film(range=500.0, error=error), fm.force_limit("back_of_hand")
    assert check_pressure(measured, hand, film=film, impacts=[impact]).outcome == outcome


def test_the_transient_limit_of_pressure_only_where_nothing_goes_on():
    measured, hand = MeasuredPressure(300.0, False, "run.csv", ""), fm.force_limit("back_of_hand")
    time = np.arange(0, 0.9, 1e-3)
    pulse = 200 * np.exp(-(((time - 0.12) / 0.01) ** 2))
    device = fm.Device(range=500.0, error=3.0, stiffness=75e3)
    for held, contact in ((0.0, "transient"), (60.0, "quasi-static")):
        force = pulse + held * (time > 0.13) * (1 - np.exp(-(time - 0.13) / 0.01))
        impact = fm.find_impact(fm.Recording(time, force, device=device))
        verdict = check_pressure(measured, hand, film=Film(range=500.0), impacts=[impact])
        assert verdict.contact == contact
    assert check_pressure(measured, hand, film=Film(range=500.0)).contact == "quasi-static"
