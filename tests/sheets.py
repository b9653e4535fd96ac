"""Texts for people and controllers, whole: run sheets, heads, exported files, and what a speed is said to rest on.

tests/sheets.txt holds them. Whoever changes one on purpose writes the file anew (`python tests/sheets.py`) and looks at
what changed.
"""

from __future__ import annotations

import functools
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from oracle import simulate, training_grid

import forcemap as fm
from chain import number
from forcemap.campaigns.binding import NOT_BESIDE, Binding, BindingState
from forcemap.campaigns.plan import MeasurementPlan
from forcemap.exports.krl import krl_data, krl_source
from forcemap.exports.robot_table import RobotTable
from forcemap.exports.run_sheet import run_sheet
from forcemap.exports.safety_proposal import safety_proposal, widest_block
from forcemap.exports.scaling import scaling_csv, scaling_result
from forcemap.exports.speed_table import speed_map_csv
from forcemap.exports.urscript import urscript
from forcemap.exports.zones import zones_csv, zones_result
from forcemap.findings import Finding, FindingKind
from forcemap.words import assumptions, sentence, sentences, warnings
from speed_refusals import fitted, ur10e

TEXTS = Path(__file__).with_suffix(".txt")
SEED, DATE = 202696, "2026-11-21"
QUASI_STATIC, TRANSIENT = fm.Contact.QUASI_STATIC, fm.Contact.TRANSIENT
MARGIN = fm.FixedMargin(0.10)
HAND = fm.force_limit("back_of_hand"), TRANSIENT
OWN = fm.NewtonLimit(260.0, 130.0, 75e3), TRANSIENT
PLAN = {
    "state_id": ["a", "a", "b", "longer_name", "c"], "repeat": [1, 2, 1, 1, 12], "role": ["train"] * 4 + ["test"],
    "distance": [0.5, 0.5, 0.61234, 0.7, 0.7], "height": [0.2, 0.2, 0.3, 0.25, 0.25],
    "speed": [0.1, 0.1, 0.1, 0.25, 0.1], "base_angle": [np.nan, np.nan, 30.0, 45.5, np.nan],
    "expected_force": [np.nan, 84.4, 84.6, 101.0, np.nan],
}  # fmt: skip


def plan(rows=range(5), **more):
    """Runs of a plan, made as `read_plan` makes it."""
    return MeasurementPlan(**{name: np.array(values) for name, values in PLAN.items()}, **more).select(
        np.array(rows, dtype=int)
    )


def run_sheets():
    stated = fm.Conditions(
        robot="UR10e", controller="CB5", firmware="5.11", base_angle=12.5, operator="N. N.", standard_edition="2016",
        direction="down", contact_site="flange",
        device=fm.Device(range=500.0, error=2.5, stiffness=75e3, calibrated="2026-01-05"),
    )  # fmt: skip
    left_out = tuple(Finding.of(FindingKind.ONLY_AS_MEASURED) for _ in range(2))
    more = {"left_out": left_out, "warnings": left_out[:1], "expected_from": left_out[0]}
    without_angles = replace(plan(**more), base_angle=np.full(5, np.nan))
    by_place = replace(plan(range(4)), speed=np.array([0.3, 0.2, 0.2, 0.1]))
    wide = replace(plan([1, 2]), state_id=np.array(["x" * 36, "y"]))
    yield "nothing stated", run_sheet(plan(), fm.Conditions())
    yield "everything stated", run_sheet(plan(**more), stated)
    yield "at most", run_sheet(plan(), stated, upper_force=[99.9, 120.0, 130.99, 140.2, 150.0])
    yield "at most, no angles", run_sheet(without_angles, stated, upper_force=[99.9, 120.0, 130.99, 140.2, 150.0])
    yield "no angles", run_sheet(without_angles, stated)
    yield "by place", run_sheet(by_place, stated)
    yield "by place, short names", run_sheet(by_place.select(np.arange(3)), stated)
    yield "waiting", run_sheet(plan([0, 1]), stated, waiting=plan([2, 3, 4]), upper_force=[10.0, 20.0])
    yield "nothing waits", run_sheet(plan([0, 1]), stated, waiting=plan([]))
    yield "a long name waits", run_sheet(plan([0, 2]), stated, waiting=wide)
    yield "long names", run_sheet(wide, stated, upper_force=[1.0, 2.0])


