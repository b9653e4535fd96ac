"""The force measuring device (PFMD)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import date

from forcemap.errors import InputError
from forcemap.files import stated_date


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
    model, calibrated, calibration_expires : str
        Name of the model; date of the last calibration, and the last date it holds, as YYYY-MM-DD.

    Raises
    ------
    InputError
        A figure that is not positive and finite (an error of 0 N is accepted), an error not below the range, or a date
        that is not one, or a calibration that expires before it was made.
    """

    range: float = math.nan
    error: float = math.nan
    stiffness: float = math.nan
    model: str = ""
    calibrated: str = ""
    calibration_expires: str = ""

    def __post_init__(self) -> None:
        for name, value, unit in (("range", self.range, "N"), ("stiffness", self.stiffness, "N/m")):
            if not (math.isnan(value) or 0 < value < math.inf):
                raise InputError(f"device {name}: found {value:g} {unit}, expected a positive finite number")
        if not (math.isnan(self.error) or 0 <= self.error < math.inf):
            raise InputError(f"device error: found {self.error:g} N, expected a finite number of at least 0")
        if self.error >= self.range:
            raise InputError(f"device error {self.error:g} N is not below its range {self.range:g} N")
        made = stated_date("device calibrated", self.calibrated) if self.calibrated else date.min
        if self.calibration_expires and stated_date("device calibration_expires", self.calibration_expires) < made:
            expected = f"expected no date before its calibration on {self.calibrated}"
            raise InputError(f"device calibration_expires: found {self.calibration_expires}, {expected}")

    @property
    def highest_limit(self) -> float:
        """Largest force limit the device can confirm: range less error [N]; NaN if the range is not stated."""
        return self.range - self.error_or_default

    @property
    def error_or_default(self) -> float:
        """The stated error [N], else 3 N, that of the paper's device (section IV-B)."""
        return 3.0 if math.isnan(self.error) else self.error

    @property
    def calibration_stated(self) -> bool:
        """True if the date of the calibration or the date it expires is stated."""
        return bool(self.calibrated or self.calibration_expires)

    def expired(self, on: str) -> bool:
        """True if the calibration had run out on a date; False if no date of it is stated.

        It holds up to and on `calibration_expires`, or the day one year after `calibrated` where that is not stated.

        Parameters
        ----------
        on : str
            The date of the measurement, YYYY-MM-DD.

        Raises
        ------
        InputError
            Not a date.
        """
        day = stated_date("date of the measurement", on)
        if self.calibration_expires:
            return day > stated_date("device calibration_expires", self.calibration_expires)
        return bool(self.calibrated) and day > _a_year_after(stated_date("device calibrated", self.calibrated))


def _a_year_after(day: date) -> date:
    if day.year == date.max.year:
        return date.max
    # 29 February has no anniversary in a common year: the day before holds, not the day after
    leap_day = (day.month, day.day) == (2, 29)
    return day.replace(year=day.year + 1, day=28 if leap_day else day.day)
