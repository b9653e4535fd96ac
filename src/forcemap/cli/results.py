"""Results as dictionaries for JSON, with units in the keys, and as lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from forcemap import (
    Accuracy,
    Bound,
    BoundNotAvailable,
    Comparison,
    Contact,
    ForceLimit,
    ForceMap,
    ImpactDataset,
    NewtonLimit,
    SafeSpeed,
    SpeedMap,
    ToleranceBound,
    floor_speed,
    map_sha256,
    margins,
)
from forcemap.cli.output import listing, table
from forcemap.exports.speed_table import speed_map_csv, speed_map_places

_WIDEST = 16  # columns of a speed map that a page takes
_SLOWEST_HINT = 0.02  # [m/s]; no robot is measured slower


def accuracy_result(accuracy: Accuracy) -> dict[str, Any]:
    """An Accuracy for JSON."""
    newtons = {
        "max_underestimation",
        "mean_underestimation",
        "max_overestimation",
        "mean_overestimation",
        "rmse",
    }
    return {f"{key}_N" if key in newtons else key: value for key, value in asdict(accuracy).items()}


def accuracy_words(accuracy: Accuracy) -> str:
    """An Accuracy in a line."""
    return (
        f"accuracy on {accuracy.states} states ({accuracy.on}): underestimated by at most "
        f"{accuracy.max_underestimation_percent:.1f} %, overestimated by at most "
        f"{accuracy.max_overestimation_percent:.1f} %"
    )


def accuracy_lines(accuracies: Sequence[tuple[str, Accuracy]]) -> list[str]:
    """A table of accuracies, the dangerous side first."""
    header = ["", "states", "underest. max", "underest. mean", "overest. max", "overest. mean", "RMSE"]
    rows = []
    for name, a in accuracies:
        pairs = [
            (a.max_underestimation_percent, a.max_underestimation),
            (a.mean_underestimation_percent, a.mean_underestimation),
            (a.max_overestimation_percent, a.max_overestimation),
            (a.mean_overestimation_percent, a.mean_overestimation),
        ]
        rows.append([name, str(a.states), *(f"{p:.2f} % / {n:.2f} N" for p, n in pairs), f"{a.rmse:.2f} N"])
    lines = table(header, rows)
    censored = max(accuracies, key=lambda pair: pair[1].censored_states)[1]
    if censored.censored_states:
        lines.append(
            f"{censored.censored_states} states above the device range are not compared; "
            f"{censored.censored_underestimated} of them are predicted below it"
        )
    return lines


def fit_result(force_map: ForceMap, accuracy: Accuracy) -> dict[str, Any]:
    """A fitted map for `fit --json`."""
    fit = force_map.fit
    assert fit is not None
    allowances = _allowances(force_map)
    over_samples = fit.over_samples
    return {
        "form": force_map.form.name,
        "terms": force_map.form.term_names,
        "coefficients": force_map.coefficients.tolist(),
        "standard_errors": fit.between_states.standard_errors.tolist(),
        "t_values": fit.between_states.t_values.tolist(),
        "p_values": fit.between_states.p_values.tolist(),
        "over_samples": None
        if over_samples is None
        else {
            "standard_errors": over_samples.standard_errors.tolist(),
            "t_values": over_samples.t_values.tolist(),
            "p_values": over_samples.p_values.tolist(),
            "r_squared": over_samples.r_squared,
            "rmse_ln": over_samples.rmse,
        },
        "states": len(fit.states),
        "states_left_out": len(fit.left_out),
        "states_left_out_names": list(fit.left_out.name),
        "states_found": fit.states_found,
        "samples": fit.samples,
        "censored_samples": fit.censored_samples,
        "censored_fit": fit.censored_fit,
        "repeats": fit.repeats[1],
        "fewest_repeats": fit.repeats[0],
        "rmse_N": fit.rmse_force,
        "rmse_ln": fit.between_states.rmse,
        "r_squared": fit.between_states.r_squared,
        "state_sd_percent": 100 * fit.state_sd,
        "degrees_of_freedom": fit.between_states.degrees_of_freedom,
        "condition_number": fit.between_states.condition_number,
        "bound_margin_percent": None if allowances is None else {"lowest": allowances[0], "highest": allowances[1]},
        "rises_with_speed": force_map.rises_with_speed,
        "simulated": force_map.simulated,
        "accuracy": accuracy_result(accuracy),
    }


def fit_lines(force_map: ForceMap, before_coefficients: Sequence[str] = ()) -> list[str]:
    """A fitted map in words and a table of coefficients, with lines to read before those."""
    fit = force_map.fit
    assert fit is not None
    fewest, most = fit.repeats
    repeats = counted(most, "impact") if fewest == most else f"{fewest} to {most} impacts"
    low, high = force_map.measured_range.lowest, force_map.measured_range.highest
    between = fit.between_states
    columns = (force_map.form.term_names, force_map.coefficients, between.standard_errors, between.p_values)
    coefficients = zip(*columns, strict=True)
    lines = [
        f"{force_map.form.name} {force_map.source}",
        f"  {impacts_words(force_map)}",
        f"  {repeats} a state; states found {fit.states_found}",
        f"  measured: d {low[0]:.3f} to {high[0]:.3f} m, h {low[1]:.3f} to {high[1]:.3f} m, "
        f"v {floor_speed(low[2])} to {floor_speed(high[2])} m/s (their convex hull)",
    ]
    if fit.censored_fit:
        wholly = [name for name, n in zip(fit.states.name, fit.states.impacts, strict=True) if n == 0]
        if wholly:
            lines.append(
                f"  {counted(len(wholly), 'state')} with impacts above the device range alone: {', '.join(wholly)}"
            )
    elif len(fit.left_out):
        lines.append(
            f"  {counted(len(fit.left_out), 'state')} left out, with impacts above the device range alone: "
            f"{', '.join(fit.left_out.name)}"
        )
    if before_coefficients:
        lines += ["", *before_coefficients]
    lines += [
        "",
        "ln F = sum of coefficient x term; F in N, d and h in m, v in m/s",
        *table(
            ["term", "coefficient", "standard error", "p value"],
            [[n, f"{b:.4f}", f"{se:.4f}", f"{p:#.3g}"] for n, b, se, p in coefficients],
        ),
    ]
    lines += [
        "",
        f"state-to-state SD {100 * fit.state_sd:.2f} % ({between.degrees_of_freedom:.1f} degrees of freedom), "
        f"RMSE {fit.rmse_force:.2f} N, R^2 {between.r_squared:.4f}, condition number {between.condition_number:.0f}",
    ]
    allowances = _allowances(force_map)
    if allowances is None:
        lines.append("too few states for a tolerance bound: no safe speed can be given with one")
    else:
        judged = "suffices" if allowances[1] <= 10 else "is too small"
        lines.append(
            f"tolerance bound at the measured states: prediction + {allowances[0]:.1f} to {allowances[1]:.1f} %; "
            f"a fixed + 10 % {judged} here"
        )
    if not force_map.rises_with_speed:
        lines.append("the prediction falls with speed in part of the measured range")
    return lines


def counted(count: int, noun: str) -> str:
    """A number of things in words: 1 state, 2 states."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def impacts_words(force_map: ForceMap) -> str:
    """How many states and impacts a map is fitted to, and what became of the censored ones."""
    fit = force_map.require_fit()
    words = f"{counted(len(fit.states), 'state')}, {counted(fit.samples + fit.censored_samples, 'impact')}"
    if not fit.censored_samples:
        return words
    used = "counted as at least that force" if fit.censored_fit else "not in the fit"
    return f"{words}, {fit.censored_samples} of them above the device range ({used})"


