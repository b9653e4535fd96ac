"""Speed as ratios, each against its named peer in this one run.

Prints the table of docs/benchmarks.md; --write puts it there. Every figure is the best of several repetitions.
"""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import scipy
import sklearn
import statsmodels
import statsmodels.api as sm
from scipy.optimize import brentq
from scipy.signal import find_peaks, savgol_filter
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures

import forcemap as fm
from forcemap.dynamics.mass_map import robot_effective_mass
from forcemap.errors import ForcemapError
from forcemap.lab.bench import simulate_impacts, simulate_peaks
from forcemap.lab.virtual_robot import virtual_robot
from forcemap.maps.regression import least_squares
from forcemap.planning.optimal_states import optimal_states
from forcemap.recordings.read import read_recordings
from forcemap.report import report_html
from forcemap.web.campaign_map import CampaignMap
from forcemap.web.fitted_campaign import fitted_campaign
from forcemap.web.grids import slices_answer
from forcemap.web.limits import Limits
from forcemap.web.question import State

DOCUMENT = Path(__file__).parents[1] / "docs" / "benchmarks.md"
sys.path.insert(
    0, str(Path(__file__).parents[1] / "tests")
)  # their campaigns, damaged files and server serve here, too


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


def bounding():
    """The tolerance bound at 10^6 scattered points, beside the prediction there."""
    n = 1_000_000
    rng = np.random.default_rng(0)
    points = rng.uniform(0.52, 0.89, n), rng.uniform(0.14, 0.46, n), rng.uniform(0.2, 0.4, n)
    dataset = fm.read_dataset(Path(fm.__file__).parent / "campaigns" / "examples" / "ur10e")
    force_map, bound = fm.fit_force_map(dataset), fm.ToleranceBound()
    ratio = best(lambda: bound.upper(force_map, *points)) / best(lambda: force_map.predict(*points))
    yield "tolerance bound, 10^6 scattered points", "their prediction", ratio, "at most 12 x as long"


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


def recordings():
    """Recordings of 2,000 samples to an impacts table, files read, hashed and judged: a pandas + scipy script."""
    rng = np.random.default_rng(2)
    time_s = np.arange(2000) / 2000
    count = 600
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        (home / "recordings").mkdir()
        plan = ["state_id,repeat,distance_m,height_m,speed_mps"]
        for i in range(count):
            state, repeat = divmod(i, 3)
            plan.append(f"s{state},{repeat + 1},{0.5 + 0.01 * (state % 20)},{0.1 + 0.02 * (state // 20)},0.25")
            arch = np.sin(np.pi * np.clip((time_s - 0.1) / 0.03, 0, 1))
            force = 150 * (1 + state / count) * arch + rng.normal(3, 0.5, time_s.size)
            rows = "".join(f"{t:.4f},{f:.3f}\n" for t, f in zip(time_s.tolist(), force.tolist(), strict=True))
            (home / "recordings" / f"s{state}-r{repeat + 1}.csv").write_text(f"time_s,force_N\n{rows}")
        (home / "plan.csv").write_text("\n".join(plan) + "\n")
        (home / "campaign.toml").write_text('schema = "forcemap-campaign/1"\n[device]\nrange_N = 500\n')

        def ours():
            (home / ".judged").unlink(missing_ok=True)  # what collect remembers
            fm.build_dataset(fm.read_campaign(home))

        def theirs():
            pd.DataFrame([_by_hand(path) for path in sorted((home / "recordings").iterdir())]).to_csv(home / "out.csv")

        seconds = best(ours, 3)
        ratio = best(theirs, 3) / seconds
    yield (
        f"recordings to impacts, {count / seconds:.0f} a second",
        "pandas + scipy.signal script",
        ratio,
        "at least 1 x",
    )


