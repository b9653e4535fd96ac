"""The direction a map holds for: that of the motion its impacts were measured in, and a few degrees around it."""

from __future__ import annotations

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError

WIDEST_ANGLE = 5.0
"""How far a motion may point away from the map's direction [deg]; beyond it nothing was measured. Tried in the virtual
lab (docs/validity.md, "Motion beside the map's direction")."""

RAISED_OFF_AXIS = 1.14
"""Factor on the bound for a motion off the map's direction. In the virtual lab an impact 5 degrees off has up to 1.12
times the force of one along the direction, 10 degrees 1.24, 15 degrees 1.38 and 30 degrees 1.93 times."""

ON_AXIS = 0.01
"""A motion that points away by no more than this [deg] counts as along the direction: rounded positions of a path turn
its pieces by as much."""

DOWN = ("down", "downward", "downwards", "vertically down", "straight down", "-z", "0,0,-1")
"""Words for straight down, as they are known."""


def direction_vector(words: str, *, whose: str) -> FloatArray:
    """Unit vector, in the frame of the base, of a direction stated in words, shape (3,).

    Raises
    ------
    InputError
        No direction is stated, or one that is not known to be downward, so that no motion can be compared with it.
    """
    direction = " ".join(words.lower().split()).replace(", ", ",")
    if direction in DOWN:
        return np.array([0.0, 0.0, -1.0])
    if not direction:
        raise InputError(
            f"direction: {whose} does not state it, so it cannot be known whether the map holds for a motion; "
            'write direction = "down" under [contact] in campaign.toml if the impacts were measured so'
        )
    raise InputError(
        f"direction: {whose} states {words!r}, expected 'down': heights and distances of a motion in another direction "
        "are not those of a collision-force map"
    )


def raised_off_axis(angle: float) -> float:
    """Factor on the bound for a motion `angle` [deg] away from the map's direction: 1 along it, else 1.14.

    Raises
    ------
    InputError
        An angle for which nothing was measured.
    """
    if not 0 <= angle <= WIDEST_ANGLE:
        raise InputError(
            f"angle: found {angle:g} degrees, expected from 0 to {WIDEST_ANGLE:g}; a motion that points farther away "
            "from the map's direction is another one, for which nothing was measured"
        )
    return RAISED_OFF_AXIS if angle > ON_AXIS else 1.0
