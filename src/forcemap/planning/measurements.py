"""Plans of measurements: which impacts to make, in which order."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.campaigns.plan import Device
from forcemap.campaigns.state import StateTolerance
from forcemap.errors import InputError
from forcemap.maps.forms import CFM_3D, Form
from forcemap.planning.design import Design, angles_of, axis_of, check_figures, names_of
from forcemap.planning.designed_plan import DesignedPlan, design_note
from forcemap.planning.expectation import Expectation, expected_at, source_of
from forcemap.planning.optimal_states import DesignedStates, optimal_states
from forcemap.planning.plan_warnings import FEW_STATES, few_states, refuse_few, unchecked, unconfirmed


def plan_measurements(
    distances: ArrayLike,
    heights: ArrayLike,
    speeds: ArrayLike,
    *,
    design: Design = Design.TRAINING,
    repeats: int = 3,
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
    """Plan the impacts of a campaign, slow before fast, far before near, repeats of a state together.

    TRAINING measures every combination of three or more values along each axis. FULL_GRID measures a finer grid:
    every second value, and the last, trains; the others test. SYMMETRY measures every combination at several angles
    of the base joint, all with role test; the repeats of a state are numbered on over the angles. I_OPTIMAL chooses
    among every combination the states that make the prediction of a form most precise (`optimal_states`), among them
    the slowest and the fastest at the corners of the places, so that the measured range stays as wide as it can.

    Fewer than 18 states to train are refused unless `states` names their number, with the bound to expect.

    Parameters
    ----------
    distances, heights, speeds : float or array
        Values to measure [m], [m], [m/s]. Just two are the ends of a range for TRAINING, which adds the middle, and
        for FULL_GRID and I_OPTIMAL, which add three values between (to 0.001). More are measured as given (I_OPTIMAL:
        chosen from), and so are all of SYMMETRY.
    design : Design
        Which states are measured.
    repeats : int
        Impacts of every state; for SYMMETRY at every angle.
    base_angles : sequence of float
        Angles of the base joint [deg]; two or more for SYMMETRY, else none or one.
    reach : float
        Largest distance of a place from the origin of the base [m]; farther ones are left out.
    device : Device
        The force measuring device; states expected above its range less its error are left out.
    expected_force : ForceMap, StandardExpectation or callable, optional
        The force to expect [N] at (distance, height, speed).
    limit : float
        Force limit that is to be confirmed [N]; NaN if none. A warning says where the speeds are not low enough.
    tolerance : StateTolerance
        How far repeats of a state may lie apart; values must lie further apart.
    states : int, optional
        Number of states to choose for I_OPTIMAL, 18 if not given; else the number to train that is accepted although
        it is below 18.
    form : Form
        The map that I_OPTIMAL is for, and whose bound is stated.
    seed : int
        Of the search of I_OPTIMAL.

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
        I_OPTIMAL: the states do not determine the form.

    Examples
    --------
    >>> plan = plan_measurements((0.56, 0.86), (0.14, 0.46), (0.2, 0.4))
    >>> len(plan.states), len(plan), plan.recording[0].item()
    (27, 81, 'd860-h140-v200-r1')
    """
    if not isinstance(design, Design):
        raise InputError(f"design: found {design!r}, expected one of {', '.join(f'Design.{d.name}' for d in Design)}")
    axes = (
        axis_of("distances", distances, "metres above 0 and up to 10", 0.0, design, tolerance.place),
        axis_of("heights", heights, "metres from -10 to 10", -math.inf, design, tolerance.place),
        axis_of("speeds", speeds, "metres per second above 0 and up to 10", 0.0, design, tolerance.speed),
    )
    angles = angles_of(base_angles, design)
    if isinstance(repeats, bool) or not isinstance(repeats, int | np.integer) or repeats < 1:
        raise InputError(f"repeats: found {repeats!r}, expected a whole number of at least 1")
    check_figures(reach, limit, device)

    names = [names_of(letter, values) for letter, values in zip("dhv", axes, strict=True)]
    training = [{*values[::2], values[-1]} for values in axes]
    planned = {state: "-".join(name[x] for name, x in zip(names, state, strict=True)) for state in _in_order(axes)}
    expected = {state: expected_at(expected_force, *state) for state in planned}
    kept, left_out, far = [], [], 0
    for state, name in planned.items():
        away = math.hypot(state[0], state[1])
        if away > reach:
            far += 1
            left_out.append(f"{name}: {away:.3f} m from the base, beyond the reach of {reach:g} m")
        elif expected[state] > device.highest_limit:
            most = f"the device measures up to {device.highest_limit:g} N (range less error)"
            left_out.append(f"{name}: {expected[state]:.0f} N expected, {most}")
        else:
            kept.append(state)
    if not kept:
        raise InputError(f"no state is left to measure, the first of {len(left_out)}: {left_out[0]}; change the values")
    possible, measurable = np.array(kept), set(kept)
    note, width = "", math.nan
    if design is Design.I_OPTIMAL:
        designed = _optimal(possible, FEW_STATES if states is None else states, form, tolerance, seed)
        kept, width = [kept[i] for i in designed.index.tolist()], designed.bound_width
        note = design_note(designed, form, possible=len(possible), far=far, forceful=len(left_out) - far)
        left_out = []  # no more than many others that were not chosen

    def role(state: tuple[float, float, float]) -> str:
        trains = all(x in chosen for x, chosen in zip(state, training, strict=True))
        whole = design in (Design.TRAINING, Design.I_OPTIMAL)
        return "train" if whole or (design is Design.FULL_GRID and trains) else "test"

    to_train = [state for state in kept if role(state) == "train"]
    if design is not Design.SYMMETRY:
        refuse_few(to_train, states, form, possible)

    runs = [
        (planned[state], number, role(state), *state, angle, expected[state])
        for state in kept
        for number, (angle, _) in enumerate(itertools.product(angles, range(repeats)), start=1)
    ]
    state_id, repeat, roles, distance, height, speed, base_angle, force = (
        np.array(each) for each in zip(*runs, strict=True)
    )
    reached = [state for state in planned if math.hypot(state[0], state[1]) <= reach]
    warnings = [
        *few_states(to_train, design, form, possible),
        *unchecked(expected_force, device, limit),
        *unconfirmed(reached, measurable, expected_force, limit, tolerance.speed),
    ]
    return DesignedPlan(
        state_id=state_id,
        repeat=repeat,
        role=roles,
        distance=distance,
        height=height,
        speed=speed,
        base_angle=base_angle,
        expected_force=force,
        left_out=tuple(left_out),
        warnings=tuple(warnings),
        expected_from=source_of(expected_force, kept),
        note=note,
        bound_width=width,
    )


def _optimal(possible: FloatArray, n: int, form: Form, tolerance: StateTolerance, seed: int) -> DesignedStates:
    """The states that are best for a form, the ends of the speeds at the corners of the places among them.

    The corners cost next to nothing in precision, and without them the measured range would shrink.
    """
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise InputError(f"states: found {n!r}, expected a whole number of at least 1")
    corners = []
    for end in (possible[:, 0].min(), possible[:, 0].max()):
        heights = possible[possible[:, 0] == end, 1]
        for height in {heights.min(), heights.max()}:
            here = np.flatnonzero((possible[:, 0] == end) & (possible[:, 1] == height))
            corners += [here[possible[here, 2].argmin()], here[possible[here, 2].argmax()]]
    required = np.unique(corners)
    if n < required.size:
        raise InputError(f"states: found {n}, expected at least {required.size}, the corners of the range")
    return optimal_states(possible, n, form=form, required=required, tolerance=tolerance, seed=seed)


def _in_order(axes: Sequence[list[float]]) -> Iterator[tuple[float, float, float]]:
    """Slow to fast, so that forces grow; at a speed far to near, at a distance low to high."""
    distances, heights, speeds = axes
    return ((d, h, v) for v in speeds for d in reversed(distances) for h in heights)
