"""How far a robot may deviate from its program."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind

OVERSHOOT = 0.01
"""How much faster than programmed a robot may be, unless stated [m/s]; a guess (docs/decisions.md)."""

POSITION_TOLERANCE = 0.005
"""How far a robot may be from where it is programmed to be, unless stated [m]; a guess (docs/decisions.md)."""


@dataclass(frozen=True)
class Allowance:
    """How far a robot may deviate from its program; the same for commands, exports, paths, page and report.

    The speed is subtracted from the speed at contact wherever a speed to program is given; zones and paths are widened
    by the position.

    Parameters
    ----------
    speed : float
        How much faster than programmed it may be [m/s].
    position : float
        How far it may be from where it is programmed to be [m].

    Raises
    ------
    InputError
        A figure that is negative or not finite.
    """

    speed: float = OVERSHOOT
    position: float = POSITION_TOLERANCE

    def __post_init__(self) -> None:
        for name, value in (("speed overshoot", self.speed), ("position tolerance", self.position)):
            if not 0 <= value < np.inf:
                raise InputError(f"{name}: found {value:g}, expected a finite number of at least 0")

    def off(self, speed: FloatArray) -> FloatArray:
        """Speeds to program [m/s]: speeds at contact less the overshoot, so that the sum never exceeds them."""
        slower = speed - self.speed
        return np.where(slower + self.speed > speed, np.nextafter(slower, -np.inf), slower)  # the sum is rounded

    @property
    def of_speed(self) -> Finding:
        """The overshoot that is subtracted from speeds at contact."""
        return Finding.of(FindingKind.OVERSHOOT, overshoot_mps=self.speed)

    @property
    def of_position(self) -> Finding:
        """The tolerance by which zones and paths are widened."""
        return Finding.of(FindingKind.POSITION_TOLERANCE, position_m=self.position)
