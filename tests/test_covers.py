"""Covers and payloads in the contact model, against a simulated contact."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

import forcemap as fm
from forcemap.limits.covers import cover_estimate, payload_estimate


def largest_force(speed, mass, k, k_c, d_c):
    """Peak force of a mass that hits a cover and a spring in series; the cover is rigid once it is compressed."""
    compressed, deep = k_c * d_c, 0.5 * k_c * d_c**2 * (1 + k_c / k)  # force and energy when the cover bottoms out
    energy = 0.5 * mass * speed**2
    if energy <= deep:
        return math.sqrt(2 * energy / (1 / k + 1 / k_c))
    return math.sqrt(compressed**2 + 2 * k * (energy - deep))


def integrated_force(speed, mass, k, k_c, d_c, steps=200_000):
    """The same by integrating the motion."""
    x, v, most, dt = 0.0, speed, 0.0, 1e-6
    both = k * k_c / (k + k_c)
    for _ in range(steps):
        force = both * x if both * x <= k_c * d_c else k * (x - d_c)
        most = max(most, force)
        v -= force / mass * dt
        x += v * dt
        if v <= 0:
            break
    return most


@given(st.floats(50, 400), st.floats(2, 30), st.floats(1e4, 1e5), st.floats(500, 1e5), st.floats(0.0, 0.05))
def test_property_at_the_estimated_speed_the_model_gives_the_limit(limit, mass, k, k_c, d_c):
    found = cover_estimate(
        limit, robot_mass=mass, body_mass=math.inf, stiffness=k, cover_stiffness=k_c, cover_thickness=d_c
    )
    assert largest_force(found.speed_after, mass, k, k_c, d_c) == pytest.approx(limit, rel=1e-6)
    assert found.ratio >= 1
    assert found.bottoms_out == (limit / k_c > d_c)
    assert "ESTIMATE" in found.statement


def test_against_an_integrated_contact():
    for k_c, d_c in ((20e3, 0.02), (8e3, 0.01)):
        found = cover_estimate(
            140.0, robot_mass=15.0, body_mass=math.inf, stiffness=75e3, cover_stiffness=k_c, cover_thickness=d_c
        )
        assert integrated_force(found.speed_after, 15.0, 75e3, k_c, d_c) == pytest.approx(140, rel=1e-3)


def test_no_cover_changes_nothing_and_more_payload_slows():
    bare = cover_estimate(
        140.0, robot_mass=15.0, body_mass=math.inf, stiffness=75e3, cover_stiffness=1e4, cover_thickness=0.0
    )
    assert bare.ratio == 1
    options = {"moving_mass": 30.0, "payload": 0.0, "body_mass": math.inf, "stiffness": 75e3}
    heavier = payload_estimate(140.0, new_payload=5.0, **options)
    assert heavier.ratio == pytest.approx(math.sqrt(15 / 20))
    assert np.isclose(payload_estimate(140.0, new_payload=0.0, **options).ratio, 1)


@pytest.mark.parametrize(("name", "value"), [("stiffness", 20.0), ("thickness", 20.0), ("thickness", math.nan)])
def test_figures_in_other_units_are_refused(name, value):
    cover = {"cover_stiffness": 2e4, "cover_thickness": 0.01} | {f"cover_{name}": value}
    with pytest.raises(fm.InputError, match="cover"):
        cover_estimate(140.0, robot_mass=15.0, body_mass=math.inf, stiffness=75e3, **cover)
