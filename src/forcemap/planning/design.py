"""Designs: which states of a range are measured; the values along each axis, checked."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from forcemap.campaigns.columns import likely_unit
from forcemap.campaigns.state import PLACE_SIZE
from forcemap.errors import InputError

_SAME_ANGLE = 1.0  # [deg], as in campaigns.repeatability


class Design(StrEnum):
    """Which states are measured; but for SPREAD and I_OPTIMAL as in the paper, section IV-C."""

    SPREAD = "spread"
    PAPER = "paper"
    FULL_GRID = "full-grid"
    SYMMETRY = "symmetry"
    I_OPTIMAL = "i-optimal"


# Values a range (lowest, highest) is divided into, and the fewest values that tell the map's squares.
DIVISIONS = {Design.SPREAD: 0, Design.PAPER: 3, Design.FULL_GRID: 5, Design.SYMMETRY: 0, Design.I_OPTIMAL: 9}
FEWEST = {Design.SPREAD: 2, Design.PAPER: 3, Design.FULL_GRID: 4, Design.SYMMETRY: 1, Design.I_OPTIMAL: 3}


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
    for value in given[~((given > above) & (np.abs(given) <= 10))][:1]:
        unit = likely_unit(value, "m/s" if name == "speeds" else "m")
        raise InputError(f"{name}: found {value:g}, expected {expected}{unit}")
    if design is Design.SPREAD and given.size != 2:
        values = f"{given.size} value{'s' * (given.size != 1)}"
        raise InputError(f"{name}: found {values}, give the lowest and highest, or --design paper")
    if given.size == 2 and DIVISIONS[design]:
        closest = max(apart, PLACE_SIZE) if design is Design.I_OPTIMAL and name != "speeds" else apart
        fit = int((given[1] - given[0]) / (closest + 0.001)) + 1  # values are rounded to 0.001
        between = np.linspace(given[0], given[1], max(min(DIVISIONS[design], fit), FEWEST[design]))[1:-1]
        given = np.array([given[0], *np.round(between, 3), given[1]])
    if given.size < FEWEST[design]:
        fewest = f"at least {FEWEST[design]} values" if given.size else "at least one"
        raise InputError(f"{name}: found {given.size}, expected (lowest, highest) or {fewest}")
    gaps = np.diff(given)
    if np.any(gaps <= apart * (1 + 1e-9)):
        i = int(gaps.argmin())
        raise InputError(
            f"{name}: found {given[i]:g} and {given[i + 1]:g}, expected values more than {apart:g} apart: "
            "closer ones count as repeats of one state; widen the range or lower the tolerance"
        )
    return [float(value) for value in given]


def angles_of(base_angles: Sequence[float], design: Design) -> list[float]:
    """The angles of the base joint [deg]; NaN where none is stated."""
    angles = [float(angle) for angle in base_angles]
    for angle in angles:
        if not abs(angle) <= 3600:
            raise InputError(f"base angles: found {angle:g}, expected degrees from -3600 to 3600")
    if design is not Design.SYMMETRY:
        if len(angles) > 1:
            raise InputError(f"base angles: found {len(angles)}, expected at most one; several are --design symmetry")
        return angles or [math.nan]
    if len(angles) < 2:
        raise InputError(f"base angles: found {len(angles)}, expected at least two for --design symmetry")
    for one, other in itertools.combinations(angles, 2):
        if abs(math.remainder(one - other, 360)) <= _SAME_ANGLE:
            raise InputError(
                f"base angles: found {one:g} and {other:g} deg, expected more than {_SAME_ANGLE:g} between"
            )
    return sorted(angles)


def require_whole(name: str, number: int | None, least: int = 1) -> None:
    """Refuse what is no whole number of at least `least`; None is what is not stated."""
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
    """Names of values in thousandths, with as many decimals as it takes to tell them apart; no point in a file name."""
    tries = ({v: f"{letter}{1000 * v:.{n}f}".replace(".", "_") for v in values} for n in itertools.count())
    return next(names for names in tries if len(set(names.values())) == len(values))
