"""Maps carried over: coverage of their bound on truths that keep the earlier shape and others (docs/validity.md).

The earlier map is fitted to the default plan of one printed map, the new states to another truth: through the public
API. A campaign is covered if its bound lies above 95 % of the true states, effects included, of a fine grid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from oracle import printed_force
from scipy import stats

import forcemap as fm
from forcemap.maps.transfer import MORE_BELOW, MORE_STATES
from forcemap.planning.transfer_plan import plan_transfer
from sizes import FULL_SIZE
from truths import ROWS, Box, Effects, Truth, fitted, spread

GRID = (11, 11, 8)
BOUND = fm.ToleranceBound(device_error=0)
THIRTY, TEN, UR = "kuka-iiwa7-30nm", "kuka-iiwa7-10nm", "ur10e"
EFFECTS = {
    "own 2.2 %": Effects(own=stats.norm(0, 0.022)),
    "own 3.3 %": Effects(own=stats.norm(0, 0.033)),
    "own 2.2 %, places 2.2 %": Effects(0.022, stats.norm(0, 0.022)),
}


@dataclass(frozen=True)
class Campaigns:
    """Shares of campaigns, and means over those that were carried over."""

    refused: float
    covered: float  # of those carried over
    safe: float  # refused or covered
    coverage: float
    width: float  # against as many states as the earlier map has, measured anew
    more: float  # asked for more states
    states: float


def reversed_trend(base, box, rng):
    """Nearer is weaker: distances mirrored within the box."""
    return lambda x: base(np.column_stack([box.low[0] + box.high[0] - x[:, 0], x[:, 1:]]))


SHAPES = {
    "kink": ROWS["kink"].shape,
    "reversed trend": reversed_trend,
    "plateau": ROWS["plateau"].shape,
    "ridge": ROWS["ridge"].shape,
    "bump": ROWS["bump"].shape,
}


def hypercube(box, n, rng):
    """n states at places and speeds of a Latin hypercube whose ends are those of the box."""
    share = np.column_stack([rng.permutation(n) for _ in range(3)]) / (n - 1)
    if np.linalg.matrix_rank(share - share.mean(axis=0)) < 3:
        return hypercube(box, n, rng)
    return box.at(0.02 + 0.96 * share)


def impacts(points, log_force):
    """A table of repeats of ln F, shape (n, repeats)."""
    repeats = log_force.shape[1]
    d, h, v = points.repeat(repeats, axis=0).T
    return fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=np.exp(log_force.ravel()))


def tried(then, now, n, effects, count, *, shape=None, planned=True, more=False, seed=17):
    """Seeded campaigns of n new states; with `more` six more are measured where they are asked for."""
    rng, box = np.random.default_rng([seed, n, *then.encode(), *now.encode()]), Box.of(then)
    old_points, query = spread(box), Box(box.at(0.05), box.at(0.95)).grid(*GRID)
    new_points, refused, asked, covered, coverage, width, states = None, 0, 0, [], [], [], []
    for _ in range(count):
        truths = [
            Truth((lambda x, name=name: np.log(printed_force(name, *x.T))), effects, lambda x: 0.0)
            for name in (then, now)
        ]
        if shape:
            truths[1] = Truth(SHAPES[shape](truths[1].log_force, box, rng), effects, lambda x: 0.0)
        old_map = fitted(old_points, truths[0].measured(old_points, 3, rng))
        if planned and new_points is None:
            plan = plan_transfer(old_map, states=n, repeats=1)
            new_points = np.column_stack([plan.distance, plan.height, plan.speed])
        points = new_points if planned else hypercube(box, n, rng)
        log_force = truths[1].measured(points, 3, rng)
        try:
            force_map = fm.transfer_map(old_map, impacts(points, log_force))
            if force_map.fit.transfer.p_value < MORE_BELOW:
                asked += 1
                if more:
                    further = hypercube(box, MORE_STATES, rng)
                    points = np.vstack([points, further])
                    log_force = np.vstack([log_force, truths[1].measured(further, 3, rng)])
                    force_map = fm.transfer_map(old_map, impacts(points, log_force))
        except fm.TransferRefused:
            refused += 1
            continue
        fresh = fitted(old_points, truths[1].measured(old_points, 3, rng))
        upper = np.log(BOUND.upper(force_map, *query.T))
        share = truths[1].share_below(query, upper).mean()
        covered.append(share >= 0.95)
        coverage.append(share)
        above = [np.expm1(np.log(BOUND.upper(each, *query.T) / each.predict(*query.T))) for each in (force_map, fresh)]
        width.append(above[0].mean() / above[1].mean())
        states.append(len(points))
    kept = float(np.mean(covered)) if covered else 1.0
    return Campaigns(
        refused / count,
        kept,
        (refused + sum(covered)) / count,
        float(np.mean(coverage)) if covered else 1.0,
        float(np.mean(width)) if covered else np.nan,
        asked / count,
        float(np.mean(states)) if covered else np.nan,
    )


LEAST = {  # (earlier, new): states, mean coverage, share of campaigns, width
    (THIRTY, TEN): ((9, 0.97, 0.90, 1.25), (6, 0.95, 0.85, np.inf)),
    (THIRTY, UR): ((9, 0.0, 0.88, np.inf),),
    (UR, THIRTY): ((9, 0.0, 0.88, np.inf),),
}


CASES = [(pair, effects, planned) for pair in LEAST for effects in EFFECTS for planned in (True, False)]
if not FULL_SIZE:
    CASES = [case for case in CASES if case[1] == "own 2.2 %" or (case[0] == (THIRTY, TEN) and case[2])]


@pytest.mark.parametrize(("pair", "effects", "planned"), CASES)
def test_a_map_carried_over_keeps_its_promise(pair, effects, planned, full_size):
    count, few = (300, 0.0) if full_size else (60, 0.08)
    then, now = pair
    for n, coverage, share, width in LEAST[then, now]:
        found = tried(then, now, n, EFFECTS[effects], count, planned=planned)
        print(
            f"| {then} | {now} | {effects} | {n} {'planned' if planned else 'any'} | {found.coverage:.3f} | "
            f"{found.covered:.2f} | {found.width:.2f} | {found.refused:.2f} |"
        )
        assert found.coverage >= coverage - few / 2
        assert found.covered >= share - few
        assert found.width <= width + few
        if now == TEN:
            assert found.refused <= 0.15 + few


@pytest.mark.parametrize("shape", SHAPES)
def test_a_shape_that_changed_is_refused_or_covered(shape, full_size):
    count, few = (300, 0.0) if full_size else (20, 0.15)
    least = {"ridge": 0.92, "bump": 0.0}.get(shape, 0.95)
    for name in (UR, THIRTY) if full_size else (UR,):
        found = tried(name, name, 12, EFFECTS["own 2.2 %"], count, shape=shape, more=shape in ("ridge", "bump"))
        print(
            f"| {name} | {shape} | {found.refused:.2f} | {found.safe:.2f} | {found.more:.2f} | {found.states:.1f} | "
            f"{found.width:.2f} |"
        )
        assert found.safe >= least - few
