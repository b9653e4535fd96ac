"""forcemap export and export-path: tables of places, what a robot's program takes for one path."""

from __future__ import annotations

import math
import os
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Argument, Option

import forcemap as fm
from forcemap.answers.path import PathAnswer
from forcemap.campaigns.point_list import POINTS_FILE
from forcemap.cli import options
from forcemap.cli.output import (
    GRID_MARKS,
    MOST_DISTANCES,
    counted,
    emit,
    grid,
    json_text,
    shown,
    speed_cell,
    verdict_first,
    write_result,
)
from forcemap.cli.path import refusal_lines
from forcemap.cli.task_options import (
    Acceleration,
    Angle,
    PathOptions,
    PositionTolerance,
    limits_of,
    path_from,
    path_raised,
    task_from,
)
from forcemap.comparisons.beside_standard import standard_speed
from forcemap.direction import WIDEST_ANGLE, raised_off_axis
from forcemap.errors import InputError, one_line
from forcemap.exports.directed_tables import DirectedTables, directed_csv, directed_result, directed_tables
from forcemap.exports.krl import krl_along_data, krl_along_source, krl_data, krl_source
from forcemap.exports.robot_table import Provenance, RobotTable
from forcemap.exports.safety_proposal import block_of_path, entries_of, safety_proposal, segments_stopped
from forcemap.exports.scaling import scaling_csv, scaling_result
from forcemap.exports.urscript import urscript, urscript_along
from forcemap.exports.zones import zones_csv, zones_result
from forcemap.paths.atlas import Atlas
from forcemap.words import sentence

_MARK = "made by forcemap"

_FEW_REASONS = 3  # why zones have no speed: the most frequent ones. A choice

_SMALL_ZONE = 0.02
"""Extent of zones that is advised where larger ones permit too little [m]; a choice, as in docs/universal_robots.md."""


class Format(StrEnum):
    """What is written."""

    CSV = "csv"
    JSON = "json"
    URSCRIPT = "urscript"
    KRL = "krl"
    SAFETY = "safety"


def export(
    source: options.Maps,
    format: Annotated[
        Format,
        Option(
            "--format",
            help="csv, json: a table of zones; urscript, krl (KR C controllers): it as a function for the program; "
            "safety: a sheet to type in.",
        ),
    ],
    limit: options.TaskOrNewtons = None,
    contact: options.ContactKind = None,
    quasi_static: options.QuasiStaticN = None,
    limit_spring: options.LimitSpring = None,
    size: Annotated[float, Option("--zone-m", help="Largest extent of a zone.")] = 0.05,
    angle: Angle = WIDEST_ANGLE,
    overshoot: options.Overshoot = 0.01,
    tolerance: PositionTolerance = 0.005,
    bound: options.BoundOption = None,
    margin: options.Margin = None,
    device_spring: options.DeviceSpring = None,
    output: Annotated[
        str | None, Option("-o", "--output", help="File to write, in a folder that exists; for krl the folder.")
    ] = None,
    as_json: options.Json = False,
) -> int:
    """Write the allowed speeds of all places, in the form that a robot's program takes.

    Of an atlas, a folder of campaigns, a table for each direction, contact site, tool and payload; the program then
    chooses by its motion.

    Example: forcemap export impacts.csv --format urscript --area back_of_hand --contact transient -o speeds.script
    """
    maps = options.maps_from(source, device_spring)
    used, given = options.bound_from(maps, bound, margin), options.stated(limit, source)
    if output is not None:
        krl = format is Format.KRL
        require_folder(Path(output) if krl else Path(output).parent, " for the two files of KRL" * krl)
    task = task_of(given, maps, contact, quasi_static, limit_spring) if given.tasks else None
    newtons = (quasi_static, limit_spring)
    limits = limits_of(task, given.table) if task else [options.limit_from(limit, contact, *newtons, source=source)]
    case: dict[str, Any] = {"limits": limits, "bound": used, "size": size, "angle": angle, "date": date_of_files()}
    case["allowance"] = fm.Allowance(speed=overshoot, position=tolerance)
    zones: RobotTable | DirectedTables
    cells: list[str] = []
    if one := isinstance(maps, fm.ForceMap):
        zones = fm.robot_table(maps, **case)
        zones = replace(zones, provenance=with_map_file(zones.provenance, source))
        cells = [*_limits_alone(zones), *_grid_lines(zones)]
    else:
        zones = directed_tables(maps, task=task, **case)
    result = _result(zones)
    if zones.refusal:
        return refused(zones.refusal, result, as_json=as_json)
    words = _zones_permitted(found := _permitted(zones, maps, limits), angle, one=one)
    words = _of_sheet(words, zones, task) if format is Format.SAFETY else words
    files = _files(format, zones, task) if isinstance(zones, RobotTable) else _files_by_direction(format, zones)
    said: dict[str, Any] = {
        "angle": angle,
        "raised": zones_raised(angle, size, one=one),
        "cells": cells,
        "points": Path(source, POINTS_FILE).is_file(),
        "output": output,
        "as_json": as_json,
    }
    write(result | {"summary": asdict(found)}, files, words, zones.provenance, **said)
    return 0 if zones.permitted else 1


