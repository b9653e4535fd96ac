"""The direction a map holds for: that of the motion its impacts were measured in, and a few degrees around it."""

from __future__ import annotations

import itertools
import math

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError

WIDEST_ANGLE = 5.0
"""How far a motion may point away from the map's direction [deg]; beyond it nothing was measured. Tried in the virtual
lab (docs/validity.md, "Motion beside the map's direction")."""

RAISED_OFF_AXIS = 1.14
"""Factor on the bound for a motion off the map's direction. In the virtual lab an impact 5 degrees off has up to 1.12
times the force of one along the direction, 10 degrees 1.24, 15 degrees 1.38 and 30 degrees 1.93 times."""

RAISED_FROM = 0.2
"""Slowest speed at which that factor was tried [m/s]."""

RAISED_SLOWER = 1.5
"""Factor that a single impact 5 degrees off may have below that speed, where a robot just notices an impact or just
misses it: 1.48 at 0.15 m/s in the virtual lab (docs/validity.md)."""

ON_AXIS = 0.01
"""A motion that points away by no more than this [deg] counts as along the direction: rounded positions of a path turn
its pieces by as much."""

AXES = {
    "down": (0.0, 0.0, -1.0),
    "up": (0.0, 0.0, 1.0),
    "out": (1.0, 0.0, 0.0),
    "in": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
}
"""The directions with a name, in the cylinder around the base: away from its z-axis, counterclockwise around it seen
from above, up."""

_SPELLED = {
    "downward": "down", "downwards": "down", "vertically down": "down", "straight down": "down", "-z": "down",
    "upward": "up", "upwards": "up", "vertically up": "up", "straight up": "up", "+z": "up",
    "outward": "out", "outwards": "out", "away from the base": "out",
    "inward": "in", "inwards": "in", "towards the base": "in",
}  # fmt: skip
_SHARP = 1e-3  # [deg]; directions this close are one


def direction_vector(words: str, *, whose: str) -> FloatArray:
    """Unit vector of a direction stated in words, in the cylinder around the base at the contact, shape (3,).

    Its components point away from the base's z-axis, counterclockwise around it seen from above, and up. Words are
    `down`, `up`, `out`, `in`, `left` (counterclockwise), `right`; two or three of them, as `down and out`, are the
    diagonal between them; or the three components, as `0.6,0,-0.8`.

    Raises
    ------
    InputError
        No direction is stated, or one that is none of these, so that no motion can be compared with it.
    """
    text = " ".join(words.lower().split()).replace(", ", ",")
    if not text:
        raise InputError(
            f"direction: {whose} does not state it, so it cannot be known whether the map holds for a motion; "
            'write direction = "down" under [contact] in campaign.toml if the impacts were measured so, and '
            "fit a map file again"
        )
    parts = [_SPELLED.get(part, part) for part in text.split(" and ")]
    if all(part in AXES for part in parts):
        vector = np.sum([AXES[part] for part in parts], axis=0)
        if np.count_nonzero(vector) == len(parts):
            return np.asarray(vector / np.linalg.norm(vector))
    elif (vector := _components(text)) is not None:
        return vector
    raise InputError(
        f"direction: {whose} states {words!r}, expected one of {', '.join(AXES)}, two or three of them such as "
        "'down and out', or three components (away from the base, counterclockwise around it, up) such as 0.6,0,-0.8"
    )


def _components(text: str) -> FloatArray | None:
    """Three finite numbers between commas as a unit vector; None if the text is something else."""
    try:
        vector = np.array([float(part) for part in text.split(",")])
    except ValueError:
        return None
    length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
    return np.asarray(vector / length) if 0 < length < math.inf else None


def direction_words(vector: FloatArray) -> str:
    """The name of a unit vector in the cylinder around the base: of an axis, of a diagonal, else its components."""
    for name, known in DIRECTIONS.items():
        if angle_between(vector, known) < _SHARP:
            return name
    return ",".join(f"{round(x, 3) + 0.0:g}" for x in vector.tolist())


def angle_between(one: FloatArray, other: FloatArray) -> float:
    """Angle between two unit vectors, shape (3,) [deg]."""
    return float(np.degrees(2 * np.arctan2(np.linalg.norm(one - other), np.linalg.norm(one + other))))


def same_direction(one: str, other: str, *, within: float = ON_AXIS) -> bool:
    """True if two texts state the same direction, in the same words or as `direction_vector` knows them, up to an angle
    [deg]: what was measured `WIDEST_ANGLE` off speaks against speeds that hold as far off."""
    words = [" ".join(text.lower().split()) for text in (one, other)]
    try:
        return angle_between(*(direction_vector(text, whose="a campaign") for text in words)) <= within
    except InputError:
        return words[0] == words[1]


def _named() -> dict[str, FloatArray]:
    axes = [("down", "up"), ("out", "in"), ("left", "right")]
    diagonals = [
        chosen for n in (2, 3) for pairs in itertools.combinations(axes, n) for chosen in itertools.product(*pairs)
    ]
    names = [*AXES, *(" and ".join(chosen) for chosen in diagonals)]
    return {name: direction_vector(name, whose="this table") for name in names}


DIRECTIONS = _named()
"""Unit vectors of the six directions with a name and the 20 diagonals between them."""


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
