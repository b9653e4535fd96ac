"""forcemap compare."""

from __future__ import annotations

from typing import Annotated

import typer

from forcemap import body_region, compare_force_models, force_limit, form_named, pfl_robot_mass, read_dataset
from forcemap.cli.options import Body, BodyOption, FormName, Json, MovingMass, Payload, Table, masses_from
from forcemap.cli.output import emit
from forcemap.cli.results import comparison_lines, comparison_result


def compare(
    table: Table,
    region: Annotated[str, typer.Option("--region", help="Body region or area hit.")] = "hand_fingers",
    moving_mass: MovingMass = None,
    payload: Payload = None,
    body: BodyOption = Body.CONSTRAINED,
    form: FormName = "CFM_3D",
    as_json: Json = False,
) -> None:
    """Compare the measured map with the 2D map and the standard's contact model on the same states.

    Example: forcemap compare impacts.csv --moving-mass-kg 30 --body constrained
    """
    dataset = read_dataset(table)
    constants = body_region(region)
    mass, load, body_mass = masses_from(dataset.conditions, moving_mass, payload, body, constants.mass)
    comparison = compare_force_models(
        dataset,
        robot_mass=pfl_robot_mass(mass, load),
        body_mass=body_mass,
        stiffness=constants.stiffness,
        form=form_named(form),
        limit=force_limit(region),
    )
    emit(comparison_result(comparison), comparison_lines(comparison), as_json=as_json)
