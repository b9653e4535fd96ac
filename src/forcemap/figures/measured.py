"""Measured states, drawn the same way in every figure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.dataset import ImpactDataset, States, StateTolerance
from forcemap.figures.style import CENSORED, TEST, TRAIN, Look
from forcemap.maps.force_map import ForceMap


@dataclass(frozen=True, eq=False)
class Measured:
    """The training and test states to draw, and how far repeats of one may lie apart."""

    train: States | None
    test: States | None
    tolerance: StateTolerance

    @classmethod
    def of(cls, force_map: ForceMap, dataset: ImpactDataset | None) -> Measured:
        """The states of a dataset; without one those of the fitted map, if it was fitted."""
        if dataset is not None:
            return cls.of_dataset(dataset)
        fit, stated = force_map.fit, force_map.conditions
        tolerance = StateTolerance.stated(stated.place_tolerance, stated.speed_tolerance)
        return cls(None, None, tolerance) if fit is None else cls(fit.states, fit.test, tolerance)

    @classmethod
    def of_dataset(cls, dataset: ImpactDataset) -> Measured:
        """The states of a dataset by role."""
        return cls(dataset.train.states, dataset.test.states, dataset.tolerance)

    @property
    def by_look(self) -> list[tuple[Look, States]]:
        """The training and the test states with their looks, where there are any."""
        pairs = [(TRAIN, self.train), (TEST, self.test)]
        return [(look, states) for look, states in pairs if states is not None and len(states)]


def draw_forces(axes: Axes, look: Look, states: States, x: FloatArray, y: FloatArray, least: FloatArray) -> None:
    """Points at (x, y) for states with an uncensored impact, arrows up from (x, least) for censored ones."""
    measured, censored = states.impacts > 0, states.censored > 0
    if measured.any():
        axes.plot(x[measured], y[measured], **look.drawn)
    if censored.any():
        axes.plot(x[censored], least[censored], **CENSORED.drawn)


def levels(values: FloatArray, tolerance: float) -> FloatArray:
    """The values, each once: those within the tolerance of the one below are one, and count with their median."""
    ordered = np.sort(values)
    groups = np.split(ordered, np.flatnonzero(np.diff(ordered) > tolerance) + 1)
    return np.array([np.median(group) for group in groups if group.size])


def a_few(values: FloatArray) -> list[float]:
    """The lowest, the middle and the highest of ascending values."""
    picked = sorted({0, values.size // 2, values.size - 1})
    return [float(values[i]) for i in picked]


def middle(values: FloatArray) -> float:
    """The middle one of ascending values."""
    return float(values[values.size // 2])


def near(values: FloatArray, held: float, tolerance: float) -> Mask:
    """True where a value is the one held, but for the tolerance."""
    return np.asarray(np.abs(values - held) <= tolerance * (1 + 1e-9))
