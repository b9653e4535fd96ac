"""forcemap check."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from forcemap import (
    Campaign,
    Contact,
    ForceLimit,
    ForcemapError,
    InputError,
    Interpretation,
    NewtonLimit,
    Verdict,
    VerdictOutcome,
    check_impact,
    find_impacts,
    force_limit,
    no_impact,
    read_campaign,
    read_limit_table,
)
from forcemap.cli.column_options import (
    CampaignOption,
    Columns,
    DeviceError,
    DeviceRange,
    FrequencyClass,
    recordings_from,
)
from forcemap.cli.impact_results import VERDICT_HEADER, limit_line_words, verdict_result, verdict_row
from forcemap.cli.options import (
    Area,
    DeviceSpring,
    Json,
    LimitN,
    LimitSpring,
    LimitTable,
    QuasiStaticN,
    Region,
    stiffness,
)
from forcemap.cli.output import Progress, emit, listing, table
from forcemap.files import file_sha256

_SHOWN = 12  # lines of a list


def check(
    source: Annotated[str, typer.Argument(help="A file of recordings, or a campaign folder.")],
    area: Area = None,
    region: Region = None,
    newtons: LimitN = None,
    quasi_static: QuasiStaticN = None,
    limit_spring: LimitSpring = None,
    contact: Annotated[
        Contact | None,
        typer.Option("--contact", help="quasi-static: that limit for all of the contact; with --limit-N which it is."),
    ] = None,
    limit_table: LimitTable = None,
    interpretation: Annotated[
        Interpretation | None,
        typer.Option("--interpretation", help="The interpretation that governs; default: the strictest."),
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
    limit = _limit(area, region, newtons, limit_table, quasi_static, limit_spring)
    if isinstance(limit, ForceLimit) and not limit.permitted:
        reason = f"contact with {limit.name} is not permitted in {limit.edition}: no force is within a limit"
        emit({"outcome": "not_permitted", "reason": reason, "limit_source": str(limit)}, [reason], as_json=as_json)
        return 1
    judge = partial(check_impact, limit=limit, interpretation=interpretation, contact=contact)
    verdicts: list[Verdict] = []
    unjudged: list[tuple[str, str]] = []
    simulated = stated = False
    home = read_campaign(source) if Path(source).is_dir() else None
    files = [source] if home is None else _files(home)
    out = [] if home is None else [entry for entry in home.entries if entry.exclude]
    excluded = {f"{home.recordings / entry.file}#{entry.curve}" for entry in out} if home else set()
    unjudged += [] if home is None else _gone(home)
    with Progress("checked", len(files)) as progress:
        for done, file in enumerate(files, start=1):
            try:
                recordings, conditions = recordings_from(
                    file, campaign or (source if home else None), column, device_range, device_error, device_spring
                )
            except ForcemapError as error:
                if len(files) == 1:
                    raise
                unjudged.append((file, str(error)))
                continue
            simulated |= conditions.simulated
            stated |= not math.isnan(conditions.device.range)
            unjudged += _changed(home, file)
            wanted = conditions.channel_frequency_class if frequency_class is None else frequency_class
            for recording in recordings:
                if f"{file}#{recording.curve}" in excluded:
                    continue
                impacts = find_impacts(recording, channel_frequency_class=wanted)
                verdicts += [judge(impact) for impact in impacts]
                unjudged += [] if impacts else [(recording.name, no_impact(recording))]
            progress.show(done)
    outcomes = [verdict.outcome for verdict in verdicts]
    worst = (
        VerdictOutcome.EXCEEDED
        if VerdictOutcome.EXCEEDED in outcomes
        else VerdictOutcome.CANNOT_TELL
        if unjudged or not verdicts or VerdictOutcome.CANNOT_TELL in outcomes
        else VerdictOutcome.WITHIN
    )
    warnings = list(dict.fromkeys(line for verdict in verdicts for line in verdict.warnings))
    result: dict[str, Any] = {
        "outcome": worst.value,
        "limit": limit_line_words(limit),
        "simulated": simulated,
        "warnings": warnings,
        "counts": {outcome.value: outcomes.count(outcome) for outcome in VerdictOutcome} | {"unjudged": len(unjudged)},
        "impacts": [verdict_result(verdict) for verdict in verdicts],
        "unjudged": [{"recording": name, "reason": reason} for name, reason in unjudged],
        "excluded": [{"recording": entry.name, "reason": entry.exclude} for entry in out],
        "device_range_stated": stated,
    }
    closing = listing("Excluded by a person, not judged", [f"{entry.name}: {entry.exclude}" for entry in out])
    notes = closing if out else []
    notes += [] if stated else ["device range not stated: saturation was judged by the shape of the curves alone"]
    emit(result, [*warnings, *_lines(worst, verdicts, unjudged, limit, simulated), *notes], as_json=as_json)
    return {VerdictOutcome.WITHIN: 0, VerdictOutcome.EXCEEDED: 1, VerdictOutcome.CANNOT_TELL: 2}[worst]


def _limit(
    area: str | None,
    region: str | None,
    newtons: float | None,
    limit_table: str | None,
    quasi_static: float | None,
    spring: float | None,
) -> ForceLimit | NewtonLimit:
    name = area or region
    if sum(option is not None for option in (area, region, newtons)) != 1 or name == "":
        raise InputError("limit: expected one of --area, --region or --limit-N")
    if newtons is not None:
        if limit_table is not None:
            raise InputError("limit: --limit-table goes with --area or --region, not with --limit-N")
        return NewtonLimit(newtons, quasi_static, stiffness(spring))
    if quasi_static is not None or spring is not None:
        raise InputError("limit: --quasi-static-limit-N and --limit-spring-N-per-mm go with --limit-N")
    assert name is not None
    return force_limit(name, table=read_limit_table(limit_table) if limit_table else None)


def _files(campaign: Campaign) -> list[str]:
    """The files of a campaign, but for those that a person took out whole."""
    excluded = {entry.file for entry in campaign.entries if entry.exclude and not entry.curve}
    files = [str(campaign.recordings / file) for file in campaign.files() if file not in excluded]
    if not files:
        raise InputError("found no recording to check", file=str(campaign.recordings))
    return files


def _gone(campaign: Campaign) -> list[tuple[str, str]]:
    """Registered recordings whose file is not there."""
    files = set(campaign.files())
    return [(entry.name, "registered, but the file is gone") for entry in campaign.entries if entry.file not in files]


def _changed(campaign: Campaign | None, file: str) -> list[tuple[str, str]]:
    """The file, if it is not the one that was registered."""
    entries = [] if campaign is None else [e for e in campaign.entries if str(campaign.recordings / e.file) == file]
    if any(entry.sha256 and entry.sha256 != file_sha256(file) for entry in entries[:1]):
        return [(entries[0].file, "the file has changed since it was registered")]
    return []


def _lines(
    worst: VerdictOutcome,
    verdicts: list[Verdict],
    unjudged: list[tuple[str, str]],
    limit: ForceLimit | NewtonLimit,
    simulated: bool,
) -> list[str]:
    lines = ["SIMULATED recordings: not a measurement of any robot"] if simulated else []
    lines += [f"{worst.value.replace('_', ' ').upper()}: {limit_line_words(limit)}", ""]
    lines += table(VERDICT_HEADER, [verdict_row(verdict) for verdict in verdicts]) if verdicts else []
    if len(verdicts) == 1:
        (verdict,) = verdicts
        rows = [
            [
                each.interpretation.value,
                each.outcome.value.replace("_", " "),
                f"{each.force:.1f} N",
                f"{each.limit:g} N",
                f"{each.margin:+.1f} N",
                f"{1000 * each.instant:.0f} ms",
            ]
            for each in verdict.judgements
        ]
        lines += [
            "",
            verdict.governing.reason,
            "",
            *table(["interpretation", "outcome", "force", "limit", "margin", "at"], rows),
        ]
        lines += ["", *(f"  {each.value}: {each.words}" for each in Interpretation)]
        low_passed = verdict.filtered_force
        filtered = "" if math.isnan(low_passed) else f", low-passed {low_passed:.1f} N"
        lines += [
            f"  Phase I peak: {verdict.corrected_force:.1f} N corrected for noise, largest sample "
            f"{verdict.raw_force:.1f} N{filtered}; the largest counts. Contact: {verdict.impact.scenario.words}",
        ]
        lines += [f"  FLAG {flag}" for flag in verdict.impact.flags]
        lines += [f"  note: {note}" for note in verdict.impact.recording.notes]
    else:
        outcomes = [v.outcome for v in verdicts]
        counts = ", ".join(f"{outcomes.count(each)} {each.value.replace('_', ' ')}" for each in VerdictOutcome)
        names = [flag.name.value for v in verdicts for flag in v.impact.flags]
        flags = ", ".join(f"{name} {names.count(name)}" for name in sorted(set(names)))
        lines += ["", f"{len(verdicts)} impacts: {counts}", *([f"flags: {flags}"] if flags else [])]
        doubts = [v for v in verdicts if v.outcome is VerdictOutcome.CANNOT_TELL]
        reasons = [f"{v.impact.recording.name}: {v.governing.reason}" for v in doubts]
        more = [f"... and {len(doubts) - _SHOWN} more; --json lists all"] if len(doubts) > _SHOWN else []
        lines += ["", *listing("Why", [*reasons[:_SHOWN], *more])] if doubts else []
    lines += listing("Not judged", [f"{name}: {reason}" for name, reason in unjudged]) if unjudged else []
    error = verdicts[0].device_error if verdicts else 3.0
    closing = f"within: force + device error ({error:g} N) <= limit at every instant; pressure is not assessed"
    return [*lines, "", closing]
