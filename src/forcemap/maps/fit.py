"""Fitting a collision-force map to impacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from forcemap.campaigns.dataset import ImpactDataset, States, StateTolerance
from forcemap.errors import FitError, RankDeficient
from forcemap.maps.force_map import Fit, ForceMap
from forcemap.maps.forms import CFM_3D, Form
from forcemap.maps.measured_range import MeasuredRange
from forcemap.maps.regression import least_squares


def fit_force_map(dataset: ImpactDataset, *, form: Form = CFM_3D) -> ForceMap:
    """Fit a collision-force map to the impacts with role train.

    Least squares on the state means of ln F, every state with equal weight (paper, section V-A): the same
    coefficients as on all impacts when repeats are balanced. A partly censored state enters with the mean of its
    uncensored impacts; a wholly censored one is left out, counted and listed in `fit.left_out`.

    Parameters
    ----------
    dataset : ImpactDataset
        The impacts. All of them, test and censored ones too, tell what is known of Phase II.
    form : Form
        The terms of ln F.

    Returns
    -------
    ForceMap

    Raises
    ------
    FitError
        No impact has role train.
    TooFewStates
        Fewer uncensored states than coefficients.
    RankDeficient
        The states do not tell the terms apart, or only by differences within the tolerance of repeats.
    """
    train = dataset.train
    if not len(train):
        raise FitError(
            "found no impact with role train, expected some; give role train to the impacts to fit",
            file=dataset.source or None,
            column="role" if dataset.source else None,
        )
    states = train.states.uncensored
    measured = train.select(~train.censored)
    design = form.design(states.distance, states.height, states.speed)
    samples = form.design(measured.distance, measured.height, measured.speed)
    between_states = least_squares(design, states.log_force)
    _refuse_noise(form, states, dataset.tolerance)
    fit = Fit(
        states=states,
        test=dataset.test.states,
        left_out=train.states.select(train.states.impacts == 0),
        between_states=between_states,
        over_samples=least_squares(samples, np.log(measured.peak_force)),
        states_found=dataset.states_found,
        table=dataset.source,
        table_sha256=dataset.sha256,
    )
    return ForceMap(
        name=dataset.source or "fitted",
        form=form,
        coefficients=between_states.coefficients,
        measured_range=MeasuredRange(states.coordinates),
        fit=fit,
        phase_two=dataset.phase_two,
        conditions=replace(dataset.conditions, simulated=dataset.simulated),
        device_range=dataset.device_range,
        source=f"fitted to {dataset.source or 'arrays'}",
    )


def _refuse_noise(form: Form, states: States, tolerance: StateTolerance) -> None:
    """A coordinate that varies no more than repeats of one state may is not varied: it must not carry a term."""
    coordinates = states.coordinates
    spread = np.ptp(coordinates, axis=0)
    flat = spread <= (tolerance.place, tolerance.place, tolerance.speed)
    if not flat.any():
        return
    flattened = np.where(flat, coordinates.mean(axis=0), coordinates)
    try:
        least_squares(form.design(*flattened.T), states.log_force)
    except RankDeficient as error:
        names = ("distances", "heights", "speeds")
        same = " and ".join(f"all {names[i]} lie within {spread[i]:.3g}" for i in np.flatnonzero(flat))
        raise RankDeficient(f"{same}, no more than repeats of one state may: {error.message}") from None
