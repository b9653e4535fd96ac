"""The files that a campaign's result rests on, each with its SHA-256."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from forcemap.campaigns.campaign import RECORDINGS_FOLDER
from forcemap.campaigns.conditions import CAMPAIGN_FILE
from forcemap.campaigns.impacts_table import PLAN_FILE, TABLE_FILE
from forcemap.campaigns.recordings_table import REGISTER_FILE
from forcemap.errors import InputError
from forcemap.files import file_sha256, sha256

_FILES = (CAMPAIGN_FILE, PLAN_FILE, REGISTER_FILE, TABLE_FILE)
_FOLDERS = ("maps", RECORDINGS_FOLDER)


@dataclass(frozen=True)
class InputFile:
    """A file of a campaign.

    Parameters
    ----------
    path : str
        Below the campaign's folder, with slashes.
    sha256 : str
        Of its content, in hexadecimal; empty if it cannot be read.
    """

    path: str
    sha256: str


def campaign_inputs(folder: str | Path, *, further: Iterable[str] = ()) -> tuple[InputFile, ...]:
    """The files that a campaign's result rests on: campaign.toml, the plan, register and table, maps, recordings.

    Hidden files are left alone, and a link that leads to no file is none.

    Parameters
    ----------
    folder : str or Path
        The campaign's folder.
    further : iterable of str
        Paths of further files, below the folder.

    Raises
    ------
    InputError
        There is no such folder.
    """
    home = Path(folder)
    if not home.is_dir():
        raise InputError("there is no such folder", file=str(folder))
    found = {name: home / name for name in (*_FILES, *further) if (home / name).is_file()}
    for name in _FOLDERS:
        for path in (home / name).rglob("*"):
            below = path.relative_to(home)
            if path.is_file() and not any(part.startswith(".") for part in below.parts):
                found[below.as_posix()] = path
    first = [name for name in found if "/" not in name]
    return tuple(InputFile(name, _sha256(found[name])) for name in [*first, *sorted(found.keys() - set(first))])


def inputs_sha256(inputs: Iterable[InputFile]) -> str:
    """One SHA-256 for all files: of their names and hashes, in order of the names."""
    lines = sorted(f"{each.sha256}  {each.path}\n" for each in inputs)
    return sha256("".join(lines).encode("utf-8", "surrogateescape"))


def _sha256(path: Path) -> str:
    with contextlib.suppress(InputError):
        return file_sha256(path)
    return ""
