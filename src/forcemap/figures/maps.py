"""Figures of a map: its profiles, the workspace, its residuals, and other models beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.comparisons.force_models import Comparison, ModelComparison
from forcemap.figures import style
from forcemap.figures.canvas import FewTicks, colour_bar, finish, is_wide, new_figure, panels, settings
from forcemap.figures.ends import AT_END, keep_apart, write_at_end
from forcemap.figures.layout import Room
from forcemap.figures.measured import (
    Measured,
    a_few,
    draw_forces,
    draw_map,
    draw_profile,
    measured_often,
    near,
    to_cut_at,
    within,
)
from forcemap.figures.style import DISTANCE, FORCE, HEIGHT, PAGE_WIDTH, QUANTITY, SPEED
from forcemap.limits.pfl import pfl_contact_force
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.maps.measured_range import MeasuredRange

_AXES = (DISTANCE, HEIGHT, SPEED)
WORDS = ("distance {:.2f} m", "height {:.2f} m", "speed {:.2f} m/s")
_ALONG_SPEED = 2  # number of the axis
_TOUCH = 0.3  # share of an axis in space that the words at a tick take
_POINTS = 33  # of a slice of the workspace along each axis
_SHADES = 20  # of its force
_LOOKS = {"CFM_2D": style.MAP_2D, "CFM_2D per height": style.MAP_2D_PER_HEIGHT, "contact model": style.STANDARD}


@settings()
def force_profiles_figure(
    force_map: ForceMap,
    dataset: ImpactDataset | None = None,
    *,
    bound: Bound | None = None,
    speeds: Sequence[float] | None = None,
    width: float = PAGE_WIDTH,
) -> Figure:
    """Force against distance, height and speed, the other variables held at values that many states have.

    Lines are drawn for the lowest, middle and highest measured speed (against speed: distance), each with its value
    at its end, and end where the measured range ends; states that lie on no line are not shown.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    dataset : ImpactDataset, optional
        Measured states to show; those of a fitted map if not given.
    bound : Bound, optional
        Bound to draw dashed.
    speeds : sequence of float, optional
        Speeds of the lines [m/s].
    width : float
        Width of the figure [m].

    Raises
    ------
    BoundNotAvailable
        The map cannot carry the bound.
    """
    if bound is not None:
        bound.require(force_map)
    measured, wide = Measured.of(force_map, dataset), is_wide(width)
    figure = new_figure("Force against distance, height and speed", width, 0.068 if wide else 0.16)
    ends: list[Annotation] = []
    for along, axes in enumerate(panels(figure, 3, 3 if wide else 1, share_y=wide)):
        by, constant = _held(along)
        for fixed in _lines(force_map, measured, along, speeds):
            x, force = draw_map(axes, force_map, bound, along, fixed)
            if np.sum(~np.isnan(force)) > 1:  # else the range touches the line at one point, where nothing is drawn
                ends += write_at_end(axes, x, force, WORDS[by].format(fixed[by]).partition(" ")[2])
            draw_profile(axes, measured, along, fixed)
            level = fixed[constant]
        axes.set(xlabel=_AXES[along], title=f"{WORDS[constant].format(level)}\nlines: {WORDS[by].split()[0]}")
        axes.margins(y=0.12)
        if axes.get_subplotspec().is_first_col():  # type: ignore[union-attr]
            axes.set_ylabel(FORCE)
    for axes in figure.axes[: 1 if wide else None]:  # after all of a shared axis is drawn: its top stays
        axes.set_ylim(bottom=0)
    finish(figure, simulated=measured.simulated, room=AT_END)
    keep_apart(ends)
    return figure


def _held(along: int) -> tuple[int, int]:
    """Which variable differs from line to line of the profile along an axis, and which is the same for all."""
    by = 0 if along == _ALONG_SPEED else _ALONG_SPEED
    return by, 3 - along - by


def _lines(
    force_map: ForceMap, measured: Measured, along: int, speeds: Sequence[float] | None
) -> list[dict[int, float]]:
    """What each line of the profile along an axis is held at: those that cross the measured range, if any does."""
    (by, constant), points = _held(along), force_map.measured_range.points
    level = measured_often(points[:, constant], measured.tolerances[constant])
    values = speeds if speeds and by == _ALONG_SPEED else a_few(measured.levels(points)[by])
    lines = [{by: value, constant: level} for value in values]
    return [fixed for fixed in lines if within(force_map, along, fixed)[1].sum() > 1] or lines


def profile_states_shown(
    force_map: ForceMap, dataset: ImpactDataset | None, speeds: Sequence[float] | None = None
) -> tuple[int, int]:
    """How many measured states `force_profiles_figure` shows, and how many there are."""
    measured = Measured.of(force_map, dataset)
    on_line = [
        np.all([near(measured.coordinates[:, i], value, measured.tolerances[i]) for i, value in fixed.items()], axis=0)
        for along in range(3)
        for fixed in _lines(force_map, measured, along, speeds)
    ]
    return int(np.any(on_line, axis=0).sum()), len(measured.coordinates)


def workspace_states_shown(
    force_map: ForceMap, dataset: ImpactDataset | None, speeds: Sequence[float] | None = None
) -> tuple[int, int]:
    """How many measured states `workspace_figure` shows, and how many there are."""
    measured = Measured.of(force_map, dataset)
    speed = measured.coordinates[:, _ALONG_SPEED]
    slices = speeds or a_few(measured.levels(force_map.measured_range.points)[_ALONG_SPEED])
    seen = np.any([near(speed, value, measured.tolerance.speed) for value in slices], axis=0)
    return int(seen.sum()), speed.size


@settings()
def workspace_figure(
    force_map: ForceMap,
    dataset: ImpactDataset | None = None,
    *,
    speeds: Sequence[float] | None = None,
    width: float = PAGE_WIDTH,
) -> Figure:
    """Predicted force over distance, height and speed as colour, with the measured states (paper, section V-A).

    Slices of the workspace at the lowest, middle and highest measured speed, as far as the measured range reaches;
    the states measured at these speeds lie on them, others are not shown.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    dataset : ImpactDataset, optional
        Measured states to show; those of a fitted map if not given.
    speeds : sequence of float, optional
        Speeds of the slices [m/s].
    width : float
        Width of the figure [m].
    """
    measured = Measured.of(force_map, dataset)
    reach = force_map.measured_range
    ticks = [a_few(values) for values in measured.levels(reach.points)]
    ticks[_ALONG_SPEED] = sorted(speeds) if speeds else ticks[_ALONG_SPEED]
    corners = np.meshgrid(*np.linspace(reach.lowest[:2], reach.highest[:2], _POINTS, axis=1), indexing="ij")
    state = *corners, np.c_[ticks[2]][:, None]
    slices = np.ma.masked_invalid(np.where(reach.contains(*state), force_map.predict(*state), np.nan))
    known = slices.compressed()
    low = known.min() if known.size else 0.0
    high = max(low + 1.0, known.max(initial=low))
    scale = Normalize(low, high)

    wide = is_wide(width)
    figure = new_figure("Predicted force over distance, height and speed", width, (0.68 if wide else 1.1) * width)
    axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    shades = {"levels": np.linspace(low, high, _SHADES + 1), "norm": scale, "cmap": QUANTITY}
    for number, (speed, force) in enumerate(zip(ticks[2], slices, strict=True)):
        if force.count():
            axes.contourf(*corners, force, offset=speed, **shades).set(
                edgecolor="face", linewidth=0.1, zorder=2 * number
            )
        for look, states in measured.by_look:
            here = states.select(near(states.speed, speed, measured.tolerance.speed))
            small = {} if wide else {"markersize": 0.6 * look.size}
            seen = look.drawn | small | {"path_effects": [withStroke(linewidth=2.4, foreground="white")]}
            axes.plot(here.distance, here.height, here.speed, zorder=2 * number + 1, **seen)
            if len(above := here.select(here.censored > 0)):
                axes.plot(above.distance, above.height, above.speed, zorder=2 * number + 1, **style.CENSORED.drawn)
    beside = 0.05 * (ticks[2][-1] - ticks[2][0]) or 0.01
    axes.set(xlabel=DISTANCE, ylabel=HEIGHT, zlabel=SPEED, zlim=(ticks[2][0] - beside, ticks[2][-1] + beside))
    for set_ticks, places in zip((axes.set_xticks, axes.set_yticks, axes.set_zticks), ticks, strict=True):
        shown = _clear(places)
        set_ticks(shown, [f"{place:.2f}" for place in shown])
    axes.yaxis.labelpad = 11  # its ticks stand aslant before it
    axes.view_init(elev=18, azim=-58)
    axes.set_box_aspect((1, 1, 1.25), zoom=0.95 if wide else 1.05)  # its labels need room
    colour_bar(axes, ScalarMappable(scale, QUANTITY), f"Predicted {FORCE[0].lower()}{FORCE[1:]}")
    bare = [f"{speed:.2f}" for speed, force in zip(ticks[2], slices, strict=True) if not _has_area(force)]
    first = [f"No slice at {', '.join(bare)} m/s: the measured range has no area there"] * bool(bare)
    return finish(figure, simulated=measured.simulated, first=first, room=Room(left=-26.0, right=26.0))


def _has_area(force: Any) -> bool:
    """Whether masked forces, shape (n, m), fill more than a line: three corners of a square between neighbours."""
    known = (~np.ma.getmaskarray(force)).astype(int)
    return bool(np.any(known[1:, 1:] + known[1:, :-1] + known[:-1, 1:] + known[:-1, :-1] >= 3))


def _clear(places: Sequence[float]) -> list[float]:
    """Ascending places without those between the ends whose words would touch the next one's."""
    reach = places[-1] - places[0]
    return [
        place
        for place in places
        if place in (places[0], places[-1]) or _TOUCH < (place - places[0]) / reach < 1 - _TOUCH
    ]


