"""Options that name a robot and how it stands, and what they stand for."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from forcemap import ROBOTS, InputError, Robot, identified_drive_inertia, read_urdf, robot_named

DriveInertiaOption = Annotated[
    str | None,
    typer.Option(
        "--drive-inertia-kgm2",
        help="Inertia of the drives, a figure a joint between commas, or: identified (published, ur10e only).",
    ),
]
ToolDirection = Annotated[
    str, typer.Option("--tool-direction", help="Where the flange points: down, out (away from the base), or x,y,z.")
]
Tip = Annotated[str | None, typer.Option("--tip", help="Link of a URDF that is the flange.")]
Base = Annotated[str | None, typer.Option("--base", help="Link of a URDF from which places are counted.")]

_DIRECTIONS = {"down": (0.0, 0.0, -1.0), "up": (0.0, 0.0, 1.0), "out": (1.0, 0.0, 0.0)}


def robot_from(name: str, base: str | None, tip: str | None, drive_inertia: str | None, payload: float) -> Robot:
    """The robot that the options name: one of the paper's, or that of a URDF, with a payload at its flange."""
    if name in ROBOTS and not Path(name).exists():
        if base is not None or tip is not None:
            raise InputError(f"robot: --base and --tip go with a URDF, {name} has its own")
        robot = robot_named(name)
    elif not Path(name).exists():
        raise InputError(f"robot: found {name!r}, expected {', '.join(ROBOTS)} or the file of a URDF")
    else:
        robot = read_urdf(name, base=base, tip=tip)
    if drive_inertia == "identified":
        robot = robot.with_drive_inertia(identified_drive_inertia(robot.name))
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
        raise InputError(f"{name}: found {text!r}, expected numbers with decimal points, between commas") from None
