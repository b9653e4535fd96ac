"""What to measure, what to measure next, and what confirms a map: what `plan`, `next` and `confirm` answer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

from forcemap.answers.answer import AllSaid, Answer, Bound, Figure, Joined, Said, of
from forcemap.arrays import FloatArray
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.planning.confirm import ConfirmationPlan, Confirmed
from forcemap.planning.measurements import DesignedPlan
from forcemap.planning.next.measurements import NextMeasurements, Stop


class Run(Answer):
    """An impact to make."""

    recording: str
    state_id: str
    repeat: int
    role: str
    distance_m: float
    height_m: float
    speed_mps: float
    base_angle_deg: Figure
    expected_force_N: Figure


class BoundedRun(Run):
    """An impact to make, with the force that it must not exceed."""

    upper_force_N: Figure


class PlanAnswer(Answer):
    """A campaign that was planned."""

    folder: str
    files: list[str]
    states: int
    places: int
    set_ups: int
    minutes: float
    runs: list[Run]
    expected_from: Said
    left_out: AllSaid
    warnings: AllSaid
    design_note: Said = of("note")
    expected_bound_width: Figure = of("bound_width")

    @classmethod
    def of_plan(cls, plan: DesignedPlan, folder: str, files: list[str], minutes: float) -> Self:
        """The answer for a plan written to these files of a folder, and the minutes that it takes."""
        counts = {"states": len(plan.states), "minutes": minutes}
        return cls.from_result(plan, folder=folder, files=files, runs=_runs(plan), **counts)


class NextAnswer(Answer):
    """What to measure next, or why to stop."""

    folder: str
    files: list[str]
    simulated: bool
    stop: Stop | None
    reason: Joined = of("reasons")
    places: int
    confirmed_places: int = of("confirmed")
    mean_speed_mps: Figure = of("speed")
    expected_confirmed_places: int = of("expected_confirmed")
    expected_mean_speed_mps: Figure = of("expected_speed")
    states: int
    runs: list[BoundedRun]
    upper_force_is: Said = of("upper_is")
    warnings: AllSaid
    planned_within: AllSaid = of("within")
    next_command: str

    @classmethod
    def of_next(cls, measure: NextMeasurements, folder: str, files: list[str], command: str) -> Self:
        """The answer for what to measure, the files written and the command to go on with."""
        planned: dict[str, Any] = {"states": 0, "runs": []}
        if (plan := measure.plan) is not None:
            runs = _runs(plan, measure.upper_force)
            planned = {"states": len(plan.states), "runs": runs}
        return cls.from_result(measure, folder=folder, files=files, next_command=command, **planned)


class ConfirmingImpactAnswer(Answer):
    """An impact at a released speed, and whether it confirms the map."""

    recording: str
    state_id: str = of("state")
    distance_m: float = of("distance")
    height_m: float = of("height")
    speed_mps: float = of("speed")
    peak_force_N: Figure = of("force")
    bound_force_N: Figure = of("bound_force")
    outcome: Confirmed
    reason: Said


class ConfirmAnswer(Answer):
    """The impacts that are to confirm a map; `outcome` is null until one of them is measured."""

    source: str
    files: list[str]
    simulated: bool = of("force_map", "simulated")
    outcome: Confirmed | None
    reason: Said
    impacts: list[ConfirmingImpactAnswer]
    settled: list[ConfirmingImpactAnswer]
    missing: list[str]
    replaced: list[str]
    limit_N: float = of("limit")
    bound: Bound
    rule: Said
    warnings: AllSaid
    not_passed_probability: Figure = of("not_passed")
    above_bound_probability: Figure = of("above_bound")
    found_probability_10_percent: Figure = of("higher_detected")
    found_probability_ridge: Figure = of("ridge_detected")
    found_probability_bump: Figure = of("bump_detected")
    runs: list[BoundedRun]
    next_command: str

    @classmethod
    def of_confirmation(cls, confirmation: ConfirmationPlan, source: str, files: list[str], command: str) -> Self:
        """The answer for a confirmation, planned or judged, the files written and the command to ask again."""
        result = confirmation.result
        return cls.from_result(
            confirmation,
            source=source,
            files=files,
            outcome=result and result.outcome,
            reason=result.reason if result else confirmation.refusal,
            impacts=[ConfirmingImpactAnswer.from_result(impact) for impact in (result.impacts if result else ())],
            settled=[ConfirmingImpactAnswer.from_result(impact) for impact in (result.settled if result else ())],
            missing=result.missing if result else confirmation.plan.recording.tolist(),
            replaced=confirmation.replaced.recording.tolist(),
            runs=_runs(confirmation.plan, confirmation.bound_force),
            next_command=command,
        )


def _runs(plan: MeasurementPlan, upper: FloatArray | None = None) -> Sequence[Run]:
    columns: dict[str, Any] = {"recording": plan.recording, "state_id": plan.state_id, "repeat": plan.repeat}
    columns |= {"role": plan.role, "distance_m": plan.distance, "height_m": plan.height, "speed_mps": plan.speed}
    columns |= {"base_angle_deg": plan.base_angle, "expected_force_N": plan.expected_force}
    if upper is None:
        return Run.of_columns(**columns)
    return BoundedRun.of_columns(**columns, upper_force_N=upper)
