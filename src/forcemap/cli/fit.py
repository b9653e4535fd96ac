"""forcemap fit."""

from __future__ import annotations

from typing import Annotated

import typer

from forcemap import map_accuracy, map_text
from forcemap.cli.options import FormName, Json, Table, fitted
from forcemap.cli.output import emit, write_result
from forcemap.cli.results import accuracy_lines, fit_lines, fit_result, repeats_lines


def fit(
    table: Table,
    form: FormName = None,
    output: Annotated[str | None, typer.Option("-o", "--output", help="Write the map to this JSON file.")] = None,
    as_json: Json = False,
) -> None:
    """Fit a collision-force map to the train rows of a table.

    Example: forcemap fit impacts.csv -o map.json
    """
    dataset, force_map = fitted(table, form)
    accuracy = map_accuracy(force_map, dataset)[0]
    if output:
        write_result(output, map_text(force_map), mark='"schema": "forcemap-map/')
    lines = [*fit_lines(force_map), *repeats_lines(dataset)]
    lines += ["", f"Accuracy on {accuracy.on}", *accuracy_lines([(force_map.form.name, accuracy)])]
    if dataset.simulated:
        lines.insert(0, "SIMULATED impacts: not a measurement of any robot")
    lines += ["", f"map written to {output}"] if output else ["", "no file written; -o MAP.json writes the map"]
    result = fit_result(force_map, accuracy) | {"disagreeing_repeats": dataset.disagreeing_repeats}
    emit(result, lines, as_json=as_json)
