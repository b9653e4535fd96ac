"""forcemap plan."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Argument, Context, Option

import forcemap as fm
from forcemap.answers.plan import PlanAnswer
from forcemap.campaigns.recordings_table import REGISTER_FILE
from forcemap.cli import planned
from forcemap.cli.options import (
    ContactKind,
    DeviceSpring,
    Json,
    Limit,
    Payload,
    force_map_from,
    limit_from,
    number,
    of_other_form,
    wanted_form,
)
from forcemap.cli.output import counted, emit, listing, verdict_first
from forcemap.cli.task_options import figures
from forcemap.files import file_sha256, read_bytes, write_atomically
from forcemap.findings import Finding, FindingKind
from forcemap.limits.device_spring import device_suitability
from forcemap.maps.carry_over import EARLIER_MAP
from forcemap.maps.forms import form_of
from forcemap.planning.measurements import DesignedPlan
from forcemap.planning.runs import extend_plan
from forcemap.planning.transfer_plan import plan_transfer
from forcemap.words import sentence, sentences

_LISTED = 5
"""Speeds that are named; of more the range is said. A choice."""


_Design = Annotated[
    str,
    Option(
        "--design",
        "--transfer",
        help="spread: corners, and places and speeds between them; paper: 3 x 3 places x 3 speeds; full-grid: "
        "5 x 5 x 5; symmetry: at several base angles; i-optimal, or i-optimal:LOG_SPEED for another form: the best "
        "--states of 9 x 9 x 9; a map file, as --transfer map.json: the few --states (9) that carry it over to a "
        "changed robot, or --transfer map.json:8% the fewest for a bound 8 % above the prediction.",
    ),
]
_States = Annotated[
    int | None,
    Option(
        "--states",
        help="States to train: spread has 27 if not given, i-optimal 18; any other design has fewer than 18 only "
        "if you name their number.",
    ),
]
_Places = Annotated[
    int | None,
    Option("--places", help="Of spread: number of places, 14 if not given; of i-optimal: the most."),
]
_Again = Annotated[
    int | None, Option("--again", help="States measured again at the end, to tell drift; 3 of spread if not given.")
]
_AROUND = f"the places must reach {1000 * fm.Allowance().position:g} mm beyond every place that can be hit"
_PlaceMinutes = Annotated[float, Option("--minutes-per-place", help="Assumed time to put up the device at a place.")]
_BaseAngles = Annotated[
    str, Option("--base-angles-deg", help="Angle of the base joint; for --design symmetry several.")
]
_Reach = Annotated[
    float,
    Option(
        "--reach-m",
        help="Largest distance of a place from the base's origin; spread moves farther ones inwards, the other "
        "designs leave them out.",
        show_default=False,
    ),
]


def plan(
    context: Context,
    folder: Annotated[str, Argument(help="New campaign folder, or one that has a campaign.toml and no plan.")],
    distances: planned.Distances = None,
    heights: planned.Heights = None,
    speeds: Annotated[str | None, Option("--speeds-mps", help="Slowest and fastest speed, or all of them.")] = None,
    design: _Design = fm.Design.SPREAD.value,
    states: _States = None,
    places: _Places = None,
    again: _Again = None,
    place_minutes: _PlaceMinutes = 10.0,
    impact_minutes: Annotated[float, Option("--minutes-per-impact", help="Assumed time for an impact.")] = 1.0,
    repeats: planned.Repeats = 3,
    base_angles: _BaseAngles = "",
    reach: _Reach = math.inf,
    device_range: planned.DeviceRange = None,
    device_spring: DeviceSpring = None,
    expect: planned.Expect = None,
    payload: Payload = None,
    limit: Limit = None,
    contact: ContactKind = None,
    as_json: Json = False,
) -> None:
    """Plan a campaign: write its folder with campaign.toml, plan.csv and a run sheet to print.

    Of a campaign that is planned, named alone, what campaign.toml states now is written into its run sheet.

    Example: forcemap plan my-campaign --distances-m 0.52,0.89 --heights-m 0.14,0.46 --speeds-mps 0.2,0.4
    --device-range-N 500 --moving-mass-kg 30 --area back_of_hand --contact transient
    """
    if Path(folder, "plan.csv").exists() and _alone(context):
        _state_again(folder, as_json=as_json)
        return
    carried = _carried(design)
    if carried is None and (distances is None or heights is None or speeds is None):
        raise fm.InputError("plan: expected --distances-m, --heights-m and --speeds-mps, the ranges to measure")
    if not carried:
        _require_unplanned(folder)
    mass, source = planned.expected_of(expect)
    named = {"distances": distances, "heights": heights, "speeds": speeds}
    ranges = [figures(name, text) if text else [] for name, text in named.items()]
    stated = ({} if carried else _of_plan(reach, ranges[2])) | ({} if payload is None else {"payload": payload})
    conditions, added = planned.completed_conditions(folder, device_range, device_spring, mass, **stated)
    newtons, doubts = _to_confirm(folder, limit, contact, conditions.device.stiffness) if limit else (math.nan, [])
    shared: dict[str, Any] = {"states": states, "repeats": repeats, "device": conditions.device, "limit": newtons}
    angles = figures("base angles", base_angles) if base_angles else []
    others: dict[str, Any] = {"places": places, "again": again, "base_angles": angles, "reach": reach}
    before = fm.read_plan(folder) if Path(folder, "plan.csv").exists() else None
    if carried:
        kept = _planned(folder, carried[0], before)
        campaign_plan = _few_states(*carried, kept, ranges, others | shared, conditions.reach)
    else:
        shared["design"], shared["form"] = _kind_and_form(design, conditions)
        shared["expected_force"] = force_map_from(source, None)[0] if source else fm.StandardExpectation.of(conditions)
        others["reach"] = conditions.reach if reach == math.inf and conditions.reach > 0 else reach
        campaign_plan = fm.plan_measurements(ranges[0], ranges[1], ranges[2], **others, **shared)
    campaign_plan = _with_needs(campaign_plan, conditions, [*doubts, *_of_other_payload(shared, conditions)])
    minutes = campaign_plan.minutes(place_minutes, impact_minutes)
    whole = extend_plan(before, campaign_plan) if before else campaign_plan
    completed = planned.complete(folder, conditions, added)
    files = planned.write_campaign(Path(folder), whole, campaign_plan, conditions)
    files += [*["campaign.toml"] * bool(completed), *([_kept(folder, carried[0])] if carried else [])]
    around = [] if carried else [_AROUND, *of_other_form(shared["form"], conditions, "These states are")]
    notes = [planned.time_words(campaign_plan, place_minutes, impact_minutes), *around]
    notes += [f"campaign.toml was there; added to it: {', '.join(completed)}"] * bool(completed)
    answer = PlanAnswer.of_plan(campaign_plan, folder, files, minutes)
    emit(answer, _lines(folder, campaign_plan, files, notes, carried[0] if carried else None), as_json=as_json)


def _of_other_payload(shared: dict[str, Any], conditions: fm.Conditions) -> list[Finding]:
    """That the payload to be measured is not the one of the map that forces are expected from."""
    source = shared.get("expected_force")
    if not isinstance(source, fm.ForceMap) or math.isnan(conditions.payload):
        return []
    of_map = 0.0 if math.isnan(source.conditions.payload) else source.conditions.payload
    figures = {"payload_kg": conditions.payload, "of_map_kg": of_map, "name": source.name}
    return [Finding.of(FindingKind.EXPECTED_OTHER_PAYLOAD, **figures)] if of_map != conditions.payload else []


def _of_plan(reach: float, speeds: list[float]) -> dict[str, float]:
    """What campaign.toml is to state of the plan, for `next` to keep to."""
    reached = {"reach": reach} if 0 < reach < math.inf else {}
    return reached | ({"fastest": max(speeds)} if max(speeds) > 0 else {})


def _require_unplanned(folder: str) -> None:
    """Raise InputError for a folder that has a plan; it says how one is planned anew."""
    if not Path(folder, "plan.csv").exists():
        return
    recordings = Path(folder, "recordings")
    if Path(folder, REGISTER_FILE).exists() or (recordings.is_dir() and any(recordings.iterdir())):
        way = "and recordings; name a new folder, or plan more of this one (forcemap next)"
    else:
        way = "already and no recordings; to plan it anew, delete its plan.csv and give this command again"
    raise fm.InputError(f"the folder has a plan {way}", file=folder)


def _alone(context: Context) -> bool:
    """True if nothing but the folder is named: no other plan is asked for."""
    sources = (context.get_parameter_source(name) for name in context.params.keys() - {"folder", "as_json"})
    return all(source is None or source.name == "DEFAULT" for source in sources)


def _state_again(folder: str, *, as_json: bool) -> None:
    """Write what campaign.toml states now into the sheet of a plan."""
    added = planned.state_again(folder)
    written = f"Written: {Path(folder, planned.SHEET)}, its runs as printed before, with what campaign.toml states now"
    written += f", and {counted(added, 'run')} that plan.csv has besides" if added else ""
    emit({"folder": folder, "files": [planned.SHEET]}, [written], as_json=as_json)


def _carried(design: str) -> tuple[str, float] | None:
    """The file of the map to carry over and the wanted width of the bound (a share, NaN if none); None if no map."""
    source, colon, percent = design.rpartition(":") if design.endswith("%") else (design, "", "")
    if not source.lower().endswith(".json"):
        return None
    width = number(percent.removesuffix("%")) if colon else math.nan
    if width is None:
        raise fm.InputError(f"transfer: found {design!r}, expected a map file, or map.json:8% for a width of 8 %")
    return source, width / 100


def _kept(folder: str, source: str) -> str:
    """Copy the map that is carried over into the campaign; the name of the copy."""
    Path(folder, EARLIER_MAP).parent.mkdir(exist_ok=True)
    write_atomically(Path(folder, EARLIER_MAP), read_bytes(source).decode())
    return EARLIER_MAP


def _planned(folder: str, source: str, plan: fm.MeasurementPlan | None) -> list[list[float]]:
    """The states of a plan to which more are added; refused unless the folder carries the same map over."""
    earlier = Path(folder, EARLIER_MAP)
    if (plan or earlier.exists()) and not (earlier.is_file() and file_sha256(earlier) == file_sha256(Path(source))):
        raise fm.InputError(
            f"the folder has a plan or an earlier map already, and not one for this map ({EARLIER_MAP}); name a new "
            "folder, or move them away",
            file=folder,
        )
    if plan is None:
        return []
    first = np.unique(plan.state_id, return_index=True)[1]
    return [
        [float(x) for x in state]
        for state in zip(plan.distance[first], plan.height[first], plan.speed[first], strict=True)
    ]


def _few_states(
    source: str,
    width: float,
    before: list[list[float]],
    ranges: list[list[float]],
    options: dict[str, Any],
    reach: float,
) -> DesignedPlan:
    """The states that carry a map over; refused are options of other designs, and states beyond a stated reach."""
    for name in ("places", "again", "base_angles", "reach"):
        if (value := options.pop(name)) not in (None, [], math.inf):
            raise fm.InputError(
                f"{name.replace('_', ' ')}: found {value}, expected none: the states that carry a map over lie within "
                "its own range, each at a place of its own"
            )
    plan = plan_transfer(force_map_from(source, None)[0], *ranges, width=width, planned=before, **options)
    away = np.hypot(plan.distance, plan.height)
    if (away > reach).any():
        first = int((away > reach).argmax())
        raise fm.InputError(
            f"plan.reach_m: campaign.toml states {reach:g} m, and {plan.state_id[first]} would lie {away[first]:.3f} m "
            "from the base; name nearer --distances-m and lower --heights-m, or correct the reach there"
        )
    return plan


def _kind_and_form(design: str, conditions: fm.Conditions) -> tuple[fm.Design, fm.Form]:
    """The design and the form it is for, from the option's text, else that of the campaign."""
    kind, _, form = design.partition(":")
    if kind not in list(fm.Design) or (form and kind != fm.Design.I_OPTIMAL):
        raise fm.InputError(
            f"design: found {design!r}, expected {', '.join(fm.Design)} or i-optimal:FORM; to carry a map over, its "
            "file, as --transfer map.json"
        )
    return fm.Design(kind), form_of(conditions, wanted_form(form))


