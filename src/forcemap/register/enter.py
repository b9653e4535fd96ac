"""Entering a campaign's folder, and what changed at a cell; what is there already is not entered again."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, Connection, FromClause, Row, func, or_, select

from forcemap.campaigns.conditions import CAMPAIGN_FILE, normalised
from forcemap.campaigns.impacts_table import TABLE_FILE
from forcemap.campaigns.recordings_table import Use
from forcemap.errors import CampaignFileError, InputError, RegisterError, nearest_names, one_line
from forcemap.files import stated_date
from forcemap.register.audit import Action, Head, head, stated
from forcemap.register.connection import Register
from forcemap.register.folder import CampaignContent, read_content
from forcemap.register.in_force import DEVICE, KINDS, Fact, order
from forcemap.register.tables import (
    AUDIT,
    CAMPAIGNS,
    CELLS,
    CONTACT_POINTS,
    FACTS,
    IMPACTS,
    MAPS,
    RECORDINGS,
    RELEASES,
    USES,
)

LONGEST = 500  # characters of a condition; a choice
_AT_ONCE = 500  # values that are looked up together; a choice
_IMPACT = tuple(c.name for c in IMPACTS.columns if c.name not in ("id", "campaign_id", "entry"))
UNKNOWN = "?"
"""What is written for a condition that is not known any more."""


@dataclass(frozen=True)
class Entered:
    """What was entered of a folder.

    Parameters
    ----------
    folder, name, sha256 : str
        The folder, its bare name, the hash of its content.
    cell : str
        SITE/NAME of its cell; empty without one.
    new : bool
        False if all of it was there already.
    since : str
        When other content of the same campaign was entered after this, which was there already; empty if none was.
    recordings, new_recordings, new_impacts : int
        How many it has, and how many the register did not know.
    facts : tuple of str
        Conditions of the cell that were entered, as `firmware: 5.12`.
    also_of : tuple of str
        Other cells that have campaigns with these recordings.
    releases : tuple of int
        Releases of the cell that are not replaced, and rest on other campaigns.
    new_cell : bool
        True if the register did not know the cell.
    head : Head
        The newest entry of the audit trail.
    """

    folder: str
    name: str
    sha256: str
    cell: str
    new: bool
    since: str
    recordings: int
    new_recordings: int
    new_impacts: int
    facts: tuple[str, ...]
    also_of: tuple[str, ...]
    releases: tuple[int, ...]
    new_cell: bool
    head: Head


class Changed(NamedTuple):
    """What was entered at a cell: its name, conditions that hold now and are others, of later days, and the head."""

    cell: str
    others: tuple[Fact, ...]
    head: Head


def enter(register: Register, folder: str | Path, *, cell: str = "", new: bool = False, person: str = "") -> Entered:
    """Enter a campaign's folder as it is now: campaign, recordings, impacts, maps, contact points, conditions.

    Parameters
    ----------
    register : Register
    folder : str or Path
        As `collect` left it.
    cell : str
        Its cell, SITE/NAME; if not given, what [protocol] states as site and cell; else it has none.
    new : bool
        True to make the cell that `cell` names although the register knows others and not this one: a slip in its name
        would else leave releases of another in force. A cell that [protocol] states is made.
    person : str
        Who enters it; the account of this machine if not given.

    Raises
    ------
    CampaignFileError
        The folder is not as it was collected, or states no date although it has a cell.
    RegisterError
        The register does not know the cell, or the database refuses it; then nothing of it was entered.
    """
    content = read_content(folder)
    if content.dataset is None and any(entry.use is Use.USED for entry in content.campaign.entries):
        raise CampaignFileError(
            f"there is no {TABLE_FILE}, and where its impacts were made is not known; run forcemap collect",
            file=str(content.folder),
        )
    protocol = content.protocol
    site, name = split(cell) if cell else (protocol.site, protocol.cell)
    if cell and protocol.cell and (name != protocol.cell or protocol.site not in ("", site or protocol.site)):
        stated_there = joined(protocol.site, protocol.cell)
        message = f"[protocol] states the cell {stated_there!r}, expected that of --cell, {cell!r}; change one of them"
        raise CampaignFileError(message, file=str(content.folder / CAMPAIGN_FILE), column="protocol.cell")
    if name:
        site, name = (stated("site", site) if site else ""), stated("cell", name)
        _require_date(content)
    with register.reading() as connection:
        site = _site(connection, site, name)
        if found := _there(connection, content, site, name):
            return _as_there(connection, content, site, name, found)
    with register.writing() as connection:
        site = _site(connection, site, name)
        if found := _there(connection, content, site, name):  # another process was faster
            return _as_there(connection, content, site, name, found)
        action = Action(register, connection, person)
        known = cell_number(connection, site, name) is not None
        if cell and not (known or new) and connection.execute(select(CELLS.c.id).limit(1)).first():
            require_cell(connection, joined(site, name) if site else f"/{name}")
        place = _cell(action, site, name) if name else None
        campaign = _add_campaign(action, content, place)
        recordings, impacts = _add_impacts(action, content, campaign, place)
        facts = [] if place is None else _add_facts(action, place, campaign, content)
        also_of = cells_with(connection, [entry.sha256 for entry in content.campaign.entries], place)
        figures = {"folder": str(printable(str(Path(folder).resolve()))), "facts": facts}
        now = action.done("enter", f"campaign {content.sha256}", cell=joined(site, name), **figures)
        releases = _releases_beside(connection, campaign, place)
    return Entered(
        folder=str(folder),
        name=_name(content),
        sha256=content.sha256,
        cell=joined(site, name),
        new=True,
        since="",
        recordings=len(content.campaign.entries),
        new_recordings=recordings,
        new_impacts=impacts,
        facts=tuple(facts),
        also_of=also_of,
        releases=releases,
        new_cell=bool(name) and not known,
        head=now,
    )


def change(
    register: Register,
    cell: str,
    conditions: Mapping[str, str],
    *,
    since: str = "",
    new: bool = False,
    person: str = "",
) -> Changed:
    """Enter what has changed at a cell.

    Parameters
    ----------
    register : Register
    cell : str
        SITE/NAME; the site may be left out where only one has such a cell.
    conditions : mapping of str to str
        What holds now, by `KINDS`; `?` for what is not known.
    since : str
        Date, YYYY-MM-DD; now if not given.
    new : bool
        True to make a cell that the register does not know: a slip in its name would else leave its releases in force.
    person : str
        Who enters it; the account of this machine if not given.

    Raises
    ------
    InputError
        An unknown condition, no value, or a date that lies ahead.
    RegisterError
        There is no such cell, or there are several; the database refuses it.
    """
    if unknown := [kind for kind in conditions if kind not in KINDS]:
        raise InputError(f"condition: found {one_line(unknown[0])[:100]!r}, expected one of {', '.join(KINDS)}")
    if not conditions:
        raise InputError(f"condition: expected at least one, such as firmware=5.12, of {', '.join(KINDS)}")
    values = {kind: _value(kind, text) for kind, text in conditions.items()}
    day = stated_date("since", since).isoformat() if since else ""
    with register.writing() as connection:
        action = Action(register, connection, person)
        if day > action.at[:10]:
            raise InputError(f"since: found {day}, which lies ahead; enter a change when it has happened")
        number, named = _cell_or_new(action, cell) if new else require_cell(connection, cell)
        begins = f"{day}T00:00:00.000000Z" if day else action.at
        facts = _Facts.of(action, number)
        for kind, value in values.items():
            facts.add(kind, value, begins, None)
        now = current(facts.known)
        others = tuple(now[kind] for kind, value in values.items() if now[kind].value != value)
        return Changed(named, others, action.done("change", f"cell {named}", since=begins, facts=values))


def _cell_or_new(action: Action, cell: str) -> tuple[int, str]:
    site, name = split(cell)
    site = _site(action.connection, site, name)
    number = _cell(action, site, name)
    return number, joined(site, name)


def _site(connection: Connection, site: str, name: str) -> str:
    """The site of a cell that may be named without it, where the register knows a cell of that name."""
    if site or not name:
        return site
    known = connection.execute(select(CELLS.c.site).where(CELLS.c.name == name)).scalars().all()
    if len(known) > 1 and "" not in known:
        there = ", ".join(sorted(joined(each, name) for each in known)[:5])
        raise RegisterError(f"there are several cells {name!r}: {there}; name the site, too")
    return "" if "" in known or not known else str(known[0])


def _cell(action: Action, site: str, name: str) -> int:
    """The number of a cell, made if the register does not know it.

    Raises
    ------
    RegisterError
        It differs from one of the register in capitals or spaces alone: what is entered would not end releases of that.
    """
    if known := cell_number(action.connection, site, name):
        return known
    wanted = joined(site, name)
    cells = [joined(*row) for row in action.connection.execute(select(CELLS.c.site, CELLS.c.name))]
    if alike := next((cell for cell in cells if normalised(cell) == normalised(wanted)), None):
        raise RegisterError(f"there is a cell {alike!r}, found {wanted!r}: write it as there, or name it otherwise")
    return action.add(CELLS, site=site, name=name)


def _value(kind: str, text: str) -> str | None:
    if text.strip() == UNKNOWN:
        return None
    return stated(kind, text, longest=LONGEST)


def split(cell: str) -> tuple[str, str]:
    """Site and name of a cell: SITE/NAME, NAME where the site is not stated, /NAME of one that has none."""
    site, _, name = cell.rpartition("/")
    return (stated("site", site) if site else ""), stated("cell", name)


def joined(site: str, name: str) -> str:
    """A cell as it is written."""
    return f"{site}/{name}" if site else name


def cell_number(connection: Connection, site: str, name: str) -> int | None:
    """The number of a cell; None if the register does not know it."""
    found = connection.execute(select(CELLS.c.id).where(CELLS.c.site == site, CELLS.c.name == name)).scalar()
    return None if found is None else int(found)


def require_cell(connection: Connection, cell: str) -> tuple[int, str]:
    """Number of a cell, and how it is written; its site may be left out where only one has such a cell.

    Raises
    ------
    RegisterError
        There is no such cell, or there are several.
    """
    site, name = split(cell)
    query = select(CELLS.c.id, CELLS.c.site).where(CELLS.c.name == name)
    rows = connection.execute(query.where(CELLS.c.site == site) if "/" in cell else query).all()
    if len(rows) == 1:
        return rows[0].id, joined(rows[0].site, name)
    if rows:
        there = ", ".join(sorted(f"{row.site}/{name}" for row in rows)[:5])
        raise RegisterError(f"there are several cells {name!r}: {there}; name the site, too")
    remedy = "if it is a new one, enter a campaign of it, or what is known of it, with --new"
    raise RegisterError(f"there is no cell {cell!r}{_nearest(connection, name)}; {remedy}")


def _nearest(connection: Connection, name: str) -> str:
    """The cell that may have been meant by a name that the register does not know; empty where it knows none."""
    known = {row.name: joined(row.site, row.name) for row in connection.execute(select(CELLS.c.site, CELLS.c.name))}
    near = nearest_names(name, [*known], 1)
    return f"; the nearest known one is {known[near[0]]!r}" if near else ""


def facts_of(connection: Connection, cell: int) -> list[Fact]:
    """What is known of a cell, as it was entered."""
    columns = (FACTS.c.kind, FACTS.c.value, FACTS.c.since, FACTS.c.entry, FACTS.c.campaign_id)
    return [Fact(*row) for row in connection.execute(select(*columns).where(FACTS.c.cell_id == cell))]


def current(facts: Iterable[Fact]) -> dict[str, Fact]:
    """What holds now, by its kind: the latest of each."""
    return {fact.kind: fact for fact in sorted(facts, key=order)}


def printable(path: str) -> str:
    """A path that may hold any byte, as text that every database takes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in path)


