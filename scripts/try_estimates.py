"""The experiment of docs/estimates.md: what the contact model estimates, beside impacts of the virtual lab.

.venv/bin/python scripts/try_estimates.py  # about a minute; writes the tables into the page
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.dynamics.mass_map import robot_effective_mass_at
from forcemap.lab.bench import SimulatedImpacts, simulate_impacts
from forcemap.lab.virtual_robot import PRESETS, VirtualRobot, virtual_robot
from forcemap.limits.covers import Cover
from forcemap.limits.estimate import Altered, OtherContact, Reading, estimate_force

PAGE = Path("docs/estimates.md")
BODY_MASSES = (0.3, 0.6, 1.2, 2.0, 3.0, 4.4, 8.0, 15.0, 40.0, 75.0)  # [kg]
SPRINGS = (10e3, 25e3, 50e3, 75e3, 150e3)  # [N/m]; the softest and stiffest of the standard's, and between
COVERS = (5e3, 1e4, 2e4, 5e4, 1e5)  # [N/m]
PAYLOADS = (1.0, 2.0, 5.0)  # [kg]
DEVICE = 75e3  # [N/m]
THICK = 0.2  # [m]; covers of the lab do not bottom out
DURATION = 0.5  # [s]; every body part has left by then
_STATES = np.meshgrid(np.linspace(0.57, 0.85, 4), np.linspace(0.15, 0.45, 4), [0.05, 0.1, 0.2, 0.3, 0.4, 0.6])
DISTANCE, HEIGHT, SPEED = (axis.ravel() for axis in _STATES)  # [m], [m], [m/s]


def impacts(robot: VirtualRobot, stiffness: float = DEVICE, body_mass: float = np.inf) -> SimulatedImpacts:
    """The impacts at all states on a spring, fixed or free."""
    case = {"device_stiffness": stiffness, "body_mass": body_mass, "duration": DURATION}
    return simulate_impacts(robot, DISTANCE, HEIGHT, SPEED, **case)


def largest(of: SimulatedImpacts) -> FloatArray:
    """Largest force of the whole contact [N]."""
    return np.asarray(of.force.max(axis=0))


@cache
def fixed(name: str, stiffness: float) -> SimulatedImpacts:
    """The impacts of a preset on a fixed device."""
    return impacts(virtual_robot(name), stiffness)


def ratios(name: str, simulated: FloatArray, other: OtherContact, stiffness: float, mass: FloatArray | None) -> FloatArray:
    """Simulated forces over the estimates by the peaks of Phase I on the fixed device."""
    read = fixed(name, stiffness)
    estimates = []
    for i, peak in enumerate(read.peak_force.tolist()):
        reading = Reading(peak, stiffness, SPEED[i])
        bounds = None if mass is None else (float(mass[i]), float(mass[i]))
        estimates.append(estimate_force(reading, other, robot_mass=bounds).highest)
    return np.asarray(simulated / np.array(estimates))


def robot_masses(name: str) -> dict[str, FloatArray | None]:
    """The effective masses that may be stated at the states, with drives and by the standard; that of the reading."""
    robot = virtual_robot(name)
    height = HEIGHT + robot.contact_radius
    along = robot_effective_mass_at(robot.robot, DISTANCE, height, tool_direction=robot.tool_direction).value
    standard = np.full(SPEED.size, robot.robot.standard_effective_mass)
    return {"shown by the reading": None, "m_u, with drives": along, "M / 2 + m_L": standard}


def of_free() -> Iterator[tuple[str, str, float, float, FloatArray, FloatArray]]:
    """Preset, kind of robot mass, body mass, spring, ratios to the estimate and to what it is at most."""
    for name in PRESETS:
        masses = robot_masses(name)
        for stiffness in SPRINGS:
            held = largest(fixed(name, stiffness))
            for body_mass in BODY_MASSES:
                free = largest(impacts(virtual_robot(name), stiffness, body_mass))
                at_most = free / np.minimum(held, SPEED * np.sqrt(stiffness * body_mass))
                for kind, mass in masses.items():
                    found = ratios(name, free, OtherContact(body_mass=body_mass), stiffness, mass)
                    yield name, kind, body_mass, stiffness, found, at_most


def of_others() -> Iterator[tuple[str, Altered, str, FloatArray]]:
    """Preset, what is other, its figure, ratios to the estimate."""
    for name in PRESETS:
        robot = virtual_robot(name)
        for spring in SPRINGS:
            if spring != DEVICE:
                what = Altered.SOFTER_SPRING if spring < DEVICE else Altered.STIFFER_SPRING
                found = ratios(name, largest(fixed(name, spring)), OtherContact(stiffness=spring), DEVICE, None)
                yield name, what, f"{spring / 1000:g} N/mm", found
        for spring in COVERS:
            covered = largest(impacts(robot.with_cover(spring)))
            found = ratios(name, covered, OtherContact(cover=Cover(spring, THICK)), DEVICE, None)
            yield name, Altered.COVER, f"{spring / 1000:g} N/mm", found
        for payload in PAYLOADS:
            loaded = largest(impacts(robot.with_payload(payload)))
            for kind, mass in robot_masses(name).items():
                found = ratios(name, loaded, OtherContact(payload_change=payload), DEVICE, mass)
                yield name, Altered.PAYLOAD, f"{payload:g} kg, {kind}", found


def words(found: list[FloatArray]) -> str:
    """Lowest and highest of ratios, in a cell."""
    every = np.concatenate(found)
    return f"{every.min():.2f} to {every.max():.2f}"


def main() -> None:
    """Make the tables."""
    free, others = list(of_free()), list(of_others())
    for kind in robot_masses(PRESETS[0]):
        print(kind, words([row[4] for row in free if row[1] == kind]), {v: words([row[4][v == SPEED] for row in free if row[1] == kind]) for v in np.unique(SPEED)})
    print("at most", words([row[5] for row in free]))
    for what in Altered:
        cells = [row[3] for row in others if row[1] == what]
        if cells:
            print(what, words(cells), {v: words([c[v == SPEED] for c in cells]) for v in np.unique(SPEED)})


if __name__ == "__main__":
    main()
