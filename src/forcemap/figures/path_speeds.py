"""Speeds along a path."""

from __future__ import annotations

import itertools

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from forcemap.arrays import FloatArray
from forcemap.errors import InputError
from forcemap.figures.canvas import finish, in_our_settings, is_wide, new_figure, plain
from forcemap.figures.style import ALLOWED, COMMANDED, PAGE_WIDTH, PIECES, PROFILE, PROGRAMMED, SPEED, Look
from forcemap.paths.path_speeds import CycleTime, PathSpeeds
from forcemap.paths.time_law import TimeLaw


@in_our_settings
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
    path, wide = path_speeds.path, is_wide(width)
    if profile is not None and not (
        profile.length.shape == path.lengths.shape and np.allclose(profile.length, path.lengths)
    ):
        raise InputError(
            f"profile: found {profile.length.size} pieces, expected those of the path, {len(path)} of the same lengths"
        )
    along = np.concatenate([[0.0], np.cumsum(path.lengths)])
    figure = new_figure("Speeds along the path", width, 0.085)
    axes = figure.add_subplot()
    patches = _draw_outcomes(axes, path_speeds, along)
    _draw_steps(axes, along, path_speeds.speed, ALLOWED, _with_time(ALLOWED, path_speeds.allowed))
    if np.isfinite(path_speeds.programmed).any():
        words = _with_time(PROGRAMMED, path_speeds.program)
        _draw_steps(axes, along, path_speeds.programmed, PROGRAMMED, words)
    commanded = path_speeds.commanded
    if np.any(commanded[~path_speeds.refused] != path_speeds.speed[~path_speeds.refused]):
        _draw_steps(axes, along, commanded, COMMANDED, COMMANDED.words)
    if profile is not None:
        axes.plot(*_motion(profile, along), **PROFILE.drawn)
    axes.set(xlabel="Length along the path [m]", ylabel=SPEED, xlim=(along[0], along[-1]))
    axes.margins(y=0.08)
    axes.set_ylim(bottom=0)
    _name_segments(axes, path.names, along)
    simulated = any(line.startswith("SIMULATED") for line in path_speeds.statements)
    return finish(figure, simulated=simulated, columns=2 if wide else 1, also=patches, first=path_speeds.warnings)


def _draw_outcomes(axes: Axes, path_speeds: PathSpeeds, along: FloatArray) -> list[Patch]:
    """An area for each stretch of one outcome, if it has a look of its own; and what the legend says of them."""
    legend: dict[str, Patch] = {}
    start = 0
    for outcome, pieces in itertools.groupby(path_speeds.outcome.tolist()):
        stop = start + len(list(pieces))
        look = PIECES[outcome]
        if look.hatch or look.face != "none":
            area = look.filled | {"label": "_"}
            axes.axvspan(along[start], along[stop], zorder=0.5, **area)
            legend.setdefault(look.words, Patch(**(look.filled | {"linewidth": 0.6})))
        start = stop
    return list(legend.values())


def _draw_steps(axes: Axes, along: FloatArray, speed: FloatArray, look: Look, words: str) -> None:
    """A speed for each piece, broken where there is none."""
    stairs = axes.plot(np.repeat(along, 2)[1:-1], np.repeat(speed, 2), **look.drawn)
    stairs[0].set_label(words)


def _with_time(look: Look, time: CycleTime) -> str:
    return look.words + (f", {time.duration:.2f} s" if np.isfinite(time.duration) else ", no cycle time")


def _motion(profile: TimeLaw, along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Speed over the length: accelerate, keep the top speed, decelerate on each piece."""
    share = np.linspace(0.0, 1.0, 13)
    gone = profile.length[:, None] * share
    left = profile.length[:, None] - gone
    faster = np.sqrt(profile.start_speed[:, None] ** 2 + 2 * profile.acceleration * gone)
    slower = np.sqrt(profile.end_speed[:, None] ** 2 + 2 * profile.acceleration * left)
    speed = np.minimum(np.minimum(faster, slower), profile.top_speed[:, None])
    return (along[:-1, None] + gone).ravel(), speed.ravel()


def _name_segments(axes: Axes, names: tuple[str, ...], along: FloatArray) -> None:
    """The names of the segments above, and a line where one ends."""
    start, places, words = 0, [], []
    for name, pieces in itertools.groupby(names):
        stop = start + len(list(pieces))
        if start:
            axes.axvline(along[start], color="#404040", linewidth=0.6)
        places.append((along[start] + along[stop]) / 2)
        words.append(plain(name, 24))
        start = stop
    if len(words) > 1:
        top = axes.secondary_xaxis("top")
        top.set_xticks(places, words, rotation=35, ha="left", fontsize=6.5)
        top.tick_params(length=0)
        top.spines["top"].set_visible(False)
