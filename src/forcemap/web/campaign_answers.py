"""A campaign with its states, recordings and what is missing."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from pydantic import Field

import forcemap as fm
from forcemap.answers.answer import Answer, Figure, PlannedState, Said, of
from forcemap.answers.collect import Outlier
from forcemap.campaigns.recordings_table import Entry, Use
from forcemap.impacts.scenario import ContactScenario
from forcemap.web.fitted_campaign import impacts_of
from forcemap.words import sentence, sentences


class StateProgress(PlannedState):
    """A planned state and its repeats."""

    planned: int
    used: int
    missing: list[str]
    force_N: Figure


class RecordingLine(Answer):
    """A recording and what became of it."""

    recording: str = of("name")
    file: str
    state_id: str
    repeat: int
    use: str
    reason: str
    scenario: str
    peak_force_N: Figure = of("peak_force")
    phase2_force_N: Figure = of("phase2_force")
    flags: str


class Condition(Answer):
    """An entry of campaign.toml."""

    entry: str
    value: str


class CampaignAnswer(Answer):
    """A campaign: conditions, states done and missing, recordings; what cannot be read is said in `problem`."""

    name: str
    simulated: bool = False
    conditions: tuple[Condition, ...] = ()
    not_stated: tuple[str, ...] = ()
    planned: bool
    states: tuple[StateProgress, ...] = ()
    states_done: int = 0
    missing: tuple[str, ...] = ()
    recordings: tuple[RecordingLine, ...] = ()
    used: int = 0
    not_collected: tuple[str, ...] = ()
    flags: dict[str, int] = Field(default_factory=dict)
    phase_two: Said = ""
    repeatability_sd_percent: Figure = None
    outliers: tuple[str, ...] = ()
    problem: str = ""


def dataset_doubt(dataset: fm.ImpactDataset) -> str:
    """Why these impacts give no speed, or what every speed of them says first; empty if there is no doubt."""
    if dataset.no_speed:
        return f"No speed will be given: {sentence(dataset.no_speed)}"
    return "; ".join(sentences([dataset.binding.reason or "", *dataset.contradictions])).strip("; ")


def campaign_answer(name: str, path: Path) -> CampaignAnswer:
    """A campaign as its folder states it."""
    planned = (path / "plan.csv").exists()
    try:
        content = _planned(path) if planned else _table_only(path)
    except fm.ForcemapError as error:
        content = {"problem": problem_words(error)}
    return CampaignAnswer(name=name, planned=planned, **content)


def _planned(path: Path) -> dict[str, Any]:
    campaign = fm.read_campaign(path)
    registered = {entry.file for entry in campaign.entries}
    forces: dict[str, float] = {}
    content: dict[str, Any] = {
        "simulated": campaign.conditions.simulated,
        "conditions": _conditions(campaign.conditions),
        "missing": campaign.missing,
        "recordings": [recording_line(entry) for entry in campaign.entries],
        "used": _used(campaign).total(),
        "not_collected": [file for file in campaign.files() if file not in registered],
    }
    try:
        dataset = impacts_of(path)
        summary = fm.campaign_summary(campaign, dataset)
        forces = dict(zip(dataset.states.name, dataset.states.force.tolist(), strict=True))
        outliers = [Outlier.from_result(repeat) for repeat in fm.repeatability(dataset).outliers]
        content |= _measured(dataset) | {
            "flags": summary.flags,
            "not_stated": summary.not_stated,
            "outliers": [outlier.words for outlier in outliers],
        }
    except fm.ForcemapError as error:
        content |= {"problem": problem_words(error), "phase_two": _clamping(campaign)}
    states = _states(campaign, forces)
    return content | {"states": states, "states_done": sum(not state.missing for state in states)}


def _clamping(campaign: fm.Campaign) -> str:
    """How many recordings clamp of which none is used; empty if none does."""
    clamping = sum(entry.scenario is ContactScenario.WITH_CLAMPING for entry in campaign.entries)
    return f"{clamping} of {len(campaign.entries)} recordings clamp" if clamping else ""


def recording_line(entry: Entry) -> RecordingLine:
    """A recording as it is registered."""
    return RecordingLine.from_result(entry, scenario=entry.scenario.words if entry.scenario else "")


def _measured(dataset: fm.ImpactDataset) -> dict[str, Any]:
    return {
        "simulated": dataset.simulated,
        "problem": dataset_doubt(dataset),
        "phase_two": dataset.phase_two.finding,
        "repeatability_sd_percent": fm.repeatability(dataset).mean_sd_percent,
    }


def _table_only(path: Path) -> dict[str, Any]:
    dataset = impacts_of(path)
    states = dataset.as_stated.states
    role = dict(zip(dataset.state.tolist(), dataset.role.tolist(), strict=True))
    impacts = states.impacts + states.censored
    return _measured(dataset) | {
        "conditions": _conditions(dataset.conditions),
        "states_done": len(states),
        "states": StateProgress.of_columns(
            state_id=states.name,
            role=[role[name] for name in states.name],
            distance_m=states.distance,
            height_m=states.height,
            speed_mps=states.speed,
            planned=impacts,
            used=impacts,
            missing=[()] * len(states),
            force_N=states.force,
        ),
    }


def _states(campaign: fm.Campaign, forces: dict[str, float]) -> list[StateProgress]:
    plan, names, lacking, used = campaign.plan, campaign.plan.states, set(campaign.missing), _used(campaign)
    first, recording = [plan.first_row[name] for name in names], plan.recording
    runs = [recording[plan.state_id == name].tolist() for name in names]
    missing = [[run for run in of_state if run in lacking] for of_state in runs]
    return StateProgress.of_columns(
        state_id=names,
        role=plan.role[first],
        distance_m=plan.distance[first],
        height_m=plan.height[first],
        speed_mps=plan.speed[first],
        planned=map(len, runs),
        used=[used[name] for name in names],
        missing=missing,
        force_N=map(forces.get, names),
    )


def _used(campaign: fm.Campaign) -> Counter[str]:
    """How many recordings of each state are used."""
    return Counter(entry.state_id for entry in campaign.entries if entry.use is Use.USED)


def _conditions(conditions: fm.Conditions) -> list[Condition]:
    return [
        Condition(entry=f"{section}.{key}".rstrip("."), value=str(value))
        for section, entries in conditions.to_tables().items()
        for key, value in (entries.items() if isinstance(entries, dict) else [("", entries)])
    ]


def problem_words(error: fm.ForcemapError) -> str:
    """An error in one line, naming its file without the folder."""
    row = "" if error.row is None else f"row {error.row}"
    column = f"column {error.column}" if error.column else ""
    where = ", ".join(filter(None, (Path(error.file or "").name, row, column)))
    return f"{where}: {error.message}" if where else error.message
