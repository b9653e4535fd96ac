"""What measured impacts at released speeds say of the map, by the rule stated before they were made."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.maps.bounds import Bound
from forcemap.maps.force_map import ForceMap
from forcemap.planning.runs import select_runs


class Confirmed(StrEnum):
    """Whether an impact, or all of them, confirm a map; `cannot_tell` is no permission."""

    PASSES = "passes"
    DOES_NOT_PASS = "does_not_pass"
    CANNOT_TELL = "cannot_tell"

    @property
    def words(self) -> str:
        """As it is printed."""
        return self.value.replace("_", " ")


@dataclass(frozen=True)
class ConfirmingImpact:
    """One impact at a released speed.

    Parameters
    ----------
    recording, state : str
        Name of the raw file, or of the run where no impact of it can be used; name of the state.
    distance, height, speed : float
        Place [m], [m] and speed at contact [m/s].
    force, bound_force : float
        Peak force and the bound there [N]; a force of NaN is not known.
    outcome : Confirmed
    reason : str
        Why, in words.
    """

    recording: str
    state: str
    distance: float
    height: float
    speed: float
    force: float
    bound_force: float
    outcome: Confirmed
    reason: str


@dataclass(frozen=True)
class ConfirmationResult:
    """Whether the impacts at released speeds confirm the map.

    Parameters
    ----------
    impacts : tuple of ConfirmingImpact
        Every impact measured; of those planned for other speeds the ones that speak against the map.
    missing : tuple of str
        Planned runs without an impact.
    outcome : Confirmed
    reason : str
        Why, in words.
    """

    impacts: tuple[ConfirmingImpact, ...]
    missing: tuple[str, ...]
    outcome: Confirmed
    reason: str


PREFIX = "c-"
"""Of the names of confirming states."""


@dataclass(frozen=True, eq=False)
class ConfirmationPlan:
    """Impacts at released speeds, and the rule by which they confirm the map.

    Parameters
    ----------
    plan : MeasurementPlan
        One run a state, slow to fast, all with role test; without runs where no speed is released.
    added : MeasurementPlan
        Those of them that were not planned before.
    earlier : MeasurementPlan
        Confirming runs planned before at other speeds, for another limit or map.
    bound_force, earlier_bound_force : array
        Bound at each run of `plan` and of `earlier` [N].
    earlier_released : array
        Speed released now at each run of `earlier` [m/s]; NaN where there is none.
    limit : float
        Force limit [N].
    refusal : str
        Why no speed is released; empty if there is one.
    warnings : tuple of str
        What speaks against the map, or against counting an impact as a test.
    rule : str
        When the impacts confirm the map, in words.
    not_passed : float
        Probability that a sound map does not pass: states scatter as its own did; NaN if nothing tells how they do.
    above_bound : float
        Probability that an impact of a sound map lies above the bound; NaN likewise.
    found : float
        Probability that a force 10 % above the map's does not pass; NaN likewise.
    force_map : ForceMap
        The map to be confirmed.
    bound : Bound
        The bound that released the speeds.
    result : ConfirmationResult or None
        Whether the impacts confirm the map; None before `judged`, and before one is measured.
    """

    plan: MeasurementPlan
    added: MeasurementPlan
    earlier: MeasurementPlan
    bound_force: FloatArray
    earlier_bound_force: FloatArray
    earlier_released: FloatArray
    limit: float
    refusal: str
    warnings: tuple[str, ...]
    rule: str
    not_passed: float
    above_bound: float
    found: float
    force_map: ForceMap
    bound: Bound
    result: ConfirmationResult | None = None

    @staticmethod
    def among(plan: MeasurementPlan) -> Mask:
        """Which runs of a plan are there to confirm a map, shape (n,)."""
        return np.asarray(np.char.startswith(plan.state_id, PREFIX) & (plan.role == "test"))

    def judged(self, impacts: ImpactDataset, checked: Mapping[str, tuple[bool | None, str]]) -> ConfirmationPlan:
        """The same with its result: whether the measured impacts confirm the map by the rule.

        Where they do not, no further ones are added.

        Parameters
        ----------
        impacts : ImpactDataset
            The campaign's impacts.
        checked : mapping of str to (bool or None, str)
            By recording, or by run where a recording gave no impact that can be used: True if it is within the limit,
            False if it exceeds it, None if that cannot be told; and why.
        """
        result = _judge(self, impacts, checked)
        if result is None or result.outcome is not Confirmed.DOES_NOT_PASS:
            return replace(self, result=result)
        before = ~np.isin(self.plan.recording, self.added.recording)
        missing = tuple(name for name in result.missing if name not in self.added.recording.tolist())
        return replace(
            self,
            plan=select_runs(self.plan, before),
            added=select_runs(self.added, np.zeros(len(self.added), dtype=np.bool_)),
            bound_force=self.bound_force[before],
            result=replace(result, missing=missing),
        )


def _judge(
    plan: ConfirmationPlan, impacts: ImpactDataset, checked: Mapping[str, tuple[bool | None, str]]
) -> ConfirmationResult | None:
    """As `ConfirmationPlan.judged`; None before an impact is measured."""
    judged = _judged(plan, plan.plan, impacts, checked)
    there = {impact.state for impact in judged}
    runs = zip(plan.plan.recording.tolist(), plan.plan.state_id.tolist(), strict=True)
    missing = tuple(name for name, state in runs if state not in there)
    released = dict(zip(plan.earlier.state_id.tolist(), plan.earlier_released.tolist(), strict=True))
    # Planned for a lower speed than is released now, one that fails speaks against the map all the same.
    against = [
        impact
        for impact in _judged(plan, plan.earlier, impacts, checked)
        if impact.outcome is Confirmed.DOES_NOT_PASS and impact.speed <= released[impact.state]
    ]
    if not judged and not against:
        return None
    outcome, reason = _overall(plan, [*judged, *against], len(plan.plan), missing)
    return ConfirmationResult((*judged, *against), missing, outcome, reason)


def _overall(
    plan: ConfirmationPlan, judged: list[ConfirmingImpact], planned: int, missing: tuple[str, ...]
) -> tuple[Confirmed, str]:
    failed = sum(impact.outcome is Confirmed.DOES_NOT_PASS for impact in judged)
    unknown = sum(impact.outcome is Confirmed.CANNOT_TELL for impact in judged)
    if failed:
        return Confirmed.DOES_NOT_PASS, f"impacts that do not pass: {failed} of {len(judged)}; release nothing"
    if plan.refusal:
        return Confirmed.DOES_NOT_PASS, f"{plan.refusal}; release nothing"
    if missing:
        return (
            Confirmed.CANNOT_TELL,
            f"planned runs without an impact: {len(missing)} of {planned}; release nothing yet",
        )
    if unknown:
        return Confirmed.CANNOT_TELL, f"impacts that cannot tell: {unknown} of {len(judged)}; measure them again"
    return Confirmed.PASSES, f"each of the {len(judged)} impacts is within {plan.limit:g} N and below the bound"


def _judged(
    plan: ConfirmationPlan,
    runs: MeasurementPlan,
    impacts: ImpactDataset,
    checked: Mapping[str, tuple[bool | None, str]],
) -> list[ConfirmingImpact]:
    """Every impact of the runs' states, slow to fast, and the runs whose recording gave none that can be used."""
    judged = []
    for i, (name, state) in enumerate(zip(runs.recording.tolist(), runs.state_id.tolist(), strict=True)):
        rows = (impacts.state == state).nonzero()[0].tolist()
        place = float(runs.distance[i]), float(runs.height[i])
        planned = float(runs.speed[i])
        for row in rows:
            speed, force = float(impacts.speed[row]), float(impacts.peak_force[row])
            upper = float(plan.bound.upper(plan.force_map, *place, speed))
            recording = str(impacts.recording[row])
            within = checked.get(recording, (None, "its recording was not checked"))
            slow = planned - speed > impacts.tolerance.speed
            outcome, reason = _outcome(force, upper, within, bool(impacts.censored[row]))
            if slow and outcome is Confirmed.PASSES:
                outcome, reason = Confirmed.CANNOT_TELL, f"{speed:g} m/s is slower than the {planned:g} m/s released"
            at = float(impacts.distance[row]), float(impacts.height[row])
            away = max(abs(at[0] - place[0]), abs(at[1] - place[1])) > impacts.tolerance.scale[0]
            if away and outcome is Confirmed.PASSES:
                outcome, reason = Confirmed.CANNOT_TELL, f"measured at d = {at[0]:g} m, h = {at[1]:g} m, not as planned"
            judged.append(ConfirmingImpact(recording, state, *place, speed, force, upper, outcome, reason))
        if not rows and name in checked:
            upper = float(plan.bound.upper(plan.force_map, *place, planned))
            allowed, reason = checked[name]
            outcome = Confirmed.DOES_NOT_PASS if allowed is False else Confirmed.CANNOT_TELL
            judged.append(ConfirmingImpact(name, state, *place, planned, math.nan, upper, outcome, reason))
    return judged


def _outcome(force: float, upper: float, checked: tuple[bool | None, str], censored: bool) -> tuple[Confirmed, str]:
    """An impact by the rule: within the limit, and not above the bound."""
    within, why = checked
    if within is False:
        return Confirmed.DOES_NOT_PASS, why
    if force > upper:
        least = "at least " if censored else ""
        return Confirmed.DOES_NOT_PASS, f"{least}{force:.1f} N exceed the bound of {upper:.1f} N"
    if within is None:
        return Confirmed.CANNOT_TELL, why
    if censored:
        return Confirmed.CANNOT_TELL, f"at least {force:.1f} N: the device range was exceeded"
    return Confirmed.PASSES, f"{why}; the bound is {upper:.1f} N"