def _allowances(force_map: ForceMap) -> tuple[float, float] | None:
    """Smallest and largest margin of the tolerance bound at the measured states [%]; None if there is no bound."""
    bound = ToleranceBound(device_error=force_map.conditions.device.error_or_default)
    try:
        shares = margins(bound, force_map)
    except BoundNotAvailable:
        return None
    return 100 * float(shares.min()), 100 * float(shares.max())


def limit_result(limit: ForceLimit | NewtonLimit, contact: Contact | None) -> dict[str, Any]:
    """A force limit for JSON; limit_N is null where contact is not permitted."""
    if isinstance(limit, ForceLimit):
        newtons = limit.force(contact) if limit.permitted and contact else None
        source = f"{limit}, {', '.join(limit.areas)}; {limit.source}"
        return {"limit_N": newtons, "limit_source": source, "contact": contact}
    return {"limit_N": limit.force, "limit_source": "given by the user in newtons", "contact": contact}


def limit_words(limit: ForceLimit | NewtonLimit, contact: Contact | None) -> str:
    """A force limit in words."""
    if isinstance(limit, ForceLimit):
        force = f"{limit.force(contact):g} N" if limit.permitted and contact else "contact not permitted"
        return f"{force}, {contact} contact, {limit}"
    return f"{limit.force:g} N{f', {contact} contact' if contact else ''}, given by the user"


