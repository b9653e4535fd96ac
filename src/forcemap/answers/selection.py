"""The paper's selection of terms, and how stable its outcome is: what `select` answers."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import BeforeValidator

from forcemap.answers.answer import AllSaid, Answer, Said, Words, of
from forcemap.comparisons.selection import PAPER_COUNTS, SelectionStability


class StageOne(Answer):
    """A term of the start: its p values, and whether they removed it."""

    term: Words
    p_values: list[float]
    removed: bool


class SelectionStep(Answer):
    """A fit with fewer terms than the one before; change is that of RMSE [N] and 100 times R^2."""

    removed: list[Words]
    terms: int
    change_N: float = of("change")
    rmse_N: list[float] = of("rmse")
    r_squared: list[float]


class SelectionAnswer(Answer):
    """The terms that a selection leaves, how it came to them, and the share of resamples in which each survives."""

    datasets: list[str] = of("selection", "datasets")
    simulated: bool
    terms: list[Words] = of("selection", "terms")
    counts: list[int] = of("selection", "counts")
    paper_counts: list[int]
    only_here: list[Words] = of("selection", "only_here")
    only_in_paper: list[Words] = of("selection", "only_in_paper")
    stage_one: list[StageOne] = of("selection", "stage_one")
    steps: list[SelectionStep] = of("selection", "steps")
    stopped_at: SelectionStep | None = of("selection", "refused")
    threshold_N: float = of("selection", "threshold")
    stable: bool
    same_terms_share: float = of("same_terms")
    resamples: int
    seed: int
    survival: Annotated[dict[str, float], BeforeValidator(lambda terms: {str(term.term): term.share for term in terms})]
    reason: Said
    assumptions: AllSaid = of("selection", "statements")

    @classmethod
    def of_selection(cls, stability: SelectionStability, *, simulated: bool) -> Self:
        """The answer for a selection."""
        return cls.from_result(stability, paper_counts=PAPER_COUNTS, simulated=simulated)
