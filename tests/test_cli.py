"""The commands as a program sees them: JSON, exit codes, one line for every error."""

from __future__ import annotations

import csv
import inspect
import io
import json
import math
import re
import shlex
import shutil
import subprocess
import sys
from decimal import Decimal

import numpy as np
import pytest
import typer

import forcemap as fm
from forcemap.campaigns.examples import CLAMPING_EXAMPLES
from forcemap.campaigns.recordings_table import Use
from forcemap.cli.app import app, run
from forcemap.web.question import PathQuestion, ZoneSize
from forcemap.words import assumptions
from pulses import pulse, save, write_campaign
from sizes import FULL_SIZE

SPEED_KEYS = {
    "outcome", "reason", "speed_mps", "extrapolated_speed_mps", "limit_N", "limit_source", "contact", "bound",
    "bound_force_N", "predicted_force_N", "margin_10_speed_mps", "lowest_measured_speed_mps",
    "highest_measured_speed_mps", "measure_next", "assumptions", "map_sha256",
}  # fmt: skip
FIT_KEYS = {
    "form", "terms", "coefficients", "standard_errors", "states", "states_left_out", "samples", "censored_samples",
    "repeats", "rmse_N", "rmse_ln", "r_squared", "state_sd_percent", "accuracy",
}  # fmt: skip


def unwrapped(out):
    """What was printed, without the line breaks."""
    return " ".join(out.split())


def unwrapped_lines(out):
    """The lines that were printed, those that continue one added to it."""
    return re.sub(r"\n    +(?=\S)", " ", out).splitlines()


COMMANDS = ("demo", "fit", "evaluate", "compare", "limits", "speed", "speed-map")


AT = ("--distance", 0.8, "--height", 0.4)
HAND = ("--area", "back_of_hand", "--contact")


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_one_example(forcemap, name):
    code, out, _ = forcemap(name, "--help")
    assert code == 0
    assert out.count("Example: forcemap " + name) == 1
    assert "--json" in out
    assert forcemap(name, "-h") == (0, out, "")


def test_speed_of_a_published_map(ask):
    code, found = ask("speed", "ur10e", *AT, *HAND, "transient")
    assert code == 0
    assert set(found) >= SPEED_KEYS
    assert found["outcome"] == "admissible"
    assert found["speed_mps"] == pytest.approx(0.3212, abs=2e-4)
    assert found["limit_N"] == 280
    assert found["contact"] == "transient"
    assert found["bound"] == {"kind": "margin", "margin": 0.10}
    assert found["bound_force_N"] == pytest.approx(280, abs=1e-6)
    assert found["margin_10_speed_mps"] == found["speed_mps"]
    assert found["extrapolated_speed_mps"] is None
    assert found["map_sha256"] == fm.map_sha256(fm.published_map("ur10e"))
    text = " ".join(found["assumptions"])
    for word in ("person at rest", "direction", "contact site", "tool", "payload", "safety settings", "pressure not",
                 "ISO/TS 15066:2016", "Phase II"):  # fmt: skip
        assert word in text


@pytest.mark.parametrize(
    ("arguments", "code", "outcome"),
    [
        (("ur10e", *AT, *HAND, "quasi-static"), 1, "unconfirmed"),
        (("ur10e", "--distance", 0.3, "--height", 0.4, *HAND, "transient"), 1, "outside"),
        (("kuka-iiwa7-30nm", *AT, *HAND, "transient"), 1, "unconfirmed"),
        (("ur10e", *AT, "--area", "temple", "--contact", "transient"), 1, "not_permitted"),
        (("ur10e", *AT, "--region", "face", "--contact", "quasi-static"), 1, "not_permitted"),
        (("ur10e", *AT, "--limit-N", 450), 0, "capped"),
        (("ur10e", *AT, "--limit-N", 280, "--bound", "margin", "--margin", 0.0), 0, "admissible"),
    ],
)
def test_outcomes_and_exit_codes(ask, arguments, code, outcome):
    found_code, found = ask("speed", *arguments)
    assert (found_code, found["outcome"]) == (code, outcome)
    assert set(found) >= SPEED_KEYS
    assert (found["speed_mps"] is None) == (code == 1)
    assert found["reason"]


def test_a_refused_place_says_what_the_map_has_there_and_what_was_measured_nearest(ask, forcemap, tmp_path):
    """Against the map and the table themselves; what permits nothing stands under another name than a permission."""
    folder = fm.copy_example("ur10e", tmp_path / "work")
    place = ("--distance", 0.55, "--height", 0.2)
    code, found = ask("speed", folder, *place, *HAND, "quasi-static")
    assert (code, found["outcome"], found["bound_force_N"]) == (1, "unconfirmed", None)
    dataset = fm.read_dataset(folder)
    force_map = fm.fit_force_map(dataset)
    low = found["lowest_measured_speed_mps"]
    upper = fm.ToleranceBound(device_error=dataset.conditions.device.error_or_default).upper(force_map, 0.55, 0.2, low)
    lowest = found["at_lowest"]
    assert (lowest["speed_mps"], lowest["bound_force_N"]) == (low, pytest.approx(upper, rel=1e-9))
    assert lowest["predicted_force_N"] == pytest.approx(force_map.predict(0.55, 0.2, low), rel=1e-9)
    assert lowest["bound_force_N"] > found["limit_N"] > 0
    away = np.hypot(dataset.distance - 0.55, dataset.height - 0.2)
    here = away <= away.min() + 1e-9
    assert {round(each["speed_mps"], 3) for each in found["nearest"]} == set(np.unique(dataset.speed[here]).round(3))
    for each in found["nearest"]:
        of_state = here & np.isclose(dataset.speed, each["speed_mps"])
        assert each["force_N"] == pytest.approx(dataset.peak_force[of_state].max())
        assert each["at_least"] == bool(dataset.censored[of_state].any())
    out = unwrapped(forcemap("speed", folder, *place, *HAND, "quasi-static")[1])
    assert (
        f"{lowest['bound_force_N']:.1f} N at {fm.floor_speed(low)} m/s at contact, the lowest of the map there" in out
    )
    assert f"measured at d = {found['nearest'][0]['distance_m']:.3f} m" in out
    assert "for this place alone, measure at it (docs/contact_points.md)" in out
    permitted = ask("speed", folder, *AT, *HAND, "transient")[1]
    assert (permitted["at_lowest"], permitted["outcome"]) == (None, "admissible")
    assert ask("speed", "ur10e", *AT, *HAND, "quasi-static")[1]["nearest"] == []  # a published map has no states


def test_where_to_measure_next(ask):
    _, found = ask("speed", "ur10e", *AT, *HAND, "quasi-static")
    assert found["measure_next"]["speed_mps"] == found["extrapolated_speed_mps"] == pytest.approx(0.1381, abs=2e-4)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("speed", "nothing.csv", *AT, "--limit-N", 100), "no such file"),
        (("speed", "ur10e", *AT), "expected one of --area"),
        (("speed", "ur10e", *AT, "--limit-N", 100, "--area", "temple"), "expected one of --area"),
        (("speed", "kuka-iiwa7-30nm", *AT, "--limit-N", 280), "--contact"),
        (("speed", "ur10e", *AT, "--area", "palm", "--contact", "transient", "--quasi-static-limit-N", 9), "--limit-N"),
        (("speed", "ur10e", *AT, "--area", "back_of_hand"), "--contact transient"),
        (("speed", "ur10e", *AT, "--area", "hnad", "--contact", "transient"), "nearest"),
        (("speed", "ur10e", *AT, "--limit-N", "nan"), "limit"),
        (("speed", "ur10e", *AT, "--limit-N", 498), "device"),
        (("speed", "ur10e", "--distance", "nan", "--height", 0.4, "--limit-N", 100), "place"),
        (("speed", "ur10e", "--distance", "far", "--height", 0.4, "--limit-N", 100), "--distance"),
        (("speed", "ur10e", *AT, "--limit-N", 100, "--bound", "tolerance"), "tolerance bound"),
        (("speed", "ur10e", *AT, "--limit-N", 100, "--margin", -0.5), "margin"),
        (("fit", "ur10e-nothing"), "no such file"),
        (("limits", "forhead"), "nearest"),
        (("frobnicate",), "No such command"),
        (("speed-map", "ur10e", "--limit-N", 100, "-o", "speeds.txt"), ".csv or .json"),
        (("demo", "--example", "ur20"), "ur10e"),
    ],
)
def test_errors_are_one_line_and_json(ask, forcemap, arguments, part):
    code, found = ask(*arguments)
    assert code == 2
    assert set(found["error"]) == {"kind", "message", "file", "row", "column"}
    _, out, err = forcemap(*arguments)
    assert out == ""
    assert part in err
    assert "Traceback" not in err


