from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

import forcemap as fm
from real_data import FOLDER, REASON

settings.register_profile("forcemap", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("forcemap")


@pytest.fixture(scope="session")
def full_size() -> bool:
    """True under `make validity`: the long runs at full size."""
    return os.environ.get("FORCEMAP_VALIDITY") == "full"


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
