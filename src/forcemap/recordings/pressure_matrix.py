"""The export of a pressure film or an array of cells: a matrix of pressures, and the one figure made of it."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError, RecordingError
from forcemap.files import read_bytes
from forcemap.recordings.cells import find_delimiter, is_number, split_cells
from forcemap.recordings.film import LARGEST_AREA, Film
from forcemap.recordings.text import lines_of, text_of

UNITS = {"N/cm2": 1.0, "N/mm2": 100.0, "Pa": 1e-4, "hPa": 0.01, "kPa": 0.1, "MPa": 100.0, "bar": 10.0, "psi": 0.6894757}
"""N/cm^2 in the units in which films and arrays write."""

LARGEST_PITCH = 0.02
"""Largest distance between cells [m]; a larger one is a slip of the unit."""

_LEAST, _MOST = 2, 4_000_000  # cells along each side, and in all
_SPELLINGS = {unit.lower(): unit for unit in UNITS}
_UNIT = re.compile(r"(?i)\b(n/cm\^?[2²]|n/mm\^?[2²]|[hkm]?pa|bar|psi)(?![a-z])")
_PITCH = re.compile(r"(?i)\b(?:pitch|spacing|cell|raster|resolution)\b[^0-9\n]*([0-9]+(?:[.,][0-9]+)?)\s*(mm|um|µm)\b")
_LENGTHS = {"mm": 1e-3, "um": 1e-6, "µm": 1e-6}
AT_RANGE = 0.98  # share of the range from which a cell counts as saturated: exports round, films end softly; a choice
_EVEN = 1e-6  # share by which steps of an evenly rising row may differ: such a row holds positions


@dataclass(frozen=True, eq=False)
class PressureMatrix:
    """Largest pressures of an impact, cell by cell.

    Parameters
    ----------
    pressure : array, shape (rows, columns)
        Pressure of each cell [N/cm^2].
    pitch : float
        Distance between cells, along both axes [m].
    source : str
        The file.
    """

    pressure: FloatArray
    pitch: float
    source: str = ""

    def peak(self, film: Film) -> tuple[float, bool]:
        """The one figure of the impact [N/cm^2], and whether it is a lower bound because a cell reached the range.

        Cells below what the film shows count as that much. By `film.mean_over` it is the largest mean over any square
        of no more than that area, of whole cells; or the largest cell.

        Raises
        ------
        InputError
            The averaging is not stated, or a cell is larger than the area.
        """
        if math.isnan(film.mean_over):
            expected = "0 for the largest cell, or an area of at most 1 cm^2"
            raise InputError(f"averaging: found none; state pressure.mean_over_cm2 in campaign.toml: {expected}")
        cells = np.maximum(self.pressure, np.nan_to_num(film.least))
        above = bool(np.any(self.pressure >= AT_RANGE * film.range))
        beyond = int(math.sqrt(film.mean_over) / (100 * self.pitch))  # what was cut off may show as much as is not seen
        cells = np.pad(cells, beyond, constant_values=float(np.nan_to_num(film.least)))
        return largest_mean(cells, self.pitch, film.mean_over), above

    def most_force(self, film: Film) -> float:
        """The largest force that the cells can have carried at one time [N]: each with its largest pressure.

        Cells below what the film shows count as that much.
        """
        cells = np.maximum(self.pressure, np.nan_to_num(film.least))
        return float(cells.sum() * (100 * self.pitch) ** 2)


def largest_mean(pressure: FloatArray, pitch: float, area: float) -> float:
    """The largest mean pressure over any square of whole cells no larger than an area.

    Parameters
    ----------
    pressure : array, shape (rows, columns)
        Pressure of each cell [N/cm^2].
    pitch : float
        Distance between cells [m].
    area : float
        The area [cm^2], at most 1; 0 for the largest cell.

    Raises
    ------
    InputError
        An area outside its range, or smaller than a cell.

    Examples
    --------
    >>> import numpy as np
    >>> largest_mean(np.array([[0.0, 8.0, 4.0], [0.0, 4.0, 0.0], [0.0, 0.0, 0.0]]), pitch=0.005, area=1.0)
    4.0
    """
    if not 0 <= area <= LARGEST_AREA:
        raise InputError(f"averaging: found {area:g} cm^2, expected 0 (the largest cell) to {LARGEST_AREA:g} cm^2")
    if area == 0:
        return float(pressure.max())
    cells = int(math.sqrt(area) / 100 / pitch * (1 + 1e-9))
    if cells < 1:
        cell = (100 * pitch) ** 2
        raise InputError(f"averaging: found {area:g} cm^2, expected at least the {cell:.3g} cm^2 of a cell, or 0")
    rows, columns = (min(cells, size) for size in pressure.shape)
    total = np.zeros(np.add(pressure.shape, 1))
    total[1:, 1:] = pressure.cumsum(axis=0).cumsum(axis=1)
    sums = total[rows:, columns:] - total[:-rows, columns:] - total[rows:, :-columns] + total[:-rows, :-columns]
    return float(sums.max() / cells**2)


def read_pressure_matrix(path: str | Path, film: Film | None = None) -> PressureMatrix:
    """Read the matrix of a film or array: text, cells between commas, semicolons, tabs or blanks.

    Lines before the matrix may state its unit and the distance between cells ("pitch: 1.27 mm"); else the film states
    them. Decimal commas are read where semicolons, tabs or blanks separate.

    Parameters
    ----------
    path : str or Path
        The file.
    film : Film, optional
        States the unit and the pitch where the file does not.

    Raises
    ------
    RecordingError
        No text, no matrix; rows of unequal length; a cell that is empty, no number or negative; a first row or column
        of positions; unit or pitch missing, or other than the film's. `row` is the line, `column` the cell's number.
    """
    file, film = str(path), film or Film()
    try:
        lines = [text_of(line) for line in lines_of(read_bytes(path)).split(b"\n")]
        first, cells = _matrix(lines)
        unit, pitch = _unit("\n".join(lines[:first]), film), _pitch("\n".join(lines[:first]), film)
        pressure = UNITS[unit] * _numbers(cells, first)
    except RecordingError as error:
        raise RecordingError(error.message, file=file, row=error.row, column=error.column) from None
    return PressureMatrix(pressure, pitch, Path(path).name)


def _matrix(lines: list[str]) -> tuple[int, list[list[str]]]:
    """Index of the first line of the matrix, and the cells of its lines."""
    while lines and not lines[-1].strip():
        lines.pop()
    body = next((i for i, line in enumerate(lines) if re.match(r"\s*[+-]?[.,]?[0-9]", line)), len(lines))
    if len(lines) - body < _LEAST:
        raise RecordingError(f"found {len(lines) - body} lines of numbers, expected a matrix of {_LEAST} and more")
    delimiter = find_delimiter(lines[body:], None)
    return body, [[cell.strip() for cell in split_cells(line.strip(), delimiter)] for line in lines[body:]]


def _numbers(cells: list[list[str]], first: int) -> FloatArray:
    """The numbers of the cells, shape (rows, columns)."""
    width = len(cells[0])
    if cells[0][-1] == "" and all(len(row) == width and row[-1] == "" for row in cells):  # a delimiter at every end
        cells, width = [row[:-1] for row in cells], width - 1
    if width < _LEAST or width * len(cells) > _MOST:
        raise RecordingError(
            f"found {width} columns, expected {_LEAST} and more, and at most {_MOST} cells", row=first + 1
        )
    signs = {sign for row in cells for cell in row for sign in cell if sign in ".,"}
    if len(signs) > 1:
        raise RecordingError("found decimal points and decimal commas, expected one sign throughout")
    for number, row in enumerate(cells, start=first + 1):
        if len(row) != width:
            raise RecordingError(f"found {len(row)} cells, expected {width} as in the first row", row=number)
        for column, cell in enumerate(row, start=1):
            if not is_number(cell) or cell.startswith("-"):
                expected = "expected a pressure, a number from 0 up"
                raise RecordingError(f"found {cell!r}, {expected}", row=number, column=str(column))
    values = np.array([[float(cell.replace(",", ".")) for cell in row] for row in cells])
    for positions, where in ((values[0], {"row": first + 1}), (values[:, 0], {"column": "1"})):
        steps = np.diff(positions)
        if steps.size > 1 and steps[0] > 0 and np.all(np.abs(steps - steps[0]) <= _EVEN * steps[0]):
            raise RecordingError("found numbers that rise evenly, like positions; take them out", **where)
    return values


def _unit(header: str, film: Film) -> str:
    found = {_SPELLINGS[match.lower().replace("^", "").replace("²", "2")] for match in _UNIT.findall(header)}
    stated = {_SPELLINGS.get(film.unit.lower().replace("^", "").replace("²", "2"), film.unit)} if film.unit else set()
    if len(found | stated) != 1 or not found | stated <= UNITS.keys():
        seen = ", ".join(sorted(found | stated)) or "none"
        raise RecordingError(
            f"found the unit {seen}, expected one of {', '.join(UNITS)} in the file or as pressure.unit"
        )
    return (found | stated).pop()


def _pitch(header: str, film: Film) -> float:
    found = {float(figure.replace(",", ".")) * _LENGTHS[unit.lower()] for figure, unit in _PITCH.findall(header)}
    stated = [*found, *([] if math.isnan(film.pitch) else [film.pitch])]
    if not stated or max(stated) > min(stated) * (1 + _EVEN) or not 0 < stated[0] <= LARGEST_PITCH:
        seen = ", ".join(f"{1000 * pitch:g} mm" for pitch in stated) or "none"
        raise RecordingError(
            f"found {seen} between cells, expected one distance up to {1000 * LARGEST_PITCH:g} mm, in the file "
            "(pitch: 1.27 mm) or as pressure.pitch_m"
        )
    return stated[0]
