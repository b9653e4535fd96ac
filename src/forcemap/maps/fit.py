"""Fitting a collision-force map to impacts."""

from __future__ import annotations

import itertools
from dataclasses import replace
from enum import StrEnum
from functools import lru_cache

import numpy as np

from forcemap.campaigns.dataset import (
    LEAST,
    AtPoint,
    ImpactDataset,
    PhaseTwo,
    Quantity,
    States,
    StateTolerance,
    phase_two_of,
)
from forcemap.direction import WIDEST_ANGLE, same_direction
from forcemap.errors import FitError, RankDeficient
from forcemap.files import sha256
from forcemap.findings import Finding, FindingKind
from forcemap.maps.censored import censored_regression, state_data
from forcemap.maps.force_map import Fit, ForceMap
from forcemap.maps.forms import Form, form_of
from forcemap.maps.measured_range import MeasuredRange
from forcemap.maps.places import PlaceEffect, place_effect, place_regression
from forcemap.maps.regression import Regression, least_squares

_AREAS = (0.02, 64.0)
"""Peak force over peak pressure [cm^2], the mean of a campaign. Choices: a needle's tip is no contact that is
measured, and no device has a larger plate; MPa or bar, or kPa, taken for N/cm^2 put most contacts outside."""


class CensoredImpacts(StrEnum):
    """How impacts that reached the device range enter the fit."""

    AT_LEAST = "at-least"
    DISCARD = "discard"


