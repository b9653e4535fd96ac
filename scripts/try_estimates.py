"""The experiment of docs/estimates.md: what the contact model estimates, beside impacts of the virtual lab.

.venv/bin/python scripts/try_estimates.py  # about a minute; writes the tables into the page
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcemap.arrays import FloatArray
from forcemap.dynamics.mass_map import robot_effective_mass_at
from forcemap.lab.bench import SimulatedImpacts, simulate_impacts
from forcemap.lab.virtual_robot import PRESETS, VirtualRobot, virtual_robot
from forcemap.limits.covers import Cover
from forcemap.limits.estimate import LAB_RATIOS, LAB_STATES, Altered, OtherContact, Reading, estimate_force

BY_READING = "by the reading"
PAGE = Path("docs/estimates.md")
BODY_MASSES = (0.3, 0.6, 1.2, 2.0, 3.0, 4.4, 8.0, 15.0, 40.0, 75.0)  # [kg]
SPRINGS = (10e3, 25e3, 50e3, 75e3, 150e3)  # [N/m]; the softest and stiffest of the standard's, and between
COVERS = (5e3, 1e4, 2e4, 5e4, 1e5)  # [N/m]
PAYLOADS = (1.0, 2.0, 5.0)  # [kg]
DEVICE = 75e3  # [N/m]
THICK = 0.2  # [m]; covers of the lab do not bottom out
RANDOM, DRAWS = 60, 25  # impacts of one spring, springs of a robot
DURATION = 0.5  # [s]; every body part has left by then
_STATES = np.meshgrid(np.linspace(0.57, 0.85, 4), np.linspace(0.15, 0.45, 4), [0.05, 0.1, 0.2, 0.3, 0.4, 0.6])
DISTANCE, HEIGHT, SPEED = (axis.ravel() for axis in _STATES)  # [m], [m], [m/s]

EVERY = SPEED > 0
SLOWEST = LAB_STATES["speed"][0]
LOOKED_AT = SPEED >= SLOWEST


def impacts(robot: VirtualRobot, stiffness: float = DEVICE, body_mass: float = np.inf) -> SimulatedImpacts:
    """The impacts at all states on a spring, fixed or free."""
    case = {"device_stiffness": stiffness, "body_mass": body_mass, "duration": DURATION}
    return simulate_impacts(robot, DISTANCE, HEIGHT, SPEED, **case)


def largest(of: SimulatedImpacts) -> FloatArray:
    """Largest force of the whole contact [N]."""
    return np.asarray(of.force.max(axis=0))


@cache
def fixed(name: str, stiffness: float, payload: float = 0.0) -> SimulatedImpacts:
    """The impacts of a preset, with a payload [kg], on a fixed device."""
    robot = virtual_robot(name)
    return impacts(robot.with_payload(payload) if payload else robot, stiffness)


def ratios(
    read: SimulatedImpacts, found: SimulatedImpacts, other: OtherContact, stiffness: float, mass: FloatArray | None
) -> FloatArray:
    """Simulated forces over the estimates, shape (2, states): by the peaks of Phase I, and by the largest forces.

    Of a body part that is held the like is compared with the like; of a free one the largest force with both.
    """
    simulated = [largest(found) if other.free else found.peak_force, largest(found)]
    estimates = [
        [_estimate(force, i, other, stiffness, mass) for i, force in enumerate(forces.tolist())]
        for forces in (read.peak_force, largest(read))
    ]
    return np.asarray(np.array(simulated) / np.array(estimates))


def _estimate(force: float, state: int, other: OtherContact, stiffness: float, mass: FloatArray | None) -> float:
    bounds = None if mass is None else (float(mass[state]), float(mass[state]))
    return estimate_force(Reading(force, stiffness, SPEED[state]), other, robot_mass=bounds).highest


def robot_masses(name: str, payload: float = 0.0) -> dict[str, FloatArray | None]:
    """The effective masses that may be stated at the states, with drives and by the standard; that of the reading."""
    robot = virtual_robot(name)
    robot = robot.with_payload(payload) if payload else robot
    height = HEIGHT + robot.contact_radius
    along = robot_effective_mass_at(robot.robot, DISTANCE, height, tool_direction=robot.tool_direction).value
    standard = np.full(SPEED.size, robot.robot.standard_effective_mass)
    return {BY_READING: None, "by m_u": along, "by M/2 + m_L": standard}


@dataclass(frozen=True, eq=False)
class Free:
    """A free body part hit by a preset: by which robot mass it is reckoned, ratios to the estimate and the most."""

    name: str
    kind: str
    body_mass: float
    stiffness: float
    ratio: FloatArray
    at_most: FloatArray

    @property
    def what(self) -> Altered:
        """By which robot mass the command would reckon."""
        return Altered.FREE_BY_READING if self.kind == BY_READING else Altered.FREE_BY_MASS


@dataclass(frozen=True, eq=False)
class Other:
    """Something else that is other, its figure, and ratios to the estimate."""

    name: str
    what: Altered
    figure: str
    ratio: FloatArray


def of_free() -> Iterator[Free]:
    """Every preset, body mass and spring, by every kind of robot mass."""
    for name in PRESETS:
        masses = robot_masses(name)
        for stiffness in SPRINGS:
            held = largest(fixed(name, stiffness))
            for body_mass in BODY_MASSES:
                free = impacts(virtual_robot(name), stiffness, body_mass)
                at_most = largest(free) / np.minimum(held, SPEED * np.sqrt(stiffness * body_mass))
                for kind, mass in masses.items():
                    found = ratios(fixed(name, stiffness), free, OtherContact(body_mass=body_mass), stiffness, mass)
                    yield Free(name, kind, body_mass, stiffness, found, at_most)


def of_springs() -> Iterator[Other]:
    """Every preset, from every spring to every other."""
    for name, before, after in product(PRESETS, SPRINGS, SPRINGS):
        if before != after:
            what = Altered.SOFTER_SPRING if after < before else Altered.STIFFER_SPRING
            held = fixed(name, after)
            found = ratios(fixed(name, before), held, OtherContact(stiffness=after), before, None)
            yield Other(name, what, f"{before / 1000:g} to {after / 1000:g} N/mm", found)


def of_covers() -> Iterator[Other]:
    """Every preset with every cover, on every spring."""
    for name, cover, spring in product(PRESETS, COVERS, SPRINGS):
        covered = impacts(virtual_robot(name).with_cover(cover), spring)
        found = ratios(fixed(name, spring), covered, OtherContact(cover=Cover(cover, THICK)), spring, None)
        yield Other(name, Altered.COVER, f"{cover / 1000:g} N/mm", found)


def of_payloads() -> Iterator[Other]:
    """Every preset with every payload put on and taken off, on every spring."""
    for name, payload, spring in product(PRESETS, PAYLOADS, SPRINGS):
        for before, after in ((0.0, payload), (payload, 0.0)):
            held, read = fixed(name, spring, after), fixed(name, spring, before)
            for kind, mass in robot_masses(name, before).items():
                least = (np.square(read.peak_force / SPEED) / spring) if mass is None else mass
                if least.min() > payload or after:
                    found = ratios(read, held, OtherContact(payload_change=after - before), spring, mass)
                    yield Other(name, Altered.PAYLOAD, f"{after - before:+g} kg, {kind}", found)


def of_random(name: str, rng: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ratios at random states, springs and masses: by the reading, by the other masses, over what it is at most."""
    robot = virtual_robot(name)
    light, heavy = np.log(LAB_STATES["body_mass"])
    soft, stiff = np.log(LAB_STATES["spring"])
    d, h = rng.uniform(0.57, 0.85, RANDOM), rng.uniform(0.15, 0.45, RANDOM)
    v, body = rng.uniform(SLOWEST, SPEED.max(), RANDOM), np.exp(rng.uniform(light, heavy, RANDOM))
    spring = float(np.exp(rng.uniform(soft, stiff)))
    read = simulate_impacts(robot, d, h, v, device_stiffness=spring, duration=DURATION)
    free = largest(simulate_impacts(robot, d, h, v, device_stiffness=spring, body_mass=body, duration=DURATION))
    along = robot_effective_mass_at(robot.robot, d, h + robot.contact_radius, tool_direction=robot.tool_direction).value
    own, stated = [], []
    for i in range(RANDOM):
        reading, other = Reading(read.peak_force[i], spring, v[i]), OtherContact(body[i])
        own.append(estimate_force(reading, other).highest)
        for mass in (along[i], robot.robot.standard_effective_mass):
            stated.append(estimate_force(reading, other, robot_mass=(mass, mass)).highest)
    at_most = np.minimum(largest(read), v * np.sqrt(spring * body))
    return free / np.array(own), free.repeat(2) / np.array(stated), free / at_most


