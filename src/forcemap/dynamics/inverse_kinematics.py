"""Postures that bring the contact point to a place: damped least squares from several starts, all places at once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Mask
from forcemap.dynamics.kinematics import Posture, contact_jacobian, contact_point, cross, joint_positions, posture_of
from forcemap.dynamics.rigid_body import unit_direction
from forcemap.dynamics.robot import JointKind, Robot
from forcemap.errors import InputError

DOWN = (0.0, 0.0, -1.0)

# Choices; tests/test_robot.py holds the search against postures known to exist.
_TOLERANCE = 1e-7  # a place is reached within this distance [m] and angle [rad]
_GOAL = 1e-10  # iterated down to this error if possible, so that results do not scatter within the tolerance
_STARTS = 24  # other starting postures for a place that the reference posture does not lead to
_SEED = 15066  # of the other starts, so that every run finds the same postures
_STEPS = 120  # most iterations from one start
_FIRST_DAMPING, _LEAST_DAMPING, _LAST_DAMPING = 1e-3, 1e-14, 1e8  # at the last one the search has come to rest
_AFTER_GOOD_STEP, _AFTER_BAD_STEP = 0.1, 8.0  # factors on the damping
_MOST_AT_ONCE = 20_000  # postures in one block, to limit memory
_FAR = 1e9  # rank of a posture that does not arrive: above the distance between any two postures [rad], [m]


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
    place_error: Any = math.nan
    angle_error: Any = math.nan


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
    start = np.clip(first, robot.lower, robot.upper)
    q, errors = _approach(robot, flat, tool, np.repeat(start[:, None], flat.shape[1], axis=1))
    _from_other_starts(robot, flat, tool, first, q, errors)
    shape, reached = goals.shape[:-1], _within(errors)
    q = np.where(reached, _nearest_turn(robot, q, first), np.nan)
    place, angle = errors.reshape(2, *shape) if shape else errors[:, 0].tolist()
    return Reach(q.T.reshape(*shape, len(q)), reach_outcomes(reached.reshape(shape)), place, angle)


def reach_outcomes(reached: Mask) -> Any:
    """The outcome, or an array of outcomes, for a mask of reached places."""
    return np.array([ReachOutcome.UNREACHABLE, ReachOutcome.REACHED], dtype=object)[reached.astype(int)]


def _from_other_starts(
    robot: Robot, goals: FloatArray, tool: FloatArray, reference: FloatArray, q: FloatArray, errors: FloatArray
) -> None:
    """Try other starts for places not reached yet, and write better postures into `q` and `errors`."""
    starts = _starts(robot, reference)
    failed = np.flatnonzero(~_within(errors))
    for block in np.array_split(failed, -(-failed.size * _STARTS // _MOST_AT_ONCE) or 1):
        aims = np.repeat(goals[:, block], _STARTS, axis=1)
        trials, trial_errors = _approach(robot, aims, tool, np.tile(starts, (1, block.size)))
        trials = _nearest_turn(robot, trials, reference)
        away = np.linalg.norm(trials - reference[:, None], axis=0)
        # arrived postures first, the nearest to the reference; of the others the one that comes nearest to the place
        rank = np.where(_within(trial_errors), away, _FAR * (1 + trial_errors.sum(axis=0))).reshape(block.size, _STARTS)
        best = rank.argmin(axis=1) + np.arange(block.size) * _STARTS
        better = rank.min(axis=1) < _FAR * (1 + errors[:, block].sum(axis=0))
        block, best = block[better], best[better]
        q[:, block], errors[:, block] = trials[:, best], trial_errors[:, best]


def _starts(robot: Robot, reference: FloatArray) -> FloatArray:
    """Random starts over the joint range, at most half a turn from the reference; the same ones in every run."""
    lower = np.where(_rotary(robot), np.maximum(robot.lower, reference - np.pi), robot.lower)
    upper = np.where(_rotary(robot), np.minimum(robot.upper, reference + np.pi), robot.upper)
    return np.random.default_rng(_SEED).uniform(lower, upper, (_STARTS, len(reference))).T


def _nearest_turn(robot: Robot, q: FloatArray, reference: FloatArray) -> FloatArray:
    """The same postures, less whole turns where that brings a joint nearer to the reference within its limits."""
    moved = q - np.where(_rotary(robot)[:, None], 2 * np.pi * np.round((q - reference[:, None]) / (2 * np.pi)), 0.0)
    return np.where((moved >= robot.lower[:, None]) & (moved <= robot.upper[:, None]), moved, q)


def _rotary(robot: Robot) -> Mask:
    return np.array([joint.kind is not JointKind.PRISMATIC for joint in robot.joints])


def _within(errors: FloatArray) -> Mask:
    return np.asarray((errors < _TOLERANCE).all(axis=0))


def _approach(robot: Robot, goals: FloatArray, tool: FloatArray, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """From postures `start` (n, batch) inside the limits towards goals (3, batch) [m] and a direction of the tool (3,).

    Damped least squares, the joints held at their limits. Returns positions, shape (n, batch), and the errors that
    remain, shape (2, batch): of the place [m], of the direction [rad].
    """
    q = start.copy()
    miss = _miss(robot, posture_of(robot, q), goals, tool)
    damping = np.full(q.shape[1], _FIRST_DAMPING)
    busy = np.arange(q.shape[1])
    for _ in range(_STEPS):
        size = np.linalg.norm(miss[:, busy], axis=0)
        busy = busy[(size > _GOAL) & (damping[busy] < _LAST_DAMPING)]
        if not busy.size:
            break
        trial = _step(robot, q[:, busy], miss[:, busy], damping[busy])
        trial_miss = _miss(robot, posture_of(robot, trial), goals[:, busy], tool)
        good = np.linalg.norm(trial_miss, axis=0) < np.linalg.norm(miss[:, busy], axis=0)
        q[:, busy[good]], miss[:, busy[good]] = trial[:, good], trial_miss[:, good]
        damping[busy] = np.maximum(damping[busy] * np.where(good, _AFTER_GOOD_STEP, _AFTER_BAD_STEP), _LEAST_DAMPING)
    return q, np.stack([np.linalg.norm(miss[:3], axis=0), np.linalg.norm(miss[3:], axis=0)])


def _step(robot: Robot, q: FloatArray, miss: FloatArray, damping: FloatArray) -> FloatArray:
    posture = posture_of(robot, q)
    axis = _tool_axis(robot, posture)[:, None]
    across = posture.turning - axis * (axis * posture.turning).sum(axis=0)  # a turn about the tool's axis is free
    j = np.moveaxis(np.concatenate([contact_jacobian(robot, posture), across]), -1, 0)
    lower, upper = robot.lower[:, None], robot.upper[:, None]
    step = _damped(j, miss, damping)
    blocked = ((q <= lower) & (step < 0)) | ((q >= upper) & (step > 0))
    if blocked.any():
        step = _damped(j * ~blocked.T[:, None], miss, damping)
    # a linear step means nothing beyond about a radian; 1e-300: no division by 0
    step *= np.minimum(1.0, 1.0 / np.maximum(np.abs(step).max(axis=0), 1e-300))
    return np.clip(q + step, lower, upper)


def _damped(j: FloatArray, miss: FloatArray, damping: FloatArray) -> FloatArray:
    """The step J^T (J J^T + damping)^-1 miss, shape (n, batch)."""
    transposed = np.swapaxes(j, 1, 2)
    square = j @ transposed + damping[:, None, None] * np.eye(6)
    return (transposed @ np.linalg.solve(square, miss.T[..., None]))[..., 0].T


def _miss(robot: Robot, posture: Posture, goals: FloatArray, tool: FloatArray) -> FloatArray:
    """Errors of the place [m] and, as a rotation vector, of the tool's direction [rad], shape (6, batch)."""
    axis = _tool_axis(robot, posture)
    turn = cross(axis, np.broadcast_to(tool[:, None], axis.shape))
    sine, cosine = np.linalg.norm(turn, axis=0), tool @ axis
    angle = np.arctan2(sine, cosine)
    # if the tool points straight backwards any axis across it will do
    across = cross(axis, np.broadcast_to(np.eye(3)[np.argmin(np.abs(tool))][:, None], axis.shape))
    turn = np.where((sine < 1e-9) & (cosine < 0), across, turn)  # 1e-9: rounding
    length = np.maximum(np.linalg.norm(turn, axis=0), 1e-300)
    return np.concatenate([goals - contact_point(robot, posture), turn / length * angle])


def _tool_axis(robot: Robot, posture: Posture) -> FloatArray:
    return np.asarray((robot.flange.rotation @ robot.tool_axis) @ posture.rotations[-1])
