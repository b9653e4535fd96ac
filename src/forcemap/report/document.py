"""The report of a campaign as one HTML page that needs nothing beside it."""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Iterable, Sequence
from functools import cache
from itertools import pairwise
from shlex import join
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from forcemap.assessment.assess_campaign import CampaignAssessment
from forcemap.assessment.folder import inputs_sha256
from forcemap.assessment.missing import Missing
from forcemap.assessment.point_results import PointOutcome
from forcemap.assessment.state_results import StateResult
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.not_stated import Matters
from forcemap.campaigns.recordings_table import Use
from forcemap.direction import ON_AXIS, WIDEST_ANGLE
from forcemap.files import stated_date
from forcemap.findings import Finding, FindingKind
from forcemap.limits.device_spring import DeviceSuitability, device_suitability
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.maps.bounds import ToleranceBound
from forcemap.report.curves import Curve, force_curves, highest_force
from forcemap.report.permission import (
    cell_words,
    device_words,
    headline,
    nowhere,
    permission,
    permissions,
    point_counts,
    point_permissions,
    pressure_words,
)
from forcemap.report.pictures import Pictures
from forcemap.report.seal import MARK, MadeFor, further_inputs, quoted, seal, seal_tag
from forcemap.report.sheets import sheets
from forcemap.speeds.safe_speed import floor_speed
from forcemap.verdicts.verdict import Interpretation, VerdictOutcome
from forcemap.words import sentence, sentences, short_reason

_AXES = "d: distance from the z-axis of the base; h: height above the base, not the floor."
_COLUMNS_AT_ONCE = 9  # most columns of a speed table, so that it fits on a page

# Control characters, surrogates, noncharacters; and marks that turn the direction of text around.
_UNFIT = re.compile(
    "[\x00-\x08\x0b-\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff"
    + "".join(chr(plane + low) for plane in range(0x10000, 0x110000, 0x10000) for low in (0xFFFE, 0xFFFF))
    + "]"
)


def report_html(
    assessment: CampaignAssessment, *, date: str | None = None, register_head: str = "", file: str = ""
) -> str:
    """The report of an assessment as one HTML page: no script, nothing fetched; the same page for the same inputs.

    Parameters
    ----------
    assessment : CampaignAssessment
        As `assess_campaign` gives it.
    date : str, optional
        Date of the report, YYYY-MM-DD; today if not given.
    register_head : str
        Newest entry of the team's register, to be noted in print; empty without one.
    file : str
        Name of the page's file in the command that verifies it; report.html in the campaign's folder if not given.

    Raises
    ------
    InputError
        The date is no valid one.
    """
    page = environment().get_template("report.html")
    return seal(
        page.render(
            a=assessment,
            c=assessment.conditions,
            date=(datetime.date.today() if date is None else stated_date("date", date)).isoformat(),
            seal_tag=Markup(seal_tag()),
            limits_made_for=MadeFor.of(assessment).text,
            inputs_sha256=inputs_sha256(assessment.inputs),
            pictures=Pictures(assessment),
            findings=sentences(assessment.findings),
            headlines=(headlines := [headline(results) for results in assessment.speeds]),
            nowhere=nowhere(headlines),
            apart_cm=_apart_cm(assessment),
            permissions=permissions(assessment),
            permission_of=[permission(results, assessment) for results in assessment.speeds],
            point_permissions=point_permissions(assessment),
            cell_words=cell_words(assessment),
            sheets=sheets(assessment),
            rests_on=_rests_on(assessment),
            straight=_depended_on(assessment, FindingKind.ALONG_ONLY),
            around=_depended_on(assessment, FindingKind.AROUND_THE_BASE),
            transient=_depended_on(assessment, FindingKind.TRANSIENT_FREE),
            slower=_depended_on(assessment, FindingKind.SLOWER_UNMEASURED),
            overshoot=_depended_on(assessment, FindingKind.OVERSHOOT),
            axes=_AXES,
            device_words=device_words(assessment.conditions),
            spring=lambda limit: _spring(limit, assessment.conditions).statement,
            further_inputs=further_inputs(assessment.inputs),
            curves=_curves(assessment),
            places=_places(assessment),
            calibration=_calibration(assessment),
            verify=join(
                ["forcemap", "report", "--verify", file or f"{assessment.name}/report.html", assessment.name],
            ),
            register_head=register_head,
        )
    )


def _apart_cm(assessment: CampaignAssessment) -> float:
    """How far the places of the tables of speeds are apart [cm]; 0 without a table or with a single place."""
    return 100 * max((max(each.apart) for each in assessment.speeds), default=0.0)


def _depended_on(assessment: CampaignAssessment, kind: FindingKind) -> Finding | None:
    """What the first speeds that depend on a thing of this kind say of it; None if none do."""
    for results in assessment.speeds:
        if not isinstance(results.speeds, Missing):
            for finding in results.speeds.speeds.basis.statements:
                if finding.kind is kind:
                    return finding
    return None


