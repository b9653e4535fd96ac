"""Whether a form fits its states, and whether forces have drifted."""

from __future__ import annotations

from forcemap.answers.answer import AllSaid, Answer, Figure, Percent, Said, of


class DepartureAnswer(Answer):
    """The most significant departure of a kind: around a distance, height or speed, or at a place.

    With distance, height and speed all null, the force bends otherwise than the form along that coordinate.
    """

    along: str
    distance_m: Figure = of("distance")
    height_m: Figure = of("height")
    speed_mps: Figure = of("speed")
    effect_percent: Percent = of("effect")
    tested: int
    p_value: Figure


class FormTestAnswer(Answer):
    """Whether the states of a map contradict its form; p values are adjusted for all departures tested."""

    p_value: Figure
    states: int
    left_out: int
    departures: list[DepartureAnswer]
    gaps: list[str]
    not_tested: list[str]
    near: int
    slow_places: int
    slowest_mps: Figure = of("slowest")
    misses: bool
    covered: bool
    finding: Said
    warnings: AllSaid


class DriftAnswer(Answer):
    """How far the force of states measured again has changed, with a 95 % confidence interval; null with one state."""

    states: int
    censored: int
    change_percent: Percent = of("change")
    low_percent: Percent = of("low")
    high_percent: Percent = of("high")
    p_value: Figure
    found: bool = of("significant")
    finding: Said
