"""From which speed on a map may hold: the maps of a campaign beside each other, each fitted from a faster speed on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from forcemap.campaigns.dataset import ImpactDataset
from forcemap.direction import WIDEST_ANGLE
from forcemap.errors import FitError, ForcemapError
from forcemap.findings import Finding, FindingKind
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.maps.bounds import ToleranceBound, margins
from forcemap.maps.force_map import ForceMap
from forcemap.maps.slower_impacts import cover_slower
from forcemap.speeds.basis import doubts_of_fit
from forcemap.speeds.speed_map import measured_grid, speed_map

_MOST = 12  # speeds that are tried: more are spread over them. A choice
_WHOLE, _ROUNDING = 0.001, 1e-6  # [m/s] in which speeds are stated; of such a number

STEP = 0.05
"""Distance between the places that are counted [m], as of a speed map."""


@dataclass(frozen=True)
class FromSpeed:
    """The map of a campaign that holds from a speed on.

    Parameters
    ----------
    slowest : float
        The slowest speed that is fitted [m/s], as the campaign states it.
    states, places : int
        Number of states that are fitted, and of their places.
    state_sd : float
        How far these scatter about the map, as a share of the force.
    margin : tuple of float
        Smallest and largest share by which the tolerance bound lies above the prediction at them; NaN without one.
    slower : float
        What slower impacts reached at most, over the prediction at the lowest speed; 1 where they reached less, 0
        without any.
    permitted : int or None
        Of `counted` places those with a speed to program; None without a limit.
    off_axis : int or None
        The same for motion up to `WIDEST_ANGLE` off the map's direction, as a program's table of zones has it.
    counted : int
        Places of the whole measured range.
    speeds : tuple of float
        Lowest and highest speed to program there [m/s]; NaN where there is none.
    reason : Finding or None
        Why the map carries no bound, or no speed; None if nothing forbids it.
    warnings : tuple of Finding
        What must be said before its speeds; without a limit the doubts about the map.
    """

    slowest: float
    states: int
    places: int
    state_sd: float
    margin: tuple[float, float]
    slower: float
    permitted: int | None
    off_axis: int | None
    counted: int
    speeds: tuple[float, float]
    reason: Finding | None
    warnings: tuple[Finding, ...]


def compare_slowest_speeds(
    dataset: ImpactDataset,
    map_of: Callable[[ImpactDataset], ForceMap],
    *,
    limit: ForceLimit | None = None,
    contact: Contact = Contact.TRANSIENT,
) -> tuple[FromSpeed, ...]:
    """Fit a campaign from each of its speeds on, from all states to the fewest that determine a map.

    Places are those of the map of all states, every 5 cm, so that what a later map leaves out counts as without speed.
    What the conditions state of the slowest speed does not count.

    Parameters
    ----------
    dataset : ImpactDataset
    map_of : callable
        The map of these impacts under other conditions: `fit_force_map`, or how the campaign's map is made and what its
        confirming impacts show.
    limit : ForceLimit, optional
        To count places with a speed.
    contact : Contact

    Raises
    ------
    FitError
        Not even all states determine a map.
    """
    every = replace(dataset, conditions=replace(dataset.conditions, slowest=float("nan")))
    stated = dataset.conditions.as_stated(every.train.states.speed)
    levels = np.unique(np.floor(stated / _WHOLE + _ROUNDING) * _WHOLE).round(3)
    if levels.size > _MOST:
        levels = np.quantile(levels, np.linspace(0, 1, _MOST), method="lower")
    whole, found = map_of(every), []
    for slowest in np.unique(levels).tolist():
        conditions = replace(dataset.conditions, slowest=slowest)
        try:
            force_map = map_of(replace(dataset, conditions=conditions))
        except FitError:
            break  # still fewer states determine none either
        found.append(_from_speed(force_map, whole, slowest, limit, contact))
    return tuple(found)


def _from_speed(
    force_map: ForceMap, whole: ForceMap, slowest: float, limit: ForceLimit | None, contact: Contact
) -> FromSpeed:
    fit, nothing = force_map.require_fit(), (float("nan"), float("nan"))
    bound = ToleranceBound(device_error=force_map.conditions.device.error_or_default)
    margin, speeds, reason, warnings = nothing, nothing, None, doubts_of_fit(force_map)
    grid = measured_grid(whole, STEP)
    counted, permitted, off_axis = grid[0].size * grid[1].size, 0, 0
    try:
        above = margins(bound, force_map)
        margin = float(above.min()), float(above.max())
        if limit is not None:
            case: dict[str, Any] = {"limit": limit, "bound": bound, "contact": contact}
            result = speed_map(force_map, *grid, **case).speeds
            tilted = speed_map(force_map, *grid, **case, angle=WIDEST_ANGLE).speeds
            off_axis = int(np.sum(~np.isnan(tilted.speed_to_program)))
            programmed = result.speed_to_program[~np.isnan(result.speed_to_program)]
            permitted, reason, warnings = programmed.size, result.basis.refusal, result.basis.warnings
            speeds = (float(programmed.min()), float(programmed.max())) if permitted else nothing
    except ForcemapError as error:
        reason = Finding.of(FindingKind.WORDS, words=error.message)
    return FromSpeed(
        slowest=slowest,
        states=len(fit.states),
        places=fit.place_effect.places,
        state_sd=fit.state_sd,
        margin=margin,
        slower=cover_slower(force_map).raised,
        permitted=None if limit is None else permitted,
        off_axis=None if limit is None else off_axis,
        counted=counted,
        speeds=speeds,
        reason=reason,
        warnings=warnings,
    )
