"""Forces that sink slowly (flag `slow_return`): of robots that hold one, through a channel that does not, or let go.

`make validity` prints the table of docs/validity.md.
"""

from __future__ import annotations

import numpy as np
import pytest
from test_lab_bound import box

import forcemap as fm
from forcemap.impacts.impact import Quality
from forcemap.lab.bench import simulate_impacts
from forcemap.lab.virtual_robot import PRESETS, virtual_robot
from sizes import FULL_SIZE

SEED, STEP, HELD = 202631, 0.001, 150.0  # of a recording [s]; force that a robot holds [N]
TIMES = (None, 0.5, 0.16, 0.05, 0.03, 0.016)  # time constant of the channel [s]; None lets nothing sink

AGAINST = {Quality.SLOW_RETURN, Quality.REVERSED}


def curves(preset, held):
    """Time [s] and contact forces [N] of impacts over the preset's range, with noise; of a robot that holds one."""
    box_of, rng = box(preset, 0.1), np.random.default_rng(SEED)
    places = box_of.grid(5, 5, 5)
    made = simulate_impacts(virtual_robot(preset), *places.T, duration=0.9)
    every = round(STEP / (made.time[1] - made.time[0]))
    force = made.force[::every].T
    for curve in force if held else ():
        peak = int(curve.argmax())
        curve[peak:] = np.maximum(curve[peak:], min(HELD, 0.9 * curve[peak]))
    before = np.zeros((len(force), 200))
    force = np.hstack([before, force]) + rng.normal(0, 0.4, (len(force), 200 + force.shape[1]))
    return (np.arange(force.shape[1]) - 200) * STEP, force


def through(force, constant):
    """Forces through a high-pass of that time constant [s]: y' = x' - y / T."""
    if constant is None:
        return force
    share, read = constant / (constant + STEP), np.zeros_like(force)
    for i in range(1, force.shape[1]):
        read[:, i] = share * (read[:, i - 1] + force[:, i] - force[:, i - 1])
    return read


def told(time, force):
    """How many curves show an impact, are flagged, and read as let go without a flag that speaks against it [%]."""
    device = fm.Device(range=2000.0, error=3.0, stiffness=75_000.0)
    found = [fm.find_impacts(fm.Recording(time=time, force=curve, device=device)) for curve in force]
    found = [impacts for impacts in found if impacts]
    flags = [{flag.name for impact in impacts for flag in impact.flags} for impacts in found]
    loose = [impacts[0].scenario is fm.ContactScenario.UNCONSTRAINED for impacts in found]
    sinks = [Quality.SLOW_RETURN in each for each in flags]
    silent = [free and not each & AGAINST for free, each in zip(loose, flags, strict=True)]
    return len(found), 100 * float(np.mean(sinks)), 100 * float(np.mean(silent))


@pytest.mark.parametrize("constant", TIMES if FULL_SIZE else (None, 0.16, 0.05))
@pytest.mark.parametrize("preset", PRESETS if FULL_SIZE else ["ur10e-like"])
def test_a_held_force_that_sinks_is_flagged_and_one_that_is_let_go_is_not(preset, constant):
    time, force = curves(preset, held=True)
    impacts, sinks, silent = told(time, through(force, constant))
    print(f"| {preset} | {HELD:g} N | {constant or '-'} | {impacts} | {sinks:.0f} % | {silent:.0f} % |")
    assert impacts > 10
    if constant is None:
        assert sinks == silent == 0.0
    elif constant >= 0.03:  # longer ones keep it up long enough to be seen to clamp; far shorter ones go unseen
        assert silent < 15.0


@pytest.mark.parametrize("preset", PRESETS if FULL_SIZE else ["ur10e-like"])
def test_what_a_robot_of_the_lab_lets_go_does_not_sink_slowly(preset):
    time, force = curves(preset, held=False)
    impacts, sinks, _ = told(time, force)
    print(f"| {preset} | let go | - | {impacts} | {sinks:.0f} % | |")
    assert impacts > 10
    assert sinks < 5.0
