"""Recordings of a campaign to its impacts table: every recording judged, every discard with its reason."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from forcemap.campaigns.binding import impact_sha256
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.conditions import CAMPAIGN_FILE
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.impacts_table import TABLE_FILE, read_dataset
from forcemap.campaigns.plan import PLAN_FILE
from forcemap.campaigns.recordings_table import FIRST_READ, PLANNED, READ_WITH, Entry, Use, register_text
from forcemap.campaigns.remark import REMARK, not_in_table
from forcemap.csv_table import csv_text, read_table
from forcemap.errors import CampaignFileError, InputError, RecordingError, TableError
from forcemap.files import file_sha256, read_bytes, sha256, write_atomically
from forcemap.impacts.detect import find_impacts, force_without_impact, no_impact
from forcemap.impacts.impact import Impact, Quality
from forcemap.impacts.quality import UNKNOWN_PEAK
from forcemap.impacts.scenario import BARRING, ContactScenario
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.read import read_recordings
from forcemap.recordings.recording import Recording

Progress = Callable[[int, int], None]

_NOTE = ".collecting"
_NEARLY_ALL = 0.9  # of a table's rows
_SPEEDS_APART = 1.5  # a measured speed may differ from the planned one by this factor
_COLUMNS = (
    "state_id",
    "repeat",
    "role",
    "distance_m",
    "height_m",
    "speed_mps",
    "peak_force_N",
    "censored",
    "base_angle_deg",
    "phase2_force_N",
    "scenario",
    "recording",
    "flags",
    "raw_peak_N",
)


def build_dataset(campaign: Campaign, *, progress: Progress | None = None) -> ImpactDataset:
    """Read, judge and register every recording of a campaign, and write its impacts table.

    Writes `recordings.csv` and `impacts.csv`, each in one step; raw files are never touched. The same folder gives
    the same bytes, and a recording keeps its row when others are added. The register holds the hash of every row of the
    table, and the conditions under which each recording was first registered, which are never rewritten.

    Parameters
    ----------
    campaign : Campaign
    progress : callable, optional
        Called with the number of files done and of all files.

    Returns
    -------
    ImpactDataset
        The table as `read_dataset` reads it.

    Raises
    ------
    CampaignFileError
        The device range is not stated; a registered file has changed or is gone; there are no recordings; the impacts
        table that is there was not written by this function, so that it would be lost.
    TableError
        No recording gave an impact that can be used, or the impacts contradict each other.
    """
    if math.isnan(campaign.conditions.device.range):
        raise CampaignFileError(
            "the device range is not stated, so that a saturated recording would pass for a good one; state it in N",
            file=str(campaign.folder / "campaign.toml"),
            column="device.range_N",
        )
    files = campaign.files()
    if not files and not campaign.entries:
        raise CampaignFileError(
            "found no recording; put the device's files there, named as plan.csv says", file=str(campaign.recordings)
        )
    known = _known(campaign, files)
    runs = _Runs.of(campaign)
    now = campaign.conditions.measured_under()
    order = [*known, *(file for file in files if file not in known)]
    entries: list[Entry] = []
    rows: list[dict[str, str]] = []
    for done, file in enumerate(order, start=1):
        for entry, row in _judge_file(campaign, file, known.get(file, []), runs):
            rows += [row] if row else []
            entries.append(_sealed(entry, row, now | (_basis(campaign, runs, entry) if row else {})))
        if progress:
            progress(done, len(order))
    there = file_sha256(campaign.register_file) if campaign.register_file.exists() else ""
    if there != campaign.register_sha256:
        raise CampaignFileError(
            "was changed meanwhile, so nothing was written; run it again", file=str(campaign.register_file)
        )
    remark = not_in_table(entries)
    rows = [row | {REMARK: remark} for row in rows]
    used = tuple(c for c in (*_COLUMNS, REMARK) if any(row[c] for row in rows) or c not in ("base_angle_deg", REMARK))
    register, table = register_text(entries), csv_text({column: [row[column] for row in rows] for column in used})
    if not rows:
        write_atomically(campaign.register_file, register)
        raise CampaignFileError(
            f"none of {len(entries)} recordings gave an impact that can be used; "
            f"{campaign.register_file.name} says why of each, the first: {entries[0].reason}",
            file=str(campaign.folder / TABLE_FILE),
        )
    _require_own(campaign, table)
    _write_together(campaign, register, table)
    return read_dataset(campaign.folder)


def _basis(campaign: Campaign, runs: _Runs, entry: Entry) -> dict[str, str]:
    """What the row of a recording rests on beside its file: its place in the plan, and how the file is read."""
    plan, i = campaign.plan, runs.states[entry.state_id]
    place = f"{plan.distance[i]:.12g} m, {plan.height[i]:.12g} m, {plan.speed[i]:.12g} m/s, {plan.role[i]}"
    fields = dataclasses.fields(ColumnMap) if campaign.columns else ()
    stated = {each.name: (getattr(campaign.columns, each.name), each.default) for each in fields}
    words = ", ".join(f"{name} = {value}" for name, (value, usual) in stated.items() if str(value) != str(usual))
    return {
        PLANNED: f"{entry.state_id}: {place}",
        READ_WITH: words or "no entries",
        FIRST_READ: f"{entry.raw_peak_force:.2f} N, {entry.scenario}"
        + ("" if math.isnan(entry.phase2_force) else f", {entry.phase2_force:.2f} N in Phase II"),
    }


def _sealed(entry: Entry, row: dict[str, str] | None, now: dict[str, str]) -> Entry:
    """The entry with the hash of its row, what was so when it was first used, and what is otherwise now."""
    then = dict(entry.conditions)
    if not row:
        return dataclasses.replace(entry, conditions=now | then)
    if not then.get(PLANNED, "").startswith(f"{entry.state_id}: "):
        then.pop(PLANNED, None)  # a person says that it is another run
    if READ_WITH not in then:
        then.pop(FIRST_READ, None)
    was = now | then
    changed = []
    if was[PLANNED] != now[PLANNED]:
        changed.append(f"{PLANNED} was {was[PLANNED]!r}, {PLAN_FILE} now says {now[PLANNED]!r}")
    if was[READ_WITH] != now[READ_WITH] and was[FIRST_READ] != now[FIRST_READ]:  # in other words the same is no change
        changed.append(
            f"{READ_WITH} was {was[READ_WITH]!r} and gave {was[FIRST_READ]}, [recordings] of {CAMPAIGN_FILE} now "
            f"{now[READ_WITH]!r} gives {now[FIRST_READ]}"
        )
    return dataclasses.replace(entry, impact_sha256=impact_sha256(row), changed="; ".join(changed), conditions=was)


def _require_own(campaign: Campaign, text: str) -> None:
    """Refuse to replace an impacts table that was not written here: it would be lost.

    The register knows the rows of its own table. Without one, as where a person deleted it to register anew, a table is
    taken for one of the recordings that are there if it has the columns that are written here and nearly all of its
    rows name one of them.
    """
    if not campaign.table_file.exists():
        return
    content = read_bytes(campaign.table_file)
    if content == text.encode() or sha256(content) in _being_replaced(campaign):
        return
    known = {entry.impact_sha256 for entry in campaign.entries} - {""}
    try:
        rows = read_table(content, TABLE_FILE, what="impact").texts
    except TableError:
        rows = [{}]
    if known:
        own = all(impact_sha256(row) in known for row in rows)
    else:
        files = {file.lower() for file in campaign.files()}
        named = sum(row.get("recording", "").partition("#")[0].lower() in files for row in rows)
        own = not rows or ({*_COLUMNS} - {"base_angle_deg"} <= rows[0].keys() and named >= _NEARLY_ALL * len(rows))
    own = own and all(row.keys() <= {*_COLUMNS, REMARK} for row in rows)
    if not own:
        raise CampaignFileError(
            "forcemap collect did not write this table, or it was changed since, so it is not replaced; move it away "
            "or rename it, then run forcemap collect again",
            file=str(campaign.table_file),
        )


def _write_together(campaign: Campaign, register: str, table: str) -> None:
    """Write both files; a note beside them tells, after a kill between the two, which table was being replaced."""
    note = campaign.folder / _NOTE
    replaced = file_sha256(campaign.table_file) if campaign.table_file.exists() else ""
    write_atomically(note, "\n".join({*_being_replaced(campaign), replaced, sha256(table)}))
    write_atomically(campaign.register_file, register)
    write_atomically(campaign.table_file, table)
    note.unlink(missing_ok=True)


def _being_replaced(campaign: Campaign) -> list[str]:
    """Hashes of tables that a killed run was replacing, or wrote."""
    note = campaign.folder / _NOTE
    return read_bytes(note).decode(errors="replace").split() if note.exists() else []


_UNNAMED: dict[str, Any] = {"state_id": "", "repeat": 0}


def _names_run(campaign: Campaign, file: str) -> bool:
    return _Runs.of(campaign).find(Entry(file=file), alone=True) is not None


def _known(campaign: Campaign, files: list[str]) -> dict[str, list[Entry]]:
    """The registered entries by file; a file of the same content under a new name is the same recording."""
    known: dict[str, list[Entry]] = {}
    for entry in campaign.entries:
        known.setdefault(entry.file, []).append(entry)
    there = set(files)
    gone = {file for file in known if file not in there}
    if not gone:
        return known
    new = {file_sha256(campaign.recordings / file): file for file in files if file not in known}
    renamed: dict[str, list[Entry]] = {}
    for file, entries in known.items():
        name = new.get(entries[0].sha256) if file in gone else file
        if name is not None:
            found = file in gone  # its new name says which run it is, if it says so
            renamed[name] = [
                dataclasses.replace(entry, file=name, **(_UNNAMED if found and _names_run(campaign, name) else {}))
                for entry in entries
            ]
        elif any(entry.scenario is not None or entry.exclude for entry in entries):
            raise CampaignFileError(
                f"registered in {campaign.register_file.name}, but the file is gone; put it back, or delete its row",
                file=str(campaign.recordings / file),
            )
    return renamed


@dataclass
class _Runs:
    """Which run a recording is, by its name; and which runs have a recording already."""

    by_name: dict[str, tuple[str, int]]  # lower case
    states: dict[str, int]  # state -> its first row of the plan
    rows: dict[tuple[str, int], int]  # run -> its row of the plan
    taken: dict[tuple[str, int], str]
    contents: dict[tuple[str, str], str]  # SHA-256 and curve -> recording that is used

    @classmethod
    def of(cls, campaign: Campaign) -> _Runs:
        plan = campaign.plan
        runs = list(zip(plan.state_id.tolist(), plan.repeat.tolist(), strict=True))
        by_name = {name.lower(): run for name, run in zip(plan.recording.tolist(), runs, strict=True)}
        first = {state: i for i, (state, _) in reversed(list(enumerate(runs)))}
        return cls(by_name, first, {run: i for i, run in enumerate(runs)}, {}, {})

    def find(self, entry: Entry, *, alone: bool) -> tuple[str, int] | None:
        """State and repeat: as registered, else by the name of the curve, or of the file if it holds one curve alone.

        Repeats beyond the plan are accepted.
        """
        if entry.state_id:
            return entry.state_id, entry.repeat
        for name in (entry.curve, PurePosixPath(entry.file).stem if alone else ""):
            lowered = name.lower()
            if lowered in self.by_name:
                return self.by_name[lowered]
            state, _, repeat = lowered.rpartition("-r")
            planned = self.by_name.get(f"{state}-r1")
            if planned and repeat.isascii() and repeat.isdigit() and 0 < int(repeat) < 1000:
                return planned[0], int(repeat)
        return None


def _judge_file(
    campaign: Campaign, file: str, known: list[Entry], runs: _Runs
) -> Iterator[tuple[Entry, dict[str, str] | None]]:
    """The entry of every recording in a file, and its row of the impacts table if it is used."""
    path = campaign.recordings / file
    by_curve = {entry.curve: entry for entry in known}
    try:
        recordings = read_recordings(path, columns=campaign.columns, device=campaign.conditions.device)
        digest = recordings[0].sha256
        unreadable = ""
    except RecordingError as error:
        recordings, digest = [], file_sha256(path)
        where = f"row {error.row}, " if error.row is not None else ""
        unreadable = f"{where}{error.message}"
    for entry in known:
        never_used = entry.use is Use.UNREADABLE and not entry.impact_sha256
        if entry.sha256 and entry.sha256 != digest and not never_used:
            raise CampaignFileError(
                f"the file has changed since it was registered ({entry.sha256[:12]}... then, {digest[:12]}... now); "
                f"restore it; a new measurement of the same run takes another repeat as its name (-r4), or delete its "
                f"row in {campaign.register_file.name} first",
                file=str(path),
            )
    if unreadable:
        for entry in known or [Entry(file=file)]:
            fresh = _fresh(entry, digest, Use.UNREADABLE, unreadable)
            yield dataclasses.replace(fresh, impact_sha256=entry.impact_sha256), None  # it gave one before
        return
    names = [recording.curve for recording in recordings]
    for curve in by_curve:
        if curve not in names and not (curve == "" and len(by_curve) == 1):
            message = f"registered with a curve {curve!r}, which the file does not hold; delete the row"
            raise CampaignFileError(message, file=str(path))
    for recording in recordings:
        whole = by_curve.get("", Entry(file=file))  # registered while the file could not be read
        entry = by_curve.get(recording.curve, whole)
        entry = dataclasses.replace(entry, curve=recording.curve, sha256=digest)
        yield _judge(campaign, recording, entry, runs, alone=len(recordings) == 1)


def _judge(
    campaign: Campaign, recording: Recording, entry: Entry, runs: _Runs, *, alone: bool
) -> tuple[Entry, dict[str, str] | None]:
    """One recording: what it is, whether it is used, and its row."""
    conditions = campaign.conditions
    if conditions.date:
        recording = dataclasses.replace(recording, metadata={**recording.metadata, "date": conditions.date})
    not_filtered = []
    try:
        impacts = find_impacts(recording, channel_frequency_class=conditions.channel_frequency_class)
    except InputError as error:  # whether it clamps counts all the same
        impacts, not_filtered = find_impacts(recording), [error.message]
    if not impacts:
        use, reason = (Use.EXCLUDED, entry.exclude) if entry.exclude else (Use.DISCARDED, no_impact(recording))
        held = force_without_impact(recording)  # a slow clamp is none, but a force acts all the same
        entry = _fresh(entry, entry.sha256, use, reason)
        return dataclasses.replace(
            entry, phase2_force=held, scenario=ContactScenario.UNDETERMINED
        ) if held else entry, None
    impact = impacts[0]
    entry = dataclasses.replace(
        _fresh(entry, entry.sha256, Use.USED, ""),
        scenario=_gravest([each.scenario for each in impacts]),
        peak_force=impact.peak_force,
        raw_peak_force=impact.raw_peak_force,
        phase2_force=float(np.fmax.reduce([each.phase2_force for each in impacts])),
        flags="; ".join([*map(str, impact.flags), *recording.notes]),
    )
    if entry.exclude:
        return dataclasses.replace(entry, use=Use.EXCLUDED, reason=entry.exclude), None
    if len(impacts) > 1:
        times = ", ".join(f"{each.onset:.3f}" for each in impacts)
        reason = f"{len(impacts)} impacts, at {times} s, expected one; cut the file, or exclude it"
        return dataclasses.replace(entry, use=Use.DISCARDED, reason=reason), None
    run = runs.find(entry, alone=alone)
    if run is None or run[0] not in runs.states or run[1] < 1:
        reason = "no run of the plan has this name; rename it as plan.csv says, or give state_id and repeat in "
        reason += campaign.register_file.name
        if run is not None:
            reason = f"plan.csv has no state {run[0]!r}" if run[0] not in runs.states else "the repeat is missing"
        return dataclasses.replace(entry, use=Use.UNASSIGNED, reason=reason), None
    entry = dataclasses.replace(entry, state_id=run[0], repeat=run[1])
    doubts = [*not_filtered, *(str(flag) for flag in impact.flags if flag.name in UNKNOWN_PEAK)]
    if doubts:
        return dataclasses.replace(entry, use=Use.DISCARDED, reason="; ".join(doubts)), None
    planned = float(campaign.plan.speed[runs.states[run[0]]])
    if not planned / _SPEEDS_APART <= (planned if math.isnan(entry.speed) else entry.speed) <= planned * _SPEEDS_APART:
        reason = f"speed_mps {entry.speed:g} is far from the planned {planned:g} m/s; is it another state?"
        return dataclasses.replace(entry, use=Use.DISCARDED, reason=reason), None
    content = (entry.sha256, entry.curve)
    if content in runs.contents:
        reason = f"the same content as {runs.contents[content]}: a copy is no repeat"
        return dataclasses.replace(entry, use=Use.DISCARDED, reason=reason), None
    if run in runs.taken:
        reason = f"{runs.taken[run]} is that run already; give this one another repeat, or exclude one of the two"
        return dataclasses.replace(entry, use=Use.DISCARDED, reason=reason), None
    runs.taken[run] = runs.contents[content] = entry.name
    return entry, _row(campaign, runs, entry, impact)


def _gravest(scenarios: list[ContactScenario]) -> ContactScenario:
    """The scenario that bars the transient limit, if an impact has one; else that of the first."""
    return next((each for each in BARRING if each in scenarios), scenarios[0])


def _fresh(entry: Entry, digest: str, use: Use, reason: str) -> Entry:
    """The entry with what a person may state, and nothing of an earlier judgement."""
    return Entry(
        file=entry.file,
        curve=entry.curve,
        sha256=digest,
        state_id=entry.state_id,
        repeat=entry.repeat,
        speed=entry.speed,
        exclude=entry.exclude,
        use=use,
        reason=reason,
        conditions=entry.conditions,
    )


def _row(campaign: Campaign, runs: _Runs, entry: Entry, impact: Impact) -> dict[str, str]:
    """The row of the impacts table.

    A force after Phase I that exceeds its peak within the 0.5 s of the transient limit takes the peak's place: a map
    of the lower one would permit too much.
    """
    plan, i = campaign.plan, runs.states[entry.state_id]
    angle = float(plan.base_angle[runs.rows.get((entry.state_id, entry.repeat), i)])
    peak = impact.raw_peak_force if impact.saturated else impact.peak_force  # saturated: a lower bound
    if impact.has(Quality.LATER_PEAK) or impact.has(Quality.DOUBLE_HIT):
        peak = max(peak, impact.later_force)
    simulated = campaign.conditions.simulated or impact.recording.simulated
    names = [*(flag.name.value for flag in impact.flags), *(["simulated"] if simulated else [])]
    return {
        "state_id": entry.state_id,
        "repeat": str(entry.repeat),
        "role": str(plan.role[i]),
        "distance_m": repr(float(plan.distance[i])),
        "height_m": repr(float(plan.height[i])),
        "speed_mps": repr(float(plan.speed[i]) if math.isnan(entry.speed) else entry.speed),
        "peak_force_N": f"{peak:.2f}",
        "censored": "true" if impact.saturated else "false",
        "base_angle_deg": "" if math.isnan(angle) else repr(angle),
        "phase2_force_N": "" if math.isnan(impact.phase2_force) else f"{max(impact.phase2_force, 0.0):.2f}",
        "scenario": impact.scenario.value,
        "recording": entry.name,
        "flags": "; ".join(names),
        "raw_peak_N": f"{impact.raw_peak_force:.2f}",
    }
