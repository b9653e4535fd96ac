"""Whether two impacts are one and the same, however their files are named, cut off, written or offset."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from forcemap.arrays import FloatArray, Indices
from forcemap.impacts.impact import Impact
from forcemap.recordings.recording import Recording

Edge = tuple[float, ...]
"""Forces around the half of the rise, NaN where a recording has no sample, and last the height [N]."""

_BEFORE, _AFTER = 16, 32  # samples: a blow rises steeply, so no two fall on the same readings
_REST = 20  # samples before contact, from whose middle the height counts
_LAG = 3  # samples by which another foot of the impact may shift where its half is
_LEAST = 24  # samples that are compared
_HEIGHT_APART, _HEIGHT_NEAR = 0.01, 2.0  # by which the height of a copy may differ, cut off or rounded: a share, [N]
_STEPS = (10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)  # [N]; coarsest first
_WHOLE = 0.01  # of a step, as far as rounding of files goes
_ROUNDED = 0.55  # of the coarser step: by which a copy that was rounded differs
_SAME = 0.02  # of the step, where both have the same
_FINE = 1e-3  # [N]; where neither has a step


def edge_of(impact: Impact, recording: Recording) -> Edge:
    """The forces of an impact in a recording around the half of its rise, and its height."""
    first, last = np.searchsorted(recording.time, [impact.onset, impact.phase1_end])
    first = min(int(first), len(recording.force) - 1)
    force = _component(recording.force, first, int(last))
    top = first + int(np.argmax(force[first : last + 1]))
    below = np.flatnonzero(force[first : top + 1] < (force[first] + force[top]) / 2)
    half = first + int(below[-1]) if below.size else first
    places = np.arange(half - _BEFORE, half + _AFTER)
    inside = (places >= 0) & (places < force.size)
    edge = np.where(inside, force[np.clip(places, 0, force.size - 1)], np.nan)
    height = force[top] - np.median(force[max(0, first - _REST) : first + 1])
    return tuple(np.round([*edge, height], 6).tolist())


def _component(force: FloatArray, first: int, last: int) -> FloatArray:
    """A force as it is; of a vector, shape (n, 3), the component that changes most from `first` to `last`, upwards."""
    if force.ndim == 1:
        return force
    part = force[first : last + 1] - force[first]
    axis = int(np.argmax(np.abs(part).max(axis=0)))
    upwards = part[np.argmax(np.abs(part[:, axis])), axis] >= 0
    return force[:, axis] if upwards else -force[:, axis]


class Edges:
    """The edges of many impacts, and which of them are of the same impact as another one.

    Parameters
    ----------
    edges : iterable of Edge
    """

    def __init__(self, edges: Iterable[Edge] = ()) -> None:
        self._forces = np.empty((0, _BEFORE + _AFTER))
        self._steps = self._heights = np.empty(0)
        self.add(edges)

    def add(self, edges: Iterable[Edge]) -> None:
        """Take more edges, behind those that are there."""
        if not (new := [*edges]):
            return
        forces = np.array([edge[:-1] for edge in new])
        self._forces = np.concatenate([self._forces, forces])
        self._steps = np.concatenate([self._steps, [_step(each) for each in forces]])
        self._heights = np.concatenate([self._heights, [edge[-1] for edge in new]])

    def same_as(self, edge: Edge) -> Indices:
        """Numbers of those that are the same impact: as high, and alike to their rounding, up to an offset."""
        one, height = np.array(edge[:-1]), edge[-1]
        near = np.flatnonzero(np.abs(self._heights - height) <= _HEIGHT_APART * abs(height) + _HEIGHT_NEAR)
        others, steps, step = self._forces[near], self._steps[near], _step(one)
        rounded = np.maximum(_ROUNDED * np.maximum(step, steps), _FINE)
        tolerance = np.where(step == steps, np.maximum(_SAME * step, _FINE), rounded)
        same = np.zeros(near.size, dtype=np.bool_)
        for lag in range(-_LAG, _LAG + 1):
            apart = others[:, max(0, lag) : one.size + min(0, lag)] - one[max(0, -lag) : one.size - max(0, lag)]
            known = np.isfinite(apart).sum(axis=1) >= _LEAST
            low, high = np.nanmin(apart[known], axis=1), np.nanmax(apart[known], axis=1)
            same[known] |= high - low <= 2 * tolerance[known]
        return near[same]


def _step(edge: FloatArray) -> float:
    """The step in which forces are written [N]; 0 if there is none that they share."""
    known = edge[np.isfinite(edge)]
    from_first = known - known[0] if known.size else known
    for step in _STEPS:
        whole = from_first / step
        if np.all(np.abs(whole - np.round(whole)) < _WHOLE):
            return step
    return 0.0
