"""Impacts without hardware: simulate a campaign, evaluate it like a measured one, and ask what if.

Run: python examples/006_virtual_lab.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import forcemap as fm
from forcemap.lab.bench import simulate_impacts, simulate_peaks
from forcemap.lab.simulated_campaign import simulate_campaign
from forcemap.lab.simulated_device import SimulatedDevice
from forcemap.lab.virtual_robot import virtual_robot

# two virtual robots at one state; no facts about any real one
for name in ("ur10e-like", "iiwa7-like-30nm"):
    impact = simulate_impacts(virtual_robot(name), 0.7, 0.3, 0.3)
    print(f"{name}: peak {impact.peak_force[0]:.0f} N, held {impact.held_force[0]:.0f} N: {impact.scenario[0]}")

# what if
robot = virtual_robot("iiwa7-like-30nm")
for each in (robot, robot.with_threshold(10.0), robot.with_payload(2.0), robot.with_cover(20_000.0)):
    peak = simulate_peaks(each, 0.7, 0.3, 0.3)[0]
    print(f"{', '.join([each.name, *each.changes])}: peak {peak:.0f} N")

# a campaign: a plan, recordings as a device writes them, and the chain that measured ones go through
plan = fm.plan_measurements((0.56, 0.86), (0.14, 0.46), (0.2, 0.4), device=fm.Device(range=500.0))
folder = Path(tempfile.mkdtemp()) / "campaign"
made = simulate_campaign(plan, robot, SimulatedDevice(), np.random.default_rng(1), folder)
dataset = fm.build_dataset(fm.read_campaign(folder))
force_map = fm.fit_force_map(dataset)
print(f"{len(made.recording)} recordings; {fm.sentence(dataset.phase_two.finding)}")
print(f"predicted at d = 0.7 m, h = 0.3 m, v = 0.3 m/s: {force_map.predict(0.7, 0.3, 0.3):.0f} N")
answer = fm.safe_speed(force_map, 0.8, 0.4, limit=160.0, contact=fm.Contact.QUASI_STATIC, bound=fm.ToleranceBound())
print(f"{answer.outcome} for 160 N at d = 0.8 m, h = 0.4 m; {fm.sentence(answer.basis.statements[0])}")