@dataclass(frozen=True)
class _Permitted:
    """How many zones have a speed, which [m/s], and how many a higher one than the standard's one speed, if it has one.

    `spread_mps` is how much slower they are than their fastest corner.
    """

    zones: int
    permitted: int
    above_standard: int = 0
    standard_mps: float = math.nan
    lowest_mps: float = math.nan
    highest_mps: float = math.nan
    spread_mps: float = math.nan


def _permitted(zones: RobotTable | DirectedTables, maps: fm.ForceMap | Atlas, limits: list[Any]) -> _Permitted:
    """What the zones permit, all speeds to program."""
    tables = [zones] if isinstance(zones, RobotTable) else [each.table for each in zones.tables]
    speeds, spread = (
        np.concatenate([each.ravel() for each in column])
        for column in zip(*((table.speed_mmps / 1000, table.spread) for table in tables), strict=True)
    )
    given = speeds > 0
    if not given.any():
        return _Permitted(speeds.size, 0)
    of_maps = [standard_speed(each.conditions, limits) for each in Atlas.of(maps).force_maps]
    standard = float(np.max(of_maps)) - zones.provenance.allowance.speed
    ends = map(float, (speeds[given].min(), speeds.max(), spread[given].max()))
    return _Permitted(speeds.size, int(given.sum()), int((speeds > standard).sum()), standard, *ends)


def _zones_permitted(found: _Permitted, angle: float, *, one: bool) -> str:
    """How many zones are permitted, at which speeds; where none, what raises their bound, and what does not."""
    words, raised = f"{found.permitted} of {found.zones} zones permitted", raised_off_axis(angle)
    if found.permitted:
        words += f", {shown(found.lowest_mps)} to {shown(found.highest_mps)} m/s to program"
        if found.standard_mps > 0:
            standard = f"{shown(found.standard_mps)} m/s to program of the standard's one speed"
            words += f", {found.above_standard} of them above the {standard} (on a way its slowest zone counts)"
        return f"{words}; up to {found.spread_mps:.3f} m/s slower than their fastest corner"
    if raised <= 1:
        return words
    without = (
        "; whether any is without these, --angle-deg 0 tells, for motion exactly along the direction ONLY"
        if one
        else ""
    )
    off = f"{100 * (raised - 1):.0f} % for motion up to {angle:g} degrees off the map's direction"
    return f"{words}, with the bound raised by {off}{without}"


def _limits_alone(zones: RobotTable) -> list[str]:
    """How many zones each of several limits permits alone; all of them hold everywhere, as zones know no segments."""
    if len(zones.alone) < 2:
        return []
    limits = [sentence(basis.limit_finding) for basis in zones.provenance.bases]
    return [
        "every limit holds in every zone, as zones know no segments; zones with a speed by each alone:",
        *(f"  {count} of {zones.speed_mmps.size}: {limit}" for count, limit in zip(zones.alone, limits, strict=True)),
    ]


