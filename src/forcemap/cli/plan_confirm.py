"""forcemap plan --confirm: the impacts that are to confirm a map, and whether they do."""

from __future__ import annotations

import math
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import typer

from forcemap import (
    Campaign,
    ConfirmationPlan,
    Contact,
    Entry,
    ForceLimit,
    ForceMap,
    ForcemapError,
    NewtonLimit,
    Use,
    VerdictOutcome,
    check_impact,
    confirm_plan,
    extend_plan,
    find_impacts,
    read_campaign,
    read_dataset,
    read_recordings,
)
from forcemap.cli.options import bound_from, force_map_from
from forcemap.cli.output import emit, listing, table
from forcemap.cli.plan_steps import (
    go_on_lines,
    refuse_waiting,
    run_results,
    runs_table,
    runs_where,
    waiting_runs,
    write_campaign,
)

_EXIT = {"passes": 0, "does_not_pass": 1, "cannot_tell": 2}
_WITHIN = {VerdictOutcome.WITHIN: True, VerdictOutcome.EXCEEDED: False, VerdictOutcome.CANNOT_TELL: None}
_NO_CAMPAIGN = "Next: measure more, slower states: forcemap plan --next tells which, for a campaign folder"
_GRAVITY = (VerdictOutcome.WITHIN, VerdictOutcome.CANNOT_TELL, VerdictOutcome.EXCEEDED)


def confirm_released(
    source: str,
    limit: ForceLimit | NewtonLimit,
    contact: Contact | None,
    impacts: int | None,
    form: str | None,
    *,
    again: str,
    go_on: str,
    as_json: bool,
) -> None:
    """Plan impacts at the released speeds and add them to a campaign's plan; once measured, judge them.

    `again` is this command, `go_on` the one that measures more. Exit code: 0 planned, or passes; 1 does not pass, or
    no speed is released; 2 cannot tell.
    """
    force_map = force_map_from(source, form)[0]
    bound = bound_from(force_map, None, None, None, None)
    campaign = read_campaign(source) if Path(source, "plan.csv").exists() else None
    files: list[str] = []
    planned = campaign.plan if campaign else None
    found = confirm_plan(force_map, limit, bound=bound, contact=contact, impacts=impacts, planned=planned)
    if campaign is not None:
        dataset = read_dataset(source)
        refuse_waiting(campaign, campaign.plan.role == "train", dataset, "planned states")
        found = found.judged(dataset, _checked(campaign, limit, contact))
        if len(found.added) or (len(found.plan) and found.result is None and not found.refusal):
            files = _written(campaign, found)
    lines = _lines(source, found, files, again, go_on, simulated=force_map.simulated)
    emit(_result(source, found, files, again, force_map), lines, as_json=as_json)
    if found.result is not None:
        raise typer.Exit(_EXIT[found.result.outcome.value])
    if found.refusal:
        raise typer.Exit(1)


def _written(campaign: Campaign, found: ConfirmationPlan) -> list[str]:
    """Write the plan with the added runs, and the sheet with all that wait to be measured."""
    whole = extend_plan(campaign.plan, found.added) if len(found.added) else campaign.plan
    waiting = waiting_runs(campaign)
    if waiting is not None:
        waiting = runs_where(waiting, ~np.isin(waiting.recording, found.plan.recording))
    unmeasured = np.isin(found.plan.recording, [*campaign.missing, *found.added.recording.tolist()])
    return write_campaign(
        campaign.folder,
        whole,
        runs_where(found.plan, unmeasured),
        campaign.conditions,
        [f"Rule: {found.rule}", f"at most: {found.bound}"],
        upper=found.bound_force[unmeasured].tolist(),
        waiting=waiting,
    )


def _checked(
    campaign: Campaign, limit: ForceLimit | NewtonLimit, contact: Contact | None
) -> dict[str, tuple[bool | None, str]]:
    """Whether the recordings of confirming runs are within the limit (as `forcemap check`), and why."""
    confirming = ConfirmationPlan.among(campaign.plan)
    states = set(campaign.plan.state_id[confirming].tolist())
    runs = {name.lower(): name for name in campaign.plan.recording[confirming].tolist()}
    checked: dict[str, tuple[bool | None, str]] = {}
    for entry in campaign.entries:
        run = runs.get(PurePosixPath(entry.file).stem.lower()) or runs.get(entry.curve.lower())
        if entry.use is Use.USED and entry.state_id in states:
            checked[entry.name] = _checked_recording(campaign, entry, limit, contact)
        elif entry.use is not Use.USED and (run or entry.state_id in states):
            checked[run or f"{entry.state_id}-r{entry.repeat}"] = (None, f"{entry.use}: {entry.reason}")
    return checked


