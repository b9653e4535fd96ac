"""Forces beside effective mass: figures recomputed by hand, named gaps, refusals, commands."""

from __future__ import annotations

import itertools
import re

import numpy as np
import pytest
from scipy.stats import spearmanr

import forcemap as fm
from forcemap.cli.app import run
from forcemap.dynamics.robots import identified_drive_inertia
from forcemap.words import sentences

OUT = (1.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def ur10e():
    return fm.robot_named("ur10e").with_drive_inertia(identified_drive_inertia("ur10e"))


def test_figures_are_those_of_the_formula(ur10e):
    ur_map = fm.published_map("ur10e")
    found = fm.compare_effective_mass(ur_map, ur10e)
    assert (found.speed, found.distance.size) == (0.3, 25)
    force = ur_map.predict(found.distance, found.height, 0.3)
    np.testing.assert_allclose(found.measured_force, force)
    np.testing.assert_allclose(found.measured_mass, (force / 0.3) ** 2 / 75_000)
    alone, driven = found.explanations
    for each, robot in ((alone, fm.robot_named("ur10e")), (driven, ur10e)):
        mass = fm.robot_effective_mass_at(robot, found.distance, found.height).value
        predicted = 0.3 * np.sqrt(75_000 * mass)
        np.testing.assert_allclose(each.force, predicted)
        np.testing.assert_allclose(each.ratio, force / predicted)
        assert each.rank_correlation == pytest.approx(spearmanr(predicted, force).statistic)
        y, p = np.log(force), np.log(predicted)
        total = np.sum((y - y.mean()) ** 2)
        assert each.explained_share == pytest.approx(1 - np.sum((y - p) ** 2) / total)
        shifted = p + (y - p).mean()
        assert each.explained_share_scaled == pytest.approx(1 - np.sum((y - shifted) ** 2) / total)


def test_what_the_docs_say_of_the_ur10e(ur10e):
    """Without drives the links say nothing of the place; with them the order is about right, the size is not."""
    alone, driven = fm.compare_effective_mass(fm.published_map("ur10e"), ur10e).explanations
    assert abs(alone.explained_share_scaled) < 0.02
    assert driven.rank_correlation > 0.8
    assert 0.2 < driven.explained_share_scaled < 0.35
    assert driven.ratio.min() > 1.1
    assert driven.ratio_spread > 2
    statements = sentences(fm.compare_effective_mass(fm.published_map("ur10e"), ur10e).statements)
    assert any("does not predict" in line for line in statements)
    assert any("not included" in line for line in statements)


def test_forces_that_follow_effective_mass_are_explained_wholly(ur10e):
    d, h = (axis.ravel() for axis in np.meshgrid(np.linspace(0.5, 0.9, 4), np.linspace(0.15, 0.45, 4)))
    force = 0.25 * np.sqrt(75_000 * fm.robot_effective_mass_at(ur10e, d, h).value)
    impacts = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=np.full(16, 0.25), peak_force=force)
    found = fm.compare_effective_mass(impacts, ur10e)
    driven = found.explanations[1]
    assert driven.explained_share == pytest.approx(1)
    assert driven.rank_correlation == pytest.approx(1)
    assert driven.ratio_spread == pytest.approx(1)
    np.testing.assert_allclose(found.measured_mass, driven.mass.value)
    doubled = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=np.full(16, 0.25), peak_force=2 * force)
    driven = fm.compare_effective_mass(doubled, ur10e).explanations[1]
    assert driven.explained_share < 0
    assert driven.explained_share_scaled == pytest.approx(1)


def test_measured_states_of_an_example(examples, ur10e):
    found = fm.compare_effective_mass(examples["ur10e"], ur10e, speed=0.2)
    assert found.on == "measured states"
    assert sentences(found.statements)[0].startswith("SIMULATED")
    assert found.distance.size == (np.abs(examples["ur10e"].states.speed - 0.2) < 0.01).sum()


def test_places_out_of_reach_are_named():
    """Pointing down, the iiwa's flange does not reach seven of the paper's places."""
    found = fm.compare_effective_mass(fm.published_map("kuka-iiwa7-30nm"), fm.robot_named("kuka-iiwa7"))
    (alone,) = found.explanations
    assert alone.places == 18
    assert [str(name) for name in alone.mass.outcome].count("unreachable") == 7
    assert np.isnan(alone.ratio).sum() == 7
    out = fm.compare_effective_mass(
        fm.published_map("kuka-iiwa7-30nm"), fm.robot_named("kuka-iiwa7"), tool_direction=OUT
    )
    assert out.explanations[0].places == 25


@pytest.mark.parametrize(
    "options", [{"stiffness": 75.0}, {"stiffness": np.nan}, {"speed": 0.5}, {"tool_direction": (0, 0, 1)}]
)
def test_refused(ur10e, options):
    far = fm.published_map("kuka-iiwa7-30nm") if "tool_direction" in options else fm.published_map("ur10e")
    robot = fm.robot_named("kuka-iiwa7") if "tool_direction" in options else ur10e
    if "tool_direction" in options:
        robot = robot.with_tool(mass=0.0, centre_of_mass=(0, 0, 0), contact_offset=(0, 0, 2.0))
    with pytest.raises(fm.InputError):
        fm.compare_effective_mass(far, robot, **options)


