"""forcemap path and place: speeds along a path, and positions of a table."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from typer import Argument, Option

from forcemap import Allowance, ForceMap, Task, ToolPath, path_speeds, place_task
from forcemap.answers.path import (
    AlongAnswer,
    Best,
    GapAnswer,
    Inside,
    PathAnswer,
    PieceAnswer,
    PlacesAnswer,
    Position,
    Refused,
    SlowestAnswer,
    Suggestion,
)
from forcemap.cli import options, task_options
from forcemap.cli.output import (
    MOST_DISTANCES,
    Progress,
    assumes,
    bound_words,
    counted,
    emit,
    grid,
    shown,
    speed_first,
    table,
    write_result,
)
from forcemap.direction import DIRECTIONS, WIDEST_ANGLE, angle_between, direction_vector, raised_off_axis
from forcemap.errors import few
from forcemap.paths.atlas import Atlas
from forcemap.paths.bent_path import bent_path
from forcemap.paths.path_file import MADE, moved_csv, path_csv
from forcemap.paths.table_positions import TaskPlaces, table_positions
from forcemap.words import sentence


def path(
    source: options.Maps,
    file: Annotated[
        str,
        Argument(
            metavar="PATH", help="Path (CSV): x_m, y_m, z_m in the frame of the base; segment, speed_mps or time_s."
        ),
    ],
    task: options.TaskOrLimit = None,
    contact: options.ContactKind = None,
    acceleration: task_options.Acceleration = None,
    step: Annotated[float, Option("--step-m", help="Longest piece that gets one speed.")] = 0.02,
    angle: task_options.Angle = WIDEST_ANGLE,
    overshoot: options.Overshoot = 0.01,
    tolerance: task_options.PositionTolerance = 0.005,
    stated: task_options.PathOptions = None,
    bound: options.BoundOption = None,
    margin: options.Margin = None,
    device_spring: options.DeviceSpring = None,
    suggest: Annotated[
        str | None,
        Option(
            "--suggest",
            metavar="CSV",
            help="Write the path bent to vertical, radial and circular moves.",
        ),
    ] = None,
    as_json: options.Json = False,
) -> int:
    """Give the speeds allowed along a path, where it must slow down and why, and the cycle time.

    Several maps of one robot, each for a direction, contact site, tool or payload, are an atlas: a folder of campaigns.

    Exit code 0 if every piece is permitted and none is programmed too fast (or no speed is programmed, which is said);
    1 if a piece has no permission or is programmed too fast.

    Example: forcemap path impacts.csv path.csv --task task.toml
    """
    maps = options.maps_from(source, device_spring)
    used, given = options.bound_from(maps, bound, margin), options.stated(task, source)
    tool_path = task_options.path_from(file, stated)
    whole_task = task_options.task_from(given, tool_path.names, contact, acceleration)
    allowance = Allowance(speed=overshoot, position=tolerance)
    case: dict[str, Any] = {"bound": used, "allowance": allowance, "step": step, "angle": angle, "table": given.table}
    speeds = path_speeds(maps, tool_path, whole_task, **case)
    bent = bent_path(maps, tool_path, whole_task, **case) if suggest else None
    if suggest and bent and bent.bent:
        write_result(suggest, path_csv(bent.path), mark=MADE)
    answer = PathAnswer.of_path(speeds, used, bent=bent)
    emit(answer, path_lines(answer, file, suggest, angle=angle), as_json=as_json)
    return 1 if speeds.too_fast.any() else 0


def place(
    source: options.Maps,
    file: Annotated[
        str, Argument(metavar="PATH", help="Path (CSV) in the frame of the table: x_m outwards, y_m, z_m up.")
    ],
    task: options.TaskOrLimit = None,
    contact: options.ContactKind = None,
    acceleration: task_options.Acceleration = None,
    step: Annotated[float, Option("--step-m", help="Distance between positions of the table.")] = 0.05,
    overshoot: options.Overshoot = 0.01,
    tolerance: task_options.PositionTolerance = 0.005,
    bound: options.BoundOption = None,
    margin: options.Margin = None,
    device_spring: options.DeviceSpring = None,
    output: Annotated[
        str | None,
        Option("-o", "--output", metavar="CSV", help="Write the path as it lies at the best position, for path."),
    ] = None,
    as_json: options.Json = False,
) -> int:
    """Find where to put the table: the cycle time of a task at every position in the measured range.

    It is moved outwards and in height; across (y) it stays as the path has it: shift the path's y and ask again.

    Where none permits the whole path it looks closer, around the one that permits most.

    Exit code 1 if no position permits the whole path; then it says why.

    Example: forcemap place impacts.csv table_path.csv --area back_of_hand --contact transient --step-m 0.1
    """
    maps = options.maps_from(source, device_spring)
    used, given = options.bound_from(maps, bound, margin), options.stated(task, source)
    tool_path = task_options.path_from(file)
    whole_task = task_options.task_from(given, tool_path.names, contact, acceleration)
    allowance = Allowance(speed=overshoot, position=tolerance)
    case: dict[str, Any] = {"bound": used, "allowance": allowance, "table": given.table}
    places = _placed(maps, tool_path, whole_task, step, **case)
    if finer := places.finer_step(step):
        closer = _placed(maps, tool_path, whole_task, finer, around=places.most_permitted[:2], **case)
        places = places if closer.best is None else closer
    if output and places.best:
        write_result(output, moved_csv(file, *places.best[:2]), mark=MADE)
    answer = PlacesAnswer.of_places(places, used, step=step, finer=finer, file=output if places.best else None)
    emit(answer, places_lines(answer), as_json=as_json)
    return 1 if places.best is None else 0


def _placed(
    maps: ForceMap | Atlas,
    path: ToolPath,
    task: Task,
    step: float,
    *,
    around: tuple[float, float] | None = None,
    **case: Any,
) -> TaskPlaces:
    """Positions of the table, as `place_task`, counted while they are computed."""
    distance, height = table_positions(maps, path, step, around)
    with Progress("positions", distance.size * height.size) as progress:
        return place_task(maps, path, task, step=step, around=around, progress=progress.show, **case)


_GAPS = 3
"""Directions to measure that are listed; a choice: who needs more bends the path."""

_FASTEST = 10
"""Positions of a table that are listed where a grid has too many; a choice: --json has all."""

_LEAST_GAIN = 0.05
"""Time gained [s] that is worth saying: less is shown as 0.0 s."""

_SHORT = 0.001
"""Of the slowest piece [m], below which its length is said; a choice: shorter than any motion that is programmed."""

_ROUNDING = 1e-6
"""Of a figure in millimetres: what rounding leaves of 525.0000001."""

_HINTS = {
    "not_downward": "not downward: the map permits no such motion (a row of the path names the motion that begins at "
    "it); if other measures exclude contact there, say so in a task file (--task) with contact_possible = false for "
    "that segment",
    "no_map": "no map: measure what is missing, bend the path (--suggest FILE.csv tries it), "
    "or say so in a task file (--task) with contact_possible = false where other measures exclude contact",
    "outside": "outside: move the path into the measured range, less the position tolerance ({inside}), or measure "
    "there",
}
_PARTLY = (
    "only a part of {segments} points another way: do not exclude contact on all of it for that. Where a log has no "
    "row at a turn, add it or log more often; where measured positions tremble, log the commanded ones; else name that "
    "motion as a segment of its own in the file, and bend it (--suggest FILE.csv tries it) or measure in its direction"
)
_TOO_SLOW = (
    "unconfirmed: a piece counts all places up to {tolerance_mm:g} mm beside it (position tolerance), so it may be "
    "refused where forcemap speed has a speed; end the descent higher, move the path to where forcemap speed-map has "
    "higher speeds{place}, or measure at lower speeds there (forcemap next)"
)
_HINTS_BY_REASON = {
    "unconfirmed": _TOO_SLOW,
    "zone_unconfirmed": _TOO_SLOW,
    "below_measured": _TOO_SLOW,
    "below_measured_of": _TOO_SLOW,
    "off_direction": "off the map's direction: program the motion straight along it, and what is left of the way as a "
    "move of its own (--suggest FILE.csv writes such a path), end the descent higher, move the path, or measure at "
    "lower speeds there (forcemap next)",
    "no_map_of": "no map of this contact site, tool or payload: correct what the task or campaign.toml states, if one "
    "is wrong, else measure with it",
    "transient_not_usable": "unconfirmed: ask for the quasi-static limit there (--contact quasi-static, or contact = "
    '"quasi-static" in the task file)',
}


def path_lines(
    answer: PathAnswer, file: str, suggested: str | None = None, *, angle: float = WIDEST_ANGLE
) -> list[str]:
    """Whether a path may be driven as programmed, if not why, its stretches of equal outcome, and cycle times.

    `suggested` is the file of the bent path, if one was asked for.
    """
    rows, reasons, several = [], [], len(answer.maps) > 1
    turns = _turns(answer)
    only_turns = len(turns) == sum(piece.outcome in _NO_DIRECTION for piece in answer.pieces)
    for (name, outcome, reason, governed_by, map_name, _), group in itertools.groupby(
        answer.pieces,
        key=lambda each: (each.segment, each.outcome, each.reason, each.governed_by, each.map_name, each.too_fast),
    ):
        pieces = list(group)
        where = f"{_place(pieces[0].from_m)} to {_place(pieces[-1].to_m)}"
        speeds = [piece.speed_mps for piece in pieces if piece.speed_mps is not None]
        allowed = f"{shown(min(speeds))} to {shown(max(speeds))}" if speeds else "-"
        length = _length(sum(piece.length_m for piece in pieces))
        by = f"{governed_by} ({map_name})" if several and map_name else governed_by
        rows.append([name, length, where, outcome, allowed, _programmed(pieces), by])
        if not speeds:
            reasons.append(f"{name}, {where}{_when(pieces[0])}: no permission, {reason}")
    programmed = "programmed, at most" if answer.timed else "programmed"
    header = ["segment", "length m", "d, h m", "outcome", "to program m/s", programmed, "governed by"]
    return [
        *speed_first(_verdict(answer), answer),
        *reasons,
        *_turn_lines(turns),
        *_hints(answer, [each for each in answer.refusals if not (only_turns and each.outcome in _NO_DIRECTION)]),
        *gap_lines([] if only_turns else answer.gaps, suggest=answer.suggestion is None),
        *([] if answer.suggestion is None else suggestion_lines(answer.suggestion, suggested)),
        "",
        f"Speeds to program along {file}: {len(answer.pieces)} pieces, {answer.length_m:.3f} m; at contact "
        f"{answer.speed_overshoot_mps:g} m/s overshoot is added",
        *([sentence(task_options.path_raised())] if raised_off_axis(angle) > 1 else []),
        *table(header, rows),
        *(_too_fast(answer) if answer.too_fast else []),
        *_slowest(answer),
        "",
        *_cycle_lines(answer, refused=not answer.permitted),
        f"bound: {bound_words(answer.bound)}",
        *assumes(answer),
    ]


def _length(metres: float) -> str:
    """A length in metres to the millimetre, one below it to two digits."""
    return f"{metres:.3f}" if metres >= 0.001 or not metres else f"{metres:.2g}"


def _when(piece: PieceAnswer) -> str:
    """When the motion of a piece begins, of a path with times."""
    return "" if piece.time_s is None else f", {piece.time_s:.3f} s after the first row"


_NO_DIRECTION = ("not_downward", "no_map")
_LONGEST_TURN = 0.005
"""Of a piece that a missing row may explain [m]: what a robot does between two rows, 20 ms at 0.25 m/s."""
_LONGEST_MISNAMED = 0.001
"""Of a piece that already goes as the next segment [m], whose row may be named after the old one; a choice."""
_STRAY = 3.0
"""Angle that rounding of a log turns a piece by [degrees]: 0.01 mm in 0.2 mm; a choice."""


def _turns(answer: PathAnswer) -> list[PieceAnswer]:
    """Pieces of a log refused for their direction alone that may be the chord across a corner without a row of its own:
    the short first or last one of a segment, beside a piece of it with permission, pointing between the motions before
    and after."""
    if not answer.timed:
        return []
    return [
        piece
        for before, piece, after in zip(answer.pieces, answer.pieces[1:], answer.pieces[2:], strict=False)
        if piece.outcome in _NO_DIRECTION
        and before.segment != after.segment
        and piece.length_m <= _LONGEST_TURN
        and any(
            beside.segment == piece.segment
            and beside.speed_mps is not None
            and _cuts_corner(before, piece, after, other)
            for beside, other in ((before, after), (after, before))
        )
    ]


def _cuts_corner(before: PieceAnswer, piece: PieceAnswer, after: PieceAnswer, other: PieceAnswer) -> bool:
    """True if a piece points between those before and after it, or along one if these are opposite; `other` is the one
    of these in another segment."""
    if not (before.length_m and piece.length_m and after.length_m):
        return False
    comes, chord, goes, across = (
        np.subtract(each.to_m, each.from_m) / each.length_m for each in (before, piece, after, other)
    )
    turn, first, second = angle_between(comes, goes), angle_between(comes, chord), angle_between(chord, goes)
    if turn > 180 - _STRAY:
        return min(first, second) < _STRAY
    own = piece.length_m > _LONGEST_MISNAMED and angle_between(chord, across) < _STRAY  # a motion of some length
    return first + second < turn + _STRAY and not own


def _turn_lines(turns: Sequence[PieceAnswer]) -> list[str]:
    """What to do where a log may lack the row of a corner."""
    return [
        f"  {1000 * piece.length_m:.2g} mm of {piece.segment} where it meets another segment{_when(piece)}: if the "
        "robot turned there, the row of the corner is missing or has the name of the other motion (a row names the "
        "motion from it): correct that row's name, add the row, or log more often; if the robot moved as the rows say, "
        "this piece has no permission"
        for piece in turns
    ]


def refusal_lines(answer: PathAnswer) -> list[str]:
    """Which segments have no permission and why, and what can be done about it."""
    return [*(f"  {each.segment}: {each.reason}" for each in answer.refusals), *_hints(answer, answer.refusals)]


def gap_lines(gaps: Sequence[GapAnswer], *, suggest: bool = False) -> list[str]:
    """What to measure so that more of a path has permission, most first; an estimate of what it gains.

    `suggest`: that the path may be bent is proposed, too.
    """
    if not gaps:
        return []
    lines = ["To close the gaps measure (ESTIMATES, no permission; places and limits must allow it, too)"]
    for gap in gaps[:_GAPS]:
        load = "" if gap.payload_kg is None else f"{gap.payload_kg:g} kg"
        with_ = ", ".join(filter(None, (gap.contact_site, f"tool {gap.tool}" * bool(gap.tool), load)))
        gain = gap.estimated_gain_s or 0.0
        worth = f", {gain:.1f} s faster than by the standard" if gain >= _LEAST_GAIN else ""
        what = f"for {few(gap.segments, _GAPS)}, moving {_direction(gap.direction)}: a campaign of at least "
        states = f"{counted(gap.states, 'state')}{f' ({with_})' * bool(with_)}"
        permits = f"may permit {gap.length_m:.3f} m that has no permission now"
        lines.append(f"  {what}{states}, which {permits}{worth}")
    more = gaps[_GAPS:]
    if more:
        length = sum(gap.length_m for gap in more)
        lines.append(f"  and {counted(len(more), 'more direction')} for {length:.3f} m")
    if suggest:
        lines.append("  whether vertical, radial and circular moves would have more permission: --suggest FILE.csv")
    return lines


def _direction(words: str) -> str:
    """A direction: its name, or how far it points from one with a name, and its numbers for campaign.toml."""
    vector = direction_vector(words, whose="a gap")
    name, near = min(DIRECTIONS.items(), key=lambda item: angle_between(vector, item[1]))
    return words if words in DIRECTIONS else f"{angle_between(vector, near):.0f} degrees off {name} (direction {words})"


def suggestion_lines(suggestion: Suggestion, file: str | None) -> list[str]:
    """What the bent path permits, and what it still lacks."""
    if not suggestion.bent_moves:
        return ["Nothing is bent, and nothing written: no move would have permission on a longer part of its way"]
    refused, time = (1 - suggestion.permitted_share) * suggestion.length_m, suggestion.cycle_time_s
    permitted = f"on {suggestion.length_m - refused:.3f} of {suggestion.length_m:.3f} m, the rest has no permission"
    words = permitted if time is None else f"as a whole, {time:.3f} s"
    moves = counted(suggestion.bent_moves, "move")
    return [
        f"{file}: {moves} bent to vertical, radial and circular ones, permitted {words}; another way, to be checked "
        "for collisions before it is driven; without times or programmed speeds",
        *([_ASIDE] if time is None else []),
        *gap_lines(suggestion.gaps),
    ]


_ASIDE = (
    "  Moves without permission keep their segment's name: where contact on them is excluded otherwise, give them one "
    "of their own in this file, and in the task with contact_possible = false"
)


def _place(point: list[float]) -> str:
    x, y, z = point
    return f"{math.hypot(x, y):.3f}, {z:.3f}"


def _too_fast(answer: PathAnswer) -> list[str]:
    """What the mark says, and how speeds of two motions that meet are stated apart."""
    by_points = answer.programmed_by_points
    lines = ["! programmed faster than this path may be driven there: slow down to the speed to program"]
    if by_points:
        lines.append(
            "  a motion counts with the faster speed_mps of its two points; if each is the speed of the motion to its "
            "point, call the column speed_to_point_mps, of the motion from it, as segment is, speed_from_point_mps"
        )
    return lines


def _slowest(answer: PathAnswer) -> list[str]:
    """Where the lowest allowed speed is, and what gives it; nothing without a speed."""
    if (piece := answer.slowest) is None:
        return []
    of_map = f" in {piece.map_name}" if len(answer.maps) > 1 else ""
    capped = ", capped at the highest speed measured there" if piece.outcome == "capped" else ""
    length = math.dist(piece.from_m, piece.to_m)
    short = f", over {1000 * length:.2g} mm" if answer.timed and length < _SHORT else ""
    short += ", as where a log has no row at a corner" if short and _stands_out(piece, answer.pieces) else ""
    return [
        f"slowest: {shown(piece.speed_to_program_mps)} m/s on {piece.segment} from {_place(piece.from_m)} to "
        f"{_place(piece.to_m)}: {piece.limit_N:g} N, {piece.governed_by}{of_map}{capped}{short}"
    ]


def _stands_out(slowest: SlowestAnswer, pieces: Sequence[PieceAnswer]) -> bool:
    """True if a piece of a path moves in another direction than those before and after it."""
    moved = [each for each in pieces if each.length_m]
    for around in zip(moved, moved[1:], moved[2:], strict=False):
        if (around[1].from_m, around[1].to_m) == (slowest.from_m, slowest.to_m):
            before, own, after = (np.subtract(each.to_m, each.from_m) / each.length_m for each in around)
            return min(angle_between(before, own), angle_between(own, after)) > _STRAY
    return False


def _programmed(pieces: list[PieceAnswer]) -> str:
    """The programmed speeds of pieces, from the slowest on: each is compared with its own allowed one."""
    speeds = [piece.programmed_speed_mps for piece in pieces if piece.programmed_speed_mps is not None]
    if len(speeds) < len(pieces):
        return "-"
    fast = any(piece.too_fast and piece.speed_mps is not None for piece in pieces)
    both = dict.fromkeys(f"{speed:.3f}" for speed in (min(speeds), max(speeds)))
    return f"{' to '.join(both)}{' !' if fast else ''}"


def _verdict(answer: PathAnswer) -> str:
    """Whether the path may be driven as it is programmed."""
    verdicts = []
    if not answer.permitted:
        share = _share(answer.refused_length_m, answer)
        verdicts.append(f"NOT PERMITTED on {share} of the path; there the robot must not move with a person in reach")
    if answer.too_fast:
        share = _share(answer.too_fast_length_m, answer)
        verdicts.append(
            f"TOO FAST where marked !, on {share} of the path{_by_mean(answer)}: slow down to the allowed speed "
            f"there{_slowed(answer)}"
        )
    allowed, standard, *_ = answer.cycle_times
    times = "" if allowed.cycle_time_s is None else f", {allowed.cycle_time_s:.3f} s"
    times += "" if standard.cycle_time_s is None else f" ({standard.cycle_time_s:.3f} s {_standard(answer)})"
    at_allowed = f"at the allowed speeds{times.removeprefix(',')}"
    if answer.timed:  # the program's own times are the file's, and compare with each other alone
        at_allowed = f"computed with at most {answer.acceleration_mps2:g} m/s^2, {at_allowed}"
    if verdicts:
        return "; ".join([*verdicts, *[at_allowed] * bool(times)])
    if not answer.programmed:
        return f"permitted at the allowed speeds{times}; not compared with a program, which is not stated everywhere"
    return f"permitted as programmed; {at_allowed}"


def _by_mean(answer: PathAnswer) -> str:
    """Where a timed path is too fast by its means already: what else is too fast, rows closer in time may clear."""
    by_mean = answer.too_fast_by_mean_length_m
    if by_mean is None or _share(by_mean, answer) == _share(answer.too_fast_length_m, answer):  # more rows clear none
        return ""
    where = f"on {_share(by_mean, answer)} of the path" if by_mean else "nowhere"
    return (
        f" ({where} by the mean between rows; else as the robot may be faster between two rows: more rows may clear it)"
    )


def _standard(answer: PathAnswer | PlacesAnswer) -> str:
    """The standard's one speed, and where the map does not permit it."""
    return f"at the standard's one speed{_beyond(', which the map does not permit on {} of the path', answer)}"


