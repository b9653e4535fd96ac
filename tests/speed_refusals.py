"""What the rooms of speeds, paths and exports refuse, and what they say to it: the whole sentence, with row and column.

tests/speed_refusals.csv holds the sentences. Whoever changes one on purpose writes the table anew
(`python tests/speed_refusals.py`) and looks at what changed.
"""

from __future__ import annotations

import csv
import functools
import math
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from oracle import training_grid

import forcemap as fm
from forcemap.campaigns.binding import NOT_BESIDE, Binding, BindingState
from forcemap.dynamics.robots import robot_named
from forcemap.dynamics.urdf import read_urdf
from forcemap.exports.scaling import scaling_csv
from forcemap.maps.measured_range import MeasuredRange
from forcemap.paths.table_positions import table_positions
from forcemap.paths.task import one_segment_task
from forcemap.paths.time_law import time_law
from forcemap.speeds.enclosures import Patches, enclose
from forcemap.speeds.zones import Segments

TABLE = Path(__file__).with_suffix(".csv")
HAND = ("back_of_hand",), fm.Contact.TRANSIENT
LIMIT = fm.force_limit("back_of_hand"), fm.Contact.TRANSIENT
MARGIN = fm.FixedMargin(0.10)
PRESS = [[0.8, 0.0, 0.44], [0.8, 0.0, 0.3]]
FULL_TURNS = 4 * math.pi

# Files of paths, each with the robot that it is read for.
TABLES = {
    "": None,
    "x_m,y_m,z_m\n0.8,0,0.4\n": None,
    "x_m,y_m,z_m\n0.8,0,0.4\n0.8,0,0.4\n0.7,0,0.4\n": None,
    "x_m,y_m,z_m\n0.8,0,0.4\n0.7,0,0.4\n0.7,0,0.4\n": None,
    "x_m,y_m,z_m\n0.8,0,0.4\n0.8,0,0.3\n0.8,,0.2\n": None,
    "x_m,y_m,z_m\n\n0.8,0,0.4\n0.8,0,nan\n": None,
    "x_m,y_m,z_m\n800,0,400\n800,0,300\n": None,
    "x_m,y_m,z_m\n0.8,0,0.4\n-10,10,-10\n": None,
    "x_m,y_m,z_m\n0.8,0,0.4\n-10.01,0,0.4\n": None,
    "\nnote,x_mm,y_mm,z_mm\n1,800,0,400\n2,800,0,300\n": None,
    "x_m,y_m,z_mm\n0.8,0,400\n0.8,0,300\n": None,
    "x_m,y_m,z_m,time_ms\n0.8,0,0.4,1\n0.8,0,0.3,2\n": None,
    "a,b,t,x_m,y_m,z_m\n1,2,3,0.8,0,0.4\n1,2,3,0.8,0,0.3\n": None,
    "x_m,y_m,z_m,note\n0.8,0,0.4,a\n0.8,0,0.3,b\n": None,
    "x_m,y_m,z_m,b,a\n0.8,0,0.4,a,c\n0.8,0,0.3,b,c\n": None,
    "x_m,y_m,z_m,distance_m,height_m\n0.8,0,0.4,0.8,0.4\n0.8,0,0.3,0.8,0.3\n": None,
    "x_m,y_m\n0.8,0\n0.8,1\n": None,
    "x_m,y_m,note\n0.8,0,a\n0.8,1,b\n": None,
    "a,b\n1,2\n3,4\n": None,
    "\ntime_s,segment\n1,a\n2,b\n": None,
    "time_s,x_m,y_m,z_m\n1,0.8,0,0.4\n1,0.8,0,0.3\n": None,
    "time_s,x_m,y_m,z_m\n1,0.8,0,0.4\n2,0.8,0,0.4\n": None,
    "time_s,x_m,y_m,z_m\n1,0.8,0,0.4\n,0.8,0,0.3\n": None,
    "x_m,y_m,z_m,speed_mps\n0.8,0,0.4,0.2\n0.8,0,0.3,0\n": None,
    "x_m,y_m,z_m,speed_mps\n0.8,0,0.4,-0.2\n0.8,0,0.3,0.2\n": None,
    "x_m,y_m,z_m,speed_mps\n0.8,0,0.4,\n0.8,0,0.3,10.01\n": None,
    "x_m,y_m,z_m,speed_mps\n0.8,0,0.4,1e999\n0.8,0,0.3,0.2\n": None,
    "distance_m,height_m,speed_mps\n0.8,0.4,v100\n0.8,0.3,0.2\n": None,
    "joint_1_rad,joint_2_rad,speed_mps\n0.1,0.1,0.2\n0.1,0.2,250\n": "slides",
    "time_s,x_m,y_m,z_m,speed_mps\n0,0.8,0,0.4,0.2\n1,0.8,0,0.3,0.2\n": None,
    "x_m,y_m,z_m,speed_mmps\n0.8,0,0.4,200\n0.8,0,0.3,200\n": None,
    "x_m,y_m,z_m,v\n0.8,0,0.4,0.2\n0.8,0,0.3,0.2\n": None,
    "segment,x_m,y_m,z_m\n,0.8,0,0.4\n,0.8,0,0.3\n": None,
    "segment,x_m,y_m,z_m\na,0.8,0,0.4\n\n,0.8,0,0.3\na,0.8,0,0.2\n": None,
    "segment,x_m,y_m,z_m\na,0.8,0,0.4\n,0.8,0,0.3\n": None,
    "distance_m,height_m\n0.8,0.4\n-0.1,0.3\n": None,
    "distance_m,height_m\n0.8,0.4\n0,0.3\n": None,
    "distance_m,height_m,time_s\n0.8,0.4,0\n0.8,0.3,0\n": None,
    "joint_1_rad,joint_2_deg\n1,2\n3,4\n": None,
    "joint_1_rad,joint_2_deg,joint_3_deg,joint_4_deg,joint_5_deg,joint_6_deg\n0,0,0,0,0,0\n1,1,1,1,1,1\n": "ur10e",
    "joint_0_rad,joint_1_rad,joint_2_rad,joint_3_rad,joint_4_rad,joint_5_rad\n0,0,0,0,0,0\n1,1,1,1,1,1\n": "ur10e",
    "joint_1_rad\n0\n1\n": "ur10e",
    "joint_1_rad,joint_2_mm\n0,0\n1,1\n": "ur10e",
    "carriage,1\n": "slides",
    **dict.fromkeys(("x\n1\n2\n", "y_cm\n1\n2\n", "z_in\n1\n2\n", "distance_inch\n1\n2\n", "height_mm\n1\n2\n")),
    **dict.fromkeys(
        ("time\n1\n2\n", "time_min\n1\n2\n", "t_ms\n1\n2\n", "t_mm\n1\n2\n", "xy_mm\n1\n2\n", "x_ft\n1\n2\n")
    ),
}

