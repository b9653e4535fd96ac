"""What measured impacts at released speeds say of the map, by the rule stated before they were made."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.plan import MeasurementPlan

if TYPE_CHECKING:
    from forcemap.planning.confirmation import ConfirmationPlan


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


def judge_confirmation(
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
