"""forcemap register: what a team keeps of its cells, campaigns and releases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

import forcemap as fm
from forcemap.answers.register import (
    ActionAnswer,
    CellAnswer,
    DueAnswer,
    DueEntry,
    EnterAnswer,
    EnteredAnswer,
    ExceededAnswer,
    ExceededEntry,
    ExportAnswer,
    HeadAnswer,
    LargeImpactAnswer,
    NotEntered,
    RegisterMade,
    ReleaseAnswer,
    ReleaseMade,
    RelyingAnswer,
    VerifyAnswer,
    WhoAnswer,
)
from forcemap.cli.options import CONTACT_MISSING, ContactKind, Json, LimitTable, campaign_table
from forcemap.cli.output import SIMULATED, Progress, counted, emit, listing
from forcemap.errors import ForcemapError
from forcemap.files import file_sha256
from forcemap.register import audit
from forcemap.register.connection import Register
from forcemap.register.due import DUE_WITHIN, what_is_due
from forcemap.register.enter import UNKNOWN, change as enter_change, enter as enter_folder, printable
from forcemap.register.exceeded import files_above, where_exceeded
from forcemap.register.export import TABLES, export as export_table
from forcemap.register.release import in_its_place, release as enter_release, withdraw as enter_withdrawal
from forcemap.register.relying import (
    Relying,
    known_of,
    not_known_of,
    relying_on_condition,
    relying_on_device,
    relying_on_map,
    relying_on_recording,
)
from forcemap.register.schema import SCHEMA, make_register, open_register
from forcemap.register.states import cell_state, cell_states
from forcemap.register.structure import altered

Where = Annotated[
    str | None,
    Option(
        "--register",
        metavar="FILE|URL",
        help="SQLite file, or postgresql://HOST/DATABASE without a password; default: FORCEMAP_REGISTER, else a file "
        "of the account.",
    ),
]
Person = Annotated[str, Option("--by", help="Who acts; default: the account of this machine.")]
Cell = Annotated[str, Argument(help="Cell, SITE/NAME; the site may be left out where only one has it.")]
_FEW = 12  # lines of a list in text; the others are in --json

app = typer.Typer(add_completion=False, rich_markup_mode=None, no_args_is_help=True)


@app.callback()
def register() -> None:
    """Keep a team's register: cells and their conditions, campaigns, releases, and whether these are in force.

    A release is in force only if nothing speaks against it and nothing of it is unknown (docs/register.md).

    Example: forcemap register init
    """


@app.command()
def init(where: Where = None, as_json: Json = False) -> int:
    """Make a register, or bring one to the schema of this version; make a backup before.

    Example: forcemap register init
    """
    made, before, roles = make_register(where)
    made.engine.dispose()
    answer = RegisterMade(
        where=made.name,
        schema_before=before or None,
        schema_now=SCHEMA,
        roles=roles if made.postgresql else None,
    )
    was = "new" if not before else "as it was" if before == SCHEMA else f"it was {before}"
    lines = [f"Register {made.name}: schema {SCHEMA}, {was}"]
    if made.postgresql and not roles:
        lines.append("NO ROLES: this account may make none; an administrator makes them (docs/register.md)")
    emit(answer, lines, as_json=as_json)
    return 0


@app.command()
def enter(
    folders: Annotated[list[str], Argument(help="Campaign folders, as collect left them.")],
    cell: Annotated[str, Option("--cell", help="Their cell, SITE/NAME; default: as [protocol] states.")] = "",
    new: Annotated[bool, Option("--new", help="Make the --cell that the register does not know.")] = False,
    where: Where = None,
    person: Person = "",
    as_json: Json = False,
) -> int:
    """Enter campaigns with their recordings, impacts, maps and conditions; what is there already is not entered again.

    One bad folder stops nothing. Exit code: 0 all are in the register, 1 some could not be entered.

    Example: forcemap register enter my-campaign --cell plant-1/cell-7
    """
    entered, failed, last = [], [], None
    with open_register(where) as opened, Progress("campaigns entered", len(folders)) as progress:
        for number, folder in enumerate(folders, start=1):
            try:
                found = enter_folder(opened, folder, cell=cell, new=new, person=person)
            except ForcemapError as error:
                if len(folders) == 1:
                    raise
                failed.append(NotEntered(folder=printable(folder), reason=str(error)))
            else:
                last = found.head
                entered.append(EnteredAnswer.from_result(replace(found, folder=printable(folder))))
            progress.show(number)
    answer = EnterAnswer(entered=entered, failed=failed, head=_head(last) if last else None)
    lines = listing("NOT ENTERED", [f"{each.folder}: {each.reason}" for each in failed]) if failed else []
    for each in entered[:_FEW]:
        what = f"{each.new_recordings} new recordings, {each.new_impacts} new impacts" if each.new else "there already"
        lines.append(f"{each.folder}, {f'cell {each.cell}' if each.cell else 'NO CELL STATED'}: {what}")
        if each.since:
            lines.append(
                f"  OTHER CONTENT OF IT WAS ENTERED SINCE, on {each.since[:10]}: releases of that stay in force; "
                "withdraw those that this folder does not carry (forcemap register withdraw)"
            )
        if each.new_cell:
            lines.append("  NEW CELL: if its name is a slip, releases of the cell that was meant stay in force")
        if each.new and each.releases:
            which = (
                f"{counted(len(each.releases), 'release')} of the cell ({', '.join(map(str, each.releases[:_FEW]))})"
            )
            lines.append(
                f"  {which} rest on other impacts, and end by these where they exceed the limit at a speed that is "
                "released there, unless they were made earlier under other conditions; whether their map holds beside "
                f"the others is not compared: forcemap evaluate {each.folder} --against THEIR-FOLDER"
            )
        lines += [_fact_words(fact) for fact in each.facts]
        lines += _shared(each.also_of)
    lines += [f"and {counted(len(entered) - _FEW, 'folder')} more"] if len(entered) > _FEW else []
    emit(answer, [*lines, *([_head_line(last)] if last else [])], as_json=as_json)
    return 1 if failed else 0


@app.command()
def change(
    cell: Cell,
    conditions: Annotated[list[str], Argument(help="What holds now, as firmware=5.12; firmware=? for not known.")],
    since: Annotated[str, Option("--since", help="Date, YYYY-MM-DD; default: now.")] = "",
    new: Annotated[bool, Option("--new", help="Make a cell that the register does not know.")] = False,
    where: Where = None,
    person: Person = "",
    as_json: Json = False,
) -> int:
    """Enter what has changed at a cell: robot, controller, firmware, safety_checksum, tool, program, covers or device.

    Releases that were made under something else are then not in force any more.

    Example: forcemap register change plant-1/cell-7 firmware=5.12
    """
    pairs = [text.partition("=") for text in conditions]
    if wrong := next((text for text in conditions if "=" not in text), None):
        raise fm.InputError(f"condition: found {wrong[:100]!r}, expected such as firmware=5.12")
    stated = {name.strip(): value for name, _, value in pairs}
    if len(stated) < len(pairs):
        raise fm.InputError("condition: found one twice, expected each once")
    with open_register(where) as opened:
        done = enter_change(opened, cell, stated, since=since, new=new, person=person)
    others = [f"{fact.kind} is {fact.value or 'not known'} since {fact.since[:10]}" for fact in done.others]
    but = f"; WHAT HOLDS NOW IS ANOTHER, stated of a later day: {', '.join(others)}" if others else ""
    return _done(f"{done.cell}: {', '.join(conditions)}{but}", done.head, as_json=as_json)


@app.command()
def state(cell: Cell, where: Where = None, as_json: Json = False) -> int:
    """Show what is known of a cell, its releases and whether they are in force, and its history.

    Exit code: 0 every release that counts is in force, 1 one is not, or there is none.

    Example: forcemap register state cell-7
    """
    with open_register(where) as opened:
        found, events = cell_state(opened, cell)
    answer = CellAnswer.of(found, events)
    lines = [SIMULATED] if any(release.simulated for release in answer.releases) else []
    lines.append(f"{answer.cell}: {answer.standing}")
    lines += [f"  {fact.kind}: {fact.value or 'not known'} since {fact.since[:10]}" for fact in answer.facts]
    lines += [f"  not known: {', '.join(answer.unknown)}"] if answer.unknown else []
    lines += ["Releases", *_release_lines(answer.releases)] if answer.releases else []
    lines += listing(
        "History",
        [
            f"{each.entry}, {each.at[:16]}Z, {each.person}: {each.action} {each.subject}{': ' if each.stated else ''}"
            f"{', '.join(each.stated)}"
            for each in answer.history[:_FEW]
        ],
    )
    emit(answer, lines, as_json=as_json)
    return 0 if answer.in_force else 1


@app.command()
def release(
    cell: Cell,
    folder: Annotated[str, Argument(help="Campaign folder, as it was entered.")],
    valid_until: Annotated[
        str, Option("--valid-until", help="Last day on which it holds, YYYY-MM-DD; it ends at midnight UTC.")
    ],
    area: Annotated[
        list[str] | None, Option("--area", "--region", help="Body area or region; may be given several times.")
    ] = None,
    contact: ContactKind = None,
    limit_table: LimitTable = None,
    task: Annotated[str, Option("--task", help="Name of the task that the body areas are of.")] = "",
    point: Annotated[str, Option("--point", help="Contact point of the campaign, in place of body areas.")] = "",
    report: Annotated[str | None, Option("--report", help="Its report; default: report.html in the folder.")] = None,
    where: Where = None,
    person: Person = "",
    as_json: Json = False,
) -> int:
    """Release the speeds of a campaign for its cell, under the conditions that they were measured under.

    What an export would refuse is refused, and what would not be in force. It replaces an earlier one of the same.

    Example: forcemap register release cell-7 my-campaign --area chest --contact transient --valid-until 2027-02-01
    """
    table = fm.read_limit_table(limit_table) if limit_table else campaign_table(folder)
    if area and contact is None:
        raise fm.InputError(CONTACT_MISSING)
    limits = [(fm.force_limit(name, table=table), contact) for name in dict.fromkeys(area or ()) if contact]
    stated: dict[str, Any] = {"point": point, "task": task, "report": report, "person": person}
    with open_register(where) as opened:
        made = enter_release(opened, cell, folder, limits=limits, valid_until=valid_until, **stated)
        shown = next(each for each in cell_state(opened, made.cell)[0].releases if each.release == made.release)
    answer = ReleaseMade(
        release=made.release, new=made.new, replaces=made.replaces, also_of=list(made.also_of), head=_head(made.head)
    )
    line = f"Release {made.release} {'is entered' if made.new else 'is the same, there already'}"
    line += f"; it replaces release {made.replaces}" if made.replaces else ""
    lines = [line, *_release_lines([ReleaseAnswer.of(shown)]), *_shared(made.also_of)]
    emit(answer, [*lines, _head_line(made.head)], as_json=as_json)
    return 0


@app.command()
def withdraw(
    number: Annotated[int, Argument(help="Number of the release.")],
    reason: Annotated[str, Option("--reason", help="Why.")],
    where: Where = None,
    person: Person = "",
    as_json: Json = False,
) -> int:
    """Withdraw a release, at once and for good.

    Example: forcemap register withdraw 3 --reason 'the gripper was changed'
    """
    with open_register(where) as opened:
        head = enter_withdrawal(opened, number, reason, person=person)
        later = in_its_place(opened, number)
    other = "" if later is None else f"; release {later}, which took its place, is NOT: withdraw it by its own number"
    return _done(f"Release {number} is withdrawn{other}", head, as_json=as_json)


@app.command()
def due(
    within: Annotated[int, Option("--days", min=0, help="Also what ends within so many days.")] = DUE_WITHIN,
    where: Where = None,
    as_json: Json = False,
) -> int:
    """Show what is due: releases that no longer hold, or end soon, cells without one, calibrations.

    Exit code: 0 nothing is due, 1 something is.

    Example: forcemap register due
    """
    with open_register(where) as opened:
        found = what_is_due(opened, within=within)
        cells = bool(found) or bool(cell_states(opened))
    answer = DueAnswer(within_days=within, due=[DueEntry.from_result(each) for each in found])
    lines = (
        listing("Due", map(_due_line, answer.due))
        if found
        else ["Nothing is due" if cells else "There are no cells yet: forcemap register enter"]
    )
    if cells:
        lines.append("not listed: doubts to be read first with speeds in force (forcemap register state CELL)")
    emit(answer, lines, as_json=as_json)
    return 1 if found else 0


@app.command()
def who(
    firmware: Annotated[str | None, Option("--firmware", help="Firmware of the robot.")] = None,
    map_: Annotated[str | None, Option("--map", help="Map file, or its SHA-256 or the beginning of it.")] = None,
    device: Annotated[
        str | None, Option("--device", help="Measuring device, by a part of its model and serial number.")
    ] = None,
    recording: Annotated[
        str | None, Option("--recording", help="File of a recording, or its SHA-256 or the beginning of it.")
    ] = None,
    where: Where = None,
    as_json: Json = False,
) -> int:
    """Show which cells rely on a firmware, a map, a device or a recording, and whether these releases are in force.

    Example: forcemap register who --firmware 5.11
    """
    asked = {"firmware": firmware, "map": map_, "device": device, "recording": recording}
    given = {name: value for name, value in asked.items() if value is not None}
    if len(given) != 1:
        raise fm.InputError("who: expected one of --firmware, --map, --device, --recording")
    ((kind, value),) = given.items()
    with open_register(where) as opened:
        found = _relying(opened, kind, value)
        known = () if found else known_of(opened, kind)
        not_known = not_known_of(opened, kind)
    cells = [
        RelyingAnswer(cell=each.cell, because=each.because, releases=[ReleaseAnswer.of(r) for r in each.releases])
        for each in found
    ]
    answer = WhoAnswer(asked=f"{kind} {printable(value)}", cells=cells, not_known=list(not_known), known=list(known))
    lines = [SIMULATED] if any(release.simulated for each in cells for release in each.releases) else []
    lines.append(f"{counted(len(cells), 'cell')} with {answer.asked}")
    lines += (
        [f"  known are {', '.join(map(repr, known[:_FEW]))}{', ...' if len(known) > _FEW else ''}"] if known else []
    )
    if not_known:
        few = f"{', '.join(not_known[:_FEW])}{', ...' if len(not_known) > _FEW else ''}"
        lines.append(f"NOT KNOWN of {counted(len(not_known), 'cell')}: {few}")
    for relying in cells:
        lines += [f"{relying.cell or 'NO CELL STATED'}: {relying.because}"]
        lines += _release_lines(relying.releases)
    emit(answer, lines, as_json=as_json)
    return 0


@app.command()
def exceeded(
    limit: Annotated[float, Option("--limit-N", help="Force.")],
    where: Where = None,
    as_json: Json = False,
) -> int:
    """Show where impacts exceeded a force, in either phase, and of how many it cannot be told.

    Exit code: 0 nowhere, 1 somewhere, 2 cannot tell.

    Example: forcemap register exceeded --limit-N 280
    """
    with open_register(where) as opened:
        campaigns, largest = where_exceeded(opened, limit)
        files = files_above(opened, limit)
    answer = ExceededAnswer(
        limit_N=limit,
        exceeded=sum(each.exceeded for each in campaigns),
        files=files,
        cannot_tell=sum(each.cannot_tell for each in campaigns),
        campaigns=[ExceededEntry.from_result(each) for each in campaigns],
        largest=[LargeImpactAnswer.from_result(each) for each in largest],
    )
    lines = [SIMULATED] if any(each.simulated for each in campaigns) else []
    lines += [
        f"{limit:g} N: exceeded by {counted(answer.exceeded, 'impact')} in {counted(answer.files, 'file')}, cannot "
        f"tell of {answer.cannot_tell} (within the device's error, or it may have been more than was read)"
    ]
    for each in answer.campaigns[:_FEW]:
        most = "" if each.largest_N is None else f", the largest read {each.largest_N:.1f} N"
        told = f"{each.exceeded} exceed it, {each.cannot_tell} cannot be told{most}"
        simulated = " (simulated)" if each.simulated else ""
        lines.append(f"  - {each.cell or 'NO CELL STATED'}, {each.campaign}{simulated}: {told}")
    if answer.exceeded > answer.files:
        lines.append("  a file counts for every campaign that it was entered with, and for each of its curves")
    lines += [f"  and {len(campaigns) - _FEW} campaigns more: --json"] if len(campaigns) > _FEW else []
    named = [f"{x.largest_N:.1f} N: {x.cell or 'NO CELL STATED'}, {x.campaign}, {x.file}" for x in answer.largest[:3]]
    lines += listing("The largest", named) if named else []
    emit(answer, lines, as_json=as_json)
    return 1 if answer.exceeded else 2 if answer.cannot_tell else 0


@app.command()
def verify(
    head: Annotated[
        str | None, Option("--head", help="Head that was noted elsewhere, NUMBER:SHA256, as on a report.")
    ] = None,
    where: Where = None,
    as_json: Json = False,
) -> int:
    """Find out whether the register is as it was written: every row, every entry of the audit trail and their order.

    Also whether tables, indexes and triggers are those of this version, and a file is undamaged. What was removed at
    the end is found by a head that was noted elsewhere. Exit code: 0 it is, 1 it is not.

    Example: forcemap register verify
    """
    with open_register(where) as opened, opened.reading() as connection:
        problems, now = (*altered(connection), *audit.verify(connection, head)), audit.head(connection)
    answer = VerifyAnswer(holds=not problems, problems=list(problems), head=_head(now))
    lines = listing("NOT AS IT WAS WRITTEN", problems[:_FEW]) if problems else ["The register is as it was written"]
    lines += [f"  and {len(problems) - _FEW} more"] if len(problems) > _FEW else []
    emit(answer, [*lines, _head_line(now)], as_json=as_json)
    return 0 if answer.holds else 1


@app.command()
def export(
    table: Annotated[str, Argument(help=f"One of {', '.join(TABLES)}.")],
    output: Annotated[str, Option("-o", "--output", help="New file: .csv, .json or, with pyarrow, .parquet.")],
    where: Where = None,
    as_json: Json = False,
) -> int:
    """Write a table of the register for other programs; releases say whether they are in force.

    Example: forcemap register export releases -o releases.csv
    """
    with open_register(where) as opened:
        rows = export_table(opened, table, output)
    answer = ExportAnswer(file=output, table=table, rows=rows)
    emit(answer, [f"Written: {printable(output)}, {counted(rows, 'row')} of {table}"], as_json=as_json)
    return 0


def _relying(opened: Register, kind: str, value: str) -> tuple[Relying, ...]:
    is_file = Path(value[:4096]).is_file() if "\0" not in value else False
    if kind in ("map", "recording") and not is_file and Path(value[:4096].strip()).suffix:
        raise fm.InputError("there is no such file", file=printable(value[:200]))
    if kind == "firmware":
        return relying_on_condition(opened, kind, value)
    if kind == "map":
        return relying_on_map(opened, fm.map_sha256(fm.read_map(value)) if is_file else value)
    if kind == "device":
        return relying_on_device(opened, value)
    return relying_on_recording(opened, file_sha256(value) if is_file else value)


def _fact_words(fact: str) -> str:
    """A condition as it is known after a campaign was entered."""
    kind, _, value = fact.partition(": ")
    if value != UNKNOWN:
        return f"  now {fact}"
    return f"  {kind} NOT KNOWN of the campaign's day: another one was stated of it (register change ... --since DAY)"


def _shared(cells: Sequence[str]) -> list[str]:
    """What is said where other cells have the same recordings."""
    if not cells:
        return []
    return [f"  THE SAME RECORDINGS ARE THOSE OF {', '.join(cells)}: were they measured here?"]


def _done(what: str, head: audit.Head, *, as_json: bool) -> int:
    emit(ActionAnswer(done=what, head=_head(head)), [what, _head_line(head)], as_json=as_json)
    return 0


def _head(head: audit.Head) -> HeadAnswer:
    return HeadAnswer(number=head.number, sha256=head.sha256, at=head.at, noted=str(head))


def _head_line(head: audit.Head) -> str:
    return f"Head of the audit trail: {head}"


def _due_line(entry: DueEntry) -> str:
    what: Sequence[str] = [entry.cell, f"release {entry.release}" if entry.release else ""]
    return ": ".join([*([", ".join(filter(None, what))] if entry.cell else []), "; ".join(entry.findings)])


def _release_lines(releases: Sequence[ReleaseAnswer]) -> list[str]:
    """The newest releases: in force or why not, what must be said first, and only then the speeds."""
    lines = []
    for release in releases[:_FEW]:
        limit = "" if release.limit_N is None else f", {release.limit_N:g} N"
        name = f"  - release {release.release}, {release.subject}, {release.areas}, {release.contact}{limit}"
        if release.speeds is None:
            lines.append(f"{name}: NOT IN FORCE: {'; '.join(release.why_not)}")
            lines.append(f"      released by {release.person}; its speeds of then: forcemap register export releases")
            continue
        lines.append(f"{name}: in force until {release.valid_until}{', SIMULATED' if release.simulated else ''}")
        lines += [f"      {warning}" for warning in release.warnings]
        lines.append(f"      {release.to_program}")
        lines += [f"      for what was measured alone: {release.measured_for}"] if release.measured_for else []
        by = f"released by {release.person}; report {release.report_sha256[:12]}"
        lines.append(f"      {release.rests_on}; {by}")
    return lines
