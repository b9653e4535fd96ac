"""What is compiled with the extra `fast` gives what numpy gives, and is never needed."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from oracle import full_grid

import forcemap as fm
from forcemap import arrays, compiled
from forcemap.dynamics import kernels as dynamics
from forcemap.dynamics.mass_map import robot_effective_mass
from forcemap.dynamics.rigid_body import NOTHING
from forcemap.errors import InputError
from forcemap.lab import kernels as lab
from forcemap.lab.bench import simulate_impacts, simulate_peaks
from forcemap.lab.course import first_peaks, force_course, phase_one_peaks
from forcemap.lab.virtual_robot import PRESETS, virtual_robot
from forcemap.maps import kernels as maps
from forcemap.maps.forms import FORMS
from forcemap.maps.measured_range import MeasuredRange
from sizes import FULL_SIZE
from test_import_directions import ROOT, loaded_by
from test_robot import GANTRY

MANY = maps.LEAST
BUNDLED = (*fm.PUBLISHED_MAPS, *fm.EXAMPLE_CAMPAIGNS)


def same(a, b):
    """Equal to the last bit; a NaN is a NaN."""
    np.testing.assert_array_equal(np.isnan(a), np.isnan(b))
    np.testing.assert_array_equal(a[~np.isnan(a)].view(np.int64), b[~np.isnan(b)].view(np.int64))


def places(n=MANY, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(0.3, 1.1, n), rng.uniform(0.0, 0.7, n), rng.uniform(0.0, 1.0, n)


def a_map(form, seed=0):
    coefficients = np.random.default_rng(seed).normal(0, 2, len(form.terms)) + 4.0 * np.eye(len(form.terms))[0]
    return fm.ForceMap("own", form, coefficients, MeasuredRange(full_grid("ur10e")))


def by_kernel(function, force_map, rows, by_numpy, *arguments):
    """The result, and how many points numpy was asked for."""
    asked = []

    def counted(*parts):
        result = by_numpy(*parts)
        asked.append(result.size)
        return result

    return function(force_map.form, rows, counted, *arguments), sum(asked)


def all_three(force_map, d, h, v, force):
    """(by the kernel, by numpy, points numpy was asked for) of force, crossing speed and, of a fitted map, leverage."""
    cases = [
        (maps.force, force_map.coefficients, force_map._force, v),
        (maps.crossing_speed, force_map.coefficients, force_map._crossing_speed, force),
    ]
    if force_map.fit is not None:
        cases.append((maps.leverage, force_map._leverage_rows(), force_map._leverage, v))
    for function, rows, by_numpy, third in cases:
        found, asked = by_kernel(function, force_map, rows, by_numpy, d, h, third)
        yield found, arrays.in_blocks(by_numpy, d, h, third), asked


@pytest.mark.parametrize("name", BUNDLED)
def test_bundled_maps_bit_for_bit(name, examples):
    force_map = fm.published_map(name) if name in fm.PUBLISHED_MAPS else fm.fit_force_map(examples[name])
    d, h, v = places(MANY + 12_345)
    for third in (np.full(d.shape, 140.0), np.array([280.0]), np.array(90.0), 20 + 600 * v):
        for found, expected, asked in all_three(force_map, d, h, v, third):
            same(found, expected)
            assert asked == 1024
    for third in (0.3, np.array([[0.25]])[0]):
        same(force_map.predict(d, h, third), arrays.in_blocks(force_map._force, d, h, third))


@pytest.mark.parametrize(
    "terms",
    [
        ["1", "v"],
        ["v^2"],
        ["d*h^2", "d^2*h^2", "d^2*v^2"],
        ["1", "h", "v", "d*v"],
        *(form.term_names for form in FORMS[:2]),
    ],
    ids="+".join,
)
def test_forms_like_these_bit_for_bit(terms):
    d, h, v = places()
    for seed in range(3):
        force_map = a_map(fm.Form.of("own", terms), seed)
        for found, expected, asked in all_three(force_map, d, h, v, 50 + 400 * v):
            same(found, expected)
            assert asked == 1024


@pytest.mark.parametrize("form", [*FORMS[2:], fm.Form.of("own", ["1", "v*h"]), fm.Form.of("own", ["1", "d^3", "v"])])
def test_other_forms_are_numpys(form):
    d, h, v = places()
    for found, expected, asked in all_three(a_map(form), d, h, v, 100 + v):
        same(found, expected)
        assert asked == d.size


STRANGE = [np.inf, -np.inf, np.nan, 0.0, -0.0, 1e308, -1e308, 1e-308, 5e-324, 1e155, -1e155, 1e103, 1e6]


@pytest.mark.parametrize("where", ["first", "in the middle", "last", "everywhere"])
def test_infinite_missing_and_huge_values(where):
    rng = np.random.default_rng(5)
    d, h, v = places()
    some = {"first": 7, "in the middle": MANY // 2, "last": MANY - 1, "everywhere": slice(None, None, 3)}[where]
    maps_ = [fm.published_map("ur10e"), *(a_map(form, seed) for form in FORMS[:2] for seed in range(2))]
    for force_map in maps_:
        for axis in range(3):
            points = [d.copy(), h.copy(), v.copy()]
            points[axis][some] = rng.choice(STRANGE, points[axis][some].shape)
            force = np.array([140.0])
            with np.errstate(all="ignore"):
                same(force_map.predict(*points), arrays.in_blocks(force_map._force, *points))
                expected = arrays.in_blocks(force_map._crossing_speed, *points[:2], force)
                same(force_map.crossing_speed(*points[:2], force), expected)
    same(*(maps_[0].crossing_speed(d[:n], h[:n], 5e-324)[:1000] for n in (MANY, 1000)))


def test_arrays_of_any_kind():
    force_map = fm.published_map("kuka-iiwa7-30nm")
    d, h, v = places(2 * MANY)
    expected = arrays.in_blocks(force_map._force, d, h, v)
    frozen = [a.copy() for a in (d, h, v)]
    for a in frozen:
        a.setflags(write=False)
    same(force_map.predict(*frozen), expected)
    same(force_map.predict(d[::2], h[::2], v[::2]), expected[::2])
    same(force_map.predict(d[::-1], h[::-1], v[::-1]), expected[::-1])
    packed = np.zeros(2 * MANY, dtype=[("tag", "u1"), ("d", "f8")])
    packed["d"] = d
    assert not packed["d"].flags.aligned
    same(force_map.predict(packed["d"], h, v), expected)
    same(force_map.predict(d.astype(">f8"), h, v), expected)
    wide = [a.reshape(4, -1, 2) for a in (d, h, v)]
    same(force_map.predict(*wide), expected.reshape(4, -1, 2))
    same(force_map.predict(*(a.T for a in wide)), expected.reshape(4, -1, 2).T)
    single = d.astype(np.float32)
    same(force_map.predict(single, h, v), arrays.in_blocks(force_map._force, single, h, v))
    listed = force_map.predict(d, h, v.tolist())
    same(listed, expected)
    assert force_map.predict(np.empty(0), np.empty(0), 0.3).shape == (0,)
    masked = np.ma.masked_array(d, mask=np.arange(d.size) == 3)
    with pytest.raises(InputError, match="masked"):
        force_map.predict(masked, h, v)
    with pytest.raises(ValueError, match="broadcast"):
        force_map.predict(d, h[:-1], v)


def test_what_differs_from_numpy_is_numpys():
    """As from a compiler that errs."""
    force_map = fm.published_map("ur10e")
    d, h, v = places()

    def other(*arguments):
        return np.nextafter(force_map._force(*arguments), np.inf)

    same(maps.force(force_map.form, force_map.coefficients, other, d, h, v), arrays.in_blocks(other, d, h, v))


@pytest.fixture(scope="module")
def gantry(tmp_path_factory):
    path = tmp_path_factory.mktemp("gantry") / "gantry.urdf"
    path.write_text(GANTRY)
    return fm.read_urdf(path, tip="pad")


def in_parts(robot, q, direction):
    """The same by numpy: fewer at a time."""
    parts = [robot_effective_mass(robot, q[i : i + 40_000], direction) for i in range(0, len(q), 40_000)]
    return np.concatenate([part.value for part in parts]), np.concatenate([part.outcome for part in parts])


@pytest.mark.parametrize("name", ["ur10e", "kuka-iiwa7", "geared", "gantry"])
def test_effective_mass_to_rounding(name, gantry):
    if name == "geared":
        robot = (
            fm.robot_named("ur10e")
            .with_drive_inertia(np.full(6, 0.5))
            .with_payload(mass=3.0, centre_of_mass=[0, 0, 0.1])
        )
    else:
        robot = gantry if name == "gantry" else fm.robot_named(name)
    q = np.random.default_rng(3).uniform(-3, 3, (dynamics.LEAST + 77, len(robot.joints)))
    q[:20] = 0.0  # stretched out: singular, or without motion
    q[20:40, 1:] = 0.0
    q[40:60] *= 1e-5
    by_numpy = np.arange(len(q)) if FULL_SIZE else np.r_[:100, 100 : len(q) : 25]
    outcomes = set()
    for direction in [(0, 0, -1), (1, 2, 3), (1, 0, 0)] if FULL_SIZE or name == "kuka-iiwa7" else [(1, 2, 3)]:
        found = robot_effective_mass(robot, q, direction)
        value, outcome = in_parts(robot, q[by_numpy], direction)
        np.testing.assert_array_equal(found.outcome[by_numpy], outcome)
        np.testing.assert_allclose(found.value[by_numpy], value, rtol=1e-10)
        outcomes |= set(outcome)
        along = np.array(direction) / np.linalg.norm(direction)
        by_kernel = dynamics.many_masses(robot, q, along, 1e-5, 1e-14)
        assert np.isfinite(by_kernel).mean() > 0.99
        rising = np.isfinite(by_kernel)
        np.testing.assert_array_equal(found.value[rising], by_kernel[rising])
    assert name != "kuka-iiwa7" or len(outcomes) > 1  # straight up it loses a direction
    grid = robot_effective_mass(robot, q[:50_000].reshape(50, 1000, -1))
    assert grid.value.shape == grid.outcome.shape == (50, 1000)


def test_a_joint_without_inertia_is_refused_as_by_numpy():
    robot = fm.robot_named("ur10e")
    last = replace(robot.joints[-1], body=NOTHING)
    robot = replace(robot, joints=(*robot.joints[:-1], last), drive_inertia=None)
    q = np.random.default_rng(3).uniform(-3, 3, (dynamics.LEAST, 6))
    messages = []
    for some in (q, q[:100]):
        with pytest.raises(InputError, match="joint 6 of 6 moves no inertia") as error:
            robot_effective_mass(robot, some)
        messages.append(str(error.value))
    assert messages[0] == messages[1]


@pytest.mark.parametrize("preset", PRESETS)
def test_simulated_impacts_bit_for_bit(preset):
    """Robots that notice at once, late and never; reactions without delay; loads; other steps and directions."""
    robot = virtual_robot(preset)
    quick = replace(robot, reaction=replace(robot.reaction, delay=0.0, threshold=0.5))
    rng = np.random.default_rng(8)
    d, h = np.tile(np.sort(rng.uniform((0.6, 0.2), (0.75, 0.4), (9, 2)), axis=0), (15, 1)).T  # posed in the same order
    v = rng.uniform(0.05, 0.5, d.size)
    robots = (robot, quick, robot.with_threshold(1e6), robot.with_threshold(60.0).with_payload(2.0))
    for each in robots if FULL_SIZE or preset == next(iter(PRESETS)) else robots[::3]:
        setup = each.impact_setup(each.posed_at(d[:9], h[:9]), 75_000.0).at_places(np.arange(d.size) % 9)
        found = simulate_impacts(each, d, h, v)
        assert d.size * found.time.size >= lab.LEAST
        expected = force_course(setup, v, duration=1.0)
        assert (expected > 0).any()
        same(found.force, expected)
        same(found.peak_force, first_peaks(expected))
        same(simulate_peaks(each, d, h, v), phase_one_peaks(setup, v))
        few = simulate_impacts(each, d[:9], h[:9], v[:9])
        same(few.force, expected[:, :9])
    sideways = {"direction": (1.0, 0.5, -0.5), "step": 1e-4, "duration": 0.7}
    whole = simulate_impacts(robot, d, h, v, **sideways)
    body = np.where(np.arange(d.size) % 3, 2.0 + d, np.inf)  # free body parts, and a fixed device
    free = simulate_impacts(robot, d, h, v, body_mass=body)
    same(free.force[:, :9], simulate_impacts(robot, d[:9], h[:9], v[:9], body_mass=body[:9]).force)
    assert (free.peak_force[body < 9] < simulate_impacts(robot, d, h, v).peak_force[body < 9]).all()
    same(simulate_peaks(robot, d, h, v, body_mass=3.0)[:9], simulate_peaks(robot, d[:9], h[:9], v[:9], body_mass=3.0))
    same(whole.force[:, :9], simulate_impacts(robot, d[:9], h[:9], v[:9], **sideways).force)


def test_many_peaks_at_once():
    robot = virtual_robot("iiwa7-like-30nm")
    d, h, v = np.random.default_rng(9).uniform((0.55, 0.2, 0.05), (0.75, 0.4, 0.5), (3000, 3)).T
    parts = [simulate_peaks(robot, d[i : i + 100], h[i : i + 100], v[i : i + 100]) for i in range(0, 3000, 100)]
    same(simulate_peaks(robot, d, h, v), np.concatenate(parts))


FLOORED = """
import hashlib, sys
from pathlib import Path
import numpy as np
import forcemap as fm
count = int(sys.argv[1])
digest = hashlib.sha256()
for i, name in enumerate((*fm.PUBLISHED_MAPS, *fm.EXAMPLE_CAMPAIGNS)):
    published = name in fm.PUBLISHED_MAPS
    examples = Path(fm.__file__).parent / "campaigns" / "examples"
    force_map = fm.published_map(name) if published else fm.fit_force_map(fm.read_dataset(examples / name))
    bound = fm.FixedMargin(0.10) if published else fm.ToleranceBound()
    low, high = force_map.measured_range.lowest, force_map.measured_range.highest
    d, h, _ = np.random.default_rng(i).uniform(low - 0.02, high + 0.02, (count, 3)).T
    given = 0
    for limit in (140.0, 200.0, 280.0):
        found = fm.safe_speed(
            force_map, d, h, limit=limit, contact=fm.Contact.QUASI_STATIC, bound=bound, hints=False
        )
        given += np.isfinite(found.speed).sum()
        digest.update(np.floor(found.speed * 1000).tobytes())
        digest.update("".join(found.outcome.tolist()).encode())
    assert given > count / 5, given
    many = max(count, 600_000)
    d, h, v = np.random.default_rng(i).uniform(low - 0.2, high + 0.2, (many, 3)).T
    digest.update(np.nan_to_num(np.floor(force_map.crossing_speed(d, h, 140.0) * 1000), nan=-1).tobytes())
    digest.update(force_map.predict(d, h, v).tobytes())
    digest.update(bound.upper(force_map, d, h, v).tobytes())
