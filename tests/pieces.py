"""Zones, segments, paths, tasks and what a bound is enclosed in, in figures: everything that speeds are made of.

tests/pieces.csv holds them, as tests/chain.csv holds what comes out at the end. Whoever changes one on purpose writes
the table anew (`python tests/pieces.py`) and looks at what changed.
"""

from __future__ import annotations

import functools
import itertools
import math
import tempfile
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
from oracle import simulate, training_grid

import forcemap as fm
import recorded
from chain import number
from forcemap.dynamics.robots import robot_named
from forcemap.dynamics.urdf import read_urdf
from forcemap.maps.measured_range import MeasuredRange
from forcemap.paths.path_file import read_path
from forcemap.paths.time_law import braking_speeds, time_law
from forcemap.speeds.crossings import highest_within, lowest_exceeded
from forcemap.speeds.enclosures import Patches, enclose, frontier
from forcemap.speeds.range_enclosure import footprint, highest_measured_speed, lowest_measured_speeds
from forcemap.speeds.safe_speed import REPEAT_DISTANCE
from forcemap.speeds.speed_map import SpeedMap
from forcemap.speeds.tolerance_steps import ToleranceSteps
from forcemap.speeds.zones import Segments
from speed_refusals import SLIDES

TABLE = Path(__file__).with_suffix(".csv")
SEED, MOST, MOST_WORDS = 202695, 14, 50
QUASI_STATIC, TRANSIENT = fm.Contact.QUASI_STATIC, fm.Contact.TRANSIENT
MARGIN = fm.FixedMargin(0.10)


def cells(value):
    """A value in figures: arrays thinned, with their shape and sums; findings by what they say of figures."""
    if isinstance(value, fm.Finding):
        said = [number(x) for _, x in value.figures if isinstance(x, bool | int | float)]
        return [value.kind.value, *said, *(cell for also in value.also for cell in ("and", *cells(also)))]
    if isinstance(value, str):
        return [str(value).replace(" ", "_") or "-"]
    if value is None:
        return ["None"]
    if isinstance(value, list | tuple) or getattr(value, "dtype", np.dtype(float)).kind == "O":
        each = value.ravel().tolist() if isinstance(value, np.ndarray) else value
        if not all(isinstance(one, bool | int | float) for one in each):
            return [cell for one in each[:MOST_WORDS] for cell in cells(one)]
    array = np.asarray(value)
    flat = array.ravel().astype(float)
    if flat.size <= MOST:
        return [number(x) for x in flat]
    finite = flat[np.isfinite(flat)]
    sums = finite.sum(), np.square(finite).sum(), (finite * np.sin(np.arange(finite.size))).sum(), finite.size
    return [*map(str, array.shape), *(number(flat[i]) for i in np.linspace(0, flat.size - 1, MOST).astype(int)),
            *map(number, sums)]  # fmt: skip


def fields_of(value):
    """Fields and values of a result, with those of results in it, but not what they rest on."""
    for field in fields(value):
        found = getattr(value, field.name)
        if isinstance(found, fm.ToolPath | fm.SafeSpeed) or type(found).__name__ in ("CycleTime", "PathSpeeds"):
            yield from ((f"{field.name}.{name}", each) for name, each in fields_of(found))
        elif isinstance(found, tuple) and found and isinstance(found[0], fm.Finding):
            yield from ((f"{field.name} {i}", each) for i, each in enumerate(found))
        elif (isinstance(found, tuple) and found and is_dataclass(found[0])) or isinstance(found, Mapping):
            yield field.name, len(found)
        elif not is_dataclass(found) or isinstance(found, fm.Finding):
            yield field.name, found


@functools.cache
def ur10e():
    return fm.published_map("ur10e")


@functools.cache
def maps():
    """Maps of several forms, one over a skew range, one with impacts above the device range."""
    rng = np.random.default_rng(SEED)
    skew = rng.uniform([0.45, 0.05, 0.08], [0.95, 0.55, 0.5], (40, 3))
    third, every = np.arange(125) % 3 == 0, np.ones(40, bool)
    given = {
        "skew": (simulate("ur10e", rng, effect=0.03, points=skew, train=every, device_range=900.0), fm.CFM_3D),
        "log": (simulate("ur10e", rng, effect=0.03, points=skew, train=every, device_range=900.0), fm.LOG_SPEED),
        "censored": (simulate("kuka-iiwa7-30nm", rng, effect=0.03, train=third, device_range=420.0), fm.CFM_2D),
        "cubic": (simulate("ur10e", rng, effect=0.02, train=np.ones(125, bool)), fm.FULL_CUBIC),
    }
    return {name: fm.fit_force_map(campaign.dataset, form=form) for name, (campaign, form) in given.items()}