SLIDES = """<robot name="slides"><link name="base"/><link name="carriage"/>
  <link name="quill"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    </link>
  <joint name="rail" type="prismatic"><parent link="base"/><child link="carriage"/><origin xyz="0.1 0.2 0.3"/>
    <axis xyz="1 0 0"/><limit lower="-1.5" upper="1.25" effort="1" velocity="1"/></joint>
  <joint name="turn" type="revolute"><parent link="carriage"/><child link="quill"/><origin xyz="0.4 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-12.5" upper="12.5" effort="1" velocity="1"/></joint>
</robot>"""

# Joints of the robot above: [m], [rad].
JOINTS = {
    "in radians": [[0.1, FULL_TURNS], [0.2, -FULL_TURNS]],
    "in degrees": [[0.1, 0.0], [0.2, math.nextafter(FULL_TURNS, 20)]],
    "in degrees, downwards": [[0.1, 0.0], [0.2, -12.6]],
    "at its ends": [[-1.5 - 1e-6, 0.0], [1.25 + 1e-6, 0.0]],
    "below": [[0.1, 0.0], [0.2, 0.0], [-1.5 - 1.1e-6, 0.0]],
    "above": [[0.1, 0.0], [0.2, 0.0], [0.3, 1.0], [1.25 + 1.1e-6, 0.0]],
    "standing": [[0.1, 0.0], [0.1, 0.0]],
}

