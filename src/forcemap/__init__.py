"""forcemap: from measured impacts to a bounded collision-force map and safe robot speeds."""

from forcemap._version import __version__
from forcemap.assessment.assess_campaign import assess_campaign
from forcemap.assessment.campaign_assessment import CampaignAssessment
from forcemap.assessment.coefficients import Coefficient
from forcemap.assessment.contact_model import ContactModel
from forcemap.assessment.inputs import InputFile, campaign_inputs
from forcemap.assessment.limit_table import CampaignLimitTable, campaign_limit_table
from forcemap.assessment.map_assessment import Assessment, assess, map_accuracy
from forcemap.assessment.missing import Missing
from forcemap.assessment.place_speeds import OpenPlaces, PlaceSpeeds
from forcemap.assessment.state_results import StateResult
from forcemap.campaigns.binding import Binding, BindingState
from forcemap.campaigns.build import build_dataset
from forcemap.campaigns.campaign import Campaign, read_campaign
from forcemap.campaigns.conditions import Conditions, read_campaign_file, read_conditions
from forcemap.campaigns.dataset import ImpactDataset, PhaseTwo, States, StateTolerance
from forcemap.campaigns.examples import EXAMPLE_CAMPAIGNS, copy_example
from forcemap.campaigns.impacts_table import read_dataset, write_dataset
from forcemap.campaigns.plan import MeasurementPlan, read_plan, write_plan
from forcemap.campaigns.recordings_table import Entry, Use
from forcemap.campaigns.repeatability import Outlier, Repeatability, repeatability
from forcemap.campaigns.summary import CampaignSummary, StateContact, campaign_summary
from forcemap.campaigns.template import campaign_text
from forcemap.comparisons.censoring_effect import CensoringEffect, censoring_effect
from forcemap.comparisons.effective_mass import MassComparison, MassExplanation, compare_effective_mass
from forcemap.comparisons.force_models import Comparison, compare_force_models
from forcemap.comparisons.forms import (
    COMPARED_FORMS,
    EUCLIDEAN_2D,
    EuclideanForm,
    FormComparison,
    FormResult,
    RefusedForm,
    compare_forms,
)
from forcemap.comparisons.map_check import LeftOutState, MapCheck, MapOutcome, StateCheck, check_map
from forcemap.comparisons.selection import (
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
from forcemap.comparisons.two_maps import MapComparison, RatioAt, compare_maps
from forcemap.dynamics.drive_inertia import DriveInertia
from forcemap.dynamics.effective_mass import EffectiveMass, MassOutcome, effective_mass, standard_effective_mass
from forcemap.dynamics.ellipsoid import PrincipalMasses, mean_effective_mass, principal_effective_masses
from forcemap.dynamics.inverse_kinematics import DOWN, Reach, ReachOutcome, inverse_kinematics, places_in_plane
from forcemap.dynamics.kinematics import Pose, forward_kinematics, jacobian
from forcemap.dynamics.mass_map import MassMap, Trend, planar_mass_map, robot_mass_map
from forcemap.dynamics.mass_matrix import mass_matrix
from forcemap.dynamics.planar_arm import (
    LINK_ALIGNED,
    LINK_DOWN,
    LINK_HORIZONTAL,
    Elbow,
    LastLink,
    LinkMass,
    PlanarArm,
    Wrist,
    planar_contact_point,
    planar_jacobian,
    planar_mass_matrix,
)
from forcemap.dynamics.planar_places import (
    INSPECTION_DISTANCES,
    INSPECTION_HEIGHTS,
    PlanarReach,
    planar_effective_mass_at,
    planar_inverse_kinematics,
)
from forcemap.dynamics.robot import Joint, JointKind, Robot
from forcemap.dynamics.robot_mass import robot_effective_mass, robot_effective_mass_at
from forcemap.dynamics.robots import ROBOTS, identified_drive_inertia, robot_named
from forcemap.dynamics.urdf import read_urdf
from forcemap.errors import (
    BoundNotAvailable,
    ContactNotPermitted,
    FitError,
    ForcemapError,
    InputError,
    NotReleasable,
    RankDeficient,
    RecordingError,
    TooFewStates,
)
from forcemap.exports.krl import krl_data, krl_source
from forcemap.exports.robot_table import Provenance, RobotTable, provenance, robot_table
from forcemap.exports.safety_proposal import safety_proposal
from forcemap.exports.scaling import scaling_csv, scaling_result
from forcemap.exports.speed_table import speed_map_csv, speed_map_places
from forcemap.exports.urscript import urscript
from forcemap.exports.zones import zones_csv, zones_result
from forcemap.impacts.detect import find_impact, find_impacts, no_impact
from forcemap.impacts.impact import Flag, Impact, Quality
from forcemap.impacts.phases import classify_contact
from forcemap.impacts.scenario import ContactScenario
from forcemap.limits.body_areas import LimitTable, body_region, read_limit_table, standard_limit_table
from forcemap.limits.covers import Estimate, cover_estimate, payload_estimate
from forcemap.limits.device_spring import DeviceSuitability, device_suitability
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit, force_limit
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
from forcemap.maps.direction import WIDEST_ANGLE, direction_vector, raised_off_axis
from forcemap.maps.fit import CensoredImpacts, fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_2D, CFM_3D, FULL_CUBIC, LOG_SPEED, Form, form_named
from forcemap.maps.map_file import map_sha256, map_text, read_map, write_map
from forcemap.maps.published import PUBLISHED_MAPS, published_map
from forcemap.maps.saturation import saturation_doubt
from forcemap.maps.terms import Term
from forcemap.paths.path_file import read_path
from forcemap.paths.path_speeds import CycleTime, PathSpeeds, PieceOutcome, path_speeds
from forcemap.paths.table_positions import TaskPlaces, place_task, table_positions
from forcemap.paths.task import Task, TaskSegment, one_segment_task, read_task
from forcemap.paths.time_law import TimeLaw, time_law
from forcemap.paths.tool_path import ToolPath
from forcemap.planning.confirm.confirmation import ConfirmationPlan, ConfirmationResult, Confirmed, ConfirmingImpact
from forcemap.planning.confirm.plan import confirm_plan
from forcemap.planning.design import Design
from forcemap.planning.designed_plan import DesignedPlan
from forcemap.planning.expectation import Expectation, StandardExpectation
from forcemap.planning.measurements import plan_measurements
from forcemap.planning.next.measurements import NextMeasurements, Stop, next_measurements
from forcemap.planning.optimal_states import DesignedStates, optimal_states
from forcemap.planning.run_sheet import run_sheet
from forcemap.planning.runs import extend_plan
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.device import Device
from forcemap.recordings.read import read_recording, read_recordings
from forcemap.recordings.recording import Recording
from forcemap.speeds.many_speeds import many_safe_speeds
from forcemap.speeds.safe_speed import SafeSpeed, SpeedOutcome, floor_speed, safe_speed
from forcemap.speeds.speed_map import SpeedMap, measured_grid, speed_map
from forcemap.speeds.zone_speeds import ZoneSpeeds, zone_speeds
from forcemap.speeds.zones import Allowance, Segments, Zones, zone_grid
from forcemap.verdicts.recording_results import JudgedRecordings, RecordingResult
from forcemap.verdicts.verdict import Interpretation, Judgement, Verdict, VerdictOutcome, check_impact

__all__ = [
    "CFM_2D",
    "CFM_3D",
    "COMPARED_FORMS",
    "DOWN",
    "EUCLIDEAN_2D",
    "EXAMPLE_CAMPAIGNS",
    "FULL_CUBIC",
    "INSPECTION_DISTANCES",
    "INSPECTION_HEIGHTS",
    "LINK_ALIGNED",
    "LINK_DOWN",
    "LINK_HORIZONTAL",
    "LOG_SPEED",
    "PAPER_COUNTS",
    "PUBLISHED_MAPS",
    "ROBOTS",
    "STABLE_SHARE",
    "WIDEST_ANGLE",
    "Accuracy",
    "Allowance",
    "Assessment",
    "Binding",
    "BindingState",
    "Bound",
    "BoundNotAvailable",
    "Campaign",
    "CampaignAssessment",
    "CampaignLimitTable",
    "CampaignSummary",
    "CensoredImpacts",
    "CensoringEffect",
    "Coefficient",
    "ColumnMap",
    "Comparison",
    "Conditions",
    "ConfirmationPlan",
    "ConfirmationResult",
    "Confirmed",
    "ConfirmingImpact",
    "Contact",
    "ContactModel",
    "ContactNotPermitted",
    "ContactScenario",
    "CycleTime",
    "Design",
    "DesignedPlan",
    "DesignedStates",
    "Device",
    "DeviceSuitability",
    "DriveInertia",
    "EffectiveMass",
    "Elbow",
    "Entry",
    "Estimate",
    "EuclideanForm",
    "Expectation",
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
    "InputFile",
    "Interpretation",
    "Joint",
    "JointKind",
    "JudgedRecordings",
    "Judgement",
    "LastLink",
    "LeftOutState",
    "LimitTable",
    "LinkMass",
    "MapCheck",
    "MapComparison",
    "MapOutcome",
    "MassComparison",
    "MassExplanation",
    "MassMap",
    "MassOutcome",
    "MeasurementPlan",
    "Missing",
    "NewtonLimit",
    "NextMeasurements",
    "NotReleasable",
    "OpenPlaces",
    "Outlier",
    "PathSpeeds",
    "PhaseTwo",
    "PieceOutcome",
    "PlaceSpeeds",
    "PlanarArm",
    "PlanarReach",
    "Pose",
    "PrincipalMasses",
    "Provenance",
    "Quality",
    "RankDeficient",
    "RatioAt",
    "Reach",
    "ReachOutcome",
    "Recording",
    "RecordingError",
    "RecordingResult",
    "RefusedForm",
    "Repeatability",
    "Robot",
    "RobotTable",
    "SafeSpeed",
    "Segments",
    "SelectionStability",
    "SelectionStep",
    "SpeedMap",
    "SpeedOutcome",
    "StandardExpectation",
    "StateCheck",
    "StateContact",
    "StateResult",
    "StateTolerance",
    "States",
    "Stop",
    "Task",
    "TaskPlaces",
    "TaskSegment",
    "Term",
    "TermSelection",
    "TermSignificance",
    "TermSurvival",
    "TimeLaw",
    "ToleranceBound",
    "TooFewStates",
    "ToolPath",
    "Trend",
    "Use",
    "Verdict",
    "VerdictOutcome",
    "Wrist",
    "ZoneSpeeds",
    "Zones",
    "__version__",
    "assess",
    "assess_campaign",
    "body_region",
    "build_dataset",
    "campaign_inputs",
    "campaign_limit_table",
    "campaign_summary",
    "campaign_text",
    "censoring_effect",
    "check_impact",
    "check_map",
    "classify_contact",
    "compare_effective_mass",
    "compare_force_models",
    "compare_forms",
    "compare_maps",
    "confirm_plan",
    "copy_example",
    "cover_estimate",
    "device_suitability",
    "direction_vector",
    "effective_mass",
    "extend_plan",
    "find_impact",
    "find_impacts",
    "fit_force_map",
    "floor_speed",
    "force_limit",
    "force_map_accuracy",
    "form_named",
    "forward_kinematics",
    "identified_drive_inertia",
    "inverse_kinematics",
    "jacobian",
    "krl_data",
    "krl_source",
    "leave_one_state_out",
    "many_safe_speeds",
    "map_accuracy",
    "map_sha256",
    "map_text",
    "margins",
    "mass_matrix",
    "mean_effective_mass",
    "measured_grid",
    "next_measurements",
    "no_impact",
    "one_segment_task",
    "optimal_states",
    "path_speeds",
    "payload_estimate",
    "pfl_contact_force",
    "pfl_energy",
    "pfl_governing_speed_limit",
    "pfl_pressure_speed_limit",
    "pfl_robot_mass",
    "pfl_speed_limit",
    "place_task",
    "places_in_plane",
    "plan_measurements",
    "planar_contact_point",
    "planar_effective_mass_at",
    "planar_inverse_kinematics",
    "planar_jacobian",
    "planar_mass_map",
    "planar_mass_matrix",
    "principal_effective_masses",
    "provenance",
    "published_map",
    "raised_off_axis",
    "read_campaign",
    "read_campaign_file",
    "read_conditions",
    "read_dataset",
    "read_limit_table",
    "read_map",
    "read_path",
    "read_plan",
    "read_recording",
    "read_recordings",
    "read_task",
    "read_urdf",
    "repeatability",
    "robot_effective_mass",
    "robot_effective_mass_at",
    "robot_mass_map",
    "robot_named",
    "robot_table",
    "run_sheet",
    "safe_speed",
    "safety_proposal",
    "saturation_doubt",
    "scaling_csv",
    "scaling_result",
    "select_terms",
    "selection_stability",
    "speed_map",
    "speed_map_csv",
    "speed_map_places",
    "standard_effective_mass",
    "standard_limit_table",
    "table_positions",
    "time_law",
    "urscript",
    "write_dataset",
    "write_map",
    "write_plan",
    "zone_grid",
    "zone_speeds",
    "zones_csv",
    "zones_result",
]
