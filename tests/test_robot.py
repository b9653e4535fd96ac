"""Robots from facts and from URDFs: pinocchio on the same description, inverse kinematics, broken files."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import xml.etree.ElementTree as ElementTree
from importlib import resources

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, strategies as st
from scipy.optimize import least_squares

from forcemap.dynamics.effective_mass import effective_mass
from forcemap.dynamics.inverse_kinematics import inverse_kinematics, places_in_plane
from forcemap.dynamics.kinematics import forward_kinematics, jacobian, mass_matrix
from forcemap.dynamics.mass_map import (
    Trend,
    robot_effective_mass,
    robot_effective_mass_at,
    robot_mass_in_posture,
    robot_mass_map,
)
from forcemap.dynamics.robot import JointKind
from forcemap.dynamics.robots import ROBOTS, identified_drive_inertia, robot_named
from forcemap.dynamics.urdf import read_urdf
from forcemap.errors import ForcemapError, InputError, UnknownName
from forcemap.words import sentence

# The paper's two grids (section IV-D).
GRIDS = {
    "ur10e": ([0.52, 0.61, 0.70, 0.79, 0.89], [0.14, 0.22, 0.30, 0.38, 0.46]),
    "kuka-iiwa7": ([0.56, 0.635, 0.71, 0.785, 0.86], [0.14, 0.22, 0.30, 0.38, 0.46]),
}

# All four kinds of joint, links fixed to each other, a gripper beside the chain; nothing stands square.
GANTRY = """<?xml version="1.0"?>
<robot name="gantry-arm">
  <link name="world"/>
  <link name="rail"><inertial><mass value="50"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    </link>
  <link name="carriage"><inertial><origin xyz="0.1 -0.02 0.05" rpy="0.1 0.2 0.3"/><mass value="9"/>
    <inertia ixx="0.2" iyy="0.3" izz="0.25" ixy="0.01" ixz="-0.02" iyz="0.03"/></inertial></link>
  <link name="camera"><inertial><mass value="0.4"/>
    <inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="turret"><inertial><origin xyz="0 0 0.1"/><mass value="5"/>
    <inertia ixx="0.05" iyy="0.06" izz="0.04" ixy="0" ixz="0.001" iyz="0"/></inertial></link>
  <link name="boom"><inertial><origin xyz="0.2 0.01 0" rpy="0 0.4 0"/><mass value="3"/>
    <inertia ixx="0.01" iyy="0.09" izz="0.09" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="quill"><inertial><mass value="1.5"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.005" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="gripper"><inertial><origin xyz="0 0 0.05"/><mass value="0.9"/>
    <inertia ixx="2e-3" iyy="2e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="finger_left"><inertial><origin xyz="0 0.01 0.04"/><mass value="0.1"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="5e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="finger_right"><inertial><origin xyz="0 0.01 0.04"/><mass value="0.12"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="5e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="pad"/>
  <joint name="mount" type="fixed"><parent link="world"/><child link="rail"/>
    <origin xyz="0.3 -0.2 0.8" rpy="0.1 -0.2 0.7"/></joint>
  <joint name="slide" type="prismatic"><parent link="rail"/><child link="carriage"/>
    <origin xyz="0 0.1 0.2" rpy="0 0.3 0"/>
    <axis xyz="2 0 1"/><limit lower="-0.8" upper="1.2" effort="1" velocity="1"/></joint>
  <joint name="camera_mount" type="fixed"><parent link="carriage"/><child link="camera"/>
    <origin xyz="0.3 0.1 0.2" rpy="1 2 3"/></joint>
  <joint name="turn" type="continuous"><parent link="carriage"/><child link="turret"/>
    <origin xyz="0.1 0 0.15" rpy="0.2 0 0.1"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="lift" type="revolute"><parent link="turret"/><child link="boom"/><origin xyz="0 0.05 0.2"/>
    <axis xyz="0.1 1 0"/><limit lower="-2" upper="1.5" effort="1" velocity="1"/></joint>
  <joint name="stroke" type="prismatic"><parent link="boom"/><child link="quill"/><origin xyz="0.5 0 0" rpy="0 1.2 0"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="0.4" effort="1" velocity="1"/></joint>
  <joint name="roll" type="revolute"><parent link="quill"/><child link="gripper"/><origin xyz="0 0 0.1" rpy="0.3 0 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="left" type="prismatic"><parent link="gripper"/><child link="finger_left"/><origin xyz="0 0.02 0.1"/>
    <axis xyz="0 1 0"/><limit lower="0.01" upper="0.05" effort="1" velocity="1"/></joint>
  <joint name="right" type="revolute"><parent link="gripper"/><child link="finger_right"/>
    <origin xyz="0 -0.02 0.1" rpy="0 0 3.1"/>
    <axis xyz="1 1 0"/><limit lower="-0.6" upper="-0.2" effort="1" velocity="1"/><mimic joint="left"/></joint>
  <joint name="pad_mount" type="fixed"><parent link="gripper"/><child link="pad"/>
    <origin xyz="0.01 0.02 0.15" rpy="0.2 0.1 0"/></joint>
