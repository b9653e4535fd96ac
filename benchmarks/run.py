"""Speed as ratios, each against its named peer in this one run.

Prints the table of docs/benchmarks.md; --write puts it there. Every figure is the best of several repetitions.
"""

from __future__ import annotations

import platform
import sys
import time
from pathlib import Path

import numpy as np
import scipy
import sklearn
import statsmodels
import statsmodels.api as sm
from scipy.optimize import brentq
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures

import forcemap as fm
from forcemap.maps.regression import least_squares

DOCUMENT = Path(__file__).parents[1] / "docs" / "benchmarks.md"


def best(function, repetitions=5):
    """Shortest time of several repetitions [s]."""
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def prediction():
    """Prediction on 10^7 scattered points, first call and repeated: scikit-learn's pipeline, and numpy's exp."""
    n = 10_000_000
    rng = np.random.default_rng(0)
    d, h, v = rng.uniform(0.52, 0.89, n), rng.uniform(0.14, 0.46, n), rng.uniform(0.2, 0.4, n)
    ur10e = fm.published_map("ur10e")
    points = np.column_stack([d, h, v])
    pipeline = make_pipeline(PolynomialFeatures(3), LinearRegression())
    pipeline.fit(points[:1000], np.log(ur10e.predict(*points[:1000].T)))

    def ours():
        return ur10e.predict(d, h, v)

    def theirs():
        return np.exp(pipeline.predict(points))

    ours_first, theirs_first = best(ours, 1), best(theirs, 1)
    what, peer = "prediction, 10^7 scattered points", "scikit-learn PolynomialFeatures(3) pipeline"
    yield f"{what}, first call", peer, theirs_first / ours_first, "at least 50 x as fast"
    ours_again = best(ours)
    yield f"{what}, repeated", peer, best(theirs, 3) / ours_again, "at least 50 x as fast"
    yield what, "numpy exp on one array of that size", ours_again / best(lambda: np.exp(d)), "at most 8 x as long"


def grid():
    """Prediction on a regular grid of about 10^7 points."""
    d, h, v = np.linspace(0.52, 0.89, 216), np.linspace(0.14, 0.46, 215), np.linspace(0.2, 0.4, 215)
    ur10e = fm.published_map("ur10e")
    array = np.broadcast_to(v, (d.size, h.size, v.size)).copy()
    ratio = best(lambda: ur10e.predict(d[:, None, None], h[:, None], v)) / best(lambda: np.exp(array))
    yield "prediction, grid of 10^7 points", "numpy exp on one array of that size", ratio, "at most 2.5 x as long"


def crossing():
    """Crossing speed on 10^6 points, per point, against a scipy brentq loop over 2000."""
    n, few = 1_000_000, 2000
    rng = np.random.default_rng(1)
    d, h = rng.uniform(0.52, 0.89, n), rng.uniform(0.14, 0.46, n)
    kuka = fm.published_map("kuka-iiwa7-10nm")
    b = kuka.coefficients.tolist()

    def loop():
        for x, y in zip(d[:few].tolist(), h[:few].tolist(), strict=True):
            place = b[0] + b[2] * x + b[3] * x * x + b[4] * x * y + b[5] * y * y + b[8] * x * y * y - np.log(200.0)
            brentq(lambda v, p=place, x=x: p + b[1] * v + b[6] * x * x * v + b[7] * x * v * v, 0.0, 0.5)

    ours = best(lambda: kuka.crossing_speed(d, h, 200.0)) / n
    theirs = best(loop) / few
    yield "crossing speed, 10^6 points", "scipy brentq loop, per point", theirs / ours, "at least 500 x as fast"


def fitting():
    """Fit with p values and R^2 on the 27 training states with three repeats."""
    dataset = fm.read_dataset(Path(fm.__file__).parent / "campaigns" / "examples" / "kuka-iiwa7-30nm")
    train = dataset.train.select(~dataset.train.censored)
    design = fm.CFM_3D.design(train.distance, train.height, train.speed)
    response = np.log(train.peak_force)

    def ours():
        regression = least_squares(design, response)
        return regression.p_values, regression.r_squared

    def theirs():
        result = sm.OLS(response, design).fit()
        return result.pvalues, result.rsquared

    for function in (ours, theirs):
        function()
    ratio = best(lambda: [theirs() for _ in range(200)]) / best(lambda: [ours() for _ in range(200)])
    yield "fit with p values and R^2", "statsmodels OLS", ratio, "at least 5 x as fast"


def main() -> None:
    """Run all benchmarks and print or write the table."""
    lines = ["| what | peer | ratio | asked |", "|---|---|---|---|"]
    for benchmark in (prediction, grid, crossing, fitting):
        for what, peer, ratio, asked in benchmark():
            lines.append(f"| {what} | {peer} | {ratio:.1f} | {asked} |")
    processor = next(
        (line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line),
        platform.processor(),
    )
    versions = {"numpy": np, "scipy": scipy, "scikit-learn": sklearn, "statsmodels": statsmodels}
    lines += [
        "",
        f"Machine: {processor}, Python {platform.python_version()}; "
        + ", ".join(f"{name} {module.__version__}" for name, module in versions.items())
        + f"; {time.strftime('%Y-%m-%d')}.",
    ]
    text = "\n".join(lines)
    print(text)
    if "--write" in sys.argv:
        head = DOCUMENT.read_text().split("<!-- table -->")[0]
        DOCUMENT.write_text(f"{head}<!-- table -->\n\n{text}\n")


if __name__ == "__main__":
    main()
