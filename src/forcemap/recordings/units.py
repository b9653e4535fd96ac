"""The units devices write, and those a column's name states."""

from __future__ import annotations

import re
from enum import StrEnum


class TimeUnit(StrEnum):
    """Unit of the time column."""

    SECONDS = "s"
    MILLISECONDS = "ms"
    MICROSECONDS = "us"

    @property
    def per_second(self) -> float:
        """How many of it make a second."""
        return {TimeUnit.SECONDS: 1.0, TimeUnit.MILLISECONDS: 1e3, TimeUnit.MICROSECONDS: 1e6}[self]


class ForceUnit(StrEnum):
    """Unit of the force columns; counts are the raw figures of a converter."""

    NEWTONS = "N"
    KILONEWTONS = "kN"
    COUNTS = "counts"


_TIME_UNITS, _FORCE_UNITS = r"(s|sec|ms|us|[µμ]s)", r"(N|kN)"
# "force_N", "Force [N]", "F (N)", "F / N", "force in N", or the unit alone as in a line of units
_STATED = r"(?:.*(?:_|\[|\(|/|\sin\s))?\s*{unit}\s*[\])]?\s*"
_STATED_TIME = re.compile(_STATED.format(unit=_TIME_UNITS))
_STATED_FORCE = re.compile(_STATED.format(unit=_FORCE_UNITS))
# in brackets, or the last word; there one letter is no unit: F_t, F_v
_ANY_UNIT = re.compile(r".*?(?:[\[(]\s*([^\[\]()]+?)\s*[\])]|\s/\s*(\S+)|[_,/\s]([^][()_,\s]{2,}|%))\s*")
_FORCES = "lbf lb lbs kgf kp kg g gf ozf dan dn mn kn t"
_NO_FORCES = "pa kpa mpa bar psi n/cm2 n/cm^2 n/cm² n/mm2 n/mm² nm v mv %"
_OTHER_UNITS = frozenset([*_FORCES.split(" "), *_NO_FORCES.split(" ")])
# nothing but the quantity and its unit
_PLAIN = r"(?i:{words})\s*(?:_|\[|\(|/)\s*{unit}\s*[\])]?"
_PLAIN_TIME = re.compile(_PLAIN.format(words="t|time|zeit", unit=_TIME_UNITS))
_PLAIN_FORCE = re.compile(_PLAIN.format(words="f|force|kraft", unit=_FORCE_UNITS))


def time_unit_in(name: str) -> TimeUnit | None:
    """The unit of time that a column's name ends with, if any.

    >>> time_unit_in("Zeit [ms]")
    <TimeUnit.MILLISECONDS: 'ms'>
    """
    found = _STATED_TIME.fullmatch(name)
    return TimeUnit(re.sub("[µμ]", "u", found[1]).replace("sec", "s")) if found else None


def force_unit_in(name: str) -> ForceUnit | None:
    """The unit of force that a column's name ends with, if any.

    >>> force_unit_in("force_kN")
    <ForceUnit.KILONEWTONS: 'kN'>
    """
    found = _STATED_FORCE.fullmatch(name)
    return ForceUnit(found[1]) if found else None


def other_unit_in(name: str) -> str | None:
    """The unit that a column's name ends with, if it is one that forcemap does not read as a force.

    >>> other_unit_in("Force [lbf]"), other_unit_in("force_lbf"), other_unit_in("Force [N]")
    ('lbf', 'lbf', None)
    """
    found = _ANY_UNIT.fullmatch(name)
    for unit in (name.strip(), (found[1] or found[2] or found[3]).strip() if found else ""):
        if unit.casefold() in _OTHER_UNITS and unit not in ("N", "kN"):
            return unit
    return None


def names_plain_time(name: str) -> bool:
    """True if the name says time and its unit and nothing else: "time_ms", "t [s]", "Zeit (ms)"."""
    return _PLAIN_TIME.fullmatch(name) is not None


def names_plain_force(name: str) -> bool:
    """True if the name says force and its unit and nothing else: "force_N", "F [kN]", "Kraft (N)"."""
    return _PLAIN_FORCE.fullmatch(name) is not None