</robot>
"""


def facts(name):
    return json.loads(resources.files("forcemap.dynamics.robots").joinpath(f"{name}.json").read_text())


def urdf_of(name):
    """The packaged figures of a robot as a URDF."""

    def numbers(values):
        return " ".join(map(repr, values))

    robot = facts(name)
    lines = [f'<robot name="{name}">', '<link name="base"/>']
    parent = "base"
    for joint in robot["joints"]:
        inertia = " ".join(f'{key}="{value!r}"' for key, value in joint["inertia_about_com_kg_m2"].items())
        lower, upper = np.radians(joint["limit_deg"]).tolist()
        lines += [
            f'<link name="{joint["link"]}"><inertial>'
            f'<origin xyz="{numbers(joint["com_m"])}" rpy="{numbers(joint["inertial_rpy_rad"])}"/>'
            f'<mass value="{joint["mass_kg"]!r}"/><inertia {inertia}/></inertial></link>',
            f'<joint name="{joint["link"]}" type="revolute"><parent link="{parent}"/><child link="{joint["link"]}"/>'
            f'<origin xyz="{numbers(joint["origin_xyz_m"])}" rpy="{numbers(joint["origin_rpy_rad"])}"/>'
            f'<axis xyz="{numbers(joint["axis"])}"/>'
            f'<limit lower="{lower!r}" upper="{upper!r}" effort="1" velocity="1"/></joint>',
        ]
        parent = joint["link"]
    lines += [
        f'<link name="tip"/><joint name="end" type="fixed"><parent link="{parent}"/><child link="tip"/>'
        f'<origin xyz="{numbers(robot["flange_xyz_m"])}"/></joint></robot>'
    ]
    return "\n".join(lines)


def oracle(model, tip, q):
    """Places, tool axes, Jacobians and mass matrices by pinocchio; q counts from its neutral posture."""
    data, frame = model.createData(), model.getFrameId(tip)
    places, axes, jacobians, matrices = [], [], [], []
    for row in q:
        at = pin.integrate(model, pin.neutral(model), row)
        pin.framesForwardKinematics(model, data, at)
        places.append(data.oMf[frame].translation.copy())
        axes.append(data.oMf[frame].rotation.copy())
        jacobians.append(pin.computeFrameJacobian(model, data, at, frame, pin.LOCAL_WORLD_ALIGNED)[:3].copy())
        upper = pin.crba(model, data, at)
        matrices.append(np.triu(upper) + np.triu(upper, 1).T)
    return np.array(places), np.array(axes), np.array(jacobians), np.array(matrices)


def agrees(robot, model, tip, q):
    """Everything agrees to 1e-9 relative: mass matrices entry by entry, relative to what the two joints carry."""
    places, axes, jacobians, matrices = oracle(model, tip, q)
    pose = forward_kinematics(robot, q)
    np.testing.assert_allclose(pose.position, places, rtol=0, atol=1e-9)
    np.testing.assert_allclose(pose.rotation, axes, rtol=0, atol=1e-9)
    size = np.linalg.norm(jacobians, axis=(1, 2))[:, None, None]
    assert np.all(np.abs(jacobian(robot, q) - jacobians) <= 1e-9 * size)
    own = np.sqrt(np.einsum("bii->bi", matrices))
    assert np.all(np.abs(mass_matrix(robot, q) - matrices) <= 1e-9 * own[:, :, None] * own[:, None, :])
    for direction in ([0, 0, -1], [0.3, -0.5, 0.2]):
        u = np.array(direction) / np.linalg.norm(direction)
        lever = np.einsum("bkn,k->bn", jacobians, u)
        expected = 1 / np.einsum("bn,bn->b", lever, np.linalg.solve(matrices, lever[..., None])[..., 0])
        found = robot_effective_mass(robot, q, direction)
        assert (found.outcome == "regular").mean() > 0.999
        regular = found.outcome == "regular"
        np.testing.assert_allclose(found.value[regular], expected[regular], rtol=1e-9)
        separate = effective_mass(jacobian(robot, q), mass_matrix(robot, q), direction)
        np.testing.assert_allclose(found.value, separate.value, rtol=1e-9)


@pytest.fixture
def gantry(tmp_path):
    (tmp_path / "gantry.urdf").write_text(GANTRY)
    return read_urdf(tmp_path / "gantry.urdf", tip="pad")


def random_positions(robot, count, seed=0):
    lower, upper = np.maximum(robot.lower, -7), np.minimum(robot.upper, 7)
    return np.random.default_rng(seed).uniform(lower, upper, (count, len(robot.joints)))


@pytest.mark.parametrize("name", ROBOTS)
def test_the_papers_robots_agree_with_pinocchio(name, tmp_path):
    robot = robot_named(name)
    q = random_positions(robot, 10_000)
    agrees(robot, pin.buildModelFromXML(urdf_of(name)), "tip", q)
    (tmp_path / "same.urdf").write_text(urdf_of(name))
    read = read_urdf(tmp_path / "same.urdf")
    np.testing.assert_allclose(mass_matrix(read, q[:50]), mass_matrix(robot, q[:50]), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(read.upper, robot.upper)


def gantry_model():
    model = pin.buildModelFromXML(GANTRY, mimic=False)
    held = pin.neutral(model)
    for name, value in (("left", 0.01), ("right", -0.2)):  # where they are nearest to zero
        held[model.joints[model.getJointId(name)].idx_q] = value
    return pin.buildReducedModel(model, [model.getJointId("left"), model.getJointId("right")], held)


def test_a_robot_of_the_users_agrees_with_pinocchio(gantry):
    kinds = [joint.kind for joint in gantry.joints]
    assert kinds == ["prismatic", "continuous", "revolute", "prismatic", "revolute"]
    assert set(kinds) == set(JointKind)
    assert gantry.held_joints == ("left", "right")
    assert gantry.moving_mass == pytest.approx(9 + 0.4 + 5 + 3 + 1.5 + 0.9 + 0.1 + 0.12)
    agrees(gantry, gantry_model(), "pad", random_positions(gantry, 10_000))


def test_a_base_of_the_users(tmp_path):
    (tmp_path / "gantry.urdf").write_text(GANTRY)
    robot = read_urdf(tmp_path / "gantry.urdf", base="carriage", tip="pad")
    whole = read_urdf(tmp_path / "gantry.urdf", tip="pad")
    q = random_positions(whole, 20)
    assert [joint.name for joint in robot.joints] == [joint.name for joint in whole.joints[1:]]
    np.testing.assert_allclose(mass_matrix(robot, q[:, 1:]), mass_matrix(whole, q)[:, 1:, 1:], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_tools_and_payloads_agree_with_pinocchio(name):
    inertia = np.array([[0.02, 0.001, 0], [0.001, 0.03, -0.002], [0, -0.002, 0.01]])
    robot = robot_named(name).with_tool(
        mass=1.8, centre_of_mass=[0.01, -0.02, 0.06], contact_offset=[0.05, 0.01, 0.12], inertia=inertia
    )
    robot = robot.with_payload(mass=2.5, centre_of_mass=[0, 0.03, 0.15])
    model = pin.buildModelFromXML(urdf_of(name))
    end = model.frames[model.getFrameId("tip")]
    for mass, centre, about in ((1.8, [0.01, -0.02, 0.06], inertia), (2.5, [0, 0.03, 0.15], np.zeros((3, 3)))):
        model.appendBodyToJoint(end.parentJoint, pin.Inertia(mass, np.array(centre), about), end.placement)
    offset = pin.SE3(np.eye(3), np.array([0.05, 0.01, 0.12]))
    model.addFrame(pin.Frame("contact", end.parentJoint, end.placement * offset, pin.FrameType.OP_FRAME))
    agrees(robot, model, "contact", random_positions(robot, 100))
    bare = robot_named(name)
    assert robot.moving_mass == pytest.approx(bare.moving_mass)
    assert robot.load == pytest.approx(4.3)
    assert robot.standard_effective_mass == pytest.approx(bare.moving_mass / 2 + 4.3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": -1.0}, "mass: found -1 kg"),
        ({"mass": math.inf}, "mass: found inf kg"),
        ({"centre_of_mass": [0, 0]}, "centre of mass"),
        ({"contact_offset": [0, 0, math.nan]}, "contact offset"),
        ({"axis": [0, 0, 0]}, "length zero"),
        ({"axis": np.eye(3)}, "expected three numbers"),
        ({"inertia": np.diag([1.0, 1.0, -1.0])}, "principal value -1"),
        ({"mass": 0.0, "inertia": np.eye(3)}, "without a mass"),
    ],
)
def test_tools_that_cannot_be_are_refused(change, message):
    tool = {"mass": 1.0, "centre_of_mass": [0, 0, 0.1], "contact_offset": [0, 0, 0.2]} | change
    with pytest.raises(InputError, match=message):
        robot_named("ur10e").with_tool(**tool)


def test_moving_masses_and_names():
    assert robot_named("ur10e").moving_mass == pytest.approx(29.104, abs=5e-4)
    assert robot_named("kuka-iiwa7").moving_mass == pytest.approx(19.044, abs=5e-4)
    assert [facts(name)["moving_mass_kg"] for name in ROBOTS] == pytest.approx([29.104, 19.044341])
    assert [len(robot_named(name).joints) for name in ROBOTS] == [6, 7]
    assert all("github" in robot_named(name).source for name in ROBOTS)
    with pytest.raises(UnknownName, match="nearest are ur10e"):
        robot_named("ur10")
    with pytest.raises(UnknownName, match="published drive inertia"):
        identified_drive_inertia("kuka-iiwa7")


def test_drive_inertia_brings_the_papers_trend_to_the_ur10e():
    """About 3 kg everywhere for the links alone; more, falling with d and h, with the published drive inertia."""
    robot, grid = robot_named("ur10e"), GRIDS["ur10e"]
    bare = robot_mass_map(robot, *grid)
    assert bare.mass.value == pytest.approx(np.full((5, 5), 3.15), abs=0.02)
    assert "not included" in bare.mass.assumption
    geared = robot_mass_map(robot.with_drive_inertia(identified_drive_inertia("ur10e")), *grid)
    assert geared.trend_with_height is Trend.FALLS
    assert geared.mass.value.min() > 4.5
    assert geared.mass.value.max() < 7
    assert "Mamedov" in geared.mass.assumption
    with pytest.raises(InputError, match="5 figures for 6 joints"):
        robot.with_drive_inertia([1.0] * 5)


def within_limits(robot, q):
    return bool(np.all((q >= robot.lower) & (q <= robot.upper)))


@pytest.mark.parametrize(
    ("name", "tool"), [("ur10e", (0, 0, -1)), ("kuka-iiwa7", (0, 0, -1)), ("kuka-iiwa7", (1, 0, 0))]
)
def test_inverse_kinematics_on_the_papers_grids(name, tool):
    """Every place is reached inside the limits, or too far for the flange pointing down; pinocchio agrees."""
    robot, model = robot_named(name), pin.buildModelFromXML(urdf_of(name))
    places = places_in_plane(*np.meshgrid(*GRIDS[name], indexing="ij")).reshape(-1, 3)
    reach = inverse_kinematics(robot, places, tool_direction=tool)
    reached = reach.outcome == "reached"
    found, axes, _, _ = oracle(model, "tip", reach.positions[reached])
    assert np.abs(found - places[reached]).max() < 1e-6
    assert np.abs(axes[:, :, 2] - tool).max() < 1e-6
    assert within_limits(robot, reach.positions[reached])
    assert np.isnan(reach.positions[~reached]).all()
    assert reach.place_error[reached].max() < 1e-6
    if name == "ur10e" or tool == (1, 0, 0):
        assert reached.all()
        return
    # pointing down, the iiwa's wrist is 0.126 m above the place and at most 0.8 m from its shoulder at 0.34 m
    away = np.hypot(places[:, 0], places[:, 2] + 0.091 + 0.035 - 0.34)
    assert reached.tolist() == (away <= 0.8).tolist()
    assert (~reached).sum() == 7
    data, frame = model.createData(), model.getFrameId("tip")

    def miss(q, place):
        pin.framesForwardKinematics(model, data, q)
        return np.concatenate([data.oMf[frame].translation - place, data.oMf[frame].rotation[:, 2] - tool])

    starts = random_positions(robot, 3)
    for place in places[~reached]:
        bounds = (robot.lower, robot.upper)
        best = min(least_squares(miss, start, bounds=bounds, args=(place,), max_nfev=60).cost for start in starts)
        assert best > 1e-6


@given(st.integers(0, 2**32 - 1), st.sampled_from(ROBOTS))
def test_inverse_kinematics_comes_back_to_where_a_posture_is(seed, name):
    """The contact point of a tool, in any direction, from a posture well inside the limits."""
    robot = robot_named(name).with_tool(mass=0, centre_of_mass=[0, 0, 0], contact_offset=[0.04, 0, 0.1])
    rng = np.random.default_rng(seed)
    q = robot.reference_posture + rng.uniform(-0.5, 0.5, len(robot.joints))
    pose = forward_kinematics(robot, q)
    reach = inverse_kinematics(robot, pose.position, tool_direction=pose.rotation[:, 2])
    assert reach.outcome == "reached"
    back = forward_kinematics(robot, reach.positions)
    np.testing.assert_allclose(back.position, pose.position, atol=1e-6)
    np.testing.assert_allclose(back.rotation[:, 2], pose.rotation[:, 2], atol=1e-6)
    assert within_limits(robot, reach.positions)


def test_inverse_kinematics_with_sliding_joints(gantry):
    pose = forward_kinematics(gantry, random_positions(gantry, 20, 3) * 0.5)
    reach = [
        inverse_kinematics(gantry, place, tool_direction=axes[:, 2])
        for place, axes in zip(pose.position, pose.rotation, strict=True)
    ]
    assert sum(each.outcome == "reached" for each in reach) >= 18
    assert all(within_limits(gantry, each.positions) for each in reach if each.outcome == "reached")


def test_places_out_of_reach_are_named():
    robot = robot_named("ur10e")
    found = robot_effective_mass_at(robot, [0.7, 5.0], 0.3)
    assert found.outcome.tolist() == ["regular", "unreachable"]
    assert np.isnan(found.value).tolist() == [False, True]
    alone = robot_effective_mass_at(robot, 5.0, 0.3)
    assert alone.outcome == "unreachable"
    assert math.isnan(alone.value)
    reach = inverse_kinematics(robot, [5.0, 0.0, 0.3])
    assert reach.place_error > 3
    # the same answer every time, and for one place as for many
    again = robot_effective_mass_at(robot, [0.7, 0.8], 0.3).value
    assert again[0] == pytest.approx(found.value[0], rel=1e-9)


def test_stretched_out_a_robot_has_no_effective_mass_along_itself(tmp_path):
    """Straight up, nothing moves the flange of the iiwa along its own axis."""
    found = robot_effective_mass(robot_named("kuka-iiwa7"), np.zeros(7))
    assert found.outcome in ("no_motion", "singular")
    assert robot_effective_mass(robot_named("kuka-iiwa7"), np.zeros(7), [1, 0, 0]).outcome == "regular"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda robot: forward_kinematics(robot, np.zeros(5)), "expected 6 of ur10e"),
        (lambda robot: jacobian(robot, 0.0), "expected 6 of ur10e"),
        (lambda robot: mass_matrix(robot, np.full(6, np.nan)), "not finite"),
        (lambda robot: robot_effective_mass(robot, np.zeros(6), [0, 0]), "expected 3 components"),
        (lambda robot: robot_effective_mass(robot, np.zeros(6), np.eye(3)), "one direction"),
        (lambda robot: inverse_kinematics(robot, [0.5, 0.1]), "expected"),
        (lambda robot: inverse_kinematics(robot, [0.5, 0.1, np.inf]), "not finite"),
        (lambda robot: inverse_kinematics(robot, [0.5, 0, 0.1], tool_direction=[0, 0, 0]), "length zero"),
        (lambda robot: inverse_kinematics(robot, [0.5, 0, 0.1], reference=[0.0]), "expected 6 of ur10e"),
        (lambda robot: robot_mass_map(robot, [0.6, 0.5], [0.2]), "ascending"),
    ],
)
def test_what_cannot_be_used_is_refused(call, message):
    with pytest.raises(InputError, match=message):
        call(robot_named("ur10e"))


GOOD = """<robot name="good">
<link name="a"/>
<link name="b"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/>
<limit lower="-1" upper="1"/>
</joint>
</robot>"""


def changed(*pairs):
    text = GOOD
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return text


SECOND = '<joint name="k" type="fixed"><parent link="{}"/><child link="{}"/></joint></robot>'
BROKEN = [
    ("", None, "not well-formed XML"),
    ("robot: ur10e", 1, "not well-formed XML"),
    (GOOD[:-20], 8, "not well-formed XML"),
    ("<sdf/>", 1, "found <sdf>, expected <robot>"),
    (changed(("<link", "<xacro:include/><link"), ("<robot", '<robot xmlns:xacro="x"')), 1, "run xacro on it first"),
    ('<robot name="empty"/>', None, "found 0 links"),
    (changed(('name="b"', "")), 3, "<link> has no name"),
    (changed(('<link name="a"/>', '<link name="a"/><link name="a"/>')), 2, "a second link is named 'a'"),
    (changed(("</robot>", '<joint name="j" type="fixed"/></robot>')), 10, "a second joint is named 'j'"),
    (changed(('type="revolute"', "")), 5, "<joint> has no type"),
    (changed(("revolute", "floating")), 5, "found the type 'floating', expected one of fixed, revolute"),
    (changed(('<parent link="a"/>', "")), 5, "joint 'j' has no <parent>"),
    (changed(('child link="b"', 'child link="c"')), 6, "no link named 'c', its child"),
    (changed(('child link="b"', "child")), 6, "<child> has no link"),
    (changed(('child link="b"', 'child link="b')), 7, "not well-formed XML"),
    (changed(("<limit", "<limits")), 5, "joint 'j' has no <limit>"),
    (changed(('lower="-1"', 'lower="2"')), 8, "found limits from 2 to 1"),
    (changed(('lower="-1" upper="1"', "")), 8, "found limits from 0 to 0"),
    (changed(('axis xyz="0 0 1"', 'axis xyz="0 0 0"')), 5, "axis of length 0"),
    (changed(('axis xyz="0 0 1"', 'axis xyz="0 1"')), 7, "found '0 1', expected three finite numbers"),
    (changed(('xyz="0 0 0.1"', 'xyz="0 0 ${l}"')), 3, r"found '0 0 \$\{l\}', expected three finite numbers"),
    (changed(('xyz="0 0 0.1"', 'xyz="0 0 1e99"')), 3, "expected three finite numbers"),
    (changed(('value="1"', 'value="heavy"')), 3, "found 'heavy', expected a finite number"),
    (changed(('value="1"', 'value="nan"')), 3, "found 'nan', expected a finite number"),
    (changed(('value="1"', 'value="-1"')), 3, "link 'b': mass: found -1 kg"),
    (changed(('value="1"', 'value="0"')), None, "no link that moves has a mass"),
    (changed(('type="revolute"', 'type="floating"')), 5, "if it moves the whole robot, name the link after it as the"),
    (changed(('izz="1"', "")), 4, "<inertia> has no izz"),
    (changed(('izz="1"', 'izz="-1"')), 3, "link 'b': inertia: found the principal value -1"),
    (changed(('ixy="0"', 'ixy="5"')), 3, "principal value -4"),
    (changed(('<mass value="1"/>', "")), 3, "inertial has no <mass>"),
    (changed(('<mass value="1"/>', '<mass value="0"/>'), *[(f'{i}="1"', f'{i}="0"') for i in ("ixx", "iyy", "izz")]),
     None, "no link that moves has a mass"),
    (changed(("revolute", "fixed")), None, "no joint moves between 'a' and 'b'"),
    (changed(("<axis", '<mimic joint="x"/><axis')), 5, "joint 'j' mimics another"),
    (changed(("</robot>", SECOND.format("b", "b"))), 10, "both carry the link 'b'"),
    (changed(("</robot>", SECOND.format("b", "a"))), None, "the links 'a', 'b' form a loop"),
    (changed(("</robot>", '<link name="c"/></robot>')), None, "the links 'a', 'c' hang on nothing"),
    (changed(("</robot>", '<link name="c"/>' + SECOND.format("a", "c"))), None, "ends in the links 'b', 'c'; name"),
    (GOOD.replace("<robot", '<?xml version="1.0" encoding="klingon"?><robot'), None, "encoding that is not known"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "row", "message"), BROKEN, ids=range(len(BROKEN)))
def test_broken_urdfs_give_one_clear_line(tmp_path, text, row, message):
    path = tmp_path / "broken.urdf"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_urdf(path)
    assert caught.value.file == "broken.urdf"
    if row:
        assert caught.value.row == row
    assert "\n" not in str(caught.value)


def with_line(text, line):
    """A robot with one more line before its end."""
    return text.replace("</robot>", line + "</robot>")


def hung(parent, name, inertial, joint='type="fixed"', inside=""):
    """A link that hangs on another one."""
    inertia = f"<inertial>{inertial}</inertial>" if inertial else ""
    return (
        f'<link name="{name}">{inertia}</link><joint name="{name}_joint" {joint}><parent link="{parent}"/>'
        f'<child link="{name}"/>{inside}</joint>'
    )


def inertial(mass, figure, *, off=0.0):
    return f'<mass value="{mass}"/><inertia ixx="{figure}" iyy="1" izz="1" ixy="{off}" ixz="0" iyz="0"/>'


ANTENNA = '<mass value="1e-6"/><inertia ixx="2e-8" iyy="3e-8" izz="4e-8" ixy="6e-8" ixz="1e-8" iyz="1e-8"/>'
BESIDE_THE_BASE = [  # nothing of these moves
    hung("world", "antenna", ANTENNA),
    hung("world", "mast", inertial(-5, 1)),
    hung("world", "wheel", inertial("heavy", 1), 'type="revolute"'),
    hung("rail", "cart", inertial(0, 1), 'type="floating"', '<origin xyz="nowhere"/>'),
    hung("rail", "leg", "<nothing/>", 'type="prismatic"', '<limit lower="2" upper="1"/>'),
    hung("world", "sun", inertial(2e9, 1e30)),
]


@pytest.mark.parametrize("line", BESIDE_THE_BASE, ids=range(len(BESIDE_THE_BASE)))
def test_what_does_not_move_refuses_nothing(tmp_path, gantry, line):
    (tmp_path / "with.urdf").write_text(with_line(GANTRY, line))
    robot = read_urdf(tmp_path / "with.urdf", tip="pad")
    q = random_positions(robot, 5)
    np.testing.assert_array_equal(mass_matrix(robot, q), mass_matrix(gantry, q))
    assert robot.findings == ()


POINT = '<mass value="0.5"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/>'
AT = '<origin xyz="0.1 0 0.02" rpy="0 0.4 0"/>'
CARRIED = [  # what hangs on the turret and cannot be used as it stands, and as what it counts
    (hung("turret", "lamp", inertial(0.5, 1, off=7)), hung("turret", "lamp", POINT), "link_as_point_mass", "-6"),
    (hung("turret", "lamp", '<mass value="0.5"/>'), hung("turret", "lamp", POINT), "link_as_point_mass", "inertia"),
    (hung("turret", "lamp", inertial(-1, 1)), "", "link_left_out", "found -1 kg"),
    (hung("turret", "lamp", '<origin xyz="120 0 3"/>' + inertial(0.5, 1)), "", "link_left_out", "is it in mm"),
    (hung("turret", "lamp", POINT, inside='<origin xyz="0 0 58"/>') + hung("lamp", "bulb", POINT), "", "joint_left_out",
     "is it in mm or cm"),
    (hung("turret", "lamp", POINT, 'type="revolute"', AT), hung("turret", "lamp", POINT, inside=AT), "joint_at_zero",
     "limit"),
    (hung("turret", "lamp", POINT, 'type="planar"', AT), hung("turret", "lamp", POINT, inside=AT), "joint_at_zero",
     "planar"),
    (hung("turret", "lamp", POINT, inside='<origin xyz="1 2"/>') + hung("lamp", "bulb", POINT), "", "joint_left_out",
     "'1 2'"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "counted", "kind", "why"), CARRIED, ids=range(len(CARRIED)))
def test_what_is_carried_beside_the_chain_counts_as_far_as_it_can(tmp_path, line, counted, kind, why):
    (tmp_path / "with.urdf").write_text(with_line(GANTRY, line))
    (tmp_path / "counted.urdf").write_text(with_line(GANTRY, counted))
    robot, same = (read_urdf(tmp_path / f"{name}.urdf", tip="pad") for name in ("with", "counted"))
    q = random_positions(robot, 5)
    np.testing.assert_allclose(mass_matrix(robot, q), mass_matrix(same, q), rtol=1e-12, atol=1e-12)
    (found,) = robot.findings
    assert found.kind == kind
    assert found.figure("name") in ("lamp", "lamp_joint")
    assert why in sentence(found)
    assert same.findings == ()
    with pytest.raises(InputError):  # in the chain itself the same is refused
        read_urdf(tmp_path / "with.urdf", tip="bulb" if "bulb" in line else "lamp")


def test_an_inertia_without_a_mass_counts_as_it_stands_and_is_said(tmp_path):
    """Simulators' robots have such flanges: pinocchio counts them too, and so do figures beside the chain."""
    text = urdf_of("kuka-iiwa7")
    for line in (hung("tip", "hand", inertial(0, 0.1)), hung("link_4", "box", inertial(0, 0.3))):
        text = with_line(text, line.replace('iyy="1" izz="1"', 'iyy="0.1" izz="0.1"'))
    assert 'link="link_4"' in text
    (tmp_path / "with.urdf").write_text(text)
    robot = read_urdf(tmp_path / "with.urdf", tip="hand")
    agrees(robot, pin.buildModelFromXML(text), "hand", random_positions(robot, 200))
    assert [(each.kind, each.figure("link")) for each in robot.findings] == [
        ("inertia_without_mass", "box"),
        ("inertia_without_mass", "hand"),
    ]


