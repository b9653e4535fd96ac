"""forcemap plan."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Annotated

import typer

from forcemap import (
    Conditions,
    Design,
    Device,
    ForceMap,
    InputError,
    MeasurementPlan,
    StandardExpectation,
    campaign_text,
    plan_measurements,
    read_conditions,
    run_sheet,
    write_plan,
)
from forcemap.cli.column_options import device_with
from forcemap.cli.options import (
    Area,
    ContactKind,
    Json,
    LimitN,
    LimitTable,
    MovingMass,
    Payload,
    Region,
    force_map_from,
    limit_from,
)
from forcemap.cli.output import emit, listing
from forcemap.files import write_atomically

_SHEET = "run_sheet.txt"


def plan(
    folder: Annotated[str, typer.Argument(help="New campaign folder, or one that has a campaign.toml and no plan.")],
    distances: Annotated[
        str, typer.Option("--distances-m", help="Nearest and farthest distance from the base z-axis, or all of them.")
    ],
    heights: Annotated[str, typer.Option("--heights-m", help="Lowest and highest height above the base, or all.")],
    speeds: Annotated[str, typer.Option("--speeds-mps", help="Slowest and fastest speed, or all of them.")],
    design: Annotated[
        Design,
        typer.Option(
            "--design", help="training: 3 x 3 places x 3 speeds; full-grid: 5 x 5 x 5; symmetry: base angles."
        ),
    ] = Design.TRAINING,
    repeats: Annotated[int, typer.Option("--repeats", help="Impacts of every state.")] = 3,
    base_angles: Annotated[
        str, typer.Option("--base-angles-deg", help="Angles of the base joint, for --design symmetry.")
    ] = "",
    reach: Annotated[
        float | None, typer.Option("--reach-m", help="Places farther from the base's origin are left out.")
    ] = None,
    device_range: Annotated[
        float | None, typer.Option("--device-range-N", help="Largest force the device can measure.")
    ] = None,
    device_error: Annotated[float | None, typer.Option("--device-error-N", help="Largest error of a reading.")] = None,
    moving_mass: MovingMass = None,
    payload: Payload = None,
    expected: Annotated[
        str | None,
        typer.Option("--map", help="Expect the forces of this map (file or published name), not the standard's."),
    ] = None,
    area: Area = None,
    region: Region = None,
    newtons: LimitN = None,
    contact: ContactKind = None,
    limit_table: LimitTable = None,
    as_json: Json = False,
) -> None:
    """Plan a campaign: write its folder with campaign.toml, plan.csv and a run sheet to print.

    Example: forcemap plan my-campaign --distances-m 0.52,0.89 --heights-m 0.14,0.46 --speeds-mps 0.1,0.4
    --device-range-N 500 --moving-mass-kg 30 --area back_of_hand --contact transient
    """
    target = Path(folder)
    if (target / "plan.csv").exists():
        raise InputError("the folder has a plan already; name a new folder, or move the plan away", file=folder)
    toml = target / "campaign.toml"
    conditions = _conditions(toml, device_range, device_error, moving_mass, payload)
    limit = math.nan
    if area or region or newtons is not None:
        found, kind = limit_from(area, region, newtons, contact, limit_table)
        limit = found if isinstance(found, float) else found.force(kind) if kind else math.nan
    made = plan_measurements(
        _figures("distances", distances),
        _figures("heights", heights),
        _figures("speeds", speeds),
        design=design,
        repeats=repeats,
        base_angles=_figures("base angles", base_angles) if base_angles else [],
        reach=math.inf if reach is None else reach,
        device=conditions.device,
        expected_force=_expectation(expected, conditions),
        limit=limit,
    )
    sheet = run_sheet(made, conditions)
    try:
        (target / "recordings").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder cannot be made ({error.strerror})", file=folder) from error
    files = ["plan.csv", _SHEET]
    if not toml.exists():
        write_atomically(toml, campaign_text(conditions))
        files.insert(0, "campaign.toml")
    write_atomically(target / _SHEET, "\n".join(sheet) + "\n")
    write_plan(made, target)
    emit(_result(folder, made, files), _lines(folder, made, files), as_json=as_json)


def _conditions(
    toml: Path, device_range: float | None, device_error: float | None, moving_mass: float | None, payload: float | None
) -> Conditions:
    """The conditions of a campaign.toml that is there, with what the options add to it."""
    conditions = read_conditions(toml) if toml.exists() else Conditions()
    stated = dataclasses.replace(
        conditions,
        device=device_with(conditions.device, device_range, device_error),
        moving_mass=conditions.moving_mass if moving_mass is None else moving_mass,
        payload=conditions.payload if payload is None else payload,
    )
    if toml.exists() and stated.to_tables() != conditions.to_tables():
        raise InputError("this campaign.toml is there already; state device, mass and payload in it", file=str(toml))
    return stated


def _expectation(expected: str | None, conditions: Conditions) -> ForceMap | StandardExpectation | None:
    if expected is not None:
        return force_map_from(expected, None)[0]
    if math.isnan(conditions.moving_mass):
        return None
    payload = 0.0 if math.isnan(conditions.payload) else conditions.payload
    return StandardExpectation(conditions.moving_mass, payload, stiffness=_stiffness(conditions.device))


def _stiffness(device: Device) -> float:
    return StandardExpectation.stiffness if math.isnan(device.stiffness) else device.stiffness


def _figures(name: str, text: str) -> list[float]:
    try:
        return [float(part) for part in text.replace(" ", "").split(",")]
    except ValueError:
        raise InputError(f"{name}: found {text!r}, expected numbers with decimal points, between commas") from None


def _result(folder: str, made: MeasurementPlan, files: list[str]) -> dict[str, object]:
    names = ("recording", "state_id", "repeat", "role")
    runs = zip(*(getattr(made, name).tolist() for name in names), strict=True)
    figures = zip(made.distance, made.height, made.speed, made.base_angle, made.expected_force, strict=True)
    return {
        "folder": folder,
        "files": files,
        "states": len(made.states),
        "runs": [
            dict(zip(names, run, strict=True))
            | {
                "distance_m": float(d),
                "height_m": float(h),
                "speed_mps": float(v),
                "base_angle_deg": float(angle),
                "expected_force_N": float(force),
            }
            for run, (d, h, v, angle, force) in zip(runs, figures, strict=True)
        ],
        "expected_from": made.expected_from,
        "left_out": list(made.left_out),
        "warnings": list(made.warnings),
    }


def _lines(folder: str, made: MeasurementPlan, files: list[str]) -> list[str]:
    speeds = sorted(set(made.speed.tolist()))
    lines = [
        f"{len(made)} impacts in {len(made.states)} states, at {', '.join(f'{v:g}' for v in speeds)} m/s: "
        "all places at the lowest speed first, far to near, then the next speed",
        f"expected forces from: {made.expected_from or 'nothing (give --moving-mass-kg or --map)'}",
        *(f"WARNING: {warning}" for warning in made.warnings),
    ]
    lines += listing("Left out", made.left_out) if made.left_out else []
    return [
        *lines,
        "",
        f"Written to {folder}: {', '.join(files)}",
        "Next:",
        f"  1. fill in {folder}/campaign.toml: robot, tool, contact, device, and in [recordings] how it writes files",
        f"  2. print {folder}/{_SHEET} and measure; save each file in {folder}/recordings under the name it says",
        f"  3. forcemap collect {folder}",
    ]
