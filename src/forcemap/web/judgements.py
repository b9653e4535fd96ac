"""A file of a device, or an impacts table, judged at once."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from forcemap import (
    Conditions,
    ContactNotPermitted,
    ForceLimit,
    ForcemapError,
    Impact,
    Recording,
    Verdict,
    check_impact,
    check_map,
    find_impacts,
    fit_force_map,
    map_accuracy,
    no_impact,
    read_campaign_file,
    read_dataset,
    read_recordings,
    repeatability,
)
from forcemap.arrays import Indices
from forcemap.web.held import fitted
from forcemap.web.limits import Limits
from forcemap.web.map_answers import AccuracyAnswer, accuracy_answer
from forcemap.web.numbers import number, numbers
from forcemap.web.question import Area

_DRAWN = 1500  # samples of a curve that are drawn, its extremes among them
_DRAWN_OF_ALL = 15_000  # of all curves of a file
_VERDICTS = ("exceeded", "not_permitted", "cannot_tell", "within")  # gravest first


class JudgementAnswer(BaseModel):
    """An impact under one interpretation of the standard."""

    interpretation: str
    words: str
    outcome: str
    force_N: float
    limit_N: float
    margin_N: float
    instant_s: float
    reason: str


class ImpactAnswer(BaseModel):
    """An impact with its figures, flags and verdict; times after onset unless they say otherwise."""

    number: int
    onset_s: float
    peak_force_N: float
    raw_peak_force_N: float
    peak_time_s: float
    phase1_end_s: float
    phase2_force_N: float | None
    contact_duration_s: float
    contact_over: bool
    scenario: str
    scenario_words: str
    flags: list[str]
    verdict: str
    verdict_reason: str
    interpretations: list[JudgementAnswer]


class Curve(BaseModel):
    """Contact force over time [s], thinned to what can be drawn with its extremes kept."""

    time_s: list[float]
    force_N: list[float]


class RecordingAnswer(BaseModel):
    """One recording, its impacts and its curve."""

    recording: str
    samples: int
    duration_s: float
    sampling_rate_Hz: float
    notes: list[str]
    problem: str
    impacts: list[ImpactAnswer]
    curve: Curve


class FileAnswer(BaseModel):
    """A file of recordings, judged; the verdict is the gravest of its impacts, notes say what it leaves open."""

    kind: Literal["recording"] = "recording"
    file: str
    sha256: str
    simulated: bool
    verdict: str
    area: str
    transient_limit_N: float | None
    quasi_static_limit_N: float | None
    limit_source: str
    device_range_N: float | None
    notes: list[str]
    recordings: list[RecordingAnswer]


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
    """True if the names of an impacts table's columns stand at the beginning of a file."""
    with path.open("rb") as stream:
        return b"peak_force_N" in stream.read(4000)


