"""A campaign's folder: the files that a result rests on, its table of limits, and what does not fit together."""

from __future__ import annotations

import contextlib
import csv
import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from forcemap.assessment.contact_points import PHOTOGRAPHS_FOLDER, POINTS_FILE
from forcemap.assessment.missing import error_words
from forcemap.campaigns.build import collected, table_text
from forcemap.campaigns.campaign import RECORDINGS_FOLDER, Campaign, campaign_folder
from forcemap.campaigns.conditions import CAMPAIGN_FILE, Conditions
from forcemap.campaigns.dataset import Binding, BindingState, ImpactDataset
from forcemap.campaigns.impacts_table import TABLE_FILE, read_dataset
from forcemap.campaigns.plan import PLAN_FILE
from forcemap.campaigns.point_list import POINT_REGISTER, POINTS_FOLDER
from forcemap.campaigns.point_recordings import unregistered
from forcemap.campaigns.pressures import PRESSURES_FOLDER
from forcemap.campaigns.readout import Reader
from forcemap.campaigns.recordings_table import REGISTER_FILE, Entry, read_register
from forcemap.errors import CampaignFileError, ForcemapError, InputError
from forcemap.files import file_sha256, read_bytes, sha256
from forcemap.findings import Finding, FindingKind
from forcemap.limits.body_areas import LimitTable, read_limit_table, standard_limit_table
from forcemap.limits.device_spring import device_suitability
from forcemap.limits.force_limits import ForceLimit

_FILES = (CAMPAIGN_FILE, PLAN_FILE, REGISTER_FILE, TABLE_FILE, POINTS_FILE, POINT_REGISTER)
_MEASURED = (RECORDINGS_FOLDER, PRESSURES_FOLDER, POINTS_FOLDER)
_FOLDERS = ("maps", *_MEASURED, PHOTOGRAPHS_FOLDER)


@dataclass(frozen=True)
class InputFile:
    """A file of a campaign.

    Parameters
    ----------
    path : str
        Below the campaign's folder, with slashes.
    sha256 : str
        Of its content, in hexadecimal; empty if it cannot be read.
    """

    path: str
    sha256: str


def campaign_inputs(folder: str | Path, *, further: Iterable[str] = ()) -> tuple[InputFile, ...]:
    """The files that a campaign's result rests on: campaign.toml, tables, maps, recordings, films,
    photographs.

    Hidden files and links that lead to no file are left out.

    Parameters
    ----------
    folder : str or Path
        The campaign's folder.
    further : iterable of str
        Paths of further files, below the folder.

    Raises
    ------
    InputError
        There is no such folder.
    """
    root = campaign_folder(folder)
    paths = {name: root / name for name in (*_FILES, *further)}
    for below in (path.relative_to(root) for name in _FOLDERS for path in (root / name).rglob("*")):
        if not any(part.startswith(".") for part in below.parts):
            paths[below.as_posix()] = root / below
    first = [name for name in paths if "/" not in name]
    names = [*first, *sorted(paths.keys() - set(first))]
    return tuple(InputFile(name, _sha256(paths[name])) for name in names if paths[name].is_file())


def is_standard_input(path: str) -> bool:
    """True if a path below a campaign's folder is an input of every campaign that has it."""
    return path in _FILES or path.partition("/")[0] in _FOLDERS


def inputs_sha256(inputs: Iterable[InputFile]) -> str:
    """One SHA-256 for all files: of their names and hashes, in order of the names."""
    lines = sorted(f"{file.sha256}  {file.path}\n" for file in inputs)
    return sha256("".join(lines).encode("utf-8", "surrogateescape"))


def _sha256(path: Path) -> str:
    with contextlib.suppress(InputError):
        return file_sha256(path)
    return ""


@dataclass(frozen=True)
class CampaignLimitTable:
    """The table of limits of a campaign.

    Parameters
    ----------
    table : LimitTable
        That of the campaign, else the standard's.
    file : str
        Its file in the campaign's folder; empty for the standard's.
    """

    table: LimitTable
    file: str


def folder_of(source: str | Path) -> Path | None:
    """The folder with campaign.toml that a path names: itself, by its impacts table or by a file measured in it.

    None if there is none.
    """
    there = Path(source).exists()  # else the name of a published map, or of a folder to be made
    for file in dict.fromkeys((Path(source).absolute(), Path(source).resolve())) if str(source) and there else ():
        above = [folder.parent for folder in file.parents if folder.name in _MEASURED]
        for folder in (file if file.is_dir() else file.parent, *above):
            if (folder / CAMPAIGN_FILE).is_file():
                return folder
    return None


