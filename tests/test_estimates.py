"""Estimates by the contact model: against integrated collisions, and against free body parts of the virtual lab."""

from __future__ import annotations

import dataclasses
import math
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

import forcemap as fm
from forcemap.cli.app import run
from forcemap.dynamics.inverse_kinematics import inverse_kinematics, places_in_plane
from forcemap.dynamics.mass_map import robot_effective_mass_at
from forcemap.lab.bench import simulate_impacts, simulate_peaks
from forcemap.lab.virtual_robot import PRESETS, virtual_robot
from forcemap.limits.covers import Cover
from forcemap.limits.estimate import LAB_RATIOS, Altered, OtherContact, Reading, estimate_force
from mujoco_scene import device_force

PAGE = (Path(__file__).parents[1] / "docs" / "estimates.md").read_text()
MASSES = (0.3, 0.6, 1.2, 2.0, 3.0, 4.4, 8.0, 15.0, 40.0, 75.0)
FREE = ("estimate", "ur10e", "--distance", "0.8", "--height", "0.4", "--speed-mps", "0.25", "--body", "free")


def collision(speed, robot, body, k, k_c=math.inf, d_c=0.0, steps=20_000):
    """Largest force of two masses and the springs between them, by stepping through time (leapfrog)."""
    reduced = 1 / (1 / robot + 1 / body)
    dt = 4 * math.pi * math.sqrt(reduced * (1 / k + 1 / k_c)) / steps
    both, x, v, most = 1 / (1 / k + 1 / k_c), 0.0, speed, 0.0
    for _ in range(steps):
        x += v * dt / 2
        force = both * x if both * x <= k_c * d_c or k_c == math.inf else k * (x - d_c)
        most = max(most, force)
        v -= force / reduced * dt
        x += v * dt / 2
        if x < 0:
            break
    return most


@pytest.mark.parametrize("body", [0.6, 4.4, math.inf])
@pytest.mark.parametrize("cover", [None, Cover(20e3, 0.05), Cover(20e3, 0.002)])
@pytest.mark.parametrize(("k", "payload"), [(75e3, 0.0), (25e3, 3.0), (150e3, -2.0)])
def test_the_estimate_is_the_two_masses_collision(body, cover, k, payload):
    if (body, cover, k) == (math.inf, None, 75e3):
        return  # nothing is other
    read = collision(0.3, 9.0, math.inf, 75e3)
    spring = (cover.stiffness, cover.thickness) if cover else (math.inf, 0.0)
    expected = collision(0.3, 9.0 + payload, body, k, *spring)
    other = OtherContact(body, k, payload, cover)
    for robot_mass in (None, (9.0, 9.0)):
        found = estimate_force(Reading(read, 75e3, 0.3), other, robot_mass=robot_mass)
        assert found.highest == pytest.approx(expected, rel=2e-3)
        assert found.lowest == found.highest
    if body < math.inf:
        assert found.highest <= found.at_most * 1.002


@given(st.floats(1, 30), st.floats(1, 4), st.floats(-0.95, 5), st.one_of(st.floats(0.2, 100), st.just(math.inf)))
def test_property_bounds_of_the_robot_mass_bound_the_force(low, wider, payload, body):
    high = low * wider
    reading, other = Reading(200.0, 75e3), OtherContact(body, 50e3, payload * low)
    found = estimate_force(reading, other, robot_mass=(low, high))
    each = [estimate_force(reading, other, robot_mass=(m, m)).highest for m in np.linspace(low, high, 41).tolist()]
    assert found.lowest <= min(each) * (1 + 1e-12)
    assert found.highest >= max(each) * (1 - 1e-12)
    assert found.highest <= max(each) * 1.01


@given(st.floats(20, 500), st.floats(0.05, 1), st.floats(0.2, 75), st.floats(0.5, 100))
def test_property_of_a_free_body_part(force, speed, body, mass):
    reading = Reading(force, 75e3, speed, largest=force)
    if not 0.5 <= reading.robot_mass <= 2000:
        with pytest.raises(fm.InputError, match="by force, speed and spring"):
            estimate_force(reading, OtherContact(body))
        return
    own, stated = (
        estimate_force(reading, OtherContact(body)),
        estimate_force(reading, OtherContact(body), robot_mass=(mass, mass)),
    )
    assert own.highest <= own.at_most * (1 + 1e-12)
    assert own.at_most == min(force, speed * math.sqrt(75e3 * body)) == stated.at_most
    assert stated.highest == pytest.approx(force * math.sqrt(body / (body + mass)))
    heavier = estimate_force(reading, OtherContact(body), robot_mass=(mass, 2 * mass))
    assert heavier.highest == stated.highest
    assert heavier.lowest < stated.lowest


