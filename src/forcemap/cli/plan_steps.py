"""forcemap plan --next, and what all plans write and print."""

from __future__ import annotations

import math
import shlex
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import typer

from forcemap import (
    PUBLISHED_MAPS,
    Campaign,
    Conditions,
    ConfirmationPlan,
    Contact,
    Expectation,
    ForceLimit,
    ImpactDataset,
    InputError,
    MeasurementPlan,
    NewtonLimit,
    NextMeasurements,
    campaign_text,
    extend_plan,
    floor_speed,
    next_measurements,
    read_campaign,
    read_dataset,
    run_sheet,
    write_plan,
)
from forcemap.arrays import Mask
from forcemap.cli.output import emit, table
from forcemap.files import write_atomically

SHEET = "run_sheet.txt"
_SHEET_WIDTH = 100


def go_on_measuring(
    folder: str,
    conditions: Conditions,
    limit: ForceLimit | NewtonLimit,
    contact: Contact | None,
    options: dict[str, Any],
    expectation: Expectation | None,
    *,
    again: str,
    as_json: bool,
) -> None:
    """Plan what to measure next, or say that it is time to stop (exit code 1).

    The runs of a campaign are added to its plan; those for a table without a plan are shown and written nowhere.
    `again` is the command that goes on.
    """
    if folder.lower().endswith(".json") or (folder in PUBLISHED_MAPS and not Path(folder).exists()):
        raise InputError(
            "found a map, expected a campaign folder or an impacts table: --next goes on from impacts; for a new "
            "campaign that expects the forces of a map, name a new folder and give the map with --map",
            file=folder,
        )
    campaign = read_campaign(folder) if Path(folder, "plan.csv").exists() else None
    table_alone = campaign is None and (Path(folder).is_file() or Path(folder, "impacts.csv").exists())
    measured = (
        _with_device(read_dataset(folder), conditions)
        if table_alone
        else conditions
        if campaign is None
        else _measured(campaign)
    )
    if campaign is not None:
        trained = campaign.plan.role == "train"
        for name, values in (("distances", campaign.plan.distance), ("heights", campaign.plan.height)):
            options = {name: (values[trained].min(), values[trained].max()), **options} if trained.any() else options
    found = next_measurements(measured, limit, contact=contact, expected_force=expectation, **options)
    files: list[str] = []
    if found.plan is not None and not table_alone:
        whole = found.plan if campaign is None else extend_plan(campaign.plan, found.plan)
        waiting = None if campaign is None else waiting_runs(campaign)
        notes = [found.upper_words]
        files = write_campaign(
            Path(folder), whole, found.plan, conditions, notes, upper=found.upper_force.tolist(), waiting=waiting
        )
    emit(_next_result(folder, found, files, again), _next_lines(folder, found, files, again), as_json=as_json)
    if found.plan is None:
        raise typer.Exit(1)


def waiting_runs(campaign: Campaign) -> MeasurementPlan | None:
    """The planned runs without a recording that is used: what was printed before is not lost."""
    missing = np.isin(campaign.plan.recording, campaign.missing)
    return runs_where(campaign.plan, missing) if missing.any() else None


def runs_where(plan: MeasurementPlan, mask: Mask) -> MeasurementPlan:
    """The runs of a plan that a mask picks."""
    columns: dict[str, Any] = {name: each[mask] for name, each in vars(plan).items() if isinstance(each, np.ndarray)}
    return replace(plan, **columns)


def write_campaign(
    target: Path,
    whole: MeasurementPlan,
    new: MeasurementPlan,
    conditions: Conditions,
    notes: Sequence[str] = (),
    *,
    upper: Sequence[float] = (),
    waiting: MeasurementPlan | None = None,
) -> list[str]:
    """Write a campaign's files, the sheet with the new runs and those that wait to be measured; their names."""
    wrapped = [line for note in notes for line in textwrap.wrap(note, _SHEET_WIDTH, subsequent_indent="    ")]
    sheet = [*wrapped, *run_sheet(new, conditions, upper_force=upper, waiting=waiting)]
    try:
        (target / "recordings").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder cannot be made ({error.strerror})", file=str(target)) from error
    files = ["plan.csv", SHEET]
    if not (target / "campaign.toml").exists():
        write_atomically(target / "campaign.toml", campaign_text(conditions))
        files.insert(0, "campaign.toml")
    write_atomically(target / SHEET, "\n".join(sheet) + "\n")
    write_plan(whole, target)
    return files


def run_results(plan: MeasurementPlan, upper: list[float] | None = None) -> list[dict[str, object]]:
    """The runs of a plan for JSON."""
    columns = {
        "recording": plan.recording,
        "state_id": plan.state_id,
        "repeat": plan.repeat,
        "role": plan.role,
        "distance_m": plan.distance,
        "height_m": plan.height,
        "speed_mps": plan.speed,
        "base_angle_deg": plan.base_angle,
        "expected_force_N": plan.expected_force,
    }
    lists = {name: column.tolist() for name, column in columns.items()}
    if upper is not None:
        lists["upper_force_N"] = upper
    return [dict(zip(lists, run, strict=True)) for run in zip(*lists.values(), strict=True)]


