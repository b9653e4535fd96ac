"""The pressures of a campaign's impacts: exports of a film or array, a file for each run that has one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.point_list import POINTS_FOLDER
from forcemap.campaigns.recordings_table import Entry
from forcemap.csv_table import csv_cell
from forcemap.errors import CampaignFileError, InputError
from forcemap.files import read_bytes, sha256
from forcemap.recordings.film import Film
from forcemap.recordings.pressure_matrix import read_pressure_matrix

PRESSURES_FOLDER = "pressures"
"""Folder of a campaign; its files bear the names of the runs, or of their recordings, with any ending."""

Films = Mapping[str, Sequence[Path]]
"""The files of a folder of films, by the names that they bear without their endings."""

_LEAST_SHARE = 0.5
"""Share of the peak force that all cells together, each with its largest pressure, have to show at least. A choice: a
film of 10 to 15 % error shows more; one with a mistaken unit or pitch, or beside the contact, less."""


@dataclass(frozen=True)
class MeasuredPressure:
    """The largest pressure of a recording, by a film or array.

    Parameters
    ----------
    pressure : float
        By the film's averaging [N/cm^2]; a lower bound if `above_range`.
    above_range : bool
        True if a cell reached the range.
    file : str
        Name of the file.
    sha256 : str
        Of the file.
    most_force : float
        The largest force that its cells can have carried [N]; infinite if one reached the range.
    """

    pressure: float
    above_range: bool
    file: str
    sha256: str
    most_force: float = math.inf

    def too_little_for(self, force: float) -> bool:
        """True if all of the film together shows far less than a peak force [N] that went through it."""
        return self.most_force < _LEAST_SHARE * force


@dataclass(frozen=True)
class FilmReading:
    """What a film or array gave of an impact.

    Parameters
    ----------
    cells : dict of str to str
        Its cells in the impacts table.
    origin : str
        The file, its hash and what it gave.
    """

    cells: dict[str, str]
    origin: str


def films_in(folder: Path) -> Films:
    """The films of a folder, listed once for all recordings of a walk; hidden files are left alone.

    Raises
    ------
    CampaignFileError
        A link, whose file no list of inputs has, or a folder, whose films would silently count for nothing.
    """
    films: dict[str, list[Path]] = {}
    if folder.is_symlink():
        raise CampaignFileError("found a link, expected the folder of the films itself", file=str(folder))
    for file in sorted(folder.iterdir()) if folder.is_dir() else ():
        if file.name.startswith("."):
            continue
        if file.is_symlink():
            raise CampaignFileError("found a link, expected the film itself; put the file here", file=str(file))
        if file.is_file():
            films.setdefault(file.stem, []).append(file)
        elif folder.name != PRESSURES_FOLDER or file.name != POINTS_FOLDER:
            expected = (
                f"expected films, and {POINTS_FOLDER}/ with those of contact points; put its films beside the others"
            )
            raise CampaignFileError(f"found a folder, {expected}", file=str(file))
    return films


def require_known(films: Films, entries: Iterable[Entry]) -> None:
    """Refuse a file of a pressure that bears the name of no run and no recording: it would silently count for nothing.

    Raises
    ------
    CampaignFileError
        There is such a file.
    """
    names = {name for entry in entries for name in _names(entry)} if films else set()
    for name in sorted(films.keys() - names):
        expected = "expected that of a run or recording, such as d890-h140-v100-r1.csv; rename it or move it away"
        raise CampaignFileError(f"found the name {name!r}, {expected}", file=str(films[name][0]))


def _names(entry: Entry) -> set[str]:
    """Names that a file of its pressure may bear; of a file with several recordings only that of the run."""
    of_run = [f"{entry.state_id}-r{entry.repeat}"] if entry.state_id else []
    return {*of_run, *([] if entry.curve else [PurePosixPath(entry.file).stem])}


def film_reading(films: Films, campaign: Campaign, entry: Entry) -> FilmReading | None:
    """The cells of a recording that is used; None if no file bears its name. Errors as `usable_film`."""
    file = _film_of(films, entry)
    if file is None:
        return None
    measured = usable_film(file, campaign.conditions.film, entry.peak_force)
    pressure, above = f"{measured.pressure:.2f}", measured.above_range
    cells = {"peak_pressure_N_per_cm2": pressure, "pressure_censored": csv_cell(above)}
    return FilmReading(cells, f"{measured.file} {measured.sha256[:16]}: {'at least ' * above}{pressure} N/cm^2")


def usable_film(file: Path, film: Film, force: float) -> MeasuredPressure:
    """The pressure of a film that is to count, beside the peak force [N] that went through it; NaN if not known.

    Raises
    ------
    CampaignFileError
        Its range or averaging is not stated; it shows far less than the force.
    RecordingError
        It cannot be used.
    """
    if math.isnan(film.range):
        message = "the film's range is not stated, so that a saturated film would pass for a good one"
        expected = "state pressure.range_N_per_cm2 in campaign.toml"
        raise CampaignFileError(f"{message}; {expected}", file=str(file))
    measured = _measured(file, film)
    if measured.too_little_for(force):
        found = f"found {measured.most_force:.1f} N on all of the film, {force:.1f} N on the device"
        remedy = "its unit or pitch is mistaken, or it does not cover the contact; state them, or move the file away"
        raise CampaignFileError(f"{found}: {remedy}", file=str(file))
    return measured


def measured_pressure(films: Films, film: Film, entry: Entry) -> MeasuredPressure | None:
    """The pressure of a recording; None if no file bears its name or that of its run.

    Raises
    ------
    CampaignFileError
        Two files bear its name, or the averaging is not stated.
    RecordingError
        The file cannot be used.
    """
    file = _film_of(films, entry)
    return None if file is None else _measured(file, film)


def _film_of(films: Films, entry: Entry) -> Path | None:
    files = sorted(file for name in _names(entry) for file in films.get(name, ())) if films else []
    if len(files) > 1:
        found = " and ".join(file.name for file in files)
        raise CampaignFileError(f"found {found} for one run, expected one file", file=str(files[0].parent))
    return files[0] if files else None


def _measured(file: Path, film: Film) -> MeasuredPressure:
    matrix = read_pressure_matrix(file, film)
    try:
        pressure, above = matrix.peak(film)
    except InputError as error:
        raise CampaignFileError(error.message, file=str(file)) from None
    most = math.inf if above else matrix.most_force(film)
    return MeasuredPressure(pressure, above, file.name, sha256(read_bytes(file)), most)
