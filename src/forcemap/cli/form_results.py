"""Forms compared and terms selected: dictionaries for JSON and lines of text."""

from __future__ import annotations

import math
from typing import Any

from forcemap import (
    CFM_3D,
    FULL_CUBIC,
    PAPER_COUNTS,
    FitError,
    FormComparison,
    FormResult,
    RankDeficient,
    SelectionStability,
    SelectionStep,
    TooFewStates,
)
from forcemap.cli.output import listing, table
from forcemap.cli.results import accuracy_result


def forms_result(comparison: FormComparison) -> dict[str, Any]:
    """A FormComparison for JSON."""
    return {
        "recommended": None if comparison.recommended is None else comparison.recommended.name,
        "reason": comparison.reason,
        "reasons": list(comparison.reasons),
        "states": comparison.states,
        "bound": comparison.bound.describe(),
        "forms": [
            {
                "form": each.form.name,
                "error_percent": each.error_percent,
                "underestimation_percent": each.underestimation_percent,
                "accuracy": accuracy_result(each.accuracy),
                "mean_bound_percent": each.mean_bound_percent,
                "max_bound_percent": each.max_bound_percent,
                "rises_inside": each.rises_inside,
                "rises_above": each.rises_above,
                "p_better": each.p_better,
                "note": each.note,
            }
            for each in comparison.results
        ],
        "refused": [{"form": each.form.name, "reason": each.reason} for each in comparison.refused],
        "assumptions": list(comparison.statements),
    }


def forms_lines(comparison: FormComparison) -> list[str]:
    """A FormComparison as a table and a recommendation."""
    lines = [line for line in comparison.statements if line.startswith("SIMULATED")]
    lines += [
        f"Forms on {comparison.states} states, each predicted from the others (RMS and largest error of the force)",
        *table(
            ["form", "error", "underest.", "underest. max", "bound mean", "bound max", "rises inside", "rises above"],
            [_form_row(each) for each in comparison.results],
        ),
        "underest.: the dangerous side; bound: above the prediction at the measured states, - none",
        "rises inside, rises above: the force never falls with speed in the box around the measured states, and in "
        "that box up to 1.5 times the highest measured speed",
        *(f"{each.form.name}: {each.note}" for each in comparison.results if each.note),
        *(f"{each.form.name} not compared: {each.reason}" for each in comparison.refused),
        "",
        f"Recommended: {'none' if comparison.recommended is None else comparison.recommended.name}",
        *(f"  {reason}" for reason in comparison.reasons),
    ]
    return [*lines, "", *listing("Assumes", comparison.statements)]


def _form_row(each: FormResult) -> list[str]:
    bounds = [f"+{x:.1f} %" if math.isfinite(x) else "-" for x in (each.mean_bound_percent, each.max_bound_percent)]
    rises = ["yes" if rising else "no" for rising in (each.rises_inside, each.rises_above)]
    errors = (each.error_percent, each.underestimation_percent, each.accuracy.max_underestimation_percent)
    return [each.form.name, *(f"{error:.2f} %" for error in errors), *bounds, *rises]


def selection_result(stability: SelectionStability) -> dict[str, Any]:
    """A term selection and its stability for JSON."""
    selection = stability.selection
    share = {each.term: each.share for each in stability.survival}
    return {
        "terms": [str(term) for term in selection.terms],
        "counts": list(selection.counts),
        "paper_counts": list(PAPER_COUNTS),
        "only_here": [str(term) for term in selection.only_here],
        "only_in_paper": [str(term) for term in selection.only_in_paper],
        "stage_one": [
            {"term": str(each.term), "p_values": list(each.p_values), "removed": each.removed}
            for each in selection.stage_one
        ],
        "steps": [_step_result(step) for step in selection.steps],
        "stopped_at": None if selection.refused is None else _step_result(selection.refused),
        "stable": stability.stable,
        "same_terms_share": stability.same_terms,
        "resamples": stability.resamples,
        "seed": stability.seed,
        "survival": {str(term): value for term, value in share.items()},
        "reason": stability.reason,
        "assumptions": list(selection.statements),
    }


def _step_result(step: SelectionStep) -> dict[str, Any]:
    return {
        "removed": [str(term) for term in step.removed],
        "terms": step.terms,
        "change_N": step.change,
        "rmse_N": list(step.rmse),
        "r_squared": list(step.r_squared),
    }


def selection_lines(stability: SelectionStability) -> list[str]:
    """The trace of a term selection, its outcome beside the paper's, and how often terms survive."""
    selection = stability.selection
    steps = [("", step) for step in selection.steps]
    steps += [] if selection.refused is None else [("refused: ", selection.refused)]
    trace = [
        [
            refused + (", ".join(map(str, step.removed)) or "(all terms)"),
            str(step.terms),
            f"{step.change:.3f}",
            *(f"{rmse:.3f} N" for rmse in step.rmse),
            *(f"{r_squared:.4f}" for r_squared in step.r_squared),
        ]
        for refused, step in steps
    ]
    count = len(selection.datasets)
    header = ["removed", "terms left", "change", *["RMSE"] * count, *["R^2"] * count]
    one_table = ["with one table the outcome is often not stable; the paper selected on three"] if count == 1 else []
    kept, paper = (", ".join(map(str, counts)) for counts in (selection.counts, PAPER_COUNTS))
    mine, theirs = (", ".join(map(str, terms)) for terms in (selection.only_here, selection.only_in_paper))
    survival = sorted(stability.survival, key=lambda each: -each.share)
    return [
        "Term selection as in the paper: a report only, the fit above does not use it",
        *table(header, trace),
        f"a removal may change RMSE [N] + 100 x R^2 by at most {selection.threshold:g}",
        f"terms at the start, after stage one, at the end: {kept} (the paper, on its three tables: {paper})",
        f"kept: {', '.join(map(str, selection.terms))}",
        f"kept, but not among the paper's eight: {mine or 'none'}",
        f"among the paper's eight, but not kept: {theirs or 'none'}",
        "",
        f"Is that outcome stable? {stability.reason}",
        *one_table,
        *table(
            ["term", "kept", "survives"],
            [[str(each.term), "yes" if each.selected else "no", f"{100 * each.share:.0f} %"] for each in survival],
        ),
        *listing("Assumes", selection.statements),
        "",
        f"Conclusion: {_conclusion(stability)}",
    ]


def _conclusion(stability: SelectionStability) -> str:
    if {*stability.selection.form.terms} == {*CFM_3D.terms}:
        return "the terms of CFM_3D, the paper's eight, are what these impacts select; keep the form"
    if stability.stable:
        return (
            "these impacts select other terms than the paper's eight, and stably; before a form of them is used, see "
            "whether other campaigns select the same (docs/trust.md)"
        )
    return "which terms are kept hangs on which states were measured: no reason to change the form"


def selection_refusal(error: FitError) -> str:
    """Why a selection of terms is not possible, and what it needs."""
    if isinstance(error, TooFewStates | RankDeficient):
        return (
            "Term selection needs a full grid (plan --design full-grid): the training states alone cannot tell "
            f"{len(FULL_CUBIC.terms)} coefficients ({error.message.partition('; ')[0]})"
        )
    return f"Term selection is not possible: {error}"
