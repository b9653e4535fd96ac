"""forcemap compare: force models beside each other, and two maps."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

import forcemap as fm
from forcemap.answers.accuracy import AccuracyAnswer
from forcemap.answers.comparison import AllowedSpeed, Body, ComparisonAnswer
from forcemap.answers.effective_mass import MassComparisonAnswer
from forcemap.answers.two_maps import RatioAt, TwoMapsAnswer
from forcemap.assessment.folder import read_recorded
from forcemap.assessment.folder_map import folder_map
from forcemap.cli.effective_mass import mass_comparison_lines
from forcemap.cli.options import (
    FormName,
    Json,
    MovingMass,
    Payload,
    areas_from,
    bound_from,
    campaign_table,
    force_map_from,
    too_few_states_named,
    wanted_form,
)
from forcemap.cli.output import (
    accuracy_lines,
    bound_words,
    change,
    counted,
    emit,
    listing,
    outside_lines,
    shown,
    table,
    verdict_first,
)
from forcemap.cli.task_options import (
    ContactOffset,
    DriveInertiaOption,
    Posture,
    ToolAxis,
    ToolDirection,
    direction_from,
    robot_from,
)
from forcemap.comparisons.contact_model import contact_model
from forcemap.comparisons.map_and_standard import BY_THE_MAP, compare_map_with_standard

_MassRobot = Annotated[
    str | None,
    Option(
        "--effective-mass",
        help="Compare with the effective mass of this robot: ur10e, kuka-iiwa7, FILE.urdf[:base=LINK][:tip=LINK].",
    ),
]


def compare(
    table: Annotated[str, Argument(help="Impacts table (CSV), campaign folder, or a map.")],
    other: Annotated[
        str | None, Argument(help="Another map: then the two maps are compared, the other over the first.")
    ] = None,
    region: Annotated[
        str | None, Option("--area", help="Body area or region that is hit; default: that of the contact points.")
    ] = None,
    moving_mass: MovingMass = None,
    payload: Payload = None,
    body: Annotated[
        Body | None,
        Option("--body", help="constrained (default): the body part cannot move away; free: the region's own mass."),
    ] = None,
    form: FormName = None,
    robot: _MassRobot = None,
    drive_inertia: DriveInertiaOption = None,
    tool_direction: ToolDirection = "down",
    tool_axis: ToolAxis = "z",
    contact_offset: ContactOffset = None,
    posture: Posture = None,
    as_json: Json = False,
) -> None:
    """Compare the measured map with the 2D map and the standard's contact model on the same states.

    A map alone stands for the measurement: compare kuka-iiwa7-30nm. Or two maps with each other, over the range that
    both have measured: compare MAP MAP. Or a map, or measured impacts, with what effective mass alone would give:
    compare ur10e --effective-mass ur10e.

    Example: forcemap compare impacts.csv --area back_of_hand --moving-mass-kg 30
    """
    if robot is not None:
        if any(option is not None for option in (other, region, moving_mass, body)):
            raise fm.InputError(
                "compare: --effective-mass goes with one map or table, a robot, its load and its stance"
            )
        arm = robot_from(robot, None, None, drive_inertia, payload or 0.0, contact_offset, tool_axis, posture)
        _compare_with_mass(table, form, arm, direction_from("tool direction", tool_direction), as_json=as_json)
        return
    if (drive_inertia, contact_offset, posture, tool_direction, tool_axis) != (None, None, None, "down", "z"):
        raise fm.InputError(
            "compare: --drive-inertia-kgm2, --contact-offset-m, --posture-deg, --tool-direction and --tool-axis "
            "go with --effective-mass"
        )
    if other is not None:
        if any(option is not None for option in (region, moving_mass, payload, body)):
            raise fm.InputError("compare: --area, --moving-mass-kg, --payload-kg and --body go with one impacts table")
        _compare_two_maps(table, other, form, as_json=as_json)
        return
    masses = {"moving_mass": moving_mass, "payload": payload}
    _compare_models(table, form, region, masses, constrained=body is not Body.FREE, as_json=as_json)


def _compare_with_mass(
    source: str, form: str | None, robot: fm.Robot, tool_direction: tuple[float, ...], *, as_json: bool
) -> None:
    """A map, or measured impacts, beside what the effective mass of a robot alone would give."""
    forces = force_map_from(source, form)[0] if _is_map(source) else read_recorded(source)
    comparison = fm.compare_effective_mass(forces, robot, tool_direction=tool_direction)
    emit(MassComparisonAnswer.of_comparison(comparison), mass_comparison_lines(comparison), as_json=as_json)


def _compare_two_maps(source: str, other: str, form: str | None, *, as_json: bool) -> None:
    """Two maps beside each other, over the range that both have measured."""
    maps = (_force_map(source, form, beside=other), _force_map(other, form, beside=source))
    simulated = any(force_map.simulated for force_map in maps)
    answer = TwoMapsAnswer.from_result(fm.compare_maps(*maps), simulated=simulated)
    lines = maps_lines(answer, (source, other))
    if not (_is_map(other) or answer.same_map):
        lines += ["", f"impacts were fitted to compare maps; {_for_impacts(other, source)}"]
    emit(answer, lines, as_json=as_json)


def _compare_models(
    source: str,
    form: str | None,
    region: str | None,
    masses: dict[str, float | None],
    *,
    constrained: bool,
    as_json: bool,
) -> None:
    """A map, or the map of measured impacts, beside the 2D map and the standard's contact model."""
    areas = areas_from(source, [region] if region else None)
    if len(areas) > 1:
        raise fm.InputError(f"area: expected --area, one of those of the contact points: {', '.join(areas)}")
    limit = fm.force_limit(areas[0], table=campaign_table(source))
    usable = limit if limit.permitted else None
    if _is_map(source):
        force_map = force_map_from(source, form)[0]
        model = contact_model(force_map.conditions, limit.name, **masses, constrained=constrained)
        compared = compare_map_with_standard(force_map, **model.figures, bound=bound_from(force_map), limit=usable)
        of_map = ComparisonAnswer.of_comparison(compared, limit, simulated=force_map.simulated)
        others = f"beside another map: compare {source} OTHER; {_for_impacts('IMPACTS', source)}"
        emit(of_map, [*comparison_lines(of_map), "", others], as_json=as_json)
        return
    dataset = read_recorded(source)
    model = contact_model(dataset.conditions, limit.name, **masses, constrained=constrained)
    with too_few_states_named(source, form):
        case: dict[str, Any] = {"form": wanted_form(form), "limit": usable}
        force_map = folder_map(source, dataset, form=case["form"]).force_map
        comparison = fm.compare_force_models(dataset, **model.figures, **case, force_map=force_map)
    answer = ComparisonAnswer.of_comparison(comparison, limit, simulated=dataset.simulated)
    emit(answer, comparison_lines(answer), as_json=as_json)