@functools.cache
def segments():
    """Skew ones, tangents, one through the axis, one upright, one that only shares its foot with a tangent."""
    rng = np.random.default_rng([SEED, 1])
    start = np.column_stack([rng.uniform(0.45, 0.8, 8), rng.uniform(-0.3, 0.3, 8), rng.uniform(0.1, 0.45, 8)])
    end = start + rng.normal(0, 0.1, start.shape)
    start[:5] = [[0.6, -0.25, 0.2], [-0.4, 0.0, 0.3], [0.7, 0.1, 0.4], [0.0, -0.6, 0.3], [0.3, 0.3, 0.3]]
    end[:5] = [[0.6, 0.25, 0.2], [0.5, 0.0, 0.4], [0.7, 0.1, 0.2], [0.2, -0.7, 0.2], [0.6, 0.6, 0.3]]
    return Segments(start, end)


@functools.cache
def zones():
    return fm.Zones([0.55, 0.6, 0.7, 0.55, 0.0], [0.6, 0.7, 0.7, 0.8, 0.004], [0.2, 0.3, 0.4, 0.15, 0.3], 0.42)


PARTS = np.array([[0.0, 1.0, 0.0, 1.0], [0.125, 0.5, 0.25, 0.75], [0.5, 0.625, 0.0, 0.5]])


def of_zones():
    of_range = MeasuredRange(np.random.default_rng([SEED, 2]).uniform([0.4, 0.0, 0.1], [1.0, 0.6, 0.5], (30, 3)))
    for name, each in (("zones", zones()), ("segments", segments())):
        yield f"{name} number", len(each)
        yield f"{name} probes", each.probes
        yield f"{name} extremes", each.extremes(of_range)
        which = np.repeat(np.arange(len(each)), len(PARTS))
        patches = each.patches(which, np.tile(PARTS, (len(each), 1)))
        yield f"{name} patches", np.hstack([patches.corner, patches.first, patches.second])
        yield f"{name} sag", 1e6 * patches.second
        yield f"{name} halves", each.halves(PARTS)
        near = [each.touching(d, h, 0.01) for d in np.linspace(0.4, 0.8, 9) for h in np.linspace(0.1, 0.5, 9)]
        yield f"{name} near", near
        corners = patches.corners
        yield f"{name} lowest speeds", lowest_measured_speeds(of_range, *corners)
        yield f"{name} highest speeds", highest_measured_speed(of_range, *corners)
    yield "footprint", footprint(of_range).facets
    grown = zones().grown(0.005)
    yield "grown", [grown.distance_from, grown.distance_to, grown.height_from, grown.height_to]
    yield "segments nearest", segments().nearest
    run_through = segments().zones
    names = ("distance_from", "distance_to", "height_from", "height_to")
    yield "segments zones", [getattr(run_through, name) for name in names]
    share = np.random.default_rng([SEED, 3]).random((len(segments()), 2, 3))
    yield "segments places", segments().places(share)
    yield "segments places of some", segments().places(share[:2], np.array([3, 1]))
    for size in (0.05, 0.0925, 0.37, 0.3701, 0.16):
        grid = fm.zone_grid(ur10e().measured_range, size)
        yield f"grid {size}", [getattr(grid, name) for name in names]
    # An eighth away, to the last bit: on every side.
    for d, h in ((0.375, 0.375), (0.875, 0.375), (0.5, 0.125), (0.5, 0.625)):
        box = fm.Zones(0.5, 0.75, 0.25, 0.5)
        upright = Segments([0.5, 0.0, 0.25], [0.5, 0.0, 0.5])
        slope = Segments([0.5, 0.0, 0.25], [0.75, 0.0, 0.5])
        yield f"touched at {d}, {h}", [each.touching(d, h, 0.125)[0] for each in (box, upright, slope)]


