"""forcemap speed and speed-map: safe speeds at a place and on a grid."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

import forcemap as fm
from forcemap.answers.speed import SLOWEST_HINT, SpeedAnswer
from forcemap.campaigns.point_list import POINTS_FILE
from forcemap.cli import options
from forcemap.cli.output import (
    GRID_MARKS,
    accuracy_words,
    assumes,
    bound_words,
    counted,
    emit,
    grid,
    shown,
    speed_cell,
    speed_first,
    table,
    write_result,
)
from forcemap.maps.bounds import FixedMargin

if TYPE_CHECKING:  # `speed` loads nothing of speed maps, nor of several maps
    from forcemap.answers.atlas import AtlasSpeedAnswer
    from forcemap.answers.speed_map import SpeedMapAnswer


def speed(
    source: options.Maps,
    distance: Annotated[float, Option("--distance", help="Distance from the base z-axis [m].")],
    height: Annotated[float, Option("--height", help="Height above the base [m].")],
    limit: options.Limit = None,
    contact: options.ContactKind = None,
    quasi_static: options.QuasiStaticN = None,
    limit_spring: options.LimitSpring = None,
    bound: options.BoundOption = None,
    margin: options.Margin = None,
    form: options.FormName = None,
    device_spring: options.DeviceSpring = None,
    overshoot: options.Overshoot = 0.01,
    as_json: options.Json = False,
) -> int:
    """Give the highest speed to program at a place that the measurements confirm for a force limit.

    Beside it stands the speed at contact, which is higher by the overshoot. Exit code 1 if there is none to program.
    Of an atlas, a folder of campaigns, the lowest of all its maps.

    Example: forcemap speed ur10e --distance 0.8 --height 0.4 --area back_of_hand --contact transient
    """
    force_limit, kind = options.limit_from(limit, contact, quasi_static, limit_spring, source=source)
    case: dict[str, Any] = {"limit": force_limit, "contact": kind, "allowance": fm.Allowance(speed=overshoot)}
    if options.several_maps(source):
        return _speed_of_atlas(source, (distance, height), (bound, margin), form, device_spring, case, as_json=as_json)
    force_map, accuracy = options.force_map_from(source, form, device_spring)
    case["bound"] = options.bound_from(force_map, bound, margin)
    answer = SpeedAnswer.of_place(force_map, (distance, height), accuracy, **case)
    has = {"points": Path(source, POINTS_FILE).is_file(), "slower": len(force_map.slower) > 0}
    emit(answer, speed_lines(answer, **has), as_json=as_json)
    return 1 if answer.speed_to_program_mps is None else 0


def _speed_of_atlas(
    source: str,
    place: tuple[float, float],
    bound: tuple[str | None, float | None],
    form: str | None,
    device_spring: float | None,
    case: dict[str, Any],
    *,
    as_json: bool,
) -> int:
    """The speeds of all maps of an atlas at a place, the lowest first."""
    from forcemap.answers.atlas import AtlasSpeedAnswer
    from forcemap.paths.atlas import Atlas

    if form:
        raise fm.InputError("form: --form goes with one campaign; the maps of an atlas have their own")
    maps = options.maps_from(source, device_spring)
    case["bound"] = options.bound_from(maps, *bound)
    answer = AtlasSpeedAnswer.of_place(Atlas.of(maps), place, **case)
    emit(answer, atlas_speed_lines(answer), as_json=as_json)
    return 1 if answer.speed_to_program_mps is None else 0


def atlas_speed_lines(answer: AtlasSpeedAnswer) -> list[str]:
    """The lowest speed of several maps at a place, a line for each, and what they rest on."""
    speed, where = answer.speed_to_program_mps, f"d = {answer.distance_m:.6g} m, h = {answer.height_m:.6g} m"
    none = [each.map.name for each in answer.maps if each.speed.speed_to_program_mps is None] + answer.without_map
    head = (
        f"Program at most {shown(speed)} m/s at {where}: the lowest of {len(answer.maps)} maps, of {answer.governed_by}"
    )
    if none:
        head = f"No speed to program at {where} that holds for every map: {', '.join(none)} give none"
    rows = [
        [
            each.map.name,
            each.map.direction,
            each.map.contact_site or "not stated",
            each.map.tool or "not stated",
            "-" if each.map.payload_kg is None else f"{each.map.payload_kg:g}",
            each.speed.to_program_outcome,
            shown(each.speed.speed_to_program_mps),
        ]
        for each in answer.maps
    ]
    why = [f"{each.map.name}: {each.speed.to_program_reason}" for each in answer.maps if each.map.name in none]
    return [
        *speed_first(head, answer),
        *why,
        "",
        *table(["map", "direction", "contact site", "tool", "kg", "outcome", "to program m/s"], rows),
        "",
        f"bound: {bound_words(answer.bound)}",
        *assumes(answer),
    ]


def speed_map(
    source: options.Source,
    limit: options.Limit = None,
    contact: options.ContactKind = None,
    quasi_static: options.QuasiStaticN = None,
    limit_spring: options.LimitSpring = None,
    step: Annotated[float, Option("--step-m", help="Distance between places [m].")] = 0.05,
    bound: options.BoundOption = None,
    margin: options.Margin = None,
    form: options.FormName = None,
    device_spring: options.DeviceSpring = None,
    overshoot: options.Overshoot = 0.01,
    output: Annotated[str | None, Option("-o", "--output", help="Write a .csv or .json file.")] = None,
    as_json: options.Json = False,
) -> int:
    """Give safe speeds, to program and at contact, on a grid of places over the measured range.

    Example: forcemap speed-map impacts.csv --area back_of_hand --contact quasi-static -o speeds.csv
    """
    from forcemap.answers.speed_map import SpeedMapAnswer

    if output and not output.endswith((".csv", ".json")):
        raise fm.InputError("found a name that ends otherwise, expected .csv or .json", file=output)
    force_map, accuracy = options.force_map_from(source, form, device_spring)
    force_limit, kind = options.limit_from(limit, contact, quasi_static, limit_spring, source=source)
    used = options.bound_from(force_map, bound, margin)
    case: dict[str, Any] = {
        "limit": force_limit,
        "contact": kind,
        "bound": used,
        "allowance": fm.Allowance(speed=overshoot),
    }
    speeds = fm.speed_map(force_map, *fm.measured_grid(force_map, step), **case)
    answer = SpeedMapAnswer.of_speeds(force_map, speeds, accuracy)
    if output and output.endswith(".csv"):
        write_result(output, speed_map_table(speeds, answer, force_map.source), mark="distance_m,height_m,outcome")
    elif output:
        write_result(output, answer.json_text() + "\n", mark='"limit_N"')
    emit(answer, speed_map_lines(answer, output), as_json=as_json)
    return 0 if speeds.fastest_to_program else 1


def speed_map_table(speeds: fm.SpeedMap, answer: SpeedMapAnswer, source: str) -> str:
    """A speed map as CSV, with all that its speeds rest on in every row."""
    from forcemap.exports.speed_table import speed_map_csv  # `speed` needs none of the exports

    basis = {"limit": answer.limit, "bound": bound_words(answer.bound), "map": source}
    return speed_map_csv(speeds, basis=basis | {"map_sha256": answer.map_sha256})


_FARTHEST = 10.0
"""Distance or height from which a person seems to mean millimetres [m]; a choice: no such robot reaches as far."""

_HINTS = 3
"""Places where a speed is only just missing that are listed; a choice: the nearest come first, --json has all."""

_MARGIN = FixedMargin().describe()
_IN_PROGRAM = (
    "holds at the place itself, straight along the map's direction; lower in what forcemap path and export give: "
    "places up to 5 mm beside it, and motion up to 5 degrees off that direction"
)


def speed_lines(answer: SpeedAnswer, *, points: bool, slower: bool) -> list[str]:
    """The speed to program at a place, the speed at contact, and what they rest on.

    `points` is true where the campaign lists contact points, whose speeds may rest on impacts made there, `slower`
    where it has impacts slower than its map is to hold for.
    """
    program, contact, forces = answer.speed_to_program_mps, "", ""
    where = f"d = {answer.distance_m:.6g} m, h = {answer.height_m:.6g} m"
    head = "No speed to program" if program is None else f"Program at most {shown(program)} m/s"
    if answer.speed_mps is not None:
        contact = f"contact  {shown(answer.speed_mps)} m/s with {answer.speed_overshoot_mps:g} m/s overshoot: "
        forces = f": {answer.bound_force_N:.1f} N at contact, predicted {answer.predicted_force_N:.1f} N"
    elif lowest := answer.at_lowest:
        at = f"{shown(lowest.speed_mps)} m/s at contact, the lowest of the map there"
        forces = f": {lowest.bound_force_N:.1f} N at {at}, predicted {lowest.predicted_force_N:.1f} N"
    straight = [doubt for doubt in answer.warnings if doubt not in answer.off_direction_warnings]
    lines = [
        *speed_first(
            f"{head} at {where}: {answer.to_program_outcome}", answer.model_copy(update={"warnings": straight})
        ),
        f"  {contact}{answer.to_program_reason}",
        f"  limit    {answer.limit}",
        f"  bound    {bound_words(answer.bound)}{forces}",
    ]
    if answer.outcome == "outside":
        ranges = answer.measured_distance_m, answer.measured_height_m
        distance, height = (f"{low:.3f} to {high:.3f} m" for low, high in ranges)
        lines.append(f"  measured distances {distance}, heights {height}")
        if max(answer.distance_m, answer.height_m) >= _FARTHEST:
            lines.append("  distances and heights are in m: 800 mm are 0.8")
    lines += [f"  {line}" for line in quantity_lines(answer)]
    if answer.lowest_measured_speed_mps is not None:
        low, high = shown(answer.lowest_measured_speed_mps), shown(answer.highest_measured_speed_mps)
        lines.append(f"  measured {low} to {high} m/s around this place")
    if answer.nearest and answer.outcome != "outside":
        lines.append(f"  nearest  {_nearest(answer)}")
    if answer.accuracy:
        lines.append(f"  map      {accuracy_words(answer.accuracy)}")
    if answer.bound != _MARGIN:
        margin = answer.margin_10_speed_mps
        beside = answer.margin_10_outcome if margin is None else f"{shown(margin)} m/s at contact"
        lines.append(f"  beside   prediction + 10 %: {beside} (a fixed margin, which promises nothing)")
    if program is not None:
        off = answer.off_direction_to_program_mps
        lines.append(f"  program  {_IN_PROGRAM} ({'no speed' if off is None else f'at most {shown(off)} m/s'})")
        lines += [f"           for that first read: {doubt}" for doubt in answer.off_direction_warnings]
    if points:
        lines.append(
            f"  points   {POINTS_FILE} lists contact points: forcemap report has the speeds measured at them, and of "
            "the map the lowest within 5 mm around them"
        )
    if answer.measure_next:
        hint = shown(answer.measure_next.speed_mps)
        lines.append(f"  next     measure here at about {hint} m/s (a hint, no permission)")
    elif answer.to_program_outcome == "unconfirmed" and answer.accuracy:
        plans = "forcemap next plans what to measure for this limit, or says that no more is to be gained"
        other = "; forcemap evaluate FOLDER --slowest, whether a map from a slower speed on has one here" * slower
        alone = "for this place alone, measure at it (docs/contact_points.md)"
        lines.append(f"  next     {plans}{other}; {alone}")
    return [*lines, *assumes(answer)]


def _nearest(answer: SpeedAnswer) -> str:
    """The largest forces measured at the nearest place, and where that is."""
    first = answer.nearest[0]
    away = math.hypot(first.distance_m - answer.distance_m, first.height_m - answer.height_m)
    names = [state.state_id for state in answer.nearest]
    forces = [
        f"{'at least ' * state.at_least}{state.force_N:.0f} N at {shown(state.speed_mps)} m/s"
        f"{' (measured again)' * (state.state_id in names[:i])}"
        for i, state in enumerate(answer.nearest)
    ]
    where = f"d = {first.distance_m:.3f} m, h = {first.height_m:.3f} m, {100 * away:.0f} cm away"
    return f"{', '.join(forces)}, measured at {where}"


def quantity_lines(answer: SpeedAnswer) -> list[str]:
    """What each of several quantities allows by itself, the one that governs marked; none beside the force alone."""
    lines = []
    for each in answer.quantities or []:
        name = each.quantity.replace("_", " ")
        force = "" if each.bound is None else f", bound {each.bound:.1f} {each.unit}"
        governs = "  GOVERNS" * (each.quantity == answer.governed_by)
        by_itself = f"{shown(each.speed_mps)} m/s at contact by itself ({each.outcome}{force})"
        lines.append(f"{name:14} limit {each.limit:g} {each.unit}: {by_itself}{governs}")
    return lines


def speed_map_lines(answer: SpeedMapAnswer, written: str | None) -> list[str]:
    """Safe speeds on a grid: the fastest, the tables, what to measure next, what all rests on."""
    return [
        *speed_first(fastest_line(answer), answer),
        *standard_lines(answer),
        f"Safe speeds, {answer.limit}",
        f"bound: {bound_words(answer.bound)}",
        "",
        *grid_lines(answer),
        *([_IN_PROGRAM] if any(place.speed_to_program_mps is not None for place in answer.places) else []),
        "",
        "speed at contact in m/s",
        *grid({(p.distance_m, p.height_m): speed_cell(p.outcome, p.speed_mps) for p in answer.places}),
        "",
        *next_lines(answer),
        *([f"written to {written}"] if written else []),
        *([accuracy_words(answer.accuracy)] if answer.accuracy else []),
        *assumes(answer),
    ]


def fastest_line(answer: SpeedMapAnswer) -> str:
    """The speed to program at the fastest place, and at the slowest that has one; else why inside the range."""
    program = [place for place in answer.places if place.speed_to_program_mps is not None]
    if not program:
        inside = [place for place in answer.places if place.outcome != "outside"] or answer.places
        ((reason, count),) = Counter(place.to_program_reason for place in inside).most_common(1)
        places = counted(len(answer.places), "place")
        at = f" (the reason at {count} of {places}; the others have none either)" if count < len(answer.places) else ""
        return f"No speed to program at any place: {reason}{at}"
    slow, fast = (pick(program, key=lambda place: place.speed_to_program_mps or 0.0) for pick in (min, max))
    slowest, share = shown(slow.speed_to_program_mps), math.floor(100 * len(program) / len(answer.places))
    where = f"{shown(fast.speed_to_program_mps)} m/s at d = {fast.distance_m:.4g} m, h = {fast.height_m:.4g} m"
    return (
        f"{len(program)} of {counted(len(answer.places), 'place')} ({share} %) have a speed to program, place by place "
        f"{slowest} m/s to {where}; one speed for all of them: {slowest} m/s (between them it may be less: "
        "forcemap report, export)"
    )


def standard_lines(answer: SpeedMapAnswer) -> list[str]:
    """The standard's one speed beside the map's; nothing where it has none."""
    return [] if answer.standard is None else answer.standard.lines


def grid_lines(answer: SpeedMapAnswer) -> list[str]:
    """Speeds to program as a table, heights downwards."""
    off = f"{answer.speed_overshoot_mps:g} m/s overshoot subtracted"
    places = answer.places
    cells = {(p.distance_m, p.height_m): speed_cell(p.to_program_outcome, p.speed_to_program_mps) for p in places}
    return [f"speed to program in m/s, {off}", *grid(cells), GRID_MARKS]


def next_lines(answer: SpeedMapAnswer) -> list[str]:
    """Why places are unconfirmed, and at which a speed is only just missing."""
    unconfirmed = [place for place in answer.places if place.to_program_outcome == "unconfirmed"]
    reasons = [place.to_program_reason for place in unconfirmed]
    lines = [f"unconfirmed: {reason} ({counted(reasons.count(reason), 'place')})" for reason in dict.fromkeys(reasons)]
    hints = [place for place in unconfirmed if (place.extrapolated_speed_mps or 0.0) > SLOWEST_HINT]
    nearest = sorted(hints, key=lambda hint: -(hint.extrapolated_speed_mps or 0.0))[:_HINTS]
    if nearest:
        lines.append("a speed is only just missing (hints, no permission; forcemap next plans what to measure):")
    for place in nearest:
        speed = shown(place.extrapolated_speed_mps)
        lines.append(f"  d = {place.distance_m:.3f} m, h = {place.height_m:.3f} m: about {speed} m/s")
    return lines
