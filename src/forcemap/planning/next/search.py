"""The search for the states of an opening and of a refinement."""

from __future__ import annotations

import numpy as np

from forcemap.arrays import FloatArray, Indices
from forcemap.campaigns.state import States, StateTolerance
from forcemap.errors import FitError
from forcemap.maps.bounds import MIN_DEGREES_OF_FREEDOM
from forcemap.maps.forms import Form
from forcemap.planning.optimal_states import most_useful, optimal_states
from forcemap.planning.places import PlaceRange

_WIDER = 1.5  # than the tolerance of repeats: how far states lie apart, for speeds never come out exactly
_REGION_PLACES = 5  # along each axis
_BELOW = 0.7  # of the slowest speed to be confirmed: where the corners are measured


class Search:
    """Chooses states among candidates that may be measured; states are arrays of shape (n, 3).

    Parameters
    ----------
    place_range : PlaceRange
    form : Form
        The map that will be fitted.
    tolerance : StateTolerance
        How far repeats of a state may lie apart.
    seed : int
    """

    def __init__(self, place_range: PlaceRange, form: Form, tolerance: StateTolerance, seed: int) -> None:
        self._range, self._form, self._seed = place_range, form, seed
        self._tolerance = StateTolerance(_WIDER * tolerance.place, _WIDER * tolerance.speed)

    def opening(self, candidates: FloatArray, known: States | None, count: int, left: int) -> FloatArray:
        """The `count` slowest states, or fewer, of those that complete a design from which a bound can be had."""
        fixed = np.empty((0, 3)) if known is None else known.coordinates
        candidates = self._new(candidates, fixed)
        if not len(candidates):
            return candidates
        uncensored = 0 if known is None else int(np.sum(known.impacts > 0))
        wanted = len(self._form.terms) + MIN_DEGREES_OF_FREEDOM - uncensored
        speeds = np.linspace(candidates[:, 2].min(), candidates[:, 2].max(), 3)
        region = self._range.states(_REGION_PLACES, speeds)
        corners = self._corners(candidates, fixed, speeds[0])
        number = min(max(wanted, count, corners.size), max(left, corners.size))
        chosen = self._optimal(candidates, number, region, fixed, corners)
        if not len(chosen):  # the few speeds that may be measured do not tell the terms apart yet
            chosen = self._spread(candidates, fixed, count)
        return chosen[np.lexsort((chosen[:, 1], -chosen[:, 0], chosen[:, 2]))][:count]

    def refining(
        self, candidates: FloatArray, known: States, wanted: FloatArray, unconfirmed: FloatArray, count: int
    ) -> FloatArray:
        """States that make the prediction precise at the wanted ones, the corners below the unconfirmed ones first."""
        fixed = known.coordinates
        candidates = self._new(candidates, fixed)
        if not len(candidates):
            return candidates
        corners = np.empty(0, dtype=np.int64)
        if len(unconfirmed):
            below = candidates[candidates[:, 2] <= max(_BELOW * unconfirmed[:, 2].min(), candidates[:, 2].min()), 2]
            corners = self._corners(candidates, fixed, float(below.max()))[:count]
        for number in range(min(count, len(candidates)), corners.size - 1, -1):
            chosen = self._optimal(candidates, number, wanted, fixed, corners)
            if len(chosen):
                return chosen
        return candidates[corners]

    def first(self, planned: FloatArray, known: States, wanted: FloatArray, count: int) -> FloatArray:
        """The most useful of the planned states: corners below all that is measured, then by what they tell."""
        lowest = self._range.corners(planned) & (planned[:, 2] < known.speed.min())
        order = most_useful(planned, len(planned), form=self._form, region=wanted, fixed=known.coordinates)
        return planned[sorted(order, key=lambda i: not lowest[i])[:count]]

    def _new(self, candidates: FloatArray, fixed: FloatArray) -> FloatArray:
        """The candidates that are no repeats of what is measured."""
        if not len(fixed):
            return candidates
        scale = self._tolerance.scale
        away = np.abs(candidates[:, None, :] - fixed[None, :, :]) / scale
        return np.asarray(candidates[away.max(axis=2).min(axis=1) > 1])

    def _corners(self, candidates: FloatArray, fixed: FloatArray, speed: float) -> Indices:
        """Numbers of the candidates at corners of the range, at `speed`, below which nothing is measured there."""
        at = np.flatnonzero(self._range.corners(candidates) & (np.abs(candidates[:, 2] - speed) < 1e-9))
        if not len(fixed):
            return at
        near = self._range.apart(candidates[at], fixed) < 1e-6
        slower = near & (fixed[None, :, 2] <= speed + self._tolerance.speed)
        return at[~slower.any(axis=1)]

    def _optimal(
        self, candidates: FloatArray, count: int, region: FloatArray, fixed: FloatArray, required: Indices
    ) -> FloatArray:
        """An I-optimal choice; none where the candidates cannot determine the form."""
        try:
            designed = optimal_states(
                candidates,
                min(count, len(candidates)),
                form=self._form,
                region=region,
                fixed=fixed,
                required=required,
                tolerance=self._tolerance,
                seed=self._seed,
            )
        except FitError:
            return np.empty((0, 3))
        return designed.states

    def _spread(self, candidates: FloatArray, fixed: FloatArray, count: int) -> FloatArray:
        """States far from what is measured, and from each other."""
        size = np.maximum(np.ptp(np.vstack([candidates, fixed]), axis=0), 1e-9)
        chosen: list[int] = []
        while len(chosen) < min(count, len(candidates)):
            taken = np.vstack([fixed, candidates[chosen]])
            if not len(taken):
                chosen.append(0)
                continue
            away = np.abs((candidates[:, None, :] - taken[None, :, :]) / size).max(axis=2).min(axis=1)
            if not away.max() > 0:
                break
            chosen.append(int(away.argmax()))
        return candidates[chosen]
