"""How far predictions are from measured forces."""

from __future__ import annotations

from forcemap.answers.answer import Answer, Percent, of, of_if_any


class AccuracyAnswer(Answer):
    """Errors over states, percent of the measured force; underestimation is the dangerous side."""

    on: str
    states: int
    underestimated: int
    max_underestimation_percent: float
    max_underestimation_N: float = of("max_underestimation")
    mean_underestimation_percent: float
    mean_underestimation_N: float = of("mean_underestimation")
    overestimated: int
    max_overestimation_percent: float
    max_overestimation_N: float = of("max_overestimation")
    mean_overestimation_percent: float
    mean_overestimation_N: float = of("mean_overestimation")
    rmse_N: float = of("rmse")
    worst_state: str
    censored_states: int
    censored_underestimated: int
    skipped_states: int
    outside_states: int | None


class PlaceFigures(Answer):
    """Scatter that states of a place share, and that of single states, as the bound uses them; null if not fitted."""

    places: int | None = of_if_any("fit", "place_effect", "places")
    places_shared: int | None = of_if_any("fit", "places_shared")
    place_correlation: float | None = of_if_any("fit", "place_effect", "correlation")
    likely_place_correlation: float | None = of_if_any("fit", "place_effect", "likely")
    least_place_correlation: float | None = of_if_any("fit", "place_effect", "least")
    place_sd_percent: Percent = of_if_any("fit", "place_sd")
    own_sd_percent: Percent = of_if_any("fit", "own_sd")
