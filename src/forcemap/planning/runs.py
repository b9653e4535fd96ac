"""States -> runs of a plan, and a plan -> a longer one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.errors import InputError
from forcemap.findings import Finding


def runs_of(
    states: FloatArray,
    repeats: int,
    expected_force: FloatArray,
    *,
    role: str = "train",
    prefix: str = "",
    expected_from: Finding | None = None,
    warnings: tuple[Finding, ...] = (),
) -> MeasurementPlan:
    """A plan of states, shape (n, 3), in their order; their names give place and speed in thousandths."""
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


def slow_to_fast(states: FloatArray) -> FloatArray:
    """States, shape (n, 3), in the order of measurement: slow to fast, at a speed far to near, then low to high."""
    return states[np.lexsort((states[:, 1], -states[:, 0], states[:, 2]))]


def extend_plan(plan: MeasurementPlan, more: MeasurementPlan) -> MeasurementPlan:
    """A plan followed by the runs of another; its own runs stay as they are.

    Raises
    ------
    InputError
        A state of the other is planned already.
    """
    taken = {name.lower() for name in plan.states}
    for name in more.states:
        if name.lower() in taken:
            raise InputError(f"state {name} is planned already; measure it, or take its rows out of the plan")
    joined: dict[str, Any] = {name: np.concatenate([column, vars(more)[name]]) for name, column in plan.arrays.items()}
    return replace(more, **joined)


def _thousandths(value: float) -> str:
    return f"{1000 * value:.10g}".replace(".", "_")
