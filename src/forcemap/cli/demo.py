"""forcemap demo."""

from __future__ import annotations

import shlex
import shutil
import sys
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

import forcemap as fm
from forcemap.answers.answer import Answer
from forcemap.answers.collect import CollectAnswer
from forcemap.answers.comparison import ComparisonAnswer
from forcemap.answers.evaluate import EvaluateAnswer
from forcemap.answers.map import FitAnswer
from forcemap.answers.speed_map import SpeedMapAnswer
from forcemap.assessment.missing import present
from forcemap.assessment.place_speeds import PlaceSpeeds
from forcemap.campaigns.examples import CLAMPING_EXAMPLES, copy_task
from forcemap.campaigns.memory import MEMORY_FILE
from forcemap.cli.collect import contact_lines, scatter_lines
from forcemap.cli.fit import impacts_words
from forcemap.cli.options import Json
from forcemap.cli.output import emit, listing, table, wrapped
from forcemap.cli.planned import command_lines
from forcemap.cli.report import REPORT_LIST, answer_lines, write_report
from forcemap.cli.speed import fastest_line, grid_lines, next_lines, speed_map_table, standard_lines
from forcemap.files import write_atomically
from forcemap.report.seal import REPORT_FILE
from forcemap.words import sentence, sentences

_AREA = "back_of_hand"
"""The body area of the example; a choice."""

_CLAMPED = ("thigh_muscle", "quasi-static")
"""What to ask next where impacts clamp; a choice: an area with speeds in these examples, as in their task.toml."""

_MOST_DEMOS = 1000
"""Folders of the demo's own name; a choice, so that the search for a free one ends."""


def demo(
    folder: Annotated[str | None, Argument(help="New folder for the example campaign; default: forcemap-demo.")] = None,
    example: Annotated[str, Option("--example", help=", ".join(fm.EXAMPLE_CAMPAIGNS) + ".")] = "ur10e",
    as_json: Json = False,
) -> None:
    """Run the whole chain on a simulated campaign, from raw recordings on, and write its results into a new folder.

    Example: forcemap demo my-first-campaign
    """
    from forcemap.lab.example_campaigns import simulate_example

    target = simulate_example(example, folder or _free_name()).folder
    copy_task(example, target)
    (target / "maps").mkdir()
    fm.write_map(fm.fit_force_map(fm.build_dataset(fm.read_campaign(target))), target / "maps" / "cfm_3d.json")
    assessment = fm.assess_campaign(target, limits=[fm.force_limit(_AREA)])
    force_map, dataset = present(assessment.force_map), present(assessment.dataset)
    accuracies = present(assessment.accuracy)
    fit = FitAnswer.of_fit(dataset, force_map, accuracies)
    limit, compared = assessment.limits[0], present(assessment.comparisons[0])
    comparison = ComparisonAnswer.of_comparison(compared, limit, simulated=assessment.simulated)
    speeds = [SpeedMapAnswer.of_speeds(force_map, present(part.speeds), accuracies[0]) for part in assessment.speeds]

    results: dict[str, Answer] = {
        "accuracy": EvaluateAnswer.of_map(force_map, dataset, accuracies),
        "comparison": comparison,
    }
    for part, answer in zip(assessment.speeds, speeds, strict=True):
        results[f"speeds-{part.contact}"] = answer
        text = speed_map_table(present(part.speeds), answer, force_map.source)
        write_atomically(target / f"speeds-{part.contact}.csv", text)
    for name, result in results.items():
        write_atomically(target / f"{name}.json", result.json_text() + "\n")
    summary = _summary(assessment, fit, speeds)
    write_atomically(target / "summary.txt", "\n".join(wrapped(summary)) + "\n")
    written = sorted(
        str(path.relative_to(target)) for path in target.rglob("*") if path.is_file() and path.name != MEMORY_FILE
    )
    files = [file for file in written if not file.startswith("recordings/")]
    files += [REPORT_FILE, REPORT_LIST, f"recordings/ ({len(written) - len(files)} files)"]
    report, _ = write_report(assessment, target / REPORT_FILE, None, pdf=False)
    shown = {
        "folder": str(target),
        "files": files,
        "report": report,
        "fit": fit,
        "speed_maps": {str(part.contact): answer for part, answer in zip(assessment.speeds, speeds, strict=True)},
        "comparison": comparison,
    }
    emit(shown, [*summary, *_closing(target, files, report, example)], as_json=as_json)


