"""forcemap report."""

from __future__ import annotations

import contextlib
import itertools
import os
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

import forcemap as fm
from forcemap.assessment.folder import campaign_limit_table
from forcemap.assessment.missing import Missing
from forcemap.assessment.place_speeds import PlaceSpeeds
from forcemap.campaigns.conditions import CAMPAIGN_FILE
from forcemap.cli import planned
from forcemap.cli.options import (
    BoundOption,
    FormName,
    Json,
    LimitTable,
    Margin,
    Overshoot,
    TeamRegister,
    areas_from,
    of_other_form,
    require_impacts,
    require_one_map,
    several_maps,
    stated_bound,
    wanted_form,
)
from forcemap.cli.output import Progress, counted, emit, listing, verdict_first, write_result
from forcemap.errors import few
from forcemap.files import read_bytes, write_atomically
from forcemap.report.permission import BY_MAP_ALONE, cell_words
from forcemap.report.seal import REPORT_FILE
from forcemap.words import sentence, sentences

if TYPE_CHECKING:
    from forcemap.report import Verification

REPORT_LIST = "report.sha256"
ATLAS_REPORT = "atlas.html"
_STEP, _OVERSHOOT = 0.05, 0.01


def report(
    folder: Annotated[str, Argument(help="Campaign folder; or an atlas, a folder of campaigns of one robot.")],
    output: Annotated[
        str | None, Option("-o", "--output", help="HTML file to write; default: report.html in the folder.")
    ] = None,
    pdf: Annotated[bool, Option("--pdf", help="Write the same as a PDF beside it.")] = False,
    area: Annotated[
        list[str] | None,
        Option(
            "--area",
            help="Body area, or region (the lowest limit of its areas); may be given several times. Default: those of "
            "the contact points, contact_points.csv.",
        ),
    ] = None,
    limit_table: LimitTable = None,
    bound_kind: BoundOption = None,
    margin: Margin = None,
    form: FormName = None,
    step: Annotated[float, Option("--step-m", help="Distance between places of the speed tables [m].")] = _STEP,
    overshoot: Overshoot = _OVERSHOOT,
    date: Annotated[str | None, Option("--date", help="Date of the report, YYYY-MM-DD; default: today.")] = None,
    verify: Annotated[
        str | None, Option("--verify", help="Write nothing: say what changed since this report was written.")
    ] = None,
    register: TeamRegister = None,
    as_json: Json = False,
) -> int:
    """Write the validation report of a campaign, one HTML file that needs nothing beside it; nothing else is changed.

    Of an atlas, the report of every campaign and atlas.html, which shows what they confirm together.

    Exit code: 0 written; 1 written, but the list of contact points cannot be used; with --verify 0 nothing changed,
    1 changed, 2 cannot tell.

    Example: forcemap report my-campaign --area back_of_hand
    """
    if verify is not None:
        if pdf or output or area or limit_table or bound_kind or date or form or register:
            raise fm.InputError("verify: --verify goes with the folder alone; it writes nothing")
        return _verify(verify, folder, as_json=as_json)
    require_impacts(folder)
    several = several_maps(folder)
    target = Path(output or default_file(folder, ATLAS_REPORT if several else REPORT_FILE))
    if not _is_page(target):
        raise fm.InputError("found a name that ends otherwise, expected .html", file=str(target))
    if limit_table and not area:
        raise fm.InputError("limit: --limit-table goes with --area")

    case: dict[str, Any] = {"form": wanted_form(form), "step": step, "allowance": fm.Allowance(speed=overshoot)}
    case |= {"areas": area, "limit_table": limit_table, "bound_kind": bound_kind, "margin": margin}
    if several:
        if register is not None:
            raise fm.InputError("register: --register goes with the folder of one campaign")
        return _report_atlas(folder, target, case, date, pdf=pdf, as_json=as_json)
    assessment = _assessment(folder, **case)
    again = _command(folder, case, {"--form": form, "--date": date, "--register": register}, pdf=pdf)
    files = write_report(assessment, target, date, pdf=pdf, register=register, again=again)
    lines = [
        *answer_lines(assessment),
        f"Written: {', '.join(files)} ({os.path.getsize(files[0]) / 1e6:.1f} MB; an estimate from measurements, not a "
        "certificate)",
        *of_other_form(wanted_form(form), assessment.conditions, "This report is"),
    ]
    verify = f"Later: forcemap report --verify {files[0]} {folder}"
    emit(report_result(assessment, files), [*lines, *_older_pdf(files), verify], as_json=as_json)
    return int(isinstance(assessment.points, Missing))


