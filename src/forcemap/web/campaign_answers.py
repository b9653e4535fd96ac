"""Campaigns at a glance, and one with its states, recordings and what is missing."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from forcemap import (
    Campaign,
    ForcemapError,
    ImpactDataset,
    Use,
    campaign_summary,
    read_campaign,
    read_conditions,
    repeatability,
)
from forcemap.web.folder import Folder
from forcemap.web.held import fitted, impacts_of
from forcemap.web.numbers import number


class StateProgress(BaseModel):
    """A planned state and its repeats."""

    state_id: str
    role: str
    distance_m: float
    height_m: float
    speed_mps: float
    planned: int
    used: int
    missing: list[str]
    force_N: float | None


class RecordingLine(BaseModel):
    """A recording and what became of it."""

    recording: str
    file: str
    state_id: str
    repeat: int
    use: str
    reason: str
    scenario: str
    peak_force_N: float | None
    phase2_force_N: float | None
    flags: str


class CampaignLine(BaseModel):
    """A campaign in the overview."""

    name: str
    robot: str
    tool: str
    simulated: bool
    planned_runs: int
    missing_runs: int
    recordings: int
    used: int
    states: int
    map: str
    problem: str


class Overview(BaseModel):
    """The campaigns in the folder that is served."""

    campaigns: list[CampaignLine]


class Condition(BaseModel):
    """An entry of campaign.toml."""

    entry: str
    value: str


class CampaignAnswer(BaseModel):
    """A campaign: conditions, states done and missing, recordings."""

    name: str
    simulated: bool
    conditions: list[Condition]
    not_stated: list[str]
    planned: bool
    states: list[StateProgress]
    states_done: int
    missing: list[str]
    recordings: list[RecordingLine]
    used: int
    not_collected: list[str]
    flags: dict[str, int]
    phase_two: str
    repeatability_sd_percent: float | None
    outliers: list[str]
    problem: str


def overview(folder: Folder) -> Overview:
    """All campaigns; what is wrong with one is said in its line."""
    return Overview(campaigns=[_line(folder, name) for name in folder.campaigns()])


def _line(folder: Folder, name: str) -> CampaignLine:
    figures: dict[str, Any] = dict.fromkeys(("planned_runs", "missing_runs", "recordings", "used", "states"), 0)
    figures |= {"name": name, "robot": "", "tool": "", "simulated": False, "map": "", "problem": ""}
    try:
        path = folder.campaign(name)
        if (path / "campaign.toml").exists():
            conditions = read_conditions(path / "campaign.toml")
            figures |= {"robot": conditions.robot, "tool": conditions.tool, "simulated": conditions.simulated}
        if (path / "plan.csv").exists():
            campaign = read_campaign(path)
            used = sum(entry.use is Use.USED for entry in campaign.entries)
            figures |= {"planned_runs": len(campaign.plan), "missing_runs": len(campaign.missing)}
            figures |= {"recordings": len(campaign.entries), "used": used}
        dataset = impacts_of(path)
        figures |= {"states": len(dataset.states), "simulated": dataset.simulated, "problem": _doubt(dataset)}
        force_map = fitted(path).force_map
        figures["map"] = f"{force_map.form.name}, {len(force_map.require_fit().states)} states"
    except ForcemapError as error:
        figures["problem"] = problem_words(error)
    return CampaignLine(**figures)


def _doubt(dataset: ImpactDataset) -> str:
    """What every speed of these impacts will say first, or why there will be none; empty if nothing."""
    if dataset.binding.refusal:
        return f"No speed will be given: {dataset.binding.refusal}"
    if math.isnan(dataset.conditions.device.stiffness):
        return "No speed will be given for a body area: the device's spring (stiffness_N_per_m) is not stated"
    return dataset.binding.reason


def campaign_answer(name: str, path: Path) -> CampaignAnswer:
    """A campaign as its folder states it; what cannot be read is said in `problem`."""
    answer = CampaignAnswer(
        name=name,
        simulated=False,
        conditions=[],
        not_stated=[],
        planned=(path / "plan.csv").exists(),
        states=[],
        states_done=0,
        missing=[],
        recordings=[],
        used=0,
        not_collected=[],
        flags={},
        phase_two="",
        repeatability_sd_percent=None,
        outliers=[],
        problem="",
    )
    try:
        return answer.model_copy(update=_planned(path) if answer.planned else _table_only(path))
    except ForcemapError as error:
        return answer.model_copy(update={"problem": problem_words(error)})


def _planned(path: Path) -> dict[str, Any]:
    campaign = read_campaign(path)
    missing = campaign.missing
    registered = {entry.file for entry in campaign.entries}
    found: dict[str, Any] = {
        "simulated": campaign.conditions.simulated,
        "conditions": _conditions(campaign.conditions),
        "states": _states(campaign, {}),
        "missing": missing,
        "recordings": [_recording(entry) for entry in campaign.entries],
        "used": sum(entry.use is Use.USED for entry in campaign.entries),
        "not_collected": [file for file in campaign.files() if file not in registered],
    }
    try:
        dataset = impacts_of(path)
        summary, scatter = campaign_summary(campaign, dataset), repeatability(dataset)
        forces = dict(zip(dataset.states.name, dataset.states.force.tolist(), strict=True))
        found |= {
            "simulated": dataset.simulated,
            "problem": _doubt(dataset),
            "states": _states(campaign, forces),
            "flags": summary.flags,
            "not_stated": list(summary.not_stated),
            "phase_two": summary.phase_two.statement(),
            "repeatability_sd_percent": number(scatter.mean_sd_percent),
            "outliers": [
                f"{each.recording or each.state} repeat {each.repeat}: {each.force:.1f} N, {each.deviation:+.1f} N "
                "from the others; look at the recording"
                for each in scatter.outliers
            ],
        }
    except ForcemapError as error:
        found["problem"] = problem_words(error)
    found["states_done"] = sum(not state.missing for state in found["states"])
    return found


def _table_only(path: Path) -> dict[str, Any]:
    dataset = impacts_of(path)
    states = dataset.states
    role = dict(zip(dataset.state.tolist(), dataset.role.tolist(), strict=True))
    figures = (states.distance, states.height, states.speed, states.force, states.impacts + states.censored)
    return {
        "simulated": dataset.simulated,
        "problem": _doubt(dataset),
        "conditions": _conditions(dataset.conditions),
        "phase_two": dataset.phase_two.statement(),
        "repeatability_sd_percent": number(repeatability(dataset).mean_sd_percent),
        "states_done": len(states),
        "states": [
            StateProgress(
                state_id=name,
                role=role[name],
                distance_m=d,
                height_m=h,
                speed_mps=v,
                planned=n,
                used=n,
                missing=[],
                force_N=number(f),
            )
            for name, d, h, v, f, n in zip(states.name, *(figure.tolist() for figure in figures), strict=True)
        ],
    }


def _states(campaign: Campaign, forces: dict[str, float]) -> list[StateProgress]:
    plan = campaign.plan
    missing = set(campaign.missing)
    used = [entry.state_id for entry in campaign.entries if entry.use is Use.USED]
    states: dict[str, StateProgress] = {}
    columns = (plan.state_id, plan.role, plan.distance, plan.height, plan.speed, plan.recording)
    for name, role, d, h, v, recording in zip(*(column.tolist() for column in columns), strict=True):
        state = states.setdefault(
            name,
            StateProgress(
                state_id=name,
                role=role,
                distance_m=d,
                height_m=h,
                speed_mps=v,
                planned=0,
                used=0,
                missing=[],
                force_N=number(forces.get(name, float("nan"))),
            ),
        )
        state.planned += 1
        if recording in missing:
            state.missing.append(recording)
    for name in used:
        if name in states:
            states[name].used += 1
    return list(states.values())


def _recording(entry: Any) -> RecordingLine:
    return RecordingLine(
        recording=entry.name,
        file=entry.file,
        state_id=entry.state_id,
        repeat=entry.repeat,
        use=entry.use.value,
        reason=entry.reason,
        scenario=entry.scenario.words if entry.scenario else "",
        peak_force_N=number(entry.peak_force),
        phase2_force_N=number(entry.phase2_force),
        flags=entry.flags,
    )


def _conditions(conditions: Any) -> list[Condition]:
    lines = []
    for section, entries in conditions.to_tables().items():
        inner = entries.items() if isinstance(entries, dict) else [("", entries)]
        lines += [Condition(entry=f"{section}.{key}".rstrip("."), value=str(value)) for key, value in inner]
    return lines


def problem_words(error: ForcemapError) -> str:
    """An error in a line, its file by its name alone."""
    where = [Path(error.file).name] if error.file else []
    where += [f"row {error.row}"] if error.row is not None else []
    where += [f"column {error.column}"] if error.column else []
    return ": ".join([", ".join(where), error.message] if where else [error.message])