def of_enclosures():
    rng = np.random.default_rng([SEED, 4])
    near, low = rng.uniform(0.5, 0.8, 6), rng.uniform(0.15, 0.4, 6)
    boxes = Patches.box(near, near + np.array([0.0, 0.01, 0.02, 0.05, 0.1, 0.0]), low, low + 0.03)
    places = Patches.of_places(near, low)
    slowest, fastest = np.full(6, 0.15), np.linspace(0.2, 0.5, 6)
    start, stop = rng.uniform(0, 0.5, 6), rng.uniform(0.5, 1, 6)
    some = np.array([4, 0, 2])
    for name, force_map in {"published": ur10e(), **maps()}.items():
        bounds = [MARGIN] if name == "published" else [fm.ToleranceBound(), fm.ToleranceBound(0.5, 0.99, 8.0)]
        for bound, (shape, patches) in itertools.product(bounds, (("boxes", boxes), ("places", places))):
            what = f"{name} {bound} {shape}"
            enclosed = enclose(force_map, bound, patches, slowest, fastest)
            yield f"{what} largest", enclosed.largest(start, stop)
            yield f"{what} smallest", enclosed.smallest(start, stop)
            yield f"{what} of some", [enclosed.largest(start[some], stop[some], some),
                                      enclosed.smallest(start[some], stop[some], some)]  # fmt: skip
            yield f"{what} slopes", enclosed.slopes
            limit = enclosed.largest(np.zeros(6), np.ones(6)) + np.log([1.2, 0.97, 0.9, 0.8, 0.7, 0.3])
            yield f"{what} certified", enclosed.certified(limit)
            yield f"{what} certified roughly", enclosed.certified(limit, least=0.01)
            yield f"{what} exceeding", enclosed.exceeding(limit, least=2.0**-10)
            yield f"{what} speed", enclosed.speed(start)
            yield f"{what} coefficients", enclosed.log_force
            yield f"{what} leverage", enclosed.leverage
            falling = enclose(force_map, bound, patches, fastest, slowest)
            yield f"{what} falling", [falling.largest(start, stop), falling.smallest(start, stop), *falling.slopes]
        for bound in bounds[1:]:
            steps = ToleranceSteps.of(bound, force_map)
            logs, leverage = rng.uniform(2, 7, 12), rng.uniform(-0.1, 3, 12)
            yield f"{name} steps", [steps.largest(logs, leverage), steps.smallest(logs, leverage), steps.share(logs)]
            yield f"{name} steepest", [steps.steepest[:5], steps.falling[:5], steps.lowest[:5], steps.highest[:5]]
            yield f"{name} beyond", [steps.last_slope, steps.error, steps.largest(logs, 400 + leverage).sum()]
            most = np.maximum(leverage, 0) + 0.1
            yield f"{name} slopes", steps.slopes(logs - 4, logs - 3, leverage, most)
    ends = np.array([0.0, 0.1, 0.125, 0.5, 0.61, 0.9999, 1.0, 2.0])
    for least in (2.0**-4, 2.0**-15):
        asked = []

        def holds(rows, a, b, asked=asked):
            asked.append([a.sum(), b.sum(), rows.size])
            return b <= ends[rows]

        yield f"frontier {least}", frontier(holds, ends.size, least)
        yield f"frontier {least} asked", asked


class Raised(fm.FixedMargin):
    """A user's own bound, of which nothing can be proven."""

    def upper(self, force_map, distance, height, speed):
        return super().upper(force_map, distance, height, speed) * (1 + 0.3 * np.sin(9 * np.asarray(speed)))


