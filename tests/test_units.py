"""Units: what the states of a campaign show of a slip, what cannot be told, and never a speed from another unit."""

from __future__ import annotations

import csv
import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
from oracle import full_grid, printed_force, simulate, training_grid

import forcemap as fm
from forcemap.campaigns.units import unit_of_time_finding
from forcemap.errors import ForcemapError, TableError
from forcemap.lab.bench import simulate_peaks
from forcemap.lab.virtual_robot import PRESETS, virtual_robot
from forcemap.recordings.units import ForceUnit, TimeUnit, remarked_units, stated_unit
from forcemap.words import sentence
from pulses import TOML, collect, pulse, register, rows, save, write_campaign
from real_data import needs_real_data

HAND = fm.force_limit("back_of_hand")
# what figures in another unit come out as, over what they are in N and m/s
SLIPS = {
    "daN": (0.1, 1.0), "kgf": (1 / 9.80665, 1.0), "lbf": (1 / 4.4482216, 1.0), "kN": (1e-3, 1.0),
    "km/h": (1.0, 3.6), "ft/s": (1.0, 1 / 0.3048), "mm/s": (1.0, 1000.0),
}  # fmt: skip


def rewritten(folder, new, *, force=1.0, speed=1.0, **columns):
    """A table with its forces and speeds multiplied, and further columns, beside the campaign.toml of the folder."""
    new.mkdir()
    (new / "campaign.toml").write_bytes((folder / "campaign.toml").read_bytes())
    table = rows(folder / "impacts.csv")
    for row in table:
        row["peak_force_N"] = repr(force * float(row["peak_force_N"]))
        row["speed_mps"] = repr(speed * float(row["speed_mps"]))
        row.update(columns)
    with (new / "impacts.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, table[0])
        writer.writeheader()
        writer.writerows(table)
    return new


def dataset_of(d, h, v, force, **options):
    """Impacts of which those beyond 500 N are censored."""
    above = force >= 500.0
    return fm.ImpactDataset.from_arrays(
        distance=d, height=h, speed=v, peak_force=np.where(above, 500.0, force), censored=above, **options
    )


def preset_campaign(name):
    """(d, h, v), forces [N] and moving mass [kg] of a preset of the lab, from slow to fast."""
    robot = virtual_robot(name)
    axes = [(0.58, 0.7, 0.82), (0.16, 0.3, 0.44), (0.05, 0.1, 0.2, 0.3, 0.4)]
    states = [axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")]
    return states, simulate_peaks(robot, *states), robot.robot.moving_mass


@pytest.mark.parametrize("slip", SLIPS)
@pytest.mark.parametrize("name", fm.EXAMPLE_CAMPAIGNS)
def test_a_slip_of_a_unit_gives_no_speed_on_the_example_campaigns(name, slip, example_folders, tmp_path, ask):
    force, speed = SLIPS[slip]
    folder = rewritten(example_folders[name], tmp_path / "slip", force=force, speed=speed)
    if slip in ("kN", "mm/s"):  # no robot beside a person is so fast, none so gentle
        with pytest.raises(TableError, match="found") as caught:
            fm.read_dataset(folder)
        assert caught.value.column in ("peak_force_N", "speed_mps")
        return
    dataset = fm.read_dataset(folder)
    assert dataset.no_speed.kind.value == "unit_slip"
    assert slip in dataset.no_speed.figure("units")
    force_map = fm.fit_force_map(dataset)
    for contact in fm.Contact:
        found = fm.safe_speed(force_map, 0.7, 0.3, limit=HAND, contact=contact, bound=fm.ToleranceBound())
        assert found.outcome is fm.SpeedOutcome.UNCONFIRMED
        assert found.reason.kind.value == "unit_slip"
        assert f" {slip}," in sentence(found.reason)
    fm.write_map(force_map, tmp_path / "map.json")
    options = ("--distance", 0.7, "--height", 0.3, "--area", "back_of_hand", "--contact", "transient")
    code, answer = ask("speed", tmp_path / "map.json", *options)
    assert (code, answer["outcome"]) == (1, "unconfirmed")
    assert slip in answer["reason"]


@pytest.mark.parametrize("name", fm.EXAMPLE_CAMPAIGNS)
def test_the_example_campaigns_raise_no_alarm(name, examples):
    assert examples[name].no_speed is None
    force_map = fm.fit_force_map(examples[name])
    found = fm.safe_speed(force_map, 0.7, 0.3, limit=HAND, contact="quasi-static", bound=fm.ToleranceBound())
    assert not any("nits" in sentence(each) for each in found.basis.warnings)


@pytest.mark.parametrize("name", PRESETS)
def test_slips_on_the_presets_of_the_lab(name):
    (d, h, v), force, mass = preset_campaign(name)
    conditions = fm.Conditions(moving_mass=mass, payload=0.0, device=fm.Device(range=500.0, error=3.0, stiffness=75e3))
    assert dataset_of(d, h, v, force, conditions=conditions).no_speed is None
    for slip, (of_force, of_speed) in SLIPS.items():
        if slip not in ("kN", "mm/s"):
            found = dataset_of(d, h, of_speed * v, of_force * force, conditions=conditions).no_speed
            assert found is not None, slip
            assert slip in found.figure("units")
    wide = dataclasses.replace(conditions, device=dataclasses.replace(conditions.device, range=math.nan))
    columns = {"distance": d, "height": h, "speed": v, "conditions": wide}
    for slip in ("daN", "kgf", "lbf"):  # converted although they were newtons
        found = fm.ImpactDataset.from_arrays(**columns, peak_force=force / SLIPS[slip][0]).no_speed
        assert slip in found.figure("units")
        assert "converted more than once" in sentence(found)


def test_a_map_file_that_does_not_say_so_is_checked_when_it_is_read(tmp_path):
    """The check is of the states and the conditions that the file holds."""
    points = training_grid("ur10e")
    force = printed_force("ur10e", *points.T) / 10
    toml = fm.Conditions(moving_mass=30.0, device=fm.Device(range=500.0, stiffness=75e3))
    d, h, v = points.T
    fitted = fm.fit_force_map(dataset_of(d, h, v, force, conditions=toml))
    unsaid = dataclasses.replace(fitted, binding=type(fitted.binding)())
    fm.write_map(unsaid, tmp_path / "map.json")
    again = fm.read_map(tmp_path / "map.json")
    assert again.binding.refusal.figure("units")[:2] == ("daN", "kgf")


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ({"device_stiffness": 75e3}, "units not checked: robot.moving_mass_kg not stated in campaign.toml"),
        (
            {"conditions": fm.Conditions(moving_mass=30.0)},
            "units not checked: device.stiffness_N_per_m not stated in campaign.toml",
        ),
        ({}, "units not checked: robot.moving_mass_kg, device.stiffness_N_per_m not stated in campaign.toml"),
    ],
)
def test_a_figure_that_is_not_stated_is_said(stated, said):
    frame = simulate("ur10e", np.random.default_rng(7), effect=0.022, device_range=1000.0).dataset.to_frame()
    dataset = fm.ImpactDataset.from_frame(frame, **stated)
    found = fm.safe_speed(
        fm.fit_force_map(dataset), 0.7, 0.3, limit=200.0, contact="quasi-static", bound=fm.ToleranceBound()
    )
    assert said in [sentence(each) for each in found.basis.warnings]


