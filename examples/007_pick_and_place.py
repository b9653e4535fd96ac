"""A press-and-place task near and far from the base: allowed speeds, cycle time, a better place, the robot's table.

Run: python examples/007_pick_and_place.py
"""

from __future__ import annotations

import math

import numpy as np

import forcemap as fm
from forcemap.exports.urscript import urscript

# 1. The paper's example, a task 0.8 m away and 0.4 m above the base: what it says, and what its maps really allow.
says = {"ur10e": {140: 0.16, 280: 0.36}, "kuka-iiwa7-30nm": {140: 0.20}}
for name in ("ur10e", "kuka-iiwa7-30nm"):
    force_map = fm.published_map(name)
    for contact in fm.Contact:
        hand = fm.force_limit("back_of_hand")
        newtons = hand.force(contact)
        said = says[name].get(int(newtons))
        print(f"{name}, {contact} contact, {newtons:g} N: the paper says {f'{said} m/s' if said else 'nothing'}")
        for margin in (0.0, 0.10):
            found = fm.safe_speed(force_map, 0.8, 0.4, limit=hand, contact=contact, bound=fm.FixedMargin(margin))
            speed = f"{fm.floor_speed(found.speed)} m/s at contact" if found.outcome.has_speed else "no speed"
            print(f"  prediction + {100 * margin:g} %: {found.outcome}, {speed} ({fm.sentence(found.reason)})")
            if found.outcome is fm.SpeedOutcome.UNCONFIRMED and found.extrapolated_speed > 0:
                print(f"    to confirm it, measure here at about {fm.floor_speed(found.extrapolated_speed)} m/s")

# 2. The same task near the base and far from it: press down 8 cm, then lift behind a fence.
ur10e, bound = fm.published_map("ur10e"), fm.FixedMargin(0.10)
press = fm.TaskSegment("press", ("back_of_hand",), fm.Contact.TRANSIENT)
lift = fm.TaskSegment("lift", (), None, speed=0.5)  # contact excluded by other measures
task = fm.Task((press, lift), acceleration=5.0)
stroke = fm.ToolPath(np.array([[0, 0, 0.08], [0, 0, 0.0], [0, 0, 0.08]]), ("press", "lift"))
for where, offset in {"near": (0.60, 0.0, 0.34), "far": (0.85, 0.0, 0.36)}.items():
    speeds = fm.path_speeds(ur10e, stroke.moved(offset), task, bound=bound)
    slowest = fm.floor_speed(speeds.constant.speed)
    times = [f"{each.rule} {each.duration:.3f} s" for each in (speeds.allowed, speeds.standard, speeds.constant)]
    if speeds.refused.any():  # a path that is not permitted everywhere has no cycle time (NaN)
        why = {fm.sentence(reason) for reason in speeds.reason[speeds.refused]}
        times = [f"no permission on {speeds.refused.sum()} of {len(speeds.path)} pieces: {'; '.join(sorted(why))}"]
    print(f"{where}, {offset[0]} m away: slowest {slowest} m/s; " + ", ".join(times))

# 3. Where the table should stand.
places = fm.place_task(ur10e, stroke, task, bound=bound)
assert places.best is not None
print("best place: {:.2f} m away, {:.2f} m above the base, {:.3f} s".format(*places.best))
for along, up, change in places.sensitivity:
    cost = "no permission there" if math.isnan(change) else f"{change:+.3f} s"
    print(f"  moved by {along:+.2f} m, {up:+.2f} m: {cost}")

# 4. The table of speeds for the program.
table = fm.robot_table(ur10e, limits=[(fm.force_limit("back_of_hand"), fm.Contact.TRANSIENT)], bound=bound)
overshoot = table.provenance.allowance.speed
print(f"{table.permitted} of {table.speed_mmps.size} zones permitted, {overshoot:g} m/s overshoot subtracted")
print(f"a zone of 5 cm costs up to {np.nanmax(table.spread):.3f} m/s against its fastest corner")
print("\n".join(urscript(table).splitlines()[:4]))
