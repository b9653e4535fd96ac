"""Plans of measurements: which impacts to make, in which order."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import Indices
from forcemap.campaigns.plan import Device, MeasurementPlan
from forcemap.campaigns.state import StateTolerance, places as places_of
from forcemap.errors import InputError
from forcemap.findings import Finding
from forcemap.maps.forms import CFM_3D, Form
from forcemap.planning.chosen_states import Candidates, Chosen, names_of_states, of_grid, of_spread
from forcemap.planning.design import LARGEST, Design, angles_of, axis_of, check_limit, require_whole
from forcemap.planning.expectation import Expectation, expected_forces, source_of
from forcemap.planning.plan_warnings import above_range, few_states, planned_slow, unchecked, unconfirmed

REPEATS = 3
"""Impacts of every state, unless stated; a choice."""

AGAIN = 3
"""States of the spread design that are measured again at the end, unless stated. A choice: one state shows no drift,
for changes scatter (docs/decisions.md)."""


@dataclass(frozen=True, eq=False)
class DesignedPlan(MeasurementPlan):
    """A plan, how its states were chosen and, for an I-optimal one, the bound to expect; neither is in the file.

    Parameters
    ----------
    note : Finding or None
        How states were spread, or from what I-optimal ones were chosen and the bound to expect; None for other designs.
    bound_width : float
        Mean over the candidates of the tolerance bound above the prediction, as a share of it; NaN for other designs.
    """

    note: Finding | None = None
    bound_width: float = math.nan


def plan_measurements(
    distances: ArrayLike,
    heights: ArrayLike,
    speeds: ArrayLike,
    *,
    design: Design = Design.SPREAD,
    repeats: int = REPEATS,
    places: int | None = None,
    again: int | None = None,
    base_angles: Sequence[float] = (),
    reach: float = math.inf,
    device: Device = Device(),  # noqa: B008 - frozen
    expected_force: Expectation | None = None,
    limit: float = math.nan,
    tolerance: StateTolerance = StateTolerance(),  # noqa: B008 - frozen
    states: int | None = None,
    form: Form = CFM_3D,
    seed: int = 0,
) -> DesignedPlan:
    """Plan the impacts of a campaign, repeats of a state together.

    SPREAD takes the corners of the places at the slowest and the fastest speed, and spreads the other states over
    places and speeds between them (docs/decisions.md says why). At the end some states are measured again, with role
    test: they show drift. For SPREAD and I_OPTIMAL a place's impacts are together, slow to fast, so that the device is
    set up once for each: at the corners first, far before near and high before low, then at the others in random order.

    The other designs go from slow to fast over all places, and at each speed from far to near. PAPER measures every
    combination of three or more values along each axis. FULL_GRID measures a finer grid: every second value, and the
    last, trains; the others test. SYMMETRY measures every combination at several angles of the base joint, all with
    role test; the repeats of a state are numbered on over the angles. I_OPTIMAL chooses among every combination the
    states that make the prediction of a form most precise (`optimal_states`), among them the slowest and the fastest at
    the corners of the places, so that the measured range stays as wide as it can; precise where the expected force is
    within the limit, if both are given.

    What cannot be measured is left out and listed. SPREAD moves it instead: places to within the reach, but not out of
    the ranges, the fastest speed of a place to what the device is expected to measure.

    Fewer than 18 states to train are refused unless `states` names their number, with the bound to expect.

    Parameters
    ----------
    distances, heights, speeds : float or array
        Values to measure [m], [m], [m/s]. For SPREAD the lowest and the highest. Just two are the ends of a range for
        PAPER, too, which adds the middle, for FULL_GRID, which adds three values between, and for I_OPTIMAL, which adds
        up to seven (to 0.001). More are measured as given (I_OPTIMAL: chosen from), and so are all of SYMMETRY.
    design : Design
        Which states are measured.
    repeats : int
        Impacts of every state; for SYMMETRY at every angle.
    places : int, optional
        SPREAD: number of places, 14 if not given, or as many as the states allow: at least three more than the form
        has terms of place alone (9 for CFM_3D), at most four fewer than states. I_OPTIMAL: the most places.
    again : int, optional
        How many states, of as many places, are measured again at the end, as often as before; for SPREAD 3 if not
        given, else none.
    base_angles : sequence of float
        Angles of the base joint [deg]; two or more for SYMMETRY, else none or one.
    reach : float
        Largest distance of a place from the origin of the base [m].
    device : Device
        The force measuring device; it measures up to its range less its error.
    expected_force : ForceMap, StandardExpectation or callable, optional
        The force to expect [N] at (distance, height, speed).
    limit : float
        Force limit that is to be confirmed [N]; NaN if none. A warning says where the speeds are not low enough.
    tolerance : StateTolerance
        How far repeats of a state may lie apart; values must lie further apart.
    states : int, optional
        Number of states to train: of SPREAD, 27 if not given; of I_OPTIMAL, 18 if not given; else the number that is
        accepted although it is below 18.
    form : Form
        The map that the states are for, and whose bound is stated.
    seed : int
        Of the places of SPREAD, the search of I_OPTIMAL and the order of the places of both.

    Returns
    -------
    DesignedPlan
        A MeasurementPlan; for I_OPTIMAL it says how many states were chosen from, and the bound to expect.

    Raises
    ------
    InputError
        A figure that is not in its range, too few values, values too close together, no state is left, or fewer than
        18 states to train.
    TooFewStates, RankDeficient
        SPREAD, I_OPTIMAL: the states do not determine the form.

    Examples
    --------
    >>> plan = plan_measurements((0.56, 0.86), (0.14, 0.46), (0.2, 0.4))
    >>> len(plan.states), len(plan), plan.recording[0].item(), plan.recording[-1].item()
    (27, 90, 'd860-h460-v200-r1', 'd560-h460-v200-r6')
    """
    if not isinstance(design, Design):
        raise InputError(f"design: found {design!r}, expected one of {', '.join(f'Design.{d.name}' for d in Design)}")
    axes = _axes(distances, heights, speeds, design, tolerance)
    angles = angles_of(base_angles, design)
    require_whole("repeats", repeats)
    if not reach > 0:
        raise InputError(f"reach: found {reach:g}, expected metres above 0")
    if not (math.isnan(limit) or 0 < limit < math.inf):
        raise InputError(f"limit: found {limit:g}, expected newtons above 0 and finite")
    check_limit(limit, device.highest_limit)

    if places is not None and design not in (Design.SPREAD, Design.I_OPTIMAL):
        raise InputError(f"places: found {places}, expected none: those of --design {design} are its grid")
    expected = partial(expected_forces, expected_force)
    candidates = Candidates(axes, form, reach, device.highest_limit, expected, tolerance, seed)
    if design is Design.SPREAD:
        chosen = of_spread(candidates, states, places)
    else:
        chosen = of_grid(design, candidates, states, places, limit)
    few = [] if design is Design.SYMMETRY else few_states(chosen.states[chosen.trains], states, form, chosen.possible)
    row, runs = _runs(chosen, angles, repeats, _measured_again(chosen, design, again))
    return DesignedPlan(
        **runs,
        expected_force=expected(chosen.states)[row],
        left_out=chosen.left_out,
        warnings=(
            *few,
            *chosen.warnings,
            *unchecked(expected_force, device, limit),
            *above_range(chosen.states, expected_force, device),
            *planned_slow(chosen.states, tolerance.speed),
            *unconfirmed(chosen.slow, chosen.measurable, expected_force, limit, tolerance.speed),
        ),
        expected_from=source_of(expected_force, chosen.states),
        note=chosen.note,
        bound_width=chosen.bound_width,
    )


def _axes(
    distances: ArrayLike, heights: ArrayLike, speeds: ArrayLike, design: Design, tolerance: StateTolerance
) -> tuple[list[float], list[float], list[float]]:
    """The values to measure along each axis, ascending [m], [m], [m/s]."""
    most = f"up to {LARGEST:g}"
    return (
        axis_of("distances", distances, f"metres above 0 and {most}", 0.0, design, tolerance.place),
        axis_of("heights", heights, f"metres from {-LARGEST:g} to {LARGEST:g}", -math.inf, design, tolerance.place),
        axis_of("speeds", speeds, f"metres per second above 0 and {most}", 0.0, design, tolerance.speed),
    )


def _measured_again(chosen: Chosen, design: Design, again: int | None) -> Indices:
    """Numbers of the states that are measured again at the end: the first of the places, at their slowest speed."""
    first = np.sort(np.unique(places_of(*chosen.states[:, :2].T), return_index=True)[1])
    if again is None:
        again = AGAIN if design is Design.SPREAD else 0
    require_whole("again", again, 0)
    if again > first.size:
        raise InputError(f"again: found {again}, expected at most {first.size}, the number of places")
    return np.asarray(first[:again])


def _runs(chosen: Chosen, angles: list[float], repeats: int, again: Indices) -> tuple[Indices, dict[str, Any]]:
    """Number of the state of every run, and the columns of the plan but for the expected force."""
    states, runs = chosen.states, len(angles) * repeats
    number, once = np.arange(runs + repeats) + 1, len(states) * runs
    row = np.concatenate([np.repeat(np.arange(len(states)), runs), np.repeat(again, repeats)])
    angle = np.tile(np.repeat(angles, repeats), len(states))
    return row, {
        "state_id": names_of_states(states)[row],
        "repeat": np.concatenate([np.tile(number[:runs], len(states)), np.tile(number[runs:], again.size)]),
        "role": np.where(chosen.trains[row] & (np.arange(row.size) < once), "train", "test"),
        "distance": states[row, 0],
        "height": states[row, 1],
        "speed": states[row, 2],
        "base_angle": np.append(angle, np.full(again.size * repeats, angles[0])),
    }
