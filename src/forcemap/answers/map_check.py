"""Whether an older map still holds for new impacts: what `evaluate --against` answers."""

from __future__ import annotations

from forcemap.answers.answer import AllSaid, Answer, Figure, Percent, Said, of


class NewState(Answer):
    """A new state."""

    state_id: str = of("state")
    distance_m: float = of("distance")
    height_m: float = of("height")
    speed_mps: float = of("speed")


class StateCheck(NewState):
    """A new state against what the map expects; a censored force is a lower bound."""

    measured_N: float = of("measured")
    censored: int
    predicted_N: float = of("predicted")
    lowest_expected_N: Figure = of("lowest_expected")
    highest_expected_N: Figure = of("highest_expected")
    ratio: Figure
    p_value: Figure
    moved: bool


class LeftOutState(NewState):
    """A new state that cannot be compared, and why."""

    reason: Said


class MapCheckAnswer(Answer):
    """Whether a map holds, does not hold, or cannot be told to; ratios are measured over predicted force."""

    outcome: str
    reason: Said
    next_step: Said
    mean_ratio: Figure
    mean_ratio_low: Figure
    mean_ratio_high: Figure
    confidence: Figure
    p_mean: Figure
    p_whole: Figure
    detectable_change_percent: Percent = of("detectable_change")
    error_probability: float
    states: list[StateCheck]
    left_out: list[LeftOutState]
    simulated: bool
    assumptions: AllSaid = of("statements")
