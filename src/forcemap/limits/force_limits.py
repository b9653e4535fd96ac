"""Force limits of a body area or region, for transient and quasi-static contact."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from forcemap.errors import ContactNotPermitted, InputError
from forcemap.limits.body_areas import LimitTable, standard_limit_table


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

    @property
    def quasi_static(self) -> float:
        """Quasi-static force limit [N]; raises ContactNotPermitted for the head."""
        self._require_permitted()
        return self.tabulated_quasi_static

    @property
    def transient(self) -> float:
        """Transient force limit [N]; raises ContactNotPermitted for the head."""
        self._require_permitted()
        return self.tabulated_transient

    @property
    def quasi_static_pressure(self) -> float:
        """Quasi-static pressure limit [Pa]; raises ContactNotPermitted for the head."""
        self._require_permitted()
        return self.tabulated_quasi_static_pressure

    @property
    def transient_pressure(self) -> float:
        """Transient pressure limit [Pa]; raises ContactNotPermitted for the head."""
        self._require_permitted()
        return self.tabulated_transient_pressure

    def force(self, contact: Contact) -> float:
        """Force limit [N] for a kind of contact; raises ContactNotPermitted for the head."""
        return self.transient if Contact.parse(contact) is Contact.TRANSIENT else self.quasi_static

    def __str__(self) -> str:
        return f"{self.name} in {self.edition} (table version {self.version})"

    def _require_permitted(self) -> None:
        if not self.permitted:
            raise ContactNotPermitted(
                f"contact with {self.name} is not permitted (transient factor 0 in {self.edition}), "
                "so no limit and no speed follow; keep the robot from reaching it"
            )


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
    return ForceLimit(
        name=area_or_region,
        areas=tuple(area.area for area in areas),
        permitted=all(area.transient_factor > 0 for area in areas),
        tabulated_quasi_static=min(area.quasi_static_force for area in areas),
        tabulated_transient=min(area.quasi_static_force * area.transient_factor for area in areas),
        tabulated_quasi_static_pressure=min(area.quasi_static_pressure for area in areas),
        tabulated_transient_pressure=min(area.quasi_static_pressure * area.transient_factor for area in areas),
        edition=table.edition,
        source=table.source,
        version=table.version,
        sha256=table.sha256,
    )
