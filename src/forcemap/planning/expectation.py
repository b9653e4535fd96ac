"""The force to expect at a state before it is measured; used only to plan."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.conditions import Conditions
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.limits.pfl import pfl_contact_force, pfl_robot_mass
from forcemap.maps.bounds import PAPER_MARGIN
from forcemap.maps.force_map import ForceMap

STANDARD_FACTOR = 2.0
"""Factor on the contact model's force: the published maps predict up to 1.88 times as much on their own grids."""

REST_FORCE = 190.0
"""Force at rest [N] that the contact model lacks: continued to rest, the published maps give 38 to 184 N."""

MAP_FACTOR = 1 + PAPER_MARGIN
"""Factor on the force of a map."""

PAPER_STIFFNESS = 75e3
"""Spring constant of the paper's device [N/m], taken where none is stated."""

_SPEEDS = 17  # sampled up to the fastest measured speed, and as many above it; a choice


@dataclass(frozen=True)
class StandardExpectation:
    """Forces to expect by the standard's contact model; a coarse guess, used only to plan.

    Parameters
    ----------
    moving_mass : float
        Total mass M of the moving parts of the robot [kg].
    payload : float
        Effective payload m_L [kg]; NaN if it is not stated, which counts as 0.
    stiffness : float
        Spring constant [N/m]; that of the paper's device.
    body_mass : float
        Effective mass of the body region [kg]; infinite: a device held in place.
    """

    moving_mass: float
    payload: float = math.nan
    stiffness: float = PAPER_STIFFNESS
    body_mass: float = math.inf

    @classmethod
    def of(cls, conditions: Conditions) -> Self | None:
        """From the masses and the device that a campaign states; None if it states no moving mass."""
        if math.isnan(conditions.moving_mass):
            return None
        stiffness = conditions.device.stiffness
        return cls(conditions.moving_mass, conditions.payload, cls.stiffness if math.isnan(stiffness) else stiffness)

    def __call__(self, distance: float, height: float, speed: float) -> float:
        """Force [N] at a speed [m/s]; the same at every place [m]."""
        return float(self.forces(np.array(speed)))

    def forces(self, speed: FloatArray) -> FloatArray:
        """Force [N] at speeds [m/s]."""
        mass = pfl_robot_mass(self.moving_mass, 0.0 if math.isnan(self.payload) else self.payload)
        force = pfl_contact_force(speed, robot_mass=mass, body_mass=self.body_mass, stiffness=self.stiffness)
        return np.asarray(force)


Expectation = ForceMap | StandardExpectation | Callable[[float, float, float], float]
"""Source of the force to expect [N] at (distance [m], height [m], speed [m/s])."""


def expected_forces(expectation: Expectation | None, states: FloatArray) -> FloatArray:
    """Expected force [N] of states, shape (n, 3); that of a map is `never_falling` from its measured speeds up.

    A function is taken as it is, since the speeds it holds for are unknown. NaN without an expectation.
    """
    if expectation is None:
        return np.full(len(states), math.nan)
    if isinstance(expectation, ForceMap):
        measured = expectation.measured_range
        low, top = measured.speeds(states[:, 0], states[:, 1])
        low, top = (np.where(np.isnan(v), end[2], v) for v, end in ((low, measured.lowest), (top, measured.highest)))
        force = never_falling(lambda points: np.asarray(expectation.predict(*points.T)), states, low, top)
    elif isinstance(expectation, StandardExpectation):
        force = expectation.forces(states[:, 2])
    else:
        force = np.array([float(expectation(*state)) for state in states.tolist()])
    for i in np.flatnonzero(~((force > 0) & (force < math.inf)))[:1]:
        distance, height, speed = states[i]
        place = f"d = {distance:g} m, h = {height:g} m, v = {speed:g} m/s"
        raise InputError(f"expected force: found {force[i]:g} N at {place}, expected newtons above 0 and finite")
    return force


def never_falling(
    force: Callable[[FloatArray], FloatArray], states: FloatArray, low: FloatArray, top: FloatArray
) -> FloatArray:
    """A force [N] of states, shape (n, 3), that does not fall with speed even where a map does.

    It is the largest value from the lowest speed measured at the place up to the state's speed. Above the fastest
    measured speed it is at least the largest value up to there, increased in proportion to speed.

    Parameters
    ----------
    force : callable
        Force [N] of states, shape (k, 3).
    states : array (n, 3)
        (distance, height, speed) [m, m, m/s].
    low, top : array (n,)
        Lowest and fastest speed measured at the place [m/s].
    """
    speed = states[:, 2]
    slowest, known = np.minimum(low, speed), np.minimum(top, speed)
    up_to_top = np.linspace(slowest, known, _SPEEDS, axis=1)
    speeds = np.hstack([up_to_top, np.linspace(known, speed, _SPEEDS, axis=1)])
    place = np.repeat(states[:, :2], speeds.shape[1], axis=0)
    along = force(np.column_stack([place, speeds.ravel()])).reshape(speeds.shape)
    continued = along[:, :_SPEEDS].max(axis=1) * np.maximum(speed / top, 1.0)
    return np.asarray(np.maximum(along.max(axis=1), continued))


def factor_of(expectation: Expectation) -> float:
    """Factor by which a force may exceed the expected one."""
    return STANDARD_FACTOR if isinstance(expectation, StandardExpectation) else MAP_FACTOR


def rest_of(expectation: Expectation) -> float:
    """Force at rest [N] that the expectation lacks."""
    return REST_FORCE if isinstance(expectation, StandardExpectation) else 0.0


def source_of(expectation: Expectation | None, states: FloatArray) -> Finding | None:
    """Where the expected forces of states, shape (n, 3), come from."""
    if isinstance(expectation, ForceMap):
        outside = int(np.sum(~expectation.measured_range.contains(*states.T)))
        figures = {"name": expectation.name, "simulated": expectation.simulated, "outside": outside}
        return Finding.of(FindingKind.EXPECTED_BY_MAP, **figures, states=len(states))
    if isinstance(expectation, StandardExpectation):
        masses = {"moving_mass_kg": expectation.moving_mass, "payload_kg": expectation.payload}
        beyond = {"factor": STANDARD_FACTOR, "rest_N": REST_FORCE}
        return Finding.of(FindingKind.EXPECTED_BY_STANDARD, **masses, **beyond)
    name = getattr(expectation, "__name__", type(expectation).__name__)
    return None if expectation is None else Finding.of(FindingKind.EXPECTED_BY_FUNCTION, name=name)
