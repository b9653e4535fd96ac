"""A map and all that follows from it for one body area."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

from forcemap.campaigns.dataset import ImpactDataset
from forcemap.comparisons.force_models import Comparison, compare_force_models
from forcemap.errors import InputError
from forcemap.limits.force_limits import Contact, ForceLimit
from forcemap.maps.accuracy import Accuracy, force_map_accuracy, leave_one_state_out
from forcemap.maps.bounds import Bound
from forcemap.maps.fit import fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import CFM_3D, Form
from forcemap.speeds.speed_map import SpeedMap, measured_grid, speed_map


@dataclass(frozen=True, eq=False)
class Assessment:
    """A campaign's whole result.

    Parameters
    ----------
    dataset : ImpactDataset
        The impacts.
    force_map : ForceMap
        The map fitted to those with role train.
    accuracy : tuple of Accuracy
        The one to trust first: on test states, else leave-one-state-out; further ones after it.
    bound : Bound
        The bound behind the speeds.
    limit : ForceLimit
        The limits of the body area or region.
    speed_maps : dict of Contact to SpeedMap
        Safe speeds for transient and quasi-static contact.
    comparison : Comparison
        The map beside the 2D map and the standard's contact model.
    """

    dataset: ImpactDataset
    force_map: ForceMap
    accuracy: tuple[Accuracy, ...]
    bound: Bound
    limit: ForceLimit
    speed_maps: dict[Contact, SpeedMap]
    comparison: Comparison


def assess(
    dataset: ImpactDataset,
    *,
    limit: ForceLimit,
    bound: Bound,
    robot_mass: float,
    body_mass: float,
    stiffness: float,
    form: Form = CFM_3D,
    step: float = 0.05,
) -> Assessment:
    """Fit, evaluate, bound and compare a campaign, and give its safe speeds on a grid `step` [m] apart.

    The other arguments, and the errors, are those of `compare_force_models`.
    """
    force_map = fit_force_map(dataset, form=form)
    distance, height = measured_grid(force_map, step)
    return Assessment(
        dataset=dataset,
        force_map=force_map,
        accuracy=map_accuracy(force_map, dataset),
        bound=bound,
        limit=limit,
        speed_maps={
            contact: speed_map(force_map, distance, height, limit=limit, bound=bound, contact=contact)
            for contact in Contact
        },
        comparison=compare_force_models(
            dataset,
            robot_mass=robot_mass,
            body_mass=body_mass,
            stiffness=stiffness,
            form=form,
            bound=bound,
            limit=limit,
        ),
    )


def map_accuracy(force_map: ForceMap, dataset: ImpactDataset) -> tuple[Accuracy, ...]:
    """Accuracy of a map fitted to a dataset, the one to trust first.

    On its test states (those that share no training state) if it has any, on the fitted states left out in turn if
    that is possible, and on all states (paper, Table II, rows Ts and All).
    """
    found: list[Accuracy] = []
    test = dataset.independent_test
    if (test.states.impacts > 0).any():
        found.append(force_map_accuracy(force_map, test, on="test states"))
    with contextlib.suppress(InputError):  # as many states as coefficients: none can be left out
        found.append(leave_one_state_out(force_map))
    found.append(force_map_accuracy(force_map, dataset, on="all states"))
    return tuple(found)
