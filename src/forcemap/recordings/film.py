"""The film or array that measures the pressure, and how its cells make one figure of an impact."""

from __future__ import annotations

import math
from dataclasses import dataclass

from forcemap.errors import InputError

DEFAULT_FILM_ERROR = 0.10
"""Error of a film that does not state it, as a share of the reading: what makers of pressure films commonly state."""

LARGEST_AREA = 1.0
"""Largest area to take a mean over [cm^2]."""


@dataclass(frozen=True)
class Film:
    """A film or an array of cells that measures pressure; NaN or an empty text is "not stated".

    Parameters
    ----------
    sensor : str
        Name of the film or array.
    range : float
        Largest pressure it can measure [N/cm^2].
    least : float
        Smallest pressure it shows [N/cm^2]; cells below count as this much.
    error : float
        Largest error, as a share of the reading: 0.1 for 10 %.
    mean_over : float
        Area over which the largest mean is taken [cm^2], at most 1; 0 for the largest cell.
    unit : str
        Unit in which its exports are written, where these do not state it.
    pitch : float
        Distance between its cells [m], where the exports do not state it.

    Raises
    ------
    InputError
        A range that is not positive and finite, a smallest pressure that is not below it, an error that is no share
        below 1, or an area outside its range.
    """

    sensor: str = ""
    range: float = math.nan
    least: float = math.nan
    error: float = math.nan
    mean_over: float = math.nan
    unit: str = ""
    pitch: float = math.nan

    def __post_init__(self) -> None:
        if not (math.isnan(self.range) or 0 < self.range < math.inf):
            raise InputError(f"pressure range: found {self.range:g} N/cm^2, expected a positive finite number")
        if not (math.isnan(self.least) or 0 <= self.least < math.inf) or self.least >= self.range:
            raise InputError(f"smallest pressure: found {self.least:g} N/cm^2, expected at least 0 and below the range")
        if not (math.isnan(self.error) or 0 <= self.error < 1):
            raise InputError(f"pressure error: found {self.error:g}, expected a share from 0 to below 1 (0.1 is 10 %)")
        if not (math.isnan(self.pitch) or 0 < self.pitch < math.inf):
            raise InputError(f"pressure pitch: found {self.pitch:g} m, expected a positive finite number")
        if not (math.isnan(self.mean_over) or 0 <= self.mean_over <= LARGEST_AREA):
            expected = f"expected 0 (the largest cell) to {LARGEST_AREA:g} cm^2"
            raise InputError(f"pressure averaging: found {self.mean_over:g} cm^2, {expected}")

    @property
    def error_or_default(self) -> float:
        """The stated error as a share of the reading, else `DEFAULT_FILM_ERROR`."""
        return DEFAULT_FILM_ERROR if math.isnan(self.error) else self.error
