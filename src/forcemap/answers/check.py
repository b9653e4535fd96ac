"""Recordings held against a limit: what `check` prints, and what the page answers to a recording that is dropped."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Literal

from forcemap.answers.answer import Answer, Figure, Said, if_any, of
from forcemap.answers.impacts import Curve, ImpactFigures, RecordingAnswer, curves
from forcemap.limits.force_limits import ForceLimit, NewtonLimit
from forcemap.verdicts.recording_results import CheckedRecording, RecordingsCheck
from forcemap.verdicts.verdict import VerdictOutcome
from forcemap.words import sentence, sentences

NOT_PERMITTED = "not_permitted"


class JudgementAnswer(Answer):
    """An impact under one interpretation of the standard; the instant is after onset."""

    interpretation: str
    words: str = of("interpretation", "words")
    outcome: str
    force_N: float = of("force")
    limit_N: float = of("limit")
    margin_N: float = of("margin")
    margin_percent: float
    instant_s: float = of("instant")
    reason: Said


class CheckedImpact(ImpactFigures):
    """An impact with the verdict of the governing interpretation; without figures if no contact is permitted."""

    recording: str
    outcome: str
    interpretation: str | None
    force_N: Figure
    limit_N: Figure
    margin_N: Figure
    margin_percent: Figure
    instant_s: Figure
    reason: str
    device_error_N: float
    interpretations: list[JudgementAnswer]


class Unjudged(Answer):
    """A recording without a verdict, and why."""

    recording: str
    reason: str


class PressureAnswer(Answer):
    """The pressure of a recording beside its limit, in N/cm^2."""

    recording: str
    outcome: str
    pressure_N_per_cm2: float = of("pressure")
    limit_N_per_cm2: float = of("limit")
    contact: str
    reason: Said


class CheckAnswer(Answer):
    """Recordings held against a limit; the outcome is the gravest, warnings come before it, notes after it."""

    kind: Literal["recording"] = "recording"
    outcome: str
    reason: str
    file: str
    simulated: bool
    warnings: list[str]
    limit: str
    area: str
    transient_limit_N: Figure
    quasi_static_limit_N: Figure
    limit_source: str
    counts: dict[str, int]
    impacts: list[CheckedImpact]
    unjudged: list[Unjudged]
    excluded: list[Unjudged]
    recordings: list[RecordingAnswer]
    device_range_N: Figure
    device_range_stated: bool
    device_error_N: float
    notes: list[str]
    curves: list[Curve] | None = if_any()
    pressures: list[PressureAnswer] | None = if_any()

    @classmethod
    def of_check(cls, check: RecordingsCheck, *, notes: Iterable[str] = (), drawn: bool = False) -> CheckAnswer:
        """The answer for a check; `notes` come first among its notes, `drawn` adds the curve of every recording."""
        limit, device = check.limit, check.conditions.device
        area, source = (limit.name, str(limit)) if isinstance(limit, ForceLimit) else ("", "given by the user")
        transient, quasi_static = _newtons(limit)
        outcomes = [verdict.outcome for verdict in check.verdicts]
        unjudged = [(checked.name, sentence(checked.not_judged)) for checked in check.recordings if checked.not_judged]
        excluded = [(checked.name, checked.excluded) for checked in check.recordings if checked.excluded]
        counted = [checked for checked in check.recordings if not checked.excluded]
        recorded = [checked.recorded for checked in counted if checked.recorded]
        stated = not math.isnan(device.range)
        unstated = [] if stated else ["device range not stated: saturation was judged by the shape of the curves alone"]
        return cls(
            outcome=check.outcome or NOT_PERMITTED,
            reason=_reason(check),
            file=check.source,
            simulated=check.simulated,
            warnings=sentences(check.warnings),
            limit=limit_words(limit),
            area=area,
            transient_limit_N=transient,
            quasi_static_limit_N=quasi_static,
            limit_source=source,
            counts={outcome.value: outcomes.count(outcome) for outcome in VerdictOutcome} | {"unjudged": len(unjudged)},
            impacts=[impact for checked in counted for impact in _impacts(checked, check)],
            unjudged=[Unjudged(recording=name, reason=reason) for name, reason in unjudged],
            excluded=[Unjudged(recording=name, reason=reason) for name, reason in excluded],
            recordings=[RecordingAnswer.from_result(impacts.recording) for impacts in recorded],
            device_range_N=device.range,
            device_range_stated=stated,
            device_error_N=device.error_or_default,
            notes=[*notes, *unstated, *_without_pressure(check)],
            pressures=[
                PressureAnswer.from_result(checked.pressure, recording=checked.name)
                for checked in check.recordings
                if checked.pressure
            ]
            or None,
            curves=curves(recorded) if drawn else None,
        )


def _without_pressure(check: RecordingsCheck) -> list[str]:
    """That pressure is not assessed, or of how many recordings it is not."""
    without = sum(not checked.pressure for checked in check.recordings if not checked.excluded)
    if not check.pressures:
        return ["pressure is not assessed"]
    return [f"pressure is not assessed of {without} recordings"] if without else []


def limit_words(limit: ForceLimit | NewtonLimit) -> str:
    """The limits that a check uses, in words."""
    if isinstance(limit, ForceLimit) and not limit.permitted:
        return str(limit)
    if isinstance(limit, NewtonLimit) and limit.quasi_static is None:
        return f"{limit.force:g} N throughout"
    transient, quasi_static = _newtons(limit)
    given = f": {limit}" if isinstance(limit, ForceLimit) else ", given by the user"
    return f"{transient:g} N transient, {quasi_static:g} N quasi-static{given}"


def _newtons(limit: ForceLimit | NewtonLimit) -> tuple[float, float]:
    """Transient and quasi-static limit [N]; NaN where no contact is permitted."""
    if isinstance(limit, ForceLimit):
        return (limit.transient, limit.quasi_static) if limit.permitted else (math.nan, math.nan)
    return limit.force, limit.force if limit.quasi_static is None else limit.quasi_static


def _reason(check: RecordingsCheck) -> str:
    if not check.permitted:
        return _barred(check)
    gravest = max((v.governing for v in check.verdicts), key=lambda judgement: judgement.gravity, default=None)
    if gravest is not None and gravest.outcome is check.outcome:
        return sentence(gravest.reason)
    return next(
        (sentence(checked.not_judged) for checked in check.recordings if checked.not_judged), "nothing was judged"
    )


def _barred(check: RecordingsCheck) -> str:
    assert isinstance(check.limit, ForceLimit)
    return f"contact with {check.limit.name} is not permitted in {check.limit.edition}: no force is within a limit"


def _impacts(checked: CheckedRecording, check: RecordingsCheck) -> list[CheckedImpact]:
    if check.permitted:
        return [
            CheckedImpact.from_result(
                verdict.impact,
                recording=checked.name,
                **JudgementAnswer.from_result(verdict.governing).model_dump(exclude={"words"}),
                device_error_N=verdict.device_error,
                interpretations=verdict.judgements,
            )
            for verdict in checked.verdicts
        ]
    none = dict.fromkeys(("interpretation", "force_N", "limit_N", "margin_N", "margin_percent", "instant_s"))
    also = {"recording": checked.name, "outcome": NOT_PERMITTED, "reason": _barred(check), "interpretations": []}
    error = check.conditions.device.error_or_default
    impacts = checked.recorded.impacts if checked.recorded else ()
    return [CheckedImpact.from_result(impact, **none, **also, device_error_N=error) for impact in impacts]
