"""A campaign is one robot, tool, site, direction and safety setting: what changed or was mixed is said or refused."""

from __future__ import annotations

import csv
import itertools

import numpy as np
import pandas as pd
import pytest
from oracle import simulate

import forcemap as fm
from forcemap.errors import TableError
from forcemap.words import sentence
from pulses import TOML, collect, pulse, rows, save, write_campaign

STATED = {
    "robot.model": ('model = "UR10e"', 'model = "UR5e"'),
    "robot.firmware": ('firmware = "5.15"', 'firmware = "5.16"'),
    "robot.moving_mass_kg": ("moving_mass_kg = 12.0", "moving_mass_kg = 13.5"),
    "robot.safety_settings": ('safety_settings = "A1"', 'safety_settings = "B2"'),
    "tool.name": ('name = "gripper"', 'name = "screwdriver"'),
    "tool.payload_kg": ("payload_kg = 0.5", "payload_kg = 1.5"),
    "contact.site": ('site = "flange"', 'site = "elbow"'),
    "contact.direction": ('direction = "down"', 'direction = "outward"'),
    "device.pad": ('pad = "70 Shore A"', 'pad = "30 Shore A"'),
}
DATED = "date = 2026-06-15\n"


def stated(day=DATED):
    """A campaign.toml that states all of them."""
    sections: dict[str, list[str]] = {}
    for entry, (text, _) in STATED.items():
        sections.setdefault(entry.split(".")[0], []).append(text)
    schema, device = TOML.split("\n", 1)
    of_device = "\n".join(sections.pop("device")) + "\n"
    rest = "".join(f"[{name}]\n" + "\n".join(lines) + "\n" for name, lines in sections.items())
    return f"{schema}\n{day}{device}{of_device}{rest}"


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    folder = write_campaign(tmp_path_factory.mktemp("one") / "campaign", toml=stated())
    assert collect(folder).no_speed is None
    return folder


@pytest.mark.parametrize("entry", STATED)
def test_what_changed_after_the_measurement_is_said_with_when(measured, entry):
    toml, (before, after) = measured / "campaign.toml", STATED[entry]
    text = toml.read_text()
    try:
        toml.write_text(text.replace(before, after).replace("2026-06-15", "2026-07-01"))
        found = fm.read_dataset(measured)
        (was, now) = (each.split(" = ")[1].strip('"') for each in (before, after))
        said = f"{entry} was '{was}' when 27 of the recordings were registered (measured on 2026-06-15)"
        assert sentence(found.no_speed).startswith(f"{said}, campaign.toml says '{now}'")
        speed = fm.safe_speed(
            fm.fit_force_map(found), 0.7, 0.3, limit=200.0, contact="quasi-static", bound=fm.ToleranceBound()
        )
        assert (speed.outcome, speed.reason) == (fm.SpeedOutcome.UNCONFIRMED, found.no_speed)
    finally:
        toml.write_text(text)


def test_recordings_of_another_day_under_other_conditions_are_told_apart(tmp_path):
    """Some are registered under one firmware, the others under the next: no map is of both."""
    folder = write_campaign(tmp_path / "campaign", toml=stated())
    late = [*(folder / "recordings").iterdir()][:7]
    held = {path: path.read_bytes() for path in late}
    for path in late:
        path.unlink()
    collect(folder)
    toml = folder / "campaign.toml"
    toml.write_text(toml.read_text().replace("5.15", "5.16").replace("2026-06-15", "2026-07-01"))
    for path, content in held.items():
        path.write_bytes(content)
    found = sentence(collect(folder).no_speed)
    assert "was '5.15' when 20 of the recordings were registered (measured on 2026-06-15)" in found
    assert {row["date"] for row in rows(folder / "recordings.csv")} == {"2026-06-15", "2026-07-01"}
    before = (folder / "recordings.csv").read_bytes()
    collect(folder)
    assert (folder / "recordings.csv").read_bytes() == before


def table(folder, **columns):
    """A table of 27 states with further columns, a text for each row."""
    dataset = simulate("ur10e", np.random.default_rng(3), effect=0.022, repeats=1).dataset
    frame = dataset.train.to_frame()[["distance_m", "height_m", "speed_mps", "peak_force_N"]]
    frame = frame[frame.peak_force_N < 500]
    folder.mkdir(exist_ok=True)
    for name, cells in columns.items():
        frame[name] = [cells[i % len(cells)] for i in range(len(frame))]
    frame.to_csv(folder / "impacts.csv", index=False, quoting=csv.QUOTE_MINIMAL)
    return folder


@pytest.mark.parametrize(
    ("column", "cells"),
    [
        ("robot", ["UR10e", "KUKA LBR iiwa 7"]),
        ("robot_model", ["UR10e", "UR10e", "UR5e"]),
        ("Robot Type", ["a", "b"]),
        ("safety_settings", ["30 Nm", "10 Nm"]),
        ("safety", ["30 Nm", "", "10 Nm"]),
        ("tool", ["gripper", "none"]),
        ("payload_kg", ["1.0", "1.5"]),
        ("contact_site", ["flange", "elbow"]),
        ("direction", ["down", "out"]),
        ("firmware", ["5.15", "5.16"]),
        ("scenario", ["unconstrained", "constrained with clamping"]),
        ("scenario", ["no clamping", "unconstrained"]),
    ],
)
def test_a_table_of_two_campaigns_is_refused(tmp_path, column, cells, ask):
    folder = table(tmp_path / "two", **{column: cells})
    with pytest.raises(TableError, match="make a table for each") as caught:
        fm.read_dataset(folder)
    assert (caught.value.column, caught.value.row) == (column, 3 if cells[1] not in (cells[0], "") else 4)
    assert ask("fit", folder)[1]["error"]["column"] == column
    one = table(tmp_path / "one", **{column: cells[:1]})
    assert len(fm.read_dataset(one)) > 20


