"""Speeds along a path, and positions of a table: what `path` and `place` answer."""

from __future__ import annotations

import math
from typing import Any, Self

import numpy as np

from forcemap.answers.answer import AllSaid, Answer, AtPlace, Bound, Figure, Said, of
from forcemap.answers.atlas import AtlasMapAnswer
from forcemap.arrays import Mask
from forcemap.findings import Finding, FindingKind
from forcemap.paths.atlas import Atlas
from forcemap.paths.bent_path import BentPath
from forcemap.paths.gaps import map_gaps
from forcemap.paths.path_speeds import PathSpeeds, PieceOutcome
from forcemap.paths.table_positions import TaskPlaces
from forcemap.speeds.basis import Basis
from forcemap.words import assumptions, by_map, sentence, sentences, warnings

RULES = ("allowed", "standard", "constant", "segmented", "program", "slowed")


class PieceAnswer(Answer):
    """A short piece of a path; its speed to program, and at contact, null where none is permitted.

    `time_s` is the time [s] after the first row of the file at which the piece begins; null without times.
    `speed_mps` is the speed to program once more, by the name that it had before `speed_to_program_mps`.
    """

    segment: str
    from_m: list[float]
    to_m: list[float]
    length_m: float
    time_s: Figure
    speed_to_program_mps: Figure
    speed_mps: Figure
    contact_speed_mps: Figure
    programmed_speed_mps: Figure
    too_fast: bool
    outcome: str
    reason: Said
    governed_by: str
    map_name: str
    limit_N: Figure


class SlowestAnswer(Answer):
    """The piece with the lowest allowed speed, of those with permission where contact is possible; the first such one.

    The limit of `governed_by` in the map `map_name` gives that speed; `outcome` as in the pieces.
    """

    segment: str
    from_m: list[float]
    to_m: list[float]
    outcome: str
    speed_to_program_mps: float
    governed_by: str
    map_name: str
    limit_N: Figure


class CycleTimeAnswer(Answer):
    """A cycle time at one rule of speed; null if a piece has no permission, or the rule no speed."""

    rule: str
    cycle_time_s: Figure = of("duration")
    permitted_time_s: Figure = of("permitted_duration")
    speed_mps: Figure = of("speed")


class Refused(Answer):
    """How much of a segment has no permission for one reason; `reason_kind` names the kind of finding it is."""

    segment: str
    outcome: str
    reason: str
    reason_kind: str
    length_m: float


class GapAnswer(Answer):
    """A map that is missing: what it would cover, the states it takes, and the time it is estimated to gain."""

    segments: list[str]
    direction: str
    contact_site: str
    tool: str
    payload_kg: Figure
    length_m: float
    states: int
    estimated_gain_s: Figure


class Suggestion(Answer):
    """A path bent to vertical, radial and circular moves; cycle time null if a piece has no permission."""

    bent_moves: int
    length_m: float
    permitted_share: float
    cycle_time_s: Figure
    gaps: list[GapAnswer]

    @classmethod
    def of_bent(cls, bent: BentPath) -> Self:
        """The answer for a bent path."""
        lengths, refused = bent.speeds.path.lengths, bent.speeds.refused
        share = float(lengths[~refused].sum() / lengths.sum())
        time = bent.speeds.allowed.duration
        figures = {"length_m": float(lengths.sum()), "permitted_share": share, "cycle_time_s": time}
        return cls(bent_moves=bent.bent, gaps=_gaps(bent.speeds), **figures)


class Inside(Answer):
    """Where a path lies inside the range of a map, its tolerances on every side.

    If `whole`, at all these distances and heights, else at some; `to` is less than `from` where no path does. If a
    `contact_site` is named, it must lie there and not the path's own point.
    """

    map_name: str
    contact_site: str
    whole: bool
    distance_from_m: float
    distance_to_m: float
    height_from_m: float
    height_to_m: float


