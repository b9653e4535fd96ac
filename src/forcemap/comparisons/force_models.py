"""Force models on the same states: the measured map, the 2D map and the standard's contact model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import ImpactDataset, States
from forcemap.errors import BoundNotAvailable, FitError, InputError
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.limits.pfl import pfl_contact_force, pfl_speed_limit
from forcemap.maps.accuracy import Accuracy, left_out_predictions
from forcemap.maps.bounds import Bound, ToleranceBound
from forcemap.maps.fit import fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_2D, CFM_3D, Form
from forcemap.speeds.safe_speed import SpeedOutcome, safe_speed


@dataclass(frozen=True)
class StateError:
    """Error of a prediction at one state.

    Parameters
    ----------
    state : str
        Name of the state.
    distance, height, speed : float
        Its coordinates [m], [m], [m/s].
    measured, predicted : float
        Forces [N].
    percent : float
        Predicted minus measured in percent of measured; negative is underestimation.
    """

    state: str
    distance: float
    height: float
    speed: float
    measured: float
    predicted: float
    percent: float


@dataclass(frozen=True)
class ModelComparison:
    """One force model against the measured states.

    Parameters
    ----------
    model : str
        Name of the model.
    accuracy : Accuracy
        Its errors.
    most_underestimated, most_overestimated : StateError or None
        The extremes; None where no state is on that side.
    note : str
        What to know of the model.
    """

    model: str
    accuracy: Accuracy
    most_underestimated: StateError | None
    most_overestimated: StateError | None
    note: str

    @property
    def underestimated_share(self) -> float:
        """Share of states whose force the model underestimates."""
        return self.accuracy.underestimated / self.accuracy.states

    @property
    def overestimated_share(self) -> float:
        """Share of states whose force the model overestimates."""
        return self.accuracy.overestimated / self.accuracy.states


@dataclass(frozen=True)
class AllowedSpeed:
    """What a model allows at the measured places.

    Parameters
    ----------
    model : str
        Name of the model.
    limit : float
        Force limit [N].
    limit_source : str
        Where the limit comes from.
    places, confirmed : int
        Number of measured places, and of those with a confirmed speed.
    lowest, median, highest : float
        Of the confirmed speeds [m/s]; NaN if there is none.
    note : str
        What to know of it.
    """

    model: str
    limit: float
    limit_source: str
    places: int
    confirmed: int
    lowest: float
    median: float
    highest: float
    note: str


@dataclass(frozen=True)
class WorkspaceVariation:
    """How measured forces vary over the workspace at one speed.

    Parameters
    ----------
    speed : float
        The speed [m/s].
    states : int
        States measured at it.
    lowest, highest : float
        Extreme forces [N].
    rank_correlation_distance, rank_correlation_height : float
        Spearman's rank correlation of force with distance and with height; NaN where one of them is constant.
    """

    speed: float
    states: int
    lowest: float
    highest: float
    rank_correlation_distance: float
    rank_correlation_height: float

    @property
    def ratio(self) -> float:
        """Highest over lowest force."""
        return self.highest / self.lowest


@dataclass(frozen=True)
class Comparison:
    """Force models compared on the same states.

    Parameters
    ----------
    on : str
        Which states: test states, or every state left out in turn.
    models : tuple of ModelComparison
        The measured map first, the standard's contact model last.
    allowed : tuple of AllowedSpeed
        What the map, the 2D map and the standard allow.
    variation : WorkspaceVariation
        How forces vary over the workspace.
    bound : Bound
        The bound behind the maps' speeds.
    statements : tuple of str
        What the comparison depends on.
    """

    on: str
    models: tuple[ModelComparison, ...]
    allowed: tuple[AllowedSpeed, ...]
    variation: WorkspaceVariation
    bound: Bound
    statements: tuple[str, ...]


def compare_force_models(
    dataset: ImpactDataset,
    *,
    robot_mass: float,
    body_mass: float,
    stiffness: float,
    form: Form = CFM_3D,
    bound: Bound | None = None,
    limit: ForceLimit | float | None = None,
) -> Comparison:
    """Compare the measured map with the 2D map and the standard's contact model on the same states.

    The maps are fitted to the states with role train and compared on those with role test; without any, each
    state is predicted from the others. The 2D map per height is fitted at each height to all states with a
    training speed, test ones too (paper, section V-C): it is for comparison only.

    Parameters
    ----------
    dataset : ImpactDataset
        The impacts.
    robot_mass : float
        Effective robot mass m_R [kg], see `pfl_robot_mass`.
    body_mass : float
        Effective mass of the body region [kg]; math.inf if the body part is constrained.
    stiffness : float
        Spring constant of the body region [N/m].
    form : Form
        Form of the measured map.
    bound : Bound, optional
        Bound behind the maps' speeds; ToleranceBound() if not given.
    limit : ForceLimit or float, optional
        Limits of a body area (transient and quasi-static are both shown) or a force limit [N]; without it no
        speeds are compared.

    Returns
    -------
    Comparison

    Raises
    ------
    FitError
        A map cannot be fitted.
    InputError
        A figure outside its range.
    ContactNotPermitted
        The standard permits no contact with the body area.
    """
    bound = bound or ToleranceBound()
    body = {"robot_mass": robot_mass, "body_mass": body_mass, "stiffness": stiffness}
    maps = [fit_force_map(dataset, form=each) for each in dict.fromkeys((form, CFM_2D))]
    test = dataset.independent_test
    has_test = bool((test.states.impacts > 0).any())
    on = "test states" if has_test else "each state left out in turn"
    fit = maps[0].fit
    assert fit is not None
    states = test.states if has_test else fit.states.uncensored
    predictions = [
        (
            m.form.name,
            _predictions(m, states, has_test),
            "one map for all heights" if m.form is CFM_2D else "",
        )
        for m in maps
    ]
    per_height, heights_fitted = _per_height(dataset, states, has_test)
    if not np.isnan(per_height).all():
        note = f"a map for each of {heights_fitted} heights, for comparison only: fitted to test states too"
        predictions.append(("CFM_2D per height", per_height, note))
    contact_model = pfl_contact_force(states.speed, **body)
    predictions.append(("contact model", contact_model, "the standard's, one speed for the whole workspace"))
    kind = "constrained" if math.isinf(body_mass) else f"free, {body_mass:g} kg"
    return Comparison(
        on=on,
        models=tuple(_model(name, predicted, states, on, note) for name, predicted, note in predictions),
        allowed=tuple(_allowed(maps, dataset, limit, bound, body)) if limit is not None else (),
        variation=_variation(dataset),
        bound=bound,
        statements=(
            *maps[0].conditions.assumptions(),
            maps[0].phase_two.statement(),
            f"contact model: effective robot mass {robot_mass:g} kg, body part {kind}, "
            f"spring constant {stiffness / 1000:g} N/mm",
            "person at rest",
            "pressure not assessed",
        ),
    )


def _predictions(force_map: ForceMap, states: States, has_test: bool) -> FloatArray:
    if has_test:
        return np.asarray(force_map.predict(states.distance, states.height, states.speed))
    return left_out_predictions(force_map)[force_map.require_fit().states.impacts > 0]


def _per_height(dataset: ImpactDataset, states: States, has_test: bool) -> tuple[FloatArray, int]:
    """Predictions of the 2D map of each state's own height, NaN where there is none; and the number of maps."""
    train_speeds = dataset.train.states.speed
    height_of = dict(zip(dataset.states.name, dataset.states.height.tolist(), strict=True))
    height = np.array([height_of[name] for name in dataset.state])
    at_training_speed = np.abs(dataset.speed[:, None] - train_speeds).min(axis=1) <= dataset.tolerance.speed
    predicted = np.full(len(states), np.nan)
    fitted = 0
    heights = np.unique(height)
    for level in np.split(heights, np.flatnonzero(np.diff(heights) > dataset.tolerance.place) + 1):
        at_level = (height >= level[0]) & (height <= level[-1])
        rows = dataset.select(at_level & at_training_speed & ~dataset.censored)
        if not len(rows):
            continue
        try:
            own = fit_force_map(replace(rows, role=np.full(len(rows), "train")), form=CFM_2D)
        except FitError:
            continue
        fitted += 1
        here = (states.height >= level[0]) & (states.height <= level[-1])
        if has_test:
            predicted[here] = own.predict(states.distance[here], states.height[here], states.speed[here])
        else:
            assert own.fit is not None
            left_out = dict(zip(own.fit.states.name, left_out_predictions(own).tolist(), strict=True))
            predicted[here] = [left_out.get(states.name[i], math.nan) for i in np.flatnonzero(here)]
    return predicted, fitted