print(digest.hexdigest(), "numba" in sys.modules)
"""


def program(code, *arguments, **environment):
    """What a program prints, in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code, *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    return done.stdout.split()


def test_floored_speeds_with_and_without():
    """On 10^6 random places of every bundled map under `make validity`; bounds and forces to the last bit besides."""
    count = str(1_000_000 if FULL_SIZE else 100_000)
    fast, loaded = program(FLOORED, count)
    slow, _ = program(FLOORED, count, NUMBA_DISABLE_JIT="1")
    assert loaded == "True"
    assert fast == slow


PREDICT = """
import sys
import numpy as np
import forcemap as fm
from forcemap import compiled
from forcemap.maps import kernels
n = kernels.LEAST
d, h, v = np.random.default_rng(0).uniform(0.2, 0.8, (3, n))
force_map = fm.published_map("ur10e")
found = force_map.predict(d, h, v)
assert np.array_equal(found[:1000], force_map.predict(d[:1000], h[:1000], v[:1000]))
assert np.array_equal(found[-1000:], force_map.predict(d[-1000:], h[-1000:], v[-1000:]))
run = compiled.kernel(kernels._log_force, "F1 F1 F1 F1 F1")
print(run is not None, sum(run.stats.cache_hits.values()) if run else 0)
"""


