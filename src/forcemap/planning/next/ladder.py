"""How fast each place may be measured: slow to fast, and never beyond a force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.state import States, StateTolerance
from forcemap.findings import Finding, FindingKind
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.maps.slower_impacts import cover_slower, upper_of_slower
from forcemap.planning import measured_before as before
from forcemap.planning.expectation import Expectation, expected_forces, factor_of, never_falling, rest_of, source_of
from forcemap.planning.measured_before import NEAR, ONE_PLACE
from forcemap.planning.places import PlaceRange

# Choices, tried in simulated campaigns (docs/short_campaigns.md).
_RUNG = 1.5  # times the speed measured at the place that may be planned, with a bound
_FIRST_RUNG = 3.0  # the same before there is a bound; where nothing was measured, times the slowest speed nearby
_SCATTER = 1.1  # factor by which the force of a state may exceed a measured one, before there is a bound
_ROUNDING = 1e-9  # [m/s]


@dataclass(frozen=True, eq=False)
class OpeningLadder:
    """Speeds that may be measured before there is a bound: by the expected force and what was measured.

    Parameters
    ----------
    expectation : ForceMap, StandardExpectation or callable
        The force to expect [N].
    highest : float
        Force that no impact is to exceed [N].
    limit : float
        Force limit [N]: no state above the slowest speed is planned that is expected to exceed it.
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
        """Where the expected forces come from."""
        return source_of(self.expectation, states)

    def upper_is(self, states: FloatArray) -> Finding:
        """How `upper` is computed."""
        figures = {"factor": factor_of(self.expectation), "rest_N": rest_of(self.expectation), "near_mm": 1000 * NEAR}
        return Finding.of(FindingKind.UPPER_BY_EXPECTATION, **figures)

    def expected(self, states: FloatArray) -> FloatArray:
        """Expected force [N], shape (n,)."""
        return expected_forces(self.expectation, states)

    def upper(self, states: FloatArray) -> FloatArray:
        """Force that is not expected to be exceeded [N], shape (n,).

        At a place that was measured, from its states: their force and a tenth, above their speed plus the expected
        increase times the factor, and above the fastest of them not less than its force in proportion to speed.
        Elsewhere the expected force with its margin, or, once all corners are measured, the largest force that any
        measured place gives; not less than the nearest place gives. Never below what was measured within 5 cm at a
        lower speed.
        """
        force = self.expected(states)
        model = np.maximum(factor_of(self.expectation) * force, force + rest_of(self.expectation))
        if self.seen is None:
            return model
        measured = before.measured_before(states, self.seen, self.tolerance)
        return np.maximum(self._by_measured(states, model, self.seen), measured)

    def _by_measured(self, states: FloatArray, model: FloatArray, seen: States) -> FloatArray:
        """The model's force [N] of states, shape (n,), replaced by what the measured places give where they do."""
        known, force = seen.coordinates, _SCATTER * before.largest_force(seen)
        increase = np.maximum(self.expected(states)[:, None] - self.expected(known)[None, :], 0.0)
        by_state = force + factor_of(self.expectation) * increase
        place = (self.place_range.apart(known, known) < ONE_PLACE).argmax(axis=1)  # the first state of each place
        first = np.unique(place)
        by_place = np.stack([np.where(place == number, by_state, np.inf).min(axis=1) for number in first], axis=1)
        top = np.array([np.where(place == number, seen.speed, 0.0).argmax() for number in first])
        in_proportion = force[top] * np.maximum(states[:, 2:] / seen.speed[top], 1.0)
        by_place = np.maximum(by_place, np.where(states[:, 2:] > seen.speed[top], in_proportion, 0.0))
        apart = self.place_range.apart(states, known[first])
        nearest = by_place[np.arange(len(states)), apart.argmin(axis=1)]
        corners = np.column_stack([self.place_range.grid(2), np.zeros(4)])
        if np.all(self.place_range.apart(corners, known).min(axis=1) < ONE_PLACE):
            model = np.minimum(model, by_place.max(axis=1))
        return np.asarray(np.where(apart.min(axis=1) < ONE_PLACE, nearest, np.maximum(model, nearest)))

    def allows(self, states: FloatArray) -> Mask:
        """Which states may be measured, shape (n,)."""
        allowed = (self.expected(states) <= self.limit) | (states[:, 2] <= self.slowest)
        fastest: FloatArray | float = self.slowest
        if self.seen is not None:
            same = self.place_range.apart(states, self.seen.coordinates) < ONE_PLACE
            measured = np.where(same, self.seen.speed, 0.0).max(axis=1)
            fastest = np.where(same.any(axis=1), measured, before.slowest_nearby(states, self.seen, self.place_range))
            allowed &= ~before.saturated_before(states, self.seen, self.place_range, self.tolerance)
        allowed &= states[:, 2] <= _FIRST_RUNG * fastest + _ROUNDING
        return np.asarray(allowed & (self.upper(states) <= self.highest))


