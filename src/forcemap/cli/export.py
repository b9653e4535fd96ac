"""forcemap export."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from forcemap import (
    WIDEST_ANGLE,
    Contact,
    ContactNotPermitted,
    ForceLimit,
    InputError,
    NewtonLimit,
    PathSpeeds,
    RobotTable,
    Task,
    krl_data,
    krl_source,
    path_speeds,
    raised_off_axis,
    read_task,
    robot_table,
    safety_proposal,
    scaling_csv,
    scaling_result,
    urscript,
    zones_csv,
    zones_result,
)
from forcemap.cli.options import (
    Area,
    BoundOption,
    Confidence,
    ContactKind,
    Content,
    DeviceSpring,
    FormName,
    Json,
    LimitN,
    LimitSpring,
    LimitTable,
    Margin,
    QuasiStaticN,
    Region,
    Source,
    bound_from,
    force_map_from,
    limit_from,
)
from forcemap.cli.output import emit, json_text, write_result
from forcemap.cli.task_options import (
    Overshoot,
    PositionTolerance,
    TaskFile,
    allowance_from,
    limits_of,
    path_from,
    table_of_limits,
    task_from,
)
from forcemap.exports.head import SIMULATED, head_lines

_MARK = "made by forcemap"


class Format(StrEnum):
    """What is written."""

    CSV = "csv"
    JSON = "json"
    URSCRIPT = "urscript"
    KRL = "krl"
    SCALING = "scaling"
    SAFETY = "safety"


def export(
    source: Source,
    format: Annotated[
        Format,
        typer.Option(
            "--format",
            help="csv, json: zones; urscript, krl: a function for the program; scaling: factors along --path; "
            "safety: a sheet to type in, compared with --task and --path.",
        ),
    ],
    task: TaskFile = None,
    area: Area = None,
    region: Region = None,
    contact: ContactKind = None,
    limit_newtons: LimitN = None,
    quasi_static: QuasiStaticN = None,
    limit_spring: LimitSpring = None,
    limit_table: LimitTable = None,
    path: Annotated[str | None, typer.Option("--path", help="Path (CSV), for --format scaling or safety.")] = None,
    size: Annotated[float, typer.Option("--zone-m", help="Largest extent of a zone.")] = 0.05,
    angle: Annotated[
        float,
        typer.Option("--angle-deg", help="How far motions may point away from the map's direction, at most 5."),
    ] = WIDEST_ANGLE,
    overshoot: Overshoot = 0.01,
    tolerance: PositionTolerance = 0.005,
    date: Annotated[str | None, typer.Option("--date", help="Date in the head, YYYY-MM-DD; default today.")] = None,
    bound_kind: BoundOption = None,
    margin: Margin = None,
    confidence: Confidence = None,
    content: Content = None,
    form: FormName = None,
    device_spring: DeviceSpring = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="File to write, in a folder that exists; for krl the folder.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write the allowed speeds in the form that a robot's program takes.

    Example: forcemap export impacts.csv --format urscript --area back_of_hand --contact transient -o speeds.script
    """
    force_map, _ = force_map_from(source, form, device_spring)
    bound = bound_from(force_map, bound_kind, margin, confidence, content)
    if path is None and format is Format.SCALING:
        raise InputError("path: --format scaling needs --path, the path that it scales")
    if path is not None and format not in (Format.SCALING, Format.SAFETY):
        raise InputError("path: --path goes with --format scaling or safety; zones hold for any path")
    if output is not None:
        _require_folder(Path(output) if format is Format.KRL else Path(output).parent)
    table = table_of_limits(limit_table)
    limits: list[tuple[ForceLimit | NewtonLimit | float, Contact | None]]
    stated: Task | None = None
    if task is not None:
        if any(option is not None for option in (area, region, contact, limit_newtons, quasi_static, limit_spring)):
            raise InputError("task: the task file states areas and contact; give it alone")
        stated = read_task(task, table=table)
        stated.require_same(force_map.conditions)
        limits = limits_of(stated, table)
    else:
        limits = [limit_from(area, region, limit_newtons, contact, limit_table, quasi_static, limit_spring)]
    allowance = allowance_from(overshoot, tolerance)
    try:
        zones = robot_table(
            force_map, limits=limits, bound=bound, size=size, allowance=allowance, date=date, angle=angle
        )
    except ContactNotPermitted as error:
        result = {"outcome": "not_permitted", "reason": error.message, "zones": [], "written": []}
        emit(result, [f"nothing is exported: {error.message}"], as_json=as_json)
        raise typer.Exit(1) from None
    if zones.refusal:  # a program of zeros would only cover an earlier one
        result = zones_result(zones) | {"outcome": "unconfirmed", "reason": zones.refusal, "written": []}
        emit(result, [f"nothing is exported: {zones.refusal}"], as_json=as_json)
        raise typer.Exit(1)
    if source.lower().endswith(".json"):
        zones = replace(zones, provenance=zones.provenance.of_file(source))
    speeds: PathSpeeds | None = None
    if path is not None:
        tool_path = path_from(path, None, None, None, None)
        if limit_newtons is not None:
            raise InputError("limit: --path goes with --task, --area or --region")
        asked = task_from(task, tool_path.names, area, region, contact, None, table)
        speeds = path_speeds(force_map, tool_path, asked, bound=bound, allowance=allowance, angle=angle, table=table)
    if speeds is not None and format is Format.SCALING:
        provenance = zones.provenance.with_statements(speeds.statements)
        result = scaling_result(speeds, provenance)
        files = {"": scaling_csv(speeds, provenance)}
        permitted = not speeds.refused.any()
        words = f"{int((~speeds.refused).sum())} of {len(speeds.path)} pieces permitted{_slowed(speeds)}"
    else:
        result = zones_result(zones)
        files = _files(format, zones, stated, speeds)
        permitted = zones.permitted > 0
        words = f"{zones.permitted} of {zones.speed_mmps.size} zones permitted{_price(zones)}"
    words += "" if raised_off_axis(angle) > 1 else ", for motion straight along the map's direction ONLY"
    written = [] if output is None else _write(output, files)
    if output is None and not as_json:
        print("\n".join(files.values()), end="")
    else:
        lines = [f"{words}; not safety-rated, to be confirmed before use", *(f"written to {file}" for file in written)]
        simulated = [line for line in head_lines(zones.provenance)[:1] if line == SIMULATED]
        lines = [*simulated, *zones.provenance.warnings, *lines]
        emit(result | {"written": written}, lines, as_json=as_json)
    raise typer.Exit(0 if permitted else 1)