def campaign_limit_table(folder: str | Path, conditions: Conditions) -> CampaignLimitTable:
    """The table of the folder that campaign.toml names, else the standard's: its limits could be higher.

    Parameters
    ----------
    folder : str or Path
        The campaign's folder; a file outside it is not read.
    conditions : Conditions
        Of the campaign.

    Raises
    ------
    CampaignFileError
        The file that is named is none of the folder, or cannot be used.
    """
    standard, name = standard_limit_table(), conditions.limit_table
    if not name.lower().endswith(".csv"):  # a name in words
        return CampaignLimitTable(standard, "")
    root, inside = Path(folder).resolve(), False
    with contextlib.suppress(OSError, ValueError):  # a name that no file can have
        file = (root / name).resolve()
        inside = file.is_relative_to(root) and file.is_file()
    stated, column = str(Path(folder, CAMPAIGN_FILE)), "standard.limit_table"
    if not inside:
        message = f"found {name[:200]!r}, which is no file of this folder; put it there, or name it with --limit-table"
        raise CampaignFileError(message, file=stated, column=column)
    try:
        return CampaignLimitTable(read_limit_table(file), file.relative_to(root).as_posix())
    except ForcemapError as error:
        raise CampaignFileError(f"the table cannot be used: {error_words(error)}", file=stated, column=column) from None


def files_of(folder: str | Path, digests: Collection[str]) -> list[str]:
    """CSV files below the folder with one of these SHA-256, such as tables of limits; inputs of all campaigns apart."""
    root = Path(folder)
    files = sorted(path for path in root.rglob("*") if path.suffix.lower() == ".csv") if digests else []
    named = {path.relative_to(root).as_posix(): path for path in files if path.is_file()}
    return [name for name, path in named.items() if not is_standard_input(name) and _sha256(path) in digests]


def stated_findings(conditions: Conditions, limits: Sequence[ForceLimit]) -> list[Finding]:
    """What the stated conditions contradict, or leave open, that all results depend on."""
    findings = [doubt for limit in limits for doubt in limit.doubts]
    for limit in limits:
        suits = device_suitability(limit.name, limit.stiffness, conditions.device.stiffness)
        if limit.permitted and suits.refusal:
            findings.append(Finding.of(FindingKind.NO_SPEED_FOR_AREA, suits.refusal, area=limit.name))
    if math.isnan(conditions.device.range):
        findings.append(Finding.of(FindingKind.SATURATION_UNSEEN))
    editions = list(dict.fromkeys(limit.edition for limit in limits))
    stated = conditions.standard_edition
    if stated and any(stated.split(",")[0].strip() not in edition for edition in editions):
        findings.append(Finding.of(FindingKind.OTHER_EDITION, stated=stated, editions=", ".join(editions)))
    return findings


def file_findings(campaign: Campaign, reader: Reader) -> list[Finding]:
    """What differs between recordings, register and impacts table.

    The table is rebuilt from the recordings and compared; nothing is written. The reader must have judged them itself,
    whatever the folder remembers.
    """
    try:
        there, of_points = set(campaign.files()), unregistered(campaign.folder)
    except ForcemapError as error:
        return [Finding.of(FindingKind.RECORDINGS_UNREADABLE, error=error.message)]
    if not there and not campaign.entries:
        return [Finding.of(FindingKind.RECORDINGS_NONE)]
    registered = {entry.file: None for entry in campaign.entries if entry.sha256}
    differing = {
        FindingKind.RECORDINGS_CHANGED: _changed(campaign.recordings, campaign.entries),
        FindingKind.RECORDINGS_GONE: [file for file in registered if file not in there],
        FindingKind.RECORDINGS_NEW: sorted(there - {entry.file for entry in campaign.entries}),
        FindingKind.POINTS_NEW: of_points,
    }
    findings = [Finding.of(kind, files=tuple(files)) for kind, files in differing.items() if files]
    if any(files for kind, files in differing.items() if kind is not FindingKind.POINTS_NEW):
        return findings
    return [*findings, *_table_findings(campaign, reader)]


def _changed(recordings: Path, entries: Iterable[Entry]) -> list[str]:
    """Files of recordings whose content is another one than was registered."""
    digests = {entry.file: entry.sha256 for entry in entries if entry.sha256 and (recordings / entry.file).is_file()}
    return [file for file, digest in digests.items() if file_sha256(recordings / file) != digest]