@settings()
def residuals_figure(
    force_map: ForceMap, dataset: ImpactDataset, *, plan: MeasurementPlan | None = None, width: float = PAGE_WIDTH
) -> Figure:
    """Measured less predicted force, in percent of measured, against force, place, speed and order of the states.

    Above zero the map underestimates: the dangerous side. Places are numbered by distance, then height.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    dataset : ImpactDataset
        Measured states.
    plan : MeasurementPlan, optional
        Gives the order in which states were to be measured; that of the table if not given.
    width : float
        Width of the figure [m].
    """
    measured, wide = Measured.of(force_map, dataset), is_wide(width)
    columns = 3 if wide else 2
    figure = new_figure("Residuals against force, place, speed and order", width, 0.11 if wide else 0.17)
    all_axes = panels(figure, 6, columns, share_y=True)
    place = dict(zip(dataset.states.name, (dataset.states.place + 1).tolist(), strict=True))
    runs = (plan.role, plan.state_id) if plan else (dataset.role, dataset.state)
    order = {run: i + 1 for i, run in enumerate(dict.fromkeys(zip(*(column.tolist() for column in runs), strict=True)))}
    for look, states in replace(measured, slower=None).by_look:  # the map is not to hold for these
        predicted = np.asarray(force_map.predict(states.distance, states.height, states.speed))
        residual = 100 * (states.force - predicted) / states.force
        at_least = 100 * (states.at_least - predicted) / states.at_least
        role = "train" if look is style.TRAIN else "test"
        place_number = np.array([place[name] for name in states.name])
        turn = np.array([order.get((role, name), np.nan) for name in states.name])
        for axes, x in zip(all_axes, (predicted, *states.coordinates.T, place_number, turn), strict=True):
            draw_forces(axes, look, states, x, residual, at_least)
    low, high = all_axes[0].get_ylim()
    low, high = min(low, -1.0), max(high, 1.0)
    room = 0.12 * (high - low)  # for the words
    counted = ("Place, by distance", "Order measured")
    labels = ("Predicted force [N]", *_AXES, *counted)
    for i, (axes, words) in enumerate(zip(all_axes, labels, strict=True)):
        axes.axhspan(0, high + room, color=style.PALE, alpha=0.6, linewidth=0, zorder=0)
        axes.axhline(0, color="#404040", linewidth=0.8)
        axes.set_ylim(low - room, high + room)
        axes.set_xlabel(words)
        axes.xaxis.set_major_locator(FewTicks(5 if wide else 3, integer=words in counted))
        if i % columns == 0:
            axes.set_ylabel("Measured − predicted\n[% of measured]")
        axes.text(0.02, 0.98, "underestimated", transform=axes.transAxes, fontsize=6.5, va="top")
        axes.text(0.02, 0.02, "overestimated", transform=axes.transAxes, fontsize=6.5, va="bottom")
    return finish(figure, simulated=measured.simulated)