def test_table_errors_name_file_row_and_column(ask, tmp_path):
    path = tmp_path / "impacts.csv"
    path.write_text("distance_m,height_m,speed_mps,peak_force_N\n0.5,0.2,fast,200\n")
    code, found = ask("fit", path)
    assert code == 2
    assert (found["error"]["file"], found["error"]["row"], found["error"]["column"]) == (str(path), 2, "speed_mps")


def test_fit_writes_only_when_asked(ask, forcemap, example_folders, tmp_path):
    folder = example_folders["ur10e"]
    before = sorted(folder.rglob("*"))
    code, found = ask("fit", folder)
    assert code == 0
    assert set(found) >= FIT_KEYS
    assert sorted(folder.rglob("*")) == before
    assert found["form"] == "CFM_3D"
    assert found["states"] + found["states_left_out"] == 27
    assert found["samples"] + found["censored_samples"] == 81
    assert found["repeats"] == 3
    assert found["accuracy"]["on"] == "test states"
    assert found["simulated"] is True
    path = tmp_path / "map.json"
    code, out, _ = forcemap("fit", folder, "-o", path)
    assert code == 0
    assert "SIMULATED" in out
    again = fm.read_map(path)
    assert again.coefficients.tolist() == found["coefficients"]
    # a table, a folder and the map fitted to it say the same
    speeds = [ask("speed", s, *AT, *HAND, "transient") for s in (folder, folder / "impacts.csv", path)]
    assert [found["accuracy"].pop("on") for _, found in speeds] == ["test states", "test states", "leave-one-state-out"]
    for _, found in speeds:
        del found["accuracy"]
    assert speeds[0] == speeds[1] == speeds[2]
    assert speeds[0][1]["bound"]["kind"] == "tolerance"
    assert speeds[0][1]["assumptions"][0].startswith("SIMULATED")


@pytest.mark.parametrize(("state", "factor", "above"), [("d587-h315-v265", 1.3, True), ("d890-h460-v200", 1.15, False)])
def test_fit_names_the_state_that_is_missed_by_more_than_the_bound_adds(
    ask, forcemap, example_folders, tmp_path, state, factor, above
):
    """And says whether it lies above the bound of the whole map, or was only hard to predict without itself."""
    rows = list(csv.DictReader((example_folders["ur10e"] / "impacts.csv").read_text().splitlines()))
    rows = [row for row in rows if row["role"] == "train"]
    for row in rows:
        row["peak_force_N"] = str(float(row["peak_force_N"]) * (factor if row["state_id"] == state else 1.0))
    table = tmp_path / "hot.csv"
    table.write_text("\n".join([",".join(rows[0]), *(",".join(row.values()) for row in rows)]) + "\n")
    found, out = ask("fit", table)[1], " ".join(forcemap("fit", table)[1].split())
    assert found["accuracy"]["worst_state"] == state
    dataset = fm.read_dataset(table)
    force_map, states = fm.fit_force_map(dataset), dataset.states
    bound = fm.ToleranceBound(device_error=dataset.conditions.device.error_or_default)
    upper = bound.upper(force_map, states.distance, states.height, states.speed)
    over = [name for name, force, at_most in zip(states.name, states.force, upper, strict=True) if force > at_most]
    assert found["states_above_bound"] == over == [state] * above
    assert (f"(at {state}, WHICH LIES ABOVE THE BOUND of the map, too" in out) == above
    assert (f"(at {state}, left out for that; in the map it counts, whose bound lies above it)" in out) != above
    assert (f"above the bound of this map: {state}; look at" in out) == above


def test_states_above_the_device_range_are_new_at_other_places_whatever_their_names(ask, forcemap, tmp_path):
    """Names S1, S2, ... are given by order: they mean nothing between tables."""

    def table(file, places):
        rows = [f"{n},{d},{h},{v},{min(f, 400)},{str(f > 400).lower()}" for n, d, h, v, f in places]
        (tmp_path / file).write_text("\n".join(["state_id,distance_m,height_m,speed_mps,peak_force_N,censored", *rows]))
        return tmp_path / file

    places = [(d, h, v) for d in (0.5, 0.7, 0.9) for h in (0.15, 0.3, 0.45) for v in (0.2, 0.3, 0.4)]
    own = [(f"S{i}", d, h, v, 1300 * v * (1.4 - d)) for i, (d, h, v) in enumerate(places)]
    hot = next(name for name, *_, force in own if force > 400)
    forcemap("fit", table("own.csv", own), "-o", tmp_path / "map.json")
    cold = {"S18": hot, hot: "S18"}  # the other end of the workspace, where 130 N are expected
    moved = [(cold.get(n, n), d + 0.02, h + 0.02, v - 0.02, 401 if n == "S18" else 0.9 * f) for n, d, h, v, f in own]
    found = ask("evaluate", table("moved.csv", moved), "--map", tmp_path / "map.json")[1]
    assert found["new_states"] == 27
    assert hot in found["new_states_above_bound"]
    (tmp_path / "copy.csv").write_text((tmp_path / "own.csv").read_text() + "\n")
    assert ask("evaluate", tmp_path / "copy.csv", "--map", tmp_path / "map.json")[1]["new_states"] == 0


def test_every_command_takes_the_limits_of_the_table_that_the_campaign_names(
    ask, forcemap, example_folders, tmp_path, monkeypatch
):
    """The report has them: a program made by the standard's higher ones would be faster than what is signed."""
    folder = shutil.copytree(example_folders["ur10e"], tmp_path / "own")
    asked = ("--area", "back_of_hand", "--contact", "transient")
    place = ("--distance", "0.8", "--height", "0.4")
    before = ask("speed", folder, *place, *asked)[1]
    columns = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor"
    (folder / "mine.csv").write_text(
        f"# edition: own\n# source: own\n# version: 1\n{columns}\nback_of_hand,hand,hand_fingers,190,110,2\n"
    )
    stated = folder / "campaign.toml"
    stated.write_text(stated.read_text().replace("[standard]", '[standard]\nlimit_table = "mine.csv"'))
    for source in (folder, folder / "impacts.csv"):
        found = ask("speed", source, *place, *asked)[1]
        assert (before["limit_N"], found["limit_N"]) == (280, 220)
        assert found["speed_to_program_mps"] is None or found["speed_to_program_mps"] < before["speed_to_program_mps"]
        assert not any("names the limit table" in warning for warning in found["warnings"])
        standard = ask("speed", source, *place, *asked, "--limit-N", "280")[0]
        assert standard == 2  # one of --area and --limit-N
    assert ask("speed-map", folder, *asked)[1]["limit_N"] == 220
    assert "220 N" in forcemap("compare", folder, "--area", "back_of_hand")[1]
    assert "220 N" in forcemap("export", folder, "--format", "urscript", *asked)[1]
    (folder / "path.csv").write_text("x_m,y_m,z_m\n0.8,0,0.42\n0.8,0,0.36\n")
    assert {piece["limit_N"] for piece in ask("path", folder, folder / "path.csv", *asked)[1]["pieces"]} == {220.0}
    save(folder / "recordings" / "run.csv", *pulse(250.0, rate=2000.0))
    (tmp_path / "elsewhere.csv").write_text((folder / "recordings" / "run.csv").read_text())
    for file, more in ((folder / "recordings" / "run.csv", ()), (tmp_path / "elsewhere.csv", ("--campaign", folder))):
        code, out, _ = forcemap("check", file, "--area", "back_of_hand", "--contact", "transient", *more)
        assert (code, out[:8], "220 N transient, 110 N quasi-static" in out) == (1, "EXCEEDED", True)
    monkeypatch.chdir(folder)  # a published map is of no folder, whatever lies in it
    assert ask("speed", "ur10e", *place, *asked)[1]["limit_N"] == 280
    (folder / "atlas.toml").write_text('schema = "forcemap-atlas/1"\nmaps = ["../down"]\n')
    shutil.copytree(example_folders["ur10e"], tmp_path / "down")
    out = forcemap("speed", folder, *place, *asked)[1]  # of other campaigns, which name no table
    assert "280 N, transient contact" in " ".join(out.split())
    assert "220 N" not in out
    (folder / "atlas.toml").unlink()
    (folder / "mine.csv").unlink()
    code, _, error = forcemap("speed", folder, *place, *asked)
    assert code == 2
    assert "found 'mine.csv', which is no file of this folder" in error


def test_an_export_says_that_it_takes_the_place_of_an_earlier_one(forcemap, tmp_path):
    """In a folder of KRL the files have one name, whatever the limit: a program keeps the tables that it was given."""
    instead = "in place of an earlier one: take that out of the robot's program, too"
    for area, earlier in (("back_of_hand", 0), ("thigh_muscle", 2)):
        export = ("export", "ur10e", "--format", "krl", "--area", area, "--contact", "transient", "-o", tmp_path)
        code, out, _ = forcemap(*export)
        assert (code, " ".join(out.split()).count(instead)) == (0, earlier)


