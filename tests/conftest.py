from __future__ import annotations

import os

import pytest
from hypothesis import HealthCheck, settings

import forcemap as fm

settings.register_profile("forcemap", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("forcemap")


@pytest.fixture(scope="session")
def full_size() -> bool:
    """True under `make validity`: the long runs at full size."""
    return os.environ.get("FORCEMAP_VALIDITY") == "full"


@pytest.fixture(scope="session")
def example_folders(tmp_path_factory):
    root = tmp_path_factory.mktemp("examples")
    return {name: fm.copy_example(name, root / name) for name in fm.EXAMPLE_CAMPAIGNS}


@pytest.fixture(scope="session")
def examples(example_folders):
    return {name: fm.read_dataset(folder) for name, folder in example_folders.items()}
