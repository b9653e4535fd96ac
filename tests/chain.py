"""From campaigns drawn to maps, bounds, speeds, zones, paths, verdicts and exports: every figure that comes out.

tests/chain.csv holds them. Whether they are right is asked elsewhere; that none of them moves unnoticed, here. Whoever
changes one on purpose writes the table anew (`python tests/chain.py`) and looks at what changed.
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import re
from pathlib import Path

import numpy as np
from oracle import simulate

import forcemap as fm
import recorded
from forcemap.exports.krl import krl_data, krl_source
from forcemap.exports.safety_proposal import safety_proposal
from forcemap.exports.scaling import scaling_csv
from forcemap.exports.urscript import urscript
from forcemap.exports.zones import zones_csv
from forcemap.findings import Finding
from forcemap.paths.task import one_segment_task
from forcemap.speeds.zones import Segments
from readings import cut_off, drift, few_samples, force_before, held, plain, recordings

TABLE = Path(__file__).with_suffix(".csv")
SEED, MOST = 202691, 12
HAND = (fm.force_limit("back_of_hand"), fm.Contact.TRANSIENT)
# What a result rests on is not its own.
LEFT = {"ForceMap", "Recording", "ImpactDataset", "Conditions", "States", "StateData", "Basis", "Impact", "Provenance"}


def figures(value, name="", depth=0):
    """Names and values of all that a result says: fields and properties, arrays thinned, findings by their figures."""
    if isinstance(value, Finding):
        yield name, [value.kind.value, *(number(each) for _, each in value.figures if is_number(each))]
    elif isinstance(value, enum.Enum) or is_number(value):
        yield name, [number(value)]
    elif isinstance(value, str) or value is None or type(value).__name__ in LEFT or depth > 3:
        return
    elif isinstance(value, dict):
        for key, each in value.items():
            yield from figures(each, f"{name}.{key}", depth + 1)
    elif isinstance(value, list | tuple | np.ndarray):
        flat = value.ravel().tolist() if isinstance(value, np.ndarray) else value
        if all(isinstance(each, enum.Enum) or is_number(each) for each in flat):
            yield name, [number(flat[i]) for i in thinned(len(flat))]
        else:
            for i in thinned(len(flat)):
                yield from figures(flat[i], f"{name} {i}", depth + 1)
    elif dataclasses.is_dataclass(value):
        for key in (*(each.name for each in dataclasses.fields(value)), *properties(type(value))):
            if not key.startswith("_"):
                yield from figures(getattr(value, key), f"{name}.{key}", depth + 1)


def thinned(count):
    return np.unique(np.linspace(0, count - 1, min(MOST, count)).astype(int)).tolist() if count else []


def is_number(value):
    return isinstance(value, bool | int | float | np.number | np.bool_)


def number(value):
    return str(value.value) if isinstance(value, enum.Enum) else f"{float(value):.9g}"


def properties(of):
    """Names of a class's properties, those that all regressions share left out."""
    return list(
        dict.fromkeys(
            key
            for base in (of, *of.__bases__)
            for key, each in vars(base).items()
            if (base is of or base.__name__ != "Regression") and isinstance(each, property | functools.cached_property)
        )
    )


def of_text(text):
    """The figures of a text; how it is worded is not held."""
    return [float(each) for each in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w-])", text)]


@functools.cache
def campaigns():
    """Campaigns of several plans: short, full, with places, with lower bounds."""
    rng = np.random.default_rng(SEED)
    scattered = rng.uniform([0.45, 0.05, 0.08], [0.95, 0.55, 0.5], (48, 3))
    scattered[:, :2] = scattered[:24, :2].repeat(2, axis=0)
    all_train, third = np.ones(48, bool), np.arange(125) % 3 == 0
    return {
        "short": simulate("ur10e", rng, effect=0.03, train=third).dataset,
        "censored": simulate("kuka-iiwa7-30nm", rng, effect=0.03, train=third, device_range=420.0).dataset,
        "places": simulate("ur10e", rng, effect=0.04, points=scattered, train=all_train, device_range=300.0).dataset,
        "full": simulate("kuka-iiwa7-10nm", rng, effect=0.01, train=np.ones(125, bool), repeats=2).dataset,
    }


@functools.cache
def maps():
    fits = [("short", fm.CFM_3D), ("short", fm.CFM_2D), ("censored", fm.CFM_3D), ("places", fm.LOG_SPEED)]
    fits += [("full", fm.FULL_CUBIC), ("full", fm.LOG_SPEED)]
    found = {f"{name} {form.name}": fm.fit_force_map(campaigns()[name], form=form) for name, form in fits}
    discarded = fm.fit_force_map(campaigns()["censored"], impacts=fm.CensoredImpacts.DISCARD)
    return found | {"censored, discarded": discarded, "published": fm.published_map("ur10e")}


def bounds_of(force_map):
    margins = [fm.FixedMargin(0.10), fm.FixedMargin()]
    fitted = force_map is not maps()["published"]
    return [*margins, fm.ToleranceBound(), fm.ToleranceBound(0.9, 0.99)] if fitted else margins


def places(rng, count):
    return rng.uniform([0.42, 0.0], [1.0, 0.6], (count, 2)).T


def fitted():
    rng = np.random.default_rng([SEED, 1])
    for name, force_map in maps().items():
        yield name, force_map.fit
        yield name, force_map.coefficients
        d, h = places(rng, 12)
        v = rng.uniform(0.05, 0.55, 12)
        yield f"{name} inside", force_map.measured_range.contains(d, h, v)
        yield f"{name} speeds", list(force_map.measured_range.speeds(d, h))
        for bound in bounds_of(force_map):
            yield f"{name} {bound}", bound.upper(force_map, d, h, v)
        yield f"{name} saved", fm.map_sha256(force_map) != ""
        if name in ("short CFM_2D", "places LOG_SPEED"):
            yield f"{name} without a state", fm.leave_one_state_out(force_map)