def test_a_map_of_other_impacts_is_held_first_against_the_states_inside_its_range(
    ask, forcemap, example_folders, tmp_path
):
    """Beyond it the map is continued, and its errors there say nothing of what it permits."""
    rows = list(csv.DictReader((example_folders["ur10e"] / "impacts.csv").read_text().splitlines()))
    for row in rows[::3]:
        row["state_id"], row["distance_m"] = f"far-{row['state_id']}", str(float(row["distance_m"]) + 0.5)
    (tmp_path / "far.csv").write_text("\n".join([",".join(rows[0]), *(",".join(row.values()) for row in rows)]) + "\n")
    inside, every = ask("evaluate", tmp_path / "far.csv", "--map", "ur10e")[1]["accuracies"]
    assert (inside["on"], every["on"]) == ("states inside the measured range", "all states")
    assert 6 <= inside["states"] < every["states"]
    assert inside["max_overestimation_percent"] < every["max_overestimation_percent"] or (
        inside["max_underestimation_percent"] < every["max_underestimation_percent"]
    )


def test_evaluate_counts_the_states_above_the_bound(ask, forcemap, example_folders, tmp_path):
    """Those that a map was not fitted to; the map of another robot is exceeded at many."""
    rows = list(csv.DictReader((example_folders["ur10e"] / "impacts.csv").read_text().splitlines()))
    fitted = {row["state_id"] for row in rows if row["role"] == "train"}
    hot = next(row["state_id"] for row in rows if row["state_id"] not in fitted and row["censored"] == "false")
    for row in rows:
        row["peak_force_N"] = str(float(row["peak_force_N"]) * (1.2 if row["state_id"] == hot else 1.0))
    table = tmp_path / "hot.csv"
    table.write_text("\n".join([",".join(rows[0]), *(",".join(row.values()) for row in rows)]) + "\n")
    found = ask("evaluate", table)[1]
    assert found["new_states_above_bound"] == [hot]
    states = fm.read_dataset(table).independent_test.states
    assert found["new_states"] == len(states)
    above = f"{np.sum(states.impacts == 0)} above the device range"
    assert f"1 of the {len(states)} states that the map was not fitted to ({above}) lie above the tolerance bound" in (
        " ".join(forcemap("evaluate", table)[1].split())
    )
    assert ask("evaluate", table, "--map", "ur10e")[1]["new_states_above_bound"] is None
    forcemap("fit", table, "-o", tmp_path / "own.json")
    own = ask("evaluate", table, "--map", tmp_path / "own.json")[1]
    assert own["new_states"] == len(fm.read_dataset(table).states) - 27
    assert own["new_states_above_bound"] == [hot]
    rows = fm.read_dataset(table)
    few = tmp_path / "few.csv"
    names = [*rows.train.states.name, *rows.independent_test.states.name[:5]]
    fm.write_dataset(rows.select(np.isin(rows.state, names)), few)
    for source, first in ((table, "states not fitted"), (few, "all states")):  # of few the largest error tells little
        assert ask("evaluate", source, "--map", tmp_path / "own.json")[1]["accuracies"][0]["on"] == first
    out = " ".join(forcemap("evaluate", few, "--map", tmp_path / "own.json")[1].split())
    assert "27 of which the map was fitted to" in out
    (tmp_path / "campaign.toml").write_text('schema = "forcemap-campaign/1"\n[robot]\nspeed_error = 0.02\n')
    again = ask("evaluate", table, "--map", tmp_path / "own.json")[1]  # other speeds, the same table: still its own
    assert again["new_states"] == own["new_states"]
    map_file = tmp_path / "map.json"
    forcemap("fit", example_folders["kuka-iiwa7-30nm"], "-o", map_file)
    force_map = fm.read_map(map_file)
    bound = fm.ToleranceBound(device_error=force_map.conditions.device.error_or_default)
    states = fm.read_dataset(table).states
    upper = bound.upper(force_map, states.distance, states.height, states.speed)
    above = np.fmax(states.force, np.nan_to_num(states.at_least)) > upper
    assert above.sum() > 8
    assert ask("evaluate", table, "--map", map_file)[1]["new_states_above_bound"] == list(np.array(states.name)[above])
    assert f" and {above.sum() - 8} more" in " ".join(forcemap("evaluate", table, "--map", map_file)[1].split())


def test_states_as_close_as_repeats_are_named(ask, forcemap, example_folders, tmp_path):
    text = (example_folders["ur10e"] / "impacts.csv").read_text()
    table = tmp_path / "near.csv"
    table.write_text(text.replace("d890-h460-v200,3,train,0.89", "other,1,train,0.893"))
    words = "134 names of 133 states (as close as repeats and so one: d890-h460-v200 with other)"
    count = len({line.split(",")[0] for line in text.splitlines() if ",train," in line or ",test," in line})
    words = words.replace("134", str(count + 1)).replace("133", str(count))
    for command in ("fit", "evaluate"):
        assert words in ask(command, table)[1]["states_found"]
        assert words in " ".join(forcemap(command, table)[1].split())


def test_fit_without_test_rows_reports_leave_one_state_out(ask, paper_grids, tmp_path):
    fm.write_dataset(paper_grids["kuka-iiwa7-10nm"].train, tmp_path / "impacts.csv")
    _, found = ask("fit", tmp_path / "impacts.csv", "--form", "log-speed")
    assert found["form"] == "LOG_SPEED"
    assert found["accuracy"]["on"] == "leave-one-state-out"
    code, found = ask("fit", tmp_path / "impacts.csv", "--form", "full_cubic")
    assert (code, found["error"]["kind"]) == (2, "rank_deficient")


def test_too_few_degrees_of_freedom_is_a_refusal(ask, examples, tmp_path):
    train = examples["kuka-iiwa7-10nm"].train
    names = np.random.default_rng(1).permutation(train.states.uncensored.name)[:11]
    fm.write_dataset(train.select(np.isin(train.state, names)), tmp_path / "impacts.csv")
    code, found = ask("speed", tmp_path / "impacts.csv", *AT, "--limit-N", 200)
    assert (code, found["error"]["kind"]) == (2, "bound_not_available")


def test_evaluate(ask, example_folders):
    _, found = ask("evaluate", example_folders["ur10e"])
    in_turn = ["leave-one-state-out", "leave-one-place-out"]
    assert [a["on"] for a in found["accuracies"]] == ["test states", *in_turn, "all states"]
    assert found["places"] == 14
    _, found = ask("evaluate", example_folders["ur10e"], "--map", "ur10e")
    assert (found["places"], found["place_correlation"], found["own_sd_percent"]) == (None, None, None)
    assert found["accuracies"][0]["max_underestimation_percent"] < 10


def test_compare(ask, forcemap, example_folders, tmp_path, examples):
    hand = ("compare", example_folders["ur10e"], "--area", "hand_fingers")
    lines = unwrapped_lines(forcemap(*hand)[1])
    first, second, *doubts = [*lines[:2], *(line[4:] for line in lines if line.startswith("  ! "))]
    _, found = ask(*hand)
    of_map, standard = found["allowed"][0], found["allowed"][2]
    permitted = forcemap("speed-map", example_folders["ur10e"], *hand[2:], "--contact", "transient")[1]
    assert set(doubts) <= {line[4:] for line in unwrapped_lines(permitted)}
    assert len(doubts) == len(found["warnings"]) > 0
    assert first.startswith(f"The map beside the standard: transient, {of_map['limit_N']:g} N: permits more than ")
    assert f" at {of_map['places_with_more']} of {of_map['places']} measured places, less at " in first
    assert of_map["places_with_more"] + of_map["places_with_less"] == of_map["confirmed_places"]
    assert (of_map["places_with_more"] > 0) == (of_map["highest_speed_mps"] > standard["highest_speed_mps"])
    assert standard["places_with_more"] is None
    assert "SIMULATED" in first
    assert second.startswith("  SIMULATED impacts: ")
    assert [m["model"] for m in found["models"]] == ["CFM_3D", "CFM_2D", "CFM_2D per height", "contact model"]
    assert {"underestimated_share", "most_underestimated"} <= set(found["models"][-1])
    _, free = ask(*hand, "--body", "free")
    standard = [r["highest_speed_mps"] for r in free["allowed"] if r["model"] == "contact model"]
    assert standard == pytest.approx([1.35, 0.67], abs=0.01)
    fm.write_dataset(examples["ur10e"], tmp_path / "impacts.csv")
    for options, missing in (((), "--area"), (("--area", "chest"), "--moving-mass-kg")):
        code, found = ask("compare", tmp_path / "impacts.csv", *options)
        assert code == 2
        assert missing in found["error"]["message"]


