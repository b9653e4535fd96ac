"""The virtual lab: presets against the published maps, the model against MuJoCo, devices, campaigns, refusals."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import forcemap as fm
from forcemap.dynamics.inverse_kinematics import inverse_kinematics, places_in_plane
from forcemap.lab.bench import SimulatedImpacts, SimulatedScenario, simulate_impacts, simulate_peaks
from forcemap.lab.course import ContactLayer
from forcemap.lab.reached_ranges import reached_ranges
from forcemap.lab.reaction import Reaction, ReactionKind
from forcemap.lab.simulated_campaign import simulate_campaign
from forcemap.lab.simulated_device import PAPER_DEVICE, SimulatedDevice
from forcemap.lab.virtual_robot import PRESETS, virtual_robot
from mujoco_scene import device_force

MAPS = dict(zip(PRESETS, fm.PUBLISHED_MAPS, strict=True))
PROJECT = Path(__file__).parents[1]
FACTS = Path(fm.__file__).parent / "maps" / "published" / "published_maps.json"


def grid(preset):
    """Distances, heights and speeds of the 125 states of the preset's map, each of shape (5, 5, 5)."""
    figures = json.loads(FACTS.read_text())["maps"][MAPS[preset]]
    return np.meshgrid(figures["distances_m"], figures["heights_m"], figures["speeds_mps"], indexing="ij")


@pytest.fixture(scope="module")
def impacts():
    """One second of the impacts at all 125 states, by preset."""
    return {preset: simulate_impacts(virtual_robot(preset), *grid(preset)) for preset in PRESETS}


@pytest.mark.parametrize("preset", PRESETS)
class TestPresets:
    def test_peaks_are_near_the_published_map(self, preset, impacts):
        simulated = impacts[preset]
        published = fm.published_map(MAPS[preset]).predict(simulated.distance, simulated.height, simulated.speed)
        ratio = simulated.peak_force / published
        assert 0.85 < ratio.min() <= ratio.max() < 1.15
        assert ratio.std() <= 0.06

    def test_trends_have_the_right_sign_at_every_state(self, preset, impacts):
        peaks = impacts[preset].peak_force.reshape(5, 5, 5)
        assert (np.diff(peaks, axis=0) < 0).all()
        assert (np.diff(peaks, axis=1) < 0).all()
        assert (np.diff(peaks, axis=2) > 0).all()

    def test_what_follows_the_peak(self, preset, impacts):
        simulated = impacts[preset]
        if preset == "ur10e-like":
            assert not simulated.force[simulated.time > 0.2].any()
            assert set(simulated.scenario) == {SimulatedScenario.UNCONSTRAINED}
        else:
            assert 100 < simulated.held_force.min() <= simulated.held_force.max() < 160
            assert 100 < simulated.force[-1].min() <= simulated.force[-1].max() < 160
            assert set(simulated.scenario) == {SimulatedScenario.WITH_CLAMPING}
        assert (simulated.force.max(axis=0) == simulated.peak_force).all()

    def test_half_the_step_changes_little(self, preset, impacts):
        finer = simulate_peaks(virtual_robot(preset), *grid(preset), step=1e-4)
        np.testing.assert_allclose(impacts[preset].peak_force, finer, rtol=0.005)

    def test_the_peaks_alone_are_those_of_the_courses(self, preset, impacts):
        peaks = simulate_peaks(virtual_robot(preset), *grid(preset))
        np.testing.assert_array_equal(peaks, impacts[preset].peak_force)


def test_the_threshold_alone_lowers_the_mean_peak(impacts):
    high, low = (virtual_robot(f"iiwa7-like-{limit}nm") for limit in (30, 10))
    assert high.with_threshold(10.0).reaction == low.reaction
    for name in ("servo", "pad_stiffness", "pad_damping", "contact_radius", "tool_direction"):
        assert getattr(high, name) == getattr(low, name)
    peaks = [impacts[each.name].peak_force.mean() for each in (high, low)]
    assert 0.94 < peaks[1] / peaks[0] < 0.99