def test_an_inertia_within_rounding_is_none(tmp_path):
    (tmp_path / "good.urdf").write_text(
        changed(('izz="1"', 'izz="-1e-7"'), ('ixx="1"', 'ixx="0"'), ('iyy="1"', 'iyy="0"'))
    )
    assert read_urdf(tmp_path / "good.urdf").moving_mass == 1


def in_units(text, *, mass=1.0, length=1.0, inertia=1.0, angle=1.0, limit=1.0, com=1.0):
    """A URDF whose figures are in other units."""
    root = ElementTree.fromstring(text)

    def times(element, factor, *keys):
        for key in keys:
            if element is not None and key in element.attrib:
                element.set(key, " ".join(repr(float(part) * factor) for part in element.get(key).split()))

    for each in root.iter("inertial"):
        times(each.find("mass"), mass, "value")
        times(each.find("inertia"), inertia, *(f"i{axes}" for axes in ("xx", "yy", "zz", "xy", "xz", "yz")))
        times(each.find("origin"), com, "xyz")
    for each in root.iter("joint"):
        times(each.find("origin"), length, "xyz")
        turns = each.get("type") in ("revolute", "continuous")
        times(each.find("limit"), limit if turns else length, "lower", "upper")
    for each in root.iter("origin"):
        times(each, angle, "rpy")
    return ElementTree.tostring(root, encoding="unicode")


