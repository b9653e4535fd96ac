"""forcemap: from measured impacts to a bounded collision-force map and safe robot speeds."""

from forcemap._version import __version__
from forcemap.assessment import Assessment, assess, map_accuracy
from forcemap.campaigns.build import build_dataset
from forcemap.campaigns.campaign import Campaign, read_campaign
from forcemap.campaigns.conditions import Conditions, read_campaign_file, read_conditions
from forcemap.campaigns.dataset import ImpactDataset, PhaseTwo, States, StateTolerance
from forcemap.campaigns.examples import EXAMPLE_CAMPAIGNS, copy_example
from forcemap.campaigns.examples.raw_recordings import write_example
from forcemap.campaigns.impacts_table import read_dataset, write_dataset
from forcemap.campaigns.plan import MeasurementPlan, read_plan, write_plan
from forcemap.campaigns.register import Entry, Use
from forcemap.campaigns.repeatability import Outlier, Repeatability, repeatability
from forcemap.campaigns.summary import CampaignSummary, StateContact, campaign_summary
from forcemap.campaigns.template import campaign_text
from forcemap.changes.censoring_effect import CensoringEffect, censoring_effect
from forcemap.changes.map_check import LeftOutState, MapCheck, MapOutcome, StateCheck, check_map
from forcemap.changes.map_comparison import MapComparison, RatioAt, compare_maps
from forcemap.comparisons import Comparison, compare_force_models
from forcemap.errors import (
    BoundNotAvailable,
    ContactNotPermitted,
    FitError,
    ForcemapError,
    InputError,
    RankDeficient,
    RecordingError,
    TooFewStates,
)
from forcemap.exports.speed_table import speed_map_csv, speed_map_places
from forcemap.impacts.detect import find_impact, find_impacts, no_impact
from forcemap.impacts.impact import Flag, Impact, Quality
from forcemap.impacts.phases import classify_contact
from forcemap.impacts.scenario import ContactScenario
from forcemap.limits.body_areas import LimitTable, body_region, read_limit_table, standard_limit_table
from forcemap.limits.force_limits import Contact, ForceLimit, force_limit
from forcemap.limits.pfl import (
    pfl_contact_force,
    pfl_energy,
    pfl_governing_speed_limit,
    pfl_pressure_speed_limit,
    pfl_robot_mass,
    pfl_speed_limit,
)
from forcemap.maps.accuracy import Accuracy, force_map_accuracy, leave_one_state_out
from forcemap.maps.bounds import Bound, FixedMargin, ToleranceBound, margins
from forcemap.maps.fit import CensoredImpacts, fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.form_comparison import (
    COMPARED_FORMS,
    EUCLIDEAN_2D,
    EuclideanForm,
    FormComparison,
    FormResult,
    RefusedForm,
    compare_forms,
)
from forcemap.maps.forms import CFM_2D, CFM_3D, FULL_CUBIC, LOG_SPEED, Form, form_named
from forcemap.maps.map_file import map_sha256, map_text, read_map, write_map
from forcemap.maps.published import PUBLISHED_MAPS, published_map
from forcemap.maps.selection import (
    PAPER_COUNTS,
    STABLE_SHARE,
    SelectionStability,
    SelectionStep,
    TermSelection,
    TermSignificance,
    TermSurvival,
    select_terms,
    selection_stability,
)
from forcemap.maps.terms import Term
from forcemap.planning.expectation import StandardExpectation
from forcemap.planning.measurements import Design, plan_measurements
from forcemap.planning.run_sheet import run_sheet
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.device import Device
from forcemap.recordings.read import read_recording, read_recordings
from forcemap.recordings.recording import Recording
from forcemap.speed_maps import SpeedMap, measured_grid, speed_map
from forcemap.speeds import SafeSpeed, SpeedOutcome, floor_speed, safe_speed
from forcemap.verdicts import Interpretation, Judgement, Verdict, VerdictOutcome, check_impact

__all__ = [
    "CFM_2D",
    "CFM_3D",
    "COMPARED_FORMS",
    "EUCLIDEAN_2D",
    "EXAMPLE_CAMPAIGNS",
    "FULL_CUBIC",
    "LOG_SPEED",
    "PAPER_COUNTS",
    "PUBLISHED_MAPS",
    "STABLE_SHARE",
    "Accuracy",
    "Assessment",
    "Bound",
    "BoundNotAvailable",
    "Campaign",
    "CampaignSummary",
    "CensoredImpacts",
    "CensoringEffect",
    "ColumnMap",
    "Comparison",
    "Conditions",
    "Contact",
    "ContactNotPermitted",
    "ContactScenario",
    "Design",
    "Device",
    "Entry",
    "EuclideanForm",
    "FitError",
    "FixedMargin",
    "Flag",
    "ForceLimit",
    "ForceMap",
    "ForcemapError",
    "Form",
    "FormComparison",
    "FormResult",
    "Impact",
    "ImpactDataset",
    "InputError",
    "Interpretation",
    "Judgement",
    "LeftOutState",
    "LimitTable",
    "MapCheck",
    "MapComparison",
    "MapOutcome",
    "MeasurementPlan",
    "Outlier",
    "PhaseTwo",
    "Quality",
    "RankDeficient",
    "RatioAt",
    "Recording",
    "RecordingError",
    "RefusedForm",
    "Repeatability",
    "SafeSpeed",
    "SelectionStability",
    "SelectionStep",
    "SpeedMap",
    "SpeedOutcome",
    "StandardExpectation",
    "StateCheck",
    "StateContact",
    "StateTolerance",
    "States",
    "Term",
    "TermSelection",
    "TermSignificance",
    "TermSurvival",
    "ToleranceBound",
    "TooFewStates",
    "Use",
    "Verdict",
    "VerdictOutcome",
    "__version__",
    "assess",
    "body_region",
    "build_dataset",
    "campaign_summary",
    "campaign_text",
    "censoring_effect",
    "check_impact",
    "check_map",
    "classify_contact",
    "compare_force_models",
    "compare_forms",
    "compare_maps",
    "copy_example",
    "find_impact",
    "find_impacts",
    "fit_force_map",
    "floor_speed",
    "force_limit",
    "force_map_accuracy",
    "form_named",
    "leave_one_state_out",
    "map_accuracy",
    "map_sha256",
    "map_text",
    "margins",
    "measured_grid",
    "no_impact",
    "pfl_contact_force",
    "pfl_energy",
    "pfl_governing_speed_limit",
    "pfl_pressure_speed_limit",
    "pfl_robot_mass",
    "pfl_speed_limit",
    "plan_measurements",
    "published_map",
    "read_campaign",
    "read_campaign_file",
    "read_conditions",
    "read_dataset",
    "read_limit_table",
    "read_map",
    "read_plan",
    "read_recording",
    "read_recordings",
    "repeatability",
    "run_sheet",
    "safe_speed",
    "select_terms",
    "selection_stability",
    "speed_map",
    "speed_map_csv",
    "speed_map_places",
    "standard_limit_table",
    "write_dataset",
    "write_example",
    "write_map",
    "write_plan",
]
