"""What censored impacts change in a map: fitted as "at least this much", and discarded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcemap.campaigns.dataset import ImpactDataset, States
from forcemap.errors import InputError
from forcemap.maps.fit import CensoredImpacts, fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_3D, Form

FloatArray = NDArray[np.float64]


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


def censoring_effect(dataset: ImpactDataset, *, form: Form = CFM_3D) -> CensoringEffect:
    """Fit a map with censored impacts and without them.

    Parameters
    ----------
    dataset : ImpactDataset
        The impacts; those with role train are fitted.
    form : Form
        The terms of ln F.

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
