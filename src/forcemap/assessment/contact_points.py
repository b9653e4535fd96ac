"""The contact points of a cell, `contact_points.csv`: where a person can be hit, and what is to show that it may be."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from forcemap.campaigns.point_list import COLUMNS, NUMBERS, POINTS_FILE, REQUIRED, point_table
from forcemap.csv_table import csv_text
from forcemap.direction import direction_vector
from forcemap.errors import InputError, UnknownName
from forcemap.files import read_bytes
from forcemap.limits.body_areas import LimitTable
from forcemap.limits.force_limits import Contact, ForceLimit, force_limit

__all__ = ["COLUMNS", "NUMBERS", "POINTS_FILE", "REQUIRED"]  # what others take from here beside the points

PHOTOGRAPHS_FOLDER = "photographs"
PICTURE_ENDINGS = (".jpg", ".jpeg", ".png")

_NAME = re.compile(r"[\w.-]{1,36}", re.ASCII)
_PHOTOGRAPH = re.compile(r"[\w. -]{1,100}")
_LONGEST = 500  # characters of a cell of words; a choice
_MOST_POINTS = 2000  # of a cell; a choice
_WORDS = ("hazard", "contact_site", "direction", "recordings", "photograph", "remark")


class Body(StrEnum):
    """Whether the body part can give way."""

    FREE = "free"
    CONSTRAINED = "constrained"


class RestsOn(StrEnum):
    """What is to show that contact at a point stays within its limit."""

    MAP = "map"
    MEASUREMENTS = "measurements"
    BOTH = "both"


@dataclass(frozen=True)
class ContactPoint:
    """A contact point as the list states it; an empty text or NaN is "not stated".

    Parameters
    ----------
    name : str
        Its identifier.
    limit : ForceLimit
        Of the body area that can be hit.
    contact : Contact
    body : Body
    rests_on : RestsOn
    hazard : str
        Number of the hazard in the risk assessment.
    contact_site : str
        The part of robot, tool or workpiece that hits.
    distance, distance_to, height, height_to : float
        The place, or the zone between two of each [m].
    direction : str
        Of the motion at contact.
    recordings : tuple of str
        The recordings made at this point: patterns of the campaign's states and recordings, or of files in points/.
    recorded_at : float
        Speed that was programmed while the files in points/ were recorded [m/s].
    programmed : float
        Speed that the robot's program has at this point [m/s].
    photograph, remark : str
        Name of a file in photographs/; anything.
    row : int
        Line of the list.
    """

    name: str
    limit: ForceLimit
    contact: Contact
    body: Body
    rests_on: RestsOn
    hazard: str = ""
    contact_site: str = ""
    distance: float = math.nan
    distance_to: float = math.nan
    height: float = math.nan
    height_to: float = math.nan
    direction: str = ""
    recordings: tuple[str, ...] = ()
    recorded_at: float = math.nan
    programmed: float = math.nan
    photograph: str = ""
    remark: str = ""
    row: int = 0

    @property
    def placed(self) -> bool:
        """True if its place is stated."""
        return not (math.isnan(self.distance) or math.isnan(self.height))

    @property
    def extent(self) -> float:
        """How far its zone reaches [m]; 0 for a place."""
        return max(self.distance_to - self.distance, self.height_to - self.height)

    @property
    def held_as_free(self) -> bool:
        """True if a transient limit is stated for a body part that cannot give way, for which it is not made."""
        return self.body is Body.CONSTRAINED and self.contact is Contact.TRANSIENT

    @property
    def by_map(self) -> bool:
        """True if it is to rest on the map."""
        return self.rests_on is not RestsOn.MEASUREMENTS

    @property
    def by_measurements(self) -> bool:
        """True if it is to rest on impacts at this point."""
        return self.rests_on is not RestsOn.MAP


def read_contact_points(path: str | Path, *, table: LimitTable | None = None) -> tuple[ContactPoint, ...]:
    """Read the list of contact points.

    Parameters
    ----------
    path : str or Path
    table : LimitTable, optional
        Where the limits of their body areas stand; the standard's if not given.

    Raises
    ------
    TableError
        Not a table; a column that is missing or unknown; a cell that cannot be used; a point twice.
    """
    return parse_contact_points(read_bytes(path), str(path), table=table)


def parse_contact_points(content: bytes, file: str, *, table: LimitTable | None = None) -> tuple[ContactPoint, ...]:
    """The list of contact points in the content of a file, which errors name; else as `read_contact_points`."""
    read = point_table(content, file)
    if not read.rows or len(read.rows) > _MOST_POINTS:
        raise read.error(f"found {len(read.rows)} contact points, expected 1 to {_MOST_POINTS}")
    numbers = {name: read.numbers(name, required=False) for name in NUMBERS if name in read.columns}
    points: dict[str, ContactPoint] = {}
    for i, (cells, row) in enumerate(zip(read.texts, read.rows, strict=True)):
        try:
            point = _point(cells, {name: column[i] for name, column in numbers.items()}, row, table)
        except InputError as error:
            raise read.error(error.message, row, error.column) from None
        if point.name.casefold() in points:
            raise read.error(f"found {point.name!r} twice, expected each point once", row, "point_id")
        points[point.name.casefold()] = point
    return tuple(points.values())


def listed_cells(content: bytes, file: str) -> list[dict[str, str]]:
    """The cells of every row by column, numbers with decimal points; errors as `read_contact_points`."""
    return [{name: cells.get(name, "") for name in COLUMNS} for cells in point_table(content, file).texts]


def list_text(rows: Sequence[Mapping[str, str]]) -> str:
    """A list of contact points as CSV, with all columns."""
    return csv_text({name: [row.get(name, "") for row in rows] for name in COLUMNS})


def _point(cells: dict[str, str], numbers: dict[str, float], row: int, table: LimitTable | None) -> ContactPoint:
    name = cells["point_id"]
    if not _NAME.fullmatch(name):
        expected = "expected 1 to 36 letters, digits, hyphens, points or underscores"
        raise InputError(f"found {name!r}, {expected}", column="point_id")
    words: dict[str, Any] = {column: cells.get(column, "") for column in _WORDS}
    for column, text in words.items():
        if len(text) > _LONGEST:
            raise InputError(f"found {len(text)} characters, expected at most {_LONGEST}", column=column)
    photograph = words["photograph"]
    if photograph and (not _PHOTOGRAPH.fullmatch(photograph) or not photograph.lower().endswith(PICTURE_ENDINGS)):
        expected = f"expected the name of a file in {PHOTOGRAPHS_FOLDER}/ that ends with {', '.join(PICTURE_ENDINGS)}"
        raise InputError(f"found {photograph!r}, {expected}", column="photograph")
    if words["direction"]:
        _at("direction", lambda: direction_vector(words["direction"], whose="the list"))
    recordings = words.pop("recordings")
    return ContactPoint(
        name=name,
        limit=_at("body_area", lambda: force_limit(cells["body_area"], table=table)),
        contact=_choice(Contact, "contact", cells),
        body=_choice(Body, "body", cells),
        rests_on=_choice(RestsOn, "rests_on", cells),
        recordings=tuple(part for text in recordings.split(";") if (part := text.strip())),
        row=row,
        recorded_at=_speed("recorded_at_mps", numbers),
        programmed=_speed("programmed_mps", numbers),
        **words,
        **_place(numbers),
    )


def _at(column: str, make: Any) -> Any:
    """What `make` returns; its error names the column."""
    try:
        return make()
    except (InputError, UnknownName) as error:
        raise InputError(error.message, column=column) from None


def _choice(kind: type[StrEnum], column: str, cells: dict[str, str]) -> Any:
    text = cells[column].lower()
    try:
        return kind(text)
    except ValueError:
        raise InputError(f"found {cells[column]!r}, expected one of {', '.join(kind)}", column=column) from None


def _speed(column: str, numbers: dict[str, float]) -> float:
    speed = numbers.get(column, math.nan)
    if not (math.isnan(speed) or 0 < speed <= 10):
        raise InputError(f"found {speed:g}, expected metres per second above 0 and up to 10", column=column)
    return speed


def _place(numbers: dict[str, float]) -> dict[str, Any]:
    """Ends of distance and height [m]; where only one is stated it is both."""
    place: dict[str, float] = {}
    for axis, least in (("distance", 0.0), ("height", -10.0)):
        low, high = (numbers.get(f"{axis}{end}_m", math.nan) for end in ("", "_to"))
        for value, end in ((low, ""), (high, "_to")):
            if not (math.isnan(value) or least <= value <= 10):
                raise InputError(f"found {value:g}, expected metres, {least:g} to 10", column=f"{axis}{end}_m")
        high = low if math.isnan(high) else high
        if math.isnan(low) != math.isnan(high) or low > high:
            raise InputError(f"found {low:g} to {high:g} m, expected from <= to", column=f"{axis}_to_m")
        place |= {axis: low, f"{axis}_to": high}
    if math.isnan(place["distance"]) != math.isnan(place["height"]):
        raise InputError("found one of distance and height, expected both or neither", column="height_m")
    return place
