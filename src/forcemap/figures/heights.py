"""Force over distance for several heights in one picture (paper, section II-B)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.errors import InputError
from forcemap.figures import style
from forcemap.figures.canvas import finish, is_wide, narrow_columns, new_figure, panels, plain, settings
from forcemap.figures.measured import Measured, levels, measured_often, middle, near, to_cut_at
from forcemap.figures.names import labels
from forcemap.figures.style import DISTANCE, FORCE, PAGE_WIDTH, QUANTITY, Look
from forcemap.maps.force_map import ForceMap

_MOST_HEIGHTS = 5
_DARKEST, _LIGHTEST = 0.0, 0.8  # shades of the heights: the lightest is still seen on white
_LINES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)), (0, (3, 1, 1, 1, 1, 1)))
_LINE_WIDTHS = (1.4, 0.7, 2.4)  # of three maps with five heights each, all different
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*", "p", "d", "h", "8", "H")
_SAMPLES = 61  # of a line


@dataclass(frozen=True)
class Mapped:
    """A map with the impacts it is shown beside, and its name.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    dataset : ImpactDataset or None
        Measured states; those of a fitted map if None.
    name : str
        What it is called where its robot does not tell it from the others.
    """

    force_map: ForceMap
    dataset: ImpactDataset | None = None
    name: str = ""

    @property
    def measured(self) -> Measured:
        """The measured states."""
        return Measured.of(self.force_map, self.dataset)

    def usual_cut(self, axis: int, speed: float) -> FloatArray:
        """Distances, heights or speeds (axis 0 to 2) of states, to cut at one of them; of places those at a speed."""
        points = self.force_map.measured_range.points
        if axis == 2:
            return np.asarray(points[:, axis])
        states = self.measured.coordinates if self.dataset is None else self.dataset.states.coordinates
        return to_cut_at(self.force_map, states if len(states) else points, speed, self.measured.tolerance.speed)[
            :, axis
        ]


def mapped(shown: ForceMap | Mapped | Sequence[ForceMap | Mapped]) -> list[Mapped]:
    """One map or several, each alone or beside its impacts.

    Raises
    ------
    InputError
        No map.
    """
    several = [shown] if isinstance(shown, ForceMap | Mapped) else shown
    if not several:
        raise InputError("found no map, expected at least one")
    return [Mapped(each) if isinstance(each, ForceMap) else each for each in several]


def default_cuts(shown: Sequence[Mapped], axis: int, speed: float | None = None) -> list[float]:
    """Where each of several maps is cut along an axis: distance, height or speed, 0 to 2.

    At one value for all inside the measured range of each: of those that many states of a map have (`measured_often`),
    of places those at the speed [m/s] that is stated or else chosen, the middle one, if it can be one that states of
    every map have. Where the ranges have nothing in common, each at its own.
    """
    points = [each.force_map.measured_range.points[:, axis] for each in shown]
    at = default_cuts(shown, 2) if speed is None and axis < 2 else [speed or 0.0] * len(shown)
    levels = [each.usual_cut(axis, at_speed) for each, at_speed in zip(shown, at, strict=True)]
    tolerances = [each.measured.tolerances[axis] for each in shown]
    own = np.array([measured_often(values, tolerance) for values, tolerance in zip(levels, tolerances, strict=True)])
    low, high = max(values.min() for values in points), min(values.max() for values in points)
    if low > high:
        return [float(value) for value in own]
    inside = np.clip(own, low, high)
    of_all = np.array([all(near(values, value, max(tolerances)).any() for values in levels) for value in inside])
    return [middle(np.sort(inside[of_all] if of_all.any() else inside))] * len(levels)


def names_of(shown: Sequence[Mapped]) -> list[str]:
    """The label of each of several maps."""
    return labels([(each.force_map.conditions, each.name) for each in shown])


@settings()
def force_heights_figure(
    shown: ForceMap | Mapped | Sequence[ForceMap | Mapped],
    *,
    speeds: Sequence[float] | None = None,
    width: float = PAGE_WIDTH,
) -> Figure:
    """Force against distance, a line for each height: the map's, and the states measured at that height and speed.

    Parameters
    ----------
    shown : ForceMap or Mapped, or a sequence of them
        Maps, a column of panels for each. A fitted map shows its own states; `Mapped(force_map, dataset, name)` shows
        others, and names the map where its robot does not.
    speeds : sequence of float, optional
        Speeds at contact [m/s], a row of panels for each; if not given one that many states have, the same for all maps
        where their measured ranges have one in common.
    width : float
        Width of the figure [m].

    Raises
    ------
    InputError
        No map.

    Examples
    --------
    >>> from forcemap import published_map
    >>> figure = force_heights_figure([published_map("ur10e"), published_map("kuka-iiwa7-10nm")], speeds=[0.2, 0.4])
    >>> len(figure.axes)
    4
    """
    maps = mapped(shown)
    wide, names = is_wide(width), names_of(maps)
    cuts = [(of_map, _heights(each, of_map)) for each, of_map in zip(maps, _speeds(maps, speeds), strict=True)]
    looks, rows = _looks([heights for _, heights in cuts]), len(cuts[0][0])
    count = rows * len(maps)
    columns = len(maps) if wide else narrow_columns(count)
    down = -(-count // columns)
    figure = new_figure("Force against distance for several heights", width, 0.016 + down * (0.055 if wide else 0.052))
    all_axes, roles = panels(figure, count, columns, share_y=True), set[Look]()
    for number, (axes, (row, column)) in enumerate(zip(all_axes, _cells(rows, len(maps), wide), strict=True)):
        speed = cuts[column][0][row]
        roles |= _draw_heights(axes, maps[column], speed, cuts[column][1], looks)
        axes.set_title(f"{names[column]}, {speed:.2f} m/s")
        axes.set_xlabel(DISTANCE if number + columns >= count else "")
        axes.set_ylabel(FORCE if number % columns == 0 else "")
    all_axes[0].set_ylim(bottom=0)
    return finish(figure, simulated=any(each.measured.simulated for each in maps), also=_roles(roles))


def _cells(rows: int, columns: int, wide: bool) -> list[tuple[int, int]]:
    """Row and column of each panel, in the order that they are drawn in."""
    if wide:
        return [(row, column) for row in range(rows) for column in range(columns)]
    return [(row, column) for column in range(columns) for row in range(rows)]


def states_shown(
    shown: ForceMap | Mapped | Sequence[ForceMap | Mapped], *, speeds: Sequence[float] | None = None
) -> list[tuple[int, int]]:
    """Of each map how many of its measured states `force_heights_figure` shows, and how many there are."""
    maps, counts = mapped(shown), []
    for each, of_map in zip(maps, _speeds(maps, speeds), strict=True):
        states = each.measured.coordinates
        seen = _any_near(states[:, 2], of_map, each.measured.tolerance.speed)
        seen &= _any_near(states[:, 1], _heights(each, of_map), each.measured.tolerance.place)
        counts.append((int(seen.sum()), len(states)))
    return counts


def _any_near(values: FloatArray, wanted: Sequence[float], tolerance: float) -> Mask:
    return np.asarray(np.any([near(values, value, tolerance) for value in wanted], axis=0))


def _speeds(maps: Sequence[Mapped], speeds: Sequence[float] | None) -> list[list[float]]:
    """The speeds of each map's panels."""
    return [list(speeds)] * len(maps) if speeds else [[speed] for speed in default_cuts(maps, 2)]


