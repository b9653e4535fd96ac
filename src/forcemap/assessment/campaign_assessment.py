"""The whole result of a campaign's folder, as a type: every part is there, or the reason in words why it is not."""

from __future__ import annotations

from dataclasses import dataclass

from forcemap.assessment.coefficients import Coefficient
from forcemap.assessment.contact_model import ContactModel
from forcemap.assessment.inputs import InputFile
from forcemap.assessment.missing import Missing
from forcemap.assessment.place_speeds import PlaceSpeeds
from forcemap.assessment.state_results import StateResult
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.repeatability import Repeatability
from forcemap.campaigns.summary import CampaignSummary
from forcemap.comparisons.force_models import Comparison
from forcemap.limits.force_limits import ForceLimit
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.verdicts.recording_results import JudgedRecordings


@dataclass(frozen=True, eq=False)
class CampaignAssessment:
    """The whole result of a campaign's folder; a part that cannot be had says why.

    Parameters
    ----------
    name : str
        Name of the folder.
    software : str
        Software that made the assessment.
    inputs : tuple of InputFile
        The files that it rests on.
    findings : tuple of str
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
    """

    name: str
    software: str
    inputs: tuple[InputFile, ...]
    findings: tuple[str, ...]
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