@pytest.mark.parametrize("what", ["missing", "broken", "switched off", "too old"])
def test_without_numba_numpy_computes(what, tmp_path):
    texts = {
        "missing": "raise ImportError",
        "broken": "raise RuntimeError('libLLVM')",
        "too old": "__version__ = '0.1'",
    }
    if what == "switched off":
        assert program(PREDICT, NUMBA_DISABLE_JIT="1") == ["False", "0"]
        return
    (tmp_path / "numba.py").write_text(texts[what])
    path = os.pathsep.join(filter(None, [str(tmp_path), os.environ.get("PYTHONPATH")]))
    assert program(PREDICT, PYTHONPATH=path) == ["False", "0"]


def test_what_loads_numba():
    start = "import numpy as np\nimport forcemap as fm\nmany = np.linspace(0.2, 0.8, 600_000)\n"
    start += "force_map, grid = fm.published_map('ur10e'), np.linspace(0.2, 0.8, 100)\n"
    few = (
        "force_map.predict(many[:500_000], many[:500_000], many[:500_000])\nforce_map.crossing_speed(0.8, 0.4, 140.0)\n"
    )
    few += "force_map.predict(grid[:, None, None], grid[:, None], grid)\nforce_map.predict(0.8, 0.4, many)\n"
    few += "fm.ForceMap('own', fm.LOG_SPEED, np.ones(10), force_map.measured_range).predict(many, many, many)\n"
    few += "fm.robot_effective_mass_at(fm.robot_named('ur10e'), grid / 2 + 0.4, 0.3)\n"
    modules = loaded_by(start + few)
    assert not {"numba", "llvmlite"} & modules
    assert "numba" in loaded_by(start + "force_map.predict(many, many, many)")
    assert "numba" not in loaded_by("from forcemap.cli.app import run\nassert run(['--help']) == 0")