def _command(folder: str, case: Mapping[str, Any], more: Mapping[str, object], *, pdf: bool) -> str:
    """The command that asks for the same, without the file to write."""
    options = {"--area": case["areas"], "--limit-table": case["limit_table"], "--bound": case["bound_kind"]}
    options |= {"--margin": case["margin"], **more}
    numbers = {"--step-m": (case["step"], _STEP), "--overshoot-mps": (case["allowance"].speed, _OVERSHOOT)}
    options |= {name: number for name, (number, default) in numbers.items() if number != default}
    return planned.command_line("report", folder, options) + " --pdf" * pdf


def _assessment(
    campaign: str | Path,
    *,
    areas: list[str] | None,
    limit_table: str | None,
    bound_kind: str | None,
    margin: float | None,
    **case: Any,
) -> fm.CampaignAssessment:
    """A campaign's whole result, for the limits and the bound that the options name."""
    stated = Path(campaign, "campaign.toml")
    conditions = fm.read_conditions(stated) if stated.exists() else fm.Conditions()
    table = fm.read_limit_table(limit_table) if limit_table else campaign_limit_table(campaign, conditions).table
    recordings = sum(1 for _ in Path(campaign, "recordings").rglob("*"))
    with Progress("recordings judged", recordings) as progress:
        return fm.assess_campaign(
            campaign,
            limits=[fm.force_limit(name, table=table) for name in areas_from(str(campaign), areas)],
            limit_table=table,
            bound=stated_bound(bound_kind, margin, conditions.device.error_or_default),
            progress=lambda done, _: progress.show(done),
            **case,
        )


def default_file(source: str, name: str) -> Path:
    """Where a report goes that names no file: into the folder, or beside atlas.toml."""
    return (Path(source) if Path(source).is_dir() else Path(source).parent) / name


def _report_atlas(
    source: str,
    target: Path,
    case: dict[str, Any],
    date: str | None,
    *,
    pdf: bool,
    as_json: bool,
) -> int:
    """Write the reports of all campaigns of an atlas, and the one of the atlas."""
    from forcemap.assessment.folder_map import map_of_folder
    from forcemap.report import REPORT_MARK, atlas_html

    atlas, root = fm.read_atlas(source, map_of=map_of_folder), default_file(source, "")
    folders = {each.name: root / each.name for each in atlas.campaigns if (root / each.name).is_dir()}
    assessments = {name: _assessment(folder, **case) for name, folder in folders.items()}
    _require_replaceable(None, target, "", pdf=pdf)  # of all, before any is written
    for name, folder in folders.items():
        _require_replaceable(assessments[name], folder / REPORT_FILE, "", pdf=pdf)
    reports, files, lines = {}, [], sentences(atlas.warnings)
    for name, folder in folders.items():
        files += write_report(assessments[name], folder / REPORT_FILE, date, pdf=pdf)
        reports[name] = os.path.relpath(folder / REPORT_FILE, target.parent).replace(os.sep, "/")
        lines += [f"{name}:", *(f"  {line}" for line in answer_lines(assessments[name]))]
    html = atlas_html(atlas, assessments, reports, software=f"forcemap {fm.__version__}", date=date)
    write_result(str(target), html, mark=REPORT_MARK)
    files.append(str(target))
    result = {
        "files": files,
        "simulated": atlas.simulated,
        "map_sha256": atlas.sha256,
        "campaigns": {name: report_result(each, [reports[name]]) for name, each in assessments.items()},
    }
    verify = f"Later: forcemap report --verify {target} {source}"
    emit(result, [*lines, f"Written: {', '.join(files)}", *_older_pdf(files), verify], as_json=as_json)
    return int(any(isinstance(each.points, Missing) for each in assessments.values()))