def _beyond(words: str, answer: PathAnswer | PlacesAnswer) -> str:
    """Words with the share of the path on which the map does not permit the standard's one speed; empty without any."""
    return words.format(_percent(answer.standard_beyond_share)) if answer.standard_beyond_share else ""


def _slowed(answer: PathAnswer) -> str:
    """The cycle times of the program slowed down and as it is, where the whole path has both."""
    allowed, *_, program, slowed = (each.cycle_time_s for each in answer.cycle_times)
    if program is None or slowed is None:
        return ""
    need = ""
    if answer.timed and allowed is not None and slowed < allowed:
        need = f"; these times need more than the {answer.acceleration_mps2:g} m/s^2 of the allowed speeds' time"
    by = ", by the file's times" if answer.timed else ""
    return f" ({slowed:.3f} s so slowed, {program:.3f} s as programmed{by}{need})"


def _share(length: float, answer: PathAnswer) -> str:
    return _percent(length / answer.length_m)


def _percent(share: float) -> str:
    return "less than 1 %" if share < 0.01 else f"{100 * share:.0f} %"


def _hints(answer: AlongAnswer, refusals: Sequence[Refused]) -> list[str]:
    """What can be done about pieces without permission."""
    kinds = {each.reason_kind for each in refusals}
    figures = {
        "inside": "; ".join(_inside(each, several=len(answer.maps) > 1) for each in answer.inside),
        "tolerance_mm": 1000 * answer.position_tolerance_m,
        "place": "" if isinstance(answer, PlacesAnswer) else " (forcemap place finds where the table stands best)",
    }
    permitted = {piece.segment for piece in getattr(answer, "pieces", ()) if piece.speed_mps is not None}
    partly = sorted({each.segment for each in refusals if each.outcome in _NO_DIRECTION} & permitted)
    by_outcome = [each for each in refusals if each.reason_kind not in _HINTS_BY_REASON]
    whole = {each.outcome for each in by_outcome if each.segment not in partly or each.outcome not in _NO_DIRECTION}
    hints = [_PARTLY.format(segments=few(partly, _GAPS))] * bool(partly)
    hints += [hint for outcome, hint in _HINTS.items() if outcome in whole]
    hints += [hint for kind, hint in _HINTS_BY_REASON.items() if kind in kinds]
    return [f"  {hint.format(**figures)}" for hint in dict.fromkeys(hints)]