def _draw_heights(
    axes: Axes, shown: Mapped, speed: float, heights: Sequence[float], look_of: dict[float, Look]
) -> set[Look]:
    """Draw lines and states; returns the roles that have a marker."""
    roles = set[Look]()
    reach, measured = shown.force_map.measured_range, shown.measured
    looks = [look_of[round(height, 3)] for height in heights]
    distance = np.linspace(reach.lowest[0], reach.highest[0], _SAMPLES)
    for look, height in zip(looks, heights, strict=True):
        inside = reach.contains(distance, np.full(_SAMPLES, height), np.full(_SAMPLES, speed))
        if inside.any():
            force = np.where(inside, shown.force_map.predict(distance, height, speed), np.nan)
            look.plot(axes, distance, force, marker="")
    for role, states in measured.by_look:
        at_speed = near(states.speed, speed, measured.tolerance.speed)
        for look, height in zip(looks, heights, strict=True):
            at = states.select(at_speed & near(states.height, height, measured.tolerance.place))
            known = at.impacts > 0
            if known.any():
                roles.add(role)
                look.plot(axes, [], [])  # line and marker together, the legend's entry
            face = look.colour if role is style.TRAIN else "#ffffff"
            look.plot(axes, at.distance[known], at.force[known], "_", linestyle="none", markerfacecolor=face)
            if (above := at.censored > 0).any():
                style.CENSORED.plot(axes, at.distance[above], at.at_least[above])
    axes.margins(y=0.1)
    return roles