def write_report(
    assessment: fm.CampaignAssessment,
    target: Path,
    date: str | None,
    *,
    pdf: bool,
    register: str | None = None,
    again: str = "",
) -> list[str]:
    """Write a report with the list of its inputs beside it, and as a PDF if asked for; the names of the files.

    `again` is the command that asked for it, without the file.
    """
    from forcemap.report import LIST_ENDING, REPORT_MARK, inputs_list, report_html, report_pdf

    _require_replaceable(assessment, target, again, pdf=pdf)
    beside, listed = target.with_suffix(".pdf"), target.with_suffix(LIST_ENDING)
    head = "" if register is None else _register_head(register)
    beside_inputs = target.resolve().parent.name == assessment.name
    named = f"{assessment.name}/{target.name}" if beside_inputs else target.name
    html = report_html(assessment, date=date, register_head=head, file=named)
    printed = report_pdf(html) if pdf else b""  # before anything is written
    write_result(str(target), html, mark=REPORT_MARK)
    write_atomically(listed, inputs_list(assessment.inputs))
    if pdf:
        write_atomically(beside, printed)
    return [str(target), str(listed), *([str(beside)] if pdf else [])]


def _is_page(file: Path) -> bool:
    """True if a report may be a file of this name."""
    return file.suffix.lower() in (".html", ".htm")


def _older_pdf(files: Sequence[str]) -> list[str]:
    """PDFs of earlier reports that stay beside those that were written."""
    beside = [str(Path(file).with_suffix(".pdf")) for file in files if _is_page(Path(file))]
    older = [name for name in beside if name not in files and Path(name).exists()]
    return [f"{', '.join(older)}: of an earlier report, not of this one; --pdf writes it again"] if older else []


def _register_head(where: str) -> str:
    from forcemap.register.audit import head
    from forcemap.register.schema import open_register

    with open_register(where) as opened, opened.reading() as connection:
        return str(head(connection))


def _require_replaceable(assessment: fm.CampaignAssessment | None, target: Path, again: str, *, pdf: bool) -> None:
    """Refuse to write over a report that was altered, or that answers for what the new one does not, or another file.

    Without an assessment it is the page of an atlas, which has neither a list nor a PDF.
    """
    from forcemap.report import LIST_ENDING, PDF, is_inputs_list

    beside, listed = target.with_suffix(".pdf"), target.with_suffix(LIST_ENDING)
    if target.exists():
        _require_no_answer_lost(assessment, target, again)
    elif assessment and listed.exists():
        pages = (each for each in target.parent.iterdir() if each.stem == target.stem and _is_page(each))
        if page := next(pages, None):
            raise fm.InputError(f"this is the list of {page.name}; choose another name", file=str(listed))
        if not is_inputs_list(read_bytes(listed)):
            raise fm.InputError("this is another file, no list of inputs; choose another name", file=str(listed))
    if pdf and assessment and beside.exists() and not read_bytes(beside).startswith(PDF):
        raise fm.InputError("this is another file, not an earlier report; choose another name", file=str(beside))