@pytest.mark.parametrize(
    ("preset", "place", "speed"),
    [
        *product(["ur10e-like"], [(0.55, 0.15), (0.7, 0.3), (0.88, 0.45)], [0.2, 0.4]),
        *product(["iiwa7-like-30nm"], [(0.57, 0.15), (0.71, 0.3), (0.85, 0.45)], [0.2, 0.4]),
    ],
)
def test_mujoco_agrees(preset, place, speed):
    """The whole arm in motion, not frozen at contact, with contact and springs that are MuJoCo's own."""
    robot = virtual_robot(preset)
    ours = simulate_impacts(robot, *place, speed, duration=0.15)
    at = places_in_plane(place[0], place[1] + robot.contact_radius)
    posture = inverse_kinematics(robot.robot, at, tool_direction=robot.tool_direction).positions
    theirs = device_force(robot, posture, speed, 0.15)
    assert ours.force.max() == pytest.approx(theirs.max(), rel=0.08)
    course = np.interp(ours.time, 5e-5 * np.arange(theirs.size), theirs)
    assert np.abs(course - ours.force[:, 0]).max() < 0.08 * theirs.max()


def test_the_labs_own_rule_for_scenarios():
    time = np.arange(5001) * 2e-4
    hump, later = np.where(time < 0.03, 100.0, 0.0), np.where((time > 0.1) & (time < 0.15), 50.0, 0.0)
    force = np.column_stack([hump, hump + later, np.maximum(hump, 40.0)])
    found = SimulatedImpacts(*np.ones((3, 3)), time=time, force=force, peak_force=force.max(axis=0))
    assert found.scenario == tuple(SimulatedScenario)
    np.testing.assert_allclose(found.held_force, [0, 0, 40])


class TestWhatIf:
    def test_a_payload_raises_and_a_cover_lowers_the_peak_of_fast_impacts(self):
        robot = virtual_robot("ur10e-like")
        states = (0.7, 0.3, [0.2, 0.3, 0.4])
        plain = simulate_peaks(robot, *states)
        loaded, covered = robot.with_payload(5.0), robot.with_cover(20_000.0)
        assert (simulate_peaks(loaded, *states) > 1.01 * plain).all()
        softened = simulate_peaks(covered, *states) / plain
        assert (np.diff(softened) < 0).all()  # the slow ones push until the reaction, cover or not
        assert softened[-1] < 0.85
        assert loaded.changes == ("payload 5 kg",)
        assert loaded.robot.load == 5.0
        assert covered.with_threshold(20.0).changes == ("cover of 20 N/mm", "collision threshold 20 Nm")

    def test_a_mass_on_a_spring(self):
        """A pad far stiffer than the device, hardly any servo: F = v sqrt(k m)."""
        robot = virtual_robot("ur10e-like")
        late = dataclasses.replace(robot.reaction, threshold=1e6)
        loose = dataclasses.replace(robot.servo, frequency=0.01)
        free = dataclasses.replace(robot, servo=loose, reaction=late, pad_stiffness=1e8, pad_damping=1.0)
        mass = fm.robot_effective_mass_at(robot.robot, 0.7, 0.3).value
        expected = 0.3 * math.sqrt(75_000 * mass)
        assert simulate_peaks(free, 0.7, 0.3, 0.3)[0] == pytest.approx(expected, rel=0.005)


def test_a_robot_without_drives_is_refused():
    robot = virtual_robot("ur10e-like")
    with pytest.raises(fm.InputError, match="drive inertia"):
        dataclasses.replace(robot, robot=fm.robot_named("ur10e"))


class TestDevice:
    def test_readings_saturate_and_stay_within_the_error(self):
        device = SimulatedDevice(
            device=dataclasses.replace(PAPER_DEVICE, range=300.0), noise=0.0, offset=0.0, drift=0.0
        )
        rng = np.random.default_rng(3)
        course = np.full((5001, 200), 200.0)
        course[:, 100:] = 350.0
        scales = [device.scale(rng) for _ in range(200)]
        assert 0 < max(abs(scale - 1) for scale in scales) <= 0.005
        read = device.readings(course, 2e-4, scales[0], rng)
        assert read.shape == (900, 200)
        assert read[-1, 100:].max() == 300.0
        assert np.abs(read[-1, :100] - 200.0).max() <= 3.0

    @pytest.mark.parametrize("change", [{"noise": -1.0}, {"sampling_rate": 0.0}, {"device": fm.Device(range=500.0)}])
    def test_figures_outside_their_range_are_refused(self, change):
        with pytest.raises(fm.InputError):
            SimulatedDevice(**change)