def table():
    return fm.robot_table(ur10e(), limits=[HAND, OWN], bound=MARGIN, size=0.09, date=DATE)


@functools.cache
def of_a_file():
    """A table of a fitted map, simulated, with the files that it was read from."""
    dataset = simulate("ur10e", np.random.default_rng(SEED), effect=0.02, train=np.ones(125, bool)).dataset
    stated = {"direction": "down", "simulated": True, "speed_kind": "measured", "speed_error": 0.02}
    force_map = fm.fit_force_map(replace(dataset, conditions=replace(dataset.conditions, **stated)))
    found = fm.robot_table(force_map, limits=[HAND], bound=fm.ToleranceBound(), size=0.2, date=DATE)
    files = {"map_file": "cell\n7.json", "map_file_sha256": 64 * "a", "impacts_table": "impacts.csv"}
    files["impacts_table_sha256"] = 64 * "b"
    return replace(found, provenance=replace(found.provenance, **files))


def task(*segments):
    """A task of segments: a name, and the speed that is programmed; the one called carry is without contact."""
    return fm.Task(tuple(fm.TaskSegment(n, *(((), None) if n == "carry" else (("back_of_hand",), TRANSIENT)), v)
                         for n, v in segments), acceleration=1.5)  # fmt: skip


def along(points, names, of_task, bound=MARGIN, **more):
    return fm.path_speeds(ur10e(), fm.ToolPath(np.array(points), names), of_task, bound=bound, step=0.05, **more)


def tables():
    drawn, small = table(), of_a_file()
    for name, write in (("zones", zones_csv), ("urscript", urscript), ("krl data", krl_data), ("krl", krl_source)):
        yield f"{name} of a map", write(drawn)
    fast = replace(drawn, speed_mmps=9 * drawn.speed_mmps)
    for name, write in (("zones", zones_csv), ("urscript", urscript), ("krl", krl_data), ("proposal", safety_proposal)):
        yield (
            f"{name} of a fast robot",
            [line for line in write(fast).splitlines() if not line.startswith(("#", ";", "-"))],
        )
    yield "a fast robot", table_words(fast)
    yield "zones of a file", zones_csv(small)
    yield "zones as JSON", as_json(zones_result(small))
    yield "table", table_words(drawn)
    yield "table of a file", table_words(small)


def speed_maps():
    grid = fm.speed_map(ur10e(), [0.6, 0.8, 0.9], [0.3, 0.4], limit=HAND[0], contact=HAND[1], bound=MARGIN)
    yield "speed map", speed_map_csv(grid, basis={"map": "ur10e", "told": "=1+1"})


def ways():
    """A path from a fast way without contact into one with it, as it is programmed and as it is allowed."""
    points = [[0.8, -0.1, 0.44], [0.8, 0.0, 0.44], [0.8, 0.0, 0.34], [0.8, 0.0, 0.28]]
    return along(points, ("carry", "press", "hold"), task(("carry", 0.9), ("press", 0.2), ("hold", 0.3)))


def proposals():
    drawn = table()
    slow, fast = task(("carry", 0.02), ("press", 0.05)), task(("carry", 0.9), ("press", 0.05), ("hold", np.nan))
    yield "whatever is done", safety_proposal(drawn)
    yield "for a slow task", safety_proposal(drawn, task=slow)
    yield "for a fast task", safety_proposal(drawn, task=fast)
    yield "for a path", safety_proposal(drawn, task=slow, speeds=ways())
    faster = replace(ways(), programmed=np.linspace(0.02, 0.9, len(ways().path)))
    yield "for a path that gets faster", safety_proposal(drawn, speeds=faster)
    near, _, _, high, speed = widest_block(drawn)
    exactly = along([[0.8, 0.0, 0.44], [0.8, 0.0, 0.4]], ("press",), task(("press", speed / 1000)))
    yield "for a path as fast", safety_proposal(drawn, speeds=exactly)
    d, h = drawn.distance_edges[near], drawn.height_edges[high]
    border = along([[d, 0.0, h], [d, 0.0, h - 0.02]], ("press",), task(("press", 0.05)))
    yield "for a path on the edge", safety_proposal(drawn, speeds=border)
    yield "of nothing", safety_proposal(replace(drawn, speed_mmps=0 * drawn.speed_mmps))