def _require_no_answer_lost(assessment: fm.CampaignAssessment | None, target: Path, again: str) -> None:
    """Refuse to replace a report that was altered, or that answers for what the new one does not."""
    from forcemap.report import LIST_ENDING, MadeFor, altered, is_atlas_page, is_report, read_seal

    content, lost = read_bytes(target), []
    if what := altered(target):
        lost.append(f"{what} was ALTERED since it was written{_SEALED * is_atlas_page(content)}, which is evidence")
    if is_report(content) and is_atlas_page(content) != (assessment is None):
        lost.append("this is the report of a campaign" if assessment is None else "this is the page of an atlas")
    elif assessment:
        with contextlib.suppress(fm.InputError):  # no report that says what it answers for: `write_result` judges it
            earlier = read_seal(content, str(target)).made_for
            if not (wanted := MadeFor.of(assessment)).answers_for(earlier):
                was, now = earlier.unlike(wanted) or "what it does not state", wanted.unlike(earlier)
                lost.append(f"this report was made for {was}, not for {now}, and its answer would be lost")
    if not lost:
        return
    free = next(each for i in itertools.count(2) if not (each := target.with_stem(f"{target.stem}-{i}")).exists())
    other = f", or name another file: {again} -o {shlex.quote(str(free))}" if again else ""
    listed = target.with_suffix(LIST_ENDING)
    both = f"move it and {listed.name} away and keep both" if listed.exists() else "move it away and keep it"
    raise fm.InputError(f"{'; '.join(lost)}: it is not replaced; {both}{other}", file=str(target))


_SEALED = " (or is of an earlier version, without a seal)"


def _verify(file: str, folder: str, *, as_json: bool) -> int:
    from forcemap.report import is_atlas_page, verify_report

    if Path(file).is_file() and is_atlas_page(read_bytes(file)):
        return _verify_atlas(file, folder, as_json=as_json)
    require_one_map(folder)
    changes = verify_report(file, folder)
    figures = asdict(changes)
    result = {"holds": changes.holds, "report_intact": figures.pop("intact"), **figures}
    lines = [
        _compared(changes),
        f"Report of {changes.date}, written by {changes.software}",
    ]
    lines += [] if changes.intact else ["ALTERED: the report file is not as it was written"]
    if changes.list_altered:
        lines.append("ALTERED: the list of inputs beside the report is not the one of its digest")
    groups = (("Changed", changes.changed), ("Vanished", changes.vanished), ("New", changes.new))
    for title, files in (*groups, ("Only line ends changed", changes.line_ends)):
        lines += listing(title, map(printable, files)) if files else []
    if CAMPAIGN_FILE in changes.changed:
        lines.append(f"What {CAMPAIGN_FILE} said when the report was written stands in its sections 2 to 4")
    if not (changes.inputs_hold or changes.listed):
        lines.append("The inputs are not those of the digest; which of them changed, the list tells as it was written")
    if not changes.nothing_changed:
        lines.append(f"{changes.unchanged} input files as then")
    if changes.not_compared:
        title = "Not compared, as the report does not list them among its inputs"
        lines += listing(title, map(printable, changes.not_compared))
    lines.append(f"Digest of the input files on page 1 of the report: {changes.digest}")
    if changes.digest_now != changes.digest:
        lines.append(f"Digest of the input files as they are now: {changes.digest_now}")
    emit(result, lines, as_json=as_json)
    return 0 if changes.holds else 2 if changes.nothing_changed else 1


def _verify_atlas(file: str, atlas: str, *, as_json: bool) -> int:
    """Whether the page of an atlas is of its campaigns and their reports as they are."""
    from forcemap.report import verify_atlas

    found = verify_atlas(file, atlas)
    groups = {"Changed": found.changed, "Vanished": found.vanished, "New": found.new}
    if found.holds:
        lines = ["Unchanged: the page, its campaigns and their reports are as they were when it was written"]
    elif found.nothing_changed:
        lines = [
            f"CANNOT TELL whether all is as when the page was written: {few(found.not_compared)} rest on a table of "
            "limits that is no file of their folder and was not compared; compare it with the one in force before you "
            "go by the page, or put it into the folder and have the reports rewritten"
        ]
    else:
        what = ["the page"] * (not found.intact) + ["campaigns or their reports"] * any(groups.values())
        lines = [
            f"CHANGED since the page was written: {', '.join(what)}; do not go by it, have the reports written anew"
        ]
    lines.append(f"Page of {found.date}, written by {found.software}")
    for title, names in groups.items():
        lines += listing(title, map(printable, names)) if names else []
    if found.changed:
        lines.append("What changed of each: forcemap report --verify, with its report and its folder")
    figures = asdict(found)
    emit({"holds": found.holds, "report_intact": figures.pop("intact"), **figures}, lines, as_json=as_json)
    return 0 if found.holds else 2 if found.nothing_changed else 1


