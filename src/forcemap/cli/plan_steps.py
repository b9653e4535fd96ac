"""forcemap plan --next and --confirm, and what all plans write and print."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import typer

from forcemap import (
    Campaign,
    Conditions,
    ConfirmationPlan,
    Contact,
    Expectation,
    ForceLimit,
    ImpactDataset,
    InputError,
    MeasurementPlan,
    NextMeasurements,
    campaign_text,
    confirm_plan,
    extend_plan,
    floor_speed,
    next_measurements,
    read_campaign,
    read_dataset,
    run_sheet,
    write_plan,
)
from forcemap.cli.options import bound_from, force_map_from
from forcemap.cli.output import emit, table
from forcemap.files import write_atomically

SHEET = "run_sheet.txt"


def go_on_measuring(
    folder: str,
    conditions: Conditions,
    limit: ForceLimit | float,
    contact: Contact | None,
    options: dict[str, Any],
    expectation: Expectation | None,
    *,
    as_json: bool,
) -> None:
    """Plan what to measure next, or say that it is time to stop (exit code 1).

    The runs of a campaign are added to its plan; those for a table without a plan are shown and written nowhere.
    """
    campaign = read_campaign(folder) if Path(folder, "plan.csv").exists() else None
    table_alone = campaign is None and (Path(folder).is_file() or Path(folder, "impacts.csv").exists())
    measured = read_dataset(folder) if table_alone else conditions if campaign is None else _measured(campaign)
    if campaign is not None:
        trained = campaign.plan.role == "train"
        for name, values in (("distances", campaign.plan.distance), ("heights", campaign.plan.height)):
            options = {name: (values[trained].min(), values[trained].max()), **options} if trained.any() else options
    found = next_measurements(measured, limit, contact=contact, expected_force=expectation, **options)
    files: list[str] = []
    if found.plan is not None and not table_alone:
        whole = found.plan if campaign is None else extend_plan(campaign.plan, found.plan)
        files = write_campaign(Path(folder), whole, found.plan, conditions)
    emit(_next_result(folder, found, files), _next_lines(folder, found, files), as_json=as_json)
    if found.plan is None:
        raise typer.Exit(1)


def confirm_released(
    source: str, limit: ForceLimit | float, contact: Contact | None, impacts: int, form: str | None, *, as_json: bool
) -> None:
    """Plan impacts at the released speeds; those of a campaign are added to its plan."""
    force_map = force_map_from(source, form)[0]
    bound = bound_from(force_map, None, None, None, None)
    found = confirm_plan(force_map, limit, bound=bound, contact=contact, impacts=impacts)
    files: list[str] = []
    if Path(source, "plan.csv").exists():
        campaign = read_campaign(source)
        files = write_campaign(
            Path(source), extend_plan(campaign.plan, found.plan), found.plan, campaign.conditions, [found.rule]
        )
    result = {
        "source": source,
        "files": files,
        "simulated": force_map.simulated,
        "limit_N": found.limit,
        "bound": bound.describe(),
        "rule": found.rule,
        "not_passed_probability": found.not_passed,
        "above_bound_probability": found.above_bound,
        "found_probability_10_percent": found.found,
        "runs": run_results(found.plan, found.bound_force.tolist()),
    }
    emit(result, _confirm_lines(source, found, files, simulated=force_map.simulated), as_json=as_json)


def write_campaign(
    target: Path, whole: MeasurementPlan, new: MeasurementPlan, conditions: Conditions, notes: list[str] | None = None
) -> list[str]:
    """Write a campaign's files, the sheet with the new runs only; their names."""
    sheet = [*(notes or []), *run_sheet(new, conditions)]
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
    """The impacts so far; every planned state to train must be among them, for it would be planned again."""
    dataset = read_dataset(str(campaign.folder)) if campaign.table_file.exists() else None
    states = set() if dataset is None else set(dataset.state.tolist())
    planned = zip(campaign.plan.state_id.tolist(), campaign.plan.role.tolist(), strict=True)
    waiting = list(dict.fromkeys(name for name, role in planned if role == "train" and name not in states))
    if waiting:
        raise InputError(
            f"planned states without an impact: {len(waiting)}, the first {waiting[0]}; measure them and run forcemap "
            "collect, or take their rows out of plan.csv",
            file=str(campaign.folder),
        )
    return campaign.conditions if dataset is None else dataset


def _next_result(folder: str, found: NextMeasurements, files: list[str]) -> dict[str, Any]:
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
    }


def _next_lines(folder: str, found: NextMeasurements, files: list[str]) -> list[str]:
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
        "",
        *_runs_table(found.plan, found.upper_force.tolist(), "at most [N]"),
        "",
        *(
            [
                f"Written to {folder}: {', '.join(files)}",
                f"Next: measure, then forcemap collect {folder}, then forcemap plan --next {folder} again",
            ]
            if files
            else ["Nothing written: this is no campaign with a plan"]
        ),
    ]


def _confirm_lines(source: str, found: ConfirmationPlan, files: list[str], *, simulated: bool) -> list[str]:
    chances = (
        [
            f"A sound map does not pass with a probability of {100 * found.not_passed:.0f} % "
            f"({100 * found.above_bound:.0f} %: above the bound); a force 10 % higher, {100 * found.found:.0f} %"
        ]
        if not math.isnan(found.not_passed)
        else ["How often a sound map does not pass is not known: the map has no measured states"]
    )
    return [
        *(["SIMULATED impacts"] if simulated else []),
        f"{len(found.plan)} impacts at the released speeds, slow to fast",
        "",
        *_runs_table(found.plan, found.bound_force.tolist(), "bound [N]"),
        "",
        f"Rule: {found.rule}",
        *chances,
        f"Written to {source}: {', '.join(files)}"
        if files
        else "Nothing written: the source is no campaign with a plan",
    ]


def _runs_table(plan: MeasurementPlan, upper: list[float], title: str) -> list[str]:
    """A line a state."""
    rows = {
        name: (f"{d:.3f}", f"{h:.3f}", f"{v:.3f}", f"{force:.1f}", f"{most:.1f}")
        for name, d, h, v, force, most in zip(
            plan.state_id.tolist(), plan.distance, plan.height, plan.speed, plan.expected_force, upper, strict=True
        )
    }
    return table(["state", "d [m]", "h [m]", "v [m/s]", "expected [N]", title], [[n, *r] for n, r in rows.items()])