def _grid_lines(zones: RobotTable) -> list[str]:
    """The speed to program of every zone, at the middle of the zone."""
    if zones.distance_edges.size > MOST_DISTANCES + 1:
        return ["speeds of the zones: more than a line takes, see --format csv"]
    distances, heights = ((edges[:-1] + edges[1:]) / 2 for edges in (zones.distance_edges, zones.height_edges))
    cells = {
        (d, h): speed_cell(zones.outcome[i, j], zones.speed_mmps[i, j].item() / 1000)
        for i, d in enumerate(distances.tolist())
        for j, h in enumerate(heights.tolist())
    }
    without = Counter(sentence(why) for why in zones.reason[zones.speed_mmps == 0])
    reasons = [f"without a speed, {counted(count, 'zone')}: {why}" for why, count in without.most_common(_FEW_REASONS)]
    return ["", "speed to program in m/s, each zone at its middle", *grid(cells), GRID_MARKS, *reasons, ""]


def zones_raised(angle: float, size: float, *, one: bool) -> fm.Finding:
    """Why zones give less than a path: how far their bound is raised, since a program that looks them up knows no
    direction, and the places that they hold for."""
    raised = raised_off_axis(angle) - 1 or None
    smaller = _SMALL_ZONE if size > _SMALL_ZONE else None
    figures = {"angle_deg": angle, "raised": raised, "smaller_m": smaller, "further": bool(one and raised)}
    return fm.Finding.of(fm.FindingKind.ZONES_RAISED, **figures)


def task_of(given: options.Stated, maps: fm.ForceMap | Atlas, *others: fm.Contact | float | None) -> fm.Task:
    """The task of the named file, for the campaigns of the maps; nothing else may state its limits."""
    if len(given.tasks) > 1 or given.names or given.newtons or {*others} != {None}:
        raise InputError("task: the task file states areas and contact; give it alone")
    task = fm.read_task(given.tasks[0], table=given.table)
    Atlas.of(maps).require_task(task)
    if isinstance(maps, fm.ForceMap):  # of several maps a program has a table for each
        Atlas.of(maps).require_maps(task)
    return task


def date_of_files() -> str | None:
    """The date that SOURCE_DATE_EPOCH states, so that files can be reproduced; None, for today, if it is not set."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    return time.strftime("%Y-%m-%d", time.gmtime(int(epoch))) if epoch.isdecimal() else None


def refused(refusal: fm.Finding, result: dict[str, Any], why: Sequence[str] = (), *, as_json: bool) -> int:
    """Say why nothing is exported, `why` of a path's segments: a program of zeros would only cover an earlier one."""
    outcome = "not_permitted" if refusal.kind is fm.FindingKind.NOT_PERMITTED else "unconfirmed"
    reason = sentence(refusal)
    emit(
        result | {"outcome": outcome, "reason": reason, "written": []},
        [f"nothing is exported: {reason}", *why],
        as_json=as_json,
    )
    return 1


def with_map_file(provenance: Provenance, source: str) -> Provenance:
    """A provenance that names the map file if the map came from one."""
    return provenance.of_file(source) if source.lower().endswith(".json") else provenance


