"""Repeatability: how far repeats of a state agree, which do not, and whether the base angle matters (paper, V-A)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.campaigns.dataset import ImpactDataset

_SAME_ANGLE = 1.0  # base angles this close are one; a choice, wider than a robot's display rounds [deg]
_FALSE_ALARMS = 0.02  # share of campaigns with nothing but noise in which any repeat is named; a choice
_NORMAL_QUARTILE = 0.6744897501960817  # of the standard normal distribution


@dataclass(frozen=True)
class Outlier:
    """A repeat far from the others of its state, base angle and set-up: look at its recording.

    If just two repeats disagree, it is unknown which one is wrong, and both are named.

    Parameters
    ----------
    state : str
        Name of the state.
    repeat : int
        Number of the repeat.
    recording : str
        Name of its raw file.
    force : float
        Its peak force [N].
    others_median : float
        Median force of the other repeats [N].
    deviation : float
        Force less that median [N].
    """

    state: str
    repeat: int
    recording: str
    force: float
    others_median: float
    deviation: float


@dataclass(frozen=True, eq=False)
class Circle:
    """A state measured at several angles of the base joint.

    Parameters
    ----------
    state : str
        Name of the state.
    angle : array
        The angles, from 0 up to 360, shape (k,) [deg].
    force : array
        Mean force at every angle [N]; NaN where all impacts are censored.
    impacts : array of int
        Uncensored impacts at every angle.
    censored : int
        Censored impacts, which no figure here counts: the difference may then be larger.
    difference : float
        Largest difference between the angles [N]; NaN if fewer than two have an uncensored impact.
    difference_percent : float
        The same in percent of the mean over the angles.
    """

    state: str
    angle: FloatArray
    force: FloatArray
    impacts: Indices
    censored: int
    difference: float
    difference_percent: float


@dataclass(frozen=True)
class Symmetry:
    """How much the force depends on the angle of the base joint; repeat noise makes part of it.

    Parameters
    ----------
    circles : tuple of Circle
        The states measured at several angles.
    max_difference, mean_difference : float
        Largest and mean difference over the circles [N]; NaN if none is known.
    max_difference_percent, mean_difference_percent : float
        Largest and mean difference in percent of the circle's mean force.
    """

    circles: tuple[Circle, ...]
    max_difference: float
    mean_difference: float
    max_difference_percent: float
    mean_difference_percent: float


@dataclass(frozen=True, eq=False)
class Repeatability:
    """How far repeats agree; arrays of shape (m,), one entry a state. Censored impacts are left out of all figures.

    Figures in percent of the whole campaign are 100 times the standard deviation of ln F.

    Parameters
    ----------
    state : tuple of str
        Names of the states, in order of distance, height and speed.
    impacts, censored : array of int
        Number of uncensored and of censored repeats.
    mean : array
        Mean peak force [N]; NaN where all are censored.
    sd : array
        Standard deviation of the repeats [N] (about the mean of their base angle); NaN where none is repeated.
    max_sd, mean_sd : float
        Largest and mean standard deviation over the states [N]; NaN if nothing is repeated.
    max_sd_percent, mean_sd_percent : float
        Largest and mean of the standard deviations in percent of their state's mean.
    within_state_sd, within_state_sd_percent : float
        Pooled standard deviation of repeats [N], [%]; NaN if nothing is repeated.
    between_state_sd, between_state_sd_percent : float
        Standard deviation of the states' true forces over the campaign [N], [%], repeat noise taken off. How far
        the force differs between states, not how far a map misses them; NaN with one state or nothing repeated.
    outliers : tuple of Outlier
        Repeats that do not fit the others.
    symmetry : Symmetry or None
        Of the states measured at several base angles; None if there is none.
    """

    state: tuple[str, ...]
    impacts: Indices
    censored: Indices
    mean: FloatArray
    sd: FloatArray
    max_sd: float
    mean_sd: float
    max_sd_percent: float
    mean_sd_percent: float
    within_state_sd: float
    within_state_sd_percent: float
    between_state_sd: float
    between_state_sd_percent: float
    outliers: tuple[Outlier, ...]
    symmetry: Symmetry | None


def repeatability(dataset: ImpactDataset) -> Repeatability:
    """How far the repeats of every state agree.

    Parameters
    ----------
    dataset : ImpactDataset
        Impacts; all roles count. An impact without a base angle has that of the campaign's conditions.

    Returns
    -------
    Repeatability
    """
    states = dataset.states
    members = _by_state(dataset, states.name)
    angles = [_by_angle(dataset, member) for member in members]
    # Repeats proper are uncensored impacts of one state at one base angle in one role: between the roles the device was
    # put up again.
    roles, uncensored = [dataset.role == role for role in ("train", "test")], ~dataset.censored
    cells = [[group[uncensored[group] & role[group]] for group in groups for role in roles] for groups in angles]
    sd = np.array([_sd([dataset.peak_force[cell] for cell in groups]) for groups in cells])
    max_sd, mean_sd = _largest_and_mean(sd)
    max_percent, mean_percent = _largest_and_mean(100 * sd / states.force)
    within, between = _components(dataset.peak_force, cells)
    within_log, between_log = _components(np.log(dataset.peak_force), cells)
    return Repeatability(
        state=states.name,
        impacts=states.impacts,
        censored=states.censored,
        mean=states.force,
        sd=sd,
        max_sd=max_sd,
        mean_sd=mean_sd,
        max_sd_percent=max_percent,
        mean_sd_percent=mean_percent,
        within_state_sd=within,
        within_state_sd_percent=100 * within_log,
        between_state_sd=between,
        between_state_sd_percent=100 * between_log,
        outliers=tuple(_outliers(dataset, [cell for groups in cells for cell in groups if cell.size > 1])),
        symmetry=_symmetry(dataset, states.name, angles),
    )


def _by_state(dataset: ImpactDataset, names: tuple[str, ...]) -> list[Indices]:
    """Impacts of every state, in the order of the names."""
    order = np.argsort(dataset.state, kind="stable")
    present, first = np.unique(dataset.state[order], return_index=True)
    groups = dict(zip(present.tolist(), np.split(order, first[1:]), strict=True))
    return [groups[name] for name in names]


def _angle(dataset: ImpactDataset, member: Indices) -> FloatArray:
    """Base angles from 0 up to 360 [deg]; NaN where neither the impact nor the campaign states one."""
    angle = dataset.base_angle[member]
    return np.asarray(np.where(np.isnan(angle), dataset.conditions.base_angle, angle) % 360)


def _by_angle(dataset: ImpactDataset, member: Indices) -> list[Indices]:
    """Impacts of a state by base angle, ascending; those without one last."""
    angle = _angle(dataset, member)
    order = np.argsort(angle, kind="stable")  # NaN last
    member, angle = member[order], angle[order]
    stated = int(np.sum(~np.isnan(angle)))
    steps = np.flatnonzero(np.diff(angle[:stated]) > _SAME_ANGLE * (1 + 1e-9)) + 1
    groups = np.split(member[:stated], steps) if stated else []
    if len(groups) > 1 and angle[0] + 360 - angle[stated - 1] <= _SAME_ANGLE * (1 + 1e-9):
        groups = [np.concatenate([groups[-1], groups[0]]), *groups[1:-1]]  # 359.8 and 0.1 deg are one angle
    return groups + ([member[stated:]] if stated < member.size else [])


def _sd(cells: list[FloatArray]) -> float:
    """Standard deviation of values about the mean of their cell; NaN where no cell has two."""
    freedom = sum(max(cell.size - 1, 0) for cell in cells)
    squares = sum(float(np.sum((cell - cell.mean()) ** 2)) for cell in cells if cell.size)
    return math.sqrt(squares / freedom) if freedom else math.nan


def _components(values: FloatArray, cells: list[list[Indices]]) -> tuple[float, float]:
    """Standard deviations within and between states: one-way random effects by the method of moments.

    With n_i impacts in state i, N in k states: E[MSB] = s_w^2 + n_0 s_b^2, n_0 = (N - sum n_i^2 / N) / (k - 1)
    (Searle, Casella, McCulloch: Variance Components, 1992, section 3.6).
    """
    states = [np.concatenate([values[cell] for cell in groups]) for groups in cells]
    states = [state for state in states if state.size]
    within = _sd([values[cell] for groups in cells for cell in groups])
    if math.isnan(within) or len(states) < 2:
        return within, math.nan
    n = np.array([state.size for state in states], dtype=np.float64)
    mean = np.array([state.mean() for state in states])
    total = n.sum()
    between_squares = float(np.sum(n * (mean - np.sum(n * mean) / total) ** 2)) / (n.size - 1)
    effective = (total - np.sum(n**2) / total) / (n.size - 1)
    return within, math.sqrt(max(0.0, (between_squares - within**2) / float(effective)))


def _outliers(dataset: ImpactDataset, cells: list[Indices]) -> list[Outlier]:
    """Repeats further from the median of the others of their cell than device error and noise explain.

    The noise is that of the campaign: the median difference of two repeats, which outliers hardly move, both in
    newtons and as a share of the force; a repeat must stand out in both. The t quantile allows for the number of
    repeats examined and for the low efficiency of the median (half the degrees of freedom).
    """
    from scipy.special import stdtrit

    if not cells:
        return []
    examined = sum(cell.size for cell in cells)
    freedom = sum(cell.size - 1 for cell in cells) / 2
    quantile = -float(stdtrit(freedom, _FALSE_ALARMS / (2 * examined)))
    force, log_force = dataset.peak_force, np.log(dataset.peak_force)
    least = dataset.conditions.device.error_or_default
    noise, log_noise = quantile * _robust_sd(force, cells), quantile * _robust_sd(log_force, cells)

    def beyond(apart: FloatArray, log_apart: FloatArray, others: int) -> Mask:
        # SD of a value less the median of others, in units of the noise; the median of up to two is their mean.
        spread = math.sqrt(1 + (1 if others <= 2 else math.pi / 2) / others)
        return np.asarray((np.abs(apart) > max(least, noise * spread)) & (np.abs(log_apart) > log_noise * spread))

    outliers: list[Outlier] = []
    for cell in _spreading(force, cells, max(least, noise)):
        rest = cell
        while rest.size > 1:
            median = _medians_of_others(force[rest])
            apart = force[rest] - median
            suspect = beyond(apart, log_force[rest] - np.log(median), rest.size - 1)
            if not suspect.any():
                break
            # One at a time: an outlier also moves the median that the others are compared with.
            worst = np.arange(2) if rest.size == 2 else np.array([np.where(suspect, np.abs(apart), -1.0).argmax()])
            named = zip(rest[worst].tolist(), median[worst].tolist(), strict=True)
            outliers += [_outlier(dataset, impact, others_median) for impact, others_median in named]
            rest = np.delete(rest, worst)
    return outliers


def _spreading(values: FloatArray, cells: list[Indices], apart: float) -> list[Indices]:
    """The cells whose values span more than that; in the others none is further than that from any median."""
    starts, values = np.cumsum([0, *(cell.size for cell in cells[:-1])]), values[np.concatenate(cells)]
    spans = np.maximum.reduceat(values, starts) - np.minimum.reduceat(values, starts)
    return [cell for cell, span in zip(cells, spans.tolist(), strict=True) if span > apart]


def _medians_of_others(values: FloatArray) -> FloatArray:
    """For every value, shape (n,), n > 1, the median of the others."""
    order, most = np.sort(values), values.size - 2
    rank = np.searchsorted(order, values)  # of values that are equal any may be left out
    low, high = (np.full(values.size, k) for k in (most // 2, (most + 1) // 2))
    return np.asarray((order[low + (low >= rank)] + order[high + (high >= rank)]) / 2)


def _outlier(dataset: ImpactDataset, impact: int, others_median: float) -> Outlier:
    force, state, recording = float(dataset.peak_force[impact]), dataset.state[impact], dataset.recording[impact]
    repeat = int(dataset.repeat[impact])
    return Outlier(str(state), repeat, str(recording), force, others_median, deviation=force - others_median)


def _robust_sd(values: FloatArray, cells: list[Indices]) -> float:
    """Standard deviation of repeats from the median absolute difference of two in a cell (Shamos 1976)."""
    pairs = [np.abs(np.subtract.outer(values[cell], values[cell])[_above_diagonal(cell.size)]) for cell in cells]
    return float(np.median(np.concatenate(pairs))) / (_NORMAL_QUARTILE * math.sqrt(2))


@lru_cache(maxsize=8)
def _above_diagonal(size: int) -> Mask:
    """Every pair once, shape (size, size)."""
    return np.asarray(np.triu(np.ones((size, size), dtype=np.bool_), 1))


def _symmetry(dataset: ImpactDataset, names: tuple[str, ...], angles: list[list[Indices]]) -> Symmetry | None:
    stated = [[group for group in groups if not np.isnan(_angle(dataset, group)[0])] for groups in angles]
    circles = [_circle(dataset, name, groups) for name, groups in zip(names, stated, strict=True) if len(groups) > 1]
    if not circles:
        return None
    largest, mean = _largest_and_mean(np.array([circle.difference for circle in circles]))
    percent = _largest_and_mean(np.array([circle.difference_percent for circle in circles]))
    return Symmetry(tuple(circles), largest, mean, *percent)


def _circle(dataset: ImpactDataset, name: str, groups: list[Indices]) -> Circle:
    measured = [group[~dataset.censored[group]] for group in groups]
    force = np.array([dataset.peak_force[group].mean() if group.size else math.nan for group in measured])
    known = force[~np.isnan(force)]
    difference = float(np.ptp(known)) if known.size > 1 else math.nan
    return Circle(
        state=name,
        angle=np.array([_angle(dataset, group)[0] for group in groups]),
        force=force,
        impacts=np.array([group.size for group in measured]),
        censored=int(sum(dataset.censored[group].sum() for group in groups)),
        difference=difference,
        difference_percent=100 * difference / float(known.mean()) if known.size else math.nan,
    )


def _largest_and_mean(values: FloatArray) -> tuple[float, float]:
    """Largest and mean of the values that are not NaN; NaN if there are none."""
    known = values[~np.isnan(values)]
    return (float(known.max()), float(known.mean())) if known.size else (math.nan, math.nan)
