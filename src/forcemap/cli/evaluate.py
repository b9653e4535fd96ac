"""forcemap evaluate: accuracies, forms beside each other, and whether an older map holds."""

from __future__ import annotations

import shlex
from typing import Annotated

import numpy as np
from typer import Option

import forcemap as fm
from forcemap.answers.evaluate import EvaluateAnswer
from forcemap.answers.forms import FormAnswer, FormsAnswer
from forcemap.answers.map_check import MapCheckAnswer, StateCheck
from forcemap.answers.slowest import FromSpeedAnswer, SlowestAnswer
from forcemap.assessment.folder import beside
from forcemap.assessment.folder_map import folder_map
from forcemap.campaigns.conditions import CAMPAIGN_FILE
from forcemap.cli.options import (
    CONTACT_MISSING,
    ContactKind,
    FormName,
    Json,
    Table,
    campaign_table,
    fitted,
    force_map_from,
    impacts_of,
    too_few_states_named,
    wanted_form,
)
from forcemap.cli.output import (
    accuracy_lines,
    change,
    counted,
    emit,
    fit_notes,
    listing,
    outside_words,
    place_lines,
    shown,
    table,
    verdict_first,
)
from forcemap.comparisons.map_check import fitted_states
from forcemap.comparisons.slowest_speeds import compare_slowest_speeds
from forcemap.errors import few
from forcemap.maps.accuracy import FEWEST_TESTS
from forcemap.maps.forms import FORMS, form_of

_EXIT = {fm.MapOutcome.HOLDS: 0, fm.MapOutcome.DOES_NOT_HOLD: 1, fm.MapOutcome.CANNOT_TELL: 2}


def evaluate(
    table: Table,
    map_source: Annotated[
        str | None, Option("--map", help="Compare this map with all rows, in place of fitting the train rows.")
    ] = None,
    against: Annotated[
        str | None, Option("--against", help="Does this older map still hold for these new impacts?")
    ] = None,
    forms: Annotated[bool, Option("--forms", help="Compare the forms on the same states, and recommend.")] = False,
    slowest: Annotated[
        bool, Option("--slowest", help="From which speed on may the map hold? Fits it from each of its speeds on.")
    ] = False,
    area: Annotated[
        str | None, Option("--area", "--region", help="For --slowest: body area or region, to count places.")
    ] = None,
    contact: ContactKind = None,
    form: FormName = None,
    as_json: Json = False,
) -> int:
    """Say how far predicted forces are from the measured ones.

    Fits the train rows and compares with the test rows, with each fitted state left out in turn, with all states of
    each place left out in turn, and with all. Says whether the form fits, and whether states measured again show a
    drift.

    With --slowest: bound, and places with a speed, by the speed from which the map holds (map.slowest_mps in
    campaign.toml). With --against: exit code 0 the map holds, 1 it does not hold, 2 cannot tell. With --forms: 2 none
    is recommended.

    Example: forcemap evaluate impacts.csv --map ur10e
    """
    if sum((map_source is not None, against is not None, forms, slowest)) > 1:
        raise fm.InputError(
            "evaluate: found more than one of --map, --against, --forms and --slowest, expected at most one"
        )
    if (area is not None or contact is not None) and not slowest:
        raise fm.InputError("evaluate: --area and --contact go with --slowest")
    if forms and form:
        raise fm.InputError("form: --forms compares all forms, leave --form out")
    if against is not None:
        with too_few_states_named(against, form):
            force_map, _ = force_map_from(against, form)
        dataset = impacts_of(table)
        check = fm.check_map(force_map, dataset)
        holds = MapCheckAnswer.from_result(check, simulated=dataset.simulated or force_map.simulated)
        emit(holds, check_lines(holds), as_json=as_json)
        return _EXIT[check.outcome]
    if forms:
        dataset = impacts_of(table)
        compared = FormsAnswer.from_result(fm.compare_forms(dataset), simulated=dataset.simulated)
        emit(compared, forms_lines(compared, table, form_of(dataset.conditions).name), as_json=as_json)
        return 2 if compared.recommended is None else 0
    if slowest:
        answer_slowest = _slowest(table, area, contact, form)
        emit(answer_slowest, slowest_lines(answer_slowest), as_json=as_json)
        return 0
    if map_source:
        dataset = impacts_of(table)
        with too_few_states_named(map_source, form):
            force_map, _ = force_map_from(map_source, form)
        new = dataset.select(~np.isin(dataset.state, fitted_states(force_map, dataset)))
        accuracies = _of_new(force_map, dataset, new)
    else:
        with too_few_states_named(table, form):
            dataset, force_map = fitted(table, form)
        accuracies, new = fm.map_accuracy(force_map, dataset), dataset.independent_test
    answer = EvaluateAnswer.of_map(force_map, dataset, accuracies, new)
    emit(answer, evaluate_lines(answer), as_json=as_json)
    return 0