# Entries of a task file: what replaces a line of TASK.
TASK = """schema = "forcemap-task/1"
acceleration_mps2 = 2
[campaign]
direction = "down"
tool = "none"
[[segments]]
name = "press"
areas = ["back_of_hand", "palm"]
clamping_possible = false
speed_mps = 0.25
[[segments]]
name = "lift"
contact_possible = false
speed_mps = 0.5
"""
ENTRIES = [
    ("", ""),
    ('schema = "forcemap-task/1"\n', ""),
    ("forcemap-task/1", "forcemap-task/2"),
    ('schema = "', "schema = "),
    ("acceleration_mps2", "acceleration"),
    ("acceleration_mps2", "campain"),
    ("mps2 = 2", "mps2 = 0"),
    ("mps2 = 2", "mps2 = -1"),
    ("mps2 = 2", "mps2 = inf"),
    ("mps2 = 2", "mps2 = nan"),
    ("mps2 = 2", "mps2 = true"),
    ("mps2 = 2", 'mps2 = "2"'),
    ("tool = ", "tol = "),
    ('tool = "none"', "tool = 3"),
    ('tool = "none"', 'tool = ""'),
    ('[campaign]\ndirection = "down"\ntool = "none"', "campaign = 3"),
    ('[campaign]\ndirection = "down"\ntool = "none"', 'campaign = "down"'),
    (TASK[TASK.index("[[") :], ""),
    (TASK[TASK.index("[c") :], "segments = []"),
    (TASK[TASK.index("[c") :], "segments = 3"),
    (TASK[TASK.index("[c") :], "segments = {a = 3}"),
    (TASK[TASK.index("[c") :], "segments = [{name = 'a'}, 3]"),
    ('name = "press"\n', ""),
    ('name = "press"', 'name = ""'),
    ('name = "press"', "name = 3"),
    ('name = "press"', "nam = 3"),
    ('name = "lift"', 'nme = "lift"'),
    ('name = "lift"', 'name = "press"'),
    ('areas = ["back_of_hand", "palm"]', "areas = []"),
    ('areas = ["back_of_hand", "palm"]', ""),
    ('areas = ["back_of_hand", "palm"]', 'areas = "palm"'),
    ('areas = ["back_of_hand", "palm"]', 'areas = ["palm", 3]'),
    ('"palm"', '"plam"'),
    ("clamping_possible = false\n", ""),
    ("clamping_possible = false", "clamping_possible = 0"),
    ("clamping_possible = false", 'clamping_possible = true\ncontact = "transient"'),
    ("clamping_possible = false", 'clamping_possible = true\ncontact = "quasi-static"'),
    ("clamping_possible = false", 'clamping_possible = false\ncontact = "quasi-static"'),
    ("clamping_possible = false", 'clamping_possible = false\ncontact = "gentle"'),
    ("clamping_possible = false", "clamping_possible = false\ncontact = 3"),
    ("contact_possible = false", "contact_possible = 0"),
    ("contact_possible = false", "contact_possible = true"),
    ("contact_possible = false", 'contact_possible = false\nareas = ["palm"]'),
    ("contact_possible = false", 'contact_possible = false\ncontact = "transient"'),
    ("contact_possible = false", "contact_possible = false\nclamping_possible = false"),
    ("speed_mps = 0.5", ""),
    ("speed_mps = 0.25\n", ""),
    ("speed_mps = 0.5", "speed_mps = 0"),
    ("speed_mps = 0.25", "speed_mps = -0.25"),
    ("speed_mps = 0.25", "speed_mps = nan"),
    ("speed_mps = 0.25", "speed_mps = true"),
    ("speed_mps = 0.25", 'speed_mps = "0.25"'),
    ("speed_mps = 0.25", "speed_mps = 1"),
]


@functools.cache
def ur10e():
    return fm.published_map("ur10e")


