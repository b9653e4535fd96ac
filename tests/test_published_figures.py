"""Figures printed in the paper, and those recomputed from its equations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracle import full_grid, printed_force

import forcemap as fm
from forcemap.words import sentence

CROSSINGS = {  # limit 140 N, 280 N, and with 1.1 on force, at d = 0.8 m, h = 0.4 m
    "ur10e": (0.1590, 0.3560, 0.1381, 0.3212),
    "kuka-iiwa7-30nm": (0.1953, 0.4009, 0.1749, 0.3614),
    "kuka-iiwa7-10nm": (0.2049, 0.4030, 0.1849, 0.3659),
}


@pytest.mark.parametrize("name", fm.PUBLISHED_MAPS)
def test_crossing_speeds(name):
    forces = np.array([140, 280, 140 / 1.1, 280 / 1.1])
    found = fm.published_map(name).crossing_speed(0.8, 0.4, forces)
    np.testing.assert_allclose(found, CROSSINGS[name], atol=2e-4)


def test_the_second_root_is_never_taken():
    ur10e = fm.published_map("ur10e")
    assert ur10e.crossing_speed(0.52, 0.14, 140.0) == 0.0
    assert ur10e.predict(0.52, 0.14, 0.0) == pytest.approx(184, abs=0.5)
    assert ur10e.predict(0.52, 0.14, 1.493) == pytest.approx(140, abs=0.5)  # the falling branch


@pytest.mark.parametrize("name", fm.PUBLISHED_MAPS)
def test_predictions_are_the_printed_equations(name):
    points = full_grid(name).T
    np.testing.assert_allclose(fm.published_map(name).predict(*points), printed_force(name, *points), rtol=1e-13)


@pytest.mark.parametrize(
    ("moving_mass", "speeds", "force"), [(30, (0.1320, 0.2640), 318.2), (20, (0.1617, 0.3233), 259.8)]
)
def test_contact_model(moving_mass, speeds, force):
    masses = {"robot_mass": fm.pfl_robot_mass(moving_mass), "body_mass": math.inf, "stiffness": 75e3}
    np.testing.assert_allclose(fm.pfl_speed_limit([140, 280], **masses), speeds, atol=5e-5)
    assert fm.pfl_contact_force(0.3, **masses) == pytest.approx(force, abs=0.05)


def test_contact_model_with_a_free_hand():
    masses = {"robot_mass": 15.0, "body_mass": 0.6, "stiffness": 75e3}
    np.testing.assert_allclose(fm.pfl_speed_limit([140, 280], **masses), (0.67, 1.35), atol=0.005)


def test_published_findings_on_phase_two():
    """Section V-D: the UR10e's contact is transient, the KUKA clamps."""
    limit = fm.force_limit("back_of_hand")
    options = {"limit": limit, "contact": fm.Contact.TRANSIENT, "bound": fm.FixedMargin(0.10)}
    assert fm.safe_speed(fm.published_map("ur10e"), 0.8, 0.4, **options).outcome is fm.SpeedOutcome.ADMISSIBLE
    for name in ("kuka-iiwa7-30nm", "kuka-iiwa7-10nm"):
        found = fm.safe_speed(fm.published_map(name), 0.8, 0.4, **options)
        assert found.outcome is fm.SpeedOutcome.UNCONFIRMED
        assert "clamp" in sentence(found.reason)
        assert math.isnan(found.speed)


@pytest.mark.parametrize("name", fm.PUBLISHED_MAPS)
def test_printed_grid_is_the_measured_range(name):
    grid = full_grid(name)
    low, high = fm.published_map(name).measured_range.speeds(grid[:, 0], grid[:, 1])
    assert (low == 0.2).all()
    assert (high == 0.4).all()


def test_example_campaigns_resemble_the_papers_datasets(examples):
    """Samples used, and accuracy of the same size as the paper's tables (its own data are not public facts here)."""
    states = {"ur10e": 134, "kuka-iiwa7-30nm": 144, "kuka-iiwa7-10nm": 144}
    for name, dataset in examples.items():
        assert len(dataset.states) == states[name]
        assert dataset.simulated
        assert dataset.conditions.device.range == 500
        assert len(dataset.train.states) == 27
        assert len(dataset.test.states) == states[name] - 27 + 3
        accuracy = fm.force_map_accuracy(fm.fit_force_map(dataset), dataset.independent_test)
        assert 2.0 < accuracy.max_underestimation_percent < 14.0
        assert 1.0 < accuracy.mean_underestimation_percent < 4.5
