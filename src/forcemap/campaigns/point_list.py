"""The list of contact points as a table, and what was measured at them where the campaign's map may cover it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.conditions import Conditions, may_be_alike, nearly_alike
from forcemap.campaigns.phase_two import PhaseTwo
from forcemap.campaigns.quantity import LEAST, Quantity
from forcemap.campaigns.recordings_table import PEAK_PRESSURE, PRESSURE_FROM, Entry, read_register, row_sha256
from forcemap.csv_table import Table, read_table
from forcemap.errors import TableError
from forcemap.files import read_bytes
from forcemap.impacts.scenario import ContactScenario

POINTS_FILE = "contact_points.csv"
"""The list of contact points."""

POINTS_FOLDER = "points"
"""Folder of the recordings that were made at contact points alone, and belong to no plan."""

POINT_REGISTER = "point_recordings.csv"
"""What `forcemap collect` writes of them; a person may state in `exclude` why one does not count."""

NUMBERS = ("distance_m", "distance_to_m", "height_m", "height_to_m", "recorded_at_mps", "programmed_mps")
REQUIRED = ("point_id", "body_area", "contact", "body", "rests_on")
COLUMNS = (
    *("point_id", "hazard", "contact_site", "distance_m", "distance_to_m", "height_m", "height_to_m", "direction"),
    *("body_area", "contact", "body", "rests_on", "recordings", "recorded_at_mps", "programmed_mps"),
    *("photograph", "remark"),
)

SPEED_NOT_STATED = 1e-3
"""In place of a speed that is not stated [m/s]: slower than any that is fitted, so that it speaks against all."""

_STEPS = 7  # places of a zone along either axis: 8 mm apart in one of 50 mm


class AtPoint(NamedTuple):
    """A recording made at a contact point, with the largest force that it shows [N], in a zone [m] at a speed [m/s].

    `pressure` is that of its film [N/cm^2], a lower bound where it was saturated; NaN without one.
    """

    recording: str
    direction: str
    distance: tuple[float, float]
    height: tuple[float, float]
    speed: float
    force: float
    peak: float
    phase2: float
    scenario: ContactScenario | None
    pressure: float = math.nan

    def of(self, quantity: Quantity) -> float:
        """What it shows of a quantity, in its unit; NaN if nothing is known of it."""
        shown = {Quantity.PRESSURE: self.pressure, Quantity.CLAMPING_FORCE: self.phase2}
        return shown.get(quantity, self.force)

    def places(self, measured: FloatArray) -> list[tuple[float, float]]:
        """Places all over the part of its zone that lies in the box around measured ones, shape (m, 2) [m].

        A zone does not say where in it a recording was made. The ends of that part and the measured places in it are
        among them, for these fill a thin strip that even steps may pass over. Of a zone beyond there is one, beyond.
        """
        (low, high), box = np.transpose([self.distance, self.height]), (measured.min(axis=0), measured.max(axis=0))
        even = itertools.product(*(_spread(*axis) for axis in zip(low, high, *box, strict=True)))
        within = measured[((low <= measured) & (measured <= high)).all(axis=1)]
        return list(dict.fromkeys([*even, *map(tuple, within.tolist())]))


def point_table(content: bytes, file: str) -> Table:
    """The rows of a list of contact points.

    Raises
    ------
    TableError
        Not a table; a column that is missing or unknown.
    """
    read = read_table(content, file, what="contact point")
    read.require_columns(REQUIRED, COLUMNS)
    return read.with_decimal_points(NUMBERS)


def measured_at_points(folder: Path, conditions: Conditions) -> tuple[AtPoint, ...]:
    """What the collected files in points/ show at the places that the list states, of the campaign's contact site.

    A row that states no site, or no direction, is taken for the campaign's: what is not stated speaks against a map.
    Those that a person took out, and without a force, are left out.

    Raises
    ------
    TableError
        List or register cannot be used.
    """
    register, listed = folder / POINT_REGISTER, folder / POINTS_FILE
    if not (register.exists() and listed.exists()):
        return ()
    shown = {entry.file: entry for entry in read_register(register) if _force(entry) >= LEAST}
    table = point_table(read_bytes(listed), str(listed))
    numbers = {name: table.numbers(name, required=False) for name in NUMBERS if name in table.columns}
    found: dict[AtPoint, None] = {}
    for i, cells in enumerate(table.texts):
        if not may_be_alike(cells.get("contact_site", ""), "", conditions.contact_site, ""):
            continue
        direction = (conditions.direction and cells.get("direction", "")) or conditions.direction
        row = {name: float(column[i]) for name, column in numbers.items()}
        stated = row.get("recorded_at_mps", math.nan)
        speed = SPEED_NOT_STATED if math.isnan(stated) else float(conditions.at_contact(np.array(stated)))
        named = [name for name in shown if names_file(_patterns(cells), name)]
        zone = [(row.get(f"{axis}_m", math.nan), row.get(f"{axis}_to_m", math.nan)) for axis in ("distance", "height")]
        if any(math.isnan(low) for low, _ in zone):
            continue
        ends = [(min(low, high), max(low, high)) if high == high else (low, low) for low, high in zone]
        for name in named:
            entry = shown[name]
            of_file = (_force(entry), entry.peak_force, entry.phase2_force, entry.scenario, _pressure(entry, register))
            found[AtPoint(name, direction, ends[0], ends[1], speed, *of_file)] = None
    return tuple(found)


def at_other_sites(folder: Path, site: str) -> tuple[tuple[str, int, float], ...]:
    """Contact sites, other than a campaign's, of points with collected files: how many these are, and their highest
    force [N]; errors as `measured_at_points`."""
    register, listed = folder / POINT_REGISTER, folder / POINTS_FILE
    if not (register.exists() and listed.exists()):
        return ()
    shown = {entry.file: _force(entry) for entry in read_register(register) if _force(entry) >= LEAST}
    found: dict[str, dict[str, float]] = {}
    for cells in point_table(read_bytes(listed), str(listed)).texts:
        other = cells.get("contact_site", "")
        if not may_be_alike(other, "", site, ""):
            named = {name: force for name, force in shown.items() if names_file(_patterns(cells), name)}
            found.setdefault(other, {}).update(named)
    return tuple((other, len(files), max(files.values())) for other, files in found.items() if files)


def _placed(cells: Mapping[str, str]) -> bool:
    """Whether a row states a place."""
    return all(cells.get(name, "").strip() for name in ("distance_m", "height_m"))


def left_out_at_points(folder: Path, site: str) -> tuple[list[Entry], tuple[str, ...]]:
    """Collected files in points/ that count for nothing, or may do so by a slip alone.

    A person took them out, no contact point names them, or the points that do have a contact site which is spelt nearly
    as the campaign's is and so counts as another, or are of that site and state no place. With these sites.

    Raises
    ------
    TableError
        List or register cannot be used.
    """
    register, listed = folder / POINT_REGISTER, folder / POINTS_FILE
    if not register.exists():
        return [], ()
    rows = point_table(read_bytes(listed), str(listed)).texts if listed.exists() else []
    slips = [cells for cells in rows if nearly_alike(cells.get("contact_site", ""), site)]
    vague = [
        cells for cells in rows if not _placed(cells) and may_be_alike(cells.get("contact_site", ""), "", site, "")
    ]
    named = [pattern for cells in rows for pattern in _patterns(cells) if cells not in slips and cells not in vague]
    found = [
        entry
        for entry in read_register(register)
        if entry.exclude or (not names_file(named, entry.file) and _force(entry) >= LEAST)
    ]
    return found, tuple(
        dict.fromkeys(
            cells["contact_site"] for cells in slips if any(names_file(_patterns(cells), each.file) for each in found)
        )
    )


def _patterns(cells: Mapping[str, str]) -> list[str]:
    """What the row of a contact point names as its recordings."""
    return [pattern.strip().casefold() for pattern in cells.get("recordings", "").split(";")]


def names_file(patterns: Iterable[str], file: str) -> bool:
    """Whether one of the patterns of contact points, in small letters, names a file."""
    return any(fnmatchcase(file.casefold(), pattern) for pattern in patterns)


def phase_two_of(at_points: Iterable[AtPoint]) -> PhaseTwo:
    """What recordings at contact points show of Phase II, each once: a robot that clamps there clamps all the same."""
    found = PhaseTwo()
    for each in {each.recording: each for each in at_points}.values():
        above = each.phase2 > np.fmax(each.peak, 0.0)
        kinds = {each.scenario: 1} if each.scenario else {}
        unused = each.phase2 if above else math.nan
        found = found.and_(PhaseTwo(kinds, 0, each.phase2, int(above), 0, unused))
    return found


def _force(entry: Entry) -> float:
    """The largest force of a file [N]; NaN without one, or if a person took it out, as it was collected."""
    if entry.exclude and entry.row_sha256 == row_sha256(entry):
        return math.nan
    return float(np.fmax(entry.peak_force, entry.phase2_force))


def _pressure(entry: Entry, register: Path) -> float:
    """The largest pressure of a film at a contact point [N/cm^2]; NaN without one."""
    kept = entry.conditions.get(PEAK_PRESSURE, "")
    if entry.conditions.get(PRESSURE_FROM) and not kept:
        message = f"{entry.file} was collected by a version that did not keep its pressure; forcemap collect"
        raise TableError(message, file=str(register))
    return float(kept) if kept else math.nan


def _spread(low: float, high: float, near: float, far: float) -> list[float]:
    """Values from end to end of the part of a range that lies between near and far; one value if none does."""
    first, last = max(low, near), min(high, far)
    return [low] if first > last else np.unique(np.linspace(first, last, _STEPS)).tolist()