def fit_force_map(
    dataset: ImpactDataset, *, form: Form | None = None, impacts: CensoredImpacts = CensoredImpacts.AT_LEAST
) -> ForceMap:
    """Fit a collision-force map to the impacts with role train.

    Without censored impacts: least squares on the state means of ln F (paper, section V-A), generalised by the effects
    that the states of a place share (`place_effect`); the same coefficients as the paper's where every place is
    measured at the same speeds as often. With some: maximum likelihood with state effects and repeat noise, in which a
    censored impact says "at least this much" (`censored_regression`); censored states then belong to the map's states
    and measured range.

    The paper discards impacts above the device range: least squares on the means of the uncensored impacts, wholly
    censored states left out, counted and listed in `fit.left_out`. So does this fit where there are no more uncensored
    states than coefficients, because they then do not show how far states scatter.

    Other quantities of the same impacts are fitted alike, each to the impacts that have it (`ImpactDataset.of`), and
    stand in `others`: pressures wherever some were measured, the clamping force where impacts clamp, or may, and either
    all of them have one or some exceed their peak. Pressures that bear no map say why in `unmapped`.

    Parameters
    ----------
    dataset : ImpactDataset
        The impacts. Phase II is known from all of them, test and censored ones included.
    form : Form, optional
        The terms of ln F; if not given the form that the conditions state, else CFM_3D.
    impacts : CensoredImpacts
        How censored impacts enter the fit.

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
    form = form_of(dataset.conditions, form)
    if not isinstance(form, Form):
        raise FitError(
            f"found {getattr(form, 'name', form)}, which is compared (forcemap evaluate --forms), not fitted"
        )
    content = b"".join(array.tobytes() for array in vars(dataset).values() if isinstance(array, np.ndarray))
    return _fitted_once(dataset, form, impacts, sha256(content))


@lru_cache(maxsize=2)  # a campaign's map is asked for by all that rests on it, its 2D map between
def _fitted_once(dataset: ImpactDataset, form: Form, impacts: CensoredImpacts, _content: str) -> ForceMap:
    """The map of a dataset as its arrays are now: they can be written to."""
    force_map = _fitted(dataset, form, impacts)
    for array in vars(force_map.require_fit().between_states).values():
        if isinstance(array, np.ndarray):
            array.setflags(write=False)  # whoever asks next has the same map
    return force_map if dataset.quantity is not Quantity.FORCE else _with_others(force_map, dataset, form, impacts)


def _with_others(force_map: ForceMap, dataset: ImpactDataset, form: Form, impacts: CensoredImpacts) -> ForceMap:
    """The map of the force with those of the other quantities that the impacts have."""
    others, unmapped = [], None
    for quantity in (Quantity.PRESSURE, Quantity.CLAMPING_FORCE):
        if not _wanted(dataset, quantity):
            continue
        try:
            _require_area(dataset, quantity)
            others.append(_fitted(dataset.of(quantity), form, impacts))
        except FitError as error:
            if quantity is Quantity.PRESSURE:  # without a clamping map the gate of Phase II decides
                why = {
                    "words": error.problem,
                    "impacts": dataset.pressures,
                    "without": len(dataset) - dataset.pressures,
                }
                unmapped = Finding.of(FindingKind.PRESSURE_NOT_MAPPED, **why)
    return replace(force_map, others=tuple(others), unmapped=unmapped)


def _require_area(dataset: ImpactDataset, quantity: Quantity) -> None:
    """Refuse pressures that cannot be in N/cm^2: the forces over them are no area of a contact."""
    if quantity is not Quantity.PRESSURE:
        return
    known = ~dataset.censored & ~dataset.pressure_censored & (dataset.peak_pressure > 0)
    area = (
        float(np.exp(np.mean(np.log(dataset.peak_force[known] / dataset.peak_pressure[known])))) if known.any() else 1.0
    )
    if not _AREAS[0] <= area <= _AREAS[1]:
        expected = f"expected {_AREAS[0]:g} to {_AREAS[1]:g} cm^2; are they in another unit?"
        raise FitError(f"forces over pressures are {area:.3g} cm^2 in the mean, {expected}")


def _wanted(dataset: ImpactDataset, quantity: Quantity) -> bool:
    """Whether a map of another quantity is to be had from the impacts.

    Of a clamping force none where impacts exceed their peaks of which not even the force is known.
    """
    if quantity is Quantity.PRESSURE:
        return dataset.pressures > 0
    phase_two, above = dataset.phase_two, int(np.sum(dataset.phase2_force > dataset.peak_force))
    unknown = phase_two.above_peak > above and np.isnan(phase_two.unused_force)
    if not phase_two.barred or unknown:
        return False
    held = dataset.of(quantity)
    return len(held.train) > 0 and bool(above or not held.without)


def _fitted(dataset: ImpactDataset, form: Form, impacts: CensoredImpacts) -> ForceMap:
    """The map of the dataset's quantity alone; arguments and errors as in `fit_force_map`."""
    train = dataset.train
    if not len(train):
        slowest = dataset.conditions.slowest
        slower = f", none slower than {slowest:g} m/s (map.slowest_mps in campaign.toml)" * bool(slowest > 0)
        raise FitError(
            f"found no impact with role train{slower}, expected some; give role train to the impacts to fit",
            file=dataset.source or None,
            column="role" if dataset.source else None,
        )
    measured = train.select(~train.censored)
    if not len(measured) and dataset.quantity is Quantity.FORCE:
        stated = "" if np.isnan(limit := train.conditions.device.range) else f" of {limit:g} N"
        above = f"found all {len(train)} impacts above the device range{stated}, and no force"
        raise FitError(f"{above}; is device.range_N in campaign.toml right?", file=dataset.source or None)
    states, left_out = train.states.uncensored, train.states.select(train.states.impacts == 0)
    likelihood = impacts is CensoredImpacts.AT_LEAST and bool(train.censored.any()) and len(states) > len(form.terms)
    if likelihood:
        states, left_out = train.states, left_out.select(np.zeros(len(left_out), dtype=np.bool_))
    _refuse_bound_together(form, states, dataset.tolerance)
    effect = effect_of_places(form, states)
    design = form.design(*states.coordinates.T)
    data = state_data(design, states, repeat_variance(train), effect.correlation)
    if likelihood:
        between_states: Regression = censored_regression(data)
    else:
        between_states = place_regression(data.design, data.mean, data.place, data.correlation)
    _refuse_noise(form, train.states.uncensored, dataset.tolerance)
    samples = form.design(measured.distance, measured.height, measured.speed)
    measured_range = MeasuredRange(states.coordinates)
    fit = Fit(
        states=states,
        test=dataset.again.test.states,
        at_points=states_at_points(dataset, measured_range),
        disagreeing=tuple(dataset.disagreeing_repeats),
        other_sites=dataset.other_sites,
        slower=dataset.slower_train.states,
        left_out=left_out,
        between_states=between_states,
        place_effect=effect,
        over_samples=least_squares(samples, np.log(measured.peak_force)),
        states_found=dataset.states_found,
        table=dataset.source,
        table_sha256=dataset.sha256,
    )
    return ForceMap(
        name=dataset.source or "fitted",
        form=form,
        coefficients=between_states.coefficients,
        measured_range=measured_range,
        fit=fit,
        phase_two=phase_two_with_points(dataset),
        conditions=replace(dataset.conditions, simulated=dataset.simulated),
        device_range=dataset.device_range,
        binding=dataset.binding,
        quantity=dataset.quantity,
        without=dataset.without,
        source=f"fitted to {dataset.source or 'arrays'}",
    )


