"""A file of a device, or an impacts table, judged at once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel

import forcemap as fm
from forcemap.answers.accuracy import AccuracyAnswer
from forcemap.answers.answer import Answer
from forcemap.answers.check import CheckAnswer
from forcemap.answers.collect import Outlier
from forcemap.answers.impacts import Curve, ImpactFigures, RecordingAnswer, curves
from forcemap.campaigns.conditions import read_campaign_file
from forcemap.campaigns.recorded_impacts import recorded_impacts
from forcemap.findings import Finding
from forcemap.recordings.column_map import ColumnMap
from forcemap.verdicts.recording_results import recording_doubt
from forcemap.web.fitted_campaign import fitted_campaign
from forcemap.web.limits import Limits
from forcemap.web.question import Area
from forcemap.words import sentences

_HEADER_BYTES = 4000
"""Where the column names of a table must stand; a choice, several times a header with all columns and notes."""


class MeasuredImpact(ImpactFigures):
    """An impact that is held against no limit."""

    recording: str


class MeasuredAnswer(Answer):
    """A file of recordings with its curves, held against no limit: nobody chose a body area."""

    kind: Literal["measured"] = "measured"
    file: str
    simulated: bool
    impacts: list[MeasuredImpact]
    recordings: list[RecordingAnswer]
    curves: list[Curve]


class TableAnswer(BaseModel):
    """An impacts table, judged: what a map of it would be worth, and whether the campaign's map holds for it."""

    kind: Literal["table"] = "table"
    file: str
    simulated: bool
    impacts: int
    states: int
    censored: int
    map: str
    accuracy: list[AccuracyAnswer]
    outliers: list[str]
    against_campaign: str
    against_reason: str


def is_table(path: Path) -> bool:
    """True if a text file begins with the column names of an impacts table."""
    if path.suffix == ".tdms":
        return False
    with path.open("rb") as stream:
        return b"peak_force_N" in stream.read(_HEADER_BYTES)


def file_answer(
    path: Path,
    name: str,
    campaign: Path,
    question: Area,
    limits: Limits,
    *,
    columns: ColumnMap | None = None,
    curve: str = "",
    doubt: Finding | None = None,
    drawn: bool = False,
) -> CheckAnswer:
    """A file of recordings, read as its campaign says and called by a name; with its curves where they are drawn.

    `columns` says how it is read if not as the campaign says; `curve` names the one recording of several that is
    judged; `doubt` is what is known against it besides what is said against the whole campaign.

    Raises
    ------
    RecordingError
        Anything in the file that could be read wrongly.
    """
    conditions, of_campaign = _stated(campaign)
    limit, read_by = limits.of(question.area), columns or of_campaign
    known = doubt or recording_doubt(campaign)
    check = fm.check_file(path, limit, conditions=conditions, columns=read_by, name=name, doubt=known)
    if curve in (found := [each.name for each in check.recordings]):
        check = replace(check, recordings=(check.recordings[found.index(curve)],))
    return CheckAnswer.of_check(check, notes=limits.statements, drawn=drawn)


def read_answer(
    path: Path,
    name: str,
    campaign: Path,
    question: Area,
    limits: Limits,
    *,
    columns: ColumnMap | None = None,
    curve: str = "",
    **judged: Any,
) -> CheckAnswer | MeasuredAnswer:
    """The same, without a verdict where nobody chose a body area."""
    if question.area or limits.areas:
        return file_answer(path, name, campaign, question, limits, columns=columns, curve=curve, **judged)
    conditions, of_campaign = _stated(campaign)
    recorded = recorded_impacts(path, conditions, columns or of_campaign, name=name)
    recorded = [each for each in recorded if each.recording.name == curve] or recorded
    return MeasuredAnswer(
        file=name,
        simulated=conditions.simulated or any(each.recording.simulated for each in recorded),
        impacts=[
            MeasuredImpact.from_result(impact, recording=each.recording.name)
            for each in recorded
            for impact in each.impacts
        ],
        recordings=[RecordingAnswer.from_result(each.recording) for each in recorded],
        curves=curves(recorded),
    )


def _stated(campaign: Path) -> tuple[fm.Conditions, ColumnMap | None]:
    """What campaign.toml states, and how it reads files, if there is one."""
    stated = campaign / "campaign.toml"
    return read_campaign_file(stated) if stated.exists() else (fm.Conditions(), None)


def table_answer(path: Path, name: str, campaign: Path) -> TableAnswer:
    """An impacts table measured under the conditions of a campaign.

    Raises
    ------
    TableError
        Anything in the table that cannot be used.
    """
    dataset = fm.read_dataset(path)
    words, accuracy = "", []
    try:
        force_map = fm.fit_force_map(dataset)
        words = f"{force_map.form.name} can be fitted to {len(force_map.require_fit().states)} states"
        accuracy = [AccuracyAnswer.from_result(result) for result in fm.map_accuracy(force_map, dataset)]
    except fm.ForcemapError as error:
        words = f"no map: {error.message}"
    try:
        check = fm.check_map(fitted_campaign(campaign).force_map, dataset)
        against, reason = check.outcome.value.replace("_", " "), "; ".join(sentences([check.reason, check.next_step]))
    except fm.ForcemapError as error:
        against, reason = "cannot tell", error.message
    return TableAnswer(
        file=name,
        simulated=dataset.simulated,
        impacts=len(dataset),
        states=len(dataset.states),
        censored=int(dataset.censored.sum()),
        map=words,
        accuracy=accuracy,
        outliers=[Outlier.from_result(repeat).words for repeat in fm.repeatability(dataset).outliers],
        against_campaign=against,
        against_reason=reason,
    )
