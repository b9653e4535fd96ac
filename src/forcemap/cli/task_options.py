"""Options that say what a robot's task is, and what they stand for."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from forcemap import (
    Allowance,
    Contact,
    ForceLimit,
    InputError,
    LimitTable,
    NewtonLimit,
    Robot,
    Task,
    TaskSegment,
    ToolPath,
    force_limit,
    read_limit_table,
    read_path,
    read_task,
)
from forcemap.cli.robot_options import figures, robot_from

TaskFile = Annotated[
    str | None,
    typer.Option("--task", help="Task file (TOML): segments, body areas, contact; see docs/robot_program.md."),
]
Overshoot = Annotated[
    float, typer.Option("--overshoot-mps", help="How much faster than programmed the robot may be; subtracted.")
]
PositionTolerance = Annotated[
    float, typer.Option("--position-tolerance-m", help="How far the robot may be from its program; allowed for.")
]
Acceleration = Annotated[
    float | None, typer.Option("--acceleration-mps2", help="Along the path; default 1, or as the task file says.")
]
RobotOption = Annotated[
    str | None, typer.Option("--robot", help="For a path of joints: ur10e, kuka-iiwa7, or the file of a URDF.")
]
ContactOffset = Annotated[
    str | None,
    typer.Option("--contact-offset-m", help="Contact point in the frame of the flange, x,y,z."),
]


def table_of_limits(limit_table: str | None) -> LimitTable | None:
    """The user's own table of limits, if one is named."""
    return read_limit_table(limit_table) if limit_table else None


def path_from(file: str, robot: str | None, base: str | None, tip: str | None, offset: str | None) -> ToolPath:
    """The path of a file, with the robot that moves it if it holds joints."""
    if robot is None:
        if base is not None or tip is not None or offset is not None:
            raise InputError("path: --base, --tip and --contact-offset-m go with --robot")
        return read_path(file)
    arm: Robot = robot_from(robot, base, tip, None, 0.0)
    if offset is not None:
        arm = arm.with_tool(mass=0.0, centre_of_mass=(0, 0, 0), contact_offset=figures("contact offset", offset))
    return read_path(file, robot=arm)


def task_from(
    task: str | None,
    names: tuple[str, ...],
    area: str | None,
    region: str | None,
    contact: Contact | None,
    acceleration: float | None,
    table: LimitTable | None,
) -> Task:
    """The task of a file; or one with the same area and contact on all segments of these names."""
    if task is not None:
        if area is not None or region is not None or contact is not None or acceleration is not None:
            raise InputError("task: the task file states areas, contact and acceleration; give it alone")
        return read_task(task, table=table)
    name = area or region
    if name is None or (area is not None and region is not None) or contact is None:
        raise InputError("task: expected --task, or one of --area and --region with --contact")
    force_limit(name, table=table)
    segments = tuple(TaskSegment(each, (name,), contact, math.nan) for each in dict.fromkeys(names))
    return Task(segments, 1.0 if acceleration is None else acceleration)


def limits_of(task: Task, table: LimitTable | None) -> list[tuple[ForceLimit | NewtonLimit | float, Contact | None]]:
    """Every limit that holds somewhere in a task, with its contact."""
    pairs = dict.fromkeys((area, segment.contact) for segment in task.segments for area in segment.areas)
    return [(force_limit(area, table=table), contact) for area, contact in pairs]


def allowance_from(overshoot: float, tolerance: float) -> Allowance:
    """What the robot may deviate."""
    return Allowance(speed=overshoot, position=tolerance)
