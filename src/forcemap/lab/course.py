"""The course of impacts: robots, contact and reaction stepped through time, all impacts at once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from forcemap.arrays import FloatArray
from forcemap.errors import InputError
from forcemap.lab.contact import ContactLayer
from forcemap.lab.impactor import Impactor
from forcemap.lab.reaction import Reaction

STEP = 2e-4  # [s]; longer ones are refused
FALLEN = 0.9  # Phase I is over once the force has fallen below this share of its running maximum
LONGEST_PHASE_ONE = 1.0  # [s]


@dataclass(frozen=True)
class Servo:
    """How stiffly the joints follow the commanded motion.

    Parameters
    ----------
    frequency : float
        Natural frequency of a joint by itself [Hz].
    damping : float
        Its damping ratio [1].
    """

    frequency: float
    damping: float


@dataclass(frozen=True, eq=False)
class Impacting:
    """What hits what.

    Parameters
    ----------
    impactor : Impactor
        Robots at contact.
    servo : Servo
        What holds their joints.
    contact : ContactLayer
        What lies between.
    reaction : Reaction
        What their controllers do.
    """

    impactor: Impactor
    servo: Servo
    contact: ContactLayer
    reaction: Reaction

    def at(self, places: NDArray[np.intp]) -> Self:
        """The same, for impacts at these places by number."""
        return replace(self, impactor=self.impactor.at(places))


def force_course(impacting: Impacting, speed: FloatArray, *, duration: float, step: float = STEP) -> FloatArray:
    """Force on the device from first contact on, shape (times, batch) [N], a row every step.

    Parameters
    ----------
    impacting : Impacting
        What hits what.
    speed : array, shape (batch,)
        Speed at contact [m/s].
    duration, step : float
        Time after contact, and the time step [s].
    """
    steps = round(duration / step)
    course = np.empty((steps + 1, speed.size))
    for row, force in zip(course, _forces(impacting, _speeds(speed), step), strict=False):
        row[:] = force
    return course


def phase_one_peaks(
    impacting: Impacting, speed: FloatArray, *, step: float = STEP, longest: float = LONGEST_PHASE_ONE
) -> FloatArray:
    """Phase I peaks, shape (batch,) [N]: the first maximum after which the force falls clearly; no more is simulated.

    Parameters
    ----------
    impacting : Impacting
        What hits what.
    speed : array, shape (batch,)
        Speed at contact [m/s].
    step, longest : float
        The time step, and the time after contact at which Phase I is taken to be over [s].
    """
    peak = np.zeros(speed.size)
    going = np.ones(speed.size, dtype=bool)
    for _, force in zip(range(round(longest / step)), _forces(impacting, _speeds(speed), step), strict=False):
        going &= force >= FALLEN * peak
        np.maximum(peak, force, out=peak, where=going)
        if not going.any():
            break
    return peak


def first_peaks(course: FloatArray) -> FloatArray:
    """Phase I peaks of force courses, shape (batch,) [N], by the same rule."""
    running = np.maximum.accumulate(course)
    fallen = course < FALLEN * running
    stop = np.where(fallen.any(axis=0), fallen.argmax(axis=0), len(course)) - 1
    return np.asarray(running[stop, np.arange(course.shape[1])])


def _speeds(speed: FloatArray) -> FloatArray:
    if not np.all((speed > 0) & (speed < np.inf)):
        raise InputError(f"speed: found {speed.min():g} to {speed.max():g} m/s, expected positive finite numbers")
    return speed


def _forces(impacting: Impacting, speed: FloatArray, step: float) -> Iterator[FloatArray]:
    """Forces step by step, without end; velocities and pad live at half steps, so that the error is of order two."""
    robot, contact, reaction = impacting.impactor, impacting.contact, impacting.reaction
    w, z = 2 * np.pi * impacting.servo.frequency, impacting.servo.damping
    spring, damper, push = robot.shares * w**2, robot.shares * (2 * z * w), robot.shares * robot.levers
    spring_path = spring * robot.approach
    damper_path = damper * robot.approach
    # the damper acts on the mean of the velocities before and after a step
    before, after = (1 - step / 2 * damper) / (1 + step / 2 * damper), step / (1 + step / 2 * damper)
    modes = np.zeros_like(robot.levers)
    rates = robot.approach * speed
    pad, path, noticed, torque = (np.zeros(speed.size) for _ in range(4))
    begun = np.full(speed.size, np.inf)  # when the reaction begins
    keep = np.exp(-step / reaction.torque_filter)
    depth, force, now = np.zeros(speed.size), np.zeros(speed.size), 0.0
    first = True
    while True:
        yield force
        commanded = reaction.commanded_speed(speed, now - begun, force)
        pull = spring_path * path + damper_path * commanded - spring * modes - push * force
        if first:  # half a step from the velocity at contact
            rates = rates + step / 2 * (pull - damper * rates)
            first = False
        else:
            rates = before * rates + after * pull
        modes = modes + step * rates
        now += step
        path = path + step * reaction.commanded_speed(speed, now - step / 2 - begun, force)
        previous, depth = depth, (robot.levers * modes).sum(axis=0)
        pad = contact.compressed((previous + depth) / 2, pad, step)
        force = contact.force(depth, pad)
        noticed, torque = torque, keep * torque + (1 - keep) * robot.joint_lever * force
        over = (torque > reaction.threshold) & np.isinf(begun)
        if over.any():
            share = (reaction.threshold - noticed[over]) / (torque[over] - noticed[over])
            begun[over] = now - step + share * step + reaction.delay
