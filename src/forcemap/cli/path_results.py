"""Speeds along paths and positions of tables, for JSON and in words."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from forcemap import CycleTime, PathSpeeds, PieceOutcome, TaskPlaces, floor_speed
from forcemap.cli.output import listing, table

_RULES = ("allowed", "standard", "constant", "program")


def path_result(speeds: PathSpeeds) -> dict[str, Any]:
    """Speeds along a path for JSON."""
    points = speeds.path.points.tolist()
    return {
        "length_m": float(speeds.path.lengths.sum()),
        "pieces": [
            {
                "segment": name,
                "from_m": points[i],
                "to_m": points[i + 1],
                "length_m": float(speeds.path.lengths[i]),
                "speed_mps": float(speeds.speed[i]),
                "programmed_speed_mps": float(speeds.programmed[i]),
                "too_fast": bool(speeds.too_fast[i]),
                "outcome": str(speeds.outcome[i]),
                "reason": str(speeds.reason[i]),
                "governed_by": str(speeds.governed_by[i]),
                "limit_N": float(speeds.limit[i]),
            }
            for i, name in enumerate(speeds.path.names)
        ],
        "permitted": not speeds.refused.any(),
        "too_fast": bool((speeds.too_fast & ~speeds.refused).any()),
        "programmed": not np.isnan(speeds.programmed).any(),
        "refused_length_m": float(speeds.path.lengths[speeds.refused].sum()),
        "cycle_times": [_cycle_time(getattr(speeds, rule)) for rule in _RULES],
        "speed_overshoot_mps": speeds.allowance.speed,
        "position_tolerance_m": speeds.allowance.position,
        "warnings": list(speeds.warnings),
        "assumptions": list(speeds.statements),
    }


def simulated_line(statements: Iterable[str]) -> list[str]:
    """That the impacts are simulated, to be shown first; nothing if they are not."""
    return [line for line in statements if line.startswith("SIMULATED")][:1]


def path_lines(speeds: PathSpeeds) -> list[str]:
    """Speeds along a path: stretches of one outcome, then cycle times."""
    path = speeds.path
    kinds = list(zip(path.names, speeds.outcome, speeds.reason, speeds.governed_by, strict=True))
    rows, reasons = [], []
    for kind, group in itertools.groupby(range(len(path)), key=lambda i: kinds[i]):
        pieces = list(group)
        name, outcome, reason, governed_by = (str(part) for part in kind)
        length = path.lengths[pieces].sum()
        low, high = (f(speeds.speed[pieces]) for f in (np.min, np.max))
        shown = "-" if math.isnan(low) else f"{floor_speed(low)} to {floor_speed(high)}"
        programmed = speeds.programmed[pieces]
        fast = speeds.too_fast[pieces] & ~speeds.refused[pieces]
        program = "-" if np.isnan(programmed).any() else f"{programmed.max():.3f}{' !' if fast.any() else ''}"
        d, h = path.pieces.places(np.array([[0.0, 1.0]] * len(path)))
        where = f"{d[pieces[0], 0]:.3f}, {h[pieces[0], 0]:.3f} to {d[pieces[-1], 1]:.3f}, {h[pieces[-1], 1]:.3f}"
        rows.append([name, f"{length:.3f}", where, outcome, shown, program, governed_by])
        if speeds.refused[pieces].any():
            reasons.append(f"{name}, {where}: no permission, {reason}")
    lines = table(["segment", "length m", "d, h m", "outcome", "allowed m/s", "programmed", "governed by"], rows)
    lines += ["", _answer(speeds), *reasons, *_hints(speeds)]
    lines += ["", *_cycle_lines(speeds)]
    return [*lines, *listing("Assumes", speeds.statements)]


def _answer(speeds: PathSpeeds) -> str:
    """Whether the path may be driven as it is programmed, in words."""
    if speeds.refused.any():
        share = speeds.path.lengths[speeds.refused].sum() / speeds.path.lengths.sum()
        return f"NOT PERMITTED on {100 * share:.0f} % of the path; there the robot must not move with a person in reach"
    if speeds.too_fast.any():
        return "TOO FAST where marked !: slow down to the allowed speed there"
    if np.isnan(speeds.programmed).any():
        return "permitted at the allowed speeds; no programmed speed is stated everywhere, so none was compared there"
    return "permitted as programmed"


def refusals(speeds: PathSpeeds) -> list[dict[str, Any]]:
    """Why pieces have no permission, for each segment and reason."""
    lengths: dict[tuple[str, str, str], float] = {}
    for i in np.flatnonzero(speeds.refused):
        key = (speeds.path.names[i], str(speeds.outcome[i]), str(speeds.reason[i]))
        lengths[key] = lengths.get(key, 0.0) + float(speeds.path.lengths[i])
    return [
        {"segment": name, "outcome": outcome, "reason": reason, "length_m": length}
        for (name, outcome, reason), length in lengths.items()
    ]


def _hints(speeds: PathSpeeds) -> list[str]:
    """What can be done about pieces without permission."""
    found = set(speeds.outcome[speeds.refused])
    hints = {
        PieceOutcome.NOT_DOWNWARD: "not downward: the map permits no such motion; if other measures exclude contact "
        "there, say so in a task file (--task) with contact_possible = false for that segment",
        PieceOutcome.OUTSIDE: "outside: move the path into the measured range, less the position tolerance, or measure "
        "there",
        PieceOutcome.UNCONFIRMED: "unconfirmed: measure at lower speeds there, or ask for a limit that holds",
    }
    return [f"  {hint}" for outcome, hint in hints.items() if outcome in found]


def places_result(places: TaskPlaces) -> dict[str, Any]:
    """Positions of a table for JSON."""
    best = (
        None if places.best is None else dict(zip(("distance_m", "height_m", "cycle_time_s"), places.best, strict=True))
    )
    return {
        "best": best,
        "sensitivity": [
            {"distance_shift_m": d, "height_shift_m": h, "cycle_time_change_s": change}
            for d, h, change in places.sensitivity
        ],
        "positions": [
            {
                "distance_m": float(d),
                "height_m": float(h),
                "cycle_time_s": float(places.duration[i, j]),
                "standard_cycle_time_s": float(places.standard_duration[i, j]),
                "permitted_share": float(places.permitted[i, j]),
            }
            for i, d in enumerate(places.distance)
            for j, h in enumerate(places.height)
        ],
        "refusals": [] if places.best is not None else refusals(places.closest_speeds),
        "warnings": list(places.closest_speeds.warnings),
        "assumptions": list(places.statements),
    }


def places_lines(places: TaskPlaces) -> list[str]:
    """Positions of a table: cycle times over distance and height, the best, and what shifting it costs."""
    lines = ["cycle time [s] with the table's frame at d, h; ? where a part of the path has no permission"]
    if places.distance.size <= 16:
        cells = [["?" if math.isnan(t) else f"{t:.3f}" for t in column] for column in places.duration.T.tolist()]
        rows = [[f"{h:.3f}", *row] for h, row in zip(places.height, cells, strict=True)][::-1]
        lines += table(["h \\ d [m]", *(f"{d:.3f}" for d in places.distance)], rows)
    else:
        lines.append(f"{places.duration.size} positions, too many to show: see --json, or a larger step")
    if places.best is None:
        d, h, share = places.most_permitted
        lines.append(
            f"NO POSITION has permission for the whole path; most, {100 * share:.0f} %, at d = {d:g} m, h = {h:g} m:"
        )
        lines += [
            f"  {each['segment']}: {each['length_m']:.3f} m {each['outcome'].replace('_', ' ')}, {each['reason']}"
            for each in refusals(places.closest_speeds)
        ]
        lines += _hints(places.closest_speeds)
    else:
        d, h, duration = places.best
        lines.append(f"best: {duration:.3f} s at d = {d:g} m, h = {h:g} m")
        for along, up, change in places.sensitivity:
            cost = "a part has no permission" if math.isnan(change) else f"{change:+.3f} s"
            lines.append(f"  moved by {along:+.3f} m, {up:+.3f} m: {cost}")
        if places.best_speeds is not None:
            lines += ["", "at the best position", *_cycle_lines(places.best_speeds)]
    return [*lines, *listing("Assumes", places.statements)]


def _cycle_time(found: CycleTime) -> dict[str, Any]:
    return {
        "rule": found.rule,
        "cycle_time_s": found.duration,
        "permitted_time_s": found.permitted_duration,
        "speed_mps": found.speed,
    }


def _cycle_lines(speeds: PathSpeeds) -> list[str]:
    rows = []
    for found in (getattr(speeds, rule) for rule in _RULES):
        times = ["-" if math.isnan(t) else f"{t:.3f} s" for t in (found.duration, found.permitted_duration)]
        rows.append([found.rule, floor_speed(found.speed), *times])
    lines = table(["cycle time at", "m/s", "whole path", "permitted part"], rows)
    if math.isnan(speeds.standard.duration) and not speeds.refused.any():
        lines.append("no time at the standard's speed: the campaign does not state the robot's moving mass")
    return lines