def test_slow_states_alone_do_not_tell():
    """Slow impacts of a controlled robot exceed the model by nature; that is no slip, and the result says so."""
    conditions = fm.Conditions(moving_mass=30.0, device=fm.Device(range=500.0, stiffness=75e3))
    axes = np.meshgrid((0.55, 0.7, 0.85), (0.16, 0.3, 0.44), (0.03, 0.1, 0.19), indexing="ij")
    d, h, v = (axis.ravel() for axis in axes)
    for factor in (0.1, 1.0):
        dataset = dataset_of(d, h, v, factor * printed_force("ur10e", d, h, v), conditions=conditions)
        assert dataset.no_speed is None
        found = fm.safe_speed(
            fm.fit_force_map(dataset), 0.7, 0.3, limit=20.0, contact="quasi-static", bound=fm.ToleranceBound()
        )
        (line,) = [line for each in found.basis.warnings if "units" in (line := sentence(each))]
        assert line.startswith("units not checked: only states at 0.2 m/s and above can tell")


def test_a_device_range_that_ends_below_the_forces_is_no_slip():
    """What lies above the range is known to be at least so much: it never speaks for forces that are too low."""
    points = full_grid("ur10e")
    conditions = fm.Conditions(moving_mass=30.0, device=fm.Device(range=120.0, stiffness=75e3))
    force = printed_force("ur10e", *points.T)
    above = force >= 120.0
    dataset = fm.ImpactDataset.from_arrays(
        distance=points[:, 0], height=points[:, 1], speed=points[:, 2], peak_force=np.where(above, 120.0, force),
        censored=above, conditions=conditions,
    )  # fmt: skip
    assert dataset.no_speed is None


