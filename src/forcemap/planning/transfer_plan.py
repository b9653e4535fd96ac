"""Which few states carry a map over to a changed robot."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.campaigns.plan import Device
from forcemap.campaigns.state import PLACE_SIZE, States, StateTolerance, places
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.maps.carry_over import require_sound
from forcemap.maps.force_map import ForceMap
from forcemap.maps.form_test import NEAR
from forcemap.maps.forms import Form, Term
from forcemap.maps.measured_range import MeasuredRange
from forcemap.maps.transfer import FURTHER_STATES, MORE_STATES, joint_fit, usual_shift
from forcemap.planning.design import DECIMALS, LARGEST, STEP, check_limit, require_whole
from forcemap.planning.expectation import expected_forces, factor_of, source_of
from forcemap.planning.measurements import REPEATS, DesignedPlan
from forcemap.planning.optimal_states import LARGEST_LOG, optimal_states, tolerance_factor
from forcemap.planning.places import PlaceRange
from forcemap.planning.plan_warnings import unchecked, unconfirmed
from forcemap.planning.runs import runs_of
from forcemap.planning.spread_states import spread_places

STATES = 9
"""New states, unless stated: a third of a campaign of its own, at nearly its bound (docs/validity.md)."""

MOST_STATES = 15
"""New states above which a campaign of its own is not much longer; a wanted width that needs more is refused."""

_FEWEST_PLACES, _MOST_PLACES, _SPEEDS = 8, 22, 5  # of the designs to choose from, speeds at each place; a choice

_ONE_A_PLACE = StateTolerance(place=PLACE_SIZE, speed=LARGEST)
"""How far chosen states lie apart: each has a place of its own, for the device is put up for each in any case."""

_CAMPAIGNS = 60  # simulated for the width of the bound; a choice
_VOLUME_NODES = 21  # along each axis, by which the volume of a hull is told; a choice


def plan_transfer(
    old_map: ForceMap,
    distances: Sequence[float] = (),
    heights: Sequence[float] = (),
    speeds: Sequence[float] = (),
    *,
    states: int | None = None,
    width: float = math.nan,
    shift: Form | None = None,
    planned: ArrayLike = (),
    repeats: int = REPEATS,
    device: Device = Device(),  # noqa: B008 - frozen
    limit: float = math.nan,
    tolerance: StateTolerance = StateTolerance(),  # noqa: B008 - frozen
    seed: int = 0,
) -> DesignedPlan:
    """Plan the new states that carry a fitted map over to a changed robot (`transfer_map`).

    Chosen among states within the earlier map's measured range, at places that differ from the earlier ones: effects
    that a place keeps must not pass for the shift's. Each state has a place of its own, at a distance and a height of
    its own. Chosen so that the shift, and squares of speed, distance and
    height beside it as far as the states determine them, are known most precisely over the range (I-optimal,
    `optimal_states`): a linear shift alone would put all states at the ends, and a shape that changed between them
    would pass unseen. Measured in the order of the force that the earlier map expects, smallest first,
    because the changed robot may hit harder.

    Parameters
    ----------
    old_map : ForceMap
        A fitted map.
    states : int, optional
        Number of states of the new campaign; 9 if not given, or 6 more than are planned.
    width : float
        Wanted mean width of the bound above the prediction, as a share of it; the fewest states that are expected to
        reach it are planned. NaN if none is wanted.
    distances, heights, speeds : sequence of float
        Lowest and highest [m], [m], [m/s]; those of the earlier map if not given.
    shift : Form, optional
        Terms of the shift, as in `transfer_map`.
    planned : array, shape (k, 3)
        States of the new campaign that are planned already; they count among its states, and the plan holds the others.
    repeats, device, limit, tolerance, seed
        As in `plan_measurements`.

    Returns
    -------
    DesignedPlan
        Its note says how many states were chosen from how many, and how much of the earlier range they cover.

    Raises
    ------
    InputError
        A figure outside its range; no state of the range can be measured; a width that 15 states are not expected to
        reach.
    FitError, BoundNotAvailable
        The earlier map does not hold itself, as in `transfer_map`.
    """
    old = old_map.require_fit()
    require_sound(old_map)
    shift = shift or usual_shift(old_map.form)
    require_whole("repeats", repeats)
    check_limit(limit, device.highest_limit)
    before = np.reshape(np.asarray(planned, dtype=np.float64), (-1, 3))
    numbers = _numbers(len(shift.terms) + FURTHER_STATES, len(before), states, width)
    possible, left_out = _possible(old_map, before, (distances, heights, speeds), device, seed + len(before))
    room = np.unique(possible[:, :2], axis=0).shape[0]
    if room < numbers[0] - len(before):
        raise InputError(
            f"states: found {room} places to choose from within the earlier map's measured range where the device "
            f"can measure, expected at least {numbers[0] - len(before)}; widen the ranges, or name a device of larger "
            "range"
        )
    chosen, expected = _chosen(old_map, possible, before, shift, numbers, width, seed)
    n = len(chosen)
    force = expected_forces(old_map, chosen)
    order = np.argsort(force, kind="stable")
    chosen, force = chosen[order], force[order]
    share = _volume(np.vstack([before, chosen])) / max(_volume(old.states.coordinates), np.finfo(np.float64).tiny)
    figures = {"states": n, "possible": len(possible), "near_mm": 1000 * NEAR, "terms": ", ".join(shift.term_names)}
    figures["before"] = len(before)
    note = Finding.of(FindingKind.TRANSFER_CHOSEN, **figures, width=expected, share=share, more=MORE_STATES)
    return DesignedPlan(
        **runs_of(chosen, repeats, force).arrays,
        left_out=left_out,
        warnings=(
            *unchecked(old_map, device, limit),
            *unconfirmed(chosen, np.ones(n, dtype=np.bool_), old_map, limit, tolerance.speed),
        ),
        expected_from=source_of(old_map, chosen),
        note=note,
        bound_width=expected,
    )


def _numbers(fewest: int, planned: int, states: int | None, width: float) -> Sequence[int]:
    """Numbers of states of the new campaign to try, the planned ones among them."""
    require_whole("states", states, fewest)
    if not (math.isnan(width) or (0 < width < math.inf and states is None)):
        raise InputError("width: expected a share of the force above 0, and no number of states beside it")
    if width > 0:
        return range(max(fewest, planned + 1), max(MOST_STATES, planned + MORE_STATES) + 1)
    if states is not None and states <= planned:
        raise InputError(f"states: found {states}, expected more than the {planned} that are planned already")
    return (states or (planned + MORE_STATES if planned else STATES),)


def _chosen(
    old_map: ForceMap,
    possible: FloatArray,
    before: FloatArray,
    shift: Form,
    numbers: Sequence[int],
    width: float,
    seed: int,
) -> tuple[FloatArray, float]:
    """States to plan beside those before, up to the first number that reaches a width, and the width to expect."""
    chosen, expected = possible[:0], math.nan
    for n in numbers:
        criterion, count = _criterion(shift, n), n - len(before)
        chosen = optimal_states(possible, count, form=criterion, fixed=before, tolerance=_ONE_A_PLACE, seed=seed).states
        expected = expected_transfer_width(old_map, np.vstack([before, chosen]), shift=shift)
        if not expected > width:
            return chosen, expected
    raise InputError(
        f"width: found {100 * width:g} %, but {numbers[-1]} new states are expected to give {100 * expected:.1f} %; "
        "name a wider one, or measure a map of its own (forcemap plan)"
    )


def _criterion(shift: Form, states: int) -> Form:
    """The shift, v in place of ln v, with squares of speed, distance and height as far as states determine them."""
    terms = list(dict.fromkeys(replace(term, speed=term.speed or term.log_speed, log_speed=0) for term in shift.terms))
    squares = [term for term in (Term(speed=2), Term(distance=2), Term(height=2)) if term not in terms]
    return Form("SHIFT", (*terms, *squares[: max(states - 1 - len(terms), 0)]))


def _possible(
    old_map: ForceMap,
    before: FloatArray,
    ranges: tuple[Sequence[float], Sequence[float], Sequence[float]],
    device: Device,
    seed: int,
) -> tuple[FloatArray, tuple[Finding, ...]]:
    """States at spread places that can be measured, shape (n, 3), and how many of them the device cannot."""
    distances, heights, speeds = ranges
    old = old_map.require_fit().states
    low, high = (float(end[2]) for end in (old_map.measured_range.lowest, old_map.measured_range.highest))
    slow, fast = (min(speeds), max(speeds)) if len(speeds) else (low, high)
    if not low <= slow < fast <= high:
        raise InputError(
            f"speeds: found {slow:g} to {fast:g} m/s, expected some from {low:g} to {high:g}, those of the earlier "
            "map: it says nothing of others, and a few new states alone are no ground for them"
        )
    spread = _spread(PlaceRange.of(distances, heights, old), old, seed)
    levels = np.clip(np.linspace(slow, fast, _SPEEDS).round(DECIMALS), slow, fast)
    grid = np.column_stack([np.repeat(spread, _SPEEDS, axis=0), np.tile(levels, len(spread))])
    measured = np.vstack([before[:, :2], old.coordinates[:, :2]])
    away = np.abs(grid[:, None, :2] - measured).max(axis=2).min(axis=1)
    grid = grid[old_map.measured_range.contains(*grid.T) & (away > NEAR)]
    forceful = factor_of(old_map) * expected_forces(old_map, grid) > device.highest_limit
    figures = {"states": int(forceful.sum()), "most_N": device.highest_limit}
    left_out = (Finding.of(FindingKind.TRANSFER_TOO_FORCEFUL, **figures),) if forceful.any() else ()
    return grid[~forceful], left_out


def _spread(place_range: PlaceRange, old: States, seed: int) -> FloatArray:
    """Places of distances and heights of their own, shape (n, 2): a ridge at some distance meets one of them.

    Those of several designs; they keep away from the ends of the earlier range, where earlier places lie.
    """
    ranges = []
    for (low, high), known in zip((place_range.distances, place_range.heights), old.coordinates.T, strict=False):
        inside = float(known.min()) + NEAR + STEP, float(known.max()) - NEAR - STEP
        ranges.append((round(max(low, inside[0]), DECIMALS), round(min(high, inside[1]), DECIMALS)))
    spread: list[FloatArray] = []
    for count in range(_FEWEST_PLACES, _MOST_PLACES + 1):
        with contextlib.suppress(InputError):  # so many do not fit
            apart: dict[str, Any] = {"reach": math.inf, "tolerance": StateTolerance(), "seed": seed}
            spread.append(spread_places(ranges[0], ranges[1], count, least=count, **apart))
    if not spread:
        raise InputError(
            f"ranges: found distances and heights without room for places more than {1000 * NEAR:g} mm from those of "
            "the earlier map, expected wider ones"
        )
    return np.unique(np.vstack(spread), axis=0)


def expected_transfer_width(old_map: ForceMap, new: FloatArray, *, shift: Form | None = None) -> float:
    """Mean of the bound above the prediction over new states' hull, as a share of it, before they are measured.

    Averaged over simulated campaigns in which the shift fits and states scatter as those of the earlier map.

    Parameters
    ----------
    old_map : ForceMap
        A fitted map that was not carried over itself, or one that was.
    new : array, shape (n, 3)
        (distance, height, speed) of the new states [m, m, m/s].
    shift : Form, optional
        Terms of the shift, as in `transfer_map`.
    """
    shift = shift or usual_shift(old_map.form)
    fit, rng, widths = old_map.require_fit(), np.random.default_rng(0), []
    first = fit.transfer.earlier[0].states if fit.transfer else fit.states
    form, old = fit.transfer.form if fit.transfer else old_map.form, first.uncensored
    region = np.vstack([new, (new[:, None] + new).reshape(-1, 3) / 2])
    own, shared = (
        fit.state_sd * math.sqrt(1 - fit.place_effect.likely),
        fit.state_sd * math.sqrt(fit.place_effect.likely),
    )
    x = np.column_stack([form.design(*region.T), shift.design(*region.T)])
    campaigns = [old, old.select(np.zeros(len(new), dtype=np.int64))]
    place = places(*new[:, :2].T)
    campaigns[1] = replace(campaigns[1], distance=new[:, 0], height=new[:, 1], speed=new[:, 2])
    for _ in range(_CAMPAIGNS):
        effects = [
            own * rng.standard_normal(number.size) + shared * rng.standard_normal(number.max() + 1)[number]
            for number in (old.place, place)
        ]
        drawn = [replace(states, log_force=effect) for states, effect in zip(campaigns, effects, strict=True)]
        joint = joint_fit(form, drawn, [shift], 0.0)
        leverage = np.square(x @ joint.regression.whole.inverse_triangle).sum(axis=1)
        allowance = joint.regression.deviation * tolerance_factor(leverage, joint.regression.freedom)
        widths.append(float(np.expm1(np.minimum(allowance, LARGEST_LOG)).mean()))
    return float(np.mean(widths))


def _volume(states: FloatArray) -> float:
    """Volume of the hull of states, by the share of a fine grid over their box that lies in it."""
    measured = MeasuredRange(states)
    axes = [np.linspace(low, high, _VOLUME_NODES) for low, high in zip(measured.lowest, measured.highest, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return float(np.prod(np.ptp(states, axis=0)) * measured.contains(*grid.T).mean())
