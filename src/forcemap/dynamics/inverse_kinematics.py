"""Postures that bring the contact point to a place: damped least squares from several starts, all places at once."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Mask
from forcemap.dynamics.approach import approach
from forcemap.dynamics.effective_mass import unit_direction
from forcemap.dynamics.kinematics import joint_positions
from forcemap.dynamics.robot import JointKind, Robot
from forcemap.errors import InputError

DOWN = (0.0, 0.0, -1.0)

_PLACE_TOLERANCE = 1e-7  # [m]
_ANGLE_TOLERANCE = 1e-7  # [rad]
_STARTS = 24
_MOST_AT_ONCE = 20_000


class ReachOutcome(StrEnum):
    """Whether a posture was found. `unreachable`: none of the starts led to one inside the joint limits."""

    REACHED = "reached"
    UNREACHABLE = "unreachable"


@dataclass(frozen=True, eq=False)
class Reach:
    """Postures at places.

    Parameters
    ----------
    positions : array, shape (..., n)
        Positions of the joints [rad], [m]; NaN where the place is unreachable.
    outcome : ReachOutcome or object array of them
        Whether the place is reached.
    place_error : float or array
        Distance of the contact point from the place [m], of the best posture that was found.
    angle_error : float or array
        Angle between the tool and its direction [rad], of that posture.
    """

    positions: FloatArray
    outcome: Any
    place_error: Any
    angle_error: Any


def places_in_plane(distance: ArrayLike, height: ArrayLike) -> FloatArray:
    """Places (d, 0, h) in the frame of the base, shape (..., 3) [m].

    Parameters
    ----------
    distance, height : float or array
        Distance from the base z-axis and height above the base [m].
    """
    d, h = np.broadcast_arrays(np.asarray(distance, dtype=np.float64), np.asarray(height, dtype=np.float64))
    return np.stack([d, np.zeros_like(d), h], axis=-1)


def inverse_kinematics(
    robot: Robot, places: ArrayLike, *, tool_direction: ArrayLike = DOWN, reference: ArrayLike | None = None
) -> Reach:
    """Postures inside the joint limits that bring the contact point to places, the tool pointing in a direction.

    The turn about the tool's axis is free. The search starts at the reference posture; where that fails, at others,
    always the same ones, and the posture nearest to the reference is taken.

    Parameters
    ----------
    robot : Robot
        The robot.
    places : array, shape (..., 3)
        Places in the frame of the base [m], see `places_in_plane`.
    tool_direction : array, shape (3,)
        Where the z axis of the flange points; down if not given.
    reference : array, shape (n,), optional
        Posture to start from [rad], [m]; the robot's own if not given.

    Raises
    ------
    InputError
        A place or a direction that is not three finite numbers, or a reference that is not one for every joint.
    """
    goals = np.asarray(places, dtype=np.float64)
    if goals.ndim < 1 or goals.shape[-1] != 3:
        raise InputError(f"places: found the shape {goals.shape}, expected (..., 3): x, y, z in m")
    if not np.isfinite(goals).all():
        raise InputError("places: found a distance, height or position that is not finite, expected metres")
    tool = unit_direction(tool_direction, 3)
    first = joint_positions(robot, robot.reference_posture if reference is None else reference)
    if tool.ndim != 1 or first.ndim != 1:
        raise InputError("tool direction and reference: found several, expected one for all places")
    flat = goals.reshape(-1, 3).T
    q, errors = approach(robot, flat, tool, np.repeat(_inside(robot, first)[:, None], flat.shape[1], axis=1))
    _from_other_starts(robot, flat, tool, first, q, errors)
    reached = _within(errors)
    q = np.where(reached, _nearest_turn(robot, q, first), np.nan)
    shape = goals.shape[:-1]
    outcome = reach_outcomes(reached.reshape(shape))
    if shape:
        return Reach(q.T.reshape(*shape, -1), outcome, errors[0].reshape(shape), errors[1].reshape(shape))
    return Reach(q[:, 0], outcome, float(errors[0, 0]), float(errors[1, 0]))


def reach_outcomes(reached: Mask) -> Any:
    """The name of each; an array of them for an array."""
    return np.array([ReachOutcome.UNREACHABLE, ReachOutcome.REACHED], dtype=object)[reached.astype(int)]


def _from_other_starts(
    robot: Robot, goals: FloatArray, tool: FloatArray, reference: FloatArray, q: FloatArray, errors: FloatArray
) -> None:
    """Fill in what other starts find for places that are not reached yet."""
    starts = _starts(robot, reference)
    failed = np.flatnonzero(~_within(errors))
    for block in np.array_split(failed, -(-failed.size * _STARTS // _MOST_AT_ONCE) or 1):
        if not block.size:
            continue
        found, found_errors = approach(
            robot, np.repeat(goals[:, block], _STARTS, axis=1), tool, np.tile(starts, (1, block.size))
        )
        found = _nearest_turn(robot, found, reference)
        away = np.linalg.norm(found - reference[:, None], axis=0)
        # every posture that arrives comes before all that do not; of the latter the one that comes nearest
        rank = np.where(_within(found_errors), away, 1e9 * (1 + found_errors.sum(axis=0))).reshape(block.size, _STARTS)
        best = rank.argmin(axis=1) + np.arange(block.size) * _STARTS
        better = _within(found_errors[:, best]) | (found_errors[:, best].sum(axis=0) < errors[:, block].sum(axis=0))
        q[:, block[better]] = found[:, best[better]]
        errors[:, block[better]] = found_errors[:, best[better]]


def _starts(robot: Robot, reference: FloatArray) -> FloatArray:
    """Starts all over the joint range, at most half a turn from the reference; the same ones in every run."""
    turns = np.array([joint.kind is not JointKind.PRISMATIC for joint in robot.joints])
    lower = np.where(turns, np.maximum(robot.lower, reference - np.pi), robot.lower)
    upper = np.where(turns, np.minimum(robot.upper, reference + np.pi), robot.upper)
    return np.random.default_rng(15066).uniform(lower, upper, (_STARTS, len(reference))).T


def _nearest_turn(robot: Robot, q: FloatArray, reference: FloatArray) -> FloatArray:
    """The same postures, whole turns taken off where that comes nearer to the reference within the limits."""
    turns = np.array([joint.kind is not JointKind.PRISMATIC for joint in robot.joints])[:, None]
    moved = q - np.where(turns, 2 * np.pi * np.round((q - reference[:, None]) / (2 * np.pi)), 0.0)
    return np.where((moved >= robot.lower[:, None]) & (moved <= robot.upper[:, None]), moved, q)


def _inside(robot: Robot, q: FloatArray) -> FloatArray:
    return np.clip(q, robot.lower, robot.upper)


def _within(errors: FloatArray) -> Mask:
    return np.asarray((errors[0] < _PLACE_TOLERANCE) & (errors[1] < _ANGLE_TOLERANCE))