def _checked_recording(
    campaign: Campaign, entry: Entry, limit: ForceLimit | NewtonLimit, contact: Contact | None
) -> tuple[bool | None, str]:
    path, device = campaign.recordings / entry.file, campaign.conditions.device
    try:
        recordings = read_recordings(path, columns=campaign.columns, device=device)
    except ForcemapError as error:
        return None, str(error)
    verdicts = [
        check_impact(impact, limit, contact=contact)
        for recording in recordings
        if recording.curve == entry.curve and recording.sha256 == entry.sha256
        for impact in find_impacts(recording)
    ]
    if not verdicts:
        return None, "the file has changed since it was registered; run forcemap collect"
    worst = max(verdicts, key=lambda verdict: _GRAVITY.index(verdict.outcome))
    return _WITHIN[worst.outcome], worst.governing.reason


def _result(source: str, found: ConfirmationPlan, files: list[str], again: str, force_map: ForceMap) -> dict[str, Any]:
    result = found.result
    return {
        "source": source,
        "files": files,
        "simulated": force_map.simulated,
        "outcome": None if result is None else result.outcome.value,
        "reason": found.refusal if result is None else result.reason,
        "impacts": []
        if result is None
        else [
            {
                "recording": each.recording,
                "state_id": each.state,
                "distance_m": each.distance,
                "height_m": each.height,
                "speed_mps": each.speed,
                "peak_force_N": each.force,
                "bound_force_N": each.bound_force,
                "outcome": each.outcome.value,
                "reason": each.reason,
            }
            for each in result.impacts
        ],
        "missing": found.plan.recording.tolist() if result is None else list(result.missing),
        "limit_N": found.limit,
        "bound": found.bound.describe(),
        "rule": found.rule,
        "warnings": list(found.warnings),
        "not_passed_probability": found.not_passed,
        "above_bound_probability": found.above_bound,
        "found_probability_10_percent": found.found,
        "runs": run_results(found.plan, found.bound_force.tolist()),
        "next_command": again,
    }


def _lines(
    source: str, found: ConfirmationPlan, files: list[str], again: str, go_on: str, *, simulated: bool
) -> list[str]:
    head = ["SIMULATED impacts"] if simulated else []
    if found.result is not None:
        return [*head, *_judged_lines(source, found, files, again, go_on)]
    if found.refusal:
        measure = "Next: measure more, slower states; this tells which:"
        return [*head, found.refusal, *([measure, f"  {go_on}"] if Path(source).is_dir() else [_NO_CAMPAIGN])]
    chances = (
        [
            f"A sound map does not pass with a probability of {100 * found.not_passed:.0f} % "
            f"({100 * found.above_bound:.0f} %: above the bound); a force 10 % higher, {100 * found.found:.0f} %"
        ]
        if not math.isnan(found.not_passed)
        else ["How often a sound map does not pass is not known: the map has no measured states"]
    )
    planned = "" if len(found.added) else ", planned before and not measured yet"
    return [
        *head,
        f"{len(found.plan)} impacts at the released speeds, slow to fast{planned}",
        *(f"WARNING: {warning}" for warning in found.warnings),
        "",
        *runs_table(found.plan, found.bound_force.tolist(), "at most [N]"),
        f"at most: {found.bound}",
        "",
        f"Rule: {found.rule}",
        *chances,
        *(
            [f"Written to {source}: {', '.join(files)}", *go_on_lines(source, again)]
            if files
            else ["Nothing written: the source is no campaign with a plan"]
        ),
    ]


def _judged_lines(source: str, found: ConfirmationPlan, files: list[str], again: str, go_on: str) -> list[str]:
    """What the measured impacts say."""
    result = found.result
    assert result is not None
    rows = [
        [
            each.state,
            f"{each.distance:.3f}",
            f"{each.height:.3f}",
            f"{each.speed:.3f}",
            "-" if math.isnan(each.force) else f"{each.force:.1f}",
            f"{each.bound_force:.1f}",
            each.outcome.words,
        ]
        for each in result.impacts
    ]
    doubts = [f"{each.recording}: {each.reason}" for each in result.impacts if each.outcome.value != "passes"]
    after = {
        "passes": [],
        "does_not_pass": ["Next: measure more; this tells the states:", f"  {go_on}"],
        "cannot_tell": go_on_lines(source, again),
    }[result.outcome.value]
    return [
        f"{result.outcome.words.upper()}: {result.reason}",
        *(f"WARNING: {warning}" for warning in found.warnings),
        "",
        *table(["state", "d [m]", "h [m]", "v [m/s]", "force [N]", "bound [N]", "outcome"], rows),
        *(listing("Why", doubts) if doubts else []),
        *(listing("Not measured yet", result.missing) if result.missing else []),
        "",
        f"Rule: {found.rule}",
        f"bound: {found.bound}",
        *([f"Written to {source}: {', '.join(files)}"] if files else []),
        *after,
    ]
