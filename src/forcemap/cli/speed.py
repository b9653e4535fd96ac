"""forcemap speed."""

from __future__ import annotations

import math
from typing import Annotated, Any

import typer

from forcemap import (
    ContactNotPermitted,
    FixedMargin,
    ForceMap,
    SafeSpeed,
    SpeedOutcome,
    floor_speed,
    map_sha256,
    safe_speed,
)
from forcemap.cli.options import (
    Area,
    BoundOption,
    Confidence,
    ContactKind,
    Content,
    FormName,
    Json,
    LimitN,
    LimitTable,
    Margin,
    Region,
    Source,
    bound_from,
    force_map_from,
    limit_from,
)
from forcemap.cli.output import emit, listing
from forcemap.cli.results import limit_result, limit_words


def speed(
    source: Source,
    distance: Annotated[float, typer.Option("--distance", help="Distance from the base z-axis [m].")],
    height: Annotated[float, typer.Option("--height", help="Height above the base [m].")],
    area: Area = None,
    region: Region = None,
    contact: ContactKind = None,
    limit_newtons: LimitN = None,
    limit_table: LimitTable = None,
    bound_kind: BoundOption = None,
    margin: Margin = None,
    confidence: Confidence = None,
    content: Content = None,
    form: FormName = "CFM_3D",
    as_json: Json = False,
) -> None:
    """Give the highest speed at a place that the measurements confirm for a force limit.

    Example: forcemap speed ur10e --distance 0.8 --height 0.4 --area back_of_hand --contact transient
    """
    force_map = force_map_from(source, form)
    limit, contact = limit_from(area, region, limit_newtons, contact, limit_table)
    bound = bound_from(force_map, bound_kind, margin, confidence, content)
    result: dict[str, Any] = {
        "outcome": "not_permitted",
        "reason": "",
        "speed_mps": None,
        "extrapolated_speed_mps": None,
        **limit_result(limit, contact),
        "bound": bound.describe(),
        "bound_force_N": None,
        "predicted_force_N": None,
        "margin_10_speed_mps": None,
        "lowest_measured_speed_mps": None,
        "highest_measured_speed_mps": None,
        "measure_next": None,
        "distance_m": distance,
        "height_m": height,
        "assumptions": [],
        "map_sha256": map_sha256(force_map),
    }
    try:
        found = safe_speed(force_map, distance, height, limit=limit, bound=bound, contact=contact)
        with_margin = safe_speed(force_map, distance, height, limit=limit, bound=FixedMargin(0.10), contact=contact)
    except ContactNotPermitted as error:
        result["reason"] = error.message
        emit(result, [f"no speed: {error.message}"], as_json=as_json)
        raise typer.Exit(1) from None
    result |= {
        "outcome": found.outcome,
        "reason": found.reason,
        "speed_mps": found.speed,
        "extrapolated_speed_mps": found.extrapolated_speed,
        "bound_force_N": found.bound_force,
        "predicted_force_N": found.predicted_force,
        "margin_10_speed_mps": with_margin.speed,
        "lowest_measured_speed_mps": found.lowest_measured_speed,
        "highest_measured_speed_mps": found.highest_measured_speed,
        "measure_next": _measure_next(found, distance, height),
        "assumptions": list(found.statements),
    }
    emit(
        result,
        _lines(force_map, found, with_margin, result, str(bound), limit_words(limit, contact)),
        as_json=as_json,
    )
    raise typer.Exit(0 if found.outcome.has_speed else 1)


def _measure_next(found: SafeSpeed, distance: float, height: float) -> dict[str, float] | None:
    """Where a measurement would turn "unconfirmed" into an answer."""
    if found.outcome is not SpeedOutcome.UNCONFIRMED or not found.extrapolated_speed > 0:
        return None
    return {"distance_m": distance, "height_m": height, "speed_mps": found.extrapolated_speed}


def _lines(
    force_map: ForceMap,
    found: SafeSpeed,
    with_margin: SafeSpeed,
    result: dict[str, Any],
    bound: str,
    limit: str,
) -> list[str]:
    place = f"at d = {result['distance_m']:.3f} m, h = {result['height_m']:.3f} m"
    head = f"{floor_speed(found.speed)} m/s" if found.outcome.has_speed else "no speed"
    lines = [f"{head} {place}: {found.outcome}", f"  {found.reason}", f"  limit    {limit}"]
    if found.outcome.has_speed:
        forces = f"{found.bound_force:.1f} N at this speed, predicted {found.predicted_force:.1f} N"
        lines.append(f"  bound    {bound}: {forces}")
    else:
        lines.append(f"  bound    {bound}")
    if not math.isnan(found.lowest_measured_speed):
        low, high = found.lowest_measured_speed, found.highest_measured_speed
        lines.append(f"  measured {floor_speed(low)} to {floor_speed(high)} m/s at this place")
    if result["bound"] != FixedMargin(0.10).describe():
        lines.append(
            "  beside   prediction + 10 %: "
            + (f"{floor_speed(with_margin.speed)} m/s" if with_margin.outcome.has_speed else with_margin.outcome)
            + ", the paper's margin, which promises nothing"
        )
    if result["measure_next"]:
        lines.append(
            f"  next     measure here at about {floor_speed(found.extrapolated_speed)} m/s (a hint, no permission)"
        )
    return [*lines, *listing("Assumes", [f"map: {force_map.source}", *found.statements])]
