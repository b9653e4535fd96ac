"""A check of a campaign's recording says no "within" that the campaign speaks against."""

from __future__ import annotations

import numpy as np
import pytest

import forcemap as fm
from pulses import TOML, collect, pulse, rows, save, write_campaign

HAND = ("--area", "back_of_hand")
STATED = TOML.replace("[device]", '[robot]\nmoving_mass_kg = 20.0\n[contact]\ndirection = "down"\n[device]')


def force_of(state, factor):
    return factor * state[2] * np.sqrt(75e3 * 10.0)


@pytest.fixture
def campaign(tmp_path):
    return write_campaign(tmp_path / "campaign", toml=STATED)


def first(folder):
    return sorted((folder / "recordings").iterdir())[0]


def test_within_while_nothing_speaks_against_it(campaign, ask):
    collect(campaign)
    assert ask("check", first(campaign), "--limit-N", 400, "--quasi-static-limit-N", 400)[0] == 0


def test_a_condition_that_changed(campaign, ask):
    collect(campaign)
    toml = (campaign / "campaign.toml").read_text()
    assert "stiffness_N_per_m = 75000" in toml
    (campaign / "campaign.toml").write_text(toml.replace("stiffness_N_per_m = 75000", "stiffness_N_per_m = 30000"))
    for source in (campaign, first(campaign)):
        code, found = ask("check", source, "--limit-N", 400, "--quasi-static-limit-N", 400)
        assert (code, found["outcome"]) == (2, "cannot_tell")
        assert "device.stiffness_N_per_m" in found["unjudged"][0]["reason"]
        assert ask("check", source, "--limit-N", 20, "--quasi-static-limit-N", 20)[0] == 1  # exceeded all the same


def test_a_file_of_the_campaign_that_is_named_beside_it(campaign, ask):
    collect(campaign)
    toml = (campaign / "campaign.toml").read_text()
    (campaign / "campaign.toml").write_text(toml.replace('"down"', '"outward"'))
    code, found = ask("check", first(campaign), "--campaign", campaign, "--limit-N", 400, "--quasi-static-limit-N", 400)
    assert (code, found["outcome"]) == (2, "cannot_tell")
    assert "contact.direction" in found["unjudged"][0]["reason"]


def test_a_file_that_changed(campaign, ask):
    collect(campaign)
    save(first(campaign), *pulse(60.0, rate=1000.0))
    code, found = ask("check", first(campaign), "--limit-N", 400, "--quasi-static-limit-N", 400)
    assert (code, found["outcome"]) == (2, "cannot_tell")
    assert "changed" in found["unjudged"][0]["reason"]


@pytest.mark.parametrize("collected", [True, False])
def test_a_slip_of_a_unit(campaign, ask, collected):
    """Forces in lbf taken for N: no single recording tells, the campaign does."""
    for path in (campaign / "recordings").iterdir():
        lines = path.read_text().splitlines()
        cells = [line.split(",") for line in lines[1:]]
        path.write_text("\n".join([lines[0], *(f"{t},{float(f) / 4.448:.4f}" for t, f in cells)]) + "\n")
    if collected:
        collect(campaign)
    for source in (campaign, first(campaign))[: 1 + collected]:
        code, found = ask("check", source, "--limit-N", 400, "--quasi-static-limit-N", 400)
        assert (code, found["outcome"]) == (2, "cannot_tell")
        assert found["unjudged"][0]["reason"].startswith("UNITS")


def test_the_same_forces_under_another_head_are_no_repeat(campaign):
    paths = sorted((campaign / "recordings").iterdir())
    paths[1].write_text("exported again\n" + paths[0].read_text())
    collect(campaign)
    entry = next(row for row in rows(campaign / "recordings.csv") if row["file"] == paths[1].name)
    assert entry["use"] == "discarded"
    assert "the same forces as" in entry["reason"]


@pytest.mark.parametrize("pattern", ["d52-*", "d520_*", "520-*", "recordings/d500-*"])
def test_a_device_entry_that_fits_nothing_is_refused(campaign, pattern):
    toml = (campaign / "campaign.toml").read_text()
    soft = f'[[devices]]\nrecordings = "{pattern}"\nrange_N = 500\nstiffness_N_per_m = 30000\n'
    (campaign / "campaign.toml").write_text(toml + soft)
    with pytest.raises(fm.InputError, match="fits no state or recording") as caught:
        fm.read_campaign(campaign)
    assert caught.value.column == "devices[1].recordings"


def test_a_device_entry_behind_one_that_fits_all_is_refused(campaign):
    toml = (campaign / "campaign.toml").read_text()
    state = fm.read_plan(campaign).state_id[0]
    several = "".join(
        f'[[devices]]\nrecordings = "{pattern}"\nrange_N = 500\nstiffness_N_per_m = {spring}\n'
        for pattern, spring in (("*", 75000), (f"{state}*", 30000))
    )
    (campaign / "campaign.toml").write_text(toml + several)
    with pytest.raises(fm.InputError, match="that an entry before it does not fit"):
        fm.read_campaign(campaign)


def test_patterns_of_devices_ignore_case_as_names_of_files_do(campaign):
    toml, state = (campaign / "campaign.toml").read_text(), str(fm.read_plan(campaign).state_id[0])
    soft = f'[[devices]]\nrecordings = "{state.upper()}*"\nrange_N = 500\nstiffness_N_per_m = 30000\n'
    (campaign / "campaign.toml").write_text(toml + soft)
    assert fm.read_campaign(campaign).conditions.device_of(state).stiffness == 30000