@settings()
def model_comparison_figure(
    comparison: Comparison,
    dataset: ImpactDataset,
    force_map: ForceMap,
    *,
    maps_2d: Sequence[ForceMap] = (),
    robot_mass: float,
    body_mass: float,
    stiffness: float,
    speed: float | None = None,
    height: float | None = None,
    distance: float | None = None,
    width: float = PAGE_WIDTH,
) -> Figure:
    """Force at one speed by the map, the 2D map and the standard, with measured states and the models' errors.

    Force against distance at one height and against height at one distance (paper, section V-C), and how far each
    model is from the measured states.

    Parameters
    ----------
    comparison : Comparison
        The models compared (`compare_force_models`); its bound is drawn.
    dataset : ImpactDataset
        The impacts that were compared.
    force_map : ForceMap
        The measured map.
    maps_2d : sequence of ForceMap
        Maps of form CFM_2D: one for all heights, or one for each height.
    robot_mass, body_mass, stiffness : float
        Of the contact model, as for `compare_force_models` [kg], [kg], [N/m]: as
        `contact_model(dataset.conditions, area).figures` gives them (forcemap.comparisons.contact_model).
    speed, height, distance : float, optional
        Where to cut [m/s], [m], [m]; values that many states in the measured range have if not given.
    width : float
        Width of the figure [m].

    Raises
    ------
    BoundNotAvailable
        The map cannot carry the bound of the comparison.
    """
    measured, place = Measured.of(force_map, dataset), dataset.tolerance.place
    if speed is None:
        speed = measured_often(force_map.measured_range.points[:, 2], dataset.tolerance.speed)
    d, h, _ = to_cut_at(force_map, dataset.states.coordinates, speed, dataset.tolerance.speed).T
    given = ((distance, d), (height, h))
    fixed_at = {i: measured_often(of, place) if value is None else value for i, (value, of) in enumerate(given)}
    standard = float(pfl_contact_force(speed, robot_mass=robot_mass, body_mass=body_mass, stiffness=stiffness))

    wide = is_wide(width)
    figure = new_figure("Force by the map, the 2D map and the standard", width, 0.075 if wide else 0.175)
    *against, errors = panels(figure, 3, 3 if wide else 1)
    for along, axes in enumerate(against):
        fixed = {1 - along: fixed_at[1 - along], 2: speed}
        x, _ = draw_map(axes, force_map, comparison.bound, along, fixed)
        draw_2d(axes, maps_2d, along, fixed_at, speed, place, x)
        style.STANDARD.plot(axes, [x[0], x[-1]], [standard, standard])
        draw_profile(axes, measured, along, fixed)
        title = "\n".join(WORDS[i].format(value) for i, value in fixed.items())
        axes.set(xlabel=_AXES[along], ylabel=FORCE, title=title)
        axes.margins(y=0.12)
        axes.set_ylim(bottom=0)
    return finish(figure, simulated=measured.simulated, also=[_draw_errors(errors, comparison)])


