"""forcemap check and inspect: impacts and verdicts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Argument, Option

import forcemap as fm
from forcemap.answers.check import CheckAnswer, CheckedImpact, JudgementAnswer, Unjudged
from forcemap.answers.impacts import InspectAnswer
from forcemap.arrays import FloatArray
from forcemap.campaigns.recorded_impacts import RecordedImpacts, recorded_impacts
from forcemap.cli.column_options import (
    CampaignOption,
    Columns,
    DeviceError,
    DeviceRange,
    FrequencyClass,
    campaign_of,
    described,
)
from forcemap.cli.options import DeviceSpring, Json, Limit, LimitSpring, QuasiStaticN, limit_from
from forcemap.cli.output import Progress, counted, emit, listing, table, verdict_first
from forcemap.errors import few
from forcemap.impacts.impact import TRANSIENT_TIME, Quality
from forcemap.impacts.quality import UNKNOWN_PEAK
from forcemap.verdicts.recording_results import recording_doubt
from forcemap.words import NAMED_FROM


def check(
    source: Annotated[str, Argument(help="A file of recordings, or a campaign folder.")],
    limit: Limit = None,
    quasi_static: QuasiStaticN = None,
    limit_spring: LimitSpring = None,
    contact: Annotated[
        fm.Contact | None,
        Option("--contact", help="quasi-static: that limit for all of the contact; with --limit-N which it is."),
    ] = None,
    interpretation: Annotated[
        fm.Interpretation | None,
        Option("--interpretation", help="The interpretation that governs; default: the strictest."),
    ] = None,
    campaign: CampaignOption = None,
    column: Columns = None,
    device_range: DeviceRange = None,
    device_error: DeviceError = None,
    device_spring: DeviceSpring = None,
    frequency_class: FrequencyClass = None,
    as_json: Json = False,
) -> int:
    """Check impacts against the limits of a body area, under every interpretation of the standard.

    Exit code: 0 within, 1 exceeded or not permitted, 2 cannot tell.

    Example: forcemap check run7.csv --area back_of_hand --device-range-N 500
    """
    force_limit, _ = limit_from(
        limit, contact, quasi_static, limit_spring, source=campaign or source, contact_needed=False
    )
    conditions, columns = described(
        source, campaign, column, device_range, device_error, frequency_class, device_spring
    )
    judged_by: dict[str, Any] = {"interpretation": interpretation, "contact": contact}
    if Path(source).is_dir():
        whole = replace(fm.read_campaign(source), conditions=conditions, columns=columns)
        with Progress("checked", len(whole.files())) as progress:
            result = fm.check_campaign(whole, force_limit, **judged_by, progress=lambda done, _: progress.show(done))
    else:
        folder = campaign_of(source, campaign)
        doubt = recording_doubt(folder, source) if folder and not column else None
        judged_by |= {"doubt": doubt, "folder": folder}
        result = fm.check_file(source, force_limit, conditions=conditions, columns=columns, **judged_by)
    answer = CheckAnswer.of_check(result)
    emit(answer, check_lines(answer), as_json=as_json)
    return 1 if result.outcome is None else EXIT_CODES[result.outcome]


EXIT_CODES = {fm.VerdictOutcome.WITHIN: 0, fm.VerdictOutcome.EXCEEDED: 1, fm.VerdictOutcome.CANNOT_TELL: 2}


def inspect(
    file: Annotated[str, Argument(help="A file of recordings (delimited text or TDMS).")],
    campaign: CampaignOption = None,
    column: Columns = None,
    device_range: DeviceRange = None,
    device_error: DeviceError = None,
    frequency_class: FrequencyClass = None,
    as_json: Json = False,
) -> None:
    """Show what a file of recordings holds: impacts, their figures, contact scenario, quality flags and a plot.

    Example: forcemap inspect run7.csv --column time=time_ms --column time_unit=ms --column force=force_N
    """
    conditions, columns = described(file, campaign, column, device_range, device_error, frequency_class)
    recorded = recorded_impacts(file, conditions, columns)
    answer = InspectAnswer.of_file(file, recorded, conditions)
    emit(answer, inspect_lines(answer, recorded), as_json=as_json)


SHOWN = 12
"""Lines of a list before it is cut; a choice, so that the outcome stays on the screen."""

_UNSTATED = "the device range is not stated, so saturation was judged by the shape alone: --device-range-N"


def inspect_lines(answer: InspectAnswer, recorded: Sequence[RecordedImpacts]) -> list[str]:
    """What a file of recordings holds, every impact with its plot."""
    found = sum(len(measured.impacts) for measured in recorded)
    verdict = f"{counted(found, 'impact')} in {answer.file}{_for_a_map(recorded)}"
    lines = verdict_first(verdict, simulated=answer.simulated)
    for shown, measured in zip(answer.recordings, recorded, strict=True):
        rate = f"{shown.sampling_rate_Hz:.0f} Hz{'' if measured.recording.regular else ', irregular'}"
        lines.append(f"{shown.recording}: {shown.samples} samples in {shown.duration_s:.3f} s, {rate}")
        lines += [f"  note: {note}" for note in shown.notes]
        lines += [line for impact in measured.impacts for line in ["", *impact_lines(impact)]]
        lines += [f"  {shown.problem}"] if shown.problem else []
        lines.append("")
    return [*lines, *([_UNSTATED] if answer.device_range_N is None else [])]


def _for_a_map(recorded: Sequence[RecordedImpacts]) -> str:
    """Whether impacts can be used for a map: those whose peak is known, one in each recording of a campaign."""
    flags = [flag.name for each in recorded for impact in each.impacts for flag in impact.flags]
    unknown = dict.fromkeys(str(name) for name in flags if name in UNKNOWN_PEAK)
    if unknown:
        return f"; NOT USABLE for a map where flagged {', '.join(unknown)}: the peak is not known"
    if any(len(each.impacts) > 1 for each in recorded):
        return "; for a map a recording holds one impact alone: cut the file"
    if doubts := dict.fromkeys(filter(None, (each.not_filtered for each in recorded))):
        return f"; NOT USABLE for a map: {'; '.join(doubts)}"
    least = ", as at least their force where saturated" if Quality.SATURATED in flags else ""
    return f"; usable for a map{least}, as far as the curve tells" if any(each.impacts for each in recorded) else ""


def impact_lines(impact: fm.Impact) -> list[str]:
    """An impact with its plot, for a person."""
    bounces = f", contact lost and found again: {impact.bounces}" if impact.bounces else ""
    filtered = impact.filtered_peak_force
    peaks = f"Phase I peak       {impact.peak_force:8.1f} N   largest sample {impact.raw_peak_force:.1f} N"
    peaks += "" if math.isnan(filtered) else f", low-passed {filtered:.1f} N"
    second = "    none" if math.isnan(impact.later_force) else f"{impact.later_force:8.1f} N"
    later = (
        "not recorded"
        if math.isnan(impact.phase2_force)
        else f"{impact.phase2_force:8.1f} N   mean {impact.phase2_mean_force:.1f} N, from 0.5 s after onset on"
    )
    at_least = "" if impact.contact_over else "at least "
    unseen = f"  open above it      {impact.unseen_force:8.1f} N   by its flanks, as of a top cut off; verdicts add it"
    return [
        f"impact {impact.number} at {impact.onset:.4f} s: {impact.scenario.words}",
        *(f"  FLAG {flag}" for flag in impact.flags),
        f"  {peaks}",
        f"    at {1000 * (impact.peak_time - impact.onset):.1f} ms, Phase I ends at "
        f"{1000 * (impact.phase1_end - impact.onset):.1f} ms, {1000 * impact.phase1_width:.1f} ms wide at half height, "
        f"{impact.phase1_samples} samples",
        *([unseen] if impact.unseen_force >= NAMED_FROM else []),
        f"  largest after it   {second}   within 0.5 s after onset",
        f"  Phase II           {later}",
        f"  contact            {at_least}{1000 * impact.contact_duration:.0f} ms, impulse {impact.impulse:.2f} N s"
        f"{bounces}",
        f"  baseline           {impact.contact.baseline_samples} samples, SD {impact.contact.baseline_sd:.2f} N, drift "
        f"{impact.contact.drift:.1f} N/s; no contact below {impact.floor:.1f} N",
        "",
        *_plot(impact),
    ]


_OF_CONTACT, _OF_PHASE_ONE, _LONGEST_PLOT = 1.3, 3.0, 0.75
"""How far a plot goes after the onset: times the contact, at least times Phase I, at most so many seconds.

