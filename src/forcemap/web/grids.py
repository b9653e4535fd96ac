"""What only the page draws: speeds of many places, slices through a state, and the whole workspace."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcemap import SpeedOutcome, map_sha256, safe_speed
from forcemap.answers.answer import AllSaid, Answer, Figure, PlaceAndSpeed, figures
from forcemap.answers.basis import RestsOn, rests_on
from forcemap.answers.speed import SpeedAnswer
from forcemap.arrays import FloatArray
from forcemap.web.campaign_map import CampaignMap
from forcemap.web.contours import Contour, contours
from forcemap.web.question import Resolution, State
from forcemap.words import sentence, sentences

_CUBE = 50
"""Points along each edge of the workspace: over 10^5 in all, even with the near corner cut away; a choice."""

_LINE = 61
"""Points of a slice along one variable; a choice: it is drawn as a smooth line."""

_PLANE = 10_000
"""Places of a slice over distance and height; a choice: answered within a tenth of a second (docs/benchmarks.md)."""

_SPEED_DECIMALS = 6
"""Decimals of a speed in m/s that is drawn: the accuracy of its search."""

_PLACE_DECIMALS = 6
"""Decimals of a place of a grid in m; a choice, far below what is measured."""

_AXIS_DECIMALS, _FORCE_DECIMALS, _LINE_DECIMALS = 4, 1, 2
"""Decimals of the workspace's axes in m and m/s, of its forces and those of a plane in N, of a line's forces in N.

Choices: finer than can be seen, and few enough for an answer of 10^5 points.
"""
_OUTCOMES = tuple(outcome.value for outcome in SpeedOutcome)


class SpeedGrid(RestsOn):
    """Safe speeds on a grid, rows along distance; outcomes and reasons are numbers of `outcomes` and `reasons`.

    `outcome` and `reason` are of the speed at contact, `counts` and `contours` of the speed to program.
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
    contours: list[Contour]
    measured: list[PlaceAndSpeed]


class Line(Answer):
    """Forces along one variable, the others fixed; null outside the measured range."""

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
    contours: list[Contour]
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


def speed_grid(campaign_map: CampaignMap, question: Resolution) -> SpeedGrid:
    """Safe speeds on a grid over the box around the measured range."""
    force_map = campaign_map.fitted.force_map
    d, h = _grid(campaign_map, question.places)
    speeds = safe_speed(force_map, *np.meshgrid(d, h, indexing="ij"), **campaign_map.case(question), hints=False)
    outcome, program = (_positions(outcomes, _OUTCOMES) for outcomes in (speeds.outcome, speeds.to_program_outcome))
    reasons = tuple(dict.fromkeys([*speeds.reason.ravel().tolist(), *speeds.to_program_reason.ravel().tolist()]))
    reason, program_reason = (_positions(findings, reasons) for findings in (speeds.reason, speeds.to_program_reason))
    states = force_map.require_fit().states
    return SpeedGrid(
        distance_m=d.tolist(),
        height_m=h.tolist(),
        speed_mps=figures(_rounded_down(speeds.speed, _SPEED_DECIMALS)),
        speed_to_program_mps=figures(_rounded_down(speeds.speed_to_program, _SPEED_DECIMALS)),
        outcomes=list(_OUTCOMES),
        outcome=outcome.tolist(),
        counts={name: int(np.sum(program == i)) for i, name in enumerate(_OUTCOMES)},
        reasons=[sentence(finding) for finding in reasons],
        reason=reason.tolist(),
        to_program_outcome=program.tolist(),
        to_program_reason=program_reason.tolist(),
        contours=contours(d, h, speeds.speed_to_program),
        measured=PlaceAndSpeed.of_columns(distance_m=states.distance, height_m=states.height, speed_mps=states.speed),
        **rests_on(force_map, speeds.basis, campaign_map.limits.statements),
    )


def _positions(values: NDArray[Any], names: Sequence[Any]) -> NDArray[Any]:
    """Position of every value in a list of names."""
    position = {name: i for i, name in enumerate(names)}
    return np.asarray(np.vectorize(position.__getitem__, otypes=[int])(values))


