"""Force over time of an impact."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from forcemap.arrays import FloatArray
from forcemap.campaigns.conditions import Conditions
from forcemap.figures import style
from forcemap.figures.canvas import finish, is_wide, new_figure, panels, plain, settings
from forcemap.figures.style import FORCE, PAGE_WIDTH, TIME, Look
from forcemap.impacts.impact import TRANSIENT_TIME, Impact
from forcemap.limits.force_limits import ForceLimit
from forcemap.recordings.recording import Recording

_BEFORE, _AFTER = 0.05, 0.8  # shown before and after the onset [s]
_AROUND_PHASE_1 = (-0.4, 2.0)  # shown of Phase I, as multiples of its length
_DASHES = ((0, (3, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)))
_NEAR_RANGE = 0.7  # the device range is drawn if the force reaches this share of it


@settings()
def force_evolution_figure(
    recording: Recording,
    impact: Impact | None = None,
    limit: ForceLimit | float | None = None,
    *,
    beside: Sequence[Impact] = (),
    names: Sequence[str] = (),
    conditions: Conditions | None = None,
    width: float = PAGE_WIDTH,
) -> Figure:
    """Force over time: as recorded and contact force, peak, Phase I and II, limits, device range (paper, section V-D).

    The transient limit is drawn for the first 0.5 s of contact, the quasi-static one throughout.

    Parameters
    ----------
    recording : Recording
        The recording.
    impact : Impact, optional
        The impact found in it; without one only the recorded force is drawn.
    limit : ForceLimit or float, optional
        Limits of a body area, or one limit [N].
    beside : sequence of Impact
        Impacts to compare with, drawn dashed, from their own onset on; the legend then has the scenario of each, and
        whose the peak and the end of Phase I are.
    names : sequence of str
        What the impact and those beside it are called; their files if not given.
    conditions : Conditions, optional
        Conditions of the campaign; they say whether the impact is simulated.
    width : float
        Width of the figure [m].
    """
    wide = is_wide(width)
    recorded = recording, *(other.recording for other in beside)
    simulated = any(each.simulated for each in recorded) or (conditions is not None and conditions.simulated)
    onset = 0.0 if impact is None else impact.onset
    time = recording.time - onset
    if impact is None:
        figure = new_figure("Recorded force over time, no impact found", width, 0.07)
        (axes,) = panels(figure, 1, 1)
        style.RECORDED.plot(axes, time, recording.force)
        _draw_limits(axes, limit, time[0], time[-1], time[-1])
        _draw_range(axes, recording)
        axes.set(xlabel="Time [s]", ylabel=FORCE, title="no impact found")
        return finish(figure, simulated=simulated)

    figure = new_figure("Force over time of an impact", width, 0.078 if wide else 0.15)
    whole, phase1 = panels(figure, 2, 2 if wide else 1, share_y=wide)
    end = min(float(time[-1]), _AFTER)
    length, (first, last) = impact.phase1_end - impact.onset, _AROUND_PHASE_1
    called = [plain(name) for name in names or _files(recorded)]
    words = style.CONTACT_FORCE.words + (f", {called[0]}" if names or (beside and called[0]) else "")
    whose = f", {called[0]}" if beside else ""
    if beside:  # the scenario of each, where the title has that of one alone
        words += f", {_scenario(impact)}"
        called[1:] = [f"{name}, {_scenario(other)}" for name, other in zip(called[1:], beside, strict=True)]
    for axes, low, high in ((whole, -_BEFORE, end), (phase1, first * length, last * length)):
        curves = [
            (style.RECORDED, time, recording.force, ""),
            (style.CONTACT_FORCE, impact.contact.time - onset, impact.contact.force, words),
            *((*other_curve, name) for other_curve, name in zip(_others(beside), called[1:], strict=True)),
        ]
        for look, after, force, name in curves:
            shown = (after >= low) & (after <= high)
            look.plot(axes, after[shown], force[shown], name)
        _draw_limits(axes, limit, max(low, 0.0), high, min(high, TRANSIENT_TIME))
        axes.axvline(length, **(style.PHASE_BOUNDARY.drawn | {"label": f"{style.PHASE_BOUNDARY.words}{whose}"}))
        _draw_range(axes, recording)
        _draw_peak(axes, impact, whose)
        axes.margins(y=0.1)
        axes.set(xlabel=TIME, xlim=(low, high))
    whole.set(ylabel=FORCE, title=_title("from onset on" if beside else _scenario(impact), limit))
    phase1.set(title="Phase I", ylabel="" if wide else FORCE)
    return finish(figure, simulated=simulated)


def _files(recordings: Sequence[Recording]) -> list[str]:
    return [Path(recording.name).name for recording in recordings]


def _others(beside: Sequence[Impact]) -> Iterator[tuple[Look, FloatArray, FloatArray]]:
    """Look, time after onset and force of each impact beside, told apart by their lines."""
    for number, other in enumerate(beside):
        look = replace(style.BESIDE, line=_DASHES[number % len(_DASHES)])
        yield look, *other.curve()


def _draw_limits(axes: Axes, limit: ForceLimit | float | None, low: float, high: float, transient_until: float) -> None:
    if limit is None or (isinstance(limit, ForceLimit) and not limit.permitted):
        return
    levels = [(style.LIMIT, limit, high)]
    if isinstance(limit, ForceLimit):
        levels = [(style.TRANSIENT, limit.transient, transient_until), (style.QUASI_STATIC, limit.quasi_static, high)]
    for look, force, end in levels:
        look.plot(axes, [low, end], [force, force], f"{look.words} {force:g} N")


def _draw_range(axes: Axes, recording: Recording) -> None:
    device_range = recording.device.range
    if np.isfinite(device_range) and np.abs(recording.force).max() > _NEAR_RANGE * device_range:
        words = f"{style.DEVICE_RANGE.words} {device_range:g} N"
        axes.axhline(device_range, **(style.DEVICE_RANGE.drawn | {"label": words}))


def _draw_peak(axes: Axes, impact: Impact, whose: str) -> None:
    """The peak, `whose` if there are several impacts; an arrow up where the device range was reached."""
    look, words = (style.CENSORED, "at least ") if impact.saturated else (style.PEAK, "")
    words = f"{style.PEAK.words} {words}{impact.peak_force:.1f} N"
    if f"{impact.raw_peak_force:.1f}" != f"{impact.peak_force:.1f}":
        words += f" (largest sample {impact.raw_peak_force:.1f} N)"
    words += "" if impact.resolved else ", unresolved"
    look.plot(axes, impact.peak_time - impact.onset, impact.peak_force, words + whose)


def _scenario(impact: Impact) -> str:
    return impact.scenario.value.replace("_", " ")


def _title(words: str, limit: ForceLimit | float | None) -> str:
    """What a panel shows, and whether the standard permits contact at all."""
    if isinstance(limit, ForceLimit) and not limit.permitted:
        words += f"\ncontact with {plain(limit.name)} is not permitted: no limit"
    return words