def _gone(folder: Path) -> tuple[str, ...]:
    """Registered recordings whose files are not there any more, whatever their names are now."""
    try:
        entries = read_register(folder / REGISTER_FILE)
    except ForcemapError:  # said by the binding
        return ()
    missing = [e for e in entries if e.sha256 and not (folder / RECORDINGS_FOLDER / e.file).is_file()]
    if not missing:
        return ()
    known = {entry.file for entry in entries}
    there = (path for path in (folder / RECORDINGS_FOLDER).rglob("*") if path.is_file())
    new = {file_sha256(path) for path in there if path.relative_to(folder / RECORDINGS_FOLDER).as_posix() not in known}
    return tuple(dict.fromkeys(entry.file for entry in missing if entry.sha256 not in new))


def withheld_by(findings: Iterable[Finding], dataset: ImpactDataset) -> ImpactDataset:
    """The impacts of a folder, which give no speed where a recording beside them is another one, or one at a contact
    point was held against no map."""
    kinds = (FindingKind.RECORDINGS_CHANGED, FindingKind.RECORDINGS_UNREADABLE, FindingKind.POINTS_NEW)
    withheld = next((each for each in findings if each.kind in kinds), None)
    if withheld is None or dataset.binding.refusal:
        return dataset
    return replace(dataset, binding=Binding(BindingState.BROKEN, withheld))


def read_recorded(source: str | Path) -> ImpactDataset:
    """The impacts of a folder or table, as `as_recorded` has them."""
    return as_recorded(read_dataset(source), source)


def beside(source: str | Path) -> Path:
    """The folder whose recordings gave a table: the source itself, or that of its impacts table."""
    path = Path(source)
    return path.parent if path.name == TABLE_FILE else path


def as_recorded(dataset: ImpactDataset, source: str | Path) -> ImpactDataset:
    """The impacts of a folder whose files are looked at, as `withheld_by` has them; no recording is judged.

    Those of a table that has no register beside it stay as they are.
    """
    folder = beside(source)
    if not (folder / REGISTER_FILE).exists():
        return dataset

    def changed() -> list[str]:
        return _changed(folder / RECORDINGS_FOLDER, read_register(folder / REGISTER_FILE))

    def at_points() -> list[str]:
        return list(unregistered(folder))

    if dataset.binding.state is BindingState.BOUND and (gone := _gone(folder)):
        reason = Finding.of(FindingKind.RECORDINGS_GONE, files=gone)
        before = dataset.binding.reason
        dataset = replace(dataset, binding=Binding(BindingState.BOUND, before.and_(reason) if before else reason))
    findings = []
    for kind, look in ((FindingKind.RECORDINGS_CHANGED, changed), (FindingKind.POINTS_NEW, at_points)):
        try:  # one that fails must not hide what the other finds
            findings += [Finding.of(kind, files=tuple(files))] if (files := look()) else []
        except ForcemapError as error:
            findings.append(Finding.of(FindingKind.RECORDINGS_UNREADABLE, error=error.message))
    return withheld_by(findings, dataset)


def _table_findings(campaign: Campaign, reader: Reader) -> list[Finding]:
    if not campaign.table_file.exists():
        return [Finding.of(FindingKind.TABLE_MISSING, table=TABLE_FILE)]
    try:
        text = table_text(campaign, *collected(campaign, reader=reader))
    except ForcemapError as error:
        return [Finding.of(FindingKind.TABLE_UNOBTAINABLE, table=TABLE_FILE, error=error.message)]
    stored, rebuilt = read_bytes(campaign.table_file).splitlines(), text.encode().splitlines()
    if stored == rebuilt:
        return []
    for row, (stored_row, rebuilt_row) in enumerate(zip(stored, rebuilt, strict=False), start=1):
        if stored_row != rebuilt_row:
            flags = len(stored) == len(rebuilt) and _without_flags(stored) == _without_flags(rebuilt)
            return [Finding.of(FindingKind.TABLE_ROW_DIFFERS, table=TABLE_FILE, row=row, figures=not flags)]
    figures = {"impacts": len(stored) - 1, "given": len(rebuilt) - 1}
    return [Finding.of(FindingKind.TABLE_LENGTH_DIFFERS, table=TABLE_FILE, **figures)]


def _without_flags(lines: Sequence[bytes]) -> list[list[str]]:
    """The cells of an impacts table but those of its flags."""
    head, *rows = csv.reader(line.decode(errors="replace") for line in lines)
    kept = [i for i, name in enumerate(head) if name != "flags"]
    return [[name for name in head if name != "flags"], *([row[i] for i in kept if i < len(row)] for row in rows)]