def _price(zones: RobotTable) -> str:
    """What the size of the zones costs, in words; nothing where none is permitted."""
    spread = zones.spread[zones.speed_mmps > 0]
    return f", up to {spread.max():.3f} m/s slower than their fastest corner" if spread.size else ""


def _slowed(speeds: PathSpeeds) -> str:
    """How many pieces are slowed down, in words."""
    slowed = (speeds.commanded < speeds.programmed) & ~speeds.refused
    return f", {int(slowed.sum())} of them slowed down"


def _files(format: Format, zones: RobotTable, task: Task | None, speeds: PathSpeeds | None) -> dict[str, str]:
    """Texts by the name of their file in a folder; an empty name is the output itself."""
    match format:
        case Format.URSCRIPT:
            return {"": urscript(zones)}
        case Format.KRL:
            return {"FORCEMAP.DAT": krl_data(zones), "FORCEMAP.SRC": krl_source(zones)}
        case Format.SAFETY:
            return {"": safety_proposal(zones, task=task, speeds=speeds)}
        case Format.JSON:
            return {"": json_text({"made": _MARK} | zones_result(zones)) + "\n"}
        case _:
            return {"": zones_csv(zones)}


def _require_folder(folder: Path) -> None:
    """Raise InputError if the folder to write into does not exist; a mistyped one is not made."""
    if not folder.is_dir():
        message = f"there is no such folder; make it (mkdir -p {folder}) or name one that exists"
        raise InputError(message, file=str(folder))


def _write(output: str, files: dict[str, str]) -> list[str]:
    """Write the files and name them."""
    written = []
    for name, text in files.items():
        file = str(Path(output) / name) if name else output
        write_result(file, text, mark=_MARK)
        written.append(file)
    return written
