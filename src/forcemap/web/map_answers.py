"""The map: its coefficients and states, slices through a state, and the whole workspace."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from forcemap import Accuracy, map_sha256
from forcemap.web.held import Fitted
from forcemap.web.limits import Limits
from forcemap.web.numbers import number, numbers, raised
from forcemap.web.question import Resolution, State
from forcemap.web.speed_answers import Basis, SpeedAnswer, basis_of, grid, speed_answer

_CUBE = 50  # points along each edge of the workspace: more than 10^5, also with a corner cut away
_ALONG = 61


class AccuracyAnswer(BaseModel):
    """How far predictions lie from measured states; underestimation is the dangerous side."""

    on: str
    states: int
    max_underestimation_percent: float
    mean_underestimation_percent: float
    max_overestimation_percent: float
    mean_overestimation_percent: float
    rmse_N: float


class Coefficient(BaseModel):
    """A term of the map, ln F = sum of coefficient x term."""

    term: str
    coefficient: float
    standard_error: float | None


class MeasuredState(BaseModel):
    """A state as it was measured; force null where every impact exceeded the device range."""

    state_id: str
    role: str
    distance_m: float
    height_m: float
    speed_mps: float
    force_N: float | None
    at_least_N: float | None
    predicted_N: float


class MapAnswer(BaseModel):
    """A campaign's collision-force map."""

    name: str
    form: str
    terms: list[Coefficient]
    states: list[MeasuredState]
    samples: int
    censored_samples: int
    state_sd_percent: float | None
    accuracy: list[AccuracyAnswer]
    lowest_measured: list[float]
    highest_measured: list[float]
    map_sha256: str
    simulated: bool
    assumptions: list[str]


class Line(BaseModel):
    """Forces along one variable, the others held; null outside the measured range."""

    at: list[float]
    predicted_N: list[float | None]
    bound_N: list[float | None]


class SlicesAnswer(BaseModel):
    """Slices through a state: along distance, height and speed, and over all places at its speed."""

    predicted_N: float | None
    bound_N: float | None
    measured: bool
    verdict: str
    along_distance: Line
    along_height: Line
    along_speed: Line
    distance_m: list[float]
    height_m: list[float]
    place_bound_N: list[list[float | None]]
    speed: SpeedAnswer


class CubeAnswer(BaseModel):
    """Predicted forces over the workspace, distance slowest, speed fastest; null outside the measured range."""

    distance_m: list[float]
    height_m: list[float]
    speed_mps: list[float]
    force_N: list[float | None]
    basis: Basis


def accuracy_answer(accuracy: Accuracy) -> AccuracyAnswer:
    """An accuracy for JSON."""
    names = set(AccuracyAnswer.model_fields) - {"rmse_N"}
    return AccuracyAnswer(rmse_N=accuracy.rmse, **{name: getattr(accuracy, name) for name in names})


def map_answer(found: Fitted) -> MapAnswer:
    """The map of a campaign."""
    force_map, fit = found.force_map, found.force_map.require_fit()
    states = []
    for role, each in (("train", fit.states), ("left out", fit.left_out), ("test", fit.test)):
        predicted = np.atleast_1d(force_map.predict(each.distance, each.height, each.speed))
        figures = (each.distance, each.height, each.speed, each.force, each.at_least, predicted)
        states += [
            MeasuredState(
                state_id=name,
                role=role,
                distance_m=d,
                height_m=h,
                speed_mps=v,
                force_N=number(f),
                at_least_N=number(least),
                predicted_N=p,
            )
            for name, d, h, v, f, least, p in zip(each.name, *(figure.tolist() for figure in figures), strict=True)
        ]
    columns = (force_map.form.term_names, force_map.coefficients.tolist(), fit.between_states.standard_errors.tolist())
    return MapAnswer(
        name=force_map.name,
        form=force_map.form.name,
        terms=[Coefficient(term=t, coefficient=b, standard_error=number(e)) for t, b, e in zip(*columns, strict=True)],
        states=states,
        samples=fit.samples,
        censored_samples=fit.censored_samples,
        state_sd_percent=number(100 * fit.state_sd),
        accuracy=[accuracy_answer(each) for each in found.accuracy],
        lowest_measured=force_map.measured_range.lowest.tolist(),
        highest_measured=force_map.measured_range.highest.tolist(),
        map_sha256=map_sha256(force_map),
        simulated=force_map.simulated,
        assumptions=[*force_map.conditions.assumptions(), force_map.phase_two.statement()],
    )


def slices_answer(found: Fitted, question: State, limits: Limits) -> SlicesAnswer:
    """Slices through a state, the safe speed at its place, and whether its own speed is within it."""
    force_map, bound = found.force_map, question.bound_of(found.force_map)
    at = (question.distance_m, question.height_m, question.speed_mps)
    box = force_map.measured_range

    def forces(d: NDArray[Any], h: NDArray[Any], v: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        inside = box.contains(d, h, v)
        predicted, upper = np.full((2, *d.shape), math.nan)
        predicted[inside] = force_map.predict(d[inside], h[inside], v[inside])
        upper[inside] = bound.upper(force_map, d[inside], h[inside], v[inside])
        return predicted, upper

    def line(axis: int) -> Line:
        along = np.linspace(box.lowest[axis], box.highest[axis], _ALONG)
        state = [along if i == axis else np.full(_ALONG, value) for i, value in enumerate(at)]
        predicted, upper = forces(*state)
        return Line(at=numbers(along, 9), predicted_N=numbers(predicted, 2), bound_N=raised(upper, 2))

    d, h = grid(found, 10_000)
    at_d, at_h = (np.ascontiguousarray(each) for each in np.meshgrid(d, h, indexing="ij"))
    _, over_places = forces(at_d, at_h, np.full(at_d.shape, question.speed_mps))
    here, upper_here = (float(each[0]) for each in forces(*(np.array([value]) for value in at)))
    speed = speed_answer(found, question, limits)
    return SlicesAnswer(
        predicted_N=number(here),
        bound_N=number(upper_here),
        measured=not math.isnan(here),
        verdict=_verdict(question.speed_mps, speed),
        along_distance=line(0),
        along_height=line(1),
        along_speed=line(2),
        distance_m=d.tolist(),
        height_m=h.tolist(),
        place_bound_N=raised(over_places, 1),
        speed=speed,
    )


def cube_answer(found: Fitted, question: Resolution, limits: Limits) -> CubeAnswer:
    """Predicted forces over the workspace."""
    force_map, box = found.force_map, found.force_map.measured_range
    axes = [np.linspace(box.lowest[i], box.highest[i], _CUBE) for i in range(3)]
    d, h, v = (each.ravel() for each in np.meshgrid(*axes, indexing="ij"))
    force = np.where(box.contains(d, h, v), force_map.predict(d, h, v), math.nan)
    return CubeAnswer(
        distance_m=numbers(axes[0], 4),
        height_m=numbers(axes[1], 4),
        speed_mps=numbers(axes[2], 4),
        force_N=numbers(force, 1),
        basis=basis_of(found, question, limits, ()),
    )


def _verdict(speed: float, answer: SpeedAnswer) -> str:
    """Whether a speed may be driven at the place of an answer, in words."""
    if answer.speed_mps is None:
        return f"no speed is permitted here: {answer.outcome.replace('_', ' ')}"
    if speed > answer.speed_mps:
        return f"faster than the safe speed here, {answer.speed_shown} m/s"
    if answer.lowest_measured_speed_mps is not None and speed < answer.lowest_measured_speed_mps:
        return "slower than anything measured here; the safe speed covers it"
    return "within the safe speed here"
