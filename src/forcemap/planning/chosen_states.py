"""The states of a plan by its design; those that cannot be measured are left out or moved."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask, Texts
from forcemap.campaigns.state import StateTolerance, places as places_of
from forcemap.errors import InputError, TooFewStates
from forcemap.findings import Finding, FindingKind
from forcemap.maps.bounds import FEW_STATES
from forcemap.maps.forms import Form
from forcemap.maps.places import LEAST_BETWEEN
from forcemap.planning.design import Design, names_of, require_whole
from forcemap.planning.optimal_states import DesignedStates, bound_from, optimal_states
from forcemap.planning.spread_states import CORNERS, PLACES, STATES, spread_places, spread_speeds

_SPEED_STEP = 0.005  # [m/s]; in which the fastest speed that can be measured at a place is searched; a choice
_DECIMALS, _ROUNDING = 6, 1e-9  # of these speeds [m/s]
_MORE_STATES = 20  # larger numbers of states that are tried, so that a refusal can name one that will do; a choice


@dataclass(frozen=True)
class Candidates:
    """What states are chosen from.

    Parameters
    ----------
    axes : tuple of list of float
        Distances, heights and speeds, ascending [m], [m], [m/s].
    form : Form
        The map that the states are for.
    reach : float
        Largest distance of a place from the origin of the base [m].
    most : float
        Largest force that the device measures [N]; infinite if it is not stated.
    force : callable
        Expected force [N] of states, shape (n, 3); NaN where it is unknown.
    tolerance : StateTolerance
        States lie further apart than this.
    seed : int
        Seed of random choices.
    """

    axes: tuple[list[float], list[float], list[float]]
    form: Form
    reach: float
    most: float
    force: Callable[[FloatArray], FloatArray]
    tolerance: StateTolerance
    seed: int


@dataclass(frozen=True, eq=False)
class Chosen:
    """The states of a plan in the order of measurement.

    Parameters
    ----------
    states : array (n, 3)
        (distance, height, speed) [m, m, m/s].
    trains : array of bool (n,)
        Which states train a map.
    possible : array (m, 3)
        The states from which they were chosen.
    slow : array (k, 3)
        States; the slowest of each place shows whether a limit can be confirmed there.
    measurable : array of bool (k,)
        Which of these can be measured.
    left_out, warnings, note, bound_width
        As in DesignedPlan.
    """

    states: FloatArray
    trains: Mask
    possible: FloatArray
    slow: FloatArray
    measurable: Mask
    left_out: tuple[Finding, ...] = ()
    warnings: tuple[Finding, ...] = ()
    note: Finding | None = None
    bound_width: float = math.nan


def names_of_states(states: FloatArray) -> Texts:
    """A name for each state, shape (n, 3), by its place and speed in thousandths."""
    letters = [names_of(letter, np.unique(column).tolist()) for letter, column in zip("dhv", states.T, strict=True)]
    return np.array(["-".join(name[x] for name, x in zip(letters, state, strict=True)) for state in states.tolist()])


def of_grid(design: Design, candidates: Candidates, n: int | None, places: int | None, limit: float) -> Chosen:
    """The states of every combination of the values that a design measures; I_OPTIMAL chooses n.

    I_OPTIMAL makes the map precise where the expected force is within the limit [N], everywhere without one.
    """
    axes, reach, most, kind = candidates.axes, candidates.reach, candidates.most, FindingKind
    # Slow to fast, so that forces grow; at a speed far to near, at a distance low to high.
    speed, distance, height = np.meshgrid(axes[2], axes[0][::-1], axes[1], indexing="ij")
    every = np.stack([distance, height, speed], axis=-1).reshape(-1, 3)
    names, expected = names_of_states(every), candidates.force(every)
    away = np.hypot(every[:, 0], every[:, 1])
    far, forceful = away > reach, (away <= reach) & (expected > most)
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
    trains = np.full(len(every), design in (Design.PAPER, Design.I_OPTIMAL))
    if design is Design.FULL_GRID:
        trains = np.all([np.isin(x, [*axis[::2], axis[-1]]) for x, axis in zip(every.T, axes, strict=True)], axis=0)
    possible, slow = every[measurable], (every[~far], measurable[~far])
    if design is not Design.I_OPTIMAL:
        return Chosen(possible, trains[measurable], possible, *slow, left_out)
    wanted = possible[~(expected[measurable] > limit)]  # all of them if no force is expected
    region = wanted if len(wanted) else possible[possible[:, 2] == possible[:, 2].min()]
    corners = _corners(possible)
    designed = _optimal(candidates, possible, FEW_STATES if n is None else n, places, region, corners)
    far_first = designed.index[np.lexsort((-designed.states[:, 1], -designed.states[:, 0]))]
    chosen = possible[far_first][_place_by_place(possible[far_first], np.isin(far_first, corners), candidates.seed)]
    note = Finding.of(
        kind.STATES_CHOSEN,
        states=len(designed.states),
        possible=len(possible),
        form=candidates.form.name,
        far=int(far.sum()),
        forceful=int(forceful.sum()),
        width=designed.bound_width,
        state_sd=designed.state_sd,
    )
    # The states left out are not listed: many others were not chosen either.
    return Chosen(chosen, trains[: len(chosen)], possible, *slow, note=note, bound_width=designed.bound_width)


def _place_by_place(states: FloatArray, corner: Mask, seed: int) -> Indices:
    """Numbers of the states, shape (n, 3), in the order of measurement: place by place, slow to fast at each.

    The corners come first in their order, then the other places in random order. The corners enclose the others, so
    that a large force shows there first; and the order of the others must not depend on where they lie, or a drift
    would look like a slope of the map.
    """
    place = places_of(*states[:, :2].T)
    corners = list(dict.fromkeys(place[corner].tolist()))
    others = [number for number in dict.fromkeys(place.tolist()) if number not in corners]
    order = [*corners, *np.random.default_rng(seed).permutation(others).tolist()]
    return np.lexsort((states[:, 2], np.argsort(order)[place]))


def of_spread(candidates: Candidates, n: int | None, places: int | None) -> Chosen:
    """States spread over places and speeds."""
    require_whole("states", n)
    require_whole("places", places)
    n = STATES if n is None else n
    least = _fewest_places(candidates.form)
    if places is not None and places < least:
        raise InputError(
            f"places: found {places}, expected at least {least}: fewer do not tell how far forces scatter from place "
            "to place"
        )
    if (chosen := _spread(candidates, n, places, least)) is not None:
        return chosen
    fewest, enough = max(n + 1, (least if places is None else places) + len(CORNERS)), None
    for more in range(fewest, fewest + _MORE_STATES):
        with contextlib.suppress(InputError):
            if (enough := _spread(candidates, more, places, least)) is not None:
                break
    expected = "more states or places, or a wider range"
    if enough is not None:
        number = np.unique(places_of(*enough.states[:, :2].T)).size
        expected = f"at least {len(enough.states)} states for {number} places (--states {len(enough.states)})"
    stated = f"states: found {n}" if places is None else f"places: found {places} with {n} states"
    raise TooFewStates(
        f"{stated}, expected {expected}: the corners have two states each, and fewer do not determine "
        f"{candidates.form.name} and how far forces scatter from place to place"
    )


def _spread(candidates: Candidates, n: int, places: int | None, least: int) -> Chosen | None:
    """n states spread over places, as many as n allows if not given; None if they do not suffice for a bound."""
    count = min(PLACES, n - len(CORNERS)) if places is None else places
    if not least <= count <= n - len(CORNERS):
        return None
    form, most, kind = candidates.form, candidates.most, FindingKind
    distances, heights, (slowest, fastest) = ((axis[0], axis[-1]) for axis in candidates.axes)
    tolerance, seed = candidates.tolerance, candidates.seed
    place = spread_places(
        distances, heights, count, least=least, reach=candidates.reach, tolerance=tolerance, seed=seed
    )
    warnings = []
    farthest, height = place[0, 0], place[:, 1]
    if farthest < distances[1] or height.max() < heights[1] or height.min() > heights[0]:
        figures = {"reach_m": candidates.reach, "distance_m": farthest, "height_m": height[0]}
        warnings.append(Finding.of(kind.PLACES_WITHIN_REACH, **figures))

    steps = np.append(np.arange(slowest, fastest - _ROUNDING, _SPEED_STEP).round(_DECIMALS), fastest)
    states = np.column_stack([np.repeat(place, steps.size, axis=0), np.tile(steps, count)])
    force = candidates.force(states).reshape(count, -1)
    fits = np.logical_and.accumulate(~(force > most), axis=1)
    forceful = np.flatnonzero(~fits[:, 0])
    slow = np.column_stack([place, np.full(count, slowest)])
    left_out = tuple(
        Finding.of(kind.EXPECTED_ABOVE_DEVICE, state=name, force_N=force[i, 0].item(), most_N=most)
        for i, name in zip(forceful, names_of_states(slow[forceful]).tolist(), strict=True)
    )
    if count - forceful.size < least:
        raise InputError(
            f"places: found {count - forceful.size} of {count}, expected at least {least}: at the others the device "
            f"measures up to {most:g} N (range less error), and more is expected at {slowest:g} m/s; choose lower "
            "speeds, farther places or a device of larger range"
        )
    measurable = np.flatnonzero(fits[:, 0])
    top = steps[fits[measurable].sum(axis=1) - 1]
    if slower := int(np.sum(top < fastest)):
        figures = {"places": slower, "of": measurable.size, "speed_mps": top.min().item(), "most_N": most}
        warnings.append(Finding.of(kind.SPEEDS_WITHIN_RANGE, **figures))
    corner = measurable < len(CORNERS)
    speeds = spread_speeds(corner, top, slowest, n, tolerance=tolerance)
    row = np.repeat(np.arange(measurable.size), [len(speed) for speed in speeds])
    chosen = np.column_stack([place[measurable[row]], np.concatenate(speeds)])
    chosen = chosen[_place_by_place(chosen, corner[row], seed)]
    if not bound_from(chosen, form):
        return None
    note = Finding.of(kind.STATES_SPREAD, states=n, places=measurable.size)
    trains = np.ones(n, dtype=np.bool_)
    slow = slow[measurable]
    return Chosen(chosen, trains, chosen, slow, trains[: len(slow)], left_out, tuple(warnings), note)


def _fewest_places(form: Form) -> int:
    """Number of places that a tolerance bound of a form needs."""
    return sum(not (term.speed or term.log_speed) for term in form.terms) + LEAST_BETWEEN


def _corners(possible: FloatArray) -> list[int]:
    """Numbers of the states, shape (n, 3), at the slowest and fastest speeds of the corners of the places."""
    ends = itertools.product(
        (1, -1), repeat=3
    )  # the first by distance, then height, then speed, ascending or descending
    return sorted({int(np.lexsort((possible * end)[:, ::-1].T)[0]) for end in ends})


def _optimal(
    candidates: Candidates, possible: FloatArray, n: int, places: int | None, region: FloatArray, corners: list[int]
) -> DesignedStates:
    """The states that are best for a form, the corners among them.

    The corners cost hardly any precision, and without them the measured range would shrink.
    """
    require_whole("states", n)
    form = candidates.form
    beside = len(form.terms) - int(np.linalg.matrix_rank(form.design(*possible[corners].T)))
    if n < len(corners) + beside:
        raise TooFewStates(
            f"states: found {n}, expected at least {len(corners) + beside}: the {len(corners)} corners of the range at "
            f"the slowest and the fastest speed, and {beside} more that determine {form.name}"
        )
    require_whole("places", places, _fewest_places(form))
    return optimal_states(
        possible,
        n,
        form=form,
        region=region,
        places=places,
        required=corners,
        tolerance=candidates.tolerance,
        seed=candidates.seed,
    )
