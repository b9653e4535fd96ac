"""The team's register: what its commands print, and what its pages show."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from forcemap.answers.answer import AllSaid, Answer, Words
from forcemap.direction import WIDEST_ANGLE
from forcemap.errors import few
from forcemap.words import sentence

_NAMED = 3
"""Releases that the standing of a cell names."""

WARNINGS_NOT_KEPT = (
    "WHAT MUST BE SAID FIRST IS NOT KNOWN: released by an earlier version; see its report, or release anew"
)

POINTS_NOT_KEPT = (
    "WHETHER ITS CONTACT POINTS WERE PERMITTED IS NOT KNOWN: released by an earlier version; see its report, or "
    "release anew"
)


class HeadAnswer(Answer):
    """The newest entry of the audit trail; `noted` is what `verify --head` takes."""

    number: int
    sha256: str
    at: str
    noted: Words


class RegisterMade(Answer):
    """What `init` did; roles are those of PostgreSQL, null on SQLite."""

    where: str
    schema_before: str | None
    schema_now: str
    roles: bool | None


class EnteredAnswer(Answer):
    """A folder that was entered, or was there already."""

    folder: str
    name: str
    sha256: str
    cell: str
    new: bool
    since: str
    recordings: int
    new_recordings: int
    new_impacts: int
    facts: list[str]
    also_of: list[str]
    releases: list[int]
    new_cell: bool


class NotEntered(Answer):
    """A folder that was not entered, and why."""

    folder: str
    reason: str


class EnterAnswer(Answer):
    """All folders, in the order they were named."""

    entered: list[EnteredAnswer]
    failed: list[NotEntered]
    head: HeadAnswer | None


class ActionAnswer(Answer):
    """What was done, and the head of the audit trail then."""

    done: str
    head: HeadAnswer


class ReleaseMade(Answer):
    """A release as it was entered; `new` is false if the same was released before."""

    release: int
    new: bool
    replaces: int | None
    also_of: list[str]
    head: HeadAnswer


class FactAnswer(Answer):
    """What holds of a cell since when; null: not known."""

    kind: str
    value: str | None
    since: str


class ReleaseAnswer(Answer):
    """A release; its speeds are null unless it is in force. One that was withdrawn or replaced does not count."""

    release: int
    cell: str
    in_force: bool
    counts: bool
    why_not: AllSaid
    subject: str
    areas: str
    contact: str
    limit_N: float | None
    bound: str
    speeds: dict[str, Any] | None
    conditions: dict[str, str | None]
    valid_until: str | None
    at: str
    person: str
    map_sha256: str | None
    report_sha256: str
    replaces: int | None
    simulated: bool

    @property
    def warnings(self) -> list[str]:
        """What must be said before its speeds; empty if it gives none."""
        return [] if self.speeds is None else list(self.speeds["warnings"])

    @property
    def points_refused(self) -> list[str] | None:
        """Contact points that its report does not permit; None if it gives no speeds, or does not know."""
        return None if self.speeds is None else self.speeds.get("points_not_permitted")

    @property
    def assumptions(self) -> list[str]:
        """What its speeds rest on; empty if it gives none, or was released by an earlier version."""
        return [] if self.speeds is None else list(self.speeds.get("assumptions", []))

    @property
    def rests_on(self) -> str:
        """Its bound, and whether impacts confirmed it."""
        speeds = self.speeds or {}
        by = f"{speeds['confirming_impacts']} impacts" if speeds.get("confirming_impacts") else "measurement"
        return f"{self.bound}{f', confirmed by {by}' if speeds.get('confirmed') else ''}"

    @property
    def measured_for(self) -> str:
        """What was measured, so that it holds for that alone; empty if it gives no speeds, or of an earlier version."""
        return "" if self.speeds is None else str(self.speeds.get("measured_for", ""))

    @property
    def to_program(self) -> str:
        """Its speeds in a line, and of zones why they are lower than those of the report; empty if it gives none."""
        if self.speeds is None:
            return ""
        low, high = (f"{self.speeds[f'{end}_to_program_mps']:.3f}" for end in ("lowest", "highest"))
        if "zones" not in self.speeds:
            holds_for = f"; {self.speeds['holds_for']}" if "holds_for" in self.speeds else ""
            return f"program at most {f'{low} to ' * (low != high)}{high} m/s{holds_for}"
        zones = f"{self.speeds['zones_with_a_speed']} of {self.speeds['zones']} zones"
        return (
            f"program at most {low} to {high} m/s in {zones} of the robot's program, the others none (zones hold up to "
            f"{WIDEST_ANGLE:g} degrees off the map's direction, so they are slower than the report's places; forcemap "
            "export --format csv lists them)"
        )

    @classmethod
    def of(cls, release: Any) -> ReleaseAnswer:
        """The answer from a state of a release."""
        speeds = {"warnings": [WARNINGS_NOT_KEPT], **release.speeds} if release.in_force else None
        if speeds is not None and "points_not_permitted" not in speeds and WARNINGS_NOT_KEPT not in speeds["warnings"]:
            speeds["warnings"] = [POINTS_NOT_KEPT, *speeds["warnings"]]
        if speeds is not None and release.not_compared:
            speeds["warnings"] = [sentence(release.not_compared), *speeds["warnings"]]
        also = {name: getattr(release, name) for name in cls.model_fields if name not in ("speeds", "why_not")}
        return cls.model_validate({**also, "speeds": speeds, "why_not": release.failed})


class EventAnswer(Answer):
    """An entry of the audit trail."""

    entry: int
    at: str
    person: str
    action: str
    subject: str
    content: dict[str, Any]

    @property
    def stated(self) -> list[str]:
        """The conditions that were stated, as `firmware=5.12`."""
        facts = self.content.get("facts")
        pairs = facts.items() if isinstance(facts, dict) else ()
        return [f"{kind}={'?' if value is None else value}" for kind, value in pairs]


class CellAnswer(Answer):
    """A cell: in force if there is a release that counts, and all that count are."""

    cell: str
    in_force: bool
    facts: list[FactAnswer]
    unknown: list[str]
    releases: list[ReleaseAnswer]
    history: list[EventAnswer] = Field(default_factory=list)

    @property
    def standing(self) -> str:
        """Whether it is in force, else which releases are not; and what was not confirmed or permitted with it."""
        counting = [release for release in self.releases if release.counts]
        in_force = [release for release in counting if release.in_force]
        unconfirmed = any(each.speeds and each.speeds.get("confirmed") is False for each in in_force)
        points = dict.fromkeys(name for each in in_force for name in each.points_refused or ())
        beside = f", BUT CONTACT POINTS ARE NOT PERMITTED: {', '.join(points)}" if points else ""
        beside += ", CONTACT POINTS NOT KNOWN" * any(each.points_refused is None for each in in_force)
        said = f"in force{', NOT CONFIRMED BY MEASUREMENT' * unconfirmed}{beside}"
        if self.in_force:
            return said
        if not in_force:
            return f"NOT IN FORCE{': it has no release' * (not counting)}"
        lacking = [f"release {each.release} ({each.subject})" for each in counting if not each.in_force]
        return f"NOT IN FORCE: {few(lacking, _NAMED)}; {len(in_force)} of {len(counting)} releases {said}"

    @property
    def beside_points(self) -> bool:
        """Whether a release in force names contact points that are not permitted, or does not know of them."""
        return any(each.points_refused != [] for each in self.releases if each.counts and each.in_force)

    @classmethod
    def of(cls, state: Any, events: Any = ()) -> CellAnswer:
        """The answer from a cell's state and its history."""
        return cls(
            cell=state.cell,
            in_force=state.in_force,
            facts=[FactAnswer(kind=fact.kind, value=fact.value, since=fact.since) for fact in state.facts],
            unknown=list(state.unknown),
            releases=[ReleaseAnswer.of(release) for release in state.releases],
            history=[EventAnswer.from_result(event) for event in events],
        )


