"""forcemap path."""

from __future__ import annotations

from typing import Annotated

import typer

from forcemap import WIDEST_ANGLE, map_sha256, path_speeds
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
from forcemap.cli.output import emit
from forcemap.cli.path_results import path_lines, path_result, simulated_line
from forcemap.cli.robot_options import Base, Tip
from forcemap.cli.task_options import (
    Acceleration,
    ContactOffset,
    Overshoot,
    PositionTolerance,
    RobotOption,
    TaskFile,
    allowance_from,
    path_from,
    table_of_limits,
    task_from,
)


def path(
    source: Source,
    file: Annotated[str, typer.Argument(metavar="PATH", help="Path (CSV): x_m, y_m, z_m in the frame of the base.")],
    task: TaskFile = None,
    area: Area = None,
    region: Region = None,
    contact: ContactKind = None,
    limit_table: LimitTable = None,
    acceleration: Acceleration = None,
    step: Annotated[float, typer.Option("--step-m", help="Longest piece that gets one speed.")] = 0.02,
    angle: Annotated[
        float, typer.Option("--angle-deg", help="How far a motion may point away from the map's direction, at most 5.")
    ] = WIDEST_ANGLE,
    overshoot: Overshoot = 0.01,
    tolerance: PositionTolerance = 0.005,
    robot: RobotOption = None,
    base: Base = None,
    tip: Tip = None,
    offset: ContactOffset = None,
    bound_kind: BoundOption = None,
    margin: Margin = None,
    confidence: Confidence = None,
    content: Content = None,
    form: FormName = None,
    device_spring: DeviceSpring = None,
    as_json: Json = False,
) -> None:
    """Give the speeds allowed along a path, where it must slow down and why, and the cycle time.

    Exit code 0 if every piece is permitted and none is programmed too fast (or no speed is programmed, which is said);
    1 if a piece has no permission or is programmed too fast.

    Example: forcemap path impacts.csv path.csv --task task.toml
    """
    force_map, _ = force_map_from(source, form, device_spring)
    bound = bound_from(force_map, bound_kind, margin, confidence, content)
    tool_path = path_from(file, robot, base, tip, offset)
    table = table_of_limits(limit_table)
    speeds = path_speeds(
        force_map,
        tool_path,
        task_from(task, tool_path.names, area, region, contact, acceleration, table),
        bound=bound,
        allowance=allowance_from(overshoot, tolerance),
        step=step,
        angle=angle,
        table=table,
    )
    basis = {"bound": bound.describe(), "map_sha256": map_sha256(force_map)}
    lines = [f"Allowed speeds along {file}: {len(speeds.path)} pieces, {speeds.path.lengths.sum():.3f} m", ""]
    lines = [*simulated_line(speeds.statements), *speeds.warnings, *lines, *path_lines(speeds)]
    emit(path_result(speeds) | basis, lines, as_json=as_json)
    raise typer.Exit(1 if speeds.too_fast.any() else 0)