def table_of_random() -> Iterator[str]:
    """Free body parts at random, and not at the states that the ranges were found at."""
    rng = np.random.default_rng(19)
    found = [of_random(name, rng) for name in PRESETS for _ in range(DRAWS)]
    yield "| over | impacts | lab over it |"
    yield "|---|---|---|"
    kinds = ("the estimate by the reading", "the estimates by m_u and by M/2 + m_L", "what it is at most")
    for kind, every in zip(kinds, zip(*found, strict=True), strict=True):
        ratio = np.concatenate(every)
        yield f"| {kind} | {DRAWS * RANDOM * len(PRESETS)} | {ratio.min():.2f} to {ratio.max():.2f} |"


def table_of_masses() -> Iterator[str]:
    """The robot masses [kg] of every preset over all states and springs."""
    yield "| robot | m_u | M/2 + m_L | shown by the reading |"
    yield "|---|---|---|---|"
    for name in PRESETS:
        _, along, standard = robot_masses(name).values()
        shown = np.array([np.square(fixed(name, spring).peak_force / SPEED) / spring for spring in SPRINGS])
        assert along is not None
        assert standard is not None
        by_reading = shown[:, LOOKED_AT]
        cells = [f"{each.min():.1f} to {each.max():.1f} kg" for each in (along, by_reading)]
        yield f"| {name} | {cells[0]} | {standard[0]:.1f} kg | {cells[1]} |"