def collecting():
    """A thousand recordings of 30 kB: collected again unchanged, beyond start-up; as new ones, by two processes."""
    from pulses import TOML, pulse, save

    with tempfile.TemporaryDirectory() as folder:
        many, few = Path(folder) / "many", Path(folder) / "few"
        for home, count in ((many, 1000), (few, 6)):
            plan = ["state_id,repeat,distance_m,height_m,speed_mps"]
            for i in range(count):
                state, repeat = divmod(i, 3)
                plan.append(f"s{state},{repeat + 1},{0.5 + 0.01 * (state % 20)},{0.1 + 0.02 * (state // 20)},0.25")
                save(home / "recordings" / f"s{state}-r{repeat + 1}.csv", *pulse(150 + state, after=0.7, seed=i))
            (home / "plan.csv").write_text("\n".join(plan) + "\n")
            (home / "campaign.toml").write_text(TOML)

        def new(workers):
            (many / ".judged").unlink(missing_ok=True)
            fm.build_dataset(fm.read_campaign(many), workers=workers)

        two = best(lambda: new(2), 3)
        yield "a thousand new recordings, two processes", "one process", best(lambda: new(1), 3) / two, "at least 1.6 x"
        again = [[sys.executable, "-m", "forcemap", "collect", str(home)] for home in (many, few)]
        unchanged, start = (best(lambda a=a: subprocess.run(a, check=True, capture_output=True), 9) for a in again)
    what = f"a thousand recordings collected again, {1000 / (unchanged - start):.0f} a second beyond start-up"
    yield what, "5,000 a second", 0.2 / (unchanged - start), "at least 1 x"


def _by_hand(path):
    """The figures of one recording as a script would take them."""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    frame = pd.read_csv(path)
    t, f = frame["time_s"].to_numpy(), frame["force_N"].to_numpy()
    quiet = slice(0, 180)
    f = f - np.polyval(np.polyfit(t[quiet], f[quiet], 1), t)
    sd = f[quiet].std()
    floor = max(5.0, 4 * sd)
    smooth = savgol_filter(f, 11, 3)
    peak = find_peaks(smooth, prominence=max(0.12 * smooth.max(), 5 * sd))[0][0]
    onset = t[np.argmax(f > floor)]
    end = peak + np.argmax(smooth[peak:] < floor)
    after, contact = f[t > onset + 0.5], (t >= onset) & (t <= t[end])
    impulse = np.trapezoid(f[contact], t[contact])
    return path.name, digest, smooth[peak], f.max(), t[peak], onset, t[end], after.max(), after.mean(), impulse


def damaged():
    """The damaged texts of the tests, whole or refused, the slowest of 500: the same text without damage."""
    from test_damaged_files import DAMAGES, HEADERS, MAPS, lines

    rng = np.random.default_rng(20260501)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "recording.csv"

        def seconds(content, columns):
            path.write_bytes(content)

            def read():
                try:
                    read_recordings(path, columns=columns)
                except ForcemapError:
                    return False
                return True

            return best(read, 3), read()

        whole, is_read = seconds(lines(rng, ";", ".", "\n", HEADERS[1]), MAPS[1])
        assert is_read
        slowest = 0.0
        for number in range(500):
            content = lines(rng, ";", ".", "\n", HEADERS[rng.integers(len(HEADERS))])
            content = DAMAGES[number % len(DAMAGES)](rng, content)
            slowest = max(slowest, seconds(content, MAPS[rng.integers(len(MAPS))])[0])
    yield (
        "damaged recording, the slowest of 500",
        "the recording without damage",
        slowest / whole,
        "at most 10 x as long",
    )


def designs():
    """18 I-optimal states of a thousand."""
    rng = np.random.default_rng(1)
    states = np.column_stack([rng.uniform(*limits, 1000) for limits in ((0.5, 0.9), (0.1, 0.5), (0.2, 0.4))])
    for form in (fm.CFM_3D, fm.LOG_SPEED):
        seconds = best(lambda form=form: optimal_states(states, 18, form=form), 3)
        yield f"18 I-optimal states of a thousand, {form.name}", "2 s", 2 / seconds, "at least 1 x"


def reports():
    """The report of 2,025 recordings, assessment and page together."""
    from pulses import collect, write_campaign

    with tempfile.TemporaryDirectory() as folder:
        campaign = write_campaign(Path(folder) / "many", repeats=75)
        collect(campaign)
        seconds = best(lambda: report_html(fm.assess_campaign(campaign)), 1)
    yield "report of 2,025 recordings", "a minute", 60 / seconds, "at least 1 x"
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "forcemap", "demo", f"{folder}/demo"]
        subprocess.run(command, check=True, capture_output=True)
        hand = [fm.force_limit("back_of_hand")]
        seconds = []
        for _ in range(6):
            start = time.process_time()
            report_html(fm.assess_campaign(f"{folder}/demo", limits=hand))
            seconds.append(time.process_time() - start)
    what = "the demo's report in a warm process, processor time"
    yield what, "2 s", 2 / min(seconds[1:]), "at least 1 x"


