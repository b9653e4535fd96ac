"""What a fixed device's reading may be where the contact is another: a model estimate, never a permission.

The contact model of the standard (A.3.4): the reading F on a spring k shows twice the energy F^2 / k = m_R v^2 of the
effective robot mass m_R. In another contact, with a body part of mass m_H on a spring k' and a cover (k_c, d_c),

    F'^2 / k' + min(F'^2 / k_c, k_c d_c^2) = (F^2 / k) mu / m_R,   mu = (1 / (m_R + dm_L) + 1 / m_H)^-1

For a body part that is free to move, and nothing else, this is F_free = F sqrt(mu / m_R). Whatever the robot is, as
long as its contact point is never faster than v, a free body part gets no more than v sqrt(k' m_H): the model's
m_R = infinity. That a fixed device's reading can be turned into that of a movable one by a model: Herbster, Behrens and
Elkmann, A New Conversion Method to Evaluate the Hazard Potential of Collaborative Robots in Free Collisions, doi
10.1007/978-3-030-71151-1_20; the formula here is the standard's, not theirs. Conditions, and how far the lab is from
it: docs/estimates.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.limits.covers import Cover
from forcemap.limits.pfl import LEAST_STIFFNESS

# Beyond these a figure is in another unit, and the estimate could come out too low; choices.
_LARGEST_FORCE = 1e5  # [N]
_SPEEDS = (0.01, 10.0)  # [m/s]
_ROBOT_MASSES = (0.5, 2000.0)  # [kg]; a slow robot that pushes on shows some hundred
_BODY_MASSES = (0.1, 200.0)  # [kg]


class Altered(StrEnum):
    """What is other than where the device was, and by which robot mass it is reckoned."""

    FREE_BY_READING = "free_by_reading"
    FREE_BY_MASS = "free_by_mass"
    COVER = "cover"
    PAYLOAD = "payload"
    SOFTER_SPRING = "softer_spring"
    STIFFER_SPRING = "stiffer_spring"


LAB_RATIOS = {
    Altered.FREE_BY_READING: (0.48, 1.14),
    Altered.FREE_BY_MASS: (0.15, 1.43),
    Altered.COVER: (0.55, 10.2),
    Altered.PAYLOAD: (0.38, 2.36),
    Altered.SOFTER_SPRING: (0.71, 7.61),
    Altered.STIFFER_SPRING: (0.12, 1.40),
}
"""Simulated force over the estimate, lowest and highest in the virtual lab (docs/estimates.md)."""

LAB_STATES = {
    "speed": (0.1, 0.6),
    "spring": (10e3, 150e3),
    "body_mass": (0.3, 75.0),
    "payload": (1.0, 5.0),
    "cover": (5e3, 100e3),
}
"""Where the lab was looked at [m/s], [N/m], [kg], [kg], [N/m]; elsewhere no error is stated. Slower impacts were looked
at, too: there the first peak is no measure of what follows."""


@dataclass(frozen=True)
class Reading:
    """A force on a fixed device.

    Parameters
    ----------
    force : float
        The peak [N].
    stiffness : float
        Spring constant of the device [N/m].
    speed : float
        Speed at contact [m/s]; NaN if not known.
    largest : float
        The largest force of the whole contact [N]; NaN if not known, as of a map, which has the peaks of Phase I.

    Raises
    ------
    InputError
        A figure outside its range.
    """

    force: float
    stiffness: float
    speed: float = math.nan
    largest: float = math.nan

    def __post_init__(self) -> None:
        _require("force", self.force, (0.0, _LARGEST_FORCE), "N")
        _require("spring of the device", self.stiffness, (LEAST_STIFFNESS, math.inf), "N/m (75 N/mm is 75000)")
        if not math.isnan(self.speed):
            _require("speed", self.speed, _SPEEDS, "m/s")
        if self.largest < self.force:
            raise InputError(f"largest force: found {self.largest:g} N, expected at least the peak, {self.force:g} N")

    @property
    def robot_mass(self) -> float:
        """Effective robot mass that the reading itself shows, (F / v)^2 / k [kg]; NaN without the speed."""
        return (self.force / self.speed) ** 2 / self.stiffness


@dataclass(frozen=True)
class OtherContact:
    """What is other than where the device was.

    Parameters
    ----------
    body_mass : float
        Effective mass m_H of a body part that is free to move [kg]; infinite if it is held.
    stiffness : float
        Spring constant of the body part [N/m]; NaN: that of the device.
    payload_change : float
        What the effective payload is more, or less, than it was [kg].
    cover : Cover or None
        A protective cover that was not there.

    Raises
    ------
    InputError
        A figure outside its range, or nothing is other.
    """

    body_mass: float = math.inf
    stiffness: float = math.nan
    payload_change: float = 0.0
    cover: Cover | None = None

    def __post_init__(self) -> None:
        if self.body_mass != math.inf:
            _require("body mass", self.body_mass, _BODY_MASSES, "kg")
        if not math.isnan(self.stiffness):
            _require("spring of the body part", self.stiffness, (LEAST_STIFFNESS, math.inf), "N/m (75 N/mm is 75000)")
        if not abs(self.payload_change) <= _BODY_MASSES[1]:
            raise InputError(f"payload: found a change of {self.payload_change:g} kg, expected kilograms")

    @property
    def free(self) -> bool:
        """True if the body part is free to move."""
        return self.body_mass < math.inf


@dataclass(frozen=True)
class ForceEstimate:
    """What the contact model expects of a reading in another contact; nothing of it was measured.

    Parameters
    ----------
    robot_mass : tuple of float
        Bounds of the effective robot mass that it is reckoned by [kg].
    lowest, highest : float
        Estimated force, by these bounds [N].
    lab_lowest, lab_highest : float
        What the error found in the virtual lab makes of them [N]; NaN where several things are other at once, or
        the lab was not looked at.
    at_most : float
        For a free body part: what no robot mass takes the model above [N]; NaN if neither the speed nor the largest
        force of the contact is known, and for a body part that is held.
    bottoms_out : bool
        True if a cover is compressed fully before the highest estimate is reached.
    findings : tuple of Finding
        First that it is an estimate; then by which formula, on which conditions, and how far the lab is from it.
    """

    robot_mass: tuple[float, float]
    lowest: float
    highest: float
    lab_lowest: float
    lab_highest: float
    at_most: float
    bottoms_out: bool
    findings: tuple[Finding, ...]


def estimate_force(
    reading: Reading, other: OtherContact, *, robot_mass: tuple[float, float] | None = None
) -> ForceEstimate:
    """Estimate by the contact model what a fixed device's reading would be in another contact.

    Parameters
    ----------
    reading : Reading
        The reading.
    other : OtherContact
        What is other.
    robot_mass : tuple of float, optional
        Lower and upper bound of the effective robot mass along the direction of motion, where and as the reading was
        taken [kg]; that which the reading itself shows at its speed if not given. The lower one gives the higher force.

    Returns
    -------
    ForceEstimate

    Raises
    ------
    InputError
        A mass outside its range; neither a mass nor the speed; nothing that is other; or a payload taken off that is
        more than the robot mass.

    Examples
    --------
    >>> reading = Reading(300.0, 75e3, speed=0.3, largest=300.0)
    >>> found = estimate_force(reading, OtherContact(body_mass=0.6), robot_mass=(4.0, 15.0))
    >>> round(found.lowest, 1), round(found.highest, 1), round(found.at_most, 1)
    (58.8, 108.3, 63.6)
    >>> round(estimate_force(reading, OtherContact(body_mass=0.6)).highest, 1)
    62.3
    """
    altered = _altered(reading, other, stated=robot_mass is not None)
    low, high = _robot_masses(reading, other, robot_mass)
    stiffness = reading.stiffness if math.isnan(other.stiffness) else other.stiffness
    energy = reading.force**2 / reading.stiffness
    shares = [_share_kept(mass, other) for mass in _where_extreme(low, high, other)]
    forces = [_force_of(energy * share, stiffness, other.cover) for share in (min(shares), max(shares))]
    alone = len(altered) == 1 and _looked_at(reading, other, stiffness, forces[1])
    ratios = LAB_RATIOS[altered[0]] if alone else (math.nan, math.nan)
    return ForceEstimate(
        robot_mass=(low, high),
        lowest=forces[0],
        highest=forces[1],
        lab_lowest=forces[0] * ratios[0],
        lab_highest=forces[1] * ratios[1],
        at_most=_at_most(reading, other, stiffness),
        bottoms_out=other.cover is not None and other.cover.bottoms_out(forces[1]),
        findings=(Finding.of(FindingKind.MODEL_ESTIMATE), *_conditions(altered, alone=alone)),
    )


def _altered(reading: Reading, other: OtherContact, *, stated: bool) -> list[Altered]:
    """What is other; at least one thing."""
    softer, stiffer = other.stiffness < reading.stiffness, other.stiffness > reading.stiffness
    found = {
        Altered.FREE_BY_MASS: other.free and stated,
        Altered.FREE_BY_READING: other.free and not stated,
        Altered.COVER: other.cover is not None,
        Altered.PAYLOAD: other.payload_change != 0,
        Altered.SOFTER_SPRING: softer,
        Altered.STIFFER_SPRING: stiffer,
    }
    if not any(found.values()):
        raise InputError(
            "estimate: found nothing that is other than where the device was, expected a free body part, another "
            "spring, another payload or a cover"
        )
    return [what for what, holds in found.items() if holds]


def _robot_masses(reading: Reading, other: OtherContact, stated: tuple[float, float] | None) -> tuple[float, float]:
    if stated is None and math.isnan(reading.speed):
        raise InputError(
            "effective robot mass: not stated, and without the speed the reading does not show it; state the mass or "
            "its bounds (--robot-mass-kg 4:15), or the speed (--speed-mps)"
        )
    low, high = stated or (reading.robot_mass, reading.robot_mass)
    for mass in (low, high):
        what = "effective robot mass" if stated else "effective robot mass by force, speed and spring"
        _require(what, mass, _ROBOT_MASSES, "kg")
    if low > high:
        raise InputError(f"effective robot mass: found bounds of {low:g} and {high:g} kg, expected the lower one first")
    if low + other.payload_change <= 0:
        raise InputError(
            f"payload: found {-other.payload_change:g} kg to take off an effective robot mass of {low:g} kg, which "
            "contains it"
        )
    return low, high


def _share_kept(robot_mass: float, other: OtherContact) -> float:
    """mu / m_R [1]: the share of the energy that the springs take up."""
    return 1 / (1 / (robot_mass + other.payload_change) + 1 / other.body_mass) / robot_mass


def _where_extreme(low: float, high: float, other: OtherContact) -> list[float]:
    """Masses at which mu / m_R is lowest and highest: the bounds, and where it turns if a payload is taken off."""
    less = max(-other.payload_change, 0.0)
    turns = less + math.sqrt(less * other.body_mass) if less and other.free else low
    return [low, high, min(max(turns, low), high)]


def _force_of(energy: float, stiffness: float, cover: Cover | None) -> float:
    """Force [N] at which a spring [N/m], and a cover, hold twice an energy [J]."""
    return math.sqrt(energy * stiffness) if cover is None else cover.force(energy, stiffness)


def _at_most(reading: Reading, other: OtherContact, stiffness: float) -> float:
    """Force [N] that no robot mass takes the model above: v sqrt(k m_H), and the largest one of a fixed device."""
    if not other.free:
        return math.nan
    only_free = other.cover is None and other.payload_change == 0 and stiffness == reading.stiffness
    known = [reading.speed * math.sqrt(stiffness * other.body_mass), reading.largest if only_free else math.nan]
    return min((force for force in known if not math.isnan(force)), default=math.nan)


def _looked_at(reading: Reading, other: OtherContact, stiffness: float, force: float) -> bool:
    """True if the lab was looked at there: a known speed, springs, masses and covers among those of the experiment."""
    figures = [("speed", reading.speed), ("spring", reading.stiffness), ("spring", stiffness)]
    figures += [("body_mass", other.body_mass)] if other.free else []
    figures += [("payload", abs(other.payload_change))] if other.payload_change else []
    figures += [("cover", other.cover.stiffness)] if other.cover else []
    deep = other.cover is not None and other.cover.bottoms_out(force)  # no cover of the lab does
    return not deep and all(LAB_STATES[name][0] <= value <= LAB_STATES[name][1] for name, value in figures)


def _conditions(altered: list[Altered], *, alone: bool) -> list[Finding]:
    """By which formulas, on which conditions, how far the lab is from them; first, where it cannot tell."""
    by = [
        Finding.of(FindingKind[f"ESTIMATE_{what.name}"], lowest=LAB_RATIOS[what][0], highest=LAB_RATIOS[what][1])
        for what in altered
    ]
    return by if alone else [Finding.of(FindingKind.ESTIMATE_BEYOND_LAB, together=len(altered) > 1), *by]


def _require(name: str, value: float, within: tuple[float, float], unit: str) -> None:
    least, most = within
    if not (least <= value <= most and 0 < value < math.inf):
        least_words = f"at least {least:g}" if least else "above 0"
        most_words = f"at most {most:g}" if most < math.inf else "finite"
        raise InputError(f"{name}: found {value:g}, expected {unit}, {least_words} and {most_words}")