def states_at_points(dataset: ImpactDataset, measured_range: MeasuredRange) -> States:
    """The impacts at contact points alone that were made as far off the campaign's direction as its speeds hold, with
    what they show of the dataset's quantity.

    One that was made in a zone is at many places of it, as far as it lies in the box around the measured range.
    """
    made = [each for each in _along(dataset) if each.of(dataset.quantity) >= LEAST]
    rows = [(each, place) for each in made for place in each.places(measured_range.points[:, :2])]
    coordinates, shown = np.array([(*place, each.speed) for each, place in rows]), [each for each, _ in rows]
    values = np.array([each.of(dataset.quantity) for each in shown])
    return States.single([each.recording for each in shown], coordinates, values)


def phase_two_with_points(dataset: ImpactDataset) -> PhaseTwo:
    """What is known of Phase II along the campaign's direction, at contact points alone, too."""
    made = _along(dataset)
    return dataset.phase_two.and_(phase_two_of(made)) if made else dataset.phase_two


def _along(dataset: ImpactDataset) -> list[AtPoint]:
    own = dataset.conditions.direction
    return [each for each in dataset.at_points if same_direction(each.direction, own, within=WIDEST_ANGLE)]


def effect_of_places(form: Form, states: States) -> PlaceEffect:
    """Correlation of the states of a place, from those with an uncensored repeat."""
    known = states.uncensored
    return place_effect(form.design(*known.coordinates.T), known.log_force, known.place)


def repeat_variance(train: ImpactDataset) -> float:
    """Pooled variance of ln F between repeats of the states with an uncensored one; 0 if none is repeated.

    Censored repeats count with the force they reached at least: a state that was far exceeded by one of its repeats
    is a sign of scatter, not of none.
    """
    known = train.select(np.isin(train.state, np.unique(train.state[~train.censored])))
    _, index, count = np.unique(known.state, return_inverse=True, return_counts=True)
    freedom = known.peak_force.size - count.size
    if freedom == 0:
        return 0.0
    log_force = np.log(known.peak_force)
    mean = np.bincount(index, weights=log_force) / count
    return float(np.sum((log_force - mean[index]) ** 2) / freedom)


def _refuse_bound_together(form: Form, states: States, tolerance: StateTolerance) -> None:
    """Refuse states that do not determine a form where a coordinate of theirs follows from another, and say which."""
    levels = np.round(states.coordinates / tolerance.scale)
    counts = [len(np.unique(of_one)) for of_one in levels.T]
    pairs = [
        (one, other)
        for one, other in itertools.permutations(range(3), 2)
        if 1 < counts[other] <= counts[one] < len(states)
        and len(np.unique(levels[:, [one, other]], axis=0)) == counts[one]
    ]
    if not pairs:
        return
    try:
        least_squares(form.design(*states.coordinates.T), states.log_force)
    except RankDeficient as error:
        names = ("distance", "height", "speed")
        together = " and ".join(f"each {names[one]} at one {names[other]} alone" for one, other in pairs)
        (one, other), *_ = pairs
        raise RankDeficient(
            f"the states were measured {together}: {error.problem}",
            remedy=f"measure {names[one]}s at several {names[other]}s",
        ) from None


def _refuse_noise(form: Form, states: States, tolerance: StateTolerance) -> None:
    """Refuse a form with a term that rests on a coordinate which varies no more than repeats of one state may."""
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
        raise RankDeficient(
            f"{same}, no more than repeats of one state may: {error.problem}", remedy=error.remedy
        ) from None
