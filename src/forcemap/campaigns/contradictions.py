"""What places, speeds, names and base angles of impacts say against each other: columns exchanged, rows named wrong."""

from __future__ import annotations

import re

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.state import States, StateTolerance, clusters
from forcemap.findings import Finding, FindingKind

_AXES = ("distance", "height", "speed")
# names as plans give them, "d500-h150-v250": thousandths of m and m/s; people write hundredths, too
_NAME = re.compile(r".*?d(\d+(?:\.\d+)?)[-_]?h(-?\d+(?:\.\d+)?)[-_]?v(\d+(?:\.\d+)?)", re.DOTALL)
_SCALES = (1e-3, 1e-2)
# Choices, checked by tests/test_contradictions.py.
_PLACES_APART = 0.010  # from its name: a place may have been measured anew after it was named [m]
SPEEDS_APART = 1.5
"""A measured speed may differ from the planned one by this factor."""
_FEW_STATES = 0.2  # share of states that may be exchanged: the others still show what is usual
_LEAST_STEPS = 3  # of speed, at the same places, to see how the force goes
_RISING_FROM, _LEAST_EXPONENT = 0.16, 0.45
# [m/s]; power of speed that the force rises with: 0.86 to 1.05 in the maps of the paper, 0.53 to 0.99 in the lab, 0.36
# to 0.45 there with very soft covers, to 0.4 of a robot that stays at 0.25 to 0.3 m/s: these are not told apart
_SAME_DIRECTION = 10.0  # base angles this close have the same direction [deg]
_BEYOND_RANGE = 1.2  # of the device range; devices stop within some percent of it
_MOST_IMPACTS = 0.6  # share of impacts that shows which base angle is the usual one


def contradictions(states: States) -> tuple[Finding, ...]:
    """Coordinates of states that contradict their names, their forces or each other: doubts, no proof.

    Names that state another place or speed (`d500-h150-v250`); a force that mostly falls as the speed rises, as it
    does with the distance, or hardly rises at the faster speeds, as of a robot that did not reach them; every place
    higher above the base than away from it; a few states outside the others that lie among them once distance and
    height, or distance and speed, are exchanged.
    """
    checks = (_named_otherwise, _falling, _levelling, _higher_than_far, _exchanged)
    return tuple(finding for check in checks if len(states) and (finding := check(states)))


def range_exceeded(force: FloatArray, device_range: FloatArray) -> Finding | None:
    """Readings far above the range of their device, which none gives; both in N, shape (n,), NaN for none stated."""
    far = force > _BEYOND_RANGE * device_range
    if not far.any():
        return None
    worst = int(np.argmax(np.where(far, force, 0.0)))
    figures = {"force_N": float(force[worst]), "range_N": float(device_range[worst])}
    return Finding.of(FindingKind.RANGE_EXCEEDED_FAR, impacts=int(far.sum()), of=far.size, **figures)


def opposite_base_angle(angle: FloatArray, stated: float) -> Finding | None:
    """A base angle off by half a turn, as between a robot's controller and its description.

    Parameters
    ----------
    angle : array, shape (n,)
        Angle of the base joint at each impact [deg]; NaN is "not stated".
    stated : float
        That of the campaign [deg]; NaN is "not stated".

    Returns
    -------
    Finding or None
        All impacts lie opposite to the campaign's angle, or a few to that of most.
    """
    known = angle[np.isfinite(angle)]
    if not known.size:
        return None
    turns, counts = np.unique(np.round(known % 360, 6), return_counts=True)
    usual = float(stated) if np.isfinite(stated) else float(turns[counts.argmax()])
    opposite, along = _aimed(known, usual + 180.0), _aimed(known, usual)
    if opposite.all() or (opposite.any() and along.mean() >= _MOST_IMPACTS):
        return Finding.of(FindingKind.BASE_ANGLE_OPPOSITE, impacts=int(opposite.sum()), all=known.size, usual_deg=usual)
    return None


def _aimed(angle: FloatArray, direction: float) -> Mask:
    """Which base angles have that direction [deg]."""
    return np.asarray(np.abs((angle - direction + 180) % 360 - 180) <= _SAME_DIRECTION)


