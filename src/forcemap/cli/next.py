"""forcemap next."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Argument, Option

import forcemap as fm
from forcemap.answers.plan import NextAnswer
from forcemap.assessment.folder import read_recorded
from forcemap.assessment.folder_map import folder_map
from forcemap.cli import planned
from forcemap.cli.options import (
    ContactKind,
    DeviceSpring,
    FormName,
    Json,
    Limit,
    bound_from,
    force_map_from,
    limit_from,
    wanted_form,
)
from forcemap.cli.output import counted, emit, listing, verdict_first
from forcemap.cli.task_options import figures
from forcemap.planning.confirm import ConfirmationPlan
from forcemap.planning.runs import extend_plan
from forcemap.words import sentence, sentences

_BATCH = 4
"""States at a time, if not stated; a choice: about an hour's work by the times that `plan` assumes."""

_REPEATS = 3
"""Repeats of a state, if not stated; a choice: as of `plan`."""

_Budget = Annotated[
    int | None,
    Option(
        "--states",
        help="Budget: states of the whole campaign, at which to stop; if not given, it goes on as long as there is "
        "something to gain.",
    ),
]
_LargestForce = Annotated[
    float | None, Option("--largest-force-N", help="No impact is to exceed it, nor the device's range.")
]


def next_(
    folder: Annotated[str, Argument(help="Campaign folder, a new one too; or an impacts table.")],
    limit: Limit = None,
    contact: ContactKind = None,
    distances: planned.Distances = None,
    heights: planned.Heights = None,
    speeds: Annotated[
        str | None,
        Option("--speeds-mps", help="Slowest and fastest speed; else 0.05 and the fastest planned, or 0.40."),
    ] = None,
    states: _Budget = None,
    batch: Annotated[int, Option("--batch", help="States at a time.")] = _BATCH,
    repeats: planned.Repeats = _REPEATS,
    largest_force: _LargestForce = None,
    device_range: planned.DeviceRange = None,
    device_spring: DeviceSpring = None,
    expect: planned.Expect = None,
    form: FormName = None,
    dry_run: planned.DryRun = False,
    as_json: Json = False,
) -> int:
    """Add the states to measure next for a limit to a campaign's plan, from nothing on; exit code 1 is time to stop.

    Example: forcemap next new-cell --area back_of_hand --contact transient --distances-m 0.52,0.89
    --heights-m 0.14,0.46 --moving-mass-kg 30 --device-range-N 500 --device-spring-N-per-mm 75
    """
    _require_no_map(folder)
    mass, source = planned.expected_of(expect)
    conditions = planned.conditions_of(folder, device_range, device_spring, mass)
    force_limit, kind = limit_from(limit, contact, source=folder)
    campaign = fm.read_campaign(folder) if Path(folder, "plan.csv").exists() else None
    measured = _table(folder, conditions) if campaign is None else _measured(campaign)
    table_alone = campaign is None and isinstance(measured, fm.ImpactDataset)  # runs for it are shown, not written
    ranges = {"distances": distances, "heights": heights, "speeds": speeds}
    options: dict[str, Any] = {} if largest_force is None else {"largest_force": largest_force}
    options |= _planned_ranges(campaign) if campaign else {}
    options |= {name: figures(name, text) for name, text in ranges.items() if text is not None}
    options |= {"batch": batch, "states": states, "repeats": repeats, "form": wanted_form(form)}
    expected = force_map_from(source, None)[0] if source else None
    answer = fm.next_measurements(measured, force_limit, contact=kind, expected_force=expected, **options)
    answer = _with_confirmed(answer, campaign, measured, force_limit, kind)
    campaign, taken = _without_early_confirmation(campaign, measured, answer)
    files = [] if table_alone or dry_run else _written(folder, campaign, answer, conditions)
    repeated = {
        **planned.limit_words(limit, contact),
        "--distances-m": distances,
        "--heights-m": heights,
        "--speeds-mps": speeds,
        "--states": states,
        "--batch": None if batch == _BATCH else batch,
        "--largest-force-N": largest_force,
        "--form": form,
        "--repeats": None if repeats == _REPEATS else repeats,
        "--map": source,
    }
    if table_alone:
        repeated |= {"--device-range-N": device_range, "--device-spring-N-per-mm": device_spring}
    again = planned.command_line("next", folder, repeated)
    now = planned.command_line("speed-map", folder, planned.limit_words(limit, contact) | {"--form": form})
    asked = planned.unwritten_lines(again) if dry_run and not table_alone else None
    before = listing("No longer planned: slow impacts come first, and may take speeds away", taken) if taken else []
    lines = _lines(folder, answer, [*before, *(asked or _measuring(folder, files, again))], now)
    emit(NextAnswer.of_next(answer, folder, files, again), lines, as_json=as_json)
    return 1 if answer.plan is None else 0


