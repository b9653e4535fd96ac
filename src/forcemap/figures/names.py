"""Names that a reader knows: of a robot with its setting, in place of the name of a file."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from forcemap.campaigns.conditions import Conditions
from forcemap.figures.canvas import plain

_BESIDE_NAME = re.compile(r"\s*(\(|,| with ).*", re.DOTALL)
_QUANTITY = re.compile(r"\d+(?:\.\d+)?\s?(?:Nm|kg m/s|N|W|J|m/s|mm|%)(?![\w/])")


def label(conditions: Conditions, otherwise: str = "") -> str:
    """The robot, and its safety setting where that is one quantity: KUKA LBR iiwa 7 R800, 30 Nm.

    Parameters
    ----------
    conditions : Conditions
        What the impacts were measured under.
    otherwise : str
        Its name where no robot is stated.
    """
    robot = _BESIDE_NAME.sub("", conditions.robot) or otherwise or "robot not stated"
    setting = _QUANTITY.findall(conditions.safety_settings)
    return plain(", ".join([robot, *setting]) if len(setting) == 1 else robot)


def labels(sources: Sequence[tuple[Conditions, str]]) -> list[str]:
    """The labels of several, each with its own name beside the robot where robots and settings are the same."""
    known = [label(*source) for source in sources]
    often = Counter(known)
    return [
        plain(f"{words}, {own}") if often[words] > 1 and own else words
        for words, (_, own) in zip(known, sources, strict=True)
    ]
