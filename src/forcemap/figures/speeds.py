"""Safe speeds over the workspace and along a path."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from forcemap.arrays import FloatArray
from forcemap.errors import InputError
from forcemap.figures import canvas, style
from forcemap.figures.layout import POINTS_PER_INCH, Room, across
from forcemap.figures.style import DISTANCE, HEIGHT, PAGE_WIDTH, QUANTITY, SPEED, Look
from forcemap.paths.path_speeds import CycleTime, PathSpeeds
from forcemap.paths.time_law import TimeLaw
from forcemap.speeds.basis import Basis
from forcemap.speeds.safe_speed import SpeedOutcome, floor_speed
from forcemap.speeds.speed_map import SpeedMap
from forcemap.words import limit_words, warnings

_MOST_IN_WORDS = 150  # places of a grid whose speeds are still written into it
_TITLE = 6.5  # letters of the title [pt]
_CELL = 16.0  # least height of a cell that two lines of words stand in [pt]
_LONGEST_LINE = 400  # characters of a line of the title before it is broken
_LONGEST_NAME = 24  # characters of a segment's name
_SAMPLES = 13  # of a piece's motion
_NAME, _TURNED = 6.5, 35.0  # letters of a segment's name [pt], and their angle [deg]
_NAMES_APART = 14.0  # least distance of turned names that do not touch [pt]
_BESIDE_PATH = 60.0  # what stands beside the panel of a path, about [pt]


@canvas.settings()
def safe_speed_figure(speed_map: SpeedMap, *, standard: float = math.nan, width: float = PAGE_WIDTH) -> Figure:
    """Safe speeds over distance and height: speed at contact as colour, outcomes as hatch patterns and words.

    Where a speed at contact leaves none to program there is no colour. At each place of a small grid of a wide figure
    stands the speed to program, in brackets below it the speed at contact. The limit and the bound behind the speeds
    stand above it, as `SafeSpeed.basis` has them.

    Parameters
    ----------
    speed_map : SpeedMap
        Safe speeds on a grid.
    standard : float
        The one speed that the standard's contact model allows everywhere [m/s], drawn on the scale; NaN for none.
    width : float
        Width of the figure [m].
    """
    speeds = speed_map.speeds
    permitted = bool(np.isfinite(speeds.speed_to_program).any())
    written = canvas.is_wide(width) and permitted and speeds.outcome.size <= _MOST_IN_WORDS
    axes = _colour_speeds(speed_map, standard, width, written=written)
    if written and _cell_height(axes, speed_map) < _CELL:
        axes = _colour_speeds(speed_map, standard, width, written=False)
    elif written:
        _write_speeds(axes, speed_map)
    return _figure_of(axes)


def _first(bases: Iterable[Basis]) -> list[str]:
    """How much must be read before the speeds are used: a picture has no room for the sentences."""
    count = len(warnings(bases))
    doubts = f"the {count} doubts" if count > 1 else "the doubt"
    return [f"first read {doubts} about these speeds: in the report, or by forcemap speed or path"] if count else []


def _figure_of(axes: Axes) -> Figure:
    figure = axes.get_figure(root=True)
    assert figure is not None
    return figure


def _cell_height(axes: Axes, speed_map: SpeedMap) -> float:
    """Height of a place's cell [pt]."""
    tall = axes.get_position().height * _figure_of(axes).get_figheight() * POINTS_PER_INCH
    return tall / max(len(speed_map.height), 1)


