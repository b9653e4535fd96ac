"""forcemap demo."""

from __future__ import annotations

import itertools
import math
import shutil
import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from forcemap import (
    EXAMPLE_CAMPAIGNS,
    Assessment,
    CampaignSummary,
    Contact,
    InputError,
    Repeatability,
    ToleranceBound,
    assess,
    assess_campaign,
    body_region,
    build_dataset,
    campaign_summary,
    floor_speed,
    force_limit,
    pfl_robot_mass,
    pfl_speed_limit,
    read_campaign,
    repeatability,
    write_map,
)
from forcemap.cli.collect import contact_lines, scatter_lines
from forcemap.cli.options import Json
from forcemap.cli.output import emit, json_text
from forcemap.cli.report import REPORT_FILE, write_report
from forcemap.cli.results import (
    accuracy_lines,
    accuracy_result,
    comparison_lines,
    comparison_result,
    fit_lines,
    fit_result,
    limit_words,
    next_lines,
    speed_map_lines,
    speed_map_result,
    speed_map_table,
)
from forcemap.files import write_atomically

_AREA = "back_of_hand"


def demo(
    folder: Annotated[
        str | None, typer.Argument(help="New folder for the example campaign; default: forcemap-demo.")
    ] = None,
    example: Annotated[str, typer.Option("--example", help=", ".join(EXAMPLE_CAMPAIGNS) + ".")] = "ur10e",
    as_json: Json = False,
) -> None:
    """Run the whole chain on a simulated campaign, from raw recordings on, and write its results into a new folder.

    Example: forcemap demo my-first-campaign
    """
    from forcemap.lab.example_campaigns import simulate_example

    target = simulate_example(example, folder or _free_name()).folder
    dataset = build_dataset(read_campaign(target))
    campaign = read_campaign(target)
    conditions, region = dataset.conditions, body_region(_AREA)
    masses = {
        "robot_mass": pfl_robot_mass(conditions.moving_mass, conditions.payload),
        "body_mass": math.inf,
        "stiffness": region.stiffness,
    }
    bound = ToleranceBound(device_error=conditions.device.error_or_default)
    assessment = assess(dataset, limit=force_limit(_AREA), bound=bound, **masses)
    collected = campaign_summary(campaign, dataset)
    summary = _summary(assessment, collected, repeatability(dataset), masses)
    files = _write(assessment, target, summary)
    (report,) = write_report(assess_campaign(target, limits=[assessment.limit]), target / REPORT_FILE, None, pdf=False)
    files.insert(-1, REPORT_FILE)
    result = {
        "folder": str(target),
        "files": files,
        "report": report,
        "fit": fit_result(assessment.force_map, assessment.accuracy[0]),
        "speed_maps": {contact.value: _speed_map(assessment, contact) for contact in assessment.speed_maps},
        "comparison": comparison_result(assessment.comparison),
    }
    program = "forcemap" if shutil.which("forcemap") else sys.argv[0]
    closing = [
        "",
        f"Written to {target}: {', '.join(files)}",
        "(the map, accuracy, comparison and safe speeds as JSON and CSV; this text as summary.txt)",
        f"The validation report, to open in a browser: {report}",
        f"Next: {program} speed {target} --distance 0.8 --height 0.4 --area {_AREA} --contact transient",
    ]
    emit(result, [*summary, *closing], as_json=as_json)


def _free_name() -> str:
    names = itertools.chain(["forcemap-demo"], (f"forcemap-demo-{number}" for number in range(2, 1000)))
    for name in names:
        if not Path(name).exists():
            return name
    raise InputError("found a thousand demo folders here, expected room for one; name a folder")


