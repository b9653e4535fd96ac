"""The bound with places on truths of the fitted form and not: the table of docs/validity.md under `make validity`.

A campaign is covered if its bound lies above 95 % of the true states, effects included, of a fine grid. The oracle is
another implementation, in plain linear algebra for many campaigns at once; the public API is measured at full size, and
agrees with it on some campaigns in `make test`.
"""

from __future__ import annotations

from functools import lru_cache, partial

import numpy as np
import pytest
from oracle import PRINTED
from scipy.special import nctdtrit, ndtri

import forcemap as fm
from forcemap.campaigns.dataset import States
from forcemap.maps.form_test import form_test
from sizes import FULL_SIZE
from truths import ROWS, SMOOTH, campaigns, fitted, paper, spread

GRID = (13, 13, 10)
LEAST = {
    **dict.fromkeys(ROWS, 0.93),
    "ridge": 0.90,
    "a distance 10 % too low": 0.70,
    "a height 10 % too low": 0.70,
    "a speed 10 % too low": 0.70,
    "bump": 0.0,
    "skewed": 0.75,
    "growing 1-7 %": 0.90,
    "t3": 0.90,
    "along the height": 0.90,
}
SHARED = [name for name in ROWS if name.startswith("shared")]
LIMITS = (140.0, 280.0)
INDEPENDENT, ALIKE = np.zeros(1), 1 - np.geomspace(1, 1e-4, 160)  # correlations to try: none, or any


def design(points):
    """The nine columns of the paper's map."""
    d, h, v = points.T
    return np.column_stack([np.ones_like(d), v, d, d**2, d * h, h**2, d**2 * v, d * v**2, d * h**2])


def oracle(points, y, query, rhos):
    """ln of the bound of campaigns y, shape (c, n), at queries: (c, q).

    For every rho of `rhos`: V, generalised least squares and the restricted likelihood by its definition.
    """
    x, at = design(points), design(query)
    n, p = x.shape
    same = (np.round(points[:, None, :2] - points[:, :2], 6) == 0).all(axis=2)
    fits, value = [], []
    for rho in rhos:
        v = np.where(same, rho, 0.0) + (1 - rho) * np.eye(n)
        weight = np.linalg.inv(v)
        covariance = np.linalg.inv(x.T @ weight @ x)
        b = y @ weight @ x @ covariance
        e = y - b @ x.T
        variance = np.einsum("ci,ij,cj->c", e, weight, e) / (n - p)
        value.append(
            -0.5 * ((n - p) * np.log(variance) + np.linalg.slogdet(v)[1] + np.linalg.slogdet(x.T @ weight @ x)[1])
        )
        fits.append((b, np.sqrt(variance), covariance))
    value = np.array(value)
    last = len(rhos) - 1 - (value >= value.max(axis=0) - 0.5)[::-1].argmax(axis=0)
    bound = np.empty((len(y), len(query)))
    for k in np.unique(last):
        (c,), (b, s, covariance) = np.nonzero(last == k), fits[k]
        root = np.sqrt(np.einsum("qi,qi->q", at @ covariance, at))
        bound[c] = b[c] @ at.T + s[c, None] * np.interp(root, *_factors(n - p))
    return bound


@lru_cache
def _factors(freedom):
    root = np.linspace(0.02, 6, 3000)
    return root, root * nctdtrit(freedom, ndtri(0.95) / root, 0.95)


def covered_by_oracle(name, row, plan, count, rhos=ALIKE):
    """Share of campaigns that are covered, and mean width of the bound above the truth in ln F."""
    covered, width = by_oracle(list(campaigns(name, row, plan, count)), rhos)
    return covered.mean(), width


def by_oracle(found, rhos=ALIKE):
    """Which campaigns are covered, and the mean width."""
    points, query = found[0][1], found[0][0].grid(*GRID)
    y = np.array([each[3].mean(axis=1) for each in found])
    bound = oracle(points, y, query, rhos)
    shares = [each[2].share_below(query, above).mean() for each, above in zip(found, bound, strict=True)]
    truth = np.array([each[2].log_force(query) for each in found])
    return np.array(shares) >= 0.95, float((bound - truth).mean())