def _colour_speeds(speed_map: SpeedMap, standard: float, width: float, *, written: bool) -> Axes:
    """The panel with its colours, hatches and the words above it; `written`: figures will stand in the cells."""
    speeds, wide = speed_map.speeds, canvas.is_wide(width)
    x, y = canvas.edges(np.asarray(speed_map.distance)), canvas.edges(np.asarray(speed_map.height))
    figure = canvas.new_figure("Safe speeds over distance and height", width, 0.115 if wide else 0.12)
    axes = figure.add_subplot()
    has_speed = ~np.isnan(np.asarray(speeds.speed_to_program, dtype=np.float64))
    known = np.ma.masked_where(~has_speed.T, np.asarray(speeds.speed, dtype=np.float64).T)
    bar = canvas.colour_cells(axes, x, y, known, "Safe speed at contact [m/s]")
    if bar is not None:
        bar.ax.yaxis.set_major_formatter(lambda value, _: floor_speed(round(value, 6)))
    legend: list[Artist] = [] if bar is None or math.isnan(standard) else [_mark_standard(bar, standard)]
    for outcome in SpeedOutcome:
        look, here = style.OUTCOMES[outcome], speeds.to_program_outcome == outcome
        if here.any():
            entry = canvas.hatch_cells(axes, x, y, here & (look.hatch != ""), look)
            entry.set_label(f"{look.words} ({here.sum()} places)")
            if look.face == "none":  # the colour beneath
                entry.set_facecolor(matplotlib.colormaps[QUANTITY](0.6))
            legend.append(entry)
    axes.set(xlabel=DISTANCE, ylabel=HEIGHT, xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    axes.set_title("\n".join(_words(speed_map, written=written)), fontsize=_TITLE)
    canvas.finish(figure, simulated=speeds.basis.simulated, also=legend, first=_first([speeds.basis]))
    return axes


def _mark_standard(bar: Colorbar, standard: float) -> Artist:
    """The standard's speed as a line across the scale, which is made to reach it; returns the legend's entry."""
    low, high = bar.mappable.get_clim()
    bar.mappable.set_clim(min(low or standard, standard), max(high or standard, standard))
    bar.ax.axhline(standard, color="#ffffff", linewidth=4.0)  # seen on any colour of the scale
    bar.ax.axhline(standard, color=style.BLACK, linewidth=1.6)
    words = f"{style.STANDARD.words}: {floor_speed(standard)} m/s everywhere"
    return Line2D([], [], color=style.BLACK, linewidth=1.6, label=words)


def _write_speeds(axes: Axes, speed_map: SpeedMap) -> None:
    """Write the speed to program and at contact into each place, rounded down to 0.001 m/s."""
    speed = np.asarray(speed_map.speeds.speed, dtype=np.float64)
    program = np.asarray(speed_map.speeds.speed_to_program, dtype=np.float64)
    low, high = np.nanmin(speed), np.nanmax(speed)
    written: dict[str, Any] = {"fontsize": 5.5, "ha": "center", "va": "center", "transform": axes.transData}
    for i, j in np.argwhere(np.isfinite(program)).tolist():
        place = float(speed_map.distance[i]), float(speed_map.height[j])
        colour = "#ffffff" if speed[i, j] < (low + high) / 2 else "#000000"
        words = f"{floor_speed(program[i, j])}\n({floor_speed(speed[i, j])})"
        _figure_of(axes).text(*place, words, color=colour, **written)


def _words(speed_map: SpeedMap, *, written: bool) -> Iterator[str]:
    """The limit, the bound and which speeds are shown."""
    newtons, basis = np.unique(np.asarray(speed_map.speeds.limit)), speed_map.speeds.basis
    figure = f"{newtons[0]:g}" + (f" to {newtons[-1]:g}" if newtons.size > 1 else "") + " N"
    limit = limit_words(basis)
    off = basis.allowance and f"{basis.allowance.speed:g} m/s"
    if written:
        shown = (
            f"in figures: speed to program{f', {off} overshoot subtracted' if off else ''} (in brackets: at contact)"
        )
    else:
        shown = f"shade: speed at contact{f'; to program {off} less, for overshoot' if off else ''}"
    lines = [
        f"limit: {limit if limit.startswith(figure) else f'{figure}, {limit}'}",
        f"bound: {basis.bound}",
        shown,
        "each speed holds at the middle of its cell, not in all of it: between, forcemap speed tells",
    ]
    yield from (canvas.plain(line, _LONGEST_LINE) for line in lines)


@canvas.settings()
def path_speeds_figure(path_speeds: PathSpeeds, *, profile: TimeLaw | None = None, width: float = PAGE_WIDTH) -> Figure:
    """Allowed and programmed speed along a path; pieces without permission hatched, with the reason in words.

    Parameters
    ----------
    path_speeds : PathSpeeds
        Speeds of the pieces.
    profile : TimeLaw, optional
        The motion along the same pieces (`time_law`), drawn beneath the allowed speeds.
    width : float
        Width of the figure [m].

    Raises
    ------
    InputError
        The profile is of other pieces.
    """
    path = path_speeds.path
    length = path.lengths if profile is None else profile.length
    if length.shape != path.lengths.shape or not np.allclose(length, path.lengths):
        raise InputError(
            f"profile: found {length.size} pieces, expected those of the path, {len(path)} of the same lengths"
        )
    along = np.concatenate([[0.0], np.cumsum(path.lengths)])
    figure = canvas.new_figure("Speeds along the path", width, 0.085)
    axes = figure.add_subplot()
    patches = _draw_outcomes(axes, path_speeds, along)
    _draw_steps(axes, along, path_speeds.speed, style.ALLOWED, _with_time(style.ALLOWED, path_speeds.allowed))
    if np.isfinite(path_speeds.programmed).any():
        words = _with_time(style.PROGRAMMED, path_speeds.program)
        _draw_steps(axes, along, path_speeds.programmed, style.PROGRAMMED, words)
    commanded = path_speeds.commanded
    if np.any(commanded[~path_speeds.refused] != path_speeds.speed[~path_speeds.refused]):
        _draw_steps(axes, along, commanded, style.COMMANDED, style.COMMANDED.words)
    if profile is not None:
        style.PROFILE.plot(axes, *_motion(profile, along))
    axes.set(xlabel="Length along the path [m]", ylabel=SPEED, xlim=(along[0], along[-1]))
    axes.margins(y=0.08)
    axes.set_ylim(bottom=0)
    room = _name_segments(axes, path.names, along, canvas.points(width))
    said: dict[str, Any] = {"also": patches, "first": _first(path_speeds.bases), "room": room}
    return canvas.finish(figure, simulated=path_speeds.simulated, **said)


def _draw_outcomes(axes: Axes, path_speeds: PathSpeeds, along: FloatArray) -> list[Patch]:
    """Draw an area for each stretch of one outcome that has a look of its own; returns the legend's entries."""
    legend: dict[str, Patch] = {}
    for outcome, start, stop in _stretches(path_speeds.outcome.tolist(), along):
        look = style.PIECES[outcome]
        if look.hatch or look.face != "none":
            axes.axvspan(start, stop, zorder=0.5, **look.area)
            legend.setdefault(look.words, look.patch())
    return list(legend.values())


def _stretches(values: Iterable[Any], along: FloatArray) -> Iterator[tuple[Any, float, float]]:
    """Neighbouring pieces of the same value, and where they start and end [m]."""
    first = 0
    for value, pieces in itertools.groupby(values):
        last = first + len(list(pieces))
        yield value, along[first], along[last]
        first = last


def _draw_steps(axes: Axes, along: FloatArray, speed: FloatArray, look: Look, words: str) -> None:
    """A speed for each piece, broken where there is none."""
    look.plot(axes, np.repeat(along, 2)[1:-1], np.repeat(speed, 2), words)


def _with_time(look: Look, time: CycleTime) -> str:
    return look.words + (f", {time.duration:.2f} s" if np.isfinite(time.duration) else ", no cycle time")


def _motion(profile: TimeLaw, along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Speed over the length: accelerate, keep the top speed, decelerate on each piece."""
    share = np.linspace(0.0, 1.0, _SAMPLES)
    gone = profile.length[:, None] * share
    left = profile.length[:, None] - gone
    faster = np.sqrt(profile.start_speed[:, None] ** 2 + 2 * profile.acceleration * gone)
    slower = np.sqrt(profile.end_speed[:, None] ** 2 + 2 * profile.acceleration * left)
    speed = np.minimum(np.minimum(faster, slower), profile.top_speed[:, None])
    return (along[:-1, None] + gone).ravel(), speed.ravel()


def _name_segments(axes: Axes, names: tuple[str, ...], along: FloatArray, wide: float) -> Room:
    """The names of the segments above, as far as they fit, and a line where one ends; gives the room they need."""
    segments = list(_stretches(names, along))
    for _, start, _ in segments[1:]:
        axes.axvline(start, color="#404040", linewidth=0.6)
    if len(segments) == 1:
        return canvas.NO_ROOM
    about = wide - _BESIDE_PATH  # width of the panel
    right, above, last = 0.0, 0.0, -math.inf
    for name, start, stop in segments:
        middle, words = (start + stop) / 2, canvas.plain(name, _LONGEST_NAME)
        x = about * float((middle - along[0]) / (along[-1] - along[0]))
        if x - last < _NAMES_APART:
            continue
        last = x
        shown: dict[str, Any] = {
            "rotation": _TURNED,
            "rotation_mode": "anchor",
            "fontsize": _NAME,
            "annotation_clip": False,
        }
        axes.annotate(words, (middle, 1.0), (0, 3), ("data", "axes fraction"), "offset points", **shown)
        long, turned = across(words, _NAME), math.radians(_TURNED)
        right = max(right, x + long * math.cos(turned) + _NAME - about)
        above = max(above, long * math.sin(turned) + _NAME)
    return Room(right=right, above=above)
