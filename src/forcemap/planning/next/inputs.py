"""What a sequential campaign is given, checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.dataset import Binding, ImpactDataset, PhaseTwo
from forcemap.errors import InputError
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.planning.expectation import Expectation, StandardExpectation
from forcemap.speeds.usable_limits import UsableLimit, limit_for

_SPEED_STEP = 0.02  # [m/s]


def limit_to_confirm(
    limit: ForceLimit | NewtonLimit | float,
    contact: Contact | None,
    conditions: Conditions,
    dataset: ImpactDataset | None,
) -> UsableLimit:
    """The limit, and what of the impacts so far forbids it; one in newtons counts as quasi-static unless named."""
    stated = limit if isinstance(limit, ForceLimit) else NewtonLimit.of(limit, None, None)
    if isinstance(stated, NewtonLimit) and np.ndim(stated.force):
        raise InputError("limit: expected one limit in newtons")
    usable = limit_for(
        stated,
        contact,
        conditions,
        phase_two=PhaseTwo() if dataset is None else dataset.phase_two,
        binding=Binding() if dataset is None else dataset.binding,
    )
    if dataset is None and math.isnan(conditions.device.stiffness):  # can be stated until there is a map
        return replace(usable, refusal="")
    return usable


def check_budget(
    speeds: Sequence[float], batch: int, states: int | None, repeats: int, least_gain: float
) -> tuple[float, float]:
    """Slowest and fastest speed [m/s], after a look at the figures."""
    for name, number in (("batch", batch), ("states", states), ("repeats", repeats)):
        if number is None:  # states: a budget is chosen
            continue
        if isinstance(number, bool) or not isinstance(number, int | np.integer) or number < 1:
            raise InputError(f"{name}: found {number!r}, expected a whole number of at least 1")
    if not 0 <= least_gain < math.inf:
        raise InputError(f"least gain: found {least_gain:g} m/s, expected a finite number of at least 0")
    given = [float(value) for value in speeds]
    if len(given) < 2 or not np.isfinite(given).all() or not 0 < min(given) < max(given) <= 10:
        raise InputError(f"speeds: found {list(speeds)}, expected (slowest, fastest) in metres per second, up to 10")
    return min(given), max(given)


def highest_force(conditions: Conditions, dataset: ImpactDataset | None, largest_force: float, limit: float) -> float:
    """The force that no impact is to exceed [N]."""
    device = conditions.device
    reach = dataset.device_range - device.error_or_default if dataset is not None else device.highest_limit
    if not largest_force > 0:
        raise InputError(f"largest force: found {largest_force:g} N, expected newtons above 0")
    if math.isnan(reach) and math.isinf(largest_force):
        raise InputError(
            "device range: not stated; state it (--device-range-N), or the largest force that an impact may reach "
            "(--largest-force-N)"
        )
    if limit > reach:
        raise InputError(
            f"limit: found {limit:g} N, expected at most {reach:g} N, the device's range less its error: "
            "this device cannot confirm it"
        )
    return float(np.fmin(reach, largest_force))


def expectation_of(expected_force: Expectation | None, conditions: Conditions) -> Expectation:
    """What tells the force to expect: as given, else the standard's contact model."""
    if expected_force is not None:
        return expected_force
    if math.isnan(conditions.moving_mass):
        raise InputError(
            "expected force: nothing tells it before there is a bound; state the robot's moving mass, or give a map "
            "of a similar robot"
        )
    payload = 0.0 if math.isnan(conditions.payload) else conditions.payload
    stiffness = conditions.device.stiffness
    if math.isnan(stiffness):
        return StandardExpectation(conditions.moving_mass, payload)
    return StandardExpectation(conditions.moving_mass, payload, stiffness=stiffness)


def speeds_between(slowest: float, fastest: float) -> FloatArray:
    """Speeds to choose from [m/s], ascending; the slowest is among them."""
    return np.round(np.arange(slowest, fastest + 1e-9, _SPEED_STEP), 6)