class TestCommands:
    def test_compare(self, ask, capsys):
        code, found = ask("compare", "ur10e", "--effective-mass", "ur10e", "--drive-inertia-kgm2", "identified")
        assert (code, len(found["places"])) == (0, 25)
        assert [each["name"] for each in found["by_mass"]] == ["links alone", "with drive inertia"]
        assert found["places"][0]["by_mass"][1]["outcome"] == "regular"
        assert run(["compare", "kuka-iiwa7-30nm", "--effective-mass", "kuka-iiwa7"]) == 0
        out = capsys.readouterr().out
        assert "does not predict the force" in out
        assert "worse than a constant" in out
        assert "-" not in " ".join(re.findall(r"^links alone .*", out, re.M))
        errors = found["by_mass"][1]["accuracy"]
        ratio = np.array([place["by_mass"][1]["ratio"] for place in found["places"]])
        force = np.array([place["force_N"] for place in found["places"]])
        assert errors["max_underestimation_percent"] == pytest.approx(100 * (1 - 1 / ratio.max()))
        assert errors["mean_underestimation_percent"] == pytest.approx(100 * (1 - 1 / ratio).mean())
        assert errors["rmse_N"] == pytest.approx(np.sqrt(np.mean((force - force / ratio) ** 2)))
        worst = found["places"][int(ratio.argmax())]
        assert errors["worst_state"] == f"d = {worst['distance_m']:.4g} m, h = {worst['height_m']:.4g} m"
        assert "    ." in out

    @pytest.mark.parametrize(
        "options",
        [("--posture-deg", "14,-120,-100,-50,90,0"), ("--tool-axis", "x"), ("--drive-inertia-kgm2", "identified")],
    )
    def test_stance_and_load_of_no_robot_are_refused(self, ask, options):
        code, refused = ask("compare", "ur10e", *options)
        assert code == 2
        assert "go with --effective-mass" in refused["error"]["message"]

    def test_effective_mass_at_a_place(self, ask):
        at = ("--distance", 0.8, "--height", 0.4)
        code, found = ask("effective-mass", "ur10e", *at, "--drive-inertia-kgm2", "identified")
        assert (code, found["outcome"]) == (0, "regular")
        assert 4 < found["effective_mass_kg"] < 6
        assert found["standard_effective_mass_kg"] == pytest.approx(14.552)
        code, lighter = ask("effective-mass", "ur10e", *at)
        assert lighter["effective_mass_kg"] < 3.2
        assert "not included" in lighter["assumption"]
        code, heavier = ask("effective-mass", "ur10e", *at, "--payload-kg", 2)
        assert heavier["effective_mass_kg"] > lighter["effective_mass_kg"] + 1
        code, found = ask("effective-mass", "ur10e", "--distance", 2.0, "--height", 0.4)
        assert (code, found["outcome"], found["effective_mass_kg"]) == (1, "unreachable", None)

    def test_the_posture_is_shown_and_gives_the_same_mass(self, ask, capsys):
        at = ("--distance", 0.8, "--height", 0.4)
        _, found = ask("effective-mass", "ur10e", *at)
        stated = ",".join(map(repr, found["posture"].values()))
        _, again = ask("effective-mass", "ur10e", "--posture-deg", stated)
        assert again["effective_mass_kg"] == pytest.approx(found["effective_mass_kg"], rel=1e-9)
        assert (again["distance_m"], again["height_m"]) == pytest.approx((0.8, 0.4), abs=1e-6)
        assert again["tool_direction"] == pytest.approx([0, 0, -1], abs=1e-6)
        # elbow down is another posture at the same place, and another mass
        _, other = ask("effective-mass", "ur10e", *at, "--posture-deg", "170,-10,-100,-160,-90,0", "--direction", "out")
        _, upper = ask("effective-mass", "ur10e", *at, "--direction", "out")
        assert other["posture"]["forearm_deg"] < 0 < upper["posture"]["forearm_deg"]
        assert abs(other["effective_mass_kg"] - upper["effective_mass_kg"]) > 0.05
        assert run(["effective-mass", "ur10e", *map(str, at)]) == 0
        assert "posture: shoulder 167.427 deg, upper_arm" in capsys.readouterr().out
        _, places = ask("effective-mass", "ur10e", "--distances-m", "0.8,3", "--heights-m", "0.4")
        reached, too_far = (each["posture"] for each in places["places"])
        assert (reached, too_far) == (pytest.approx(found["posture"], abs=1e-9), None)

    def test_out_is_away_from_the_base_wherever_the_arm_stands(self, ask):
        asked = ("effective-mass", "ur10e", "--direction", "out", "--posture-deg")
        masses = [ask(*asked, f"{pan},-60,100,-130,-90,0")[1]["effective_mass_kg"] for pan in (-30, 0, 170)]
        assert masses == pytest.approx([masses[0]] * 3, rel=1e-9)

    def test_the_tools_axis_and_the_contact_point(self, ask):
        """The axis of the tool decides how the arm stands."""
        at = ("--distance", 0.7, "--height", 0.3)
        _, along = ask("effective-mass", "ur10e", *at)
        _, across = ask("effective-mass", "ur10e", *at, "--tool-axis", "-y")
        assert (along["tool_axis"], across["tool_axis"]) == ([0, 0, 1], [0, -1, 0])
        assert across["effective_mass_kg"] < 0.7 * along["effective_mass_kg"]
        _, same = ask("effective-mass", "ur10e", *at, "--tool-axis", "0,0,5", "--contact-offset-m", "0,0,0")
        assert same["effective_mass_kg"] == along["effective_mass_kg"]
        _, longer = ask("effective-mass", "ur10e", *at, "--contact-offset-m", "0.05,0,0.2")
        robot = fm.robot_named("ur10e").with_tool(contact_offset=[0.05, 0, 0.2])
        assert longer["effective_mass_kg"] == fm.robot_effective_mass_at(robot, 0.7, 0.3).value

    def test_a_robot_with_a_hand_of_several_ends(self, ask, tmp_path, capsys):
        """What its file states wrongly beside the chain is said first."""
        links = "".join(
            f'<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="0.1" iyy="0.1" izz="{izz}" ixy="0" '
            'ixz="0" iyz="0"/></inertial></link>'
            for name, mass, izz in (
                ("base", -3, 1),
                ("arm", 3, 0.1),
                ("fore", 2, 0.1),
                ("tool", 1, 0.1),
                ("lamp", 1, -9),
            )
        )
        chain = ("base", "arm", "fore", "tool")
        joints = "".join(
            f'<joint name="{child}_joint" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="0.4 0 0"/><axis xyz="0 1 0"/></joint>'
            for parent, child in itertools.pairwise(chain)
        )
        lamp = '<joint name="lamp_joint" type="fixed"><parent link="fore"/><child link="lamp"/></joint>'
        file = tmp_path / "lit.urdf"
        file.write_text(f'<robot name="lit">{links}{joints}{lamp}</robot>')
        asked = ("effective-mass", str(file), "--posture-deg", "20,-40,30")
        assert ask(*asked)[1]["error"]["message"].endswith("name the one that is the flange as the tip (--tip)")
        code, found = ask(*asked, "--tip", "tool")
        assert (code, found["moving_mass_kg"]) == (0, 7)
        assert "'lamp' hangs beside the chain and counts as a point mass" in found["findings"][0]
        assert run([*asked, "--tip", "tool"]) == 0
        verdict, doubt = capsys.readouterr().out.split("\n  ! ")
        assert verdict.endswith("; first read the doubt below")
        assert doubt.startswith("link 'lamp'")
        code, refused = ask("compare", "ur10e", "--effective-mass", f"{file}:tip=lamp")
        assert (code, "principal value -9" in refused["error"]["message"]) == (2, True)
        _, compared = ask("compare", "ur10e", "--effective-mass", "ur10e", "--posture-deg", "14,-120,-100,-50,90,0")
        assert any("postures nearest to shoulder 14 deg" in line for line in compared["statements"])
        assert compared["places"][0]["posture"]["shoulder_deg"] == pytest.approx(14, abs=40)

    def test_effective_mass_map(self, ask, capsys):
        places = ("--distances-m", "0.56,0.71,0.86", "--heights-m", "0.14,0.46")
        code, found = ask("effective-mass", "kuka-iiwa7", *places)
        assert (code, len(found["places"]), found["trend_with_height"]) == (0, 6, "falls")
        assert run(["effective-mass", "kuka-iiwa7", *places]) == 0
        assert "0.460" in capsys.readouterr().out

    @pytest.mark.parametrize(
        "options",
        [
            ("ur5", "--distance", 1, "--height", 1),
            ("ur10e", "--distance", 1),
            ("ur10e", "--distance", 1, "--height", 1, "--heights-m", "0.1,0.2"),
            ("ur10e", "--distance", 1, "--height", 1, "--tip", "flange"),
            ("ur10e", "--distance", 1, "--height", 1, "--drive-inertia-kgm2", "1,2"),
            ("kuka-iiwa7", "--distance", 1, "--height", 1, "--drive-inertia-kgm2", "identified"),
            ("ur10e", "--distance", 1, "--height", 1, "--tool-direction", "sideways"),
            ("ur10e", "--distance", 1, "--height", 1, "--tool-axis", "sideways"),
            ("ur10e", "--distance", 1, "--height", 1, "--contact-offset-m", "1,2"),
            ("ur10e", "--posture-deg", "1,2"),
            ("ur10e", "--posture-deg", "0,0,200,0,0,0"),
            ("ur10e", "--posture-deg", "0,-60,100,-130,-90,0", "--tool-direction", "out"),
            ("ur10e", "--posture-deg", "0,-60,100,-130,-90,0", "--distance", 1),
        ],
    )
    def test_refused(self, ask, options):
        code, found = ask("effective-mass", *options)
        assert code == 2
        assert found["error"]["message"]
