"""The whole assessment of a campaign's folder; nothing is written."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from forcemap._version import __version__
from forcemap.assessment.campaign_assessment import CampaignAssessment
from forcemap.assessment.coefficients import coefficient_intervals
from forcemap.assessment.contact_model import ContactModel, contact_model
from forcemap.assessment.findings import conditions_findings, file_findings
from forcemap.assessment.inputs import campaign_inputs
from forcemap.assessment.limit_table import campaign_limit_table
from forcemap.assessment.map_assessment import map_accuracy
from forcemap.assessment.missing import Missing, attempt
from forcemap.assessment.place_speeds import place_speeds
from forcemap.assessment.state_results import StateResult, state_results
from forcemap.campaigns.campaign import Campaign, read_campaign
from forcemap.campaigns.conditions import CAMPAIGN_FILE, Conditions, read_conditions
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.impacts_table import PLAN_FILE, TABLE_FILE, read_dataset
from forcemap.campaigns.repeatability import Repeatability, repeatability
from forcemap.campaigns.summary import campaign_summary
from forcemap.comparisons.force_models import Comparison, compare_force_models
from forcemap.errors import InputError, UnknownName
from forcemap.limits.body_areas import LimitTable
from forcemap.limits.force_limits import Contact, ForceLimit, force_limit
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.bounds import Bound, ToleranceBound, weakness
from forcemap.maps.fit import fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_2D, CFM_3D, Form
from forcemap.verdicts.recording_results import JudgedRecordings, judge_recordings

DEFAULT_AREA = "hand_fingers"
"""Body region that is assessed where none is named."""


def assess_campaign(
    campaign: Campaign | str | Path,
    *,
    limits: Sequence[ForceLimit] = (),
    bound: Bound | None = None,
    form: Form = CFM_3D,
    step: float = 0.05,
    progress: Callable[[int, int], None] | None = None,
) -> CampaignAssessment:
    """Assess a campaign's folder as a whole; a part that cannot be had is a `Missing` that says why.

    Reads the folder and writes nothing. The results are those of `impacts.csv`; whether the recordings give it is
    looked at, and what does not fit together stands in `findings`. A folder with `impacts.csv` alone, or with a plan
    alone, is assessed as far as it goes.

    Parameters
    ----------
    campaign : Campaign, str or Path
        The campaign or its folder.
    limits : sequence of ForceLimit
        Limits of the body areas to assess. If none is given, the hand (`hand_fingers`), in the table that campaign.toml
        names in `standard.limit_table` if that is a file of the folder, else in the standard's.
    bound : Bound, optional
        Bound behind the speeds; a tolerance bound with the device's error if not given.
    form : Form
        Form of the map.
    step : float
        Distance between the places of the speed tables [m].
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
    folder = campaign.folder if isinstance(campaign, Campaign) else Path(campaign)
    inputs = campaign_inputs(folder)
    if not {each.path for each in inputs} & {CAMPAIGN_FILE, PLAN_FILE, TABLE_FILE}:
        raise InputError(
            f"there is neither {CAMPAIGN_FILE} nor {PLAN_FILE} nor {TABLE_FILE}, expected a campaign's folder; "
            "forcemap plan makes one",
            file=str(folder),
        )
    conditions = read_conditions(folder / CAMPAIGN_FILE) if (folder / CAMPAIGN_FILE).exists() else Conditions()
    findings = [] if (folder / CAMPAIGN_FILE).exists() else [f"there is no {CAMPAIGN_FILE}: no condition is stated"]
    own = campaign_limit_table(folder, conditions)
    findings += [own.finding] if own.finding else []
    chosen = "given by the user"
    if not limits:
        limits, chosen = [_default_limit(own.table)], "the default: no body area was named"
    if own.file:
        inputs = campaign_inputs(folder, further=[own.file])
        others = dict.fromkeys(limit.edition for limit in limits if limit.sha256 != own.table.sha256)
        if others:
            findings.append(f"campaign.toml names the limit table {own.file}, limits used are of {', '.join(others)}")
    home = campaign if isinstance(campaign, Campaign) else attempt(lambda: read_campaign(folder))
    findings += conditions_findings(conditions, limits)
    findings += [] if isinstance(home, Missing) else file_findings(home)
    recordings = home if isinstance(home, Missing) else attempt(lambda: _judged(home, limits, progress))
    stated = conditions.simulated
    if isinstance(recordings, JudgedRecordings) and any(each.simulated for each in recordings.results):
        conditions = replace(conditions, simulated=True)
    dataset = attempt(lambda: read_dataset(folder, conditions=conditions))
    simulated = conditions.simulated if isinstance(dataset, Missing) else dataset.simulated
    if simulated and not stated:
        findings.append("SIMULATED recordings or impacts, in a campaign whose campaign.toml does not say so")
    scatter = dataset if isinstance(dataset, Missing) else repeatability(dataset)
    force_map = dataset if isinstance(dataset, Missing) else attempt(lambda: fit_force_map(dataset, form=form))
    bound = bound or ToleranceBound(device_error=conditions.device.error_or_default)
    carried = force_map if isinstance(force_map, Missing) else attempt(lambda: _carried(force_map, bound))
    if not isinstance(dataset, Missing) and dataset.binding.reason:
        findings.append(dataset.binding.reason)
    if not isinstance(force_map, Missing) and (weak := weakness(bound, force_map)):
        findings.insert(0, weak)
    models = tuple(attempt(partial(contact_model, conditions, limit)) for limit in limits)
    return CampaignAssessment(
        name=folder.resolve().name,
        software=f"forcemap {__version__}",
        inputs=inputs,
        findings=tuple(findings),
        conditions=conditions,
        campaign=home,
        simulated=simulated,
        limits=tuple(limits),
        limits_chosen=chosen,
        recordings=recordings,
        dataset=dataset,
        summary=_first_missing(home, dataset) or campaign_summary(home, dataset),  # type: ignore[arg-type]
        repeatability=scatter,
        states=_states(dataset, scatter, recordings, force_map, len(limits)),
        force_map=force_map,
        coefficients=force_map if isinstance(force_map, Missing) else coefficient_intervals(force_map),
        accuracy=_accuracy(force_map, dataset),
        bound=carried,
        speeds=tuple(
            place_speeds(
                limit,
                contact,
                force_map=force_map,
                bound=carried,
                measured=conditions if isinstance(dataset, Missing) else dataset,
                plan=None if isinstance(home, Missing) else home.plan,
                model=model,
                step=step,
            )
            for limit, model in zip(limits, models, strict=True)
            for contact in Contact
        ),
        map_2d=dataset if isinstance(dataset, Missing) else attempt(lambda: fit_force_map(dataset, form=CFM_2D)),
        contact_models=models,
        comparisons=tuple(
            _comparison(dataset, force_map, limit, model, carried, form)
            for limit, model in zip(limits, models, strict=True)
        ),
    )


