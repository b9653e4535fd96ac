"""Recordings that were made at contact points alone, the files in `points/`, and the register that binds them.

For every file `point_recordings.csv` holds its hash, the conditions under which it was first registered, how it was
read, and what it gave: as the register of the campaign's own recordings does.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path, PurePosixPath

from forcemap.campaigns.binding import as_known, changed_conditions
from forcemap.campaigns.campaign import files_below
from forcemap.campaigns.conditions import CAMPAIGN_FILE, Conditions, read_campaign_file
from forcemap.campaigns.point_list import POINT_REGISTER, POINTS_FOLDER
from forcemap.campaigns.pressures import (
    PRESSURES_FOLDER,
    Films,
    film_of,
    films_in,
    measured_pressure,
    require_different,
)
from forcemap.campaigns.recorded_impacts import RecordedImpacts, recorded_impacts
from forcemap.campaigns.recordings_table import (
    FIRST_READ,
    MEASURED_ON,
    PEAK_PRESSURE,
    PRESSURE_FROM,
    READ_WITH,
    Entry,
    Use,
    read_register,
    register_text,
    row_sha256,
)
from forcemap.errors import CampaignFileError, ForcemapError
from forcemap.files import alone, file_sha256, read_bytes, write_atomically
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.impacts.quality import DOUBTFUL
from forcemap.recordings.column_map import ColumnMap

POINT_FILMS = f"{PRESSURES_FOLDER}/{POINTS_FOLDER}"
"""Folder of the films of these recordings, each of the name of its recording, with any ending."""


@dataclass(frozen=True, eq=False)
class PointRecording:
    """A file in points/ as it is now.

    Parameters
    ----------
    name : str
        Its name with the folder.
    entry : Entry or None
        As registered; None if it is not.
    sha256 : str
        Of the file; empty if it is gone.
    recorded : tuple of RecordedImpacts
        The recordings in it; none if it is gone or cannot be read.
    doubt : Finding or None
        Why it does not show that a limit was kept; None if it may.
    """

    name: str
    entry: Entry | None
    sha256: str
    recorded: tuple[RecordedImpacts, ...] = ()
    doubt: Finding | None = None

    @property
    def shown(self) -> tuple[tuple[Entry, bool], ...]:
        """Of each recording its row with the largest forces of all its impacts, and whether these are all that acted.

        Not so if it has a doubt, a quality flag of a peak that is not known, no impact, or was not used.
        """
        if self.entry is None:
            return ()
        return tuple((_with_forces(self.entry, each), self._whole(self.entry, each)) for each in self.recorded)

    def _whole(self, entry: Entry, recorded: RecordedImpacts) -> bool:
        doubtful = any(flag.name in DOUBTFUL for impact in recorded.impacts for flag in impact.flags)
        return entry.use is Use.USED and not (self.doubt or recorded.doubt or doubtful)

    @property
    def excluded(self) -> str:
        """Why a person excluded it, as it was collected; empty if nobody did."""
        return self.entry.exclude if self.entry and self.sha256 == self.entry.sha256 else ""


def _with_forces(entry: Entry, recorded: RecordedImpacts) -> Entry:
    impacts = recorded.impacts
    return replace(
        entry,
        curve=recorded.recording.curve,
        flags="; ".join(dict.fromkeys(str(flag) for impact in impacts for flag in impact.flags)),
        peak_force=_largest(impact.peak_force for impact in impacts),
        raw_peak_force=_largest(impact.raw_peak_force for impact in impacts),
        phase2_force=_largest(impact.phase2_force for impact in impacts),
    )


def _largest(forces: Iterable[float]) -> float:
    """The largest force that is known [N]; NaN if none is."""
    return max((force for force in forces if force == force), default=math.nan)


def point_files(folder: Path) -> dict[str, Path]:
    """The files in points/ by their names with the folder, sorted; hidden ones are left alone.

    Raises
    ------
    CampaignFileError
        A link to a folder, or to nothing, or a folder that may not be read.
    """
    root = folder / POINTS_FOLDER
    if root.is_symlink():
        raise CampaignFileError("found a link, expected the folder of the recordings itself", file=str(root))
    names = (f"{POINTS_FOLDER}/{name}" for name in files_below(root)) if root.is_dir() else ()
    return {name: folder / name for name in sorted(names)}


def registered_points(folder: Path) -> Sequence[Entry]:
    """The register of the files in points/; empty without one.

    Raises
    ------
    TableError
        The register cannot be used.
    """
    register = folder / POINT_REGISTER
    return read_register(register) if register.exists() else ()


def register_points(folder: Path, conditions: Conditions, columns: ColumnMap | None, *, enter: bool = False) -> None:
    """Register the files in points/ that are new, and seal what a person excluded; nothing if there are none.

    A registered file that gave no impact may be replaced. With `enter`, what is stated since of how the robot hit is
    entered with those that are there.

    Raises
    ------
    TableError
        The register cannot be used.
    CampaignFileError
        A film that belongs to none of them, or to several, is a copy, or cannot be used.
    """
    register, files = folder / POINT_REGISTER, point_files(folder)
    known = {entry.file: entry for entry in registered_points(folder)}
    films = films_in(folder / POINT_FILMS)
    _require_known_films(films, [*files, *known])
    if not files and not known:
        return
    for name, path in files.items():
        then, digest = known.get(name), file_sha256(path)
        if then is None or then.blank:
            known[name] = _registered(films, name, path, digest, conditions, columns)
        elif then.sha256 == digest:  # of conditions whose cell a person emptied, what is stated now
            if then.row_sha256 != row_sha256(then):  # a person's reason stands; figures are those of the file
                read = _registered(films, name, path, digest, conditions, columns)
                then = replace(read, exclude=then.exclude, conditions=then.conditions)
            now = as_known(then.conditions, conditions.measured_under(name), entered=enter)
            now |= _film(films, name, conditions)  # a film may be added later
            known[name] = replace(then, conditions=now | dict(then.conditions))
    require_different(_films_of(films, known.values()), conditions.film)
    text = register_text(known.values())
    with alone(folder):
        if not register.exists() or read_bytes(register) != text.encode():
            write_atomically(register, text)


def _require_known_films(films: Films, names: Iterable[str]) -> None:
    """Refuse a film that would silently count for nothing, or for several recordings."""
    stems = Counter(PurePosixPath(name).stem for name in dict.fromkeys(names))
    for stem in sorted(films):
        if stems[stem] != 1:
            expected = f"expected that of one file in {POINTS_FOLDER}/; rename it or move it away"
            raise CampaignFileError(f"found the name {stem!r}, {expected}", file=str(films[stem][0]))


def _stated(name: str, conditions: Conditions) -> dict[str, str]:
    dated = {MEASURED_ON: conditions.date} if conditions.date else {}
    return conditions.measured_under(name) | dated


def _registered(
    films: Films, name: str, path: Path, digest: str, conditions: Conditions, columns: ColumnMap | None
) -> Entry:
    try:
        read = tuple(recorded_impacts(path, conditions, columns, name=name))
    except ForcemapError as error:
        return Entry(file=name, sha256=digest, use=Use.UNREADABLE, reason=error.message)
    impacts = [impact for each in read for impact in each.impacts]
    entry = Entry(file=name, sha256=digest, size=path.stat().st_size, use=Use.USED if impacts else Use.DISCARDED)
    if impacts:
        peak, held = (_largest(getattr(each, name) for each in impacts) for name in ("peak_force", "phase2_force"))
        entry = replace(entry, scenario=impacts[0].scenario, peak_force=peak, phase2_force=held)
    else:
        entry = replace(entry, reason="no impact found")
    basis = _basis(films, name, conditions, columns, read)
    return replace(entry, conditions=_stated(name, conditions) | basis)


def _basis(
    films: Films, name: str, conditions: Conditions, columns: ColumnMap | None, read: Sequence[RecordedImpacts]
) -> dict[str, str]:
    """How a file is read and what that gives, and its film."""
    options = [(option, str(getattr(columns, option.name))) for option in (fields(columns) if columns else ())]
    words = ", ".join(f"{option.name} = {text}" for option, text in options if text != str(option.default))
    forces = ", ".join(f"{impact.raw_peak_force:.2f} N" for each in read for impact in each.impacts)
    return {READ_WITH: words or "no entries", FIRST_READ: forces or "no impact", **_film(films, name, conditions)}


def _film(films: Films, name: str, conditions: Conditions) -> dict[str, str]:
    """The film of a file and what it gives; empty without one."""
    film = measured_pressure(films, conditions.film, Entry(file=name))
    if film is None:
        return {}
    pressure = f"{film.pressure:.2f}"
    return {PRESSURE_FROM: f"{film.file} {film.sha256[:16]}: {pressure} N/cm^2", PEAK_PRESSURE: pressure}


def films_at_points(folder: Path) -> Iterator[tuple[Path, str]]:
    """The films of the registered files in points/ that are there, and the pressure that each gave."""
    if films := films_in(folder / POINT_FILMS):
        yield from _films_of(films, registered_points(folder))


def _films_of(films: Films, entries: Iterable[Entry]) -> Iterator[tuple[Path, str]]:
    for entry in entries:
        file, pressure = film_of(films, entry), entry.conditions.get(PEAK_PRESSURE, "")
        if file and pressure:
            yield file, pressure


def point_recordings(folder: Path, wanted: Sequence[str] | None = None) -> Iterator[PointRecording]:
    """The files in points/ beside their register, those that are gone, too; nothing is written.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    wanted : sequence of str, optional
        Names of the files to read; all if not given.

    Raises
    ------
    TableError
        The register cannot be used.
    CampaignFileError
        campaign.toml cannot be used.
    """
    files, stated = point_files(folder), folder / CAMPAIGN_FILE
    known = {entry.file: entry for entry in registered_points(folder)}
    conditions, columns = read_campaign_file(stated) if stated.exists() else (Conditions(), None)
    films = films_in(folder / POINT_FILMS)
    for name in sorted({*files, *known}):
        if wanted is not None and name not in wanted:
            continue
        entry = known.get(name)
        if name not in files:
            yield PointRecording(name, entry, "", doubt=Finding.of(FindingKind.FILE_GONE))
            continue
        digest = file_sha256(files[name])
        try:
            read = tuple(recorded_impacts(files[name], conditions, columns, name=name))
        except ForcemapError as error:
            words = error.message if error.row is None else f"row {error.row}, {error.message}"
            yield PointRecording(name, entry, digest, doubt=in_words(words))
            continue
        doubt = _doubt(films, entry, digest, conditions, columns, read)
        yield PointRecording(name, entry, digest, read, doubt)


def point_names(folder: Path) -> list[str]:
    """Names of the files in points/ and of those that were registered, sorted; errors as `point_recordings`."""
    known = [entry.file for entry in registered_points(folder)]
    return sorted({*point_files(folder), *known})


def unregistered(folder: Path) -> list[str]:
    """Names of the files in points/ that `collect` has not registered yet; errors as `read_register`."""
    known = {entry.file for entry in registered_points(folder)}
    return [name for name in point_files(folder) if name not in known]


def _doubt(
    films: Films,
    entry: Entry | None,
    digest: str,
    conditions: Conditions,
    columns: ColumnMap | None,
    read: Sequence[RecordedImpacts],
) -> Finding | None:
    """What differs from when a file was registered; None if nothing does."""
    if entry is None:
        return Finding.of(FindingKind.POINT_NOT_COLLECTED)
    if entry.row_sha256 != row_sha256(entry):
        return Finding.of(FindingKind.REGISTER_EDITED, all=(entry.file,), register=POINT_REGISTER)
    if entry.sha256 != digest:
        return Finding.of(FindingKind.FILE_CHANGED)
    if changed := changed_conditions([entry], conditions):
        return Finding.of(changed.kind, **dict(changed.figures), register=POINT_REGISTER)
    try:
        now = _basis(films, entry.file, conditions, columns, read)
    except ForcemapError as error:
        return in_words(error.message)
    was, words = dict(entry.conditions), []
    if PRESSURE_FROM in now and PRESSURE_FROM not in was:
        return Finding.of(FindingKind.POINT_FILM_NOT_COLLECTED, film=now[PRESSURE_FROM].partition(" ")[0])
    if was.get(READ_WITH, now[READ_WITH]) != now[READ_WITH] and was.get(FIRST_READ) != now[FIRST_READ]:
        words.append(
            f"{READ_WITH} was {was[READ_WITH]!r} and gave {was.get(FIRST_READ)}, [recordings] of {CAMPAIGN_FILE} now "
            f"{now[READ_WITH]!r} gives {now[FIRST_READ]}"
        )
    if was.get(PRESSURE_FROM, now.get(PRESSURE_FROM)) != now.get(PRESSURE_FROM):
        words.append(f"{PRESSURE_FROM} was {was[PRESSURE_FROM]!r}, now it is {now.get(PRESSURE_FROM, 'none')!r}")
    if not words:
        return None
    changed_words = "; ".join(words)
    return Finding.of(FindingKind.RECORDING_CHANGED, all=(entry.file,), changed=changed_words, register=POINT_REGISTER)
