"""Calibrate the presets of the virtual lab to the published maps: least squares on ln(force / map) at the 125 states.

The search starts at a prototype's figures and at seeded random ones within the bounds, on peaks alone; the best is
refined on whole courses. The figures are no robot facts: the maps do not determine them, other sets do as well, and
some end at the bounds that keep them plausible. The two settings of the iiwa differ in the threshold alone and are
calibrated together. Run from the root of the project; it takes some minutes, --check prints how near the presets are.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from forcemap import published_map
from forcemap.arrays import FloatArray
from forcemap.lab.course import ImpactSetup, first_peaks, force_course, phase_one_peaks
from forcemap.lab.simulated_device import PAPER_DEVICE
from forcemap.lab.virtual_robot import VirtualRobot, virtual_robot, virtual_robot_of

SEED = 20211
RANDOM_STARTS = 5
DRAWS = 40  # of which the best is a start
PRESETS = Path("src/forcemap/lab/presets")
MAPS = Path("src/forcemap/maps/published/published_maps.json")
SOURCE = "calibrated to the published map {} by scripts/calibrate_lab.py; its parameters are not facts of that robot"


@dataclass(frozen=True)
class Free:
    """A free figure: where the prototype had it, and its bounds."""

    start: float
    low: float
    high: float


@dataclass(frozen=True)
class Family:
    """Presets that share their free figures: preset -> (published map, threshold or None if it is free)."""

    presets: dict[str, tuple[str, float | None]]
    fixed: dict[str, Any]
    free: dict[str, Free]


# drive inertia [kg m^2] of base, elbow and wrist joints; SI units throughout
UR10E = Family(
    presets={"ur10e-like": ("ur10e", None)},
    fixed={
        "robot": "ur10e",
        "tool_direction": [0, 0, -1],
        "contact_radius_m": 0.0,
        "drive_inertia_joints": [2, 1, 3],
        "kind": "retreat",
        "torque_filter": 0.002,
    },
    free={
        "drive_base": Free(5.28, 0.5, 12),
        "drive_elbow": Free(0.98, 0.3, 8),
        "drive_wrist": Free(5.85, 0.02, 6),
        "pad_stiffness": Free(288e3, 75e3, 600e3),
        "pad_damping": Free(508, 100, 1500),
        "frequency": Free(6.32, 2, 20),
        "damping": Free(0.9, 0.5, 1.2),
        "threshold": Free(92.4, 10, 120),
        "delay": Free(0.03, 0.001, 0.03),
        "time_constant": Free(0.0436, 0.003, 0.06),
        "retreat_speed": Free(0.25, 0.2, 0.4),
        "retreat_time": Free(0.09, 0.08, 0.12),
    },
)
IIWA7 = Family(
    presets={
        "iiwa7-like-30nm": ("kuka-iiwa7-30nm", 30.0),
        "iiwa7-like-10nm": ("kuka-iiwa7-10nm", 10.0),
    },
    fixed={
        "robot": "kuka-iiwa7",
        "tool_direction": [1, 0, 0],
        "contact_radius_m": 0.04,
        "drive_inertia_joints": [2, 2, 3],
        "kind": "stop_and_hold",
        "torque_filter": 0.003,
        "hold_force": 106.0,
    },
    free={
        "drive_base": Free(11.98, 0.5, 12),
        "drive_elbow": Free(1.24, 0.1, 8),
        "drive_wrist": Free(1.82, 0.02, 4),
        "pad_stiffness": Free(500e3, 75e3, 1e6),
        "pad_damping": Free(146, 100, 1500),
        "frequency": Free(12.24, 2, 20),
        "damping": Free(0.5, 0.4, 1.2),
        "delay": Free(0.0136, 0.001, 0.03),
        "time_constant": Free(0.0034, 0.003, 0.06),
        "yielding": Free(3e-4, 1.5e-4, 5e-4),
    },
)


def figures(family: Family, name: str, free: dict[str, float]) -> dict[str, Any]:
    """The entries of a preset's file."""
    map_name, threshold = family.presets[name]
    all_of_it: dict[str, Any] = {"threshold": threshold} | family.fixed | free
    zero = {"retreat_speed": 0.0, "retreat_time": 0.0, "hold_force": 0.0, "yielding": 0.0}
    units = {
        "threshold": "N_m",
        "torque_filter": "s",
        "delay": "s",
        "time_constant": "s",
        "retreat_speed": "mps",
        "retreat_time": "s",
        "hold_force": "N",
        "yielding": "m_per_N_s",
    }
    return {
        "name": name,
        "source": SOURCE.format(map_name),
        **{key: family.fixed[key] for key in ("robot", "tool_direction", "contact_radius_m", "drive_inertia_joints")},
        "drive_inertia_kg_m2": [free[f"drive_{part}"] for part in ("base", "elbow", "wrist")],
        "servo": {"frequency_Hz": free["frequency"], "damping": free["damping"]},
        "pad": {"stiffness_N_per_m": free["pad_stiffness"], "damping_N_s_per_m": free["pad_damping"]},
        "reaction": {"kind": family.fixed["kind"]}
        | {f"{key}_{unit}": (zero | all_of_it)[key] for key, unit in units.items()},
        "speed_scatter": 0.004,
    }


