"""Force limits of a body area or region, for transient and quasi-static contact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.errors import ContactNotPermitted, InputError, UnknownName
from forcemap.findings import Finding, FindingKind
from forcemap.limits.body_areas import (
    MAX_TRANSIENT_FACTOR,
    BodyArea,
    LimitTable,
    identifier,
    standard_limit_table,
)
from forcemap.limits.pfl import LEAST_STIFFNESS

PHASE_TWO_SHARE = 1 / 8
"""Largest Phase II force, as a share of the peak, beside which a transient limit of pressure is used. Under a round
contact pressure grows as the cube root of the force (Hertz), so that then no more than half of the peak's pressure, the
quasi-static limit, goes on; under a flat one less."""

_ABOVE = 1.001  # times the standard's: rounding apart


class Contact(StrEnum):
    """The standard's two cases of contact."""

    TRANSIENT = "transient"
    QUASI_STATIC = "quasi-static"

    @classmethod
    def parse(cls, contact: str) -> Contact:
        """The kind of contact of that name.

        Raises
        ------
        InputError
            Neither of the two.
        """
        try:
            return cls(contact)
        except ValueError:
            raise InputError(f"contact: found {contact!r}, expected transient or quasi-static") from None


@dataclass(frozen=True)
class ForceLimit:
    """Limits that hold for a body area or region: the lowest of the areas the name stands for.

    Parameters
    ----------
    name : str
        The name asked for.
    areas : tuple of str
        Identifiers of the areas it stands for.
    permitted : bool
        False where the standard permits no contact (skull, forehead and face).
    tabulated_quasi_static, tabulated_transient : float
        Force limits as tabulated [N]; not for use where contact is not permitted.
    tabulated_quasi_static_pressure, tabulated_transient_pressure : float
        Pressure limits as tabulated [Pa].
    edition, source, version, sha256 : str
        Of the table.
    stiffness : float
        Largest spring constant of the areas [N/m], which a measuring device must have; NaN if neither the table nor
        the standard states it for one of them.
    lacking : tuple of str
        If the name is a region: areas that the standard has in it and a user's table does not.
    head : bool
        True if one of the areas is part of the head.
    head_contact : str
        For a limit of the head: what permits contact there according to a user's table. The standard permits none.
    above_standard : float
        The largest of its limits, of force and pressure, over the standard's for the same area; NaN of an area that the
        standard does not have.
    """

    name: str
    areas: tuple[str, ...]
    permitted: bool
    tabulated_quasi_static: float
    tabulated_transient: float
    tabulated_quasi_static_pressure: float
    tabulated_transient_pressure: float
    edition: str
    source: str
    version: str
    sha256: str
    stiffness: float = math.nan
    lacking: tuple[str, ...] = ()
    head: bool = False
    head_contact: str = ""
    above_standard: float = math.nan

    def __post_init__(self) -> None:
        quasi_static, transient = self.tabulated_quasi_static, self.tabulated_transient
        lowest = quasi_static if self.permitted else 0.0
        if not (0 < quasi_static < math.inf and lowest <= transient <= MAX_TRANSIENT_FACTOR * quasi_static):
            raise InputError(
                f"limit of {self.name}: found {quasi_static:g} N quasi-static and {transient:g} N transient, expected "
                f"positive newtons, and the transient limit from 1 to {MAX_TRANSIENT_FACTOR:g} times the other"
            )
        if not (math.isnan(self.stiffness) or LEAST_STIFFNESS <= self.stiffness < math.inf):
            raise InputError(
                f"limit of {self.name}: found a spring of {self.stiffness:g} N/m, expected at least "
                f"{LEAST_STIFFNESS:g} (75 N/mm is 75000)"
            )

    @property
    def quasi_static(self) -> float:
        """Quasi-static force limit [N]; raises ContactNotPermitted for the head."""
        self.require_permitted()
        return self.tabulated_quasi_static

    @property
    def transient(self) -> float:
        """Transient force limit [N]; raises ContactNotPermitted for the head."""
        self.require_permitted()
        return self.tabulated_transient

    @property
    def quasi_static_pressure(self) -> float:
        """Quasi-static pressure limit [Pa]; raises ContactNotPermitted for the head."""
        self.require_permitted()
        return self.tabulated_quasi_static_pressure

    @property
    def transient_pressure(self) -> float:
        """Transient pressure limit [Pa]; raises ContactNotPermitted for the head."""
        self.require_permitted()
        return self.tabulated_transient_pressure

    def force(self, contact: Contact) -> float:
        """Force limit [N] for a kind of contact; raises ContactNotPermitted for the head."""
        return self.transient if Contact.parse(contact) is Contact.TRANSIENT else self.quasi_static

    def pressure(self, contact: Contact) -> float:
        """Pressure limit [Pa] for a kind of contact; raises ContactNotPermitted for the head."""
        return self.transient_pressure if Contact.parse(contact) is Contact.TRANSIENT else self.quasi_static_pressure

    def __str__(self) -> str:
        lacking = f"; this table lacks {', '.join(self.lacking)} of the region" if self.lacking else ""
        head = f"; HEAD, permitted by the table's own words: {self.head_contact}" if self.head_finding else ""
        return f"{self.name} in {self.edition} (table version {self.version}){lacking}{head}"

    @property
    def head_finding(self) -> Finding | None:
        """Statement required with a limit of the head that a user's table permits; None for other limits."""
        if not (self.permitted and self.head_contact):
            return None
        return Finding.of(FindingKind.HEAD_BY_TABLE, head_contact=self.head_contact)

    @property
    def doubts(self) -> tuple[Finding, ...]:
        """What must be said first of a limit of a user's table: of the head, or above the standard's."""
        above = {"name": self.name, "times": self.above_standard, "editions": standard_limit_table().edition}
        raised = Finding.of(FindingKind.LIMIT_ABOVE_STANDARD, **above) if self.above_standard > _ABOVE else None
        return tuple(filter(None, (self.head_finding, raised)))

    @property
    def refusal(self) -> Finding | None:
        """Why there is no limit; None where contact is permitted."""
        if self.permitted:
            return None
        head = self.head and self.tabulated_transient > 0
        return Finding.of(FindingKind.NOT_PERMITTED, name=self.name, head=head, edition=self.edition)

    def require_permitted(self) -> None:
        """Raise ContactNotPermitted for the head."""
        if (refused := self.refusal) is not None:
            head = "an area of the head, and the table names nothing that permits it"
            why = head if refused.figure("head") else "transient factor 0"
            raise ContactNotPermitted(
                f"contact with {self.name} is not permitted ({why} in "
                f"{self.edition}), so no limit and no speed follow; keep the robot from reaching it"
            )