def of_crossings():
    rng = np.random.default_rng([SEED, 5])
    d, h = rng.uniform(0.55, 0.85, 30), rng.uniform(0.15, 0.45, 30)
    turning = replace(ur10e(), measured_range=MeasuredRange(training_grid("ur10e") * [1, 1, 4]))
    given = {"published": (ur10e(), MARGIN), "turning": (turning, MARGIN), "own": (ur10e(), Raised(0.1))}
    given |= {name: (force_map, fm.ToleranceBound()) for name, force_map in maps().items()}
    for name, (force_map, bound) in given.items():
        low, high = (np.nan_to_num(each, nan=0.3) for each in force_map.measured_range.speeds(d, h))
        low, high = np.minimum(low, 0.28), np.maximum(high, 0.32)
        log = np.log(bound.upper(force_map, d, h, low + (high - low) * rng.uniform(-0.2, 1.2, 30)))
        yield f"{name} highest", highest_within(force_map, bound, d, h, (low, high), log)
        for end, at in (("low", low), ("high", high)):  # the limit is what the bound has there, to the last bit
            same = np.log(np.clip(bound.upper(force_map, d, h, at), 1e-300, 1e300))
            yield f"{name} highest at the {end} end", highest_within(force_map, bound, d, h, (low, high), same)
        over = np.log(bound.upper(force_map, d, h, low * rng.uniform(0.2, 0.99, 30)))
        over[:3] = 0.0
        yield f"{name} lowest", lowest_exceeded(force_map, bound, d, h, low, over)
        yield f"{name} lowest of none", lowest_exceeded(force_map, bound, *np.empty((4, 0)))


def of_speeds():
    """At places and along segments."""
    d, h = np.meshgrid(np.linspace(0.53, 0.89, 7), np.linspace(0.13, 0.47, 6))
    for name, force_map in {"published": ur10e(), **maps()}.items():
        bound = MARGIN if name == "published" else fm.ToleranceBound()
        for limit in (170.0, 300.0):
            given = {"limit": limit, "contact": QUASI_STATIC, "bound": bound, "angle": 3.0}
            for key, value in fields_of(fm.safe_speed(force_map, d, h, **given)):
                yield f"{name} {limit} {key}", value
            if limit == 300.0 or name == "published":
                for key, value in fields_of(fm.zone_speeds(force_map, segments(), **given)):
                    yield f"{name} {limit} segments {key}", value


def of_contradictions():
    """Where impacts exceeded the limit: a little nearer than repeats of a state may lie, and a little farther."""
    points = training_grid("kuka-iiwa7-10nm")
    force = np.minimum(fm.published_map("kuka-iiwa7-10nm").predict(*points.T), 499.0)
    calm = dict(zip(("distance", "height", "speed"), points.T, strict=True))
    permitted = fm.safe_speed(
        fm.fit_force_map(fm.ImpactDataset.from_arrays(**calm, peak_force=force)),
        *(0.75, 0.375), limit=300.0, contact=QUASI_STATIC, bound=fm.ToleranceBound(),
    ).speed  # fmt: skip
    for peak, censored in ((500.0, True), (350.0, False)):
        for v in (0.22, 0.26, 0.4):
            columns = np.vstack([points, [0.75, 0.375, v]]).T
            dataset = fm.ImpactDataset.from_arrays(
                **dict(zip(("distance", "height", "speed"), columns, strict=True)),
                peak_force=[*force, peak], role=["train"] * 27 + ["test"], censored=[False] * 27 + [censored],
            )  # fmt: skip
            force_map = fm.fit_force_map(dataset)
            off = REPEAT_DISTANCE * np.array([0.0, -0.99, 0.99, -1.01, 1.01, 0.0, 0.0, 0.0, 0.0])
            beside = 0.75 + off, 0.375 + off[[0, 5, 6, 7, 8, 1, 2, 3, 4]]
            given = {"contact": QUASI_STATIC, "bound": fm.ToleranceBound()}
            found = fm.safe_speed(force_map, *beside, limit=300.0, **given)
            yield f"{peak} {v} places", [found.speed, found.extrapolated_speed]
            yield f"{peak} {v} why", found.reason
            boxes = fm.Zones(beside[0] - 0.0, beside[0] + 0.01, beside[1], beside[1] + 0.01)
            in_zones = fm.zone_speeds(force_map, boxes, limit=300.0, **given)
            yield f"{peak} {v} zones", in_zones.speed
            yield f"{peak} {v} why in zones", in_zones.reason
            each = fm.zone_speeds(force_map, boxes, limit=np.linspace(300.0, 400.0, 9), **given)
            yield f"{peak} {v} limits of zones", [each.speed, each.limit]
            for limit in (peak, peak - 2.0**-40):  # the limit is what was measured, and less
                if limit < 400.0:
                    at = fm.safe_speed(force_map, [0.75, 0.75], [0.375, 0.376], limit=[limit, 300.0], **given)
                    both = fm.Zones([0.75, 0.74], [0.76, 0.75], 0.37, 0.38)
                    within = fm.zone_speeds(force_map, both, limit=[limit, 300.0], **given)
                    yield f"{peak} {v} limit {limit < peak}", [at.reason, within.reason]
            if not censored:  # driven as fast as the impact to the last bit, and a hair slower
                for speed in (permitted, math.nextafter(permitted, 1.0)):
                    columns[2, -1] = speed
                    named = dict(zip(("distance", "height", "speed"), columns, strict=True))
                    role = ["train"] * 27 + ["test"]
                    same = fm.fit_force_map(fm.ImpactDataset.from_arrays(**named, peak_force=[*force, peak], role=role))
                    at = fm.safe_speed(same, 0.75, 0.375, limit=300.0, **given)
                    yield f"{peak} {v} at its speed {speed > permitted}", at.reason
    # One as fast as nothing was measured, beside which the bound stays within the limit.
    far = np.vstack([points, [0.86, 0.46, 0.41]]).T
    dataset = fm.ImpactDataset.from_arrays(
        **dict(zip(("distance", "height", "speed"), far, strict=True)),
        peak_force=[*force, 500.0], role=["train"] * 27 + ["test"], censored=[False] * 27 + [True],
    )  # fmt: skip
    beside = fm.Zones([0.84, 0.80, 0.85], [0.86, 0.84, 0.86], [0.44, 0.42, 0.45], 0.46)
    given = {"limit": 480.0, "contact": QUASI_STATIC, "bound": fm.ToleranceBound()}
    for key, value in fields_of(fm.zone_speeds(fm.fit_force_map(dataset), beside, **given)):
        yield f"faster than measured {key}", value