DEGREES = math.degrees(1)
UNITS = [
    ({"mass": 1e3}, "masses in g"),
    ({"mass": 1e3, "inertia": 1e3}, "masses in g"),
    ({"mass": 1e3, "inertia": 0.0}, "masses in g"),
    ({"mass": 1e3, "inertia": 1e9}, r"mm\^2"),
    ({"mass": 1e-3}, "mass(es)? in t"),
    ({"mass": 1e-3, "inertia": 1e-3}, "masses in t"),
    ({"mass": 1e-3, "inertia": 1e3, "length": 1e3, "com": 1e3}, "in mm"),
    ({"length": 1e3}, "in mm"),
    ({"length": 1e3, "com": 1e3, "inertia": 1e6}, "in mm"),
    ({"com": 1e3}, "in mm"),
    ({"length": 100, "com": 100, "inertia": 1e4}, "in mm or cm|in cm"),
    ({"inertia": 1e6}, r"mm\^2"),
    ({"inertia": 1e4}, r"cm\^2"),
    ({"inertia": 1e9}, r"g mm\^2"),
    ({"limit": DEGREES}, "in degrees"),
    ({"angle": DEGREES}, "in degrees"),
]  # the iiwa's frames are not turned to each other


@pytest.mark.parametrize("which", [*ROBOTS, "gantry"])
@pytest.mark.parametrize(("units", "likely"), UNITS, ids=range(len(UNITS)))
def test_other_units_are_refused_with_the_likely_one(tmp_path, which, units, likely):
    if which == "kuka-iiwa7" and "angle" in units:
        return
    text = GANTRY if which == "gantry" else urdf_of(which)
    path = tmp_path / "other.urdf"
    path.write_text(in_units(text))
    assert read_urdf(path, tip="pad" if which == "gantry" else "tip").findings == ()
    path.write_text(in_units(text, **units))
    with pytest.raises(InputError, match=likely):
        read_urdf(path, tip="pad" if which == "gantry" else "tip")


