"""Whether two maps were fitted to the same impacts, however the files of these were saved or named."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from forcemap.campaigns.dataset import States

_SAME = 3e-4  # of ln F, by which forces differ that are rounded to 0.1 N at 200 N
_LEAST, _SHARE = 3, 0.5
"""States, and share of them, that are never alike by chance: nor in opposite directions on a robot without scatter."""


_ROUNDED, _PLACE = 0.55, 0.001  # [N], by which forces differ that are rounded to 1 N; [m], [m/s], by which places do
_LEAST_ROUNDED, _SHARE_ROUNDED = 18, 0.75
"""The same of states at the same places with forces that are alike to 1 N."""


def states_alike(one: Iterable[States], other: Iterable[States]) -> list[str]:
    """Names of states of one map whose highest force is that of a state of another; none if chance explains as many.

    The highest of the repeats, for one of them may be missing; half of the states of the map that has fewer.
    """
    groups, others = list(one), list(other)
    names = [name for group in groups for name in group.name]
    here, there = (np.concatenate([group.highest for group in each]) for each in (groups, others))
    alike = np.abs(np.log(here)[:, None] - np.log(there)) <= _SAME  # NaN of a state that is censored
    fewer = min(here.size, there.size)
    if alike.any(axis=1).sum() < max(_LEAST, _SHARE * fewer):
        places, more = (np.concatenate([group.coordinates for group in each]) for each in (groups, others))
        there_too = (np.abs(places[:, None] - more) <= _PLACE).all(axis=2)
        alike = there_too & (np.abs(here[:, None] - there) <= _ROUNDED)
        if alike.any(axis=1).sum() < max(_LEAST_ROUNDED, _SHARE_ROUNDED * fewer):
            return []
    return [names[i] for i in np.flatnonzero(alike.any(axis=1))]
