"""The signs by which devices and loggers say that a force is beyond their range: a lower bound, no damaged file."""

from __future__ import annotations

import math
import re

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.errors import RecordingError

OVERRANGE = 9.9e37
"""What instruments write in place of a reading beyond their range (infinity of IEEE 488.2); 9.91e37 is none."""

# As displays, bench instruments and loggers write it; a decimal sign may stand between the letters of OL.
_SIGN = re.compile(
    r"(?P<minus>[-\u2212])?[+]?\s*(?:\u221e|[o0][.,]?l[.,]?|[.,]ol|ovl?d?|ovr(?:ng)?|ovf(?:l|low)?"
    r"|#?over[a-z _-]*|[\u00fc]berlast|[\u00fc]berlauf|>+ ?[0-9.,]*)[!.]*",
    re.IGNORECASE,
)


def overrange(cell: str) -> float | None:
    """OVERRANGE, with its sign, if a cell says that the range was exceeded; None if it says anything else."""
    sign = _SIGN.fullmatch(cell.strip().strip('"').strip())
    return None if sign is None else math.copysign(OVERRANGE, -1.0 if sign["minus"] else 1.0)


def lower_bounds(force: FloatArray, device_range: float) -> tuple[FloatArray, Mask]:
    """The force with a lower bound [N] in place of infinity, shape (n,) or (n, k), and where it is one (n,).

    A force beyond the range is at least as large as any that was read, and as the device's range if that is stated.

    Raises
    ------
    RecordingError
        Nothing but such readings.
    """
    beyond: Mask = np.isinf(force)
    if not beyond.any():
        return force, np.zeros(len(force), dtype=np.bool_)
    if beyond.all():
        raise RecordingError("every reading says that the range was exceeded, expected forces")
    largest = max(float(np.abs(force[~beyond]).max()), float(np.nan_to_num(device_range)))
    return np.where(beyond, np.copysign(largest, force), force), np.asarray(beyond.reshape(len(force), -1).any(axis=1))
