"""The force measuring device (PFMD)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from forcemap.errors import InputError


@dataclass(frozen=True)
class Device:
    """A force measuring device; NaN or an empty text is "not stated".

    Parameters
    ----------
    range : float
        Largest force it can measure [N].
    error : float
        Largest error of a reading [N].
    stiffness : float
        Spring constant [N/m].
    model, calibrated : str
        Name of the model; date of the last calibration as YYYY-MM-DD.

    Raises
    ------
    InputError
        A figure that is not positive and finite (an error of 0 N is accepted), or an error not below the range.
    """

    range: float = math.nan
    error: float = math.nan
    stiffness: float = math.nan
    model: str = ""
    calibrated: str = ""

    def __post_init__(self) -> None:
        for name, value, unit in (("range", self.range, "N"), ("stiffness", self.stiffness, "N/m")):
            if not (math.isnan(value) or 0 < value < math.inf):
                raise InputError(f"device {name}: found {value:g} {unit}, expected a positive finite number")
        if not (math.isnan(self.error) or 0 <= self.error < math.inf):
            raise InputError(f"device error: found {self.error:g} N, expected a finite number of at least 0")
        if self.error >= self.range:
            raise InputError(f"device error {self.error:g} N is not below its range {self.range:g} N")

    @property
    def highest_limit(self) -> float:
        """Largest force limit the device can confirm: range less error [N]; NaN if the range is not stated."""
        return self.range - self.error_or_default

    @property
    def error_or_default(self) -> float:
        """The stated error [N], else 3 N, that of the paper's device (section IV-B)."""
        return 3.0 if math.isnan(self.error) else self.error