def speed_map_result(
    speeds: SpeedMap,
    force_map: ForceMap,
    accuracy: Accuracy | None,
    limit: ForceLimit | NewtonLimit,
    contact: Contact | None,
    bound: Bound,
) -> dict[str, Any]:
    """A speed map for JSON, with all that its speeds rest on."""
    keys = ("distance_m", "height_m", "speed_mps")
    return {
        **limit_result(limit, contact),
        "bound": bound.describe(),
        "map_sha256": map_sha256(force_map),
        "counts": speeds.counts,
        "fastest": None if speeds.fastest is None else dict(zip(keys, speeds.fastest, strict=True)),
        "warnings": list(speeds.speeds.warnings),
        "places": speed_map_places(speeds),
        "accuracy": None if accuracy is None else accuracy_result(accuracy),
        "assumptions": list(speeds.speeds.statements),
    }


def speed_map_table(
    speeds: SpeedMap, force_map: ForceMap, limit: ForceLimit | NewtonLimit, contact: Contact | None, bound: Bound
) -> str:
    """A speed map as CSV, with all that its speeds rest on in every row."""
    basis = {"limit": limit_words(limit, contact), "bound": str(bound), "map": force_map.source}
    return speed_map_csv(speeds, basis=basis | {"map_sha256": map_sha256(force_map)})


def repeats_lines(dataset: ImpactDataset) -> list[str]:
    """States whose repeats disagree."""
    names = dataset.disagreeing_repeats
    return [f"repeats lie more than 10 % apart, look at their recordings: {', '.join(names)}"] if names else []


def other_statements(speeds: SafeSpeed) -> list[str]:
    """What speeds depend on besides limit and bound, which stand above them."""
    return [line for line in speeds.statements if not line.startswith(("limit:", "bound:"))]


def speed_map_lines(speeds: SpeedMap) -> list[str]:
    """A speed map as a table, heights downwards."""
    marks = {"outside": ".", "unconfirmed": "?"}
    cells = [
        [
            marks.get(outcome) or f"{floor_speed(speed)}{'+' if outcome == 'capped' else ''}"
            for outcome, speed in zip(outcomes, values, strict=True)
        ]
        for outcomes, values in zip(speeds.speeds.outcome.T, speeds.speeds.speed.T, strict=True)
    ]
    if len(speeds.distance) > _WIDEST:
        lines = [f"{speeds.speeds.speed.size} places, too many to show: see -o or --json, or a larger step"]
    else:
        header = ["h \\ d [m]", *(f"{d:.3f}" for d in speeds.distance)]
        rows = [[f"{h:.3f}", *row] for h, row in zip(speeds.height, cells, strict=True)][::-1]
        lines = table(header, rows)
        lines.append("safe speed in m/s; + capped at the highest speed measured there; ? unconfirmed; . outside")
    if speeds.fastest is None:
        lines.append("no place is confirmed")
    else:
        d, h, v = speeds.fastest
        lines.append(f"fastest confirmed place shown: {floor_speed(v)} m/s at d = {d:.3f} m, h = {h:.3f} m")
    return lines


def next_lines(speeds: SpeedMap) -> list[str]:
    """Why places are unconfirmed, and where a measurement would confirm the nearest of them."""
    unconfirmed = speeds.speeds.outcome == "unconfirmed"
    if not unconfirmed.any():
        return []
    reasons = speeds.speeds.reason[unconfirmed].tolist()
    lines = [f"unconfirmed: {reason} ({reasons.count(reason)} places)" for reason in dict.fromkeys(reasons)]
    hints = np.where(speeds.speeds.extrapolated_speed > _SLOWEST_HINT, speeds.speeds.extrapolated_speed, np.nan)
    for place in np.argsort(-hints, axis=None, stable=True)[: min(3, int(np.sum(~np.isnan(hints))))]:
        i, j = np.unravel_index(place, hints.shape)
        lines.append(
            f"measure next: d = {speeds.distance[i]:.3f} m, h = {speeds.height[j]:.3f} m at about "
            f"{floor_speed(float(hints[i, j]))} m/s (a hint, no permission)"
        )
    return lines


