"""Options that say what a robot and its task are, and what they stand for."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from typer import Option

import forcemap as fm
from forcemap.cli.column_options import entries_of
from forcemap.cli.options import Stated, number
from forcemap.direction import RAISED_OFF_AXIS
from forcemap.dynamics.robots import ROBOTS, identified_drive_inertia

DriveInertiaOption = Annotated[
    str | None,
    Option(
        "--drive-inertia-kgm2",
        help="Inertia of the drives, a figure a joint between commas, or: identified (published, ur10e only).",
    ),
]
ToolDirection = Annotated[
    str, Option("--tool-direction", help="Where the tool's axis points: down, up, out (away from the base), or x,y,z.")
]
ToolAxis = Annotated[
    str,
    Option(
        "--tool-axis",
        help="The tool's axis in the frame of the flange: x, y, z, -x, -y, -z, or its components x,y,z. It decides how "
        "the arm stands at a place, and with that the effective mass.",
    ),
]
Tip = Annotated[
    str | None,
    Option("--tip", help="Link of a URDF whose frame is the flange; its z axis is the tool's, if not --tool-axis."),
]
Base = Annotated[str | None, Option("--base", help="Link of a URDF from which places are counted.")]

Posture = Annotated[
    str | None,
    Option(
        "--posture-deg",
        help="Positions of the joints between commas, in degrees (a sliding one in m): of this posture; with places, "
        "of the posture at each that is nearest to it.",
    ),
]
ContactOffset = Annotated[
    str | None, Option("--contact-offset-m", help="Contact point in the frame of the flange, x,y,z.")
]

_DIRECTIONS = {"down": (0.0, 0.0, -1.0), "up": (0.0, 0.0, 1.0), "out": (1.0, 0.0, 0.0)}
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def robot_from(
    name: str,
    base: str | None = None,
    tip: str | None = None,
    drive_inertia: str | None = None,
    payload: float = 0.0,
    contact_offset: str | None = None,
    tool_axis: str = "z",
    posture: str | None = None,
) -> fm.Robot:
    """The robot that the options name: one of the paper's, or FILE[:base=LINK][:tip=LINK]; with tool and payload."""
    name, *links = re.split(":(?=base=|tip=)", name)
    stated = dict(link.split("=", 1) for link in links)
    base, tip = base or stated.get("base"), tip or stated.get("tip")
    if name in ROBOTS and not Path(name).exists():
        if base is not None or tip is not None:
            raise fm.InputError(f"robot: --base and --tip go with a URDF, {name} has its own")
        robot = fm.robot_named(name)
    elif not Path(name).exists():
        raise fm.InputError(f"robot: found {name!r}, expected {', '.join(ROBOTS)} or the file of a URDF")
    else:
        robot = fm.read_urdf(name, base=base, tip=tip)
    if drive_inertia == "identified":
        robot = robot.with_drive_inertia(identified_drive_inertia(robot.name))
    elif drive_inertia is not None:
        robot = robot.with_drive_inertia(figures("drive inertia", drive_inertia))
    offset = (0.0, 0.0, 0.0) if contact_offset is None else figures("contact offset", contact_offset)
    robot = robot.with_tool(mass=payload, contact_offset=offset, axis=axis_from(tool_axis))
    return robot if posture is None else robot.with_reference(robot.from_degrees(figures("posture", posture)))


def axis_from(text: str) -> tuple[float, ...]:
    """An axis of the flange by name or by its components."""
    name = text.strip().lstrip("+-")
    if name in _AXES:
        return tuple((-1.0 if text.strip().startswith("-") else 1.0) * component for component in _AXES[name])
    return tuple(figures("tool axis (x, y, z, -x, -y, -z or x,y,z)", text))


def direction_from(what: str, text: str) -> tuple[float, ...]:
    """A direction by name or by its components."""
    return _DIRECTIONS[text] if text in _DIRECTIONS else tuple(figures(f"{what} (down, up, out or x,y,z)", text))


