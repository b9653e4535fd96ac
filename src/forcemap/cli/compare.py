"""forcemap compare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from forcemap import (
    CFM_3D,
    PUBLISHED_MAPS,
    FitError,
    ForceMap,
    InputError,
    body_region,
    compare_effective_mass,
    compare_force_models,
    compare_maps,
    force_limit,
    form_named,
    pfl_robot_mass,
    read_dataset,
)
from forcemap.cli.change_results import maps_lines, maps_result
from forcemap.cli.fit_errors import too_few_states_named
from forcemap.cli.mass_results import mass_comparison_lines, mass_comparison_result
from forcemap.cli.options import Body, FormName, Json, MovingMass, Payload, force_map_from, masses_from
from forcemap.cli.output import emit
from forcemap.cli.results import comparison_lines, comparison_result
from forcemap.cli.robot_options import DriveInertiaOption, ToolDirection, direction_from, robot_from


def compare(
    table: Annotated[str, typer.Argument(help="Impacts table (CSV) or campaign folder; with OTHER also a map.")],
    other: Annotated[
        str | None, typer.Argument(help="Another map: then the two maps are compared, the other over the first.")
    ] = None,
    region: Annotated[
        str | None, typer.Option("--region", help="Body region or area hit; default: hand_fingers.")
    ] = None,
    moving_mass: MovingMass = None,
    payload: Payload = None,
    body: Annotated[
        Body | None,
        typer.Option(
            "--body", help="constrained (default): the body part cannot move away; free: the region's own mass."
        ),
    ] = None,
    form: FormName = None,
    robot: Annotated[
        str | None,
        typer.Option(
            "--effective-mass", help="Compare with the effective mass of this robot: ur10e, kuka-iiwa7, a URDF."
        ),
    ] = None,
    drive_inertia: DriveInertiaOption = None,
    tool_direction: ToolDirection = "down",
    as_json: Json = False,
) -> None:
    """Compare the measured map with the 2D map and the standard's contact model on the same states.

    Or two maps with each other, over the range that both have measured: compare MAP MAP. Or a map, or measured impacts,
    with what effective mass alone would give: compare ur10e --effective-mass ur10e.

    Example: forcemap compare impacts.csv --moving-mass-kg 30 --body constrained
    """
    if robot is not None:
        if any(option is not None for option in (other, region, moving_mass, body)):
            raise InputError("compare: --effective-mass goes with one map or table, a robot, its load and its stance")
        found = robot_from(robot, None, None, drive_inertia, payload or 0.0)
        forces = force_map_from(table, form)[0] if _is_map(table) else read_dataset(table)
        stance = direction_from("tool direction", tool_direction)
        by_mass = compare_effective_mass(forces, found, tool_direction=stance)
        emit(mass_comparison_result(by_mass), mass_comparison_lines(by_mass), as_json=as_json)
        return
    if other is not None:
        if any(option is not None for option in (region, moving_mass, payload, body)):
            raise InputError("compare: --region, --moving-mass-kg, --payload-kg and --body go with one impacts table")
        maps = (_force_map(table, form, beside=other), _force_map(other, form, beside=table))
        comparison_of_maps = compare_maps(*maps)
        lines = maps_lines(comparison_of_maps, (table, other))
        if not (_is_map(other) or comparison_of_maps.same):
            lines += ["", f"impacts were fitted to compare maps; {_for_impacts(other, table)}"]
        emit(maps_result(comparison_of_maps), lines, as_json=as_json)
        return
    if _is_map(table):
        force_map_from(table, form)  # what is no map says so first
        raise InputError(
            f"compare: found one map, {table}, expected a second one (compare {table} OTHER), or impacts alone; "
            f"{_for_impacts('IMPACTS', table)}; to see it beside effective mass: --effective-mass ROBOT"
        )
    dataset = read_dataset(table)
    region = "hand_fingers" if region is None else region
    constants = body_region(region)
    held = Body.CONSTRAINED if body is None else body
    mass, load, body_mass = masses_from(dataset.conditions, moving_mass, payload, held, constants.mass)
    limit = force_limit(region)
    with too_few_states_named(table, form):
        comparison = compare_force_models(
            dataset,
            robot_mass=pfl_robot_mass(mass, load),
            body_mass=body_mass,
            stiffness=constants.stiffness,
            form=form_named(form or CFM_3D.name),
            limit=limit if limit.permitted else None,
        )
    lines = comparison_lines(comparison)
    if not limit.permitted:
        lines.append(f"no speeds: contact with {region} is not permitted ({limit.edition})")
    emit(comparison_result(comparison) | {"permitted": limit.permitted}, lines, as_json=as_json)


def _is_map(source: str) -> bool:
    return source.lower().endswith(".json") or (source in PUBLISHED_MAPS and not Path(source).exists())


def _force_map(source: str, form: str | None, *, beside: str) -> ForceMap:
    """The map of a source; impacts too few for one are told the command for impacts beside a map."""
    try:
        return force_map_from(source, form)[0]
    except FitError as error:
        found = error.message.rpartition("; ")[0] or error.message
        raise type(error)(
            f"{found}; compare takes two maps, or impacts enough to fit one; {_for_impacts(source, beside)}",
            file=error.file or source,
        ) from None


def _for_impacts(impacts: str, source: str) -> str:
    """The command for impacts beside a map; a published map has no measured states to say whether it holds."""
    if _is_map(source) and source in PUBLISHED_MAPS:
        return f"to see how far its predictions lie from impacts: evaluate {impacts} --map {source}"
    return f"to see whether a map still holds for new impacts: evaluate {impacts} --against {source}"