def test_limits_that_are_none_as_simulators_write_them(tmp_path):
    (tmp_path / "good.urdf").write_text(changed(('lower="-1" upper="1"', 'lower="-1e16" upper="inf"')))
    robot = read_urdf(tmp_path / "good.urdf")
    assert (robot.lower[0], robot.upper[0], robot.reference_posture[0]) == (-math.inf, math.inf, 0)


def test_the_base_of_the_ur10e_is_its_controllers(tmp_path):
    """The maker's URDF has it turned by 180 degrees under `base_link`; the joint angles are the same."""
    robot, text = robot_named("ur10e"), urdf_of("ur10e").replace('"base"', '"base_link_inertia"')
    turned = (
        '<link name="base_link"/><joint name="turned" type="fixed"><parent link="base_link"/>'
        f'<child link="base_link_inertia"/><origin rpy="0 0 {math.pi!r}"/></joint>'
    )
    (tmp_path / "ur.urdf").write_text(with_line(text, turned))
    q = random_positions(robot, 20)
    places = forward_kinematics(robot, q).position
    same = read_urdf(tmp_path / "ur.urdf", base="base_link_inertia")
    np.testing.assert_allclose(forward_kinematics(same, q).position, places, atol=1e-12)
    makers = forward_kinematics(read_urdf(tmp_path / "ur.urdf"), q).position
    np.testing.assert_allclose(makers, places * [-1, -1, 1], atol=1e-12)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 0, -2), (0.3, -0.5, 0.7)])
