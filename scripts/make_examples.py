"""Make the bundled example campaigns: simulated impacts of the default plan, and of the paper's grids to test.

The plan spreads its states over the ranges that the paper measured of a robot, with three repeats, and measures three
of them again at the end. The states of the paper's grid that it does not measure follow, with the paper's repeats and
role test. Each state's true force is the published map times a state effect, as of a robot that the form fits and whose
places have no effect of their own; each impact adds repeat noise. Forces above the device range are recorded as
censored. Run from the root of the project. The seed makes the files repeatable; it is the first from the day of the
paper on with which neither drift nor a departure from the form is found in any of them: each is by chance in one of
twenty.
"""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import forcemap as fm
from forcemap.planning.runs import extend_plan

SEED = 20210531
PUBLISHED = Path("src/forcemap/maps/published")
EXAMPLES = Path("src/forcemap/campaigns/examples")

# SD of the state effect as a share of the force, and of repeats [N]: what the paper's accuracy and repeatability
# figures amount to (the mean SD of three repeats is 0.886 sigma).
NOISE = {
    "ur10e": (0.022, 1.12 / 0.886),
    "kuka-iiwa7-30nm": (0.033, 0.58 / 0.886),
    "kuka-iiwa7-10nm": (0.021, 0.58 / 0.886),
}

FACTORS: dict[str, Callable[[float, float, float], float]] = {  # the paper's terms, in its order
    "1": lambda d, h, v: 1.0,
    "v": lambda d, h, v: v,
    "d": lambda d, h, v: d,
    "d^2": lambda d, h, v: d * d,
    "d*h": lambda d, h, v: d * h,
    "h^2": lambda d, h, v: h * h,
    "d^2*v": lambda d, h, v: d * d * v,
    "d*v^2": lambda d, h, v: d * v * v,
    "d*h^2": lambda d, h, v: d * h * h,
}


def runs(grid: dict[str, Any]) -> fm.MeasurementPlan:
    """The default plan over the ranges of a grid, then the grid's other states, with role test."""
    axes = [grid[name] for name in ("distances_m", "heights_m", "speeds_mps")]
    plan = fm.plan_measurements(*((min(axis), max(axis)) for axis in axes))
    full = fm.plan_measurements(*axes, design=fm.Design.FULL_GRID, repeats=grid["repeats"])
    omitted = [[d, h] in grid["omitted_test_positions"] for d, h in zip(full.distance, full.height, strict=True)]
    tests = full.select(~(np.isin(full.state_id, plan.states) | omitted))
    return extend_plan(plan, replace(tests, role=np.full(len(tests), "test")))


def impacts(name: str, facts: dict[str, Any], scenario: str, rng: np.random.Generator) -> list[dict[str, str]]:
    """Rows of impacts.csv for one campaign."""
    grid = facts["maps"][name]
    effect_sd, repeat_sd = NOISE[name]
    plan, rows = runs(grid), []
    effects = dict(zip(plan.states, rng.normal(0.0, effect_sd, len(plan.states)).tolist(), strict=True))
    for state, repeat, role, d, h, v in zip(*list(plan.arrays.values())[:6], strict=True):
        log_force = sum(
            b * FACTORS[term](d, h, v) for b, term in zip(grid["coefficients"], facts["terms"], strict=True)
        )
        force = np.exp(log_force + effects[state])
        measured = round(float(force + rng.normal(0.0, repeat_sd)), 1)
        censored = measured >= grid["device_range_N"]
        rows.append(
            {
                "state_id": state,
                "repeat": str(repeat),
                "role": role,
                "distance_m": str(d),
                "height_m": str(h),
                "speed_mps": str(v),
                "peak_force_N": f"{grid['device_range_N'] if censored else measured:.1f}",
                "censored": "true" if censored else "false",
                "scenario": scenario,
                "flags": "simulated",
            }
        )
    return rows


def campaign_toml(name: str, campaign: dict[str, Any]) -> str:
    """The text of campaign.toml: what the paper states, marked simulated."""
    lines = [
        'schema = "forcemap-campaign/1"',
        "simulated = true",
        f'note = "SIMULATED: drawn from the published map {name} by scripts/make_examples.py, seed {SEED}"',
    ]
    for section, entries in campaign.items():
        if isinstance(entries, dict):
            lines += ["", f"[{section}]", *(f"{key} = {json.dumps(value)}" for key, value in entries.items())]
    lines += ["", "[standard]", 'edition = "ISO/TS 15066:2016"']
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the folders of all example campaigns."""
    facts = json.loads((PUBLISHED / "published_maps.json").read_text())
    campaigns = tomllib.loads((PUBLISHED / "campaigns.toml").read_text())
    for number, name in enumerate(facts["maps"]):
        folder = EXAMPLES / name
        folder.mkdir(parents=True, exist_ok=True)
        campaign = campaigns[name]
        rows = impacts(name, facts, campaign["scenario"], np.random.default_rng([SEED, number]))
        with (folder / "impacts.csv").open("w", newline="") as stream:
            writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        (folder / "campaign.toml").write_text(campaign_toml(name, campaign))
        print(f"{folder}: {len(rows)} impacts, {sum(row['censored'] == 'true' for row in rows)} censored")


if __name__ == "__main__":
    main()
