"""Paths from CSV files: positions, distance and height, or joints of a robot."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcemap.campaigns.table import Table, read_table
from forcemap.dynamics.kinematics import forward_kinematics
from forcemap.dynamics.robot import Robot
from forcemap.errors import InputError, TableError
from forcemap.files import read_bytes
from forcemap.paths.tool_path import ToolPath

FloatArray = NDArray[np.float64]

_LAYOUTS = (("x_m", "y_m", "z_m"), ("distance_m", "height_m"))
_OPTIONAL = ("time_s", "segment")
_OTHER_UNIT = re.compile(r"(x|y|z|distance|height)(_(mm|cm|in|inch))?|(time|t)(_(ms|min))?", re.ASCII)
_JOINT = re.compile(r"joint_(\d+)_(rad|deg)", re.ASCII)
_STRAIGHT = 1e-4  # [m]; how far a joint motion may bend away from the piece that stands for it
_HALVINGS = 8
_FULL_TURNS = 4 * np.pi  # [rad]; beyond it a figure in radians is in degrees


def read_path(path: str | Path, *, robot: Robot | None = None) -> ToolPath:
    """Read a path: a row for each point, with columns in one of three layouts.

    `x_m, y_m, z_m` in the frame of the base; or `distance_m, height_m`, a path in a vertical plane; or `joint_1_rad,
    joint_2_rad, ...` (or `_deg`) with a robot, whose joints move in proportion from row to row. Optional: `time_s`, and
    `segment`, the name of the segment that begins at the point.

    Parameters
    ----------
    path : str or Path
        The CSV file.
    robot : Robot, optional
        The robot, for a joint trajectory.

    Returns
    -------
    ToolPath

    Raises
    ------
    TableError
        Not a table, an unknown or missing column, a unit other than metres, seconds, radians or degrees, or a cell
        that cannot be used.
    InputError
        What the table holds is no path, or joints without their robot.
    """
    table = read_table(read_bytes(path), str(path), what="point")
    joints = [name for name in table.columns if _JOINT.fullmatch(name)]
    layout = tuple(joints) or next((each for each in _LAYOUTS if set(each) <= set(table.columns)), ())
    _check_columns(table, layout)
    table = table.with_decimal_points([*layout, "time_s"])
    values = np.array([table.numbers(name, required=True) for name in layout]).T
    time = np.array(table.numbers("time_s", required=True)) if "time_s" in table.columns else None
    if len(values) < 2:
        raise TableError(f"found {len(values)} points, expected at least two", file=str(path))
    names = table.columns.get("segment", ["path"] * len(values))[:-1]
    if "" in names:
        row = table.rows[names.index("")]
        raise TableError("found no name, expected the segment's", file=str(path), row=row, column="segment")
    try:
        if joints:
            return _joint_path(table, joints, values, tuple(names), time, robot)
        points = values if len(layout) == 3 else np.column_stack([values[:, 0], np.zeros(len(values)), values[:, 1]])
        if len(layout) == 2 and np.any(values[:, 0] < 0):
            raise InputError("distance_m: found a negative distance, expected at least 0")
        if time is not None:
            return ToolPath.timed(points, (*names, ""), time, str(path))
        return ToolPath(points, tuple(names), None, str(path))
    except TableError:
        raise
    except InputError as error:
        raise InputError(error.message, file=str(path)) from None


def _check_columns(table: Table, layout: tuple[str, ...]) -> None:
    known = {*layout, *_OPTIONAL}
    unknown = sorted((name for name in table.columns if name not in known), key=lambda n: not _OTHER_UNIT.fullmatch(n))
    if unknown and _OTHER_UNIT.fullmatch(unknown[0]):
        raise TableError(
            "found a column without its unit, or in another one; expected metres (x_m, y_m, z_m, or distance_m, "
            "height_m) and seconds (time_s)",
            file=table.file,
            row=table.header_row,
            column=unknown[0],
        )
    if unknown and (layout or not set(unknown) & {name for each in _LAYOUTS for name in each}):
        message = f"unknown column; expected x_m, y_m, z_m, or distance_m, height_m, and {', '.join(_OPTIONAL)}"
        raise TableError(message, file=table.file, row=table.header_row, column=unknown[0])
    if not layout:
        message = "found no positions, expected the columns x_m, y_m, z_m, or distance_m, height_m, or joint_1_rad, ..."
        raise TableError(message, file=table.file, row=table.header_row)


def _joint_path(
    table: Table,
    joints: list[str],
    values: FloatArray,
    names: tuple[str, ...],
    time: FloatArray | None,
    robot: Robot | None,
) -> ToolPath:
    """The path of the contact point, cut where joint motion would bend away from a straight piece."""
    if robot is None:
        raise InputError("joints: the path holds joint positions, name their robot (--robot or --urdf)")
    n = len(robot.joints)
    units = {name.rpartition("_")[2] for name in joints}
    if len(units) > 1 or sorted(int(name.split("_")[1]) for name in joints) != list(range(1, n + 1)):
        raise InputError(f"joints: expected joint_1 to joint_{n} of {robot.name}, all in _rad or all in _deg")
    (unit,) = units
    q = values[:, np.argsort([int(name.split("_")[1]) for name in joints])]
    if unit == "rad" and np.abs(q).max() > _FULL_TURNS:
        raise InputError(f"joints: found {np.abs(q).max():g} rad, more than two turns; is the file in degrees?")
    q = np.radians(q) if unit == "deg" else q
    if np.any(q < robot.lower - 1e-6) or np.any(q > robot.upper + 1e-6):
        row, joint = np.argwhere((q < robot.lower - 1e-6) | (q > robot.upper + 1e-6))[0]
        raise TableError(
            f"found a position beyond the limits of {robot.name}", file=table.file, row=table.rows[row],
            column=f"joint_{joint + 1}_{unit}",
        )  # fmt: skip
    share = np.zeros(1)
    for _ in range(_HALVINGS):  # until the middle of every piece of joint motion lies on the straight piece
        share = np.linspace(0, 1, 2 * share.size + 1)[:-1]
        fine = q[:-1, None] + (q[1:] - q[:-1])[:, None] * share[:, None]
        points = np.vstack([forward_kinematics(robot, fine.reshape(-1, n)).position, _end(robot, q)])
        middles = (points[:-2:2] + points[2::2]) / 2
        if np.linalg.norm(points[1:-1:2] - middles, axis=1).max() < _STRAIGHT:
            break
    count = share.size
    every = tuple(name for name in names for _ in range(count))
    if time is None:
        return ToolPath(points, every, None, table.file)
    times = np.append((time[:-1, None] + np.diff(time)[:, None] * share).ravel(), time[-1])
    return ToolPath.timed(points, (*every, ""), times, table.file)


def _end(robot: Robot, q: FloatArray) -> FloatArray:
    return forward_kinematics(robot, q[-1:]).position