def test_the_tools_axis_is_turned_where_it_shall_point(axis):
    """And the posture that is shown is the one whose effective mass it is, by pinocchio."""
    robot = robot_named("ur10e").with_tool(contact_offset=[0.02, 0.1, 0.05], axis=axis)
    found = robot_effective_mass_at(robot, [0.6, 0.75, 9.0], 0.3, tool_direction=[0.2, 0, -1])
    assert found.outcome.tolist() == ["regular", "regular", "unreachable"]
    assert np.isnan(found.positions[2]).all()
    model = pin.buildModelFromXML(urdf_of("ur10e"))
    end = model.frames[model.getFrameId("tip")]
    contact = end.placement * pin.SE3(np.eye(3), np.array([0.02, 0.1, 0.05]))
    model.addFrame(pin.Frame("contact", end.parentJoint, contact, pin.FrameType.OP_FRAME))
    places, axes, jacobians, matrices = oracle(model, "contact", found.positions[:2])
    np.testing.assert_allclose(places, [[0.6, 0, 0.3], [0.75, 0, 0.3]], atol=1e-6)
    expected = np.array([0.2, 0, -1]) / np.linalg.norm([0.2, 0, -1])
    np.testing.assert_allclose(axes @ np.array(axis) / np.linalg.norm(axis), [expected] * 2, atol=1e-6)
    down = jacobians[:, 2]
    mass = 1 / np.einsum("bn,bn->b", down, np.linalg.solve(matrices, down[..., None])[..., 0])
    np.testing.assert_allclose(found.value[:2], mass, rtol=1e-9)


