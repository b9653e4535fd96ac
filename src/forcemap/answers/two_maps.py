"""Two maps over the range that both have measured: what `compare MAP MAP` answers."""

from __future__ import annotations

from forcemap.answers.answer import AllSaid, Answer, Figure, PlaceAndSpeed, Said, of


class RatioAt(Answer):
    """Force of the other map over that of the one, and where."""

    ratio: float
    distance_m: float = of("distance")
    height_m: float = of("height")
    speed_mps: float = of("speed")
    one_N: float = of("one_force")
    other_N: float = of("other_force")


class TwoMapsAnswer(Answer):
    """Two maps compared; ratios are the force of `other` over that of `one`."""

    one: Said
    other: Said
    same_map: bool = of("same")
    mean_ratio: Figure
    geometric_mean_ratio: Figure
    smallest: RatioAt
    largest: RatioAt
    higher_share: float
    points: int
    lowest: PlaceAndSpeed
    highest: PlaceAndSpeed
    simulated: bool
    assumptions: AllSaid = of("statements")