def _of_new(force_map: fm.ForceMap, dataset: fm.ImpactDataset, new: fm.ImpactDataset) -> tuple[fm.Accuracy, ...]:
    """The accuracy of a map on all states, and on those that it was not fitted to if it was to others, else on those
    inside its range: first if they are 6 or more, for of fewer the largest error says next to nothing."""
    of_all = fm.force_map_accuracy(force_map, dataset)
    part, on = new, "states not fitted"
    if len(new) == len(dataset) or not len(new):  # beyond its range the map is continued, which is another question
        inside = force_map.measured_range.near(dataset.states.coordinates, dataset.tolerance.scale)
        part = dataset.select(np.isin(dataset.state, np.array(dataset.states.name)[inside]))
        on = "states inside the measured range"
    if len(part) == len(dataset) or not len(part) or not (part.states.impacts > 0).any():
        return (of_all,)
    of_part = fm.force_map_accuracy(force_map, part, on=on)
    return (of_part, of_all) if of_part.states >= FEWEST_TESTS else (of_all, of_part)


def _slowest(source: str, area: str | None, contact: fm.Contact | None, form: str | None) -> SlowestAnswer:
    """The maps of a table from each of its speeds on."""
    if area is not None and contact is None:
        raise fm.InputError(CONTACT_MISSING)
    dataset, limit = impacts_of(source), None if area is None else fm.force_limit(area, table=campaign_table(source))
    with too_few_states_named(source, form):
        of_form = wanted_form(form)
        found = compare_slowest_speeds(
            dataset,
            lambda each: folder_map(source, each, form=of_form).force_map,
            limit=limit,
            contact=contact or fm.Contact.TRANSIENT,
        )
    return SlowestAnswer(
        area=None if limit is None else limit.name,
        contact=None if contact is None else str(contact),
        stated_mps=dataset.conditions.slowest,
        from_speeds=[FromSpeedAnswer.of_map(each) for each in found],
        simulated=dataset.simulated,
    )