class AlongAnswer(Answer):
    """What speeds along paths rest on, as `RestsOn`; warnings come first.

    `acceleration_mps2` is the largest along the path in its cycle times; those as programmed of a path that is `timed`
    are the path's own. Where contact is excluded, as it is somewhere if `contact_excluded`, every cycle time is at the
    task's speed. `inside` is where pieces that are refused as outside would lie inside, for every map of theirs.
    `standard_of` is which limit gives the standard's one speed; empty if it has none.
    Of several maps `map_sha256` is one hash over those of `maps`; `speed_kind` and `speed_error` are null where they
    differ, and `assumptions_by_map` has the assumptions by the names of their maps, those of all maps by no name.
    """

    bound: Bound
    speed_kind: str | None
    speed_error: Figure
    simulated: bool
    warnings: AllSaid
    assumptions: AllSaid
    assumptions_by_map: dict[str, AllSaid]
    map_sha256: str
    maps: list[AtlasMapAnswer]
    acceleration_mps2: float
    timed: bool
    waits_s: float
    contact_excluded: bool
    standard_of: Said
    position_tolerance_m: float
    inside: list[Inside]


class PathAnswer(AlongAnswer):
    """Allowed speeds along a path; `too_fast` and the lowest speed refer to the pieces with permission.

    If `programmed_by_points`, programmed speeds are those of the path's rows, on each motion the faster of its two.
    `too_fast_by_mean_length_m` is where a timed path is already too fast by the means between its rows.
    `standard_beyond_share` is on which share of the path the map does not permit the standard's one speed.
    """

    permitted: bool
    too_fast: bool
    programmed: bool
    programmed_by_points: bool
    length_m: float
    refused_length_m: float
    too_fast_length_m: float
    too_fast_by_mean_length_m: Figure
    slowest: SlowestAnswer | None
    lowest_speed_mps: Figure = of("constant", "speed")
    cycle_times: list[CycleTimeAnswer]
    standard_beyond_share: Figure = of("standard_beyond")
    speed_overshoot_mps: float = of("allowance", "speed")
    refusals: list[Refused]
    gaps: list[GapAnswer]
    suggestion: Suggestion | None
    pieces: list[PieceAnswer]

    @classmethod
    def of_path(
        cls, speeds: PathSpeeds, bound: Any, notes: tuple[str, ...] = (), *, bent: BentPath | None = None
    ) -> Self:
        """The answer for a path, and for the same bent to directions that have a map."""
        lengths, refused = speeds.path.lengths, speeds.refused
        fast = speeds.too_fast & ~refused
        return cls.from_result(
            speeds,
            permitted=not refused.any(),
            too_fast=bool(fast.any()),
            programmed=not np.isnan(speeds.programmed).any(),
            programmed_by_points=speeds.path.stated_speeds is not None and not speeds.path.speeds_of,
            length_m=float(lengths.sum()),
            refused_length_m=float(lengths[refused].sum()),
            too_fast_length_m=float(lengths[fast].sum()),
            too_fast_by_mean_length_m=_too_fast_by_mean(speeds, fast),
            slowest=_slowest(speeds),
            cycle_times=[getattr(speeds, rule) for rule in RULES],
            refusals=_refusals(speeds),
            gaps=_gaps(speeds),
            suggestion=None if bent is None else Suggestion.of_bent(bent),
            pieces=_pieces(speeds),
            **_rests_on(speeds, bound, speeds.bases, [*notes, *sentences(speeds.notes)]),
        )


class Position(AtPlace):
    """A position of the table's frame; cycle time null if a part of the path has no permission."""

    cycle_time_s: Figure
    standard_cycle_time_s: Figure
    permitted_share: float


class Best(AtPlace):
    """The position with the shortest cycle time; of several as short to the digit, the one with the highest speeds."""

    cycle_time_s: float


class Shift(Answer):
    """What a shift of the best position costs; null if a part of the path then has no permission."""

    distance_shift_m: float
    height_shift_m: float
    cycle_time_change_s: Figure


