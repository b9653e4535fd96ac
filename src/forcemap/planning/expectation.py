"""What force to expect where, before it is measured; used only to plan."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from forcemap.errors import InputError
from forcemap.limits.pfl import pfl_contact_force, pfl_robot_mass
from forcemap.maps.force_map import ForceMap

STANDARD_FACTOR = 2.0
"""The published maps predict up to 1.88 times the contact model's force on their own grids."""

REST_FORCE = 190.0
"""[N]; continued to rest, the published maps give 38 to 184 N, where the contact model gives none."""

MAP_FACTOR = 1.1
"""The paper's margin."""


@dataclass(frozen=True)
class StandardExpectation:
    """Forces to expect by the standard's contact model; a coarse guess, used only to plan.

    Parameters
    ----------
    moving_mass : float
        Total mass M of the moving parts of the robot [kg].
    payload : float
        Effective payload m_L [kg].
    stiffness : float
        Spring constant [N/m]; that of the paper's device.
    body_mass : float
        Effective mass of the body region [kg]; infinite: a device held in place.
    """

    moving_mass: float
    payload: float = 0.0
    stiffness: float = 75e3
    body_mass: float = math.inf

    def __call__(self, distance: float, height: float, speed: float) -> float:
        """Force [N] at a speed [m/s]; the same at every place [m]."""
        mass = pfl_robot_mass(self.moving_mass, self.payload)
        force = pfl_contact_force(speed, robot_mass=mass, body_mass=self.body_mass, stiffness=self.stiffness)
        return float(force)

    def __str__(self) -> str:
        return f"the standard's contact model (M = {self.moving_mass:g} kg, m_L = {self.payload:g} kg)"


Expectation = ForceMap | StandardExpectation | Callable[[float, float, float], float]
"""What tells the force [N] to expect at (distance [m], height [m], speed [m/s])."""


def expected_at(expectation: Expectation | None, distance: float, height: float, speed: float) -> float:
    """Expected force [N]; NaN without an expectation."""
    if expectation is None:
        return math.nan
    predict = expectation.predict if isinstance(expectation, ForceMap) else expectation
    force = float(predict(distance, height, speed))
    if not 0 < force < math.inf:
        place = f"d = {distance:g} m, h = {height:g} m, v = {speed:g} m/s"
        raise InputError(f"expected force: found {force:g} N at {place}, expected newtons above 0 and finite")
    return force


def factor_of(expectation: Expectation) -> float:
    """What a force may exceed the expected one by, as a factor."""
    return STANDARD_FACTOR if isinstance(expectation, StandardExpectation) else MAP_FACTOR


def upper_of(expectation: Expectation, force: float) -> float:
    """What the force is not expected to exceed where the expected one is `force` [N]: for planning, no bound."""
    at_rest = REST_FORCE if isinstance(expectation, StandardExpectation) else 0.0
    return max(factor_of(expectation) * force, force + at_rest)


def source_of(expectation: Expectation | None, states: list[tuple[float, float, float]]) -> str:
    """What the expected forces come from."""
    if isinstance(expectation, ForceMap):
        distance, height, speed = np.array(states).T
        outside = int(np.sum(~expectation.measured_range.contains(distance, height, speed)))
        simulated = " (SIMULATED impacts)" if expectation.simulated else ""
        note = f"; {outside} of {len(states)} planned states lie outside its measured range" if outside else ""
        return f"map {expectation.name!r}{simulated}{note}"
    if expectation is None or isinstance(expectation, StandardExpectation):
        return str(expectation or "")
    return f"the function {getattr(expectation, '__name__', type(expectation).__name__)!r}"
