"""forcemap plan."""

from __future__ import annotations

import dataclasses
import math
import shlex
from pathlib import Path
from typing import Annotated, Any

import typer

from forcemap import (
    CFM_3D,
    Conditions,
    Design,
    Device,
    ForceLimit,
    ForceMap,
    InputError,
    MeasurementPlan,
    StandardExpectation,
    device_suitability,
    form_named,
    plan_measurements,
    read_conditions,
)
from forcemap.cli.column_options import device_with
from forcemap.cli.options import (
    Area,
    ContactKind,
    DeviceSpring,
    FormName,
    Json,
    LimitN,
    LimitTable,
    MovingMass,
    Payload,
    Region,
    force_map_from,
    limit_from,
    stiffness,
)
from forcemap.cli.output import emit, listing
from forcemap.cli.plan_confirm import confirm_released
from forcemap.cli.plan_steps import SHEET, go_on_measuring, run_results, write_campaign


def plan(
    folder: Annotated[
        str,
        typer.Argument(
            help="New campaign folder, or one that has a campaign.toml and no plan. With --next: also a campaign; with "
            "--confirm: a campaign, or a map."
        ),
    ],
    distances: Annotated[
        str | None,
        typer.Option("--distances-m", help="Nearest and farthest distance from the base z-axis, or all of them."),
    ] = None,
    heights: Annotated[
        str | None, typer.Option("--heights-m", help="Lowest and highest height above the base, or all.")
    ] = None,
    speeds: Annotated[
        str | None,
        typer.Option("--speeds-mps", help="Slowest and fastest speed, or all of them; with --next 0.05,0.40."),
    ] = None,
    design: Annotated[
        Design,
        typer.Option(
            "--design",
            help="training: 3 x 3 places x 3 speeds; full-grid: 5 x 5 x 5; symmetry: base angles; i-optimal: --states "
            "of the full grid.",
        ),
    ] = Design.TRAINING,
    go_on: Annotated[
        bool, typer.Option("--next", help="Add the states to measure next for a limit; from nothing the opening.")
    ] = False,
    confirm: Annotated[
        bool,
        typer.Option(
            "--confirm",
            help="Add impacts at the released speeds, with the rule they must pass; once they are measured, tell "
            "whether they do (exit code 0 passes, 1 does not, 2 cannot tell).",
        ),
    ] = False,
    states: Annotated[
        int | None,
        typer.Option(
            "--states",
            help="i-optimal: how many states (18); --next: of the whole campaign at most (27, or 12 more than are "
            "measured); --confirm: impacts (6); else the number below 18 that is accepted.",
        ),
    ] = None,
    batch: Annotated[int | None, typer.Option("--batch", help="With --next: states at a time; default 4.")] = None,
    largest_force: Annotated[
        float | None, typer.Option("--largest-force-N", help="With --next: no impact is to exceed it.")
    ] = None,
    form: FormName = None,
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
    device_spring: DeviceSpring = None,
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
    if go_on and confirm:
        raise InputError("plan: --next and --confirm are two steps, expected one of them")
    for name, given, step in (
        ("--batch", batch, go_on),
        ("--largest-force-N", largest_force, go_on),
        ("--form", form, go_on or confirm or design is Design.I_OPTIMAL),
    ):
        if given is not None and not step:
            raise InputError(f"plan: {name} goes with --next{', --confirm or --design i-optimal' * (name == '--form')}")
    named_limit: dict[str, object] = {
        "--area": area,
        "--region": region,
        "--limit-N": newtons,
        "--contact": contact,
        "--limit-table": limit_table,
    }
    if confirm:
        device = (device_range, device_error, device_spring)
        stated = (distances, heights, speeds, reach, *device, moving_mass, payload, expected)
        if any(value is not None for value in stated) or base_angles or design is not Design.TRAINING:
            raise InputError("plan: --confirm takes places, speeds and device from the campaign; give the limit alone")
        limit, contact = limit_from(area, region, newtons, contact, limit_table)
        confirm_released(
            folder,
            limit,
            contact,
            states,
            form,
            again=_command(folder, {**named_limit, "--states": states, "--form": form}, "--confirm"),
            go_on=_command(folder, {**named_limit, "--form": form}, "--next"),
            as_json=as_json,
        )
        return
    if go_on:
        if reach is not None or base_angles or design is not Design.TRAINING:
            raise InputError("plan: --next chooses the states itself; leave out --design, --reach-m, --base-angles-deg")
        conditions = _conditions(
            target / "campaign.toml", device_range, device_error, device_spring, moving_mass, payload
        )
        limit, contact = limit_from(area, region, newtons, contact, limit_table)
        options: dict[str, Any] = {
            name: _figures(name, text)
            for name, text in (("distances", distances), ("heights", heights), ("speeds", speeds))
            if text is not None
        }
        options |= {
            name: value
            for name, value in (("states", states), ("batch", batch), ("largest_force", largest_force))
            if value is not None
        }
        options |= {"form": form_named(form or CFM_3D.name), "repeats": repeats}
        asked = {
            "--distances-m": distances,
            "--heights-m": heights,
            "--speeds-mps": speeds,
            "--states": states,
            "--batch": batch,
            "--largest-force-N": largest_force,
            "--form": form,
            "--repeats": None if repeats == 3 else repeats,
            "--map": expected,
        }
        go_on_measuring(
            folder,
            conditions,
            limit,
            contact,
            options,
            _expectation(expected, conditions),
            again=_command(folder, {**named_limit, **asked}, "--next"),
            as_json=as_json,
        )
        return
    if distances is None or heights is None or speeds is None:
        raise InputError("plan: expected --distances-m, --heights-m and --speeds-mps, the ranges to measure")
    if (target / "plan.csv").exists():
        raise InputError("the folder has a plan already; name a new folder, or move the plan away", file=folder)
    toml = target / "campaign.toml"
    conditions = _conditions(toml, device_range, device_error, device_spring, moving_mass, payload)
    to_confirm, doubts = math.nan, []
    if area or region or newtons is not None:
        found, kind = limit_from(area, region, newtons, contact, limit_table)
        if isinstance(found, ForceLimit):
            to_confirm = found.force(kind) if kind else math.nan
            suits = device_suitability(found.name, found.stiffness, conditions.device.stiffness)
            doubts = [f"no speed will be confirmed for {found.name}: {suits.refusal}"] if suits.refusal else []
        else:
            to_confirm = float(found.force)
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
        limit=to_confirm,
        states=states,
        form=form_named(form or CFM_3D.name),
    )
    made = dataclasses.replace(made, warnings=(*doubts, *made.warnings))
    files = write_campaign(target, made, made, conditions)
    designed = {"design_note": made.note, "expected_bound_width": made.bound_width}
    lines = [*([made.note] if made.note else []), *_lines(folder, made, files)]
    emit(_result(folder, made, files) | designed, lines, as_json=as_json)


def _command(folder: str, options: dict[str, object], step: str) -> str:
    """The command that takes the next step, with the options that were given."""
    given = [word for name, value in options.items() if value is not None for word in (name, _word(value))]
    return shlex.join(["forcemap", "plan", folder, step, *given])


def _word(value: object) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def _conditions(
    toml: Path,
    device_range: float | None,
    device_error: float | None,
    device_spring: float | None,
    moving_mass: float | None,
    payload: float | None,
) -> Conditions:
    """The conditions of a campaign.toml that is there, with what the options add to it."""
    conditions = read_conditions(toml) if toml.exists() else Conditions()
    device = conditions.with_device_stiffness(stiffness(device_spring)).device
    stated = dataclasses.replace(
        conditions,
        device=device_with(device, device_range, device_error),
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
    return {
        "folder": folder,
        "files": files,
        "states": len(made.states),
        "runs": run_results(made),
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
        f"  2. print {folder}/{SHEET} and measure; save each file in {folder}/recordings under the name it says",
        f"  3. forcemap collect {folder}",
    ]
