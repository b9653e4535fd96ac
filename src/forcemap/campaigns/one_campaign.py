"""Whether a table holds the impacts of one campaign: of one robot, tool, contact site, direction and safety setting."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from forcemap.arrays import FloatArray, Indices, Objects, Texts
from forcemap.campaigns.columns import Where
from forcemap.campaigns.conditions import CAMPAIGN_FILE, ENTRIES, Conditions, condition_text
from forcemap.impacts.scenario import ContactScenario

_APART = (
    "a campaign is all impacts of one robot, tool, contact site, direction and safety setting; make a table for each"
)
_MOST_SCATTER = 0.10  # standard deviation of ln F between repeats; devices and robots repeat within 1 to 3 %
# Two series in one table, choices checked by tests/test_one_campaign.py: rms of ln F between them, without repeats and
# with; its variance over that of the repeats.
_SERIES_APART, _SERIES_RATIO = (0.10, 0.05), 10.0
_LEAST_DEGREES = 3  # of freedom, to judge the scatter of repeats
_LEAST_AGAIN = 3  # states measured in both series
_MORE_NAMES = {
    **{f"robot{word}": "robot.model" for word in ("", "name", "type")},
    **{f"safety{word}": "robot.safety_settings" for word in ("", "setting", "configuration", "checksum")},
    "tool": "tool.name",
    "cover": "tool.covers",
    "contactpoint": "contact.site",
    "motion": "contact.direction",
}


def _known_columns() -> dict[str, str]:
    """Entry of campaign.toml by the name that a column of a table may give it, in small letters and digits."""
    named = dict(_MORE_NAMES)
    for entry in ENTRIES:
        section, _, key = entry.rpartition(".")
        if section in ("robot", "tool", "contact") and key not in ("speed", "base_angle_deg"):
            named |= {_plain(entry): entry} | ({} if key in ("model", "name") else {_plain(key): entry})
    return named


def require_one_campaign(columns: Mapping[str, Sequence[str]], conditions: Conditions, where: Where) -> None:
    """Refuse columns that name several robots, tools, sites, directions or safety settings, or one of another campaign.

    Parameters
    ----------
    columns : mapping of str to sequence of str
        The unknown columns of a table; those that name none of these say nothing here. Empty cells state nothing.
    conditions : Conditions
        What campaign.toml states.
    where : Where
        Makes the errors.

    Raises
    ------
    TableError
        Two of them in a column, or one that campaign.toml states otherwise.
    """
    known, stated = _known_columns(), conditions.stated
    for name, cells in columns.items():
        if (entry := known.get(_plain(name))) is None:
            continue
        first: str | None = None
        for position, cell in enumerate(str(value).strip() for value in cells):
            if not cell:
                continue
            if entry in stated and not _same(entry, cell, stated[entry]):
                expected = f"expected {str(stated[entry])!r}, the {entry} of {CAMPAIGN_FILE}"
                raise where.error(position, name, f"found {cell!r}, {expected}; {_APART}")
            if first is not None and condition_text(entry, cell) != condition_text(entry, first):
                raise where.error(position, name, f"found {cell!r}, expected {first!r} as in the rows above; {_APART}")
            first = cell


def require_one_scenario(scenario: Objects, recording: Iterable[str], where: Where) -> None:
    """Refuse a table without recordings that states free and constrained contacts: these are of two set-ups.

    With recordings, the scenario is what every curve shows, and may differ within one set-up.

    Raises
    ------
    TableError
        Unconstrained impacts beside constrained ones.
    """
    constrained = (ContactScenario.WITH_CLAMPING, ContactScenario.WITHOUT_CLAMPING)
    if any(recording) or ContactScenario.UNCONSTRAINED not in scenario or not {*scenario} & {*constrained}:
        return
    first = next(stated for stated in scenario if stated is not None)
    others = constrained if first is ContactScenario.UNCONSTRAINED else (ContactScenario.UNCONSTRAINED,)
    position = next(row for row, stated in enumerate(scenario) if stated in others)
    problem = f"found {scenario[position]}, expected one set-up, constrained or not, as in the rows above"
    raise where.error(position, "scenario", f"{problem}; {_APART}")


def require_one_series(
    names: Texts, force: FloatArray, recording: Iterable[str], stated: Iterable[str], where: Where
) -> None:
    """Refuse a table without recordings whose states come again with other forces: two tables in one.

    Repeats whose pooled standard deviation of ln F is above 10 % are of several set-ups, in whatever order. A second
    series begins at the first row of a state that other states' rows have followed since. Refused is an rms difference
    of the states' geometric means above 5 % that is more than the repeats within each series explain; above 10 % where
    there are none.

    Parameters
    ----------
    names : array of str, shape (n,)
        Role and state of each impact, in the order of the table: a state measured again as a test shows a drift.
    force : array, shape (n,)
        Peak force [N]; NaN where it is censored.
    recording : iterable of str
        Recording of each impact; with recordings, one campaign.toml says what they were measured under.
    stated : iterable of str
        Other columns of the table; one that names robot, tool or safety setting settles it.
    where : Where
        Makes the errors.

    Raises
    ------
    TableError
        At least three states measured in both series, with other forces.
    """
    first, state = np.unique(names, return_index=True, return_inverse=True)[1:]
    again = np.flatnonzero((first[state] < np.arange(state.size)) & (np.diff(state, prepend=-1) != 0))
    if any(recording) or {_plain(name) for name in stated} & _known_columns().keys():
        return
    known = np.isfinite(force)
    remedy = "if it is one, say so in a column safety_settings"
    away = _from_mean(np.log(force[known]), state[known])
    freedom = away.size - np.unique(state[known]).size
    if freedom >= _LEAST_DEGREES and (scatter := math.sqrt(float(away @ away) / freedom)) > _MOST_SCATTER:
        position = int(np.flatnonzero(known)[np.abs(away).argmax()])
        problem = f"found repeats of the states {scatter:.0%} apart (standard deviation)"
        raise where.error(position, "peak_force_N", f"{problem}, expected one set-up; {_APART}; {remedy}")
    if not again.size:
        return
    cell, log = 2 * state[known] + (np.arange(force.size) >= again[0])[known], np.log(force[known])
    count, total = np.bincount(cell, minlength=2 * first.size), np.bincount(cell, log, 2 * first.size)
    mean = total / np.maximum(count, 1)
    both = count.reshape(-1, 2).min(axis=1) > 0
    apart, repeats = np.diff(mean.reshape(-1, 2)[both])[:, 0], count.reshape(-1, 2)[both]
    if apart.size < _LEAST_AGAIN:
        return
    rms, freedom = math.sqrt(float(np.mean(apart**2))), int((repeats - 1).sum())
    between = float(np.mean(apart**2 / (1 / repeats).sum(axis=1)))
    within = float(np.sum((log - mean[cell]) ** 2 * both[cell // 2])) / max(freedom, 1)
    if rms > _SERIES_APART[freedom > 0] and between > _SERIES_RATIO * within:
        problem = f"found {apart.size} states again from here on, with forces {rms:.0%} apart (rms) from those above"
        raise where.error(
            int(again[0]), "peak_force_N", f"{problem}, expected one series of impacts; {_APART}; {remedy}"
        )


def _from_mean(values: FloatArray, group: Indices) -> FloatArray:
    """Values less the mean of their group, shape (n,)."""
    return np.asarray(values - (np.bincount(group, values) / np.maximum(np.bincount(group), 1))[group])


def _same(entry: str, cell: str, stated: object) -> bool:
    """True if a cell says what is stated, or a part of its words, such as a model without its maker."""
    one, other = condition_text(entry, cell), condition_text(entry, stated)
    words = [{*re.findall(r"\w+", text.casefold())} for text in (one, other)]
    return one == other or (isinstance(stated, str) and bool(words[0]) and words[0] <= words[1])


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())
