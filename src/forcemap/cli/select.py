"""forcemap select: the paper's selection of terms, over several tables at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from typer import Argument

import forcemap as fm
from forcemap.answers.selection import SelectionAnswer
from forcemap.cli.options import Json, impacts_of, require_one_map
from forcemap.cli.output import emit, listing, table, verdict_first
from forcemap.comparisons.selection import selection_stability

_CONCLUSIONS = {
    "paper": "the terms of CFM_3D, the paper's eight, are what these impacts select; keep the form",
    "stable": "these impacts select other terms than the paper's eight, and stably; before a form of them is used, see "
    "whether other campaigns select the same (docs/trust.md)",
    "unstable": "which terms are kept hangs on which states were measured: no reason to change the form",
}


def select(
    tables: Annotated[
        list[str], Argument(metavar="TABLE...", help="Impacts tables (CSV) or campaign folders, best full grids.")
    ],
    as_json: Json = False,
) -> None:
    """Show which terms the paper's selection keeps on the impacts of all tables together, and whether that is stable.

    A report: no fit uses it. The paper selected on three tables at once.

    Example: forcemap select impacts.csv
    """
    for name in tables:
        require_one_map(name)
    datasets = [impacts_of(name) for name in tables]
    try:
        stability = selection_stability(datasets)
    except (fm.TooFewStates, fm.RankDeficient) as error:
        coefficients = len(fm.FULL_CUBIC.terms)
        raise type(error)(
            f"Term selection starts from {coefficients} terms up to the third power, so it needs at least four "
            "distances, heights and speeds, best a full grid of them (plan --design full-grid has five of "
            f"each, and test states count): {error.problem}",
            file=error.file,
        ) from None
    answer = SelectionAnswer.of_selection(stability, simulated=any(dataset.simulated for dataset in datasets))
    emit(answer, selection_lines(answer, tables), as_json=as_json)


def selection_lines(answer: SelectionAnswer, names: Sequence[str]) -> list[str]:
    """The trace of a term selection, its outcome beside the paper's, and how often terms survive."""
    steps = [("", step) for step in answer.steps]
    steps += [("refused: ", answer.stopped_at)] if answer.stopped_at else []
    trace = [
        [
            refused + (", ".join(step.removed) or "(all terms)"),
            str(step.terms),
            f"{step.change_N:.3f}",
            *(f"{rmse:.3f} N" for rmse in step.rmse_N),
            *(f"{r_squared:.4f}" for r_squared in step.r_squared),
        ]
        for refused, step in steps
    ]
    left, paper = (", ".join(map(str, counts)) for counts in (answer.counts, answer.paper_counts))
    survival = sorted(answer.survival.items(), key=lambda term_and_share: -term_and_share[1])
    same = {*answer.terms} == {str(term) for term in fm.CFM_3D.terms} - {"1"}
    conclusion = _CONCLUSIONS["paper" if same else "stable" if answer.stable else "unstable"]
    short = [str(number) for number in range(1, len(names) + 1)] if len(names) > 1 else [""]
    header = [f"{figure} {number}".rstrip() for figure in ("RMSE", "R^2") for number in short]
    return [
        *verdict_first(f"Conclusion: {conclusion}", simulated=answer.simulated),
        "Term selection as in the paper: a report only, no fit uses it",
        *(f"{number}: {name}" for number, name in zip(short, names, strict=True) if number),
        *table(["removed", "terms left", "change", *header], trace),
        "stage one removes terms by their p values, whatever that changes; in stage two",
        f"a removal may change RMSE [N] + 100 x R^2 (of ln F) by at most {answer.threshold_N:g}",
        f"terms at the start, after stage one, at the end: {left} (the paper, on its three tables: {paper})",
        f"kept: {_names(answer.terms)}",
        f"kept, but not among the paper's eight: {_names(answer.only_here)}",
        f"among the paper's eight, but not kept: {_names(answer.only_in_paper)}",
        f"Is that outcome stable? {answer.reason}",
        *["with one table the outcome is often not stable; the paper selected on three"] * (len(names) == 1),
        f"how often each survives: {', '.join(f'{term} {100 * share:.0f} %' for term, share in survival)}",
        *listing("Assumes", answer.assumptions),
    ]


def _names(terms: Sequence[str]) -> str:
    return ", ".join(terms) or "none"