def test_a_posture_is_a_map_of_one_place(gantry):
    stated = [0.3, 40.0, -20.0, 0.1, 15.0]  # m where a joint slides
    q = gantry.from_degrees(stated)
    names = ("slide_m", "turn_deg", "lift_deg", "stroke_m", "roll_deg")
    assert gantry.stated(q) == pytest.approx(dict(zip(names, stated, strict=True)))
    assert robot_mass_in_posture(gantry, q).mass.value[0, 0] == robot_effective_mass(gantry, q).value
    x, y, z = forward_kinematics(gantry, q).position
    at = robot_mass_in_posture(gantry, q)
    assert (at.distances[0], at.heights[0]) == (math.hypot(x, y), z)
    with pytest.raises(InputError, match=r"found stroke_m = 0\.5, expected 0 to 0\.4"):
        gantry.with_reference([0, 0, 0, 0.5, 0])
    with pytest.raises(InputError, match="found 2 positions, expected one for each joint of gantry-arm: slide, turn"):
        gantry.with_reference([0, 0])
    with pytest.raises(InputError, match="posture: found turn_deg = nan"):
        gantry.with_reference([0, math.nan, 0, 0, 0])


def test_names_of_links_that_are_none(tmp_path):
    (tmp_path / "good.urdf").write_text(GOOD)
    assert read_urdf(tmp_path / "good.urdf").moving_mass == 1
    for option in ({"tip": "c"}, {"base": "c"}):
        with pytest.raises(UnknownName, match=r"no link of good\.urdf is named 'c'"):
            read_urdf(tmp_path / "good.urdf", **option)
    with pytest.raises(InputError, match="'a' does not hang on 'b'"):
        read_urdf(tmp_path / "good.urdf", base="b", tip="a")
    with pytest.raises(InputError, match="no such file"):
        read_urdf(tmp_path / "none.urdf")


