"""How a robot's controller reacts to a collision: when it notices, and what it does then."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError


class ReactionKind(StrEnum):
    """What the robot does: it backs off, or it stops and holds its position. An input, not a prediction."""

    RETREAT = "retreat"
    STOP_AND_HOLD = "stop_and_hold"


@dataclass(frozen=True, kw_only=True)
class Reaction:
    """The reaction to a collision.

    Parameters
    ----------
    kind : ReactionKind
        What the robot does.
    threshold : float
        External torque at any joint beyond which a collision is noticed [N m].
    torque_filter : float
        Time constant of the low-pass on that torque [s].
    delay : float
        From the threshold to the first change of the commanded speed [s].
    time_constant : float
        With which the commanded speed approaches its new value [s].
    retreat_speed, retreat_time : float
        Speed at which the robot backs off [m/s], and for how long [s]; 0 if it stops and holds.
    hold_force : float
        Contact force at which a robot that stops and holds settles [N]; 0 if it retreats.
    yielding : float
        Speed at which it moves to settle there, per difference of the force from it [m/(N s)]; 0 if it retreats.

    Raises
    ------
    InputError
        A figure below zero or not finite, or one of the other kind of reaction.
    """

    kind: ReactionKind
    threshold: float
    torque_filter: float
    delay: float
    time_constant: float
    retreat_speed: float = 0.0
    retreat_time: float = 0.0
    hold_force: float = 0.0
    yielding: float = 0.0

    def __post_init__(self) -> None:
        for name, value in list(vars(self).items())[1:]:
            least = "positive" if name in ("threshold", "torque_filter", "time_constant") else "at least 0"
            if not 0 <= value < math.inf or (value == 0 and least == "positive"):
                what = name.replace("_", " ")
                raise InputError(f"reaction, {what}: found {value:g}, expected a finite number, {least}")
        retreat, hold = (self.retreat_speed, self.retreat_time), (self.hold_force, self.yielding)
        own, other = (retreat, hold) if self.kind is ReactionKind.RETREAT else (hold, retreat)
        if not all(own) or any(other):
            raise InputError(
                f"reaction: found {self.kind} with a retreat of {retreat[0]:g} m/s for {retreat[1]:g} s and a hold "
                f"force of {hold[0]:g} N with {hold[1]:g} m/(N s); expected figures of its own kind above 0, others 0"
            )

    def commanded_speed(self, speed: FloatArray, since: FloatArray, force: FloatArray) -> FloatArray:
        """Speed the controller commands [m/s].

        Until the reaction begins it is the speed at contact; then it approaches the retreat exponentially, and after
        that zero, or what brings the force to the hold force.

        Parameters
        ----------
        speed : array, shape (batch,)
            Speed at contact [m/s].
        since : array, shape (batch,)
            Time since the reaction began [s]; before it negative.
        force : array, shape (batch,)
            Contact force [N].
        """
        if self.kind is ReactionKind.STOP_AND_HOLD:
            hold = self.yielding * (self.hold_force - force) * (since > 0)
            return np.asarray((speed - hold) * np.exp(np.maximum(since, 0.0) / -self.time_constant) + hold)
        backing = np.minimum(np.maximum(since, 0.0), self.retreat_time)
        after = np.maximum(since - self.retreat_time, 0.0)
        retreat = self.before(speed, np.exp(backing / -self.time_constant))
        return np.asarray(retreat * np.exp(after / -self.time_constant))

    def before(self, speed: FloatArray, fading: FloatArray | float = 1.0) -> FloatArray:
        """What `commanded_speed` gives until the reaction begins [m/s]; faded from 1 on, on the way to the retreat."""
        return -self.retreat_speed + (speed + self.retreat_speed) * fading
