"""forcemap: from measured impacts to a bounded collision-force map and safe robot speeds."""

from forcemap._version import __version__
from forcemap.assessment import Assessment, assess, map_accuracy
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.dataset import ImpactDataset, PhaseTwo, States, StateTolerance
from forcemap.campaigns.examples import EXAMPLE_CAMPAIGNS, copy_example
from forcemap.campaigns.impacts_table import read_dataset, write_dataset
from forcemap.comparisons import Comparison, compare_force_models
from forcemap.errors import (
    BoundNotAvailable,
    ContactNotPermitted,
    FitError,
    ForcemapError,
    InputError,
    RankDeficient,
    TooFewStates,
)
from forcemap.exports.speed_table import speed_map_csv, speed_map_places
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
from forcemap.maps.fit import fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_2D, CFM_3D, FULL_CUBIC, LOG_SPEED, Form, form_named
from forcemap.maps.map_file import map_sha256, map_text, read_map, write_map
from forcemap.maps.published import PUBLISHED_MAPS, published_map
from forcemap.maps.terms import Term
from forcemap.recordings.device import Device
from forcemap.speed_maps import SpeedMap, measured_grid, speed_map
from forcemap.speeds import SafeSpeed, SpeedOutcome, floor_speed, safe_speed

__all__ = [
    "CFM_2D",
    "CFM_3D",
    "EXAMPLE_CAMPAIGNS",
    "FULL_CUBIC",
    "LOG_SPEED",
    "PUBLISHED_MAPS",
    "Accuracy",
    "Assessment",
    "Bound",
    "BoundNotAvailable",
    "Comparison",
    "Conditions",
    "Contact",
    "ContactNotPermitted",
    "ContactScenario",
    "Device",
    "FitError",
    "FixedMargin",
    "ForceLimit",
    "ForceMap",
    "ForcemapError",
    "Form",
    "ImpactDataset",
    "InputError",
    "LimitTable",
    "PhaseTwo",
    "RankDeficient",
    "SafeSpeed",
    "SpeedMap",
    "SpeedOutcome",
    "StateTolerance",
    "States",
    "Term",
    "ToleranceBound",
    "TooFewStates",
    "__version__",
    "assess",
    "body_region",
    "compare_force_models",
    "copy_example",
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
    "pfl_contact_force",
    "pfl_energy",
    "pfl_governing_speed_limit",
    "pfl_pressure_speed_limit",
    "pfl_robot_mass",
    "pfl_speed_limit",
    "published_map",
    "read_dataset",
    "read_limit_table",
    "read_map",
    "safe_speed",
    "speed_map",
    "speed_map_csv",
    "speed_map_places",
    "standard_limit_table",
    "write_dataset",
    "write_map",
]
