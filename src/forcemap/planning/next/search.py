"""The search for the states of an opening and of a refinement."""

from __future__ import annotations

from functools import partial

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.campaigns.state import PLACE_SIZE, States, StateTolerance, places
from forcemap.errors import FitError
from forcemap.maps.bounds import MIN_DEGREES_OF_FREEDOM
from forcemap.maps.forms import Form
from forcemap.planning.optimal_states import bound_from, most_useful, optimal_states
from forcemap.planning.places import PlaceRange, at_speeds, no_repeats, spread
from forcemap.planning.runs import slow_to_fast

_WIDER = 1.5  # tolerances of repeats that states lie apart: speeds are never reached exactly; a choice
_REGION_PLACES, _REGION_SPEEDS = 5, 3  # along each axis, over which an opening is to be precise; a choice
_BELOW = 0.7  # share of the slowest speed to be confirmed at which the corners are measured; a choice
_ROUNDING = 1e-9  # [m/s]


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
        self._range, self._form = place_range, form
        self._tolerance = StateTolerance(min(_WIDER * tolerance.place, PLACE_SIZE), _WIDER * tolerance.speed)
        self._designed = partial(optimal_states, form=form, tolerance=self._tolerance, seed=seed)

    def opening(self, candidates: FloatArray, known: States | None, count: int, left: int) -> FloatArray:
        """The `count` slowest states, or fewer, of those that complete a design sufficient for a bound."""
        fixed = np.empty((0, 3)) if known is None else known.coordinates
        candidates = candidates[no_repeats(candidates, fixed, self._tolerance)]
        if not len(candidates):
            return candidates
        uncensored = 0 if known is None else int(np.sum(known.impacts > 0))
        wanted = len(self._form.terms) + MIN_DEGREES_OF_FREEDOM - uncensored
        speeds = np.linspace(candidates[:, 2].min(), candidates[:, 2].max(), _REGION_SPEEDS)
        region = at_speeds(self._range.grid(_REGION_PLACES), speeds)
        corners = self._corners(candidates, fixed, speeds[0])
        number = min(max(wanted, count, corners.size), max(left, corners.size))
        chosen = self._optimal(candidates, number, region, fixed, corners)
        if known is not None and not bound_from(np.vstack([known.uncensored.coordinates, chosen]), self._form):
            place = places(*np.vstack([fixed, candidates]).T[:2])
            new = ~np.isin(place[len(fixed) :], place[: len(fixed)])
            new[corners] = True
            corners = np.flatnonzero(np.isin(np.flatnonzero(new), corners))
            at_new_places = self._optimal(candidates[new], number, region, fixed, corners)
            chosen = at_new_places if len(at_new_places) else chosen
        if not len(chosen):  # the few speeds that may be measured do not determine the terms yet
            chosen = _far_apart(candidates, fixed, count)
        return slow_to_fast(chosen)[:count]

    def refining(
        self, candidates: FloatArray, known: States, wanted: FloatArray, unconfirmed: FloatArray, count: int
    ) -> FloatArray:
        """States that make the prediction precise at the wanted ones; first the corners below the unconfirmed ones."""
        fixed = known.coordinates
        candidates = candidates[no_repeats(candidates, fixed, self._tolerance)]
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
        """The most useful of the planned states: corners slower than all measured states, then by gain in precision."""
        lowest = self._range.corners(planned) & (planned[:, 2] < known.speed.min())
        order = most_useful(planned, len(planned), form=self._form, region=wanted, fixed=known.coordinates)
        return planned[sorted(order, key=lambda i: not lowest[i])[:count]]

    def _corners(self, candidates: FloatArray, fixed: FloatArray, speed: float) -> Indices:
        """Numbers of the candidates at corners of the range, at `speed`, where nothing as slow is measured yet."""
        corners = np.flatnonzero(self._range.corners(candidates) & (np.abs(candidates[:, 2] - speed) < _ROUNDING))
        if not len(fixed):
            return corners
        near: Mask = np.abs(candidates[corners][:, None, :2] - fixed[:, :2]).max(axis=2) <= PLACE_SIZE
        slower = near & (fixed[None, :, 2] <= speed + self._tolerance.speed)
        return corners[~slower.any(axis=1)]

    def _optimal(
        self, candidates: FloatArray, count: int, region: FloatArray, fixed: FloatArray, required: Indices
    ) -> FloatArray:
        """An I-optimal choice; none where the candidates cannot determine the form."""
        count = min(count, len(candidates))
        try:
            return self._designed(candidates, count, region=region, fixed=fixed, required=required).states
        except FitError:
            return np.empty((0, 3))


def _far_apart(candidates: FloatArray, fixed: FloatArray, count: int) -> FloatArray:
    """States far from the measured ones and from each other."""
    points = np.vstack([fixed, candidates])
    scaled = points / np.maximum(np.ptp(points, axis=0), 1e-9)
    apart = np.abs(scaled[:, None] - scaled[None]).max(axis=2)
    chosen = spread(apart, range(max(len(fixed), 1)), len(fixed) + count)
    return points[[i for i in chosen if i >= len(fixed)]]
