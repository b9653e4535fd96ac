"""Impacts far below what a map predicts: of a robot that did not reach the stated speed, say. They are said first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracle import DEVICE, printed_force
from scipy.stats import nct, norm

import forcemap as fm
from forcemap.findings import FindingKind
from forcemap.maps.below_map import far_below

HAND = fm.force_limit("back_of_hand")
PLAN = fm.plan_measurements((0.52, 0.89), (0.14, 0.46), (0.1, 0.4), repeats=1, again=0)
AT = np.column_stack([PLAN.distance, PLAN.height, PLAN.speed])
PLACES = np.array([[0.6, 0.3, 0.2], [0.8, 0.25, 0.3], [0.7, 0.4, 0.15]])


def campaign(shares, role="test", places=PLACES):
    """A campaign of the printed UR10e map with 2 % scatter, and test states whose forces are shares of the map's."""
    rng = np.random.default_rng(4)
    force = printed_force("ur10e", *AT.T) * np.exp(rng.normal(0, 0.02, len(AT)))
    states = np.vstack([AT, places])
    names = [f"s{i}" for i in range(len(AT))] + [f"{'c-' if role == 'confirm' else 't'}{i}" for i in range(len(places))]
    return fm.ImpactDataset.from_arrays(
        distance=states[:, 0], height=states[:, 1], speed=states[:, 2],
        peak_force=np.append(force, np.asarray(shares) * printed_force("ur10e", *places.T)), state=names,
        role=["train"] * len(AT) + ["test"] * len(places), phase2_force=np.full(len(states), 20.0),
        conditions=fm.Conditions(device=replace(DEVICE, range=2000.0), direction="down"),
    )  # fmt: skip


@pytest.mark.parametrize("shares", [(1.0, 1.0, 1.0), (0.95, 0.9, 0.97), (0.5, 1.0, 0.6), (0.82, 0.82, 0.82)])
def test_which_states_lie_far_below(shares):
    """Beside the equation: below F^2 / U for 999 of 1000 states, and by 15 % of F, by scipy."""
    force_map = fm.fit_force_map(campaign(shares))
    fit, form = force_map.require_fit(), force_map.form
    place = fit.states.place
    same = place[:, None] == place
    rows = form.design(*fit.states.coordinates.T)
    rho = fit.place_effect.correlation
    inverse = np.linalg.inv(rows.T @ np.linalg.inv(rho * same + (1 - rho) * np.eye(len(place))) @ rows)
    at = form.design(*PLACES.T)
    leverage = np.einsum("ij,jk,ik->i", at, inverse, at)
    predicted = force_map.predict(*PLACES.T)
    t = nct.ppf(0.95, fit.between_states.degrees_of_freedom, norm.ppf(0.999) / np.sqrt(leverage))
    upper = np.maximum(predicted * np.exp(fit.state_sd * np.sqrt(leverage) * t), predicted + 3.0)
    measured = np.asarray(shares) * printed_force("ur10e", *PLACES.T)
    wanted = [f"t{i}" for i in np.flatnonzero(measured < np.minimum(0.85 * predicted, predicted**2 / upper))]
    found = far_below(force_map, force_map.tested)
    assert sorted(found.figure("names") if found else []) == wanted
    basis = fm.safe_speed(
        force_map, 0.8, 0.4, limit=HAND, contact=fm.Contact.TRANSIENT, bound=fm.ToleranceBound()
    ).basis
    assert (FindingKind.FAR_BELOW_MAP in {each.kind for each in basis.warnings}) is bool(wanted)
    assert not basis.refusals  # a doubt: a low force hurts nobody by itself


def test_what_the_map_does_not_tell_of_is_left_alone():
    """Beside the measured places, slower than was measured, and of a map that was not fitted."""
    places = np.array([[0.4, 0.3, 0.2], [0.7, 0.3, 0.05], [0.7, 0.3, 0.9]])
    force_map = fm.fit_force_map(campaign((0.3, 0.3, 1.0), places=places))
    assert far_below(force_map, force_map.tested) is None
    fast = fm.fit_force_map(campaign((0.3, 0.3, 0.1), places=places))  # faster has at least the force of its fastest
    assert far_below(fast, fast.tested).figure("names") == ("t2",)
    published = fm.published_map("ur10e")
    assert far_below(published, published.tested) is None


@pytest.mark.parametrize("seed", range(40))
def test_sound_states_are_not_called_low(seed):
    rng = np.random.default_rng(seed)
    places = rng.uniform([0.55, 0.16, 0.12], [0.87, 0.44, 0.38], (12, 3))
    force_map = fm.fit_force_map(campaign(np.exp(rng.normal(0, 0.025, 12)), places=places))
    assert far_below(force_map, force_map.tested) is None
