"""Acceptance on recordings that nobody here made: a robot arm that clamps, and dummies hit by a mobile robot."""

from __future__ import annotations

import numpy as np
import pytest

import forcemap as fm
from real_data import FOLDER, needs_real_data

pytestmark = [pytest.mark.real_data, needs_real_data]
DEVICE = fm.Device(range=10_000.0, error=3.0)
ARM = sorted((FOLDER / "ur_clamp").glob("*.csv"))
ARM_COLUMNS = {"time": 1, "time_unit": "ms", "force": [20, 21, 22]}
DUMMY_COLUMNS = {"time": "time_ms", "time_unit": "ms", "force": "force_N", "curve": "speed_m_s_label"}


def arm(path, direction):
    columns = ARM_COLUMNS | ({"direction": list(direction)} if direction else {})
    (impact,) = fm.find_impacts(fm.read_recording(path, columns=columns, device=DEVICE))
    return impact


def dummies(name):
    recordings = fm.read_recordings(FOLDER / "dummy_impact" / name, columns=DUMMY_COLUMNS, device=DEVICE)
    found = [fm.find_impacts(recording) for recording in recordings]
    assert all(len(impacts) == 1 for impacts in found)
    return {recording.curve: impacts[0] for recording, impacts in zip(recordings, found, strict=True)}


def plateau(path, direction):
    """The force held, read off the raw columns; every run holds for some 3.2 s up to its end."""
    table = np.loadtxt(path, delimiter=",", usecols=(0, 19, 20, 21))
    left, force = (table[-1, 0] - table[:, 0]) / 1000.0, table[:, 1:]
    quiet = (left > 4.5) & (left < 8.5)
    change = np.median(force[left < 1.5], axis=0) - np.median(force[quiet], axis=0)
    return float(change @ direction) if direction else float(np.linalg.norm(change))


def test_there_are_six_runs_of_the_arm():
    assert len(ARM) == 6


@pytest.mark.parametrize("direction", [None, (-1.0, 0.0, 0.0)], ids=["norm", "along -x"])
@pytest.mark.parametrize("path", ARM, ids=lambda path: path.stem)
def test_runs_of_the_arm(path, direction):
    impact = arm(path, direction)
    time, force = impact.contact.time, impact.contact.force
    shown = int(np.argmax((force > 8.0) & (time > impact.onset - 0.1)))
    before = (time < min(time[shown], impact.onset)) & (time > time[shown] - 5.0)
    assert abs(np.median(force[before])) < 3.0
    assert impact.scenario is fm.ContactScenario.WITH_CLAMPING
    assert impact.has(fm.Quality.UNRESOLVED)
    assert impact.phase2_mean_force == pytest.approx(plateau(path, direction), abs=10.0)
    assert impact.recorded_time > 3.0


@pytest.mark.parametrize("name", ["Impact-Q3-Chest-Robot60Kg.csv", "Impact-H3_Legs-Robot133Kg.csv"])
def test_no_impact_on_a_dummy_clamps(name):
    for impact in dummies(name).values():
        assert impact.scenario is not fm.ContactScenario.WITH_CLAMPING


def test_impacts_on_the_chest_are_over_and_fast_ones_on_the_legs_too():
    over = {**dummies("Impact-Q3-Chest-Robot60Kg.csv")}
    legs = dummies("Impact-H3_Legs-Robot133Kg.csv")
    fast = {curve: impact for curve, impact in legs.items() if curve.startswith("3.1")}
    assert (len(over), len(fast)) == (4, 3)
    for impact in (*over.values(), *fast.values()):
        assert impact.scenario in (fm.ContactScenario.UNCONSTRAINED, fm.ContactScenario.WITHOUT_CLAMPING)
    for curve in ("1.0", "1.5"):
        assert legs[curve].scenario is fm.ContactScenario.UNDETERMINED


def test_the_first_of_two_humps_on_the_legs_is_the_peak():
    impact = dummies("Impact-H3_Legs-Robot133Kg.csv")["1.0"]
    assert 0.034 <= impact.peak_time <= 0.042
    assert 780.0 <= impact.peak_force <= 830.0
    assert impact.has(fm.Quality.NO_BASELINE)


@pytest.mark.parametrize("direction", [None, (-1.0, 0.0, 0.0)], ids=["norm", "along -x"])
def test_none_is_within_a_hundred_newtons(direction):
    impacts = [arm(path, direction) for path in ARM]
    for path in sorted((FOLDER / "dummy_impact").glob("*.csv")):
        impacts += dummies(path.name).values()
    assert len(impacts) == 15
    for impact in impacts:
        verdict = fm.check_impact(impact, 100.0)
        assert all(each.outcome is not fm.VerdictOutcome.WITHIN for each in verdict.judgements), impact.recording.name
