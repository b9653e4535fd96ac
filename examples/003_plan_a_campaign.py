"""What to measure to confirm 140 N: a plan that says where its speeds will not do, then one with a slower speed.

Run: python examples/003_plan_a_campaign.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import forcemap as fm
from forcemap.campaigns.template import campaign_text
from forcemap.exports.run_sheet import run_sheet

device = fm.Device(range=500.0, error=3.0, model="force measuring device")
conditions = fm.Conditions(robot="UR10e", moving_mass=30.0, direction="down", device=device)
expected = fm.published_map("ur10e")  # an earlier map; without one, fm.StandardExpectation(moving_mass=30.0)
limit = fm.force_limit("back_of_hand").quasi_static

distances, heights = (0.56, 0.86), (0.14, 0.46)  # lowest and highest [m]
for speeds in ((0.2, 0.4), (0.05, 0.4)):  # slowest and fastest [m/s]
    plan = fm.plan_measurements(distances, heights, speeds, device=device, expected_force=expected, limit=limit)
    print(f"{len(plan)} impacts in {len(plan.states)} states at {plan.places} places, {plan.minutes() / 60:.1f} hours")
    for finding in (*plan.warnings, *plan.left_out):
        print(f"  {fm.sentence(finding)}")

folder = Path(tempfile.mkdtemp())
fm.write_plan(plan, folder)
(folder / "campaign.toml").write_text(campaign_text(conditions), encoding="utf-8")
campaign = fm.read_campaign(folder)  # what forcemap plan writes, but for the run sheet
print(f"first run: save the device's file as {campaign.plan.recording[0]} in {campaign.recordings.name}/")
print("\n".join(run_sheet(plan, conditions)[:24]))  # to print and take to the robot
