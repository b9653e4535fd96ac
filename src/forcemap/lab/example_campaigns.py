"""The example campaigns with their recordings, simulated in the lab."""

from __future__ import annotations

import tempfile
import zlib
from pathlib import Path

import numpy as np

from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.examples import EXAMPLE_CAMPAIGNS, copy_example
from forcemap.campaigns.impacts_table import read_dataset
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.lab.simulated_campaign import SimulatedCampaign, simulate_campaign
from forcemap.lab.simulated_device import SimulatedDevice
from forcemap.lab.virtual_robot import PRESETS, virtual_robot

_PRESET = dict(zip(EXAMPLE_CAMPAIGNS, PRESETS, strict=True))


def simulate_example(name: str, folder: str | Path, plan: MeasurementPlan | None = None) -> SimulatedCampaign:
    """Simulate an example campaign into a folder, hit by the preset that is like its robot.

    Parameters
    ----------
    name : str
        One of EXAMPLE_CAMPAIGNS; the same name gives the same files.
    folder : str or Path
        A new or empty folder.
    plan : MeasurementPlan, optional
        Its runs; `example_plan` if not given.

    Raises
    ------
    UnknownName
        No example has the name.
    InputError
        The folder holds files already, or cannot be made.
    """
    runs, conditions = plan or example_plan(name), _example(name).conditions
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    return simulate_campaign(runs, virtual_robot(_PRESET[name]), SimulatedDevice(), rng, folder, conditions=conditions)


def example_plan(name: str, *, tests: bool = False) -> MeasurementPlan:
    """The runs of an example campaign: the default plan over the ranges that the paper measured of that robot.

    Parameters
    ----------
    name : str
        One of EXAMPLE_CAMPAIGNS.
    tests : bool
        Whether the states that only test the map, those of the paper's grid, follow.

    Raises
    ------
    UnknownName
        No example has the name.
    """
    dataset = _example(name)
    same = {name: getattr(dataset, name) for name in ("repeat", "role", "distance", "height", "speed")}
    unknown = np.full(len(dataset), np.nan)
    plan = MeasurementPlan(state_id=dataset.state, **same, base_angle=unknown, expected_force=unknown)
    return plan if tests else plan.select(np.isin(plan.state_id, plan.state_id[plan.role == "train"]))


def _example(name: str) -> ImpactDataset:
    with tempfile.TemporaryDirectory() as parent:
        return read_dataset(copy_example(name, Path(parent, "example")))