def _named_otherwise(states: States) -> Finding | None:
    parsed = [_NAME.fullmatch(name.lower()) for name in states.name]
    rows = np.flatnonzero([name is not None for name in parsed])
    if not rows.size:
        return None
    named = np.array([name.groups() for name in parsed if name], dtype=np.float64)
    coordinates = states.coordinates[rows]
    agreeing = np.array([_agree(scale * named, coordinates).sum(axis=0) for scale in _SCALES])
    named *= np.array(_SCALES)[agreeing.argmax(axis=0)]
    wrong = np.flatnonzero(~_agree(named, coordinates).all(axis=1))
    if not wrong.size:
        return None
    first, exchanged = wrong[0], ""
    for one, other in ((0, 1), (0, 2), (1, 2)):
        order = np.arange(3)
        order[[one, other]] = other, one
        if _agree(named[first], coordinates[first, order]).all():
            exchanged = f"{_AXES[one]} and {_AXES[other]}"
    figures = {"states": int(wrong.size), **_state(states, int(rows[first])), "exchanged": exchanged}
    return Finding.of(FindingKind.NAMED_OTHERWISE, **figures)


def _agree(named: FloatArray, coordinates: FloatArray) -> Mask:
    """Whether coordinates, shape (..., 3), are those that the names state."""
    near = np.abs(named - coordinates) <= _PLACES_APART
    near[..., 2] = (coordinates[..., 2] * SPEEDS_APART >= named[..., 2]) & (
        coordinates[..., 2] <= named[..., 2] * SPEEDS_APART
    )
    return np.asarray(near)


def _falling(states: States) -> Finding | None:
    _, _, risen = _steps(states)
    falls, steps = int((risen < 0).sum()), risen.size
    if steps < _LEAST_STEPS or 2 * falls <= steps:
        return None
    return Finding.of(FindingKind.FORCE_FALLS_WITH_SPEED, falls=falls, steps=steps)


def _levelling(states: States) -> Finding | None:
    slower, faster, risen = _steps(states)
    if _falling(states):
        return None
    for lowest in np.unique(slower[slower >= _RISING_FROM]).tolist():
        above = slower >= lowest
        exponent = float(risen[above].sum() / faster[above].sum())
        if above.sum() >= _LEAST_STEPS and exponent < _LEAST_EXPONENT:
            figures = {"speed_mps": lowest, "steps": int(above.sum()), "exponent": exponent}
            return Finding.of(FindingKind.FORCE_LEVELS, **figures)
    return None


def _steps(states: States) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of each step from a state to the next faster one at its place: the slower speed [m/s], and by how much ln v and
    ln F rise, shape (n,)."""
    measured, tolerance = states.uncensored, StateTolerance()
    if not len(measured):
        return np.empty(0), np.empty(0), np.empty(0)
    place = clusters(measured.coordinates[:, :2] / tolerance.place)
    order = np.lexsort((measured.speed, place))
    speed = measured.speed[order]
    step = (np.diff(place[order]) == 0) & (np.diff(speed) > tolerance.speed)
    return speed[:-1][step], np.diff(np.log(speed))[step], np.diff(measured.log_force[order])[step]


def _higher_than_far(states: States) -> Finding | None:
    higher = len(states) > 1 and np.all(states.height > states.distance)
    return Finding.of(FindingKind.HIGHER_THAN_FAR, states=len(states)) if higher else None


def _exchanged(states: States) -> Finding | None:
    coordinates, margin = states.coordinates, StateTolerance().scale
    for axis in (1, 2):
        odd = coordinates[:, 0] < coordinates[:, axis]
        if not 0 < odd.mean() <= _FEW_STATES:
            continue
        low, high = coordinates[~odd].min(axis=0) - margin, coordinates[~odd].max(axis=0) + margin
        order = np.arange(3)
        order[[0, axis]] = axis, 0
        among = ((coordinates[:, order] >= low) & (coordinates[:, order] <= high)).all(axis=1)
        for first in np.flatnonzero(odd & (coordinates[:, 0] < low[0]) & (coordinates[:, axis] > high[axis]) & among)[
            :1
        ].tolist():
            return Finding.of(FindingKind.STATE_EXCHANGED, **_state(states, first), other=_AXES[axis])
    return None


def _state(states: States, row: int) -> dict[str, str | float]:
    d, h, v = states.coordinates[row].tolist()
    return {"state": states.name[row], "distance_m": d, "height_m": h, "speed_mps": v}
