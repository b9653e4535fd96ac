"""Figures of a robot description in another unit than the format's m, kg, kg m^2 and rad: refused, with the likely one.

A URDF states no units. The size tells them: an arm weighs within a factor of some hundred what others of its length
weigh, no link's centre of mass lies metres beside it, and no joint turns five times around.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from forcemap.dynamics.rigid_body import Body, Frame
from forcemap.dynamics.xml_tree import Element
from forcemap.errors import InputError

# Largest figures of an arm in the format's units: choices, far above any arm's and far below the same in mm or degrees.
_LONGEST = 5.0  # from a joint to the next one, to a link's centre of mass; its radius of gyration [m]
_STROKE = 20.0  # of a sliding joint [m]
_ANGLE = 2 * math.pi + 0.01  # roll, pitch, yaw [rad]; a joint turns up to twice as far to each side
_UNLIMITED = 1e4  # limit [rad], [m] that is none: simulators write 1e16
# Mass over cubed length [kg/m^3]: of all links over the arm's length, of the middle link over its radius of gyration.
# Outside, masses are in g or t; tried on 596 chains of published descriptions (docs/decisions.md).
_LIGHTEST, _HEAVIEST = np.array([0.1, 300.0]), np.array([1500.0, 2e5])
_SHORTEST = 0.05  # a chain no longer than that [m] says nothing of the robot's size: a choice

# Of figures in another unit only the units are proposed in which they would be an arm's: choices.
_USUAL_RADIUS = (0.01, 0.5)  # radius of gyration of a link [m]
_USUAL_LENGTH = (0.002, 2.0)  # [m]

_LENGTHS = {"mm": 1e-3, "cm": 1e-2}
_INERTIAS = {  # factor on the radius of gyration
    "kg mm^2 or, with masses in g, in g mm^2": 1e-3,
    "kg cm^2 or, with masses in g, in g cm^2": 1e-2,
    "g m^2, or the mass in t": math.sqrt(1e-3),
    "g cm^2": math.sqrt(1e-7),
    "g mm^2": math.sqrt(1e-9),
}


def origin_length(element: Element, name: str, origin: Frame) -> float:
    """Distance of a joint from the one before [m].

    Raises
    ------
    InputError
        It is larger than any arm's.
    """
    length = float(np.linalg.norm(origin.position))
    if length > _LONGEST:
        raise element.refused(f"joint {name!r}: found an origin {length:g} m away, {_expected(_LONGEST, length)}")
    return length


def refuse_turns(element: Element, angles: list[float]) -> None:
    """Refuse roll, pitch and yaw that cannot be in radians."""
    if max(map(abs, angles)) > _ANGLE:
        listed = " ".join(f"{angle:g}" for angle in angles)
        raise element.refused(f"<origin rpy>: found {listed}, more than one turn in rad; is it in degrees?")


def joint_limits(limit: Element, what: str, lower: float, upper: float, *, slides: bool) -> tuple[float, float]:
    """Limits of a joint, infinite where a turning one has none [rad], [m].

    Raises
    ------
    InputError
        The limits leave no motion, or are in degrees or mm.
    """
    if not lower < upper:
        without = "" if slides else "; a joint without limits is of the type continuous"
        raise limit.refused(f"{what}: found limits from {lower:g} to {upper:g}, expected lower < upper{without}")
    furthest = max(map(abs, (lower, upper)))
    if slides and furthest > _STROKE:
        raise limit.refused(f"{what}: found a limit of {furthest:g} m, {_expected(_STROKE, furthest)}")
    if not slides and 2 * _ANGLE < furthest < _UNLIMITED:
        remedy = "is it in degrees? A joint without limits is of the type continuous"
        raise limit.refused(f"{what}: found a limit of {furthest:g} rad, more than two turns; {remedy}")
    return (lower if -lower < _UNLIMITED else -math.inf), (upper if upper < _UNLIMITED else math.inf)


def refuse_body(element: Element, what: str, body: Body) -> None:
    """Refuse a centre of mass or an inertia that no link of that mass has."""
    away = float(np.linalg.norm(body.centre_of_mass))
    if away > _LONGEST:
        raise element.refused(f"{what}: found its centre of mass {away:g} m away, {_expected(_LONGEST, away)}")
    if (radius := _radius(body)) > _LONGEST:
        units = "; or in ".join(
            unit for unit, factor in _INERTIAS.items() if _USUAL_RADIUS[0] <= radius * factor <= _USUAL_RADIUS[1]
        )
        raise element.refused(
            f"{what}: found an inertia as of its {body.mass:g} kg {radius:.3g} m from the centre of mass, expected at "
            f"most {_LONGEST:g} m; is it in {units or 'another unit'} in place of kg m^2?"
        )


def refuse_masses(bodies: Sequence[Body], length: float, file: str) -> None:
    """Refuse masses of moving links that neither an arm of that length [m] nor bodies with their inertias have."""
    moving = [body for body in bodies if body.mass > 0]
    radii = np.array([_radius(body) for body in moving])
    masses = np.array([body.mass for body in moving])
    spread = masses[radii > 0] / radii[radii > 0] ** 3  # a ball of steel has 130,000 kg/m^3
    if length < _SHORTEST:
        return
    weights = np.array([masses.sum() / length**3, *([np.median(spread)] if spread.size else [])])
    heavy, light = weights > _HEAVIEST[: weights.size], weights < _LIGHTEST[: weights.size]
    unit = "g" if heavy.all() else "t" if light.all() else ""
    if unit:
        weight = f"found {masses.sum():g} kg in links that move on an arm of {length:.3g} m"
        raise InputError(f"{weight}; are masses in {unit} in place of kg?", file=file)


def _radius(body: Body) -> float:
    """Radius of gyration about the principal axis with the largest inertia [m]."""
    return math.sqrt(max(np.linalg.eigvalsh(body.inertia)[-1], 0.0) / body.mass) if body.mass else 0.0


def _expected(most: float, stated: float) -> str:
    units = " or ".join(
        unit for unit, factor in _LENGTHS.items() if _USUAL_LENGTH[0] <= stated * factor <= _USUAL_LENGTH[1]
    )
    return f"expected at most {most:g} m; is it in {units or 'another unit'}?"
