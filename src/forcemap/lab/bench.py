"""The bench: simulated impacts of a virtual robot at places and speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.dynamics.rigid_body import unit_direction
from forcemap.errors import InputError
from forcemap.lab.course import DOWN, STEP, ImpactSetup, first_peaks
from forcemap.lab.kernels import many_courses, many_peaks
from forcemap.lab.simulated_device import PAPER_DEVICE
from forcemap.lab.virtual_robot import VirtualRobot

_HOLDING = (0.5, 0.7)  # where the lab reads a lasting force, after contact [s]: transient contact is over
_TOUCH = 1.0  # [N], less is no contact: a choice
_LONGEST = 60.0  # simulated time [s]; more is a slip
_LIGHTEST = 0.1  # [kg]; a choice: lighter than any body part, and a step is 1/30 of a radian of its motion on 75 N/mm
_SHORTEST_STEP = 1e-6  # [s]; a choice: shorter ones gain nothing and take hours


class SimulatedScenario(StrEnum):
    """What a simulated force does after Phase I, by the lab's own rule; names as in a campaign's table."""

    UNCONSTRAINED = "unconstrained"
    WITHOUT_CLAMPING = "constrained_without_clamping"
    WITH_CLAMPING = "constrained_with_clamping"


@dataclass(frozen=True, eq=False)
class SimulatedImpacts:
    """Simulated impacts: the force itself, as no device reads it. Not a measurement of any robot.

    Parameters
    ----------
    distance, height, speed : array, shape (n,)
        Place [m] and speed at contact [m/s].
    time : array, shape (times,)
        Time after first contact [s].
    force : array, shape (times, n)
        Force on the device [N].
    peak_force : array, shape (n,)
        Phase I peak [N].
    """

    distance: FloatArray
    height: FloatArray
    speed: FloatArray
    time: FloatArray
    force: FloatArray
    peak_force: FloatArray

    @property
    def held_force(self) -> FloatArray:
        """Mean force from 0.5 to 0.7 s after contact [N], shape (n,); NaN if less was simulated."""
        window = (self.time >= _HOLDING[0]) & (self.time <= _HOLDING[1])
        whole = self.time[-1] >= _HOLDING[1] - 1e-9
        return self.force[window].mean(axis=0) if whole else np.full(self.speed.size, np.nan)

    @property
    def scenario(self) -> tuple[SimulatedScenario, ...]:
        """What each force does after Phase I: held 0.5 s after contact, back after a loss of contact, or neither."""
        touching = self.force > _TOUCH
        begun = np.maximum.accumulate(touching, axis=0)
        lost = np.maximum.accumulate(begun & ~touching, axis=0)
        again = (lost & touching).any(axis=0)
        clamping = touching[self.time >= _HOLDING[0]].any(axis=0)
        names = np.where(clamping, 2, again)
        return tuple(list(SimulatedScenario)[i] for i in names.tolist())


def simulate_impacts(
    robot: VirtualRobot,
    distance: ArrayLike,
    height: ArrayLike,
    speed: ArrayLike,
    *,
    direction: ArrayLike = DOWN,
    device_stiffness: float = PAPER_DEVICE.stiffness,
    body_mass: ArrayLike = math.inf,
    duration: float = 1.0,
    step: float = STEP,
) -> SimulatedImpacts:
    """Simulate impacts on a measuring device or a free body part, straight down or in another direction.

    Parameters
    ----------
    robot : VirtualRobot
        The robot.
    distance, height, speed : float or array
        Place [m] and speed at contact [m/s]; they broadcast.
    direction : array, shape (3,) or (n, 3)
        Where the contact point moves, seen from the vertical plane through the base z-axis and the place: outward,
        sideways, up; straight down if not given. Of any length. The device lies across it.
    device_stiffness : float
        Spring constant of the device [N/m].
    body_mass : float or array, shape (n,)
        Mass of a free body part [kg]: the device, then its spring, is fixed to it alone; a fixed device if not given.
    duration, step : float
        Simulated time after first contact, and the time step [s].

    Raises
    ------
    InputError
        A place that the robot cannot reach, a figure outside its range, or a direction of length zero.
    """
    if not step <= duration < _LONGEST:
        raise InputError(f"duration: found {duration:g} s, expected at least a step and less than a minute")
    d, h, v, setup = _set_up(robot, (distance, height, speed), direction, device_stiffness, step, body_mass)
    force = many_courses(setup, v, duration=duration, step=step)
    return SimulatedImpacts(d, h, v, np.arange(len(force), dtype=np.float64) * step, force, first_peaks(force))


def simulate_peaks(
    robot: VirtualRobot,
    distance: ArrayLike,
    height: ArrayLike,
    speed: ArrayLike,
    *,
    direction: ArrayLike = DOWN,
    device_stiffness: float = PAPER_DEVICE.stiffness,
    body_mass: ArrayLike = math.inf,
    step: float = STEP,
) -> FloatArray:
    """Simulate Phase I peaks alone [N], shape (n,): the same peaks, in less time.

    Parameters
    ----------
    robot : VirtualRobot
        The robot.
    distance, height, speed : float or array
        Place [m] and speed at contact [m/s]; they broadcast.
    direction : array, shape (3,) or (n, 3)
        Where the contact point moves, seen from the vertical plane through the base z-axis and the place: outward,
        sideways, up; straight down if not given. Of any length. The device lies across it.
    device_stiffness : float
        Spring constant of the device [N/m].
    body_mass : float or array, shape (n,)
        Mass of a free body part [kg]: the device, then its spring, is fixed to it alone; a fixed device if not given.
    step : float
        The time step [s].

    Raises
    ------
    InputError
        A place that the robot cannot reach, a figure outside its range, or a direction of length zero.
    """
    _, _, v, setup = _set_up(robot, (distance, height, speed), direction, device_stiffness, step, body_mass)
    return many_peaks(setup, v, step=step)


def _set_up(
    robot: VirtualRobot,
    state: tuple[ArrayLike, ...],
    direction: ArrayLike,
    device_stiffness: float,
    step: float,
    body_mass: ArrayLike,
) -> tuple[FloatArray, FloatArray, FloatArray, ImpactSetup]:
    """Distances, heights, speeds and setup of the impacts; a place is posed once for all impacts in one direction."""
    if not _SHORTEST_STEP <= step <= STEP:
        raise InputError(
            f"step: found {step:g} s, expected {_SHORTEST_STEP:g} to {STEP:g} s: with longer ones peaks come out wrong"
        )
    d, h, v = np.array(np.broadcast_arrays(*state), dtype=np.float64).reshape(3, -1)
    if not np.isfinite([d, h]).all():
        raise InputError("distance or height: found a number that is not finite, expected m")
    if not np.all((v > 0) & (v < np.inf)):
        raise InputError(f"speed: found {v.min():g} to {v.max():g} m/s, expected positive finite numbers")
    along = unit_direction(direction, 3)
    if along.shape not in ((3,), (d.size, 3)):
        raise InputError(f"direction: found the shape {along.shape}, expected (3,) or ({d.size}, 3)")
    body = np.asarray(body_mass, dtype=np.float64)
    if body.shape not in ((), (d.size,)) or not np.all(body >= _LIGHTEST):
        raise InputError(
            f"body mass: found {body.min():g} kg and the shape {body.shape}, expected at least {_LIGHTEST:g} kg, one "
            "for all impacts or one each; math.inf for a fixed device"
        )
    approaches = np.column_stack([d, h, np.broadcast_to(along, (d.size, 3))])
    approaches, which = np.unique(approaches, axis=0, return_inverse=True)
    posed = robot.posed_at(approaches[:, 0], approaches[:, 1])
    setup = robot.impact_setup(posed, device_stiffness, approaches[:, 2:]).at_places(which.ravel())
    return d, h, v, replace(setup, body_mass=body)