def _name(content: CampaignContent) -> str:
    return printable(content.folder.resolve().name)


def _require_date(content: CampaignContent) -> None:
    if not content.campaign.conditions.date:
        message = "the entry is missing: from when the conditions of its cell hold is not known without it"
        raise CampaignFileError(message, file=str(content.folder / CAMPAIGN_FILE), column="date")


def _there(connection: Connection, content: CampaignContent, site: str, name: str) -> Row[Any, Any] | None:
    query = select(CAMPAIGNS.c.id, CAMPAIGNS.c.recordings).where(CAMPAIGNS.c.sha256 == content.sha256)
    if not name:
        return connection.execute(query.where(CAMPAIGNS.c.cell_id.is_(None))).first()
    number = cell_number(connection, site, name)
    return None if number is None else connection.execute(query.where(CAMPAIGNS.c.cell_id == number)).first()


def same_campaign(other: FromClause) -> ColumnElement[bool]:
    """Whether another content is one of the same campaign: of its cell, and of its name or with a recording of it."""
    own_uses, own_impacts = USES.alias(), IMPACTS.alias()
    # + 0: looked up by the impact; databases guess that a campaign has fewer uses than an impact, and read them all
    own = select(own_uses.c.id).correlate(own_impacts, CAMPAIGNS)
    own = own.where(own_uses.c.impact_id == own_impacts.c.id, own_uses.c.campaign_id + 0 == CAMPAIGNS.c.id)
    has = select(own_impacts.c.id).correlate(IMPACTS, CAMPAIGNS)
    has = has.where(own_impacts.c.recording_id == IMPACTS.c.recording_id, own.exists())
    shared = select(USES.c.id).join_from(USES, IMPACTS, USES.c.impact_id == IMPACTS.c.id).correlate(other, CAMPAIGNS)
    shared = shared.where(USES.c.campaign_id == other.c.id, has.exists())
    same = or_(other.c.name == CAMPAIGNS.c.name, shared.exists())
    return (other.c.cell_id == CAMPAIGNS.c.cell_id) & same


