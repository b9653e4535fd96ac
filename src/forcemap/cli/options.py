"""Options that several commands share, and what they stand for."""

from __future__ import annotations

import contextlib
import math
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from forcemap import (
    CFM_3D,
    PUBLISHED_MAPS,
    Accuracy,
    Bound,
    CensoredImpacts,
    Contact,
    FixedMargin,
    ForceLimit,
    ForceMap,
    ImpactDataset,
    InputError,
    NewtonLimit,
    ToleranceBound,
    fit_force_map,
    force_limit,
    form_named,
    leave_one_state_out,
    map_accuracy,
    published_map,
    read_dataset,
    read_limit_table,
    read_map,
)

STIFFEST = 1000.0
"""Largest spring constant that is taken for one in N/mm; the standard's are 10 to 150, 9000 would be one in N/m."""


class BoundKind(StrEnum):
    """Upper bounds that can be asked for."""

    TOLERANCE = "tolerance"
    MARGIN = "margin"


class Body(StrEnum):
    """Whether the body part can move away."""

    CONSTRAINED = "constrained"
    FREE = "free"


Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Table = Annotated[str, typer.Argument(help="Impacts table (CSV) or campaign folder.")]
Source = Annotated[
    str, typer.Argument(help=f"Map file, impacts table, campaign folder, or {', '.join(PUBLISHED_MAPS)}.")
]
FormName = Annotated[
    str | None,
    typer.Option("--form", help="Form to fit: CFM_2D, CFM_3D (default), FULL_CUBIC or LOG_SPEED; see docs/forms.md."),
]
Area = Annotated[str | None, typer.Option("--area", help="Body area, for example back_of_hand.")]
Region = Annotated[str | None, typer.Option("--region", help="Body region: the lowest limit of its areas.")]
ContactKind = Annotated[Contact | None, typer.Option("--contact", help="Kind of contact.")]
LimitN = Annotated[float | None, typer.Option("--limit-N", help="Force limit in newtons, in place of an area.")]
QuasiStaticN = Annotated[
    float | None,
    typer.Option("--quasi-static-limit-N", help="Quasi-static part of a transient --limit-N, for Phase II forces."),
]
LimitSpring = Annotated[
    float | None,
    typer.Option("--limit-spring-N-per-mm", help="Spring constant of the body part that --limit-N is meant for."),
]
DeviceSpring = Annotated[
    float | None,
    typer.Option("--device-spring-N-per-mm", help="Spring constant of the device, where no campaign.toml states it."),
]
LimitTable = Annotated[str | None, typer.Option("--limit-table", help="Your own table of limits (CSV).")]
BoundOption = Annotated[
    BoundKind | None,
    typer.Option("--bound", help="Upper bound on the force; default: tolerance, for published maps margin."),
]
Margin = Annotated[float | None, typer.Option("--margin", help="Share added by --bound margin; default 0.10.")]
Confidence = Annotated[
    float | None, typer.Option("--confidence", help="Confidence of --bound tolerance; default 0.95.")
]
Content = Annotated[
    float | None, typer.Option("--content", help="Share of states below --bound tolerance; default 0.95.")
]
MovingMass = Annotated[
    float | None,
    typer.Option("--moving-mass-kg", help="Mass of the robot's moving parts; default: as campaign.toml states."),
]
Payload = Annotated[
    float | None,
    typer.Option("--payload-kg", help="Effective payload; default: as campaign.toml states, else 0."),
]
BodyOption = Annotated[
    Body,
    typer.Option("--body", help="constrained: the body part cannot move away; free: the region's own mass."),
]


