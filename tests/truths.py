"""Truths a campaign may meet, of the fitted form and not, with the effects of its states, and the states it measures.

But for the default plan, which is the package's, independent of the package.
ln F of a state = truth + effect. Truths are those of a printed map (oracle.py), or of none, on any box of distances,
heights and speeds; what is drawn anew for every campaign (where a ridge lies, which level reads too low) is in `draw`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from oracle import DISTANCES, HEIGHTS, SPEEDS, printed_force
from scipy import stats

import forcemap as fm

NOISE, REPEATS = 0.005, 3  # of ln F, between repeats of a state


@dataclass(frozen=True)
class Box:
    """Measured distances, heights [m] and speeds [m/s], from `low` to `high`, shape (3,) each."""

    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, name: str, slowest: float = 0.1, fastest: float = SPEEDS[-1]) -> Box:
        """Of a printed map, with other speeds than its own."""
        d, h = DISTANCES[name], HEIGHTS
        return cls(np.array([d[0], h[0], slowest]), np.array([d[-1], h[-1], fastest]))

    def at(self, share) -> np.ndarray:
        """Points at shares from 0 to 1 of each coordinate, shape (n, 3)."""
        return self.low + np.asarray(share) * (self.high - self.low)

    def grid(self, *counts: int) -> np.ndarray:
        """Points of an even grid, shape (n, 3)."""
        return self.at(list(product(*(np.linspace(0, 1, count) for count in counts))))


def paper(box: Box) -> np.ndarray:
    """The paper's plan: three levels of each coordinate, shape (27, 3)."""
    return box.grid(3, 3, 3)


def spread(box: Box, **options) -> np.ndarray:
    """The package's default plan, shape (states, 3)."""
    plan = fm.plan_measurements(*np.column_stack([box.low, box.high]), repeats=1, again=0, **options)
    return np.column_stack([plan.distance, plan.height, plan.speed])