@pytest.mark.parametrize("body", [0.6, 4.4, 40.0])
def test_the_lab_with_a_free_mass_is_two_masses_and_a_spring(body):
    """A pad far stiffer than the device, hardly any servo, no reaction: F = v sqrt(k mu)."""
    robot = virtual_robot("ur10e-like")
    late = dataclasses.replace(robot.reaction, threshold=1e6)
    loose = dataclasses.replace(robot.servo, frequency=0.01)
    bare = dataclasses.replace(robot, servo=loose, reaction=late, pad_stiffness=1e8, pad_damping=1.0)
    mass = fm.robot_effective_mass_at(robot.robot, 0.7, 0.3).value
    expected = fm.pfl_contact_force(0.3, robot_mass=mass, body_mass=body, stiffness=75e3)
    found = simulate_impacts(bare, 0.7, 0.3, 0.3, body_mass=body, duration=0.2)
    assert found.peak_force[0] == pytest.approx(expected, rel=0.01)
    pushed = found.force[:, 0].sum() * 2e-4  # N s
    assert pushed == pytest.approx(2 * 0.3 / (1 / mass + 1 / body), rel=0.01)  # elastic


@pytest.mark.parametrize("body", [0.6, 4.4, 40.0])
@pytest.mark.parametrize(("preset", "place"), [("ur10e-like", (0.7, 0.3)), ("iiwa7-like-30nm", (0.71, 0.3))])
def test_mujoco_agrees_about_a_free_mass(preset, place, body):
    robot = virtual_robot(preset)
    ours = simulate_impacts(robot, *place, 0.3, body_mass=body, duration=0.15)
    at = places_in_plane(place[0], place[1] + robot.contact_radius)
    posture = inverse_kinematics(robot.robot, at, tool_direction=robot.tool_direction).positions
    theirs = device_force(robot, posture, 0.3, 0.15, body)
    assert ours.force.max() == pytest.approx(theirs.max(), rel=0.02)  # found: 0.004


@pytest.mark.parametrize("preset", PRESETS)
def test_a_fixed_device_is_an_infinite_mass_and_half_the_step_changes_little(preset):
    robot, states = virtual_robot(preset), (0.7, 0.3, [0.1, 0.3])
    fixed, heavy = simulate_peaks(robot, *states), simulate_peaks(robot, *states, body_mass=1e9)
    np.testing.assert_array_equal(fixed, simulate_peaks(robot, *states, body_mass=math.inf))
    np.testing.assert_allclose(heavy, fixed, rtol=1e-5)
    for mass in (0.3, 3.0):
        coarse, fine = (simulate_peaks(robot, *states, body_mass=mass, step=step) for step in (2e-4, 1e-4))
        np.testing.assert_allclose(coarse, fine, rtol=0.005)
    np.testing.assert_array_equal(
        simulate_peaks(robot, *states, body_mass=[0.6, 3.0])[0], simulate_peaks(robot, 0.7, 0.3, 0.1, body_mass=0.6)[0]
    )
    for wrong in (0.05, 0.0, -1.0, math.nan, [1.0, 2.0, 3.0]):
        with pytest.raises(fm.InputError, match="body mass"):
            simulate_peaks(robot, *states, body_mass=wrong)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("body", MASSES)
def test_the_labs_free_body_part_is_within_what_is_stated(preset, body):
    """Random places, speeds and springs: never above the stated error nor above what it is at most."""
    robot, rng = virtual_robot(preset), np.random.default_rng([19, round(10 * body)])
    d, h, v = rng.uniform(0.57, 0.85, 20), rng.uniform(0.15, 0.45, 20), rng.uniform(0.1, 0.6, 20)
    k = float(np.exp(rng.uniform(math.log(10e3), math.log(150e3))))
    fixed = simulate_impacts(robot, d, h, v, device_stiffness=k, duration=0.5)
    free = simulate_impacts(robot, d, h, v, device_stiffness=k, body_mass=body, duration=0.5).force.max(axis=0)
    at = h + robot.contact_radius
    along = robot_effective_mass_at(robot.robot, d, at, tool_direction=robot.tool_direction).value
    standard = robot.robot.standard_effective_mass
    for i in range(d.size):
        reading = Reading(fixed.peak_force[i], k, v[i], largest=fixed.force[:, i].max())
        other = OtherContact(body)
        own = estimate_force(reading, other)
        bounds = estimate_force(reading, other, robot_mass=tuple(sorted((float(along[i]), standard))))
        assert own.lab_lowest <= free[i] <= own.lab_highest
        assert bounds.lab_lowest <= free[i] <= bounds.lab_highest
        assert free[i] <= own.at_most == bounds.at_most


