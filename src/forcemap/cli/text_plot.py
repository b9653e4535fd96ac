"""A curve as a small plot of text."""

from __future__ import annotations

import numpy as np

from forcemap.arrays import FloatArray

_WIDTH, _HEIGHT = 72, 12


def text_plot(time: FloatArray, force: FloatArray, marks: dict[str, float]) -> list[str]:
    """Lines of a plot of the largest force [N] in each of 72 stretches of time after onset [s].

    Parameters
    ----------
    time, force : array (n,)
        Time after onset [s], contact force [N].
    marks : dict of str to float
        One-letter marks below the time axis, at times after onset [s].
    """
    start, end = float(time[0]), float(time[-1])
    cells = np.minimum(((time - start) / max(end - start, 1e-9) * _WIDTH).astype(int), _WIDTH - 1)
    top = np.full(_WIDTH, np.nan)
    for cell in np.unique(cells):
        top[cell] = force[cells == cell].max()
    highest = max(float(np.nanmax(top)), 1.0)
    rows = np.round(np.clip(top, 0, None) / highest * (_HEIGHT - 1))
    lines = []
    for row in range(_HEIGHT - 1, -1, -1):
        label = (
            f"{highest * row / (_HEIGHT - 1):6.0f} N |" if row % 4 == (_HEIGHT - 1) % 4 or row == 0 else " " * 8 + " |"
        )
        lines.append(label[-9:] + "".join("*" if value == row else " " for value in rows).rstrip())
    axis = ["-"] * _WIDTH
    for mark, at in marks.items():
        if start <= at <= end:
            axis[min(int((at - start) / max(end - start, 1e-9) * _WIDTH), _WIDTH - 1)] = mark
    labels = f"{1000 * start:.0f} ms".ljust(_WIDTH - 10) + f"{1000 * end:.0f} ms".rjust(10)
    return [*lines, " " * 8 + "+" + "".join(axis), " " * 9 + labels]