def slowest_lines(answer: SlowestAnswer) -> list[str]:
    """Which speed gives the narrowest bound and which the most places, and every speed beside the others."""
    narrow, wide = answer.narrowest, answer.widest
    if narrow is None or narrow.bound_margin_percent is None:
        verdict = "NO TOLERANCE BOUND from any speed on: too few states"
    else:
        span = narrow.bound_margin_percent
        above = f"{span.lowest:.1f} to {span.highest:.1f} % above the prediction"
        verdict = f"Narrowest bound: from {shown(narrow.slowest_mps)} m/s, {above}"
        if wide:
            verdict += (
                f"; most places with a speed: from {shown(wide.slowest_mps)} m/s, {wide.places_with_a_speed} of "
                f"{wide.places_looked_at}"
            )
    with_places = answer.area is not None
    header = [
        "from m/s",
        "states",
        "scatter",
        "bound above",
        "slower",
        "doubts",
        "places",
        "5 deg off",
        "to program m/s",
    ]
    shared = answer.shared_warnings
    rows = [_from_speed_row(each, len({*each.warnings} - {*shared})) for each in answer.from_speeds]
    columns = len(header) if with_places else len(header) - 3
    for_area = f" for {answer.area}, {answer.contact} contact" if with_places else ""
    stated = f"{shown(answer.stated_mps)} m/s" if answer.stated_mps else "none"
    return [
        *verdict_first(f"{verdict}; figures to compare, NO PERMISSION", shared, simulated=answer.simulated),
        "",
        f"Maps of this campaign from each of its speeds on{for_area}; map.slowest_mps in campaign.toml states {stated}",
        *table(header[:columns], [row[:columns] for row in rows]),
        "bound above: the tolerance bound above the prediction at the fitted states; slower: the most that "
        "slower impacts measured, of the map's force at its lowest speed, at least 100 %: the more, the fewer places "
        "have a speed",
        *(
            [
                "5 deg off: places with a speed for motion up to 5 degrees off the direction, as a table of zones asks "
                "for; fewer of its zones have one, each that of its worst place (forcemap export says how many)"
            ]
            * with_places
        ),
        "doubts: further ones of that map alone, of motion off the direction, too; below for the maps named above; "
        "forcemap speed says them, and permits, once the speed is stated",
        *_doubts_of_named(answer),
        *(f"from {shown(each.slowest_mps)} m/s: {each.reason}" for each in answer.from_speeds if each.reason),
        "From a faster speed on, speeds are higher where there are any, and places that permit only slower ones have "
        "none; the first row is the map of all states. A map that fits, with slower impacts beside it, was exceeded at "
        "fewer places by robots that feel slow contacts late than one through all states (docs/validity.md). Say which "
        'in campaign.toml: [map] slowest_mps = V (docs/your_device_files.md, "A robot that feels slow contacts late")',
    ]


def _doubts_of_named(answer: SlowestAnswer) -> list[str]:
    """The further doubts of the maps that the verdict names and of the one that is stated."""
    named = [each for each in (answer.narrowest, answer.widest) if each is not None]
    named += [each for each in answer.from_speeds if each.slowest_mps == answer.stated_mps]
    lines = []
    for each in answer.from_speeds:
        further = [warning for warning in each.warnings if warning not in answer.shared_warnings]
        if each in named and further:
            lines += listing(f"Further doubts from {shown(each.slowest_mps)} m/s", further)
    return lines


def _from_speed_row(each: FromSpeedAnswer, doubts: int) -> list[str]:
    span, low, high = each.bound_margin_percent, each.lowest_to_program_mps, each.highest_to_program_mps
    return [
        shown(each.slowest_mps),
        f"{each.states} at {each.places} places",
        "-" if each.state_sd_percent is None else f"{each.state_sd_percent:.1f} %",
        "-" if span is None else f"{span.lowest:.1f} to {span.highest:.1f} %",
        f"{100 * each.slower_over_map:.0f} %" if each.slower_over_map and span else "-",
        str(doubts),
        f"{each.places_with_a_speed} of {each.places_looked_at}",
        str(each.places_with_a_speed_5_deg_off),
        "-" if low is None or high is None else f"{shown(low)} to {shown(high)}",
    ]


def evaluate_lines(answer: EvaluateAnswer) -> list[str]:
    """How far a map is from measured forces: the largest underestimation first."""
    first = answer.accuracies[0]
    verdict = (
        f"predictions are at most {first.max_underestimation_percent:.1f} % too low, the dangerous side, and "
        f"{first.max_overestimation_percent:.1f} % too high, on {first.on}"
        f"{outside_words(first)}{_fitted_words(answer)}{_further_off(answer)}"
    )
    if len(answer.accuracies) == 1 and answer.places is not None and answer.own_sd_percent is None:
        verdict = "NOTHING TELLS HOW FAR THIS MAP IS OFF: it passes through every state that it was fitted to"
    return [
        *verdict_first(verdict, answer.doubts, simulated=answer.simulated),
        f"{answer.form} {answer.map}",
        f"states found {answer.states_found}",
        *accuracy_lines([(accuracy.on, accuracy) for accuracy in answer.accuracies]),
        *_bound_lines(answer),
        *place_lines(answer),
        *(f"most underestimated of {part.on}: {part.worst_state}" for part in answer.accuracies if part.worst_state),
        *fit_notes(answer),
    ]