def words(found: list[FloatArray], at: NDArray[np.bool_] = LOOKED_AT) -> str:
    """Lowest and highest of ratios, shape (..., states), at some of the states; in a cell."""
    every = np.concatenate([each[..., at].ravel() for each in found])
    return f"{every.min():.2f} to {every.max():.2f}"


def table_of_free(rows: list[Free]) -> Iterator[str]:
    """Every preset and body mass, by every kind of robot mass, over springs, places and speeds."""
    kinds = list(dict.fromkeys(row.kind for row in rows))
    yield f"| robot | body part | {' | '.join(kinds)} | over what it is at most |"
    yield "|---" * (3 + len(kinds)) + "|"
    for name in PRESETS:
        for mass in BODY_MASSES:
            here = [row for row in rows if (row.name, row.body_mass) == (name, mass)]
            cells = [words([row.ratio for row in here if row.kind == kind]) for kind in kinds]
            yield f"| {name} | {mass:g} kg | {' | '.join(cells)} | {words([row.at_most for row in here], EVERY)} |"


def table_of_speeds(rows: list[Free]) -> Iterator[str]:
    """The same over robots and body parts, speed by speed, and how often the force is above the estimate."""
    kinds = list(dict.fromkeys(row.kind for row in rows))
    yield f"| speed | {' | '.join(f'{kind} | above' for kind in kinds)} | over what it is at most |"
    yield "|---" * (2 + 2 * len(kinds)) + "|"
    for speed in np.unique(SPEED):
        at, cells = speed == SPEED, []
        for kind in kinds:
            found = [row.ratio for row in rows if row.kind == kind]
            cells += [words(found, at), f"{100 * np.mean(np.array(found)[..., at] > 1):.0f} %"]
        yield f"| {speed:g} m/s | {' | '.join(cells)} | {words([row.at_most for row in rows], at)} |"


def table_of_others(rows: list[Other]) -> Iterator[str]:
    """What else may be other, figure by figure, by robot."""
    yield f"| other | figure | {' | '.join(PRESETS)} | above |"
    yield "|---" * (3 + len(PRESETS)) + "|"
    for what, figure in dict.fromkeys((row.what, row.figure) for row in rows):
        here = [row for row in rows if (row.what, row.figure) == (what, figure)]
        above = np.mean(np.array([row.ratio for row in here])[..., LOOKED_AT] > 1)
        by_name = [[row.ratio for row in here if row.name == name] for name in PRESETS]
        cells = [words(found) if found else "-" for found in by_name]
        yield f"| {what.replace('_', ' ')} | {figure} | {' | '.join(cells)} | {100 * above:.0f} % |"


def table_of_ranges(free: list[Free], others: list[Other]) -> Iterator[str]:
    """What the command states beside what was found."""
    yield "| estimate | lab over estimate, found | stated by the command | slower, at 0.05 m/s |"
    yield "|---|---|---|---|"
    for what in Altered:
        found = [row.ratio for row in others if row.what is what]
        found += [row.ratio for row in free if row.what is what]
        low, high = LAB_RATIOS[what]
        yield f"| {what.replace('_', ' ')} | {words(found)} | {low:.2f} to {high:.2f} | {words(found, ~LOOKED_AT)} |"


def main() -> None:
    """Make the tables, and write them into the page."""
    free, others = list(of_free()), [*of_springs(), *of_covers(), *of_payloads()]
    tables = {
        "masses": table_of_masses(),
        "ranges": table_of_ranges(free, others),
        "random": table_of_random(),
        "free": table_of_free(free),
        "speeds": table_of_speeds(free),
        "others": table_of_others(others),
    }
    for name, lines in tables.items():
        table = "\n".join(lines)
        print(table, "\n", flush=True)
        head, mark, rest = PAGE.read_text().partition(f"<!-- {name} -->\n\n")
        PAGE.write_text(head + mark + table + "\n\n" + "".join(rest.partition("<!-- end -->")[1:]))


if __name__ == "__main__":
    main()
