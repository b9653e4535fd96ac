"""What is measured of an impact and held against a limit: a force, a pressure, the force that goes on."""

from __future__ import annotations

from enum import StrEnum


class Quantity(StrEnum):
    """A quantity of which a map can be fitted; every one has the same terms, bound, places and accuracy."""

    FORCE = "force"
    PRESSURE = "pressure"
    CLAMPING_FORCE = "clamping_force"

    @property
    def unit(self) -> str:
        """The unit of its column, its map and its bound."""
        return "N/cm^2" if self is Quantity.PRESSURE else "N"

    @property
    def column(self) -> str:
        """Its column in the impacts table."""
        return _COLUMNS[self]

    @property
    def words(self) -> str:
        """Its name in the field's words."""
        return _WORDS[self]


LEAST = 1.0
"""Smaller values, in the unit of the quantity, are none: a force or pressure as small is noise around nothing."""

_COLUMNS = {
    Quantity.FORCE: "peak_force_N",
    Quantity.PRESSURE: "peak_pressure_N_per_cm2",
    Quantity.CLAMPING_FORCE: "phase2_force_N",
}
_WORDS = {
    Quantity.FORCE: "peak force",
    Quantity.PRESSURE: "peak pressure",
    Quantity.CLAMPING_FORCE: "clamping force",
}
