"""Which states at released speeds confirm a map, and how probable it is that they do."""

from __future__ import annotations

import math

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.campaigns.state import StateTolerance
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.planning.measured_before import measured_before
from forcemap.planning.places import PlaceRange


def worth_confirming(
    force_map: ForceMap, bound: Bound, states: FloatArray, tolerance: StateTolerance
) -> tuple[FloatArray, list[str]]:
    """The states that the device can measure and that are no repeats of the map's own; and what is wrong with them."""
    if force_map.fit is not None:
        before = measured_before(states, force_map.fit.states, tolerance)
        highest = force_map.device_range - force_map.conditions.device.error_or_default
        states = states[~(np.fmax(bound.upper(force_map, *states.T), before) > highest)]
    new = no_repeats(states, force_map.measured_range.points, tolerance)
    if not len(states) or np.sum(new) >= 2:
        return states[new], []
    return states, [
        "nearly every speed is released at a state the map was fitted to: impacts there repeat it and do not count as "
        "a test; measure at faster speeds, or between the places, first"
    ]


def no_repeats(states: FloatArray, others: FloatArray, tolerance: StateTolerance) -> Mask:
    """Which states, shape (n, 3), are no repeats of others, shape (m, 3)."""
    apart = np.abs((states[:, None] - others[None]) / tolerance.scale).max(axis=2)
    return np.asarray(apart.min(axis=1, initial=np.inf) > 1)


def spread(places: PlaceRange, states: FloatArray, first: list[int], count: int) -> Indices:
    """The first ones, then each the farthest from those before it."""
    chosen = list(dict.fromkeys(first))
    while len(chosen) < min(count, len(states)):
        away = places.apart(states, states[chosen]).min(axis=1)
        if not away.max() > 0:
            break
        chosen.append(int(away.argmax()))
    return np.array(chosen)


def any_above(force_map: ForceMap, states: FloatArray, newtons: FloatArray, factor: float) -> float:
    """Probability that one of new states measures more, if forces are `factor` times the map's; NaN if not known.

    ln F of a new state less the prediction, over s sqrt(1 + l), has Student's t distribution; that the states share
    the map's error makes the product too high rather than too low.
    """
    if force_map.fit is None or not len(states) or not force_map.fit.between_states.degrees_of_freedom > 0:
        return math.nan
    from scipy.special import stdtr

    leverage = np.asarray(force_map.leverage(*states.T))
    allowance = np.log(newtons / (factor * np.asarray(force_map.predict(*states.T))))
    t = allowance / (force_map.fit.state_sd * np.sqrt(1 + leverage))
    return float(1 - np.prod(stdtr(force_map.fit.between_states.degrees_of_freedom, t)))


def contradictions(plan: MeasurementPlan, measured: FloatArray, upper: FloatArray) -> list[str]:
    """Runs near which an impact at a lower speed exceeded their bound."""
    return [
        f"{plan.state_id[i]}: {measured[i]:.0f} N were measured within 5 cm at a lower speed, above its bound of "
        f"{upper[i]:.0f} N: the map is wrong there"
        for i in np.flatnonzero(measured > upper)
    ]
