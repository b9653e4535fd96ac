"""Bundled example campaigns, all simulated (scripts/make_examples.py), and a robot's task that fits them."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from forcemap.errors import UnknownName
from forcemap.files import new_folder, write_atomically

EXAMPLE_CAMPAIGNS = ("ur10e", "kuka-iiwa7-30nm", "kuka-iiwa7-10nm")

_FILES = ("campaign.toml", "impacts.csv")
_TASK_FILES = ("path.csv", "task.toml", "table_path.csv")


def copy_example(name: str, folder: str | Path) -> Path:
    """Copy an example campaign, and `copy_task`'s files, into a new or empty folder, and return the folder.

    Raises
    ------
    UnknownName
        No example has the name.
    InputError
        The folder holds files already, or cannot be made.
    """
    if name not in EXAMPLE_CAMPAIGNS:
        raise UnknownName("example campaign", name, EXAMPLE_CAMPAIGNS)
    target = new_folder(folder)
    for file in _FILES:
        write_atomically(target / file, resources.files(__name__).joinpath(name, file).read_text(encoding="utf-8"))
    copy_task(target)
    return target


def copy_task(folder: str | Path) -> None:
    """Write a robot's path, its task, and a path in the frame of a table, for places that every example measured."""
    for file in _TASK_FILES:
        write_atomically(Path(folder, file), resources.files(__name__).joinpath(file).read_text(encoding="utf-8"))