def _compared(changes: Verification) -> str:
    """Whether a report and all that it rests on are as they were, and what to do if not."""
    tables = ", ".join(f"{digits}..." for digits in changes.tables_not_compared)
    lacking = f"its table of limits (SHA-256 {tables}) is no file of the folder and was not compared" if tables else ""
    if changes.nothing_changed and lacking:
        do = "compare it with the one in force before you sign, or put it into the folder and have the report rewritten"
        return f"CANNOT TELL whether all is as when the report was written: {lacking}; {do}"
    if changes.nothing_changed:
        other = len(changes.not_compared)
        beside = f"; {counted(other, 'other file')} of the folder not compared" * bool(other)
        inputs = counted(changes.unchanged, "input file")
        return f"Unchanged: the report and its {inputs} are as they were when it was written{beside}"
    what = ["the report file"] * (not changes.intact) + ["the list of its inputs"] * changes.list_altered
    what += ["input files"] * (not changes.inputs_hold)
    if not changes.intact:
        do = "do not sign it; keep this file, and ask for the report as it was written"
    elif changes.inputs_hold:
        do = "do not sign it before the list beside it is the one that was written"
    else:
        do = "do not sign it; ask who changed what, then restore it or have the report written anew"
    return f"CHANGED since the report was written: {', '.join(what)}; {do}{f'; also {lacking}' if lacking else ''}"


def report_result(assessment: fm.CampaignAssessment, files: list[str]) -> dict[str, Any]:
    """What `--json` says of a report."""
    parts = {name: getattr(assessment, name) for name in ("dataset", "recordings", "force_map", "bound")}
    return {
        "files": files,
        "simulated": assessment.simulated,
        "findings": sentences(assessment.findings),
        "missing": {name: part.reason for name, part in parts.items() if isinstance(part, Missing)},
        "speeds": [
            {
                "limit": part.limit.name,
                "contact": part.contact.value,
                "limit_N": part.limit.force(part.contact) if part.limit.permitted else None,
                "outcome": _outcome(part),
                "reason": part.speeds.reason if isinstance(part.speeds, Missing) else "",
                "confirmed_by": list(part.confirmed_by),
                "permitted_places": part.confirmed,
                "unconfirmed_places": part.unconfirmed,
                "lowest_speed_mps": part.slowest,
                "highest_speed_mps": part.fastest,
                "lowest_speed_to_program_mps": part.slowest_to_program,
                "highest_speed_to_program_mps": part.fastest_to_program,
            }
            for part in assessment.speeds
        ],
        "contact_points": _points(assessment),
        "not_stated": [each.entry for each in assessment.not_stated],
        "inputs": {printable(file.path): file.sha256 for file in assessment.inputs},
    }


def _outcome(part: PlaceSpeeds) -> str:
    """Whether any place has a speed for a limit, and whether impacts confirmed it."""
    if part.confirmed:
        return "confirmed" if part.confirmed_by else "permitted_by_the_map"
    return "unconfirmed" if part.limit.permitted else "not_permitted"


