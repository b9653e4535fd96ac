"""What a report permits, in sentences: each names place, limit, edition, device, and who is to sign."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from forcemap.assessment.assess_campaign import AssessedPoints, CampaignAssessment
from forcemap.assessment.missing import Missing
from forcemap.assessment.place_speeds import PlaceSpeeds
from forcemap.assessment.point_results import PointOutcome, PointResult
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.protocol import Protocol
from forcemap.direction import WIDEST_ANGLE
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.speeds.safe_speed import SpeedOutcome, floor_speed
from forcemap.words import sentence

_NO_CONTACT = "the standard permits no contact; keep the robot from reaching it"
BY_MAP_ALONE = "permitted by the map, not confirmed by measurement yet (forcemap confirm)"
_LISTED = 6  # names in a sentence; the others are counted


def headline(results: PlaceSpeeds) -> dict[str, Any]:
    """What is permitted for one body area and kind of contact, in a word and a line."""
    shown = {"results": results, "word": "NO PERMISSION", "kind": "refused", "places": 0, "off_axis": ""}
    if not results.limit.permitted:
        return shown | {"word": "NOT PERMITTED", "speeds": _NO_CONTACT}
    if isinstance(results.speeds, Missing):
        return shown | {"speeds": results.speeds.reason}
    shown["places"] = inside = sum(count for name, count in results.speeds.counts.items() if name != "outside")
    if results.not_released:
        return shown | {"speeds": sentence(results.not_released)}
    if not results.confirmed:
        nowhere = "no place lies inside the measured range"
        return shown | {"speeds": results.open_places[0].reason if results.open_places else nowhere}
    program = _between(results.slowest_to_program, results.fastest_to_program)
    at_places = _between(*results.of_table)
    speeds = f"{program} ({at_places})" if at_places != program else program
    off = results.to_program_off_axis
    other = f"{_between(off[0], off[-1])} at {len(off)} of them" if len(off) else "no speed"
    shown["off_axis"] = f"up to {WIDEST_ANGLE:g} degrees off the direction: {other}"
    word = f"PERMITTED BY THE {'CONFIRMED ' * bool(results.confirmed_by)}MAP"
    if results.confirmed == inside and results.open_box is None:
        return shown | {"word": f"{word} at all places", "kind": "confirmed", "speeds": speeds}
    word += f" at {results.confirmed} of {inside} places"
    word += ", not everywhere between them" if results.confirmed == inside else ""
    return shown | {"word": word, "kind": "partly", "speeds": speeds}


def nowhere(headlines: Sequence[dict[str, Any]]) -> list[str]:
    """Where headlines give no speed, in metres; those alike together, those that give none at all by their word."""
    groups: dict[str, list[str]] = {}
    for line in headlines:
        results = line["results"]
        if line["kind"] in ("partly", "confirmed") and results.open_box:
            (near, far), (low, high) = (_outwards(*ends) for ends in results.open_box)
            places = f"{results.unconfirmed} of {line['places']} places and around them"
            where = places if results.unconfirmed else f"between the {line['places']} places"
            box = f", all in d {near} to {far} m, h {low} to {high} m (others in there have a speed)"
            where += _begins(results) or box
            groups.setdefault(where, []).append(f"{results.limit.name.replace('_', ' ')}, {results.contact}")
    refused = ["where the answer above is NO PERMISSION or NOT PERMITTED"]
    parts = refused * any(line["kind"] == "refused" for line in headlines)
    return parts + [f"{' and '.join(names)}: {where}" for where, names in groups.items()]


def _begins(results: PlaceSpeeds) -> str:
    """From which distance on each height has speeds, where that says more than a box, and they go on to the far end."""
    if isinstance(results.speeds, Missing) or results.open_box is None:
        return ""
    (near, far), (low, high) = results.open_box
    d, h, found = results.speeds.distance, results.speeds.height, results.speeds.speeds
    given, outside = ~np.isnan(found.speed_to_program), found.to_program_outcome == SpeedOutcome.OUTSIDE
    within = np.outer((d >= near) & (d <= far), (h >= low) & (h <= high))
    first = np.where(given.any(axis=0), given.argmax(axis=0), d.size)
    on = np.arange(d.size)[:, None] >= first
    if 2 * np.sum(given & within) < np.sum(given) or not (given | outside)[on].all():
        return ""
    parts = [f"{d[i]:.2f} m (h {at:.2f} m)" for i, at in zip(first.tolist(), h.tolist(), strict=True) if i < d.size]
    none = ", at other heights none" if (first == d.size).any() else ""
    return f"; speeds from d {', '.join(reversed(parts))} on{none}"


def _outwards(low: float, high: float) -> tuple[str, str]:
    """Ends of a range [m] to the millimetre, the range no smaller for that."""
    return f"{math.floor(1000 * low + _ROUNDING) / 1000:.3f}", f"{math.ceil(1000 * high - _ROUNDING) / 1000:.3f}"


_ROUNDING = 1e-6  # of a figure in millimetres


def permission(results: PlaceSpeeds, assessment: CampaignAssessment) -> str:
    """The sentence that permits the speeds of a headline; empty where it permits none."""
    open_ones = results.confirmation.settled if results.confirmation and results.confirmed_by else ()
    names = ", ".join(impact.recording for impact in open_ones)
    said = _at_site([results], assessment, named=True)
    return " ".join([*said, *[f"Not counted, as they alone cannot tell while a repeat passes: {names}."] * bool(names)])


def permissions(assessment: CampaignAssessment) -> list[str]:
    """The same of all headlines, one for all that rest on the same."""
    return _at_site(assessment.speeds, assessment)


def _at_site(found: Sequence[PlaceSpeeds], assessment: CampaignAssessment, *, named: bool = False) -> list[str]:
    groups: dict[tuple[tuple[str, ...], str], list[str]] = {}
    for results in found:
        if headline(results)["kind"] != "refused":
            limit = results.limit
            within = f"{_contact(limit, results.contact)}, within the limit of {limit.force(results.contact):g} N"
            groups.setdefault((results.confirmed_by, _edition(limit)), []).append(within)
    site = assessment.conditions.contact_site or "not stated"
    return [
        f"At contact site {site}: {'; '.join(within)}{', all' if len(within) > 1 else ''} of {edition}: "
        f"{_of_map(confirmed_by, named=named)}; "
        f"measured with {device_words(assessment.conditions)}; to be signed by {signer(assessment.protocol)}."
        for (confirmed_by, edition), within in groups.items()
    ]


def pressure_words(result: PointResult) -> str:
    """Whether the permission of a point holds for the pressure, and up to which."""
    if not result.pressed:
        return "pressure not assessed"
    limits = {each.pressure.limit for each in result.impacts if each.pressure} if result.point.by_measurements else ()
    allowed = f" of {min(limits):g} N/cm² by the film at this point" if limits else " by the map of the pressure"
    return f"pressure within its limit{allowed}"


def point_permission(result: PointResult, conditions: Conditions, protocol: Protocol) -> str:
    """The sentence that permits contact at a point; empty where it is not permitted."""
    if result.outcome is PointOutcome.NOT_PERMITTED:
        return ""
    point = result.point
    return (
        f"Contact point {point.name}, {_limit(point.limit, point.contact)}: at most {floor_speed(result.speed)} m/s to "
        f"program{_if_reason(result)}, {_state(result)}; measured with {device_words(conditions)}; "
        f"{pressure_words(result)}; to be signed by {signer(protocol)}."
    )


def point_permissions(assessment: CampaignAssessment) -> list[str]:
    """The sentences that permit contact at points, one for all of a limit that rest on the same."""
    points = () if isinstance(assessment.points, Missing) else assessment.points
    groups: dict[tuple[ForceLimit, Contact, tuple[str, ...], str], list[str]] = {}
    for result in points:
        if result.outcome is not PointOutcome.NOT_PERMITTED:
            point = result.point
            alone = result.confirmed_by if point.by_measurements else ()
            confirmed_by = ("",) if alone else result.confirmed_by
            programmed = "" if math.isnan(point.programmed) else f", now {point.programmed:g}"
            named = f"{point.name} (program at most {floor_speed(result.speed)} m/s{_off(result)}{programmed}"
            named += f"{_counted(alone)}{_if_reason(result)})"
            groups.setdefault((point.limit, point.contact, confirmed_by, pressure_words(result)), []).append(named)
    return [
        f"Contact {'points' if len(named) > 1 else 'point'} {', '.join(named)}, {_limit(limit, contact)}: "
        f"{_state_of_all(confirmed_by)}; measured with {device_words(assessment.conditions)}; {pressure}; "
        f"to be signed by {signer(assessment.protocol)}."
        for (limit, contact, confirmed_by, pressure), named in groups.items()
    ]


def cell_words(assessment: CampaignAssessment | AssessedPoints) -> str:
    """Whether the cell may run as programmed, as far as its contact points tell; empty without any."""
    points = () if isinstance(assessment.points, Missing) else assessment.points
    if any(result.lacks for result in points):
        return "The cell may not run as programmed."
    if not points:
        return ""
    if unstated := [result.point.name for result in points if math.isnan(result.point.programmed)]:
        return f"Whether the cell may run does not follow: no programmed speed is stated for {', '.join(unstated)}."
    if assessment.simulated:
        return "Whether the cell may run as programmed does not follow: the impacts are simulated."
    said = "At these contact points the cell may run as programmed"
    if straight := [result.point.name for result in points if result.straight_only]:
        said += f", at {', '.join(straight)} only straight along the direction"
    if any(result.outcome is PointOutcome.BY_MAP for result in points):
        said += " once impacts confirm the map (forcemap confirm)"
    return f"{said}{', if nothing under Read this first speaks against it' if assessment.findings else ''}."


def _off(result: PointResult) -> str:
    """The speed of a point up to 5 degrees off the direction; empty if it is the same."""
    if result.off_axis is None:
        return ""
    off = "no speed" if math.isnan(result.off_axis) else f"{floor_speed(result.off_axis)} m/s"
    return f", {off} up to {WIDEST_ANGLE:g} degrees off"


def _counted(impacts: tuple[str, ...]) -> str:
    return f", {len(impacts)} impacts" if impacts else ""


def _state_of_all(confirmed_by: tuple[str, ...]) -> str:
    own = confirmed_by == ("",)
    return "confirmed by the impacts at each of them, named on its sheet" if own else _of_map(confirmed_by)


def _if_reason(result: PointResult) -> str:
    return ", IF the risk assessment says why" * result.if_reason


def point_counts(results: Iterable[PointResult]) -> Markup:
    """How many contact points have which verdict, in words; the permitted ones first."""
    found = list(results)
    counts = Counter(result.words for outcome in PointOutcome for result in found if result.outcome is outcome)
    return Markup("; ").join(Markup("<strong>{} {}</strong>").format(n, words) for words, n in counts.items())


def signer(protocol: Protocol) -> str:
    """Who is to sign."""
    return protocol.signed_by or "the safety officer of the cell (not named)"


def device_words(conditions: Conditions) -> str:
    """The force measuring device, or all of several."""
    devices = dict.fromkeys(device for _, device in conditions.devices) if conditions.devices else [conditions.device]
    return " and ".join(
        f"{each.model or 'a device that is not named'} "
        f"({'spring not stated' if math.isnan(each.stiffness) else f'{each.stiffness / 1000:g} N/mm'})"
        for each in devices
    )


def _limit(limit: ForceLimit, contact: Contact) -> str:
    return f"{_contact(limit, contact)}, within the limit of {limit.force(contact):g} N of {_edition(limit)}"


def _contact(limit: ForceLimit, contact: Contact) -> str:
    return f"{limit.name.replace('_', ' ')}, {contact} contact"


def _edition(limit: ForceLimit) -> str:
    return f"{limit.edition} (table version {limit.version})"


def _state(result: PointResult) -> str:
    own = result.confirmed_by and result.point.by_measurements
    return f"confirmed by {_impacts(result.confirmed_by)}" if own else _of_map(result.confirmed_by)


def _of_map(confirmed_by: tuple[str, ...], *, named: bool = False) -> str:
    if not confirmed_by:
        return BY_MAP_ALONE
    which = _impacts(confirmed_by) if named else f"{len(confirmed_by)} impacts (named in section 11)"
    return f"permitted by the map, which {which} confirm"


def _impacts(confirmed_by: tuple[str, ...]) -> str:
    more = len(confirmed_by) - _LISTED
    names = ", ".join(confirmed_by[:_LISTED]) + (f" and {more} more" if more > 0 else "")
    return f"{len(confirmed_by)} impacts ({names})"


def _between(low: float, high: float) -> str:
    return f"{floor_speed(low)}{f' to {floor_speed(high)}' if high > low else ''}\u00a0m/s"
