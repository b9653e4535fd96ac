"""Effective mass of any Jacobian and mass matrix."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from forcemap.dynamics.effective_mass import DriveInertia, MassOutcome, effective_mass, standard_effective_mass
from forcemap.errors import InputError

DOWN = [0.0, 0.0, -1.0]
seeds = st.integers(0, 2**32 - 1)


def arm(rng, batch=(), k=3, n=6):
    """A random Jacobian and a random positive definite mass matrix."""
    half = rng.normal(size=(*batch, n, n + 2))
    return rng.normal(size=(*batch, k, n)), half @ np.swapaxes(half, -1, -2)


def by_the_formula(j, m, u):
    u = np.asarray(u) / np.linalg.norm(u)
    return 1 / (u @ j @ np.linalg.inv(m) @ j.T @ u)


@given(seeds, st.sampled_from([(2, 2), (2, 3), (3, 1), (3, 6), (3, 7)]))
def test_the_formula_of_the_paper(seed, shape):
    k, n = shape
    rng = np.random.default_rng(seed)
    j, m = arm(rng, (4, 5), k, n)
    u = rng.normal(size=(5, k))
    found = effective_mass(j, m, u)
    assert found.value.shape == found.outcome.shape == (4, 5)
    for i, s in np.ndindex(4, 5):
        if found.outcome[i, s] == "regular":
            assert found.value[i, s] == pytest.approx(by_the_formula(j[i, s], m[i, s], u[s]), rel=1e-8)
            alone = effective_mass(j[i, s], m[i, s], u[s])
            assert isinstance(alone.value, float)
            assert isinstance(alone.outcome, MassOutcome)
            assert alone.value == pytest.approx(found.value[i, s], rel=1e-12)


def test_one_posture_and_many_directions():
    rng = np.random.default_rng(0)
    j, m = arm(rng)
    u = rng.normal(size=(3, 4, 3))
    found = effective_mass(j, m, u)
    assert found.value.shape == (3, 4)
    np.testing.assert_allclose(found.value[2, 1], by_the_formula(j, m, u[2, 1]), rtol=1e-10)
    np.testing.assert_allclose(effective_mass(j, m, -7 * u).value, found.value, rtol=1e-12)


@given(seeds)
def test_drive_inertia_is_added_never_lowers_and_is_named(seed):
    rng = np.random.default_rng(seed)
    j, m = arm(rng, (3,))
    drives = rng.uniform(0, 5, 6)
    bare, geared = effective_mass(j, m, DOWN), effective_mass(j, m, DOWN, drive_inertia=drives)
    np.testing.assert_allclose(geared.value, effective_mass(j, m + np.diag(drives), DOWN).value, rtol=1e-10)
    assert np.all(geared.value >= bare.value * (1 - 1e-12))
    assert bare.drive_inertia is None
    assert "not included" in bare.assumption
    assert "given by the user" in geared.assumption
    named = effective_mass(j, m, DOWN, drive_inertia=DriveInertia(drives, "a data sheet"))
    assert named.assumption == "drive inertia: a data sheet"


def test_directions_without_motion_are_named():
    """A planar two-link arm: nothing moves across the plane, and stretched out nothing moves along the arm."""
    m = [[3.0, 1.0], [1.0, 1.0]]
    stretched = [[0.0, 0.0], [0.0, 0.0], [2.0, 1.0]]
    bent = [[-1.0, -1.0], [0.0, 0.0], [1.0, 0.0]]
    found = effective_mass([stretched, stretched, bent, bent], m, [[1, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]])
    assert found.outcome.tolist() == ["no_motion", "regular", "no_motion", "regular"]
    assert np.isnan(found.value).tolist() == [True, False, True, False]
    assert np.isfinite(found.value[[1, 3]]).all()


def test_directions_that_are_nearly_lost_are_named():
    def outcome(bend):
        return effective_mass([[-bend, -bend], [0, 0], [2, 1]], [[3, 1], [1, 1]], [1, 0, 0])

    assert outcome(1e-3).outcome is MassOutcome.REGULAR
    assert outcome(1e-3).value > 1e3
    assert outcome(1e-7).outcome is MassOutcome.SINGULAR
    assert outcome(1e-15).outcome is MassOutcome.NO_MOTION
    assert math.isnan(outcome(1e-7).value)


def test_the_standards_effective_mass():
    """Section II-A: 30 kg and 20 kg, no payload."""
    assert (standard_effective_mass(30.0), standard_effective_mass(20.0)) == (15.0, 10.0)
    assert standard_effective_mass(30.0, 2.5) == 17.5
    for bad in [(0.0, 0.0), (-1.0, 0.0), (math.nan, 0.0), (math.inf, 0.0), (30.0, -1.0), (30.0, math.nan)]:
        with pytest.raises(InputError, match="expected positive finite masses"):
            standard_effective_mass(*bad)


GOOD = (np.eye(3, 6), np.eye(6), DOWN, None)


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (0, np.ones((4, 6)), "expected \\(..., 3, n\\)"),
        (0, np.ones(6), "expected \\(..., 3, n\\)"),
        (0, np.ones((3, 0)), "expected \\(..., 3, n\\)"),
        (0, np.full((3, 6), np.nan), "not finite"),
        (1, np.eye(5), "expected \\(..., 6, 6\\)"),
        (1, np.eye(6) + np.eye(6, k=1), "not symmetric"),
        (1, np.diag([1.0, 1, 1, 1, 1, 0]), "joint 6 of 6 moves no inertia"),
        (1, np.diag([1.0, 1, -2, 1, 1, 1]), "joint 3 of 6 moves no inertia"),
        (1, np.ones((6, 6)), "joint 2 of 6 moves no inertia"),
        (1, np.full((6, 6), np.inf), "not finite"),
        (2, [0, 0, 0], "length zero"),
        (2, [0, 0, math.nan], "not finite"),
        (2, [0, 1], "expected 3 components"),
        (2, -1.0, "expected 3 components"),
        (3, np.ones(5), "5 figures for 6 joints"),
        (3, [1, 1, 1, 1, 1, -0.1], "at least 0"),
        (3, [1, 1, 1, 1, 1, math.nan], "at least 0"),
        (3, 1.0, "one finite number of at least 0 for every joint"),
    ],
)
def test_what_cannot_be_used_is_refused(place, value, message):
    arguments = [*GOOD]
    arguments[place] = value
    j, m, u, drives = arguments
    with pytest.raises(InputError, match=message):
        effective_mass(j, m, u, drive_inertia=drives)


def test_batches_that_do_not_belong_together_are_refused():
    j, m = arm(np.random.default_rng(0), (3,))
    with pytest.raises(InputError, match="different numbers of postures"):
        effective_mass(j, m[:2], DOWN)
    with pytest.raises(InputError, match="goes with the jacobian"):
        effective_mass(j, m, np.ones((4, 3)))


def test_a_link_without_inertia_can_carry_a_drive():
    m = np.diag([1.0, 1, 1, 1, 1, 0])
    assert effective_mass(np.eye(3, 6), m, DOWN, drive_inertia=[0, 0, 0, 0, 0, 0.1]).value == pytest.approx(1.0)


def test_no_postures_are_no_masses():
    found = effective_mass(np.ones((0, 3, 6)), np.ones((0, 6, 6)), DOWN)
    assert found.value.shape == found.outcome.shape == (0,)