def _inside(inside: Inside, *, several: bool) -> str:
    """The distances and heights at which a path lies inside a map's range, to the millimetre and not beyond."""
    ends = (inside.distance_from_m, inside.distance_to_m), (inside.height_from_m, inside.height_to_m)
    texts = []
    for name, (low, high) in zip("dh", ends, strict=True):
        low, high = math.ceil(1000 * low - _ROUNDING) / 1000, math.floor(1000 * high + _ROUNDING) / 1000
        texts.append(f"{name} {low:.3f} to {high:.3f} m" if low <= high else f"no {name}, its range is too small")
    of_map = f"{inside.map_name}: " if several else ""
    of_site = f" of {inside.contact_site}" if inside.contact_site else ""
    return f"{of_map}{'' if inside.whole else 'within '}{', '.join(texts)}{of_site}"


def places_lines(answer: PlacesAnswer) -> list[str]:
    """The best position of a table and what shifting it costs, or why none is permitted; then all positions."""
    if answer.best is None:
        most = answer.most_permitted
        share, place = 100 * most.permitted_share, f"d = {most.distance_m:g} m, h = {most.height_m:g} m"
        none = f"NO POSITION has permission for the whole path on a grid of {answer.step_m:g} m"
        if answer.finer_step_m is not None:
            none += f", nor around the best of it on one of {answer.finer_step_m:g} m"
        lines = speed_first(f"{none}; most, {math.floor(share)} %, at {place}", answer)
        lines += [
            f"  {part.segment}: {part.length_m:.3f} m {part.outcome.replace('_', ' ')}, {part.reason}"
            for part in answer.refusals
        ]
        lines += _hints(answer, answer.refusals)
        if answer.without:
            lines.append(
                f"  {few(answer.without, _GAPS)}: a part has a speed at none of the positions, also where it lies in "
                "the measured range: another position hardly helps; measure at lower speeds (forcemap next), or see "
                "whether the limits of the task are right"
            )
        elif {part.outcome for part in answer.refusals} <= {"outside", "unconfirmed"}:
            finer = (answer.finer_step_m or answer.step_m) / 2
            lines.append(f"  a finer grid may still have one: --step-m {finer:g}, which takes longer")
    else:
        best = answer.best
        verdict = f"best: {best.cycle_time_s:.3f} s at d = {best.distance_m:g} m, h = {best.height_m:g} m"
        verdict += ", at the allowed speeds"
        _, standard, *_, program, _ = answer.cycle_times
        if program.cycle_time_s is not None and f"{program.cycle_time_s:.3f}" != f"{best.cycle_time_s:.3f}":
            verdict += f" ({program.cycle_time_s:.3f} s as programmed)"
        if standard.cycle_time_s is not None:
            verdict += f", {standard.cycle_time_s:.3f} s {_standard(answer)}"
        if answer.finer_step_m is not None:
            verdict += f"; on a grid of {answer.finer_step_m:g} m, since one of {answer.step_m:g} m has none"
        lines = [
            *speed_first(verdict, answer),
            f"of positions every {answer.finer_step_m or answer.step_m:g} m outwards and in height (--step-m); across, "
            "the table stays where the path's y has it: shift y and ask again",
        ]
        if answer.too_fast_share:
            lines.append(
                f"  ! programmed too fast there on {_percent(answer.too_fast_share)} of the path: slow down to the "
                "speeds that forcemap path has there"
            )
        if answer.as_fast > 1:
            lines.append(
                f"  {answer.as_fast} positions are as fast to 1 ms; this one allows the highest speeds of them"
            )
        for shift in answer.sensitivity:
            change = shift.cycle_time_change_s
            cost = "a part has no permission" if change is None else f"{change:+.3f} s"
            lines.append(f"  moved by {shift.distance_shift_m:+.3f} m, {shift.height_shift_m:+.3f} m: {cost}")
        lines += [] if answer.as_fast > 1 else _edge(answer.positions, best, answer.finer_step_m or answer.step_m)
        if answer.file:
            lines.append(f"{answer.file}: the path moved there, in the frame of the base, with its times or speeds")
        lines += ["", "at the best position", *_cycle_lines(answer, refused=False)]
    return [*lines, "", *_positions(answer), f"bound: {bound_words(answer.bound)}", *assumes(answer)]