def _releases_beside(connection: Connection, campaign: int, cell: int | None) -> tuple[int, ...]:
    """Releases of a cell that are not replaced, and are not of this campaign."""
    later, own = RELEASES.alias(), CAMPAIGNS.alias()
    replaced = select(later.c.id).where(later.c.replaces == RELEASES.c.id).exists()
    query = select(RELEASES.c.id).join(CAMPAIGNS).join(own, own.c.id == campaign)
    query = query.where(RELEASES.c.cell_id == cell, ~replaced, ~same_campaign(own)).order_by(RELEASES.c.id.desc())
    return tuple(connection.execute(query).scalars())


def _newer(connection: Connection, campaign: int) -> str:
    """When other content of a campaign was entered after this last; empty if none was."""
    later = CAMPAIGNS.alias()
    query = select(func.max(AUDIT.c.at)).select_from(CAMPAIGNS)
    query = query.join(later, same_campaign(later) & (later.c.entry > CAMPAIGNS.c.entry))
    query = query.join(AUDIT, AUDIT.c.id == later.c.entry).where(CAMPAIGNS.c.id == campaign)
    return str(connection.execute(query).scalar() or "")


def _as_there(connection: Connection, content: CampaignContent, site: str, name: str, found: Row[Any, Any]) -> Entered:
    digests = [entry.sha256 for entry in content.campaign.entries]
    return Entered(
        folder=str(content.folder),
        name=_name(content),
        sha256=content.sha256,
        cell=joined(site, name),
        new=False,
        since=_newer(connection, found.id),
        recordings=found.recordings,
        new_recordings=0,
        new_impacts=0,
        facts=(),
        also_of=cells_with(connection, digests, cell_number(connection, site, name) if name else None),
        releases=(),
        new_cell=False,
        head=head(connection),
    )


