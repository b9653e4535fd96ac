"""Recordings of a campaign to its impacts table: every recording judged, every discard with its reason."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from forcemap.campaigns.binding import impact_sha256, stated_since
from forcemap.campaigns.campaign import Campaign, read_campaign, with_register
from forcemap.campaigns.columns import UNUSED
from forcemap.campaigns.conditions import CAMPAIGN_FILE
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.impact_rows import LEFT_OUT_IF_EMPTY, WRITTEN, Row, UsedRecordings, registered
from forcemap.campaigns.impacts_table import TABLE_FILE, read_dataset
from forcemap.campaigns.memory import NOTE_FILE, checksums_of, is_settled, read_from, remembering, settle
from forcemap.campaigns.phase_two import OLD_COLUMN, unused_cells
from forcemap.campaigns.point_recordings import films_at_points, register_points, registered_points
from forcemap.campaigns.pressures import (
    PRESSURES_FOLDER,
    Films,
    film_of,
    films_in,
    require_different,
    require_known,
)
from forcemap.campaigns.quantity import Quantity
from forcemap.campaigns.readout import Reader
from forcemap.campaigns.recordings_table import Entry, none_used, register_text
from forcemap.campaigns.walk import CampaignRecording, FileState, Progress, walk
from forcemap.csv_table import csv_text, read_table
from forcemap.errors import CampaignFileError, ChangedMeanwhile, MissingExtra, TableError
from forcemap.files import alone, file_sha256, read_bytes, sha256, sweep, write_atomically
from forcemap.findings import Finding
from forcemap.impacts.impact import Quality

_NEARLY_ALL = 0.9  # share of a table's rows that name a recording of the campaign; a choice: some may have been deleted
_NOT_AS_REGISTERED = (FileState.GONE, FileState.CURVE_GONE, FileState.CHANGED)
_TRIES = 3  # of collecting while another process collects the same folder; a choice


def build_dataset(
    campaign: Campaign, *, progress: Progress | None = None, workers: int = 1, enter: bool = False
) -> ImpactDataset:
    """Read, judge and register every recording of a campaign, and write its impacts table.

    Writes `recordings.csv` and `impacts.csv`, and `point_recordings.csv` where there are files in `points/`, each in
    one step; raw files are never touched. The same folder gives
    the same bytes, and a recording keeps its row when others are added. The register holds the hash of every row of the
    table, and the conditions under which each recording was first registered, which are never rewritten. A recording
    that was judged before, under the same conditions and by the same software, is not judged again, and a folder that
    is as it was left is only read (`forcemap.campaigns.memory`).

    Parameters
    ----------
    campaign : Campaign
    progress : callable, optional
        Called with the number of files done and of all files.
    workers : int, optional
        Processes that judge at once, where there are many files; more than one in a program without threads alone.
    enter : bool, optional
        Whether to enter tool, payload, covers, contact site, direction and safety settings that are stated since with
        the recordings that were registered before, as measured under them. Else every speed says that they are stated
        since; `entered_since` says what was entered.

    Returns
    -------
    ImpactDataset
        The table as `read_dataset` reads it.

    Raises
    ------
    CampaignFileError
        The device range is not stated; a registered file has changed or is gone; there are no recordings; the impacts
        table that is there was not written by this function, so that it would be lost.
    ChangedMeanwhile
        The register was changed while the recordings were read; nothing was written.
    MissingExtra
        A recording needs a package that is not installed.
    TableError
        No recording gave an impact that can be used, or the impacts contradict each other.
    """
    pending = enter and stated_since(registered_recordings(campaign), campaign.conditions)
    register_points(campaign.folder, campaign.conditions, campaign.columns, enter=enter)
    checksums = checksums_of(campaign)
    read = read_from(campaign, checksums)
    if is_settled(campaign, read) and not pending:
        if progress:
            progress(len(checksums), len(checksums))
        with alone(campaign.folder):
            sweep(campaign.folder)
            return read_dataset(campaign.folder)
    with remembering(campaign, checksums, workers=workers) as reader:
        entries, rows = collected(campaign, progress=progress, reader=reader, enter=enter)
    with alone(campaign.folder):
        if _sha256(campaign.register_file) != campaign.register_sha256:
            message = "was changed meanwhile, so nothing was written; run it again"
            raise ChangedMeanwhile(message, file=str(campaign.register_file))
        register = register_text(entries)
        if not rows:
            write_atomically(campaign.register_file, register)
        table = table_text(campaign, entries, rows)
        _require_own(campaign, entries, table)
        _write_together(campaign, register, table)
        dataset = read_dataset(campaign.folder)
        if checksums == {entry.file: entry.sha256 for entry in entries}:  # else one changed before it was read
            settle(campaign, read, register, table)
        return dataset


def registered_recordings(campaign: Campaign) -> list[Entry]:
    """The entries of both registers, that of the campaign and that of its contact points.

    Raises
    ------
    TableError
        The register of its contact points cannot be used.
    """
    return [*campaign.entries, *registered_points(campaign.folder)]


def entered_since(before: Iterable[Entry], campaign: Campaign) -> Finding | None:
    """What was entered of how the robot hit with recordings that were registered `before`; None if nothing was."""
    after = {entry.name: entry.conditions for entry in registered_recordings(with_register(campaign))}
    changed = (entry for entry in before if after.get(entry.name, entry.conditions) != entry.conditions)
    return stated_since(changed, campaign.conditions, entered=True)


def collect_campaign(
    folder: str | Path, *, progress: Progress | None = None, workers: int = 1, enter: bool = False
) -> tuple[Campaign, ImpactDataset]:
    """Read a campaign's folder and build its dataset; try again if another process collected it meanwhile.

    Parameters
    ----------
    folder : str or Path
    progress, workers, enter : optional
        As in `build_dataset`.

    Returns
    -------
    campaign : Campaign
        As it is afterwards.
    dataset : ImpactDataset

    Raises
    ------
    ForcemapError
        Those of `read_campaign` and `build_dataset`.
    """
    tries = _TRIES
    while True:
        try:
            campaign = read_campaign(folder)
            dataset = build_dataset(campaign, progress=progress, workers=workers, enter=enter)
            return with_register(campaign), dataset
        except ChangedMeanwhile:
            tries -= 1
            if not tries:
                raise


def collected(
    campaign: Campaign, *, progress: Progress | None = None, reader: Reader | None = None, enter: bool = False
) -> tuple[list[Entry], list[Row]]:
    """The entries of the register and the rows of the impacts table for the recordings as they are.

    Nothing is written. Arguments and errors as `build_dataset`, whose first half this is; without a reader every
    recording is judged, whatever is remembered.
    """
    if math.isnan(campaign.conditions.device.range):
        message = "the device range is not stated, so that a saturated recording would pass for a good one"
        file = str(campaign.folder / CAMPAIGN_FILE)
        raise CampaignFileError(f"{message}; state it in N", file=file, column="device.range_N")
    if not campaign.files() and not campaign.entries:
        message = "found no recording; put the device's files there, named as plan.csv says"
        raise CampaignFileError(message, file=str(campaign.recordings))
    judged: list[tuple[Entry, Row | None]] = []
    walked = walk(campaign, progress=progress, reader=reader)
    found = [replace(each, recorded=None) for each in walked]  # curves take memory
    used, films = UsedRecordings(found), films_in(campaign.folder / PRESSURES_FOLDER)
    for recording in found:
        if recording.state is FileState.GONE and recording.entry.blank:
            continue
        if recording.missing_extra:  # what is not installed here must not take its row out of the table
            raise MissingExtra(recording.unreadable, file=str(campaign.recordings / recording.entry.file))
        _require_unchanged(campaign, recording)
        judged.append(registered(campaign, recording, used, films, enter=enter))
    require_known(films, (entry for entry, _ in judged))
    require_different([*_films_of(films, judged), *films_at_points(campaign.folder)], campaign.conditions.film)
    return [entry for entry, _ in judged], [row for _, row in judged if row]


def _films_of(films: Films, judged: Iterable[tuple[Entry, Row | None]]) -> Iterator[tuple[Path, str]]:
    """The films of the recordings that are used, and the pressure that each gave."""
    for entry, row in judged:
        pressure = row and row.get(Quantity.PRESSURE.column)
        if pressure and (file := film_of(films, entry)):
            yield file, pressure


def table_text(campaign: Campaign, entries: list[Entry], rows: list[Row]) -> str:
    """The text of the impacts table.

    Raises
    ------
    CampaignFileError
        No recording gave an impact that can be used.
    """
    if not rows:
        why = f"{campaign.register_file.name} says why of each, the first: {entries[0].name}, {entries[0].reason}"
        raise CampaignFileError(f"{none_used(entries)}; {why}{_way_on(entries)}", file=str(campaign.table_file))
    unused = unused_cells(entries)
    rows = [row | unused for row in rows]
    shown = [
        name for name in (*WRITTEN, *UNUSED) if name not in LEFT_OUT_IF_EMPTY or any(row.get(name) for row in rows)
    ]
    return csv_text({name: [row.get(name, "") for row in rows] for name in shown})


def _way_on(entries: Iterable[Entry]) -> str:
    """What is left where curves begin too late to show the device's zero, and cannot be recorded again."""
    if not any(Quality.NO_BASELINE in entry.reason for entry in entries):
        return ""
    return (
        "; where curves of others begin too late and cannot be recorded again: take the published peaks into the "
        f"{TABLE_FILE} of another folder (docs/published_data.md, Only peaks were published)"
    )