def test_errors_are_stated_only_where_the_lab_was_looked_at():
    inside = Reading(200.0, 75e3, 0.3)
    assert not math.isnan(estimate_force(inside, OtherContact(0.6)).lab_highest)
    for reading, other in (
        (Reading(200.0, 75e3, 0.05), OtherContact(0.6)),
        (Reading(200.0, 200e3, 0.3), OtherContact(0.6)),
        (inside, OtherContact(0.2)),
        (inside, OtherContact(80.0)),
        (inside, OtherContact(0.6, 25e3)),
        (inside, OtherContact(stiffness=5e3)),
        (inside, OtherContact(payload_change=7.0)),
        (inside, OtherContact(cover=Cover(2e3, 0.2))),
        (inside, OtherContact(cover=Cover(20e3, 0.001))),
    ):
        found = estimate_force(reading, other)
        assert math.isnan(found.lab_lowest)
        assert math.isnan(found.lab_highest)
        assert found.findings[1].kind is fm.FindingKind.ESTIMATE_BEYOND_LAB
    unknown = estimate_force(Reading(200.0, 75e3), OtherContact(0.6), robot_mass=(4.0, 15.0))
    assert math.isnan(unknown.lab_highest)
    assert math.isnan(unknown.at_most)


def test_what_is_at_most_needs_the_largest_force_or_the_speed():
    body = OtherContact(40.0)
    assert estimate_force(Reading(100.0, 75e3, 0.3), body).at_most == pytest.approx(0.3 * math.sqrt(75e3 * 40))
    assert estimate_force(Reading(100.0, 75e3, 0.3, largest=150.0), body).at_most == 150
    softer = estimate_force(Reading(100.0, 75e3, 0.3, largest=150.0), OtherContact(40.0, 25e3))
    assert softer.at_most == pytest.approx(0.3 * math.sqrt(25e3 * 40))
    assert math.isnan(estimate_force(Reading(100.0, 75e3, 0.3, largest=150.0), OtherContact(stiffness=25e3)).at_most)


@pytest.mark.parametrize(
    ("make", "part"),
    [
        (lambda: Reading(0.0, 75e3), "force"),
        (lambda: Reading(math.nan, 75e3), "force"),
        (lambda: Reading(100.0, 75.0), "N/m"),
        (lambda: Reading(100.0, 75e3, 250.0), "m/s"),
        (lambda: Reading(100.0, 75e3, 0.0), "m/s"),
        (lambda: Reading(100.0, 75e3, largest=99.0), "at least the peak"),
        (lambda: OtherContact(0.0), "body mass"),
        (lambda: OtherContact(math.nan), "body mass"),
        (lambda: OtherContact(600.0), "body mass"),
        (lambda: OtherContact(stiffness=75.0), "N/m"),
        (lambda: OtherContact(payload_change=math.nan), "payload"),
        (lambda: estimate_force(Reading(100.0, 75e3), OtherContact(0.6)), "state the mass"),
        (lambda: estimate_force(Reading(100.0, 75e3, 0.3), OtherContact()), "nothing that is other"),
        (lambda: estimate_force(Reading(100.0, 75e3, 0.3), OtherContact(stiffness=75e3)), "nothing that is other"),
        (lambda: estimate_force(Reading(100.0, 75e3), OtherContact(0.6), robot_mass=(15.0, 4.0)), "lower one first"),
        (lambda: estimate_force(Reading(100.0, 75e3), OtherContact(0.6), robot_mass=(4.0, 15000.0)), "robot mass"),
        (lambda: estimate_force(Reading(100.0, 75e3), OtherContact(0.6), robot_mass=(math.nan, 5.0)), "robot mass"),
        (lambda: estimate_force(Reading(9.0, 75e3), OtherContact(payload_change=-4), robot_mass=(4.0, 9)), "take off"),
    ],
)  # fmt: skip
def test_what_no_estimate_is_made_of(make, part):
    with pytest.raises(fm.InputError, match=re.escape(part)):
        make()