def _require_no_map(folder: str) -> None:
    """Raise InputError for a map: there is nothing to go on from."""
    if folder.lower().endswith(".json") or (folder in fm.PUBLISHED_MAPS and not Path(folder).exists()):
        raise fm.InputError(
            "found a map, expected a campaign folder or an impacts table: next goes on from impacts; for a new "
            "campaign that expects the forces of a map, name a new folder and give the map with --map",
            file=folder,
        )


def _planned_ranges(campaign: fm.Campaign) -> dict[str, tuple[float, float]]:
    """The ranges of distances and heights of the states to train; empty if none is planned."""
    plan, trained = campaign.plan, campaign.plan.role == "train"
    if not trained.any():
        return {}
    axes = {"distances": plan.distance[trained], "heights": plan.height[trained]}
    return {name: (float(values.min()), float(values.max())) for name, values in axes.items()}


def _written(
    folder: str, campaign: fm.Campaign | None, answer: fm.NextMeasurements, conditions: fm.Conditions
) -> list[str]:
    """Write the next runs into the campaign's plan and sheet; the names of the files, none if it is time to stop."""
    if answer.plan is None:
        return []
    return planned.write_campaign(
        Path(folder),
        answer.plan if campaign is None else extend_plan(campaign.plan, answer.plan),
        answer.plan,
        conditions,
        [sentence(answer.upper_is)],
        upper=answer.upper_force.tolist(),
        waiting=planned.waiting_runs(campaign) if campaign else None,
    )


def _table(folder: str, conditions: fm.Conditions) -> fm.ImpactDataset | fm.Conditions:
    """An impacts table that is no campaign; the conditions of a new campaign if there is none."""
    if Path(folder).is_file() or Path(folder, "impacts.csv").exists():
        return _with_device(read_recorded(folder), conditions)
    return conditions


def _measured(campaign: fm.Campaign) -> fm.ImpactDataset | fm.Conditions:
    """The impacts so far; every planned state to train must be among them: it would be planned again."""
    dataset = read_recorded(str(campaign.folder)) if campaign.table_file.exists() else None
    planned.refuse_waiting(campaign, campaign.plan.role == "train", dataset, "planned states")
    return campaign.conditions if dataset is None else dataset


def _without_early_confirmation(
    campaign: fm.Campaign | None, measured: fm.ImpactDataset | fm.Conditions, answer: fm.NextMeasurements
) -> tuple[fm.Campaign | None, list[str]]:
    """The campaign without runs to confirm its map, none of them measured, where slow impacts come first; these runs.

    Other ones without an impact are refused: the speed of one that confirms is that of the map before.
    """
    if campaign is None:
        return None, []
    confirming, dataset = ConfirmationPlan.among(campaign.plan), measured
    states = set() if isinstance(dataset, fm.Conditions) else set(dataset.state.tolist())
    none = states.isdisjoint(campaign.plan.state_id[confirming].tolist())
    slow = any(reason.kind is fm.FindingKind.SLOW_PLANNED for reason in answer.reasons)
    names = set(campaign.plan.recording[confirming].tolist())
    none &= names.isdisjoint(path.stem for path in campaign.recordings.rglob("*"))  # nor waits to be collected
    if names and none and slow:
        plan = campaign.plan.select(~confirming)
        return replace(campaign, plan=plan), campaign.plan.recording[confirming].tolist()
    of_table = None if isinstance(dataset, fm.Conditions) else dataset
    planned.refuse_waiting(campaign, confirming, of_table, "states to confirm the map")
    return campaign, []


