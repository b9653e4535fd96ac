"""The experiment on directions of docs/directions.md and docs/atlas.md: their tables, made in the virtual lab.

.venv/bin/python scripts/try_directions.py                # some twenty minutes; writes the tables into the page
.venv/bin/python scripts/try_directions.py --campaigns 2  # a quick look: prints them
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import forcemap as fm
from forcemap.arrays import FloatArray
from forcemap.dynamics.inverse_kinematics import ReachOutcome, inverse_kinematics, places_in_plane
from forcemap.dynamics.mass_map import robot_effective_mass_at
from forcemap.lab.bench import simulate_peaks
from forcemap.lab.virtual_robot import PRESETS, VirtualRobot, virtual_robot
from forcemap.maps.transfer import SHIFT

PAGE, ATLAS = Path("docs/directions.md"), Path("docs/atlas.md")
TOOLS = (0.0, 0.1, 0.2)  # length of the tool [m]
AXES = {"down": (0.0, 0.0, -1.0), "out": (1.0, 0.0, 0.0), "sideways": (0.0, 1.0, 0.0)}
DIAGONALS = {
    "down and out": (1, 0, -1),
    "down and in": (-1, 0, -1),
    "down and sideways": (0, 1, -1),
    "out and sideways": (1, 1, 0),
}
ANGLES = (2.0, 5.0, 10.0, 15.0, 30.0, 45.0)
WITHIN = (2.0, 3.0, 5.0, 7.0, 10.0)
LOW, HIGH = np.array([0.56, 0.16, 0.1]), np.array([0.84, 0.44, 0.4])  # distance, height [m], speed [m/s]
EFFECT, REPEAT = 0.022, 0.005  # standard deviations of ln F: of a state, of a repeat
WIDER = fm.Form.of("SHIFT", [*SHIFT.term_names, "d^2", "d*h"])
BOUND = fm.ToleranceBound(device_error=0)


@dataclass(frozen=True, eq=False)
class Site:
    """A preset with a tool, and the places of the range that it reaches with it."""

    robot: VirtualRobot
    tool: float

    def reaches(self, points: FloatArray) -> FloatArray:
        """Points, shape (n, 3), at places that are reached."""
        height = points[:, 1] + self.robot.contact_radius
        reach = inverse_kinematics(
            self.robot.robot, places_in_plane(points[:, 0], height), tool_direction=self.robot.tool_direction
        )
        return np.asarray(points[reach.outcome != ReachOutcome.UNREACHABLE])

    def force(self, points: FloatArray, along: FloatArray) -> FloatArray:
        """Peaks [N] of impacts at points, shape (n, 3), moving along a direction or one for each."""
        return np.asarray(simulate_peaks(self.robot, *points.T, direction=along))


def sites() -> Iterator[Site]:
    """Every preset with every tool; the tool has no mass."""
    for name in PRESETS:
        preset = virtual_robot(name)
        for tool in TOOLS:
            robot = preset.robot.with_tool(contact_offset=(0.0, 0.0, tool), axis=preset.robot.tool_axis)
            yield Site(replace(preset, robot=robot), tool)


def grid(*counts: int) -> FloatArray:
    """An even grid over the range, shape (n, 3)."""
    axes = [np.linspace(low, high, count) for low, high, count in zip(LOW, HIGH, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def tilted(axis: FloatArray, towards: FloatArray, angle: float) -> FloatArray:
    """A unit vector `angle` [deg] away from an axis, towards another direction."""
    across = towards - (towards @ axis) * axis
    radians = np.deg2rad(angle)
    return np.asarray(np.cos(radians) * axis + np.sin(radians) * across / np.linalg.norm(across))


def of_angles() -> Iterator[str]:
    """Largest force of a tilted impact beside the straight one, over presets, tools, places and speeds."""
    yield "| straight | tilted towards | " + " | ".join(f"{angle:g} deg" for angle in ANGLES) + " |"
    yield "|---" * (2 + len(ANGLES)) + "|"
    points = {site: site.reaches(grid(4, 4, 4)) for site in sites()}
    for straight, axis in AXES.items():
        for name, other in AXES.items():
            if name == straight:
                continue
            worst = []
            for angle in ANGLES:
                ratios = [
                    site.force(at, tilted(np.array(axis), sign * np.array(other), angle))
                    / site.force(at, np.array(axis))
                    for site, at in points.items()
                    for sign in (1, -1)
                ]
                worst.append(max(float(ratio.max()) for ratio in ratios))
            yield f"| {straight} | {name} | " + " | ".join(f"{ratio:.2f}" for ratio in worst) + " |"


def of_tilts(count: int) -> Iterator[str]:
    """What an angle needs: ratios of random tilts within it, on random sites and states."""
    rng = np.random.default_rng(71)
    yield "| straight | within | largest ratio | 99.9 % of tilts below | 95 % below |"
    yield "|---|---|---|---|---|"
    for straight, axis in AXES.items():
        for within in WITHIN:
            ratios = []
            for site in sites():
                points = site.reaches(LOW + rng.random((count, 3)) * (HIGH - LOW))
                turned = np.cross(np.array(axis), rng.standard_normal((len(points), 3)))
                turned /= np.linalg.norm(turned, axis=1)[:, None]
                angle = np.deg2rad(within) * np.sqrt(rng.random((len(points), 1)))
                along = np.cos(angle) * np.array(axis) + np.sin(angle) * turned
                ratios.append(site.force(points, along) / site.force(points, np.array(axis)))
            every = np.concatenate(ratios)
            shares = np.quantile(every, [0.999, 0.95])
            yield f"| {straight} | {within:g} deg | {every.max():.3f} | {shares[0]:.3f} | {shares[1]:.3f} |"


def of_permitted(count: int) -> Iterator[str]:
    """Impacts at the safe speed of a map, tilted within 5 degrees of its direction, beside the limit."""
    yield "| direction | slowest speed measured | effects of states | impacts | above | most |"
    yield "|---" * 6 + "|"
    for slowest, effect in ((0.1, 0.0), (0.2, 0.0), (0.1, EFFECT)):
        for name, direction in {**AXES, **DIAGONALS}.items():
            axis = np.array(direction, dtype=np.float64) / np.linalg.norm(direction)
            ratio = np.concatenate([_tilted_ratios(site, axis, slowest, effect, count) for site in sites()])
            what = f"{name} | {slowest:g} m/s | {100 * effect:g} %"
            yield f"| {what} | {ratio.size} | {100 * np.mean(ratio > 1):.2f} % | {ratio.max():.2f} |"


def _tilted_ratios(site: Site, axis: FloatArray, slowest: float, effect: float, count: int) -> FloatArray:
    """Forces over limits at random places and limits, at the speed that the map allows within 5 degrees."""
    rng, low = np.random.default_rng([74, int(1000 * slowest)]), np.array([*LOW[:2], slowest])
    plan = fm.plan_measurements(*np.column_stack([low, HIGH]), repeats=1, again=0)
    states = site.reaches(np.column_stack([plan.distance, plan.height, plan.speed]))
    force_map = fm.fit_force_map(measured(site, states, axis, rng, effect))
    try:
        BOUND.require(force_map)
    except fm.BoundNotAvailable:  # too few of its places are reached
        return np.empty(0)
    distance, height, _ = site.reaches(low + rng.random((count, 3)) * (HIGH - low)).T
    forces = np.quantile(force_map.require_fit().states.force, rng.uniform(0.1, 0.95, distance.size))
    limit = np.minimum(forces, force_map.highest_force - force_map.conditions.device.error_or_default)
    case: dict[str, Any] = {"bound": BOUND, "contact": fm.Contact.QUASI_STATIC, "angle": 5.0}
    speed = fm.safe_speed(force_map, distance, height, limit=limit, **case).speed
    has = ~np.isnan(speed)
    turned = np.cross(axis, rng.standard_normal((int(has.sum()), 3)))
    turned /= np.linalg.norm(turned, axis=1)[:, None]
    angle = np.deg2rad(5.0) * np.sqrt(rng.random((int(has.sum()), 1)))
    along = np.cos(angle) * axis + np.sin(angle) * turned
    return np.asarray(site.force(np.column_stack([distance, height, speed])[has], along) / limit[has])


def measured(
    site: Site, points: FloatArray, along: FloatArray, rng: np.random.Generator, effect: float = EFFECT
) -> fm.ImpactDataset:
    """Three impacts of every state, effects of states and repeats drawn."""
    force = site.force(points, along) * np.exp(rng.normal(0, effect, len(points)))
    repeats = force.repeat(3) * np.exp(rng.normal(0, REPEAT, 3 * len(points)))
    d, h, v = points.repeat(3, axis=0).T
    return fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=repeats)


def of_shifts(campaigns: int) -> Iterator[str]:
    """Which shift carries a map from down to another direction, with how many states, at what coverage."""
    plan = fm.plan_measurements(*np.column_stack([LOW, HIGH]), repeats=1, again=0)
    old_points, query = np.column_stack([plan.distance, plan.height, plan.speed]), grid(7, 7, 5)
    yield "| robot | direction | shift | shift misses, rms | new states | refused | refused or covered | width |"
    yield "|---" * 8 + "|"
    for site in sites():
        if site.tool:
            continue
        at, old = site.reaches(query), site.reaches(old_points)
        straight = np.array(AXES["down"])
        for name, direction in {**{k: v for k, v in AXES.items() if k != "down"}, **DIAGONALS}.items():
            along = np.array(direction, dtype=np.float64)
            truth = np.log(site.force(at, along))
            for shift, n in ((SHIFT, 9), (WIDER, 12), (WIDER, 18)):
                rows = shift.design(*at.T)
                change = truth - np.log(site.force(at, straight))
                missed = change - rows @ np.linalg.lstsq(rows, change, rcond=None)[0]
                refused, covered, widths = 0, 0, []
                for number in range(campaigns):
                    rng = np.random.default_rng([72, number, n])
                    share = np.column_stack([rng.permutation(n) for _ in range(3)]) / (n - 1)
                    new = site.reaches(LOW + (0.02 + 0.96 * share) * (HIGH - LOW))
                    old_map = fm.fit_force_map(measured(site, old, straight, rng))
                    own = fm.fit_force_map(measured(site, old, along, rng))
                    try:
                        force_map = fm.transfer_map(old_map, measured(site, new, along, rng), shift=shift)
                    except fm.FitError:
                        refused += 1
                        continue
                    upper = BOUND.upper(force_map, *at.T)
                    z = (np.log(upper) - truth) / EFFECT
                    covered += bool(np.mean(_normal(z)) >= 0.95)
                    own_width = BOUND.upper(own, *at.T) / own.predict(*at.T) - 1
                    widths.append(float((upper / force_map.predict(*at.T) - 1).mean() / own_width.mean()))
                width = f"{np.mean(widths):.2f}" if widths else "-"
                what = f"{site.robot.name} | {name} | {', '.join(shift.term_names)}"
                yield (
                    f"| {what} | {100 * np.std(missed):.1f} % | {n} | "
                    f"{refused / campaigns:.2f} | {(refused + covered) / campaigns:.2f} | {width} |"
                )


def _normal(z: FloatArray) -> FloatArray:
    from scipy.special import ndtr

    return np.asarray(ndtr(z))


def of_coordinates(directions: int) -> Iterator[str]:
    """One map over all directions, by the effective mass along them, beside maps of single directions: rms of ln F."""
    yield (
        "| robot | 27 states of one direction, its own map | 81 states of random directions: CFM_3D | and ln m_u "
        "| and ln m_u times 1, d, h, v |"
    )
    yield "|---|---|---|---|---|"
    rng = np.random.default_rng(73)
    for site in sites():
        if site.tool:
            continue
        points = site.reaches(grid(6, 6, 4))
        along = rng.standard_normal((directions, 3))
        along /= np.linalg.norm(along, axis=1)[:, None]
        logs = np.array([np.log(site.force(points, u)) for u in along])
        places, which = np.unique(points[:, :2], axis=0, return_inverse=True)
        reach = places[:, 1] + site.robot.contact_radius
        masses = np.array(
            [
                np.log(
                    robot_effective_mass_at(
                        site.robot.robot, places[:, 0], reach, direction=u, tool_direction=site.robot.tool_direction
                    ).value
                )[which.ravel()]
                for u in along
            ]
        )
        terms = fm.CFM_3D.design(*points.T)
        own = []
        for log in logs[:12]:
            chosen = rng.choice(len(points), 27, replace=False)
            own.append(log - terms @ np.linalg.lstsq(terms[chosen], log[chosen], rcond=None)[0])
        rows = np.repeat(np.arange(directions), len(points)), np.tile(np.arange(len(points)), directions)
        ln_m, x = masses.ravel(), terms[rows[1]]
        several = [
            x,
            np.column_stack([x, ln_m]),
            np.column_stack([x, ln_m[:, None] * SHIFT.design(*points[rows[1]].T)]),
        ]
        chosen = rng.choice(ln_m.size, 81, replace=False)
        missed = [a @ np.linalg.lstsq(a[chosen], logs.ravel()[chosen], rcond=None)[0] - logs.ravel() for a in several]
        figures = [float(np.sqrt(np.mean(np.square(each)))) for each in (np.concatenate(own), *missed)]
        yield f"| {site.robot.name} | " + " | ".join(f"{100 * figure:.0f} %" for figure in figures) + " |"


def main() -> None:
    """Make the tables; write them into the page at full size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=20)
    parser.add_argument("--only", help="one of the tables: angles, tilts, shifts, coordinates, permitted")
    given = parser.parse_args()
    tables = {
        "angles": (PAGE, of_angles()),
        "tilts": (PAGE, of_tilts(50 * given.campaigns)),
        "shifts": (PAGE, of_shifts(given.campaigns)),
        "coordinates": (PAGE, of_coordinates(40)),
        "permitted": (ATLAS, of_permitted(20 * given.campaigns)),
    }
    for name, (page, lines) in tables.items():
        if given.only in (None, name):
            table = "\n".join(lines)
            print(table, "\n", flush=True)
            if given.campaigns == parser.get_default("campaigns"):
                head, mark, rest = page.read_text().partition(f"<!-- {name} -->\n\n")
                page.write_text(head + mark + table + "\n\n" + "".join(rest.partition("<!-- end -->")[1:]))


if __name__ == "__main__":
    main()