def figures(name: str, text: str) -> list[float]:
    """Numbers between commas."""
    try:
        return [float(part) for part in text.replace(" ", "").split(",")]
    except ValueError:
        raise fm.InputError(f"{name}: found {text!r}, expected numbers with decimal points, between commas") from None


PositionTolerance = Annotated[
    float, Option("--position-tolerance-m", help="How far the robot may be from its program; allowed for.")
]
Angle = Annotated[
    float, Option("--angle-deg", help="How far a motion may point away from the map's direction, at most 5.")
]
Acceleration = Annotated[
    float | None, Option("--acceleration-mps2", help="Along the path; default 1. A task file states its own.")
]
_LOG_HELP = (
    "How a controller's log is written, one entry each: --column position=X,Y,Z --column length_unit=mm --column "
    "time=Timestamp --column time_unit=ms; as in [recordings] of campaign.toml also sampling_rate_Hz, delimiter, "
    "decimal, header_lines; and segment."
)
_ENTRY = re.compile(r"\s*\w+\s*=.*")
PathOptions = Annotated[
    list[str] | None,
    Option(
        "--robot",
        "--contact-offset-m",
        "--column",
        metavar="NAME|URDF|X,Y,Z|KEY=VALUE",
        help="For a path of joints: ur10e, kuka-iiwa7, or the file of a URDF, as arm.urdf:base=LINK:tip=LINK; and its "
        f"contact point in the frame of the flange, x,y,z. --column: {_LOG_HELP}",
    ),
]


def path_from(file: str, stated: Sequence[str] | None = None) -> fm.ToolPath:
    """The path of a file: a controller's log with its columns, or joints with their robot and its contact point."""
    entries = [text for text in stated or () if _ENTRY.fullmatch(text)]
    columns = entries_of(entries) if entries else None
    robot = [text for text in stated or () if text not in entries]
    offsets = [text for text in robot if all(number(part) is not None for part in text.split(","))]
    names = [text for text in robot if text not in offsets]
    if len(names) > 1 or len(offsets) > 1:
        raise fm.InputError("path: found several of --robot or --contact-offset-m, expected one each")
    if not names:
        if offsets:
            raise fm.InputError("path: --contact-offset-m goes with --robot")
        return fm.read_path(file, columns=columns)
    arm = robot_from(names[0], contact_offset=offsets[0] if offsets else None)
    path = fm.read_path(file, robot=arm, columns=columns)
    return dataclasses.replace(path, of_flange=False) if offsets else path


def task_from(
    given: Stated, names: tuple[str, ...], contact: fm.Contact | None, acceleration: float | None = None
) -> fm.Task:
    """The task of a file; or one with the same area and contact on all segments of these names."""
    if given.tasks:
        if len(given.tasks) > 1 or given.names or contact is not None or acceleration is not None:
            raise fm.InputError("task: the task file states areas, contact and acceleration; give it alone")
        return fm.read_task(given.tasks[0], table=given.table)
    if given.newtons:
        raise fm.InputError("limit: a path goes with --task or --area, not with --limit-N")
    if len(given.names) != 1 or contact is None:
        raise fm.InputError(
            "task: expected --task, or --area with --contact transient (the body part can give way) or quasi-static"
        )
    fm.force_limit(given.names[0], table=given.table)
    segments = tuple(fm.TaskSegment(name, (given.names[0],), contact, math.nan) for name in dict.fromkeys(names))
    return fm.Task(segments) if acceleration is None else fm.Task(segments, acceleration)


def limits_of(
    task: fm.Task, table: fm.LimitTable | None
) -> list[tuple[fm.ForceLimit | fm.NewtonLimit | float, fm.Contact | None]]:
    """Every limit that holds somewhere in a task, with its kind of contact."""
    pairs = dict.fromkeys((area, segment.contact) for segment in task.segments for area in segment.areas)
    return [(fm.force_limit(area, table=table), contact) for area, contact in pairs]


def path_raised() -> fm.Finding:
    """On which pieces of a path the bound is raised, and that an export raises it everywhere."""
    return fm.Finding.of(fm.FindingKind.PATH_RAISED, raised=RAISED_OFF_AXIS - 1)
