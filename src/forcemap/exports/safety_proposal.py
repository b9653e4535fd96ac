"""A sheet of proposed entries for a robot's safety configuration, and what must be checked before typing them in."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from forcemap.exports.head import head_lines, one_line
from forcemap.exports.robot_table import RobotTable
from forcemap.paths.path_speeds import PathSpeeds, PieceOutcome
from forcemap.paths.task import Task

_Block = tuple[int, int, int, int, int]  # edges from, to along distance and height, and lowest speed [mm/s]
_OF_PATH = "smallest rectangle of zones that holds the path where contact is possible"
_WIDEST = "rectangle of permitted zones with the largest area times speed"


def safety_proposal(
    table: RobotTable, *, task: Task | None = None, speeds: PathSpeeds | None = None, straight: str = ""
) -> str:
    """The text of the sheet (Markdown): one speed limit for a block of zones, planes, and lines to sign.

    The block is the one that a path needs, if every zone in it is permitted, else the largest. With a task or the
    speeds of a path, it warns of the segments that would violate the entries, and says with `straight` what block
    there is for motion along the direction alone. For a path without permission somewhere there are no entries.
    """
    of_path, block = _block(table, speeds)
    lines = ["# Proposal for the safety configuration", "", *(f"- {line}" for line in head_lines(table.provenance)), ""]
    if speeds is not None and (names := _refused(speeds)):
        why = f"on {', '.join(map(one_line, names))} the map gives no permission, or not everywhere"
        return "\n".join([*lines, f"**NO ENTRIES: this path is not permitted**, {why}. Change the path first.", ""])
    if block is None:
        return "\n".join([*lines, "No zone has a permitted speed: there is nothing to configure.", ""])
    first, last, bottom, top, speed = block
    near, far = table.distance_edges[first], table.distance_edges[last]
    low, high = table.height_edges[bottom], table.height_edges[top]
    entries = [
        ("tool speed limit", speed / 1000, "m/s", "mm/s", "lowest speed of the zones below, allowance subtracted"),
        ("least distance of the contact point from the base z-axis", near, "m", "mm", "safety plane or zone"),
        ("largest distance", far, "m", "mm", "safety plane or zone"),
        ("least height above the base", low, "m", "mm", "safety plane"),
        ("largest height", high, "m", "mm", "safety plane"),
    ]
    force, fastest = min(table.provenance.limits_N), table.speed_mmps.max() / 1000
    lines += ["| entry | proposed | in vendor units | note | typed in | by, date |", "|---|---|---|---|---|---|"]
    lines += [f"| {name} | {v:.3f} {si} | {1000 * v:.0f} {unit} | {note} | | |" for name, v, si, unit, note in entries]
    lines += [
        "| force, power, momentum, stopping | as in the campaign | | the speeds above "
        f"keep the limit of {force:g} N on the body under the campaign's safety settings, not by an entry of this "
        "sheet | | |",
        "",
        f"The block is the {_OF_PATH if of_path else _WIDEST}{straight}.",
        f"It is for a program at one speed, in the place of the table of zones: it stops the table's speeds, up to "
        f"{fastest:.3f} m/s, and its zones beside the block.",
        f"With the table, a tool speed limit of {fastest:.3f} m/s stops none of its speeds, and keeps no limit of "
        "force by itself: that the zones are kept rests on the robot's program.",
        "",
        *_violations(table, block, task, speeds),
        "- [ ] the campaign's safety settings are those of this robot; changing them makes the map invalid",
        "- [ ] speeds confirmed by measurement at the places used: ______________________",
        "- [ ] checksum of the safety configuration after typing in: ______________________",
        "- [ ] released by (risk assessment): ______________________  date: ______________",
        "",
    ]
    return "\n".join(lines)


def segments_stopped(table: RobotTable, task: Task | None, speeds: PathSpeeds | None) -> list[str]:
    """Names of the segments of a task, or of a path, that the entries of the sheet would stop."""
    _, block = _block(table, speeds)
    return [] if block is None else list(dict.fromkeys(name for name, _ in _stopped(table, block, task, speeds)))


def _block(table: RobotTable, speeds: PathSpeeds | None) -> tuple[_Block | None, _Block | None]:
    """The block that a path needs, None if there is none; and that of the sheet: this one, else the widest."""
    of_path = None if speeds is None else block_of_path(table, speeds)
    return of_path, of_path or widest_block(table)


def _stopped(
    table: RobotTable, block: _Block, task: Task | None, speeds: PathSpeeds | None
) -> Iterator[tuple[str, str]]:
    """Segments that the safety configuration would stop, and why; a segment for each reason."""
    limit, segments = block[4] / 1000, list[tuple[str, float, bool, bool]]()
    if speeds is not None:
        segments = list(_driven(table, block, speeds))
    elif task is not None:
        segments = [(segment.name, segment.speed, False, segment.contact is None) for segment in task.segments]
    for name, fastest, beyond, excluded in segments:
        off = "; contact is excluded there: let what excludes it switch these entries off" * excluded
        if not fastest <= limit:
            stated = (
                "no speed is stated on it, or on a part of it"
                if math.isnan(fastest)
                else f"programmed up to {fastest:.3f} m/s"
            )
            yield name, f"{stated}, the tool speed limit is {limit:.3f} m/s{off}"
        if beyond:
            yield name, f"leaves the block of zones, so a safety plane would stop it{off}"


def _refused(speeds: PathSpeeds) -> list[str]:
    """Segments on which a path has no permission, or not everywhere."""
    return list(dict.fromkeys(np.array(speeds.path.names, dtype=object)[speeds.refused].tolist()))


def entries_of(table: RobotTable, speeds: PathSpeeds | None) -> str:
    """The block of the sheet in a line; empty without one."""
    _, block = _block(table, speeds)
    if block is None:
        return ""
    (d, d_to), (h, h_to) = table.distance_edges[list(block[:2])], table.height_edges[list(block[2:4])]
    return f"tool speed limit {block[4] / 1000:.3f} m/s, d {d:.3f} to {d_to:.3f} m, h {h:.3f} to {h_to:.3f} m"


def _violations(table: RobotTable, block: _Block, task: Task | None, speeds: PathSpeeds | None) -> list[str]:
    """Segments that the safety configuration would stop, a line each."""
    if speeds is None and task is None:
        return []
    limit = block[4] / 1000
    words = [f"- segment {one_line(name)}: {why}" for name, why in _stopped(table, block, task, speeds)]
    compared = "speeds and places" if speeds is not None else "speeds alone; give the path to compare places"
    if not words:
        return [f"No segment of the task violates these entries (compared: {compared}).", ""]
    return [
        f"**WARNING: these entries would stop the robot in its task** (compared: {compared}).",
        "",
        *words,
        "",
        f"To type them in, program at most {limit:.3f} m/s, and stay within the block; the factors of a scaling file",
        "may command more, which the speed limit would stop. One limit is for the whole block and all motion in the",
        "degrees stated above; where it is too low, only a safety function that knows places lets the factors stand.",
        "",
    ]


def _driven(table: RobotTable, block: _Block, speeds: PathSpeeds) -> Iterator[tuple[str, float, bool, bool]]:
    """Name and highest programmed speed [m/s] of segments, whether they leave the block, and contact is excluded."""
    first, last, bottom, top, _ = block
    distance, height = speeds.path.pieces.probes
    ranges = ((distance, table.distance_edges, first, last), (height, table.height_edges, bottom, top))
    outside = np.any([((p < e[a]) | (p > e[b])).any(axis=1) for p, e, a, b in ranges], axis=0)
    for name in dict.fromkeys(speeds.path.names):
        pieces = np.array([piece == name for piece in speeds.path.names])
        excluded = bool(np.all(speeds.outcome[pieces] == PieceOutcome.NO_CONTACT))
        yield name, float(speeds.programmed[pieces].max()), bool(outside[pieces].any()), excluded


def block_of_path(table: RobotTable, speeds: PathSpeeds) -> _Block | None:
    """As `widest_block`, the smallest rectangle that holds a path where contact is possible; None if the path leaves
    the zones there, a piece of it has no permission, or a zone of the rectangle has no speed."""
    ends, possible = [], speeds.outcome != PieceOutcome.NO_CONTACT
    if not possible.any() or speeds.refused.any():
        return None
    for probes, edges in zip(speeds.path.pieces.probes, (table.distance_edges, table.height_edges), strict=True):
        values = probes[possible]
        if values.min() < edges[0] or values.max() > edges[-1]:
            return None
        first = min(int(np.searchsorted(edges, values.min(), "right")) - 1, edges.size - 2)
        ends += [first, max(int(np.searchsorted(edges, values.max())), first + 1)]
    first, last, bottom, top = ends
    lowest = int(table.speed_mmps[first:last, bottom:top].min())
    return (first, last, bottom, top, lowest) if lowest else None


def widest_block(table: RobotTable) -> _Block | None:
    """Edges from, to along distance and height, and lowest speed [mm/s], of the rectangle with largest area x speed."""
    speeds = table.speed_mmps
    best, block = 0.0, None
    rows, columns = speeds.shape
    for first in range(rows):
        least = speeds[first]
        for last in range(first + 1, rows + 1):
            least = least.clip(max=speeds[last - 1])
            for bottom in range(columns):
                lowest = int(least[bottom])
                for top in range(bottom + 1, columns + 1):
                    lowest = min(lowest, int(least[top - 1]))
                    if lowest == 0:
                        break
                    wide = table.distance_edges[last] - table.distance_edges[first]
                    worth = lowest * wide * (table.height_edges[top] - table.height_edges[bottom])
                    if worth > best:
                        best, block = float(worth), (first, last, bottom, top, lowest)
    return block