@pytest.fixture
def plan(tmp_path):
    (tmp_path / "plan.csv").write_text(
        "state_id,repeat,distance_m,height_m,speed_mps\na,1,0.6,0.2,0.2\na,2,0.6,0.2,0.2\n"
    )
    return fm.read_plan(tmp_path / "plan.csv")


def simulate(plan, folder, seed=1, **options):
    robot = virtual_robot("iiwa7-like-30nm")
    return simulate_campaign(plan, robot, SimulatedDevice(), np.random.default_rng(seed), folder, **options)


class TestCampaign:
    def test_every_file_is_marked_and_the_seed_repeats_it(self, plan, tmp_path):
        made, again, other = (simulate(plan, tmp_path / name, seed) for name, seed in (("x", 1), ("y", 1), ("z", 2)))
        files = sorted(path.relative_to(made.folder) for path in made.folder.rglob("*") if path.is_file())
        assert [str(file) for file in files] == [
            "campaign.toml", "plan.csv", "recordings/a-r1.csv", "recordings/a-r2.csv", "truth.csv",
        ]  # fmt: skip
        for file in files:
            text = (made.folder / file).read_text()
            assert "SIMULATED" in text
            assert text == (again.folder / file).read_text()
        assert (made.folder / files[2]).read_text() != (other.folder / files[2]).read_text()
        campaign = fm.read_campaign(made.folder)
        assert campaign.conditions.simulated
        assert campaign.plan.recording.tolist() == list(made.recording)
        assert fm.build_dataset(campaign).simulated

    def test_rows_keep_their_numbers_below_a_remark(self, plan, tmp_path):
        fm.write_plan(plan, tmp_path / "b.csv", remark="what\nthis is")
        text = (tmp_path / "b.csv").read_text()
        assert text.startswith("# what this is\n")
        assert fm.read_plan(tmp_path / "b.csv").speed.tolist() == plan.speed.tolist()
        (tmp_path / "b.csv").write_text(text.replace("0.6", "far", 1))
        with pytest.raises(fm.InputError) as error:
            fm.read_plan(tmp_path / "b.csv")
        assert error.value.row == 3

    def test_the_evaluation_never_reads_the_truth(self, plan, tmp_path):
        made = simulate(plan, tmp_path / "x")
        (made.folder / "truth.csv").write_bytes(b"\0 not a table")
        assert len(fm.build_dataset(fm.read_campaign(made.folder))) == 2

    def test_stated_conditions_stay_but_not_those_of_the_robot(self, plan, tmp_path):
        given = fm.Conditions(robot="mine", moving_mass=33.0, date="2026-05-30", covers="foam")
        stated = fm.read_campaign(simulate(plan, tmp_path / "x", conditions=given).folder).conditions
        assert (stated.robot, stated.moving_mass, stated.date) == ("virtual iiwa7-like-30nm", 33.0, "2026-05-30")
        assert (stated.covers, stated.device.stiffness) == ("none", 75_000.0)
        assert "30 Nm" in stated.safety_settings

    def test_measured_recordings_are_never_mixed_with_simulated_ones(self, plan, tmp_path):
        with pytest.raises(fm.InputError, match="holds files already"):
            simulate(plan, tmp_path)

    def test_a_place_out_of_reach_is_named(self, plan, tmp_path):
        far = dataclasses.replace(plan, distance=np.array([0.6, 2.0]))
        with pytest.raises(fm.InputError, match="d = 2 m"):
            simulate(far, tmp_path / "x")
        assert not (tmp_path / "x" / "plan.csv").exists()


@pytest.mark.parametrize(
    "options", [["--threshold-Nm", 10], ["--payload-kg", 1], ["--cover-N-per-m", 3e4], ["--hold-force-N", 100], []]
)
def test_every_change_of_the_robot_gives_recordings_that_are_read(ask, plan, tmp_path, options):
    """What the first line says of the robot is no unit."""
    folder = tmp_path / "made"
    assert ask("simulate", tmp_path / "plan.csv", "--preset", "iiwa7-like-30nm", *options, "-o", folder)[0] == 0
    assert ask("collect", folder)[1]["used"] == 2


