"""A few impacts at the released speeds, to confirm a map before its speeds are used."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcemap.campaigns.plan import MeasurementPlan
from forcemap.errors import InputError
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.planning.places import FloatArray, PlaceRange
from forcemap.planning.runs import runs_of
from forcemap.speeds import floor_speed, safe_speed

_PLACES = 15  # along each axis, to choose from
_HIGHER = 1.10  # a robot that pushes this much harder should be found


@dataclass(frozen=True, eq=False)
class ConfirmationPlan:
    """Impacts at released speeds, and the rule by which they confirm the map.

    Parameters
    ----------
    plan : MeasurementPlan
        One run a state, slow to fast, all with role test.
    bound_force : array
        Bound at each [N], shape (n,).
    limit : float
        Force limit [N].
    rule : str
        When the impacts confirm the map, in words.
    not_passed : float
        Probability that a sound map does not pass: states scatter as its own did; NaN if nothing tells how they do.
    above_bound : float
        Probability that an impact of a sound map lies above the bound; NaN likewise.
    found : float
        Probability that a force 10 % above the map's does not pass; NaN likewise.
    """

    plan: MeasurementPlan
    bound_force: FloatArray
    limit: float
    rule: str
    not_passed: float
    above_bound: float
    found: float


def confirm_plan(
    force_map: ForceMap,
    limit: ForceLimit | float,
    *,
    bound: Bound,
    contact: Contact | None = None,
    impacts: int = 6,
) -> ConfirmationPlan:
    """Plan a few impacts at released speeds: the fastest, where the bound is tightest, and spread over the rest.

    The impacts confirm the map if every one is within the limit by `check_impact` (its force and the device's error
    stay below it) and none lies above the bound.

    Parameters
    ----------
    force_map : ForceMap
        The map whose speeds are to be released.
    limit : float or ForceLimit
        Force limit [N]; or the limits of a body area together with `contact`.
    bound : Bound
        The bound that released the speeds.
    contact : Contact, optional
        Kind of contact, for a ForceLimit.
    impacts : int
        How many, at least 2.

    Returns
    -------
    ConfirmationPlan

    Raises
    ------
    InputError
        No place has a speed for the limit, or fewer than 2 impacts are asked for.
    BoundNotAvailable
        The map cannot carry the bound.

    Examples
    --------
    >>> from forcemap import FixedMargin, published_map
    >>> found = confirm_plan(published_map("ur10e"), 280.0, bound=FixedMargin(0.10))
    >>> len(found.plan), found.plan.recording[-1].item()
    (6, 'c-d890-h460-v362-r1')
    """
    if isinstance(impacts, bool) or not isinstance(impacts, int | np.integer) or impacts < 2:
        raise InputError(f"impacts: found {impacts!r}, expected a whole number of at least 2")
    lowest, highest = force_map.measured_range.lowest, force_map.measured_range.highest
    places = PlaceRange((lowest[0], highest[0]), (lowest[1], highest[1]))
    grid = np.unique(places.grid(_PLACES), axis=0)
    released = safe_speed(force_map, grid[:, 0], grid[:, 1], limit=limit, bound=bound, contact=contact)
    speed = np.array([float(floor_speed(v)) if math.isfinite(v) else math.nan for v in released.speed])
    usable = np.flatnonzero(speed >= released.lowest_measured_speed)
    if not usable.size:
        raise InputError("no place has a speed for this limit, so there is nothing to confirm; measure more states")
    states = np.column_stack([grid, speed])[usable]
    upper = np.asarray(bound.upper(force_map, *states.T))
    tightness = upper / np.asarray(force_map.predict(*states.T))
    chosen = _spread(places, states, [int(states[:, 2].argmax()), int(tightness.argmin())], int(impacts))
    order = np.lexsort((states[chosen, 1], -states[chosen, 0], states[chosen, 2]))
    chosen = chosen[order]
    states, upper = states[chosen], upper[chosen]
    error, newtons = force_map.conditions.device.error_or_default, float(released.limit)
    most = np.minimum(newtons - error, upper)
    runs = runs_of(
        states,
        1,
        np.asarray(force_map.predict(*states.T)),
        role="test",
        prefix="c-",
        expected_from=f"map {force_map.name!r}",
    )
    rule = (
        f"the map is confirmed if each of the {len(runs)} impacts is within {newtons:g} N (its force and the device's "
        f"error of {error:g} N together) and none exceeds the bound; one that does not: release nothing, measure more"
    )
    return ConfirmationPlan(
        plan=runs,
        bound_force=upper,
        limit=newtons,
        rule=rule,
        not_passed=_any_above(force_map, states, most, 1.0),
        above_bound=_any_above(force_map, states, upper, 1.0),
        found=_any_above(force_map, states, most, _HIGHER),
    )


def _spread(places: PlaceRange, states: FloatArray, first: list[int], count: int) -> NDArray[np.int64]:
    """The first ones, then each the farthest from those before it."""
    chosen = list(dict.fromkeys(first))
    while len(chosen) < min(count, len(states)):
        away = places.apart(states, states[chosen]).min(axis=1)
        if not away.max() > 0:
            break
        chosen.append(int(away.argmax()))
    return np.array(chosen)


def _any_above(force_map: ForceMap, states: FloatArray, newtons: FloatArray, factor: float) -> float:
    """Probability that one of new states measures more, if forces are `factor` times the map's; NaN if not known.

    ln F of a new state less the prediction, over s sqrt(1 + l), has Student's t distribution; that the states share
    the map's error makes the product too high rather than too low.
    """
    if force_map.fit is None or not force_map.fit.between_states.degrees_of_freedom > 0:
        return math.nan
    from scipy.special import stdtr

    leverage = np.asarray(force_map.leverage(*states.T))
    allowance = np.log(newtons / (factor * np.asarray(force_map.predict(*states.T))))
    t = allowance / (force_map.fit.state_sd * np.sqrt(1 + leverage))
    return float(1 - np.prod(stdtr(force_map.fit.between_states.degrees_of_freedom, t)))