def _is_map(source: str) -> bool:
    return source.lower().endswith(".json") or (source in fm.PUBLISHED_MAPS and not Path(source).exists())


def _force_map(source: str, form: str | None, *, beside: str) -> fm.ForceMap:
    """The map of a source; where its impacts are too few for one, the error names the command to compare impacts."""
    try:
        return force_map_from(source, form)[0]
    except fm.FitError as error:
        raise type(error)(
            f"{error.problem}; compare takes two maps, or impacts enough to fit one; {_for_impacts(source, beside)}",
            file=error.file or source,
        ) from None


def _for_impacts(impacts: str, source: str) -> str:
    """The command that compares impacts with a map; a published map has no measured states to tell if it holds."""
    if _is_map(source) and source in fm.PUBLISHED_MAPS:
        return f"to see how far its predictions lie from impacts: evaluate {impacts} --map {source}"
    return f"to see whether a map still holds for new impacts: evaluate {impacts} --against {source}"


def comparison_lines(answer: ComparisonAnswer) -> list[str]:
    """Whether one gains by the map, and where the standard's contact model is wrong; then the models in figures."""
    standard, variation = answer.models[-1], answer.variation
    lines = verdict_first(_gain(answer), answer.warnings, simulated=answer.simulated)
    of, words = ("predicted", "by the map") if answer.on == BY_THE_MAP else ("measured", "measured")
    for share, side, extreme in (
        (standard.underestimated_share, "underestimates", standard.most_underestimated),
        (standard.overestimated_share, "overestimates", standard.most_overestimated),
    ):
        most = ""
        if extreme:
            place = f"d = {extreme.distance_m:.3f} m, h = {extreme.height_m:.3f} m, v = {extreme.speed_mps:.3f} m/s"
            forces = f"{extreme.predicted_N:.0f} N for {extreme.measured_N:.0f} N {words}"
            most = f"; most by {abs(extreme.error_percent):.1f} % ({forces}) at {place}"
        of_states = f"{100 * share:.0f} % of {counted(standard.accuracy.states, 'state')}"
        lines.append(f"the standard's contact model {side} {of_states}{most}")
    correlations = (variation.rank_correlation_distance, variation.rank_correlation_height)
    with_d, with_h = ("nan" if r is None else f"{r:.2f}" for r in correlations)
    lines += [
        f"over the workspace at {variation.speed_mps:.3f} m/s the {of} force varies "
        f"from {variation.lowest_force_N:.0f} to {variation.highest_force_N:.0f} N (x {variation.ratio:.2f}, "
        f"{variation.states} states); rank correlation {with_d} with distance, {with_h} with height",
        "",
        f"Force models on {answer.on} (underestimation is the dangerous side)",
        *accuracy_lines(list(_accuracies(answer))),
        *outside_lines(each for model in answer.models[:1] for each in (model.accuracy, model.accuracy_all)),
        *(f"{model.model}: {model.note}" for model in answer.models if model.note),
    ]
    if answer.allowed:
        header = ["speeds at contact [m/s]", "limit", "measured places", "permitted", "lowest", "median", "highest"]
        sources = dict.fromkeys(f"{model.limit_N:g} N: {model.limit_source}" for model in answer.allowed)
        rows = [
            [model.model, f"{model.limit_N:g} N", str(model.places), _permitted(model)]
            + [shown(speed) for speed in (model.lowest_speed_mps, model.median_speed_mps, model.highest_speed_mps)]
            for model in answer.allowed
        ]
        lines += ["", *table(header, rows)]
        lines += [f"maps with {bound_words(answer.bound)}; places of all states, test ones too", *sources]
        lines += [f"{model.model} at {model.limit_N:g} N: {model.note}" for model in answer.allowed if model.note]
    return [*lines, "", *listing("Assumes", answer.assumptions)]