class Target:
    """A published map on its grid, and the robot posed there: the postures do not depend on what is free."""

    def __init__(self, map_name: str, robot: VirtualRobot) -> None:
        grid = json.loads(MAPS.read_text())["maps"][map_name]
        places = np.array(list(product(grid["distances_m"], grid["heights_m"])))
        speeds = np.array(grid["speeds_mps"])
        self.shape = (len(grid["distances_m"]), len(grid["heights_m"]), speeds.size)
        self.speed = np.tile(speeds, len(places))
        self.place = np.repeat(np.arange(len(places)), speeds.size)
        self.force = np.asarray(
            published_map(map_name).predict(places[self.place, 0], places[self.place, 1], self.speed)
        )
        self._posed = robot.posed_at(*places.T)

    def impact_setup(self, robot: VirtualRobot) -> ImpactSetup:
        """The robot at all states."""
        return robot.impact_setup(self._posed, PAPER_DEVICE.stiffness).at_places(self.place)

    def misfit(self, peaks: FloatArray) -> FloatArray:
        """ln(force / map), more than 10 % counted three times, and trends that go the wrong way."""
        ratio = np.log(peaks / self.force)
        grid = np.log(peaks).reshape(self.shape)
        wrong = [np.diff(grid, axis=0), np.diff(grid, axis=1), -np.diff(grid, axis=2)]
        trends = [20 * np.maximum(steps + 0.003, 0).ravel() for steps in wrong]
        return np.concatenate([ratio, 2 * np.sign(ratio) * np.maximum(np.abs(ratio) - 0.1, 0), *trends])


def peak_cost(robot: VirtualRobot, target: Target) -> FloatArray:
    """Misfit of the peaks alone."""
    return target.misfit(phase_one_peaks(target.impact_setup(robot), target.speed, longest=0.15))


def course_cost(robot: VirtualRobot, target: Target) -> FloatArray:
    """Misfit of the peaks; no later force near or above the first peak; a retreat that is over in time."""
    course = force_course(target.impact_setup(robot), target.speed, duration=0.25)
    peaks = first_peaks(course)
    later = np.maximum(np.log(_after_phase_one(course, peaks) / peaks) + 0.1, 0)
    late = course[900:].max(axis=0) / 20 if robot.reaction.retreat_speed else np.zeros(peaks.size)
    return np.concatenate([target.misfit(peaks), 3 * later, np.log1p(late)])


def _after_phase_one(course: FloatArray, peaks: FloatArray) -> FloatArray:
    """Largest force after the first fall to 85 % of the peak [N], at least 1."""
    fallen = np.maximum.accumulate((course < 0.85 * peaks) & (np.maximum.accumulate(course) >= peaks), axis=0)
    return np.asarray(np.maximum(np.where(fallen, course, 0).max(axis=0), 1.0))


