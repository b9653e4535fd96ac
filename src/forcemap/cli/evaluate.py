"""forcemap evaluate."""

from __future__ import annotations

from typing import Annotated

import typer

from forcemap import Accuracy, force_map_accuracy, map_accuracy, read_dataset
from forcemap.cli.options import FormName, Json, Table, fitted, force_map_from
from forcemap.cli.output import emit
from forcemap.cli.results import accuracy_lines, accuracy_result


def evaluate(
    table: Table,
    map_source: Annotated[
        str | None,
        typer.Option("--map", help="Compare this map with all rows, in place of fitting the train rows."),
    ] = None,
    form: FormName = None,
    as_json: Json = False,
) -> None:
    """Say how far predicted forces are from the measured ones.

    Fits the train rows and compares with the test rows, with each fitted state left out in turn, and with all.

    Example: forcemap evaluate impacts.csv --map ur10e
    """
    if map_source:
        dataset = read_dataset(table)
        force_map, _ = force_map_from(map_source, form)
        accuracies: tuple[Accuracy, ...] = (force_map_accuracy(force_map, dataset),)
    else:
        dataset, force_map = fitted(table, form)
        accuracies = map_accuracy(force_map, dataset)
    result = {
        "map": force_map.source,
        "form": force_map.form.name,
        "simulated": dataset.simulated,
        "accuracies": [accuracy_result(accuracy) for accuracy in accuracies],
    }
    lines = [
        *(["SIMULATED impacts: not a measurement of any robot"] if dataset.simulated else []),
        f"{force_map.form.name} {force_map.source}",
        *accuracy_lines([(accuracy.on, accuracy) for accuracy in accuracies]),
        *(f"most underestimated of {a.on}: {a.worst_state}" for a in accuracies if a.worst_state),
    ]
    emit(result, lines, as_json=as_json)
