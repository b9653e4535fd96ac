"""What is due: releases that do not hold, end, were never confirmed, are simulated or stand beside refused points,
cells without one, calibrations."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date

from sqlalchemy import Connection, func, select

from forcemap.findings import Finding, FindingKind
from forcemap.register.connection import Register
from forcemap.register.states import NOT_REPLACED, current_time, states_with
from forcemap.register.tables import CAMPAIGNS

DUE_WITHIN = 30
"""Days before a release or a calibration ends in which it is due, unless stated; a choice: laboratories take weeks."""


@dataclass(frozen=True)
class Due:
    """What is due of a cell, of a release of it if any, or of a device, whose cell is empty."""

    cell: str
    release: int | None
    findings: tuple[Finding, ...]


def what_is_due(register: Register, *, within: int = DUE_WITHIN) -> tuple[Due, ...]:
    """What is due: releases that do not hold, end within so many days or were never confirmed, cells without one,
    calibrations that end."""
    found: list[Due] = []
    states = states_with(register, NOT_REPLACED)
    with register.reading() as connection:
        today = current_time(register, connection)[:10]
        devices = _devices(connection)
    for state in states:
        counting = [release for release in state.releases if release.counts]
        for release in counting:
            if release.failed:
                found.append(Due(state.cell, release.release, release.failed))
                continue
            if release.confirmed is False:
                found.append(Due(state.cell, release.release, (Finding.of(FindingKind.RELEASE_UNCONFIRMED),)))
            if release.simulated:
                found.append(Due(state.cell, release.release, (Finding.of(FindingKind.RELEASE_SIMULATED),)))
            if release.not_compared:
                found.append(Due(state.cell, release.release, (release.not_compared,)))
            if points := release.points_refused:
                beside = Finding.of(FindingKind.RELEASE_POINTS_REFUSED, points=", ".join(points))
                found.append(Due(state.cell, release.release, (beside,)))
            if (days := _days(today, release.valid_until or today)) <= within:
                figures = {"until": release.valid_until, "days": days}
                found.append(Due(state.cell, release.release, (Finding.of(FindingKind.RELEASE_ENDS, **figures),)))
        if not counting:
            found.append(Due(state.cell, None, (Finding.of(FindingKind.RELEASE_NONE),)))
    for device, until in devices.items():
        if until is None:
            found.append(Due("", None, (Finding.of(FindingKind.CALIBRATION_UNDATED, model=device),)))
        elif (days := _days(today, until)) <= within:
            kind = FindingKind.CALIBRATION_OVER if days < 0 else FindingKind.CALIBRATION_ENDS
            found.append(Due("", None, (Finding.of(kind, model=device, until=until, days=days),)))
    return tuple(found)


def _devices(connection: Connection) -> dict[str, str | None]:
    """Devices, and until when the latest calibration that is known of each holds."""
    query = select(CAMPAIGNS.c.device, func.max(CAMPAIGNS.c.calibrated_until)).where(CAMPAIGNS.c.device != "")
    return {
        row[0]: row[1] for row in connection.execute(query.group_by(CAMPAIGNS.c.device).order_by(CAMPAIGNS.c.device))
    }


def _days(today: str, until: str) -> int:
    return (date.fromisoformat(until) - date.fromisoformat(today)).days
