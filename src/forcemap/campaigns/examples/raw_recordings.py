"""Simulated recordings of an example campaign: a curve for each of its impacts, as a device would write them."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcemap.campaigns.campaign import RECORDINGS_FOLDER
from forcemap.campaigns.conditions import CAMPAIGN_FILE, read_conditions
from forcemap.campaigns.dataset import ContactScenario, ImpactDataset
from forcemap.campaigns.examples import copy_example
from forcemap.campaigns.impacts_table import TABLE_FILE, read_dataset
from forcemap.campaigns.plan import MeasurementPlan, write_plan
from forcemap.campaigns.template import campaign_text
from forcemap.files import write_atomically
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.units import TimeUnit

FloatArray = NDArray[np.float64]

_RATE = 1000.0  # [Hz], as the paper's robots were read (section IV-A)
_BEFORE, _AFTER = 0.1, 0.8  # recorded before and after contact [s]
_PHASE_ONE = 0.030  # duration of Phase I [s]
_HELD = 0.35  # clamping force as a share of the peak
_NOISE, _OFFSET, _DRIFT = 0.4, 3.0, 1.0  # [N], [N], [N/s]
_BEYOND = 1.1  # what a censored impact would have reached, as a share of the device range
_COLUMNS = ColumnMap(time="time_ms", time_unit=TimeUnit.MILLISECONDS, force="force_N")


def write_example(name: str, folder: str | Path) -> Path:
    """Write an example campaign as it is before anything was evaluated: campaign.toml, plan.csv, raw recordings.

    The curves are half-sines (scenario unconstrained) or damped oscillations that settle (clamping), with the peaks
    of the example's impacts, noise, offset and drift.

    Raises
    ------
    UnknownName
        No example has the name.
    InputError
        The folder holds files already, or cannot be made.
    """
    target = copy_example(name, folder)
    dataset = read_dataset(target)
    conditions = read_conditions(target / CAMPAIGN_FILE)
    (target / TABLE_FILE).unlink()
    write_atomically(target / CAMPAIGN_FILE, campaign_text(conditions, _COLUMNS))
    plan = _plan(dataset)
    write_plan(plan, target)
    (target / RECORDINGS_FOLDER).mkdir()
    for i, name_of_run in enumerate(plan.recording.tolist()):
        rng = np.random.default_rng([zlib.crc32(name.encode()), i])
        force = float(dataset.peak_force[i])
        force = _BEYOND * dataset.device_range if dataset.censored[i] else force
        text = _text(_curve(force, dataset.scenario[i], dataset.device_range, rng))
        (target / RECORDINGS_FOLDER / f"{name_of_run}.csv").write_text(text, encoding="utf-8")
    return target


def _plan(dataset: ImpactDataset) -> MeasurementPlan:
    n = len(dataset)
    return MeasurementPlan(
        state_id=dataset.state,
        repeat=dataset.repeat,
        role=dataset.role,
        distance=dataset.distance,
        height=dataset.height,
        speed=dataset.speed,
        base_angle=np.full(n, np.nan),
        expected_force=np.full(n, np.nan),
    )


def _curve(peak: float, scenario: ContactScenario | None, device_range: float, rng: np.random.Generator) -> FloatArray:
    """What the device reads [N], in steps of 0.1 N and up to its range."""
    time = np.arange(round((_BEFORE + _AFTER) * _RATE)) / _RATE
    since = time - _BEFORE - rng.uniform(0, 1 / _RATE)
    turn = np.pi * np.clip(since, 0, None) / _PHASE_ONE
    if scenario is ContactScenario.WITH_CLAMPING:
        held = _HELD * (1 - np.exp(-2 * turn))
        swing = np.exp(-0.15 * turn) * np.sin(turn)
        shape = held + swing
        shape = np.maximum(shape, 0) / _highest(shape)
    else:
        shape = np.where(turn < np.pi, np.sin(turn), 0.0)
    read = peak * shape + _OFFSET * rng.uniform(-1, 1) + _DRIFT * rng.uniform(-1, 1) * time
    noisy: FloatArray = np.minimum(np.round(read + rng.normal(0, _NOISE, time.size), 1), device_range)
    return noisy


def _highest(shape: FloatArray) -> float:
    """The peak between samples: of the parabola through the three highest."""
    k = int(shape.argmax())
    a, b, c = shape[k - 1 : k + 2]
    return float(b + (a - c) ** 2 / (8 * (2 * b - a - c)))


def _text(force: FloatArray) -> str:
    lines = (f"{1000 * i / _RATE:.1f},{value:.1f}" for i, value in enumerate(force.tolist()))
    return "time_ms,force_N\n" + "\n".join(lines) + "\n"