def _edge(positions: Sequence[Position], best: Best, step: float) -> list[str]:
    """That the best position is an outermost one of those tried, so that better ones may lie beyond."""
    tried = np.array([(each.distance_m, each.height_m) for each in positions])
    own = np.array([best.distance_m, best.height_m])
    edges = (tried.min(axis=0) < tried.max(axis=0)) & ((own == tried.min(axis=0)) | (own == tried.max(axis=0)))
    names = [name for name, at_edge in zip(("d", "h"), edges.tolist(), strict=True) if at_edge]
    edge = f"  it lies at the edge of the positions tried, in {' and '.join(names)}"
    return [f"{edge}: less than {step:g} m beyond may be a better one (--step-m {step / 2:g})"] if names else []


def _positions(answer: PlacesAnswer) -> list[str]:
    """The cycle times as a table of places; of too many the fastest."""
    permitted = [each for each in answer.positions if each.cycle_time_s is not None]
    looked = counted(len(answer.positions), "position")
    if not permitted:
        return [f"none of {looked} has permission for the whole path; --json has the permitted share of each"]
    if len({each.distance_m for each in answer.positions}) <= MOST_DISTANCES:
        times = {(each.distance_m, each.height_m): each.cycle_time_s for each in answer.positions}
        title = "cycle time [s] at the allowed speeds, the table's frame at d, h; ? where a part has no permission"
        return [title, *grid({place: "?" if time is None else f"{time:.3f}" for place, time in times.items()})]
    fastest = sorted(permitted, key=lambda each: each.cycle_time_s or 0.0)[:_FASTEST]
    title = f"the fastest of {len(permitted)} positions with permission for the whole path, of {looked}; --json has all"
    rows = [[f"{each.distance_m:g}", f"{each.height_m:g}", f"{each.cycle_time_s:.3f}"] for each in fastest]
    return [title, *table(["d [m]", "h [m]", "cycle time [s]"], rows)]