class DueEntry(Answer):
    """What is due of a cell, of a release of it if any, or of a device, whose cell is empty."""

    cell: str
    release: int | None
    findings: AllSaid


class DueAnswer(Answer):
    """Everything that is due."""

    within_days: int
    due: list[DueEntry]


class RelyingAnswer(Answer):
    """A cell that relies on what was asked for."""

    cell: str
    because: str
    releases: list[ReleaseAnswer]


class WhoAnswer(Answer):
    """All cells that do."""

    asked: str
    cells: list[RelyingAnswer]
    not_known: list[str]
    known: list[str]


class ExceededEntry(Answer):
    """Impacts of a campaign beside a limit."""

    cell: str
    campaign: str
    folder: str
    simulated: bool
    exceeded: int
    cannot_tell: int
    largest_N: float | None


class LargeImpactAnswer(Answer):
    """An impact above a limit."""

    cell: str
    campaign: str
    file: str
    state_id: str
    largest_N: float
    recording_sha256: str


class ExceededAnswer(Answer):
    """Where a force was exceeded, and the largest impacts."""

    limit_N: float
    exceeded: int
    files: int
    cannot_tell: int
    campaigns: list[ExceededEntry]
    largest: list[LargeImpactAnswer]


class VerifyAnswer(Answer):
    """Whether the register is as it was written."""

    holds: bool
    problems: list[str]
    head: HeadAnswer


class ExportAnswer(Answer):
    """A table that was written."""

    file: str
    table: str
    rows: int


class SiteAnswer(Answer):
    """All cells with their state, and what is due."""

    where: str
    cells: list[CellAnswer]
    due: DueAnswer
    head: HeadAnswer