def slices_answer(campaign_map: CampaignMap, question: State) -> SlicesAnswer:
    """Slices through a state, the safe speed at its place, and whether its own speed is within it."""
    force_map, bound = campaign_map.fitted.force_map, question.bound_of(campaign_map.fitted.force_map)
    place = (question.distance_m, question.height_m, question.speed_mps)
    box = force_map.measured_range

    def forces(d: NDArray[Any], h: NDArray[Any], v: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        inside = box.contains(d, h, v)
        predicted, upper = np.full((2, *d.shape), math.nan)
        predicted[inside] = force_map.predict(d[inside], h[inside], v[inside])
        upper[inside] = bound.upper(force_map, d[inside], h[inside], v[inside])
        return predicted, upper

    def line(axis: int) -> Line:
        along = np.linspace(box.lowest[axis], box.highest[axis], _LINE)
        state = [along if i == axis else np.full(_LINE, value) for i, value in enumerate(place)]
        predicted, upper = forces(*state)
        drawn = {"predicted_N": _rounded(predicted, _LINE_DECIMALS), "bound_N": _rounded_up(upper, _LINE_DECIMALS)}
        return Line(at=along.tolist(), **drawn)

    d, h = _grid(campaign_map, _PLANE)
    distance, height = np.meshgrid(d, h, indexing="ij")
    _, over_places = forces(distance, height, np.full(distance.shape, question.speed_mps))
    here, upper_here = (float(force[0]) for force in forces(*(np.array([value]) for value in place)))
    speed = campaign_map.speed(question)
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
        place_bound_N=_rounded_up(over_places, _FORCE_DECIMALS),
        contours=contours(d, h, over_places, also=math.nan if speed.limit_N is None else speed.limit_N),
        speed=speed,
    )


def cube_answer(campaign_map: CampaignMap, question: Resolution) -> CubeAnswer:
    """Predicted forces over the workspace."""
    force_map, box = campaign_map.fitted.force_map, campaign_map.fitted.force_map.measured_range
    axes = [np.linspace(box.lowest[i], box.highest[i], _CUBE) for i in range(3)]
    d, h, v = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    force = np.where(box.contains(d, h, v), force_map.predict(d, h, v), math.nan)
    return CubeAnswer(
        distance_m=_rounded(axes[0], _AXIS_DECIMALS),
        height_m=_rounded(axes[1], _AXIS_DECIMALS),
        speed_mps=_rounded(axes[2], _AXIS_DECIMALS),
        force_N=_rounded(force, _FORCE_DECIMALS),
        simulated=force_map.simulated,
        assumptions=sentences([*campaign_map.limits.statements, *force_map.conditions.findings]),
        map_sha256=map_sha256(force_map),
        limits_sha256=campaign_map.limits.used.sha256,
    )


def _grid(campaign_map: CampaignMap, places: int) -> tuple[FloatArray, FloatArray]:
    """Axes of a grid of about so many places over the box around the measured range [m]."""
    box = campaign_map.fitted.force_map.measured_range
    size = max(2, round(math.sqrt(places)))

    def axis(low: float, high: float) -> FloatArray:
        return np.round(np.linspace(low, high, size if high > low else 1), _PLACE_DECIMALS).clip(low, high)

    return axis(box.lowest[0], box.highest[0]), axis(box.lowest[1], box.highest[1])


def _rounded(values: NDArray[Any], decimals: int) -> list[Any]:
    """The values of an array as nested lists, rounded to some decimals, None for NaN."""
    return figures(np.round(values, decimals))


def _rounded_up(values: NDArray[Any], decimals: int) -> list[Any]:
    """The same, rounded up: for bounds."""
    return figures(-_rounded_down(-values, decimals))


def _rounded_down(values: NDArray[Any], decimals: int) -> FloatArray:
    """The values of an array, rounded down to some decimals: for speeds."""
    scale = 10.0**decimals
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
