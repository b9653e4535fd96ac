"""forcemap confirm."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Option

import forcemap as fm
from forcemap.answers.plan import ConfirmAnswer
from forcemap.assessment.confirmation import confirmation_plan
from forcemap.cli import planned
from forcemap.cli.options import ContactKind, FormName, Json, Limit, Source, bound_from, force_map_from, limit_from
from forcemap.cli.output import emit, listing, table, verdict_first
from forcemap.maps.forms import form_of
from forcemap.planning.confirm import ACROSS, BUMP, IMPACTS, RIDGE, ConfirmationPlan, ConfirmationResult, Confirmed
from forcemap.planning.runs import extend_plan
from forcemap.words import sentence, sentences

_ALIKE = 3  # impacts of a state that cannot tell, from which on more of them are not asked for; a choice
_EXIT = {Confirmed.PASSES: 0, Confirmed.DOES_NOT_PASS: 1, Confirmed.CANNOT_TELL: 2}


def confirm(
    source: Source,
    limit: Limit = None,
    contact: ContactKind = None,
    impacts: Annotated[
        int | None, Option("--impacts", help="How many; default 6, or as many as are planned already.")
    ] = None,
    form: FormName = None,
    dry_run: planned.DryRun = False,
    as_json: Json = False,
) -> int:
    """Plan impacts that confirm the released speeds, with the rule they must pass; once measured, tell if they do.

    Exit code: 0 planned, or passes; 1 does not pass, or no speed is released; 2 cannot tell.

    Example: forcemap confirm my-campaign --area back_of_hand --contact transient
    """
    force_limit, kind = limit_from(limit, contact, source=source)
    force_map = force_map_from(source, form)[0]
    bound = bound_from(force_map)
    campaign = fm.read_campaign(source) if Path(source, "plan.csv").exists() else None
    plan = campaign.plan if campaign else None
    dataset = fm.read_dataset(source) if campaign else None
    files: list[str] = []
    if campaign is None or dataset is None:
        answer = fm.confirm_plan(force_map, force_limit, bound=bound, contact=kind, impacts=impacts, planned=plan)
    else:
        planned.refuse_waiting(campaign, campaign.plan.role == "train", dataset, "planned states")
        case: dict[str, Any] = {"limit": force_limit, "contact": kind, "impacts": impacts}
        answer = confirmation_plan(campaign, dataset, force_map, bound=bound, **case)
        files = [] if dry_run else _written(campaign, answer)
    options = {**planned.limit_words(limit, contact), "--form": form}
    again = planned.command_line("confirm", source, options | {"--impacts": impacts})
    to_measure = planned.unwritten_lines(again) if dry_run else planned.measuring_lines(source, files, again)
    if campaign is None:
        to_measure = ["Nothing written: the source is no campaign with a plan"]
    lines = _lines(source, answer, to_measure, again, planned.command_line("next", source, options))
    emit(ConfirmAnswer.of_confirmation(answer, source, files, again), lines, as_json=as_json)
    return _EXIT[answer.result.outcome] if answer.result else int(bool(answer.refusal))


def _written(campaign: fm.Campaign, answer: ConfirmationPlan) -> list[str]:
    """Write what is to be measured into the campaign's plan and sheet; the names of the files, none if nothing is."""
    stays = campaign.plan.select(~np.isin(campaign.plan.recording, answer.replaced.recording))
    if not _to_measure(answer):
        if len(answer.replaced):
            fm.write_plan(stays, campaign.folder)
        return []
    waiting = planned.waiting_runs(campaign, but=[*answer.plan.recording, *answer.replaced.recording])
    unmeasured = np.isin(answer.plan.recording, [*campaign.missing, *answer.added.recording.tolist()])
    return planned.write_campaign(
        campaign.folder,
        extend_plan(stays, answer.added),
        answer.plan.select(unmeasured),
        campaign.conditions,
        [f"Rule: {sentence(answer.rule)}", _at_most(answer)],
        upper=answer.most_force[unmeasured].tolist(),
        waiting=waiting.select(ConfirmationPlan.among(waiting)),  # others would change the map that these confirm
    )


def _at_most(answer: ConfirmationPlan) -> str:
    """What an impact may reach at most."""
    return f"at most: {answer.bound}, and no more than the limit less the device's error"


