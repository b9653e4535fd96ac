"""A recording of a campaign -> its entry in the register and its row of the impacts table."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace

import numpy as np

from forcemap.campaigns.binding import impact_sha256
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.columns import COLUMNS, RAW_PEAK
from forcemap.campaigns.conditions import CAMPAIGN_FILE
from forcemap.campaigns.contradictions import SPEEDS_APART
from forcemap.campaigns.plan import PLAN_FILE
from forcemap.campaigns.recordings_table import FIRST_READ, MEASURED_ON, PLANNED, READ_WITH, REGISTER_FILE, Entry, Use
from forcemap.campaigns.walk import CampaignRecording
from forcemap.csv_table import csv_cell
from forcemap.files import sha256
from forcemap.impacts.detect import force_without_impact, no_impact
from forcemap.impacts.quality import UNKNOWN_PEAK
from forcemap.impacts.scenario import BARRING, ContactScenario

Row = dict[str, str]
"""A row of the impacts table, a text for each column."""


@dataclass
class Taken:
    """Which runs, and which forces, have a recording that is used."""

    runs: dict[tuple[str, int], str] = field(default_factory=dict)
    forces: dict[str, str] = field(default_factory=dict)  # SHA-256 of all samples -> recording


def registered(campaign: Campaign, found: CampaignRecording, taken: Taken) -> tuple[Entry, Row | None]:
    """The entry of a recording that is there, sealed, and its row if it is used.

    Parameters
    ----------
    campaign : Campaign
    found : CampaignRecording
        Neither changed nor gone.
    taken : Taken
        What the recordings before it took; a recording that is used is added.
    """
    entry = _fresh(found)
    if entry.use is Use.USED:
        entry = _assigned(campaign, found, entry, taken)
    now = campaign.conditions.measured_under(entry.state_id, entry.name)
    if not entry.conditions and campaign.conditions.date:
        now[MEASURED_ON] = campaign.conditions.date
    if entry.use is not Use.USED:
        if campaign.conditions.devices and not entry.state_id:  # of which device it is hangs on the run it is
            now = {name: text for name, text in now.items() if not name.startswith("device.")}
        given_before = found.entry.impact_sha256 if entry.use is Use.UNREADABLE else ""
        return replace(entry, impact_sha256=given_before, conditions=now | dict(entry.conditions)), None
    row = _row(campaign, found, entry)
    taken.runs[entry.state_id, entry.repeat] = taken.forces[_hash_of_forces(found)] = entry.name
    return _sealed(entry, row, now | _basis(campaign, entry), several=bool(campaign.conditions.devices)), row


def _fresh(found: CampaignRecording) -> Entry:
    """The entry with what a person may state, nothing of an earlier judgement, and what its impacts show."""
    entry = Entry(sha256=found.sha256, use=Use.USED, **{name: getattr(found.entry, name) for name in _STATED})
    if found.entry.sha256 not in (
        "",
        found.sha256,
    ):  # it has grown, or nothing was found in it: as if read the first time
        read = {name: cell for name, cell in entry.conditions.items() if name not in (READ_WITH, FIRST_READ)}
        entry = replace(entry, conditions=read)
    recorded = found.recorded
    if recorded is None:
        return replace(entry, use=Use.UNREADABLE, reason=found.unreadable)
    entry = replace(entry, size=recorded.recording.size)
    if impacts := recorded.impacts:
        scenarios = [each.scenario for each in impacts]
        entry = replace(
            entry,
            scenario=next((each for each in BARRING if each in scenarios), scenarios[0]),
            peak_force=impacts[0].peak_force,
            raw_peak_force=impacts[0].raw_peak_force,
            phase2_force=float(np.fmax.reduce([each.phase2_force for each in impacts])),
            phase1_duration=impacts[0].phase1_end - impacts[0].onset,
            flags="; ".join([*map(str, impacts[0].flags), *recorded.recording.notes]),
        )
    elif held := force_without_impact(recorded.recording):  # a slow clamp is none, but a force acts all the same
        entry = replace(entry, phase2_force=held, scenario=ContactScenario.UNDETERMINED)
    if entry.exclude:
        return replace(entry, use=Use.EXCLUDED, reason=entry.exclude)
    if len(impacts) != 1:
        times = ", ".join(f"{each.onset:.3f}" for each in impacts)
        several = f"{len(impacts)} impacts, at {times} s, expected one; cut the file, or exclude it"
        return replace(entry, use=Use.DISCARDED, reason=several if impacts else no_impact(recorded.recording))
    return entry


def _hash_of_forces(found: CampaignRecording) -> str:
    """SHA-256 of the forces of a recording, whatever else is in its file."""
    return sha256(found.recorded.recording.force.tobytes()) if found.recorded else ""


_STATED = ("file", "curve", "state_id", "repeat", "speed", "exclude", "conditions")


def _assigned(campaign: Campaign, found: CampaignRecording, entry: Entry, taken: Taken) -> Entry:
    """The entry as a run of the plan, or with the reason why it is not used."""
    plan, recorded = campaign.plan, found.recorded
    assert recorded is not None
    state, repeat = found.run or ("", 0)
    if state not in plan.first_row or repeat < 1:
        reason = "the repeat is missing" if state in plan.first_row else f"{PLAN_FILE} has no state {state!r}"
        if found.run is None:
            remedy = (
                f"rename it as {PLAN_FILE} says, give state_id and repeat in {REGISTER_FILE}, or assign all in order"
            )
            remedy = f"{remedy} (forcemap collect --assign)"
            reason = f"no run of the plan has this name; {remedy}"
        return replace(entry, use=Use.UNASSIGNED, reason=reason)
    entry = replace(entry, state_id=state, repeat=repeat)
    planned = float(plan.speed[plan.first_row[state]])
    speed = planned if math.isnan(entry.speed) else entry.speed
    if math.isnan(recorded.recording.device.range):
        return replace(entry, use=Use.DISCARDED, reason=f"none of [[devices]] in {CAMPAIGN_FILE} is for it")
    doubts = [str(flag) for flag in recorded.impacts[0].flags if flag.name in UNKNOWN_PEAK]
    if reason := "; ".join(filter(None, [recorded.not_filtered, *doubts])):
        pass
    elif not planned / SPEEDS_APART <= speed <= planned * SPEEDS_APART:
        reason = f"speed_mps {speed:g} is far from the planned {planned:g} m/s; is it another state?"
    elif copied := taken.forces.get(_hash_of_forces(found)):
        reason = f"the same forces as {copied}: a copy is no repeat"
    elif other := taken.runs.get((state, repeat)):
        reason = f"{other} is that run already; give this one another repeat, or exclude one of the two"
    return replace(entry, use=Use.DISCARDED, reason=reason) if reason else entry


def _basis(campaign: Campaign, entry: Entry) -> dict[str, str]:
    """What the row of a recording rests on beside its file: its place in the plan, and how the file is read."""
    plan, columns = campaign.plan, campaign.columns
    i = plan.row_of.get((entry.state_id, entry.repeat), plan.first_row[entry.state_id])
    place = f"{plan.distance[i]:.12g} m, {plan.height[i]:.12g} m, {plan.speed[i]:.12g} m/s, {plan.role[i]}"
    stated = [(each, str(getattr(columns, each.name))) for each in (fields(columns) if columns else ())]
    words = ", ".join(f"{each.name} = {text}" for each, text in stated if text != str(each.default))
    held = "" if math.isnan(entry.phase2_force) else f", {entry.phase2_force:.2f} N in Phase II"
    return {
        PLANNED: f"{entry.state_id}: {place}",
        READ_WITH: words or "no entries",
        FIRST_READ: f"{entry.raw_peak_force:.2f} N, {entry.scenario}{held}",
    }


def _sealed(entry: Entry, row: Row, now: dict[str, str], *, several: bool) -> Entry:
    """The entry with the hash of its row, what was so when it was first used, and what is otherwise now."""
    then = dict(entry.conditions)
    if not then.get(PLANNED, "").startswith(f"{entry.state_id}: "):
        then.pop(PLANNED, None)  # a person says that it is another run
        if several:
            then = {name: text for name, text in then.items() if not name.startswith("device.")}
    if READ_WITH not in then:
        then.pop(FIRST_READ, None)
    was = now | then
    changed = []
    if was[PLANNED] != now[PLANNED]:
        changed.append(f"{PLANNED} was {was[PLANNED]!r}, {PLAN_FILE} now says {now[PLANNED]!r}")
    if was[READ_WITH] != now[READ_WITH] and was[FIRST_READ] != now[FIRST_READ]:  # in other words the same is no change
        gave = f"{READ_WITH} was {was[READ_WITH]!r} and gave {was[FIRST_READ]}"
        changed.append(f"{gave}, [recordings] of {CAMPAIGN_FILE} now {now[READ_WITH]!r} gives {now[FIRST_READ]}")
    return replace(entry, impact_sha256=impact_sha256(row), changed="; ".join(changed), conditions=was)


def _row(campaign: Campaign, found: CampaignRecording, entry: Entry) -> Row:
    """The row of the impacts table."""
    assert found.recorded is not None
    plan, impact = campaign.plan, found.recorded.impacts[0]
    i = plan.first_row[entry.state_id]
    own = plan.row_of.get((entry.state_id, entry.repeat), i)
    simulated = campaign.conditions.simulated or impact.recording.simulated
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