def of_grids():
    """Maps of speeds, their axes, and how speeds are shown."""
    steps = fm.measured_grid(maps()["skew"], 0.07)
    found = fm.speed_map(maps()["skew"], *steps, limit=250.0, contact=QUASI_STATIC, bound=fm.ToleranceBound())
    yield "speed map", [*steps, found.fastest, found.fastest_to_program]
    yield "speed map counts", list(found.counts.values())
    none = SpeedMap(
        found.distance, found.height, replace(found.speeds, speed=np.full(found.speeds.speed.shape, np.nan))
    )
    yield "speed map of none", none.fastest
    for step in (0.05, 0.1, 0.02, 0.37, 0.5, 1.0, 3.0):
        yield f"grid {step}", [axis.tolist() for axis in fm.measured_grid(ur10e(), step)]
    slow = fm.Allowance(speed=0.0125)
    at = np.array([0.3, 0.0125, 0.01, math.nan, 0.1])
    yield "less the overshoot", [slow.off(at), slow.off(at) + 0.0125 <= at]
    for speed in (0.29, 0.2999999, 0.0, math.nan, math.inf, -0.0004, 1.0):
        yield f"floored {speed}", fm.floor_speed(speed).replace("-", "minus ")


def drawn_path(rng, n, *, rows=False, turning=False, time=True):
    points = np.cumsum(rng.normal(0, 0.03, (n + 1, 3)), axis=0) + np.array([0.7, 0.0, 0.3])
    clock = np.cumsum(rng.uniform(0.1, 0.6, n + 1))
    wait = np.append(np.where(rng.random(n) < 0.4, 0.05, 0.0), 0.03)
    return fm.ToolPath(
        points, tuple("ab"[i % 3 == 0] for i in range(n)), clock if time else None, "drawn",
        wait if time and rows else None, np.sort(rng.integers(0, 3, n)) if rows else None,
        0.001 * rows, rng.uniform(0, 1, n) if turning else None,
    )  # fmt: skip