def _to_confirm(
    folder: str, limit: list[str], contact: fm.Contact | None, stiffness: float
) -> tuple[float, list[Finding]]:
    """The limit [N], and why this device can confirm no speed for it, if it cannot."""
    force_limit, kind = limit_from(limit, contact, source=folder)
    if not isinstance(force_limit, fm.ForceLimit):
        return float(force_limit.force), []
    refusal = device_suitability(force_limit.name, force_limit.stiffness, stiffness).refusal
    doubts = [Finding.of(FindingKind.NO_SPEED_FOR_AREA, refusal, area=force_limit.name)] if refusal else []
    return force_limit.force(kind) if kind else math.nan, doubts


def _with_needs(plan: DesignedPlan, conditions: fm.Conditions, doubts: list[Finding]) -> DesignedPlan:
    """A plan that says first what is doubted, and last what is needed of the device and neither stated nor doubted."""
    said = any(part.kind is FindingKind.SPRING_OF_DEVICE_NOT_STATED for doubt in doubts for part in doubt.also)
    needs = [need for need in conditions.device_needs if not (said and need.kind is FindingKind.SPRING_NEEDED)]
    return dataclasses.replace(plan, warnings=(*doubts, *plan.warnings, *needs))


def _lines(folder: str, plan: DesignedPlan, files: list[str], notes: list[str], transfer: str | None) -> list[str]:
    values = sorted(set(plan.speed.tolist()))
    speeds = ", ".join(f"{v:g}" for v in values) if len(values) <= _LISTED else f"{values[0]:g} to {values[-1]:g}"
    source = sentence(plan.expected_from) or "nothing (give --moving-mass-kg or --map)"
    order = "all places at the lowest speed first, far to near, then the next speed"
    if transfer:
        order = "in the order of the force that the earlier map expects, smallest first"
    elif plan.by_place:
        order = "place by place, the corners first and the others in random order, slow to fast at each"
    again = f"; {counted(len(plan.again), 'state')} again at the end" if plan.again else ""
    verdict = f"{len(plan)} impacts in {len(plan.states)} states, at {speeds} m/s, written to {folder}"
    return [
        *verdict_first(verdict, sentences(plan.warnings)),
        *([sentence(plan.note)] if plan.note else []),
        order + again,
        *notes,
        f"expected forces from: {source}",
        *(listing("Left out", sentences(plan.left_out)) if plan.left_out else []),
        "",
        f"Files: {', '.join(files)}",
        "Next:",
        f"  1. fill in {folder}/campaign.toml: robot, tool, contact, device, and in [recordings] how it writes files",
        f"  2. forcemap plan {folder}, which writes that into {folder}/{planned.SHEET}",
        f"  3. print {folder}/{planned.SHEET} and measure; save each file in {folder}/recordings as it says",
        f"  4. forcemap collect {folder}",
        *([f"  5. forcemap transfer {transfer} {folder} -o new-map.json"] if transfer else []),
    ]