def calibrate(family: Family) -> dict[str, float]:
    """The free figures that bring the family's presets nearest to their maps."""
    low, high = (np.log([getattr(free, side) for free in family.free.values()]) for side in ("low", "high"))
    prototype = np.clip(np.log([free.start for free in family.free.values()]), low + 1e-3, high - 1e-3)

    def robots(x: FloatArray) -> dict[str, VirtualRobot]:
        free = dict(zip(family.free, np.exp(x).tolist(), strict=True))
        return {name: virtual_robot_of(figures(family, name, free)) for name in family.presets}

    targets = {name: Target(family.presets[name][0], robot) for name, robot in robots(prototype).items()}

    def residuals(cost: Callable[[VirtualRobot, Target], FloatArray]) -> Callable[[FloatArray], FloatArray]:
        return lambda x: np.concatenate([cost(robot, targets[name]) for name, robot in robots(x).items()])

    def refined(x: FloatArray, cost: Callable[[VirtualRobot, Target], FloatArray], most: int) -> Any:
        return least_squares(
            residuals(cost), x, bounds=(low, high), diff_step=np.array([2e-3]), x_scale=0.3, max_nfev=most, ftol=1e-4
        )

    rng = np.random.default_rng(SEED)
    starts = [prototype]
    by_peaks = residuals(peak_cost)
    for _ in range(RANDOM_STARTS):
        draws = rng.uniform(low, high, (DRAWS, low.size))
        starts.append(draws[np.argmin([np.sum(by_peaks(x) ** 2) for x in draws])])
    found = []
    for number, x in enumerate(starts):
        found.append(refined(x, peak_cost, 25))
        print(f"  start {number}: cost {found[-1].cost:.4f}", flush=True)
    for_courses = residuals(course_cost)
    best = min(found, key=lambda each: float(np.sum(for_courses(each.x) ** 2)))
    result = refined(best.x, course_cost, 40)
    print(f"  refined: cost {result.cost:.4f}", flush=True)
    return {name: float(f"{figure:.4g}") for name, figure in zip(family.free, np.exp(result.x).tolist(), strict=True)}


def check(name: str, map_name: str) -> FloatArray:
    """Print how near a preset is to its map; its peaks."""
    robot = virtual_robot(name)
    target = Target(map_name, robot)
    course = force_course(target.impact_setup(robot), target.speed, duration=0.7)
    peaks = first_peaks(course)
    ratio, settled = peaks / target.force, course[2500:].mean(axis=0)
    steps = np.diff(peaks.reshape(target.shape), axis=0), np.diff(peaks.reshape(target.shape), axis=1)
    print(
        f"{name}: ratio {ratio.min():.3f} to {ratio.max():.3f}, SD {100 * ratio.std():.1f} %; steps with d and h at "
        f"most {max(step.max() for step in steps):.1f} N; after 200 ms at most {course[1000:].max():.1f} N; held "
        f"{settled.min():.0f} to {settled.max():.0f} N; peak after {0.2 * np.median(course.argmax(axis=0)):.0f} ms; "
        f"later force at most {np.max(_after_phase_one(course, peaks) / peaks):.2f} of the peak",
        flush=True,
    )
    return peaks


def main() -> None:
    """Calibrate all presets and write their files; with --check only look."""
    families = {"ur10e": UR10E, "iiwa7": IIWA7}
    wanted = [name for name in sys.argv[1:] if name in families] or list(families)
    for family in (families[name] for name in wanted):
        if "--check" not in sys.argv:
            print(", ".join(family.presets), flush=True)
            free = calibrate(family)
            for name in family.presets:
                (PRESETS / f"{name}.json").write_text(json.dumps(figures(family, name, free), indent=1) + "\n")
        peaks = [check(name, map_name) for name, (map_name, _) in family.presets.items()]
        if len(peaks) > 1:
            print(f"mean peak with the lower threshold: {100 * (peaks[1].mean() / peaks[0].mean() - 1):+.1f} %")


if __name__ == "__main__":
    main()
