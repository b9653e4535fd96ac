"""The form that a campaign states: one home, from which every command and the page take it."""

from __future__ import annotations

import itertools
import json
import shutil

import numpy as np
import pytest
from oracle import printed_force

import forcemap as fm
from forcemap.campaigns.conditions import FORM_NAMES
from forcemap.errors import CampaignFileError
from forcemap.maps.carry_over import EARLIER_MAP
from forcemap.maps.forms import FORMS, form_of
from pulses import pulse
from web_server import client_of

HAND = ("--area", "back_of_hand", "--contact", "transient")
PLACE = ("--distance", 0.7, "--height", 0.3)


def state(folder, form):
    """State a form in a campaign.toml that has none."""
    lines = (folder / "campaign.toml").read_text().splitlines(keepends=True)
    stated = [f'form = "{form}"\n' if line.startswith("# form = ") else line for line in lines]
    (folder / "campaign.toml").write_text(
        "".join(stated) if stated != lines else f'{"".join(lines)}\n[map]\nform = "{form}"\n'
    )
    return folder


@pytest.fixture
def folder(example_folders, tmp_path):
    return shutil.copytree(example_folders["ur10e"], tmp_path / "mine")


def test_the_names_that_a_campaign_may_state_are_those_of_the_forms():
    assert set(FORM_NAMES) == {form.name for form in FORMS}
    assert form_of(fm.Conditions()) == fm.CFM_3D
    for form in FORMS:
        assert form_of(fm.Conditions(form=form.name)) == form
        assert form_of(fm.Conditions(form=form.name), fm.CFM_2D) == fm.CFM_2D


@pytest.mark.parametrize("name", ["LOGSPEED", "cfm-3d", "EUCLIDEAN_2D", "SELECTED"])
def test_another_name_is_refused_where_the_campaign_is_read(folder, forcemap, name):
    state(folder, name)
    with pytest.raises(CampaignFileError, match=r"map\.form: found .*, expected one of CFM_2D, CFM_3D"):
        fm.read_conditions(folder / "campaign.toml")
    code, _, err = forcemap("speed", folder, *PLACE, *HAND)
    assert (code, err.count("\n")) == (2, 1)
    assert str(folder / "campaign.toml") in err


@pytest.mark.parametrize("name", FORM_NAMES)
def test_a_map_is_of_the_stated_form_and_of_another_only_if_that_is_asked_for(folder, tmp_path, name):
    dataset, form = fm.read_dataset(state(folder, name)), fm.form_named(name)
    force_map = fm.fit_force_map(dataset)
    assert force_map.form == form
    asked = fm.fit_force_map(fm.read_dataset(folder), form=form)
    np.testing.assert_array_equal(force_map.coefficients, asked.coefficients)
    assert fm.fit_force_map(dataset, form=fm.CFM_2D).form == fm.CFM_2D
    fm.write_map(force_map, tmp_path / "map.json")
    assert "form" not in json.loads((tmp_path / "map.json").read_text())["campaign"].get("map", {})
    assert fm.read_map(tmp_path / "map.json").form == form


COMMANDS = {
    "fit": ((), ("form",)),
    "evaluate": ((), ("accuracies",)),
    "compare": (("--area", "back_of_hand"), ("models",)),
    "speed": ((*PLACE, *HAND), None),
    "speed-map": (HAND, ("speeds",)),
    "next": ((*HAND, "--dry-run"), None),
}


@pytest.mark.parametrize("command", ["fit", "evaluate", "compare"])
def test_commands_that_take_a_form_answer_with_the_stated_one_as_with_the_option(folder, ask, command):
    options = COMMANDS[command][0]
    default = ask(command, folder, *options)
    asked = ask(command, folder, *options, "--form", "LOG_SPEED")
    state(folder, "LOG_SPEED")
    assert ask(command, folder, *options) == asked != default
    assert ask(command, folder, *options, "--form", "CFM_3D") == default


