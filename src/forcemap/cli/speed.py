"""forcemap speed."""

from __future__ import annotations

import math
from typing import Annotated, Any

import typer

from forcemap import (
    Accuracy,
    ContactNotPermitted,
    FixedMargin,
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
from forcemap.cli.output import emit, listing
from forcemap.cli.results import accuracy_result, accuracy_words, limit_result, limit_words, other_statements


def speed(
    source: Source,
    distance: Annotated[float, typer.Option("--distance", help="Distance from the base z-axis [m].")],
    height: Annotated[float, typer.Option("--height", help="Height above the base [m].")],
    area: Area = None,
    region: Region = None,
    contact: ContactKind = None,
    limit_newtons: LimitN = None,
    quasi_static: QuasiStaticN = None,
    limit_spring: LimitSpring = None,
    limit_table: LimitTable = None,
    bound_kind: BoundOption = None,
    margin: Margin = None,
    confidence: Confidence = None,
    content: Content = None,
    form: FormName = None,
    device_spring: DeviceSpring = None,
    as_json: Json = False,
) -> None:
    """Give the highest speed at a place that the measurements confirm for a force limit.

    Example: forcemap speed ur10e --distance 0.8 --height 0.4 --area back_of_hand --contact transient
    """
    force_map, accuracy = force_map_from(source, form, device_spring)
    limit, contact = limit_from(area, region, limit_newtons, contact, limit_table, quasi_static, limit_spring)
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
        "warnings": [],
        "distance_m": distance,
        "height_m": height,
        "accuracy": None if accuracy is None else accuracy_result(accuracy),
        "assumptions": [],
        "map_sha256": map_sha256(force_map),
    }
    try:
        case: dict[str, Any] = {"limit": limit, "contact": contact}
        found = safe_speed(force_map, distance, height, bound=bound, **case)
        with_margin = safe_speed(force_map, distance, height, bound=FixedMargin(0.10), **case)
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
        "warnings": list(found.warnings),
        "assumptions": list(found.statements),
    }
    emit(
        result,
        _lines(accuracy, found, with_margin, result, limit_words(limit, contact), str(bound)),
        as_json=as_json,
    )
    raise typer.Exit(0 if found.outcome.has_speed else 1)


def _measure_next(found: SafeSpeed, distance: float, height: float) -> dict[str, float] | None:
    """Where a measurement would turn "unconfirmed" into an answer."""
    if found.outcome is not SpeedOutcome.UNCONFIRMED or not found.extrapolated_speed > 0:
        return None
    return {"distance_m": distance, "height_m": height, "speed_mps": found.extrapolated_speed}


def _lines(
    accuracy: Accuracy | None,
    found: SafeSpeed,
    with_margin: SafeSpeed,
    result: dict[str, Any],
    limit: str,
    bound: str,
) -> list[str]:
    has_speed = found.outcome.has_speed
    head = f"{floor_speed(found.speed)} m/s" if has_speed else "no speed"
    forces = f": {found.bound_force:.1f} N at this speed, predicted {found.predicted_force:.1f} N" if has_speed else ""
    lines = [
        *found.warnings,
        f"{head} at d = {result['distance_m']:.6g} m, h = {result['height_m']:.6g} m: {found.outcome}",
        f"  {found.reason}",
        f"  limit    {limit}",
        f"  bound    {bound}{forces}",
    ]
    if not math.isnan(found.lowest_measured_speed):
        low, high = floor_speed(found.lowest_measured_speed), floor_speed(found.highest_measured_speed)
        lines.append(f"  measured {low} to {high} m/s around this place")
    if accuracy:
        lines.append(f"  map      {accuracy_words(accuracy)}")
    if result["bound"] != FixedMargin(0.10).describe():
        beside = f"{floor_speed(with_margin.speed)} m/s" if with_margin.outcome.has_speed else with_margin.outcome
        lines.append(f"  beside   prediction + 10 %: {beside} (a fixed margin, which promises nothing)")
    if result["measure_next"]:
        hint = floor_speed(found.extrapolated_speed)
        lines.append(f"  next     measure here at about {hint} m/s (a hint, no permission)")
    return [*lines, *listing("Assumes", other_statements(found))]