def write(
    result: dict[str, Any],
    files: dict[str, str],
    words: str,
    provenance: Provenance,
    *,
    angle: float,
    raised: fm.Finding,
    cells: Sequence[str] = (),
    points: bool = False,
    output: str | None,
    as_json: bool,
) -> None:
    """Write the files, or print them, and say what is permitted; `files` are texts by their names in a folder.

    `raised` says why zones give less than a path, `cells` shows their speeds, and `points` is true where
    the campaign lists contact points.
    """
    written, earlier = [], []
    for name, text in files.items() if output else ():
        file = str(Path(output or "") / name) if name else output or ""
        earlier += [file] if Path(file).exists() else []
        write_result(file, text, mark=_MARK)
        written.append(file)
    if output is None and not as_json:
        print("\n".join(files.values()), end="")
        return
    words += "" if raised_off_axis(angle) > 1 else "; all for motion straight along the map's direction ONLY"
    verdict = f"{words}; not safety-rated: whoever is responsible for the risk assessment has to accept them"
    if any(basis.measure_more for basis in provenance.bases):
        verdict += "; NOT TO BE USED YET, measure more"
    lines = verdict_first(verdict, provenance.warnings, simulated=provenance.simulated)
    lines += [*cells, sentence(raised)]
    if points:
        lines.append(f"contact points that {POINTS_FILE} lists are not in it: their speeds stand in the report")
    instead = ", in place of an earlier one: take that out of the robot's program, too"
    lines += [f"written to {file}{instead * (file in earlier)}" for file in written]
    emit(result | {"written": written}, lines, as_json=as_json)


def _result(zones: RobotTable | DirectedTables) -> dict[str, Any]:
    return zones_result(zones) if isinstance(zones, RobotTable) else directed_result(zones)


_SAFETY_OF_ONE = (
    "format: found safety for several maps, expected one: a safety configuration knows no direction of motion; name "
    "the folder of one campaign"
)


def _files_by_direction(format: Format, tables: DirectedTables) -> dict[str, str]:
    """As `_files`, of several maps."""
    match format:
        case Format.URSCRIPT:
            return {"": urscript_along(tables)}
        case Format.KRL:
            return {"FORCEMAP.DAT": krl_along_data(tables), "FORCEMAP.SRC": krl_along_source(tables)}
        case Format.SAFETY:
            raise InputError(_SAFETY_OF_ONE)
        case Format.JSON:
            return {"": json_text({"made": _MARK} | directed_result(tables)) + "\n"}
        case Format.CSV:
            return {"": directed_csv(tables)}


def _files(format: Format, zones: RobotTable, task: fm.Task | None) -> dict[str, str]:
    """Texts by the name of their file in a folder; an empty name is the output itself."""
    match format:
        case Format.URSCRIPT:
            return {"": urscript(zones)}
        case Format.KRL:
            return {"FORCEMAP.DAT": krl_data(zones), "FORCEMAP.SRC": krl_source(zones)}
        case Format.SAFETY:
            return {"": safety_proposal(zones, task=task)}
        case Format.JSON:
            return {"": json_text({"made": _MARK} | zones_result(zones)) + "\n"}
        case Format.CSV:
            return {"": zones_csv(zones)}


def require_folder(folder: Path, use: str = "") -> None:
    """Raise InputError if the folder to write into does not exist; a mistyped one is not made."""
    if not folder.is_dir():
        message = f"there is no such folder{use}; make it (mkdir -p {folder}) or name one that exists"
        raise InputError(message, file=str(folder))


class PathFormat(StrEnum):
    """What is written."""

    SCALING = "scaling"
    SAFETY = "safety"


