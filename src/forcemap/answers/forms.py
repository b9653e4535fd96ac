"""Forms beside each other on the same states: what `evaluate --forms` answers."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator

from forcemap.answers.accuracy import AccuracyAnswer
from forcemap.answers.answer import AllSaid, Answer, Bound, Figure, Joined, Said, of


class FormAnswer(Answer):
    """How one form does on states that it was not fitted to."""

    form: str = of("form", "name")
    error_percent: float
    underestimation_percent: float
    place_error_percent: Figure
    accuracy: AccuracyAnswer
    mean_bound_percent: Figure
    max_bound_percent: Figure
    rises_inside: bool
    rises_above: bool
    p_better: Figure
    p_better_at_places: Figure
    covered: bool
    note: Joined = of("notes")


class RefusedForm(Answer):
    """A form that these impacts cannot be compared on."""

    form: str = of("form", "name")
    reason: Said


class FormsAnswer(Answer):
    """Forms compared on the same left-out states; nothing is recommended where no form carries the bound."""

    recommended: Annotated[str | None, BeforeValidator(lambda form: form and form.name)]
    reason: Joined = of("reasons")
    reasons: AllSaid
    states: int
    bound: Bound
    forms: list[FormAnswer] = of("results")
    refused: list[RefusedForm]
    simulated: bool
    assumptions: AllSaid = of("statements")
