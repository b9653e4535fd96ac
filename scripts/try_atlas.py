"""How much of a path several maps permit: the tables of docs/atlas.md, made in the virtual lab.

.venv/bin/python scripts/try_atlas.py             # some minutes; writes the tables into the page
.venv/bin/python scripts/try_atlas.py --tasks 4   # a quick look: prints them
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import forcemap as fm
from forcemap.arrays import FloatArray
from forcemap.direction import direction_vector
from forcemap.lab.bench import simulate_peaks
from forcemap.lab.simulated_device import PAPER_DEVICE
from forcemap.lab.virtual_robot import virtual_robot
from forcemap.paths.atlas import Atlas, AtlasMap
from forcemap.paths.bent_path import bent_path

PAGE = Path("docs/atlas.md")
ROBOT = virtual_robot("ur10e-like")
RANGE = np.array([[0.56, 0.84], [0.16, 0.44], [0.05, 0.35]])  # distance, height [m], speed [m/s]
EFFECT, REPEAT = 0.022, 0.005  # standard deviations of ln F: of a state, of a repeat
AREAS = ("back_of_hand", "thigh_muscle")
SETS = {
    1: ("down",),
    3: ("down", "up", "left"),
    5: ("down", "up", "left", "right", "out"),
    6: ("down", "up", "left", "right", "out", "in"),
    7: ("down", "up", "left", "right", "out", "in", "down and out"),
}
BOUND = fm.ToleranceBound()
INNER = 0.02  # [m] that tasks keep from the edge of the measured places


def campaign(direction: str, seed: int) -> AtlasMap:
    """A campaign of the default plan in one direction, three impacts a state, effects of states and repeats drawn."""
    rng = np.random.default_rng([811, seed])
    plan = fm.plan_measurements(*RANGE, repeats=1, again=0)
    d, h, v = plan.distance, plan.height, plan.speed
    force = simulate_peaks(ROBOT, d, h, v, direction=direction_vector(direction, whose="the plan"))
    force = (force * np.exp(rng.normal(0, EFFECT, d.size))).repeat(3) * np.exp(rng.normal(0, REPEAT, 3 * d.size))
    conditions = fm.Conditions(
        robot=ROBOT.name,
        direction=direction,
        contact_site="flange",
        tool="none",
        payload=0.0,
        moving_mass=ROBOT.robot.moving_mass,
        safety_settings="as calibrated",
        speed_kind="measured",
        simulated=True,
        device=replace(PAPER_DEVICE, range=5000.0),
    )
    columns: dict[str, Any] = {
        "distance": d.repeat(3),
        "height": h.repeat(3),
        "speed": v.repeat(3),
        "peak_force": force,
    }
    force_map = fm.fit_force_map(fm.ImpactDataset.from_arrays(**columns, conditions=conditions))
    return AtlasMap(direction, conditions, force_map)


def place(rng: np.random.Generator, low: float = 0.0, high: float = 1.0) -> FloatArray:
    """A random place in front of the base, inside the measured places; heights from a share of them to another."""
    d, h = (rng.uniform(low + INNER, high - INNER) for low, high in RANGE[:2])
    h = RANGE[1, 0] + INNER + (low + (high - low) * rng.random()) * (np.ptp(RANGE[1]) - 2 * INNER)
    turn = rng.uniform(-1.0, 1.0)
    return np.array([d * math.cos(turn), d * math.sin(turn), h])


def random_move(rng: np.random.Generator) -> FloatArray:
    """A straight move between two random places, at least 5 cm long, inside the measured places all the way."""
    while True:
        ends = np.array([place(rng), place(rng)])
        way = ends[0] + (ends[1] - ends[0]) * np.linspace(0, 1, 50)[:, None]
        if np.linalg.norm(ends[1] - ends[0]) > 0.05 and np.hypot(*way.T[:2]).min() > RANGE[0, 0] + INNER / 2:
            return ends


def pick_and_place(rng: np.random.Generator) -> FloatArray:
    """Down to one place and up, straight over to another, down and up there."""
    while True:
        first, second = place(rng, 0.7, 1.0), place(rng, 0.7, 1.0)
        way = first + (second - first) * np.linspace(0, 1, 50)[:, None]
        if np.hypot(*way.T[:2]).min() > RANGE[0, 0] + INNER / 2:
            low = [each * [1, 1, 0] + [0, 0, rng.uniform(0.20, 0.26)] for each in (first, second)]
            return np.array([first, low[0], first, second, low[1], second])


def along_the_axes(rng: np.random.Generator) -> FloatArray:
    """Vertical, radial and circular moves from place to place."""
    at, points = place(rng), []
    for _ in range(3):
        to = place(rng)
        d, turn = (np.hypot(*at[:2]), np.hypot(*to[:2])), (math.atan2(at[1], at[0]), math.atan2(to[1], to[0]))
        arc = np.linspace(turn[0], turn[1], max(2, math.ceil(abs(turn[1] - turn[0]) * d[0] / 0.02)))
        points += [[d[0] * math.cos(a), d[0] * math.sin(a), at[2]] for a in arc]
        points += [[d[0] * math.cos(turn[1]), d[0] * math.sin(turn[1]), to[2]], to.tolist()]
        at = to
    kept = [points[0]]
    for point in points[1:]:
        if math.dist(point, kept[-1]) > 1e-4:
            kept.append(point)
    return np.array(kept)


def of_area(area: str) -> tuple[fm.Task, dict[str, Any]]:
    """A task that may hit one body area everywhere, and what goes with it."""
    return fm.Task((fm.TaskSegment("path", (area,), fm.Contact.TRANSIENT),)), {"bound": BOUND}


def permitted(speeds: list[fm.PathSpeeds]) -> float:
    """Share of the length of all paths that is permitted."""
    lengths = np.concatenate([each.path.lengths for each in speeds])
    return float(lengths[~np.concatenate([each.refused for each in speeds])].sum() / lengths.sum())


def of_shares(maps: dict[str, AtlasMap], tasks: int) -> Iterator[str]:
    """Length that atlases of more and more directions permit."""
    rng = np.random.default_rng(812)
    moves = [random_move(rng) for _ in range(5 * tasks)]
    jobs, axes = [pick_and_place(rng) for _ in range(tasks)], [along_the_axes(rng) for _ in range(tasks)]
    yield (
        f"| body area | directions | {len(moves)} straight moves | {tasks} pick-and-place tasks | the same, bent | "
        f"{tasks} vertical, radial and circular tasks |"
    )
    yield "|---" * 6 + "|"
    for area in AREAS:
        task, case = of_area(area)
        for count, directions in SETS.items():
            atlas = Atlas(tuple(maps[direction] for direction in directions))
            paths = [[fm.ToolPath.through(points) for points in each] for each in (moves, jobs, axes)]
            shares = [permitted([fm.path_speeds(atlas, path, task, **case) for path in each]) for each in paths]
            bent = permitted([bent_path(atlas, path, task, **case).speeds for path in paths[1]])
            cells = (shares[0], shares[1], bent, shares[2])
            yield f"| {area} | {count} | " + " | ".join(f"{100 * cell:.0f} %" for cell in cells) + " |"


def of_worth(maps: dict[str, AtlasMap]) -> Iterator[str]:
    """What one pick-and-place gains, and the impacts that it costs."""
    points = [[0.70, -0.2, 0.40], [0.70, -0.2, 0.22], [0.70, -0.2, 0.40], [0.66, 0.25, 0.38], [0.66, 0.25, 0.24]]
    path = fm.ToolPath.through([*points, points[3]])
    task, case = of_area("thigh_muscle")
    yield "| what it rests on | impacts | length permitted | its time | whole cycle |"
    yield "|---|---|---|---|---|"
    impacts = 3 * len(maps["down"].force_map.require_fit().states.name) if maps["down"].force_map else 0
    rows = [(1, False), (3, False), (6, False), (6, True)]
    everything = Atlas(tuple(maps[direction] for direction in SETS[6]))
    standard = bent_path(everything, path, task, **case).speeds.standard
    words = f"the standard's formula, {fm.floor_speed(standard.speed)} m/s everywhere"
    yield f"| {words} | 0 | confirmed nowhere | - | {standard.duration:.2f} s |"
    for count, bend in rows:
        atlas = Atlas(tuple(maps[direction] for direction in SETS[count]))
        found = bent_path(atlas, path, task, **case).speeds if bend else fm.path_speeds(atlas, path, task, **case)
        share, part, whole = permitted([found]), found.allowed.permitted_duration, found.allowed.duration
        words = f"{count} {'map' if count == 1 else 'maps'}{', carry bent' if bend else ''}"
        time = "-" if math.isnan(whole) else f"{whole:.2f} s"
        yield f"| {words} | {count * impacts} | {100 * share:.0f} % | {part:.2f} s | {time} |"


def main() -> None:
    """Make the tables; write them into the page at full size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", type=int, default=20)
    given = parser.parse_args()
    maps = {direction: campaign(direction, i) for i, direction in enumerate(SETS[7])}
    page = PAGE.read_text() if PAGE.exists() else ""
    for name, lines in {"shares": of_shares(maps, given.tasks), "worth": of_worth(maps)}.items():
        table = "\n".join(lines)
        print(table, "\n", flush=True)
        head, mark, rest = page.partition(f"<!-- {name} -->\n\n")
        page = head + mark + table + "\n\n" + "".join(rest.partition("<!-- end -->")[1:])
    if given.tasks == parser.get_default("tasks"):
        PAGE.write_text(page)


if __name__ == "__main__":
    main()