@pytest.mark.parametrize(
    ("column", "cell", "entry", "value", "same"),
    [
        ("robot", "KUKA LBR iiwa 7", "robot.model", "Universal Robots UR10e", False),
        ("robot", "UR10", "robot.model", "Universal Robots UR10e", False),
        ("robot", "UR10e", "robot.model", "Universal Robots UR10e", True),
        ("safety_settings", "10 Nm", "robot.safety_settings", "30 Nm", False),
        ("payload_kg", "1.50", "tool.payload_kg", 1.5, True),
        ("payload_kg", "0.5", "tool.payload_kg", 1.5, False),
        ("tool", "gripper", "tool.name", "gripper", True),
    ],
)
def test_a_table_under_another_campaigns_conditions_is_refused(tmp_path, column, cell, entry, value, same):
    folder, (section, key) = table(tmp_path / "here", **{column: [cell]}), entry.split(".")
    text = f'"{value}"' if isinstance(value, str) else value
    (folder / "campaign.toml").write_text(f'schema = "forcemap-campaign/1"\n[{section}]\n{key} = {text}\n')
    if same:
        assert fm.read_dataset(folder).extra[column][0] == cell
        return
    with pytest.raises(TableError, match=f"the {entry} of campaign.toml") as caught:
        fm.read_dataset(folder)
    assert (caught.value.column, caught.value.row) == (column, 2)


def test_what_curves_show_may_differ_within_a_campaign(tmp_path):
    """Recordings tell what followed Phase I; that one of them clamps closes the gate, and refuses no table."""
    folder = write_campaign(tmp_path / "campaign")
    name = fm.read_plan(folder).recording[0]
    save(folder / "recordings" / f"{name}.csv", *pulse(150.0, rate=1000.0, held=80.0))
    found = collect(folder)
    assert {each.value for each in found.phase_two.scenarios} == {"unconstrained", "constrained_with_clamping"}
    assert found.phase_two.transient_refusal(140.0, 3.0)


def _rows(rng, states, *, settings=1, repeats=3, shift=0.08, scatter=0.01, rounds=False):
    """Rows of a table without names: settings below each other, repeats beside each other or in rounds."""
    rows = []
    for setting in range(settings):
        order = np.tile(np.arange(27), repeats) if rounds else np.repeat(np.arange(27), repeats)
        for d, h, v in states[order]:
            force = 900 * v**0.8 * np.exp(scatter * rng.normal() - setting * shift * (0.5 + d))
            rows.append(f"{d},{h},{v},{force:.2f}")
    return "distance_m,height_m,speed_mps,peak_force_N\n" + "\n".join(rows) + "\n"


STATES = np.array(list(itertools.product([0.5, 0.7, 0.9], [0.1, 0.3, 0.5], [0.1, 0.2, 0.4])))


@pytest.mark.parametrize(("repeats", "shift"), [(1, 0.10), (2, 0.08), (3, 0.06)])
def test_two_settings_below_each_other_are_refused(tmp_path, repeats, shift):
    text = _rows(np.random.default_rng(3), STATES, settings=2, repeats=repeats, shift=shift)
    (tmp_path / "impacts.csv").write_text(text)
    with pytest.raises(TableError, match=r"27 states again from here on.*make a table for each") as caught:
        fm.read_dataset(tmp_path / "impacts.csv")
    assert caught.value.row == 2 + 27 * repeats
    header, *lines = text.splitlines()
    (tmp_path / "impacts.csv").write_text("\n".join([header + ",safety_settings", *(f"{line},A" for line in lines)]))
    assert len(fm.read_dataset(tmp_path / "impacts.csv")) == 54 * repeats


def test_settings_beside_each_other_are_refused(tmp_path):
    """Sorted by state no series is seen: what tells is that repeats lie far apart."""
    rows = (f"{d},{h},{v},{900 * v**0.8 * share:.2f}" for d, h, v in STATES for share in (1.0, 0.6))
    (tmp_path / "impacts.csv").write_text("distance_m,height_m,speed_mps,peak_force_N\n" + "\n".join(rows) + "\n")
    with pytest.raises(TableError, match=r"repeats of the states 36% apart.*make a table for each"):
        fm.read_dataset(tmp_path / "impacts.csv")


@pytest.mark.parametrize("scatter", [0.005, 0.02, 0.04])
def test_rounds_of_one_setting_are_one_series(tmp_path, scatter):
    rng = np.random.default_rng(4)
    for repeats in (2, 3, 5):
        (tmp_path / "impacts.csv").write_text(_rows(rng, STATES, repeats=repeats, scatter=scatter, rounds=True))
        assert len(fm.read_dataset(tmp_path / "impacts.csv")) == 27 * repeats


def test_published_campaigns_below_each_other_are_refused(tmp_path):
    for name in ("kuka-iiwa7-30nm", "kuka-iiwa7-10nm"):
        fm.copy_example(name, tmp_path / name)
    frames = [
        fm.read_dataset(name).to_frame().drop(columns=["state_id", "repeat"]) for name in sorted(tmp_path.iterdir())
    ]
    pd.concat(frames).to_csv(tmp_path / "both.csv", index=False)
    with pytest.raises(TableError, match="states again from here on"):
        fm.read_dataset(tmp_path / "both.csv")
