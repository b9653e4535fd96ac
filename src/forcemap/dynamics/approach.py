"""From a posture towards a place: damped least squares, the joints held at their limits, many postures at once."""

from __future__ import annotations

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.dynamics.kinematics import Posture, contact_jacobian, contact_point, cross, posture_of
from forcemap.dynamics.robot import Robot

_GOAL = 1e-10  # iterated down to this where it goes, so that results do not scatter within the tolerance
_STEPS = 120
_FIRST_DAMPING, _LAST_DAMPING = 1e-3, 1e8


def approach(robot: Robot, goals: FloatArray, tool: FloatArray, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bring the contact point to goals and the tool into a direction, from given starts.

    Parameters
    ----------
    robot : Robot
        The robot.
    goals : array, shape (3, batch)
        Places [m].
    tool : array, shape (3,)
        Where the z axis of the flange should point, a unit vector.
    start : array, shape (n, batch)
        Positions of the joints inside their limits [rad], [m].

    Returns
    -------
    tuple of array
        Positions, shape (n, batch); what is missing, shape (2, batch): to the place [m], to the direction [rad].
    """
    q = start.copy()
    posture = posture_of(robot, q)
    miss = _miss(robot, posture, goals, tool)
    damping = np.full(q.shape[1], _FIRST_DAMPING)
    busy = np.arange(q.shape[1])
    for _ in range(_STEPS):
        size = np.linalg.norm(miss[:, busy], axis=0)
        busy = busy[(size > _GOAL) & (damping[busy] < _LAST_DAMPING)]
        if not busy.size:
            break
        here = q[:, busy]
        trial = _step(robot, here, miss[:, busy], damping[busy])
        trial_miss = _miss(robot, posture_of(robot, trial), goals[:, busy], tool)
        good = np.linalg.norm(trial_miss, axis=0) < np.linalg.norm(miss[:, busy], axis=0)
        q[:, busy[good]], miss[:, busy[good]] = trial[:, good], trial_miss[:, good]
        damping[busy] *= np.where(good, 0.1, 8.0)
        damping[busy] = np.maximum(damping[busy], 1e-14)
    return q, np.stack([np.linalg.norm(miss[:3], axis=0), np.linalg.norm(miss[3:], axis=0)])


def _step(robot: Robot, q: FloatArray, miss: FloatArray, damping: FloatArray) -> FloatArray:
    posture = posture_of(robot, q)
    rates = np.concatenate([contact_jacobian(robot, posture), _tool_rates(robot, posture)])
    j = np.moveaxis(rates, -1, 0)
    lower, upper = robot.lower[:, None], robot.upper[:, None]
    step = _damped(j, miss, damping)
    held = ((q <= lower) & (step < 0)) | ((q >= upper) & (step > 0))
    if held.any():
        step = _damped(j * ~held.T[:, None], miss, damping)
    # a turn of more than a radian at once leaves the range in which the linear step means anything
    step *= np.minimum(1.0, 1.0 / np.maximum(np.abs(step).max(axis=0), 1e-300))
    return np.clip(q + step, lower, upper)


def _damped(j: FloatArray, miss: FloatArray, damping: FloatArray) -> FloatArray:
    """The step J^T (J J^T + damping)^-1 miss, shape (n, batch)."""
    transposed = np.swapaxes(j, 1, 2)
    square = j @ transposed + damping[:, None, None] * np.eye(6)
    return (transposed @ np.linalg.solve(square, miss.T[..., None]))[..., 0].T


def _miss(robot: Robot, posture: Posture, goals: FloatArray, tool: FloatArray) -> FloatArray:
    """What is missing to the place [m] and, as a turn, to the tool's direction [rad], shape (6, batch)."""
    axis = _tool_axis(robot, posture)
    turn = cross(axis, np.broadcast_to(tool[:, None], axis.shape))
    sine, cosine = np.linalg.norm(turn, axis=0), tool @ axis
    angle = np.arctan2(sine, cosine)
    # straight backwards any axis will do; one across the tool is taken
    across = cross(axis, np.broadcast_to(np.eye(3)[np.argmin(np.abs(tool))][:, None], axis.shape))
    turn = np.where((sine < 1e-9) & (cosine < 0), across, turn)
    length = np.maximum(np.linalg.norm(turn, axis=0), 1e-300)
    return np.concatenate([goals - contact_point(robot, posture), turn / length * angle])


def _tool_axis(robot: Robot, posture: Posture) -> FloatArray:
    return np.asarray(robot.flange.rotation[:, 2] @ posture.rotations[-1])


def _tool_rates(robot: Robot, posture: Posture) -> FloatArray:
    """How the joints turn the tool's axis, the turn about the axis itself left out, shape (3, n, batch)."""
    axis = _tool_axis(robot, posture)[:, None]
    return np.asarray(posture.turning - axis * (axis * posture.turning).sum(axis=0))
