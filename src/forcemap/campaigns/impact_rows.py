"""A recording of a campaign -> its entry in the register and its row of the impacts table."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import fields, replace
from typing import Any

import numpy as np

from forcemap.campaigns.binding import as_known, impact_sha256
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.columns import COLUMNS, RAW_PEAK
from forcemap.campaigns.conditions import CAMPAIGN_FILE
from forcemap.campaigns.contradictions import SPEEDS_APART
from forcemap.campaigns.copies import Edge, Edges
from forcemap.campaigns.plan import PLAN_FILE, MeasurementPlan
from forcemap.campaigns.pressures import FilmReading, Films, film_reading
from forcemap.campaigns.readout import Readout
from forcemap.campaigns.recordings_table import (
    FIRST_READ,
    MEASURED_ON,
    PLANNED,
    PRESSURE_FROM,
    READ_WITH,
    REGISTER_FILE,
    Entry,
    Use,
)
from forcemap.campaigns.walk import CampaignRecording
from forcemap.csv_table import csv_cell
from forcemap.impacts.quality import UNKNOWN_PEAK
from forcemap.impacts.scenario import BARRING, ContactScenario
from forcemap.recordings.column_map import ColumnMap

Row = dict[str, str]
"""A row of the impacts table, a text for each column."""


class UsedRecordings:
    """The recording that is used of each run, and which recordings of a campaign hold one and the same impact.

    Parameters
    ----------
    recordings : iterable of CampaignRecording
        All of the campaign: an impact is of one run, whatever becomes of the files that hold it.
    """

    def __init__(self, recordings: Iterable[CampaignRecording]) -> None:
        self.runs: dict[tuple[str, int], str] = {}
        self._held = [(each, impact.edge) for each in recordings if each.readout for impact in each.readout.impacts]
        self._edges = Edges(edge for _, edge in self._held)

    def copied(self, recording: CampaignRecording, edge: Edge, run: tuple[str, int]) -> str:
        """Why an impact of a run counts already, or may be of another one; empty if it is neither."""
        held = [self._held[i][0] for i in self._edges.same_as(edge)]
        for other in (each for each in held if each is not recording):
            name, of = other.entry.name, other.run
            if other.excluded and of != run:
                way = f"if it was made at this run, take that file away, and its row out of {REGISTER_FILE}"
                return f"the same forces as {name}, which is excluded: a copy is no other run; {way}"
            if of and of[0] != run[0]:
                way = f"take the wrong file away, and its row out of {REGISTER_FILE}"
                return f"the same forces as {name}, which is of another state: one of the two is wrong; {way}"
            if self.runs.get(of or run) == name:
                return f"the same forces as {name}: a copy is no repeat"
        return ""


def registered(
    campaign: Campaign, recording: CampaignRecording, used: UsedRecordings, films: Films, *, enter: bool = False
) -> tuple[Entry, Row | None]:
    """The sealed entry of a recording whose file exists, and its row if it is used.

    Parameters
    ----------
    campaign : Campaign
    recording : CampaignRecording
        Neither changed nor gone.
    used : UsedRecordings
        Those used so far; this recording is added if it is used.
    films : Films
        Of the campaign.
    enter : bool
        Whether to enter with it what is stated since of how the robot hit.
    """
    entry = _fresh(recording)
    if entry.use is Use.USED:
        entry = _assigned(campaign, recording, entry, used)
    stated = campaign.conditions.measured_under(entry.state_id, entry.name)
    now = as_known(entry.conditions, stated, entered=enter or not recording.entry.sha256)  # else it is new
    if not entry.conditions and campaign.conditions.date:
        now[MEASURED_ON] = campaign.conditions.date
    if entry.use is not Use.USED:
        if campaign.conditions.devices and not entry.state_id:  # without its run, its device is not known
            now = {name: text for name, text in now.items() if not name.startswith("device.")}
        given_before = recording.entry.impact_sha256 if entry.use is Use.UNREADABLE else ""
        return replace(entry, impact_sha256=given_before, conditions=now | dict(entry.conditions)), None
    assert recording.readout is not None
    film = film_reading(films, campaign, entry)
    row = _row(campaign, recording.readout, entry) | (film.cells if film else _NO_PRESSURE)
    used.runs[entry.state_id, entry.repeat] = entry.name
    return _sealed(entry, row, now | _basis(campaign, entry, film), several=bool(campaign.conditions.devices)), row


def _fresh(recording: CampaignRecording) -> Entry:
    """The entry with what a person stated and what its impacts show, without earlier judgements."""
    found: dict[str, Any] = {name: getattr(recording.entry, name) for name in _STATED}
    found |= {"sha256": recording.sha256, "use": Use.USED}
    if recording.entry.sha256 not in ("", recording.sha256):  # it has grown, or had no impact: read as if new
        then = recording.entry.conditions.items()
        found["conditions"] = {name: cell for name, cell in then if name not in (READ_WITH, FIRST_READ)}
    shown = recording.readout
    if shown is None:
        return Entry(**found | {"use": Use.UNREADABLE, "reason": recording.unreadable})
    found["size"] = shown.size
    if impacts := shown.impacts:
        scenarios = [impact.scenario for impact in impacts]
        found |= {name: getattr(impacts[0], name) for name in ("peak_force", "raw_peak_force", "phase1_duration")}
        found |= {
            "scenario": next((scenario for scenario in BARRING if scenario in scenarios), scenarios[0]),
            "phase2_force": float(np.fmax.reduce([impact.phase2_force for impact in impacts])),
            "flags": "; ".join([*map(str, impacts[0].flags), *shown.notes]),
        }
    elif shown.force_without:  # a slow clamp is no impact, but a force acts
        found |= {"phase2_force": shown.force_without, "scenario": ContactScenario.UNDETERMINED}
    if reason := recording.entry.exclude:
        found |= {"use": Use.EXCLUDED, "reason": reason}
    elif len(impacts) != 1:
        times = ", ".join(f"{impact.onset:.3f}" for impact in impacts)
        several = f"{len(impacts)} impacts, at {times} s, expected one; cut the file, or exclude it"
        found |= {"use": Use.DISCARDED, "reason": several if impacts else shown.doubt_words}
    return Entry(**found)


_STATED = ("file", "curve", "state_id", "repeat", "speed", "exclude", "conditions")


def _assigned(campaign: Campaign, recording: CampaignRecording, entry: Entry, used: UsedRecordings) -> Entry:
    """The entry as a run of the plan, or with the reason why it is not used."""
    plan, shown = campaign.plan, recording.readout
    assert shown is not None
    doubts = [str(flag) for flag in shown.impacts[0].flags if flag.name in UNKNOWN_PEAK]
    doubted = "; ".join(filter(None, [shown.doubt_words, *doubts]))
    state, repeat = recording.run or ("", 0)
    if state not in plan.first_row or repeat < 1:
        reason = "the repeat is missing" if state in plan.first_row else f"{PLAN_FILE} has no state {state!r}"
        if recording.run is None:
            remedy = (
                f"rename it as {PLAN_FILE} says, give state_id and repeat in {REGISTER_FILE}, or assign all in order"
            )
            remedy = f"{remedy} (forcemap collect --assign)"
            reason = f"no run of the plan has this name; {remedy}"
        return replace(entry, use=Use.UNASSIGNED, reason="; ".join(filter(None, [reason, doubted])))
    if (entry.state_id, entry.repeat) != (state, repeat):
        entry = replace(entry, state_id=state, repeat=repeat)
    planned = float(plan.speed[plan.first_row[state]])
    speed = planned if math.isnan(entry.speed) else entry.speed
    if math.isnan(campaign.conditions.device_of(state, entry.name).range):
        return replace(entry, use=Use.DISCARDED, reason=f"none of [[devices]] in {CAMPAIGN_FILE} is for it")
    if reason := doubted:
        pass
    elif not planned / SPEEDS_APART <= speed <= planned * SPEEDS_APART:
        reason = f"speed_mps {speed:g} is far from the planned {planned:g} m/s; is it another state?"
    elif copied := used.copied(recording, shown.impacts[0].edge, (state, repeat)):
        reason = copied
    elif other := used.runs.get((state, repeat)):
        reason = f"{other} is that run already; give this one another repeat, or exclude one of the two"
    return replace(entry, use=Use.DISCARDED, reason=reason) if reason else entry


def columns_words(columns: ColumnMap | None) -> str:
    """How files are read, as the register has it: the entries of [recordings] that are not at their default."""
    stated = [(option, str(getattr(columns, option.name))) for option in (fields(columns) if columns else ())]
    return (
        ", ".join(f"{option.name} = {text}" for option, text in stated if text != str(option.default)) or "no entries"
    )


def _basis(campaign: Campaign, entry: Entry, film: FilmReading | None) -> dict[str, str]:
    """What the row of a recording depends on besides its file: its place in the plan, how it is read, its film."""
    phase2 = "" if math.isnan(entry.phase2_force) else f", {entry.phase2_force:.2f} N in Phase II"
    return {
        PLANNED: planned_words(campaign.plan, entry),
        READ_WITH: columns_words(campaign.columns),
        FIRST_READ: f"{entry.raw_peak_force:.2f} N, {entry.scenario}{phase2}",
        **({PRESSURE_FROM: film.origin} if film else {}),
    }


def planned_words(plan: MeasurementPlan, entry: Entry) -> str:
    """Where a plan puts the state of a recording; empty if it does not have it."""
    i = plan.row_of.get((entry.state_id, entry.repeat), plan.first_row.get(entry.state_id))
    if i is None:
        return ""
    place = f"{plan.distance[i]:.12g} m, {plan.height[i]:.12g} m, {plan.speed[i]:.12g} m/s, {plan.role[i]}"
    return f"{entry.state_id}: {place}"


def _sealed(entry: Entry, row: Row, now: dict[str, str], *, several: bool) -> Entry:
    """The entry with the hash of its row, the conditions when it was first used, and what has changed since."""
    then = dict(entry.conditions)
    if not then.get(PLANNED, "").startswith(f"{entry.state_id}: "):
        then.pop(PLANNED, None)  # a person assigned it to another run
        if several:
            then = {name: text for name, text in then.items() if not name.startswith("device.")}
    if READ_WITH not in then:
        then.pop(FIRST_READ, None)
    was = now | then
    changed = []
    if was[PLANNED] != now[PLANNED]:
        changed.append(f"{PLANNED} was {was[PLANNED]!r}, {PLAN_FILE} now says {now[PLANNED]!r}")
    if was[READ_WITH] != now[READ_WITH] and was[FIRST_READ] != now[FIRST_READ]:  # the same in other words is no change
        gave = f"{READ_WITH} was {was[READ_WITH]!r} and gave {was[FIRST_READ]}"
        changed.append(f"{gave}, [recordings] of {CAMPAIGN_FILE} now {now[READ_WITH]!r} gives {now[FIRST_READ]}")
    if was.get(PRESSURE_FROM) != now.get(PRESSURE_FROM):
        given = now.get(PRESSURE_FROM, "none")
        changed.append(f"{PRESSURE_FROM} was {was[PRESSURE_FROM]!r}, now it is {given!r}")
    return replace(entry, impact_sha256=impact_sha256(row), changed="; ".join(changed), conditions=was)


def _row(campaign: Campaign, shown: Readout, entry: Entry) -> Row:
    """The row of the impacts table."""
    plan, impact = campaign.plan, shown.impacts[0]
    i = plan.first_row[entry.state_id]
    own = plan.row_of.get((entry.state_id, entry.repeat), i)
    simulated = campaign.conditions.simulated or shown.simulated
    return {
        "distance_m": repr(float(plan.distance[i])),
        "height_m": repr(float(plan.height[i])),
        "speed_mps": repr(float(plan.speed[i]) if math.isnan(entry.speed) else entry.speed),
        "peak_force_N": f"{impact.map_force:.2f}",
        "state_id": entry.state_id,
        "repeat": str(entry.repeat),
        "role": str(plan.role[own]),
        "censored": csv_cell(impact.saturated),
        "base_angle_deg": csv_cell(float(plan.base_angle[own])),
        "phase2_force_N": csv_cell(float(np.maximum(impact.phase2_force, 0.0)), ".2f"),
        "scenario": impact.scenario.value,
        "recording": entry.name,
        "flags": "; ".join([*(flag.name.value for flag in impact.flags), *(["simulated"] if simulated else [])]),
        RAW_PEAK: f"{impact.raw_peak_force:.2f}",
    }


WRITTEN = ("state_id", "repeat", "role", *(c for c in COLUMNS if c not in ("state_id", "repeat", "role")), RAW_PEAK)
"""The columns of a row, in the order of the table."""

_NO_PRESSURE = {"peak_pressure_N_per_cm2": "", "pressure_censored": ""}

LEFT_OUT_IF_EMPTY = ("base_angle_deg", *_NO_PRESSURE)
"""Those that a table lacks if they are empty in all its rows, or if it was collected before there were such columns."""
