"""forcemap simulate."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Argument, Option

import forcemap as fm
from forcemap.answers.simulation import SimulationAnswer
from forcemap.cli.options import Json
from forcemap.cli.output import emit
from forcemap.maps.direction import direction_vector

_PRESETS = "ur10e-like, iiwa7-like-30nm, iiwa7-like-10nm"


def simulate(
    plan: Annotated[str, Argument(help="Plan (CSV), or a campaign folder that holds one.")],
    preset: Annotated[str, Option("--preset", help=f"Virtual robot: {_PRESETS}.")],
    folder: Annotated[
        str | None, Option("-o", "--folder", help="New folder; default: beside the plan, named for the preset.")
    ] = None,
    seed: Annotated[int, Option("--seed", help="The same seed gives the same files.")] = 1,
    threshold: Annotated[
        float | None, Option("--threshold-Nm", help="Another safety setting: external joint torque.")
    ] = None,
    payload: Annotated[float | None, Option("--payload-kg", help="A payload at the flange.")] = None,
    cover: Annotated[
        float | None, Option("--cover-N-per-m", help="A protective cover with this spring constant.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Simulate the recordings of a planned campaign in the virtual lab, into a new folder. Nothing of it is measured.

    The direction is the one that campaign.toml states beside the plan, else straight down.

    Example: forcemap simulate my-campaign --preset ur10e-like
    """
    from forcemap.lab.simulated_campaign import simulate_campaign
    from forcemap.lab.simulated_device import PAPER_DEVICE, SimulatedDevice
    from forcemap.lab.virtual_robot import virtual_robot

    robot = virtual_robot(preset)
    robot = robot if threshold is None else robot.with_threshold(threshold)
    robot = robot if payload is None else robot.with_payload(payload)
    robot = robot if cover is None else robot.with_cover(cover)
    if seed < 0:
        raise fm.InputError(f"seed: found {seed}, expected a whole number of at least 0")
    toml = (Path(plan) if Path(plan).is_dir() else Path(plan).parent) / "campaign.toml"
    conditions = fm.read_conditions(toml) if toml.exists() else fm.Conditions()
    tolerance = fm.StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)
    runs = fm.read_plan(plan, tolerance=tolerance)
    name = Path(plan).resolve()
    target = Path(folder) if folder else name.with_name(f"{name.stem if name.is_file() else name.name}-{preset}")
    stated = {key: value for key, value in vars(conditions.device).items() if value == value and value != ""}
    device = SimulatedDevice(device=dataclasses.replace(PAPER_DEVICE, **stated))
    along = direction_vector(conditions.direction, whose=str(toml)) if conditions.direction else None
    rng = np.random.default_rng(seed)
    simulated = simulate_campaign(runs, robot, device, rng, target, conditions=conditions, along=along)
    peaks, scenarios = simulated.impacts.peak_force, sorted({str(scenario) for scenario in simulated.impacts.scenario})
    answer = SimulationAnswer(
        folder=str(target),
        preset=preset,
        changes=robot.changes,
        recordings=len(simulated.recording),
        lowest_peak_force_N=peaks.min(),
        highest_peak_force_N=peaks.max(),
        beyond_device_range=int(np.sum(peaks >= device.device.range)),
        scenarios=scenarios,
        seed=seed,
    )
    lines = [
        f"SIMULATED with {', '.join([preset, *robot.changes])}: not a measurement of any robot",
        f"{len(simulated.recording)} recordings in {target}, peaks {peaks.min():.0f} to {peaks.max():.0f} N, "
        f"{answer.beyond_device_range} at or above the device range of {device.device.range:g} N; "
        f"{', '.join(scenarios).replace('_', ' ')}",
        "truth.csv holds the true peaks; nothing of the evaluation reads it",
        f"Next: forcemap collect {target}",
    ]
    emit(answer, lines, as_json=as_json)
