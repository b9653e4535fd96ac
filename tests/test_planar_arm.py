"""The paper's planar arm: sympy and pinocchio, inverse kinematics, the table of the docs."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, strategies as st

from forcemap.dynamics.effective_mass import effective_mass
from forcemap.dynamics.inverse_kinematics import ReachOutcome
from forcemap.dynamics.mass_map import Trend, planar_effective_mass_at, planar_mass_map
from forcemap.dynamics.planar_arm import (
    INSPECTION_DISTANCES,
    INSPECTION_HEIGHTS,
    LINK_ALIGNED,
    LINK_DOWN,
    LINK_HORIZONTAL,
    Elbow,
    LastLink,
    LinkMass,
    PlanarArm,
    Wrist,
    planar_contact_point,
    planar_inverse_kinematics,
    planar_jacobian,
    planar_mass_matrix,
)
from forcemap.errors import InputError

LAST_LINKS = (LINK_DOWN, LINK_HORIZONTAL, LINK_ALIGNED)
VARIANTS = list(itertools.product(LinkMass, Wrist))


def paper_arm(link_mass=LinkMass.UNIFORM_ROD, last_link=LINK_DOWN, wrist=Wrist.FREE, base_height=0.0, **more):
    return PlanarArm(link_mass=link_mass, last_link=last_link, wrist=wrist, base_height=base_height, **more)


def postures(count, seed=0):
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, 3))


def agrees(found, expected):
    scale = np.abs(expected).max(axis=tuple(range(1, expected.ndim)), keepdims=True)
    assert np.all(np.abs(found - expected) <= 1e-9 * scale)


def masses_agree(arm, q, jacobians, matrices):
    """Effective mass for the oracle's Jacobians and mass matrices, downwards."""
    found = effective_mass(planar_jacobian(arm, q), planar_mass_matrix(arm, q), [0, -1])
    lever = jacobians[:, 1]
    expected = 1 / np.einsum("bi,bi->b", lever, np.linalg.solve(matrices, lever[..., None])[..., 0])
    regular = found.outcome == "regular"
    assert regular.mean() > 0.999
    np.testing.assert_allclose(found.value[regular], expected[regular], rtol=1e-9)


@pytest.fixture(scope="module")
def derived():
    """Mass matrix and Jacobian by differentiating kinetic energy and position, for every place of the mass."""
    import sympy as sp

    angles = sp.symbols("q1:4")
    rates = sp.symbols("w1:4")
    lengths, weights = (sp.Rational(1, 2), sp.Rational(9, 20), sp.Rational(1, 20)), (13, 4, 4)

    def velocity(point):
        return sum((sp.diff(point, q) * w for q, w in zip(angles, rates, strict=True)), sp.zeros(2, 1))

    def along(lengths):
        return sum(
            (length * sp.Matrix([sp.cos(sum(angles[: i + 1])), sp.sin(sum(angles[: i + 1]))])
             for i, length in enumerate(lengths)),
            sp.zeros(2, 1),
        )  # fmt: skip

    x = sp.symbols("x")
    found = {}
    for kind in LinkMass:
        energy = 0
        for i, (length, weight) in enumerate(zip(lengths, weights, strict=True)):
            speed = velocity(along([*lengths[:i], x]))
            square = sp.expand((speed.T * speed)[0])
            if kind is LinkMass.UNIFORM_ROD:  # every slice of the rod moves at its own speed
                square = sp.integrate(square, (x, 0, length)) / length
            else:
                square = square.subs(x, length if kind is LinkMass.POINT_AT_END else length / 2)
            energy += sp.Rational(1, 2) * weight * square
        matrix = sp.hessian(energy, rates)
        found[kind] = sp.lambdify(angles, matrix, "numpy", cse=True)
    return found, sp.lambdify(angles, along(lengths).jacobian(angles), "numpy", cse=True)


@pytest.mark.parametrize(("link_mass", "wrist"), VARIANTS)
def test_mass_matrix_and_effective_mass_by_symbolic_derivation(derived, link_mass, wrist):
    q = postures(1000)
    arm = paper_arm(link_mass, wrist=wrist)
    n = 2 if wrist is Wrist.LOCKED else 3
    matrices = np.array([derived[0][link_mass](*row) for row in q], dtype=float)[:, :n, :n]
    jacobians = np.array([derived[1](*row) for row in q], dtype=float)[:, :, :n]
    agrees(planar_mass_matrix(arm, q), matrices)
    agrees(planar_jacobian(arm, q), jacobians)
    masses_agree(arm, q, jacobians, matrices)