def of_tool_paths():
    rng = np.random.default_rng([SEED, 6])
    shapes = {
        "plain": {},
        "rows": {"rows": True},
        "turning": {"rows": True, "turning": True},
        "untimed": {"time": False},
    }
    for name, shape in shapes.items():
        path = drawn_path(rng, 7, **shape)
        for key, each in (("", path), (" cut", path.resampled(0.02)), (" moved", path.moved([0.1, -0.2, 0.05]))):
            for field, value in fields_of(each):
                yield f"{name}{key} {field}", value
            yield f"{name}{key} lengths", [each.lengths, each.angles_from(np.array([0.0, 0.6, -0.8]))]
            yield f"{name}{key} directions", each.directions
            yield f"{name}{key} speeds", each.speeds
            for acceleration in (0.3, 1.0, 40.0):
                yield f"{name}{key} fastest at {acceleration}", each.fastest_speeds(acceleration)
    points = np.cumsum(np.column_stack([np.repeat([0, 0.05], 5), np.zeros(10), np.tile([0.0, 0.02], 5)]), axis=0)
    standing = points[[0, 0, 1, 2, 2, 2, 3, 4, 4]]
    clock = np.cumsum([0.5, 0.1, 0.2, 0.3, 0.1, 0.2, 0.3, 0.25, 0.15])
    for name, rows in (("", None), (" of rows", np.array([0, 0, 0, 1, 1, 1, 2, 2, 2]))):
        for last in (9, 8, 7):
            timed = fm.ToolPath.timed(standing[:last], tuple("abcdefghi"[:last]), clock[:last], "a file", rows)
            for field, value in fields_of(timed):
                yield f"standing{name} {last} {field}", value
    moving = fm.ToolPath.timed(points[:4], tuple("abcd"), clock[:4])
    yield "moving all the time", moving.wait
    length, limit, stops = rng.uniform(0.01, 0.2, 9), rng.uniform(0.05, 0.8, 9), rng.random(8) < 0.3
    for acceleration in (0.2, 1.5):
        for given in (None, stops):
            law = time_law(length, limit, acceleration=acceleration, stops=given)
            yield f"time law {acceleration} {given is None}", [law.start_speed, law.top_speed, law.end_speed]
            yield f"time law {acceleration} {given is None} takes", [*law.durations, law.duration]
        yield f"braking {acceleration}", braking_speeds(length, limit, acceleration=acceleration)
        yield f"braking to 0 {acceleration}", braking_speeds(length, limit * (limit > 0.3), acceleration=acceleration)


def of_files():
    robot, q = robot_named("ur10e"), np.array([[0.1, -1.2, 1.4, -0.3, 0.2, 0.5]] * 4)
    q[1:, 0] += [0.12, 0.2, 0.2]
    q[1:, 1] += [0.03, -0.1, -0.1]
    q[1:, 4] += [0.02, 0.4, 0.4]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "path.csv"
        (file.parent / "slides.urdf").write_text(SLIDES)
        slides = read_urdf(file.parent / "slides.urdf").with_tool(
            mass=0.0, centre_of_mass=(0, 0, 0), contact_offset=(0.1, 0.05, 0.1)
        )
        on_slides = np.array([[0.1, 0.2], [0.13, 0.6], [0.5, 0.62], [0.5, 0.61]])
        clock = np.array([[0.5], [1.0], [1.7], [1.9]])
        for name, on, joints in (("ur10e", robot, q), ("slides", slides, on_slides)):
            for unit, factor in (("rad", 1.0), ("deg", 180.0 / math.pi)):
                if name == "slides" and unit == "deg":
                    continue
                for timed in (False, True):
                    header = [f"joint_{i + 1}_{unit}" for i in range(joints.shape[1])]
                    rows = np.hstack([factor * joints, clock]) if timed else factor * joints[:3]
                    lines = [header + ["time_s"] * timed, *(map(repr, row) for row in rows.tolist())]
                    file.write_text("\n".join(map(",".join, lines)))
                    for field, value in fields_of(read_path(file, robot=on)):
                        if field != "source":
                            yield f"{name} {unit} {timed} {field}", value
        for turn in (3.0, 3.14, math.pi):  # all around, and back to where it began
            file.write_text(f"joint_1_rad,joint_2_rad\n0.1,{-turn!r}\n0.1,{turn!r}\n0.2,1.0\n")
            around = read_path(file, robot=slides)
            yield f"around by {turn}", [len(around), around.lengths.sum(), around.turning.max(), around.turning.min()]
        for text in (
            "distance_m,height_m\n0.8,0.4\n0.8,0.3\n0,0.3\n",
            "segment,x_m,y_m,z_m,time_s\na,0.8,0,0.4,0\nb,0.8,0.1,0.3,1.5\nb,0.8,0.1,0.3,2\nc,0.7,0.1,0.3,3\n",
            "x_m;y_m;z_m\n0,8;0;0,4\n0,8;0;0,3\n",
        ):
            file.write_text(text)
            for field, value in fields_of(read_path(file)):
                if field != "source":
                    yield f"{text.split()[0]} {field}", value