def entities(levels):
    names = [f"e{i}" for i in range(levels)]
    lines = ['<!ENTITY e0 "lol">']
    lines += [f'<!ENTITY {new} "{f"&{old};" * 10}">' for old, new in itertools.pairwise(names)]
    return "<!DOCTYPE robot [" + "".join(lines) + f']><robot name="&{names[-1]};"/>'


@pytest.mark.parametrize(
    "text",
    [
        entities(9),
        '<!DOCTYPE robot [<!ENTITY a "' + "a" * 10_000 + '">]><robot name="' + "&a;" * 1000 + '"/>',
        '<!DOCTYPE robot [<!ENTITY x SYSTEM "secret.txt">]><robot name="r">&x;</robot>',
        '<!DOCTYPE robot SYSTEM "http://127.0.0.1:9/robot.dtd"><robot name="r"/>',
        '<!DOCTYPE robot [<!ENTITY % p SYSTEM "secret.txt"> %p;]><robot name="r"/>',
    ],
)
def test_entity_attacks_are_refused(tmp_path, text):
    (tmp_path / "secret.txt").write_text("secret")
    (tmp_path / "attack.urdf").write_text(text)
    with pytest.raises(InputError, match="found a DTD or entities") as caught:
        read_urdf(tmp_path / "attack.urdf")
    assert "secret" not in str(caught.value)


@given(st.lists(st.tuples(st.integers(0, len(GOOD) - 1), st.integers(0, 255)), min_size=1, max_size=4))
def test_damaged_urdfs_are_read_or_refused(tmp_path_factory, damage):
    content = bytearray(GOOD.encode())
    for place, byte in damage:
        content[place] = byte
    path = tmp_path_factory.mktemp("damaged") / "damaged.urdf"
    path.write_bytes(content)
    with contextlib.suppress(ForcemapError):
        robot = read_urdf(path)
        assert np.isfinite(mass_matrix(robot, robot.reference_posture)).all()


def test_a_robot_with_very_many_links_is_refused(tmp_path):
    links = "".join(f'<link name="l{i}"/>' for i in range(2000))
    (tmp_path / "long.urdf").write_text(f'<robot name="long">{links}</robot>')
    with pytest.raises(InputError, match="found 2000 links"):
        read_urdf(tmp_path / "long.urdf")