Choices: the contact and a little more; a peak that fills a third of the width; that instant in sight.
"""

_BEFORE_ONSET = 0.1
"""How far a plot goes before the onset, as a share of what is shown after it; a choice."""


def _plot(impact: fm.Impact) -> list[str]:
    """Contact force from shortly before onset to shortly after the contact, at most 0.75 s."""
    time, force = impact.contact.time - impact.onset, impact.contact.force
    contact, phase_one = impact.contact_duration, impact.phase1_end - impact.onset
    shown = min(max(_OF_CONTACT * contact, _OF_PHASE_ONE * phase_one), _LONGEST_PLOT)
    part = (time >= -_BEFORE_ONSET * shown) & (time <= min(shown, impact.recorded_time))
    if np.sum(part) < 2:
        return []
    marks = {"I": 0.0, "P": impact.peak_time - impact.onset, "E": phase_one, "Q": TRANSIENT_TIME}
    legend = "I onset, P Phase I peak, E end of Phase I" + (", Q 0.5 s" if time[part][-1] >= TRANSIENT_TIME else "")
    return [*text_plot(time[part], force[part], marks), " " * 9 + legend]


def check_lines(answer: CheckAnswer) -> list[str]:
    """A check: the outcome, what must be read with it, what was not judged and why, the impacts it rests on."""
    several, counted_as = len(answer.impacts) + len(answer.unjudged) > 1, ""
    if several:
        counts = ", ".join(f"{count} {_words(name)}" for name, count in answer.counts.items() if name != "unjudged")
        counted_as = f" ({counted(len(answer.impacts), 'impact')}: {counts})"
    verdict = f"{_words(answer.outcome).upper()}{counted_as}: {answer.limit}"
    lines = verdict_first(verdict, answer.warnings, simulated=answer.simulated)
    judged = [impact for impact in answer.impacts if impact.interpretation]
    if several:
        names = [flag.name for impact in answer.impacts for flag in impact.flags]
        flags = ", ".join(f"{name} {names.count(name)}" for name in sorted(set(names)))
        lines += [f"flags: {flags}"] if flags else []
        lines += _list("Why", _why(answer.impacts))
        impacts = ["", *table(_HEADER, map(_verdict_row, judged))] if judged else []
    else:
        lines += [answer.reason]
        impacts = [line for impact in judged for line in _single(impact)]
        impacts += [f"  note: {note}" for recording in answer.recordings for note in recording.notes]
    lines += _list("Not judged", _together(answer.unjudged))
    lines += _list("Excluded by a person, not judged", [f"{file.recording}: {file.reason}" for file in answer.excluded])
    within = [f"within: force + device error ({answer.device_error_N:g} N) <= limit at every instant"] if judged else []
    return [*lines, *impacts, "", *within, *_pressure_lines(answer), *answer.notes]


def _together(unjudged: Iterable[Unjudged]) -> list[str]:
    """Why recordings are not judged, those with one reason in one line."""
    names: dict[str, list[str]] = {}
    for doubt in unjudged:
        names.setdefault(doubt.reason, []).append(doubt.recording)
    return [f"{few(recordings)}: {reason}" for reason, recordings in names.items()]


def _why(impacts: Sequence[CheckedImpact]) -> list[str]:
    """Why impacts are not within: those that exceed the limit first, the farthest before the others."""
    exceeding = sorted((each for each in impacts if each.outcome == "exceeded"), key=lambda each: each.margin_N or 0.0)
    doubtful = [
        f"{impact.recording}: {impact.reason}{_flags(impact)}" for impact in impacts if impact.outcome == "cannot_tell"
    ]
    return [*map(_exceeding, exceeding), *doubtful]


def _flags(impact: CheckedImpact) -> str:
    """All flags by name where an impact has several: its reason names the first that hides the force."""
    return f" (flags: {', '.join(flag.name for flag in impact.flags)})" if len(impact.flags) > 1 else ""


def _exceeding(impact: CheckedImpact) -> str:
    """By how much an impact exceeds the limit, and what makes its force doubtful; it exceeds it all the same."""
    words = f"{impact.recording}: exceeded by {-(impact.margin_N or 0.0):.1f} N"
    doubts = [flag for flag in impact.flags if flag.name in UNKNOWN_PEAK]
    if not doubts:
        return f"{words}, {impact.reason}"
    first = doubts[0]
    return f"{words}, but its peak is in doubt, {first.name}: {first.figure}{_flags(impact)}; record it again"


def _pressure_lines(answer: CheckAnswer) -> list[str]:
    """The pressures that were measured, those that are not within first."""
    rows = sorted(answer.pressures or (), key=lambda each: each.outcome == "within")
    return shortened([f"{each.recording}: {_words(each.outcome)}, {each.reason}" for each in rows])


def _single(impact: CheckedImpact) -> list[str]:
    """One impact under every interpretation."""
    rows = [
        [
            verdict.interpretation,
            *_verdict_cells(verdict),
            f"{verdict.margin_N:+.1f} N",
            f"{1000 * verdict.instant_s:.0f} ms",
        ]
        for verdict in impact.interpretations
    ]
    low_passed = impact.filtered_peak_force_N
    filtered = "" if low_passed is None else f", low-passed {low_passed:.1f} N"
    return [
        "",
        *table(["interpretation", "outcome", "force", "limit", "margin", "at"], rows),
        "",
        *(f"  {verdict.interpretation}: {verdict.words}" for verdict in impact.interpretations),
        f"  Phase I peak: {impact.peak_force_N:.1f} N corrected for noise, largest sample "
        f"{impact.raw_peak_force_N:.1f} N{filtered}; the largest counts. Contact: {impact.scenario_words}",
        *(f"  FLAG {flag.name}: {flag.figure}" for flag in impact.flags),
    ]


_HEADER = ["recording", "outcome", "force", "limit", "margin", "", "at", "interpretation"]


def _verdict_row(impact: CheckedImpact) -> list[str]:
    """A row with the governing interpretation alone: all of them would be too many lines for many impacts."""
    assert impact.margin_N is not None
    assert impact.instant_s is not None
    unknown = impact.outcome == "cannot_tell" and impact.margin_N > impact.device_error_N
    return [
        impact.recording + (f" ({impact.impact})" if impact.impact > 1 else ""),
        *_verdict_cells(impact),
        "" if unknown else f"{impact.margin_N:+.1f} N",
        "" if unknown else f"{impact.margin_percent:+.1f} %",
        f"{1000 * impact.instant_s:.0f} ms",
        impact.interpretation or "",
    ]


def _verdict_cells(verdict: JudgementAnswer | CheckedImpact) -> list[str]:
    return [_words(verdict.outcome), f"{verdict.force_N:.1f} N", f"{verdict.limit_N:g} N"]


def _list(title: str, lines: Sequence[str]) -> list[str]:
    """A list, shortened; nothing without lines."""
    return ["", *listing(title, shortened(lines))] if lines else []


def shortened(lines: Sequence[str]) -> list[str]:
    """The first of many lines, and how many more there are."""
    more = [f"... and {len(lines) - SHOWN} more; --json lists all"] if len(lines) > SHOWN else []
    return [*lines[:SHOWN], *more]


def _words(name: str) -> str:
    return name.replace("_", " ")


_WIDTH, _HEIGHT = 72, 12
"""Columns and lines of a plot; choices: with its labels it fits on a terminal of 80 by 24."""

_LABELLED = 4
"""Every so many lines of a plot have a label; a choice."""


def text_plot(time: FloatArray, force: FloatArray, marks: dict[str, float]) -> list[str]:
    """Lines of a plot: the largest force [N] in every column of time after onset [s].

    Parameters
    ----------
    time, force : array (n,)
        Time after onset [s], contact force [N].
    marks : dict of str to float
        One-letter marks below the time axis, at times after onset [s].
    """
    start, end = float(time[0]), float(time[-1])
    cells = np.minimum(((time - start) / max(end - start, 1e-9) * _WIDTH).astype(int), _WIDTH - 1)
    top = np.full(_WIDTH, np.nan)
    np.fmax.at(top, cells, force)
    highest = max(float(np.nanmax(top)), 1.0)
    rows = np.round(np.clip(top, 0, None) / highest * (_HEIGHT - 1))
    lines = []
    for row in range(_HEIGHT - 1, -1, -1):
        labelled = row % _LABELLED == (_HEIGHT - 1) % _LABELLED or row == 0
        label = f"{highest * row / (_HEIGHT - 1):6.0f} N |" if labelled else " " * 8 + " |"
        lines.append(label[-9:] + "".join("*" if value == row else " " for value in rows).rstrip())
    axis = ["-"] * _WIDTH
    for mark, instant in marks.items():
        if start <= instant <= end:
            axis[min(int((instant - start) / max(end - start, 1e-9) * _WIDTH), _WIDTH - 1)] = mark
    labels = f"{1000 * start:.0f} ms".ljust(_WIDTH - 10) + f"{1000 * end:.0f} ms".rjust(10)
    return [*lines, " " * 8 + "+" + "".join(axis), " " * 9 + labels]
