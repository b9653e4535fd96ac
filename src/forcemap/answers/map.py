"""A fitted collision-force map: what `fit` answers."""

from __future__ import annotations

import math
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BeforeValidator

from forcemap.answers.accuracy import AccuracyAnswer, PlaceFigures
from forcemap.answers.answer import AllSaid, Answer, Figure, Figures, Percent, PlannedState, SaidIfAny, if_any, of
from forcemap.answers.form_test import DriftAnswer, FormTestAnswer
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.state import States
from forcemap.comparisons.censoring_effect import censoring_effect
from forcemap.errors import BoundNotAvailable
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.bounds import ToleranceBound, above_bound, margins
from forcemap.maps.coefficients import coefficient_intervals
from forcemap.maps.force_map import ForceMap
from forcemap.maps.map_file import map_sha256
from forcemap.maps.saturation import saturation_doubt
from forcemap.speeds.basis import against_bound, doubts_of_fit


class OverSamples(Answer):
    """The paper's inference, over all samples as if they were independent."""

    standard_errors: Figures
    t_values: Figures
    p_values: Figures
    r_squared: Figure
    rmse_ln: Figure = of("rmse")


class Margins(Answer):
    """How far the tolerance bound lies above the prediction at the measured states [%]."""

    lowest: float
    highest: float


def _span(shares: tuple[float, float]) -> dict[str, float] | None:
    low, high = shares
    return None if math.isnan(low) else {"lowest": 100 * low, "highest": 100 * high}


Span = Annotated[Margins | None, BeforeValidator(_span)]


class BindingAnswer(Answer):
    """Whether a table is what was collected."""

    state: str
    reason: SaidIfAny


class CensoredStates(Answer):
    """States with censored impacts."""

    state_id: list[str] = of("name")
    distance_m: Figures = of("distance")
    height_m: Figures = of("height")
    speed_mps: Figures = of("speed")
    censored: list[int]
    at_least_N: Figures = of("at_least")


class CensoringAnswer(Answer):
    """The fit without censored impacts beside the fit with them."""

    coefficients: Figures = of("discarded", "coefficients")
    states: int
    samples: int = of("discarded", "fit", "samples")
    state_sd_percent: Percent = of("discarded", "fit", "state_sd")
    measured_range_percent: Percent = of("range_kept")
    bound_margin_percent: Span = of("margin_discarded")
    bound_margin_with_censored_percent: Span = of("margin_shared")
    at_censored: CensoredStates
    predicted_at_censored_N: Figures = of("predicted_discarded")
    predicted_with_censored_N: Figures = of("predicted_at_least")


class MeasuredState(PlannedState):
    """A state as it was measured; force null if every impact exceeded the device range."""

    force_N: Figure
    at_least_N: Figure
    predicted_N: float


class OtherMapAnswer(Answer):
    """The map of another quantity of the same impacts, in the unit of that quantity."""

    quantity: str
    unit: str
    states: int
    impacts_without: int
    censored_samples: int
    coefficients: Figures
    state_sd_percent: Percent
    bound_margin_percent: Span

    @classmethod
    def of_map(cls, other: ForceMap) -> Self:
        """The answer for a map among `others`."""
        fit = other.require_fit()
        return cls.from_result(
            other,
            quantity=other.quantity.value,
            unit=other.quantity.unit,
            states=len(fit.states),
            impacts_without=other.without,
            censored_samples=fit.censored_samples,
            state_sd_percent=fit.state_sd,
            bound_margin_percent=margins_of(other),
        )


