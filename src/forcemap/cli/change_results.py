"""What new or censored impacts, or another map, change: dictionaries for JSON and lines of text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from forcemap import CensoringEffect, MapCheck, MapComparison, RatioAt, StateCheck, floor_speed
from forcemap.cli.output import listing, table
from forcemap.cli.results import counted


def check_result(check: MapCheck) -> dict[str, Any]:
    """A MapCheck for JSON."""
    return {
        "outcome": check.outcome.value,
        "reason": check.reason,
        "next_step": check.next_step,
        "mean_ratio": check.mean_ratio,
        "mean_ratio_low": check.mean_ratio_low,
        "mean_ratio_high": check.mean_ratio_high,
        "confidence": check.confidence,
        "p_mean": check.p_mean,
        "p_whole": check.p_whole,
        "detectable_change_percent": 100 * check.detectable_change,
        "error_probability": check.error_probability,
        "states": [
            {
                "state_id": each.state,
                "distance_m": each.distance,
                "height_m": each.height,
                "speed_mps": each.speed,
                "measured_N": each.measured,
                "censored": each.censored,
                "predicted_N": each.predicted,
                "lowest_expected_N": each.lowest_expected,
                "highest_expected_N": each.highest_expected,
                "ratio": each.ratio,
                "p_value": each.p_value,
                "moved": each.moved,
            }
            for each in check.states
        ],
        "left_out": [
            {
                "state_id": each.state,
                "distance_m": each.distance,
                "height_m": each.height,
                "speed_mps": each.speed,
                "reason": each.reason,
            }
            for each in check.left_out
        ],
        "assumptions": list(check.statements),
    }


def check_lines(check: MapCheck) -> list[str]:
    """A MapCheck in words and a table."""
    lines = [line for line in check.statements if line.startswith("SIMULATED")]
    all_ = len(check.states) + len(check.left_out)
    on = f", on {len(check.states)} of {all_} states, {len(check.left_out)} left out" if check.left_out else ""
    lines += [f"{check.outcome.value.replace('_', ' ').upper()}{on}: {check.reason}", f"next: {check.next_step}"]
    if check.states:
        lines += [
            "",
            f"measured over predicted force, on average: {_percent(check.mean_ratio)} "
            f"({100 * check.confidence:.4g} % confidence: {_percent(check.mean_ratio_low)} to "
            f"{_percent(check.mean_ratio_high)}); above is the dangerous side",
            "",
            *table(
                ["state", "d [m]", "h [m]", "v [m/s]", "measured [N]", "predicted [N]", "expected [N]", "change", ""],
                [_row(each) for each in check.states],
            ),
            "expected: where all states lie at once if nothing has changed"
            + ("; > at least, above the device range" if any(each.censored for each in check.states) else ""),
        ]
    if check.left_out:
        lines += ["", *listing("Left out", _left_out_lines(check))]
    return [*lines, "", *listing("Assumes", check.statements)]


def _left_out_lines(check: MapCheck) -> list[str]:
    """The states left out, by their reason."""
    lines = []
    for reason in dict.fromkeys(each.reason for each in check.left_out):
        states = [each for each in check.left_out if each.reason == reason]
        places = (f"{s.state} (d {s.distance:g} m, h {s.height:g} m, v {s.speed:g} m/s)" for s in states)
        lines.append(f"{counted(len(states), 'state')} {reason}: {', '.join(places)}")
    return lines


def _row(each: StateCheck) -> list[str]:
    return [
        each.state,
        f"{each.distance:.3f}",
        f"{each.height:.3f}",
        f"{each.speed:.3f}",
        f"{'> ' if each.censored else ''}{each.measured:.1f}",
        f"{each.predicted:.1f}",
        f"{each.lowest_expected:.1f} to {each.highest_expected:.1f}",
        _percent(each.ratio),
        "MOVED" if each.moved else "",
    ]


def _percent(ratio: float) -> str:
    return f"{round(100 * (ratio - 1), 1) + 0.0:+.1f} %"  # + 0.0: what rounds to nothing has no sign


def maps_result(comparison: MapComparison) -> dict[str, Any]:
    """A MapComparison for JSON."""

    def at(found: RatioAt) -> dict[str, float]:
        return {
            "ratio": found.ratio,
            "distance_m": found.distance,
            "height_m": found.height,
            "speed_mps": found.speed,
            "one_N": found.one_force,
            "other_N": found.other_force,
        }

    keys = ("distance_m", "height_m", "speed_mps")
    return {
        "one": comparison.one,
        "other": comparison.other,
        "same_map": comparison.same,
        "mean_ratio": comparison.mean_ratio,
        "geometric_mean_ratio": comparison.geometric_mean_ratio,
        "smallest": at(comparison.smallest),
        "largest": at(comparison.largest),
        "higher_share": comparison.higher_share,
        "points": comparison.points,
        "lowest": dict(zip(keys, comparison.lowest, strict=True)),
        "highest": dict(zip(keys, comparison.highest, strict=True)),
        "assumptions": list(comparison.statements),
    }


def maps_lines(comparison: MapComparison, names: tuple[str, str]) -> list[str]:
    """A MapComparison in words, with the names the maps were given by."""
    low, high = comparison.lowest, comparison.highest
    lines = [line for line in comparison.statements if line.startswith("SIMULATED")]
    lines += [
        f"one:   {names[0]}: {comparison.one}",
        f"other: {names[1]}: {comparison.other}",
    ]
    if comparison.same:
        return [*lines, "", "the same map"]
    lines += [
        f"over the range that both have measured: d {low[0]:.3f} to {high[0]:.3f} m, h {low[1]:.3f} to "
        f"{high[1]:.3f} m, v {low[2]:.3f} to {high[2]:.3f} m/s, {comparison.points} points",
        "",
        f"force of the other over the one, on average: {_percent(comparison.mean_ratio)} "
        f"(geometric mean {_percent(comparison.geometric_mean_ratio)})",
    ]
    for word, found in (("highest", comparison.largest), ("lowest", comparison.smallest)):
        lines.append(
            f"  {word:8}{_percent(found.ratio)} at d = {found.distance:.3f} m, h = {found.height:.3f} m, "
            f"v = {floor_speed(found.speed)} m/s ({found.other_force:.1f} N against {found.one_force:.1f} N)"
        )
    lines.append(f"the other is the higher one in {100 * comparison.higher_share:.1f} % of the range")
    return [*lines, "", *listing("Assumes", comparison.statements)]


def censoring_result(effect: CensoringEffect) -> dict[str, Any]:
    """The fit without censored impacts, beside the one with them, for JSON."""
    return {
        "coefficients": effect.discarded.coefficients.tolist(),
        "states": len(effect.discarded.require_fit().states),
        "state_sd_percent": 100 * effect.discarded.require_fit().state_sd,
        "at_censored": {
            "state_id": list(effect.states.name),
            "distance_m": effect.states.distance.tolist(),
            "height_m": effect.states.height.tolist(),
            "speed_mps": effect.states.speed.tolist(),
            "censored": effect.states.censored.tolist(),
            "at_least_N": effect.states.at_least.tolist(),
        },
        "predicted_at_censored_N": effect.predicted_discarded.tolist(),
        "predicted_with_censored_N": effect.predicted_at_least.tolist(),
    }


def censoring_summary(effect: CensoringEffect) -> list[str]:
    """What a map is with its censored impacts and without them, in one table."""
    kept, lost = effect.at_least.require_fit(), effect.discarded.require_fit()
    added, shared, at = len(effect.added), len(lost.states), len(effect.states)
    rows = [
        ["states", str(len(kept.states)), str(shared)],
        ["impacts", str(kept.samples + kept.censored_samples), str(lost.samples)],
        ["measured range (volume of the hull)", "100 %", f"{100 * effect.range_kept:.0f} %"],
        ["state-to-state SD", f"{100 * kept.state_sd:.2f} %", f"{100 * lost.state_sd:.2f} %"],
        ["tolerance bound, above the prediction", _span(effect.margin_at_least), _span(effect.margin_discarded)],
    ]
    if added:
        label = f"  at the {shared} states of both"
        rows.append([label, _span(effect.margin_shared), _span(effect.margin_discarded)])
    rows.append(
        [
            f"predicted at the {counted(at, 'state')} with censored impacts",
            *(_forces(force.tolist()) for force in (effect.predicted_at_least, effect.predicted_discarded)),
        ]
    )
    header = ["Impacts above the device range", "counted as at least", "discarded (--discard-censored)"]
    return [*table(header, rows), *_why_wider(effect)]


def _why_wider(effect: CensoringEffect) -> list[str]:
    """Where a wider bound comes from, as far as the figures say so."""
    added, largest = len(effect.added), [effect.margin_at_least[1], effect.margin_shared[1], effect.margin_discarded[1]]
    if any(math.isnan(share) for share in largest):
        return []
    all_, shared, discarded = (round(100 * share, 1) for share in largest)
    if all_ <= discarded:
        return ["the bound is no wider for the censored impacts"]
    states = f"the {counted(added, 'added state')}"
    if shared <= discarded:
        return [f"the wider bound comes from {states}, which the other fit says nothing about"]
    if all_ <= shared:
        return ["the bound is wider at the states of both: the censored impacts show more scatter"]
    return [
        f"the wider bound comes from {states}, which the other fit says nothing about, and from more scatter that the "
        "censored impacts show"
    ]


def _span(shares: tuple[float, float]) -> str:
    return "none" if math.isnan(shares[0]) else f"+{100 * shares[0]:.1f} to +{100 * shares[1]:.1f} %"


def _forces(forces: Sequence[float]) -> str:
    low, high = f"{min(forces):.0f}", f"{max(forces):.0f}"
    return f"{low} N" if low == high else f"{low} to {high} N"


def censoring_lines(effect: CensoringEffect) -> list[str]:
    """What censored impacts change, in two tables."""
    states = effect.states
    names = effect.at_least.form.term_names
    coefficients = zip(names, effect.at_least.coefficients, effect.discarded.coefficients, strict=True)
    figures = zip(
        states.name,
        states.censored,
        states.impacts + states.censored,
        states.at_least,
        effect.predicted_at_least,
        effect.predicted_discarded,
        strict=True,
    )
    return [
        "What the impacts above the device range change, against discarding them (the paper; --discard-censored)",
        *table(
            ["state", "above the range", "reached at least [N]", "predicted [N]", "if discarded [N]", "difference"],
            [
                [name, f"{n} of {all_}", f"{force:.0f}", f"{kept:.1f}", f"{lost:.1f}", _percent(kept / lost)]
                for name, n, all_, force, kept, lost in figures
            ],
        ),
        "",
        *table(["term", "coefficient", "if discarded"], [[n, f"{b:.4f}", f"{c:.4f}"] for n, b, c in coefficients]),
    ]