@pytest.mark.parametrize("stiffness", [10e3, 25e3, 75e3, 150e3])
@pytest.mark.parametrize("name", PRESETS)
def test_other_springs_and_covers_raise_no_alarm(name, stiffness):
    robot, (d, h, v) = virtual_robot(name), np.array([[0.6, 0.7, 0.8, 0.7], [0.2, 0.3, 0.4, 0.2], [0.2, 0.3, 0.4, 0.4]])
    for changed, covers in ((robot, "none"), (robot.with_cover(20e3), "foam")):
        force = simulate_peaks(changed, d, h, v, device_stiffness=stiffness)
        conditions = fm.Conditions(
            moving_mass=robot.robot.moving_mass, covers=covers, device=fm.Device(stiffness=stiffness)
        )
        dataset = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force, conditions=conditions)
        assert dataset.no_speed is None


@pytest.mark.parametrize("seed", range(3))
def test_a_part_of_a_table_and_new_impacts_are_held_to_it(seed):
    """Neither a selection nor new impacts beside a map pass with figures in another unit."""
    campaign = simulate("ur10e", np.random.default_rng(seed), effect=0.022)
    conditions = dataclasses.replace(campaign.dataset.conditions, moving_mass=30.0)
    frame = campaign.dataset.to_frame()
    good = fm.ImpactDataset.from_frame(frame, conditions=conditions)
    kgf = fm.ImpactDataset.from_frame(
        frame.assign(peak_force_N=frame.peak_force_N / 9.80665, censored=False), conditions=conditions
    )
    assert fm.fit_force_map(kgf.select(kgf.role == "train")).binding.refusal
    checked = fm.check_map(fm.fit_force_map(good), kgf.select(kgf.role == "test"))
    assert checked.outcome is not fm.MapOutcome.HOLDS


SOFT = TOML + "[robot]\nmoving_mass_kg = 12.0\n"


def test_collect_says_it_at_once(tmp_path, ask, forcemap):
    """Forces of 27 recordings in daN, as a device set to them writes: nothing else looks odd about them."""
    folder = write_campaign(tmp_path / "right", toml=SOFT)
    code, right = ask("collect", folder)
    assert (code, right["no_speed"], right["units"]) == (0, "", "")
    wrong = write_campaign(tmp_path / "wrong", toml=SOFT, recorded=False)
    plan = fm.read_plan(wrong)
    for i, name in enumerate(plan.recording.tolist()):
        force = 20.0 + 50.0 * float(plan.speed[i])
        save(wrong / "recordings" / f"{name}.csv", *pulse(force, rate=1000.0, seed=i))
    code, found = ask("collect", wrong)
    assert code == 0
    assert "such as" in found["no_speed"]
    assert "lbf" in found["no_speed"] or "km/h" in found["no_speed"]
    out = forcemap("collect", wrong)[1]
    assert "NO SPEED from these impacts: UNITS: forces are" in out
    without = write_campaign(tmp_path / "without")
    code, found = ask("collect", without)
    assert (code, found["no_speed"]) == (0, "")
    assert found["units"] == "units not checked: robot.moving_mass_kg not stated in campaign.toml"
    assert "Units not checked: robot.moving_mass_kg not stated in campaign.toml" in forcemap("collect", without)[1]


def test_phase_one_tells_a_unit_of_time(tmp_path):
    """A stiff spring and a light robot: Phase I lasts some 11 ms; these recordings show more than a second."""
    toml = TOML.replace("75000.0", "150000.0") + "[robot]\nmoving_mass_kg = 4.0\n"
    folder = write_campaign(tmp_path / "campaign", toml=toml, recorded=False)
    names = fm.read_plan(folder).recording.tolist()[:3]
    for name, peak in zip(names, (60.0, 62.0, 61.0), strict=True):
        save(folder / "recordings" / f"{name}.csv", *pulse(peak, rate=500.0, duration=1.2, before=5.0, after=15.0))
    found = collect(folder).no_speed
    assert found.kind.value == "unit_of_time_slip"
    assert "ms taken for s" in sentence(found)
    long = [float(row["phase1_duration_s"]) for row in register(folder).values() if row["phase1_duration_s"]]
    assert found.figure("ratio") == pytest.approx(
        np.exp(np.mean(np.log(long))) / (math.pi * math.sqrt(2.0 / 150e3)), rel=1e-3
    )
    quick = write_campaign(tmp_path / "quick", toml=toml, recorded=True)  # 30 ms: well within a factor of 20
    assert collect(quick).no_speed is None