@dataclass(frozen=True, eq=False)
class BoundLadder:
    """Speeds that may be measured once there is a bound: by the bound, and not much faster than measured before.

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
        """Where the expected forces come from."""
        return Finding.of(FindingKind.EXPECTED_BY_STATES, states=len(self.force_map.measured_range.points))

    def expected(self, states: FloatArray) -> FloatArray:
        """Expected force [N], shape (n,)."""
        return np.asarray(self.force_map.predict(*states.T))

    def upper(self, states: FloatArray) -> FloatArray:
        """The bound [N], shape (n,), raised where forces measured within 5 cm at a lower speed contradict it.

        It does not fall with speed; above the fastest speed measured at the place it rises at least in proportion.
        Slower than the map has it, it is that at the map's lowest speed. It is nowhere below what impacts demand that
        are slower than the map is to hold for, which contradict nothing.
        """
        lowest = self.force_map.measured_range.lowest[2]
        states = np.column_stack([states[:, :2], np.maximum(states[:, 2], lowest)])

        def bound(points: FloatArray) -> FloatArray:
            return np.asarray(self.bound.upper(self.force_map, *points.T))

        upper = never_falling(bound, states, *self._measured(states))
        upper = np.maximum(upper, upper_of_slower(self.force_map, self.bound, *states[:, :2].T))
        held_for = self.seen.select(~np.isin(self.seen.name, self.force_map.slower.name))
        return before.raised_by_measured(upper, states, held_for, bound(held_for.coordinates), self.tolerance)

    def _measured(self, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lowest and fastest speed measured at places [m/s]; outside the measured range those of the nearest state."""
        known = self.force_map.measured_range.points
        nearest = known[self.place_range.apart(states, known).argmin(axis=1), 2]
        low, high = self.force_map.measured_range.speeds(states[:, 0], states[:, 1])
        return np.where(np.isnan(low), nearest, low), np.where(np.isnan(high), nearest, high)

    def upper_is(self, states: FloatArray) -> Finding:
        """How `upper` is computed."""
        slower = upper_of_slower(self.force_map, self.bound, *states[:, :2].T)
        demanded = bool((slower >= self.upper(states)).any())
        figures = {
            "lowest_mps": float(self.force_map.measured_range.lowest[2]),
            "slower": max(cover_slower(self.force_map).raised - 1, 0.0) if demanded else None,
        }
        return Finding.of(FindingKind.UPPER_BY_BOUND, bound=self.bound, near_mm=1000 * NEAR, **figures)

    def allows(self, states: FloatArray) -> Mask:
        """Which states may be measured, shape (n,)."""
        nearby = before.slowest_nearby(states, self.seen, self.place_range)
        rung = np.minimum(_RUNG * self._measured(states)[1], _FIRST_RUNG * nearby)
        allowed = ~before.saturated_before(states, self.seen, self.place_range, self.tolerance)
        return np.asarray(allowed & (self.upper(states) <= self.highest) & (states[:, 2] <= rung + _ROUNDING))
