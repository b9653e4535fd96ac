"""Designs: which states of a range are measured; checked values along each axis."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.campaigns.columns import likely_unit
from forcemap.campaigns.state import PLACE_SIZE
from forcemap.errors import InputError

LARGEST = 10.0
"""Largest distance, height [m] and speed [m/s] of a robot beside a person; a larger figure is in another unit, as in an
impacts table."""

STEP, DECIMALS = 0.001, 3
"""Planned places [m] and speeds [m/s] are multiples of this step, but for the ends of a range: what a person types."""

_SAME_ANGLE = 1.0  # [deg], as in campaigns.repeatability
_LARGEST_ANGLE = 3600.0  # [deg]; ten turns, as in an impacts table
_FULL_TURN = 360  # [deg]
_ROUNDING = 1e-9  # share by which a gap between values has to exceed the tolerance of repeats


class Design(StrEnum):
    """Which states are measured; but for SPREAD and I_OPTIMAL as in the paper, section IV-C."""

    SPREAD = "spread"
    PAPER = "paper"
    FULL_GRID = "full-grid"
    SYMMETRY = "symmetry"
    I_OPTIMAL = "i-optimal"


DIVISIONS = {Design.SPREAD: 0, Design.PAPER: 3, Design.FULL_GRID: 5, Design.SYMMETRY: 0, Design.I_OPTIMAL: 9}
"""Number of values into which a range (lowest, highest) is divided; 0: not divided. Three are the paper's; five have a
value to test between those that train; nine are a choice, so that there is something to choose from."""

FEWEST = {Design.SPREAD: 2, Design.PAPER: 3, Design.FULL_GRID: 4, Design.SYMMETRY: 1, Design.I_OPTIMAL: 3}
"""Fewest values along an axis: three determine the map's squares, a full grid has at least one more to test."""


def axis_of(name: str, values: ArrayLike, expected: str, above: float, design: Design, apart: float) -> list[float]:
    """The values to measure along an axis, ascending."""
    if np.ma.is_masked(values):
        raise InputError(f"{name}: found masked entries, expected {expected}")
    try:
        given = np.sort(np.atleast_1d(np.asarray(values, dtype=np.float64)))
    except (TypeError, ValueError):
        raise InputError(f"{name}: found {values!r}, expected {expected}") from None
    if given.ndim != 1:
        raise InputError(f"{name}: found an array of shape {given.shape}, expected a row of values, {expected}")
    for value in given[~((given > above) & (np.abs(given) <= LARGEST))][:1]:
        unit = likely_unit(value, "m/s" if name == "speeds" else "m")
        raise InputError(f"{name}: found {value:g}, expected {expected}{unit}")
    if design is Design.SPREAD and given.size != 2:
        values = f"{given.size} value{'s' * (given.size != 1)}"
        raise InputError(f"{name}: found {values}, give the lowest and highest, or --design paper")
    if given.size == 2 and DIVISIONS[design]:
        closest = max(apart, PLACE_SIZE) if design is Design.I_OPTIMAL and name != "speeds" else apart
        fit = int((given[1] - given[0]) / (closest + STEP)) + 1
        between = np.linspace(given[0], given[1], max(min(DIVISIONS[design], fit), FEWEST[design]))[1:-1]
        given = np.array([given[0], *np.round(between, DECIMALS), given[1]])
    if given.size < FEWEST[design]:
        fewest = f"at least {FEWEST[design]} values" if given.size else "at least one"
        raise InputError(f"{name}: found {given.size}, expected (lowest, highest) or {fewest}")
    gaps = np.diff(given)
    if np.any(gaps <= apart * (1 + _ROUNDING)):
        i = int(gaps.argmin())
        raise InputError(
            f"{name}: found {given[i]:g} and {given[i + 1]:g}, expected values more than {apart:g} apart: "
            "closer ones count as repeats of one state; widen the range or lower the tolerance"
        )
    return [float(value) for value in given]


def floored(metres: Any) -> Any:
    """Lengths [m] as multiples of `STEP`, not above what they are."""
    return np.round(np.floor(metres / STEP) * STEP, DECIMALS)


def heights_within(
    distances: tuple[float, float], heights: tuple[float, float], reach: float, room: float
) -> tuple[float, float]:
    """The heights [m] at which there is `room` [m] beyond the lowest distance within reach; (0, 0) if at none."""
    if math.isinf(reach):
        return heights
    highest = floored(math.sqrt(max(reach**2 - (distances[0] + room) ** 2, 0.0)))
    lowest, highest = max(heights[0], -highest), min(heights[1], highest)
    return (lowest, highest) if lowest < highest else (0.0, 0.0)


def farthest_within(distances: tuple[float, float], height: Any, reach: float) -> Any:
    """The highest distance within reach at heights [m]."""
    return np.minimum(distances[1], floored(np.sqrt(reach**2 - np.square(height))))


def angles_of(base_angles: Sequence[float], design: Design) -> list[float]:
    """The angles of the base joint [deg]; NaN where none is stated."""
    angles = [float(angle) for angle in base_angles]
    for angle in angles:
        if not abs(angle) <= _LARGEST_ANGLE:
            expected = f"degrees from {-_LARGEST_ANGLE:g} to {_LARGEST_ANGLE:g}"
            raise InputError(f"base angles: found {angle:g}, expected {expected}")
    if design is not Design.SYMMETRY:
        if len(angles) > 1:
            raise InputError(f"base angles: found {len(angles)}, expected at most one; several are --design symmetry")
        return angles or [math.nan]
    if len(angles) < 2:
        raise InputError(f"base angles: found {len(angles)}, expected at least two for --design symmetry")
    for one, other in itertools.combinations(angles, 2):
        if abs(math.remainder(one - other, _FULL_TURN)) <= _SAME_ANGLE:
            raise InputError(
                f"base angles: found {one:g} and {other:g} deg, expected more than {_SAME_ANGLE:g} between"
            )
    return sorted(angles)


def require_whole(name: str, number: int | None, least: int = 1) -> None:
    """Refuse a number that is not whole or below `least`; None means not stated."""
    if number is not None and (isinstance(number, bool) or not isinstance(number, int | np.integer) or number < least):
        raise InputError(f"{name}: found {number!r}, expected a whole number of at least {least}")


def check_limit(limit: float, highest: float) -> None:
    """Refuse a limit above the highest that a device can confirm [N]."""
    if limit > highest:
        raise InputError(
            f"limit: found {limit:g} N, expected at most {highest:g} N, the device's range less its error: "
            "this device cannot confirm it"
        )


def names_of(letter: str, values: list[float]) -> dict[float, str]:
    """Names of values in thousandths, with as many decimals as they need to differ, without a point for file names."""
    tries = ({v: f"{letter}{1000 * v:.{n}f}".replace(".", "_") for v in values} for n in itertools.count())
    return next(names for names in tries if len(set(names.values())) == len(values))
