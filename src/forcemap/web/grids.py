"""Figures that only the page draws: speeds of many places, slices through a state, and the whole workspace."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcemap import SpeedOutcome, map_sha256, safe_speed
from forcemap.answers.answer import AllSaid, Answer, Figure, figures
from forcemap.answers.basis import RestsOn, rests_on
from forcemap.answers.speed import SpeedAnswer
from forcemap.arrays import FloatArray
from forcemap.web.map_answers import Asked
from forcemap.web.question import Resolution, State
from forcemap.words import sentence, sentences

_CUBE = 50  # points along each edge of the workspace: more than 10^5, also with a corner cut away
_ALONG = 61
_OUTCOMES = tuple(outcome.value for outcome in SpeedOutcome)


class SpeedGrid(RestsOn):
    """Safe speeds on a grid, rows along distance; outcomes and reasons are numbers of `outcomes` and `reasons`.

    `outcome` and `reason` are of the speed at contact, `counts` of the speed to program.
    """

    distance_m: list[float]
    height_m: list[float]
    speed_mps: list[list[float | None]]
    speed_to_program_mps: list[list[float | None]]
    outcomes: list[str]
    outcome: list[list[int]]
    counts: dict[str, int]
    reasons: list[str]
    reason: list[list[int]]
    to_program_outcome: list[list[int]]
    to_program_reason: list[list[int]]


class Line(Answer):
    """Forces along one variable, the others held; null outside the measured range."""

    at: list[float]
    predicted_N: list[float | None]
    bound_N: list[float | None]


class SlicesAnswer(Answer):
    """Slices through a state: along distance, height and speed, and over all places at its speed."""

    predicted_N: Figure
    bound_N: Figure
    measured: bool
    verdict: str
    along_distance: Line
    along_height: Line
    along_speed: Line
    distance_m: list[float]
    height_m: list[float]
    place_bound_N: list[list[float | None]]
    speed: SpeedAnswer


class CubeAnswer(Answer):
    """Predicted forces over the workspace, distance slowest, speed fastest; null outside the measured range."""

    distance_m: list[float]
    height_m: list[float]
    speed_mps: list[float]
    force_N: list[float | None]
    simulated: bool
    assumptions: AllSaid
    map_sha256: str
    limits_sha256: str


def speed_grid(asked: Asked, question: Resolution) -> SpeedGrid:
    """Safe speeds on a grid over the box around the measured range."""
    force_map = asked.fitted.force_map
    d, h = _grid(asked, question.places)
    speeds = safe_speed(force_map, *np.meshgrid(d, h, indexing="ij"), **asked.case(question), hints=False)
    outcome, program = (_positions(each, _OUTCOMES) for each in (speeds.outcome, speeds.to_program_outcome))
    reasons = tuple(dict.fromkeys([*speeds.reason.ravel().tolist(), *speeds.to_program_reason.ravel().tolist()]))
    reason, program_reason = (_positions(each, reasons) for each in (speeds.reason, speeds.to_program_reason))
    return SpeedGrid(
        distance_m=d.tolist(),
        height_m=h.tolist(),
        speed_mps=figures(_floored(speeds.speed, 6)),
        speed_to_program_mps=figures(_floored(speeds.speed_to_program, 6)),
        outcomes=list(_OUTCOMES),
        outcome=outcome.tolist(),
        counts={name: int(np.sum(program == i)) for i, name in enumerate(_OUTCOMES)},
        reasons=[sentence(each) for each in reasons],
        reason=reason.tolist(),
        to_program_outcome=program.tolist(),
        to_program_reason=program_reason.tolist(),
        **rests_on(force_map, speeds.basis, asked.limits.statements),
    )


def _positions(values: NDArray[Any], names: Sequence[Any]) -> NDArray[Any]:
    """Position of every value among some names."""
    position = {each: i for i, each in enumerate(names)}
    return np.asarray(np.vectorize(position.__getitem__, otypes=[int])(values))


def slices_answer(asked: Asked, question: State) -> SlicesAnswer:
    """Slices through a state, the safe speed at its place, and whether its own speed is within it."""
    force_map, bound = asked.fitted.force_map, question.bound_of(asked.fitted.force_map)
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
        return Line(at=along.tolist(), predicted_N=_numbers(predicted, 2), bound_N=_raised(upper, 2))

    d, h = _grid(asked, 10_000)
    at_d, at_h = np.meshgrid(d, h, indexing="ij")
    _, over_places = forces(at_d, at_h, np.full(at_d.shape, question.speed_mps))
    here, upper_here = (float(each[0]) for each in forces(*(np.array([value]) for value in at)))
    speed = asked.speed(question)
    return SlicesAnswer(
        predicted_N=here,
        bound_N=upper_here,
        measured=not math.isnan(here),
        verdict=_verdict(question.speed_mps, speed),
        along_distance=line(0),
        along_height=line(1),
        along_speed=line(2),
        distance_m=d.tolist(),
        height_m=h.tolist(),
        place_bound_N=_raised(over_places, 1),
        speed=speed,
    )


def cube_answer(asked: Asked, question: Resolution) -> CubeAnswer:
    """Predicted forces over the workspace."""
    force_map, box = asked.fitted.force_map, asked.fitted.force_map.measured_range
    axes = [np.linspace(box.lowest[i], box.highest[i], _CUBE) for i in range(3)]
    d, h, v = (each.ravel() for each in np.meshgrid(*axes, indexing="ij"))
    force = np.where(box.contains(d, h, v), force_map.predict(d, h, v), math.nan)
    return CubeAnswer(
        distance_m=_numbers(axes[0], 4),
        height_m=_numbers(axes[1], 4),
        speed_mps=_numbers(axes[2], 4),
        force_N=_numbers(force, 1),
        simulated=force_map.simulated,
        assumptions=sentences([*asked.limits.statements, *force_map.conditions.findings]),
        map_sha256=map_sha256(force_map),
        limits_sha256=asked.limits.of(question.area).sha256,
    )


def _grid(asked: Asked, places: int) -> tuple[FloatArray, FloatArray]:
    """Axes of a grid of about so many places over the box around the measured range [m]."""
    box = asked.fitted.force_map.measured_range
    size = max(2, round(math.sqrt(places)))

    def axis(low: float, high: float) -> FloatArray:
        return np.round(np.linspace(low, high, size if high > low else 1), 6).clip(low, high)

    return axis(box.lowest[0], box.highest[0]), axis(box.lowest[1], box.highest[1])


def _numbers(values: NDArray[Any], digits: int) -> list[Any]:
    """Figures of an array as nested lists, rounded to some digits, None where there is none."""
    return figures(np.round(values, digits))


def _raised(values: NDArray[Any], digits: int) -> list[Any]:
    """The same, never below the figures: for bounds."""
    return figures(-_floored(-values, digits))


def _floored(values: NDArray[Any], digits: int) -> FloatArray:
    """The figures of an array to some digits, never above them: for speeds."""
    scale = 10.0**digits
    steps = np.floor(values * scale)
    return np.where(steps / scale > values, steps - 1, steps) / scale  # the product may have been rounded up


def _verdict(speed: float, answer: SpeedAnswer) -> str:
    """Whether a speed may be driven at the place of an answer, in words."""
    if answer.speed_mps is None:
        return f"no speed is permitted here: {answer.outcome.replace('_', ' ')}"
    if speed > answer.speed_mps:
        return "faster than the safe speed at contact here"
    if answer.lowest_measured_speed_mps is not None and speed < answer.lowest_measured_speed_mps:
        return "slower than anything measured here; the safe speed at contact covers it"
    return "within the safe speed at contact here"