@functools.cache
def fitted(*, scenario="unconstrained", phase2=None, device_range=500.0, error=3.0, stiffness=75e3):
    """A map of 27 states whose largest force is 256 N."""
    points = training_grid("kuka-iiwa7-10nm")
    force = fm.published_map("kuka-iiwa7-10nm").predict(*points.T)
    device = fm.Device(range=device_range, error=error, stiffness=stiffness)
    named = dict(zip(("distance", "height", "speed"), points.T, strict=True))
    kind = None if scenario is None else [scenario, *["unconstrained"] * 26]
    held = None if phase2 is None else [phase2, *[0.0] * 26]
    conditions = fm.Conditions(device=device, direction="down")
    force = np.round(force * 256 / force.max(), 6)
    dataset = fm.ImpactDataset.from_arrays(
        **named, peak_force=force, scenario=kind, phase2_force=held, conditions=conditions
    )
    return fm.fit_force_map(dataset)


def broken():
    """The same, were its impacts table not what its recordings gave."""
    return replace(fitted(), binding=Binding(BindingState.BROKEN))


def path(points=PRESS, names=None, **more):
    points = np.array(points, dtype=float)
    return fm.ToolPath(points, names or ("path",) * (len(points) - 1), **more)


def timed(points, time):
    return fm.ToolPath.timed(np.array(points, dtype=float), ("a",) * len(points), np.array(time, dtype=float))


def driven(force_map=None, task=None, way=None, **more):
    given = {"bound": MARGIN} | more
    return fm.path_speeds(force_map or ur10e(), way or path(), task or one_segment_task("path", *HAND), **given)


def named(*names, conditions=None, source="tasks/press.toml"):
    segments = tuple(fm.TaskSegment(name, *HAND) for name in names)
    return fm.Task(segments, conditions=conditions or {}, source=source)


def speed(force_map=None, limit=100.0, **more):
    """A speed at a place; what is given instead of a limit in newtons may stand beside it."""
    return fm.safe_speed(force_map or fitted(), 0.7, 0.3, limit=limit, **({"bound": MARGIN} | more))


def table(**more):
    return fm.robot_table(ur10e(), **({"limits": [LIMIT], "bound": MARGIN, "date": "2026-11-21"} | more))


def scaled(**more):
    speeds = driven(task=one_segment_task("path", *HAND, **more))
    return scaling_csv(speeds, table().provenance.of_path(speeds))


class Guess(fm.FixedMargin):
    pass


ZONE = fm.Zones(0.7, 0.75, 0.3, 0.35)
QUASI_STATIC, TRANSIENT = fm.Contact.QUASI_STATIC, fm.Contact.TRANSIENT
BEFORE_MARGIN = {"limit": 280.0, "contact": QUASI_STATIC}
CLAMPS = "constrained with clamping"
DIRECTED = ("down", "Downwards ", "-z", "0, 0, -1", "", "up", "forward")

