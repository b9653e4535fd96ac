"""The whole result of a campaign's folder: every part, or in words why there is none."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from forcemap._version import __version__
from forcemap.assessment.confirmation import Confirmations, confirmations, saying
from forcemap.assessment.contact_points import POINTS_FILE, ContactPoint, read_contact_points
from forcemap.assessment.folder import (
    CampaignLimitTable,
    InputFile,
    campaign_inputs,
    campaign_limit_table,
    file_findings,
    files_of,
    stated_findings,
    withheld_by,
)
from forcemap.assessment.missing import Missing, attempt, present
from forcemap.assessment.place_speeds import PlaceSpeeds, place_speeds
from forcemap.assessment.point_impacts import unnamed_files
from forcemap.assessment.point_results import PointResult, doubts_at_points, point_results
from forcemap.assessment.state_results import StateResult, state_results
from forcemap.campaigns.campaign import Campaign, read_campaign
from forcemap.campaigns.conditions import CAMPAIGN_FILE, Conditions, read_conditions
from forcemap.campaigns.dataset import ImpactDataset, Quantity
from forcemap.campaigns.impacts_table import TABLE_FILE, as_entered, read_dataset
from forcemap.campaigns.not_stated import NotStated, not_stated
from forcemap.campaigns.plan import PLAN_FILE
from forcemap.campaigns.protocol import Protocol, read_protocol
from forcemap.campaigns.readout import Reader, judging_once
from forcemap.campaigns.repeatability import Repeatability, repeatability
from forcemap.campaigns.summary import CampaignSummary, campaign_summary
from forcemap.comparisons.contact_model import ContactModel, contact_model
from forcemap.comparisons.force_models import Comparison, compare_force_models
from forcemap.direction import ON_AXIS, WIDEST_ANGLE
from forcemap.errors import CampaignFileError, InputError, UnknownName
from forcemap.findings import Finding, FindingKind
from forcemap.limits.body_areas import LimitTable, standard_limit_table
from forcemap.limits.force_limits import Contact, ForceLimit, force_limit
from forcemap.maps.accuracy import Accuracy, map_accuracy
from forcemap.maps.bounds import Bound, ToleranceBound, weakness
from forcemap.maps.carry_over import campaign_map
from forcemap.maps.coefficients import Coefficient, coefficient_intervals
from forcemap.maps.fit import fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_2D, Form
from forcemap.planning.confirm import ConfirmationResult
from forcemap.speeds.allowance import Allowance
from forcemap.speeds.basis import doubts_of_fit, unconfirmed
from forcemap.verdicts.recording_results import JudgedRecordings, judge_recordings


@dataclass(frozen=True, eq=False)
class CampaignAssessment:
    """The whole result of a campaign's folder; a missing part says why.

    Parameters
    ----------
    name : str
        Name of the folder.
    software : str
        Software that made the assessment.
    inputs : tuple of InputFile
        The files that it rests on.
    findings : tuple of Finding
        What does not fit together, to be read before any result.
    conditions : Conditions
        What the campaign was measured under.
    campaign : Campaign or Missing
        Plan and register.
    simulated : bool
        True if the campaign, an impact or a recording says that it is simulated.
    limits : tuple of ForceLimit
        The limits of the body areas that are assessed.
    limits_chosen : str
        Who chose them, in words.
    recordings : JudgedRecordings or Missing
        Every recording beside the limits.
    dataset : ImpactDataset or Missing
        The impacts.
    summary : CampaignSummary or Missing
        What the campaign has and has not.
    repeatability : Repeatability or Missing
        How far repeats agree.
    states : tuple of StateResult, or Missing
        What was measured at every state.
    force_map : ForceMap or Missing
        The map fitted to the impacts with role train.
    coefficients : tuple of Coefficient, or Missing
        Its coefficients with their confidence intervals.
    accuracy : tuple of Accuracy, or Missing
        The one to trust first.
    bound : Bound or Missing
        The bound behind the speeds.
    speeds : tuple of PlaceSpeeds
        Safe speeds, for every limit and kind of contact.
    map_2d : ForceMap or Missing
        The 2D map of the same impacts, to compare with.
    contact_models : tuple of (ContactModel or Missing)
        The standard's contact model, one for each limit.
    comparisons : tuple of (Comparison or Missing)
        The map beside the 2D map and the standard's contact model, one for each limit.
    points : tuple of PointResult, or Missing
        The contact points of the cell; none without contact_points.csv.
    protocol : Protocol
        Serial numbers, certificates and the document, as campaign.toml states them.
    not_stated : tuple of NotStated
        What of the protocol is not stated, what matters most first.
    """

    name: str
    software: str
    inputs: tuple[InputFile, ...]
    findings: tuple[Finding, ...]
    conditions: Conditions
    campaign: Campaign | Missing
    simulated: bool
    limits: tuple[ForceLimit, ...]
    limits_chosen: str
    recordings: JudgedRecordings | Missing
    dataset: ImpactDataset | Missing
    summary: CampaignSummary | Missing
    repeatability: Repeatability | Missing
    states: tuple[StateResult, ...] | Missing
    force_map: ForceMap | Missing
    coefficients: tuple[Coefficient, ...] | Missing
    accuracy: tuple[Accuracy, ...] | Missing
    bound: Bound | Missing
    speeds: tuple[PlaceSpeeds, ...]
    map_2d: ForceMap | Missing
    contact_models: tuple[ContactModel | Missing, ...]
    comparisons: tuple[Comparison | Missing, ...]
    points: tuple[PointResult, ...] | Missing
    protocol: Protocol
    not_stated: tuple[NotStated, ...]

    @property
    def pressure_assessed(self) -> bool:
        """True if speeds hold for the pressure, too."""
        return not isinstance(self.force_map, Missing) and self.force_map.other(Quantity.PRESSURE) is not None


PLACES_APART = 0.05
"""Distance between the places of speed tables, if none is named [m]: a choice."""

DEFAULT_AREA = "hand_fingers"
"""Body region that is assessed if none is named."""


def assess_campaign(
    campaign: Campaign | str | Path,
    *,
    limits: Sequence[ForceLimit] = (),
    limit_table: LimitTable | None = None,
    bound: Bound | None = None,
    form: Form | None = None,
    step: float = PLACES_APART,
    allowance: Allowance | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> CampaignAssessment:
    """Assess a campaign's folder as a whole; a part that cannot be had is a `Missing` that says why.

    Reads the folder and writes nothing. The results are those of `impacts.csv`; whether the recordings give that table
    is checked, and what does not fit together stands in `findings`. A folder with `impacts.csv` alone, or with a plan
    alone, is assessed as far as it goes.

    Parameters
    ----------
    campaign : Campaign, str or Path
        The campaign or its folder.
    limits : sequence of ForceLimit
        Limits of the body areas to assess. If none is given, those of the contact points, without any the hand
        (`hand_fingers`), in the table that campaign.toml names in `standard.limit_table` if that is a file of the
        folder, else in the standard's.
    limit_table : LimitTable, optional
        Where the limits of contact points stand; that of campaign.toml if not given.
    bound : Bound, optional
        Bound behind the speeds; a tolerance bound with the device's error if not given.
    form : Form, optional
        Form of the map; as in `fit_force_map` if not given.
    step : float
        Distance between the places of the speed tables [m].
    allowance : Allowance, optional
        What the robot may deviate; `Allowance()` if not given.
    progress : callable, optional
        Called with the number of recordings judged and of all recordings.

    Returns
    -------
    CampaignAssessment

    Raises
    ------
    InputError
        There is no such folder, or nothing of a campaign in it; the step is not positive and finite.
    CampaignFileError
        campaign.toml cannot be used.
    """
    if not 0 < step < math.inf:
        raise InputError(f"step: found {step:g} m, expected a positive finite number")
    stated = _stated(campaign.folder if isinstance(campaign, Campaign) else Path(campaign), limits, limit_table)
    records = campaign if isinstance(campaign, Campaign) else attempt(lambda: read_campaign(stated.folder))
    measured = _measured(records, stated, progress)
    conditions, judged, dataset = measured.conditions, measured.recordings, measured.dataset
    fitted = _fitted(
        stated.folder, records, dataset, form, bound or ToleranceBound(device_error=conditions.device.error_or_default)
    )
    force_map, carried, robot = fitted.force_map, fitted.bound, allowance or Allowance()
    scatter = attempt(lambda: repeatability(present(dataset)))
    cases = tuple((limit, attempt(partial(contact_model, conditions, limit.name))) for limit in stated.limits)

    def speeds_of(limit: ForceLimit, model: ContactModel | Missing, contact: Contact) -> PlaceSpeeds:
        known = conditions if isinstance(dataset, Missing) else dataset
        rest: dict[str, Any] = {"measured": known, "model": model, "step": step, "allowance": robot}
        rest["plan"] = None if isinstance(records, Missing) else records.plan
        told = None if isinstance(carried, Missing) else fitted.confirmed(limit, contact, carried)
        return place_speeds(limit, contact, force_map, carried, confirmation=told, **rest)

    speeds = tuple(speeds_of(*case, contact) for case in cases for contact in Contact)
    points = attempt(lambda: _points(stated, measured, records, fitted, robot))
    return CampaignAssessment(
        name=stated.folder.resolve().name,
        software=f"forcemap {__version__}",
        inputs=stated.inputs,
        findings=_findings(stated, measured, fitted, speeds, points),
        conditions=conditions,
        campaign=records,
        simulated=measured.simulated,
        limits=stated.limits,
        limits_chosen=stated.limits_chosen,
        recordings=judged,
        dataset=dataset,
        summary=attempt(lambda: campaign_summary(present(records), present(dataset))),
        repeatability=scatter,
        states=attempt(lambda: state_results(present(dataset), present(scatter), judged, force_map, len(cases))),
        force_map=force_map,
        coefficients=attempt(lambda: coefficient_intervals(present(force_map))),
        accuracy=attempt(lambda: map_accuracy(present(force_map), present(dataset))),
        bound=carried,
        speeds=speeds,
        map_2d=attempt(lambda: fit_force_map(present(dataset), form=CFM_2D)),
        contact_models=tuple(model for _, model in cases),
        comparisons=tuple(attempt(partial(_compared, measured, fitted, form, *case)) for case in cases),
        points=points,
        protocol=stated.protocol,
        not_stated=not_stated(conditions, stated.protocol),
    )


@dataclass(frozen=True, eq=False)
class _Stated:
    """What a folder states before its recordings are looked at: files, conditions, limits, what is wrong with them."""

    folder: Path
    inputs: tuple[InputFile, ...]
    conditions: Conditions
    limits: tuple[ForceLimit, ...]
    limits_chosen: str
    findings: tuple[Finding, ...]
    points: tuple[ContactPoint, ...] | Missing = ()
    protocol: Protocol = field(default_factory=Protocol)


def _stated(folder: Path, limits: Sequence[ForceLimit], table: LimitTable | None) -> _Stated:
    inputs = campaign_inputs(folder)
    if not {file.path for file in inputs} & {CAMPAIGN_FILE, PLAN_FILE, TABLE_FILE}:
        raise InputError(
            f"there is neither {CAMPAIGN_FILE} nor {PLAN_FILE} nor {TABLE_FILE}, expected a campaign's folder; "
            "forcemap plan makes one",
            file=str(folder),
        )
    has_conditions = (folder / CAMPAIGN_FILE).exists()
    conditions = read_conditions(folder / CAMPAIGN_FILE) if has_conditions else Conditions()
    findings = [] if has_conditions else [Finding.of(FindingKind.CONDITIONS_MISSING, file=CAMPAIGN_FILE)]
    try:
        own = campaign_limit_table(folder, conditions)
    except CampaignFileError:
        if table is None:
            raise
        own = CampaignLimitTable(table, "")
    chosen = "given by the user"
    there = folder / POINTS_FILE
    listed: tuple[ContactPoint, ...] | Missing
    listed = attempt(lambda: read_contact_points(there, table=table or own.table)) if there.exists() else ()
    of_points = (
        () if isinstance(listed, Missing) else tuple({point.limit.name: point.limit for point in listed}.values())
    )
    if isinstance(listed, Missing):
        findings.append(Finding.of(FindingKind.POINTS_UNUSABLE, words=listed.reason))
    if of_points and {limit.name for limit in limits or of_points} == {limit.name for limit in of_points}:
        limits, chosen = limits or of_points, f"those of the contact points ({POINTS_FILE})"
    elif not limits:
        limits, chosen = [_default_limit(own.table)], "the default: no body area was named"
    known = own.table.sha256 if own.file else standard_limit_table().sha256
    given = {limit.sha256 for limit in (*limits, *of_points)} - {known}
    tables = [*filter(None, [own.file]), *files_of(folder, given)]
    inputs = campaign_inputs(folder, further=tables) if tables else inputs
    if own.file:
        others = dict.fromkeys(limit.edition for limit in limits if limit.sha256 != own.table.sha256)
        if others:
            findings.append(Finding.of(FindingKind.OTHER_LIMITS, table=own.file, editions=", ".join(others)))
    findings += stated_findings(conditions, list(dict.fromkeys([*limits, *of_points])))
    unnamed = () if isinstance(listed, Missing) else attempt(lambda: unnamed_files(folder, listed))
    if unnamed and not isinstance(unnamed, Missing):
        findings.append(Finding.of(FindingKind.POINT_FILES_UNNAMED, names=unnamed))
    if held := tuple(point.name for point in (() if isinstance(listed, Missing) else listed) if point.held_as_free):
        findings.append(Finding.of(FindingKind.POINT_HELD_AS_FREE, names=held))
    protocol = read_protocol(folder / CAMPAIGN_FILE) if has_conditions else Protocol()
    return _Stated(folder, inputs, conditions, tuple(limits), chosen, tuple(findings), listed, protocol)


@dataclass(frozen=True, eq=False)
class _Measured:
    """Recordings and impacts of a campaign, its conditions with what they add, and what does not fit together."""

    recordings: JudgedRecordings | Missing
    dataset: ImpactDataset | Missing
    conditions: Conditions
    simulated: bool
    findings: tuple[Finding, ...]


def _measured(records: Campaign | Missing, stated: _Stated, progress: Callable[[int, int], None] | None) -> _Measured:
    conditions = stated.conditions
    findings: list[Finding] = []
    recordings: JudgedRecordings | Missing
    if isinstance(records, Missing):
        recordings = records
    else:
        first, again = judging_once(records)
        recordings = attempt(lambda: _judged(records, stated.limits, progress, first))
        findings += file_findings(records, again)
    if isinstance(recordings, JudgedRecordings) and any(result.simulated for result in recordings.results):
        conditions = replace(conditions, simulated=True)
    dataset = attempt(lambda: read_dataset(stated.folder, conditions=conditions))
    simulated = conditions.simulated if isinstance(dataset, Missing) else dataset.simulated
    if simulated and not stated.conditions.simulated:
        findings.append(Finding.of(FindingKind.SIMULATED_NOT_STATED))
    if not isinstance(dataset, Missing) and dataset.binding.reason:
        findings.append(dataset.binding.reason)
    dataset = dataset if isinstance(dataset, Missing) else withheld_by(findings, dataset)
    findings += as_entered(conditions, stated.folder).doubts
    return _Measured(recordings, dataset, conditions, simulated, tuple(findings))


@dataclass(frozen=True, eq=False)
class _Fitted:
    """A map and the bound it carries, with the findings against them: first (`weakness`) and last (`doubts`).

    `confirmed` tells what the impacts that were to confirm it show.
    """

    force_map: ForceMap | Missing
    bound: Bound | Missing
    confirmed: Confirmations
    weakness: tuple[Finding, ...] = ()
    doubts: tuple[Finding, ...] = ()


def _fitted(
    folder: Path, records: Campaign | Missing, dataset: ImpactDataset | Missing, form: Form | None, bound: Bound
) -> _Fitted:
    force_map = attempt(lambda: campaign_map(folder, present(dataset), form=form))
    carried = attempt(lambda: _carried(present(force_map), bound))
    if isinstance(force_map, Missing):
        return _Fitted(force_map, carried, _none_confirms)
    confirmed: Confirmations = _none_confirms
    told = force_map
    if not isinstance(records, Missing):
        confirmed = confirmations(folder, present(dataset), force_map, records)
        told = saying(force_map, confirmed)
    weak = weakness(bound, force_map)
    transfer = force_map.require_fit().transfer
    first = [*([weak] if weak else []), *((*transfer.warnings, *transfer.findings) if transfer else ())]
    own = present(dataset).conditions.doubts  # said of the campaign; those of an earlier one are the map's
    first += [doubt for doubt in force_map.conditions.doubts if doubt not in own]
    return _Fitted(told, carried, confirmed, tuple(first), tuple(doubts_of_fit(force_map)))


def _findings(
    stated: _Stated,
    measured: _Measured,
    fitted: _Fitted,
    speeds: tuple[PlaceSpeeds, ...],
    points: tuple[PointResult, ...] | Missing,
) -> tuple[Finding, ...]:
    """What must be read before the results of a campaign are used, what weighs most first."""
    said = (*stated.findings, *_of_points(points, fitted.force_map), *_of_speeds(speeds), *measured.findings)
    return (*fitted.weakness, *said, *fitted.doubts)


def _of_points(points: tuple[PointResult, ...] | Missing, force_map: ForceMap | Missing) -> list[Finding]:
    """Which contact points are permitted as programmed only for motion straight along the direction, what must be read
    before the speeds off it are used, and what no map tells of the impacts at them."""
    if isinstance(points, Missing):
        return []
    only = [each for each in points if each.straight_only]
    names = tuple(each.point.name for each in only)
    none = tuple(each.point.name for each in only if math.isnan(each.off_axis or math.nan))
    figures = {"names": names, "none": none, "straight_deg": ON_AXIS, "widest_deg": WIDEST_ANGLE}
    straight = [Finding.of(FindingKind.POINT_STRAIGHT_ONLY, **figures)] * bool(names)
    off_axis = (doubt for each in points for doubt in each.warnings_off_axis)
    return list(dict.fromkeys([*straight, *off_axis, *doubts_at_points(points, force_map)]))


def _of_speeds(speeds: Iterable[PlaceSpeeds]) -> list[Finding]:
    """That nobody has measured whether the map holds at the speeds that are given, and what is said of those off the
    direction alone, each once."""
    said = []
    for part in speeds:
        if part.confirmed and not isinstance(part.speeds, Missing):
            said += [*unconfirmed(part.speeds.speeds.basis.warnings), *part.warnings_off_axis]
    return list(dict.fromkeys(said))


def _none_confirms(*_: Any) -> ConfirmationResult | None:
    """What impacts show that nobody can read."""
    return None


def _compared(
    measured: _Measured, fitted: _Fitted, form: Form | None, limit: ForceLimit, model: ContactModel | Missing
) -> Comparison:
    impacts, _, masses = present(measured.dataset), present(fitted.force_map), present(model)
    usable, under = limit if limit.permitted else None, None if isinstance(fitted.bound, Missing) else fitted.bound
    case: dict[str, Any] = {"form": form, "bound": under, "limit": usable}
    return compare_force_models(impacts, **masses.figures, **case, force_map=present(fitted.force_map))


def _points(
    stated: _Stated,
    measured: _Measured,
    records: Campaign | Missing,
    fitted: _Fitted,
    allowance: Allowance,
) -> tuple[PointResult, ...]:
    return point_results(
        present(stated.points),
        folder=stated.folder,
        conditions=measured.conditions,
        campaign=records,
        force_map=fitted.force_map,
        bound=fitted.bound,
        confirmed=fitted.confirmed,
        allowance=allowance,
    )


@dataclass(frozen=True, eq=False)
class AssessedPoints:
    """The contact points of a folder, without the rest of its result.

    Parameters
    ----------
    points : tuple of PointResult, or Missing
        None without contact_points.csv.
    conditions : Conditions
    protocol : Protocol
    findings : tuple of Finding
        What does not fit together, to be read first; recordings are not compared with the impacts table here.
    simulated : bool
        True if the campaign or one of the impacts says so.
    """

    points: tuple[PointResult, ...] | Missing
    conditions: Conditions
    protocol: Protocol
    findings: tuple[Finding, ...]
    simulated: bool


def assess_points(folder: str | Path, *, limit_table: LimitTable | None = None) -> AssessedPoints:
    """The contact points of a campaign's folder, as `assess_campaign` judges them; of the recordings only those named.

    Parameters
    ----------
    folder : str or Path
    limit_table : LimitTable, optional
        As in `assess_campaign`.

    Raises
    ------
    InputError
        There is no such folder, or nothing of a campaign in it.
    CampaignFileError
        campaign.toml cannot be used.
    """
    stated, robot = _stated(Path(folder), (), limit_table), Allowance()
    records = attempt(lambda: read_campaign(stated.folder))
    dataset = attempt(lambda: read_dataset(stated.folder, conditions=stated.conditions))
    broken = None if isinstance(dataset, Missing) else dataset.binding.reason
    said = (*([broken] if broken else []), *as_entered(stated.conditions, stated.folder).doubts)
    simulated = stated.conditions.simulated if isinstance(dataset, Missing) else dataset.simulated
    measured = _Measured(Missing("not asked for"), dataset, stated.conditions, simulated, said)
    bound = ToleranceBound(device_error=stated.conditions.device.error_or_default)
    fitted = _fitted(stated.folder, records, dataset, None, bound)
    points = attempt(lambda: _points(stated, measured, records, fitted, robot))
    judged = () if isinstance(points, Missing) else points
    return AssessedPoints(
        points,
        stated.conditions,
        stated.protocol,
        (*fitted.weakness, *stated.findings, *_of_points(points, fitted.force_map), *said, *fitted.doubts),
        simulated or any(impact.simulated for result in judged for impact in result.impacts),
    )


def _default_limit(table: LimitTable) -> ForceLimit:
    try:
        return force_limit(DEFAULT_AREA, table=table)
    except UnknownName:
        return force_limit(table.regions[0], table=table)


def _judged(
    campaign: Campaign, limits: Sequence[ForceLimit], progress: Callable[[int, int], None] | None, reader: Reader
) -> JudgedRecordings:
    if not campaign.files() and not campaign.entries:
        raise InputError("there are no recordings in the folder")
    return judge_recordings(campaign, limits, progress=progress, reader=reader)


def _carried(force_map: ForceMap, bound: Bound) -> Bound:
    bound.require(force_map)
    return bound