def covered_by_api(name, row, plan, count):
    """The same through the public API, with the share of campaigns refused; permitted places that exceed each limit."""
    covered, width, refused = [], [], 0
    exceeding = {limit: [] for limit in LIMITS}
    bound = fm.ToleranceBound(device_error=0)
    for box, points, truth, log_force in campaigns(name, row, plan, count):
        query, places = box.grid(*GRID), box.grid(7, 7, 1)[:, :2]
        try:
            force_map = fitted(points, log_force)
            upper = np.log(bound.upper(force_map, *query.T))
        except fm.BoundNotAvailable:
            refused += 1
            continue
        covered.append(truth.share_below(query, upper).mean() >= 0.95)
        width.append((upper - truth.log_force(query)).mean())
        for limit in LIMITS:
            speed = fm.safe_speed(force_map, *places.T, limit=limit, contact=fm.Contact.QUASI_STATIC, bound=bound).speed
            at = np.column_stack([places, speed])[~np.isnan(speed)]
            if len(at):
                above = 1 - truth.share_below(at, np.full(len(at), np.log(limit)))
                exceeding[limit].append((len(at), above.mean()))
    return np.mean(covered), np.mean(width), refused / count, exceeding


@pytest.mark.parametrize("row", list(ROWS)[:: 3 if FULL_SIZE else 6])
def test_the_oracle_and_the_public_api_agree(row):
    for plan in (paper, spread):
        for box, points, _, log_force in campaigns("kuka-iiwa7-30nm", row, plan, 2, seed=1):
            query = box.grid(3, 3, 3)
            ours = np.log(fm.ToleranceBound(device_error=0).upper(fitted(points, log_force), *query.T))
            (theirs,) = oracle(points, log_force.mean(axis=1)[None], query, 1 - np.geomspace(1, 1e-4, 3000))
            np.testing.assert_allclose(ours, theirs, atol=4e-4)


@pytest.fixture(scope="module")
def in_the_form(full_size):
    """Coverage and width of the paper's plan with the bound that takes states as independent, by robot."""
    count = 400 if full_size else 60
    return {name: covered_by_oracle(name, "in the form", paper, count, INDEPENDENT) for name in PRINTED}


@pytest.mark.parametrize("row", ROWS)
def test_a_spread_plan_keeps_the_promise(row, full_size, in_the_form):
    few = 0.0 if full_size else 0.08  # a share of 60 campaigns errs by 0.03 to 0.05
    broken = []
    for name in PRINTED if full_size else ["ur10e"]:
        count = 400 if full_size else 60
        before = full_size or row in SHARED
        old = covered_by_oracle(name, row, paper, count, INDEPENDENT) if before else (0.0, np.nan)
        new = covered_by_oracle(name, row, paper, count) if before else (0.0, np.nan)
        kept, figures, refused = {}, [], 0.0
        if full_size:
            share, width, refused, exceeding = covered_by_api(name, row, spread, count)
            for limit, found in exceeding.items():
                above = np.mean([share for _, share in found]) if found else 0.0
                many = [share for places, share in found if places >= 10]
                often = np.mean(np.array(many) > 0.2) if many else 0.0
                figures += [f"{100 * above:.1f} %, {100 * often:.1f} %"]
                kept[f"above {limit:g} N"] = above <= 0.05
                kept[f"often above {limit:g} N"] = often <= 0.01
        else:
            share, width = covered_by_oracle(name, row, spread, count)
        cells = [f"{old[0]:.2f} ({old[1]:.3f})", f"{new[0]:.2f} ({new[1]:.3f})", f"{share:.2f} ({width:.3f})"]
        print(f"| {name} | {row} | {' | '.join([*cells, f'{refused:.2f}', *figures])} |", flush=True)
        kept["coverage"] = share >= LEAST[row] - few
        if row in SHARED:
            kept["the paper's plan"] = new[0] >= 0.85 - few
            kept["better than before"] = share > old[0]
        if row == "in the form":
            kept["refusals"] = refused <= 0.05
            kept["width"] = width <= (1.25 + few) * in_the_form[name][1]
        broken += [(name, what) for what, good in kept.items() if not good]
    assert broken == []