def _default_limit(table: LimitTable) -> ForceLimit:
    try:
        return force_limit(DEFAULT_AREA, table=table)
    except UnknownName:
        return force_limit(table.regions[0], table=table)


def _judged(
    campaign: Campaign, limits: Sequence[ForceLimit], progress: Callable[[int, int], None] | None
) -> JudgedRecordings | Missing:
    if not campaign.files() and not campaign.entries:
        return Missing("there are no recordings in the folder")
    return judge_recordings(campaign, limits, progress=progress)


def _states(
    dataset: ImpactDataset | Missing,
    scatter: Repeatability | Missing,
    recordings: JudgedRecordings | Missing,
    force_map: ForceMap | Missing,
    limits: int,
) -> tuple[StateResult, ...] | Missing:
    if isinstance(dataset, Missing):
        return dataset
    assert not isinstance(scatter, Missing)
    results = () if isinstance(recordings, Missing) else recordings.results
    return state_results(dataset, scatter, results, None if isinstance(force_map, Missing) else force_map, limits)


def _accuracy(force_map: ForceMap | Missing, dataset: ImpactDataset | Missing) -> tuple[Accuracy, ...] | Missing:
    if isinstance(force_map, Missing) or isinstance(dataset, Missing):
        return force_map if isinstance(force_map, Missing) else Missing("there are no impacts")
    return attempt(lambda: map_accuracy(force_map, dataset))


def _carried(force_map: ForceMap, bound: Bound) -> Bound:
    bound.require(force_map)
    return bound


def _comparison(
    dataset: ImpactDataset | Missing,
    force_map: ForceMap | Missing,
    limit: ForceLimit,
    model: ContactModel | Missing,
    bound: Bound | Missing,
    form: Form,
) -> Comparison | Missing:
    if why := _first_missing(dataset, force_map, model):
        return why
    assert isinstance(dataset, ImpactDataset)
    assert isinstance(model, ContactModel)
    found = None if isinstance(bound, Missing) else bound
    return attempt(
        lambda: compare_force_models(
            dataset,
            robot_mass=model.robot_mass,
            body_mass=model.body_mass,
            stiffness=model.stiffness,
            form=form,
            bound=found,
            limit=limit if limit.permitted else None,
        )
    )


def _first_missing(*parts: object) -> Missing | None:
    return next((part for part in parts if isinstance(part, Missing)), None)
