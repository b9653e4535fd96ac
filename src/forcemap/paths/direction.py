"""Directions of motion in words, as campaigns and tasks state them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcemap.errors import InputError

FloatArray = NDArray[np.float64]

_DOWN = ("down", "downward", "downwards", "vertically down", "straight down", "-z", "0,0,-1")


def direction_vector(words: str, *, whose: str) -> FloatArray:
    """Unit vector in the frame of the base of a direction in words, shape (3,).

    Raises
    ------
    InputError
        No direction is stated, or one that is not known to be downward, so that no motion can be compared with it.
    """
    found = " ".join(words.lower().split()).replace(", ", ",")
    if found in _DOWN:
        return np.array([0.0, 0.0, -1.0])
    if not found:
        raise InputError(
            f"direction: {whose} does not state it, so it cannot be known whether the map holds for a motion; "
            'write direction = "down" under [contact] in campaign.toml if the impacts were measured so'
        )
    raise InputError(
        f"direction: {whose} states {words!r}, expected 'down': heights and distances of a motion in another direction "
        "are not those of a collision-force map"
    )