_WHERE = (
    "where: the fastest and the slowest place, and those farthest from every state of the map, where a wrong form "
    "shows most: many lie at the edge of the range; a place of your own: a state of role test there, at its speed"
)


def _to_measure(answer: ConfirmationPlan) -> bool:
    """Whether impacts of the plan are to be measured, new ones or all of them."""
    return bool(len(answer.added)) or (len(answer.plan) > 0 and answer.result is None and not answer.refusal)


def _lines(source: str, answer: ConfirmationPlan, to_measure: list[str], again: str, more: str) -> list[str]:
    said: dict[str, Any] = {"doubts": sentences(answer.warnings), "simulated": answer.force_map.simulated}
    old = "No longer planned, as planned for another speed and not measured"
    taken = listing(old, answer.replaced.recording.tolist()) if len(answer.replaced) else []
    result = answer.result
    if result is not None:
        after = to_measure if _to_measure(answer) or result.missing else []
        if result.outcome is Confirmed.CANNOT_TELL and not after:
            near = result.reason.kind is fm.FindingKind.IMPACTS_CANNOT_TELL and result.reason.figure("near")
            after = _remedy(source, answer, again, more) if near else _repeated(source, again, result)
        if result.outcome is Confirmed.PASSES:
            few = f"Speeds, exports and the report count a map as confirmed from {IMPACTS} impacts on"
            enough = len({*answer.plan.state_id.tolist()}) >= IMPACTS
            form = answer.force_map.form
            then = "forcemap report and forcemap export, which say now that the map is confirmed"
            if form != form_of(answer.force_map.conditions):  # as all else that is asked of the campaign is asked
                then = f'state form = "{form.name}" below [map] in campaign.toml; then {then}'
            slow = _slow_missing(answer, more)
            done = after or [*slow, f"{'Else' if slow else 'Next'}: {then}"]
            after = done if enough else [f"{few}: ask again without --impacts"]
        if result.outcome is Confirmed.DOES_NOT_PASS:
            after = _remedy(source, answer, again, more)
        return [
            *verdict_first(f"{result.outcome.replace('_', ' ').upper()}: {sentence(result.reason)}", **said),
            *taken,
            "",
            *_impacts_table(result),
            *(["a bound above the limit: the impact was faster than is released there now"] if _faster(answer) else []),
            *(listing("Not measured yet", result.missing) if result.missing else []),
            "",
            f"Rule: {sentence(answer.rule)}",
            *(_chances(answer) if result.outcome is Confirmed.PASSES else []),
            f"bound: {answer.bound}",
            *after,
        ]
    if answer.refusal:
        refused = verdict_first(sentence(answer.refusal), simulated=answer.force_map.simulated)
        return [*refused, *taken, *_remedy(source, answer, again, more)]
    before = "" if len(answer.added) else ", planned before and not measured yet"
    slow = _slow_missing(answer, more)
    return [
        *verdict_first(f"{len(answer.plan)} impacts to confirm the released speeds, slow to fast{before}", **said),
        *taken,
        *([planned.time_words(answer.plan)] if len(answer.plan) else []),
        "",
        *planned.runs_table(answer.plan, answer.most_force.tolist()),
        _at_most(answer),
        _WHERE,
        "",
        f"Rule: {sentence(answer.rule)}",
        *_chances(answer),
        *[*slow, *["To confirm the map as it is all the same:"] * bool(slow)],
        "Measure nothing else until these are judged: a map fitted to more states has other speeds, which they do not "
        "confirm; so has one of another form or from a faster speed on: decide map.form and map.slowest_mps first",
        *to_measure,
    ]


def _slow_missing(answer: ConfirmationPlan, more: str) -> list[str]:
    """That slow impacts come first, where they are missing."""
    if not any(doubt.kind is fm.FindingKind.SLOW_IMPACTS_MISSING for doubt in answer.warnings):
        return []
    return [
        "Next, before anything is released: slow impacts; they may take speeds away, and the map then has to be "
        "confirmed anew",
        *planned.command_lines(more),
    ]


