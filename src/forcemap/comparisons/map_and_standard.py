"""A map beside the 2D map and the standard's contact model, where no impacts are at hand: published maps, map files."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from forcemap.campaigns.dataset import ImpactDataset
from forcemap.comparisons.force_models import Comparison, Models
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.limits.force_limits import ForceLimit
from forcemap.maps.bounds import Bound
from forcemap.maps.fit import fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_2D

BY_THE_MAP = "forces of the map"
"""What the states of a map are called whose forces are its own predictions."""


def compare_map_with_standard(
    force_map: ForceMap,
    *,
    robot_mass: float,
    body_mass: float,
    stiffness: float,
    bound: Bound,
    limit: ForceLimit | None = None,
) -> Comparison:
    """Compare the 2D map and the standard's contact model with the forces that a map predicts at its own states.

    As `compare_force_models`, where the impacts are not at hand: the map stands for the measurement, so nothing is said
    of its own errors, and the 2D maps are fitted to its predictions.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    robot_mass, body_mass : float
        Effective masses of the contact model [kg].
    stiffness : float
        Its spring constant [N/m].
    bound : Bound
        Bound behind the map's speeds.
    limit : ForceLimit, optional
        Limits of a body area; without it no speeds are compared.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        The map predicts no force within the device's range, or a figure is outside its range.
    BoundNotAvailable
        The map cannot carry the bound.
    """
    bound.require(force_map)
    body = {"robot_mass": robot_mass, "body_mass": body_mass, "stiffness": stiffness}
    dataset = as_impacts(force_map)
    models = Models(dataset.states, BY_THE_MAP, dataset.states)
    models.add_maps([fit_force_map(dataset, form=CFM_2D)], dataset, has_test=True)
    models.add_standard(body, force_map.conditions.device.stiffness)
    compared = models.comparison([force_map], dataset, limit, bound, body)
    return replace(compared, statements=(Finding.of(FindingKind.MAP_STANDS_FOR_IMPACTS), *compared.statements))


def as_impacts(force_map: ForceMap) -> ImpactDataset:
    """The map's own states with the forces that it predicts there, those within the device's range.

    Raises
    ------
    InputError
        It predicts no force within the range.
    """
    d, h, v = force_map.measured_range.points.T
    force = np.asarray(force_map.predict(d, h, v))
    highest = math.inf if math.isnan(force_map.device_range) else force_map.device_range
    if not (seen := force < highest).any():
        raise InputError(f"map {force_map.name!r} predicts no force below {highest:g} N at its states, expected some")
    conditions = replace(force_map.conditions, speed_error=math.nan)  # speeds at contact, as the map has them
    return ImpactDataset.from_arrays(
        distance=d[seen], height=h[seen], speed=v[seen], peak_force=force[seen], conditions=conditions
    )
