"""forcemap fleet."""

from __future__ import annotations

import datetime
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import quote

from typer import Argument, Option

import forcemap as fm
from forcemap._version import __version__
from forcemap.answers.fleet import FleetAnswer, FleetCampaign, LastMapAnswer
from forcemap.assessment.fleet import (
    LastMap,
    Memory,
    against_maps,
    due,
    keep_map,
    last_map,
    made_from,
    named_limits,
    rests_on,
)
from forcemap.assessment.missing import Missing
from forcemap.assessment.point_results import PointResult
from forcemap.cli.options import Json, TeamRegister, areas_from
from forcemap.cli.output import Progress, counted, emit, listing, write_result
from forcemap.cli.report import printable, report_result, write_report
from forcemap.csv_table import csv_cell, csv_text
from forcemap.errors import few, one_line
from forcemap.files import file_sha256, stated_date
from forcemap.report.seal import REPORT_FILE
from forcemap.sweeps.pool import pool, results
from forcemap.verdicts.verdict import VerdictOutcome
from forcemap.words import sentence, sentences

_TABLE_MARK = "folder,made_again,failed,"
_PRELOAD = ("forcemap.cli.fleet", "forcemap.report", "matplotlib.backends.backend_svg", "scipy.stats")


def fleet(
    folders: Annotated[list[str], Argument(help="Campaign folders.")],
    output: Annotated[str, Option("-o", "--output", help="HTML page to write; the table is a CSV beside it.")] = (
        "fleet.html"
    ),
    area: Annotated[
        list[str] | None,
        Option("--area", help="Body area or region; several times. Default: those of each campaign's contact points."),
    ] = None,
    workers: Annotated[int | None, Option("--workers", help="Processes; default: one for each processor.")] = None,
    date: Annotated[str | None, Option("--date", help="Today, YYYY-MM-DD, for reports and what is due.")] = None,
    register: TeamRegister = None,
    as_json: Json = False,
) -> int:
    """Bring many campaigns up to date: what changed is collected, fitted, checked against its last map and reported.

    What did not change stays as it is; one bad folder stops nothing. Exit code: 0 all are good, 1 some failed.

    Example: forcemap fleet my-campaign --area back_of_hand
    """
    page = Path(output)
    if page.suffix.lower() not in (".html", ".htm"):
        raise fm.InputError("found a name that ends otherwise, expected .html", file=output)
    today = datetime.date.today() if date is None else stated_date("date", date)
    ask = _Ask(tuple(area or ()), today)
    rows = {folder: _known(folder, ask) for folder in folders}
    left = [folder for folder, row in rows.items() if row is None]
    with Progress("campaigns made again", len(left)) as progress:
        for done, (folder, row) in enumerate(_each(left, ask, workers or os.cpu_count() or 1), start=1):
            rows[folder] = row
            progress.show(done)
    if register is not None:
        rows |= _entered(rows, register)
    named = {folder: row.model_copy(update={"folder": printable(folder)}) for folder, row in rows.items() if row}
    campaigns = list(named.values())
    answer = FleetAnswer(
        date=today.isoformat(),
        software=f"forcemap {__version__}",
        made_again=sum(row.made_again for row in campaigns),
        unchanged=sum(not row.made_again and row.report is not None for row in campaigns),
        failed=sum(row.failed is not None for row in campaigns),
        campaigns=campaigns,
        files=[str(page), str(page.with_suffix(".csv"))],
    )
    beside = {folder: Path(folder, REPORT_FILE) for folder, row in named.items() if row.report}
    links = {
        named[folder].folder: quote(os.fsencode(os.path.relpath(file, page.parent))) for folder, file in beside.items()
    }
    _write(answer, page, links)
    emit(answer, _lines(answer), as_json=as_json)
    return 1 if answer.failed else 0


@dataclass(frozen=True)
class _Ask:
    """What is asked of every campaign: limits of these body areas, or of its contact points', on this day."""

    areas: tuple[str, ...]
    today: datetime.date


def _known(folder: str, ask: _Ask) -> FleetCampaign | None:
    """The campaign as it was found last, if nothing has changed since; None if it has to be made."""
    from forcemap.report import altered

    root, report = Path(folder), Path(folder, REPORT_FILE)
    try:
        memory = Memory.read(root)
        if memory is None or not report.exists() or file_sha256(report) != memory.report_sha256:
            return None
        if altered(report):
            return None
        conditions = _conditions(root)
        if rests_on(root, *named_limits(root, conditions, areas_from(folder, ask.areas))) != memory.rests_on:
            return None
    except fm.ForcemapError:  # said when it is made
        return None
    row = FleetCampaign.model_validate(memory.found | {"made_again": False, "changed": []})
    return row.model_copy(update={"due": _due(row, conditions, ask, report)})


def _conditions(folder: Path) -> fm.Conditions:
    stated = folder / "campaign.toml"
    return fm.read_conditions(stated) if stated.exists() else fm.Conditions()


