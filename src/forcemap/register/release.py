"""Releasing speeds of a cell, and withdrawing them: only what an export would give, and only what would be in force."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sqlalchemy import ColumnElement, Connection, case, func, or_, select

import forcemap as fm
from forcemap.assessment.missing import present
from forcemap.assessment.point_results import PointOutcome, doubts_at_points
from forcemap.campaigns.conditions import CAMPAIGN_FILE
from forcemap.campaigns.impacts_table import TABLE_FILE, as_entered
from forcemap.campaigns.point_list import POINTS_FOLDER
from forcemap.campaigns.recordings_table import Use
from forcemap.campaigns.state import CONFIRMING
from forcemap.campaigns.units import unit_finding
from forcemap.errors import InputError, NotReleasable, RegisterError, few
from forcemap.exports.robot_table import require_exportable
from forcemap.files import file_sha256, read_bytes, stated_date
from forcemap.findings import Finding, FindingKind
from forcemap.maps.slower_impacts import slow_impacts_missing
from forcemap.register.audit import Action, Head, head, stated
from forcemap.register.connection import Register
from forcemap.register.contradicted import POINT, contradicted_since, contradicts, entered_after
from forcemap.register.enter import cells_with, entered_before, facts_of, require_cell, same_campaign
from forcemap.register.folder import CampaignContent, force_map_of, read_content
from forcemap.register.in_force import DEVICE, Fact, Released, failed
from forcemap.register.tables import AUDIT, CAMPAIGNS, CELLS, IMPACTS, RELEASES, USES, WITHDRAWALS
from forcemap.speeds.basis import Basis, limit_basis, unconfirmed
from forcemap.speeds.quantities import cases_of
from forcemap.words import assumptions, sentence, sentences, warnings

_MADE_FOR = (FindingKind.DIRECTION, FindingKind.CONTACT_SITE, FindingKind.TOOL, FindingKind.SAFETY_SETTINGS)
_Limits = Sequence[tuple[fm.ForceLimit, fm.Contact]]


@dataclass(frozen=True)
class ReleaseEntered:
    """A release as it was entered.

    Parameters
    ----------
    release : int
        Its number.
    new : bool
        False if the same was released already.
    replaces : int or None
        The release of the same whose place it takes.
    cell : str
        SITE/NAME of its cell.
    also_of : tuple of str
        Other cells that have campaigns with its recordings.
    head : Head
        The newest entry of the audit trail.
    """

    release: int
    new: bool
    replaces: int | None
    cell: str
    also_of: tuple[str, ...]
    head: Head


@dataclass(frozen=True, eq=False)
class _Speeds:
    """What is released: speeds with the limit, the bound and the form of the map that they rest on; no form without."""

    subject: str
    limits: _Limits
    bound: str
    speeds: dict[str, Any]
    map_sha256: str | None
    form: str

    @property
    def as_json(self) -> str:
        """The speeds as the register keeps them."""
        return json.dumps(self.speeds, sort_keys=True)


def release(
    register: Register,
    cell: str,
    folder: str | Path,
    *,
    limits: _Limits = (),
    point: str = "",
    task: str = "",
    valid_until: str,
    report: str | Path | None = None,
    person: str = "",
) -> ReleaseEntered:
    """Release the speeds of a campaign for its cell, with the conditions that they were measured under.

    What an export would refuse is refused, and what would not be in force. It takes the place of an earlier release of
    the same subject, body areas and contact; the same again, while it is in force, changes nothing.

    Parameters
    ----------
    register : Register
    cell : str
        SITE/NAME.
    folder : str or Path
        The campaign, as it was entered.
    limits : sequence of (ForceLimit, Contact)
        Of whatever can be touched anywhere in the workspace; all of them hold.
    point : str
        In place of limits, a contact point of the campaign's list.
    task : str
        Name of the task that the limits are of.
    valid_until : str
        The last day on which it holds, YYYY-MM-DD.
    report : str or Path, optional
        The report that was written of it; report.html in the folder if not given.
    person : str
        Who releases; the account of this machine if not given.

    Raises
    ------
    InputError
        No limit, or both limits and a point; a date that is none, or is over.
    NotReleasable
        The report is not of the campaign as it is, nothing may be exported of it, no place has a speed, or it would
        not be in force.
    RegisterError
        The campaign was not entered for this cell, or the database refuses it.
    """
    from forcemap.report import REPORT_FILE

    if bool(point) == bool(limits):
        raise InputError("release: expected body areas with a contact, a task, or a contact point")
    until = stated_date("valid until", valid_until).isoformat()
    content = read_content(folder)
    written = Path(report) if report else content.folder / REPORT_FILE
    found = _of_point(content, point) if point else _of_workspace(content, limits, task)
    refused = _require_report(written, content, found)
    if point in refused:
        raise NotReleasable(f"nothing is released of point {point}: its report does not permit it", file=str(written))
    if unstated := content.not_stated:
        how = f"state it in {content.folder / CAMPAIGN_FILE}, collect, report and enter again"
        raise NotReleasable(
            f"nothing is released: what its impacts were measured under is not known: {'; '.join(unstated)}; {how}"
        )
    with register.writing() as connection:
        number, cell = require_cell(connection, cell)
        action = Action(register, connection, person)
        facts = facts_of(connection, number)
        found = _said_first(found, _doubts(connection, content, number, facts))
        of_points = refused if content.points else _refused_before(connection, number)
        found = _measured_for(_beside_points(found, of_points, listed=bool(content.points)), content)
        values = _values(content, found, file_sha256(written)) | {"valid_until": until}
        values |= {"cell_id": number, "campaign_id": _campaign(connection, content, number, cell)}
        against = contradicts(connection, values), entered_after(connection, values["campaign_id"])
        values["speeds"] = _said_first(found, [*filter(None, against)]).as_json
        also_of = cells_with(connection, [entry.sha256 for entry in content.campaign.entries], number)
        earlier = _before(connection, values)

        def wrong_with(row: Any, **since: Any) -> tuple[fm.Finding, ...]:
            return failed(released(row), facts, (), replaced_by=None, now=action.at, **since)

        same = earlier and not earlier["withdrawn"] and all(earlier[name] == value for name, value in values.items())
        if same and not wrong_with(earlier, **_since(connection, earlier["id"])):
            return ReleaseEntered(earlier["id"], False, earlier["replaces"], cell, also_of, head(connection))
        values |= {"replaces": earlier["id"] if earlier else None, "person": action.person, "at": action.at}
        if wrong := wrong_with({**values, "entry": action.entry}):
            raise NotReleasable(f"nothing is released, it would not be in force: {'; '.join(sentences(wrong))}")
        release = action.add(RELEASES, **values)
        done = action.done("release", f"release {release}", cell=cell, of=found.subject, valid_until=until)
    return ReleaseEntered(release, True, values["replaces"], cell, also_of, done)


def _since(connection: Connection, release: int) -> dict[str, Any]:
    """What speaks against a release that was entered after it, by the names of `failed`."""
    which = RELEASES.c.id == release
    again, contradicted = entered_again(connection, which), contradicted_since(connection, which)
    return {"entered_again": again.get(release), "contradicted": contradicted.get(release)}


def _doubts(connection: Connection, content: CampaignContent, cell: int, facts: Sequence[Fact]) -> list[Finding]:
    """That recordings were entered before under other conditions, or that these were others after the measurements."""
    before, others = entered_before(connection, content, cell), _others_since(content, facts)
    doubts = [Finding.of(FindingKind.RELEASED_ENTERED_BEFORE, changes=before)] if before else []
    return doubts + ([Finding.of(FindingKind.RELEASED_CHANGED_BACK, conditions=others)] if others else [])


def _others_since(content: CampaignContent, facts: Sequence[Fact]) -> tuple[str, ...]:
    """Conditions of the cell that were others after the measurements, whatever they are now: entry, value and day."""
    last, stated = content.measured[1] or "", content.conditions
    others = [fact for fact in facts if fact.kind != DEVICE and fact.since[:10] > last and fact.value is not None]
    return tuple(f"{f.kind} {f.value} from {f.since[:10]} on" for f in others if f.value != stated.get(f.kind))


def withdraw(register: Register, number: int, reason: str, *, person: str = "") -> Head:
    """Withdraw a release, at once and for good.

    Parameters
    ----------
    register : Register
    number : int
        Of the release.
    reason : str
    person : str
        Who withdraws it; the account of this machine if not given.

    Raises
    ------
    RegisterError
        There is no such release, or the database refuses it.
    """
    reason = stated("reason", reason, longest=500)
    with register.writing() as connection:
        if connection.execute(select(RELEASES.c.id).where(RELEASES.c.id == number)).first() is None:
            raise RegisterError(f"there is no release {number}; forcemap register state CELL lists those of a cell")
        query = select(WITHDRAWALS.c.at, WITHDRAWALS.c.person).where(WITHDRAWALS.c.release_id == number)
        if before := connection.execute(query).first():
            raise RegisterError(f"release {number} was withdrawn already, on {before.at[:10]} by {before.person}")
        action = Action(register, connection, person)
        action.add(WITHDRAWALS, release_id=number, reason=reason, person=action.person, at=action.at)
        return action.done("withdraw", f"release {number}", reason=reason)


def in_its_place(register: Register, number: int) -> int | None:
    """The last release that has taken the place of another, directly or in turn; None without one, or if withdrawn."""
    with register.reading() as connection:
        last = number
        while (by := connection.execute(select(RELEASES.c.id).where(RELEASES.c.replaces == last)).scalar()) is not None:
            last = int(by)
        ended = connection.execute(select(WITHDRAWALS.c.id).where(WITHDRAWALS.c.release_id == last)).first()
    return None if last == number or ended else last


def released(row: Any) -> Released:
    """What decides whether a release is in force, of its row."""
    return Released(
        entry=row["entry"],
        at=row["at"],
        valid_until=row["valid_until"],
        conditions=json.loads(row["conditions"]),
        areas=row["areas"],
        campaign=row["campaign_id"],
        measured_from=row["measured_from"],
        measured_on=row["measured_on"],
        calibrated=row["calibrated"],
        calibrated_until=row["calibrated_until"],
        device_spring=row["device_spring_N_per_m"],
        area_spring=row["area_spring_N_per_m"],
    )


def entered_again(connection: Connection, *which: ColumnElement[bool]) -> dict[int, str]:
    """When campaigns of releases were entered again after these, for the same cell."""
    later = CAMPAIGNS.alias()
    query = select(RELEASES.c.id, func.max(AUDIT.c.at))
    query = query.join_from(RELEASES, CAMPAIGNS, RELEASES.c.campaign_id == CAMPAIGNS.c.id)
    query = query.join(later, same_campaign(later) & (later.c.entry > RELEASES.c.entry))
    query = query.join(AUDIT, AUDIT.c.id == later.c.entry).where(*which).group_by(RELEASES.c.id)
    return {row[0]: row[1] for row in connection.execute(query)}


def entered_elsewhere(connection: Connection, *which: ColumnElement[bool]) -> dict[int, tuple[str, str, str]]:
    """Releases whose recordings were entered after them for another cell, or none, as of the same robot under other
    conditions.

    With site and name of that cell, and when: a robot measured them under one set of conditions.
    """
    impacts, uses, other = IMPACTS.alias(), USES.alias(), CAMPAIGNS.alias()
    stated = (CAMPAIGNS.c.conditions, other.c.conditions.label("others"))
    query = select(RELEASES.c.id, CELLS.c.site, CELLS.c.name, AUDIT.c.at, *stated)
    query = query.join_from(RELEASES, CAMPAIGNS, RELEASES.c.campaign_id == CAMPAIGNS.c.id)
    query = query.join(USES, USES.c.campaign_id == CAMPAIGNS.c.id).join(IMPACTS, USES.c.impact_id == IMPACTS.c.id)
    query = query.join(impacts, impacts.c.recording_id == IMPACTS.c.recording_id)
    query = query.join(uses, uses.c.impact_id == impacts.c.id).join(other, uses.c.campaign_id == other.c.id)
    query = query.outerjoin(CELLS, other.c.cell_id == CELLS.c.id).join(AUDIT, AUDIT.c.id == other.c.entry)
    elsewhere = func.coalesce(other.c.cell_id, 0) != CAMPAIGNS.c.cell_id
    query = query.where(elsewhere, other.c.entry > RELEASES.c.entry, other.c.conditions != CAMPAIGNS.c.conditions)
    rows = connection.execute(query.where(*which).distinct().order_by(AUDIT.c.at)).all()
    same = (row for row in rows if json.loads(row.conditions)["robot"] == json.loads(row.others)["robot"])
    return {row.id: (row.site or "", row.name or "", row.at) for row in same}


def _of_workspace(content: CampaignContent, limits: _Limits, task: str) -> _Speeds:
    """The speeds of all places, as an export gives them."""
    force_map = force_map_of(content)
    bound = fm.ToleranceBound(device_error=force_map.conditions.device.error_or_default)
    table = fm.robot_table(force_map, limits=limits, bound=bound)
    if not table.permitted:
        why = sentence(table.refusal) or sentence(table.reason.tolist()[0][0])
        raise NotReleasable(f"nothing is released, no place has a speed: {why}")
    permitted = table.speed_mmps[table.speed_mmps > 0]
    speeds = {
        "lowest_to_program_mps": int(permitted.min()) / 1000,
        "highest_to_program_mps": int(permitted.max()) / 1000,
        "zones": int(table.speed_mmps.size),
        "zones_with_a_speed": table.permitted,
        "distance_edges_m": table.distance_edges.tolist(),
        "height_edges_m": table.height_edges.tolist(),
        "speed_mmps": table.speed_mmps.tolist(),
        **_said(table.provenance.bases, table.provenance.notes),
    }
    subject = f"task {stated('task', task, longest=100)}" if task else "workspace"
    return _Speeds(subject, limits, str(bound), speeds, fm.map_sha256(force_map), force_map.form.name)


def _measured_for(found: _Speeds, content: CampaignContent) -> _Speeds:
    """The same speeds, which say what was measured: at a contact point its own site and direction."""
    conditions = content.campaign.conditions
    for point in content.points:
        if found.subject == f"{POINT}{point.name}":
            conditions = replace(conditions, contact_site=point.contact_site, direction=point.direction)
    of = sentences(each for each in conditions.findings if each.kind in _MADE_FOR)
    return replace(found, speeds=found.speeds | {"measured_for": "; ".join(of)})


def _said_first(found: _Speeds, doubts: Sequence[Finding]) -> _Speeds:
    """The same speeds, which say doubts before all others."""
    return replace(found, speeds=found.speeds | {"warnings": [*sentences(doubts), *found.speeds["warnings"]]})


def _beside_points(found: _Speeds, refused: Sequence[str], *, listed: bool) -> _Speeds:
    """The same speeds, which say first which contact points are not permitted, and name them apart.

    `listed`: by the campaign's own list; else by an earlier release of the cell.
    """
    figures = {"points": ", ".join(refused), "earlier": None if listed else True}
    said = [Finding.of(FindingKind.RELEASED_BESIDE_POINTS, **figures)] if refused else []
    found = _said_first(found, said)
    return replace(found, speeds=found.speeds | {"points_not_permitted": list(refused)})


def _of_point(content: CampaignContent, name: str) -> _Speeds:
    """The speed of a contact point, as the report judges it, behind the gate of exports."""
    points = {point.name: point for point in content.points}
    if name not in points:
        raise InputError(f"point: found {name[:100]!r}, expected one of {', '.join(points) or 'contact_points.csv'}")
    if refusal := points[name].limit.refusal:
        raise NotReleasable(f"nothing is released of point {name}: {sentence(refusal)}")
    assessment = fm.assess_campaign(content.folder)
    result = next(result for result in present(assessment.points) if result.point.name == name)
    point = result.point
    if result.outcome is PointOutcome.NOT_PERMITTED:
        raise NotReleasable(f"nothing is released of point {name}: {'; '.join(sentences(result.lacks))}")
    bases: list[Basis] = []
    bound, digest, form = "impacts at the point", None, ""
    of_campaign = as_entered(content.campaign.conditions, content.folder)
    if content.dataset is None and any(entry.use is Use.USED for entry in content.campaign.entries):
        raise NotReleasable(f"nothing is released of point {name}: there is no {TABLE_FILE}; run forcemap collect")
    if content.dataset is not None:
        table = content.dataset
        phase_two, binding = table.phase_two, table.binding
        bases.append(limit_basis(point.limit, point.contact, table.conditions, phase_two=phase_two, binding=binding))
    if point.by_map:
        force_map, carried = present(assessment.force_map), present(assessment.bound)
        bases.append(cases_of(force_map, point.limit, bound=carried, contact=point.contact)[0].basis)
        bound, digest, form = str(carried), fm.map_sha256(force_map), force_map.form.name
    for basis in bases:
        _gate(basis)
    speed = fm.floor_speed(result.speed)
    ends: dict[str, Any] = {"lowest_to_program_mps": float(speed), "highest_to_program_mps": float(speed)}
    if point.placed:
        ends |= {"distance_m": [point.distance, point.distance_to], "height_m": [point.height, point.height_to]}
    speeds = {**ends, "outcome": str(result.outcome), "confirmed_by": list(result.confirmed_by)}
    speeds |= _said(bases, result.rests_on)
    held = [note for note in result.rests_on if note.kind is FindingKind.POINT_HELD_AS_FREE]
    units = unit_finding(of_campaign)
    slow = doubts_at_points((result,), assessment.force_map)
    if result.confirmed_by and isinstance(assessment.force_map, fm.ForceMap):
        slow += filter(None, [slow_impacts_missing(assessment.force_map)])
    doubts = [*of_campaign.doubts, *([units] if units and units.figure("missing") else []), *slow]
    speeds["warnings"] = list(dict.fromkeys([*sentences(held), *speeds["warnings"], *sentences(doubts)]))
    along = [note for note in result.rests_on if note.kind is FindingKind.ALONG_ONLY]
    speeds |= {"holds_for": sentence(along[0])} if along else {}
    return _Speeds(f"{POINT}{name}", ((point.limit, point.contact),), bound, speeds, digest, form)


def _said(bases: Sequence[Basis], notes: Sequence[Finding]) -> dict[str, Any]:
    """What must be said before speeds, and what they rest on, as it was said when they were released.

    That no impacts confirm them is said first, and `confirmed` tells it to programs.
    """
    confirmed = not any(unconfirmed(basis.notes) for basis in bases)
    first = [] if confirmed else [sentence(Finding.of(FindingKind.RELEASED_UNCONFIRMED))]
    impacts = [
        note.figure("impacts") for basis in bases for note in basis.notes if note.kind is FindingKind.CONFIRMED_BY
    ]
    told = {"confirmed": confirmed, "confirming_impacts": min(impacts) if confirmed and impacts else None}
    return {**told, "warnings": [*first, *warnings(bases)], "assumptions": assumptions(bases, notes)}


def _gate(basis: Basis) -> None:
    require_exportable(basis)
    if basis.refusal:
        raise NotReleasable(f"nothing is released: {sentence(basis.refusal)}")


def _require_report(report: Path, content: CampaignContent, found: _Speeds) -> tuple[str, ...]:
    """Refuse a report of another campaign, area, bound or form; else the contact points that it does not permit."""
    from forcemap.report import area_with_table, read_seal, verify_report

    if not report.is_file():
        raise NotReleasable("there is no report of it; forcemap report writes it", file=str(report))
    areas = [] if content.points else [f"--area {limit.name}" for limit, _ in found.limits]  # else those of all points
    command = " ".join(["forcemap report", str(content.folder), *areas])
    again = f"move it away and write another, with the options that it was made with: {command}"
    since = verify_report(str(report), str(content.folder))
    if not since.intact or since.list_altered:
        which = "the report" if not since.intact else "the list of inputs beside the report"
        raise NotReleasable(
            f"{which} was ALTERED since it was written: keep both as evidence; {again}", file=str(report)
        )
    if not since.nothing_changed:
        raise NotReleasable(f"the report is not of the campaign as it is now; {again}", file=str(report))
    made_for = read_seal(read_bytes(report), str(report)).made_for
    for limit, _ in found.limits:
        if area_with_table(limit) not in made_for.areas:
            which = f"{limit.name} with its limits of {limit.edition}"
            raise NotReleasable(f"the report is not of {which}; {again}", file=str(report))
    if made_for.refused is None:
        raise NotReleasable(f"the report is of an earlier version; {again}", file=str(report))
    if found.form and (made_for.bound, made_for.form) != (found.bound, found.form):
        other = f"{made_for.form or 'no map'} with {made_for.bound}"
        raise NotReleasable(
            f"the report is of {other}, the speeds of {found.form} with {found.bound}; {again}", file=str(report)
        )
    return made_for.refused


def _refused_before(connection: Connection, cell: int) -> list[str]:
    """Contact points that the newest release of a cell names as not permitted: a campaign without a list says nothing
    of them."""
    query = select(RELEASES.c.speeds).where(RELEASES.c.cell_id == cell).order_by(RELEASES.c.id.desc())
    named = (json.loads(row.speeds).get("points_not_permitted") for row in connection.execute(query))
    return next((names for names in named if names is not None), [])


def _values(content: CampaignContent, found: _Speeds, report: str) -> dict[str, Any]:
    """The columns of a release that follow from the campaign."""
    conditions = content.campaign.conditions
    (first, last), (calibrated, until) = content.measured, content.calibration
    springs = [limit.stiffness for limit, _ in found.limits]
    spring = max(springs) if springs and not any(map(math.isnan, springs)) else None
    dataset = content.dataset
    return {
        "subject": found.subject,
        "areas": ", ".join(sorted({limit.name for limit, _ in found.limits})),
        "contact": ", ".join(sorted({str(contact) for _, contact in found.limits})),
        "limit_N": min(float(limit.force(contact)) for limit, contact in found.limits),
        "bound": found.bound,
        "speeds": found.as_json,
        "map_sha256": found.map_sha256,
        "report_sha256": report,
        "conditions": json.dumps(content.conditions, ensure_ascii=False, sort_keys=True),
        "measured_from": first,
        "measured_on": last,
        "calibrated": calibrated,
        "calibrated_until": until,
        "device_spring_N_per_m": None if math.isnan(conditions.device.stiffness) else conditions.device.stiffness,
        "area_spring_N_per_m": spring,
        "simulated": int(conditions.simulated or (dataset is not None and dataset.simulated)),
    }


def _campaign(connection: Connection, content: CampaignContent, cell: int, named: str) -> int:
    query = select(CAMPAIGNS).where(CAMPAIGNS.c.sha256 == content.sha256, CAMPAIGNS.c.cell_id == cell)
    found = connection.execute(query).mappings().first()
    if found is None:
        message = f"the campaign as it is now was not entered for the cell {named}; forcemap register enter"
        raise RegisterError(message, file=str(content.folder))
    if missing := _measured_elsewhere(connection, int(found["id"]), cell):
        message = (
            f"impacts that were to confirm this campaign's map, or at its contact points, were entered for the cell "
            f"{named} and are not in this folder: {few(missing)}; what they measured counts: put their recordings back "
            "and collect them"
        )
        raise RegisterError(message, file=str(content.folder))
    if at := _measured_since(connection, dict(found)):
        message = (
            f"a newer state of this campaign, entered for the cell {named} at {at}, measured more or states other "
            "conditions, and that counts: put what it measured and states back, collect, and release that"
        )
        raise RegisterError(message, file=str(content.folder))
    return int(found["id"])


def _measured_elsewhere(connection: Connection, campaign: int, cell: int) -> list[str]:
    """States that were to confirm a campaign's map, and files of contact points, that were entered with other content
    that shares a recording, not with it."""
    used = select(USES.c.campaign_id, USES.c.file, IMPACTS.c.recording_id, IMPACTS.c.state_id).join_from(
        USES, IMPACTS, USES.c.impact_id == IMPACTS.c.id
    )
    uses = used.subquery()
    own = select(uses.c.recording_id).where(uses.c.campaign_id == campaign)
    of_cell = select(CAMPAIGNS.c.id).where(CAMPAIGNS.c.cell_id == cell)
    related = select(uses.c.campaign_id).where(uses.c.recording_id.in_(own), uses.c.campaign_id.in_(of_cell))
    at_point = uses.c.file.startswith(f"{POINTS_FOLDER}/")
    query = select(case((at_point, uses.c.file), else_=uses.c.state_id))
    query = query.where(uses.c.campaign_id.in_(related), uses.c.recording_id.not_in(own))
    return sorted(set(connection.execute(query.where(or_(at_point, uses.c.state_id.startswith(CONFIRMING)))).scalars()))


def _measured_since(connection: Connection, campaign: Mapping[str, Any]) -> str | None:
    """When newer content of a campaign was entered for its cell that has further impacts or other conditions."""
    newer = CAMPAIGNS.alias()
    further = select(IMPACTS.c.id).where(IMPACTS.c.campaign_id == newer.c.id).exists()
    other = [newer.c[name] != campaign[name] for name in ("conditions", "device_error_N")]
    which = [CAMPAIGNS.c.id == campaign["id"], newer.c.entry > campaign["entry"], or_(further, *other)]
    query = select(func.max(AUDIT.c.at)).join_from(CAMPAIGNS, newer, same_campaign(newer))
    query = query.join(AUDIT, AUDIT.c.id == newer.c.entry).where(*which)
    found: str | None = connection.execute(query).scalar()
    return found


def _before(connection: Connection, values: dict[str, Any]) -> Any:
    """The latest release of the same subject, body areas and contact: its row, with `withdrawn`; None without one.

    A contact point is the same whatever its body area: there is one program there.
    """
    names = (
        ("cell_id", "subject") if values["subject"].startswith(POINT) else ("cell_id", "subject", "areas", "contact")
    )
    slot = [RELEASES.c[name] == values[name] for name in names]
    latest = select(func.max(RELEASES.c.id)).where(*slot).scalar_subquery()
    withdrawn = select(WITHDRAWALS.c.id).where(WITHDRAWALS.c.release_id == RELEASES.c.id).exists()
    query = select(RELEASES, withdrawn.label("withdrawn")).where(RELEASES.c.id == latest)
    return connection.execute(query).mappings().first()
