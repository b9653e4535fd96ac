"""Several measuring devices in a campaign, the springs of users' limit tables, and what is not stated of either."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import forcemap as fm
from forcemap.campaigns.binding import BindingState
from forcemap.campaigns.template import campaign_text
from forcemap.errors import CampaignFileError, TableError
from forcemap.words import assumptions, sentence
from pulses import TOML, collect, pulse, rows, save, write_campaign

SEVERAL = """schema = "forcemap-campaign/1"
[device]
model = "hard"
range_N = 500.0
error_N = 3.0
stiffness_N_per_m = 150000.0
pad = "70 Shore A"
[[devices]]
recordings = "d500-*"
model = "soft"
range_N = 300.0
error_N = 5.0
stiffness_N_per_m = 70000.0
pad = "30 Shore A"
"""
HAND = {"limit": fm.force_limit("back_of_hand"), "contact": "quasi-static", "bound": fm.ToleranceBound()}


@pytest.fixture(scope="module")
def several(tmp_path_factory):
    folder = write_campaign(tmp_path_factory.mktemp("several") / "campaign", toml=SEVERAL)
    collect(folder)
    return folder


def test_every_recording_is_sealed_with_its_own_device(several):
    found = {row["file"]: row for row in rows(several / "recordings.csv")}
    assert len(found) == 27
    for file, row in found.items():
        soft = file.startswith("d500-")
        assert row["device.model"] == ("soft" if soft else "hard")
        assert float(row["device.stiffness_N_per_m"]) == (70e3 if soft else 150e3)
        assert float(row["device.range_N"]) == (300 if soft else 500)
        assert row["device.pad"] == ("30 Shore A" if soft else "70 Shore A")


def test_the_softest_spring_the_lowest_range_and_the_largest_error_count(several, tmp_path):
    dataset = fm.read_dataset(several)
    assert dataset.binding.state is BindingState.BOUND
    device = dataset.conditions.device
    assert (device.stiffness, device.range, device.error, device.model) == (70e3, 300, 5, "soft; hard")
    force_map = fm.fit_force_map(dataset)
    found = fm.safe_speed(force_map, 0.7, 0.3, **HAND)
    assert found.basis.raised == pytest.approx(np.sqrt(75 / 70))
    with pytest.raises(fm.InputError, match="at most 295 N"):
        fm.safe_speed(force_map, 0.7, 0.3, limit=296.0, contact="quasi-static", bound=fm.ToleranceBound())
    said = assumptions([found.basis])
    assert any("of d500-*: soft, spring 70 N/mm, range 300 N, pad or damping 30 Shore A" in line for line in said)
    assert any("of *: hard, spring 150 N/mm, range 500 N, pad or damping 70 Shore A" in line for line in said)
    fm.write_map(force_map, tmp_path / "map.json")
    again = fm.read_map(tmp_path / "map.json")
    assert again.conditions == force_map.conditions
    assert fm.map_sha256(again) == fm.map_sha256(force_map)


def test_one_spring_that_is_too_soft_or_not_stated_confirms_nothing(tmp_path):
    for number, (stated, kind) in enumerate(
        [("stiffness_N_per_m = 60000.0", "spring_too_soft"), ("", "spring_of_device_not_stated")]
    ):
        toml = SEVERAL.replace("stiffness_N_per_m = 70000.0", stated)
        folder = write_campaign(tmp_path / str(number), toml=toml)
        found = fm.safe_speed(fm.fit_force_map(collect(folder)), 0.7, 0.3, **HAND)
        assert (found.outcome, found.reason.kind.value) == (fm.SpeedOutcome.UNCONFIRMED, kind)


def test_recordings_of_which_no_device_is_stated_are_not_used(tmp_path):
    toml = SEVERAL.replace(SEVERAL[SEVERAL.index("[device]") : SEVERAL.index("[[devices]]")], "")
    folder = write_campaign(tmp_path / "campaign", toml=toml)
    used = collect(folder)
    assert {row["use"] for row in rows(folder / "recordings.csv") if not row["file"].startswith("d500-")} == {
        "discarded"
    }
    assert used.conditions.device.model == "soft"
    assert (used.distance == 0.5).all()


def test_each_recording_saturates_at_its_own_device(tmp_path):
    folder = write_campaign(tmp_path / "campaign", toml=SEVERAL, recorded=False)
    for name in ("d500-h200-v300-r1", "d700-h200-v300-r1", "d700-h200-v200-r1"):
        time, force = pulse(400.0, rate=1000.0)
        save(folder / "recordings" / f"{name}.csv", time, np.minimum(force, 300.0 if name.startswith("d5") else 500.0))
    dataset = collect(folder)
    assert dataset.censored.tolist() == [name.startswith("d500") for name in dataset.state.tolist()]
    assert dataset.device_range == 300.0


def test_a_state_that_a_person_names_has_its_device(tmp_path):
    """The file's name tells nothing; recordings.csv says which run it is."""
    folder = write_campaign(tmp_path / "campaign", toml=SEVERAL, recorded=False)
    save(folder / "recordings" / "Messung 001.csv", *pulse(150.0, rate=1000.0))
    save(folder / "recordings" / "d700-h200-v100-r1.csv", *pulse(140.0, rate=1000.0))
    collect(folder)
    register = folder / "recordings.csv"
    table = rows(register)
    next(row for row in table if row["file"] == "Messung 001.csv").update(state_id="d500-h200-v100", repeat="1")
    with register.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, table[0])
        writer.writeheader()
        writer.writerows(table)
    dataset = collect(folder)
    assert dataset.no_speed is None
    found = {row["file"]: row["device.model"] for row in rows(register)}
    assert found == {"Messung 001.csv": "soft", "d700-h200-v100-r1.csv": "hard"}


