"""Plans of measurements: which impacts to make, in which order."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.campaigns.plan import Device, MeasurementPlan
from forcemap.campaigns.state import StateTolerance
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.maps.forms import CFM_3D, Form
from forcemap.planning.design import Design, angles_of, axis_of, check_limit, names_of, require_whole
from forcemap.planning.expectation import Expectation, expected_forces, source_of
from forcemap.planning.optimal_states import DesignedStates, optimal_states
from forcemap.planning.plan_warnings import FEW_STATES, few_states, unchecked, unconfirmed


@dataclass(frozen=True, eq=False)
class DesignedPlan(MeasurementPlan):
    """A plan, and for an I-optimal one what is expected of it; neither is in the file.

    Parameters
    ----------
    note : Finding or None
        From what the states were chosen and the bound to expect; None for other designs.
    bound_width : float
        Mean over the candidates of the tolerance bound above the prediction, as a share of it; NaN likewise.
    """

    note: Finding | None = None
    bound_width: float = math.nan


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
    require_whole("repeats", repeats)
    if not reach > 0:
        raise InputError(f"reach: found {reach:g}, expected metres above 0")
    if not (math.isnan(limit) or 0 < limit < math.inf):
        raise InputError(f"limit: found {limit:g}, expected newtons above 0 and finite")
    check_limit(limit, device.highest_limit)

    # Slow to fast, so that forces grow; at a speed far to near, at a distance low to high.
    speed, distance, height = np.meshgrid(axes[2], axes[0][::-1], axes[1], indexing="ij")
    every = np.stack([distance, height, speed], axis=-1).reshape(-1, 3)
    letters = [names_of(letter, values) for letter, values in zip("dhv", axes, strict=True)]
    names = np.array(["-".join(name[x] for name, x in zip(letters, state, strict=True)) for state in every.tolist()])
    expected = expected_forces(expected_force, every)
    away = np.hypot(every[:, 0], every[:, 1])
    far, forceful = away > reach, (away <= reach) & (expected > device.highest_limit)
    kind, most = FindingKind, device.highest_limit
    left_out = tuple(
        Finding.of(kind.BEYOND_REACH, state=names[i].item(), away_m=away[i].item(), reach_m=reach)
        if far[i]
        else Finding.of(kind.EXPECTED_ABOVE_DEVICE, state=names[i].item(), force_N=expected[i].item(), most_N=most)
        for i in np.flatnonzero(far | forceful)
    )
    measurable = ~(far | forceful)
    if not measurable.any():
        raise InputError(
            f"no state is left to measure: {far.sum()} lie beyond the reach of {reach:g} m, {forceful.sum()} are "
            f"expected above the {most:g} N that the device measures (range less error); change the values"
        )
    possible, kept = every[measurable], np.flatnonzero(measurable)
    note, width = None, math.nan
    if design is Design.I_OPTIMAL:
        designed = _optimal(possible, FEW_STATES if states is None else states, form, tolerance, seed)
        kept, width = kept[designed.index], designed.bound_width
        note = Finding.of(
            kind.STATES_CHOSEN,
            states=len(kept),
            possible=len(possible),
            form=form.name,
            far=int(far.sum()),
            forceful=int(forceful.sum()),
            width=width,
            state_sd=designed.state_sd,
        )
        left_out = ()  # no more than many others that were not chosen

    trains = np.full(len(every), design in (Design.TRAINING, Design.I_OPTIMAL))
    if design is Design.FULL_GRID:
        trains = np.all([np.isin(x, [*axis[::2], axis[-1]]) for x, axis in zip(every.T, axes, strict=True)], axis=0)
    few = [] if design is Design.SYMMETRY else few_states(every[kept[trains[kept]]], states, form, possible)
    runs, row = len(angles) * repeats, np.repeat(kept, len(angles) * repeats)
    return DesignedPlan(
        state_id=names[row],
        repeat=np.tile(np.arange(1, runs + 1), len(kept)),
        role=np.where(trains[row], "train", "test"),
        distance=every[row, 0],
        height=every[row, 1],
        speed=every[row, 2],
        base_angle=np.tile(np.repeat(angles, repeats), len(kept)),
        expected_force=expected[row],
        left_out=left_out,
        warnings=(
            *few,
            *unchecked(expected_force, device, limit),
            *unconfirmed(every[~far], measurable[~far], expected_force, limit, tolerance.speed),
        ),
        expected_from=source_of(expected_force, every[kept]),
        note=note,
        bound_width=width,
    )


def _optimal(possible: FloatArray, n: int, form: Form, tolerance: StateTolerance, seed: int) -> DesignedStates:
    """The states that are best for a form, the ends of the speeds at the corners of the places among them.

    The corners cost next to nothing in precision, and without them the measured range would shrink.
    """
    require_whole("states", n)
    ends = itertools.product((1, -1), repeat=3)  # the first by distance, then height, then speed, either way round
    corners = {int(np.lexsort((possible * end)[:, ::-1].T)[0]) for end in ends}
    if n < len(corners):
        raise InputError(f"states: found {n}, expected at least {len(corners)}, the corners of the range")
    return optimal_states(possible, n, form=form, required=sorted(corners), tolerance=tolerance, seed=seed)