def cells_with(connection: Connection, digests: Sequence[str], cell: int | None) -> tuple[str, ...]:
    """Other cells that have campaigns with some of these recordings, by the hashes of their files."""
    known = list(_known_recordings(connection, list(dict.fromkeys(digests))).values())
    columns = select(CELLS.c.site, CELLS.c.name).join_from(IMPACTS, CAMPAIGNS).join(CELLS)
    found = set()
    for start in range(0, len(known), _AT_ONCE):
        query = columns.where(IMPACTS.c.recording_id.in_(known[start : start + _AT_ONCE]), CELLS.c.id != (cell or 0))
        found |= {joined(*row) for row in connection.execute(query.distinct())}
    return tuple(sorted(found))


def entered_before(connection: Connection, content: CampaignContent, cell: int) -> tuple[tuple[str, str, str], ...]:
    """What a campaign states otherwise than an earlier one with some of its recordings, of the cell or of none, as
    (name, then, now).

    A recording was made once, on one day under one set of conditions; what one of the two leaves open is no difference.
    """
    digests = [entry.sha256 for entry, _ in content.impacts()]  # those at contact points, too
    known = list(_known_recordings(connection, list(dict.fromkeys(digests))).values())
    query = select(CAMPAIGNS.c.conditions, CAMPAIGNS.c.measured_on).join_from(IMPACTS, CAMPAIGNS)
    query = query.where(func.coalesce(CAMPAIGNS.c.cell_id, cell) == cell, CAMPAIGNS.c.sha256 != content.sha256)
    now = {**content.conditions, "date": content.measured[1]}
    found: dict[tuple[str, str, str], None] = {}
    for start in range(0, len(known), _AT_ONCE):
        rows = connection.execute(query.where(IMPACTS.c.recording_id.in_(known[start : start + _AT_ONCE])).distinct())
        for conditions, measured_on in rows:
            then = {**json.loads(conditions), "date": measured_on}
            both = ((name, then.get(name), text) for name, text in now.items())
            found |= {(name, was, text): None for name, was, text in both if was and text and was != text}
    return tuple(found)