def test_limits(ask):
    _, found = ask("limits")
    assert len(found["limits"]) == 29
    _, found = ask("limits", "back_of_hand", "--moving-mass-kg", 30)
    (limit,) = found["limits"]
    assert (limit["quasi_static_N"], limit["transient_N"], limit["permitted"]) == (140, 280, True)
    assert limit["contact_model"]["quasi_static_speed_mps"] == pytest.approx(0.1320, abs=5e-5)
    _, found = ask("limits", "back_of_hand", "--moving-mass-kg", 30, "--contact-area-cm2", 0.5)
    assert found["limits"][0]["contact_model"]["quasi_static_governed_by"] == "pressure"
    _, found = ask("limits", "temple", "--moving-mass-kg", 30)
    assert found["limits"][0]["permitted"] is False
    assert found["limits"][0]["quasi_static_N"] is None
    assert found["limits"][0]["contact_model"] is None


def test_a_users_own_limit_table_is_named(ask, tmp_path):
    path = tmp_path / "ours.csv"
    path.write_text(
        "# edition: our edition\n"
        "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor\n"
        "glove,Glove,hand_fingers,200,200,1\n"
    )
    _, found = ask("speed", "ur10e", *AT, "--area", "glove", "--contact", "transient", "--limit-table", path)
    assert found["limit_N"] == 200
    assert "our edition" in found["limit_source"]
    assert "our edition" in " ".join(found["assumptions"])


def test_speed_map_as_csv_and_json(ask, forcemap, tmp_path):
    code, found = ask("speed-map", "ur10e", *HAND, "transient", "--step-m", 0.1, "-o", tmp_path / "speeds.csv")
    assert code == 0
    rows = list(csv.DictReader(io.StringIO((tmp_path / "speeds.csv").read_text())))
    assert len(rows) == len(found["places"]) == sum(found["counts"].values())
    for row, place in zip(rows, found["places"], strict=True):
        assert row["outcome"] == place["outcome"]
        assert float(row["limit_N"]) == 280
        assert row["map_sha256"] == found["map_sha256"]
        if place["speed_mps"] is None:
            assert row["speed_mps"] == ""
        else:
            shown = Decimal(row["speed_mps"])
            assert shown <= Decimal(repr(place["speed_mps"])) < shown + Decimal("0.001")
        assert "person at rest" in row["assumptions"]
    assert found["fastest"]["speed_mps"] == max(p["speed_mps"] for p in found["places"] if p["speed_mps"])
    forcemap("speed-map", "ur10e", *HAND, "transient", "-o", tmp_path / "speeds.json")
    assert (
        json.loads((tmp_path / "speeds.json").read_text())["counts"]
        == ask("speed-map", "ur10e", *HAND, "transient")[1]["counts"]
    )
    assert ask("speed-map", "ur10e", *HAND, "quasi-static")[0] == 1
    code, found = ask("speed-map", "ur10e", "--area", "temple", "--contact", "transient")
    assert (code, found["outcome"]) == (1, "not_permitted")


def test_text_floors_what_json_carries(ask, forcemap):
    _, found = ask("speed", "ur10e", *AT, *HAND, "transient")
    _, out, _ = forcemap("speed", "ur10e", *AT, *HAND, "transient")
    assert out.startswith(f"Program at most {fm.floor_speed(found['speed_to_program_mps'])} m/s at d = ")
    assert f"\n  contact  {fm.floor_speed(found['speed_mps'])} m/s with 0.01 m/s overshoot: " in out
    assert "Assumes" in out


@pytest.mark.parametrize("example", fm.EXAMPLE_CAMPAIGNS if FULL_SIZE else fm.EXAMPLE_CAMPAIGNS[2:])
def test_demo(ask, forcemap, tmp_path, example):
    folder = tmp_path / "campaign"
    code, found = ask("demo", folder, "--example", example)
    assert code == 0
    raw = sorted((folder / "recordings").iterdir())
    assert set(found["files"]) == {
        "accuracy.json", "campaign.toml", "comparison.json", "impacts.csv", "maps/cfm_3d.json", "plan.csv",
        "recordings.csv", "report.html", "report.sha256", "path.csv", "table_path.csv", "task.toml",
        "speeds-quasi-static.csv", "speeds-quasi-static.json", "speeds-transient.csv",
        "speeds-transient.json", "summary.txt", "truth.csv", f"recordings/ ({len(raw)} files)",
    }  # fmt: skip
    campaign, dataset = fm.read_campaign(folder), fm.read_dataset(folder)
    assert len(raw) == len(campaign.plan) == len(campaign.entries)
    lost = [entry for entry in campaign.entries if entry.use is not Use.USED]
    # a robot that pushes on until it reacts: one of its 90 flat tops may have been cut off
    assert len(lost) == {"kuka-iiwa7-30nm": 1}.get(example, 0)
    assert all("or be cut off" in entry.reason for entry in lost)
    assert len(campaign.missing) == len(lost) == len(raw) - len(dataset)
    bundled = fm.read_dataset(fm.copy_example(example, tmp_path / "bundled"))
    assert (campaign.plan.places, len(campaign.plan.states), campaign.plan.set_ups, len(raw)) == (14, 27, 17, 90)
    for name in ("distance", "height", "speed"):
        ends = [(each.min(), each.max()) for each in (getattr(campaign.plan, name), getattr(bundled, name))]
        assert ends[0] == ends[1]
    published = fm.published_map(example).predict(dataset.distance, dataset.height, dataset.speed)
    whole = ~dataset.censored
    np.testing.assert_allclose(dataset.peak_force[whole], published[whole], rtol=0.17)
    summary = (folder / "summary.txt").read_text()
    lines = summary.splitlines()
    head, *doubts = [unwrapped(part) for part in summary.partition("\nback_of_hand")[0].split("\n  ! ")]
    verdict, _, simulated = head.partition(" SIMULATED impacts: ")
    findings = fm.assess_campaign(folder, limits=[fm.force_limit("back_of_hand")]).findings
    many = "doubt" if len(findings) == 1 else f"{len(findings)} doubts"
    assert verdict.endswith(f"; SIMULATED; first read the {many} below")
    assert simulated == "not a measurement of any robot"
    assert doubts[0].startswith("NOT CONFIRMED") == (example == "ur10e")  # without a speed there is nothing to confirm
    assert any(doubt.startswith("SPEED COMMANDED") for doubt in doubts)
    assert len(doubts) == len(findings)
    doubted = fm.FindingKind.FORM_DOUBTED in {each.kind for each in findings}
    assert doubted == (example == "ur10e")  # forces of the lab are of a form of their own
    assert "\nback_of_hand, transient, 280 N: " in summary
    assert max(map(len, lines)) <= 100
    assert "contact model" in summary
    assert fm.read_map(folder / "maps" / "cfm_3d.json").fit
    path = ask("path", folder, folder / "path.csv", "--task", folder / "task.toml")[1]
    assert (path["permitted"], path["too_fast"]) == (True, True)  # the last segment is to be slowed down
    code, out, err = forcemap("demo", folder)
    assert (code, out) == (2, "")
    assert "holds files already" in err


def test_examples_are_asked_what_their_impacts_allow(forcemap, example_folders, tmp_path):
    for name, folder in example_folders.items():
        clamps = fm.read_dataset(folder).phase_two.transient_refusal(math.inf, 0.0) is not None
        assert clamps == (name in CLAMPING_EXAMPLES)
        asked = {segment.contact for segment in fm.read_task(folder / "task.toml").segments if segment.areas}
        assert asked == {fm.Contact.QUASI_STATIC if clamps else fm.Contact.TRANSIENT}
    out = forcemap("demo", tmp_path / "clamps", "--example", CLAMPING_EXAMPLES[-1])[1]
    steps = (
        out.partition("\nNext (its impacts clamp: quasi-static, thigh_muscle):\n")[2].replace(" \\\n", "").splitlines()
    )
    assert [run(shlex.split(step)[1:]) for step in steps[:2]] == [0, 1]  # 1: programmed too fast, as in the example


def test_demo_picks_a_free_folder(demo):
    assert [path.name for path in (demo / "cell" / "forcemap-demo").iterdir()] == ["mine.txt"]
    assert (demo / "cell" / "forcemap-demo" / "mine.txt").read_text() == "kept"
    assert sorted(path.name for path in (demo / "cell").iterdir()) == ["forcemap-demo", "forcemap-demo-2"]
    assert (demo / "cell" / "forcemap-demo-2" / "report.html").exists()


