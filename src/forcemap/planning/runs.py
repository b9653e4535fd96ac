"""States -> runs of a plan, and a plan -> a longer one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.errors import InputError

_ARRAYS = ("state_id", "repeat", "role", "distance", "height", "speed", "base_angle", "expected_force")


def runs_of(
    states: FloatArray,
    repeats: int,
    expected_force: FloatArray,
    *,
    role: str = "train",
    prefix: str = "",
    expected_from: str = "",
    warnings: tuple[str, ...] = (),
) -> MeasurementPlan:
    """A plan of states, shape (n, 3), in their order; each is named for its place and speed in thousandths."""
    names = [prefix + "-".join(f"{x}{_thousandths(v)}" for x, v in zip("dhv", s, strict=True)) for s in states.tolist()]
    row = np.repeat(np.arange(len(states)), repeats)
    return MeasurementPlan(
        state_id=np.array(names, dtype=np.str_)[row],
        repeat=np.tile(np.arange(1, repeats + 1), len(states)),
        role=np.full(row.size, role),
        distance=states[row, 0],
        height=states[row, 1],
        speed=states[row, 2],
        base_angle=np.full(row.size, np.nan),
        expected_force=expected_force[row],
        expected_from=expected_from,
        warnings=warnings,
    )


def extend_plan(plan: MeasurementPlan, more: MeasurementPlan) -> MeasurementPlan:
    """A plan with the runs of another behind its own, which stay as they are.

    Raises
    ------
    InputError
        A state of the other is planned already.
    """
    taken = {name.lower() for name in plan.states}
    for name in more.states:
        if name.lower() in taken:
            raise InputError(f"state {name} is planned already; measure it, or take its rows out of the plan")
    joined: dict[str, Any] = {name: np.concatenate([getattr(plan, name), getattr(more, name)]) for name in _ARRAYS}
    return replace(more, **joined)


def select_runs(plan: MeasurementPlan, index: Mask | Indices) -> MeasurementPlan:
    """The runs of a plan that a mask, or numbers in their order, pick."""
    picked: dict[str, Any] = {name: getattr(plan, name)[index] for name in _ARRAYS}
    return replace(plan, **picked)


def _thousandths(value: float) -> str:
    return f"{1000 * value:.10g}".replace(".", "_")
