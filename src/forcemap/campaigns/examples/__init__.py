"""Bundled example campaigns, all simulated (scripts/make_examples.py), and a robot's task that fits them."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from forcemap.errors import UnknownName
from forcemap.files import new_folder, write_atomically

EXAMPLE_CAMPAIGNS = ("ur10e", "kuka-iiwa7-30nm", "kuka-iiwa7-10nm")

CLAMPING_EXAMPLES = ("kuka-iiwa7-30nm", "kuka-iiwa7-10nm")
"""Those whose impacts clamp, for which no transient limit may be used: what is asked of them is quasi-static."""

_FILES = ("campaign.toml", "impacts.csv")
_PATH_FILES = ("path.csv", "table_path.csv")


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
    copy_task(name, target)
    return target


def copy_task(name: str, folder: str | Path) -> None:
    """Write a robot's path, the example's task, and a path in the frame of a table, for places that all measured."""
    task = "clamping_task.toml" if name in CLAMPING_EXAMPLES else "task.toml"
    for file, source in [*((file, file) for file in _PATH_FILES), ("task.toml", task)]:
        write_atomically(Path(folder, file), resources.files(__name__).joinpath(source).read_text(encoding="utf-8"))