def _roles(drawn: set[Look]) -> list[Line2D]:
    """Legend's entries for the markers: filled training states, open test states."""
    faces = {style.TRAIN: style.GREY, style.TEST: "#ffffff", style.SLOWER: "#ffffff"}
    look: dict[str, Any] = {"color": style.BLACK, "linestyle": "none", "marker": "o", "markersize": 3.6}
    return [Line2D([], [], markerfacecolor=faces[role], label=role.words, **look) for role in faces if role in drawn]


def _heights(shown: Mapped, speeds: Sequence[float]) -> list[float]:
    """At most `_MOST_HEIGHTS` of the measured heights: those with most states at the speeds, spread over the range.

    First the one that most states have, then each time the one with the largest product of its states and its distance
    from the others. Without a state at the speeds all states count, without any the points of the measured range.
    """
    measured, points = shown.measured, shown.force_map.measured_range.points
    low, high = points[:, 1].min() - measured.tolerance.place, points[:, 1].max() + measured.tolerance.place
    states = measured.coordinates if len(measured.coordinates) else points
    states = states[(low <= states[:, 1]) & (states[:, 1] <= high)]
    at_speeds = _any_near(states[:, 2], speeds, measured.tolerance.speed)
    at = states[at_speeds if at_speeds.any() else slice(None), 1]
    heights = np.clip(levels(at, measured.tolerance.place), points[:, 1].min(), points[:, 1].max())
    counts = np.array([near(at, height, measured.tolerance.place).sum() for height in heights])
    picked = [int(counts.argmax())]
    while len(picked) < min(_MOST_HEIGHTS, heights.size):
        apart = np.abs(heights[:, None] - heights[picked]).min(axis=1)
        picked.append(int((counts * apart).argmax()))
    return sorted(float(heights[i]) for i in picked)


def _looks(cuts: Sequence[Sequence[float]]) -> dict[float, Look]:
    """The look of each height, the same in all panels and of no other height: shade, line, its width and marker."""
    heights = sorted({round(height, 3) for of_map in cuts for height in of_map})
    digits = 2 if len({round(height, 2) for height in heights}) == len(heights) else 3
    looks = {}
    for number, height in enumerate(heights):
        share, (again, kind) = number / max(len(heights) - 1, 1), divmod(number, len(_LINES))
        colour = to_hex(colormaps[QUANTITY](_DARKEST + share * (_LIGHTEST - _DARKEST)))
        words = plain(f"height {height:.{digits}f} m")
        looks[height] = Look(words, colour, _LINES[kind], _LINE_WIDTHS[again], _MARKERS[number], colour, 3.6)
    return looks