def test_a_device_that_changed_is_said(several):
    toml = several / "campaign.toml"
    text = toml.read_text()
    try:
        toml.write_text(text.replace("30 Shore A", "50 Shore A"))
        found = sentence(fm.read_dataset(several).no_speed)
        assert "device.pad was '30 Shore A' when 9 of the recordings were registered" in found
    finally:
        toml.write_text(text)


def test_the_text_of_a_campaign_keeps_its_devices(several, tmp_path):
    conditions = fm.read_conditions(several / "campaign.toml")
    (tmp_path / "campaign.toml").write_text(campaign_text(conditions))
    assert fm.read_conditions(tmp_path / "campaign.toml") == conditions


@pytest.mark.parametrize(
    ("entry", "column"),
    [
        ('recordings = "*"\nstifness_N_per_m = 1.0', "devices[1].stifness_N_per_m"),
        ("range_N = 300.0", "devices[1]"),
        ('recordings = "*"\nrange_N = "300"', "devices[1].range_N"),
        ('recordings = "*"\nrange_N = -300.0', "devices[1]"),
        ('recordings = "*"\nstiffness_N_per_m = 75.0', "devices[1]"),  # N/mm
        ('recordings = "*"\nstiffness_N_per_m = 75000000.0', "devices[1]"),
        ('recordings = "*"\nchannel_frequency_class = 180.0', "devices[1].channel_frequency_class"),
        ("recordings = 3", "devices[1]"),
    ],
)
def test_slips_in_a_device_are_named(tmp_path, entry, column):
    path = tmp_path / "campaign.toml"
    path.write_text(f'schema = "forcemap-campaign/1"\n[[devices]]\n{entry}\n')
    with pytest.raises(CampaignFileError) as caught:
        fm.read_conditions(path)
    assert caught.value.column == column
    path.write_text('schema = "forcemap-campaign/1"\ndevices = 3\n')
    with pytest.raises(CampaignFileError, match=r"\[\[devices\]\]"):
        fm.read_conditions(path)


def test_collect_lists_what_is_not_stated_of_every_device(tmp_path, ask):
    folder = write_campaign(tmp_path / "one", toml=TOML)
    found = ask("collect", folder)[1]["not_stated"]
    assert {"device.model", "device.pad", "device.calibrated", "robot.firmware", "robot.moving_mass_kg"} <= {*found}
    assert "device.stiffness_N_per_m" not in found
    toml = SEVERAL.replace('pad = "30 Shore A"\n', "")
    found = ask("collect", write_campaign(tmp_path / "several", toml=toml))[1]["not_stated"]
    assert "device.pad of the device of d500-*" in found
    assert "device.pad of the device of *" not in found


RANGES = ("--distances-m", "0.52,0.89", "--heights-m", "0.14,0.46", "--speeds-mps", "0.1,0.4")


def test_plan_says_at_once_what_collecting_will_need(tmp_path, ask, forcemap):
    warnings = ask("plan", tmp_path / "a", *RANGES)[1]["warnings"]
    assert any("forcemap collect will need device.range_N" in each for each in warnings)
    assert any("without device.stiffness_N_per_m in campaign.toml" in each for each in warnings)
    out = forcemap("plan", tmp_path / "b", *RANGES)[1]
    assert "  ! forcemap collect will need device.range_N" in out
    stated = ("--device-range-N", 500, "--device-spring-N-per-mm", 75)
    warnings = ask("plan", tmp_path / "c", *RANGES, *stated)[1]["warnings"]
    assert not any("collect will need" in each or "stiffness" in each for each in warnings)