class PlacesAnswer(AlongAnswer):
    """Cycle times of a task at positions of its table; refusals are those of the position that permits most.

    Where none of the positions every `step_m` permits the whole path, those every `finer_step_m` around the one that
    permits most were looked at, too (null if not); if one of these does, `positions` are these. `file` is the path at
    the best position, null if none was written; `too_fast_share` is how much of it is programmed too fast there.
    `without` names segments with a part that has a speed at no position.
    """

    step_m: float
    finer_step_m: Figure
    best: Best | None
    as_fast: int
    most_permitted: Position
    sensitivity: list[Shift]
    cycle_times: list[CycleTimeAnswer]
    standard_beyond_share: Figure
    refusals: list[Refused]
    without: list[str]
    too_fast_share: Figure
    positions: list[Position]
    file: str | None = None

    @classmethod
    def of_places(
        cls, places: TaskPlaces, bound: Any, *, step: float, finer: float | None = None, file: str | None = None
    ) -> Self:
        """The answer for positions of a table, multiples of `step`, or of `finer` if these were looked at [m]."""
        closest, best = places.closest_speeds, places.best_speeds
        grid = np.meshgrid(places.distance, places.height, indexing="ij")
        positions = Position.of_columns(
            distance_m=grid[0],
            height_m=grid[1],
            cycle_time_s=places.duration,
            standard_cycle_time_s=places.standard_duration,
            permitted_share=places.permitted,
        )
        d, h, _ = places.most_permitted
        return cls.from_result(
            places,
            step_m=step,
            finer_step_m=finer,
            most_permitted=next(place for place in positions if (place.distance_m, place.height_m) == (d, h)),
            cycle_times=[] if best is None else [getattr(best, rule) for rule in RULES],
            standard_beyond_share=math.nan if best is None else best.standard_beyond,
            too_fast_share=math.nan if best is None else _too_fast_share(best),
            refusals=[] if places.best is not None else _refusals(closest),
            positions=positions,
            file=file,
            **_rests_on(
                closest,
                bound,
                (*(best.bases if best else ()), *closest.bases, *places.bases),
                sentences(places.notes),
            ),
        )


def _too_fast_share(speeds: PathSpeeds) -> float:
    """Share of a path's length that is programmed too fast."""
    lengths = speeds.path.lengths
    return float(lengths[speeds.too_fast].sum() / lengths.sum())


def _rests_on(speeds: PathSpeeds, bound: Any, bases: tuple[Basis, ...], notes: list[str]) -> dict[str, Any]:
    """What speeds along a path rest on; `notes` are those of all maps."""
    atlas = speeds.atlas
    conditions = [force_map.conditions for force_map in atlas.force_maps]
    kinds, errors = ({getattr(each, name) for each in conditions} for name in ("speed_kind", "speed_error"))
    return {
        "bound": bound,
        "warnings": [*sentences((*atlas.warnings, *speeds.doubts)), *warnings(bases)],
        "assumptions": list(dict.fromkeys([*assumptions(bases), *notes])),
        "assumptions_by_map": by_map(
            [(_map_of(atlas, basis), [*assumptions([basis]), *notes]) for basis in bases] or [("", notes)]
        ),
        "simulated": atlas.simulated,
        "map_sha256": atlas.sha256,
        "maps": [AtlasMapAnswer.of_map(each) for each in atlas.maps],
        "speed_kind": kinds.pop() or None if len(kinds) == 1 else None,
        "speed_error": errors.pop() if len(errors) == 1 else math.nan,
        "acceleration_mps2": speeds.acceleration,
        "timed": speeds.path.time is not None,
        "waits_s": 0.0 if speeds.path.wait is None else float(np.sum(speeds.path.wait)),
        "contact_excluded": any(note.kind is FindingKind.EXCLUDED_BY_TASK for note in speeds.notes),
        "standard_of": speeds.standard_of or "",
        "position_tolerance_m": speeds.allowance.position,
        "inside": _inside(speeds),
    }