@pytest.mark.parametrize("seed", range(20))
def test_property_any_campaign_in_its_units_passes_and_no_slip_does(seed):
    """Robots of any mass on any spring that follow the model within a third."""
    rng = np.random.default_rng(seed)
    mass, stiffness = rng.uniform(5, 60), rng.choice([25e3, 50e3, 75e3, 150e3])
    d, h, v = rng.uniform([0.5, 0.1, 0.05], [0.9, 0.5, 0.6], (40, 3)).T
    force = v * np.sqrt(stiffness * mass / 2) * rng.uniform(0.75, 1.33) * np.exp(rng.normal(0, 0.2, 40))
    conditions = fm.Conditions(moving_mass=mass, device=fm.Device(stiffness=stiffness))

    def no_speed(of_force, of_speed):
        try:
            return fm.ImpactDataset.from_arrays(
                distance=d, height=h, speed=of_speed * v, peak_force=of_force * force, conditions=conditions
            ).no_speed
        except ForcemapError as error:
            return error

    assert no_speed(1.0, 1.0) is None
    assert all(no_speed(*SLIPS[slip]) is not None for slip in SLIPS)


@pytest.mark.real_data
@needs_real_data
def test_real_recordings_raise_no_alarm(real_data):
    """An arm that presses slowly, and dummies hit by mobile robots: no spring that a device may have makes them one."""
    device = fm.Device(range=10_000.0, error=3.0)
    arm = {"time": 1, "time_unit": "ms", "force": [20, 21, 22]}
    dummy = {"time": "time_ms", "time_unit": "ms", "force": "force_N", "curve": "speed_m_s_label"}
    for folder, columns, mass, speeds in (("ur_clamp", arm, 33.0, (0.066, 0.136)), ("dummy_impact", dummy, 133.0, ())):
        impacts = [
            (recording.curve, impact)
            for path in sorted((real_data / folder).glob("*.csv"))
            for recording in fm.read_recordings(path, columns=columns, device=device)
            for impact in fm.find_impacts(recording)
        ]
        durations = np.array([impact.phase1_end - impact.onset for _, impact in impacts])
        for stiffness in (25e3, 75e3, 150e3):
            assert unit_of_time_finding(durations, np.full(len(impacts), stiffness), mass / 2) is None
        assert unit_of_time_finding(1000 * durations, np.full(len(impacts), 75e3), mass / 2).figure("long")
        assert not unit_of_time_finding(durations / 1000, np.full(len(impacts), 75e3), mass / 2).figure("long")
        n = len(impacts)
        v = np.linspace(*speeds, n) if speeds else np.array([float(curve[:3]) for curve, _ in impacts])
        # no device stood between robot and dummy, so no spring is stated
        spring = 75e3 if speeds else None
        dataset = fm.ImpactDataset.from_arrays(
            distance=np.linspace(0.5, 0.9, n), height=np.linspace(0.1, 0.5, n), speed=v,
            peak_force=[impact.peak_force for _, impact in impacts], conditions=fm.Conditions(moving_mass=mass),
            device_stiffness=spring,
        )  # fmt: skip
        assert dataset.no_speed is None or dataset.no_speed.kind.value == "spring_not_stated"


@pytest.mark.parametrize("unit", ForceUnit)
def test_every_unit_of_force_reads_as_the_same_newtons_and_is_offered(unit, tmp_path):
    time, force = np.arange(400) / 1000, 200 * np.sin(np.pi * np.clip((np.arange(400) - 100) / 100, 0, 1)) ** 2
    factors = {ForceUnit.NEWTONS: 1.0, ForceUnit.KILONEWTONS: 1000.0, ForceUnit.COUNTS: 0.25}
    file, factor = tmp_path / "impact.csv", factors[unit]
    file.write_text("t,F\n" + "".join(f"{t:.3f},{float(f) / factor!r}\n" for t, f in zip(time, force, strict=True)))
    counts = {"newtons_per_count": factor} if unit is ForceUnit.COUNTS else {}
    columns = fm.ColumnMap(time="t", force="F", force_unit=unit, **counts)
    (read,) = fm.read_recordings(file, columns=columns)
    np.testing.assert_allclose(read.force, force, atol=1e-9)
    root = Path(__file__).parents[1]
    (row,) = [
        row for row in (root / "docs/campaign_file.md").read_text().splitlines() if "`recordings.force_unit`" in row
    ]
    assert f'`"{unit}"`' in row
    if unit is not ForceUnit.COUNTS:
        (refused,) = [
            row
            for row in (root / "docs/your_device_files.md").read_text().splitlines()
            if row.startswith("| a unit that is") and '`force_unit = "counts"`' in row
        ]
        head, example = refused.split(" (`[")[0], refused.split(" (`[")[1].split(")")[0]
        assert re.search(rf"\b{unit}\b", head), head
        assert f"[{unit}]" not in f"[{example}"


