"""Fedorov's exchange: states of a design are replaced by better ones until none is."""

from __future__ import annotations

import math

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.campaigns.state import StateTolerance
from forcemap.errors import RankDeficient

_SWEEPS = 30  # over all states of a design; ten settle nearly every one
_RIDGE = 1e-6  # share of the information of the mean state that keeps a start with too few states invertible


class Apart:
    """Which candidates are repeats of others, or of the fixed states."""

    def __init__(self, points: FloatArray, known: FloatArray, tolerance: StateTolerance) -> None:
        self._scaled = points / tolerance.scale
        self._near: dict[int, Mask] = {}
        self.free = np.ones(len(points), dtype=np.bool_)
        for state in known / tolerance.scale:
            self.free &= np.abs(self._scaled - state).max(axis=1) > 1

    def near(self, index: int) -> Mask:
        """Candidates that are repeats of one, itself included."""
        if index not in self._near:
            self._near[index] = (np.abs(self._scaled - self._scaled[index]) <= 1).all(axis=1)
        return self._near[index]


class Exchange:
    """The search; rows of x are whitened, so that sums of squares are of one size."""

    def __init__(
        self, x: FloatArray, known: FloatArray, moment: FloatArray, apart: Apart, must: Indices, n: int
    ) -> None:
        self._x, self._known, self._moment, self._apart, self._must, self._n = x, known, moment, apart, must, n

    def from_start(self, rng: np.random.Generator) -> tuple[float, Indices]:
        """The criterion and the design that the exchange reaches from a random one; infinite if there is none."""
        x, free = self._x, self._apart.free.copy()
        for one in self._must.tolist():
            free &= ~self._apart.near(one)
        chosen = self._must.tolist()
        while len(chosen) < self._n:
            left = np.flatnonzero(free)
            if not left.size:
                return math.inf, np.array(chosen)
            chosen.append(int(rng.choice(left)))
            free &= ~self._apart.near(chosen[-1])
        ridge = _RIDGE * np.eye(x.shape[1])
        information = self._known + ridge + x[chosen].T @ x[chosen]
        taken = np.sum([self._apart.near(one) for one in chosen], axis=0)
        for _ in range(_SWEEPS):
            changed = False
            for i in range(self._must.size, self._n):
                rest = information - np.outer(x[chosen[i]], x[chosen[i]])
                others = taken - self._apart.near(chosen[i])
                best = self._best(rest, self._apart.free & (others == 0), chosen[i])
                if best != chosen[i]:
                    chosen[i], changed = best, True
                    information = rest + np.outer(x[best], x[best])
                    taken = others + self._apart.near(best)
            if not changed:
                break
        index = np.sort(np.array(chosen, dtype=np.int64))
        information = self._known + x[index].T @ x[index]
        if np.linalg.cond(information) > 1e12:
            return math.inf, index
        return float(np.trace(np.linalg.solve(information, self._moment))), index

    def _best(self, rest: FloatArray, free: Mask, current: int) -> int:
        """The free candidate that lowers the criterion most, given the information of the other states."""
        inverse = np.linalg.inv(rest)
        both = self._x @ np.hstack([inverse @ self._moment @ inverse, inverse])
        p = self._x.shape[1]
        lower = np.einsum("ij,ij->i", both[:, :p], self._x) / (1 + np.einsum("ij,ij->i", both[:, p:], self._x))
        best = int(np.where(free, lower, -math.inf).argmax())
        return best if lower[best] > lower[current] * (1 + 1e-9) else current


def whitening(design: FloatArray) -> FloatArray:
    """R^-1 sqrt(m) of the design = QR: afterwards the mean of x x' is the unit matrix."""
    length = np.linalg.norm(design, axis=0)
    length[length == 0] = 1.0
    q_r = np.linalg.qr(design / length, mode="r")
    if len(q_r) < design.shape[1] or np.linalg.cond(q_r) > 1e8:
        raise RankDeficient(
            f"found candidates that do not tell the {design.shape[1]} terms of the form apart; "
            "offer more distances, heights or speeds, or choose a form with fewer terms"
        )
    return np.asarray(np.linalg.inv(q_r) / length[:, None] * math.sqrt(len(design)))
