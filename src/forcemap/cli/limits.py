"""forcemap limits."""

from __future__ import annotations

from typing import Annotated, Any

from typer import Argument, Option

import forcemap as fm
from forcemap.answers.comparison import Body
from forcemap.answers.limits import LimitAnswer, LimitsAnswer
from forcemap.cli.options import Json, LimitTable
from forcemap.cli.output import emit, listing, table
from forcemap.comparisons.contact_model import ContactModel, contact_model
from forcemap.limits.body_areas import PASCALS
from forcemap.limits.pfl import pfl_pressure_speed_limit
from forcemap.words import sentence

BodyOption = Annotated[
    Body, Option("--body", help="constrained: the body part cannot move away; free: the region's own mass.")
]

_FIGURES = {
    "quasi_static_N": "quasi_static",
    "transient_N": "transient",
    "quasi_static_N_per_cm2": "quasi_static_pressure",
    "transient_N_per_cm2": "transient_pressure",
}


def limits(
    name: Annotated[str | None, Argument(help="Body area or region; all areas if not given.")] = None,
    limit_table: LimitTable = None,
    moving_mass: Annotated[
        float | None, Option("--moving-mass-kg", help="With it, the speed the contact model allows is given.")
    ] = None,
    payload: Annotated[float | None, Option("--payload-kg", help="Effective payload; default 0.")] = None,
    body: BodyOption = Body.CONSTRAINED,
    contact_area: Annotated[
        float | None, Option("--contact-area-cm2", help="With it, the pressure form is evaluated too.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Show force and pressure limits of body areas, and the speed the standard's contact model allows.

    Example: forcemap limits back_of_hand --moving-mass-kg 30
    """
    areas = fm.read_limit_table(limit_table) if limit_table else fm.standard_limit_table()
    if moving_mass is None and (contact_area is not None or payload is not None):
        raise fm.InputError("moving mass: --contact-area-cm2 and --payload-kg go with --moving-mass-kg")
    assumptions = [
        sentence(fm.Finding.of(fm.FindingKind.FORMULA)),
        sentence(fm.Finding.of(fm.FindingKind.PERSON_AT_REST)),
        sentence(fm.Finding.of(fm.FindingKind.PRESSURE_NOT_ASSESSED))
        if contact_area is None
        else f"pressure assessed over {contact_area:g} cm^2",
        "the transient limit holds only where the contact does not clamp",
    ]
    answers, doubts = [], list[fm.Finding]()
    for area in [name] if name else areas.areas:
        limit = fm.force_limit(area, table=areas)
        doubts += limit.doubts
        by_formula: dict[str, Any] | None = None
        if moving_mass is not None and limit.permitted:
            region = areas.areas[limit.areas[0]].region
            masses = {"moving_mass": moving_mass, "payload": payload}
            model = contact_model(fm.Conditions(), region, **masses, constrained=body is Body.CONSTRAINED)
            by_formula = {**_speeds(limit, model, body, contact_area), "assumptions": assumptions}
        stated = {key: getattr(limit, part) if limit.permitted else None for key, part in _FIGURES.items()}
        answers.append(LimitAnswer.from_result(limit, **stated, contact_model=by_formula))
    answer = LimitsAnswer.from_result(areas, limits=answers, doubts=doubts)
    emit(answer, _lines(answer, areas, assumptions, moving_mass is not None), as_json=as_json)


def _speeds(limit: fm.ForceLimit, model: ContactModel, body: Body, contact_area: float | None) -> dict[str, Any]:
    """What the force form and, for a contact area [cm^2], the pressure form allow; the lower one governs."""
    allowed: dict[str, float | str | None] = {}
    for contact in fm.Contact:
        speeds = {"force": model.speed_limit(limit, contact)}
        if contact_area is not None:
            pressure = limit.transient_pressure if contact is fm.Contact.TRANSIENT else limit.quasi_static_pressure
            area = contact_area / PASCALS
            speeds["pressure"] = pfl_pressure_speed_limit(pressure, contact_area=area, **model.figures)
        governing = min(speeds, key=lambda form: speeds[form])
        name = contact.replace("-", "_")
        allowed |= {f"{name}_speed_mps": speeds[governing], f"{name}_governed_by": governing}
    return {
        **allowed,
        "robot_mass_kg": model.robot_mass,
        "body_mass_kg": model.body_mass,
        "body": body.value,
        "stiffness_N_per_m": model.stiffness,
    }


def _lines(answer: LimitsAnswer, areas: fm.LimitTable, assumptions: list[str], modelled: bool) -> list[str]:
    header = [
        "area or region",
        "region",
        "quasi-static",
        "transient",
        "quasi-static N/cm^2",
        "transient N/cm^2",
        "spring N/mm",
    ]
    rows = [[limit.name, areas.areas[limit.areas[0]].region, *_cells(limit)] for limit in answer.limits]
    lines = [*(f"! {doubt}" for doubt in answer.doubts), *table(header, rows)]
    if modelled:
        lines += ["", *(_model_line(limit) for limit in answer.limits), *listing("Assumes", assumptions)]
    groups = [*areas.both_sides, *areas.regions] if len(rows) > 1 else []
    return [
        *lines,
        *(["", f"names for several areas, with their lowest limits: {', '.join(groups)}"] if groups else []),
        "",
        f"{answer.edition}, table version {answer.version}; {answer.source}",
        "the standard permits no contact with skull, forehead and face; pressures in N/cm^2",
    ]


def _cells(limit: LimitAnswer) -> list[str]:
    if not limit.permitted:
        return ["not permitted", "-", "-", "-", "-"]
    pressures = (limit.quasi_static_N_per_cm2, limit.transient_N_per_cm2)
    spring = "not known" if limit.spring_N_per_m is None else f"{limit.spring_N_per_m / 1000:g}"
    return [f"{limit.quasi_static_N:g} N", f"{limit.transient_N:g} N", *(f"{p:g}" for p in pressures), spring]


def _model_line(limit: LimitAnswer) -> str:
    model = limit.contact_model
    if model is None:
        return f"{limit.name}: no speed, contact is not permitted"
    mass = "constrained" if model.body_mass_kg is None else f"free, {model.body_mass_kg:g} kg"
    return (
        f"{limit.name}: contact model allows {fm.floor_speed(model.quasi_static_speed_mps)} m/s quasi-static "
        f"({model.quasi_static_governed_by}), {fm.floor_speed(model.transient_speed_mps)} m/s transient "
        f"({model.transient_governed_by}); robot mass {model.robot_mass_kg:g} kg, body part {mass}, "
        f"{model.stiffness_N_per_m / 1000:g} N/mm"
    )
