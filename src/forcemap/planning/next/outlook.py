"""Confirmed speeds to expect from further states, before they are measured."""

from __future__ import annotations

import math

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.state import places as place_numbers
from forcemap.maps.bounds import ToleranceBound
from forcemap.maps.force_map import ForceMap
from forcemap.maps.measured_range import MeasuredRange
from forcemap.maps.places import whitened
from forcemap.maps.slower_impacts import cover_slower
from forcemap.planning.optimal_states import LARGEST_LOG, tolerance_factor

_STEP = 0.0025  # [m/s] of the grid of speeds; a choice: gains are means over many places
_LEAST_LEVERAGE = 1e-9  # above what rounding leaves of 0


class Outlook:
    """Speeds that a map confirms, and would confirm with further states if they measured what it predicts.

    On a grid of speeds, for comparisons only: only `safe_speed` permits a speed.

    Parameters
    ----------
    force_map : ForceMap
        A fitted map.
    bound : ToleranceBound
    places : array
        (distance, height) [m], shape (n, 2).
    limit : float
        Force limit [N].
    fastest : float
        Highest speed considered [m/s].
    """

    def __init__(
        self, force_map: ForceMap, bound: ToleranceBound, places: FloatArray, limit: float, fastest: float
    ) -> None:
        self._map, self._bound, self._limit = force_map, bound, limit
        self._slower = cover_slower(force_map).raised
        speeds = np.arange(1, math.ceil(fastest / _STEP) + 2) * _STEP
        self._places, self._speeds = places, speeds
        states = np.column_stack([np.repeat(places, speeds.size, axis=0), np.tile(speeds, len(places))])
        self._force = force_map.predict(*states.T)
        self._design = force_map.form.design(*states.T)
        triangle = np.linalg.inv(force_map.require_fit().between_states.inverse_triangle)
        self._information = triangle.T @ triangle

    def speeds(self, further: FloatArray) -> FloatArray:
        """Confirmed speed at every place with further states, shape (m, 3); 0 where there is none [m/s]."""
        fit = self._map.require_fit()
        information = self._information
        if len(further):  # what they add to the measured states, whose places they may share
            known = fit.states.coordinates
            information = information + self._of(np.vstack([known, further])) - self._of(known)
        inverse = np.linalg.inv(information)
        leverage = np.maximum((self._design @ inverse * self._design).sum(axis=1), _LEAST_LEVERAGE)
        factor = tolerance_factor(
            leverage,
            fit.between_states.degrees_of_freedom + len(further),
            confidence=self._bound.confidence,
            content=self._bound.content,
        )
        upper = self._force * np.exp(np.minimum(fit.state_sd * factor, LARGEST_LOG))
        upper = np.maximum(upper, self._force + self._bound.device_error)
        upper = upper.reshape(len(self._places), self._speeds.size)
        reach = MeasuredRange(np.vstack([self._map.measured_range.points, further]))
        low, high = reach.speeds(self._places[:, 0], self._places[:, 1])
        measured = self._speeds[None, :] >= np.nan_to_num(low)[:, None] - _STEP
        beyond = (upper > self._limit) & measured
        first = np.where(beyond.any(axis=1), beyond.argmax(axis=1), self._speeds.size)
        speed = np.minimum(np.append(0.0, self._speeds)[first], high)
        slowest = np.searchsorted(self._speeds, self._map.measured_range.lowest[2])
        closed = self._slower * upper[:, slowest] > self._limit if self._slower else np.zeros(len(low), np.bool_)
        return np.where(np.isnan(low) | (speed < low) | closed, 0.0, speed)

    def _of(self, states: FloatArray) -> FloatArray:
        """Information X'V^-1 X of states, shape (n, 3), those of a place correlated as in the map's fit."""
        place, effect = place_numbers(states[:, 0], states[:, 1]), self._map.require_fit().place_effect
        x = whitened(self._map.form.design(*states.T), place, effect.correlation)
        return np.asarray(x.T @ x)