def test_as_a_program():
    """Through the installed script: stdout and stderr apart, the exit code, a closed pipe."""
    script = [sys.executable, "-m", "forcemap"]
    found = subprocess.run([*script, "speed", "ur10e", "--distance", "0.8", "--height", "0.4", "--area", "palm",
                            "--contact", "quasi-static"],
                           capture_output=True, text=True)  # fmt: skip
    assert found.returncode == 1
    assert found.stdout.startswith(
        "No speed to program at d = 0.8 m, h = 0.4 m: unconfirmed; first read the 3 doubts below\n  ! FIXED MARGIN"
    )
    assert found.stderr == ""
    assert subprocess.run([*script], capture_output=True, text=True).returncode == 2
    piped = subprocess.run(f"{sys.executable} -m forcemap limits | head -1",
                           shell=True, capture_output=True, text=True)  # fmt: skip
    assert piped.stderr == ""
    for options in ((), ("--json",)):  # closed before anything is printed: what a reader has not read is no answer
        with subprocess.Popen(
            [*script, "limits", *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as gone:
            gone.stdout.close()
            assert gone.stderr.read() == ""
        assert gone.returncode == 141


@pytest.mark.parametrize(("missing", "command"), [("typer", "limits"), ("pydantic", "limits"), ("uvicorn", "serve")])
def test_what_is_not_installed_is_said(missing, command, tmp_path):
    code = f"import sys; sys.modules[{missing!r}] = None; from forcemap.cli import main; main()"
    arguments = [command, *([str(tmp_path)] if command == "serve" else ["--json"])]
    found = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True)
    words = f"this needs the package {missing}; install it from the project's folder: pip install '.[app]'"
    assert (found.returncode, found.stderr) == (2, f"error: {words}\n")
    if command != "serve":
        error = json.loads(found.stdout)["error"]
        assert error == {"kind": "missing_extra", "message": words, "file": None, "row": None, "column": None}


def test_results_do_not_overwrite_measurements(forcemap, example_folders, tmp_path):
    table = tmp_path / "impacts.csv"
    table.write_bytes((example_folders["ur10e"] / "impacts.csv").read_bytes())
    path = tmp_path / "map.json"
    before = table.read_bytes()
    for arguments in (("fit", table), ("speed-map", table, "--limit-N", 200)):
        code, _, err = forcemap(*arguments, "-o", table)
        assert code == 2
        assert "not overwritten" in err
    assert forcemap("fit", table, "-o", path)[0] == 0
    assert forcemap("fit", table, "-o", path)[0] == 0  # an earlier result of the same kind
    assert forcemap("speed-map", table, "--limit-N", 300, "-o", path)[0] == 2
    assert table.read_bytes() == before
    assert fm.read_map(path).fit


def test_phase_two_that_was_not_recorded_stands_beside_the_speed(forcemap, ask, examples, tmp_path):
    columns = examples["ur10e"].to_frame().drop(columns="scenario")
    columns.to_csv(tmp_path / "impacts.csv", index=False)
    command = ("speed", tmp_path / "impacts.csv", *AT, "--device-spring-N-per-mm", 75, *HAND)
    code, found = ask(*command, "transient")
    assert code == 0
    assert "Phase II not measured" in found["reason"]
    _, out, _ = forcemap(*command, "transient")
    assert "! PHASE II NOT MEASURED: nothing shows that contact does not clamp" in " ".join(out.split())
    assert "PHASE II NOT MEASURED" not in forcemap(*command, "quasi-static")[1]
    (line,) = [line for line in out.splitlines() if line.startswith("  contact ")]
    assert "Phase II not measured" in " ".join(out[out.index(line) : out.index("\n  limit ")].split())
    assert "Phase II" not in ask(*command, "quasi-static")[1]["reason"]


def test_what_the_advice_says_of_a_map_file_without_a_spring_gives_a_speed(forcemap, ask, examples, tmp_path):
    table, path = tmp_path / "impacts.csv", tmp_path / "map.json"
    examples["ur10e"].to_frame().to_csv(table, index=False)
    assert forcemap("fit", table, "-o", path)[0] == 0
    command, spring = ("speed", path, *AT, *HAND, "transient"), ("--device-spring-N-per-mm", 75)
    code, found = ask(*command)
    advice = "forcemap fit IMPACTS --device-spring-N-per-mm N -o MAP.json"
    assert (code, found["speed_mps"]) == (1, None)
    assert advice in found["reason"]
    code, refused = ask(*command, *spring)
    assert code == 2
    assert advice in refused["error"]["message"]
    assert advice in ask("estimate", path, *AT, "--speed-mps", 0.25, "--area", "back_of_hand")[1]["error"]["message"]
    said = {"IMPACTS": table, "N": 75, "MAP.json": path}
    assert forcemap(*(said.get(word, word) for word in advice.split()[1:]))[0] == 0
    assert ask(*command)[1]["speed_mps"] == ask("speed", table, *AT, *HAND, "transient", *spring)[1]["speed_mps"]


@pytest.mark.parametrize("option", ["--device-spring-N-per-mm", "--limit-spring-N-per-mm"])
def test_a_spring_in_newtons_a_metre_is_no_spring_in_newtons_a_millimetre(forcemap, example_folders, option):
    newtons = ("--limit-N", 140, "--contact", "quasi-static")
    code, _, err = forcemap("speed", example_folders["ur10e"], *AT, *newtons, option, 9000)
    assert code == 2
    assert "expected 1000 to 1e+06 N/m (75 N/mm are 75000 N/m)" in err


@pytest.mark.parametrize(
    "command",
    [
        ("speed", "ur10e"),
        ("check", "impacts.csv"),
        ("speed-map", "ur10e"),
        ("path", "ur10e", "p.csv"),
        ("confirm", "c"),
    ],
    ids=lambda command: command[0],
)
@pytest.mark.parametrize("option", ["--area", "--region", "--area=9000", "--limit-table"])
def test_a_number_is_no_body_area(forcemap, command, option):
    """Taken as newtons it would permit what the area does not."""
    code, _, err = forcemap(*command, option, *([] if "=" in option else [9000]))
    assert code == 2
    assert "found 9000" in err


def test_a_form_of_file_that_export_does_not_know(forcemap):
    code, _, err = forcemap("export", "ur10e", "--format", "scaling", *HAND, "transient")
    assert code == 2
    assert (
        err
        == "error: Invalid value for '--format': 'scaling' is not one of 'csv', 'json', 'urscript', 'krl', 'safety'.\n"
    )


def test_a_task_with_the_head_among_its_areas_gives_nothing(forcemap, example_folders, tmp_path):
    """Neither a speed along the path, nor a program, nor factors."""
    (tmp_path / "p.csv").write_text("x_m,y_m,z_m\n0.8,0,0.45\n0.8,0,0.30\n")
    segment = '[[segments]]\nname = "path"\nareas = ["back_of_hand", "temple"]\nclamping_possible = false\n'
    (tmp_path / "t.toml").write_text(f'schema = "forcemap-task/1"\n{segment}')
    ur10e, path, task = example_folders["ur10e"], tmp_path / "p.csv", ("--task", tmp_path / "t.toml")
    code, out, err = forcemap("path", ur10e, path, *task)
    assert (code, err) == (1, "")
    assert "NOT PERMITTED on 100 % of the path" in out
    for command in (("export", ur10e, "--format", "urscript"), ("export-path", ur10e, path)):
        code, out, _ = forcemap(*command, *task, "-o", tmp_path / "program")
        assert code == 1
        assert "contact with temple is not permitted" in " ".join(out.split())
        assert not (tmp_path / "program").exists()


def test_repeats_that_disagree_are_named(ask, examples, tmp_path):
    frame = examples["ur10e"].to_frame()
    frame.loc[0, "peak_force_N"] *= 1.2
    frame.to_csv(tmp_path / "impacts.csv", index=False)
    assert ask("fit", tmp_path / "impacts.csv")[1]["disagreeing_repeats"] == [frame.loc[0, "state_id"]]


def test_collect_names_repeats_that_disagree_above_the_device_range_too(ask, forcemap, tmp_path):
    """A saturated recording in another's place is no outlier: its force is not known."""
    folder = write_campaign(tmp_path / "cell", repeats=2)
    run = str(fm.read_plan(folder).recording[0])
    time, force = pulse(900.0, rate=1000.0)
    save(folder / "recordings" / f"{run}.csv", time, np.minimum(force, 500.0))
    found = ask("collect", folder)[1]
    assert found["disagreeing_repeats"] == [run.rpartition("-r")[0]]
    assert f"repeats lie more than 10 % apart, look at their recordings: {run.rpartition('-r')[0]}" in " ".join(
        forcemap("collect", folder)[1].split()
    )


def test_a_campaign_most_of_which_cannot_be_read_is_to_be_mended_first(forcemap, tmp_path):
    folder = write_campaign(tmp_path / "cell")
    assert "Next: forcemap fit" in forcemap("collect", folder)[1]
    (tmp_path / "other").mkdir()
    other = write_campaign(tmp_path / "other" / "cell")
    for file in sorted((other / "recordings").iterdir())[:14]:
        file.write_text("no recording")
    assert "Next: mend what keeps most recordings from being used" in forcemap("collect", other)[1]


def test_impacts_in_another_runs_place_are_said_to_be(forcemap, tmp_path):
    folder = write_campaign(tmp_path / "cell", repeats=3)
    run = fm.read_plan(folder).recording[4]
    save(folder / "recordings" / f"{run}.csv", *pulse(20.0, rate=1000.0))
    said = " ".join(forcemap("collect", folder)[2].split())
    assert f"of recording {run}.csv" in said
    assert "is it in another unit, or of another run (recordings one place off in the order of the runs)?" in said


def test_a_map_of_impacts_that_clamp_is_for_quasi_static_contact_alone(ask, forcemap, example_folders):
    for name, folder in example_folders.items():
        said = " ".join(forcemap("fit", folder)[1].split())
        clamps = name in CLAMPING_EXAMPLES
        assert (ask("fit", folder)[1]["transient_refused"] is not None) == clamps, name
        assert ("FOR QUASI-STATIC CONTACT ALONE" in said) == clamps
        assert ("--contact transient" in said) == (not clamps)


def test_the_head_in_compare_and_the_version(ask, forcemap, example_folders):
    code, found = ask("compare", example_folders["ur10e"], "--region", "face")
    assert (code, found["permitted"], found["allowed"]) == (0, False, [])
    assert forcemap("--version")[1] == f"forcemap {fm.__version__}\n"


@pytest.mark.parametrize("arguments", [("--form", "CFM_2D"), ("--limit-table", "mine.csv")])
def test_options_that_would_be_ignored_are_refused(forcemap, arguments):
    code, _, err = forcemap("speed", "ur10e", *AT, "--limit-N", 200, *arguments)
    assert code == 2
    assert "goes with" in err or "go with" in err


def test_an_unconfirmed_place_of_a_campaign_names_what_plans_its_measurements(forcemap, simulated):
    near = ["--distance", "0.6", "--height", "0.25", "--area", "back_of_hand"]
    plans = "next     forcemap next plans what to measure for this limit"
    found = [forcemap("speed", source, *near, "--contact", "quasi-static")[:2] for source in (simulated, "ur10e")]
    assert [(code, plans in out) for code, out in found] == [
        (1, True),
        (1, False),
    ]


def test_unconfirmed_places_say_why_and_where_to_measure(forcemap):
    _, out, _ = forcemap("speed-map", "ur10e", *HAND, "quasi-static")
    assert "unconfirmed: the bound exceeds" in out
    assert "measure next" not in out  # `forcemap next` says that
    assert (
        len(re.findall(r"^  d = .* m: about 0\.\d{3} m/s$", out.partition("only just missing (hints, no p")[2], re.M))
        == 3
    )
    _, out, _ = forcemap("speed-map", "kuka-iiwa7-30nm", *HAND, "transient")
    assert "impacts that clamp: 369" in out


def test_without_a_speed_the_commonest_reason_is_named(ask, forcemap, example_folders):
    limit = ("--limit-N", 150, "--limit-spring-N-per-mm", 75, "--contact", "quasi-static")
    asked = ("speed-map", example_folders["kuka-iiwa7-10nm"], *limit, "--overshoot-mps", 0.05)
    found = ask(*asked)[1]
    reasons = [place["to_program_reason"] for place in found["places"]]
    commonest = max(set(reasons), key=reasons.count)
    assert found["to_program_reason"] != commonest  # that of the place where least is missing
    first = " ".join(forcemap(*asked)[1].split()).partition("; ")[0]
    at = f" (the reason at {reasons.count(commonest)} of {len(reasons)} places"
    assert first.startswith(f"No speed to program at any place: {commonest}{at}")


def test_fit_says_what_censored_impacts_change(ask, forcemap, example_folders, tmp_path):
    folder, path = example_folders["ur10e"], tmp_path / "map.json"
    _, found = ask("fit", folder)
    assert found["censored_fit"] is True
    assert {"coefficients", "predicted_at_censored_N", "predicted_with_censored_N"} <= set(found["discard_fit"])
    assert sum(found["discard_fit"]["at_censored"]["censored"]) == found["censored_samples"]
    assert "if discarded [N]" in forcemap("fit", folder)[1]
    code, discarded = ask("fit", folder, "--discard-censored", "-o", path)
    assert code == 0
    assert discarded["censored_fit"] is False
    assert "discard_fit" not in discarded
    assert discarded["coefficients"] == found["discard_fit"]["coefficients"] == fm.read_map(path).coefficients.tolist()


def test_select_over_several_tables(ask, forcemap, examples, example_folders, paper_grids, tmp_path):
    """The figures are those of the library's selection; one table is a selection, too."""
    code, found = ask("select", *example_folders.values())
    assert code == 0
    selection = fm.select_terms([examples[name] for name in example_folders])
    assert found["paper_counts"] == [19, 13, 8]
    assert found["counts"] == list(selection.counts)
    assert found["terms"] == [str(term) for term in selection.terms]
    assert [len(step["rmse_N"]) for step in found["steps"]] == [3] * len(selection.steps)
    assert found["steps"][-1]["rmse_N"] == list(selection.steps[-1].rmse)
    assert len(found["survival"]) == 19
    assert found["stable"] is False
    assert found["simulated"] is True
    _, out, _ = forcemap("select", example_folders["ur10e"])
    out = unwrapped(out)
    assert "19, 13, 8" in out
    assert "not stable" in out
    assert "no fit uses it" in out
    fm.write_dataset(paper_grids["ur10e"].train, tmp_path / "impacts.csv")
    code, found = ask("select", example_folders["ur10e"], tmp_path / "impacts.csv")
    assert code == 2
    assert "training states alone" in found["error"]["message"]
    assert found["error"]["file"].endswith("impacts.csv")
    assert "forcemap select" in forcemap("fit", tmp_path / "impacts.csv", "--select")[2]


def test_evaluate_forms(ask, forcemap, example_folders):
    _, found = ask("evaluate", example_folders["kuka-iiwa7-10nm"], "--forms")
    assert found["recommended"] == "CFM_3D"
    names = [each["form"] for each in found["forms"]] + [each["form"] for each in found["refused"]]
    assert set(names) == {"CFM_2D", "EUCLIDEAN_2D", "CFM_3D", "LOG_SPEED", "FULL_CUBIC"}
    out = forcemap("evaluate", example_folders["kuka-iiwa7-10nm"], "--forms")[1]
    assert "Recommended: CFM_3D" in out
    assert "no form is clearly better" in out
    assert "p below 0.0033, 1 % shared among the 3 other forms" in " ".join(out.split())
    _, found = ask("evaluate", example_folders["ur10e"], "--forms")
    errors = {each["form"]: each["error_percent"] for each in found["forms"]}
    assert errors["LOG_SPEED"] < errors["CFM_3D"]
    out = " ".join(forcemap("evaluate", example_folders["ur10e"], "--forms")[1].split())
    assert "Recommended: CFM_3D" in out
    assert f'all the same, state form = "LOG_SPEED" below [map] in {example_folders["ur10e"]}/campaign' in out
    assert "states of role test at other places have to confirm it" in out


def test_evaluate_and_compare_say_which_states_lie_above_the_device_range(ask, forcemap, example_folders):
    folder = example_folders["ur10e"]
    words = (["evaluate", folder], ["compare", folder, "--area", "back_of_hand"])
    of_evaluate, of_compare = (ask(*command)[1] for command in words)

    def counted(name, accuracy):
        return f"{name} {accuracy['censored_underestimated']} of {accuracy['censored_states']}"

    said = [counted(each["on"], each) for each in of_evaluate["accuracies"] if each["censored_states"]]
    assert said[0].endswith(" of 8")
    of_models = []
    for model in of_compare["models"]:
        if model["accuracy"]["censored_states"]:
            of_models.append(counted(model["model"], model["accuracy"]))
        if model["accuracy_all"] and model["accuracy_all"]["censored_states"]:
            of_models.append(counted(f"{model['model']}, all states", model["accuracy_all"]))
    for command, counts in zip(words, (said, of_models), strict=True):
        out = " ".join(forcemap(*command)[1].split())
        head = "not compared: states above the device range; predicted below what they reached, the dangerous side: "
        assert head + "; ".join(counts) in out
    all_states = of_evaluate["accuracies"][-1]["censored_states"]
    assert all_states == 9
    assert {model["accuracy_all"]["censored_states"] for model in of_compare["models"][:2]} == {all_states}


def test_evaluate_against_an_older_map(ask, forcemap, examples, tmp_path):
    """Fitted to the train states; the test states are new, and hold unless their forces rise."""
    dataset, path, table = examples["ur10e"], tmp_path / "map.json", tmp_path / "impacts.csv"
    fm.write_map(fm.fit_force_map(dataset), path)
    new = dataset.independent_test
    new = new.select(np.isin(new.state, new.states.uncensored.name[::7]))
    frame = new.to_frame()
    frame.to_csv(table, index=False)
    code, found = ask("evaluate", table, "--against", path)
    assert (code, found["outcome"]) == (0, "holds")
    assert {"mean_ratio", "detectable_change_percent", "states", "left_out", "assumptions"} <= set(found)
    assert all(each["lowest_expected_N"] < each["predicted_N"] for each in found["states"])
    out = forcemap("evaluate", table, "--against", path)[1]
    assert out.startswith("HOLDS: no change found")
    assert "; SIMULATED\n" in out.replace("\n    ", " ").partition("\n  ! ")[0] + "\n"
    raised = frame.assign(peak_force_N=(1.1 * frame["peak_force_N"]).clip(upper=499))
    raised.to_csv(table, index=False)
    code, found = ask("evaluate", table, "--against", path)
    assert (code, found["outcome"]) == (1, "does_not_hold")
    assert "dangerous" in found["reason"]
    frame[frame["state_id"].isin(frame["state_id"].unique()[:2])].to_csv(table, index=False)
    code, out, err = forcemap("evaluate", table, "--against", path)
    assert (code, err) == (2, "")
    assert "CANNOT TELL" in out
    code, found = ask("evaluate", table, "--against", "ur10e")
    assert (code, found["error"]["kind"]) == (2, "bound_not_available")


def test_compare_two_maps(ask, forcemap, example_folders):
    code, found = ask("compare", "kuka-iiwa7-30nm", "kuka-iiwa7-10nm")
    assert code == 0
    assert found["mean_ratio"] == pytest.approx(0.95, abs=0.005)
    assert {"ratio", "distance_m", "height_m", "speed_mps", "one_N", "other_N"} == set(found["smallest"])
    out = forcemap("compare", "kuka-iiwa7-30nm", "kuka-iiwa7-10nm")[1]
    assert "on average: -5.1 %" in out
    assert "30 Nm" in out
    assert ask("compare", "ur10e", example_folders["ur10e"])[1]["mean_ratio"] == pytest.approx(1, abs=0.03)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("evaluate", "{ur10e}", "--forms", "--map", "ur10e"), "at most one"),
        (("evaluate", "{ur10e}", "--forms", "--form", "CFM_2D"), "leave --form out"),
        (("evaluate", "{ur10e}", "--against", "{ur10e}"), "expected new ones"),
        (("compare", "ur10e", "kuka-iiwa7-10nm", "--region", "face"), "go with one impacts table"),
        (("compare", "ur10e", "nothing"), "no such file"),
    ],
)
def test_options_of_map_checks_that_do_not_go_together(forcemap, example_folders, arguments, part):
    code, _, err = forcemap(*(argument.format(**example_folders) for argument in arguments))
    assert code == 2
    assert part in err


