"""Body areas and regions with their limits: the standard's table, or a user's own."""

from __future__ import annotations

import csv
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path

from forcemap.errors import InputError, TableError, UnknownName
from forcemap.files import read_bytes, sha256

_PRESSURE, _FORCE, _FACTOR = "quasi_static_pressure_N_per_cm2", "quasi_static_force_N", "transient_factor"
_AREA_COLUMNS = ("area", "name", "region", _PRESSURE, _FORCE, _FACTOR)
_PASCALS = 1e4  # Pa in 1 N/cm^2
_MAX_FIGURE = 2000.0  # [N], [N/cm^2]: several times the largest of the standard
MAX_TRANSIENT_FACTOR = 2.0
"""The standard's transient over quasi-static limit; a larger one is a slip."""

_SIDES = ("_dominant", "_nondominant")
_HEAD_WORD = re.compile(  # begins or ends so
    "(head|skull|crani|face|facial|temple|tempor|masticat|jaw|mandib|maxill|chin|cheek|nose|nasal|mouth|lip|eye|brow|ear"
    "|scalp|occip|forehead|kopf|schädel|schaedel|stirn|gesicht|schläfe|schlaefe|kaumuskel|kiefer|kinn|wange|nase|mund"
    "|auge|ohr).*|.*(head|skull|jaw|kopf|kiefer|schädel|schaedel|gesicht)"
)
_PERMITTED_BY = re.compile(r"permitted by \S.*\S", re.IGNORECASE)


@dataclass(frozen=True)
class BodyArea:
    """Limits of one body area.

    Parameters
    ----------
    area, name, region : str
        Identifier, name in words, identifier of its region.
    quasi_static_force : float
        Quasi-static force limit [N].
    quasi_static_pressure : float
        Quasi-static pressure limit [Pa].
    transient_factor : float
        Transient over quasi-static limit; 0 means that contact is not permitted.
    """

    area: str
    name: str
    region: str
    quasi_static_force: float
    quasi_static_pressure: float
    transient_factor: float

    @property
    def head(self) -> bool:
        """True for the head: by its region, or by a word of its name; the standard permits no contact there."""
        texts = unicodedata.normalize("NFKC", f"{self.area} {self.name} {self.region}").casefold()
        seen = "".join(sign for sign in texts if unicodedata.category(sign) != "Cf")  # not to be seen: zero-width marks
        words = re.findall(r"[^\W\d_]+", seen)
        return any(_HEAD_WORD.fullmatch(word) for word in words)

    @property
    def base(self) -> str:
        """The identifier without its side."""
        return _without_side(self.area)


@dataclass(frozen=True)
class BodyRegion:
    """Constants of one body region in the standard's contact model.

    Parameters
    ----------
    region : str
        Identifier.
    stiffness : float
        Spring constant k [N/m].
    mass : float
        Effective mass m_H [kg].
    """

    region: str
    stiffness: float
    mass: float


@dataclass(frozen=True)
class LimitTable:
    """A table of body areas.

    Parameters
    ----------
    areas : mapping of str to BodyArea
        Body areas by identifier.
    edition, source, version : str
        Edition of the standard; where the figures come from; version of the table.
    sha256 : str
        SHA-256 of the file.
    head_contact : str
        What the file says permits contact with the head, in its own words; empty if it does not say so.
    """

    areas: Mapping[str, BodyArea]
    edition: str
    source: str
    version: str
    sha256: str
    head_contact: str = ""

    @property
    def regions(self) -> list[str]:
        """Identifiers of the regions, in order of the table."""
        return list(dict.fromkeys(area.region for area in self.areas.values()))

    def find(self, name: str) -> list[BodyArea]:
        """The areas a name stands for: one area, an area of both sides, or all areas of a region.

        Raises
        ------
        UnknownName
            Neither an area nor a region has the name.
        InputError
            The table has one side of an area alone, and the name stands for both.
        """
        wanted = identifier(name)
        found = [area for area in self.areas.values() if wanted in (area.area, area.region, area.base)]
        if not found:
            raise UnknownName("body area or region", name, [*self.areas, *self.regions])
        for area in found:
            sides = [side for side in _SIDES if area.area.endswith(side)]
            other = [area.base + side for side in _SIDES if side not in sides]
            if sides and wanted == area.base and not {area.base, *other} & self.areas.keys():
                raise InputError(
                    f"body area: {name} stands for both sides, and {self.edition} has {area.area} without {other[0]}; "
                    f"name {area.area}, or add the other side to the table"
                )
        return found


@lru_cache
def standard_limit_table() -> LimitTable:
    """The 29 body areas of ISO/TS 15066:2016, Annex A, with their provenance."""
    return _limit_table(_packaged("body_areas.csv"), "body_areas.csv")


def read_limit_table(path: str | Path) -> LimitTable:
    """Read a user's own table of limits.

    A CSV file with the columns area, name, region, quasi_static_pressure_N_per_cm2, quasi_static_force_N and
    transient_factor; lines "# edition: ...", "# source: ..." and "# version: ..." may stand before the header. An area
    of the head stays closed whatever its factor, unless a line "# head_contact: permitted by ..." names the source that
    permits it.

    Raises
    ------
    TableError
        A column is missing, an area stands twice, a limit is not positive, a transient factor is neither 0 nor
        from 1 to 2, or what permits contact with the head is not named.
    """
    return _limit_table(read_bytes(path), Path(path).name)


