"""Test states that lie above the bound take the speeds away."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import printed_force, simulate, training_grid

import forcemap as fm
from forcemap.words import sentence

QUASI_STATIC = fm.Contact.QUASI_STATIC


def campaign(factor, *, count=6, censored=False):
    """27 training states, and test states whose force is the printed one times a factor."""
    rng = np.random.default_rng(11)
    train = simulate("kuka-iiwa7-10nm", rng, effect=0.02, points=training_grid("kuka-iiwa7-10nm"),
                     train=np.ones(27, bool)).dataset  # fmt: skip
    places = rng.uniform([0.6, 0.2, 0.22], [0.8, 0.4, 0.3], (count, 3))
    force = printed_force("kuka-iiwa7-10nm", *places.T) * factor * np.exp(rng.normal(0, 0.02, count))
    names = ("distance", "height", "speed", "peak_force", "state", "role", "censored")
    rows = [getattr(train, name).tolist() for name in names]
    for row, extra in zip(
        rows,
        (*places.T, np.where(censored, 500.0, force), [f"t{i}" for i in range(count)], ["test"] * count,
         [censored] * count),
        strict=True,
    ):  # fmt: skip
        row += list(extra)
    return fm.fit_force_map(
        fm.ImpactDataset.from_arrays(
            **dict(zip(names, rows, strict=True)),
            conditions=fm.Conditions(device=fm.Device(range=500.0, error=3.0, stiffness=75e3)),
        )
    )


@pytest.mark.parametrize("censored", [False, True])
def test_a_failed_confirmation_takes_every_speed_away(censored):
    d, h = np.meshgrid([0.65, 0.71, 0.78], [0.25, 0.30, 0.38])
    bad = fm.safe_speed(
        campaign(1.5, censored=censored), d, h, limit=280.0, contact=QUASI_STATIC, bound=fm.ToleranceBound()
    )
    assert not np.isfinite(bad.speed).any()
    assert all("6 of 6 test states lie above the bound" in sentence(reason) for reason in bad.reason.ravel())
    good = fm.safe_speed(campaign(1.0), d, h, limit=280.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    assert np.isfinite(good.speed).any()


def test_one_state_in_many_above_the_bound_is_what_the_bound_allows():
    force_map = campaign(1.0, count=60)
    answer = fm.safe_speed(force_map, 0.71, 0.30, limit=280.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    assert answer.outcome.has_speed


def test_a_margin_makes_no_such_promise_and_covers_what_it_is_as_wide_as():
    """States above it that no scatter explains end every speed of it, too."""
    for margin, has_speed in ((0.1, False), (0.8, True)):
        case = {"limit": 280.0, "contact": QUASI_STATIC, "bound": fm.FixedMargin(margin)}
        assert fm.safe_speed(campaign(1.5), 0.78, 0.38, **case).outcome.has_speed is has_speed
