"""Built force-time curves and campaign folders of them, whose figures can be worked out by hand."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

import forcemap as fm

DEVICE = fm.Device(range=500.0, error=3.0, stiffness=75e3)
TOML = 'schema = "forcemap-campaign/1"\n[device]\nrange_N = 500.0\nerror_N = 3.0\nstiffness_N_per_m = 75000.0\n'
PLAN = {"distances": (0.5, 0.7, 0.9), "heights": (0.2, 0.3, 0.4), "speeds": (0.1, 0.2, 0.3)}


def half_sine(time, peak, duration, start=0.0):
    """A half-sine from `start` on, zero elsewhere."""
    turn = np.pi * (time - start) / duration
    return peak * np.sin(np.clip(turn, 0, np.pi))


def pulse(peak=150.0, *, rate=2000.0, duration=0.03, held=0.0, before=0.2, after=0.8, seed=None):
    """Time [s] with contact at 0, and force [N]: a half-sine, then a force that stays if `held` is not 0."""
    time = np.arange(-round(before * rate), round(after * rate) + 1) / rate
    settled = held * np.clip((time - duration) / duration, 0, 1)
    noise = 0.0 if seed is None else np.random.default_rng(seed).normal(0, 0.4, time.size)
    return time, half_sine(time, peak, duration) + settled + noise


def recording(time, force, **options):
    return fm.Recording(time=time, force=force, **({"device": DEVICE} | options))


def save(path, time, force):
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = (f"{t:.6f},{f:.3f}\n" for t, f in zip(time.tolist(), np.asarray(force).tolist(), strict=True))
    path.write_text("time_s,force_N\n" + "".join(lines))


def truth(distance, height, speed):
    """The peak [N] of the state of a plan: grows with the speed, falls with the distance."""
    return 60.0 + 500.0 * speed * (1.2 - distance / 2 + 0.3 * height)


def write_campaign(folder, *, repeats=1, recorded=True, toml=TOML, seed=0):
    """A folder with campaign.toml and plan.csv (27 states), with a recording of each run if `recorded`."""
    folder = Path(folder)
    (folder / "recordings").mkdir(parents=True)
    (folder / "campaign.toml").write_text(toml)
    plan = fm.plan_measurements(*PLAN.values(), design=fm.Design.PAPER, repeats=repeats)
    fm.write_plan(plan, folder)
    for i, name in enumerate(plan.recording.tolist() if recorded else []):
        peak = truth(plan.distance[i], plan.height[i], plan.speed[i])
        save(folder / "recordings" / f"{name}.csv", *pulse(peak, rate=1000.0, seed=1000 * seed + i))
    return folder


def collect(folder):
    return fm.build_dataset(fm.read_campaign(folder))


def rows(path):
    """The rows of a CSV file of a campaign."""
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


def register(folder):
    """The rows of recordings.csv by recording."""
    return {row["file"] + ("#" if row["curve"] else "") + row["curve"]: row for row in rows(folder / "recordings.csv")}