def _permitted(model: AllowedSpeed) -> str:
    """At how many measured places a model permits a speed; a formula, which has one all the same, permits nothing."""
    formula = not model.confirmed_places and model.median_speed_mps is not None
    return "formula" if formula else str(model.confirmed_places)


def _gain(answer: ComparisonAnswer) -> str:
    """At how many measured places the map permits more than the standard's one speed, for each contact."""
    if not answer.allowed:
        return f"no speeds: contact with {answer.area} is not permitted"
    parts = []
    for contact in dict.fromkeys(row.contact for row in answer.allowed):
        of_map, *_, standard = (row for row in answer.allowed if row.contact == contact)
        one, places = f"{shown(standard.highest_speed_mps)} m/s", counted(of_map.places, "measured place")
        counts = f"{of_map.note or f'permits nothing at any of {places}'} (standard: {one})"
        if of_map.confirmed_places:
            capped = f" (at {of_map.places_capped} of these nothing faster was measured)" * bool(of_map.places_capped)
            counts = (
                f"permits more than the standard's {one} at {of_map.places_with_more} of {places}, less at "
                f"{of_map.places_with_less}{capped}, nothing at {of_map.places - of_map.confirmed_places}; up to "
                f"{shown(of_map.highest_speed_mps)} m/s at contact"
            )
        parts.append(f"{contact}, {of_map.limit_N:g} N: {counts}")
    return f"The map beside the standard: {'; '.join(parts)}"


def _accuracies(answer: ComparisonAnswer) -> Iterator[tuple[str, AccuracyAnswer]]:
    """Each model on the states compared, then on all as in the paper's tables; once where these are the same."""
    for model in answer.models:
        yield model.model, model.accuracy
        if answer.on != BY_THE_MAP:
            yield f"  {model.accuracy_all.on}", model.accuracy_all


def maps_lines(answer: TwoMapsAnswer, names: tuple[str, str]) -> list[str]:
    """A comparison of two maps, which are called as the person named them."""
    low, high = answer.lowest, answer.highest
    maps = [f"one:   {names[0]}: {answer.one}", f"other: {names[1]}: {answer.other}"]
    if answer.same_map:
        return [*verdict_first("the same map", simulated=answer.simulated), *maps]
    average = (
        f"force of the other over the one, on average: {change(answer.mean_ratio)} "
        f"(geometric mean {change(answer.geometric_mean_ratio)})"
    )
    return [
        *verdict_first(average, simulated=answer.simulated),
        _extreme("highest", answer.largest),
        _extreme("lowest", answer.smallest),
        f"the other is the higher one in {100 * answer.higher_share:.1f} % of the range",
        "",
        *maps,
        f"over the range that both have measured: d {low.distance_m:.3f} to {high.distance_m:.3f} m, "
        f"h {low.height_m:.3f} to {high.height_m:.3f} m, v {low.speed_mps:.3f} to {high.speed_mps:.3f} m/s, "
        f"{answer.points} points",
        "",
        *listing("Assumes", answer.assumptions),
    ]


def _extreme(word: str, extreme: RatioAt) -> str:
    return (
        f"  {word:8}{change(extreme.ratio)} at d = {extreme.distance_m:.3f} m, h = {extreme.height_m:.3f} m, "
        f"v = {fm.floor_speed(extreme.speed_mps)} m/s ({extreme.other_N:.1f} N against {extreme.one_N:.1f} N)"
    )