@cache
def environment() -> Environment:
    """The templates of reports, with what they use."""
    environment = Environment(
        loader=PackageLoader("forcemap.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_fit,
    )
    filters = (
        _mps,
        _number,
        _stated,
        quoted,
        _words,
        _outcome_counts,
        _blocks,
        _plural,
        sentence,
        pressure_words,
        point_counts,
        short_reason,
    )
    environment.filters |= {function.__name__.strip("_"): function for function in filters}
    environment.globals |= {
        enum.__name__: enum
        for enum in (Contact, FindingKind, Interpretation, Matters, PointOutcome, Use, VerdictOutcome)
    }
    environment.globals |= {"mark": MARK, "on_axis": ON_AXIS, "widest": WIDEST_ANGLE}
    environment.tests |= {"gone": lambda part: isinstance(part, Missing), "nan": _is_nan}
    return environment


def _fit(value: Any) -> Any:
    """A text without characters that cannot stand in a page; a finding in its words."""
    if isinstance(value, Finding):
        value = sentence(value)
    if not isinstance(value, str) or not _UNFIT.search(value):
        return value
    return type(value)(_UNFIT.sub("�", str(value)))


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)


def _mps(value: float) -> str:
    return "–" if math.isnan(value) else floor_speed(value)


def _number(value: float, form: str = ".1f") -> str:
    return "–" if math.isnan(value) else format(value, form)


def _stated(value: Any, unit: str = "") -> Any:
    """A condition with its unit; "missing" if it is not stated."""
    if value == "" or _is_nan(value):
        return Markup('<span class="missing">missing</span>')
    return f"{value:g} {unit}".strip() if isinstance(value, float) else f"{value} {unit}".strip()


def _words(value: Any) -> str:
    return str(value).replace("_", " ")


def _plural(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _outcome_counts(states: Iterable[StateResult], limit: int) -> dict[str, int]:
    """Number of states of every outcome under a limit, the gravest first; those that were not judged last."""
    outcomes = ["not judged" if (j := state.judgements[limit]) is None else _words(j.outcome) for state in states]
    return {name: outcomes.count(name) for name in ("exceeded", "cannot tell", "within", "not judged")}


def _blocks(columns: Sequence[float]) -> list[range]:
    """Columns of a table that fit on a page together."""
    count = math.ceil(len(columns) / _COLUMNS_AT_ONCE)
    edges = [len(columns) * i // count for i in range(count + 1)]
    return [range(first, last) for first, last in pairwise(edges)]


def _curves(assessment: CampaignAssessment) -> dict[str, Markup]:
    """The curves of every state, by its name."""
    if isinstance(assessment.states, Missing):
        return {}
    limit = next((limit for limit in assessment.limits if limit.permitted), None)
    curves = {
        state.name: [Curve(r.entry.name, r.time, r.force, r.entry.use is Use.USED) for r in state.recordings]
        for state in assessment.states
    }
    top = highest_force([curve for of_state in curves.values() for curve in of_state], limit)
    return {name: force_curves(of_state, limit, top) for name, of_state in curves.items()}


def _rests_on(assessment: CampaignAssessment) -> list[str]:
    """What the verdict rests on, in three lines: what was measured, the map with its bound, the limits."""
    a, c = assessment, assessment.conditions
    counted = "no impact can be used"
    if not isinstance(a.dataset, Missing):
        counted = f"{len(a.dataset.speed)} impacts in {len(a.dataset.states)} states"
        counted += f", {int(a.dataset.censored.sum())} of them saturated" * bool(a.dataset.censored.any())
    measured = (
        f"Measured: {counted}, with {device_words(c)}, {c.date or 'date not stated'}, by {c.operator or 'not stated'}"
    )
    springs = [_spring(limit, c).statement for limit in a.limits if limit.permitted]
    stiffer = [each for each in springs if each and each.kind is FindingKind.SPRING_STIFFER]
    softer = [f"{each.figure('area_N_per_m') / 1000:g} N/mm of {each.figure('area')}" for each in stiffer]
    if len(softer) > 1:
        measured += f"; its spring is stiffer than the {', '.join(softer)}: forces read higher on it as a rule"
    else:
        measured = "; ".join([measured, *sentences(stiffer)])
    source = a.force_map.reason if isinstance(a.force_map, Missing) else f"{a.force_map.form.name} {a.force_map.source}"
    bound = f"no bound: {a.bound.reason}" if isinstance(a.bound, Missing) else str(a.bound)
    if isinstance(a.bound, ToleranceBound):
        tested = None if isinstance(a.force_map, Missing) else a.force_map.form_test
        missed = ", but not at each place (section 9)"
        bound += missed if tested and tested.misses else ", at each place if its form is right"
    editions = dict.fromkeys(f"{limit.edition}, table version {limit.version}, {limit.source}" for limit in a.limits)
    return [measured, f"Map: {source}; {bound}", f"Limits: {'; '.join(editions)}"]


def _spring(limit: ForceLimit, conditions: Conditions) -> DeviceSuitability:
    """How the springs of the device and of a body area compare."""
    return device_suitability(limit.name, limit.stiffness, conditions.device.stiffness)


def _places(assessment: CampaignAssessment) -> list[tuple[float, float, list[float]]]:
    """Distance, height and speeds of every contact point [m, m, m/s]."""
    if isinstance(assessment.states, Missing):
        return []
    places: dict[tuple[float, float], list[float]] = {}
    for state in assessment.states:
        places.setdefault((round(state.distance, 3), round(state.height, 3)), []).append(state.speed)
    return [(d, h, sorted(speeds)) for (d, h), speeds in places.items()]


def _calibration(assessment: CampaignAssessment) -> str:
    """Whether the device's calibration held on the day of the measurements; empty if nothing tells."""
    device, date = assessment.conditions.device, assessment.conditions.date
    if not date or not device.calibration_stated:
        return ""
    return f"{'EXPIRED' if device.expired(date) else 'valid'} on {date}, the date of the measurements"