def _measured(campaign: Campaign) -> ImpactDataset | Conditions:
    """The impacts so far; every planned state to train or to confirm must be among them.

    One to train would be planned again, and the speed of one that confirms is that of the map before.
    """
    dataset = read_dataset(str(campaign.folder)) if campaign.table_file.exists() else None
    refuse_waiting(campaign, campaign.plan.role == "train", dataset, "planned states")
    confirming = ConfirmationPlan.among(campaign.plan)
    refuse_waiting(campaign, confirming, dataset, "states to confirm the map")
    return campaign.conditions if dataset is None else dataset


def _with_device(dataset: ImpactDataset, stated: Conditions) -> ImpactDataset:
    """A table that does not state its device, with the one that the options state."""
    device = stated.device
    if math.isnan(device.range) or not math.isnan(dataset.conditions.device.range):
        return dataset
    above = dataset.peak_force[~dataset.censored]
    if above.size and above.max() >= device.range:
        raise InputError(
            f"--device-range-N: found {device.range:g}, expected more than the {above.max():g} N that the table holds"
        )
    conditions = replace(dataset.conditions, device=device)
    return replace(dataset, conditions=conditions, device_range=float(np.fmin(device.range, dataset.device_range)))


def refuse_waiting(campaign: Campaign, runs: Mask, dataset: ImpactDataset | None, what: str) -> None:
    """Refuse to go on while states of the runs have no impact."""
    states = set() if dataset is None else set(dataset.state.tolist())
    waiting = [name for name in dict.fromkeys(campaign.plan.state_id[runs].tolist()) if name not in states]
    if waiting:
        raise InputError(
            f"{what} without an impact: {len(waiting)}, the first {waiting[0]}; measure them and run forcemap "
            "collect, or take their rows out of plan.csv",
            file=str(campaign.folder),
        )


def _next_result(folder: str, found: NextMeasurements, files: list[str], again: str) -> dict[str, Any]:
    return {
        "folder": folder,
        "files": files,
        "simulated": found.simulated,
        "stop": found.stop,
        "reason": found.reason,
        "places": found.places,
        "confirmed_places": found.confirmed,
        "mean_speed_mps": found.speed,
        "expected_confirmed_places": found.expected_confirmed,
        "expected_mean_speed_mps": found.expected_speed,
        "states": 0 if found.plan is None else len(found.plan.states),
        "runs": [] if found.plan is None else run_results(found.plan, found.upper_force.tolist()),
        "upper_force_is": found.upper_words,
        "warnings": [] if found.plan is None else list(found.plan.warnings),
        "next_command": again,
    }


def _next_lines(folder: str, found: NextMeasurements, files: list[str], again: str) -> list[str]:
    confirmed = f"{found.confirmed} of {found.places} places confirmed"
    confirmed += "" if math.isnan(found.speed) else f", mean speed {floor_speed(found.speed)} m/s"
    simulated = ["SIMULATED impacts"] if found.simulated else []
    if found.plan is None:
        return [*simulated, f"Stop ({found.stop}): {found.reason}", confirmed]
    expected = f"{found.expected_confirmed} expected after these, mean speed {floor_speed(found.expected_speed)} m/s"
    return [
        *simulated,
        f"{len(found.plan.states)} states to measure next, slow to fast ({found.reason})",
        f"{confirmed}; {expected}" if not math.isnan(found.expected_speed) else confirmed,
        *(f"WARNING: {warning}" for warning in found.plan.warnings),
        "",
        *runs_table(found.plan, found.upper_force.tolist(), "at most [N]"),
        found.upper_words,
        "",
        *_after_next(folder, files, again),
    ]


def _after_next(folder: str, files: list[str], again: str) -> list[str]:
    """What to do with the states."""
    if files:
        return [f"Written to {folder}: {', '.join(files)}", *go_on_lines(folder, again)]
    table_file = str(Path(folder, "impacts.csv")) if Path(folder).is_dir() else folder
    return [
        "Nothing written: there is no plan.csv, and forcemap collect would replace the table by new recordings alone",
        f"Next: measure these states, add a row for each impact to {table_file}, then",
        f"  {again}",
    ]


def go_on_lines(folder: str, again: str) -> list[str]:
    """The way from a printed sheet to the next answer."""
    return [
        "Next:",
        f"  1. print {folder}/{SHEET} and measure; save each file in {folder}/recordings under the name it says",
        f"  2. forcemap collect {shlex.quote(folder)}",
        f"  3. {again}",
    ]


def runs_table(plan: MeasurementPlan, upper: list[float], title: str) -> list[str]:
    """A line a state."""
    rows = {
        name: (f"{d:.3f}", f"{h:.3f}", f"{v:.3f}", f"{force:.1f}", f"{most:.1f}")
        for name, d, h, v, force, most in zip(
            plan.state_id.tolist(), plan.distance, plan.height, plan.speed, plan.expected_force, upper, strict=True
        )
    }
    return table(["state", "d [m]", "h [m]", "v [m/s]", "expected [N]", title], [[n, *r] for n, r in rows.items()])
