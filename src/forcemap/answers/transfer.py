"""A map carried over to a changed robot: what `transfer` answers."""

from __future__ import annotations

from typing import Any, Self

from forcemap.answers.accuracy import AccuracyAnswer
from forcemap.answers.answer import AllSaid, Answer, Figure, Figures, Percent, if_any, of
from forcemap.answers.map import BindingAnswer, Span, margins_of
from forcemap.errors import TransferRefused
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.force_map import ForceMap
from forcemap.maps.map_file import map_sha256
from forcemap.speeds.basis import doubts_of_fit


class EarlierCampaign(Answer):
    """A campaign that a map was carried over from."""

    name: str
    map_sha256: str
    states: int
    shift: list[str]
    changed: dict[str, list[str]]


class CarriedMap(Answer):
    """The map that was carried over."""

    form: str = of("form", "name")
    terms: list[str] = of("form", "term_names")
    coefficients: Figures
    standard_errors: Figures = of("fit", "standard_errors")
    states: int
    states_left_out: list[str] = of("fit", "left_out", "name")
    censored_samples: int = of("fit", "censored_samples")
    state_sd_percent: Percent = of("fit", "state_sd")
    degrees_of_freedom: Figure = of("fit", "between_states", "degrees_of_freedom")
    bound_margin_percent: Span
    lowest_measured: Figures = of("measured_range", "lowest")
    highest_measured: Figures = of("measured_range", "highest")
    accuracy: AccuracyAnswer | None
    binding: BindingAnswer
    simulated: bool
    map_sha256: str


class TransferAnswer(Answer):
    """Whether a map is carried over; if not, what to measure."""

    outcome: str
    misfit_p: float = of("p_value")
    reason: str
    earlier: list[EarlierCampaign]
    warnings: AllSaid
    statements: AllSaid = of("findings")
    map: CarriedMap | None = if_any()

    @classmethod
    def of_refusal(cls, refusal: TransferRefused) -> Self:
        """The answer where the new states contradict the earlier map."""
        nothing: dict[str, Any] = {"earlier": [], "warnings": [], "findings": [], "map": None}
        return cls.from_result(refusal, outcome="refused", reason=refusal.message, **nothing)

    @classmethod
    def of_map(cls, force_map: ForceMap, accuracy: Accuracy | None) -> Self:
        """The answer for a map that was carried over."""
        fit = force_map.require_fit()
        assert fit.transfer is not None
        earlier = [
            EarlierCampaign(
                name=campaign.name,
                map_sha256=campaign.map_sha256,
                states=len(campaign.states),
                shift=shift.term_names,
                changed={entry: [then, now] for entry, then, now in campaign.different},
            )
            for campaign, shift in zip(fit.transfer.earlier, fit.transfer.shifts, strict=True)
        ]
        carried = CarriedMap.from_result(
            force_map,
            states=len(fit.states),
            bound_margin_percent=margins_of(force_map),
            accuracy=accuracy,
            map_sha256=map_sha256(force_map),
        )
        sinks = filter(None, [force_map.phase_two.doubt])
        warnings = [*fit.transfer.warnings, *sinks, *doubts_of_fit(force_map)]
        figures: dict[str, Any] = {"earlier": earlier, "warnings": warnings, "map": carried}
        return cls.from_result(fit.transfer, outcome="carried_over", reason="", **figures)
