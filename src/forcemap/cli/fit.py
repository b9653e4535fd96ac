"""forcemap fit."""

from __future__ import annotations

from typing import Annotated

import typer

from forcemap import (
    CensoredImpacts,
    FitError,
    censoring_effect,
    map_accuracy,
    map_text,
    saturation_doubt,
    selection_stability,
)
from forcemap.cli.change_results import censoring_lines, censoring_result, censoring_summary
from forcemap.cli.fit_errors import too_few_states_named
from forcemap.cli.form_results import selection_lines, selection_refusal, selection_result
from forcemap.cli.options import DeviceSpring, FormName, Json, Table, fitted
from forcemap.cli.output import emit, write_result
from forcemap.cli.results import accuracy_lines, fit_lines, fit_result, repeats_lines


def fit(
    table: Table,
    form: FormName = None,
    device_spring: DeviceSpring = None,
    discard_censored: Annotated[
        bool,
        typer.Option("--discard-censored", help="Discard impacts above the device range, as the paper does."),
    ] = False,
    select: Annotated[
        bool,
        typer.Option(
            "--select",
            help="Also report which terms the paper's selection would keep; the fit stays. Needs a full grid.",
        ),
    ] = False,
    output: Annotated[str | None, typer.Option("-o", "--output", help="Write the map to this JSON file.")] = None,
    as_json: Json = False,
) -> None:
    """Fit a collision-force map to the train rows of a table.

    Impacts above the device range count as at least that force.

    Example: forcemap fit impacts.csv -o map.json
    """
    impacts = CensoredImpacts.DISCARD if discard_censored else CensoredImpacts.AT_LEAST
    with too_few_states_named(table, form):
        dataset, force_map = fitted(table, form, impacts, device_spring=device_spring)
    accuracy = map_accuracy(force_map, dataset)[0]
    if output:
        write_result(output, map_text(force_map), mark='"schema": "forcemap-map/')
    doubt = saturation_doubt(dataset.peak_force, dataset.state, censored=int(dataset.censored.sum()))
    lines = ["SIMULATED impacts: not a measurement of any robot"] if dataset.simulated else []
    binding = force_map.binding
    lines += [binding.reason] if binding.reason else []
    lines += [doubt] if doubt else []
    result = fit_result(force_map, accuracy)
    result |= {"binding": {"state": binding.state.value, "reason": binding.reason or None}}
    result |= {"disagreeing_repeats": dataset.disagreeing_repeats, "saturation_doubt": doubt or None}
    selected: list[str] = []
    if select:
        try:
            stability = selection_stability([dataset])
            result["selection"] = selection_result(stability)
            selected = ["", *selection_lines(stability)]
        except FitError as error:  # a report beside the fit, which is done
            result["selection"] = {"refused": selection_refusal(error)}
            lines += [selection_refusal(error), ""]
    summary, effects = [], []
    if force_map.require_fit().censored_fit:
        effect = censoring_effect(dataset, form=force_map.form)
        result["discard_fit"] = censoring_result(effect)
        summary, effects = censoring_summary(effect), ["", *censoring_lines(effect)]
    lines += [*fit_lines(force_map, summary), *repeats_lines(dataset)]
    lines += ["", f"Accuracy on {accuracy.on}", *accuracy_lines([(force_map.form.name, accuracy)])]
    lines += [*effects, *selected]
    lines += ["", f"map written to {output}"] if output else ["", "no file written; -o MAP.json writes the map"]
    emit(result, lines, as_json=as_json)
