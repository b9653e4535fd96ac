"""What an impacts table says of impacts that are not in it: they clamp, or not, all the same."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

import numpy as np

from forcemap.campaigns.phase_two import PhaseTwo
from forcemap.campaigns.recordings_table import Entry, Use
from forcemap.errors import InputError
from forcemap.impacts.scenario import BARRING, ContactScenario

REMARK = "not_in_table"
"""Column of the impacts table with the same remark in every row, so that it goes wherever the table goes."""

_FORCE, _ABOVE = "largest_force_N", "above_peak"
_EXCLUDED, _UNREADABLE = "excluded", "unreadable"


def not_in_table(entries: Iterable[Entry]) -> str:
    """The remark on recordings that are not used: their scenarios, largest Phase II force, exclusions."""
    out = [entry for entry in entries if entry.use is not Use.USED]
    counted = [entry for entry in out if entry.use is not Use.EXCLUDED]
    found = {each.value: sum(entry.scenario is each for entry in counted) for each in ContactScenario}
    parts = [f"{name}={count}" for name, count in found.items() if count]
    force = float(np.fmax.reduce([math.nan, *(entry.phase2_force for entry in counted)]))
    parts += [] if math.isnan(force) else [f"{_FORCE}={force:.2f}"]
    above = sum(entry.phase2_force > np.fmax(entry.peak_force, 0.0) for entry in counted)  # no peak: without an impact
    parts += [f"{_ABOVE}={above}"] if above else []
    excluded = sum(entry.scenario in BARRING for entry in out if entry.use is Use.EXCLUDED)
    unreadable = sum(entry.use is Use.UNREADABLE for entry in out)
    parts += [f"{_EXCLUDED}={excluded}"] if excluded else []
    parts += [f"{_UNREADABLE}={unreadable}"] if unreadable else []
    return "; ".join(parts)


def including(phase_two: PhaseTwo, remark: str) -> PhaseTwo:
    """Phase II of a table with what its remark says.

    Raises
    ------
    InputError
        Not such a remark.
    """
    scenarios: list[ContactScenario] = []
    force = math.nan
    counts = {_ABOVE: 0, _EXCLUDED: 0, _UNREADABLE: 0}
    for part in filter(None, (part.strip() for part in remark.split(";"))):
        name, _, value = part.partition("=")
        if not re.fullmatch(r"\d{1,9}(\.\d+)?" if name == _FORCE else r"\d{1,9}", value, re.ASCII):
            raise InputError(f"found {part!r}, expected what forcemap collect wrote there", column=REMARK)
        if name == _FORCE:
            force = float(value)
        elif name in counts:
            counts[name] = int(value)
        else:
            scenarios += [ContactScenario.parse(name)] * int(value)
    return phase_two.including(scenarios, [force], **counts)
