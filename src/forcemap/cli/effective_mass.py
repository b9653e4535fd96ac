"""forcemap effective-mass, and a comparison with effective mass as text."""

from __future__ import annotations

from typing import Annotated, NoReturn

import numpy as np
from typer import Argument, Exit, Option

import forcemap as fm
from forcemap.answers.accuracy import AccuracyAnswer
from forcemap.answers.effective_mass import MassAnswer, MassMapAnswer, PlaceMass, PlaceMassAnswer
from forcemap.cli.options import Json
from forcemap.cli.output import accuracy_lines, emit, grid, listing, table, verdict_first
from forcemap.cli.task_options import (
    Base,
    ContactOffset,
    DriveInertiaOption,
    Posture,
    Tip,
    ToolAxis,
    ToolDirection,
    direction_from,
    figures,
    robot_from,
)
from forcemap.comparisons.effective_mass import MassComparison
from forcemap.dynamics.effective_mass import MassOutcome
from forcemap.dynamics.kinematics import forward_kinematics
from forcemap.dynamics.mass_map import robot_mass_in_posture, robot_mass_map
from forcemap.words import posture_words, sentences, tool_words


def effective_mass(
    robot: Annotated[str, Argument(help="ur10e, kuka-iiwa7, or the file of a URDF.")],
    distance: Annotated[float | None, Option("--distance", help="Distance from the base z-axis [m].")] = None,
    height: Annotated[float | None, Option("--height", help="Height above the base [m].")] = None,
    distances: Annotated[str | None, Option("--distances-m", help="For a map: distances, ascending.")] = None,
    heights: Annotated[str | None, Option("--heights-m", help="For a map: heights, ascending.")] = None,
    direction: Annotated[str, Option("--direction", help="Of the impact: down, up, out, or x,y,z.")] = "down",
    posture: Posture = None,
    tool_direction: ToolDirection = "down",
    tool_axis: ToolAxis = "z",
    contact_offset: ContactOffset = None,
    drive_inertia: DriveInertiaOption = None,
    payload: Annotated[float, Option("--payload-kg", help="Payload, a point mass at the flange.")] = 0.0,
    base: Base = None,
    tip: Tip = None,
    as_json: Json = False,
) -> None:
    """Show the effective mass of a robot at a place, in a posture, or a map of it.

    At a place the tool's axis points where --tool-direction says; the turn about it is free, and of the postures that
    are left the one nearest to a reference is taken. It is shown: another posture is another effective mass.

    Example: forcemap effective-mass ur10e --distance 0.8 --height 0.4 --drive-inertia-kgm2 identified
    """
    chosen = robot_from(robot, base, tip, drive_inertia, payload, contact_offset, tool_axis, posture)
    stands = {
        "direction": direction_from("direction", direction),
        "tool_direction": direction_from("tool direction", tool_direction),
    }
    if posture is not None and all(option is None for option in (distance, height, distances, heights)):
        if tool_direction != "down":
            raise fm.InputError("tool direction: a posture says by itself where the tool points; leave one of them out")
        pose = forward_kinematics(chosen, chosen.reference_posture)
        stands["tool_direction"] = tuple((pose.rotation @ chosen.tool_axis).tolist())
        if direction == "out":
            stands["direction"] = (*pose.position[:2].tolist(), 0.0)
        mass = robot_mass_in_posture(chosen, chosen.reference_posture, direction=stands["direction"])
        _show_place(PlaceMassAnswer.of_map(chosen, mass, **stands), as_json)
    if distance is not None and height is not None and distances is None and heights is None:
        _show_place(
            PlaceMassAnswer.of_map(chosen, robot_mass_map(chosen, [distance], [height], **stands), **stands), as_json
        )
    if distance is not None or height is not None or distances is None or heights is None:
        raise fm.InputError("place: expected --distance and --height, or --distances-m and --heights-m for a map")
    over = robot_mass_map(chosen, figures("distances", distances), figures("heights", heights), **stands)
    answer = MassMapAnswer.of_map(chosen, over, **stands)
    lines = [
        "effective mass in kg; . unreachable, ! singular or no motion",
        *grid({(place.distance_m, place.height_m): _cell(place) for place in answer.places}),
        f"with distance: {over.trend_with_distance}; with height: {over.trend_with_height}; "
        f"forces would vary by a factor of {over.force_ratio:.2f} if they followed sqrt(m_u)",
    ]
    emit(answer, [*verdict_first(lines[0], answer.findings), *lines[1:], *_rests_on(answer)], as_json=as_json)