def dynamics():
    """Effective mass downwards of 10^5 UR10e configurations, per configuration, against a pinocchio loop over 2000."""
    n, few = 100_000, 2000
    robot = fm.robot_named("ur10e")
    q = np.random.default_rng(3).uniform(-np.pi, np.pi, (n, 6))
    model = _in_pinocchio(robot)
    data, down = model.createData(), np.array([0.0, 0.0, -1.0])
    tip = model.njoints - 1

    def loop():
        for each in q[:few]:
            pin.computeJointJacobians(model, data, each)
            lever = pin.getJointJacobian(model, data, tip, pin.LOCAL_WORLD_ALIGNED)[:3].T @ down
            inertia = pin.crba(model, data, each)
            1 / (lever @ np.linalg.solve(inertia, lever))

    # the tip of both is the last joint: flange and contact point of the UR10e lie in its origin
    seconds = best(lambda: robot_effective_mass(robot, q), 3)
    ratio = (best(loop, 3) / few) / (seconds / n)
    yield "effective mass, 10^5 UR10e configurations", "pinocchio Python loop, per configuration", ratio, "at least 2 x"


def _in_pinocchio(robot):
    """The same robot as a pinocchio model."""
    model = pin.Model()
    parent = 0
    for joint in robot.joints:
        kinds = {0: pin.JointModelRX, 1: pin.JointModelRY, 2: pin.JointModelRZ}
        place = pin.SE3(joint.origin.rotation, joint.origin.position)
        parent = model.addJoint(parent, kinds[int(np.argmax(joint.axis))](), place, joint.name)
        body = joint.body
        model.appendBodyToJoint(parent, pin.Inertia(body.mass, body.centre_of_mass, body.inertia), pin.SE3.Identity())
    return model


def lab():
    """125 simulated impacts of the paper's grid: seconds asked over seconds taken, the postures included."""
    robot = virtual_robot("ur10e-like")
    figures = fm.published_map("ur10e").measured_range.points.T
    whole, peaks = best(lambda: simulate_impacts(robot, *figures), 3), best(lambda: simulate_peaks(robot, *figures), 3)
    yield "125 simulated impacts of 1 s, all of the course", "5 s", 5 / whole, "at least 1 x"
    yield "125 simulated impacts, peaks alone", "1 s", 1 / peaks, "at least 1 x"


def paths():
    """10^6 path points through map, tolerance bound and limit, against a brentq loop over the public scalar bound."""
    n, few = 1_000_000, 30
    rng = np.random.default_rng(2)
    d, h = rng.uniform(0.6, 0.89, n), rng.uniform(0.3, 0.46, n)
    force_map = fm.fit_force_map(fm.read_dataset(Path(fm.__file__).parent / "campaigns" / "examples" / "ur10e"))
    bound = fm.ToleranceBound()
    case = {"limit": 280.0, "bound": bound, "hints": False}
    speeds = fm.safe_speed(force_map, d, h, **case).speed
    crossed = np.flatnonzero((speeds > 0.2) & (speeds < 0.399))[:few]
    roots = []

    def loop():
        roots.clear()
        for i in crossed:
            roots.append(brentq(lambda v, i=i: bound.upper(force_map, d[i], h[i], v) - 280.0, 0.2, 0.4, xtol=1e-13))

    ours = best(lambda: fm.safe_speed(force_map, d, h, **case), 3) / n
    ratio = best(loop, 2) / few / ours
    below = np.array(roots) - speeds[crossed]
    assert (below > 0).all(), "a speed lies above its crossing"
    yield (
        "safe speed, 10^6 path points, tolerance bound",
        "scipy brentq loop, per point",
        ratio,
        "at least 500 x as fast",
    )
    yield "the same: furthest below the exact crossing [mm/s]", "brentq", 1000 * below.max(), "at most 0.001"
    zones = fm.zone_grid(force_map.measured_range, 0.05)
    seconds = best(lambda: fm.zone_speeds(force_map, zones, limit=280.0, bound=bound), 3)
    yield f"zones of 5 cm, whole workspace ({len(zones)})", "one second", 1 / seconds, "at least 1 x as fast"