def test_commands_and_page_without_the_option_rest_on_the_stated_form(folder, ask, forcemap, tmp_path):
    """They say of the campaign what they say of a map file of that form."""
    forcemap("fit", folder, "--form", "LOG_SPEED", "-o", tmp_path / "log.json")
    of_default = ask("speed", folder, *PLACE, *HAND)[1]["speed_mps"]
    of_file = ask("speed", tmp_path / "log.json", *PLACE, *HAND)[1]
    state(folder, "LOG_SPEED")
    of_folder = ask("speed", folder, *PLACE, *HAND)[1]
    assert of_folder["speed_mps"] == of_file["speed_mps"] != of_default
    grids = [ask("speed-map", source, *HAND)[1]["places"] for source in (folder, tmp_path / "log.json")]
    assert grids[0] == grids[1]
    for source in (folder, tmp_path / "log.json"):
        forcemap("export", source, "--format", "csv", *HAND, "-o", tmp_path / f"{source.name}.csv")
    tables = [
        [line for line in (tmp_path / f"{name}.csv").read_text().splitlines() if not line.startswith("#")]
        for name in ("mine", "log.json")
    ]
    assert tables[0] == tables[1]
    limits = [fm.force_limit("back_of_hand")]
    assessed = fm.assess_campaign(folder, limits=limits)
    assert assessed.force_map.form == fm.LOG_SPEED
    with client_of(folder) as client:
        assert client.get("/api/campaigns/mine/map").json()["form"] == "LOG_SPEED"
        asked = {"distance_m": 0.7, "height_m": 0.3, "area": "back_of_hand", "contact": "transient"}
        assert client.get("/api/campaigns/mine/speed", params=asked).json()["speed_mps"] == of_folder["speed_mps"]


def test_a_report_of_another_form_says_that_speeds_and_page_are_of_the_campaigns(folder, forcemap, tmp_path):
    report = ("report", folder, "--area", "back_of_hand", "-o", tmp_path / "report.html")
    other = "This report is for LOG_SPEED; speeds, exports and the page take CFM_3D until campaign.toml states"
    assert "until campaign.toml states" not in forcemap(*report)[1]
    assert other in " ".join(forcemap(*report, "--form", "LOG_SPEED")[1].split())
    state(folder, "LOG_SPEED")
    for options in ((), ("--form", "LOG_SPEED")):
        assert "until campaign.toml states" not in forcemap(*report, *options)[1]


def test_a_recommended_form_is_to_be_stated_and_one_that_is_stated_is_not_proposed_again(folder, forcemap, tmp_path):
    """Of forces that grow as a power of the speed."""
    d, h, v = np.array(list(itertools.product((0.5, 0.6, 0.7, 0.8), (0.1, 0.2, 0.3, 0.4), (0.05, 0.1, 0.2, 0.4)))).T
    scatter = np.exp(np.random.default_rng(3).normal(0, 0.01, d.size))
    force = 180 * (v / 0.2) ** 0.6 * np.exp(-1.5 * (d - 0.6) + h**2) * scatter
    dataset = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force)
    for name in ("recordings.csv", "impacts.csv"):
        (folder / name).unlink(missing_ok=True)
    fm.write_dataset(dataset, folder / "impacts.csv")
    code, first, err = forcemap("evaluate", folder, "--forms")
    assert (code, err) == (0, "")
    first = " ".join(first.split())
    recommended = first.split()[1].rstrip(",;")
    assert recommended == "LOG_SPEED"
    assert f'Next: state form = "{recommended}" below [map] in {folder / "campaign.toml"}' in first
    assert "Next:" not in forcemap("evaluate", state(folder, recommended), "--forms")[1]
    alone = shutil.copy(folder / "impacts.csv", tmp_path / "impacts.csv")
    assert f"Next: forcemap fit {alone} --form {recommended}" in " ".join(
        forcemap("evaluate", alone, "--forms")[1].split()
    )