def pinocchio_model(arm):
    model = pin.Model()
    parent, origin = 0, np.array([0.0, 0.0, arm.base_height])
    share = 1.0 if arm.link_mass is LinkMass.POINT_AT_END else 0.5
    for i, (length, mass) in enumerate(zip(arm.lengths, arm.masses, strict=True)):
        axis = pin.JointModelRevoluteUnaligned(np.array([0.0, -1.0, 0.0]))
        parent = model.addJoint(parent, axis, pin.SE3(np.eye(3), origin), f"joint{i}")
        model.addJointFrame(parent)
        across = mass * length**2 / 12 if arm.link_mass is LinkMass.UNIFORM_ROD else 0.0
        body = pin.Inertia(mass, np.array([share * length, 0, 0]), np.diag([0.0, across, across]))
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
        origin = np.array([length, 0.0, 0.0])
    model.addFrame(pin.Frame("end", parent, pin.SE3(np.eye(3), origin), pin.FrameType.OP_FRAME))
    return model


@pytest.mark.parametrize(("link_mass", "wrist"), VARIANTS)
def test_mass_matrix_and_effective_mass_by_pinocchio(link_mass, wrist):
    arm = PlanarArm(
        link_mass=link_mass, last_link=LINK_DOWN, wrist=wrist, base_height=0.3,
        lengths=(0.41, 0.52, 0.13), masses=(7.0, 5.0, 2.0),
    )  # fmt: skip
    q = postures(1000, 1)
    model = pinocchio_model(arm)
    models = [(slice(None), model)]
    if wrist is Wrist.LOCKED:  # pinocchio locks a joint in a model of its own: one for each of ten angles
        q[:, 2] = np.repeat(q[:10, 2], 100)
        models = [(slice(100 * i, 100 * i + 100), pin.buildReducedModel(model, [3], q[100 * i])) for i in range(10)]
    points, jacobians, matrices = [], [], []
    for rows, reduced in models:
        data, end = reduced.createData(), reduced.getFrameId("end")
        for row in q[rows, : reduced.nv]:
            pin.framesForwardKinematics(reduced, data, row)
            points.append(data.oMf[end].translation[[0, 2]].copy())
            jacobians.append(pin.computeFrameJacobian(reduced, data, row, end, pin.LOCAL_WORLD_ALIGNED)[[0, 2]])
            matrices.append(pin.crba(reduced, data, row).copy())
    agrees(planar_contact_point(arm, q), np.array(points))
    agrees(planar_jacobian(arm, q), np.array(jacobians))
    agrees(planar_mass_matrix(arm, q), np.array(matrices))
    masses_agree(arm, q, np.array(jacobians), np.array(matrices))


places = st.tuples(st.floats(-1.3, 1.3), st.floats(-1.3, 1.3))
last_links = st.one_of(st.sampled_from(LAST_LINKS), st.floats(-4, 4).map(LastLink))


@given(places, last_links, st.sampled_from(Elbow), st.floats(-0.3, 0.6))
def test_inverse_kinematics_arrives_or_the_place_is_too_far_or_too_near(place, last_link, elbow, base_height):
    arm = paper_arm(last_link=last_link, elbow=elbow, base_height=base_height)
    reach = planar_inverse_kinematics(arm, *place)
    aligned = math.isnan(last_link.angle)
    # where the wrist, or the end of an aligned arm, has to be
    wrist = np.array([place[0], place[1] - base_height])
    if not aligned:
        wrist -= 0.05 * np.array([math.cos(last_link.angle), math.sin(last_link.angle)])
    second = 0.5 if aligned else 0.45
    away = np.linalg.norm(wrist)
    if reach.outcome is ReachOutcome.UNREACHABLE:
        assert np.isnan(reach.positions).all()
        assert away > 0.5 + second - 1e-9 or away < abs(0.5 - second) + 1e-9
        return
    assert away < 0.5 + second + 1e-9
    np.testing.assert_allclose(planar_contact_point(arm, reach.positions), place, atol=1e-7)
    assert reach.positions[1] <= 0 if elbow is Elbow.UP else reach.positions[1] >= 0
    if aligned:
        assert reach.positions[2] == 0
    else:
        assert math.cos(reach.positions.sum() - last_link.angle) == pytest.approx(1)


@pytest.mark.parametrize("last_link", LAST_LINKS)
@pytest.mark.parametrize("elbow", Elbow)
def test_the_papers_far_corner_is_out_of_reach_from_a_base_at_height_0(last_link, elbow):
    """sqrt(0.89^2 + 0.46^2) = 1.002 m; the links are 1.0 m together."""
    arm = paper_arm(last_link=last_link, elbow=elbow)
    assert planar_inverse_kinematics(arm, 0.89, 0.46).outcome is ReachOutcome.UNREACHABLE
    mass = planar_effective_mass_at(arm, 0.89, 0.46)
    assert mass.outcome == "unreachable"
    assert math.isnan(mass.value)


