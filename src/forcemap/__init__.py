"""forcemap: from measured impacts to a bounded collision-force map and safe robot speeds."""

from forcemap._version import __version__
from forcemap.assessment.assess_campaign import CampaignAssessment, assess_campaign
from forcemap.assessment.folder import campaign_limit_table
from forcemap.assessment.missing import Missing, present
from forcemap.assessment.place_speeds import PlaceSpeeds
from forcemap.campaigns.binding import BindingState
from forcemap.campaigns.build import build_dataset, collect_campaign
from forcemap.campaigns.campaign import Campaign, read_campaign
from forcemap.campaigns.conditions import Conditions, read_campaign_file, read_conditions
from forcemap.campaigns.dataset import ImpactDataset, StateTolerance
from forcemap.campaigns.examples import EXAMPLE_CAMPAIGNS, copy_example
from forcemap.campaigns.impacts_table import read_dataset, write_dataset
from forcemap.campaigns.plan import MeasurementPlan, read_plan, write_plan
from forcemap.campaigns.recordings_table import Entry, Use
from forcemap.campaigns.repeatability import repeatability
from forcemap.campaigns.run_order import RecordingOrder, RunProposal, assign_runs, propose_runs
from forcemap.campaigns.summary import campaign_summary
from forcemap.campaigns.template import campaign_text
from forcemap.campaigns.walk import RecordedImpacts, recorded_impacts
from forcemap.comparisons.censoring_effect import censoring_effect
from forcemap.comparisons.contact_model import ContactModel, contact_model
from forcemap.comparisons.effective_mass import MassComparison, compare_effective_mass
from forcemap.comparisons.force_models import Comparison, compare_force_models
from forcemap.comparisons.forms import (
    EUCLIDEAN_2D,
    compare_forms,
)
from forcemap.comparisons.map_check import MapOutcome, check_map
from forcemap.comparisons.selection import (
    select_terms,
    selection_stability,
)
from forcemap.comparisons.two_maps import compare_maps
from forcemap.dynamics.effective_mass import (
    DriveInertia,
    EffectiveMass,
    MassOutcome,
    effective_mass,
    standard_effective_mass,
)
from forcemap.dynamics.inverse_kinematics import DOWN, inverse_kinematics, places_in_plane
from forcemap.dynamics.kinematics import forward_kinematics, jacobian, mass_matrix
from forcemap.dynamics.mass_map import (
    planar_effective_mass_at,
    planar_mass_map,
    robot_effective_mass,
    robot_effective_mass_at,
    robot_mass_in_posture,
    robot_mass_map,
)
from forcemap.dynamics.planar_arm import (
    INSPECTION_DISTANCES,
    INSPECTION_HEIGHTS,
    LINK_ALIGNED,
    LINK_DOWN,
    LINK_HORIZONTAL,
    Elbow,
    LinkMass,
    PlanarArm,
    Wrist,
    planar_contact_point,
    planar_inverse_kinematics,
    planar_jacobian,
    planar_mass_matrix,
)
from forcemap.dynamics.robot import Robot
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
from forcemap.exports.robot_table import Provenance, RobotTable, robot_table
from forcemap.exports.run_sheet import run_sheet
from forcemap.exports.safety_proposal import safety_proposal
from forcemap.exports.scaling import scaling_csv, scaling_result
from forcemap.exports.speed_table import speed_map_csv
from forcemap.exports.urscript import urscript
from forcemap.exports.zones import zones_csv, zones_result
from forcemap.findings import Finding, FindingKind
from forcemap.impacts.detect import find_impact, find_impacts
from forcemap.impacts.impact import Impact, Quality
from forcemap.impacts.phases import classify_contact
from forcemap.impacts.scenario import ContactScenario
from forcemap.limits.body_areas import LimitTable, body_region, read_limit_table, standard_limit_table
from forcemap.limits.covers import cover_estimate, payload_estimate
from forcemap.limits.device_spring import device_suitability
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit, force_limit
from forcemap.limits.pfl import (
    pfl_contact_force,
    pfl_energy,
    pfl_governing_speed_limit,
    pfl_pressure_speed_limit,
    pfl_robot_mass,
    pfl_speed_limit,
)
from forcemap.maps.accuracy import Accuracy, force_map_accuracy, leave_one_place_out, leave_one_state_out, map_accuracy
from forcemap.maps.bounds import Bound, FixedMargin, ToleranceBound, margins
from forcemap.maps.direction import WIDEST_ANGLE, raised_off_axis
from forcemap.maps.fit import CensoredImpacts, fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_2D, CFM_3D, FULL_CUBIC, LOG_SPEED, Form, Term, form_named
from forcemap.maps.map_file import map_sha256, map_text, read_map, write_map
from forcemap.maps.published import PUBLISHED_MAPS, published_map
from forcemap.paths.path_file import read_path
from forcemap.paths.path_speeds import PathSpeeds, PieceOutcome, path_speeds
from forcemap.paths.table_positions import place_task, table_positions
from forcemap.paths.task import Task, TaskSegment, one_segment_task, read_task
from forcemap.paths.time_law import time_law
from forcemap.paths.tool_path import ToolPath
from forcemap.planning.confirm import ConfirmationPlan, ConfirmationResult, Confirmed, confirm_plan
from forcemap.planning.design import Design
from forcemap.planning.expectation import StandardExpectation
from forcemap.planning.measurements import DesignedPlan, plan_measurements
from forcemap.planning.next.measurements import NextMeasurements, Stop, next_measurements
from forcemap.planning.optimal_states import optimal_states
from forcemap.planning.runs import extend_plan
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.device import Device
from forcemap.recordings.read import read_recording, read_recordings
from forcemap.recordings.recording import Recording
from forcemap.speeds.allowance import Allowance
from forcemap.speeds.basis import Basis
from forcemap.speeds.safe_speed import SafeSpeed, SpeedOutcome, floor_speed, safe_speed
from forcemap.speeds.speed_map import SpeedMap, measured_grid, speed_map
from forcemap.speeds.zone_speeds import zone_speeds
from forcemap.speeds.zones import Segments, Zones, zone_grid
from forcemap.verdicts.recording_results import (
    check_campaign,
    check_file,
    recording_doubt,
)
from forcemap.verdicts.verdict import Interpretation, Verdict, VerdictOutcome, check_impact
from forcemap.words import sentence

