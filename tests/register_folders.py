"""Campaign folders as `forcemap collect` leaves them, made without judging a curve: thousands of them, quickly."""

from __future__ import annotations

import hashlib
import io
from functools import cache
from pathlib import Path

import numpy as np

import forcemap as fm
from forcemap.campaigns.binding import impact_sha256
from forcemap.campaigns.recordings_table import Entry, Use, register_text
from forcemap.csv_table import csv_text
from forcemap.impacts.scenario import ContactScenario

DAY = "2026-02-01"
TOML = """schema = "forcemap-campaign/1"
operator = "N. N."
date = "{date}"
simulated = {simulated}
[robot]
model = "UR10e"
controller = "CB5"
firmware = "{firmware}"
[tool]
name = "{tool}"
payload_kg = 0.0
covers = "none"
[contact]
site = "flange"
direction = "down"
speed = "measured"
[device]
model = "PFMD"
range_N = 500.0
error_N = 3.0
stiffness_N_per_m = {spring}
calibrated = "{calibrated}"
[protocol]
site = "{site}"
cell = "{cell}"
robot_serial_number = "R-{cell}"
controller_serial_number = "C-{cell}"
safety_checksum = "A1B2"
program = "{program}"
device_serial_number = "{serial}"
"""
STATED = {"date": DAY, "firmware": "5.11", "tool": "gripper", "spring": 75000.0, "calibrated": "2025-07-01"}
STATED |= {"site": "plant", "cell": "cell-1", "program": "pick 3", "serial": "D1", "simulated": "false"}


def toml_of(**stated):
    return TOML.format(**STATED | stated)


@cache
def plan_text(recordings):
    """A plan of so many runs at 30 states, and its rows: name, state, repeat, distance, height, speed."""
    places = [(0.52 + 0.04 * i, 0.14 + 0.05 * (i * 3 % 7)) for i in range(10)]
    states = [(d, h, v) for d, h in places for v in (0.15, 0.25, 0.35)]
    rows = []
    for number in range(recordings):
        state, repeat = number % len(states), number // len(states) + 1
        d, h, v = states[state]
        rows.append((f"s{state:02d}-r{repeat}", f"s{state:02d}", repeat, round(d, 3), round(h, 3), v))
    text = io.StringIO()
    text.write("recording,state_id,repeat,role,distance_m,height_m,speed_mps,base_angle_deg,expected_force_N\n")
    text.writelines(f"{name},{state},{repeat},train,{d},{h},{v},,\n" for name, state, repeat, d, h, v in rows)
    return text.getvalue(), tuple(rows)


@cache
def peaks_of(recordings):
    """Forces [N] of a printed map at the states of the plan."""
    _, rows = plan_text(recordings)
    d, h, v = np.array([row[3:] for row in rows]).T
    return fm.published_map("ur10e").predict(d, h, v)


def collected(folder, recordings=30, seed=0, *, scale=0.6, phase2=1.6, **stated):
    """A folder of so many recordings, whose files are a few bytes that nothing reads again."""
    folder = Path(folder)
    (folder / "recordings").mkdir(parents=True)
    toml = toml_of(**stated)
    (folder / "campaign.toml").write_text(toml)
    plan, rows = plan_text(recordings)
    (folder / "plan.csv").write_text(plan)
    conditions = fm.read_conditions(folder / "campaign.toml")
    under = conditions.measured_under() | {"date": conditions.date}
    rng = np.random.default_rng(seed)
    own = np.exp(rng.normal(0, 0.02, 30))[np.arange(recordings) % 30] * np.exp(rng.normal(0, 0.005, recordings))
    entries, table = [], []
    for (name, state, repeat, d, h, v), peak in zip(rows, (scale * peaks_of(recordings) * own).tolist(), strict=True):
        file, force = f"{name}.csv", f"{peak:.2f}"
        content = f"{seed} {name}\n".encode()
        (folder / "recordings" / file).write_bytes(content)
        row = {"state_id": state, "repeat": str(repeat), "role": "train", "distance_m": str(d), "height_m": str(h)}
        row |= {"speed_mps": str(v), "peak_force_N": force, "censored": "false", "phase2_force_N": f"{phase2:.2f}"}
        row |= {"scenario": "unconstrained", "recording": file, "flags": "", "raw_peak_N": force}
        table.append(row | dict.fromkeys(_UNUSED, "0") | {"unused_phase2_force_N": ""})
        entries.append(
            Entry(
                file=file,
                sha256=hashlib.sha256(content).hexdigest(),
                size=len(content),
                state_id=state,
                repeat=repeat,
                use=Use.USED,
                scenario=ContactScenario.UNCONSTRAINED,
                peak_force=float(force),
                raw_peak_force=float(force),
                phase2_force=phase2,
                phase1_duration=0.03,
                impact_sha256=impact_sha256(row),
                conditions=under,
            )
        )
    (folder / "recordings.csv").write_text(register_text(entries))
    (folder / "impacts.csv").write_text(csv_text({key: [row[key] for row in table] for key in table[0]}))
    return folder


_UNUSED = [
    f"unused_{name}"
    for name in (
        *("unconstrained", "constrained_without_clamping", "constrained_with_clamping", "undetermined"),
        *("above_peak", "excluded", "unreadable"),
    )
]