@pytest.fixture
def few(examples, tmp_path):
    """A table of six states."""
    train = examples["kuka-iiwa7-10nm"].train
    path = tmp_path / "few.csv"
    fm.write_dataset(train.select(np.isin(train.state, train.states.uncensored.name[::5][:6])), path)
    return path


@pytest.mark.parametrize(
    "command",
    [
        "fit {few}",
        "evaluate {few}",
        "evaluate {few} --map {few}",
        "evaluate {few} --against {few}",
        "compare {few} --area chest --moving-mass-kg 30",
    ],
)
def test_too_few_states_name_the_table_and_a_form_that_would_do(forcemap, few, command):
    code, _, err = forcemap(*command.format(few=few).split())
    assert code == 2
    assert err.startswith(f"error: {few}: found 6 measured states, expected at least 9")
    assert "--form CFM_2D (4 coefficients, knows no height)" in err
    assert forcemap("fit", few, "--form", "CFM_2D")[0] == 0


def test_a_form_that_would_do_is_one_that_fits(forcemap, paper_grids, tmp_path):
    dataset = paper_grids["kuka-iiwa7-10nm"].train
    fm.write_dataset(dataset.select(np.isin(dataset.state, dataset.states.name[:2])), tmp_path / "two.csv")
    assert "--form" not in forcemap("fit", tmp_path / "two.csv")[2]
    fm.write_dataset(dataset, tmp_path / "all.csv")
    assert "--form CFM_3D (9 coefficients)" in forcemap("fit", tmp_path / "all.csv", "--form", "FULL_CUBIC")[2]


