"""What a campaign knows of Phase II, and so whether a transient limit may be used (paper, section V-D)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from forcemap.arrays import FloatArray, Objects
from forcemap.impacts.scenario import BARRING, ContactScenario


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
    """

    scenarios: Mapping[ContactScenario, int] = field(default_factory=dict)
    unrecorded: int = 0
    largest_force: float = math.nan
    above_peak: int = 0
    excluded: int = 0

    @classmethod
    def of(cls, scenario: Objects, phase2_force: FloatArray, peak_force: FloatArray) -> PhaseTwo:
        """Count contact scenarios (None is not recorded) and forces [N] (NaN is not recorded), shape (n,)."""
        recorded = [each for each in scenario if each is not None]
        forces = phase2_force[~np.isnan(phase2_force)]
        return cls(
            scenarios={each: recorded.count(each) for each in ContactScenario if each in recorded},
            unrecorded=sum(each is None for each in scenario[np.isnan(phase2_force)]),
            largest_force=float(forces.max()) if forces.size else math.nan,
            above_peak=int(np.sum(phase2_force > peak_force)),
        )

    def including(
        self,
        scenarios: Sequence[ContactScenario],
        forces: Sequence[float],
        *,
        above_peak: int = 0,
        excluded: int = 0,
        unreadable: int = 0,
    ) -> PhaseTwo:
        """Count further impacts, which are not in the table: their scenarios, and Phase II forces [N] (NaN is none).

        Those that a person excluded only stand in the statement; of unreadable recordings nothing is known.
        """
        counts = {each: self.scenarios.get(each, 0) + scenarios.count(each) for each in ContactScenario}
        return PhaseTwo(
            scenarios={each: count for each, count in counts.items() if count},
            unrecorded=self.unrecorded + unreadable,
            largest_force=float(np.fmax.reduce([self.largest_force, *forces])),
            above_peak=self.above_peak + above_peak,
            excluded=self.excluded + excluded,
        )

    @property
    def recorded(self) -> bool:
        """True if Phase II is known of at least one impact."""
        return any(self.scenarios.values()) or not math.isnan(self.largest_force)

    @property
    def complete(self) -> bool:
        """True if Phase II is known of every impact."""
        return self.recorded and not self.unrecorded

    @property
    def barred(self) -> int:
        """Number of impacts that clamp or are of undetermined scenario."""
        return sum(self.scenarios.get(each, 0) for each in BARRING)

    def transient_refusal(self, quasi_static_limit: float, device_error: float, raised: float = 1.0) -> str:
        """Why no transient limit may be used, in words; empty if nothing speaks against it.

        Clamping or an undetermined scenario forbids it, and so does a Phase II force that may lie above the
        quasi-static limit [N], the device's error [N] added, times the factor `raised` for the device's spring.
        """
        clamping = self.scenarios.get(ContactScenario.WITH_CLAMPING, 0)
        undetermined = self.scenarios.get(ContactScenario.UNDETERMINED, 0)
        reasons = [
            *([f"impacts that clamp: {clamping}"] if clamping else []),
            *([f"impacts of undetermined scenario: {undetermined}"] if undetermined else []),
        ]
        if raised * (self.largest_force + device_error) > quasi_static_limit:
            reasons.append(
                f"a Phase II force of {self.largest_force:.1f} N (device error {device_error:g} N) "
                f"may exceed the quasi-static limit of {quasi_static_limit:g} N"
            )
        return "; ".join(reasons)

    def quasi_static_refusal(self, quasi_static_limit: float, device_error: float, raised: float = 1.0) -> str:
        """Why a map of Phase I peaks cannot confirm the quasi-static limit [N]; empty if nothing speaks against it."""
        if self.above_peak and raised * (self.largest_force + device_error) > quasi_static_limit:
            return (
                f"Phase II forces, up to {self.largest_force:.1f} N, exceed the Phase I peaks the map is fitted to "
                f"(impacts: {self.above_peak})"
            )
        return ""

    def statement(self) -> str:
        """One line for the assumptions of a speed."""
        if not self.recorded:
            return "Phase II not measured"
        counts = ", ".join(f"{n} impacts {scenario.words}" for scenario, n in self.scenarios.items() if n)
        force = "" if math.isnan(self.largest_force) else f"; largest Phase II force {self.largest_force:.1f} N"
        missing = f"; Phase II not measured for {self.unrecorded} impacts" if self.unrecorded else ""
        out = f"; excluded by a person although clamping or undetermined: {self.excluded}" if self.excluded else ""
        return f"Phase II: {counts or 'scenario not stated'}{force}{missing}{out}"
