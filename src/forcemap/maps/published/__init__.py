"""The three collision-force maps of the paper, from its printed equations."""

from __future__ import annotations

import itertools
import json
import tomllib
from importlib import resources

import numpy as np

from forcemap.campaigns.dataset import Conditions, ContactScenario, PhaseTwo
from forcemap.errors import UnknownName
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_3D
from forcemap.maps.measured_range import MeasuredRange

PUBLISHED_MAPS = ("ur10e", "kuka-iiwa7-30nm", "kuka-iiwa7-10nm")


def published_map(name: str) -> ForceMap:
    """A map of the paper (section V, the three fitted equations), its measured range the printed grid.

    Parameters
    ----------
    name : str
        "ur10e", "kuka-iiwa7-30nm" or "kuka-iiwa7-10nm".

    Raises
    ------
    UnknownName
        No published map has the name.

    Examples
    --------
    >>> published_map("kuka-iiwa7-30nm").form.name
    'CFM_3D'
    """
    if name not in PUBLISHED_MAPS:
        raise UnknownName("published map", name, PUBLISHED_MAPS)
    files = resources.files(__name__)
    facts = json.loads(files.joinpath("published_maps.json").read_text())
    campaign = tomllib.loads(files.joinpath("campaigns.toml").read_text())[name]
    figures = facts["maps"][name]
    grid = itertools.product(figures["distances_m"], figures["heights_m"], figures["speeds_mps"])
    scenario = ContactScenario(campaign.pop("scenario"))
    phase_two = PhaseTwo({scenario: campaign.pop("impacts")})
    conditions = Conditions.from_tables(campaign)
    return ForceMap(
        name=name,
        form=CFM_3D,
        coefficients=np.array(figures["coefficients"]),
        measured_range=MeasuredRange(np.array(list(grid))),
        phase_two=phase_two,
        conditions=conditions,
        device_range=conditions.device.range,
        source=f"published map {name}: {facts['source']}",
    )
