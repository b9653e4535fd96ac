"""forcemap compare."""

from __future__ import annotations

from typing import Annotated

import typer

from forcemap import CFM_3D, body_region, compare_force_models, force_limit, form_named, pfl_robot_mass, read_dataset
from forcemap.cli.options import Body, BodyOption, FormName, Json, MovingMass, Payload, Table, masses_from
from forcemap.cli.output import emit
from forcemap.cli.results import comparison_lines, comparison_result


def compare(
    table: Table,
    region: Annotated[str, typer.Option("--region", help="Body region or area hit.")] = "hand_fingers",
    moving_mass: MovingMass = None,
    payload: Payload = None,
    body: BodyOption = Body.CONSTRAINED,
    form: FormName = None,
    as_json: Json = False,
) -> None:
    """Compare the measured map with the 2D map and the standard's contact model on the same states.

    Example: forcemap compare impacts.csv --moving-mass-kg 30 --body constrained
    """
    dataset = read_dataset(table)
    constants = body_region(region)
    mass, load, body_mass = masses_from(dataset.conditions, moving_mass, payload, body, constants.mass)
    limit = force_limit(region)
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
