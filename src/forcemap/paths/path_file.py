"""Paths from CSV files: positions, distance and height, or joints of a robot."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.csv_table import Table, csv_text, read_table
from forcemap.dynamics.kinematics import forward_kinematics
from forcemap.dynamics.robot import JointKind, Robot
from forcemap.errors import InputError, TableError, one_line
from forcemap.files import read_bytes
from forcemap.findings import Finding, FindingKind
from forcemap.paths.full_speed import STANDS, doubts_of_full_speed, tells_of_speed
from forcemap.paths.pose_log import read_pose_log
from forcemap.paths.tool_path import FASTEST, MOST_PIECES, ONE_SEGMENT, ToolPath
from forcemap.recordings.column_map import listed

PATH_COLUMNS = "x_m,y_m,z_m,segment"
"""Columns of the paths that are written."""
PIECE_PLACES = ("from_x_m", "from_y_m", "from_z_m", "to_x_m", "to_y_m", "to_z_m")
PIECE_SPEED = "commanded_speed_mps"
"""Columns of the pieces of a scaling file: from where to where, and how fast, braking included."""

_LAYOUTS = (("x_m", "y_m", "z_m"), ("distance_m", "height_m"))
_TIME, _SPEED = "time_s", "speed_mps"
_MOTION_OF = {"speed_to_point_mps": "to_point", "speed_from_point_mps": "from_point"}  # whose speed a row states
_PACE = (_TIME, _SPEED, *_MOTION_OF)  # how fast the path is programmed: one of them
_OPTIONAL = (*_PACE, "segment")
_LOG = (
    "a log as a controller writes it needs a column map, in path and export-path (--column position=X,Y,Z --column "
    "length_unit=mm)"
)
_OTHER_UNIT = re.compile(
    r"(x|y|z|distance|height)(_(mm|cm|in|inch))?|(time|t)(_(ms|min))?|(speed|velocity)(_\w+)?", re.ASCII
)
_JOINT = re.compile(r"joint_(\d+)_(rad|deg)", re.ASCII)

_SLOWEST = 0.001  # [m/s] by the times of a path; a choice: a whole program that is slower has them in another unit

# How finely a joint motion is cut into straight pieces (docs/decisions.md).
_STRAIGHT = 1e-4  # [m]; how far it may bend away from a piece
_TURNING = 1.0  # [deg]; how far it should at most point away from a piece
_MOST_FOR_TURNING = 200  # pieces of a row that are spent on that
_TURN, _SLIDE = np.radians(5.0), 0.01  # [rad], [m]; the most that a joint moves in a piece

_JOINT_ROUNDING = 1e-6  # [rad], [m]; by which a rounded position may exceed the limit of a joint
_JOINT_STANDING = 2e-5  # [m]; motion that is shorter points anywhere, by that rounding
_FULL_TURNS = 4 * np.pi  # [rad]; a larger figure is in degrees


def read_path(path: str | Path, *, robot: Robot | None = None, columns: Mapping[str, Any] | None = None) -> ToolPath:
    """Read a path: a row for each point, with columns in one of three layouts, or the pieces of a scaling file.

    `x_m, y_m, z_m` in the frame of the base; or `distance_m, height_m`, a path in a vertical plane; or `joint_1_rad,
    joint_2_rad, ...` (or `_deg`) with a robot, whose joints move in proportion from row to row. Optional:
    `segment`, the name of the segment that begins at the point; and `time_s`, or `speed_to_point_mps`, the programmed
    speed of the contact point on the motion to the point, or `speed_from_point_mps`, on that from it, or `speed_mps`,
    where the file does not say whether it is that of the motion to a point or from it: then a motion has the faster of
    its two points' speeds, where the task's counts for an empty cell. Beside times a column such as `speed_scaling` may
    tell that they are of a run at full speed. A scaling file (`forcemap export-path`) is read as its pieces at their
    commanded speeds.

    Parameters
    ----------
    path : str or Path
        The CSV file.
    robot : Robot, optional
        The robot, for a joint trajectory.
    columns : mapping, optional
        How a controller's log of positions is written, as {"position": ["X", "Y", "Z"], "length_unit": "mm", "time":
        "Timestamp", "time_unit": "ms"}; also `segment`, and `sampling_rate_Hz`, `delimiter`, `decimal` and
        `header_lines` as for `ColumnMap`. Other columns are left alone.

    Returns
    -------
    ToolPath

    Raises
    ------
    TableError
        Not a table, an unknown or missing column, a unit other than metres, seconds, radians or degrees, a cell that
        cannot be used, or times and speeds together.
    InputError
        What the table holds is no path, times of more than 10 m/s, joints without their robot, or a column map that
        cannot be used.
    """
    if columns is not None:
        if robot is not None:
            raise InputError("path: a column map is one of positions; joints are named joint_1_rad, joint_2_rad, ...")
        points, clock, labels, doubts = read_pose_log(read_bytes(path), str(path), columns)
        logged = _path_through(points, tuple(labels or [ONE_SEGMENT] * len(points)), clock, str(path))
        return replace(logged, end_name=labels[-1] if labels else "", doubts=doubts, logged=True)
    try:
        table = read_table(read_bytes(path), str(path), what="point", remarked=True)
    except TableError as error:
        hint = f"; {_LOG}" if error.row else ""
        raise TableError(f"{error.message}{hint}", file=error.file, row=error.row, column=error.column) from None
    if {*PIECE_PLACES, PIECE_SPEED, "segment"} <= set(table.columns):
        return _of_pieces(table)
    joints = [name for name in table.columns if _JOINT.fullmatch(name)]
    layout = tuple(joints) or next((columns for columns in _LAYOUTS if set(columns) <= set(table.columns)), ())
    _check_columns(table, layout)
    table = table.with_decimal_points([*layout, *_PACE])
    values = np.array([table.numbers(name, required=True) for name in layout]).T
    time = np.array(table.numbers(_TIME, required=True)) if _TIME in table.columns else None
    if time is not None and (back := np.flatnonzero(~(np.diff(time) > 0))).size:
        row = int(back[0]) + 1
        found = f"found {table.columns[_TIME][row]}, expected a time after that of the row above"
        raise table.error(found, table.rows[row], _TIME)
    if len(values) < 2:
        raise TableError(f"found {len(values)} points, expected at least two", file=str(path))
    speeds, by_one = _stated_speeds(table)
    motion = next((motion for name, motion in _MOTION_OF.items() if name in table.columns), "")
    *names, end_name = table.columns.get("segment", [ONE_SEGMENT] * len(values))
    if "" in names:
        row = table.rows[names.index("")]
        expected = "expected that of the segment whose motion begins at this row"
        raise TableError(f"found no name, {expected}", file=str(path), row=row, column="segment")
    try:
        if joints:
            bent = _joint_path(table, joints, values, tuple(names), time, robot, speeds, by_one)
            bent = replace(bent, of_flange=robot is not None and not np.any(robot.contact_offset))
            doubts = _doubts(table, bent.points, values, np.degrees(STANDS) if joints[0].endswith("deg") else STANDS)
            return replace(bent, end_name=end_name, speeds_of=motion, doubts=doubts)
        points = values if len(layout) == 3 else np.column_stack([values[:, 0], np.zeros(len(values)), values[:, 1]])
        if len(layout) == 2 and np.any(values[:, 0] < 0):
            raise InputError("distance_m: found a negative distance, expected at least 0")
    except TableError:
        raise
    except InputError as error:
        raise InputError(error.message, file=str(path)) from None
    straight = _path_through(points, (*names, ""), time, str(path), speeds)
    doubts = _doubts(table, straight.points, points, STANDS)
    return replace(straight, by_one=by_one, end_name=end_name, speeds_of=motion, doubts=doubts)


def _doubts(table: Table, points: FloatArray, rows: FloatArray, stands: float) -> tuple[Finding, ...]:
    """What has to be known of the speeds of a path through points, by how the rows of its file state them."""
    told = [(name, cells) for name, cells in table.columns.items() if tells_of_speed(name)]
    slowed = doubts_of_full_speed(told, rows, log=False, stands=stands) if _TIME in table.columns else ()
    return (*_way_back(table, points), *slowed)


def _way_back(table: Table, points: FloatArray) -> tuple[Finding, ...]:
    """That the motion back to the first row is not looked at, where that states the speed of the motion to it."""
    stated = table.columns.get("speed_to_point_mps", [""])[0].strip()
    apart = float(np.linalg.norm(points[-1] - points[0]))
    back = Finding.of(FindingKind.WAY_BACK, speed=stated, apart_m=apart)
    return (back,) if stated and apart > _STRAIGHT else ()


def _stated_speeds(table: Table) -> tuple[FloatArray | None, Mask | None]:
    """Programmed speed of each motion between two rows [m/s], NaN where none is stated, and where just one of its two
    rows states one of which nothing says whether it is of the motion to it or from it; None if no motion has it."""
    first, *others = [name for name in _PACE if name in table.columns] or [_TIME]
    if others:
        raise table.error(f"found it beside {first}, expected one of them", table.header_row, others[0])
    if first == _TIME:
        return None, None
    speeds = np.array(table.numbers(first, required=False))
    wrong = ~(np.isnan(speeds) | ((speeds > 0) & (speeds <= FASTEST)))
    if wrong.any():
        row = int(np.argmax(wrong))
        expected = f"expected a positive number of at most {FASTEST:g} m/s, or nothing"
        raise table.error(f"found {table.columns[first][row]!r}, {expected}", table.rows[row], first)
    before, after = speeds[:-1], speeds[1:]
    if first in _MOTION_OF:
        own = after if _MOTION_OF[first] == "to_point" else before
        return None if np.isnan(own).all() else own, None
    faster, by_one = np.fmax(before, after), np.isnan(before) != np.isnan(after)
    return (None, None) if np.isnan(faster).all() else (faster, by_one if by_one.any() else None)


def _of_pieces(table: Table) -> ToolPath:
    """The path of a scaling file at its commanded speeds."""
    table = table.with_decimal_points([*PIECE_PLACES, PIECE_SPEED])
    places = np.array([table.numbers(name, required=True) for name in PIECE_PLACES]).T
    begins, ends, speeds = places[:, :3], places[:, 3:], np.array(table.numbers(PIECE_SPEED, required=True))
    if (apart := np.flatnonzero((begins[1:] != ends[:-1]).any(axis=1))).size:
        problem = "the piece does not begin where the one before ends, expected all pieces of a path in their order"
        raise table.error(problem, table.rows[int(apart[0]) + 1], PIECE_PLACES[0])
    if (none := np.flatnonzero(~((speeds > 0) & (speeds <= FASTEST)))).size:
        expected = (
            f"expected a positive number of at most {FASTEST:g} m/s: a piece without a speed has no permission, or "
        )
        expected += "stands before one; mend the path that the factors are of, and write them again"
        found = table.columns[PIECE_SPEED][none[0]]
        raise table.error(f"found {found!r}, {expected}", table.rows[int(none[0])], PIECE_SPEED)
    points, names = np.vstack([begins[:1], ends]), (*table.columns["segment"], "")
    return replace(_path_through(points, names, None, table.file, speeds), speeds_of="to_point")


def _path_through(
    points: FloatArray, names: tuple[str, ...], time: FloatArray | None, file: str, speeds: FloatArray | None = None
) -> ToolPath:
    """The path through points [m], with the name of the segment that begins at each."""
    if len(points) < 2:
        raise TableError(f"found {len(points)} points, expected at least two", file=file)
    try:
        if time is not None:
            return _paced(ToolPath.timed(points, names, time, file))
        return ToolPath(points, names[:-1], None, file, stated_speeds=speeds)
    except InputError as error:
        raise InputError(error.message, file=file) from None


def _paced(path: ToolPath) -> ToolPath:
    """The same timed path; InputError where its times leave no speed that a robot has."""
    speeds = path.speeds
    assert speeds is not None
    if speeds.max() > FASTEST:
        found = f"path: found {speeds.max():.4g} m/s between two rows by their times, expected at most {FASTEST:g} m/s"
        raise InputError(
            f"{found}; times are in seconds, positions in metres, and a log of other units states them (--column "
            "time_unit=ms, length_unit=mm)"
        )
    if speeds.max() < _SLOWEST:
        found = f"path: found at most {speeds.max():.2g} m/s between two rows by their times, expected {_SLOWEST:g} m/s"
        raise InputError(f"{found} and more: are the times in seconds (of a log: --column time_unit=ms)?")
    return path


MADE = "made by forcemap"
"""What stands above a path that was written here, so that no other file is replaced."""


def moved_csv(file: str, distance: float, height: float) -> str:
    """The text of a path file moved outwards and in height [m], with everything else that it states, times and speeds.

    Raises
    ------
    InputError
        The file states no positions, as one of joint angles; `TableError` as `read_path`.
    """
    table = read_table(read_bytes(file), file, what="point", remarked=True)
    table = table.with_decimal_points([name for name in table.columns if name != "segment"])
    moved = dict(table.columns)
    if not (places := moved.keys() & _MOVED.keys()):
        raise InputError(f"found no positions to move, expected {listed([*_MOVED])}", file=file)
    for name in places:
        shift = _MOVED[name] * np.array([distance, height])
        moved[name] = [repr(round(x + float(shift.sum()), 9)) for x in table.numbers(name, required=True)]
    said = f"# {MADE}: {one_line(Path(file).name)} moved by {distance:g} m outwards and {height:g} m up"
    return f"{said}\n{csv_text(moved)}"


_OUTWARDS, _UP = np.array([1.0, 0.0]), np.array([0.0, 1.0])
_MOVED = dict.fromkeys(("x_m", "distance_m", *PIECE_PLACES[::3]), _OUTWARDS)
_MOVED |= dict.fromkeys(("z_m", "height_m", *PIECE_PLACES[2::3]), _UP)
"""Columns that move with the table, and which way."""


def path_csv(path: ToolPath) -> str:
    """The text of a path file, positions to 1e-6 m; without the times or speeds that the path states."""
    rows = zip(path.points.tolist(), (*path.names, path.names[-1]), strict=True)
    columns = list(zip(*((*(f"{round(x, 6) + 0.0:.6f}" for x in point), name) for point, name in rows), strict=True))
    return f"# {MADE}\n{csv_text(dict(zip(PATH_COLUMNS.split(','), map(list, columns), strict=True)))}"


def _check_columns(table: Table, layout: tuple[str, ...]) -> None:
    known = {*layout, *_OPTIONAL, *(filter(tells_of_speed, table.columns) if _TIME in table.columns else ())}
    unknown = sorted((name for name in table.columns if name not in known), key=lambda n: not _OTHER_UNIT.fullmatch(n))
    if unknown and _OTHER_UNIT.fullmatch(unknown[0]):
        raise TableError(
            "found a column without its unit, or in another one; expected metres (x_m, y_m, z_m, or distance_m, "
            f"height_m), seconds (time_s) and metres per second ({', '.join((_SPEED, *_MOTION_OF))}); {_LOG}",
            file=table.file,
            row=table.header_row,
            column=unknown[0],
        )
    if unknown and (layout or not set(unknown) & {name for columns in _LAYOUTS for name in columns}):
        found = listed(list(table.columns))
        expected = f"expected x_m, y_m, z_m, or distance_m, height_m, and {', '.join(_OPTIONAL)}"
        message = f"unknown column; found {found}, {expected}; {_LOG}"
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
    speeds: FloatArray | None,
    by_one: Mask | None,
) -> ToolPath:
    """The path of the contact point, cut where joint motion would bend away from a straight piece."""
    if robot is None:
        raise InputError("joints: the path holds joint positions, name their robot (--robot, a preset or a URDF file)")
    n = len(robot.joints)
    units = {name.rpartition("_")[2] for name in joints}
    if len(units) > 1 or sorted(int(name.split("_")[1]) for name in joints) != list(range(1, n + 1)):
        raise InputError(f"joints: expected joint_1 to joint_{n} of {robot.name}, all in _rad or all in _deg")
    (unit,) = units
    q = values[:, np.argsort([int(name.split("_")[1]) for name in joints])]
    if unit == "rad" and np.abs(q).max() > _FULL_TURNS:
        raise InputError(f"joints: found {np.abs(q).max():g} rad, more than two turns; is the file in degrees?")
    q = np.radians(q) if unit == "deg" else q
    beyond = (q < robot.lower - _JOINT_ROUNDING) | (q > robot.upper + _JOINT_ROUNDING)
    if beyond.any():
        row, joint = np.argwhere(beyond)[0]
        raise TableError(
            f"found a position beyond the limits of {robot.name}", file=table.file, row=table.rows[row],
            column=f"joint_{joint + 1}_{unit}",
        )  # fmt: skip
    slides = np.array([joint.kind is JointKind.PRISMATIC for joint in robot.joints])
    bend = _bends(robot, q, slides)
    counts = _straight_pieces(robot, q, slides, bend)
    if counts.sum() > MOST_PIECES:
        raise InputError(
            f"joints: the motion bends so much that {MOST_PIECES:,} straight pieces do not follow it within "
            f"{1000 * _STRAIGHT:g} mm; give rows closer together, and check the units of the joints"
        )
    row = np.repeat(np.arange(len(q) - 1), counts)
    share = (np.arange(row.size) - (np.cumsum(counts) - counts)[row]) / counts[row]
    moving = q[row] + np.diff(q, axis=0)[row] * share[:, None]
    points = forward_kinematics(robot, np.vstack([moving, q[-1:]])).position
    clock = np.arange(len(q), dtype=np.float64) if time is None else time
    if not (np.isfinite(clock).all() and np.all(np.diff(clock) > 0)):
        raise InputError("path: expected times that are finite and rise from row to row")
    times = np.append(clock[row] + np.diff(clock)[row] * share, clock[-1])
    of_rows = np.append(row, row[-1])
    path = ToolPath.timed(points, (*(names[i] for i in row), ""), times, table.file, of_rows, standing=_JOINT_STANDING)
    assert path.rows is not None
    # An arc of height e leaves its chord l at most by the angle whose sine is 4 e / l.
    ratio = 4 * (bend / (8 * counts**2))[path.rows] / path.lengths
    turning = np.where(ratio < 1, np.degrees(np.arcsin(np.minimum(ratio, 1.0))), 180.0)
    path = replace(path, deviation=_STRAIGHT, turning=turning)
    if time is not None:
        return _paced(path)
    stated, ends = None if speeds is None else speeds[path.rows], None if by_one is None else by_one[path.rows]
    return replace(path, time=None, wait=None, rows=None, stated_speeds=stated, by_one=ends)


def _bends(robot: Robot, q: FloatArray, slides: Mask) -> FloatArray:
    """Largest second derivative of the contact point's path over each joint motion [m], shape (rows - 1,).

    While the joints move by D, the second derivatives of the contact point p are a_i x dp/dq_j for a turning joint i up
    to j, so |p''| <= sum_j D_j L_j (D_j + 2 sum_i<j D_i) over turning joints, with L_j the longest lever of joint j: a
    proof, where samples of a symmetric motion may all lie on the chord.
    """
    tip = robot.flange.position + robot.flange.rotation @ robot.contact_offset
    links = [float(np.linalg.norm(joint.origin.position)) for joint in robot.joints[1:]]
    reach = np.append(links, np.linalg.norm(tip))  # from each joint's frame to the next one
    reach[:-1] += np.where(slides, np.abs(q).max(axis=0), 0.0)[1:]
    lever = np.where(slides, 1.0, np.cumsum(reach[::-1])[::-1])
    moved = np.abs(np.diff(q, axis=0))
    turned = np.where(slides, 0.0, moved)
    return np.asarray(np.sum(moved * lever * (2 * np.cumsum(turned, axis=1) - turned), axis=1))


def _straight_pieces(robot: Robot, q: FloatArray, slides: Mask, bend: FloatArray) -> Indices:
    """Into how many equal parts each joint motion is cut so that none bends away from its chord, shape (rows - 1,).

    The contact point stays within max |p''| / 8 of the chord of a part, and its motion points away from the chord by at
    most max |p''| / 2 over the chord's length.
    """
    moved = np.abs(np.diff(q, axis=0))
    lengths = np.linalg.norm(np.diff(forward_kinematics(robot, q).position, axis=0), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.nan_to_num(bend / (2 * np.tan(np.radians(_TURNING)) * lengths), posinf=_MOST_FOR_TURNING)
    parts = np.maximum(np.sqrt(bend / (8 * _STRAIGHT)), (moved / np.where(slides, _SLIDE, _TURN)).max(axis=1))
    parts = np.maximum(parts, np.minimum(turned, _MOST_FOR_TURNING))
    return np.asarray(np.maximum(1, np.ceil(np.minimum(parts, 2 * MOST_PIECES) - 1e-9)), dtype=np.int64)
