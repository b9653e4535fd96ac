"""forcemap fit."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

from typer import Option

import forcemap as fm
from forcemap.answers.map import CensoringAnswer, FitAnswer, Margins
from forcemap.campaigns.state import SPEED_TOLERANCE
from forcemap.cli.options import DeviceSpring, FormName, Json, Table, fitted, too_few_states_named
from forcemap.cli.output import (
    accuracy_lines,
    change,
    counted,
    emit,
    fit_notes,
    outside_words,
    place_lines,
    table,
    verdict_first,
    write_result,
)
from forcemap.maps.accuracy import ON_TEST
from forcemap.maps.bounds import PAPER_MARGIN
from forcemap.maps.carry_over import EARLIER_MAP
from forcemap.maps.form_test import MOST_SCATTER
from forcemap.maps.map_file import map_text

_SCATTER_TO_ASK = 0.04
"""Standard deviation of states about the form above which it is said how to ask whether slow impacts are the cause; a
choice between the 2 to 3 % that the paper's robots show and the doubt of `MOST_SCATTER`."""


def fit(
    table: Table,
    form: FormName = None,
    device_spring: DeviceSpring = None,
    discard_censored: Annotated[
        bool, Option("--discard-censored", help="Discard impacts above the device range, as the paper does.")
    ] = False,
    output: Annotated[str | None, Option("-o", "--output", help="Write the map to this JSON file.")] = None,
    as_json: Json = False,
) -> None:
    """Fit a collision-force map to the train rows of a table.

    Impacts above the device range count as at least that force.

    Example: forcemap fit impacts.csv -o map.json
    """
    impacts = fm.CensoredImpacts.DISCARD if discard_censored else fm.CensoredImpacts.AT_LEAST
    with too_few_states_named(table, form):
        dataset, force_map = fitted(table, form, impacts, device_spring=device_spring)
    if force_map.require_fit().transfer:
        raise fm.InputError(
            f"the folder holds {EARLIER_MAP}, which its few states carry over: forcemap transfer "
            f"{Path(table, EARLIER_MAP)} {table} -o MAP.json; move that file away to fit the campaign by itself",
            file=table,
        )
    accuracies = fm.map_accuracy(force_map, dataset)
    if output:
        write_result(output, map_text(force_map), mark='"schema": "forcemap-map/')
    answer = FitAnswer.of_fit(dataset, force_map, accuracies)
    written = [f"map written to {output}" if output else "no file written; -o MAP.json writes the map"]
    if force_map.binding.refusal:
        pass
    elif math.isnan(force_map.conditions.device.stiffness):
        written.append(
            "Next: state the device's spring, device.stiffness_N_per_m in campaign.toml, or fit again with "
            "--device-spring-N-per-mm"
        )
    else:
        contact = "quasi-static" if answer.transient_refused else "transient (or quasi-static)"
        written.append(
            f"Next: forcemap speed-map {shlex.quote(output or table)} --area AREA --contact {contact}; forcemap limits "
            "lists the areas"
        )
    if _slow_departs(answer):
        written.append(
            "The slowest states depart from the form and widen the bound everywhere: what a map from a faster speed on "
            f"would permit, forcemap evaluate {shlex.quote(table)} --slowest --area AREA --contact transient tells"
        )
    elif force_map.fit and _SCATTER_TO_ASK < force_map.fit.state_sd <= MOST_SCATTER:
        written.append(
            f"States scatter by {100 * force_map.fit.state_sd:.1f} %, which makes the bound wide: whether slow impacts "
            f"are the cause, forcemap evaluate {shlex.quote(table)} --slowest tells"
        )
    emit(answer, [*fit_lines(answer), "", *written], as_json=as_json)


def _slow_departs(answer: FitAnswer) -> bool:
    """True if the form misses forces at the lowest measured speed most."""
    test, lowest = answer.form_test, answer.lowest_measured[2] or 0.0
    if not (test.misses and test.departures and answer.bound_margin_percent):
        return False
    speed = test.departures[0].speed_mps
    return speed is not None and speed <= lowest + SPEED_TOLERANCE


