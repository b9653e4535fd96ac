"""The force measuring device (PFMD)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date
from typing import Any

import numpy as np

from forcemap.errors import InputError
from forcemap.files import stated_date

SOFTEST, STIFFEST = 1e3, 1e6
"""Spring constants of measuring devices [N/m]; those of the standard's body areas are 10,000 to 150,000."""
DEFAULT_ERROR = 3.0
"""Largest error of a device that does not state it [N]: that of the paper's device (section IV-B)."""


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
    pad : str
        Pad or damping on it, with its hardness.
    tried : float
        Force that it was seen to read as it was set, on the days of the measurements [N].

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
    pad: str = ""
    tried: float = math.nan

    def __post_init__(self) -> None:
        for name, value, unit in (("range", self.range, "N"), ("stiffness", self.stiffness, "N/m")):
            if not (math.isnan(value) or 0 < value < math.inf):
                raise InputError(f"device {name}: found {value:g} {unit}, expected a positive finite number")
        if not (math.isnan(self.stiffness) or SOFTEST <= self.stiffness <= STIFFEST):
            problem = f"device stiffness: found {self.stiffness:g} N/m"
            raise InputError(f"{problem}, expected {SOFTEST:g} to {STIFFEST:g} N/m (75 N/mm are 75000 N/m)")
        if not (math.isnan(self.error) or 0 <= self.error < math.inf):
            raise InputError(f"device error: found {self.error:g} N, expected a finite number of at least 0")
        if not math.isnan(self.tried) and not 0 < self.tried <= (math.inf if math.isnan(self.range) else self.range):
            expected = "expected a positive number, not above its range"
            raise InputError(f"device tried up to: found {self.tried:g} N, {expected}")
        if self.error >= self.range:
            raise InputError(f"device error {self.error:g} N is not below its range {self.range:g} N")
        calibrated = stated_date("device calibrated", self.calibrated) if self.calibrated else date.min
        if (
            self.calibration_expires
            and stated_date("device calibration_expires", self.calibration_expires) < calibrated
        ):
            expected = f"expected no date before its calibration on {self.calibrated}"
            raise InputError(f"device calibration_expires: found {self.calibration_expires}, {expected}")

    @property
    def highest_limit(self) -> float:
        """Largest force limit the device can confirm: range less error [N]; NaN if the range is not stated."""
        return self.range - self.error_or_default

    @property
    def error_or_default(self) -> float:
        """The stated error [N], else `DEFAULT_ERROR`."""
        return DEFAULT_ERROR if math.isnan(self.error) else self.error

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
        return stated_date("date of the measurement", on) > self.expires

    @property
    def expires(self) -> date:
        """The last day on which its calibration holds; the last of all where no date is stated."""
        if self.calibration_expires:
            return stated_date("device calibration_expires", self.calibration_expires)
        calibrated = stated_date("device calibrated", self.calibrated) if self.calibrated else date.max
        return _a_year_after(calibrated)

    def calibrated_as(self, other: Device) -> Device:
        """The same with another one's dates of calibration."""
        return replace(self, calibrated=other.calibrated, calibration_expires=other.calibration_expires)

    @classmethod
    def weakest(cls, devices: Sequence[Device]) -> Device:
        """What several devices are good for together: the softest spring, the lowest range, the largest error.

        What one of them does not state counts as not stated.
        """
        if len({*devices}) == 1:
            return devices[0]
        first = min(devices, key=lambda device: device.expires)
        texts = {name: dict.fromkeys(getattr(device, name) for device in devices) for name in ("model", "pad")}
        joined: dict[str, Any] = {
            name: "; ".join(text or "not stated" for text in stated) for name, stated in texts.items() if any(stated)
        }
        return cls(
            range=float(np.min([device.range for device in devices])),
            error=max(device.error_or_default for device in devices),
            stiffness=float(np.min([device.stiffness for device in devices])),
            tried=math.nan if any(math.isnan(each.tried) for each in devices) else min(each.tried for each in devices),
            calibrated=first.calibrated,
            calibration_expires=first.calibration_expires,
            **joined,
        )


def _a_year_after(day: date) -> date:
    if day.year == date.max.year:
        return date.max
    # 29 February has no anniversary in a common year: the day before holds, not the day after
    leap_day = (day.month, day.day) == (2, 29)
    return day.replace(year=day.year + 1, day=28 if leap_day else day.day)