def _model(name: str, predicted: FloatArray, states: States, on: str, note: str) -> ModelComparison:
    known = ~np.isnan(predicted)
    if not known.any():
        raise InputError(f"found no state that {name} can be compared on ({on}), expected at least one")
    predicted, compared = predicted[known], states.select(known)
    accuracy = Accuracy.of(predicted, compared, on=on, skipped=int(np.sum(~known)))
    percent = 100 * (predicted / compared.force - 1)
    return ModelComparison(
        name,
        accuracy,
        most_underestimated=_extreme(compared, predicted, percent, int(np.nanargmin(percent)), -1),
        most_overestimated=_extreme(compared, predicted, percent, int(np.nanargmax(percent)), 1),
        note=note,
    )


def _extreme(states: States, predicted: FloatArray, percent: FloatArray, i: int, side: int) -> StateError | None:
    if not side * percent[i] > 0:
        return None
    figures = (
        states.distance[i],
        states.height[i],
        states.speed[i],
        states.force[i],
        predicted[i],
        percent[i],
    )
    return StateError(states.name[i], *(float(figure) for figure in figures))


def _allowed(
    maps: Sequence[ForceMap],
    dataset: ImpactDataset,
    limit: ForceLimit | float,
    bound: Bound,
    body: dict[str, float],
) -> list[AllowedSpeed]:
    places = np.unique(np.column_stack([dataset.states.distance, dataset.states.height]), axis=0)
    cases: list[tuple[float, Contact | None, str]] = (
        [(limit.force(contact), contact, f"{limit}, {contact}") for contact in Contact]
        if isinstance(limit, ForceLimit)
        else [(limit, Contact.QUASI_STATIC, "given in newtons, counted as quasi-static")]
    )
    allowed = []
    for newtons, contact, source in cases:
        for force_map in maps:
            case = {"limit": limit, "bound": bound, "contact": contact}
            allowed.append(_allowed_by(force_map, places, newtons, source, case))
        standard = pfl_speed_limit(newtons, **body)
        note = "a formula, not confirmed by any measurement"
        if isinstance(limit, ForceLimit) and contact is Contact.TRANSIENT:
            error = maps[0].conditions.device.error_or_default
            refusal = maps[0].phase_two.transient_refusal(limit.quasi_static, error)
            note += f"; no transient limit may be used: {refusal}" if refusal else ""
        allowed.append(
            AllowedSpeed("contact model", newtons, source, len(places), 0, standard, standard, standard, note)
        )
    return allowed