def file_answer(path: Path, name: str, campaign: Path, question: Area, limits: Limits) -> FileAnswer:
    """A file of recordings, read as its campaign says and called by a name.

    Raises
    ------
    RecordingError
        Anything in the file that could be read wrongly.
    """
    described = campaign / "campaign.toml"
    conditions, columns = read_campaign_file(described) if described.exists() else (Conditions(), None)
    limit = limits.of(question.area)
    recordings = read_recordings(path, columns=columns, device=conditions.device)
    if conditions.date:
        date = {"date": conditions.date}
        recordings = [dataclasses.replace(each, metadata={**each.metadata, **date}) for each in recordings]
    drawn = min(_DRAWN, max(2, _DRAWN_OF_ALL // len(recordings)))
    answers = [_recording(each, name, limit, conditions.channel_frequency_class, drawn) for each in recordings]
    unstated = "device range not stated: saturation was judged by the shape of the curves alone"
    notes = [unstated] if math.isnan(conditions.device.range) else []
    verdicts = {impact.verdict for each in answers for impact in each.impacts}
    if any(not each.impacts for each in answers):
        verdicts.add("cannot_tell")
    return FileAnswer(
        file=name,
        sha256=recordings[0].sha256,
        simulated=conditions.simulated or any(each.simulated for each in recordings),
        verdict=next(each for each in _VERDICTS if each in verdicts),
        area=limit.name,
        transient_limit_N=limit.transient if limit.permitted else None,
        quasi_static_limit_N=limit.quasi_static if limit.permitted else None,
        limit_source=str(limit),
        device_range_N=number(conditions.device.range),
        notes=[*_head_words(limit), *limits.statements, *notes, "pressure is not assessed"],
        recordings=answers,
    )


def _head_words(limit: ForceLimit) -> list[str]:
    return [limit.head_statement] if limit.head_statement else []


def table_answer(path: Path, name: str, campaign: Path) -> TableAnswer:
    """An impacts table measured under the conditions of a campaign.

    Raises
    ------
    TableError
        Anything in the table that cannot be used.
    """
    dataset = read_dataset(path)
    words, accuracy = "", []
    try:
        force_map = fit_force_map(dataset)
        words = f"{force_map.form.name} can be fitted to {len(force_map.require_fit().states)} states"
        accuracy = [accuracy_answer(each) for each in map_accuracy(force_map, dataset)]
    except ForcemapError as error:
        words = f"no map: {error.message}"
    try:
        check = check_map(fitted(campaign).force_map, dataset)
        against, reason = check.outcome.value.replace("_", " "), f"{check.reason}; {check.next_step}"
    except ForcemapError as error:
        against, reason = "cannot tell", error.message
    return TableAnswer(
        file=name,
        simulated=dataset.simulated,
        impacts=len(dataset),
        states=len(dataset.states),
        censored=int(dataset.censored.sum()),
        map=words,
        accuracy=accuracy,
        outliers=[
            f"{each.state} repeat {each.repeat}: {each.force:.1f} N, {each.deviation:+.1f} N from the others"
            for each in repeatability(dataset).outliers
        ],
        against_campaign=against,
        against_reason=reason,
    )


def _recording(
    recording: Recording, name: str, limit: ForceLimit, frequency_class: float, drawn: int
) -> RecordingAnswer:
    impacts = find_impacts(recording, channel_frequency_class=frequency_class)
    contact = impacts[0].contact if impacts else None
    if contact is not None:
        time, force = contact.time, contact.force
    else:
        force = recording.force if recording.force.ndim == 1 else np.linalg.norm(recording.force, axis=1)
        time = recording.time
    kept = _drawn(force, drawn)
    return RecordingAnswer(
        recording=f"{name}#{recording.curve}" if recording.curve else name,
        samples=recording.samples,
        duration_s=recording.duration,
        sampling_rate_Hz=recording.sampling_rate,
        notes=list(recording.notes),
        problem="" if impacts else no_impact(recording),
        impacts=[_impact(each, limit) for each in impacts],
        curve=Curve(time_s=numbers(time[kept], 5), force_N=numbers(force[kept], 2)),
    )


def _impact(impact: Impact, limit: ForceLimit) -> ImpactAnswer:
    verdict: Verdict | None = None
    try:
        verdict = check_impact(impact, limit)
        outcome, reason = verdict.outcome.value, verdict.governing.reason
    except ContactNotPermitted as error:
        outcome, reason = "not_permitted", error.message
    return ImpactAnswer(
        number=impact.number,
        onset_s=impact.onset,
        peak_force_N=impact.peak_force,
        raw_peak_force_N=impact.raw_peak_force,
        peak_time_s=impact.peak_time - impact.onset,
        phase1_end_s=impact.phase1_end - impact.onset,
        phase2_force_N=number(impact.phase2_force),
        contact_duration_s=impact.contact_duration,
        contact_over=impact.contact_over,
        scenario=impact.scenario.value,
        scenario_words=impact.scenario.words,
        flags=[str(flag) for flag in impact.flags],
        verdict=outcome,
        verdict_reason=reason,
        interpretations=[] if verdict is None else [_judgement(each) for each in verdict.judgements],
    )


def _judgement(each: Any) -> JudgementAnswer:
    return JudgementAnswer(
        interpretation=each.interpretation.value,
        words=each.interpretation.words,
        outcome=each.outcome.value,
        force_N=each.force,
        limit_N=each.limit,
        margin_N=each.margin,
        instant_s=each.instant,
        reason=each.reason,
    )


def _drawn(force: NDArray[Any], most: int) -> Indices:
    """Indices of the samples to draw: the lowest and the highest of each of equal stretches, and both ends."""
    if force.size <= most:
        return np.arange(force.size)
    edges = np.linspace(0, force.size, most // 2 + 1).astype(np.int64)
    lowest = [start + np.argmin(force[start:stop]) for start, stop in pairwise(edges)]
    highest = [start + np.argmax(force[start:stop]) for start, stop in pairwise(edges)]
    return np.unique([0, *lowest, *highest, force.size - 1])
