"""What was measured near a state: no lower force is expected there, and no much higher speed is planned."""

from __future__ import annotations

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.state import States, StateTolerance
from forcemap.planning.places import PlaceRange

NEAR = 0.05
"""A place this close [m] stands for another one; a choice, printed with every plan."""

NEARBY = 0.36
"""A measured place this close, as a share of the range of places, limits the speed planned at another one. A choice:
just above the diagonal between places that lie a quarter of the range apart along both axes, 0.354."""

ONE_PLACE = 0.02
"""Share of the range of places within which measured places count as one when speeds are planned. A choice: well
below the distance between two places of a plan."""

_NEAR_REPEATS = 1.5  # the same as NEAR, in tolerances of repeats, where these are wide
_ROUNDING = 1e-9  # [m]


def measured_before(states: FloatArray, known: States, tolerance: StateTolerance) -> FloatArray:
    """Largest force measured near states, shape (n, 3), at no higher speed [N]; 0 where there is none, shape (n,)."""
    return np.asarray(np.where(_before(states, known, tolerance), largest_force(known), 0.0).max(axis=1, initial=0.0))


def raised_by_measured(
    upper: FloatArray, states: FloatArray, known: States, known_upper: FloatArray, tolerance: StateTolerance
) -> FloatArray:
    """A bound [N] of states, shape (n,), raised where measured forces contradict it.

    It is contradicted where a force measured near a state at no higher speed lies above the bound at that speed, or
    above that of the state: force grows with speed. The bound then is no guide, and the force of the fastest of the
    slower impacts is extrapolated in proportion to speed. A force that is positive at rest and grows linearly stays
    below that.

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
    before, force = _before(states, known, tolerance), largest_force(known)
    contradicted = (before & ((force > known_upper) | (force > upper[:, None]))).any(axis=1)
    fastest = np.where(before, known.speed, -np.inf).max(axis=1, initial=-np.inf)
    last = before & (known.speed >= fastest[:, None] - tolerance.speed)
    ratio = np.maximum(states[:, 2:] / known.speed, 1.0)
    continued = np.where(last, force * ratio, 0.0).max(axis=1, initial=0.0)
    raised = np.maximum(continued, measured_before(states, known, tolerance))
    return np.asarray(np.where(contradicted, np.maximum(upper, raised), upper))


def saturated_before(states: FloatArray, known: States, place_range: PlaceRange, tolerance: StateTolerance) -> Mask:
    """Which states, shape (n, 3), are as fast as an impact that saturated the device there, or nearby farther out."""
    full = known.select(known.censored > 0)
    apart = np.hypot(states[:, :1] - full.distance, states[:, 1:2] - full.height)
    inwards = states[:, :1] <= full.distance + tolerance.place
    near = (apart <= NEAR + _ROUNDING) | (inwards & (place_range.apart(states, full.coordinates) <= NEARBY))
    return np.asarray((near & (states[:, 2:] > full.speed - tolerance.speed)).any(axis=1))


def slowest_nearby(states: FloatArray, known: States, place_range: PlaceRange) -> FloatArray:
    """Slowest speed measured nearby, or at the nearest place if there is none nearby, shape (n,) [m/s].

    Infinite where the place itself was measured.
    """
    apart = place_range.apart(states, known.coordinates)
    nearest = apart.min(axis=1)
    near = apart <= np.maximum(nearest + ONE_PLACE, NEARBY)[:, None]
    slowest = np.where(near, known.speed, np.inf).min(axis=1)
    return np.asarray(np.where(nearest < ONE_PLACE, np.inf, slowest))


def _before(states: FloatArray, known: States, tolerance: StateTolerance) -> Mask:
    """Which known states lie near states, at no higher speed, shape (n, m)."""
    apart = np.hypot(states[:, :1] - known.distance, states[:, 1:2] - known.height)
    near = apart <= max(NEAR, _NEAR_REPEATS * tolerance.place) + _ROUNDING
    return np.asarray(near & (known.speed <= states[:, 2:] + tolerance.speed))


def largest_force(known: States) -> FloatArray:
    """Largest force of every state [N]; a censored impact counts with the force it reached at least."""
    return np.asarray(np.fmax(known.highest, known.at_least))
