"""Whether a release is in force: a function of facts, releases, withdrawals and time that fails closed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from forcemap.findings import Finding, FindingKind
from forcemap.limits.device_spring import device_suitability

DEVICE = "device"
KINDS = ("robot", "controller", "firmware", "safety_checksum", "tool", "program", "covers", DEVICE)
"""What is known of a cell: conditions that a release holds under, and the device that measures there, which must have
been known; another one that measures later changes nothing at the robot."""


@dataclass(frozen=True)
class Fact:
    """What holds of a cell from a time on.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    value : str or None
        None: not known from then on.
    since : str
        Time in UTC, as the register keeps it.
    entry : int
        Number of the entry in the audit trail, whose order is that in which facts became known.
    campaign : int or None
        The campaign that shows it; None if a person states it.
    """

    kind: str
    value: str | None
    since: str
    entry: int
    campaign: int | None = None


@dataclass(frozen=True)
class Released:
    """What of a release decides whether it is in force.

    Parameters
    ----------
    entry : int
        Number of its entry in the audit trail.
    at : str
        When it was released, as the register keeps times.
    valid_until : str or None
        The last day on which it holds.
    conditions : mapping of str to (str or None)
        What it was measured under, by `KINDS`.
    areas : str
        The body areas.
    campaign : int
        Number of the campaign.
    measured_from, measured_on : str or None
        First and last day of the measurements; the first is None if it is not known, or was not kept at the release.
    calibrated, calibrated_until : str or None
        From when to when the device's calibration held; `calibrated` may be None.
    device_spring, area_spring : float or None
        Spring constants [N/m]: of the device, and the stiffest that the body areas ask for.
    """

    entry: int
    at: str
    valid_until: str | None
    conditions: Mapping[str, str | None]
    areas: str
    campaign: int
    measured_from: str | None
    measured_on: str | None
    calibrated: str | None
    calibrated_until: str | None
    device_spring: float | None
    area_spring: float | None


@dataclass(frozen=True)
class Withdrawal:
    """That a release was withdrawn: by whom, when and why."""

    person: str
    at: str
    reason: str


def failed(
    release: Released,
    facts: Sequence[Fact],
    withdrawals: Sequence[Withdrawal],
    *,
    replaced_by: int | None,
    entered_again: str | None = None,
    entered_elsewhere: tuple[str, str, str] | None = None,
    contradicted: Finding | None = None,
    now: str,
) -> tuple[Finding, ...]:
    """Why a release is not in force; empty if it is.

    It is in force only if it is neither withdrawn nor replaced, its campaign was not entered again with other content
    and its recordings not for another cell under other conditions, no later impacts exceed its limit as it permits,
    its time is not over and not ahead, every condition is known, was so at its release and has not changed since, the
    calibration held when it was measured, and the device suits the body areas. What is not known fails as what is wrong
    does; a withdrawal counts whatever its time, and a condition that has changed and changed back has changed.

    Parameters
    ----------
    release : Released
    facts, withdrawals : sequence of Fact, of Withdrawal
        Those of its cell; those of this release.
    replaced_by : int or None
        Number of the release that replaces it.
    entered_again : str or None
        When its campaign was entered again with other content; None if it was not.
    entered_elsewhere : tuple of str or None
        Site and name of another cell that its recordings were entered for under other conditions, both empty without a
        cell, and when.
    contradicted : Finding or None
        What impacts of the cell that were entered since say against it.
    now : str
        The time, as the register keeps it.
    """
    of, kind = Finding.of, FindingKind
    found = [of(kind.RELEASE_WITHDRAWN, person=w.person, at=w.at[:10], reason=w.reason) for w in withdrawals]
    if replaced_by is not None:
        found.append(of(kind.RELEASE_REPLACED, release=replaced_by))
    if entered_again is not None:
        found.append(of(kind.RELEASE_CAMPAIGN_CHANGED, at=entered_again[:10]))
    if entered_elsewhere is not None:
        *cell, at = entered_elsewhere
        found.append(of(kind.RELEASE_ENTERED_ELSEWHERE, cell="/".join(filter(None, cell)), at=at[:10]))
    if not release.at or release.at > now:
        found.append(of(kind.RELEASE_AHEAD, at=release.at))
    if not release.valid_until:
        found.append(of(kind.RELEASE_END_UNKNOWN))
    elif release.valid_until < now[:10]:
        found.append(of(kind.RELEASE_OVER, until=release.valid_until))
    of_kind: dict[str, list[Fact]] = {name: [] for name in KINDS}
    for fact in facts:
        of_kind[fact.kind].append(fact)
    for name in KINDS:
        found += _changed(name, release, of_kind[name])
    found += _uncalibrated(release)
    springs = [math.nan if spring is None else spring for spring in (release.area_spring, release.device_spring)]
    unsuited = device_suitability(release.areas, *springs).refusal
    return (*found, *filter(None, (contradicted, unsuited)))


def order(fact: Fact) -> tuple[str, int]:
    """What comes after what: by the day from which it holds, of one day as it was entered."""
    return fact.since[:10], fact.entry


def _changed(name: str, release: Released, facts: Sequence[Fact]) -> list[Finding]:
    """Why a condition is not the one of the release; empty if it is.

    What was entered before the release counts as it stood then, and on every day of the measurements; what was entered
    after it must be the same, unless it is of a day before the measurements. A change that a person states of a day
    between theirs is one, whatever the campaign states: it has one value for all its days.
    """
    was, first, last = release.conditions.get(name), release.measured_from or "", release.measured_on or ""
    if was is not None and name == DEVICE:
        return []
    ordered = sorted(facts, key=order)
    before = [fact for fact in ordered if fact.entry <= release.entry]
    # of one day and entry all count, in whatever order they were read
    told = {fact.since[:10]: fact.entry for fact in before}
    standing = [fact for fact in before if fact.entry == told[fact.since[:10]]]
    then = [fact for fact in standing if order(fact) == order(before[-1])]
    during = [fact for fact in standing if first <= fact.since[:10] <= last]
    since = [fact for fact in ordered if fact.entry > release.entry and fact.since[:10] >= first]
    unknown = [fact.since[:10] for fact in (*during, *then, *since) if fact.value is None]
    if was is None or not then or unknown:
        return [Finding.of(FindingKind.RELEASE_CONDITION_UNKNOWN, entry=name, since=min(unknown, default=None))]
    if other := next((fact for fact in (*then, *since) if fact.value != was), None):
        figures = {"was": was, "now": other.value, "since": other.since[:10], "back": ordered[-1].value == was or None}
        return [Finding.of(FindingKind.RELEASE_CONDITION_CHANGED, entry=name, **figures)]
    others = list({fact.since[:10]: fact for fact in ordered if fact.campaign != release.campaign}.values())
    changes = [
        old if old.value != was else new
        for old, new in pairwise(others)
        if new.campaign is None and first < new.since[:10] <= last and old.value != new.value
    ]
    if other := next((fact for fact in (*during, *changes) if fact.value != was), None):
        figures = {
            "was": was,
            "other": other.value or "not known",
            "since": other.since[:10],
            "first": first or None,
            "last": last,
        }
        return [Finding.of(FindingKind.RELEASE_CHANGED_WHILE_MEASURED, entry=name, **figures)]
    return []


def _uncalibrated(release: Released) -> list[Finding]:
    """Why the calibration did not hold when it was measured; empty if it did."""
    last, until, since = release.measured_on, release.calibrated_until, release.calibrated or ""
    first = release.measured_from if since else release.measured_from or last
    if not first or not last or not until:
        return [Finding.of(FindingKind.RELEASE_CALIBRATION_UNKNOWN)]
    if since <= first <= last <= min(until, release.at[:10]):
        return []
    figures = {"measured": first if first < since else last, "calibrated": since, "until": until}
    return [Finding.of(FindingKind.RELEASE_CALIBRATION_OVER, **figures)]
