"""forcemap speed-map."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from forcemap import ContactNotPermitted, measured_grid
from forcemap import speed_map as speeds_on_grid
from forcemap.cli.options import (
    Area,
    BoundOption,
    Confidence,
    ContactKind,
    Content,
    DeviceSpring,
    FormName,
    Json,
    LimitN,
    LimitSpring,
    LimitTable,
    Margin,
    QuasiStaticN,
    Region,
    Source,
    bound_from,
    force_map_from,
    limit_from,
)
from forcemap.cli.output import emit, json_text, listing, write_result
from forcemap.cli.results import (
    accuracy_words,
    limit_result,
    limit_words,
    next_lines,
    other_statements,
    speed_map_lines,
    speed_map_result,
    speed_map_table,
)
from forcemap.errors import InputError


def speed_map(
    source: Source,
    area: Area = None,
    region: Region = None,
    contact: ContactKind = None,
    limit_newtons: LimitN = None,
    quasi_static: QuasiStaticN = None,
    limit_spring: LimitSpring = None,
    limit_table: LimitTable = None,
    step: Annotated[float, typer.Option("--step-m", help="Distance between places [m].")] = 0.05,
    bound_kind: BoundOption = None,
    margin: Margin = None,
    confidence: Confidence = None,
    content: Content = None,
    form: FormName = None,
    device_spring: DeviceSpring = None,
    output: Annotated[str | None, typer.Option("-o", "--output", help="Write a .csv or .json file.")] = None,
    as_json: Json = False,
) -> None:
    """Give safe speeds on a grid of places over the measured range.

    Example: forcemap speed-map impacts.csv --area back_of_hand --contact quasi-static -o speeds.csv
    """
    if output and not output.endswith((".csv", ".json")):
        raise InputError("found a name that ends otherwise, expected .csv or .json", file=output)
    force_map, accuracy = force_map_from(source, form, device_spring)
    limit, contact = limit_from(area, region, limit_newtons, contact, limit_table, quasi_static, limit_spring)
    bound = bound_from(force_map, bound_kind, margin, confidence, content)
    distance, height = measured_grid(force_map, step)
    try:
        speeds = speeds_on_grid(force_map, distance, height, limit=limit, bound=bound, contact=contact)
    except ContactNotPermitted as error:
        refused: dict[str, Any] = {"outcome": "not_permitted", "reason": error.message, "fastest": None, "places": []}
        emit(limit_result(limit, contact) | refused, [f"no speed: {error.message}"], as_json=as_json)
        raise typer.Exit(1) from None
    basis = (force_map, limit, contact, bound)
    result = speed_map_result(speeds, force_map, accuracy, limit, contact, bound)
    if output:
        as_csv = output.endswith(".csv")
        text = speed_map_table(speeds, *basis) if as_csv else json_text(result) + "\n"
        write_result(output, text, mark="distance_m,height_m,outcome" if as_csv else '"limit_N"')
    lines = [
        *speeds.speeds.warnings,
        f"Safe speeds, {limit_words(limit, contact)}",
        f"bound: {bound}",
        "",
        *speed_map_lines(speeds),
        *next_lines(speeds),
        *([f"written to {output}"] if output else []),
        *([accuracy_words(accuracy)] if accuracy else []),
        *listing("Assumes", [*other_statements(speeds.speeds)]),
    ]
    emit(result, lines, as_json=as_json)
    raise typer.Exit(0 if speeds.fastest else 1)