def _add_campaign(action: Action, content: CampaignContent, cell: int | None) -> int:
    conditions = content.campaign.conditions
    (first, last), (calibrated, until) = content.measured, content.calibration
    number = action.add(
        CAMPAIGNS,
        cell_id=cell,
        sha256=content.sha256,
        name=_name(content),
        folder=printable(str(content.folder.resolve())),
        binding=one_line(content.binding),
        conditions=json.dumps(content.conditions, ensure_ascii=False),
        device=printable(content.device),
        measured_from=first,
        measured_on=last,
        calibrated=calibrated,
        calibrated_until=until,
        device_error_N=float(conditions.device.error_or_default),
        simulated=int(conditions.simulated or (content.dataset is not None and content.dataset.simulated)),
        recordings=len(content.campaign.entries),
    )
    for file, digest, form in content.maps:
        action.add(MAPS, campaign_id=number, sha256=digest, file=printable(file), form=form)
    for point in content.points:
        words = {"name": point.name, "area": point.limit.name, "contact": str(point.contact)}
        programmed = None if point.programmed != point.programmed else float(point.programmed)
        words["rests_on"] = str(point.rests_on)
        action.add(CONTACT_POINTS, campaign_id=number, **words, programmed_mps=programmed)
    return number


def _add_impacts(action: Action, content: CampaignContent, campaign: int, cell: int | None) -> tuple[int, int]:
    """Add what is new of recordings and impacts; how many are."""
    found = content.impacts()
    known = _known_recordings(action.connection, list(dict.fromkeys(entry.sha256 for entry, _ in found)))
    before = _known_impacts(action.connection, list(known.values()), cell)
    new_recordings = new_impacts = 0
    for entry, values in found:
        if (recording := known.get(entry.sha256)) is None:
            recording = action.add(RECORDINGS, sha256=entry.sha256, size_bytes=entry.size)
            known[entry.sha256] = recording
            new_recordings += 1
        values = {**values, "recording_id": recording, "curve": printable(values["curve"])}
        values |= {"state_id": printable(values["state_id"]), "flags": printable(values["flags"])}
        key = tuple(values[name] for name in _IMPACT)
        if (impact := before.get(key)) is None:
            impact = before[key] = action.add(IMPACTS, campaign_id=campaign, **values)
            new_impacts += 1
        action.add(USES, campaign_id=campaign, impact_id=impact, file=printable(entry.file))
    return new_recordings, new_impacts


