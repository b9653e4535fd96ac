"""forcemap fit."""

from __future__ import annotations

from typing import Annotated

import typer

from forcemap import CensoredImpacts, FitError, censoring_effect, map_accuracy, map_text, selection_stability
from forcemap.cli.change_results import censoring_lines, censoring_result
from forcemap.cli.form_results import selection_lines, selection_result
from forcemap.cli.options import FormName, Json, Table, fitted
from forcemap.cli.output import emit, write_result
from forcemap.cli.results import accuracy_lines, fit_lines, fit_result, repeats_lines


def fit(
    table: Table,
    form: FormName = None,
    discard_censored: Annotated[
        bool,
        typer.Option("--discard-censored", help="Discard impacts above the device range, as the paper does."),
    ] = False,
    select: Annotated[
        bool,
        typer.Option("--select", help="Also report which terms the paper's selection would keep; the fit stays."),
    ] = False,
    output: Annotated[str | None, typer.Option("-o", "--output", help="Write the map to this JSON file.")] = None,
    as_json: Json = False,
) -> None:
    """Fit a collision-force map to the train rows of a table.

    Impacts above the device range count as at least that force.

    Example: forcemap fit impacts.csv -o map.json
    """
    impacts = CensoredImpacts.DISCARD if discard_censored else CensoredImpacts.AT_LEAST
    dataset, force_map = fitted(table, form, impacts)
    accuracy = map_accuracy(force_map, dataset)[0]
    if output:
        write_result(output, map_text(force_map), mark='"schema": "forcemap-map/')
    lines = [*fit_lines(force_map), *repeats_lines(dataset)]
    lines += ["", f"Accuracy on {accuracy.on}", *accuracy_lines([(force_map.form.name, accuracy)])]
    if dataset.simulated:
        lines.insert(0, "SIMULATED impacts: not a measurement of any robot")
    result = fit_result(force_map, accuracy) | {"disagreeing_repeats": dataset.disagreeing_repeats}
    if force_map.require_fit().censored_fit:
        effect = censoring_effect(dataset, form=force_map.form)
        result["discard_fit"] = censoring_result(effect)
        lines += ["", *censoring_lines(effect)]
    if select:
        try:
            stability = selection_stability([dataset])
            result["selection"] = selection_result(stability)
            lines += ["", *selection_lines(stability)]
        except FitError as error:  # a report beside the fit, which is done
            result["selection"] = {"refused": str(error)}
            lines += ["", f"Term selection is not possible: {error}"]
    lines += ["", f"map written to {output}"] if output else ["", "no file written; -o MAP.json writes the map"]
    emit(result, lines, as_json=as_json)
