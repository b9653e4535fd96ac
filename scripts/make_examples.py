"""Make the bundled example campaigns: simulated impacts on the three grids of the paper.

Each state's true force is the published map times a state effect; each impact adds repeat noise. Forces above
the device range are recorded as censored. Run from the root of the project; the seed makes the files repeatable.
"""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

SEED = 20210530
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


def impacts(name: str, facts: dict[str, Any], scenario: str, rng: np.random.Generator) -> list[dict[str, str]]:
    """Rows of impacts.csv for one campaign."""
    grid = facts["maps"][name]
    effect_sd, repeat_sd = NOISE[name]
    rows = []
    for d, h in product(grid["distances_m"], grid["heights_m"]):
        if [d, h] in grid["omitted_test_positions"]:
            continue
        training_place = d in grid["training_distances_m"] and h in grid["training_heights_m"]
        for v in grid["speeds_mps"]:
            log_force = sum(
                b * FACTORS[term](d, h, v) for b, term in zip(grid["coefficients"], facts["terms"], strict=True)
            )
            force = np.exp(log_force + rng.normal(0.0, effect_sd))
            for repeat in range(1, grid["repeats"] + 1):
                measured = round(float(force + rng.normal(0.0, repeat_sd)), 1)
                censored = measured >= grid["device_range_N"]
                rows.append(
                    {
                        "state_id": f"d{1000 * d:.0f}-h{1000 * h:.0f}-v{1000 * v:.0f}",
                        "repeat": str(repeat),
                        "role": "train" if training_place and v in grid["training_speeds_mps"] else "test",
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
