"""A plan as lines to print, for the person at the robot."""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Sequence

import numpy as np

from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.direction import direction_vector, direction_words
from forcemap.errors import InputError
from forcemap.findings import FindingKind
from forcemap.words import sentence, sentences

_STANDS_WITHIN = 1.0  # [deg]; a choice: what a spirit level and a square give
_SHEET_WIDTH = 100  # characters; no printed line is longer
_BEFORE, _AFTER = "Runs: ", "expected forces: "  # beginnings of the lines between which the conditions stand
_OF_DEVICE = {FindingKind.COLLECT_NEEDS, FindingKind.SPRING_NEEDED, FindingKind.SPRING_OF_DEVICE_NOT_STATED}
"""Warnings of a plan that stand among the conditions: they end with what campaign.toml states later."""


def run_sheet(
    plan: MeasurementPlan,
    conditions: Conditions,
    *,
    upper_force: Sequence[float] = (),
    waiting: MeasurementPlan | None = None,
) -> list[str]:
    """The plan as lines of at most 100 characters, to be printed for the person at the robot.

    Parameters
    ----------
    plan : MeasurementPlan
        The runs to make.
    conditions : Conditions
        The conditions of the measurement.
    upper_force : sequence of float
        Force that each run is not to exceed [N], for a column "at most"; no column if not given.
    waiting : MeasurementPlan, optional
        Runs planned earlier that are not measured yet; they follow the others.
    """
    warnings = [each for each in plan.warnings if not _OF_DEVICE & {each.kind, *(part.kind for part in each.also)}]
    lines = _wrapped(
        f"{_BEFORE}{len(plan)}, states: {len(plan.states)}",
        *_stated(conditions),
        f"{_AFTER}{sentence(plan.expected_from) or 'not stated'}",
        *(f"WARNING: {sentence(warning)}" for warning in warnings),
        *(f"left out: {sentence(reason)}" for reason in plan.left_out),
    )
    names = [*plan.recording.tolist(), *([] if waiting is None else waiting.recording.tolist())]
    width = max(len("save as"), *(len(name) for name in names))
    lines += _runs(plan, width, list(upper_force))
    if waiting is not None and len(waiting):
        lines += ["", "Planned earlier and not measured yet", *_runs(waiting, width, [], first=len(plan) + 1)]
    return lines


def restated(sheet: Sequence[str], conditions: Conditions) -> list[str]:
    """The lines of a run sheet with what its campaign states now; all else stays, what a person wrote there too.

    Raises
    ------
    InputError
        The lines between which the conditions stand are not there.
    """
    first, last = (next((i for i, line in enumerate(sheet) if line.startswith(s)), -1) for s in (_BEFORE, _AFTER))
    if not 0 <= first < last:
        raise InputError(f"found no line {_BEFORE!r} and below it one {_AFTER!r}, expected them as in every run sheet")
    return [*sheet[: first + 1], *_wrapped(*_stated(conditions)), *sheet[last:]]


def with_added(sheet: Sequence[str], waiting: MeasurementPlan) -> tuple[list[str], int]:
    """The lines of a run sheet with the waiting runs that are not on it below them, and how many these are."""
    there = {words[1] for line in sheet if len(words := line.split()) > 1 and words[0].isdecimal()}
    added = waiting.select(np.array([name not in there for name in waiting.recording.tolist()], dtype=np.bool_))
    if not len(added):
        return list(sheet), 0
    width = max(len("save as"), *(len(name) for name in added.recording.tolist()))
    return [*sheet, "", "Added to plan.csv", *_runs(added, width, [], first=len(there) + 1)], len(added)


def _stated(conditions: Conditions) -> list[str]:
    """What the campaign states, and what is needed of the device and is not."""
    device = conditions.device
    stated = {
        "controller": conditions.controller,
        "firmware": conditions.firmware,
        "base angle": "" if math.isnan(conditions.base_angle) else f"{conditions.base_angle:g} deg",
        "device calibrated": device.calibrated,
        "device error": "" if math.isnan(device.error) else f"{device.error:g} N",
        "standard": conditions.standard_edition,
        "operator": conditions.operator,
    }
    return [
        *sentences(conditions.findings),
        *device_stands(conditions.direction),
        *(f"{name}: {value or 'not stated'}" for name, value in stated.items()),
        *(f"WARNING: {sentence(need)}" for need in conditions.device_needs),
        "What is said below is as of when the runs were planned: a payload stated since is not in the forces expected "
        "(a plan into a new folder that holds this campaign.toml has it; forces of a map are with its own payload)",
    ]


def _wrapped(*lines: str) -> list[str]:
    return [part for line in lines for part in textwrap.wrap(line, _SHEET_WIDTH, subsequent_indent="    ")]


def device_stands(direction: str) -> list[str]:
    """How the device is put up for a direction of motion; no line where the direction is not known."""
    try:
        towards = direction_vector(direction, whose="the campaign")
    except InputError:
        return []
    facing = direction_words(-towards)
    return [
        f"the device stands: across the motion, its measuring face pointing {facing}, so that the robot moves "
        f"{direction_words(towards)} straight into it, within {_STANDS_WITHIN:g} degree at every place"
    ]


def _runs(plan: MeasurementPlan, width: int, upper: list[float], *, first: int = 1) -> list[str]:
    """A table for each speed, or for each place if the runs go by place; runs are numbered from `first`."""
    # The paper is too narrow for an empty column of base angles beside that of forces.
    angles = not upper or not all(math.isnan(angle) for angle in plan.base_angle.tolist())
    base = f" {'base [deg]':>10}" if angles else ""
    most = f" {'at most [N]':>11}" if upper else ""
    columns = f"{'v [m/s]':>7}" if plan.by_place else f"{'d [m]':>7} {'h [m]':>7}"
    title = f"{'no.':>4}  {'save as':{width}} {columns}{base} {'rep.':>4} {'exp. [N]':>8}{most}  "
    places = [(f"{d:.4g}", f"{h:.4g}") for d, h in zip(plan.distance.tolist(), plan.height.tolist(), strict=True)]
    heads = [f"v = {v:g} m/s" for v in plan.speed.tolist()]
    if plan.by_place:
        heads = [f"d = {d} m, h = {h} m" for d, h in places]
    lines = []
    for head, block in itertools.groupby(enumerate(plan.recording.tolist()), key=lambda run: heads[run[0]]):
        # What the runs of a table have in common stands above it, so that nobody at the robot misses a change.
        lines += ["", head, title + "done, note", "-" * (len(title) + 10)]
        for i, name in block:
            where = f"{plan.speed[i]:7.4g}" if plan.by_place else " ".join(f"{value:>7}" for value in places[i])
            where += f" {_figure(plan.base_angle[i], 'g'):>10}" if angles else ""
            force = f"{_figure(plan.expected_force[i], '.0f'):>8}"
            force += f" {math.floor(upper[i]):>11}" if upper else ""
            blank = "_" * max(10, min(24, _SHEET_WIDTH - len(title)))
            lines.append(f"{first + i:4}  {name:{width}} {where} {plan.repeat[i]:4} {force}  {blank}")
    return lines


def _figure(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form)
