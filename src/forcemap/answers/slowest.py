"""From which speed on a map may hold: what `evaluate --slowest` answers."""

from __future__ import annotations

from forcemap.answers.answer import AllSaid, Answer, Figure, Percent, Said, of
from forcemap.answers.map import Span
from forcemap.comparisons.slowest_speeds import FromSpeed


class FromSpeedAnswer(Answer):
    """The map that holds from a speed on; places with a speed are null without a body area.

    `slower_over_map` is what slower impacts reached at most over the map's force at its lowest speed, at least 1; 0
    without any. `places_with_a_speed_5_deg_off` are those for motion up to 5 degrees off the map's direction.
    """

    slowest_mps: float = of("slowest")
    states: int
    places: int
    state_sd_percent: Percent = of("state_sd")
    bound_margin_percent: Span = of("margin")
    slower_over_map: float = of("slower")
    places_with_a_speed: int | None = of("permitted")
    places_with_a_speed_5_deg_off: int | None = of("off_axis")
    places_looked_at: int = of("counted")
    lowest_to_program_mps: Figure
    highest_to_program_mps: Figure
    reason: Said
    warnings: AllSaid

    @classmethod
    def of_map(cls, found: FromSpeed) -> FromSpeedAnswer:
        """The answer of one map."""
        low, high = found.speeds
        return cls.from_result(found, lowest_to_program_mps=low, highest_to_program_mps=high)


class SlowestAnswer(Answer):
    """The maps of a campaign from each of its speeds on."""

    area: str | None
    contact: str | None
    stated_mps: Figure
    from_speeds: list[FromSpeedAnswer]
    simulated: bool

    @property
    def shared_warnings(self) -> list[str]:
        """What must be said before the speeds of every one of these maps that carries a bound."""
        said = [each.warnings for each in self.from_speeds if each.bound_margin_percent]
        return [line for line in said[0] if all(line in other for other in said)] if said else []

    @property
    def narrowest(self) -> FromSpeedAnswer | None:
        """The map with the narrowest bound; None if none carries one."""
        bounded = [each for each in self.from_speeds if each.bound_margin_percent]
        return min(bounded, key=lambda each: each.bound_margin_percent.highest, default=None)  # type: ignore[union-attr]

    @property
    def widest(self) -> FromSpeedAnswer | None:
        """The map with a speed at most places; None without any, or without a body area."""
        given = [each for each in self.from_speeds if each.places_with_a_speed]
        return max(given, key=lambda each: each.places_with_a_speed or 0, default=None)
