"""forcemap plan."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

import forcemap as fm
from forcemap.answers.plan import PlanAnswer
from forcemap.cli import planned
from forcemap.cli.options import ContactKind, DeviceSpring, Json, Limit, force_map_from, limit_from
from forcemap.cli.output import emit, listing
from forcemap.cli.task_options import figures
from forcemap.findings import Finding, FindingKind
from forcemap.words import sentence, sentences


def plan(
    folder: Annotated[str, Argument(help="New campaign folder, or one that has a campaign.toml and no plan.")],
    distances: planned.Distances = None,
    heights: planned.Heights = None,
    speeds: Annotated[str | None, Option("--speeds-mps", help="Slowest and fastest speed, or all of them.")] = None,
    design: Annotated[
        str,
        Option(
            "--design",
            help="training: 3 x 3 places x 3 speeds; full-grid: 5 x 5 x 5; symmetry: at several base angles; "
            "i-optimal, or i-optimal:LOG_SPEED for another form: the best --states of the full grid.",
        ),
    ] = fm.Design.TRAINING.value,
    states: Annotated[
        int | None,
        Option(
            "--states",
            help="States to train: of i-optimal so many are chosen, 18 if not given; any other design has fewer than "
            "18 only if you name their number.",
        ),
    ] = None,
    repeats: planned.Repeats = 3,
    base_angles: Annotated[
        str, Option("--base-angles-deg", help="Angle of the base joint; for --design symmetry several.")
    ] = "",
    reach: Annotated[
        float, Option("--reach-m", help="Places farther from the base's origin are left out.", show_default=False)
    ] = math.inf,
    device_range: planned.DeviceRange = None,
    device_spring: DeviceSpring = None,
    expect: planned.Expect = None,
    limit: Limit = None,
    contact: ContactKind = None,
    as_json: Json = False,
) -> None:
    """Plan a campaign: write its folder with campaign.toml, plan.csv and a run sheet to print.

    Example: forcemap plan my-campaign --distances-m 0.52,0.89 --heights-m 0.14,0.46 --speeds-mps 0.1,0.4
    --device-range-N 500 --moving-mass-kg 30 --area back_of_hand --contact transient
    """
    if distances is None or heights is None or speeds is None:
        raise fm.InputError("plan: expected --distances-m, --heights-m and --speeds-mps, the ranges to measure")
    if Path(folder, "plan.csv").exists():
        raise fm.InputError("the folder has a plan already; name a new folder, or move the plan away", file=folder)
    kind, _, form = design.partition(":")
    if kind not in list(fm.Design) or (form and kind != fm.Design.I_OPTIMAL):
        raise fm.InputError(f"design: found {design!r}, expected {', '.join(fm.Design)} or i-optimal:FORM")
    mass, source = planned.expected_of(expect)
    conditions = planned.conditions_of(folder, device_range, device_spring, mass)
    newtons, doubts = _to_confirm(limit, contact, conditions.device.stiffness) if limit else (math.nan, [])
    made = fm.plan_measurements(
        figures("distances", distances),
        figures("heights", heights),
        figures("speeds", speeds),
        design=fm.Design(kind),
        repeats=repeats,
        base_angles=figures("base angles", base_angles) if base_angles else [],
        reach=reach,
        device=conditions.device,
        expected_force=force_map_from(source, None)[0] if source else fm.StandardExpectation.of(conditions),
        limit=newtons,
        states=states,
        form=fm.form_named(form) if form else fm.CFM_3D,
    )
    made = dataclasses.replace(made, warnings=(*doubts, *made.warnings, *_needed(conditions.device)))
    files = planned.write_campaign(Path(folder), made, made, conditions)
    emit(PlanAnswer.of_plan(made, folder, files), _lines(folder, made, files), as_json=as_json)


def _to_confirm(limit: list[str], contact: fm.Contact | None, stiffness: float) -> tuple[float, list[Finding]]:
    """The limit [N], and why this device will confirm no speed for it, if so."""
    stated, kind = limit_from(limit, contact)
    if not isinstance(stated, fm.ForceLimit):
        return float(stated.force), []
    refusal = fm.device_suitability(stated.name, stated.stiffness, stiffness).refusal
    doubts = [Finding.of(FindingKind.NO_SPEED_FOR_AREA, refusal, area=stated.name)] if refusal else []
    return stated.force(kind) if kind else math.nan, doubts


def _needed(device: fm.Device) -> list[Finding]:
    """What collecting, and a speed for a body area, will need of the device."""
    found = [Finding.of(FindingKind.COLLECT_NEEDS, entry="device.range_N")] if math.isnan(device.range) else []
    spring = Finding.of(FindingKind.SPRING_NEEDED, entry="device.stiffness_N_per_m")
    return [*found, spring] if math.isnan(device.stiffness) else found


def _lines(folder: str, made: fm.DesignedPlan, files: list[str]) -> list[str]:
    speeds = ", ".join(f"{v:g}" for v in sorted(set(made.speed.tolist())))
    source = sentence(made.expected_from) or "nothing (give --moving-mass-kg or --map)"
    return [
        f"{len(made)} impacts in {len(made.states)} states, at {speeds} m/s, written to {folder}",
        "all places at the lowest speed first, far to near, then the next speed",
        *([sentence(made.note)] if made.note else []),
        f"expected forces from: {source}",
        *(f"WARNING: {warning}" for warning in sentences(made.warnings)),
        *(listing("Left out", sentences(made.left_out)) if made.left_out else []),
        "",
        f"Files: {', '.join(files)}",
        "Next:",
        f"  1. fill in {folder}/campaign.toml: robot, tool, contact, device, and in [recordings] how it writes files",
        f"  2. print {folder}/{planned.SHEET} and measure; save each file in {folder}/recordings as it says",
        f"  3. forcemap collect {folder}",
    ]