def _write(assessment: Assessment, folder: Path, summary: list[str]) -> list[str]:
    """Write the results beside the campaign, and return the names of all files."""
    force_map, dataset = assessment.force_map, assessment.dataset
    (folder / "maps").mkdir()
    write_map(force_map, folder / "maps" / "cfm_3d.json")
    for contact, speeds in assessment.speed_maps.items():
        basis = (force_map, assessment.limit, contact, assessment.bound)
        write_atomically(folder / f"speeds-{contact}.csv", speed_map_table(speeds, *basis))
        write_atomically(folder / f"speeds-{contact}.json", json_text(_speed_map(assessment, contact)) + "\n")
    accuracies = {
        "simulated": dataset.simulated,
        "accuracies": [accuracy_result(a) for a in assessment.accuracy],
    }
    write_atomically(folder / "accuracy.json", json_text(accuracies) + "\n")
    write_atomically(folder / "comparison.json", json_text(comparison_result(assessment.comparison)) + "\n")
    write_atomically(folder / "summary.txt", "\n".join(summary) + "\n")
    files = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    raw = [file for file in files if file.startswith("recordings/")]
    return [*(file for file in files if file not in raw), f"recordings/ ({len(raw)} files)"]


def _speed_map(assessment: Assessment, contact: Contact) -> dict[str, Any]:
    speeds, accuracy = assessment.speed_maps[contact], assessment.accuracy[0]
    return speed_map_result(speeds, assessment.force_map, accuracy, assessment.limit, contact, assessment.bound)


def _summary(
    assessment: Assessment, collected: CampaignSummary, scatter: Repeatability, masses: dict[str, float]
) -> list[str]:
    """The whole result for a person who sees it for the first time."""
    dataset, comparison = assessment.dataset, assessment.comparison
    lines = [
        f"forcemap demo: {dataset.conditions.robot}",
        "SIMULATED impacts: not a measurement of any robot",
        "",
        f"1. The recordings: {collected.recordings}, of which {collected.used} gave an impact, in "
        f"{len(dataset.states)} states; {int(dataset.censored.sum())} reached the device range of "
        f"{dataset.conditions.device.range:g} N",
        *contact_lines(collected),
        *scatter_lines(scatter),
        "",
        "2. The map",
        *fit_lines(assessment.force_map),
        "",
        "3. How far predictions are from measurements",
        *accuracy_lines([(accuracy.on, accuracy) for accuracy in assessment.accuracy]),
        "",
        "4. Safe speeds",
        f"bound: {assessment.bound}",
    ]
    for contact, speeds in assessment.speed_maps.items():
        lines += [
            "",
            f"{limit_words(assessment.limit, contact)}",
            *speed_map_lines(speeds),
            f"the standard's contact model: {_standard(assessment, contact, masses)}",
        ]
        lines += next_lines(speeds)
    return [
        *lines,
        "",
        "5. Beside the 2D map and the standard",
        *comparison_lines(comparison),
        "",
        *_in_short(assessment, masses),
    ]


def _in_short(assessment: Assessment, masses: dict[str, float]) -> list[str]:
    """What to take away."""
    lines = ["In short"]
    for contact, speeds in assessment.speed_maps.items():
        newtons = assessment.limit.force(contact)
        confirmed = speeds.counts["admissible"] + speeds.counts["capped"]
        if confirmed and speeds.fastest:
            slowest = floor_speed(float(np.nanmin(speeds.speeds.speed)))
            found = f"{confirmed} of {speeds.speeds.speed.size} places confirmed, at {slowest} to "
            found += f"{floor_speed(speeds.fastest[2])} m/s"
        else:
            found = "no place confirmed by what was measured"
        lines += [
            f"  {newtons:g} N, {contact}: {found}",
            f"    the standard's contact model: {_standard(assessment, contact, masses)}",
        ]
    return lines


def _standard(assessment: Assessment, contact: Contact, masses: dict[str, float]) -> str:
    """What the standard's contact model says, and what speaks against it."""
    speed = floor_speed(pfl_speed_limit(assessment.limit.force(contact), **masses))
    found = f"{speed} m/s everywhere, not confirmed by any measurement"
    error = assessment.dataset.conditions.device.error_or_default
    why = assessment.dataset.phase_two.transient_refusal(assessment.limit.quasi_static, error)
    return f"{found}; no transient limit may be used: {why}" if why and contact is Contact.TRANSIENT else found
