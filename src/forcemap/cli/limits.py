"""forcemap limits."""

from __future__ import annotations

import math
from typing import Annotated, Any

import typer

from forcemap import (
    Conditions,
    Contact,
    ForceLimit,
    InputError,
    body_region,
    floor_speed,
    force_limit,
    pfl_pressure_speed_limit,
    pfl_robot_mass,
    pfl_speed_limit,
    read_limit_table,
    standard_limit_table,
)
from forcemap.cli.options import Body, BodyOption, Json, LimitTable, masses_from
from forcemap.cli.output import emit, listing, table

_PASCALS = 1e4  # Pa in 1 N/cm^2


def _assumptions(contact_area: float | None) -> list[str]:
    return [
        "a formula, not confirmed by any measurement",
        "person at rest",
        "pressure not assessed" if contact_area is None else f"pressure assessed over {contact_area:g} cm^2",
        "the transient limit holds only where the contact does not clamp",
    ]


def limits(
    name: Annotated[str | None, typer.Argument(help="Body area or region; all areas if not given.")] = None,
    limit_table: LimitTable = None,
    moving_mass: Annotated[
        float | None,
        typer.Option("--moving-mass-kg", help="With it, the speed the contact model allows is given."),
    ] = None,
    payload: Annotated[float | None, typer.Option("--payload-kg", help="Effective payload; default 0.")] = None,
    body: BodyOption = Body.CONSTRAINED,
    contact_area: Annotated[
        float | None, typer.Option("--contact-area-cm2", help="With it, the pressure form is evaluated too.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Show force and pressure limits of body areas, and the speed the standard's contact model allows.

    Example: forcemap limits back_of_hand --moving-mass-kg 30
    """
    areas = read_limit_table(limit_table) if limit_table else standard_limit_table()
    if moving_mass is None and (contact_area is not None or payload is not None):
        raise InputError("moving mass: --contact-area-cm2 and --payload-kg go with --moving-mass-kg")
    found = [force_limit(each, table=areas) for each in ([name] if name else areas.areas)]
    results = [_limit(limit) for limit in found]
    lines = table(
        ["area or region", "region", "force quasi-static", "transient", "pressure quasi-static", "transient"],
        [[limit.name, areas.areas[limit.areas[0]].region, *_cells(limit)] for limit in found],
    )
    if moving_mass is not None:
        lines.append("")
        for limit, result in zip(found, results, strict=True):
            if limit.permitted:
                result["contact_model"] = _contact_model(
                    limit, areas.areas[limit.areas[0]].region, moving_mass, payload, body, contact_area
                )
                lines += _contact_model_lines(limit.name, result["contact_model"])
            else:
                result["contact_model"] = None
                lines.append(f"{limit.name}: no speed, contact is not permitted")
        lines += listing("Assumes", _assumptions(contact_area))
    provenance = f"{areas.edition}, table version {areas.version}; {areas.source}"
    lines += [
        "",
        provenance,
        "the standard permits no contact with skull, forehead and face; pressures in N/cm^2",
    ]
    result = {
        "edition": areas.edition,
        "source": areas.source,
        "version": areas.version,
        "sha256": areas.sha256,
    }
    emit(result | {"limits": results}, lines, as_json=as_json)


def _limit(limit: ForceLimit) -> dict[str, Any]:
    return {
        "name": limit.name,
        "areas": list(limit.areas),
        "permitted": limit.permitted,
        "tabulated_quasi_static_N": limit.tabulated_quasi_static,
        "quasi_static_N": limit.quasi_static if limit.permitted else None,
        "transient_N": limit.transient if limit.permitted else None,
        "quasi_static_N_per_cm2": limit.quasi_static_pressure / _PASCALS if limit.permitted else None,
        "transient_N_per_cm2": limit.transient_pressure / _PASCALS if limit.permitted else None,
    }


def _cells(limit: ForceLimit) -> list[str]:
    if not limit.permitted:
        return ["not permitted", "-", "-", "-"]
    pressures = (limit.quasi_static_pressure / _PASCALS, limit.transient_pressure / _PASCALS)
    return [f"{limit.quasi_static:g} N", f"{limit.transient:g} N", *(f"{p:g} N/cm^2" for p in pressures)]


def _contact_model(
    limit: ForceLimit,
    region_name: str,
    moving_mass: float,
    payload: float | None,
    body: Body,
    contact_area: float | None,
) -> dict[str, Any]:
    region = body_region(region_name)
    mass, load, body_mass = masses_from(Conditions(), moving_mass, payload, body, region.mass)
    masses = {"robot_mass": pfl_robot_mass(mass, load), "body_mass": body_mass, "stiffness": region.stiffness}
    result: dict[str, Any] = {
        "assumptions": _assumptions(contact_area),
        "robot_mass_kg": masses["robot_mass"],
        "body": body,
        "body_mass_kg": body_mass,
        "stiffness_N_per_m": region.stiffness,
    }
    for contact in Contact:
        speeds = {"force": pfl_speed_limit(limit.force(contact), **masses)}
        if contact_area is not None:
            pressure = limit.transient_pressure if contact is Contact.TRANSIENT else limit.quasi_static_pressure
            area = contact_area / 1e4
            speeds["pressure"] = pfl_pressure_speed_limit(pressure, contact_area=area, **masses)
        governing = min(speeds, key=lambda form: speeds[form])
        result[f"{contact.replace('-', '_')}_speed_mps"] = speeds[governing]
        result[f"{contact.replace('-', '_')}_governed_by"] = governing
    return result


def _contact_model_lines(name: str, model: dict[str, Any]) -> list[str]:
    mass = "constrained" if math.isinf(model["body_mass_kg"]) else f"free, {model['body_mass_kg']:g} kg"
    return [
        f"{name}: contact model allows {floor_speed(model['quasi_static_speed_mps'])} m/s quasi-static "
        f"({model['quasi_static_governed_by']}), {floor_speed(model['transient_speed_mps'])} m/s transient "
        f"({model['transient_governed_by']}); robot mass {model['robot_mass_kg']:g} kg, body part {mass}, "
        f"{model['stiffness_N_per_m'] / 1000:g} N/mm"
    ]