def tasks():
    hand, chest = ("back_of_hand",), ("chest", "palm")
    carry, press = fm.TaskSegment("carry", (), None, 0.6), fm.TaskSegment("press", hand, TRANSIENT, 0.35)
    hold = fm.TaskSegment("hold", chest, QUASI_STATIC)
    return {
        "one": fm.Task((replace(press, name="path"),)),
        "three": fm.Task((carry, press, hold), 0.7, {"direction": "down", "tool": "none"}),
        "slow": fm.Task((replace(carry, speed=0.02), press, replace(hold, speed=0.1)), 3.0),
        "apart": fm.Task((carry, replace(press, areas=("back_of_hand", "temple")), hold)),
    }


def of_path_speeds():
    points = np.array(
        [[0.8, -0.2, 0.44], [0.8, 0, 0.44], [0.8, 0, 0.34], [0.801, 0, 0.32], [0.7, 0, 0.4], [0.7, 0, 0.3]]
    )
    names = ("carry", "press", "press", "carry", "hold")
    clock, wait = np.array([0.0, 0.5, 1.0, 1.4, 2.0, 3.5]), np.array([0.1, 0.0, 0.0, 0.2, 0.0, 0.3])
    given = {
        "one": fm.ToolPath.through(points[1:3]),
        "three": fm.ToolPath(points, names),
        "slow": fm.ToolPath(points, names, clock, "", wait, deviation=0.002, turning=np.full(5, 0.5)),
        "apart": fm.ToolPath(points, names, clock),
    }
    published = replace(ur10e(), conditions=replace(ur10e().conditions, moving_mass=33.5))
    for name, task in tasks().items():
        for key, allowance, angle, force_map in (
            ("", fm.Allowance(), 5.0, ur10e()),
            ("bare", fm.Allowance(0.0, 0.0), 1.0, published),
            ("wide", fm.Allowance(0.03, 0.01), 3.0, maps()["cubic"]),
        ):
            if key == "wide":
                force_map = replace(force_map, conditions=replace(published.conditions, moving_mass=20.0))
            bound = fm.ToleranceBound() if key == "wide" else MARGIN
            step = 0.03 if key else 0.02
            found = fm.path_speeds(
                force_map, given[name], task, bound=bound, allowance=allowance, angle=angle, step=step
            )
            for field, value in fields_of(found):
                if not field.startswith("path.points"):
                    yield f"{name} {key} {field}", value
            yield f"{name} {key} refused", [found.refused, found.too_fast]
            yield f"{name} {key} commanded", found.commanded
            if key == "":
                for field, value in fields_of(replace(found, speed=found.programmed)):
                    if field in ("speed", "programmed"):
                        yield f"{name} as programmed {field}", value
                yield f"{name} not too fast", replace(found, speed=found.programmed).too_fast
                yield f"{name} too fast", replace(found, speed=found.programmed * (1 - 2e-9)).too_fast


def of_positions():
    press = fm.ToolPath.through([[0.0, 0.0, 0.06], [0.0, 0.0, 0.0]])
    for name, path in (
        ("press", press),
        ("slant", fm.ToolPath.through([[0.0, 0, 0.06], [0.02, 0, 0.03], [0.0, 0, 0.0]])),
    ):
        for step in (0.09, 0.13):
            told = []
            found = fm.place_task(
                ur10e(),
                path,
                tasks()["one"],
                bound=MARGIN,
                step=step,
                allowance=fm.Allowance(0.0),
                progress=told.append,
            )
            for field, value in fields_of(found):
                if "path" not in field:
                    yield f"place {name} {step} {field}", value
            yield f"place {name} {step} best", [found.best or 0.0, told[-1]]
            yield f"place {name} {step} sensitivity", found.sensitivity


PARTS_OF = (
    of_zones, of_enclosures, of_crossings, of_speeds, of_contradictions, of_grids, of_tool_paths, of_files,
    of_path_speeds, of_positions,
)  # fmt: skip


def rows(part):
    """Name and value of each figure that a part says."""
    return [[f"{part.__name__} {name}", " ".join(cells(value))] for name, value in part()]


if __name__ == "__main__":
    recorded.write(TABLE, [row for part in PARTS_OF for row in rows(part)])