def web():
    """The web page's answer to a slider: the bound over 10^4 places and all that stands beside it, as JSON."""
    with tempfile.TemporaryDirectory() as folder:
        fitted = fitted_campaign(fm.copy_example("ur10e", Path(folder) / "ur10e"))
        question = State(distance_m=0.7, height_m=0.3, speed_mps=0.3)
        seconds = best(lambda: slices_answer(CampaignMap(fitted, Limits(None)), question).model_dump_json())
    yield (
        "web page: a slider's answer, 10^4 places, tolerance bound",
        "a tenth of a second",
        0.1 / seconds,
        "at least 1 x",
    )


def pages():
    """The web page in Chromium: until the slowest of its parts is seen; the longest frame while points are turned."""
    from playwright.sync_api import sync_playwright

    from web_server import serving

    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        return
    painted = (
        "new Promise(done => new PerformanceObserver(list => done(list.getEntries()[0].startTime))"
        ".observe({type: 'paint', buffered: true}))"
    )
    frames = (
        "() => { let last = performance.now(); window.frames_ms = [];"
        "const next = now => { frames_ms.push(now - last); last = now; requestAnimationFrame(next) };"
        "requestAnimationFrame(next) }"
    )
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as started:
        fm.copy_example("ur10e", Path(folder) / "ur10e")
        with serving(folder) as (_, address, token):
            page = started.chromium.launch(executable_path=chromium, args=["--no-sandbox"]).new_page(base_url=address)
            page.goto(f"/?token={token}")
            seen = []
            for part in ("", "/map", "/speeds", "/compare", "/task", "/downloads"):
                times = []
                for _ in range(3):
                    page.goto(f"/campaigns/ur10e{part}")
                    times.append(page.evaluate(painted) / 1000)
                seen.append(min(times))
            page.goto("/campaigns/ur10e/map")
            page.locator("#workspace").scroll_into_view_if_needed()  # it is asked for where it is seen
            page.wait_for_selector("#workspace[data-points]")
            page.wait_for_load_state("networkidle")
            box = page.locator("#workspace").bounding_box()
            x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
            longest = []
            for _ in range(3):
                page.mouse.move(x, y)
                page.mouse.down()
                page.evaluate(frames)
                for i in range(30):
                    page.mouse.move(x + 3 * i, y + i)
                    page.wait_for_timeout(10)
                longest.append(max(page.evaluate("frames_ms.slice(1)")) / 1000)
                page.mouse.up()
    yield "web page: first paint, the slowest of its parts", "2 s", 2 / max(seen), "at least 1 x"
    yield "web page: longest frame while 10^5 points are turned", "200 ms", 0.2 / min(longest), "at least 1 x"


def starting():
    """From a command to its answer, beside a program that only imports what such a command cannot do without."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.json"
        fm.write_map(
            fm.fit_force_map(fm.read_dataset(fm.copy_example("ur10e", Path(folder) / "ur10e") / "impacts.csv")), path
        )
        place = ["--distance", "0.8", "--height", "0.4", "--area", "back_of_hand", "--contact", "transient"]

        def seconds(*arguments):
            return best(lambda: subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL))

        for what, arguments, imports, asked in (
            ("forcemap --help", ["--help"], "numpy, typer", "at most 1.3 x as long"),
            ("forcemap speed", ["speed", str(path), *place], "numpy, scipy.special, typer", "at most 2 x as long"),
        ):
            ratio = seconds("-m", "forcemap", *arguments) / seconds("-c", f"import {imports}")
            yield f"{what}, from start to end", f'python -c "import {imports}"', ratio, asked


def main() -> None:
    """Run all benchmarks and print or write the table."""
    lines = ["| what | peer | ratio | asked |", "|---|---|---|---|"]
    for benchmark in BENCHMARKS:
        for what, peer, ratio, asked in benchmark():
            lines.append(f"| {what} | {peer} | {ratio:.1f} | {asked} |")
    processor = next(
        (line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line),
        platform.processor(),
    )
    versions = {
        "numpy": np,
        "scipy": scipy,
        "scikit-learn": sklearn,
        "statsmodels": statsmodels,
        "pinocchio": pin,
    }
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


BENCHMARKS = (
    prediction,
    grid,
    crossing,
    bounding,
    fitting,
    recordings,
    collecting,
    damaged,
    designs,
    dynamics,
    lab,
    paths,
    reports,
    web,
    pages,
    starting,
)

if __name__ == "__main__":
    main()