def _each(folders: list[str], ask: _Ask, workers: int) -> Iterator[tuple[str, FleetCampaign]]:
    """The campaigns as they are made; one that ends its process is made once more, in a process of its own."""
    left = dict.fromkeys(folders)
    make = partial(_made, ask=ask)
    if min(workers, len(left)) <= 1:
        yield from ((folder, make(folder)) for folder in left)
        return
    try:
        with pool(min(workers, len(left)), _PRELOAD) as executor:
            for folder, row, lost in results(executor, make, folders):
                del left[folder]
                yield folder, row or _failure(lost)
    except fm.ForcemapError:
        for folder in left:
            try:
                with pool(1, _PRELOAD) as executor:
                    ((_, row, lost),) = results(executor, make, [folder])
                    yield folder, row or _failure(lost)
            except fm.ForcemapError as error:
                yield folder, _failure(str(error))


def _entered(rows: dict[str, FleetCampaign | None], register: str) -> dict[str, FleetCampaign]:
    """The campaigns that were collected, entered into the register; one that cannot be has failed."""
    from forcemap.register.enter import enter
    from forcemap.register.schema import open_register

    found = {}
    with open_register(register) as opened:
        for folder, row in rows.items():
            if row is None or row.report is None:
                continue
            try:
                found[folder] = row.model_copy(update={"entered": enter(opened, folder).new})
            except fm.ForcemapError as error:
                why = "; ".join(filter(None, (row.failed, f"not entered into the register: {one_line(str(error))}")))
                found[folder] = row.model_copy(update={"failed": why})
    return found


def _failure(reason: str) -> FleetCampaign:
    return FleetCampaign(made_again=False, failed=one_line(reason))


def _made(folder: str, ask: _Ask) -> FleetCampaign:
    """The campaign made again; whatever is wrong with it is its reason."""
    conditions = None
    try:
        conditions = _conditions(Path(folder))
        return _make(Path(folder), conditions, ask)
    except fm.ForcemapError as error:
        row = _failure(str(error))
    except Exception as error:
        row = _failure(f"a defect of forcemap ({type(error).__name__}: {error}); please report it")
    report = Path(folder, REPORT_FILE)
    return row if conditions is None else row.model_copy(update={"due": _due(row, conditions, ask, report)})


def _make(folder: Path, conditions: fm.Conditions, ask: _Ask) -> FleetCampaign:
    report = folder / REPORT_FILE
    memory, changed = Memory.read(folder), _changes(folder, report)
    if any((folder / "recordings").glob("*")) or (folder / "recordings.csv").exists():
        fm.collect_campaign(folder)
    limits, _ = named_limits(folder, conditions, areas_from(str(folder), ask.areas))
    assessment = fm.assess_campaign(folder, limits=limits)
    last = last_map(folder, assessment, memory)
    files = write_report(assessment, report, ask.today.isoformat(), pdf=False)
    known = keep_map(folder, assessment, last, memory)
    campaign, dataset = assessment.campaign, assessment.dataset
    of_report = report_result(assessment, [Path(file).name for file in files])
    row = FleetCampaign(
        made_again=True,
        failed=_failed(assessment, last),
        changed=changed,
        states=None if isinstance(dataset, Missing) else len(dataset.states),
        missing_runs=None if isinstance(campaign, Missing) else len(campaign.missing),
        last_map=_last(last),
        report={key: value for key, value in of_report.items() if key != "inputs"},
    )
    row = row.model_copy(update={"due": _due(row, conditions, ask, report)})
    Memory(made_from(assessment), file_sha256(report), known, row.model_dump(mode="json")).write(folder)
    return row


def _changes(folder: Path, report: Path) -> list[str]:
    """What has changed since the report was written."""
    from forcemap.report import verify_report

    if not report.exists():
        return ["no report yet"]
    since = verify_report(report, folder)
    files = ((since.changed, "changed"), (since.new, "new"), (since.vanished, "gone"))
    words = [one_line(f"{name} {what}") for names, what in files for name in names]
    words += [] if since.intact else ["the report was altered"]
    words += ["the list of its inputs was altered"] if since.list_altered else []
    words += [] if since.software == f"forcemap {__version__}" else [f"made by {since.software}"]
    return words or ["body areas, tables of limits, or what fleet knew of it"]


def _last(last: LastMap) -> LastMapAnswer | None:
    if last.check is None:
        return None
    if isinstance(last.check, Missing):
        words = {"reason": last.check.reason, "next_step": ""}
        return LastMapAnswer(outcome=fm.MapOutcome.CANNOT_TELL.value, mean_ratio=None, **words)
    return LastMapAnswer.from_result(last.check)