def _faster(answer: ConfirmationPlan) -> bool:
    """Whether an impact was made faster than is released at its place now."""
    impacts = answer.result.impacts if answer.result else ()
    return any(impact.bound_force > answer.limit for impact in impacts)


def _chances(answer: ConfirmationPlan) -> list[str]:
    """How often these impacts take a sound map for a wrong one, and what they find of a wrong one."""
    if math.isnan(answer.not_passed):
        return ["How often a sound map does not pass is not known: the map has no measured states"]
    wide = f"{1000 * ACROSS:.0f} mm wide"
    found = {
        "is 10 % higher everywhere": answer.higher_detected,
        f"is {100 * RIDGE:.0f} % higher along a ridge {wide} at some distance": answer.ridge_detected,
        f"is {100 * BUMP:.0f} % higher at a bump {wide} at some place": answer.bump_detected,
    }
    others = answer.others
    return [
        f"Of 100 sound maps {100 * answer.not_passed:.0f} do not pass ({100 * answer.above_bound:.0f} for an impact "
        "above the bound). If the force",
        *(f"  {what}, these impacts show it in {100 * share:.0f} of 100 cases" for what, share in found.items()),
        *(f"These are chances of the force alone: {each.quantity.words} may miss its bound, too" for each in others),
    ]


def _remedy(source: str, answer: ConfirmationPlan, again: str, more: str) -> list[str]:
    """What to do where nothing may be released, depending on the reason."""
    if not answer.more_helps:
        return [
            "Next: no further impact changes that; put it right, or ask for another limit, then",
            *planned.command_lines(again),
        ]
    command = planned.command_lines(more) if Path(source).is_dir() else ["  forcemap next, with a campaign folder"]
    return ["Next: measure more states; this tells which:", *command]


def _repeated(source: str, again: str, result: ConfirmationResult) -> list[str]:
    """How an impact that tells nothing for another reason than its force is measured again; why not, after several."""
    open_ones = Counter(impact.state for impact in result.impacts if impact.outcome is Confirmed.CANNOT_TELL)
    if alike := [f"{count} impacts of {state}" for state, count in open_ones.items() if count >= _ALIKE]:
        return [
            f"Next: {' and '.join(alike)} cannot tell, and more are not expected to. Look at the curves (forcemap "
            "inspect FILE): if the device, its amplifier or a filter cuts the top off, or it samples slowly, put that "
            "right and measure anew. If the robot itself stays at its force for a while, show that the device reads "
            "higher as it is set (a weight, a press), state up to which force (device.tried_up_to_N in "
            "campaign.toml), collect and ask again. Else the map stays unconfirmed; a contact point there at a lower "
            "speed, measured by itself, can be shown (docs/contact_points.md)"
        ]
    return [
        "Next: measure it again as a further repeat of its state (its name with the next number, such as -r2), at the "
        "speed of its run: one that passes settles it, if the other has a force within the limit (so does a device "
        "that was seen to read higher, device.tried_up_to_N in campaign.toml, where it is the flanks); then",
        *planned.command_lines(planned.command_line("collect", source, {})),
        *planned.command_lines(again),
    ]


def _impacts_table(result: ConfirmationResult) -> list[str]:
    """A line for every impact, and the reason for every one that does not pass."""
    rows = [
        [
            impact.state,
            *(f"{value:.3f}" for value in (impact.distance, impact.height)),
            fm.floor_speed(round(impact.speed, 9)),
            *("-" if math.isnan(force) else f"{force:.1f}" for force in (impact.force, impact.bound_force)),
            impact.outcome.replace("_", " "),
        ]
        for impact in result.impacts
    ]
    failed = [impact for impact in result.impacts if impact.outcome is not Confirmed.PASSES]
    doubts = [f"{impact.recording}: {sentence(impact.reason)}" for impact in failed]
    header = ["state", "d [m]", "h [m]", "v at contact [m/s]", "force [N]", "bound [N]", "outcome"]
    judged = "Why judges the largest force that a curve supports, the table has the peak corrected for noise"
    lines = [*table(header, rows), *([*listing("Why", doubts), judged] if doubts else [])]
    settled = [f"{impact.recording}: {sentence(impact.reason)}" for impact in result.settled]
    return [*lines, *(listing("Not counted, for another repeat of the state passes", settled) if settled else [])]