def _with_confirmed(
    answer: fm.NextMeasurements,
    campaign: fm.Campaign | None,
    measured: fm.ImpactDataset | fm.Conditions,
    limit: fm.ForceLimit | fm.NewtonLimit,
    contact: fm.Contact | None,
) -> fm.NextMeasurements:
    """The answer, which says first that the map is confirmed as it is, if so: one of more states is not."""
    if answer.plan is None or campaign is None or isinstance(measured, fm.Conditions):
        return answer
    if not ConfirmationPlan.among(campaign.plan).any():
        return answer
    force_map = folder_map(campaign.folder, measured).force_map
    told = force_map.confirmed and force_map.confirmed(limit, contact, bound_from(force_map))
    if told is None or told.kind is not fm.FindingKind.CONFIRMED_BY:
        return answer
    return replace(answer, warnings=(fm.Finding.of(fm.FindingKind.CONFIRMED_NO_LONGER, told), *answer.warnings))


def _with_device(dataset: fm.ImpactDataset, stated: fm.Conditions) -> fm.ImpactDataset:
    """A table with the device that the options state, if it states none itself."""
    device = stated.device
    if math.isnan(device.range) or not math.isnan(dataset.conditions.device.range):
        return dataset
    above = dataset.peak_force[~dataset.censored]
    if above.size and above.max() >= device.range:
        raise fm.InputError(
            f"--device-range-N: found {device.range:g}, expected more than the {above.max():g} N that the table holds"
        )
    conditions = replace(dataset.conditions, device=device)
    return replace(dataset, conditions=conditions, device_range=float(np.fmin(device.range, dataset.device_range)))


def _lines(folder: str, answer: fm.NextMeasurements, then: list[str], now: str) -> list[str]:
    why = "; ".join(sentences(answer.reasons))
    confirmed = sentence(answer.progress)
    said: dict[str, Any] = {"doubts": sentences(answer.warnings), "simulated": answer.simulated}
    if answer.plan is None:
        return [*verdict_first(f"Stop ({answer.stop}): {why}", **said), confirmed, *sentences(answer.within)]
    return [
        *verdict_first(f"{counted(len(answer.plan.states), 'state')} to measure next, slow to fast", **said),
        f"why: {why}",
        planned.time_words(answer.plan),
        confirmed,
        *(_may_stop(now) if answer.confirmed and not answer.needs_more else []),
        *sentences(answer.within),
        "",
        *planned.runs_table(answer.plan, answer.upper_force.tolist()),
        sentence(answer.upper_is),
        "",
        *then,
    ]


def _measuring(folder: str, files: list[str], again: str) -> list[str]:
    """The way on from what was written; from a table alone, which nothing is written into."""
    if files:
        return planned.measuring_lines(folder, files, again)
    table_file = str(Path(folder, "impacts.csv")) if Path(folder).is_dir() else folder
    return [
        "Nothing written: there is no plan.csv, and forcemap collect would replace the table by new recordings alone",
        f"Next: measure these states, add a row for each impact to {table_file}, then",
        *planned.command_lines(again),
    ]


def _may_stop(speeds_now: str) -> list[str]:
    """That nothing has to be measured for the speeds that there are, and what is for one place alone."""
    return [
        "you may stop here, if that is not worth the time: leave these states out of plan.csv; the speeds "
        "that there are now hold without them",
        *planned.command_lines(speeds_now, "    "),
        "they may raise speeds, and lower them where they show more force than expected; for a speed at one place "
        "alone, measure at that place (docs/contact_points.md)",
    ]