def test_an_arm_stretched_upwards_has_no_effective_mass_downwards():
    arm = paper_arm(last_link=LINK_ALIGNED)
    assert planar_inverse_kinematics(arm, 0.0, 1.0).outcome == "reached"
    assert planar_effective_mass_at(arm, 0.0, 1.0).outcome == "no_motion"
    assert planar_effective_mass_at(arm, 1.0, 0.0).outcome == "regular"


def test_a_single_link_by_hand():
    """A point mass at the end of a locked, aligned, horizontal arm, all else massless, is felt whole."""
    arm = paper_arm(LinkMass.POINT_AT_END, LINK_ALIGNED, Wrist.LOCKED, masses=(1e-9, 1e-9, 4.0))
    assert planar_effective_mass_at(arm, 0.7, 0.0).value == pytest.approx(4.0, rel=1e-6)
    # a horizontal last link with a free wrist gives way: only its own end is felt, wherever the arm is
    free = planar_mass_map(paper_arm(LinkMass.POINT_AT_END, LINK_HORIZONTAL), [0.5, 0.7], [0.1, 0.3])
    np.testing.assert_allclose(free.mass.value, 4.0, rtol=1e-9)
    assert free.trend_with_distance is Trend.CONSTANT


def test_maps_trends_and_drive_inertia():
    arm = paper_arm(last_link=LINK_HORIZONTAL, wrist=Wrist.LOCKED, base_height=0.18)
    dense = planar_mass_map(arm, np.linspace(0.52, 0.89, 12), np.linspace(0.14, 0.46, 9))
    assert dense.mass.value.shape == (12, 9)
    assert dense.mass.value[3, 4] == planar_effective_mass_at(arm, dense.distances[3], dense.heights[4]).value
    assert dense.trend_with_distance is dense.trend_with_height is Trend.FALLS
    assert arm.standard_effective_mass == 10.5
    geared = planar_mass_map(arm, [0.6, 0.7], [0.2], drive_inertia=[1.0, 1.0])
    assert geared.trend_with_height is Trend.UNKNOWN
    assert np.all(geared.mass.value > planar_mass_map(arm, [0.6, 0.7], [0.2]).mass.value)
    far = planar_mass_map(arm, [2.0, 3.0], [0.2, 0.3])
    assert far.trend_with_distance is Trend.UNKNOWN
    assert math.isnan(far.force_ratio)


@pytest.mark.parametrize(
    "change",
    [
        {"lengths": (0.5, 0.45)},
        {"lengths": (0.5, 0.45, 0.0)},
        {"masses": (13.0, 4.0, -4.0)},
        {"masses": (13.0, 4.0, math.nan)},
        {"base_height": math.inf},
        {"last_link": LastLink(math.inf)},
    ],
)
def test_arms_that_cannot_be_are_refused(change):
    with pytest.raises(InputError, match="planar arm: found"):
        paper_arm(**change)


def test_places_and_postures_that_are_none_are_refused():
    with pytest.raises(InputError, match="not finite"):
        planar_inverse_kinematics(paper_arm(), math.nan, 0.3)
    with pytest.raises(InputError, match=r"expected \(\.\.\., 3\)"):
        planar_jacobian(paper_arm(), [0.1, 0.2])
    with pytest.raises(InputError, match="ascending"):
        planar_mass_map(paper_arm(), [0.5, 0.4], [0.1])


def test_the_docs_say_which_variants_fall():
    page = (Path(__file__).parents[1] / "docs" / "effective_mass.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \| (\w+) \| (\w+) \| ([\d.]+) \|(.*)\|$", page, re.M)
    variants = list(itertools.product(LinkMass, LAST_LINKS, Wrist, (0.0, 0.18)))
    assert [row[:4] for row in rows] == [(m, str(last), w, f"{base:g}") for m, last, w, base in variants]
    for (link_mass, last_link, wrist, base), row in zip(variants, rows, strict=True):
        assert table_row(paper_arm(link_mass, last_link, wrist, base)) == row[4].strip()


def table_row(arm):
    """What the docs say of one arm: trends over the dense map, values at the nine points."""
    dense = planar_mass_map(arm, np.linspace(0.52, 0.89, 38), np.linspace(0.14, 0.46, 33))
    nine = planar_mass_map(arm, INSPECTION_DISTANCES, INSPECTION_HEIGHTS)
    values = nine.mass.value[np.isfinite(nine.mass.value)]
    cells = [
        nine.trend_with_distance, nine.trend_with_height, dense.trend_with_distance, dense.trend_with_height,
        f"{values.min():.2f} to {values.max():.2f}", f"{nine.force_ratio:.2f}", str(9 - values.size),
    ]  # fmt: skip
    return " | ".join(cells)