def _cycle_lines(answer: PathAnswer | PlacesAnswer, *, refused: bool) -> list[str]:
    rows = []
    for row in answer.cycle_times:
        parts = (row.cycle_time_s, row.permitted_time_s)
        rows.append([row.rule, shown(row.speed_mps), *("-" if t is None else f"{t:.3f} s" for t in parts)])
    if answer.standard_beyond_share:
        rows[1][-1] = "not permitted"
    most = f"at most {answer.acceleration_mps2:g} m/s^2"
    lines = table([f"cycle time at ({most})", "m/s", "whole path", "permitted part"], rows)
    lines += (
        [beyond]
        if (beyond := _beyond("the map does not permit the standard's one speed on {} of the path", answer))
        else []
    )
    lines += [answer.standard_of] if answer.standard_of else []
    if answer.timed:
        own = "acceleration_mps2 in the task, without one --acceleration-mps2"
        lines.append(
            f"as programmed, and so slowed: by the file's times; the other rows computed with {most}, state yours "
            f"({own}). Compare each kind with its own: at every start and stop they differ by up to a row's time"
        )
    if answer.waits_s:
        part = ", of the permitted part those at its points" if refused else ""
        lines.append(f"the file's waits, {answer.waits_s:.3f} s, are in every row{part}")
    if answer.contact_excluded:
        lines.append("where contact is excluded, every row is at the task's speed")
    _, standard, *_ = answer.cycle_times
    if standard.cycle_time_s is None and not refused:
        lines.append("no time at the standard's speed: the campaign does not state the robot's moving mass")
    return lines
