"""Whether plans and bounds keep their promise: campaigns of known truths, with effects of places and states."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import forcemap as fm
from forcemap.arrays import FloatArray
from forcemap.sweeps.block import Computed
from forcemap.sweeps.entries import Entries

_CAMPAIGNS_AT_ONCE = 20  # in a block, unless stated; a choice: a second
_NOISE = 0.005  # of ln F between repeats of a state, as in docs/validity.md
_PROMISED = 0.95  # share of states below the bound, and the bound's content
_GRID = (13, 13, 10)  # distances, heights, speeds at which the bound is held against the truth, as in docs/validity.md
_SAME_PLACE = 6  # decimals of a place [m]


@dataclass(frozen=True, eq=False)
class ValidityCase:
    """Campaigns of one plan on a printed map's force with normal effects of places and states, each fitted anew.

    A campaign is covered if its tolerance bound lies above 95 % of the true states of a fine grid.

    Parameters
    ----------
    name : str
        Truth, plan and effects.
    truth : ForceMap
        A published map.
    points : array, shape (n, 3)
        The states that are measured, n counting those measured again [m, m, m/s].
    place_sd, state_sd : float
        Standard deviations of the effects, of ln F.
    repeats : int
        Impacts of a state.
    campaigns, at_once : int
        Number of campaigns, and of those in a block.
    """

    name: str
    truth: fm.ForceMap
    points: FloatArray
    place_sd: float
    state_sd: float
    repeats: int
    campaigns: int
    at_once: int

    means: ClassVar[tuple[str, ...]] = ("covered", "share_below", "width_ln", "refused")
    best: ClassVar[tuple[str, bool]] = ("share_below", False)

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return math.ceil(self.campaigns / self.at_once)

    def compute(self, number: int, rng: np.random.Generator) -> Computed:
        """A row for each campaign; a campaign whose map or bound is refused has no figures but that."""
        first = number * self.at_once
        rows = [self._campaign(rng) for _ in range(min(self.at_once, self.campaigns - first))]
        names = ("campaign", *self.means)
        columns = np.array([(first + i, *row) for i, row in enumerate(rows)]).T
        note = f"SIMULATED campaigns, truth {self.truth.name}: they judge plan and bound, no robot"
        return Computed(dict(zip(names, columns, strict=True)), (note,))

    def _campaign(self, rng: np.random.Generator) -> tuple[float, float, float, float]:
        """Whether a campaign is covered, the share of states below its bound, its mean width, whether it is refused."""
        from scipy.special import ndtr

        _, place = np.unique(np.round(self.points[:, :2], _SAME_PLACE), axis=0, return_inverse=True)
        effect = rng.normal(0, self.place_sd, place.max() + 1)[place.ravel()]
        state = np.log(self.truth.predict(*self.points.T)) + effect + rng.normal(0, self.state_sd, len(self.points))
        measured = np.exp(np.repeat(state, self.repeats) + rng.normal(0, _NOISE, state.size * self.repeats))
        at = np.repeat(self.points, self.repeats, axis=0).T
        names = np.repeat([f"s{i}" for i in range(state.size)], self.repeats)
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        query = np.array(list(itertools.product(*map(np.linspace, low, high, _GRID)))).T
        true = np.log(self.truth.predict(*query))
        try:
            dataset = fm.ImpactDataset.from_arrays(
                distance=at[0], height=at[1], speed=at[2], peak_force=measured, state=names
            )
            upper = np.log(fm.ToleranceBound(device_error=0.0).upper(fm.fit_force_map(dataset), *query))
        except (fm.BoundNotAvailable, fm.FitError):
            return math.nan, math.nan, math.nan, 1.0
        below = float(ndtr((upper - true) / math.hypot(self.place_sd, self.state_sd)).mean())
        return float(below >= _PROMISED), below, float((upper - true).mean()), 0.0


def validity_cases(entries: Entries) -> Iterator[ValidityCase]:
    """The cases of a study: every truth with every plan and every pair of effects."""
    truths, designs = entries.texts("truths"), entries.texts("designs", [fm.Design.SPREAD.value])
    places, states = entries.numbers("place_sd", [0.0]), entries.numbers("state_sd")
    repeats, campaigns = entries.whole("repeats", 3), entries.whole("campaigns")
    at_once = entries.whole("block", _CAMPAIGNS_AT_ONCE)
    span = entries.span("speeds_mps")
    if unknown := [name for name in designs if name not in set(fm.Design)]:
        raise entries.error("designs", f"found {unknown[0]!r}, expected some of {', '.join(fm.Design)}")
    if not min(states):
        raise entries.error("state_sd", "found 0, expected shares above 0: without effects nothing tells how far off")
    for name, design in itertools.product(truths, designs):
        truth = fm.published_map(name)
        box = truth.measured_range
        ranges = (*zip(box.lowest[:2].tolist(), box.highest[:2].tolist(), strict=True), span)
        plan = fm.plan_measurements(*ranges, design=fm.Design(design), repeats=1, again=0)
        points = np.column_stack([plan.distance, plan.height, plan.speed])
        for place_sd, state_sd in itertools.product(places, states):
            effects = f"places {100 * place_sd:g} %, states {100 * state_sd:g} %"
            figures = (place_sd, state_sd, repeats, campaigns, at_once)
            yield ValidityCase(f"{name}, {design}, {effects}", truth, points, *figures)
