"""What censored impacts change in a map: fitted as "at least this much", and discarded."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import ImpactDataset, States
from forcemap.errors import BoundNotAvailable, InputError
from forcemap.maps.bounds import ToleranceBound
from forcemap.maps.fit import CensoredImpacts, fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import Form

# Extent [m, m/s] below which states count as lying in a plane, on a line or at a point: a hundredth of a millimetre,
# far above rounding and far below what a place can be set to.
_FLAT_EXTENT = 1e-5


@dataclass(frozen=True, eq=False)
class CensoringEffect:
    """What censored impacts change in a map.

    Parameters
    ----------
    at_least : ForceMap
        Fitted with censored impacts as "at least this much".
    discarded : ForceMap
        Fitted without them, as the paper does.
    states : States
        The states with role train and a censored impact.
    """

    at_least: ForceMap
    discarded: ForceMap
    states: States

    @property
    def predicted_at_least(self) -> FloatArray:
        """Force at the censored states with their impacts in the fit [N], shape (m,)."""
        return np.asarray(self.at_least.predict(*self.states.coordinates.T))

    @property
    def predicted_discarded(self) -> FloatArray:
        """Force at the censored states without them in the fit [N], shape (m,)."""
        return np.asarray(self.discarded.predict(*self.states.coordinates.T))

    @property
    def added(self) -> States:
        """The states that only the fit with censored impacts has, since all their impacts are censored."""
        return self.states.select(self.states.impacts == 0)

    @property
    def range_kept(self) -> float:
        """Volume of the measured range without the censored impacts over that with them.

        The ratio of areas or lengths if the states lie in a plane or on a line; 1 if there is only one.
        """
        all_states, uncensored_only = (
            force_map.require_fit().states.coordinates for force_map in (self.at_least, self.discarded)
        )
        centre = all_states.mean(axis=0)
        _, _, axes = np.linalg.svd(all_states - centre, full_matrices=False)
        thick = axes[np.ptp((all_states - centre) @ axes.T, axis=0) > _FLAT_EXTENT]
        if not len(thick):
            return 1.0
        return _volume((uncensored_only - centre) @ thick.T) / _volume((all_states - centre) @ thick.T)

    @property
    def margin_at_least(self) -> tuple[float, float]:
        """Smallest and largest share by which the tolerance bound lies above the prediction, at all fitted states.

        NaN if the fit carries no such bound; so are the next two.
        """
        return _margins(self.at_least, self.at_least.require_fit().states)

    @property
    def margin_shared(self) -> tuple[float, float]:
        """The same at the states that both fits have."""
        return _margins(self.at_least, self.discarded.require_fit().states)

    @property
    def margin_discarded(self) -> tuple[float, float]:
        """The same at those states, without the censored impacts in the fit."""
        return _margins(self.discarded, self.discarded.require_fit().states)


def censoring_effect(dataset: ImpactDataset, *, form: Form | None = None) -> CensoringEffect:
    """Fit a map with censored impacts and without them.

    Parameters
    ----------
    dataset : ImpactDataset
        The impacts; those with role train are fitted.
    form : Form, optional
        The terms of ln F; as in `fit_force_map` if not given.

    Returns
    -------
    CensoringEffect

    Raises
    ------
    InputError
        No impact with role train is censored.
    FitError
        As `fit_force_map`.
    """
    states = dataset.train.states
    if not states.censored.any():
        raise InputError("found no censored impact with role train, expected some", file=dataset.source or None)
    return CensoringEffect(
        at_least=fit_force_map(dataset, form=form),
        discarded=fit_force_map(dataset, form=form, impacts=CensoredImpacts.DISCARD),
        states=states.select(states.censored > 0),
    )


def _margins(force_map: ForceMap, states: States) -> tuple[float, float]:
    bound = ToleranceBound(device_error=force_map.conditions.device.error_or_default)
    coordinates = states.coordinates.T
    try:
        share = bound.upper(force_map, *coordinates) / force_map.predict(*coordinates) - 1
    except BoundNotAvailable:
        return math.nan, math.nan
    return float(share.min()), float(share.max())


def _volume(points: FloatArray) -> float:
    """Volume of the convex hull of points, shape (n, rank); 0 where they do not fill the space."""
    from scipy.spatial import ConvexHull

    offsets = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(offsets, full_matrices=False)
    extent = np.ptp(offsets @ axes.T, axis=0)
    if extent.size < points.shape[1] or np.any(extent <= _FLAT_EXTENT):
        return 0.0
    return float(extent[0]) if extent.size == 1 else float(ConvexHull(points).volume)