def _failed(assessment: fm.CampaignAssessment, last: LastMap) -> str | None:
    """Why a campaign that was made is not good; None if it is."""
    if not isinstance(assessment.dataset, Missing) and (refusal := assessment.dataset.no_speed):
        return f"no speed: {sentence(refusal)}"
    for part in ("dataset", "force_map", "bound"):
        if isinstance(found := getattr(assessment, part), Missing):
            return f"no {part.replace('_', ' ')}: {found.reason}"
    if against := against_maps(assessment):
        return f"no speed: {sentence(against[0])}"
    if isinstance(assessment.points, Missing):
        return f"no contact point is permitted: {assessment.points.reason}"
    if above := [each.point.name for each in assessment.points if each.lacks and _exceeds(each)]:
        return f"measured above the limit at contact {'points' if len(above) > 1 else 'point'} {', '.join(above)}"
    if isinstance(last.check, Missing) or last.check is None or last.check.outcome is not fm.MapOutcome.DOES_NOT_HOLD:
        return None
    return f"the last map does not hold: {sentence(last.check.reason)}"


def _exceeds(result: PointResult) -> bool:
    return any(impact.outcome is VerdictOutcome.EXCEEDED for impact in result.impacts)


def _due(row: FleetCampaign, conditions: fm.Conditions, ask: _Ask, report: Path) -> list[str]:
    """What is due of a campaign: of its device, its plan, its last map, and a PDF of an earlier report."""
    words = sentences(due(conditions, ask.today))
    printed = report.with_suffix(".pdf")
    if printed.exists() and report.exists() and printed.stat().st_mtime_ns < report.stat().st_mtime_ns:
        older = f"{printed.name} is older than {report.name}: of an earlier report"
        words.append(f"{older}; forcemap report --pdf writes both")
    if row.missing_runs:
        words.append(sentence(fm.Finding.of(fm.FindingKind.RUNS_LEFT, runs=row.missing_runs)))
    refused = [
        each["point_id"]
        for each in (row.report or {}).get("contact_points") or ()
        if each["outcome"] == "not_permitted"
    ]
    words += [f"contact {'points' if len(refused) > 1 else 'point'} not permitted: {_few(refused)}"] if refused else []
    if row.last_map and row.last_map.outcome != fm.MapOutcome.HOLDS.value and row.last_map.next_step:
        words.append(row.last_map.next_step)
    return words


def _write(answer: FleetAnswer, page: Path, links: dict[str, str]) -> None:
    """Write table and page."""
    from forcemap.report.fleet import FLEET_MARK, fleet_html

    shown = answer.model_dump(mode="json")
    for campaign in shown["campaigns"]:
        for speed in (campaign["report"] or {"speeds": []})["speeds"]:
            speed["programmed"] = _programmed(speed)
    html = fleet_html(shown, links)
    write_result(str(page.with_suffix(".csv")), _table(answer), mark=_TABLE_MARK)
    write_result(str(page), html, mark=f'name="{FLEET_MARK}"')


def _programmed(speed: dict[str, Any]) -> str:
    if not speed["permitted_places"]:
        return ""
    low, high = (fm.floor_speed(speed[f"{end}_speed_to_program_mps"]) for end in ("lowest", "highest"))
    return low if low == high else f"{low} to {high}"


def _table(answer: FleetAnswer) -> str:
    """The table: a row for each campaign, limit and contact, speeds rounded down."""
    rows = []
    for row in answer.campaigns:
        of_row = {
            "folder": row.folder,
            "made_again": csv_cell(row.made_again),
            "failed": row.failed or "",
            "due": "; ".join(row.due),
            "changed": "; ".join(row.changed),
            "last_map": row.last_map.outcome if row.last_map else "",
            "simulated": csv_cell(row.report["simulated"] if row.report else None),
            "read_first": "; ".join(row.report["findings"]) if row.report else "",
        }
        for speed in (row.report or {"speeds": []})["speeds"] or [{}]:
            figures = {key: csv_cell(speed.get(key)) for key in ("limit", "contact", "limit_N", "outcome", "reason")}
            places = {key: csv_cell(speed.get(key)) for key in ("permitted_places", "unconfirmed_places")}
            ends = {key: speed.get(key) for key in ("lowest_speed_to_program_mps", "highest_speed_to_program_mps")}
            floored = {key: "" if v is None or math.isnan(v) else fm.floor_speed(v) for key, v in ends.items()}
            rows.append(of_row | figures | places | floored)
    return csv_text({key: [row[key] for row in rows] for key in rows[0]})


def _lines(answer: FleetAnswer) -> list[str]:
    failed = [f"{row.folder}: {row.failed}" for row in answer.campaigns if row.failed]
    due_of = [f"{row.folder}: {'; '.join(row.due)}" for row in answer.campaigns if row.due]
    changed = [f"{row.folder}: {_few(row.changed)}" for row in answer.campaigns if row.changed]
    verdict = (
        f"{counted(len(answer.campaigns), 'campaign')}: {answer.failed} failed, {answer.made_again} made again, "
        f"{answer.unchanged} unchanged"
    )
    lists = (("FAILED", failed), ("Due", due_of), ("Made again", changed))
    lines = [line for title, rows in lists if rows for line in listing(title, rows)]
    return [
        verdict,
        *lines,
        f"Written: {', '.join(answer.files)}; what every speed rests on stands in each folder's report",
    ]


def _few(words: list[str]) -> str:
    return few(words, 3, "; ")