PREFIXES = ("", "k", "da", "h", "c", "m", "M")
NO_FORCE = [
    f"{prefix}N{rest}" for prefix in PREFIXES for rest in ("m", "cm", "mm", "s", "_m", " m", "_per_s", " pro mm")
]
NO_FORCE += [
    "kgm",
    "lbin",
    "lbf_in",
    "ftlb",
    "ft-lb",
    "oz in",
    "Npm",
    "N_s",
    "lbf s",
    "N∙m",
    "Newton_meter",
    "newton_s",
]


@pytest.mark.parametrize("name", ["Mz_{}", "Force {}", "F [{}]", "{}"])
@pytest.mark.parametrize("unit", NO_FORCE)
def test_a_torque_a_stiffness_or_an_impulse_is_never_read_as_a_force(unit, name):
    """However force and length, or time, are joined, and whatever the prefix."""
    found = stated_unit(name.format(unit), alone=name == "{}")
    assert found is not None
    assert not isinstance(found, ForceUnit)


@pytest.mark.parametrize("name", ["Force ×10 [N]", "Force x10 [N]", "10× N", "Kraft [N] × 10", "F ×100 N", "N × 10"])
def test_a_factor_beside_a_unit_is_never_passed_over(name):
    found = stated_unit(name)
    assert found is not None
    assert not isinstance(found, ForceUnit)
    inside = name.replace("[N]", "N")
    remarked = remarked_units(f"# column 2: F [{inside}]", of_time=False)
    assert not any(isinstance(unit, ForceUnit) for unit in remarked)


@pytest.mark.parametrize(
    "name",
    ["Torque [N]", "Mz [N]", "Drehmoment in N", "Stiffness [N]", "Force [N]/mm", "Force [N] per mm", "Force (N)m",
     "Force [N]*s", "Moment_z_N", "Fz inlbs", "F Nxmm", "Tz [N]", "M_z_N", "Momento [N]", "couple (N)", "Pressure [N]",
     "dF/dt [N]"],
)  # fmt: skip
def test_a_name_of_another_quantity_states_no_unit_that_is_read(name):
    found = stated_unit(name)
    assert found is not None
    assert not isinstance(found, ForceUnit)


@pytest.mark.parametrize(
    "name",
    [
        "Force_N_max",
        "Kraft N Messung",
        "Contact position Force [N]",
        "F_z [N]",
        "Zug/Druck [N]",
        "Position 1 [N]",
        "F_N_sensor",
        "N_mean",
        "Fx [N] in TCP",
        "Kraft Moment [N]",
        "Force in N",
    ],
)
def test_a_word_that_begins_as_a_length_or_a_time_does_is_none(name):
    assert stated_unit(name) is ForceUnit.NEWTONS


@pytest.mark.parametrize("unit", TimeUnit)
def test_every_unit_of_time_reads_as_the_same_seconds_and_is_offered(unit, tmp_path):
    factors = {TimeUnit.SECONDS: 1, TimeUnit.MILLISECONDS: 10**3, TimeUnit.MICROSECONDS: 10**6}
    factor, file = factors.get(unit, 10**9), tmp_path / "impact.csv"
    file.write_text("t,F\n" + "".join(f"{i * factor / 1000!r},{i % 7}\n" for i in range(400)))
    (read,) = fm.read_recordings(file, columns=fm.ColumnMap(time="t", time_unit=unit, force="F", force_unit="N"))
    np.testing.assert_allclose(read.time, np.arange(400) / 1000, atol=1e-9)
    rows = (Path(__file__).parents[1] / "docs/campaign_file.md").read_text().splitlines()
    (row,) = [row for row in rows if "`recordings.time_unit`" in row]
    assert f'`"{unit}"`' in row


@pytest.mark.parametrize("unit", [unit for unit in ForceUnit if unit is not ForceUnit.COUNTS])
def test_a_factor_before_any_unit_is_no_unit_that_is_read(unit):
    for words in (f"Force 10 {unit}", f"Force [100 {unit}]", f"F 10{unit}"):
        assert not isinstance(stated_unit(words), ForceUnit), words
        assert stated_unit(words), words
    assert remarked_units(f"Force unit: 10 {unit}", of_time=False) == [f"10 {unit}"]