def _points(assessment: fm.CampaignAssessment) -> list[dict[str, Any]] | None:
    """Every contact point; None if their list cannot be used."""
    from forcemap.report.permission import pressure_words

    if isinstance(assessment.points, Missing):
        return None
    return [
        {
            "point_id": result.point.name,
            "outcome": result.outcome.value,
            "limit": result.point.limit.name,
            "contact": result.point.contact.value,
            "speed_to_program_mps": result.speed,
            "programmed_mps": result.point.programmed,
            "confirmed_by": list(result.confirmed_by),
            "rests_on": sentences(result.rests_on),
            "lacks": sentences(result.lacks),
            "pressure": pressure_words(result),
        }
        for result in assessment.points
    ]


def answer_lines(assessment: fm.CampaignAssessment) -> list[str]:
    """What is permitted: in a word, what must be read with it, then every contact point, body area and contact."""
    return [
        *verdict_first(_verdict(assessment), sentences(assessment.findings), simulated=assessment.simulated),
        *_point_lines(assessment),
        *map(_limit_line, assessment.speeds),
    ]


def _verdict(assessment: fm.CampaignAssessment) -> str:
    """The speeds for every limit, for which there are none, and how many contact points are permitted."""
    parts, without = [], []
    for part in assessment.speeds:
        name = f"{part.limit.name} {part.contact}"
        if part.confirmed and not part.not_released:
            low, high = fm.floor_speed(part.slowest_to_program), fm.floor_speed(part.fastest_to_program)
            at_places = " to ".join(f"{fm.floor_speed(speed)}" for speed in part.of_table)
            between = f" ({at_places} at its places)" if at_places != f"{low} to {high}" else ""
            parts.append(f"{name}: program {low} to {high} m/s, at its places, between them and at the edge{between}")
        else:
            without.append(name)
    parts += [f"NO SPEED for {', '.join(without)}"] if without else []
    if not isinstance(assessment.points, Missing) and assessment.points:
        count = sum(not result.lacks for result in assessment.points)
        held = sum(result.if_reason for result in assessment.points)
        why = f", {held} of them IF the risk assessment says why" if held else ""
        parts.append(f"{count} of {counted(len(assessment.points), 'contact point')} permitted{why}")
        if count < len(assessment.points):
            parts.append(cell_words(assessment).removesuffix(".").upper())
    return "; ".join(parts) or "NO SPEED: no limit was asked for"


def _limit_line(part: PlaceSpeeds) -> str:
    """What is permitted for a body area and contact, or why nothing is."""
    name = f"{part.limit.name}, {part.contact}"
    if part.not_released:
        return f"{name}: no place permitted: {sentence(part.not_released)}"
    if isinstance(part.speeds, Missing):
        return f"{name}: no speed: {part.speeds.reason}"
    newtons = f"{name}, {part.limit.force(part.contact):g} N"
    if not part.confirmed:
        return f"{newtons}: no place permitted"
    return (
        f"{newtons}: {part.confirmed} places {_permitted(part)}, program at most "
        f"{fm.floor_speed(part.slowest_to_program)} to {fm.floor_speed(part.fastest_to_program)} m/s "
        f"({fm.floor_speed(part.slowest)} to {fm.floor_speed(part.fastest)} m/s at contact), at these places, "
        f"between them and at the edge; {part.unconfirmed} places without a speed"
    )


def _permitted(part: PlaceSpeeds) -> str:
    by = f"permitted by the map, which {len(part.confirmed_by)} impacts confirm"
    return by if part.confirmed_by else BY_MAP_ALONE


def _point_lines(assessment: fm.CampaignAssessment) -> list[str]:
    """A line for every contact point."""
    if isinstance(assessment.points, Missing):
        return ["contact points: NONE PERMITTED, their list cannot be used"]
    lines = []
    for result in assessment.points:
        said = f"{result.words}: {sentence(result.lacks[0])}" if result.lacks else f"{result.words}, program at most "
        said += "" if result.lacks else f"{fm.floor_speed(result.speed)} m/s"
        lines.append(f"contact point {result.point.name}: {said}")
    return lines


def printable(path: str) -> str:
    """A path whose bytes are no UTF-8, or that holds control characters, as it can be printed."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in path)
