"""What numba gains, with and without: each figure beside numpy's and a copy of the bytes moved, in one run.

Prints the table of docs/benchmarks.md, "With the extra fast"; --write puts it there. Every program is run twice, as it
is and with numba switched off; every figure is the best of several repetitions.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures

import forcemap as fm
from forcemap.dynamics.mass_map import robot_effective_mass
from forcemap.lab.bench import simulate_impacts, simulate_peaks
from forcemap.lab.virtual_robot import virtual_robot

DOCUMENT = Path(__file__).parents[1] / "docs" / "benchmarks.md"
HEAD, END = "<!-- fast -->", "<!-- table -->"
SIZES = [10**k for k in range(3, 9)]


def best(function: Callable[[], object], repetitions: int = 7) -> float:
    """Shortest time of several repetitions [s]."""
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def points(n: int) -> list[np.ndarray]:
    """Distances, heights and speeds of n places."""
    rng = np.random.default_rng(0)
    return [rng.uniform(low, high, n) for low, high in ((0.52, 0.89), (0.14, 0.46), (0.2, 0.4))]


def times() -> dict[str, float]:
    """Seconds of everything here, in this process."""
    found: dict[str, float] = {}
    ur10e, kuka = fm.published_map("ur10e"), fm.published_map("kuka-iiwa7-10nm")
    few = points(1_000_000)
    found["first"] = best(lambda: ur10e.predict(*few), 1)
    for n in SIZES:
        d, h, v = points(n)
        again = max(9, min(100, 10**6 // n))
        found[f"predict {n}"] = best(lambda d=d, h=h, v=v: ur10e.predict(d, h, v), again)
        found[f"copy {n}"] = best(lambda d=d, h=h, v=v: [a.copy() for a in (d, h, v, d)], again)
        if n == 10_000_000:
            found["exp"] = best(lambda d=d: np.exp(d))
    found["crossing"] = best(lambda: kuka.crossing_speed(few[0], few[1], 200.0), 30)
    found["crossing copy"] = best(lambda: [a.copy() for a in few], 30)
    fitted = fm.fit_force_map(fm.read_dataset(Path(fm.__file__).parent / "campaigns" / "examples" / "ur10e"))
    found["bound"] = best(lambda: fm.ToleranceBound().upper(fitted, *few))
    robot = fm.robot_named("ur10e")
    q = np.random.default_rng(3).uniform(-np.pi, np.pi, (100_000, 6))
    found["mass"] = best(lambda: robot_effective_mass(robot, q))
    impacting = virtual_robot("ur10e-like")
    figures = ur10e.measured_range.points.T
    found["impacts"] = best(lambda: simulate_impacts(impacting, *figures))
    drawn = np.random.default_rng(4).uniform((0.55, 0.15, 0.1), (0.85, 0.45, 0.4), (10_000, 3)).T
    found["peaks"] = best(lambda: simulate_peaks(impacting, *drawn), 3)
    return found


def pipeline() -> float:
    """Seconds of the scikit-learn pipeline for 10^7 points."""
    many = np.column_stack(points(10_000_000))
    model = make_pipeline(PolynomialFeatures(3), LinearRegression())
    model.fit(many[:1000], np.log(fm.published_map("ur10e").predict(*many[:1000].T)))
    return best(lambda: np.exp(model.predict(many)))


def in_a_process(**environment: str) -> dict[str, float]:
    """`times` in a process of its own."""
    line = [sys.executable, __file__, "--times"]
    done = subprocess.run(line, env={**os.environ, **environment}, capture_output=True, text=True, check=True)
    return {what: float(seconds) for what, seconds in json.loads(done.stdout).items()}


def main() -> None:
    """Run everything and print or write the tables."""
    in_a_process()  # compiles what was not compiled yet
    fast, slow = in_a_process(), in_a_process(NUMBA_DISABLE_JIT="1")
    sklearn = pipeline()
    lines = ["| what | peer | with | without | asked of with |", "|---|---|---|---|---|"]
    predict, scattered = "predict 10000000", "prediction, 10^7 scattered points"
    for what, key, peer, seconds, asked in (
        (scattered, predict, "a copy of its four arrays", fast["copy 10000000"], "at most 2 x as long"),
        (scattered, predict, "numpy exp on one array", fast["exp"], ""),
        ("crossing speed, 10^6 points", "crossing", "a copy of its three arrays", fast["crossing copy"], ""),
    ):
        ratios = f"{fast[key] / seconds:.1f} | {slow[key] / seconds:.1f}"
        lines.append(f"| {what} | {peer}, x as long | {ratios} | {asked} |")
    for what, key, peer, seconds, asked in (
        (scattered, predict, "scikit-learn pipeline", sklearn, "at least 50 x"),
        ("crossing speed, 10^6 points", "crossing", "without the extra", slow["crossing"], "at least 7 x"),
        ("tolerance bound, 10^6 scattered points", "bound", "without the extra", slow["bound"], ""),
        ("effective mass, 10^5 UR10e configurations", "mass", "without the extra", slow["mass"], "at least 3 x"),
        ("125 simulated impacts of 1 s, all of the course", "impacts", "0.1 s", 0.1, "at least 1 x"),
        ("peaks of simulated impacts, a second and core", "peaks", "20,000", 0.5, "at least 1 x"),
        ("first call where kernels are kept, numba loaded", "first", "2 s", 2.0, "at least 1 x"),
    ):
        ratios = f"{seconds / fast[key]:.1f} | " + ("" if key == "first" else f"{seconds / slow[key]:.1f}")
        lines.append(f"| {what} | {peer}, x as fast | {ratios} | {asked} |")
    lines += [
        "",
        "Prediction as the number of points grows, in nanoseconds a point (a straight line has one figure throughout):",
        "",
        "| points | " + " | ".join(f"10^{len(str(size)) - 1}" for size in SIZES) + " |",
        "|---" * (len(SIZES) + 1) + "|",
    ]
    for name, found in (("with", fast), ("without", slow)):
        lines.append(f"| {name} | " + " | ".join(f"{1e9 * found[f'predict {k}'] / k:.1f}" for k in SIZES) + " |")
    lines.append("| copy of four arrays | " + " | ".join(f"{1e9 * fast[f'copy {k}'] / k:.1f}" for k in SIZES) + " |")
    text = "\n".join(lines)
    print(text)
    if "--write" in sys.argv:
        page = DOCUMENT.read_text()
        before, _, rest = page.partition(HEAD)
        DOCUMENT.write_text(f"{before}{HEAD}\n\n{text}\n\n{END}{rest.partition(END)[2]}")


if __name__ == "__main__":
    if "--times" in sys.argv:
        print(json.dumps(times()))
    else:
        main()