__all__ = [
    "CFM_2D", "CFM_3D", "DOWN", "EUCLIDEAN_2D", "EXAMPLE_CAMPAIGNS", "FULL_CUBIC", "INSPECTION_DISTANCES",
    "INSPECTION_HEIGHTS", "LINK_ALIGNED", "LINK_DOWN", "LINK_HORIZONTAL", "LOG_SPEED", "PUBLISHED_MAPS", "ROBOTS",
    "WIDEST_ANGLE", "Accuracy", "Allowance", "Basis", "BindingState", "Bound", "BoundNotAvailable", "Campaign",
    "CampaignAssessment", "CensoredImpacts", "ColumnMap", "Comparison", "Conditions", "ConfirmationPlan",
    "ConfirmationResult", "Confirmed", "Contact", "ContactModel", "ContactNotPermitted", "ContactScenario", "Design",
    "DesignedPlan", "Device", "DriveInertia", "EffectiveMass", "Elbow", "Entry", "Finding", "FindingKind", "FitError",
    "FixedMargin", "ForceLimit", "ForceMap", "ForcemapError", "Form", "Impact", "ImpactDataset", "InputError",
    "Interpretation", "LimitTable", "LinkMass", "MapOutcome", "MassComparison", "MassOutcome", "MeasurementPlan",
    "Missing", "NewtonLimit", "NextMeasurements", "NotReleasable", "PathSpeeds", "PieceOutcome", "PlaceSpeeds",
    "PlanarArm", "Provenance", "Quality", "RankDeficient", "RecordedImpacts", "Recording", "RecordingError",
    "RecordingOrder", "Robot", "RobotTable", "RunProposal", "SafeSpeed", "Segments", "SpeedMap", "SpeedOutcome",
    "StandardExpectation", "StateTolerance", "Stop", "Task", "TaskSegment", "Term", "ToleranceBound", "TooFewStates",
    "ToolPath", "Use", "Verdict", "VerdictOutcome", "Wrist", "Zones", "__version__", "assess_campaign", "assign_runs",
    "body_region", "build_dataset", "campaign_limit_table", "campaign_summary", "campaign_text", "censoring_effect",
    "check_campaign", "check_file", "check_impact", "check_map", "classify_contact", "collect_campaign",
    "compare_effective_mass", "compare_force_models", "compare_forms", "compare_maps", "confirm_plan", "contact_model",
    "copy_example", "cover_estimate", "device_suitability", "effective_mass", "extend_plan", "find_impact",
    "find_impacts", "fit_force_map", "floor_speed", "force_limit", "force_map_accuracy", "form_named",
    "forward_kinematics", "identified_drive_inertia", "inverse_kinematics", "jacobian", "krl_data", "krl_source",
    "leave_one_place_out", "leave_one_state_out", "map_accuracy", "map_sha256", "map_text", "margins", "mass_matrix",
    "measured_grid",
    "next_measurements", "one_segment_task", "optimal_states", "path_speeds", "payload_estimate", "pfl_contact_force",
    "pfl_energy", "pfl_governing_speed_limit", "pfl_pressure_speed_limit", "pfl_robot_mass", "pfl_speed_limit",
    "place_task", "places_in_plane", "plan_measurements", "planar_contact_point", "planar_effective_mass_at",
    "planar_inverse_kinematics", "planar_jacobian", "planar_mass_map", "planar_mass_matrix", "present", "propose_runs",
    "published_map", "raised_off_axis", "read_campaign", "read_campaign_file", "read_conditions", "read_dataset",
    "read_limit_table", "read_map", "read_path", "read_plan", "read_recording", "read_recordings", "read_task",
    "read_urdf", "recorded_impacts", "recording_doubt", "repeatability", "robot_effective_mass",
    "robot_effective_mass_at",
    "robot_mass_in_posture", "robot_mass_map", "robot_named", "robot_table", "run_sheet", "safe_speed",
    "safety_proposal", "scaling_csv", "scaling_result", "select_terms", "selection_stability", "sentence", "speed_map",
    "speed_map_csv", "standard_effective_mass", "standard_limit_table", "table_positions", "time_law", "urscript",
    "write_dataset", "write_map", "write_plan", "zone_grid", "zone_speeds", "zones_csv", "zones_result",
]  # fmt: skip
