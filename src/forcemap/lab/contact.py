"""What lies between robot and table: a damping pad on the spring of the measuring device."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError


@dataclass(frozen=True)
class ContactLayer:
    """A pad (spring and damper side by side) on the spring of the device, without mass; it can only be pushed.

    A spring in series with the pad keeps the force from jumping at contact, as a damper alone would make it.

    Parameters
    ----------
    device_stiffness : float
        Spring constant of the device [N/m].
    pad_stiffness : float
        Spring constant of the pad [N/m].
    pad_damping : float
        Damping of the pad [N s/m].

    Raises
    ------
    InputError
        A figure that is not positive and finite.
    """

    device_stiffness: float
    pad_stiffness: float
    pad_damping: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0 < value < math.inf:
                raise InputError(f"{name.replace('_', ' ')}: found {value:g}, expected a positive finite number")

    @property
    def stiffness(self) -> float:
        """Spring constant of device and pad in series [N/m]."""
        return 1 / (1 / self.device_stiffness + 1 / self.pad_stiffness)

    def force(self, depth: FloatArray, pad: FloatArray) -> FloatArray:
        """Force on the device [N] at a depth of the robot below first contact and a compression of the pad [m]."""
        return self.device_stiffness * np.maximum(depth - pad, 0.0)

    def compressed(self, depth: FloatArray, pad: FloatArray, step: float) -> FloatArray:
        """Compression of the pad [m] one time step [s] later, the depth held: exact for that."""
        touching = depth > pad
        total = self.device_stiffness + self.pad_stiffness
        rest = np.where(touching, depth * (self.device_stiffness / total), 0.0)
        in_contact = math.exp(-step * total / self.pad_damping)
        alone = math.exp(-step * self.pad_stiffness / self.pad_damping)
        return np.asarray(rest + (pad - rest) * np.where(touching, in_contact, alone))
