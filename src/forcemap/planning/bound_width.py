"""How wide a tolerance bound is to be expected, before anything is measured."""

from __future__ import annotations

import math

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import RankDeficient
from forcemap.maps.forms import Form
from forcemap.planning.optimal_exchange import whitening

STATE_SD = 0.025
"""State effect that widths are stated for where none was measured: the paper's robots show 2.1 to 3.3 %."""


def expected_width(states: FloatArray, *, form: Form, region: FloatArray, state_sd: float = STATE_SD) -> float:
    """Mean over a region, shape (k, 3), of the tolerance bound above the prediction, as a share of it.

    For a campaign of the states, shape (n, 3); infinite where they do not determine the form and its scatter.
    """
    freedom = len(states) - len(form.terms)
    if freedom < 1:
        return math.inf
    try:
        scale = whitening(form.design(*states.T))
    except RankDeficient:
        return math.inf
    x = form.design(*region.T) @ scale
    return mean_width(np.square(x).sum(axis=1) / len(states), np.ones(len(x)), freedom, state_sd)


def tolerance_factor(
    leverage: FloatArray, freedom: float, *, confidence: float = 0.95, content: float = 0.95
) -> FloatArray:
    """sqrt(l) t' of the tolerance bound, shape (n,), read off a coarse table; for planning only."""
    from scipy.special import nctdtrit, ndtri

    root = np.sqrt(leverage)
    nodes = np.geomspace(max(float(root.min()), 1e-3), max(float(root.max()), 2e-3), 60)
    factors = nodes * nctdtrit(freedom, ndtri(content) / nodes, confidence)
    known = ~np.isnan(factors)
    return np.asarray(np.interp(root, nodes[known], factors[known]))


def mean_width(leverage: FloatArray, weight: FloatArray, freedom: float, state_sd: float) -> float:
    """Weighted mean of the width at leverages, shape (k,)."""
    share = np.expm1(np.minimum(state_sd * tolerance_factor(leverage, freedom), 50.0))
    return float(np.average(share, weights=weight))