def draw_2d(
    axes: Axes,
    maps_2d: Sequence[ForceMap],
    along: int,
    fixed_at: dict[int, float],
    speed: float,
    tolerance: float,
    x: FloatArray,
    *,
    of_map: bool = False,
) -> None:
    """The map that covers the heights of all as a line; maps of one height at that height, and as far as measured.

    `of_map`: fitted to the 3D map.
    """
    whole, single = (
        (style.MAP_2D_OF_MAP, style.MAP_2D_PER_HEIGHT_OF_MAP) if of_map else (style.MAP_2D, style.MAP_2D_PER_HEIGHT)
    )
    lowest = min((each.measured_range.lowest[1] for each in maps_2d), default=0.0)
    highest = max((each.measured_range.highest[1] for each in maps_2d), default=0.0)
    own: list[tuple[float, float]] = []
    distances = x if along == 0 else np.full(x.size, fixed_at[0])
    for map_2d in maps_2d:
        low, high = map_2d.measured_range.lowest[1], map_2d.measured_range.highest[1]
        if (low, high) == (lowest, highest):
            whole.plot(axes, x, map_2d.predict(distances, 0.0, speed))
            continue
        reach = MeasuredRange(map_2d.measured_range.points * [1.0, 0.0, 1.0])  # in distance and speed: it has no height
        inside = reach.contains(distances, np.zeros(x.size), np.full(x.size, speed))
        force = np.where(inside, map_2d.predict(distances, 0.0, speed), np.nan)
        if along == 1:
            own.append(((low + high) / 2, float(force[0])))  # NaN: a gap in the line, as nothing was measured there
        elif along == 0 and inside.any() and low - tolerance <= fixed_at[1] <= high + tolerance:
            single.plot(axes, x, force, marker="")
    if np.isfinite([force for _, force in own]).any():
        heights, forces = zip(*sorted(own), strict=True)
        single.plot(axes, heights, forces)