CALLS = {
    "paths": {
        "no point": lambda: path(np.zeros((0, 3))),
        "one point": lambda: path([[0.8, 0, 0.4]]),
        "points in a plane": lambda: path([[0.8, 0], [0.7, 0]]),
        "a point": lambda: path([0.8, 0, 0.4]),
        "a coordinate without end": lambda: path([[0.8, 0, 0.4], [0.8, math.inf, 0.3]]),
        "10 m": lambda: path([[10, 0, 0], [0, 0, -10]]),
        "more than 10 m": lambda: path([[10, 0, 0], [0, 0, -10.25]]),
        "the same place first": lambda: path([[0.8, 0, 0.4], [0.8, 0, 0.4], [0.8, 0, 0.2], [0.8, 0, 0.2]]),
        "the same place later": lambda: path([[0.8, 0, 0.4], [0.8, 0, 0.3], [0.8, 0, 0.2], [0.8, 0, 0.2]]),
        "a micrometre apart": lambda: path([[0.0, 0, 0.0], [0.0, 0, 1e-6]]),
        "less than a micrometre apart": lambda: path([[0.0, 0, 0.0], [0.0, 0, 0.99e-6]]),
        "a name too many": lambda: path(names=("a", "b")),
        "a name too few": lambda: path([*PRESS, [0.8, 0, 0.2]], names=("a",)),
        "a deviation below 0": lambda: path(deviation=-1e-9),
        "a deviation without end": lambda: path(deviation=math.inf),
        "no deviation": lambda: path(deviation=0.0, turning=np.zeros(1)),
        "a turning below 0": lambda: path(turning=np.array([-1e-9])),
        "a turning without end": lambda: path(turning=np.array([math.inf])),
        "times that stand": lambda: path(time=np.array([1.0, 1.0])),
        "times that fall": lambda: path(time=np.array([1.0, 0.5])),
        "times without end": lambda: path(time=np.array([1.0, math.inf])),
        "a wait as long as the way": lambda: path(time=np.array([0.0, 1.0]), wait=np.array([1.0, 0.0])),
        "a wait shorter than the way": lambda: path(time=np.array([0.0, 1.0]), wait=np.array([0.9, 0.0])),
        "timed: one point": lambda: timed([[0.8, 0, 0.4]], [0.0]),
        "timed: a point without end": lambda: timed([[0.8, 0, 0.4], [0.8, 0, math.nan]], [0, 1]),
        "timed: a time without end": lambda: timed(PRESS, [0, math.inf]),
        "timed: times that stand": lambda: timed(PRESS, [1, 1]),
        "timed: nothing moves": lambda: timed([[0.8, 0, 0.4]] * 3, [0, 1, 2]),
        "timed: a micrometre": lambda: timed([[0.0, 0, 0.0], [0.0, 0, 1e-6]], [0, 1]),
        "timed: less": lambda: timed([[0.0, 0, 0.0], [0.0, 0, 0.99e-6]], [0, 1]),
        **{f"step {step}": functools.partial(path().resampled, step) for step in (0.0, -0.1, math.inf, math.nan)},
        "a million pieces": lambda: path([[5, 0, 0], [-5, 0, 0]]).resampled(1e-5),
        "more than a million pieces": lambda: path([[5, 0, 0], [-5.00001, 0, 0]]).resampled(1e-5),
    },
    "time laws": {
        "time law: two shapes": lambda: time_law([1.0, 2.0], [1.0], acceleration=1.0),
        "time law: a table": lambda: time_law([[1.0]], [[1.0]], acceleration=1.0),
        "time law: nothing": lambda: time_law([], [], acceleration=1.0),
        "time law: no length": lambda: time_law([1.0, 0.0], [1.0, 1.0], acceleration=1.0),
        "time law: no limit": lambda: time_law([1.0], [math.inf], acceleration=1.0),
        "time law: no acceleration": lambda: time_law([1.0], [1.0], acceleration=0.0),
    },
    "tasks": {
        "no segment": lambda: fm.Task(()),
        "a name twice": lambda: named("a", "b", "a"),
        "no acceleration": lambda: fm.Task(named("a").segments, 0.0),
        "an acceleration without end": lambda: fm.Task(named("a").segments, math.inf),
        "areas without contact": lambda: fm.TaskSegment("a", ("palm",), None, 0.1),
        "contact without areas": lambda: fm.TaskSegment("a", (), TRANSIENT, 0.1),
        "no speed": lambda: fm.TaskSegment("a", *HAND, 0.0),
        "a speed without end": lambda: fm.TaskSegment("a", *HAND, math.inf),
        "excluded, no speed": lambda: fm.TaskSegment("a", (), None),
        "a contact in words": lambda: fm.TaskSegment("a", ("palm",), "gentle"),
        "a segment of the path": lambda: driven(task=named("pathe", "lift", "press", "carry")),
        "a segment of the path, no file": lambda: driven(task=named("pathe", "lift", source="")),
        "a segment of the task": lambda: driven(task=named("path", "lift")),
        "both have the same": lambda: named("a", "b").require_segments(("a", "b", "a")),
        **{
            f"direction {d!r}": lambda d=d: named("a", conditions={"direction": d}).require_same(ur10e().conditions)
            for d in DIRECTED
        },
        "another tool": lambda: driven(task=named("path", conditions={"tool": "gripper"})),
        "another tool, no file": lambda: driven(task=named("path", conditions={"tool": "gripper"}, source="")),
        "another site": lambda: driven(fitted(), task=named("path", conditions={"contact_site": "flange"})),
        "the same tool": lambda: named("a", conditions={"tool": "  NONE"}).require_same(ur10e().conditions),
    },
    "driven": {
        "a campaign without direction": lambda: driven(
            replace(ur10e(), conditions=replace(ur10e().conditions, direction=""))
        ),
        "path: an angle below 0": lambda: driven(angle=-0.1),
        "path: an angle above 5": lambda: driven(angle=5.1),
        "path: no step": lambda: driven(step=0.0),
    },
    "positions": {
        **{
            f"positions {s}": functools.partial(table_positions, ur10e(), path(), s)
            for s in (0.0, -1, math.inf, math.nan)
        },
        "positions: one": lambda: table_positions(ur10e(), path(), 5.0),
        "positions: none": lambda: table_positions(ur10e(), path([[0.2, 0, 0.05], [0.2, 0, 0]]), 5.0),
        "positions: too many along an axis": lambda: table_positions(ur10e(), path(), 1e-5),
        "positions: too many of both": lambda: table_positions(ur10e(), path(), 0.001),
        "positions: 20 000": lambda: positions(1.9998),
        "positions: 20 001": lambda: positions(1.9999),
        "positions: 20 002 along an axis": lambda: positions(2.0),
        "positions: behind the base": lambda: table_positions(ur10e(), path([[2.0, 0, 0.4], [2.0, 0, 0.3]]), 0.01),
    },
    "allowances": {
        **{f"overshoot {x}": functools.partial(fm.Allowance, x) for x in (-0.01, math.inf, math.nan, 0.0)},
        **{f"tolerance {x}": functools.partial(fm.Allowance, 0.01, x) for x in (-0.01, math.inf, math.nan, 0.0)},
    },
    "zones": {
        "zone without end": lambda: fm.Zones(0.6, math.inf, 0.2, 0.3),
        "zone that is masked": lambda: fm.Zones(np.ma.array([0.6], mask=[True]), 0.7, 0.2, 0.3),
        "segment that is masked": lambda: Segments(np.ma.array([0.5, 0, 0.2], mask=[0, 1, 0]), [0.5, 0.0, 0.3]),
        "zones of a table": lambda: fm.Zones([[0.6]], 0.7, 0.2, 0.3),
        "no zone": lambda: fm.Zones([], [], [], []),
        "zone that ends early": lambda: fm.Zones([0.6, 0.7], [0.7, 0.6], 0.2, 0.3),
        "zone that ends below": lambda: fm.Zones([0.6, 0.7], [0.7, 0.8], 0.2, [0.3, 0.1]),
        "zone behind the axis": lambda: fm.Zones(-0.1, 0.7, 0.2, 0.3),
        "zone of one place": lambda: fm.Zones(0.0, 0.0, 0.2, 0.2),
        "100 000 zones": lambda: fm.zone_grid(box(1.0, 0.001), 0.0001),
        "100 001 zones": lambda: fm.zone_grid(box(0.9091, 0.0011), 0.0001),
        "segment in a plane": lambda: Segments([0.5, 0.0], [0.5, 0.1]),
        "no segment to drive": lambda: Segments(np.zeros((0, 3)), np.zeros((0, 3))),
        "segments in a table": lambda: Segments(np.zeros((1, 1, 3)), np.ones((1, 1, 3))),
        "segment without end": lambda: Segments([0.5, 0.0, math.inf], [0.5, 0.1, 0.2]),
        "two starts, one end": lambda: Segments([[0.5, 0.0, 0.1]] * 2, [[0.5, 0.1, 0.2]]),
        "segment without length": lambda: Segments([[0.5, 0.0, 0.1]] * 3, [[0.5, 0.1, 0.2]] * 2 + [[0.5, 0.0, 0.1]]),
        "segment of a nanometre": lambda: Segments([0.0, 0.0, 0.0], [0.0, 0.0, 1e-9]),
        **{
            f"zones of {x} m": functools.partial(fm.zone_grid, ur10e().measured_range, x)
            for x in (0.0, -0.1, math.inf, math.nan, 0.001)
        },
        "limits for other zones": lambda: fm.zone_speeds(ur10e(), ZONE, limit=[280.0, 270.0], bound=MARGIN),
        "a bound of another kind": lambda: enclose(
            ur10e(), Guess(), Patches.of_places(*np.ones((2, 1))), *np.ones((2, 1))
        ),
    },
    "speeds": {
        "place that is masked": lambda: fm.safe_speed(
            ur10e(), np.ma.array([0.7], mask=[True]), 0.3, **BEFORE_MARGIN, bound=MARGIN
        ),
        "height that is masked": lambda: fm.safe_speed(
            ur10e(), 0.7, np.ma.array([0.3], mask=[True]), **BEFORE_MARGIN, bound=MARGIN
        ),
        "distance without end": lambda: fm.safe_speed(ur10e(), math.inf, 0.3, **BEFORE_MARGIN, bound=MARGIN),
        "height that is none": lambda: fm.safe_speed(ur10e(), 0.7, math.nan, **BEFORE_MARGIN, bound=MARGIN),
        **{
            f"grid step {x}": functools.partial(fm.measured_grid, ur10e(), x)
            for x in (0.0, -0.1, math.inf, math.nan, 0.00034443835594, 0.00034443835612)
        },
        "a kind of bound": lambda: speed(bound=fm.FixedMargin),
        "a number for a bound": lambda: speed(bound=0.1),
        "a bound that the map cannot carry": lambda: speed(ur10e(), bound=fm.ToleranceBound()),
        "parts beside an area": lambda: speed(limit=LIMIT[0], contact=TRANSIENT, quasi_static_limit=100.0),
        "a spring beside an area": lambda: speed(limit=LIMIT[0], contact=TRANSIENT, spring_N_per_m=75e3),
        "an area without contact": lambda: speed(limit=LIMIT[0]),
        "an angle above 5": lambda: speed(angle=5.1),
        "a contact that is none": lambda: speed(contact="gentle"),
    },
    "newtons": {
        "newtons: Phase II not measured": lambda: speed(fitted(scenario=None)),
        "newtons: clamped": lambda: speed(fitted(scenario=CLAMPS)),
        "newtons: held half of the limit": lambda: speed(fitted(phase2=47.0)),
        "newtons: held more": lambda: speed(fitted(phase2=47.25)),
        "newtons: held more than half of the least": lambda: speed(fitted(phase2=47.25), limit=[110.0, 100.0]),
        "newtons: held less than half of the least": lambda: speed(fitted(phase2=47.25), limit=[110.0, 101.0]),
        "newtons: held, device's error not stated": lambda: speed(fitted(phase2=47.25, error=math.nan), limit=101.0),
        "newtons: transient, held": lambda: speed(fitted(phase2=10.0), contact=TRANSIENT),
        "newtons: transient with its part": lambda: speed(
            fitted(phase2=10.0), contact=TRANSIENT, quasi_static_limit=50.0
        ),
        "newtons: transient, nothing held": lambda: speed(fitted(), contact=TRANSIENT),
        "newtons: transient, unknown": lambda: speed(fitted(scenario=None), contact=TRANSIENT),
        "newtons: two quasi-static ones": lambda: speed(contact=QUASI_STATIC, quasi_static_limit=90.0),
        "newtons: the same twice": lambda: speed(contact=QUASI_STATIC, quasi_static_limit=100.0),
    },
    "device": {
        "all of the range": lambda: speed(limit=497.0, contact=QUASI_STATIC),
        "above the range": lambda: speed(limit=[490.0, 497.5], contact=QUASI_STATIC),
        "all that was measured": lambda: speed(fitted(device_range=math.nan), limit=253.0, contact=QUASI_STATIC),
        "above what was measured": lambda: speed(fitted(device_range=math.nan), limit=253.5, contact=QUASI_STATIC),
        "above the range, error not stated": lambda: speed(fitted(error=math.nan), limit=499.0, contact=QUASI_STATIC),
        "above the range, but refused": lambda: speed(
            fitted(stiffness=math.nan), 498.0, contact=QUASI_STATIC, spring_N_per_m=75e3
        ),
        "above what was measured, but refused": lambda: speed(
            fitted(stiffness=math.nan, device_range=math.nan), 498.0, contact=QUASI_STATIC, spring_N_per_m=75e3
        ),
        "above the range, but broken": lambda: speed(broken(), limit=498.0, contact=QUASI_STATIC),
        "no contact, but broken": lambda: speed(broken()),
        "above the range, unbound": lambda: speed(replace(fitted(), binding=NOT_BESIDE), 498.0, contact=QUASI_STATIC),
        "clamped, refused for its spring": lambda: speed(fitted(scenario=CLAMPS, stiffness=1e4), spring_N_per_m=75e3),
    },
    "exports": {
        "no limit": lambda: table(limits=[]),
        "no direction": lambda: fm.robot_table(
            replace(ur10e(), conditions=replace(ur10e().conditions, direction="up")), limits=[LIMIT], bound=MARGIN
        ),
        **{f"export zones of {x} m": lambda x=x: table(size=x) for x in (0.0, 0.00499, math.inf, math.nan)},
        "1000 zones": lambda: fm.robot_table(
            wide(5.0), limits=[LIMIT], bound=MARGIN, size=0.005, allowance=fm.Allowance(position=0.0)
        ),
        "1001 zones": lambda: fm.robot_table(
            wide(5.001), limits=[LIMIT], bound=MARGIN, size=0.005, allowance=fm.Allowance(position=0.0)
        ),
        "a millimetre left": lambda: table(allowance=fm.Allowance(position=0.1595)),
        "less than a millimetre left": lambda: table(allowance=fm.Allowance(position=0.1596)),
        "nothing left": lambda: table(allowance=fm.Allowance(position=0.2)),
        "a date": lambda: table(date="21.11.2026"),
        "a weak bound": lambda: table(bound=fm.FixedMargin(0.05)),
        "the device alone": lambda: table(limits=[LIMIT, (100.0, QUASI_STATIC)]),
        "no programmed speed": lambda: scaled(),
        "a programmed speed": lambda: scaled(speed=0.3),
    },
}


