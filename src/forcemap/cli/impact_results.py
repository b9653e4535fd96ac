"""Impacts and verdicts as dictionaries for JSON, with units in the keys, and as lines of text."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from forcemap import ForceLimit, Impact, Judgement, NewtonLimit, Recording, Verdict, VerdictOutcome
from forcemap.cli.text_plot import text_plot

_FIGURES = {
    "onset_s": "onset",
    "peak_force_N": "peak_force",
    "raw_peak_force_N": "raw_peak_force",
    "filtered_peak_force_N": "filtered_peak_force",
    "peak_time_s": "peak_time",
    "phase1_end_s": "phase1_end",
    "phase1_width_s": "phase1_width",
    "phase1_samples": "phase1_samples",
    "largest_force_N": "largest_force",
    "later_force_N": "later_force",
    "phase2_force_N": "phase2_force",
    "phase2_mean_force_N": "phase2_mean_force",
    "end_force_N": "end_force",
    "contact_duration_s": "contact_duration",
    "contact_over": "contact_over",
    "impulse_Ns": "impulse",
    "bounces": "bounces",
    "floor_N": "floor",
}


def recording_result(recording: Recording, impacts: list[Impact]) -> dict[str, Any]:
    """A recording and its impacts for JSON."""
    return {
        "recording": recording.name,
        "sha256": recording.sha256,
        "samples": recording.samples,
        "duration_s": recording.duration,
        "sampling_rate_Hz": recording.sampling_rate,
        "largest_gap_s": recording.largest_gap,
        "notes": list(recording.notes),
        "impacts": [impact_result(impact) for impact in impacts],
    }


def impact_result(impact: Impact) -> dict[str, Any]:
    """An impact for JSON; times are on the recording's axis unless the key says otherwise."""
    return {
        **{key: getattr(impact, name) for key, name in _FIGURES.items()},
        "baseline_sd_N": impact.contact.baseline_sd,
        "baseline_samples": impact.contact.baseline_samples,
        "drift_N_per_s": impact.contact.drift,
        "scenario": impact.scenario.value,
        "flags": [{"name": flag.name.value, "figure": flag.figure} for flag in impact.flags],
    }


def recording_lines(recording: Recording) -> list[str]:
    """A recording in a few lines."""
    return [
        f"{recording.name}: {recording.samples} samples in {recording.duration:.3f} s, {recording.sampling_rate:.0f} Hz"
        f"{'' if recording.regular else ', irregular'}",
        *(f"  note: {note}" for note in recording.notes),
    ]


def impact_lines(impact: Impact) -> list[str]:
    """An impact with its plot, for a person."""
    bounces = f", contact lost and found again: {impact.bounces}" if impact.bounces else ""
    filtered = impact.filtered_peak_force
    peaks = f"Phase I peak       {impact.peak_force:8.1f} N   largest sample {impact.raw_peak_force:.1f} N"
    peaks += "" if math.isnan(filtered) else f", low-passed {filtered:.1f} N"
    later = (
        "not recorded"
        if math.isnan(impact.phase2_force)
        else f"{impact.phase2_force:8.1f} N   mean {impact.phase2_mean_force:.1f} N, from 0.5 s after onset on"
    )
    at_least = "" if impact.contact_over else "at least "
    lines = [
        f"impact {impact.number} at {impact.onset:.4f} s: {impact.scenario.words}",
        *(f"  FLAG {flag}" for flag in impact.flags),
        f"  {peaks}",
        f"    at {1000 * (impact.peak_time - impact.onset):.1f} ms, Phase I ends at "
        f"{1000 * (impact.phase1_end - impact.onset):.1f} ms, {1000 * impact.phase1_width:.1f} ms wide at half height, "
        f"{impact.phase1_samples} samples",
        f"  largest after it   {_or_none(impact.later_force)}   within 0.5 s after onset",
        f"  Phase II           {later}",
        f"  contact            {at_least}{1000 * impact.contact_duration:.0f} ms, impulse {impact.impulse:.2f} N s"
        f"{bounces}",
        f"  baseline           {impact.contact.baseline_samples} samples, SD {impact.contact.baseline_sd:.2f} N, drift "
        f"{impact.contact.drift:.1f} N/s; no contact below {impact.floor:.1f} N",
    ]
    return [*lines, "", *_plot(impact)]


def _or_none(force: float) -> str:
    return "    none" if math.isnan(force) else f"{force:8.1f} N"


def _plot(impact: Impact) -> list[str]:
    """Contact force from shortly before onset to the end of the contact, or 0.7 s."""
    time, force = impact.contact.time - impact.onset, impact.contact.force
    shown = min(max(1.3 * impact.contact_duration, 3 * (impact.phase1_end - impact.onset)), 0.75)
    part = (time >= -0.1 * shown) & (time <= min(shown, impact.recorded_time))
    if np.sum(part) < 2:
        return []
    marks = {"I": 0.0, "P": impact.peak_time - impact.onset, "E": impact.phase1_end - impact.onset, "Q": 0.5}
    legend = "I onset, P Phase I peak, E end of Phase I" + (", Q 0.5 s" if time[part][-1] >= 0.5 else "")
    return [*text_plot(time[part], force[part], marks), " " * 9 + legend]


def verdict_result(verdict: Verdict) -> dict[str, Any]:
    """A verdict for JSON."""
    return {
        "recording": verdict.impact.recording.name,
        "impact": verdict.impact.number,
        "outcome": verdict.outcome.value,
        **_judgement(verdict.governing),
        "device_error_N": verdict.device_error,
        "raw_peak_force_N": verdict.raw_force,
        "peak_force_N": verdict.corrected_force,
        "filtered_peak_force_N": verdict.filtered_force,
        "scenario": verdict.impact.scenario.value,
        "flags": [{"name": flag.name.value, "figure": flag.figure} for flag in verdict.impact.flags],
        "interpretations": [
            {"outcome": judgement.outcome.value, **_judgement(judgement)} for judgement in verdict.judgements
        ],
    }


def _judgement(judgement: Judgement) -> dict[str, Any]:
    return {
        "interpretation": judgement.interpretation.value,
        "force_N": judgement.force,
        "limit_N": judgement.limit,
        "margin_N": judgement.margin,
        "margin_percent": judgement.margin_percent,
        "instant_s": judgement.instant,
        "reason": judgement.reason,
    }


def verdict_row(verdict: Verdict) -> list[str]:
    """A row for each interpretation would be too much for many impacts: the governing one."""
    governing = verdict.governing
    unknown = verdict.outcome is VerdictOutcome.CANNOT_TELL and governing.margin > verdict.device_error
    return [
        verdict.impact.recording.name + (f" ({verdict.impact.number})" if verdict.impact.number > 1 else ""),
        verdict.outcome.value.replace("_", " "),
        f"{governing.force:.1f} N",
        f"{governing.limit:g} N",
        "" if unknown else f"{governing.margin:+.1f} N",
        "" if unknown else f"{governing.margin_percent:+.1f} %",
        f"{1000 * governing.instant:.0f} ms",
        governing.interpretation.value,
    ]


VERDICT_HEADER = ["recording", "outcome", "force", "limit", "margin", "", "at", "interpretation"]


def limit_line_words(limit: ForceLimit | NewtonLimit) -> str:
    """The limits that a check uses."""
    if isinstance(limit, ForceLimit):
        return f"{limit.transient:g} N transient, {limit.quasi_static:g} N quasi-static: {limit}"
    if limit.quasi_static is not None:
        return f"{limit.force:g} N transient, {limit.quasi_static:g} N quasi-static, given by the user"
    return f"{limit.force:g} N throughout"
