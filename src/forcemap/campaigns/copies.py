"""Whether two impacts are one and the same, however their files are named, cut off, written or offset."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.impacts.impact import Impact
from forcemap.recordings.recording import Recording

Edge = tuple[float, ...]
"""Forces around the halves of rise and fall, NaN where a recording has no sample, and last the height [N]."""

_BEFORE, _AFTER = 16, 32  # samples: a blow rises steeply, so no two fall on the same readings
_REST = 20  # samples before contact, from whose middle the height counts
_LAG = 3  # samples by which another foot of the impact may shift where its half is
_LEAST = 24  # samples that are compared around a half; with fewer around that of the fall the rise decides
_HEIGHT_APART, _HEIGHT_NEAR = 0.01, 2.0  # by which the height of a copy may differ, cut off or rounded: a share, [N]
_STEPS = (10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)  # [N]; coarsest first
_WHOLE = 0.01  # of a step, as far as rounding of files goes
_ROUNDED = 0.55  # of the coarser step: by which a copy that was rounded differs
_SAME = 0.02  # of the step, where both have the same
_FINE = 1e-3  # [N]; where neither has a step


def as_high(one: float, others: FloatArray) -> Mask:
    """Which heights, shape (n,) [N], may be that of a copy, shape (n,)."""
    return np.asarray(np.abs(others - one) <= _HEIGHT_APART * abs(one) + _HEIGHT_NEAR)


def edge_of(impact: Impact, recording: Recording) -> Edge:
    """The forces of an impact in a recording around the halves of its rise and of its fall, and its height."""
    first, last = np.searchsorted(recording.time, [impact.onset, impact.phase1_end])
    first = min(int(first), len(recording.force) - 1)
    force = _component(recording.force, first, int(last))
    top = first + int(np.argmax(force[first : last + 1]))
    below = force < (force[first] + force[top]) / 2
    before, after = np.flatnonzero(below[first : top + 1]), np.flatnonzero(below[top : last + 1])
    rise = first + int(before[-1]) if before.size else first
    fall = top + int(after[0]) if after.size else int(last)
    places = np.concatenate([half + np.arange(-_BEFORE, _AFTER) for half in (rise, fall)])
    inside = (places >= 0) & (places < force.size)
    around = np.where(inside, force[np.clip(places, 0, force.size - 1)], np.nan)
    height = force[top] - np.median(force[max(0, first - _REST) : first + 1])
    return tuple(np.round([*around, height], 6).tolist())


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
        self._forces = np.empty((0, 2 * (_BEFORE + _AFTER)))
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
        one = np.array(edge[:-1])
        near = np.flatnonzero(as_high(edge[-1], self._heights))
        steps, step = self._steps[near], _step(one)
        rounded = np.maximum(_ROUNDED * np.maximum(step, steps), _FINE)
        tolerance = np.where(step == steps, np.maximum(_SAME * step, _FINE), rounded)
        rises, falls = np.split(self._forces[near], 2, axis=1)
        rise, fall = np.split(one, 2)
        cut = np.minimum(np.isfinite(falls).sum(axis=1), np.isfinite(fall).sum()) < _LEAST + _LAG
        return np.asarray(near[_alike(rise, rises, tolerance) & (cut | _alike(fall, falls, tolerance))])


def _alike(one: FloatArray, others: FloatArray, tolerance: FloatArray) -> Mask:
    """Which others, shape (n, samples), are as one is within a tolerance, shape (n,), some samples to either side."""
    alike = np.zeros(len(others), dtype=np.bool_)
    for lag in range(-_LAG, _LAG + 1):
        apart = others[:, max(0, lag) : one.size + min(0, lag)] - one[max(0, -lag) : one.size - max(0, lag)]
        known = np.isfinite(apart).sum(axis=1) >= _LEAST
        low, high = np.nanmin(apart[known], axis=1), np.nanmax(apart[known], axis=1)
        alike[known] |= high - low <= 2 * tolerance[known]
    return alike


def _step(edge: FloatArray) -> float:
    """The step in which forces are written [N]; 0 if there is none that they share."""
    known = edge[np.isfinite(edge)]
    from_first = known - known[0] if known.size else known
    for step in _STEPS:
        whole = from_first / step
        if np.all(np.abs(whole - np.round(whole)) < _WHOLE):
            return step
    return 0.0