@pytest.mark.parametrize("places", [9, 12, 14, 16, 18, 23])
def test_what_fewer_or_more_places_cost(places, full_size):
    """For the table of docs/validity.md; the corners have two states each, so 27 states lie at 23 places at most."""
    rows = ROWS if full_size else ["in the form", "shared 2.2 %, own 1.5 %"]
    found = {}
    for row in rows:
        found[row] = covered_by_oracle("ur10e", row, lambda box: spread(box, places=places), 400 if full_size else 60)
    print(f"| {places} | " + " | ".join(f"{share:.2f} ({width:.3f})" for share, width in found.values()) + " |")
    few = 0.0 if full_size else 0.08
    assert found["in the form"][0] >= 0.93 - few
    assert found["shared 2.2 %, own 1.5 %"][0] >= (0.93 if places >= 12 else 0.85) - few


DEPARTURES = {"plateau": 0.95, "kink": 0.85, "stretched arm": 0.90, "ridge": 0.30}
NONE = ["in the form", *SHARED]


@pytest.mark.parametrize("row", ROWS if FULL_SIZE else [*DEPARTURES, *NONE])
def test_departures_from_the_form_are_found_and_false_alarms_are_rare(row, full_size):
    """On the default plan; on the paper's the alarms are as rare, and hardly anything is found."""
    count = (1000 if row in NONE else 400) if full_size else 10
    cells = []
    for plan in (spread, paper):
        drawn = list(campaigns("ur10e", row, plan, count))
        found = np.array([bool(form_test(fm.CFM_3D, _states(points, y)).significant) for _, points, _, y in drawn])
        covered, width = by_oracle(drawn)
        of = [f"{covered[each].mean():.2f}" if each.any() else "-" for each in (found, ~found)]
        cells += [f"{found.mean():.2f}", f"{covered.mean():.2f} ({width:.3f})", " / ".join(of)]
        if row in NONE:
            assert found.mean() <= (0.06 if full_size else 0.21)
        if plan is spread:
            assert found.mean() >= DEPARTURES.get(row, 0.0) - (0 if full_size else 0.2)
    print(f"| {row} | {' | '.join(cells)} |", flush=True)


def _states(points, log_force):
    names = np.array([f"s{i:02d}" for i in range(len(points))])
    return States.of(points, np.exp(log_force.mean(axis=1)), names, np.zeros(len(points), dtype=bool))


OPTIMAL = {"18 states": (18, None), "at 12 places": (18, 12), "at 9 places": (18, 9), "27 states": (27, None)}


@pytest.mark.parametrize("row", ROWS if FULL_SIZE else NONE[:2])
def test_i_optimal_plans_keep_the_promise_where_places_share_effects(row, full_size):
    """For the table of docs/short_campaigns.md: states chosen for the form, and for what it misses."""
    cells = []
    for states, places in OPTIMAL.values():
        options = {"design": fm.Design.I_OPTIMAL, "states": states, "places": places}
        each = [
            covered_by_oracle(name, row, partial(spread, **options), 400 if full_size else 40)
            for name in ("ur10e", "kuka-iiwa7-30nm")
        ]
        cells.append(", ".join(f"{share:.2f} ({width:.3f})" for share, width in each))
        if row in NONE:
            assert min(share for share, _ in each) >= (0.93 if places is None else 0.90) - (0 if full_size else 0.12)
    print(f"| {row} | {' | '.join(cells)} |", flush=True)


WORST_PLACE = dict.fromkeys(ROWS, 0.87) | dict.fromkeys(SMOOTH, 0.79)
WORST_PLACE |= {"a speed 10 % too low": 0.77, "skewed": 0.68, "growing 1-7 %": 0.63}
"""Least share of campaigns whose bound holds at the single state of the grid where it holds least; found, less 0.05."""


@pytest.mark.parametrize("row", [*ROWS, *SMOOTH])
def test_how_often_the_bound_holds_at_the_worst_single_state(row, full_size):
    """The table "At single places": the promise is for each state where the truth has the form, else for the grid."""
    found = list(campaigns("ur10e", row, spread, 400 if full_size else 100))
    query = found[0][0].grid(7, 7, 6)
    bound = oracle(found[0][1], np.array([each[3].mean(axis=1) for each in found]), query, ALIKE)
    holds = np.mean(
        [each[2].share_below(query, above) >= 0.95 for each, above in zip(found, bound, strict=True)], axis=0
    )
    print(f"| {row} | {holds.mean():.3f} | {holds.min():.3f} | {100 * np.mean(holds < 0.94):.0f} % |")
    assert holds.min() > WORST_PLACE[row] - (0 if full_size else 0.06)
    if row in ("in the form", *SHARED):
        assert holds.mean() > 0.95