def _closing(target: Path, files: list[str], report: str, example: str) -> list[str]:
    """What was written, and what to do next."""
    program = "forcemap" if shutil.which("forcemap") else sys.argv[0]
    area, contact = _CLAMPED if example in CLAMPING_EXAMPLES else (_AREA, "transient")
    path, task = (shlex.quote(str(target / name)) for name in ("path.csv", "task.toml"))
    return [
        "",
        f"Written to {target}: {', '.join(files)}",
        "(the map, accuracy, comparison and safe speeds as JSON and CSV; this text as summary.txt; path.csv and "
        "task.toml: a robot's path and task to try and to change)",
        f"The validation report, to open in a browser: {report}",
        f"Next (its impacts clamp: {contact}, {area}):" if example in CLAMPING_EXAMPLES else "Next:",
        *command_lines(
            f"{program} speed {shlex.quote(str(target))} --distance 0.8 --height 0.4 --area {area} --contact {contact}"
        ),
        *command_lines(f"{program} path {shlex.quote(str(target))} {path} --task {task}"),
        *command_lines(f"{program} serve {shlex.quote(str(target))} --area {area}"),
    ]


def _free_name() -> str:
    for name in ["forcemap-demo", *(f"forcemap-demo-{number}" for number in range(2, _MOST_DEMOS))]:
        if not Path(name).exists():
            return name
    raise fm.InputError("found a thousand demo folders here, expected room for one; name a folder")


def _summary(assessment: fm.CampaignAssessment, fit: FitAnswer, speeds: list[SpeedMapAnswer]) -> list[str]:
    """The whole result for a person who sees it for the first time: the speeds, then what they rest on."""
    dataset, force_map = present(assessment.dataset), present(assessment.force_map)
    collected = CollectAnswer.of_campaign(present(assessment.campaign), dataset)
    comparison = present(assessment.comparisons[0])
    lines = answer_lines(assessment)
    for part, answer in zip(assessment.speeds, speeds, strict=True):
        lines += ["", answer.limit, *grid_lines(answer), fastest_line(answer)]
        lines += [*standard_lines(answer), *_against_standard(assessment, part), *next_lines(answer)]
    accuracies = [(accuracy.on, accuracy) for accuracy in present(assessment.accuracy)]
    accuracies += [(model.model, model.accuracy) for model in comparison.models[1:]]
    rows = [[name, str(errors.states), *_percent(errors), f"{errors.rmse:.1f} N"] for name, errors in accuracies]
    rests_on = [
        f"robot: {assessment.conditions.robot}",
        f"{collected.recordings} recordings, of which {collected.used} gave an impact, in {collected.states} states; "
        f"{collected.censored} reached the device range of {assessment.conditions.device.range:g} N",
        *contact_lines(collected),
        *scatter_lines(collected.repeatability),
        f"map: {force_map.form.name} {force_map.source}; {impacts_words(fit)}",
        f"bound: {assessment.bound}",
        *sentences(comparison.statements),
    ]
    lines += [
        "",
        "How far predictions are from measurements (underestimation is the dangerous side);",
        f"other models on {comparison.on}",
        *table(["", "states", "underest. max", "mean", "overest. max", "mean", "RMSE"], rows),
        "",
        *listing("What this rests on", dict.fromkeys(rests_on)),
    ]
    return lines


def _against_standard(assessment: fm.CampaignAssessment, speeds: PlaceSpeeds) -> list[str]:
    """What speaks against the standard's speed for a transient contact, if something does."""
    error = assessment.conditions.device.error_or_default
    why = present(assessment.dataset).phase_two.transient_refusal(speeds.limit.quasi_static, error)
    return [f"  and {sentence(why)}"] if why and speeds.contact is fm.Contact.TRANSIENT else []


def _percent(accuracy: fm.Accuracy) -> list[str]:
    """Largest and mean underestimation, then overestimation."""
    under = accuracy.max_underestimation_percent, accuracy.mean_underestimation_percent
    over = accuracy.max_overestimation_percent, accuracy.mean_overestimation_percent
    return [f"{value:.1f} %" for value in (*under, *over)]
