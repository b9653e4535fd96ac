"""The pressures of a campaign's impacts: exports of a film or array, a file for each run that has one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.point_list import POINTS_FOLDER
from forcemap.campaigns.recordings_table import Entry
from forcemap.csv_table import csv_cell
from forcemap.errors import CampaignFileError, InputError
from forcemap.files import read_bytes, sha256
from forcemap.recordings.film import Film
from forcemap.recordings.pressure_matrix import AT_RANGE, read_pressure_matrix

PRESSURES_FOLDER = "pressures"
"""Folder of a campaign; its files bear the names of the runs, or of their recordings, with any ending."""

Films = Mapping[str, Sequence[Path]]
"""The files of a folder of films, by the names that they bear without their endings."""

_LEAST_SHARE, _FORCE_ERROR = 0.5, 0.10
"""Share of the peak force that a film shows at least, however large its error is stated, and by which share more than
its error it may lie below the force. A choice: psi stated for N/cm^2, a pitch of 0.85 mm for 1 mm, or a film beside the
contact takes more."""

_FEWEST_CELLS, _SAME_CELL = 24, 0.5
"""Cells with a pressure from which on two films that agree in all of them, to half an N/cm^2, are one. A choice: a film
shows hundreds, and none alike twice."""


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

    def too_little_for(self, force: float, film: Film) -> bool:
        """True if all of the film shows less than the peak force [N] that went through it, by more than its error."""
        return self.most_force < least_force_share(film) * force


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
    file = film_of(films, entry)
    if file is None:
        return None
    measured = usable_film(file, campaign.conditions.film, entry.peak_force)
    pressure, above = f"{measured.pressure:.2f}", measured.above_range
    cells = {"peak_pressure_N_per_cm2": pressure, "pressure_censored": csv_cell(above)}
    return FilmReading(cells, f"{measured.file} {measured.sha256[:16]}: {'at least ' * above}{pressure} N/cm^2")


def least_force_share(film: Film) -> float:
    """Share of a peak force that a film whose unit and pitch are right shows at least.

    Its cells with their largest pressures, whenever each had it, carry at least that force, less the film's error, a
    share of the reading: 1 / (1 + error) less `_FORCE_ERROR`; `_LEAST_SHARE`, however large that is stated.
    """
    return max(_LEAST_SHARE, 1 / (1 + film.error_or_default) - _FORCE_ERROR)


def usable_film(file: Path, film: Film, force: float) -> MeasuredPressure:
    """The pressure of a film that is to count, beside the peak force [N] that went through it; NaN if not known.

    Raises
    ------
    CampaignFileError
        Its range or averaging is not stated; it shows less than the force, by more than its error.
    RecordingError
        It cannot be used.
    """
    if math.isnan(film.range):
        message = "the film's range is not stated, so that a saturated film would pass for a good one"
        expected = "state pressure.range_N_per_cm2 in campaign.toml"
        raise CampaignFileError(f"{message}; {expected}", file=str(file))
    measured = _measured(file, film)
    if measured.too_little_for(force, film):
        found = f"found {measured.most_force:.1f} N on all of the film, {force:.1f} N on the device, expected "
        found += f"{100 * least_force_share(film):.0f} % of that at least, by the film's error of "
        found += f"{100 * film.error_or_default:g} %"
        remedy = "its unit or pitch is mistaken, or it does not cover the contact; state them, or move the file away"
        raise CampaignFileError(f"{found}: {remedy}", file=str(file))
    return measured


def require_different(shown: Iterable[tuple[Path, str]], film: Film) -> None:
    """Refuse a film that shows what another one does: a copy is no measurement of a further impact.

    Compared are the pressures of all cells between nothing and the range, whatever frame or side they are seen from.

    Parameters
    ----------
    shown : iterable of (Path, str)
        Files, and the pressure that each gave as the tables have it: only those with the same are compared.
    film : Film

    Raises
    ------
    CampaignFileError
        Two files show the same in at least `_FEWEST_CELLS` cells with a pressure.
    """
    alike: dict[str, list[Path]] = {}
    for file, pressure in shown:
        alike.setdefault(pressure, []).append(file)
    for files in alike.values():
        cells = [(file, _pressed_cells(file, film)) for file in files] if len(files) > 1 else []
        for (one, of_one), (other, of_other) in itertools.combinations(cells, 2):
            if len(of_one) == len(of_other) >= _FEWEST_CELLS and np.abs(of_one - of_other).max() <= _SAME_CELL:
                expected = "a copy is no measurement; put the film of its own impact there, or take it away"
                raise CampaignFileError(f"found the same pressures as in {one}: {expected}", file=str(other))


def _pressed_cells(file: Path, film: Film) -> FloatArray:
    """The pressures of the cells that show one, below the range, in order [N/cm^2]."""
    pressure = read_pressure_matrix(file, film).pressure
    shown = (pressure > 0) & ~(pressure >= AT_RANGE * film.range)
    return np.sort(pressure[shown])


def measured_pressure(films: Films, film: Film, entry: Entry) -> MeasuredPressure | None:
    """The pressure of a recording; None if no file bears its name or that of its run.

    Raises
    ------
    CampaignFileError
        Two files bear its name, or the averaging is not stated.
    RecordingError
        The file cannot be used.
    """
    file = film_of(films, entry)
    return None if file is None else _measured(file, film)


def film_of(films: Films, entry: Entry) -> Path | None:
    """The file that bears the name of a recording or its run; None without one. Errors as `measured_pressure`."""
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
