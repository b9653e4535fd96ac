from __future__ import annotations

import atexit
import contextlib
import csv
import dataclasses
import fcntl
import gc
import io
import json
import os
import shutil
import tempfile
from pathlib import Path

# One process a core already: more threads for matrices this small only wait for each other. Before numpy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# The secret that campaigns' memories are sealed with, not in the account's own folder.
os.environ["XDG_STATE_HOME"] = tempfile.mkdtemp(prefix="forcemap-state-")
# The register that is used if none is named, neither.
os.environ["XDG_DATA_HOME"] = str(Path(os.environ["XDG_STATE_HOME"], "data"))
os.environ.pop("FORCEMAP_REGISTER", None)

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

import forcemap as fm
from real_data import FOLDER, REASON
from sizes import FULL_SIZE

atexit.register(shutil.rmtree, os.environ["XDG_STATE_HOME"], ignore_errors=True)
settings.register_profile(
    "forcemap",
    max_examples=100 if FULL_SIZE else 40,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("forcemap")


def other_impacts(folder):
    """Make a copied campaign one of other impacts, without their register: an atlas takes no impact twice."""
    (folder / "recordings.csv").unlink(missing_ok=True)
    rng = np.random.default_rng(1)
    with (folder / "impacts.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        factor = float(np.exp(rng.normal(0, 0.01)))
        for name in ("peak_force_N", "raw_peak_N"):
            if row.get(name):
                row[name] = f"{factor * float(row[name]):.2f}"
    with (folder / "impacts.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


LONGEST = (
    "web_browser",
    "web_points_browser",
    "register",
    "kernels",
    "documentation",
    "contact_sheets",
    "web",
    "fleet",
)
LONGEST += ("doors", "contact_points", "sweeps", "tilted_paths", "killed", "next_measurements", "atlas_commands")


def pytest_collection_modifyitems(items):
    """Files that take longest first: none of them begins when the others are done."""
    order = {f"test_{name}": number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path.stem, len(order)))


def pytest_collection_finish():
    """What all files import lives to the end: the collector need not look through it again and again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def full_size() -> bool:
    """True under `make validity`: the long runs at full size."""
    return FULL_SIZE


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of real recordings."""
    if not FOLDER.is_dir():
        pytest.skip(REASON)
    return FOLDER


@pytest.fixture(scope="session")
def example_folders(tmp_path_factory):
    root = tmp_path_factory.mktemp("examples")
    return {name: fm.copy_example(name, root / name) for name in fm.EXAMPLE_CAMPAIGNS}


@pytest.fixture(scope="session")
def examples(example_folders):
    return {name: fm.read_dataset(folder) for name, folder in example_folders.items()}


@pytest.fixture(scope="session")
def paper_grids(examples):
    """The states of the examples that lie on the paper's grids, of which 27 train."""
    return {name: on_the_papers_grid(dataset) for name, dataset in examples.items()}


def on_the_papers_grid(dataset):
    axes = [
        (getattr(dataset, name), np.unique(getattr(dataset.test, name))) for name in ("distance", "height", "speed")
    ]
    train = np.all([np.isin(each, levels[::2]) for each, levels in axes], axis=0)
    on_grid = np.all([np.isin(each, levels) for each, levels in axes], axis=0) & (dataset.repeat <= 3)
    return dataclasses.replace(dataset, role=np.where(train, "train", "test")).select(on_grid)


def made_once(tmp_path_factory, name, make):
    """A folder that the first who asks makes, for all files and processes of a run. Whoever changes it takes a copy."""
    home = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        home = home.parent
    with (home / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (home / name).exists():
            part = home / f"{name}.part"
            shutil.rmtree(part, ignore_errors=True)
            make(part)
            part.rename(home / name)
    return home / name


@pytest.fixture(scope="session")
def simulated(tmp_path_factory):
    """The simulated ur10e example of 90 recordings, collected."""
    from forcemap.lab.example_campaigns import simulate_example

    def make(folder):
        simulate_example("ur10e", folder)
        fm.build_dataset(fm.read_campaign(folder))

    return made_once(tmp_path_factory, "simulated", make)


@pytest.fixture(scope="session")
def demo(tmp_path_factory):
    """Where `forcemap demo` ran: what it printed, and cell/, in which forcemap-demo was taken already."""
    from forcemap.cli.app import run

    def make(folder):
        (folder / "cell" / "forcemap-demo").mkdir(parents=True)
        (folder / "cell" / "forcemap-demo" / "mine.txt").write_text("kept")
        out = io.StringIO()
        with contextlib.chdir(folder / "cell"), contextlib.redirect_stdout(out):
            assert run(["demo"]) == 0
        (folder / "printed.txt").write_text(out.getvalue())

    return made_once(tmp_path_factory, "demo", make)


@pytest.fixture
def forcemap(capsys):
    """Run a command in this process: (exit code, stdout, stderr)."""
    from forcemap.cli.app import run

    def call(*arguments):
        code = run([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return code, out, err

    return call


@pytest.fixture
def ask(forcemap):
    """Run a command with --json: (exit code, object). What goes wrong is one line."""

    def call(*arguments):
        code, out, err = forcemap(*arguments, "--json")
        assert err == "" or (err.startswith("error: ") and err.count("\n") == 1)
        return code, json.loads(out)

    return call
