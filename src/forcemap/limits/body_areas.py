"""Body areas and regions with their limits: the standard's table, or a user's own."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib import resources
from pathlib import Path

import numpy as np

from forcemap.csv_table import Table, read_table
from forcemap.errors import InputError, TableError, UnknownName, words_of
from forcemap.files import read_bytes, sha256
from forcemap.limits.pfl import LEAST_STIFFNESS

_PRESSURE, _FORCE, _FACTOR = "quasi_static_pressure_N_per_cm2", "quasi_static_force_N", "transient_factor"
_AREA_COLUMNS = ("area", "name", "region", _PRESSURE, _FORCE, _FACTOR)
_SPRING = "spring_constant_N_per_mm"
_STANDARD = "body_areas.csv"
PASCALS = 1e4
"""Pa in 1 N/cm^2."""
_N_PER_M = 1000.0  # N/m in 1 N/mm
_MAX_LIMIT = 2000.0  # [N], [N/cm^2]; several times the largest of the standard, so a larger one is a slip

MAX_TRANSIENT_FACTOR = 2.0
"""The standard's transient over quasi-static limit; a larger one is a slip."""

_SIDES = ("_dominant", "_nondominant")
_HEAD_WORD = re.compile(  # how words for parts of the head begin or end, English and German (docs/decisions.md)
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
    stated_stiffness : float
        Spring constant that the table states [N/m]; NaN where that of its region holds.
    """

    area: str
    name: str
    region: str
    quasi_static_force: float
    quasi_static_pressure: float
    transient_factor: float
    stated_stiffness: float = math.nan

    @property
    def stiffness(self) -> float:
        """Spring constant that the measuring device must have [N/m]; NaN if neither table nor standard states one."""
        region = body_regions().get(self.region)
        return self.stated_stiffness if region is None else float(np.fmax(self.stated_stiffness, region.stiffness))

    @property
    def head(self) -> bool:
        """True for the head, by its region or by a word of its name; the standard permits no contact there."""
        texts = unicodedata.normalize("NFKC", f"{self.area} {self.name} {self.region}").casefold()
        visible = "".join(sign for sign in texts if unicodedata.category(sign) != "Cf")  # without zero-width marks
        words = re.findall(r"[^\W\d_]+", visible)
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
        What permits contact with the head, in the words of the file; empty if it does not say so.
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

    @property
    def both_sides(self) -> list[str]:
        """Names that stand for both sides of an area, in order of the table."""
        bases = [area.base for area in self.areas.values()]
        return [base for base in dict.fromkeys(bases) if bases.count(base) > 1]

    def _like(self, wanted: str) -> list[str]:
        """Names that hold a word of the one that is wanted, an area of both sides once; without any, all names."""
        both = self.both_sides
        areas = [area.base if area.base in both else area.area for area in self.areas.values()]
        words = words_of(wanted)
        named = list(dict.fromkeys([*areas, *self.regions]))
        holding = [each for each in named if any(word in each for word in words)]
        return holding or named

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
        areas = [area for area in self.areas.values() if wanted in (area.area, area.region, area.base)]
        if not areas:
            raise UnknownName("body area or region", name, self._like(wanted), listed="; forcemap limits lists all")
        for area in areas:
            sides = [side for side in _SIDES if area.area.endswith(side)]
            other = [area.base + side for side in _SIDES if side not in sides]
            if sides and wanted == area.base and not {area.base, *other} & self.areas.keys():
                raise InputError(
                    f"body area: {name} stands for both sides, and {self.edition} has {area.area} without {other[0]}; "
                    f"name {area.area}, or add the other side to the table"
                )
        return areas


@lru_cache
def standard_limit_table() -> LimitTable:
    """The 29 body areas of ISO/TS 15066:2016, Annex A, with their provenance."""
    return _limit_table(_content(_STANDARD), _STANDARD)


def read_limit_table(path: str | Path) -> LimitTable:
    """Read a user's own table of limits.

    A CSV file with the columns area, name, region, quasi_static_pressure_N_per_cm2, quasi_static_force_N and
    transient_factor; lines "# edition: ...", "# source: ..." and "# version: ..." may stand before the header. Contact
    with an area of the head is not permitted, whatever its factor, unless a line "# head_contact: permitted by ..."
    names the source that permits it.

    Raises
    ------
    TableError
        A column is missing, an area occurs twice, a limit is not positive, a transient factor is neither 0 nor
        from 1 to 2, or the source that permits contact with the head is not named.
    """
    return _limit_table(read_bytes(path), Path(path).name)


@lru_cache
def body_regions() -> Mapping[str, BodyRegion]:
    """The 12 body regions of ISO/TS 15066:2016, table A.3, by identifier."""
    rows = _table(_content("body_regions.csv"), "body_regions.csv").texts
    return {
        row["region"]: BodyRegion(row["region"], _N_PER_M * float(row[_SPRING]), float(row["effective_mass_kg"]))
        for row in rows
    }


def body_region(name: str) -> BodyRegion:
    """The region of that name, or of the body area of that name.

    Raises
    ------
    UnknownName
        Neither a region nor an area has the name.
    """
    return body_regions()[standard_limit_table().find(name)[0].region]


def _content(file: str) -> bytes:
    return resources.files("forcemap.limits").joinpath("tables", file).read_bytes()


def _table(content: bytes, file: str) -> Table:
    return read_table(content, file, what="body area", remarked=True)


def _limit_table(content: bytes, file: str) -> LimitTable:
    table = _table(content, file)
    areas: dict[str, BodyArea] = {}
    for column in _AREA_COLUMNS:
        if column not in table.columns:
            raise TableError("the column is missing", file=file, row=table.header_row, column=column)
    for column in table.columns:
        if column != _SPRING and re.search("spring|stiff|feder|steif", column, re.IGNORECASE):
            raise TableError(f"found a spring in another column than {_SPRING}", file=file, column=column)
    if not table.rows:
        raise TableError("found no body area, expected at least one", file=file)
    facts = table.remarks
    for row_number, row in zip(table.rows, table.texts, strict=True):
        refused = partial(TableError, file=file, row=row_number)
        pressure, force, factor = (_number(row[name], refused, name) for name in (_PRESSURE, _FORCE, _FACTOR))
        if factor != 0 and not 1 <= factor <= MAX_TRANSIENT_FACTOR:
            expected = f"expected 0 (contact not permitted) or a factor from 1 to {MAX_TRANSIENT_FACTOR:g}"
            raise refused(f"found {factor:g}, {expected}", column=_FACTOR)
        name, region = identifier(row["area"]), identifier(row["region"])
        if name in areas or not name or not region:
            raise refused(f"found {name!r}, expected every area once and named, with its region", column="area")
        usual = _usual_regions().get(_without_side(name), region)
        if region != usual:
            raise refused(
                f"found {row['region']!r}, expected {usual}, the region in which the standard has {name}: the "
                "measuring device's spring goes by it",
                column="region",
            )
        spring = _spring(row.get(_SPRING, ""), region, refused)
        areas[name] = BodyArea(name, row["name"], region, force, pressure * PASCALS, factor, spring)
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
    return {_without_side(row["area"]): row["region"] for row in _table(_content(_STANDARD), _STANDARD).texts}


def _without_side(area: str) -> str:
    return area.removesuffix(_SIDES[0]).removesuffix(_SIDES[1])


def _head_contact(words: str, file: str) -> str:
    """What permits contact with the head, if the file says so; anything but a named source is refused."""
    if words and not _PERMITTED_BY.fullmatch(words):
        raise TableError(
            f'found {words!r}, expected "permitted by" and the source that permits contact with the head, or no such '
            "line",
            file=file,
            column="head_contact",
        )
    return words


def identifier(name: str) -> str:
    """A name in the spelling of identifiers: lower case with underscores."""
    return "_".join(name.lower().replace("-", " ").replace("_", " ").split())


def _spring(cell: str, region: str, refused: partial[TableError]) -> float:
    """The spring constant that a table states [N/m]; NaN for an empty cell.

    It must not be softer than the standard's: a device as soft would read the region's forces too low.
    """
    if not cell:
        return math.nan
    spring, usual = _number(cell, refused, _SPRING), body_regions().get(region)
    least = (LEAST_STIFFNESS if usual is None else usual.stiffness) / _N_PER_M
    if spring < least:
        expected = f"expected at least {least:g} N/mm" + (f", the standard's for {region}" if usual else "")
        raise refused(f"found {spring:g} N/mm, {expected}", column=_SPRING)
    return _N_PER_M * spring


def _number(cell: str, refused: partial[TableError], column: str) -> float:
    if not re.fullmatch(r"\d+\.?\d*|\.\d+", cell, re.ASCII):
        raise refused(f"found {cell!r}, expected a positive number", column=column)
    number = float(cell)
    if not (number <= _MAX_LIMIT and (number > 0 or column == _FACTOR)):
        raise refused(f"found {cell!r}, expected a positive number up to {_MAX_LIMIT:g}", column=column)
    return number
