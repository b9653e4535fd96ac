"""forcemap report."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import typer

from forcemap import (
    CFM_3D,
    Bound,
    CampaignAssessment,
    Conditions,
    FixedMargin,
    ForceLimit,
    InputError,
    Missing,
    ToleranceBound,
    assess_campaign,
    campaign_limit_table,
    floor_speed,
    force_limit,
    form_named,
    read_conditions,
    read_limit_table,
)
from forcemap.cli.options import BoundKind, BoundOption, Confidence, Content, FormName, Json, LimitTable, Margin
from forcemap.cli.output import Progress, emit, listing, write_result
from forcemap.files import read_bytes, write_atomically

REPORT_FILE = "report.html"
_PDF = b"%PDF"


def report(
    folder: Annotated[str, typer.Argument(help="Campaign folder.")],
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="HTML file to write; default: report.html in the folder.")
    ] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Write the same as a PDF beside it.")] = False,
    area: Annotated[
        list[str] | None, typer.Option("--area", help="Body area; may be given several times. Default: hand_fingers.")
    ] = None,
    region: Annotated[
        list[str] | None, typer.Option("--region", help="Body region: the lowest limit of its areas; several times.")
    ] = None,
    limit_table: LimitTable = None,
    bound_kind: BoundOption = None,
    margin: Margin = None,
    confidence: Confidence = None,
    content: Content = None,
    form: FormName = None,
    step: Annotated[float, typer.Option("--step-m", help="Distance between places of the speed tables [m].")] = 0.05,
    date: Annotated[str | None, typer.Option("--date", help="Date of the report, YYYY-MM-DD; default: today.")] = None,
    verify: Annotated[
        str | None, typer.Option("--verify", help="Write nothing: say what changed since this report was written.")
    ] = None,
    as_json: Json = False,
) -> int:
    """Write the validation report of a campaign, one HTML file that needs nothing beside it; nothing else is changed.

    Exit code: 0 written; with --verify 0 nothing changed, 1 changed, 2 cannot tell.

    Example: forcemap report my-campaign --area back_of_hand
    """
    if verify is not None:
        if pdf or output or area or region or limit_table or bound_kind or date or form:
            raise InputError("verify: --verify goes with the folder alone; it writes nothing")
        return _verify(verify, folder, as_json=as_json)
    target = Path(folder, REPORT_FILE) if output is None else Path(output)
    if target.suffix.lower() not in (".html", ".htm"):
        raise InputError("found a name that ends otherwise, expected .html", file=str(target))
    bound = _bound(folder, bound_kind, margin, confidence, content)
    limits = _limits(folder, [*(area or []), *(region or [])], limit_table)
    recordings = sum(1 for _ in Path(folder, "recordings").rglob("*"))
    with Progress("recordings judged", recordings) as progress:
        assessment = assess_campaign(
            folder,
            limits=limits,
            bound=bound,
            form=form_named(form or CFM_3D.name),
            step=step,
            progress=lambda done, _: progress.show(done),
        )
    files = write_report(assessment, target, date, pdf=pdf)
    emit(_result(assessment, files), _lines(assessment, files, folder), as_json=as_json)
    return 0


def write_report(assessment: CampaignAssessment, target: Path, date: str | None, *, pdf: bool) -> list[str]:
    """Write a report, and as a PDF beside it if asked for; the names of the files."""
    from forcemap.report import report_html, report_pdf

    _require_same_areas(assessment, target)
    beside = target.with_suffix(".pdf")
    if pdf and beside.exists() and not read_bytes(beside).startswith(_PDF):
        raise InputError("this is another file, not an earlier report; choose another name", file=str(beside))
    html = report_html(assessment, date=date)
    printed = report_pdf(html) if pdf else b""  # before anything is written
    write_result(str(target), html, mark='name="forcemap-report"')
    if pdf:
        write_atomically(beside, printed)
    return [str(target), *([str(beside)] if pdf else [])]


def _require_same_areas(assessment: CampaignAssessment, target: Path) -> None:
    """Refuse to replace a report that was made for other body areas or another bound: it would be lost."""
    from forcemap.report import made_for, read_seal

    if not target.exists():
        return
    try:
        earlier = read_seal(read_bytes(target), str(target)).made_for
    except InputError:  # no report that says so: `write_result` judges it
        return
    wanted = made_for(assessment)
    if earlier != wanted:
        raise InputError(
            f"this report was made for {earlier or 'body areas that it does not state'}, not for {wanted}; "
            "it is not replaced, name another file with -o or move it away",
            file=str(target),
        )


def _verify(file: str, folder: str, *, as_json: bool) -> int:
    from forcemap.report import verify_report

    found = verify_report(file, folder)
    result = {
        "holds": found.holds,
        "report_intact": found.intact,
        "changed": list(found.changed),
        "vanished": list(found.vanished),
        "new": list(found.new),
        "unchanged": found.unchanged,
        "software": found.software,
        "date": found.date,
    }
    lines = [f"Report of {found.date}, written by {found.software}"]
    lines += [] if found.intact else ["ALTERED: the report file is not as it was written"]
    for title, files in (("Changed", found.changed), ("Vanished", found.vanished), ("New", found.new)):
        lines += listing(f"{title} since", map(_printable, files)) if files else []
    lines += ["Nothing changed since" if found.holds else "Write the report again", f"{found.unchanged} files as then"]
    emit(result, lines, as_json=as_json)
    return 0 if found.holds else 1


def _limits(folder: str, names: list[str], limit_table: str | None) -> list[ForceLimit]:
    """Limits of the areas named, in the table given, else the one that the campaign names."""
    if limit_table and not names:
        raise InputError("limit: --limit-table goes with --area or --region")
    if limit_table:
        table = read_limit_table(limit_table)
    else:
        stated = Path(folder, "campaign.toml")
        table = campaign_limit_table(folder, read_conditions(stated) if stated.exists() else Conditions()).table
    return [force_limit(name, table=table) for name in dict.fromkeys(names)]


def _bound(
    folder: str, kind: BoundKind | None, margin: float | None, confidence: float | None, content: float | None
) -> Bound | None:
    """The bound that the options name; None for the usual one."""
    if kind is BoundKind.MARGIN:
        if confidence is not None or content is not None:
            raise InputError("bound: --confidence and --content go with --bound tolerance")
        return FixedMargin(0.10 if margin is None else margin)
    if margin is not None:
        raise InputError("margin: --margin goes with --bound margin")
    if confidence is None and content is None:
        return None
    stated = Path(folder, "campaign.toml")
    error = read_conditions(stated).device.error_or_default if stated.exists() else 3.0
    return ToleranceBound(0.95 if confidence is None else confidence, 0.95 if content is None else content, error)


def _result(assessment: CampaignAssessment, files: list[str]) -> dict[str, Any]:
    parts = {name: getattr(assessment, name) for name in ("dataset", "recordings", "force_map", "bound")}
    return {
        "files": files,
        "simulated": assessment.simulated,
        "findings": list(assessment.findings),
        "missing": {name: part.reason for name, part in parts.items() if isinstance(part, Missing)},
        "speeds": [
            {
                "limit": found.limit.name,
                "contact": found.contact.value,
                "limit_N": found.limit.force(found.contact) if found.limit.permitted else None,
                "outcome": "not_permitted"
                if not found.limit.permitted
                else "unconfirmed"
                if not found.confirmed
                else "confirmed",
                "reason": found.speeds.reason if isinstance(found.speeds, Missing) else "",
                "confirmed_places": found.confirmed,
                "unconfirmed_places": sum(len(each.places) for each in found.open_places),
                "lowest_speed_mps": found.slowest,
                "highest_speed_mps": found.fastest,
            }
            for found in assessment.speeds
        ],
        "inputs": {_printable(each.path): each.sha256 for each in assessment.inputs},
    }


def _lines(assessment: CampaignAssessment, files: list[str], folder: str) -> list[str]:
    lines = ["SIMULATED impacts: not a measurement of any robot"] if assessment.simulated else []
    lines += listing("READ THIS FIRST", assessment.findings) if assessment.findings else []
    for found in assessment.speeds:
        name = f"{found.limit.name}, {found.contact}"
        if isinstance(found.speeds, Missing):
            lines.append(f"{name}: no speed: {found.speeds.reason}")
        elif found.confirmed:
            lines.append(
                f"{name}, {found.limit.force(found.contact):g} N: {found.confirmed} places confirmed, at "
                f"{floor_speed(found.slowest)} to {floor_speed(found.fastest)} m/s; "
                f"{sum(len(each.places) for each in found.open_places)} unconfirmed"
            )
        else:
            lines.append(f"{name}, {found.limit.force(found.contact):g} N: no place confirmed")
    size = os.path.getsize(files[0]) / 1e6
    return [
        *lines,
        f"Written: {', '.join(files)} ({size:.1f} MB; an estimate from measurements, not a certificate)",
        f"Later: forcemap report --verify {files[0]} {folder}",
    ]


def _printable(path: str) -> str:
    """A path whose bytes are no UTF-8, or that holds control characters, as it can be printed."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in path)
