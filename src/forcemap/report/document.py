"""The report of a campaign as one HTML page that needs nothing beside it."""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Iterable, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from forcemap.assessment.assess_campaign import CampaignAssessment
from forcemap.assessment.folder import inputs_sha256
from forcemap.assessment.missing import Missing
from forcemap.assessment.place_speeds import PlaceSpeeds
from forcemap.assessment.state_results import StateResult
from forcemap.campaigns.recordings_table import Use
from forcemap.files import stated_date
from forcemap.findings import Finding
from forcemap.limits.force_limits import Contact
from forcemap.report.curves import highest_force, state_curve
from forcemap.report.pictures import Pictures
from forcemap.report.seal import MARK, made_for, quoted, seal, seal_tag
from forcemap.speeds.safe_speed import floor_speed
from forcemap.verdicts.verdict import Interpretation, VerdictOutcome
from forcemap.words import sentence, sentences

_COLUMNS_AT_ONCE = 9  # most columns of a speed table, so that it fits on a page

_NO_CONTACT = "the standard permits no contact; keep the robot from reaching it"

# Control characters, surrogates, noncharacters; and marks that turn the direction of text around.
_UNFIT = re.compile(
    "[\x00-\x08\x0b-\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff"
    + "".join(chr(plane + low) for plane in range(0x10000, 0x110000, 0x10000) for low in (0xFFFE, 0xFFFF))
    + "]"
)


def report_html(assessment: CampaignAssessment, *, date: str | None = None) -> str:
    """The report of an assessment as one HTML page: no script, nothing fetched; the same page for the same inputs.

    Parameters
    ----------
    assessment : CampaignAssessment
        As `assess_campaign` gives it.
    date : str, optional
        Date of the report, YYYY-MM-DD; today if not given.

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
            limits_made_for=made_for(assessment),
            inputs_sha256=inputs_sha256(assessment.inputs),
            pictures=Pictures(assessment),
            findings=sentences(assessment.findings),
            headlines=[headline(results) for results in assessment.speeds],
            curves=_curves(assessment),
            places=_places(assessment),
            calibration=_calibration(assessment),
        )
    )


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
    filters = (_mps, _number, _stated, quoted, _words, _outcome_counts, _blocks, _plural)
    environment.filters |= {function.__name__.strip("_"): function for function in filters}
    environment.globals |= {enum.__name__: enum for enum in (Contact, Interpretation, VerdictOutcome, Use)}
    environment.globals["mark"] = MARK
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


def headline(results: PlaceSpeeds) -> dict[str, Any]:
    """What is confirmed for one body area and kind of contact, in a word and a line."""
    shown = {"results": results, "word": "NOT CONFIRMED", "kind": "refused", "places": 0}
    if not results.limit.permitted:
        return shown | {"word": "NOT PERMITTED", "speeds": _NO_CONTACT}
    if isinstance(results.speeds, Missing):
        return shown | {"speeds": results.speeds.reason}
    shown["places"] = inside = sum(count for name, count in results.speeds.counts.items() if name != "outside")
    if not results.confirmed:
        nowhere = "no place lies inside the measured range"
        return shown | {"speeds": results.open_places[0].reason if results.open_places else nowhere}
    program = _between(results.slowest_to_program, results.fastest_to_program)
    speeds = f"{program} to program ({_between(results.slowest, results.fastest)} at contact)"
    speeds += ", place by place" if results.fastest > results.slowest else ""
    if results.confirmed == inside:
        return shown | {"word": "CONFIRMED at all places", "kind": "confirmed", "speeds": speeds}
    return shown | {"word": f"CONFIRMED at {results.confirmed} of {inside} places", "kind": "partly", "speeds": speeds}


def _between(low: float, high: float) -> str:
    return f"{floor_speed(low)}{f' to {floor_speed(high)}' if high > low else ''}\u00a0m/s"


def _curves(assessment: CampaignAssessment) -> dict[str, Markup]:
    """The curves of every state, by its name."""
    if isinstance(assessment.states, Missing):
        return {}
    limit = next((limit for limit in assessment.limits if limit.permitted), None)
    top = highest_force([recording for state in assessment.states for recording in state.recordings], limit)
    return {state.name: state_curve(state.recordings, limit, top) for state in assessment.states}


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