class FitAnswer(PlaceFigures):
    """A map fitted to the train rows of a table, ln F = sum of coefficient times term; intervals of 95 %."""

    name: str
    source: str
    form: str = of("form", "name")
    terms: list[str] = of("form", "term_names")
    coefficients: Figures
    standard_errors: Figures = of("fit", "standard_errors")
    t_values: Figures
    p_values: Figures
    intervals_low: Figures
    intervals_high: Figures
    over_samples: OverSamples | None = of("fit", "over_samples")
    states: int
    states_left_out: int
    states_left_out_names: list[str]
    states_found: str = of("fit", "states_found")
    samples: int = of("fit", "samples")
    test_samples: int
    spring_stated: bool
    highest_limit_N: Figure
    range_stated: bool
    transient_refused: SaidIfAny
    censored_samples: int = of("fit", "censored_samples")
    censored_fit: bool = of("fit", "censored_fit")
    repeats: int
    fewest_repeats: int
    rmse_N: Figure = of("fit", "rmse_force")
    rmse_ln: Figure = of("fit", "between_states", "rmse")
    r_squared: Figure = of("fit", "between_states", "r_squared")
    state_sd_percent: Percent = of("fit", "state_sd")
    degrees_of_freedom: Figure = of("fit", "between_states", "degrees_of_freedom")
    condition_number: Figure = of("fit", "between_states", "condition_number")
    bound_margin_percent: Span
    states_above_bound: list[str]
    rises_with_speed: bool
    simulated: bool
    accuracy: AccuracyAnswer
    accuracies: list[AccuracyAnswer]
    form_test: FormTestAnswer
    drift: DriftAnswer | None = of("fit", "drift")
    doubts: AllSaid
    binding: BindingAnswer
    disagreeing_repeats: list[str]
    saturation_doubt: SaidIfAny
    contradictions: AllSaid
    lowest_measured: Figures = of("measured_range", "lowest")
    highest_measured: Figures = of("measured_range", "highest")
    measured_states: list[MeasuredState]
    map_sha256: str
    assumptions: AllSaid
    discard_fit: CensoringAnswer | None = if_any()
    other_quantities: list[OtherMapAnswer] | None = if_any()
    pressure_not_mapped: SaidIfAny = if_any()
    speed_error: float | None = if_any()

    @classmethod
    def of_fit(cls, dataset: ImpactDataset, force_map: ForceMap, accuracies: tuple[Accuracy, ...], **also: Any) -> Self:
        """The answer for a map fitted to impacts; the accuracy to trust first comes first."""
        fit = force_map.require_fit()
        (fewest, most), coefficients = fit.repeats, coefficient_intervals(force_map)
        if fit.censored_fit and not fit.transfer:  # its own states alone give no map to compare with
            effect = censoring_effect(dataset, form=force_map.form)
            also["discard_fit"] = CensoringAnswer.from_result(
                effect, states=len(effect.discarded.require_fit().states), at_censored=effect.states
            )
        return cls.from_result(
            force_map,
            states=len(fit.states),
            states_left_out=len(fit.left_out),
            states_left_out_names=fit.left_out.name,
            test_samples=len(dataset.tested),
            spring_stated=not math.isnan(force_map.conditions.device.stiffness),
            highest_limit_N=force_map.highest_force - force_map.conditions.device.error_or_default,
            range_stated=not math.isnan(force_map.device_range),
            transient_refused=force_map.phase_two.transient_refusal(math.inf, 0.0),
            repeats=most,
            fewest_repeats=fewest,
            bound_margin_percent=margins_of(force_map),
            states_above_bound=names_above_bound(force_map, fit.states) or [],
            t_values=[each.t_value for each in coefficients],
            p_values=[each.p_value for each in coefficients],
            intervals_low=[each.low for each in coefficients],
            intervals_high=[each.high for each in coefficients],
            accuracy=accuracies[0],
            accuracies=accuracies,
            disagreeing_repeats=dataset.disagreeing_repeats,
            saturation_doubt=saturation_doubt(dataset.peak_force, dataset.state, censored=int(dataset.censored.sum())),
            contradictions=dataset.contradictions,
            doubts=(*against_bound(force_map, _bound_of(force_map)), *doubts_of_fit(force_map)),
            measured_states=_states(force_map),
            map_sha256=map_sha256(force_map),
            assumptions=[*force_map.conditions.findings, force_map.phase_two.finding],
            other_quantities=[OtherMapAnswer.of_map(other) for other in force_map.others] or None,
            pressure_not_mapped=force_map.unmapped,
            speed_error=None if math.isnan(error := force_map.conditions.speed_error) else error,
            **also,
        )


def names_above_bound(force_map: ForceMap, states: States) -> list[str] | None:
    """Names of the states above the tolerance bound; None where a map has no such bound."""
    try:
        above = above_bound(force_map, _bound_of(force_map), states)
    except BoundNotAvailable:
        return None
    return [states.name[i] for i in np.flatnonzero(above)]


def _bound_of(force_map: ForceMap) -> ToleranceBound:
    """The usual bound, with the stated error of the device."""
    return ToleranceBound(device_error=force_map.conditions.device.error_or_default)


def margins_of(force_map: ForceMap) -> tuple[float, float]:
    """Smallest and largest share by which the tolerance bound lies above the prediction at the states; NaN if none."""
    try:
        shares = margins(_bound_of(force_map), force_map)
    except BoundNotAvailable:
        return math.nan, math.nan
    return float(shares.min()), float(shares.max())


def _states(force_map: ForceMap) -> list[MeasuredState]:
    fit = force_map.require_fit()
    rows: list[MeasuredState] = []
    for role, states in (
        ("train", fit.states),
        ("left out", fit.left_out),
        ("test", force_map.tested),
        ("slower", force_map.slower),
    ):
        d, h, v = states.coordinates.T
        forces = {"force_N": states.force, "at_least_N": states.at_least, "predicted_N": force_map.predict(d, h, v)}
        named: dict[str, Any] = {"state_id": states.name, "role": [role] * len(states)}
        rows += MeasuredState.of_columns(**named, distance_m=d, height_m=h, speed_mps=v, **forces)
    return rows
