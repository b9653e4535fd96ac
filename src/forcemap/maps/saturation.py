"""A device that saturated with nothing marked censored: many impacts share exactly the largest force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

_LEAST_SHARING = 3
_LEAST_STATES = 2  # repeats of one state may agree by rounding


def saturation_doubt(force: ArrayLike, state: Sequence[str] | ArrayLike, *, censored: int) -> str:
    """Ask whether the device was saturated where nothing is marked censored.

    It may have been if at least three impacts, of at least two states, share exactly the largest force.

    Parameters
    ----------
    force : array
        Peak force of every impact, or the largest of every state, shape (n,) [N]; NaN is none.
    state : array of str
        Name of its state, shape (n,).
    censored : int
        How many impacts are marked censored; with any the device range is known, and no doubt is left.

    Returns
    -------
    str
        The doubt and what to do, in words; empty without one.

    Examples
    --------
    >>> from forcemap import saturation_doubt
    >>> saturation_doubt([450.0, 450.0, 450.0, 310.0], ["a", "a", "b", "c"], censored=0)
    '3 impacts of 2 states share the largest force, 450 N: was the device saturated? mark them censored'
    """
    values, names = np.asarray(force, dtype=np.float64), np.asarray(state)
    if censored or np.isnan(values).all():
        return ""
    top = np.nanmax(values)
    sharing = values == top
    impacts, states = int(sharing.sum()), np.unique(names[sharing]).size
    if impacts < _LEAST_SHARING or states < _LEAST_STATES:
        return ""
    who = f"{states} states" if impacts == states else f"{impacts} impacts of {states} states"
    return f"{who} share the largest force, {top:g} N: was the device saturated? mark them censored"