def _further_off(answer: EvaluateAnswer) -> str:
    """The largest underestimation where the accuracy that stands first has a smaller one; else empty."""
    first, *others = answer.accuracies
    worst = max(others, key=lambda part: part.max_underestimation_percent, default=first)
    if not worst.max_underestimation_percent > first.max_underestimation_percent:
        return ""
    return f"; {worst.max_underestimation_percent:.1f} % too low on {worst.on}"


def _fitted_words(answer: EvaluateAnswer) -> str:
    """How many of all states the map was fitted to, where their errors stand first; else empty."""
    among = answer.fitted_states and answer.accuracies[0].on == "all states"
    return f", {answer.fitted_states} of which the map was fitted to" if among else ""


_MOST_NAMES = 8
"""States above the bound that are named; a choice: --json names all."""


def _bound_lines(answer: EvaluateAnswer) -> list[str]:
    """How many of the states that a map was not fitted to lie above its bound; nothing without such states or bound."""
    if (above := answer.new_states_above_bound) is None:
        return []
    named = f": {few(above, _MOST_NAMES)}" if above else ""
    censored, outside = answer.new_states_censored, answer.new_states_outside
    beyond = f"{outside} outside the measured range, where the bound promises nothing"
    parts = [beyond] * bool(outside) + [f"{censored} above the device range"] * bool(censored)
    which = f" ({'; '.join(parts)})" if parts else ""
    of = f"{len(above)} of the {counted(answer.new_states, 'state')} that the map was not fitted to{which}"
    return [f"{of} lie above the {fm.ToleranceBound()}{named}"]


def forms_lines(answer: FormsAnswer, source: str, stated: str) -> list[str]:
    """A recommendation, its reasons, and the forms beside each other; `stated` is the campaign's form."""
    header = [
        "form",
        "error",
        "underest.",
        "max",
        "place out",
        "bound mean",
        "bound max",
        "rises inside",
        "rises above",
    ]
    return [
        *verdict_first(f"Recommended: {answer.recommended or 'none'}{_after(answer)}", simulated=answer.simulated),
        *(f"  {reason}" for reason in answer.reasons),
        *_next(answer, source, stated),
        "",
        f"Forms on {answer.states} states, each predicted from the others",
        *table(header, [_form_row(form) for form in answer.forms]),
        "error: root mean square of ln F; underest.: its dangerous side; place out: with all states of a place left "
        "out, as at a new place; bound: above the prediction at the measured states, - none",
        "p: one-sided paired t test of the squared errors of ln F, states taken as independent; place by place: of "
        "those with all states of a place left out, which count together",
        "rises inside, rises above: the force never falls with speed in the box around the measured states, and in "
        "that box up to 1.5 times the highest measured speed",
        *(f"{form.form}: {form.note}" for form in answer.forms if form.note),
        *(f"{form.form} not compared: {form.reason}" for form in answer.refused),
        "",
        *listing("Assumes", answer.assumptions),
    ]


def _after(answer: FormsAnswer) -> str:
    """What has to be done before the recommended form is used."""
    off = any(form.form == answer.recommended and not form.covered for form in answer.forms)
    return ", but measure more before its speeds are used" if off else ""


