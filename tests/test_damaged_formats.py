"""Damaged files of every format that is read: each ends in one of our errors or is read, and none takes long."""

from __future__ import annotations

import io
import time
import warnings
from collections import defaultdict
from functools import partial
from importlib import resources

import numpy as np
import pytest

import forcemap as fm
from damages import ALL_DAMAGES
from forcemap.campaigns.conditions import read_campaign_file
from forcemap.campaigns.recordings_table import read_register
from forcemap.recordings.read import read_recordings
from layouts import LAYOUTS
from pulses import TOML, collect, write_campaign

SEED, LONGEST = 20260504, 2.0  # s of processor time
TASK = """schema = "forcemap-task/1"
note = "press at one end, place at the other"
acceleration_mps2 = 2.0
[campaign]
direction = "down"
[[segments]]
name = "approach"
areas = ["back_of_hand"]
clamping_possible = false
speed_mps = 0.25
[[segments]]
name = "away"
contact_possible = false
speed_mps = 0.5
"""
LIMITS = """# edition: works agreement 3
area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor
back_of_hand,back of the hand,hand_fingers,200,140,2
palm,palm,hand_fingers,260,140,2
forehead,forehead,skull_forehead,130,130,0
"""
URDF = """<?xml version="1.0"?><robot name="arm">
<link name="base"><inertial><mass value="4"/><origin xyz="0 0 0.1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.2" rpy="0 1.57 0"/>
<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="10" velocity="2"/></joint>
<link name="upper"><inertial><mass value="3"/><origin xyz="0 0 0.1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="b" type="fixed"><parent link="upper"/><child link="tool"/><origin xyz="0 0 0.3"/></joint>
<link name="tool"/></robot>
"""
RECORDINGS_TOML = '\n[robot]\nmodel = "UR10e"\n[recordings]\ntime = "time_ms"\ntime_unit = "ms"\nforce = "force_N"\n'


LOG = (
    "Log 4711\nt;X;Y;Z;RX\nms;mm;mm;mm;rad\n" + "".join(f"{8 * i};{500 + i},5;{i},0;200,0;3,14\n" for i in range(40))
).encode()
LOG_COLUMNS = {"position": ["X", "Y", "Z"], "length_unit": "mm", "time": "t", "time_unit": "ms"}


@pytest.fixture(scope="module")
def formats(tmp_path_factory):
    """Name of a format -> (ending, reader, whole files with what else the reader takes)."""
    folder = write_campaign(tmp_path_factory.mktemp("damaged") / "campaign", repeats=1)
    dataset = collect(folder)
    fm.write_map(fm.fit_force_map(dataset), folder / "map.json")
    fm.write_dataset(dataset, folder / "plain.csv")

    def text(name):
        return (folder / name).read_bytes()

    path = "x_m,y_m,z_m,segment\n" + "".join(f"{0.5 + i / 100},{i / 100},0.2,approach\n" for i in range(40))
    found = {
        "recordings, text": (".csv", read_recordings, [(w.content, {"columns": w.columns}) for w in LAYOUTS]),
        "impacts table": (".csv", fm.read_dataset, [(text("impacts.csv"), {}), (text("plain.csv"), {})]),
        "plan": (".csv", fm.read_plan, [(text("plan.csv"), {})]),
        "register of recordings": (".csv", read_register, [(text("recordings.csv"), {})]),
        "table of limits": (".csv", fm.read_limit_table, [(LIMITS.encode(), {})]),
        "path": (".csv", fm.read_path, [(path.encode(), {})]),
        "pose log": (".csv", fm.read_path, [(LOG, {"columns": LOG_COLUMNS})]),
        "campaign.toml": (".toml", read_campaign_file, [((TOML + RECORDINGS_TOML).encode(), {})]),
        "task.toml": (".toml", fm.read_task, [(TASK.encode(), {})]),
        "map file": (".json", fm.read_map, [(text("map.json"), {})]),
        "robot description": (".urdf", partial(fm.read_urdf, tip="tool"), [(URDF.encode(), {})]),
    }
    if contents := tdms_files():
        found["recordings, TDMS"] = (".tdms", read_recordings, contents)
    for name, (ending, read, wholes) in found.items():
        for content, options in wholes if name != "recordings, text" else ():
            (folder / f"whole{ending}").write_bytes(content)
            read(folder / f"whole{ending}", **options)  # whole files are read
    return found


def tdms_files():
    """A TDMS file made here, and those that other programs wrote."""
    try:
        import nptdms
    except ImportError:
        return []
    stream = io.BytesIO()
    with nptdms.TdmsWriter(stream) as writer:
        for part in range(3):
            values = np.arange(200.0) + 200 * part
            scale = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 2.0,
                     "NI_Scale[0]_Linear_Y_Intercept": 0.0, "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF}  # fmt: skip
            force = nptdms.ChannelObject("g", "f", np.sin(values), {"wf_increment": 0.001, "unit_string": "N"} | scale)
            writer.write_segment([nptdms.ChannelObject("g", "t", values / 1000), force])
    files = [(stream.getvalue(), {"columns": {"time": "g/t", "force": "g/f"}})]
    files += [(stream.getvalue(), {"columns": {"force": "g/f"}})]
    folder = resources.files(nptdms) / "test" / "data"
    for name in ("big_endian", "raw_timestamps", "raw1") if folder.is_dir() else ():
        columns = {"runs": "all", "force_unit": "counts", "newtons_per_count": 1.0}
        files.append(((folder / f"{name}.tdms").read_bytes(), {"columns": columns}))
    return files


def test_damaged_files_of_every_format(formats, tmp_path, full_size, capsys):
    rng = np.random.default_rng(SEED)
    counts = defaultdict(lambda: [0, 0, 0.0])
    names = sorted(formats)
    total = 100_000 if full_size else 440
    for number in range(total):
        # half of all are recordings: most layouts, and what strangers' programs write
        name = "recordings, text" if number % 2 else names[number // 2 % len(names)]
        ending, read, wholes = formats[name]
        content, options = wholes[rng.integers(len(wholes))]
        damage = ALL_DAMAGES[rng.integers(len(ALL_DAMAGES))]
        content = damage(rng, content)
        if content and rng.random() < 0.2:
            content = ALL_DAMAGES[rng.integers(len(ALL_DAMAGES))](rng, content)
        path = tmp_path / f"damaged{ending}"
        path.write_bytes(content)
        begin = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                read(path, **options)
        except fm.ForcemapError as error:
            refused, words = 1, str(error)
            assert len(words.splitlines()) == 1, (number, name, damage, words)
            assert all(sign.isprintable() or sign == "\ufffd" for sign in words), (number, name, damage, words)
            assert len(words) < 3000, (number, name, damage, words)
        except BaseException as error:
            error.add_note(f"file {number}, {name}, {damage.__name__}, seed {SEED}: {path}")
            raise
        else:
            refused = 0
        took = time.process_time() - begin
        assert took < LONGEST, (number, name, damage.__name__, took)
        of_name = counts[name]
        of_name[0] += 1
        of_name[1] += refused
        of_name[2] = max(of_name[2], took)
    assert set(counts) == set(formats)
    assert all(refused for _, refused, _ in counts.values())
    if full_size:
        with capsys.disabled():
            print("\n| format | files | refused | longest [s] |\n|---|---|---|---|")
            for name, (files, refused, longest) in sorted(counts.items()):
                print(f"| {name} | {files:,} | {refused:,} | {longest:.2f} |")