def _inside(speeds: PathSpeeds) -> list[Inside]:
    """Where a path lies inside the range of each map that holds for pieces that lie outside."""
    reach = speeds.allowance.position + speeds.path.deviation
    outside, matched, found = speeds.outcome == PieceOutcome.OUTSIDE, speeds.matched, []
    for each, force_map, angles in zip(matched.atlas.maps, matched.atlas.force_maps, matched.off_angles, strict=True):
        if np.isfinite(angles[outside]).any():
            of_map = force_map.measured_range
            low, high = of_map.lowest[:2], of_map.highest[:2]
            corners = of_map.speeds(np.array([low[0], low[0], high[0], high[0]]), np.tile([low[1], high[1]], 2))
            whole = not np.isnan(corners[0]).any()
            (d, h), (d_to, h_to) = (low + reach).tolist(), (high - reach).tolist()
            ends = {"distance_from_m": d, "distance_to_m": d_to, "height_from_m": h, "height_to_m": h_to}
            site = each.conditions.contact_site if matched.offsets[each.loaded].any() else ""
            found.append(Inside(map_name=each.name, contact_site=site, whole=whole, **ends))
    return found


def _map_of(atlas: Atlas, basis: Basis) -> str:
    """Name of the map that speeds rest on: no two of an atlas were measured under the same conditions."""
    pairs = zip(atlas.maps, atlas.force_maps, strict=True)
    return next((each.name for each, force_map in pairs if force_map.conditions == basis.conditions), "")


def _gaps(speeds: PathSpeeds) -> list[GapAnswer]:
    return [
        GapAnswer(
            segments=list(gap.segments),
            direction=gap.direction,
            contact_site=gap.loaded.contact_site,
            tool=gap.loaded.tool,
            payload_kg=gap.loaded.payload,
            length_m=gap.length,
            states=gap.states,
            estimated_gain_s=gap.gain,
        )
        for gap in map_gaps(speeds)
    ]


def _pieces(speeds: PathSpeeds) -> list[PieceAnswer]:
    path, points = speeds.path, speeds.path.points.tolist()
    return PieceAnswer.of_columns(
        segment=path.names,
        from_m=points[:-1],
        to_m=points[1:],
        length_m=path.lengths,
        time_s=[None] * len(path) if path.time is None or path.begins is None else path.begins - path.time[0],
        speed_to_program_mps=speeds.speed,
        speed_mps=speeds.speed,
        contact_speed_mps=speeds.contact_speed,
        programmed_speed_mps=speeds.programmed,
        too_fast=speeds.too_fast,
        outcome=speeds.outcome,
        reason=speeds.reason,
        governed_by=speeds.governed_by,
        map_name=speeds.map_name,
        limit_N=speeds.limit,
    )


def _slowest(speeds: PathSpeeds) -> SlowestAnswer | None:
    """The slowest piece with permission where contact is possible; None without one."""
    possible = np.where(speeds.refused | (speeds.governed_by == ""), np.nan, speeds.speed)
    if np.isnan(possible).all():
        return None
    i = int(np.nanargmin(possible))
    ends = (speeds.path.points[j].tolist() for j in (i, i + 1))
    grounds = (getattr(speeds, name)[i] for name in ("governed_by", "map_name", "limit"))
    columns = (speeds.path.names[i], *ends, str(speeds.outcome[i]), speeds.speed[i], *grounds)
    return SlowestAnswer(**dict(zip(SlowestAnswer.model_fields, columns, strict=True)))


def _too_fast_by_mean(speeds: PathSpeeds, fast: Mask) -> float:
    """Length [m] of pieces that are too fast by the mean between the rows alone; NaN of an untimed path."""
    mean = speeds.path.speeds
    return math.nan if mean is None else float(speeds.path.lengths[fast & (mean > speeds.speed)].sum())


def _refusals(speeds: PathSpeeds) -> list[Refused]:
    """Why pieces have no permission, for each segment and reason."""
    lengths: dict[tuple[str, str, Finding], float] = {}
    columns = (speeds.path.names, map(str, speeds.outcome), speeds.reason, speeds.path.lengths.tolist())
    for *key, length, refused in zip(*columns, speeds.refused.tolist(), strict=True):
        if refused:
            lengths[tuple(key)] = lengths.get(tuple(key), 0.0) + length
    return [
        Refused(segment=s, outcome=o, reason=sentence(r), reason_kind=str(r.kind), length_m=length)
        for (s, o, r), length in lengths.items()
    ]