@lru_cache
def body_regions() -> Mapping[str, BodyRegion]:
    """The 12 body regions of ISO/TS 15066:2016, table A.3, by identifier."""
    _, rows = _read(_packaged("body_regions.csv"), "body_regions.csv")
    return {
        row["region"]: BodyRegion(
            row["region"], 1000 * float(row["spring_constant_N_per_mm"]), float(row["effective_mass_kg"])
        )
        for _, row in rows
    }


def body_region(name: str) -> BodyRegion:
    """The region of that name, or of the body area of that name.

    Raises
    ------
    UnknownName
        Neither a region nor an area has the name.
    """
    return body_regions()[standard_limit_table().find(name)[0].region]


def _packaged(file: str) -> bytes:
    return resources.files("forcemap.limits").joinpath("tables", file).read_bytes()


def _limit_table(content: bytes, file: str) -> LimitTable:
    facts, rows = _read(content, file)
    areas: dict[str, BodyArea] = {}
    if not rows:
        raise TableError("found no body area, expected at least one", file=file)
    for row_number, row in rows:
        for column in _AREA_COLUMNS:
            if row.get(column) is None:
                raise TableError("the cell or column is missing", file=file, row=row_number, column=column)
        numbers = {column: _number(row[column], file, row_number, column) for column in (_PRESSURE, _FORCE, _FACTOR)}
        factor = numbers[_FACTOR]
        if factor != 0 and not 1 <= factor <= MAX_TRANSIENT_FACTOR:
            raise TableError(
                f"found {factor:g}, expected 0 (contact not permitted) or a factor from 1 to {MAX_TRANSIENT_FACTOR:g}",
                file=file,
                row=row_number,
                column=_FACTOR,
            )
        name, region = identifier(row["area"]), identifier(row["region"])
        if name in areas or not name or not region:
            raise TableError(
                f"found {name!r}, expected every area once and named, with its region",
                file=file,
                row=row_number,
                column="area",
            )
        usual = _usual_regions().get(_without_side(name), region)
        if region != usual:
            raise TableError(
                f"found {row['region']!r}, expected {usual}, the region in which the standard has {name}: the "
                "measuring device's spring goes by it",
                file=file,
                row=row_number,
                column="region",
            )
        areas[name] = BodyArea(name, row["name"], region, numbers[_FORCE], numbers[_PRESSURE] * _PASCALS, factor)
    return LimitTable(
        areas,
        edition=facts.get("edition", f"not stated in {file}"),
        source=facts.get("source", file),
        version=facts.get("version", "not stated"),
        sha256=sha256(content),
        head_contact=_head_contact(facts.get("head_contact", ""), file),
    )


@lru_cache
def _usual_regions() -> Mapping[str, str]:
    """The regions of the standard's areas, by area without its side."""
    _, rows = _read(_packaged("body_areas.csv"), "body_areas.csv")
    return {_without_side(row["area"]): row["region"] for _, row in rows}


def _without_side(area: str) -> str:
    return area.removesuffix(_SIDES[0]).removesuffix(_SIDES[1])


def _head_contact(words: str, file: str) -> str:
    """What permits contact with the head, if the file names it; anything but a source is refused."""
    if words and not _PERMITTED_BY.fullmatch(words):
        raise TableError(
            f'found {words!r}, expected "permitted by" and the source that permits contact with the head, or no such '
            "line",
            file=file,
            column="head_contact",
        )
    return words


def identifier(name: str) -> str:
    """A name as identifiers are written: small letters and underscores."""
    return "_".join(name.lower().replace("-", " ").replace("_", " ").split())


def _number(cell: str, file: str, row: int, column: str) -> float:
    if not re.fullmatch(r"\d+\.?\d*|\.\d+", cell, re.ASCII):
        raise TableError(f"found {cell!r}, expected a positive number", file=file, row=row, column=column)
    number = float(cell)
    if not (number <= _MAX_FIGURE and (number > 0 or column == _FACTOR)):
        raise TableError(
            f"found {cell!r}, expected a positive number up to {_MAX_FIGURE:g}", file=file, row=row, column=column
        )
    return number


def _read(content: bytes, file: str) -> tuple[dict[str, str], list[tuple[int, dict[str, str]]]]:
    """Facts from the comment lines, and (line number, cells by column) of every row."""
    try:
        lines = content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise TableError("not text in UTF-8, expected a CSV table", file=file) from None
    facts = {}
    table = []
    for number, line in enumerate(lines, start=1):
        if line.startswith("#"):
            key, _, value = line.lstrip("# ").partition(":")
            facts[key.strip().lower()] = value.strip()
        elif line.strip():
            table.append((number, line))
    try:
        cells = [[cell.strip() for cell in record] for record in csv.reader((line for _, line in table), strict=True)]
    except csv.Error as error:
        raise TableError(f"not a CSV table ({error})", file=file) from None
    header, body = (cells[0], cells[1:]) if cells else ([], [])
    for name in header:
        if header.count(name) > 1:
            raise TableError(f"found column {name!r} twice, expected it once", file=file, row=table[0][0], column=name)
    rows = []
    for (number, _), record in zip(table[1:], body, strict=False):
        if len(record) != len(header):
            raise TableError(f"found {len(record)} cells, expected {len(header)}", file=file, row=number)
        rows.append((number, dict(zip(header, record, strict=True))))
    return facts, rows
