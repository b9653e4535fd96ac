"""How fast may be measured where: slow to fast, and never beyond a force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.state import States, StateTolerance
from forcemap.findings import Finding, FindingKind
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.planning import measured_before as before
from forcemap.planning.expectation import Expectation, expected_forces, factor_of, never_falling, rest_of, source_of
from forcemap.planning.measured_before import NEAR, SAME_PLACE
from forcemap.planning.places import PlaceRange

_RUNG = 1.5  # how many times faster than what was measured there
_FIRST_RUNG = 3.0  # the same before there is a bound; and than the slowest state nearby, where nothing was measured
_SCATTER = 1.1  # what the force of a state may exceed a measured one by, before a bound tells


@dataclass(frozen=True, eq=False)
class OpeningLadder:
    """Before there is a bound: by the expected force and what was measured.

    Parameters
    ----------
    expectation : ForceMap, StandardExpectation or callable
        The force to expect [N].
    highest : float
        Force that no impact is to exceed [N].
    limit : float
        Force limit [N]: above the slowest speed no state is measured that is expected to exceed it.
    slowest : float
        Slowest speed [m/s].
    seen : States or None
        Everything measured, test states too.
    place_range : PlaceRange
    tolerance : StateTolerance
        How far repeats of a state may lie apart.
    """

    expectation: Expectation
    highest: float
    limit: float
    slowest: float
    seen: States | None
    place_range: PlaceRange
    tolerance: StateTolerance

    def source(self, states: FloatArray) -> Finding | None:
        """What the expected forces come from."""
        return source_of(self.expectation, states)

    def upper_is(self) -> Finding:
        """What `upper` is."""
        figures = {"factor": factor_of(self.expectation), "rest_N": rest_of(self.expectation), "near_mm": 1000 * NEAR}
        return Finding.of(FindingKind.UPPER_BY_EXPECTATION, **figures)

    def expected(self, states: FloatArray) -> FloatArray:
        """Expected force [N], shape (n,)."""
        return expected_forces(self.expectation, states)

    def upper(self, states: FloatArray) -> FloatArray:
        """What the force is not expected to exceed [N], shape (n,).

        At a place that was measured: by what its states tell, their force and a tenth, and above their speed the
        expected increase times the factor, but above the fastest of them not less than its force in proportion to
        speed. Elsewhere by the expected force and its margin, or by the worst that any place tells once all corners are
        measured, and not less than the nearest place tells. Never below what was measured within 5 cm at a lower speed.
        """
        force = self.expected(states)
        model = np.maximum(factor_of(self.expectation) * force, force + rest_of(self.expectation))
        if self.seen is None:
            return model
        measured = before.measured_before(states, self.seen, self.tolerance)
        return np.maximum(self._told(states, model, self.seen), measured)

    def _told(self, states: FloatArray, model: FloatArray, seen: States) -> FloatArray:
        known, force = seen.coordinates, _SCATTER * before.largest_force(seen)
        increase = np.maximum(self.expected(states)[:, None] - self.expected(known)[None, :], 0.0)
        tells = force + factor_of(self.expectation) * increase
        place = (self.place_range.apart(known, known) < SAME_PLACE).argmax(axis=1)  # the first state of each place
        first = np.unique(place)
        told = np.stack([np.where(place == one, tells, np.inf).min(axis=1) for one in first], axis=1)
        top = np.array([np.where(place == one, seen.speed, 0.0).argmax() for one in first])
        in_proportion = force[top] * np.maximum(states[:, 2:] / seen.speed[top], 1.0)
        told = np.maximum(told, np.where(states[:, 2:] > seen.speed[top], in_proportion, 0.0))
        apart = self.place_range.apart(states, known[first])
        nearest = told[np.arange(len(states)), apart.argmin(axis=1)]
        corners = np.column_stack([self.place_range.grid(2), np.zeros(4)])
        if np.all(self.place_range.apart(corners, known).min(axis=1) < SAME_PLACE):
            model = np.minimum(model, told.max(axis=1))
        return np.asarray(np.where(apart.min(axis=1) < SAME_PLACE, nearest, np.maximum(model, nearest)))

    def allows(self, states: FloatArray) -> Mask:
        """Which states may be measured, shape (n,)."""
        allowed = (self.expected(states) <= self.limit) | (states[:, 2] <= self.slowest)
        fastest: FloatArray | float = self.slowest
        if self.seen is not None:
            same = self.place_range.apart(states, self.seen.coordinates) < SAME_PLACE
            there = np.where(same, self.seen.speed, 0.0).max(axis=1)
            fastest = np.where(same.any(axis=1), there, before.slowest_nearby(states, self.seen, self.place_range))
            allowed &= ~before.saturated_before(states, self.seen, self.place_range, self.tolerance)
        allowed &= states[:, 2] <= _FIRST_RUNG * fastest + 1e-9
        return np.asarray(allowed & (self.upper(states) <= self.highest))


@dataclass(frozen=True, eq=False)
class BoundLadder:
    """With a bound: by the bound, and not much faster than what was measured there.

    Parameters
    ----------
    force_map : ForceMap
    bound : Bound
    highest : float
        Force that no impact is to exceed [N].
    seen : States
        Everything measured, test states too.
    place_range : PlaceRange
    tolerance : StateTolerance
        How far repeats of a state may lie apart.
    """

    force_map: ForceMap
    bound: Bound
    highest: float
    seen: States
    place_range: PlaceRange
    tolerance: StateTolerance

    def source(self, states: FloatArray) -> Finding | None:
        """What the expected forces come from."""
        return Finding.of(FindingKind.EXPECTED_BY_STATES, states=len(self.force_map.measured_range.points))

    def expected(self, states: FloatArray) -> FloatArray:
        """Expected force [N], shape (n,)."""
        return np.asarray(self.force_map.predict(*states.T))

    def upper(self, states: FloatArray) -> FloatArray:
        """The bound [N], shape (n,), raised where what was measured within 5 cm at a lower speed contradicts it.

        It does not fall with speed; above the fastest speed measured at the place it rises at least in proportion.
        """

        def bound(at: FloatArray) -> FloatArray:
            return np.asarray(self.bound.upper(self.force_map, *at.T))

        upper = never_falling(bound, states, *self._measured(states))
        return before.raised_by_measured(upper, states, self.seen, bound(self.seen.coordinates), self.tolerance)

    def _measured(self, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lowest and fastest speed measured at places [m/s]; outside the measured range those of the nearest state."""
        known = self.force_map.measured_range.points
        nearest = known[self.place_range.apart(states, known).argmin(axis=1), 2]
        low, high = self.force_map.measured_range.speeds(states[:, 0], states[:, 1])
        return np.where(np.isnan(low), nearest, low), np.where(np.isnan(high), nearest, high)

    def upper_is(self) -> Finding:
        """What `upper` is."""
        return Finding.of(FindingKind.UPPER_BY_BOUND, bound=self.bound, near_mm=1000 * NEAR)

    def allows(self, states: FloatArray) -> Mask:
        """Which states may be measured, shape (n,)."""
        nearby = before.slowest_nearby(states, self.seen, self.place_range)
        rung = np.minimum(_RUNG * self._measured(states)[1], _FIRST_RUNG * nearby)
        allowed = ~before.saturated_before(states, self.seen, self.place_range, self.tolerance)
        return np.asarray(allowed & (self.upper(states) <= self.highest) & (states[:, 2] <= rung + 1e-9))
