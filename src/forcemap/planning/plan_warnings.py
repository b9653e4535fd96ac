"""What a plan will not give, and what speaks against the map that further measurements rest on, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.plan import Device
from forcemap.errors import InputError
from forcemap.maps.bounds import MIN_DEGREES_OF_FREEDOM
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import Form
from forcemap.planning.expectation import Expectation, StandardExpectation, expected_forces, factor_of
from forcemap.planning.optimal_states import STATE_SD, expected_width

FEW_STATES = 18
"""Twice the nine coefficients of the default map; fewer leave a wide bound."""

LARGEST_STATE_SD = 0.06
"""Twice what the paper's robots show; above it impacts, speeds or the form are not what they should be."""

_SLOWEST_PROPOSED = 0.05  # [m/s]
_FALL = 0.01  # of the force; less is no turn
_SPEEDS = 65  # between the slowest and the fastest speed of a place


def few_states(training: FloatArray, accepted: int | None, form: Form, region: FloatArray) -> Iterator[str]:
    """The bound to expect of fewer than 18 states to train, which are refused unless their number is accepted."""
    count = len(training)
    if accepted is not None and accepted != count:
        raise InputError(
            f"states: found {accepted}, expected {count}, the number to train of this design, or none; "
            "to choose any number of states add --design i-optimal (Design.I_OPTIMAL)"
        )
    if count >= FEW_STATES:
        return
    words = _width_words(training, form, region)
    if accepted is None:
        raise InputError(
            f"states: found {count} to train, expected at least {FEW_STATES}: {words}; choose lower speeds, nearer "
            f"places or a device of larger range, or name the number ({count}) to plan them all the same"
        )
    yield f"{count} states to train, fewer than {FEW_STATES}: {words}"


def unchecked(expectation: Expectation | None, device: Device, limit: float) -> Iterator[str]:
    """What could not be checked for want of a figure."""
    if expectation is None:
        if not math.isnan(device.range):
            yield "no expected force is given, so no state was checked against the device range"
        if not math.isnan(limit):
            yield f"no expected force is given, so nothing tells whether {limit:g} N can be confirmed at these speeds"
    elif math.isnan(device.range):
        yield "the device range is not stated, so no state was checked against it"


def unconfirmed(
    states: FloatArray, measurable: Mask, expectation: Expectation | None, limit: float, apart: float
) -> Iterator[str]:
    """Where even the slowest planned speed is expected to exceed the limit, and the speed to add.

    No speed below the lowest measured one is ever confirmed, so a plan without it cannot answer there. As for safe
    speeds, only the first rise of the force counts, searched from below. States have shape (n, 3); where one of a
    place is `measurable`, those that are not do not count there.
    """
    if expectation is None or math.isnan(limit):
        return
    factor = factor_of(expectation)
    ordered = states[np.lexsort((states[:, 2], ~measurable))]
    slowest = ordered[np.unique(ordered[:, :2], axis=0, return_index=True)[1]]
    exceeding = slowest[factor * expected_forces(expectation, slowest) > limit]
    proposed = [
        speed
        for *place, planned in exceeding.tolist()
        if (speed := _slower(expectation, place, planned - apart, limit / factor))
    ]
    if not len(exceeding):
        return
    parts = [
        f"{limit:g} N is not expected to be confirmed at {len(exceeding)} of {len(slowest)} places: {factor:g} times "
        "the expected force exceeds it already at the slowest planned speed"
    ]
    if proposed:
        parts.append(f"add {min(proposed):.2f} m/s, which is expected to confirm it at {len(proposed)} of these")
    if hopeless := len(exceeding) - len(proposed):
        parts.append(f"at {hopeless} no speed from {_SLOWEST_PROPOSED:g} m/s up is expected to be confirmed")
    if isinstance(expectation, ForceMap):
        lowest = expectation.measured_range.lowest[2]
        parts.append(f"below its lowest measured speed, {lowest:g} m/s, the map extrapolates")
    elif isinstance(expectation, StandardExpectation):
        parts.append(
            "the contact model's force vanishes at rest, a robot's does not: an even lower speed may be needed"
        )
    yield "; ".join(parts)


def _slower(expectation: Expectation, place: list[float], below: float, force: float) -> float:
    """The highest speed [m/s] below another, in whole 0.01 m/s, up to which the expected force stays within `force`.

    0 where there is none.
    """
    highest = 0.0
    for step in range(round(100 * _SLOWEST_PROPOSED), 1001):
        if step / 100 >= below or expected_forces(expectation, np.array([[*place, step / 100]]))[0] > force:
            break
        highest = step / 100
    return highest


def map_warnings(force_map: ForceMap, states: FloatArray) -> Iterator[str]:
    """Where the predicted force falls with speed at the places of states, shape (n, 3), and states that scatter."""
    if force_map.fit is not None and force_map.fit.state_sd > LARGEST_STATE_SD:
        yield (
            f"states scatter by {100 * force_map.fit.state_sd:.1f} % about the map, expected at most "
            f"{100 * LARGEST_STATE_SD:g} %: check the recordings and the speeds, or compare forms (evaluate --forms)"
        )
    low, high = force_map.measured_range.speeds(states[:, 0], states[:, 1])
    low = np.fmin(np.where(np.isnan(low), force_map.measured_range.lowest[2], low), states[:, 2])
    high = np.fmax(high, states[:, 2])
    speeds = np.linspace(low, high, _SPEEDS, axis=1)
    force = np.asarray(force_map.predict(states[:, :1], states[:, 1:2], speeds))
    fall = force < (1 - _FALL) * np.maximum.accumulate(force, axis=1)
    places = np.unique(states[fall.any(axis=1), :2], axis=0)
    if len(places):
        first = int(fall.any(axis=1).argmax())
        top = speeds[first, force[first, : fall[first].argmax() + 1].argmax()]
        yield (
            f"the predicted force falls with speed at {len(places)} of {len(np.unique(states[:, :2], axis=0))} planned "
            f"places, first at d = {states[first, 0]:g} m, h = {states[first, 1]:g} m above {top:.3f} m/s: no robot's "
            "force does, so the map is wrong there; begin with the slowest run and stop where a force exceeds the "
            "expected one"
        )


def _width_words(states: FloatArray, form: Form, region: FloatArray) -> str:
    """The bound to expect of a campaign, in words."""
    if len(states) < (fewest := len(form.terms) + MIN_DEGREES_OF_FREEDOM):
        return f"no tolerance bound can be had from fewer than {fewest} states of {form.name}"
    width = expected_width(states, form=form, region=region)
    if math.isnan(width):
        return f"they do not determine {form.name}"
    return (
        f"the bound is expected to lie {100 * width:.0f} % above the prediction of {form.name} on average "
        f"(if states scatter by {100 * STATE_SD:g} %)"
    )
