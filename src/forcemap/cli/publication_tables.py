"""The tables of a publication: the paper's, and what stands behind its figures, as CSV."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

import forcemap as fm
from forcemap.answers.speed_map import SpeedMapAnswer
from forcemap.assessment.assess_campaign import PLACES_APART
from forcemap.cli.drawings import Choices, Kind, Source
from forcemap.cli.options import bound_from, wanted_form
from forcemap.cli.speed import fastest_line, speed_map_table
from forcemap.comparisons.force_models import ModelComparison, compared_maps
from forcemap.csv_table import csv_cell, csv_text
from forcemap.maps.coefficients import coefficient_intervals

_ERRORS = {
    "states": "states",
    "states_outside_measured_range": "outside_states",
    "max_underestimation_percent": "max_underestimation_percent",
    "max_underestimation_N": "max_underestimation",
    "mean_underestimation_percent": "mean_underestimation_percent",
    "mean_underestimation_N": "mean_underestimation",
    "max_overestimation_percent": "max_overestimation_percent",
    "max_overestimation_N": "max_overestimation",
    "mean_overestimation_percent": "mean_overestimation_percent",
    "mean_overestimation_N": "mean_overestimation",
    "rmse_N": "rmse",
}
"""Columns of accuracies (paper, Tables II and III) and the attributes they show."""


def tables_of(source: Source, choices: Choices) -> tuple[dict[str, str], dict[str, str], dict[str, str], list[str]]:
    """The text of every table by its name, of those that cannot be had why, of those without a speed why, and what must
    be said first of their speeds."""
    dataset = source.impacts(Kind.GRID)
    tables = {
        "dataset": _csv(dataset, [_counts(dataset)]),
        "states": _csv(
            dataset, [row for role, part in _by_role(dataset) for row in _states(source.force_map, part, role)]
        ),
        "coefficients": _csv(dataset, [vars(row) for row in coefficient_intervals(source.force_map)]),
    }
    left_out: dict[str, str] = {}
    no_speed: dict[str, str] = {}
    doubts: dict[str, None] = {}
    accuracies = [(source.force_map.form.name, each) for each in fm.map_accuracy(source.force_map, dataset)]
    compared, wanting = _compared(source, dataset, choices)
    accuracies += [(model.model, each) for model in compared for each in (model.accuracy, model.on_all)]
    left_out |= wanting
    if choices.area is None:
        left_out["comparison, speeds"] = "no body area was named; they need one, such as --area back_of_hand"
    else:
        for contact in fm.Contact:
            try:
                tables[f"speeds-{contact}"], answer = _speeds(source.force_map, choices.limit(source), contact)
                doubts |= dict.fromkeys(answer.warnings)
                why = "" if answer.fastest_to_program else f"{answer.limit}: {fastest_line(answer)}"
                no_speed |= {f"tables/speeds-{contact}.csv": why} if why else {}
            except fm.ForcemapError as error:
                left_out[f"tables/speeds-{contact}.csv"] = error.message
    rows = [{"model": name, "on": each.on, **_errors(each)} for name, each in accuracies]
    return {**tables, "accuracy": _csv(dataset, rows)}, left_out, no_speed, list(doubts)


def _compared(
    source: Source, dataset: fm.ImpactDataset, choices: Choices
) -> tuple[list[ModelComparison], dict[str, str]]:
    """The models beside the map, and what is left out why: the standard's needs a body area and a moving mass."""
    file = "tables/accuracy.csv"
    try:
        _, models = compared_maps(dataset, wanted_form(source.form))
    except fm.ForcemapError as error:
        return [], {f"{file}, other models": error.message}
    try:
        if choices.area is not None:
            models.add_standard(source.model(choices).figures, dataset.conditions.device.stiffness)
    except fm.ForcemapError as error:
        return models.compared[1:], {f"{file}, contact model": error.message}
    return models.compared[1:], {}


def _errors(accuracy: fm.Accuracy) -> dict[str, object]:
    return {column: getattr(accuracy, attribute) for column, attribute in _ERRORS.items()}


def _counts(dataset: fm.ImpactDataset) -> dict[str, object]:
    """The row of a campaign in the paper's Table I."""
    counts: dict[str, object] = {}
    for role, part in (("training", dataset.train), ("testing", dataset.tested)):
        states = part.states
        counts[f"most_repeats_of_a_{role}_state"] = int((states.impacts + states.censored).max(initial=0))
        counts[f"{role}_states"] = len(part.states) if len(part) else 0
        counts[f"{role}_impacts_used"] = int(np.sum(~part.censored))
    return counts | {"impacts_above_device_range": int(dataset.censored.sum())}


def _by_role(dataset: fm.ImpactDataset) -> tuple[tuple[str, fm.ImpactDataset], ...]:
    """The impacts by what became of them; a training state that was measured again has some of role test, too."""
    return ("train", dataset.train), ("test", dataset.tested), ("slower", dataset.select(dataset.slower))


def _states(force_map: fm.ForceMap, dataset: fm.ImpactDataset, role: str) -> Iterator[dict[str, object]]:
    """The states of impacts of a role with their mean force and the map's."""
    if not len(dataset):
        return
    scatter = dict(zip(*(getattr(fm.repeatability(dataset), name) for name in ("state", "sd")), strict=True))
    states = dataset.states
    predicted = np.asarray(force_map.predict(*states.coordinates.T))
    inside = force_map.measured_range.near(states.coordinates, dataset.tolerance.scale)
    stated = dataset.conditions.as_stated(states.speed)
    counts, forces = (states.impacts, states.censored), (states.force, predicted)
    columns = (states.name, *states.coordinates.T, stated, inside, *counts, *forces)
    for name, d, h, v, said, within, impacts, censored, force, expected in zip(*columns, strict=True):
        yield {
            "state_id": name,
            "role": role,
            "distance_m": float(d),
            "height_m": float(h),
            "speed_stated_mps": float(said),
            "speed_less_error_mps": float(v),
            "in_measured_range": bool(within),
            "impacts": int(impacts),
            "above_device_range": int(censored),
            "mean_peak_force_N": float(force),
            "repeat_sd_N": float(scatter[name]),
            "predicted_force_N": float(expected),
            "error_percent": float(100 * (expected / force - 1)),
        }


def _speeds(force_map: fm.ForceMap, limit: fm.ForceLimit, contact: fm.Contact) -> tuple[str, SpeedMapAnswer]:
    """The table of speeds, and the answer that it is of."""
    limit.require_permitted()
    bound = bound_from(force_map)
    grid = fm.measured_grid(force_map, PLACES_APART)
    speeds = fm.speed_map(force_map, *grid, limit=limit, bound=bound, contact=contact)
    answer = SpeedMapAnswer.of_speeds(force_map, speeds, None)
    return speed_map_table(speeds, answer, force_map.source), answer


def _csv(dataset: fm.ImpactDataset, rows: Sequence[Mapping[str, object]]) -> str:
    """Rows as CSV, each with whether it rests on simulated impacts."""
    columns = {column: [csv_cell(row[column]) for row in rows] for column in rows[0]}
    return csv_text(columns | {"simulated": [csv_cell(dataset.simulated)] * len(rows)})