def test_evaluate_forms_recommends_nothing_without_a_bound(forcemap, few):
    code, out, err = forcemap("evaluate", few, "--forms")
    assert (code, err) == (2, "")
    head, _, reasons = out.partition("\n  SIMULATED impacts: not a measurement of any robot\n")
    assert head == "Recommended: none; SIMULATED"
    assert reasons.startswith("  CFM_3D cannot be fitted (found 6 measured states")
    assert "EUCLIDEAN_2D: terms 1, v, r, r^2 with r = sqrt(d^2 + h^2)" in out
    assert all(line.startswith("  ") for line in reasons.split("\n\n")[0].splitlines())
    code, out, _ = forcemap("evaluate", few, "--forms", "--json")
    found = json.loads(out)
    assert (code, found["recommended"]) == (2, None)
    assert len(found["reasons"]) == 3


def test_forces_that_share_the_largest_value_are_pointed_out(ask, forcemap, examples, tmp_path):
    frame = examples["ur10e"].train.to_frame().drop(columns="censored")
    frame["peak_force_N"] = frame["peak_force_N"].clip(upper=400.0)
    path = tmp_path / "impacts.csv"
    frame.to_csv(path, index=False)
    sharing = frame[frame["peak_force_N"] == 400.0]
    words = f"{len(sharing)} impacts of {sharing['state_id'].nunique()} states share the largest force, 400 N"
    assert f"  ! {words}: was the device saturated? mark them censored" in unwrapped_lines(forcemap("fit", path)[1])
    assert ask("fit", path)[1]["saturation_doubt"].startswith(words)
    force_map = fm.fit_force_map(fm.read_dataset(path))
    basis = fm.safe_speed(force_map, 0.7, 0.3, limit=300.0, bound=fm.ToleranceBound()).basis
    statements = assumptions([basis])
    assert any("states share the largest force, 400 N" in line for line in statements)
    frame.assign(censored=frame["peak_force_N"] == 400.0).to_csv(path, index=False)
    assert ask("fit", path)[1]["saturation_doubt"] is None


def test_the_table_of_what_censored_impacts_change_stands_before_the_coefficients(forcemap, example_folders):
    out = forcemap("fit", example_folders["ur10e"])[1]
    assert "27 states, 81 impacts, 3 of them saturated (counted as at least that force)" in out
    before, _ = out.split("ln F = sum")
    assert "the wider bound comes from the 1 added state" in before
    rows = {line.split("  ")[0]: line.split()[-1] for line in before.splitlines() if line}
    assert (rows["states"], rows["impacts"]) == ("26", "78")
    out = forcemap("fit", example_folders["ur10e"], "--discard-censored")[1]
    assert "26 states, 81 impacts, 3 of them saturated (not in the fit)" in out
    assert "1 state left out, with saturated impacts alone" in out


def test_select_says_that_it_needs_a_full_grid_and_concludes_on_one(forcemap, paper_grids, tmp_path):
    fm.write_dataset(paper_grids["ur10e"].train, tmp_path / "impacts.csv")
    error = unwrapped(forcemap("select", tmp_path / "impacts.csv")[2])
    assert "starts from 20 terms up to the third power, so it needs at least four distances" in error
    assert "best a full grid of them (plan --design full-grid has five of each" in error
    fm.write_dataset(paper_grids["ur10e"], tmp_path / "impacts.csv")
    assert "Conclusion: which terms" in forcemap("select", tmp_path / "impacts.csv")[1]


def test_figures_keep_their_digits(forcemap, example_folders):
    out = forcemap("fit", example_folders["kuka-iiwa7-10nm"], "--discard-censored")[1]
    assert "(17.0 degrees of freedom)" in out
    assert "p = 0.998" in forcemap("evaluate", example_folders["kuka-iiwa7-30nm"], "--forms")[1]