def scalings():
    found, head = ways(), table().provenance
    yield "a path", scaling_csv(found, head.of_path(found))
    yield "as JSON", as_json(scaling_result(found, head.of_path(found)))
    excluded = along(found.path.points[:2], ("carry",), task(("carry", 0.9)))
    yield "without contact", scaling_csv(excluded, head.of_path(excluded))
    beside = along([[0.8, 4e-5, 0.44], [0.8, -4e-5, 0.4]], ("press",), task(("press", 0.2)))
    yield "beside an axis", scaling_csv(beside, head.of_path(beside)).splitlines()[-1:]
    braked = replace(found, speed=np.where(np.isnan(found.speed), np.nan, np.minimum(found.speed, 0.2)))
    as_slow = replace(braked, programmed=np.full(len(found.path), 0.2))
    yield "as slow as allowed", scaling_csv(as_slow, head.of_path(found))


def table_words(found: RobotTable):
    """A table for programs as text, with what it looks up around its edges."""
    near, low = found.distance_edges[[0, 1, -1]], found.height_edges[[0, 1, -1]]
    beside = [(d + i, h + j) for d in near for h in low for i in (-1e-9, 0.0, 1e-9) for j in (-1e-9, 0.0, 1e-9)]
    asked = [found.speed(0.6 * d, -0.8 * d, h) for d, h in beside] + [found.speed(d, 0.0, h) for d, h in beside]
    lines = [found.distance_edges, found.height_edges, found.speed_mmps, found.lowest, found.spread, found.limit, asked]
    words = [" ".join(map(number, np.ravel(line).tolist())) for line in lines]
    reasons = sorted({sentence(reason) for reason in found.reason.ravel()})
    return [*words, str(found.permitted), str(found.refusal), *map(number, found.provenance.limits_N), *reasons]


def as_json(value):
    """JSON in lines, its figures to nine digits."""
    text = json.dumps(value, indent=1, allow_nan=False)
    return re.sub(r"-?\d+\.\d+(e-?\d+)?", lambda found: number(float(found[0])), text)


LIMITS = {
    "hand, transient": HAND,
    "hand, quasi-static": (HAND[0], QUASI_STATIC),
    "temple": (fm.force_limit("temple"), TRANSIENT),
    "own": (fm.NewtonLimit(150.0, 125.0, 75e3), TRANSIENT),
    "own, of a stiff part": (fm.NewtonLimit(150.0, None, 80e3), QUASI_STATIC),
    "newtons": (150.0, QUASI_STATIC),
}

# Maps that differ in what speeds rest on, each with a bound.
MAPS = {
    "published": lambda: (ur10e(), MARGIN),
    "clamping": lambda: (fm.published_map("kuka-iiwa7-30nm"), MARGIN),
    "calm": lambda: (fitted(), fm.ToleranceBound()),
    "held": lambda: (fitted(phase2=120.0), fm.ToleranceBound(0.5, 0.5)),
    "unknown": lambda: (fitted(scenario=None, error=np.nan), fm.FixedMargin(0.2)),
    "soft": lambda: (fitted(stiffness=70e3, device_range=np.nan), fm.FixedMargin(0.02)),
    "too soft": lambda: (fitted(stiffness=60e3), MARGIN),
    "no spring": lambda: (fitted(stiffness=np.nan), MARGIN),
    "unbound": lambda: (replace(fitted(), binding=NOT_BESIDE), fm.ToleranceBound()),
    "broken": lambda: (replace(fitted(), binding=Binding(BindingState.BROKEN)), fm.ToleranceBound()),
    "scattered": lambda: (scattered(), fm.ToleranceBound()),
    "discarded": lambda: (scattered(impacts=fm.CensoredImpacts.DISCARD), MARGIN),
    "as many states as terms": lambda: (as_many_states_as_terms(), MARGIN),
}


