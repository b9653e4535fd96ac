"""Impacts slower than a map is to hold for (map.slowest_mps): not fitted, but every motion passes through their speeds.

A speed permits slower motion with it. So the bound at the lowest speed of the map has to hold for slower impacts, too.
It is raised, everywhere, by what they measured above the prediction: the width of the bound is then left for the
places where none was measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import States
from forcemap.findings import Finding, FindingKind
from forcemap.maps.force_map import ForceMap


@dataclass(frozen=True)
class SlowerCover:
    """What it takes for a bound to hold for slower impacts, too.

    Parameters
    ----------
    raised : float
        Factor on the bound, at least 1: the largest F / F(d, h, lowest speed there).
    refusal : Finding or None
        Why nothing is permitted: slower impacts were above the device's range, and how far is not known.
    notes : tuple of Finding
        That the bound is raised, if it is.
    """

    raised: float = 1.0
    refusal: Finding | None = None
    notes: tuple[Finding, ...] = ()


def cover_slower(force_map: ForceMap) -> SlowerCover:
    """What a bound of a map needs for the slower impacts at its places."""
    slower, at_slowest = _at_slowest_speed(force_map)
    if slower.censored.any():
        names = tuple(np.array(slower.name)[slower.censored > 0].tolist())
        figures = {"names": names, "slowest_mps": force_map.conditions.slowest}
        return SlowerCover(refusal=Finding.of(FindingKind.SLOWER_ABOVE_RANGE, **figures))
    raised = float(np.max(slower.highest / force_map.predict(*at_slowest), initial=1.0))
    notes = (Finding.of(FindingKind.RAISED_FOR_SLOWER, raised=raised - 1),) if raised > 1 else ()
    return SlowerCover(raised, notes=notes)


def slower_impacts(force_map: ForceMap) -> Finding | None:
    """What slower impacts measured, beside the map's prediction at its lowest speed there; None without any."""
    if not len(force_map.slower):
        return None
    slower, at_slowest = _at_slowest_speed(force_map)
    force = np.fmax(slower.highest, slower.at_least)
    above = force / force_map.predict(*at_slowest) - 1
    count, figures = int(np.sum(above > 0)), dict[str, float]()
    if count:
        i = int(np.argmax(above))
        speed = force_map.conditions.as_stated(slower.speed)
        figures = {"more": float(above[i]), "force_N": float(force[i]), "speed_mps": float(speed[i])}
    return Finding.of(
        FindingKind.SLOWER_IMPACTS,
        slowest_mps=force_map.conditions.slowest,
        states=len(force_map.slower),
        compared=len(slower),
        above=count,
        below=bool(len(slower)) and not count,
        elsewhere=not len(slower),
        **figures,
    )


def _at_slowest_speed(force_map: ForceMap) -> tuple[States, tuple[FloatArray, FloatArray, FloatArray]]:
    """The slower states at places of the map, n of them, and these places at the map's lowest speed, three of (n,)."""
    slower = force_map.slower
    low, _ = force_map.measured_range.speeds(slower.distance, slower.height)
    inside = slower.select(~np.isnan(low))
    return inside, (inside.distance, inside.height, low[~np.isnan(low)])