def fit_lines(answer: FitAnswer) -> list[str]:
    """A fitted map: what it is good for, what it was fitted to, its coefficients and its accuracy."""
    low, high = answer.lowest_measured, answer.highest_measured
    d, h, v = ((a or 0.0, b or 0.0) for a, b in zip(low, high, strict=True))
    few, most = answer.fewest_repeats, answer.repeats
    repeats = counted(most, "impact") if few == most else f"{few} to {most} impacts"
    effect = answer.discard_fit
    doubts = [answer.pressure_not_mapped, answer.saturation_doubt, *answer.contradictions, *answer.doubts]
    lines = [
        *verdict_first(_verdict(answer), filter(None, doubts), simulated=answer.simulated),
        f"{answer.form} {answer.source}",
        f"  {impacts_words(answer)}",
        f"  {repeats} a state; states found {answer.states_found}",
        f"  measured: d {d[0]:.3f} to {d[1]:.3f} m, h {h[0]:.3f} to {h[1]:.3f} m, "
        f"v {fm.floor_speed(v[0])} to {fm.floor_speed(v[1])} m/s{_less(answer.speed_error)} (their convex hull)",
    ]
    if answer.states_left_out:
        lines.append(
            f"  {counted(answer.states_left_out, 'state')} left out, with saturated impacts alone: "
            f"{', '.join(answer.states_left_out_names)}"
        )
    lines += ["", *_censoring_lines(answer, effect)] if effect else []
    columns = [answer.terms, [f"{b:.4f}" for b in answer.coefficients]]
    columns += [[f"{b:.4f}" for b in effect.coefficients]] if effect else []
    columns += [_figures(answer.standard_errors, ".4f")]
    ends = zip(_figures(answer.intervals_low, ".4f"), _figures(answer.intervals_high, ".4f"), strict=True)
    columns += [["-" if low == "-" else f"{low} to {high}" for low, high in ends]]
    columns += [_figures(answer.p_values, ".3g")]
    (scatter,) = _figures([answer.state_sd_percent], ".2f")
    header = ["term", "coefficient", *["if discarded"] * bool(effect), "standard error", "95 % interval", "p value"]
    return [
        *lines,
        "",
        "ln F = sum of coefficient x term; F in N, d and h in m, v in m/s",
        *table(header, zip(*columns, strict=True)),
        f"state-to-state SD {scatter} % ({answer.degrees_of_freedom:.1f} degrees of freedom), "
        f"RMSE {answer.rmse_N:.2f} N, R^2 of ln F {answer.r_squared:.4f}, condition number "
        f"{answer.condition_number:.0f} (columns scaled to length 1)",
        *_above_lines(answer),
        *place_lines(answer),
        *other_lines(answer),
        "",
        "Accuracy",
        *accuracy_lines([(accuracy.on, accuracy) for accuracy in answer.accuracies]),
        *fit_notes(answer),
    ]


def _above_lines(answer: FitAnswer) -> list[str]:
    """Which fitted states lie above the bound; nothing where none does."""
    names = ", ".join(answer.states_above_bound)
    return [f"above the bound of this map: {names}; look at their recordings (forcemap inspect)"] if names else []


def _figures(values: Iterable[float | None], digits: str) -> list[str]:
    """Figures for a table, a dash for one that there is none of."""
    return ["-" if value is None else format(value, digits) for value in values]


def _less(speed_error: float | None) -> str:
    """That speeds are less an error that the campaign states; nothing where it states none."""
    return f", the stated speeds less their error of {100 * speed_error:g} %" if speed_error else ""


def other_lines(answer: FitAnswer) -> list[str]:
    """Maps of other quantities of the same impacts; nothing where there are none."""
    lines = []
    for other in answer.other_quantities or []:
        name = f"{other.quantity.replace('_', ' ')} [{other.unit}]"
        without = f", {counted(other.impacts_without, 'impact')} without it" * bool(other.impacts_without)
        lines.append(
            f"also mapped: {name} of {counted(other.states, 'state')}{without}; "
            f"state-to-state SD {other.state_sd_percent:.2f} %, bound {_span(other.bound_margin_percent)}"
        )
    return lines