def test_simulate_command(forcemap, ask, plan, tmp_path):
    code, found = ask("simulate", tmp_path / "plan.csv", "--preset", "ur10e-like", "--threshold-Nm", 40)
    assert (code, found["recordings"], found["scenarios"]) == (0, 2, ["unconstrained"])
    assert found["changes"] == ["collision threshold 40 Nm"]
    assert found["folder"] == str(tmp_path / "plan-ur10e-like")
    code, out, _ = forcemap("simulate", tmp_path / "plan.csv", "--preset", "ur10e-like", "-o", tmp_path / "b")
    assert code == 0
    assert out.startswith("SIMULATED with ur10e-like: not a measurement of any robot")
    code, found = ask("simulate", tmp_path, "--preset", "ur5")
    assert (code, found["error"]["kind"]) == (2, "unknown_name")


@pytest.mark.parametrize(("preset", "said"), [("ur10e-like", True), ("iiwa7-like-30nm", False)])
def test_why_a_robot_that_retreats_clamps_with_a_soft_cover(forcemap, ask, plan, tmp_path, preset, said):
    line = ("simulate", tmp_path / "plan.csv", "--preset", preset, "--cover-N-per-m", 5e3)
    _, found = ask(*line, "-o", tmp_path / "a")
    assert found["scenarios"] == ["constrained_with_clamping"]
    _, out, _ = forcemap(*line, "-o", tmp_path / "b")
    assert ("though the robot retreats" in out) == said


def test_the_campaigns_payload_is_simulated_and_what_is_not_is_named(forcemap, ask, plan, tmp_path):
    (tmp_path / "campaign.toml").write_text(
        'schema = "forcemap-campaign/1"\n[robot]\nmodel = "UR10e"\n[tool]\nname = "gripper"\npayload_kg = 1.2\n'
        '[contact]\nsite = "gripper"\ndirection = "down"\n[device]\nmodel = "PFMD"\nrange_N = 500.0\n'
    )
    line = ("simulate", tmp_path, "--preset", "ur10e-like")
    _, found = ask(*line, "-o", tmp_path / "a")
    assert found["changes"] == ["payload 1.2 kg"]
    assert fm.read_conditions(tmp_path / "a" / "campaign.toml").payload == 1.2
    assert found["not_simulated"] == ["robot.model", "tool.name", "contact.site"]
    _, found = ask(*line, "--payload-kg", 0.5, "-o", tmp_path / "b")
    assert found["changes"] == ["payload 0.5 kg"]
    assert "tool.payload_kg" in found["not_simulated"]
    _, out, _ = forcemap(*line, "-o", tmp_path / "c")
    assert "NOT SIMULATED of campaign.toml, the lab has its own: robot.model, tool.name, contact.site" in out


def test_every_place_out_of_reach_is_named_and_where_all_are_reached(ask, tmp_path):
    plan = fm.plan_measurements((0.4, 0.5, 0.7, 0.9), (0.1, 0.3, 0.6), (0.1, 0.2, 0.3), design=fm.Design.PAPER)
    fm.write_plan(plan, tmp_path)
    code, found = ask("simulate", tmp_path / "plan.csv", "--preset", "iiwa7-like-30nm")
    message = found["error"]["message"]
    robot = virtual_robot("iiwa7-like-30nm")
    places = np.unique(np.column_stack([plan.distance, plan.height]), axis=0)
    far = places[~robot.reaches(*places.T)].tolist()
    assert code == 2
    assert f"found {len(far)} places it cannot reach" in message
    assert all(f"d = {d:g} m, h = {h:g} m" in message for d, h in far)
    assert "all at distances 0.55 to 0.85 m and heights 0.1 to 0.6 m are reached" in message


def test_of_many_places_out_of_reach_the_first_ten_are_named():
    with pytest.raises(fm.InputError, match=r"found 12 places .* and 2 more; .* it reaches no place within these"):
        simulate_peaks(virtual_robot("iiwa7-like-30nm"), np.linspace(1.1, 1.2, 12), 0.3, 0.1)


@pytest.mark.parametrize("preset", PRESETS)
def test_the_places_that_the_table_of_presets_says_are_reached(preset):
    """All of them, and beyond each end but the base's height not all."""
    text = (PROJECT / "docs" / "virtual_lab.md").read_text()
    figures = re.search(rf"^\| `{preset}` .*\| (\S+) to (\S+) m, (\S+) to (\S+) m high \|$", text, re.M)
    near, far, low, high = map(float, figures.groups())
    reaches = virtual_robot(preset).reaches

    def all_reached(*ranges):
        axes = [np.linspace(*ends, round((ends[1] - ends[0]) / 0.05) + 1) for ends in ranges]
        return reaches(*(axis.ravel() for axis in np.meshgrid(*axes))).all()

    assert all_reached((near, far), (low, high))
    for wider in (
        ((near - 0.05, near), (low, high)),
        ((far, far + 0.05), (low, high)),
        ((near, far), (high, high + 0.05)),
    ):
        assert not all_reached(*wider)
    found = reached_ranges(reaches, (near, far), (low, high))
    assert found == (pytest.approx((near, far)), pytest.approx((low, high)))


