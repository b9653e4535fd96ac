"""forcemap evaluate."""

from __future__ import annotations

from typing import Annotated

import typer

from forcemap import (
    Accuracy,
    InputError,
    MapOutcome,
    check_map,
    compare_forms,
    force_map_accuracy,
    map_accuracy,
    read_dataset,
)
from forcemap.cli.change_results import check_lines, check_result
from forcemap.cli.fit_errors import too_few_states_named
from forcemap.cli.form_results import forms_lines, forms_result
from forcemap.cli.options import FormName, Json, Table, fitted, force_map_from
from forcemap.cli.output import emit
from forcemap.cli.results import accuracy_lines, accuracy_result


def evaluate(
    table: Table,
    map_source: Annotated[
        str | None,
        typer.Option("--map", help="Compare this map with all rows, in place of fitting the train rows."),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option("--against", help="Does this older map still hold for these new impacts?"),
    ] = None,
    forms: Annotated[
        bool, typer.Option("--forms", help="Compare the forms on the same states, and recommend.")
    ] = False,
    form: FormName = None,
    as_json: Json = False,
) -> int:
    """Say how far predicted forces are from the measured ones.

    Fits the train rows and compares with the test rows, with each fitted state left out in turn, and with all.

    With --against: exit code 0 the map holds, 1 it does not hold, 2 cannot tell. With --forms: 2 too few states to
    recommend any.

    Example: forcemap evaluate impacts.csv --map ur10e
    """
    if sum((map_source is not None, against is not None, forms)) > 1:
        raise InputError("evaluate: found more than one of --map, --against and --forms, expected at most one")
    if forms and form:
        raise InputError("form: --forms compares all forms, leave --form out")
    if against is not None:
        return _check(table, against, form, as_json=as_json)
    if forms:
        comparison = compare_forms(read_dataset(table))
        emit(forms_result(comparison), forms_lines(comparison), as_json=as_json)
        return 2 if comparison.recommended is None else 0
    if map_source:
        dataset = read_dataset(table)
        with too_few_states_named(map_source, form):
            force_map, _ = force_map_from(map_source, form)
        accuracies: tuple[Accuracy, ...] = (force_map_accuracy(force_map, dataset),)
    else:
        with too_few_states_named(table, form):
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
    return 0


def _check(table: str, against: str, form: str | None, *, as_json: bool) -> int:
    with too_few_states_named(against, form):
        force_map, _ = force_map_from(against, form)
    check = check_map(force_map, read_dataset(table))
    emit(check_result(check), check_lines(check), as_json=as_json)
    return {MapOutcome.HOLDS: 0, MapOutcome.DOES_NOT_HOLD: 1, MapOutcome.CANNOT_TELL: 2}[check.outcome]