def wide(distance):
    """The published map, were it measured over more distances [m], at heights of a millimetre; no speed is asked of it.

    It clamps, so that nothing is searched.
    """
    points = training_grid("kuka-iiwa7-30nm")
    low, high = points.min(axis=0), points.max(axis=0)
    points = (points - low) / (high - low) * [distance, 0.001, 0.2] + [0.5, 0.2, 0.2]
    return replace(fm.published_map("kuka-iiwa7-30nm"), measured_range=MeasuredRange(points))


def box(distance, height):
    """A measured range of that extent [m]."""
    corners = [[0.0, 0.0, 0.2], [distance, 0.0, 0.3], [0.0, height, 0.4], [distance, height, 0.2]]
    return MeasuredRange(np.add(corners, [0.5, 0.20005, 0.0]))


def positions(distance):
    """Positions 0.1 mm apart, of a path as long as that, over a range of that extent [m] and one height."""
    force_map = replace(ur10e(), measured_range=box(distance, 0.0001))
    return table_positions(force_map, path([[0.0, 0.0, 0.0], [0.0001, 0.0, 0.0]]), 0.0001)


def said(call, folder):
    """What a call raises, in words; the file without its folder."""
    try:
        call()
    except fm.ForcemapError as error:
        words = str(error)
        return [type(error).__name__, words.replace(f"{folder}/", "") if folder else words]
    return ["accepted", ""]