def test_a_plan_for_another_form_says_so(forcemap, tmp_path):
    ranges = ("--distances-m", "0.52,0.89", "--heights-m", "0.14,0.46", "--speeds-mps", "0.2,0.4")
    out = forcemap("plan", tmp_path / "a", *ranges, "--design", "i-optimal:LOG_SPEED", "--device-range-N", 500)[1]
    assert "These states are for LOG_SPEED; speeds, exports and the page take CFM_3D" in " ".join(out.split())
    (tmp_path / "b").mkdir()
    toml = 'schema = "forcemap-campaign/1"\n[device]\nrange_N = 500.0\n[map]\nform = "LOG_SPEED"\n'
    (tmp_path / "b" / "campaign.toml").write_text(toml)
    out = " ".join(forcemap("plan", tmp_path / "b", *ranges, "--design", "i-optimal")[1].split())
    assert "chosen for LOG_SPEED" in out
    assert "until campaign.toml states" not in out
    assert fm.read_plan(tmp_path / "b").recording.tolist() == fm.read_plan(tmp_path / "a").recording.tolist()


def test_a_map_that_is_carried_over_keeps_its_form_whatever_is_stated(folder, tmp_path, examples):
    fm.write_map(fm.fit_force_map(examples["ur10e"]), tmp_path / "earlier.json")
    (folder / EARLIER_MAP).parent.mkdir(exist_ok=True)
    shutil.copy(tmp_path / "earlier.json", folder / EARLIER_MAP)
    state(folder, "LOG_SPEED")
    assessed = fm.assess_campaign(folder, limits=[fm.force_limit("back_of_hand")])
    assert "leave other forms than CFM_3D" in fm.sentence(assessed.force_map.reason)


def test_a_campaign_is_confirmed_and_exported_by_the_form_that_it_states(simulated, ask, forcemap, tmp_path):
    """Judged by another form, the same impacts say nothing of it; with --form it is said what to state."""
    folder = shutil.copytree(simulated, tmp_path / "cell")
    planned = ask("confirm", folder, *HAND, "--form", "LOG_SPEED")[1]["runs"]
    truth = np.array([[run[key] for key in ("distance_m", "height_m", "speed_mps")] for run in planned])
    for i, (run, force) in enumerate(zip(planned, printed_force("ur10e", *truth.T), strict=True)):
        peak = min(0.9 * force, 0.93 * run["upper_force_N"])
        rows = zip(*pulse(peak, rate=1000.0, seed=i), strict=True)
        text = "".join(f"{1000 * time:.1f},{newtons:.3f}\n" for time, newtons in rows)
        (folder / "recordings" / f"{run['recording']}.csv").write_text(f"time_ms,force_N\n{text}")
    assert ask("collect", folder)[0] == 0
    asked = (folder, *HAND)
    code, out, _ = forcemap("confirm", *asked, "--form", "LOG_SPEED")
    assert (code, out.startswith("PASSES")) == (0, True)
    assert 'Else: state form = "LOG_SPEED" below [map] in campaign.toml; then forcemap report' in " ".join(out.split())
    said = {}
    for form in ("", "LOG_SPEED"):
        if form:
            state(folder, form)
        answer = ask("speed", *PLACE, *HAND, folder)[1]
        said[form] = [line for line in answer["assumptions"] + answer["warnings"] if line.startswith("confirmed for")]
    assert said[""] == []
    assert len(said["LOG_SPEED"]) == 1
    code, out, _ = forcemap("confirm", *asked)
    assert (code, out.startswith("PASSES")) == (0, True)
    assert " ".join(out.split()).endswith(
        "Else: forcemap report and forcemap export, which say now that the map is confirmed"
    )
    assert forcemap("export", *asked, "--format", "csv", "-o", tmp_path / "table.csv")[0] in (0, 1)
    assert "confirmed for" in (tmp_path / "table.csv").read_text()
    with client_of(folder) as client:
        cases = client.get("/api/campaigns/cell/headline?area=back_of_hand").json()["cases"]
        assert [case["confirmed_by"] > 0 for case in cases if case["contact"] == "transient"] == [True]