def test_one_file_alone_names_numba():
    naming = {
        p.name
        for p in ROOT.rglob("*.py")
        if re.search(r"^\s*(import|from) numba|import_module\(.numba", p.read_text(), re.M)
    }
    assert naming == {"compiled.py"}


TRIPLED = """
def tripled(a, b):
    for i in range(a.size):
        b[i] = 3.0 * a[i]
"""


def compile_of(path, arguments="F1 F1"):
    """The function of a file compiled as by a new process, and how many of its kept files were used; it works."""
    spec = importlib.util.spec_from_file_location("own", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    run = compiled.kernel.__wrapped__(module.tripled, arguments)
    a, b = np.arange(5.0), np.zeros(5)
    run(a, b)
    return b.tolist(), sum(run.stats.cache_hits.values())


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "source" / "own.py"
    path.parent.mkdir()
    path.write_text(TRIPLED)
    return path


THREEFOLD = [0.0, 3.0, 6.0, 9.0, 12.0]


def test_what_is_compiled_is_kept_until_the_source_changes(own):
    assert compile_of(own) == (THREEFOLD, 0)
    assert compile_of(own) == (THREEFOLD, 1)
    own.write_text(TRIPLED.replace("3.0", "5.00"))
    assert compile_of(own) == ([5 * x for x in range(5)], 0)
    assert compile_of(own) == ([5 * x for x in range(5)], 1)


DAMAGES = {
    "empty": lambda content: b"",
    "half": lambda content: content[: len(content) // 2],
    "zeros": lambda content: bytes(len(content)),
    "other": lambda content: b"nothing of this kind",
    "a bit": lambda content: content[:-200] + bytes([content[-200] ^ 1]) + content[-199:],
    "more": lambda content: content + b"more",
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_damaged_files_are_made_again(own, damage, kind):
    compile_of(own)
    (kept,) = (own.parent / "__pycache__").glob(f"*.{kind}")
    kept.write_bytes(DAMAGES[damage](kept.read_bytes()))
    result, _ = compile_of(own)
    assert result == THREEFOLD
    assert compile_of(own) == (THREEFOLD, 1)


def test_kept_code_of_another_source_is_not_run(own):
    """The index is of this source, the code is not: as left by a process that was killed between both."""
    compile_of(own)
    (kept,) = (own.parent / "__pycache__").glob("*.nbc")
    old = kept.read_bytes()
    own.write_text(TRIPLED.replace("3.0", "5.00"))
    compile_of(own)
    kept.write_bytes(old)
    assert compile_of(own) == ([5 * x for x in range(5)], 0)


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """A copy of the package without anything that numba compiled."""
    home = tmp_path_factory.mktemp("copied")
    shutil.copytree(ROOT, home / "forcemap", ignore=shutil.ignore_patterns("*.nbi", "*.nbc"))
    return home


def test_where_nothing_can_be_written_every_process_compiles(copied, tmp_path):
    blocked = copied / "forcemap" / "maps" / "__pycache__"
    shutil.rmtree(blocked, ignore_errors=True)
    blocked.write_text("a file, so that no folder can be made here; permissions do not stop the superuser")
    (tmp_path / "home").write_text("nor here")
    nowhere = {"HOME": str(tmp_path / "home"), "XDG_CACHE_HOME": str(tmp_path / "home"), "PYTHONPATH": str(copied)}
    for _ in range(2):
        assert program(PREDICT, **nowhere) == ["True", "0"]
    user = {"HOME": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache"), "PYTHONPATH": str(copied)}
    assert program(PREDICT, **user) == ["True", "0"]
    assert program(PREDICT, **user) == ["True", "1"]
    blocked.unlink()


def test_processes_that_compile_at_once(copied):
    environment = {**os.environ, "PYTHONPATH": str(copied)}
    line = [sys.executable, "-W", "error", "-c", PREDICT]
    started = [subprocess.Popen(line, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    for each in started:
        assert each.communicate()[0].split()[0] == "True"
        assert each.returncode == 0
    assert program(PREDICT, PYTHONPATH=str(copied)) == ["True", "1"]