def _allowed_by(
    force_map: ForceMap, places: FloatArray, newtons: float, source: str, case: dict[str, Any]
) -> AllowedSpeed:
    name, nothing = force_map.form.name, (math.nan, math.nan, math.nan)
    try:
        speeds = safe_speed(force_map, places[:, 0], places[:, 1], **case)
    except (InputError, BoundNotAvailable) as error:
        return AllowedSpeed(name, newtons, source, len(places), 0, *nothing, note=error.message)
    confirmed = speeds.speed[~np.isnan(speeds.speed)]
    lowest, median, highest = np.quantile(confirmed, (0.0, 0.5, 1.0)).tolist() if confirmed.size else nothing
    refused = [r for r, o in zip(speeds.reason, speeds.outcome, strict=True) if o is SpeedOutcome.UNCONFIRMED]
    note = max(dict.fromkeys(refused), key=refused.count) if refused and not confirmed.size else ""
    return AllowedSpeed(name, newtons, source, len(places), confirmed.size, lowest, median, highest, note)


def _variation(dataset: ImpactDataset) -> WorkspaceVariation:
    """At the speed measured at most places; of several, the middle one."""
    states = dataset.states.uncensored
    speeds = np.unique(np.round(states.speed / dataset.tolerance.speed)) * dataset.tolerance.speed
    near = [np.abs(states.speed - speed) <= dataset.tolerance.speed for speed in speeds]
    most = [i for i, mask in enumerate(near) if mask.sum() == max(m.sum() for m in near)]
    chosen = states.select(near[most[len(most) // 2]])
    return WorkspaceVariation(
        speed=float(np.median(chosen.speed)),
        states=len(chosen),
        lowest=float(chosen.force.min()),
        highest=float(chosen.force.max()),
        rank_correlation_distance=_rank_correlation(chosen.distance, chosen.force),
        rank_correlation_height=_rank_correlation(chosen.height, chosen.force),
    )


def _rank_correlation(x: FloatArray, force: FloatArray) -> float:
    if np.ptp(x) == 0 or np.ptp(force) == 0:
        return math.nan
    from scipy.stats import spearmanr

    return float(spearmanr(x, force).statistic)