@dataclass(frozen=True)
class NewtonLimit:
    """A force limit that a user states in newtons; it permits nothing that a body area's limit would not.

    Parameters
    ----------
    force : float or array
        The limit [N].
    quasi_static : float, optional
        Its quasi-static part [N], not above the limit, if that is a transient one.
    spring_N_per_m : float, optional
        Spring constant of the body part it is meant for [N/m]; without it the limit holds for the measuring device
        alone.

    Raises
    ------
    InputError
        A figure that is not positive and finite, or a quasi-static part above the limit.
    """

    force: Any
    quasi_static: float | None = None
    spring_N_per_m: float | None = None

    def __post_init__(self) -> None:
        array = np.asarray(self.force, dtype=np.float64)
        usable = (array > 0) & (array < np.inf)
        if np.ma.is_masked(self.force) or not usable.all():
            unusable = "a masked entry" if usable.all() else f"{array[~usable].flat[0]:g} N"
            raise InputError(f"limit: found {unusable}, expected a positive finite number")
        object.__setattr__(self, "force", array if array.shape else float(array))
        part, spring = self.quasi_static, self.spring_N_per_m
        if part is not None and not (part > 0 and np.all(part <= array)):
            raise InputError(
                f"quasi-static limit: found {part:g} N, expected newtons above 0 and not above the transient limit"
            )
        if spring is not None and not LEAST_STIFFNESS <= spring < math.inf:
            least = f"at least {LEAST_STIFFNESS:g} (75 N/mm is 75000)"
            raise InputError(f"spring of the limit: found {spring:g} N/m, expected {least}")

    @classmethod
    def of(cls, limit: NewtonLimit | ArrayLike, quasi_static: float | None, spring: float | None) -> NewtonLimit:
        """A limit in newtons with its quasi-static part and spring constant; none of them may be stated twice."""
        if not isinstance(limit, NewtonLimit):
            return cls(limit, quasi_static, spring)
        if quasi_static is not None or spring is not None:
            raise InputError("limit: found figures beside a NewtonLimit, expected them in it")
        return limit