HEADER = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor"


def limit_table(folder, *lines, header=f"{HEADER},spring_constant_N_per_mm"):
    path = folder / "limits.csv"
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def test_a_users_table_states_the_spring_of_its_areas(tmp_path, several, ask):
    path = limit_table(
        tmp_path,
        "glove,Gloved hand,own_region,200,140,2,80",
        "palm,Palm,hand_fingers,200,140,2,",
        "x,X,other,200,140,2,",
    )
    areas = fm.read_limit_table(path)
    assert [fm.force_limit(each, table=areas).stiffness for each in ("glove", "palm")] == [80e3, 75e3]
    assert np.isnan(fm.force_limit("x", table=areas).stiffness)
    force_map = fm.fit_force_map(fm.read_dataset(several))
    options = {"contact": "quasi-static", "bound": fm.ToleranceBound()}
    glove = fm.safe_speed(force_map, 0.7, 0.3, limit=fm.force_limit("glove", table=areas), **options)
    assert glove.reason.kind.value == "spring_too_soft"  # 70 below 0.9 of 80
    unknown = fm.safe_speed(force_map, 0.7, 0.3, limit=fm.force_limit("x", table=areas), **options)
    assert unknown.reason.kind.value == "spring_of_area_unknown"
    found = ask("limits", "--limit-table", path)[1]["limits"]
    assert [each["spring_N_per_m"] for each in found] == [80e3, 75e3, None]


@pytest.mark.parametrize(
    ("cell", "header", "column"),
    [
        ("10", f"{HEADER},spring_constant_N_per_mm", "spring_constant_N_per_mm"),  # softer than the standard's 75
        ("0", f"{HEADER},spring_constant_N_per_mm", "spring_constant_N_per_mm"),
        ("75000", f"{HEADER},spring_constant_N_per_mm", "spring_constant_N_per_mm"),
        ("stiff", f"{HEADER},spring_constant_N_per_mm", "spring_constant_N_per_mm"),
        ("75", f"{HEADER},spring_N_per_m", "spring_N_per_m"),
        ("75", f"{HEADER},Federkonstante", "Federkonstante"),
        ("75", f"{HEADER},stiffness", "stiffness"),
    ],
)
def test_a_spring_that_softens_the_gate_or_is_in_another_unit_is_refused(tmp_path, cell, header, column):
    path = limit_table(tmp_path, f"palm,Palm,hand_fingers,200,140,2,{cell}", header=header)
    with pytest.raises(TableError) as caught:
        fm.read_limit_table(path)
    assert caught.value.column == column


def test_a_pattern_that_names_files_with_their_ending_tells_the_device(tmp_path):
    """As in the register, so where a recording is judged."""
    toml = SEVERAL.replace(SEVERAL[SEVERAL.index("[device]") : SEVERAL.index("[[devices]]")], "")
    folder = write_campaign(tmp_path / "campaign", toml=toml.replace('"d500-*"', '"*/d500-*.csv"'))
    (folder / "recordings" / "soft").mkdir()
    for path in (folder / "recordings").glob("d500-*.csv"):
        path.rename(path.parent / "soft" / path.name)
    collect(folder)
    found = rows(folder / "recordings.csv")
    assert {row["use"] for row in found if row["file"].startswith("soft/")} == {"used"}
    assert {row["use"] for row in found if not row["file"].startswith("soft/")} == {"discarded"}


def test_a_state_measured_again_by_another_name_keeps_the_device_of_that_name(tmp_path):
    """By the name that it had first its drift is told; its range is that of its own device."""
    (tmp_path / "campaign.toml").write_text(
        'schema = "forcemap-campaign/1"\n[[devices]]\nrecordings = "again-*"\nstiffness_N_per_m = 75000.0\n'
        'range_N = 250.0\n[[devices]]\nrecordings = "*"\nstiffness_N_per_m = 75000.0\nrange_N = 500.0\n'
    )
    head = "state_id,role,distance_m,height_m,speed_mps,peak_force_N\n"
    row = "{},0.7,0.3,0.25,{}\n"
    table = tmp_path / "impacts.csv"
    table.write_text(head + row.format("first,train", 200) + row.format("again-first,test", 240))
    dataset = fm.read_dataset(table)
    assert dataset.state.tolist() == ["first", "again-first"]
    assert dataset.drift.states == 1
    assert dataset.drift.change == pytest.approx(0.2)
    table.write_text(head + row.format("first,train", 200) + row.format("again-first,test", 260))
    with pytest.raises(fm.InputError, match="less than the device range of 250 N"):
        fm.read_dataset(table)