def accuracy():
    for name in ("censored", "places"):
        dataset = campaigns()[name]
        force_map = maps()[next(each for each in maps() if each.startswith(name))]
        yield name, list(fm.map_accuracy(force_map, dataset))


def speeds():
    rng = np.random.default_rng([SEED, 2])
    for name, force_map in maps().items():
        d, h = places(rng, 12)
        for bound in bounds_of(force_map)[::2]:
            for limit in (90.0, 200.0):
                found = fm.safe_speed(force_map, d, h, limit=limit, contact=fm.Contact.QUASI_STATIC, bound=bound)
                yield f"{name} {bound} {limit}", found
    given = {"limit": HAND[0], "contact": HAND[1], "bound": fm.FixedMargin(0.10)}
    steps = np.arange(0.45, 1.0, 0.07), np.arange(0.05, 0.6, 0.09)
    yield "map", fm.speed_map(maps()["published"], *steps, **given)


def zones():
    rng = np.random.default_rng([SEED, 3])
    start = np.column_stack([rng.uniform(0.4, 0.8, 8), rng.uniform(-0.3, 0.3, 8), rng.uniform(0.1, 0.5, 8)])
    segments = Segments(start, start + rng.normal(0, 0.08, start.shape))
    given = {"limit": 150.0, "contact": fm.Contact.QUASI_STATIC}
    for name in ("published", "short CFM_2D", "places LOG_SPEED"):
        force_map = maps()[name]
        grid = fm.zone_grid(force_map.measured_range, 0.12)
        for bound in bounds_of(force_map)[1:3]:
            yield f"{name} {bound} zones", fm.zone_speeds(force_map, grid, bound=bound, **given)
            yield f"{name} {bound} segments", fm.zone_speeds(force_map, segments, bound=bound, **given)


def driven():
    """A path with a press down, a way aside and one up again, timed and not, in tasks of one and more segments."""
    points = [[0.8, 0, 0.44], [0.8, 0, 0.33], [0.72, 0.2, 0.33], [0.7, 0.2, 0.42], [0.7, 0.2, 0.3], [0.6, 0.1, 0.28]]
    task = one_segment_task("path", ("back_of_hand", "chest"), fm.Contact.TRANSIENT, speed=0.35)
    slow = dataclasses.replace(task, acceleration=0.4)
    timed = fm.ToolPath.through(points, time=[0.0, 0.5, 1.6, 1.9, 2.7, 3.1])
    bound, published = fm.FixedMargin(0.10), maps()["published"]
    for name, each, path, off in (("", task, fm.ToolPath.through(points), 0.005), ("timed", slow, timed, 0.012)):
        allowance = fm.Allowance(0.02, off)
        yield name, fm.path_speeds(published, path, each, bound=bound, allowance=allowance, step=0.03)
    yield "moved", fm.place_task(maps()["published"], fm.ToolPath.through(points[:2]), task, bound=fm.FixedMargin(0.10))


def exported():
    bound, published = fm.FixedMargin(0.10), maps()["published"]
    table = fm.robot_table(published, limits=[HAND, (fm.force_limit("chest"), HAND[1])], bound=bound, date="2026-11-21")
    yield "table", table
    texts = (zones_csv, urscript, krl_data, krl_source, safety_proposal)
    yield "texts", [of_text(text(table)) for text in texts]
    task = one_segment_task("path", ("back_of_hand",), HAND[1], speed=0.35)
    path = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.3], [0.6, 0, 0.3]])
    found = fm.path_speeds(published, path, task, bound=bound)
    of_path = table.provenance.of_path(found)
    yield "scaling", of_text(scaling_csv(found, of_path))
    yield "proposal", of_text(safety_proposal(table, task=task, speeds=found))


def judged():
    for kind in (plain, cut_off, few_samples, drift, force_before, held):
        for name, recording in recordings(kind):
            for impact in fm.find_impacts(recording)[:1]:
                stated = fm.NewtonLimit(1.05 * impact.peak_force, 0.2 * impact.peak_force, 75e3)
                for limit in (stated, fm.force_limit("back_of_hand")):
                    verdict = fm.check_impact(impact, limit)
                    for each in verdict.judgements:
                        yield f"{name} {each.interpretation.value}", [each.outcome, each.margin, each.instant]
                        yield f"{name} why", each.reason
                    yield f"{name} warnings", list(verdict.warnings)


def limits():
    for name in fm.standard_limit_table().areas:
        if (limit := fm.force_limit(name)).permitted:
            yield name, limit
    rng = np.random.default_rng([SEED, 4])
    for i in range(8):
        force, robot, body, stiffness = rng.uniform([50, 3, 0.5, 1e4], [300, 30, 40, 1.5e5])
        given = {"robot_mass": robot, "body_mass": body, "stiffness": stiffness}
        yield f"model {i}", [fm.pfl_speed_limit(force, **given), fm.pfl_contact_force(0.3, **given)]


PARTS = (fitted, accuracy, speeds, zones, driven, exported, judged, limits)


def rows(part):
    """Name and value of each figure that a part says."""
    return [
        [f"{part.__name__} {name}{key}", " ".join(each)] for name, result in part() for key, each in figures(result)
    ]


if __name__ == "__main__":
    recorded.write(TABLE, [row for part in PARTS for row in rows(part)])