def _next(answer: FormsAnswer, source: str, stated: str) -> list[str]:
    """How a form is used that is recommended and not the campaign's, or has a lower error than the default."""
    form, own = answer.recommended, {each.name for each in FORMS}  # the Euclidean-distance map cannot be used
    if form == fm.CFM_3D.name:
        sound = [each for each in answer.forms if each.form in own and each.rises_inside and each.max_bound_percent]
        best = min(sound, key=lambda each: each.error_percent, default=None)
        if best is not None and best.form != form:
            use = "campaign.toml states it" if best.form == stated else _use(source, best.form)
            error = f"{best.form} has the lowest error of the forms that rise and have a bound, but not clearly"
            return [
                f"{error}. To choose it all the same, {use}; states of role test at other places have to confirm it"
            ]
    return [] if form in (None, stated) else [f"Next: {_use(source, form)}"]


def _use(source: str, form: str) -> str:
    """How a form becomes that of a campaign; of impacts alone, how a map of it is fitted."""
    toml = beside(source) / CAMPAIGN_FILE
    if toml.is_file():
        return f'state form = "{form}" below [map] in {toml}; every command and the page then take it'
    quoted = shlex.quote(source)
    return f"forcemap fit {quoted} --form {form} -o map.json; then name map.json in place of {quoted}"


def _form_row(form: FormAnswer) -> list[str]:
    bounds = ["-" if x is None else f"+{x:.1f} %" for x in (form.mean_bound_percent, form.max_bound_percent)]
    rises = ["yes" if rising else "no" for rising in (form.rises_inside, form.rises_above)]
    errors = (form.error_percent, form.underestimation_percent, form.accuracy.max_underestimation_percent)
    place = "-" if form.place_error_percent is None else f"{form.place_error_percent:.2f} %"
    return [form.form, *(f"{error:.2f} %" for error in errors), place, *bounds, *rises]


def check_lines(answer: MapCheckAnswer) -> list[str]:
    """Whether a map holds, what to do now, and every new state beside what was expected."""
    count, out = len(answer.states), len(answer.left_out)
    on = f", on {count} of {count + out} states, {out} left out" if out else ""
    verdict = f"{answer.outcome.replace('_', ' ').upper()}{on}: {answer.reason}"
    lines = [
        *verdict_first(verdict, simulated=answer.simulated),
        f"next: {answer.next_step}",
    ]
    if answer.states:
        low, high = change(answer.mean_ratio_low), change(answer.mean_ratio_high)
        lines += [
            "",
            f"measured over predicted force, on average: {change(answer.mean_ratio)} "
            f"({100 * (answer.confidence or 0):.4g} % confidence: {low} to {high}); above is the dangerous side",
            *table(
                ["state", "d [m]", "h [m]", "v [m/s]", "measured [N]", "predicted [N]", "expected [N]", "change", ""],
                [_row(state) for state in answer.states],
            ),
            "expected: where all states lie at once if nothing has changed"
            + ("; > at least, above the device range" if any(state.censored for state in answer.states) else ""),
        ]
    by_reason: dict[str, list[str]] = {}
    for state in answer.left_out:
        words = f"{state.state_id} (d {state.distance_m:g} m, h {state.height_m:g} m, v {state.speed_mps:g} m/s)"
        by_reason.setdefault(state.reason, []).append(words)
    left_out = [f"{counted(len(names), 'state')} {reason}: {', '.join(names)}" for reason, names in by_reason.items()]
    lines += ["", *listing("Left out", left_out)] if left_out else []
    return [*lines, "", *listing("Assumes", answer.assumptions)]


def _row(state: StateCheck) -> list[str]:
    return [
        state.state_id,
        *(f"{value:.3f}" for value in (state.distance_m, state.height_m, state.speed_mps)),
        f"{'> ' if state.censored else ''}{state.measured_N:.1f}",
        f"{state.predicted_N:.1f}",
        f"{state.lowest_expected_N:.1f} to {state.highest_expected_N:.1f}",
        change(state.ratio),
        "MOVED" if state.moved else "",
    ]