def force_limit(area_or_region: str, *, table: LimitTable | None = None) -> ForceLimit:
    """Force limits of a body area or region.

    A region stands for all of its areas, an area named without a side for both sides; the lowest value holds.

    Parameters
    ----------
    area_or_region : str
        Identifier; spaces and hyphens are accepted.
    table : LimitTable, optional
        A user's own table; that of ISO/TS 15066:2016 if not given.

    Raises
    ------
    UnknownName
        Neither an area nor a region has the name; the nearest are listed.

    Examples
    --------
    >>> force_limit("back_of_hand").quasi_static
    140.0
    >>> force_limit("temple").permitted
    False
    """
    table = table or standard_limit_table()
    areas = table.find(area_or_region)
    head = any(area.head for area in areas)
    return ForceLimit(
        name=area_or_region,
        areas=tuple(area.area for area in areas),
        permitted=all(area.transient_factor > 0 and (not area.head or table.head_contact != "") for area in areas),
        tabulated_quasi_static=min(area.quasi_static_force for area in areas),
        tabulated_transient=min(area.quasi_static_force * area.transient_factor for area in areas),
        tabulated_quasi_static_pressure=min(area.quasi_static_pressure for area in areas),
        tabulated_transient_pressure=min(area.quasi_static_pressure * area.transient_factor for area in areas),
        edition=table.edition,
        source=table.source,
        version=table.version,
        sha256=table.sha256,
        stiffness=float(np.max([area.stiffness for area in areas])),  # NaN if that of any area is unknown
        lacking=_lacking(areas, area_or_region),
        head=head,
        head_contact=table.head_contact if head else "",
        above_standard=max(map(_above_standard, areas), default=math.nan),
    )


def _above_standard(area: BodyArea) -> float:
    """The largest limit of an area over the standard's for it; NaN if the standard does not have it."""
    try:
        standard = standard_limit_table().find(area.area)
    except UnknownName:
        return math.nan
    lowest = [min(figures) for figures in zip(*map(_figures, standard), strict=True)]
    ratios = [own / least for own, least in zip(_figures(area), lowest, strict=True) if least > 0]
    return max(ratios, default=math.nan)


def _figures(area: BodyArea) -> tuple[float, ...]:
    """Limits of force [N] and pressure [Pa], quasi-static and transient."""
    quasi_static = area.quasi_static_force, area.quasi_static_pressure
    return (*quasi_static, *(area.transient_factor * figure for figure in quasi_static))


def _lacking(areas: list[BodyArea], name: str) -> tuple[str, ...]:
    """Areas that the standard has in the region of that name, but that are not among these."""
    if any(identifier(name) != area.region for area in areas):
        return ()
    named = {area.area for area in areas}
    region = [area for area in standard_limit_table().areas.values() if area.region == identifier(name)]
    return tuple(area.area for area in region if not {area.area, area.base} & named)