def test_what_places_share_stands_beside_what_is_a_states_own(ask, forcemap, example_folders):
    folder = example_folders["kuka-iiwa7-30nm"]
    fit = fm.fit_force_map(fm.read_dataset(folder)).fit
    for command in ("fit", "evaluate"):
        found = ask(command, folder)[1]
        assert found["places"] == 14
        assert 0 <= found["likely_place_correlation"] <= found["place_correlation"] < 1
        assert (found["place_sd_percent"], found["own_sd_percent"]) == (100 * fit.place_sd, 100 * fit.own_sd)
        out = unwrapped(forcemap(command, folder)[1])
        likeliest = found["likely_place_correlation"]
        shared = f"{100 * fit.place_sd:.2f} % of scatter shared by the states of a place, the most that is likely"
        if round(likeliest, 2) == 0:
            shared = "no scatter shared by the states of a place found"
        reckoned = "" if likeliest < 0.005 else "coefficients, bound, standard errors and p values reckon with "
        assert f"14 places (those within 20 mm count as one): {reckoned}{shared}" in out
        assert f"{100 * fit.place_sd:.2f} %" in out
        assert f"and {100 * fit.own_sd:.2f} % of a state's own" in out
        assert "leave-one-place-out" in out


def test_maps_that_are_compared_are_told_apart(ask, forcemap, example_folders, tmp_path):
    one, other = tmp_path / "one.json", tmp_path / "other.json"
    forcemap("fit", example_folders["ur10e"], "-o", one)
    forcemap("fit", example_folders["ur10e"], "--discard-censored", "-o", other)
    out = unwrapped(forcemap("compare", one, other)[1])
    for path, words in (
        (one, "27 states, 3 saturated impacts count as at least the force that they reached"),
        (other, "26 states, 3 saturated impacts discarded"),
    ):
        sha256 = fm.map_sha256(fm.read_map(path))[:8]
        assert f"{path}: CFM_3D fitted to impacts.csv, {words}, SHA-256 {sha256}" in out
    assert "-0.0 %" not in out
    out = forcemap("compare", one, example_folders["ur10e"])[1]
    assert out.startswith("the same map; SIMULATED\n")
    assert ask("compare", one, one)[1]["same_map"] is True
    assert "-0.0 %" not in forcemap("compare", other, one)[1]


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("{map}", "{few}"), ["{few}: found 6 measured states", "evaluate {few} --against {map}"]),
        (("{few}", "{map}"), ["{few}: found 6 measured states", "evaluate {few} --against {map}"]),
        (("ur10e", "{few}"), ["{few}: found 6 measured states", "evaluate {few} --map ur10e"]),
        (("{ur10e}", "{few}"), ["{few}: found 6 measured states", "evaluate {few} --against {ur10e}"]),
    ],
)
def test_what_compare_cannot_compare_names_the_command_that_can(
    forcemap, example_folders, few, tmp_path, arguments, parts
):
    names = {"map": tmp_path / "map.json", "few": few, "ur10e": example_folders["ur10e"]}
    fm.write_map(fm.fit_force_map(fm.read_dataset(names["ur10e"])), names["map"])
    code, out, err = forcemap("compare", *(each.format(**names) for each in arguments))
    assert (code, out, err.count("\n")) == (2, "", 1)
    for part in parts:
        assert part.format(**names) in err


@pytest.mark.parametrize(("source", "next_"), [("{map}", "--against {map}"), ("ur10e", "--map ur10e")])
def test_compare_of_one_map_names_the_commands_for_another_and_for_impacts(
    forcemap, example_folders, tmp_path, source, next_
):
    file = tmp_path / "map.json"
    fm.write_map(fm.fit_force_map(fm.read_dataset(example_folders["ur10e"])), file)
    code, out, _ = forcemap("compare", source.format(map=file), "--area", "back_of_hand")
    assert code == 0
    assert "Force models on forces of the map" in out
    last = unwrapped(out).splitlines()[-1]
    assert f"compare {source.format(map=file)} OTHER" in last
    assert f"evaluate IMPACTS {next_.format(map=file)}" in last


def test_the_answer_to_against_counts_and_groups_what_is_left_out(forcemap, examples, tmp_path):
    dataset, path, table = examples["kuka-iiwa7-30nm"], tmp_path / "map.json", tmp_path / "impacts.csv"
    fm.write_map(fm.fit_force_map(dataset), path)
    new = dataset.independent_test
    frame = new.select(np.isin(new.state, new.states.uncensored.name[::7])).to_frame()
    names = frame["state_id"].unique()
    far = frame["state_id"].isin(names[-2:])
    frame.loc[far, "speed_mps"] += 0.5
    frame.to_csv(table, index=False)
    out = forcemap("evaluate", table, "--against", path)[1]
    lines = re.sub(r"\n    +(?=\S)", " ", out).splitlines()
    out = unwrapped(out)
    assert f", on {len(names) - 2} of {len(names)} states, 2 left out: no change found" in lines[0]
    assert lines[2].startswith("next: ")
    assert out.count("outside the measured range of the map") == 1
    assert "2 states outside the measured range of the map: " in out
    assert "at least, above the device range" not in out
    shown = [line.split()[0] for line in lines if line.split() and line.split()[0] in set(names)]
    assert shown == list(names[:-2])


def test_figures_that_are_not_stated_are_the_librarys_own():
    """Options of commands and parameters of the page have the defaults of the library's functions and classes."""

    def default(function, name):
        return inspect.signature(function).parameters[name].default

    options = {
        ("--overshoot-mps", "speed speed-map report path place export export-path"): fm.Allowance().speed,
        ("--position-tolerance-m", "path place export export-path"): fm.Allowance().position,
        ("--step-m", "path"): default(fm.path_speeds, "step"),
        ("--step-m", "place"): default(fm.place_task, "step"),
        ("--step-m", "report"): default(fm.assess_campaign, "step"),
        ("--zone-m", "export"): default(fm.robot_table, "size"),
        ("--repeats", "next"): default(fm.next_measurements, "repeats"),
        ("--batch", "next"): default(fm.next_measurements, "batch"),
        ("--repeats", "plan"): default(fm.plan_measurements, "repeats"),
    }
    commands = typer.main.get_group(app).commands
    for (option, names), figure in options.items():
        for name in names.split():
            assert [p.default for p in commands[name].params if option in p.opts] == [figure], (name, option)
    question = PathQuestion(points="0.7,0.4")
    assert question.allowance == fm.Allowance()
    assert question.acceleration_mps2 == fm.Task.acceleration
    assert (question.confidence, question.content) == (fm.ToleranceBound().confidence, fm.ToleranceBound().content)
    assert question.margin == fm.FixedMargin().margin
    assert ZoneSize().zone_m == default(fm.robot_table, "size")


def test_the_list_of_commands_is_whole_and_not_cut(capsys):
    assert run(["--help"]) == 0
    listed = capsys.readouterr().out.split("Commands:")[1]
    commands = typer.main.get_command(app).commands
    for name, command in commands.items():
        assert re.search(rf"^  {name} +[A-Z].*\.$", listed, re.M), name
        assert command.name == name
    assert "..." not in listed


@pytest.mark.parametrize("arguments", [("--distance", "0,8"), ("--distance=0,8",)])
def test_a_decimal_comma_is_told_as_one(forcemap, arguments):
    rest = ("--height", "0.4", "--area", "back_of_hand", "--contact", "transient")
    code, _, err = forcemap("speed", "ur10e", *arguments, *rest)
    assert (code, err) == (2, "error: --distance: found 0,8, expected a decimal point, 0.8\n")


def test_outside_the_measured_range_is_named(forcemap, ask):
    case = ("--distance", "800", "--height", "0.4", "--area", "back_of_hand", "--contact", "transient")
    out = forcemap("speed", "ur10e", *case)[1]
    assert "measured distances 0.520 to 0.890 m, heights 0.140 to 0.460 m" in out
    found = ask("speed", "ur10e", *case)[1]
    assert found["measured_distance_m"] == pytest.approx([0.52, 0.89])
    assert found["measured_height_m"] == pytest.approx([0.14, 0.46])


def test_a_form_with_as_many_coefficients_as_states_says_that_nothing_tells_its_error(forcemap, tmp_path):
    rng = np.random.default_rng(3)
    rows = ["state_id,repeat,role,distance_m,height_m,speed_mps,peak_force_N"]
    for state in range(20):
        d, h, v = rng.uniform((0.5, 0.1, 0.1), (0.9, 0.5, 0.4))
        rows += [f"s{state},{repeat},train,{d:.3f},{h:.3f},{v:.3f},{150 + 100 * v + repeat:.1f}" for repeat in (1, 2)]
    (tmp_path / "impacts.csv").write_text("\n".join(rows) + "\n")
    code, out, _ = forcemap("fit", tmp_path / "impacts.csv", "--form", "FULL_CUBIC")
    assert code == 0
    assert "AS MANY COEFFICIENTS AS MEASURED STATES" in out
    assert "state-to-state SD - %" in out
    code, out, _ = forcemap("evaluate", tmp_path / "impacts.csv", "--form", "FULL_CUBIC")
    assert (code, out.startswith("NOTHING TELLS HOW FAR THIS MAP IS OFF")) == (0, True)
