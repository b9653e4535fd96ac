"""The public names and where they are defined: each is loaded when it is first used."""

from ._version import __version__ as __version__
from .assessment.assess_campaign import CampaignAssessment as CampaignAssessment, assess_campaign as assess_campaign
from .campaigns.build import build_dataset as build_dataset, collect_campaign as collect_campaign
from .campaigns.campaign import Campaign as Campaign, read_campaign as read_campaign
from .campaigns.conditions import Conditions as Conditions, read_conditions as read_conditions
from .campaigns.dataset import ImpactDataset as ImpactDataset, StateTolerance as StateTolerance
from .campaigns.examples import EXAMPLE_CAMPAIGNS as EXAMPLE_CAMPAIGNS, copy_example as copy_example
from .campaigns.impacts_table import read_dataset as read_dataset, write_dataset as write_dataset
from .campaigns.plan import MeasurementPlan as MeasurementPlan, read_plan as read_plan, write_plan as write_plan
from .campaigns.repeatability import repeatability as repeatability
from .campaigns.summary import campaign_summary as campaign_summary
from .comparisons.effective_mass import compare_effective_mass as compare_effective_mass
from .comparisons.force_models import Comparison as Comparison, compare_force_models as compare_force_models
from .comparisons.forms import compare_forms as compare_forms
from .comparisons.map_check import MapOutcome as MapOutcome, check_map as check_map
from .comparisons.selection import select_terms as select_terms
from .comparisons.two_maps import compare_maps as compare_maps
from .dynamics.effective_mass import DriveInertia as DriveInertia, effective_mass as effective_mass
from .dynamics.mass_map import robot_effective_mass_at as robot_effective_mass_at
from .dynamics.robot import Robot as Robot
from .dynamics.robots import robot_named as robot_named
from .dynamics.urdf import read_urdf as read_urdf
from .errors import (
    BoundNotAvailable as BoundNotAvailable,
    ContactNotPermitted as ContactNotPermitted,
    FitError as FitError,
    ForcemapError as ForcemapError,
    InputError as InputError,
    NotReleasable as NotReleasable,
    RankDeficient as RankDeficient,
    RecordingError as RecordingError,
    TooFewStates as TooFewStates,
    TransferRefused as TransferRefused,
)
from .exports.robot_table import robot_table as robot_table
from .findings import Finding as Finding, FindingKind as FindingKind
from .impacts.detect import find_impact as find_impact, find_impacts as find_impacts
from .impacts.impact import Impact as Impact, Quality as Quality
from .impacts.phases import classify_contact as classify_contact
from .impacts.scenario import ContactScenario as ContactScenario
from .limits.body_areas import (
    LimitTable as LimitTable,
    body_region as body_region,
    read_limit_table as read_limit_table,
    standard_limit_table as standard_limit_table,
)
from .limits.force_limits import (
    Contact as Contact,
    ForceLimit as ForceLimit,
    NewtonLimit as NewtonLimit,
    force_limit as force_limit,
)
from .limits.pfl import (
    pfl_contact_force as pfl_contact_force,
    pfl_governing_speed_limit as pfl_governing_speed_limit,
    pfl_robot_mass as pfl_robot_mass,
    pfl_speed_limit as pfl_speed_limit,
)
from .maps.accuracy import (
    Accuracy as Accuracy,
    force_map_accuracy as force_map_accuracy,
    leave_one_place_out as leave_one_place_out,
    leave_one_state_out as leave_one_state_out,
    map_accuracy as map_accuracy,
)
from .maps.bounds import FixedMargin as FixedMargin, ToleranceBound as ToleranceBound
from .maps.carry_over import transfer_map as transfer_map
from .maps.fit import CensoredImpacts as CensoredImpacts, fit_force_map as fit_force_map
from .maps.force_map import ForceMap as ForceMap
from .maps.forms import (
    CFM_2D as CFM_2D,
    CFM_3D as CFM_3D,
    FULL_CUBIC as FULL_CUBIC,
    LOG_SPEED as LOG_SPEED,
    Form as Form,
    form_named as form_named,
)
from .maps.map_file import map_sha256 as map_sha256, read_map as read_map, write_map as write_map
from .maps.published import PUBLISHED_MAPS as PUBLISHED_MAPS, published_map as published_map
from .paths.atlas import read_atlas as read_atlas
from .paths.path_file import read_path as read_path
from .paths.path_speeds import PathSpeeds as PathSpeeds, path_speeds as path_speeds
from .paths.table_positions import place_task as place_task
from .paths.task import Task as Task, TaskSegment as TaskSegment, read_task as read_task
from .paths.tool_path import ToolPath as ToolPath
from .planning.confirm import confirm_plan as confirm_plan
from .planning.design import Design as Design
from .planning.expectation import StandardExpectation as StandardExpectation
from .planning.measurements import plan_measurements as plan_measurements
from .planning.next.measurements import NextMeasurements as NextMeasurements, next_measurements as next_measurements
from .recordings.column_map import ColumnMap as ColumnMap
from .recordings.device import Device as Device
from .recordings.read import read_recording as read_recording, read_recordings as read_recordings
from .recordings.recording import Recording as Recording
from .speeds.allowance import Allowance as Allowance
from .speeds.safe_speed import (
    SafeSpeed as SafeSpeed,
    SpeedOutcome as SpeedOutcome,
    floor_speed as floor_speed,
    safe_speed as safe_speed,
)
from .speeds.speed_map import SpeedMap as SpeedMap, measured_grid as measured_grid, speed_map as speed_map
from .speeds.zone_speeds import zone_speeds as zone_speeds
from .speeds.zones import Zones as Zones, zone_grid as zone_grid
from .verdicts.recording_results import check_campaign as check_campaign, check_file as check_file
from .verdicts.verdict import (
    Interpretation as Interpretation,
    Verdict as Verdict,
    VerdictOutcome as VerdictOutcome,
    check_impact as check_impact,
)
from .words import sentence as sentence
