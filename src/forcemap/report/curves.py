"""Small curves of force over time: all repeats of a state in one drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape

from forcemap.arrays import FloatArray
from forcemap.figures.style import BLUE, GREEN, PURPLE, SKY, VERMILLION
from forcemap.impacts.impact import TRANSIENT_TIME
from forcemap.limits.force_limits import Contact, ForceLimit

_WIDTH, _HEIGHT = 340, 120
_LEFT, _BREAK, _RIGHT, _TOP, _BOTTOM = 34, 206, 334, 8, 100
_FAST, _SLOW = 0.1, 1.0  # the axis is broken at the first time and ends at the second [s]
_HEADROOM = 1.05  # top of the drawing over the highest force
_STEPS = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 1e9)  # between marks of the axis of force [N]
_MOST_STEPS = 4
# colours and dashes of the repeats, told apart in grey as well
_STROKES = ((BLUE, ""), (VERMILLION, "5 2"), (GREEN, "2 2"), (PURPLE, "7 2 2 2"), (SKY, "1 2"))


@dataclass(frozen=True, eq=False)
class Curve:
    """Force [N] over time after onset [s] of a recording, and whether it is used."""

    name: str
    time: FloatArray
    force: FloatArray
    used: bool = True


def highest_force(curves: Sequence[Curve], limit: ForceLimit | None, contact: Contact = Contact.TRANSIENT) -> float:
    """The force at the top of all curves' drawings [N]."""
    forces = [float(curve.force.max()) for curve in curves if curve.force.size]
    limits = [limit.force(contact)] if limit is not None else []
    return _HEADROOM * max([*forces, *limits, 1.0])


def force_curves(
    curves: Sequence[Curve], limit: ForceLimit | None, top: float, contact: Contact = Contact.TRANSIENT
) -> Markup:
    """The curves of recordings in one drawing, with the limits by time; empty if no recording has one.

    The axis of time is broken at 0.1 s. Recordings that are not used are grey.

    Parameters
    ----------
    curves : sequence of Curve
    limit : ForceLimit or None
        Limits to draw; None for none.
    top : float
        Force at the top of the drawing [N].
    contact : Contact, optional
        Quasi-static: its limit holds from the onset on.
    """
    drawn = [curve for curve in curves if curve.force.size]
    if not drawn:
        return Markup("")
    parts = [_axes(top)]
    if limit is not None:
        parts.append(_limits(limit, top, contact))
    used = 0
    for curve in drawn:
        colour, dashes = _STROKES[used % len(_STROKES)] if curve.used else ("#999999", "")
        used += curve.used
        dash = f' stroke-dasharray="{dashes}"' if dashes else ""
        points = " ".join(f"{x:.0f},{y:.0f}" for x, y in zip(_x(curve.time), _y(curve.force, top), strict=True))
        parts.append(f'<polyline fill="none" stroke="{colour}"{dash} points="{points}"/>')
    title = escape(f"force over time after onset of {', '.join(curve.name for curve in drawn)}")
    head = f'<svg class="curve" viewBox="0 0 {_WIDTH} {_HEIGHT}" width="{_WIDTH}" height="{_HEIGHT}" role="img"'
    return Markup(f'{head} aria-label="{title}">{"".join(parts)}</svg>')


def _x(time: FloatArray) -> FloatArray:
    return np.interp(time, [0.0, _FAST, _SLOW], [_LEFT, _BREAK, _RIGHT])


def _y(force: FloatArray, top: float) -> FloatArray:
    return np.asarray(_BOTTOM - (_BOTTOM - _TOP) * np.clip(force / top, 0.0, 1.0))


def _axes(top: float) -> str:
    step = next(step for step in _STEPS if top / step <= _MOST_STEPS)
    lines, words = [f"M{_LEFT} {_TOP}V{_BOTTOM}H{_RIGHT}", f"M{_BREAK} {_TOP}V{_BOTTOM}"], []
    for force in np.arange(0, top, step).tolist():
        y = float(_y(np.array(force), top))
        lines.append(f"M{_LEFT - 3} {y:.0f}h3")
        words.append(f'<text x="{_LEFT - 5}" y="{y + 3:.0f}" text-anchor="end">{force:g}</text>')
    for time, text in ((0.0, "0"), (0.05, "50"), (_FAST, "100"), (TRANSIENT_TIME, "500"), (_SLOW, "1000 ms")):
        x = float(_x(np.array(time)))
        anchor = "end" if time == _SLOW else "middle"
        lines.append(f"M{x:.0f} {_BOTTOM}v3")
        words.append(f'<text x="{x:.0f}" y="{_BOTTOM + 13}" text-anchor="{anchor}">{text}</text>')
    text = f'<g font-family="sans-serif" font-size="9" fill="#444">{"".join(words)}'
    text += f'<text x="{_LEFT + 3}" y="{_TOP - 1}">N</text></g>'
    return f'<path d="{"".join(lines)}" fill="none" stroke="#888" stroke-width="0.7"/>{text}'


def _limits(limit: ForceLimit, top: float, contact: Contact) -> str:
    """The limit of the contact up to 0.5 s, then the quasi-static one."""
    middle, end = _x(np.array([TRANSIENT_TIME, _SLOW])).tolist()
    high, low = _y(np.array([limit.force(contact), limit.quasi_static]), top).tolist()
    path = f"M{_LEFT} {high:.1f}H{middle:.0f}V{low:.1f}H{end:.0f}"
    return f'<path d="{path}" fill="none" stroke="#000" stroke-width="1.2" stroke-dasharray="6 3"/>'