GROUPS = ("files", "joints", "entries", *CALLS)


def refusals(group):
    """Name of each call of a group, kind of its error, and the sentence."""
    if group in CALLS:
        for name, call in CALLS[group].items():
            yield [f"{group}: {name}", *said(call, "")]
        return
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "path.csv"
        (file.parent / "slides.urdf").write_text(SLIDES)
        slides = read_urdf(file.parent / "slides.urdf")
        if group == "files":
            for text, robot in TABLES.items():
                file.write_text(text)
                on = None if robot is None else slides if robot == "slides" else robot_named(robot)
                yield [f"files: {text!r}", *said(functools.partial(fm.read_path, file, robot=on), folder)]
        elif group == "joints":
            for name, rows in JOINTS.items():
                file.write_text("joint_1_rad,joint_2_rad\n" + "\n".join(",".join(map(repr, row)) for row in rows))
                yield [f"joints: {name}", *said(functools.partial(fm.read_path, file, robot=slides), folder)]
        else:
            file = Path(folder) / "task.toml"
            for old, new in ENTRIES:
                file.write_text(TASK.replace(old, new))
                yield [f"entries: {old!r}, {new!r}", *said(functools.partial(fm.read_task, file), folder)]


if __name__ == "__main__":
    with TABLE.open("w", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows(row for group in GROUPS for row in refusals(group))
