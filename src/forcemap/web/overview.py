"""The campaigns of a folder at a glance: state, last measurement, what is permitted, what is missing or due."""

from __future__ import annotations

from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from pydantic import Field

import forcemap as fm
from forcemap.answers.answer import Answer
from forcemap.assessment.fleet import due
from forcemap.campaigns.not_stated import not_stated
from forcemap.campaigns.protocol import read_protocol
from forcemap.campaigns.recordings_table import Use
from forcemap.web.campaign_answers import dataset_doubt, problem_words
from forcemap.web.fitted_campaign import fitted_campaign, impacts_of
from forcemap.web.folder import Folder
from forcemap.web.headline import Case, headline
from forcemap.web.limits import limits_of
from forcemap.web.question import Area
from forcemap.words import sentences


class CampaignLine(Answer):
    """A campaign in the overview; `state` is ready, measuring, refused or empty, `case` of transient contact.

    `not_stated` entries are missing before signing; contact points are counted as listed, not judged.
    """

    name: str
    state: str = "empty"
    robot: str = ""
    tool: str = ""
    direction: str = ""
    simulated: bool = False
    planned_runs: int = 0
    missing_runs: int = 0
    recordings: int = 0
    used: int = 0
    states: int = 0
    map: str = ""
    case: Case | None = None
    last_measured: str = ""
    date_stated: bool = False
    due: list[str] = Field(default_factory=list)
    not_stated: int = 0
    contact_points: int = 0
    contact_points_problem: str = ""
    problem: str = ""


class Overview(Answer):
    """The campaigns in the folder that is served, and the body area of all; empty if each campaign's own is taken."""

    area: str
    campaigns: list[CampaignLine]


def overview(folder: Folder, table: fm.LimitTable | None, question: Area) -> Overview:
    """All campaigns; a problem of one stands in its line."""
    lines = [_line(folder, name, question, table) for name in folder.campaigns()]
    return Overview(area=question.area, campaigns=lines)


def _line(folder: Folder, name: str, question: Area, table: fm.LimitTable | None) -> CampaignLine:
    figures: dict[str, Any] = {"name": name, "due": []}
    try:
        path = folder.campaign(name)
        conditions = fm.Conditions()
        if (path / "campaign.toml").exists():
            conditions = fm.read_conditions(path / "campaign.toml")
            figures |= {key: getattr(conditions, key) for key in ("robot", "tool", "direction", "simulated")}
            figures["not_stated"] = len(not_stated(conditions, read_protocol(path / "campaign.toml")))
            figures["due"] = [] if conditions.simulated else sentences(due(conditions, datetime.now(UTC).date()))
        limits = limits_of(path, table)
        figures |= {"contact_points": limits.points, "contact_points_problem": limits.points_problem}
        measured = _measured(path, conditions)
        measured["due"] = [*measured.get("due", []), *figures["due"]]
        figures |= measured | {"state": "measuring" if measured.get("recordings") else "empty"}
        dataset = impacts_of(path)
        figures |= {"states": len(dataset.states), "simulated": dataset.simulated, "problem": dataset_doubt(dataset)}
        force_map = fitted_campaign(path).force_map
        figures["map"] = f"{force_map.form.name}, {len(force_map.require_fit().states)} states"
        asked = Area.model_validate(limits.otherwise | ({"area": question.area} if question.area else {}))
        found = headline(name, path, asked, limits, points=False)
        case = next((case for case in found.cases if case.contact == fm.Contact.TRANSIENT), None)
        figures |= {"case": case, "problem": figures["problem"] or found.problem}
        if dataset.no_speed or found.problem or (case and case.state == "contradicted"):
            figures["state"] = "refused"
        elif not figures.get("missing_runs"):
            figures["state"] = "ready"
    except fm.ForcemapError as error:
        figures["problem"] = problem_words(error)
    return CampaignLine(**figures)


def _measured(path: Path, conditions: fm.Conditions) -> dict[str, Any]:
    """Runs done, and when the last one was measured: as it is stated, else the date of the newest file."""
    recordings = path / "recordings"
    times = [file.stat().st_mtime for file in recordings.rglob("*") if file.is_file()] if recordings.is_dir() else []
    newest = date.fromtimestamp(max(times)).isoformat() if times else ""
    found: dict[str, Any] = {"last_measured": conditions.date or newest, "date_stated": bool(conditions.date)}
    if (path / "plan.csv").exists():
        campaign = fm.read_campaign(path)
        registered = {entry.file for entry in campaign.entries}
        waiting = sum(file not in registered for file in campaign.files())
        found |= {"planned_runs": len(campaign.plan), "missing_runs": len(campaign.missing)}
        found |= {"recordings": len(campaign.entries)}
        found["used"] = sum(entry.use is Use.USED for entry in campaign.entries)
        found["due"] = [
            *([f"{len(campaign.missing)} runs to measure"] if campaign.missing else []),
            *([f"{waiting} recordings to collect"] if waiting else []),
        ]
    return found