def test_the_command_says_first_what_it_is_and_gives_no_speed_and_no_verdict(forcemap, ask):
    code, out, _ = forcemap(*FREE, "--area", "back_of_hand")
    verdict, doubt, *rest = out.replace("\n    ", " ").splitlines()
    first = doubt.removeprefix("  ! ")
    assert code == 0
    assert verdict.startswith("ESTIMATED, no permission: 51.6 N for a free body part of 0.6 kg")
    assert verdict.endswith("; first read the 2 doubts below")
    assert first.startswith("MODEL ESTIMATE, never a permission")
    assert "forcemap plan other-contact" in out
    assert "0.6 kg" in out
    assert "51.6 N" in out
    assert "53.1 N" in out
    assert not re.search(r"admissible|permitted|within|exceeded|safe|capped", "\n".join(rest))
    code, answer = ask(*FREE, "--area", "back_of_hand")
    assert code == 0
    assert next(iter(answer)) == "estimate"
    assert answer["estimate"] == first
    assert {key for key in answer if "speed" in key or "verdict" in key or "outcome" in key} == {"speed_mps"}
    assert answer["speed_mps"] == 0.25  # the one that was asked
    bound = fm.FixedMargin(0.10).upper(fm.published_map("ur10e"), 0.8, 0.4, 0.25)
    assert answer["force_N"] == pytest.approx(float(bound))
    assert answer["highest_N"] == pytest.approx(1 / math.hypot(1 / answer["force_N"], 1 / (0.25 * math.sqrt(45e3))))
    assert answer["lab_highest_N"] == pytest.approx(answer["highest_N"] * LAB_RATIOS[Altered.FREE_BY_READING][1])
    assert "ISO/TS 15066:2016, A.3.4" in answer["rests_on"][0]
    assert "holds for" in answer["rests_on"][0]


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ((*FREE, "--area", "face"), "not permitted"),
        ((*FREE, "--area", "hnad"), "hand_fingers"),
        (FREE, "mass of a free body part"),
        (FREE[:-2], "nothing that is other"),
        ((*FREE, "--area", "back_of_hand", "--force-N", "200"), "not both"),
        ((*FREE[:6], "--speed-mps", "0.9", "--body-mass-kg", "2"), "0.2 to 0.4"),
        ((*FREE[:2], "--distance", "1.8", *FREE[4:], "--body-mass-kg", "2"), "outside the measured range"),
        ((*FREE[:6], "--body-mass-kg", "2"), "--speed-mps"),
        (("estimate", "--force-N", "200", "--body-mass-kg", "2"), "--device-spring-N-per-mm"),
        ((*FREE, "--area", "palm", "--robot-mass-kg", "4-15"), "LOW:HIGH"),
        ((*FREE, "--area", "palm", "--robot-mass-kg", "4:5:6"), "LOW:HIGH"),
        ((*FREE[:-2], "--cover-N-per-mm", "20"), "together"),
    ],
)
def test_what_the_command_refuses(forcemap, arguments, part):
    code, out, err = forcemap(*arguments)
    assert (code, out) == (2, "")
    assert part in err


def test_what_is_measured_instead_is_named_and_an_edited_table_said_first(forcemap, simulated, tmp_path):
    folder = tmp_path / "cell"
    shutil.copytree(simulated, folder)
    state = ("--distance", "0.7", "--height", "0.3", "--speed-mps", "0.3")
    code, out, _ = forcemap("estimate", folder, *state, "--payload-change-kg", "2")
    assert code == 0
    assert "; SIMULATED; first read the 2 doubts" in " ".join(out.split())
    assert "--transfer map.json" in out
    assert f"compare {folder}" in " ".join(out.split())
    table = folder / "impacts.csv"
    head, *rows = table.read_text().splitlines()
    table.write_text("\n".join([head, *rows[:-1]]) + "\n")
    code, out, _ = forcemap("estimate", folder, *state, "--payload-change-kg", "2")
    assert code == 0
    assert "is not what forcemap collect wrote" in out.partition("\nread on ")[0].replace("\n    ", " ")


def test_the_plan_to_measure_instead_can_be_run_as_it_is_printed(ask, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, answer = ask(*FREE, "--area", "chest")
    (command,) = [step for step in answer["measure"] if step.startswith("forcemap plan")]
    assert run(shlex.split(command)[1:]) == 0
    plan = fm.read_plan("other-contact")
    assert (plan.distance.min(), plan.distance.max()) == (0.52, 0.89)
    assert "25000" in Path("other-contact", "campaign.toml").read_text()
    assert "40 kg" in answer["measure"][0]


def test_the_page_states_what_the_command_states_and_its_commands_run(capsys):
    rows = re.findall(r"^\| ([\w ]+) \| ([\d.]+) to ([\d.]+) \| ([\d.]+) to ([\d.]+) \|", PAGE, re.M)
    stated = {row[0].replace(" ", "_"): tuple(map(float, row[3:])) for row in rows}
    assert stated == {what.value: LAB_RATIOS[what] for what in Altered}
    for _, low, high, *command in rows:
        assert float(command[0]) <= float(low) <= float(high) <= float(command[1])
    commands = re.findall(r"^    forcemap (.*)$", PAGE, re.M)
    assert len(commands) >= 5
    for command in commands:
        assert run(shlex.split(command)) == 0
    assert capsys.readouterr().out.count("MODEL ESTIMATE") == len(commands)