def force_map_from(
    source: str, form: str | None, device_spring: float | None = None
) -> tuple[ForceMap, Accuracy | None]:
    """The map a source stands for: a published one, a map file, or a table whose train rows are fitted.

    `device_spring` [N/mm] states the device's spring of a table without campaign.toml. With the map's accuracy: on the
    table's test states, else with each state left out; None where neither can be.
    """
    if form and (source in PUBLISHED_MAPS or source.lower().endswith(".json")):
        raise InputError("form: --form goes with an impacts table; a map has its own form")
    if device_spring is not None and (source in PUBLISHED_MAPS or source.lower().endswith(".json")):
        raise InputError("device spring: --device-spring-N-per-mm goes with an impacts table; a map states its own")
    if source in PUBLISHED_MAPS and not Path(source).exists():
        return published_map(source), None
    if not Path(source).exists():
        raise InputError(f"no such file, folder or published map ({', '.join(PUBLISHED_MAPS)})", file=source)
    if source.lower().endswith(".json"):
        force_map = read_map(source)
        with contextlib.suppress(InputError):  # a published map, or as many states as coefficients
            return force_map, leave_one_state_out(force_map)
        return force_map, None
    dataset, force_map = fitted(source, form, device_spring=device_spring)
    return force_map, map_accuracy(force_map, dataset)[0]


def fitted(
    table: str,
    form: str | None,
    impacts: CensoredImpacts = CensoredImpacts.AT_LEAST,
    *,
    device_spring: float | None = None,
) -> tuple[ImpactDataset, ForceMap]:
    """The impacts of a table or campaign folder, and the map fitted to its train rows."""
    dataset = read_dataset(table, device_stiffness=stiffness(device_spring))
    return dataset, fit_force_map(dataset, form=form_named(form or CFM_3D.name), impacts=impacts)


def stiffness(spring: float | None) -> float | None:
    """A spring constant in N/mm as N/m."""
    if spring is not None and not 0 < spring <= STIFFEST:
        raise InputError(
            f"spring: found {spring:g}, expected N/mm above 0 and up to {STIFFEST:g} (75000 N/m are 75 N/mm)"
        )
    return None if spring is None else 1000 * spring


def limit_from(
    area: str | None,
    region: str | None,
    newtons: float | None,
    contact: Contact | None,
    limit_table: str | None,
    quasi_static: float | None = None,
    spring: float | None = None,
) -> tuple[ForceLimit | NewtonLimit, Contact | None]:
    """The limit that the options name, and the kind of contact."""
    name = area or region
    if sum(option is not None for option in (area, region, newtons)) != 1 or name == "":
        raise InputError("limit: expected one of --area, --region or --limit-N")
    if newtons is not None:
        if limit_table is not None:
            raise InputError("limit: --limit-table goes with --area or --region, not with --limit-N")
        return NewtonLimit(newtons, quasi_static, stiffness(spring)), contact
    if quasi_static is not None or spring is not None:
        raise InputError("limit: --quasi-static-limit-N and --limit-spring-N-per-mm go with --limit-N")
    if contact is None:
        raise InputError("contact: expected --contact transient or --contact quasi-static")
    assert name is not None
    return force_limit(name, table=read_limit_table(limit_table) if limit_table else None), contact


def bound_from(
    force_map: ForceMap, kind: BoundKind | None, margin: float | None, confidence: float | None, content: float | None
) -> Bound:
    """The bound the options name; a tolerance bound for a fitted map, a margin for a published one."""
    kind = kind or (BoundKind.MARGIN if force_map.fit is None else BoundKind.TOLERANCE)
    if kind is BoundKind.MARGIN:
        if confidence is not None or content is not None:
            raise InputError("bound: --confidence and --content go with --bound tolerance")
        return FixedMargin(0.10 if margin is None else margin)
    if margin is not None:
        raise InputError("margin: --margin goes with --bound margin")
    bound = ToleranceBound(
        0.95 if confidence is None else confidence,
        0.95 if content is None else content,
        force_map.conditions.device.error_or_default,
    )
    bound.require(force_map)
    return bound


def masses_from(
    conditions: Any, moving_mass: float | None, payload: float | None, body: Body, region_mass: float
) -> tuple[float, float, float]:
    """Moving mass M, payload m_L and body mass m_H [kg]."""
    mass = conditions.moving_mass if moving_mass is None else moving_mass
    if math.isnan(mass):
        raise InputError("moving mass: not stated by the campaign; give --moving-mass-kg")
    load = payload if payload is not None else 0.0 if math.isnan(conditions.payload) else conditions.payload
    return mass, load, math.inf if body is Body.CONSTRAINED else region_mass