def export_path(
    source: options.Maps,
    file: Annotated[
        str,
        Argument(
            metavar="PATH", help="Path (CSV): x_m, y_m, z_m in the frame of the base; segment, speed_mps or time_s."
        ),
    ],
    format: Annotated[
        PathFormat,
        Option("--format", help="scaling: factors along the path; safety: a sheet to type in, compared with it."),
    ] = PathFormat.SCALING,
    task: options.TaskOrLimit = None,
    contact: options.ContactKind = None,
    angle: Angle = WIDEST_ANGLE,
    overshoot: options.Overshoot = 0.01,
    tolerance: PositionTolerance = 0.005,
    bound: options.BoundOption = None,
    margin: options.Margin = None,
    device_spring: options.DeviceSpring = None,
    acceleration: Acceleration = None,
    stated: PathOptions = None,
    output: Annotated[str | None, Option("-o", "--output", help="File to write, in a folder that exists.")] = None,
    as_json: options.Json = False,
) -> int:
    """Write what a robot's program takes for one path: factors on its speeds, or the safety sheet beside it.

    Example: forcemap export-path impacts.csv path.csv --task task.toml -o scaling.csv
    """
    maps = options.maps_from(source, device_spring)
    used, given = options.bound_from(maps, bound, margin), options.stated(task, source)
    if output is not None:
        require_folder(Path(output).parent)
    tool_path = path_from(file, stated)
    if given.tasks:
        task_of(given, maps, contact)
    whole_task = task_from(given, tool_path.names, contact, acceleration)
    case: dict[str, Any] = {"bound": used, "allowance": fm.Allowance(speed=overshoot, position=tolerance)}
    limits = limits_of(whole_task, given.table)
    zones = _zones_beside(maps, whole_task, limits, format, angle=angle, **case)
    speeds = fm.path_speeds(maps, tool_path, whole_task, angle=angle, table=given.table, **case)
    if zones.refusal:
        why = refusal_lines(PathAnswer.of_path(speeds, used))
        return refused(zones.refusal, _result(zones), why, as_json=as_json)
    provenance = with_map_file(zones.provenance, source)
    if isinstance(zones, RobotTable) and format is PathFormat.SAFETY:
        provenance = provenance.doubted(speeds)
        zones = replace(zones, provenance=provenance)
        words = _zones_permitted(_permitted(zones, maps, limits), angle, one=True)
        result = zones_result(zones)
        asked = {"table": given.table, **case}
        straight = "" if not angle or block_of_path(zones, speeds) else _straight(maps, tool_path, whole_task, **asked)
        text = safety_proposal(zones, task=whole_task if given.tasks else None, speeds=speeds, straight=straight)
        raised = zones_raised(angle, _SMALL_ZONE, one=True)  # the size of its zones cannot be stated
        permitted = zones.permitted > 0 and not speeds.refused.any()
        words = f"{_of_sheet(words, zones, None, speeds)}{straight}"
    else:
        provenance = provenance.of_path(speeds)
        result, text = scaling_result(speeds, provenance), scaling_csv(speeds, provenance)
        words = f"{_slowed(speeds)}{_time_as_commanded(speeds, result)}{_close_rows(speeds)}"
        raised = path_raised()
        permitted = not speeds.refused.any()
    write(result, {"": text}, words, provenance, angle=angle, raised=raised, output=output, as_json=as_json)
    return 0 if permitted else 1


def _of_sheet(
    words: str, zones: RobotTable | DirectedTables, task: fm.Task | None, speeds: fm.PathSpeeds | None = None
) -> str:
    """The entries of the safety sheet, before what zones permit, and which segments they would stop."""
    if not isinstance(zones, RobotTable):
        return words
    if speeds is not None and speeds.refused.any():
        return f"NO ENTRIES: this path is not permitted everywhere; of the whole map {words}"
    entries = entries_of(zones, speeds)
    return f"{f'{entries}; of the whole map ' if entries else ''}{words}{_stops(zones, task, speeds)}"


def _stops(zones: RobotTable, task: fm.Task | None, speeds: fm.PathSpeeds | None) -> str:
    """That the entries of the safety sheet would stop segments; empty if they stop none."""
    if not (stopped := segments_stopped(zones, task, speeds)):
        return ""
    return f"; THESE ENTRIES WOULD STOP THE ROBOT on {', '.join(map(one_line, stopped))} (the sheet says why)"


def _straight(maps: fm.ForceMap | Atlas, path: fm.ToolPath, task: fm.Task, **case: Any) -> str:
    """That a block of zones holds a path if it moves along the map's direction alone; empty if none does."""
    speeds = fm.path_speeds(maps, path, task, angle=0.0, **case)
    limits = limits_of(task, case.pop("table"))
    zones = _zones_beside(maps, task, limits, PathFormat.SAFETY, angle=0.0, **case)
    block = block_of_path(zones, speeds) if isinstance(zones, RobotTable) else None
    if block is None:
        return ""
    holds = f"a block that holds the path where contact is possible, at most {block[4] / 1000:.3f} m/s"
    return f"; for motion exactly along the map's direction ONLY (--angle-deg 0) there is {holds}"