def comparison_result(comparison: Comparison) -> dict[str, Any]:
    """A Comparison for JSON."""

    def error(found: Any) -> dict[str, Any] | None:
        if found is None:
            return None
        return {
            "state": found.state,
            "distance_m": found.distance,
            "height_m": found.height,
            "speed_mps": found.speed,
            "measured_N": found.measured,
            "predicted_N": found.predicted,
            "error_percent": found.percent,
        }

    variation = comparison.variation
    return {
        "on": comparison.on,
        "models": [
            {
                "model": model.model,
                "accuracy": accuracy_result(model.accuracy),
                "underestimated_share": model.underestimated_share,
                "overestimated_share": model.overestimated_share,
                "most_underestimated": error(model.most_underestimated),
                "most_overestimated": error(model.most_overestimated),
                "note": model.note,
            }
            for model in comparison.models
        ],
        "allowed": [
            {
                "model": allowed.model,
                "limit_N": allowed.limit,
                "limit_source": allowed.limit_source,
                "places": allowed.places,
                "confirmed_places": allowed.confirmed,
                "lowest_speed_mps": allowed.lowest,
                "median_speed_mps": allowed.median,
                "highest_speed_mps": allowed.highest,
                "note": allowed.note,
            }
            for allowed in comparison.allowed
        ],
        "variation": {
            "speed_mps": variation.speed,
            "states": variation.states,
            "lowest_force_N": variation.lowest,
            "highest_force_N": variation.highest,
            "ratio": variation.ratio,
            "rank_correlation_distance": variation.rank_correlation_distance,
            "rank_correlation_height": variation.rank_correlation_height,
        },
        "bound": comparison.bound.describe(),
        "assumptions": list(comparison.statements),
    }


def comparison_lines(comparison: Comparison) -> list[str]:
    """A Comparison in tables and words."""
    lines = [line for line in comparison.statements if line.startswith("SIMULATED")]
    lines += [f"Force models on {comparison.on} (underestimation is the dangerous side)"]
    lines += accuracy_lines([(model.model, model.accuracy) for model in comparison.models])
    lines += [f"{model.model}: {model.note}" for model in comparison.models if model.note]
    for model in comparison.models:
        if model.model != "contact model":
            continue
        lines += ["", "Where the standard's contact model is wrong"]
        for share, side, extreme in (
            (model.underestimated_share, "underestimates", model.most_underestimated),
            (model.overestimated_share, "overestimates", model.most_overestimated),
        ):
            at = (
                ""
                if extreme is None
                else f"; most by {abs(extreme.percent):.1f} % ({extreme.predicted:.0f} N for {extreme.measured:.0f} N "
                f"measured) at d = {extreme.distance:.3f} m, h = {extreme.height:.3f} m, v = {extreme.speed:.3f} m/s"
            )
            lines.append(f"  {side} {100 * share:.0f} % of the states{at}")
    variation = comparison.variation
    lines += [
        "",
        f"Over the workspace at {variation.speed:.3f} m/s the measured force varies from {variation.lowest:.0f} to "
        f"{variation.highest:.0f} N (x {variation.ratio:.2f}, {variation.states} states); rank correlation "
        f"{variation.rank_correlation_distance:.2f} with distance, {variation.rank_correlation_height:.2f} with height",
    ]
    if comparison.allowed:
        header = ["speeds allowed [m/s]", "limit", "measured places", "confirmed", "lowest", "median", "highest"]
        rows = [
            [
                allowed.model,
                f"{allowed.limit:g} N",
                str(allowed.places),
                str(allowed.confirmed),
                *(floor_speed(value) for value in (allowed.lowest, allowed.median, allowed.highest)),
            ]
            for allowed in comparison.allowed
        ]
        lines += ["", *table(header, rows), f"maps with {comparison.bound}"]
        lines += [
            f"{source}" for source in dict.fromkeys(f"{a.limit:g} N: {a.limit_source}" for a in comparison.allowed)
        ]
        lines += [f"{a.model} at {a.limit:g} N: {a.note}" for a in comparison.allowed if a.note]
    return [*lines, "", *listing("Assumes", comparison.statements)]
