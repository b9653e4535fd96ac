"""Measured states, drawn the same way in every figure; where they were measured, and how far repeats agree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.dataset import ImpactDataset, States, StateTolerance
from forcemap.campaigns.repeatability import Repeatability
from forcemap.figures import style
from forcemap.figures.canvas import finish, is_wide, new_figure, panels, plain, settings
from forcemap.figures.style import DISTANCE, HEIGHT, PAGE_WIDTH, Look
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap

_RING = 7.0  # [pt] of a marker that another may stand in
_MOST_PANELS = 3  # of a figure of places: a row; more speeds share panels
_MOST_NAMES = 6  # of outliers in a figure
_LONGEST_NAME = 24  # characters of such a name
_POINTS = 81  # of a line


@dataclass(frozen=True, eq=False)
class Measured:
    """Training, test and slower states to draw, the tolerance of repeats, and whether any state is simulated."""

    train: States | None
    test: States | None
    slower: States | None
    tolerance: StateTolerance
    simulated: bool

    @classmethod
    def of(cls, force_map: ForceMap | None, dataset: ImpactDataset | None) -> Measured:
        """The states of a dataset; without one those of the fitted map, if it was fitted."""
        simulated = any(source is not None and source.simulated for source in (force_map, dataset))
        if dataset is not None:
            slower = dataset.select(dataset.slower).states if dataset.slower.any() else None
            return cls(dataset.train.states, dataset.independent_test.states, slower, dataset.tolerance, simulated)
        assert force_map is not None
        fit, stated = force_map.fit, force_map.conditions
        tolerance = StateTolerance.stated(stated.place_tolerance, stated.speed_tolerance)
        states, test = (None, None) if fit is None else (fit.states, force_map.tested)
        return cls(states, test, force_map.slower, tolerance, simulated)

    @property
    def tolerances(self) -> tuple[float, float, float]:
        """Tolerances of distance [m], height [m] and speed [m/s]."""
        return self.tolerance.place, self.tolerance.place, self.tolerance.speed

    @property
    def coordinates(self) -> FloatArray:
        """Distance, height and speed of every state, shape (n, 3)."""
        return np.concatenate([np.empty((0, 3)), *(states.coordinates for _, states in self.by_look)])

    def levels(self, points: FloatArray) -> list[FloatArray]:
        """Distances, heights and speeds of states, shape (n, 3), without repetitions (`levels`)."""
        return [levels(values, tolerance) for values, tolerance in zip(points.T, self.tolerances, strict=True)]

    @property
    def by_look(self) -> list[tuple[Look, States]]:
        """The training, the test and the slower states with their looks, where there are any."""
        pairs = [(style.TRAIN, self.train), (style.TEST, self.test), (style.SLOWER, self.slower)]
        return [(look, states) for look, states in pairs if states is not None and len(states)]


def draw_profile(axes: Axes, measured: Measured, along: int, fixed: Mapping[int, float]) -> None:
    """Forces of the states with these fixed coordinates, against their coordinate along an axis."""
    for look, states in measured.by_look:
        chosen = np.ones(len(states), dtype=np.bool_)
        for i, value in fixed.items():
            chosen &= near(states.coordinates[:, i], value, measured.tolerances[i])
        some = states.select(chosen)
        draw_forces(axes, look, some, some.coordinates[:, along], some.force, some.at_least)


def to_cut_at(force_map: ForceMap, coordinates: FloatArray, speed: float, tolerance: float) -> FloatArray:
    """The states, shape (n, 3), measured at a speed inside the measured range; without any all inside it, or all."""
    inside = coordinates[force_map.measured_range.contains(*coordinates.T)]
    at = inside[near(inside[:, 2], speed, tolerance)]
    return next((states for states in (at, inside) if len(states)), coordinates)


_OUTSIDE = "no map here:\noutside the\nmeasured range"


def within(force_map: ForceMap, along: int, fixed: Mapping[int, float]) -> tuple[list[FloatArray], Mask]:
    """Distance, height and speed along an axis, the others fixed, and where that is inside the measured range."""
    low, high = force_map.measured_range.lowest[along], force_map.measured_range.highest[along]
    x = np.linspace(low, high, _POINTS)
    state = [x if i == along else np.full(x.size, fixed[i]) for i in range(3)]
    return state, force_map.measured_range.contains(*state)


def draw_map(
    axes: Axes, force_map: ForceMap, bound: Bound | None, along: int, fixed: Mapping[int, float]
) -> tuple[FloatArray, FloatArray]:
    """Draw prediction and bound along an axis, the others fixed, within the measured range; returns the line drawn."""
    state, inside = within(force_map, along, fixed)
    x = state[along]
    force = np.where(inside, force_map.predict(*state), np.nan)
    if inside.any():
        style.PREDICTION.plot(axes, x, force)
        if bound is not None:
            style.BOUND.plot(axes, x, np.where(inside, bound.upper(force_map, *state), np.nan))
    elif _OUTSIDE not in [text.get_text() for text in axes.texts]:
        axes.text(0.5, 0.5, _OUTSIDE, transform=axes.transAxes, ha="center", va="center")
    return x, force


def draw_forces(axes: Axes, look: Look, states: States, x: FloatArray, y: FloatArray, least: FloatArray) -> None:
    """Points at (x, y) for states with an uncensored impact, arrows up from (x, least) for censored ones."""
    if (measured := states.impacts > 0).any():
        look.plot(axes, x[measured], y[measured])
    if (censored := states.censored > 0).any():
        style.CENSORED.plot(axes, x[censored], least[censored])


def levels(values: FloatArray, tolerance: float) -> FloatArray:
    """The values without repetitions: those within the tolerance of the next lower one are one, with their median."""
    return np.array([np.median(group) for group in _groups(values, tolerance)])


def measured_often(values: FloatArray, tolerance: float) -> float:
    """The middle one of the frequent values: those that more than half as many states have as the most frequent one."""
    groups = _groups(values, tolerance)
    most = max(group.size for group in groups)
    return middle(np.array([np.median(group) for group in groups if 2 * group.size > most]))


def _groups(values: FloatArray, tolerance: float) -> list[FloatArray]:
    """Ascending values, split where they lie further apart than the tolerance."""
    ordered = np.sort(values)
    groups = np.split(ordered, np.flatnonzero(np.diff(ordered) > tolerance) + 1)
    return [group for group in groups if group.size]


def a_few(values: FloatArray) -> list[float]:
    """The lowest, the middle and the highest of ascending values."""
    picked = sorted({0, values.size // 2, values.size - 1})
    return [float(values[i]) for i in picked]


def middle(values: FloatArray) -> float:
    """The middle one of ascending values."""
    return float(values[values.size // 2])


def near(values: FloatArray, wanted: float, tolerance: float) -> Mask:
    """True where a value is the wanted one within the tolerance."""
    return np.asarray(np.abs(values - wanted) <= tolerance * (1 + 1e-9))


def _around(values: FloatArray) -> tuple[float, float]:
    """Ends of an axis that shows all values, the outermost markers whole."""
    beside = 0.1 * float(np.ptp(values)) + 0.02
    return float(values.min()) - beside, float(values.max()) + beside


@settings()
def measurement_grid_figure(dataset: ImpactDataset, *, width: float = PAGE_WIDTH) -> Figure:
    """Places of the measured states, a panel a speed or few speeds: training, test and censored states by marker.

    Parameters
    ----------
    dataset : ImpactDataset
        The impacts.
    width : float
        Width of the figure [m].
    """
    measured = Measured.of(None, dataset)
    speeds = levels(dataset.states.speed, dataset.tolerance.speed)
    groups = np.array_split(speeds, min(_MOST_PANELS, speeds.size))
    columns = min(len(groups), 3 if is_wide(width) else 2)
    rows = -(-len(groups) // columns)
    across, upwards = (_around(axis) for axis in (dataset.states.distance, dataset.states.height))
    tall = min(1.5, max(0.45, (upwards[1] - upwards[0]) / (across[1] - across[0])))
    figure = new_figure("Places and speeds measured", width, 0.025 + rows * (0.012 + tall * 0.8 * width / columns))
    all_axes = panels(figure, len(groups), columns, share_y=True)
    for i, (axes, group) in enumerate(zip(all_axes, groups, strict=True)):
        low, high = group[0] - dataset.tolerance.speed, group[-1] + dataset.tolerance.speed
        for look, states in measured.by_look:
            here = states.select((states.speed >= low) & (states.speed <= high))
            # a training and a test state at one place are both seen
            drawn = {"zorder": 3} if look is style.TRAIN else {"markersize": _RING}
            look.plot(axes, here.distance, here.height, **drawn)
            if len(censored := here.select(here.censored > 0)):
                style.CENSORED.plot(axes, censored.distance, censored.height)
        words = f"{group[0]:.3g}" + (f" to {group[-1]:.3g}" if group.size > 1 else "")
        axes.set(title=f"{words} m/s", xlabel=DISTANCE if i + columns >= len(groups) else "")
        axes.set_ylabel(HEIGHT if i % columns == 0 else "")
        axes.set(xlim=across, ylim=upwards)
        axes.set_aspect("equal", adjustable="box")
    return finish(figure, simulated=dataset.simulated)


@settings()
def repeatability_figure(
    repeatability: Repeatability, dataset: ImpactDataset | None = None, *, width: float = PAGE_WIDTH
) -> Figure:
    """Standard deviation of the repeats of every state against its force, with the pooled one; outliers are named.

    Parameters
    ----------
    repeatability : Repeatability
        The result.
    dataset : ImpactDataset, optional
        Its impacts; they give the device error and say whether they are simulated.
    width : float
        Width of the figure [m].
    """
    figure = new_figure("Standard deviation of repeats", width, 0.075)
    axes = figure.add_subplot()
    force, sd = repeatability.mean, repeatability.sd
    repeated = np.isfinite(sd)
    style.REPEATED.plot(axes, force[repeated], sd[repeated])
    if (partly := repeated & (repeatability.censored > 0)).any():
        style.CENSORED.plot(axes, force[partly], sd[partly], "some repeats above the device range, not counted")
    if np.isfinite(pooled := repeatability.within_state_sd):
        axes.axhline(pooled, **(style.POOLED.drawn | {"label": f"{style.POOLED.words}: {pooled:.2f} N"}))
        ends = f"mean over the states {repeatability.mean_sd:.2f} N, largest {repeatability.max_sd:.2f} N"
        axes.set_title(ends)
    error = np.nan if dataset is None else dataset.conditions.device.error
    if np.isfinite(error):
        axes.axhline(error, **(style.DEVICE_ERROR.drawn | {"label": f"{style.DEVICE_ERROR.words}: {error:g} N"}))
    outliers = dict.fromkeys(outlier.state for outlier in repeatability.outliers)
    for number, name in enumerate(outliers):
        i = repeatability.state.index(name)
        point = (force[i], sd[i])
        if repeated[i]:
            style.OUTLIER.plot(axes, *point)
        if repeated[i] and number < _MOST_NAMES:
            axes.annotate(
                plain(name, _LONGEST_NAME), point, (6, 0), textcoords="offset points", fontsize=6.5, va="center"
            )
    if not repeated.any():
        axes.text(0.5, 0.5, "no state was repeated", transform=axes.transAxes, ha="center")
    axes.set(xlabel="Mean peak force of the state [N]", ylabel="SD of repeats [N]")
    axes.set_ylim(bottom=0)
    simulated = dataset is not None and dataset.simulated
    return finish(figure, simulated=simulated)