def _require_unchanged(campaign: Campaign, recording: CampaignRecording) -> None:
    """Refuse a recording that is not what was registered."""
    if recording.state not in _NOT_AS_REGISTERED and recording.sha256:
        return
    entry, register = recording.entry, campaign.register_file.name
    was = next((each.file for each in campaign.entries if each.sha256 == recording.sha256 != entry.sha256), "")
    way = "restore it; a new measurement of the same run takes another repeat as its name (-r4), or delete its row in "
    way = f"{way}{register} first"
    if was:
        way = (
            f"it holds what was registered as {was}: name it so again; or, if the names are right now, delete the rows "
            f"of all that were renamed in {register}, and collect"
        )
    both = f"delete its row there and in {TABLE_FILE}"
    refusals = {
        FileState.GONE: f"registered in {register}, but the file is gone; put it back, or {both}",
        FileState.CURVE_GONE: f"registered in {register} with {entry.curve!r}, which the file does not hold; {both}",
        FileState.CHANGED: (
            "the file has changed since it was registered "
            f"({entry.sha256[:12]}... then, {recording.sha256[:12]}... now); {way}{_others_changed(campaign, entry)}"
        ),
    }
    if message := refusals.get(recording.state, recording.unreadable):
        raise CampaignFileError(message, file=str(campaign.recordings / entry.file))