def _verdict(answer: FitAnswer) -> str:
    if answer.binding.state == "broken":
        return f"NO SAFE SPEED follows from this map: {answer.binding.reason}"
    if answer.bound_margin_percent is None:
        return "NO SAFE SPEED follows from this map with a tolerance bound: too few states for one"
    low, high = answer.bound_margin_percent.lowest, answer.bound_margin_percent.highest
    fixed = "suffices" if high <= 100 * PAPER_MARGIN else "is too small"
    if answer.form_test.misses and not answer.form_test.covered:
        return "MEASURE MORE before speeds of this map are used: its form does not fit, and a bound may not cover that"
    follow = "can follow from this map" if answer.spring_stated else "follow only once the device's spring is stated"
    only = f", FOR QUASI-STATIC CONTACT ALONE ({answer.transient_refused})" if answer.transient_refused else ""
    if not answer.range_stated:
        most = f"{math.floor(answer.highest_limit_N or 0)} N"
        follow += (
            f", for limits up to {most} alone, as the device range is not stated (device.range_N in campaign.toml)"
        )
    worst = answer.accuracy.max_underestimation_percent
    beyond = ""
    # the miss is a share of the measured force, the bound lies above the predicted one
    if answer.accuracy.on != ON_TEST and 100 * worst / (100 - worst) > high:
        name = answer.accuracy.worst_state
        beyond = (
            f" (at {name}, WHICH LIES ABOVE THE BOUND of the map, too: look at its recordings, forcemap inspect)"
            if name in answer.states_above_bound
            else f" (at {name}, left out for that; in the map it counts, whose bound lies above it)"
        )
    return (
        f"SAFE SPEEDS {follow}{only}: its tolerance bound lies {low:.1f} to {high:.1f} % above the "
        f"prediction at the measured states (a fixed + 10 % {fixed} here), and predictions are at most "
        f"{worst:.1f} % too low on {answer.accuracy.on}{outside_words(answer.accuracy)}{beyond}"
    )


def impacts_words(answer: FitAnswer) -> str:
    """How many states and impacts a map is fitted to, and what became of the censored ones."""
    words = f"{counted(answer.states, 'state')}, {counted(answer.samples + answer.censored_samples, 'impact')}"
    if answer.censored_samples:
        used = "counted as at least that force" if answer.censored_fit else "not in the fit"
        words = f"{words}, {answer.censored_samples} of them saturated ({used})"
    return f"{words}; {answer.test_samples} more of role test, not fitted" if answer.test_samples else words


def _censoring_lines(answer: FitAnswer, effect: CensoringAnswer) -> list[str]:
    """What a map is with its censored impacts and without them, and its forces at their states."""
    censored, counted_in, left_out = (
        effect.at_censored,
        effect.predicted_with_censored_N,
        effect.predicted_at_censored_N,
    )
    added = answer.states - effect.states
    rows = [
        ["states", str(answer.states), str(effect.states)],
        ["impacts", str(answer.samples + answer.censored_samples), str(effect.samples)],
        ["measured range (volume of the hull)", "100 %", f"{effect.measured_range_percent:.0f} %"],
        ["state-to-state SD", f"{answer.state_sd_percent:.2f} %", f"{effect.state_sd_percent:.2f} %"],
        [
            "tolerance bound, above the prediction",
            *map(_span, (answer.bound_margin_percent, effect.bound_margin_percent)),
        ],
    ]
    if added:
        shared = (effect.bound_margin_with_censored_percent, effect.bound_margin_percent)
        rows.append([f"  at the {effect.states} states of both", *map(_span, shared)])
    states = zip(censored.state_id, censored.censored, censored.at_least_N, counted_in, left_out, strict=True)
    return [
        *table(["Saturated impacts", "counted as at least", "discarded (--discard-censored)"], rows),
        *_why_wider(answer, effect, added),
        *table(
            ["state", "above the range", "reached at least [N]", "predicted [N]", "if discarded [N]", "difference"],
            [
                [name, str(n), f"{least:.0f}", f"{one:.1f}", f"{other:.1f}", change((one or 0) / (other or 1))]
                for name, n, least, one, other in states
            ],
        ),
    ]


def _why_wider(answer: FitAnswer, effect: CensoringAnswer, added: int) -> list[str]:
    """Where a wider bound comes from, as far as the figures say so."""
    spans = (answer.bound_margin_percent, effect.bound_margin_with_censored_percent, effect.bound_margin_percent)
    if any(span is None for span in spans):
        return []
    whole, shared, discarded = (round(span.highest, 1) for span in spans if span)
    if whole <= discarded:
        return ["the bound is no wider for the censored impacts"]
    states = f"the {counted(added, 'added state')}"
    if shared <= discarded:
        return [f"the wider bound comes from {states}, which the other fit says nothing about"]
    if whole <= shared:
        return ["the bound is wider at the states of both: the censored impacts show more scatter"]
    return [
        f"the wider bound comes from {states}, which the other fit says nothing about, and from more scatter that the "
        "censored impacts show"
    ]


def _span(span: Margins | None) -> str:
    return f"+{span.lowest:.1f} to +{span.highest:.1f} %" if span else "none"