@dataclass(frozen=True)
class Effects:
    """What is peculiar to a state: a share of its place, drawn with `place_sd`, and its own, by distribution.

    `own` is a frozen distribution of scipy.stats of mean 0, times `scale(points)`.
    """

    place_sd: float = 0.0
    own: object = stats.norm(0, 0.022)
    scale: Callable = lambda points: np.ones(len(points))

    def draw(self, points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Of new states, shape (n,): states of a place share what is its own."""
        _, place = np.unique(np.round(points[:, :2], 6), axis=0, return_inverse=True)
        shared = rng.normal(0, self.place_sd, place.max() + 1)[place] if self.place_sd else 0.0
        return shared + self.scale(points) * self.own.rvs(len(points), random_state=rng)

    def share_below(self, points: np.ndarray, margin: np.ndarray) -> np.ndarray:
        """Probability that the effect of a new state at a new place is at most a margin, shape of the margins."""
        if self.place_sd:
            return stats.norm.cdf(margin, 0, np.hypot(self.place_sd, self.own.std()))
        return self.own.cdf(margin / self.scale(points))


@dataclass(frozen=True)
class Truth:
    """The truth of one campaign: ln F without effects, the effects, and how far a state's reading is off, of ln F."""

    log_force: Callable
    effects: Effects
    slip: Callable

    def measured(self, points: np.ndarray, repeats: int, rng: np.random.Generator) -> np.ndarray:
        """ln F as read, shape (n, repeats)."""
        state = self.log_force(points) + self.effects.draw(points, rng) + self.slip(points)
        return state[:, None] + rng.normal(0, NOISE, (len(points), repeats))

    def share_below(self, points: np.ndarray, log_bound: np.ndarray) -> np.ndarray:
        """Share of states of each point whose true force lies below a bound, effects included, shape (n,)."""
        return self.effects.share_below(points, log_bound - self.log_force(points))


def _falling(box):
    return lambda x: -1.6 * (x[:, 0] - box.low[0]) - 1.3 * (x[:, 1] - box.low[1])


def _plateau(base, box, rng):
    fall = _falling(box)
    return lambda x: np.log(np.maximum(150, 1100 * x[:, 2])) + fall(x)


def _kink(base, box, rng):
    fall = _falling(box)
    return lambda x: np.log(60 + 700 * x[:, 2] + 1500 * np.maximum(x[:, 2] - 0.3, 0)) + fall(x)


def _ridge(base, box, rng):
    at = rng.uniform(box.low[0], box.high[0])
    return lambda x: base(x) + np.log1p(0.15 * np.exp(-(((x[:, 0] - at) / 0.04) ** 2)))


def _arm(base, box, rng):
    bend = box.low[0] + 0.7 * (box.high[0] - box.low[0])
    return lambda x: base(x) + 30 * np.maximum(x[:, 0] - bend, 0) ** 2


def _bump(base, box, rng):
    at = rng.uniform(box.low[:2], box.high[:2])
    return lambda x: base(x) + np.log1p(0.25 * np.exp(-(((x[:, :2] - at) / 0.04) ** 2).sum(axis=1)))


def _along_height(base, box, rng):
    """A course along the height with standard deviation 3 %, correlated over 0.3 m: the effect is part of the truth."""
    heights = np.linspace(box.low[1], box.high[1], 513)
    kept = np.exp(-np.diff(heights) / 0.3)
    course = [rng.normal(0, 0.03)]
    for share, step in zip(kept, rng.normal(0, 0.03, kept.size), strict=True):
        course.append(share * course[-1] + np.sqrt(1 - share**2) * step)
    return lambda x: base(x) + np.interp(x[:, 1], heights, course)


def _two_bodies(base, box, rng):
    """Two masses and a spring of 75 N/mm, softer when faster: v^0.85; the robot's mass falls with both coordinates."""

    def log_force(x):
        d, h, v = x.T
        mass = 4 + 22 * np.exp(-3.2 * (d - 0.45)) * (1 - 0.55 * h)
        return 0.5 * np.log(75_000 * mass) + 0.85 * np.log(v) + np.log(0.75 * (1 + 0.12 * d))

    return log_force


def _form(base, box, rng):
    return base


@dataclass(frozen=True)
class Row:
    """A row of the table: shape, effects, whether a level of a coordinate reads 10 % too low, the slowest speed."""

    shape: Callable = _form
    effects: Callable = lambda box: Effects()
    low: int | None = None
    slowest: float = 0.1

    def box(self, name: str) -> Box:
        """Where a campaign of a printed map is measured."""
        return Box.of(name, self.slowest)

    def draw(self, name: str, box: Box, points: np.ndarray, rng: np.random.Generator) -> Truth:
        """The truth of a campaign that measures `points`."""
        shape = self.shape(lambda x: np.log(printed_force(name, *x.T)), box, rng)
        if self.low is None:
            return Truth(shape, self.effects(box), lambda x: np.zeros(len(x)))
        level = rng.choice(np.unique(np.round(points[:, self.low], 6)))
        return Truth(shape, self.effects(box), lambda x: np.where(abs(x[:, self.low] - level) < 1e-5, np.log(0.9), 0.0))


def _normal(sd, place_sd=0.0):
    return lambda box: Effects(place_sd, stats.norm(0, sd))


def _growing(box):
    per_metre = 0.06 / (box.high[0] - box.low[0])
    return Effects(own=stats.norm(), scale=lambda x: 0.01 + per_metre * (x[:, 0] - box.low[0]))


ROWS = {
    "in the form": Row(),
    "shared 2.2 %, own 0.5 %": Row(effects=_normal(0.005, 0.022)),
    "shared 2.2 %, own 1.5 %": Row(effects=_normal(0.015, 0.022)),
    "shared 3 %, own 1 %": Row(effects=_normal(0.01, 0.03)),
    "plateau": Row(_plateau, slowest=0.05),
    "kink": Row(_kink),
    "ridge": Row(_ridge),
    "stretched arm": Row(_arm),
    "a distance 10 % too low": Row(low=0),
    "a height 10 % too low": Row(low=1),
    "a speed 10 % too low": Row(low=2),
    "bump": Row(_bump),
    "skewed": Row(effects=lambda box: Effects(own=stats.expon(-0.03, 0.03))),
    "growing 1-7 %": Row(effects=_growing),
    "t3": Row(effects=lambda box: Effects(own=stats.t(3, 0, 0.022 / np.sqrt(3)))),
    "along the height": Row(_along_height, _normal(1e-9)),
}
"""Rows of the table, by name; a row is drawn anew for every campaign."""

SMOOTH = {"two masses, v^0.85": Row(_two_bodies)}
"""Truths of a form as smooth as the map's, and another; hardly a form test sees it."""


def fitted(points, log_force, **conditions):
    """A map fitted through the public API to repeats of ln F, shape (n, repeats)."""
    repeats = log_force.shape[1]
    d, h, v = points.repeat(repeats, axis=0).T
    state = np.repeat([f"s{i}" for i in range(len(points))], repeats)
    return fm.fit_force_map(
        fm.ImpactDataset.from_arrays(
            distance=d,
            height=h,
            speed=v,
            peak_force=np.exp(log_force.ravel()),
            state=state,
            conditions=fm.Conditions(**conditions),
        )
    )


def campaigns(name, row, plan, count, seed=15):
    """Points, truths and ln F, shape (n, repeats), of seeded campaigns."""
    rows = ROWS | SMOOTH
    rng, drawn = np.random.default_rng([seed, list(rows).index(row), *name.encode()]), rows[row]
    box = drawn.box(name)
    points = plan(box)
    for _ in range(count):
        truth = drawn.draw(name, box, points, rng)
        yield box, points, truth, truth.measured(points, REPEATS, rng)
