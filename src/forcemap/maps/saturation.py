"""Signs that the device saturated although no impact is marked censored: many share exactly the largest force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from forcemap.findings import Finding, FindingKind

_LEAST_SHARING = 3  # impacts; a choice: two equal readings happen by rounding
_LEAST_STATES = 2  # repeats of one state may agree by rounding


def saturation_doubt(force: ArrayLike, state: Sequence[str] | ArrayLike, *, censored: int) -> Finding | None:
    """Ask whether the device was saturated where nothing is marked censored.

    It is suspected if at least three impacts, of at least two states, share exactly the largest force.

    Parameters
    ----------
    force : array
        Peak force of every impact, or the largest of every state, shape (n,) [N]; NaN where there is none.
    state : array of str
        Name of its state, shape (n,).
    censored : int
        Number of impacts marked censored; if there is any, saturation was noticed and no doubt is left.

    Returns
    -------
    Finding or None
        The suspicion; None if there is none.

    Examples
    --------
    >>> from forcemap.maps.saturation import saturation_doubt
    >>> saturation_doubt([450.0, 450.0, 450.0, 310.0], ["a", "a", "b", "c"], censored=0).figures
    (('impacts', 3), ('states', 2), ('force_N', 450.0))
    """
    values, names = np.asarray(force, dtype=np.float64), np.asarray(state)
    if censored or np.isnan(values).all():
        return None
    top = np.nanmax(values)
    sharing = values == top
    impacts, states = int(sharing.sum()), np.unique(names[sharing]).size
    if impacts < _LEAST_SHARING or states < _LEAST_STATES:
        return None
    return Finding.of(FindingKind.SATURATION_DOUBT, impacts=impacts, states=states, force_N=float(top))
