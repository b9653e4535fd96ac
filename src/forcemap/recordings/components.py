"""Components of a force: one that is read alone beside others that move as much, and one that never changes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import RecordingError

_COMPONENT = re.compile(r"(?<![a-z])(f|force|kraft)[\s_.-]*[xyz](?![a-z])", re.IGNORECASE)
_SHARE = 0.2
"""Of the force that is read, by which another component may move: the whole is 2 % more then; a choice."""


def other_components(name: str, names: Sequence[str]) -> list[int]:
    """Positions of the columns that are other components of the force in a column: Fx and Fy beside Fz."""
    if not _COMPONENT.search(name):
        return []
    alike = _COMPONENT.sub(r"\1", name).lower()
    return [
        i
        for i, each in enumerate(names)
        if each != name and _COMPONENT.search(each) and _COMPONENT.sub(r"\1", each).lower() == alike
    ]


def refuse_one_of_several(name: str, force: FloatArray, others: Iterable[tuple[str, FloatArray]]) -> None:
    """Refuse a component that is read alone, beside others of shape (n,) that move as it does."""
    alone = np.ptp(force)
    for other, values in others:
        if (moves := np.ptp(values)) > _SHARE * alone:
            problem = f"found a component that moves by {moves:g} where {name}, which is read alone, moves by {alone:g}"
            expected = "expected all components of the force: name the three columns as force"
            raise RecordingError(f"{problem}; {expected}", column=other)


def still(names: Sequence[str], forces: Sequence[FloatArray]) -> tuple[str, ...]:
    """Notes on components that never change, as of a channel that reads nothing."""
    return tuple(
        f"{name} is {force[0]:g} in all rows: does its channel read?"
        for name, force in zip(names, forces, strict=True)
        if np.ptp(force) == 0
    )
