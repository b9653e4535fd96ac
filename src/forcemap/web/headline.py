"""What a campaign permits at a glance, by body area and contact: the share of places, the speeds, the worst place."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import forcemap as fm
from forcemap.answers.answer import Answer, Figure, Said
from forcemap.answers.basis import RestsOn, rests_on
from forcemap.answers.speed_map import StandardAnswer
from forcemap.assessment.assess_campaign import PLACES_APART
from forcemap.assessment.missing import Missing, attempt, present
from forcemap.assessment.place_speeds import fine_speeds
from forcemap.campaigns.recordings_table import Use
from forcemap.comparisons.beside_standard import beside_standard
from forcemap.files import file_sha256
from forcemap.findings import Finding, FindingKind
from forcemap.maps.slower_impacts import slow_impacts_missing
from forcemap.planning.confirm import Confirmed
from forcemap.speeds.basis import doubts_of_fit, unconfirmed
from forcemap.web.campaign_answers import problem_words
from forcemap.web.fitted_campaign import FittedCampaign, fitted_campaign, impacts_of
from forcemap.web.limits import Limits
from forcemap.web.question import Area, Question
from forcemap.words import sentence, sentences

_FORMS = "forcemap evaluate {} --forms"

_IN_MEMORY = 64
"""Cases that stay in memory; a choice: a few body areas of every campaign of a folder."""


class WorstPlace(Answer):
    """The place that permits least: its speed to program, null where there is none."""

    distance_m: float
    height_m: float
    speed_mps: Figure
    reason: Said


class Case(Answer):
    """What one body area and contact is permitted: at how many places of the measured range, and at which speeds.

    Speeds are to program, the lowest and the highest those of the whole measured range; the standard's is what its
    contact model allows everywhere, confirmed by no measurement, and `standard` holds the map's speeds at contact
    against it.
    `state` is `permitted`, `partly`, `nowhere`, `not_permitted` or `contradicted`.
    """

    area: str
    contact: str
    state: str
    reason: Said
    places: int
    permitted: int
    share: Figure
    lowest_speed_mps: Figure
    highest_speed_mps: Figure
    standard_speed_mps: Figure
    standard: StandardAnswer | None
    worst: WorstPlace | None
    confirmed_by: int
    rests_on: RestsOn | None


class Headline(Answer):
    """What a campaign permits, for the body area asked for and those of its contact points; or why nothing is known.

    Without cases and without a problem nobody chose a body area. Contact points are counted as listed, not judged.
    """

    cases: list[Case]
    problem: str
    places_apart_m: float
    contact_points: int
    contact_points_problem: str


class NextStep(Answer):
    """What to measure next for a body area and contact: a plan, no permission.

    `what` is what to do and `why` are its reasons, both empty where `sentence` stands whole. Of the warnings
    `further_warnings` are those that no doubt about the map says.
    """

    sentence: str
    states: list[dict[str, float]]
    command: str
    warnings: tuple[str, ...] = ()
    what: str = ""
    why: tuple[str, ...] = ()
    further_warnings: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        what: str,
        found: fm.NextMeasurements,
        why: Iterable[Finding],
        path: Path,
        states: list[dict[str, float]],
        command: str,
    ) -> NextStep:
        """What to do, of what was found to measure next, and why."""
        known = {doubt.kind for doubt in doubts_of_fit(fitted_campaign(path).force_map)}
        further = sentences(doubt for doubt in found.warnings if doubt.kind not in known)
        reasons = tuple(map(sentence, (*why, found.progress, *found.within)))
        return cls(
            sentence="; ".join([what, *reasons]),
            states=states,
            command=command,
            warnings=tuple(sentences(found.warnings)),
            what=what,
            why=reasons,
            further_warnings=tuple(further),
        )


def headline(name: str, path: Path, question: Area, limits: Limits, *, points: bool = True) -> Headline:
    """What a campaign permits, with the body areas of its contact points or without; one without a map says why."""
    listed: dict[str, Any] = {"contact_points": limits.points, "contact_points_problem": limits.points_problem}
    try:
        fitted_campaign(path)  # that there is no map is said without a body area, too
        areas = dict.fromkeys(filter(None, [question.area, *(limits.areas if points else ())]))
        cases = [_case(name, path, limits.of(area), contact, limits) for area in areas for contact in fm.Contact]
        return Headline(cases=cases, problem="", places_apart_m=PLACES_APART, **listed)
    except fm.ForcemapError as error:
        return Headline(cases=[], problem=problem_words(error), places_apart_m=PLACES_APART, **listed)


def next_step(name: str, path: Path, question: Question, limits: Limits) -> NextStep:
    """What to do next: missing runs, what forbids every speed, states that confirm more places, the confirmation.

    Raises
    ------
    RequestError
        There are no impacts yet.
    """
    limit, contact = limits.of(question.area), question.contact
    asked = f"{name} --area {limit.name} --contact {contact}"
    if not limit.permitted:
        return NextStep(sentence="nothing: the standard permits no contact, at no speed", states=[], command="")
    campaign = attempt(lambda: fm.read_campaign(path))
    if not isinstance(campaign, Missing) and campaign.missing:
        runs = f"the {len(campaign.missing)} planned runs that are missing, the next is {campaign.missing[0]}"
        unused = sum(entry.use is not Use.USED for entry in campaign.entries)
        runs += f" ({unused} recordings are not used: below is why)" if unused else ""
        return NextStep(sentence=f"measure {runs}", states=[], command=f"forcemap collect {name}")
    if refusal := impacts_of(path).no_speed:  # more measurements would not help
        return NextStep(sentence=sentence(refusal), states=[], command="")
    case = _case(name, path, limit, contact, limits)
    if case.state == "contradicted":
        return NextStep(sentence=f"find out why: {case.reason}", states=[], command=f"forcemap confirm {asked}")
    if case.state == "permitted" and not slow_impacts_missing(fitted_campaign(path).force_map):
        if case.confirmed_by:
            said = f"release: {case.confirmed_by} impacts at released speeds confirm the map"
            return NextStep(sentence=said, states=[], command=f"forcemap report {name} --area {limit.name}")
        said = "confirm the map by impacts at the speeds to be released"
        if ask := _other_form(path):
            return NextStep(sentence=f"{ask}; else {said}", states=[], command=_FORMS.format(name))
        return NextStep(sentence=said, states=[], command=f"forcemap confirm {asked}")
    found = _next(fitted_campaign(path), limit, contact)
    if found.plan is None:
        return _stop(name, path, limit, contact, case, found)
    plan = found.plan
    columns = [plan.distance, plan.height, plan.speed, plan.expected_force, found.upper_force]
    rows = np.unique(np.column_stack(columns), axis=0).tolist()
    names = ("distance_m", "height_m", "speed_mps", "expected_force_N", "upper_force_N")
    states = [dict(zip(names, row, strict=True)) for row in rows]
    before = "first confirm the speeds that there are (forcemap confirm)"
    if case.confirmed_by:
        confirmed = f"{case.confirmed_by} impacts confirm the map"
        before = f"nothing for these speeds: {confirmed}, and with more states it is another one, to be confirmed again"
    ask, slow = _other_form(path), any(reason.kind is FindingKind.SLOW_PLANNED for reason in found.reasons)
    first = f"{before}; for speeds at more places " if case.permitted and not slow else ""
    further = f"{f'{ask}; else ' if ask else first}measure {len(states)} {'slow' if slow else 'further'} states"
    why = found.reasons if slow else ()
    command = _FORMS.format(name) if ask else f"forcemap next {asked}"
    return NextStep.of(further, found, why, path, states, command)


def _stop(
    name: str, path: Path, limit: fm.ForceLimit, contact: fm.Contact, case: Case, found: fm.NextMeasurements
) -> NextStep:
    """The next step where no more is to be measured for the map: confirm its speeds, or release them."""
    what, command = "measure nothing more for the map", ""
    if ask := _other_form(path):
        what, command = f"{ask}; {what}", _FORMS.format(name)
    elif case.permitted and case.confirmed_by:
        what = f"release: {case.confirmed_by} impacts at released speeds confirm the map; {what}"
        command = f"forcemap report {name} --area {limit.name}"
    elif case.permitted:
        what = f"confirm the map by impacts at the speeds to be released; {what}"
        command = f"forcemap confirm {name} --area {limit.name} --contact {contact}"
    return NextStep.of(what, found, found.reasons, path, [], command)


def _other_form(path: Path) -> str:
    """What to ask first where states doubt the form of the map: a confirmation would not tell. Else empty."""
    force_map = fitted_campaign(path).force_map
    doubts = {doubt.kind for doubt in doubts_of_fit(force_map)}
    doubted = doubts & {FindingKind.FALLS_WITH_SPEED, FindingKind.FORM_DOUBTED}
    shown = f"{force_map.form.name}, which this page shows"
    return f"ask whether another form fits these states better than {shown}" if doubted else ""


def _case(name: str, path: Path, limit: fm.ForceLimit, contact: fm.Contact, limits: Limits) -> Case:
    files = [path / file for file in ("plan.csv", "recordings.csv")]
    hashes = tuple(file_sha256(file) if file.exists() else "" for file in files)
    return _of(_Asked(name, path, hashes, fitted_campaign(path), limit, contact, limits.statements))


@dataclass(frozen=True)
class _Asked:
    """All that a case rests on; the files by their hashes."""

    name: str
    path: Path
    hashes: tuple[str, ...]
    fitted: FittedCampaign
    limit: fm.ForceLimit
    contact: fm.Contact
    notes: tuple[str, ...]


@lru_cache(maxsize=_IN_MEMORY)
def _of(asked: _Asked) -> Case:
    limit, contact, force_map = asked.limit, asked.contact, asked.fitted.force_map
    figures: dict[str, Any] = {"area": limit.name, "contact": contact, "places": 0, "permitted": 0, "share": None}
    figures |= dict.fromkeys(
        ("lowest_speed_mps", "highest_speed_mps", "standard_speed_mps", "standard", "worst", "rests_on")
    )
    figures["confirmed_by"] = 0
    if not limit.permitted:
        reason = f"the standard permits no contact with {limit.name}, at no speed"
        return Case(state="not_permitted", reason=reason, **figures)
    bound = _bound(force_map)
    allowance, places = fm.Allowance(), fm.measured_grid(force_map, PLACES_APART)
    grid = fm.speed_map(force_map, *places, limit=limit, bound=bound, contact=contact, allowance=allowance)
    fine = fine_speeds(limit, contact, force_map, bound, allowance)
    speeds = grid.speeds
    known = speeds.to_program_outcome != fm.SpeedOutcome.OUTSIDE
    permitted = ~np.isnan(speeds.speed_to_program)
    if standard := beside_standard(force_map, grid):
        figures |= {"standard_speed_mps": standard.speed, "standard": StandardAnswer.from_result(standard)}
    figures |= {"places": int(known.sum()), "rests_on": RestsOn(**rests_on(force_map, speeds.basis, asked.notes))}
    confirmed = _confirmed(asked, bound)
    if confirmed is not None and confirmed.outcome is Confirmed.DOES_NOT_PASS:
        return Case(state="contradicted", reason=confirmed.reason, **figures)
    passes = confirmed is not None and confirmed.outcome is Confirmed.PASSES
    figures["confirmed_by"] = len(confirmed.impacts) if confirmed is not None and passes else 0
    between = bool((fine.speeds.to_program_outcome == fm.SpeedOutcome.UNCONFIRMED).any())
    everywhere = bool(permitted.sum() == known.sum()) and not between
    worst = _worst(fine if between or everywhere else grid)
    figures |= {"permitted": int(permitted.sum()), "worst": worst}
    figures["share"] = permitted.sum() / known.sum() if known.any() else None
    if not permitted.any():
        nothing_to_confirm = unconfirmed(speeds.basis.warnings)
        said = tuple(each for each in speeds.basis.warnings if each not in nothing_to_confirm)
        basis = replace(speeds.basis, warnings=said)
        figures["rests_on"] = RestsOn(**rests_on(force_map, basis, asked.notes))
        return Case(state="nowhere", reason=worst.reason if worst else "nothing was measured at any place", **figures)
    both = np.append(speeds.speed_to_program, fine.speeds.speed_to_program)
    figures |= {"lowest_speed_mps": np.nanmin(both), "highest_speed_mps": np.nanmax(both)}
    return Case(
        state="permitted" if everywhere else "partly",
        reason=worst.reason if worst and not everywhere else "",
        **figures,
    )


def _bound(force_map: fm.ForceMap) -> fm.ToleranceBound:
    bound = fm.ToleranceBound(device_error=force_map.conditions.device.error_or_default)
    bound.require(force_map)
    return bound


def _confirmed(asked: _Asked, bound: fm.ToleranceBound) -> Any:
    """The result of impacts at released speeds; None if none are planned."""
    found = attempt(lambda: asked.fitted.confirmed(asked.limit, asked.contact, bound))
    return None if isinstance(found, Missing) else found


def _worst(grid: fm.SpeedMap) -> WorstPlace | None:
    """Of the places without a speed the one whose bound needs the slowest, else the slowest place."""
    speeds = grid.speeds
    known = speeds.to_program_outcome != fm.SpeedOutcome.OUTSIDE
    refused = known & np.isnan(speeds.speed_to_program)
    if not known.any():
        return None
    hint = np.where(np.isnan(speeds.extrapolated_speed), np.where(np.isnan(speeds.speed), 0.0, speeds.speed), 0.0)
    hint = np.fmax(hint, np.nan_to_num(speeds.extrapolated_speed))
    order = np.where(refused, hint, np.inf) if refused.any() else np.where(known, speeds.speed_to_program, np.inf)
    i, j = np.unravel_index(np.argmin(order), order.shape)
    return WorstPlace(
        distance_m=float(grid.distance[i]),
        height_m=float(grid.height[j]),
        speed_mps=speeds.speed_to_program[i, j],
        reason=speeds.to_program_reason[i, j],
    )


@lru_cache(maxsize=_IN_MEMORY)
def _next(fitted: FittedCampaign, limit: fm.ForceLimit, contact: fm.Contact) -> fm.NextMeasurements:
    bound = fm.ToleranceBound(device_error=fitted.force_map.conditions.device.error_or_default)
    found = attempt(lambda: fm.next_measurements(fitted.dataset, limit, contact=contact, bound=bound))
    return present(found)
