"""What was measured near a state at a lower speed: the force to expect is never put below it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcemap.campaigns.state import States, StateTolerance
from forcemap.planning.places import FloatArray

NEAR = 0.05
"""[m]; a place this close is near enough to speak for another one."""


def measured_before(states: FloatArray, known: States, tolerance: StateTolerance) -> FloatArray:
    """Largest force measured near states, shape (n, 3), at no higher speed [N]; 0 where there is none, shape (n,)."""
    return np.asarray(np.where(_before(states, known, tolerance), _largest(known), 0.0).max(axis=1, initial=0.0))


def raised_by_measured(
    upper: FloatArray, states: FloatArray, known: States, known_upper: FloatArray, tolerance: StateTolerance
) -> FloatArray:
    """A bound [N] of states, shape (n,), raised where what was measured near them contradicts it.

    It is contradicted where a force measured near a state at no higher speed lies above the bound there, or above that
    of the state: force grows with speed. The bound then is no guide, and the force of the fastest of the slower
    impacts is continued in proportion to speed, which a force that is positive at rest and grows evenly stays below.

    Parameters
    ----------
    upper : array (n,)
    states : array (n, 3)
        (distance, height, speed) [m, m, m/s].
    known : States
        Everything measured, test states too.
    known_upper : array (m,)
        The bound at the known states [N].
    tolerance : StateTolerance
        How far repeats of a state may lie apart.
    """
    before, force = _before(states, known, tolerance), _largest(known)
    contradicted = (before & ((force > known_upper) | (force > upper[:, None]))).any(axis=1)
    fastest = np.where(before, known.speed, -np.inf).max(axis=1, initial=-np.inf)
    last = before & (known.speed >= fastest[:, None] - tolerance.speed)
    ratio = np.maximum(states[:, 2:] / known.speed, 1.0)
    continued = np.where(last, force * ratio, 0.0).max(axis=1, initial=0.0)
    raised = np.maximum(continued, measured_before(states, known, tolerance))
    return np.asarray(np.where(contradicted, np.maximum(upper, raised), upper))


def _before(states: FloatArray, known: States, tolerance: StateTolerance) -> NDArray[np.bool_]:
    """Which known states lie near states, at no higher speed, shape (n, m)."""
    apart = np.hypot(states[:, :1] - known.distance, states[:, 1:2] - known.height)
    near = apart <= max(NEAR, 1.5 * tolerance.place) + 1e-9
    return np.asarray(near & (known.speed <= states[:, 2:] + tolerance.speed))


def _largest(known: States) -> FloatArray:
    """Largest force of every state, censored impacts with what they reached at least [N]."""
    return np.asarray(np.fmax(known.highest, known.at_least))
