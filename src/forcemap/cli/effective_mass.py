"""forcemap effective-mass."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import typer

from forcemap import EffectiveMass, InputError, MassOutcome, Robot, robot_effective_mass_at, robot_mass_map
from forcemap.cli.options import Json
from forcemap.cli.output import emit, table
from forcemap.cli.robot_options import (
    Base,
    DriveInertiaOption,
    Tip,
    ToolDirection,
    direction_from,
    figures,
    robot_from,
)

_NOT = "effective mass is no force: no safe speed follows from it"


def effective_mass(
    robot: Annotated[str, typer.Argument(help="ur10e, kuka-iiwa7, or the file of a URDF.")],
    distance: Annotated[float | None, typer.Option("--distance", help="Distance from the base z-axis [m].")] = None,
    height: Annotated[float | None, typer.Option("--height", help="Height above the base [m].")] = None,
    distances: Annotated[str | None, typer.Option("--distances-m", help="For a map: distances, ascending.")] = None,
    heights: Annotated[str | None, typer.Option("--heights-m", help="For a map: heights, ascending.")] = None,
    direction: Annotated[str, typer.Option("--direction", help="Of the impact: down, up, out, or x,y,z.")] = "down",
    tool_direction: ToolDirection = "down",
    drive_inertia: DriveInertiaOption = None,
    payload: Annotated[float, typer.Option("--payload-kg", help="Payload, a point mass at the flange.")] = 0.0,
    base: Base = None,
    tip: Tip = None,
    as_json: Json = False,
) -> None:
    """Show the effective mass of a robot at a place, or a map of it.

    Example: forcemap effective-mass ur10e --distance 0.8 --height 0.4 --drive-inertia-kgm2 identified
    """
    found = robot_from(robot, base, tip, drive_inertia, payload)
    stands = {
        "direction": direction_from("direction", direction),
        "tool_direction": direction_from("tool direction", tool_direction),
    }
    if distance is not None and height is not None and distances is None and heights is None:
        mass = robot_effective_mass_at(found, distance, height, **stands)
        emit(_head(found, mass, stands) | _place(distance, height, mass.value, mass.outcome),
             _lines(found, mass, _at(distance, height, mass)), as_json=as_json)  # fmt: skip
        if mass.outcome is not MassOutcome.REGULAR:
            raise typer.Exit(1)
        return
    if distance is not None or height is not None or distances is None or heights is None:
        raise InputError("place: expected --distance and --height, or --distances-m and --heights-m for a map")
    over = robot_mass_map(found, figures("distances", distances), figures("heights", heights), **stands)
    cells = [
        _place(float(d), float(h), float(over.mass.value[i, j]), over.mass.outcome[i, j])
        for i, d in enumerate(over.distances)
        for j, h in enumerate(over.heights)
    ]
    result: dict[str, Any] = {
        "places": cells,
        "trend_with_distance": over.trend_with_distance.value,
        "trend_with_height": over.trend_with_height.value,
        "force_ratio": over.force_ratio,
    }
    rows = [
        [f"{h:.3f}", *(_cell(over.mass, i, j) for i in range(over.distances.size))]
        for j, h in reversed(list(enumerate(over.heights)))
    ]
    lines = [
        "effective mass in kg; . unreachable, ! singular or no motion",
        *table(["h \\ d [m]", *(f"{d:.3f}" for d in over.distances)], rows),
        f"with distance: {over.trend_with_distance}; with height: {over.trend_with_height}; "
        f"forces would vary by a factor of {over.force_ratio:.2f} if they followed sqrt(m_u)",
    ]
    emit(_head(found, over.mass, stands) | result, _lines(found, over.mass, lines), as_json=as_json)


def _head(robot: Robot, mass: EffectiveMass, stands: dict[str, tuple[float, ...]]) -> dict[str, Any]:
    drives = mass.drive_inertia
    return {
        "robot": robot.name,
        "moving_mass_kg": robot.moving_mass,
        "load_kg": robot.load,
        "standard_effective_mass_kg": robot.standard_effective_mass,
        **{key: list(components) for key, components in stands.items()},
        "drive_inertia_kg_m2": None if drives is None else drives.values.tolist(),
        "assumption": mass.assumption,
        "not": _NOT,
    }


def _place(distance: float, height: float, value: float, outcome: MassOutcome) -> dict[str, Any]:
    return {"distance_m": distance, "height_m": height, "effective_mass_kg": value, "outcome": outcome.value}


def _at(distance: float, height: float, mass: EffectiveMass) -> list[str]:
    where = f"at d = {distance:g} m, h = {height:g} m"
    if mass.outcome is MassOutcome.REGULAR:
        return [f"effective mass {mass.value:.3f} kg {where}"]
    return [f"no effective mass {where}: {mass.outcome.value.replace('_', ' ')}"]


def _cell(mass: EffectiveMass, i: int, j: int) -> str:
    if np.isfinite(mass.value[i, j]):
        return f"{mass.value[i, j]:.2f}"
    return "." if mass.outcome[i, j] is MassOutcome.UNREACHABLE else "!"


def _lines(robot: Robot, mass: EffectiveMass, found: list[str]) -> list[str]:
    return [
        *found,
        f"the standard's, for every place: {robot.standard_effective_mass:.1f} kg "
        f"(M = {robot.moving_mass:.1f} kg, m_L = {robot.load:g} kg)",
        mass.assumption,
        _NOT,
    ]
