"""Whether forces, speeds and times can be in the units they are taken for: what a campaign's states show together.

The force of a constrained contact is about v sqrt(k m_R), the standard's contact model with the spring constant k of
the device and the robot's effective mass m_R. Single impacts scatter far too widely about it, and slow ones of a
controlled robot exceed it by nature; the geometric mean over a campaign's fast states is 0.9 to 1.1 for the robots that
are known, and below 0.31 or above 3 after a slip. Phase I lasts about pi sqrt(m_R / k), and tells a slip of the unit of
time alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.state import States
from forcemap.findings import Finding, FindingKind

# Tried on all published maps and presets of the virtual lab (tests/test_units.py): the mean is 0.94 to 1.08 for them.
SLOWEST = 0.2
"""Slower states [m/s] show nothing: a controlled robot pushes until it notices the contact, however slow it is."""
_OF_FASTEST = 0.5  # nor do those slower than this share of the fastest state, in case the unit of speed is mistaken
_LOWEST, _HIGHEST = 0.5, 2.0  # force over the contact model's: the mean of a campaign in the right units lies between
_LOWEST_COVERED = 1 / 3  # with a cover, which softens the contact unknown to the model
_SINGLE = 2.0  # by which a single impact may lie lower: those of known robots are above 0.65, a wrist alone is lighter
_USUAL_SPRING = 75e3  # [N/m]; on a softer one the force falls more slowly than its root, so the ratio may be higher
_ALIKE = 1.5  # factor within which a slip explains the ratio about as well as the likeliest
_LONGEST = 20.0  # Phase I over pi sqrt(m_R / k): soft contacts and slow robots stay below; a slip of time is 1000
_NO_COVER = ("", "none", "no", "-", "keine", "ohne")
_SLIPS = {  # what a force or a speed comes out as, over what it is, where figures in this unit are taken for N or m/s
    "kN": 1e-3,
    "daN": 0.1,
    "kgf": 1 / 9.80665,
    "lbf": 1 / 4.4482216,
    "mm/s": 1e-3,
    "cm/s": 1e-2,
    "km/h": 1 / 3.6,
    "ft/s": 0.3048,
    "mph": 0.44704,
}


def unit_finding(conditions: Conditions, *groups: States) -> Finding | None:
    """UNIT_SLIP if forces or speeds are in another unit, UNITS_NOT_CHECKED if that cannot be checked, else None.

    Parameters
    ----------
    conditions : Conditions
        They state the robot's moving mass and the device's spring.
    *groups : States
        All states of the campaign. A force above the device range counts as its lower bound, and never as too low.
    """
    names = [name for states in groups for name in states.name]
    springs = np.array([conditions.device_of(name).stiffness for name in names])
    springs = np.where(np.isnan(springs), conditions.device.stiffness, springs)
    missing = {"robot.moving_mass_kg": conditions.robot_mass, "device.stiffness_N_per_m": conditions.device.stiffness}
    if unknown := tuple(entry for entry, figure in missing.items() if math.isnan(figure)):
        return Finding.of(FindingKind.UNITS_NOT_CHECKED, missing=unknown, slow=False, slowest_mps=SLOWEST)
    speed, force = _joined(groups, "speed"), np.fmax(_joined(groups, "force"), _joined(groups, "at_least"))
    fast = speed >= max(SLOWEST, _OF_FASTEST * speed.max(initial=0.0))
    ratio = force / (speed * np.sqrt(springs * conditions.robot_mass))
    highest = _HIGHEST * np.sqrt(np.maximum(_USUAL_SPRING / springs, 1.0))
    lowest = _lowest(conditions)
    read = fast & (_joined(groups, "censored") == 0)
    low, high = _mean(ratio[read]), _mean(ratio[fast])
    slip = low if low < lowest else high
    if low < lowest or high > _mean(highest[fast]):
        figures = {"ratio": slip, "states": int(fast.sum()), "single": None, "low": slip < 1, "units": _likely(slip)}
        return Finding.of(FindingKind.UNIT_SLIP, **figures, fastest_mps=float(speed.max()))
    if not read.any():
        return Finding.of(FindingKind.UNITS_NOT_CHECKED, missing=(), slow=True, slowest_mps=SLOWEST)
    return None


def single_unit_finding(conditions: Conditions, speed: float, force: float) -> Finding | None:
    """UNIT_SLIP of an impact at a contact point whose force is far below the contact model's; None if it is not.

    Whatever the speed: a controlled robot adds to the force of a slow contact. NaN of the speed or force [m/s], [N], or
    what the conditions do not state, tells nothing.
    """
    ratio = force / (speed * math.sqrt(conditions.device.stiffness * conditions.robot_mass)) if speed > 0 else math.nan
    if not ratio < _lowest(conditions) / _SINGLE:
        return None
    figures = {"ratio": ratio, "states": 1, "single": True, "low": True, "units": _likely(ratio)}
    return Finding.of(FindingKind.UNIT_SLIP, **figures, fastest_mps=speed)


def _lowest(conditions: Conditions) -> float:
    return _LOWEST if conditions.covers.strip().casefold() in _NO_COVER else _LOWEST_COVERED


def unit_of_time_finding(durations: FloatArray, springs: FloatArray, robot_mass: float) -> Finding | None:
    """UNIT_OF_TIME_SLIP if times are in another unit, by the durations of Phase I [s] on springs [N/m]; else None.

    Their geometric mean counts; a duration or spring that is not known (NaN) is left out.
    """
    ratio = durations / (np.pi * np.sqrt(robot_mass / springs))
    ratio = ratio[ratio > 0]
    if not (mean_ratio := _mean(ratio)) > _LONGEST and not mean_ratio < 1 / _LONGEST:
        return None
    figures = {"duration_s": _mean(durations[durations > 0]), "ratio": mean_ratio, "long": mean_ratio > 1}
    return Finding.of(FindingKind.UNIT_OF_TIME_SLIP, **figures, recordings=ratio.size, most=_LONGEST)


def _joined(groups: Iterable[States], name: str) -> FloatArray:
    return np.concatenate([[], *(np.asarray(getattr(states, name), dtype=np.float64) for states in groups)])


def _mean(ratios: FloatArray) -> float:
    """Geometric mean; NaN if there are none."""
    return float(np.exp(np.mean(np.log(ratios)))) if ratios.size else math.nan


def _likely(ratio: float) -> tuple[str, ...]:
    """The units whose slip gives about this ratio, likeliest first."""
    away = {unit: abs(math.log(min(ratio, 1 / ratio) / slip)) for unit, slip in _SLIPS.items()}
    nearest = min(away.values())
    return tuple(unit for unit in sorted(away, key=away.__getitem__) if away[unit] <= max(nearest, math.log(_ALIKE)))
