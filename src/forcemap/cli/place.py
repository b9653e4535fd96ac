"""forcemap place."""

from __future__ import annotations

from typing import Annotated

import typer

from forcemap import map_sha256, place_task, table_positions
from forcemap.cli.options import (
    Area,
    BoundOption,
    Confidence,
    ContactKind,
    Content,
    DeviceSpring,
    FormName,
    Json,
    LimitTable,
    Margin,
    Region,
    Source,
    bound_from,
    force_map_from,
)
from forcemap.cli.output import Progress, emit
from forcemap.cli.path_results import places_lines, places_result, simulated_line
from forcemap.cli.task_options import (
    Acceleration,
    Overshoot,
    PositionTolerance,
    TaskFile,
    allowance_from,
    path_from,
    table_of_limits,
    task_from,
)


def place(
    source: Source,
    file: Annotated[
        str, typer.Argument(metavar="PATH", help="Path (CSV) in the frame of the table: x_m outwards, y_m, z_m up.")
    ],
    task: TaskFile = None,
    area: Area = None,
    region: Region = None,
    contact: ContactKind = None,
    limit_table: LimitTable = None,
    acceleration: Acceleration = None,
    step: Annotated[float, typer.Option("--step-m", help="Distance between positions of the table.")] = 0.05,
    overshoot: Overshoot = 0.01,
    tolerance: PositionTolerance = 0.005,
    bound_kind: BoundOption = None,
    margin: Margin = None,
    confidence: Confidence = None,
    content: Content = None,
    form: FormName = None,
    device_spring: DeviceSpring = None,
    as_json: Json = False,
) -> None:
    """Find where to put the table: the cycle time of a task at every position in the measured range.

    Exit code 1 if no position permits the whole path; then it says why.

    Example: forcemap place impacts.csv table_path.csv --area back_of_hand --contact transient --step-m 0.1
    """
    force_map, _ = force_map_from(source, form, device_spring)
    bound = bound_from(force_map, bound_kind, margin, confidence, content)
    tool_path = path_from(file, None, None, None, None)
    table = table_of_limits(limit_table)
    distance, height = table_positions(force_map, tool_path, step)
    with Progress("positions", distance.size * height.size) as progress:
        places = place_task(
            force_map,
            tool_path,
            task_from(task, tool_path.names, area, region, contact, acceleration, table),
            bound=bound,
            step=step,
            allowance=allowance_from(overshoot, tolerance),
            table=table,
            progress=progress.show,
        )
    lines = [*simulated_line(places.statements), *places.closest_speeds.warnings, *places_lines(places)]
    basis = {"bound": bound.describe(), "map_sha256": map_sha256(force_map)}
    emit(places_result(places) | basis, lines, as_json=as_json)
    raise typer.Exit(0 if places.best else 1)