def _slowed(speeds: fm.PathSpeeds) -> str:
    """How many pieces are permitted, how many of them slowed down, and how many only to brake for a slower one."""
    without = int((np.isnan(speeds.programmed) & (speeds.commanded > 0)).sum())
    slowed = (speeds.commanded < speeds.programmed) & (speeds.commanded > 0) & ~speeds.refused
    braking = int((slowed & ~speeds.too_fast).sum())
    refused = int(speeds.refused.sum())
    before = int(((speeds.commanded == 0) & ~speeds.refused).sum())
    permitted = f"{len(speeds.path) - refused} of {len(speeds.path)} pieces permitted"
    permitted = f"{refused} of {len(speeds.path)} pieces WITHOUT PERMISSION (factor 0)" if refused else permitted
    permitted += f", {before} before them where the robot has to stop (factor 0, too)" if before else ""
    only = f" ({braking} only to brake for a slower one)" if braking else ""
    factors = f"{int(slowed.sum())} of them slowed down{only}"
    if without:
        factors = f"{without} without a programmed speed, so without a factor: commanded_speed_mps alone counts"
    return f"{permitted}, {factors}"


def _time_as_commanded(speeds: fm.PathSpeeds, result: dict[str, Any]) -> str:
    """How long the path takes at the speeds of the file, and what costs time; empty if a piece has no speed."""
    time = speeds.duration(np.array([piece["commanded_speed_mps"] for piece in result["pieces"]]))
    if math.isnan(time):
        return ""
    allowed, slowed = speeds.allowed.duration, speeds.slowed.duration
    unbraked = allowed if math.isnan(slowed) else slowed
    lead = f"{time:.3f} s at their commanded speeds"
    costs = [f"{unbraked:.3f} s without braking ahead of slower pieces"]
    if speeds.path.time is not None:
        again = "its rows one by one: keep the corners alone for that"
        again = again.replace(":", ", as each brakes and accelerates for itself:") if time > unbraked else again
        lead = f"{unbraked:.3f} s as logged{', slowed where too fast' * bool(speeds.too_fast.any())}"
        costs = [f"{time:.3f} s where a program drives {again}"]
    if f"{allowed:.3f}" != f"{unbraked:.3f}":
        costs.append(
            f"{allowed:.3f} s if the program were as fast as allowed: no speed exceeds the programmed one; for the "
            "fastest state none where contact is possible"
        )
    return f", {lead} ({'; '.join(costs)})"


def _close_rows(speeds: fm.PathSpeeds) -> str:
    """That the rows of a path lie closer together than a robot can blend within the position tolerance; else empty."""
    shortest = float(speeds.path.lengths.min())
    if speeds.path.time is not None or shortest >= 2 * speeds.allowance.position:
        return ""
    blends = f"blends there must not exceed {500 * shortest:.1f} mm, and a robot that stops at each row takes longer"
    return f"; ROWS AS CLOSE AS {1000 * shortest:.1f} mm: {blends}: keep the corners alone, from which it is made again"


def _zones_beside(
    maps: fm.ForceMap | Atlas, task: fm.Task, limits: list[Any], format: PathFormat, **case: Any
) -> RobotTable | DirectedTables:
    """The zones of a map, or of several: what they rest on, and whether anything may be exported."""
    if isinstance(maps, fm.ForceMap):
        return fm.robot_table(maps, limits=limits, date=date_of_files(), **case)
    if format is PathFormat.SAFETY:
        raise InputError(_SAFETY_OF_ONE)
    return directed_tables(maps, limits=limits, task=task, date=date_of_files(), **case)
