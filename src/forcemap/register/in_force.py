"""Whether a release is in force: a function of facts, releases, withdrawals and time that fails closed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

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
    """

    kind: str
    value: str | None
    since: str
    entry: int


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
    measured_on, calibrated, calibrated_until : str or None
        Dates of the measurements, and from when to when the device's calibration held; `calibrated` may be None.
    device_spring, area_spring : float or None
        Spring constants [N/m]: of the device, and the stiffest that the body areas ask for.
    """

    entry: int
    at: str
    valid_until: str | None
    conditions: Mapping[str, str | None]
    areas: str
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
    now: str,
) -> tuple[Finding, ...]:
    """Why a release is not in force; empty if it is.

    It is in force only if it is neither withdrawn nor replaced, its time is not over and not ahead, every condition is
    known, was so at its release and has not changed since, the calibration held when it was measured, and the device
    suits the body areas. What is not known fails as what is wrong does; a withdrawal counts whatever its time, and a
    condition that has changed and changed back has changed.

    Parameters
    ----------
    release : Released
    facts : sequence of Fact
        Those of its cell.
    withdrawals : sequence of Withdrawal
        Those of this release.
    replaced_by : int or None
        Number of the release that replaces it.
    now : str
        The time, as the register keeps it.
    """
    of, kind = Finding.of, FindingKind
    found = [of(kind.RELEASE_WITHDRAWN, person=w.person, at=w.at[:10], reason=w.reason) for w in withdrawals]
    if replaced_by is not None:
        found.append(of(kind.RELEASE_REPLACED, release=replaced_by))
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
    return (*found, *([unsuited] if unsuited else []))


def _changed(name: str, release: Released, facts: Sequence[Fact]) -> list[Finding]:
    """Why a condition is not the one of the release; empty if it is."""
    was, released = release.conditions.get(name), (release.at, release.entry)
    if was is not None and name == DEVICE:
        return []
    ordered = sorted(facts, key=lambda fact: (fact.since, fact.entry))
    before = [fact for fact in ordered if (fact.since, fact.entry) <= released]
    # of one moment and entry all count, in whatever order they were read
    then = [fact for fact in before if (fact.since, fact.entry) == (before[-1].since, before[-1].entry)]
    since = [fact for fact in ordered if (fact.since, fact.entry) > released]
    if was is None or not then or any(fact.value is None for fact in (*then, *since)):
        return [Finding.of(FindingKind.RELEASE_CONDITION_UNKNOWN, entry=name)]
    other = next((fact for fact in (*then, *since) if fact.value != was), None)
    if other is None:
        return []
    figures = {"was": was, "now": other.value, "since": other.since[:10]}
    return [Finding.of(FindingKind.RELEASE_CONDITION_CHANGED, entry=name, **figures)]


def _uncalibrated(release: Released) -> list[Finding]:
    """Why the calibration did not hold when it was measured; empty if it did."""
    day, until = release.measured_on, release.calibrated_until
    if not day or not until:
        return [Finding.of(FindingKind.RELEASE_CALIBRATION_UNKNOWN)]
    if (release.calibrated or "") <= day <= until and day <= release.at[:10]:
        return []
    figures = {"measured": day, "calibrated": release.calibrated or "", "until": until}
    return [Finding.of(FindingKind.RELEASE_CALIBRATION_OVER, **figures)]
