"""What a plan cannot give, and doubts about the map that further measurements rest on."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.plan import Device
from forcemap.direction import RAISED_FROM
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.maps.bounds import FEW_STATES, MIN_DEGREES_OF_FREEDOM
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import Form
from forcemap.planning.design import LARGEST
from forcemap.planning.expectation import Expectation, StandardExpectation, expected_forces, factor_of, rest_of
from forcemap.planning.optimal_states import STATE_SD, bound_from, expected_width

_SLOWEST_PROPOSED = 0.05  # [m/s]; a choice, the slowest speed that `next` plans unless stated
_STEPS_PER_MPS = 100  # speeds are proposed in whole 0.01 m/s
_FALL = 0.01  # share of the force; a smaller fall does not count as one
_SPEED_APART = 0.005  # [m/s]; slower by less than that is no extrapolation
_SPEEDS = 65  # sampled between the slowest and the fastest speed of a place; a choice


def few_states(training: FloatArray, accepted: int | None, form: Form, region: FloatArray) -> Iterator[Finding]:
    """The bound to expect from fewer than 18 states to train, which are refused unless their number is accepted."""
    count = len(training)
    if accepted is not None and accepted != count:
        raise InputError(
            f"states: found {accepted}, expected {count}, the number to train of this design, or none; "
            "any number of states can be had of --design spread or i-optimal"
        )
    if count >= FEW_STATES:
        if not bound_from(training, form):
            yield Finding.of(FindingKind.FORM_NOT_DETERMINED, form=form.name)
        return
    fewest = len(form.terms) + MIN_DEGREES_OF_FREEDOM
    width = expected_width(training, form=form, region=region)
    if accepted is None:
        wide = f"the bound is expected to lie {100 * width:.0f} % above the prediction on average"
        none = f"no tolerance bound can be had from fewer than {fewest} states of {form.name}, or at too few places"
        raise InputError(
            f"states: found {count} to train, expected at least {FEW_STATES}: {wide if width > 0 else none}; choose "
            f"lower speeds, nearer places or a device of larger range, or name the number ({count}) to plan them all "
            "the same"
        )
    if count < fewest:
        why = Finding.of(FindingKind.NO_BOUND_FROM_STATES, fewest=fewest, form=form.name, states=count)
    elif math.isnan(width):
        why = Finding.of(FindingKind.FORM_NOT_DETERMINED, form=form.name)
    else:
        why = Finding.of(FindingKind.EXPECTED_WIDTH, width=width, form=form.name, state_sd=STATE_SD)
    yield Finding.of(FindingKind.FEW_STATES, why, states=count, fewest=FEW_STATES)


def unchecked(expectation: Expectation | None, device: Device, limit: float) -> Iterator[Finding]:
    """What could not be checked because a figure is missing."""
    if expectation is None:
        if not math.isnan(device.range):
            yield Finding.of(FindingKind.RANGE_NOT_CHECKED)
        if not math.isnan(limit):
            yield Finding.of(FindingKind.LIMIT_NOT_CHECKED, limit_N=limit)
    elif math.isnan(device.range):
        yield Finding.of(FindingKind.NO_RANGE_TO_CHECK)


def above_range(states: FloatArray, expectation: Expectation | None, device: Device) -> Iterator[Finding]:
    """How many planned states, shape (n, 3), may exceed the device range if forces are as much above the standard's
    coarse model as they may be."""
    if not isinstance(expectation, StandardExpectation) or math.isnan(device.range):
        return
    expected, factor, rest = expected_forces(expectation, states), factor_of(expectation), rest_of(expectation)
    if above := int(np.sum(np.fmax(factor * expected, expected + rest) > device.highest_limit)):
        figures = {"factor": factor, "rest_N": rest, "most_N": device.highest_limit}
        yield Finding.of(FindingKind.RANGE_AT_WORST, states=above, of=len(states), **figures)


def planned_slow(states: FloatArray, apart: float) -> Iterator[Finding]:
    """That planned states, shape (n, 3), are so slow that a robot may feel them late: by more than `apart` [m/s]."""
    slowest = float(states[:, 2].min())
    if slowest < RAISED_FROM - apart:
        yield Finding.of(FindingKind.PLANNED_SLOW, slowest_mps=slowest, from_mps=RAISED_FROM)


def unconfirmed(
    states: FloatArray, measurable: Mask, expectation: Expectation | None, limit: float, apart: float
) -> Iterator[Finding]:
    """Places where even the slowest planned speed is expected to exceed the limit, and the speed to add.

    No speed below the lowest measured one is ever confirmed, so such a plan gives no speed there. As for safe speeds,
    only the first rise of the force counts, searched from below. States have shape (n, 3); at a place with `measurable`
    states the others are ignored.
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
    parts = []
    if proposed:
        parts.append(Finding.of(FindingKind.SPEED_TO_ADD, speed_mps=min(proposed), places=len(proposed)))
    if hopeless := len(exceeding) - len(proposed):
        parts.append(Finding.of(FindingKind.NO_SPEED_TO_ADD, places=hopeless, slowest_mps=_SLOWEST_PROPOSED))
    if isinstance(expectation, ForceMap):
        lowest = float(expectation.measured_range.lowest[2])
        parts.append(Finding.of(FindingKind.MAP_EXTRAPOLATES_BELOW, lowest_mps=lowest))
    elif isinstance(expectation, StandardExpectation):
        parts.append(Finding.of(FindingKind.MODEL_VANISHES_AT_REST))
        parts += [Finding.of(FindingKind.PAYLOAD_NOT_STATED)] * math.isnan(expectation.payload)
    places = {"places": len(exceeding), "of": len(slowest), "factor": factor}
    yield Finding.of(FindingKind.NOT_EXPECTED_TO_CONFIRM, *parts, limit_N=limit, **places)


def _slower(expectation: Expectation, place: list[float], below: float, force: float) -> float:
    """The highest speed [m/s] below another, in whole 0.01 m/s, up to which the expected force stays within `force`.

    0 if there is none.
    """
    highest = 0.0
    for step in range(round(_STEPS_PER_MPS * _SLOWEST_PROPOSED), round(_STEPS_PER_MPS * LARGEST) + 1):
        speed = step / _STEPS_PER_MPS
        if speed >= below or expected_forces(expectation, np.array([[*place, speed]]))[0] > force:
            break
        highest = speed
    return highest


def map_warnings(force_map: ForceMap, states: FloatArray) -> Iterator[Finding]:
    """Doubts about what a map predicts at states, shape (n, 3).

    Its own states scatter about it; these are slower than all measured, where it continues, and impacts that clamp may
    exceed it; the prediction falls there.
    """
    if force_map.form_test is not None:
        yield from force_map.form_test.scatter
    slowest, slower = force_map.measured_range.lowest[2], float(states[:, 2].min())
    if force_map.phase_two.barred and slower < slowest:
        figures = {"impacts": force_map.phase_two.barred, "slower_mps": slower, "slowest_mps": slowest}
        yield Finding.of(FindingKind.CLAMPS_SLOWER, **figures)
    if below := int(np.sum(states[:, 2] < slowest - _SPEED_APART)):
        yield Finding.of(FindingKind.BELOW_MEASURED_PLANNED, states=below, slowest_mps=float(slowest))
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
        where = {"distance_m": states[first, 0], "height_m": states[first, 1], "speed_mps": top}
        planned = len(np.unique(states[:, :2], axis=0))
        yield Finding.of(FindingKind.PREDICTION_FALLS, places=len(places), of=planned, **where)
