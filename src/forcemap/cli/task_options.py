"""Options that say what a robot and its task are, and what they stand for."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated

from typer import Option

import forcemap as fm
from forcemap.cli.options import Stated

DriveInertiaOption = Annotated[
    str | None,
    Option(
        "--drive-inertia-kgm2",
        help="Inertia of the drives, a figure a joint between commas, or: identified (published, ur10e only).",
    ),
]
ToolDirection = Annotated[
    str, Option("--tool-direction", help="Where the flange points: down, out (away from the base), or x,y,z.")
]
Tip = Annotated[str | None, Option("--tip", help="Link of a URDF that is the flange.")]
Base = Annotated[str | None, Option("--base", help="Link of a URDF from which places are counted.")]

_DIRECTIONS = {"down": (0.0, 0.0, -1.0), "up": (0.0, 0.0, 1.0), "out": (1.0, 0.0, 0.0)}


def robot_from(name: str, base: str | None, tip: str | None, drive_inertia: str | None, payload: float) -> fm.Robot:
    """The robot that the options name: one of the paper's, or that of a URDF, with a payload at its flange."""
    if name in fm.ROBOTS and not Path(name).exists():
        if base is not None or tip is not None:
            raise fm.InputError(f"robot: --base and --tip go with a URDF, {name} has its own")
        robot = fm.robot_named(name)
    elif not Path(name).exists():
        raise fm.InputError(f"robot: found {name!r}, expected {', '.join(fm.ROBOTS)} or the file of a URDF")
    else:
        robot = fm.read_urdf(name, base=base, tip=tip)
    if drive_inertia == "identified":
        robot = robot.with_drive_inertia(fm.identified_drive_inertia(robot.name))
    elif drive_inertia is not None:
        robot = robot.with_drive_inertia(figures("drive inertia", drive_inertia))
    return robot.with_payload(mass=payload, centre_of_mass=(0.0, 0.0, 0.0)) if payload else robot


def direction_from(what: str, text: str) -> tuple[float, ...]:
    """A direction by name or by its components."""
    return _DIRECTIONS[text] if text in _DIRECTIONS else tuple(figures(f"{what} (down, up, out or x,y,z)", text))


def figures(name: str, text: str) -> list[float]:
    """Numbers between commas."""
    try:
        return [float(part) for part in text.replace(" ", "").split(",")]
    except ValueError:
        raise fm.InputError(f"{name}: found {text!r}, expected numbers with decimal points, between commas") from None


Overshoot = Annotated[
    float, Option("--overshoot-mps", help="How much faster than programmed the robot may be; subtracted.")
]
PositionTolerance = Annotated[
    float, Option("--position-tolerance-m", help="How far the robot may be from its program; allowed for.")
]
Angle = Annotated[
    float, Option("--angle-deg", help="How far a motion may point away from the map's direction, at most 5.")
]
Acceleration = Annotated[
    float | None, Option("--acceleration-mps2", help="Along the path; default 1, or as the task file says.")
]
RobotOption = Annotated[
    str | None,
    Option(
        "--robot",
        metavar="NAME|URDF",
        help="For a path of joints: ur10e, kuka-iiwa7, or the file of a URDF, as arm.urdf:base=LINK:tip=LINK.",
    ),
]
ContactOffset = Annotated[
    str | None, Option("--contact-offset-m", help="Contact point in the frame of the flange, x,y,z.")
]


def path_from(file: str, robot: str | None = None, offset: str | None = None) -> fm.ToolPath:
    """The path of a file, with the robot that moves it if it holds joints."""
    if robot is None:
        if offset is not None:
            raise fm.InputError("path: --contact-offset-m goes with --robot")
        return fm.read_path(file)
    name, *links = re.split(":(?=base=|tip=)", robot)
    stated = dict(link.split("=", 1) for link in links)
    arm: fm.Robot = robot_from(name, stated.get("base"), stated.get("tip"), None, 0.0)
    if offset is not None:
        arm = arm.with_tool(mass=0.0, centre_of_mass=(0, 0, 0), contact_offset=figures("contact offset", offset))
    return fm.read_path(file, robot=arm)


def task_from(
    given: Stated, names: tuple[str, ...], contact: fm.Contact | None, acceleration: float | None = None
) -> fm.Task:
    """The task of a file; or one with the same area and contact on all segments of these names."""
    if given.tasks:
        if len(given.tasks) > 1 or given.names or contact is not None or acceleration is not None:
            raise fm.InputError("task: the task file states areas, contact and acceleration; give it alone")
        return fm.read_task(given.tasks[0], table=given.table)
    if given.newtons:
        raise fm.InputError("limit: a path goes with --task, --area or --region, not with --limit-N")
    if len(given.names) != 1 or contact is None:
        raise fm.InputError("task: expected --task, or one of --area and --region with --contact")
    fm.force_limit(given.names[0], table=given.table)
    segments = tuple(fm.TaskSegment(each, (given.names[0],), contact, math.nan) for each in dict.fromkeys(names))
    return fm.Task(segments, 1.0 if acceleration is None else acceleration)


def limits_of(
    task: fm.Task, table: fm.LimitTable | None
) -> list[tuple[fm.ForceLimit | fm.NewtonLimit | float, fm.Contact | None]]:
    """Every limit that holds somewhere in a task, with its contact."""
    pairs = dict.fromkeys((area, segment.contact) for segment in task.segments for area in segment.areas)
    return [(fm.force_limit(area, table=table), contact) for area, contact in pairs]