def _known_recordings(connection: Connection, digests: list[str]) -> dict[str, int]:
    known: dict[str, int] = {}
    for start in range(0, len(digests), _AT_ONCE):
        part = RECORDINGS.c.sha256.in_(digests[start : start + _AT_ONCE])
        known |= {row.sha256: row.id for row in connection.execute(select(RECORDINGS).where(part))}
    return known


def _known_impacts(connection: Connection, recordings: list[int], cell: int | None) -> dict[tuple[Any, ...], int]:
    """Impacts of recordings by what is known of them, of campaigns of this cell: another cell has its own."""
    same = CAMPAIGNS.c.cell_id.is_(None) if cell is None else CAMPAIGNS.c.cell_id == cell
    query = select(IMPACTS).join(CAMPAIGNS, IMPACTS.c.campaign_id == CAMPAIGNS.c.id).where(same)
    found: dict[tuple[Any, ...], int] = {}
    for start in range(0, len(recordings), _AT_ONCE):
        part = query.where(IMPACTS.c.recording_id.in_(recordings[start : start + _AT_ONCE]))
        for row in connection.execute(part).mappings():
            found[tuple(row[name] for name in _IMPACT)] = row["id"]
    return found


def _add_facts(action: Action, cell: int, campaign: int, content: CampaignContent) -> list[str]:
    """Add what the campaign shows of its cell and the register does not know; what contradicts itself is not known."""
    days = sorted({day for day in content.measured if day})
    if days[-1] > action.at[:10]:
        message = f"found {days[-1]}, which lies ahead of the clock; enter it when it was measured"
        raise CampaignFileError(message, file=str(content.folder / CAMPAIGN_FILE), column="date")
    facts, added = _Facts.of(action, cell), []
    for kind, value in content.conditions.items():
        shown = [value is not None and facts.shown(kind, value, day, campaign) for day in days]
        if any(shown):
            known = current(fact for fact in facts.known if fact.since[:10] <= days[-1])[kind].value
            added.append(f"{kind}: {UNKNOWN if known is None else known}")
    return added


@dataclass
class _Facts:
    """The facts of a cell while some are added, and what its campaigns show on their first and their last day: day,
    number, conditions, by the day."""

    action: Action
    cell: int
    known: list[Fact]
    campaigns: list[tuple[str, int, dict[str, str | None]]]

    @classmethod
    def of(cls, action: Action, cell: int) -> _Facts:
        columns = (CAMPAIGNS.c.measured_from, CAMPAIGNS.c.measured_on, CAMPAIGNS.c.id, CAMPAIGNS.c.conditions)
        rows = action.connection.execute(select(*columns).where(CAMPAIGNS.c.cell_id == cell)).all()
        shown = [(day, row.id, json.loads(row.conditions)) for row in rows for day in {*row[:2]} - {None}]
        return cls(action, cell, facts_of(action.connection, cell), sorted(shown, key=lambda each: each[:2]))

    def add(self, kind: str, value: str | None, since: str, campaign: int | None) -> None:
        """Add a fact, and what the next campaign after it shows: it was not added where nothing had changed."""
        fact = Fact(kind, value, since, self.action.entry, campaign)
        self.action.add(FACTS, cell_id=self.cell, campaign_id=campaign, kind=kind, since=since, value=value)
        self.known.append(fact)
        day = since[:10]
        for measured, number, conditions in self.campaigns:
            # what a person states of a day was found after measuring
            later = measured > day or (measured == day and campaign is not None)
            if later and (shown := conditions.get(kind)) is not None:
                self.shown(kind, shown, measured, number)
                return

    def shown(self, kind: str, value: str, day: str, campaign: int) -> bool:
        """Add what a campaign shows if it is not what is known; what two of one day show otherwise is not known."""
        before = current(fact for fact in self.known if fact.since[:10] <= day).get(kind)
        if before and before.value == value:
            return False
        same_day = before is not None and before.since[:10] == day and kind != DEVICE
        if before and same_day and before.value is None:
            return False
        end = min(f"{day}T23:59:59.999999Z", self.action.at)
        self.add(kind, None if same_day else value, end, campaign)
        return True