def bases(name):
    """What speeds of a map rest on, by limit: warnings, what is assumed, what is refused, factors."""
    force_map, bound = MAPS[name]()
    for of_limit, (limit, contact) in LIMITS.items():
        angle = 0.0 if contact is TRANSIENT else 2.0
        try:
            found = fm.safe_speed(force_map, 0.75, 0.35, limit=limit, contact=contact, bound=bound, angle=angle)
        except fm.ForcemapError as error:
            yield of_limit, str(error)
            continue
        basis = found.basis
        words = [f"outcome {found.outcome}: {sentence(found.reason)}", f"raised {number(basis.raised)}"]
        words += [f"program {found.to_program_outcome}: {sentence(found.to_program_reason)}"]
        words += [f"warning: {warning}" for warning in warnings([basis])]
        words += [f"note: {note}" for note in sentences(basis.notes)]
        words += [f"refused: {sentence(basis.refusal) or '-'}", f"export: {sentence(basis.export_refusal) or '-'}"]
        words += [f"unseen: {sentences(basis.unseen)}", f"limit: {sentence(basis.limit_finding)}"]
        if of_limit in ("hand, transient", "newtons"):
            words += [f"states: {line}" for line in sentences(basis.statements)]
        words += [f"permitted {basis.permitted}, simulated {basis.simulated}, {number(basis.speed_error)}"]
        yield of_limit, words


def of_pieces():
    """What speeds in a zone and along a path rest on."""
    zones = fm.zone_speeds(ur10e(), fm.Zones(0.7, 0.75, 0.3, 0.35), limit=300.0, contact=QUASI_STATIC, bound=MARGIN)
    yield "of a zone", assumptions([zones.basis])
    for name, speeds in {
        "of a path": along([[0.8, 0, 0.44], [0.8, 0, 0.4]], ("press",), task(("press", 0.2))),
        "of a slant path": along([[0.8, 0, 0.44], [0.8, 0.002, 0.4]], ("press",), task(("press", np.nan)), angle=4.0),
        "of a timed path": fm.path_speeds(
            ur10e(), fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.4], [0.8, 0, 0.3]], name="press", time=[0, 1, 2]),
            task(("press", 0.2)), bound=MARGIN,
        ),
        "of two": along([[0.8, 0, 0.44], [0.8, 0, 0.4], [0.7, 0, 0.4]], ("press", "carry"),
                        task(("press", np.nan), ("carry", 0.2))),
    }.items():  # fmt: skip
        yield name, [*sentences(speeds.notes), *assumptions(speeds.bases), *sorted(set(map(sentence, speeds.reason)))]


@functools.cache
def scattered(**how):
    """A map whose states scatter by a share around the one that is named, with impacts above the device range."""
    points = np.repeat(training_grid("ur10e"), 2, axis=0)
    force = np.round(ur10e().predict(*points.T), 1)
    force[::2] *= np.linspace(1.0, 1.2, 27)
    force[1::2] /= np.linspace(1.0, 1.2, 27)
    top = 430.0
    named = dict(zip(("distance", "height", "speed"), points.T, strict=True))
    conditions = fm.Conditions(device=fm.Device(range=top, stiffness=75e3), speed_error=0.05, base_angle=3.0)
    censored = force >= top
    dataset = fm.ImpactDataset.from_arrays(
        **named, peak_force=np.minimum(force, top), censored=censored, conditions=conditions
    )
    return fm.fit_force_map(dataset, **how)


@functools.cache
def as_many_states_as_terms():
    """A map that runs through what was measured and leaves nothing over."""
    points = np.random.default_rng(SEED).uniform([0.5, 0.1, 0.1], [0.9, 0.5, 0.4], (9, 3))
    named = dict(zip(("distance", "height", "speed"), points.T, strict=True))
    conditions = fm.Conditions(device=fm.Device(range=900.0, error=3.0, stiffness=75e3))
    dataset = fm.ImpactDataset.from_arrays(**named, peak_force=ur10e().predict(*points.T), conditions=conditions)
    return fm.fit_force_map(dataset)


SHEETS = {each.__name__: each for each in (run_sheets, tables, speed_maps, proposals, scalings, of_pieces)}
SHEETS |= {f"bases, {name}": functools.partial(bases, name) for name in MAPS}


def texts(sheet):
    """Each text of a sheet below its name."""
    parts = []
    for name, text in SHEETS[sheet]():
        lines = text if isinstance(text, str) else "\n".join(text)
        parts.append(f"=== {sheet}: {name}\n{lines.rstrip()}\n")
    return without_hashes("\n".join(parts))


def without_hashes(text):
    """Hashes of figures that were computed differ where these are rounded in another way."""
    return re.sub(r"\b(?![ab]{64})[0-9a-f]{64}\b", "hash", text)


if __name__ == "__main__":
    TEXTS.write_text("\n".join(map(texts, SHEETS)))
