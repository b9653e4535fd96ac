"""Drift over a campaign: states measured again at its end, beside what they gave at first."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.campaigns.state import States, places
from forcemap.findings import Finding, FindingKind

ERROR_PROBABILITY = 0.05
"""Share of campaigns without a drift in which one is found."""

_APART = 0.2
"""Change of the force of one state above which it is said by its name. A choice: six times what states scatter by;
devices put up again differ by less."""

_LEAST_SPREAD = 0.1
"""Sum of squares of ln v about the means of places, from which on forces tell how they rise with speed; a choice."""

_AS_FAST = 0.02
"""Difference of ln v up to which impacts made again count as no faster, but for errors of the speed; a choice."""

LEAST_DRIFT = 0.01
"""Change of the force, as a share of it, below which it does not matter, however sure. A choice: states scatter by 2.1
to 3.3 % (the paper's robots)."""


@dataclass(frozen=True)
class Drift:
    """How far the force of states has changed between their first impacts and those made again.

    The effects of a state and of its place are in both and cancel; that of putting up the device again does not. So
    the scatter of the changes d = ln F again less ln F at first shows how sure their mean is: a t test with k - 1
    degrees of freedom. Of states that were slower again, d is less b ln (v again / v at first).

    Parameters
    ----------
    states : int
        Number k of states measured again.
    censored : int
        In how many of them the later force is a lower bound: then so is their change, and the mean change.
    apart : tuple of (str, float)
        States whose force changed by more than states ever scatter, and by how much, as a share of it.
    change, low, high : float
        Mean change as a share of the force, and its 95 % confidence interval; infinite with one state.
    p_value : float
        Two-sided; NaN with one state.
    """

    states: int
    censored: int
    apart: tuple[tuple[str, float], ...]
    change: float
    low: float
    high: float
    p_value: float

    @property
    def significant(self) -> bool:
        """True if the change is significant, and may be as large as matters."""
        return self.p_value <= ERROR_PROBABILITY and not self.small

    @property
    def small(self) -> bool:
        """True if the whole confidence interval is smaller than matters."""
        return max(abs(self.low), abs(self.high)) < LEAST_DRIFT

    @property
    def finding(self) -> Finding:
        """The change with its interval, significant or not."""
        kind = FindingKind.DRIFT_FOUND if self.significant else FindingKind.DRIFT_NOT_FOUND
        return Finding.of(
            kind,
            states=self.states,
            censored=self.censored,
            change=self.change,
            low=self.low,
            high=self.high,
            p=self.p_value,
            small=self.p_value <= ERROR_PROBABILITY and self.small,
            explained=self.p_value > ERROR_PROBABILITY and not self.apart,
            apart=self.apart,
            least=LEAST_DRIFT,
        )


def _speed_slope(states: States) -> float:
    """b of ln F = a_place + b ln v, by least squares over the places that were measured at several speeds.

    Without any 1, the standard's contact model.
    """
    read = states.select(states.censored == 0)
    place = places(read.distance, read.height)
    counts = np.bincount(place)
    speed, force = (
        values - (np.bincount(place, values) / counts)[place] for values in (np.log(read.speed), read.log_force)
    )
    spread = float(speed @ speed)
    return float(speed @ force) / spread if spread > _LEAST_SPREAD else 1.0


def measured_again(first: States, again: States) -> Drift | None:
    """Compare states that were measured twice; states are the same if they bear the same name.

    Impacts made again may be slower by as much as forces drift: then at the speed of the first. Faster ones count as
    they are, for where the force hardly rises with speed a slope of all speeds would hide a drift.

    Parameters
    ----------
    first : States
        Those with role train.
    again : States
        Those with role test.

    Returns
    -------
    Drift or None
        None if no state is among both whose first impacts are uncensored.
    """
    names = sorted({*first.select(first.censored == 0).name} & {*again.name})
    if not names:
        return None
    reached = np.log(np.fmax(again.highest, again.at_least))
    log_again = np.where(again.censored == 0, again.log_force, reached)
    pairs = ((first.name, first.log_force), (again.name, log_again), (again.name, again.censored > 0))
    of_first, of_again, above = (dict(zip(name, values.tolist(), strict=True)) for name, values in pairs)
    speeds = (dict(zip(states.name, np.log(states.speed).tolist(), strict=True)) for states in (first, again))
    v_first, v_again = (np.array([of_speed[name] for name in names]) for of_speed in speeds)
    change = np.array([of_again[name] - of_first[name] for name in names])
    faster = v_again - v_first
    change -= max(_speed_slope(first), 0.0) * np.where(faster > _AS_FAST, 0.0, faster)
    k, mean, censored = len(names), float(change.mean()), sum(above[name] for name in names)
    shares = zip(names, np.expm1(change).tolist(), strict=True)
    apart = tuple((name, share) for name, share in shares if abs(share) > _APART)
    if k == 1:
        return Drift(k, censored, apart, math.expm1(mean), -1.0, math.inf, math.nan)
    from scipy.special import stdtr, stdtrit

    # the same forces to the last digit, as in a table typed by hand, show no scatter, but no sure drift of 0 either
    sd = max(float(change.std(ddof=1)), np.finfo(np.float64).eps) / math.sqrt(k)
    half = float(stdtrit(k - 1, 1 - ERROR_PROBABILITY / 2)) * sd
    p_value = float(2 * stdtr(k - 1, -abs(mean) / sd))
    return Drift(k, censored, apart, math.expm1(mean), math.expm1(mean - half), math.expm1(mean + half), p_value)