def _draw_errors(axes: Axes, comparison: Comparison) -> Line2D:
    """Largest and mean errors of each model in percent of measured; underestimation to the right, hatched.

    Returns the legend's entry for the ticks.
    """
    for row, model in enumerate(comparison.models):
        look, accuracy = _LOOKS.get(model.model, style.PREDICTION), model.accuracy
        over: dict[str, Any] = {"color": look.colour, "edgecolor": "#303030", "linewidth": 0.5, "height": 0.55}
        axes.barh(row, -accuracy.max_overestimation_percent, alpha=0.45, **over)
        axes.barh(row, accuracy.max_underestimation_percent, hatch="//////", **over)
        for mean in (-accuracy.mean_overestimation_percent, accuracy.mean_underestimation_percent):
            axes.plot([mean, mean], [row - 0.27, row + 0.27], color="#000000", linewidth=1.2)
    axes.axvline(0, color="#404040", linewidth=0.7)
    most = max(model.accuracy.states for model in comparison.models)
    axes.set_yticks(range(len(comparison.models)), [_of_states(model, most) for model in comparison.models])
    axes.invert_yaxis()
    axes.margins(x=0.1)
    axes.set(xlabel="Measured − predicted\n[% of measured]", title=f"{comparison.on}\nhatched: underestimated")
    tick: dict[str, Any] = {"color": "#000000", "linestyle": "none", "marker": "|", "markersize": 8}
    return Line2D([], [], markeredgewidth=1.2, label="mean error (bar: largest)", **tick)


def _of_states(model: ModelComparison, most: int) -> str:
    """A model in words, with the number of its states if others were compared on more."""
    states = model.accuracy.states
    return _words(model.model) + (f"\n({states} of {most} states)" if states < most else "")


def _words(model: str) -> str:
    short = {"CFM_2D per height": "2D map of\neach height", "contact model": "standard"}
    return short.get(model, _LOOKS.get(model, style.PREDICTION).words)
