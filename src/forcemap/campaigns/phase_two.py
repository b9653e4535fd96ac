"""What a campaign knows of Phase II, and so whether a transient limit may be used (paper, section V-D).

Recordings that are not in its impacts table count too: they clamp, or not, all the same.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from forcemap.arrays import FloatArray, Mask, Objects, Texts
from forcemap.campaigns.columns import UNUSED
from forcemap.campaigns.recordings_table import Entry, Use
from forcemap.csv_table import csv_cell
from forcemap.errors import TableError
from forcemap.findings import Finding, FindingKind
from forcemap.impacts.impact import Quality
from forcemap.impacts.scenario import BARRING, ContactScenario

MOST_SINKING = 0.05
"""Share of the impacts whose force may return slowly before speeds say so first; a choice, as for those left out."""


@dataclass(frozen=True)
class PhaseTwo:
    """Contact scenarios and Phase II forces of the impacts behind a map.

    Parameters
    ----------
    scenarios : mapping of ContactScenario to int
        Impacts of each scenario.
    unrecorded : int
        Impacts of which neither scenario nor Phase II force is known.
    largest_force : float
        Largest Phase II force [N]; NaN if none was recorded.
    above_peak : int
        Impacts whose Phase II force exceeds their Phase I peak.
    excluded : int
        Recordings that a person took out although they clamp or are undetermined.
    unused_force : float
        Largest Phase II force [N] of recordings that are not in the table, if one of them exceeds its peak; else NaN.
    sinking : float
        Share of the impacts of a table whose force returned to zero slowly (flag `slow_return`).
    sinking_at : tuple of str
        States of whose impacts more than half did so, or contact points with one that did.
    """

    scenarios: Mapping[ContactScenario, int] = field(default_factory=dict)
    unrecorded: int = 0
    largest_force: float = math.nan
    above_peak: int = 0
    excluded: int = 0
    unused_force: float = math.nan
    sinking: float = 0.0
    sinking_at: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, scenario: Objects, phase2_force: FloatArray, peak_force: FloatArray, flags: Texts, state: Texts
    ) -> PhaseTwo:
        """Count contact scenarios (None is not recorded), forces [N] (NaN is not recorded) and flags of states, shape
        (n,)."""
        sinks = sinking(flags)
        sunk, every = Counter(state[sinks].tolist()), Counter(state.tolist())
        recorded = [kind for kind in scenario if kind is not None]
        forces = phase2_force[~np.isnan(phase2_force)]
        return cls(
            scenarios={kind: recorded.count(kind) for kind in ContactScenario if kind in recorded},
            unrecorded=sum(kind is None for kind in scenario[np.isnan(phase2_force)]),
            largest_force=float(forces.max()) if forces.size else math.nan,
            above_peak=int(np.sum(phase2_force > peak_force)),
            sinking=float(sinks.mean()) if sinks.size else 0.0,
            sinking_at=tuple(name for name, impacts in sunk.items() if impacts > every[name] / 2),
        )

    def and_(self, other: PhaseTwo) -> PhaseTwo:
        """What two campaigns know of it together."""
        kinds = [kind for kind in ContactScenario if kind in self.scenarios or kind in other.scenarios]
        return PhaseTwo(
            {kind: self.scenarios.get(kind, 0) + other.scenarios.get(kind, 0) for kind in kinds},
            self.unrecorded + other.unrecorded,
            float(np.fmax(self.largest_force, other.largest_force)),
            self.above_peak + other.above_peak,
            self.excluded + other.excluded,
            float(np.fmax(self.unused_force, other.unused_force)),
            max(self.sinking, other.sinking),
            tuple(dict.fromkeys((*self.sinking_at, *other.sinking_at))),
        )

    @property
    def recorded(self) -> bool:
        """True if Phase II is known of at least one impact."""
        return any(self.scenarios.values()) or not math.isnan(self.largest_force)

    @property
    def doubt(self) -> Finding | None:
        """That forces returned to zero slowly, of more than a stray impact; None otherwise."""
        if self.sinking <= MOST_SINKING and not self.sinking_at:
            return None
        return force_sinks(self.sinking, self.sinking_at)

    @property
    def complete(self) -> bool:
        """True if Phase II is known of every impact."""
        return self.recorded and not self.unrecorded

    @property
    def barred(self) -> int:
        """Number of impacts that clamp or are of undetermined scenario."""
        return sum(self.scenarios.get(scenario, 0) for scenario in BARRING)

    def transient_refusal(self, quasi_static_limit: float, device_error: float, raised: float = 1.0) -> Finding | None:
        """Why no transient limit may be used, the reasons in `also`; None if nothing speaks against it.

        Clamping or an undetermined scenario forbids it, and so does a Phase II force that may lie above the
        quasi-static limit [N], the device's error [N] added, times the factor `raised` for the device's spring.
        """
        kinds = zip((FindingKind.CLAMPING, FindingKind.SCENARIO_UNDETERMINED), BARRING, strict=True)
        reasons = [Finding.of(kind, impacts=n) for kind, scenario in kinds if (n := self.scenarios.get(scenario, 0))]
        if raised * (self.largest_force + device_error) > quasi_static_limit:
            figures = {"force_N": self.largest_force, "error_N": device_error, "limit_N": quasi_static_limit}
            reasons.append(Finding.of(FindingKind.PHASE_TWO_ABOVE_LIMIT, **figures))
        return Finding.of(FindingKind.TRANSIENT_NOT_USABLE, *reasons) if reasons else None

    def quasi_static_refusal(
        self, quasi_static_limit: float, device_error: float, raised: float = 1.0, *, mapped: bool = False
    ) -> Finding | None:
        """Why a map of Phase I peaks cannot confirm the quasi-static limit [N]; None if nothing speaks against it.

        Where the clamping force is `mapped`, too, only recordings speak against it that neither map knows.
        """
        force = self.unused_force if mapped else self.largest_force
        if self.above_peak and raised * (force + device_error) > quasi_static_limit:
            return Finding.of(FindingKind.PHASE_TWO_ABOVE_PEAKS, force_N=force, impacts=self.above_peak)
        return None

    @property
    def finding(self) -> Finding:
        """What a speed depends on of it."""
        if not self.recorded:
            return Finding.of(FindingKind.PHASE_TWO_NOT_MEASURED)
        counts = {scenario.name: n for scenario, n in self.scenarios.items() if n}
        rest = {"largest_N": self.largest_force, "unrecorded": self.unrecorded, "excluded": self.excluded}
        return Finding.of(FindingKind.PHASE_TWO, **counts, **rest)


def sinking(flags: Texts) -> Mask:
    """Which impacts have a force that returned to zero slowly (flag `slow_return`), by their flags, shape (n,)."""
    return np.array([Quality.SLOW_RETURN in text for text in flags.tolist()], dtype=bool)


def force_sinks(share: float, names: tuple[str, ...]) -> Finding:
    """That forces returned to zero slowly after a share of the impacts, and where."""
    return Finding.of(FindingKind.FORCE_SINKS, share=share, names=names)


OLD_COLUMN = "not_in_table"
"""What older versions wrote in place of the columns."""

_ABOVE, _EXCLUDED, _UNREADABLE, _FORCE = UNUSED[len(ContactScenario) :]


def unused_cells(entries: Iterable[Entry]) -> dict[str, str]:
    """The cells of the columns, by column, for the entries of a register."""
    out = [entry for entry in entries if entry.use is not Use.USED]
    counted = [entry for entry in out if entry.use is not Use.EXCLUDED]
    force = float(np.fmax.reduce([math.nan, *(entry.phase2_force for entry in counted)]))
    counts = [
        *(sum(entry.scenario is scenario for entry in counted) for scenario in ContactScenario),
        sum(entry.phase2_force > np.fmax(entry.peak_force, 0.0) for entry in counted),  # no peak: without an impact
        sum(entry.scenario in BARRING for entry in out if entry.use is Use.EXCLUDED),
        sum(entry.use is Use.UNREADABLE for entry in out),
    ]
    # noise around nothing may lie below 0
    return dict(zip(UNUSED, [*map(str, counts), csv_cell(float(np.maximum(force, 0.0)), ".2f")], strict=True))


def including_unused(phase_two: PhaseTwo, columns: Mapping[str, Sequence[str]], file: str) -> PhaseTwo:
    """Phase II of a table with what its columns say of recordings that are not in it; without them as it is.

    Raises
    ------
    TableError
        Some of the columns without the others, other figures from row to row, or no figures.
    """
    if OLD_COLUMN in columns:
        message = "this column is of an older version of forcemap; run forcemap collect in the campaign's folder again"
        raise TableError(message, file=file, column=OLD_COLUMN)
    if not columns.keys() & {*UNUSED}:
        return phase_two
    figures: dict[str, float] = {}
    for name in UNUSED:
        cells = {*columns.get(name, ())}
        if len(cells) != 1:
            problem = "the column is missing" if not cells else "found several figures"
            message = f"{problem}, expected what forcemap collect wrote there, the same in every row; run it again"
            raise TableError(message, file=file, column=name)
        cell = cells.pop().replace(",", ".")
        if not re.fullmatch(r"(\d{1,9}(\.\d+)?)?" if name == _FORCE else r"\d{1,9}", cell, re.ASCII):
            message = f"found {cell!r}, expected what forcemap collect wrote there; run it again"
            raise TableError(message, file=file, column=name)
        figures[name] = float(cell or math.nan)
    unused = zip(ContactScenario, figures.values(), strict=False)  # the first of UNUSED
    counts = {scenario: phase_two.scenarios.get(scenario, 0) + int(count) for scenario, count in unused}
    return PhaseTwo(
        scenarios={scenario: count for scenario, count in counts.items() if count},
        unrecorded=phase_two.unrecorded + int(figures[_UNREADABLE]),
        largest_force=float(np.fmax(phase_two.largest_force, figures[_FORCE])),
        above_peak=phase_two.above_peak + int(figures[_ABOVE]),
        excluded=phase_two.excluded + int(figures[_EXCLUDED]),
        unused_force=figures[_FORCE] if figures[_ABOVE] else math.nan,
        sinking=phase_two.sinking,
        sinking_at=phase_two.sinking_at,
    )