def _others_changed(campaign: Campaign, entry: Entry) -> str:
    """Which files have changed besides."""
    others = [
        each.file
        for each in campaign.entries
        if each.file != entry.file
        and each.sha256
        and (campaign.recordings / each.file).is_file()
        and file_sha256(campaign.recordings / each.file) != each.sha256
    ]
    return f"; the same holds for {', '.join(dict.fromkeys(others))}" if others else ""


def _require_own(campaign: Campaign, entries: list[Entry], text: str) -> None:
    """Refuse to replace an impacts table that was not written here: it would be lost.

    The register knows the rows of its table, and so does the one to be written; those of files whose rows a person took
    out of the register are read again. Without a register, as when a person
    deleted it to register anew, a table counts as made from these recordings if it has the columns written here and
    nearly all of its rows name one of them.
    """
    if not campaign.table_file.exists():
        return
    content = read_bytes(campaign.table_file)
    if content == text.encode() or sha256(content) in _being_replaced(campaign):
        return
    known = {entry.impact_sha256 for entry in campaign.entries} - {""}
    written_now = {entry.impact_sha256 for entry in entries}
    try:
        rows = read_table(content, TABLE_FILE, what="impact").texts
    except TableError:
        rows = [{}]
    files = {file.lower() for file in campaign.files()}
    if known:
        taken_out = files - {entry.file.lower() for entry in campaign.entries}  # their rows were, to register them anew
        own = all(impact_sha256(row) in known | written_now or _file_of(row) in taken_out for row in rows)
    else:
        named = sum(_file_of(row) in files for row in rows)
        own = not rows or ({*WRITTEN} - {*LEFT_OUT_IF_EMPTY} <= rows[0].keys() and named >= _NEARLY_ALL * len(rows))
    if not own or not all(row.keys() <= {*WRITTEN, *UNUSED, OLD_COLUMN} for row in rows):
        problem = "forcemap collect did not write this table, or it was changed since, so it is not replaced"
        remedy = "move it away or rename it, then run forcemap collect again"
        raise CampaignFileError(f"{problem}; {remedy}", file=str(campaign.table_file))


def _file_of(row: Mapping[str, str]) -> str:
    """The file that a row of the impacts table names, in small letters."""
    return row.get("recording", "").partition("#")[0].lower()


def _write_together(campaign: Campaign, register: str, table: str) -> None:
    """Write both files; after a kill between the two, a note beside them says which table was being replaced."""
    note = campaign.folder / NOTE_FILE
    if _holds(campaign.register_file, register) and _holds(campaign.table_file, table):
        note.unlink(missing_ok=True)
        sweep(campaign.folder)
        return
    write_atomically(note, "\n".join({*_being_replaced(campaign), _sha256(campaign.table_file), sha256(table)}))
    write_atomically(campaign.register_file, register)
    write_atomically(campaign.table_file, table)
    note.unlink(missing_ok=True)


def _sha256(file: Path) -> str:
    """SHA-256 of a file; empty if there is none."""
    return file_sha256(file) if file.exists() else ""


def _holds(file: Path, text: str) -> bool:
    return file.exists() and read_bytes(file) == text.encode()


def _being_replaced(campaign: Campaign) -> list[str]:
    """Hashes of tables that a killed run was replacing, or wrote."""
    note = campaign.folder / NOTE_FILE
    return read_bytes(note).decode(errors="replace").split() if note.exists() else []