def _show_place(place: PlaceMassAnswer, as_json: bool) -> NoReturn:
    where = f"at d = {place.distance_m:.6g} m, h = {place.height_m:.6g} m"
    regular = place.outcome is MassOutcome.REGULAR
    words = f"no effective mass {where}: {place.outcome.replace('_', ' ')}"
    verdict = f"effective mass {place.effective_mass_kg:.3f} kg {where}" if regular else words
    emit(place, [*verdict_first(verdict, place.findings), *_rests_on(place)], as_json=as_json)
    raise Exit(int(not regular))


def _cell(place: PlaceMass) -> str:
    if place.effective_mass_kg is not None:
        return f"{place.effective_mass_kg:.2f}"
    return "." if place.outcome is MassOutcome.UNREACHABLE else "!"


def _rests_on(answer: MassAnswer) -> list[str]:
    if isinstance(answer, PlaceMassAnswer):
        posture = f"posture: {posture_words(answer.posture)}" if answer.posture else "no posture reaches it"
    else:
        posture = f"postures (in --json) nearest to {posture_words(answer.reference_posture)}"
    return [
        f"{answer.robot}: {answer.source}",
        posture,
        tool_words(answer.tool_axis, answer.tool_direction, answer.contact_offset_m),
        f"the standard's, for every place: {answer.standard_effective_mass_kg:.1f} kg "
        f"(M = {answer.moving_mass_kg:.1f} kg, m_L = {answer.load_kg:g} kg)",
        answer.assumption,
        answer.not_,
    ]


def _explained(share: float) -> str:
    """A share of the variance of ln F; below zero a constant force would explain more."""
    return "worse than a constant" if share < 0 else f"{100 * share:.0f} %"


def mass_comparison_lines(comparison: MassComparison) -> list[str]:
    """A comparison of forces with effective mass in words."""
    mass = comparison.measured_mass
    lines = [
        f"Forces of {comparison.on} at {comparison.speed:g} m/s beside F = v sqrt(k m_u) of {comparison.robot}",
        f"they vary by a factor of {comparison.force_spread:.2f}; "
        f"the effective mass that they would take, (F / v)^2 / k, is {mass.min():.1f} to {mass.max():.1f} kg",
        "",
    ]
    header = ["effective mass", "places", "m_u", "force / F", "rank corr.", "of ln F explained", "with one factor"]
    rows = [
        [
            explanation.name,
            str(explanation.places),
            f"{np.nanmin(explanation.mass.value):.1f} to {np.nanmax(explanation.mass.value):.1f} kg",
            f"{np.nanmin(explanation.ratio):.2f} to {np.nanmax(explanation.ratio):.2f}",
            f"{explanation.rank_correlation:.2f}",
            *map(_explained, (explanation.explained_share, explanation.explained_share_scaled)),
        ]
        for explanation in comparison.explanations
    ]
    lines += [*table(header, rows), "", "Errors of F (underestimation is the dangerous side)"]
    errors = [(each.name, AccuracyAnswer.from_result(each.accuracy)) for each in comparison.explanations]
    lines += accuracy_lines(errors)
    for explanation in comparison.explanations:
        places = comparison.distance.tolist(), comparison.height.tolist()
        ratios = zip(*places, explanation.ratio.tolist(), strict=True)
        cells = {(d, h): f"{ratio:.2f}" if np.isfinite(ratio) else "." for d, h, ratio in ratios}
        lines += ["", f"force / F, {explanation.name}", *grid(cells)]
    return [*lines, "", *listing("This holds for", sentences(comparison.statements))]