REACTION = {"threshold": 30.0, "torque_filter": 0.002, "delay": 0.01, "time_constant": 0.01}


@pytest.mark.parametrize(
    "refused",
    [
        lambda: virtual_robot("ur10e"),
        lambda: ContactLayer(75_000.0, 0.0, 100.0),
        lambda: Reaction(kind=ReactionKind.RETREAT, **REACTION),
        lambda: Reaction(
            kind=ReactionKind.STOP_AND_HOLD, hold_force=100.0, yielding=1e-4, retreat_time=0.1, **REACTION
        ),
        lambda: Reaction(
            kind=ReactionKind.RETREAT, retreat_speed=0.1, retreat_time=0.1, **REACTION | {"delay": math.nan}
        ),
        lambda: virtual_robot("ur10e-like").with_threshold(0.0),
        lambda: virtual_robot("ur10e-like").with_payload(-1.0),
        lambda: virtual_robot("ur10e-like").with_cover(0.0),
        lambda: simulate_peaks(virtual_robot("ur10e-like"), 0.7, 0.3, -0.1),
        lambda: simulate_peaks(virtual_robot("ur10e-like"), math.nan, 0.3, 0.1),
        lambda: simulate_impacts(virtual_robot("ur10e-like"), 0.7, 0.3, 0.1, duration=0.0),
        lambda: simulate_impacts(virtual_robot("ur10e-like"), 0.7, 0.3, 0.1, step=1e-3),
        lambda: simulate_peaks(virtual_robot("ur10e-like"), 0.7, 0.3, 0.1, step=math.nan),
    ],
    ids=range(13),
)
def test_what_cannot_be_simulated_is_refused(refused):
    with pytest.raises(fm.InputError):
        refused()


@pytest.mark.parametrize("kind", list(ReactionKind))
def test_the_commanded_speed_follows_its_formula_before_and_after_the_reaction_begins(kind):
    figures = (
        {"retreat_speed": 0.2, "retreat_time": 0.05} if kind == "retreat" else {"hold_force": 60.0, "yielding": 1e-3}
    )
    reaction = Reaction(kind=kind, threshold=10.0, torque_filter=0.01, delay=0.01, time_constant=0.02, **figures)
    rng = np.random.default_rng(202618)
    speed, since, force = rng.uniform(0.1, 0.5, 200), rng.uniform(-0.1, 0.3, 200), rng.uniform(0, 300, 200)
    for v, t, f, found in zip(speed, since, force, reaction.commanded_speed(speed, since, force), strict=True):
        if t <= 0:
            expected = v
        elif kind == "retreat":
            fading = math.exp(-min(t, 0.05) / 0.02) * math.exp(-max(t - 0.05, 0) / 0.02)
            expected = -0.2 * math.exp(-max(t - 0.05, 0) / 0.02) + (v + 0.2) * fading
        else:
            hold = 1e-3 * (60.0 - f)
            expected = hold + (v - hold) * math.exp(-t / 0.02)
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert (reaction.before(speed) == reaction.commanded_speed(speed, np.minimum(since, 0.0), force)).all()


def test_a_robot_posed_again_at_the_same_places_gives_the_same_impacts():
    robot = virtual_robot("ur10e-like")
    first = simulate_peaks(robot, [0.6, 0.7], 0.3, 0.3)
    other = simulate_peaks(robot, [0.7, 0.6], 0.3, 0.3)
    higher = simulate_peaks(robot, [0.6, 0.7], 0.4, 0.3)
    assert (other[::-1] == first).all()
    assert (higher != first).all()
    assert (simulate_peaks(robot, [0.6, 0.7], 0.3, 0.3) == first).all()
    loaded = robot.with_payload(3.0)
    assert (simulate_peaks(loaded, [0.6, 0.7], 0.3, 0.3) != first).all()
